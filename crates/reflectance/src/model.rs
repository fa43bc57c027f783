//! What a reflectance model is, and the machinery that turns one list into everything else.

use crate::gaussian_light::SlopeLobe;
use bytemuck::Pod;
use glam::Vec3;
use yugen_optics::ColourSpace;

/// The type of a parameter, which fixes its width in `f32` slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamType {
    /// One number in `[min, max]`.
    Number,
    /// A linear RGB triple, each channel in `[min, max]`.
    Rgb,
    /// One of a few named forms, stored as its index.
    Choice(&'static [&'static str]),
}

/// What [`params!`] writes to the right of a field: everything about a parameter but its name.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    kind: ParamType,
    default: [f32; 3],
    min: f32,
    max: f32,
    unit: &'static str,
    doc: &'static str,
}

impl Spec {
    /// A number.
    pub const fn num(default: f32, min: f32, max: f32, unit: &'static str, doc: &'static str) -> Self {
        Self { kind: ParamType::Number, default: [default, 0.0, 0.0], min, max, unit, doc }
    }

    /// A grey colour by default.
    pub const fn rgb(default: f32, min: f32, max: f32, unit: &'static str, doc: &'static str) -> Self {
        Self { kind: ParamType::Rgb, default: [default; 3], min, max, unit, doc }
    }

    /// A colour whose default has a hue.
    pub const fn colour(
        default: [f32; 3],
        min: f32,
        max: f32,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { kind: ParamType::Rgb, default, min, max, unit, doc }
    }

    /// One of `names`; the first is index 0. `default` is an index.
    pub const fn choice(default: u32, names: &'static [&'static str], doc: &'static str) -> Self {
        assert!((default as usize) < names.len());
        Self {
            kind: ParamType::Choice(names),
            default: [default as f32, 0.0, 0.0],
            min: 0.0,
            max: (names.len() - 1) as f32,
            unit: "",
            doc,
        }
    }
}

/// One parameter of a model: read by sliders, fits, random tests and the manual alike.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Field name, the same in Rust, WGSL, scene files and on the command line.
    pub name: &'static str,
    /// Type and so width.
    pub kind: ParamType,
    /// Default; the first value only unless RGB.
    pub default: [f32; 3],
    /// Smallest sensible value.
    pub min: f32,
    /// Largest sensible value.
    pub max: f32,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// One line for people.
    pub doc: &'static str,
}

impl Param {
    /// Used by [`params!`].
    pub const fn named(name: &'static str, s: Spec) -> Self {
        Self { name, kind: s.kind, default: s.default, min: s.min, max: s.max, unit: s.unit, doc: s.doc }
    }

    /// Slots of `f32` it takes.
    pub const fn width(&self) -> usize {
        match self.kind {
            ParamType::Rgb => 3,
            _ => 1,
        }
    }

    /// The default as slots.
    pub fn default_slots(&self) -> &[f32] {
        &self.default[..self.width()]
    }
}

/// A named form of a model, stored as a number so that a parameter block is nothing but `f32`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Choice(pub f32);

impl Choice {
    /// Position in the list of names.
    pub fn index(self) -> u32 {
        self.0 as u32
    }
}

/// Implemented by [`params!`]: the parameter table of a struct of `f32`s.
pub trait Params: Pod {
    /// In field order, without gaps.
    const PARAMS: &'static [Param];

    /// The defaults of the table.
    fn defaults() -> Self {
        let mut value = Self::zeroed();
        let slots: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut value));
        let mut at = 0;
        for p in Self::PARAMS {
            slots[at..at + p.width()].copy_from_slice(p.default_slots());
            at += p.width();
        }
        value
    }
}

