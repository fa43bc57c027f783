//! From rigid bodies to a skeleton: joints are where bodies that carry one another turn about (`centre`), bones keep their
//! lengths, and every frame is fitted as a whole (`fit`). What was not seen is filled in the frame of what carries it
//! (`gaps`), and all is smoothed without delay ([`LowPass`]).
//!
//! The pose in which the performer is measured first, a range of frames, is that of the skeleton at rest: there nothing is
//! turned. Labelled markers become bodies first ([`bodies`]), unless they are the joints themselves ([`solve_points`]).

mod centre;
mod clusters;
mod filter;
mod fit;
mod gaps;
mod points;
mod tree;

pub use clusters::{Cluster, VICON, bodies};
pub use filter::LowPass;
pub use points::{SMPL, solve_points};
pub use tree::{HELD, PERFORMER};

use crate::{
    Joint, Placement, Property, RigidPose, SkeletalMotion, Skeleton, Tracks, Transform, continuous, sampled,
};
use filter::rotation_vector;
use fit::{Measured, Segment, State};
use glam::{DQuat, DVec3, Quat};
use std::ops::RangeInclusive;

/// How bodies are solved.
#[derive(Clone, Debug)]
pub struct SolveOptions {
    /// Which body carries which: names, and those of what carries them, empty for the root.
    pub tree: Vec<(String, String)>,
    /// Frames of the pose at rest; the first half second where absent.
    pub rest: Option<RangeInclusive<usize>>,
    /// What is faster than this is noise, Hz; of hands, feet and what hands hold, [`SolveOptions::quick`].
    pub cutoff: f64,
    /// The same for what is quick.
    pub quick: f64,
}

impl Default for SolveOptions {
    fn default() -> Self {
        Self {
            tree: PERFORMER.iter().chain(&HELD).map(|(a, b)| ((*a).to_string(), (*b).to_string())).collect(),
            rest: None,
            // Winter 2009: gait is over at 6 Hz; hands are twice as quick.
            cutoff: 6.0,
            quick: 12.0,
        }
    }
}

/// Words in the names of what is quick.
const QUICK: [&str; 4] = ["hand", "foot", "fan", "toe"];

/// Frames that joints are looked for in, spread over the take: minutes; more say no more.
const LOOKED_AT: usize = 20_000;

/// How much a pose that was filled in counts beside one that was seen: it is a hundred times farther off, some 30 degrees and
/// 5 cm, and where a neighbour was seen, that says more.
const FILLED: f64 = 1e-4;

/// How well a body is met.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Its name.
    pub name: String,
    /// Frames in which it was not seen.
    pub filled: usize,
    /// Length of the bone to its joint, m; of the root, nothing.
    pub bone: f64,
    /// How far its joint in its own coordinates is from that in its parent's, root mean square, m.
    pub joint_apart: f64,
    /// How far the skeleton is from where it was seen, root mean square, m.
    pub position_off: f64,
    /// How far from how it was turned, rad.
    pub rotation_off: f64,
}

/// A skeleton that moves as bodies did.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Joints in the order of the bodies, parents first; where a body that carries nothing lies beyond its joint, one more.
    pub motion: SkeletalMotion,
    /// Of each body, in the same order.
    pub fits: Vec<Fit>,
}

/// Why there is no skeleton.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SolveError {
    /// Nothing to solve.
    #[error("there are no rigid bodies in this take")]
    Empty,
    /// A body that no tree has.
    #[error("what carries the bodies {} is not known; give it as lines of a body and its carrier", names.join(", "))]
    Unknown {
        /// Their names.
        names: Vec<String>,
    },
    /// More than one root.
    #[error("nothing carries {}, but one body has to carry all others", names.join(" and "))]
    Roots {
        /// Their names.
        names: Vec<String>,
    },
    /// Bodies that carry each other, or none that carries all.
    #[error("the bodies carry each other in a circle")]
    Circle,
    /// Never seen.
    #[error("the body '{0}' is not seen in any frame; leave it out")]
    Unseen(String),
    /// Not seen when it counts.
    #[error("the body '{name}' is not seen in the frames {first} to {last} of the pose at rest; name others")]
    Rest {
        /// Which.
        name: String,
        /// The range.
        first: usize,
        /// Its end.
        last: usize,
    },
    /// What was made is no motion.
    #[error("{0}")]
    Motion(String),
}

