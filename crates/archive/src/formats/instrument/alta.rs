//! ALTA's text format (Belcour, Barla and Pacanowski 2014), `.brdf`, `.alta` or `.dat`: readings one a line behind a
//! header that says what the numbers are.
//!
//! ```text
//! #DIM 3 1
//! #PARAM_IN  ISOTROPIC_TV_TL_DPHI
//! #PARAM_OUT INV_STERADIAN
//! 0.1  0.5  3.14159  0.318
//! ```
//! First the directions, as [`FEATURES`] lists them, angles in radians, V the eye and L the light; then one value or
//! three. What stands behind them on a line, the bounds of `#VS`, is passed over.

use super::numbers::{Text, words};
use super::{MAX_READINGS, Measurement, Reading, from_xyz};
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place};
use glam::{Mat3, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_reflectance::importance::from_rusinkiewicz;

/// What is made of parametrisations.
pub const FEATURES: &[Feature] = &[
    Feature::yes("RUSIN_TH_PH_TD_PD"),
    Feature::partly("RUSIN_TH_PH_TD", "phi_d is taken as 0"),
    Feature::yes("RUSIN_TH_TD_PD"),
    Feature::partly("RUSIN_TH_TD", "phi_d is taken as 90 degrees"),
    Feature::partly("COS_TH_TD", "phi_d is taken as 0, as ALTA does"),
    Feature::partly("COS_TH", "light and eye are taken to be in one place"),
    Feature::yes("SPHERICAL_TL_PL_TV_PV"),
    Feature::yes("ISOTROPIC_TV_TL"),
    Feature::yes("ISOTROPIC_TV_TL_DPHI"),
    Feature::partly("ISOTROPIC_TV_PROJ_DPHI", "the light is taken to be overhead"),
    Feature::yes("ISOTROPIC_TL_TV_PROJ_DPHI"),
    Feature::yes("CARTESIAN"),
    Feature::no(
        "SCHLICK_*, STARK_*, NEUMANN_*, RETRO_*, STEREOGRAPHIC",
        "convert them with ALTA's data2data",
    ),
    Feature::yes("INV_STERADIAN"),
    Feature::yes("INV_STERADIAN_COSINE_FACTOR"),
    Feature::partly("RGB_COLOR", "taken as f in 1/sr, linear sRGB"),
    Feature::partly("XYZ_COLOR", "taken as f in 1/sr, white at X = Y = Z"),
    Feature::no("ENERGY", "not a reflectance"),
    Feature::no("#FORMAT binary", "convert it to text with ALTA's data2data"),
];

/// How many numbers a parametrisation takes, and whether it leaves out how the sample is turned.
fn directions(name: &str) -> Option<(usize, bool)> {
    Some(match name {
        "COS_TH" => (1, true),
        "RUSIN_TH_TD" | "COS_TH_TD" | "ISOTROPIC_TV_TL" | "ISOTROPIC_TV_PROJ_DPHI" => (2, true),
        "RUSIN_TH_TD_PD" | "ISOTROPIC_TV_TL_DPHI" | "ISOTROPIC_TL_TV_PROJ_DPHI" => (3, true),
        "RUSIN_TH_PH_TD" => (3, false),
        "RUSIN_TH_PH_TD_PD" | "SPHERICAL_TL_PL_TV_PV" => (4, false),
        "CARTESIAN" => (6, false),
        _ => return None,
    })
}

/// wi and wo.
fn convert(name: &str, x: &[f32]) -> Option<(Vec3, Vec3)> {
    let half = |th: f32, ph: f32, td: f32, pd: f32| {
        // φ_d is the eye's azimuth about the half vector; there it is the light's.
        let (wi, wo) = from_rusinkiewicz(th, td, pd);
        let turn = Mat3::from_rotation_z(ph);
        (turn * wi, turn * wo)
    };
    let acos = |c: f32| c.clamp(-1.0, 1.0).acos();
    let projected = |x: f32, y: f32| spherical(x.hypot(y), y.atan2(x));
    Some(match (name, x) {
        ("COS_TH", [h]) => half(acos(*h), 0.0, 0.0, 0.0),
        ("COS_TH_TD", [h, d]) => half(acos(*h), 0.0, acos(*d), 0.0),
        ("RUSIN_TH_TD", [h, d]) => half(*h, 0.0, *d, FRAC_PI_2),
        ("RUSIN_TH_TD_PD", [h, d, pd]) => half(*h, 0.0, *d, *pd),
        ("RUSIN_TH_PH_TD", [h, ph, d]) => half(*h, *ph, *d, 0.0),
        ("RUSIN_TH_PH_TD_PD", [h, ph, d, pd]) => half(*h, *ph, *d, *pd),
        ("ISOTROPIC_TV_TL", [v, l]) => (spherical(*l, 0.0), spherical(*v, 0.0)),
        ("ISOTROPIC_TV_TL_DPHI", [v, l, d]) => (spherical(*l, *d), spherical(*v, 0.0)),
        ("ISOTROPIC_TV_PROJ_DPHI", [x, y]) => (Vec3::Z, projected(*x, *y)),
        ("ISOTROPIC_TL_TV_PROJ_DPHI", [l, x, y]) => (spherical(*l, 0.0), projected(*x, *y)),
        ("SPHERICAL_TL_PL_TV_PV", [tl, pl, tv, pv]) => (spherical(*tl, *pl), spherical(*tv, *pv)),
        ("CARTESIAN", x) => {
            let (v, l) = (Vec3::from_slice(x.get(..3)?), Vec3::from_slice(x.get(3..6)?));
            (l.try_normalize()?, v.try_normalize()?)
        }
        _ => return None,
    })
}

/// The readings of a file, colours in `space`.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    // Bytes of a binary form need not be text, and are told of before.
    let lines = bytes.split(|b| *b == b'\n' || *b == b'\r').map(<[u8]>::trim_ascii);
    if lines.take(64).any(|l| l.starts_with(b"#FORMAT") && l.ends_with(b"binary")) {
        let problem = "this is ALTA's binary form, which is not read; convert it to text with its data2data";
        return Err(Error::invalid(Place::file(file), problem));
    }
    let text = Text::new(bytes, file)?;
    let mut dim: Option<(usize, [usize; 2])> = None;
    let (mut input, mut output) = ("", "");
    let mut readings = Vec::new();
    let mut numbers: Vec<f32> = Vec::new();
    let mut head: Option<(bool, usize)> = None;
    for (n, line) in text.lines() {
        if let Some(header) = line.strip_prefix('#') {
            let mut words = words(header);
            let word = words.next();
            if head.is_some() && matches!(word, Some("DIM" | "PARAM_IN" | "PARAM_OUT")) {
                return Err(text.wrong(n, "a header behind the first reading; put it before all of them"));
            }
            match word {
                Some("DIM") => {
                    let mut count =
                        || words.next().and_then(|w| w.parse().ok()).filter(|d| (1..=64).contains(d));
                    let (Some(i), Some(o)) = (count(), count()) else {
                        return Err(text.wrong(n, "expected two counts from 1 to 64, as in '#DIM 3 1'"));
                    };
                    dim = Some((n, [i, o]));
                }
                Some("PARAM_IN") => {
                    input = known(text, n, words.next(), "parametrisation of directions", &|name| {
                        directions(name).is_some()
                    })?;
                }
                Some("PARAM_OUT") => {
                    output = known(text, n, words.next(), "parametrisation of values", &|name| {
                        directions(name).is_none()
                    })?;
                }
                _ => {}
            }
            continue;
        }
        // Whatever stands before the header is for people.
        let Some((at, [i, o])) = dim.filter(|_| !line.is_empty()) else { continue };
        let values = match head {
            Some((_, values)) => values,
            None => {
                let Some((count, isotropic)) = directions(input) else {
                    return Err(text.whole("needs a header '#PARAM_IN' that names the directions"));
                };
                if output.is_empty() {
                    return Err(text.whole("needs a header '#PARAM_OUT' that names the values"));
                }
                if count != i || ![1, 3].contains(&o) {
                    let problem =
                        format!("{input} has {count} numbers and a value 1 or 3, but #DIM says {i} and {o}");
                    return Err(text.wrong(at, problem));
                }
                head.insert((isotropic, o)).1
            }
        };
        numbers.clear();
        for word in words(line).take(i + values) {
            numbers.push(text.number(n, word)?);
        }
        if numbers.len() < i + values {
            let problem = format!(
                "has {} numbers; expected {i} for the directions and {values} for the value",
                numbers.len()
            );
            return Err(text.wrong(n, problem));
        }
        if readings.len() == MAX_READINGS {
            return Err(text.wrong(n, format!("has more than {MAX_READINGS} readings; thin them out")));
        }
        let Some((wi, wo)) = convert(input, &numbers[..i]) else {
            return Err(text.wrong(n, "has a vector of no length"));
        };
        let value = match &numbers[i..] {
            [r, g, b] => Vec3::new(*r, *g, *b),
            all => Vec3::splat(all[0]),
        };
        let colour = match output {
            "XYZ_COLOR" => from_xyz(space),
            _ => ColourSpace::LinearSrgb.matrix_to(space),
        };
        let cosine = if output == "INV_STERADIAN_COSINE_FACTOR" { wi.z.max(1e-4) } else { 1.0 };
        let f = (colour * value / cosine).max(Vec3::ZERO);
        readings.push(Reading { wi, wo, f, weight: 1.0 });
    }
    let isotropic = head.filter(|h| h.0).map(|_| true);
    Measurement::new("ALTA", readings, isotropic, Vec::new(), file)
}

