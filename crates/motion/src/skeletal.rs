//! A skeleton that a file moves frame by frame.

use crate::{
    Clip, Curve, CurveError, Interpolation, Joint, Placement, Pose, Property, RigidPose, Skeleton,
    SkeletonError, Take, Track, Tracks, reaxis,
};
use glam::{Mat3, Mat4, Quat, Vec3};

/// A skeleton and its movement at an even rate. The clip begins at 0 s.
#[derive(Clone, Debug, Default)]
pub struct SkeletalMotion {
    /// Joints.
    pub skeleton: Skeleton,
    /// A key a frame.
    pub clip: Clip,
    /// Frames a second; above zero where there are frames.
    pub rate: f64,
    /// How many; none where there is a skeleton that does not move.
    pub frames: usize,
}

impl SkeletalMotion {
    /// Where everything is in a frame.
    pub fn pose(&self, frame: usize) -> Pose {
        self.clip.pose(&self.skeleton, seconds(frame, self.rate))
    }

    /// Where each joint is in the world in a frame, without scale.
    ///
    /// # Errors
    /// Where a joint is at no place.
    pub fn poses(&self, frame: usize) -> Result<Vec<RigidPose>, SkeletonError> {
        self.rigid(&self.pose(frame))
    }

    /// Where each joint is on the way from the skeleton's rest, at 0, to the first frame, at 1.
    ///
    /// # Errors
    /// Where a joint is at no place.
    pub fn approach(&self, t: f32) -> Result<Vec<RigidPose>, SkeletonError> {
        self.rigid(&self.skeleton.rest().toward(&self.pose(0), t))
    }

    fn rigid(&self, pose: &Pose) -> Result<Vec<RigidPose>, SkeletonError> {
        Ok(rigid(&self.skeleton.to_skeleton(pose)?))
    }

    /// Its joints as rigid bodies; one frame where it does not move.
    ///
    /// # Errors
    /// Where a joint is at no place.
    pub fn take(&self) -> Result<Take, SkeletonError> {
        let mut tracks: Vec<Track<RigidPose>> =
            self.skeleton.joints().iter().map(|j| Track::new(j.name.clone())).collect();
        let frames = self.frames.max(1);
        for frame in 0..frames {
            for (track, pose) in tracks.iter_mut().zip(self.poses(frame)?) {
                track.samples.push(Some(pose));
            }
        }
        let rate = if self.frames > 0 { self.rate } else { 1.0 };
        Ok(Take { bodies: Tracks { rate, start: 0.0, frames, tracks }, ..Take::default() })
    }

    /// Brings it to other axes and another unit, as [`crate::Take::transform`] does.
    ///
    /// # Errors
    /// Where lengths become infinite.
    pub fn transform(&mut self, axes: Mat3, scale: f32) -> Result<(), CurveError> {
        let point = |p: Vec3| axes * p * scale;
        let rest = |p: Placement| match p {
            Placement::Parts(mut parts) => {
                parts.translation = point(parts.translation);
                parts.rotation = reaxis(parts.rotation, axes);
                parts.scale = (axes * parts.scale).abs();
                Placement::Parts(parts)
            }
            Placement::Matrix(m) => {
                let axes = Mat4::from_mat3(axes * scale);
                Placement::Matrix(axes * m * axes.inverse())
            }
        };
        let joints = self.skeleton.joints().iter();
        let joints = joints.map(|j| Joint { rest: rest(j.rest), ..j.clone() }).collect();
        // The same tree.
        self.skeleton = Skeleton::new(joints).unwrap_or_default();
        for (_, curve) in &mut self.clip.channels {
            let values = curve.values().to_vec();
            let changed: Vec<f32> = match curve.property() {
                Property::Translation => {
                    values.as_chunks().0.iter().flat_map(|&v| point(Vec3::from(v)).to_array()).collect()
                }
                Property::Rotation => {
                    let turn = |v: &[f32; 4]| reaxis(Quat::from_array(*v), axes).to_array();
                    values.as_chunks().0.iter().flat_map(turn).collect()
                }
                Property::Scale => values
                    .as_chunks()
                    .0
                    .iter()
                    .flat_map(|&v| (axes * Vec3::from(v)).abs().to_array())
                    .collect(),
                Property::Weights => values,
            };
            *curve = Curve::new(curve.property(), curve.interpolation(), curve.times().to_vec(), changed)?;
        }
        Ok(())
    }
}

