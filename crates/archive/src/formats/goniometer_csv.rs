//! Goniometer readings one a line, as a machine's log or a spreadsheet has them: CSV whose columns say what they mean.
//!
//! ```text
//! theta_i,phi_i,theta_o,phi_o,f_red,f_green,f_blue
//! 30,180,0,0,0.21,0.11,0.05
//! ```
//! `i` is the light, `o` the eye. Angles in degrees: θ from the normal, φ counter-clockwise about it as seen from
//! above, from the +x of the sample. A reading is f in 1/sr (`f` or `f_red, f_green, f_blue`), or π f, the reflectance
//! factor against a perfect white under the same light (`factor` or `factor_red, factor_green, factor_blue`); linear
//! sRGB. The order of the lines does not matter; readings of the same angles are averaged. Together they must lie on a
//! grid of (θo, φo, θi, φi − φo), in which some may be missing.

use super::csv::Table;
use crate::{Error, Place};
use glam::Vec3;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::tabulated::Goniometry;

/// Angles nearer than this are the same, in degrees: machines log what their encoders say.
const SAME: f32 = 0.05;
/// A grid with more places than this for each reading is none.
const SPARSE: usize = 16;

/// The readings of a file as a grid, colours in `space`, angles in radians, NaN where there is none.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Goniometry, Error> {
    let angles = ["theta_i", "phi_i", "theta_o", "phi_o"];
    let kinds = ["f_red", "f_green", "f_blue", "factor_red", "factor_green", "factor_blue", "f", "factor"];
    let table = Table::read(bytes, file, &angles, &kinds)?;
    let invalid = |problem: String| Error::invalid(Place::file(file), problem);
    let first = table.rows.first().ok_or_else(|| invalid("the table has no reading".into()))?;
    let filled = |column: usize| !table.text(first, column).is_empty();
    let choices = [
        (4, true, 1.0),
        (7, true, std::f32::consts::PI),
        (10, false, 1.0),
        (11, false, std::f32::consts::PI),
    ];
    let mut used = choices.into_iter().filter(|(column, ..)| filled(*column));
    let (column, coloured, unit) = used.next().ok_or_else(|| {
        invalid("there is no reading; expected columns f, f_red…, factor, or factor_red…".into())
    })?;
    if used.next().is_some() {
        return Err(invalid("there are readings of several kinds; keep one".into()));
    }
    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    let mut readings: Vec<([f32; 4], Vec3)> = Vec::new();
    for row in &table.rows {
        let [theta_i, phi_i, theta_o, phi_o] =
            [table.number(row, 0)?, table.number(row, 1)?, table.number(row, 2)?, table.number(row, 3)?];
        for (theta, name) in [(theta_i, "theta_i"), (theta_o, "theta_o")] {
            if !(-90.0..=90.0).contains(&theta) {
                return Err(table.invalid(row, format!("{name} is {theta}; expected -90 to 90 degrees")));
            }
        }
        let value = if coloured {
            Vec3::from_array(table.rgb(row, column)?)
        } else {
            Vec3::splat(table.number(row, column)?)
        };
        if value.min_element() < 0.0 {
            return Err(table.invalid(row, "a reflection cannot be negative; leave the line out"));
        }
        // A negative polar angle is one on the other side.
        let turned = |theta: f32, phi: f32| if theta < 0.0 { phi + 180.0 } else { phi };
        let round = |phi: f32| {
            let phi = phi.rem_euclid(360.0);
            if phi > 360.0 - SAME { 0.0 } else { phi }
        };
        // At the pole all azimuths are one; the difference keeps what the light's says.
        let out = if theta_o.abs() < SAME { 0.0 } else { turned(theta_o, phi_o) };
        let difference = if theta_i.abs() < SAME { 0.0 } else { turned(theta_i, phi_i) - out };
        let at = [theta_o.abs(), round(out), theta_i.abs(), round(difference)];
        readings.push((at, value / unit));
    }
    let axes: [Vec<f32>; 4] = std::array::from_fn(|a| {
        let mut all: Vec<f32> = readings.iter().map(|r| r.0[a]).collect();
        all.sort_by(f32::total_cmp);
        all.dedup_by(|b, a| *b - *a < SAME);
        all
    });
    let size = axes.iter().fold(1usize, |n, axis| n.saturating_mul(axis.len()));
    if size > SPARSE * readings.len() {
        let counts: Vec<String> = axes.iter().map(|a| a.len().to_string()).collect();
        return Err(invalid(format!(
            "{} readings at {} different angles (theta_o, phi_o, theta_i, phi_i - phi_o) are no grid; fit a model to them \
             instead",
            readings.len(),
            counts.join(" x ")
        )));
    }
    let mut sums = vec![(Vec3::ZERO, 0.0f32); size];
    for (at, value) in &readings {
        // Axes hold the first of each group, which is at most this far below.
        let place = |a: usize| axes[a].partition_point(|v| *v <= at[a]).saturating_sub(1);
        let index = (0..4).fold(0, |index, a| index * axes[a].len() + place(a));
        // What does not depend on an azimuth fills all of them below.
        sums[index].0 += *value;
        sums[index].1 += 1.0;
    }
    spread_poles(&mut sums, &axes);
    let rgb = sums
        .iter()
        .flat_map(|(sum, n)| if *n > 0.0 { (to_space * (*sum / *n)).to_array() } else { [f32::NAN; 3] });
    let [theta_o, phi_o, theta_i, phi_d] =
        axes.clone().map(|axis| axis.into_iter().map(f32::to_radians).collect());
    let g = Goniometry {
        theta_o,
        phi_o,
        theta_i,
        phi_d,
        rgb: rgb.map(|v| if v < 0.0 { 0.0 } else { v }).collect(),
    };
    g.check().map_err(|problem| invalid(format!("the table {problem}")))?;
    Ok(g)
}

