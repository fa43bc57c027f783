//! How light or dark each place is to be painted: from the picture of the real-time renderer, and so by any reflectance model
//! and light. Highlights become paper that is left blank, firelight steers the wash.

use crate::depth::DepthMap;
use crate::projection::Projection;
use glam::{DVec2, Vec2, Vec3};
use yugen_optics::special::smoothstep;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Aov;

/// Part of what is seen that is no brighter than white: the brightest twelfth is left as paper.
const WHITE_SHARE: f32 = 0.92;
/// Part of what is seen that is darker than all the rest, and how far towards black a painter takes it: a picture by a bright
/// sky has all shades of ink, too.
const DARK_SHARE: f32 = 0.04;
/// See [`DARK_SHARE`].
const STRETCH: f32 = 0.8;
/// Exponent from light to grey, as displays have it: the eye judges greys so.
const GAMMA: f32 = 2.2;

/// Facing and slope at the centre of each pixel, and grey on a coarser grid: prints of a brush are wide.
#[derive(Clone, Debug)]
pub struct Tones {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Cosine between the normal and the direction to the eye, 0 to 1.
    pub facing: Vec<f32>,
    /// The normal as the picture has it: x to the right, y down, as long as the sine of the angle to the eye.
    pub slope: Vec<Vec2>,
    /// Texture coordinates; none where the picture has none.
    pub uv: Vec<Vec2>,
    light: Light,
}

/// What light makes of the shapes.
#[derive(Clone, Debug)]
struct Light {
    size: [usize; 2],
    /// 0 black to 1 white; 1 where nothing is.
    grey: Vec<f32>,
    /// Counted from one; 0 where nothing is.
    shape: Vec<u32>,
}

impl Tones {
    /// From the shading normals of the real-time renderer and its picture with the id of shapes, which may be smaller;
    /// `lightness` 1 as it is, more is lighter. `None` where the images have not these.
    pub fn new(
        normals: &Image,
        picture: &Image,
        map: &DepthMap,
        projection: &Projection,
        space: ColourSpace,
        lightness: f32,
    ) -> Option<Self> {
        let channels = |image: &Image, names: &[&str]| -> Option<Vec<usize>> {
            names.iter().map(|n| image.channel(n)).collect()
        };
        let normal = channels(normals, Aov::ShadingNormal.channels())?;
        let pick = |pixel: &[f32], at: &[usize]| Vec3::new(pixel[at[0]], pixel[at[1]], pixel[at[2]]);
        let axes = projection.axes();
        let (mut facing, mut slope) = (Vec::new(), Vec::new());
        for (i, pixel) in normals.data.chunks_exact(normals.channels.len()).enumerate() {
            if map.shape[i] == 0 {
                facing.push(1.0);
                slope.push(Vec2::ZERO);
                continue;
            }
            let at = DVec2::new((i % normals.width) as f64 + 0.5, (i / normals.width) as f64 + 0.5);
            let n = pick(pixel, &normal).as_dvec3();
            let eye = projection.to_eye_at(at);
            // Sheets are seen from both sides.
            let n = if n.dot(eye) < 0.0 { -n } else { n };
            facing.push(n.dot(eye).clamp(0.0, 1.0) as f32);
            slope.push(Vec2::new(n.dot(axes[0]) as f32, n.dot(axes[1]) as f32));
        }
        let [rgb, id] = [&["R", "G", "B"][..], Aov::Id.channels()].map(|names| channels(picture, names));
        let light = Light::new(picture, &rgb?, id?[0], space, lightness);
        let uv = channels(normals, Aov::Uv.channels()).map_or(Vec::new(), |at| {
            let pixels = normals.data.chunks_exact(normals.channels.len());
            pixels.map(|pixel| Vec2::new(pixel[at[0]], pixel[at[1]])).collect()
        });
        Some(Self { size: map.size, facing, slope, uv, light })
    }

    /// Index of the pixel at a place in the picture.
    pub fn index(&self, p: Vec2) -> Option<usize> {
        let [w, h] = self.size.map(|n| n as f32);
        (p.x >= 0.0 && p.y >= 0.0 && p.x < w && p.y < h)
            .then(|| p.y as usize * self.size[0] as usize + p.x as usize)
    }

