//! Two levels of bounding boxes through which shaders trace rays: one tree over each mesh in its own coordinates, and
//! one over the draws of the scene.
//!
//! * Build: binned surface-area heuristic (Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies")
//!   to a binary tree, whose nodes are then opened, the largest first, until they have four children.
//! * Nodes: four boxes of eight bits a plane in 64 bytes (after Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray
//!   Traversal on GPUs Through Compressed Wide BVHs"). Rounding is outwards.
//! * A moved draw needs the top level only: [`Hierarchy::place`]. A deformed mesh keeps its tree and gets new boxes:
//!   [`Hierarchy::deform`].
//!
//! Everything lies in one buffer of rows of four words (`hierarchy.wgsl` reads it):
//!
//! ```text
//! row 0           nodes of the top level, four rows each, the root first; room for one per draw
//!                 one instance per draw, four rows: inverse matrix and translation; root of its mesh, draw,
//!                 flags, sides that are clear of it (`convex.rs`)
//! for each mesh   one row a triangle in the order of the leaves: three vertices and the triangle
//!                 its nodes, four rows each, the root first
//!
//! node      0: corner x y z (f32), exponents of the steps (a byte an axis)     1: four children
//!           2: bytes of lower x, lower y, lower z, upper x                     3: upper y, upper z, unused, unused
//! child     a node: its first row / 4          a leaf: 1 << 31 | (count - 1) << 29 | first row
//!           nothing: all ones                  (of the top level: count 1, the row of the instance)
//! ```

mod convex;
mod tree;

use convex::{BACK, FRONT, clear_sides};
use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4, Vec4Swizzles};
use std::ops::Range;
use tree::{Extent, Item, node_rows, tree};
use yugen_scene::prepared::{DrawRow, MeshRow, Rows, VertexRow, double_area_normal};

/// The traversal in WGSL. The shader that includes it supplies
/// `fn passes(draw: u32, triangle: u32, b: vec2<f32>, dir: vec3<f32>) -> f32`.
pub const HIERARCHY_WGSL: &str = include_str!("hierarchy.wgsl");

/// Entries of the shader's stack that a mesh may need, one for every node above with children yet to visit, and those of
/// the top level: together `STACK` of the shader.
const MESH_STACK: u32 = 28;
const TOP_STACK: u32 = 12;

/// Most triangles of a leaf: two bits count them.
const LEAF: usize = 4;
/// Coordinates beyond this overflow in the boxes' arithmetic.
const FARTHEST: f32 = 1e15;

const IS_LEAF: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;
/// An entry of the stack has 24 bits for a node, which is four rows.
const MOST_ROWS: usize = 1 << 26;

/// Why there is no hierarchy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HierarchyError {
    /// Coordinates too large for single precision.
    #[error(
        "draw {draw} (shape {shape}) reaches {farthest:e} from the origin; at most {FARTHEST:e} can be traced: scale the scene down"
    )]
    TooFar {
        /// Index of the draw.
        draw: usize,
        /// Its shape, counted from one.
        shape: u32,
        /// Largest coordinate.
        farthest: f32,
    },
    /// A vertex of a deformed mesh that is no place.
    #[error("vertex {vertex} of mesh {mesh} is not finite once deformed: look at the pose")]
    Vertex {
        /// Index of the mesh.
        mesh: usize,
        /// Which of its vertices.
        vertex: usize,
    },
    /// A deformed mesh with too many or too few vertices, or one that is not there.
    #[error("mesh {mesh} has {count} vertices, but {found} were given")]
    Count {
        /// Index of the mesh.
        mesh: usize,
        /// How many it has.
        count: usize,
        /// How many were given.
        found: usize,
    },
    /// More rows than leaves can point to.
    #[error(
        "{rows} rows of nodes and triangles; at most {MOST_ROWS} can be addressed: leave out or simplify meshes"
    )]
    TooMany {
        /// How many there would be.
        rows: usize,
    },
}

