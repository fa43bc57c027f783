//! glTF 2.0 and GLB. Khronos Group 2021, "glTF 2.0 Specification", with the extensions of [`FEATURES`].
//!
//! Materials become the model `metallic_roughness`. Skinned and morphed meshes are read in the pose of the
//! file's nodes and weights, or in that of an animation at a moment ([`Options::moment`]). Photometric numbers are taken as radiometric ones: a
//! candela as 1 W/sr, a lux as 1 W/m², so that lights and emission keep their proportions. A file without a
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

use super::folders::Folders;
use super::{Moment, Options};
use crate::Error;
use document::Document;
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use schema::{CameraEntry, LightEntry, Node, Primitive, Skin};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Scene;
use yugen_scene::{Camera, Film, FovAxis, Geometry, Light, MaterialId, Mesh, Projection, Shape, Value};

pub use features::FEATURES;

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
    let mut scene = read_into(ColourSpace::default(), bytes, path, &folders, options.moment.as_ref())?;
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

/// The names of the animations of a file and when each begins and ends, in seconds.
pub fn animations(bytes: &[u8], path: &Path, options: &Options) -> Result<Vec<(String, [f32; 2])>, Error> {
    let folders = Folders::new(path, &options.folders, None)?;
    animation::list(&Document::read(bytes, path, &folders)?)
}

