//! Pictures to files, and what is said of them.

use super::App;
use super::compare::{beside, split};
use crate::files::{Picture, Report};
use crate::language::Words;
use std::path::Path;

const SAVED: Words = ["saved", "保存しました："];

impl App {
    /// The picture as light: the real-time one, the reference right of the line or where it alone is seen; the other as well.
    pub(super) fn save(&mut self, file: &Path) -> Result<(), String> {
        if self.state.ink.on {
            return self.save_ink(file);
        }
        let stage = self.graphics.as_ref().and_then(|g| g.stage.as_ref()).ok_or("there is no picture yet")?;
        let linear = file
            .extension()
            .or(file.file_name())
            .is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case(".exr"));
        let image = stage.image().map_err(|e| e.to_string())?;
        let found = self
            .finding
            .as_ref()
            .map(|f| &*f.image)
            .filter(|f| (f.width, f.height) == (image.width, image.height));
        let image = match found {
            Some(reference) if linear => beside(image, reference, "reference"),
            Some(reference) => split(&image, reference, self.first_of_other(image.width)),
            None => image,
        };
        let picture = Picture {
            image,
            space: self.changed_scene.working_space,
            exposure: self.state.exposure,
            curve: self.state.curve,
        };
        self.written(file, picture)
    }

    pub(super) fn written(&mut self, file: &Path, picture: Picture) -> Result<(), String> {
        let name = self.files.save(file, &self.state.file, picture)?;
        self.saved(&name);
        Ok(())
    }

    pub(super) fn saved(&mut self, name: &Path) {
        let saved = self.state.language.of(SAVED);
        self.state.note(format!("{saved} {}", name.display()));
    }

    pub(super) fn report(&self) -> Report {
        let selected = self.state.selected.and_then(|i| Some((i, self.state.materials.get(i)?)));
        Report {
            file: self.state.file.clone(),
            adapter: self.seen.adapter.clone(),
            surface: self.seen.surface.clone(),
            size: self.seen.size,
            frames: self.frames,
            milliseconds: self.frame_milliseconds,
            passes: self.seen.passes.clone(),
            samples: self.seen.samples,
            difference: self.seen.difference,
            selected: selected.map(|(i, m)| (i + 1, m.kind.name().to_string(), m.worn_by.clone())),
            moment: self.state.moment(),
            prepared: self.prepared,
            ink: self.ink_report(),
            message: self.state.message.as_ref().map_or(String::new(), |m| m.text.clone()),
        }
    }
}
