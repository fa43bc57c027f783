//! Acclaim: a skeleton (`.asf`) and the angles of its bones frame by frame (`.amc`).
//!
//! A bone is a direction and a length from where its parent ends, with axes C of its own in which its angles R turn it:
//! seen from the parent it turns by C R C⁻¹. Each bone becomes a joint where it begins; one that carries none gets
//! another where it ends. y is up. `length` .45, which Vicon's software writes and the CMU and HDM05 collections
//! have throughout, stands for a unit of 1/.45 inches; what other numbers mean is not agreed on. An .amc names neither
//! its skeleton nor its rate.

use super::{Basis, Conventions, Motion, Options, rate, up};
use crate::formats::support::{Feature, Support, find};
use crate::{Error, Place, list_folder};
use glam::{DQuat, DVec3, Quat, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use yugen_motion::{Joint, Placement, Property, SkeletalMotion, Skeleton, Transform, continuous, sampled};

/// Sections of a skeleton, and what a bone says.
pub const FEATURES: &[Feature] = &[
    Feature::yes("version"),
    Feature::yes("name"),
    Feature::partly("units", "mass is left out"),
    Feature::yes("documentation"),
    Feature::yes("root"),
    Feature::yes("bonedata"),
    Feature::yes("hierarchy"),
    Feature::no("skin", "meshes come in files of their own"),
    Feature::yes("rx"),
    Feature::yes("ry"),
    Feature::yes("rz"),
    Feature::no("tx", "bones keep their length; only the root moves"),
    Feature::no("ty", "bones keep their length; only the root moves"),
    Feature::no("tz", "bones keep their length; only the root moves"),
    Feature::no("l", "bones keep their length"),
];

/// More bones than any rig has.
const MAX_BONES: usize = 1 << 14;

/// What a number of a line turns or moves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Freedom {
    axis: usize,
    position: bool,
}

/// A bone of a skeleton; the root is the first, without length.
#[derive(Clone, Debug)]
struct Bone {
    name: String,
    /// From where it begins to where it ends.
    along: DVec3,
    /// Its own axes.
    axes: DQuat,
    freedoms: Vec<Freedom>,
    parent: Option<usize>,
}

/// What an .asf file holds.
#[derive(Clone, Debug)]
pub struct Acclaim {
    bones: Vec<Bone>,
    position: DVec3,
    /// Metres of its unit.
    unit: Option<f64>,
}

/// Lines with their numbers, without comments and empty ones.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines =
        text.lines().enumerate().map(|(i, l)| (i + 1, l.split('#').next().unwrap_or_default().trim()));
    lines.filter(|(_, l)| !l.is_empty())
}

/// What a reader complains with.
struct At<'a>(&'a Path, usize);

impl At<'_> {
    fn invalid(&self, problem: impl Into<String>) -> Error {
        Error::invalid(Place::line(self.0, self.1, 1), problem)
    }

    fn number(&self, word: Option<&str>, what: &str) -> Result<f64, Error> {
        let word = word.unwrap_or("the end of the line");
        let number = word.parse().ok().filter(|v: &f64| v.abs() < f64::from(f32::MAX));
        number.ok_or_else(|| self.invalid(format!("expected {what}, found '{}'", short(word))))
    }

    fn three<'w>(&self, words: &mut impl Iterator<Item = &'w str>, what: &str) -> Result<DVec3, Error> {
        let mut v = DVec3::ZERO;
        for axis in 0..3 {
            v[axis] = self.number(words.next(), &format!("three numbers as the {what}"))?;
        }
        Ok(v)
    }
}

fn short(word: &str) -> String {
    word.chars().take(40).collect()
}

