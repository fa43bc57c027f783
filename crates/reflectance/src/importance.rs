//! Importance sampling of any reflection from a table: for a grid of eye directions, a piecewise-constant
//! density of the half vector, made once from the model itself.
//!
//! Polar angles are cut nearly at equal steps of √θ_h, as MERL cuts them, because highlights are narrow. The
//! density is linear between the centres of the cells, so that it has no steps: a cell is drawn, then a point from
//! the tent around its centre. Azimuth is counted from the plane that holds the eye. Between the grid's eye directions
//! one of the neighbours is drawn at random, so that the density is their mixture and exact. One draw in ten goes
//! to a cosine lobe instead: no light is ever missed, however coarse the table.

use crate::axis::{azimuth, polar_angle};
use crate::model::Sample;
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::distribution::{accumulate, choose};
use yugen_optics::frame::spherical;
use yugen_optics::warp::{cosine_hemisphere, cosine_hemisphere_pdf};

/// The functions in WGSL, spliced in after `frame.wgsl`.
pub const IMPORTANCE_WGSL: &str = include_str!("importance.wgsl");

/// The part of π/2 below which cells are even in θ_h² rather than in √θ_h, well within the first cell: a density over
/// √θ_h alone would be infinite at the pole.
const POLE: f32 = 1e-4;

/// The part of the draws that goes to the cosine lobe.
pub const COSINE_SHARE: f32 = 0.1;

/// Where a table lies and how fine it is. The same numbers make the twin's `HalfVectorTable`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfVectorTable {
    /// Index of its first number in the model's table.
    pub start: usize,
    /// Polar angles of the eye, 0 to π/2, both included; at least 2.
    pub n_theta: usize,
    /// Azimuths of the eye; 1 for isotropic models.
    pub n_phi: usize,
    /// Cells along √θ_h.
    pub n_u: usize,
    /// Cells around.
    pub n_v: usize,
}

impl HalfVectorTable {
    /// Numbers for one eye direction: the cumulative distribution over u, then one over v for each u.
    const fn stride(&self) -> usize {
        self.n_u + 1 + self.n_u * (self.n_v + 1)
    }

    /// Numbers in all.
    pub const fn len(&self) -> usize {
        self.n_theta * self.n_phi * self.stride()
    }

