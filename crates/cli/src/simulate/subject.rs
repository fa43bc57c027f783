//! What is simulated, whatever it is.

use super::dressed::Dressed;
use super::on_gpu::OnGpu;
use super::options::ClothOptions;
use super::output::Surface;
use super::scene_cloth::SceneCloth;
use crate::render::interrupt::Interrupt;
use anyhow::Result;
use std::path::PathBuf;
use yugen_motion::cloth::rows::Now;
use yugen_motion::cloth::{SmallSteps, Spring, Step};
use yugen_optics::Vec3;
use yugen_scene::Scene;

/// What is to be simulated.
#[derive(Clone)]
pub struct Task {
    /// Which cloth, and how.
    pub options: ClothOptions,
    /// The scene's file, by which messages call it.
    pub file: PathBuf,
    /// Frames, where somebody says it.
    pub frames: Option<u32>,
    /// Without a progress bar.
    pub quiet: bool,
}

impl Task {
    /// The cloth of a scene, where its simulation begins; from a memory where there is one.
    pub fn begin(
        &self,
        scene: Scene,
        memory: Option<&[f32]>,
        interrupt: &Interrupt,
    ) -> Result<Box<dyn Subject + Send>> {
        let fabric = self.options.fabric()?;
        let subject: Box<dyn Subject + Send> = match &self.options.garment {
            Some(text) => Box::new(Dressed::new(self, text, &scene, &fabric, memory, interrupt)?),
            None => Box::new(SceneCloth::new(self.clone(), scene, &fabric, memory)?),
        };
        Ok(match self.options.gpu {
            true => Box::new(OnGpu::new(subject)?),
            false => subject,
        })
    }
}

/// A cloth that moves frame by frame.
#[cfg_attr(not(feature = "view"), allow(dead_code, reason = "some of it only the window asks for"))]
pub trait Subject {
    /// Its mesh.
    fn surface(&self) -> &Surface;

    /// What moves it.
    fn solver(&self) -> &SmallSteps;

    /// What it needs to go on, as [`SmallSteps::memory`].
    fn memory(&self) -> Vec<f32> {
        self.solver().memory()
    }

    /// Goes back to where it was when it was asked for this memory; whether the memory is its own.
    fn recall(&mut self, memory: &[f32]) -> bool;

    /// Which shapes of the scene its objects are, one after the other; of those that are not listed none.
    fn shapes(&self) -> Vec<usize> {
        Vec::new()
    }

    /// As [`SmallSteps::search_anew`].
    fn search_anew(&mut self);

    /// How many frames there are where nobody says it.
    fn frames(&self) -> u32;

    /// Air moves at so many m/s from the next step on.
    fn blow(&mut self, wind: Vec3);

    /// Where the vertices of the mesh are, in the world, m.
    fn points(&self) -> Vec<Vec3>;

    /// To a frame from the one before; the first is 0.
    fn step(&mut self, frame: u32) -> Result<()>;

    /// What acts on the solver on the way to a frame from the one before, for another solver.
    fn given(&mut self, frame: u32) -> Result<Step<'_>>;

    /// Goes on from where another solver is; whether that is of the same cloth.
    fn go_on(&mut self, now: &Now) -> bool;

    /// Whether a spring counts when stretch is reported.
    fn counts(&self, _spring: &Spring) -> bool {
        true
    }

    /// What a report says besides.
    fn report(&self) -> serde_json::Value;
}
