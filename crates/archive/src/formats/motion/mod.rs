//! Motion: what was captured of a performer, one file per format, and what their files do not say.
//!
//! A reader returns what the file has, in the file's own unit and axes, and what the file says of these
//! ([`Conventions`]). [`load`] makes metres of it with +y up and right-handed; what neither file nor caller says is asked
//! for, or guessed from the size of what moves if the caller wants that.

pub mod acclaim;
pub mod bvh;
pub mod c3d;
pub mod gltf;
pub mod motive;
pub mod qualisys;
mod sheet;
pub mod table;
pub mod trc;
pub mod vicon;

use super::{lp::Axes, read_filled_file};
use crate::{Error, Place};
use glam::{Mat3, Vec3};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use yugen_motion::{SkeletalMotion, Take};
use yugen_scene::Scene;

/// What a file of motion holds.
#[derive(Clone, Debug)]
pub enum Motion {
    /// What was measured.
    Captured(Take),
    /// What was made of it: joints that turn.
    Skeletal(SkeletalMotion),
}

/// What a file says of how its numbers are meant; `None` where it does not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conventions {
    /// Metres of its unit.
    pub unit: Option<f64>,
    /// Its axes in ours: x to the right, y up, z to the front.
    pub axes: Option<(Axes, Basis)>,
}

/// Where a convention comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// The caller said it.
    Given,
    /// The file says it.
    Stated,
    /// The format is written so.
    Usual,
    /// From the size of what moves.
    Guessed,
}

impl Basis {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "as given",
            Self::Stated => "stated by the file",
            Self::Usual => "as the format is written",
            Self::Guessed => "guessed from the size",
        }
    }
}

/// What three angles of a rigid body mean, where a file does not say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Angles {
    /// An axis whose length is the angle.
    Helical,
    /// Turns about the body's own axes one after the other.
    Euler(glam::EulerRot),
}

impl Angles {
    /// Names and meanings.
    pub const ALL: [(&'static str, Self); 7] = [
        ("helical", Self::Helical),
        ("xyz", Self::Euler(glam::EulerRot::XYZ)),
        ("xzy", Self::Euler(glam::EulerRot::XZY)),
        ("yxz", Self::Euler(glam::EulerRot::YXZ)),
        ("yzx", Self::Euler(glam::EulerRot::YZX)),
        ("zxy", Self::Euler(glam::EulerRot::ZXY)),
        ("zyx", Self::Euler(glam::EulerRot::ZYX)),
    ];

    /// By its name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(n, _)| *n == name).map(|(_, a)| *a)
    }

    fn rotation(self, radians: Vec3) -> glam::Quat {
        match self {
            Self::Helical => glam::Quat::from_scaled_axis(radians),
            Self::Euler(order) => {
                let index = |axis: char| "xyz".find(axis).unwrap_or(0);
                let name = Self::ALL.iter().find(|(_, a)| *a == self).map_or("xyz", |(n, _)| n);
                let [a, b, c] = std::array::from_fn(|i| radians[index(name.as_bytes()[i].into())]);
                glam::Quat::from_euler(order, a, b, c)
            }
        }
    }
}

/// What a caller says of a file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Metres of its unit, whatever it says.
    pub unit: Option<f64>,
    /// Its axes in ours, whatever it says.
    pub axes: Option<Axes>,
    /// Frames a second, whatever it says.
    pub rate: Option<f64>,
    /// What three angles mean where it does not say it.
    pub angles: Option<Angles>,
    /// The .asf of an .amc; else the one beside it.
    pub skeleton: Option<PathBuf>,
    /// Which animation of a file that has several; else the first.
    pub animation: Option<String>,
    /// Unit and axes that nobody says are guessed, not asked for.
    pub guess: bool,
}

/// Reads the bytes of a file: what moves, in its unit and axes, and what it says of these.
pub type Reader = fn(&[u8], &Path, &Options) -> Result<(Motion, Conventions), Error>;

/// A format that motion comes in.
pub struct Format {
    /// For people.
    pub name: &'static str,
    /// Lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Whether bytes are of it, among the formats of its extension.
    pub recognises: fn(&[u8]) -> bool,
    /// Reads it; the path names it in messages and says where its files lie.
    pub read: Reader,
}

