//! Biovision hierarchy (`.bvh`): joints with offsets, then a line of channels a frame.
//!
//! Angles are degrees; a joint turns by its channels in the order in which they are named, each about its own axis as the
//! ones before have turned it. A channel of position takes the place of the offset's number. Files say neither unit nor
//! axes; y is up in all that programs write. An end site becomes a joint that does not turn.

use super::{Basis, Conventions, Motion, Options, rate, up};
use crate::formats::numbers::{Scanner, text};
use crate::formats::support::Feature;
use crate::{Error, Place};
use glam::{DQuat, DVec3, EulerRot, Quat, Vec3};
use std::fmt::Write;
use std::path::Path;
use yugen_motion::{
    Joint, Placement, Property, SkeletalMotion, Skeleton, SkeletonError, Transform, continuous, sampled,
};

/// What a joint's channels may be called: which of its numbers, and whether of position.
const CHANNELS: [(&str, usize, bool); 6] = [
    ("Xposition", 0, true),
    ("Yposition", 1, true),
    ("Zposition", 2, true),
    ("Xrotation", 0, false),
    ("Yrotation", 1, false),
    ("Zrotation", 2, false),
];

/// Keywords.
pub const FEATURES: &[Feature] = &[
    Feature::yes("HIERARCHY"),
    Feature::yes("ROOT"),
    Feature::yes("JOINT"),
    Feature::yes("End"),
    Feature::yes("OFFSET"),
    Feature::partly("CHANNELS", "positions and rotations, at most one of each axis; no scales"),
    Feature::yes("MOTION"),
];

/// More joints than any rig has.
const MAX_JOINTS: usize = 1 << 14;

struct Channel {
    joint: usize,
    axis: usize,
    position: bool,
}

/// Reads a skeleton and its movement.
///
/// # Errors
/// With the line: words that are none of the format, numbers that are none, and fewer or more numbers than the file
/// announces.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let bytes = text(bytes);
    let mut s = Scanner::new(&bytes, path);
    if !next(&mut s).eq_ignore_ascii_case(b"HIERARCHY") {
        return Err(Error::invalid(s.start_of_file(), "expected HIERARCHY, with which a BVH file begins"));
    }
    let (joints, channels) = hierarchy(&mut s)?;
    if joints.is_empty() {
        return Err(s.expected("a ROOT with its joints"));
    }
    let (frames, rate) = header(&mut s, options)?;
    if channels.is_empty() && frames > 0 {
        return Err(Error::invalid(s.place(), "there are frames, but no joint has CHANNELS"));
    }
    // Each number takes a digit and a blank; only so many frames can be there.
    if frames.checked_mul(2 * channels.len()).is_none_or(|least| least > s.rest().len() + 1) {
        let problem = format!(
            "{frames} frames of {} channels are announced, more than the file can hold",
            channels.len()
        );
        return Err(Error::invalid(s.place(), problem));
    }
    let invalid = |e: &dyn std::fmt::Display| Error::invalid(Place::file(path), e.to_string());
    let rest = |joint: usize| match joints[joint].rest {
        Placement::Parts(parts) => parts.translation,
        Placement::Matrix(_) => Vec3::ZERO,
    };
    let mut moved: Vec<(Vec<Vec3>, Vec<Quat>)> = vec![Default::default(); joints.len()];
    for frame in 0..frames {
        let mut at = 0;
        while at < channels.len() {
            let joint = channels[at].joint;
            let (mut place, mut turn) = (rest(joint), DQuat::IDENTITY);
            let (mut places, mut turns) = (false, false);
            while let Some(c) = channels.get(at).filter(|c| c.joint == joint) {
                s.space();
                let Some(v) = s.float().filter(|v| v.abs() < f64::from(f32::MAX)) else {
                    let what = format!(
                        "channel {} of {} in frame {} of {frames}",
                        at + 1,
                        channels.len(),
                        frame + 1
                    );
                    return Err(s.expected(&what));
                };
                if c.position {
                    (place[c.axis], places) = (v as f32, true);
                } else {
                    turn *= DQuat::from_axis_angle(DVec3::AXES[c.axis], v.to_radians());
                    turns = true;
                }
                at += 1;
            }
            if places {
                moved[joint].0.push(place);
            }
            if turns {
                moved[joint].1.push(turn.as_quat());
            }
        }
    }
    s.space();
    if !s.at_end() {
        return Err(s.expected(&format!("nothing behind the {frames} frames that the file announces")));
    }
    let mut curves = Vec::new();
    for (joint, (places, mut turns)) in moved.into_iter().enumerate() {
        if !places.is_empty() {
            let values = places.iter().flat_map(|p| p.to_array()).collect();
            curves.push((joint, Property::Translation, values));
        }
        if !turns.is_empty() {
            continuous(&mut turns);
            curves.push((joint, Property::Rotation, turns.iter().flat_map(|q| q.to_array()).collect()));
        }
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let clip = sampled(name, rate, curves).map_err(|e| invalid(&e))?;
    let skeleton = Skeleton::new(joints).map_err(|e| invalid(&e))?;
    let motion = Motion::Skeletal(SkeletalMotion { skeleton, clip, rate, frames });
    Ok((motion, Conventions { unit: None, axes: up('y').map(|a| (a, Basis::Usual)) }))
}

