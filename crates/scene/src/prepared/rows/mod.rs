//! A scene as rows of plain numbers that shaders read as they are, and the WGSL that reads them.
//!
//! | rows | what is in them |
//! | --- | --- |
//! | `vertices`, `triangles`, `meshes`, `draws` | shapes |
//! | `words` | what is looked up by the word: the header, then materials, programs of textures, tables of environments, attributes, lights |
//! | `numbers` | parameters and tables of reflectance models, sums of areas |
//! | `texels` | pictures with their pyramids, the moments of cloths, environments |

mod environment;
mod geometry;
mod light;
mod material;
mod texture;

pub use geometry::{DrawRow, MeshRow, NONE, VertexRow};
pub use light::SLABS;

use super::{BadEnvironment, EmitterInGroup, GeometryError, LightSource, LightSources};
use super::{MaterialError, Materials, Textures};
use crate::{Light, MissingAttribute, Scene, Texture};
use glam::Mat4;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::Arc;
use yugen_motion::fire::Grid;
use yugen_reflectance::{Kind, MAX_SLOTS, wgsl_library_where};

/// A scene as rows.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Vertices of all meshes.
    pub vertices: Vec<VertexRow>,
    /// Triangles of all meshes: indices into `vertices`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The meshes.
    pub meshes: Vec<MeshRow>,
    /// Where they are.
    pub draws: Vec<DrawRow>,
    /// What is looked up by the word, from the header of [`HEADER`] words on.
    pub words: Vec<u32>,
    /// Parameters and tables of reflectance models; sums of areas.
    pub numbers: Vec<f32>,
    /// Four channels each.
    pub texels: Vec<[f32; 4]>,
    /// Reflectance models that occur.
    pub kinds: Vec<Kind>,
    /// Of each of these the parameters that are zero wherever it occurs, a bit a slot.
    pub zeros: Vec<u64>,
    /// Most lobes that a material resolves to at one point.
    pub lobes: u32,
    /// Most maps of normals or heights over one another.
    pub turns: u32,
    /// Whether a material is a cloth.
    pub has_cloth: bool,
    /// Whether anything varies over a surface.
    pub has_programs: bool,
    /// Steps of materials that occur, steps of textures' programs, and kinds of emitters: a bit each, by their numbers.
    pub steps: u32,
    /// See `steps`.
    pub operations: u32,
    /// See `steps`; the two highest bits: one of them is a sphere, or a rectangle, sampled by the cone or by the solid
    /// angle that it subtends.
    pub lights: u32,
    /// Some emitter is a surface that is sampled evenly by area.
    pub lights_by_area: bool,
    /// Most operands of a texture's program that wait at once.
    pub operands: u32,
    /// Emitters, of which the header knows where they begin.
    pub emitters: u32,
    /// Attributes of meshes that textures ask for.
    pub attribute_names: Vec<String>,
    /// What fills the space between surfaces.
    pub volumes: Vec<VolumeRow>,
    /// What another pose of the scene keeps.
    pub fixed: Fixed,
}

/// A volume, to be seen. Its light comes from emitters.
#[derive(Clone, Debug)]
pub struct VolumeRow {
    /// Emission and absorption.
    pub grid: Arc<Grid>,
    /// Factor of the emission.
    pub scale: f32,
    /// The world to the unit cube that the grid's box is.
    pub to_unit: Mat4,
}

/// The part of rows that a pose of the scene does not change: materials, textures, what emitters send and the tables of
/// environments. It comes first.
#[derive(Clone, Debug, Default)]
pub struct Fixed {
    words: usize,
    numbers: usize,
    see_through: Vec<bool>,
    emitters: Vec<light::Emission>,
}

impl VolumeRow {
    fn of(light: &Light) -> Option<Self> {
        let Light::Volume { grid, scale, to_world } = light else { return None };
        let size = grid.upper - grid.lower;
        let unit_to_world = *to_world * Mat4::from_translation(grid.lower) * Mat4::from_scale(size);
        Some(Self { grid: grid.clone(), scale: *scale, to_unit: unit_to_world.inverse() })
    }
}

/// The structs of shapes.
pub const GEOMETRY_WGSL: &str = include_str!("geometry.wgsl");

