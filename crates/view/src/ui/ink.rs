//! The part of the panel about ink.

use super::panel::{comparisons, named, row, short};
use super::{Asked, OURS, SLIDES, Seen, look};
use crate::command::Command;
use crate::ink::{SelectedStroke, StrokeChange, Subject, TableChange};
use crate::language::Words;
use crate::mask::{MaskChange, RADII, WEAKEST};
use crate::state::State;
use egui::{ComboBox, Slider, SliderClamping, Ui};
use yugen_ink::canvas::Layer;
use yugen_ink::control::{CONTROLS, Control};
use yugen_ink::mask::Ground;
use yugen_ink::paper::PAPERS;
use yugen_ink::pigment::PIGMENTS;
use yugen_ink::steering::OF_THE_SHEET;
use yugen_ink::wrinkle::MANNERS;

/// The title.
pub const INK: Words = ["Ink", "水墨"];
const PAINTED: Words = ["painted in ink", "水墨で描く"];
const PRESET: Words = ["preset", "プリセット"];
const PAPER: Words = ["paper", "紙"];
const PIGMENT: Words = ["pigment", "顔料"];
const WASH: Words = ["wash", "淡彩"];
const MANNER: Words = ["wrinkles", "皴法"];
const STROKE: Words = ["stroke", "筆線"];
const CLICK: Words = [
    "click on a contour to steer its stroke, on a surface to steer the object or its material",
    "輪郭の筆線をクリックして調整する。面をクリックすると物体や材質",
];
const HIDE: Words = ["hidden", "隠す"];
const PIN: Words = ["pinned", "固定する"];
const PINNED: Words = [
    "never left out for other strokes, and the same stroke through the whole shot",
    "ほかの筆線のために省かれず、ショットの間ずっと同じ筆線であり続ける",
];
const SUBJECTS: [Words; 2] = [["object", "物体"], ["material", "材質"]];
const STEERED_THINGS: Words = ["steered objects and materials", "調整した物体と材質"];
const MASKS: Words = ["masks", "マスク"];
const MASK: Words = ["mask", "マスク"];
const ON_PICTURE: Words = ["picture", "画面"];
const NEW_MASK: Words = ["New mask on the", "新しいマスク："];
const MASK_HELP: Words = [
    "drag over the picture to paint the mask, with Ctrl to erase; where it is white its controls have these values",
    "ドラッグしてマスクを描く（Ctrl で消す）。マスクの白い所で調整項目がこの値になる",
];
const HOLDS: Words = ["also of it", "項目を加える"];
const RADIUS: Words = ["brush radius", "筆の半径"];
const STRENGTH: Words = ["brush strength", "筆の強さ"];
const ERASE: Words = ["erase", "消す"];
const UNDO: Words = ["Undo the stroke", "一筆取り消す"];
const STOP: Words = ["Stop painting", "描くのをやめる"];
const REMOVE: Words = ["Remove the mask", "マスクを削除"];
const BESIDE: Words = ["the slides' method beside it", "スライドの手法と比べる"];
const PLAIN: Words = ["As the others", "ほかと同じに戻す"];
const STEERED: Words = ["steered strokes", "調整した筆線"];
const SAVE: Words = ["Save", "保存"];
const SAVE_PRESET: Words = ["Save the preset", "プリセットを保存"];

/// Shows it.
pub fn show(ui: &mut Ui, state: &State, seen: &Seen, asked: &mut Asked) {
    let (l, ink) = (state.language, &state.ink);
    let mut on = ink.on;
    if ui.checkbox(&mut on, l.of(PAINTED)).changed() {
        asked.commands.push(Command::Ink(Some(on)));
    }
    if !ink.on {
        return;
    }
    let presets: Vec<_> = ink.presets.iter().map(|p| (p.name.as_str(), p.doc.as_str())).collect();
    if let Some(name) = choice(ui, l.of(PRESET), &ink.name, &presets) {
        asked.commands.push(Command::Preset(Some(name)));
    }
    let papers: Vec<_> = PAPERS.iter().map(|p| (p.name, p.doc)).collect();
    let pigments: Vec<_> = PIGMENTS.iter().map(|p| (p.name, p.doc)).collect();
    let manners: Vec<_> = MANNERS.iter().map(|m| (m.name, m.doc)).collect();
    let pigment = |layer: Layer| ink.style.pigments[layer as usize].name;
    for (words, key, now, all) in [
        (PAPER, "paper", ink.style.paper.name, &papers),
        (PIGMENT, "pigment", pigment(Layer::Contour), &pigments),
        (WASH, "wash_pigment", pigment(Layer::Wash), &pigments),
        (MANNER, "manner", ink.style.manner.name, &manners),
    ] {
        if let Some(name) = choice(ui, l.of(words), now, all) {
            asked.commands.push(Command::Set(key.into(), name));
        }
    }
    ui.add_space(4.0);
    for control in CONTROLS {
        let Some(now) = ink.style.controls.get(control.name) else { continue };
        if let Some(value) = slider(ui, control, control.name, now) {
            asked.commands.push(Command::Set(control.name.into(), value.to_string()));
        }
    }
    ui.add_space(4.0);
    stroke(ui, state, asked);
    things(ui, state, asked);
    masks(ui, state, asked);
    for sentence in seen.unmet.iter() {
        ui.colored_label(look::WRONG, sentence);
    }
    let mut beside = ink.literal;
    if ui.checkbox(&mut beside, l.of(BESIDE)).changed() {
        asked.commands.push(Command::Literal(Some(beside)));
    }
    if ink.literal {
        comparisons(ui, state, [OURS, SLIDES], asked);
    }
    ui.horizontal_wrapped(|ui| {
        if ui.button(format!("{} .svg", l.of(SAVE))).clicked() {
            asked.commands.push(Command::Save(".svg".into()));
        }
        if ui.button(l.of(SAVE_PRESET)).clicked() {
            asked.commands.push(Command::Save(".toml".into()));
        }
    });
}

