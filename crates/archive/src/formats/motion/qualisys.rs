//! TSV of Qualisys Track Manager: `NO_OF_FRAMES` and more lines of header, then a row of tabs a frame: markers
//! (`DATA_INCLUDED 3D`) or rigid bodies (`6D`: position, three angles, residual, matrix).
//!
//! Lengths are millimetres; z is up unless the volume was set up otherwise. What was not seen is all zero or has empty
//! cells. Rotations are taken from the matrix, whose nine numbers stand column after column: the angles mean what a
//! setting of the program says, which the file does not hold.

use super::sheet::{Frames, Sheet, first_line, timed, tracks, vector};
use super::{Basis, Conventions, Motion, Options, rate, up};
use crate::formats::numbers::text;
use crate::formats::support::{Feature, find};
use crate::{Error, Place};
use glam::{DMat3, DQuat};
use std::path::Path;
use yugen_motion::{RigidPose, Take};

/// Lines of the header.
pub const FEATURES: &[Feature] = &[
    Feature::yes("NO_OF_FRAMES"),
    Feature::yes("NO_OF_MARKERS"),
    Feature::yes("NO_OF_BODIES"),
    Feature::yes("FREQUENCY"),
    Feature::partly("DATA_INCLUDED", "3D and 6D; no 2D"),
    Feature::yes("MARKER_NAMES"),
    Feature::yes("BODY_NAMES"),
    Feature::no("FILE_VERSION", "all versions are read alike"),
    Feature::no("NO_OF_CAMERAS", "cameras are not motion"),
    Feature::no("NO_OF_ANALOG", "signals are not motion"),
    Feature::no("ANALOG_FREQUENCY", "signals are not motion"),
    Feature::no("DESCRIPTION", "for people"),
    Feature::no("TIME_STAMP", "for people"),
    Feature::no("EVENT", "events name moments only"),
    Feature::no("TRAJECTORY_TYPES", "whether a gap was filled"),
];

/// Whether these are the bytes of such a file.
pub fn recognises(bytes: &[u8]) -> bool {
    let bytes = text(bytes);
    let head = first_line(&bytes);
    head.starts_with(b"NO_OF_FRAMES\t") || head.starts_with(b"FILE_VERSION\t")
}

/// Numbers of a body: position, angles, residual, matrix.
const BODY: usize = 16;

/// Reads markers or bodies.
///
/// # Errors
/// With the line: header lines that nobody knows, counts that are wrong, cells that are no numbers.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    let mut sheet = Sheet::new(&bytes, path, b'\t');
    let (mut announced, mut stated, mut counts) = (None, None, [None; 2]);
    let mut names: [Option<(usize, Vec<String>)>; 2] = [None, None];
    let mut six = false;
    loop {
        sheet.need("the first frame")?;
        let key = sheet.row.text(0);
        // Data, or the names of columns above it.
        if sheet.row.bytes(0).first().is_none_or(|b| !b.is_ascii_uppercase()) || key == "Frame" {
            break;
        }
        if key == "X" || find(FEATURES, &key).is_none() && key.ends_with(" X") {
            break;
        }
        if find(FEATURES, &key).is_none() {
            let known = FEATURES.iter().map(|f| f.name);
            let short: String = key.chars().take(40).collect();
            return Err(Error::unknown(
                Place::line(path, sheet.row.line, 1),
                "line of the header",
                &short,
                known,
            ));
        }
        let count = |sheet: &Sheet| match sheet.number(1)? {
            Some(n) if n >= 0.0 && n.fract() == 0.0 => Ok(Some(n as usize)),
            _ => Err(sheet.invalid(format!("expected a whole number behind {key}"))),
        };
        match key.as_str() {
            "NO_OF_FRAMES" => announced = count(&sheet)?,
            "NO_OF_MARKERS" => counts[0] = count(&sheet)?,
            "NO_OF_BODIES" => counts[1] = count(&sheet)?,
            "FREQUENCY" => stated = sheet.row.text(1).replace(',', ".").parse().ok(),
            "DATA_INCLUDED" => match sheet.row.text(1).as_str() {
                "3D" => six = false,
                "6D" => six = true,
                other => {
                    let short: String = other.chars().take(40).collect();
                    return Err(sheet.invalid(format!("the data are '{short}'; expected 3D or 6D")));
                }
            },
            "MARKER_NAMES" | "BODY_NAMES" => {
                let body = usize::from(key == "BODY_NAMES");
                names[body] = Some((sheet.row.line, sheet.row.texts().split_off(1)));
            }
            _ => {}
        }
    }
    let rate = rate(options, stated, || Place::line(path, 1, 1))?;
    let (which, key) = if six { (1, "BODY_NAMES") } else { (0, "MARKER_NAMES") };
    let Some((line, names)) = names[which].take() else {
        return Err(Error::invalid(Place::line(path, 1, 1), format!("the header has no line {key}")));
    };
    if let Some(n) = counts[which].filter(|n| *n != names.len()) {
        let problem = format!("{n} are announced, but {} have names", names.len());
        return Err(Error::invalid(Place::line(path, line, 1), problem));
    }
    let mut take = Take::default();
    if six {
        take.bodies = tracks(names.clone())
    } else {
        take.markers = tracks(names.clone())
    }
    let each = if six { BODY } else { 3 };

    // Frame and time stand in front where the row above says so, or where there are two numbers more.
    let mut lead = 0;
    if sheet.number(0).is_err() || sheet.row.bytes(0).is_empty() {
        let head = sheet.row.texts();
        lead = head.iter().position(|c| c == "X" || c.ends_with(" X")).unwrap_or(0);
        lead = lead.min(head.iter().take_while(|c| matches!(c.as_str(), "Frame" | "Time")).count());
        sheet.need("the first frame")?;
    } else if sheet.row.len() == each * names.len() + 2 {
        lead = 2;
    }
    let mut counted = Frames::default();
    let mut start = 0.0;
    loop {
        if lead > 0 {
            counted.follow(&sheet)?;
            if counted.count == 1 && lead == 2 {
                start = sheet.number(1)?.unwrap_or(0.0);
            }
        } else {
            counted.count += 1;
        }
        if sheet.row.len() > lead + each * names.len() {
            // Between bodies and at the end of rows there may be empty columns.
            let problem =
                format!("{} columns where {} are expected", sheet.row.len(), lead + each * names.len());
            return Err(sheet.invalid(problem));
        }
        for (i, track) in take.markers.tracks.iter_mut().enumerate() {
            let point = sheet.numbers::<3>(lead + each * i, &track.name)?;
            track.samples.push(point.filter(|p| *p != [0.0; 3]).map(vector));
        }
        for (i, track) in take.bodies.tracks.iter_mut().enumerate() {
            let numbers = sheet.numbers::<BODY>(lead + each * i, &track.name)?;
            let numbers = numbers.filter(|n| n[7..] != [0.0; 9]);
            let pose = match numbers {
                None => None,
                Some(n) => Some(RigidPose {
                    position: vector([n[0], n[1], n[2]]),
                    rotation: rotation(&n[7..]).ok_or_else(|| {
                        sheet.invalid(format!("the matrix of '{}' is no rotation", track.name))
                    })?,
                }),
            };
            track.samples.push(pose);
            track.residuals.push(numbers.map_or(0.0, |n| n[6] as f32));
        }
        if !sheet.advance()? {
            break;
        }
    }
    counted.check(&sheet, announced)?;
    timed(&mut take.markers, counted.count, rate, start);
    timed(&mut take.bodies, counted.count, rate, start);
    Ok((Motion::Captured(take), Conventions { unit: Some(0.001), axes: up('z').map(|a| (a, Basis::Usual)) }))
}

