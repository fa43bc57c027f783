//! What the window shows and how, without a window.

use crate::command::{Bounces, Command, Compare, Resolution};
use crate::edit::{Edits, MaterialItem, materials, models_of};
use crate::eye::{Eye, first_camera};
use crate::ink::{Ink, StrokeChange};
use crate::language::{Language, Words};
use crate::live::{ALONE, Live, LiveState};
use crate::mask::MaskChange;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use yugen_optics::tonemap::Curve;
use yugen_realtime::Lighting;
use yugen_reflectance::Kind;
use yugen_scene::{Camera, MaterialId, Scene, suggest};

/// What is asked of the window or of files.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Nothing more.
    None,
    /// The picture to this file.
    Save(PathBuf),
    /// The window to this file.
    Window(PathBuf),
    /// The scene of this file.
    Open(PathBuf),
    /// The way of painting of this file.
    Preset(PathBuf),
    /// What lies at this place of the picture, 0 to 1.
    Pick([f32; 2]),
    /// The whole screen or no more.
    FullScreen,
    /// What is seen, as a line.
    Report,
    /// Until the picture and the reference have so many frames and samples.
    Wait([u32; 2]),
    /// The end.
    Quit,
}

/// What was not asked of a state that comes of an action.
pub const NO_LIGHT: Words = [
    "nothing in the scene shines: a sun and a sky were added",
    "シーンに光源がないため、太陽と空を加えました",
];

/// All that the window remembers.
pub struct State {
    /// The scene as it was read.
    pub scene: Arc<Scene>,
    /// Its file.
    pub file: PathBuf,
    /// What was changed.
    pub edits: Edits,
    /// Its materials.
    pub materials: Vec<MaterialItem>,
    /// The one whose parameters are shown: an index of `materials`.
    pub selected: Option<usize>,
    /// Where it is seen from.
    pub eye: Eye,
    /// The camera of the scene that was last looked through.
    pub through: Option<usize>,
    /// Nobody has moved away from it: where an animation takes it, the eye goes too.
    pub follows: bool,
    /// Stops.
    pub exposure: f32,
    /// Display curve.
    pub curve: Curve,
    /// Pixels computed.
    pub resolution: Resolution,
    /// How far light is followed.
    pub bounces: Bounces,
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// As a painting, and how.
    pub ink: Ink,
    /// Whether the reference is on.
    pub reference: bool,
    /// How both are seen.
    pub compare: Compare,
    /// Where the line stands.
    pub split: f32,
    /// What is open.
    pub panel: bool,
    /// Frame times.
    pub graph: bool,
    /// The overlay.
    pub help: bool,
    /// What it speaks.
    pub language: Language,
    /// The last that went wrong or is worth knowing.
    pub message: Option<Message>,
    /// The scene's animations: names, and seconds of their first and last key.
    pub clips: Vec<(String, [f32; 2])>,
    /// Where the scene is in one of them; as its file has it where that is absent.
    pub time: Option<Time>,
    /// Cloth that is simulated.
    pub live: Option<LiveState>,
    /// Counts changes of what is seen: poses, materials, lights, how far light is followed.
    pub changes: u64,
    /// Counts scenes.
    pub scenes: u64,
}

/// A moment of an animation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Time {
    /// Which: an index of [`State::clips`].
    pub clip: usize,
    /// Since its zero.
    pub seconds: f32,
    /// It goes on.
    pub playing: bool,
}

/// A sentence at the foot of the window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// What it says.
    pub text: String,
    /// Whether something went wrong.
    pub wrong: bool,
}

impl State {
    /// Of a scene read from `file`.
    pub fn new(scene: Scene, file: &Path, language: Language) -> Self {
        let eye = Eye::new(first_camera(&scene), scene.bounds());
        let mut state = Self {
            edits: Edits::default(),
            materials: Vec::new(),
            selected: None,
            through: None,
            follows: true,
            scene: Arc::default(),
            file: file.to_path_buf(),
            eye,
            exposure: 0.0,
            curve: Curve::default(),
            resolution: Resolution::default(),
            bounces: Bounces::default(),
            lighting: Lighting::default(),
            ink: Ink::default(),
            reference: false,
            compare: Compare::default(),
            split: 0.5,
            panel: true,
            graph: false,
            help: false,
            language,
            message: None,
            clips: Vec::new(),
            time: None,
            live: None,
            changes: 0,
            scenes: 0,
        };
        state.set_scene(scene, file);
        state
    }

