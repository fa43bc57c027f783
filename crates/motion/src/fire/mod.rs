//! Fire as a volume that emits and absorbs light: flames of wood in an iron basket, as a function of time alone.
//!
//! In the lineage of Fuller, Krishnan, Mahrous, Hamann and Joy 2007, "Real-Time Procedural Volumetric Fire" (I3D): a bent
//! axis, a profile around it and improved noise that rises with the gas; with sizes and frequencies of fires that were
//! measured, and the light of soot by Planck's law. [`Fire`] says what burns; [`Fire::light`] checks it and measures how
//! much soot gives the light that it should; [`Burning::at`] is an instant; [`Flame::grid`] makes cells of it, and these
//! are what is rendered, what lights the scene ([`Grid::slabs`]) and what flickers.
//!
//! Metres, seconds, kelvin; luminance in cd/m², flux in lm.

mod blobs;
mod directivity;
mod escape;
mod flame;
mod grid;
mod logs;
mod pulse;
mod soot;
mod sparks;

pub use blobs::{Blob, Slab};
pub use directivity::{DIRECTIVITY_WGSL, Directivity};
pub use flame::{FIRE_WGSL, Flame, Medium};
use glam::Vec3;
pub use grid::{Along, Grid};
pub use logs::Logs;
pub use sparks::Spark;
use std::sync::Arc;
use yugen_optics::ColourSpace;

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
    /// Mean luminous intensity around the fire, past its logs, for each kilowatt, cd/kW.
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
        about: "mean luminous intensity around the fire, across its up and past its logs, for each kilowatt. Computed: .3 of the power is radiated, .62 to 1.03 lm/W (black bodies of 1800 to 1900 K), over 4π: 15 to 25; luminance times area of a flame gives 18",
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
        /// Which number: the name of one of [`PARAMETERS`], or of a window of time.
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
    /// A flame that would be a jet.
    #[error(
        "a fire of {diameter} m and {power} kW would be {length:.1} m long, more than {} times its width; wood does not burn so: \
         make it wider or weaker",
        Fire::SLENDER
    )]
    Slender {
        /// Its width, m.
        diameter: f32,
        /// Its power, kW.
        power: f32,
        /// The flame's length, m.
        length: f32,
    },
    /// More light than such a flame can give.
    #[error(
        "a fire of {diameter} m and {power} kW cannot give {candela} cd/kW: even as a body that lets no light through its flame is \
         too small or too cool; lower candela"
    )]
    TooBright {
        /// Its width, m.
        diameter: f32,
        /// Its power, kW.
        power: f32,
        /// What was asked for, cd/kW.
        candela: f32,
    },
    /// So dense that its soot was not found in a few rounds.
    #[error(
        "how much soot gives a fire of {diameter} m and {power} kW its {candela} cd/kW was not found in {} rounds, the last of \
         which changed it by {change:.1} %: its flame is so dense that more soot hardly makes it brighter; lower candela",
        ROUNDS
    )]
    Unsettled {
        /// Its width, m.
        diameter: f32,
        /// Its power, kW.
        power: f32,
        /// What was asked for, cd/kW.
        candela: f32,
        /// Of the last round, percent.
        change: f64,
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
    /// How many diameters a flame may be long. Assumed: cribs of wood come to five or so.
    pub const SLENDER: f32 = 10.0;

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
        let length = flame::length(self.diameter, self.power);
        if length > Self::SLENDER * self.diameter {
            return Err(FireError::Slender { diameter: self.diameter, power: self.power, length });
        }
        Ok(())
    }
}

/// A fire that has been checked and knows how much soot gives its light.
#[derive(Clone, Debug)]
pub struct Burning {
    fire: Fire,
    shape: flame::Shape,
    pulse: pulse::Pulse,
    glow: Arc<soot::Soot>,
    embers: soot::Soot,
    /// What the flame emits in the mean, over 4π, with soot of 1/m; nought until it is known.
    emission: f64,
    /// Absorption of dense soot, 1/m.
    soot: f32,
}

/// How strong the pulse is, and how fast the flame's time runs, where flicker is reduced. Chosen by the test of its light.
const REDUCED: [f64; 2] = [0.07, 0.35];
/// The moment at which a still fire stands, s.
const STILL: f64 = 5.0;
/// Instants by which a fire is measured before it burns.
const INSTANTS: u32 = 32;
/// Rounds in which its soot settles, each to a quarter of the step before, where flames are dense to half of it.
const ROUNDS: u32 = 12;
/// By how much it may still change in the last of them.
const UNSETTLED: f64 = 0.01;

