//! From the exposures of a light to its picture.

use super::bracket::Light;
use super::{Hdr, MAX_TEXT};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::ReadOptions;
use yugen_archive::formats::image::rows::{Rows, Samples};
use yugen_archive::formats::{exif, response, stack};
use yugen_archive::read_bounded;
use yugen_capture::hdr::{Bracket, Noise, Radiance, Response, Shot, Tally, recover_response, shift};
use yugen_optics::Image;

/// Rows that are merged at a time.
const BAND: usize = 64;
/// Pictures are this wide at most where motion is looked for.
const GLANCE: usize = 512;
/// Pixels that the response is recovered from.
const PIXELS: usize = 8000;
/// What pictures that cannot be read row by row may hold in memory.
const KEPT: u64 = 1 << 30;

pub(super) struct Merged {
    pub image: Image,
    pub tally: Tally,
    pub moved: Option<f32>,
}

impl Hdr {
    /// How levels follow light: as the command says, else as the folder says.
    pub(super) fn response(&self, lights: &[Light], usual: stack::Response) -> Result<Response> {
        Ok(match self.response.as_deref() {
            None => match usual {
                stack::Response::Srgb => Response::Srgb,
                stack::Response::Linear => Response::Linear,
                stack::Response::Power(exponent) => Response::Power(exponent),
            },
            Some("srgb") => Response::Srgb,
            Some("linear") => Response::Linear,
            Some("recover") => {
                // Some lights tell as much as all.
                let step = lights.len().div_ceil(8);
                let some: Vec<&Light> = lights.iter().step_by(step).collect();
                let mut pixels = Vec::new();
                for light in &some {
                    pixels.extend(sample(light, PIXELS / some.len())?);
                }
                recover_response(pixels.iter().map(Vec::as_slice)).context(
                    "the response cannot be recovered: it takes exposures of different times in which pixels are neither \
                     black nor saturated; say --response srgb or linear",
                )?
            }
            Some(file) => {
                let path = Path::new(file);
                if !path.exists() {
                    bail!("--response {file}: expected srgb, linear, recover or a file that exists");
                }
                let levels = response::read(&read_bounded(path, MAX_TEXT)?, path)?;
                Response::table(levels).map_err(anyhow::Error::msg).with_context(|| file.to_string())?
            }
        })
    }

    /// Dark frames with their times, where they have any.
    pub(super) fn darks(&self) -> Result<Vec<(Option<f32>, PathBuf)>> {
        self.dark.iter().map(|path| Ok((exif::read(path)?.seconds, path.clone()))).collect()
    }

    /// Merges a bracket.
    pub(super) fn merge(
        &self,
        light: &Light,
        response: &Response,
        saturated: f32,
        darks: &[(Option<f32>, PathBuf)],
    ) -> Result<Merged> {
        let _span = tracing::info_span!("merge", light = light.name).entered();
        let mut allowance = KEPT;
        let mut open = |path: &Path| Rows::open(path, &ReadOptions::raw(), &mut allowance);
        let mut pictures = light.photographs.iter().map(|p| open(&p.path)).collect::<Result<Vec<_>, _>>()?;
        let dark_of = |seconds: f32| -> Option<&PathBuf> {
            let near = |t: &Option<f32>| t.is_some_and(|t| (t / seconds - 1.0).abs() < 0.02);
            darks
                .iter()
                .find(|d| near(&d.0))
                .or(Some(darks.first()?).filter(|_| darks.len() == 1))
                .map(|d| &d.1)
        };
        let mut dark_rows = Vec::new();
        for photograph in &light.photographs {
            let path = dark_of(photograph.seconds);
            if path.is_none() && !darks.is_empty() {
                bail!(
                    "{}: no dark frame was exposed for {} s; add one, or give a single one for all",
                    photograph.path.display(),
                    photograph.seconds
                );
            }
            dark_rows.push(path.map(|p| open(p)).transpose()?);
        }
        let (width, height, channels) = (pictures[0].width, pictures[0].height, pictures[0].channels);
        let kind = pictures[0].samples;
        let all = pictures.iter().zip(light.photographs.iter().map(|p| &p.path));
        let dark_files = dark_rows.iter().zip(&light.photographs);
        let dark_files = dark_files.filter_map(|(r, p)| Some((r.as_ref()?, dark_of(p.seconds)?)));
        for (rows, path) in all.chain(dark_files) {
            ensure!(
                (rows.width, rows.height, rows.channels) == (width, height, channels) && rows.samples == kind,
                "{}: the picture is {} x {} of {} channels, {}, but '{}' is {width} x {height} of {channels}, {}; all \
                 exposures need one size and format",
                path.display(),
                rows.width,
                rows.height,
                rows.channels,
                depth(rows.samples),
                light.photographs[0].path.display(),
                depth(kind)
            );
        }
        let (step, response) = match kind {
            Samples::Codes(max) => (1.0 / max as f32, response.clone()),
            // Floating-point pictures are linear by convention.
            Samples::Floats => (0.0, Response::Linear),
        };
        let noise = Noise { full_well: self.full_well, read: self.read_noise, step, saturated };
        let seconds: Vec<f32> = light.photographs.iter().map(|p| p.seconds).collect();
        let bracket = Bracket { seconds: &seconds, response: &response, noise };
        let mut glances: Vec<Glance> = seconds.iter().map(|_| Glance::new(width, height)).collect();
        let mut image = Image::new(width, height, &["R", "G", "B", "sigma.R", "sigma.G", "sigma.B"]);
        let mut tally = Tally::default();
        for (band, out) in image.data.chunks_mut(BAND * width * 6).enumerate() {
            let rows = out.len() / (width * 6);
            let levels = read_band(&mut pictures, width, rows)?;
            let mut lights = Vec::new();
            for dark in &mut dark_rows {
                lights.push(match dark {
                    Some(dark) => {
                        let mut levels = read_band(std::slice::from_mut(dark), width, rows)?.remove(0);
                        for v in &mut levels {
                            *v = [0, 1, 2].map(|c| response.light(c, v[c]));
                        }
                        Some(levels)
                    }
                    None => None,
                });
            }
            let merged: Vec<Radiance> = bracket.merge(width, &levels, &lights);
            tally.add(&merged);
            for (glance, (levels, &t)) in glances.iter_mut().zip(levels.iter().zip(&seconds)) {
                glance.add(band * BAND, levels, |level| {
                    let open = level >= 0.02 && level < saturated;
                    if open { response.light(1, level) / t } else { f32::NAN }
                });
            }
            for (out, r) in out.chunks_exact_mut(6).zip(merged) {
                out[..3].copy_from_slice(&r.value);
                out[3..].copy_from_slice(&r.sigma);
            }
        }
        ensure!(
            tally.saturated < tally.pixels,
            "light '{}': every pixel is saturated in every exposure; expose for a shorter time",
            light.name
        );
        // Neighbours in time have most in common.
        let moved = glances
            .windows(2)
            .filter_map(|pair| {
                Some(shift(&pair[0].sums, &pair[1].sums, pair[0].width, pair[0].height())?.length())
            })
            .map(|v| v * glances[0].factor as f32)
            .reduce(f32::max);
        if channels == 1 {
            image = image.select(&["R", "sigma.R"]).unwrap_or(image);
            image.channels = ["Y", "sigma.Y"].map(String::from).to_vec();
        }
        Ok(Merged { image, tally, moved })
    }
}