/// Words of the header: weights of luminance (3 floats); where the table of materials begins; where that of emitters
/// begins, and how many there are; where their chances begin in `numbers`; where the list of environments begins (how
/// many, then the emitter of each); the radiance of the background (3 floats); the first emitter that is a slab, of which
/// there are none but slabs.
pub const HEADER: usize = 12;

/// A scene that cannot be made into rows.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RowsError {
    /// Shapes.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Materials.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Environments.
    #[error(transparent)]
    Environment(#[from] BadEnvironment),
    /// Attributes of meshes.
    #[error(transparent)]
    Attribute(#[from] MissingAttribute),
    /// Emission on shapes inside a group.
    #[error(transparent)]
    EmitterInGroup(#[from] EmitterInGroup),
    /// A pose of another scene.
    #[error("another scene is no pose of this one: {found} instead of {rows}")]
    OtherScene {
        /// What the scene has.
        found: String,
        /// What the rows have.
        rows: String,
    },
    /// Textures made of textures made of textures.
    #[error("texture {texture} is made of others more than {limit} deep")]
    Deep {
        /// Index in the scene.
        texture: usize,
        /// How deep it may be.
        limit: usize,
    },
}

impl Rows {
    /// The rows of `scene`.
    pub fn new(scene: &Scene) -> Result<Self, RowsError> {
        scene.check_attributes()?;
        let textures = Textures::new(scene);
        let materials = Materials::new(scene)?;
        let names: BTreeSet<&str> = scene
            .textures
            .iter()
            .filter_map(|t| match t {
                Texture::MeshAttribute { name } | Texture::At { attribute: name, .. } => Some(name.as_str()),
                _ => None,
            })
            .collect();
        let mut rows = Self {
            attribute_names: names.into_iter().map(String::from).collect(),
            words: vec![0; HEADER],
            ..Self::default()
        };
        let luminance = scene.working_space.luminance_weights();
        rows.words[..3].copy_from_slice(&luminance.to_array().map(f32::to_bits));
        let mut programs = texture::Programs::new(&textures);
        material::write(&materials, &mut programs, &mut rows)?;
        let lights = LightSources::new(scene)?.with_slabs(SLABS, light::POINTS);
        let emitters = light::write_emissions(scene, &lights, &textures, &mut programs, &mut rows)?;
        rows.fixed = Fixed {
            words: rows.words.len(),
            numbers: rows.numbers.len(),
            see_through: (0..scene.materials.len()).map(|m| materials.see_through(m)).collect(),
            emitters,
        };
        rows.write_pose(scene, &lights)?;
        Ok(rows)
    }

    /// Takes over another pose of the same scene ([`Scene::pose`]): shapes and lights are written anew, which takes the
    /// time of their vertices; materials and textures stay. Where the scene is another one the rows stay as they are; after
    /// an error in its shapes they have neither shapes nor lights until a pose is taken over.
    pub fn pose(&mut self, scene: &Scene) -> Result<(), RowsError> {
        let lights = LightSources::new(scene)?.with_slabs(SLABS, light::POINTS);
        self.check_same_scene(scene, &lights)?;
        self.forget_pose();
        let written = self.write_pose(scene, &lights);
        if written.is_err() {
            self.forget_pose();
            light::write(scene, &LightSources::default(), &[], self);
        }
        written
    }

    fn check_same_scene(&self, scene: &Scene, lights: &LightSources) -> Result<(), RowsError> {
        let Fixed { emitters, see_through, .. } = &self.fixed;
        let other = |found: String, rows: String| Err(RowsError::OtherScene { found, rows });
        for (found, rows, what) in [
            (scene.materials.len(), see_through.len(), "materials"),
            (lights.sources.len(), emitters.len(), "emitters"),
        ] {
            if found != rows {
                return other(format!("{found} {what}"), rows.to_string());
            }
        }
        for (i, (source, emitter)) in lights.sources.iter().zip(emitters).enumerate() {
            let op = light::Op::of(source);
            if op != emitter.op {
                let found = format!("{} as emitter number {}", op.name(), i + 1);
                return other(found, emitter.op.name().into());
            }
        }
        Ok(())
    }

    fn forget_pose(&mut self) {
        self.words.truncate(self.fixed.words);
        self.numbers.truncate(self.fixed.numbers);
        self.vertices.clear();
        self.triangles.clear();
        self.meshes.clear();
        self.draws.clear();
    }

    /// Writes what a pose changes.
    fn write_pose(&mut self, scene: &Scene, lights: &LightSources) -> Result<(), RowsError> {
        self.volumes = scene.lights.iter().filter_map(VolumeRow::of).collect();
        let mut of_shape = vec![None; scene.shapes.len()];
        for (emitter, source) in (0..).zip(&lights.sources) {
            if let LightSource::Surface { shape, .. } = source {
                of_shape[*shape] = Some(emitter);
            }
        }
        let fixed = std::mem::take(&mut self.fixed);
        let see_through = |m: usize| fixed.see_through.get(m).copied().unwrap_or(false);
        let added = self.add_shapes(scene, &see_through, &|shape| of_shape[shape]);
        if added.is_ok() {
            light::write(scene, lights, &fixed.emitters, self);
        }
        self.fixed = fixed;
        Ok(added?)
    }
}

/// Everything a shader needs to know what a surface of these rows reflects and which light comes to it: the library of
/// reflectance models, lookup of textures, materials, lights and environments. The shader that includes it declares
/// `vertices: array<Vertex>`, `triangles: array<u32>` and `draws: array<Draw>` of [`GEOMETRY_WGSL`], `words: array<u32>`,
/// `numbers: array<f32>` and `texels: array<vec4<f32>>`.
pub fn wgsl(rows: &Rows) -> String {
    wgsl_where(rows, &rows.zeros)
}

/// [`wgsl`] that knows of no other parameters than `zeros` that they are zero; as [`Rows::zeros`], as many as there are.
pub fn wgsl_where(rows: &Rows, zeros: &[u64]) -> String {
    let zeros = zeros.iter().copied().chain(std::iter::repeat(0));
    let mut out = wgsl_library_where(&rows.kinds.iter().copied().zip(zeros).collect::<Vec<_>>());
    let _ = writeln!(
        out,
        "const LOBES: u32 = {}u;\nconst TURNS: u32 = {}u;\nconst SLOTS: u32 = {MAX_SLOTS}u;",
        rows.lobes.max(1),
        rows.turns.max(1)
    );
    // What a scene has not is left out of the shader when it is compiled.
    let _ = writeln!(
        out,
        "const HAS_TURNS: bool = {};\nconst HAS_PROGRAMS: bool = {};\nconst SEES_THROUGH: bool = {};",
        rows.turns > 0,
        rows.has_programs,
        rows.draws.iter().any(|d| d.flags & DrawRow::SEE_THROUGH != 0)
    );
    let _ = writeln!(
        out,
        "const STEPS: u32 = {}u;\nconst OPERATIONS: u32 = {}u;\nconst EMITTERS: u32 = {}u;\nconst OPERANDS: u32 = {}u;",
        rows.steps,
        rows.operations,
        rows.lights,
        rows.operands.max(1)
    );
    let _ = writeln!(
        out,
        "const HAS_SLABS: bool = {};\nconst KIND_NOH: u32 = {}u;",
        rows.has_slabs(),
        Kind::Noh as u32
    );
    let any_of = |holds: &dyn Fn(&Kind) -> bool| -> String {
        rows.kinds.iter().filter(|k| holds(k)).map(|k| format!(" || kind == {}u", *k as u32)).collect()
    };
    let diffuse = any_of(&|k| matches!(k, Kind::Lambert | Kind::OrenNayar));
    let (delta, transmits) = (any_of(&|k| k.laws().delta), any_of(&|k| k.laws().transmits));
    let _ = writeln!(
        out,
        "fn bsdf_is_delta(kind: u32) -> bool {{ return false{delta}; }}\n\
         fn bsdf_is_diffuse(kind: u32) -> bool {{ return false{diffuse}; }}\n\
         fn bsdf_transmits(kind: u32) -> bool {{ return false{transmits}; }}"
    );
    out.push_str(include_str!("rows.wgsl"));
    out.push_str(include_str!("texture.wgsl"));
    // A shader without cloths has no texels of cloths.
    out.push_str(if rows.has_cloth {
        include_str!("cloth.wgsl")
    } else {
        "fn cloth_at(point: ShadingPoint, at: u32, form: f32, own: u32) -> ClothAt { return ClothAt(); }\n"
    });
    out.push_str(include_str!("material.wgsl"));
    out.push_str(include_str!("environment.wgsl"));
    out.push_str(yugen_motion::fire::DIRECTIVITY_WGSL);
    out.push_str(include_str!("light.wgsl"));
    out
}
