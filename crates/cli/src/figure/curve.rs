//! Curves as a figure shows them: their look, their legend, their peaks.

use super::{Anchor, CURVES, Colour, Dash, Figure, LINE, PAPER, text_width};
use yugen_optics::Vec2;

/// How the curves of one colour are told apart.
const DASHES: [Dash; 4] = [&[], &[9.0, 4.0], &[2.0, 3.0], &[11.0, 3.0, 2.0, 3.0]];
/// As many as colours and dashes tell apart.
pub const MOST: usize = CURVES.len() * DASHES.len();
/// The sample of a line in the legend, and the gap to its name.
const SAMPLE: f32 = 34.0;

/// How a curve is drawn.
#[derive(Clone, Copy)]
pub struct Look {
    pub colour: Colour,
    pub dash: Dash,
}

impl Look {
    /// The look of curve `i` of several: each has its own colour while there are enough, then broken lines begin.
    pub fn nth(i: usize) -> Self {
        Self::of(i, i / CURVES.len())
    }

    /// The look of curve `i` of several that may lie on each other: dashes let the one below show.
    pub fn beside(i: usize) -> Self {
        Self::of(i, i % CURVES.len() + i / CURVES.len())
    }

    /// One of the colours and one of the dashes.
    pub fn of(colour: usize, dash: usize) -> Self {
        Self { colour: CURVES[colour % CURVES.len()], dash: DASHES[dash % DASHES.len()] }
    }
}

/// Values over an angle or another number.
pub struct Curve {
    /// What it is, for the legend.
    pub name: String,
    pub look: Look,
    /// Rising in the first.
    pub points: Vec<(f32, f32)>,
    /// Where it is highest, where it has a peak.
    pub peak: Option<(f32, f32)>,
}

impl Curve {
    /// The highest point between the ends, unless the curve is flat or highest at an end.
    pub fn top(points: &[(f32, f32)]) -> Option<usize> {
        let top = (0..points.len()).max_by(|&a, &b| points[a].1.total_cmp(&points[b].1))?;
        let (first, last) = (points.first()?.1, points.last()?.1);
        // A rise of less than two percent is not what one would call a peak.
        (points[top].1 > 1.02 * first.max(last)).then_some(top)
    }

    fn entry(&self) -> String {
        match self.peak {
            Some((at, _)) => format!("{}, peak at {}", self.name, degrees(at)),
            None => self.name.clone(),
        }
    }
}

/// An angle to a tenth of a degree.
fn degrees(angle: f32) -> String {
    format!("{angle:.1}°")
}

/// A legend below a figure, in as many columns as its longest name allows.
pub struct Legend<'a> {
    entries: Vec<(Look, String)>,
    columns: usize,
    width: f32,
    curves: &'a [Curve],
}

impl<'a> Legend<'a> {
    /// Within `width`. A single curve that has no name needs none.
    pub fn new(curves: &'a [Curve], width: f32) -> Self {
        let entries: Vec<_> =
            curves.iter().filter(|c| !c.name.is_empty()).map(|c| (c.look, c.entry())).collect();
        let longest = entries.iter().map(|(_, text)| text_width(text)).fold(0.0, f32::max);
        let columns = ((width / (longest + SAMPLE + 24.0)) as usize).clamp(1, entries.len().max(1));
        Self { entries, columns, width, curves }
    }

    fn rows(&self) -> usize {
        self.entries
            .iter()
            .map(|(_, text)| if self.columns > 1 { 1 } else { self.lines(text).len() })
            .sum::<usize>()
            .div_ceil(self.columns)
    }

    fn lines(&self, text: &str) -> Vec<String> {
        super::wrapped(text, self.width - SAMPLE)
    }

    pub fn height(&self) -> f32 {
        LINE * self.rows() as f32
    }

    /// Its top left corner stands at `at`.
    pub fn draw(&self, figure: &mut Figure, at: Vec2) {
        let (rows, step) = (self.rows().max(1), self.width / self.columns as f32);
        let mut row = 0;
        for (i, (look, text)) in self.entries.iter().enumerate() {
            let (column, line) = if self.columns > 1 { (i / rows, i % rows) } else { (0, row) };
            let p = at + Vec2::new(step * column as f32, LINE * line as f32 + 14.0);
            let sample = vec![p - Vec2::Y * 5.0, p + Vec2::new(SAMPLE - 8.0, -5.0)];
            figure.broken(sample, look.colour, 2.6, look.dash);
            let lines = if self.columns > 1 { vec![text.clone()] } else { self.lines(text) };
            for (k, line) in lines.iter().enumerate() {
                figure.text(p.x + SAMPLE, p.y + LINE * k as f32, Anchor::Start, line.as_str());
            }
            row += lines.len();
        }
    }

    /// Dots on the peaks with their angles beside them, where there is room; the legend has them all.
    pub fn peaks(&self, figure: &mut Figure, place: &dyn Fn(f32, f32) -> Vec2) {
        let mut taken = figure.texts();
        let mut named: Vec<(Vec2, String)> = Vec::new();
        let peaks: Vec<_> = self.curves.iter().filter_map(|c| c.peak.map(|p| (c, p))).collect();
        for (curve, (x, y)) in &peaks {
            let p = place(*x, *y);
            figure.dot(p, 3.5, curve.look.colour);
            taken.push((p - 5.0, p + 5.0));
        }
        for (curve, (x, y)) in peaks {
            let (p, text) = (place(x, y), degrees(x));
            // Curves that share a peak need its angle once.
            if named.iter().any(|(q, other)| *other == text && q.distance(p) < 6.0) {
                continue;
            }
            named.push((p, text.clone()));
            let width = text_width(&text);
            let spots = [
                (Anchor::Start, Vec2::new(8.0, -6.0)),
                (Anchor::End, Vec2::new(-8.0, -6.0)),
                (Anchor::Start, Vec2::new(10.0, 14.0)),
                (Anchor::Middle, Vec2::new(0.0, -12.0)),
                (Anchor::End, Vec2::new(-10.0, 14.0)),
            ];
            let free = spots.into_iter().find_map(|(anchor, shift)| {
                let low = p + shift + Vec2::new(-anchor.shift() * width, -12.0);
                let high = low + Vec2::new(width, 15.0);
                let hit = taken.iter().any(|(a, b)| a.cmplt(high).all() && low.cmplt(*b).all());
                (!hit && figure.holds(low, high)).then_some((anchor, shift, low, high))
            });
            if let Some((anchor, shift, low, high)) = free {
                let corners = vec![low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
                figure.area(corners, PAPER, 0.75);
                figure.coloured_text(p + shift, anchor, text, curve.look.colour);
                taken.push((low, high));
            }
        }
    }
}