/// The stroke that is looked at, and those that are otherwise than the others.
fn stroke(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let (l, ink) = (state.language, &state.ink);
    let mut change = |change: StrokeChange| asked.commands.push(Command::Stroke(change));
    match ink.selected() {
        None if ink.subject.is_some() => {}
        None => drop(ui.weak(l.of(CLICK))),
        Some(SelectedStroke { id, hidden, pinned, controls }) => {
            let (mut hide, mut pin) = (hidden, pinned);
            ui.label(format!("{} {id:08x}", l.of(STROKE)));
            if ui.checkbox(&mut hide, l.of(HIDE)).changed() {
                change(StrokeChange::Hide(hide));
            }
            if ui.checkbox(&mut pin, l.of(PIN)).on_hover_text(l.of(PINNED)).changed() {
                change(StrokeChange::Pin(pin));
            }
            for (name, now) in controls {
                let Some(control) = CONTROLS.iter().find(|c| c.name == name) else { continue };
                let label = format!("{} {name}", l.of(STROKE));
                if let Some(value) = slider(ui, control, &label, now) {
                    change(StrokeChange::Set(name.into(), value));
                }
            }
            if ink.style.steering.strokes.contains_key(&id) && ui.button(l.of(PLAIN)).clicked() {
                change(StrokeChange::Plain);
            }
        }
    }
    if !ink.style.steering.strokes.is_empty() {
        ui.horizontal_wrapped(|ui| {
            ui.label(l.of(STEERED));
            for id in ink.style.steering.strokes.keys() {
                if ui.selectable_label(ink.stroke == Some(*id), format!("{id:08x}")).clicked() {
                    change(StrokeChange::Choose(*id));
                }
            }
        });
    }
}

/// The object and the materials of what was clicked on, and those that are otherwise than the others.
fn things(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let (l, ink) = (state.language, &state.ink);
    let chosen =
        |subject: Subject, name: &str| ink.subject.as_ref().is_some_and(|(s, n)| *s == subject && n == name);
    let label = |subject: Subject, name: &str| format!("{} {name}", l.of(SUBJECTS[subject as usize]));
    let mut steer = |subject: Subject, name: &str, change: TableChange| {
        asked.commands.push(Command::Steer(subject, name.into(), change));
    };
    ui.horizontal_wrapped(|ui| {
        for (subject, name) in &ink.offered {
            if ui.selectable_label(chosen(*subject, name), label(*subject, name)).clicked() {
                steer(*subject, name, TableChange::Choose);
            }
        }
    });
    if let Some((subject, name)) = &ink.subject {
        if !ink.offered.iter().any(|(s, n)| s == subject && n == name) {
            ui.label(label(*subject, name));
        }
        for (control_name, now) in ink.subject_controls(&state.scene) {
            let Some(control) = CONTROLS.iter().find(|c| c.name == control_name) else { continue };
            let label = format!("{} {control_name}", l.of(SUBJECTS[*subject as usize]));
            if let Some(value) = slider(ui, control, &label, now) {
                steer(*subject, name, TableChange::Set(control_name.into(), value));
            }
        }
        if ink.steered().any(|(s, n)| s == *subject && n == name) && ui.button(l.of(PLAIN)).clicked() {
            steer(*subject, name, TableChange::Plain);
        }
    }
    if ink.steered().next().is_some() {
        ui.horizontal_wrapped(|ui| {
            ui.label(l.of(STEERED_THINGS));
            for (subject, name) in ink.steered() {
                if ui.selectable_label(chosen(subject, name), label(subject, name)).clicked() {
                    steer(subject, name, TableChange::Choose);
                }
            }
        });
    }
}

