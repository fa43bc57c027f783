//! The panel of settings.

use super::{Asked, Seen, ink, look};
use crate::command::{Bounces, Command, Compare, LightChange, Resolution};
use crate::edit::{Edits, MaterialItem, shown};
use crate::language::{Language, Words};
use crate::live::LiveState;
use crate::state::State;
use egui::{CollapsingHeader, ComboBox, RichText, Slider, SliderClamping, Ui};
use yugen_optics::tonemap::Curve;
use yugen_realtime::Lighting;
use yugen_reflectance::{Kind, Param, ParamType};
use yugen_scene::Value;

const PICTURE: Words = ["Picture", "画像"];
const EXPOSURE: Words = ["exposure", "露出"];
const STOPS: Words = [" stops", " 段"];
const CURVE: Words = ["curve", "カーブ"];
const RESOLUTION: Words = ["resolution", "解像度"];
const LIGHT_PATHS: Words = ["light", "光"];
const ALL_LIGHT: Words = ["all", "全部"];
const PAPER: Words = ["Wakita et al.", "脇田ら"];
const DIRECT: Words = ["direct only", "直接光のみ"];
const CLOTH: Words = ["Cloth", "布"];
const FABRIC: Words = ["fabric", "生地"];
const WIND: Words = ["wind, m/s", "風、m/s"];
const PACE: Words = ["of real time", "（実時間比）"];
const CAMERA: Words = ["Camera", "カメラ"];
const FRAME: Words = ["Frame all", "全体を収める"];
const LIGHTS: Words = ["Lights", "光源"];
const MATERIALS: Words = ["Materials", "材質"];
const RESTORE: Words = ["As the file has them", "ファイルの値に戻す"];
const CLICK: Words = ["click on a surface, or choose one", "面をクリックするか、一覧から選ぶ"];
const TEXTURED: Words = ["from a texture", "テクスチャによる"];
const MODEL: Words = ["model", "モデル"];
const WORN_BY: Words = ["on", "形状"];
const REFERENCE: Words = ["Reference", "参照画像"];
const BESIDE: Words = ["path-traced picture beside it", "経路追跡による画像と比べる"];
const SPLIT: Words = ["either side of a line", "線の左右"];
const FLICKER: Words = ["in turns", "交互"];
const ONLY_REALTIME: Words = ["real-time", "リアルタイムのみ"];
const ONLY_REFERENCE: Words = ["reference", "参照画像のみ"];
const RMSE: Words = ["relative RMSE", "相対 RMSE"];
const FLIP: Words = ["mean FLIP", "平均 FLIP"];
const SAMPLES: Words = ["samples a pixel", "画素あたりのサンプル"];
const SAVE: Words = ["Save", "保存"];
const KEYS: Words = ["All keys", "キー一覧"];
const GRAPH: Words = ["Frame times", "フレーム時間"];

/// Shows it.
pub fn show(ui: &mut Ui, state: &State, seen: &Seen, asked: &mut Asked) {
    let frame = egui::Frame::NONE.fill(look::PANEL).inner_margin(egui::Margin::symmetric(12, 8));
    let panel = egui::Panel::right("settings").frame(frame).default_size(310.0).size_range(260.0..=520.0);
    panel.show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let l = state.language;
            let mut section = |ui: &mut Ui, title: Words, content: &mut dyn FnMut(&mut Ui, &mut Asked)| {
                // Open or not whichever language it is in.
                let header = CollapsingHeader::new(RichText::new(l.of(title)).strong()).id_salt(title[0]);
                header.default_open(true).show(ui, |ui| content(ui, asked));
                ui.add_space(4.0);
            };
            section(ui, PICTURE, &mut |ui, asked| picture(ui, state, asked));
            section(ui, ink::INK, &mut |ui, asked| ink::show(ui, state, seen, asked));
            if let Some(live) = &state.live {
                section(ui, CLOTH, &mut |ui, asked| cloth(ui, state, seen, live, asked));
            }
            section(ui, CAMERA, &mut |ui, asked| camera(ui, state, asked));
            section(ui, LIGHTS, &mut |ui, asked| lights(ui, state, asked));
            section(ui, MATERIALS, &mut |ui, asked| materials(ui, state, asked));
            section(ui, REFERENCE, &mut |ui, asked| reference(ui, state, seen, asked));
            ui.separator();
            files(ui, state, seen, asked);
            ui.add_space(6.0);
            ui.weak(RichText::new(format!("{}\n{}", seen.adapter, seen.surface)).small());
        });
    });
}

