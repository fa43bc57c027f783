//! The pictures that balls are looked for in.

use anyhow::{Result, anyhow, bail, ensure};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::ReadOptions;
use yugen_archive::formats::image::rows::Rows;
use yugen_archive::formats::stack::Response;
use yugen_capture::calibrate::Overview;

/// What a picture that is decoded as a whole may hold in memory.
const KEPT: u64 = 1 << 30;
/// Pictures that are kept, shrunk, to look for circles in.
const SHRUNK: usize = 48;

/// The name of a file without its folder.
pub fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The pictures of a stack.
pub struct Pictures {
    pub files: Vec<PathBuf>,
    pub width: usize,
    pub height: usize,
    /// The brightest that each pixel becomes.
    pub brightest: Vec<f32>,
    /// All of them, shrunk.
    pub overview: Overview,
    /// Names of pictures that cannot be used, and why.
    pub bad: Vec<(String, String)>,
    /// Of how many.
    total: usize,
}

impl Pictures {
    /// Reads every picture once: the size that most have, what they show at a glance, and which cannot be used.
    /// `look`: circles are looked for in them.
    pub fn read(files: Vec<PathBuf>, response: &Response, look: bool, bar: &ProgressBar) -> Result<Self> {
        let mut sizes: Vec<((usize, usize), usize)> = Vec::new();
        let mut bad = Vec::new();
        let mut good = Vec::new();
        for file in files {
            match Rows::open(&file, &ReadOptions::raw(), &mut { KEPT }) {
                Ok(rows) => {
                    let size = (rows.width, rows.height);
                    match sizes.iter_mut().find(|s| s.0 == size) {
                        Some(s) => s.1 += 1,
                        None => sizes.push((size, 1)),
                    }
                    good.push((file, size));
                }
                Err(e) => bad.push((name(&file), format!("{e:#}"))),
            }
        }
        let total = good.len() + bad.len();
        let most = sizes.iter().map(|s| s.1).max().unwrap_or(0);
        // Of equals the first, which is the first picture's.
        let usual = sizes.iter().find(|s| s.1 == most).map(|s| s.0);
        let Some((width, height)) = usual else { bail!(too_many_bad(&bad, total)) };
        good.retain(|(file, size)| {
            if *size != (width, height) {
                let (w, h) = size;
                bad.push((
                    name(file),
                    format!("{}: it is {w} x {h}, most others are {width} x {height}", file.display()),
                ));
            }
            *size == (width, height)
        });
        let mut pictures = Self {
            files: Vec::new(),
            width,
            height,
            brightest: vec![0.0; width * height],
            overview: Overview::new(width, height),
            bad,
            total,
        };
        let every = good.len().div_ceil(SHRUNK).max(1);
        for (i, (file, _)) in good.into_iter().enumerate() {
            bar.set_message(name(&file));
            match Grey::read(&file, response) {
                Ok(picture) => {
                    pictures.brightest.iter_mut().zip(&picture.values).for_each(|(a, b)| *a = a.max(*b));
                    if look && i % every == 0 {
                        pictures.overview.add(&picture.values, width);
                    }
                    pictures.files.push(file);
                }
                Err(e) => pictures.bad.push((name(&file), format!("{e:#}"))),
            }
            bar.inc(1);
        }
        pictures.check()?;
        Ok(pictures)
    }

    /// One bad picture of many is no matter; one of four is.
    pub fn check(&self) -> Result<()> {
        if self.files.is_empty() || 4 * self.bad.len() > self.total {
            bail!(too_many_bad(&self.bad, self.total));
        }
        Ok(())
    }
}

fn too_many_bad(bad: &[(String, String)], total: usize) -> anyhow::Error {
    let (first, why) = bad.first().map(|(n, w)| (n.as_str(), w.as_str())).unwrap_or_default();
    anyhow!(
        "{} of {total} pictures cannot be used, '{first}' for one: {why}; if they are no lights' pictures leave \
         them out with --skip '{first}'",
        bad.len()
    )
}

/// The light of a picture's pixels, grey.
pub struct Grey {
    pub values: Vec<f32>,
    width: usize,
    height: usize,
}

impl Grey {
    pub fn read(path: &Path, response: &Response) -> Result<Self> {
        let mut rows = Rows::open(path, &ReadOptions::raw(), &mut { KEPT })?;
        rows.set_response(|level| response.light(level));
        let (width, height) = (rows.width, rows.height);
        let mut line = vec![[0.0; 3]; width];
        let mut values = Vec::with_capacity(width * height);
        for _ in 0..height {
            rows.next_row(&mut line)?;
            // What an exposure could not hold is brighter than the rest.
            let grey = |v: &[f32; 3]| {
                let sum = v[0] + v[1] + v[2];
                if sum.is_nan() { f32::MAX / 4.0 } else { sum / 3.0 }
            };
            values.extend(line.iter().map(grey));
        }
        // Saturated pixels become twice as bright as the brightest that is known.
        let top = values.iter().copied().filter(|v| *v < f32::MAX / 4.0).fold(0.0, f32::max);
        values.iter_mut().for_each(|v| *v = v.min(2.0 * top));
        Ok(Self { values, width, height })
    }

    pub fn same_size(&self, path: &Path, width: usize, height: usize) -> Result<()> {
        ensure!(
            (self.width, self.height) == (width, height),
            "{}: the picture is {} x {}, the others are {width} x {height}",
            path.display(),
            self.width,
            self.height
        );
        Ok(())
    }
}
