//! A dance of Noh from a list of its units of form, as a katatsuke notes one: stance (kamae), walk with sliding steps
//! (hakobi), pointing forward (sashikomi), opening (hiraki), turning, and a sleeve thrown back (Oshita et al. 2013,
//! "Development of an easy-to-use authoring system for Noh (Japanese traditional) dance animation").
//!
//! ```text
//! kamae seconds=2
//! hakobi steps=6 length=.3
//! sashikomi
//! hiraki
//! turn degrees=90
//! sleeve side=left
//! ```
//! Feet slide on the floor and are turned to where the body goes; the hips go between them at one height; legs follow by
//! two bones each. Arms and trunk go from pose to pose with the least jerk. The player faces +z and has +x to the left.

use crate::solve::PERFORMER;
use crate::{
    Joint, Placement, Property, RigidPose, SkeletalMotion, Skeleton, Take, Track, Tracks, Transform,
    continuous, sampled, seconds,
};
use glam::{Mat3, Quat, Vec3};
use yugen_optics::random::Pcg32;

/// Where the joint of each of [`PERFORMER`] is in its carrier, m: a person of 1.7 m with the arms spread.
pub const BONES: [[f32; 3]; 19] = [
    [0.0, 0.95, 0.0],
    [0.0, 0.12, 0.0],
    [0.0, 0.17, 0.01],
    [0.0, 0.22, -0.01],
    [0.0, 0.10, 0.02],
    [0.03, 0.16, 0.03],
    [0.15, 0.02, -0.03],
    [0.29, 0.0, 0.0],
    [0.25, 0.0, 0.0],
    [-0.03, 0.16, 0.03],
    [-0.15, 0.02, -0.03],
    [-0.29, 0.0, 0.0],
    [-0.25, 0.0, 0.0],
    [0.09, -0.05, 0.0],
    [0.0, -0.42, 0.0],
    [0.0, -0.40, 0.0],
    [-0.09, -0.05, 0.0],
    [0.0, -0.42, 0.0],
    [0.0, -0.40, 0.0],
];
/// Where what carries nothing ends, of head, hands and feet.
const ENDS: [(usize, [f32; 3]); 5] = [
    (4, [0.0, 0.18, 0.0]),
    (8, [0.17, 0.0, 0.0]),
    (12, [-0.17, 0.0, 0.0]),
    (15, [0.0, -0.06, 0.15]),
    (18, [0.0, -0.06, 0.15]),
];
const LEFT: usize = 0;
const RIGHT: usize = 1;
/// Thigh, shank and foot of both sides.
const LEGS: [[usize; 3]; 2] = [[13, 14, 15], [16, 17, 18]];

/// The ankle above the sole, and before the heel, m.
const ANKLE: [f32; 2] = [0.08, 0.05];
/// The hips of a player are low: so high are they over the floor, m.
const HIPS: f32 = 0.90;
/// Half the distance of the feet, m.
const STANCE: f32 = 0.08;
/// How far the toes come up at the end of a step, rad.
const TOES: f32 = 0.12;

/// Turns of joints about x, then z, then y of their rests, degrees; of the left, which the right mirrors.
type Turns = &'static [(&'static str, [f32; 3])];

/// A pose of trunk and arms: for both sides, then what the right has of its own.
struct Form {
    both: Turns,
    right: Turns,
    left: Turns,
}

