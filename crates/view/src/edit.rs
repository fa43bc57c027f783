//! Changes to materials and lights, and the scene that they make.

use crate::command::LightChange;
use glam::Vec3;
use std::collections::BTreeMap;
use std::sync::Arc;
use yugen_reflectance::{Data, Kind, Param, ParamType};
use yugen_scene::{Geometry, Light, Material, MaterialId, ModelBuilder, Scene, Shape, Texture, Value};

/// A light of the scene, one that is a shape included.
#[derive(Clone, Debug, PartialEq)]
pub struct LightItem {
    /// Its name; with a number where others share it.
    pub name: String,
    /// Its kind, as scene files call it.
    pub kind: &'static str,
    /// Whether it shines.
    pub on: bool,
    /// Brighter than the scene says by so many stops.
    pub stops: f32,
    source: Source,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Source {
    Shape(usize),
    Light(usize),
}

/// A material that is a reflectance model.
#[derive(Clone, Debug)]
pub struct MaterialItem {
    /// Index in the scene.
    pub id: MaterialId,
    /// Which model.
    pub kind: Kind,
    /// Shapes that wear it, alone or under others; each name once.
    pub worn_by: Vec<String>,
}

/// What was changed of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edits {
    /// All lights as they now are.
    pub lights: Vec<LightItem>,
    /// Materials that are of another model than the scene says.
    pub models: BTreeMap<MaterialId, Swapped>,
    /// Values of parameters: of a material, the parameter of this index in the model that it now is.
    pub parameters: BTreeMap<(MaterialId, usize), Value>,
}

/// Another model in the place of a material's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Swapped {
    /// What the scene says.
    pub own: Kind,
    /// What it is now.
    pub kind: Kind,
    params: Vec<Value>,
    table: Arc<[f32]>,
}

/// Parameters of different names that mean the same in different models, so that a colour outlives a change of model. What is
/// only a factor on a reflection (`specular_reflectance`) is not its strength.
const ALIKE: &[&[&str]] = &[
    &["reflectance", "diffuse_reflectance", "diffuse", "rho_d", "base_color", "body_colour"],
    &["specular", "rho_s", "f0", "interface_colour"],
    &["alpha_x", "sigma_x", "alpha", "m"],
    &["alpha_y", "sigma_y", "alpha", "m"],
];

/// The models that any material may become: those that need no measured file.
fn free_models() -> impl Iterator<Item = Kind> {
    Kind::ALL.iter().copied().filter(|kind| !matches!(kind.data(), Data::Required(_)))
}

impl Edits {
    /// None, of `scene`.
    pub fn none(scene: &Scene) -> Self {
        Self { lights: lights(scene), ..Self::default() }
    }

    /// Whether the scene is as it was read.
    pub fn is_empty(&self) -> bool {
        self.models.is_empty()
            && self.parameters.is_empty()
            && self.lights.iter().all(|l| l.on && l.stops == 0.0)
    }

    /// The light called so, or of this number, counted from one.
    pub fn light(&self, which: &str) -> Result<usize, String> {
        let by_name = self.lights.iter().position(|l| l.name == which);
        let by_number =
            || which.parse().ok().and_then(|n: usize| n.checked_sub(1)).filter(|n| *n < self.lights.len());
        by_name.or_else(by_number).ok_or_else(|| match self.lights.len() {
            0 => "the scene has no lights".to_string(),
            n => {
                let hint = yugen_scene::suggest(which, self.lights.iter().map(|l| l.name.as_str()));
                format!("there is no light '{which}' among the {n} of the scene{hint}")
            }
        })
    }

    /// Changes a light.
    pub fn change_light(&mut self, index: usize, change: LightChange) {
        let Some(light) = self.lights.get_mut(index) else { return };
        match change {
            LightChange::Switch(on) => light.on = on.unwrap_or(!light.on),
            LightChange::Stops(stops) => light.stops = stops.clamp(-20.0, 20.0),
        }
    }

