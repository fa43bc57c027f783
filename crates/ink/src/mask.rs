//! Masks: grey pictures that say how much otherwise something is painted, place by place, black as before and white wholly.
//!
//! A mask lies on the picture, stretched over it, or on the surface of what it is for, by the texture coordinates of its mesh, and
//! moves with that. Between black and white a control goes evenly from its value without the mask to that of the mask.

pub mod brush;
pub mod map;

use crate::InkError;
use crate::brush::lightness;
use crate::control::Controls;
use crate::steering::{Changes, Names, fits};
use glam::Vec2;
use std::sync::Arc;
use yugen_optics::Image;
use yugen_scene::prepared::DrawRow;

/// Most pixels of a side of its picture: as a texture of 4k, 64 MiB of numbers.
pub const MOST: usize = 4096;

/// The picture of a mask.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// What presets call it.
    pub name: String,
    size: [usize; 2],
    /// Row after row, 0 to 1.
    values: Vec<f32>,
}

impl Grey {
    /// How light a picture looks, times its alpha where it has one (straight, as PNG has it). Linear, with channels R, G and B, or Y.
    pub fn new(name: &str, picture: &Image) -> Result<Self, InkError> {
        let wrong = |what: String| InkError::Preset(format!("{name}: {what}"));
        let (w, h) = (picture.width, picture.height);
        if w == 0 || h == 0 || w.max(h) > MOST {
            return Err(wrong(format!(
                "{w} x {h} pixels are no mask: expected 1 to {MOST} a side; make it smaller, it is read smoothly"
            )));
        }
        let light = lightness(picture).ok_or_else(|| {
            wrong("a mask has no colours: expected a grey picture or one in R, G and B".into())
        })?;
        let alpha = picture.channel("A");
        let part = |v: f32| if v.is_finite() { v.clamp(0.0, 1.0) } else { 0.0 };
        let value = |(light, p): (f32, &[f32])| {
            // As sixteen bits have it, so that white is white to the bit.
            (light * alpha.map_or(1.0, |a| part(p[a])) * 65535.0).round() / 65535.0
        };
        let pixels = picture.data.chunks_exact(picture.channels.len());
        let values = light.into_iter().zip(pixels).map(value).collect();
        Ok(Self { name: name.into(), size: [w, h], values })
    }

    /// At a place, in parts of the picture across and down; `repeats`: beyond its edges it begins again, else they go on.
    pub fn at(&self, place: Vec2, repeats: bool) -> f32 {
        let [w, h] = self.size.map(|n| n as i64);
        // Far beyond what a float tells apart there is nothing to be read.
        let at = |v: f32, n: i64| if v.is_finite() { (v * n as f32 - 0.5).clamp(-1e9, 1e9) } else { 0.0 };
        let (x, y) = (at(place.x, w), at(place.y, h));
        let index = |v: i64, n: i64| if repeats { v.rem_euclid(n) } else { v.clamp(0, n - 1) };
        let get = |x: i64, y: i64| self.values[(index(y, h) * w + index(x, w)) as usize];
        let (i, j, u, v) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
        // Between equals exactly what both are.
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let row = |j: i64| mix(get(i, j), get(i + 1, j), u);
        mix(row(j), row(j + 1), v)
    }
}

/// On what a mask lies.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Ground {
    /// The picture, stretched over all of it.
    #[default]
    Picture,
    /// The surface of objects of this name, a last `*` standing for anything.
    Object(String),
    /// The surface of what is of materials of this name.
    Material(String),
}

impl Ground {
    /// Whether a mask on it lies on a draw of a scene whose things are called so: on none without texture coordinates, if it lies on a
    /// surface.
    pub fn has(&self, draw: &DrawRow, names: &Names) -> bool {
        match self {
            Self::Picture => true,
            _ if draw.flags & DrawRow::HAS_UVS == 0 => false,
            Self::Object(name) => fits(name, names.object(draw)),
            Self::Material(name) => names.materials(draw).iter().any(|m| fits(name, m)),
        }
    }

    /// As presets have it.
    pub fn parse(word: &str) -> Result<Self, InkError> {
        match word.split_once('.') {
            None if word == "picture" => Ok(Self::Picture),
            Some(("object", name)) if !name.is_empty() => Ok(Self::Object(name.into())),
            Some(("material", name)) if !name.is_empty() => Ok(Self::Material(name.into())),
            _ => Err(InkError::Preset(format!(
                "a mask cannot lie on '{word}': expected picture, object.NAME or material.NAME"
            ))),
        }
    }
}