    /// Another scene, or the same anew: in the latter case it is seen from where it was, and changes of materials and lights
    /// that still fit stay.
    pub fn set_scene(&mut self, mut scene: Scene, file: &Path) {
        let again = self.scenes > 0 && file == self.file;
        self.message = None;
        if scene.cameras.is_empty() {
            scene.cameras.push(first_camera(&scene));
        }
        if !scene.has_light() {
            scene.add_default_light();
            self.message = Some(Message { text: self.language.of(NO_LIGHT).into(), wrong: false });
        }
        let mut edits = Edits::none(&scene);
        let materials = materials(&scene);
        if again {
            for light in &mut edits.lights {
                if let Some(old) =
                    self.edits.lights.iter().find(|l| l.name == light.name && l.kind == light.kind)
                {
                    (light.on, light.stops) = (old.on, old.stops);
                }
            }
            let own = |o: &MaterialItem| self.edits.models.get(&o.id).map_or(o.kind, |swapped| swapped.own);
            let same = |m: &MaterialItem| {
                self.materials.iter().any(|o| o.id == m.id && own(o) == m.kind && o.worn_by == m.worn_by)
            };
            let kept: Vec<MaterialId> = materials.iter().filter(|m| same(m)).map(|m| m.id).collect();
            self.selected = self.selected.filter(|s| materials.get(*s).is_some_and(same));
            edits.models = std::mem::take(&mut self.edits.models);
            edits.models.retain(|id, _| kept.contains(id));
            edits.parameters = std::mem::take(&mut self.edits.parameters);
            edits.parameters.retain(|(id, _), _| kept.contains(id));
            self.through = self.through.filter(|c| *c < scene.cameras.len());
        } else {
            self.eye = Eye::new(first_camera(&scene), scene.bounds());
            (self.exposure, self.curve) = (scene.display.exposure, scene.display.curve);
            (self.through, self.follows) = (Some(0), true);
            self.selected = None;
            self.ink.forget_scene();
        }
        self.materials = edits.materials(&scene);
        self.edits = edits;
        let clips = std::mem::replace(&mut self.clips, scene.clips());
        // The same animation, wherever it now stands.
        self.time = self.time.filter(|_| again).and_then(|t| {
            let clip = self.clips.iter().position(|(name, _)| *name == clips[t.clip].0)?;
            Some(Time { clip, ..t })
        });
        self.live = None;
        self.scene = Arc::new(scene);
        self.file = file.to_path_buf();
        self.scenes += 1;
        self.changes += 1;
    }

    /// Cloth of the scene that is simulated: time is that of its animation, and begins where that does.
    pub fn set_live(&mut self, cloth: Option<Box<dyn Live>>) {
        let Some(cloth) = cloth else { return };
        let clip = cloth.clip();
        self.clips.retain(|(name, _)| clip.as_ref().is_none_or(|clip| clip == name));
        for (_, [first, last]) in &mut self.clips {
            // Nothing else moves, or for ever.
            if last <= first || clip.is_none() {
                *last = *first + ALONE;
            }
        }
        self.live = Some(LiveState::new(cloth));
        self.time =
            self.clips.first().map(|(_, [first, _])| Time { clip: 0, seconds: *first, playing: false });
        self.changes += 1;
    }

    /// Simulated cloth, to be changed.
    fn live_mut(&mut self) -> Result<&mut LiveState, String> {
        self.live.as_mut().ok_or_else(|| {
            "no cloth is simulated here: open the scene with --cloth NAME or --garment CUT".to_string()
        })
    }

    /// Notes what went wrong.
    pub fn complain(&mut self, text: impl Into<String>) {
        self.message = Some(Message { text: text.into(), wrong: true });
    }

    /// Notes what is worth knowing.
    pub fn note(&mut self, text: impl Into<String>) {
        self.message = Some(Message { text: text.into(), wrong: false });
    }

