//! Footprint masks: what a brush leaves where it touches the paper, and how far ink creeps from there.

use glam::{Vec2, Vec3};
use yugen_motion::noise::noise;
use yugen_optics::random::Pcg32;
use yugen_optics::special::smoothstep;

/// Texels across a mask.
pub const TEXELS: usize = 128;
/// Masks, of which each stamp takes one by chance.
pub const VARIANTS: usize = 16;
/// Half the width of a mask in half widths of the brush: what lies beyond 1 is where ink creeps to.
pub const EXTENT: f32 = 1.75;

/// A mask: coverage by the bristles, and by ink that has crept, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    /// 0 to 1; the greatest is 1.
    pub bristles: Vec<f32>,
    /// 0 to 1.
    pub diffused: Vec<f32>,
}

/// Distance of the rim from the middle that counts as 1: a drop whose heel is round and whose toe, where the brush goes, is
/// longer. x along the brush's way, y across, in half widths.
fn support(p: Vec2) -> f32 {
    let toe = if p.x > 0.0 { 1.12 } else { 0.95 };
    Vec2::new(p.x / toe, p.y).length()
}

/// Fractal noise of four octaves, standard deviation about .3.
fn fbm(p: Vec2, layer: f32) -> f32 {
    (0..4).map(|o| noise((p * (1 << o) as f32).extend(layer + 17.3 * o as f32)).0 * 0.5f32.powi(o)).sum()
}

impl Footprint {
    /// Number `variant` of a brush: `roughness` 0 to 1 says how ragged its rim is and how far its bristles stand apart.
    pub fn new(seed: u32, variant: u32, roughness: f32) -> Self {
        let mut random = Pcg32::new(u64::from(seed), u64::from(variant));
        let tips = bristle_tips(&mut random, roughness);
        let layer = variant as f32 * 3.7 + 0.5;
        let at = |i: usize| {
            let texel = |k: usize| ((k as f32 + 0.5) / TEXELS as f32 * 2.0 - 1.0) * EXTENT;
            Vec2::new(texel(i % TEXELS), texel(i / TEXELS))
        };
        let mut bristles: Vec<f32> = (0..TEXELS * TEXELS)
            .map(|i| {
                let p = at(i);
                let rim = support(p) + (0.05 + 0.16 * roughness) * fbm(p * 3.1, layer);
                let inside = smoothstep(1.0, 0.8, rim);
                if inside == 0.0 {
                    return 0.0;
                }
                let missed: f32 = tips
                    .iter()
                    .map(|(tip, load, width)| {
                        1.0 - load * (-0.5 * (p - *tip).length_squared() / (width * width)).exp()
                    })
                    .product();
                let body = 1.0 - missed * (0.15 + 0.6 * roughness);
                inside * body * (1.0 + 0.25 * fbm(p * 5.0, layer + 40.0)).clamp(0.0, 1.3)
            })
            .collect();
        let most = bristles.iter().copied().fold(1e-6, f32::max);
        bristles.iter_mut().for_each(|f| *f /= most);
        let diffused = diffuse(&bristles, at, layer);
        Self { bristles, diffused }
    }

    /// Multiplies the bristles' ink by `part` of the place across, −1 to 1.
    pub fn scale_across(&mut self, part: &dyn Fn(f32) -> f32) {
        for (y, row) in self.bristles.chunks_exact_mut(TEXELS).enumerate() {
            let across = ((y as f32 + 0.5) / TEXELS as f32 * 2.0 - 1.0) * EXTENT;
            let part = part(across.clamp(-1.0, 1.0));
            row.iter_mut().for_each(|f| *f *= part);
        }
    }
}

