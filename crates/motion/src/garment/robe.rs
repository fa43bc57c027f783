//! Cuts of robes: their measures and what comes of them.
//!
//! Pieces are rectangles as wide as the loom wove, two of the body, two of the sleeves, half widths at the front edges
//! (okumi), a collar; where cloth is folded away along the collar it is cut here. Each length of cloth is two panels, before and
//! behind the shoulder, so that its pattern stands upright on both.

use super::bolt::{Bolt, Levels, edge, flat};
use super::choken::choken;
use super::{Garment, Side, Wear};
use crate::dance::Parameter;

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
/// to the cuff, a kariginu 1.66 and .82 m; looms wove .36 to .42 m. The defaults are for the player of 1.7 m: a kosode 10 cm longer and 4 cm
/// wider. Collars, cuffs, overlaps and the choken are assumed.
pub const CUTS: &[Cutting] = &[
    Cutting {
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
    },
    Cutting {
        name: "choken",
        measures: &[
            measure("length", 1.15, 0.7, 1.6, "from shoulder to hem"),
            measure("back", 0.33, 0.2, 0.5, "half the back, m"),
            measure("sleeve", 0.52, 0.2, 0.8, "from side to cuff, m"),
            measure("depth", 0.72, 0.4, 0.9, "of the sleeves, from top to bottom"),
            measure("armhole", 0.36, 0.25, 0.6, "how much of the depth is sewn to the body"),
            measure("neck", 0.085, 0.05, 0.12, "half the width of the neck, m"),
            measure(
                "neckline",
                0.26,
                0.15,
                0.5,
                "where the fronts come to the middle, below the shoulder, m",
            ),
            measure("collar", 0.06, 0.03, 0.12, "width of the collar, m"),
            measure("collar_end", 0.80, 0.5, 1.2, "where the collar ends, below the shoulder, m"),
            measure("belt", 0.58, 0.4, 0.9, "where it is tied, below the shoulder, m"),
        ],
        doc: "choken, maiginu: sleeves wide and open at the hand, sides open, fronts that meet",
        make: choken,
    },
];

/// What a belt takes, m.
pub(super) const BELT: f32 = 0.03;

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
    let levels = Levels::new(vec![0.0, cuff, begin, depth, collar_end, length]);
    let [cuff, begin, depth, collar_end] = [cuff, begin, depth, collar_end].map(|v| levels.near(v));
    let marks = |from: f32, to: f32, of: &dyn Fn(f32) -> [f32; 2]| levels.marks(from, to, of);
    let whole = |width: f32| move |_: f32| [0.0, width];
    // A front is as wide as the back at the shoulder, and narrows below the sleeve.
    let side = |v: f32| back - (back - front) * ((v - depth) / (length - depth)).clamp(0.0, 1.0);
    let mut bolt = Bolt::default();
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
    bolt.strip("collar", collar, &path);
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
            depth,
            cuff,
            neck,
            belt: [belt, belt + BELT],
        },
    }
}
