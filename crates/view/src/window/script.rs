//! Commands one after the other, each when what was before is seen.

use super::App;
use crate::action::Step;
use crate::command::Command;
use crate::error::ViewError;
use crate::mask::MaskChange;
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

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

impl App {
    /// Goes on with the script as far as it can be.
    pub(super) fn follow_script(&mut self, event_loop: &ActiveEventLoop) {
        while let Some(command) = self.script.next() {
            let draws = matches!(command, Command::Mask(MaskChange::Draw(_)));
            let stands_still =
                draws || matches!(command, Command::Wait(_) | Command::Save(_) | Command::Pick(_));
            if self.state.playing() && stands_still {
                self.script.done();
                let failure = self.script.failed("what plays never comes to rest: `play off` first".into());
                return self.fail(event_loop, failure);
            }
            let no_picture = self.graphics.as_ref().is_none_or(|g| g.stage.is_none());
            if no_picture && matches!(command, Command::Pause(_)) {
                // Nothing plays before there is a picture.
                self.script.wait_from_now();
            }
            let ready = match &command {
                Command::Pause(seconds) => self.script.waited().as_secs_f32() >= *seconds,
                Command::Window(_) | Command::Report if self.state.playing() => !no_picture,
                Command::Wait([frames, samples]) => {
                    let refined = !self.state.reference
                        || self.seen.samples >= *samples as f32 && self.seen.difference.is_some();
                    self.settled() && self.frames >= (*frames).min(self.enough()) && refined
                }
                Command::Save(_) | Command::Window(_) | Command::Pick(_) | Command::Report => self.settled(),
                Command::Open(_) | Command::Reload => self.settled(),
                // Where a surface is seen is known once it is painted.
                _ if draws => self.settled(),
                Command::Quit => self.loading.is_none(),
                _ => true,
            } && self.graphics.as_ref().is_some_and(|g| g.wants_window.is_none());
            if !ready {
                if let Some(failure) = self.script.stuck() {
                    self.fail(event_loop, failure);
                }
                return;
            }
            self.script.done();
            if let Err(problem) = self.apply(event_loop, &command) {
                let failure = self.script.failed(problem);
                return self.fail(event_loop, failure);
            }
            if matches!(command, Command::Quit) {
                return;
            }
            if let Some(graphics) = &self.graphics {
                graphics.window.request_redraw();
            }
        }
    }
}