/// The next word, on this line or a later one.
fn next<'a>(s: &mut Scanner<'a>) -> &'a [u8] {
    s.space();
    s.word()
}

/// Joints, parents before children, and all channels in the order of a frame's numbers.
fn hierarchy(s: &mut Scanner) -> Result<(Vec<Joint>, Vec<Channel>), Error> {
    let (mut joints, mut channels): (Vec<Joint>, Vec<Channel>) = Default::default();
    // Who is open: a joint, each with a brace.
    let mut open: Vec<usize> = Vec::new();
    let mut ends: Vec<bool> = Vec::new();
    loop {
        s.space();
        let mark = s.mark();
        let word = s.word();
        let keyword = word.to_ascii_uppercase();
        match keyword.as_slice() {
            b"ROOT" | b"JOINT" | b"END" => {
                let parent = open.last().copied();
                if (keyword == b"ROOT") != parent.is_none() {
                    let problem = "a ROOT stands outside of all braces, JOINT and End Site inside those of their parent";
                    return Err(Error::invalid(s.place_of(mark), problem));
                }
                let end = keyword == b"END";
                if parent.is_some_and(|p| ends[p]) {
                    return Err(Error::invalid(s.place_of(mark), "an End Site carries nothing"));
                }
                let name = match parent.filter(|_| end) {
                    Some(parent) => {
                        s.next_name();
                        format!("{} end", joints[parent].name)
                    }
                    None => s.next_name(),
                };
                if joints.len() == MAX_JOINTS {
                    let what = "the number of joints".into();
                    let (asked, limit) = (MAX_JOINTS as u64 + 1, MAX_JOINTS as u64);
                    return Err(Error::TooLarge { at: s.place_of(mark), what, asked, limit });
                }
                if next(s) != b"{" {
                    return Err(Error::invalid(
                        s.place_of(mark),
                        format!("expected {{ behind the name '{name}'"),
                    ));
                }
                open.push(joints.len());
                ends.push(end);
                joints.push(Joint { name, parent, rest: Placement::Parts(Transform::IDENTITY) });
            }
            b"OFFSET" => {
                let Some(&joint) = open.last() else {
                    return Err(Error::invalid(
                        s.place_of(mark),
                        "an OFFSET belongs into the braces of a joint",
                    ));
                };
                let mut offset = Vec3::ZERO;
                for axis in 0..3 {
                    let number = s.float().map(|v| v as f32).filter(|v| v.is_finite());
                    offset[axis] = number.ok_or_else(|| s.expected("three numbers behind OFFSET"))?;
                }
                joints[joint].rest =
                    Placement::Parts(Transform { translation: offset, ..Transform::IDENTITY });
            }
            b"CHANNELS" => {
                let Some(&joint) = open.last() else {
                    return Err(Error::invalid(
                        s.place_of(mark),
                        "CHANNELS belong into the braces of a joint",
                    ));
                };
                if channels.iter().any(|c: &Channel| c.joint == joint) {
                    let problem = format!("the joint '{}' has CHANNELS twice", joints[joint].name);
                    return Err(Error::invalid(s.place_of(mark), problem));
                }
                s.blanks();
                let count = s.integer().filter(|n| (0..=6).contains(n));
                let count = count.ok_or_else(|| s.expected("the number of channels, at most 6"))?;
                let mut taken = [[false; 3]; 2];
                for _ in 0..count {
                    s.space();
                    let at = s.mark();
                    let word = String::from_utf8_lossy(s.word()).into_owned();
                    let Some((_, axis, position)) =
                        CHANNELS.iter().find(|(name, ..)| name.eq_ignore_ascii_case(&word))
                    else {
                        let known = CHANNELS.iter().map(|(name, ..)| *name);
                        return Err(Error::unknown(s.place_of(at), "channel", &word, known));
                    };
                    if std::mem::replace(&mut taken[usize::from(*position)][*axis], true) {
                        let problem = format!("the joint '{}' has {word} twice", joints[joint].name);
                        return Err(Error::invalid(s.place_of(at), problem));
                    }
                    channels.push(Channel { joint, axis: *axis, position: *position });
                }
            }
            b"}" => {
                if open.pop().is_none() {
                    return Err(Error::invalid(s.place_of(mark), "this } closes nothing"));
                }
            }
            b"MOTION" => {
                let Some(&joint) = open.last() else { return Ok((joints, channels)) };
                let problem = format!("the joint '{}' is not closed: a }} is missing", joints[joint].name);
                return Err(Error::invalid(s.place_of(mark), problem));
            }
            b"" => return Err(s.expected("MOTION behind the joints")),
            _ => {
                let word = String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned();
                let known = FEATURES.iter().map(|f| f.name);
                return Err(Error::unknown(s.place_of(mark), "word", &word, known));
            }
        }
    }
}

