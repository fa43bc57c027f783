//! The frames of `yugen render --frames`.

use super::realtime::Realtime;
use super::{Render, for_format};
use crate::sequence::{Frames, Sequence};
use anyhow::{Context, Result};
use std::path::Path;
use yugen_archive::formats::image;
use yugen_optics::Image;
use yugen_scene::Scene;
use yugen_transport::render::{Action, Job};

/// Draws one picture after another.
enum Renderer<'a> {
    Reference,
    Realtime(Box<Realtime<'a>>),
}

/// A renderer and what it has drawn last.
struct Rendered<'a> {
    render: &'a Render,
    renderer: Renderer<'a>,
    options: image::WriteOptions,
    /// The picture and what is said of it in its header.
    picture: Option<(Image, Vec<(String, String)>)>,
}

impl Rendered<'_> {
    fn last(&self) -> Result<&(Image, Vec<(String, String)>)> {
        self.picture.as_ref().context("no picture was rendered")
    }
}

impl Frames for Rendered<'_> {
    fn paint(&mut self, scene: &Scene, stop: &dyn Fn() -> bool, tell: &dyn Fn(f64)) -> Result<bool> {
        let picture = match &mut self.renderer {
            Renderer::Realtime(realtime) => {
                realtime.pose(scene)?;
                let frames = realtime.paint(stop, tell)?;
                if stop() {
                    return Ok(false);
                }
                (realtime.image()?, self.render.realtime_metadata(realtime.adapter(), frames))
            }
            Renderer::Reference => {
                let job = Job::new(scene, &self.render.options(scene)?)?;
                let ended = job.run(|_, p| {
                    tell(p.fraction);
                    if stop() { Action::Stop } else { Action::Continue }
                });
                if !ended {
                    return Ok(false);
                }
                (job.denoised(), self.render.metadata(&job))
            }
        };
        self.picture = Some(picture);
        Ok(true)
    }

    fn picture(&self) -> Result<Image> {
        Ok(self.last()?.0.clone())
    }

    fn write(&self, path: &Path, _: u32) -> Result<()> {
        let (picture, metadata) = self.last()?;
        let options = image::WriteOptions { metadata: metadata.clone(), ..self.options.clone() };
        Ok(image::write(path, &for_format(picture.clone(), path), &options)?)
    }
}

impl Render {
    /// Whether more than one picture is asked for.
    pub(super) fn is_sequence(&self) -> bool {
        self.moments.is_sequence(std::slice::from_ref(&self.output))
    }

    /// Renders them all.
    pub(super) fn run_sequence(&self, scene: Scene) -> Result<()> {
        let options = self.display.of(&self.output, scene.working_space, scene.display)?;
        let sequence = Sequence {
            still: None,
            scene: &self.scene,
            outputs: std::slice::from_ref(&self.output),
            moments: &self.moments,
            resume: self.resume,
            film: options.clone(),
            by: &self.by,
            json: self.json,
        };
        let size = |scene: &Scene| {
            let film = self.camera(scene)?.film;
            Ok(film.crop.map_or([film.width, film.height], |[_, _, w, h]| [w, h]))
        };
        sequence.run(scene, size, |scene| {
            let renderer = match self.by.as_str() {
                "realtime" => Renderer::Realtime(Box::new(Realtime::new(self, scene)?)),
                _ => Renderer::Reference,
            };
            Ok(Rendered { render: self, renderer, options, picture: None })
        })
    }
}
