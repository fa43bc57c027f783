//! Motion as something to look at: a stick for each bone, a ball for each joint or marker, three axes for each rigid
//! body, on a floor.

use crate::{
    Attachment, Camera, Figure, Film, Geometry, Material, MaterialId, Part, PoseError, Projection, Scene,
    Shape, Value, look_along,
};
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_motion::{
    BodySide, Clip, Curve, CurveError, Interpolation, Joint, Placement, Property, SkeletalMotion, Skeleton,
    SkeletonError, Take, Tracks, Transform, seconds, side_of,
};

/// Radius of a stick, of a joint and of a marker, to the height of what moves: a finger and a wrist of a person, and a ball
/// that is still seen where the whole of a stage is.
const STICK: f32 = 0.008;
const JOINT: f32 = 0.014;
const MARKER: f32 = 0.012;
/// Length of the axes of a body, likewise: a hand.
const AXIS: f32 = 0.06;
/// What is not seen is so small; nothing at all would be no place.
const HIDDEN: f32 = 1e-4;
/// Frames that say where a performance takes place.
const LOOKED_AT: usize = 128;

/// Why motion cannot be shown.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SticksError {
    /// Nothing has a place.
    #[error("nothing is seen in any frame")]
    Nothing,
    /// Joints that are none.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// Times that are none.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// A frame that cannot be.
    #[error(transparent)]
    Pose(#[from] PoseError),
}

/// Colours: of the left, of the right, of what is in the middle, of the floor; of x, y and z.
const COLOURS: [[f32; 3]; 7] = [
    [0.62, 0.16, 0.07],
    [0.07, 0.22, 0.55],
    [0.10, 0.09, 0.08],
    [0.30, 0.30, 0.30],
    [0.60, 0.05, 0.05],
    [0.05, 0.45, 0.05],
    [0.05, 0.08, 0.60],
];
const FLOOR: MaterialId = 3;
const AXES: MaterialId = 4;

/// Which of the colours a name means.
fn colour_of(name: &str) -> MaterialId {
    match side_of(name) {
        BodySide::Left => 0,
        BodySide::Right => 1,
        BodySide::Middle => 2,
    }
}

impl Scene {
    /// A skeleton as sticks, its movement as an animation.
    ///
    /// # Errors
    /// Where a frame has joints at no place.
    pub fn of_skeleton(moved: &SkeletalMotion) -> Result<Self, SticksError> {
        let frames = moved.frames.max(1);
        let looked = frames.min(LOOKED_AT);
        let mut bounds = Bounds::default();
        for i in 0..looked {
            let joints = moved.skeleton.to_skeleton(&moved.pose(i * frames / looked))?;
            bounds.frame(joints.iter().map(|j| j.w_axis.truncate()));
        }
        let mut stage = Stage::new(bounds)?;
        let first = moved.pose(0);
        for (i, joint) in moved.skeleton.joints().iter().enumerate() {
            let colour = colour_of(&joint.name);
            stage.ball(i, &joint.name, JOINT, colour);
            // As it is in the first frame: some files move joints that never move.
            let to = first.placements.get(i).map_or(Vec3::ZERO, |p| p.matrix().w_axis.truncate());
            if let Some(parent) = joint.parent {
                stage.stick(parent, &joint.name, to, STICK, colour);
            }
        }
        stage.scene(moved.skeleton.clone(), moved.clip.clone())
    }

    /// Markers as balls and rigid bodies as axes (x red, y green, z blue); what is not seen is hidden.
    ///
    /// # Errors
    /// Where nothing is ever seen.
    pub fn of_take(take: &Take) -> Result<Self, SticksError> {
        let (frames, mut bounds) = (take.frames(), Bounds::default());
        let looked = frames.min(LOOKED_AT);
        for i in 0..looked {
            bounds.frame(take.points(i * frames / looked));
        }
        let mut stage = Stage::new(bounds)?;
        let (mut joints, mut clip) = (Vec::new(), Clip { name: "take".into(), channels: Vec::new() });
        let rest = Placement::Parts(Transform { scale: Vec3::splat(HIDDEN), ..Transform::IDENTITY });
        let start = take.markers.start.min(take.bodies.start);
        for track in &take.markers.tracks {
            let places: Vec<Option<Transform>> = track
                .samples
                .iter()
                .map(|s| s.map(|p| Transform { translation: p, ..Transform::IDENTITY }))
                .collect();
            stage.ball(joints.len(), &track.name, MARKER, colour_of(&track.name));
            follow(&mut clip, joints.len(), &take.markers, &places, start)?;
            joints.push(Joint { name: track.name.clone(), parent: None, rest });
        }
        for track in &take.bodies.tracks {
            let place = |p: yugen_motion::RigidPose| Transform {
                translation: p.position,
                rotation: p.rotation,
                scale: Vec3::ONE,
            };
            let places: Vec<Option<Transform>> = track.samples.iter().map(|s| s.map(place)).collect();
            stage.ball(joints.len(), &track.name, JOINT, colour_of(&track.name));
            for axis in 0..3 {
                let to = Vec3::AXES[axis] * AXIS * stage.height;
                stage.stick(joints.len(), &track.name, to, 0.5 * STICK, AXES + axis);
            }
            follow(&mut clip, joints.len(), &take.bodies, &places, start)?;
            joints.push(Joint { name: track.name.clone(), parent: None, rest });
        }
        stage.scene(Skeleton::new(joints)?, clip)
    }
}

