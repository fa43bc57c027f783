//! The stage that draws: which it is to be, in how many pixels, and when its picture is good enough.

use super::App;
use super::graphics::Graphics;
use crate::command::Resolution;
use crate::error::ViewError;
use crate::maker::{Made, Order, Ready};
use std::time::Duration;
use winit::event_loop::ActiveEventLoop;
use yugen_realtime::Options as StageOptions;
use yugen_scene::Camera;

/// Frames after which a picture is good enough.
const MOST_FRAMES: u32 = 1024;
/// After this long without a move nothing moves.
pub(super) const REST: Duration = Duration::from_millis(200);
/// Milliseconds that a frame may take while something moves; and where nothing does, so that the window still answers.
const QUICK: f64 = 60.0;
pub(super) const PATIENT: f64 = 2500.0;

impl App {
    /// Pixels of the picture on the screen.
    pub(super) fn whole(&self) -> Option<[u32; 2]> {
        let (rect, points) = (self.picture?, self.graphics.as_ref()?.pixels_per_point());
        Some([rect.width(), rect.height()].map(|s| (s * points).round().max(1.0) as u32))
    }

    /// The camera of the picture: what the eye sees, in as many pixels as are computed now.
    pub(super) fn view(&self, at_rest: bool) -> Option<Camera> {
        let whole = self.whole()?;
        let mut camera = self.state.eye.camera().clone();
        // All scenes' cameras share the filter that the stage was made for.
        camera.film.filter = self.changed_scene.cameras.first().map_or(camera.film.filter, |c| c.film.filter);
        let part = self.part(whole, at_rest);
        let [w, h] = whole.map(|s| s.div_ceil(part).max(1));
        camera.resize(whole[0], whole[1]);
        camera.resize(w, h);
        Some(camera)
    }

    /// Of how many pixels across and down one is computed.
    pub(super) fn part(&self, [w, h]: [u32; 2], at_rest: bool) -> u32 {
        match self.state.resolution {
            Resolution::Full => 1,
            Resolution::Half => 2,
            Resolution::Quarter => 4,
            Resolution::Auto => {
                if let (true, Some(part)) = (at_rest, self.rest_part) {
                    return part;
                }
                let limit = if at_rest { PATIENT } else { QUICK };
                let [sw, sh] = self.seen.size;
                let each = self.frame_milliseconds / (f64::from(sw) * f64::from(sh)).max(1.0);
                let whole = each * f64::from(w) * f64::from(h);
                [1, 2, 4, 8].into_iter().find(|p| whole / f64::from(p * p) <= limit).unwrap_or(8)
            }
        }
    }

    /// Frames after which a picture is good enough: of one that is not seen the first, for what lies where.
    pub(super) fn enough(&self) -> u32 {
        if self.state.ink.on { 1 } else { MOST_FRAMES }
    }

    pub(super) fn at_rest(&self) -> bool {
        self.moved.elapsed() >= REST
    }

    /// The stage shows what is asked for, at rest, and the device is done.
    pub(super) fn settled(&self) -> bool {
        let rests = |g: &Graphics| g.stage.as_ref().is_some_and(|s| !s.is_moving()) && !g.in_flight();
        let done = self.graphics.as_ref().is_some_and(rests);
        done && self.loading.is_none()
            && self.ink_settled()
            && self.shown_changes == self.state.changes
            && !self.maker.busy()
            && !self.behind
            && self.at_rest()
            && self.frames > 0
            && self.view(true).is_some_and(|v| self.camera.as_ref().is_some_and(|c| same_view(c, &v)))
    }

    /// Has scenes, changes and stages made that are not what is shown.
    pub(super) fn prepare(&mut self, event_loop: &ActiveEventLoop) {
        while let Some(made) = self.maker.take() {
            self.take(event_loop, made);
        }
        if self.asked_changes == self.state.changes && self.asked_scene == self.state.scenes {
            return;
        }
        let anew = self.stage_scene != self.state.scenes
            || self.stage_bounces != self.state.most_bounces()
            || self.stage_lighting != self.state.lighting;
        self.ask(anew);
    }

