//! What every scene file becomes: plain data, linear colours in one working space, angles in radians.
//!
//! Readers (Mitsuba XML, glTF, Yugen's own TOML) fill a [`Scene`]; the reference renderer and the stage
//! read it. Indices (`TextureId`, …) point into the vectors of the same scene.

mod attributes;
mod camera;
mod fingerprint;
mod framing;
mod light_groups;
mod material;
mod normals;
pub(crate) mod polygon;
pub mod primitives;

pub use attributes::MissingAttribute;
pub use camera::FovAxis;
pub use framing::look_along;
pub use light_groups::LightGroups;
pub use material::ModelBuilder;

use glam::{Affine2, Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::btf::Btf;
use yugen_reflectance::{Choice, Kind};

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
    /// Shapes placed in the world.
    pub shapes: Vec<Shape>,
    /// Groups of shapes that instances place.
    pub groups: Vec<Vec<Shape>>,
    /// Lights that are not shapes.
    pub lights: Vec<Light>,
    /// What `lights` are called, for [`Scene::light_groups`]; those beyond its end have no name.
    pub light_names: Vec<String>,
    /// How the file wants to be rendered.
    pub integrator: Integrator,
}

/// A number, a colour, or either of them varying over the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; where a colour is wanted, grey.
    Number(f32),
    /// A colour; where a number is wanted, its luminance.
    Rgb(Vec3),
    /// Looked up per hit.
    Texture(TextureId),
}

/// Something that varies over a surface.
#[derive(Clone, Debug)]
pub enum Texture {
    /// A picture, already linear and in the working space (or raw numbers).
    Image {
        /// Channels: one (grey) or at least R, G, B.
        image: Arc<Image>,
        /// How to look between texels.
        filter: TextureFilter,
        /// What lies outside [0, 1), across and down.
        wrap: [Wrap; 2],
        /// Applied to the surface's (u, v) first. v runs **down**: v = 0 is the top row of the picture, as in
        /// glTF and inside Mitsuba. Readers of formats where v runs up (OBJ) store 1 − v in the mesh.
        to_uv: Affine2,
        /// Use this channel, one of the first four, as a number instead of the colour.
        channel: Option<usize>,
    },
    /// Squares of two values, each half a unit of (u, v) wide as in Mitsuba.
    Checkerboard {
        /// Where floor(2u) + floor(2v) is even.
        even: Value,
        /// Elsewhere.
        odd: Value,
        /// Applied to (u, v) first.
        to_uv: Affine2,
    },
    /// An attribute of the mesh, interpolated between vertices or the same all over a triangle.
    MeshAttribute {
        /// For example `vertex_color`.
        name: String,
    },
    /// The maps of a cloth, for [`Material::Cloth`]; always filtered. As a colour: ρ_d.
    Cloth {
        /// In the working space.
        maps: Arc<Btf>,
        /// What lies outside [0, 1).
        wrap: Wrap,
        /// Applied to (u, v) first.
        to_uv: Affine2,
    },
    /// A texture times a constant (glTF's factors).
    Scaled {
        /// The texture.
        texture: TextureId,
        /// Channel-wise factor.
        factor: Vec3,
    },
    /// A texture at coordinates of its own: those that an attribute of the mesh, three numbers wide, has in its first
    /// two.
    At {
        /// The texture.
        texture: TextureId,
        /// For example `uv_1`.
        attribute: String,
    },
    /// The product of two values, channel by channel.
    Product {
        /// Both.
        factors: [Value; 2],
    },
    /// 1 where a number is at least `edge`, 0 elsewhere.
    Step {
        /// The number.
        value: Value,
        /// Where it steps.
        edge: f32,
    },
}

/// How an image is looked up between its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Bilinear,
    /// Trilinear in a mip pyramid by the ray's footprint.
    Mip,
}

/// What an image shows outside [0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Every second tile mirrored.
    Mirror,
    /// The border texel goes on.
    Clamp,
}

