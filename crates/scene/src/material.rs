//! What a surface is made of, and from named values to a material, for every reader alike.

use super::Value;
use crate::{MaterialId, Scene, TextureId};
use std::sync::Arc;
use yugen_optics::{ColourSpace, Vec3};
use yugen_reflectance::{Choice, Kind, ModelError, ParamType};

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

impl Material {
    /// The materials that it is made of.
    pub fn parts(&self) -> Vec<MaterialId> {
        match self {
            Self::TwoSided { front, back } => vec![*front, *back],
            Self::Blend { first, second, .. } => vec![*first, *second],
            Self::Sum(all) => all.clone(),
            Self::Mask { base, .. }
            | Self::NormalMap { base, .. }
            | Self::BumpMap { base, .. }
            | Self::Body { base, .. }
            | Self::OneSided { base } => vec![*base],
            Self::Model { .. } | Self::Cloth { .. } | Self::Null => Vec::new(),
        }
    }
}

impl Scene {
    /// Gives a material a name, where it has none.
    pub fn name_material(&mut self, id: MaterialId, name: &str) {
        if self.material_names.len() <= id {
            self.material_names.resize(id + 1, String::new());
        }
        if self.material_names[id].is_empty() {
            self.material_names[id] = name.into();
        }
    }

    /// What a material is called; empty where it has no name.
    pub fn material_name(&self, id: MaterialId) -> &str {
        self.material_names.get(id).map_or("", String::as_str)
    }

    /// The names of a material and of all that it is made of, each once, its own first.
    pub fn names_of_material(&self, id: MaterialId) -> Vec<&str> {
        // Few materials are made of many.
        let (mut names, mut open, mut seen) = (Vec::new(), vec![id], Vec::new());
        while let Some(id) = open.pop() {
            if id >= self.materials.len() || seen.contains(&id) {
                continue;
            }
            seen.push(id);
            let name = self.material_name(id);
            if !name.is_empty() && !names.contains(&name) {
                names.push(name);
            }
            open.extend(self.materials[id].parts().into_iter().rev());
        }
        names
    }
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

/// Collects the parameters of a model by their names.
#[derive(Clone, Debug)]
pub struct ModelBuilder {
    kind: Kind,
    params: Vec<Value>,
    /// The slots that the table is baked from: those of `params`, or what stands in for a texture.
    slots: Vec<f32>,
    data: Vec<f32>,
}

impl ModelBuilder {
    /// The model's defaults.
    pub fn new(kind: Kind) -> Self {
        Self::from_slots(kind, kind.defaults(), Vec::new())
    }

    /// The model's defaults, but for these parameters.
    ///
    /// # Errors
    /// As [`ModelBuilder::set`].
    pub fn with(kind: Kind, values: &[(&str, Value)]) -> Result<Self, ModelError> {
        let mut builder = Self::new(kind);
        for (name, value) in values {
            builder.set(name, value.clone())?;
        }
        Ok(builder)
    }

    /// The model's preset `name`, colours in `space`.
    pub fn preset(kind: Kind, name: &str, space: ColourSpace) -> Result<Self, ModelError> {
        let (slots, data) = kind.preset(name, space)?;
        Ok(Self::from_slots(kind, slots, data))
    }

    fn from_slots(kind: Kind, slots: Vec<f32>, data: Vec<f32>) -> Self {
        let mut at = 0;
        let params = kind.params().iter().map(|p| {
            let s = &slots[at..at + p.width()];
            at += p.width();
            if s.len() == 3 { Value::Rgb(Vec3::from_slice(s)) } else { Value::Number(s[0]) }
        });
        Self { kind, params: params.collect(), slots, data }
    }

    /// The model called for.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The table's source numbers, instead of the preset's.
    pub fn data(&mut self, data: Vec<f32>) -> &mut Self {
        self.data = data;
        self
    }

