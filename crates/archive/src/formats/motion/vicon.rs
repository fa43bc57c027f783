//! CSV of Vicon Nexus and Tracker: sections such as `Trajectories` and `Segments`, each with its rate, names, columns and
//! units, and an empty line behind it.
//!
//! What was not seen has empty cells. z is up, unless the volume was set up otherwise. Bodies turn by quaternions
//! (`RX RY RZ RW`) or by three angles, of which the file does not say whether they are an axis with its angle or turns one
//! after the other: that is asked for.

use super::sheet::{Frames, Sheet, delimiter, first_line, pose, quaternion, timed, tracks, vector};
use super::{Basis, Conventions, Motion, Options, rate, unit, up};
use crate::formats::numbers::text;
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place};
use std::path::Path;
use yugen_motion::Take;

/// Sections.
pub const FEATURES: &[Feature] = &[
    Feature::yes("Trajectories"),
    Feature::yes("Segments"),
    Feature::yes("Objects"),
    Feature::no("Joints", "angles between segments; the segments say where they are"),
    Feature::no("Model Outputs", "derived quantities"),
    Feature::no("Devices", "signals are not motion"),
    Feature::no("Events", "they name moments only"),
];

/// Whether these are the bytes of such a file.
pub fn recognises(bytes: &[u8]) -> bool {
    let bytes = text(bytes);
    let head = first_line(&bytes);
    let word = head.split(|b| matches!(b, b',' | b';' | b'\t')).next().unwrap_or_default().trim_ascii();
    FEATURES.iter().any(|f| f.name.as_bytes() == word)
}

/// Reads markers and bodies.
///
/// # Errors
/// With the line: sections that nobody knows, cells that are no numbers, angles whose meaning nobody said.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    // The names are the first that has several cells.
    let head = bytes.split(|&b| b == b'\n').find(|l| l.iter().any(|b| matches!(b, b',' | b';' | b'\t')));
    let mut sheet = Sheet::new(&bytes, path, delimiter(head.unwrap_or_default()));
    let (mut take, mut metres) = (Take::default(), None);
    let mut more = sheet.advance()?;
    while more {
        let name = sheet.row.text(0);
        let Some(feature) = find(FEATURES, &name) else {
            let known = FEATURES.iter().map(|f| f.name);
            let short: String = name.chars().take(40).collect();
            return Err(Error::unknown(Place::line(path, sheet.row.line, 1), "section", &short, known));
        };
        let bodies = match (feature.support, name.as_str()) {
            (Support::No(_), _) => {
                more = skip(&mut sheet)?;
                continue;
            }
            (_, name) => name != "Trajectories",
        };
        if (bodies && !take.bodies.tracks.is_empty()) || (!bodies && !take.markers.tracks.is_empty()) {
            return Err(sheet.invalid(format!("a second section of the kind of {name}; split the file")));
        }
        sheet.need("the rate of the section")?;
        let line = sheet.row.line;
        let stated = sheet.number(0)?;
        let rate = rate(options, stated, || Place::line(path, line, 1))?;
        sheet.need("the names")?;
        let names = sheet.row.texts();
        sheet.need("the row that begins with Frame")?;
        let columns = sheet.row.texts();
        if columns.first().is_none_or(|c| c != "Frame") {
            return Err(sheet.invalid("expected the row that begins with Frame, below the names"));
        }
        sheet.need("the units")?;
        let units = sheet.row.texts();
        let stated = |word: &String| unit(word).map(|u| (word.clone(), u));
        for (word, found) in units.iter().filter_map(stated) {
            if metres.replace(found).is_some_and(|m| m != found) {
                return Err(
                    sheet.invalid(format!("lengths are in {word} here and in another unit elsewhere"))
                );
            }
        }
        let radians = units.iter().any(|u| u == "rad");
        let spread: Vec<(usize, String)> = names
            .iter()
            .enumerate()
            .skip(2)
            .filter(|(_, n)| !n.is_empty())
            .map(|(c, n)| (c, n.clone()))
            .collect();
        if spread.is_empty() {
            return Err(sheet.invalid("nothing in this section has a name"));
        }
        let mut counted = Frames::default();
        let frame = |first: f64| (first - 1.0) / rate;
        let mut start = 0.0;
        let quaternions = columns.iter().any(|c| c == "RW");
        let each = if !bodies {
            3
        } else if quaternions {
            7
        } else {
            6
        };
        let order: &[&str] = match each {
            3 => &["X", "Y", "Z"],
            6 => &["RX", "RY", "RZ", "TX", "TY", "TZ"],
            _ => &["RX", "RY", "RZ", "RW", "TX", "TY", "TZ"],
        };
        for (c, name) in &spread {
            let got: Vec<&str> = columns.iter().skip(*c).take(each).map(String::as_str).collect();
            if got != order {
                let problem = format!(
                    "below '{name}' expected the columns {}, found {}",
                    order.join(" "),
                    got.join(" ")
                );
                return Err(Error::invalid(Place::line(path, line, 1), problem));
            }
        }
        let angles = match (bodies && !quaternions, options.angles) {
            (true, None) => {
                let problem = "the file does not say what the three angles of a body are: give --angles helical, or their order as in --angles xyz";
                return Err(Error::invalid(Place::line(path, line, 1), problem));
            }
            (_, angles) => angles,
        };
        let list = || spread.iter().map(|(_, n)| n.clone());
        if bodies {
            take.bodies = tracks(list())
        } else {
            take.markers = tracks(list())
        }
        loop {
            more = sheet.advance()?;
            // The next section begins with a word.
            if !more || sheet.row.bytes(0).first().is_some_and(u8::is_ascii_alphabetic) {
                break;
            }
            counted.follow(&sheet)?;
            if counted.count == 1 {
                start = sheet.number(0)?.map_or(0.0, frame);
            }
            for (track, (c, name)) in take.markers.tracks.iter_mut().zip(&spread).filter(|_| !bodies) {
                track.samples.push(sheet.point(*c, name)?);
            }
            for (track, (c, name)) in take.bodies.tracks.iter_mut().zip(&spread).filter(|_| bodies) {
                let rotation = if quaternions {
                    let numbers = sheet.numbers(*c, name)?;
                    let turned = |q| {
                        let problem = format!("the rotation of '{name}' is no unit quaternion: {q:?}");
                        quaternion(q).ok_or_else(|| sheet.invalid(problem))
                    };
                    numbers.map(turned).transpose()?
                } else {
                    let unit = if radians { 1.0 } else { std::f32::consts::PI / 180.0 };
                    let numbers = sheet.numbers(*c, name)?.map(|v| vector(v) * unit);
                    numbers.zip(angles).map(|(v, angles)| angles.rotation(v))
                };
                let place = sheet.point(*c + each - 3, name)?;
                track.samples.push(pose(&sheet, name, place, rotation)?);
            }
        }
        counted.check(&sheet, None)?;
        if bodies {
            timed(&mut take.bodies, counted.count, rate, start);
        } else {
            timed(&mut take.markers, counted.count, rate, start);
        }
    }
    if take.frames() == 0 {
        return Err(Error::invalid(
            Place::file(path),
            "there are neither Trajectories nor Segments in this file",
        ));
    }
    Ok((Motion::Captured(take), Conventions { unit: metres, axes: up('z').map(|a| (a, Basis::Usual)) }))
}

