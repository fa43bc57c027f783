//! Everything that can be done in the window, in one table: keys, menus, the overlay, scripts and the manual read it.

use crate::command::{Bounces, Command, Compare, LightChange, Resolution};
use crate::ink::{StrokeChange, Subject, TableChange};
use crate::language::{Language, Words};
use crate::mask::{MaskChange, MaskWay};
use egui::{Key, Modifiers};
use yugen_ink::control::CONTROLS;
use yugen_ink::mask::Ground;
use yugen_optics::tonemap::Curve;
use yugen_realtime::Lighting;
use yugen_scene::suggest;

/// What actions are about, in the order of the overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Where it is seen from.
    Camera,
    /// How it is shown.
    Picture,
    /// What it is lit by and made of.
    Scene,
    /// How it moves.
    Time,
    /// Beside the reference.
    Reference,
    /// As an ink painting.
    Ink,
    /// Files and the window.
    Window,
}

impl Group {
    /// All of them with their titles.
    pub const ALL: [(Self, Words); 7] = [
        (Self::Camera, ["Camera", "カメラ"]),
        (Self::Picture, ["Picture", "画像"]),
        (Self::Scene, ["Lights and materials", "光源と材質"]),
        (Self::Time, ["Animation", "アニメーション"]),
        (Self::Reference, ["Reference", "参照画像"]),
        (Self::Ink, ["Ink", "水墨"]),
        (Self::Window, ["Files and window", "ファイルと画面"]),
    ];
}

/// A key that does an action with these words.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// The key.
    pub key: Key,
    /// With Shift held.
    pub shift: bool,
    /// With Ctrl (⌘) held.
    pub ctrl: bool,
    /// What follows the name of the action.
    pub words: &'static str,
}

impl Binding {
    /// As people write it.
    pub fn shown(&self) -> String {
        let (ctrl, shift) = (if self.ctrl { "Ctrl+" } else { "" }, if self.shift { "Shift+" } else { "" });
        let key = match self.key {
            Key::ArrowLeft => "←",
            Key::ArrowRight => "→",
            Key::ArrowUp => "↑",
            Key::ArrowDown => "↓",
            key => key.symbol_or_name(),
        };
        format!("{ctrl}{shift}{key}")
    }

    /// Whether these modifiers are its own. Signs that are typed with Shift on some keyboards come as themselves.
    pub fn has(&self, modifiers: Modifiers) -> bool {
        let sign = !self.key.name().chars().all(|c| c.is_ascii_alphanumeric())
            || matches!(self.key, Key::Questionmark | Key::Plus | Key::Minus | Key::Equals);
        modifiers.command == self.ctrl && !modifiers.alt && (modifiers.shift == self.shift || sign)
    }
}

/// An action.
pub struct Action {
    /// In scripts.
    pub name: &'static str,
    /// What follows the name there.
    pub usage: &'static str,
    /// What it is about.
    pub group: Group,
    /// Its keys.
    pub keys: &'static [Binding],
    /// A key that is held goes on doing it, ten times a second's worth.
    pub held: bool,
    /// What it does.
    pub does: Words,
    parse: fn(&[&str]) -> Option<Command>,
}

impl Action {
    /// The command that these words make of it.
    pub fn command(&self, words: &[&str]) -> Result<Command, String> {
        (self.parse)(words)
            .ok_or_else(|| format!("expected `{}`", [self.name, self.usage].join(" ").trim_end()))
    }

    /// The action called `name`.
    pub fn named(name: &str) -> Option<&'static Self> {
        ACTIONS.iter().find(|a| a.name == name)
    }
}

const fn key(key: Key, words: &'static str) -> Binding {
    Binding { key, shift: false, ctrl: false, words }
}

const fn shift(key: Key, words: &'static str) -> Binding {
    Binding { key, shift: true, ctrl: false, words }
}

const fn ctrl(key: Key, words: &'static str) -> Binding {
    Binding { key, shift: false, ctrl: true, words }
}

