//! What is seen in the window: the picture, a panel, overlays. It changes nothing; it says what is to be done.

mod graph;
mod help;
mod ink;
mod look;
mod panel;
mod timeline;

pub use look::set_look;

use crate::action::of_key;
use crate::command::{Command, Compare};
use crate::language::Words;
use crate::mask::{MaskChange, MaskWay};
use crate::reference::Difference;
use crate::state::State;
use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, TextureId, Ui, pos2, vec2};
use std::collections::VecDeque;
use std::sync::Arc;

/// What the renderers have to show.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// The real-time picture.
    pub realtime: Option<TextureId>,
    /// The reference.
    pub reference: Option<TextureId>,
    /// The painting.
    pub ink: Option<TextureId>,
    /// What the slides' method makes of the same.
    pub literal: Option<TextureId>,
    /// Sentences about tables of the preset that changed nothing.
    pub unmet: Arc<[String]>,
    /// How it came to be.
    pub painted: Option<Strokes>,
    /// It is not yet the one that is asked for.
    pub painting: bool,
    /// The way of the selected stroke, in parts of the picture.
    pub stroke: Vec<[f32; 2]>,
    /// Pixels computed.
    pub size: [u32; 2],
    /// Frames in the real-time picture.
    pub frames: u32,
    /// Samples of a pixel of the reference.
    pub samples: f32,
    /// How far they are apart.
    pub difference: Option<Difference>,
    /// Milliseconds of a frame, from order to end, newest last.
    pub history: VecDeque<f32>,
    /// Milliseconds of each pass on the device.
    pub passes: Vec<(String, f64)>,
    /// Name of the GPU.
    pub adapter: String,
    /// What the surface is.
    pub surface: String,
    /// The scene is being prepared.
    pub preparing: bool,
    /// There is a font with Japanese characters.
    pub japanese: bool,
    /// Of the speed of real time that simulated cloth plays at.
    pub pace: Option<f32>,
    /// A file is being dragged over the window.
    pub dropping: bool,
}

/// A painting in numbers.
#[derive(Clone, Copy, Debug)]
pub struct Strokes {
    /// Its pixels.
    pub size: [u32; 2],
    /// Strokes of contours.
    pub strokes: usize,
    /// That it took.
    pub seconds: f64,
}

/// What came of showing it.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// To be done, in order.
    pub commands: Vec<Command>,
    /// Where the picture lies, in points.
    pub picture: Option<Rect>,
}

const PREPARING: Words = ["preparing the scene…", "シーンを準備中…"];
const PAINTING: Words = ["painting…", "描画中…"];
const STROKES: Words = ["strokes", "筆線"];
const WAITING: Words = ["the reference begins…", "参照画像を計算中…"];
const REALTIME: Words = ["real-time", "リアルタイム"];
const REFERENCE: Words = ["reference", "参照"];
const OURS: Words = ["Yugen", "本手法"];
const SLIDES: Words = ["the slides' method", "スライドの手法"];
const DROP: Words = ["drop a scene file to open it", "シーンファイルをドロップして開く"];
const FRAMES: Words = ["frames", "フレーム"];
const SAMPLES: Words = ["samples", "サンプル"];
const HELP: Words = ["? all keys", "? キー一覧"];

/// Seconds for which each picture is seen while they flicker.
const FLICKER: f64 = 0.5;

/// Points on either side of the line from which it can be dragged.
const REACH: f32 = 6.0;

/// Shows it all.
pub fn show(ui: &mut Ui, state: &State, seen: &Seen) -> Asked {
    let mut asked = Asked::default();
    keys(ui, &mut asked);
    footer(ui, state, seen);
    if !state.clips.is_empty() {
        timeline::show(ui, state, &mut asked);
    }
    if state.panel {
        panel::show(ui, state, seen, &mut asked);
    }
    let frame = egui::Frame::NONE.fill(look::BEHIND);
    egui::CentralPanel::default().frame(frame).show(ui, |ui| picture(ui, state, seen, &mut asked));
    if state.graph {
        graph::show(ui, state, seen, asked.picture);
    }
    if state.help {
        help::show(ui, state, &mut asked);
    }
    asked
}

/// Keys, unless something is being typed or a control has the focus.
fn keys(ui: &Ui, asked: &mut Asked) {
    let ctx = ui.ctx();
    let focused = ctx.egui_wants_keyboard_input();
    ctx.input(|input| {
        for event in &input.events {
            let egui::Event::Key { key, pressed: true, repeat, modifiers, .. } = event else { continue };
            // Escape leaves a control, and that is all it then does.
            if !focused {
                asked.commands.extend(of_key(*key, *modifiers, *repeat));
            }
        }
    });
}

