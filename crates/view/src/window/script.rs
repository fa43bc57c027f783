//! Commands one after the other, each when what was before is seen.

use crate::action::Command;
use crate::error::ViewError;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A step that takes longer is stuck.
const PATIENCE: Duration = Duration::from_secs(600);

/// What is left of a script.
pub struct Script {
    steps: VecDeque<Command>,
    done: usize,
    begun: Instant,
    scripted: bool,
}

impl Script {
    /// All of it.
    pub fn new(steps: Vec<Command>) -> Self {
        Self { scripted: !steps.is_empty(), steps: steps.into(), done: 0, begun: Instant::now() }
    }

    /// Whether nobody waits for anything to be done.
    pub fn is_empty(&self) -> bool {
        !self.scripted || self.steps.is_empty()
    }

    /// What is to be done next.
    pub fn next(&self) -> Option<Command> {
        self.steps.front().cloned()
    }

    /// It was begun.
    pub fn done(&mut self) {
        self.steps.pop_front();
        self.done += 1;
        self.begun = Instant::now();
    }

    /// Why it does not go on, if it has not for long.
    pub fn stuck(&self) -> Option<ViewError> {
        let what = self.steps.front()?;
        (self.begun.elapsed() > PATIENCE).then(|| ViewError::Script {
            step: self.done + 1,
            what: format!("{what:?}"),
            problem: format!("it could not be done within {} s", PATIENCE.as_secs()),
        })
    }

    /// The step before the next went wrong.
    pub fn failed(&self, what: &Command, problem: String) -> ViewError {
        ViewError::Script { step: self.done, what: format!("{what:?}"), problem }
    }
}