/// Moves a joint to the places that are known; in between it stays and is hidden.
fn follow<T>(
    clip: &mut Clip,
    joint: usize,
    tracks: &Tracks<T>,
    places: &[Option<Transform>],
    start: f64,
) -> Result<(), CurveError> {
    if places.is_empty() {
        return Ok(());
    }
    let begin = ((tracks.start - start).max(0.0) * tracks.rate).round() as usize;
    let times: Vec<f32> = (0..places.len()).map(|f| seconds(begin + f, tracks.rate)).collect();
    let known = places.iter().flatten().next().copied().unwrap_or(Transform::IDENTITY);
    let filled: Vec<Transform> = places
        .iter()
        .scan(known, |last, place| {
            *last = place.unwrap_or(*last);
            Some(*last)
        })
        .collect();
    let mut rotations: Vec<glam::Quat> = filled.iter().map(|t| t.rotation).collect();
    yugen_motion::continuous(&mut rotations);
    let mut add = |property, interpolation, values: Vec<f32>| {
        clip.channels.push((joint, Curve::new(property, interpolation, times.clone(), values)?));
        Ok(())
    };
    let translations = filled.iter().flat_map(|t| t.translation.to_array()).collect();
    add(Property::Translation, Interpolation::Linear, translations)?;
    add(Property::Rotation, Interpolation::Linear, rotations.iter().flat_map(|q| q.to_array()).collect())?;
    let scales = places.iter().flat_map(|p| [if p.is_some() { 1.0 } else { HIDDEN }; 3]).collect();
    add(Property::Scale, Interpolation::Step, scales)
}

/// Where everything is in all frames, and how high it is in one.
#[derive(Default)]
struct Bounds {
    around: Option<[Vec3; 2]>,
    heights: Vec<f32>,
}

impl Bounds {
    fn frame(&mut self, points: impl Iterator<Item = Vec3>) {
        let boxes = points.filter(|p| p.is_finite()).map(|p| [p, p]);
        let join = |a: [Vec3; 2], b: [Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        if let Some(one) = boxes.reduce(join) {
            self.heights.push((one[1] - one[0]).max_element());
            self.around = Some(self.around.map_or(one, |all| join(all, one)));
        }
    }
}

/// Shapes as they are added to joints.
struct Stage {
    scene: Scene,
    attachments: Vec<Attachment>,
    low: Vec3,
    high: Vec3,
    height: f32,
}

impl Stage {
    fn new(mut bounds: Bounds) -> Result<Self, SticksError> {
        let [low, high] = bounds.around.ok_or(SticksError::Nothing)?;
        bounds.heights.sort_by(f32::total_cmp);
        let height = bounds.heights.get(bounds.heights.len() / 2).copied().unwrap_or(1.0).max(1e-3);
        let materials = COLOURS.iter().map(|c| Material::lambert(Value::Rgb(Vec3::from(*c)))).collect();
        let scene = Scene { materials, ..Scene::default() };
        Ok(Self { scene, attachments: Vec::new(), low, high, height })
    }

    fn add(&mut self, joint: usize, name: &str, geometry: Geometry, to_joint: Mat4, colour: MaterialId) {
        let shape = self.scene.shapes.len();
        self.scene.shapes.push(Shape::new(name, geometry, to_joint, colour));
        self.attachments.push(Attachment { joint, part: Part::Shape { shape, to_joint, flips: false } });
    }

    /// At a joint, of a radius to the height.
    fn ball(&mut self, joint: usize, name: &str, radius: f32, colour: MaterialId) {
        let to_joint = Mat4::from_scale(Vec3::splat(radius * self.height));
        self.add(joint, name, Geometry::Sphere, to_joint, colour);
    }

    /// From a joint to a point in its coordinates; none to where it is itself.
    fn stick(&mut self, joint: usize, name: &str, to: Vec3, radius: f32, colour: MaterialId) {
        let length = to.length();
        if length < 1e-4 * self.height || !length.is_finite() {
            return;
        }
        let radius = radius * self.height;
        let frame = look_along(Vec3::ZERO, to, to.any_orthogonal_vector());
        let to_joint = frame * Mat4::from_scale(Vec3::new(radius, radius, length));
        self.add(joint, name, Geometry::Cylinder, to_joint, colour);
    }