/// What a hierarchy holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HierarchyStats {
    /// Triangles with an area, each mesh counted once.
    pub triangles: usize,
    /// Nodes of all meshes.
    pub nodes: usize,
    /// Draws that cannot be met because their matrix flattens them.
    pub flat_draws: usize,
    /// Seconds the meshes took to build.
    pub build_seconds: f64,
}

/// The tree of a mesh: where it is and how far it reaches.
#[derive(Clone, Debug)]
struct MeshTree {
    /// [`NOTHING`]: the mesh has no triangle with an area.
    root: u32,
    /// The rows of its nodes.
    nodes: Range<usize>,
    first_vertex: u32,
    vertices: u32,
    lo: Vec3,
    hi: Vec3,
    /// The sides of its triangles that are clear of it.
    clear: u32,
}

/// The rows of the hierarchy.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    rows: Vec<[u32; 4]>,
    meshes: Vec<MeshTree>,
    top_rows: usize,
    stats: HierarchyStats,
    /// Triangles that may yet be looked at for whether their mesh is convex.
    left_to_look_at: usize,
}

impl Hierarchy {
    /// Builds the trees on at most `threads` threads; the result is the same for any number. Indices in `rows` must be
    /// what they say, as [`Rows::add_shapes`] makes them.
    pub fn build(rows: &Rows, threads: usize) -> Result<Self, HierarchyError> {
        let start = now();
        let top_rows = 8 * rows.draws.len().max(1);
        let mut this = Self {
            rows: vec![[0; 4]; top_rows],
            meshes: Vec::with_capacity(rows.meshes.len()),
            top_rows,
            stats: HierarchyStats::default(),
            left_to_look_at: convex::MOST,
        };
        for mesh in &rows.meshes {
            let tree = this.mesh(rows, mesh, threads.max(1))?;
            this.meshes.push(tree);
        }
        this.stats.build_seconds = start.map_or(0.0, |s| s.elapsed().as_secs_f64());
        this.place(&rows.draws)?;
        Ok(this)
    }

    /// The rows as a shader reads them.
    pub fn rows(&self) -> &[[u32; 4]] {
        &self.rows
    }

    /// The rows that [`Hierarchy::place`] writes: the first so many.
    pub fn top_rows(&self) -> usize {
        self.top_rows
    }

    /// What it holds.
    pub fn stats(&self) -> HierarchyStats {
        self.stats
    }

    /// Builds the top level anew over `draws`, of which there may be no more than it was built with. Those that their
    /// matrix flattens, or that are not finite, are left out and counted.
    pub fn place(&mut self, draws: &[DrawRow]) -> Result<(), HierarchyError> {
        let room = self.top_rows / 8;
        let draws = &draws[..draws.len().min(room)];
        self.stats.flat_draws = 0;
        let mut items = Vec::with_capacity(draws.len());
        for (i, draw) in draws.iter().enumerate() {
            let tree = &self.meshes[draw.mesh as usize];
            if tree.root == NOTHING {
                continue;
            }
            let to_world = affine(draw);
            let inverse = to_world.matrix3.inverse();
            if to_world.matrix3.determinant() == 0.0 || !inverse.as_mat3().is_finite() {
                self.stats.flat_draws += 1;
                tracing::warn!(
                    draw = i,
                    shape = draw.shape,
                    "rays cannot meet a mesh that its matrix flattens"
                );
                continue;
            }
            let (lo, hi) = placed_box(&to_world, tree.lo, tree.hi);
            let farthest = lo.abs().max(hi.abs()).max_element();
            if farthest.is_nan() || farthest > FARTHEST {
                return Err(HierarchyError::TooFar { draw: i, shape: draw.shape, farthest });
            }
            items.push(Item::new(lo, hi, i as u32));
            let at = 4 * (room + i);
            for row in 0..3 {
                let r = inverse.row(row).as_vec3();
                self.rows[at + row] = bits(r.extend(to_world.translation[row] as f32));
            }
            self.rows[at + 3] = [tree.root, i as u32, draw.flags, clear_sides_of(draw, tree.clear)];
        }
        let leaf = |_: usize, item: &Item| IS_LEAF | (4 * (room + item.index() as usize)) as u32;
        let nodes = tree(&mut items, 1, 1, TOP_STACK, 0, &leaf);
        self.rows[..4 * nodes.len()].copy_from_slice(nodes.as_flattened());
        Ok(())
    }

