//! Pines: a bent trunk, branches that reach out flat, and needles in fans; from afar a trunk with flat clouds.

use crate::{skin, smooth, tube};
use glam::{Vec3, vec3};
use std::f32::consts::{PI, TAU};
use yugen_motion::noise::noise;
use yugen_optics::random::Pcg32;
use yugen_scene::Mesh;

/// A pine near by.
pub struct Pine {
    /// Where it comes out of the rock.
    pub foot: Vec3,
    /// Of its top, along the trunk.
    pub height: f32,
    /// Where its top hangs over to.
    pub lean: Vec3,
    /// Which one.
    pub seed: u32,
}

/// Needles of a fan, and how long they are.
const NEEDLES: usize = 26;
const LENGTH: f32 = 0.48;

impl Pine {
    fn trunk(&self, t: f32) -> Vec3 {
        let own = self.seed as f32;
        let bend = |k: f32| noise(vec3(2.4 * t + 0.31 * own, k, 0.7 * own)).0;
        let sway =
            vec3(bend(0.2), 0.0, bend(5.6)) * (2.0 * self.height * 0.24 * (t * (1.15 - t)).max(0.0).sqrt());
        self.foot + self.lean * t.powf(1.4) + Vec3::Y * (self.height * (t - 0.14 * t * t)) + sway
    }

    /// Trunk and branches; the needles of each branch; a cloud for the wash of each.
    pub fn meshes(&self) -> (Mesh, Vec<Mesh>, Vec<Mesh>) {
        let mut random = Pcg32::new(u64::from(self.seed), 17);
        let girth = 0.042 * self.height;
        let path: Vec<Vec3> = (0..=60).map(|i| self.trunk(i as f32 / 60.0)).collect();
        let radii: Vec<f32> = (0..=60)
            .map(|i| {
                let t = i as f32 / 60.0;
                let knots = 1.0 + 0.16 * noise(vec3(14.0 * t, self.seed as f32, 0.3)).0;
                girth * (1.0 - 0.86 * t).max(0.05) * (1.0 + 0.5 * (-t / 0.06).exp()) * knots
            })
            .collect();
        let mut bark = barked(tube(&path, &radii, 20), 0.3 * girth);
        let (mut needles, mut pads) = (Vec::new(), Vec::new());
        let branches = 13;
        for b in 0..branches {
            let t = 0.36 + 0.63 * b as f32 / (branches - 1) as f32;
            let from = self.trunk(t);
            // To both sides in turn, seen from the front, a little forth and back.
            let side = if b % 2 == 0 { 1.0 } else { -1.0 };
            let way = vec3(side, 0.0, 1.3 * (random.next_f32() - 0.45)).normalize();
            let reach = self.height * (0.42 - 0.26 * (t - 0.36)) * (0.65 + 0.6 * random.next_f32());
            let arm = |s: f32| {
                // Out and down, and up again at its end.
                let fall =
                    0.10 * reach * (s * PI).sin() * (0.4 + random_of(self.seed, b)) - 0.16 * reach * s * s;
                let bent = noise(vec3(3.0 * s, b as f32, self.seed as f32)).0;
                from + way * (reach * s) - Vec3::Y * fall
                    + vec3(0.0, 0.22 * reach * bent * s, 0.16 * reach * bent)
            };
            let bough: Vec<Vec3> = (0..=16).map(|i| arm(i as f32 / 16.0)).collect();
            let thick = 0.42 * girth * (1.0 - 0.75 * t);
            let taper: Vec<f32> = (0..=16).map(|i| thick * (1.0 - 0.85 * i as f32 / 16.0)).collect();
            join(&mut bark, tube(&bough, &taper, 8));
            let mut fans = Mesh::default();
            let count = (4.2 * reach / LENGTH) as usize;
            for k in 0..count {
                let s = 0.3 + 0.7 * (k as f32 + random.next_f32()) / count as f32;
                let spread = 0.2 * reach * (1.2 - s);
                let off = vec3(
                    spread * (random.next_f32() - 0.5),
                    0.10 * reach * random.next_f32(),
                    1.2 * spread * (random.next_f32() - 0.5),
                );
                fan(&mut fans, arm(s) + off, side * (0.5 * s), &mut random);
            }
            needles.push(fans);
            let middle = arm(0.68) + Vec3::Y * (0.03 * reach);
            pads.push(cloud(
                middle,
                vec3(0.34 * reach, 0.045 * reach + 0.08, 0.2 * reach),
                self.seed + 7 * b as u32,
            ));
        }
        (bark, needles, pads)
    }
}

