//! How the scene is painted in ink: the preset, what was changed of it, and the stroke that is looked at.

use crate::mask::MaskTable;
use std::collections::HashSet;
use yugen_ink::control::CONTROLS;
use yugen_ink::mask::Ground;
use yugen_ink::painter::Style;
use yugen_ink::preset::{self, Preset};
use yugen_ink::steering::{Changes, OF_STROKES, OF_THE_SHEET, StrokeEdit, Tables};
use yugen_scene::{Geometry, Scene, Shape};

/// What becomes of a stroke.
#[derive(Clone, Debug, PartialEq)]
pub enum StrokeChange {
    /// It is the one that is looked at.
    Choose(u32),
    /// It is not painted, or is.
    Hide(bool),
    /// It is never left out for others, or may be.
    Pin(bool),
    /// It is as the others are.
    Plain,
    /// One of its controls has this value.
    Set(String, f32),
}

/// What a table of a preset is about, where that is no stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A shape by its name.
    Object,
    /// What is of a material, by its name.
    Material,
}

impl Subject {
    /// Every one with its name in scripts and presets.
    pub const ALL: [(Self, &'static str); 2] = [(Self::Object, "object"), (Self::Material, "material")];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// On what a mask of it lies.
    pub fn ground(self, name: &str) -> Ground {
        match self {
            Self::Object => Ground::Object(name.into()),
            Self::Material => Ground::Material(name.into()),
        }
    }
}

/// What becomes of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum TableChange {
    /// It is the one that is looked at.
    Choose,
    /// It is no more.
    Plain,
    /// A control has this value in it.
    Set(String, f32),
}

/// A stroke that is selected.
pub struct SelectedStroke {
    /// Its identity.
    pub id: u32,
    /// It is not painted.
    pub hidden: bool,
    /// It is never left out for others.
    pub pinned: bool,
    /// Controls that a stroke has of its own, and their values.
    pub controls: Vec<(&'static str, f32)>,
}

/// Of the window.
pub struct Ink {
    /// The picture is a painting.
    pub on: bool,
    /// Those that are built in.
    pub presets: Vec<Preset>,
    /// The preset that was chosen, or its file.
    pub name: String,
    /// What it is.
    doc: String,
    /// With what was changed of it.
    pub style: Style,
    /// The identity of the stroke that is looked at.
    pub stroke: Option<u32>,
    /// The object or the material that is looked at.
    pub subject: Option<(Subject, String)>,
    /// The object and the materials of what was clicked on.
    pub offered: Vec<(Subject, String)>,
    /// Masks that are painted by hand.
    pub masks: MaskTable,
    /// Beside the slides' method.
    pub literal: bool,
    /// Counts changes of the style, and of what it stands beside.
    pub changes: u64,
}

impl Default for Ink {
    fn default() -> Self {
        // They are part of the program, and a test reads them.
        let presets = preset::presets().unwrap_or_default();
        let first = presets.first().cloned();
        let (name, doc, style) = first.map(|p| (p.name, p.doc, p.style)).unwrap_or_default();
        Self {
            on: false,
            presets,
            name,
            doc,
            style,
            stroke: None,
            subject: None,
            offered: Vec::new(),
            masks: MaskTable::default(),
            literal: false,
            changes: 0,
        }
    }
}

impl Ink {
    /// The preset called so; the next where absent.
    pub fn choose(&mut self, name: Option<&str>) -> Result<(), String> {
        let preset = match name {
            Some(name) => preset::find(name).map_err(|e| e.to_string())?,
            None => {
                let now = self.presets.iter().position(|p| p.name == self.name);
                let next = now.map_or(0, |i| i + 1) % self.presets.len().max(1);
                self.presets.get(next).cloned().ok_or("there are no presets")?
            }
        };
        self.take(preset);
        Ok(())
    }