/// Every format that motion comes in.
pub const FORMATS: &[Format] = &[
    Format { name: "Biovision BVH", extensions: &["bvh"], recognises: |_| true, read: bvh::read },
    Format { name: "C3D", extensions: &["c3d"], recognises: |_| true, read: c3d::read },
    Format { name: "TRC", extensions: &["trc"], recognises: |_| true, read: trc::read },
    Format { name: "glTF 2.0", extensions: &["glb", "gltf"], recognises: |_| true, read: gltf::read },
    Format { name: "Acclaim AMC", extensions: &["amc"], recognises: |_| true, read: acclaim::read },
    Format { name: "Acclaim ASF", extensions: &["asf"], recognises: |_| true, read: acclaim::read_still },
    Format {
        name: "OptiTrack Motive CSV",
        extensions: &["csv"],
        recognises: motive::recognises,
        read: motive::read,
    },
    Format {
        name: "Vicon CSV",
        extensions: &["csv", "txt", "tsv"],
        recognises: vicon::recognises,
        read: vicon::read,
    },
    Format {
        name: "Qualisys TSV",
        extensions: &["tsv", "txt", "csv"],
        recognises: qualisys::recognises,
        read: qualisys::read,
    },
    Format {
        name: "Yugen CSV",
        extensions: &["csv", "tsv", "txt"],
        recognises: table::recognises,
        read: table::read,
    },
];

/// Units of length by what files call them, in metres.
pub const UNITS: &[(&str, f64)] = &[
    ("m", 1.0),
    ("cm", 0.01),
    ("mm", 0.001),
    ("in", 0.0254),
    ("ft", 0.3048),
    ("meter", 1.0),
    ("meters", 1.0),
    ("metre", 1.0),
    ("metres", 1.0),
    ("centimeters", 0.01),
    ("centimetres", 0.01),
    ("millimeters", 0.001),
    ("millimetres", 0.001),
    ("inch", 0.0254),
    ("inches", 0.0254),
    ("feet", 0.3048),
];

/// A unit of length by its name, in metres.
pub fn unit(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase();
    UNITS.iter().find(|(n, _)| *n == name).map(|(_, metres)| *metres)
}

/// The short name of a unit, or its length.
pub fn unit_name(metres: f64) -> String {
    let near = UNITS.iter().find(|(_, m)| (m - metres).abs() < 1e-9 * metres);
    near.map_or_else(|| format!("{:.4} mm", 1000.0 * metres), |(name, _)| (*name).to_string())
}

/// Axes by which of those of the file is up, the others as they follow from it: `y`, `z`, `x`.
pub fn up(axis: char) -> Option<Axes> {
    let words = match axis {
        'y' => "x y z",
        'z' => "x -z y",
        'x' => "y -x z",
        _ => return None,
    };
    words.parse().ok()
}

/// Motion in metres, +y up, right-handed, and where that comes from.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What the file holds.
    pub motion: Motion,
    /// Its format, for people.
    pub format: &'static str,
    /// Metres of the file's unit.
    pub unit: (f64, Basis),
    /// The file's axes.
    pub axes: (Axes, Basis),
    /// What looks wrong nevertheless, as sentences.
    pub doubts: Vec<String>,
}

/// The format of a file, by its extension and its bytes.
pub fn format_of(bytes: &[u8], path: &Path) -> Result<&'static Format, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let mut named = FORMATS.iter().filter(|f| f.extensions.contains(&extension.as_str())).peekable();
    if named.peek().is_none() {
        let known = FORMATS.iter().flat_map(|f| f.extensions).copied();
        return Err(Error::unknown(Place::file(path), "motion file extension", &extension, known));
    }
    let names: Vec<&str> = named.clone().map(|f| f.name).collect();
    named.find(|f| (f.recognises)(bytes)).ok_or_else(|| {
        let problem =
            format!("this does not begin as a table of motion does ({}); if it is one, export it again with its header", names.join(", "));
        Error::invalid(Place::line(path, 1, 1), problem)
    })
}

/// Whether a file is of one of the formats.
pub fn recognises(bytes: &[u8], path: &Path) -> bool {
    format_of(bytes, path).is_ok()
}

/// Reads a file of motion.
///
/// # Errors
/// What is wrong in the file, with its place, and what it does not say and `options` do not either.
pub fn load(path: &Path, options: &Options) -> Result<Loaded, Error> {
    let _span = tracing::info_span!("read_motion", file = %path.display()).entered();
    read(&read_filled_file(path)?, path, options)
}

