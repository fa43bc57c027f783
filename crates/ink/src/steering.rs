//! What is painted otherwise than the rest: single objects, and single strokes by the name that they keep through a film.

use crate::InkError;
use crate::control::Controls;
use std::collections::BTreeMap;
use yugen_scene::suggest;

/// Values of some controls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(Vec<(String, f32)>);

/// Controls that are of the whole sheet: water runs in all of it, one brush has one set of masks, one light shines.
pub const OF_THE_SHEET: [&str; 3] = ["bleed", "light", "roughness"];

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
            return Err(InkError::Preset(format!("'{name}' is not of a stroke; expected hide, {known}")));
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
    /// How else it is.
    pub changes: Changes,
}

/// Of a style.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steering {
    /// Names of objects, a last `*` standing for anything, and what is otherwise; later ones over earlier ones.
    pub objects: Vec<(String, Changes)>,
    /// By the identity of strokes.
    pub strokes: BTreeMap<u32, StrokeEdit>,
}

impl Steering {
    /// Whether nothing is otherwise.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && self.strokes.is_empty()
    }

    /// Controls of objects with these names.
    pub fn controls(&self, base: &Controls, names: &[impl AsRef<str>]) -> Result<Vec<Controls>, InkError> {
        let mut all = vec![*base; names.len()];
        for (pattern, changes) in &self.objects {
            let mut found = false;
            for (controls, _) in all.iter_mut().zip(names).filter(|(_, name)| fits(pattern, name.as_ref())) {
                changes.apply(controls);
                found = true;
            }
            if !found {
                let hint = suggest(pattern, names.iter().map(AsRef::as_ref));
                return Err(InkError::Preset(format!("there is no object '{pattern}' in the scene{hint}")));
            }
        }
        Ok(all)
    }
}

fn fits(pattern: &str, name: &str) -> bool {
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
        let all = steering.controls(&Controls::default(), &["pine-1", "floor", "pine-2"]).unwrap();
        assert_eq!(all.iter().map(|c| c.ink).collect::<Vec<_>>(), [0.2, Controls::default().ink, 0.2]);
        steering.objects[0].0 = "flor".into();
        let said = steering.controls(&Controls::default(), &["floor"]).unwrap_err().to_string();
        assert!(said.contains("no object 'flor'") && said.contains("did you mean 'floor'?"), "{said}");
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