    /// Fits the boxes of a mesh to its `vertices` where they are now; the tree stays as it is, and so it grows less fit
    /// the farther they move. Returns the rows that changed. [`Hierarchy::place`] must follow. Triangles that had no
    /// area when the tree was built stay out.
    pub fn deform(&mut self, mesh: usize, vertices: &[VertexRow]) -> Result<Range<usize>, HierarchyError> {
        let count = self.meshes.get(mesh).map_or(0, |m| m.vertices as usize);
        if vertices.len() != count || count == 0 {
            return Err(HierarchyError::Count { mesh, count, found: vertices.len() });
        }
        let bad = |v: &VertexRow| !v.position.iter().all(|x| x.abs() <= FARTHEST);
        if let Some(vertex) = vertices.iter().position(bad) {
            return Err(HierarchyError::Vertex { mesh, vertex });
        }
        let tree = &self.meshes[mesh];
        let (nodes, first) = (tree.nodes.clone(), tree.first_vertex);
        if !nodes.is_empty() {
            let (lo, hi) = self.refit(nodes.start, &|i| Vec3::from(vertices[(i - first) as usize].position));
            (self.meshes[mesh].lo, self.meshes[mesh].hi) = (lo, hi);
        }
        // What was convex need not be.
        self.meshes[mesh].clear = 0;
        Ok(nodes)
    }

    /// Says that a mesh of `draws` is deformed elsewhere from now on.
    pub(crate) fn release(&mut self, mesh: u32, draws: &[DrawRow]) {
        self.meshes[mesh as usize].clear = 0;
        let room = self.top_rows / 8;
        for (i, _) in draws.iter().enumerate().filter(|(_, draw)| draw.mesh == mesh) {
            self.rows[4 * (room + i) + 3][3] = 0;
        }
    }

    /// Nodes of a mesh's tree, as their first rows over four: level by level, the deepest first; those whose children are leaves or lie
    /// in levels before.
    pub(crate) fn levels(&self, mesh: u32) -> Vec<Vec<u32>> {
        let Some(tree) = self.meshes.get(mesh as usize).filter(|t| t.root != NOTHING) else {
            return Vec::new();
        };
        let mut levels = vec![vec![tree.root]];
        loop {
            let children = |node: &u32| self.rows[4 * *node as usize + 1];
            let next: Vec<u32> =
                levels[levels.len() - 1].iter().flat_map(children).filter(|c| c & IS_LEAF == 0).collect();
            if next.is_empty() {
                break;
            }
            levels.push(next);
        }
        levels.reverse();
        levels
    }

    /// Nodes of the top level that a mesh lies in, children before parents: each with what its four boxes are: [`IS_LEAF`] and a draw of
    /// the mesh, the number of a node in this list, or [`NOTHING`] where it has nothing of the mesh.
    pub(crate) fn above(&self, mesh: u32, draws: &[DrawRow]) -> Vec<[u32; 5]> {
        let mut found = Vec::new();
        self.find_above(0, mesh, draws, &mut found);
        found
    }

    fn find_above(&self, node: u32, mesh: u32, draws: &[DrawRow], found: &mut Vec<[u32; 5]>) -> Option<u32> {
        let children = self.rows[4 * node as usize + 1];
        let mut entry = [node, NOTHING, NOTHING, NOTHING, NOTHING];
        for (child, what) in children.into_iter().zip(&mut entry[1..]).filter(|(c, _)| *c != NOTHING) {
            if child & IS_LEAF == 0 {
                *what = self.find_above(child, mesh, draws, found).unwrap_or(NOTHING);
            } else {
                let draw = self.rows[(child & 0x1fff_ffff) as usize + 3][1];
                if draws[draw as usize].mesh == mesh {
                    *what = IS_LEAF | draw;
                }
            }
        }
        entry[1..].iter().any(|w| *w != NOTHING).then(|| {
            found.push(entry);
            found.len() as u32 - 1
        })
    }