/// Declares the parameters of a model once: a `#[repr(C)]` struct of `f32`, [`Params::PARAMS`] and, from
/// that, the WGSL struct. Field types are `f32`, `Vec3` (RGB) and [`Choice`].
macro_rules! params {
    ($(#[$meta:meta])* pub struct $name:ident { $( $field:ident : $ty:ty = $spec:expr ),* $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name {
            $( #[doc = concat!("See `PARAMS`, entry `", stringify!($field), "`.")] pub $field: $ty, )*
        }
        impl $crate::Params for $name {
            const PARAMS: &'static [$crate::Param] =
                &[ $( $crate::Param::named(stringify!($field), $spec) ),* ];
        }
        impl Default for $name {
            fn default() -> Self {
                <Self as $crate::Params>::defaults()
            }
        }
    };
}
pub(crate) use params;

/// What a model promises. Where it breaks a law by design, the tests assert that it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laws {
    /// f(wo, wi) = f(wi, wo). (Helmholtz.) Across an interface: up to the square of the relative index.
    pub reciprocal: bool,
    /// ∫ f cos ≤ 1 for every parameter in range and every direction. Where light passes through, this is about
    /// the flux that leaves: radiance may grow with the square of the index it enters.
    pub conserves_energy: bool,
    /// Light passes through: `wi` may lie below the surface and `wo` may come from below.
    pub transmits: bool,
    /// Nothing but Dirac peaks: `eval` and `pdf` are zero, only `sample` finds light.
    pub delta: bool,
    /// Turning both directions about +z changes nothing, for the default parameters.
    pub isotropic: bool,
    /// Why a law is broken, for the manual; empty where none is.
    pub why: &'static str,
}

impl Laws {
    /// A well-behaved isotropic reflector.
    pub const PHYSICAL: Self = Self {
        reciprocal: true,
        conserves_energy: true,
        transmits: false,
        delta: false,
        isotropic: true,
        why: "",
    };
}

/// A direction drawn by a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// To the light.
    pub wi: Vec3,
    /// f |cos θ_i| / pdf, where pdf is that of the whole model; for a Dirac peak the peak's own weight over
    /// the probability of choosing it.
    pub weight: Vec3,
    /// Density per solid angle of the whole model, equal to `Model::pdf(wo, wi)`; for a Dirac peak the
    /// probability of choosing it.
    pub pdf: f32,
    /// Whether `wi` came from a Dirac peak.
    pub delta: bool,
    /// Relative index of refraction crossed, 1 for reflection.
    pub eta: f32,
}

impl Sample {
    /// The draw `wi` of a reflector, with weight and density of the whole model; `None` where it carries no light.
    #[inline]
    pub fn of<M: Model>(model: &M, table: &[f32], wo: Vec3, wi: Vec3) -> Option<Self> {
        if !(wo.z > 0.0 && wi.z > 0.0) {
            return None;
        }
        Self::across(model, table, wo, wi, 1.0)
    }

    /// The same for a draw `wi` on either side of the surface, where light crosses the relative index `eta` (1 where it
    /// crosses none).
    #[inline]
    pub fn across<M: Model>(model: &M, table: &[f32], wo: Vec3, wi: Vec3, eta: f32) -> Option<Self> {
        let (f, pdf) = model.eval_pdf(table, wo, wi);
        // An underflown density would make the weight 0/0.
        if !(pdf > f32::MIN_POSITIVE && pdf.is_finite()) {
            return None;
        }
        Some(Self { wi, weight: f * (wi.z.abs() / pdf), pdf, delta: false, eta })
    }
}

/// The three terms of a model that is D G F over cosines, each as the model itself computes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Distribution of normals at the half vector, in 1/sr where it is normalised (∫ D cos θ_h dω = 1); a form that
    /// is printed without its normaliser gives what is printed.
    pub d: f32,
    /// Masking and shadowing: the part of the facets that both directions see, 0 to 1.
    pub g: f32,
    /// Fresnel reflectance at the angle between either direction and the half vector, linear RGB.
    pub f: Vec3,
}

/// Where a model's table comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Data {
    /// It has no table or makes it from its parameters alone.
    None,
    /// It needs numbers from outside: the text says which.
    Required(&'static str),
    /// It can take numbers from outside and has a default without.
    Optional(&'static str),
}

/// Parameters with a name, for example a fabric of a paper or a metal.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Lower-case, `snake_case`.
    pub name: &'static str,
    /// One line for people, with the source.
    pub doc: &'static str,
}

