//! A camera and a light for scenes that bring none.

use super::{Camera, Film, FovAxis, Geometry, Light, Projection, Scene, Shape};
use glam::{Mat4, Vec2, Vec3};

/// Tangent of half the field of view of [`Scene::framing_camera`] along the smaller side of the picture: 31 degrees, a
/// little longer than a normal lens.
const HALF: f32 = 0.274;
/// How much of the width or of the height is filled.
const FILLED: f32 = 0.9;
/// Corners of a circle that stands for a curved shape: its radius is right to one part in 800.
const RIM: u32 = 64;

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

    /// A camera that sees all shapes, from the right and a little above, with +y up. What is seen fills nine tenths of
    /// the width or of the height of `film`, whichever it reaches first.
    pub fn framing_camera(&self, film: Film) -> Camera {
        let direction = -Vec3::new(0.5, 0.3, 1.0).normalize();
        let frame = look_along(Vec3::ZERO, direction, Vec3::Y);
        let aspect = film.width as f32 / film.height as f32;
        let tan = Vec2::new(aspect.max(1.0), aspect.recip().max(1.0)) * HALF;
        // A point p is left of the right edge of a camera at c if p.x - c.x < t (p.z - c.z): the farthest point tells how
        // near to the edge the camera may come. Likewise for the other three.
        let t = tan * FILLED;
        let mut edges = [f32::NEG_INFINITY; 4];
        let [mut near, mut far] = [f32::INFINITY, f32::NEG_INFINITY];
        let to_camera = frame.inverse();
        self.for_each_point(&mut |p| {
            let p = to_camera.transform_point3(p).clamp(Vec3::splat(-1e15), Vec3::splat(1e15));
            let beyond = [p.x - t.x * p.z, -p.x - t.x * p.z, p.y - t.y * p.z, -p.y - t.y * p.z];
            edges = std::array::from_fn(|i| edges[i].max(beyond[i]));
            (near, far) = (near.min(p.z), far.max(p.z));
        });
        if near > far {
            // Nothing there.
            (edges, near, far) = ([1.0; 4], -1.0, 1.0);
        }
        let [right, left, up, down] = edges;
        let back = ((right + left) / (2.0 * t.x)).max((up + down) / (2.0 * t.y));
        // A point alone has no size; nor has the eye a place in what it looks at.
        let z = (-back).min(near - 0.01 * (far - near).max(1e-4 * back.abs()).max(1e-6));
        let centre = Vec3::new(0.5 * (right - left), 0.5 * (up - down), z);
        let (middle, depth) = (0.5 * (near + far), far - near);
        Camera {
            name: "framing".into(),
            to_world: Mat4::from_translation(frame.transform_point3(centre)) * frame,
            projection: Projection::Perspective {
                fov_x: 2.0 * tan.x.atan(),
                fov_axis: FovAxis::Framing,
                aperture_radius: 0.0,
                focus_distance: middle - z,
                principal_point: Vec2::ZERO,
            },
            near_far: [(1e-3 * (middle - z)).min(0.5 * (near - z)), 1e3 * (middle - z + depth)],
            film,
            samples_per_pixel: 64,
        }
    }

    /// Points whose hull is that of all shapes, in the world: vertices, and the curved ones as polygons.
    fn for_each_point(&self, see: &mut impl FnMut(Vec3)) {
        fn of_shapes(scene: &Scene, shapes: &[Shape], place: Mat4, see: &mut impl FnMut(Vec3), inside: bool) {
            for shape in shapes {
                let to_world = place * shape.to_world;
                let mut see_own = |p: Vec3| {
                    let p = to_world.transform_point3(p);
                    if p.is_finite() {
                        see(p);
                    }
                };
                let rim = |i: u32| Vec2::from_angle(i as f32 * std::f32::consts::TAU / RIM as f32);
                match &shape.geometry {
                    Geometry::Mesh(mesh) => mesh.positions.iter().for_each(|p| see_own(*p)),
                    Geometry::Sphere => {
                        for (i, j) in (0..RIM).flat_map(|i| (0..=RIM / 2).map(move |j| (i, j))) {
                            let (round, down) = (rim(i), rim(j));
                            see_own((round * down.y).extend(down.x));
                        }
                    }
                    Geometry::Rectangle => {
                        [Vec2::ONE, Vec2::NEG_ONE, Vec2::new(1.0, -1.0), Vec2::new(-1.0, 1.0)]
                            .iter()
                            .for_each(|p| see_own(p.extend(0.0)));
                    }
                    Geometry::Disc => (0..RIM).for_each(|i| see_own(rim(i).extend(0.0))),
                    Geometry::Cylinder => (0..RIM).for_each(|i| {
                        see_own(rim(i).extend(0.0));
                        see_own(rim(i).extend(1.0));
                    }),
                    Geometry::Instance(group) => {
                        // Groups do not stand in groups.
                        if let (Some(group), false) = (scene.groups.get(*group), inside) {
                            of_shapes(scene, group, to_world, see, true);
                        }
                    }
                }
            }
        }
        of_shapes(self, &self.shapes, Mat4::IDENTITY, see, false);
    }

    /// Whether no camera could see anything: there is no shape, and no light that is seen.
    pub fn is_empty(&self) -> bool {
        let seen = |l: &Light| {
            matches!(l, Light::Constant { .. } | Light::Environment { .. } | Light::Volume { .. })
        };
        self.shapes.is_empty() && !self.lights.iter().any(seen)
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
        // An orthographic camera is as wide as its frame; the sun stands where it does however far that zooms.
        let axis = |a: glam::Vec4| a.truncate().normalize_or_zero();
        let direction = axis(frame.z_axis) - 0.5 * axis(frame.x_axis) - 0.8 * axis(frame.y_axis);
        let direction = direction.normalize_or(Vec3::NEG_Y);
        self.add_light("sun", Light::Directional { direction, irradiance: Vec3::splat(2.0) });
        self.add_light("sky", Light::Constant { radiance: Vec3::splat(0.4) });
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
        let camera = scene.framing_camera(Film::default());
        let to_camera = camera.to_world.inverse();
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

    #[test]
    fn what_is_seen_fills_nine_tenths_of_the_side_it_reaches_first() {
        let at = |scale: Vec3| Mat4::from_translation(Vec3::new(5.0, -3.0, 40.0)) * Mat4::from_scale(scale);
        let picture = |width, height| Film { width, height, ..Film::default() };
        for scale in
            [Vec3::ONE, Vec3::new(30.0, 1.0, 1.0), Vec3::new(0.1, 9.0, 0.1), Vec3::new(1.0, 0.01, 50.0)]
        {
            for (width, height) in [(768, 576), (100, 100), (90, 400), (1920, 300)] {
                let mut scene = Scene::default();
                let ball = crate::primitives::ball(24);
                let mesh = Geometry::Mesh(std::sync::Arc::new(ball.clone()));
                scene.shapes.push(Shape::new("", mesh, at(scale), 0));
                let camera = scene.framing_camera(picture(width, height));
                let Projection::Perspective { fov_x, .. } = camera.projection else { panic!("perspective") };
                let tan_x = (0.5 * fov_x).tan();
                let tan = Vec2::new(tan_x, tan_x * height as f32 / width as f32);
                let to_camera = camera.to_world.inverse();
                let mut most = Vec2::ZERO;
                for p in &ball.positions {
                    let p = to_camera.transform_point3(at(scale).transform_point3(*p));
                    assert!(
                        p.z > camera.near_far[0] && p.z < camera.near_far[1],
                        "{p} {:?}",
                        camera.near_far
                    );
                    most = most.max((p.truncate() / (p.z * tan)).abs());
                }
                assert!((most.max_element() - 0.9).abs() < 2e-3, "{scale} {width}x{height}: {most}");
                // The same through a group, a sphere for its mesh.
                let mut scene = Scene::default();
                scene.groups.push(vec![Shape::new("", Geometry::Sphere, Mat4::IDENTITY, 0)]);
                scene.shapes.push(Shape::new("", Geometry::Instance(0), at(scale), 0));
                let other = scene.framing_camera(picture(width, height));
                let apart = (other.to_world.w_axis - camera.to_world.w_axis).length();
                assert!(
                    apart < 0.02 * camera.to_world.w_axis.truncate().distance(Vec3::new(5.0, -3.0, 40.0)),
                    "{apart}"
                );
            }
        }
        // A point and nothing at all can be looked at.
        let mut scene = Scene::default();
        assert!(scene.framing_camera(Film::default()).to_world.is_finite());
        let point = crate::Mesh { positions: vec![Vec3::ONE; 3], ..Default::default() };
        scene.shapes.push(Shape::new("", Geometry::Mesh(std::sync::Arc::new(point)), Mat4::IDENTITY, 0));
        let camera = scene.framing_camera(Film::default());
        assert!(camera.to_world.is_finite() && camera.to_world.inverse().transform_point3(Vec3::ONE).z > 0.0);
    }
}
