//! What moves in a scene: figures, posed by their clips.

use crate::cache::CACHE;
use crate::fire::burn;
use crate::{Geometry, Light, Mesh, Scene, suggest};
use glam::{Mat4, Vec3};
use std::sync::Arc;
use yugen_motion::fire::FireError;
use yugen_motion::{Clip, Influences, MorphTarget, Pose, Skeleton, SkeletonError, Skin, Vertices};

/// The animation of fires alone.
const FIRE: &str = "fire";
/// So much of it is played, s.
const MINUTE: [f32; 2] = [0.0, 60.0];

/// A skeleton, its clips, and what of the scene moves with it.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Coordinates of the skeleton to the world.
    pub to_world: Mat4,
    /// Joints.
    pub skeleton: Skeleton,
    /// Its movements; at least one.
    pub clips: Vec<Clip>,
    /// What deforms meshes.
    pub skins: Vec<Skin>,
    /// What joints carry as it is.
    pub attachments: Vec<Attachment>,
    /// Meshes that its skins and the weights of its joints deform.
    pub deformed: Vec<DeformedMesh>,
}

/// A part of a scene that a joint carries.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// Which joint.
    pub joint: usize,
    /// What.
    pub part: Part,
}

/// What a joint may carry.
#[derive(Clone, Debug)]
pub enum Part {
    /// A shape.
    Shape {
        /// Index in the scene.
        shape: usize,
        /// Its coordinates to those of the joint.
        to_joint: Mat4,
        /// A joint that mirrors does not turn its triangles round (glTF 2.0, 3.7.2.1), and without vertex normals only
        /// the winding tells their side: the shape is flipped while it is mirrored.
        flips: bool,
    },
    /// A camera, which follows without scale.
    Camera {
        /// Index in the scene.
        camera: usize,
        /// Its coordinates to those of the joint.
        to_joint: Mat4,
    },
    /// A light, which follows without scale.
    Light {
        /// Index in the scene.
        light: usize,
        /// As it is in the coordinates of the joint.
        own: Light,
    },
}

/// A mesh that morph targets and joints deform, of one shape of the scene.
#[derive(Clone, Debug)]
pub struct DeformedMesh {
    /// Index in the scene; a mesh.
    pub shape: usize,
    /// The joint that has its weights.
    pub joint: usize,
    /// Before anything deforms it.
    pub rest: Arc<Mesh>,
    /// Those of its targets while no clip has any for its joint.
    pub weights: Vec<f32>,
    /// Added by weights.
    pub targets: Vec<MorphTarget>,
    /// Then moved by joints of this skin of the figure.
    pub skin: Option<(usize, Influences)>,
}

/// Why a scene cannot be posed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// Nothing moves.
    #[error(
        "nothing in it moves: it has no animation, as a glTF file may have, no cache of a simulation and no fire"
    )]
    Still,
    /// A clip that nobody has.
    #[error("there is no animation called '{name}'{hint}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// What was probably meant, as the end of the sentence.
        hint: String,
    },
    /// The moment is not a number.
    #[error("a scene cannot be posed at {0} seconds; give a number")]
    Moment(String),
    /// A pose that is none.
    #[error("at {seconds} seconds of its animation {source}")]
    Skeleton {
        /// When.
        seconds: String,
        /// What of it.
        source: SkeletonError,
    },
    /// A fire that cannot be.
    #[error(transparent)]
    Fire(#[from] FireError),
    /// A mesh is torn.
    #[error("at {seconds} seconds of its animation shape '{shape}' has vertices that are not finite")]
    NotFinite {
        /// When.
        seconds: String,
        /// Its name.
        shape: String,
    },
}

impl Scene {
    /// Whether [`Scene::pose`] moves anything.
    pub fn moves(&self) -> bool {
        !self.figures.is_empty() || !self.caches.is_empty() || !self.fires.is_empty()
    }

