//! What lines a mesh has whatever it is seen from: vertices welded, triangles joined along edges, creases and borders.
//!
//! Files give the same place several vertices, for texture coordinates or for normals. A *point* is a place; a *node* is a
//! point with one normal, so that a hard edge has two nodes at each end and a smooth surface stops there. Contours of smooth
//! surfaces run over triangles between nodes ([`crate::contour`]); creases and borders are edges between points and are
//! chained here, once for a mesh.

use glam::{DVec3, Vec3};
use std::collections::{HashMap, HashSet};
use yugen_scene::prepared::VertexRow;

/// No triangle, edge or node.
pub const NONE: u32 = u32::MAX;

/// Normals of a place that are nearer than this are one: exporters round them differently on both sides of a seam of the
/// texture. Cosine of 15 degrees.
const SAME_NORMAL: f32 = 0.966;
/// Where a mesh brings its own normals and they agree across an edge, only a fold sharper than this is a crease: cosine of
/// 75 degrees.
const CREASE_DESPITE_NORMALS: f32 = 0.26;

/// An edge of the smooth surface: between two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its nodes, the smaller first: everything that is computed on an edge is computed once and in this order.
    pub nodes: [u32; 2],
    /// The triangles beside it; [`NONE`] at the border of a smooth part, and for both where more than two meet.
    pub triangles: [u32; 2],
}

/// What an edge between points is, seen from anywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Fold {
    /// Two faces at an angle.
    Crease,
    /// One face only.
    Border,
}

/// A crease or border.
#[derive(Clone, Copy, Debug)]
pub struct FoldEdge {
    /// Vertices at its ends.
    pub vertices: [u32; 2],
    /// The triangles beside it; the second is [`NONE`] at a border.
    pub triangles: [u32; 2],
}

/// Creases or borders one behind the other.
#[derive(Clone, Debug)]
pub struct FoldChain {
    /// Which.
    pub fold: Fold,
    /// One after the other, each with its ends in the direction of the chain.
    pub edges: Vec<FoldEdge>,
    /// The last ends where the first begins.
    pub closed: bool,
}

/// A mesh as lines need it.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Of each vertex of the mesh, counted from its first, the first vertex in the same place.
    pub points: Vec<u32>,
    /// A vertex of each node, counted from the first of the mesh: its position and, where the mesh has normals, its normal.
    pub vertices: Vec<u32>,
    /// Nodes of each triangle; those without area are left out.
    pub triangles: Vec<[u32; 3]>,
    /// The number of each triangle in the mesh.
    pub numbers: Vec<u32>,
    /// Edges between nodes.
    pub edges: Vec<Edge>,
    /// Edges of each triangle: that opposite to its last corner first.
    pub edges_of: Vec<[u32; 3]>,
    /// Creases and borders.
    pub folds: Vec<FoldChain>,
    /// Normals are those of the mesh, not means of its faces.
    pub has_normals: bool,
    /// Every edge has two triangles, and parts that hang together wind the same way as the others, so that an outside is known.
    pub closed: bool,
    /// It is closed and neighbours wind the same way, so that each face has an outside.
    pub solid: bool,
    /// Of a closed mesh 1, or −1 where faces wind the other way than outside.
    pub winding: f64,
    /// 1, or −1 where normals look to the side from which faces wind the other way.
    pub agree: f64,
}

/// What is a crease.
#[derive(Clone, Copy, Debug)]
pub struct Creases {
    /// Angle between the normals of two faces from which on they meet in a crease, radians.
    pub angle: f32,
    /// Angle at which a chain of creases is broken in two, radians: there a brush is lifted.
    pub corner: f32,
}

impl Default for Creases {
    fn default() -> Self {
        // Below 40 degrees faces of a coarse round thing would count; beyond 50 a painter begins a new stroke.
        Self { angle: 40f32.to_radians(), corner: 50f32.to_radians() }
    }
}

