//! Colours, sizes and fonts: dark and quiet, for the picture is what counts.

use egui::{Color32, Context, CornerRadius, FontData, FontDefinitions, FontFamily, Margin, Stroke, Theme};
use std::sync::Arc;
use yugen_ink::signature::Font;

/// Around the picture.
pub const BEHIND: Color32 = Color32::from_gray(12);
/// Of the panel.
pub const PANEL: Color32 = Color32::from_rgb(24, 25, 27);
/// Of controls.
const CONTROL: Color32 = Color32::from_rgb(45, 47, 50);
/// Text.
pub const TEXT: Color32 = Color32::from_rgb(205, 205, 200);
/// What has been chosen.
pub const ACCENT: Color32 = Color32::from_rgb(201, 160, 92);
/// The line between two pictures.
pub const LINE: Color32 = Color32::from_rgb(230, 190, 120);
/// Something went wrong.
pub const WRONG: Color32 = Color32::from_rgb(238, 120, 92);

/// The frame of a bar at the foot.
pub fn bar() -> egui::Frame {
    egui::Frame::NONE.fill(PANEL).inner_margin(Margin::symmetric(10, 5))
}

/// Sets colours, sizes and fonts; `japanese` stands behind the built-in ones.
pub fn set_look(ctx: &Context, japanese: Option<&Font>) {
    ctx.set_theme(Theme::Dark);
    ctx.all_styles_mut(|style| {
        let v = &mut style.visuals;
        v.panel_fill = PANEL;
        v.window_fill = PANEL;
        v.extreme_bg_color = Color32::from_rgb(16, 17, 18);
        v.faint_bg_color = Color32::from_rgb(30, 31, 33);
        v.override_text_color = None;
        v.selection.bg_fill = Color32::from_rgb(92, 72, 40);
        v.selection.stroke = Stroke::new(1.0, Color32::from_rgb(245, 225, 190));
        v.hyperlink_color = ACCENT;
        v.slider_trailing_fill = true;
        v.window_stroke = Stroke::new(1.0, CONTROL);
        v.window_corner_radius = CornerRadius::same(6);
        v.widgets.noninteractive.fg_stroke.color = TEXT;
        v.widgets.noninteractive.bg_stroke.color = Color32::from_rgb(40, 42, 45);
        v.widgets.inactive.bg_fill = CONTROL;
        v.widgets.inactive.weak_bg_fill = CONTROL;
        v.widgets.inactive.fg_stroke.color = TEXT;
        v.widgets.hovered.weak_bg_fill = Color32::from_rgb(60, 62, 66);
        v.widgets.active.weak_bg_fill = Color32::from_rgb(72, 74, 78);
        // Nothing fades: what is asked for is there.
        style.animation_time = 0.0;
        style.spacing.item_spacing = egui::vec2(8.0, 5.0);
        style.spacing.slider_width = 130.0;
        style.spacing.combo_width = 120.0;
    });
    let Some(font) = japanese else { return };
    let mut fonts = FontDefinitions::default();
    let data = FontData { index: font.index, ..FontData::from_owned(font.bytes.to_vec()) };
    fonts.font_data.insert(font.name.clone(), Arc::new(data));
    for family in [FontFamily::Proportional, FontFamily::Monospace] {
        fonts.families.entry(family).or_default().push(font.name.clone());
    }
    ctx.set_fonts(fonts);
}
