//! What is simulated, whatever it is.

use super::output::Surface;
use anyhow::Result;
use yugen_motion::cloth::{SmallSteps, Spring};
use yugen_optics::Vec3;

/// A cloth that moves frame by frame.
pub trait Subject {
    /// Its mesh.
    fn surface(&self) -> &Surface;

    /// What moves it.
    fn solver(&self) -> &SmallSteps;

    /// What it needs to go on, as [`SmallSteps::memory`].
    fn memory(&self) -> Vec<f32> {
        self.solver().memory()
    }

    /// As [`SmallSteps::search_anew`].
    fn search_anew(&mut self);

    /// How many frames there are where nobody says it.
    fn frames(&self) -> u32;

    /// Where the vertices of the mesh are, in the world, m.
    fn points(&self) -> Vec<Vec3>;

    /// To a frame from the one before; the first is 0.
    fn step(&mut self, frame: u32) -> Result<()>;

    /// Whether a spring counts when stretch is reported.
    fn counts(&self, _spring: &Spring) -> bool {
        true
    }

    /// What a report says besides.
    fn report(&self) -> serde_json::Value;
}
