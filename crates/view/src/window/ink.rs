//! The picture as an ink painting.

use super::{App, Wake, same_view};
use crate::action::Resolution;
use crate::error::ViewError;
use crate::files::{InkReport, Picture};
use crate::painting::{AT_WORK, InkPainter, Order, Painted, Picture as Painting};
use std::path::Path;
use winit::event_loop::ActiveEventLoop;
use yugen_optics::ColourSpace;
use yugen_optics::tonemap::Curve;
use yugen_scene::Camera;

/// The painter and what of it is seen.
#[derive(Default)]
pub struct Easel {
    painter: Option<InkPainter>,
    /// What was asked for last: changes of the scene and of the style, and the view.
    asked: Option<(u64, u64, Camera)>,
    /// Counts orders.
    number: u64,
    /// Of which scene it all is.
    scene: u64,
    /// Counts other values of materials and lights.
    pub values: u64,
    /// The order that was seen to last, and whether its whole painting is there.
    done: (u64, bool),
    shown: Option<Painting>,
}

impl App {
    /// What the painting is to show.
    fn ink_view(&self) -> Option<Camera> {
        let whole = self.whole()?;
        let part = match self.state.resolution {
            Resolution::Auto | Resolution::Full => 1,
            Resolution::Half => 2,
            Resolution::Quarter => 4,
        };
        let mut camera = self.state.eye.camera().clone();
        camera.resize(whole[0], whole[1]);
        let [w, h] = whole.map(|s| s.div_ceil(part).max(1));
        camera.resize(w, h);
        Some(camera)
    }

    /// The painting is the one that is asked for, or there is none of it.
    pub(super) fn ink_settled(&self) -> bool {
        let Easel { asked, number, done, .. } = &self.easel;
        let same = |(changes, style, camera): &(u64, u64, Camera)| {
            (*changes, *style) == (self.state.changes, self.state.ink.changes)
                && self.ink_view().is_some_and(|v| same_view(camera, &v))
        };
        !self.state.ink.on || asked.as_ref().is_some_and(same) && *done == (*number, true)
    }

    /// Asks for paintings and shows what has been painted.
    pub(super) fn paint_ink(&mut self, event_loop: &ActiveEventLoop) {
        if !self.state.ink.on {
            (self.seen.ink, self.seen.painting) = (None, false);
            self.seen.stroke.clear();
            return;
        }
        if self.easel.scene != self.stage_scene {
            self.easel = Easel {
                painter: self.easel.painter.take(),
                number: self.easel.number,
                values: self.easel.values,
                scene: self.stage_scene,
                ..Easel::default()
            };
        }
        let view = self.ink_view();
        let Some(graphics) = &mut self.graphics else { return };
        let Some(Painted { number, outcome }) = self.easel.painter.as_ref().and_then(InkPainter::take) else {
            return self.ask_for_ink(view);
        };
        let mut failure = None;
        match outcome {
            Ok(picture) => {
                graphics.set_ink(&picture.image);
                self.easel.done = (number, !picture.draft);
                self.seen.painted = Some(super::ui::Strokes {
                    size: [picture.image.width as u32, picture.image.height as u32],
                    strokes: picture.painting.strokes.len(),
                    seconds: picture.seconds,
                });
                self.easel.shown = Some(picture);
            }
            Err(problem) => {
                // The painting before is not that of this order.
                (self.easel.done, self.easel.shown) = ((number, true), None);
                self.seen.painted = None;
                failure = Some(problem);
            }
        }
        match failure {
            Some(problem) if !self.script.is_empty() => self.fail(event_loop, ViewError::Scene(problem)),
            Some(problem) => self.state.complain(problem),
            None => {}
        }
        self.ask_for_ink(view);
    }

    fn ask_for_ink(&mut self, view: Option<Camera>) {
        let (Some(view), Some(graphics)) = (view, &self.graphics) else { return };
        let want = (self.shown_changes, self.state.ink.changes);
        let easel = &mut self.easel;
        let same = |(changes, style, camera): &(u64, u64, Camera)| {
            (*changes, *style) == want && same_view(camera, &view)
        };
        if graphics.stage.is_some() && !easel.asked.as_ref().is_some_and(same) {
            easel.number += 1;
            let wake = self.proxy.clone();
            let painter = easel.painter.get_or_insert_with(|| {
                // The loop may have ended.
                InkPainter::new(graphics.device(), graphics.queue(), move || {
                    drop(wake.send_event(Wake::Thread));
                })
            });
            painter.ask(Order {
                scene: self.changed_scene.clone(),
                of: [self.stage_scene, easel.values],
                camera: view.clone(),
                style: self.state.ink.style.clone(),
                number: easel.number,
            });
            easel.asked = Some((want.0, want.1, view));
        }
        self.seen.painting = easel.done != (easel.number, true);
        self.seen.ink = graphics.ink().filter(|_| easel.shown.is_some());
        let stroke = self.state.ink.stroke.zip(easel.shown.as_ref());
        self.seen.stroke = stroke.map_or(Vec::new(), |(id, shown)| shown.way(id));
    }

    /// Selects the contour stroke at a place of the picture; none of a draft, whose identities are of fewer pixels.
    pub(super) fn pick_stroke(&mut self, place: [f32; 2]) {
        let whole = self.easel.shown.as_ref().filter(|shown| !shown.draft);
        self.state.ink.stroke = whole.and_then(|shown| shown.stroke_at(place));
    }

    /// The painting, its strokes or its preset to a file.
    pub(super) fn save_ink(&mut self, file: &Path) -> Result<(), String> {
        let extension =
            file.extension().or(file.file_name()).unwrap_or_default().to_string_lossy().to_lowercase();
        let extension = extension.trim_start_matches('.');
        if extension == "toml" {
            let name = self.files.save_text(file, &self.state.file, &self.state.ink.file())?;
            self.saved(&name);
            return Ok(());
        }
        let painter = self.easel.painter.as_ref().filter(|_| self.ink_settled()).ok_or(AT_WORK)?;
        if extension == "svg" {
            let name = self.files.save_text(file, &self.state.file, &painter.svg()?)?;
            self.saved(&name);
            return Ok(());
        }
        let image = match &self.easel.shown {
            Some(shown) if extension != "exr" => yugen_optics::Image::clone(&shown.image),
            _ => painter.layers()?,
        };
        let picture = Picture { image, space: ColourSpace::LinearSrgb, exposure: 0.0, curve: Curve::Clip };
        self.written(file, picture)
    }

    /// What is painted, for the report.
    pub(super) fn ink_report(&self) -> Option<InkReport> {
        let shown = self.easel.shown.as_ref().filter(|_| self.state.ink.on)?;
        let stroke = self.state.ink.stroke;
        let known = stroke.and_then(|id| shown.painting.strokes.iter().find(|s| s.id == id));
        let object = known.and_then(|s| self.state.scene.shapes.get(s.shape as usize - 1));
        Some(InkReport {
            preset: self.state.ink.name.clone(),
            size: [shown.image.width as u32, shown.image.height as u32],
            strokes: shown.painting.strokes.len(),
            seconds: shown.seconds,
            stroke: stroke.map(|id| (id, object.map(|o| o.name.clone()))),
        })
    }
}
