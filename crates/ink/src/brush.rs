//! A brush that is not made by noise but is somebody's own: what its bristles left along a real stroke.
//!
//! A picture of a straight stroke, from left to right, as high as the stroke is wide, says which bristles carry ink (how much of
//! it comes to each place across) and where each of them touches or jumps (the order in which places along it run dry). The first
//! scales the prints of the brush, the second is the trail by which flying white is decided ([`crate::resolve`]).
//! [`photograph`] makes such a picture of a photograph.

pub mod photograph;

use crate::InkError;
use crate::footprint::{TRAIL, evened};
use yugen_optics::Image;
use yugen_optics::colour::linear_to_srgb;

/// Places across for which it is known how much ink they get.
pub const ACROSS: usize = 64;
/// Least pixels of its picture: across, a bristle has two; along, a few prints.
const LEAST: [usize; 2] = [64, 16];
/// Part of the strip's length over which a place is compared with others: longer, the dry end would be all white at any
/// dryness; shorter, hardly anything would be told from noise.
const WINDOW: f32 = 0.125;
/// How much the whole trail of a bristle counts beside a place of it: where all is wet the photograph does not say which bristle
/// will run dry first, and elsewhere it does.
const BRISTLE: f32 = 0.35;

/// What bristles left.
#[derive(Clone, Debug, PartialEq)]
pub struct Bristles {
    /// What presets call it.
    pub name: String,
    /// As [`crate::footprint::bristle_trail`]: evenly from 0 (touches first) to 1; there and back, so that its ends meet.
    pub trail: Vec<f32>,
    /// Half widths of the brush after which it repeats.
    pub length: f32,
    /// Part of the ink that comes to places across, from one edge to the other; the most is 1.
    pub across: Vec<f32>,
}

/// How light each pixel of a linear picture looks, 0 to 1, whatever its hue; what is no number is black. `None` where it has neither R,
/// G and B nor Y.
pub(crate) fn lightness(picture: &Image) -> Option<Vec<f32>> {
    let colours = picture.select(&["R", "G", "B"]).or_else(|| picture.select(&["Y"]))?;
    let n = colours.channels.len();
    let look = |p: &[f32]| {
        let light = p.iter().sum::<f32>() / n as f32;
        linear_to_srgb(if light.is_finite() { light.clamp(0.0, 1.0) } else { 0.0 })
    };
    Some(colours.data.chunks_exact(n).map(look).collect())
}

/// How much ink is at each pixel, 0 to 1, by how dark it looks: from the lightest to the darkest hundredth.
fn coverage(strip: &Image) -> Option<Vec<f32>> {
    let light = lightness(strip)?;
    let mut ranked = light.clone();
    let mut rank = |part: f32| {
        let at = ((ranked.len().checked_sub(1)?) as f32 * part) as usize;
        Some(*ranked.select_nth_unstable_by(at, f32::total_cmp).1)
    };
    let (dark, paper) = (rank(0.01)?, rank(0.99)?);
    (paper - dark > 0.1)
        .then(|| light.iter().map(|v| ((paper - v) / (paper - dark)).clamp(0.0, 1.0)).collect())
}

