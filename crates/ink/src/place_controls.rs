//! The controls place by place: those of the sheet, what tables of the material and of the object make of them, and what masks do.

use crate::control::Controls;
use crate::mask::{Ground, Mask, Place};
use crate::steering::{Names, Steering};
use yugen_scene::prepared::DrawRow;

/// The controls of each draw and the masks that lie on it.
#[derive(Clone, Debug, Default)]
pub struct PlaceControls {
    /// Of what is no draw of the scene.
    sheet: Controls,
    of_draws: Vec<Controls>,
    /// In their order, which is that of the preset: a later one changes what an earlier one has made.
    masks: Vec<Mask>,
    /// Indices of those of each draw.
    of: Vec<Vec<u32>>,
}

impl PlaceControls {
    /// Of draws by a style's controls and tables.
    pub fn new(sheet: &Controls, steering: &Steering, draws: &[DrawRow], names: &Names) -> Self {
        let masks_of = |draw: &DrawRow| {
            (0u32..).zip(&steering.masks).filter(|(_, m)| m.on.has(draw, names)).map(|(i, _)| i).collect()
        };
        let controls = |d: &DrawRow| steering.controls(sheet, names.object(d), names.materials(d));
        Self {
            sheet: *sheet,
            of_draws: draws.iter().map(controls).collect(),
            masks: steering.masks.clone(),
            of: draws.iter().map(masks_of).collect(),
        }
    }

    /// The same controls everywhere.
    pub fn plain(sheet: Controls) -> Self {
        Self { sheet, ..Self::default() }
    }

    /// Those of a draw where no mask holds.
    pub fn of_draw(&self, draw: u32) -> Controls {
        self.of_draws.get(draw as usize).copied().unwrap_or(self.sheet)
    }

    fn masks_of(&self, draw: u32) -> impl Iterator<Item = &Mask> {
        self.of.get(draw as usize).into_iter().flatten().map(|i| &self.masks[*i as usize])
    }

    /// Whether a draw has a mask at all.
    pub fn is_masked(&self, draw: u32) -> bool {
        self.masks_of(draw).next().is_some()
    }

    /// Whether a draw has one on its surface, and so texture coordinates are needed of it.
    pub fn is_on_surface(&self, draw: u32) -> bool {
        self.masks_of(draw).any(|m| m.on != Ground::Picture)
    }

    /// Whether any draw has.
    pub fn has_surfaces(&self) -> bool {
        (0..self.of.len() as u32).any(|draw| self.is_on_surface(draw))
    }

    /// Masks on surfaces that lie on no draw.
    pub fn unmet(&self) -> impl Iterator<Item = &Mask> {
        let lies = |i: u32| self.of.iter().any(|of| of.contains(&i));
        let unmet = (0u32..).zip(&self.masks).filter(move |(i, m)| m.on != Ground::Picture && !lies(*i));
        unmet.map(|(_, mask)| mask)
    }

    /// Changes the controls of a draw to what masks make of them, by how much each of them holds.
    pub fn mask(&self, draw: u32, controls: &mut Controls, much: impl Fn(&Mask) -> f32) {
        self.masks_of(draw).for_each(|mask| mask.apply(controls, much(mask)));
    }

    /// At a place of a draw.
    pub fn at(&self, draw: u32, place: &Place) -> Controls {
        let mut controls = self.of_draw(draw);
        self.mask(draw, &mut controls, |mask| mask.at(place));
        controls
    }

    /// What no place of a draw has more of: the least `size`, of which marks are most, and the greatest of every other control.
    pub fn most(&self, draw: u32) -> Controls {
        let mut most = self.of_draw(draw);
        for (name, value) in self.masks_of(draw).flat_map(|m| m.changes.iter()) {
            let now = most.get(name).unwrap_or(value);
            let _ = most.set(name, if name == "size" { now.min(value) } else { now.max(value) });
        }
        most
    }
}
