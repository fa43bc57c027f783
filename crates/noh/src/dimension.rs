//! Every dimension of a stage: what it means, its range, its value, and where that is from. The one table that the
//! generator, the command line and the manual read.

use std::fmt;

/// How sure a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// A published source gives it.
    Measured,
    /// Nobody whom we know of has published it; chosen by what is usual.
    Assumed,
}

impl Basis {
    /// As files and tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Assumed => "assumed",
        }
    }
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Dimension {
    /// For `--set` and in files.
    pub key: &'static str,
    /// m, degrees, or nothing for a count.
    pub unit: &'static str,
    /// Where no preset says otherwise.
    pub default: f32,
    /// Smallest.
    pub min: f32,
    /// Largest.
    pub max: f32,
    /// Of the default.
    pub basis: Basis,
    /// Of the default: author or institution, or what the assumption rests on.
    pub source: &'static str,
    /// What it is.
    pub doc: &'static str,
}

use Basis::{Assumed, Measured};

const fn row(
    key: &'static str,
    unit: &'static str,
    [default, min, max]: [f32; 3],
    basis: Basis,
    source: &'static str,
    doc: &'static str,
) -> Dimension {
    Dimension { key, unit, default, min, max, basis, source, doc }
}

const JAANUS: &str = "JAANUS, 'butai': 5.7 m square; National Noh Theatre: 5.4 m";
const NOHBUTAI: &str = "nohbutai.com, on the building of Noh stages";
const USUAL: &str = "usual in photographs of stages; no dimensioned source was found";
const KAGARIBI: &str = "no dimensioned source was found; after photographs of modern stands";
const RACK: &str = "no dimensioned source was found; after photographs of racks in museums";

