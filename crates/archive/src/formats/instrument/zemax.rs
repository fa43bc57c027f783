//! Zemax tabular BSDF (Radiant Imaging's BSDF Data Interchange), also of ASAP: `.bsdf` as text.
//!
//! ```text
//! Source  Measured
//! Symmetry  PlaneSymmetrical
//! SpectralContent  Monochrome
//! ScatterType  BRDF
//! SampleRotation  1
//! 0
//! AngleOfIncidence  2
//! 0 30
//! ScatterAzimuth  3
//! 0 90 180
//! ScatterRadial  2
//! 0 10
//!
//! Monochrome
//! DataBegin
//! TIS 0.5
//! 0.16 0.15 …
//! DataEnd
//! ```
//! Degrees; f in 1/sr. Radial is the angle from the mirror direction, azimuth goes about it, counter-clockwise as the
//! light comes towards one, from the side of the normal. For each rotation of the sample and each incidence there
//! is a line of the total (which is not needed), then for each azimuth a line over the radials. The rotation is the
//! azimuth from the sample's +x of the normal of the plane of incidence; the light stands a right angle farther. `XYZ`
//! has three such blocks, white at X = Y = Z.

use super::numbers::{Text, words};
use super::{MAX_READINGS, Measurement, Reading, bands, from_xyz};
use crate::Error;
use crate::formats::support::{Feature, Support, find};
use glam::{Mat3, Vec3};
use std::path::Path;
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;

/// What is made of keywords.
pub const FEATURES: &[Feature] = &[
    Feature::yes("Source"),
    Feature::yes("Symmetry PlaneSymmetrical"),
    Feature::partly(
        "Symmetry ASymmetrical",
        "with one rotation, the two sides of the plane of incidence are averaged",
    ),
    Feature::yes("Symmetry ASymmetrical4D"),
    Feature::yes("SpectralContent Monochrome"),
    Feature::yes("SpectralContent XYZ"),
    Feature::yes("ScatterType BRDF"),
    Feature::no("ScatterType BTDF", "tables of readings reflect; what goes through is not read"),
    Feature::yes("SampleRotation"),
    Feature::yes("AngleOfIncidence"),
    Feature::yes("ScatterAzimuth"),
    Feature::yes("ScatterRadial"),
    Feature::partly("TIS", "passed over; the readings themselves say how much is scattered"),
];

const AXES: [&str; 4] = ["SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial"];
const BLOCKS: [&str; 4] = ["Monochrome", "TristimulusX", "TristimulusY", "TristimulusZ"];

