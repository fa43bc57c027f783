//! What a fit says about itself.

use anyhow::Result;
use serde_json::{Map as Json, json};
use std::path::{Path, PathBuf};
use yugen_archive::formats::btf::maps::{self, Map};
use yugen_archive::make_folder;
use yugen_capture::fit::compare::{HEADING, NAMES, errors, failed, quantile, row};
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
    pub learned: bool,
    /// What the ground is like; `None` where all was done before.
    pub surface: Option<Surface>,
    pub seconds: f64,
    pub truth: Option<&'a Btf>,
}

/// Below this confidence a texel counts as undecided.
const UNSURE: f32 = 0.1;
/// Above this it should be right.
const SURE: f32 = 0.5;

/// An error of this much is white in the pictures: parts of albedos and widths, degrees of directions.
const WHITE: [f32; 6] = [0.2, 0.2, 5.0, 20.0, 0.2, 0.2];

/// The pictures that [`Report::pictures`] makes.
pub fn files(folder: &Path, compared: bool) -> Vec<PathBuf> {
    let errors = NAMES.iter().filter(|_| compared).map(|name| format!("error_{name}.png"));
    let maps = Map::ALL.iter().map(|map| format!("{}.png", map.name()));
    maps.chain(["residual.png".into()]).chain(errors).map(|name| folder.join(name)).collect()
}

impl Report<'_> {
    fn errors(&self) -> Option<Vec<Option<[f32; 6]>>> {
        let each = self.maps.texels.iter().zip(&self.truth?.texels);
        // Where there is no cloth there is nothing to find.
        Some(
            each.map(|(got, want)| {
                (got.confidence > 0.0 && want.confidence > 0.0).then(|| errors(got, want))
            })
            .collect(),
        )
    }

    /// To the terminal, or as JSON for scripts.
    pub fn print(&self, as_json: bool) {
        let texels = self.maps.texels.len();
        let used = || self.maps.texels.iter().zip(self.residuals).filter(|(_, r)| **r > 0.0);
        let mut confidence: Vec<f32> = used().map(|(t, _)| t.confidence).collect();
        let unsure = confidence.iter().filter(|c| **c < UNSURE).count();
        let confidence = quantile(&mut confidence, 0.5).unwrap_or(0.0);
        let mut residuals: Vec<f32> = used().map(|(_, r)| *r).collect();
        let residual = [0.5, 0.9].map(|q| quantile(&mut residuals, q).unwrap_or(0.0));
        let errors = self.errors();
        let compared: Vec<[f32; 6]> = errors.iter().flatten().flatten().copied().collect();
        let found = |q: f32| -> [f32; 6] {
            std::array::from_fn(|i| {
                quantile(&mut compared.iter().map(|e| e[i]).collect::<Vec<_>>(), q).unwrap_or(0.0)
            })
        };
        let (median, ninety) = (found(0.5), found(0.9));
        let failures = compared.iter().filter(|e| failed(e)).count();
        let sure: Vec<&[f32; 6]> = errors
            .iter()
            .flatten()
            .zip(&self.maps.texels)
            .filter_map(|(e, t)| e.as_ref().filter(|_| t.confidence > SURE))
            .collect();
        let (sure, wrong) = (sure.len(), sure.iter().filter(|e| failed(e)).count());
        let [masked, ground, both, bare] = Kind::ALL.map(|k| self.kinds.iter().filter(|o| **o == k).count());
        let few = self.lights < FEWEST_FOR_HIGHLIGHTS;
        if as_json {
            let mut report = json!({
                "output": self.output.display().to_string(),
                "width": self.maps.width,
                "height": self.maps.height,
                "lights": self.lights,
                "masked": masked,
                "kinds": { "ground": ground, "ground_and_highlight": both, "highlight": bare },
                "few_lights": few,
                "surface": self.surface.map(|s| json!({ "ground": s.ground.name(), "slack": s.slack })),
                "unsure": unsure,
                "learned": self.learned,
                "median_confidence": confidence,
                "residual": { "median": residual[0], "ninety": residual[1] },
                "seconds": self.seconds,
                "texels_per_second": texels as f64 / self.seconds,
            });
            if errors.is_some() {
                let by_name = |e: &[f32; 6]| -> Json<String, serde_json::Value> {
                    NAMES.iter().zip(e).map(|(n, v)| (n.to_string(), json!(v))).collect()
                };
                report["errors"] = json!({
                    "texels": compared.len(),
                    "median": by_name(&median),
                    "ninety": by_name(&ninety),
                    "failed": failures,
                    "sure": sure,
                    "sure_and_failed": wrong,
                });
            }
            crate::json::print(report);
            return;
        }
        println!(
            "{}: {} x {} texels from up to {} readings each in {:.1} s ({:.0} texels/s)",
            self.output.display(),
            self.maps.width,
            self.maps.height,
            self.lights,
            self.seconds,
            texels as f64 / self.seconds
        );
        println!(
            "{} masked, {unsure} undecided (confidence below {UNSURE}); median confidence {confidence:.2}; residual {:.2} \
             standard deviations (90 % of texels below {:.2})",
            masked, residual[0], residual[1]
        );
        if few {
            println!(
                "{} lights are too few for highlights ({FEWEST_FOR_HIGHLIGHTS} are not): normals and grounds are those of \
                 robust photometric stereo, as of `yugen capture normals`",
                self.lights
            );
        } else {
            let found = (texels - masked).max(1) as f64;
            let [ground, both, bare] = [ground, both, bare].map(|n| 100.0 * n as f64 / found);
            println!(
                "{ground:.1} % are a ground without a highlight, {both:.1} % a ground with one, {bare:.1} % a highlight over \
                 next to no ground{}",
                self.surface.map_or(String::new(), |s| format!("; grounds are {}", s.ground.name()))
            );
        }
        if errors.is_some() {
            println!("against the truth {HEADING}");
            println!("median            {}", row(&median));
            println!("90th percentile   {}", row(&ninety));
            println!(
                "{:.1} % failed (normal off by 3°, tangent by 10° or a width by a quarter); of the {:.1} % with a confidence \
                 above {SURE}, {:.2} %",
                100.0 * failures as f64 / compared.len().max(1) as f64,
                100.0 * sure as f64 / compared.len().max(1) as f64,
                100.0 * wrong as f64 / sure.max(1) as f64
            );
        }
    }

    /// Pictures of maps, residual and errors.
    pub fn pictures(&self, folder: &Path) -> Result<()> {
        make_folder(folder)?;
        for map in Map::ALL {
            maps::save(&folder.join(format!("{}.png", map.name())), self.maps, map)?;
        }
        let (w, h) = (self.maps.width, self.maps.height);
        // Ten standard deviations are white.
        let residuals = self.residuals.iter().map(|r| Vec3::splat(0.1 * r));
        maps::save_numbers(&folder.join("residual.png"), w, h, 8, residuals)?;
        if let Some(errors) = self.errors() {
            for (i, (name, white)) in NAMES.iter().zip(WHITE).enumerate() {
                // What could not be compared is blue.
                let value =
                    |e: &Option<[f32; 6]>| e.map_or(Vec3::new(0.0, 0.0, 0.5), |e| Vec3::splat(e[i] / white));
                let path = folder.join(format!("error_{name}.png"));
                maps::save_numbers(&path, w, h, 8, errors.iter().map(value))?;
            }
        }
        Ok(())
    }
}