    /// Fits the node at `row` and all below it to vertices `at` an index.
    fn refit(&mut self, row: usize, at: &dyn Fn(u32) -> Vec3) -> (Vec3, Vec3) {
        let children = self.rows[row + 1];
        let mut boxes = Vec::with_capacity(4);
        for child in children.into_iter().filter(|c| *c != NOTHING) {
            let (lo, hi) = if child & IS_LEAF == 0 {
                self.refit(4 * child as usize, at)
            } else {
                let first = (child & 0x1fff_ffff) as usize;
                let leaf = &self.rows[first..=first + (child >> 29 & 3) as usize];
                let corners = leaf.iter().flat_map(|[a, b, c, _]| [*a, *b, *c]).map(at);
                corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
            };
            boxes.push((lo, hi, child));
        }
        self.rows[row..row + 4].copy_from_slice(&node_rows(&boxes));
        boxes
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), (lo, hi, _)| (l.min(*lo), h.max(*hi)))
    }

    /// Appends the tree of a mesh.
    fn mesh(&mut self, rows: &Rows, mesh: &MeshRow, threads: usize) -> Result<MeshTree, HierarchyError> {
        let first = mesh.first_triangle as usize;
        let triangles = &rows.triangles[first..first + mesh.triangles as usize];
        let corners = |t: &[u32; 3]| t.map(|i| Vec3::from(rows.vertices[i as usize].position));
        let mut items = Vec::with_capacity(triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            let [a, b, c] = corners(t);
            // A triangle without area can be met by no ray and has no normal.
            if double_area_normal([a, b, c]) != DVec3::ZERO {
                items.push(Item::new(a.min(b).min(c), a.max(b).max(c), i as u32));
            }
        }
        let empty = MeshTree {
            root: NOTHING,
            nodes: 0..0,
            first_vertex: mesh.first_vertex,
            vertices: mesh.vertices,
            lo: Vec3::ZERO,
            hi: Vec3::ZERO,
            clear: 0,
        };
        if items.is_empty() {
            return Ok(empty);
        }
        let extent = Extent::of(&items);
        let (lo, hi) = (extent.lo.xyz(), extent.hi.xyz());
        let farthest = lo.abs().max(hi.abs()).max_element();
        if farthest.is_nan() || farthest > FARTHEST {
            let named = |d: &DrawRow| d.first_triangle == mesh.first_triangle;
            let draw = rows.draws.iter().position(named).unwrap_or(0);
            let shape = rows.draws.get(draw).map_or(0, |d| d.shape);
            return Err(HierarchyError::TooFar { draw, shape, farthest });
        }
        let base = self.rows.len();
        let count = items.len();
        // A node for every leaf at most.
        let most = base + 5 * count + 4;
        if most >= MOST_ROWS {
            return Err(HierarchyError::TooMany { rows: most });
        }
        let nodes_at = base + count.next_multiple_of(4);
        let leaf = |at: usize, _: &Item| IS_LEAF | (base + at) as u32;
        let nodes = tree(&mut items, LEAF, threads, MESH_STACK, nodes_at / 4, &leaf);
        self.rows.reserve_exact(nodes_at - base + 4 * nodes.len());
        self.rows.extend(items.iter().map(|item| {
            let [a, b, c] = triangles[item.index() as usize];
            [a, b, c, mesh.first_triangle + item.index()]
        }));
        self.rows.resize(nodes_at, [0; 4]);
        self.rows.extend_from_slice(nodes.as_flattened());
        self.stats.triangles += count;
        self.stats.nodes += nodes.len();
        let nodes = nodes_at..nodes_at + 4 * nodes.len();
        let at = |i: u32| Vec3::from(rows.vertices[i as usize].position);
        let with_area = self.rows[base..base + count].iter().map(|[a, b, c, _]| [*a, *b, *c].map(at));
        let clear = clear_sides(with_area, &mut self.left_to_look_at);
        Ok(MeshTree { clear, root: (nodes_at / 4) as u32, nodes, lo, hi, ..empty })
    }
}

