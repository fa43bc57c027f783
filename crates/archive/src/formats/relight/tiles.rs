//! Where the pixels of a folder's pictures are: in one file each, or in tiles of many sizes, of which those of the full
//! size are read.
//!
//! Deep Zoom (a `.dzi` and `LEVEL/X_Y.jpg`), Zoomify (`ImageProperties.xml` and `TileGroupG/LEVEL-X-Y.jpg`), Google Maps
//! (`LEVEL/Y/X.jpg`), the files of IIIF's level 0 (`info.json` and `X,Y,W,H/W,/0/default.jpg`), and RelightLab's own: all
//! tiles of a picture behind each other in a `.tzb`, smallest size first, row after row, and where each begins in a
//! `.tzi` (tarzoom), or those of all pictures together, tile by tile (itarzoom: `planes.tzb` and `planes.tzi`).

use super::super::image::{ReadOptions, read_bytes};
use super::super::json;
use crate::{Error, Place, open, read_bounded};
use serde::Deserialize;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use yugen_optics::Image;

/// The largest index or description that is read: eight million tiles.
const MAX_INDEX: u64 = 1 << 26;

/// The smallest side of a tile: smaller ones would be more files than pixels deserve.
const LEAST_TILE: u64 = 16;

/// Levels that are looked for: the 65th would have 2^64 tiles across.
pub(super) const LEVELS: u32 = 64;

/// How a picture is cut into tiles at its full size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Grid {
    width: usize,
    height: usize,
    /// Pixels of a tile across and down, without those that it shares with its neighbours.
    side: [usize; 2],
    /// Pixels that it shares, on each side that has a neighbour.
    overlap: usize,
    /// Tiles at the right and bottom may be filled up to a whole one.
    filled: bool,
}

impl Grid {
    fn whole(width: usize, height: usize) -> Self {
        Self { width, height, side: [width, height], overlap: 0, filled: false }
    }

    /// From what a file says; a tile need not be larger than the picture.
    fn tiled(at: &Place, size: [usize; 2], side: [u64; 2], overlap: u64) -> Result<Self, Error> {
        if let Some(s) = side.iter().find(|s| !(LEAST_TILE..=65535).contains(*s)) {
            let problem = format!("tiles of {s} pixels; expected {LEAST_TILE} to 65535");
            return Err(Error::invalid(at.clone(), problem));
        }
        if overlap.saturating_mul(2) >= side[0].min(side[1]) {
            let problem = format!("tiles share {overlap} pixels of {}; expected less than half", side[0]);
            return Err(Error::invalid(at.clone(), problem));
        }
        let side = side.map(|s| s as usize);
        Ok(Self { width: size[0], height: size[1], side, overlap: overlap as usize, filled: false })
    }

    fn across(&self) -> usize {
        self.width.div_ceil(self.side[0])
    }

    fn down(&self) -> usize {
        self.height.div_ceil(self.side[1])
    }

    /// Left, top, width and height of the pixels of a tile, shared ones among them.
    fn pixels(&self, x: usize, y: usize) -> [usize; 4] {
        let part = |i: usize, side: usize, size: usize| {
            let from = (i * side).saturating_sub(self.overlap);
            (from, ((i + 1) * side + self.overlap).min(size) - from)
        };
        let (left, width) = part(x, self.side[0], self.width);
        let (top, height) = part(y, self.side[1], self.height);
        [left, top, width, height]
    }

    /// How many tiles a picture of so many levels has that halve, rounded up or down.
    fn smaller(&self, levels: u32, up: bool) -> u64 {
        let mut size = [self.width, self.height];
        let mut sum = 0;
        for _ in 1..levels {
            size = size.map(|s| if up { s.div_ceil(2) } else { (s / 2).max(1) });
            sum += size[0].div_ceil(self.side[0]) as u64 * size[1].div_ceil(self.side[1]) as u64;
        }
        sum
    }

    /// How many levels it takes until one tile holds the picture.
    fn levels(&self, up: bool) -> u32 {
        let mut size = [self.width, self.height];
        let mut levels = 1;
        while size[0] > self.side[0] || size[1] > self.side[1] {
            size = size.map(|s| if up { s.div_ceil(2) } else { (s / 2).max(1) });
            levels += 1;
        }
        levels
    }
}