    /// Surfaces that may reflect light on its way, as [`yugen_realtime::Options`] has it.
    pub fn most_bounces(&self) -> u32 {
        match self.bounces {
            Bounces::Most(n) => n,
            _ => self.scene.integrator.most_bounces(),
        }
    }

    /// The material of this number, counted from one, or that a shape of this name wears.
    pub fn material(&self, which: &str) -> Result<usize, String> {
        let worn = self.materials.iter().position(|m| m.worn_by.iter().any(|n| n == which));
        let number =
            || which.parse().ok().and_then(|n: usize| n.checked_sub(1)).filter(|n| *n < self.materials.len());
        worn.or_else(number).ok_or_else(|| {
            let names = self.materials.iter().flat_map(|m| &m.worn_by).map(String::as_str);
            format!("no shape '{which}' wears a material with parameters{}", suggest(which, names))
        })
    }

    /// What a shape at `draw`'s material is selected as.
    pub fn select_material(&mut self, id: MaterialId) {
        let models = models_of(&self.scene, id);
        self.selected = models.first().and_then(|id| self.materials.iter().position(|m| m.id == *id));
    }

    /// Does it; what is left for the window to do.
    pub fn apply(&mut self, command: &Command) -> Result<Effect, String> {
        if matches!(
            command,
            Command::Orbit(_)
                | Command::Look(_)
                | Command::Pan(_)
                | Command::Dolly(_)
                | Command::Walk(_)
                | Command::Frame
        ) {
            self.follows = false;
        }
        match command {
            Command::Orbit([right, up]) => self.eye.orbit(*right, *up),
            Command::Look([right, up]) => self.eye.look(*right, *up),
            Command::Pan([right, up]) => self.eye.pan(*right, *up),
            Command::Dolly(factor) => self.eye.dolly(*factor),
            Command::Walk([forward, right, up]) => self.eye.walk(*forward, *right, *up),
            Command::Frame => self.eye.frame(&self.scene),
            Command::Camera(name) => self.look_through(name.as_deref())?,
            Command::Exposure(stops) => self.exposure = stops.clamp(-60.0, 60.0),
            Command::Brighter(stops) => self.exposure = (self.exposure + stops).clamp(-60.0, 60.0),
            Command::Curve(curve) => self.curve = curve.unwrap_or_else(|| next(Curve::ALL, self.curve)),
            Command::Resolution(r) => {
                self.resolution = r.unwrap_or_else(|| next(Resolution::ALL.map(|(r, _)| r), self.resolution));
            }
            Command::Lighting(lighting) => {
                let other = if self.lighting == Lighting::Full { Lighting::Paper } else { Lighting::Full };
                self.lighting = lighting.unwrap_or(other);
                self.changes += 1;
            }
            Command::Bounces(bounces) => {
                self.bounces = match bounces {
                    Bounces::Next if self.bounces == Bounces::All => Bounces::Most(1),
                    Bounces::Next => Bounces::All,
                    other => *other,
                };
                self.changes += 1;
            }
            Command::Light(which, change) => {
                let light = self.edits.light(which)?;
                self.edits.change_light(light, *change);
                self.changes += 1;
            }
            Command::Material(which, parameter, values) => {
                let item = &self.materials[self.material(which)?];
                self.edits.set(item, parameter, values)?;
                self.changes += 1;
            }
            Command::Model(which, model) => {
                let item = &self.materials[self.material(which)?];
                let models = || Edits::models(&self.scene, item.id);
                let kind = models().find(|k| k.name() == model).ok_or_else(|| {
                    let hint = suggest(model, models().map(Kind::name));
                    format!("there is no model '{model}' that needs no measured file{hint}")
                })?;
                self.edits.change_model(&self.scene, item, kind)?;
                self.materials = self.edits.materials(&self.scene);
                self.changes += 1;
            }
            Command::Select(which) => {
                // What closes a list closes the one on top.
                if which.is_none() && self.help {
                    self.help = false;
                } else if which.is_none() && self.ink.on && self.ink.masks.mask.is_some() {
                    self.ink.masks.put_down();
                } else if which.is_none()
                    && self.ink.on
                    && (self.ink.stroke.is_some() || self.ink.subject.is_some())
                {
                    (self.ink.stroke, self.ink.subject) = (None, None);
                } else {
                    self.selected = which.as_ref().map(|w| self.material(w)).transpose()?;
                }
            }
            Command::Pick(place) => return Ok(Effect::Pick(*place)),
            Command::Restore => {
                self.edits = Edits::none(&self.scene);
                self.materials = self.edits.materials(&self.scene);
                self.changes += 1;
            }
            Command::Play(on) => {
                let time = self.time_mut()?;
                time.playing = on.unwrap_or(!time.playing);
                self.changes += 1;
            }
            Command::Clip(name) => {
                let now = self.time_mut()?.clip;
                let clip = match name {
                    None => (now + 1) % self.clips.len(),
                    Some(name) => self.clips.iter().position(|(n, _)| n == name).ok_or_else(|| {
                        let names = self.clips.iter().map(|(n, _)| n.as_str());
                        format!("there is no animation called '{name}'{}", suggest(name, names))
                    })?,
                };
                let seconds = self.clips[clip].1[0];
                let time = self.time_mut()?;
                (time.clip, time.seconds) = (clip, seconds);
                self.changes += 1;
            }
            Command::Seconds(seconds) => {
                self.time_mut()?.seconds = *seconds;
                self.changes += 1;
            }
            Command::Step(seconds) => {
                let time = self.time_mut()?;
                time.playing = false;
                self.go_on(*seconds);
            }
            Command::Wind(wind) => {
                let live = self.live_mut()?;
                if wind.is_nan() || wind.length() > live.most_wind {
                    return Err(format!("wind is at most {} m/s", live.most_wind));
                }
                live.settings.wind = *wind;
                self.changes += 1;
            }
            Command::Fabric(name) => {
                let live = self.live_mut()?;
                if !live.fabrics.contains(&name.as_str()) {
                    let hint = suggest(name, live.fabrics.iter().copied());
                    return Err(format!("there is no fabric '{name}'{hint}"));
                }
                live.settings.fabric.clone_from(name);
                self.changes += 1;
            }
            Command::Reference(on) => {
                self.reference = on.unwrap_or(!self.reference);
                self.ink.on &= !self.reference;
            }
            Command::Compare(how) => {
                self.compare = how.unwrap_or_else(|| next(Compare::ALL.map(|(c, _)| c), self.compare));
                match self.ink.on {
                    true => self.ink.compare(true),
                    false => self.reference = true,
                }
            }
            Command::Split(part) => self.split = part.clamp(0.0, 1.0),
            Command::Slide(part) => self.split = (self.split + part).clamp(0.0, 1.0),
            Command::Ink(on) => self.paint(on.unwrap_or(!self.ink.on)),
            Command::Preset(Some(file)) if yugen_ink::preset::is_file(file) => {
                return Ok(Effect::Preset(file.into()));
            }
            Command::Preset(name) => {
                self.ink.choose(name.as_deref())?;
                self.paint(true);
            }
            Command::Set(name, word) => {
                self.ink.set(name, word)?;
                self.paint(true);
            }
            // Keys must not change what is not seen.
            Command::Stroke(change) if !self.ink.on && !matches!(change, StrokeChange::Choose(_)) => {
                return Err("no painting is seen whose stroke could be changed: `ink` first".into());
            }
            Command::Stroke(change) => {
                self.ink.change_stroke(change)?;
                self.paint(true);
            }
            Command::Steer(subject, name, change) => {
                self.ink.steer(*subject, name, change)?;
                self.paint(true);
            }
            Command::Mask(change)
                if !self.ink.on
                    && !matches!(change, MaskChange::Paint(..) | MaskChange::New | MaskChange::Next) =>
            {
                return Err("no painting is seen whose masks could be changed: `ink` first".into());
            }
            Command::Mask(change) => {
                self.ink.change_mask(change)?;
                self.paint(true);
            }
            Command::Literal(on) => {
                let on = on.unwrap_or(!(self.ink.on && self.ink.literal));
                self.ink.compare(on);
                self.paint(self.ink.on || on);
            }
            Command::Save(file) => return Ok(Effect::Save(file.into())),
            Command::Window(file) => return Ok(Effect::Window(file.into())),
            Command::Open(file) => return Ok(Effect::Open(file.into())),
            Command::Reload => return Ok(Effect::Open(self.file.clone())),
            Command::Panel(on) => self.panel = on.unwrap_or(!self.panel),
            Command::Graph(on) => self.graph = on.unwrap_or(!self.graph),
            Command::Help(on) => self.help = on.unwrap_or(!self.help),
            Command::Language(language) => self.language = language.unwrap_or_else(|| self.language.next()),
            Command::FullScreen => return Ok(Effect::FullScreen),
            // Whoever follows the script has waited.
            Command::Pause(_) => {}
            Command::Wait(counts) => return Ok(Effect::Wait(*counts)),
            Command::Report => return Ok(Effect::Report),
            Command::Quit => return Ok(Effect::Quit),
        }
        Ok(Effect::None)
    }

