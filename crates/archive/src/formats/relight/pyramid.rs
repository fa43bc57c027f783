//! Writes the pictures of a folder whole or in tiles of every size, each half as large as the one before.

use super::QUALITY;
use super::tiles::LEVELS;
use crate::{Error, Place, atomic_write, make_folder};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Pixels of a tile across and down, as viewers expect where nothing says so.
const TILE: usize = 256;

/// How the pictures of a folder are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Layout {
    /// Each in one JPEG.
    #[default]
    Image,
    /// Each in tiles, a JPEG a tile, with a `.dzi`; the smallest level is the first that fits into one tile.
    DeepZoom,
    /// Each in tiles that stand behind each other in one file, with a `.tzi`.
    TarZoom,
    /// All of them in tiles in one file, with one `.tzi`.
    ITarZoom,
}

impl Layout {
    /// Every layout that is written.
    pub const ALL: [Self; 4] = [Self::Image, Self::DeepZoom, Self::TarZoom, Self::ITarZoom];

    /// A file that every folder of this layout has.
    pub(super) fn mark(self) -> &'static str {
        match self {
            Self::Image => "plane_0.jpg",
            Self::DeepZoom => "plane_0.dzi",
            Self::TarZoom => "plane_0.tzi",
            Self::ITarZoom => "planes.tzi",
        }
    }

    /// As viewers call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Image => "image",
            Self::DeepZoom => "deepzoom",
            Self::TarZoom => "tarzoom",
            Self::ITarZoom => "itarzoom",
        }
    }
}

/// Writes pictures one after the other.
pub(super) struct Writer<'a> {
    folder: &'a Path,
    layout: Layout,
    size: [usize; 2],
    /// How many levels there are, 1 where the picture fits into a tile.
    levels: u32,
    /// The tiles of each picture, which [`Layout::ITarZoom`] puts in another order.
    waiting: Vec<Vec<Vec<u8>>>,
}

impl<'a> Writer<'a> {
    /// For so many pictures of this size.
    pub fn new(folder: &'a Path, layout: Layout, size: [usize; 2], pictures: usize) -> Result<Self, Error> {
        if let Some(n) = size.iter().find(|n| layout == Layout::Image && **n > 65535) {
            let problem = format!(
                "{n} texels are too many across or down for a JPEG, which holds 65535; write tiles (deepzoom)"
            );
            return Err(Error::invalid(Place::file(folder), problem));
        }
        // The count of viewers: sizes are halved and rounded down, levels are as many as rounding up would need.
        let levels = size[0].max(size[1]).div_ceil(TILE).next_power_of_two().trailing_zeros() + 1;
        Ok(Self { folder, layout, size, levels, waiting: Vec::with_capacity(pictures) })
    }