/// Where joints are, without scale.
pub fn rigid(joints: &[Mat4]) -> Vec<RigidPose> {
    let of = |m: &Mat4| {
        let (_, rotation, position) = m.to_scale_rotation_translation();
        // A joint that is scaled to nothing has no direction.
        let rotation = if rotation.is_finite() { rotation.normalize() } else { Quat::IDENTITY };
        RigidPose { position, rotation }
    };
    joints.iter().map(of).collect()
}

/// When a frame is; the first where there is no rate.
pub fn seconds(frame: usize, rate: f64) -> f32 {
    if rate > 0.0 { (frame as f64 / rate) as f32 } else { 0.0 }
}

/// A clip of values that every frame has: of each joint what moves, its numbers frame after frame.
///
/// # Errors
/// Where a curve has not the numbers of its frames, or times do not rise.
pub fn sampled(
    name: String,
    rate: f64,
    channels: impl IntoIterator<Item = (usize, Property, Vec<f32>)>,
) -> Result<Clip, CurveError> {
    let mut clip = Clip { name, channels: Vec::new() };
    for (joint, property, values) in channels {
        let frames = values.len() / property.width();
        let times = (0..frames).map(|f| seconds(f, rate)).collect();
        clip.channels.push((joint, Curve::new(property, Interpolation::Linear, times, values)?));
    }
    Ok(clip)
}

/// Takes each quaternion to the side of its predecessor, so that numbers between two of them mean something.
pub fn continuous(rotations: &mut [Quat]) {
    for i in 1..rotations.len() {
        if rotations[i].dot(rotations[i - 1]) < 0.0 {
            rotations[i] = -rotations[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Transform;

    #[test]
    fn other_axes_move_all_joints_alike() {
        let joint = |parent, t: Vec3| Joint {
            name: String::new(),
            parent,
            rest: Placement::Parts(Transform {
                translation: t,
                rotation: Quat::from_rotation_x(0.4),
                scale: Vec3::new(1.0, 2.0, 3.0),
            }),
        };
        let skeleton =
            Skeleton::new(vec![joint(None, Vec3::X), joint(Some(0), Vec3::Y), joint(Some(1), Vec3::Z)]);
        let turns = [Quat::from_rotation_y(1.0), Quat::from_rotation_z(-2.0)];
        let values = turns.iter().flat_map(|q| q.to_array()).collect();
        let places = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let clip = sampled(
            String::new(),
            50.0,
            [(1, Property::Rotation, values), (0, Property::Translation, places)],
        );
        let before =
            SkeletalMotion { skeleton: skeleton.unwrap(), clip: clip.unwrap(), rate: 50.0, frames: 2 };
        let axes = [Mat3::from_cols(Vec3::X, -Vec3::Z, Vec3::Y), Mat3::from_cols(-Vec3::X, Vec3::Y, Vec3::Z)];
        for axes in axes {
            let mut after = before.clone();
            after.transform(axes, 0.01).unwrap();
            for frame in 0..2 {
                let ends = |m: &SkeletalMotion| {
                    let joints = m.skeleton.to_skeleton(&m.pose(frame)).unwrap();
                    joints.iter().map(|j| j.w_axis.truncate()).collect::<Vec<_>>()
                };
                for (a, b) in ends(&after).into_iter().zip(ends(&before)) {
                    assert!(a.distance(axes * b * 0.01) < 1e-6, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn neighbours_lie_on_one_side() {
        let q = Quat::from_rotation_y(0.3);
        let mut all = [q, -q, Quat::from_rotation_y(0.4), -Quat::from_rotation_y(0.5)];
        continuous(&mut all);
        assert!(all.windows(2).all(|w| w[0].dot(w[1]) > 0.0));
    }
}
