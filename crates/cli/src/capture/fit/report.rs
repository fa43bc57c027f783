//! What a fit says about itself.

use super::super::stack::{blurred, camera};
use super::page;
use anyhow::Result;
use serde_json::{Map as Json, json};
use std::path::{Path, PathBuf};
use yugen_archive::formats::btf::maps::{self, Map};
use yugen_archive::{atomic_write, make_folder};
use yugen_capture::fit::compare::{
    HEADING, NAMES, NORMAL, NormalErrors, SURE, Step, UNDECIDED, WRONG, angle, calibration, errors, failed,
    numbers, quantile, row,
};
use yugen_capture::fit::{FEWEST_FOR_HIGHLIGHTS, Kind};
use yugen_capture::normals::Surface;
use yugen_optics::Vec3;
use yugen_reflectance::btf::{Btf, Texel};

pub struct Report<'a> {
    pub output: &'a Path,
    pub maps: &'a Btf,
    pub residuals: &'a [f32],
    /// Of the photographs, in texels.
    pub blur: f32,
    /// What each texel is made of.
    pub kinds: &'a [Kind],
    pub lights: usize,
    /// How far the camera stood, in widths of the picture; `None` of a table of readings, infinite if far away.
    pub camera_distance: Option<f32>,
    pub learned: bool,
    /// How much readings were found to be off: a part of them, and what black ones have.
    pub noise: Option<[f32; 2]>,
    /// What the ground is like; `None` where all was done before.
    pub surface: Option<Surface>,
    pub seconds: f64,
    /// With the truth, where there is one.
    pub comparison: Option<Comparison>,
}

/// What a fit is compared with.
pub enum Truth {
    /// All there is to know of each texel.
    Maps(Btf),
    /// Unit normals; zero where there is nothing to compare.
    Normals(Vec<Vec3>),
}

