//! Where the picture is seen from, and how that is moved.

use glam::{Mat4, Vec3};
use yugen_scene::{Camera, Film, Projection, Scene};

/// Part of the picture that what is framed fills.
const FILLED: f32 = 0.9;

/// Degrees from straight up or down that an orbit keeps.
const POLE: f32 = 1.0;

/// A camera with something that it turns around.
///
/// All moves are rigid motions of the camera's own frame: until it is moved it is the camera of the scene, and one that
/// mirrors or leans goes on doing so.
#[derive(Clone, Debug)]
pub struct Eye {
    camera: Camera,
    /// The axis of the world, of either sign, that is nearest to the camera's own up.
    up: Vec3,
    pivot: Vec3,
    /// Half the diagonal of the scene.
    radius: f32,
    centre: Vec3,
}

impl Eye {
    /// Looks through `camera`, all of its picture, at what lies within `bounds`.
    pub fn new(mut camera: Camera, bounds: Option<[Vec3; 2]>) -> Self {
        camera.film.crop = None;
        let [low, high] = bounds.unwrap_or([Vec3::NEG_ONE, Vec3::ONE]);
        let (centre, radius) = (0.5 * (low + high), (0.5 * (high - low).length()).max(1e-6));
        let own = axis(camera.to_world.y_axis);
        let up = [Vec3::Y, Vec3::Z, Vec3::X]
            .into_iter()
            .flat_map(|a| [a, -a])
            .max_by(|a, b| a.dot(own).total_cmp(&b.dot(own)))
            .unwrap_or(Vec3::Y);
        let mut eye = Self { camera, up, pivot: centre, radius, centre };
        // What lies straight ahead at the distance of the middle of the scene.
        let ahead = (centre - eye.position()).dot(eye.forward()).max(0.05 * radius);
        eye.pivot = eye.position() + eye.forward() * ahead;
        eye
    }

    /// The camera as it stands.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Half the diagonal of the scene.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Where it stands.
    pub fn position(&self) -> Vec3 {
        self.camera.to_world.w_axis.truncate()
    }

    /// Where it looks, unit.
    pub fn forward(&self) -> Vec3 {
        axis(self.camera.to_world.z_axis)
    }

    /// Right in the picture, unit: +x of a camera is to the left.
    pub fn right(&self) -> Vec3 {
        -axis(self.camera.to_world.x_axis)
    }

    /// From it to what it turns around.
    pub fn distance(&self) -> f32 {
        self.position().distance(self.pivot)
    }