    /// As a painting or not; a painting is not compared with the reference.
    pub fn paint(&mut self, on: bool) {
        self.ink.on = on;
        self.reference &= !on;
    }

    fn time_mut(&mut self) -> Result<&mut Time, String> {
        let Some((_, [first, _])) = self.clips.first() else {
            return Err("nothing in the scene moves: it has no animation".into());
        };
        Ok(self.time.get_or_insert(Time { clip: 0, seconds: *first, playing: false }))
    }

    /// Lets the animation go on by so many seconds; after its end it begins again.
    pub fn go_on(&mut self, seconds: f32) {
        let Some(time) = &mut self.time else { return };
        let Some((_, [first, last])) = self.clips.get(time.clip) else { return };
        let length = last - first;
        time.seconds = match length > 0.0 {
            true => first + (time.seconds + seconds - first).rem_euclid(length),
            false => *first,
        };
        self.changes += 1;
    }

    /// Whether the animation goes on by itself.
    pub fn playing(&self) -> bool {
        self.time.is_some_and(|t| t.playing)
    }

    /// The animation and the seconds into it that the scene is to have.
    pub fn moment(&self) -> Option<(String, f32)> {
        let rate = self.live.as_ref().map(|l| l.rate);
        let frame = |s: f32| rate.map_or(s, |rate| ((f64::from(s) * rate).round() / rate) as f32);
        self.time.and_then(|t| Some((self.clips.get(t.clip)?.0.clone(), frame(t.seconds))))
    }

