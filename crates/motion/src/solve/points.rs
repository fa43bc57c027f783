//! A skeleton from where its joints are: markers that are joints, as other programs export them. Bones keep their mean
//! length; a joint that carries several is turned as they are as a whole, one that carries one is swung to it and follows
//! its carrier about it, for nothing tells how a line is turned about itself.

use super::clusters::absolute_orientation;
use super::filter::LowPass;
use super::fit::State;
use super::{Fit, SolveError, SolveOptions, Solved, gaps, motion, ordered};
use crate::{RigidPose, Tracks};
use glam::{DQuat, DVec3, Quat, Vec3};

/// Joints by their names, of the body model SMPL (Loper et al. 2015) as exports of it have them, each with its carrier.
pub const SMPL: [(&str, &str); 29] = [
    ("Pelvis", ""),
    ("Left_hip", "Pelvis"),
    ("Left_knee", "Left_hip"),
    ("Left_ankle", "Left_knee"),
    ("Left_foot", "Left_ankle"),
    ("Left_foot_End", "Left_foot"),
    ("Right_hip", "Pelvis"),
    ("Right_knee", "Right_hip"),
    ("Right_ankle", "Right_knee"),
    ("Right_foot", "Right_ankle"),
    ("Right_foot_End", "Right_foot"),
    ("Spine1", "Pelvis"),
    ("Spine2", "Spine1"),
    ("Spine3", "Spine2"),
    ("Neck", "Spine3"),
    ("Head", "Neck"),
    ("Head_End", "Head"),
    ("Left_collar", "Spine3"),
    ("Left_shoulder", "Left_collar"),
    ("Left_elbow", "Left_shoulder"),
    ("Left_wrist", "Left_elbow"),
    ("Left_palm", "Left_wrist"),
    ("Left_palm_End", "Left_palm"),
    ("Right_collar", "Spine3"),
    ("Right_shoulder", "Right_collar"),
    ("Right_elbow", "Right_shoulder"),
    ("Right_wrist", "Right_elbow"),
    ("Right_palm", "Right_wrist"),
    ("Right_palm_End", "Right_palm"),
];

/// Solves markers that are the joints of a tree ([`SolveOptions::tree`]), in metres. Where a joint is in the pose at rest,
/// its segment is not turned.
///
/// # Errors
/// As [`super::solve`].
pub fn solve_points(markers: &Tracks<Vec3>, options: &SolveOptions) -> Result<Solved, SolveError> {
    let frames = markers.frames;
    if frames == 0 || markers.tracks.is_empty() {
        return Err(SolveError::Empty);
    }
    let names: Vec<&str> = markers.tracks.iter().map(|t| t.name.as_str()).collect();
    let (order, parents) = ordered(&names, options)?;
    let name = |i: usize| names[order[i]].to_string();
    let seen = |i: usize, frame: usize| markers.tracks[order[i]].samples[frame].is_some();

    // Filled and smoothed as bodies that do not turn.
    let filter = LowPass::new(options.cutoff, markers.rate);
    let mut places: Vec<Vec<DVec3>> = Vec::with_capacity(order.len());
    for (i, &track) in order.iter().enumerate() {
        let still = |p: Vec3| RigidPose { position: p, rotation: Quat::IDENTITY };
        let samples: Vec<Option<RigidPose>> =
            markers.tracks[track].samples.iter().map(|s| s.map(still)).collect();
        let carrier: Option<Vec<RigidPose>> =
            parents[i].map(|p| places[p].iter().map(|v| still(v.as_vec3())).collect());
        let filled = gaps::fill(&samples, carrier.as_deref(), markers.rate);
        let filled = filled.ok_or_else(|| SolveError::Unseen(name(i)))?;
        places.push(filter.poses(&filled).iter().map(|p| p.position.as_dvec3()).collect());
    }

    // Bones: as they lie at rest, as long as they are in the mean.
    let half = (0.5 * markers.rate).round() as usize;
    let rest = options.rest.clone().unwrap_or(0..=half);
    let (first, last) = (*rest.start(), (*rest.end()).min(frames - 1));
    if first > last {
        return Err(SolveError::Rest { name: name(0), first, last });
    }
    let bone = |i: usize| {
        let Some(p) = parents[i] else { return DVec3::ZERO };
        let at = |f: usize| places[i][f] - places[p][f];
        let lies = (first..=last).map(at).sum::<DVec3>().normalize_or_zero();
        lies * ((0..frames).map(|f| at(f).length()).sum::<f64>() / frames as f64)
    };
    let bones: Vec<DVec3> = (0..order.len()).map(bone).collect();
    let mut carried = vec![Vec::new(); order.len()];
    for (i, parent) in parents.iter().enumerate() {
        // Where both are one point, nothing is told.
        parent.iter().filter(|_| bones[i].length() > 1e-4).for_each(|p| carried[*p].push(i));
    }

    let place = |i: usize, frame: usize| places[i][frame];
    let mut states: Vec<State> = Vec::with_capacity(frames);
    let mut off = vec![0.0; order.len()];
    for frame in 0..frames {
        let mut turns: Vec<DQuat> = Vec::with_capacity(order.len());
        let mut at: Vec<DVec3> = Vec::with_capacity(order.len());
        for i in 0..order.len() {
            let carrier = parents[i].map_or(DQuat::IDENTITY, |p| turns[p]);
            at.push(parents[i].map_or(place(i, frame), |p| at[p] + turns[p] * bones[i]));
            let ways = carried[i].iter().map(|c| (bones[*c], place(*c, frame) - place(i, frame)));
            let mut pairs: Vec<(DVec3, DVec3)> = ways.collect();
            let swung = pairs.first().map(|(lies, goes)| swing(carrier * *lies, *goes) * carrier);
            pairs.push((DVec3::ZERO, DVec3::ZERO));
            let whole = absolute_orientation(&pairs).map(|(_, turn)| turn);
            turns.push(whole.or(swung).unwrap_or(carrier));
            off[i] += at[i].distance_squared(place(i, frame));
        }
        states.push(State { root: at[0], turns });
    }
    let fits = (0..order.len())
        .map(|i| Fit {
            name: name(i),
            filled: (0..frames).filter(|f| !seen(i, *f)).count(),
            bone: bones[i].length(),
            joint_apart: 0.0,
            position_off: (off[i] / frames as f64).sqrt(),
            rotation_off: 0.0,
        })
        .collect();
    let segments: Vec<_> = parents
        .iter()
        .zip(&bones)
        .map(|(parent, bone)| super::fit::Segment { parent: *parent, bone: *bone, body: DVec3::ZERO })
        .collect();
    let names: Vec<String> = (0..order.len()).map(name).collect();
    let motion = motion(&segments, &names, &states, markers.rate)?;
    Ok(Solved { motion, fits })
}