/// A name and a control beside it.
pub(super) fn row<R>(ui: &mut Ui, name: &str, control: impl FnOnce(&mut Ui) -> R) -> R {
    ui.horizontal(|ui| {
        let width = 96.0;
        ui.allocate_ui_with_layout(
            egui::vec2(width, ui.spacing().interact_size.y),
            egui::Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(width);
                ui.add(egui::Label::new(name).truncate());
            },
        );
        control(ui)
    })
    .inner
}

fn picture(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    row(ui, l.of(EXPOSURE), |ui| {
        let mut stops = state.exposure;
        let slider = Slider::new(&mut stops, -10.0..=10.0)
            .suffix(l.of(STOPS))
            .clamping(SliderClamping::Edits)
            .custom_formatter(|v, _| format!("{v:.2}"));
        if named(ui.add(slider), l.of(EXPOSURE)).changed() {
            asked.commands.push(Command::Exposure(stops));
        }
    });
    row(ui, l.of(CURVE), |ui| {
        let list = ComboBox::from_id_salt("curve").selected_text(state.curve.name()).show_ui(ui, |ui| {
            for curve in Curve::ALL {
                if ui.selectable_label(curve == state.curve, curve.name()).clicked() {
                    asked.commands.push(Command::Curve(Some(curve)));
                }
            }
        });
        named(list.response, l.of(CURVE));
    });
    row(ui, l.of(RESOLUTION), |ui| {
        let name =
            |r: Resolution| Resolution::ALL.iter().find(|(other, _)| *other == r).map_or("", |(_, n)| *n);
        let list =
            ComboBox::from_id_salt("resolution").selected_text(name(state.resolution)).show_ui(ui, |ui| {
                for (resolution, name) in Resolution::ALL {
                    if ui.selectable_label(resolution == state.resolution, name).clicked() {
                        asked.commands.push(Command::Resolution(Some(resolution)));
                    }
                }
            });
        named(list.response, l.of(RESOLUTION));
    });
    row(ui, l.of(LIGHT_PATHS), |ui| {
        let paper = state.lighting == Lighting::Paper;
        for (bounces, words) in [(Bounces::All, ALL_LIGHT), (Bounces::Most(1), DIRECT)] {
            if ui.selectable_label(!paper && state.bounces == bounces, l.of(words)).clicked() {
                asked.commands.push(Command::Bounces(bounces));
                asked.commands.push(Command::Lighting(Some(Lighting::Full)));
            }
        }
        if ui.selectable_label(paper, l.of(PAPER)).clicked() {
            asked.commands.push(Command::Lighting(Some(Lighting::Paper)));
        }
    });
}

