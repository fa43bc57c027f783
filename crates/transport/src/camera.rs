//! Primary rays.

use crate::accel::Ray;
use glam::{Affine3A, Vec2, Vec3};
use yugen_optics::warp::concentric_disc;
use yugen_scene::{Camera, Projection};

/// A camera ready to shoot rays.
#[derive(Clone, Debug)]
pub struct Lens {
    to_world: Affine3A,
    projection: Projection,
    near_far: [f32; 2],
    size: Vec2,
    /// Half the width of the picture at distance one.
    half: f32,
}

impl Lens {
    /// From a scene's camera.
    pub fn new(camera: &Camera) -> Self {
        let half = match camera.projection {
            Projection::Perspective { fov_x, .. } => (0.5 * fov_x).tan(),
            Projection::Orthographic => 1.0,
        };
        Self {
            half,
            to_world: Affine3A::from_mat4(camera.to_world),
            projection: camera.projection,
            near_far: camera.near_far,
            size: Vec2::new(camera.film.width as f32, camera.film.height as f32),
        }
    }

    /// The ray through `pixel` (continuous, (0, 0) the top left corner), from lens point `u`.
    pub fn ray(&self, pixel: Vec2, u: Vec2) -> Ray {
        let p = pixel / self.size;
        let aspect = self.size.x / self.size.y;
        let [near, far] = self.near_far;
        match self.projection {
            Projection::Perspective { aperture_radius, focus_distance, principal_point, .. } => {
                let half = self.half;
                // +x is to the left, so the picture's x runs against it.
                let x = (1.0 - 2.0 * (p.x - principal_point.x)) * half;
                let y = (1.0 - 2.0 * (p.y - principal_point.y)) * half / aspect;
                let mut origin = Vec3::ZERO;
                let mut direction = Vec3::new(x, y, 1.0);
                if aperture_radius > 0.0 {
                    let lens = concentric_disc(u) * aperture_radius;
                    origin = lens.extend(0.0);
                    direction = direction * focus_distance - origin;
                }
                self.clip(origin, direction, near / direction.z, far / direction.z)
            }
            Projection::Orthographic => {
                let origin = Vec3::new(1.0 - 2.0 * p.x, (1.0 - 2.0 * p.y) / aspect, 0.0);
                self.clip(origin, Vec3::Z, near, far)
            }
        }
    }

    /// Angle in radians between the rays of neighbouring pixels (perspective), and their distance in scene
    /// units at the camera (orthographic).
    pub fn pixel_spread(&self) -> (f32, f32) {
        match self.projection {
            Projection::Perspective { .. } => (2.0 * self.half / self.size.x, 0.0),
            Projection::Orthographic => (0.0, 2.0 / self.size.x * self.to_world.matrix3.x_axis.length()),
        }
    }

    fn clip(&self, origin: Vec3, direction: Vec3, near: f32, far: f32) -> Ray {
        let world = self.to_world.transform_vector3(direction);
        let scale = world.length();
        let dir = world / scale;
        let start = self.to_world.transform_point3(origin + direction * near);
        Ray { origin: start, dir, t_min: 0.0, t_max: (far - near) * scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Mat4;
    use yugen_scene::{Film, FovAxis};

    #[test]
    fn the_corners_see_the_field_of_view() {
        let camera = Camera {
            name: String::new(),
            to_world: Mat4::IDENTITY,
            projection: Projection::pinhole(std::f32::consts::FRAC_PI_2),
            near_far: [0.1, 100.0],
            film: Film { width: 200, height: 100, ..Film::default() },
            samples_per_pixel: 1,
        };
        let lens = Lens::new(&camera);
        let ray = lens.ray(Vec2::new(0.0, 50.0), Vec2::ZERO);
        assert!((ray.dir - Vec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-6);
        assert!((ray.origin.z - 0.1).abs() < 1e-6);
        let ray = lens.ray(Vec2::new(100.0, 0.0), Vec2::ZERO);
        assert!((ray.dir - Vec3::new(0.0, 0.5, 1.0).normalize()).length() < 1e-6);
        let end = ray.origin + ray.dir * ray.t_max;
        assert!((end.z - 100.0).abs() < 1e-3);
    }

    #[test]
    fn a_thin_lens_is_sharp_at_its_focus() {
        let camera = Camera {
            name: String::new(),
            to_world: Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)),
            projection: Projection::Perspective {
                fov_x: 0.8,
                fov_axis: FovAxis::X,
                aperture_radius: 0.3,
                focus_distance: 5.0,
                principal_point: Vec2::ZERO,
            },
            near_far: [0.01, 100.0],
            film: Film { width: 64, height: 64, ..Film::default() },
            samples_per_pixel: 1,
        };
        let lens = Lens::new(&camera);
        let at_focus = |u| {
            let ray = lens.ray(Vec2::new(10.0, 20.0), u);
            ray.origin + ray.dir * ((8.0 - ray.origin.z) / ray.dir.z)
        };
        let a = at_focus(Vec2::new(0.1, 0.9));
        let b = at_focus(Vec2::new(0.8, 0.3));
        assert!((a - b).length() < 1e-4, "{a} {b}");
    }
}