    /// Never true; here for the custom of `len`.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The table for a reflection `f(wo, wi)`.
    pub fn build(&self, f: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<f32> {
        // 2 × 2 points a cell: finer changes the weights by less than the cells themselves do.
        const SUB: usize = 2;
        let mut table = Vec::with_capacity(self.len());
        let mut cells = vec![0.0f64; self.n_u * self.n_v];
        for j in 0..self.n_phi {
            for i in 0..self.n_theta {
                // At exactly 90° there is nothing to see; stay half a degree off.
                let theta_o = (FRAC_PI_2 * i as f32 / (self.n_theta - 1) as f32).min(FRAC_PI_2 - 0.008);
                let phi_o = TAU * j as f32 / self.n_phi as f32;
                let wo = spherical(theta_o, phi_o);
                for (c, cell) in cells.iter_mut().enumerate() {
                    let (a, b) = (c / self.n_v, c % self.n_v);
                    *cell = 0.0;
                    for s in 0..SUB * SUB {
                        let (x, y) = ((s / SUB) as f32 + 0.5, (s % SUB) as f32 + 0.5);
                        let u = (a as f32 + x / SUB as f32) / self.n_u as f32;
                        let theta = theta_of(u);
                        let h = spherical(theta, phi_o + TAU * (b as f32 + y / SUB as f32) / self.n_v as f32);
                        let cos = wo.dot(h);
                        let wi = 2.0 * cos * h - wo;
                        if cos > 0.0 && wi.z > 0.0 {
                            let density = f(wo, wi).element_sum() * wi.z * 4.0 * cos * solid_angle(u, theta);
                            if density > 0.0 && density.is_finite() {
                                *cell += f64::from(density);
                            }
                        }
                    }
                }
                self.push_node(&cells, &mut table);
            }
        }
        table
    }

    fn push_node(&self, cells: &[f64], table: &mut Vec<f32>) {
        let rows: Vec<f64> = cells.chunks_exact(self.n_v).map(|row| row.iter().sum()).collect();
        push_sums(&rows, table);
        for row in cells.chunks_exact(self.n_v) {
            push_sums(row, table);
        }
    }

    /// The up to four grid directions around `wo` with their shares.
    fn nodes(&self, wo: Vec3) -> [(usize, f32); 4] {
        let x = polar_angle(wo) / FRAC_PI_2 * (self.n_theta - 1) as f32;
        let i = (x as usize).min(self.n_theta - 2);
        let x = (x - i as f32).min(1.0);
        let (mut j, mut k, mut y) = (0, 0, 0.0);
        if self.n_phi > 1 {
            let phi = azimuth(wo) / TAU;
            y = (phi - phi.floor()) * self.n_phi as f32;
            j = (y as usize).min(self.n_phi - 1);
            y -= j as f32;
            k = (j + 1) % self.n_phi;
        }
        let node = |i: usize, j: usize| self.start + (j * self.n_theta + i) * self.stride();
        [
            (node(i, j), (1.0 - x) * (1.0 - y)),
            (node(i + 1, j), x * (1.0 - y)),
            (node(i, k), (1.0 - x) * y),
            (node(i + 1, k), x * y),
        ]
    }

    /// Density per solid angle with which [`Self::sample`] draws `wi`.
    pub fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let h = wo + wi;
        let length = h.length();
        let cos = 0.5 * length;
        let theta = polar_angle(h);
        let u = u_of(theta);
        let v = (azimuth(h) - azimuth(wo)) / TAU;
        // The cells whose centres lie around the point; the first and last go on to the ends.
        let x = (u * self.n_u as f32 - 0.5).clamp(0.0, (self.n_u - 1) as f32);
        let a = (x as usize).min(self.n_u - 2);
        let x = x - a as f32;
        let y = (v - v.floor()) * self.n_v as f32 - 0.5;
        let low = y.floor();
        let y = y - low;
        let b = (low as i32).rem_euclid(self.n_v as i32) as usize;
        let c = (b + 1) % self.n_v;
        let mut p = 0.0;
        for (node, share) in self.nodes(wo) {
            if share > 0.0 {
                for (a, x) in [(a, 1.0 - x), (a + 1, x)] {
                    let row = node + self.n_u + 1 + a * (self.n_v + 1);
                    let cell = |b: usize| table[row + b + 1] - table[row + b];
                    let along = (1.0 - y) * cell(b) + y * cell(c);
                    p += share * x * (table[node + a + 1] - table[node + a]) * along;
                }
            }
        }
        let per_h = (self.n_u * self.n_v) as f32 / (TAU * solid_angle(u, theta));
        COSINE_SHARE * cosine_hemisphere_pdf(wi) + (1.0 - COSINE_SHARE) * p * per_h / (4.0 * cos)
    }

    /// Draws a light direction; `None` where it would lie below the surface.
    pub fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Vec3> {
        if wo.z <= 0.0 {
            return None;
        }
        if u.z < COSINE_SHARE {
            return Some(cosine_hemisphere(Vec2::new(u.x, u.y))).filter(|wi| wi.z > 0.0);
        }
        let mut choice = (u.z - COSINE_SHARE) / (1.0 - COSINE_SHARE);
        let nodes = self.nodes(wo);
        let mut node = nodes[0].0;
        for (n, share) in nodes {
            if share > 0.0 {
                node = n;
            }
            choice -= share;
            if choice < 0.0 {
                break;
            }
        }
        let (a, s, _) = choose(&table[node + 1..][..self.n_u], u.x);
        let row = node + self.n_u + 1 + a * (self.n_v + 1);
        let (b, t, _) = choose(&table[row + 1..][..self.n_v], u.y);
        // Beyond the ends the tent folds back.
        let u = ((a as f32 + tent(s)) / self.n_u as f32).abs();
        let theta = theta_of(if u > 1.0 { 2.0 - u } else { u });
        let h = spherical(theta, azimuth(wo) + TAU * (b as f32 + tent(t)) / self.n_v as f32);
        let wi = 2.0 * wo.dot(h) * h - wo;
        (wo.dot(h) > 0.0 && wi.z > 0.0).then(|| wi.normalize())
    }