fn cloth(ui: &mut Ui, state: &State, seen: &Seen, live: &LiveState, asked: &mut Asked) {
    let l = state.language;
    row(ui, l.of(FABRIC), |ui| {
        let now = live.settings.fabric.as_str();
        let list = ComboBox::from_id_salt("fabric").selected_text(now).show_ui(ui, |ui| {
            for name in &live.fabrics {
                if ui.selectable_label(*name == now, *name).clicked() {
                    asked.commands.push(Command::Fabric((*name).into()));
                }
            }
        });
        named(list.response, l.of(FABRIC));
    });
    row(ui, l.of(WIND), |ui| {
        let mut wind = live.settings.wind.to_array();
        let mut changed = false;
        for (axis, v) in ["x", "y", "z"].into_iter().zip(&mut wind) {
            let drag = egui::DragValue::new(v).range(-20.0..=20.0).speed(0.05).max_decimals(2);
            let drag = ui.add(drag.clamp_existing_to_range(false));
            changed |= named(drag, &format!("{} {axis}", l.of(WIND))).changed();
        }
        if changed {
            asked.commands.push(Command::Wind(wind.into()));
        }
    });
    if let Some(pace) = seen.pace {
        ui.weak(format!("{:.0} % {}", 100.0 * pace, l.of(PACE)));
    }
}

fn camera(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    ui.horizontal_wrapped(|ui| {
        if ui.button(l.of(FRAME)).clicked() {
            asked.commands.push(Command::Frame);
        }
        let cameras = &state.scene.cameras;
        let name = |i: usize| match cameras.get(i).map(|c| c.name.as_str()) {
            Some("") | None => format!("{}", i + 1),
            Some(name) => name.to_string(),
        };
        let chosen = state.through.map_or("—".to_string(), name);
        let list = ComboBox::from_id_salt("camera").selected_text(chosen).show_ui(ui, |ui| {
            for i in 0..cameras.len() {
                if ui.selectable_label(state.through == Some(i), name(i)).clicked() {
                    asked.commands.push(Command::Camera(Some(name(i))));
                }
            }
        });
        named(list.response, l.of(CAMERA));
    });
    let [x, y, z] = state.eye.position().to_array();
    ui.weak(format!("{x:.3}  {y:.3}  {z:.3}"));
}

fn lights(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    for light in &state.edits.lights {
        ui.horizontal(|ui| {
            let mut on = light.on;
            ui.allocate_ui_with_layout(
                egui::vec2(110.0, ui.spacing().interact_size.y),
                egui::Layout::left_to_right(egui::Align::Center),
                |ui| {
                    ui.set_min_width(110.0);
                    let name = egui::Checkbox::new(&mut on, light.name.as_str());
                    if ui.add(name).on_hover_text(light.kind).changed() {
                        asked
                            .commands
                            .push(Command::Light(light.name.clone(), LightChange::Switch(Some(on))));
                    }
                },
            );
            let mut stops = light.stops;
            ui.spacing_mut().slider_width = 90.0;
            let slider = Slider::new(&mut stops, -6.0..=6.0)
                .suffix(l.of(STOPS))
                .clamping(SliderClamping::Edits)
                .custom_formatter(|v, _| format!("{v:.1}"));
            if named(ui.add_enabled(light.on, slider), &light.name).changed() {
                asked.commands.push(Command::Light(light.name.clone(), LightChange::Stops(stops)));
            }
        });
    }
}

/// What a material is called in the list: its number, who wears it, and its model.
fn title(index: usize, item: &MaterialItem) -> String {
    let mut worn = item.worn_by.iter().take(2).cloned().collect::<Vec<_>>().join(", ");
    if item.worn_by.len() > 2 {
        worn += ", …";
    }
    let worn: String =
        if worn.chars().count() > 24 { worn.chars().take(23).chain(['…']).collect() } else { worn };
    match worn.is_empty() {
        true => format!("{}  {}", index + 1, item.kind.name()),
        false => format!("{}  {worn} · {}", index + 1, item.kind.name()),
    }
}

