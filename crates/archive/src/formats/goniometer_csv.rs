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
//!
//! With columns `x, y` before them a line is a reading of one texel of many ([`read_texels`]), and need lie on no grid.

use super::csv::{Row, Table};
use super::grid::{grid, place};
use crate::{Error, Place};
use glam::Vec3;
use std::f32::consts::PI;
use std::ops::Range;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_reflectance::tabulated::Goniometry;

/// More texels than this for each reading are too many.
const SPARSE: usize = 16;

/// The readings of a file as a grid, colours in `space`, angles in radians, NaN where there is none.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Goniometry, Error> {
    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    let mut readings: Vec<([f32; 4], Vec3)> = Vec::new();
    let mut kind = None;
    Table::visit(bytes, file, &ANGLES, &KINDS, |table, row| {
        let angles = angles(table, row)?;
        let value = Kind::of(&mut kind, table, row)?.reading(table, row)?;
        readings.push((place(angles), to_space * value));
        Ok(())
    })?;
    grid(&readings).map_err(|problem| Error::invalid(Place::file(file), problem))
}

const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];
const KINDS: [&str; 8] =
    ["f_red", "f_green", "f_blue", "factor_red", "factor_green", "factor_blue", "f", "factor"];

/// θi, φi, θo, φo of a line in degrees.
fn angles(table: &Table, row: &Row) -> Result<[f32; 4], Error> {
    let mut all = [0.0; 4];
    for (column, (angle, name)) in all.iter_mut().zip(ANGLES).enumerate() {
        *angle = table.number(row, column)?;
        if name.starts_with("theta") && !(-90.0..=90.0).contains(angle) {
            return Err(table.invalid(row, format!("{name} is {angle}; expected -90 to 90 degrees")));
        }
    }
    Ok(all)
}

/// What the readings of a table are: the first of their columns, whether there are three, and what 1/sr is in their
/// unit.
#[derive(Clone, Copy)]
struct Kind {
    column: usize,
    coloured: bool,
    unit: f32,
}

impl Kind {
    /// As the first row has it.
    fn of(known: &mut Option<Self>, table: &Table, row: &Row) -> Result<Self, Error> {
        if let Some(kind) = *known {
            return Ok(kind);
        }
        let all = [(4, true, 1.0), (7, true, PI), (10, false, 1.0), (11, false, PI)];
        let kinds = all.map(|(column, coloured, unit)| Self { column, coloured, unit });
        let mut used = kinds.into_iter().filter(|k| !table.text(row, k.column).is_empty());
        match (used.next(), used.next()) {
            (Some(kind), None) => Ok(*known.insert(kind)),
            (None, _) => {
                Err(table
                    .invalid(row, "there is no reading; expected columns f, f_red…, factor, or factor_red…"))
            }
            _ => Err(table.invalid(row, "there are readings of several kinds; keep one")),
        }
    }

    /// f in 1/sr, linear sRGB.
    fn reading(self, table: &Table, row: &Row) -> Result<Vec3, Error> {
        let value = match self.coloured {
            true => Vec3::from_array(table.rgb(row, self.column)?),
            false => Vec3::splat(table.number(row, self.column)?),
        };
        match value.min_element() < 0.0 {
            true => Err(table.invalid(row, "a reflection cannot be negative; leave the line out")),
            false => Ok(value / self.unit),
        }
    }
}

/// The readings of many texels, each with lights and eyes of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Where the readings of each begin, row by row from the top left, and where the last ones end.
    pub starts: Vec<usize>,
    /// Toward the light and toward the eye, unit, +x right, +y up, +z to the camera.
    pub directions: Vec<[Vec3; 2]>,
    /// π f cos θi, linear RGB.
    pub values: Vec<[f32; 3]>,
}

impl Texels {
    /// Which readings are a texel's.
    pub fn of(&self, texel: usize) -> Range<usize> {
        self.starts[texel]..self.starts[texel + 1]
    }
}

