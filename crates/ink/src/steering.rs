//! What is painted otherwise than the rest: single objects, what is of one material, and single strokes by the name that they
//! keep through a film.

use crate::InkError;
use crate::control::Controls;
use crate::mask::{Ground, Mask};
use std::collections::{BTreeMap, BTreeSet};
use yugen_scene::prepared::DrawRow;
use yugen_scene::{Scene, suggest};

/// Values of some controls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(Vec<(String, f32)>);

/// Controls that are of the whole sheet: water runs in all of it, one brush has one set of masks, one light shines.
pub const OF_THE_SHEET: [&str; 4] = ["bleed", "flicker", "light", "roughness"];

/// Controls that a stroke by itself has; the others say what strokes there are.
pub const OF_STROKES: [&str; 7] = ["ink", "water", "dryness", "size", "contrast", "distance", "contour"];

impl Changes {
    /// Adds one of an object; refused are names and values that no control has, and those of the whole sheet.
    pub fn of_object(&mut self, name: &str, value: f32) -> Result<(), InkError> {
        if OF_THE_SHEET.contains(&name) {
            return Err(InkError::Preset(format!("'{name}' is of the whole sheet, not of an object")));
        }
        self.add(name, value)
    }

    /// The same of a stroke.
    pub fn of_stroke(&mut self, name: &str, value: f32) -> Result<(), InkError> {
        Controls::default().set(name, value)?;
        if !OF_STROKES.contains(&name) {
            let known = OF_STROKES.join(", ");
            return Err(InkError::Preset(format!(
                "'{name}' is not of a stroke; expected hide, pin, {known}"
            )));
        }
        self.add(name, value)
    }

    fn add(&mut self, name: &str, value: f32) -> Result<(), InkError> {
        Controls::default().set(name, value)?;
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, known)) => *known = value,
            None => self.0.push((name.into(), value)),
        }
        Ok(())
    }

    /// Takes one away.
    pub fn remove(&mut self, name: &str) {
        self.0.retain(|(known, _)| known != name);
    }

    /// Names of controls and their values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f32)> {
        self.0.iter().map(|(name, value)| (name.as_str(), *value))
    }

    /// Makes them.
    pub fn apply(&self, controls: &mut Controls) {
        for (name, value) in &self.0 {
            // They were found good when they were added.
            let _ = controls.set(name, *value);
        }
    }
}

/// What becomes of a stroke.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrokeEdit {
    /// It is not painted.
    pub hide: bool,
    /// It is never left out for others and keeps its identity through the shot ([`crate::tracking`]).
    pub pin: bool,
    /// How else it is.
    pub changes: Changes,
}

impl StrokeEdit {
    /// What is true or not of it, by name.
    pub fn flags(&self) -> [(&'static str, bool); 2] {
        [("hide", self.hide), ("pin", self.pin)]
    }

    /// One of them.
    pub fn flag(&mut self, name: &str) -> Option<&mut bool> {
        match name {
            "hide" => Some(&mut self.hide),
            "pin" => Some(&mut self.pin),
            _ => None,
        }
    }
}

/// Names, a last `*` standing for anything, and what is otherwise of what is called so; later ones over earlier ones.
pub type Tables = Vec<(String, Changes)>;

/// Of a style.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steering {
    /// By the names of materials.
    pub materials: Tables,
    /// By the names of objects; over those of their materials.
    pub objects: Tables,
    /// Place by place, over those of objects.
    pub masks: Vec<Mask>,
    /// By the identity of strokes, over all.
    pub strokes: BTreeMap<u32, StrokeEdit>,
}

impl Steering {
    /// Whether nothing is otherwise.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
            && self.materials.is_empty()
            && self.masks.is_empty()
            && self.strokes.is_empty()
    }

    /// Controls of an object of this name with a material of these names: its own and those of what it is made of.
    pub fn controls(&self, base: &Controls, object: &str, materials: &[impl AsRef<str>]) -> Controls {
        let mut controls = *base;
        let of_materials =
            self.materials.iter().filter(|(p, _)| materials.iter().any(|m| fits(p, m.as_ref())));
        let of_objects = self.objects.iter().filter(|(pattern, _)| fits(pattern, object));
        of_materials.chain(of_objects).for_each(|(_, changes)| changes.apply(&mut controls));
        controls
    }

    /// A sentence for each table or mask of an object or a material that the scene does not have.
    pub fn unmet(&self, names: &Names) -> Vec<String> {
        let of = |tables: &Tables, ground: fn(String) -> Ground| -> Vec<(String, Ground)> {
            tables.iter().map(|(pattern, _)| ground(pattern.clone())).map(|on| (on.to_string(), on)).collect()
        };
        let tables = [of(&self.materials, Ground::Material), of(&self.objects, Ground::Object)].concat();
        let masks = self.masks.iter().map(|mask| (format!("mask.{}", mask.name), mask.on.clone()));
        let sentence = |(table, on): (String, Ground)| {
            let unknown = names.unknown(&on)?;
            Some(format!("[{table}] changes nothing: the scene has no {unknown}"))
        };
        tables.into_iter().chain(masks).filter_map(sentence).collect()
    }
}