impl Topology {
    /// Of a mesh: its vertices, and triangles that count from `first_vertex`.
    pub fn new(
        vertices: &[VertexRow],
        triangles: &[[u32; 3]],
        first_vertex: u32,
        creases: &Creases,
        use_normals: bool,
    ) -> Self {
        let place = |v: u32| Vec3::from(vertices[v as usize].position);
        let points = weld(vertices);
        // A corner whose vertex is not finite has no place in any line.
        let kept: Vec<(u32, [u32; 3])> = (0u32..)
            .zip(triangles)
            .map(|(i, t)| (i, t.map(|v| v - first_vertex)))
            .filter(|(_, t)| {
                let [a, b, c] = t.map(|v| points[v as usize]);
                let [p, q, r] = t.map(place);
                let area = (q - p).cross(r - p).length_squared();
                a != b && b != c && c != a && area > 0.0 && area.is_finite()
            })
            .collect();
        let faces: Vec<Vec3> = kept
            .iter()
            .map(|(_, t)| {
                let [p, q, r] = t.map(|v| place(v).as_dvec3());
                (q - p).cross(r - p).normalize_or_zero().as_vec3()
            })
            .collect();

        let mut between: HashMap<[u32; 2], Vec<u32>> = HashMap::with_capacity(2 * kept.len());
        for (i, (_, t)) in kept.iter().enumerate() {
            let p = t.map(|v| points[v as usize]);
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                between.entry(ordered(p[a], p[b])).or_default().push(i as u32);
            }
        }
        let given = use_normals
            && !kept.is_empty()
            && kept.iter().flat_map(|(_, t)| t).all(|v| vertices[*v as usize].normal != [0.0; 3]);
        // Nodes: corners of a point that are smooth with one another.
        let smooth = creases.angle.cos();
        let by_normal = given
            .then(|| nodes_by_normal(vertices, &points, &kept))
            .filter(|(corners, _)| !is_faceted(corners, &points, &kept, &faces, &between, smooth));
        let given = by_normal.is_some();
        let (corners, node_vertices) =
            by_normal.unwrap_or_else(|| nodes_by_angle(&points, &kept, &faces, &between, smooth));

        let (mut edges, mut edges_of): (Vec<Edge>, Vec<[u32; 3]>) = Default::default();
        let mut of_nodes: HashMap<[u32; 2], u32> = HashMap::with_capacity(2 * kept.len());
        let mut counts: Vec<u32> = Vec::new();
        for (i, t) in corners.iter().enumerate() {
            edges_of.push([(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
                let key = ordered(t[a], t[b]);
                let e = *of_nodes.entry(key).or_insert_with(|| {
                    edges.push(Edge { nodes: key, triangles: [NONE; 2] });
                    counts.push(0);
                    edges.len() as u32 - 1
                });
                let count = &mut counts[e as usize];
                if *count < 2 {
                    edges[e as usize].triangles[*count as usize] = i as u32;
                }
                *count += 1;
                e
            }));
        }
        for (edge, count) in edges.iter_mut().zip(&counts) {
            if *count > 2 {
                edge.triangles = [NONE; 2];
            }
        }

        let closed = !kept.is_empty() && between.values().all(|t| t.len() == 2);
        let closed = closed && parts_wind_alike(&part_volumes(&kept, &between, &place));
        let folds = fold_chains(&kept, &corners, &faces, &points, &between, place, given, creases);
        let solid = closed && winds_alike(&kept, &points);
        // Six times the volume about the first corner, and whether normals go with the winding.
        let (mut volume, mut agree) = (0.0, 0.0);
        let first = kept.first().map_or(Vec3::ZERO, |(_, t)| place(t[0])).as_dvec3();
        for (_, t) in &kept {
            let p = t.map(|v| place(v).as_dvec3() - first);
            let n = (p[1] - p[0]).cross(p[2] - p[0]);
            volume += p[0].dot(p[1].cross(p[2]));
            // Means of the faces' normals agree with them.
            if given {
                agree +=
                    t.map(|v| n.dot(Vec3::from(vertices[v as usize].normal).as_dvec3())).iter().sum::<f64>();
            }
        }
        let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        Self {
            points,
            vertices: node_vertices,
            triangles: corners,
            numbers: kept.iter().map(|(i, _)| *i).collect(),
            edges,
            edges_of,
            folds,
            has_normals: given,
            closed,
            solid,
            winding: sign(volume),
            agree: sign(agree),
        }
    }

    /// Normals of nodes that are where `positions` says: means of the faces' normals, weighted by the angles there. Thürmer and
    /// Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets".
    pub fn mean_normals(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; positions.len()];
        for t in &self.triangles {
            let p = t.map(|n| positions[n as usize]);
            let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for k in 0..3 {
                let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                let angle = a.angle_between(b);
                if angle.is_finite() {
                    sums[t[k] as usize] += n * angle;
                }
            }
        }
        sums.into_iter().map(DVec3::normalize_or_zero).collect()
    }
}

