//! Who wears a garment: a skeleton of any make, which of its joints is what of a body, and how it stands in the T-pose.
//!
//! Joints of limbs are known by their names (Mixamo, SMPL, Acclaim, Blender's and the performer's of [`crate::solve`] among others);
//! pelvis and chest are what carries both legs and both arms. About these lie the capsules of [`Body::player`], as long as the bones
//! are and as thick as the figure is large, or as the mesh is that hangs on them ([`Wearer::fill`]).

mod lead;
mod names;

use super::{Body, Capsule, GarmentError};
use crate::dance::BONES;
use crate::names::PARTS;
use crate::solve::PERFORMER;
use crate::{RigidPose, Skeleton};
use glam::{Mat3, Quat, Vec3};
use lead::{Lead, carried, local};
use names::Found;

/// A figure that puts a garment on. In its own coordinates it faces +z in the first frame, its pelvis above the origin.
#[derive(Clone, Debug)]
pub struct Wearer {
    /// What cloth meets.
    pub body: Body,
    /// Its height to the player's, by what is between ankles and shoulders.
    pub size: f32,
    /// Parents before children, each with its parent.
    tree: Vec<(usize, Option<usize>)>,
    /// In the T-pose, upright with the arms spread, and in the first frame.
    t_pose: Vec<RigidPose>,
    first: Vec<RigidPose>,
    /// How it comes to the first frame, and where it stands before.
    lead: Lead,
    begin: Vec<RigidPose>,
    /// From the world to its own coordinates: a turn about y, then a shift.
    turn: Quat,
    shift: Vec3,
}

fn mean(points: [Vec3; 2]) -> Vec3 {
    0.5 * (points[0] + points[1])
}

/// Where the joints of the player are in the T-pose.
fn player() -> [Vec3; 19] {
    let mut at = [Vec3::ZERO; 19];
    for i in 0..19 {
        let parent = PERFORMER.iter().position(|(name, _)| *name == PERFORMER[i].1);
        at[i] = Vec3::from(BONES[i]) + parent.map_or(Vec3::ZERO, |p| at[p]);
    }
    at
}

/// From the player's hand to where it ends, and from the ankle to the toes, m.
const HAND: f32 = 0.17;
const TOES: Vec3 = Vec3::new(0.0, -0.06, 0.15);

impl Wearer {
    /// A figure whose joints are at `rest` where nothing moves them and at `first` in the first frame, both in the world, m. `named`
    /// says which joints are what (`left_upper_arm`, and the joint's name), where names do not.
    ///
    /// # Errors
    /// A skeleton of which limbs, head or trunk are not found, or have no length.
    pub fn new(
        skeleton: &Skeleton,
        rest: &[RigidPose],
        first: &[RigidPose],
        named: &[(String, String)],
    ) -> Result<Self, GarmentError> {
        let count = skeleton.joints().len();
        let finite = |p: &RigidPose| p.position.is_finite() && p.rotation.is_finite();
        if rest.len() != count || first.len() != count || !rest.iter().chain(first).all(finite) {
            return Err(GarmentError::Body("has a joint at no place".into()));
        }
        let found = Found::new(skeleton, named)?;
        let tree: Vec<_> = skeleton.order().iter().map(|j| (*j, skeleton.joints()[*j].parent)).collect();
        let mut t_pose = t_pose(&found, &tree, rest)?;
        let [left, right] = found.limbs;
        let of = |poses: &[RigidPose], k: usize| [poses[left[k]].position, poses[right[k]].position];
        // Its left in the first frame.
        let thighs = of(first, 3);
        let across = (thighs[0] - thighs[1]).with_y(0.0).normalize_or(Vec3::X);
        let turn = Quat::from_rotation_y(across.z.atan2(across.x));
        let shift = -(turn * first[found.pelvis].position).with_y(0.0);
        let place =
            |p: &RigidPose| RigidPose { position: turn * p.position + shift, rotation: turn * p.rotation };
        let first: Vec<RigidPose> = first.iter().map(place).collect();
        let lowest =
            |poses: &[RigidPose]| of(poses, 5).map(|p| p.y).into_iter().fold(f32::INFINITY, f32::min);
        let (up, pelvis) = (lowest(&first) - lowest(&t_pose), t_pose[found.pelvis].position);
        t_pose.iter_mut().for_each(|p| p.position += Vec3::new(-pelvis.x, up, -pelvis.z));
        let tall = |arms: Vec3, ankles: Vec3| arms.y - ankles.y;
        let at = player();
        let size = tall(mean(of(&t_pose, 0)), mean(of(&t_pose, 5))) / tall(at[6], at[15]);
        if !(0.02..=50.0).contains(&size) {
            return Err(GarmentError::Body(format!(
                "is {:.3} times as tall as a player; .02 to 50 were expected",
                size
            )));
        }
        let body = body(&found, &tree, &t_pose, size);
        Ok(Self { body, size, tree, t_pose, begin: first.clone(), first, lead: Lead::default(), turn, shift })
    }

