//! Texture coordinates of places on lines.
//!
//! A line knows the vertices that it runs between, one for each place ([`crate::topology`]); at a seam of the texture a place has several,
//! with coordinates from both sides. So they are those of a triangle beside the line.

use crate::contour::MeshPoint;
use glam::Vec2;
use yugen_scene::prepared::VertexRow;

/// Of a mesh.
#[derive(Clone, Debug)]
pub struct TextureCoordinates {
    /// The first vertex in the same place.
    point: Vec<u32>,
    /// Triangles around each point, from `first[point]` to `first[point + 1]`.
    first: Vec<u32>,
    around: Vec<u32>,
}

impl TextureCoordinates {
    /// The first vertex in the same place of each ([`crate::topology::Topology::points`]), and triangles that count from
    /// `first_vertex`.
    pub fn new(point: &[u32], triangles: &[[u32; 3]], first_vertex: u32) -> Self {
        let corners =
            || (0u32..).zip(triangles).flat_map(|(i, t)| t.map(|v| (i, point[(v - first_vertex) as usize])));
        let mut first = vec![0u32; point.len() + 1];
        corners().for_each(|(_, p)| first[p as usize + 1] += 1);
        for i in 1..first.len() {
            first[i] += first[i - 1];
        }
        let mut next = first.clone();
        let mut around = vec![0; 3 * triangles.len()];
        for (triangle, p) in corners() {
            around[next[p as usize] as usize] = triangle;
            next[p as usize] += 1;
        }
        Self { point: point.to_vec(), first, around }
    }

    /// At a place on a line; `vertices` and `triangles` as before.
    pub fn at(
        &self,
        mesh_point: &MeshPoint,
        vertices: &[VertexRow],
        triangles: &[[u32; 3]],
        first_vertex: u32,
    ) -> Vec2 {
        // How much of the place each point is.
        let mut parts: Vec<(u32, f32)> = Vec::with_capacity(4);
        for (end, part) in mesh_point.ends.iter().zip([1.0 - mesh_point.part, mesh_point.part]) {
            for (vertex, share) in end.vertices.iter().zip([1.0 - end.part, end.part]) {
                let Some(point) = self.point.get(*vertex as usize) else { return Vec2::ZERO };
                match parts.iter_mut().find(|(known, _)| known == point) {
                    Some((_, known)) => *known += part * share,
                    None => parts.push((*point, part * share)),
                }
            }
        }
        let corner = |triangle: u32, point: u32| {
            let corners = triangles[triangle as usize].map(|v| v - first_vertex);
            corners.into_iter().find(|v| self.point[*v as usize] == point)
        };
        let uv = |v: u32| Vec2::new(vertices[v as usize].u, vertices[v as usize].v);
        let of_triangle = |triangle: u32| -> Option<Vec2> {
            parts.iter().map(|(point, part)| Some(uv(corner(triangle, *point)?) * *part)).sum()
        };
        let p = parts[0].0 as usize;
        let around = &self.around[self.first[p] as usize..self.first[p + 1] as usize];
        // Of a line that leaves its triangles: as vertices are.
        let found = around.iter().find_map(|t| of_triangle(*t));
        found.unwrap_or_else(|| parts.iter().map(|(point, part)| uv(*point) * *part).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::Anchor;
    use crate::topology::{Creases, Topology};
    use yugen_scene::primitives;

    /// Of a ball, whose seam has coordinates of both sides: as the place on the triangle has them, however the ends are named.
    #[test]
    fn coordinates_at_a_seam_are_those_of_one_side() {
        let ball = primitives::ball(16);
        let rows: Vec<VertexRow> = (0..ball.positions.len())
            .map(|i| VertexRow {
                position: ball.positions[i].into(),
                normal: ball.normals[i].into(),
                u: ball.uvs[i].x,
                v: ball.uvs[i].y,
                tangent: [0.0; 4],
            })
            .collect();
        let topology = Topology::new(&rows, &ball.triangles, 0, &Creases::default(), true);
        let coordinates = TextureCoordinates::new(&topology.points, &ball.triangles, 0);
        let mut seams = 0;
        for t in &ball.triangles {
            let uv = t.map(|v| ball.uvs[v as usize]);
            // As topologies name them: by the first vertex in the place.
            let named = t.map(|v| coordinates.point[v as usize]);
            let ends = [(0, 1, 0.25), (1, 2, 0.5)]
                .map(|(a, b, part)| Anchor { vertices: [named[a], named[b]], part });
            if named[0] == named[1] || named[1] == named[2] || named[0] == named[2] {
                continue;
            }
            let found = coordinates.at(&MeshPoint { ends, part: 0.5 }, &rows, &ball.triangles, 0);
            let expected = 0.5 * (uv[0].lerp(uv[1], 0.25) + uv[1].lerp(uv[2], 0.5));
            assert!((found - expected).length() < 1e-5, "{t:?}: {found} {expected}");
            seams += usize::from(named != *t);
        }
        assert!(seams > 10, "{seams}");
    }
}
