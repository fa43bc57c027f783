//! Spheres, rectangles, discs and cylinders: points, normals and parameters, as Mitsuba has them.

use glam::{DVec2, DVec3, Vec2};
use std::f64::consts::{PI, TAU};
use yugen_optics::warp;

/// A shape that is a formula, in its own coordinates, which are those of [`crate::Geometry`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Form {
    /// Radius 1 about the origin.
    Sphere,
    /// [−1, 1]² in z = 0.
    Rectangle,
    /// Radius 1 in z = 0.
    Disc,
    /// Radius 1 about z, from 0 to 1.
    Cylinder,
}

/// Azimuth in [0, 2π).
fn azimuth(p: DVec3) -> f64 {
    let phi = p.y.atan2(p.x);
    if phi < 0.0 { phi + TAU } else { phi }
}

impl Form {
    /// Unit, outwards or along +z, at a point of the form.
    pub fn normal(self, p: DVec3) -> DVec3 {
        match self {
            Self::Sphere => p,
            Self::Rectangle | Self::Disc => DVec3::Z,
            Self::Cylinder => p.with_z(0.0),
        }
    }

    /// Mitsuba's parameters; azimuths, which cost more than all the rest, only where they are wanted.
    pub fn uv(self, p: DVec3) -> DVec2 {
        match self {
            Self::Sphere => DVec2::new(azimuth(p) / TAU, p.x.hypot(p.y).atan2(p.z) / PI),
            Self::Rectangle => DVec2::new(0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0)),
            Self::Disc => DVec2::new(p.x.hypot(p.y), azimuth(p) / TAU),
            Self::Cylinder => DVec2::new(azimuth(p) / TAU, p.z),
        }
    }

    /// Derivatives of the point by the parameters.
    pub fn tangents(self, p: DVec3) -> [DVec3; 2] {
        let r = (p.x * p.x + p.y * p.y).sqrt();
        // On the axis any azimuth is right.
        let (sin, cos) = if r > 0.0 { (p.y / r, p.x / r) } else { (0.0, 1.0) };
        match self {
            Self::Sphere => [DVec3::new(-p.y, p.x, 0.0) * TAU, DVec3::new(p.z * cos, p.z * sin, -r) * PI],
            Self::Rectangle => [DVec3::X * 2.0, DVec3::Y * 2.0],
            Self::Disc => [DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0) * (TAU * r)],
            Self::Cylinder => [DVec3::new(-p.y, p.x, 0.0) * TAU, DVec3::Z],
        }
    }

    /// Evenly over the form in its own coordinates.
    pub fn uniform(self, u: Vec2) -> DVec3 {
        match self {
            Self::Sphere => {
                let z = 1.0 - 2.0 * f64::from(u.x);
                let (sin, cos) = (TAU * f64::from(u.y)).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                DVec3::new(r * cos, r * sin, z)
            }
            Self::Rectangle => (2.0 * u.as_dvec2() - 1.0).extend(0.0),
            Self::Disc => warp::concentric_disc(u).as_dvec2().extend(0.0),
            Self::Cylinder => {
                let (sin, cos) = (TAU * f64::from(u.x)).sin_cos();
                DVec3::new(cos, sin, f64::from(u.y))
            }
        }
    }

    /// Area in its own coordinates.
    pub fn own_area(self) -> f64 {
        match self {
            Self::Sphere => 4.0 * PI,
            Self::Rectangle => 4.0,
            Self::Disc => PI,
            Self::Cylinder => TAU,
        }
    }
}