/// As [`load`], from the bytes of a file.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<Loaded, Error> {
    let format = format_of(bytes, path)?;
    if let Some(rate) = options.rate.filter(|r| !(*r > 0.0 && r.is_finite())) {
        return Err(Error::invalid(Place::file(path), format!("{rate} is no rate; give frames a second")));
    }
    let (mut motion, said) = (format.read)(bytes, path, options)?;
    let size = motion.size();
    let axes = match (options.axes, said.axes) {
        (Some(axes), _) => (axes, Basis::Given),
        (None, Some(axes)) => axes,
        (None, None) => match size.tallest() {
            Some(axis) if options.guess => (up(axis).unwrap_or_default(), Basis::Guessed),
            None if options.guess => (Axes::default(), Basis::Guessed),
            tallest => {
                let seems = tallest.map_or(String::new(), |a| format!(" (it stands tallest along {a})"));
                let problem = format!("the file does not say which axis is up: give --up y or --up z{seems}");
                return Err(Error::invalid(Place::file(path), problem));
            }
        },
    };
    let unit = match (options.unit, said.unit) {
        (Some(unit), _) => (unit, Basis::Given),
        (None, Some(unit)) => (unit, Basis::Stated),
        (None, None) => {
            let likely = size.likely_unit();
            if !options.guess {
                let seems = if size.height > 0.0 {
                    format!(" (what moves is {:.4} large, as in {})", size.height, unit_name(likely))
                } else {
                    String::new()
                };
                let problem =
                    format!("the file does not say its unit of length: give --unit m, cm or mm{seems}");
                return Err(Error::invalid(Place::file(path), problem));
            }
            (likely, Basis::Guessed)
        }
    };
    if !(unit.0 > 0.0 && unit.0.is_finite()) {
        return Err(Error::invalid(Place::file(path), format!("{} is no unit of length", unit.0)));
    }
    let metres = size.height * unit.0;
    if unit.1 == Basis::Stated && size.height > 0.0 && !SIZES.contains(&metres) {
        let problem = format!(
            "in {}, as the file says, what moves would be {metres:.4} m large; its unit is probably {}: give it with --unit",
            unit_name(unit.0),
            unit_name(size.likely_unit())
        );
        return Err(Error::invalid(Place::file(path), problem));
    }
    let mut doubts = Vec::new();
    let matrix = matrix(axes.0);
    let up_in_file = matrix.transpose() * Vec3::Y;
    let claimed = ['x', 'y', 'z'][up_in_file.abs().max_position()];
    if let (Some(tallest), true) = (size.tallest(), axes.1 != Basis::Given)
        && tallest != claimed
    {
        doubts.push(format!(
            "{claimed} is up ({}), but what moves stands tallest along {tallest}: give --up {tallest} unless it lies down",
            axes.1.name()
        ));
    }
    tracing::info!(
        "{}: {}; lengths in {} ({}), axes {} ({})",
        path.display(),
        format.name,
        unit_name(unit.0),
        unit.1.name(),
        axes.0,
        axes.1.name()
    );
    let infinite = |e: yugen_motion::CurveError| Error::invalid(Place::file(path), e.to_string());
    match &mut motion {
        Motion::Captured(take) => take.transform(matrix, unit.0 as f32),
        Motion::Skeletal(moved) => moved.transform(matrix, unit.0 as f32).map_err(infinite)?,
    }
    Ok(Loaded { motion, format: format.name, unit, axes, doubts })
}

/// Motion as a scene of sticks, balls and axes ([`Scene::of_skeleton`], [`Scene::of_take`]).
///
/// # Errors
/// Where nothing of it is seen.
pub fn scene(motion: &Motion, path: &Path) -> Result<Scene, Error> {
    let scene = match motion {
        Motion::Captured(take) => Scene::of_take(take),
        Motion::Skeletal(moved) => Scene::of_skeleton(moved),
    };
    scene.map_err(|e| Error::invalid(Place::file(path), e.to_string()))
}

/// What motion is written as.
pub struct Written {
    /// For people.
    pub name: &'static str,
    /// What becomes of it.
    pub doc: &'static str,
    /// Lower case, without the dot.
    pub extension: &'static str,
    /// The bytes of a file; the path is for messages.
    pub write: fn(&Motion, &Path) -> Result<Vec<u8>, Error>,
}

/// Every format that motion is written in.
pub const WRITTEN: &[Written] = &[
    Written {
        name: "Biovision BVH",
        doc: "in centimetres",
        extension: "bvh",
        write: |motion, path| Ok(bvh::write(joints(motion, path)?, path)?.into_bytes()),
    },
    Written {
        name: "glTF 2.0",
        doc: "with a skin of sticks",
        extension: "glb",
        write: |motion, path| gltf::write(joints(motion, path)?, path),
    },
    Written {
        name: "Yugen CSV",
        doc: "in metres; joints become rigid bodies",
        extension: "csv",
        write: |motion, path| Ok(table::write(&*take(motion, path)?).into_bytes()),
    },
    Written {
        name: "C3D",
        doc: "in millimetres; joints become points and rigid bodies",
        extension: "c3d",
        write: |motion, path| match motion {
            Motion::Captured(take) => c3d::write(take, path),
            Motion::Skeletal(_) => {
                let mut take = take(motion, path)?.into_owned();
                take.markers = take.bodies.map(|b| b.position);
                c3d::write(&take, path)
            }
        },
    },
];

