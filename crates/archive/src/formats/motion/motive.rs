//! CSV of OptiTrack Motive: markers, rigid bodies and bones with quaternions or angles, under five rows of header.
//!
//! The first row says rates, rotation type and unit. Then come the types of the columns, their names and IDs, what they
//! hold, and `Frame,Time (Seconds),X,…`. What was not seen has empty cells. y is up unless the export turned the axes.

use super::sheet::{Frames, Sheet, first_line, pose, quaternion, timed, tracks, vector};
use super::{Angles, Basis, Conventions, Motion, Options, rate, unit, up};
use crate::formats::numbers::text;
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place};
use std::path::Path;
use yugen_motion::Take;

/// Types of columns.
pub const FEATURES: &[Feature] = &[
    Feature::yes("Rigid Body"),
    Feature::partly("Bone", "in coordinates of the world only, as a rigid body"),
    Feature::yes("Marker"),
    Feature::no("Rigid Body Marker", "they are where their body says"),
    Feature::no("Bone Marker", "they are where their bone says"),
    Feature::no("Force Plate", "forces are not motion"),
    Feature::no("Device", "signals are not motion"),
];

/// Whether these are the bytes of such a file.
pub fn recognises(bytes: &[u8]) -> bool {
    first_line(&text(bytes)).starts_with(b"Format Version")
}

/// A column of the data: whose, and what.
enum Column {
    Marker { track: usize, axis: usize },
    Position { track: usize, axis: usize },
    Rotation { track: usize, part: usize },
    Residual { track: usize },
}

