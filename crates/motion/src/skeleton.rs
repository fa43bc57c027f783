//! Joints that carry one another.

use glam::{Mat4, Quat, Vec3};
use std::collections::BTreeMap;

/// Scale, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// In the parent's coordinates.
    pub translation: Vec3,
    /// Of any length; one without a direction turns nothing.
    pub rotation: Quat,
    /// Along the joint's own axes.
    pub scale: Vec3,
}

impl Transform {
    /// Where the parent is.
    pub const IDENTITY: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// To the parent's coordinates.
    pub fn matrix(&self) -> Mat4 {
        let length = self.rotation.length();
        let unit = length > 1e-6 && length.is_finite();
        let rotation = if unit { self.rotation / length } else { Quat::IDENTITY };
        Mat4::from_scale_rotation_translation(self.scale, rotation, self.translation)
    }
}

/// Where a joint is in its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// In parts, as clips move them.
    Parts(Transform),
    /// As a whole.
    Matrix(Mat4),
}

impl Placement {
    /// To the parent's coordinates.
    pub fn matrix(&self) -> Mat4 {
        match self {
            Self::Parts(parts) => parts.matrix(),
            Self::Matrix(matrix) => *matrix,
        }
    }
}

/// A joint: any frame that carries others, whether a bone or not.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// For people.
    pub name: String,
    /// Which joint carries it; none carries a root.
    pub parent: Option<usize>,
    /// Where it is while nothing moves it.
    pub rest: Placement,
}

/// Joints in trees.
#[derive(Clone, Debug, Default)]
pub struct Skeleton {
    joints: Vec<Joint>,
    /// Parents before children.
    order: Vec<usize>,
}

/// Where the joints of a skeleton are, and what its clips say of shapes.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Of each joint in its parent.
    pub placements: Vec<Placement>,
    /// Weights of morph targets, by joint; those of a joint that is not named are as the mesh has them.
    pub weights: BTreeMap<usize, Vec<f32>>,
}

impl Pose {
    /// On the way to another pose of the same skeleton: straight, and by the shortest turns. Matrices stay those of the nearer.
    pub fn toward(&self, other: &Self, t: f32) -> Self {
        let mut pose = if t < 0.5 { self.clone() } else { other.clone() };
        for ((p, a), b) in pose.placements.iter_mut().zip(&self.placements).zip(&other.placements) {
            if let (Placement::Parts(a), Placement::Parts(b)) = (a, b) {
                *p = Placement::Parts(Transform {
                    translation: a.translation.lerp(b.translation, t),
                    rotation: a.rotation.slerp(b.rotation, t),
                    scale: a.scale.lerp(b.scale, t),
                });
            }
        }
        pose
    }
}

/// Why joints are no skeleton, or a pose none of it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SkeletonError {
    /// A parent that is not there.
    #[error("joint {joint} hangs on joint {parent}, but there are only {count}")]
    Parent {
        /// Which joint.
        joint: usize,
        /// What carries it.
        parent: usize,
        /// How many there are.
        count: usize,
    },
    /// Joints that carry each other.
    #[error("joint {0} carries itself in a circle")]
    Circle(usize),
    /// NaN or infinity.
    #[error("the transform of joint {joint} ('{name}') is not finite")]
    NotFinite {
        /// Which joint.
        joint: usize,
        /// Its name.
        name: String,
    },
}

impl Skeleton {
    /// Of joints that form trees.
    pub fn new(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        let count = joints.len();
        let mut children = vec![Vec::new(); count];
        let mut order = Vec::with_capacity(count);
        for (i, joint) in joints.iter().enumerate() {
            match joint.parent {
                None => order.push(i),
                Some(parent) => {
                    children.get_mut(parent).ok_or(SkeletonError::Parent { joint: i, parent, count })?.push(i)
                }
            }
        }
        let mut next = 0;
        while let Some(&joint) = order.get(next) {
            order.append(&mut children[joint]);
            next += 1;
        }
        if order.len() < count {
            let mut reached = vec![false; count];
            order.iter().for_each(|&i| reached[i] = true);
            return Err(SkeletonError::Circle(reached.iter().position(|r| !r).unwrap_or(0)));
        }
        Ok(Self { joints, order })
    }

    /// The joints.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Their indices, parents before children.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// The pose in which nothing moves.
    pub fn rest(&self) -> Pose {
        Pose { placements: self.joints.iter().map(|j| j.rest).collect(), weights: BTreeMap::new() }
    }

    /// Each joint's matrix to the coordinates of the skeleton.
    pub fn to_skeleton(&self, pose: &Pose) -> Result<Vec<Mat4>, SkeletonError> {
        let mut matrices = vec![Mat4::IDENTITY; self.joints.len()];
        for &i in &self.order {
            let joint = &self.joints[i];
            let own = pose.placements.get(i).unwrap_or(&joint.rest).matrix();
            let matrix = joint.parent.map_or(Mat4::IDENTITY, |parent| matrices[parent]) * own;
            if !matrix.is_finite() {
                return Err(SkeletonError::NotFinite { joint: i, name: joint.name.clone() });
            }
            matrices[i] = matrix;
        }
        Ok(matrices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joint(parent: Option<usize>, x: f32) -> Joint {
        let rest = Transform { translation: Vec3::X * x, ..Transform::IDENTITY };
        Joint { name: format!("at {x}"), parent, rest: Placement::Parts(rest) }
    }

    #[test]
    fn joints_carry_one_another_in_any_order() {
        let arm = Skeleton::new(vec![joint(Some(2), 1.0), joint(None, 7.0), joint(Some(1), 2.0)]).unwrap();
        let mut pose = arm.rest();
        let ends =
            |pose: &Pose| arm.to_skeleton(pose).unwrap().iter().map(|m| m.w_axis.x).collect::<Vec<_>>();
        assert_eq!(ends(&pose), [10.0, 7.0, 9.0]);
        // A quarter turn of the middle joint about z turns what it carries upwards; its length is of no matter.
        let Placement::Parts(middle) = &mut pose.placements[2] else { panic!() };
        middle.rotation = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2) * 3.0;
        let tip = arm.to_skeleton(&pose).unwrap()[0].w_axis;
        assert!(tip.distance(glam::vec4(9.0, 1.0, 0.0, 1.0)) < 1e-6, "{tip}");
        pose.placements[1] = Placement::Matrix(Mat4::from_translation(Vec3::Y * f32::INFINITY));
        assert_eq!(
            arm.to_skeleton(&pose).unwrap_err(),
            SkeletonError::NotFinite { joint: 1, name: "at 7".into() }
        );
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let parent = Skeleton::new(vec![joint(Some(3), 0.0)]).unwrap_err();
        assert_eq!(parent, SkeletonError::Parent { joint: 0, parent: 3, count: 1 });
        let circle = Skeleton::new(vec![joint(None, 0.0), joint(Some(2), 0.0), joint(Some(1), 0.0)]);
        assert_eq!(circle.unwrap_err(), SkeletonError::Circle(1));
    }
}
