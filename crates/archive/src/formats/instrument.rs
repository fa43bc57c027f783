//! Reflectance as instruments and the programs beside them write it: whatever the format, a list of readings.
//!
//! Formats are told apart by what is in a file, as several share an extension. All give f in 1/sr, without the cosine;
//! directions point away from the surface, normal +z, tangent +x. A file of one channel is grey. Values below zero are
//! noise about zero and become zero.

pub mod alta;
pub mod astm;
mod numbers;
mod table;
pub mod utia;
pub mod window;
pub mod zemax;

use crate::disk::read_filled;
use crate::{Error, Place};
use glam::{DVec3, Mat3, Vec3};
use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::colour::bradford;
use yugen_reflectance::tabulated::Goniometry;

/// A reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// To the light, unit, above the horizon.
    pub wi: Vec3,
    /// To the eye, unit, above the horizon.
    pub wo: Vec3,
    /// f in 1/sr, linear RGB, 0 or more.
    pub f: Vec3,
    /// The share of dω_i dω_o that it stands for, in any unit; 1 where the format does not tell.
    pub weight: f32,
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The format's name, for people.
    pub format: &'static str,
    /// At least one.
    pub readings: Vec<Reading>,
    /// Whether the material looks the same however it is turned: the format says so, the sample was not turned, or all
    /// readings that differ by a turn agree.
    pub isotropic: bool,
    /// What else is in the file, and was not read: words of the file.
    pub left_out: Vec<String>,
}

/// A format.
pub struct Format {
    /// For people.
    pub name: &'static str,
    /// Lower case, without the dot; others may have them, too.
    pub extensions: &'static [&'static str],
    /// Whether a file that begins like this, and has so many bytes, is of this format.
    recognises: fn(&[u8], u64) -> bool,
    read: fn(&[u8], &Path, ColourSpace) -> Result<Measurement, Error>,
}

/// One line a format.
pub const FORMATS: &[Format] = &[
    Format {
        name: "UTIA BRDF",
        extensions: &["bin"],
        // There is no magic; but no text.
        recognises: |head, size| {
            size == utia::BYTES as u64 && (head.contains(&0) || std::str::from_utf8(head).is_err())
        },
        read: utia::read,
    },
    Format {
        name: "LBNL WINDOW XML",
        extensions: &["xml"],
        recognises: |head, _| contains(head, b"<WindowElement"),
        read: window::read,
    },
    Format {
        name: "Zemax or ASAP BSDF",
        extensions: &["bsdf", "txt"],
        recognises: |head, _| {
            let word = b"AngleOfIncidence";
            has_line(head, |l| l.get(..word.len()).is_some_and(|l| l.eq_ignore_ascii_case(word)))
        },
        read: zemax::read,
    },
    Format {
        name: "ALTA",
        extensions: &["brdf", "alta", "dat", "txt"],
        recognises: |head, _| has_line(head, |l| l.starts_with(b"#DIM")),
        read: alta::read,
    },
    Format {
        name: "ASTM E1392 or E2387",
        extensions: &["astm", "brdf", "txt"],
        recognises: |head, _| has_line(head, |l| astm::names_columns(l).is_some()),
        read: astm::read,
    },
];

/// How much of a file is looked at to tell its format.
const HEAD: u64 = 1 << 16;
/// The largest file: a tensor tree of a few million leaves.
pub const MAX_BYTES: u64 = 1 << 28;
/// More readings are refused: 168 MB.
const MAX_READINGS: usize = 1 << 22;
/// Directions nearer to the horizon, by the cosine, are on it.
const HORIZON: f32 = 1e-4;

fn contains(bytes: &[u8], word: &[u8]) -> bool {
    bytes.windows(word.len()).any(|w| w == word)
}

fn has_line(bytes: &[u8], wanted: impl Fn(&[u8]) -> bool) -> bool {
    bytes.split(|b| *b == b'\n' || *b == b'\r').any(|l| wanted(l.trim_ascii_start()))
}

/// The format of a file that begins with `head` and has `size` bytes.
fn recognise(head: &[u8], size: u64) -> Option<&'static Format> {
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    FORMATS.iter().find(|f| (f.recognises)(head, size))
}

