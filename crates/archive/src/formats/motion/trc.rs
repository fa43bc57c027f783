//! Track row column (`.trc`), after Motion Analysis: a row of markers' coordinates a frame, parted by tabs.
//!
//! A marker that was not seen has empty cells. The file says its unit and its rate; y is up, as OpenSim has it.

use super::sheet::{Frames, Sheet, timed, tracks};
use super::{Basis, Conventions, Motion, Options, rate, unit, up};
use crate::formats::numbers::text;
use crate::formats::support::Feature;
use crate::{Error, Place};
use std::path::Path;
use yugen_motion::Take;

/// Fields of the header.
pub const FEATURES: &[Feature] = &[
    Feature::yes("DataRate"),
    Feature::yes("NumFrames"),
    Feature::yes("NumMarkers"),
    Feature::yes("Units"),
    Feature::no("CameraRate", "the rate of the data counts"),
    Feature::no("OrigDataRate", "the rate of the data counts"),
    Feature::no("OrigDataStartFrame", "time begins where the data does"),
    Feature::no("OrigNumFrames", "the frames that are there count"),
];

/// Reads markers.
///
/// # Errors
/// With the line: a header without names, counts that are wrong, cells that are no numbers.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    let mut sheet = Sheet::new(&bytes, path, b'\t');
    sheet.need("PathFileType")?;
    if !sheet.row.bytes(0).eq_ignore_ascii_case(b"PathFileType") {
        return Err(sheet.invalid("expected PathFileType, with which a TRC file begins"));
    }
    sheet.need("the names of the fields")?;
    let keys = sheet.row.texts();
    sheet.need("the values of the fields")?;
    let line = sheet.row.line;
    let column = |feature: &Feature| keys.iter().position(|k| k.eq_ignore_ascii_case(feature.name));
    let [data_rate, num_frames, num_markers, units] = [0, 1, 2, 3].map(|i| column(&FEATURES[i]));
    let number = |at: Option<usize>| at.map_or(Ok(None), |c| sheet.number(c));
    let whole = |n: Option<f64>| n.filter(|n| *n >= 0.0 && n.fract() == 0.0).map(|n| n as usize);
    let (frames, markers) = (whole(number(num_frames)?), whole(number(num_markers)?));
    let rate = rate(options, number(data_rate)?, || Place::line(path, line, 1))?;
    let unit = match units.map(|c| sheet.row.text(c)).filter(|u| !u.is_empty()) {
        None => None,
        Some(word) => Some(unit(&word).ok_or_else(|| {
            let known = super::UNITS.iter().map(|(name, _)| *name);
            Error::unknown(Place::line(path, line, 1), "unit", &word, known)
        })?),
    };
    sheet.need("the names of the markers")?;
    if !sheet.row.bytes(0).eq_ignore_ascii_case(b"Frame#") {
        return Err(sheet.invalid("expected Frame#, Time and the names of the markers"));
    }
    // A name stands over the first of its three columns; some programs leave out the two tabs behind it.
    let head = sheet.row.texts();
    let named: Vec<(usize, &String)> =
        head.iter().enumerate().skip(2).filter(|(_, n)| !n.is_empty()).collect();
    let tight = named.windows(2).any(|w| w[1].0 < w[0].0 + 3);
    let columns: Vec<usize> =
        named.iter().enumerate().map(|(i, (c, _))| if tight { 2 + 3 * i } else { *c }).collect();
    if let Some(n) = markers.filter(|n| *n != named.len()) {
        return Err(sheet.invalid(format!("{n} markers are announced, but {} have names", named.len())));
    }
    if named.is_empty() {
        return Err(sheet.invalid("no marker has a name"));
    }
    let mut take = Take { markers: tracks(named.iter().map(|(_, n)| (*n).clone())), ..Take::default() };
    let most = columns.last().map_or(0, |c| c + 3);
    let mut counted = Frames::default();
    let mut start = 0.0;
    while sheet.advance()? {
        if counted.count == 0 && sheet.row.text(2).eq_ignore_ascii_case("X1") {
            continue;
        }
        counted.follow(&sheet)?;
        if counted.count == 1 {
            start = sheet.number(1)?.unwrap_or(0.0);
        }
        if sheet.row.len() > most {
            let problem = format!("{} columns where the names have {most}", sheet.row.len());
            return Err(sheet.invalid(problem));
        }
        for (track, column) in take.markers.tracks.iter_mut().zip(&columns) {
            track.samples.push(sheet.point(*column, &track.name)?);
        }
    }
    counted.check(&sheet, frames)?;
    timed(&mut take.markers, counted.count, rate, start);
    Ok((Motion::Captured(take), Conventions { unit, axes: up('y').map(|a| (a, Basis::Usual)) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const SMALL: &str = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\n\
        120.00\t120\t2\t2\tmm\t120\nFrame#\tTime\tleft toe\t\t\theel\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n\n\
        3\t0.016\t1\t2\t3\t4\t5\t6\t\n4\t0.025\t\t\t\t7\t8\t9\n";

    fn told(text: &str) -> Result<(Take, Conventions), String> {
        match read(text.as_bytes(), Path::new("a.trc"), &Options::default()) {
            Ok((Motion::Captured(take), said)) => Ok((take, said)),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }

    #[test]
    fn empty_cells_are_gaps() {
        let (take, said) = told(SMALL).unwrap();
        assert_eq!((take.markers.rate, take.markers.frames, take.markers.start), (120.0, 2, 0.016));
        assert_eq!(said.unit, Some(0.001));
        let toe = take.markers.find("left toe").unwrap();
        assert_eq!(toe.samples, [Some(Vec3::new(1.0, 2.0, 3.0)), None]);
        assert_eq!(take.markers.find("heel").unwrap().samples[1], Some(Vec3::new(7.0, 8.0, 9.0)));
        // As OpenSim's own tools write names.
        let tight = SMALL.replace("left toe\t\t\theel\t\t\t\n", "left toe\theel\n");
        assert_eq!(told(&tight).unwrap().0, take);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let changed = |from: &str, to: &str| {
            assert!(SMALL.contains(from), "{from}");
            told(&SMALL.replace(from, to)).unwrap_err()
        };
        assert!(changed("\t7\t8", "\tx\t8").contains("a.trc:8:1: 'x' in column 6 is not a finite number"));
        assert!(
            changed("\t7\t8", "\t\t8")
                .contains("of the 3 numbers of 'heel' from column 6 on only 2 are there")
        );
        assert!(changed("\t7\t8", "\tinf\t8").contains("not a finite number"));
        assert!(changed("120\t2\t2", "120\t3\t2").contains("3 frames are announced, but there are 2"));
        assert!(changed("120\t2\t2", "120\t2\t4").contains("4 markers are announced, but 2 have names"));
        assert!(changed("120.00\t", "0\t").contains("give --rate"));
        assert!(changed("\tmm\t", "\tmmm\t").contains("unknown unit 'mmm'; did you mean"));
        assert!(changed("\n4\t", "\n9\t").contains("frame 9 follows frame 3"));
        assert!(changed("8\t9\n", "8\t9\t10\n").contains("9 columns where the names have 8"));
        assert!(changed("PathFileType\t4", "Path\t4").contains("expected PathFileType"));
    }
}
