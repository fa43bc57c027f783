//! What a camera keeps when its picture gets another size.

use super::{Camera, Projection};

/// The extent of a picture that a field of view spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FovAxis {
    /// Its width.
    #[default]
    X,
    /// Its height.
    Y,
    /// From corner to corner.
    Diagonal,
    /// The smaller of width and height.
    Smaller,
    /// The larger.
    Larger,
    /// The smaller; and the camera stands as near as a picture of this shape allows ([`super::Scene::framing_camera`]).
    Framing,
}

impl FovAxis {
    /// Half the width of the picture over half this extent, for a picture `aspect` times as wide as high.
    pub fn width_share(self, aspect: f64) -> f64 {
        match self {
            Self::X => 1.0,
            Self::Y => aspect,
            Self::Diagonal => (1.0 + aspect.recip().powi(2)).sqrt().recip(),
            Self::Smaller | Self::Framing => aspect.max(1.0),
            Self::Larger => aspect.min(1.0),
        }
    }
}

impl Camera {
    /// Gives the picture another size. The field of view along its axis stays; a crop is scaled with the picture.
    pub fn resize(&mut self, width: u32, height: u32) {
        let film = &mut self.film;
        let aspects = [(film.width, film.height), (width, height)].map(|(w, h)| f64::from(w) / f64::from(h));
        if let Projection::Perspective { fov_x, fov_axis, .. } = &mut self.projection {
            let [from, to] = aspects.map(|aspect| fov_axis.width_share(aspect));
            // As it was where nothing changes: a rounded field of view would be another picture.
            if from != to {
                *fov_x = 2.0 * ((0.5 * f64::from(*fov_x)).tan() * to / from).atan() as f32;
            }
        }
        if let Some(crop) = &mut film.crop {
            let scale =
                |v: u32, from: u32, to: u32| (u64::from(v) * u64::from(to) / u64::from(from.max(1))) as u32;
            *crop = [
                scale(crop[0], film.width, width),
                scale(crop[1], film.height, height),
                scale(crop[2], film.width, width).max(1),
                scale(crop[3], film.height, height).max(1),
            ];
        }
        film.width = width;
        film.height = height;
    }
}
