//! What wears a garment: capsules on joints.

use super::GarmentError;
use crate::cloth::{Solid, Stance};
use crate::dance::{BONES, player};
use crate::{Placement, RigidPose};
use glam::{Vec2, Vec3};

/// A round piece of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// Index of the joint that carries it.
    pub joint: usize,
    /// Both ends, in the joint's coordinates, m.
    pub ends: [Vec3; 2],
    /// Radii there, m.
    pub radii: [f32; 2],
}

impl Capsule {
    /// The sphere of it at a part of the way from its first end to its second, where the joint that carries it is at `pose`: its middle
    /// and its radius, m.
    pub fn sphere(&self, pose: &RigidPose, part: f32) -> (Vec3, f32) {
        let ([from, to], [r, s]) = (self.ends, self.radii);
        (pose.rotation * from.lerp(to, part) + pose.position, r + (s - r) * part)
    }

    /// How far a point is from its surface where the joint that carries it is at `pose`, m, negative within, and the unit direction away
    /// from it.
    pub fn distance(&self, pose: &RigidPose, point: Vec3) -> (f32, Vec3) {
        let solid = Solid::Capsule { ends: self.ends, radii: self.radii };
        let (d, n) = solid.distance(pose.rotation.inverse() * (point - pose.position));
        (d, pose.rotation * n)
    }
}

/// A body as cloth meets it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Body {
    /// What it is made of, at most 63.
    pub capsules: Vec<Capsule>,
    /// Which of them are trunk and thighs, that arms may rest on.
    pub trunk: Vec<usize>,
    /// The joint that carries the belt: the pelvis.
    pub pelvis: usize,
    /// The joints of the left and the right arm, at the upper arm, which tells where the shoulder is, the forearm and the hand.
    pub arms: [[usize; 3]; 2],
    /// How far above the pelvis' joint a robe is tied, m.
    pub tied: f32,
}

/// Radii of the player of [`crate::dance`] as dressed, m: by index of the joint in [`crate::solve::PERFORMER`], at it and at where
/// it ends. The trunk is that of a person under padding, as players wear it.
const RADII: [[f32; 2]; 19] = [
    [0.150, 0.145],
    [0.145, 0.145],
    [0.145, 0.100],
    [0.058, 0.058],
    [0.095, 0.090],
    [0.065, 0.060],
    [0.058, 0.048],
    [0.045, 0.035],
    [0.036, 0.026],
    [0.065, 0.060],
    [0.058, 0.048],
    [0.045, 0.035],
    [0.036, 0.026],
    [0.098, 0.065],
    [0.062, 0.045],
    [0.045, 0.035],
    [0.098, 0.065],
    [0.062, 0.045],
    [0.045, 0.035],
];

/// Index of the head.
const HEAD: usize = 4;
/// Of pelvis, waist, chest and thighs.
const TRUNK: [usize; 5] = [0, 1, 2, 13, 16];

impl Body {
    /// The player of [`crate::dance`], from joint to joint.
    pub fn player() -> Self {
        let joints = player();
        let child = |i: usize| {
            let carried = joints.iter().enumerate().filter(|(_, j)| j.parent == Some(i));
            // The pelvis carries the waist, the chest the neck: the first of each.
            carried.map(|(k, _)| k).next()
        };
        let at = |k: usize| match joints[k].rest {
            Placement::Parts(parts) => parts.translation,
            Placement::Matrix(m) => m.w_axis.truncate(),
        };
        let mut capsules: Vec<Capsule> = (0..BONES.len())
            .map(|joint| Capsule {
                joint,
                ends: [Vec3::ZERO, child(joint).map_or(Vec3::ZERO, at)],
                radii: RADII[joint],
            })
            .collect();
        // A head is round, and above the neck.
        capsules[HEAD].ends = [Vec3::new(0.0, 0.07, 0.01), Vec3::new(0.0, 0.09, 0.0)];
        // Trunks are wider than deep.
        for (joint, from, to, x, radii) in [
            (0, -0.03, 0.10, 0.055, [0.125, 0.125]),
            (1, -0.02, 0.15, 0.045, [0.120, 0.120]),
            (2, 0.0, 0.13, 0.065, [0.115, 0.085]),
        ] {
            for side in [1.0, -1.0] {
                let ends = [from, to].map(|y| Vec3::new(side * x, y, 0.0));
                capsules.push(Capsule { joint, ends, radii });
            }
        }
        let trunk = (0..capsules.len()).filter(|k| TRUNK.contains(&capsules[*k].joint)).collect();
        Self { capsules, trunk, pelvis: 0, arms: [[6, 7, 8], [10, 11, 12]], tied: 0.04 }
    }

    /// So many times as thick.
    pub fn thicker(&self, girth: f32) -> Self {
        let thicker = |c: &Capsule| Capsule { radii: c.radii.map(|r| r * girth), ..*c };
        Self { capsules: self.capsules.iter().map(thicker).collect(), ..self.clone() }
    }

    /// Whether it can be dressed: at most 63 capsules, on joints that there are.
    pub fn check(&self, joints: usize) -> Result<(), GarmentError> {
        let wrong = |problem: String| Err(GarmentError::Body(problem));
        if self.capsules.is_empty() || self.capsules.len() > 63 {
            return wrong(format!("has {} capsules; 1 to 63 were expected", self.capsules.len()));
        }
        if let Some(k) = self.trunk.iter().find(|k| **k >= self.capsules.len()) {
            return wrong(format!("names capsule {k}, but there are only {}", self.capsules.len()));
        }
        let named =
            self.capsules.iter().map(|c| c.joint).chain([self.pelvis]).chain(self.arms.into_iter().flatten());
        if let Some(joint) = named.into_iter().find(|j| *j >= joints) {
            return wrong(format!("names joint {joint}, but there are only {joints} poses"));
        }
        Ok(())
    }

    /// Its capsules as bodies of a cloth that keeps `clearance` from them, m.
    pub(super) fn solids(&self, clearance: f32) -> impl Iterator<Item = Solid> {
        self.capsules
            .iter()
            .map(move |c| Solid::Capsule { ends: c.ends, radii: c.radii.map(|r| r + clearance) })
    }

    /// Where they are.
    ///
    /// # Panics
    /// Where [`Body::check`] finds fault with so many poses.
    pub fn stances(&self, poses: &[RigidPose]) -> impl Iterator<Item = Stance> {
        self.capsules.iter().map(|c| stance(&poses[c.joint]))
    }

    /// Discs in which horizontal planes between two heights cut it: middles (x, z) and radii.
    pub(super) fn discs(&self, poses: &[RigidPose], heights: [f32; 2]) -> Vec<(Vec2, f32)> {
        let mut discs = Vec::new();
        let [low, high] = heights;
        for c in &self.capsules {
            // Spheres along it, a hundred to the metre.
            let count = (c.ends[0].distance(c.ends[1]) / 0.01).ceil().clamp(1.0, 200.0) as usize;
            for k in 0..=count {
                let (p, r) = c.sphere(&poses[c.joint], k as f32 / count as f32);
                let beside = (p.y - p.y.clamp(low, high)).abs();
                if beside < r {
                    discs.push((Vec2::new(p.x, p.z), (r * r - beside * beside).sqrt()));
                }
            }
        }
        discs
    }
}

/// A pose as cloth takes it.
pub(super) fn stance(pose: &RigidPose) -> Stance {
    Stance { rotation: pose.rotation, origin: pose.position }
}
