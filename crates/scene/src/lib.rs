//! What every scene file becomes: plain data, linear colours in one working space, angles in radians.
//!
//! Readers (Mitsuba XML, glTF, Yugen's own TOML) fill a [`Scene`]; the reference renderer and the stage
//! read it. Indices (`TextureId`, …) point into the vectors of the same scene.

mod attributes;
mod cache;
mod camera;
mod figure;
mod film;
mod fingerprint;
mod fire;
mod framing;
mod integrator;
mod light;
mod light_groups;
mod material;
mod mesh;
mod names;
mod normals;
pub mod polygon;
pub mod prepared;
pub mod primitives;
mod shape;
mod sticks;
mod texture;

pub use attributes::MissingAttribute;
pub use cache::{CacheError, CachedMesh};
pub use camera::{Camera, CameraError, FovAxis, Projection};
pub use figure::{Attachment, DeformedMesh, Figure, Part, PoseError, rigid};
pub use film::{Film, Filter};
pub use fire::SceneFire;
pub use framing::look_along;
pub use integrator::{Aov, Integrator, IntegratorKind, Strategy};
pub use light::Light;
pub use light_groups::LightGroups;
pub use material::{Material, ModelBuilder, TurnedNormals};
pub use mesh::Mesh;
pub use names::{nearest, suggest};
pub use shape::{Geometry, Shape};
pub use sticks::SticksError;
pub use texture::{Texture, TextureFilter, Value, Wrap};

use std::sync::Arc;
use yugen_optics::ColourSpace;
use yugen_optics::adaptation::Adaptation;
use yugen_optics::tonemap::Curve;

/// Index into [`Scene::textures`].
pub type TextureId = usize;
/// Index into [`Scene::materials`].
pub type MaterialId = usize;
/// Index into [`Scene::groups`].
pub type GroupId = usize;

/// A scene, complete.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The space of every colour below.
    pub working_space: ColourSpace,
    /// At least one; the first is the default.
    pub cameras: Vec<Camera>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Materials.
    pub materials: Vec<Material>,
    /// What `materials` are called in the file; those beyond its end, and those that are empty, have no name.
    pub material_names: Vec<String>,
    /// Shapes placed in the world.
    pub shapes: Vec<Shape>,
    /// Groups of shapes that instances place.
    pub groups: Vec<Vec<Shape>>,
    /// Lights that are not shapes.
    pub lights: Vec<Light>,
    /// What `lights` are called, for [`Scene::light_groups`]; those beyond its end have no name.
    pub light_names: Vec<String>,
    /// The moment, s, at which what moves stands and what burns burns.
    pub seconds: f64,
    /// What moves, posed by [`Scene::pose`]; everything above is as it stands now.
    pub figures: Vec<Arc<Figure>>,
    /// What burns, likewise.
    pub fires: Vec<Arc<SceneFire>>,
    /// Meshes whose movement was computed before, likewise.
    pub caches: Vec<Arc<CachedMesh>>,
    /// How the file wants to be rendered.
    pub integrator: Integrator,
    /// How the file wants to be shown.
    pub display: Display,
}

/// How a display shows a scene's light where nobody says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Display {
    /// Brighter by so many stops.
    pub exposure: f32,
    /// From scene light to display light.
    pub curve: Curve,
    /// What the exposure of a film follows.
    pub adaptation: Adaptation,
}