    /// Gives its picture so many pixels, one at least.
    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        self.camera.resize(width.max(1), height.max(1));
    }

    /// Where there are no numbers for where it would come to stand, it stays.
    fn transform(&mut self, by: Mat4) -> bool {
        let moved = by * self.camera.to_world;
        let stays = !moved.is_finite();
        if !stays {
            self.camera.to_world = moved;
        }
        !stays
    }

    fn turn(&mut self, about: Vec3, around: Vec3, degrees: f32) {
        let rotation = Mat4::from_axis_angle(around, degrees.to_radians());
        self.transform(Mat4::from_translation(about) * rotation * Mat4::from_translation(-about));
    }

    /// Of what is asked for upwards in degrees, what stays clear of the poles.
    fn clear_of_poles(&self, up: f32) -> f32 {
        let elevation = (-self.forward().dot(self.up)).clamp(-1.0, 1.0).asin().to_degrees();
        let most = 90.0 - POLE;
        // One that looks straight down already may only come away.
        up.clamp((-most - elevation).min(0.0), (most - elevation).max(0.0))
    }

    /// Goes round what it looks at: to the right and up, in degrees.
    pub fn orbit(&mut self, right: f32, up: f32) {
        let up = self.clear_of_poles(up);
        self.turn(self.pivot, self.right(), -up);
        self.turn(self.pivot, self.up, right);
    }

    /// Turns on the spot: to the right and up, in degrees.
    pub fn look(&mut self, right: f32, up: f32) {
        let up = -self.clear_of_poles(-up);
        let (here, distance) = (self.position(), self.distance());
        self.turn(here, self.right(), up);
        self.turn(here, self.up, -right);
        self.pivot = here + self.forward() * distance;
    }

    /// Width of what it sees at the pivot.
    fn width(&self) -> f32 {
        match self.camera.projection {
            Projection::Perspective { fov_x, .. } => 2.0 * (0.5 * fov_x).tan() * self.distance(),
            Projection::Orthographic => 2.0 * self.camera.to_world.x_axis.truncate().length(),
        }
    }

    fn shift(&mut self, by: Vec3) {
        if (self.pivot + by).is_finite() && self.transform(Mat4::from_translation(by)) {
            self.pivot += by;
        }
    }

    /// Moves within the picture's plane: to the right and up, in widths of the picture.
    pub fn pan(&mut self, right: f32, up: f32) {
        let upwards = axis(self.camera.to_world.y_axis);
        self.shift((self.right() * right + upwards * up) * self.width());
    }

    /// Comes nearer or goes away: the distance to what it looks at becomes `factor` times as long.
    pub fn dolly(&mut self, factor: f32) {
        let factor = factor.clamp(1e-3, 1e3);
        let m = &mut self.camera.to_world;
        match &mut self.camera.projection {
            Projection::Orthographic => {
                m.x_axis *= factor;
                m.y_axis *= factor;
            }
            Projection::Perspective { focus_distance, .. } => {
                let from = m.w_axis.truncate() - self.pivot;
                let length = from.length().max(1e-9 * self.radius);
                let to = (length * factor).clamp(1e-4 * self.radius, 1e4 * self.radius);
                m.w_axis = (self.pivot + from * (to / length)).extend(1.0);
                *focus_distance *= to / length;
                let [near, far] = &mut self.camera.near_far;
                *near = near.min(0.01 * to);
                *far = far.max(2.0 * (to + 2.0 * self.radius));
            }
        }
    }

    /// Walks: forward, to the right and up, in radii of the scene.
    pub fn walk(&mut self, forward: f32, right: f32, up: f32) {
        self.shift((self.forward() * forward + self.right() * right + self.up * up) * self.radius);
    }

    /// Steps back or forward, without turning, until all of the scene is in the picture.
    pub fn frame(&mut self, scene: &Scene) {
        let Some([low, high]) = scene.bounds() else { return };
        let (x, y, z) = (self.right(), axis(self.camera.to_world.y_axis), self.forward());
        let film = &self.camera.film;
        let aspect = film.height as f32 / film.width as f32;
        let corners = (0..8).map(|i| {
            let pick = |bit: usize, a: f32, b: f32| if i >> bit & 1 == 0 { a } else { b };
            let p = Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z));
            let p = p - self.centre;
            Vec3::new(p.dot(x).abs(), p.dot(y).abs(), p.dot(z))
        });
        match self.camera.projection {
            Projection::Perspective { fov_x, .. } => {
                let tan_x = (0.5 * fov_x).tan() * FILLED;
                let tan_y = tan_x * aspect;
                let back = corners.map(|p| (p.x / tan_x).max(p.y / tan_y) - p.z).fold(0.0, f32::max);
                let back = back.max(1e-3 * self.radius);
                self.shift(self.centre - z * back - self.position());
                let far = &mut self.camera.near_far[1];
                *far = far.max(back + 2.0 * self.radius);
            }
            Projection::Orthographic => {
                let half = corners.map(|p| p.x.max(p.y / aspect)).fold(0.0, f32::max).max(1e-6) / FILLED;
                let scale = half / self.camera.to_world.x_axis.truncate().length().max(1e-30);
                self.camera.to_world.x_axis *= scale;
                self.camera.to_world.y_axis *= scale;
                self.shift(self.centre - z * (2.0 * self.radius) - self.position());
            }
        }
        self.pivot = self.centre;
    }
}

/// A camera for a scene: its first, or one that sees all shapes.
pub fn first_camera(scene: &Scene) -> Camera {
    scene.cameras.first().cloned().unwrap_or_else(|| scene.framing_camera(Film::default()))
}

