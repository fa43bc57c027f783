//! glTF 2.0 and GLB. Khronos Group 2021, "glTF 2.0 Specification", with the extensions of [`FEATURES`].
//!
//! Materials become the model `metallic_roughness`. Skinned and morphed meshes are read in the pose of the
//! file's nodes and weights; where the file has animations, all of its nodes become one [`Figure`], which poses them
//! ([`Scene::pose`]). Photometric numbers are taken as radiometric ones: a candela as 1 W/sr, a lux as 1 W/m², so that lights and emission keep their proportions. A file without a
//! camera gets one that sees everything, one without lights (surfaces that glow are none) a sun and a sky
//! ([`Scene::framing_camera`], [`Scene::add_default_light`]).

mod animation;
mod document;
mod features;
mod materials;
mod meshopt;
mod outside;
mod schema;
#[cfg(test)]
mod tests;
mod write;

use super::Options;
use super::folders::Folders;
use crate::Error;
use document::Document;
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use schema::{CameraEntry, LightEntry, Node, Primitive};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use yugen_motion::{
    Clip, Influences, Joint, MorphTarget, Placement, Property, Skeleton, Skin, Transform, Vertices,
};
use yugen_optics::{ColourSpace, Image};
use yugen_scene::{
    Attachment, Camera, DeformedMesh, Figure, Film, FovAxis, Geometry, Light, MaterialId, Mesh,
};
use yugen_scene::{Part, Projection, Scene, Shape, Value, rigid};

pub use features::FEATURES;
pub use write::{write, write_bytes};

/// Attributes of meshes with colours.
const VERTEX_COLOR: &str = "vertex_color";
const VERTEX_ALPHA: &str = "vertex_alpha";

/// The most vertices of all meshes together: few bytes of a file may stand for many of them.
const MAX_VERTICES: usize = 1 << 26;
/// The most shapes.
const MAX_SHAPES: usize = 1 << 20;
/// The most samples of all pictures together: two gibibytes.
const MAX_SAMPLES: u64 = 1 << 29;

/// Reads a scene from the bytes of a file, in linear Rec. 2020; the path names it in messages and says where
/// its files lie.
pub fn read(bytes: &[u8], path: &Path, options: &Options) -> Result<Scene, Error> {
    let folders = Folders::new(path, &options.folders, None)?;
    let mut scene = read_into(ColourSpace::default(), bytes, path, &folders)?;
    if scene.cameras.is_empty() {
        let camera = scene.framing_camera(Film::default());
        scene.cameras.push(camera);
    }
    // Surfaces that glow are not what lights a scene: a label that is unlit, a screen, a dial.
    if scene.lights.is_empty() && !scene.is_empty() {
        scene.add_default_light();
    }
    Ok(scene)
}

/// Reads what is in a file, with the colours in `space`, and adds nothing.
pub(crate) fn read_into(
    space: ColourSpace,
    bytes: &[u8],
    path: &Path,
    folders: &Folders,
) -> Result<Scene, Error> {
    let folders = folders.inside(path);
    let doc = Document::read(bytes, path, &folders)?;
    features::check(&doc)?;
    let clips = animation::clips(&doc)?;
    let reader = Reader {
        doc: &doc,
        moving: Moving::of(&clips),
        skins: Vec::new(),
        attachments: Vec::new(),
        deformed: Vec::new(),
        folders,
        scene: Scene { working_space: space, ..Scene::default() },
        images: HashMap::new(),
        samples_left: MAX_SAMPLES,
        vertices_left: MAX_VERTICES,
        materials: HashMap::new(),
        places: HashMap::new(),
        uv_sets: Vec::new(),
    };
    reader.scene(clips)
}

/// A material in the scene and what a shape of it has to know.
#[derive(Clone)]
struct Finish {
    id: MaterialId,
    emission: Option<Value>,
    double_sided: bool,
    /// Not shown from behind.
    culled: bool,
    /// Which of the mesh's sets of (u, v) the textures use, if there are any: the first is the mesh's own, the others
    /// are attributes.
    uv_sets: Vec<usize>,
}

/// A mesh that stands in several places.
enum Copies {
    /// Of [`Scene::groups`].
    Instances(usize),
    /// Shapes that glow, and have to be placed one by one.
    Each(Vec<Shape>),
}

