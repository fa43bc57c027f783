//! C3D (c3d.org): a header block, groups of parameters, then frames of points and analog samples; and the group ROTATION
//! of rigid bodies as 4x4 matrices in a section of its own.
//!
//! Numbers are those of the processor that wrote the file: Intel and MIPS (IEEE, least or most significant byte first) or
//! DEC. Where the scale is positive, points are 16-bit integers in its multiples, else floats. The fourth number of a
//! point holds the cameras that saw it in its high byte, its residual in its low one, and is -1 in a gap; a point at
//! exactly (0, 0, 0) is one, too. Parameters that a file lacks are taken from its header.

use super::{Basis, Conventions, Motion, Options, rate, unit};
use crate::formats::lp::Axes;
use crate::formats::support::Feature;
use crate::{Error, Place};
use glam::{Mat3, Quat, Vec3};
use std::collections::HashMap;
use std::path::Path;
use yugen_motion::{RigidPose, Take, Track, Tracks};

/// Groups of parameters.
pub const FEATURES: &[Feature] = &[
    Feature::partly("POINT", "positions, residuals and gaps; which cameras saw a point is left out"),
    Feature::yes("ROTATION"),
    Feature::partly("TRIAL", "the range of frames"),
    Feature::no("ANALOG", "forces and signals are stepped over"),
    Feature::no("FORCE_PLATFORM", "forces are not motion"),
    Feature::no("EVENT", "events name moments only"),
];

/// The blocks in which the format counts.
const BLOCK: usize = 512;
/// The byte that says that a file is C3D.
const KEY: u8 = 0x50;

/// Which machine wrote the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Processor {
    Intel,
    Dec,
    Mips,
}

impl Processor {
    fn i16(self, b: [u8; 2]) -> i16 {
        if self == Self::Mips { i16::from_be_bytes(b) } else { i16::from_le_bytes(b) }
    }

    fn f32(self, b: [u8; 4]) -> f32 {
        match self {
            Self::Intel => f32::from_le_bytes(b),
            Self::Mips => f32::from_be_bytes(b),
            // F_floating: words swapped; the exponent's bias is 129 where IEEE has 127, and there is neither a denormal
            // number nor infinity.
            Self::Dec => {
                let bits = u32::from_le_bytes([b[2], b[3], b[0], b[1]]);
                if bits & 0x7f80_0000 == 0 { 0.0 } else { f32::from_bits(bits) / 4.0 }
            }
        }
    }
}

/// A file and how its numbers are read.
struct File<'a> {
    bytes: &'a [u8],
    path: &'a Path,
    processor: Processor,
}

impl File<'_> {
    fn invalid(&self, at: usize, problem: impl Into<String>) -> Error {
        Error::invalid(Place::byte(self.path, at as u64), problem)
    }

    fn take<const N: usize>(&self, at: usize) -> Result<[u8; N], Error> {
        let found = self.bytes.get(at..).and_then(|b| b.first_chunk::<N>()).copied();
        found.ok_or_else(|| self.invalid(self.bytes.len(), "the file ends here, in the middle of its data"))
    }

    fn word(&self, at: usize) -> Result<u16, Error> {
        Ok(self.processor.i16(self.take(at)?) as u16)
    }

    fn float(&self, at: usize) -> Result<f32, Error> {
        Ok(self.processor.f32(self.take(at)?))
    }

    /// A word of the header, counted from 1 as its description does.
    fn header(&self, word: usize) -> Result<u16, Error> {
        self.word(2 * (word - 1))
    }
}

/// A parameter: numbers or texts.
#[derive(Clone, Debug, Default)]
struct Parameter {
    numbers: Vec<f64>,
    texts: Vec<String>,
}

type Parameters = HashMap<(String, String), Parameter>;

