//! Whether photographs are those that their list of lights speaks of.
//!
//! A list of another stack, or one in another order, has as many directions as any, and each texel finds some normal under
//! them. But whatever a thing is made of, it looks much the same under lights that stand near each other: under the right
//! list how alike two photographs are goes with how near their lights are, and under a wrong one it does not. Whether two
//! matrices of likeness go with each other by more than chance is told by shuffling one of them (Mantel 1967, "The Detection
//! of Disease Clustering and a Generalized Regression Approach").

use crate::stack::{Lights, Stack};
use glam::Vec3;
use yugen_optics::random::Pcg32;

/// With fewer lights too few orders differ.
const FEWEST: usize = 7;
/// So many orders are tried.
const ORDERS: usize = 199;
/// A list is doubted if more than this part of all orders fits the photographs as well.
pub const BY_CHANCE: f32 = 0.05;
/// Where texels change by less than this part of their mean, more than all of them do, there is noise only.
const NOISE: f64 = 0.05;
/// Where photographs are less alike or unlike than this, root mean square of their correlations, they do not tell: of noise alone,
/// each texel over its mean, seven are by .14 and twelve by .10; highlights too narrow for so few lights are hardly more.
const LIKENESS: f64 = 0.2;
/// A highlight counts no more than this, in means of its texel.
const BRIGHT: f32 = 3.0;
/// Texels that are looked at.
const TEXELS: usize = 1 << 12;

/// What part of the orders in which a list might have its lights fits the photographs of `bands` at least as well as its own.
/// `None` where they do not tell: of too few lights, or of texels that all change alike.
pub fn orders_as_good(bands: &[Stack]) -> Option<f32> {
    let _span = tracing::info_span!("check_lights").entered();
    let lights = bands.first().map(|b| &b.lights).filter(|l| l.len() >= FEWEST)?;
    let n = lights.len();
    let (Lights::Distant(toward) | Lights::Near(toward)) = lights;
    let toward: Vec<Vec3> = toward.iter().map(|l| l.normalize_or_zero()).collect();
    let alike = alike(bands, n)?;
    let pairs = || (1..n).flat_map(|j| (0..j).map(move |i| (i, j)));
    let near = |i: usize, j: usize| f64::from(toward[i].dot(toward[j]));
    let count = (n * (n - 1) / 2) as f64;
    let mean = |of: &dyn Fn(usize, usize) -> f64| pairs().map(|(i, j)| of(i, j)).sum::<f64>() / count;
    let (mean_near, mean_alike) = (mean(&near), mean(&|i, j| alike[i * n + j]));
    let spread = mean(&|i, j| (near(i, j) - mean_near).powi(2))
        * mean(&|i, j| (alike[i * n + j] - mean_alike).powi(2));
    // Lights in one place have no order.
    if spread.sqrt() < 1e-9 {
        return None;
    }
    // Means and spreads are the same in any order.
    let together = |order: &[usize]| mean(&|i, j| near(order[i], order[j]) * alike[i * n + j]);
    let mut order: Vec<usize> = (0..n).collect();
    let own = together(&order);
    let mut rng = Pcg32::new(5, 11);
    let as_good = (0..ORDERS).filter(|_| {
        for i in (1..n).rev() {
            let j = ((rng.next_f32() * (i + 1) as f32) as usize).min(i);
            order.swap(i, j);
        }
        together(&order) >= own
    });
    Some((as_good.count() + 1) as f32 / (ORDERS + 1) as f32)
}