    /// The preset of a file's text.
    pub fn read(&mut self, text: &str, name: &str, open: preset::Open) -> Result<(), String> {
        let preset = preset::read(text, name, open).map_err(|e| e.to_string())?;
        self.take(preset);
        Ok(())
    }

    fn take(&mut self, preset: Preset) {
        let Preset { name, doc, mut style, .. } = preset;
        // What is otherwise of strokes is of the scene, not of the brush; a file's own tables count more.
        let mut strokes = std::mem::take(&mut self.style.steering.strokes);
        strokes.extend(std::mem::take(&mut style.steering.strokes));
        style.steering.strokes = strokes;
        // So are masks that were painted here.
        let mut masks = std::mem::take(&mut self.style.steering.masks);
        masks.retain(|m| self.masks.own.contains(&m.name));
        masks.retain(|m| style.steering.masks.iter().all(|of_file| of_file.name != m.name));
        self.masks.own.retain(|name| masks.iter().any(|m| m.name == *name));
        style.steering.masks.extend(masks);
        (self.name, self.doc, self.style) = (name, doc, style);
        self.masks.keep_own();
        self.changes += 1;
    }

    /// Gives a control a value, or a paper, a pigment or a manner of wrinkles by its name.
    pub fn set(&mut self, name: &str, word: &str) -> Result<(), String> {
        if preset::NAMED.contains(&name) {
            preset::set_name(&mut self.style, name, word).map_err(|e| e.to_string())?;
        } else {
            let value = word.parse().map_err(|_| format!("{name} = {word}: expected a number"))?;
            self.style.controls.set(name, value).map_err(|e| e.to_string())?;
        }
        self.changes += 1;
        Ok(())
    }

    /// Changes the stroke that is looked at.
    pub fn change_stroke(&mut self, change: &StrokeChange) -> Result<(), String> {
        if let StrokeChange::Choose(id) = change {
            self.stroke = Some(*id);
            return Ok(());
        }
        let id = self.stroke.ok_or("no stroke is selected: click on a contour, or `pick` it")?;
        let strokes = &mut self.style.steering.strokes;
        match change {
            StrokeChange::Hide(hide) => strokes.entry(id).or_default().hide = *hide,
            StrokeChange::Pin(pin) => strokes.entry(id).or_default().pin = *pin,
            StrokeChange::Set(name, value) => {
                let mut edit = strokes.get(&id).cloned().unwrap_or_default();
                edit.changes.of_stroke(name, *value).map_err(|e| e.to_string())?;
                strokes.insert(id, edit);
            }
            StrokeChange::Plain | StrokeChange::Choose(_) => drop(strokes.remove(&id)),
        }
        // What is as it would be anyway needs no table.
        strokes.retain(|_, edit| *edit != StrokeEdit::default());
        self.changes += 1;
        Ok(())
    }

    /// The stroke that is selected, as it is painted.
    pub fn selected(&self) -> Option<SelectedStroke> {
        let id = self.stroke?;
        let edit = self.style.steering.strokes.get(&id);
        let mut controls = self.style.controls;
        edit.iter().for_each(|e| e.changes.apply(&mut controls));
        let values = OF_STROKES.iter().filter_map(|name| Some((*name, controls.get(name)?)));
        let [hidden, pinned] = [edit.is_some_and(|e| e.hide), edit.is_some_and(|e| e.pin)];
        Some(SelectedStroke { id, hidden, pinned, controls: values.collect() })
    }

    fn tables(&mut self, subject: Subject) -> &mut Tables {
        match subject {
            Subject::Object => &mut self.style.steering.objects,
            Subject::Material => &mut self.style.steering.materials,
        }
    }

    /// Tables of objects and materials that there are.
    pub fn steered(&self) -> impl Iterator<Item = (Subject, &str)> {
        let steering = &self.style.steering;
        let all = [(Subject::Object, &steering.objects), (Subject::Material, &steering.materials)];
        all.into_iter().flat_map(|(s, tables)| tables.iter().map(move |(name, _)| (s, name.as_str())))
    }