/// A picture whose pixels can be asked for.
pub struct Picture {
    grid: Grid,
    source: Source,
}

enum Source {
    File(PathBuf),
    DeepZoom { level: PathBuf, extension: String },
    Google { level: PathBuf, extension: String, blank: bool },
    Zoomify { folder: PathBuf, level: u32, start: u64, extension: String },
    Iiif { folder: PathBuf, extension: String },
    Archive(Archive),
}

/// Tiles in one file.
struct Archive {
    path: PathBuf,
    file: File,
    /// Where the full size's tile of this picture begins, and where it ends.
    parts: Vec<[u64; 2]>,
}

impl Picture {
    /// Finds picture `number` of a folder and checks that it has the size that `info.json` says.
    pub fn open(folder: &Path, number: usize, size: [usize; 2], extension: &str) -> Result<Self, Error> {
        let name = format!("plane_{number}");
        let whole = folder.join(format!("{name}.{extension}"));
        if whole.is_file() {
            return Ok(Self { grid: Grid::whole(size[0], size[1]), source: Source::File(whole) });
        }
        for (index, number) in [("planes.tzi", number), (&format!("{name}.tzi"), 0)] {
            let index = folder.join(index);
            if index.is_file() {
                return archive(&index, number, size);
            }
        }
        let dzi = folder.join(format!("{name}.dzi"));
        if dzi.is_file() {
            return deep_zoom(&dzi, &folder.join(format!("{name}_files")), size);
        }
        let named = |suffix: &str| folder.join(format!("{name}{suffix}"));
        for folder in [named(""), named("_zoomify")] {
            let properties = folder.join("ImageProperties.xml");
            if properties.is_file() {
                return zoomify(&properties, folder, size, extension);
            }
        }
        let iiif = named("").join("info.json");
        if iiif.is_file() {
            return self::iiif(&iiif, named(""), size, extension);
        }
        for folder in [named(""), named("_google")] {
            if folder.join("0").is_dir() {
                let Some(level) = top_level(&folder) else { continue };
                let blank = folder.join("blank.png").is_file() && has_tiles(&level, extension);
                let mut grid = Grid::tiled(&Place::file(&folder), size, [256; 2], 0)?;
                grid.filled = true;
                return Ok(Self {
                    grid,
                    source: Source::Google { level, extension: extension.into(), blank },
                });
            }
        }
        let problem = format!(
            "neither the picture {name}.{extension} nor tiles of it ({name}.dzi, {name}.tzi, planes.tzi, \
             {name}/ImageProperties.xml, {name}/info.json, {name}/0/0/0.{extension}) are here; copy the folder again"
        );
        Err(Error::invalid(Place::file(folder), problem))
    }

    /// Each tile with the place of its first pixel in the picture and how many of its pixels count across and down.
    pub fn tiles(&mut self, mut take: impl FnMut([usize; 4], &Image)) -> Result<(), Error> {
        let grid = self.grid;
        for y in 0..grid.down() {
            for x in 0..grid.across() {
                let [left, top, width, height] = grid.pixels(x, y);
                // A filled tile is a whole one.
                let most = match grid.filled {
                    true => [width.max(grid.side[0]), height.max(grid.side[1])],
                    false => [width, height],
                };
                let options =
                    ReadOptions { max_samples: 3 * (most[0] * most[1]) as u64, ..ReadOptions::raw() };
                if self.is_blank(x, y) {
                    let mut white = Image::rgb(width, height);
                    white.data.fill(1.0);
                    take([left, top, width, height], &white);
                    continue;
                }
                let (path, bytes) = self.bytes(x, y, options.max_samples.saturating_mul(2).max(1 << 20))?;
                let image = read_bytes(&bytes, &path, &options)?;
                let found = [image.width, image.height];
                if image.channels.len() != 3 || found != [width, height] && found != most {
                    let problem = format!(
                        "expected {width} x {height} pixels of 3 channels; found {} x {} of {}",
                        image.width,
                        image.height,
                        image.channels.len()
                    );
                    return Err(Error::invalid(Place::file(path), problem));
                }
                take([left, top, width, height], &image);
            }
        }
        Ok(())
    }

    /// Whether a tile was left out because it is white, for which libvips puts a `blank.png` beside the levels.
    fn is_blank(&self, x: usize, y: usize) -> bool {
        match &self.source {
            Source::Google { level, extension, blank } => {
                *blank && !level.join(format!("{y}/{x}.{extension}")).exists()
            }
            _ => false,
        }
    }

