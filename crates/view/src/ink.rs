//! How the scene is painted in ink: the preset, what was changed of it, and the stroke that is looked at.

use yugen_ink::painter::Style;
use yugen_ink::preset::{self, Preset};
use yugen_ink::steering::{OF_STROKES, StrokeEdit};

/// What becomes of a stroke.
#[derive(Clone, Debug, PartialEq)]
pub enum StrokeChange {
    /// It is the one that is looked at.
    Choose(u32),
    /// It is not painted, or is.
    Hide(bool),
    /// It is as the others are.
    Plain,
    /// One of its controls has this value.
    Set(String, f32),
}

/// A stroke that is selected.
pub struct SelectedStroke {
    /// Its identity.
    pub id: u32,
    /// It is not painted.
    pub hidden: bool,
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
    /// Counts changes of the style.
    pub changes: u64,
}

impl Default for Ink {
    fn default() -> Self {
        // They are part of the program, and a test reads them.
        let presets = preset::presets().unwrap_or_default();
        let first = presets.first().cloned();
        let (name, doc, style) = first.map(|p| (p.name, p.doc, p.style)).unwrap_or_default();
        Self { on: false, presets, name, doc, style, stroke: None, changes: 0 }
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
    pub fn read(&mut self, text: &str, name: &str) -> Result<(), String> {
        self.take(preset::read(text, name).map_err(|e| e.to_string())?);
        Ok(())
    }

    fn take(&mut self, preset: Preset) {
        let Preset { name, doc, mut style } = preset;
        // What is otherwise of strokes is of the scene, not of the brush; a file's own tables count more.
        let mut strokes = std::mem::take(&mut self.style.steering.strokes);
        strokes.extend(std::mem::take(&mut style.steering.strokes));
        style.steering.strokes = strokes;
        (self.name, self.doc, self.style) = (name, doc, style);
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
        Some(SelectedStroke { id, hidden: edit.is_some_and(|e| e.hide), controls: values.collect() })
    }

    /// Another scene: nothing is known of its objects and strokes.
    pub fn forget_scene(&mut self) {
        self.stroke = None;
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
        let selected = ink.selected().unwrap();
        assert!(selected.id == 0xabc && selected.hidden);
        assert!([("ink", 1.25), ("dryness", 0.25)].iter().all(|c| selected.controls.contains(c)));
        let read = preset::read(&ink.file(), "own").unwrap();
        assert!(read.doc.contains("mogu"));
        assert_eq!((read.style.controls, &read.style.steering), (ink.style.controls, &ink.style.steering));
        assert_eq!(read.style.paper.name, "silk");
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
        assert!(ink.choose(Some("sumie")).unwrap_err().contains("did you mean 'sumi'?"));
        assert!(ink.read("ink = 9", "own.toml").unwrap_err().contains("own.toml: ink = 9 is out of range"));
        assert_eq!(ink.changes, before);
    }
}