/// Turns by `angles` about x, y and z one after the other in the order of the letters, each about axes that stay.
fn turned(order: &str, angles: DVec3) -> Option<DQuat> {
    let mut seen = [false; 3];
    let mut all = DQuat::IDENTITY;
    for letter in order.chars() {
        let axis = "xyz".find(letter.to_ascii_lowercase())?;
        if std::mem::replace(&mut seen[axis], true) {
            return None;
        }
        all = DQuat::from_axis_angle(DVec3::AXES[axis], angles[axis]) * all;
    }
    seen.iter().all(|s| *s).then_some(all)
}

impl Acclaim {
    /// Reads a skeleton.
    ///
    /// # Errors
    /// With the line: what a section should hold and does not.
    pub fn read(bytes: &[u8], path: &Path) -> Result<Self, Error> {
        let text = String::from_utf8_lossy(bytes);
        let mut section = String::new();
        let (mut unit, mut radians) = (None, false);
        let (mut position, mut orientation, mut root_axis) = (DVec3::ZERO, DVec3::ZERO, "XYZ".to_string());
        let root = Bone {
            name: "root".into(),
            along: DVec3::ZERO,
            axes: DQuat::IDENTITY,
            freedoms: Vec::new(),
            parent: None,
        };
        let mut bones = vec![root];
        // Directions, lengths and angles of the bone that is read.
        let mut open: Option<(usize, Bone, DVec3, f64)> = None;
        let mut names: HashMap<String, usize> = HashMap::from([("root".into(), 0)]);
        let mut hangs = vec![true];
        for (line, all) in lines(&text) {
            let at = At(path, line);
            if let Some(rest) = all.strip_prefix(':') {
                if let Some((begun, ..)) = open {
                    return Err(At(path, begun).invalid("this bone begins and does not end"));
                }
                let mut words = rest.split_whitespace();
                section = words.next().unwrap_or_default().to_lowercase();
                if find(&FEATURES[..8], &section).is_none() {
                    let known = FEATURES[..8].iter().map(|f| f.name);
                    return Err(Error::unknown(
                        Place::line(path, line, 1),
                        "section",
                        &short(&section),
                        known,
                    ));
                }
                continue;
            }
            let mut words = all.split_whitespace();
            let word = words.next().unwrap_or_default();
            let angle = |v: DVec3| if radians { v } else { v * std::f64::consts::PI / 180.0 };
            match (section.as_str(), word) {
                ("units", "length") => {
                    let length = at.number(words.next(), "the unit of length")?;
                    if length <= 0.0 {
                        return Err(at.invalid(format!("{length} is no unit of length")));
                    }
                    unit = ((length - 0.45).abs() < 1e-9).then_some(0.0254 / length);
                }
                ("units", "angle") => match words.next() {
                    Some("deg") => radians = false,
                    Some("rad") => radians = true,
                    other => {
                        let other = short(other.unwrap_or_default());
                        return Err(at.invalid(format!("expected deg or rad, found '{other}'")));
                    }
                },
                ("root", "order") => bones[0].freedoms = freedoms(&at, words, true)?,
                ("root", "axis") => root_axis = words.next().unwrap_or_default().into(),
                ("root", "position") => position = at.three(&mut words, "position")?,
                ("root", "orientation") => orientation = angle(at.three(&mut words, "orientation")?),
                ("bonedata", "begin") if open.is_none() => {
                    if bones.len() > MAX_BONES {
                        let (asked, limit) = (bones.len() as u64, MAX_BONES as u64);
                        let what = "the number of bones".into();
                        return Err(Error::TooLarge { at: Place::line(path, line, 1), what, asked, limit });
                    }
                    open = Some((line, Bone { name: String::new(), ..bones[0].clone() }, DVec3::ZERO, 0.0));
                    if let Some((_, bone, ..)) = &mut open {
                        bone.freedoms.clear();
                    }
                }
                ("bonedata", word) => {
                    let Some((_, bone, direction, length)) = &mut open else {
                        return Err(at.invalid("expected a bone between begin and end"));
                    };
                    match word {
                        "name" => bone.name = words.next().unwrap_or_default().into(),
                        "direction" => *direction = at.three(&mut words, "direction")?,
                        "length" => *length = at.number(words.next(), "the length of the bone")?,
                        "axis" => {
                            let angles = angle(at.three(&mut words, "axis")?);
                            let order = words.next().unwrap_or("XYZ");
                            bone.axes = turned(order, angles).ok_or_else(|| no_order(&at, order))?;
                        }
                        "dof" => bone.freedoms = freedoms(&at, words, false)?,
                        "end" => {
                            let (direction, length) = (*direction, *length);
                            let Some((_, mut bone, ..)) = open.take() else { continue };
                            if bone.name.is_empty() {
                                return Err(at.invalid("this bone has no name"));
                            }
                            // A bone without direction has no length.
                            bone.along = direction.normalize_or_zero() * length;
                            if names.insert(bone.name.clone(), bones.len()).is_some() {
                                return Err(
                                    at.invalid(format!("there are two bones '{}'", short(&bone.name)))
                                );
                            }
                            bones.push(bone);
                            hangs.push(false);
                        }
                        _ => {}
                    }
                }
                ("hierarchy", "begin" | "end") => {}
                ("hierarchy", parent) => {
                    let bone = |name: &str| {
                        names.get(name).copied().ok_or_else(|| {
                            let known = names.keys().map(String::as_str);
                            Error::unknown(Place::line(path, line, 1), "bone", &short(name), known)
                        })
                    };
                    let parent = bone(parent)?;
                    for child in words {
                        let child = bone(child)?;
                        if std::mem::replace(&mut hangs[child], true) {
                            return Err(at.invalid(format!("the bone '{}' hangs twice", bones[child].name)));
                        }
                        bones[child].parent = Some(parent);
                    }
                }
                _ => {}
            }
        }
        if let Some((begun, ..)) = open {
            return Err(At(path, begun).invalid("this bone begins and does not end"));
        }
        if bones.len() == 1 {
            return Err(Error::invalid(
                Place::file(path),
                "there is no bone in :bonedata, so this is no skeleton",
            ));
        }
        bones[0].axes = turned(&root_axis, orientation).ok_or_else(|| no_order(&At(path, 1), &root_axis))?;
        if let Some(lost) = hangs.iter().position(|h| !h) {
            let problem = format!("the bone '{}' hangs nowhere in :hierarchy", bones[lost].name);
            return Err(Error::invalid(Place::file(path), problem));
        }
        Ok(Self { bones, position, unit })
    }

