//! The sash over a kariginu (koshi-obi): a flat band about the hips, knotted in front, its two ends hanging.
//!
//! The simulation knows a belt as what presses threads on. The sash lies over it: as convex as a band that is drawn tight, around
//! whatever cloth the belt holds, and its ends on the cloth that hangs below, out of which they never stay behind.

use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::f32::consts::TAU;
use yugen_motion::RigidPose;
use yugen_scene::Mesh;

/// How wide the band is, and how thick, m: assumed.
const WIDE: f32 = 0.05;
const THICK: f32 = 0.004;
/// From the cloth to its inside, m.
const GAP: f32 = 0.003;
/// Rings of triangles on either side of what the belt holds that lie under the band.
const RINGS: usize = 2;
/// Directions in which the outline of what lies under it is looked for, and columns of the band.
const DIRECTIONS: usize = 72;
const COLUMNS: usize = 96;
/// Across the band from its upper edge: parts of half its width and of its thickness; out, and back on the inside.
const PROFILE: [[f32; 2]; 10] = [
    [1.0, 0.2],
    [0.94, 1.0],
    [0.5, 1.05],
    [-0.5, 1.05],
    [-0.94, 1.0],
    [-1.0, 0.2],
    [-0.94, -0.3],
    [0.0, -0.3],
    [0.94, -0.3],
    [1.0, 0.2],
];
/// An end: how long, wide and thick, in how many rows, m; and how far it leaves the middle, per metre.
const LONG: f32 = 0.30;
const NARROW: f32 = 0.044;
const THIN: f32 = 0.002;
const ROWS: usize = 16;
const SPLAY: f32 = 0.16;
/// Columns of an end on its face.
const FACE: usize = 5;
/// Speed at which an end falls back when the cloth below it has, m/s.
const FALLS: f32 = 0.35;
/// Half the size of the knot, m.
const KNOT: Vec3 = Vec3::new(0.023, 0.03, 0.014);
/// Of the texture, m.
const TILE: f32 = 0.1;

/// Points in rows, seen from the side where rows run down and columns to the right.
type Grid = Vec<Vec<Vec3>>;

/// What it lies on, and where its ends were.
pub(crate) struct Sash {
    /// Vertices of the robe that may lie under the band, and its triangles that may lie under the ends.
    under: Vec<u32>,
    below: Vec<[u32; 3]>,
    /// In the coordinates of the pelvis: middle of the band.
    middle: Vec3,
    /// Of each place of the ends, how far to the front it was.
    ends: Option<[Vec<[f32; FACE]>; 2]>,
}

impl Sash {
    /// On a robe with vertices at `points`, of which a belt holds those for which `held` is true. `below` are the triangles that may
    /// lie under the ends: all but the sleeves. None where the belt holds nothing.
    pub fn new(
        points: &[Vec3],
        triangles: &[[u32; 3]],
        below: Vec<[u32; 3]>,
        held: impl Fn(u32) -> bool,
        pelvis: &RigidPose,
    ) -> Option<Self> {
        let mut under: Vec<u32> = (0..points.len() as u32).filter(|v| held(*v)).collect();
        if under.is_empty() {
            return None;
        }
        // In the order of vertices, so that its bits are always the same.
        let local = |v: &u32| into(pelvis, points[*v as usize]);
        let middle = under.iter().map(local).sum::<Vec3>() / under.len() as f32;
        let mut is_under = vec![false; points.len()];
        under.iter().for_each(|v| is_under[*v as usize] = true);
        for _ in 0..RINGS {
            let touches = |t: &&[u32; 3]| t.iter().any(|v| is_under[*v as usize]);
            under = triangles.iter().filter(touches).flatten().copied().collect();
            under.iter().for_each(|v| is_under[*v as usize] = true);
        }
        under = (0..points.len() as u32).filter(|v| is_under[*v as usize]).collect();
        Some(Self { under, below, middle, ends: None })
    }