/// Solves rigid bodies, in metres.
///
/// # Errors
/// Bodies whose carrier is not known, and bodies that are never seen.
pub fn solve(bodies: &Tracks<RigidPose>, options: &SolveOptions) -> Result<Solved, SolveError> {
    let frames = bodies.frames;
    if frames == 0 || bodies.tracks.is_empty() {
        return Err(SolveError::Empty);
    }
    let names: Vec<&str> = bodies.tracks.iter().map(|t| t.name.as_str()).collect();
    let (order, parents) = ordered(&names, options)?;
    let name = |i: usize| bodies.tracks[order[i]].name.clone();

    // All frames of all bodies.
    let mut poses: Vec<Vec<RigidPose>> = Vec::with_capacity(order.len());
    for (i, &track) in order.iter().enumerate() {
        let samples = &bodies.tracks[track].samples;
        let carrier = parents[i].map(|p| poses[p].as_slice());
        poses.push(gaps::fill(samples, carrier, bodies.rate).ok_or_else(|| SolveError::Unseen(name(i)))?);
    }
    let seen = |i: usize, frame: usize| bodies.tracks[order[i]].samples[frame].is_some();
    for (i, all) in poses.iter_mut().enumerate() {
        let lower = name(i).to_lowercase();
        let quick = QUICK.iter().any(|word| lower.contains(word));
        let cutoff = if quick { options.quick } else { options.cutoff };
        *all = LowPass::new(cutoff, bodies.rate).poses(all);
    }

    // The pose at rest: how each body is turned while its segment is not.
    let half = (0.5 * bodies.rate).round() as usize;
    let rest = options.rest.clone().unwrap_or(0..=half);
    let (first, last) = (*rest.start(), (*rest.end()).min(frames - 1));
    let mut turns_at_rest = Vec::with_capacity(order.len());
    for (i, all) in poses.iter().enumerate() {
        let still: Vec<Quat> = (first..=last).filter(|f| seen(i, *f)).map(|f| all[f].rotation).collect();
        let mean = mean_rotation(&still).ok_or_else(|| SolveError::Rest { name: name(i), first, last })?;
        turns_at_rest.push(mean);
    }

    // Joints.
    let step = frames.div_ceil(LOOKED_AT);
    let mut segments: Vec<Segment> = Vec::with_capacity(order.len());
    let mut apart = Vec::with_capacity(order.len());
    for (i, parent) in parents.iter().enumerate() {
        let Some(p) = *parent else {
            segments.push(Segment { parent: None, bone: DVec3::ZERO, body: DVec3::ZERO });
            apart.push(0.0);
            continue;
        };
        let both = (0..frames).step_by(step).filter(|f| seen(i, *f) && seen(p, *f));
        let pairs: Vec<_> = both.map(|f| (poses[p][f], poses[i][f])).collect();
        let found = centre::centre(&pairs).ok_or_else(|| SolveError::Unseen(name(i)))?;
        // In coordinates of segments, which are those of the world at rest.
        let bone = segments[p].body + turns_at_rest[p] * found.at[0];
        segments.push(Segment { parent: *parent, bone, body: -(turns_at_rest[i] * found.at[1]) });
        apart.push(found.apart);
    }

    // Every frame.
    let mut solved: Vec<State> = Vec::with_capacity(frames);
    let mut off = vec![[0.0f64; 2]; order.len()];
    let measured_in = |frame: usize| -> Vec<Measured> {
        let each = poses.iter().zip(&turns_at_rest).enumerate();
        each.map(|(i, (poses, at_rest))| Measured {
            position: poses[frame].position.as_dvec3(),
            rotation: (poses[frame].rotation.as_dquat() * at_rest.inverse()).normalize(),
            weight: if seen(i, frame) { 1.0 } else { FILLED },
        })
        .collect()
    };
    for frame in 0..frames {
        let measured = measured_in(frame);
        let start =
            State { root: measured[0].position, turns: measured.iter().map(|m| m.rotation).collect() };
        let state = fit::fit(&segments, &measured, start);
        let joints = fit::joints(&segments, &state);
        for i in (0..order.len()).filter(|i| seen(*i, frame)) {
            let place = joints[i] + state.turns[i] * segments[i].body;
            off[i][0] += place.distance_squared(measured[i].position);
            off[i][1] += rotation_vector(state.turns[i] * measured[i].rotation.inverse()).length_squared();
        }
        solved.push(state);
    }

    let fits = (0..order.len())
        .map(|i| {
            let filled = bodies.tracks[order[i]].missing();
            let mean = |sum: f64| (sum / (frames - filled).max(1) as f64).sqrt();
            Fit {
                name: name(i),
                filled,
                bone: segments[i].bone.length(),
                joint_apart: apart[i],
                position_off: mean(off[i][0]),
                rotation_off: mean(off[i][1]),
            }
        })
        .collect();
    let names: Vec<String> = (0..order.len()).map(name).collect();
    let motion = motion(&segments, &names, &solved, bodies.rate)?;
    Ok(Solved { motion, fits })
}