    /// The joints: one where each bone begins, in the order of the bones, and one where each ends that carries none.
    fn joints(&self) -> Vec<Joint> {
        let at = |place: DVec3| {
            Placement::Parts(Transform { translation: place.as_vec3(), ..Transform::IDENTITY })
        };
        let mut joints: Vec<Joint> = self
            .bones
            .iter()
            .map(|b| Joint {
                name: b.name.clone(),
                parent: b.parent,
                rest: at(b.parent.map_or(self.position, |p| self.bones[p].along)),
            })
            .collect();
        let mut carries = vec![false; self.bones.len()];
        self.bones.iter().filter_map(|b| b.parent).for_each(|p| carries[p] = true);
        for (i, bone) in self.bones.iter().enumerate().filter(|(i, _)| !carries[*i]) {
            joints.push(Joint { name: format!("{} end", bone.name), parent: Some(i), rest: at(bone.along) });
        }
        joints
    }

    fn conventions(&self) -> Conventions {
        Conventions { unit: self.unit, axes: up('y').map(|a| (a, Basis::Usual)) }
    }

    /// Reads what an .amc does to this skeleton.
    ///
    /// # Errors
    /// With the line: bones that it has not, too few numbers, no rate.
    pub fn read_motion(&self, bytes: &[u8], path: &Path, options: &Options) -> Result<SkeletalMotion, Error> {
        let text = String::from_utf8_lossy(bytes);
        let names: HashMap<&str, usize> =
            self.bones.iter().enumerate().map(|(i, b)| (b.name.as_str(), i)).collect();
        let mut places: Vec<Vec3> = Vec::new();
        let mut turns: Vec<Vec<Quat>> = vec![Vec::new(); self.bones.len()];
        let (mut frames, mut radians) = (0usize, false);
        let mut last = 0;
        let whole = |turns: &[Vec<Quat>], frames: usize| {
            self.bones.iter().zip(turns).position(|(b, t)| !b.freedoms.is_empty() && t.len() < frames)
        };
        let missing = |bone: usize, frames: usize, line: usize| {
            At(path, line)
                .invalid(format!("frame {frames} ends without the bone '{}'", self.bones[bone].name))
        };
        for (line, all) in lines(&text) {
            let at = At(path, line);
            last = line;
            if let Some(word) = all.strip_prefix(':') {
                radians |= word.trim().eq_ignore_ascii_case("RADIANS");
                continue;
            }
            let mut words = all.split_whitespace();
            let word = words.next().unwrap_or_default();
            if word.bytes().all(|b| b.is_ascii_digit()) {
                if let Some(bone) = whole(&turns, frames) {
                    return Err(missing(bone, frames, line));
                }
                frames += 1;
                continue;
            }
            let Some(&index) = names.get(word) else {
                let known = names.keys().copied();
                return Err(Error::unknown(Place::line(path, line, 1), "bone", &short(word), known));
            };
            let bone = &self.bones[index];
            if turns[index].len() >= frames {
                let problem = if frames == 0 {
                    "stands before the number of a frame"
                } else {
                    "is twice in this frame"
                };
                return Err(at.invalid(format!("the bone '{word}' {problem}")));
            }
            let (mut place, mut turn) = (self.position, DQuat::IDENTITY);
            for freedom in &bone.freedoms {
                let what = format!("{} numbers behind '{word}'", bone.freedoms.len());
                let value = at.number(words.next(), &what)?;
                if freedom.position {
                    place[freedom.axis] += value;
                } else {
                    let angle = if radians { value } else { value.to_radians() };
                    turn = DQuat::from_axis_angle(DVec3::AXES[freedom.axis], angle) * turn;
                }
            }
            if words.next().is_some() {
                let problem =
                    format!("'{word}' has {} numbers in its skeleton, here are more", bone.freedoms.len());
                return Err(at.invalid(problem));
            }
            if bone.freedoms.is_empty() {
                continue;
            }
            if index == 0 {
                places.push(place.as_vec3());
            }
            turns[index].push((bone.axes * turn * bone.axes.inverse()).as_quat());
        }
        if let Some(bone) = whole(&turns, frames) {
            return Err(missing(bone, frames, last));
        }
        if frames == 0 {
            return Err(Error::invalid(Place::file(path), "there is no frame in this file"));
        }
        let rate = rate(options, None, || Place::file(path))?;
        let values = |turns: Vec<Quat>| turns.iter().flat_map(|q| q.to_array()).collect();
        let root = places.iter().flat_map(|p| p.to_array()).collect();
        let mut curves = Vec::new();
        if self.bones[0].freedoms.iter().any(|f| f.position) {
            curves.push((0, Property::Translation, root));
        }
        for (joint, mut turns) in turns.into_iter().enumerate().filter(|(_, t)| !t.is_empty()) {
            continuous(&mut turns);
            curves.push((joint, Property::Rotation, values(turns)));
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let invalid = |e: &dyn std::fmt::Display| Error::invalid(Place::file(path), e.to_string());
        let clip = sampled(name, rate, curves).map_err(|e| invalid(&e))?;
        let skeleton = Skeleton::new(self.joints()).map_err(|e| invalid(&e))?;
        Ok(SkeletalMotion { skeleton, clip, rate, frames })
    }
}

fn no_order(at: &At, order: &str) -> Error {
    at.invalid(format!("expected the order of the axes, as in XYZ, found '{}'", short(order)))
}

fn freedoms<'w>(at: &At, words: impl Iterator<Item = &'w str>, root: bool) -> Result<Vec<Freedom>, Error> {
    let mut all: Vec<Freedom> = Vec::new();
    for word in words {
        let name = word.to_lowercase();
        let known = FEATURES[8..].iter().map(|f| f.name);
        let Some(feature) = find(&FEATURES[8..], &name) else {
            return Err(Error::unknown(Place::line(at.0, at.1, 1), "degree of freedom", &short(word), known));
        };
        if let (Support::No(why), false) = (feature.support, root && name != "l") {
            return Err(at.invalid(format!("the degree of freedom '{name}' is not read: {why}")));
        }
        let freedom = Freedom { axis: "xyz".find(&name[1..]).unwrap_or(0), position: name.starts_with('t') };
        if all.contains(&freedom) {
            return Err(at.invalid(format!("'{name}' is named twice")));
        }
        all.push(freedom);
    }
    Ok(all)
}

