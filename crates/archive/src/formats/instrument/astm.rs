//! ASTM E1392 and E2387: tables of scatter measurements as text, `.astm`, as the Cornell reflectance data are.
//!
//! ```text
//! NUM_POINTS 1439
//! VARS theta_i,phi_i,theta_s,phi_s,400nm,410nm,…
//! 0.5,0,0.3,3.1,0.21,0.22,…
//! ```
//! Lines of keywords until `VARS` names the columns, then the readings. `i` is the light, `s` (or `r`) the scattered
//! light, which the eye sees. Angles are radians if none is larger than a right angle in θ and a turn in φ, else
//! degrees. Values are f in 1/sr: a spectrum, seen as a colour under D65, RGB (linear sRGB), XYZ (white at
//! X = Y = Z), or one for all colours.

use super::numbers::{Text, words};
use super::{MAX_READINGS, Measurement, Reading, from_xyz};
use crate::Error;
use crate::formats::support::Feature;
use glam::{DVec3, Vec3};
use std::f32::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_optics::spectrum::Sensor;

/// What is made of columns.
pub const FEATURES: &[Feature] = &[
    Feature::yes("theta_i, phi_i"),
    Feature::yes("theta_s, phi_s, or theta_r, phi_r"),
    Feature::yes("400nm, 410nm, …"),
    Feature::partly("R, G, B", "taken as linear sRGB"),
    Feature::partly("X, Y, Z", "taken as relative to a white of X = Y = Z"),
    Feature::partly("one other", "taken as f for all colours"),
    Feature::no("Ux, Uy and other angles", "write theta and phi"),
];

/// The columns that a line names, if it is the one that does.
pub(super) fn names_columns(line: &[u8]) -> Option<&[u8]> {
    let (word, rest) = line.split_at_checked(4)?;
    let ends = rest.first().is_some_and(|b| b" \t=:".contains(b));
    (word.eq_ignore_ascii_case(b"VARS") && ends).then(|| &rest[1..])
}

const ANGLES: [&[&str]; 4] = [
    &["theta_i", "thetai"],
    &["phi_i", "phii"],
    &["theta_s", "theta_r", "theta_o"],
    &["phi_s", "phi_r", "phi_o"],
];

/// What the columns behind the angles make of a reading.
enum Values {
    Grey,
    Rgb,
    Xyz,
    /// RGB for each unit at each, and in what order they stand.
    Spectrum(Vec<(usize, DVec3)>),
}

impl Values {
    fn of(names: &[&str], space: ColourSpace) -> Result<Self, String> {
        let lower: Vec<String> = names.iter().map(|n| n.to_ascii_lowercase()).collect();
        let lower: Vec<&str> = lower.iter().map(String::as_str).collect();
        match lower[..] {
            [] => return Err("VARS names no column of values behind the angles".into()),
            ["r", "g", "b"] | ["red", "green", "blue"] => return Ok(Self::Rgb),
            ["x", "y", "z"] => return Ok(Self::Xyz),
            [_] => return Ok(Self::Grey),
            _ => {}
        }
        let wavelength = |n: &&str| n.strip_suffix("nm").and_then(|w| w.trim().parse::<f64>().ok());
        let all: Option<Vec<f64>> = lower.iter().map(wavelength).collect();
        let Some(all) = all.filter(|all| all.iter().all(|w| (1.0..1e6).contains(w))) else {
            return Err(format!(
                "the columns {} are not known; expected wavelengths such as 400nm, or R,G,B, or X,Y,Z, or one value",
                names.iter().take(8).copied().collect::<Vec<_>>().join(",")
            ));
        };
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| all[*a].total_cmp(&all[*b]));
        let sorted: Vec<f64> = order.iter().map(|i| all[*i]).collect();
        if sorted.windows(2).any(|w| w[0] >= w[1]) {
            return Err("VARS names a wavelength twice".into());
        }
        if sorted[0] > 780.0 || sorted[sorted.len() - 1] < 380.0 {
            return Err(
                "the wavelengths do not reach into the visible, so they have no colour; keep one of them"
                    .into(),
            );
        }
        let sensor = Sensor::reflectance_at(space, sorted);
        Ok(Self::Spectrum(order.into_iter().zip(sensor.weights().iter().copied()).collect()))
    }

    fn colour(&self, v: &[f32], space: ColourSpace) -> Vec3 {
        match self {
            Self::Grey => Vec3::splat(v[0]),
            Self::Rgb => ColourSpace::LinearSrgb.matrix_to(space) * Vec3::from_slice(v),
            Self::Xyz => from_xyz(space) * Vec3::from_slice(v),
            Self::Spectrum(weights) => {
                weights.iter().map(|(i, w)| *w * f64::from(v[*i])).sum::<DVec3>().as_vec3()
            }
        }
    }
}