/// All dimensions.
pub const DIMENSIONS: &[Dimension] = &[
    row(
        "width",
        "m",
        [5.4, 5.0, 6.2],
        Measured,
        JAANUS,
        "of the main stage across, seen from the front seats",
    ),
    row("depth", "m", [5.4, 5.0, 6.2], Measured, JAANUS, "of the main stage from front to back"),
    row(
        "floor_height",
        "m",
        [0.88, 0.75, 1.0],
        Measured,
        "T. Nogami: about three feet",
        "of the floor above the ground, at the middle of the main stage",
    ),
    row(
        "floor_rake",
        "degrees",
        [0.5, 0.0, 1.5],
        Assumed,
        "that the floor falls to the front is known; by how much is not published",
        "fall of the main floor to the front",
    ),
    row(
        "board_width",
        "m",
        [0.36, 0.30, 0.45],
        Assumed,
        USUAL,
        "of a board of the main floor, nearly: a whole number of them fills the width",
    ),
    row(
        "board_thickness",
        "m",
        [0.055, 0.054, 0.09],
        Measured,
        NOHBUTAI,
        "of a floor board: 1 sun 8 bu and more",
    ),
    row(
        "atoza_depth",
        "m",
        [2.7, 2.1, 2.95],
        Measured,
        "Osaka Noh glossary: 1.5 ken by 3 ken; nohbutai.com: 2.1 to 2.7 m",
        "of the rear seat, whose boards run across",
    ),
    row(
        "jiutai_width",
        "m",
        [0.95, 0.85, 1.1],
        Measured,
        "half a ken by three ken, National Noh Theatre's glossary",
        "of the chorus seat beside the main stage",
    ),
    row(
        "bridge_length",
        "m",
        [13.5, 5.5, 13.5],
        Measured,
        NOHBUTAI,
        "of the bridge on its middle line, from the stage to the curtain",
    ),
    row(
        "bridge_width",
        "m",
        [2.1, 1.7, 2.8],
        Measured,
        NOHBUTAI,
        "of the bridge between the middles of its pillars",
    ),
    row(
        "bridge_angle",
        "degrees",
        [26.0, 0.0, 60.0],
        Measured,
        "National Noh Theatre, after ht-atelier.com",
        "from the line of the stage's rear edge to the bridge; 0: straight to the side",
    ),
    row(
        "bridge_rake",
        "degrees",
        [0.5, 0.0, 2.0],
        Assumed,
        "that the bridge is slightly raked is known; by how much is not published",
        "fall of the bridge from the stage to the curtain",
    ),
    row(
        "bridge_bays",
        "",
        [3.0, 2.0, 12.0],
        Measured,
        "nohbutai.com: two pillars on each side between the ends",
        "bays of the bridge between its pillars",
    ),
    row("rail_height", "m", [0.5, 0.3, 0.8], Assumed, USUAL, "of the rails of bridge and chorus seat"),
    row(
        "curtain_height",
        "m",
        [2.73, 2.4, 3.2],
        Measured,
        "nohbutai.com: at least nine shaku",
        "of the lift curtain at the end of the bridge",
    ),
    row("pillar", "m", [0.21, 0.18, 0.25], Assumed, USUAL, "side of the main pillars' square section"),
    row("pillar_chamfer", "m", [0.02, 0.005, 0.05], Assumed, USUAL, "what is cut off their corners"),
    row(
        "pillar_height",
        "m",
        [3.4, 3.2, 3.7],
        Assumed,
        USUAL,
        "of the main pillars from the floor to the underside of the head ties",
    ),
    row("bridge_pillar", "m", [0.15, 0.12, 0.2], Assumed, USUAL, "side of the bridge's pillars"),
    row(
        "bridge_pillar_height",
        "m",
        [2.9, 2.5, 3.3],
        Assumed,
        USUAL,
        "of the bridge's pillars from its floor to their beams",
    ),
    row(
        "roof_pitch",
        "degrees",
        [40.0, 28.0, 45.0],
        Assumed,
        USUAL,
        "of the main roof, from the eaves beam to the ridge",
    ),
    row(
        "roof_curve",
        "",
        [0.62, 0.4, 1.0],
        Assumed,
        USUAL,
        "slope of the roof at its edge as a part of the pitch's: less than 1 sags",
    ),
    row("eaves", "m", [1.2, 0.9, 1.8], Assumed, USUAL, "how far the main roof stands out from the pillars"),
    row("bark_thickness", "m", [0.25, 0.06, 0.4], Assumed, USUAL, "of the roof's cover at its edges"),
    row("rafter_spacing", "m", [0.3, 0.2, 0.5], Assumed, USUAL, "between the middles of rafters"),
    row(
        "steps",
        "",
        [3.0, 2.0, 5.0],
        Measured,
        "JAANUS, 'shirasu-bashigo': three steps",
        "treads of the steps at the front",
    ),
    row("steps_width", "m", [0.9, 0.6, 1.4], Assumed, USUAL, "of the steps"),
    row(
        "gravel_width",
        "m",
        [1.5, 0.9, 3.0],
        Assumed,
        USUAL,
        "of the strip of white gravel around stage and bridge",
    ),
    row(
        "gravel_albedo",
        "",
        [0.55, 0.5, 0.6],
        Assumed,
        "white marble or granite chippings when dry; role in lighting: nohbutai.com",
        "mean reflectance of the gravel, which throws light up",
    ),
    row(
        "pine_ichi",
        "m",
        [1.6, 1.0, 2.2],
        Assumed,
        "that the pines shrink away from the stage is known; heights are not published",
        "height of the first pine, nearest to the stage",
    ),
    row("pine_ni", "m", [1.4, 0.9, 2.2], Assumed, "as the first", "height of the second pine"),
    row("pine_san", "m", [1.2, 0.8, 2.2], Assumed, "as the first", "height of the third pine"),
    row(
        "fire_rim",
        "m",
        [1.4, 0.45, 1.6],
        Assumed,
        KAGARIBI,
        "height of a fire basket's rim above the ground; in 2014 those of Kofuku-ji stood knee-high",
    ),
    row("fire_basket", "m", [0.45, 0.3, 0.6], Assumed, KAGARIBI, "width of a fire basket at its rim"),
    row(
        "fire_distance",
        "m",
        [1.75, 1.5, 3.0],
        Assumed,
        KAGARIBI,
        "of the front fires from the corners of the stage, on the diagonal's x and z alike",
    ),
    row(
        "robe_length",
        "m",
        [1.4, 1.2, 1.7],
        Measured,
        "Tokugawa Art Museum 125, karaori of the 17th century",
        "of a robe from the shoulder to the hem (take)",
    ),
    row(
        "robe_half_span",
        "m",
        [0.712, 0.6, 0.84],
        Measured,
        "Tokugawa Art Museum 125, karaori of the 17th century",
        "of a robe from the centre of the back to the cuff (yuki): half a back and a sleeve, as wide as each other",
    ),
    row(
        "robe_loom",
        "m",
        [0.38, 0.34, 0.43],
        Measured,
        "M. Bethe, Ritsumeikan ArtWiki: about 38 cm in the Edo period",
        "width of the cloth of a robe as it is woven; what a panel does not show lies in its seams",
    ),
    row(
        "robe_sleeve",
        "m",
        [0.53, 0.4, 0.75],
        Assumed,
        "usual in photographs of karaori; no dimensioned source was found",
        "height of a robe's sleeve, sewn to the body all along",
    ),
    row(
        "robe_collar",
        "m",
        [0.065, 0.05, 0.09],
        Assumed,
        "usual in photographs of karaori; no dimensioned source was found",
        "width of a robe's collar, folded",
    ),
    row(
        "rack_height",
        "m",
        [1.68, 1.4, 2.0],
        Assumed,
        RACK,
        "of the rack (iko) from the floor to the top of its rail",
    ),
    row("rack_width", "m", [1.56, 1.3, 1.9], Assumed, RACK, "of the rack between its posts"),
];