fn axis(column: glam::Vec4) -> Vec3 {
    column.truncate().normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_scene::{Geometry, Shape};

    fn scene() -> Scene {
        let place =
            Mat4::from_translation(Vec3::new(3.0, 1.0, -2.0)) * Mat4::from_scale(Vec3::new(2.0, 1.0, 1.5));
        Scene { shapes: vec![Shape::new("ball", Geometry::Sphere, place, 0)], ..Scene::default() }
    }

    fn eye(scene: &Scene) -> Eye {
        Eye::new(first_camera(scene), scene.bounds())
    }

    /// Where a point comes to lie in the picture, from −1 to 1 in its width.
    fn seen(eye: &Eye, p: Vec3) -> [f32; 2] {
        let p = eye.camera().to_world.inverse().transform_point3(p);
        let Projection::Perspective { fov_x, .. } = eye.camera().projection else { return [-p.x, p.y] };
        let t = (0.5 * fov_x).tan() * p.z;
        [-p.x / t, p.y / t]
    }

    #[test]
    fn an_orbit_keeps_distance_and_what_is_looked_at() {
        let scene = scene();
        let mut eye = eye(&scene);
        let (distance, pivot, right) = (eye.distance(), eye.pivot, eye.right());
        let before = eye.position();
        eye.orbit(10.0, 0.0);
        // It went to its right, and the pivot stays in the middle.
        assert!((eye.position() - before).dot(right) > 0.0);
        for (a, b) in [(30.0, 20.0), (-75.0, -130.0), (10.0, 400.0), (5.0, 1.0)] {
            eye.orbit(a, b);
            assert!((eye.distance() / distance - 1.0).abs() < 1e-4);
            assert!(eye.pivot == pivot && seen(&eye, pivot)[0].abs() < 1e-4);
            // Upright, and never over the pole.
            assert!(eye.right().dot(Vec3::Y).abs() < 1e-4);
            assert!(axis(eye.camera().to_world.y_axis).y > 0.0, "upside down");
        }
        assert!((eye.camera().to_world.determinant() - 1.0).abs() < 1e-3);
        // There and back again.
        let at = eye.position();
        eye.orbit(33.0, -20.0);
        eye.orbit(-33.0, 20.0);
        assert!(eye.position().distance(at) < 1e-3 * distance);
    }

    #[test]
    fn looking_pans_and_walks_go_where_they_say() {
        let scene = scene();
        let mut eye = eye(&scene);
        let (at, pivot) = (eye.position(), eye.pivot);
        eye.look(7.0, 0.0);
        // What was in the middle is now to the left.
        assert!(eye.position() == at && seen(&eye, pivot)[0] < -0.05);
        eye.look(-7.0, 5.0);
        assert!(seen(&eye, pivot)[1] < -0.05 && seen(&eye, pivot)[0].abs() < 1e-3);
        eye.look(0.0, -5.0);
        eye.pan(0.25, 0.0);
        // A quarter of the width is half of one half.
        assert!((seen(&eye, pivot)[0] + 0.5).abs() < 1e-3, "{:?}", seen(&eye, pivot));
        eye.pan(-0.25, 0.1);
        assert!(seen(&eye, pivot)[1] < -0.1);
        let before = eye.position();
        eye.walk(0.5, 0.0, 0.0);
        assert!(((eye.position() - before).dot(eye.forward()) - 0.5 * eye.radius()).abs() < 1e-3);
        let before = eye.position();
        eye.walk(0.0, 0.0, 1.0);
        assert!(((eye.position() - before) - Vec3::Y * eye.radius()).length() < 1e-3);
        let distance = eye.distance();
        eye.dolly(0.5);
        assert!((eye.distance() / distance - 0.5).abs() < 1e-3);
        for _ in 0..100 {
            eye.dolly(0.1);
        }
        assert!(eye.position().is_finite() && eye.distance() > 0.0);
    }

    #[test]
    fn everything_is_framed_from_anywhere() {
        let scene = scene();
        let [low, high] = scene.bounds().expect("a ball");
        for orthographic in [false, true] {
            let mut camera = first_camera(&scene);
            if orthographic {
                camera.projection = Projection::Orthographic;
            }
            let mut eye = Eye::new(camera, scene.bounds());
            for (size, turn) in [([640, 480], 0.0), ([100, 400], 50.0), ([900, 200], 170.0)] {
                eye.resize(size);
                eye.orbit(turn, 10.0);
                eye.walk(3.0, -2.0, 0.5);
                eye.frame(&scene);
                let mut most = 0.0f32;
                for i in 0..8 {
                    let p = Vec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
                    let [x, y] = seen(&eye, p);
                    most = most.max(x.abs()).max(y.abs() * size[0] as f32 / size[1] as f32);
                }
                assert!((most - 0.9).abs() < 5e-3, "{orthographic} {size:?}: {most}");
            }
        }
    }

    #[test]
    fn nothing_to_see_is_no_trouble() {
        let scene = Scene::default();
        let mut eye = eye(&scene);
        eye.frame(&scene);
        eye.resize([0, 0]);
        eye.orbit(1e9, -1e9);
        eye.walk(f32::MAX, f32::MAX, 0.0);
        eye.pan(f32::MAX, 1.0);
        eye.dolly(0.0);
        assert!(eye.camera().to_world.is_finite());
        assert_eq!(eye.camera().film.width, 1);
    }
}