    fn look_through(&mut self, name: Option<&str>) -> Result<(), String> {
        let cameras = &self.scene.cameras;
        let index = match name {
            None => self.through.map_or(0, |c| (c + 1) % cameras.len().max(1)),
            Some(name) => {
                let number =
                    || name.parse().ok().and_then(|n: usize| n.checked_sub(1)).filter(|n| *n < cameras.len());
                cameras.iter().position(|c| c.name == name).or_else(number).ok_or_else(|| {
                    format!(
                        "there is no camera '{name}'{}",
                        suggest(name, cameras.iter().map(|c| c.name.as_str()))
                    )
                })?
            }
        };
        let Some(camera) = cameras.get(index).cloned() else { return Ok(()) };
        self.stand_at(camera);
        (self.through, self.follows) = (Some(index), true);
        Ok(())
    }

    fn stand_at(&mut self, camera: Camera) {
        let size = &self.eye.camera().film;
        let size = [size.width, size.height];
        self.eye = Eye::new(camera, self.scene.bounds());
        self.eye.resize(size);
    }

    /// Goes where an animation has taken the camera in `posed`, if it is still looked through.
    pub fn follow(&mut self, posed: &Scene) {
        let camera = self.through.filter(|_| self.follows).and_then(|c| posed.cameras.get(c));
        if let Some(camera) = camera.filter(|c| c.to_world != self.eye.camera().to_world) {
            self.stand_at(camera.clone());
        }
    }
}