/// What things of a scene are called.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// By shape.
    pub objects: Vec<String>,
    /// By material: its own name and those of what it is made of.
    pub materials: Vec<Vec<String>>,
}

impl Names {
    /// What a scene lacks for something to lie on this, with what was probably meant: "object 'bal'; did you mean 'ball'?"; `None`
    /// where it lacks nothing.
    pub fn unknown(&self, on: &Ground) -> Option<String> {
        let (kind, pattern, known): (_, _, BTreeSet<&str>) = match on {
            Ground::Picture => return None,
            Ground::Object(name) => ("object", name, self.objects.iter().map(String::as_str).collect()),
            Ground::Material(name) => {
                ("material", name, self.materials.iter().flatten().map(String::as_str).collect())
            }
        };
        let hint = suggest(pattern, known.iter().copied());
        (!known.iter().any(|name| fits(pattern, name))).then(|| format!("{kind} '{pattern}'{hint}"))
    }

    /// The object that a draw is of.
    pub fn object(&self, draw: &DrawRow) -> &str {
        self.objects.get((draw.shape as usize).wrapping_sub(1)).map_or("", String::as_str)
    }

    /// The material of a draw, and what that is made of.
    pub fn materials(&self, draw: &DrawRow) -> &[String] {
        self.materials.get(draw.material as usize).map_or(&[], Vec::as_slice)
    }

    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let of_material = |id| scene.names_of_material(id).into_iter().map(String::from).collect();
        Self {
            objects: scene.shapes.iter().map(|s| s.name.clone()).collect(),
            materials: (0..scene.materials.len()).map(of_material).collect(),
        }
    }
}

/// Whether a name is meant by one of a table, whose last `*` stands for anything.
pub(crate) fn fits(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(begin) => name.starts_with(begin),
        None => name == pattern,
    }
}

/// The identity of a stroke as vectors have it: eight digits to the base of sixteen.
pub fn id(text: &str) -> Result<u32, InkError> {
    let wrong =
        || InkError::Preset(format!("'{text}' is no stroke: expected data-id of an SVG, as in 0f3a9c12"));
    if text.len() != 8 { Err(wrong()) } else { u32::from_str_radix(text, 16).map_err(|_| wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_found_by_name_and_those_that_are_not_are_told() {
        let mut changes = Changes::default();
        changes.of_object("ink", 0.2).unwrap();
        let mut steering = Steering::default();
        steering.objects.push(("pine*".into(), changes));
        let usual = Controls::default();
        let ink = |s: &Steering, object: &str, material: &str| s.controls(&usual, object, &[material]).ink;
        let all = ["pine-1", "floor", "pine-2"].map(|name| ink(&steering, name, "wood"));
        assert_eq!(all, [0.2, usual.ink, 0.2]);
        // Of a material, where no table of the object says otherwise.
        let mut changes = Changes::default();
        [("ink", 0.7), ("water", 0.1)].into_iter().for_each(|(c, v)| changes.of_object(c, v).unwrap());
        steering.materials.push(("woo*".into(), changes));
        assert_eq!(["pine-1", "floor"].map(|name| ink(&steering, name, "wood")), [0.2, 0.7]);
        assert_eq!(
            steering.controls(&usual, "pine-1", &["bark", "wood"]).water,
            0.1,
            "a part of its material"
        );
        assert_eq!(ink(&steering, "floor", "stone"), usual.ink);
        let mut names =
            Names { objects: vec!["pine-1".into()], materials: vec![vec!["bark".into(), "wood".into()]] };
        assert!(steering.unmet(&names).is_empty());
        names = Names { objects: vec!["floor".into()], materials: vec![vec!["stone".into()]] };
        (steering.objects[0].0, steering.materials[0].0) = ("flor".into(), "store".into());
        let said = steering.unmet(&names);
        assert_eq!(said.len(), 2);
        for (said, table) in said.iter().zip(["[material.store]", "[object.flor]"]) {
            assert!(said.contains(table) && said.contains("did you mean"), "{said}");
        }
        let refused = [Changes::default().of_object("bleed", 0.5), Changes::default().of_stroke("wash", 0.5)];
        assert!(refused.iter().all(Result::is_err));
        let mut changes = Changes::default();
        [0.2, 0.7].into_iter().for_each(|v| changes.of_stroke("ink", v).unwrap());
        assert_eq!(changes.iter().collect::<Vec<_>>(), [("ink", 0.7)], "the last value alone");
        assert_eq!(
            (id("0f3a9c12").unwrap(), id("f3").is_err(), id("zzzzzzzz").is_err()),
            (0x0f3a_9c12, true, true)
        );
    }
}