    /// Sets a parameter. Numbers must lie in its range; the range of a texture is not looked at.
    pub fn set(&mut self, name: &str, value: Value) -> Result<&mut Self, ModelError> {
        let (_, param) = self.kind.param(name)?;
        let bad = |value: String, expected: String| ModelError::BadValue {
            model: self.kind.name(),
            param: param.name,
            value,
            expected,
        };
        let given: &[f32] = match &value {
            Value::Number(v) => &[*v],
            Value::Rgb(c) => c.as_ref(),
            Value::Texture(_) => &[],
        };
        if let ParamType::Choice(names) = param.kind {
            return Err(bad("no name".into(), format!("one of {}", names.join(", "))));
        }
        if given.iter().any(|v| !(param.min..=param.max).contains(v)) {
            let shown = given.iter().map(f32::to_string).collect::<Vec<_>>().join(", ");
            let unit = if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) };
            return Err(bad(shown, format!("{} to {}{unit}", param.min, param.max)));
        }
        self.set_any(name, value)
    }

    /// Sets a parameter without looking at its range: for files of programs that allow more.
    pub fn set_any(&mut self, name: &str, value: Value) -> Result<&mut Self, ModelError> {
        let (slot, param) = self.kind.param(name)?;
        let at = self.kind.params().iter().position(|p| p.name == name).unwrap_or_default();
        match (&value, param.width()) {
            (Value::Number(v), width) => self.slots[slot..slot + width].fill(*v),
            (Value::Rgb(c), 3) => self.slots[slot..slot + 3].copy_from_slice(c.as_ref()),
            // The readers say which space; the mean is near enough for what a table is baked from.
            (Value::Rgb(c), _) => self.slots[slot] = c.element_sum() / 3.0,
            (Value::Texture(_), _) => {}
        }
        self.params[at] = value;
        Ok(self)
    }

    /// Sets a named form.
    pub fn choose(&mut self, name: &str, choice: &str) -> Result<&mut Self, ModelError> {
        let (slot, param) = self.kind.param(name)?;
        let index = match param.kind {
            ParamType::Choice(names) => names.iter().position(|n| *n == choice),
            _ => None,
        };
        let Some(index) = index else {
            let expected = match param.kind {
                ParamType::Choice(names) => format!("one of {}", names.join(", ")),
                ParamType::Rgb => "a colour or a texture".into(),
                ParamType::Number => "a number or a texture".into(),
            };
            let value = format!("'{choice}'");
            return Err(ModelError::BadValue { model: self.kind.name(), param: param.name, value, expected });
        };
        let at = self.kind.params().iter().position(|p| p.name == name).unwrap_or_default();
        self.slots[slot] = index as f32;
        self.params[at] = Value::Number(index as f32);
        Ok(self)
    }

    /// Bakes the table and is done.
    pub fn build(self) -> Result<Material, ModelError> {
        let table = self.kind.bake(&self.slots, &self.data)?;
        Ok(Material::Model { kind: self.kind, params: self.params, table: Arc::from(table) })
    }
}

impl Material {
    /// Lambert's model with this reflectance.
    pub fn lambert(reflectance: Value) -> Self {
        let params = vec![reflectance];
        debug_assert_eq!(Kind::Lambert.params().len(), 1);
        Self::Model { kind: Kind::Lambert, params, table: Arc::from([]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_ranges_and_forms_are_checked() {
        let kind = Kind::from_name("oren_nayar").unwrap();
        let mut b = ModelBuilder::new(kind);
        let wrong = b.set("sigmo", Value::Number(0.1)).unwrap_err();
        assert!(matches!(wrong, ModelError::UnknownParam { .. }));
        let (_, rgb) = kind.param("reflectance").unwrap();
        assert!(b.set("reflectance", Value::Number(rgb.max + 1.0)).is_err());
        assert!(b.set("reflectance", Value::Number(f32::NAN)).is_err());
        b.set("reflectance", Value::Rgb(Vec3::new(0.1, 0.2, 0.3))).unwrap();
        let Material::Model { params, .. } = b.build().unwrap() else { panic!("a model") };
        assert!(params.contains(&Value::Rgb(Vec3::new(0.1, 0.2, 0.3))));
        let Some((form, names)) = kind.params().iter().find_map(|p| match p.kind {
            ParamType::Choice(names) => Some((p.name, names)),
            _ => None,
        }) else {
            panic!("oren_nayar has forms")
        };
        let mut b = ModelBuilder::new(kind);
        assert!(b.choose(form, "no such form").is_err() && b.set(form, Value::Number(0.0)).is_err());
        assert!(b.choose("reflectance", "red").is_err());
        b.choose(form, names[names.len() - 1]).unwrap();
        let Material::Model { params, .. } = b.build().unwrap() else { panic!("a model") };
        assert!(params.contains(&Value::Number((names.len() - 1) as f32)));
    }
}
