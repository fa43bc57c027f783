//! Goniometer tables: Yugen's own text format for BRDF readings, small enough to write by hand or by a script.
//!
//! ```text
//! yugen-goniometer 1
//! # anything after a hash is for people
//! channels rgb            # or: grey
//! theta_o 0 30 60         # polar angles of the eye, degrees
//! phi_o 0                 # azimuths of the eye; one for an isotropic material
//! theta_i 0 20 40 60 80   # polar angles of the light
//! phi_d 0 90 180 270      # azimuths of the light, from the eye's
//! values                  # f in 1/sr, linear sRGB; phi_d fastest, then theta_i, phi_o, theta_o
//! 0.1 0.1 0.1  0.12 0.1 0.09  -  …
//! ```
//! A `-` in place of a reading (of all its channels) says that there is none.

use crate::{Error, Place};
use glam::Vec3;
use std::fmt::Write;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_reflectance::tabulated::Goniometry;

const MAGIC: &str = "yugen-goniometer";
const AXES: [&str; 4] = ["theta_o", "phi_o", "theta_i", "phi_d"];

/// The readings of a file, colours in `space`, angles in radians, NaN where there is none.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Goniometry, Error> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        Error::invalid(
            Place::byte(file, e.valid_up_to() as u64),
            "this is not text in UTF-8; expected a goniometer table",
        )
    })?;
    // Words with their place in the text, comments left out.
    let mut words = text.split_inclusive('\n').scan(0, |at, line| {
        let start = *at;
        *at += line.len();
        Some((start, line.split('#').next().unwrap_or_default()))
    });
    let mut lines = words.by_ref().filter(|(_, line)| !line.trim().is_empty());
    let place = |offset: usize| Place::in_text(file, text, offset);
    let inside = |line: &str, word: &str| word.as_ptr() as usize - line.as_ptr() as usize;
    let number = |start: usize, line: &str, word: &str| -> Result<f32, Error> {
        word.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(|| {
            Error::invalid(place(start + inside(line, word)), format!("'{word}' is not a finite number"))
        })
    };

    match lines.next() {
        Some((_, line)) if line.split_whitespace().eq([MAGIC, "1"]) => {}
        _ => return Err(Error::invalid(place(0), format!("a goniometer file starts with '{MAGIC} 1'"))),
    }
    let mut grey = None;
    let mut axes: [Option<Vec<f32>>; 4] = Default::default();
    let mut ended = text.len();
    for (start, line) in lines.by_ref() {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { continue };
        let here = place(start + inside(line, key));
        if key == "values" {
            ended = start;
            break;
        } else if key == "channels" {
            let kind = words.next().unwrap_or_default();
            grey = match kind {
                "rgb" => Some(false),
                "grey" => Some(true),
                _ => return Err(Error::unknown(here, "kind of channels", kind, ["rgb", "grey"])),
            };
        } else if let Some(axis) = AXES.iter().position(|a| *a == key) {
            let angles: Result<Vec<f32>, Error> =
                words.map(|w| number(start, line, w).map(f32::to_radians)).collect();
            axes[axis] = Some(angles?);
        } else {
            return Err(Error::unknown(here, "key", key, AXES.into_iter().chain(["channels", "values"])));
        }
    }
    let missing = |what: &str| Error::invalid(place(ended), format!("'{what}' must come before the values"));
    let grey = grey.ok_or_else(|| missing("channels"))?;
    let [theta_o, phi_o, theta_i, phi_d] = axes;
    let mut g = Goniometry {
        theta_o: theta_o.ok_or_else(|| missing("theta_o"))?,
        phi_o: phi_o.ok_or_else(|| missing("phi_o"))?,
        theta_i: theta_i.ok_or_else(|| missing("theta_i"))?,
        phi_d: phi_d.ok_or_else(|| missing("phi_d"))?,
        rgb: Vec::new(),
    };

    let to_space = ColourSpace::LinearSrgb.matrix_to(space);
    let mut partial: Vec<f32> = Vec::new();
    for (start, line) in lines {
        for word in line.split_whitespace() {
            if word == "-" && partial.is_empty() {
                g.rgb.extend([f32::NAN; 3]);
                continue;
            }
            let value = number(start, line, word)?;
            if value < 0.0 {
                let at = place(start + inside(line, word));
                return Err(Error::invalid(
                    at,
                    format!("a reflection cannot be {value}; write '-' for no reading"),
                ));
            }
            partial.push(value);
            if grey || partial.len() == 3 {
                let rgb = if grey { Vec3::splat(value) } else { to_space * Vec3::from_slice(&partial) };
                g.rgb.extend(rgb.to_array());
                partial.clear();
            }
        }
    }
    if !partial.is_empty() {
        return Err(Error::invalid(place(text.len()), "the last reading lacks a channel"));
    }
    g.check().map_err(|problem| Error::invalid(Place::file(file), format!("the table {problem}")))?;
    Ok(g)
}

