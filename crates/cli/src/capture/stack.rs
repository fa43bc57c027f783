//! A stack folder as verbs read it: bands of photographs in linear sRGB.

use super::fit::SAMPLE_ROWS;
use anyhow::{Result, bail};
use std::path::Path;
use yugen_archive::formats::relit_files;
use yugen_archive::formats::stack::{Bands, Folder};
use yugen_capture::normals::{self, Surface};
use yugen_capture::{Stack, lighting};
use yugen_optics::{ColourSpace, Mat3, Vec3};

/// An opened stack whose colours become linear sRGB, in which display values are.
pub struct Source {
    /// What was opened.
    pub folder: Folder,
    to_srgb: Mat3,
}

impl Source {
    /// With its own lights, or those of a list that lies elsewhere.
    pub fn open(path: &Path, lights: Option<&Path>) -> Result<Self> {
        if relit_files::recognises(path) {
            bail!("{}: this is fitted already; expected a stack of photographs", path.display());
        }
        let folder = match lights {
            Some(list) => Folder::open_lit_by(path, list)?,
            None => Folder::open(path)?,
        };
        let to_srgb = folder.colour_space.matrix_to(ColourSpace::LinearSrgb);
        Ok(Self { folder, to_srgb })
    }

    pub fn bands(&self, rows: usize) -> Result<SrgbBands<'_>> {
        Ok(SrgbBands { source: self, bands: self.folder.bands(rows)? })
    }

    /// Up to `rows` rows from the middle.
    pub fn middle(&self, rows: usize) -> Result<Stack> {
        let rows = rows.min(self.folder.height);
        let mut bands = self.bands(rows)?;
        bands.bands.skip_rows((self.folder.height - rows) / 2)?;
        match bands.next()? {
            Some(stack) => Ok(stack),
            None => bail!("{}: the pictures of the stack have no rows", self.folder.path.display()),
        }
    }

    /// Bands of so many rows from each first row.
    pub fn sample(&self, of: Vec<(usize, usize)>) -> Result<Vec<Stack>> {
        let (mut sample, mut row) = (Vec::new(), 0);
        let mut bands = self.bands(SAMPLE_ROWS)?;
        for (first, rows) in of {
            bands.bands.skip_rows(first - row)?;
            sample.extend(bands.next()?);
            row = first + rows;
        }
        Ok(sample)
    }

    /// The whole stack, if its values fit into so many bytes.
    pub fn whole(&self, bytes: u64) -> Result<Stack> {
        let Folder { width, height, .. } = self.folder;
        let need = (width * height * self.folder.pictures.len() * size_of::<[f32; 3]>()) as u64;
        if need > bytes {
            bail!(
                "{}: all photographs at once need {} MiB; give more with --memory, or crop them",
                self.folder.path.display(),
                need >> 20
            );
        }
        self.middle(height)
    }
}

/// Brighter or darker than others by more than a third of a stop: lamps of one kind differ by less.
const ODD: f32 = 1.25;

/// What photographs say against their list of lights and their exposures.
pub struct Doubts {
    /// The part of all orders of the list that fits the photographs as well; `None` where they do not tell.
    pub by_chance: Option<f32>,
    /// Lights that are brighter or darker than the others say, the most so first, and by what factor.
    pub odd: Vec<(usize, f32)>,
}

impl Doubts {
    /// Of rows of one stack, whose texels are such a surface.
    pub fn of(sample: &[Stack], surface: &Surface, options: &normals::Options, threads: usize) -> Self {
        let brightness = normals::brightness(sample, surface, options, threads);
        let told = brightness.into_iter().enumerate().filter_map(|(i, b)| Some((i, b?)));
        let mut odd: Vec<(usize, f32)> = told.filter(|(_, b)| b.max(1.0 / b) > ODD).collect();
        let most = |b: f32| b.max(1.0 / b);
        odd.sort_by(|a, b| most(b.1).total_cmp(&most(a.1)));
        Self { by_chance: lighting::orders_as_good(sample), odd }
    }

    /// Warns of a list that the photographs do not follow; under few lights those of narrow highlights alone follow none.
    pub fn warn_of_list(&self, folder: &Folder) {
        if let Some(part) = self.by_chance.filter(|part| *part > lighting::BY_CHANCE) {
            tracing::warn!(
                "{}: the photographs do not follow the list of lights '{}': {:.0} % of all orders fit them as well; it may be \
                 that of another stack, or in another order, unless all there is are highlights too narrow for so few lights",
                folder.path.display(),
                folder.options.lights,
                100.0 * part
            );
        }
    }

    /// Warns of photographs that are brighter or darker than the others say.
    pub fn warn_of_brightness(&self, folder: &Folder) {
        let follows = self.by_chance.is_none_or(|part| part <= lighting::BY_CHANCE);
        if let Some((light, factor)) = self.odd.first().filter(|_| follows) {
            let more = match self.odd.len() {
                1 => String::new(),
                n => format!(", the most of {n} that are off by more than a third of a stop"),
            };
            tracing::warn!(
                "{}: {factor:.2} times as bright as the other photographs say{more}; was the exposure the same, and are the \
                 lamps? Say in stack.toml how bright each is (intensities)",
                folder.pictures[*light].path.display()
            );
        }
    }

    /// For scripts.
    pub fn json(&self, folder: &Folder) -> serde_json::Value {
        let name = |i: usize| folder.pictures[i].path.display().to_string();
        let odd =
            self.odd.iter().map(|(i, factor)| serde_json::json!({ "picture": name(*i), "factor": factor }));
        serde_json::json!({ "list_by_chance": self.by_chance, "odd": odd.collect::<Vec<_>>() })
    }
}

/// Where the camera was taken to stand: so far away, in widths of the picture.
pub fn camera(distance: f32) -> String {
    match distance.is_finite() {
        true => format!("the camera stood {distance:.2} widths of the picture away"),
        false => "the camera is taken to be far away (else say camera_distance in stack.toml)".into(),
    }
}

/// What to say of a blur of so many texels; `None` of sharp pictures.
pub fn blurred(texels: f32) -> Option<String> {
    (texels > 0.0).then(|| {
        format!(
            "the steepest steps in the photographs are as soft as a blur of {texels:.2} texels makes them (its standard \
             deviation): where normals change from texel to texel they are mixed, and the confidence is less"
        )
    })
}

/// Bands of a [`Source`].
pub struct SrgbBands<'a> {
    source: &'a Source,
    bands: Bands<'a>,
}

impl SrgbBands<'_> {
    pub fn next(&mut self) -> Result<Option<Stack>> {
        let Some(band) = self.bands.next().transpose()? else { return Ok(None) };
        let mut stack = Stack::from_band(&self.source.folder, band);
        if self.source.to_srgb != Mat3::IDENTITY {
            for v in &mut stack.values {
                *v = (self.source.to_srgb * Vec3::from_array(*v)).to_array();
            }
        }
        Ok(Some(stack))
    }
}