    /// Gives a parameter of a material a value: one number, three for a colour, or the name of a form.
    pub fn set(&mut self, item: &MaterialItem, parameter: &str, words: &[String]) -> Result<(), String> {
        let numbers: Option<Vec<f32>> = words.iter().map(|w| w.parse().ok()).collect();
        let kind = item.kind;
        let (_, param) = kind.param(parameter).map_err(|e| e.to_string())?;
        // The builder knows ranges and forms; what it makes of this one value is all that is asked of it.
        let mut builder = ModelBuilder::new(kind);
        let value = match (numbers.as_deref(), param.kind) {
            (_, ParamType::Choice(names)) => {
                let name = words.first().map_or("", String::as_str);
                builder.choose(parameter, name).map_err(|e| e.to_string())?;
                Value::Number(names.iter().position(|n| *n == name).unwrap_or_default() as f32)
            }
            (Some([v]), _) => Value::Number(*v),
            (Some([r, g, b]), ParamType::Rgb) => Value::Rgb(Vec3::new(*r, *g, *b)),
            _ => {
                let wanted = if param.kind == ParamType::Rgb { "one number or three" } else { "one number" };
                return Err(format!(
                    "'{parameter}' of {} takes {wanted}, not '{}'",
                    kind.name(),
                    words.join(" ")
                ));
            }
        };
        if !matches!(param.kind, ParamType::Choice(_)) {
            builder.set(parameter, value.clone()).map_err(|e| e.to_string())?;
        }
        let index = kind.params().iter().position(|p| p.name == parameter).unwrap_or_default();
        self.parameters.insert((item.id, index), value);
        Ok(())
    }

    /// The models that a material may become: its own, and those that need no measured file.
    pub fn models(scene: &Scene, id: MaterialId) -> impl Iterator<Item = Kind> {
        let own = match scene.materials.get(id) {
            Some(Material::Model { kind, .. }) => Some(*kind),
            _ => None,
        };
        own.into_iter().chain(free_models().filter(move |kind| Some(*kind) != own))
    }

    /// Makes a material one of another model. What both have (a parameter of the same name, or of the same meaning) is kept,
    /// the rest has its defaults; back in the scene's own model, it is as the scene says.
    pub fn change_model(&mut self, scene: &Scene, item: &MaterialItem, kind: Kind) -> Result<(), String> {
        let Some(Material::Model { kind: own, .. }) = scene.materials.get(item.id) else { return Ok(()) };
        if kind == item.kind {
            return Ok(());
        }
        if kind == *own {
            self.parameters.retain(|(id, _), _| *id != item.id);
            self.models.remove(&item.id);
            return Ok(());
        }
        let mut builder = ModelBuilder::new(kind);
        let old = item.kind.params();
        for param in kind.params() {
            let alike = |name: &str| ALIKE.iter().any(|all| all.contains(&name) && all.contains(&param.name));
            let same = old.iter().position(|p| p.name == param.name);
            let Some(i) = same.or_else(|| old.iter().position(|p| alike(p.name))) else { continue };
            let Some(value) = self.value(scene, item.id, i) else { continue };
            // What the other model does not take stays at its default.
            let _ = match (param.kind, old[i].kind, value) {
                (ParamType::Choice(_), ParamType::Choice(names), Value::Number(n)) => {
                    builder.choose(param.name, names.get(n as usize).unwrap_or(&""))
                }
                (ParamType::Choice(_), ..) | (_, ParamType::Choice(_), _) => continue,
                (_, _, Value::Rgb(c)) if param.width() == 1 => {
                    builder.set(param.name, Value::Number(c.element_sum() / 3.0))
                }
                (_, _, value) => builder.set(param.name, value),
            };
        }
        let built = builder.build().map_err(|e| e.to_string())?;
        let Material::Model { params, table, .. } = built else { return Ok(()) };
        self.parameters.retain(|(id, _), _| *id != item.id);
        self.models.insert(item.id, Swapped { own: *own, kind, params, table });
        Ok(())
    }