/// `Frames:` and `Frame Time:`.
fn header(s: &mut Scanner, options: &Options) -> Result<(usize, f64), Error> {
    if !next(s).eq_ignore_ascii_case(b"Frames:") {
        return Err(s.expected("Frames: and their number behind MOTION"));
    }
    s.blanks();
    let frames = s.integer().and_then(|n| usize::try_from(n).ok());
    let frames = frames.ok_or_else(|| s.expected("the number of frames"))?;
    if !(next(s).eq_ignore_ascii_case(b"Frame") && s.word().eq_ignore_ascii_case(b"Time:")) {
        return Err(s.expected("Frame Time: and the seconds of a frame"));
    }
    s.blanks();
    let at = s.mark();
    let word = s.word();
    let time = std::str::from_utf8(word).ok().and_then(|w| Some((w, w.parse::<f64>().ok()?)));
    let Some((digits, time)) = time else {
        return Err(Error::invalid(s.place_of(at), "expected the seconds of a frame behind Frame Time:"));
    };
    let stated = (time > 0.0).then(|| whole_rate(digits, time));
    Ok((frames, rate(options, stated, || s.place_of(at))?))
}

/// Frames a second from the seconds of a frame as they were written: a whole number where the digits allow one, so that
/// 0.00833333 is 120.
fn whole_rate(digits: &str, time: f64) -> f64 {
    let decimals =
        digits.split_once('.').map_or(0, |(_, d)| d.bytes().take_while(u8::is_ascii_digit).count());
    let whole = (1.0 / time).round();
    let rounding =
        if digits.contains(['e', 'E']) { 1e-6 * time } else { 0.5001 * 10f64.powi(-(decimals as i32)) };
    if whole > 0.0 && (1.0 / whole - time).abs() <= rounding { whole } else { 1.0 / time }
}

/// To the metre: most programs take a BVH for centimetres.
const PER_METRE: f64 = 100.0;

/// Order of the turns of a joint, which most programs write.
const ORDER: [usize; 3] = [5, 3, 4];