/// Reads markers and bodies.
///
/// # Errors
/// With the line: a header that lacks a row, cells that are no numbers, rotations that are none.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    let mut sheet = Sheet::new(&bytes, path, b',');
    sheet.need("Format Version")?;
    let head = sheet.row.texts();
    let line = sheet.row.line;
    let field = |name: &str| {
        let at = head.iter().step_by(2).position(|k| k == name)?;
        head.get(2 * at + 1).filter(|v| !v.is_empty())
    };
    let number = |name: &str| field(name).and_then(|v| v.parse::<f64>().ok());
    let rate = rate(options, number("Export Frame Rate").or(number("Capture Frame Rate")), || {
        Place::line(path, line, 1)
    })?;
    let frames = number("Total Exported Frames").map(|n| n as usize);
    let unit = match field("Length Units") {
        None => None,
        Some(word) => Some(unit(word).ok_or_else(|| {
            let known = super::UNITS.iter().map(|(name, _)| *name);
            Error::unknown(Place::line(path, line, 1), "unit", word, known)
        })?),
    };
    let turning = match field("Rotation Type").map(|t| t.to_lowercase()) {
        None => Turning::Quaternion,
        Some(t) if t == "quaternion" => Turning::Quaternion,
        Some(t) => match Angles::from_name(&t).filter(|a| *a != Angles::Helical) {
            Some(angles) => Turning::Angles(angles),
            None => {
                let known = ["Quaternion", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"];
                return Err(Error::unknown(Place::line(path, line, 1), "rotation type", &t, known));
            }
        },
    };
    let local = field("Coordinate Space").is_some_and(|s| s.eq_ignore_ascii_case("local"));

    // Rows are told by what is in them: versions differ in how many there are.
    let (mut types, mut names, mut held) = (Vec::new(), Vec::new(), Vec::new());
    loop {
        sheet.need("the row that begins with Frame")?;
        let row = sheet.row.texts();
        if row.first().is_some_and(|c| c == "Frame") {
            break;
        }
        let cells = || row.iter().skip(2);
        if types.is_empty() && cells().any(|c| find(FEATURES, c).is_some()) {
            types = row;
        } else if cells().any(|c| c == "Position") {
            held = row;
        } else if names.is_empty() {
            names = row;
        }
    }
    if types.is_empty() || names.is_empty() || held.is_empty() {
        let problem = "above the row that begins with Frame the types of columns, their names and what they hold are expected";
        return Err(sheet.invalid(problem));
    }
    let axes = sheet.row.texts();
    let mut take = Take { markers: tracks([]), bodies: tracks([]) };
    let mut columns: Vec<(usize, Column)> = Vec::new();
    let mut left_out = 0;
    for c in 2..axes.len() {
        let cell = |row: &[String]| row.get(c).cloned().unwrap_or_default();
        let (kind, name, what, axis) = (cell(&types), cell(&names), cell(&held), cell(&axes));
        if kind.is_empty() {
            continue;
        }
        let Some(feature) = find(FEATURES, &kind) else {
            let known = FEATURES.iter().map(|f| f.name);
            return Err(Error::unknown(Place::line(path, line, 1), "type of column", &kind, known));
        };
        if matches!(feature.support, Support::No(_)) {
            left_out += 1;
            continue;
        }
        if local && kind == "Bone" {
            return Err(
                sheet.invalid("bones are in coordinates of their parents; export them in Global space")
            );
        }
        let part = "XYZW".find(axis.as_str()).filter(|_| axis.len() == 1);
        let track = |all: &mut Vec<yugen_motion::Track<_>>| track_of(all, &name);
        let column = match (kind == "Marker", what.as_str(), part) {
            (true, "Position", Some(axis @ 0..3)) => {
                Column::Marker { track: track_of(&mut take.markers.tracks, &name), axis }
            }
            (false, "Position", Some(axis @ 0..3)) => {
                Column::Position { track: track(&mut take.bodies.tracks), axis }
            }
            (false, "Rotation", Some(part)) => {
                Column::Rotation { track: track(&mut take.bodies.tracks), part }
            }
            (false, "Mean Marker Error" | "Error Per Marker", None) => {
                Column::Residual { track: track(&mut take.bodies.tracks) }
            }
            _ => {
                left_out += 1;
                continue;
            }
        };
        columns.push((c, column));
    }
    if take.markers.tracks.is_empty() && take.bodies.tracks.is_empty() {
        return Err(sheet.invalid("there is neither a marker nor a rigid body in this file"));
    }
    tracing::debug!("{}: {left_out} columns are left out", path.display());

    let mut counted = Frames::default();
    let mut start = 0.0;
    let mut points = vec![[None; 3]; take.markers.tracks.len()];
    let mut poses = vec![([None; 3], [None; 4], None); take.bodies.tracks.len()];
    while sheet.advance()? {
        counted.follow(&sheet)?;
        if counted.count == 1 {
            start = sheet.number(1)?.unwrap_or(0.0);
        }
        for (c, column) in &columns {
            let value = sheet.number(*c)?;
            match *column {
                Column::Marker { track, axis } => points[track][axis] = value,
                Column::Position { track, axis } => poses[track].0[axis] = value,
                Column::Rotation { track, part } => poses[track].1[part] = value,
                Column::Residual { track } => poses[track].2 = value,
            }
        }
        for (track, point) in take.markers.tracks.iter_mut().zip(&points) {
            let point = all(*point).map_err(|()| partly(&sheet, &track.name))?;
            track.samples.push(point.map(vector));
        }
        for (track, (position, rotation, residual)) in take.bodies.tracks.iter_mut().zip(&poses) {
            let partly = |()| partly(&sheet, &track.name);
            let position = all(*position).map_err(partly)?.map(vector);
            let rotation = match turning {
                Turning::Quaternion => match all(*rotation).map_err(partly)? {
                    None => None,
                    Some(q) => Some(quaternion(q).ok_or_else(|| {
                        sheet
                            .invalid(format!("the rotation of '{}' is no unit quaternion: {q:?}", track.name))
                    })?),
                },
                Turning::Angles(angles) => {
                    let [x, y, z, _] = *rotation;
                    let degrees = all([x, y, z]).map_err(partly)?.map(vector);
                    degrees.map(|d| angles.rotation(d.map(f32::to_radians)))
                }
            };
            track.samples.push(pose(&sheet, &track.name, position, rotation)?);
            track.residuals.push(residual.unwrap_or(0.0) as f32);
        }
    }
    counted.check(&sheet, frames)?;
    for body in &mut take.bodies.tracks {
        if body.residuals.iter().all(|r| *r == 0.0) {
            body.residuals.clear();
        }
    }
    timed(&mut take.markers, counted.count, rate, start);
    timed(&mut take.bodies, counted.count, rate, start);
    Ok((Motion::Captured(take), Conventions { unit, axes: up('y').map(|a| (a, Basis::Usual)) }))
}

#[derive(Clone, Copy)]
enum Turning {
    Quaternion,
    Angles(Angles),
}