/// Six times the volume of each part of a closed mesh that hangs together by edges, below zero where its faces wind the other way
/// than outside.
fn part_volumes(
    kept: &[(u32, [u32; 3])],
    between: &HashMap<[u32; 2], Vec<u32>>,
    place: &dyn Fn(u32) -> Vec3,
) -> Vec<f64> {
    // A forest whose roots stand for the parts.
    let mut parent: Vec<u32> = (0..kept.len() as u32).collect();
    let root = |parent: &mut [u32], mut i: u32| {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    };
    for pair in between.values().flat_map(|t| t.windows(2)) {
        let [a, b] = [pair[0], pair[1]].map(|t| root(&mut parent, t));
        parent[a.max(b) as usize] = a.min(b);
    }
    // About a corner of the part itself, so that what is far away loses no digits.
    let mut volumes = vec![0.0; kept.len()];
    for (i, (_, t)) in (0u32..).zip(kept) {
        let root = root(&mut parent, i) as usize;
        let first = place(kept[root].1[0]).as_dvec3();
        let [p, q, r] = t.map(|v| place(v).as_dvec3() - first);
        volumes[root] += p.dot(q.cross(r));
    }
    volumes.retain(|v| *v != 0.0);
    volumes
}

/// A part of less volume than this of the largest, which is a thousandth of its size, is flat or dust, and winds as it likes.
const DUST: f64 = 1e-9;

/// Whether all parts have a volume of the same sign.
fn parts_wind_alike(volumes: &[f64]) -> bool {
    let most = volumes.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let mut signs = volumes.iter().filter(|v| v.abs() > DUST * most).map(|v| *v > 0.0);
    let first = signs.next();
    signs.all(|sign| Some(sign) == first)
}

/// Whether no two triangles go along an edge in the same direction.
fn winds_alike(kept: &[(u32, [u32; 3])], points: &[u32]) -> bool {
    let mut once = HashSet::with_capacity(3 * kept.len());
    let corners = kept.iter().map(|(_, t)| t.map(|v| points[v as usize]));
    corners.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).all(|edge| once.insert(edge))
}