/// The readings of a file, colours in `space`.
pub fn read(bytes: &[u8], file: &Path, space: ColourSpace) -> Result<Measurement, Error> {
    let text = Text::new(bytes, file)?;
    let mut lines = text.lines().filter(|(_, l)| !l.is_empty() && !l.starts_with('#')).peekable();
    let mut axes: [Vec<f32>; 4] = Default::default();
    // The header, to the first block.
    while let Some((n, line)) = lines.next_if(|(_, l)| !BLOCKS.iter().any(|b| l.eq_ignore_ascii_case(b))) {
        let mut all = words(line);
        let keyword = all.next().unwrap_or_default();
        let word = all.next().unwrap_or_default();
        if let Some(axis) = AXES.iter().position(|a| a.eq_ignore_ascii_case(keyword)) {
            let count =
                word.parse::<usize>().ok().filter(|c| (1..=100_000).contains(c)).ok_or_else(|| {
                    text.wrong(
                        n,
                        format!("'{keyword}' needs the count of its angles, which follow on the next line"),
                    )
                })?;
            let mut angles = Vec::new();
            while angles.len() < count {
                let Some((n, line)) = lines.next() else {
                    return Err(text.wrong(n, format!("'{keyword}' has fewer angles than {count}")));
                };
                for word in words(line) {
                    angles.push(text.number(n, word)?);
                }
            }
            if angles.len() > count {
                return Err(
                    text.wrong(n, format!("'{keyword}' has {} angles; its count is {count}", angles.len()))
                );
            }
            check(text, n, axis, &angles)?;
            axes[axis] = angles;
        } else {
            let name = FEATURES.iter().find(|f| {
                let mut parts = f.name.split(' ');
                parts.next().is_some_and(|p| p.eq_ignore_ascii_case(keyword))
                    && parts.next().is_none_or(|p| p.eq_ignore_ascii_case(word))
            });
            match name.and_then(|f| find(FEATURES, f.name)).map(|f| f.support) {
                Some(Support::No(why)) => {
                    return Err(text.wrong(n, format!("'{keyword} {word}' is not read: {why}")));
                }
                Some(_) => {}
                None => {
                    let known = FEATURES.iter().map(|f| f.name);
                    let short: String = line.chars().take(40).collect();
                    let problem =
                        format!("'{short}' is not known; expected {}", known.collect::<Vec<_>>().join(", "));
                    return Err(text.wrong(n, problem));
                }
            }
        }
    }
    if axes[0].is_empty() {
        axes[0].push(0.0);
    }
    if let Some(missing) = (1..4).find(|a| axes[*a].is_empty()) {
        return Err(text.whole(format!("has no '{}' before its data", AXES[missing])));
    }
    let each = axes[2].len() * axes[3].len();
    let count = axes.iter().try_fold(1usize, |n, a| n.checked_mul(a.len())).filter(|n| *n <= MAX_READINGS);
    let Some(count) = count else {
        return Err(text.whole(format!("has more than {MAX_READINGS} readings; thin them out")));
    };
    let mut channels: [Option<Vec<f32>>; 4] = Default::default();
    while let Some((n, line)) = lines.next() {
        let Some(block) = BLOCKS.iter().position(|b| b.eq_ignore_ascii_case(line)) else {
            let short: String = line.chars().take(40).collect();
            return Err(text.wrong(n, format!("expected one of {}, found '{short}'", BLOCKS.join(", "))));
        };
        let begins = lines.next().is_some_and(|(_, l)| l.eq_ignore_ascii_case("DataBegin"));
        if !begins {
            return Err(text.wrong(n, format!("expected 'DataBegin' behind '{}'", BLOCKS[block])));
        }
        let mut values = Vec::new();
        let mut last = n;
        for (n, line) in lines.by_ref() {
            last = n;
            if line.eq_ignore_ascii_case("DataEnd") {
                break;
            }
            if line.get(..3).is_some_and(|w| w.eq_ignore_ascii_case("TIS")) {
                if values.len() % each != 0 {
                    let problem = format!("the readings before end within an incidence; each has {each}");
                    return Err(text.wrong(n, problem));
                }
                continue;
            }
            for word in words(line) {
                if values.len() == count {
                    return Err(
                        text.wrong(n, format!("has more than the {count} readings that its angles make"))
                    );
                }
                values.push(text.number(n, word)?);
            }
        }
        if values.len() < count {
            let problem = format!("the block has {} readings; its angles make {count}", values.len());
            return Err(text.wrong(last, problem));
        }
        channels[block] = Some(values);
    }
    let colour = |i: usize| -> Option<Vec3> {
        let at = |c: usize| channels[c].as_ref().map(|all| all[i]);
        at(0).map(Vec3::splat).or_else(|| Some(from_xyz(space) * Vec3::new(at(1)?, at(2)?, at(3)?)))
    };
    if colour(0).is_none() {
        return Err(text.whole("has no block 'Monochrome' with data, and not all of TristimulusX, Y and Z"));
    }
    let [rotations, incidences, azimuths, radials] = &axes;
    let (light, eye) = (bands(incidences, 90.0), bands(radials, 180.0));
    let share = shares(azimuths);
    let mut readings = Vec::new();
    for (r, rotation) in rotations.iter().enumerate() {
        let turn = Mat3::from_rotation_z((rotation + 90.0).to_radians());
        for (t, theta) in incidences.iter().map(|t| t.to_radians()).enumerate() {
            // The mirror direction, and the one from it towards the normal.
            let (wi, mirror) = (spherical(theta, 0.0), spherical(-theta, 0.0));
            let up = Vec3::new(theta.cos(), 0.0, theta.sin());
            for (a, azimuth) in azimuths.iter().map(|a| a.to_radians()).enumerate() {
                for (d, radial) in radials.iter().map(|d| d.to_radians()).enumerate() {
                    // The mirror direction stands in the line of every azimuth.
                    if radial == 0.0 && a > 0 {
                        continue;
                    }
                    let around = azimuth.cos() * up + azimuth.sin() * Vec3::Y;
                    let wo = radial.cos() * mirror + radial.sin() * around;
                    let i = ((r * incidences.len() + t) * azimuths.len() + a) * radials.len() + d;
                    let weight = light[t] * eye[d] * if radial == 0.0 { 1.0 } else { share[a] };
                    let f = colour(i).unwrap_or_default().max(Vec3::ZERO);
                    readings.push(Reading { wi: turn * wi, wo: turn * wo, f, weight });
                }
            }
        }
    }
    let isotropic = (rotations.len() == 1).then_some(true);
    Measurement::new("Zemax or ASAP BSDF", readings, isotropic, Vec::new(), file)
}

