//! Colours for values, with the bar that says which is which.

use super::scale::{Scale, digits};
use super::{Anchor, Colour, Figure, INK, text_width};
use anyhow::Result;
use yugen_optics::Vec2;

/// Width of a bar.
const BAR: f32 = 18.0;
/// Its cells.
const CELLS: usize = 256;

/// Grey from black to white.
pub fn grey(t: f32) -> Colour {
    [(255.0 * t.clamp(0.0, 1.0)).round() as u8; 3]
}

/// From blue over white to orange for −1, 0 and 1: apart for people who see few colours, and on a grey print zero is
/// the lightest.
pub fn two_sided(t: f32) -> Colour {
    const ENDS: [[f32; 3]; 2] = [[0.0, 74.0, 140.0], [176.0, 72.0, 0.0]];
    let end = ENDS[usize::from(t > 0.0)];
    let t = t.abs().min(1.0);
    end.map(|e| (250.0 + (e - 250.0) * t).round() as u8)
}

/// How much room a bar needs, its numbers and its label included.
pub fn bar_width(ticks: &[f32]) -> f32 {
    BAR + 14.0 + ticks.iter().map(|t| text_width(&digits(*t))).fold(0.0, f32::max) + 26.0
}

/// A bar with `colour(t)` for t from 0 at its foot to 1, and numbers at `ticks` (their place in 0 to 1 beside each).
pub fn bar(
    figure: &mut Figure,
    at: Vec2,
    height: f32,
    colour: &dyn Fn(f32) -> Colour,
    ticks: &[(f32, f32)],
    label: &str,
) -> Result<()> {
    let cells: Vec<Colour> = (0..CELLS).rev().map(|i| colour((i as f32 + 0.5) / CELLS as f32)).collect();
    figure.picture(at, Vec2::new(BAR, height), 1, &cells)?;
    let (low, high) = (at, at + Vec2::new(BAR, height));
    figure.line(vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y), low], INK, 1.0);
    let mut widest = 0.0f32;
    let mut last = f32::INFINITY;
    for (value, place) in ticks {
        let y = high.y - height * place;
        figure.line(vec![Vec2::new(high.x, y), Vec2::new(high.x + 5.0, y)], INK, 1.0);
        if last - y > 16.0 {
            let text = digits(*value);
            widest = widest.max(text_width(&text));
            figure.text(high.x + 9.0, y + 5.0, Anchor::Start, text);
            last = y;
        }
    }
    figure.upwards(high.x + 9.0 + widest + 16.0, at.y + 0.5 * height, label);
    Ok(())
}

/// The numbers of a bar from zero to `top`.
pub fn ticks(scale: Scale, top: f32) -> Vec<(f32, f32)> {
    let low = if scale == Scale::Log { vec![] } else { vec![(0.0, 0.0)] };
    let rest = scale.ticks(top).into_iter().filter(|t| *t <= top).map(|t| (t, scale.unit(t, top)));
    low.into_iter().chain(rest).collect()
}
