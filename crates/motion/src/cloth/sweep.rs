//! Springs and hinges as the default solver reads them: coloured, four at a time.

use super::order::colours;
use super::rows::{HingeRow, SpringRow};
use super::{Hinge, Spring};
use glam::{Mat4, Vec4};
use std::ops::Range;

/// A spring as a solver sees it, between places.
#[derive(Clone, Copy)]
pub(super) struct Link {
    pub ends: [u32; 2],
    /// Inverse masses of both, 1/kg.
    pub inverse: [f32; 2],
    pub rest: f32,
    /// N/m.
    pub stiffness: f32,
    /// N·s/m.
    pub damper: f32,
    /// Longest that it may be, m.
    pub longest: f32,
}

impl Link {
    pub fn new(spring: &Spring, place: &[u32], inverse: &[f32]) -> Self {
        let ends = spring.ends.map(|v| place[v as usize]);
        Self {
            ends,
            inverse: ends.map(|p| inverse[p as usize]),
            rest: spring.rest,
            stiffness: spring.stiffness,
            damper: spring.damper,
            longest: spring.rest * (1.0 + spring.limit),
        }
    }
}

/// Four springs without a vertex in common, as columns.
#[derive(Clone, Copy)]
struct Four {
    from: [u32; 4],
    to: [u32; 4],
    rest: Vec4,
    longest: Vec4,
    /// Part of a correction that the first end takes.
    share: [f32; 4],
    /// Part of the elongation that is taken away in a step.
    give: Vec4,
    /// Part of the relative velocity that a damper takes away when it acts.
    calm: Vec4,
}

/// Springs of a strip or border, their ends counted from its start.
#[derive(Default)]
pub(super) struct Springs {
    fours: Vec<Four>,
}

/// So short a spring has no direction.
pub(super) const SHORT: f32 = 1e-12;

impl Springs {
    /// For steps of `h` seconds, dampers acting for `calm` at a time.
    pub fn new(links: &[Link], range: &Range<usize>, h: f32, calm: f32) -> Self {
        // Nothing to do where both ends are attached.
        let links: Vec<Link> = links.iter().filter(|l| l.inverse[0] + l.inverse[1] > 0.0).copied().collect();
        let stencils: Vec<[u32; 2]> = links.iter().map(|l| l.ends).collect();
        let mut fours = Vec::with_capacity(links.len() / 4 + 16);
        for colour in colours(&stencils, range.clone()) {
            for chosen in colour.chunks(4) {
                // Lanes that are left over join a vertex to itself and do nothing.
                let mut four = Four {
                    from: [0; 4],
                    to: [0; 4],
                    rest: Vec4::ZERO,
                    longest: Vec4::INFINITY,
                    share: [0.0; 4],
                    give: Vec4::ZERO,
                    calm: Vec4::ZERO,
                };
                for (lane, i) in chosen.iter().enumerate() {
                    let link = &links[*i];
                    let w = link.inverse[0] + link.inverse[1];
                    let [stiff, damp] = [link.stiffness * h * h * w, link.damper * calm * w];
                    four.from[lane] = link.ends[0] - range.start as u32;
                    four.to[lane] = link.ends[1] - range.start as u32;
                    four.rest[lane] = link.rest;
                    four.longest[lane] = link.longest;
                    four.share[lane] = link.inverse[0] / w;
                    // Compliant: C/(w + 1/(k h²)), Macklin, Müller and Chentanez 2016 (XPBD).
                    four.give[lane] = stiff / (1.0 + stiff);
                    four.calm[lane] = damp / (1.0 + damp);
                }
                fours.push(four);
            }
        }
        Self { fours }
    }

    /// In the order in which they are solved, their ends counted from nought again.
    pub fn rows(&self, start: usize) -> Vec<SpringRow> {
        let row = |four: &Four, lane: usize| SpringRow {
            ends: [four.from[lane], four.to[lane]].map(|v| v + start as u32),
            rest: four.rest[lane],
            longest: four.longest[lane],
            share: four.share[lane],
            give: four.give[lane],
            calm: four.calm[lane],
        };
        let all = self.fours.iter().flat_map(|four| (0..4).map(move |lane| row(four, lane)));
        all.filter(|row| row.ends[0] != row.ends[1]).collect()
    }

    /// One pass: every spring is moved towards its length by as much as its stiffness gives in a step, and if that leaves it
    /// longer than it may be, to that. Ends are at `x` plus `u`, and what they have moved by, `u`, changes: a step is short, and
    /// what is lost to rounding in a place would come back a thousandfold as velocity.
    pub fn solve(&self, x: &[Vec4], u: &mut [Vec4]) {
        for four in &self.fours {
            let (from, to) = (four.from.map(|v| v as usize), four.to.map(|v| v as usize));
            let d = columns(x, &from, &to) + columns(u, &from, &to);
            let length = (d.x_axis * d.x_axis + d.y_axis * d.y_axis + d.z_axis * d.z_axis).sqrt();
            let elastic = four.give * (length - four.rest);
            let excess = (length - elastic - four.longest).max(Vec4::ZERO);
            let by = (elastic + excess) / length.max(Vec4::splat(SHORT));
            apply(u, &from, &to, d, by, &four.share);
        }
    }