fn parameters(file: &File, start: usize) -> Result<Parameters, Error> {
    let mut groups: HashMap<i8, String> = HashMap::new();
    let mut raw: Vec<(i8, String, Parameter)> = Vec::new();
    let mut at = start + 4;
    loop {
        let [length, id] = file.take::<2>(at)?.map(|b| b as i8);
        // A locked name has a negative length.
        let length = usize::from(length.unsigned_abs());
        if length == 0 || id == 0 {
            break;
        }
        let name = file.bytes.get(at + 2..at + 2 + length).map(|n| String::from_utf8_lossy(n).to_uppercase());
        let Some(name) = name else {
            return Err(file.invalid(at, "the name of a parameter goes beyond the end of the file"));
        };
        let offset = at + 2 + length;
        let step = usize::from(file.word(offset)?);
        let mut end = offset + 2;
        if id < 0 {
            groups.insert(id, name);
        } else {
            let parameter = parameter(file, &mut end)?;
            raw.push((-id, name, parameter));
        }
        if step == 0 {
            break;
        }
        at = offset + step;
        if at < end {
            return Err(file.invalid(offset, "a parameter overlaps the next one"));
        }
    }
    Ok(raw
        .into_iter()
        .filter_map(|(group, name, p)| Some(((groups.get(&group)?.clone(), name), p)))
        .collect())
}

/// The parameter at `end`, which goes to where it ends.
fn parameter(file: &File, end: &mut usize) -> Result<Parameter, Error> {
    let at = *end;
    let [kind, count] = file.take::<2>(at)?;
    let sizes = file.bytes.get(at + 2..at + 2 + usize::from(count));
    let sizes =
        sizes.ok_or_else(|| file.invalid(at, "the sizes of a parameter go beyond the end of the file"))?;
    let start = at + 2 + sizes.len();
    let width = usize::from((kind as i8).unsigned_abs());
    if !matches!(kind as i8, -1 | 1 | 2 | 4) {
        return Err(
            file.invalid(at, format!("a parameter is of type {}; expected -1, 1, 2 or 4", kind as i8))
        );
    }
    let elements = sizes.iter().try_fold(1usize, |n, s| n.checked_mul(usize::from(*s)));
    let data = elements.and_then(|n| file.bytes.get(start..start.checked_add(n.checked_mul(width)?)?));
    let data = data.ok_or_else(|| file.invalid(at, "a parameter goes beyond the end of the file"))?;
    *end = start + data.len();
    let mut p = Parameter::default();
    if kind as i8 == -1 {
        let length = sizes.first().map_or(data.len(), |s| usize::from(*s));
        let text = |t: &[u8]| {
            let t = t.split(|b| *b == 0).next().unwrap_or_default();
            String::from_utf8_lossy(t).trim().to_string()
        };
        p.texts = data.chunks(length.max(1)).map(text).collect();
    } else {
        let number = |b: &[u8]| match *b {
            [a] => f64::from(a as i8),
            [a, b] => f64::from(file.processor.i16([a, b])),
            [a, b, c, d] => f64::from(file.processor.f32([a, b, c, d])),
            _ => 0.0,
        };
        p.numbers = data.chunks(width).map(number).collect();
    }
    Ok(p)
}

/// What a group says.
struct Group<'a>(&'a Parameters, &'a str);

impl<'a> Group<'a> {
    fn get(&self, name: &str) -> Option<&'a Parameter> {
        self.0.get(&(self.1.to_string(), name.to_string()))
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.get(name)?.numbers.first().copied()
    }

    /// A count that was written as a signed word and is none.
    fn count(&self, name: &str) -> Option<usize> {
        let n = self.number(name)?;
        let n = if (-32768.0..0.0).contains(&n) { n + 65536.0 } else { n };
        ((0.0..1e9).contains(&n) && n.fract() == 0.0).then_some(n as usize)
    }

    /// Two words, the low one first.
    fn long(&self, name: &str) -> Option<usize> {
        match *self.get(name)?.numbers.as_slice() {
            [low, high, ..] => Some(usize::from(low as i32 as u16) + (usize::from(high as i32 as u16) << 16)),
            _ => None,
        }
    }

    fn text(&self, name: &str) -> Option<&'a str> {
        self.get(name)?.texts.first().map(String::as_str).filter(|t| !t.is_empty())
    }

    /// LABELS, LABELS2 and so on, as many as are used.
    fn labels(&self, used: usize, what: &str) -> Vec<String> {
        let parts = (1..).map_while(|i| {
            self.get(&if i == 1 { "LABELS".to_string() } else { format!("LABELS{i}") })
                .map(|p| p.texts.iter())
        });
        let mut labels: Vec<String> = parts.flatten().take(used).cloned().collect();
        for i in 0..used {
            if i == labels.len() {
                labels.push(String::new());
            }
            if labels[i].is_empty() {
                labels[i] = format!("{what} {}", i + 1);
            }
        }
        labels
    }
}

