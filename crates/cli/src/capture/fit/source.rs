//! What a cloth is fitted from: photographs from one side or several, or a table of readings.

use anyhow::{Result, bail};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use yugen_archive::formats::goniometer_csv::{self, Texels};
use yugen_archive::formats::stack::{Bands, Folder};
use yugen_archive::{read_bounded, read_filled};
use yugen_capture::Stack;
use yugen_optics::ColourSpace;

/// Where readings come from.
pub enum Source {
    /// Stacks of one size and kind, one from each side.
    Photographs(Vec<Folder>),
    /// Every texel with readings of its own.
    Table { path: PathBuf, texels: Texels },
}

/// Tables may have so many bytes: a gigabyte holds some ten million lines.
const LARGEST_TABLE: u64 = 4 << 30;

impl Source {
    /// Finds out which it is. `lights`: a list that lies elsewhere, for a single stack.
    pub fn open(paths: &[PathBuf], lights: Option<&Path>) -> Result<Self> {
        let is_table = |p: &PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
        match (paths, lights) {
            ([path], Some(_)) if is_table(path) => {
                bail!("{}: every line of a table has its light; leave out --lights", path.display())
            }
            ([path], Some(list)) => {
                if sides(path)?.is_some() {
                    bail!("{}: --lights is for a stack from one side; put a list into each", path.display());
                }
                Ok(Self::Photographs(vec![Folder::open_lit_by(path, list)?]))
            }
            (_, Some(_)) => bail!("--lights is for a stack from one side; put a list into each of several"),
            ([path], None) if is_table(path) => {
                let bytes = read_filled(path, LARGEST_TABLE)?;
                let texels = goniometer_csv::read_texels(&bytes, path, ColourSpace::LinearSrgb)?;
                Ok(Self::Table { path: path.clone(), texels })
            }
            (_, None) => match paths.iter().find(|p| is_table(p)) {
                Some(table) => bail!(
                    "{}: a table is fitted by itself; put the lines of several into one file",
                    table.display()
                ),
                None => Ok(Self::Photographs(folders(paths)?)),
            },
        }
    }

    /// Texels across and down.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Photographs(folders) => (folders[0].width, folders[0].height),
            Self::Table { texels, .. } => (texels.width, texels.height),
        }
    }

    /// How far the camera stood, in widths of the picture: the nearest of several. `None` of a table.
    pub fn camera_distance(&self) -> Option<f32> {
        match self {
            Self::Photographs(folders) => folders.iter().map(|f| f.camera_distance).reduce(f32::min),
            Self::Table { .. } => None,
        }
    }

    pub fn colour_space(&self) -> ColourSpace {
        match self {
            Self::Photographs(folders) => folders[0].colour_space,
            Self::Table { .. } => ColourSpace::LinearSrgb,
        }
    }

    /// Photographs, or the most readings that a texel has.
    pub fn readings(&self) -> usize {
        match self {
            Self::Photographs(folders) => folders.iter().map(|f| f.pictures.len()).sum(),
            Self::Table { texels, .. } => texels.starts.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0),
        }
    }

    /// In a few words, for the maps.
    pub fn describe(&self) -> String {
        match self {
            Self::Photographs(_) => format!("{} photographs", self.readings()),
            Self::Table { texels, .. } => format!("{} readings of a goniometer", texels.values.len()),
        }
    }

    /// What a checkpoint must agree in to be gone on from.
    pub fn identity(&self) -> String {
        let (width, height) = self.size();
        let mut text = format!("{width} {height}");
        let mut file = |path: &Path, more: &dyn std::fmt::Display| {
            let meta = std::fs::metadata(path).ok();
            let (length, modified) = meta.map_or((0, None), |m| (m.len(), m.modified().ok()));
            let _ = write!(text, "\n{} {more} {length} {modified:?}", path.display());
        };
        match self {
            Self::Table { path, .. } => file(path, &""),
            Self::Photographs(folders) => {
                for folder in folders {
                    file(&folder.path, &format_args!("{:?}", folder.options));
                    folder.pictures.iter().for_each(|p| file(&p.path, &p.light));
                }
            }
        }
        text
    }
}

/// The same rows of all stacks, side by side.
pub struct Sides<'a> {
    folders: &'a [Folder],
    bands: Vec<Bands<'a>>,
}

impl<'a> Sides<'a> {
    pub fn open(folders: &'a [Folder], rows: usize) -> Result<Self> {
        let bands = folders.iter().map(|f| f.bands(rows)).collect::<Result<_, _>>()?;
        Ok(Self { folders, bands })
    }

    pub fn skip_rows(&mut self, rows: usize) -> Result<()> {
        Ok(self.bands.iter_mut().try_for_each(|b| b.skip_rows(rows))?)
    }

    /// `None` after the last.
    pub fn next(&mut self) -> Result<Option<Stack>> {
        let mut stacks = Vec::new();
        for (folder, bands) in self.folders.iter().zip(&mut self.bands) {
            match bands.next().transpose()? {
                Some(band) => stacks.push(Stack::from_band(folder, band)),
                None => return Ok(None),
            }
        }
        Ok(if stacks.len() == 1 { stacks.pop() } else { Stack::join(&stacks) })
    }
}

/// The stacks that `views.csv` in a folder names, a line each behind its heading; `None` where there is none.
fn sides(path: &Path) -> Result<Option<Vec<PathBuf>>> {
    let list = path.join("views.csv");
    if !list.is_file() {
        return Ok(None);
    }
    let bytes = read_bounded(&list, LARGEST_TABLE)?;
    let text = String::from_utf8_lossy(&bytes);
    let names = text.lines().skip(1).filter_map(|l| l.split(',').next()).map(str::trim);
    Ok(Some(names.filter(|n| !n.is_empty()).map(|n| path.join(n)).collect()))
}

/// The stacks, all of one size and kind.
fn folders(stacks: &[PathBuf]) -> Result<Vec<Folder>> {
    let mut paths = Vec::new();
    for path in stacks {
        match sides(path)? {
            Some(sides) => paths.extend(sides),
            None => paths.push(path.clone()),
        }
    }
    let folders: Vec<Folder> = paths.iter().map(|p| Folder::open(p)).collect::<Result<_, _>>()?;
    let Some(first) = folders.first() else { bail!("there is no stack to fit") };
    for f in &folders {
        if (f.width, f.height) != (first.width, first.height) {
            bail!(
                "{}: the photographs are {} x {}, those of {} {} x {}; stacks from several sides show the same texels",
                f.path.display(),
                f.width,
                f.height,
                first.path.display(),
                first.width,
                first.height
            );
        }
        if (f.options.near, f.colour_space) != (first.options.near, first.colour_space) {
            bail!(
                "{}: near lamps or the colour space are not those of {}; stacks from several sides have both alike",
                f.path.display(),
                first.path.display()
            );
        }
    }
    Ok(folders)
}
