//! Frame times: the last frames as a curve, the passes of one as bars.

use super::{Seen, look};
use crate::language::Words;
use crate::state::State;
use egui::{Color32, FontId, Rect, Stroke, Ui, pos2, vec2};

const TITLE: Words = ["milliseconds a frame", "1 フレームのミリ秒"];
const NONE: Words = ["this device has no timestamps", "この GPU にはタイムスタンプがありません"];

/// Shows them in the lower left corner of the picture.
pub fn show(ui: &Ui, state: &State, seen: &Seen, picture: Option<Rect>) {
    let Some(picture) = picture else { return };
    let rows = seen.passes.len().max(1) as f32;
    let size = vec2(300.0, 92.0 + 17.0 * rows);
    let rect = Rect::from_min_size(picture.left_bottom() + vec2(10.0, -10.0 - size.y), size);
    if rect.top() < picture.top() {
        return;
    }
    let painter = ui.painter_at(picture);
    let text =
        |at, words: &str, align| painter.text(at, align, words, FontId::proportional(11.5), look::TEXT);
    painter.rect_filled(rect, 4.0, Color32::from_black_alpha(190));
    text(rect.left_top() + vec2(8.0, 5.0), state.language.of(TITLE), egui::Align2::LEFT_TOP);
    let plot = Rect::from_min_size(rect.left_top() + vec2(8.0, 24.0), vec2(size.x - 16.0, 52.0));
    let most = seen.history.iter().copied().fold(1.0, f32::max);
    text(rect.right_top() + vec2(-8.0, 5.0), &format!("≤ {most:.0} ms"), egui::Align2::RIGHT_TOP);
    painter.hline(plot.x_range(), plot.bottom(), Stroke::new(1.0, Color32::from_gray(70)));
    let count = seen.history.len().max(2) as f32 - 1.0;
    let points = seen.history.iter().enumerate().map(|(i, ms)| {
        pos2(plot.left() + plot.width() * i as f32 / count, plot.bottom() - plot.height() * ms / most)
    });
    painter.line(points.collect(), Stroke::new(1.5, look::ACCENT));
    let mut y = plot.bottom() + 8.0;
    if seen.passes.is_empty() {
        text(pos2(rect.left() + 8.0, y), state.language.of(NONE), egui::Align2::LEFT_TOP);
    }
    let longest = seen.passes.iter().map(|(_, ms)| *ms).fold(1e-6, f64::max);
    for (pass, ms) in &seen.passes {
        let bar =
            Rect::from_min_size(pos2(rect.left() + 90.0, y + 2.0), vec2((130.0 * ms / longest) as f32, 10.0));
        painter.rect_filled(bar, 2.0, look::ACCENT.gamma_multiply(0.7));
        text(pos2(rect.left() + 8.0, y), pass, egui::Align2::LEFT_TOP);
        text(pos2(rect.right() - 8.0, y), &format!("{ms:.2}"), egui::Align2::RIGHT_TOP);
        y += 17.0;
    }
}