/// Reads points and rigid bodies.
///
/// # Errors
/// With the byte: what is no C3D, counts that the file cannot hold or that contradict each other, rotations that are
/// none, no rate.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<(Motion, Conventions), Error> {
    let mut file = File { bytes, path, processor: Processor::Intel };
    let [block, key] = file.take(0)?;
    if key != KEY || block == 0 {
        let problem = format!("expected {KEY:#x} in the second byte of a C3D file, found {key:#x}");
        return Err(file.invalid(0, problem));
    }
    let start = (usize::from(block) - 1) * BLOCK;
    let [_, _, _, processor] = file.take(start)?;
    file.processor = match processor {
        84 => Processor::Intel,
        85 => Processor::Dec,
        86 => Processor::Mips,
        // Some writers leave it out; all of them run on Intel.
        0 => Processor::Intel,
        other => {
            let problem = format!("the processor is {other}; expected 84 (Intel), 85 (DEC) or 86 (MIPS)");
            return Err(file.invalid(start + 3, problem));
        }
    };
    let all = parameters(&file, start)?;
    let point = Group(&all, "POINT");

    let used = usize::from(file.header(2)?);
    if let Some(said) = point.count("USED").filter(|n| *n != used) {
        return Err(file.invalid(2, format!("the header has {used} points, the parameters {said}")));
    }
    let analog = usize::from(file.header(3)?);
    let scale = point.number("SCALE").map_or(file.float(12)?, |s| s as f32);
    if !scale.is_finite() || (scale == 0.0 && used > 0) {
        return Err(
            file.invalid(12, format!("the scale of the points is {scale}; expected a number other than 0"))
        );
    }
    let floats = scale < 0.0;
    let width = if floats { 4 } else { 2 };
    let stated = point.number("RATE").filter(|r| *r > 0.0).unwrap_or(f64::from(file.float(20)?));
    let rate = rate(options, Some(stated), || Place::byte(path, 20))?;
    let data = point.count("DATA_START").filter(|b| *b > 0).unwrap_or(usize::from(file.header(9)?));
    let data = data.saturating_sub(1) * BLOCK;
    let frame = width * (4 * used + analog);
    let rotation = Rotations::of(&file, &all, rate)?;
    let end = rotation.as_ref().map_or(bytes.len(), |r| if r.start > data { r.start } else { bytes.len() });
    let fits = end.min(bytes.len()).saturating_sub(data).checked_div(frame);
    let (first, frames) = frames(&file, &all, fits)?;

    let mut take = Take::default();
    let begin = (first.max(1) - 1) as f64 / rate;
    if used > 0 && frames > 0 {
        let track =
            |name| Track { name, samples: Vec::with_capacity(frames), residuals: Vec::with_capacity(frames) };
        let labels = point.labels(used, "point");
        take.markers = Tracks { rate, start: begin, frames, tracks: labels.into_iter().map(track).collect() };
        for f in 0..frames {
            for (i, marker) in take.markers.tracks.iter_mut().enumerate() {
                let at = data + f * frame + 4 * i * width;
                let (sample, residual) = sample(&file, at, scale)?;
                marker.samples.push(sample);
                marker.residuals.push(residual);
            }
        }
        for marker in &mut take.markers.tracks {
            if marker.residuals.iter().all(|r| *r == 0.0) {
                marker.residuals = Vec::new();
            }
        }
    }
    if let Some(rotation) = rotation {
        take.bodies = rotation.read(&file, &all, frames, begin)?;
    }
    if take.frames() == 0 {
        return Err(file.invalid(0, "there is neither a point nor a rigid body in this file"));
    }
    let unit = match point.text("UNITS") {
        None => None,
        Some(word) => Some(unit(word).ok_or_else(|| {
            let known = super::UNITS.iter().map(|(name, _)| *name);
            Error::unknown(Place::byte(path, start as u64), "unit in POINT:UNITS", word, known)
        })?),
    };
    let axes = match (point.text("X_SCREEN"), point.text("Y_SCREEN")) {
        (Some(x), Some(y)) => screen(x, y).map(|a| (a, Basis::Stated)),
        _ => None,
    };
    Ok((Motion::Captured(take), Conventions { unit, axes }))
}