/// One of three ways to measure a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeasuredAt {
    /// Between the inner faces of pillars (kyōma).
    Inside,
    /// Between their middles.
    Centre,
    /// Between their outer faces (inaka-ma).
    Outside,
}

impl MeasuredAt {
    /// As tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inside => "inside the pillars",
            Self::Centre => "between the middles of the pillars",
            Self::Outside => "outside the pillars",
        }
    }
}

/// What a dimension is in one stage.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Value in its unit.
    pub value: f32,
    /// Of the value.
    pub basis: Basis,
    /// Of the value.
    pub source: &'static str,
}

/// Why there is no such stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StageError {
    /// A preset that does not exist.
    #[error("there is no stage called '{name}'{hint}")]
    Preset {
        /// As given.
        name: String,
        /// End of the sentence.
        hint: String,
    },
    /// A dimension that does not exist.
    #[error("a stage has no dimension '{name}'{hint}")]
    Unknown {
        /// As given.
        name: String,
        /// End of the sentence.
        hint: String,
    },
    /// Outside its range.
    #[error("{key} = {value} is out of range; {doc}: {min} to {max}{unit}")]
    Range {
        /// Which.
        key: &'static str,
        /// As given.
        value: f32,
        /// What it is.
        doc: &'static str,
        /// Smallest.
        min: f32,
        /// Largest.
        max: f32,
        /// With a space before it.
        unit: String,
    },
    /// Dimensions that cannot be together.
    #[error("{0}")]
    Contradiction(String),
}

/// Values of all dimensions.
#[derive(Clone, Debug)]
pub struct Dimensions {
    entries: Vec<Entry>,
}

impl Default for Dimensions {
    fn default() -> Self {
        let entry = |d: &Dimension| Entry { value: d.default, basis: d.basis, source: d.source };
        Self { entries: DIMENSIONS.iter().map(entry).collect() }
    }
}

fn index(key: &str) -> Option<usize> {
    DIMENSIONS.iter().position(|d| d.key == key)
}

impl Dimensions {
    /// A dimension by its key. Only keys of [`DIMENSIONS`] exist; for others the value is NaN, which no test passes.
    pub fn get(&self, key: &str) -> f32 {
        index(key).map_or(f32::NAN, |i| self.entries[i].value)
    }

    /// With where it is from.
    pub fn entry(&self, key: &str) -> Option<Entry> {
        index(key).map(|i| self.entries[i])
    }