/// Reads what is in a file, with the colours in `space`, and adds nothing.
pub(crate) fn read_into(
    space: ColourSpace,
    bytes: &[u8],
    path: &Path,
    folders: &Folders,
    moment: Option<&Moment>,
) -> Result<Scene, Error> {
    let folders = folders.inside(path);
    let mut doc = Document::read(bytes, path, &folders)?;
    features::check(&doc)?;
    if let Some(moment) = moment {
        animation::pose(&mut doc, moment)?;
    }
    let reader = Reader {
        doc: &doc,
        folders,
        scene: Scene { working_space: space, ..Scene::default() },
        images: HashMap::new(),
        samples_left: MAX_SAMPLES,
        vertices_left: MAX_VERTICES,
        materials: HashMap::new(),
        places: HashMap::new(),
        uv_sets: Vec::new(),
    };
    reader.scene()
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

struct Reader<'a> {
    doc: &'a Document,
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
    fn scene(mut self) -> Result<Scene, Error> {
        let doc = self.doc;
        let nodes = &doc.root.nodes;
        let (globals, forest) = self.globals()?;
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
                    self.place_mesh(mesh, node, to_world * place, &globals, uses[mesh] > 1)?;
                }
            }
            if let Some(camera) = node.camera {
                let camera = doc.entry(&doc.root.cameras, camera, "camera")?;
                let camera = self.camera(camera, node, to_world)?;
                self.scene.cameras.push(camera);
            }
            if let Some(light) = &node.extensions.light {
                let light = doc.entry(&doc.root.extensions.lights.lights, light.light, "light")?;
                let name = if light.name.is_empty() { &node.name } else { &light.name };
                let light = self.light(light, to_world)?;
                self.scene.add_light(name, light);
            }
        }
        Ok(self.scene)
    }

    /// Every node's transform to the world, and the nodes without a parent.
    fn globals(&self) -> Result<(Vec<Mat4>, Vec<usize>), Error> {
        let nodes = &self.doc.root.nodes;
        let mut has_parent = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|n| &n.children) {
            self.doc.entry(nodes, child, "node")?;
            if std::mem::replace(&mut has_parent[child], true) {
                return Err(self.doc.invalid(format!("node {child} has two parents; nodes must form trees")));
            }
        }
        let forest: Vec<usize> = (0..nodes.len()).filter(|&i| !has_parent[i]).collect();
        let mut globals = vec![None; nodes.len()];
        let mut stack: Vec<(usize, Mat4)> = forest.iter().map(|&i| (i, Mat4::IDENTITY)).collect();
        while let Some((i, parent)) = stack.pop() {
            let global = parent * local(&nodes[i]);
            if !global.is_finite() {
                return Err(self.doc.invalid(format!("the transform of node {i} is not finite")));
            }
            globals[i] = Some(global);
            stack.extend(nodes[i].children.iter().map(|&c| (c, global)));
        }
        let globals = globals.into_iter().collect::<Option<Vec<_>>>();
        Ok((globals.ok_or_else(|| self.doc.invalid("some nodes contain each other in a circle"))?, forest))
    }

    fn place_mesh(
        &mut self,
        mesh: usize,
        node: &Node,
        to_world: Mat4,
        globals: &[Mat4],
        several: bool,
    ) -> Result<(), Error> {
        let entry = &self.doc.root.meshes[mesh];
        let name = if node.name.is_empty() { entry.name.clone() } else { node.name.clone() };
        if self.scene.shapes.len().saturating_add(entry.primitives.len()) > MAX_SHAPES {
            let (what, at) = ("the number of shapes".to_string(), self.doc.at.clone());
            return Err(Error::TooLarge { at, what, asked: MAX_SHAPES as u64 + 1, limit: MAX_SHAPES as u64 });
        }
        // A mirror or a squeezed node is fine for meshes; one without any extent shows nothing.
        let to_world = if node.skin.is_some() { Mat4::IDENTITY } else { to_world };
        if to_world.determinant() == 0.0 {
            return Ok(());
        }
        let bent = node.skin.is_some() || node.weights.is_some();
        if !several || bent {
            let skin = match node.skin {
                Some(skin) => {
                    Some(self.joints(self.doc.entry(&self.doc.root.skins, skin, "skin")?, globals)?)
                }
                None => None,
            };
            let weights = node.weights.as_deref().unwrap_or(&entry.weights);
            let shapes = self.shapes(&name, &entry.primitives, weights, skin.as_deref())?;
            self.scene.shapes.extend(shapes.into_iter().map(|s| placed(s, to_world)));
            return Ok(());
        }
        if !self.places.contains_key(&mesh) {
            let shapes = self.shapes(&entry.name, &entry.primitives, &entry.weights, None)?;
            let copies = if shapes.iter().any(|s| s.emission.is_some()) {
                Copies::Each(shapes)
            } else {
                self.scene.groups.push(shapes);
                Copies::Instances(self.scene.groups.len() - 1)
            };
            self.places.insert(mesh, copies);
        }
        match &self.places[&mesh] {
            Copies::Each(shapes) => {
                self.scene.shapes.extend(shapes.iter().map(|s| placed(s.clone(), to_world)));
            }
            Copies::Instances(group) if self.scene.groups[*group].is_empty() => {}
            // A mirror turns flat triangles inside out, which an instance cannot undo.
            Copies::Instances(group)
                if to_world.determinant() < 0.0
                    && self.scene.groups[*group].iter().any(|s| s.face_normals) =>
            {
                let copies = self.scene.groups[*group].iter().map(|s| placed(s.clone(), to_world));
                self.scene.shapes.extend(copies);
            }
            Copies::Instances(group) => {
                self.scene.shapes.push(Shape::new(name, Geometry::Instance(*group), to_world, 0));
            }
        }
        Ok(())
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
            local(&Node {
                translation: translations.get(3 * i..3 * i + 3).map(|v| [v[0], v[1], v[2]]),
                rotation: rotations.get(4 * i..4 * i + 4).map(|v| [v[0], v[1], v[2], v[3]]),
                scale: scales.get(3 * i..3 * i + 3).map(|v| [v[0], v[1], v[2]]),
                ..Node::default()
            })
        };
        Ok((0..count).map(place).collect())
    }

    /// The matrices that take vertices to the world, one per joint.
    fn joints(&self, skin: &Skin, globals: &[Mat4]) -> Result<Vec<Mat4>, Error> {
        let inverse: Vec<Mat4> = match skin.inverse_bind_matrices {
            Some(index) => {
                let numbers = self.doc.floats(index, 16)?;
                numbers.chunks_exact(16).map(|m| Mat4::from_cols_slice(m)).collect()
            }
            None => vec![Mat4::IDENTITY; skin.joints.len()],
        };
        let joints = skin.joints.iter().zip(inverse.iter().chain(std::iter::repeat(&Mat4::IDENTITY)));
        joints.map(|(&j, inverse)| Ok(*self.doc.entry(globals, j, "node")? * *inverse)).collect()
    }

    fn shapes(
        &mut self,
        name: &str,
        primitives: &[Primitive],
        weights: &[f32],
        joints: Option<&[Mat4]>,
    ) -> Result<Vec<Shape>, Error> {
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
            let mut mesh = self.mesh(primitive, weights, joints, &finish.uv_sets)?;
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
            let mut material = finish.id;
            if finish.culled && !outside::only_seen_from_outside(&mesh) {
                material = self.culled(material);
            }
            shapes.push(Shape {
                name: name.to_string(),
                // Meshes without normals are meant to be flat.
                face_normals: mesh.normals.is_empty(),
                geometry: Geometry::Mesh(Arc::new(mesh)),
                to_world: Mat4::IDENTITY,
                flip_normals: false,
                material,
                emission: finish.emission.clone(),
                two_sided_emission: finish.double_sided,
            });
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

    fn mesh(
        &mut self,
        primitive: &Primitive,
        weights: &[f32],
        joints: Option<&[Mat4]>,
        uv_sets: &[usize],
    ) -> Result<Mesh, Error> {
        let doc = self.doc;
        let Some(&positions) = primitive.attributes.get("POSITION") else {
            return Err(doc.invalid("a mesh has no POSITION; expected one position per vertex"));
        };
        let mut mesh = Mesh { positions: vectors(&doc.floats(positions, 3)?), ..Mesh::default() };
        let count = mesh.positions.len();
        self.vertices_left = self.vertices_left.checked_sub(count).ok_or_else(|| Error::TooLarge {
            at: doc.at.clone(),
            what: "the number of vertices of all meshes".into(),
            asked: (MAX_VERTICES - self.vertices_left + count) as u64,
            limit: MAX_VERTICES as u64,
        })?;
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

        for (target, &weight) in
            primitive.targets.iter().zip(weights).filter(|(_, w)| w.is_finite() && **w != 0.0)
        {
            let moved = |target: &BTreeMap<String, usize>, name: &str| -> Result<Vec<Vec3>, Error> {
                target.get(name).map_or(Ok(Vec::new()), |&i| Ok(vectors(&doc.floats(i, 3)?)))
            };
            for (p, d) in mesh.positions.iter_mut().zip(moved(target, "POSITION")?) {
                *p += weight * d;
            }
            for (n, d) in mesh.normals.iter_mut().zip(moved(target, "NORMAL")?) {
                *n += weight * d;
            }
            for (t, d) in mesh.tangents.iter_mut().zip(moved(target, "TANGENT")?) {
                *t += (weight * d).extend(0.0);
            }
        }
        if let Some(joints) = joints {
            if primitive.attributes.contains_key("JOINTS_1") {
                tracing::warn!("{}: only the first four joints of a vertex are used", doc.at);
            }
            if let (Some(&which), Some(weights)) =
                (primitive.attributes.get("JOINTS_0"), attribute("WEIGHTS_0", 4)?)
            {
                let which = doc.indices(which, 4)?;
                bend(&mut mesh, &which, &weights, joints).map_err(|problem| doc.invalid(problem))?;
            }
        }
        for n in &mut mesh.normals {
            *n = n.normalize_or(Vec3::Z);
        }
        for (t, n) in mesh.tangents.iter_mut().zip(&mesh.normals) {
            let along = (t.truncate() - *n * n.dot(t.truncate())).normalize_or(n.any_orthonormal_vector());
            *t = along.extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        }
        if mesh.positions.iter().any(|p| !p.is_finite()) {
            return Err(doc.invalid("a mesh has positions that are not finite"));
        }
        Ok(mesh)
    }

    fn camera(&self, camera: &CameraEntry, node: &Node, to_world: Mat4) -> Result<Camera, Error> {
        let name = [&node.name, &camera.name].into_iter().find(|n| !n.is_empty()).cloned();
        let mut film = Film::default();
        let set_aspect = |film: &mut Film, aspect: f32| {
            if (0.01..=100.0).contains(&aspect) {
                film.width = (film.height as f32 * aspect).round().max(1.0) as u32;
            }
        };
        // glTF looks along -z with +x to the right.
        let mut frame = rigid(to_world) * Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0));
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

    fn light(&self, light: &LightEntry, to_world: Mat4) -> Result<Light, Error> {
        let frame = rigid(to_world);
        let colour = Vec3::from_array(light.color).clamp(Vec3::ZERO, Vec3::splat(1e6))
            * light.intensity.clamp(0.0, 1e12);
        let colour = ColourSpace::LinearSrgb.matrix_to(self.scene.working_space) * colour;
        let position = frame.w_axis.truncate();
        let direction = -frame.z_axis.truncate();
        Ok(match light.kind.as_str() {
            "point" => Light::Point { position, intensity: colour },
            "directional" => Light::Directional { direction, irradiance: colour },
            "spot" => {
                let spot = light.spot.as_ref();
                let outer =
                    spot.map_or(std::f32::consts::FRAC_PI_4, |s| s.outer_cone_angle).clamp(1e-4, 1.57);
                let inner = spot.map_or(0.0, |s| s.inner_cone_angle).clamp(0.0, outer);
                let to_world = frame * Mat4::from_scale(Vec3::new(-1.0, 1.0, -1.0));
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

fn local(node: &Node) -> Mat4 {
    if let Some(matrix) = node.matrix {
        return Mat4::from_cols_array(&matrix);
    }
    let rotation = Quat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let length = rotation.length();
    let rotation = if length > 1e-6 && length.is_finite() { rotation / length } else { Quat::IDENTITY };
    let scale = node.scale.unwrap_or([1.0; 3]).into();
    Mat4::from_scale_rotation_translation(scale, rotation, node.translation.unwrap_or([0.0; 3]).into())
}

/// Rotation and translation without scale or shear: z stays, y is turned upright to it.
fn rigid(m: Mat4) -> Mat4 {
    let z = m.z_axis.truncate().normalize_or(Vec3::Z);
    let x = m.y_axis.truncate().cross(z).try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), m.w_axis)
}

fn vectors(values: &[f32]) -> Vec<Vec3> {
    values.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// Linear blend skinning (glTF 2.0, 3.7.3.3).
fn bend(mesh: &mut Mesh, which: &[u32], weights: &[f32], joints: &[Mat4]) -> Result<(), String> {
    if which.len() < 4 * mesh.positions.len() {
        return Err("a skinned mesh has fewer joints than vertices".into());
    }
    for (k, (which, weights)) in which.chunks_exact(4).zip(weights.chunks_exact(4)).enumerate() {
        let mut m = Mat4::ZERO;
        let mut sum = 0.0;
        for (&j, &w) in which.iter().zip(weights) {
            if w != 0.0 {
                let joint = joints.get(j as usize).ok_or_else(|| {
                    format!("a vertex hangs on joint {j}, but the skin has only {}", joints.len())
                })?;
                m += *joint * w;
                sum += w;
            }
        }
        if sum <= 0.0 {
            continue;
        }
        let m = m * (1.0 / sum);
        mesh.positions[k] = m.transform_point3(mesh.positions[k]);
        // Joints turn and scale evenly, as good as always.
        if let Some(n) = mesh.normals.get_mut(k) {
            *n = m.transform_vector3(*n);
        }
        if let Some(t) = mesh.tangents.get_mut(k) {
            *t = m.transform_vector3(t.truncate()).extend(t.w);
        }
    }
    Ok(())
}