/// How an error is shown, in the order of [`NAMES`].
pub struct Shown {
    /// In English and Japanese.
    pub title: [&'static str; 2],
    /// Over a column.
    pub head: &'static str,
    /// An error of this much is white in its picture: a part, or degrees.
    pub white: f32,
}

const fn shown(title: [&'static str; 2], head: &'static str, white: f32) -> Shown {
    Shown { title, head, white }
}

pub const ERRORS: [Shown; 6] = [
    shown(["Error of ρ_d", "ρ_d の誤差"], "ρ_d", 0.2),
    shown(["Error of ρ_s", "ρ_s の誤差"], "ρ_s", 0.2),
    shown(["Error of the normal", "法線の誤差"], "normal", 5.0),
    shown(["Error of the direction", "向きの誤差"], "direction", 20.0),
    shown(["Error of the greater width", "広い方の幅の誤差"], "greater σ", 0.2),
    shown(["Error of the smaller width", "狭い方の幅の誤差"], "smaller σ", 0.2),
];

/// The files that [`Report::write`] makes, or may make where there is a truth.
pub fn files(folder: &Path, compared: bool) -> Vec<PathBuf> {
    let errors = NAMES.iter().filter(|_| compared).map(|name| format!("error_{name}.png"));
    let maps = Map::ALL.iter().map(|map| format!("{}.png", map.name()));
    let rest = ["residual.png", "kinds.png", "confidence.svg", "index.html"];
    let calibration = compared.then(|| "calibration.svg".to_string());
    let names = maps.chain(rest.map(String::from)).chain(calibration).chain(errors);
    names.map(|name| folder.join(name)).collect()
}

/// What came of a comparison with the truth.
pub struct Comparison {
    /// Errors of each texel, where all of the truth is known; `None` of texels where there is nothing to compare.
    errors: Option<Vec<Option<[f32; 6]>>>,
    /// Degrees by which the normal of each is off.
    normals: Vec<Option<f32>>,
    all: Option<Compared>,
    of_normals: Option<NormalErrors>,
    /// What confidences were worth.
    pub calibration: Vec<Step>,
}

/// The numbers of a comparison of maps.
struct Compared {
    texels: usize,
    median: [f32; 6],
    ninety: [f32; 6],
    failed: usize,
    sure: usize,
    sure_and_failed: usize,
}

impl Comparison {
    pub fn of(maps: &Btf, truth: &Truth) -> Self {
        let there = |t: &Texel| t.confidence > 0.0;
        // Where there is no cloth there is nothing to find.
        let errors: Option<Vec<Option<[f32; 6]>>> = match truth {
            Truth::Maps(truth) => {
                let each = maps.texels.iter().zip(&truth.texels);
                Some(each.map(|(got, want)| (there(got) && there(want)).then(|| errors(got, want))).collect())
            }
            Truth::Normals(_) => None,
        };
        let normals: Vec<Option<f32>> = match (truth, &errors) {
            (Truth::Normals(normals), _) => {
                let each = maps.texels.iter().zip(normals);
                each.map(|(t, n)| (there(t) && *n != Vec3::ZERO).then(|| angle(t.normal, *n))).collect()
            }
            (_, errors) => errors.iter().flatten().map(|e| e.map(|e| e[NORMAL])).collect(),
        };
        let pairs = maps.texels.iter().zip(&normals).filter_map(|(t, off)| Some((t.confidence, (*off)?)));
        let pairs: Vec<(f32, f32)> = pairs.collect();
        Self {
            all: errors.as_ref().and_then(|e| Compared::of(maps, e)),
            of_normals: NormalErrors::of(&pairs),
            calibration: calibration(&pairs),
            errors,
            normals,
        }
    }

    /// Numbers of the errors that are drawn.
    pub fn drawn(&self) -> Vec<usize> {
        match self.errors {
            Some(_) => (0..NAMES.len()).collect(),
            None => vec![NORMAL],
        }
    }

    /// An error of a texel, by its number.
    fn error(&self, texel: usize, i: usize) -> Option<f32> {
        match &self.errors {
            Some(errors) => errors[texel].map(|e| e[i]),
            None => self.normals[texel],
        }
    }

    /// Rows of errors as text, with their names, where all of the truth is known.
    pub fn table(&self) -> Option<[(&'static str, [String; 6]); 2]> {
        let all = self.all.as_ref()?;
        Some([("median", numbers(&all.median)), ("90th percentile", numbers(&all.ninety))])
    }
}

impl Compared {
    fn of(maps: &Btf, errors: &[Option<[f32; 6]>]) -> Option<Self> {
        let all: Vec<(f32, [f32; 6])> =
            maps.texels.iter().zip(errors).filter_map(|(t, e)| Some((t.confidence, (*e)?))).collect();
        if all.is_empty() {
            return None;
        }
        let found = |q: f32| -> [f32; 6] {
            std::array::from_fn(|i| {
                quantile(&mut all.iter().map(|(_, e)| e[i]).collect::<Vec<_>>(), q).unwrap_or(0.0)
            })
        };
        let sure = || all.iter().filter(|(confidence, _)| *confidence > SURE);
        Some(Self {
            texels: all.len(),
            median: found(0.5),
            ninety: found(0.9),
            failed: all.iter().filter(|(_, e)| failed(e)).count(),
            sure: sure().count(),
            sure_and_failed: sure().filter(|(_, e)| failed(e)).count(),
        })
    }
}

impl Report<'_> {
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

    pub fn median_confidence(&self) -> f32 {
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
        all.extend(self.camera_distance.map(camera));
        all.extend(blurred(self.blur));
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
        let compared = self.comparison.as_ref();
        if let Some(n) = compared.and_then(|c| c.of_normals) {
            all.push(format!(
                "against the truth the normals of {} texels are off by {:.2}° in the mean, {:.2}° in the median, 90 % by less \
                 than {:.2}°",
                n.texels, n.mean, n.median, n.ninety
            ));
        }
        if let Some(c) = compared.and_then(|c| c.all.as_ref()) {
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
        if let Some(c) = self.comparison.as_ref().and_then(|c| c.all.as_ref()) {
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
            "surface": self.surface.map(|s| json!({ "ground": s.ground.name(), "roughness": s.roughness, "slack": s.slack })),
            "unsure": self.unsure(),
            "blur": self.blur,
            "learned": self.learned,
            "noise": self.noise.map(|[part, floor]| json!({ "part": part, "floor": floor })),
            "median_confidence": self.median_confidence(),
            "residual": { "median": residual[0], "ninety": residual[1] },
            "seconds": self.seconds,
            "texels_per_second": self.maps.texels.len() as f64 / self.seconds,
        });
        let Some(compared) = &self.comparison else { return report };
        if let Some(c) = &compared.all {
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
        if let Some(n) = compared.of_normals {
            report["normals"] = json!({
                "texels": n.texels,
                "mean": n.mean,
                "median": n.median,
                "ninety": n.ninety,
                "sure": n.sure,
                "sure_mean": n.sure_mean,
                "sure_and_wrong": n.sure_and_wrong,
                "wrong_from_degrees": WRONG,
            });
        }
        let step = |s: &Step| {
            json!({
                "confidence": s.confidence,
                "texels": s.texels,
                "mean": s.mean,
                "ninety": s.ninety,
                "wrong": s.wrong,
            })
        };
        report["calibration"] = compared.calibration.iter().map(step).collect();
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
        for (compared, i) in self.comparison.iter().flat_map(|c| c.drawn().into_iter().map(move |i| (c, i))) {
            // What could not be compared is blue.
            let value = |t| {
                let error = compared.error(t, i);
                error.map_or(Vec3::new(0.0, 0.0, 0.5), |e| Vec3::splat(e / ERRORS[i].white))
            };
            numbers(&format!("error_{}.png", NAMES[i]), &mut (0..w * h).map(value))?;
        }
        let chart = |name: &str, figure: crate::figure::Figure| -> Result<()> {
            Ok(atomic_write(&folder.join(name), figure.svg()?.as_bytes())?)
        };
        chart("confidence.svg", page::histogram(&self.used().map(|(c, _)| c).collect::<Vec<_>>()))?;
        if let Some(compared) = &self.comparison {
            chart("calibration.svg", page::calibration(&compared.calibration))?;
        }
        atomic_write(&folder.join("index.html"), page::html(self)?.as_bytes())?;
        Ok(())
    }
}
