//! `yugen brdf convert`.

use super::subject::{Model, Subject};
use crate::json;
use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use std::f32::consts::TAU;
use std::path::PathBuf;
use yugen_archive::formats::{goniometer, measured, merl, rgl};
use yugen_archive::{atomic_write, check_outputs, check_writable};
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_optics::{Mat3, Vec3};
use yugen_reflectance::merl::tabulate;
use yugen_reflectance::rgl::{Measurement, Sweep};
use yugen_reflectance::tabulated::Goniometry;
use yugen_reflectance::{Bsdf, Kind};

/// Writes a model or a measurement as a MERL .binary, a goniometer .gonio or an RGL .bsdf (for Mitsuba's `measured`),
/// reads it back and says how far the two are apart.
#[derive(Args)]
pub struct Convert {
    #[command(flatten)]
    subject: Subject,

    /// Where to: NAME.binary (isotropic materials only), NAME.gonio or NAME.bsdf.
    output: PathBuf,

    /// Between the angles of a .gonio, or the eye's of a .bsdf, degrees; azimuths of the eye are three times as far
    /// apart.
    #[arg(long, value_name = "DEG", default_value_t = 5.0)]
    step: f32,

    /// As JSON.
    #[arg(long)]
    json: bool,
}

/// Pairs of directions that are compared.
const PAIRS: usize = 20_000;
/// Compared up to this angle: beyond it a table's last cells say little about any model.
const STEEPEST: f32 = 80.0;

impl Convert {
    /// Does it.
    pub fn run(self) -> Result<()> {
        if !(1.0..=30.0).contains(&self.step) {
            bail!("--step {}: expected 1 to 30 degrees", self.step);
        }
        let target =
            measured::written_kind(&self.output).or_else(|e| match measured::kind(&self.output) {
                Ok(_) => bail!(
                    "{}: a .{} is only read; write a .binary, .gonio or .bsdf",
                    self.output.display(),
                    self.output.extension().unwrap_or_default().to_string_lossy()
                ),
                Err(_) => bail!(e),
            })?;
        check_writable(&self.output)?;
        let space = self.subject.space();
        let named = self.subject.named()?;
        let source = named.build()?;
        check_outputs([&self.output])?;
        let bsdf = source.bsdf();
        let laws = bsdf.laws();
        if laws.delta || laws.transmits {
            let what = if laws.delta { "goes on in single directions only" } else { "lets light through" };
            bail!("{} {what}, which a table of reflection cannot hold", source.kind.name());
        }
        let isotropic = is_isotropic(&bsdf);
        let bytes = match target {
            Kind::Merl if !isotropic => bail!(
                "{} changes as the surface turns, which a MERL table cannot hold; write a .gonio or a .bsdf",
                named.label
            ),
            Kind::Merl => merl::write(&tabulate(|wo, wi| bsdf.eval(wo, wi)), space),
            Kind::Tabulated => goniometer::write(&self.read_off(&bsdf, isotropic), space).into_bytes(),
            _ => rgl::write(&self.measure(&bsdf, isotropic), &named.label, space),
        };
        atomic_write(&self.output, &bytes)?;

        let slots = target.defaults();
        let table = target.bake(&slots, &measured::read(&self.output, target, space)?)?;
        let written = Model { kind: target, slots, table };
        let found = difference(&bsdf, &written.bsdf());
        if self.json {
            json::print(json!({
                "model": target.name(), "bytes": bytes.len(), "pairs": PAIRS,
                "mean": found.mean, "largest": found.largest,
                "wo": found.wo.to_array(), "wi": found.wi.to_array(),
            }));
        } else {
            let degrees = |w: Vec3| w.z.clamp(-1.0, 1.0).acos().to_degrees();
            println!(
                "{}: {} bytes for model {}\nrelative difference over {PAIRS} random pairs up to {STEEPEST} degrees: \
                 mean {:.3} %, largest {:.3} % (eye at {:.1}, light at {:.1} degrees)",
                self.output.display(),
                bytes.len(),
                target.name(),
                100.0 * found.mean,
                100.0 * found.largest,
                degrees(found.wo),
                degrees(found.wi),
            );
        }
        Ok(())
    }

    /// A measurement of the kind that .bsdf files hold.
    fn measure(&self, bsdf: &Bsdf, isotropic: bool) -> Measurement {
        let nodes = |turn: f32, step: f32| (turn / step).round() as usize + 1;
        let (ax, ay) = roughness(bsdf);
        let mean = 0.5 * (ax + ay);
        // Where thousands of pairs of grids must be kept, they are half as fine.
        let (alpha, sweep, fine, coarse) = if isotropic {
            ((mean, mean), Sweep::None, 128, 128)
        } else if is_its_own_mirror_image(bsdf) {
            ((ax, ay), Sweep::Quarter(nodes(90.0, 3.0 * self.step).max(3)), 64, 64)
        } else {
            ((ax, ay), Sweep::Whole(nodes(360.0, 3.0 * self.step)), 64, 64)
        };
        Measurement::of(|wo, wi| bsdf.eval(wo, wi), alpha, sweep, nodes(90.0, self.step), fine, coarse)
    }