/// There is no clock in a browser's worker.
fn now() -> Option<std::time::Instant> {
    (!cfg!(target_arch = "wasm32")).then(std::time::Instant::now)
}

/// The sides of a draw that are clear of it, of those of its mesh: [`FRONT`] is now where its geometric normals point.
fn clear_sides_of(draw: &DrawRow, clear: u32) -> u32 {
    let has = |flag| draw.flags & flag != 0;
    // A mirror turns the winding; where there are shading normals the geometric ones stay with those.
    let turned = (has(DrawRow::MIRRORED) && !has(DrawRow::HAS_NORMALS)) != has(DrawRow::FLIPPED);
    if turned { (clear & FRONT) * 2 + (clear & BACK) / 2 } else { clear }
}

fn affine(draw: &DrawRow) -> DAffine3 {
    let [x, y, z] = draw.to_world.map(|r| r.map(f64::from));
    DAffine3 {
        matrix3: DMat3::from_cols_array_2d(&[[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]),
        translation: DVec3::new(x[3], y[3], z[3]),
    }
}

/// The box in the world of a mesh's box, with room for the rounding of rays on their way into the mesh.
fn placed_box(m: &DAffine3, lo: Vec3, hi: Vec3) -> (Vec3, Vec3) {
    let (lo, hi) = (lo.as_dvec3(), hi.as_dvec3());
    let (centre, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    let centre = m.transform_point3(centre);
    let a = m.matrix3;
    let half = a.x_axis.abs() * half.x + a.y_axis.abs() * half.y + a.z_axis.abs() * half.z;
    let half = half + 4e-7 * (centre.abs() + half);
    ((centre - half).as_vec3(), (centre + half).as_vec3())
}

fn bits(v: Vec4) -> [u32; 4] {
    v.to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    /// Rows of one mesh of these triangles, drawn once.
    fn rows_of(corners: &[[Vec3; 3]]) -> Rows {
        let vertex = |p: &Vec3| VertexRow {
            position: (*p).into(),
            u: 0.0,
            normal: [0.0; 3],
            v: 0.0,
            tangent: [0.0; 4],
        };
        let n = corners.len() as u32;
        Rows {
            vertices: corners.as_flattened().iter().map(vertex).collect(),
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            meshes: vec![MeshRow { first_vertex: 0, vertices: 3 * n, first_triangle: 0, triangles: n }],
            draws: vec![draw([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], n)],
            ..Rows::default()
        }
    }

    fn draw(to_world: [[f32; 4]; 3], triangles: u32) -> DrawRow {
        DrawRow {
            to_world,
            mesh: 0,
            first_triangle: 0,
            triangles,
            flags: 0,
            material: 0,
            shape: 1,
            emitter: u32::MAX,
            attributes: u32::MAX,
        }
    }

    fn random_vec(rng: &mut Pcg32) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| 2.0 * rng.next_f32() - 1.0))
    }

    fn soup(n: usize, size: f32, rng: &mut Pcg32) -> Vec<[Vec3; 3]> {
        (0..n)
            .map(|_| {
                let p = random_vec(rng);
                [p, p + size * random_vec(rng), p + size * random_vec(rng)]
            })
            .collect()
    }

    /// Checks the tree below the node at `row`; the triangles found, and the entries of a stack that it needs.
    fn check(rows: &[[u32; 4]], scene: &Rows, row: usize, lo: Vec3, hi: Vec3, found: &mut Vec<u32>) -> u32 {
        let [head, children, low, high] = std::array::from_fn(|i| rows[row + i]);
        let step: [f32; 3] = std::array::from_fn(|a| f32::from_bits((head[3] >> (8 * a) & 255) << 23));
        let plane = |words: [u32; 3], slot: usize| {
            Vec3::from_array(std::array::from_fn(|a| {
                f32::from_bits(head[a]) + (words[a] >> (8 * slot) & 255) as f32 * step[a]
            }))
        };
        let (mut count, mut below) = (0, 0);
        for (slot, &child) in children.iter().enumerate() {
            if child == NOTHING {
                continue;
            }
            count += 1;
            let inner_lo = plane([low[0], low[1], low[2]], slot);
            let inner_hi = plane([low[3], high[0], high[1]], slot);
            if child & IS_LEAF == 0 {
                below = below.max(check(rows, scene, 4 * child as usize, inner_lo, inner_hi, found));
                continue;
            }
            let first = (child & 0x1fff_ffff) as usize;
            for [a, b, c, triangle] in &rows[first..=first + (child >> 29 & 3) as usize] {
                assert_eq!(scene.triangles[*triangle as usize], [*a, *b, *c]);
                found.push(*triangle);
                for i in [a, b, c] {
                    let p = Vec3::from(scene.vertices[*i as usize].position);
                    assert!(p.cmpgt(inner_lo).all() && p.cmplt(inner_hi).all(), "{p} {inner_lo} {inner_hi}");
                    assert!(p.cmpge(lo).all() && p.cmple(hi).all());
                }
            }
        }
        below + u32::from(count > 1)
    }

    #[test]
    fn every_triangle_lies_in_the_boxes_above_it_once_and_the_stack_suffices() {
        let mut rng = Pcg32::new(1, 1);
        let mut scenes = vec![soup(1, 0.1, &mut rng), soup(5, 0.1, &mut rng), soup(20_000, 0.02, &mut rng)];
        // All in one place; smaller and smaller towards a corner, which makes a chain; flat; far away; on a line.
        scenes.push(vec![[Vec3::X, Vec3::Y, Vec3::Z]; 3000]);
        scenes.push((0..120).map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 0.6f32.powi(i))).collect());
        scenes.push((0..120).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 0.6f32.powi(i))).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| p.with_z(0.0))).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| p + 1e6)).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| 1e-20 * p)).collect());
        scenes.push(soup(2000, 0.1, &mut rng).into_iter().map(|t| t.map(|p| 1e13 * p)).collect());
        scenes.push(
            (0..5000).map(|i| [Vec3::ZERO, Vec3::Y, Vec3::Z].map(|p| p + Vec3::X * i as f32)).collect(),
        );
        for (s, corners) in scenes.iter().enumerate() {
            let scene = rows_of(corners);
            let hierarchy = Hierarchy::build(&scene, 1).unwrap();
            assert_eq!(
                hierarchy.rows(),
                Hierarchy::build(&scene, 7).unwrap().rows(),
                "scene {s}: threads show"
            );
            let tree = &hierarchy.meshes[0];
            let mut found = Vec::new();
            let needed =
                check(hierarchy.rows(), &scene, 4 * tree.root as usize, tree.lo, tree.hi, &mut found);
            found.sort_unstable();
            // Far away some lose their area.
            let area = |t: &[Vec3; 3]| double_area_normal(*t) != DVec3::ZERO;
            let want: Vec<_> = (0..corners.len() as u32).filter(|i| area(&corners[*i as usize])).collect();
            assert!(found == want, "scene {s}: {} of {}", found.len(), want.len());
            assert!(needed <= MESH_STACK, "scene {s} needs {needed}");

            // And once deformed, in new boxes.
            let (mut deformed, mut moved) = (hierarchy.clone(), scene.clone());
            for v in &mut moved.vertices {
                v.position = (Vec3::from(v.position) * 0.5 + random_vec(&mut rng)).into();
            }
            let range = deformed.deform(0, &moved.vertices).unwrap();
            assert_eq!(range, tree.nodes);
            let (lo, hi) = (deformed.meshes[0].lo, deformed.meshes[0].hi);
            let mut again = Vec::new();
            check(deformed.rows(), &moved, range.start, lo, hi, &mut again);
            again.sort_unstable();
            assert!(again == want, "scene {s}");
        }
    }

    /// Of the chain, which a surface-area heuristic takes apart one by one.
    #[test]
    fn chains_are_halved_where_the_stack_would_not_suffice() {
        let chain: Vec<_> =
            (0..120).map(|i| [Vec3::X, Vec3::Y, Vec3::Z].map(|p| p * 0.6f32.powi(i))).collect();
        let mut items: Vec<_> = chain
            .iter()
            .enumerate()
            .map(|(i, t)| Item::new(t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]), i as u32))
            .collect();
        let leaf = |at: usize, _: &Item| IS_LEAF | at as u32;
        let scene = rows_of(&chain);
        for (allowed, largest_leaf) in [(60, 1), (10, 1), (4, 4)] {
            let nodes = tree(&mut items, largest_leaf, 1, allowed, 0, &leaf);
            let rows: Vec<_> = items.iter().map(|i| scene.triangles[i.index() as usize]).collect();
            let mut all: Vec<[u32; 4]> = nodes.as_flattened().to_vec();
            // Leaves point to rows from zero on: put them behind the nodes.
            let moved = all.len() as u32;
            for node in all.chunks_exact_mut(4) {
                for child in &mut node[1] {
                    if *child != NOTHING && *child & IS_LEAF != 0 {
                        *child += moved;
                    }
                }
            }
            all.extend(rows.iter().zip(&items).map(|(t, i)| [t[0], t[1], t[2], i.index()]));
            let mut found = Vec::new();
            let needed = check(&all, &scene, 0, Vec3::splat(-1.0), Vec3::splat(2.0), &mut found);
            assert!(needed <= allowed, "{needed} of {allowed}");
            assert_eq!(found.len(), chain.len());
        }
    }

    #[test]
    fn what_cannot_be_traced_is_said() {
        let far = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z].map(|p| 1e20 * p)]);
        assert!(matches!(Hierarchy::build(&far, 1), Err(HierarchyError::TooFar { draw: 0, shape: 1, .. })));
        let mut moved = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]);
        moved.draws[0].to_world[1][3] = -1e16;
        let error = Hierarchy::build(&moved, 1).unwrap_err();
        assert!(error.to_string().contains("e16"), "{error}");
        let mut flat = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]);
        flat.draws[0].to_world[1] = [0.0; 4];
        assert_eq!(Hierarchy::build(&flat, 1).unwrap().stats().flat_draws, 1);
        let mut one = Hierarchy::build(&rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]), 1).unwrap();
        let mut vertices = rows_of(&[[Vec3::X, Vec3::Y, Vec3::Z]]).vertices;
        assert!(matches!(
            one.deform(0, &vertices[1..]),
            Err(HierarchyError::Count { count: 3, found: 2, .. })
        ));
        assert!(matches!(one.deform(7, &vertices), Err(HierarchyError::Count { mesh: 7, .. })));
        for bad in [f32::NAN, f32::INFINITY, 1e16] {
            vertices[2].position[1] = bad;
            assert_eq!(one.deform(0, &vertices), Err(HierarchyError::Vertex { mesh: 0, vertex: 2 }));
        }
        let nothing = Hierarchy::build(&Rows::default(), 1).unwrap();
        assert_eq!(nothing.rows()[1], [NOTHING; 4]);
    }

    #[test]
    fn the_shader_has_the_stack_that_the_builder_counts_on() {
        let all = format!("const STACK: u32 = {}u;", MESH_STACK + TOP_STACK);
        assert!(HIERARCHY_WGSL.contains(&all), "{all}");
    }
}