    /// The animations: names, and seconds of their first and last key. One that several figures have counts once. Where
    /// there are no figures, the caches, called `cache`; without these a minute of the fires, called `fire`.
    pub fn clips(&self) -> Vec<(String, [f32; 2])> {
        let mut all: Vec<(String, [f32; 2])> = self.without_figures().into_iter().collect();
        for clip in self.figures.iter().flat_map(|f| &f.clips) {
            let [first, last] = self.with_caches(clip.span());
            match all.iter_mut().find(|(name, _)| *name == clip.name) {
                Some((_, span)) => *span = [span[0].min(first), span[1].max(last)],
                None => all.push((clip.name.clone(), [first, last])),
            }
        }
        all
    }

    /// Seconds of the first and the last key of what [`Scene::pose`] plays by this name, of all figures together; `None`
    /// where it plays nothing.
    pub fn clip_span(&self, clip: Option<&str>) -> Option<[f32; 2]> {
        if let Some((name, span)) = self.without_figures() {
            return clip.is_none_or(|asked| asked == name).then_some(span);
        }
        let played = self.figures.iter().filter_map(|f| Some(f.clips[f.plays(clip)?].span()));
        played.reduce(both).map(|span| self.with_caches(span))
    }

    /// A span and those of the caches, which play along.
    fn with_caches(&self, span: [f32; 2]) -> [f32; 2] {
        self.caches.iter().map(|c| c.span()).fold(span, both)
    }

    /// Moves every figure to where its animation called `clip` takes it at `seconds`; each to its first where no name is
    /// given. A figure that has none of this name stays as it is. Before an animation begins and after it ends it stands
    /// still; caches and fires play whatever else plays, and fires have no end. Shapes keep their numbers; a mesh that deforms
    /// is another one afterwards. After an error some of it may have moved; another pose puts all in its place.
    pub fn pose(&mut self, clip: Option<&str>, seconds: f32) -> Result<(), PoseError> {
        if !self.moves() {
            return Err(PoseError::Still);
        }
        if !seconds.is_finite() {
            return Err(PoseError::Moment(seconds.to_string()));
        }
        self.seconds = seconds.into();
        let playing: Vec<Option<usize>> = self.figures.iter().map(|f| f.plays(clip)).collect();
        if playing.iter().all(Option::is_none) && self.clip_span(clip).is_none() {
            let name = clip.unwrap_or_default().to_string();
            let clips = self.clips();
            let hint = suggest(&name, clips.iter().map(|(name, _)| name.as_str()));
            return Err(PoseError::Unknown { name, hint });
        }
        let figures = std::mem::take(&mut self.figures);
        let mut posed = Ok(());
        for (figure, clip) in figures.iter().zip(playing) {
            if let (Some(clip), true) = (clip, posed.is_ok()) {
                let pose = figure.clips[clip].pose(&figure.skeleton, seconds);
                posed = figure.apply(&pose, seconds, self);
            }
        }
        self.figures = figures;
        posed?;
        for cache in self.caches.clone() {
            cache.play(seconds.into(), self);
        }
        let fires = std::mem::take(&mut self.fires);
        let burning = burn(&fires, seconds.into(), self);
        self.fires = fires;
        Ok(burning?)
    }

    /// The animation of a scene without figures.
    fn without_figures(&self) -> Option<(String, [f32; 2])> {
        if !self.figures.is_empty() {
            return None;
        }
        let caches = self.caches.iter().map(|c| c.span()).reduce(both);
        let fire = || (!self.fires.is_empty()).then(|| (FIRE.to_string(), MINUTE));
        caches.map(|span| (CACHE.to_string(), span)).or_else(fire)
    }
}