impl Bristles {
    /// From the picture of a straight stroke; `name` is what presets and errors call it.
    pub fn new(name: &str, strip: &Image) -> Result<Self, InkError> {
        let wrong = |what: String| InkError::Preset(format!("{name}: {what}"));
        let (w, h) = (strip.width, strip.height);
        if w < LEAST[0] || h < LEAST[1] || w < h {
            return Err(wrong(format!(
                "{w} x {h} pixels are no picture of a straight stroke: expected at least {} x {} and longer than high, as \
                 `yugen brush` makes it of a photograph",
                LEAST[0], LEAST[1]
            )));
        }
        let ink = coverage(strip)
            .ok_or_else(|| wrong("there is no stroke in it: all of it is equally light".into()))?;
        let mean = |x: [f32; 2], y: [f32; 2]| -> f32 {
            let range = |[a, b]: [f32; 2], n: usize| {
                let from = (a * n as f32) as usize;
                from.min(n - 1)..((b * n as f32).ceil() as usize).clamp(from + 1, n)
            };
            let (mut sum, mut count) = (0.0, 0.0);
            for y in range(y, h) {
                for x in range(x, w) {
                    sum += ink[y * w + x];
                    count += 1.0;
                }
            }
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let part = |i: usize, n: usize| [i as f32 / n as f32, (i + 1) as f32 / n as f32];
        // Nine tenths of the length have less: what a bristle leaves where it touches.
        let across: Vec<f32> = (0..ACROSS)
            .map(|y| {
                let mut along: Vec<f32> = (0..w).map(|x| mean(part(x, w), part(y, ACROSS))).collect();
                *along.select_nth_unstable_by(w * 9 / 10, f32::total_cmp).1
            })
            .collect();
        let most = across.iter().copied().fold(1e-6, f32::max);
        let [whole, lanes] = TRAIL;
        let half = whole / 2;
        let bristle: Vec<f32> = (0..lanes).map(|y| mean([0.0, 1.0], part(y, lanes))).collect();
        let score: Vec<Vec<f32>> = (0..half)
            .map(|x| (0..lanes).map(|y| mean(part(x, half), part(y, lanes)) + BRISTLE * bristle[y]).collect())
            .collect();
        let reach = ((0.5 * WINDOW * half as f32) as usize).max(1);
        let mut trail = vec![0.0; whole * lanes];
        for x in 0..half {
            let mut around: Vec<f32> = score[x.saturating_sub(reach)..(x + reach + 1).min(half)].concat();
            around.sort_by(f32::total_cmp);
            for y in 0..lanes {
                let less = around.partition_point(|v| *v < score[x][y]);
                let xi = 1.0 - less as f32 / around.len() as f32;
                for x in [x, whole - 1 - x] {
                    trail[y * whole + x] = xi;
                }
            }
        }
        Ok(Self {
            name: name.into(),
            trail: evened(&trail),
            length: 2.0 * 2.0 * w as f32 / h as f32,
            across: across.into_iter().map(|v| v / most).collect(),
        })
    }

    /// Part of the ink at a place across, −1 to 1.
    pub fn at(&self, across: f32) -> f32 {
        let t = ((across + 1.0) * 0.5 * ACROSS as f32 - 0.5).clamp(0.0, ACROSS as f32 - 1.001);
        let (i, u) = (t as usize, t.fract());
        self.across[i] * (1.0 - u) + self.across[i + 1] * u
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::colour::srgb_to_linear;
    use yugen_optics::random::Pcg32;

    /// A strip whose third quarter across is dry, more so towards its end.
    fn strip(w: usize, h: usize) -> Image {
        let mut random = Pcg32::new(1, 2);
        let mut image = Image::rgb(w, h);
        for (i, pixel) in image.data.chunks_exact_mut(3).enumerate() {
            let (u, v) = ((i % w) as f32 / w as f32, (i / w) as f32 / h as f32);
            let dry = if (0.5..0.75).contains(&v) { 0.3 + 0.7 * u } else { 0.1 * u };
            let ink = if random.next_f32() < dry { 0.05 } else { 0.9 };
            pixel.fill(srgb_to_linear(1.0 - ink));
        }
        image
    }

    #[test]
    fn bristles_run_dry_where_they_did() {
        let bristles = Bristles::new("own.png", &strip(600, 64)).unwrap();
        let [w, h] = TRAIL;
        assert!((bristles.length - 37.5).abs() < 1e-3);
        // Even, so that a threshold is a share; and late to touch where it was dry, all along.
        let share = bristles.trail.iter().filter(|v| **v < 0.3).count() as f32 / (w * h) as f32;
        assert!((share - 0.3).abs() < 1e-3, "{share}");
        let mean = |rows: std::ops::Range<usize>, columns: std::ops::Range<usize>| {
            let all: Vec<f32> = rows
                .flat_map(|y| columns.clone().map(move |x| y * w + x))
                .map(|i| bristles.trail[i])
                .collect();
            all.iter().sum::<f32>() / all.len() as f32
        };
        for columns in [0..60, 100..160, 190..250, 300..360] {
            let (dry, wet) = (mean(h / 2 + 4..3 * h / 4 - 4, columns.clone()), mean(4..h / 2 - 4, columns));
            assert!(dry > wet + 0.2, "{dry} {wet}");
        }
        let jump = (0..h).map(|y| (bristles.trail[y * w] - bristles.trail[y * w + w - 1]).abs()).sum::<f32>();
        assert!(jump < 1e-2 * h as f32, "its ends meet: {jump}");
        assert!(bristles.across.iter().all(|v| (0.0..=1.0).contains(v)) && bristles.at(-0.5) > 0.8);
    }

    #[test]
    fn what_is_no_stroke_is_said() {
        let said = |image: &Image| Bristles::new("own.png", image).unwrap_err().to_string();
        assert!(
            said(&Image::rgb(40, 64)).contains("own.png: 40 x 64 pixels are no picture of a straight stroke")
        );
        let mut grey = Image::rgb(200, 64);
        grey.data.fill(0.4);
        assert!(said(&grey).contains("there is no stroke in it"));
        grey.data.fill(f32::NAN);
        assert!(said(&grey).contains("there is no stroke in it"));
        // Some pixels that are no numbers are black, and no brush has such.
        let mut broken = strip(600, 64);
        broken.data.iter_mut().step_by(500).for_each(|v| *v = f32::NAN);
        let bristles = Bristles::new("own.png", &broken).unwrap();
        assert!(bristles.across.iter().chain(&bristles.trail).all(|v| v.is_finite()));
    }
}