    /// With a floor under all of the performance, cameras and light.
    fn scene(mut self, skeleton: Skeleton, clip: Clip) -> Result<Scene, SticksError> {
        let (low, high, height) = (self.low, self.high, self.height);
        // A floor that the feet nearly touch is that of the world.
        let floor = if low.y.abs() < 0.1 * height { 0.0 } else { low.y };
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) + Vec3::splat(0.3 * height));
        let to_world = Mat4::from_translation(middle.with_y(floor))
            * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2)
            * Mat4::from_scale(Vec3::new(half.x, half.z, 1.0));
        let to_world = to_world * Mat4::from_translation(Vec3::Z * -1e-3 * height);
        self.scene.shapes.push(Shape::new("floor", Geometry::Rectangle, to_world, FLOOR));

        // The box of the whole performance is what cameras see.
        let mut around = Scene::default();
        let block = Arc::new(crate::primitives::block(Vec3::ONE));
        let place =
            Mat4::from_translation(middle) * Mat4::from_scale(2.0 * half.with_y(0.5 * (high.y - low.y)));
        around.shapes.push(Shape::new("around", Geometry::Mesh(block), place, 0));
        self.scene.cameras.push(Camera { name: "view".into(), ..around.framing_camera(Film::default()) });
        let wide = half
            .x
            .max(half.z)
            .max(half.y * self.scene.cameras[0].film.width as f32 / self.scene.cameras[0].film.height as f32);
        let far = 2.0 * half.length();
        for (name, direction) in [("front", -Vec3::Z), ("side", -Vec3::X), ("back", Vec3::Z)] {
            let frame = look_along(middle - direction * far, direction, Vec3::Y);
            self.scene.cameras.push(Camera {
                name: name.into(),
                to_world: frame * Mat4::from_scale(Vec3::new(wide, wide, 1.0)),
                projection: Projection::Orthographic,
                near_far: [0.01 * far, 3.0 * far],
                film: Film::default(),
                samples_per_pixel: 64,
            });
        }
        self.scene.add_default_light();
        self.scene.figures.push(Arc::new(Figure {
            to_world: Mat4::IDENTITY,
            skeleton,
            clips: vec![clip],
            skins: Vec::new(),
            attachments: self.attachments,
            deformed: Vec::new(),
        }));
        self.scene.pose(None, 0.0)?;
        Ok(self.scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;
    use yugen_motion::{RigidPose, Track, sampled};

    #[test]
    fn sticks_reach_from_joint_to_joint() {
        let joint = |parent, t| Joint {
            name: "bone".into(),
            parent,
            rest: Placement::Parts(Transform { translation: t, ..Transform::IDENTITY }),
        };
        let skeleton =
            Skeleton::new(vec![joint(None, Vec3::Y), joint(Some(0), Vec3::X), joint(Some(1), Vec3::Y)]);
        let turn = Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let values = [Quat::IDENTITY, turn].iter().flat_map(|q| q.to_array()).collect();
        let clip = sampled("bend".into(), 10.0, [(0, Property::Rotation, values)]).unwrap();
        let moved = SkeletalMotion { skeleton: skeleton.unwrap(), clip, rate: 10.0, frames: 2 };
        let mut scene = Scene::of_skeleton(&moved).unwrap();
        // Three balls, two sticks, a floor.
        assert_eq!(scene.shapes.len(), 6);
        scene.pose(None, 0.1).unwrap();
        let joints = moved.skeleton.to_skeleton(&moved.pose(1)).unwrap();
        let at = |i: usize| joints[i].w_axis.truncate();
        let sticks: Vec<&Shape> =
            scene.shapes.iter().filter(|s| matches!(s.geometry, Geometry::Cylinder)).collect();
        for (stick, [from, to]) in sticks.iter().zip([[0, 1], [1, 2]]) {
            let ends = [Vec3::ZERO, Vec3::Z].map(|p| stick.to_world.transform_point3(p));
            assert!(ends[0].distance(at(from)) < 1e-5 && ends[1].distance(at(to)) < 1e-5, "{ends:?}");
        }
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["view", "front", "side", "back"]);
    }

    #[test]
    fn what_is_not_seen_is_hidden() {
        let mut take = Take::default();
        let marker = Track { samples: vec![Some(Vec3::X), None, Some(Vec3::Y)], ..Track::new("toe") };
        take.markers = Tracks { rate: 10.0, start: 3.0, frames: 3, tracks: vec![marker] };
        let pose = RigidPose { position: Vec3::Z, rotation: Quat::IDENTITY };
        let body = Track { samples: vec![None, Some(pose), Some(pose)], ..Track::new("fan") };
        take.bodies = Tracks { rate: 10.0, start: 3.0, frames: 3, tracks: vec![body] };
        let mut scene = Scene::of_take(&take).unwrap();
        let mut size = |seconds: f32, shape: usize| {
            scene.pose(None, seconds).unwrap();
            scene.shapes[shape].to_world.x_axis.length()
        };
        assert!(size(0.1, 0) < 1e-3 * size(0.0, 0) && size(0.2, 0) == size(0.0, 0));
        assert!(size(0.0, 1) < 1e-3 * size(0.1, 1));
        assert_eq!(Scene::of_take(&Take::default()).unwrap_err(), SticksError::Nothing);
    }
}