fn footer(ui: &mut Ui, state: &State, seen: &Seen) {
    let language = state.language;
    egui::Panel::bottom("footer").frame(look::bar()).show_separator_line(false).show(ui, |ui| {
        ui.horizontal(|ui| {
            match &state.message {
                Some(m) if m.wrong => ui.colored_label(look::WRONG, &m.text),
                Some(m) => ui.label(&m.text),
                None => ui.weak(state.file.display().to_string()),
            };
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.weak(language.of(HELP));
                ui.separator();
                let painted = seen.painted.filter(|_| state.ink.on && seen.ink.is_some());
                let mut line = match painted {
                    Some(Strokes { size: [w, h], strokes, seconds }) => {
                        format!("{w} × {h}   {strokes} {}   {seconds:.2} s", language.of(STROKES))
                    }
                    None => {
                        let [w, h] = seen.size;
                        let last = seen.history.back().map_or(String::new(), |ms| format!("   {ms:.0} ms"));
                        format!("{w} × {h}   {} {}{last}", seen.frames, language.of(FRAMES))
                    }
                };
                if seen.samples > 0.0 {
                    line += &format!(
                        "   {} {:.0} {}",
                        language.of(REFERENCE),
                        seen.samples,
                        language.of(SAMPLES)
                    );
                }
                ui.weak(line);
            });
        });
    });
}

fn picture(ui: &mut Ui, state: &State, seen: &Seen, asked: &mut Asked) {
    let available = ui.available_rect_before_wrap();
    let points = ui.ctx().pixels_per_point();
    // Whole pixels, so that each computed is one that is seen.
    let snap = |p: Pos2| pos2((p.x * points).round() / points, (p.y * points).round() / points);
    let rect = Rect::from_min_max(snap(available.min), snap(available.max));
    asked.picture = Some(rect);
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, state.file.display().to_string()));
    let painter = ui.painter_at(rect);
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    let draw = |clip: Rect, id: TextureId| {
        painter.with_clip_rect(clip.intersect(rect)).image(id, rect, whole, Color32::WHITE);
    };
    let line = rect.left() + state.split * rect.width();
    let (left, right) = rect.split_left_right_at_x((line * points).round() / points);
    let painting = state.ink.on;
    let compared = if painting { state.ink.literal } else { state.reference };
    let first = seen.ink.filter(|_| painting).or(seen.realtime);
    let other = if painting { seen.literal } else { seen.reference }.filter(|_| compared);
    let [name, other_name] = if painting { [OURS, SLIDES] } else { [REALTIME, REFERENCE] };
    let time = ui.input(|i| i.time);
    let [mut of_left, mut of_right] = [None; 2];
    match (other, state.compare) {
        (None, _) => {
            first.iter().for_each(|id| draw(rect, *id));
            of_right = Some(WAITING).filter(|_| compared && !painting);
        }
        (Some(other), Compare::Split) => {
            first.iter().for_each(|id| draw(left, *id));
            draw(right, other);
            painter.vline(line, rect.y_range(), Stroke::new(1.5, look::LINE));
            (of_left, of_right) = (Some(name), Some(other_name));
        }
        (Some(other), Compare::Flicker) => {
            let turn = ((time / FLICKER) as u64).is_multiple_of(2);
            match (turn, first) {
                (true, Some(id)) => draw(rect, id),
                _ => draw(rect, other),
            }
            of_left = Some(if turn { name } else { other_name });
            let next = FLICKER - time % FLICKER;
            ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(next.max(0.01)));
        }
        (Some(_), Compare::RealTime) => {
            first.iter().for_each(|id| draw(rect, *id));
            of_left = Some(name);
        }
        (Some(other), Compare::Reference) => {
            draw(rect, other);
            of_left = Some(other_name);
        }
    }
    if state.ink.on && seen.stroke.len() > 1 {
        let place = |p: &[f32; 2]| rect.min + vec2(p[0] * rect.width(), p[1] * rect.height());
        let way: Vec<Pos2> = seen.stroke.iter().map(place).collect();
        painter.add(egui::Shape::line(way, Stroke::new(2.0, look::LINE)));
    }
    let tag = |at: Pos2, align: Align2, words: Words| {
        let galley =
            painter.layout_no_wrap(state.language.of(words).into(), FontId::proportional(12.0), look::TEXT);
        let at = align.anchor_size(at, galley.size() + vec2(12.0, 6.0));
        painter.rect_filled(at, 3.0, Color32::from_black_alpha(150));
        painter.galley(at.min + vec2(6.0, 3.0), galley, look::TEXT);
    };
    if let Some(words) = of_left {
        tag(rect.left_top() + vec2(8.0, 8.0), Align2::LEFT_TOP, words);
    }
    if let Some(words) = of_right {
        tag(rect.right_top() + vec2(-8.0, 8.0), Align2::RIGHT_TOP, words);
    }
    if seen.preparing && seen.realtime.is_none() {
        tag(rect.center(), Align2::CENTER_CENTER, PREPARING);
    } else if seen.preparing {
        tag(rect.left_bottom() + vec2(8.0, -8.0), Align2::LEFT_BOTTOM, PREPARING);
    } else if seen.painting {
        tag(rect.left_bottom() + vec2(8.0, -8.0), Align2::LEFT_BOTTOM, PAINTING);
    }
    if seen.dropping {
        painter.rect_stroke(rect.shrink(6.0), 4.0, Stroke::new(2.0, look::LINE), egui::StrokeKind::Inside);
        tag(rect.center(), Align2::CENTER_CENTER, DROP);
    }
    let masked = state.ink.on && state.ink.mask().is_some();
    if masked {
        brush(ui, state, seen, &painter, rect, response.hover_pos());
    }
    let on_line = other.is_some() && state.compare == Compare::Split;
    pointer(ui, &response, rect, on_line.then_some(line), masked, asked);
}