    /// Writes picture `number`, or keeps its tiles; pictures come in their order.
    pub fn picture(&mut self, number: usize, pixels: &[u8]) -> Result<(), Error> {
        let name = format!("plane_{number}");
        let [width, height] = self.size;
        match self.layout {
            Layout::Image => {
                let path = self.folder.join(format!("{name}.jpg"));
                let whole = Level { size: self.size, pixels: pixels.into() };
                atomic_write(&path, &whole.jpeg([0, 0, width, height], &path)?)
            }
            Layout::DeepZoom => {
                let files = self.folder.join(format!("{name}_files"));
                // Of a larger picture that was here before: readers take the highest level for the whole.
                for level in (self.levels..LEVELS).map(|n| files.join(n.to_string())).filter(|f| f.is_dir()) {
                    std::fs::remove_dir_all(&level).map_err(|e| Error::io(&level, e))?;
                }
                self.each_level(pixels, |number, level| {
                    let folder = files.join(number.to_string());
                    make_folder(&folder)?;
                    let [across, down] = level.tiles();
                    for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                        let path = folder.join(format!("{x}_{y}.jpg"));
                        atomic_write(&path, &level.tile(x, y, &path)?)?;
                    }
                    Ok(())
                })?;
                let text = format!(
                    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Image xmlns=\"http://schemas.microsoft.com/deepzoom/2008\"\n  \
                     Format=\"jpg\"\n  Overlap=\"0\"\n  TileSize=\"{TILE}\">\n  <Size Height=\"{height}\" Width=\"{width}\"/>\n</Image>\n"
                );
                atomic_write(&self.folder.join(format!("{name}.dzi")), text.as_bytes())
            }
            Layout::TarZoom => {
                let tiles = self.all_tiles(pixels)?;
                self.archive(&name, tiles, None)
            }
            Layout::ITarZoom => {
                let tiles = self.all_tiles(pixels)?;
                self.waiting.push(tiles);
                Ok(())
            }
        }
    }

    /// After the last picture.
    pub fn finish(mut self) -> Result<(), Error> {
        let pictures = std::mem::take(&mut self.waiting);
        if pictures.is_empty() {
            return Ok(());
        }
        let stride = pictures.len();
        let mut pictures: Vec<_> = pictures.into_iter().map(Vec::into_iter).collect();
        let mut tiles = Vec::new();
        loop {
            let next: Vec<_> = pictures.iter_mut().filter_map(Iterator::next).collect();
            if next.is_empty() {
                break;
            }
            tiles.extend(next);
        }
        self.archive("planes", tiles, Some(stride))
    }

    /// From the full size, which has the largest number, down to the smallest, number 0.
    fn each_level(
        &self,
        pixels: &[u8],
        mut take: impl FnMut(u32, &Level) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut level = Level { size: self.size, pixels: pixels.into() };
        for number in (0..self.levels).rev() {
            take(number, &level)?;
            if number > 0 {
                level = level.half();
            }
        }
        Ok(())
    }

    /// Smallest level first, row after row.
    fn all_tiles(&self, pixels: &[u8]) -> Result<Vec<Vec<u8>>, Error> {
        let mut levels = Vec::new();
        self.each_level(pixels, |_, level| {
            let [across, down] = level.tiles();
            let places = (0..down).flat_map(|y| (0..across).map(move |x| (x, y)));
            levels.push(places.map(|(x, y)| level.tile(x, y, self.folder)).collect::<Result<Vec<_>, _>>()?);
            Ok(())
        })?;
        Ok(levels.into_iter().rev().flatten().collect())
    }

    fn archive(&self, name: &str, tiles: Vec<Vec<u8>>, stride: Option<usize>) -> Result<(), Error> {
        let mut offsets = vec![0];
        let mut data = Vec::with_capacity(tiles.iter().map(Vec::len).sum());
        for tile in tiles {
            data.extend(tile);
            offsets.push(data.len());
        }
        let path = |extension: &str| -> PathBuf { self.folder.join(format!("{name}.{extension}")) };
        atomic_write(&path("tzb"), &data)?;
        let mut index = json!({
            "tilesize": TILE,
            "overlap": 0,
            "format": "jpg",
            "width": self.size[0],
            "height": self.size[1],
            "nlevels": self.levels,
            "offsets": offsets,
        });
        if let Some(stride) = stride {
            index["mode"] = "interleaved".into();
            index["stride"] = stride.into();
        }
        atomic_write(&path("tzi"), format!("{index}\n").as_bytes())
    }
}

/// A picture at one size.
struct Level<'a> {
    size: [usize; 2],
    /// Red, green and blue of each pixel.
    pixels: std::borrow::Cow<'a, [u8]>,
}

impl Level<'_> {
    fn tiles(&self) -> [usize; 2] {
        self.size.map(|n| n.div_ceil(TILE))
    }

    fn tile(&self, x: usize, y: usize, path: &Path) -> Result<Vec<u8>, Error> {
        let [width, height] = self.size;
        let part = |i: usize, size: usize| (i * TILE, TILE.min(size - i * TILE));
        let ((left, across), (top, down)) = (part(x, width), part(y, height));
        self.jpeg([left, top, across, down], path)
    }

    /// A part of it as JPEG; `path` is for messages.
    fn jpeg(&self, [left, top, width, height]: [usize; 4], path: &Path) -> Result<Vec<u8>, Error> {
        let row = |y: usize| &self.pixels[((top + y) * self.size[0] + left) * 3..][..width * 3];
        let part: Vec<u8>;
        let bytes = if [width, height] == self.size {
            &self.pixels[..]
        } else {
            part = (0..height).flat_map(|y| row(y).iter().copied()).collect();
            &part
        };
        let mut jpeg = Vec::new();
        ::image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
            .encode(bytes, width as u32, height as u32, ::image::ExtendedColorType::Rgb8)
            .map_err(|e| Error::invalid(Place::file(path), e.to_string()))?;
        Ok(jpeg)
    }

    /// Half the size, rounded down: each pixel the mean of four, or of two at the side of a picture one pixel wide.
    fn half(&self) -> Level<'static> {
        let [width, height] = self.size;
        let size = self.size.map(|n| (n / 2).max(1));
        let mut pixels = Vec::with_capacity(size[0] * size[1] * 3);
        for y in 0..size[1] {
            let rows = [2 * y, (2 * y + 1).min(height - 1)];
            for x in 0..size[0] {
                let columns = [2 * x, (2 * x + 1).min(width - 1)];
                for c in 0..3 {
                    let at =
                        |row: usize, column: usize| u16::from(self.pixels[(row * width + column) * 3 + c]);
                    let sum: u16 = rows.iter().flat_map(|r| columns.map(|x| at(*r, x))).sum();
                    pixels.push(((sum + 2) / 4) as u8);
                }
            }
        }
        Level { size, pixels: pixels.into() }
    }
}