    /// Changes the table of an object or a material; what is said last counts more than what other tables say.
    pub fn steer(&mut self, subject: Subject, name: &str, change: &TableChange) -> Result<(), String> {
        let tables = self.tables(subject);
        let at = tables.iter().position(|(known, _)| known == name);
        match change {
            TableChange::Choose => {}
            TableChange::Plain => drop(at.map(|at| tables.remove(at))),
            TableChange::Set(control, value) => {
                let mut changes = at.map_or(Changes::default(), |at| tables[at].1.clone());
                changes.of_object(control, *value).map_err(|e| e.to_string())?;
                at.map(|at| tables.remove(at));
                tables.push((name.into(), changes));
            }
        }
        self.subject = Some((subject, name.into()));
        self.changes += u64::from(*change != TableChange::Choose);
        Ok(())
    }

    /// The controls that the object or material that is looked at has, and their values.
    pub fn subject_controls(&self, scene: &Scene) -> Vec<(&'static str, f32)> {
        let Some((subject, name)) = &self.subject else { return Vec::new() };
        let (object, materials) = match subject {
            Subject::Material => ("", vec![name.clone()]),
            Subject::Object => {
                let shape = scene.shapes.iter().find(|s| s.name == *name);
                (name.as_str(), shape.map_or(Vec::new(), |s| materials_of(scene, s)))
            }
        };
        let controls = self.style.steering.controls(&self.style.controls, object, &materials);
        let own = CONTROLS.iter().filter(|c| !OF_THE_SHEET.contains(&c.name));
        own.filter_map(|c| Some((c.name, controls.get(c.name)?))).collect()
    }

    /// Offers what a shape is called and what it is made of; `looked_at`: it is the shape that was clicked on, and no stroke.
    pub fn offer(&mut self, scene: &Scene, shape: Option<usize>, looked_at: bool) {
        let shape = shape.and_then(|i| scene.shapes.get(i));
        let object = shape.map(|s| (Subject::Object, s.name.clone()));
        let materials = shape.map_or(Vec::new(), |s| materials_of(scene, s));
        let materials = materials.into_iter().map(|name| (Subject::Material, name));
        self.offered = object.into_iter().chain(materials).filter(|(_, name)| !name.is_empty()).collect();
        self.subject = self.offered.first().filter(|_| looked_at).cloned();
    }

    /// Beside the slides' method, or alone.
    pub fn compare(&mut self, literal: bool) {
        self.changes += u64::from(self.literal != literal);
        self.literal = literal;
    }

    /// Another scene: nothing is known of its objects and strokes.
    pub fn forget_scene(&mut self) {
        (self.stroke, self.subject) = (None, None);
        self.offered.clear();
        self.masks.clear();
        if !self.style.steering.is_empty() {
            self.style.steering = Default::default();
            self.changes += 1;
        }
    }