    /// Mean grey of a shape within a radius; `None` where light saw nothing of it.
    pub fn grey(&self, p: Vec2, radius: f32, shape: u32) -> Option<f32> {
        let [w, h] = self.light.size;
        let scale = Vec2::new(w as f32 / self.size[0] as f32, h as f32 / self.size[1] as f32);
        let (mut sum, mut count) = (0.0, 0.0f32);
        for offset in spiral(radius) {
            let q = (p + offset) * scale;
            if q.x < 0.0 || q.y < 0.0 || q.x as usize >= w || q.y as usize >= h {
                continue;
            }
            let i = q.y as usize * w + q.x as usize;
            if self.light.shape[i] == shape {
                sum += self.light.grey[i];
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// How much the form bends within a radius: 0 flat, 1 round.
    pub fn bend(&self, p: Vec2, radius: f32) -> f32 {
        let Some(here) = self.index(p).map(|i| self.slope[i]) else { return 0.0 };
        let there = spiral(radius).filter_map(|o| self.index(p + o)).map(|i| self.slope[i].distance(here));
        (there.sum::<f32>() / TAPS as f32 / 0.12).min(1.0)
    }
}

/// The part of what lies within a radius that is of a shape.
pub fn share(map: &DepthMap, p: Vec2, radius: f32, shape: u32) -> f32 {
    spiral(radius).filter(|o| map.at(p + *o).1 == shape).count() as f32 / TAPS as f32
}

const TAPS: u32 = 16;

/// Evenly over a disc: Vogel 1979, by the golden angle.
fn spiral(radius: f32) -> impl Iterator<Item = Vec2> {
    (0..TAPS).map(move |k| {
        Vec2::from_angle(2.399_963 * k as f32) * radius * ((k as f32 + 0.5) / TAPS as f32).sqrt()
    })
}

impl Light {
    fn new(image: &Image, rgb: &[usize], id: usize, space: ColourSpace, lightness: f32) -> Self {
        let weights = space.luminance_weights();
        let pixels = image.data.chunks_exact(image.channels.len());
        let light: Vec<f32> = pixels
            .clone()
            .map(|p| weights.dot(Vec3::new(p[rgb[0]], p[rgb[1]], p[rgb[2]])).max(0.0))
            .collect();
        let shape: Vec<u32> = pixels.map(|p| p[id].max(0.0) as u32).collect();
        let light = smooth([image.width, image.height], &light, &shape);
        let mut seen: Vec<f32> = light.iter().zip(&shape).filter(|(_, s)| **s > 0).map(|(l, _)| *l).collect();
        seen.sort_by(f32::total_cmp);
        let white = seen.get((seen.len() as f32 * WHITE_SHARE) as usize).copied().unwrap_or(1.0);
        let white = if white > 0.0 { white / lightness.max(1e-3) } else { 1.0 };
        let to_grey = |l: f32| (l / white).clamp(0.0, 1.0).powf(1.0 / GAMMA);
        let dark = seen.get((seen.len() as f32 * DARK_SHARE) as usize).copied().unwrap_or(0.0);
        let dark = STRETCH * to_grey(dark).min(0.9);
        let grey = light.iter().zip(&shape).map(|(l, s)| match s {
            0 => 1.0,
            _ => ((to_grey(*l) - dark) / (1.0 - dark)).clamp(0.0, 1.0),
        });
        Self { size: [image.width, image.height], grey: grey.collect(), shape }
    }
}

/// Means over the nearest pixels of the same shape: what is left of noise.
fn smooth([w, h]: [usize; 2], values: &[f32], shape: &[u32]) -> Vec<f32> {
    let mean = |i: usize| {
        let (x, y) = (i % w, i / w);
        let (mut sum, mut count) = (0.0, 0.0);
        for y in y.saturating_sub(1)..(y + 2).min(h) {
            for k in y * w + x.saturating_sub(1)..y * w + (x + 2).min(w) {
                if shape[k] == shape[i] {
                    sum += values[k];
                    count += 1.0;
                }
            }
        }
        sum / count
    };
    (0..values.len()).map(mean).collect()
}

/// The five shades of ink, from paper to the darkest.
pub const SHADES: [f32; 6] = [0.0, 0.12, 0.3, 0.5, 0.72, 0.95];

/// Darkness (0 to 1) in soft steps between the five shades.
pub fn in_shades(darkness: f32) -> f32 {
    SHADES
        .windows(2)
        .map(|s| {
            let middle = 0.5 * (s[0] + s[1]);
            // Half of each step is flat.
            let half = 0.25 * (s[1] - s[0]);
            (s[1] - s[0]) * smoothstep(middle - half, middle + half, darkness)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_are_steps_that_rise() {
        for (i, s) in SHADES.iter().enumerate().skip(1) {
            assert!((in_shades(*s) - s).abs() < 1e-5, "shade {i} is one");
        }
        assert_eq!(in_shades(0.0), 0.0);
        assert!((in_shades(1.0) - 0.95).abs() < 1e-5);
        let all: Vec<f32> = (0..=100).map(|i| in_shades(i as f32 / 100.0)).collect();
        assert!(all.windows(2).all(|w| w[0] <= w[1]));
    }
}