impl Fire {
    /// Checks the fire and measures its light over 32 instants: soot is scaled so that the mean intensity around the fire,
    /// past its logs, is [`Fire::candela`] times [`Fire::power`]. Colours will be in `space`. Takes about .3 s.
    ///
    /// # Errors
    /// What [`Fire::check`] says, and more light than the flame can give.
    pub fn light(&self, space: ColourSpace) -> Result<Burning, FireError> {
        self.check()?;
        let mut burning = Burning {
            fire: *self,
            shape: flame::Shape::new(self),
            pulse: pulse::Pulse::new(self.seed, self.diameter),
            glow: Arc::new(soot::Soot::new(space)),
            embers: soot::Soot::black(space),
            emission: 0.0,
            soot: 1.0,
        };
        let target = f64::from(self.candela * self.power);
        let weights = space.luminance_weights().as_dvec3();
        let instants = if self.flicker == Flicker::Still { 1 } else { INSTANTS };
        // Spread over a minute without a rhythm of their own.
        let instant = |i: u32| f64::from(i) * 60.0 * 0.618_034;
        let emission = (0..instants).map(|i| burning.at(instant(i)).measured()).sum::<f64>();
        burning.emission = emission / f64::from(instants);
        let logs = burning.logs();
        let samples: Vec<(Grid, Vec<f32>)> = (0..instants)
            .map(|i| {
                let flame = burning.at(instant(i));
                let [lower, upper] = flame.bounds();
                let edge = ((upper - lower).element_product() / 2.5e4).cbrt();
                let mut grid = flame.grid(flame.cells(edge))?;
                logs.fill(&mut grid);
                let smoke = grid.centres().map(|p| flame.medium(p).smoke).collect();
                Ok((grid, smoke))
            })
            .collect::<Result<_, FireError>>()?;
        let emitted = samples.iter().map(|(grid, _)| weights.dot(grid.emitted())).sum::<f64>();
        let of = emitted / (4.0 * std::f64::consts::PI);
        // What soot keeps of its own light grows with it, and logs keep a part.
        let [mut soot, mut change] = [0.0f64, f64::INFINITY];
        for _ in 0..ROUNDS {
            let mut out = 0.0;
            for (thin, smoke) in &samples {
                let mut grid = thin.clone();
                for (cell, smoke) in grid.data.iter_mut().zip(smoke) {
                    cell[3] = (cell[3] - smoke).max(0.0) * soot as f32 + smoke;
                }
                out += weights.dot(grid.intensity_around(self.up.as_dvec3()));
            }
            let kept: f64 = if of > 0.0 { (out / of).max(1e-6) } else { 1.0 };
            let last = std::mem::replace(&mut soot, target / (burning.emission * kept));
            change = (soot / last - 1.0).abs();
            if change < 2e-3 {
                break;
            }
        }
        // Denser than 300/m a flame is a surface to its cells.
        if !(soot > 0.0 && soot < 300.0) {
            let Self { diameter, power, candela, .. } = *self;
            return Err(FireError::TooBright { diameter, power, candela });
        }
        if change > UNSETTLED {
            let Self { diameter, power, candela, .. } = *self;
            return Err(FireError::Unsettled { diameter, power, candela, change: 100.0 * change });
        }
        burning.soot = soot as f32;
        Ok(burning)
    }
}

impl Burning {
    /// What burns.
    pub fn fire(&self) -> &Fire {
        &self.fire
    }

    /// The flame at `seconds` from the start, before or after; the same bits for the same second, in any order.
    pub fn at(&self, seconds: f64) -> Flame {
        let (seconds, strength) = self.moment(seconds);
        Flame::new(self, seconds, strength)
    }

    /// The fire's own time at `seconds`, and how strong its pulse is.
    fn moment(&self, seconds: f64) -> (f64, f64) {
        let seconds = if seconds.is_finite() { seconds } else { 0.0 };
        match self.fire.flicker {
            Flicker::Still => (STILL, 0.0),
            Flicker::Reduced => (seconds * REDUCED[1], REDUCED[0]),
            Flicker::Full => (seconds, 1.0),
        }
    }

    /// Radiance of a black body of `kelvin`, as the logs and sparks of a fire are nearly: linear RGB in its colour space, its
    /// luminance in cd/m². Charcoal has .9 of it.
    pub fn glow(&self, kelvin: f32) -> Vec3 {
        self.embers.light(kelvin)
    }

    /// Length of the flame by Heskestad's law, m: so far up there is flame half of the time.
    pub fn length(&self) -> f32 {
        self.shape.length
    }

    /// The rate at which it puffs, Hz.
    pub fn puffing(&self) -> f64 {
        pulse::puffing(self.fire.diameter)
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
            (
                Fire { diameter: 0.1, power: 500.0, ..fire },
                "would be 2.7 m long, more than 10 times its width",
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
