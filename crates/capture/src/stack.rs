//! Photographs of one flat sample, one a light, seen from one place or several.

use glam::{Vec2, Vec3};
use yugen_archive::formats::stack::{Band, Folder};

/// Where the lights of a stack stand.
#[derive(Clone, Debug, PartialEq)]
pub enum Lights {
    /// So far away that every texel sees the same direction: unit vectors toward the lights.
    Distant(Vec<Vec3>),
    /// At finite distance, equally bright in all directions: positions in units of the width of the whole
    /// picture, origin at its centre.
    Near(Vec<Vec3>),
}

impl Lights {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Distant(v) | Self::Near(v) => v.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A band of rows of linear pictures, one picture a light and camera; all rows make the whole stack.
///
/// A value is the radiance of the texel over that of a white diffuser at the centre of the picture that faces the
/// light: the reflectance factor π f cos θ for light from far away. NaN marks a sample that is not to be used
/// (saturated, in shadow, outside the mask).
#[derive(Clone, Debug, PartialEq)]
pub struct Stack {
    /// Texels across.
    pub width: usize,
    /// Rows of this band.
    pub height: usize,
    /// The band's first row in the whole picture, counted from the top.
    pub first_row: usize,
    /// Rows of the whole picture.
    pub rows: usize,
    /// One a picture.
    pub lights: Lights,
    /// Unit vectors toward the camera, one a picture.
    pub eyes: Vec<Vec3>,
    /// Linear RGB, texel after texel from the top left, within a texel light after light:
    /// `values[(y * width + x) * lights + light]`.
    pub values: Vec<[f32; 3]>,
}

impl Stack {
    /// A band of the stack in `folder`.
    pub fn from_band(folder: &Folder, band: Band) -> Self {
        let lights = match folder.options.near {
            true => Lights::Near(folder.positions()),
            false => Lights::Distant(folder.directions()),
        };
        Self {
            width: folder.width,
            height: band.height,
            first_row: band.first_row,
            rows: folder.height,
            eyes: vec![folder.options.view; lights.len()],
            lights,
            values: band.values,
        }
    }

    /// The same band under some of its lights only, in the order in which they are named.
    pub fn select(&self, lights: &[usize]) -> Self {
        let chosen = |v: &[Vec3]| lights.iter().map(|l| v[*l]).collect();
        Self {
            lights: match &self.lights {
                Lights::Distant(v) => Lights::Distant(chosen(v)),
                Lights::Near(v) => Lights::Near(chosen(v)),
            },
            eyes: lights.iter().map(|l| self.eyes[*l]).collect(),
            values: self
                .values
                .chunks_exact(self.lights.len().max(1))
                .flat_map(|texel| lights.iter().map(|l| texel[*l]))
                .collect(),
            ..*self
        }
    }

    /// The pictures of the same band from several sides as one stack. `None` where they are not of the same rows, or
    /// some lamps far and some near.
    pub fn join(parts: &[Self]) -> Option<Self> {
        let first = parts.first()?;
        let place = |s: &Self| (s.width, s.height, s.first_row, s.rows);
        let near = |s: &Self| matches!(s.lights, Lights::Near(_));
        if parts.iter().any(|p| place(p) != place(first) || near(p) != near(first)) {
            return None;
        }
        let all = parts.iter().flat_map(|p| match &p.lights {
            Lights::Distant(v) | Lights::Near(v) => v.iter().copied(),
        });
        let all = all.collect();
        let texels = first.width * first.height;
        let of = |p: &'_ Self, t: usize| t * p.lights.len()..(t + 1) * p.lights.len();
        let values =
            (0..texels).flat_map(|t| parts.iter().flat_map(move |p| p.values[of(p, t)].iter().copied()));
        Some(Self {
            lights: if near(first) { Lights::Near(all) } else { Lights::Distant(all) },
            eyes: parts.iter().flat_map(|p| p.eyes.iter().copied()).collect(),
            values: values.collect(),
            ..*first
        })
    }

    /// All samples of texel (x, y) of the band, one a light.
    pub fn samples(&self, x: usize, y: usize) -> &[[f32; 3]] {
        let n = self.lights.len();
        let at = (y * self.width + x) * n;
        &self.values[at..at + n]
    }

    /// Unit vector from the centre of texel (x, y) of the band to a light, and the light's irradiance there on a
    /// surface that faces it, relative to the centre of the picture.
    pub fn light(&self, light: usize, x: usize, y: usize) -> (Vec3, f32) {
        match &self.lights {
            Lights::Distant(toward) => (toward[light], 1.0),
            Lights::Near(positions) => {
                let width = self.width as f32;
                let centre = Vec2::new(0.5 * width, 0.5 * self.rows as f32);
                let at = (Vec2::new(x as f32 + 0.5, (self.first_row + y) as f32 + 0.5) - centre) / width;
                let toward = positions[light] - Vec3::new(at.x, -at.y, 0.0);
                (toward.normalize(), positions[light].length_squared() / toward.length_squared())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lamp one picture width above the right border: a right triangle for the centre, straight up for the border.
    #[test]
    fn near_lights_turn_and_fade_across_the_picture() {
        let stack = Stack {
            width: 100,
            height: 1,
            first_row: 49,
            rows: 99,
            lights: Lights::Near(vec![Vec3::new(0.5, 0.0, 1.0)]),
            eyes: vec![Vec3::Z],
            values: Vec::new(),
        };
        let (toward, irradiance) = stack.light(0, 99, 0);
        assert!((toward - Vec3::new(0.005, 0.0, 1.0).normalize()).length() < 1e-6, "{toward}");
        assert!((irradiance - 1.25).abs() < 1e-3, "{irradiance}");
        let (toward, irradiance) = stack.light(0, 0, 0);
        assert!((toward.x / toward.z - 0.995).abs() < 1e-6);
        assert!((irradiance - 1.25 / (1.0 + 0.995f32.powi(2))).abs() < 1e-5);
    }
}
