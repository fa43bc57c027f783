//! What a fit says about itself.

use super::super::stack::camera;
use super::page;
use anyhow::Result;
use serde_json::{Map as Json, json};
use std::path::{Path, PathBuf};
use yugen_archive::formats::btf::maps::{self, Map};
use yugen_archive::{atomic_write, make_folder};
use yugen_capture::fit::compare::{
    HEADING, NAMES, SURE, Step, UNDECIDED, angle, calibration, errors, failed, numbers, quantile, row,
};
use yugen_capture::fit::{FEWEST_FOR_HIGHLIGHTS, Kind};
use yugen_capture::normals::Surface;
use yugen_optics::Vec3;
use yugen_reflectance::btf::Btf;

pub struct Report<'a> {
    pub output: &'a Path,
    pub maps: &'a Btf,
    pub residuals: &'a [f32],
    /// What each texel is made of.
    pub kinds: &'a [Kind],
    pub lights: usize,
    /// How far the camera stood, in widths of the picture; `None` of a table of readings, infinite if far away.
    pub camera_distance: Option<f32>,
    pub learned: bool,
    /// What the ground is like; `None` where all was done before.
    pub surface: Option<Surface>,
    pub seconds: f64,
    pub truth: Option<&'a Truth>,
}

/// What a fit is compared with.
pub enum Truth {
    /// All there is to know of each texel.
    Maps(Btf),
    /// Unit normals; zero where there is nothing to compare.
    Normals(Vec<Vec3>),
}

/// An error of this much is white in the pictures: parts of albedos and widths, degrees of directions.
const WHITE: [f32; 6] = [0.2, 0.2, 5.0, 20.0, 0.2, 0.2];

/// The files that [`Report::write`] makes, or may make where there is a truth.
pub fn files(folder: &Path, compared: bool) -> Vec<PathBuf> {
    let errors = NAMES.iter().filter(|_| compared).map(|name| format!("error_{name}.png"));
    let maps = Map::ALL.iter().map(|map| format!("{}.png", map.name()));
    let rest = ["residual.png", "kinds.png", "confidence.svg", "index.html"];
    let calibration = compared.then(|| "calibration.svg".to_string());
    let names = maps.chain(rest.map(String::from)).chain(calibration).chain(errors);
    names.map(|name| folder.join(name)).collect()
}

/// Numbers of the errors that are drawn.
fn pictured(truth: Option<&Truth>) -> Vec<usize> {
    match truth {
        None => Vec::new(),
        Some(Truth::Maps(_)) => (0..NAMES.len()).collect(),
        Some(Truth::Normals(_)) => vec![NORMAL],
    }
}

/// Which of the errors is the normal's.
const NORMAL: usize = 2;

/// What came of a comparison.
struct Compared {
    texels: usize,
    median: [f32; 6],
    ninety: [f32; 6],
    failed: usize,
    sure: usize,
    sure_and_failed: usize,
}

/// What came of a comparison of normals alone, in degrees.
struct ComparedNormals {
    texels: usize,
    mean: f32,
    median: f32,
    ninety: f32,
}