    /// A goniometer's readings of a model.
    fn read_off(&self, bsdf: &Bsdf, isotropic: bool) -> Goniometry {
        let steps = |turn: f32, step: f32| (turn / step).round().max(1.0) as usize;
        let n = steps(90.0, self.step);
        let polar: Vec<f32> = (0..=n).map(|i| (90.0 * i as f32 / n as f32).to_radians()).collect();
        let around = |n: usize| (0..n).map(|i| TAU * i as f32 / n as f32).collect::<Vec<f32>>();
        let phi_o = if isotropic { vec![0.0] } else { around(steps(360.0, 3.0 * self.step)) };
        Goniometry::of(
            |wo, wi| bsdf.eval(wo, wi),
            polar.clone(),
            phi_o,
            polar,
            around(steps(360.0, self.step)),
        )
    }
}

/// Two directions evenly over the polar angles that are compared.
fn pair(rng: &mut Pcg32) -> (Vec3, Vec3) {
    let mut draw = || spherical(STEEPEST.to_radians() * rng.next_f32(), TAU * rng.next_f32());
    (draw(), draw())
}

/// Whether f stays as it is when both directions go through a map, which gets a random number.
fn keeps(bsdf: &Bsdf, map: impl Fn(f32) -> Mat3) -> bool {
    let mut rng = Pcg32::new(11, 5);
    (0..400).all(|_| {
        let (wo, wi) = pair(&mut rng);
        let map = map(rng.next_f32());
        let (a, b) = (bsdf.eval(wo, wi), bsdf.eval(map * wo, map * wi));
        // Far above rounding, which a steep lobe multiplies, and far below any anisotropy worth the name.
        (a - b).abs().max_element() <= 1e-2 * a.max(b).max_element() + 1e-6
    })
}

fn is_isotropic(bsdf: &Bsdf) -> bool {
    keeps(bsdf, |u| Mat3::from_rotation_z(TAU * u))
}

fn is_its_own_mirror_image(bsdf: &Bsdf) -> bool {
    [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, 1.0)]
        .into_iter()
        .all(|signs| keeps(bsdf, |_| Mat3::from_diagonal(signs)))
}

/// Roughness along and across the tangent of the GGX surface that reflects an eye head on as widely: half of the
/// light comes by facets whose slope along an axis is below α/√3.
fn roughness(bsdf: &Bsdf) -> (f32, f32) {
    let mut rng = Pcg32::new(7, 2);
    let draws: Vec<(Vec3, f32)> = (0..4096)
        .filter_map(|_| bsdf.sample(Vec3::Z, rng.next_vec3()))
        .map(|s| (s.wi + Vec3::Z, s.weight.element_sum()))
        .collect();
    let half = 0.5 * draws.iter().map(|d| d.1).sum::<f32>();
    let along = |axis: usize| {
        let mut slopes: Vec<(f32, f32)> = draws.iter().map(|(h, w)| ((h[axis] / h.z).abs(), *w)).collect();
        slopes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sum = 0.0;
        let median = slopes.iter().find(|(_, w)| {
            sum += w;
            sum >= half
        });
        // Below 0.02 the lobe would fall between the grid's nodes; a black surface has no width.
        median.map_or(1.0, |m| 3f32.sqrt() * m.0).clamp(0.02, 1.0)
    };
    (along(0), along(1))
}

struct Difference {
    mean: f64,
    largest: f64,
    wo: Vec3,
    wi: Vec3,
}

/// Relative to the larger of the two, but to no less than a hundredth of the mean.
fn difference(a: &Bsdf, b: &Bsdf) -> Difference {
    let mut rng = Pcg32::new(3, 9);
    let rows: Vec<_> = (0..PAIRS)
        .map(|_| {
            let (wo, wi) = pair(&mut rng);
            (wo, wi, a.eval(wo, wi), b.eval(wo, wi))
        })
        .collect();
    let mean = rows.iter().map(|r| f64::from(r.2.max_element())).sum::<f64>() / PAIRS as f64;
    let mut found = Difference { mean: 0.0, largest: -1.0, wo: Vec3::Z, wi: Vec3::Z };
    for (wo, wi, a, b) in rows {
        let scale = f64::from(a.max(b).max_element()).max(0.01 * mean).max(f64::MIN_POSITIVE);
        let d = f64::from((a - b).abs().max_element()) / scale;
        found.mean += d / PAIRS as f64;
        if d > found.largest {
            found = Difference { largest: d, wo, wi, ..found };
        }
    }
    found
}
