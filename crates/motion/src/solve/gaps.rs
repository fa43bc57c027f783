//! Poses for frames in which a body was not seen.

use super::filter::rotation_vector;
use crate::RigidPose;
use glam::{DQuat, DVec3};

/// Gaps up to so many seconds go on with the speed at which they begin and end, a half turn of a quick limb; longer ones go
/// straight from pose to pose.
const SHORT: f64 = 0.5;
/// Frames over which the speed at the ends of a gap is taken, against noise.
const SPEED: usize = 6;

/// Where a body is: of f64, in which poses are composed.
#[derive(Clone, Copy, Debug)]
struct Pose(DVec3, DQuat);

impl Pose {
    fn of(p: &RigidPose) -> Self {
        Self(p.position.as_dvec3(), p.rotation.as_dquat().normalize())
    }

    /// As it is seen from another.
    fn seen_from(self, other: Self) -> Self {
        let back = other.1.inverse();
        Self(back * (self.0 - other.0), back * self.1)
    }

    fn carried_by(self, other: Self) -> Self {
        Self(other.0 + other.1 * self.0, other.1 * self.1)
    }
}

/// The poses of a body in all frames: filled in the frame of what carries it, whose poses are complete; before it is first
/// seen and after it is last seen it stays where it is there. `None` where it is never seen.
pub(super) fn fill(
    samples: &[Option<RigidPose>],
    parent: Option<&[RigidPose]>,
    rate: f64,
) -> Option<Vec<RigidPose>> {
    let carrier = |frame: usize| parent.map_or(Pose(DVec3::ZERO, DQuat::IDENTITY), |p| Pose::of(&p[frame]));
    let seen: Vec<(usize, Pose)> = samples
        .iter()
        .enumerate()
        .filter_map(|(i, s)| Some((i, Pose::of(s.as_ref()?).seen_from(carrier(i)))))
        .collect();
    let (&first, &last) = (seen.first()?, seen.last()?);
    let mut filled: Vec<RigidPose> = Vec::with_capacity(samples.len());
    let mut after = 0;
    for (frame, sample) in samples.iter().enumerate() {
        if let Some(sample) = sample {
            filled.push(*sample);
            after += 1;
            continue;
        }
        let relative = match after {
            0 => first.1,
            n if n == seen.len() => last.1,
            n => between(&seen, n, frame, rate),
        };
        let Pose(position, rotation) = relative.carried_by(carrier(frame));
        filled.push(RigidPose { position: position.as_vec3(), rotation: rotation.normalize().as_quat() });
    }
    Some(filled)
}

/// In the gap before number `after` of what is seen.
fn between(seen: &[(usize, Pose)], after: usize, frame: usize, rate: f64) -> Pose {
    let ((i, a), (j, _)) = (seen[after - 1], seen[after]);
    let span = (j - i) as f64;
    let t = (frame - i) as f64 / span;
    // Seen from where the gap begins, a place and a turn are two vectors.
    let vectors = |n: usize| {
        let Pose(place, turn) = seen[n].1;
        [place - a.0, rotation_vector(a.1.inverse() * turn)]
    };
    let end = vectors(after);
    // In the whole gap, from frames that follow one another; across another gap there is no speed but the mean one.
    let speed = |from: usize, to: usize| {
        let frames = seen[to].0 - seen[from].0;
        let (one, two) = (vectors(from), vectors(to));
        let even = frames > 0 && frames == to - from;
        std::array::from_fn(|k| if even { (two[k] - one[k]) * (span / frames as f64) } else { end[k] })
    };
    let (leave, arrive): ([DVec3; 2], [DVec3; 2]) = if span > SHORT * rate {
        (end, end)
    } else {
        let last = seen.len() - 1;
        (speed((after - 1).saturating_sub(SPEED), after - 1), speed(after, (after + SPEED).min(last)))
    };
    let (t2, t3) = (t * t, t * t * t);
    let [place, turn] = std::array::from_fn(|k| {
        (t3 - 2.0 * t2 + t) * leave[k] + (3.0 * t2 - 2.0 * t3) * end[k] + (t3 - t2) * arrive[k]
    });
    Pose(a.0 + place, a.1 * DQuat::from_scaled_axis(turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    #[test]
    fn a_lost_hand_goes_on_with_its_arm() {
        let arm: Vec<RigidPose> = (0..200)
            .map(|f| RigidPose {
                position: Vec3::new(f as f32 * 0.01, (f as f32 * 0.05).sin(), 0.0),
                rotation: Quat::from_rotation_y(f as f32 * 0.03),
            })
            .collect();
        let on = RigidPose { position: Vec3::new(0.3, 0.0, 0.1), rotation: Quat::from_rotation_x(0.5) };
        let hand: Vec<RigidPose> = arm
            .iter()
            .map(|a| RigidPose {
                position: a.position + a.rotation * on.position,
                rotation: a.rotation * on.rotation,
            })
            .collect();
        let seen = |f: usize| !(f < 10 || (50..60).contains(&f) || (80..150).contains(&f) || f > 190);
        let samples: Vec<_> = hand.iter().enumerate().map(|(f, h)| seen(f).then_some(*h)).collect();
        for (got, want) in fill(&samples, Some(&arm), 100.0).unwrap().iter().zip(&hand) {
            assert!(got.position.distance(want.position) < 1e-5);
            assert!(got.rotation.dot(want.rotation).abs() > 1.0 - 1e-6);
        }
        assert!(fill(&[None; 3], None, 100.0).is_none());
    }

    #[test]
    fn a_short_gap_keeps_its_curve() {
        let curve = |f: f32| Vec3::new(0.0, 2.0 - 4.9 * (f * 0.01).powi(2), f * 0.02);
        let track = |gap: std::ops::Range<usize>| {
            let pose = |f: usize| RigidPose { position: curve(f as f32), rotation: Quat::IDENTITY };
            let samples: Vec<_> = (0..90).map(|f| (!gap.contains(&f)).then(|| pose(f))).collect();
            let filled = fill(&samples, None, 100.0).unwrap();
            (0..90).map(|f| filled[f].position.distance(curve(f as f32))).fold(0.0, f32::max)
        };
        // A fall bends by 4.9 t². A straight line over .2 s is off by 49 mm in the middle; with speeds of six frames, which are
        // those of three frames off, by g · .03 · .2 / 4. Over .6 s the line is what there is.
        let (short, long) = (track(20..39), track(10..70));
        assert!(short < 0.016, "{short}");
        assert!(long > 0.3, "{long}");
    }
}
