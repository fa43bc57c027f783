//! All actions with their keys, over the picture.

use super::{Asked, look};
use crate::action::{ACTIONS, Group};
use crate::command::Command;
use crate::language::Words;
use crate::state::State;
use egui::{RichText, Ui};

const TITLE: Words = ["Everything that can be done", "できること一覧"];

/// Shows them.
pub fn show(ui: &Ui, state: &State, asked: &mut Asked) {
    let l = state.language;
    let screen = ui.ctx().content_rect();
    let mut open = true;
    egui::Window::new(l.of(TITLE))
        .open(&mut open)
        .id(egui::Id::unique("help"))
        .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .collapsible(false)
        .resizable(false)
        .frame(egui::Frame::window(&ui.ctx().global_style()).fill(look::PANEL.gamma_multiply(0.97)))
        .show(ui.ctx(), |ui| {
            let height = (screen.height() - 110.0).max(120.0);
            let area = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            area.show(ui, |ui| {
                ui.set_width((screen.width() - 80.0).clamp(240.0, 760.0));
                for (group, title) in Group::ALL {
                    ui.add_space(4.0);
                    ui.label(RichText::new(l.of(title)).strong().color(look::ACCENT));
                    egui::Grid::new(title[0]).num_columns(2).spacing([16.0, 3.0]).min_col_width(170.0).show(
                        ui,
                        |ui| {
                            for action in ACTIONS.iter().filter(|a| a.group == group) {
                                let keys: Vec<String> = action.keys.iter().map(|b| b.shown()).collect();
                                let keys = if keys.len() > 6 {
                                    format!("{} … {}", keys[0], keys[keys.len() - 1])
                                } else {
                                    keys.join("  ")
                                };
                                ui.vertical(|ui| {
                                    if keys.is_empty() {
                                        ui.weak(RichText::new(action.name).monospace());
                                    } else {
                                        ui.label(RichText::new(keys).monospace());
                                    }
                                });
                                ui.vertical(|ui| ui.add(egui::Label::new(l.of(action.does)).wrap()));
                                ui.end_row();
                            }
                        },
                    );
                }
            });
        });
    if !open {
        asked.commands.push(Command::Help(Some(false)));
    }
}