    /// An extra pass over springs that are longer than they may be: few, and weight hangs at them. Whether there are any.
    pub fn tighten(&self, x: &[Vec4], u: &mut [Vec4]) -> bool {
        let mut any = false;
        for four in &self.fours {
            let (from, to) = (four.from.map(|v| v as usize), four.to.map(|v| v as usize));
            let d = columns(x, &from, &to) + columns(u, &from, &to);
            let square = d.x_axis * d.x_axis + d.y_axis * d.y_axis + d.z_axis * d.z_axis;
            if square.cmple(four.longest * four.longest).all() {
                continue;
            }
            any = true;
            let length = square.sqrt();
            let by = (length - four.longest).max(Vec4::ZERO) / length.max(Vec4::splat(SHORT));
            apply(u, &from, &to, d, by, &four.share);
        }
        any
    }

    /// Dampers act on velocities `v` at `x`.
    pub fn calm(&self, x: &[Vec4], v: &mut [Vec4]) {
        for four in &self.fours {
            let (from, to) = (four.from.map(|v| v as usize), four.to.map(|v| v as usize));
            let d = columns(x, &from, &to);
            let w = columns(v, &from, &to);
            let square = d.x_axis * d.x_axis + d.y_axis * d.y_axis + d.z_axis * d.z_axis;
            let rate = d.x_axis * w.x_axis + d.y_axis * w.y_axis + d.z_axis * w.z_axis;
            let by = four.calm * rate / square.max(Vec4::splat(SHORT * SHORT));
            apply(v, &from, &to, d, by, &four.share);
        }
    }
}

/// Differences of four pairs: all x, all y, all z.
#[inline(always)]
fn columns(x: &[Vec4], from: &[usize; 4], to: &[usize; 4]) -> Mat4 {
    let d = |k: usize| x[to[k]] - x[from[k]];
    Mat4::from_cols(d(0), d(1), d(2), d(3)).transpose()
}

/// Draws pairs together along `d` by `by` times it.
#[inline(always)]
fn apply(u: &mut [Vec4], from: &[usize; 4], to: &[usize; 4], d: Mat4, by: Vec4, share: &[f32; 4]) {
    let m = Mat4::from_cols(d.x_axis * by, d.y_axis * by, d.z_axis * by, Vec4::ZERO).transpose();
    for (k, m) in [m.x_axis, m.y_axis, m.z_axis, m.w_axis].into_iter().enumerate() {
        let own = m * share[k];
        u[from[k]] += own;
        u[to[k]] -= m - own;
    }
}

/// A hinge for one of the passes: the bend it sees, and what each of its vertices gets of it.
#[derive(Clone, Copy)]
struct Bend {
    at: [u32; 4],
    /// Of the first, second and fourth, relative to the third.
    slopes: [f32; 3],
    push: [f32; 4],
    calm: f32,
}

/// Hinges of a strip or border, their vertices counted from its start.
#[derive(Default)]
pub(super) struct Hinges {
    bends: Vec<Bend>,
}

impl Hinges {
    /// As hinges between places with inverse masses; dampers act for `calm` seconds at a time.
    pub fn new(hinges: &[Hinge], inverse: &[f32], range: &Range<usize>, calm: f32) -> Self {
        let stencils: Vec<[u32; 4]> = hinges.iter().map(|h| h.vertices).collect();
        let mut bends = Vec::with_capacity(hinges.len());
        for i in colours(&stencils, range.clone()).into_iter().flatten() {
            let hinge = &hinges[i];
            let w = hinge.vertices.map(|v| inverse[v as usize]);
            let [a, b, c, d] = hinge.slopes;
            let sum: f32 = [0, 1, 2, 3].iter().map(|k| w[*k] * hinge.slopes[*k] * hinge.slopes[*k]).sum();
            let damp = hinge.damper * calm;
            bends.push(Bend {
                at: hinge.vertices.map(|v| v - range.start as u32),
                slopes: [a, b, d],
                push: [a * w[0], b * w[1], c * w[2], d * w[3]].map(|p| p * hinge.stiffness),
                // Of a push per stiffness.
                calm: if hinge.stiffness > 0.0 { damp / (1.0 + damp * sum) / hinge.stiffness } else { 0.0 },
            });
        }
        Self { bends }
    }

    /// In the order in which they act, their vertices counted from nought again.
    pub fn rows(&self, start: usize) -> Vec<HingeRow> {
        let row = |bend: &Bend| {
            let at = bend.at.map(|v| v + start as u32);
            HingeRow { at, slopes: bend.slopes, push: bend.push, calm: bend.calm }
        };
        self.bends.iter().map(row).collect()
    }

    /// Forces at `x`, for `h` seconds, added to velocities; or for h², to what vertices move by.
    pub fn push(&self, x: &[Vec4], to: &mut [Vec4], h: f32) {
        for bend in &self.bends {
            let at = bend.at.map(|v| v as usize);
            let g = bend.of(x, &at) * h;
            for k in 0..4 {
                to[at[k]] -= g * bend.push[k];
            }
        }
    }

    /// Dampers act on velocities.
    pub fn calm(&self, v: &mut [Vec4]) {
        for bend in &self.bends {
            let at = bend.at.map(|v| v as usize);
            let g = bend.of(v, &at) * bend.calm;
            for k in 0..4 {
                v[at[k]] -= g * bend.push[k];
            }
        }
    }
}

impl Bend {
    #[inline(always)]
    fn of(&self, x: &[Vec4], at: &[usize; 4]) -> Vec4 {
        let c = x[at[2]];
        (x[at[0]] - c) * self.slopes[0] + (x[at[1]] - c) * self.slopes[1] + (x[at[3]] - c) * self.slopes[2]
    }
}
