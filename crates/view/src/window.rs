//! The loop of events: a window, the stage in it, and whatever is asked of both.

mod compare;
mod graphics;
mod ink;
mod load;
mod save;
mod script;
mod stage;

use crate::action::Step;
use crate::command::Command;
use crate::error::ViewError;
use crate::files::{Files, Loaded, Picture};
use crate::language::{Language, Words};
use crate::maker::Maker;
use crate::reference::{Difference, Finding, Reference};
use crate::state::{Effect, State};
use crate::ui::{self, Seen};
use compare::COMPARE;
use graphics::Graphics;
use ink::Easel;
use load::{Loading, WATCH};
use script::Script;
use stage::{PATIENT, REST, same_eye, same_view};
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant, SystemTime};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, WindowId};
use yugen_ink::signature::Font;
use yugen_realtime::Lighting;
use yugen_scene::prepared::DrawRow;
use yugen_scene::{Camera, Scene};

/// What the window is opened with.
pub struct Options {
    /// The scene, and cloth of it that is simulated.
    pub loaded: Loaded,
    /// Its file.
    pub file: PathBuf,
    /// Pixels of the window.
    pub size: [u32; 2],
    /// What it speaks.
    pub language: Language,
    /// A font with Japanese characters, if one was found.
    pub font: Option<Font>,
    /// To be done one after the other, each when what was before is seen.
    pub script: Vec<Step>,
}

/// Between two looks at whether the device is done.
const LOOK: Duration = Duration::from_millis(3);
/// Simulated cloth goes on by at least this before it is shown, s, or by what has passed.
const LIVE_STRIDE: f32 = 1.0 / 30.0;
/// Frame times that are remembered.
const HISTORY: usize = 120;

const NO_FONT: Words = [
    "no font with Japanese characters was found, so this is in English (Debian: apt-get install fonts-noto-cjk)",
    "",
];

/// What wakes the loop.
pub(crate) enum Wake {
    /// A thread has something.
    Thread,
    /// Somebody who hears the window.
    Access(egui_winit::accesskit_winit::Event),
}

impl From<egui_winit::accesskit_winit::Event> for Wake {
    fn from(event: egui_winit::accesskit_winit::Event) -> Self {
        Self::Access(event)
    }
}

/// Opens the window and returns when it is closed.
pub fn run(options: Options, files: Arc<dyn Files>) -> Result<(), ViewError> {
    let mut builder = EventLoop::<Wake>::with_user_event();
    let event_loop = builder.build().map_err(|e| {
        tracing::debug!("no display: {e}");
        ViewError::NoDisplay
    })?;
    let mut app = App::new(options, files, event_loop.create_proxy());
    event_loop.run_app(&mut app).map_err(|e| ViewError::NoWindow(e.to_string()))?;
    app.failure.map_or(Ok(()), Err)
}

struct App {
    files: Arc<dyn Files>,
    state: State,
    font: Option<Font>,
    window_size: [u32; 2],
    proxy: EventLoopProxy<Wake>,
    graphics: Option<Graphics>,
    maker: Maker,
    /// The changes that the stage shows and those that are being made.
    shown_changes: u64,
    asked_changes: u64,
    asked_scene: u64,
    stage_scene: u64,
    stage_bounces: u32,
    stage_lighting: Lighting,
    /// The scene as it is shown.
    changed_scene: Arc<Scene>,
    prepared: f64,
    /// Simulated cloth has not come to where it should be.
    behind: bool,
    /// By how much it last went on, s.
    stride: f32,
    camera: Option<Camera>,
    moved: Instant,
    /// Of how many pixels one is computed since nothing moves, so that a frame that takes longer than others starts nothing anew.
    rest_part: Option<u32>,
    frames: u32,
    displayed: Option<(f32, yugen_optics::tonemap::Curve)>,
    seen: Seen,
    picture: Option<egui::Rect>,
    frame_milliseconds: f64,
    reference: Option<Reference>,
    /// What the reference is of: changes and view.
    reference_of: Option<(u64, Camera)>,
    finding: Option<Finding>,
    comparing: Option<mpsc::Receiver<Option<Difference>>>,
    compared: Instant,
    compared_number: u64,
    easel: Easel,
    /// When the animation last went on.
    played: Option<Instant>,
    loading: Option<Loading>,
    watched: Option<SystemTime>,
    looked: Instant,
    script: Script,
    failure: Option<ViewError>,
}