/// The track of a name, made where there is none.
fn track_of<T>(all: &mut Vec<yugen_motion::Track<T>>, name: &str) -> usize {
    all.iter().position(|t| t.name == name).unwrap_or_else(|| {
        all.push(yugen_motion::Track::new(name));
        all.len() - 1
    })
}

/// All of them, or none; an error where some are missing.
fn all<const N: usize>(values: [Option<f64>; N]) -> Result<Option<[f64; N]>, ()> {
    match values.iter().flatten().count() {
        0 => Ok(None),
        n if n == N => Ok(Some(values.map(Option::unwrap_or_default))),
        _ => Err(()),
    }
}

fn partly(sheet: &Sheet, name: &str) -> Error {
    sheet.invalid(format!("of '{name}' some numbers are there and some are not; give all or none"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    const SMALL: &str = "Format Version,1.23,Take Name,a b,Capture Frame Rate,240.000000,Export Frame Rate,120.000000,Total Exported Frames,2,\
        Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\r\n\r\n\
        ,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body Marker,Marker,Marker,Marker\r\n\
        ,,head,head,head,head,head,head,head,head,head:1,toe,toe,toe\r\n,,ID1,ID1,ID1,ID1,ID1,ID1,ID1,ID1,ID2,ID3,ID3,ID3\r\n\
        ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,Position,Position,Position,Position\r\n\
        Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,X,Y,Z\r\n\
        0,0.000000,0.6,0,0,0.8,100,200,300,0.5,9,1,2,3\r\n1,0.008333,,,,,,,,,,4,5,6\r\n";

    fn told(text: &str) -> Result<(Take, Conventions), String> {
        assert!(recognises(text.as_bytes()));
        match read(text.as_bytes(), Path::new("a.csv"), &Options::default()) {
            Ok((Motion::Captured(take), said)) => Ok((take, said)),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn quaternions_stand_as_x_y_z_w() {
        let (take, said) = told(SMALL).unwrap();
        assert_eq!((take.bodies.rate, take.bodies.frames, said.unit), (120.0, 2, Some(0.001)));
        let head = take.bodies.find("head").unwrap();
        let pose = head.samples[0].unwrap();
        assert_eq!(pose.position, Vec3::new(100.0, 200.0, 300.0));
        assert!(pose.rotation.abs_diff_eq(Quat::from_xyzw(0.6, 0.0, 0.0, 0.8), 1e-6));
        assert_eq!((head.samples[1], head.residuals.as_slice()), (None, &[0.5, 0.0][..]));
        assert_eq!(take.markers.tracks.len(), 1, "markers of bodies are left out");
        assert_eq!(take.markers.tracks[0].samples[1], Some(Vec3::new(4.0, 5.0, 6.0)));
    }

    #[test]
    fn angles_turn_as_the_header_says() {
        let text = SMALL.replace("Quaternion", "ZYX").replace("0.6,0,0,0.8", "10,20,30,");
        let (take, _) = told(&text).unwrap();
        let got = take.bodies.tracks[0].samples[0].unwrap().rotation;
        let about = |axis: Vec3, degrees: f32| Quat::from_axis_angle(axis, degrees.to_radians());
        let want = about(Vec3::Z, 30.0) * about(Vec3::Y, 20.0) * about(Vec3::X, 10.0);
        assert!(got.abs_diff_eq(want, 1e-6), "{got} {want}");
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let changed = |from: &str, to: &str| {
            assert!(SMALL.contains(from), "{from}");
            told(&SMALL.replace(from, to)).unwrap_err()
        };
        assert!(
            changed("0.6,0,0,0.8", "0.6,0,0,3")
                .contains("a.csv:8:1: the rotation of 'head' is no unit quaternion")
        );
        assert!(
            changed("0.6,0,0,0.8", "0.6,,0,0.8")
                .contains("of 'head' some numbers are there and some are not")
        );
        assert!(changed("0.6,0,0,0.8", ",,,").contains("the body 'head' has a position but no rotation"));
        assert!(changed("Millimeters", "Furlongs").contains("unknown unit 'Furlongs'"));
        assert!(changed("Quaternion", "Axis").contains("unknown rotation type 'axis'"));
        assert!(changed("Frames,2", "Frames,5").contains("5 frames are announced, but there are 2"));
        assert!(
            changed("Rate,240.000000,Export Frame Rate,120.000000", "Rate,,Export Frame Rate,")
                .contains("--rate")
        );
        assert!(changed("Frame,Time", "Fram,Time").contains("Frame"));
    }
}