/// Why a model could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A model called that does not exist.
    #[error("there is no reflectance model called '{0}'")]
    UnknownModel(String),
    /// A parameter called that does not exist.
    #[error("model '{model}' has no parameter '{param}' (it has {known})")]
    UnknownParam {
        /// The model.
        model: &'static str,
        /// The name asked for.
        param: String,
        /// Those there are.
        known: String,
    },
    /// A preset called that does not exist.
    #[error("model '{model}' has no preset '{preset}' ({known})")]
    UnknownPreset {
        /// The model.
        model: &'static str,
        /// The name asked for.
        preset: String,
        /// Which there are, as a clause.
        known: String,
    },
    /// A value outside what the parameter allows.
    #[error("parameter '{param}' of model '{model}' is {value}; expected {expected}")]
    BadValue {
        /// The model.
        model: &'static str,
        /// The parameter.
        param: &'static str,
        /// What was given.
        value: String,
        /// What would do.
        expected: String,
    },
    /// The table is missing or not of the right form.
    #[error("model '{model}' {problem}")]
    BadTable {
        /// The model.
        model: &'static str,
        /// What is wrong with it.
        problem: String,
    },
}

/// A reflectance model: its parameters are `Self`, its table the `table` argument.
pub trait Model: Params + Send + Sync + 'static {
    /// Lower-case, `snake_case`: the name in scene files, on the command line and of the two source files.
    const NAME: &'static str;
    /// Author, year, title.
    const SOURCE: &'static str;
    /// A short description for the manual: what it is for and where it ends.
    const DOC: &'static str;
    /// What it promises with its default parameters.
    const LAWS: Laws;
    /// Its twin: `<name>_eval`, `<name>_pdf`, `<name>_sample` (see `frame.wgsl`).
    const WGSL: &'static str;
    /// The twin's worst error against `eval`, relative to the larger of the two values and `TWIN.1`:
    /// measured on lavapipe, then set near four times the worst seen. `(relative, floor)`.
    const TWIN: (f32, f32) = (1e-4, 1e-6);
    /// Whether a call takes longer than a shadow ray, some 100 ns (`cargo xtask bench bsdf`).
    const COSTLY: bool = false;
    /// Where its table comes from.
    const DATA: Data = Data::None;
    /// Named parameters.
    const PRESETS: &'static [Preset] = &[];

    /// The preset `name`, colours in `space`, with the data `bake` takes; `None` if there is none.
    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let _ = (name, space);
        None
    }

    /// The table `eval` and the shader read, from outside `data` (empty for [`Data::None`]). Called once per
    /// material with its constant parameters.
    fn bake(&self, data: &[f32]) -> Result<Vec<f32>, ModelError> {
        Ok(data.to_vec())
    }

    /// What it promises with these parameters. A model with literal and corrected forms answers per form;
    /// whoever tests or documents a model in one configuration asks this, through [`crate::Bsdf::laws`].
    /// A law said to be broken is broken for some parameters and directions of that form, not for all.
    fn laws(&self) -> Laws {
        Self::LAWS
    }

    /// f(wo, wi) in 1/sr, without the cosine; zero below the horizon unless the model transmits.
    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3;

    /// Density per solid angle with which `sample` draws `wi`.
    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32;

    /// Draws `wi` from three uniforms in [0, 1); `None` where the draw carries no light. `u.z` chooses lobes.
    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample>;

    /// Both at once, for models that share work between them.
    fn eval_pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        (self.eval(table, wo, wi), self.pdf(table, wo, wi))
    }

    /// The narrow part of f and the rest of it at these directions, for lights of small extent
    /// ([`Bsdf::reflect_gaussian`]); `None` for a model that is broad, or is not a lobe of slopes.
    fn slope_lobe(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Option<SlopeLobe> {
        let _ = (table, wo, wi);
        None
    }

    /// D, G and F for two directions above the surface; `None` for a model that is not made of them.
    fn terms(&self, wo: Vec3, wi: Vec3) -> Option<Terms> {
        let _ = (wo, wi);
        None
    }

    /// Albedo guess for denoisers and AOVs: colour of the surface as seen head on.
    fn albedo(&self, table: &[f32]) -> Vec3 {
        // f·π at a typical pair: exact for Lambert, a fair hue for the rest.
        let w = Vec3::new(0.0, 0.0, 1.0);
        (self.eval(table, w, Vec3::new(0.5, 0.0, 0.75f32.sqrt())) * std::f32::consts::PI)
            .clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// The list. Each line `file::Type` declares the module and adds the model everywhere.
macro_rules! models {
    ($($module:ident :: $model:ident),* $(,)?) => {
        $( #[allow(missing_docs)] pub mod $module; )*

        /// Which model. Made from the list of models.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(missing_docs)]
        #[repr(u32)]
        pub enum Kind { $( $model ),* }

        const fn max_slots() -> usize {
            let sizes = [$( std::mem::size_of::<$module::$model>() / 4 ),*];
            let (mut i, mut max) = (0, 0);
            while i < sizes.len() {
                if sizes[i] > max { max = sizes[i]; }
                i += 1;
            }
            max
        }

        /// The widest parameter block, in `f32`.
        pub const MAX_SLOTS: usize = max_slots();

        impl Kind {
            /// Every model, in the order of the list.
            pub const ALL: &'static [Kind] = &[ $( Kind::$model ),* ];

            /// Lower-case name.
            pub fn name(self) -> &'static str { match self { $( Kind::$model => <$module::$model as Model>::NAME ),* } }
            /// Author, year, title.
            pub fn source(self) -> &'static str { match self { $( Kind::$model => <$module::$model as Model>::SOURCE ),* } }
            /// Description for the manual.
            pub fn doc(self) -> &'static str { match self { $( Kind::$model => <$module::$model as Model>::DOC ),* } }
            /// What it promises with its default parameters; [`Bsdf::laws`] for others.
            pub fn laws(self) -> Laws { match self { $( Kind::$model => <$module::$model as Model>::LAWS ),* } }
            /// Its twin.
            pub fn wgsl(self) -> &'static str { match self { $( Kind::$model => <$module::$model as Model>::WGSL ),* } }
            /// Tolerance of its twin: (relative, floor).
            pub fn twin_tolerance(self) -> (f32, f32) { match self { $( Kind::$model => <$module::$model as Model>::TWIN ),* } }
            /// Whether a call takes longer than a shadow ray.
            pub fn costly(self) -> bool { match self { $( Kind::$model => <$module::$model as Model>::COSTLY ),* } }
            /// Where its table comes from.
            pub fn data(self) -> Data { match self { $( Kind::$model => <$module::$model as Model>::DATA ),* } }
            /// Named parameters.
            pub fn presets(self) -> &'static [Preset] { match self { $( Kind::$model => <$module::$model as Model>::PRESETS ),* } }
            /// The parameter table.
            pub fn params(self) -> &'static [Param] { match self { $( Kind::$model => <$module::$model as Params>::PARAMS ),* } }

            fn preset_raw(self, name: &str, space: yugen_optics::ColourSpace) -> Option<(Vec<f32>, Vec<f32>)> {
                match self {
                    $( Kind::$model => <$module::$model as Model>::preset(name, space)
                        .map(|(p, data)| (bytemuck::cast_slice(&[p]).to_vec(), data)) ),*
                }
            }

            /// The table of the model with these parameter slots, from outside `data` (may be empty).
            pub fn bake(self, slots: &[f32], data: &[f32]) -> Result<Vec<f32>, ModelError> {
                match self {
                    $( Kind::$model => bytemuck::pod_read_unaligned::<$module::$model>(
                        bytemuck::cast_slice(&slots[..std::mem::size_of::<$module::$model>() / 4])).bake(data) ),*
                }
            }
        }

        impl Bsdf<'_> {
            /// f(wo, wi) in 1/sr, without the cosine.
            #[inline]
            pub fn eval(&self, wo: glam::Vec3, wi: glam::Vec3) -> glam::Vec3 {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().eval(self.table, wo, wi) ),* }
            }
            /// Density per solid angle with which `sample` draws `wi`.
            #[inline]
            pub fn pdf(&self, wo: glam::Vec3, wi: glam::Vec3) -> f32 {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().pdf(self.table, wo, wi) ),* }
            }
            /// Both at once.
            #[inline]
            pub fn eval_pdf(&self, wo: glam::Vec3, wi: glam::Vec3) -> (glam::Vec3, f32) {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().eval_pdf(self.table, wo, wi) ),* }
            }
            /// Draws `wi` from three uniforms in [0, 1).
            #[inline]
            pub fn sample(&self, wo: glam::Vec3, u: glam::Vec3) -> Option<Sample> {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().sample(self.table, wo, u) ),* }
            }
            /// What the model promises with these parameters (its form may break a law the default keeps).
            pub fn laws(&self) -> Laws {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().laws() ),* }
            }
            /// D, G and F for two directions above the surface; `None` for a model that is not made of them.
            pub fn terms(&self, wo: glam::Vec3, wi: glam::Vec3) -> Option<Terms> {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().terms(wo, wi) ),* }
            }
            /// The narrow part of f and the rest of it at these directions.
            pub fn slope_lobe(&self, wo: glam::Vec3, wi: glam::Vec3) -> Option<$crate::gaussian_light::SlopeLobe> {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().slope_lobe(self.table, wo, wi) ),* }
            }
            /// Albedo guess for AOVs.
            pub fn albedo(&self) -> glam::Vec3 {
                match self.kind { $( Kind::$model => self.params::<$module::$model>().albedo(self.table) ),* }
            }
        }

        impl Kind {
            /// The model called `name`.
            pub fn from_name(name: &str) -> Result<Self, ModelError> {
                Self::ALL.iter().copied().find(|k| k.name() == name)
                    .ok_or_else(|| ModelError::UnknownModel(name.to_string()))
            }

            /// Slots its parameters take.
            pub fn slots(self) -> usize {
                self.params().iter().map(Param::width).sum()
            }

            /// The defaults of its parameter table, as slots.
            pub fn defaults(self) -> Vec<f32> {
                self.params().iter().flat_map(|p| p.default_slots().iter().copied()).collect()
            }

            /// A parameter by its name, with the index of its first slot.
            pub fn param(self, name: &str) -> Result<(usize, &'static Param), ModelError> {
                let mut at = 0;
                for p in self.params() {
                    if p.name == name {
                        return Ok((at, p));
                    }
                    at += p.width();
                }
                let known = self.params().iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
                Err(ModelError::UnknownParam { model: self.name(), param: name.to_string(), known })
            }

            /// The preset called `name`: parameter slots and the data for [`Kind::bake`].
            pub fn preset(self, name: &str, space: yugen_optics::ColourSpace) -> Result<(Vec<f32>, Vec<f32>), ModelError> {
                self.preset_raw(name, space).ok_or_else(|| ModelError::UnknownPreset {
                    model: self.name(),
                    preset: name.to_string(),
                    known: match self.presets() {
                        [] => "it has none".into(),
                        all => format!("it has {}", all.iter().map(|p| p.name).collect::<Vec<_>>().join(", ")),
                    },
                })
            }
        }

        /// A model at one point: its parameters, textured or not, and its table. Borrows both, so that it is
        /// free to make.
        #[derive(Clone, Copy, Debug)]
        pub struct Bsdf<'a> {
            /// Which model.
            pub kind: Kind,
            /// Its parameters in table order.
            pub slots: &'a [f32],
            /// Its table; empty for most.
            pub table: &'a [f32],
        }

        impl<'a> Bsdf<'a> {
            /// From parameter slots and a baked table.
            pub fn new(kind: Kind, slots: &'a [f32], table: &'a [f32]) -> Self {
                Self { kind, slots, table }
            }

            #[inline]
            fn params<P: Params>(&self) -> &P {
                bytemuck::from_bytes(bytemuck::cast_slice(&self.slots[..std::mem::size_of::<P>() / 4]))
            }
        }
    };
}
pub(crate) use models;