/// Reads an .amc with the skeleton that the options name or that lies beside it.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let skeleton = match &options.skeleton {
        Some(skeleton) => skeleton.clone(),
        None => beside(path)?,
    };
    let acclaim = Acclaim::read(&crate::formats::read_file(&skeleton)?, &skeleton)?;
    let moved = acclaim.read_motion(bytes, path, options)?;
    Ok((Motion::Skeletal(moved), acclaim.conventions()))
}

/// Reads an .asf, which does not move.
pub fn read_still(bytes: &[u8], path: &Path, _: &Options) -> Result<(Motion, Conventions), Error> {
    let acclaim = Acclaim::read(bytes, path)?;
    let skeleton =
        Skeleton::new(acclaim.joints()).map_err(|e| Error::invalid(Place::file(path), e.to_string()))?;
    let moved = SkeletalMotion { skeleton, ..SkeletalMotion::default() };
    Ok((Motion::Skeletal(moved), acclaim.conventions()))
}

/// The skeleton in the folder of an .amc whose name begins as its own does; or the only one.
fn beside(path: &Path) -> Result<PathBuf, Error> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut all = list_folder(folder)?;
    all.retain(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("asf")));
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let begins = |p: &PathBuf| {
        let own = p.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        stem.starts_with(&own).then_some(own.len())
    };
    let named = all.iter().filter_map(|p| Some((begins(p)?, p))).max_by_key(|(length, _)| *length);
    match (named, all.as_slice()) {
        (Some((_, skeleton)), _) | (None, [skeleton]) => Ok(skeleton.clone()),
        (None, found) => {
            let problem = format!(
                "the skeleton of these angles is not told: {} .asf files lie beside it; give it with --skeleton FILE.asf",
                found.len()
            );
            Err(Error::invalid(Place::file(path), problem))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASF: &str = "# made by hand\n:version 1.10\n:name seed\n:units\n mass 1\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n \
        axis XYZ\n position 0 0 0\n orientation 0 0 0\n:bonedata\n begin\n id 1\n name thigh\n direction 0 -2 0\n length 7\n axis 0 0 20 XYZ\n \
        dof rx rz\n limits (-160.0 20.0)\n (-70 70)\n end\n begin\n id 2\n name shin\n direction 0 0 1\n length 3\n axis 0 90 0 XYZ\n dof rx\n end\n\
        :hierarchy\n begin\n root thigh\n thigh shin\n end\n";
    const AMC: &[u8] = b"#!OML:ASF f\xfcr.asf\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 10 20 30\nthigh 40 50\nshin 60\n2\nroot 4 5 6 0 0 0\nthigh 0 0\nshin 0\n";

    fn both(asf: &str, amc: &[u8]) -> Result<SkeletalMotion, String> {
        let options = Options { rate: Some(120.0), ..Options::default() };
        let acclaim = Acclaim::read(asf.as_bytes(), Path::new("a.asf")).map_err(|e| e.to_string())?;
        acclaim.read_motion(amc, Path::new("a.amc"), &options).map_err(|e| e.to_string())
    }

    #[test]
    fn bones_turn_in_their_own_axes() {
        let moved = both(ASF, AMC).unwrap();
        let names: Vec<&str> = moved.skeleton.joints().iter().map(|j| j.name.as_str()).collect();
        assert_eq!(names, ["root", "thigh", "shin", "shin end"]);
        let joints = moved.skeleton.to_skeleton(&moved.pose(0)).unwrap();
        let about =
            |axis: usize, degrees: f64| DQuat::from_axis_angle(DVec3::AXES[axis], degrees.to_radians());
        let root = about(2, 30.0) * about(1, 20.0) * about(0, 10.0);
        let c = about(2, 20.0);
        let thigh = root * c * (about(2, 50.0) * about(0, 40.0)) * c.inverse();
        let c = about(1, 90.0);
        let shin = thigh * c * about(0, 60.0) * c.inverse();
        let knee = DVec3::new(1.0, 2.0, 3.0) + thigh * DVec3::new(0.0, -7.0, 0.0);
        let end = knee + shin * DVec3::new(0.0, 0.0, 3.0);
        assert!(joints[2].w_axis.truncate().as_dvec3().distance(knee) < 1e-5);
        assert!(joints[3].w_axis.truncate().as_dvec3().distance(end) < 1e-5);
        let last = moved.skeleton.to_skeleton(&moved.pose(1)).unwrap()[3].w_axis;
        assert!(last.truncate().distance(Vec3::new(4.0, -2.0, 9.0)) < 1e-5);
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let asf = |from: &str, to: &str| {
            assert!(ASF.contains(from), "{from}");
            both(&ASF.replace(from, to), AMC).unwrap_err()
        };
        assert!(
            asf("length 7", "length nan")
                .contains("a.asf:18:1: expected the length of the bone, found 'nan'")
        );
        assert!(asf("dof rx rz", "dof rx rq").contains("unknown degree of freedom 'rq'"));
        assert!(asf("dof rx rz", "dof rx l").contains("'l' is not read: bones keep their length"));
        assert!(asf("axis 0 0 20 XYZ", "axis 0 0 20 XXZ").contains("found 'XXZ'"));
        assert!(asf("thigh shin\n", "thigh sin\n").contains("unknown bone 'sin'; did you mean 'shin'?"));
        assert!(asf("thigh shin\n", "").contains("the bone 'shin' hangs nowhere"));
        assert!(asf("root thigh\n", "root thigh thigh\n").contains("hangs twice"));
        assert!(asf("root thigh\n", "root\n shin thigh\n").contains("carries itself in a circle"));
        assert!(asf("name shin", "name thigh").contains("there are two bones 'thigh'"));
        let amc = |from: &str, to: &str| {
            let text = String::from_utf8_lossy(AMC).replace(from, to);
            both(ASF, text.as_bytes()).unwrap_err()
        };
        assert!(amc("thigh 40 50", "thigh 40").contains("a.amc:6:1: expected 2 numbers behind 'thigh'"));
        assert!(amc("thigh 40 50", "thigh 40 50 60").contains("here are more"));
        assert!(amc("thigh 40 50\n", "").contains("frame 1 ends without the bone 'thigh'"));
        assert!(amc("shin 60", "shine 60").contains("unknown bone 'shine'"));
        assert!(amc("shin 60", "shin 60\nshin 60").contains("is twice in this frame"));
        let acclaim = Acclaim::read(ASF.as_bytes(), Path::new("a.asf")).unwrap();
        let unsaid =
            acclaim.read_motion(AMC, Path::new("a.amc"), &Options::default()).unwrap_err().to_string();
        assert!(unsaid.contains("give --rate"), "{unsaid}");
    }
}