/// What animations of a file move besides places.
#[derive(Default)]
struct Moving {
    /// Whether there are any.
    any: bool,
    /// Nodes whose weights change.
    weights: BTreeSet<usize>,
    /// Nodes whose scale changes, or that of a node which carries them, and so maybe what it mirrors.
    scales: BTreeSet<usize>,
}

impl Moving {
    fn of(clips: &[Clip]) -> Self {
        let mut moving = Self { any: !clips.is_empty(), ..Self::default() };
        for (node, curve) in clips.iter().flat_map(|c| &c.channels) {
            match curve.property() {
                Property::Weights => moving.weights.insert(*node),
                Property::Scale => moving.scales.insert(*node),
                Property::Translation | Property::Rotation => false,
            };
        }
        moving
    }
}

/// How a mesh is deformed before it is placed.
#[derive(Clone, Copy)]
struct Deformation<'a> {
    /// Of its morph targets.
    weights: &'a [f32],
    /// Its skin among [`Reader::skins`], and the matrices of its joints.
    skin: Option<(usize, &'a [Mat4])>,
    /// Keep how, so that it can be posed anew.
    keep: bool,
}

/// A mesh at rest, and what deforms it.
type Rest = (Mesh, Vec<MorphTarget>, Option<Influences>);

struct Reader<'a> {
    doc: &'a Document,
    moving: Moving,
    skins: Vec<Skin>,
    attachments: Vec<Attachment>,
    deformed: Vec<DeformedMesh>,
    folders: Folders,
    scene: Scene,
    /// By index and whether raw.
    images: HashMap<(usize, bool), Arc<Image>>,
    samples_left: u64,
    vertices_left: usize,
    /// By index (none is the default material) and how many numbers the colour of a vertex has.
    materials: HashMap<(Option<usize>, usize), Finish>,
    /// By mesh.
    places: HashMap<usize, Copies>,
    /// Sets of (u, v) of the material that is being read.
    uv_sets: Vec<usize>,
}

