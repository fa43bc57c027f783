//! Arms that lie in the trunk of a body or in each other, or nearer than cloth takes.
//!
//! Captured arms rest on a trunk that is thinner than the capsules about it, so they lie inside of these; cloth between both would have
//! no place to be. For cloth they are turned out about the shoulder.

use super::Body;
use crate::RigidPose;
use glam::{Quat, Vec3};

/// Part of an upper arm, from the shoulder on, that lies in the trunk whatever the arm does.
const SHOULDER: f32 = 0.45;
/// Places along each part of an arm that are tested.
const PLACES: usize = 4;
/// Turns after which an arm that finds no room stays where it is.
const SWEEPS: usize = 12;
/// The most that an arm is turned at a time, rad.
const TURN: f32 = 0.2;

/// An arm in a trunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// By how much it is nearer than it may be, m.
    pub depth: f32,
    /// The joint of the arm.
    pub arm: usize,
    /// And of what it lies in: of the trunk, of a thigh, of the other arm.
    pub within: usize,
}

/// A sphere of an arm.
struct Place {
    joint: usize,
    at: Vec3,
    radius: f32,
}

impl Body {
    /// Spheres of an arm, from the shoulder to the hand.
    fn places<'a>(&'a self, arm: &'a [usize; 3], poses: &'a [RigidPose]) -> impl Iterator<Item = Place> + 'a {
        arm.iter().enumerate().flat_map(move |(part, joint)| {
            let from = if part == 0 { SHOULDER } else { 0.0 };
            self.capsules.iter().filter(move |c| c.joint == *joint).flat_map(move |c| {
                (1..=PLACES).map(move |k| {
                    let part = from + (1.0 - from) * k as f32 / PLACES as f32;
                    let (at, radius) = c.sphere(&poses[*joint], part);
                    Place { joint: *joint, at, radius }
                })
            })
        })
    }

    /// What of trunk, thighs and the other arm, but for its upper part, a sphere is nearest to: by how much it is farther than `gap` metres
    /// from it, negative where it is nearer; away from it; the joint.
    fn beyond(
        &self,
        place: &Place,
        other: &[usize; 3],
        poses: &[RigidPose],
        gap: f32,
    ) -> Option<(f32, Vec3, usize)> {
        let arm = self.capsules.iter().filter(|c| other[1..].contains(&c.joint));
        let all = self.trunk.iter().filter_map(|k| self.capsules.get(*k)).chain(arm).map(|c| {
            let (d, n) = c.distance(&poses[c.joint], place.at);
            (d - place.radius - gap, n, c.joint)
        });
        all.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// How an arm lies nearer than `gap` metres to trunk, thighs or the other arm: the deepest place, if there is any.
    ///
    /// # Panics
    /// Where [`Body::check`] finds fault with so many poses.
    pub fn overlap(&self, poses: &[RigidPose], gap: f32) -> Option<Overlap> {
        let [left, right] = &self.arms;
        let places = [(left, right), (right, left)]
            .into_iter()
            .flat_map(|(arm, other)| self.places(arm, poses).map(move |place| (place, other)));
        let all = places.filter_map(|(p, other)| {
            let (d, _, within) = self.beyond(&p, other, poses, gap)?;
            (d < 0.0).then_some(Overlap { depth: -d, arm: p.joint, within })
        });
        all.max_by(|a, b| a.depth.total_cmp(&b.depth))
    }

    /// Turns arms about their shoulders until they are `gap` metres away from trunk, thighs and each other, as far as that can be: small turns
    /// in a fixed order, so that an arm that moves evenly is moved evenly. What an arm carries besides forearm and hand stays.
    ///
    /// # Panics
    /// As [`Body::overlap`].
    pub fn clear_arms(&self, poses: &mut [RigidPose], gap: f32) {
        let [left, right] = &self.arms;
        for _ in 0..SWEEPS {
            let mut turned = false;
            for (arm, other) in [(left, right), (right, left)] {
                let count = self.places(arm, poses).count();
                for k in 0..count {
                    let Some(place) = self.places(arm, poses).nth(k) else { continue };
                    let found = self.beyond(&place, other, poses, gap).filter(|f| f.0 < 0.0);
                    let Some((d, n, within)) = found else { continue };
                    let shoulder = poses[arm[0]].position;
                    let lever = place.at - shoulder;
                    let axis = lever.cross(n);
                    // Towards n the place moves by the length of this axis times the turn.
                    let gain = axis.length();
                    if gain < 0.05 * lever.length() || gain <= 0.0 {
                        continue;
                    }
                    // Of two arms each takes half.
                    let part = if other.contains(&within) { 0.5 } else { 1.0 };
                    let turn = Quat::from_axis_angle(axis / gain, (-d * part / gain).min(TURN));
                    for joint in arm {
                        let pose = &mut poses[*joint];
                        pose.position = turn * (pose.position - shoulder) + shoulder;
                        pose.rotation = (turn * pose.rotation).normalize();
                    }
                    turned = true;
                }
            }
            if !turned {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dance::{dance, parse};

    /// The player with both arms hanging straight down, and drawn in.
    #[test]
    fn arms_in_the_trunk_are_turned_out_evenly() {
        let motion = dance(&parse("kamae").unwrap(), 60.0).unwrap();
        let body = Body::player();
        let spread = motion.approach(0.0).unwrap();
        assert_eq!(body.overlap(&spread, 0.02), None);
        let mut free = spread.clone();
        body.clear_arms(&mut free, 0.02);
        assert!(free == spread, "arms that are nowhere near stay where they are");
        // Lowered from the shoulder, degree by degree.
        let lowered = |degrees: f32| {
            let mut poses = spread.clone();
            for (arm, side) in body.arms.iter().zip([-1.0f32, 1.0]) {
                let turn = Quat::from_rotation_z(side * degrees.to_radians());
                let shoulder = poses[arm[0]].position;
                for j in arm {
                    poses[*j].position = turn * (poses[*j].position - shoulder) + shoulder;
                    poses[*j].rotation = turn * poses[*j].rotation;
                }
            }
            poses
        };
        let deep = body.overlap(&lowered(95.0), 0.0).unwrap();
        assert!(
            (0.02..0.12).contains(&deep.depth)
                && body.arms[0].contains(&deep.arm) | body.arms[1].contains(&deep.arm),
            "{deep:?}"
        );
        let mut before: Option<Vec<RigidPose>> = None;
        for tenth in 0..=950 {
            let mut poses = lowered(tenth as f32 * 0.1);
            body.clear_arms(&mut poses, 0.02);
            let left = body.overlap(&poses, 0.02).map_or(0.0, |o| o.depth);
            assert!(left < 1e-3, "{tenth}: {left}");
            if let Some(before) = before {
                // A hand is .7 m from the shoulder: 1.2 mm in a tenth of a degree by itself.
                let most = before.iter().zip(&poses).map(|(a, b)| a.position.distance(b.position));
                let most = most.fold(0.0, f32::max);
                assert!(most < 5e-3, "{tenth}: {most}");
            }
            before = Some(poses);
        }
    }
}
