//! Cloth that the GPU moves, whatever it is.

use super::output::Surface;
use super::subject::Subject;
use anyhow::{Context, Result, ensure};
use yugen_motion::cloth::rows::Now;
use yugen_motion::cloth::{SmallSteps, Spring, Step};
use yugen_optics::Vec3;
use yugen_realtime::{ClothPass, Gpu};

/// A cloth whose solver follows what the GPU makes of it.
pub struct OnGpu {
    subject: Box<dyn Subject + Send>,
    pass: ClothPass,
    /// Whether it was said that pairs had no room.
    told: bool,
}

impl OnGpu {
    /// From where `subject` is.
    pub fn new(subject: Box<dyn Subject + Send>) -> Result<Self> {
        let gpu = Gpu::open().context("--gpu")?;
        let pass = ClothPass::new(&gpu.device, &gpu.queue, subject.solver()).context("--gpu")?;
        Ok(Self { subject, pass, told: false })
    }

    fn resume(&mut self) -> bool {
        self.pass.resume(self.subject.solver())
    }
}

impl Subject for OnGpu {
    fn surface(&self) -> &Surface {
        self.subject.surface()
    }

    fn solver(&self) -> &SmallSteps {
        self.subject.solver()
    }

    fn memory(&self) -> Vec<f32> {
        self.subject.memory()
    }

    fn recall(&mut self, memory: &[f32]) -> bool {
        self.subject.recall(memory) && self.resume()
    }

    fn shapes(&self) -> Vec<usize> {
        self.subject.shapes()
    }

    /// Also what the GPU remembers beside the solver's memory is forgotten.
    fn search_anew(&mut self) {
        self.subject.search_anew();
        let alike = self.resume();
        debug_assert!(alike, "it was made from this solver");
    }

    fn frames(&self) -> u32 {
        self.subject.frames()
    }

    fn blow(&mut self, wind: Vec3) {
        self.subject.blow(wind);
    }

    fn points(&self) -> Vec<Vec3> {
        self.subject.points()
    }

    fn step(&mut self, frame: u32) -> Result<()> {
        self.pass.step(&self.subject.given(frame)?);
        ensure!(self.subject.go_on(&self.pass.now()?), "the cloth on the GPU is another one");
        if !self.told && self.pass.missed()? > 0 {
            self.told = true;
            tracing::warn!(
                "the cloth is so crumpled that --gpu has no room for all that touches: it may pass through itself; without --gpu it has"
            );
        }
        Ok(())
    }

    fn given(&mut self, frame: u32) -> Result<Step<'_>> {
        self.subject.given(frame)
    }

    fn go_on(&mut self, now: &Now) -> bool {
        self.subject.go_on(now) && self.resume()
    }

    fn counts(&self, spring: &Spring) -> bool {
        self.subject.counts(spring)
    }

    fn report(&self) -> serde_json::Value {
        self.subject.report()
    }
}