impl App {
    fn new(options: Options, files: Arc<dyn Files>, proxy: EventLoopProxy<Wake>) -> Self {
        let language = match (&options.font, options.language) {
            (None, Language::Japanese) => Language::English,
            (_, language) => language,
        };
        let Loaded { scene, live } = options.loaded;
        let mut state = State::new(scene, &options.file, language);
        state.set_live(live);
        if language != options.language {
            state.complain(NO_FONT[0]);
        }
        let wake = proxy.clone();
        let watched = files.changed(&options.file);
        Self {
            changed_scene: state.scene.clone(),
            files,
            state,
            seen: Seen { japanese: options.font.is_some(), ..Seen::default() },
            font: options.font,
            window_size: options.size,
            // The loop may have ended.
            maker: Maker::new(move || drop(wake.send_event(Wake::Thread))),
            proxy,
            graphics: None,
            shown_changes: 0,
            asked_changes: 0,
            asked_scene: 0,
            stage_scene: 0,
            stage_bounces: u32::MAX,
            stage_lighting: Lighting::default(),
            prepared: 0.0,
            behind: false,
            stride: 0.0,
            camera: None,
            moved: Instant::now(),
            rest_part: None,
            frames: 0,
            displayed: None,
            picture: None,
            frame_milliseconds: 0.0,
            reference: None,
            reference_of: None,
            finding: None,
            comparing: None,
            compared: Instant::now(),
            compared_number: 0,
            easel: Easel::default(),
            played: None,
            loading: None,
            watched,
            looked: Instant::now(),
            script: Script::new(options.script),
            failure: None,
        }
    }

    fn fail(&mut self, event_loop: &ActiveEventLoop, failure: impl Into<ViewError>) {
        if self.failure.is_none() {
            self.failure = Some(failure.into());
        }
        event_loop.exit();
    }

    /// Adds a frame to the picture where there is room for one.
    fn advance(&mut self, event_loop: &ActiveEventLoop) {
        let at_rest = self.at_rest();
        let Some(view) = self.view(true) else { return };
        let moved = self.camera.as_ref().is_some_and(|c| !same_eye(c, &view));
        if moved {
            self.moved = Instant::now();
            self.rest_part = None;
        }
        let Some(view) = self.view(at_rest && !moved) else { return };
        if at_rest && !moved && self.rest_part.is_none() {
            self.rest_part = self.whole().map(|whole| self.part(whole, true));
        }
        let display = (self.state.exposure, self.state.curve);
        let enough = self.enough();
        let Some(graphics) = &mut self.graphics else { return };
        if graphics.in_flight() {
            return;
        }
        let settings = graphics.settings(&self.state);
        let Some(stage) = &mut graphics.stage else { return };
        let moving = !at_rest || moved;
        if stage.is_moving() != moving {
            stage.set_moving(moving);
            // What is seen at rest does not depend on how it came to be.
            self.frames = if moving { self.frames } else { 0 };
        }
        let same = self.camera.as_ref().is_some_and(|c| same_view(c, &view)) && self.frames > 0;
        let outcome = if same && self.frames >= enough {
            if self.displayed == Some(display) {
                return;
            } else {
                graphics.show(settings).map(|()| self.frames)
            }
        } else {
            graphics.frame(&view, settings)
        };
        match outcome {
            Err(e) => return self.fail(event_loop, e),
            Ok(frames) => self.frames = frames,
        }
        self.seen.size = [view.film.width, view.film.height];
        self.seen.frames = self.frames;
        self.seen.realtime = graphics.realtime();
        (self.camera, self.displayed) = (Some(view), Some(display));
    }

