//! How a figure comes to its first frame: as fast as it moves there, out of rest, so that cloth moves with it from the beginning.

use super::Wearer;
use crate::RigidPose;
use glam::{Quat, Vec3};

/// How long that takes, s: a step of a walk.
const SECONDS: f32 = 0.5;
/// The most that a joint turns on the way, rad: what it did before is not known, and there may be something in its way.
const TURN: f32 = 0.4;
/// Speeds beyond which a first frame is no frame of the same movement, m/s for a player and rad/s.
const FASTEST: [f32; 2] = [6.0, 20.0];

/// A joint in its carrier: where it is in the first frame, and how fast.
#[derive(Clone, Copy, Debug)]
struct Local {
    pose: RigidPose,
    velocity: Vec3,
    turn: Vec3,
}

/// The way to the first frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Lead {
    /// By joint; none where it does not move there.
    joints: Vec<Local>,
}

/// A pose in its carrier's coordinates.
pub(super) fn local(poses: &[RigidPose], j: usize, parent: Option<usize>) -> RigidPose {
    let Some(p) = parent else { return poses[j] };
    let back = poses[p].rotation.inverse();
    RigidPose { position: back * (poses[j].position - poses[p].position), rotation: back * poses[j].rotation }
}

/// And out of them.
pub(super) fn carried(poses: &[RigidPose], local: RigidPose, parent: Option<usize>) -> RigidPose {
    let Some(p) = parent else { return local };
    RigidPose {
        position: poses[p].rotation * local.position + poses[p].position,
        rotation: (poses[p].rotation * local.rotation).normalize(),
    }
}

/// Part of a velocity that is gone through by so many seconds before the first frame: evenly faster in `seconds`, from rest.
fn way(before: f32, seconds: f32) -> f32 {
    let t = before.clamp(0.0, seconds);
    if seconds > 0.0 { t * t / (2.0 * seconds) - t } else { 0.0 }
}

impl Lead {
    fn pose(&self, tree: &[(usize, Option<usize>)], first: &[RigidPose], before: f32) -> Vec<RigidPose> {
        let mut all = first.to_vec();
        if self.joints.is_empty() {
            return all;
        }
        for (j, parent) in tree {
            let Local { pose, velocity, turn } = self.joints[*j];
            let seconds = SECONDS.min(2.0 * TURN / turn.length().max(1e-6));
            let rotation = Quat::from_scaled_axis(turn * way(before, seconds)) * pose.rotation;
            let position = pose.position + velocity * way(before, SECONDS);
            all[*j] = carried(&all, RigidPose { position, rotation }, *parent);
        }
        all
    }
}

impl Wearer {
    /// Says where the joints are so many seconds after the first frame, in the world, m: the figure then comes to the first frame with
    /// that velocity ([`Wearer::lead`]). A figure that is elsewhere by then does not.
    pub fn begin_moving(&mut self, second: &[RigidPose], seconds: f32) {
        let mut second = second.to_vec();
        let good = second.len() == self.first.len() && seconds > 0.0 && seconds.is_finite();
        if !good || second.iter().any(|p| !p.position.is_finite() || !p.rotation.is_finite()) {
            return;
        }
        self.own(&mut second);
        let mut joints =
            vec![Local { pose: self.first[0], velocity: Vec3::ZERO, turn: Vec3::ZERO }; second.len()];
        for (j, parent) in &self.tree {
            let [a, b] = [&self.first, &second].map(|poses| local(poses, *j, *parent));
            let mut turn = b.rotation * a.rotation.inverse();
            // The shorter way.
            if turn.w < 0.0 {
                turn = -turn;
            }
            let (velocity, turn) =
                ((b.position - a.position) / seconds, turn.normalize().to_scaled_axis() / seconds);
            if velocity.length() > FASTEST[0] * self.size || turn.length() > FASTEST[1] {
                return;
            }
            joints[*j] = Local { pose: a, velocity, turn };
        }
        self.lead = Lead { joints };
        self.begin = self.lead.pose(&self.tree, &self.first, SECONDS);
    }

    /// For how long the figure moves before the first frame, s: not at all unless [`Wearer::begin_moving`] has said how.
    pub fn leads(&self) -> f32 {
        if self.lead.joints.is_empty() { 0.0 } else { SECONDS }
    }

    /// Where the joints are so many seconds before the first frame, in its own coordinates.
    pub fn lead(&self, before: f32) -> Vec<RigidPose> {
        self.lead.pose(&self.tree, &self.first, before)
    }
}

#[cfg(test)]
mod tests {
    use crate::dance::{dance, parse};
    use crate::garment::Wearer;

    /// A dance that is entered while it is danced.
    #[test]
    fn a_figure_comes_to_its_first_frame_as_fast_as_it_moves_there() {
        let motion = dance(&parse("hakobi steps=3 seconds=.7").unwrap(), 60.0).unwrap();
        let frame = 50;
        let [first, second] = [frame, frame + 1].map(|f| motion.poses(f).unwrap());
        let rest = motion.approach(0.0).unwrap();
        let mut wearer = Wearer::new(&motion.skeleton, &rest, &first, &[]).unwrap();
        assert!(wearer.leads() == 0.0 && wearer.lead(0.3)[0].position == wearer.lead(0.0)[0].position);
        wearer.begin_moving(&second, 1.0 / 60.0);
        let h = 1e-3;
        let speed = |before: f32, j: usize| {
            (wearer.lead(before)[j].position - wearer.lead(before + h)[j].position) / h
        };
        let mut fastest = 0.0f32;
        let [mut a, mut b] = [first, second];
        [&mut a, &mut b].into_iter().for_each(|p| wearer.own(p));
        for j in 0..19 {
            let want = (b[j].position - a[j].position) * 60.0;
            fastest = fastest.max(want.length());
            assert!(wearer.lead(0.0)[j].position.distance(a[j].position) < 1e-4);
            assert!(
                speed(0.0, j).distance(want) < 0.02 + 0.02 * want.length(),
                "{j}: {} {want}",
                speed(0.0, j)
            );
            assert!(speed(wearer.leads(), j).length() < 5e-3, "{j}");
            assert!(
                wearer.approach(1.0)[j].position.distance(wearer.lead(wearer.leads())[j].position) < 1e-4
            );
        }
        assert!(fastest > 0.3, "{fastest}");
        // What is elsewhere in the next frame does not move there.
        let mut away = Wearer::new(&motion.skeleton, &rest, &motion.poses(frame).unwrap(), &[]).unwrap();
        let mut far = motion.poses(frame + 1).unwrap();
        far.iter_mut().for_each(|p| p.position.x += 5.0);
        away.begin_moving(&far, 1.0 / 60.0);
        assert_eq!(away.leads(), 0.0);
    }
}
