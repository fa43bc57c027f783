//! `yugen brdf pca directions`.

use super::open;
use crate::{json, progress};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use yugen_archive::formats::pca_basis::Basis;
use yugen_capture::pca::{self, Reach};
use yugen_optics::Vec3;
use yugen_reflectance::merl::{PHI_D, THETA_D, bin_centre};

/// The best directions for a few readings, as lines to which the readings are appended.
///
/// `yugen brdf pca directions -b merl.pca -n 5 > readings.txt`; write r g b (f in 1/sr, linear sRGB) behind the six
/// numbers of each line; `yugen brdf pca reconstruct -b merl.pca --values readings.txt -o new.binary`.
#[derive(Args)]
pub struct Directions {
    /// The basis.
    #[arg(short, long, value_name = "BASIS.pca")]
    basis: PathBuf,

    /// How many readings.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
    count: u32,

    /// The farthest that light and eye may lie from the normal, degrees.
    #[arg(long, value_name = "DEG", default_value_t = 80.0)]
    max_angle: f32,

    /// The least angle between light and eye, degrees: a lamp cannot stand in the camera.
    #[arg(long, value_name = "DEG", default_value_t = 5.0)]
    apart: f32,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// A row of a basis as a person sets it: all in degrees.
struct Setting {
    wo: Vec3,
    wi: Vec3,
    /// θ_h, θ_d, φ_d.
    half: [f32; 3],
    /// Of light and eye from the normal.
    theta: [f32; 2],
    /// Of the eye from the light, seen from above.
    azimuth: f32,
}

impl Setting {
    fn of(basis: &Basis, row: usize) -> Self {
        let bin = basis.bins[row] as usize;
        let centre = bin_centre(bin / (THETA_D * PHI_D), bin / PHI_D % THETA_D, bin % PHI_D);
        let (wo, wi) = pca::directions_of(bin);
        let azimuth = wi.truncate().angle_to(wo.truncate());
        Self {
            wo,
            wi,
            half: centre.map(f32::to_degrees),
            theta: [wi, wo].map(|w| w.z.min(1.0).acos().to_degrees()),
            azimuth: if azimuth.is_finite() { azimuth.to_degrees() } else { 0.0 },
        }
    }
}

/// Rows of a basis for a script.
pub fn listed(basis: &Basis, rows: &[usize]) -> Vec<serde_json::Value> {
    rows.iter()
        .map(|&row| {
            let s = Setting::of(basis, row);
            json!({
                "theta_h": s.half[0], "theta_d": s.half[1], "phi_d": s.half[2],
                "theta_i": s.theta[0], "theta_o": s.theta[1], "azimuth": s.azimuth,
                "wi": s.wi.to_array(), "wo": s.wo.to_array(),
            })
        })
        .collect()
}

impl Directions {
    pub fn run(self) -> Result<()> {
        if !(1.0..=90.0).contains(&self.max_angle) {
            bail!("--max-angle {}: expected 1 to 90 degrees", self.max_angle);
        }
        if !(0.0..=2.0 * self.max_angle).contains(&self.apart) {
            bail!(
                "--apart {}: expected 0 to {} degrees, twice --max-angle",
                self.apart,
                2.0 * self.max_angle
            );
        }
        let basis = open(&self.basis)?;
        let n = self.count as usize;
        if n > basis.components {
            bail!("{}: {}", self.basis.display(), too_few(&basis, n));
        }
        let bar = progress::bar(n as u64, self.json);
        let reach = Reach { most: self.max_angle.to_radians(), apart: self.apart.to_radians() };
        let rows = pca::optimal_rows(&basis, n, reach, &|x| bar.set_position((x * n as f64) as u64));
        bar.finish_and_clear();
        if rows.len() < n {
            bail!(
                "{}: has fewer than {n} pairs of directions within {} degrees of the normal and {} degrees apart",
                self.basis.display(),
                self.max_angle,
                self.apart
            );
        }
        if self.json {
            json::print(json!(listed(&basis, &rows)));
            return Ok(());
        }
        println!("# Append r g b to each line of numbers: f in 1/sr, linear sRGB.");
        println!("# wi_x wi_y wi_z wo_x wo_y wo_z");
        for (i, row) in rows.into_iter().enumerate() {
            let Setting { wo, wi, half: [h, d, p], theta, azimuth } = Setting::of(&basis, row);
            println!(
                "# {}: light {:.1} and eye {:.1} degrees from the normal, azimuth {azimuth:.1} from light to eye \
                 (theta_h {h:.2}, theta_d {d:.2}, phi_d {p:.2})",
                i + 1,
                theta[0],
                theta[1]
            );
            println!("{:.6} {:.6} {:.6} {:.6} {:.6} {:.6}", wi.x, wi.y, wi.z, wo.x, wo.y, wo.z);
        }
        Ok(())
    }
}

/// Why a basis does not do for `n` readings, and what would.
fn too_few(basis: &Basis, n: usize) -> String {
    let (tables, kept) = (basis.names.len(), basis.components);
    // Each table has three channels, and their mean takes one.
    let most = 3 * tables - 1;
    let cure = if n > most {
        format!("{tables} tables make {most} at most: take fewer readings or more tables")
    } else {
        format!("build it with --components {n}; if it has no more then, its tables are too much alike")
    };
    format!("has {kept} components of {tables} tables, too few for {n} readings; {cure}")
}