impl Report<'_> {
    /// Number, name and what is white of the pictures of errors.
    pub fn error_pictures(&self) -> Vec<(usize, &'static str, f32)> {
        pictured(self.truth).into_iter().map(|i| (i, NAMES[i], WHITE[i])).collect()
    }

    /// Errors of each texel; where there is no cloth there is nothing to find.
    fn errors(&self) -> Option<Vec<Option<[f32; 6]>>> {
        let Some(Truth::Maps(truth)) = self.truth else { return None };
        let each = self.maps.texels.iter().zip(&truth.texels);
        Some(
            each.map(|(got, want)| {
                (got.confidence > 0.0 && want.confidence > 0.0).then(|| errors(got, want))
            })
            .collect(),
        )
    }

    /// Degrees by which the normal of each texel is off.
    fn normal_errors(&self) -> Option<Vec<Option<f32>>> {
        let texels = &self.maps.texels;
        Some(match self.truth? {
            Truth::Maps(_) => self.errors()?.into_iter().map(|e| e.map(|e| e[NORMAL])).collect(),
            Truth::Normals(normals) => texels
                .iter()
                .zip(normals)
                .map(|(t, n)| (t.confidence > 0.0 && *n != Vec3::ZERO).then(|| angle(t.normal, *n)))
                .collect(),
        })
    }

    fn compared(&self) -> Option<Compared> {
        let errors = self.errors()?;
        let all: Vec<[f32; 6]> = errors.iter().flatten().copied().collect();
        if all.is_empty() {
            return None;
        }
        let found = |q: f32| -> [f32; 6] {
            std::array::from_fn(|i| {
                quantile(&mut all.iter().map(|e| e[i]).collect::<Vec<_>>(), q).unwrap_or(0.0)
            })
        };
        let sure: Vec<&[f32; 6]> = errors
            .iter()
            .zip(&self.maps.texels)
            .filter_map(|(e, t)| e.as_ref().filter(|_| t.confidence > SURE))
            .collect();
        Some(Compared {
            texels: all.len(),
            median: found(0.5),
            ninety: found(0.9),
            failed: all.iter().filter(|e| failed(e)).count(),
            sure: sure.len(),
            sure_and_failed: sure.iter().filter(|e| failed(e)).count(),
        })
    }

    fn compared_normals(&self) -> Option<ComparedNormals> {
        let mut off: Vec<f32> = self.normal_errors()?.into_iter().flatten().collect();
        if off.is_empty() {
            return None;
        }
        let mean = off.iter().map(|o| f64::from(*o)).sum::<f64>() / off.len().max(1) as f64;
        let mut at = |q| quantile(&mut off, q).unwrap_or(0.0);
        let [median, ninety] = [at(0.5), at(0.9)];
        Some(ComparedNormals { texels: off.len(), mean: mean as f32, median, ninety })
    }

    /// What confidences were worth, where there is a truth.
    pub fn calibration(&self) -> Option<Vec<Step>> {
        let errors = self.normal_errors()?;
        let pairs = self.maps.texels.iter().zip(errors).filter_map(|(t, e)| Some((t.confidence, e?)));
        Some(calibration(&pairs.collect::<Vec<_>>()))
    }

    /// Rows of errors as text, with their names, where all of the truth is known.
    pub fn error_table(&self) -> Option<[(&'static str, [String; 6]); 2]> {
        let all = self.compared()?;
        Some([("median", numbers(&all.median)), ("90th percentile", numbers(&all.ninety))])
    }

    fn used(&self) -> impl Iterator<Item = (f32, f32)> {
        let each = self.maps.texels.iter().zip(self.residuals);
        each.filter(|(_, r)| **r > 0.0).map(|(t, r)| (t.confidence, *r))
    }

    /// Texels of each kind.
    fn counts(&self) -> [usize; 4] {
        Kind::ALL.map(|k| self.kinds.iter().filter(|o| **o == k).count())
    }

    fn unsure(&self) -> usize {
        self.used().filter(|(c, _)| *c < UNDECIDED).count()
    }

    fn median_confidence(&self) -> f32 {
        quantile(&mut self.used().map(|(c, _)| c).collect::<Vec<_>>(), 0.5).unwrap_or(0.0)
    }

    /// Median and 90th percentile.
    fn residual(&self) -> [f32; 2] {
        let mut residuals: Vec<f32> = self.used().map(|(_, r)| r).collect();
        [0.5, 0.9].map(|q| quantile(&mut residuals, q).unwrap_or(0.0))
    }

    fn few_lights(&self) -> bool {
        self.lights < FEWEST_FOR_HIGHLIGHTS
    }

    /// What there is to say, a sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let texels = self.maps.texels.len();
        let [masked, ground, both, bare] = self.counts();
        let residual = self.residual();
        let mut all = vec![
            format!(
                "{} x {} texels from up to {} readings each in {:.1} s ({:.0} texels/s)",
                self.maps.width,
                self.maps.height,
                self.lights,
                self.seconds,
                texels as f64 / self.seconds
            ),
            format!(
                "{masked} masked, {} undecided (confidence below {UNDECIDED}); median confidence {:.2}; residual {:.2} standard \
                 deviations (90 % of texels below {:.2})",
                self.unsure(),
                self.median_confidence(),
                residual[0],
                residual[1]
            ),
        ];
        all.extend(self.camera_distance.map(|d| camera(d)));
        if self.few_lights() {
            all.push(format!(
                "{} lights are too few for highlights ({FEWEST_FOR_HIGHLIGHTS} are not): normals and grounds are those of \
                 robust photometric stereo, as of `yugen capture normals`",
                self.lights
            ));
        } else {
            let found = (texels - masked).max(1) as f64;
            let [ground, both, bare] = [ground, both, bare].map(|n| 100.0 * n as f64 / found);
            all.push(format!(
                "{ground:.1} % are a ground without a highlight, {both:.1} % a ground with one, {bare:.1} % a highlight over \
                 next to no ground{}",
                self.surface.map_or(String::new(), |s| format!("; grounds are {}", s.ground.name()))
            ));
        }
        if let Some(n) = self.compared_normals() {
            all.push(format!(
                "against the truth the normals of {} texels are off by {:.2}° in the mean, {:.2}° in the median, 90 % by less \
                 than {:.2}°",
                n.texels, n.mean, n.median, n.ninety
            ));
        }
        if let Some(c) = self.compared() {
            all.push(format!(
                "{:.1} % failed (normal off by 3°, tangent by 10° or a width by a quarter); of the {:.1} % with a confidence \
                 above {SURE}, {:.2} %",
                100.0 * c.failed as f64 / c.texels.max(1) as f64,
                100.0 * c.sure as f64 / c.texels.max(1) as f64,
                100.0 * c.sure_and_failed as f64 / c.sure.max(1) as f64
            ));
        }
        all
    }

    /// To the terminal, or as JSON for scripts.
    pub fn print(&self, as_json: bool) {
        if as_json {
            crate::json::print(self.json());
            return;
        }
        let sentences = self.sentences();
        println!("{}: {}", self.output.display(), sentences[0]);
        sentences[1..].iter().for_each(|s| println!("{s}"));
        if let Some(c) = self.compared() {
            println!("against the truth {HEADING}");
            println!("median            {}", row(&c.median));
            println!("90th percentile   {}", row(&c.ninety));
        }
    }

    fn json(&self) -> serde_json::Value {
        let [masked, ground, both, bare] = self.counts();
        let residual = self.residual();
        let mut report = json!({
            "output": self.output.display().to_string(),
            "width": self.maps.width,
            "height": self.maps.height,
            "lights": self.lights,
            "camera_distance": self.camera_distance.filter(|d| d.is_finite()),
            "masked": masked,
            "kinds": { "ground": ground, "ground_and_highlight": both, "highlight": bare },
            "few_lights": self.few_lights(),
            "surface": self.surface.map(|s| json!({ "ground": s.ground.name(), "slack": s.slack })),
            "unsure": self.unsure(),
            "learned": self.learned,
            "median_confidence": self.median_confidence(),
            "residual": { "median": residual[0], "ninety": residual[1] },
            "seconds": self.seconds,
            "texels_per_second": self.maps.texels.len() as f64 / self.seconds,
        });
        if let Some(c) = self.compared() {
            let by_name = |e: &[f32; 6]| -> Json<String, serde_json::Value> {
                NAMES.iter().zip(e).map(|(n, v)| (n.to_string(), json!(v))).collect()
            };
            report["errors"] = json!({
                "texels": c.texels,
                "median": by_name(&c.median),
                "ninety": by_name(&c.ninety),
                "failed": c.failed,
                "sure": c.sure,
                "sure_and_failed": c.sure_and_failed,
            });
        }
        if let Some(n) = self.compared_normals() {
            report["normals"] =
                json!({ "texels": n.texels, "mean": n.mean, "median": n.median, "ninety": n.ninety });
        }
        if let Some(steps) = self.calibration() {
            let step = |s: &Step| {
                json!({
                    "confidence": s.confidence,
                    "texels": s.texels,
                    "mean": s.mean,
                    "ninety": s.ninety,
                    "wrong": s.wrong,
                })
            };
            report["calibration"] = steps.iter().map(step).collect();
        }
        report
    }

    /// The page, and the pictures and charts on it.
    pub fn write(&self, folder: &Path) -> Result<()> {
        make_folder(folder)?;
        for map in Map::ALL {
            maps::save(&folder.join(format!("{}.png", map.name())), self.maps, map)?;
        }
        let (w, h) = (self.maps.width, self.maps.height);
        let numbers = |name: &str, values: &mut dyn Iterator<Item = Vec3>| {
            maps::save_numbers(&folder.join(name), w, h, 8, values)
        };
        // Ten standard deviations are white.
        numbers("residual.png", &mut self.residuals.iter().map(|r| Vec3::splat(0.1 * r)))?;
        let colour = |k: &Kind| Vec3::from(page::colour(*k).map(f32::from)) / 255.0;
        numbers("kinds.png", &mut self.kinds.iter().map(colour))?;
        let (errors, normals) = (self.errors(), self.normal_errors());
        for (i, name, white) in self.error_pictures() {
            let error = |t: usize| match &errors {
                Some(errors) => errors[t].map(|e| e[i]),
                None => normals.as_ref().and_then(|n| n[t]),
            };
            // What could not be compared is blue.
            let value = |t| error(t).map_or(Vec3::new(0.0, 0.0, 0.5), |e| Vec3::splat(e / white));
            numbers(&format!("error_{name}.png"), &mut (0..w * h).map(value))?;
        }
        let chart = |name: &str, figure: crate::figure::Figure| -> Result<()> {
            Ok(atomic_write(&folder.join(name), figure.svg()?.as_bytes())?)
        };
        chart("confidence.svg", page::histogram(&self.used().map(|(c, _)| c).collect::<Vec<_>>()))?;
        if let Some(steps) = self.calibration() {
            chart("calibration.svg", page::calibration(&steps))?;
        }
        atomic_write(&folder.join("index.html"), page::html(self)?.as_bytes())?;
        Ok(())
    }
}
