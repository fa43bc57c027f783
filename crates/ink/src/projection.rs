//! From the world to the picture: the camera of [`yugen_scene`] in double precision, for lines.

use crate::InkError;
use glam::{DAffine3, DVec2, DVec3};
use yugen_scene::{Camera, Projection as Kind};

/// A camera that lines are seen through. Pixels count from the top left corner of its window; their centres lie at halves.
#[derive(Clone, Debug)]
pub struct Projection {
    to_camera: DAffine3,
    eye: DVec3,
    /// Along the axis, of the length that one unit of depth has in the world.
    forward: DVec3,
    parallel: bool,
    /// Picture coordinates at distance one are (shift − pixel) / scale.
    scale: DVec2,
    shift: DVec2,
    corner: DVec2,
    near: f64,
    size: [u32; 2],
    /// Length in the world of a direction whose depth is one, by its picture coordinates.
    to_world: DAffine3,
}

/// A point in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Pixels.
    pub pixel: DVec2,
    /// Along the camera's axis, in its units; positive in front.
    pub depth: f64,
}

impl Projection {
    /// Of a camera; a lens is taken for a pinhole.
    pub fn new(camera: &Camera) -> Result<Self, InkError> {
        let bad = |reason| InkError::Camera { name: camera.name.clone(), reason };
        let [width, height] = [camera.film.width, camera.film.height].map(f64::from);
        let [x, y, w, h] = camera.film.crop.unwrap_or([0, 0, camera.film.width, camera.film.height]);
        if w == 0 || h == 0 {
            return Err(bad("its picture has no pixels"));
        }
        let to_world = DAffine3::from_mat4(camera.to_world.as_dmat4());
        let to_camera = to_world.inverse();
        if !camera.to_world.is_finite() || !to_camera.is_finite() {
            return Err(bad("its matrix cannot be inverted"));
        }
        let (half, centre, parallel) = match camera.projection {
            Kind::Perspective { fov_x, principal_point, .. } => {
                ((0.5 * f64::from(fov_x)).tan(), principal_point.as_dvec2(), false)
            }
            Kind::Orthographic => (1.0, DVec2::ZERO, true),
        };
        if !(half > 0.0 && half.is_finite() && centre.is_finite()) {
            return Err(bad("its field of view must be above 0 and below 180 degrees"));
        }
        let half = DVec2::new(half, half * height / width);
        let near = f64::from(camera.near_far[0]);
        Ok(Self {
            to_camera,
            eye: to_world.translation,
            forward: to_world.matrix3.z_axis,
            parallel,
            scale: DVec2::new(width, height) / (2.0 * half),
            shift: half + 2.0 * half * centre,
            corner: DVec2::new(f64::from(x), f64::from(y)),
            // Nothing is seen at the eye itself.
            near: if parallel { near } else { near.max(1e-7) },
            size: [w, h],
            to_world,
        })
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Where the eye is; of parallel rays, where the camera stands.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// From a point to the eye, not of unit length, so that it may be interpolated; constant where rays are parallel.
    pub fn to_eye(&self, p: DVec3) -> DVec3 {
        if self.parallel { -self.forward } else { self.eye - p }
    }

    /// Unit vectors of the world along which the picture's x grows, to the right, and its y, down.
    pub fn axes(&self) -> [DVec3; 2] {
        let m = self.to_world.matrix3;
        [-m.x_axis.normalize_or_zero(), -m.y_axis.normalize_or_zero()]
    }

    /// Unit, from what is seen at a place in the picture to the eye.
    pub fn to_eye_at(&self, pixel: DVec2) -> DVec3 {
        let xy = self.shift - (pixel + self.corner) / self.scale;
        let direction = if self.parallel { DVec3::Z } else { xy.extend(1.0) };
        -self.to_world.transform_vector3(direction).normalize_or_zero()
    }

    /// Depth of a point.
    pub fn depth(&self, p: DVec3) -> f64 {
        self.to_camera.transform_point3(p).z
    }

    /// Where a point is seen; `None` before the near plane.
    pub fn project(&self, p: DVec3) -> Option<Projected> {
        let c = self.to_camera.transform_point3(p);
        if c.z < self.near * (1.0 - 1e-9) || !c.is_finite() {
            return None;
        }
        Some(Projected { pixel: self.pixel(c), depth: c.z })
    }

    /// From the world to the camera's space, whose z is depth.
    pub fn to_camera(&self) -> DAffine3 {
        self.to_camera
    }

    /// Where a point of the camera's space behind the near plane is seen.
    pub fn pixel(&self, c: DVec3) -> DVec2 {
        let xy = if self.parallel { c.truncate() } else { c.truncate() / c.z };
        (self.shift - xy) * self.scale - self.corner
    }

    /// Depth of the near plane.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// Whether rays are parallel.
    pub fn is_parallel(&self) -> bool {
        self.parallel
    }

    /// The part of the segment that lies behind the near plane, as parts of it; `None` where there is none.
    pub fn clip_near(&self, a: DVec3, b: DVec3) -> Option<[f64; 2]> {
        let [za, zb] = [a, b].map(|p| self.depth(p) - self.near);
        match (za >= 0.0, zb >= 0.0) {
            (true, true) => Some([0.0, 1.0]),
            (true, false) => Some([0.0, za / (za - zb)]),
            (false, true) => Some([za / (za - zb), 1.0]),
            (false, false) => None,
        }
    }

    /// How the picture of a point moves when the point moves along `v`: unit, x to the right, y down; zero where it does not.
    pub fn direction(&self, p: DVec3, v: DVec3) -> DVec2 {
        let (c, d) = (self.to_camera.transform_point3(p), self.to_camera.transform_vector3(v));
        let moved = if self.parallel { d.truncate() } else { d.truncate() * c.z - c.truncate() * d.z };
        (-moved * self.scale).normalize_or_zero()
    }

    /// Pixels that a unit across the view takes at a depth.
    pub fn pixels_per_unit(&self, depth: f64) -> f64 {
        let scale = self.scale.x / self.forward.length().max(1e-300);
        if self.parallel { scale } else { scale / depth.max(self.near) }
    }

    /// Depth at the centre of a pixel where its ray has gone so far in the world from the near plane.
    pub fn depth_of_ray(&self, x: u32, y: u32, distance: f64) -> f64 {
        let xy = self.shift - (DVec2::new(f64::from(x), f64::from(y)) + 0.5 + self.corner) / self.scale;
        let direction = if self.parallel { DVec3::Z } else { xy.extend(1.0) };
        self.near + distance / self.to_world.transform_vector3(direction).length()
    }
}