const ARMS: Turns = &[
    ("waist", [4.0, 0.0, 0.0]),
    ("chest", [2.0, 0.0, 0.0]),
    ("neck", [-3.0, 0.0, 0.0]),
    ("head", [-3.0, 0.0, 0.0]),
    ("upper_arm", [0.0, -38.0, -52.0]),
    ("forearm", [0.0, -48.0, 0.0]),
    ("hand", [0.0, -6.0, 0.0]),
];
/// The stance: arms round before the body.
const KAMAE: Form = Form { both: ARMS, right: &[], left: &[] };
/// The right arm points forward at the height of the shoulder.
const POINTING: Form = Form {
    both: ARMS,
    right: &[
        ("clavicle", [0.0, -8.0, 0.0]),
        ("upper_arm", [0.0, -78.0, -8.0]),
        ("forearm", [0.0, -10.0, 0.0]),
    ],
    left: &[],
};
/// Both arms open to the sides and a little back.
const OPEN: Form = Form {
    both: &[
        ("waist", [2.0, 0.0, 0.0]),
        ("chest", [-2.0, 0.0, 0.0]),
        ("neck", [-1.0, 0.0, 0.0]),
        ("head", [-1.0, 0.0, 0.0]),
        ("clavicle", [0.0, 4.0, 0.0]),
        ("upper_arm", [0.0, -12.0, -28.0]),
        ("forearm", [0.0, -18.0, 6.0]),
        ("hand", [0.0, 0.0, 0.0]),
    ],
    right: &[],
    left: &[],
};
/// An arm goes up to the side, its hand turned out; then its forearm comes over.
const SLEEVE: [Turns; 2] = [
    &[
        ("clavicle", [0.0, 0.0, 6.0]),
        ("upper_arm", [35.0, -20.0, 10.0]),
        ("forearm", [0.0, -15.0, 10.0]),
        ("hand", [20.0, 0.0, 0.0]),
    ],
    &[
        ("clavicle", [0.0, -4.0, 8.0]),
        ("upper_arm", [-40.0, -30.0, 14.0]),
        ("forearm", [0.0, -95.0, 35.0]),
        ("hand", [-20.0, -15.0, 0.0]),
    ],
];

/// A number of a unit of form.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// As it is written.
    pub name: &'static str,
    /// Where it is not.
    pub default: f32,
    /// What it may be.
    pub range: [f32; 2],
    /// For people.
    pub doc: &'static str,
}

const fn parameter(name: &'static str, default: f32, low: f32, high: f32, doc: &'static str) -> Parameter {
    Parameter { name, default, range: [low, high], doc }
}

const SECONDS: Parameter =
    parameter("seconds", 1.2, 0.2, 60.0, "of each step, or of the whole where there is none");
const STEPS: Parameter = parameter("steps", 4.0, 1.0, 200.0, "how many; the feet take turns");
const LENGTH: Parameter = parameter("length", 0.28, -0.6, 0.6, "of a step, m; below 0 it goes back");

/// The units of form: names, numbers, and what they are.
pub const UNITS: [(&str, &[Parameter], &str); 6] = [
    ("kamae", &[parameter("seconds", 1.5, 0.2, 600.0, "how long")], "stands, the arms round before the body"),
    (
        "hakobi",
        &[
            STEPS,
            LENGTH,
            SECONDS,
            parameter("degrees", 0.0, -180.0, 180.0, "how far the path bends to the left, in all"),
        ],
        "walks with sliding steps",
    ),
    (
        "sashikomi",
        &[parameter("steps", 3.0, 1.0, 20.0, "how many"), LENGTH, SECONDS],
        "goes forward while the right arm comes up and points",
    ),
    (
        "hiraki",
        &[
            parameter("steps", 3.0, 1.0, 20.0, "how many, back"),
            parameter("length", 0.18, 0.0, 0.6, "of a step, m"),
            SECONDS,
        ],
        "goes back while the arms open to the sides",
    ),
    (
        "turn",
        &[parameter("degrees", 90.0, -720.0, 720.0, "to the left"), SECONDS],
        "turns where it stands, step by step",
    ),
    (
        "sleeve",
        &[
            parameter("side", 1.0, 0.0, 1.0, "left is 0, right 1, or in words"),
            parameter("seconds", 3.0, 0.5, 60.0, "of the whole"),
        ],
        "throws a sleeve over the arm and lets it fall",
    ),
];

/// A unit of form with its numbers, in the order of its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Index in [`UNITS`].
    pub form: usize,
    /// One for each parameter.
    pub values: Vec<f32>,
}

