//! Commands one after the other, each when what was before is seen.

use crate::action::{Command, Step};
use crate::error::ViewError;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A step that takes longer is stuck.
const PATIENCE: Duration = Duration::from_secs(600);

/// What is left of a script.
pub struct Script {
    steps: VecDeque<Step>,
    /// The last that was begun.
    last: String,
    done: usize,
    begun: Instant,
    scripted: bool,
}

impl Script {
    /// All of it.
    pub fn new(steps: Vec<Step>) -> Self {
        let (scripted, steps) = (!steps.is_empty(), steps.into());
        Self { scripted, steps, last: String::new(), done: 0, begun: Instant::now() }
    }

    /// Whether nobody waits for anything to be done.
    pub fn is_empty(&self) -> bool {
        !self.scripted || self.steps.is_empty()
    }

    /// What is to be done next.
    pub fn next(&self) -> Option<Command> {
        self.steps.front().map(|s| s.command.clone())
    }

    /// It was begun.
    pub fn done(&mut self) {
        self.last = self.steps.pop_front().map_or(String::new(), |s| s.text);
        self.done += 1;
        self.begun = Instant::now();
    }

    /// Counts the time of the next step from now.
    pub fn wait_from_now(&mut self) {
        self.begun = Instant::now();
    }

    /// Since the step before.
    pub fn waited(&self) -> Duration {
        self.begun.elapsed()
    }

    /// Why it does not go on, if it has not for long.
    pub fn stuck(&self) -> Option<ViewError> {
        let what = self.steps.front()?;
        (self.begun.elapsed() > PATIENCE).then(|| ViewError::Script {
            step: self.done + 1,
            what: what.text.clone(),
            problem: format!("it could not be done within {} s", PATIENCE.as_secs()),
        })
    }

    /// The step that was begun last went wrong.
    pub fn failed(&self, problem: String) -> ViewError {
        ViewError::Script { step: self.done, what: self.last.clone(), problem }
    }
}