/// Tips of bristles, at least so far apart that none stands on another; how much ink each has and how wide it is.
fn bristle_tips(random: &mut Pcg32, roughness: f32) -> Vec<(Vec2, f32, f32)> {
    // Few bristles of a worn brush, many of a soft one.
    let count = (200.0 - 130.0 * roughness) as usize;
    let apart = 1.1 / (count as f32).sqrt();
    let mut tips: Vec<(Vec2, f32, f32)> = Vec::new();
    // Dart throwing; ten throws for each fill all there is room for.
    for _ in 0..10 * count {
        let p = Vec2::new(random.next_f32() * 2.2 - 1.1, random.next_f32() * 2.0 - 1.0);
        if tips.len() < count && support(p) < 0.95 && tips.iter().all(|t| t.0.distance(p) > apart) {
            let load = (0.35 * random.normal() - 0.25).exp().min(1.0);
            tips.push((p, load, 0.04 + 0.05 * random.next_f32()));
        }
    }
    tips
}

/// Ink that has crept into the paper: a wide blur, bent along fibres, with a darker rim where it came to rest.
fn diffuse(bristles: &[f32], at: impl Fn(usize) -> Vec2, layer: f32) -> Vec<f32> {
    let n = TEXELS as isize;
    let sigma = 0.22 / (2.0 * EXTENT) * TEXELS as f32;
    let reach = (3.0 * sigma) as isize;
    let kernel: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp()).collect();
    let total: f32 = kernel.iter().sum();
    let blur = |values: &[f32], step: isize, across: bool| -> Vec<f32> {
        (0..n * n)
            .map(|i| {
                let (x, y) = (i % n, i / n);
                let sum: f32 = (-reach..=reach)
                    .zip(&kernel)
                    .map(|(k, w)| {
                        let (x, y) = if across { (x + k, y) } else { (x, y + k) };
                        let inside = (0..n).contains(&x) && (0..n).contains(&y);
                        if inside { w * values[(y * n + x) as usize] } else { 0.0 }
                    })
                    .sum();
                sum / total * step as f32
            })
            .collect()
    };
    let blurred = blur(&blur(bristles, 1, true), 1, false);
    let sample = |p: Vec2| {
        let t = ((p / EXTENT + 1.0) * 0.5 * TEXELS as f32 - 0.5)
            .clamp(Vec2::ZERO, Vec2::splat(TEXELS as f32 - 1.001));
        let (x, y) = (t.x as usize, t.y as usize);
        let (u, v) = (t.x - x as f32, t.y - y as f32);
        let at = |x: usize, y: usize| blurred[y.min(TEXELS - 1) * TEXELS + x.min(TEXELS - 1)];
        (at(x, y) * (1.0 - u) + at(x + 1, y) * u) * (1.0 - v)
            + (at(x, y + 1) * (1.0 - u) + at(x + 1, y + 1) * u) * v
    };
    let warped: Vec<f32> = (0..TEXELS * TEXELS)
        .map(|i| {
            let p = at(i);
            // Fibres are long: they bend across more than along.
            let bend = Vec2::new(fbm(p * 2.0, layer + 70.0), fbm(p * 6.0, layer + 90.0));
            sample(p + 0.16 * bend)
        })
        .collect();
    let slope: Vec<f32> = (0..n * n)
        .map(|i| {
            let (x, y) = (i % n, i / n);
            let at = |x: isize, y: isize| warped[(y.clamp(0, n - 1) * n + x.clamp(0, n - 1)) as usize];
            Vec2::new(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1)).length()
        })
        .collect();
    let [most, steepest] = [&warped, &slope].map(|v| v.iter().copied().fold(1e-6, f32::max));
    // Nothing at the border of the mask, where a stamp ends.
    let inside = |i: usize| smoothstep(0.98 * EXTENT, 0.8 * EXTENT, at(i).length());
    (0..TEXELS * TEXELS)
        .map(|i| ((warped[i] / most + 0.35 * slope[i] / steepest) / 1.2 * inside(i)).clamp(0.0, 1.0))
        .collect()
}

/// Texels of the bristles' trail across and along.
pub const TRAIL: [usize; 2] = [512, 128];