/// What is wrong with a list.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct DanceError {
    /// From one.
    pub line: usize,
    /// What was found and what was expected.
    pub problem: String,
}

/// Reads a list of units, one a line; what follows a # is for people.
pub fn parse(text: &str) -> Result<Vec<Unit>, DanceError> {
    let mut units = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let wrong = |problem: String| DanceError { line: i + 1, problem };
        let mut words = line.split('#').next().unwrap_or_default().split_whitespace();
        let Some(name) = words.next() else { continue };
        let form = UNITS.iter().position(|(n, ..)| *n == name).ok_or_else(|| {
            let names: Vec<&str> = UNITS.iter().map(|(n, ..)| *n).collect();
            wrong(format!("'{}' is no unit of form; expected one of {}", short(name), names.join(", ")))
        })?;
        let parameters = UNITS[form].1;
        let mut values: Vec<f32> = parameters.iter().map(|p| p.default).collect();
        for word in words {
            let pair = word.split_once('=');
            let at = pair.and_then(|(key, _)| parameters.iter().position(|p| p.name == key));
            let (Some((_, value)), Some(at)) = (pair, at) else {
                let names: Vec<String> =
                    parameters.iter().map(|p| format!("{}={}", p.name, p.default)).collect();
                return Err(wrong(format!(
                    "'{}' says nothing of {name}; it has {}",
                    short(word),
                    names.join(", ")
                )));
            };
            let number = match value {
                "left" => Some(0.0),
                "right" => Some(1.0),
                _ => value.parse().ok(),
            };
            let [low, high] = parameters[at].range;
            let number = number.filter(|v: &f32| (low..=high).contains(v));
            values[at] = number.ok_or_else(|| {
                wrong(format!(
                    "'{}' of {name} is '{}'; expected {low} to {high}",
                    parameters[at].name,
                    short(value)
                ))
            })?;
        }
        units.push(Unit { form, values });
    }
    if units.is_empty() {
        return Err(DanceError { line: 1, problem: "there is no unit of form in this list".into() });
    }
    Ok(units)
}

fn short(word: &str) -> String {
    word.chars().take(40).collect()
}

/// Where a foot stands: its ankle's place on the floor, and to where it points (about y from +z to +x, rad).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Foot {
    at: Vec3,
    heading: f32,
}

/// What happens from one time to another.
struct Change<T> {
    from: f32,
    to: f32,
    /// At its end.
    target: T,
}

/// The list as times: where feet go, and which poses the rest takes.
struct Plan {
    now: f32,
    feet: [Vec<Change<Foot>>; 2],
    poses: Vec<Change<Vec<Quat>>>,
    /// Which foot is next.
    next: usize,
}