    /// Lets an animation go on, as much as time has since it last did.
    fn play(&mut self) {
        let since = self.played.replace(Instant::now()).filter(|_| self.state.playing());
        if !self.state.playing() {
            self.played = None;
        }
        // A pose that is still being made is not overtaken: what is slow is slow to play, and loses nothing.
        if let Some(since) = since {
            if self.maker.busy() || self.behind {
                self.played = Some(since);
            } else {
                let elapsed = since.elapsed().as_secs_f32();
                let mut stride = elapsed.min(0.25);
                if self.state.live.is_some() {
                    // As fast as the last one was computed, in half of the time: what is slow plays slowly.
                    let half = 0.5 * elapsed * self.stride / self.prepared as f32;
                    stride = stride.min(half.max(LIVE_STRIDE));
                    self.stride = stride;
                    self.seen.pace = Some(stride / elapsed);
                }
                self.state.go_on(stride);
                self.moved = Instant::now();
                self.rest_part = None;
            }
        }
    }

    /// Does it, or says in the window why not; in a script, ends.
    fn apply(&mut self, event_loop: &ActiveEventLoop, command: &Command) -> Result<(), String> {
        let outcome = self.state.apply(command).and_then(|effect| self.effect(event_loop, effect));
        if matches!(command, Command::Camera(_)) {
            self.state.follow(&self.changed_scene);
        }
        if self.state.language == Language::Japanese && self.font.is_none() {
            self.state.language = Language::English;
            self.state.complain(NO_FONT[0]);
        }
        outcome
    }

    fn effect(&mut self, event_loop: &ActiveEventLoop, effect: Effect) -> Result<(), String> {
        match effect {
            Effect::None | Effect::Wait(_) => {}
            Effect::Quit => event_loop.exit(),
            Effect::Open(file) => self.load(&file, true),
            Effect::Save(file) => self.save(&file)?,
            Effect::Window(file) => {
                if let Some(graphics) = &mut self.graphics {
                    graphics.wants_window = Some((file, 2));
                }
            }
            Effect::Pick(place) if self.state.ink.on => self.pick_ink(place)?,
            Effect::Pick(place) => match self.picked(place)? {
                Some(draw) => self.state.select_material(draw.material as usize),
                None => self.state.selected = None,
            },
            Effect::Preset(file) => {
                let text = self.files.read_text(&file)?;
                // By its whole path, since the preset may be written anywhere.
                let open = |brush: &str| {
                    let picture = file.with_file_name(brush);
                    let picture = std::path::absolute(&picture).unwrap_or(picture);
                    Ok((picture.display().to_string(), self.files.read_picture(&picture)?))
                };
                self.state.ink.read(&text, &file.display().to_string(), &open)?;
                self.state.paint(true);
            }
            Effect::FullScreen => {
                if let Some(graphics) = &self.graphics {
                    let full = graphics.window.fullscreen().is_none().then_some(Fullscreen::Borderless(None));
                    graphics.window.set_fullscreen(full);
                }
            }
            Effect::Report => self.files.report(&self.report()),
        }
        Ok(())
    }

    /// What is placed at a place of the picture.
    fn picked(&self, [x, y]: [f32; 2]) -> Result<Option<DrawRow>, String> {
        let [w, h] = self.seen.size;
        let pixel = |part: f32, all: u32| {
            (part.clamp(0.0, 1.0) * all as f32).min(all.saturating_sub(1) as f32) as u32
        };
        let Some(stage) = self.graphics.as_ref().and_then(|g| g.stage.as_ref()) else { return Ok(None) };
        let picked = stage.pick([pixel(x, w), pixel(y, h)]).map_err(|e| e.to_string())?;
        Ok(picked.and_then(|p| stage.scene().draws().get(p.draw as usize)).copied())
    }