/// Goes to the next section; false where there is none.
fn skip(sheet: &mut Sheet) -> Result<bool, Error> {
    while sheet.advance()? {
        if find(FEATURES, &sheet.row.text(0)).is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::motion::Angles;
    use glam::{Quat, Vec3};

    const SMALL: &str = "Devices\n1000\n,,Force\nFrame,Sub Frame,Fx\n,,N\n1,0,5\n\nSegments\n120\n,,actor:head,,,,,\n\
        Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n5,0,0,90,0,1,2,3\n6,0,,,,,,\n\nTrajectories\n240\n,,actor:toe,,,heel,,\n\
        Frame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n10,0,1,2,3,4,5,6\n11,0,,,,7,8,9\n12,0,1,1,1\n";

    fn told(text: &str, angles: Option<Angles>) -> Result<(Take, Conventions), String> {
        assert!(recognises(text.as_bytes()));
        let options = Options { angles, ..Options::default() };
        match read(text.as_bytes(), Path::new("a.csv"), &options) {
            Ok((Motion::Captured(take), said)) => Ok((take, said)),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn sections_have_rates_of_their_own() {
        let (take, said) = told(SMALL, Some(Angles::Helical)).unwrap();
        assert_eq!(said.unit, Some(0.001));
        assert_eq!((take.bodies.rate, take.bodies.frames), (120.0, 2));
        assert_eq!((take.markers.rate, take.markers.frames), (240.0, 3));
        let pose = take.bodies.find("actor:head").unwrap().samples[0].unwrap();
        assert!(pose.rotation.abs_diff_eq(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2), 1e-6));
        assert_eq!(pose.position, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(take.bodies.tracks[0].samples[1], None);
        assert_eq!(take.markers.find("heel").unwrap().missing(), 1, "cells that are cut off are empty");
        // As the German version writes it.
        let semicolons = SMALL.replace(',', ";").replace(";1;2;3", ";1,0;2,0;3,0");
        assert_eq!(told(&semicolons, Some(Angles::Helical)).unwrap().0, take);
    }

    #[test]
    fn what_is_wrong_or_unsaid_is_told() {
        assert!(told(SMALL, None).unwrap_err().contains("give --angles helical"));
        let changed = |from: &str, to: &str| {
            assert!(SMALL.contains(from), "{from}");
            told(&SMALL.replace(from, to), Some(Angles::Helical)).unwrap_err()
        };
        assert!(changed("Trajectories", "Trajektories").contains("unknown section 'Trajektories'"));
        assert!(changed("TX,TY,TZ", "TX,TZ,TY").contains("expected the columns RX RY RZ TX TY TZ"));
        assert!(changed("11,0", "17,0").contains("frame 17 follows frame 10"));
        assert!(changed("\n240\n", "\n0\n").contains("--rate"));
        assert!(changed("mm,mm,mm,mm,mm,mm", "m,m,m,m,m,m").contains("another unit elsewhere"));
    }
}