    /// The bytes of a tile, and the file that they are from.
    fn bytes(&mut self, x: usize, y: usize, limit: u64) -> Result<(PathBuf, Vec<u8>), Error> {
        let path = match &mut self.source {
            Source::Archive(archive) => {
                let [from, to] = archive.parts[y * self.grid.across() + x];
                let io = |e| Error::io(&archive.path, e);
                if to - from > limit {
                    return Err(Error::TooLarge {
                        at: Place::byte(&archive.path, from),
                        what: "the size of a tile in bytes".into(),
                        asked: to - from,
                        limit,
                    });
                }
                let mut bytes = vec![0; (to - from) as usize];
                archive.file.seek(SeekFrom::Start(from)).map_err(io)?;
                archive.file.read_exact(&mut bytes).map_err(io)?;
                return Ok((archive.path.clone(), bytes));
            }
            Source::File(path) => path.clone(),
            Source::DeepZoom { level, extension } => level.join(format!("{x}_{y}.{extension}")),
            Source::Google { level, extension, .. } => level.join(format!("{y}/{x}.{extension}")),
            Source::Zoomify { folder, level, start, extension } => {
                let index = *start + (y * self.grid.across() + x) as u64;
                folder.join(format!("TileGroup{}/{level}-{x}-{y}.{extension}", index / 256))
            }
            Source::Iiif { folder, extension } => {
                let [left, top, width, height] = self.grid.pixels(x, y);
                let region = folder.join(format!("{left},{top},{width},{height}"));
                // Version 2 leaves the height of the result out, version 3 names it.
                let sizes = [format!("{width},"), format!("{width},{height}")];
                let name = |size: &String| region.join(size).join(format!("0/default.{extension}"));
                let found = sizes.iter().map(name).find(|path| path.is_file());
                found.unwrap_or_else(|| name(&sizes[0]))
            }
        };
        let bytes = read_bounded(&path, limit)?;
        Ok((path, bytes))
    }
}

/// Whether there is any tile with this extension in the folder of a level.
fn has_tiles(level: &Path, extension: &str) -> bool {
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    entries(level).any(|row| entries(&row).any(|tile| tile.extension().is_some_and(|e| e == extension)))
}

/// The folder of the highest level.
fn top_level(folder: &Path) -> Option<PathBuf> {
    (0..LEVELS).rev().map(|level| folder.join(level.to_string())).find(|path| path.is_dir())
}

fn same_size(at: &Place, found: [u64; 2], expected: [usize; 2]) -> Result<(), Error> {
    if found == expected.map(|n| n as u64) {
        return Ok(());
    }
    let problem = format!(
        "the tiles make {} x {} pixels; expected {} x {}, as {} says",
        found[0],
        found[1],
        expected[0],
        expected[1],
        super::INFO
    );
    Err(Error::invalid(at.clone(), problem))
}

/// A `.tzi`.
#[derive(Deserialize)]
struct Index {
    tilesize: u64,
    #[serde(default)]
    overlap: u64,
    width: u64,
    height: u64,
    offsets: Vec<u64>,
    /// Pictures whose tiles alternate.
    #[serde(default = "one")]
    stride: u64,
}

fn one() -> u64 {
    1
}

fn archive(path: &Path, number: usize, size: [usize; 2]) -> Result<Picture, Error> {
    let data = path.with_extension("tzb");
    let file = open(&data)?;
    let bytes = file.metadata().map_err(|e| Error::io(&data, e))?.len();
    let (grid, parts) = parts(&read_bounded(path, MAX_INDEX)?, path, number, size, bytes)?;
    let source = Source::Archive(Archive { path: data, file, parts });
    let mut picture = Picture { grid, source };
    // RelightLab's script says that tiles share nothing whatever they share; the last one knows, which always reaches from
    // the border of the picture as far beyond its own place as others do (the first may be all there is across).
    if grid.overlap == 0 && (grid.across() > 1 || grid.down() > 1) {
        let [x, y] = if grid.across() > 1 { [grid.across() - 1, 0] } else { [0, grid.down() - 1] };
        let most = [(grid.side[0], grid.width), (grid.side[1], grid.height)].map(|(s, n)| (s + s / 2).min(n));
        let options = ReadOptions { max_samples: 3 * (most[0] * most[1]) as u64, ..ReadOptions::raw() };
        let (path, bytes) = picture.bytes(x, y, options.max_samples.saturating_mul(2).max(1 << 20))?;
        let last = read_bytes(&bytes, &path, &options)?;
        let shared = if grid.across() > 1 {
            last.width as i64 - (grid.width - x * grid.side[0]) as i64
        } else {
            last.height as i64 - (grid.height - y * grid.side[1]) as i64
        };
        // Other sizes are told as what is wrong with the tile.
        if (1..grid.side[0] as i64 / 2).contains(&shared) {
            picture.grid.overlap = shared as usize;
        }
    }
    Ok(picture)
}