    fn draw(&mut self, event_loop: &ActiveEventLoop) {
        let Some(graphics) = &mut self.graphics else { return };
        if !graphics.visible() {
            return;
        }
        self.seen.passes = graphics.passes();
        let (state, seen) = (&self.state, &self.seen);
        let asked = graphics.run_ui(|ui| ui::show(ui, state, seen));
        let moved = self.picture != asked.picture;
        if moved {
            self.rest_part = None;
        }
        self.picture = asked.picture;
        for command in &asked.commands {
            if let Err(problem) = self.apply(event_loop, command) {
                self.state.complain(problem);
            }
        }
        self.play();
        self.prepare(event_loop);
        // Before another frame keeps the device busy.
        self.compare(event_loop);
        self.advance(event_loop);
        self.refine();
        self.paint_ink(event_loop);
        let Some(graphics) = &mut self.graphics else { return };
        let painted = graphics.paint();
        if moved || !asked.commands.is_empty() {
            graphics.window.request_redraw();
        }
        match painted {
            Err(e) => self.fail(event_loop, e),
            Ok(Some((file, image))) => {
                let picture = Picture {
                    image,
                    space: yugen_optics::ColourSpace::LinearSrgb,
                    exposure: 0.0,
                    curve: yugen_optics::tonemap::Curve::Clip,
                };
                if let Err(problem) = self.written(&file, picture) {
                    match self.script.is_empty() {
                        true => self.state.complain(problem),
                        false => self.fail(event_loop, ViewError::Scene(problem)),
                    }
                }
            }
            Ok(None) => {}
        }
    }
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.graphics.is_some() {
            return;
        }
        match Graphics::new(event_loop, &self.proxy, self.window_size, self.font.as_ref()) {
            Ok(graphics) => {
                graphics.set_title(&self.state.file);
                (self.seen.adapter, self.seen.surface) =
                    (graphics.adapter.clone(), graphics.surface_name.clone());
                tracing::info!("{} on {}", self.seen.surface, self.seen.adapter);
                graphics.window.request_redraw();
                self.graphics = Some(graphics);
            }
            Err(e) => self.fail(event_loop, e),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(graphics) = &mut self.graphics else { return };
        match &event {
            WindowEvent::CloseRequested => return event_loop.exit(),
            WindowEvent::RedrawRequested => return self.draw(event_loop),
            WindowEvent::Resized(size) => graphics.resize([size.width, size.height]),
            WindowEvent::DroppedFile(file) => {
                self.seen.dropping = false;
                let file = file.clone();
                return self.load(&file, true);
            }
            WindowEvent::HoveredFile(_) => self.seen.dropping = true,
            WindowEvent::HoveredFileCancelled => self.seen.dropping = false,
            _ => {}
        }
        if graphics.on_event(&event) {
            graphics.window.request_redraw();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, event: Wake) {
        let Some(graphics) = &mut self.graphics else { return };
        if let Wake::Access(event) = event {
            graphics.on_access(event);
        }
        graphics.window.request_redraw();
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if self.graphics.is_none() {
            return;
        }
        self.watch(event_loop);
        let Some(graphics) = &mut self.graphics else { return };
        if let Some(refused) = graphics.refused() {
            return self.fail(event_loop, ViewError::Refused(refused));
        }
        if let Some(took) = graphics.landed() {
            self.frame_milliseconds = took;
            // The first frame tells how fast the device is; one may be far slower than was thought.
            if self.seen.history.is_empty() || took > 2.0 * PATIENT {
                self.rest_part = None;
            }
            self.seen.history.push_back(took as f32);
            if self.seen.history.len() > HISTORY {
                self.seen.history.pop_front();
            }
            graphics.window.request_redraw();
        }
        // Now that the device is done, and before it is given more to do.
        self.follow_script(event_loop);
        let at_rest = self.at_rest();
        let fresh = |f: &Finding| f.samples >= 1.0 && f.number != self.compared_number;
        let compared =
            self.comparing.is_some() || self.frames < 4 || !self.finding.as_ref().is_some_and(fresh);
        let mut until = Instant::now() + WATCH;
        let enough = self.enough();
        let Some(graphics) = &mut self.graphics else { return };
        if !compared && self.compared.elapsed() >= COMPARE && !graphics.in_flight() {
            graphics.window.request_redraw();
        }
        if graphics.in_flight() {
            until = Instant::now() + LOOK;
        } else if self.frames < enough && graphics.stage.is_some() && graphics.visible() {
            graphics.window.request_redraw();
        }
        if self.state.playing() && !graphics.in_flight() {
            graphics.window.request_redraw();
        }
        if !at_rest {
            // Pixels that were left out while something moved.
            until = until.min(self.moved + REST);
        }
        if let Some(wanted) = graphics.repaint_at() {
            if wanted <= Instant::now() {
                graphics.window.request_redraw();
            } else {
                until = until.min(wanted);
            }
        }
        if !self.script.is_empty() {
            until = until.min(Instant::now() + Duration::from_millis(20));
            if !graphics.in_flight() {
                graphics.window.request_redraw();
            }
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(until));
    }
}