/// The number of the first frame and how many there are, of which `fits` are in the file (`None`: any number).
fn frames(file: &File, all: &Parameters, fits: Option<usize>) -> Result<(usize, usize), Error> {
    let (first, last) = (usize::from(file.header(4)?), usize::from(file.header(5)?));
    let trial = Group(all, "TRIAL");
    let range = trial.long("ACTUAL_START_FIELD").zip(trial.long("ACTUAL_END_FIELD"));
    let point = Group(all, "POINT");
    // A word ends at 65535, and then says nothing.
    let said = [
        range.and_then(|(a, b)| (b + 1).checked_sub(a)),
        point.count("LONG_FRAMES"),
        point.count("FRAMES").filter(|n| *n != 65535),
        (last + 1).checked_sub(first).filter(|_| last != 65535),
    ];
    let said: Vec<usize> = said.into_iter().flatten().filter(|n| *n > 0).collect();
    let first = range.map_or(first, |(a, _)| a);
    let Some(most) = said.iter().copied().max() else { return Ok((first, 0)) };
    let Some(fits) = fits else { return Ok((first, most)) };
    // Where they differ, what the file has room for is true.
    match said.iter().copied().filter(|n| *n <= fits).max() {
        Some(frames) => Ok((first, frames)),
        None => {
            let problem =
                format!("{most} frames are announced, but there are {fits}; the file may be cut off");
            Err(file.invalid(file.bytes.len(), problem))
        }
    }
}

/// A point and its residual.
fn sample(file: &File, at: usize, scale: f32) -> Result<(Option<Vec3>, f32), Error> {
    let mut p = Vec3::ZERO;
    // The fourth number as a whole number; what is none hides nothing.
    let fourth = if scale < 0.0 {
        for axis in 0..3 {
            p[axis] = file.float(at + 4 * axis)?;
        }
        file.float(at + 12)? as i32
    } else {
        for axis in 0..3 {
            p[axis] = scale * f32::from(file.word(at + 2 * axis)? as i16);
        }
        i32::from(file.word(at + 6)? as i16)
    };
    let seen = fourth >= 0 && p.is_finite() && p != Vec3::ZERO;
    let residual = if seen { (fourth & 0xff) as f32 * scale.abs() } else { 0.0 };
    Ok((seen.then_some(p), residual))
}

/// The axes of a file that says which of them go to the right and up on a screen, as `+X` and `+Z`.
fn screen(right: &str, up: &str) -> Option<Axes> {
    let axis = |text: &str| {
        let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
        let letter = text.trim_start_matches(['+', '-']).to_lowercase();
        Some(Vec3::AXES["xyz".find(letter.as_str()).filter(|_| letter.len() == 1)?] * sign)
    };
    let (right, up) = (axis(right)?, axis(up)?);
    let rows = [right, up, right.cross(up)];
    // The name of each of the file's axes in ours.
    let names = (0..3).map(|file| {
        let ours = rows.iter().position(|r| r[file] != 0.0)?;
        Some(format!("{}{}", if rows[ours][file] < 0.0 { "-" } else { "" }, ["x", "y", "z"][ours]))
    });
    names.collect::<Option<Vec<String>>>()?.join(" ").parse().ok()
}

