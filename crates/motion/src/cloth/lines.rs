//! Springs that follow each other along a thread, solved all at once.
//!
//! One pass over springs, one after the other, carries a pull by a few edges. Along a thread each spring has only two neighbours, so that
//! the equations of all are tridiagonal, and Thomas' algorithm solves them exactly for about what a pass costs: the direct solver
//! of Deul, Kugelstadt, Weiler and Bender 2018, "Direct Position-Based Solver for Stiff Rods", for chains of springs. All threads
//! of one direction are solved at once, eight at a time, then those of the other: line relaxation, as it is known from grids.

use super::rows::LineRow;
use super::sweep::{Link, SHORT};
use super::team::Parts;
use super::{Along, Cloth};
use glam::{Mat4, Vec2, Vec4};
use std::collections::HashMap;
use std::ops::{Add, Mul, Neg, Sub};

/// Lines that are solved together.
const LANES: usize = 8;
/// Fewer links than this are left to the other springs.
const FEWEST: usize = 3;
/// Largest compliance of a link, 1/kg: of a spring without stiffness, so that sums stay finite.
const LIMP: f32 = 1e30;
/// Least part of its diagonal that is left of an equation, against rounding.
pub(super) const LEAST: f32 = 1e-6;

/// Vertices in their order, and the springs between them, one fewer.
struct Line {
    vertices: Vec<u32>,
    springs: Vec<u32>,
}

/// Eight numbers.
#[derive(Clone, Copy, Default)]
struct Eight(Vec4, Vec4);

impl Eight {
    fn splat(v: f32) -> Self {
        Self(Vec4::splat(v), Vec4::splat(v))
    }

    fn set(&mut self, lane: usize, v: f32) {
        let half = if lane < 4 { &mut self.0 } else { &mut self.1 };
        half[lane % 4] = v;
    }

    #[inline(always)]
    fn each(self, of: impl Fn(Vec4) -> Vec4) -> Self {
        Self(of(self.0), of(self.1))
    }

    #[inline(always)]
    fn with(self, o: Self, of: impl Fn(Vec4, Vec4) -> Vec4) -> Self {
        Self(of(self.0, o.0), of(self.1, o.1))
    }

    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.with(o, Vec4::max)
    }

    #[inline(always)]
    fn inverse(self) -> Self {
        self.each(|v| Vec4::ONE / v)
    }
}

impl Add for Eight {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.with(o, |a, b| a + b)
    }
}

impl Sub for Eight {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.with(o, |a, b| a - b)
    }
}

impl Mul for Eight {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.with(o, |a, b| a * b)
    }
}

impl Neg for Eight {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}

/// Of eight lines the vertices of one number, and the links to the next.
#[derive(Clone, Copy)]
struct Row {
    at: [u32; LANES],
    /// Inverse masses, 1/kg.
    inverse: Eight,
    rest: Eight,
    longest: Eight,
    /// 1/(k h²), 1/kg.
    compliance: Eight,
}

/// What the way forth along eight lines keeps for the way back.
#[derive(Clone, Copy, Default)]
pub(super) struct Kept {
    normal: [Eight; 3],
    /// One over what is left of the diagonal; the right side; how much of the next equation's unknown is in this one.
    over: Eight,
    right: Eight,
    coupling: Eight,
}

/// Eight lines side by side, the shorter ones filled up with links that do nothing.
pub(super) struct Bundle {
    rows: Vec<Row>,
}

/// The lines of both directions in bundles, and which springs are in one of them. No two lines of a direction have a vertex in common.
pub(super) fn bundles(
    cloth: &Cloth,
    place: &[u32],
    links: &[Link],
    inverse: &[f32],
    h: f32,
) -> ([Vec<Bundle>; 2], Vec<bool>) {
    let mut within = vec![false; links.len()];
    let courses = courses(cloth);
    let bundles = [Along::Weft, Along::Warp].map(|along| {
        let lines = lines(cloth, along, &courses);
        lines.iter().flat_map(|l| &l.springs).for_each(|i| within[*i as usize] = true);
        let bundle = |lines: &[Line]| Bundle::new(lines, place, links, inverse, h);
        lines.chunks(LANES).map(bundle).collect::<Vec<Bundle>>()
    });
    (bundles, within)
}

/// Of each edge, from the lower to the higher vertex, its direction in the flat cloth.
fn courses(cloth: &Cloth) -> HashMap<[u32; 2], Vec2> {
    let mut courses = HashMap::new();
    for (t, flat) in cloth.sheet.triangles.iter().zip(&cloth.sheet.flat) {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (i, j) = if t[i] < t[j] { (i, j) } else { (j, i) };
            courses.entry([t[i], t[j]]).or_insert((flat[j] - flat[i]).normalize_or_zero());
        }
    }
    courses
}

