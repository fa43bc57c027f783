//! Garments as they are cut: pieces of cloth as wide as the loom wove them, seams between their edges, a belt; and their
//! wearing, by simulation on a body of capsules that moves.
//!
//! ```text
//! okuchi hemp                                        # trousers, and over them
//! choken length=1.10 sleeve=.55                      # of [`CUTS`], [`STYLES`] and fabrics, as [`outfit`] reads it
//! ```
//! A [`Garment`] is flat. [`Garment::cut`] makes triangles of it, sewn along its seams; [`Costume::dress`] puts it about a
//! [`Body`] with its arms spread, ties it, and lets it settle while the body goes to where a dance begins;
//! [`Costume::step`] then follows the dance.
//!
//! Metres, y up. A wearer faces +z and has +x to the left, as in [`crate::dance`]. Seen from the face of the cloth, u (the
//! weft) runs to the right and v (the warp) down, so that a pattern stands upright and lies straight on the grain.

mod arms;
mod belt;
mod body;
mod bolt;
mod choken;
mod costume;
mod cut;
mod cuts;
mod kariginu;
mod kosode;
mod legs;
mod okuchi;
mod place;
mod slip;
mod style;
mod wearer;
mod words;

pub use arms::Overlap;
pub use body::{Body, Capsule};
pub use costume::{Costume, Fitting};
pub use cut::Cut;
pub use cuts::{CUTS, Cutting};
pub use style::{STYLES, Style};
pub use wearer::Wearer;
pub use words::{outfit, parse};

use crate::cloth::{ClothError, Fabric};
use glam::Vec2;

/// A garment as it lies flat: pieces, and what is sewn to what.
#[derive(Clone, Debug, PartialEq)]
pub struct Garment {
    /// As in [`CUTS`].
    pub name: String,
    /// Its pieces.
    pub panels: Vec<Panel>,
    /// Pairs of edges.
    pub seams: Vec<Seam>,
    /// How it is worn.
    pub wear: Wear,
    /// What it is made of, where it is not of what the fitting says.
    pub fabric: Option<Fabric>,
}

/// A piece of cloth between two lines along the warp, straight or slanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// For people.
    pub name: String,
    /// Where on the bolt it is cut: its (0, 0) in (u, v) of the cloth, m.
    pub bolt: Vec2,
    /// Marks across, u from the lowest, m: columns of triangles go through each.
    pub across: Vec<f32>,
    /// Marks along the warp, v from the lowest, m, and from which to which u the piece reaches there; in between it goes over
    /// linearly.
    pub along: Vec<Mark>,
    /// Where it is about the wearer.
    pub hang: Hang,
}

/// A mark along the warp of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Where, m.
    pub v: f32,
    /// The least u of the piece there, m.
    pub left: f32,
    /// The greatest.
    pub right: f32,
}

/// Where a panel is when the garment is arranged about the wearer: to the left of the wearer, below the top of the shoulders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hang {
    /// A point (u, v) is `from` + `run` u to the left, v below the shoulder.
    Flat {
        /// Where u begins, m to the left of the wearer's middle.
        from: f32,
        /// 1 or −1: whether u runs to the wearer's left.
        run: f32,
        /// On the front, else on the back.
        front: bool,
        /// The wearer's left front, which comes to lie on top of the right one.
        left: bool,
    },
    /// On a leg of trousers: a point (u, v) is `from` − u along the waist, counted from the middle of the back to the left, v below
    /// the waist.
    Leg {
        /// Where u begins, m.
        from: f32,
        /// The wearer's left leg, else the right.
        left: bool,
        /// Before, else behind.
        front: bool,
    },
    /// A strip along what its left edge (u = 0) is sewn to, towards the wearer's neck.
    Along,
}

/// An edge of a panel, from a mark to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Index of the panel.
    pub panel: usize,
    /// Which edge.
    pub side: Side,
    /// v of a mark where the seam begins, or u for those across, m.
    pub from: f32,
    /// And where it ends.
    pub to: f32,
}

/// An edge's place on its panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// At the least u.
    Left,
    /// At the greatest.
    Right,
    /// At the least v.
    Top,
    /// At the greatest.
    Bottom,
}