/// The text of a file of this motion, which is in metres with +y up: in centimetres. Joints that are scaled stand where
/// they are seen; one that changes its distance from its parent gets channels of position. A joint that carries nothing
/// and never turns is an end site. Several roots are carried by one more at the origin; what does not move is one frame.
///
/// # Errors
/// Where a joint is at no place.
pub fn write(moved: &SkeletalMotion, path: &Path) -> Result<String, Error> {
    let invalid = |e: SkeletonError| Error::invalid(Place::file(path), e.to_string());
    let joints = moved.skeleton.joints();
    let roots = joints.iter().filter(|j| j.parent.is_none()).count();
    let frames = moved.frames.max(1);
    // Of each joint in its parent, frame after frame.
    let mut local: Vec<Vec<(DVec3, DQuat)>> = vec![Vec::with_capacity(frames); joints.len()];
    for frame in 0..frames {
        let poses = moved.poses(frame).map_err(invalid)?;
        for (i, joint) in joints.iter().enumerate() {
            let (at, turn) = (poses[i].position.as_dvec3(), poses[i].rotation.as_dquat());
            local[i].push(match joint.parent.map(|p| &poses[p]) {
                None => (at, turn),
                Some(p) => {
                    let back = p.rotation.as_dquat().normalize().inverse();
                    (back * (at - p.position.as_dvec3()), (back * turn).normalize())
                }
            });
        }
    }
    let mut children = vec![Vec::new(); joints.len()];
    for (i, joint) in joints.iter().enumerate() {
        joint.parent.into_iter().for_each(|p| children[p].push(i));
    }
    // A step of the numbers that are read, many times over.
    let size = local.iter().flatten().map(|l| l.0.abs().max_element()).fold(0.0, f64::max);
    let strays: Vec<bool> =
        local.iter().map(|l| l.iter().any(|(at, _)| at.distance(l[0].0) > 1e-5 * size)).collect();
    // A hundred-thousandth of a radian is what single precision leaves of nothing.
    let turned = |q: &DQuat| q.xyz().length() > 5e-6;
    let still = |i: usize| children[i].is_empty() && !strays[i] && !local[i].iter().any(|l| turned(&l.1));
    let is_end = |i: usize| joints[i].parent.is_some_and(|p| children[p].len() == 1) && still(i);

    let mut text = String::from("HIERARCHY\n");
    // Joints in the order of the file, and whether their places are among the numbers.
    let mut written: Vec<(usize, bool)> = Vec::new();
    let deeper = usize::from(roots > 1);
    if deeper == 1 {
        text.push_str("ROOT world\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n");
    }
    enum Step {
        Open(usize, usize),
        Close(usize),
    }
    let top = joints.iter().enumerate().rev().filter(|(_, j)| j.parent.is_none());
    let mut steps: Vec<Step> = top.map(|(i, _)| Step::Open(i, deeper)).collect();
    while let Some(step) = steps.pop() {
        let (i, depth) = match step {
            Step::Open(i, depth) => (i, depth),
            Step::Close(depth) => {
                let _ = writeln!(text, "{:1$}}}", "", 2 * depth);
                continue;
            }
        };
        let indent = 2 * depth;
        let at = local[i][0].0 * PER_METRE;
        if is_end(i) {
            let _ = writeln!(
                text,
                "{:indent$}End Site\n{:indent$}{{\n{:indent$}  OFFSET {at}\n{:indent$}}}",
                "",
                "",
                "",
                "",
                at = three(at)
            );
            continue;
        }
        // A line break would end the name.
        let name: String =
            joints[i].name.chars().map(|c| if c.is_control() || c == '{' { '_' } else { c }).collect();
        let (kind, root) = match joints[i].parent {
            None if deeper == 0 => ("ROOT", true),
            parent => ("JOINT", parent.is_none()),
        };
        let moves = root || strays[i];
        let positions = if moves { "6 Xposition Yposition Zposition" } else { "3" };
        let _ = writeln!(
            text,
            "{:indent$}{kind} {name}\n{:indent$}{{\n{:indent$}  OFFSET {}\n{:indent$}  CHANNELS {positions} {}",
            "",
            "",
            "",
            three(at),
            "",
            ORDER.map(|c| CHANNELS[c].0).join(" ")
        );
        written.push((i, moves));
        steps.push(Step::Close(depth));
        if children[i].is_empty() {
            let _ = writeln!(
                text,
                "{:indent$}  End Site\n{:indent$}  {{\n{:indent$}    OFFSET 0 0 0\n{:indent$}  }}",
                "", "", "", ""
            );
        }
        steps.extend(children[i].iter().rev().map(|&c| Step::Open(c, depth + 1)));
    }
    if deeper == 1 {
        text.push_str("}\n");
    }
    let rate = if moved.frames > 0 { moved.rate } else { 1.0 };
    let _ = writeln!(text, "MOTION\nFrames: {frames}\nFrame Time: {:.10}", 1.0 / rate);
    // Angles go on from those of the frame before, though they pass half a turn.
    let mut last = vec![DVec3::ZERO; joints.len()];
    let at = |i: usize, frame: usize| local[i][frame];
    for frame in 0..frames {
        let mut row: Vec<String> = vec!["0".into(); 3 * deeper];
        for &(i, moves) in &written {
            let (at, turn) = at(i, frame);
            if moves {
                row.push(three(at * PER_METRE));
            }
            let (z, x, y) = turn.normalize().to_euler(EulerRot::ZXY);
            let angles = DVec3::new(z, x, y) * (180.0 / std::f64::consts::PI);
            let angles = angles - ((angles - last[i]) / 360.0).round() * 360.0;
            last[i] = angles;
            row.push(three(angles));
        }
        text.push_str(&row.join(" "));
        text.push('\n');
    }
    Ok(text)
}

