//! Masks that are painted by hand: a round, soft brush that goes over the picture.
//!
//! A stroke makes a mask as much lighter or darker as its brush is strong, however often it goes over the same place; another stroke
//! adds to it. What is painted has the steps of a picture of eight bits, so that the file holds what was seen.

use super::map::MaskMap;
use super::{Grey, MOST};
use glam::Vec2;
use std::sync::Arc;
use yugen_optics::Image;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::special::smoothstep;

/// A brush for masks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskBrush {
    /// Where nothing of it is left, in heights of the picture; half as far out it is whole.
    pub radius: f32,
    /// How much of the way to white, or to black, a stroke goes: 0 to 1.
    pub strength: f32,
    /// To black.
    pub erases: bool,
}

/// A stroke on a mask, since the brush was set down.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskStroke {
    brush: MaskBrush,
    /// The mask as it was.
    before: Arc<Grey>,
    /// How much of the brush has been at each pixel of the mask, 0 to 1.
    cover: Vec<f32>,
}

impl MaskStroke {
    /// On a mask, not begun.
    pub fn new(brush: MaskBrush, mask: &Arc<Grey>) -> Self {
        let mut before = mask.clone();
        if before.values.iter().any(|v| *v != in_steps(*v)) {
            Arc::make_mut(&mut before).values.iter_mut().for_each(|v| *v = in_steps(*v));
        }
        Self { brush, cover: vec![0.0; before.values.len()], before }
    }

    /// Goes on from one place to another, in parts of the picture across and down, and makes `mask` what it then is. `aspect`: width of
    /// the picture over its height; `map`: where the pixels of a mask on a surface are seen, of one on the picture none.
    pub fn draw(&mut self, mask: &mut Grey, way: [Vec2; 2], aspect: f32, map: Option<&MaskMap>) {
        let MaskBrush { radius, strength, erases } = self.brush;
        let scale = Vec2::new(aspect, 1.0);
        let [from, to] = way.map(|p| p * scale);
        let [w, h] = self.before.size;
        let fits = mask.size == [w, h] && map.is_none_or(|map| map.size() == [w, h]);
        if !(fits && from.is_finite() && to.is_finite() && radius > 0.0 && aspect > 0.0) {
            return;
        }
        mask.values.clone_from(&self.before.values);
        let along = to - from;
        let (low, high) = (from.min(to) - radius, from.max(to) + radius);
        let mut come = |pixel: usize, place: Vec2| {
            let p = place * scale;
            if p.cmplt(low).any() || p.cmpgt(high).any() {
                return;
            }
            let t = ((p - from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let cover = smoothstep(radius, 0.5 * radius, p.distance(from + along * t));
            self.cover[pixel] = self.cover[pixel].max(cover);
        };
        match map {
            Some(map) => map.places().iter().for_each(|(pixel, place)| come(*pixel as usize, *place)),
            None => {
                // Of all pixels those under the brush.
                let range = |low: f32, high: f32, n: usize| {
                    let at = |v: f32| (v * n as f32).clamp(0.0, n as f32) as usize;
                    at(low)..(at(high) + 1).min(n)
                };
                for y in range(low.y, high.y, h) {
                    for x in range(low.x / aspect, high.x / aspect, w) {
                        let centre = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                        come(y * w + x, centre / Vec2::new(w as f32, h as f32));
                    }
                }
            }
        }
        let end = if erases { 0.0 } else { 1.0 };
        for (value, cover) in mask.values.iter_mut().zip(&self.cover).filter(|(_, cover)| **cover > 0.0) {
            *value = in_steps(*value + (end - *value) * strength.clamp(0.0, 1.0) * cover);
        }
    }
}

/// The nearest value that a picture of eight bits has.
fn in_steps(value: f32) -> f32 {
    (value * 255.0).round() / 255.0
}

impl Grey {
    /// Black, of so many pixels, each at least one and at most [`MOST`] a side.
    pub fn black(size: [usize; 2]) -> Self {
        let size = size.map(|n| n.clamp(1, MOST));
        Self { name: String::new(), size, values: vec![0.0; size[0] * size[1]] }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Bytes of its values.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..])
    }