/// What part of all azimuths each stands for: half of what lies to both sides, around the circle if they go around it. The
/// ends of half a circle, in the plane of incidence, are one side of it each and stand for half as much as the rest.
fn shares(azimuths: &[f32]) -> Vec<f32> {
    let [first, .., last] = azimuths else { return vec![1.0] };
    let steps: Vec<f32> = azimuths.windows(2).map(|w| w[1] - w[0]).collect();
    let gap = first + 360.0 - last;
    // Half a circle is one side of the plane of incidence, however coarse.
    let closes = last - first > 180.5 && gap < 1.5 * steps.iter().copied().fold(0.0, f32::max);
    let around = if closes { gap.max(0.0) } else { 0.0 };
    let step = |i: Option<usize>| i.and_then(|i| steps.get(i)).copied().unwrap_or(around);
    let all = last - first + around;
    (0..azimuths.len()).map(|i| 0.5 * (step(i.checked_sub(1)) + step(Some(i))) / all).collect()
}

/// Refuses angles that do not rise or are out of range.
fn check(text: Text, line: usize, axis: usize, angles: &[f32]) -> Result<(), Error> {
    let [low, high] = [[-360.0, 360.0], [0.0, 90.0], [-360.0, 360.0], [0.0, 180.0]][axis];
    if angles.windows(2).any(|w| w[0] >= w[1]) || angles.iter().any(|a| !(low..=high).contains(a)) {
        let problem =
            format!("the angles of '{}' must rise and lie between {low} and {high} degrees", AXES[axis]);
        return Err(text.wrong(line, problem));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_1_PI, PI};
    use std::fmt::Write;

    const SRGB: ColourSpace = ColourSpace::LinearSrgb;

    fn of(text: &str) -> Result<Measurement, String> {
        read(text.as_bytes(), "a.bsdf".as_ref(), SRGB).map_err(|e| e.to_string())
    }

    /// A file of `f(wi, wo)`.
    fn file(rotations: &[f32], azimuths: &[f32], f: impl Fn(Vec3, Vec3) -> f32) -> String {
        let incidences = [0.0f32, 20.0, 40.0, 60.0, 75.0];
        let radials = [0.0f32, 3.0, 8.0, 15.0, 30.0, 50.0, 70.0, 90.0, 120.0, 150.0];
        let list = |a: &[f32]| {
            format!("{}\n{}\n", a.len(), a.iter().map(f32::to_string).collect::<Vec<_>>().join("\t"))
        };
        let mut text = format!(
            "#of a program\nSource  Measured\nSymmetry  PlaneSymmetrical\nSpectralContent  Monochrome\nScatterType  BRDF\n\
             SampleRotation  {}AngleOfIncidence  {}ScatterAzimuth {}ScatterRadial {}\nMonochrome\nDataBegin\n",
            list(rotations),
            list(&incidences),
            list(azimuths),
            list(&radials)
        );
        for r in rotations {
            for t in incidences.map(f32::to_radians) {
                text += "TIS 0.5\n";
                for a in azimuths.iter().map(|a| a.to_radians()) {
                    for d in radials.map(f32::to_radians) {
                        // Turned about y by −θ, so that the pole comes to the mirror direction.
                        let s = spherical(d, a);
                        let w = Vec3::new(s.x * t.cos() - s.z * t.sin(), s.y, s.x * t.sin() + s.z * t.cos());
                        let turn = Mat3::from_rotation_z((r + 90.0).to_radians());
                        write!(text, "{:E}\t", f(turn * spherical(t, 0.0), turn * w)).unwrap();
                    }
                    text += "\n";
                }
            }
        }
        text + "DataEnd\n"
    }

    #[test]
    fn directions_go_out_from_the_mirror() {
        let f = |wi: Vec3, wo: Vec3| 1.0 + 0.5 * wi.x + 0.2 * wo.x + 0.1 * wo.y * wi.y;
        let half: Vec<f32> = (0..7).map(|i| 30.0 * i as f32).collect();
        let m = of(&file(&[0.0], &half, f)).unwrap();
        assert!(m.isotropic && m.readings.len() > 200);
        for r in &m.readings {
            assert!((r.f.x - f(r.wi, r.wo)).abs() < 1e-5 && r.f.x == r.f.z, "{r:?}");
        }
        let mirrors = m.readings.iter().filter(|r| ((r.wi + r.wo).normalize() - Vec3::Z).length() < 1e-5);
        assert_eq!(mirrors.count(), 5, "one for each incidence");
        let m = of(&file(&[0.0, 30.0, 90.0], &half, f)).unwrap();
        assert!(!m.isotropic);
        assert!(m.readings.iter().all(|r| (r.f.x - f(r.wi, r.wo)).abs() < 1e-5));
    }

    #[test]
    fn a_lambertian_comes_back() {
        let half: Vec<f32> = (0..7).map(|i| 30.0 * i as f32).collect();
        let m = of(&file(&[0.0], &half, |_, _| 0.5 * FRAC_1_PI)).unwrap();
        let g = m.table();
        assert_eq!(g.phi_o.len(), 1);
        assert!(g.rgb.iter().all(|v| (v - 0.5 * FRAC_1_PI).abs() < 1e-6));
    }

    /// What leans one way along the plane of incidence and the other way across it, over half the azimuths and over all of
    /// them: with the ends of the half counted in full, it would be 7 % too bright.
    #[test]
    fn readings_weigh_what_they_stand_for() {
        let f = |_: Vec3, wo: Vec3| {
            let (c, s) = (wo.x / wo.truncate().length().max(1e-6), wo.y / wo.truncate().length().max(1e-6));
            0.5 * FRAC_1_PI * (1.0 + 0.5 * (c * c - s * s))
        };
        for azimuths in [
            (0..7).map(|i| 30.0 * i as f32).collect::<Vec<_>>(),
            (0..12).map(|i| 30.0 * i as f32).collect(),
            (0..13).map(|i| 30.0 * i as f32).collect(),
        ] {
            let m = of(&file(&[0.0], &azimuths, f)).unwrap();
            // Straight up the mirror stands in a single line, where f is no mean of all azimuths.
            let upright: Vec<_> = m.readings.iter().filter(|r| r.wi.z > 0.9999 && r.wo.z < 0.9999).collect();
            let sum = |of: &dyn Fn(&Reading) -> f32| upright.iter().map(|r| r.weight * of(r)).sum::<f32>();
            let albedo = PI * sum(&|r| r.f.x * r.wo.z) / sum(&|r| r.wo.z);
            assert!((albedo - 0.5).abs() < 1e-3, "{} azimuths: {albedo}", azimuths.len());
        }
        assert_eq!(shares(&[0.0, 90.0, 180.0]), [0.25, 0.5, 0.25]);
        assert_eq!(shares(&[0.0, 90.0, 180.0, 270.0]), [0.25; 4]);
        assert_eq!(shares(&[0.0]), [1.0]);
        let uneven = shares(&[0.0, 10.0, 40.0, 180.0]);
        assert!(
            (uneven.iter().sum::<f32>() - 1.0).abs() < 1e-6 && uneven[0] < uneven[1] && uneven[1] < uneven[2]
        );
    }

    #[test]
    fn colours_have_three_blocks() {
        let head = "Symmetry ASymmetrical\nSpectralContent XYZ\nScatterType BRDF\nAngleOfIncidence 1\n30\nScatterAzimuth 1\n0\n\
            ScatterRadial 1\n0\n";
        let block = |c: char, v: f32| format!("Tristimulus{c}\nDataBegin\nTIS 0\n{v}\nDataEnd\n");
        let text = head.to_string() + &block('X', 0.25) + &block('Y', 0.25) + &block('Z', 0.25);
        assert!((of(&text).unwrap().readings[0].f - 0.25).abs().max_element() < 1e-5);
        let error = of(&(head.to_string() + &block('X', 0.25))).unwrap_err();
        assert!(error.contains("not all of TristimulusX, Y and Z"), "{error}");
    }

    #[test]
    fn bad_files_get_a_sentence() {
        let good = "ScatterType BRDF\nSampleRotation 1\n0\nAngleOfIncidence 2\n0 30\nScatterAzimuth 2\n0 180\nScatterRadial 2\n0 9\n\
            Monochrome\nDataBegin\nTIS .1\n1 2\n3 4\nTIS .1\n5 6 7 8\nDataEnd\n";
        assert_eq!(of(good).unwrap().readings.len(), 6);
        for (from, to, want) in [
            ("BRDF", "BTDF", "a.bsdf:1:1: 'ScatterType BTDF' is not read: tables of readings reflect"),
            ("ScatterType", "Scatter", "a.bsdf:1:1: 'Scatter BRDF' is not known; expected Source"),
            ("Incidence 2", "Incidence x", "a.bsdf:4:1: 'AngleOfIncidence' needs the count"),
            ("Incidence 2", "Incidence 1", "a.bsdf:4:1: 'AngleOfIncidence' has 2 angles; its count is 1"),
            (
                "0 30",
                "0 95",
                "a.bsdf:4:1: the angles of 'AngleOfIncidence' must rise and lie between 0 and 90",
            ),
            ("ScatterRadial 2\n0 9\n", "", "a.bsdf: has no 'ScatterRadial' before its data"),
            ("DataBegin\n", "", "a.bsdf:10:1: expected 'DataBegin' behind 'Monochrome'"),
            ("3 4\n", "3\n", "a.bsdf:15:1: the readings before end within an incidence; each has 4"),
            ("7 8", "7", "a.bsdf:17:1: the block has 7 readings; its angles make 8"),
            ("7 8", "7 8 9", "a.bsdf:16:1: has more than the 8 readings"),
            ("7 8", "7 x", "a.bsdf:16:1: 'x' is not a finite number"),
            ("Monochrome\n", "", "a.bsdf:10:1: 'DataBegin' is not known"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = of(&good.replacen(from, to, 1)).unwrap_err();
            assert!(error.starts_with(want), "{error}");
        }
    }
}
