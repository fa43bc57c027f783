//! Readings of a BRDF put on the grid that a goniometer's table is.

use glam::{DVec3, Vec3};
use yugen_reflectance::tabulated::Goniometry;

/// Angles nearer than this are the same, in degrees: machines log what their encoders say.
pub(crate) const SAME: f32 = 0.05;
/// A grid with more places than this for each reading is none.
const SPARSE: usize = 16;

/// θo, φo, θi and φi − φo of a reading as grids have them: in degrees, polar angles from 0 to 90, azimuths from 0 to
/// below 360. A negative polar angle is one on the other side.
pub(crate) fn place([theta_i, phi_i, theta_o, phi_o]: [f32; 4]) -> [f32; 4] {
    let turned = |theta: f32, phi: f32| if theta < 0.0 { phi + 180.0 } else { phi };
    let round = |phi: f32| {
        let phi = phi.rem_euclid(360.0);
        if phi > 360.0 - SAME { 0.0 } else { phi }
    };
    // At the pole all azimuths are one; the difference keeps what the light's says.
    let out = if theta_o.abs() < SAME { 0.0 } else { turned(theta_o, phi_o) };
    let difference = if theta_i.abs() < SAME { 0.0 } else { turned(theta_i, phi_i) - out };
    [theta_o.abs(), round(out), theta_i.abs(), round(difference)]
}

/// The different angles of readings at these [`place`]s: θo, φo, θi, φi − φo.
pub(crate) fn axes(places: impl Iterator<Item = [f32; 4]> + Clone) -> [Vec<f32>; 4] {
    std::array::from_fn(|a| {
        let mut all: Vec<f32> = places.clone().map(|p| p[a]).collect();
        all.sort_by(f32::total_cmp);
        all.dedup_by(|b, a| *b - *a < SAME);
        all
    })
}

/// Readings at [`place`]s as a table, angles in radians, NaN where there is none; those of the same angles are
/// averaged. Or what is wrong, as the rest of a sentence.
pub(crate) fn grid(readings: &[([f32; 4], Vec3)]) -> Result<Goniometry, String> {
    if readings.is_empty() {
        return Err("the table has no reading".into());
    }
    let axes = axes(readings.iter().map(|r| r.0));
    let size = axes.iter().fold(1usize, |n, axis| n.saturating_mul(axis.len()));
    if size > SPARSE * readings.len() {
        let counts: Vec<String> = axes.iter().map(|a| a.len().to_string()).collect();
        return Err(format!(
            "{} readings at {} different angles (theta_o, phi_o, theta_i, phi_i - phi_o) are no grid; fit a model to them \
             instead",
            readings.len(),
            counts.join(" x ")
        ));
    }
    let mut sums = vec![(DVec3::ZERO, 0.0); size];
    for (at, value) in readings {
        // Axes hold the first of each group, which is at most this far below.
        let place = |a: usize| axes[a].partition_point(|v| *v <= at[a]).saturating_sub(1);
        let index = (0..4).fold(0, |index, a| index * axes[a].len() + place(a));
        sums[index].0 += value.as_dvec3();
        sums[index].1 += 1.0;
    }
    spread_poles(&mut sums, &axes);
    let rgb = sums
        .iter()
        .flat_map(|(sum, n)| if *n > 0.0 { (*sum / *n).as_vec3().to_array() } else { [f32::NAN; 3] })
        .map(|v| if v < 0.0 { 0.0 } else { v })
        .collect();
    let [theta_o, phi_o, theta_i, phi_d] = axes.map(|axis| axis.into_iter().map(f32::to_radians).collect());
    let g = Goniometry { theta_o, phi_o, theta_i, phi_d, rgb };
    g.check().map_err(|problem| format!("the table {problem}"))?;
    Ok(g)
}

