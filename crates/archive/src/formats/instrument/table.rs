//! Readings at any directions as the grid that the model `tabulated` reads.

use super::{HORIZON, Measurement, Reading};
use crate::formats::grid::{SAME, axes, grid, place};
use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::f32::consts::FRAC_PI_2;
use yugen_optics::frame::spherical;
use yugen_reflectance::tabulated::Goniometry;

/// How much more a step of the half vector counts than one of the light: highlights stay where the half vector is
/// upright as the light moves, and have most of the structure across it.
const HALF: f32 = 4.0;
/// The widest step between azimuths of a table, in degrees.
const MAX_STEP: f32 = 45.0;
/// Grids of more places are not made as they are: at 44 bytes each they would take more than 370 MB.
const MOST_PLACES: usize = 1 << 23;
/// So many neighbours are looked at, a few for each of the five numbers of a plane; the last one has no weight.
const NEIGHBOURS: usize = 20;
/// Readings are the same that lie in one of so many cells of a unit: some hundredths of a degree.
const CELLS: f32 = 1e3;
/// Where weights stop to grow, as part of the distance of the last neighbour: less follows noise, more blurs.
const NEAR: f64 = 0.1;
/// How much a slope costs against the readings; well below their spread, which is about 0.1.
const RIDGE: f64 = 1e-3;

type Place = GeomWithData<[f32; 6], u32>;

/// Without a grain, turned so that the light is on the side of +x and mirrored so that the eye is on that of +y.
fn canonical(wi: Vec3, wo: Vec3, isotropic: bool) -> (Vec3, Vec3) {
    if !isotropic {
        return (wi, wo);
    }
    let side = |w: Vec3| w.truncate().try_normalize();
    // With the light overhead, the eye says.
    let x = side(wi).filter(|_| wi.z < 1.0 - 1e-7).or(side(wo)).unwrap_or(Vec2::X);
    let turned = |w: Vec3| Vec3::new(x.dot(w.truncate()), x.perp_dot(w.truncate()), w.z);
    let (wi, wo) = (turned(wi), turned(wo));
    (wi, Vec3::new(wo.x, wo.y.abs(), wo.z))
}

fn key(wi: Vec3, wo: Vec3, isotropic: bool) -> [f32; 6] {
    let (wi, wo) = canonical(wi, wo, isotropic);
    let h = HALF * (wi + wo).normalize_or(Vec3::Z);
    [h.x, h.y, h.z, wi.x, wi.y, wi.z]
}

/// The table of a measurement.
pub(super) fn of(m: &Measurement) -> Goniometry {
    exact(m).unwrap_or_else(|| scattered(m))
}

/// If the readings fill a grid, and go around it.
fn exact(m: &Measurement) -> Option<Goniometry> {
    let at = |r: &Reading| {
        let (wi, wo) = canonical(r.wi, r.wo, m.isotropic);
        let polar = |w: Vec3| w.truncate().length().atan2(w.z).to_degrees();
        let azimuth = |w: Vec3| w.y.atan2(w.x).to_degrees();
        let mut at = place([polar(wi), azimuth(wi), polar(wo), azimuth(wo)]);
        if m.isotropic {
            // Only the difference counts, either way; at a pole there is none.
            let pole = at[0] < SAME || at[2] < SAME;
            (at[1], at[3]) = (0.0, if pole { 0.0 } else { azimuth(wo).max(0.0) });
        }
        at
    };
    let mut readings: Vec<([f32; 4], Vec3)> = m.readings.iter().map(|r| (at(r), r.f)).collect();
    let axes = axes(readings.iter().map(|r| r.0));
    let size = axes.iter().fold(1usize, |n, axis| n.saturating_mul(axis.len()));
    // At a pole one reading stands for all azimuths.
    let mirrored = if m.isotropic { 2 } else { 1 };
    if size > 4 * readings.len() || mirrored * size > MOST_PLACES {
        return None;
    }
    // A plane says nothing of what is beside it.
    let d = &axes[3];
    let wide = d.windows(2).any(|w| w[1] - w[0] > MAX_STEP + SAME);
    let last = if m.isotropic { 180.0 } else { 360.0 - MAX_STEP };
    if wide || d[0] > SAME || d[d.len() - 1] < last - SAME {
        return None;
    }
    if m.isotropic {
        let beside = readings.iter().filter(|(at, _)| at[3] > SAME && at[3] < 180.0 - SAME);
        let mirrored: Vec<_> = beside.map(|(at, f)| ([at[0], at[1], at[2], 360.0 - at[3]], *f)).collect();
        readings.extend(mirrored);
    }
    let g = grid(&readings).ok()?;
    // The model takes what is missing from beside it in θi; more than a tenth would show.
    let missing = g.rgb.iter().filter(|v| v.is_nan()).count();
    let around = 3 * g.phi_d.len();
    let whole = g.rgb.chunks_exact(around * g.theta_i.len());
    let empty =
        whole.clone().any(|all| (0..around).any(|d| all[d..].iter().step_by(around).all(|v| v.is_nan())));
    (10 * missing <= g.rgb.len() && !empty).then_some(g)
}