/// What a surface is made of.
#[derive(Clone, Debug)]
pub enum Material {
    /// A reflectance model on the upper side; a model that does not transmit is black from below.
    Model {
        /// Which.
        kind: Kind,
        /// One value per entry of `kind.params()`, in that order.
        params: Vec<Value>,
        /// `kind.bake(…)`, made once by whoever filled the scene.
        table: Arc<[f32]>,
    },
    /// `front` seen from above the normal, `back` from below, each as if its side were up.
    TwoSided {
        /// Above.
        front: MaterialId,
        /// Below.
        back: MaterialId,
    },
    /// `base` where `opacity` is one; nothing (light goes straight through) where it is zero.
    Mask {
        /// In [0, 1].
        opacity: Value,
        /// The rest.
        base: MaterialId,
    },
    /// (1 − weight) · first + weight · second.
    Blend {
        /// In [0, 1].
        weight: Value,
        /// At weight 0.
        first: MaterialId,
        /// At weight 1.
        second: MaterialId,
    },
    /// The sum of several.
    Sum(Vec<MaterialId>),
    /// Turns the shading frame by a tangent-space normal map, n = 2c − 1.
    NormalMap {
        /// Raw (not colour-managed) texture.
        texture: TextureId,
        /// Factor on x and y, glTF's `normalTexture.scale`.
        scale: f32,
        /// Where what is turned looks away from the eye or the light.
        turned: TurnedNormals,
        /// What is turned.
        base: MaterialId,
    },
    /// The model `noh` with all its numbers, the normal and the tangent from the maps of a cloth. From afar the normals
    /// of many texels become the width of one highlight.
    Cloth {
        /// A [`Texture::Cloth`].
        texture: TextureId,
        /// The parameter `form` of `noh`; not `ashikhmin2000`, whose table is for constant widths.
        form: Choice,
    },
    /// Turns the shading frame by the slope of a height field.
    BumpMap {
        /// Heights, raw.
        texture: TextureId,
        /// Factor on the heights, in scene units.
        scale: f32,
        /// Where what is turned looks away from the eye or the light.
        turned: TurnedNormals,
        /// What is turned.
        base: MaterialId,
    },
    /// The surface of a body that takes light from what passes through it: exp(−absorption · distance) is left.
    Body {
        /// Per scene unit.
        absorption: Vec3,
        /// What lets light in and out, of a model that transmits.
        base: MaterialId,
    },
    /// `base` from the side that the geometric normal is on; nothing (light goes straight through) from the other.
    OneSided {
        /// What is seen from the front.
        base: MaterialId,
    },
    /// Light passes as if nothing were there.
    Null,
}

/// What happens where a turned shading normal looks away from the eye or the light. Both are on by default, as in
/// Mitsuba 3, whose names these are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TurnedNormals {
    /// A normal that looks away from the eye is mirrored at the surface's own, so that it looks back (Schüßler et al.
    /// 2017, "Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing"). Else it is black there.
    pub flip_invalid_normals: bool,
    /// Light at a slant to the surface fades out by a microfacet shadowing term (Conty Estevez et al. 2019, "A
    /// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem"). Else it ends in a hard line.
    pub use_shadowing_function: bool,
}

impl Default for TurnedNormals {
    fn default() -> Self {
        Self { flip_invalid_normals: true, use_shadowing_function: true }
    }
}

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Empty, or one unit normal per vertex.
    pub normals: Vec<Vec3>,
    /// Empty, or one (u, v) per vertex; v down, so that v = 0 is the top row of a picture.
    pub uvs: Vec<Vec2>,
    /// Empty, or one tangent per vertex with the bitangent's sign in w (glTF's convention).
    pub tangents: Vec<glam::Vec4>,
    /// Extra values: name, width (1 or 3), values; of each triangle where the name begins with `face_`, else of each
    /// vertex.
    pub attributes: Vec<(String, usize, Vec<f32>)>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// What a shape is, in its own coordinates.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles.
    Mesh(Arc<Mesh>),
    /// Radius 1 about the origin; u along azimuth, v along polar angle from +z, as in Mitsuba.
    Sphere,
    /// [−1, 1]² in z = 0, normal +z, (u, v) = (x + 1, y + 1)/2.
    Rectangle,
    /// Radius 1 in z = 0, normal +z; u radius, v azimuth/2π.
    Disc,
    /// Radius 1 about the z axis from z = 0 to 1, open ends, normal outwards.
    Cylinder,
    /// A group placed again.
    Instance(GroupId),
}