/// With six decimals: a micrometre's hundredth, and an arc that is as small.
fn three(v: DVec3) -> String {
    v.to_array().map(|v| format!("{v:.6}")).join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "HIERARCHY\nROOT hips {\n OFFSET 0 98 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n \
        JOINT left knee\n {\n  OFFSET 1 -40 0\n  CHANNELS 3 Yrotation Xrotation Zrotation\n  End Site\n  {\n   OFFSET 0 -40 5\n  }\n }\n}\n\
        MOTION\nFrames: 2\nFrame Time: 0.00833333\n1 2 3 10 20 30 40 50 60\n4 5 6 -10 0 0 0 0 90\n";

    fn moved(text: &str) -> SkeletalMotion {
        match read(text.as_bytes(), Path::new("a.bvh"), &Options::default()).unwrap().0 {
            Motion::Skeletal(moved) => moved,
            Motion::Captured(_) => panic!(),
        }
    }

    fn said(text: &str) -> String {
        read(text.as_bytes(), Path::new("a.bvh"), &Options::default()).unwrap_err().to_string()
    }

    #[test]
    fn channels_turn_in_their_order_and_positions_take_the_place_of_offsets() {
        let moved = moved(SMALL);
        let names: Vec<&str> = moved.skeleton.joints().iter().map(|j| j.name.as_str()).collect();
        assert_eq!(names, ["hips", "left knee", "left knee end"]);
        assert_eq!((moved.frames, moved.rate), (2, 120.0));
        let joints = moved.skeleton.to_skeleton(&moved.pose(0)).unwrap();
        let degrees = |v: [f32; 3]| v.map(f32::to_radians);
        let [z, x, y] = degrees([10.0, 20.0, 30.0]);
        let root = glam::Quat::from_euler(EulerRot::ZXY, z, x, y);
        let [y, x, z] = degrees([40.0, 50.0, 60.0]);
        let knee = root * glam::Quat::from_euler(EulerRot::YXZ, y, x, z);
        let place = Vec3::new(1.0, 2.0, 3.0) + root * Vec3::new(1.0, -40.0, 0.0);
        let end = place + knee * Vec3::new(0.0, -40.0, 5.0);
        // A float at a hundred has 8e-6 to the next.
        let got = joints[2].w_axis.truncate();
        assert!(got.distance(end) < 5e-5, "{got} {end}");
    }

    #[test]
    fn rates_are_whole_where_the_digits_allow_it() {
        for (digits, want) in [
            ("0.00833333", 120.0),
            ("0.0083", 120.0),
            ("0.00830", 1.0 / 0.0083),
            ("0.033333", 30.0),
            (".0333667", 1.0 / 0.0333667),
            ("8.333333e-03", 120.0),
            ("0.04", 25.0),
        ] {
            assert_eq!(whole_rate(digits, digits.parse().unwrap()), want, "{digits}");
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let changed = |from: &str, to: &str| {
            assert!(SMALL.contains(from));
            said(&SMALL.replace(from, to))
        };
        let nan = changed("-10 0 0", "-10 nan 0");
        assert_eq!(nan, "a.bvh:19:11: expected channel 5 of 9 in frame 2 of 2, found 'nan'");
        assert!(
            changed("Frames: 2", "Frames: 3").contains("3 frames of 9 channels are announced, more than")
        );
        let short = changed("0 0 0 0 90", "0 0 0 0");
        assert!(short.contains("channel 9 of 9 in frame 2 of 2, found the end of the file"), "{short}");
        assert!(changed("Frames: 2", "Frames: 1").contains("expected nothing behind the 1 frames"));
        assert!(changed("Frames: 2", "Frames: 99999999999").contains("more than the file can hold"));
        assert!(changed("Time: 0.00833333", "Time: 0").contains("give --rate"));
        assert!(changed("Time: 0.00833333", "Time: x").contains("expected the seconds of a frame"));
        assert!(
            changed("Yrotation\n", "Yrotate\n")
                .contains("unknown channel 'Yrotate'; did you mean 'Yrotation'?")
        );
        assert!(changed("Xrotation Yrotation\n", "Zrotation Yrotation\n").contains("has Zrotation twice"));
        assert!(
            changed("OFFSET 1 -40", "OFFSET 1")
                .contains("expected three numbers behind OFFSET, found the end")
        );
        assert!(changed("JOINT left", "ROOT left").contains("a ROOT stands outside"));
        assert!(changed("}\nMOTION", "MOTION").contains("the joint 'hips' is not closed: a } is missing"));
        assert!(changed("HIERARCHY", "HIERACHY").contains("expected HIERARCHY"));
        assert!(said("").contains("expected HIERARCHY"));
    }
}