/// The least turn from one direction to another.
fn swing(from: DVec3, to: DVec3) -> DQuat {
    match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to),
        _ => DQuat::IDENTITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Track;

    #[test]
    fn points_are_met_by_bones_of_one_length() {
        let tree = [("hips", ""), ("knee", "hips"), ("ankle", "knee"), ("chest", "hips"), ("head", "chest")];
        let bones = [Vec3::ZERO, Vec3::new(0.1, -0.4, 0.0), Vec3::NEG_Y * 0.4, Vec3::Y * 0.3, Vec3::Y * 0.2];
        let parents = [None, Some(0), Some(1), Some(0), Some(3)];
        let mut markers = Tracks {
            rate: 60.0,
            start: 0.0,
            frames: 240,
            tracks: tree.iter().map(|(n, _)| Track::<Vec3>::new(*n)).collect(),
        };
        for frame in 0..240 {
            let t = (frame as f32 / 60.0 - 0.6).max(0.0);
            let mut all: Vec<(Vec3, Quat)> = Vec::new();
            for i in 0..5 {
                let own = Quat::from_rotation_x(0.4 * (1.0 + i as f32) * t.sin() * 0.4)
                    * Quat::from_rotation_y(0.3 * t);
                all.push(match parents[i] {
                    None => (Vec3::new(t, 0.9, 0.0), own),
                    Some(p) => (all[p].0 + all[p].1 * bones[i], all[p].1 * own),
                });
                markers.tracks[i].samples.push(Some(all[i].0));
            }
        }
        markers.tracks[2].samples[100..110].fill(None);
        let tree = tree.map(|(a, b)| (a.to_string(), b.to_string())).to_vec();
        let options = SolveOptions { tree, cutoff: 1e3, ..SolveOptions::default() };
        let solved = solve_points(&markers, &options).unwrap();
        for fit in &solved.fits {
            let i = markers.tracks.iter().position(|t| t.name == fit.name).unwrap();
            assert!((fit.bone - f64::from(bones[i].length())).abs() < 1e-4, "{fit:?}");
            assert!(fit.position_off < 1e-3, "{fit:?}");
        }
        let ankle = solved.fits.iter().position(|f| f.name == "ankle").unwrap();
        assert_eq!(solved.fits[ankle].filled, 10);
        for frame in [0, 50, 150, 239] {
            let poses = solved.motion.poses(frame).unwrap();
            let want = markers.tracks[2].samples[frame].unwrap();
            assert!(poses[ankle].position.distance(want) < 1e-3, "{frame}");
        }
        assert!(solve_points(&Tracks::default(), &options).is_err());
    }
}