/// The section of rigid bodies.
struct Rotations {
    start: usize,
    used: usize,
    /// Frames of bodies in one of points.
    ratio: f64,
    rate: f64,
}

impl Rotations {
    /// Numbers of a body: a 4x4 matrix, column after column, and how well it is known.
    const WIDTH: usize = 17;

    fn of(file: &File, all: &Parameters, rate: f64) -> Result<Option<Self>, Error> {
        let group = Group(all, "ROTATION");
        let used = group.count("USED").unwrap_or(0);
        if used == 0 {
            return Ok(None);
        }
        let Some(block) = group.count("DATA_START").filter(|b| *b > 0) else {
            return Err(file.invalid(0, "ROTATION has no DATA_START, so nobody knows where its bodies are"));
        };
        let positive = |name| group.number(name).filter(|n| *n > 0.0 && n.is_finite());
        let ratio = match (positive("RATIO"), positive("RATE")) {
            (Some(ratio), _) => ratio,
            (None, Some(own)) => own / rate,
            // Nothing else is said: as the points.
            (None, None) => 1.0,
        };
        Ok(Some(Self { start: (block - 1) * BLOCK, used, ratio, rate: rate * ratio }))
    }

    fn read(
        &self,
        file: &File,
        all: &Parameters,
        points: usize,
        start: f64,
    ) -> Result<Tracks<RigidPose>, Error> {
        let size = 4 * Self::WIDTH * self.used;
        let frames = (points as f64 * self.ratio).round() as usize;
        let fits = file.bytes.len().saturating_sub(self.start) / size;
        if frames == 0 {
            return Ok(Tracks::default());
        }
        if frames > fits {
            let problem =
                format!("{frames} frames of {} rigid bodies are announced, but there are {fits}", self.used);
            return Err(file.invalid(self.start, problem));
        }
        let labels = Group(all, "ROTATION").labels(self.used, "body");
        let mut tracks: Vec<Track<RigidPose>> = labels.into_iter().map(Track::new).collect();
        for f in 0..frames {
            for (i, body) in tracks.iter_mut().enumerate() {
                let at = self.start + f * size + 4 * Self::WIDTH * i;
                let mut m = [0.0; Self::WIDTH];
                for (k, value) in m.iter_mut().enumerate() {
                    *value = file.float(at + 4 * k)?;
                }
                let axes = Mat3::from_cols_slice(&[m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]]);
                let position = Vec3::new(m[12], m[13], m[14]);
                let seen = m[16] >= 0.0 && axes.is_finite() && position.is_finite() && axes != Mat3::ZERO;
                let pose = if seen {
                    let rotation = rotation(axes).ok_or_else(|| {
                        file.invalid(
                            at,
                            format!("the matrix of '{}' in frame {} is no rotation", body.name, f + 1),
                        )
                    })?;
                    Some(RigidPose { position, rotation })
                } else {
                    None
                };
                body.samples.push(pose);
                body.residuals.push(if seen { m[16] } else { 0.0 });
            }
        }
        for body in &mut tracks {
            if body.residuals.iter().all(|r| *r == 0.0) {
                body.residuals = Vec::new();
            }
        }
        Ok(Tracks { rate: self.rate, start, frames, tracks })
    }
}

/// The rotation of a matrix, `None` where its axes are not upright to each other and of length 1 within a hundredth.
fn rotation(axes: Mat3) -> Option<Quat> {
    let off = (axes.transpose() * axes - Mat3::IDENTITY).to_cols_array();
    let fits = off.iter().all(|v| v.abs() < 0.01) && axes.determinant() > 0.0;
    fits.then(|| Quat::from_mat3(&axes).normalize())
}

/// Parameters as bytes, group after group.
#[derive(Default)]
struct Section {
    bytes: Vec<u8>,
    groups: i8,
}

impl Section {
    fn group(&mut self, name: &str) {
        self.groups -= 1;
        self.entry(name, self.groups, &[]);
    }