/// The brush of masks where the pointer is, and the way of its last stroke until that is painted.
fn brush(ui: &Ui, state: &State, seen: &Seen, painter: &egui::Painter, rect: Rect, at: Option<Pos2>) {
    let masks = &state.ink.masks;
    let points = |pixels: f32| pixels / 1080.0 * rect.height();
    let (way, radius) = &masks.way;
    if seen.painting && !way.is_empty() {
        let way: Vec<Pos2> =
            way.iter().map(|p| rect.min + vec2(p[0] * rect.width(), p[1] * rect.height())).collect();
        let colour = look::LINE.gamma_multiply(0.3);
        match way[..] {
            [one] => painter.circle_filled(one, points(*radius), colour),
            _ => painter.line(way, Stroke::new(2.0 * points(*radius), colour)),
        };
    }
    if let Some(at) = at {
        let erases = masks.erases != ui.input(|i| i.modifiers.command);
        let colour = if erases { look::WRONG } else { look::LINE };
        painter.circle_stroke(at, points(masks.radius), Stroke::new(1.5, colour));
    }
}

/// What the pointer asks of the picture; `masked`: it is the brush of a mask.
fn pointer(
    ui: &Ui,
    response: &egui::Response,
    rect: Rect,
    line: Option<f32>,
    masked: bool,
    asked: &mut Asked,
) {
    let held = egui::Id::unique("the line is held");
    let near = |p: Option<Pos2>| p.zip(line).is_some_and(|(p, line)| (p.x - line).abs() < REACH);
    if response.drag_started() {
        let begun = ui.input(|i| i.pointer.press_origin());
        ui.data_mut(|d| d.insert_temp(held, near(begun)));
    }
    if near(response.hover_pos()) {
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
    }
    let modifiers = ui.input(|i| i.modifiers);
    let by = response.drag_delta();
    let on_line = ui.data(|d| d.get_temp(held)).unwrap_or(false);
    let primary = response.dragged_by(egui::PointerButton::Primary);
    let part = |p: Pos2| [(p.x - rect.left()) / rect.width(), (p.y - rect.top()) / rect.height()];
    let draw = |places: Vec<[f32; 2]>, goes_on: bool| {
        Command::Mask(MaskChange::Draw(MaskWay { places, goes_on, inverted: modifiers.command }))
    };
    if masked && primary && !on_line && !modifiers.shift {
        let begun = response.drag_started();
        let from = ui.input(|i| i.pointer.press_origin()).filter(|_| begun);
        if let Some(to) = response.interact_pointer_pos().filter(|_| begun || by != egui::Vec2::ZERO) {
            asked.commands.push(draw(vec![part(from.unwrap_or(to - by)), part(to)], !begun));
        }
    } else if response.dragged() && by != egui::Vec2::ZERO {
        let (w, h) = (rect.width().max(1.0), rect.height().max(1.0));
        asked.commands.push(if on_line && primary {
            let x = response.interact_pointer_pos().map_or(0.0, |p| p.x);
            Command::Split((x - rect.left()) / w)
        } else if !primary || modifiers.shift {
            Command::Pan([-by.x / w, by.y / w])
        } else if modifiers.command {
            Command::Look([by.x / w * 60.0, -by.y / w * 60.0])
        } else {
            // Half a turn across the picture.
            Command::Orbit([-by.x / w * 180.0, by.y / h * 120.0])
        });
    }
    if response.clicked()
        && !near(response.interact_pointer_pos())
        && let Some(p) = response.interact_pointer_pos()
    {
        asked.commands.push(match masked {
            true => draw(vec![part(p)], false),
            false => Command::Pick(part(p)),
        });
    }
    if response.hovered() {
        let wheel = ui.input(|i| i.smooth_scroll_delta().y);
        if wheel != 0.0 {
            asked.commands.push(Command::Dolly((-wheel / 300.0).exp()));
        }
    }
}