    /// Makes the body as thick as a mesh that hangs on its joints: of each of its vertices the joint that moves it most and where it is in
    /// the coordinates of that joint, m.
    pub fn fill(&mut self, vertices: impl IntoIterator<Item = (usize, Vec3)>) {
        let mut parent = vec![None; self.t_pose.len()];
        self.tree.iter().for_each(|(j, p)| parent[*j] = *p);
        // Of each joint's vertices nearer to the first or the second end of what they lie about: distances to radii there.
        let mut ratios: Vec<[Vec<f32>; 2]> = vec![Default::default(); self.t_pose.len()];
        for (joint, p) in vertices {
            let Some(pose) = self.t_pose.get(joint) else { continue };
            let world = pose.rotation * p + pose.position;
            let mut at = Some(joint);
            let own = std::iter::from_fn(|| {
                let now = at?;
                at = parent[now];
                Some(now)
            })
            .find(|j| self.body.capsules.iter().any(|c| c.joint == *j));
            let Some(own) = own else { continue };
            let local = self.t_pose[own].rotation.inverse() * (world - self.t_pose[own].position);
            let of = self.body.capsules.iter().filter(|c| c.joint == own).map(|c| {
                let along = c.ends[1] - c.ends[0];
                let t = ((local - c.ends[0]).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
                let radius = c.radii[0] + (c.radii[1] - c.radii[0]) * t;
                (local.distance(c.ends[0] + along * t) / radius, usize::from(t > 0.5))
            });
            if let Some((ratio, end)) = of.min_by(|a, b| a.0.total_cmp(&b.0)) {
                ratios[own][end].push(ratio);
            }
        }
        for (joint, mut both) in ratios.into_iter().enumerate() {
            let thick = both.each_mut().map(|ratios| {
                ratios.sort_unstable_by(f32::total_cmp);
                let most = ratios.get((ratios.len().max(1) - 1) * 9 / 10).filter(|_| ratios.len() >= FEW);
                most.copied().filter(|t| *t >= STICK).map(|t| t.min(THICKEST))
            });
            let Some(other) = thick[0].or(thick[1]) else { continue };
            for c in self.body.capsules.iter_mut().filter(|c| c.joint == joint) {
                let of = |end: usize| c.radii[end] * thick[end].unwrap_or(other);
                c.radii = [of(0), of(1)];
            }
        }
    }

    /// On the way from how it stands in the T-pose, at 0, to where it begins to move, at 1: in the first frame or before it
    /// ([`Wearer::lead`]); in its own coordinates.
    pub fn approach(&self, t: f32) -> Vec<RigidPose> {
        let mut all = self.begin.clone();
        for (j, parent) in &self.tree {
            let [a, b] = [&self.t_pose, &self.begin].map(|poses| local(poses, *j, *parent));
            let (position, rotation) = (a.position.lerp(b.position, t), a.rotation.slerp(b.rotation, t));
            all[*j] = carried(&all, RigidPose { position, rotation }, *parent);
        }
        all
    }

    /// Poses of the world in its own coordinates.
    pub fn own(&self, poses: &mut [RigidPose]) {
        for p in poses {
            *p =
                RigidPose { position: self.turn * p.position + self.shift, rotation: self.turn * p.rotation };
        }
    }

    /// A direction of the world in its own coordinates.
    pub fn own_direction(&self, direction: Vec3) -> Vec3 {
        self.turn * direction
    }

    /// A point of its own coordinates in the world.
    pub fn to_world(&self, p: Vec3) -> Vec3 {
        self.turn.inverse() * (p - self.shift)
    }

    /// The lowest point of the body in the first frame, m.
    pub fn sole(&self) -> f32 {
        let of = |c: &Capsule| {
            let pose = &self.first[c.joint];
            let ends = [0, 1].map(|k| (pose.rotation * c.ends[k] + pose.position).y - c.radii[k]);
            ends[0].min(ends[1])
        };
        self.body.capsules.iter().map(of).fold(f32::INFINITY, f32::min)
    }
}

/// Fewer vertices than these tell nothing of how thick a limb is.
const FEW: usize = 8;
/// What is thinner than so many times the player is sticks, and no body; hats and weapons are none either.
const STICK: f32 = 0.4;
const THICKEST: f32 = 2.5;

/// How it stands in the T-pose, upright with its arms spread to the sides and its legs together, facing +z, wherever.
fn t_pose(
    found: &Found,
    tree: &[(usize, Option<usize>)],
    rest: &[RigidPose],
) -> Result<Vec<RigidPose>, GarmentError> {
    let [left, right] = found.limbs;
    let at = |j: usize| rest[j].position;
    let middle = |k: usize| mean([at(left[k]), at(right[k])]);
    let up = (middle(0) - middle(3)).normalize_or_zero();
    let across = mean([at(left[0]), at(left[3])]) - mean([at(right[0]), at(right[3])]);
    let across = across.reject_from_normalized(up).normalize_or_zero();
    if up == Vec3::ZERO || across == Vec3::ZERO {
        return Err(GarmentError::Body("has its arms where its legs are, or both sides in one place".into()));
    }
    let upright = Quat::from_mat3(&Mat3::from_cols(across, up, across.cross(up)).transpose()).normalize();
    let mut turns: Vec<Option<Quat>> = vec![None; rest.len()];
    for (limb, out) in [(left, Vec3::X), (right, Vec3::NEG_X)] {
        for (from, to, way) in [(0, 1, out), (1, 2, out), (3, 4, Vec3::NEG_Y), (4, 5, Vec3::NEG_Y)] {
            let bone = (upright * (at(limb[to]) - at(limb[from]))).normalize_or_zero();
            if bone == Vec3::ZERO {
                return Err(GarmentError::Body(format!("has a {} of no length", PARTS[from].0)));
            }
            turns[limb[from]] = Some(Quat::from_rotation_arc(bone, way) * upright);
        }
        turns[limb[5]] = Some(upright);
    }
    let mut poses = rest.to_vec();
    for (j, parent) in tree {
        let carried = parent.and_then(|p| turns[p]).unwrap_or(upright);
        let turn = *turns[*j].get_or_insert(carried);
        poses[*j].rotation = (turn * rest[*j].rotation).normalize();
        poses[*j].position = match parent {
            None => carried * at(*j),
            Some(p) => poses[*p].position + carried * (at(*j) - at(*p)),
        };
    }
    Ok(poses)
}

/// Capsules about the joints of a figure that stands in the T-pose.
fn body(found: &Found, tree: &[(usize, Option<usize>)], t_pose: &[RigidPose], size: f32) -> Body {
    let [left, right] = found.limbs;
    let parent = |j: usize| tree.iter().find(|(k, _)| *k == j).and_then(|(_, p)| *p);
    let at = |j: usize| t_pose[j].position;
    let middle = |k: usize| mean([at(left[k]), at(right[k])]);
    // From the chest down to the pelvis, and from the head to the chest.
    let path = |from: usize, to: usize| {
        let mut all = vec![from];
        while let Some(p) = all.last().and_then(|j| parent(*j)).filter(|_| all.last() != Some(&to)) {
            all.push(p);
        }
        all
    };
    let trunk = path(found.chest, found.pelvis);
    let neck = path(found.head, found.chest).iter().rev().nth(1).copied().filter(|j| *j != found.head);
    let player = player();
    let (hips, shoulders) = (middle(3), middle(0));
    // A point in the trunk of the player, in this one's.
    let within = |p: Vec3| {
        let t = (p.y - player[13].y) / (player[6].y - player[13].y);
        let axis = hips + (shoulders - hips) * t;
        axis + Vec3::new(p.x, 0.0, p.z) * size
    };
    let mut capsules = Vec::new();
    for c in Body::player().capsules {
        let (name, limb) = match PERFORMER[c.joint].0 {
            name if name.starts_with("left_") => (&name[5..], left),
            name if name.starts_with("right_") => (&name[6..], right),
            name => (name, left),
        };
        let side = if limb == left { Vec3::X } else { Vec3::NEG_X };
        let inside = c.ends.map(|p| within(player[c.joint] + p));
        let part = PARTS.iter().position(|(n, _)| *n == name);
        let (joint, ends) = match (name, part) {
            ("clavicle", _) => (parent(limb[0]).unwrap_or(found.chest), [inside[0], at(limb[0])]),
            ("neck", _) => (neck.unwrap_or(found.chest), [neck.map_or(inside[0], at), at(found.head)]),
            ("head", _) => (found.head, c.ends.map(|p| at(found.head) + p * size)),
            ("hand", _) => (limb[2], [at(limb[2]), at(limb[2]) + side * (HAND * size)]),
            ("foot", _) => (limb[5], [at(limb[5]), at(limb[5]) + TOES * size]),
            (_, Some(k)) => (limb[k], [at(limb[k]), at(limb[k + 1])]),
            _ => {
                let y = mean(inside).y;
                let carried = trunk.iter().find(|j| at(**j).y <= y + 1e-4);
                (*carried.unwrap_or(&found.pelvis), inside)
            }
        };
        let back = t_pose[joint].rotation.inverse();
        let ends = ends.map(|p| back * (p - at(joint)));
        capsules.push(Capsule { joint, ends, radii: c.radii.map(|r| r * size) });
    }
    let tied = Body::player().tied;
    let tied = within(player[0] + Vec3::Y * tied).y - at(found.pelvis).y;
    // In the order of the player's.
    let trunk = Body::player().trunk;
    Body { capsules, trunk, pelvis: found.pelvis, arms: [left, right].map(|l| [l[0], l[1], l[2]]), tied }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dance;
    use crate::{Joint, Placement, Transform};

    fn at(bone: Vec3) -> Placement {
        Placement::Parts(Transform { translation: bone, ..Transform::IDENTITY })
    }

    fn rest(skeleton: &Skeleton) -> Vec<RigidPose> {
        crate::skeletal::rigid(&skeleton.to_skeleton(&skeleton.rest()).unwrap())
    }

    /// The player as a skeleton of another make: other names, arms that hang, twice as large, lying on its back, far away.
    #[test]
    fn a_body_is_the_same_whatever_its_skeleton() {
        let names = [
            ("left_upper_arm", "LeftArm"),
            ("left_forearm", "LeftForeArm"),
            ("left_thigh", "LeftUpLeg"),
            ("left_shank", "LeftLeg"),
        ];
        let hanging = Quat::from_rotation_z(-1.2);
        let joints: Vec<Joint> = dance::player()
            .into_iter()
            .map(|mut j| {
                let Placement::Parts(mut parts) = j.rest else { panic!() };
                parts.translation *= 2.0;
                match j.name.as_str() {
                    "left_upper_arm" => parts.rotation = hanging,
                    "right_upper_arm" => parts.rotation = hanging.inverse(),
                    "pelvis" => parts.rotation = Quat::from_rotation_x(-1.5) * Quat::from_rotation_y(2.0),
                    _ => {}
                }
                let name = names.iter().find(|(n, _)| *n == j.name).map_or(j.name.as_str(), |n| n.1);
                j = Joint { name: format!("rig:{name}"), rest: Placement::Parts(parts), ..j };
                j
            })
            .collect();
        let other = Skeleton::new(joints).unwrap();
        let plain = Skeleton::new(dance::player()).unwrap();
        let [a, b] = [&plain, &other].map(|s| Wearer::new(s, &rest(s), &rest(&plain), &[]).unwrap());
        assert!((a.size - 1.0).abs() < 1e-3 && (b.size - 2.0).abs() < 1e-3, "{} {}", a.size, b.size);
        assert_eq!(a.body.capsules.len(), Body::player().capsules.len());
        let world = |w: &Wearer, c: &Capsule| {
            c.ends.map(|p| w.t_pose[c.joint].rotation * p + w.t_pose[c.joint].position)
        };
        let mut worst = 0.0f32;
        for (a_capsule, (b_capsule, own)) in
            a.body.capsules.iter().zip(b.body.capsules.iter().zip(Body::player().capsules))
        {
            let ([a0, a1], [b0, b1]) = (world(&a, a_capsule), world(&b, b_capsule));
            let up = b.t_pose[0].position.y - 2.0 * a.t_pose[0].position.y;
            assert!(
                (b0 - Vec3::Y * up).distance(2.0 * a0) < 1e-2
                    && (b1 - Vec3::Y * up).distance(2.0 * a1) < 1e-2
            );
            assert!((b_capsule.radii[0] / a_capsule.radii[0] - 2.0).abs() < 1e-3);
            // Of the player itself nearly what it has by hand.
            let pose = rest(&plain)[own.joint];
            for (have, want) in [a0, a1].into_iter().zip(own.ends) {
                worst = worst.max(have.distance(pose.rotation * want + pose.position));
            }
        }
        // Measured 1.2 cm, where the trunk leans back to the shoulders.
        assert!(worst < 0.05, "{worst}");
        println!("{worst} m from the player's own");
        assert!((a.body.tied - Body::player().tied).abs() < 1e-3, "{}", a.body.tied);
    }

    #[test]
    fn on_its_way_bones_keep_their_lengths_and_the_world_is_found_again() {
        let motion = dance::dance(&dance::parse("turn degrees=90\nhakobi steps=2").unwrap(), 60.0).unwrap();
        let last = motion.poses(motion.frames - 1).unwrap();
        let wearer = Wearer::new(&motion.skeleton, &rest(&motion.skeleton), &last, &[]).unwrap();
        let parts = wearer.approach(0.4);
        for (j, joint) in motion.skeleton.joints().iter().enumerate().filter(|(_, j)| j.parent.is_some()) {
            let parent = joint.parent.unwrap();
            let [want, have] = [&last, &parts].map(|p| p[j].position.distance(p[parent].position));
            assert!((want - have).abs() < 1e-4, "{}", joint.name);
        }
        let mut own = last.clone();
        wearer.own(&mut own);
        let end = wearer.approach(1.0);
        for ((own, end), world) in own.iter().zip(&end).zip(&last) {
            assert!(own.position.distance(end.position) < 1e-4);
            assert!(wearer.to_world(own.position).distance(world.position) < 1e-4);
        }
        // It faces +z: the left thigh is on its left.
        assert!(
            own[13].position.x > 0.05 && own[13].position.z.abs() < 0.01 && own[0].position.x.abs() < 1e-4
        );
    }

    #[test]
    fn a_mesh_says_how_thick_it_is() {
        let plain = Skeleton::new(dance::player()).unwrap();
        let mut wearer = Wearer::new(&plain, &rest(&plain), &rest(&plain), &[]).unwrap();
        let before = wearer.body.clone();
        // A shank of 8 cm all along, and one vertex of nothing.
        let ring = (0..64).map(|k| {
            let a = k as f32;
            (14, Vec3::new(0.08 * a.cos(), -0.38 * (k as f32 / 64.0), 0.08 * a.sin()))
        });
        wearer.fill(ring.chain([(99, Vec3::ZERO)]));
        for (now, then) in wearer.body.capsules.iter().zip(&before.capsules) {
            if now.joint == 14 {
                assert!((now.radii[0] - 0.08).abs() < 0.02 && now.radii[0] > then.radii[0], "{now:?}");
            } else {
                assert_eq!(now, then);
            }
        }
    }

    #[test]
    fn what_is_no_figure_is_told() {
        let said = |joints: Vec<Joint>, named: &[(&str, &str)]| {
            let skeleton = Skeleton::new(joints).unwrap();
            let named: Vec<_> = named.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
            Wearer::new(&skeleton, &rest(&skeleton), &rest(&skeleton), &named).unwrap_err().to_string()
        };
        let fox = vec![Joint { name: "tail".into(), parent: None, rest: at(Vec3::Y) }];
        assert!(said(fox, &[]).contains("left_upper_arm"));
        assert!(said(dance::player(), &[("left_hand", "hook")]).contains("no joint called 'hook'"));
        assert!(said(dance::player(), &[("tail", "head")]).contains("no part 'tail'"));
        assert!(said(dance::player(), &[("left_hand", "head")]).contains("does not begin"));
        let mut short = dance::player();
        short[7].rest = at(Vec3::ZERO);
        assert!(said(short, &[]).contains("no length"));
    }
}
