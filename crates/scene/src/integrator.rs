//! How light is followed, and what is recorded besides it.

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

    /// Names of its channels in a file. None of variance, which is made of the picture's own samples, and of lights, whose
    /// channels are those of the scene's light groups.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Self::Normal => &["normal.X", "normal.Y", "normal.Z"],
            Self::ShadingNormal => &["shading_normal.X", "shading_normal.Y", "shading_normal.Z"],
            Self::Depth => &["depth.Z"],
            Self::Position => &["position.X", "position.Y", "position.Z"],
            Self::Uv => &["uv.U", "uv.V"],
            Self::Id => &["id.Y"],
            Self::Variance | Self::Lights => &[],
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
    /// The camera does not see lights until its ray has met something that does not let all light straight through: where nothing
    /// else is, alpha is 0 and the picture black.
    pub hide_emitters: bool,
    /// What to record besides radiance.
    pub aovs: Vec<Aov>,
}

impl Integrator {
    /// Most surfaces that reflect light on its way to the camera; no limit is `u32::MAX`.
    pub fn most_bounces(&self) -> u32 {
        match self.kind {
            IntegratorKind::Direct => 1,
            // A path of n edges meets n − 1 surfaces.
            _ => self.max_depth.map_or(u32::MAX, |edges| edges.saturating_sub(1)),
        }
    }
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