/// The text of a file with these readings, whose colours are of `space`.
pub fn write(g: &Goniometry, space: ColourSpace) -> String {
    let to_srgb = space.matrix_to(ColourSpace::LinearSrgb);
    let mut text = format!("{MAGIC} 1\nchannels rgb\n");
    for (name, axis) in AXES.iter().zip([&g.theta_o, &g.phi_o, &g.theta_i, &g.phi_d]) {
        text.push_str(name);
        for angle in axis {
            let _ = write!(text, " {}", f64::from(*angle).to_degrees());
        }
        text.push('\n');
    }
    text.push_str("values\n");
    for row in g.rgb.chunks(3 * g.phi_d.len().max(1)) {
        for rgb in row.chunks_exact(3).map(Vec3::from_slice) {
            if rgb.is_nan() {
                text.push_str(" -");
            } else {
                // Colours outside sRGB are cut at zero, as no reading is negative.
                let c = (to_srgb * rgb).max(Vec3::ZERO);
                let _ = write!(text, " {} {} {}", c.x, c.y, c.z);
            }
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "yugen-goniometer 1   # a test\n\nchannels grey\ntheta_o 0 60\nphi_o 0\ntheta_i 0 45 80\n\
                         phi_d 0 180\nvalues\n0.1 0.2 0.3 - 0.5 0.6 # first eye\n1 2 3 4 5 6\n";

    fn parse(text: &str) -> Result<Goniometry, Error> {
        read(text.as_bytes(), Path::new("a.gonio"), ColourSpace::LinearSrgb)
    }

    #[test]
    fn files_are_read_and_come_back() {
        let g = parse(SMALL).unwrap();
        assert_eq!(g.theta_i, [0.0, 45f32.to_radians(), 80f32.to_radians()]);
        assert_eq!(g.rgb[..9], [0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3]);
        assert!(g.rgb[9].is_nan() && g.rgb.len() == 36);
        let back = parse(&write(&g, ColourSpace::LinearSrgb)).unwrap();
        // NaN is not itself: compare the bits.
        let bits = |g: &Goniometry| g.rgb.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
        assert_eq!(bits(&back), bits(&g));
        assert!(back.theta_i.iter().zip(&g.theta_i).all(|(a, b)| (a - b).abs() < 1e-6));
        let rgb = parse(
            &SMALL
                .replace("grey", "rgb")
                .replace("- 0.5 0.6", "- 0.5 0.6 0.7 - - -")
                .replace("1 2 3 4 5 6", &"1 2 3 ".repeat(6)),
        );
        let rgb = rgb.unwrap();
        assert_eq!(rgb.rgb[33..], [1.0, 2.0, 3.0]);
        let wide = read(SMALL.as_bytes(), Path::new("a"), ColourSpace::LinearRec2020).unwrap();
        assert!((wide.rgb[3] - 0.2).abs() < 1e-6, "grey stays grey");
    }

    #[test]
    fn bad_files_get_a_sentence() {
        for (from, to, want) in [
            (
                "yugen-goniometer 1",
                "yugen-goniometer 2",
                "a.gonio:1:1: a goniometer file starts with 'yugen-goniometer 1'",
            ),
            ("theta_i 0", "tehta_i 0", "a.gonio:6:1: unknown key 'tehta_i'; did you mean 'theta_i'?"),
            ("grey", "gray", "a.gonio:3:1: unknown kind of channels 'gray'; did you mean 'grey'?"),
            ("0.5", "half", "a.gonio:9:15: 'half' is not a finite number"),
            ("0.5", "nan", "a.gonio:9:15: 'nan' is not a finite number"),
            ("0.5", "-0.5", "a.gonio:9:15: a reflection cannot be -0.5; write '-' for no reading"),
            ("phi_o 0\n", "", "a.gonio:7:1: 'phi_o' must come before the values"),
            ("1 2 3", "1 2", "a.gonio: the table has 33 numbers; its axes need 36"),
            ("grey", "rgb", "a.gonio:11:1: the last reading lacks a channel"),
            (
                "45 80",
                "80 45",
                "a.gonio: the table needs at least two polar angles theta_i that rise from 0 to at most 90 degrees",
            ),
            (
                "0 180",
                "0 360",
                "a.gonio: the table needs azimuths phi_d that rise and end before they come round",
            ),
        ] {
            assert!(SMALL.contains(from));
            let got = parse(&SMALL.replacen(from, to, 1)).unwrap_err().to_string();
            assert_eq!(got, want, "{from} -> {to}");
        }
        assert!(
            read(&[0x79, 0xff], Path::new("a"), ColourSpace::LinearSrgb)
                .unwrap_err()
                .to_string()
                .contains("UTF-8")
        );
        for n in 0..SMALL.len() - 12 {
            assert!(parse(&SMALL[..n]).is_err(), "{n}");
        }
    }
}