/// Of nine numbers, column after column.
fn rotation(columns: &[f64]) -> Option<glam::Quat> {
    let m = DMat3::from_cols_slice(columns);
    let off = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
    let fits = off.iter().all(|v| v.abs() < 0.01) && m.determinant() > 0.0;
    fits.then(|| DQuat::from_mat3(&m).normalize().as_quat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    const BODIES: &str = "NO_OF_FRAMES\t2\nNO_OF_CAMERAS\t8\nNO_OF_BODIES\t2\nFREQUENCY\t100\nNO_OF_ANALOG\t0\nANALOG_FREQUENCY\t0\n\
        DESCRIPTION\t--\nTIME_STAMP\t2020-01-01\nDATA_INCLUDED\t6D\nBODY_NAMES\thead\tfan\n\
        Frame\tTime\tX\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]\tX\n\
        1\t0.00\t1\t2\t3\t0\t0\t90\t0.25\t0\t1\t0\t-1\t0\t0\t0\t0\t1\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\t0\n\
        2\t0.01\t4\t5\t6\t0\t0\t0\t0.5\t1\t0\t0\t0\t1\t0\t0\t0\t1\t7\t8\t9\t0\t0\t0\t1\t1\t0\t0\t0\t1\t0\t0\t0\t1\n";
    const MARKERS: &str = "NO_OF_FRAMES\t2\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES\ttoe\theel\n\
        1.5\t2\t3\t4\t5\t6\n0.000\t0.000\t0.000\t7\t8\t9\n";

    fn told(text: &str) -> Result<Take, String> {
        assert!(recognises(text.as_bytes()));
        match read(text.as_bytes(), Path::new("a.tsv"), &Options::default()) {
            Ok((Motion::Captured(take), _)) => Ok(take),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn matrices_stand_column_after_column_and_zeros_are_gaps() {
        let take = told(BODIES).unwrap();
        assert_eq!((take.bodies.rate, take.bodies.frames), (100.0, 2));
        let head = take.bodies.find("head").unwrap().samples[0].unwrap();
        assert!(head.rotation.abs_diff_eq(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2), 1e-6));
        assert_eq!(take.bodies.tracks[0].residuals, [0.25, 0.5]);
        assert_eq!(take.bodies.find("fan").unwrap().gaps(), [[0, 1]]);
        let take = told(MARKERS).unwrap();
        assert_eq!(take.markers.find("toe").unwrap().samples, [Some(Vec3::new(1.5, 2.0, 3.0)), None]);
        assert_eq!(take.markers.find("heel").unwrap().samples[1], Some(Vec3::new(7.0, 8.0, 9.0)));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let changed = |from: &str, to: &str| {
            assert!(BODIES.contains(from), "{from}");
            told(&BODIES.replace(from, to)).unwrap_err()
        };
        assert!(changed("\t-1\t", "\t-2\t").contains("a.tsv:12:1: the matrix of 'head' is no rotation"));
        assert!(changed("FRAMES\t2", "FRAMES\t3").contains("3 frames are announced, but there are 2"));
        assert!(changed("BODIES\t2", "BODIES\t19").contains("19 are announced, but 2 have names"));
        assert!(changed("FREQUENCY\t100", "FREQUENCY\tEXT").contains("--rate"));
        assert!(changed("\t6D\n", "\t2D\n").contains("expected 3D or 6D"));
        assert!(changed("DESCRIPTION", "DESCRIPTIONS").contains("unknown line of the header"));
        assert!(changed("\t-1\t", "\tnan\t").contains("of the 16 numbers of 'head'"));
    }
}