    /// In the group begun last.
    fn parameter(&mut self, name: &str, kind: i8, sizes: &[u8], data: &[u8]) {
        let body = [&[kind as u8, sizes.len() as u8], sizes, data].concat();
        self.entry(name, -self.groups, &body);
    }

    fn entry(&mut self, name: &str, id: i8, body: &[u8]) {
        self.bytes.extend([name.len() as u8, id as u8]);
        self.bytes.extend(name.as_bytes());
        // To the next entry from here; an empty description closes this one.
        self.bytes.extend((body.len() as u16 + 3).to_le_bytes());
        self.bytes.extend(body);
        self.bytes.push(0);
    }

    fn words(&mut self, name: &str, words: &[u16]) {
        let data: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let sizes = [words.len() as u8];
        self.parameter(name, 2, if words.len() == 1 { &[] } else { &sizes }, &data);
    }

    fn float(&mut self, name: &str, value: f32) {
        self.parameter(name, 4, &[], &value.to_le_bytes());
    }

    fn text(&mut self, name: &str, text: &str) {
        self.parameter(name, -1, &[text.len() as u8], text.as_bytes());
    }

    /// LABELS, LABELS2 and so on: a list has 255 at most, and a label as many bytes.
    fn labels<'n>(&mut self, names: impl Iterator<Item = &'n str>) {
        let names: Vec<&[u8]> = names.map(|n| &n.as_bytes()[..n.len().min(255)]).collect();
        for (i, part) in names.chunks(255).enumerate() {
            let longest = part.iter().map(|n| n.len()).max().unwrap_or(0);
            let data: Vec<u8> = part
                .iter()
                .flat_map(|n| n.iter().copied().chain(std::iter::repeat_n(b' ', longest - n.len())))
                .collect();
            let name = if i == 0 { "LABELS".to_string() } else { format!("LABELS{}", i + 1) };
            self.parameter(&name, -1, &[longest as u8, part.len() as u8], &data);
        }
    }
}

/// What numbers of a written file are in, to the metre.
const PER_METRE: f32 = 1000.0;

