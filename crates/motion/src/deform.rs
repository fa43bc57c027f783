//! Meshes that deform: morph targets, then linear blend skinning (glTF 2.0, 3.7.2.2 and 3.7.3.3).

use glam::{Mat4, Vec3, Vec4};

/// The vertices of a mesh, each with a normal and a tangent where there are such.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Where they are.
    pub positions: Vec<Vec3>,
    /// Empty, or one per vertex.
    pub normals: Vec<Vec3>,
    /// Empty, or one per vertex with the bitangent's sign in w.
    pub tangents: Vec<Vec4>,
}

/// How far a mesh moves at weight 1. Each is empty or has one per vertex.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Of vertices.
    pub positions: Vec<Vec3>,
    /// Of normals.
    pub normals: Vec<Vec3>,
    /// Of tangents.
    pub tangents: Vec<Vec3>,
}

/// Joints that deform meshes.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Indices of joints of a skeleton, all of which it has.
    pub joints: Vec<usize>,
    /// From the mesh's coordinates to those of each joint; the identity where there are fewer than joints.
    pub inverse_bind: Vec<Mat4>,
}

impl Skin {
    /// The matrices that take vertices to the skeleton's coordinates, one per joint of the skin, from those of all
    /// joints ([`crate::Skeleton::to_skeleton`]).
    pub fn matrices(&self, joints: &[Mat4]) -> Vec<Mat4> {
        let inverse = self.inverse_bind.iter().chain(std::iter::repeat(&Mat4::IDENTITY));
        self.joints.iter().zip(inverse).map(|(&j, inverse)| joints[j] * *inverse).collect()
    }
}

/// Which joints of a skin bend each vertex, and how much: so many per vertex, one vertex after the other.
#[derive(Clone, Debug, Default)]
pub struct Influences {
    per_vertex: usize,
    joints: Vec<u32>,
    weights: Vec<f32>,
}

/// Why influences are none of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SkinError {
    /// Too few for its vertices.
    #[error("a skinned mesh has fewer joints than vertices")]
    Few,
    /// A joint that the skin has not.
    #[error("a vertex hangs on joint {joint}, but the skin has only {count}")]
    Joint {
        /// Index in the skin.
        joint: u32,
        /// How many the skin has.
        count: usize,
    },
}

impl Influences {
    /// So many joints of a skin that has `skin` of them, and weights, for each of `vertices`. Joints without weight may be
    /// any number.
    pub fn new(
        per_vertex: usize,
        joints: Vec<u32>,
        weights: Vec<f32>,
        vertices: usize,
        skin: usize,
    ) -> Result<Self, SkinError> {
        if per_vertex == 0 || joints.len().min(weights.len()) / per_vertex < vertices {
            return Err(SkinError::Few);
        }
        let mut used = joints.iter().zip(&weights).filter(|(_, w)| **w != 0.0);
        if let Some((&joint, _)) = used.find(|(j, _)| **j as usize >= skin) {
            return Err(SkinError::Joint { joint, count: skin });
        }
        Ok(Self { per_vertex, joints, weights })
    }

    /// Of each vertex the joint of the skin that bends it most.
    pub fn strongest(&self) -> impl Iterator<Item = usize> {
        let each = self.joints.chunks_exact(self.per_vertex).zip(self.weights.chunks_exact(self.per_vertex));
        each.map(|(joints, weights)| {
            let most = joints.iter().zip(weights).max_by(|a, b| a.1.total_cmp(b.1));
            most.map_or(0, |(j, _)| *j as usize)
        })
    }
}

impl Vertices {
    /// Adds what morph targets say, each by its weight; weights that are not finite count as none.
    pub fn morph(&mut self, targets: &[MorphTarget], weights: &[f32]) {
        for (target, &weight) in targets.iter().zip(weights).filter(|(_, w)| w.is_finite() && **w != 0.0) {
            for (p, d) in self.positions.iter_mut().zip(&target.positions) {
                *p += weight * *d;
            }
            for (n, d) in self.normals.iter_mut().zip(&target.normals) {
                *n += weight * *d;
            }
            for (t, d) in self.tangents.iter_mut().zip(&target.tangents) {
                *t += (weight * *d).extend(0.0);
            }
        }
    }

