//! Curves over two straight axes.

use super::curve::{Curve, Legend};
use super::scale::{Scale, digits};
use super::{Anchor, Figure, INK, LINE, RULE, text_width};
use yugen_optics::Vec2;

/// The area that curves take.
const PLOT: Vec2 = Vec2::new(600.0, 380.0);
/// Letters and their gaps at the left of the axis, besides its numbers.
const LEFT: f32 = 46.0;
const RIGHT: f32 = 30.0;

/// The axis that runs across.
pub struct Across {
    pub label: String,
    pub low: f32,
    pub high: f32,
    /// From a number to the next.
    pub step: f32,
    /// Behind each number.
    pub unit: &'static str,
}

impl Across {
    /// Degrees.
    pub fn degrees(label: impl Into<String>, low: f32, high: f32) -> Self {
        let span = high - low;
        let step = [2.0, 5.0, 10.0, 15.0, 30.0].into_iter().find(|s| span / s <= 12.0).unwrap_or(60.0);
        Self { label: label.into(), low, high, step, unit: "°" }
    }
}

/// A chart without its curves.
pub struct Chart {
    /// What it shows, a line each.
    pub heading: Vec<String>,
    pub across: Across,
    pub upwards: String,
    pub scale: Scale,
    /// The upper end of the axis that runs up.
    pub top: f32,
    /// Values that a dashed line marks.
    pub marks: Vec<f32>,
    /// Places across that a dashed line marks, with what stands at its upper end.
    pub posts: Vec<(f32, &'static str)>,
}

impl Chart {
    pub fn draw(&self, curves: &[Curve]) -> Figure {
        let ticks: Vec<f32> = self.scale.ticks(self.top).into_iter().filter(|t| *t <= self.top).collect();
        let numbers = ticks.iter().map(|t| text_width(&digits(*t))).fold(text_width("0"), f32::max);
        let left = LEFT + numbers;
        let width = left + PLOT.x + RIGHT;
        let legend = Legend::new(curves, width - 40.0);
        let lines: Vec<&str> = self.heading.iter().map(String::as_str).collect();
        let head: usize = lines.iter().map(|l| super::wrapped(l, width - 40.0).len()).sum();
        let posts = if self.posts.is_empty() { 0.0 } else { LINE };
        let above = 26.0 + LINE * head as f32 + posts;
        let below = 60.0 + legend.height() + 14.0;
        let mut figure = Figure::new(width, above + PLOT.y + below);
        figure.heading(&lines);

        let corner = Vec2::new(left, above);
        let unit = |v: f32| self.scale.unit(v, self.top);
        let across = |x: f32| (x - self.across.low) / (self.across.high - self.across.low);
        let at = |x: f32, v: f32| corner + PLOT * Vec2::new(across(x), 1.0 - unit(v));
        let floor = corner.y + PLOT.y;
        let mut last = f32::INFINITY;
        for tick in ticks {
            let y = at(self.across.low, tick).y;
            figure.line(vec![Vec2::new(left, y), Vec2::new(left + PLOT.x, y)], RULE, 0.8);
            // Near the floor of a curved scale numbers would stand on each other.
            if last - y > 0.9 * LINE {
                figure.text(left - 8.0, y + 5.0, Anchor::End, digits(tick));
                last = y;
            }
        }
        if self.scale != Scale::Log {
            figure.text(left - 8.0, floor + 5.0, Anchor::End, "0");
        }
        let first = (self.across.low / self.across.step).ceil() as i32;
        let count = (self.across.high / self.across.step).floor() as i32;
        for x in (first..=count).map(|i| i as f32 * self.across.step) {
            let x_at = at(x, 0.0).x;
            figure.line(vec![Vec2::new(x_at, corner.y), Vec2::new(x_at, floor)], RULE, 0.8);
            figure.text(x_at, floor + LINE, Anchor::Middle, format!("{}{}", digits(x), self.across.unit));
        }
        for frame in [
            vec![corner, Vec2::new(left, floor), corner + PLOT],
            vec![corner, Vec2::new(left + PLOT.x, corner.y), corner + PLOT],
        ] {
            figure.line(frame, INK, 1.0);
        }
        for &v in &self.marks {
            figure.dashes(vec![at(self.across.low, v), at(self.across.high, v)], INK, 1.0);
        }
        for &(x, name) in &self.posts {
            let x_at = at(x, 0.0).x;
            figure.broken(vec![Vec2::new(x_at, corner.y), Vec2::new(x_at, floor)], INK, 0.9, &[2.0, 4.0]);
            figure.text(x_at, corner.y - 7.0, Anchor::Middle, name);
        }
        for curve in curves {
            let mut line: Vec<Vec2> = curve.points.iter().map(|(x, v)| at(*x, *v)).collect();
            // What lies closer together than the eye can tell makes a file large and nothing else.
            line.dedup_by(|next, kept| next.distance_squared(*kept) < 0.06);
            figure.broken(line, curve.look.colour, 2.2, curve.look.dash);
        }
        legend.peaks(&mut figure, &at);
        figure.text(left + 0.5 * PLOT.x, floor + 46.0, Anchor::Middle, self.across.label.as_str());
        figure.upwards(22.0, corner.y + 0.5 * PLOT.y, self.upwards.as_str());
        legend.draw(&mut figure, Vec2::new(20.0, floor + 60.0));
        figure
    }
}