/// Two edges that are one: where the first begins the second begins.
pub type Seam = [Edge; 2];

/// How a garment is worn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wear {
    /// From shoulder to hem, m.
    pub length: f32,
    /// From the middle of the back to the side, m.
    pub half: f32,
    /// From the middle of the front to the side at the hem, m.
    pub hem: f32,
    /// From the side to the cuff, m; none for a garment without sleeves.
    pub sleeve: f32,
    /// How far below the shoulder front and back begin to be one tube about the trunk, m.
    pub armhole: f32,
    /// How far below the shoulder the sleeve ends, m.
    pub depth: f32,
    /// How far below the shoulder the cuff is open, m.
    pub cuff: f32,
    /// Half the width of the neck, m.
    pub neck: f32,
    /// What a belt takes of it: from and to so far below the shoulder, or below the waist of trousers, m.
    pub belt: [f32; 2],
    /// What it is about the wearer.
    pub form: Form,
    /// Whether the right arm is out of its sleeve, and the shoulder bare of the robe.
    pub bare: bool,
}

/// What a garment is about the wearer, and so how it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// A robe that is sewn at its sides: a tube about the trunk, the left front over the right.
    Wrapped,
    /// A robe with open sides, and fronts that hang beside each other: two sheets, before and behind.
    Open,
    /// Such a robe whose front is one, and whose sleeves are sewn to the back alone.
    Fastened,
    /// Trousers. Of their measures all but belt and length are nought.
    Trousers(Legs),
}

impl Form {
    /// Of trousers.
    pub fn legs(self) -> Option<Legs> {
        match self {
            Self::Trousers(legs) => Some(legs),
            Self::Wrapped | Self::Open | Self::Fastened => None,
        }
    }

    /// Whether it begins as two sheets, before and behind.
    fn sheets(self) -> bool {
        matches!(self, Self::Open | Self::Fastened)
    }
}

/// How trousers go about two legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legs {
    /// Around a leg, and from the middle of the back to the middle of the front, m.
    pub round: f32,
    /// How far below the waist legs part, m.
    pub crotch: f32,
}

/// Why there is no such garment, or nobody can wear it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GarmentError {
    /// A number of the fitting that is out of range.
    #[error("the {name} of a fitting are {value}; expected {low} to {high}")]
    Fitting {
        /// Which.
        name: &'static str,
        /// As given.
        value: f32,
        /// Least.
        low: f32,
        /// Greatest.
        high: f32,
    },
    /// An edge without marks, or a panel that is none.
    #[error("panel '{panel}' of a garment {problem}")]
    Panel {
        /// Its name.
        panel: String,
        /// What is wrong.
        problem: String,
    },
    /// Edges that do not belong together.
    #[error(
        "a seam joins {have:.3} m of '{from}' to {want:.3} m of '{to}'; edges as long as each other were expected"
    )]
    Seam {
        /// Name of the first panel.
        from: String,
        /// Length of its edge, m.
        have: f32,
        /// Name of the second.
        to: String,
        /// Length of its edge, m.
        want: f32,
    },
    /// Triangles that are too large or too small.
    #[error(
        "garments in triangles of {edge:.3} m have {count:.0} vertices; from 100 to {most} are possible, with edges of .004 to .1 m"
    )]
    Edge {
        /// Asked for, m.
        edge: f32,
        /// What it would take.
        count: f64,
        /// The most there may be.
        most: usize,
    },
    /// A body that is none.
    #[error("a body for a garment {0}")]
    Body(String),
    /// A body that cannot wear one of them.
    #[error("a body for the {garment} {problem}")]
    Wearing {
        /// Its name.
        garment: String,
        /// What is wrong.
        problem: String,
    },
    /// An outfit of no garments.
    #[error("there is no garment to put on")]
    Nothing,
    /// Whoever was told how far it is did not want more.
    #[error("putting a garment on was stopped")]
    Stopped,
    /// What the cloth says.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A text that is no garment.
    #[error("line {line}: {problem}")]
    Text {
        /// From one.
        line: usize,
        /// What was found and what was expected.
        problem: String,
    },
}
