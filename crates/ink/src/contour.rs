//! Contour (gou): where a surface turns away from the eye.
//!
//! Hertzmann and Zorin 2000, "Illustrating Smooth Surfaces": on a mesh with normals the contour is the zero set of
//! g = N · (eye − P), interpolated along edges. The vector to the eye is that of each vertex and is not made unit, for then
//! its interpolation is the vector of the interpolated point; with one vector for all vertices
//! ([`crate::literal`]) the zero set is that of parallel rays, however fine the mesh.

use crate::projection::Projection;
use crate::topology::{Fold, NONE, Topology};
use crate::zero_set::{ZeroChain, zero_chains};
use glam::{DMat3, DVec3};
use yugen_scene::prepared::{DrawRow, VertexRow};

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineKind {
    /// The surface turns away.
    Contour,
    /// Two faces meet at an angle.
    Crease,
    /// The surface ends.
    Border,
    /// It would from a little aside ([`crate::suggestive`]).
    Suggestive,
    /// None of these, but drawn over the form ([`crate::wrinkle`]).
    Wrinkle,
}

impl LineKind {
    /// Of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contour => "contour",
            Self::Crease => "crease",
            Self::Border => "border",
            Self::Suggestive => "suggestive",
            Self::Wrinkle => "wrinkle",
        }
    }
}

/// Where on its mesh a point of a line lies: between two vertices of the mesh (counted from its first), so that it can be
/// found again in another pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Vertices.
    pub vertices: [u32; 2],
    /// Part of the way from the first to the second.
    pub part: f32,
}

/// Where on its mesh a place between two points of a line lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPoint {
    /// Those of the points.
    pub ends: [Anchor; 2],
    /// Part of the way from the first to the second.
    pub part: f32,
}

impl Anchor {
    /// Where it is when vertices are where `place` says.
    pub fn position(&self, place: impl Fn(u32) -> Option<DVec3>) -> Option<DVec3> {
        let [a, b] = self.vertices.map(place);
        Some(a?.lerp(b?, self.part.into()))
    }
}

impl MeshPoint {
    /// Where it is when vertices are where `place` says.
    pub fn position(&self, place: impl Fn(u32) -> Option<DVec3>) -> Option<DVec3> {
        let [a, b] = self.ends.map(|end| end.position(&place));
        Some(a?.lerp(b?, self.part.into()))
    }
}

/// A point of a line in the world.
#[derive(Clone, Copy, Debug)]
pub struct LinePoint {
    /// Place.
    pub position: DVec3,
    /// Across the line, away from the surface; of a crease the mean of its faces. Not unit.
    pub outward: DVec3,
    /// Ends of the edge that it lies on: of a coarse mesh they stick out beyond the contour.
    pub ends: [DVec3; 2],
    /// Where it lies on its mesh.
    pub anchor: Anchor,
    /// Whether what comes after this point can be seen at all: the surface does not hide it by itself.
    pub possible: bool,
    /// Whether it separates the surface from what is behind: always of a contour, of a crease between a face that looks at
    /// the eye and one that does not.
    pub silhouette: bool,
    /// How much of it is drawn, 0 to 1.
    pub strength: f32,
}

/// A line of a placed mesh.
#[derive(Clone, Debug)]
pub struct Line {
    /// What.
    pub kind: LineKind,
    /// Index of the draw.
    pub draw: u32,
    /// In order.
    pub points: Vec<LinePoint>,
    /// The last point is followed by the first.
    pub closed: bool,
}

/// A placed mesh in a pose: what contours are computed from.
pub struct Surface<'a> {
    topology: &'a Topology,
    /// World positions of vertices, as the fold edges name them.
    place: &'a dyn Fn(u32) -> DVec3,
    /// World positions of nodes.
    pub positions: Vec<DVec3>,
    /// World normals of nodes, unit or zero.
    pub normals: Vec<DVec3>,
    /// 1, or −1 where the winding of faces is the other way than outside: by the volume of a closed mesh.
    winding: f64,
    /// 1, or −1 where the normals look inwards.
    side: f64,
}

/// The affine matrix of a draw.
pub fn to_world(draw: &DrawRow) -> impl Fn(DVec3) -> DVec3 + use<> {
    let rows = draw.to_world.map(|r| r.map(f64::from));
    move |p| DVec3::from_array(rows.map(|r| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3]))
}