/// With light or eye at the pole, azimuths mean less: a reading with the light there holds for all light azimuths, and
/// one with the eye there for all eye azimuths from which the light stands where it stood; if there is but one, for all
/// light azimuths that were not read.
fn spread_poles(sums: &mut [(DVec3, f64)], axes: &[Vec<f32>; 4]) {
    let [theta_o, phi_o, theta_i, phi_d] = axes;
    let (inner, block) = (phi_d.len(), theta_i.len() * phi_d.len());
    if theta_i[0] < SAME {
        for all in sums.chunks_exact_mut(block) {
            let pole = all[..inner].iter().fold((DVec3::ZERO, 0.0), |s, v| (s.0 + v.0, s.1 + v.1));
            all[..inner].fill(pole);
        }
    }
    if theta_o[0] < SAME && phi_o.len() == 1 {
        for row in sums[..block].chunks_exact_mut(inner) {
            let all = row.iter().fold((DVec3::ZERO, 0.0), |s, v| (s.0 + v.0, s.1 + v.1));
            row.iter_mut().filter(|v| v.1 == 0.0).for_each(|v| *v = all);
        }
    } else if theta_o[0] < SAME && phi_o[0] < SAME {
        let turned = |light: f32| {
            let apart = |d: &f32| (d - light + 180.0).rem_euclid(360.0) - 180.0;
            phi_d.iter().position(|d| apart(d).abs() < SAME)
        };
        for p in 1..phi_o.len() {
            for d in 0..inner {
                let Some(from) = turned(phi_o[p] + phi_d[d]) else { continue };
                for i in 0..theta_i.len() {
                    sums[p * block + i * inner + d] = sums[i * inner + from];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the eye overhead its azimuth means nothing, but that of the light does.
    #[test]
    fn an_eye_overhead_has_every_azimuth() {
        let f = |theta_o: f32, theta_i: f32, phi_i: f32| {
            Vec3::splat(1.0 + 0.01 * theta_o + 0.1 * theta_i.to_radians().sin() * phi_i.to_radians().cos())
        };
        let mut readings = Vec::new();
        for theta_i in [0.0, 40.0] {
            for phi_i in [0.0, 90.0, 180.0, 270.0] {
                readings.push((place([theta_i, phi_i, 0.0, 33.0]), f(0.0, theta_i, phi_i)));
                for phi_o in [0.0, 90.0, 180.0, 270.0] {
                    readings.push((place([theta_i, phi_i, 50.0, phi_o]), f(50.0, theta_i, phi_i)));
                }
            }
        }
        let g = grid(&readings).unwrap();
        assert_eq!([g.theta_o.len(), g.phi_o.len(), g.theta_i.len(), g.phi_d.len()], [2, 4, 2, 4]);
        for (i, rgb) in g.rgb.chunks_exact(3).enumerate() {
            let [d, t, p, o] = [i % 4, i / 4 % 2, i / 8 % 4, i / 32];
            let phi_i = (g.phi_o[p] + g.phi_d[d]).to_degrees();
            let want = f([0.0, 50.0][o], [0.0, 40.0][t], phi_i).x;
            assert!((rgb[0] - want).abs() < 1e-5, "{o} {p} {t} {d}: {} {want}", rgb[0]);
        }
        // Of an isotropic one, a single reading will do for every azimuth of the light.
        let at = |theta_i: f32, phi_i: f32, theta_o: f32| {
            (place([theta_i, phi_i, theta_o, 0.0]), Vec3::splat(theta_i))
        };
        let g = grid(&[
            at(0.0, 0.0, 0.0),
            at(40.0, 0.0, 0.0),
            at(0.0, 0.0, 50.0),
            at(40.0, 0.0, 50.0),
            at(40.0, 90.0, 50.0),
        ]);
        let g = g.unwrap();
        assert!((0..4).all(|i| (g.rgb[3 * i] - [0.0, 0.0, 40.0, 40.0][i]).abs() < 1e-6), "{:?}", g.rgb);
    }
}