/// Lines along threads of one direction: at each vertex the two springs that follow the thread best, one to either side.
fn lines(cloth: &Cloth, along: Along, courses: &HashMap<[u32; 2], Vec2>) -> Vec<Line> {
    let n = cloth.masses.len();
    let axis = if along == Along::Weft { Vec2::X } else { Vec2::Y };
    let mut best: Vec<[Option<(u32, f32)>; 2]> = vec![[None; 2]; n];
    for (i, spring) in cloth.springs.iter().enumerate().filter(|(_, s)| s.along == along) {
        let [a, b] = spring.ends;
        let Some(course) = courses.get(&[a.min(b), a.max(b)]) else { continue };
        let forth = course.dot(axis) * if a < b { 1.0 } else { -1.0 };
        for (v, forth) in [(a, forth), (b, -forth)] {
            let side = &mut best[v as usize][usize::from(forth < 0.0)];
            if side.is_none_or(|s| s.1 < forth.abs()) {
                *side = Some((i as u32, forth.abs()));
            }
        }
    }
    // A spring is part of a line where both of its ends have chosen it.
    let chosen = |v: u32, i: u32| best[v as usize].iter().flatten().any(|s| s.0 == i);
    let mut springs_of: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (i, spring) in cloth.springs.iter().enumerate() {
        if spring.ends.iter().all(|v| chosen(*v, i as u32)) {
            spring.ends.iter().for_each(|v| springs_of[*v as usize].push(i as u32));
        }
    }
    let mut lines = Vec::new();
    let mut seen = vec![false; n];
    // From their ends; then what is closed, as a sleeve is, from anywhere: one spring of it is left out.
    for closed in [false, true] {
        for first in 0..n {
            if seen[first] || springs_of[first].is_empty() || (!closed && springs_of[first].len() > 1) {
                continue;
            }
            seen[first] = true;
            let mut line = Line { vertices: vec![first as u32], springs: Vec::new() };
            let mut at = first;
            while let Some((spring, to)) = springs_of[at].iter().find_map(|i| {
                let [a, b] = cloth.springs[*i as usize].ends;
                let to = if a as usize == at { b } else { a };
                (!seen[to as usize]).then_some((*i, to))
            }) {
                at = to as usize;
                seen[at] = true;
                line.vertices.push(to);
                line.springs.push(spring);
            }
            if line.springs.len() >= FEWEST {
                lines.push(line);
            }
        }
    }
    lines
}

impl Bundle {
    fn new(lines: &[Line], place: &[u32], links: &[Link], inverse: &[f32], h: f32) -> Self {
        let longest = lines.iter().map(|l| l.vertices.len()).max().unwrap_or(0);
        let rows = (0..longest).map(|k| {
            let mut row = Row {
                at: [0; LANES],
                inverse: Eight::default(),
                rest: Eight::default(),
                longest: Eight::splat(f32::INFINITY),
                compliance: Eight::splat(1.0),
            };
            // Lanes that are left over repeat a line's last vertex, or another line, without mass to move.
            for lane in 0..LANES {
                let line = lines.get(lane).unwrap_or(&lines[0]);
                let p = place[line.vertices[k.min(line.vertices.len() - 1)] as usize];
                row.at[lane] = p;
                if lane < lines.len() && k < line.vertices.len() {
                    row.inverse.set(lane, inverse[p as usize]);
                }
                if let Some(i) = line.springs.get(k).filter(|_| lane < lines.len()) {
                    let link = &links[*i as usize];
                    row.rest.set(lane, link.rest);
                    row.longest.set(lane, link.longest);
                    row.compliance.set(lane, (1.0 / (link.stiffness * h * h)).min(LIMP));
                }
            }
            row
        });
        Self { rows: rows.collect() }
    }

    /// Its lines one by one.
    pub fn lines(&self) -> Vec<Vec<LineRow>> {
        let of = |all: &Eight, lane: usize| if lane < 4 { all.0[lane] } else { all.1[lane - 4] };
        let line = |lane: usize| {
            let links = self.rows.iter().take_while(|row| of(&row.rest, lane) > 0.0).count();
            let row = |row: &Row| LineRow {
                place: row.at[lane],
                inverse: of(&row.inverse, lane),
                rest: of(&row.rest, lane),
                longest: of(&row.longest, lane),
                compliance: of(&row.compliance, lane),
            };
            // What fills it up has no links.
            self.rows.iter().take(if links > 0 { links + 1 } else { 0 }).map(row).collect::<Vec<_>>()
        };
        (0..LANES).map(line).filter(|line| !line.is_empty()).collect()
    }

