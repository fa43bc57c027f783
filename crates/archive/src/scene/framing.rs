//! A camera and a light for scenes that bring none.

use super::{Camera, Film, FovAxis, Geometry, Light, Projection, Scene, Shape};
use glam::{Mat4, Vec2, Vec3};

/// Horizontal field of view of [`Scene::framing_camera`]: a little longer than a normal lens.
const FOV: f32 = 0.7;

/// The frame of something that stands at `from` and looks along `direction`: +z forward, +y towards `up`,
/// +x to the left.
pub fn look_along(from: Vec3, direction: Vec3, up: Vec3) -> Mat4 {
    let z = direction.normalize_or(Vec3::Z);
    let x = up.cross(z).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), from.extend(1.0))
}

impl Scene {
    /// The corners of the box around all shapes; `None` where there is nothing.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let groups: Vec<_> = self.groups.iter().map(|g| bounds(g, &[])).collect();
        bounds(&self.shapes, &groups)
    }

    /// A camera that sees all shapes, from the right and a little above, with +y up.
    pub fn framing_camera(&self) -> Camera {
        let [low, high] = self.bounds().unwrap_or([Vec3::splat(-1.0), Vec3::ONE]);
        let (middle, radius) = (0.5 * (low + high), (0.5 * (high - low)).length().clamp(1e-6, 1e15));
        let film = Film::default();
        let half = 0.5 * FOV;
        let half_y = (half.tan() * film.height as f32 / film.width as f32).atan();
        let distance = radius / half.min(half_y).sin();
        let direction = -Vec3::new(0.5, 0.3, 1.0).normalize();
        Camera {
            name: "framing".into(),
            to_world: look_along(middle - direction * distance, direction, Vec3::Y),
            projection: Projection::Perspective {
                fov_x: FOV,
                // Whatever the picture's shape, nothing is cut off.
                fov_axis: FovAxis::Smaller,
                aperture_radius: 0.0,
                focus_distance: distance,
                principal_point: Vec2::ZERO,
            },
            near_far: [1e-3 * distance, distance + 1e3 * radius],
            film,
            samples_per_pixel: 64,
        }
    }

    /// Whether no camera could see anything: there is no shape, and no light that stands all around.
    pub fn is_empty(&self) -> bool {
        let around = |l: &Light| matches!(l, Light::Constant { .. } | Light::Environment { .. });
        self.shapes.is_empty() && !self.lights.iter().any(around)
    }

    /// Whether anything shines.
    pub fn has_light(&self) -> bool {
        !self.lights.is_empty()
            || self.shapes.iter().chain(self.groups.iter().flatten()).any(|s| s.emission.is_some())
    }

    /// Light for a scene without: a sun over the left shoulder of the first camera, irradiance 2, and a sky
    /// of radiance 0.4, both white. A white surface turned to the sun comes out at (2 + 0.4 π)/π ≈ 1.
    pub fn add_default_light(&mut self) {
        let frame = self.cameras.first().map_or(Mat4::IDENTITY, |c| c.to_world);
        let direction = frame.transform_vector3(Vec3::new(-0.5, -0.8, 1.0)).normalize_or(Vec3::NEG_Y);
        self.lights.push(Light::Directional { direction, irradiance: Vec3::splat(2.0) });
        self.lights.push(Light::Constant { radiance: Vec3::splat(0.4) });
    }
}

fn bounds(shapes: &[Shape], groups: &[Option<[Vec3; 2]>]) -> Option<[Vec3; 2]> {
    let around = |low: Vec3, high: Vec3| Some([low, high]);
    let join = |a: [Vec3; 2], b: [Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let of_shape = |shape: &Shape| {
        let own = match &shape.geometry {
            Geometry::Mesh(mesh) => {
                let world = mesh.positions.iter().map(|&p| shape.to_world.transform_point3(p));
                return world.filter(|p| p.is_finite()).map(|p| [p, p]).reduce(join);
            }
            Geometry::Sphere => around(Vec3::NEG_ONE, Vec3::ONE),
            Geometry::Rectangle | Geometry::Disc => {
                around(Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0))
            }
            Geometry::Cylinder => around(Vec3::new(-1.0, -1.0, 0.0), Vec3::ONE),
            Geometry::Instance(group) => groups.get(*group).copied().flatten(),
        };
        let [low, high] = own?;
        let corner = |i: usize| Vec3::select(glam::BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), low, high);
        (0..8).map(|i| shape.to_world.transform_point3(corner(i))).map(|p| [p, p]).reduce(join)
    };
    shapes.iter().filter_map(of_shape).reduce(join)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_in_the_picture() {
        let shape = |geometry, to_world| Shape::new("", geometry, to_world, 0);
        let mut scene = Scene::default();
        scene.groups.push(vec![shape(Geometry::Sphere, Mat4::from_scale(Vec3::splat(0.5)))]);
        scene.shapes.push(shape(Geometry::Instance(0), Mat4::from_translation(Vec3::new(3.0, 0.0, 0.0))));
        scene.shapes.push(shape(Geometry::Rectangle, Mat4::from_scale(Vec3::new(1.0, 2.0, 1.0))));
        assert_eq!(scene.bounds(), Some([Vec3::new(-1.0, -2.0, -0.5), Vec3::new(3.5, 2.0, 0.5)]));
        let camera = scene.framing_camera();
        let to_camera = camera.to_world.inverse();
        let [low, high] = scene.bounds().unwrap();
        let tan = (0.5 * FOV).tan();
        for i in 0..8 {
            let corner = Vec3::select(glam::BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), low, high);
            let p = to_camera.transform_point3(corner);
            assert!(p.z > camera.near_far[0] && p.z < camera.near_far[1]);
            assert!(p.x.abs() < p.z * tan && p.y.abs() < p.z * tan * 0.75, "{p}");
        }
        // Right-handed, +x to the left: looking along -z with +y up, left is -x.
        let frame = look_along(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y);
        assert!(
            (frame.x_axis.truncate() - Vec3::NEG_X).length() < 1e-6
                && (frame.determinant() - 1.0).abs() < 1e-6
        );
        assert!(!scene.has_light());
        scene.cameras.push(camera);
        scene.add_default_light();
        assert!(scene.has_light());
        let Light::Directional { direction, .. } = scene.lights[0] else { panic!("a sun") };
        // From the upper left of the picture, away from the camera.
        let local = to_camera.transform_vector3(direction);
        assert!(local.z > 0.0 && local.y < 0.0 && local.x < 0.0, "{local}");
    }
}