/// From the earlier beginning to the later end.
fn both(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl Figure {
    /// Index of the clip that it plays by a name; its first where no name is given, `None` where it has none.
    pub fn plays(&self, clip: Option<&str>) -> Option<usize> {
        match clip {
            None => (!self.clips.is_empty()).then_some(0),
            Some(name) => self.clips.iter().position(|c| c.name == name),
        }
    }

    /// The figure in another scene that has its shapes, in their order, from `first_shape` on, placed by `to_world`; cameras
    /// and lights stay behind.
    pub fn adopted(mut self, first_shape: usize, to_world: Mat4) -> Self {
        self.to_world = to_world * self.to_world;
        self.attachments.retain(|c| matches!(c.part, Part::Shape { .. }));
        for attachment in &mut self.attachments {
            if let Part::Shape { shape, .. } = &mut attachment.part {
                *shape += first_shape;
            }
        }
        self.deformed.iter_mut().for_each(|deformed| deformed.shape += first_shape);
        self
    }

    fn apply(&self, pose: &Pose, seconds: f32, scene: &mut Scene) -> Result<(), PoseError> {
        let wrong = |source| PoseError::Skeleton { seconds: seconds.to_string(), source };
        let joints = self.skeleton.to_skeleton(pose).map_err(wrong)?;
        for Attachment { joint, part } in &self.attachments {
            let to_world = joints[*joint];
            match part {
                Part::Shape { shape, to_joint, flips } => {
                    let shape = &mut scene.shapes[*shape];
                    let was = shape.to_world.determinant() < 0.0;
                    shape.to_world = self.to_world * (to_world * *to_joint);
                    shape.flip_normals ^= *flips && was != (shape.to_world.determinant() < 0.0);
                }
                Part::Camera { camera, to_joint } => {
                    scene.cameras[*camera].to_world = rigid(self.to_world * to_world) * *to_joint;
                }
                Part::Light { light, own } => {
                    scene.lights[*light] = own.carried_by(rigid(self.to_world * to_world));
                }
            }
        }
        let skins: Vec<Vec<Mat4>> = self.skins.iter().map(|s| s.matrices(&joints)).collect();
        for deformed in &self.deformed {
            let weights = pose.weights.get(&deformed.joint).unwrap_or(&deformed.weights);
            let mesh = deformed.posed(weights, &skins);
            let shape = &mut scene.shapes[deformed.shape];
            if mesh.positions.iter().any(|p| !p.is_finite()) {
                let (seconds, shape) = (seconds.to_string(), shape.name.clone());
                return Err(PoseError::NotFinite { seconds, shape });
            }
            shape.geometry = Geometry::Mesh(Arc::new(mesh));
        }
        Ok(())
    }
}

impl DeformedMesh {
    /// The mesh with these weights of its targets and these matrices of the joints of each skin.
    pub fn posed(&self, weights: &[f32], skins: &[Vec<Mat4>]) -> Mesh {
        let Mesh { name, positions, normals, uvs, tangents, attributes, triangles } = &*self.rest;
        let mut vertices =
            Vertices { positions: positions.clone(), normals: normals.clone(), tangents: tangents.clone() };
        vertices.morph(&self.targets, weights);
        if let Some((skin, influences)) = &self.skin {
            vertices.skin(influences, &skins[*skin]);
        }
        vertices.normalize();
        Mesh {
            name: name.clone(),
            positions: vertices.positions,
            normals: vertices.normals,
            tangents: vertices.tangents,
            uvs: uvs.clone(),
            attributes: attributes.clone(),
            triangles: triangles.clone(),
        }
    }
}

/// Rotation and translation without scale or shear: z stays, y is turned upright to it.
pub fn rigid(m: Mat4) -> Mat4 {
    let z = m.z_axis.truncate().normalize_or(Vec3::Z);
    let x = m.y_axis.truncate().cross(z).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), m.w_axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, Film, Projection, Shape};
    use glam::{Quat, Vec4};
    use yugen_motion::{Curve, Interpolation, Joint, Placement, Property, Transform};

    fn curve(property: Property, values: &[f32]) -> Curve {
        Curve::new(property, Interpolation::Linear, vec![0.0, 1.0], values.to_vec()).unwrap()
    }

    fn triangle() -> Arc<Mesh> {
        Arc::new(Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        })
    }

    /// An arm that carries a flat shape, a camera and a light, and a mesh that it deforms.
    fn scene() -> Scene {
        let rest = Placement::Parts(Transform::IDENTITY);
        let joint = |parent| Joint { name: "arm".into(), parent, rest };
        let half = 0.5f32.sqrt();
        let clip = Clip {
            name: "wave".into(),
            channels: vec![
                (0, curve(Property::Translation, &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0])),
                // A quarter turn about y.
                (1, curve(Property::Rotation, &[0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half])),
                (1, curve(Property::Weights, &[0.0, 2.0])),
                // Mirrored in the end.
                (2, curve(Property::Scale, &[1.0, 1.0, 1.0, -1.0, 1.0, 1.0])),
            ],
        };
        let part = |joint, part| Attachment { joint, part };
        let to_joint = Mat4::from_translation(Vec3::Z);
        let figure = Figure {
            to_world: Mat4::from_translation(Vec3::Y * 10.0),
            skeleton: Skeleton::new(vec![joint(None), joint(Some(0)), joint(Some(0))]).unwrap(),
            clips: vec![clip],
            skins: vec![Skin { joints: vec![1], inverse_bind: Vec::new() }],
            attachments: vec![
                part(2, Part::Shape { shape: 0, to_joint, flips: true }),
                part(1, Part::Camera { camera: 0, to_joint }),
                part(
                    1,
                    Part::Light {
                        light: 0,
                        own: Light::Directional { direction: -Vec3::Z, irradiance: Vec3::ONE },
                    },
                ),
            ],
            deformed: vec![DeformedMesh {
                shape: 1,
                joint: 1,
                rest: triangle(),
                weights: vec![0.0],
                targets: vec![MorphTarget { positions: vec![Vec3::X; 3], ..MorphTarget::default() }],
                skin: Some((0, Influences::new(1, vec![0; 3], vec![1.0; 3], 3, 1).unwrap())),
            }],
        };
        let shape = |name: &str| Shape::new(name, Geometry::Mesh(triangle()), Mat4::IDENTITY, 0);
        let camera = Camera {
            name: "camera".into(),
            to_world: Mat4::IDENTITY,
            projection: Projection::Orthographic,
            near_far: [0.1, 10.0],
            film: Film::default(),
            samples_per_pixel: 1,
        };
        Scene {
            cameras: vec![camera],
            shapes: vec![shape("flag"), shape("sleeve")],
            lights: vec![Light::Constant { radiance: Vec3::ONE }],
            figures: vec![Arc::new(figure)],
            ..Scene::default()
        }
    }

    #[test]
    fn a_pose_moves_what_the_joints_carry() {
        let mut scene = scene();
        scene.pose(Some("wave"), 1.0).unwrap();
        // The root has gone 4 along x, and the figure stands 10 up.
        let flag = &scene.shapes[0];
        assert_eq!(flag.to_world.transform_point3(Vec3::X), Vec3::new(3.0, 10.0, 1.0));
        assert!(flag.flip_normals, "mirrored");
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-5, "{a} {b}");
        near(scene.cameras[0].to_world.w_axis.truncate(), Vec3::new(5.0, 10.0, 0.0));
        let Light::Directional { direction, .. } = scene.lights[0] else { panic!("the light is carried") };
        near(direction, -Vec3::X);
        // Moved by its target first, then turned; its normals as well.
        let Geometry::Mesh(sleeve) = &scene.shapes[1].geometry else { panic!() };
        near(sleeve.positions[1], Vec3::new(4.0, 0.0, -3.0));
        near(sleeve.normals[1], Quat::from_rotation_y(std::f32::consts::FRAC_PI_2) * Vec3::Z);
        // Back again it is as it was, whatever was before.
        let mut twice = scene.clone();
        for t in [0.0, 0.3, 1.0, 0.0] {
            twice.pose(None, t).unwrap();
        }
        assert!(!twice.shapes[0].flip_normals);
        let mut first = super::tests::scene();
        first.pose(None, 0.0).unwrap();
        assert_eq!(first.parts(), twice.parts());
        assert_ne!(first.parts(), scene.parts());
    }

    #[test]
    fn poses_that_cannot_be_are_refused_in_words() {
        let said = |mut scene: Scene, clip: Option<&str>, t| scene.pose(clip, t).unwrap_err().to_string();
        assert!(said(Scene::default(), None, 0.0).contains("nothing in it moves"));
        assert!(said(scene(), Some("wafe"), 0.0).contains("did you mean 'wave'?"));
        assert!(said(scene(), None, f32::NAN).contains("at NaN seconds"));
        let mut torn = scene();
        Arc::make_mut(&mut torn.figures[0]).clips[0].channels[0].1 =
            curve(Property::Translation, &[f32::NAN; 6]);
        assert!(said(torn, None, 0.5).contains("joint 0 ('arm') is not finite"));
        let mut torn = scene();
        Arc::make_mut(&mut torn.figures[0]).clips[0].channels[2].1 =
            curve(Property::Weights, &[0.0, f32::MAX]);
        Arc::make_mut(&mut torn.figures[0]).deformed[0].targets[0].positions = vec![Vec3::splat(f32::MAX); 3];
        assert!(said(torn, None, 1.0).contains("'sleeve' has vertices that are not finite"));
    }

    #[test]
    fn an_adopted_figure_moves_the_shapes_of_its_new_scene() {
        let mut host =
            Scene { shapes: vec![Shape::new("floor", Geometry::Rectangle, Mat4::IDENTITY, 0)], ..scene() };
        let Scene { shapes, figures, .. } = scene();
        let to_world = Mat4::from_translation(Vec3::Z * 7.0);
        let first = host.shapes.len();
        host.shapes.extend(shapes);
        host.figures =
            figures.into_iter().map(|f| Arc::new(Arc::unwrap_or_clone(f).adopted(first, to_world))).collect();
        let (floor, camera) = (host.shapes[0].to_world, host.cameras[0].to_world);
        host.pose(None, 1.0).unwrap();
        assert_eq!((host.shapes[0].to_world, host.cameras[0].to_world), (floor, camera));
        assert_eq!(host.shapes[1].to_world.transform_point3(Vec3::X), Vec3::new(3.0, 10.0, 8.0));
    }

    #[test]
    fn rows_take_over_a_pose_as_if_made_for_it() {
        use crate::prepared::Rows;
        use crate::{ModelBuilder, Value};
        use yugen_reflectance::Kind;
        let mut scene = scene();
        scene.materials.push(ModelBuilder::new(Kind::Lambert).build().unwrap());
        scene.shapes[0].emission = Some(Value::Rgb(Vec3::new(3.0, 2.0, 1.0)));
        let sky = yugen_optics::Image {
            data: vec![0.5; 4 * 3 * 3],
            ..yugen_optics::Image::new(4, 3, &["R", "G", "B"])
        };
        let to_world = Mat4::from_rotation_x(0.3);
        scene.add_light("sky", Light::Environment { image: Arc::new(sky), scale: 2.0, to_world });
        scene.pose(None, 0.0).unwrap();
        let mut rows = Rows::new(&scene).unwrap();
        let first = rows.clone();
        for t in [0.6, 1.0, 0.0] {
            scene.pose(None, t).unwrap();
            rows.pose(&scene).unwrap();
            let new = Rows::new(&scene).unwrap();
            let same = |rows: &Rows, other: &Rows| {
                let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                rows.vertices == other.vertices
                    && rows.draws == other.draws
                    && rows.words == other.words
                    && bits(&rows.numbers) == bits(&other.numbers)
                    && rows.texels == other.texels
                    && (rows.lights, rows.emitters) == (other.lights, other.emitters)
            };
            assert!(same(&rows, &new), "at {t}");
            assert_eq!(same(&rows, &first), t == 0.0);
        }
        scene.lights.pop();
        assert!(rows.pose(&scene).unwrap_err().to_string().contains("another scene is no pose"));
    }
}