/// Geometry in its place, with its material.
#[derive(Clone, Debug)]
pub struct Shape {
    /// For messages and the id AOV.
    pub name: String,
    /// What.
    pub geometry: Geometry,
    /// Own coordinates to world (or to group).
    pub to_world: Mat4,
    /// Normals point the other way.
    pub flip_normals: bool,
    /// Triangles are flat even where the mesh has normals.
    pub face_normals: bool,
    /// Of what. Ignored for an instance.
    pub material: MaterialId,
    /// Radiance emitted on the side of the normal, in the working space; `None` for a shape that is no light.
    pub emission: Option<Value>,
    /// Emits on both sides.
    pub two_sided_emission: bool,
}

impl Shape {
    /// A shape that neither shines nor is turned inside out.
    pub fn new(name: impl Into<String>, geometry: Geometry, to_world: Mat4, material: MaterialId) -> Self {
        Self {
            name: name.into(),
            geometry,
            to_world,
            flip_normals: false,
            face_normals: false,
            material,
            emission: None,
            two_sided_emission: false,
        }
    }
}

/// A light that is not a shape.
#[derive(Clone, Debug)]
pub enum Light {
    /// Radiant intensity from a point.
    Point {
        /// Where.
        position: Vec3,
        /// W/sr per channel.
        intensity: Vec3,
    },
    /// A cone along +z of its frame: full inside `beam`, falling linearly in angle to zero at `cutoff`.
    Spot {
        /// Its frame.
        to_world: Mat4,
        /// On the axis.
        intensity: Vec3,
        /// Half angle, radians.
        beam: f32,
        /// Half angle, radians.
        cutoff: f32,
        /// Multiplies the intensity; (u, v) spans the cutoff cone, 2·cutoff being the field of view.
        texture: Option<TextureId>,
    },
    /// From infinitely far away, travelling along `direction`.
    Directional {
        /// Unit, the way light travels.
        direction: Vec3,
        /// On a surface that faces it.
        irradiance: Vec3,
    },
    /// The same radiance from everywhere.
    Constant {
        /// Radiance.
        radiance: Vec3,
    },
    /// A latitude-longitude picture at infinity, Mitsuba's orientation: +y up; local direction
    /// (sin φ sin θ, cos θ, −cos φ sin θ) for φ = 2πu, θ = πv, v = 0 the top row.
    Environment {
        /// Radiance, linear, working space, channels R, G, B.
        image: Arc<Image>,
        /// Factor.
        scale: f32,
        /// Its frame.
        to_world: Mat4,
    },
    /// A slide projector: the inverse of a perspective camera.
    Projector {
        /// Its frame; throws along +z.
        to_world: Mat4,
        /// Intensity picture.
        texture: TextureId,
        /// Factor.
        scale: f32,
        /// Field of view across the picture's width, radians.
        fov_x: f32,
    },
}

/// How the camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole or, with an aperture, thin lens.
    Perspective {
        /// Across the full width, radians.
        fov_x: f32,
        /// What keeps its field of view when the picture gets another aspect.
        fov_axis: FovAxis,
        /// 0 for a pinhole; scene units.
        aperture_radius: f32,
        /// Where a thin lens is sharp; distance along the axis.
        focus_distance: f32,
        /// Shift of the picture's centre, in picture widths and heights.
        principal_point: Vec2,
    },
    /// Parallel rays over [−1, 1] of the camera's x (y in proportion).
    Orthographic,
}

/// A camera looks along +z of its frame with +y up and +x to the **left** (Mitsuba's frame, right-handed).
#[derive(Clone, Debug)]
pub struct Camera {
    /// For `--camera`.
    pub name: String,
    /// Its frame; may scale (orthographic).
    pub to_world: Mat4,
    /// How it maps.
    pub projection: Projection,
    /// Rays start and end at these distances along the axis.
    pub near_far: [f32; 2],
    /// The picture.
    pub film: Film,
    /// What the file asks for.
    pub samples_per_pixel: u32,
}