    /// As a picture that [`Grey::new`] makes the same of: R, G and B, linear.
    pub fn picture(&self) -> Image {
        let [w, h] = self.size;
        let mut picture = Image::rgb(w, h);
        let pixels = picture.data.chunks_exact_mut(3).zip(&self.values);
        pixels.for_each(|(pixel, value)| pixel.fill(srgb_to_linear(*value)));
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(grey: &Grey, x: f32, y: f32) -> f32 {
        grey.at(Vec2::new(x, y), false)
    }

    #[test]
    fn a_stroke_is_round_soft_and_as_strong_as_it_is() {
        let mut mask = Arc::new(Grey::black([160, 80]));
        let brush = MaskBrush { radius: 0.2, strength: 0.6, erases: false };
        let mut stroke = MaskStroke::new(brush, &mask);
        let [a, b] = [Vec2::new(0.25, 0.5), Vec2::new(0.75, 0.5)];
        let grey = Arc::make_mut(&mut mask);
        stroke.draw(grey, [a, b], 2.0, None);
        assert_eq!([at(grey, 0.5, 0.5), at(grey, 0.5, 0.56), at(grey, 0.5, 0.2)], [0.6, 0.6, 0.0]);
        // Its end is round where the picture is twice as wide as high: a fifth of the height is a tenth of the width.
        assert!(at(grey, 0.17, 0.5) > 0.0 && at(grey, 0.14, 0.5) == 0.0 && at(grey, 0.5, 0.66) > 0.0);
        // Over the same place again it is the same stroke; another adds to it.
        let once = grey.clone();
        stroke.draw(grey, [b, a], 2.0, None);
        assert_eq!(*grey, once);
        let mut second = MaskStroke::new(brush, &mask);
        second.draw(Arc::make_mut(&mut mask), [a, a], 2.0, None);
        assert!((at(&mask, 0.25, 0.5) - 0.84).abs() < 0.003 && at(&mask, 0.7, 0.5) == 0.6);
        let mut erased = MaskStroke::new(MaskBrush { strength: 1.0, erases: true, ..brush }, &mask);
        erased.draw(Arc::make_mut(&mut mask), [a, a], 2.0, None);
        assert_eq!([at(&mask, 0.25, 0.5), at(&mask, 0.7, 0.5)], [0.0, 0.6]);
        // Places that are none, or far outside, change nothing.
        let before = Grey::clone(&mask);
        for way in [[Vec2::NAN; 2], [Vec2::splat(9.0); 2]] {
            erased.draw(Arc::make_mut(&mut mask), way, 2.0, None);
        }
        assert!(*mask == before && Grey::black([0, MOST + 1]).size() == [1, MOST]);
    }

    #[test]
    fn what_was_painted_is_in_eight_bits_what_it_was() {
        let mut fine = Grey::black([300, 1]);
        fine.values.iter_mut().enumerate().for_each(|(i, v)| *v = i as f32 / 299.0);
        let brush = MaskBrush { radius: 0.5, strength: 0.37, erases: false };
        let mut mask = Arc::new(fine);
        let mut stroke = MaskStroke::new(brush, &mask);
        stroke.draw(Arc::make_mut(&mut mask), [Vec2::new(0.5, 0.5); 2], 300.0, None);
        let mut file = mask.picture();
        // As PNG keeps it.
        let byte = |v: f32| (yugen_optics::colour::linear_to_srgb(v) * 255.0).round() / 255.0;
        file.data.iter_mut().for_each(|v| *v = srgb_to_linear(byte(*v)));
        assert_eq!(Grey::new("", &file).unwrap(), *mask);
    }
}