impl Reader<'_> {
    fn scene(mut self, clips: Vec<Clip>) -> Result<Scene, Error> {
        let doc = self.doc;
        let nodes = &doc.root.nodes;
        let skeleton = self.skeleton()?;
        let globals = skeleton.to_skeleton(&skeleton.rest()).map_err(|e| doc.invalid(e.to_string()))?;
        let forest = (0..nodes.len()).filter(|&i| skeleton.joints()[i].parent.is_none()).collect();
        for skin in &doc.root.skins {
            self.skins.push(self.skin(skin)?);
        }
        let roots = match (&doc.root.scenes[..], doc.root.scene) {
            ([], _) => forest,
            (scenes, index) => doc.entry(scenes, index.unwrap_or(0), "scene")?.nodes.clone(),
        };
        let mut order = Vec::new();
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<usize> = roots.into_iter().rev().collect();
        while let Some(i) = stack.pop() {
            let node = doc.entry(nodes, i, "node")?;
            if !std::mem::replace(&mut seen[i], true) {
                order.push(i);
                stack.extend(node.children.iter().rev());
                if self.moving.scales.contains(&i) {
                    self.moving.scales.extend(&node.children);
                }
            }
        }

        // A mesh that stands in several places is kept once.
        let mut uses = vec![0usize; doc.root.meshes.len()];
        for &i in &order {
            if let Some(mesh) = nodes[i].mesh {
                doc.entry(&doc.root.meshes, mesh, "mesh")?;
                uses[mesh] += 1 + usize::from(nodes[i].extensions.instancing.is_some());
            }
        }
        for &i in &order {
            let (node, to_world) = (&nodes[i], globals[i]);
            if let Some(mesh) = node.mesh {
                for place in self.instances(node)? {
                    self.place_mesh(mesh, i, place, &globals, uses[mesh] > 1)?;
                }
            }
            if let Some(camera) = node.camera {
                let camera = doc.entry(&doc.root.cameras, camera, "camera")?;
                let mut camera = self.camera(camera, node)?;
                let part = Part::Camera { camera: self.scene.cameras.len(), to_joint: camera.to_world };
                camera.to_world = rigid(to_world) * camera.to_world;
                self.attachments.push(Attachment { joint: i, part });
                self.scene.cameras.push(camera);
            }
            if let Some(light) = &node.extensions.light {
                let light = doc.entry(&doc.root.extensions.lights.lights, light.light, "light")?;
                let name = if light.name.is_empty() { &node.name } else { &light.name };
                let own = self.light(light)?;
                self.scene.add_light(name, own.carried_by(rigid(to_world)));
                let part = Part::Light { light: self.scene.lights.len() - 1, own };
                self.attachments.push(Attachment { joint: i, part });
            }
        }
        if !clips.is_empty() {
            let Self { skins, attachments, deformed, .. } = self;
            let figure = Figure { to_world: Mat4::IDENTITY, skeleton, clips, skins, attachments, deformed };
            self.scene.figures.push(Arc::new(figure));
        }
        Ok(self.scene)
    }

    /// The nodes as joints of the same numbers.
    fn skeleton(&self) -> Result<Skeleton, Error> {
        let nodes = &self.doc.root.nodes;
        let mut joints: Vec<Joint> = nodes
            .iter()
            .map(|node| Joint { name: node.name.clone(), parent: None, rest: placement(node) })
            .collect();
        for (i, node) in nodes.iter().enumerate() {
            for &child in &node.children {
                self.doc.entry(nodes, child, "node")?;
                if joints[child].parent.replace(i).is_some() {
                    let problem = format!("node {child} has two parents; nodes must form trees");
                    return Err(self.doc.invalid(problem));
                }
            }
        }
        Skeleton::new(joints).map_err(|e| self.doc.invalid(e.to_string()))
    }

    fn place_mesh(
        &mut self,
        mesh: usize,
        joint: usize,
        place: Mat4,
        globals: &[Mat4],
        several: bool,
    ) -> Result<(), Error> {
        let entry = &self.doc.root.meshes[mesh];
        let node = &self.doc.root.nodes[joint];
        let name = if node.name.is_empty() { entry.name.clone() } else { node.name.clone() };
        if self.scene.shapes.len().saturating_add(entry.primitives.len()) > MAX_SHAPES {
            let (what, at) = ("the number of shapes".to_string(), self.doc.at.clone());
            return Err(Error::TooLarge { at, what, asked: MAX_SHAPES as u64 + 1, limit: MAX_SHAPES as u64 });
        }
        // A mirror or a squeezed node is fine for meshes; one without any extent shows nothing.
        let to_world = globals[joint] * place;
        let to_world = if node.skin.is_some() { Mat4::IDENTITY } else { to_world };
        let resized = self.moving.scales.contains(&joint);
        if to_world.determinant() == 0.0 && !resized {
            return Ok(());
        }
        let deforms = node.skin.is_some() || node.weights.is_some() || self.moving.weights.contains(&joint);
        if !several || deforms || resized {
            let matrices = match node.skin {
                Some(skin) => Some((skin, self.doc.entry(&self.skins, skin, "skin")?.matrices(globals))),
                None => None,
            };
            let weights = node.weights.as_deref().unwrap_or(&entry.weights);
            let skin = matrices.as_ref().map(|(skin, matrices)| (*skin, &matrices[..]));
            let shapes = self.shapes(
                &name,
                &entry.primitives,
                Deformation { weights, skin, keep: deforms && self.moving.any },
            )?;
            for (shape, rest) in shapes {
                let index = self.scene.shapes.len();
                if let Some((mesh, targets, influences)) = rest {
                    self.deformed.push(DeformedMesh {
                        shape: index,
                        joint,
                        rest: Arc::new(mesh),
                        weights: weights.to_vec(),
                        targets,
                        skin: skin.and_then(|(skin, _)| Some((skin, influences?))),
                    });
                }
                if skin.is_none() {
                    self.carry(joint, index, place, shape.face_normals);
                }
                self.scene.shapes.push(placed(shape, to_world));
            }
            return Ok(());
        }
        if !self.places.contains_key(&mesh) {
            let deformation = Deformation { weights: &entry.weights, skin: None, keep: false };
            let shapes = self.shapes(&entry.name, &entry.primitives, deformation)?;
            let shapes: Vec<Shape> = shapes.into_iter().map(|(shape, _)| shape).collect();
            let copies = if shapes.iter().any(|s| s.emission.is_some()) {
                Copies::Each(shapes)
            } else {
                self.scene.groups.push(shapes);
                Copies::Instances(self.scene.groups.len() - 1)
            };
            self.places.insert(mesh, copies);
        }
        let copies = match &self.places[&mesh] {
            Copies::Each(shapes) => shapes.iter().map(|s| placed(s.clone(), to_world)).collect(),
            Copies::Instances(group) if self.scene.groups[*group].is_empty() => Vec::new(),
            // A mirror turns flat triangles inside out, which an instance cannot undo.
            Copies::Instances(group)
                if to_world.determinant() < 0.0
                    && self.scene.groups[*group].iter().any(|s| s.face_normals) =>
            {
                self.scene.groups[*group].iter().map(|s| placed(s.clone(), to_world)).collect()
            }
            Copies::Instances(group) => vec![Shape::new(name, Geometry::Instance(*group), to_world, 0)],
        };
        for shape in copies {
            self.carry(joint, self.scene.shapes.len(), place, shape.face_normals);
            self.scene.shapes.push(shape);
        }
        Ok(())
    }

    /// Notes that a joint carries a shape.
    fn carry(&mut self, joint: usize, shape: usize, to_joint: Mat4, flips: bool) {
        self.attachments.push(Attachment { joint, part: Part::Shape { shape, to_joint, flips } });
    }

    /// Where a node's mesh stands, in the node's own coordinates: once, or as EXT_mesh_gpu_instancing says.
    fn instances(&self, node: &Node) -> Result<Vec<Mat4>, Error> {
        let Some(instancing) = &node.extensions.instancing else { return Ok(vec![Mat4::IDENTITY]) };
        let values = |name: &str, width: usize| match instancing.attributes.get(name) {
            Some(&index) => self.doc.floats(index, width),
            None => Ok(Vec::new()),
        };
        let (translations, rotations, scales) =
            (values("TRANSLATION", 3)?, values("ROTATION", 4)?, values("SCALE", 3)?);
        let counts = [translations.len() / 3, rotations.len() / 4, scales.len() / 3];
        let count = counts.into_iter().max().unwrap_or(0);
        if counts.into_iter().any(|n| n != 0 && n != count) {
            let problem = format!("EXT_mesh_gpu_instancing has attributes of different lengths: {counts:?}");
            return Err(self.doc.invalid(problem));
        }
        if count > MAX_SHAPES {
            let (what, at) = ("the number of instances".to_string(), self.doc.at.clone());
            return Err(Error::TooLarge { at, what, asked: count as u64, limit: MAX_SHAPES as u64 });
        }
        let place = |i: usize| {
            let node = Node {
                translation: translations.get(3 * i..3 * i + 3).map(|v| [v[0], v[1], v[2]]),
                rotation: rotations.get(4 * i..4 * i + 4).map(|v| [v[0], v[1], v[2], v[3]]),
                scale: scales.get(3 * i..3 * i + 3).map(|v| [v[0], v[1], v[2]]),
                ..Node::default()
            };
            placement(&node).matrix()
        };
        Ok((0..count).map(place).collect())
    }

    fn skin(&self, skin: &schema::Skin) -> Result<Skin, Error> {
        for &joint in &skin.joints {
            self.doc.entry(&self.doc.root.nodes, joint, "node")?;
        }
        let inverse_bind = match skin.inverse_bind_matrices {
            Some(index) => self.doc.floats(index, 16)?.chunks_exact(16).map(Mat4::from_cols_slice).collect(),
            None => Vec::new(),
        };
        Ok(Skin { joints: skin.joints.clone(), inverse_bind })
    }

    fn shapes(
        &mut self,
        name: &str,
        primitives: &[Primitive],
        deformation: Deformation,
    ) -> Result<Vec<(Shape, Option<Rest>)>, Error> {
        let mut shapes = Vec::new();
        for primitive in primitives {
            let mode = primitive.mode.unwrap_or(4);
            if !(4..=6).contains(&mode) {
                tracing::warn!("{}: '{name}' has points or lines, which are not shown", self.doc.at);
                continue;
            }
            if primitive.extensions.draco.is_some() {
                return Err(features::packed(self.doc, features::DRACO));
            }
            let colour = primitive.attributes.get("COLOR_0").map_or(Ok(0), |i| self.doc.width(*i))?;
            let finish = self.material(primitive.material, colour)?;
            let (mut mesh, mut rest) = self.mesh(primitive, deformation, &finish.uv_sets)?;
            for set in &finish.uv_sets {
                if !primitive.attributes.contains_key(&format!("TEXCOORD_{set}")) {
                    tracing::warn!(
                        "{}: mesh '{name}' has no TEXCOORD_{set}, which a texture of its material asks for; it lies \
                         on it anyhow",
                        self.doc.at
                    );
                }
            }
            mesh.name = name.to_string();
            mesh.triangles = self.triangles(primitive, mode, mesh.positions.len())?;
            if let Some((rest, ..)) = &mut rest {
                rest.name.clone_from(&mesh.name);
                rest.triangles.clone_from(&mesh.triangles);
            }
            let mut material = finish.id;
            if finish.culled && !outside::only_seen_from_outside(&mesh) {
                material = self.culled(material);
            }
            let shape = Shape {
                name: name.to_string(),
                // Meshes without normals are meant to be flat.
                face_normals: mesh.normals.is_empty(),
                geometry: Geometry::Mesh(Arc::new(mesh)),
                to_world: Mat4::IDENTITY,
                flip_normals: false,
                material,
                emission: finish.emission.clone(),
                two_sided_emission: finish.double_sided,
            };
            shapes.push((shape, rest));
        }
        Ok(shapes)
    }

    fn triangles(&self, primitive: &Primitive, mode: u32, vertices: usize) -> Result<Vec<[u32; 3]>, Error> {
        let corners = match primitive.indices {
            Some(index) => self.doc.indices(index, 1)?,
            None => (0..vertices as u32).collect(),
        };
        if let Some(bad) = corners.iter().find(|&&i| i as usize >= vertices) {
            return Err(self
                .doc
                .invalid(format!("a triangle uses vertex {bad}, but there are only {vertices}")));
        }
        Ok(match mode {
            4 => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            // Every second triangle of a strip runs the other way round.
            5 => corners
                .windows(3)
                .enumerate()
                .map(|(i, c)| if i % 2 == 0 { [c[0], c[1], c[2]] } else { [c[0], c[2], c[1]] })
                .collect(),
            _ => corners.get(1..).unwrap_or_default().windows(2).map(|c| [corners[0], c[0], c[1]]).collect(),
        })
    }

    /// A mesh without its triangles, deformed; and at rest where that is kept.
    fn mesh(
        &mut self,
        primitive: &Primitive,
        deformation: Deformation,
        uv_sets: &[usize],
    ) -> Result<(Mesh, Option<Rest>), Error> {
        let doc = self.doc;
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            return Err(doc.invalid("a mesh has no POSITION; expected one position per vertex"));
        };
        let mut mesh = Mesh { positions: vectors(&doc.floats(positions, 3)?), ..Mesh::default() };
        let count = mesh.positions.len();
        self.take_vertices(count)?;
        let attribute = |name: &str, width: usize| -> Result<Option<Vec<f32>>, Error> {
            let Some(&index) = primitive.attributes.get(name) else { return Ok(None) };
            let values = doc.floats(index, width)?;
            if values.len() != count * width {
                let problem = format!("a mesh has {count} positions but {} of {name}", values.len() / width);
                return Err(doc.invalid(problem));
            }
            Ok(Some(values))
        };
        mesh.normals = attribute("NORMAL", 3)?.map(|v| vectors(&v)).unwrap_or_default();
        mesh.tangents = attribute("TANGENT", 4)?
            .map(|v| v.chunks_exact(4).map(Vec4::from_slice).collect())
            .unwrap_or_default();
        let main = uv_sets.first().copied().unwrap_or(0);
        mesh.uvs = attribute(&format!("TEXCOORD_{main}"), 2)?
            .map(|v| v.chunks_exact(2).map(Vec2::from_slice).collect())
            .unwrap_or_default();
        for set in uv_sets.iter().skip(1) {
            if let Some(uvs) = attribute(&format!("TEXCOORD_{set}"), 2)? {
                let values = uvs.chunks_exact(2).flat_map(|c| [c[0], c[1], 0.0]).collect();
                mesh.attributes.push((materials::uv_attribute(*set), 3, values));
            }
        }
        if let Some(&index) = primitive.attributes.get("COLOR_0") {
            let width = doc.width(index)?;
            let to_working = ColourSpace::LinearSrgb.matrix_to(self.scene.working_space);
            let colours = attribute("COLOR_0", width)?.unwrap_or_default();
            if width >= 3 {
                if width == 4 {
                    let alphas = colours.iter().skip(3).step_by(4).map(|a| a.clamp(0.0, 1.0)).collect();
                    mesh.attributes.push((VERTEX_ALPHA.into(), 1, alphas));
                }
                let colours = colours
                    .chunks_exact(width)
                    .map(|c| (to_working * Vec3::from_slice(c)).clamp(Vec3::ZERO, Vec3::ONE));
                mesh.attributes.push((VERTEX_COLOR.into(), 3, colours.flat_map(|c| c.to_array()).collect()));
            }
        }

        let mut targets = Vec::new();
        for (i, target) in primitive.targets.iter().enumerate() {
            let weight = deformation.weights.get(i).copied().unwrap_or(0.0);
            // What is never asked for need not be read.
            if !deformation.keep && weight == 0.0 {
                targets.push(MorphTarget::default());
                continue;
            }
            self.take_vertices(count)?;
            targets.push(self.target(target)?);
        }
        let influences = match deformation.skin {
            Some((_, matrices)) => self.influences(primitive, count, matrices.len())?,
            None => None,
        };
        let rest = deformation.keep.then(|| mesh.clone());
        let Mesh { positions, normals, tangents, .. } = &mut mesh;
        let mut vertices = Vertices {
            positions: std::mem::take(positions),
            normals: std::mem::take(normals),
            tangents: std::mem::take(tangents),
        };
        vertices.morph(&targets, deformation.weights);
        if let (Some(influences), Some((_, matrices))) = (&influences, deformation.skin) {
            vertices.skin(influences, matrices);
        }
        vertices.normalize();
        (*positions, *normals, *tangents) = (vertices.positions, vertices.normals, vertices.tangents);
        if mesh.positions.iter().any(|p| !p.is_finite()) {
            return Err(doc.invalid("a mesh has positions that are not finite"));
        }
        Ok((mesh, rest.map(|rest| (rest, targets, influences))))
    }

    /// Counts what may stand for few bytes of a file.
    fn take_vertices(&mut self, count: usize) -> Result<(), Error> {
        self.vertices_left = self.vertices_left.checked_sub(count).ok_or_else(|| Error::TooLarge {
            at: self.doc.at.clone(),
            what: "the number of vertices of all meshes and their morph targets".into(),
            asked: (MAX_VERTICES - self.vertices_left + count) as u64,
            limit: MAX_VERTICES as u64,
        })?;
        Ok(())
    }

    fn target(&self, target: &BTreeMap<String, usize>) -> Result<MorphTarget, Error> {
        let moved = |name: &str| -> Result<Vec<Vec3>, Error> {
            target.get(name).map_or(Ok(Vec::new()), |&i| Ok(vectors(&self.doc.floats(i, 3)?)))
        };
        Ok(MorphTarget {
            positions: moved("POSITION")?,
            normals: moved("NORMAL")?,
            tangents: moved("TANGENT")?,
        })
    }

    /// Which of so many joints bend each of so many vertices: all sets of four that the mesh has.
    fn influences(
        &self,
        primitive: &Primitive,
        vertices: usize,
        joints: usize,
    ) -> Result<Option<Influences>, Error> {
        let mut sets = Vec::new();
        for set in 0.. {
            let name = |what: &str| primitive.attributes.get(&format!("{what}_{set}")).copied();
            let (Some(which), Some(weights)) = (name("JOINTS"), name("WEIGHTS")) else { break };
            sets.push((self.doc.indices(which, 4)?, self.doc.floats(weights, 4)?));
        }
        let (mut which, mut weights) = (Vec::new(), Vec::new());
        let enough = sets.iter().all(|(j, w)| j.len().min(w.len()) >= 4 * vertices);
        for vertex in 0..if enough { vertices } else { 0 } {
            for (j, w) in &sets {
                which.extend(&j[4 * vertex..][..4]);
                weights.extend(&w[4 * vertex..][..4]);
            }
        }
        if sets.is_empty() {
            return Ok(None);
        }
        Influences::new(4 * sets.len(), which, weights, vertices, joints)
            .map(Some)
            .map_err(|e| self.doc.invalid(e.to_string()))
    }

    /// A camera in the coordinates of its node.
    fn camera(&self, camera: &CameraEntry, node: &Node) -> Result<Camera, Error> {
        let name = [&node.name, &camera.name].into_iter().find(|n| !n.is_empty()).cloned();
        let mut film = Film::default();
        let set_aspect = |film: &mut Film, aspect: f32| {
            if (0.01..=100.0).contains(&aspect) {
                film.width = (film.height as f32 * aspect).round().max(1.0) as u32;
            }
        };
        // glTF looks along -z with +x to the right.
        let mut frame = Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0));
        let (projection, near, far) = match (&camera.perspective, &camera.orthographic) {
            (Some(p), _) => {
                set_aspect(&mut film, p.aspect_ratio.unwrap_or(0.0));
                if !(1e-4..3.1).contains(&p.yfov) {
                    return Err(self
                        .doc
                        .invalid(format!("a camera has a field of view of {} radians", p.yfov)));
                }
                let aspect = film.width as f32 / film.height as f32;
                let fov_x = 2.0 * ((0.5 * p.yfov).tan() * aspect).atan();
                let projection = Projection::Perspective {
                    fov_x,
                    fov_axis: FovAxis::Y,
                    aperture_radius: 0.0,
                    focus_distance: 1.0,
                    principal_point: Vec2::ZERO,
                };
                (projection, p.znear, p.zfar.unwrap_or(f32::INFINITY))
            }
            (None, Some(o)) => {
                set_aspect(&mut film, o.xmag / o.ymag);
                if !(o.xmag.abs() > 1e-20 && o.xmag.abs() < 1e20) {
                    return Err(self.doc.invalid(format!("a camera is {} wide", o.xmag)));
                }
                frame *= Mat4::from_scale(Vec3::new(o.xmag.abs(), o.xmag.abs(), 1.0));
                (Projection::Orthographic, o.znear, o.zfar)
            }
            (None, None) => return Err(self.doc.invalid("a camera is neither perspective nor orthographic")),
        };
        let near = if near > 0.0 { near } else { 1e-4 };
        let far = if far > near { far.min(1e8 * near.max(1.0)) } else { 1e8 * near.max(1.0) };
        Ok(Camera {
            name: name.unwrap_or_else(|| "camera".into()),
            to_world: frame,
            projection,
            near_far: [near, far],
            film,
            samples_per_pixel: 64,
        })
    }

    /// A light in the coordinates of its node.
    fn light(&self, light: &LightEntry) -> Result<Light, Error> {
        let colour = Vec3::from_array(light.color).clamp(Vec3::ZERO, Vec3::splat(1e6))
            * light.intensity.clamp(0.0, 1e12);
        let colour = ColourSpace::LinearSrgb.matrix_to(self.scene.working_space) * colour;
        Ok(match light.kind.as_str() {
            "point" => Light::Point { position: Vec3::ZERO, intensity: colour },
            "directional" => Light::Directional { direction: -Vec3::Z, irradiance: colour },
            "spot" => {
                let spot = light.spot.as_ref();
                let outer =
                    spot.map_or(std::f32::consts::FRAC_PI_4, |s| s.outer_cone_angle).clamp(1e-4, 1.57);
                let inner = spot.map_or(0.0, |s| s.inner_cone_angle).clamp(0.0, outer);
                let to_world = Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0));
                Light::Spot { to_world, intensity: colour, beam: inner, cutoff: outer, texture: None }
            }
            other => {
                return Err(Error::unknown(
                    self.doc.at.clone(),
                    "light",
                    other,
                    ["point", "directional", "spot"],
                ));
            }
        })
    }
}

/// A shape of a mesh in its place. A node that mirrors does not turn triangles round (glTF 2.0, 3.7.2.1); without
/// vertex normals only the winding tells their side.
fn placed(shape: Shape, to_world: Mat4) -> Shape {
    let flip_normals = shape.flip_normals ^ (shape.face_normals && to_world.determinant() < 0.0);
    Shape { to_world, flip_normals, ..shape }
}

fn placement(node: &Node) -> Placement {
    match node.matrix {
        Some(matrix) => Placement::Matrix(Mat4::from_cols_array(&matrix)),
        None => Placement::Parts(Transform {
            translation: node.translation.unwrap_or([0.0; 3]).into(),
            rotation: Quat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
            scale: node.scale.unwrap_or([1.0; 3]).into(),
        }),
    }
}

fn vectors(values: &[f32]) -> Vec<Vec3> {
    values.chunks_exact(3).map(Vec3::from_slice).collect()
}