/// The format of a file; `None` if it is of none, or cannot be read.
pub fn format_of(file: &Path) -> Option<&'static Format> {
    let open = crate::open(file).ok()?;
    let meta = open.metadata().ok().filter(|m| m.is_file())?;
    let mut head = Vec::new();
    open.take(HEAD).read_to_end(&mut head).ok()?;
    recognise(&head, meta.len())
}

/// The readings in a file, colours in `space`.
///
/// # Errors
/// A file of none of the [`FORMATS`]; and what is wrong in one, with its place.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    let head = &bytes[..bytes.len().min(HEAD as usize)];
    let Some(format) = recognise(head, bytes.len() as u64) else {
        let known: Vec<_> = FORMATS.iter().map(|f| f.name).collect();
        let problem = format!(
            "this is no measurement of a known format; known are {}; write the readings as lines of wi, wo, r, g, b into a \
             .csv",
            known.join(", ")
        );
        return Err(Error::invalid(Place::file(file), problem));
    };
    (format.read)(bytes, file, space)
}

/// [`read`] of a file by its name.
pub fn load(file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    read(&read_filled(file, MAX_BYTES)?, file, space)
}

impl Measurement {
    /// Those `readings` that have both directions above the horizon. Whether they are isotropic is found out where the
    /// format does not say it.
    fn new(
        format: &'static str,
        mut readings: Vec<Reading>,
        isotropic: Option<bool>,
        left_out: Vec<String>,
        file: &Path,
    ) -> Result<Self, Error> {
        readings.retain(|r| r.wi.z > HORIZON && r.wo.z > HORIZON);
        if let Some(i) = readings.iter().position(|r| !r.f.is_finite()) {
            let problem =
                format!("reading {} is too bright for a number, once its cosine is taken off", i + 1);
            return Err(Error::invalid(Place::file(file), problem));
        }
        if readings.is_empty() {
            let problem = "has no reading with light and eye above the horizon";
            return Err(Error::invalid(Place::file(file), problem));
        }
        let isotropic = isotropic.unwrap_or_else(|| looks_isotropic(&readings));
        Ok(Self { format, readings, isotropic, left_out })
    }

    /// As a table for the model `tabulated`: exactly, where the readings lie on its grid, else interpolated
    /// between the nearest of them, and beyond the last ones held.
    pub fn table(&self) -> Goniometry {
        table::of(self)
    }
}

/// By how much readings that differ by a turn may, as the root mean square of their cube roots, relative to those:
/// some 9 % of f. Matrices that were drawn at random are as noisy.
const GRAIN: f64 = 0.03;

/// Whether readings that differ by a turn of the sample agree; of a sample that was not turned nothing else is known.
fn looks_isotropic(readings: &[Reading]) -> bool {
    let polar = |w: Vec3| w.truncate().length().atan2(w.z).to_degrees();
    let azimuth = |w: Vec3| w.y.atan2(w.x).to_degrees();
    let apart = |a: f32, b: f32| ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs();
    let mut first: Option<f32> = None;
    let mut turned = false;
    // Tenths of a degree: finer than instruments step, coarser than single precision errs.
    let key = |a: f32| (10.0 * a).round() as i32;
    // Sum, sum of squares, count.
    let mut groups: HashMap<[i32; 3], [f64; 3]> = HashMap::new();
    for r in readings {
        let (ti, to) = (polar(r.wi), polar(r.wo));
        if ti > 0.1 {
            turned |= apart(azimuth(r.wi), *first.get_or_insert(azimuth(r.wi))) > 0.1;
        }
        let pole = ti < 0.1 || to < 0.1;
        let d = if pole { 0.0 } else { apart(azimuth(r.wo), azimuth(r.wi)) };
        let v = f64::from(r.f.element_sum()).cbrt();
        let [sum, squares, count] = groups.entry([key(ti), key(to), key(d)]).or_default();
        (*sum, *squares, *count) = (*sum + v, *squares + v * v, *count + 1.0);
    }
    let [mut within, mut all, mut count] = [0.0; 3];
    for [sum, squares, n] in groups.into_values().filter(|g| g[2] > 1.0) {
        within += squares - sum * sum / n;
        all += squares;
        count += n;
    }
    // Half of the readings must have one to agree with, or there is no telling.
    let told = 2.0 * count >= readings.len() as f64;
    !turned || (told && within <= GRAIN * GRAIN * all)
}