/// With light or eye at the pole, azimuths mean less: a reading there holds for all light azimuths.
fn spread_poles(sums: &mut [(Vec3, f32)], axes: &[Vec<f32>; 4]) {
    if axes[2][0] >= SAME {
        return;
    }
    let (inner, block) = (axes[3].len(), axes[2].len() * axes[3].len());
    for all in sums.chunks_exact_mut(block) {
        let pole = all[..inner].iter().fold((Vec3::ZERO, 0.0), |s, v| (s.0 + v.0, s.1 + v.1));
        all[..inner].fill(pole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;
    use std::fmt::Write;

    fn parse(text: &str) -> Result<Goniometry, Error> {
        read(text.as_bytes(), Path::new("a.csv"), ColourSpace::LinearSrgb)
    }

    #[test]
    fn a_log_becomes_the_grid_that_it_was_taken_on() {
        let reading =
            |to: f32, po: f32, ti: f32, d: f32| 0.1 + 0.001 * to + 1e-4 * po + 0.002 * ti + 1e-5 * d;
        let mut text = String::from("phi_o;theta_o;factor;theta_i;phi_i\n");
        // Negative angles of an arm that swings through the pole, decimal commas, noise of the encoder.
        for to in [0.0, 40.0] {
            for po in [0.0, 90.0] {
                for ti in [-60.0f32, -30.0, 0.0, 30.0, 60.0] {
                    let d = if ti < 0.0 { 180.0 } else { 0.0 };
                    let d = if ti == 0.0 { 0.0 } else { d };
                    let v = PI * reading(to, if to == 0.0 { 0.0 } else { po }, ti.abs(), d);
                    let phi_i = if to == 0.0 { 0.0 } else { po };
                    let line = format!("{po};{to};{v};{};{phi_i}\n", ti + 0.004);
                    text.push_str(&line.replace('.', ","));
                }
            }
        }
        let g = parse(&text).unwrap();
        assert_eq!([g.theta_o.len(), g.phi_o.len(), g.theta_i.len(), g.phi_d.len()], [2, 2, 3, 2]);
        let at = |o: usize, p: usize, i: usize, d: usize| g.rgb[3 * (((o * 2 + p) * 3 + i) * 2 + d)];
        for (o, to) in [0.0, 40.0].into_iter().enumerate() {
            for (p, po) in [0.0, 90.0].into_iter().enumerate() {
                for (i, ti) in [0.0, 30.0, 60.0].into_iter().enumerate() {
                    for (d, dp) in [0.0, 180.0].into_iter().enumerate() {
                        let got = at(o, p, i, d);
                        if o == 0 && p == 1 {
                            assert!(got.is_nan(), "an eye at the pole has one azimuth");
                        } else {
                            let want = reading(to, po, ti, if i == 0 { 0.0 } else { dp });
                            assert!((got - want).abs() < 1e-4, "{o} {p} {i} {d}: {got} {want}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn bad_logs_get_a_sentence() {
        let head = "theta_i,phi_i,theta_o,phi_o,f_red,f_green,f_blue\n";
        for (text, want) in [
            ("theta_i,phi_i,theta_o,phi_o,f\n".to_string(), "a.csv: the table has no reading"),
            (
                "theta_i,phi_i,theta_o,phi_o\n0,0,0,0\n".into(),
                "a.csv: there is no reading; expected columns f",
            ),
            (
                "theta_i,phi_i,theta_o,phi_o,f,factor\n0,0,0,0,1,1\n".into(),
                "a.csv: there are readings of several",
            ),
            (format!("{head}95,0,0,0,1,1,1\n"), "a.csv:2:1: theta_i is 95; expected -90 to 90 degrees"),
            (format!("{head}0,0,0,0,1,1,1\n5,0,0,0,1,-1,1\n"), "a.csv:3:1: a reflection cannot be negative"),
            (format!("{head}0,0,0,0,1,1\n"), "a.csv:2:1: this line has 6 columns"),
            ("theta_i,phi_i,theta_r,phi_r,f\n".into(), "a.csv:1:1: unknown column 'theta_r'"),
            (format!("{head}0,0,0,0,1,1,1\n"), "a.csv: the table needs at least two polar angles theta_o"),
        ] {
            let got = parse(&text).unwrap_err().to_string();
            assert!(got.starts_with(want), "{got}");
        }
        let mut scattered = String::from(head);
        for i in 0..60 {
            let _ = writeln!(scattered, "{},{},{},{},1,1,1", 1.4 * i as f32, 5.9 * i as f32, 89 - i, 3 * i);
        }
        assert!(parse(&scattered).unwrap_err().to_string().contains("are no grid"));
    }
}
