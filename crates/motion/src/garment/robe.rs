//! Cuts of robes: their measures and what comes of them.
//!
//! Pieces are rectangles as wide as the loom wove, two of the body, two of the sleeves, half widths at the front edges
//! (okumi), a collar; where cloth is folded away along the collar it is cut here. Each length of cloth is two panels, before and
//! behind the shoulder, so that its pattern stands upright on both.

use super::{Edge, Garment, Hang, Mark, Panel, Seam, Side, Wear};
use crate::dance::Parameter;
use glam::Vec2;

/// A cut: its name, its measures and what it is.
pub struct Cutting {
    /// As it is written.
    pub name: &'static str,
    /// In metres; the table's order.
    pub measures: &'static [Parameter],
    /// For people.
    pub doc: &'static str,
    /// Makes one.
    pub make: fn(&[f32]) -> Garment,
}

const fn measure(name: &'static str, default: f32, low: f32, high: f32, doc: &'static str) -> Parameter {
    Parameter { name, default, range: [low, high], doc }
}

/// All cuts.
///
/// Lengths and spans are of robes in museums: a karaori of the 17th century is 1.400 m long and .712 m from the middle of the back
/// to the cuff, a kariginu 1.66 and .82 m; looms wove .36 to .42 m. The defaults are for the player of 1.7 m: 10 cm longer and 4 cm
/// wider. Collars, cuffs and overlaps are assumed.
pub const CUTS: &[Cutting] = &[Cutting {
    name: "kosode",
    measures: &[
        measure("length", 1.50, 0.8, 2.0, "from shoulder to hem"),
        measure("back", 0.33, 0.2, 0.5, "half the back, m"),
        measure("front", 0.27, 0.15, 0.5, "each front at the hem, m"),
        measure("okumi", 0.14, 0.05, 0.4, "the strip at the edge of each front, m"),
        measure("sleeve", 0.42, 0.1, 0.6, "from side to cuff, m"),
        measure("depth", 0.50, 0.2, 0.8, "of the sleeves, from top to bottom"),
        measure("cuff", 0.22, 0.1, 0.5, "how much of the depth is open for the hand"),
        measure("neck", 0.085, 0.05, 0.12, "half the width of the neck, m"),
        measure("collar", 0.07, 0.03, 0.15, "width of the collar, m"),
        measure("collar_end", 0.78, 0.6, 1.2, "where the collar ends, below the shoulder, m"),
        measure("belt", 0.58, 0.4, 0.9, "where it is tied, below the shoulder, m"),
    ],
    doc: "karaori, atsuita, nuihaku: sleeves sewn to the body along their depth, their edges shut up to the hand",
    make: kosode,
}];

/// What a belt takes, m.
const BELT: f32 = 0.03;

/// Pieces as they are laid on the bolt, side by side.
struct Bolt {
    panels: Vec<Panel>,
    seams: Vec<Seam>,
    used: f32,
}

impl Bolt {
    /// Cuts a panel; returns its number.
    fn cut(&mut self, name: &str, across: &[f32], along: Vec<Mark>, hang: Hang) -> usize {
        let width = across[across.len() - 1] - across[0];
        let bolt = Vec2::new(self.used - across[0], 0.0);
        self.used += width + 0.1;
        self.panels.push(Panel { name: name.into(), bolt, across: across.to_vec(), along, hang });
        self.panels.len() - 1
    }

    fn sew(&mut self, a: Edge, b: Edge) {
        self.seams.push([a, b]);
    }
}

fn edge(panel: usize, side: Side, from: f32, to: f32) -> Edge {
    Edge { panel, side, from, to }
}