fn materials(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    let chosen = state.selected.and_then(|i| Some((i, state.materials.get(i)?)));
    let text = chosen.map_or_else(|| l.of(CLICK).to_string(), |(i, item)| title(i, item));
    let list = ComboBox::from_id_salt("material")
        .width(ui.available_width() - 8.0)
        .selected_text(text)
        .show_ui(ui, |ui| {
            for (i, item) in state.materials.iter().enumerate() {
                if ui.selectable_label(state.selected == Some(i), title(i, item)).clicked() {
                    asked.commands.push(Command::Select(Some((i + 1).to_string())));
                }
            }
        });
    named(list.response, l.of(MATERIALS));
    if let Some((index, item)) = chosen {
        let about = |kind: Kind| format!("{}\n{}", kind.source(), kind.doc());
        row(ui, l.of(MODEL), |ui| {
            let now = RichText::new(item.kind.name()).color(look::ACCENT);
            let list = ComboBox::from_id_salt("model").selected_text(now).show_ui(ui, |ui| {
                for kind in Edits::models(&state.scene, item.id) {
                    let entry =
                        ui.selectable_label(kind == item.kind, kind.name()).on_hover_text(about(kind));
                    if entry.clicked() {
                        asked.commands.push(Command::Model((index + 1).to_string(), kind.name().into()));
                    }
                }
            });
            named(list.response, l.of(MODEL)).on_hover_text(about(item.kind));
        });
        if !item.worn_by.is_empty() {
            ui.add(
                egui::Label::new(
                    RichText::new(format!("{}: {}", l.of(WORN_BY), item.worn_by.join(", "))).weak(),
                )
                .truncate(),
            );
        }
        for (i, param) in item.kind.params().iter().enumerate() {
            let Some(value) = state.edits.value(&state.scene, item.id, i) else { continue };
            if let Some(words) = parameter(ui, l, param, &value) {
                asked.commands.push(Command::Material((index + 1).to_string(), param.name.into(), words));
            }
        }
    }
    if !state.edits.is_empty() && ui.button(l.of(RESTORE)).clicked() {
        asked.commands.push(Command::Restore);
    }
}

/// The control of a parameter, made from its row in the table of its model; the words of its new value.
fn parameter(ui: &mut Ui, language: Language, param: &Param, value: &Value) -> Option<Vec<String>> {
    let about = {
        let unit = if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) };
        let default = &param.default[..param.width()];
        match param.kind {
            ParamType::Choice(names) => format!("{}\n{}", param.doc, names.join(", ")),
            _ => format!("{}\n{} – {}{unit}, {:?}", param.doc, param.min, param.max, default),
        }
    };
    let words = |values: &[f32]| values.iter().map(f32::to_string).collect::<Vec<_>>();
    row(ui, param.name, |ui| {
        let Some(mut numbers) = shown(value, param) else {
            ui.weak(language.of(TEXTURED)).on_hover_text(about);
            return None;
        };
        match param.kind {
            ParamType::Choice(names) => {
                let now = names.get(numbers[0] as usize).copied().unwrap_or("");
                let mut chosen = None;
                let list = ComboBox::from_id_salt(param.name).selected_text(now).show_ui(ui, |ui| {
                    for name in names {
                        if ui.selectable_label(*name == now, *name).clicked() {
                            chosen = Some(vec![name.to_string()]);
                        }
                    }
                });
                named(list.response, param.name);
                chosen
            }
            // A colour that goes beyond one is a number of its own, not a colour of paint.
            ParamType::Rgb => {
                let mut changed = false;
                ui.spacing_mut().item_spacing.x = 3.0;
                if param.max <= 1.0 {
                    // egui's colours are those of sRGB; as a patch to choose by, the working space is shown as if it were.
                    let mut rgb = [numbers[0], numbers[1], numbers[2]];
                    if named(ui.color_edit_button_rgb(&mut rgb), param.name).changed() {
                        numbers = rgb.map(|v| v.clamp(param.min, param.max)).to_vec();
                        changed = true;
                    }
                }
                for v in &mut numbers {
                    let drag = egui::DragValue::new(v)
                        .range(param.min..=param.max)
                        .speed(0.005)
                        .max_decimals(3)
                        .clamp_existing_to_range(false);
                    changed |= named(ui.add(drag), param.name).on_hover_text(&about).changed();
                }
                changed.then(|| words(&numbers))
            }
            ParamType::Number => {
                let wide = param.max > 100.0 * param.min.max(1e-3) && param.min >= 0.0;
                let slider = Slider::new(&mut numbers[0], param.min..=param.max)
                    .logarithmic(wide)
                    .smallest_positive(1e-3)
                    // A slider that rounds or clamps changes what nobody has touched.
                    .clamping(SliderClamping::Edits)
                    .custom_formatter(|v, _| short(v))
                    .suffix(if param.unit.is_empty() { String::new() } else { format!(" {}", param.unit) });
                ui.spacing_mut().slider_width = 100.0;
                let changed = named(ui.add(slider), param.name).on_hover_text(about).changed();
                changed.then(|| words(&numbers))
            }
        }
    })
}