/// A word that the table says is read.
fn known(
    text: Text,
    line: usize,
    word: Option<&str>,
    what: &'static str,
    fits: &dyn Fn(&str) -> bool,
) -> Result<&'static str, Error> {
    let word = word.unwrap_or_default();
    let read = |f: &Feature| !matches!(f.support, Support::No(_)) && fits(f.name);
    match find(FEATURES, word) {
        Some(f) if read(f) => Ok(f.name),
        _ => {
            let names: Vec<_> = FEATURES.iter().filter(|f| read(f)).map(|f| f.name).collect();
            let short: String = word.chars().take(40).collect();
            Err(text
                .wrong(line, format!("the {what} '{short}' is not read; these are: {}", names.join(", "))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_1_PI, PI};

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn of(text: &str) -> Result<Measurement, String> {
        read(text.as_bytes(), "a.brdf".as_ref(), SRGB).map_err(|e| e.to_string())
    }

    #[test]
    fn directions_are_what_the_header_says() {
        let at = |input: &str, numbers: &str| {
            let dim = numbers.split(' ').count();
            let m = of(&format!(
                "for people\n#DIM {dim} 1\n#PARAM_IN  {input}\n#PARAM_OUT INV_STERADIAN\n{numbers} 0.25 9 9\n"
            ));
            let m = m.unwrap();
            assert_eq!(m.readings[0].f, Vec3::splat(0.25));
            (m.readings[0].wi, m.readings[0].wo, m.isotropic)
        };
        let close = |got: (Vec3, Vec3, bool), wi: Vec3, wo: Vec3| {
            assert!((got.0 - wi).length() < 1e-5 && (got.1 - wo).length() < 1e-5, "{got:?} {wi} {wo}");
        };
        close(at("CARTESIAN", "0 0 2 3 0 4"), Vec3::new(0.6, 0.0, 0.8), Vec3::Z);
        close(at("SPHERICAL_TL_PL_TV_PV", "0.5 1 0.3 2"), spherical(0.5, 1.0), spherical(0.3, 2.0));
        close(at("ISOTROPIC_TV_TL_DPHI", "0.3 0.5 2"), spherical(0.5, 2.0), spherical(0.3, 0.0));
        close(at("ISOTROPIC_TV_TL", "0.3 -0.5"), spherical(0.5, PI), spherical(0.3, 0.0));
        close(at("ISOTROPIC_TL_TV_PROJ_DPHI", "0.5 0 0.3"), spherical(0.5, 0.0), spherical(0.3, FRAC_PI_2));
        // A mirror: the half vector is upright.
        let (wi, wo, isotropic) = at("RUSIN_TH_TD_PD", "0 0.7 0.4");
        assert!(
            isotropic
                && ((wi + wo).normalize() - Vec3::Z).length() < 1e-6
                && (wi.z - 0.7f32.cos()).abs() < 1e-6
        );
        let (wi, wo, _) = at("RUSIN_TH_PH_TD_PD", "0.2 1 0.7 0.4");
        assert!(((wi + wo).normalize() - spherical(0.2, 1.0)).length() < 1e-5);
        close(at("COS_TH", "0.8"), Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.6, 0.0, 0.8));
        let (wi, wo, _) = at("COS_TH_TD", "1 0.8");
        assert!((wi.z - 0.8).abs() < 1e-6 && (wo.z - 0.8).abs() < 1e-6);
    }

    #[test]
    fn lines_end_as_they_like() {
        let text = "#DIM 2 1\n#PARAM_IN ISOTROPIC_TV_TL\n#PARAM_OUT INV_STERADIAN\n0.1 0.5 0.25\n0.2 0.5 x\n";
        let good = text.replace('x', "0.5");
        let [lf, cr, both] = ["\n", "\r", "\r\n"].map(|end| of(&good.replace('\n', end)).unwrap().readings);
        assert!(lf.len() == 2 && lf.iter().zip(&cr).zip(&both).all(|((a, b), c)| a.f == b.f && a.f == c.f));
        let error = of(&text.replace('\n', "\r")).unwrap_err();
        assert!(error.starts_with("a.brdf:5:1: 'x'"), "{error}");
        let error = of(&format!("#FORMAT binary\r{}", text.replace('\n', "\r"))).unwrap_err();
        assert!(error.contains("binary form"), "{error}");
    }

    #[test]
    fn values_have_colours_and_cosines() {
        let text = |out: &str, values: &str| {
            let n = values.split(' ').count();
            format!("#DIM 2 {n}\n#PARAM_IN ISOTROPIC_TV_TL\n#PARAM_OUT {out}\n0.1 1.0471976 {values}\n")
        };
        let f = |out: &str, values: &str| of(&text(out, values)).unwrap().readings[0].f;
        assert!((f("INV_STERADIAN_COSINE_FACTOR", "0.25") - 0.5).abs().max_element() < 1e-6);
        assert_eq!(f("RGB_COLOR", "1 2 -3"), Vec3::new(1.0, 2.0, 0.0));
        assert!((f("XYZ_COLOR", "0.5 0.5 0.5") - 0.5).abs().max_element() < 1e-5);
    }

    #[test]
    fn a_lambertian_comes_back() {
        let mut text = String::from("#DIM 3 1\n#PARAM_IN ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n");
        for (v, l, d) in (0..5).flat_map(|v| (0..5).flat_map(move |l| (0..7).map(move |d| (v, l, d)))) {
            let [v, l] = [v, l].map(|i| 0.3 * i as f32);
            text += &format!("{v}\t{l}\t{}\t{}\n", d as f32 * PI / 6.0, 0.5 * FRAC_1_PI);
        }
        let m = of(&text).unwrap();
        let g = m.table();
        assert_eq!((m.isotropic, g.theta_o.len(), g.theta_i.len(), g.phi_d.len()), (true, 5, 5, 12));
        assert!(g.rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-6));
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let good = "#DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 0.3\n";
        for (from, to, want) in [
            (
                "OUT INV_STERADIAN",
                "OUT RUSIN_TH_TD",
                "a.brdf:3:1: the parametrisation of values 'RUSIN_TH_TD' is not read",
            ),
            (
                "IN RUSIN_TH_TD",
                "IN RGB_COLOR",
                "a.brdf:2:1: the parametrisation of directions 'RGB_COLOR' is not read",
            ),
            ("0.3\n", "0.3\n#PARAM_IN CARTESIAN\n", "a.brdf:5:1: a header behind the first reading"),
            ("#DIM 2 1", "#DIM 2", "a.brdf:1:1: expected two counts from 1 to 64"),
            (
                "#DIM 2 1",
                "#DIM 3 1",
                "a.brdf:1:1: RUSIN_TH_TD has 2 numbers and a value 1 or 3, but #DIM says 3 and 1",
            ),
            (
                "RUSIN_TH_TD",
                "STARK_2D",
                "a.brdf:2:1: the parametrisation of directions 'STARK_2D' is not read",
            ),
            ("INV_STERADIAN", "ENERGY", "a.brdf:3:1: the parametrisation of values 'ENERGY' is not read"),
            ("#PARAM_IN RUSIN_TH_TD\n", "", "a.brdf: needs a header '#PARAM_IN'"),
            ("#PARAM_OUT INV_STERADIAN\n", "", "a.brdf: needs a header '#PARAM_OUT'"),
            (
                "0.2 0.3",
                "0.2",
                "a.brdf:4:1: has 2 numbers; expected 2 for the directions and 1 for the value",
            ),
            ("0.2 0.3", "0.2 nan", "a.brdf:4:1: 'nan' is not a finite number"),
            ("0.1 0.2 0.3\n", "", "a.brdf: has no reading with light and eye above the horizon"),
            ("0.1 0.2 0.3", "3.0 0.2 0.3", "a.brdf: has no reading with light and eye above the horizon"),
            ("#PARAM_OUT", "#FORMAT binary\n#PARAM_OUT", "a.brdf: this is ALTA's binary form"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = of(&good.replacen(from, to, 1)).unwrap_err();
            assert!(error.starts_with(want), "{error}");
        }
    }
}
