//! The loop of events: a window, the stage in it, and whatever is asked of both.

mod graphics;
mod ink;
mod script;

use crate::action::{Command, Resolution, Step};
use crate::error::ViewError;
use crate::files::{Files, Picture, Report};
use crate::language::{Language, Words};
use crate::maker::{Made, Maker, Order, Ready};
use crate::reference::{Difference, Finding, Reference, difference};
use crate::state::{Effect, State};
use crate::ui::{self, Seen};
use graphics::Graphics;
use ink::Easel;
use script::Script;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant, SystemTime};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, WindowId};
use yugen_ink::signature::Font;
use yugen_optics::Image;
use yugen_optics::tonemap::ToneMap;
use yugen_realtime::{Lighting, Options as StageOptions};
use yugen_scene::prepared::DrawRow;
use yugen_scene::{Camera, Scene};

/// What the window is opened with.
pub struct Options {
    /// The scene.
    pub scene: Scene,
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

/// Frames after which a picture is good enough.
const MOST_FRAMES: u32 = 1024;
/// After this long without a move nothing moves.
const REST: Duration = Duration::from_millis(200);
/// Milliseconds that a frame may take while something moves; and where nothing does, so that the window still answers.
const QUICK: f64 = 60.0;
const PATIENT: f64 = 2500.0;
/// Between two looks at whether the device is done.
const LOOK: Duration = Duration::from_millis(3);
/// Between two looks at whether the file has changed.
const WATCH: Duration = Duration::from_millis(500);
/// Between two comparisons with the reference, at least.
const COMPARE: Duration = Duration::from_millis(1500);
/// Frame times that are remembered.
const HISTORY: usize = 120;

const NO_FONT: Words = [
    "no font with Japanese characters was found, so this is in English (Debian: apt-get install fonts-noto-cjk)",
    "",
];
const SAVED: Words = ["saved", "保存しました："];

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

/// A scene on its way from its file.
struct Loading {
    file: PathBuf,
    /// When it had last changed.
    changed: Option<SystemTime>,
    /// Somebody wants it; else the file has changed.
    asked: bool,
    scene: mpsc::Receiver<Result<Scene, String>>,
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
        let mut state = State::new(options.scene, &options.file, language);
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

    /// Pixels of the picture on the screen.
    fn whole(&self) -> Option<[u32; 2]> {
        let (rect, points) = (self.picture?, self.graphics.as_ref()?.pixels_per_point());
        Some([rect.width(), rect.height()].map(|s| (s * points).round().max(1.0) as u32))
    }