/// 0 to 1.
fn random_of(seed: u32, number: usize) -> f32 {
    Pcg32::new(u64::from(seed), 500 + number as u64).next_f32()
}

/// Needles that stand up from a place like an open fan.
fn fan(mesh: &mut Mesh, at: Vec3, lean: f32, random: &mut Pcg32) {
    for k in 0..NEEDLES {
        let turn = PI * (0.04 + 0.92 * (k as f32 + 0.6 * random.next_f32()) / NEEDLES as f32) - lean;
        let depth = 0.9 * (random.next_f32() - 0.5);
        let way = vec3(turn.cos(), turn.sin() * 0.8, depth).normalize();
        let tip = at + way * (LENGTH * (0.7 + 0.45 * random.next_f32()));
        let wide = way.cross(Vec3::Z).normalize_or(Vec3::X) * 0.011;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([at - wide, at + wide, tip]);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
}

/// A flat cloud of leaves.
fn cloud(at: Vec3, size: Vec3, seed: u32) -> Mesh {
    let [around, up] = [28, 14];
    let point = |i: usize, j: usize| {
        let (a, b) = (TAU * (1.0 - j as f32 / around as f32), PI * i as f32 / up as f32);
        let d = vec3(b.sin() * a.cos(), -b.cos(), b.sin() * a.sin());
        at + size * d * (1.0 + 0.5 * noise(2.2 * d + 3.1 * seed as f32).0)
    };
    let rows: Vec<Vec<Vec3>> = (0..=up).map(|i| (0..around).map(|j| point(i, j)).collect()).collect();
    smooth(skin(&rows, true))
}

/// A pine from afar, that leans out of the rock: small clouds in storeys, each of its own, so that they become dots.
pub fn distant(foot: Vec3, out: Vec3, tall: f32, seed: u32) -> Vec<Mesh> {
    let mut random = Pcg32::new(u64::from(seed), 23);
    let tall = tall * (0.7 + 0.6 * random.next_f32());
    let way = Vec3::Y + out * (0.5 * random.next_f32());
    let trunk: Vec<Vec3> = (0..=5).map(|i| foot + way * (tall * (i as f32 / 5.0 - 0.1))).collect();
    let mut parts = vec![tube(&trunk, &[0.05, 0.045, 0.04, 0.03, 0.025, 0.02].map(|r| r * 0.5 * tall), 6)];
    // Storeys, wider below, of a few clouds each.
    for storey in 0..4 {
        let t = 0.42 + 0.6 * storey as f32 / 3.0;
        let wide = 0.34 * tall * (1.2 - 0.8 * t);
        for k in 0..4 - storey.min(2) {
            let shift = wide * (2.0 * random.next_f32() - 1.0);
            let at = foot + way * (tall * t) + vec3(shift, 0.06 * tall * random.next_f32(), 0.3 * shift);
            let half = 0.066 * tall * (0.8 + 0.5 * random.next_f32());
            parts.push(cloud(at, vec3(half, 0.55 * half, 0.8 * half), seed + 5 * storey + k));
        }
    }
    parts
}

/// Bark: ridges along the trunk and knots.
fn barked(mut mesh: Mesh, by: f32) -> Mesh {
    for (p, n) in mesh.positions.iter_mut().zip(&mesh.normals) {
        let knots = noise(vec3(3.1 * p.x, 1.7 * p.y, 3.1 * p.z)).0
            + 0.6 * noise(vec3(9.0 * p.x, 3.0 * p.y, 9.0 * p.z)).0;
        *p += *n * (by * knots);
    }
    smooth(mesh)
}

fn join(to: &mut Mesh, other: Mesh) {
    let first = to.positions.len() as u32;
    to.positions.extend(other.positions);
    to.normals.extend(other.normals);
    to.triangles.extend(other.triangles.into_iter().map(|t| t.map(|v| v + first)));
}