    /// How long cloth is simulated before what it has come to is shown: not much shorter than what showing it takes; a script
    /// wants to see where it ends.
    fn patience(&self) -> Duration {
        let shown = Duration::from_secs_f64(2e-3 * self.frame_milliseconds.clamp(0.0, 1e4));
        if self.script.is_empty() { shown.max(Duration::from_millis(250)) } else { Duration::MAX }
    }

    pub(super) fn ask(&mut self, anew: bool) {
        let Some(graphics) = &self.graphics else { return };
        let Some(camera) = self.view(true) else { return };
        let options = StageOptions {
            size: [camera.film.width, camera.film.height],
            filter: self.state.scene.cameras.first().map_or(camera.film.filter, |c| c.film.filter),
            denoise: false,
            planned: None,
            aovs: Vec::new(),
            trace_camera: false,
            threads: yugen_optics::parallel::threads(),
            bounces: Some(self.state.most_bounces()),
            hide_emitters: self.state.scene.integrator.hide_emitters,
            lighting: self.state.lighting,
            seed: 0,
        };
        (self.asked_changes, self.asked_scene) = (self.state.changes, self.state.scenes);
        self.maker.ask(Order {
            scene: self.state.scene.clone(),
            moment: self.state.moment(),
            live: self.state.live.as_ref().map(|l| (l.cloth.clone(), l.settings.clone(), self.patience())),
            edits: self.state.edits.clone(),
            number: self.state.changes,
            of: (self.state.scenes, self.state.most_bounces(), self.state.lighting),
            stage: anew.then(|| (graphics.device().clone(), graphics.queue().clone(), options)),
        });
        // What plays is always being prepared.
        self.seen.preparing = !self.state.playing();
    }

    pub(super) fn take(&mut self, event_loop: &ActiveEventLoop, made: Made) {
        let newest = made.number == self.asked_changes;
        self.behind = made.behind;
        if made.behind {
            // Once more, from where the simulation is.
            self.asked_changes = made.number.wrapping_sub(1);
        }
        self.seen.preparing = !newest && !self.state.playing();
        self.prepared = made.seconds;
        let Some(graphics) = &mut self.graphics else { return };
        match made.outcome {
            Err(problem) => {
                if newest {
                    // What was shown stays, and nothing else is waited for.
                    self.shown_changes = made.number;
                }
                if !self.script.is_empty() || graphics.stage.is_none() && self.state.scenes == 1 {
                    self.fail(event_loop, ViewError::Scene(problem));
                } else {
                    self.state.complain(problem);
                }
            }
            Ok((scene, Ready::Stage(stage))) => {
                (self.stage_scene, self.stage_bounces, self.stage_lighting) = made.of;
                graphics.set_stage(*stage);
                self.easel.values += 1;
                (self.changed_scene, self.shown_changes) = (scene, made.number);
                (self.camera, self.frames) = (None, 0);
            }
            Ok((scene, ready @ (Ready::Rows(_) | Ready::Pose(_)))) => {
                let Some(stage) = &mut graphics.stage else { return };
                let taken = match &ready {
                    Ready::Pose(rows) => stage.pose(rows),
                    Ready::Rows(rows) => stage.refill(rows),
                    Ready::Stage(_) => return,
                };
                match taken {
                    Err(e) => self.fail(event_loop, e),
                    Ok(false) => self.ask(true),
                    Ok(true) => {
                        self.easel.values += u64::from(matches!(ready, Ready::Rows(_)));
                        self.state.follow(&scene);
                        (self.changed_scene, self.shown_changes) = (scene, made.number);
                        self.frames = 0;
                    }
                }
            }
        }
    }
}

/// Whether both see the same, in whatever number of pixels.
pub(super) fn same_eye(a: &Camera, b: &Camera) -> bool {
    a.to_world == b.to_world && a.near_far == b.near_far
}

pub(super) fn same_view(a: &Camera, b: &Camera) -> bool {
    same_eye(a, b)
        && a.projection == b.projection
        && (a.film.width, a.film.height) == (b.film.width, b.film.height)
}
