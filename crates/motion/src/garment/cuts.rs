//! The list of cuts, with their measures.
//!
//! Pieces are rectangles as wide as the loom wove. Each length of cloth is two panels, before and behind the shoulder, so that its
//! pattern stands upright on both.

use super::Garment;
use super::choken::choken;
use super::kariginu::kariginu;
use super::kosode::kosode;
use super::okuchi::okuchi;
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

// What several cuts have.
const BACK: Parameter = measure("back", 0.33, 0.2, 0.5, "half the back, m");
const NECK: Parameter = measure("neck", 0.085, 0.05, 0.12, "half the width of the neck, m");
const DEPTH: Parameter = measure("depth", 0.72, 0.4, 0.9, "of the sleeves, from top to bottom");
const TIED: Parameter = measure("belt", 0.58, 0.4, 0.9, "where it is tied, below the shoulder, m");

/// All cuts.
///
/// Lengths and spans are of robes in museums: a karaori of the 17th century is 1.400 m long and .712 m from the middle of the back
/// to the cuff, a kariginu 1.66 and .82 m; looms wove .36 to .42 m. The defaults are for the player of 1.7 m: a kosode 10 cm longer and 4 cm
/// wider. Hangire, trousers of the same form as okuchi, are 1.135 m long with the band, .86 m wide at the waist. Collars, cuffs, overlaps, the
/// choken and how wide legs are, are assumed.
pub const CUTS: &[Cutting] = &[
    Cutting {
        name: "kosode",
        measures: &[
            measure("length", 1.50, 0.8, 2.0, "from shoulder to hem"),
            BACK,
            measure("front", 0.27, 0.15, 0.5, "each front at the hem, m"),
            measure("okumi", 0.14, 0.05, 0.4, "the strip at the edge of each front, m"),
            measure("sleeve", 0.42, 0.1, 0.6, "from side to cuff, m"),
            measure("depth", 0.50, 0.2, 0.8, "of the sleeves, from top to bottom"),
            measure("cuff", 0.22, 0.1, 0.5, "how much of the depth is open for the hand"),
            NECK,
            measure("collar", 0.07, 0.03, 0.15, "width of the collar, m"),
            measure("collar_end", 0.78, 0.6, 1.2, "where the collar ends, below the shoulder, m"),
            TIED,
        ],
        doc: "karaori, atsuita, nuihaku: sleeves sewn to the body along their depth, their edges shut up to the hand",
        make: kosode,
    },
    Cutting {
        name: "choken",
        measures: &[
            measure("length", 1.15, 0.7, 1.6, "from shoulder to hem"),
            BACK,
            measure("sleeve", 0.52, 0.2, 0.8, "from side to cuff, m"),
            DEPTH,
            measure("armhole", 0.36, 0.25, 0.6, "how much of the depth is sewn to the body"),
            NECK,
            measure(
                "neckline",
                0.26,
                0.15,
                0.5,
                "where the fronts come to the middle, below the shoulder, m",
            ),
            measure("collar", 0.06, 0.03, 0.12, "width of the collar, m"),
            measure("collar_end", 0.80, 0.5, 1.2, "where the collar ends, below the shoulder, m"),
            TIED,
        ],
        doc: "choken, maiginu: sleeves wide and open at the hand, sides open, fronts that meet",
        make: choken,
    },
    Cutting {
        name: "kariginu",
        measures: &[
            measure("length", 1.30, 0.8, 1.7, "from shoulder to hem"),
            measure("back", 0.20, 0.16, 0.3, "half the body, which is one width of the loom, m"),
            measure("sleeve", 0.62, 0.3, 0.8, "from side to cuff, m"),
            DEPTH,
            measure("sewn", 0.20, 0.1, 0.35, "how far below the shoulder sleeves are sewn to the back"),
            NECK,
            measure("neckline", 0.18, 0.12, 0.3, "how deep the neck is cut before, m"),
            measure("collar", 0.04, 0.02, 0.08, "height of the collar, m"),
            TIED,
        ],
        doc: "kariginu: body of one width, wide sleeves sewn to the back alone, round neck, open sides",
        make: kariginu,
    },
    Cutting {
        name: "okuchi",
        measures: &[
            measure("length", 0.90, 0.5, 1.2, "from the waist to the hem"),
            measure("front", 0.38, 0.2, 0.8, "width of each leg before, m"),
            measure("back", 0.36, 0.2, 0.8, "width of each leg behind, m"),
            measure("crotch", 0.45, 0.25, 0.7, "where the legs part, below the waist, m"),
        ],
        doc: "okuchi, hangire, hakama: trousers of four widths, gathered at the waist by their band",
        make: okuchi,
    },
];

/// What a belt takes, m.
pub(super) const BELT: f32 = 0.03;