fn ordered(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Vertices nearer than this part of the extent of their mesh are in one place: both ends of a seam are computed, and sin 2π
/// is no zero in floats.
const SAME_PLACE: f32 = 2e-6;

/// The point of each vertex: the first vertex in the same place.
fn weld(vertices: &[VertexRow]) -> Vec<u32> {
    let place = |v: &VertexRow| Vec3::from(v.position);
    let finite = || vertices.iter().map(place).filter(|p| p.is_finite());
    let (low, high) =
        finite().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let near = SAME_PLACE * (high - low).max_element().max(1e-30);
    // Cells so large that few places have a neighbour in another one.
    let side = 64.0 * near;
    let cell = |p: Vec3| ((p - low) / side).floor().to_array().map(|v| v as i32);
    let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::with_capacity(vertices.len());
    (0u32..)
        .zip(vertices)
        .map(|(i, v)| {
            let p = place(v);
            let (from, to) = (cell(p - near), cell(p + near));
            for x in from[0]..=to[0] {
                for y in from[1]..=to[1] {
                    for z in from[2]..=to[2] {
                        let here = cells.get(&[x, y, z]).map_or(&[][..], Vec::as_slice);
                        let same = |f: &&u32| place(&vertices[**f as usize]).distance(p) <= near;
                        if let Some(first) = here.iter().find(same) {
                            return *first;
                        }
                    }
                }
            }
            cells.entry(cell(p)).or_default().push(i);
            i
        })
        .collect()
}

type Corners = (Vec<[u32; 3]>, Vec<u32>);

/// Nodes of a mesh with normals: a new one where a normal differs from those that its place has already.
fn nodes_by_normal(vertices: &[VertexRow], points: &[u32], kept: &[(u32, [u32; 3])]) -> Corners {
    let mut at: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut of_vertex: HashMap<u32, u32> = HashMap::new();
    let mut nodes: Vec<u32> = Vec::new();
    let normal = |v: u32| Vec3::from(vertices[v as usize].normal);
    let corners = kept
        .iter()
        .map(|(_, t)| {
            t.map(|v| {
                *of_vertex.entry(v).or_insert_with(|| {
                    let here = at.entry(points[v as usize]).or_default();
                    let same = |n: &&u32| normal(nodes[**n as usize]).dot(normal(v)) > SAME_NORMAL;
                    here.iter().find(same).copied().unwrap_or_else(|| {
                        nodes.push(v);
                        here.push(nodes.len() as u32 - 1);
                        nodes.len() as u32 - 1
                    })
                })
            })
        })
        .collect();
    (corners, nodes)
}

/// Part of the edges between faces that meet smoothly at which the mesh's normals may nevertheless break off, before the mesh
/// is taken for one that is shaded flat, whose normals say nothing of its form. A few seams are a modeller's intent.
const FLAT_SHARE: usize = 10;

/// Whether normals break off where faces meet smoothly, at more than one edge in [`FLAT_SHARE`].
fn is_faceted(
    corners: &[[u32; 3]],
    points: &[u32],
    kept: &[(u32, [u32; 3])],
    faces: &[Vec3],
    between: &HashMap<[u32; 2], Vec<u32>>,
    smooth: f32,
) -> bool {
    let (mut all, mut broken) = (0, 0);
    for (edge, sides) in between {
        let &[a, b] = &sides[..] else { continue };
        if faces[a as usize].dot(faces[b as usize]) < smooth {
            continue;
        }
        let node = |t: u32, point: u32| {
            let k = kept[t as usize].1.iter().position(|v| points[*v as usize] == point).unwrap_or(0);
            corners[t as usize][k]
        };
        all += 1;
        broken += usize::from(edge.iter().any(|p| node(a, *p) != node(b, *p)));
    }
    // The two halves of a flat side meet smoothly too, so that a box alone has six such edges and none is broken.
    FLAT_SHARE * broken > all
}

/// Nodes of a mesh without normals: corners of a point are joined across edges whose faces meet smoothly.
fn nodes_by_angle(
    points: &[u32],
    kept: &[(u32, [u32; 3])],
    faces: &[Vec3],
    between: &HashMap<[u32; 2], Vec<u32>>,
    smooth: f32,
) -> Corners {
    let mut parent: Vec<u32> = (0..3 * kept.len() as u32).collect();
    fn root(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    let corner = |t: u32, point: u32| {
        let k = kept[t as usize].1.iter().position(|v| points[*v as usize] == point);
        3 * t + k.unwrap_or(0) as u32
    };
    for (edge, sides) in between {
        let &[a, b] = &sides[..] else { continue };
        if faces[a as usize].dot(faces[b as usize]) < smooth {
            continue;
        }
        for point in edge {
            let [x, y] = [root(&mut parent, corner(a, *point)), root(&mut parent, corner(b, *point))];
            // The smaller is the root, so that the order of the map does not matter.
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let (mut nodes, mut of_root) = (Vec::new(), HashMap::new());
    let corners = (0u32..)
        .zip(kept)
        .map(|(t, (_, vertices))| {
            std::array::from_fn(|k| {
                *of_root.entry(root(&mut parent, 3 * t + k as u32)).or_insert_with(|| {
                    nodes.push(vertices[k]);
                    nodes.len() as u32 - 1
                })
            })
        })
        .collect();
    (corners, nodes)
}

/// Creases and borders as chains.
fn fold_chains(
    kept: &[(u32, [u32; 3])],
    corners: &[[u32; 3]],
    faces: &[Vec3],
    points: &[u32],
    between: &HashMap<[u32; 2], Vec<u32>>,
    place: impl Fn(u32) -> Vec3,
    given: bool,
    creases: &Creases,
) -> Vec<FoldChain> {
    let node = |t: u32, point: u32| {
        let k = kept[t as usize].1.iter().position(|v| points[*v as usize] == point).unwrap_or(0);
        corners[t as usize][k]
    };
    let mut found: Vec<(Fold, FoldEdge)> = between
        .iter()
        .filter_map(|(edge, sides)| {
            let vertices = *edge;
            if sides.len() == 1 {
                return Some((Fold::Border, FoldEdge { vertices, triangles: [sides[0], NONE] }));
            }
            let [a, b] = [sides[0], sides[1]];
            let cosine = faces[a as usize].dot(faces[b as usize]);
            let split = edge.iter().any(|p| node(a, *p) != node(b, *p));
            let limit = match (given, split) {
                (false, _) | (true, true) => creases.angle.cos(),
                (true, false) => CREASE_DESPITE_NORMALS,
            };
            let sharp = sides.len() > 2 || cosine < limit;
            sharp.then_some((Fold::Crease, FoldEdge { vertices, triangles: [a, b] }))
        })
        .collect();
    // The order of the map is not that of the mesh.
    found.sort_unstable_by_key(|(fold, e)| (*fold, e.vertices));

    let mut chains = Vec::new();
    for kind in [Fold::Crease, Fold::Border] {
        let edges: Vec<FoldEdge> = found.iter().filter(|(f, _)| *f == kind).map(|(_, e)| *e).collect();
        let mut at: HashMap<u32, Vec<usize>> = HashMap::new();
        for (i, e) in edges.iter().enumerate() {
            e.vertices.iter().for_each(|p| at.entry(*p).or_default().push(i));
        }
        let along = |from: u32, to: u32| (place(to) - place(from)).normalize_or_zero();
        // Where exactly two meet at a small angle a chain goes on.
        let next = |e: usize, through: u32| -> Option<usize> {
            let &[a, b] = &at[&through][..] else { return None };
            let other = if a == e { b } else { a };
            let far = |i: usize| {
                let [p, q] = edges[i].vertices;
                if p == through { q } else { p }
            };
            let straight = along(far(e), through).dot(along(through, far(other)));
            (straight > creases.corner.cos()).then_some(other)
        };
        let mut used = vec![false; edges.len()];
        for start in 0..edges.len() {
            if used[start] {
                continue;
            }
            // Back to where the chain begins, or once around.
            let (mut first, mut from) = (start, edges[start].vertices[0]);
            let mut closed = false;
            while let Some(before) = next(first, from) {
                if before == start {
                    closed = true;
                    break;
                }
                first = before;
                let [p, q] = edges[before].vertices;
                from = if p == from { q } else { p };
            }
            if closed {
                (first, from) = (start, edges[start].vertices[0]);
            }
            let mut chain = Vec::new();
            let mut current = Some(first);
            while let Some(e) = current.filter(|e| !used[*e]) {
                used[e] = true;
                let [p, q] = edges[e].vertices;
                let to = if p == from { q } else { p };
                chain.push(FoldEdge { vertices: [from, to], triangles: edges[e].triangles });
                from = to;
                current = next(e, to);
            }
            chains.push(FoldChain { fold: kind, edges: chain, closed });
        }
    }
    chains
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_scene::{Mesh, primitives};

    fn rows(mesh: &Mesh) -> Vec<VertexRow> {
        (0..mesh.positions.len())
            .map(|i| VertexRow {
                position: mesh.positions[i].into(),
                normal: mesh.normals.get(i).copied().unwrap_or_default().into(),
                u: 0.0,
                v: 0.0,
                tangent: [0.0; 4],
            })
            .collect()
    }

    fn topology(mesh: &Mesh) -> Topology {
        Topology::new(&rows(mesh), &mesh.triangles, 0, &Creases::default(), true)
    }

    #[test]
    fn a_box_is_twelve_creases_with_and_without_normals() {
        let mut block = primitives::block(Vec3::new(1.0, 2.0, 3.0));
        for _ in 0..2 {
            let t = topology(&block);
            let edges: usize = t.folds.iter().map(|c| c.edges.len()).sum();
            assert_eq!((t.folds.len(), edges, t.closed, t.solid, t.winding), (12, 12, true, true, 1.0));
            // Six smooth parts of four corners and two triangles.
            assert_eq!((t.vertices.len(), t.triangles.len()), (24, 12));
            block.normals.clear();
        }
    }

    #[test]
    fn a_ball_is_smooth_across_its_seam_and_a_sheet_has_one_border() {
        let t = topology(&primitives::ball(32));
        assert!(t.folds.is_empty() && t.closed, "{:?}", t.folds.len());
        assert_eq!(t.vertices.len(), 32 * 15 + 2);
        assert!(t.edges.iter().all(|e| e.triangles[1] != NONE));
        let t = topology(&primitives::grid(2.0, 1.0, [8, 4]));
        // Four sides, for at its corners the brush is lifted.
        assert_eq!(t.folds.iter().map(|c| c.edges.len()).collect::<Vec<_>>().iter().sum::<usize>(), 24);
        assert_eq!(t.folds.len(), 4);
        assert!(!t.closed && t.folds.iter().all(|c| c.fold == Fold::Border && !c.closed));
    }

    /// Beside each other, touching nowhere.
    fn two_blocks() -> Mesh {
        let mut two = primitives::block(Vec3::ONE);
        let count = two.positions.len() as u32;
        let other = two.clone();
        two.positions.extend(other.positions.iter().map(|p| *p + Vec3::X * 5.0));
        two.normals.extend(other.normals);
        two.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + count)));
        two
    }

    #[test]
    fn what_winds_this_way_and_that_has_no_outside() {
        let mut two = two_blocks();
        let t = topology(&two);
        assert!(t.closed && t.solid && t.winding == 1.0);
        let half = two.triangles.len() / 2;
        two.triangles[half..].iter_mut().for_each(|t| t.swap(1, 2));
        let t = topology(&two);
        assert!(!t.closed && !t.solid);
        // Both the other way agree again.
        two.triangles[..half].iter_mut().for_each(|t| t.swap(1, 2));
        let t = topology(&two);
        assert!(t.closed && t.solid && t.winding == -1.0);
    }

    #[test]
    fn what_is_no_surface_is_left_out() {
        let mesh = Mesh {
            positions: vec![
                Vec3::ZERO,
                Vec3::X,
                Vec3::Y,
                Vec3::splat(f32::NAN),
                Vec3::X * 2.0,
                Vec3::Z,
                -Vec3::Z,
            ],
            // A triangle, a flat one, one with a corner nowhere, one that is a point, and a third wing on an edge.
            triangles: vec![[0, 1, 2], [0, 1, 4], [0, 1, 3], [2, 2, 2], [0, 1, 5], [1, 0, 6]],
            ..Mesh::default()
        };
        let t = topology(&mesh);
        assert_eq!(t.numbers, [0, 4, 5]);
        let shared: Vec<_> = t.folds.iter().filter(|c| c.fold == Fold::Crease).collect();
        assert_eq!(shared.len(), 1, "the edge of three triangles is a line");
        assert!(topology(&Mesh::default()).triangles.is_empty());
    }

    #[test]
    fn the_rim_of_an_open_cylinder_is_a_closed_chain() {
        let mut mesh = Mesh::default();
        let n = 24u32;
        for i in 0..n {
            let a = i as f32 / n as f32 * std::f32::consts::TAU;
            for z in [0.0, 1.0] {
                mesh.positions.push(Vec3::new(a.cos(), a.sin(), z));
            }
        }
        for i in 0..n {
            let j = (i + 1) % n;
            mesh.triangles.extend([[2 * i, 2 * j, 2 * j + 1], [2 * i, 2 * j + 1, 2 * i + 1]]);
        }
        let t = topology(&mesh);
        assert_eq!(t.folds.len(), 2);
        assert!(t.folds.iter().all(|c| c.closed && c.edges.len() == 24));
    }
}
