//! The CSV that Yugen writes of a take: a row for each marker and body of each frame.
//!
//! ```text
//! # metres, y up, right-handed; an empty place was not seen
//! seconds,kind,name,x,y,z,qx,qy,qz,qw,residual
//! 0,marker,toe,0.1,0.02,1.5,,,,,0.0004
//! 0,body,head,0.1,1.6,1.4,0,0.7071068,0,0.7071068,
//! ```
//! Every track has a row for each of its frames, gaps included. Markers and bodies may have rates of their own.

use super::sheet::{quaternion, vector};
use super::{Basis, Conventions, Motion, Options, rate, up};
use crate::formats::csv::Table;
use crate::formats::numbers::text;
use crate::{Error, Place};
use glam::{Quat, Vec3};
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;
use yugen_motion::{RigidPose, Take, Track, Tracks};

const COLUMNS: [&str; 11] = ["seconds", "kind", "name", "x", "y", "z", "qx", "qy", "qz", "qw", "residual"];

/// Whether these are the bytes of such a file.
pub fn recognises(bytes: &[u8]) -> bool {
    let bytes = text(bytes);
    let head = bytes.split(|&b| b == b'\n').find(|l| !l.trim_ascii().is_empty() && !l.starts_with(b"#"));
    let names = String::from_utf8_lossy(head.unwrap_or_default());
    ["seconds", "kind", "name"].iter().all(|n| names.split([',', ';', '\t']).any(|c| c.trim() == *n))
}

/// Tracks that grow row by row, and the times of the first of them.
struct Growing<T> {
    all: Vec<Track<T>>,
    places: HashMap<String, usize>,
    times: Vec<f64>,
}

impl<T> Growing<T> {
    fn new() -> Self {
        Self { all: Vec::new(), places: HashMap::new(), times: Vec::new() }
    }

    fn push(&mut self, name: &str, seconds: f64, sample: Option<T>, residual: f32) -> Result<(), String> {
        let at = *self.places.entry(name.to_string()).or_insert_with(|| {
            self.all.push(Track::new(name));
            self.all.len() - 1
        });
        let frame = self.all[at].samples.len();
        match self.times.get(frame) {
            None if at == 0 => self.times.push(seconds),
            Some(time) if (time - seconds).abs() <= 1e-6 * (1.0 + time.abs()) => {}
            Some(time) => {
                return Err(format!("'{name}' is at {seconds} s, where the others are at {time} s"));
            }
            None => {
                return Err(format!("'{name}' is at {seconds} s, where '{}' is not yet", self.all[0].name));
            }
        }
        self.all[at].samples.push(sample);
        self.all[at].residuals.push(residual);
        Ok(())
    }

    /// With their rate, which must be even.
    fn finish(mut self, options: &Options, path: &Path) -> Result<Tracks<T>, Error> {
        let frames = self.times.len();
        if frames == 0 {
            return Ok(Tracks::default());
        }
        if let Some(short) = self.all.iter().find(|t| t.samples.len() != frames) {
            let problem = format!(
                "'{}' has {} frames, '{}' {frames}",
                short.name,
                short.samples.len(),
                self.all[0].name
            );
            return Err(Error::invalid(Place::file(path), problem));
        }
        let span = self.times[frames - 1] - self.times[0];
        let stated = (frames > 1).then(|| (frames - 1) as f64 / span).map(|r| {
            // Written times are rounded; a rate is whole more often than not.
            if (r - r.round()).abs() < 1e-6 * r { r.round() } else { r }
        });
        let rate = rate(options, stated, || Place::file(path))?;
        let even = stated.unwrap_or(rate);
        let late = |(i, t): (usize, &f64)| (t - self.times[0] - i as f64 / even).abs() > 0.25 / even;
        if let Some(i) = self.times.iter().enumerate().position(late) {
            let problem = format!("the frame at {} s is not where an even rate has it", self.times[i]);
            return Err(Error::invalid(Place::file(path), problem));
        }
        for track in self.all.iter_mut().filter(|t| t.residuals.iter().all(|r| *r == 0.0)) {
            track.residuals = Vec::new();
        }
        Ok(Tracks { rate, start: self.times[0], frames, tracks: self.all })
    }
}