/// Every action.
pub const ACTIONS: &[Action] = &[
    Action {
        name: "orbit",
        usage: "RIGHT UP",
        group: Group::Camera,
        keys: &[
            key(Key::ArrowLeft, "-4 0"),
            key(Key::ArrowRight, "4 0"),
            key(Key::ArrowUp, "0 4"),
            key(Key::ArrowDown, "0 -4"),
        ],
        held: true,
        does: ["go round what is looked at, degrees (drag)", "注視点のまわりを回る、度（ドラッグ）"],
        parse: |w| numbers(w).map(Command::Orbit),
    },
    Action {
        name: "look",
        usage: "RIGHT UP",
        group: Group::Camera,
        keys: &[
            shift(Key::ArrowLeft, "-3 0"),
            shift(Key::ArrowRight, "3 0"),
            shift(Key::ArrowUp, "0 3"),
            shift(Key::ArrowDown, "0 -3"),
        ],
        held: true,
        does: ["turn on the spot, degrees (Ctrl+drag)", "その場で向きを変える、度（Ctrl＋ドラッグ）"],
        parse: |w| numbers(w).map(Command::Look),
    },
    Action {
        name: "pan",
        usage: "RIGHT UP",
        group: Group::Camera,
        keys: &[
            ctrl(Key::ArrowLeft, "-0.05 0"),
            ctrl(Key::ArrowRight, "0.05 0"),
            ctrl(Key::ArrowUp, "0 0.05"),
            ctrl(Key::ArrowDown, "0 -0.05"),
        ],
        held: true,
        does: [
            "move sideways, picture widths (right drag, Shift+drag)",
            "平行に動く、画像の幅を単位に（右ドラッグ、Shift＋ドラッグ）",
        ],
        parse: |w| numbers(w).map(Command::Pan),
    },
    Action {
        name: "dolly",
        usage: "FACTOR",
        group: Group::Camera,
        keys: &[key(Key::Plus, "0.9"), key(Key::Equals, "0.9"), key(Key::Minus, "1.1")],
        held: true,
        does: [
            "come nearer or go away: distance times FACTOR (wheel)",
            "近づく、遠ざかる：距離の倍率（ホイール）",
        ],
        parse: |w| numbers(w).map(|[f]: [f32; 1]| f).filter(|f| *f > 0.0).map(Command::Dolly),
    },
    Action {
        name: "walk",
        usage: "FORWARD RIGHT UP",
        group: Group::Camera,
        keys: &[
            key(Key::W, "0.05 0 0"),
            key(Key::S, "-0.05 0 0"),
            key(Key::A, "0 -0.05 0"),
            key(Key::D, "0 0.05 0"),
            key(Key::E, "0 0 0.05"),
            key(Key::Q, "0 0 -0.05"),
        ],
        held: true,
        does: ["walk, in radii of the scene", "歩く、シーンの半径を単位に"],
        parse: |w| numbers(w).map(Command::Walk),
    },
    Action {
        name: "frame",
        usage: "",
        group: Group::Camera,
        keys: &[key(Key::F, "")],
        held: false,
        does: ["everything into the picture", "全体を画面に収める"],
        parse: |w| w.is_empty().then_some(Command::Frame),
    },
    Action {
        name: "camera",
        usage: "NAME|next",
        group: Group::Camera,
        keys: &[key(Key::C, "next")],
        held: false,
        does: ["look through a camera of the scene", "シーンのカメラから見る"],
        parse: |w| (!w.is_empty()).then(|| Command::Camera(not_next(&w.join(" ")))),
    },
    Action {
        name: "exposure",
        usage: "STOPS",
        group: Group::Picture,
        keys: &[key(Key::Num0, "0")],
        held: false,
        does: ["exposure, stops", "露出、段"],
        parse: |w| numbers(w).map(|[s]: [f32; 1]| Command::Exposure(s)),
    },
    Action {
        name: "brighter",
        usage: "STOPS",
        group: Group::Picture,
        keys: &[key(Key::OpenBracket, "-0.25"), key(Key::CloseBracket, "0.25")],
        held: false,
        does: ["darker or brighter by so many stops", "露出を変える"],
        parse: |w| numbers(w).map(|[s]: [f32; 1]| Command::Brighter(s)),
    },
    Action {
        name: "curve",
        usage: "clip|reinhard|aces|agx|next",
        group: Group::Picture,
        keys: &[key(Key::V, "next")],
        held: false,
        does: ["display curve, as in yugen render", "表示カーブ（yugen render と同じ）"],
        parse: |w| match w {
            ["next"] => Some(Command::Curve(None)),
            [name] => Curve::from_name(name).map(|c| Command::Curve(Some(c))),
            _ => None,
        },
    },
    Action {
        name: "resolution",
        usage: "auto|full|half|quarter|next",
        group: Group::Picture,
        keys: &[key(Key::R, "next")],
        held: false,
        does: [
            "pixels computed for those seen; auto: fewer while something moves",
            "計算する画素数（auto：動く間は減らす）",
        ],
        parse: |w| one_of(w, &Resolution::ALL).map(Command::Resolution),
    },
    Action {
        name: "bounces",
        usage: "N|all|next",
        group: Group::Picture,
        keys: &[key(Key::B, "next")],
        held: false,
        does: [
            "surfaces that reflect light on its way: direct light (1) or all",
            "光の反射回数：直接光（1）か全部",
        ],
        parse: |w| match w {
            ["next"] => Some(Command::Bounces(Bounces::Next)),
            ["all"] => Some(Command::Bounces(Bounces::All)),
            [n] => n.parse().ok().map(|n| Command::Bounces(Bounces::Most(n))),
            _ => None,
        },
    },
    Action {
        name: "lighting",
        usage: "full|paper|next",
        group: Group::Picture,
        keys: &[key(Key::M, "next")],
        held: false,
        does: [
            "light as in the reference, or by the equations of Wakita et al.",
            "照明：リファレンスと同じ、または脇田らの論文の式",
        ],
        parse: |w| match w {
            ["full"] => Some(Command::Lighting(Some(Lighting::Full))),
            ["paper"] => Some(Command::Lighting(Some(Lighting::Paper))),
            ["next"] => Some(Command::Lighting(None)),
            _ => None,
        },
    },
    Action {
        name: "light",
        usage: "NAME|N on|off|toggle|STOPS",
        group: Group::Scene,
        keys: &[
            key(Key::Num1, "1 toggle"),
            key(Key::Num2, "2 toggle"),
            key(Key::Num3, "3 toggle"),
            key(Key::Num4, "4 toggle"),
            key(Key::Num5, "5 toggle"),
            key(Key::Num6, "6 toggle"),
            key(Key::Num7, "7 toggle"),
            key(Key::Num8, "8 toggle"),
            key(Key::Num9, "9 toggle"),
        ],
        held: false,
        does: ["a light on, off, or brighter by so many stops", "光源を点ける、消す、明るさを変える"],
        parse: |w| {
            let (change, name) = w.split_last().filter(|(_, name)| !name.is_empty())?;
            let change = match *change {
                "on" => LightChange::Switch(Some(true)),
                "off" => LightChange::Switch(Some(false)),
                "toggle" => LightChange::Switch(None),
                stops => LightChange::Stops(number(stops)?),
            };
            Some(Command::Light(name.join(" "), change))
        },
    },
    Action {
        name: "material",
        usage: "SHAPE|N PARAMETER VALUE…",
        group: Group::Scene,
        keys: &[],
        held: false,
        does: [
            "a parameter of a material: a number, three for a colour, or a name",
            "材質のパラメータ：数値、色は三つの数値、または名前",
        ],
        parse: |w| match w {
            [which, parameter, values @ ..] if (1..=3).contains(&values.len()) => Some(Command::Material(
                which.to_string(),
                parameter.to_string(),
                values.iter().map(|v| v.to_string()).collect(),
            )),
            _ => None,
        },
    },
    Action {
        name: "model",
        usage: "SHAPE|N MODEL",
        group: Group::Scene,
        keys: &[],
        held: false,
        does: [
            "the reflectance model of a material; what both models have is kept",
            "材質の反射モデルを変える：共通のパラメータは保つ",
        ],
        parse: |w| {
            let (model, which) = w.split_last().filter(|(_, which)| !which.is_empty())?;
            Some(Command::Model(which.join(" "), model.to_string()))
        },
    },
    Action {
        name: "select",
        usage: "SHAPE|N|none",
        group: Group::Scene,
        keys: &[key(Key::Escape, "none")],
        held: false,
        does: ["show the parameters of a material (click on it)", "材質のパラメータを見る（クリック）"],
        parse: |w| match w {
            ["none"] => Some(Command::Select(None)),
            [] => None,
            words => Some(Command::Select(Some(words.join(" ")))),
        },
    },
    Action {
        name: "pick",
        usage: "ACROSS DOWN",
        group: Group::Scene,
        keys: &[],
        held: false,
        does: [
            "select the material (of a painting the contour stroke) seen at a place of the picture, 0 to 1",
            "画像の位置（0〜1）に見える材質（水墨では輪郭の筆線）を選ぶ",
        ],
        parse: |w| numbers(w).map(Command::Pick),
    },
    Action {
        name: "restore",
        usage: "",
        group: Group::Scene,
        keys: &[key(Key::Backspace, "")],
        held: false,
        does: ["materials and lights as the file has them", "材質と光源をファイルの値に戻す"],
        parse: |w| w.is_empty().then_some(Command::Restore),
    },
    Action {
        name: "play",
        usage: "[on|off]",
        group: Group::Time,
        keys: &[key(Key::T, "")],
        held: false,
        does: ["the animation goes on, again and again, or stands", "アニメーションを再生する、止める"],
        parse: |w| switch(w).map(Command::Play),
    },
    Action {
        name: "clip",
        usage: "NAME|next",
        group: Group::Time,
        keys: &[shift(Key::T, "next")],
        held: false,
        does: ["another animation of the scene", "シーンの別のアニメーション"],
        parse: |w| (!w.is_empty()).then(|| Command::Clip(not_next(&w.join(" ")))),
    },
    Action {
        name: "seconds",
        usage: "S",
        group: Group::Time,
        keys: &[key(Key::Home, "0")],
        held: false,
        does: ["so many seconds into the animation", "アニメーションの時刻、秒"],
        parse: |w| numbers(w).map(|[s]: [f32; 1]| Command::Seconds(s)),
    },
    Action {
        name: "step",
        usage: "S",
        group: Group::Time,
        keys: &[key(Key::PageUp, "-0.0416667"), key(Key::PageDown, "0.0416667")],
        held: true,
        does: ["on by so many seconds: a frame of film by key", "指定の秒数だけ進める（キーでは一コマ）"],
        parse: |w| numbers(w).map(|[s]: [f32; 1]| Command::Step(s)),
    },
    Action {
        name: "wind",
        usage: "X Y Z",
        group: Group::Time,
        keys: &[],
        held: false,
        does: ["simulated cloth in air that moves at so many m/s", "シミュレーション中の布に吹く風、m/s"],
        parse: |w| numbers(w).map(|v: [f32; 3]| Command::Wind(v.into())),
    },
    Action {
        name: "fabric",
        usage: "NAME",
        group: Group::Time,
        keys: &[],
        held: false,
        does: ["what simulated cloth is made of", "シミュレーション中の布の生地"],
        parse: |w| (w.len() == 1).then(|| Command::Fabric(w[0].into())),
    },
    Action {
        name: "reference",
        usage: "[on|off]",
        group: Group::Reference,
        keys: &[key(Key::Space, "")],
        held: false,
        does: ["the path-traced reference beside the picture, on or off", "経路追跡による参照画像との比較"],
        parse: |w| switch(w).map(Command::Reference),
    },
    Action {
        name: "compare",
        usage: "split|flicker|realtime|reference|next",
        group: Group::Reference,
        keys: &[key(Key::X, "next")],
        held: false,
        does: [
            "how both are seen: either side of a line, in turns, or one alone; of a painting, ours (realtime) and the slides' (reference)",
            "比べ方：線の左右、交互、片方だけ。水墨では本手法（realtime）とスライドの手法（reference）",
        ],
        parse: |w| one_of(w, &Compare::ALL).map(Command::Compare),
    },
    Action {
        name: "split",
        usage: "PART",
        group: Group::Reference,
        keys: &[],
        held: false,
        does: ["where the line stands, 0 to 1 (drag it)", "分割線の位置、0〜1（ドラッグ）"],
        parse: |w| numbers(w).map(|[p]: [f32; 1]| Command::Split(p)),
    },
    Action {
        name: "slide",
        usage: "PART",
        group: Group::Reference,
        keys: &[key(Key::Comma, "-0.05"), key(Key::Period, "0.05")],
        held: true,
        does: ["the line to the left or right", "分割線を左右に動かす"],
        parse: |w| numbers(w).map(|[p]: [f32; 1]| Command::Slide(p)),
    },
    Action {
        name: "ink",
        usage: "[on|off]",
        group: Group::Ink,
        keys: &[key(Key::I, "")],
        held: false,
        does: ["the picture painted in ink, or not", "水墨で描く、やめる"],
        parse: |w| switch(w).map(Command::Ink),
    },
    Action {
        name: "preset",
        usage: "NAME|FILE.toml|next",
        group: Group::Ink,
        keys: &[shift(Key::I, "next")],
        held: false,
        does: ["a way of painting, as of yugen ink --preset", "描き方（yugen ink --preset と同じ）"],
        parse: |w| (!w.is_empty()).then(|| Command::Preset(not_next(&w.join(" ")))),
    },
    Action {
        name: "set",
        usage: "CONTROL VALUE",
        group: Group::Ink,
        keys: &[],
        held: false,
        does: [
            "a control of the painting, or its paper, pigment, wash_pigment or manner by name",
            "描画の調整値、または紙・顔料・淡彩の顔料・皴法の名前",
        ],
        parse: |w| match w {
            [name, value] => Some(Command::Set(name.to_string(), value.to_string())),
            _ => None,
        },
    },
    Action {
        name: "stroke",
        usage: "hide|show|pin|unpin|plain|CONTROL VALUE|ID",
        group: Group::Ink,
        keys: &[key(Key::Delete, "hide"), key(Key::Insert, "pin")],
        held: false,
        does: [
            "the selected contour stroke (click on it): hidden, shown, pinned (never left out for others), as the others, with a control of its own; or select one",
            "選んだ輪郭の筆線（クリック）：隠す、見せる、固定する（省かれない）、ほかと同じに戻す、調整する。または筆線を選ぶ",
        ],
        parse: |w| {
            match w {
                ["hide"] => Some(StrokeChange::Hide(true)),
                ["show"] => Some(StrokeChange::Hide(false)),
                ["pin"] => Some(StrokeChange::Pin(true)),
                ["unpin"] => Some(StrokeChange::Pin(false)),
                ["plain"] => Some(StrokeChange::Plain),
                [name, value] => Some(StrokeChange::Set(name.to_string(), number(value)?)),
                [id] => yugen_ink::steering::id(id).ok().map(StrokeChange::Choose),
                _ => None,
            }
            .map(Command::Stroke)
        },
    },
    Action {
        name: "steer",
        usage: "object|material NAME [CONTROL VALUE|plain]",
        group: Group::Ink,
        keys: &[],
        held: false,
        does: [
            "an object or a material by its name (a last * stands for anything): a control of its own, or as the others; without, look at it (click on a surface)",
            "名前で選んだ物体や材質（末尾の * は任意）：調整する、ほかと同じに戻す。指定がなければ選ぶ（面をクリック）",
        ],
        parse: |w| {
            let (subject, rest) = w.split_first()?;
            let subject = Subject::ALL.iter().find(|(_, name)| name == subject)?.0;
            let control = |name: &str| CONTROLS.iter().any(|c| c.name == name);
            let (name, change) = match rest {
                [name @ .., control_name, value] if !name.is_empty() && control(control_name) => {
                    (name, TableChange::Set(control_name.to_string(), number(value)?))
                }
                [name @ .., "plain"] if !name.is_empty() => (name, TableChange::Plain),
                [] => return None,
                name => (name, TableChange::Choose),
            };
            Some(Command::Steer(subject, name.join(" "), change))
        },
    },
    Action {
        name: "mask",
        usage: "new|next|NAME [picture|object NAME|material NAME]|CONTROL VALUE|CONTROL plain|remove|off",
        group: Group::Ink,
        keys: &[key(Key::K, "next"), shift(Key::K, "new"), ctrl(Key::K, "off"), ctrl(Key::Delete, "remove")],
        held: false,
        does: [
            "paint a mask with the mouse (drag; with Ctrl erase): the next one, a new one on what is selected (else on the picture), or by its name; the value that a control has where it is white",
            "マスクをマウスで描く（ドラッグ、Ctrl で消す）：次のマスク、選んだもの（なければ画面）の新しいマスク、または名前で。白い所での調整値",
        ],
        parse: |w| {
            let is_control = |name: &str| CONTROLS.iter().any(|c| c.name == name);
            match w {
                ["new"] => Some(MaskChange::New),
                ["next"] => Some(MaskChange::Next),
                ["remove"] => Some(MaskChange::Remove),
                ["off"] => Some(MaskChange::Off),
                [name, "plain"] if is_control(name) => Some(MaskChange::Set(name.to_string(), None)),
                [name, value] if is_control(name) => {
                    Some(MaskChange::Set(name.to_string(), Some(number(value)?)))
                }
                [name] if !is_control(name) => Some(MaskChange::Paint(name.to_string(), None)),
                [name, "picture"] => Some(MaskChange::Paint(name.to_string(), Some(Ground::Picture))),
                [name, subject, thing @ ..] if !thing.is_empty() => {
                    let subject = Subject::ALL.iter().find(|(_, name)| name == subject)?.0;
                    Some(MaskChange::Paint(name.to_string(), Some(subject.ground(&thing.join(" ")))))
                }
                _ => None,
            }
            .map(Command::Mask)
        },
    },
    Action {
        name: "brush",
        usage: "RADIUS|smaller|larger|strength S|weaker|stronger|erase|add|other|undo",
        group: Group::Ink,
        keys: &[
            key(Key::N, "smaller"),
            shift(Key::N, "larger"),
            key(Key::U, "weaker"),
            shift(Key::U, "stronger"),
            key(Key::J, "other"),
            ctrl(Key::Z, "undo"),
        ],
        held: false,
        does: [
            "the brush of masks: its radius in pixels of a picture of 1080 lines, how far a stroke goes (strength, 0 to 1), whether it adds or erases (other: the other of the two); its last stroke undone",
            "マスクの筆：半径（縦1080画素の画像での画素数）、一筆の強さ（0〜1）、描くか消すか（other は切り替え）、直前の一筆を取り消す",
        ],
        parse: |w| {
            match w {
                ["smaller"] => Some(MaskChange::Larger(0.8)),
                ["larger"] => Some(MaskChange::Larger(1.25)),
                ["strength", s] => number(s).filter(|s| (0.0..=1.0).contains(s)).map(MaskChange::Strength),
                ["weaker"] => Some(MaskChange::Stronger(-0.1)),
                ["stronger"] => Some(MaskChange::Stronger(0.1)),
                ["erase"] => Some(MaskChange::Erase(Some(true))),
                ["add"] => Some(MaskChange::Erase(Some(false))),
                ["other"] => Some(MaskChange::Erase(None)),
                ["undo"] => Some(MaskChange::Undo),
                [radius] => number(radius).filter(|r| *r > 0.0).map(MaskChange::Radius),
                _ => None,
            }
            .map(Command::Mask)
        },
    },
    Action {
        name: "draw",
        usage: "ACROSS DOWN [ACROSS DOWN]…",
        group: Group::Ink,
        keys: &[],
        held: false,
        does: [
            "a stroke of the brush of masks through places of the picture, 0 to 1 (drag)",
            "マスクの筆で画像の位置（0〜1）を通る一筆を描く（ドラッグ）",
        ],
        parse: |w| {
            let all: Option<Vec<f32>> = w.iter().map(|w| number(w)).collect();
            let all = all.filter(|all| !all.is_empty() && all.len().is_multiple_of(2))?;
            let places = all.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
            Some(Command::Mask(MaskChange::Draw(MaskWay { places, ..MaskWay::default() })))
        },
    },
    Action {
        name: "literal",
        usage: "[on|off]",
        group: Group::Ink,
        keys: &[shift(Key::Space, "")],
        held: false,
        does: [
            "the slides' method beside the painting, on or off; seen together as a picture and its reference (compare, split)",
            "スライドの手法による絵との比較。見せ方は参照画像と同じ（compare、split）",
        ],
        parse: |w| switch(w).map(Command::Literal),
    },
    Action {
        name: "save",
        usage: "FILE|.png|.exr|.svg|.toml",
        group: Group::Window,
        keys: &[key(Key::P, ".png"), ctrl(Key::S, ".exr")],
        held: false,
        does: [
            "the picture to a file: .png as it is seen, .exr as light; of a painting .exr with layers, .svg its strokes, .toml its preset",
            "画像を保存：.png は見たまま、.exr は光の値。水墨では .exr はレイヤー付き、.svg は筆線、.toml はプリセット",
        ],
        parse: |w| (!w.is_empty()).then(|| Command::Save(w.join(" "))),
    },
    Action {
        name: "window",
        usage: "FILE|.png",
        group: Group::Window,
        keys: &[shift(Key::P, ".png")],
        held: false,
        does: ["the whole window to a file", "画面全体を保存"],
        parse: |w| (!w.is_empty()).then(|| Command::Window(w.join(" "))),
    },
    Action {
        name: "open",
        usage: "FILE",
        group: Group::Window,
        keys: &[],
        held: false,
        does: ["another scene (drop its file on the window)", "別のシーンを開く（ファイルをドロップ）"],
        parse: |w| (!w.is_empty()).then(|| Command::Open(w.join(" "))),
    },
    Action {
        name: "reload",
        usage: "",
        group: Group::Window,
        keys: &[key(Key::F5, "")],
        held: false,
        does: [
            "the scene anew from its file (also done when the file changes)",
            "シーンを読み直す（ファイルが変われば自動）",
        ],
        parse: |w| w.is_empty().then_some(Command::Reload),
    },
    Action {
        name: "panel",
        usage: "[on|off]",
        group: Group::Window,
        keys: &[key(Key::H, "")],
        held: false,
        does: ["the panel of settings", "設定パネル"],
        parse: |w| switch(w).map(Command::Panel),
    },
    Action {
        name: "graph",
        usage: "[on|off]",
        group: Group::Window,
        keys: &[key(Key::G, "")],
        held: false,
        does: ["frame times, milliseconds of each pass", "フレーム時間、各パスのミリ秒"],
        parse: |w| switch(w).map(Command::Graph),
    },
    Action {
        name: "help",
        usage: "[on|off]",
        group: Group::Window,
        keys: &[key(Key::Questionmark, ""), key(Key::F1, "")],
        held: false,
        does: ["this list", "この一覧"],
        parse: |w| switch(w).map(Command::Help),
    },
    Action {
        name: "language",
        usage: "en|ja|next",
        group: Group::Window,
        keys: &[key(Key::L, "next")],
        held: false,
        does: ["English or Japanese", "日本語か英語"],
        parse: |w| match w {
            ["next"] => Some(Command::Language(None)),
            [code] => Language::from_code(code).map(|l| Command::Language(Some(l))),
            _ => None,
        },
    },
    Action {
        name: "fullscreen",
        usage: "",
        group: Group::Window,
        keys: &[key(Key::F11, "")],
        held: false,
        does: ["the whole screen", "全画面"],
        parse: |w| w.is_empty().then_some(Command::FullScreen),
    },
    Action {
        name: "wait",
        usage: "[FRAMES [SAMPLES]]",
        group: Group::Window,
        keys: &[],
        held: false,
        does: [
            "in scripts: until the picture has so many frames (16) and the reference, where it is on, so many samples (16); or the painting is done",
            "スクリプト用：画像のフレーム数（16）と参照画像のサンプル数（16）に達するまで、または水墨が描き終わるまで待つ",
        ],
        parse: |w| match w {
            [] => Some(Command::Wait([16, 16])),
            [n] => n.parse().ok().map(|n| Command::Wait([n, n])),
            [n, m] => Some(Command::Wait([n.parse().ok()?, m.parse().ok()?])),
            _ => None,
        },
    },
    Action {
        name: "pause",
        usage: "SECONDS",
        group: Group::Window,
        keys: &[],
        held: false,
        does: [
            "in scripts: so many seconds, in which an animation plays",
            "スクリプト用：指定した秒数だけ待つ（アニメーションは進む）",
        ],
        parse: |w| match w {
            [s] => s.parse().ok().filter(|s| (0.0..=300.0).contains(s)).map(Command::Pause),
            _ => None,
        },
    },
    Action {
        name: "report",
        usage: "",
        group: Group::Window,
        keys: &[],
        held: false,
        does: ["print what is seen as a line of JSON", "状態を JSON で出力"],
        parse: |w| w.is_empty().then_some(Command::Report),
    },
    Action {
        name: "quit",
        usage: "",
        group: Group::Window,
        keys: &[ctrl(Key::Q, "")],
        held: false,
        does: ["end", "終了"],
        parse: |w| w.is_empty().then_some(Command::Quit),
    },
];

