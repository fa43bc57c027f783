//! A stack folder as verbs read it: bands of photographs in linear sRGB.

use super::fit::SAMPLE_ROWS;
use anyhow::{Result, bail};
use std::path::Path;
use yugen_archive::formats::relit_files;
use yugen_archive::formats::stack::{Bands, Folder};
use yugen_capture::Stack;
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
