//! What a player is besides mask and robe: head, hands, feet, the white clothes under the robe, wig and fan; as solids in the
//! coordinates of the joints that carry them.

use crate::sculpt::{cut, ellipsoid, join, mesh, rod, rods};
use crate::solid::{Grain, Grid, Solids};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use yugen_scene::Mesh;

const fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Cell of the socks' mesh, m.
const FINE: f32 = 0.004;

fn around(name: &str, [low, high]: [Vec3; 2], cell: f32, distance: &dyn Fn(Vec3) -> f32) -> Mesh {
    // Cloth and skin are alike all over: any (u, v) in metres does that has no seam.
    mesh(name, [low, high], cell, distance, &|p| v2(p.x + 0.37 * p.z, p.y + 0.23 * p.z) / 0.25)
}

fn v2(x: f32, y: f32) -> Vec2 {
    Vec2::new(x, y)
}

/// Head and chin, of which little is seen beside the mask.
fn skull(p: Vec3) -> f32 {
    let cranium = ellipsoid(p, v(0.0, 0.09, 0.008), v(0.074, 0.1, 0.092));
    let jaw = ellipsoid(p, v(0.0, 0.012, 0.042), v(0.05, 0.052, 0.05));
    join(cranium, jaw, 0.05)
}

/// At the head.
pub fn head() -> Mesh {
    around("head", [v(-0.12, -0.08, -0.13), v(0.12, 0.22, 0.14)], 0.005, &skull)
}

/// The wig without its parting: hair drawn over the ears to the nape, tied there.
fn hair(p: Vec3) -> f32 {
    let side = Vec3::new(p.x.abs(), p.y, p.z);
    let cap = ellipsoid(p, v(0.0, 0.092, 0.0), v(0.089, 0.114, 0.108));
    let locks = rods(
        side,
        &[
            (v(0.068, 0.125, 0.058), 0.016),
            (v(0.073, 0.07, 0.044), 0.02),
            (v(0.066, 0.015, 0.006), 0.023),
            (v(0.038, -0.02, -0.045), 0.022),
            (v(0.0, -0.045, -0.082), 0.022),
        ],
        0.02,
    );
    let tail = rods(
        p,
        &[(v(0.0, 0.03, -0.07), 0.045), (v(0.0, -0.045, -0.086), 0.024), (v(0.0, -0.13, -0.105), 0.019)],
        0.03,
    );
    join(join(cap, locks, 0.03), tail, 0.03)
}

/// The wig of a young woman (kazura), at the head.
pub fn wig() -> Mesh {
    let wig = |p: Vec3| {
        let face = ellipsoid(p, v(0.0, 0.06, 0.135), v(0.062, 0.113, 0.082));
        let neck = ellipsoid(p, v(0.0, -0.05, 0.03), v(0.053, 0.11, 0.078));
        let parting = 0.0035 * (-(p.x / 0.003).powi(2)).exp();
        cut(cut(hair(p), face, 0.012), neck, 0.02) + parting
    };
    // Strands run from the parting down the sides: v is along them.
    let uv = |p: Vec3| {
        let turn = p.x.abs().atan2((p.y - 0.03).max(-0.08 * p.x.abs()));
        v2(p.z + 0.4 * p.y, 0.1 * turn - p.y.min(0.03)) / 0.1
    };
    mesh("wig", [v(-0.14, -0.18, -0.16), v(0.14, 0.24, 0.14)], 0.004, &wig, &uv)
}