/// XYZ, in which a perfect white has X = Y = Z = 1, to linear RGB.
fn from_xyz(space: ColourSpace) -> Mat3 {
    let white = space.to_xyz() * DVec3::ONE;
    (space.to_xyz().inverse() * bradford(DVec3::ONE, white)).as_mat3()
}

/// The parts of dω that polar angles in degrees, rising, stand for: from the middle to the one before to that to the
/// one behind, with no sphere beyond `last`.
fn bands(angles: &[f32], last: f32) -> Vec<f32> {
    let edge = |i: usize| match (i.checked_sub(1).map(|b| angles[b]), angles.get(i)) {
        (Some(before), Some(behind)) => 0.5 * (before + behind),
        (None, Some(first)) => (first - 0.5 * angles.get(1).map_or(1.0, |second| second - first)).max(0.0),
        (Some(before), None) => {
            let step = i.checked_sub(2).map_or(1.0, |b| before - angles[b]);
            (before + 0.5 * step).min(last.max(before))
        }
        (None, None) => 0.0,
    };
    let cos: Vec<f32> = (0..=angles.len()).map(|i| edge(i).to_radians().cos()).collect();
    // Of an instrument that stands still, a small one.
    cos.windows(2).map(|w| (w[0] - w[1]).max(1e-6)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;
    use yugen_optics::frame::spherical;

    #[test]
    fn whites_stay_white() {
        for space in ColourSpace::ALL {
            let white = from_xyz(space) * Vec3::ONE;
            assert!((white - 1.0).abs().max_element() < 1e-5, "{white}");
        }
    }

    #[test]
    fn bands_make_up_the_hemisphere() {
        let all = bands(&[0.0, 10.0, 30.0, 60.0, 85.0], 90.0);
        assert!((all.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{all:?}");
        assert_eq!(bands(&[30.0], 90.0).len(), 1);
    }

    #[test]
    fn a_grain_is_seen_where_the_sample_was_turned() {
        let readings = |turns: &[f32], f: &dyn Fn(f32) -> f32| -> Vec<Reading> {
            let mut all = Vec::new();
            for phi in turns {
                for to in [0.2, 0.6, 1.0] {
                    let (wi, wo) = (spherical(0.5, *phi), spherical(to, phi + 2.0));
                    all.push(Reading { wi, wo, f: Vec3::splat(f(*phi)), weight: 1.0 });
                }
            }
            all
        };
        let turns = [0.0, 0.5, 1.0, 3.0];
        assert!(looks_isotropic(&readings(&turns, &|_| 0.2)));
        assert!(!looks_isotropic(&readings(&turns, &|phi| 0.2 + 0.1 * phi.cos())));
        assert!(looks_isotropic(&readings(&turns, &|phi| 0.2 + 0.01 * (9.0 * phi).cos())), "noise");
        assert!(looks_isotropic(&readings(&turns[..1], &|_| 0.2)), "not turned");
        // Turned, but nothing twice.
        let scattered: Vec<Reading> = (1..20)
            .map(|i| {
                let x = i as f32 * 0.37;
                let (wi, wo) = (spherical(0.04 * x, x), spherical(0.03 * x + 0.1, 2.3 * x));
                Reading { wi, wo, f: Vec3::ONE / PI, weight: 1.0 }
            })
            .collect();
        assert!(!looks_isotropic(&scattered));
    }

    #[test]
    fn files_of_no_format_get_a_sentence() {
        let error = read(b"OPTIS - brdf surface file v3.0\n", "a.brdf".as_ref(), ColourSpace::LinearSrgb);
        let error = error.unwrap_err().to_string();
        assert!(error.starts_with("a.brdf: this is no measurement of a known format"), "{error}");
    }
}