    /// All of them in the order of the table.
    pub fn iter(&self) -> impl Iterator<Item = (&'static Dimension, Entry)> + '_ {
        DIMENSIONS.iter().zip(self.entries.iter().copied())
    }

    pub(crate) fn put(&mut self, key: &str, entry: Entry) {
        if let Some(i) = index(key) {
            self.entries[i] = entry;
        }
    }

    /// Sets one; `side` sets both `width` and `depth`.
    pub fn set(&mut self, key: &str, value: f32) -> Result<(), StageError> {
        if key == "side" {
            self.set("width", value)?;
            return self.set("depth", value);
        }
        let Some(i) = index(key) else {
            let known = DIMENSIONS.iter().map(|d| d.key).chain(["side"]);
            return Err(StageError::Unknown { name: key.into(), hint: yugen_scene::suggest(key, known) });
        };
        let Dimension { key, unit, min, max, doc, .. } = DIMENSIONS[i];
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        if !(min..=max).contains(&value) {
            return Err(StageError::Range { key, value, doc, min, max, unit });
        }
        if matches!(key, "steps" | "bridge_bays") && value.fract() != 0.0 {
            return Err(StageError::Contradiction(format!(
                "{key} = {value} is a count; give a whole number"
            )));
        }
        self.entries[i] = Entry { value, basis: Basis::Assumed, source: "given by hand" };
        Ok(())
    }

    /// Whether all of them can be together.
    pub fn check(&self) -> Result<(), StageError> {
        let d = |key| self.get(key);
        let say = |problem: fmt::Arguments| Err(StageError::Contradiction(problem.to_string()));
        let reach = d("bridge_width") * d("bridge_angle").to_radians().cos();
        if reach > d("atoza_depth") + 1e-3 {
            return say(format_args!(
                "a bridge of bridge_width = {} m at {} degrees needs {reach:.2} m of the rear seat's side, which is {} m; \
                 make it narrower or the atoza_depth larger",
                d("bridge_width"),
                d("bridge_angle"),
                d("atoza_depth")
            ));
        }
        if d("curtain_height") + 0.05 > d("bridge_pillar_height") {
            return say(format_args!(
                "a curtain of curtain_height = {} m does not hang under beams at bridge_pillar_height = {} m; raise the \
                 pillars or lower the curtain",
                d("curtain_height"),
                d("bridge_pillar_height")
            ));
        }
        let under = crate::roof::Profile::main(self).edge_underside();
        // Lower than that nobody at the front sees the mirror board.
        if under < d("pillar_height") - 1.0 {
            return say(format_args!(
                "the roof would come down to {under:.2} m above the floor, more than a metre below the pillars' heads at \
                 {} m; lower roof_pitch, roof_curve or eaves, or raise pillar_height",
                d("pillar_height")
            ));
        }
        if d("eaves") < d("jiutai_width") {
            return say(format_args!(
                "eaves = {} m do not cover a chorus seat of jiutai_width = {} m",
                d("eaves"),
                d("jiutai_width")
            ));
        }
        let bay = d("bridge_length") / d("bridge_bays");
        if bay < 1.0 {
            return say(format_args!(
                "{} bays on a bridge of {} m stand {bay:.2} m apart; at least 1 m lets a robe pass",
                d("bridge_bays"),
                d("bridge_length")
            ));
        }
        let rise = d("floor_height") / (d("steps") + 1.0);
        if rise > 0.3 {
            return say(format_args!(
                "{} steps up to a floor of {} m rise {rise:.2} m each; at most 0.3 m can be climbed",
                d("steps"),
                d("floor_height")
            ));
        }
        let loom = d("robe_half_span") / 2.0 + 2.0 * crate::robe::SEAM;
        if loom > d("robe_loom") + 1e-4 {
            return say(format_args!(
                "a robe with robe_half_span = {} m needs cloth {loom:.3} m wide, seams included, and robe_loom is {} m; make \
                 the robe narrower or the cloth wider",
                d("robe_half_span"),
                d("robe_loom")
            ));
        }
        if d("robe_sleeve") > 0.6 * d("robe_length") {
            return say(format_args!(
                "a sleeve of robe_sleeve = {} m is too long for a robe of {} m; at most six tenths",
                d("robe_sleeve"),
                d("robe_length")
            ));
        }
        if d("robe_length") + 0.05 > d("rack_height") {
            return say(format_args!(
                "a robe of robe_length = {} m lies on the floor below a rack of rack_height = {} m; raise the rack or \
                 shorten the robe",
                d("robe_length"),
                d("rack_height")
            ));
        }
        if 2.0 * d("robe_half_span") + 0.05 > d("rack_width") {
            return say(format_args!(
                "a robe with robe_half_span = {} m does not fit between posts rack_width = {} m apart; it needs {:.2} m",
                d("robe_half_span"),
                d("rack_width"),
                2.0 * d("robe_half_span") + 0.05
            ));
        }
        if d("pine_ichi") < d("pine_ni") || d("pine_ni") < d("pine_san") {
            return say(format_args!(
                "the pines must not grow away from the stage: {} m, {} m, {} m",
                d("pine_ichi"),
                d("pine_ni"),
                d("pine_san")
            ));
        }
        Ok(())
    }
}