    /// All of it as a mesh, with the robe's vertices at these points.
    pub fn mesh(&mut self, points: &[Vec3], pelvis: &RigidPose) -> Mesh {
        let mut mesh = Mesh { name: "koshi-obi".into(), ..Mesh::default() };
        for grid in self.grids(points, pelvis, 0.0) {
            let first = mesh.positions.len() as u32;
            let (rows, columns) = (grid.len() as u32, grid[0].len() as u32);
            let at = |i: u32, j: u32| first + i * columns + j;
            for i in 0..rows - 1 {
                for j in 0..columns - 1 {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    mesh.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
            let down = lengths(grid.iter().map(|row| row[0]));
            let right = lengths(grid[rows as usize / 2].iter().copied());
            for (row, v) in grid.iter().zip(down) {
                mesh.positions.extend(row);
                mesh.uvs.extend(right.iter().map(|u| Vec2::new(*u, v) / TILE));
            }
        }
        // A knot shrinks to a point above and below.
        let at = |v: u32| mesh.positions[v as usize];
        let area = |t: &[u32; 3]| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
        mesh.triangles.retain(|t| area(t).length() > 1e-12);
        let key = |p: Vec3| (p * 1e5).round().as_ivec3();
        let at = |v: u32| mesh.positions[v as usize];
        let mut normals: HashMap<_, Vec3> = HashMap::new();
        for t in &mesh.triangles {
            let n = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
            t.iter().for_each(|v| *normals.entry(key(at(*v))).or_default() += n);
        }
        let normal = |p: &Vec3| normals.get(&key(*p)).copied().unwrap_or(Vec3::Y).normalize_or(Vec3::Y);
        mesh.normals = mesh.positions.iter().map(normal).collect();
        mesh
    }

    /// Where the vertices of its mesh are `seconds` later, with those of the robe at these points.
    pub fn at(&mut self, points: &[Vec3], pelvis: &RigidPose, seconds: f32) -> Vec<Vec3> {
        self.grids(points, pelvis, seconds).into_iter().flatten().flatten().collect()
    }

    /// Band, knot and both ends.
    fn grids(&mut self, points: &[Vec3], pelvis: &RigidPose, seconds: f32) -> Vec<Grid> {
        let outline = self.outline(points, pelvis);
        let front = self.out_of(&outline, 0.0, 0.0, GAP + THICK);
        let band = |[up, out]: &[f32; 2]| -> Vec<Vec3> {
            let at = |k: usize| {
                let turn = TAU * (k % COLUMNS) as f32 / COLUMNS as f32;
                self.out_of(&outline, turn, 0.5 * WIDE * up, GAP + THICK * out)
            };
            (0..=COLUMNS).map(at).collect()
        };
        let mut grids = vec![PROFILE.iter().map(band).collect(), knot(front)];
        let surface = Surface::new(&self.below, points, pelvis);
        let mut ends = self.ends.take().unwrap_or_default();
        for (side, was) in [-1.0, 1.0].into_iter().zip(&mut ends) {
            grids.push(end(side, front, &surface, was, seconds));
        }
        self.ends = Some(ends);
        let out = |p: &mut Vec3| *p = pelvis.position + pelvis.rotation * *p;
        grids.iter_mut().flatten().flatten().for_each(out);
        grids
    }

    /// How far out of the middle the cloth under the band is, around it, at its lower edge, its middle and its upper edge.
    fn outline(&self, points: &[Vec3], pelvis: &RigidPose) -> [Vec<f32>; 3] {
        let local: Vec<Vec3> =
            self.under.iter().map(|v| into(pelvis, points[*v as usize]) - self.middle).collect();
        [-1.0, 0.0, 1.0].map(|at: f32| {
            let height = 0.5 * WIDE * at;
            let near = |p: &&Vec3| (p.y - height).abs() < 0.4 * WIDE;
            let across: Vec<Vec2> = local.iter().filter(near).map(|p| Vec2::new(p.x, p.z)).collect();
            let ways = (0..DIRECTIONS).map(|k| way(TAU * k as f32 / DIRECTIONS as f32));
            let reach = |n: Vec2| across.iter().map(|p| p.dot(n)).fold(0.0, f32::max);
            let supports: Vec<(Vec2, f32)> = ways.map(|n| (n, reach(n))).collect();
            let radius = |k: usize| {
                let to = way(TAU * k as f32 / COLUMNS as f32);
                let cut = supports.iter().filter(|(n, _)| n.dot(to) > 0.1).map(|(n, h)| h / n.dot(to));
                cut.fold(f32::INFINITY, f32::min)
            };
            let tight: Vec<f32> = (0..COLUMNS).map(radius).collect();
            // A band does not kink.
            let of = |k: usize| tight[k % COLUMNS];
            (0..COLUMNS).map(|k| tight[k].max((of(k + COLUMNS - 1) + of(k) + of(k + 1)) / 3.0)).collect()
        })
    }

    /// A point so far around (rad, from the front to the left), above the band's middle and out of the cloth.
    fn out_of(&self, outline: &[Vec<f32>; 3], turn: f32, up: f32, out: f32) -> Vec3 {
        let column = turn / TAU * COLUMNS as f32;
        let (k, t) = (column as usize % COLUMNS, column.fract());
        let at = |row: &Vec<f32>| row[k] + (row[(k + 1) % COLUMNS] - row[k]) * t;
        let [low, middle, high] = outline.each_ref().map(at);
        let part = (2.0 * up / WIDE).clamp(-1.0, 1.0);
        let edge = if part < 0.0 { low } else { high };
        // Straight from edge to edge, or out where its middle is.
        let straight = 0.5 * (low + high) + 0.5 * (high - low) * part;
        let radius = (middle + (edge - middle) * part.abs()).max(straight) + out;
        let to = way(turn);
        self.middle + Vec3::new(to.x * radius, up, to.y * radius)
    }
}

/// A point in the coordinates of the pelvis.
fn into(pelvis: &RigidPose, p: Vec3) -> Vec3 {
    pelvis.rotation.inverse() * (p - pelvis.position)
}

/// A direction (x, z), from the front to the left.
fn way(turn: f32) -> Vec2 {
    Vec2::new(turn.sin(), turn.cos())
}

/// How far along a line its points are, m.
fn lengths(line: impl Iterator<Item = Vec3>) -> Vec<f32> {
    let (mut sum, mut last) = (0.0, None);
    line.map(|p| {
        sum += last.map_or(0.0, |q: Vec3| q.distance(p));
        last = Some(p);
        sum
    })
    .collect()
}

/// The knot, a cushion on the band.
fn knot(front: Vec3) -> Grid {
    let power = |v: f32| v.signum() * v.abs().sqrt();
    let (rows, columns) = (14, 24);
    (0..=rows)
        .map(|i| {
            let down = std::f32::consts::PI * i as f32 / rows as f32;
            let wide = if i == 0 || i == rows { 0.0 } else { power(down.sin()) };
            let place = |j: usize| {
                let turn = TAU * (j % columns) as f32 / columns as f32;
                let around = Vec3::new(power(turn.sin()) * wide, power(down.cos()), power(turn.cos()) * wide);
                front + Vec3::Z * (0.5 * KNOT.z) + around * KNOT
            };
            (0..=columns).map(place).collect()
        })
        .collect()
}

/// Cloth seen from the front of the pelvis.
struct Surface {
    triangles: Vec<[Vec3; 3]>,
}

impl Surface {
    fn new(triangles: &[[u32; 3]], points: &[Vec3], pelvis: &RigidPose) -> Self {
        let local: Vec<Vec3> = points.iter().map(|p| into(pelvis, *p)).collect();
        let corners = triangles.iter().map(|t| t.map(|v| local[v as usize]));
        Self { triangles: corners.filter(|t| t.iter().any(|p| p.z > 0.0)).collect() }
    }

    /// How far to the front it is at a place (x, y).
    fn front(&self, at: Vec2) -> Option<f32> {
        let on = |t: &[Vec3; 3]| {
            let [a, b, c] = t.map(|p| p.truncate() - at);
            let w = [b.perp_dot(c), c.perp_dot(a), a.perp_dot(b)];
            let inside = w.iter().all(|w| *w >= 0.0) || w.iter().all(|w| *w <= 0.0);
            let sum = w[0] + w[1] + w[2];
            (inside && sum != 0.0).then(|| (w[0] * t[0].z + w[1] * t[1].z + w[2] * t[2].z) / sum)
        };
        self.triangles.iter().filter_map(on).max_by(f32::total_cmp)
    }
}

/// An end of the band that hangs from the knot, to the left or the right. `was`: how far to the front each place of it was; filled
/// anew.
fn end(side: f32, front: Vec3, surface: &Surface, was: &mut Vec<[f32; FACE]>, seconds: f32) -> Grid {
    let step = LONG / (ROWS - 1) as f32;
    let mut place = Vec3::new(front.x + side * 0.012, front.y - 0.2 * WIDE, front.z);
    let mut last = [front.z; FACE];
    let mut lines: Vec<(f32, f32, [f32; FACE])> = Vec::with_capacity(ROWS);
    let mut now = Vec::with_capacity(ROWS);
    for row in 0..ROWS {
        if row > 0 {
            place.y -= step;
            place.x += side * SPLAY * step;
        }
        let mut line: [f32; FACE] = std::array::from_fn(|k| {
            let x = place.x + NARROW * (k as f32 / (FACE - 1) as f32 - 0.5);
            // What it hangs over pushes it out; below, it hangs straight down.
            let out = surface.front(Vec2::new(x, place.y)).map_or(last[k], |z| z + GAP + THIN);
            let fallen = was.get(row).map_or(out, |old| old[k] - FALLS * seconds);
            out.max(last[k]).max(fallen)
        });
        // It lies on what stands out, and does not sag in between.
        let lies = line;
        for (k, z) in line.iter_mut().enumerate() {
            for i in 0..k {
                for j in k + 1..FACE {
                    let t = (k - i) as f32 / (j - i) as f32;
                    *z = z.max(lies[i] + (lies[j] - lies[i]) * t);
                }
            }
        }
        if row > 0 {
            // As long as it is.
            let slope = (line[FACE / 2] - last[FACE / 2]).abs().min(0.8 * step);
            place.y += step - (step * step - slope * slope).sqrt();
        }
        last = line;
        now.push(line);
        lines.push((place.x, place.y, line));
    }
    *was = now;
    let row = |(x, y, line): &(f32, f32, [f32; FACE]), thick: f32| -> Vec<Vec3> {
        let at = |k: usize, z: f32| Vec3::new(x + NARROW * (k as f32 / (FACE - 1) as f32 - 0.5), *y, z);
        let face = (0..FACE).map(|k| at(k, line[k]));
        let back = (0..FACE).rev().map(|k| at(k, line[k] - thick));
        face.chain(back).chain([at(0, line[0])]).collect()
    };
    // Shut above and below.
    let mut grid = vec![row(&lines[0], 0.0)];
    grid.extend(lines.iter().map(|l| row(l, THIN)));
    grid.push(row(&lines[ROWS - 1], 0.0));
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::check_closed;
    use glam::Quat;

    const AROUND: usize = 60;

    /// A robe in folds that is drawn in at y = 0 and stands out by `belly` below, in the coordinates of the pelvis.
    fn robe(belly: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut points = Vec::new();
        for i in 0..40 {
            let y = 0.1 - 0.015 * i as f32;
            for k in 0..AROUND {
                let turn = TAU * k as f32 / AROUND as f32;
                let out = 0.14 + 0.3 * y.abs() + 0.008 * (9.0 * turn).sin();
                let front = belly * (-((y + 0.12) / 0.04).powi(2)).exp() * turn.cos().max(0.0);
                points.push(Vec3::new(turn.sin() * out, y, turn.cos() * (out + front)));
            }
        }
        let mut triangles = Vec::new();
        for i in 0..39 {
            for k in 0..AROUND {
                let at = |i: usize, k: usize| (i * AROUND + k % AROUND) as u32;
                triangles.push([at(i, k), at(i + 1, k), at(i + 1, k + 1)]);
                triangles.push([at(i, k), at(i + 1, k + 1), at(i, k + 1)]);
            }
        }
        (points, triangles)
    }

    #[test]
    fn it_is_closed_and_lies_outside_of_the_cloth_that_it_holds() {
        let pelvis = RigidPose { position: Vec3::new(0.3, 0.9, -0.2), rotation: Quat::from_rotation_y(0.7) };
        let (local, triangles) = robe(0.0);
        let out = |p: &Vec3| pelvis.position + pelvis.rotation * *p;
        let points: Vec<Vec3> = local.iter().map(out).collect();
        let held = |v: u32| local[v as usize].y.abs() < 0.016;
        let mut sash = Sash::new(&points, &triangles, triangles.clone(), held, &pelvis).unwrap();
        let mesh = sash.mesh(&points, &pelvis);
        check_closed(&mesh).unwrap();
        let mut other = Sash::new(&points, &triangles, triangles.clone(), held, &pelvis).unwrap();
        assert_eq!(other.mesh(&points, &pelvis).positions, mesh.positions, "the same bits each time");
        let again = sash.at(&points, &pelvis, 0.0);
        let moved = again.iter().zip(&mesh.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(again.len() == mesh.positions.len() && moved < 1e-5, "{moved}");
        // The face of the band, a column every so many degrees.
        let face: Vec<Vec3> = mesh.positions[..PROFILE.len() * (COLUMNS + 1)].to_vec();
        let face: Vec<Vec3> = face.iter().map(|p| into(&pelvis, *p)).collect();
        let mut seen = 0;
        for p in local.iter().filter(|p| p.y.abs() < 0.45 * WIDE) {
            let (turn, far) = (p.x.atan2(p.z).rem_euclid(TAU), p.x.hypot(p.z));
            let column = (turn / TAU * COLUMNS as f32).round() as usize;
            let least = (1..5).map(|row| face[row * (COLUMNS + 1) + column]).map(|q| q.x.hypot(q.z));
            let least = least.fold(f32::INFINITY, f32::min);
            assert!(far < least && far > least - 0.03, "{p}: {far} {least}");
            seen += 1;
        }
        assert!(seen > 100);
        assert!(Sash::new(&points, &triangles, Vec::new(), |_| false, &pelvis).is_none());
    }

    #[test]
    fn its_ends_hang_before_the_cloth_and_fall_back_slowly() {
        let pelvis = RigidPose { position: Vec3::ZERO, rotation: Quat::IDENTITY };
        let [(flat, triangles), (round, _)] = [robe(0.0), robe(0.06)];
        let held = |v: u32| flat[v as usize].y.abs() < 0.016;
        let mut sash = Sash::new(&flat, &triangles, triangles.clone(), held, &pelvis).unwrap();
        let mesh = sash.mesh(&flat, &pelvis);
        let ends = mesh.positions.len() - 2 * (ROWS + 2) * (2 * FACE + 1);
        let before = |points: &[Vec3], positions: &[Vec3]| {
            let surface = Surface::new(&triangles, points, &pelvis);
            let gap = |p: &Vec3| surface.front(p.truncate()).map_or(f32::INFINITY, |z| p.z - z);
            positions[ends..].iter().map(gap).fold(f32::INFINITY, f32::min)
        };
        assert!(before(&flat, &mesh.positions) > 0.0);
        // A belly comes out and goes.
        let pushed = sash.at(&round, &pelvis, 1.0 / 30.0);
        assert!(before(&round, &pushed) > 0.0);
        let falling = sash.at(&flat, &pelvis, 1.0 / 30.0);
        let back = |a: &[Vec3], b: &[Vec3]| {
            a[ends..].iter().zip(&b[ends..]).map(|(a, b)| a.z - b.z).fold(0.0, f32::max)
        };
        let [first, all] = [back(&pushed, &falling), back(&pushed, &mesh.positions)];
        println!("{first} of {all} m in a frame");
        assert!(all > 0.02 && first < 1.1 * FALLS / 30.0, "{first} of {all}");
        for _ in 0..30 {
            sash.at(&flat, &pelvis, 1.0 / 30.0);
        }
        let rest = sash.at(&flat, &pelvis, 1.0 / 30.0);
        assert!(back(&rest, &mesh.positions) < 1e-4);
    }
}
