//! The picture as an ink painting.

use super::compare::{beside, split};
use super::stage::same_view;
use super::{App, Wake};
use crate::command::Resolution;
use crate::error::ViewError;
use crate::files::{InkReport, Picture};
use crate::mask::file_names;
use crate::painting::{AT_WORK, InkPainter, Order, Painted, Picture as Painting};
use std::path::Path;
use std::sync::Arc;
use winit::event_loop::ActiveEventLoop;
use yugen_ink::mask::map::MaskMap;
use yugen_ink::mask::{Ground, Mask};
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
    /// Where the mask that is painted is seen, with which changes of the scene and from where.
    mask: Option<(u64, Camera, Result<Arc<MaskMap>, String>)>,
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
            (self.seen.ink, self.seen.literal, self.seen.painting) = (None, None, false);
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
        if let Some(film) = view.as_ref().map(|v| &v.film) {
            self.state.ink.masks.aspect = film.width as f32 / film.height.max(1) as f32;
        }
        self.take_painting(event_loop);
        self.ask_for_ink(&view);
        let fits = |(changes, camera, _): &&(u64, Camera, _)| {
            *changes == self.shown_changes && view.as_ref().is_some_and(|v| same_view(camera, v))
        };
        self.state.ink.masks.see(self.easel.mask.as_ref().filter(fits).map(|(_, _, map)| map.clone()));
    }

    /// Shows what has been painted.
    fn take_painting(&mut self, event_loop: &ActiveEventLoop) {
        let Some(graphics) = &mut self.graphics else { return };
        let Some(Painted { number, outcome }) = self.easel.painter.as_ref().and_then(InkPainter::take) else {
            return;
        };
        let mut failure = None;
        match outcome {
            Ok(picture) => {
                graphics.set_ink(&picture.image);
                picture.literal.iter().for_each(|literal| graphics.set_literal(literal));
                let compared = picture.literal.is_some() || !self.state.ink.literal;
                self.easel.done = (number, !picture.draft && compared);
                self.seen.unmet = picture.unmet.clone();
                let newest = self.easel.asked.as_ref().filter(|_| number == self.easel.number);
                if let Some(((changes, _, camera), map)) = newest.zip(picture.mask.clone()) {
                    self.easel.mask = Some((*changes, camera.clone(), map));
                }
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
                (self.seen.painted, self.seen.unmet) = (None, Arc::default());
                failure = Some(problem);
            }
        }
        match failure {
            Some(problem) if !self.script.is_empty() => self.fail(event_loop, ViewError::Scene(problem)),
            Some(problem) => self.state.complain(problem),
            None => {}
        }
    }

    fn ask_for_ink(&mut self, view: &Option<Camera>) {
        let (Some(view), Some(graphics)) = (view.clone(), &self.graphics) else { return };
        let want = (self.shown_changes, self.state.ink.changes);
        let easel = &mut self.easel;
        let same = |(changes, style, camera): &(u64, u64, Camera)| {
            (*changes, *style) == want && same_view(camera, &view)
        };
        let painted = self.state.ink.mask().filter(|mask| mask.on != Ground::Picture);
        let of_surface = painted.map(|mask| (mask.on.clone(), mask.picture.size()));
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
                literal: self.state.ink.literal,
                mask: of_surface,
                number: easel.number,
            });
            easel.asked = Some((want.0, want.1, view));
        }
        self.seen.painting = easel.done != (easel.number, true);
        self.seen.ink = graphics.ink().filter(|_| easel.shown.is_some());
        let literal = easel.shown.as_ref().is_some_and(|shown| shown.literal.is_some());
        self.seen.literal = graphics.literal().filter(|_| literal);
        let stroke = self.state.ink.stroke.zip(easel.shown.as_ref());
        self.seen.stroke = stroke.map_or(Vec::new(), |(id, shown)| shown.way(id));
    }

    /// Selects the contour stroke at a place of the picture, none of a draft, whose identities are of fewer pixels; where there is
    /// none the object. What it is made of is offered as well.
    pub(super) fn pick_ink(&mut self, place: [f32; 2]) -> Result<(), String> {
        let whole = self.easel.shown.as_ref().filter(|shown| !shown.draft);
        let stroke = whole.and_then(|shown| shown.stroke_at(place));
        let shape = match stroke {
            Some(id) => {
                whole.and_then(|shown| shown.painting.strokes.iter().find(|s| s.id == id)).map(|s| s.shape)
            }
            None => self.picked(place)?.map(|draw| draw.shape),
        };
        self.state.ink.stroke = stroke;
        let shape = shape.and_then(|s| (s as usize).checked_sub(1));
        self.state.ink.offer(&self.state.scene, shape, stroke.is_none());
        Ok(())
    }

    /// The painting, its strokes or its preset to a file.
    pub(super) fn save_ink(&mut self, file: &Path) -> Result<(), String> {
        let extension =
            file.extension().or(file.file_name()).unwrap_or_default().to_string_lossy().to_lowercase();
        let extension = extension.trim_start_matches('.');
        if extension == "toml" {
            return self.save_preset(file);
        }
        let painter = self.easel.painter.as_ref().filter(|_| self.ink_settled()).ok_or(AT_WORK)?;
        if extension == "svg" {
            let name = self.files.save_text(file, &self.state.file, &painter.svg()?)?;
            self.saved(&name);
            return Ok(());
        }
        let literal = self.easel.shown.as_ref().and_then(|shown| shown.literal.clone());
        let image = match (&self.easel.shown, literal) {
            (Some(shown), Some(literal)) if extension != "exr" => {
                split(&shown.image, &literal, self.first_of_other(shown.image.width))
            }
            (Some(shown), None) if extension != "exr" => yugen_optics::Image::clone(&shown.image),
            (_, Some(literal)) => beside(painter.layers()?, &literal, "literal"),
            _ => painter.layers()?,
        };
        let picture = Picture { image, space: ColourSpace::LinearSrgb, exposure: 0.0, curve: Curve::Clip };
        self.written(file, picture)
    }

    /// The preset, and beside it the pictures of the masks that were painted here.
    fn save_preset(&mut self, file: &Path) -> Result<(), String> {
        let name = self.files.output(file, &self.state.file)?;
        let stem = name.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let ink = &mut self.state.ink;
        let own = |mask: &&mut Mask| ink.masks.own.contains(&mask.name);
        let masks: Vec<&mut Mask> = ink.style.steering.masks.iter_mut().filter(own).collect();
        let names: Vec<String> = masks.iter().map(|mask| mask.name.clone()).collect();
        for (mask, picture) in masks.into_iter().zip(file_names(&stem, &names)) {
            let image = mask.picture.picture();
            let shown = Picture { image, space: ColourSpace::LinearSrgb, exposure: 0.0, curve: Curve::Clip };
            self.files.save(&name.with_file_name(&picture), &self.state.file, shown)?;
            // A preset names them as they lie beside it.
            Arc::make_mut(&mut mask.picture).name = picture;
        }
        self.files.save_text(&name, &self.state.file, &self.state.ink.file())?;
        self.saved(&name);
        Ok(())
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
            subject: self.state.ink.subject.as_ref().map(|(s, name)| (s.name(), name.clone())),
            mask: self.state.ink.mask().map(|mask| (mask.name.clone(), mask.on.to_string())),
            unmet: shown.unmet.to_vec(),
        })
    }
}