fn number(word: &str) -> Option<f32> {
    word.parse().ok().filter(|v: &f32| v.is_finite())
}

fn numbers<const N: usize>(words: &[&str]) -> Option<[f32; N]> {
    let all: Option<Vec<f32>> = words.iter().map(|w| number(w)).collect();
    all?.try_into().ok()
}

fn not_next(word: &str) -> Option<String> {
    (word != "next").then(|| word.to_string())
}

/// On, off, or the other.
fn switch(words: &[&str]) -> Option<Option<bool>> {
    match words {
        [] => Some(None),
        ["on"] => Some(Some(true)),
        ["off"] => Some(Some(false)),
        _ => None,
    }
}

/// One of a list by its name, or the next.
fn one_of<T: Copy>(words: &[&str], all: &[(T, &str)]) -> Option<Option<T>> {
    match words {
        ["next"] => Some(None),
        [name] => all.iter().find(|(_, n)| n == name).map(|(value, _)| Some(*value)),
        _ => None,
    }
}

/// A step of a script.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// As it was written.
    pub text: String,
    /// What it says.
    pub command: Command,
}

/// The steps of a script: actions by their names, one a line or with semicolons between them; what follows a `#` is for
/// people. The error says which one is wrong and what was expected.
pub fn script(text: &str) -> Result<Vec<Step>, String> {
    let mut steps = Vec::new();
    for (line, content) in text.lines().enumerate() {
        let content = content.split('#').next().unwrap_or_default();
        for step in content.split(';') {
            let words: Vec<&str> = step.split_whitespace().collect();
            let Some((name, words)) = words.split_first() else { continue };
            let wrong = |problem: String| format!("line {}: '{}': {problem}", line + 1, step.trim());
            let action = Action::named(name).ok_or_else(|| {
                let hint = suggest(name, ACTIONS.iter().map(|a| a.name));
                wrong(format!("there is no action '{name}'{hint}"))
            })?;
            let command = action.command(words).map_err(wrong)?;
            steps.push(Step { text: step.trim().into(), command });
        }
    }
    Ok(steps)
}