fn reference(ui: &mut Ui, state: &State, seen: &Seen, asked: &mut Asked) {
    let l = state.language;
    let mut on = state.reference;
    if ui.checkbox(&mut on, l.of(BESIDE)).changed() {
        asked.commands.push(Command::Reference(Some(on)));
    }
    if !state.reference {
        return;
    }
    comparisons(ui, state, [ONLY_REALTIME, ONLY_REFERENCE], asked);
    let number = |v: Option<f64>, digits: usize| v.map_or("—".to_string(), |v| format!("{v:.digits$}"));
    let fact = |ui: &mut Ui, name: Words, value: String| {
        ui.horizontal(|ui| {
            ui.label(l.of(name));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| ui.monospace(value));
        });
    };
    fact(ui, RMSE, seen.difference.map_or("—".into(), |d| format!("{:.2} %", 100.0 * d.relative_rmse)));
    fact(ui, FLIP, number(seen.difference.map(|d| d.flip), 4));
    fact(ui, SAMPLES, format!("{:.1}", seen.samples));
}

/// How two pictures of these names are seen together.
pub(super) fn comparisons(ui: &mut Ui, state: &State, [one, other]: [Words; 2], asked: &mut Asked) {
    ui.horizontal_wrapped(|ui| {
        for (compare, words) in [
            (Compare::Split, SPLIT),
            (Compare::Flicker, FLICKER),
            (Compare::RealTime, one),
            (Compare::Reference, other),
        ] {
            if ui.selectable_label(state.compare == compare, state.language.of(words)).clicked() {
                asked.commands.push(Command::Compare(Some(compare)));
            }
        }
    });
}

fn files(ui: &mut Ui, state: &State, seen: &Seen, asked: &mut Asked) {
    let l = state.language;
    ui.horizontal_wrapped(|ui| {
        for extension in [".png", ".exr"] {
            if ui.button(format!("{} {extension}", l.of(SAVE))).clicked() {
                asked.commands.push(Command::Save(extension.into()));
            }
        }
        if ui.selectable_label(state.graph, l.of(GRAPH)).clicked() {
            asked.commands.push(Command::Graph(None));
        }
    });
    ui.horizontal_wrapped(|ui| {
        if ui.selectable_label(state.help, l.of(KEYS)).clicked() {
            asked.commands.push(Command::Help(None));
        }
        for language in Language::ALL.into_iter().filter(|_| seen.japanese) {
            if ui.selectable_label(l == language, language.name()).clicked() {
                asked.commands.push(Command::Language(Some(language)));
            }
        }
    });
}

/// With a name for those who hear the window.
pub(super) fn named(response: egui::Response, name: &str) -> egui::Response {
    let id = response.id;
    response.ctx.accesskit_node_builder(id, |node| node.set_label(name.to_string()));
    response
}

/// A number in four digits or so.
pub(super) fn short(v: f64) -> String {
    let digits = if v.abs() >= 100.0 {
        1
    } else if v.abs() >= 10.0 {
        2
    } else {
        4
    };
    let text = format!("{v:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