    /// The value of a parameter of a material as it now is.
    pub fn value(&self, scene: &Scene, id: MaterialId, index: usize) -> Option<Value> {
        let read = || match (self.models.get(&id), scene.materials.get(id)) {
            (Some(Swapped { params, .. }), _) | (_, Some(Material::Model { params, .. })) => {
                params.get(index).cloned()
            }
            _ => None,
        };
        self.parameters.get(&(id, index)).cloned().or_else(read)
    }

    /// The materials of a scene that have parameters, those that are worn first, as the models that they now are.
    pub fn materials(&self, scene: &Scene) -> Vec<MaterialItem> {
        let mut all = materials(scene);
        for item in &mut all {
            item.kind = self.models.get(&item.id).map_or(item.kind, |m| m.kind);
        }
        all
    }

    /// `scene` with all changes. A light that is off has no power, and one that has none stays in the tables, so that both
    /// renderers find the same lights in the same places.
    pub fn apply(&self, scene: &Scene) -> Result<Scene, String> {
        let mut scene = scene.clone();
        self.light_scene(&mut scene);
        self.change_materials(&mut scene)?;
        Ok(scene)
    }

    /// The changes of lights.
    pub fn light_scene(&self, scene: &mut Scene) {
        for light in &self.lights {
            let factor = if light.on { light.stops.exp2() } else { 0.0 };
            if factor != 1.0 {
                dim(scene, light.source, factor);
            }
        }
    }

    /// The changes of materials; a table that is computed from parameters is computed anew.
    pub fn change_materials(&self, scene: &mut Scene) -> Result<(), String> {
        for (id, model) in &self.models {
            if let Some(material) = scene.materials.get_mut(*id) {
                let Swapped { kind, params, table, .. } = model.clone();
                *material = Material::Model { kind, params, table };
            }
        }
        let mut changed: Vec<MaterialId> = self.parameters.keys().map(|(id, _)| *id).collect();
        changed.dedup();
        for id in changed {
            let Some(Material::Model { kind, params, table }) = scene.materials.get_mut(id) else { continue };
            let before = slots(*kind, params);
            for ((_, index), value) in self.parameters.range((id, 0)..(id + 1, 0)) {
                if let Some(param) = params.get_mut(*index) {
                    *param = value.clone();
                }
            }
            let after = slots(*kind, params);
            // A table that was measured is not made of the parameters and stays.
            let own = match kind.data() {
                Data::None => true,
                Data::Optional(_) => kind.bake(&before, &[]).is_ok_and(|t| t[..] == table[..]),
                Data::Required(_) => false,
            };
            if own {
                let name = kind.name();
                *table = Arc::from(
                    kind.bake(&after, &[]).map_err(|e| format!("material {}, {name}: {e}", id + 1))?,
                );
            }
        }
        Ok(())
    }
}

/// Parameters as the numbers that a table is baked from; where a texture stands, the default.
fn slots(kind: Kind, params: &[Value]) -> Vec<f32> {
    let mut out = Vec::with_capacity(kind.slots());
    for (param, value) in kind.params().iter().zip(params) {
        match (value, param.width()) {
            (Value::Number(v), width) => out.extend(std::iter::repeat_n(*v, width)),
            (Value::Rgb(c), 3) => out.extend(c.to_array()),
            (Value::Rgb(c), _) => out.push(c.element_sum() / 3.0),
            (Value::Texture(_), _) => out.extend(param.default_slots()),
        }
    }
    out
}