/// What a key does; `held`: it was down before, so only actions that go on.
pub fn of_key(key: Key, modifiers: Modifiers, held: bool) -> Option<Command> {
    let bound = ACTIONS.iter().filter(|a| a.held || !held).find_map(|a| {
        let binding = a.keys.iter().find(|b| b.key == key && b.has(modifiers))?;
        Some((a, binding))
    })?;
    let words: Vec<&str> = bound.1.words.split_whitespace().collect();
    bound.0.command(&words).ok()
}

/// The table for the manual, as Markdown.
pub fn manual() -> String {
    let mut out = String::new();
    for (group, title) in Group::ALL {
        out += &format!(
            "\n### {} / {}\n\n| keys | in scripts | what it does | |\n| --- | --- | --- | --- |\n",
            title[0], title[1]
        );
        for a in ACTIONS.iter().filter(|a| a.group == group) {
            let keys: Vec<String> = a.keys.iter().map(|b| format!("`{}`", b.shown())).collect();
            let call = format!("`{}`", [a.name, a.usage].join(" ").trim_end());
            let cells =
                [keys.join(" "), call, a.does[0].into(), a.does[1].into()].map(|c| c.replace('|', "\\|"));
            out += &format!("| {} |\n", cells.join(" | "));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_does_one_thing_and_it_can_be_done() {
        let mut seen: Vec<(Key, bool, bool)> = Vec::new();
        for a in ACTIONS {
            assert!(a.does.iter().all(|d| !d.is_empty()), "{}", a.name);
            assert_eq!(ACTIONS.iter().filter(|b| b.name == a.name).count(), 1, "{}", a.name);
            for b in a.keys {
                let chord = (b.key, b.shift, b.ctrl);
                assert!(!seen.contains(&chord), "{} twice", b.shown());
                seen.push(chord);
                let words: Vec<&str> = b.words.split_whitespace().collect();
                a.command(&words).unwrap_or_else(|e| panic!("{} {}: {e}", a.name, b.words));
                let modifiers =
                    Modifiers { shift: b.shift, command: b.ctrl, ctrl: b.ctrl, ..Modifiers::NONE };
                assert!(of_key(b.key, modifiers, false).is_some(), "{}", b.shown());
            }
        }
        assert!(seen.len() > 40);
        // A question mark comes with Shift on most keyboards.
        assert_eq!(of_key(Key::Questionmark, Modifiers::SHIFT, false), Some(Command::Help(None)));
        assert_eq!(of_key(Key::W, Modifiers::NONE, true), Some(Command::Walk([0.05, 0.0, 0.0])));
        // A key that is held does not switch a light on and off.
        assert_eq!(of_key(Key::Num1, Modifiers::NONE, true), None);
        assert_eq!(of_key(Key::P, Modifiers::SHIFT, false), Some(Command::Window(".png".into())));
        assert_eq!(of_key(Key::W, Modifiers::ALT, false), None);
    }

    #[test]
    fn scripts_are_read_and_mistakes_are_named() {
        let read = script(
            "orbit 30 10; wait  # a moment\n\nlight left lamp off;material ball alpha_x .1\nsave a b.png; \
             preset own one.toml; stroke 0f3a9c12; stroke ink 1.2; stroke pin; steer object wet rock 2
             steer material pine* ink .5; steer object rock plain; mask worn material wet rock; mask wash .5
             draw .1 .2 .3 .4; quit",
        );
        let expected = [
            Command::Orbit([30.0, 10.0]),
            Command::Wait([16, 16]),
            Command::Light("left lamp".into(), LightChange::Switch(Some(false))),
            Command::Material("ball".into(), "alpha_x".into(), vec![".1".into()]),
            Command::Save("a b.png".into()),
            Command::Preset(Some("own one.toml".into())),
            Command::Stroke(StrokeChange::Choose(0x0f3a_9c12)),
            Command::Stroke(StrokeChange::Set("ink".into(), 1.2)),
            Command::Stroke(StrokeChange::Pin(true)),
            Command::Steer(Subject::Object, "wet rock 2".into(), TableChange::Choose),
            Command::Steer(Subject::Material, "pine*".into(), TableChange::Set("ink".into(), 0.5)),
            Command::Steer(Subject::Object, "rock".into(), TableChange::Plain),
            Command::Mask(MaskChange::Paint("worn".into(), Some(Ground::Material("wet rock".into())))),
            Command::Mask(MaskChange::Set("wash".into(), Some(0.5))),
            Command::Mask(MaskChange::Draw(MaskWay {
                places: vec![[0.1, 0.2], [0.3, 0.4]],
                ..MaskWay::default()
            })),
            Command::Quit,
        ];
        let read: Vec<Command> = read.expect("a script").into_iter().map(|s| s.command).collect();
        assert_eq!(read, expected);
        for (wrong, said) in [
            ("frame\norbti 3 4", "line 2: 'orbti 3 4': there is no action 'orbti'; did you mean 'orbit'?"),
            ("orbit 3", "expected `orbit RIGHT UP`"),
            ("orbit 3 nan", "expected `orbit RIGHT UP`"),
            ("dolly 0", "expected `dolly FACTOR`"),
            ("curve filmic", "expected `curve clip|reinhard|aces|agx|next`"),
            ("light off", "expected `light"),
            ("wait x", "expected `wait"),
            ("stroke 12", "expected `stroke hide|show|pin"),
            ("set ink", "expected `set CONTROL VALUE`"),
            ("mask", "expected `mask new|next|NAME"),
            ("mask ink", "expected `mask new|next|NAME"),
            ("mask a lamp b", "expected `mask new|next|NAME"),
            ("brush 0", "expected `brush RADIUS|smaller"),
            ("brush strength 2", "expected `brush RADIUS|smaller"),
            ("draw 1 2 3", "expected `draw ACROSS DOWN"),
            ("steer light lamp", "expected `steer object|material NAME"),
            ("steer object plain ink x", "expected `steer object|material NAME"),
            ("quit now", "expected `quit`"),
        ] {
            let error = script(wrong).expect_err(wrong);
            assert!(error.contains(said), "{wrong}: {error}");
        }
        let curves: Vec<&str> = Curve::ALL.iter().map(|c| c.name()).collect();
        let usage = Action::named("curve").expect("there is one").usage;
        assert_eq!(usage, [&curves[..], &["next"]].concat().join("|"));
    }
}