/// Checks a `.tzi`: how the picture is cut, and where in a `.tzb` of so many bytes each tile of picture `number` is.
fn parts(
    text: &[u8],
    path: &Path,
    number: usize,
    size: [usize; 2],
    bytes: u64,
) -> Result<(Grid, Vec<[u64; 2]>), Error> {
    let index: Index = serde_json::from_slice(text).map_err(|e| {
        let problem = format!("no index of tiles: {}", json::problem(&e));
        Error::invalid(Place::line(path, e.line(), e.column()), problem)
    })?;
    let at = Place::file(path);
    let invalid = |problem: String| Err(Error::invalid(at.clone(), problem));
    same_size(&at, [index.width, index.height], size)?;
    let grid = Grid::tiled(&at, size, [index.tilesize; 2], index.overlap)?;
    if index.stride <= number as u64 {
        return invalid(format!("the tiles are those of {} pictures; expected more", index.stride));
    }
    let stride = usize::try_from(index.stride).unwrap_or(usize::MAX);
    // Never more than there are pixels.
    let tiles = grid.across() * grid.down();
    let all = index.offsets.len().saturating_sub(1);
    if all / stride < tiles || !all.is_multiple_of(stride) {
        return invalid(format!(
            "there are {all} tiles of {stride} pictures; expected {} and as many again for each smaller size",
            tiles.saturating_mul(stride)
        ));
    }
    // The full size comes last.
    let first = all - tiles * stride + number;
    let part = |i: usize| [index.offsets[first + i * stride], index.offsets[first + i * stride + 1]];
    let parts: Vec<_> = (0..tiles).map(part).collect();
    if let Some([from, to]) = parts.iter().find(|[from, to]| from > to || *to > bytes) {
        return invalid(format!("a tile lies between the bytes {from} and {to} of {bytes}"));
    }
    Ok((grid, parts))
}

/// The attributes of an XML file's elements: what the small files beside tiles say.
struct Attributes<'a> {
    tree: roxmltree::Document<'a>,
    path: &'a Path,
}

impl<'a> Attributes<'a> {
    fn parse(bytes: &'a [u8], path: &'a Path) -> Result<Self, Error> {
        let text = std::str::from_utf8(bytes)
            .map_err(|e| Error::invalid(Place::byte(path, e.valid_up_to() as u64), "expected UTF-8 text"))?;
        let options = roxmltree::ParsingOptions { nodes_limit: 1000, ..Default::default() };
        let tree = roxmltree::Document::parse_with_options(text, options).map_err(|e| {
            let at = e.pos();
            Error::invalid(Place::line(path, at.row as usize, at.col as usize), "not well-formed XML")
        })?;
        Ok(Self { tree, path })
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.tree.descendants().find_map(|node| node.attribute(name))
    }

    fn number(&self, name: &str) -> Result<u64, Error> {
        let text = self.text(name).unwrap_or_default();
        text.trim().parse().map_err(|_| {
            let found = text.chars().take(40).collect::<String>().escape_debug().to_string();
            let problem = format!("expected {name}=\"…\", a whole number; found '{found}'");
            Error::invalid(Place::file(self.path), problem)
        })
    }
}

/// An extension that a file names.
fn plain(extension: &str, at: &Place) -> Result<String, Error> {
    match extension {
        "jpg" | "jpeg" | "png" => Ok(extension.into()),
        other => {
            let found = other.chars().take(40).collect::<String>().escape_debug().to_string();
            let problem = format!("tiles of the format '{found}' are not read; expected jpg or png");
            Err(Error::invalid(at.clone(), problem))
        }
    }
}

