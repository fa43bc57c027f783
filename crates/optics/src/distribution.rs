//! Piecewise-constant densities over one and two dimensions, sampled by inversion.

use glam::Vec2;

/// A piecewise-constant density over [0, 1) with `n` equal cells.
#[derive(Clone, Debug)]
pub struct Distribution1d {
    cdf: Vec<f32>,
    /// `guide[k]`: the last cell whose lower edge is ≤ k/n. Chen and Asau 1974, "On generating random variates from
    /// an empirical distribution": from there the search is a step or two.
    guide: Vec<u32>,
    integral: f32,
}

impl Distribution1d {
    /// From non-negative cell values. All-zero input becomes uniform.
    pub fn new(values: &[f32]) -> Self {
        assert!(!values.is_empty(), "a distribution needs at least one cell");
        let mut sum = 0.0f64;
        let mut cdf: Vec<f64> = Vec::with_capacity(values.len() + 1);
        cdf.push(0.0);
        for &v in values {
            sum += if v.is_finite() { f64::from(v.max(0.0)) } else { 0.0 };
            cdf.push(sum);
        }
        let n = values.len() as f64;
        let cdf: Vec<f32> = if sum > 0.0 {
            cdf.into_iter().map(|c| (c / sum) as f32).collect()
        } else {
            (0..=values.len()).map(|i| (i as f64 / n) as f32).collect()
        };
        let mut cell = 0;
        let guide = (0..values.len())
            .map(|k| {
                let u = k as f32 / values.len() as f32;
                while cell + 1 < values.len() && cdf[cell + 1] <= u {
                    cell += 1;
                }
                cell as u32
            })
            .collect();
        Self { cdf, guide, integral: (sum / n) as f32 }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Never true; here for the custom of `len`.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The mean of the values it was made from.
    #[inline]
    pub fn integral(&self) -> f32 {
        self.integral
    }

    /// Probability of cell `i`.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        self.cdf[i + 1] - self.cdf[i]
    }

    /// The cell that `u` falls into, and `u` stretched back to [0, 1) within it.
    #[inline]
    pub fn sample_discrete(&self, u: f32) -> (usize, f32) {
        // The last cell whose lower edge is ≤ u, never one of zero width.
        let n = self.len();
        let mut i = self.guide[((u * n as f32) as usize).min(n - 1)] as usize;
        while i + 1 < n && self.cdf[i + 1] <= u {
            i += 1;
        }
        // u · n may have been rounded up.
        while i > 0 && self.cdf[i] > u {
            i -= 1;
        }
        let width = self.probability(i);
        let v = if width > 0.0 { (u - self.cdf[i]) / width } else { 0.5 };
        (i, v.clamp(0.0, ONE_MINUS_EPSILON))
    }

    /// A point in [0, 1) and its density.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let (i, v) = self.sample_discrete(u);
        ((i as f32 + v) / self.len() as f32, self.probability(i) * self.len() as f32)
    }

    /// Density at `x` in [0, 1).
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        let i = ((x * self.len() as f32) as usize).min(self.len() - 1);
        self.probability(i) * self.len() as f32
    }
}

/// The largest `f32` below one.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// A piecewise-constant density over the unit square: rows along x, chosen by a marginal along y.
#[derive(Clone, Debug)]
pub struct Distribution2d {
    rows: Vec<Distribution1d>,
    marginal: Distribution1d,
}

impl Distribution2d {
    /// From `height` rows of `width` non-negative values.
    pub fn new(values: &[f32], width: usize, height: usize) -> Self {
        assert_eq!(values.len(), width * height);
        let rows: Vec<_> = values.chunks_exact(width).map(Distribution1d::new).collect();
        let marginal = Distribution1d::new(&rows.iter().map(Distribution1d::integral).collect::<Vec<_>>());
        Self { rows, marginal }
    }

    /// A point of the unit square and its density.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, v) = self.marginal.sample_discrete(u.y);
        let (x, pdf_x) = self.rows[row].sample(u.x);
        let n = self.rows.len() as f32;
        (Vec2::new(x, (row as f32 + v) / n), pdf_x * self.marginal.probability(row) * n)
    }

    /// Density at a point of the unit square.
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        let row = ((p.y * self.rows.len() as f32) as usize).min(self.rows.len() - 1);
        self.rows[row].pdf(p.x) * self.marginal.pdf(p.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn samples_fall_where_the_density_says() {
        let values = [0.0, 1.0, 3.0, 0.0, 2.0, 2.0];
        let d = Distribution2d::new(&values, 3, 2);
        let mut rng = Pcg32::new(1, 1);
        let mut seen = [0u32; 6];
        let n = 100_000;
        for _ in 0..n {
            let (p, pdf) = d.sample(Vec2::new(rng.next_f32(), rng.next_f32()));
            assert!((d.pdf(p) - pdf).abs() < 1e-4);
            seen[(p.y * 2.0) as usize * 3 + (p.x * 3.0) as usize] += 1;
        }
        for (s, v) in seen.iter().zip(values) {
            assert!((*s as f32 / n as f32 - v / 8.0).abs() < 0.006, "{seen:?}");
        }
        assert_eq!(d.sample(Vec2::ZERO).1, d.pdf(d.sample(Vec2::ZERO).0));
    }
}
