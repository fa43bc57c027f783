//! Ways to wear a robe.

use super::Wear;

/// A way to wear a robe.
pub struct Style {
    /// As it is written.
    pub name: &'static str,
    /// For people.
    pub doc: &'static str,
    /// What becomes of how it is worn.
    pub change: fn(&mut Wear),
}

/// What is drawn up over the belt, m: assumed.
const TUCK: f32 = 0.20;

/// All of them; the first where none is named.
pub const STYLES: &[Style] = &[
    Style { name: "kinagashi", doc: "straight, both arms in their sleeves", change: |_| {} },
    Style {
        name: "tsubo-ori",
        doc: "drawn up by 20 cm, which hang over the belt",
        change: |wear| wear.belt = wear.belt.map(|v| v + TUCK),
    },
    Style {
        name: "nugisage",
        doc: "slipped off the right shoulder, its sleeve hanging behind",
        change: |wear| wear.bare = true,
    },
];