fn deep_zoom(path: &Path, files: &Path, size: [usize; 2]) -> Result<Picture, Error> {
    let (grid, extension) = dzi(&read_bounded(path, MAX_INDEX)?, path, size)?;
    let Some(level) = top_level(files) else {
        return Err(Error::invalid(Place::file(files), "there are no levels of tiles in this folder"));
    };
    Ok(Picture { grid, source: Source::DeepZoom { level, extension } })
}

fn dzi(bytes: &[u8], path: &Path, size: [usize; 2]) -> Result<(Grid, String), Error> {
    let at = Place::file(path);
    let said = Attributes::parse(bytes, path)?;
    same_size(&at, [said.number("Width")?, said.number("Height")?], size)?;
    let grid = Grid::tiled(&at, size, [said.number("TileSize")?; 2], said.number("Overlap")?)?;
    Ok((grid, plain(said.text("Format").unwrap_or("jpg"), &at)?))
}

fn zoomify(path: &Path, folder: PathBuf, size: [usize; 2], extension: &str) -> Result<Picture, Error> {
    let bytes = read_bounded(path, MAX_INDEX)?;
    let grid = properties(&bytes, path, size)?;
    // Smaller levels come first in the numbering of tiles by most programs; RelightLab begins with the full size.
    for up in [false, true] {
        let levels = grid.levels(up);
        let level = levels - 1;
        for start in [grid.smaller(levels, up), 0] {
            let first = format!("TileGroup{}/{level}-0-0.{extension}", start / 256);
            if folder.join(first).is_file() {
                let source = Source::Zoomify { folder, level, start, extension: extension.into() };
                return Ok(Picture { grid, source });
            }
        }
    }
    Err(Error::invalid(Place::file(folder), "there is no tile 0-0 of the full size in this folder"))
}

fn properties(bytes: &[u8], path: &Path, size: [usize; 2]) -> Result<Grid, Error> {
    let at = Place::file(path);
    let said = Attributes::parse(bytes, path)?;
    same_size(&at, [said.number("WIDTH")?, said.number("HEIGHT")?], size)?;
    Grid::tiled(&at, size, [said.number("TILESIZE")?; 2], 0)
}

/// The parts of IIIF's `info.json` that count.
#[derive(Deserialize)]
struct Iiif {
    width: u64,
    height: u64,
    tiles: Vec<IiifTiles>,
}

#[derive(Deserialize)]
struct IiifTiles {
    width: u64,
    height: Option<u64>,
}

fn iiif(path: &Path, folder: PathBuf, size: [usize; 2], extension: &str) -> Result<Picture, Error> {
    let grid = iiif_info(&read_bounded(path, MAX_INDEX)?, path, size)?;
    Ok(Picture { grid, source: Source::Iiif { folder, extension: extension.into() } })
}

fn iiif_info(text: &[u8], path: &Path, size: [usize; 2]) -> Result<Grid, Error> {
    let info: Iiif = serde_json::from_slice(text).map_err(|e| {
        let problem = format!("no IIIF description of tiles: {}", json::problem(&e));
        Error::invalid(Place::line(path, e.line(), e.column()), problem)
    })?;
    let at = Place::file(path);
    same_size(&at, [info.width, info.height], size)?;
    let Some(tiles) = info.tiles.first() else {
        return Err(Error::invalid(at, "the picture has no tiles; expected a width and a height of them"));
    };
    Grid::tiled(&at, size, [tiles.width, tiles.height.unwrap_or(tiles.width)], 0)
}

/// Reads what stands beside tiles, whichever of the formats it is, as if `data` bytes of tiles came with it: for tests.
/// How many tiles there are.
pub fn read_index(bytes: &[u8], path: &Path, size: [usize; 2], data: u64) -> Result<usize, Error> {
    let grid = match bytes.trim_ascii_start() {
        [b'<', ..] if bytes.windows(9).any(|w| w == b"TILESIZE=") => properties(bytes, path, size)?,
        [b'<', ..] => dzi(bytes, path, size)?.0,
        _ if bytes.windows(7).any(|w| w == b"\"tiles\"") => iiif_info(bytes, path, size)?,
        _ => parts(bytes, path, 0, size, data)?.0,
    };
    Ok(grid.across() * grid.down())
}