/// The masks, and the one that is painted.
fn masks(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let (l, ink) = (state.language, &state.ink);
    let mut change = |change: MaskChange| asked.commands.push(Command::Mask(change));
    let painted = ink.mask();
    let of_ground = |on: &Ground| match on {
        Ground::Picture => l.of(ON_PICTURE).to_string(),
        Ground::Object(name) => format!("{} {name}", l.of(SUBJECTS[0])),
        Ground::Material(name) => format!("{} {name}", l.of(SUBJECTS[1])),
    };
    ui.horizontal_wrapped(|ui| {
        let all = &ink.style.steering.masks;
        if !all.is_empty() {
            ui.label(l.of(MASKS));
        }
        for mask in all {
            let chosen = painted.is_some_and(|m| m.name == mask.name);
            if ui.selectable_label(chosen, format!("{} ({})", mask.name, of_ground(&mask.on))).clicked() {
                change(MaskChange::Paint(mask.name.clone(), None));
            }
        }
        let selected = Some(ink.ground()).filter(|on| *on != Ground::Picture);
        for on in [Ground::Picture].into_iter().chain(selected) {
            if ui.button(format!("{} {}", l.of(NEW_MASK), of_ground(&on))).clicked() {
                change(MaskChange::Paint(ink.free_name(), Some(on)));
            }
        }
    });
    let Some(mask) = painted else { return };
    ui.weak(l.of(MASK_HELP));
    for (name, now) in mask.changes.iter() {
        let Some(control) = CONTROLS.iter().find(|c| c.name == name) else { continue };
        ui.horizontal(|ui| {
            if let Some(value) = slider(ui, control, &format!("{} {name}", l.of(MASK)), now) {
                change(MaskChange::Set(name.into(), Some(value)));
            }
            let plain = ui.small_button("×").on_hover_text(l.of(PLAIN));
            if named(plain, &format!("{} {name} {}", l.of(MASK), l.of(PLAIN))).clicked() {
                change(MaskChange::Set(name.into(), None));
            }
        });
    }
    let held = |name: &str| mask.changes.iter().any(|(known, _)| known == name);
    let all = CONTROLS.iter().filter(|c| !OF_THE_SHEET.contains(&c.name) && !held(c.name));
    let all: Vec<_> = all.map(|c| (c.name, c.doc)).collect();
    if let Some(name) = choice(ui, l.of(HOLDS), "", &all) {
        let now = ink.style.controls.get(&name).unwrap_or_default();
        change(MaskChange::Set(name, Some(now)));
    }
    let brush = |ui: &mut Ui, words: Words, mut value: f32, [least, most]: [f32; 2]| {
        let before = value;
        row(ui, l.of(words), |ui| {
            let slider = Slider::new(&mut value, least..=most).logarithmic(most > 1.0);
            let slider = slider.clamping(SliderClamping::Edits).custom_formatter(|v, _| short(v));
            ui.spacing_mut().slider_width = 100.0;
            named(ui.add(slider), l.of(words));
        });
        (value != before).then_some(value)
    };
    if let Some(radius) = brush(ui, RADIUS, ink.masks.radius, RADII) {
        change(MaskChange::Radius(radius));
    }
    if let Some(strength) = brush(ui, STRENGTH, ink.masks.strength, [WEAKEST, 1.0]) {
        change(MaskChange::Strength(strength));
    }
    ui.horizontal_wrapped(|ui| {
        let mut erase = ink.masks.erases;
        if ui.checkbox(&mut erase, l.of(ERASE)).changed() {
            change(MaskChange::Erase(Some(erase)));
        }
        if ui.add_enabled(ink.masks.can_undo(), egui::Button::new(l.of(UNDO))).clicked() {
            change(MaskChange::Undo);
        }
        if ui.button(l.of(STOP)).clicked() {
            change(MaskChange::Off);
        }
        if ui.button(l.of(REMOVE)).clicked() {
            change(MaskChange::Remove);
        }
    });
}

/// A list of names and what they are; the one that was chosen.
fn choice(ui: &mut Ui, label: &str, now: &str, all: &[(&str, &str)]) -> Option<String> {
    row(ui, label, |ui| {
        let mut chosen = None;
        let list = ComboBox::from_id_salt(("ink", label)).selected_text(now).show_ui(ui, |ui| {
            for (name, doc) in all {
                if ui.selectable_label(*name == now, *name).on_hover_text(*doc).clicked() {
                    chosen = Some(name.to_string());
                }
            }
        });
        named(list.response, label);
        chosen
    })
}

/// The slider of a control; its new value.
fn slider(ui: &mut Ui, control: &Control, label: &str, now: f32) -> Option<f32> {
    row(ui, control.name, |ui| {
        let mut value = now;
        let slider = Slider::new(&mut value, control.min..=control.max)
            .logarithmic(control.min > 0.0)
            .clamping(SliderClamping::Edits)
            .custom_formatter(|v, _| short(v));
        ui.spacing_mut().slider_width = 100.0;
        let about = format!("{}\n{} – {}, {}", control.doc, control.min, control.max, control.default);
        let changed = named(ui.add(slider), label).on_hover_text(about).changed();
        (changed && value != now).then_some(value)
    })
}