impl std::fmt::Display for Ground {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Picture => write!(f, "picture"),
            Self::Object(name) => write!(f, "object.{name}"),
            Self::Material(name) => write!(f, "material.{name}"),
        }
    }
}

/// A mask, and what is otherwise where it is white.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Of its table.
    pub name: String,
    /// Where how much.
    pub picture: Arc<Grey>,
    /// On what.
    pub on: Ground,
    /// What.
    pub changes: Changes,
}

/// A place that is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// In parts of the picture, across and down.
    pub part: Vec2,
    /// Texture coordinates.
    pub uv: Vec2,
}

impl Mask {
    /// How much it holds at a place of what it is for, 0 to 1.
    pub fn at(&self, place: &Place) -> f32 {
        match self.on {
            Ground::Picture => self.picture.at(place.part, false),
            Ground::Object(_) | Ground::Material(_) => self.picture.at(place.uv, true),
        }
    }

    /// Changes controls by so much of it.
    pub fn apply(&self, controls: &mut Controls, much: f32) {
        for (name, value) in self.changes.iter() {
            let Some(before) = controls.get(name) else { continue };
            // Exactly one or the other at both ends. Between two values of its range a control is within it.
            let _ = controls.set(name, before * (1.0 - much) + value * much);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::colour::srgb_to_linear;

    /// Of one row.
    fn grey(values: &[f32]) -> Grey {
        let mut picture = Image::rgb(values.len(), 1);
        picture.data.chunks_exact_mut(3).zip(values).for_each(|(p, v)| p.fill(srgb_to_linear(*v)));
        Grey::new("m.png", &picture).unwrap()
    }

    #[test]
    fn a_picture_is_read_smoothly_and_goes_on_or_begins_again() {
        let grey = grey(&[0.0, 0.0, 0.5, 1.0]);
        let at = |x: f32, repeats| grey.at(Vec2::new(x, 0.3), repeats);
        for (x, repeats, value) in [
            (0.125, false, 0.0),
            (0.625, false, 0.5),
            (0.75, false, 0.75),
            (0.875, true, 1.0),
            (1.0, false, 1.0),
            (1.0, true, 0.5),
            (-0.375, true, 0.5),
            (-3.0, false, 0.0),
            (7.0, false, 1.0),
        ] {
            assert!((at(x, repeats) - value).abs() < 1e-5, "{x} {repeats}: {}", at(x, repeats));
        }
        for x in [f32::NAN, f32::INFINITY, 1e30, -1e30] {
            assert!([true, false].iter().all(|r| (0.0..=1.0).contains(&at(x, *r))), "{x}");
        }
    }

    #[test]
    fn white_is_the_mask_black_is_not_and_transparent_is_black() {
        let mut changes = Changes::default();
        changes.of_object("wash", 0.3).unwrap();
        let mask = Mask {
            name: "m".into(),
            picture: Arc::new(grey(&[0.0, 0.5, 1.0])),
            on: Ground::Picture,
            changes,
        };
        let wash = |much: f32| {
            let mut controls = Controls { wash: 0.7, ..Controls::default() };
            mask.apply(&mut controls, much);
            controls.wash
        };
        assert_eq!([wash(0.0), wash(1.0)], [0.7, 0.3]);
        assert!((wash(0.5) - 0.5).abs() < 1e-6);
        let mut picture = Image::new(2, 1, &["R", "G", "B", "A"]);
        picture.data = vec![1.0, 1.0, 1.0, 0.25, 1.0, f32::NAN, 1.0, 1.0];
        let grey = Grey::new("m.png", &picture).unwrap();
        assert!((grey.values[0] - 0.25).abs() < 1e-5 && grey.values[1] < 1.0, "{:?}", grey.values);
    }

    #[test]
    fn what_is_no_mask_is_said() {
        let said = |w, h| Grey::new("m.png", &Image::rgb(w, h)).unwrap_err().to_string();
        for text in [said(0, 0), said(MOST + 1, 1)] {
            assert!(text.contains("m.png: ") && text.contains("are no mask: expected 1 to 4096"), "{text}");
        }
        let depth = Image::new(2, 2, &["Z"]);
        assert!(Grey::new("m.exr", &depth).unwrap_err().to_string().contains("no colours"));
        for word in ["pictur", "object.", "object", "stroke.a"] {
            assert!(Ground::parse(word).unwrap_err().to_string().contains("expected picture, object.NAME"));
        }
        for word in ["picture", "object.a.b", "material.wet ro*"] {
            assert_eq!(Ground::parse(word).unwrap().to_string(), word);
        }
    }
}