/// Waves of the trail across, of its coarsest noise.
pub const TRAIL_WAVES: f32 = 26.0;

/// What each bristle leaves along a stroke: x along, which repeats, y across; evenly distributed from 0 to 1, so that a
/// threshold is a share of the surface. Long in the direction of the stroke.
pub fn bristle_trail(seed: u32) -> Vec<f32> {
    let [w, h] = TRAIL;
    let offset = Vec3::new(0.0, 0.0, (seed & 0xff) as f32 + 0.5);
    let values: Vec<f32> = (0..w * h)
        .map(|i| {
            let (u, v) = ((i % w) as f32 / w as f32, (i / w) as f32 / h as f32);
            // Few waves along and many across; along, the two ends are blended so that they meet.
            let wave = |along: f32, across: f32, z: f32| {
                let around = |t: f32| {
                    let blend = |t: f32| noise(Vec3::new(t * along, v * across, z) + offset).0;
                    blend(t) * (1.0 - t) + blend(t - 1.0) * t
                };
                around(u)
            };
            wave(3.0, TRAIL_WAVES, 0.0) + 0.7 * wave(7.0, 55.0, 31.0) + 0.35 * wave(24.0, 64.0, 57.0)
        })
        .collect();
    evened(&values)
}

/// The same order of values, evenly from 0 to 1.
pub fn evened(values: &[f32]) -> Vec<f32> {
    let mut order: Vec<u32> = (0..values.len() as u32).collect();
    order.sort_by(|a, b| values[*a as usize].total_cmp(&values[*b as usize]));
    let mut out = vec![0.0; values.len()];
    for (rank, i) in order.into_iter().enumerate() {
        out[i as usize] = (rank as f32 + 0.5) / values.len() as f32;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_full_in_its_middle_and_nothing_at_its_border() {
        for roughness in [0.0, 0.5, 1.0] {
            let mask = Footprint::new(7, 3, roughness);
            for values in [&mask.bristles, &mask.diffused] {
                assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
                let border = (0..TEXELS).flat_map(|i| [i, i * TEXELS, (TEXELS - 1) * TEXELS + i]);
                assert!(border.into_iter().all(|i| values[i] == 0.0));
            }
            let mean = mask.bristles.iter().sum::<f32>() / mask.bristles.len() as f32;
            // A disc of radius one in a square of 3.5: .26, less what lies between bristles.
            assert!((0.08..0.28).contains(&mean), "{mean}");
            let wider = mask.diffused.iter().filter(|v| **v > 0.02).count();
            assert!(wider > mask.bristles.iter().filter(|v| **v > 0.02).count());
            assert_eq!(mask, Footprint::new(7, 3, roughness));
        }
        assert_ne!(Footprint::new(7, 3, 0.5), Footprint::new(7, 4, 0.5));
    }

    #[test]
    fn bristles_leave_long_trails_of_even_shares() {
        let trail = bristle_trail(1);
        let [w, h] = TRAIL;
        let share = |limit: f32| trail.iter().filter(|v| **v < limit).count() as f32 / trail.len() as f32;
        for limit in [0.1, 0.5, 0.77] {
            assert!((share(limit) - limit).abs() < 1e-3);
        }
        // Correlation along and across at a distance of eight texels.
        let correlation = |dx: usize, dy: usize| {
            let pairs = (0..w * h).map(|i| {
                let j = ((i / w + dy) % h) * w + (i % w + dx) % w;
                (trail[i] - 0.5) * (trail[j] - 0.5)
            });
            pairs.sum::<f32>() / (w * h) as f32 * 12.0
        };
        let (along, across) = (correlation(12, 0), correlation(0, 3));
        assert!(along > 0.5 && across < along, "{along} {across}");
        // Both ends meet.
        let jump = (0..h).map(|y| (trail[y * w] - trail[y * w + w - 1]).abs()).sum::<f32>() / h as f32;
        assert!(jump < 0.1, "{jump}");
    }
}