/// How alike photographs are, pair by pair: the correlation of what texels have more or less under a light than under the
/// others, and than all texels have. `None` where that is hardly anything.
fn alike(bands: &[Stack], n: usize) -> Option<Vec<f64>> {
    let texels: usize = bands.iter().map(|b| b.width * b.height).sum();
    let every = texels.div_ceil(TEXELS).max(1);
    let mut rows: Vec<Vec<f32>> = Vec::new();
    for band in bands {
        for t in (0..band.width * band.height).step_by(every) {
            let values: Vec<f32> = band
                .samples(t % band.width, t / band.width)
                .iter()
                .map(|v| (v[0] + v[1] + v[2]) / 3.0)
                .collect();
            let usable = values.iter().filter(|v| v.is_finite());
            let (sum, count) = usable.fold((0.0, 0usize), |(s, c), v| (s + v, c + 1));
            if 2 * count > n && sum > 0.0 {
                let mean = sum / count as f32;
                // What is missing is taken for the mean.
                let part = |v: &f32| if v.is_finite() { (v / mean).clamp(0.0, BRIGHT) - 1.0 } else { 0.0 };
                rows.push(values.iter().map(part).collect());
            }
        }
    }
    let count = rows.len() as f32;
    let mean: Vec<f32> = (0..n).map(|i| rows.iter().map(|r| r[i]).sum::<f32>() / count).collect();
    let mut sums = vec![0.0f64; n * n];
    for row in &rows {
        let off: Vec<f64> = row.iter().zip(&mean).map(|(v, mean)| f64::from(v - mean)).collect();
        for (a, sums) in off.iter().zip(sums.chunks_exact_mut(n)) {
            sums.iter_mut().zip(&off).for_each(|(sum, b)| *sum += a * b);
        }
    }
    let change: f64 = (0..n).map(|i| sums[i * n + i]).sum::<f64>() / (n * rows.len()).max(1) as f64;
    if change.sqrt() < NOISE {
        return None;
    }
    let mut alike = vec![0.0; n * n];
    for j in 1..n {
        for i in 0..j {
            let size = (sums[i * n + i] * sums[j * n + j]).sqrt();
            alike[i * n + j] = if size > 0.0 { sums[i * n + j] / size } else { 0.0 };
        }
    }
    let pairs = (n * (n - 1) / 2) as f64;
    let likeness = (alike.iter().map(|a| a * a).sum::<f64>() / pairs).sqrt();
    (likeness >= LIKENESS).then_some(alike)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stack::Eye;

    /// Texels of a sphere under lights on a dome, narrow highlights alone or shading alone.
    fn sphere(lights: usize, shiny: bool, noise: f32) -> Stack {
        let light = |i: usize| {
            let (z, turn) = (1.0 - 0.75 * (i as f32 + 0.5) / lights as f32, 2.4 * i as f32);
            (Vec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt()).with_z(z)
        };
        let toward: Vec<Vec3> = (0..lights).map(light).collect();
        let mut rng = Pcg32::new(3, 4);
        let mut values = Vec::new();
        for t in 0..40 * 40 {
            let (x, y) = ((t % 40) as f32 / 20.0 - 0.975, (t / 40) as f32 / 20.0 - 0.975);
            let normal = Vec3::new(x, y, 0.0).clamp_length_max(0.9);
            let normal = normal.with_z((1.0 - normal.length_squared()).sqrt());
            for l in &toward {
                let half = (*l + Vec3::Z).normalize().dot(normal);
                let value =
                    if shiny { half.max(0.0).powi(200) + 0.01 } else { l.dot(normal).max(0.0) + 0.01 };
                values.push([value * (1.0 + noise * rng.normal()); 3]);
            }
        }
        let eyes = vec![Eye::ABOVE; lights];
        Stack { width: 40, height: 40, first_row: 0, rows: 40, lights: Lights::Distant(toward), eyes, values }
    }

    #[test]
    fn a_list_in_another_order_is_doubted() {
        for (lights, shiny) in [(8, false), (12, false), (50, false), (50, true)] {
            let right = sphere(lights, shiny, 0.02);
            let own = orders_as_good(std::slice::from_ref(&right)).unwrap();
            assert!(own < 0.02, "{lights} {shiny}: {own}");
            let mut wrong = right.clone();
            let Lights::Distant(toward) = &mut wrong.lights else { unreachable!() };
            let mut rng = Pcg32::new(2, 6);
            for i in (1..lights).rev() {
                toward.swap(i, (rng.next_f32() * (i + 1) as f32) as usize % (i + 1));
            }
            let part = orders_as_good(&[wrong]).unwrap();
            println!("{lights} lights, shiny {shiny}: {own}, in another order {part}");
            assert!(part > BY_CHANCE, "{lights} {shiny}: {part}");
        }
    }

    #[test]
    fn what_does_not_tell_is_not_doubted() {
        let few = sphere(6, false, 0.0);
        assert_eq!(orders_as_good(&[few]), None);
        // Highlights too narrow for twelve lights.
        assert_eq!(orders_as_good(&[sphere(12, true, 0.02)]), None);
        // Flat, with noise, under lamps of any brightness.
        for (lights, noise) in [(12, 0.01), (12, 0.1), (24, 0.06), (24, 0.1), (7, 0.2)] {
            let mut flat = sphere(lights, false, 0.0);
            let mut rng = Pcg32::new(8, 1);
            for (k, v) in flat.values.iter_mut().enumerate() {
                *v = [(1.0 + (k % lights) as f32) * (1.0 + noise * rng.normal()); 3];
            }
            assert_eq!(orders_as_good(&[flat]), None, "{lights} lights, noise {noise}");
        }
        let mut one = sphere(12, false, 0.0);
        one.lights = Lights::Distant(vec![Vec3::Z; 12]);
        assert_eq!(orders_as_good(&[one]), None);
        assert_eq!(orders_as_good(&[]), None);
        let mut dark = sphere(12, false, 0.0);
        dark.values.fill([f32::NAN; 3]);
        assert_eq!(orders_as_good(&[dark]), None);
    }
}
