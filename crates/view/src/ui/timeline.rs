//! The strip below the picture of a scene that moves.

use super::{Asked, look};
use crate::command::Command;
use crate::language::Words;
use crate::state::{State, Time};
use egui::{ComboBox, Slider, Ui};

const PLAY: Words = ["Play", "再生"];
const STOP: Words = ["Stop", "停止"];
const ANIMATION: Words = ["animation", "アニメーション"];
const SECONDS: Words = ["seconds", "秒"];

/// Shows it.
pub fn show(ui: &mut Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    let now = state.time.unwrap_or(Time { clip: 0, seconds: state.clips[0].1[0], playing: false });
    let (name, [first, last]) = &state.clips[now.clip.min(state.clips.len() - 1)];
    egui::Panel::bottom("timeline").frame(look::bar()).show_separator_line(false).show(ui, |ui| {
        ui.horizontal(|ui| {
            if ui.button(l.of(if now.playing { STOP } else { PLAY })).clicked() {
                asked.commands.push(Command::Play(Some(!now.playing)));
            }
            let list = ComboBox::from_id_salt("clip").selected_text(name).show_ui(ui, |ui| {
                for (i, (name, _)) in state.clips.iter().enumerate() {
                    if ui.selectable_label(i == now.clip, name).clicked() {
                        asked.commands.push(Command::Clip(Some(name.clone())));
                    }
                }
            });
            super::panel::named(list.response, l.of(ANIMATION));
            ui.spacing_mut().slider_width = (ui.available_width() - 90.0).max(60.0);
            let mut seconds = now.seconds;
            let slider = Slider::new(&mut seconds, *first..=last.max(*first + 1e-3))
                .suffix(" s")
                .custom_formatter(|v, _| format!("{v:.2}"));
            if super::panel::named(ui.add(slider), l.of(SECONDS)).changed() && seconds != now.seconds {
                asked.commands.extend([Command::Play(Some(false)), Command::Seconds(seconds)]);
            }
        });
    });
}