/// The bytes of a file of this take, which is in metres with +y up: millimetres in Intel's floats, the bodies in the
/// group ROTATION.
///
/// # Errors
/// Where the format has no place for it: bodies at a rate that is no multiple of the markers', more of them than it
/// counts.
pub fn write(take: &Take, path: &Path) -> Result<Vec<u8>, Error> {
    let cannot = |problem: String| Error::invalid(Place::file(path), problem);
    let (markers, bodies) = (&take.markers, &take.bodies);
    let (frames, rate, start) = match markers.frames {
        0 => (bodies.frames, bodies.rate, bodies.start),
        n => (n, markers.rate, markers.start),
    };
    let ratio = if bodies.tracks.is_empty() { 1.0 } else { (bodies.rate / rate).round() };
    let even = ratio >= 1.0 && (ratio * rate - bodies.rate).abs() < 1e-6 * bodies.rate;
    let even = even && bodies.frames == frames * ratio as usize;
    if !bodies.tracks.is_empty() && !even {
        return Err(cannot(format!(
            "C3D has so many frames of bodies for each of markers, but here are {} at {} a second, and {frames} at {rate}",
            bodies.frames, bodies.rate
        )));
    }
    let tracks = markers.tracks.len().max(bodies.tracks.len());
    if tracks > 32767 || ratio > 32767.0 {
        return Err(cannot(format!("C3D counts up to 32767 markers or bodies, but here are {tracks}")));
    }
    let first = (start * rate).round().max(0.0) as u64 + 1;
    let last = first + frames as u64 - 1;
    if u32::try_from(last).is_err() {
        return Err(cannot(format!("C3D counts frames in 32 bits, and the last has the number {last}")));
    }
    let word = |n: u64| u16::try_from(n).unwrap_or(u16::MAX);
    let residuals = markers.tracks.iter().flat_map(|t| &t.residuals).copied().fold(0.0, f32::max);
    // Residuals have a byte; without any the scale is of no matter.
    let scale = if residuals > 0.0 { residuals * PER_METRE / 255.0 } else { 1.0 };

    // Where data begin depends on how long the parameters are, not on what they say.
    let section = |data: u16, rotation: u16| {
        let mut s = Section::default();
        s.group("POINT");
        s.words("USED", &[markers.tracks.len() as u16]);
        s.words("FRAMES", &[word(frames as u64)]);
        s.words("DATA_START", &[data]);
        s.float("SCALE", -scale);
        s.float("RATE", rate as f32);
        s.text("UNITS", "mm");
        s.text("X_SCREEN", "+X");
        s.text("Y_SCREEN", "+Y");
        s.labels(markers.tracks.iter().map(|t| t.name.as_str()));
        s.group("TRIAL");
        s.words("ACTUAL_START_FIELD", &long_words(first));
        s.words("ACTUAL_END_FIELD", &long_words(last));
        s.group("ANALOG");
        s.words("USED", &[0]);
        if !bodies.tracks.is_empty() {
            s.group("ROTATION");
            s.words("USED", &[bodies.tracks.len() as u16]);
            s.words("DATA_START", &[rotation]);
            s.words("RATIO", &[ratio as u16]);
            s.float("RATE", bodies.rate as f32);
            s.labels(bodies.tracks.iter().map(|t| t.name.as_str()));
        }
        s.bytes.extend([0, 0]);
        s.bytes
    };
    let blocks = |bytes: usize| bytes.div_ceil(BLOCK);
    let parameters = blocks(4 + section(0, 0).len());
    let data = 2 + parameters;
    let points = 16 * markers.tracks.len() * frames;
    let rotation = data + blocks(points);
    if parameters > 255 || (!bodies.tracks.is_empty() && rotation > usize::from(u16::MAX)) {
        return Err(cannot("C3D has no room for so many names and frames; write a CSV".into()));
    }

    let mut out = Vec::with_capacity((rotation + 1) * BLOCK + 68 * bodies.tracks.len() * bodies.frames);
    let mut header = [0u16; BLOCK / 2];
    header[0] = u16::from_le_bytes([2, KEY]);
    header[1] = markers.tracks.len() as u16;
    (header[3], header[4]) = (word(first), word(last));
    let float = |v: f32| [v.to_bits() as u16, (v.to_bits() >> 16) as u16];
    [header[6], header[7]] = float(-scale);
    header[8] = data as u16;
    [header[10], header[11]] = float(rate as f32);
    out.extend(header.iter().flat_map(|w| w.to_le_bytes()));
    out.extend([1, KEY, parameters as u8, 84]);
    out.extend(section(data as u16, rotation as u16));
    out.resize((data - 1) * BLOCK, 0);
    for f in 0..frames {
        for marker in &markers.tracks {
            let residual = marker.residuals.get(f).map_or(0.0, |r| (r * PER_METRE / scale).round());
            let numbers = match marker.samples.get(f).copied().flatten() {
                Some(p) => (p * PER_METRE).extend(residual).to_array(),
                None => [0.0, 0.0, 0.0, -1.0],
            };
            out.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    if !bodies.tracks.is_empty() {
        out.resize((rotation - 1) * BLOCK, 0);
        for f in 0..bodies.frames {
            for body in &bodies.tracks {
                let (matrix, known) = match body.samples.get(f).copied().flatten() {
                    Some(p) => {
                        let m = glam::Mat4::from_rotation_translation(p.rotation, p.position * PER_METRE);
                        (m, body.residuals.get(f).map_or(0.0, |r| r * PER_METRE))
                    }
                    None => (glam::Mat4::ZERO, -1.0),
                };
                let numbers = matrix.to_cols_array().into_iter().chain([known]);
                out.extend(numbers.flat_map(f32::to_le_bytes));
            }
        }
    }
    out.resize(blocks(out.len()) * BLOCK, 0);
    Ok(out)
}

/// Two words, the low one first.
fn long_words(n: u64) -> [u16; 2] {
    [n as u16, (n >> 16) as u16]
}

#[cfg(test)]
mod tests;