    /// A whole [`Sample`] of the model whose reflection is `f`.
    pub fn sample_with(
        &self,
        table: &[f32],
        wo: Vec3,
        u: Vec3,
        f: impl Fn(Vec3, Vec3) -> Vec3,
    ) -> Option<Sample> {
        let wi = self.sample(table, wo, u)?;
        let pdf = self.pdf(table, wo, wi);
        let weight = f(wo, wi) * (wi.z / pdf);
        (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf, delta: false, eta: 1.0 })
    }
}

/// u⁴ is (θ² + ε²)/(π/2)² but for offset and scale, which map θ from 0 to π/2 to u from 0 to 1.
fn fourth_root_scale() -> (f32, f32) {
    let offset = POLE.sqrt();
    (offset, (1.0 + POLE * POLE).sqrt().sqrt() - offset)
}

fn u_of(theta: f32) -> f32 {
    let (offset, scale) = fourth_root_scale();
    let t = theta / FRAC_PI_2;
    ((t * t + POLE * POLE).sqrt().sqrt() - offset) / scale
}

fn theta_of(u: f32) -> f32 {
    let (offset, scale) = fourth_root_scale();
    // y⁴ − ε² as a product, without cancellation for small u.
    let d = u * scale;
    let y = d + offset;
    let t2 = d * (y + offset) * (y * y + POLE);
    FRAC_PI_2 * t2.max(0.0).sqrt()
}

/// sin θ dθ/du: solid angle per u and radian of azimuth.
fn solid_angle(u: f32, theta: f32) -> f32 {
    let (offset, scale) = fourth_root_scale();
    let y = u * scale + offset;
    let sinc = if theta > 1e-4 { theta.sin() / theta } else { 1.0 };
    2.0 * FRAC_PI_2 * FRAC_PI_2 * y * y * y * scale * sinc
}

/// Where in [−1/2, 3/2] the tent around 1/2 puts a uniform number.
fn tent(s: f32) -> f32 {
    if s < 0.5 { (2.0 * s).sqrt() - 0.5 } else { 1.5 - (2.0 - 2.0 * s).sqrt() }
}

/// A zero, and what part of the cells' sum each and those before it have.
fn push_sums(cells: &[f64], table: &mut Vec<f32>) {
    let start = table.len() + 1;
    table.resize(start + cells.len(), 0.0);
    accumulate(cells.iter().copied(), &mut table[start..]);
}

/// Rusinkiewicz 1998, "A New Change of Variables for Efficient BRDF Representation": θ_h, θ_d in [0, π/2],
/// φ_d in (−π, π], in radians, of a pair of directions; exact down to the smallest angles.
#[inline]
pub fn rusinkiewicz(wo: Vec3, wi: Vec3) -> Vec3 {
    let (h, d) = (wo + wi, wi - wo);
    let sin_h = h.truncate().length();
    let theta_h = sin_h.atan2(h.z);
    // |wi − wo| = 2 sin θ_d, |wi + wo| = 2 cos θ_d.
    let theta_d = d.length().atan2(h.length());
    // The frame whose z is h: x points down the meridian, y along the parallel. d is perpendicular to h.
    let t = if sin_h > 0.0 { h.truncate() / sin_h } else { Vec2::X };
    let (sin, cos) = theta_h.sin_cos();
    let x = cos * d.truncate().dot(t) - sin * d.z;
    let y = t.perp_dot(d.truncate());
    let phi_d = if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) };
    Vec3::new(theta_h, theta_d.min(FRAC_PI_2), phi_d)
}