/// The picture a camera makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// x, y, width, height of the part that is rendered, pixels.
    pub crop: Option<[u32; 4]>,
    /// Reconstruction.
    pub filter: Filter,
}

impl Default for Film {
    fn default() -> Self {
        // Mitsuba's hdrfilm.
        Self { width: 768, height: 576, crop: None, filter: Filter::default() }
    }
}

/// Reconstruction filters; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Each sample counts for its own pixel.
    Box,
    /// Linear fall-off.
    Tent {
        /// Half width.
        radius: f32,
    },
    /// Cut off at four standard deviations and shifted to end at zero, as in Mitsuba.
    Gaussian {
        /// Standard deviation.
        stddev: f32,
    },
    /// Mitchell and Netravali 1988.
    Mitchell {
        /// B.
        b: f32,
        /// C.
        c: f32,
    },
    /// Catmull-Rom: Mitchell with B = 0, C = 1/2.
    CatmullRom,
    /// Windowed sinc.
    Lanczos {
        /// Lobes on each side.
        lobes: f32,
    },
}

impl Default for Filter {
    fn default() -> Self {
        Self::Gaussian { stddev: 0.5 }
    }
}

/// How light is followed.
#[derive(Clone, Debug, PartialEq)]
pub enum IntegratorKind {
    /// Path tracing with multiple importance sampling.
    Path,
    /// Direct light only: paths of two edges, one draw of a light and one of the material at the first hit.
    Direct,
    /// Distance along the ray.
    Depth,
    /// Only the AOVs.
    Aov,
}

/// How direct light of a surface or from all around is looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// By drawing points on lights and directions of the material, weighed against each other.
    #[default]
    Both,
    /// By drawing points on lights only.
    Lights,
    /// By drawing directions of the material only: lights without extent are not found.
    Material,
}

/// Something to record besides radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Reflectance of the first surface.
    Albedo,
    /// Its geometric normal.
    Normal,
    /// Its shading normal.
    ShadingNormal,
    /// Distance to it along the ray.
    Depth,
    /// Where it is.
    Position,
    /// Its surface coordinates.
    Uv,
    /// Which shape of the scene, counted from one, at the pixel's centre; an instance counts as one; 0 for none.
    Id,
    /// Variance of the pixel's mean before filtering, and its number of samples.
    Variance,
    /// The light of each of [`Scene::light_groups`]; together they are the picture.
    Lights,
}

impl Aov {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Albedo,
        Self::Normal,
        Self::ShadingNormal,
        Self::Depth,
        Self::Position,
        Self::Uv,
        Self::Id,
        Self::Variance,
        Self::Lights,
    ];

    /// Name on the command line and of the layer in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::ShadingNormal => "shading_normal",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Uv => "uv",
            Self::Id => "id",
            Self::Variance => "variance",
            Self::Lights => "lights",
        }
    }

    /// The one called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|a| a.name() == name)
    }
}

/// An integrator and its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Integrator {
    /// How.
    pub kind: IntegratorKind,
    /// Longest path in edges, `None` unlimited: 1 shows lights only, 2 direct light, as in Mitsuba.
    pub max_depth: Option<u32>,
    /// Edges before Russian roulette may end a path.
    pub rr_depth: u32,
    /// How it looks for light.
    pub strategy: Strategy,
    /// Most radiance that a path may bring after more than one bounce; what is above is lost, and bright specks with
    /// it. `None`: nothing is.
    pub clamp: Option<f32>,
    /// The camera does not see lights.
    pub hide_emitters: bool,
    /// What to record besides radiance.
    pub aovs: Vec<Aov>,
}

impl Default for Integrator {
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            max_depth: None,
            rr_depth: 5,
            strategy: Strategy::default(),
            clamp: None,
            hide_emitters: false,
            aovs: Vec::new(),
        }
    }
}