/// The way from 0 to 1 with the least jerk (Flash and Hogan 1985).
fn least_jerk(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

fn facing(heading: f32) -> Quat {
    Quat::from_rotation_y(heading)
}

/// Of the joints by their names, in the order of [`PERFORMER`].
fn posed(form: &Form, more: &[(usize, Turns)]) -> Vec<Quat> {
    let mut turns = vec![Quat::IDENTITY; 19];
    let mut set = |list: Turns, sides: &[usize]| {
        for (name, [x, y, z]) in list {
            for (i, (joint, _)) in PERFORMER.iter().enumerate() {
                let mirrored = match joint.split_once('_') {
                    Some(("left", rest)) if rest == *name && sides.contains(&LEFT) => 1.0,
                    Some(("right", rest)) if rest == *name && sides.contains(&RIGHT) => -1.0,
                    None if joint == name => 1.0,
                    _ => continue,
                };
                let [x, y, z] = [*x, y * mirrored, z * mirrored].map(f32::to_radians);
                turns[i] = Quat::from_rotation_y(y) * Quat::from_rotation_z(z) * Quat::from_rotation_x(x);
            }
        }
    };
    set(form.both, &[LEFT, RIGHT]);
    set(form.left, &[LEFT]);
    set(form.right, &[RIGHT]);
    for (side, list) in more {
        set(list, &[*side]);
    }
    turns
}

impl Plan {
    fn new() -> Self {
        let foot = |side: f32| Foot { at: Vec3::X * (STANCE * side), heading: 0.0 };
        let stand = |foot| vec![Change { from: 0.0, to: 0.0, target: foot }];
        Self {
            now: 0.0,
            feet: [stand(foot(1.0)), stand(foot(-1.0))],
            poses: vec![Change { from: 0.0, to: 0.0, target: posed(&KAMAE, &[]) }],
            next: LEFT,
        }
    }

    fn foot(&self, side: usize) -> Foot {
        self.feet[side].last().map_or(Foot { at: Vec3::ZERO, heading: 0.0 }, |c| c.target)
    }

    /// Where the middle of the feet is, and to where the body faces.
    fn middle(&self) -> Foot {
        let [l, r] = [self.foot(LEFT), self.foot(RIGHT)];
        Foot { at: 0.5 * (l.at + r.at), heading: 0.5 * (l.heading + r.heading) }
    }

    /// One foot goes to its side of a place, pointing to a heading.
    fn step(&mut self, middle: Foot, seconds: f32) {
        let side = self.next;
        let across = if side == LEFT { STANCE } else { -STANCE };
        let at = middle.at + facing(middle.heading) * (Vec3::X * across);
        let target = Foot { at, heading: middle.heading };
        // A foot stands for a little before the other goes.
        self.feet[side].push(Change { from: self.now, to: self.now + 0.9 * seconds, target });
        self.now += seconds;
        self.next = 1 - side;
    }

    /// Steps along an arc; the feet come together in the end.
    fn walk(&mut self, steps: f32, length: f32, degrees: f32, seconds: f32) {
        let count = steps.round().max(1.0) as usize;
        let mut at = self.middle();
        let bend = degrees.to_radians() / count as f32;
        for _ in 0..count {
            at.heading += bend;
            at.at += facing(at.heading) * (Vec3::Z * length);
            self.step(at, seconds);
        }
        self.step(at, seconds);
    }

    fn pose(&mut self, from: f32, to: f32, target: Vec<Quat>) {
        self.poses.push(Change { from, to, target });
    }

    fn add(&mut self, unit: &Unit) {
        let began = self.now;
        let v = &unit.values;
        match UNITS[unit.form].0 {
            "kamae" => {
                self.now += v[0];
                // No slower than a breath.
                self.pose(began, began + v[0].min(1.5), posed(&KAMAE, &[]));
            }
            "hakobi" => self.walk(v[0], v[1], v[3], v[2]),
            "sashikomi" => {
                self.walk(v[0], v[1], 0.0, v[2]);
                self.pose(began, self.now, posed(&POINTING, &[]));
            }
            "hiraki" => {
                self.walk(v[0], -v[1], 0.0, v[2]);
                self.pose(began, self.now, posed(&OPEN, &[]));
            }
            "turn" => {
                // A foot turns by 45 degrees without leaving the other behind.
                let steps = (v[0].abs() / 45.0).ceil().max(1.0);
                self.walk(steps, 0.0, v[0], v[1]);
            }
            _ => {
                let side = if v[0] < 0.5 { LEFT } else { RIGHT };
                let third = v[1] / 3.0;
                for (i, turns) in SLEEVE.iter().enumerate() {
                    let from = began + i as f32 * third;
                    self.pose(from, from + third, posed(&KAMAE, &[(side, turns)]));
                }
                self.pose(began + 2.0 * third, began + v[1], posed(&KAMAE, &[]));
                self.now += v[1];
            }
        }
    }

    /// A foot at a time, and how far its toes are up, rad.
    fn foot_at(&self, side: usize, t: f32) -> (Foot, f32) {
        let all = &self.feet[side];
        let begun = all.partition_point(|c| c.from <= t).max(1) - 1;
        let (last, before) = (&all[begun], &all[begun.saturating_sub(1)]);
        if last.to <= t {
            return (last.target, 0.0);
        }
        let part = (t - last.from) / (last.to - last.from);
        let s = least_jerk(part);
        let foot = Foot {
            at: before.target.at.lerp(last.target.at, s),
            heading: before.target.heading + s * (last.target.heading - before.target.heading),
        };
        // In the last two fifths, up and down.
        let up = ((part - 0.6) / 0.4).clamp(0.0, 1.0);
        (foot, TOES * (std::f32::consts::PI * up).sin().powi(2))
    }

    fn pose_at(&self, t: f32) -> Vec<Quat> {
        let mut turns = self.poses[0].target.clone();
        for change in self.poses.iter().take_while(|c| c.from <= t) {
            let s = if change.to > change.from {
                least_jerk((t - change.from) / (change.to - change.from))
            } else {
                1.0
            };
            for (turn, target) in turns.iter_mut().zip(&change.target) {
                *turn = turn.slerp(*target, s);
            }
        }
        turns
    }
}

/// The skeleton of the player: [`PERFORMER`], and where head, hands and feet end.
pub fn player() -> Vec<Joint> {
    let at = |b: [f32; 3]| Placement::Parts(Transform { translation: Vec3::from(b), ..Transform::IDENTITY });
    let carrier = |name: &str| PERFORMER.iter().position(|(n, _)| *n == name);
    let joints = PERFORMER.iter().zip(BONES).map(|((name, parent), bone)| Joint {
        name: (*name).into(),
        parent: carrier(parent),
        rest: at(bone),
    });
    let ends = ENDS.iter().map(|(of, bone)| Joint {
        name: format!("{} end", PERFORMER[*of].0),
        parent: Some(*of),
        rest: at(*bone),
    });
    joints.chain(ends).collect()
}

/// Dances a list, at so many frames a second.
///
/// # Errors
/// Where times or joints are none, which a list within its ranges has not.
pub fn dance(units: &[Unit], rate: f64) -> Result<SkeletalMotion, String> {
    let mut plan = Plan::new();
    units.iter().for_each(|u| plan.add(u));
    let frames = (f64::from(plan.now) * rate).floor() as usize + 1;
    let mut root = Vec::with_capacity(3 * frames);
    let mut turns: Vec<Vec<Quat>> = vec![Vec::new(); 19];
    for frame in 0..frames {
        let t = seconds(frame, rate);
        let feet = [LEFT, RIGHT].map(|side| plan.foot_at(side, t));
        let (l, r) = (feet[LEFT].0, feet[RIGHT].0);
        let place = (0.5 * (l.at + r.at)).with_y(HIPS);
        let pelvis = facing(0.5 * (l.heading + r.heading));
        let mut pose = plan.pose_at(t);
        pose[0] = pelvis;
        for (side, (foot, toes)) in feet.into_iter().enumerate() {
            let hip = place + pelvis * Vec3::from(BONES[LEGS[side][0]]);
            leg(&mut pose, LEGS[side], hip, foot, toes, pelvis);
        }
        root.extend(place.to_array());
        for (turns, turn) in turns.iter_mut().zip(pose) {
            turns.push(turn.normalize());
        }
    }
    let mut channels = vec![(0, Property::Translation, root)];
    for (joint, mut turns) in turns.into_iter().enumerate() {
        continuous(&mut turns);
        channels.push((joint, Property::Rotation, turns.iter().flat_map(|q| q.to_array()).collect()));
    }
    let clip = sampled("dance".into(), rate, channels).map_err(|e| e.to_string())?;
    let skeleton = Skeleton::new(player()).map_err(|e| e.to_string())?;
    Ok(SkeletalMotion { skeleton, clip, rate, frames })
}

/// Turns thigh, shank and foot so that the foot stands where it should; the knee goes where the foot points.
fn leg(
    pose: &mut [Quat],
    [thigh, shank, foot]: [usize; 3],
    hip: Vec3,
    stands: Foot,
    toes: f32,
    pelvis: Quat,
) {
    let level = facing(stands.heading);
    // Toes come up about the heel, which stays.
    let flat = level * Quat::from_rotation_x(-toes);
    let heel = stands.at - level * (Vec3::Z * ANKLE[1]);
    let ankle = heel + flat * Vec3::new(0.0, ANKLE[0], ANKLE[1]);
    let (a, b) = (Vec3::from(BONES[shank]).length(), Vec3::from(BONES[foot]).length());
    let way = ankle - hip;
    // A leg that cannot reach is straight.
    let length = way.length().clamp(0.1, 0.9999 * (a + b));
    let down = way.normalize_or(Vec3::NEG_Y);
    let forward = (level * Vec3::Z).reject_from(down).normalize_or(Vec3::Z);
    let along = (a * a - b * b + length * length) / (2.0 * length);
    let knee = hip + down * along + forward * (a * a - along * along).max(0.0).sqrt();
    let foot_at = hip + down * length;
    let turned = |from: Vec3, to: Vec3| {
        let y = (from - to).normalize_or(Vec3::Y);
        let z = forward.reject_from(y).normalize_or(Vec3::Z);
        Quat::from_mat3(&Mat3::from_cols(y.cross(z), y, z)).normalize()
    };
    let (upper, lower) = (turned(hip, knee), turned(knee, foot_at));
    pose[thigh] = pelvis.inverse() * upper;
    pose[shank] = upper.inverse() * lower;
    pose[foot] = lower.inverse() * flat;
}

/// How bodies on a player are measured.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// Standard deviation of places along each axis, m.
    pub position: f32,
    /// Of turns about each axis, rad.
    pub rotation: f32,
    /// How often a body is lost, a minute.
    pub gaps: f32,
    /// How long at most, s.
    pub longest: f32,
    /// Same seed, same noise.
    pub seed: u64,
}

