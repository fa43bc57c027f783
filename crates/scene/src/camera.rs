//! Where a picture is seen from, and what a camera keeps when its picture gets another size.

use crate::{Film, Scene, suggest};
use glam::{Mat4, Vec2};

/// How the camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole or, with an aperture, thin lens.
    Perspective {
        /// Across the full width, radians.
        fov_x: f32,
        /// What keeps its field of view when the picture gets another aspect.
        fov_axis: FovAxis,
        /// 0 for a pinhole; scene units.
        aperture_radius: f32,
        /// Where a thin lens is sharp; distance along the axis.
        focus_distance: f32,
        /// Shift of the picture's centre, in picture widths and heights.
        principal_point: Vec2,
    },
    /// Parallel rays over [−1, 1] of the camera's x (y in proportion).
    Orthographic,
}

impl Projection {
    /// A pinhole that sees `fov_x` radians, between 0 and π, across the width of the picture, whatever its height.
    pub fn pinhole(fov_x: f32) -> Self {
        Self::Perspective {
            fov_x,
            fov_axis: FovAxis::X,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            principal_point: Vec2::ZERO,
        }
    }
}

/// A camera looks along +z of its frame with +y up and +x to the **left** (Mitsuba's frame, right-handed).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// For `--camera`.
    pub name: String,
    /// Its frame; may scale (orthographic).
    pub to_world: Mat4,
    /// How it maps.
    pub projection: Projection,
    /// Rays start and end at these distances along the axis.
    pub near_far: [f32; 2],
    /// The picture.
    pub film: Film,
    /// What the file asks for.
    pub samples_per_pixel: u32,
}

/// Why nobody can look through a camera.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CameraError {
    /// A camera called that does not exist.
    #[error("there is no camera called '{name}'{hint}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// What was probably meant or what would do, as the end of the sentence.
        hint: String,
    },
    /// A part of the picture that is not in it.
    #[error(
        "the crop {crop:?} (x, y, width, height) is not a part of a picture of {width} x {height} pixels"
    )]
    Crop {
        /// What was asked for.
        crop: [u32; 4],
        /// Pixels across.
        width: u32,
        /// Pixels down.
        height: u32,
    },
}

impl Scene {
    /// Cameras that were made for the scene are made for a picture of this size, now and for good: while something moves the
    /// camera does not.
    pub fn settle_framing(&mut self, [width, height]: [u32; 2]) {
        for i in 0..self.cameras.len() {
            let mut camera = self.cameras[i].clone();
            let Projection::Perspective { fov_axis: FovAxis::Framing, .. } = camera.projection else {
                continue;
            };
            camera.resize(width, height);
            let (name, samples_per_pixel) = (camera.name, camera.samples_per_pixel);
            let mut camera = Camera { name, samples_per_pixel, ..self.framing_camera(camera.film) };
            if let Projection::Perspective { fov_axis, .. } = &mut camera.projection {
                *fov_axis = FovAxis::Smaller;
            }
            self.cameras[i] = camera;
        }
    }

    /// The camera called `name`, the first where absent; with another size of its picture, as [`Camera::resize`] does it,
    /// and another part of it (x, y, width, height).
    pub fn look_through(
        &self,
        name: Option<&str>,
        size: Option<[u32; 2]>,
        crop: Option<[u32; 4]>,
    ) -> Result<Camera, CameraError> {
        let found = match name {
            None => self.cameras.first(),
            Some(name) => self.cameras.iter().find(|c| c.name == name),
        };
        let mut camera = found.cloned().ok_or_else(|| {
            let known: Vec<&str> = self.cameras.iter().map(|c| c.name.as_str()).collect();
            let name = name.unwrap_or("").to_string();
            let hint = if known.is_empty() { "; the scene has none".into() } else { suggest(&name, known) };
            CameraError::Unknown { name, hint }
        })?;
        if let Some([w, h]) = size {
            camera.resize(w, h);
            // One that was made for the scene is made for the shape of the picture, too.
            if matches!(camera.projection, Projection::Perspective { fov_axis: FovAxis::Framing, .. }) {
                let samples_per_pixel = camera.samples_per_pixel;
                camera = Camera { samples_per_pixel, ..self.framing_camera(camera.film) };
            }
        }
        if let Some(crop) = crop {
            let Film { width, height, .. } = camera.film;
            let inside = |start: u32, length: u32, whole| {
                length > 0 && start.checked_add(length).is_some_and(|end| end <= whole)
            };
            if !inside(crop[0], crop[2], width) || !inside(crop[1], crop[3], height) {
                return Err(CameraError::Crop { crop, width, height });
            }
            camera.film.crop = Some(crop);
        }
        Ok(camera)
    }
}

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