/// How motion is written to a file of this name.
pub fn written(path: &Path) -> Result<&'static Written, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    WRITTEN.iter().find(|w| w.extension == extension).ok_or_else(|| {
        let known = WRITTEN.iter().map(|w| w.extension);
        Error::unknown(Place::file(path), "extension for motion that is written", &extension, known)
    })
}

fn joints<'a>(motion: &'a Motion, path: &Path) -> Result<&'a SkeletalMotion, Error> {
    match motion {
        Motion::Skeletal(moved) => Ok(moved),
        Motion::Captured(_) => {
            let problem = "this format holds joints that carry one another, but markers and rigid bodies have none; write \
                           a .csv or .c3d";
            Err(Error::invalid(Place::file(path), problem))
        }
    }
}

fn take<'a>(motion: &'a Motion, path: &Path) -> Result<Cow<'a, Take>, Error> {
    match motion {
        Motion::Captured(take) => Ok(Cow::Borrowed(take)),
        Motion::Skeletal(moved) => {
            let take = moved.take().map_err(|e| Error::invalid(Place::file(path), e.to_string()))?;
            Ok(Cow::Owned(take))
        }
    }
}

/// The matrix that takes the file's axes to ours.
fn matrix(axes: Axes) -> Mat3 {
    Mat3::from_cols(axes.apply(Vec3::X), axes.apply(Vec3::Y), axes.apply(Vec3::Z))
}

/// A hand of a few markers, and a hall with several players, m.
const SIZES: std::ops::RangeInclusive<f64> = 0.02..=50.0;

/// How large what moves is in a typical frame, in the file's unit.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Median extents of the frames along the axes.
    pub extent: Vec3,
    /// The largest of them.
    pub height: f64,
}

impl Size {
    /// The axis along which it is by far the largest: a player stands.
    fn tallest(&self) -> Option<char> {
        let mut all = [(self.extent.x, 'x'), (self.extent.y, 'y'), (self.extent.z, 'z')];
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Arms spread are as wide as a person is tall; a tenth more tells them apart as rarely as it can be said.
        (all[0].0 > 1.3 * all[1].0).then_some(all[0].1)
    }

    /// The unit in which it is most nearly as large as a person, in metres.
    fn likely_unit(&self) -> f64 {
        let off = |unit: &f64| (self.height * unit / 1.7).max(1e-12).ln().abs();
        [1.0, 0.01, 0.001].into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(1.0)
    }
}

impl Motion {
    /// How many frames it has.
    pub fn frames(&self) -> usize {
        match self {
            Self::Captured(take) => take.frames(),
            Self::Skeletal(moved) => moved.frames,
        }
    }

    /// Everything that has a place in a frame.
    pub fn points(&self, frame: usize) -> Vec<Vec3> {
        match self {
            Self::Captured(take) => take.points(frame).collect(),
            Self::Skeletal(moved) => {
                let joints = moved.skeleton.to_skeleton(&moved.pose(frame)).unwrap_or_default();
                joints.iter().map(|j| j.w_axis.truncate()).collect()
            }
        }
    }

    /// How large what moves is.
    pub fn size(&self) -> Size {
        // So many frames spread over the take say it as well as all.
        const LOOKED_AT: usize = 64;
        let frames = self.frames().max(1);
        let mut extents: Vec<Vec3> = (0..frames.min(LOOKED_AT))
            .filter_map(|i| {
                let points = self.points(i * frames / frames.min(LOOKED_AT));
                let low = points.iter().copied().reduce(Vec3::min)?;
                Some(points.iter().copied().reduce(Vec3::max)? - low)
            })
            .filter(|e| e.is_finite())
            .collect();
        let mut middle = |axis: usize| {
            extents.sort_by(|a, b| a[axis].total_cmp(&b[axis]));
            extents.get(extents.len() / 2).map_or(0.0, |e| e[axis])
        };
        let extent = Vec3::new(middle(0), middle(1), middle(2));
        Size { extent, height: f64::from(extent.max_element()) }
    }
}

/// Frames a second: what the caller says, else the file.
fn rate(options: &Options, stated: Option<f64>, at: impl FnOnce() -> Place) -> Result<f64, Error> {
    let stated = stated.filter(|r| *r > 0.0 && r.is_finite());
    options.rate.or(stated).ok_or_else(|| {
        Error::invalid(
            at(),
            "the file does not say how many frames a second it has: give --rate, as in --rate 120",
        )
    })
}

#[cfg(test)]
mod tests;