/// The 19 bodies of a player who moves, each in the middle of its segment, as they are measured.
///
/// # Errors
/// Where a joint is at no place.
pub fn measure(moved: &SkeletalMotion, noise: &Noise) -> Result<Take, crate::SkeletonError> {
    let mut rng = Pcg32::new(noise.seed, 41);
    let mut tracks: Vec<Track<RigidPose>> = PERFORMER.iter().map(|(n, _)| Track::new(*n)).collect();
    let ends = |i: usize| ENDS.iter().find(|(of, _)| *of == i).map(|(_, end)| Vec3::from(*end));
    let middle = |i: usize| {
        let carried = PERFORMER.iter().position(|(_, parent)| *parent == PERFORMER[i].0);
        0.5 * ends(i).or(carried.map(|c| Vec3::from(BONES[c]))).unwrap_or(Vec3::ZERO)
    };
    for frame in 0..moved.frames {
        let poses = moved.poses(frame)?;
        for (i, track) in tracks.iter_mut().enumerate() {
            let mut vector = |size: f32| Vec3::from_array(std::array::from_fn(|_| size * rng.normal()));
            let position = poses[i].position + poses[i].rotation * middle(i) + vector(noise.position);
            let rotation = Quat::from_scaled_axis(vector(noise.rotation)) * poses[i].rotation;
            track.samples.push(Some(RigidPose { position, rotation: rotation.normalize() }));
        }
    }
    let minutes = moved.frames as f64 / moved.rate / 60.0;
    for track in &mut tracks {
        for _ in 0..(f64::from(noise.gaps) * minutes).round() as usize {
            // The pose at rest is seen.
            let first = (moved.rate as usize).max((f64::from(rng.next_f32()) * moved.frames as f64) as usize);
            let count = 1 + (f64::from(rng.next_f32() * noise.longest) * moved.rate) as usize;
            track.samples.iter_mut().skip(first).take(count).for_each(|s| *s = None);
        }
    }
    Ok(Take {
        bodies: Tracks { rate: moved.rate, start: 0.0, frames: moved.frames, tracks },
        ..Take::default()
    })
}

#[cfg(test)]
mod tests;