fn dim(scene: &mut Scene, source: Source, factor: f32) {
    match source {
        Source::Shape(i) => {
            let Some(emission) = scene.shapes.get_mut(i).and_then(|s| s.emission.as_mut()) else { return };
            match emission {
                Value::Number(v) => *v *= factor,
                Value::Rgb(c) => *c *= factor,
                Value::Texture(texture) => {
                    let texture = *texture;
                    *emission = Value::Texture(scene.textures.len());
                    scene.textures.push(Texture::Scaled { texture, factor: Vec3::splat(factor) });
                }
            }
        }
        Source::Light(i) => match scene.lights.get_mut(i) {
            Some(Light::Point { intensity, .. } | Light::Spot { intensity, .. }) => *intensity *= factor,
            Some(Light::Directional { irradiance, .. }) => *irradiance *= factor,
            Some(Light::Constant { radiance }) => *radiance *= factor,
            Some(
                Light::Environment { scale, .. }
                | Light::Projector { scale, .. }
                | Light::Volume { scale, .. },
            ) => *scale *= factor,
            None => {}
        },
    }
}

fn lights(scene: &Scene) -> Vec<LightItem> {
    let mut all: Vec<LightItem> = Vec::new();
    let mut add = |name: &str, kind, source| {
        let taken = |name: &str| all.iter().any(|l: &LightItem| l.name == name);
        let mut unique = if name.is_empty() { kind } else { name }.to_string();
        let mut number = 2;
        while taken(&unique) {
            unique = format!("{} {number}", if name.is_empty() { kind } else { name });
            number += 1;
        }
        all.push(LightItem { name: unique, kind, on: true, stops: 0.0, source });
    };
    for (i, shape) in scene.shapes.iter().enumerate().filter(|(_, s)| s.emission.is_some()) {
        add(&shape.name, "area", Source::Shape(i));
    }
    for (i, light) in scene.lights.iter().enumerate() {
        let kind = match light {
            Light::Point { .. } => "point",
            Light::Spot { .. } => "spot",
            Light::Directional { .. } => "directional",
            Light::Constant { .. } => "constant",
            Light::Environment { .. } => "environment",
            Light::Projector { .. } => "projector",
            Light::Volume { .. } => "fire",
        };
        let name = scene.light_name(i);
        add(if name == "light" || name == kind { "" } else { name }, kind, Source::Light(i));
    }
    all
}

/// Reflectance models that a material is made of, itself or beneath others.
pub fn models_of(scene: &Scene, id: MaterialId) -> Vec<MaterialId> {
    let (mut found, mut open, mut seen) = (Vec::new(), vec![id], vec![false; scene.materials.len()]);
    while let Some(id) = open.pop() {
        if seen.get(id).copied().unwrap_or(true) {
            continue;
        }
        seen[id] = true;
        let material = &scene.materials[id];
        found.extend(matches!(material, Material::Model { .. }).then_some(id));
        open.extend(material.parts().into_iter().rev());
    }
    found
}

/// The materials of a scene that have parameters, those that are worn first.
pub fn materials(scene: &Scene) -> Vec<MaterialItem> {
    let mut worn_by: Vec<Vec<String>> = vec![Vec::new(); scene.materials.len()];
    let mut wear = |material: MaterialId, name: &str| {
        for id in models_of(scene, material) {
            if !name.is_empty() && !worn_by[id].iter().any(|n| n == name) {
                worn_by[id].push(name.to_string());
            }
        }
    };
    for shape in &scene.shapes {
        match &shape.geometry {
            Geometry::Instance(group) => {
                let inside: &[Shape] = scene.groups.get(*group).map_or(&[], |g| &g[..]);
                inside.iter().for_each(|s| wear(s.material, &shape.name));
            }
            _ => wear(shape.material, &shape.name),
        }
    }
    let mut all: Vec<MaterialItem> = scene
        .materials
        .iter()
        .zip(worn_by)
        .enumerate()
        .filter_map(|(id, (m, worn_by))| match m {
            Material::Model { kind, .. } => Some(MaterialItem { id, kind: *kind, worn_by }),
            _ => None,
        })
        .collect();
    all.sort_by_key(|m| m.worn_by.is_empty());
    all
}

