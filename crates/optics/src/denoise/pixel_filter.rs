//! A reconstruction filter and pixels that are means of their own samples.

/// What a reconstruction filter does to pixels that are means of their own samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelFilter {
    /// Weights of the pixels in a row or column that do to a smooth picture what the filter does to samples; of an odd
    /// number, the middle one for the pixel itself.
    pub taps: Vec<f32>,
    /// Part of a pixel's variance that is in the filtered picture, but not in the weighted pixels: of where in a pixel
    /// its samples lie.
    pub leftover: f32,
    /// Part of a pixel's variance that is in the filtered picture.
    pub kept: f32,
    /// What the filter shows of an edge and the weighted pixels do not, squared, as a part of the squared second
    /// differences of the pixels there: mean over where in a pixel a straight edge may lie.
    pub fine: f32,
}

impl PixelFilter {
    /// Of a separable filter with this half width, in pixels.
    pub fn new(radius: f32, filter: impl Fn(f32) -> f32) -> Self {
        const STEPS: usize = 64;
        let border = (radius - 0.5).ceil().max(0.0) as usize;
        let at = |pixel: usize, step: usize| {
            let x = pixel as f32 - border as f32 + (step as f32 + 0.5) / STEPS as f32 - 0.5;
            (x, if x.abs() > radius { 0.0 } else { filter(x) })
        };
        let all = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
            let of =
                |pixel| (0..STEPS).map(|s| at(pixel, s)).map(|(x, g)| f(x, g)).sum::<f32>() / STEPS as f32;
            (0..=2 * border).map(of).collect()
        };
        let total: f32 = all(&|_, g| g).iter().sum();
        let (mean, square) = (all(&|_, g| g / total), all(&|_, g| (g / total) * (g / total)));
        let spread: f32 = all(&|x, g| x * x * g / total).iter().sum();
        // The means of the filter over pixels spread as much as the filter and a pixel together, and a pixel is there
        // already: twice the twelfth that a pixel spreads has to go.
        let place = |i: usize| i as f32 - border as f32;
        let now: f32 = mean.iter().enumerate().map(|(i, w)| place(i) * place(i) * w).sum();
        let missing = 0.5 * (spread - 1.0 / 12.0 - now);
        let width = mean.len();
        let mut taps = vec![0.0; width + 2];
        for (i, w) in mean.iter().enumerate() {
            taps[i] += missing * w;
            taps[i + 1] += (1.0 - 2.0 * missing) * w;
            taps[i + 2] += missing * w;
        }
        let padded = |i: usize, of: &[f32]| if i == 0 || i > width { 0.0 } else { of[i - 1] };
        let own: f32 = square.iter().sum();
        let both: f32 = taps.iter().enumerate().map(|(i, w)| w * padded(i, &mean)).sum();
        let weights: f32 = taps.iter().map(|w| w * w).sum();
        let leftover = (own * own - 2.0 * both * both + weights * weights).max(0.0);
        if radius <= 0.5 {
            return Self { taps: vec![1.0], leftover: 0.0, kept: 1.0, fine: 0.0 };
        }
        // Edges at each step of the filter, dark to the left and bright to the right.
        let cells: Vec<f32> =
            (0..width * STEPS).map(|i| at(i / STEPS, i % STEPS).1 / (total * STEPS as f32)).collect();
        let (mut missed, mut bent) = (0.0, 0.0);
        for edge in 0..=cells.len() {
            let seen: f32 = cells[edge..].iter().sum();
            let lit = |pixel: isize| {
                (((pixel + 1) * STEPS as isize - edge as isize) as f32 / STEPS as f32).clamp(0.0, 1.0)
            };
            let shown: f32 = taps.iter().zip(-1..).map(|(w, pixel)| w * lit(pixel)).sum();
            let own = border as isize;
            missed += (seen - shown) * (seen - shown);
            bent += (lit(own - 1) + lit(own + 1) - 2.0 * lit(own)).powi(2);
        }
        Self { taps, leftover, kept: own * own, fine: missed / bent }
    }

    /// `plane` as the filter would show it.
    pub(super) fn apply(&self, plane: &[f32], width: usize, height: usize) -> Vec<f32> {
        let half = self.taps.len() / 2;
        let mut across = vec![0.0; plane.len()];
        for (to, from) in across.chunks_exact_mut(width).zip(plane.chunks_exact(width)) {
            for (x, to) in to.iter_mut().enumerate() {
                let at = |i: usize| from[(x + i).saturating_sub(half).min(width - 1)];
                *to = self.taps.iter().enumerate().map(|(i, w)| w * at(i)).sum();
            }
        }
        let mut out = vec![0.0; plane.len()];
        for (y, to) in out.chunks_exact_mut(width).enumerate() {
            for (i, w) in self.taps.iter().enumerate() {
                let row = (y + i).saturating_sub(half).min(height - 1) * width;
                for (to, from) in to.iter_mut().zip(&across[row..]) {
                    *to += w * from;
                }
            }
        }
        out
    }
}
