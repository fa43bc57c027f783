//! Parts of a stage and what they are called.

use crate::dimension::Basis;
use crate::layout::Layout;
use crate::solid::Solids;
use std::sync::Arc;
use yugen_scene::Mesh;

/// What a part is made of; see `finish`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Finish {
    /// Hinoki of the floors, polished by feet.
    Floor,
    /// Hinoki of pillars and beams, planed and aged.
    Timber,
    /// Cypress bark in layers.
    Bark,
    /// Copper gone brown.
    Copper,
    /// White gravel.
    Gravel,
    /// Trodden earth.
    Earth,
    /// Forged iron.
    Iron,
    /// Split pine, charred.
    Log,
    /// The left third of the painted pine.
    PineLeft,
    /// The middle third.
    PineMiddle,
    /// The right third.
    PineRight,
    /// Painted bamboo.
    BambooPainting,
    /// White lime plaster.
    Plaster,
    /// The lift curtain's five colours.
    Curtain,
    /// Needles of the pines.
    Needles,
    /// Bark of the pines.
    PineBark,
    /// Bamboo poles.
    Bamboo,
    /// Black lacquer, polished.
    Lacquer,
    /// Gilt copper.
    Gilt,
    /// Silk that lines a robe.
    Lining,
    /// The mask of a young woman, painted.
    Omote,
    /// The mask of a demon, painted and gilt.
    Hannya,
    /// Hair of a wig.
    Hair,
    /// Brocade of the band over a wig, and of a sash.
    Band,
    /// Skin.
    Skin,
    /// White silk and cotton under the robe.
    Under,
    /// Gilt paper of a fan.
    Fan,
    /// The cloth of a robe, from maps: see [`crate::Robe`].
    Cloth,
}

impl Finish {
    /// All of them.
    pub const ALL: [Self; 28] = [
        Self::Floor,
        Self::Timber,
        Self::Bark,
        Self::Copper,
        Self::Gravel,
        Self::Earth,
        Self::Iron,
        Self::Log,
        Self::PineLeft,
        Self::PineMiddle,
        Self::PineRight,
        Self::BambooPainting,
        Self::Plaster,
        Self::Curtain,
        Self::Needles,
        Self::PineBark,
        Self::Bamboo,
        Self::Lacquer,
        Self::Gilt,
        Self::Lining,
        Self::Omote,
        Self::Hannya,
        Self::Hair,
        Self::Band,
        Self::Skin,
        Self::Under,
        Self::Fan,
        Self::Cloth,
    ];

    /// In files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Floor => "hinoki_floor",
            Self::Timber => "hinoki_timber",
            Self::Bark => "cypress_bark",
            Self::Copper => "copper",
            Self::Gravel => "gravel",
            Self::Earth => "earth",
            Self::Iron => "iron",
            Self::Log => "log",
            Self::PineLeft => "painted_pine_left",
            Self::PineMiddle => "painted_pine_middle",
            Self::PineRight => "painted_pine_right",
            Self::BambooPainting => "painted_bamboo",
            Self::Plaster => "plaster",
            Self::Curtain => "curtain",
            Self::Needles => "pine_needles",
            Self::PineBark => "pine_bark",
            Self::Bamboo => "bamboo",
            Self::Lacquer => "lacquer",
            Self::Gilt => "gilt",
            Self::Lining => "lining",
            Self::Omote => "omote",
            Self::Hannya => "hannya",
            Self::Hair => "hair",
            Self::Band => "brocade_band",
            Self::Skin => "skin",
            Self::Under => "white_silk",
            Self::Fan => "gilt_paper",
            Self::Cloth => "cloth",
        }
    }

    /// How many materials of a scene it is: a normal map, which shapes name, and what that turns; maps of a cloth are one.
    pub fn materials(self) -> usize {
        if self == Self::Cloth { 1 } else { 2 }
    }
}

/// A part: a closed mesh of one material, with its names.
#[derive(Clone, Debug)]
pub struct Part {
    /// Unique, for annotations; romaji in ASCII.
    pub id: String,
    /// In Japanese.
    pub ja: String,
    /// In Latin letters.
    pub romaji: String,
    /// In English.
    pub en: String,
    /// Of what.
    pub finish: Finish,
    /// In the world.
    pub mesh: Arc<Mesh>,
    /// Measured where all dimensions that shape it are.
    pub basis: Basis,
    /// These dimensions.
    pub dimensions: Vec<&'static str>,
}

/// Names of a part: id, Japanese, romaji, English.
pub type Names<'a> = (&'a str, &'a str, &'a str, &'a str);

/// Parts as they are made.
pub struct Parts<'a> {
    /// Where things are.
    pub layout: &'a Layout,
    /// Made so far.
    pub parts: Vec<Part>,
}

impl Parts<'_> {
    /// One more.
    pub fn add(
        &mut self,
        (id, ja, romaji, en): Names,
        finish: Finish,
        keys: &[&'static str],
        solids: Solids,
    ) {
        let basis = |key: &&str| self.layout.d.entry(key).map(|e| e.basis);
        let measured = !keys.is_empty() && keys.iter().all(|k| basis(k) == Some(Basis::Measured));
        self.parts.push(Part {
            id: id.into(),
            ja: ja.into(),
            romaji: romaji.into(),
            en: en.into(),
            finish,
            mesh: Arc::new(solids.mesh(id)),
            basis: if measured { Basis::Measured } else { Basis::Assumed },
            dimensions: keys.to_vec(),
        });
    }
}
