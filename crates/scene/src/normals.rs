//! Thürmer and Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets".

use super::Mesh;
use glam::{Mat3, Vec3};

impl Mesh {
    /// Gives every vertex whose normal is missing (zero or absent) the mean of its triangles' normals, each
    /// weighted by the triangle's angle there, as seen after `linear`, the linear part of the shape's
    /// `to_world`: weights by angle are not affine invariant, and a mirror turns the triangles over.
    pub fn complete_normals(&mut self, linear: Mat3) {
        self.normals.resize(self.positions.len(), Vec3::ZERO);
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for t in &self.triangles {
            let p = t.map(|i| linear * self.positions[i as usize]);
            let Some(n) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else { continue };
            for k in 0..3 {
                let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                sums[t[k] as usize] += n * a.angle_between(b);
            }
        }
        // n_world = linear⁻ᵀ n, so n = linearᵀ n_world.
        let back = linear.transpose();
        for (normal, sum) in self.normals.iter_mut().zip(sums) {
            if *normal == Vec3::ZERO {
                // A vertex of degenerate triangles only has no normal of its own; any unit vector does.
                *normal = (back * sum).try_normalize().unwrap_or(Vec3::X);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_of_a_box_points_along_the_diagonal_however_its_sides_are_cut() {
        // Three sides of a cube around the origin, one of them cut so that two triangles meet there.
        let mesh = |linear: Mat3| {
            let p = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]];
            let mut m = Mesh {
                positions: p.map(|q| Vec3::from(q.map(|x| x as f32))).to_vec(),
                triangles: vec![[0, 4, 1], [0, 2, 4], [0, 3, 2], [0, 1, 3]],
                ..Mesh::default()
            };
            m.complete_normals(linear);
            m
        };
        let n = mesh(Mat3::IDENTITY).normals[0];
        assert!((n + Vec3::ONE.normalize()).length() < 1e-6, "{n}");
        // After a stretch along z the world normals still are the axes, so the sum of world normals is
        // (−1, −1, −1) again, and pulled back it leans on z.
        let n = mesh(Mat3::from_diagonal(Vec3::new(1.0, 1.0, 4.0))).normals[0];
        assert!((n + Vec3::new(1.0, 1.0, 4.0).normalize()).length() < 1e-6, "{n}");
        // A mirror turns the triangles over, so the world normal points to the other side of the surface.
        let n = mesh(Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0))).normals[0];
        assert!((n - Vec3::ONE.normalize()).length() < 1e-6, "{n}");
    }

    #[test]
    fn normals_that_are_there_stay() {
        let mut m = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::X, Vec3::ZERO],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        m.complete_normals(Mat3::IDENTITY);
        assert_eq!(m.normals, [Vec3::X, Vec3::Z, Vec3::Z]);
    }
}
