//! Drawings of a weave: the draft as weavers write it, and the chart of what lies on top.

use crate::figure::{Anchor, Colour, Figure};
use anyhow::Result;
use yugen_archive::formats::wif::{Draft, Shedding};
use yugen_capture::weave::Weave;
use yugen_optics::tonemap::{Curve, ToneMap};
use yugen_optics::{ColourSpace, Vec2, Vec3};

const FILLED: Colour = [40, 44, 52];
const EMPTY: Colour = [255, 255, 255];
const LINE: Colour = [214, 216, 220];
const MARGIN: f32 = 20.0;
/// Room for a line of text.
const TEXT: f32 = 24.0;

/// Squares, `across` by `up` of them, counted from the lower left, each `cell` pixels wide.
struct Grid {
    across: usize,
    up: usize,
    cell: usize,
}

impl Grid {
    fn size(&self) -> Vec2 {
        Vec2::new((self.across * self.cell) as f32, (self.up * self.cell) as f32)
    }

    /// `colour(column, row, place within the square)`, the place from its lower left.
    fn draw(
        &self,
        figure: &mut Figure,
        at: Vec2,
        colour: impl Fn(usize, usize, [usize; 2]) -> Colour,
    ) -> Result<()> {
        let (width, height, cell) = (self.across * self.cell, self.up * self.cell, self.cell);
        let pixel = |i: usize| {
            let (x, y) = (i % width, height - 1 - i / width);
            colour(x / cell, y / cell, [x % cell, y % cell])
        };
        let pixels: Vec<Colour> = (0..width * height).map(pixel).collect();
        figure.picture(at, self.size(), width as u32, &pixels)
    }

    /// Filled and empty squares with lines between them where there is room for lines.
    fn fill(&self, figure: &mut Figure, at: Vec2, filled: impl Fn(usize, usize) -> bool) -> Result<()> {
        let lined = self.cell >= 5;
        self.draw(figure, at, |column, row, [x, y]| {
            match (lined && (x == 0 || y == 0), filled(column, row)) {
                (true, _) => LINE,
                (_, true) => FILLED,
                _ => EMPTY,
            }
        })
    }
}

fn shown(colour: Vec3, space: ColourSpace) -> Colour {
    let display = ToneMap::new(space, 0.0, Curve::Clip).show(colour);
    display.to_array().map(|v| (255.0 * v).round() as u8)
}

/// Threading below, treadling to the right, tie-up in the corner: the cloth lies as it is woven, first pick at the
/// bottom.
pub fn draft(draft: &Draft, space: ColourSpace) -> Result<Figure> {
    let weave = Weave::of(draft);
    let (ends, picks, shafts) = (weave.ends(), weave.picks(), draft.shafts);
    let (columns, treadling, tie_up) = match &draft.shedding {
        Shedding::Treadles { tie_up, treadling } => (tie_up.len(), treadling, Some(tie_up)),
        Shedding::LiftPlan(plan) => (shafts, plan, None),
    };
    let cell = (1000 / (ends + columns).max(picks + shafts)).clamp(1, 16);
    let grid = |across, up| Grid { across, up, cell };
    let (cloth, threading) = (grid(ends, picks), grid(ends, shafts));
    let (pressed, tied) = (grid(columns, picks), grid(columns, shafts));
    // A row of the threads' colours runs along each side.
    let bar = cell.max(6) as f32;
    let gap = 4.0;
    let (right, below) =
        (MARGIN + cloth.size().x + bar + 2.0 * gap, MARGIN + TEXT + cloth.size().y + bar + 2.0 * gap);
    let width = (right + pressed.size().x + MARGIN).max(720.0);
    let mut figure = Figure::new(width, below + threading.size().y + 2.0 * MARGIN + TEXT);
    let title = if draft.title.is_empty() { "draft" } else { &draft.title };
    figure.text(MARGIN, MARGIN + 10.0, Anchor::Start, title);
    let top = Vec2::new(MARGIN, MARGIN + TEXT);
    cloth.fill(&mut figure, top, |e, p| weave.up(e, p))?;
    for (i, thread) in draft.warp.iter().enumerate() {
        let x = MARGIN + (i * cell) as f32;
        let y = below - gap - bar;
        let corners = [(x, y), (x + cell as f32, y), (x + cell as f32, y + bar), (x, y + bar)];
        figure.area(corners.map(Vec2::from).to_vec(), shown(thread.colour, space), 1.0);
    }
    for (i, thread) in draft.weft.iter().enumerate() {
        let x = right - gap - bar;
        let y = top.y + cloth.size().y - ((i + 1) * cell) as f32;
        let corners = [(x, y), (x + bar, y), (x + bar, y + cell as f32), (x, y + cell as f32)];
        figure.area(corners.map(Vec2::from).to_vec(), shown(thread.colour, space), 1.0);
    }
    // Shaft 1 and treadle 1 lie next to the cloth.
    let is = |list: &[u32], n: usize| list.contains(&(n as u32));
    threading.fill(&mut figure, Vec2::new(MARGIN, below), |e, s| is(&draft.threading[e], shafts - s))?;
    if columns > 0 {
        pressed.fill(&mut figure, Vec2::new(right, top.y), |t, p| is(&treadling[p], t + 1))?;
    }
    if let Some(tie_up) = tie_up {
        tied.fill(&mut figure, Vec2::new(right, below), |t, s| is(&tie_up[t], shafts - s))?;
    }
    let shed = if draft.rising { "rising" } else { "sinking" };
    let loom = match tie_up {
        Some(tie_up) => format!("{} treadles", tie_up.len()),
        None => "lift plan".into(),
    };
    let text =
        format!("{ends} ends, {picks} picks, {shafts} shafts, {loom}, {shed} shed; black: warp on top");
    figure.text(MARGIN, below + threading.size().y + MARGIN, Anchor::Start, text);
    Ok(figure)
}

/// What lies on top at every crossing, in the colours of the threads.
pub fn chart(draft: &Draft, space: ColourSpace) -> Result<Figure> {
    let weave = Weave::of(draft);
    let (ends, picks) = (weave.ends(), weave.picks());
    let grid = Grid { across: ends, up: picks, cell: (1000 / ends.max(picks)).clamp(1, 24) };
    let colours = |threads: &[yugen_archive::formats::wif::Thread]| -> Vec<Colour> {
        threads.iter().map(|t| shown(t.colour, space)).collect()
    };
    let (warp, weft) = (colours(&draft.warp), colours(&draft.weft));
    let size = grid.size();
    let mut figure = Figure::new((size.x + 2.0 * MARGIN).max(240.0), size.y + 2.0 * MARGIN + TEXT);
    let title = if draft.title.is_empty() { "weave" } else { &draft.title };
    figure.text(
        MARGIN,
        MARGIN + 10.0,
        Anchor::Start,
        format!("{title}: one repeat, first pick at the bottom"),
    );
    grid.draw(&mut figure, Vec2::new(MARGIN, MARGIN + TEXT), |e, p, [x, y]| {
        let up = weave.up(e, p);
        let colour = if up { warp[e] } else { weft[p] };
        // A thread is darker along its sides.
        let across = if up { x } else { y };
        let side = grid.cell >= 4 && (across == 0 || across + 1 == grid.cell);
        if side { colour.map(|v| (f32::from(v) * 0.6) as u8) } else { colour }
    })?;
    Ok(figure)
}
