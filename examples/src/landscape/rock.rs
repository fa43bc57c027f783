//! Peaks and boulders: round bodies, displaced by noise whose ridges run down a peak and cut a boulder into faces.

use crate::{skin, smooth};
use glam::{Vec3, vec3};
use std::f32::consts::TAU;
use yugen_motion::noise::noise;
use yugen_optics::random::Pcg32;
use yugen_scene::Mesh;

/// A steep peak.
#[derive(Clone, Copy)]
pub struct Peak {
    /// Where its axis meets the ground.
    pub foot: Vec3,
    /// Of its top.
    pub height: f32,
    /// Half its width above its foot.
    pub radius: f32,
    /// From the foot to below the top.
    pub lean: Vec3,
    /// Which one.
    pub seed: u32,
}

fn ridge(p: Vec3) -> f32 {
    1.0 - 2.2 * noise(p).0.abs()
}

/// Three octaves.
fn fractal(p: Vec3) -> f32 {
    noise(p).0 + 0.5 * noise(2.1 * p).0 + 0.25 * noise(4.3 * p).0
}

impl Peak {
    /// A point of its surface: around, 0 to 1, and up, 0 to 1.
    fn point(&self, around: f32, up: f32) -> Vec3 {
        let (s, c) = (around * TAU).sin_cos();
        let own = 13.7 * self.seed as f32;
        // A shaft that widens towards the ground and rounds off above; shoulders by slow noise.
        let shaft = (1.0 - up.powf(2.6)).max(0.0).powf(0.55) * (1.0 + 0.55 * (1.0 - up).powi(3));
        let slow = 0.42 * noise(vec3(1.1 * c + own, 2.3 * up, 1.1 * s)).0;
        let steps = 0.16 * noise(vec3(own, 7.0 * up + 0.8 * noise(vec3(2.0 * c, own, 2.0 * s)).0, 0.5)).0;
        // Gullies run down: many around, few up.
        let gullies = 0.13 * ridge(vec3(2.7 * c, 1.5 * up + own, 2.7 * s))
            + 0.07 * ridge(vec3(6.1 * c + own, 2.6 * up, 6.1 * s));
        let fine = 0.035 * fractal(vec3(9.0 * c, 13.0 * up + own, 9.0 * s));
        let r = self.radius * shaft * (1.0 + slow + steps + gullies + fine).max(0.05);
        let top = self.height * (1.0 + 0.06 * noise(vec3(3.0 * c * shaft, own, 3.0 * s * shaft)).0);
        self.foot + self.lean * up * up + vec3(r * c, top * up, 0.8 * r * s)
    }

    /// Its mesh, finer where it is near.
    pub fn mesh(&self, near: bool) -> Mesh {
        let [around, up] = if near { [220, 180] } else { [150, 130] };
        let row = |i: usize| {
            // Closer where it rounds off.
            let t = 1.0 - (1.0 - i as f32 / up as f32).powf(1.35);
            (0..around).map(|j| self.point(1.0 - j as f32 / around as f32, t)).collect()
        };
        let rows: Vec<Vec<Vec3>> = (0..=up).map(row).collect();
        smooth(skin(&rows, true))
    }

    /// A place where a pine may stand, on the side of the eye, and the way out of the rock there.
    pub fn stand(&self, number: u32) -> (Vec3, Vec3) {
        let mut random = Pcg32::new(u64::from(self.seed), u64::from(number) + 900);
        let up = 0.5 + 0.5 * (1.0 - random.next_f32().powi(2));
        // The eye is on the side of +z.
        let around = 0.02 + 0.46 * random.next_f32();
        let at = self.point(around, up.min(0.985));
        let out = (at - self.foot).with_y(0.0).normalize_or(Vec3::Z);
        (at, out)
    }
}

/// A boulder.
pub struct Boulder {
    /// Its middle.
    pub at: Vec3,
    /// Half its widths.
    pub size: Vec3,
    /// Which one.
    pub seed: u32,
}

impl Boulder {
    /// Its mesh: a ball cut by planes, rounded a little where they meet, and roughened.
    pub fn mesh(&self) -> Mesh {
        let mut random = Pcg32::new(u64::from(self.seed), 71);
        // Directions of the cuts, and how far out: steep faces and a flat top.
        let mut planes: Vec<(Vec3, f32)> = vec![(vec3(0.08, 1.0, 0.1).normalize(), 0.62)];
        for k in 0..15 {
            let turn = TAU * (k as f32 + random.next_f32()) / 15.0;
            let rise = 0.9 * random.next_f32() - 0.25;
            planes.push((vec3(turn.cos(), rise, turn.sin()).normalize(), 0.62 + 0.3 * random.next_f32()));
        }
        let own = 5.3 * self.seed as f32;
        let [around, up] = [160, 110];
        let point = |i: usize, j: usize| {
            let (a, b) =
                (TAU * (1.0 - j as f32 / around as f32), std::f32::consts::PI * i as f32 / up as f32);
            let d = vec3(b.sin() * a.cos(), -b.cos(), b.sin() * a.sin());
            // The nearest plane, softly.
            let sharp = 26.0;
            let sum: f32 = planes.iter().map(|(n, far)| (d.dot(*n).max(0.0) / far).powf(sharp)).sum();
            let cut = (sum + 1.0).powf(-1.0 / sharp);
            let cracks = 0.075 * ridge(2.3 * d.with_y(0.55 * d.y) + own)
                + 0.045 * ridge(5.5 * d.with_y(0.4 * d.y) + own);
            let r = cut * (1.0 + cracks + 0.03 * fractal(7.0 * d + own));
            self.at + self.size * d * r
        };
        let rows: Vec<Vec<Vec3>> = (0..=up).map(|i| (0..around).map(|j| point(i, j)).collect()).collect();
        smooth(skin(&rows, true))
    }
}