/// The band over the wig (kazura-obi), high in front, tied at the back; at the head.
pub fn band() -> Solids {
    let (middle, tilt) = (v(0.0, 0.118, 0.0), v(0.0, 1.0, -0.36).normalize());
    let (x, z) = (Vec3::X, Vec3::X.cross(tilt));
    // As far out as the hair is in each direction.
    let reach = |turn: f32, up: f32, over: f32| {
        let way = x * turn.sin() + z * turn.cos();
        let foot = middle + tilt * up;
        let (mut near, mut far) = (0.02, 0.2);
        for _ in 0..24 {
            let half = 0.5 * (near + far);
            if hair(foot + way * half) < 0.0 { near = half } else { far = half }
        }
        foot + way * (near + over)
    };
    let grid = |over: f32| -> Grid {
        let row = |up: f32| (0..=96).map(|k| reach(2.0 * PI * k as f32 / 96.0, up, over)).collect();
        [0.017, 0.008, 0.0, -0.008, -0.017].map(row).to_vec()
    };
    let mut s = Solids::new();
    let grain = Grain { tile: Vec2::splat(0.1), offset: Vec2::ZERO };
    s.shell(&grid(0.0022), &grid(-0.002), true, grain);
    // Its ends hang down the back.
    for side in [-1.0, 1.0] {
        let line = |dx: f32, z: f32| -> Vec<Vec3> {
            [(0.075, -0.116), (0.03, -0.125), (-0.06, -0.14), (-0.16, -0.145), (-0.26, -0.14)]
                .iter()
                .map(|(y, back)| v(side * (0.018 + 0.03 * (0.075 - y)) + dx, *y, back + z))
                .collect()
        };
        let (front, back) =
            ([line(0.016, 0.0), line(-0.016, 0.0)], [line(0.016, 0.0013), line(-0.016, 0.0013)]);
        // Seen from behind, where z falls to the viewer.
        let transposed =
            |g: &[Vec<Vec3>; 2]| -> Grid { (0..g[0].len()).map(|i| vec![g[0][i], g[1][i]]).collect() };
        s.shell(&transposed(&front), &transposed(&back), true, grain);
    }
    s
}

/// At the neck.
pub fn neck() -> Mesh {
    let neck = |p: Vec3| rod(p, [v(0.0, -0.03, 0.0), v(0.0, 0.11, 0.012)], [0.05, 0.047]);
    around("neck", [v(-0.09, -0.11, -0.09), v(0.09, 0.19, 0.09)], 0.006, &neck)
}

/// A hand that holds a fan's end, at the joint; the left's, along +x.
fn grip(p: Vec3) -> f32 {
    let palm = {
        let q = (p - v(0.048, -0.002, 0.002)).abs() - v(0.036, 0.008, 0.03);
        q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - 0.009
    };
    let wrist = rod(p, [v(-0.05, 0.0, 0.0), v(0.03, 0.0, 0.0)], [0.027, 0.025]);
    let mut hand = join(palm, wrist, 0.02);
    for (k, z) in [0.028f32, 0.0095, -0.009, -0.027].into_iter().enumerate() {
        let long = [0.96, 1.0, 0.97, 0.86][k];
        let finger = rods(
            p,
            &[
                (v(0.084, 0.0, z), 0.0095),
                (v(0.084 + 0.034 * long, -0.014, 0.92 * z), 0.0085),
                (v(0.084 + 0.03 * long, -0.04, 0.85 * z), 0.0078),
                (v(0.084 + 0.005 * long, -0.046, 0.85 * z), 0.007),
            ],
            0.004,
        );
        hand = join(hand, finger, 0.007);
    }
    let thumb = rods(
        p,
        &[
            (v(0.022, -0.006, 0.03), 0.013),
            (v(0.058, -0.02, 0.05), 0.0105),
            (v(0.092, -0.034, 0.036), 0.0085),
        ],
        0.005,
    );
    join(hand, thumb, 0.012)
}

/// Left or right, at its joint.
pub fn hand(left: bool) -> Mesh {
    let own = move |p: Vec3| grip(if left { p } else { v(-p.x, p.y, p.z) });
    let x = if left { [-0.09, 0.15] } else { [-0.15, 0.09] };
    around("hand", [v(x[0], -0.08, -0.07), v(x[1], 0.05, 0.09)], 0.003, &own)
}