/// Between the nearest readings: a plane through their cube roots by weighted least squares, which fall off with the
/// distance to nothing at the farthest (moving least squares, Lancaster and Salkauskas 1981).
fn scattered(m: &Measurement) -> Goniometry {
    // Readings that differ by a turn only are one: twenty of them would make no neighbourhood.
    let mut all: Vec<([i32; 6], [f32; 6], Vec3)> = m
        .readings
        .iter()
        .map(|r| {
            let key = key(r.wi, r.wo, m.isotropic);
            (key.map(|x| (x * CELLS).round() as i32), key, r.f)
        })
        .collect();
    all.sort_by_key(|r| r.0);
    let groups = all.chunk_by(|a, b| a.0 == b.0);
    let (places, values): (Vec<Place>, Vec<Vec3>) = groups
        .zip(0..)
        .map(|(same, i)| {
            let mean = same.iter().map(|r| r.2.as_dvec3()).sum::<DVec3>() / same.len() as f64;
            (Place::new(same[0].1, i), mean.as_vec3())
        })
        .unzip();
    drop(all);
    let tree = RTree::bulk_load(places);
    let value = |wo: Vec3, wi: Vec3| {
        let at = key(wi, wo, m.isotropic);
        let near: Vec<(f32, &Place)> = tree
            .nearest_neighbor_iter_with_distance_2(&at)
            .take(NEIGHBOURS)
            .map(|(p, d)| (d.sqrt(), p))
            .collect();
        // Single precision does not tell readings apart that are nearer.
        let reach = near.last().map_or(0.0, |n| n.0).max(1e-4) * 1.001;
        let planes: Vec<(f64, DVec4, DVec3)> = near
            .iter()
            .map(|(d, p)| {
                let d = f64::from(d / reach);
                let weight = ((1.0 - d) / (d + NEAR)).powi(2);
                let from = |k: usize| f64::from((p.geom()[k] - at[k]) / reach);
                let f = values[p.data as usize].as_dvec3();
                (weight, DVec4::new(from(0), from(1), from(3), from(4)), f.map(f64::cbrt))
            })
            .collect();
        let total: f64 = planes.iter().map(|p| p.0).sum();
        let middle = planes.iter().map(|p| p.0 * p.1).sum::<DVec4>() / total;
        let mean = planes.iter().map(|p| p.0 * p.2).sum::<DVec3>() / total;
        // Where readings lie in a plane or on a line, nothing is known across it.
        let mut spread = DMat4::from_diagonal(DVec4::splat(RIDGE * total));
        let mut slopes = [DVec4::ZERO; 3];
        for (w, u, v) in &planes {
            let (u, v) = (*u - middle, *v - mean);
            spread += DMat4::from_cols(u * u.x, u * u.y, u * u.z, u * u.w) * *w;
            for (slope, v) in slopes.iter_mut().zip(v.to_array()) {
                *slope += *w * v * u;
            }
        }
        let inverse = spread.inverse();
        let plane = mean - DVec3::from_array(slopes.map(|s| (inverse * s).dot(middle)));
        // No brighter and no darker than the readings.
        let low = planes.iter().map(|p| p.2).reduce(DVec3::min).unwrap_or_default();
        let high = planes.iter().map(|p| p.2).reduce(DVec3::max).unwrap_or_default();
        let root = plane.max(low).min(high);
        (root * root * root).as_vec3()
    };
    let steps = |n: u16, turn: f32| (0..n).map(|i| (f32::from(i) * turn).to_radians()).collect::<Vec<f32>>();
    // Where the model reads linearly, a highlight of α = 0.1 is some six degrees wide.
    let (polar, phi_o, phi_d) = match m.isotropic {
        true => (steps(37, 2.5), vec![0.0], steps(72, 5.0)),
        false => (steps(13, 7.5), steps(24, 15.0), steps(36, 10.0)),
    };
    let mut g = Goniometry { theta_o: polar.clone(), phi_o, theta_i: polar, phi_d, rgb: Vec::new() };
    let up = |theta: f32, phi: f32| spherical(theta.min(FRAC_PI_2 - 10.0 * HORIZON), phi);
    let around = g.phi_d.len();
    for &to in &g.theta_o {
        for &po in &g.phi_o {
            for &ti in &g.theta_i {
                let start = g.rgb.len();
                for (d, &pd) in g.phi_d.iter().enumerate() {
                    match m.isotropic && 2 * d > around {
                        // One side is the other's mirror image.
                        true => {
                            g.rgb.extend_from_within(start + 3 * (around - d)..start + 3 * (around - d) + 3)
                        }
                        false => g.rgb.extend(value(up(to, po), up(ti, po + pd)).to_array()),
                    }
                }
            }
        }
    }
    g
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::instrument::Reading;
    use std::f32::consts::{PI, TAU};
    use yugen_optics::random::Pcg32;
    use yugen_reflectance::microfacet::{Distribution, Masking, Microfacets};
    use yugen_reflectance::{Bsdf, Kind};

    /// Mean and largest difference of a table of scattered readings from the truth, relative to the truth or a tenth of
    /// its mean.
    fn errors(isotropic: bool, count: usize, f: impl Fn(Vec3, Vec3) -> f32) -> (f32, f32) {
        let mut rng = Pcg32::new(7, 7);
        let mut draw = |steepest: f32| spherical(steepest * rng.next_f32(), TAU * rng.next_f32());
        let readings = (0..count)
            .map(|_| {
                let (wi, wo) = (draw(1.5), draw(1.5));
                Reading { wi, wo, f: Vec3::splat(f(wi, wo)), weight: 1.0 }
            })
            .collect();
        let m = Measurement { format: "test", readings, isotropic, left_out: Vec::new() };
        let slots = Kind::Tabulated.defaults();
        let table = Kind::Tabulated.bake(&slots, &of(&m).to_data()).unwrap();
        let bsdf = Bsdf::new(Kind::Tabulated, &slots, &table);
        let pairs: Vec<(Vec3, Vec3)> = (0..2000).map(|_| (draw(1.2), draw(1.2))).collect();
        let mean = pairs.iter().map(|(wi, wo)| f(*wi, *wo)).sum::<f32>() / pairs.len() as f32;
        let error = |(wi, wo): &(Vec3, Vec3)| {
            let truth = f(*wi, *wo);
            (bsdf.eval(*wo, *wi).x - truth).abs() / truth.max(0.1 * mean)
        };
        let all: Vec<f32> = pairs.iter().map(error).collect();
        (all.iter().sum::<f32>() / all.len() as f32, all.iter().copied().fold(0.0, f32::max))
    }

    #[test]
    fn scattered_readings_make_a_table() {
        let rough = |a: f32, b: f32| {
            let facets = Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, a, b);
            move |wi: Vec3, wo: Vec3| 0.2 / PI + 0.3 * facets.reflect(wo, wi).0
        };
        let (mean, most) = errors(true, 20_000, rough(0.3, 0.3));
        // Measured: 0.0034 and 0.077.
        assert!(mean < 0.014 && most < 0.3, "{mean} {most}");
        let (mean, most) = errors(false, 60_000, rough(0.3, 0.5));
        // Measured: 0.016 and 0.16.
        assert!(mean < 0.065 && most < 0.65, "{mean} {most}");
        // Nothing to be lost.
        let (_, most) = errors(true, 500, |_, _| 0.25);
        assert!(most < 1e-5, "{most}");
    }
}