/// Indices of the tracks, carriers first, and of each the place of its carrier.
type Order = (Vec<usize>, Vec<Option<usize>>);

fn ordered(names: &[&str], options: &SolveOptions) -> Result<Order, SolveError> {
    let known: Vec<(&str, &str)> = options.tree.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let parents = tree::parents(names, &known).map_err(|names| SolveError::Unknown { names })?;
    let roots: Vec<String> =
        names.iter().zip(&parents).filter(|(_, p)| p.is_none()).map(|(n, _)| (*n).to_string()).collect();
    if roots.len() > 1 {
        return Err(SolveError::Roots { names: roots });
    }
    let mut order: Vec<usize> = (0..names.len()).filter(|i| parents[*i].is_none()).collect();
    let mut next = 0;
    while let Some(&carrier) = order.get(next) {
        order.extend((0..names.len()).filter(|i| parents[*i] == Some(carrier)));
        next += 1;
    }
    if order.len() < names.len() {
        return Err(SolveError::Circle);
    }
    let place = |track: usize| order.iter().position(|t| *t == track);
    let carried = order.iter().map(|t| parents[*t].and_then(place)).collect();
    Ok((order, carried))
}

/// The mean of rotations that are near one another; `None` of none.
fn mean_rotation(all: &[Quat]) -> Option<DQuat> {
    let first = all.first()?.as_dquat();
    // The mean of quaternions on one side is that of Markley et al. 2007 to second order in their distances.
    let sum = all.iter().map(|q| q.as_dquat()).map(|q| if q.dot(first) < 0.0 { -q } else { q });
    let sum = sum.fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |s, q| s + q);
    Some(sum.normalize())
}

fn motion(
    segments: &[Segment],
    names: &[String],
    states: &[State],
    rate: f64,
) -> Result<SkeletalMotion, SolveError> {
    let at = |translation: DVec3| {
        Placement::Parts(Transform { translation: translation.as_vec3(), ..Transform::IDENTITY })
    };
    let mut joints: Vec<Joint> = segments
        .iter()
        .zip(names)
        .map(|(s, name)| Joint { name: name.clone(), parent: s.parent, rest: at(s.bone) })
        .collect();
    for (i, segment) in segments.iter().enumerate() {
        // A centimetre is seen; less is where the joint is.
        let carries = segments.iter().any(|s| s.parent == Some(i));
        if !carries && segment.body.length() > 0.01 {
            joints.push(Joint { name: format!("{} end", names[i]), parent: Some(i), rest: at(segment.body) });
        }
    }
    let root = states.iter().flat_map(|s| s.root.as_vec3().to_array()).collect();
    let mut channels = vec![(0, Property::Translation, root)];
    for (i, segment) in segments.iter().enumerate() {
        let local = |s: &State| match segment.parent {
            None => s.turns[i],
            Some(p) => s.turns[p].inverse() * s.turns[i],
        };
        let mut turns: Vec<Quat> = states.iter().map(|s| local(s).normalize().as_quat()).collect();
        continuous(&mut turns);
        channels.push((i, Property::Rotation, turns.iter().flat_map(|q| q.to_array()).collect()));
    }
    let wrong = |e: &dyn std::fmt::Display| SolveError::Motion(e.to_string());
    let clip = sampled("solved".into(), rate, channels).map_err(|e| wrong(&e))?;
    let skeleton = Skeleton::new(joints).map_err(|e| wrong(&e))?;
    Ok(SkeletalMotion { skeleton, clip, rate, frames: states.len() })
}

#[cfg(test)]
mod tests;