/// Reads markers and bodies.
///
/// # Errors
/// With the line: cells that are no numbers, frames that are missing or not evenly apart.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    let (mut markers, mut bodies) = (Growing::<Vec3>::new(), Growing::<RigidPose>::new());
    Table::visit(&bytes, path, &COLUMNS[..6], &COLUMNS[6..], |table, row| {
        let number = |c: usize| match table.text(row, c) {
            "" => Ok(None),
            _ => table.double(row, c).map(Some),
        };
        let numbers = |from: usize, count: usize| -> Result<Option<Vec<f64>>, Error> {
            let all = (from..from + count).map(&number).collect::<Result<Vec<_>, _>>()?;
            match all.iter().flatten().count() {
                0 => Ok(None),
                n if n == count => Ok(Some(all.into_iter().flatten().collect())),
                _ => Err(table.invalid(row, "some of the numbers of a place are missing; give all or none")),
            }
        };
        let seconds = table.double(row, 0)?;
        let name = table.text(row, 2);
        let place = numbers(3, 3)?.map(|v| vector([v[0], v[1], v[2]]));
        let turn = numbers(6, 4)?;
        let residual = number(10)?.unwrap_or(0.0) as f32;
        let pushed = match (table.text(row, 1), place, turn) {
            ("marker", place, None) => markers.push(name, seconds, place, residual),
            ("body", None, None) => bodies.push(name, seconds, None, residual),
            ("body", Some(position), Some(q)) => {
                let Some(rotation) = quaternion([q[0], q[1], q[2], q[3]]) else {
                    return Err(table.invalid(row, format!("the rotation of '{name}' is no unit quaternion")));
                };
                bodies.push(name, seconds, Some(RigidPose { position, rotation }), residual)
            }
            ("body", ..) => Err(format!("the body '{name}' needs a place and a rotation, or neither")),
            ("marker", ..) => Err(format!("the marker '{name}' has no rotation; a body would")),
            (kind, ..) => {
                let kind: String = kind.chars().take(40).collect();
                Err(format!("'{kind}' is neither marker nor body"))
            }
        };
        pushed.map_err(|problem| table.invalid(row, problem))
    })?;
    let take = Take { markers: markers.finish(options, path)?, bodies: bodies.finish(options, path)? };
    if take.frames() == 0 {
        return Err(Error::invalid(Place::file(path), "there is neither a marker nor a body in this file"));
    }
    Ok((Motion::Captured(take), Conventions { unit: Some(1.0), axes: up('y').map(|a| (a, Basis::Stated)) }))
}

/// The text of a file of this take, which is in metres with +y up.
pub fn write(take: &Take) -> String {
    let mut text = String::from("# metres, y up, right-handed; an empty place was not seen\n");
    let _ = writeln!(text, "{}", COLUMNS.join(","));
    rows(&mut text, "marker", &take.markers, |p| (*p, None));
    rows(&mut text, "body", &take.bodies, |b| (b.position, Some(b.rotation)));
    text
}

fn rows<T>(text: &mut String, kind: &str, tracks: &Tracks<T>, parts: fn(&T) -> (Vec3, Option<Quat>)) {
    for frame in 0..tracks.frames {
        let seconds = tracks.start + frame as f64 / tracks.rate;
        for track in &tracks.tracks {
            let mut row = vec![seconds.to_string(), kind.to_string(), quoted(&track.name)];
            let sample = track.samples.get(frame).and_then(Option::as_ref).map(parts);
            let (place, turn) = (sample.map(|s| s.0), sample.and_then(|s| s.1));
            row.extend(place.map_or([const { String::new() }; 3], |p| p.to_array().map(|v| v.to_string())));
            row.extend(turn.map_or([const { String::new() }; 4], |q| q.to_array().map(|v| v.to_string())));
            let residual = track.residuals.get(frame).filter(|r| **r != 0.0);
            row.push(residual.map_or(String::new(), f32::to_string));
            let _ = writeln!(text, "{}", row.join(","));
        }
    }
}

/// As a cell; a line break would end the row.
fn quoted(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    match name.contains([',', '"', '#']) || name.trim() != name {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "# metres\nseconds,kind,name,x,y,z,qx,qy,qz,qw,residual\n0,marker,toe,1,2,3,,,,,0.5\n\
        0,body,head,4,5,6,0.6,0,0,0.8,\n0.5,marker,toe,,,,,,,,\n0.25,body,head,,,,,,,,\n0.5,body,head,1,1,1,0,0,0,1,\n";

    fn told(text: &str) -> Result<Take, String> {
        assert!(recognises(text.as_bytes()));
        match read(text.as_bytes(), Path::new("a.csv"), &Options::default()) {
            Ok((Motion::Captured(take), _)) => Ok(take),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn markers_and_bodies_have_rates_of_their_own() {
        let take = told(SMALL).unwrap();
        assert_eq!((take.markers.rate, take.markers.frames), (2.0, 2));
        assert_eq!((take.bodies.rate, take.bodies.frames), (4.0, 3));
        assert_eq!(take.markers.tracks[0].samples, [Some(Vec3::new(1.0, 2.0, 3.0)), None]);
        assert_eq!(take.markers.tracks[0].residuals, [0.5, 0.0]);
        let head = take.bodies.tracks[0].samples[0].unwrap();
        assert!(head.rotation.abs_diff_eq(Quat::from_xyzw(0.6, 0.0, 0.0, 0.8), 1e-6));
    }

    #[test]
    fn what_is_wrong_is_said() {
        let changed = |from: &str, to: &str| {
            assert!(SMALL.contains(from), "{from}");
            told(&SMALL.replace(from, to)).unwrap_err()
        };
        assert!(changed("4,5,6", "4,,6").contains("a.csv:4:1: some of the numbers of a place are missing"));
        assert!(changed("0.6,0", "6,0").contains("no unit quaternion"));
        assert!(changed("4,5,6", ",,").contains("needs a place and a rotation, or neither"));
        assert!(changed("0.25,body", "0.45,body").contains("is not where an even rate has it"));
        assert!(changed("4,5,6", "4,nan,6").contains("'nan' in column 'y' is not a finite number"));
        assert!(changed("0,body,head,4", "0,bdy,head,4").contains("'bdy' is neither marker nor body"));
    }
}
