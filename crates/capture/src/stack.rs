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

/// Where a camera stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Unit, from the centre of the picture toward the camera.
    pub toward: Vec3,
    /// How far away, in widths of the whole picture; infinite: all texels see it in the same direction.
    pub distance: f32,
}

impl Eye {
    /// Straight above and far away.
    pub const ABOVE: Self = Self { toward: Vec3::Z, distance: f32::INFINITY };

    /// Unit vector toward the camera from a point of the sample's plane, in widths of the picture from its centre, +y up.
    pub fn from(&self, at: Vec2) -> Vec3 {
        match self.distance.is_finite() {
            true => (self.toward * self.distance - at.extend(0.0)).normalize(),
            false => self.toward,
        }
    }
}

impl From<Vec3> for Eye {
    /// Far away, in this direction (a unit vector).
    fn from(toward: Vec3) -> Self {
        Self { toward, ..Self::ABOVE }
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
    /// Where the camera stands, one a picture.
    pub eyes: Vec<Eye>,
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
            eyes: vec![Eye { toward: folder.options.view, distance: folder.camera_distance }; lights.len()],
            lights,
            values: band.values,
        }
    }

    /// The same band under some of its lights only, in the order in which they are named.
    pub fn select(&self, lights: &[usize]) -> Self {
        let chosen = |v: &[Vec3]| lights.iter().map(|l| v[*l]).collect::<Vec<_>>();
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
                let toward = positions[light] - self.place(x, y).extend(0.0);
                (toward.normalize(), positions[light].length_squared() / toward.length_squared())
            }
        }
    }

    /// Unit vector from the centre of texel (x, y) of the band to the camera of a picture.
    pub fn eye(&self, picture: usize, x: usize, y: usize) -> Vec3 {
        self.eyes[picture].from(self.place(x, y))
    }

    /// Whether all texels are lit and seen from the same directions.
    pub fn is_distant(&self) -> bool {
        matches!(self.lights, Lights::Distant(_)) && self.eyes.iter().all(|e| e.distance.is_infinite())
    }

    /// The centre of texel (x, y) of the band in widths of the whole picture from its centre, +y up.
    fn place(&self, x: usize, y: usize) -> Vec2 {
        let width = self.width as f32;
        let at = Vec2::new(x as f32 + 0.5, (self.first_row + y) as f32 + 0.5);
        let off = (at - 0.5 * Vec2::new(width, self.rows as f32)) / width;
        Vec2::new(off.x, -off.y)
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
            eyes: vec![Eye { distance: 2.0, ..Eye::ABOVE }],
            values: Vec::new(),
        };
        let (toward, irradiance) = stack.light(0, 99, 0);
        assert!((toward - Vec3::new(0.005, 0.0, 1.0).normalize()).length() < 1e-6, "{toward}");
        assert!((irradiance - 1.25).abs() < 1e-3, "{irradiance}");
        let (toward, irradiance) = stack.light(0, 0, 0);
        assert!((toward.x / toward.z - 0.995).abs() < 1e-6);
        assert!((irradiance - 1.25 / (1.0 + 0.995f32.powi(2))).abs() < 1e-5);
        // The camera is two widths away: half a width aside makes a slope of a quarter.
        let eye = stack.eye(0, 99, 0);
        assert!((eye.x / eye.z + 0.495 / 2.0).abs() < 1e-6 && eye.y.abs() < 1e-6, "{eye}");
        assert!(!stack.is_distant());
    }
}