    /// A file that `yugen ink --preset` reads.
    pub fn file(&self) -> String {
        preset::write(&self.style, &self.doc)
    }
}

/// The names of the materials of a shape, or of those that an instance places.
fn materials_of(scene: &Scene, shape: &Shape) -> Vec<String> {
    let of = |s: &Shape| scene.names_of_material(s.material);
    let mut names: Vec<&str> = match &shape.geometry {
        Geometry::Instance(group) => scene.groups.get(*group).into_iter().flatten().flat_map(of).collect(),
        _ => of(shape),
    };
    let mut seen = HashSet::new();
    names.retain(|name| seen.insert(*name));
    names.into_iter().map(String::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_style_is_chosen_changed_and_written() {
        let mut ink = Ink::default();
        assert!(ink.presets.len() > 4 && ink.name == preset::DEFAULT);
        ink.choose(Some("boneless")).unwrap();
        ink.set("dryness", "0.25").unwrap();
        ink.set("paper", "silk").unwrap();
        assert!(ink.change_stroke(&StrokeChange::Hide(true)).unwrap_err().contains("no stroke is selected"));
        ink.change_stroke(&StrokeChange::Choose(0xabc)).unwrap();
        ink.change_stroke(&StrokeChange::Set("ink".into(), 1.25)).unwrap();
        ink.change_stroke(&StrokeChange::Hide(true)).unwrap();
        ink.change_stroke(&StrokeChange::Pin(true)).unwrap();
        let selected = ink.selected().unwrap();
        assert!(selected.id == 0xabc && selected.hidden && selected.pinned);
        assert!([("ink", 1.25), ("dryness", 0.25)].iter().all(|c| selected.controls.contains(c)));
        let read = preset::read(&ink.file(), "own", &preset::no_pictures).unwrap();
        assert!(read.doc.contains("mogu"));
        assert_eq!((read.style.controls, &read.style.steering), (ink.style.controls, &ink.style.steering));
        assert_eq!(read.style.paper.name, "silk");
        // Objects and materials have tables as well.
        let set = |value| TableChange::Set("wash".into(), value);
        ink.steer(Subject::Material, "wet rock", &set(0.5)).unwrap();
        ink.steer(Subject::Object, "rock", &set(0.25)).unwrap();
        let written = preset::read(&ink.file(), "own", &preset::no_pictures).unwrap().style.steering;
        assert_eq!((&written, written.materials.len()), (&ink.style.steering, 1));
        let mut scene = Scene::default();
        scene.materials.push(yugen_scene::Material::lambert(yugen_scene::Value::Number(0.5)));
        scene.name_material(0, "wet rock");
        scene.shapes.push(Shape::new("rock", Geometry::Sphere, glam::Mat4::IDENTITY, 0));
        let wash = |ink: &Ink| ink.subject_controls(&scene).iter().find(|c| c.0 == "wash").unwrap().1;
        assert_eq!(wash(&ink), 0.25);
        ink.steer(Subject::Object, "rock", &TableChange::Plain).unwrap();
        assert_eq!((wash(&ink), ink.steered().count()), (0.5, 1), "of its material");
        assert!(ink.steer(Subject::Object, "rock", &TableChange::Set("bleed".into(), 0.5)).is_err());
        ink.offer(&scene, Some(0), true);
        assert_eq!(ink.offered.iter().map(|o| o.1.as_str()).collect::<Vec<_>>(), ["rock", "wet rock"]);
        assert_eq!(ink.subject, Some((Subject::Object, "rock".into())));
        ink.steer(Subject::Material, "wet rock", &TableChange::Plain).unwrap();
        // Another preset leaves strokes; another scene does not; and a stroke that is as others are has no table.
        ink.choose(None).unwrap();
        assert!(ink.name != "boneless" && ink.style.steering.strokes.len() == 1);
        ink.change_stroke(&StrokeChange::Plain).unwrap();
        assert!(ink.style.steering.is_empty());
        ink.change_stroke(&StrokeChange::Hide(true)).unwrap();
        ink.forget_scene();
        assert!(ink.style.steering.is_empty() && ink.stroke.is_none());
        for _ in 0..ink.presets.len() {
            ink.choose(None).unwrap();
        }
        let before = ink.changes;
        for (name, word, said) in [
            ("dryness", "3", "out of range"),
            ("dryness", "much", "expected a number"),
            ("drynes", "0", "did you mean 'dryness'?"),
            ("paper", "slik", "did you mean 'silk'?"),
        ] {
            let error = ink.set(name, word).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        let none = |name: &str| Err(format!("{name} is not there"));
        assert!(ink.read("brush = 'b.png'", "own.toml", &none).unwrap_err().contains("b.png is not there"));
        assert!(ink.choose(Some("sumie")).unwrap_err().contains("did you mean 'sumi'?"));
        assert!(
            ink.read("ink = 9", "own.toml", &none).unwrap_err().contains("own.toml: ink = 9 is out of range")
        );
        assert_eq!(ink.changes, before);
    }
}
