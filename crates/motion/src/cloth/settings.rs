//! How the default solver works.

use super::small_steps::CALM;

/// How [`SmallSteps`](super::SmallSteps) works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Length of a step, s.
    pub seconds: f32,
    /// Of each step, at the least: a fine mesh of a stiff cloth needs more ([`SmallSteps::substeps`](super::SmallSteps::substeps)).
    pub substeps: u32,
    /// Coarse levels; without, a cloth stretches under its weight the more the finer it is.
    pub coarse: bool,
    /// Whether springs that follow each other along a thread are solved all at once: a fifth of the substeps leaves the stretch that all
    /// would. It gains a garment nothing whose threads end at seams and hang from a few vertices.
    pub lines: bool,
    /// Whether cloth touches cloth.
    pub contact: bool,
    /// Part of its speed past its target that an attached vertex loses in a substep, and four times the part of the way to it that
    /// it goes: 1 holds it there whatever pulls; with less it gives way to what is stronger, as cloth under a belt does, and does
    /// not go through other cloth.
    pub grip: f32,
    /// Threads; the result does not depend on them.
    pub threads: usize,
}

impl Default for Settings {
    /// 20 substeps of a sixtieth of a second, on one thread, with coarse levels alone.
    fn default() -> Self {
        Self {
            seconds: 1.0 / 60.0,
            substeps: 20,
            coarse: true,
            lines: false,
            contact: false,
            grip: 1.0,
            threads: 1,
        }
    }
}

impl Settings {
    /// For how long dampers and air act at a time.
    pub(super) fn calm_seconds(&self) -> f32 {
        self.seconds / self.substeps.div_ceil(CALM) as f32
    }
}
