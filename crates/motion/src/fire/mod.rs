//! Fire as a volume that emits and absorbs light: flames of wood in an iron basket, as a function of time alone.
//!
//! In the lineage of Fuller, Krishnan, Mahrous, Hamann and Joy 2007, "Real-Time Procedural Volumetric Fire" (I3D): a bent
//! axis, a profile around it and improved noise that rises with the gas; with sizes and frequencies of fires that were
//! measured, and the light of soot by Planck's law. [`Fire`] says what burns; [`Fire::light`] checks it and measures how
//! much soot gives the light that it should; [`Burning::at`] is an instant; [`Flame::grid`] makes cells of it, and these
//! are what is rendered, what lights the scene ([`Grid::power`], [`Grid::blobs`]) and what flickers.
//!
//! Metres, seconds, kelvin; luminance in cd/m², flux in lm.

mod grid;

use glam::Vec3;
pub use grid::{Along, Grid};

/// How a fire moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Flicker {
    /// Not at all: one instant for ever.
    Still,
    /// Slowly, with a light that hardly changes: for those whom flicker makes ill. The light stays far below the tenth of
    /// change at which WCAG 2.2 (success criterion 2.3.1) begins to speak of a flash.
    Reduced,
    /// As a fire does.
    #[default]
    Full,
}

impl Flicker {
    /// Every way.
    pub const ALL: [Self; 3] = [Self::Still, Self::Reduced, Self::Full];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Reduced => "reduced",
            Self::Full => "full",
        }
    }

    /// The one called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// One fire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fire {
    /// The middle of the fuel bed's floor.
    pub foot: Vec3,
    /// Against gravity, of any length.
    pub up: Vec3,
    /// Of the fuel bed, m.
    pub diameter: f32,
    /// Heat release, kW.
    pub power: f32,
    /// Mean luminous intensity for each kilowatt, cd/kW.
    pub candela: f32,
    /// Velocity of the air, m/s.
    pub wind: Vec3,
    /// Fires of different seeds move differently.
    pub seed: u32,
    /// How it moves.
    pub flicker: Flicker,
}

/// A number of a fire: its default, range and where they come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// As in [`Fire`] and scene files.
    pub name: &'static str,
    /// Where nothing is said.
    pub default: f32,
    /// Least and most.
    pub range: [f32; 2],
    /// Of all three.
    pub unit: &'static str,
    /// What it is, and the source of the default.
    pub about: &'static str,
}

/// The numbers of a fire, and the only place where their defaults and ranges stand.
pub const PARAMETERS: [Parameter; 4] = [
    Parameter {
        name: "diameter",
        default: 0.45,
        range: [0.05, 3.0],
        unit: "m",
        about: "width of the fuel bed. Assumed: baskets of kagaribi are .40 to .50 m wide at the rim; no measured source was found",
    },
    Parameter {
        name: "power",
        default: 100.0,
        range: [2.0, 2000.0],
        unit: "kW",
        about: "heat release. Assumed: with the diameter it makes flames a metre high (Heskestad), as photographs of kagaribi have them",
    },
    Parameter {
        name: "candela",
        default: 20.0,
        range: [1.0, 100.0],
        unit: "cd/kW",
        about: "mean luminous intensity for each kilowatt. Computed: .3 of the power is radiated, .62 to 1.03 lm/W (black bodies of 1800 to 1900 K), over 4π: 15 to 25; luminance times area of a flame gives 18",
    },
    Parameter {
        name: "wind",
        default: 0.0,
        range: [0.0, 12.0],
        unit: "m/s",
        about: "speed of the air. Assumed: beyond Beaufort 6 nobody lights a fire in the open",
    },
];

impl Default for Fire {
    fn default() -> Self {
        let [diameter, power, candela, _] = PARAMETERS.map(|p| p.default);
        Self {
            foot: Vec3::ZERO,
            up: Vec3::Y,
            diameter,
            power,
            candela,
            wind: Vec3::ZERO,
            seed: 0,
            flicker: Flicker::Full,
        }
    }
}

/// Why a fire cannot burn, or a flame not be made cells of.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FireError {
    /// A number out of its range, or none.
    #[error("the {name} of a fire is {value} {unit}; it lies between {low} and {high} {unit}")]
    Range {
        /// Of [`PARAMETERS`].
        name: &'static str,
        /// What was given.
        value: f32,
        /// Its unit.
        unit: &'static str,
        /// The least it may be.
        low: f32,
        /// And the most.
        high: f32,
    },
    /// A place that is none, or an up without direction.
    #[error(
        "{name} of a fire is {value}; it needs three finite numbers, not further than 1e6 from zero{more}"
    )]
    Vector {
        /// Which vector.
        name: &'static str,
        /// What was given.
        value: Vec3,
        /// What else it needs.
        more: &'static str,
    },
    /// Cells without number, or too many.
    #[error(
        "a grid of {x} x {y} x {z} cells cannot be made; it has at least {} along each axis and at most {} in all",
        Grid::FEWEST,
        Grid::MOST
    )]
    Cells {
        /// Along x.
        x: u32,
        /// Along y.
        y: u32,
        /// Along z.
        z: u32,
    },
}

impl Fire {
    /// Whether everything is within its range.
    pub fn check(&self) -> Result<(), FireError> {
        let numbers = [self.diameter, self.power, self.candela, self.wind.length()];
        for (p, value) in PARAMETERS.iter().zip(numbers) {
            let [low, high] = p.range;
            if !(low..=high).contains(&value) {
                return Err(FireError::Range { name: p.name, value, unit: p.unit, low, high });
            }
        }
        let near = |v: Vec3| v.is_finite() && v.abs().max_element() <= 1e6;
        if !near(self.foot) {
            return Err(FireError::Vector { name: "the foot", value: self.foot, more: "" });
        }
        if !near(self.up) || self.up.length() < 1e-6 {
            return Err(FireError::Vector { name: "the up", value: self.up, more: " and a direction" });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_within_their_ranges_and_what_is_absurd_is_told_in_a_sentence() {
        assert_eq!(Fire::default().check(), Ok(()));
        let fire = Fire::default();
        for (wrong, says) in [
            (Fire { power: 0.0, ..fire }, "the power of a fire is 0 kW; it lies between 2 and 2000 kW"),
            (Fire { power: f32::NAN, ..fire }, "the power of a fire is NaN kW"),
            (Fire { diameter: -1.0, ..fire }, "the diameter of a fire is -1 m"),
            (Fire { candela: f32::INFINITY, ..fire }, "the candela of a fire is inf cd/kW"),
            (Fire { wind: Vec3::new(0.0, f32::NAN, 1.0), ..fire }, "the wind of a fire is NaN m/s"),
            (Fire { wind: Vec3::X * 40.0, ..fire }, "the wind of a fire is 40 m/s"),
            (
                Fire { foot: Vec3::NAN, ..fire },
                "the foot of a fire is [NaN, NaN, NaN]; it needs three finite",
            ),
            (Fire { up: Vec3::ZERO, ..fire }, "from zero and a direction"),
        ] {
            let said = wrong.check().unwrap_err().to_string();
            assert!(said.contains(says), "{said}");
        }
        for flicker in Flicker::ALL {
            assert_eq!(Flicker::from_name(flicker.name()), Some(flicker));
        }
    }
}