/// What follows in a list, and after the last the first.
fn next<T: PartialEq + Copy, const N: usize>(all: [T; N], now: T) -> T {
    let at = all.iter().position(|x| *x == now).unwrap_or_default();
    all[(at + 1) % N]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::script;
    use glam::Mat4;
    use yugen_scene::{Geometry, Material, Shape, Value};

    fn scene() -> Scene {
        Scene {
            materials: vec![Material::lambert(Value::Number(0.5))],
            shapes: vec![Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)],
            ..Scene::default()
        }
    }

    fn run(state: &mut State, text: &str) -> Vec<Result<Effect, String>> {
        script(text).expect("a script").iter().map(|s| state.apply(&s.command)).collect()
    }

    #[test]
    fn a_script_drives_everything() {
        let mut state = State::new(scene(), Path::new("a/ball.toml"), Language::English);
        assert_eq!(state.message.as_ref().map(|m| m.wrong), Some(false), "it says that there was no light");
        assert_eq!(state.edits.lights.len(), 2);
        let before = (state.changes, state.eye.position());
        let done = run(
            &mut state,
            "orbit 30 10; exposure 1; brighter .5; curve aces; light sun off; light sky -2; material ball reflectance .1 .2 .3;
             select ball; bounces next; resolution half; compare flicker; split 2; panel off; help; language ja",
        );
        assert!(done.iter().all(|d| *d == Ok(Effect::None)), "{done:?}");
        assert!(state.eye.position() != before.1 && state.changes == before.0 + 4);
        assert_eq!((state.exposure, state.curve, state.selected), (1.5, Curve::Aces, Some(0)));
        assert_eq!((state.most_bounces(), state.resolution), (1, Resolution::Half));
        assert!(state.reference && state.compare == Compare::Flicker && state.split == 1.0);
        assert!(!state.panel && state.help && state.language == Language::Japanese);
        let lit = state.edits.apply(&state.scene).expect("it can be");
        assert!(!lit.lights.is_empty());
        for (wrong, said) in [
            ("light moon off", "no light 'moon'"),
            ("material bal reflectance 1", "did you mean 'ball'?"),
            ("material ball reflectance 3", "0 to 1"),
            ("camera x", "no camera 'x'"),
        ] {
            let error = run(&mut state, wrong).remove(0).expect_err(wrong);
            assert!(error.contains(said), "{wrong}: {error}");
        }
        run(&mut state, "restore; select none; select none");
        assert!(state.edits.is_empty() && state.selected.is_none() && !state.help);
        assert_eq!(
            run(&mut state, "quit; reload"),
            [Ok(Effect::Quit), Ok(Effect::Open("a/ball.toml".into()))]
        );
        assert_eq!(run(&mut state, "save x.exr"), [Ok(Effect::Save("x.exr".into()))]);
    }

    #[test]
    fn a_painting_and_the_reference_take_turns() {
        let mut state = State::new(scene(), Path::new("ball.toml"), Language::English);
        let all = "reference; preset dry; set size 2; stroke 0f3a9c12; stroke hide; preset a b.toml";
        let mut done = run(&mut state, all);
        assert_eq!(done.pop(), Some(Ok(Effect::Preset("a b.toml".into()))));
        assert!(done.iter().all(|d| *d == Ok(Effect::None)), "{done:?}");
        assert!(state.ink.on && !state.reference && state.ink.style.controls.size == 2.0);
        // Escape lets go of one thing after the other.
        run(&mut state, "select ball; help; select none");
        assert!(!state.help && state.ink.stroke.is_some());
        run(&mut state, "select none");
        assert!(state.ink.stroke.is_none() && state.selected.is_some());
        for (script, painted, reference) in [
            ("compare next", true, false),
            ("reference on", false, true),
            ("compare next", false, true),
            ("ink", true, false),
            ("reference on", false, true),
            ("ink on", true, false),
        ] {
            run(&mut state, script);
            assert_eq!((state.ink.on, state.reference), (painted, reference), "{script}");
        }
        // Of a painting it is the slides' method that stands beside it.
        assert!(state.ink.literal);
        run(&mut state, "literal");
        assert!(state.ink.on && !state.ink.literal);
        run(&mut state, "ink off; literal");
        assert!(state.ink.on && state.ink.literal);
        // A mask as well, and Escape puts its brush down.
        run(&mut state, "mask corner; draw 0.5 0.5; select none");
        assert!(state.ink.style.steering.masks.len() == 1 && state.ink.mask().is_none());
        run(&mut state, "mask corner; mask remove; ink off");
        let error = run(&mut state, "brush erase").remove(0).expect_err("nothing is painted");
        assert!(error.contains("`ink` first"), "{error}");
        run(&mut state, "ink");
        let error = run(&mut state, "stroke hide").remove(0).expect_err("no stroke is selected");
        assert!(error.contains("click on a contour"), "{error}");
        // The same file anew keeps strokes, another does not.
        assert_eq!(state.ink.style.steering.strokes.len(), 1);
        state.set_scene(scene(), Path::new("ball.toml"));
        assert_eq!(state.ink.style.steering.strokes.len(), 1);
        state.set_scene(scene(), Path::new("other.toml"));
        assert!(state.ink.style.steering.strokes.is_empty() && state.ink.on);
    }

    #[test]
    fn a_file_that_is_read_anew_keeps_place_and_changes() {
        let mut state = State::new(scene(), Path::new("ball.toml"), Language::English);
        run(&mut state, "orbit 30 10; light sun off; material ball reflectance .1; select ball");
        let at = state.eye.position();
        let mut more = scene();
        more.shapes.push(Shape::new("other", Geometry::Disc, Mat4::IDENTITY, 0));
        more.shapes[1].name = String::new();
        state.set_scene(more, Path::new("ball.toml"));
        assert!(state.eye.position() == at && !state.edits.lights[0].on && state.selected == Some(0));
        assert_eq!(state.edits.parameters.len(), 1);
        // The material is another one now.
        let mut other = scene();
        other.shapes[0].name = "cube".into();
        state.set_scene(other, Path::new("ball.toml"));
        assert!(state.edits.parameters.is_empty() && state.selected.is_none());
        state.set_scene(scene(), Path::new("other.toml"));
        assert!(state.eye.position() != at && state.edits.lights[0].on);
    }

    #[test]
    fn every_camera_is_looked_through_in_turn() {
        let mut scene = scene();
        let camera = first_camera(&scene);
        scene.cameras = ["a", "b"].map(|n| Camera { name: n.into(), ..camera.clone() }).to_vec();
        scene.cameras[1].to_world.w_axis.x += 5.0;
        let mut state = State::new(scene, Path::new("x.toml"), Language::English);
        let first = state.eye.position();
        run(&mut state, "orbit 10 0; camera next");
        assert!((state.eye.position().x - first.x - 5.0).abs() < 1e-4 && state.through == Some(1));
        run(&mut state, "camera next");
        assert!(state.eye.position() == first && state.through == Some(0));
        // An animation takes it along until somebody moves.
        let mut posed = Scene::clone(&state.scene);
        posed.cameras[0].to_world.w_axis.y += 1.0;
        state.follow(&posed);
        assert!((state.eye.position().y - first.y - 1.0).abs() < 1e-5);
        run(&mut state, "pan .1 0");
        let here = state.eye.position();
        state.follow(&Scene::clone(&state.scene));
        assert_eq!(state.eye.position(), here);
    }

    #[test]
    fn animations_go_on_again_and_again() {
        let mut state = State::new(scene(), Path::new("a/ball.toml"), Language::English);
        let still = run(&mut state, "play; seconds 1; clip next");
        assert!(still.iter().all(|d| d.as_ref().is_err_and(|e| e.contains("nothing in the scene moves"))));
        state.clips = vec![("walk".into(), [0.5, 2.0]), ("run".into(), [0.0, 1.0])];
        assert!(state.moment().is_none(), "as the file has it");
        let changes = state.changes;
        assert!(run(&mut state, "play").iter().all(Result::is_ok));
        assert!(state.playing() && state.changes > changes);
        assert_eq!(state.moment(), Some(("walk".into(), 0.5)));
        state.go_on(1.75);
        assert_eq!(state.moment(), Some(("walk".into(), 0.75)));
        assert!(run(&mut state, "clip next; seconds .25; step -.5").iter().all(Result::is_ok));
        assert!(!state.playing(), "whoever steps wants to look");
        assert_eq!(state.moment(), Some(("run".into(), 0.75)));
        assert!(run(&mut state, "clip wlak")[0].as_ref().is_err_and(|e| e.contains("did you mean 'walk'?")));
        // Another scene begins as its file has it.
        state.set_scene(scene(), Path::new("a/other.toml"));
        assert!(state.moment().is_none() && state.clips.is_empty());
    }
}