    /// The camera of the picture: what the eye sees, in as many pixels as are computed now.
    fn view(&self, at_rest: bool) -> Option<Camera> {
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
    fn part(&self, [w, h]: [u32; 2], at_rest: bool) -> u32 {
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
    fn enough(&self) -> u32 {
        if self.state.ink.on { 1 } else { MOST_FRAMES }
    }

    fn at_rest(&self) -> bool {
        self.moved.elapsed() >= REST
    }

    /// The stage shows what is asked for, at rest, and the device is done.
    fn settled(&self) -> bool {
        let rests = |g: &Graphics| g.stage.as_ref().is_some_and(|s| !s.is_moving()) && !g.in_flight();
        let done = self.graphics.as_ref().is_some_and(rests);
        done && self.loading.is_none()
            && self.ink_settled()
            && self.shown_changes == self.state.changes
            && !self.maker.busy()
            && self.at_rest()
            && self.frames > 0
            && self.view(true).is_some_and(|v| self.camera.as_ref().is_some_and(|c| same_view(c, &v)))
    }

    /// Has scenes, changes and stages made that are not what is shown.
    fn prepare(&mut self, event_loop: &ActiveEventLoop) {
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

    fn ask(&mut self, anew: bool) {
        let Some(graphics) = &self.graphics else { return };
        let Some(camera) = self.view(true) else { return };
        let options = StageOptions {
            size: [camera.film.width, camera.film.height],
            filter: self.state.scene.cameras.first().map_or(camera.film.filter, |c| c.film.filter),
            aovs: Vec::new(),
            trace_camera: false,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            bounces: Some(self.state.most_bounces()),
            hide_emitters: self.state.scene.integrator.hide_emitters,
            lighting: self.state.lighting,
            seed: 0,
        };
        (self.asked_changes, self.asked_scene) = (self.state.changes, self.state.scenes);
        self.maker.ask(Order {
            scene: self.state.scene.clone(),
            moment: self.state.moment(),
            edits: self.state.edits.clone(),
            number: self.state.changes,
            of: (self.state.scenes, self.state.most_bounces(), self.state.lighting),
            stage: anew.then(|| (graphics.device().clone(), graphics.queue().clone(), options)),
        });
        // What plays is always being prepared.
        self.seen.preparing = !self.state.playing();
    }

    fn take(&mut self, event_loop: &ActiveEventLoop, made: Made) {
        let newest = made.number == self.asked_changes;
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
        let settings = graphics::settings(&self.state);
        let enough = self.enough();
        let Some(graphics) = &mut self.graphics else { return };
        if graphics.in_flight() {
            return;
        }
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
            if self.maker.busy() {
                self.played = Some(since);
            } else {
                self.state.go_on(since.elapsed().as_secs_f32().min(0.25));
                self.moved = Instant::now();
                self.rest_part = None;
            }
        }
    }

    /// Starts, restarts and ends the reference, and shows what it has found.
    fn refine(&mut self) {
        if !self.state.reference {
            (self.reference, self.reference_of, self.finding) = (None, None, None);
            (self.seen.reference, self.seen.difference, self.seen.samples) = (None, None, 0.0);
            self.comparing = None;
            return;
        }
        let Some(view) = self.view(true) else { return };
        let same =
            |(changes, camera): &(u64, Camera)| *changes == self.shown_changes && same_view(camera, &view);
        if !self.reference_of.as_ref().is_some_and(same) {
            // What it has found is of another picture, and what is being compared as well.
            (self.reference, self.reference_of, self.finding) = (None, None, None);
            self.comparing = None;
            (self.seen.reference, self.seen.difference, self.seen.samples) = (None, None, 0.0);
            if self.at_rest() && self.shown_changes == self.state.changes && self.frames > 0 {
                let wake = self.proxy.clone();
                let bounces = self.state.most_bounces();
                self.reference = Some(Reference::start(&self.changed_scene, &view, bounces, move || {
                    // The loop may have ended.
                    drop(wake.send_event(Wake::Thread));
                }));
                self.reference_of = Some((self.shown_changes, view));
                self.compared_number = 0;
            }
        }
        let settings = graphics::settings(&self.state);
        let Some(graphics) = &mut self.graphics else { return };
        match self.reference.as_ref().and_then(Reference::take) {
            Some(Err(problem)) => {
                self.state.reference = false;
                self.state.complain(problem);
            }
            Some(Ok(finding)) => {
                graphics.set_reference(&finding.image);
                self.seen.samples = finding.samples;
                self.seen.reference = graphics.reference();
                self.finding = Some(finding);
            }
            None => {}
        }
        if self.finding.is_some() {
            graphics.show_reference(settings);
        }
    }

    /// Measures how far the two are apart, now and then.
    fn compare(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(comparing) = &self.comparing {
            match comparing.try_recv() {
                Err(mpsc::TryRecvError::Empty) => return,
                Ok(difference) => self.seen.difference = difference.filter(|_| self.state.reference),
                Err(mpsc::TryRecvError::Disconnected) => {}
            }
            self.comparing = None;
            self.compared = Instant::now();
        }
        let Some(finding) = self.finding.clone() else { return };
        // A picture of which parts have no sample yet cannot be compared.
        let ready = self.settled() && self.frames >= 4 && finding.samples >= 1.0;
        if !ready
            || self.compared.elapsed() < COMPARE && self.script.is_empty()
            || finding.number == self.compared_number
        {
            return;
        }
        let image = match self.graphics.as_ref().and_then(|g| g.stage.as_ref()).map(|s| s.image()) {
            Some(Ok(image)) => image,
            Some(Err(e)) => return self.fail(event_loop, e),
            None => return,
        };
        self.compared_number = finding.number;
        let display = ToneMap::new(self.changed_scene.working_space, self.state.exposure, self.state.curve);
        let (sender, receiver) = mpsc::channel();
        let wake = self.proxy.clone();
        std::thread::spawn(move || {
            // Nobody may listen any more.
            let _ = sender.send(difference(&image, &finding.image, &display));
            let _ = wake.send_event(Wake::Thread);
        });
        self.comparing = Some(receiver);
    }

    /// Reads a scene, beside the window's work.
    fn load(&mut self, file: &Path, asked: bool) {
        let (sender, receiver) = mpsc::channel();
        let (files, wake, path) = (self.files.clone(), self.proxy.clone(), file.to_path_buf());
        let changed = files.changed(file);
        std::thread::spawn(move || {
            // Nobody may listen any more.
            let _ = sender.send(files.load(&path));
            let _ = wake.send_event(Wake::Thread);
        });
        self.loading = Some(Loading { file: file.to_path_buf(), changed, asked, scene: receiver });
    }

    /// Takes a scene that has been read; looks whether the file has changed.
    fn watch(&mut self, event_loop: &ActiveEventLoop) {
        if let Some(loading) = &self.loading {
            let (path, asked, changed) = (loading.file.clone(), loading.asked, loading.changed);
            let loaded = match loading.scene.try_recv() {
                Err(mpsc::TryRecvError::Empty) => return,
                Ok(loaded) => loaded,
                Err(mpsc::TryRecvError::Disconnected) => {
                    Err(format!("{}: reading it failed: this is a fault of the program", path.display()))
                }
            };
            self.loading = None;
            // What could not be read is not read again before it changes; another file is no longer of interest then.
            if loaded.is_ok() || path == self.state.file {
                self.watched = changed;
            }
            match loaded {
                Ok(scene) => {
                    self.state.set_scene(scene, &path);
                    if let Some(graphics) = &self.graphics {
                        graphics.set_title(&path);
                    }
                }
                // A script goes on without what it did not ask for.
                Err(problem) if self.script.is_empty() || !asked => self.state.complain(problem),
                Err(problem) => self.fail(event_loop, ViewError::Scene(problem)),
            }
            if let Some(graphics) = &self.graphics {
                graphics.window.request_redraw();
            }
        } else if self.looked.elapsed() >= WATCH {
            self.looked = Instant::now();
            let changed = self.files.changed(&self.state.file);
            // Half written is not yet there, or changes once more.
            if changed.is_some() && changed != self.watched {
                let file = self.state.file.clone();
                self.load(&file, false);
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
                let open = |brush: &str| self.files.read_picture(&file.with_file_name(brush));
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

    /// The first column of a picture in which the other one of two is seen, as they are compared now.
    fn first_of_other(&self, width: usize) -> usize {
        use crate::action::Compare;
        match self.state.compare {
            Compare::Split => (self.state.split * width as f32).round() as usize,
            Compare::Reference => 0,
            Compare::RealTime | Compare::Flicker => width,
        }
    }

    /// The picture as light: the real-time one, the reference right of the line or where it alone is seen; the other as well.
    fn save(&mut self, file: &Path) -> Result<(), String> {
        if self.state.ink.on {
            return self.save_ink(file);
        }
        let stage = self.graphics.as_ref().and_then(|g| g.stage.as_ref()).ok_or("there is no picture yet")?;
        let linear = file
            .extension()
            .or(file.file_name())
            .is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case(".exr"));
        let image = stage.image().map_err(|e| e.to_string())?;
        let found = self
            .finding
            .as_ref()
            .map(|f| &*f.image)
            .filter(|f| (f.width, f.height) == (image.width, image.height));
        let image = match found {
            Some(reference) if linear => beside(image, reference, "reference"),
            Some(reference) => split(&image, reference, self.first_of_other(image.width)),
            None => image,
        };
        let picture = Picture {
            image,
            space: self.changed_scene.working_space,
            exposure: self.state.exposure,
            curve: self.state.curve,
        };
        self.written(file, picture)
    }

    fn written(&mut self, file: &Path, picture: Picture) -> Result<(), String> {
        let name = self.files.save(file, &self.state.file, picture)?;
        self.saved(&name);
        Ok(())
    }

    fn saved(&mut self, name: &Path) {
        let saved = self.state.language.of(SAVED);
        self.state.note(format!("{saved} {}", name.display()));
    }

    fn report(&self) -> Report {
        let selected = self.state.selected.and_then(|i| Some((i, self.state.materials.get(i)?)));
        Report {
            file: self.state.file.clone(),
            adapter: self.seen.adapter.clone(),
            surface: self.seen.surface.clone(),
            size: self.seen.size,
            frames: self.frames,
            milliseconds: self.frame_milliseconds,
            passes: self.seen.passes.clone(),
            samples: self.seen.samples,
            difference: self.seen.difference,
            selected: selected.map(|(i, m)| (i + 1, m.kind.name().to_string(), m.worn_by.clone())),
            moment: self.state.moment(),
            prepared: self.prepared,
            ink: self.ink_report(),
            message: self.state.message.as_ref().map_or(String::new(), |m| m.text.clone()),
        }
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

/// Whether both see the same, in whatever number of pixels.
fn same_eye(a: &Camera, b: &Camera) -> bool {
    a.to_world == b.to_world && a.near_far == b.near_far
}

fn same_view(a: &Camera, b: &Camera) -> bool {
    same_eye(a, b)
        && a.projection == b.projection
        && (a.film.width, a.film.height) == (b.film.width, b.film.height)
}

/// The picture with another as a layer of this name beside it.
fn beside(image: Image, other: &Image, name: &str) -> Image {
    let names: Vec<String> =
        image.channels.iter().cloned().chain(["R", "G", "B"].map(|c| format!("{name}.{c}"))).collect();
    let n = image.channels.len();
    let pixels = image.data.chunks_exact(n).zip(other.data.chunks_exact(3));
    let data = pixels.flat_map(|(a, b)| a.iter().chain(b).copied()).collect();
    Image { channels: names, data, ..image }
}

/// The picture, from column `from` on the reference.
fn split(image: &Image, reference: &Image, from: usize) -> Image {
    let mut out = Image::rgb(image.width, image.height);
    for y in 0..image.height {
        for x in 0..image.width {
            let source = if x < from { image } else { reference };
            out.pixel_mut(x, y).copy_from_slice(&source.pixel(x, y)[..3]);
        }
    }
    out
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