impl<'a> Surface<'a> {
    /// `vertices`: of the mesh; `place`: where one of them is in the world.
    pub fn new(
        topology: &'a Topology,
        vertices: &[VertexRow],
        draw: &DrawRow,
        place: &'a dyn Fn(u32) -> DVec3,
    ) -> Self {
        let positions: Vec<DVec3> = topology.vertices.iter().map(|v| place(*v)).collect();
        let normals = if topology.has_normals {
            let r = draw.to_world.map(|r| DVec3::new(r[0].into(), r[1].into(), r[2].into()));
            // Rows of the cofactors, which carry normals as the inverse transpose does.
            let cofactors =
                DMat3::from_cols(r[1].cross(r[2]), r[2].cross(r[0]), r[0].cross(r[1])).transpose();
            topology
                .vertices
                .iter()
                .map(|v| {
                    let n = vertices[*v as usize].normal.map(f64::from);
                    (cofactors * DVec3::from_array(n)).normalize_or_zero()
                })
                .collect()
        } else {
            topology.mean_normals(&positions)
        };
        let [x, y, z] = draw.to_world.map(|r| DVec3::new(r[0].into(), r[1].into(), r[2].into()));
        let mirrored = if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 };
        let winding = match topology.closed {
            true => topology.winding * mirrored,
            false => topology.agree,
        };
        Self { topology, place, positions, normals, winding, side: winding * topology.agree }
    }

    pub(crate) fn topology(&self) -> &Topology {
        self.topology
    }

    /// 1, or −1 where the normals look inwards.
    pub(crate) fn side(&self) -> f64 {
        self.side
    }

    /// Its lines for an eye.
    pub fn lines(&self, projection: &Projection, draw: u32) -> Vec<Line> {
        let mut lines = self.contours(&|p| projection.to_eye(p), draw);
        lines.extend(self.folds(&|p| projection.to_eye(p), draw));
        lines
    }

    /// The contours, chained. `to_eye`: from a point to the eye, linear in the point.
    pub fn contours(&self, to_eye: &dyn Fn(DVec3) -> DVec3, draw: u32) -> Vec<Line> {
        let Topology { triangles, edges, .. } = self.topology;
        let g: Vec<f64> = self.positions.iter().zip(&self.normals).map(|(p, n)| n.dot(to_eye(*p))).collect();
        let at = |edge: u32| {
            let [a, b] = edges[edge as usize].nodes.map(|n| n as usize);
            let part = g[a] / (g[a] - g[b]);
            let position = self.positions[a].lerp(self.positions[b], part);
            (position, self.normals[a].lerp(self.normals[b], part), part)
        };
        let convexity = |t: u32| {
            let corner = triangles[t as usize].map(|n| n as usize);
            let p = corner.map(|n| self.positions[n]);
            growth(p, corner.map(|n| g[n]), to_eye((p[0] + p[1] + p[2]) / 3.0))
        };
        let mut lines = Vec::new();
        for ZeroChain { edges: chain, triangles, closed } in zero_chains(self.topology, &g) {
            let turns: Vec<f64> = triangles.into_iter().map(convexity).collect();
            let points = chain
                .iter()
                .enumerate()
                .map(|(i, edge)| {
                    let (position, normal, part) = at(*edge);
                    let before = if i > 0 {
                        turns[i - 1]
                    } else if closed {
                        turns[turns.len() - 1]
                    } else {
                        turns[0]
                    };
                    let after = turns.get(i).copied().unwrap_or(before);
                    // A solid hides a contour beyond which it bends towards the eye.
                    let possible = !self.topology.closed || after * self.side > 0.0;
                    let vertices = edges[*edge as usize].nodes.map(|n| self.topology.vertices[n as usize]);
                    LinePoint {
                        position,
                        // Of a solid only convex parts are seen; a sheet may be hollow where it turns away.
                        outward: normal
                            * match self.topology.closed {
                                true => self.side,
                                false => (before + after).signum(),
                            },
                        ends: edges[*edge as usize].nodes.map(|n| self.positions[n as usize]),
                        anchor: Anchor { vertices, part: part as f32 },
                        possible,
                        silhouette: true,
                        strength: 1.0,
                    }
                })
                .collect();
            lines.push(Line { kind: LineKind::Contour, draw, points, closed });
        }
        lines
    }

    /// Creases and borders, as the mesh has them chained. Of a solid those between two faces that look away are impossible.
    pub fn folds(&self, to_eye: &dyn Fn(DVec3) -> DVec3, draw: u32) -> Vec<Line> {
        let look = |t: u32| -> (DVec3, bool) {
            let p = self.topology.triangles[t as usize].map(|n| self.positions[n as usize]);
            let n = (p[1] - p[0]).cross(p[2] - p[0]) * self.winding;
            (n.normalize_or_zero(), n.dot(to_eye(p[0])) >= 0.0)
        };
        let of_chain = |chain: &crate::topology::FoldChain| {
            let point = |vertex: u32, edge: &crate::topology::FoldEdge| {
                let [(m, a), (n, b)] = match edge.triangles {
                    [t, NONE] => [look(t), (DVec3::ZERO, false)],
                    [t, u] => [look(t), look(u)],
                };
                LinePoint {
                    position: (self.place)(vertex),
                    outward: m + n,
                    ends: [(self.place)(vertex); 2],
                    anchor: Anchor { vertices: [vertex; 2], part: 0.0 },
                    possible: a || b || !self.topology.closed,
                    silhouette: chain.fold == Fold::Border || a != b,
                    strength: 1.0,
                }
            };
            let mut points: Vec<LinePoint> = chain.edges.iter().map(|e| point(e.vertices[0], e)).collect();
            if let (Some(last), false) = (chain.edges.last(), chain.closed) {
                points.push(point(last.vertices[1], last));
            }
            let kind = match chain.fold {
                Fold::Crease => LineKind::Crease,
                Fold::Border => LineKind::Border,
            };
            Line { kind, draw, points, closed: chain.closed }
        };
        self.topology.folds.iter().map(of_chain).collect()
    }
}

/// How fast g grows in a triangle towards the eye, that is along `w`: above zero the surface is convex there, below it is
/// hollow, as the side of the hole of a ring.
pub(crate) fn growth(p: [DVec3; 3], g: [f64; 3], w: DVec3) -> f64 {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    let determinant = aa * bb - ab * ab;
    if determinant <= 0.0 {
        return 0.0;
    }
    let (u, v) = (w.dot(a), w.dot(b));
    ((u * bb - v * ab) * (g[1] - g[0]) + (v * aa - u * ab) * (g[2] - g[0])) / determinant
}