fn kosode(m: &[f32]) -> Garment {
    let [length, back, front, okumi, sleeve, depth, cuff, neck, collar, collar_end, belt] =
        *m.as_array().unwrap_or(&[0.0; 11]);
    let collar_end = collar_end.min(length - 0.1);
    let (depth, front) = (depth.min(length - 0.2), front.min(back));
    let cuff = cuff.min(depth - 0.05);
    // The collar goes straight from the neck to the edge of the okumi; it leaves the front where the okumi begins.
    let slope = (neck + okumi) / collar_end;
    let begin = neck / slope;
    let collar_at = |v: f32| neck - slope * v;
    let mut levels = vec![0.0, cuff, begin, depth, collar_end, length];
    levels.sort_by(f32::total_cmp);
    levels.dedup_by(|a, b| (*a - *b).abs() < 5e-3);
    // What was merged with a neighbour is where that is.
    let near =
        |v: f32| levels.iter().copied().min_by(|a, b| (a - v).abs().total_cmp(&(b - v).abs())).unwrap_or(v);
    let (cuff, begin, depth, collar_end) = (near(cuff), near(begin), near(depth), near(collar_end));
    let marks = |from: f32, to: f32, of: &dyn Fn(f32) -> [f32; 2]| -> Vec<Mark> {
        let within = levels.iter().filter(|v| (from..=to).contains(*v));
        within.map(|v| (*v, of(*v))).map(|(v, [left, right])| Mark { v, left, right }).collect()
    };
    let whole = |width: f32| move |_: f32| [0.0, width];
    // A front is as wide as the back at the shoulder, and narrows below the sleeve.
    let side = |v: f32| back - (back - front) * ((v - depth) / (length - depth)).clamp(0.0, 1.0);
    let mut bolt = Bolt { panels: Vec::new(), seams: Vec::new(), used: 0.0 };
    let flat = |left: f32, run: f32, front: bool, over: bool| Hang::Flat { left, run, front, over };
    let b_left = bolt.cut(
        "left back",
        &[0.0, back - neck, back],
        marks(0.0, length, &whole(back)),
        flat(back, -1.0, false, false),
    );
    let b_right = bolt.cut(
        "right back",
        &[0.0, neck, back],
        marks(0.0, length, &whole(back)),
        flat(0.0, -1.0, false, false),
    );
    let f_left = bolt.cut(
        "left front",
        &[0.0, neck, back],
        marks(0.0, length, &|v| [if v < begin { collar_at(v) } else { 0.0 }, side(v)]),
        flat(0.0, 1.0, true, true),
    );
    let f_right = bolt.cut(
        "right front",
        &[0.0, back - neck, back],
        marks(0.0, length, &|v| [back - side(v), if v < begin { back - collar_at(v) } else { back }]),
        flat(-back, 1.0, true, false),
    );
    let edge_at = |v: f32| if v < collar_end { collar_at(v).min(0.0) } else { -okumi };
    let o_left = bolt.cut(
        "left okumi",
        &[0.0, okumi],
        marks(begin, length, &|v| [if v <= begin { okumi } else { okumi + edge_at(v) }, okumi]),
        flat(-okumi, 1.0, true, true),
    );
    let o_right = bolt.cut(
        "right okumi",
        &[0.0, okumi],
        marks(begin, length, &|v| [0.0, if v <= begin { 0.0 } else { -edge_at(v) }]),
        flat(0.0, 1.0, true, false),
    );
    use Side::{Bottom, Left, Right, Top};
    // Back, shoulders, sides, fronts.
    bolt.sew(edge(b_left, Right, 0.0, length), edge(b_right, Left, 0.0, length));
    bolt.sew(edge(b_left, Top, back - neck, 0.0), edge(f_left, Top, neck, back));
    bolt.sew(edge(b_right, Top, neck, back), edge(f_right, Top, back - neck, 0.0));
    bolt.sew(edge(b_left, Left, depth, length), edge(f_left, Right, depth, length));
    bolt.sew(edge(b_right, Right, depth, length), edge(f_right, Left, depth, length));
    bolt.sew(edge(f_left, Left, begin, length), edge(o_left, Right, begin, length));
    bolt.sew(edge(f_right, Right, begin, length), edge(o_right, Left, begin, length));
    for (left, body_back, body_front) in [(true, b_left, f_left), (false, b_right, f_right)] {
        let name = |end: &str| format!("{} sleeve, {end}", if left { "left" } else { "right" });
        let all = [0.0, sleeve];
        let span = marks(0.0, depth, &whole(sleeve));
        let [behind, before] = if left {
            [
                bolt.cut(&name("back"), &all, span.clone(), flat(back + sleeve, -1.0, false, false)),
                bolt.cut(&name("front"), &all, span, flat(back, 1.0, true, true)),
            ]
        } else {
            [
                bolt.cut(&name("back"), &all, span.clone(), flat(-back, -1.0, false, false)),
                bolt.cut(&name("front"), &all, span, flat(-back - sleeve, 1.0, true, false)),
            ]
        };
        // Towards the body, and towards the hand, of what is behind; before it is the other way round.
        let (inner, outer) = if left { (Right, Left) } else { (Left, Right) };
        bolt.sew(edge(behind, inner, 0.0, depth), edge(body_back, outer, 0.0, depth));
        bolt.sew(edge(before, outer, 0.0, depth), edge(body_front, inner, 0.0, depth));
        bolt.sew(edge(behind, Top, 0.0, sleeve), edge(before, Top, sleeve, 0.0));
        bolt.sew(edge(behind, Bottom, 0.0, sleeve), edge(before, Bottom, sleeve, 0.0));
        bolt.sew(edge(behind, outer, cuff, depth), edge(before, inner, cuff, depth));
    }
    // The collar, from the end on the wearer's left over the neck to that on the right.
    let path = [
        edge(o_left, Left, collar_end, begin),
        edge(f_left, Left, begin, 0.0),
        edge(b_left, Top, back - neck, back),
        edge(b_right, Top, 0.0, neck),
        edge(f_right, Right, 0.0, begin),
        edge(o_right, Right, begin, collar_end),
    ];
    let strip = |v: f32| Mark { v, left: 0.0, right: collar };
    let mut along = vec![strip(0.0)];
    let mut ends = vec![0.0];
    for edge in &path {
        // Marks are where this cut has put them.
        for length in bolt.panels[edge.panel].lengths(edge).unwrap_or_default() {
            along.push(strip(along[along.len() - 1].v + length));
        }
        ends.push(along[along.len() - 1].v);
    }
    let strip = bolt.cut("collar", &[0.0, collar], along, Hang::Along);
    for (edge_of, ends) in path.into_iter().zip(ends.windows(2)) {
        bolt.sew(edge(strip, Left, ends[0], ends[1]), edge_of);
    }
    Garment {
        name: "kosode".into(),
        panels: bolt.panels,
        seams: bolt.seams,
        wear: Wear {
            length,
            half: back,
            hem: front,
            sleeve,
            armhole: depth,
            cuff,
            neck,
            belt: [belt, belt + BELT],
        },
    }
}