    /// Moves each vertex by the mean of its joints' matrices ([`Skin::matrices`]).
    pub fn skin(&mut self, influences: &Influences, matrices: &[Mat4]) {
        let Influences { per_vertex, joints, weights } = influences;
        let each = joints.chunks_exact(*per_vertex).zip(weights.chunks_exact(*per_vertex));
        for (k, (joints, weights)) in each.take(self.positions.len()).enumerate() {
            let mut m = Mat4::ZERO;
            let mut sum = 0.0;
            for (&j, &w) in joints.iter().zip(weights) {
                if w != 0.0 {
                    m += matrices[j as usize] * w;
                    sum += w;
                }
            }
            if sum <= 0.0 {
                continue;
            }
            let m = m * (1.0 / sum);
            self.positions[k] = m.transform_point3(self.positions[k]);
            // Joints turn and scale evenly, as good as always.
            if let Some(n) = self.normals.get_mut(k) {
                *n = m.transform_vector3(*n);
            }
            if let Some(t) = self.tangents.get_mut(k) {
                *t = m.transform_vector3(t.truncate()).extend(t.w);
            }
        }
    }

    /// Makes normals unit again, and tangents unit and upright to them.
    pub fn normalize(&mut self) {
        for n in &mut self.normals {
            *n = n.normalize_or(Vec3::Z);
        }
        for (t, n) in self.tangents.iter_mut().zip(&self.normals) {
            let along = (t.truncate() - *n * n.dot(t.truncate())).normalize_or(n.any_orthonormal_vector());
            *t = along.extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn two() -> Vertices {
        Vertices {
            positions: vec![Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 2],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 2],
        }
    }

    #[test]
    fn targets_add_up_by_their_weights() {
        let to = |p: Vec3| MorphTarget { positions: vec![p; 2], normals: vec![Vec3::X; 2], tangents: vec![] };
        let mut mesh = two();
        mesh.morph(&[to(Vec3::Z), to(Vec3::ONE), to(Vec3::X)], &[0.5, f32::NAN, 2.0]);
        assert_eq!(mesh.positions[0], Vec3::new(3.0, 0.0, 0.5));
        mesh.normalize();
        assert!((mesh.normals[0] - Vec3::new(2.5, 0.0, 1.0).normalize()).length() < 1e-6);
        // Upright to the new normal, on its side.
        assert!(mesh.tangents[0].truncate().dot(mesh.normals[0]).abs() < 1e-6);
        assert!(mesh.tangents[0].x > 0.0 && mesh.tangents[0].w == -1.0);
    }

    #[test]
    fn a_skin_that_has_not_moved_bends_nothing_and_one_that_turns_turns_all() {
        let bind = Mat4::from_translation(Vec3::new(0.0, 2.0, 0.0));
        let skin = Skin { joints: vec![1, 0], inverse_bind: vec![bind.inverse()] };
        let influences = Influences::new(2, vec![0, 1, 0, 9], vec![1.0, 3.0, 0.5, 0.0], 2, 2).unwrap();
        let mut mesh = two();
        mesh.skin(&influences, &skin.matrices(&[Mat4::IDENTITY, bind]));
        assert_eq!(mesh, two());
        let turn = Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2));
        mesh.skin(&influences, &skin.matrices(&[turn, turn * bind]));
        mesh.normalize();
        assert!(mesh.positions[0].distance(Vec3::Y) < 1e-6 && mesh.positions[1].distance(-Vec3::X) < 1e-6);
        assert!(mesh.tangents[1].distance(Vec4::new(0.0, 1.0, 0.0, -1.0)) < 1e-6);
    }

    #[test]
    fn influences_that_make_no_sense_are_refused() {
        let new = |joints: &[u32], vertices| {
            Influences::new(2, joints.to_vec(), vec![1.0; joints.len()], vertices, 2).unwrap_err()
        };
        assert_eq!(new(&[0, 1], 2), SkinError::Few);
        assert_eq!(new(&[0, 2], 1), SkinError::Joint { joint: 2, count: 2 });
    }
}