/// The readings of a file, colours in `space`.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    let text = Text::new(bytes, file)?;
    let mut lines = text.lines();
    let mut points = None;
    let (vars, names) = loop {
        let Some((n, line)) = lines.next() else {
            return Err(text.whole("has no line 'VARS theta_i,phi_i,theta_s,phi_s,…' that names the columns"));
        };
        if let Some(names) = names_columns(line.as_bytes()).and_then(|names| std::str::from_utf8(names).ok())
        {
            break (n, names);
        }
        if let Some(count) = line.strip_prefix("NUM_POINTS") {
            points = count.trim_matches([' ', '\t', '=', ':']).parse::<usize>().ok();
        }
    };
    let names: Vec<&str> = names.split(',').map(str::trim).filter(|n| !n.is_empty()).collect();
    if names.len() > 4096 {
        return Err(text.wrong(vars, format!("VARS names {} columns; expected at most 4096", names.len())));
    }
    let column =
        |wanted: &[&str]| names.iter().position(|n| wanted.iter().any(|w| n.eq_ignore_ascii_case(w)));
    let mut at = [0; 4];
    for (at, wanted) in at.iter_mut().zip(ANGLES) {
        *at = column(wanted).ok_or_else(|| {
            text.wrong(
                vars,
                format!("VARS names no column {}; expected theta_i,phi_i,theta_s,phi_s", wanted[0]),
            )
        })?;
    }
    let rest: Vec<usize> = (0..names.len()).filter(|i| !at.contains(i)).collect();
    let titles: Vec<&str> = rest.iter().map(|i| names[*i]).collect();
    let values = Values::of(&titles, space).map_err(|problem| text.wrong(vars, problem))?;

    let mut rows: Vec<([f32; 4], Vec3)> = Vec::new();
    let (mut numbers, mut picked) = (Vec::new(), Vec::new());
    for (n, line) in lines.filter(|(_, l)| !(l.is_empty() || l.starts_with('#'))) {
        if line.starts_with("END") {
            break;
        }
        numbers.clear();
        for word in words(line).take(names.len()) {
            numbers.push(text.number(n, word)?);
        }
        if numbers.len() < names.len() {
            let problem = format!("has {} numbers; VARS names {} columns", numbers.len(), names.len());
            return Err(text.wrong(n, problem));
        }
        if rows.len() == MAX_READINGS {
            return Err(text.wrong(n, format!("has more than {MAX_READINGS} readings; thin them out")));
        }
        picked.clear();
        picked.extend(rest.iter().map(|i| numbers[*i]));
        rows.push((at.map(|i| numbers[i]), values.colour(&picked, space).max(Vec3::ZERO)));
    }
    if let Some(points) = points.filter(|p| *p > rows.len()) {
        let problem =
            format!("NUM_POINTS is {points}, but there are {} readings; fetch the file again", rows.len());
        return Err(text.whole(problem));
    }
    let most = |a: usize| rows.iter().map(|r| r.0[a].abs()).fold(0.0, f32::max);
    // A little beyond, as files have few digits.
    let radians = most(0).max(most(2)) < FRAC_PI_2 + 0.01 && most(1).max(most(3)) < TAU + 0.01;
    let unit = if radians { 1.0 } else { 1f32.to_radians() };
    if most(0).max(most(2)) * unit > std::f32::consts::PI + 0.01 {
        return Err(text.whole("has polar angles beyond 180 degrees; expected angles from the normal"));
    }
    let readings = rows
        .into_iter()
        .map(|(angles, f)| {
            let [ti, pi, to, po] = angles.map(|a| a * unit);
            Reading { wi: spherical(ti, pi), wo: spherical(to, po), f, weight: 1.0 }
        })
        .collect();
    Measurement::new("ASTM E1392 or E2387", readings, None, Vec::new(), file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_1_PI, PI};
    use std::fmt::Write;

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn of(text: &str) -> Result<Measurement, String> {
        read(text.as_bytes(), "a.astm".as_ref(), SRGB).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_are_what_they_are_called() {
        let m = of(
            "METHOD gonio\nNUM_POINTS 1\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n0.5,1,0.3,-2,.1,-.2,.3,\nEND\n",
        );
        let r = m.unwrap().readings[0];
        assert!(
            (r.wi - spherical(0.5, 1.0)).length() < 1e-6 && (r.wo - spherical(0.3, -2.0)).length() < 1e-6
        );
        assert_eq!(r.f, Vec3::new(0.1, 0.0, 0.3));
        // Degrees, in another order, one value.
        let m = of("VARS=phi_r, theta_r, BRDF, theta_i, phi_i\n180 30 0.25 45 0\n").unwrap();
        let r = m.readings[0];
        assert!(
            (r.wi - spherical(PI / 4.0, 0.0)).length() < 1e-6
                && (r.wo - spherical(PI / 6.0, PI)).length() < 1e-6
        );
        assert_eq!(r.f, Vec3::splat(0.25));
    }

    #[test]
    fn a_spectrum_is_a_colour() {
        let line = |f: &dyn Fn(i32) -> f32| {
            let (mut names, mut values) = (String::new(), String::new());
            // Not in order.
            for l in (0..31).map(|i| 700 - 10 * i) {
                write!(names, ",{l}nm").unwrap();
                write!(values, ",{}", f(l)).unwrap();
            }
            of(&format!("VARS theta_i,phi_i,theta_s,phi_s{names}\n.1,0,.2,0{values}\n")).unwrap().readings[0]
                .f
        };
        assert!((line(&|_| 0.25) - 0.25).abs().max_element() < 1e-6);
        let red = line(&|l| if l > 600 { 0.3 } else { 0.0 });
        assert!(red.x > 0.2 && red.x > 10.0 * red.y && red.x > 10.0 * red.z, "{red}");
    }

    #[test]
    fn a_lambertian_comes_back() {
        let mut text = String::from("VARS theta_i,phi_i,theta_s,phi_s,500nm\n");
        // One side of the plane of incidence, as a goniometer scans.
        for (i, s, p) in (0..6).flat_map(|i| (0..6).flat_map(move |s| (0..7).map(move |p| (i, s, p)))) {
            writeln!(text, "{},0,{},{},{}", 15 * i, 15 * s, 30 * p, 0.5 * FRAC_1_PI).unwrap();
        }
        let m = of(&text).unwrap();
        assert!(m.isotropic);
        let g = m.table();
        assert_eq!((g.phi_o.len(), g.theta_o.len(), g.theta_i.len(), g.phi_d.len()), (1, 6, 6, 12));
        assert!(g.rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-6));
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let good = "NUM_POINTS 1\nVARS theta_i,phi_i,theta_s,phi_s,R,G,B\n.5,1,.3,2,.1,.2,.3\n";
        for (from, to, want) in [
            ("VARS", "VARIABLES", "a.astm: has no line 'VARS theta_i"),
            ("theta_i", "beta", "a.astm:2:1: VARS names no column theta_i"),
            (",R,G,B", "", "a.astm:2:1: VARS names no column of values"),
            ("R,G,B", "a,b", "a.astm:2:1: the columns a,b are not known"),
            ("R,G,B", "900nm,950nm,1um", "a.astm:2:1: the columns 900nm,950nm,1um are not known"),
            ("R,G,B", "900nm,950nm,990nm", "a.astm:2:1: the wavelengths do not reach into the visible"),
            ("R,G,B", "500nm,500nm,600nm", "a.astm:2:1: VARS names a wavelength twice"),
            (",.2,.3", ",.2", "a.astm:3:1: has 6 numbers; VARS names 7 columns"),
            (".2,.3", ".2,inf", "a.astm:3:1: 'inf' is not a finite number"),
            ("POINTS 1", "POINTS 2", "a.astm: NUM_POINTS is 2, but there are 1 readings"),
            (".5,1", "400,1", "a.astm: has polar angles beyond 180 degrees"),
            (".5,1", "95,1", "a.astm: has no reading with light and eye above"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = of(&good.replacen(from, to, 1)).unwrap_err();
            assert!(error.starts_with(want), "{error}");
        }
    }
}