    /// How many rows of memory it needs.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Moves vertices by what all springs of the lines together ask for: they come to the lengths that their stiffness gives in a step,
    /// or, where that alone would leave one longer than it may be, to that. Vertices are at `x` plus `u`, and `u` changes.
    ///
    /// # Safety
    /// Nobody else writes to `x`, nor reads or writes vertices of these lines in `u`.
    #[allow(unsafe_code)]
    pub unsafe fn solve(&self, x: &Parts<'_, Vec4>, u: &Parts<'_, Vec4>, kept: &mut [Kept]) {
        // SAFETY: by the promise.
        let x = unsafe { x.read(&(0..x.len())) };
        let mut last = Kept::default();
        for (k, pair) in self.rows.windows(2).enumerate() {
            let [row, next] = pair else { continue };
            // SAFETY: by the promise.
            let d = unsafe { differences(x, u, &row.at, &next.at) };
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).each(Vec4::sqrt);
            let over = length.max(Eight::splat(SHORT)).inverse();
            let normal = d.map(|d| d * over);
            let mass = row.inverse + next.inverse;
            // Where stiffness alone is not enough a link is rigid at its longest.
            let soft = row.compliance * length + mass * row.rest;
            let bound = row.longest * (mass + row.compliance);
            let choose = |soft: Vec4, bound: Vec4, a: Vec4, b: Vec4| Vec4::select(soft.cmpgt(bound), a, b);
            let rest = Eight(
                choose(soft.0, bound.0, row.longest.0, row.rest.0),
                choose(soft.1, bound.1, row.longest.1, row.rest.1),
            );
            let compliance = Eight(
                choose(soft.0, bound.0, Vec4::ZERO, row.compliance.0),
                choose(soft.1, bound.1, Vec4::ZERO, row.compliance.1),
            );
            let n = last.normal;
            let coupling = row.inverse * (n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2]);
            let diagonal = mass + compliance;
            let share = coupling * last.over;
            let least = diagonal.each(|d| (d * LEAST).max(Vec4::splat(f32::MIN_POSITIVE)));
            let over = (diagonal - coupling * share).max(least).inverse();
            let right = (rest - length) + share * last.right;
            last = Kept { normal, over, right, coupling };
            kept[k] = last;
        }
        let mut force = Eight::default();
        let mut coupling = Eight::default();
        let mut pull = [Eight::default(); 3];
        for (row, kept) in self.rows[1..].iter().zip(&kept[..self.rows.len() - 1]).rev() {
            force = kept.over * (kept.right + coupling * force);
            coupling = kept.coupling;
            let before = kept.normal.map(|n| n * force);
            let by = [0, 1, 2].map(|i| row.inverse * (before[i] - pull[i]));
            // SAFETY: by the promise.
            unsafe { add(u, &row.at, by) };
            pull = before;
        }
        if let Some(row) = self.rows.first() {
            // SAFETY: by the promise.
            unsafe { add(u, &row.at, pull.map(|p| -(row.inverse * p))) };
        }
    }
}

/// From eight vertices to eight others: all x, all y, all z.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn differences(x: &[Vec4], u: &Parts<'_, Vec4>, from: &[u32; LANES], to: &[u32; LANES]) -> [Eight; 3] {
    // SAFETY: by the promise of who calls.
    let (a, b) = unsafe { (half::<0>(x, u, from, to), half::<4>(x, u, from, to)) };
    [Eight(a.x_axis, b.x_axis), Eight(a.y_axis, b.y_axis), Eight(a.z_axis, b.z_axis)]
}

/// Four of them, from the one numbered `FIRST` on.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn half<const FIRST: usize>(
    x: &[Vec4],
    u: &Parts<'_, Vec4>,
    from: &[u32; LANES],
    to: &[u32; LANES],
) -> Mat4 {
    let of = |k: usize| {
        let (a, b) = (from[FIRST + k] as usize, to[FIRST + k] as usize);
        // SAFETY: by the promise of who calls.
        (x[b] - x[a]) + unsafe { *u.one(b) - *u.one(a) }
    };
    Mat4::from_cols(of(0), of(1), of(2), of(3)).transpose()
}

/// Adds to eight vertices, one after the other.
#[inline(always)]
#[allow(unsafe_code)]
unsafe fn add(u: &Parts<'_, Vec4>, at: &[u32; LANES], by: [Eight; 3]) {
    for (first, by) in [(0, by.map(|b| b.0)), (4, by.map(|b| b.1))] {
        let by = Mat4::from_cols(by[0], by[1], by[2], Vec4::ZERO).transpose();
        for (k, by) in [by.x_axis, by.y_axis, by.z_axis, by.w_axis].into_iter().enumerate() {
            // SAFETY: by the promise of who calls.
            unsafe { *u.one(at[first + k] as usize) += by };
        }
    }
}
