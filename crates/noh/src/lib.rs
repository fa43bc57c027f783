//! The Noh stage (nōbutai), made from a table of dimensions: [`DIMENSIONS`] says what each is, in which range, and
//! whether it is measured or assumed; [`PRESETS`] are stages that stand or stood. A [`Stage`] has its parts as closed
//! meshes with their names, its fires, and, as a [`yugen_scene::Scene`], materials, seats and light.
//!
//! Lengths are metres, angles in the table degrees. The origin is the middle of the main floor's surface; +y is up, +z
//! points to the front seats, −x to the left of who sits there. Photometric numbers stand for radiometric ones, as in
//! glTF's reader: a candela is 1 W/sr, so that fires, moon and sky keep their proportions.

mod bridge;
mod dimension;
mod finish;
mod fire_stand;
mod garden;
mod layout;
mod painting;
mod part;
mod pattern;
mod performance;
pub mod player;
mod preset;
mod robe;
mod roof;
mod sash;
mod sculpt;
pub mod solid;
mod timber;
mod view;

pub use dimension::{Basis, DIMENSIONS, Dimension, Dimensions, Entry, MeasuredAt, StageError};
pub use finish::Gloss;
pub use fire_stand::FireStand;
pub use layout::Layout;
pub use part::{Finish, Part};
pub use performance::{Costume, Performance, ROBE};
pub use preset::{PRESETS, Preset, RoofCover, RoofForm};
pub use robe::{Robe, RobeError};
pub use view::{EXPOSURE, FIRE_CANDELA, FIRE_KELVIN, FireLight, Hour, SceneError};

/// A stage, built.
#[derive(Clone, Debug)]
pub struct Stage {
    layout: Layout,
    parts: Vec<Part>,
    robe: Option<Robe>,
    player: Vec<player::Piece>,
}

impl Stage {
    /// Builds it. An error where the dimensions cannot be together.
    pub fn new(preset: &'static Preset, dimensions: Dimensions) -> Result<Self, StageError> {
        dimensions.check()?;
        let layout = Layout::new(preset, dimensions);
        let mut out = part::Parts { layout: &layout, parts: Vec::new() };
        timber::parts(&mut out);
        roof::parts(&mut out);
        bridge::parts(&mut out);
        garden::parts(&mut out);
        fire_stand::parts(&mut out);
        let parts = out.parts;
        Ok(Self { layout, parts, robe: None, player: Vec::new() })
    }

    /// With a robe on a rack in the middle of the main floor, its back to the front seats; in place of one that hangs
    /// there already.
    pub fn with_robe(mut self, robe: Robe) -> Self {
        if self.robe.replace(robe).is_none() {
            let mut out = part::Parts { layout: &self.layout, parts: std::mem::take(&mut self.parts) };
            robe::parts(&mut out);
            self.parts = out.parts;
        }
        self
    }

    /// With a player in this mask, whose robe is of this cloth; [`Performance`] moves it.
    pub fn with_player(mut self, mask: &player::Mask, cloth: Robe) -> Self {
        self.robe = Some(cloth);
        self.player = player::pieces(mask);
        self
    }

    /// Parts of the player, if there is one.
    pub fn player(&self) -> &[player::Piece] {
        &self.player
    }

    /// The cloth of the robe that hangs there or that the player wears, if there is one.
    pub fn robe(&self) -> Option<&Robe> {
        self.robe.as_ref()
    }

    /// A preset as it stands in the table.
    pub fn preset(name: &str) -> Result<Self, StageError> {
        let preset = Preset::find(name)?;
        Self::new(preset, preset.dimensions())
    }

    /// Where its main lines run, and its dimensions.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Its parts, each closed and of one material.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Its fires.
    pub fn fires(&self) -> [FireStand; 4] {
        fire_stand::fires(&self.layout)
    }
}