/// A parameter's value as numbers, three for a colour; `None` where a texture says it.
pub fn shown(value: &Value, param: &Param) -> Option<Vec<f32>> {
    match value {
        Value::Number(v) => Some(vec![*v; param.width()]),
        Value::Rgb(c) if param.width() == 3 => Some(c.to_array().to_vec()),
        Value::Rgb(c) => Some(vec![c.element_sum() / 3.0]),
        Value::Texture(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Mat4;

    fn scene() -> Scene {
        let rough = ModelBuilder::new(Kind::RoughPlastic).build().expect("its defaults");
        let mut scene = Scene {
            materials: vec![
                Material::lambert(Value::Number(0.5)),
                rough,
                Material::TwoSided { front: 1, back: 0 },
                Material::OneSided { base: 4 },
            ],
            shapes: vec![
                Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 2),
                Shape {
                    emission: Some(Value::Rgb(Vec3::ONE)),
                    ..Shape::new("lamp", Geometry::Disc, Mat4::IDENTITY, 0)
                },
                Shape {
                    emission: Some(Value::Texture(0)),
                    ..Shape::new("lamp", Geometry::Disc, Mat4::IDENTITY, 0)
                },
            ],
            textures: vec![Texture::MeshAttribute { name: "x".into() }],
            ..Scene::default()
        };
        scene.add_light("", Light::Point { position: Vec3::ZERO, intensity: Vec3::splat(8.0) });
        scene.add_light("sky", Light::Constant { radiance: Vec3::ONE });
        scene
    }

    #[test]
    fn lights_go_off_and_come_back() {
        let scene = scene();
        let mut edits = Edits::none(&scene);
        let names: Vec<_> = edits.lights.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["lamp", "lamp 2", "point", "sky"]);
        assert!(edits.is_empty());
        let point = edits.light("3").expect("the third");
        assert_eq!(point, edits.light("point").expect("by its name"));
        assert!(edits.light("0").is_err() && edits.light("5").is_err());
        assert!(edits.light("poimt").expect_err("none").contains("did you mean 'point'"));
        edits.change_light(point, LightChange::Stops(-3.0));
        edits.change_light(0, LightChange::Switch(None));
        edits.change_light(1, LightChange::Switch(Some(false)));
        assert!(!edits.is_empty());
        let lit = edits.apply(&scene).expect("it can be");
        let Light::Point { intensity, .. } = lit.lights[0] else { panic!("a point") };
        assert_eq!(intensity, Vec3::ONE);
        assert_eq!(lit.shapes[1].emission, Some(Value::Rgb(Vec3::ZERO)));
        assert_eq!(lit.shapes[2].emission, Some(Value::Texture(1)));
        edits.change_light(point, LightChange::Stops(0.0));
        edits.change_light(0, LightChange::Switch(None));
        edits.change_light(1, LightChange::Switch(Some(true)));
        assert!(edits.is_empty());
    }

    #[test]
    fn parameters_are_checked_and_tables_baked_anew() {
        let scene = scene();
        let all = materials(&scene);
        assert_eq!(all.iter().map(|m| m.id).collect::<Vec<_>>(), [0, 1]);
        let plastic = all.iter().find(|m| m.kind == Kind::RoughPlastic).expect("there is one");
        assert_eq!(plastic.worn_by, ["ball"]);
        let mut edits = Edits::none(&scene);
        let words = |w: &str| -> Vec<String> { w.split_whitespace().map(String::from).collect() };
        let param = |holds: &dyn Fn(&Param) -> bool| {
            *Kind::RoughPlastic.params().iter().find(|p| holds(p)).expect("one")
        };
        let rough = param(&|p| p.name.contains("alpha"));
        edits.set(plastic, rough.name, &words("0.3")).expect("it is in range");
        let colour = param(&|p| p.kind == ParamType::Rgb);
        edits.set(plastic, colour.name, &words("0.1 0.2 0.3")).expect("a colour");
        for (name, value, said) in [
            (rough.name, "-1", "to"),
            (rough.name, "x", "takes one number"),
            (rough.name, "nan", "to"),
            (rough.name, "1 2 3", "takes one number"),
            ("aplha", "1", "no parameter 'aplha'"),
        ] {
            let error = edits.set(plastic, name, &words(value)).expect_err(value);
            assert!(error.contains(said), "{name} {value}: {error}");
        }
        let changed = edits.apply(&scene).expect("it can be");
        let (Material::Model { table: a, .. }, Material::Model { table: b, params, kind }) =
            (&scene.materials[1], &changed.materials[1])
        else {
            panic!("models")
        };
        assert!(params.contains(&Value::Rgb(Vec3::new(0.1, 0.2, 0.3))));
        assert_eq!(&b[..], &kind.bake(&slots(*kind, params), &[]).expect("a table")[..]);
        assert!(a.is_empty() || a[..] != b[..], "the table is still that of before");
        let index = kind.params().iter().position(|p| p.name == rough.name).expect("it has it");
        assert_eq!(edits.value(&scene, 1, index), Some(Value::Number(0.3)));
    }

    #[test]
    fn a_material_becomes_another_model_and_its_own_again() {
        let scene = scene();
        let mut edits = Edits::none(&scene);
        let item =
            |edits: &Edits| edits.materials(&scene).into_iter().find(|m| m.id == 1).expect("it has one");
        let words = |w: &str| -> Vec<String> { w.split_whitespace().map(String::from).collect() };
        edits.set(&item(&edits), "diffuse_reflectance", &words("0.1 0.2 0.3")).expect("a colour");
        edits.set(&item(&edits), "alpha", &words("0.25")).expect("in its range");
        edits.change_model(&scene, &item(&edits), Kind::Ward).expect("it can be");
        let ward = item(&edits);
        assert_eq!(ward.kind, Kind::Ward);
        let index = |name: &str| ward.kind.params().iter().position(|p| p.name == name).expect("it has it");
        assert_eq!(edits.value(&scene, 1, index("diffuse")), Some(Value::Rgb(Vec3::new(0.1, 0.2, 0.3))));
        assert_eq!(edits.value(&scene, 1, index("alpha_x")), Some(Value::Number(0.25)));
        assert_eq!(edits.value(&scene, 1, index("alpha_y")), Some(Value::Number(0.25)));
        // How strong the lamp is reflected is not what a coat's factor of one says.
        assert_ne!(edits.value(&scene, 1, index("specular")), Some(Value::Rgb(Vec3::ONE)));
        edits.set(&ward, "alpha_y", &words("0.5")).expect("in its range");
        let changed = edits.apply(&scene).expect("it can be");
        let Material::Model { kind, params, .. } = &changed.materials[1] else { panic!("a model") };
        assert_eq!((*kind, &params[index("alpha_y")]), (Kind::Ward, &Value::Number(0.5)));
        for kind in Edits::models(&scene, 1) {
            edits.change_model(&scene, &item(&edits), kind).expect("it can be");
            let changed = edits.apply(&scene).expect("it can be");
            let Material::Model { kind: now, params, .. } = &changed.materials[1] else { panic!("a model") };
            assert_eq!((*now, params.len()), (kind, kind.params().len()));
        }
        edits.change_model(&scene, &item(&edits), Kind::RoughPlastic).expect("its own");
        assert!(edits.is_empty() && item(&edits).kind == Kind::RoughPlastic);
    }

    #[test]
    fn a_circle_of_materials_ends() {
        let mut scene = scene();
        scene.materials[3] = Material::OneSided { base: 3 };
        assert!(models_of(&scene, 3).is_empty() && models_of(&scene, 99).is_empty());
        assert_eq!(models_of(&scene, 2), [1, 0]);
    }
}