/// The pair (wo, wi) with Rusinkiewicz angles θ_h, θ_d, φ_d and φ_h = 0; the way back from [`rusinkiewicz`].
pub fn from_rusinkiewicz(theta_h: f32, theta_d: f32, phi_d: f32) -> (Vec3, Vec3) {
    let to_world = |w: Vec3| {
        let (sin, cos) = theta_h.sin_cos();
        Vec3::new(cos * w.x + sin * w.z, w.y, -sin * w.x + cos * w.z)
    };
    (to_world(spherical(theta_d, phi_d + PI)), to_world(spherical(theta_d, phi_d)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::microfacet::{d_ggx, v_smith_ggx_correlated};
    use yugen_optics::quadrature::gauss_legendre;
    use yugen_optics::random::Pcg32;

    #[test]
    fn rusinkiewicz_angles_round_trip_and_swap() {
        let mut rng = Pcg32::new(3, 5);
        for _ in 0..2000 {
            let u = rng.next_vec3();
            // Away from the poles, where single precision loses φ_d.
            let (th, td, pd) = (0.05 + 1.4 * u.x * u.x, 0.05 + 1.3 * u.y, TAU * u.z - PI);
            let (wo, wi) = from_rusinkiewicz(th, td, pd);
            let back = rusinkiewicz(wo, wi);
            assert!((back - Vec3::new(th, td, pd)).abs().max_element() < 3e-5, "{back} from {th} {td} {pd}");
            let swapped = rusinkiewicz(wi, wo);
            let turn = (swapped.z - back.z).rem_euclid(TAU) - PI;
            assert!((swapped - back).truncate().length() < 1e-6 && turn.abs() < 3e-5);
        }
    }

    #[test]
    fn densities_integrate_to_the_part_above_the_horizon_and_samples_follow_them() {
        let f = |wo: Vec3, wi: Vec3| {
            let h = (wo + wi).normalize();
            Vec3::splat(0.1 + d_ggx(h, 0.2, 0.4) * v_smith_ggx_correlated(wo, wi, 0.2, 0.4))
        };
        let t = HalfVectorTable { start: 0, n_theta: 9, n_phi: 8, n_u: 24, n_v: 24 };
        let table = t.build(f);
        assert_eq!(table.len(), t.len());
        let mut rng = Pcg32::new(1, 9);
        for wo in [spherical(0.3, 0.4), spherical(1.1, 2.0), spherical(1.4, -2.5)] {
            let n = 40_000;
            let (mut found, mut albedo) = (0, 0.0f64);
            let mut upper = [0.0f64; 2];
            for _ in 0..n {
                let u = rng.next_vec3();
                if let Some(s) = t.sample_with(&table, wo, u, f) {
                    found += 1;
                    albedo += f64::from(s.weight.x);
                    upper[usize::from(s.wi.x > 0.3)] += 1.0;
                }
            }
            let (mut mass, mut side, mut want) = (0.0f64, 0.0f64, 0.0f64);
            for (z, w) in gauss_legendre(400, 0.0, 1.0) {
                for k in 0..800 {
                    let phi = f64::from(k) * f64::from(TAU) / 800.0;
                    let wi = spherical(z.acos() as f32, phi as f32);
                    let dw = w * f64::from(TAU) / 800.0;
                    let p = f64::from(t.pdf(&table, wo, wi)) * dw;
                    mass += p;
                    side += if wi.x > 0.3 { p } else { 0.0 };
                    want += f64::from(f(wo, wi).x) * z * dw;
                }
            }
            // Three sigma of the counts, and the grid's error on a density with steps.
            assert!((mass - found as f64 / n as f64).abs() < 6e-3, "{wo}: {mass} {found}");
            assert!((side - upper[1] / n as f64).abs() < 1e-2, "{wo}: {side} {upper:?}");
            assert!((albedo / n as f64 / want - 1.0).abs() < 0.015, "{wo}: {} {want}", albedo / n as f64);
        }
    }
}
