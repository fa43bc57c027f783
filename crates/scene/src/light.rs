//! Lights that are not shapes.

use crate::TextureId;
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_optics::Image;

/// A light that is not a shape.
#[derive(Clone, Debug)]
pub enum Light {
    /// Radiant intensity from a point.
    Point {
        /// Where.
        position: Vec3,
        /// W/sr per channel.
        intensity: Vec3,
    },
    /// A cone along +z of its frame: full inside `beam`, falling linearly in angle to zero at `cutoff`.
    Spot {
        /// Its frame.
        to_world: Mat4,
        /// On the axis.
        intensity: Vec3,
        /// Half angle, radians.
        beam: f32,
        /// Half angle, radians.
        cutoff: f32,
        /// Multiplies the intensity; (u, v) spans the cutoff cone, 2·cutoff being the field of view.
        texture: Option<TextureId>,
    },
    /// From infinitely far away, travelling along `direction`.
    Directional {
        /// Unit, the way light travels.
        direction: Vec3,
        /// On a surface that faces it.
        irradiance: Vec3,
    },
    /// The same radiance from everywhere.
    Constant {
        /// Radiance.
        radiance: Vec3,
    },
    /// A latitude-longitude picture at infinity, Mitsuba's orientation: +y up; local direction
    /// (sin φ sin θ, cos θ, −cos φ sin θ) for φ = 2πu, θ = πv, v = 0 the top row.
    Environment {
        /// Radiance, linear, working space, channels R, G, B.
        image: Arc<Image>,
        /// Factor.
        scale: f32,
        /// Its frame.
        to_world: Mat4,
    },
    /// A slide projector: the inverse of a perspective camera.
    Projector {
        /// Its frame; throws along +z.
        to_world: Mat4,
        /// Intensity picture.
        texture: TextureId,
        /// Factor.
        scale: f32,
        /// Field of view across the picture's width, radians.
        fov_x: f32,
    },
    /// A flame and its smoke: cells that emit and absorb light and do not scatter it.
    Volume {
        /// Emission, in the working space, and absorption, both per scene unit.
        grid: Arc<Grid>,
        /// Factor of the emission.
        scale: f32,
        /// Its frame, without shear.
        to_world: Mat4,
    },
}

impl Light {
    /// The light that is this one in coordinates which `to_world`, without scale, takes to the world.
    pub fn carried_by(&self, to_world: Mat4) -> Self {
        let mut light = self.clone();
        match &mut light {
            Self::Point { position, .. } => *position = to_world.transform_point3(*position),
            Self::Directional { direction, .. } => *direction = to_world.transform_vector3(*direction),
            Self::Spot { to_world: own, .. }
            | Self::Environment { to_world: own, .. }
            | Self::Projector { to_world: own, .. }
            | Self::Volume { to_world: own, .. } => *own = to_world * *own,
            Self::Constant { .. } => {}
        }
        light
    }
}