/// A white sock with its toe apart (tabi), at the ankle; the left's.
pub fn tabi(left: bool) -> Mesh {
    let foot = |p: Vec3| {
        let ankle = rod(p, [v(0.0, 0.05, -0.005), v(0.0, -0.03, -0.012)], [0.04, 0.037]);
        let heel = rod(p, [v(0.0, -0.05, -0.025), v(0.0, -0.05, 0.05)], [0.033, 0.034]);
        let ball = ellipsoid(p, v(0.004, -0.06, 0.095), v(0.043, 0.023, 0.06));
        let big = rod(p, [v(-0.022, -0.064, 0.10), v(-0.019, -0.066, 0.152)], [0.017, 0.014]);
        let others = ellipsoid(p, v(0.017, -0.067, 0.125), v(0.026, 0.014, 0.032));
        let foot = join(join(ankle, heel, 0.04), ball, 0.03);
        // Toes are sewn apart.
        let toes = big.min(others);
        join(foot, toes, 0.006).max(-0.08 - p.y)
    };
    let own = move |p: Vec3| foot(if left { p } else { v(-p.x, p.y, p.z) });
    around("tabi", [v(-0.08, -0.1, -0.09), v(0.08, 0.11, 0.19)], FINE, &own)
}

/// What is worn under the robe at a joint of trunk and limbs: its rods, rounded into one.
pub fn under(joint: &str, rods_of: &[([Vec3; 2], [f32; 2])]) -> Mesh {
    let distance = |p: Vec3| {
        // Smaller than what cloth lies on, the more so where two meet, so that none of it comes through.
        rods_of
            .iter()
            .map(|(ends, radii)| rod(p, *ends, *radii) + 0.014)
            .fold(f32::INFINITY, |a, b| if a.is_finite() { join(a, b, 0.02) } else { b })
    };
    let (low, high) = rods_of.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), (e, r)| {
        let r = r[0].max(r[1]) + 0.03;
        (l.min(e[0] - r).min(e[1] - r), h.max(e[0] + r).max(e[1] + r))
    });
    around(joint, [low, high], 0.01, &distance)
}

/// Half the angle of the open fan, rad; its radius, m.
const OPEN: f32 = 0.95;
const RADIUS: f32 = 0.33;
/// Where its paper begins, m.
const PAPER: f32 = 0.115;
/// Folds of the paper.
const FOLDS: usize = 24;

/// Where a place of the fan is: along a rib from its pivot, in the right hand.
fn fan_place(turn: f32, along: f32, off: f32) -> Vec3 {
    // The pivot lies in the palm; the fan goes on from the thumb's side, its face up.
    let (pivot, ahead, side, face) =
        (v(-0.075, -0.028, 0.012), v(-0.25, 0.1, 0.96).normalize(), v(-0.96, 0.0, -0.25), Vec3::Y);
    let side = (side - ahead * side.dot(ahead)).normalize();
    let face = (face - ahead * face.dot(ahead) - side * face.dot(side)).normalize();
    pivot + (ahead * turn.cos() + side * turn.sin()) * along + face * off
}

/// The paper of the fan, in the right hand.
pub fn paper() -> Solids {
    let columns = 2 * FOLDS;
    let fold = |j: usize, r: f32| (if j.is_multiple_of(2) { -1.0 } else { 1.0 }) * 0.0042 * r / RADIUS;
    let grid = |off: f32| -> Grid {
        (0..=12)
            .map(|i| {
                let r = RADIUS + (PAPER - RADIUS) * i as f32 / 12.0;
                (0..=columns)
                    .map(|j| fan_place(OPEN * (2.0 * j as f32 / columns as f32 - 1.0), r, fold(j, r) + off))
                    .collect()
            })
            .collect()
    };
    let mut s = Solids::new();
    let uv = |i: usize, j: usize| v2(j as f32 / columns as f32, i as f32 / 12.0);
    s.sheet(&grid(0.0004), &grid(-0.0004), &uv, false, Grain { tile: Vec2::ONE, offset: Vec2::ZERO });
    s
}

/// Its ribs, in the right hand.
pub fn ribs() -> Solids {
    let mut s = Solids::new();
    let grain = Grain { tile: Vec2::splat(0.3), offset: Vec2::ZERO };
    for k in 0..=10 {
        let turn = OPEN * (k as f32 / 5.0 - 1.0);
        let outer = k == 0 || k == 10;
        let width = if outer { 0.012 } else { 0.007 };
        let (from, to) = (fan_place(turn, -0.02, -0.003), fan_place(turn, RADIUS - 0.004, -0.003));
        let face = fan_place(turn, 0.1, 1.0) - fan_place(turn, 0.1, 0.0);
        s.beam(from, to, face, v2(width, 0.0018), 0.0004, grain);
    }
    s
}