/// The readings of a file that has columns x and y as well: whole numbers, the texel counted from 0 at the top left.
/// The colours come out in `space`.
pub fn read_texels(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Texels, Error> {
    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    // Behind the others, so that these are where they are in a table of one.
    let (needed, optional) = (ANGLES, [&KINDS[..], &PLACE].concat());
    let mut lines: Vec<([u32; 2], [Vec3; 2], [f32; 3])> = Vec::new();
    let mut kind = None;
    let mut size = [0u32; 2];
    Table::visit(bytes, file, &needed, &optional, |table, row| {
        let mut place = [0; 2];
        for (i, (to, name)) in place.iter_mut().zip(PLACE).enumerate() {
            let text = table.text(row, needed.len() + KINDS.len() + i);
            *to = text.parse().ok().filter(|v| *v < MOST).ok_or_else(|| {
                let short: String = text.chars().take(40).collect();
                table.invalid(
                    row,
                    format!("{name} is '{short}'; expected a whole number from 0 to {}", MOST - 1),
                )
            })?;
            size[i] = size[i].max(*to + 1);
        }
        let [theta_i, phi_i, theta_o, phi_o] = angles(table, row)?.map(f32::to_radians);
        let f = Kind::of(&mut kind, table, row)?.reading(table, row)?;
        let light = spherical(theta_i, phi_i);
        let factor = to_space * f * (PI * light.z.max(0.0));
        lines.push((place, [light, spherical(theta_o, phi_o)], factor.to_array()));
        Ok(())
    })?;
    let [width, height] = size.map(|s| s as usize);
    if width * height > SPARSE * lines.len() {
        return Err(Error::invalid(
            Place::file(file),
            format!("{} readings are too few for {width} x {height} texels", lines.len()),
        ));
    }
    if lines.is_empty() {
        return Err(Error::invalid(Place::file(file), "the table has no reading"));
    }
    // In a stable order, so that the readings of a texel stay in theirs.
    lines.sort_by_key(|([x, y], ..)| (*y, *x));
    let mut starts = vec![0; width * height + 1];
    for ([x, y], ..) in &lines {
        starts[*y as usize * width + *x as usize + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let (directions, values) = lines.into_iter().map(|(_, directions, value)| (directions, value)).unzip();
    Ok(Texels { width, height, starts, directions, values })
}

const PLACE: [&str; 2] = ["x", "y"];
/// More texels than this in a row or column are none.
const MOST: u32 = 1 << 20;

#[cfg(test)]
mod tests {
    use super::*;
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
    fn a_log_of_many_texels_is_sorted_by_them() {
        let text =
            "y;x;theta_i;phi_i;theta_o;phi_o;f\n1;0;-60;90;0;0;0,5\n0;1;0;0;30;0;0,25\n1;0;0;0;0;0;0\n";
        let read = |text: &str| read_texels(text.as_bytes(), Path::new("a.csv"), ColourSpace::LinearSrgb);
        let t = read(text).unwrap();
        assert_eq!((t.width, t.height, &t.starts[..]), (2, 2, &[0, 0, 1, 3, 3][..]));
        let close = |a: Vec3, b: Vec3| a.abs_diff_eq(b, 1e-6);
        let half = Vec3::splat(0.5);
        assert!(close(t.directions[0][1], Vec3::new(0.5, 0.0, 0.75f32.sqrt())));
        assert!(close(t.directions[1][0], Vec3::new(0.0, -(0.75f32.sqrt()), 0.5)));
        // π f cos θ.
        assert!(
            close(t.values[1].into(), half * half * PI) && close(t.values[0].into(), 0.25 * Vec3::ONE * PI)
        );
        for (from, to, want) in [
            ("1;0;0;0;0", "1;-1;0;0;0", "a.csv:4:1: x is '-1'; expected a whole number from 0 to 1048575"),
            ("0;1;0", "0;1,5;0", "a.csv:3:1: x is '1,5'; expected a whole number"),
            ("0;1;0", "0;99999999;0", "a.csv:3:1: x is '99999999'; expected"),
            ("0;1;0", "0;99999;0", "a.csv: 3 readings are too few for 100000 x 2 texels"),
            ("x;theta", "z;theta", "a.csv:1:1: unknown column 'z'"),
            ("-60", "-91", "a.csv:2:1: theta_i is -91; expected -90 to 90 degrees"),
        ] {
            assert!(text.contains(from));
            let got = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(got.starts_with(want), "{got}");
        }
        assert!(read(text.lines().next().unwrap()).unwrap_err().to_string().contains("has no reading"));
    }

    #[test]
    fn bad_logs_get_a_sentence() {
        let head = "theta_i,phi_i,theta_o,phi_o,f_red,f_green,f_blue\n";
        for (text, want) in [
            ("theta_i,phi_i,theta_o,phi_o,f\n".to_string(), "a.csv: the table has no reading"),
            (
                "theta_i,phi_i,theta_o,phi_o\n0,0,0,0\n".into(),
                "a.csv:2:1: there is no reading; expected columns f",
            ),
            (
                "theta_i,phi_i,theta_o,phi_o,f,factor\n0,0,0,0,1,1\n".into(),
                "a.csv:2:1: there are readings of several",
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