fn depth(samples: Samples) -> String {
    match samples {
        Samples::Codes(max) => format!("{} bits", (max + 1).ilog2()),
        Samples::Floats => "floating-point".into(),
    }
}

/// The next rows of each picture, the pictures side by side.
fn read_band(pictures: &mut [Rows], width: usize, rows: usize) -> Result<Vec<Vec<[f32; 3]>>> {
    std::thread::scope(|scope| {
        let workers: Vec<_> = pictures
            .iter_mut()
            .map(|picture| {
                scope.spawn(move || {
                    let mut band = vec![[0.0; 3]; width * rows];
                    band.chunks_exact_mut(width).try_for_each(|row| picture.next_row(row)).map(|()| band)
                })
            })
            .collect();
        let join = |w: std::thread::ScopedJoinHandle<'_, _>| {
            w.join().unwrap_or_else(|p| std::panic::resume_unwind(p))
        };
        workers.into_iter().map(join).collect::<Result<Vec<_>, _>>()
    })
    .map_err(Into::into)
}

/// Pixels of a bracket, evenly spread.
fn sample(light: &Light, count: usize) -> Result<Vec<Vec<Shot>>> {
    let mut pixels: Vec<Vec<Shot>> = Vec::new();
    for photograph in &light.photographs {
        let mut rows = Rows::open(&photograph.path, &ReadOptions::raw(), &mut { KEPT })?;
        let (w, h) = (rows.width, rows.height);
        let step = (((w * h) as f64 / count.max(1) as f64).sqrt().ceil() as usize).max(1);
        let mut line = vec![[0.0; 3]; w];
        let mut at = 0;
        for y in 0..h {
            rows.next_row(&mut line)?;
            if y % step != step / 2 {
                continue;
            }
            for level in line.iter().skip(step / 2).step_by(step) {
                if at == pixels.len() {
                    pixels.push(Vec::new());
                }
                pixels[at].push(Shot { level: *level, seconds: photograph.seconds });
                at += 1;
            }
        }
    }
    Ok(pixels)
}

/// A small grey picture of an exposure, to see whether anything moved.
struct Glance {
    factor: usize,
    width: usize,
    full: usize,
    sums: Vec<f32>,
}

impl Glance {
    fn new(width: usize, height: usize) -> Self {
        let factor = width.div_ceil(GLANCE).max(1);
        let (w, h) = (width / factor, height / factor);
        Self { factor, width: w, full: width, sums: vec![0.0; w * h] }
    }

    fn height(&self) -> usize {
        self.sums.len() / self.width.max(1)
    }

    fn add(&mut self, first: usize, levels: &[[f32; 3]], light: impl Fn(f32) -> f32) {
        let share = 1.0 / (self.factor * self.factor) as f32;
        for (y, row) in levels.chunks_exact(self.full).enumerate() {
            let j = (first + y) / self.factor;
            if j >= self.height() {
                continue;
            }
            for (i, pixels) in row.chunks_exact(self.factor).enumerate() {
                self.sums[j * self.width + i] += share * pixels.iter().map(|p| light(p[1])).sum::<f32>();
            }
        }
    }
}
