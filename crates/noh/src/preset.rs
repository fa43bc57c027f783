//! Stages that stand or stood, and the textbook's.

use crate::dimension::{Basis, Dimensions, Entry, MeasuredAt, StageError};

/// How a roof ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoofForm {
    /// A gable at the front and at the rear.
    Kirizuma,
    /// A hipped gable at the front, a plain one at the rear.
    Irimoya,
}

/// What a roof is covered with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoofCover {
    /// Cypress bark.
    Bark,
    /// Sheets of copper, gone brown.
    Copper,
}

/// A stage by name.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// For `--preset`.
    pub name: &'static str,
    /// In Japanese.
    pub ja: &'static str,
    /// In English.
    pub en: &'static str,
    /// Of the main roof.
    pub roof: RoofForm,
    /// Of the roofs.
    pub cover: RoofCover,
    /// The rear seat has a roof of its own, sloping to the rear.
    pub rear_roof: bool,
    /// What width and depth are measured between.
    pub measured_at: MeasuredAt,
    /// What is known beyond the numbers.
    pub notes: &'static str,
    /// Values that are not the table's.
    pub values: &'static [(&'static str, f32, Basis, &'static str)],
}

use Basis::{Assumed, Measured};

const AWAYA: &str = "K. Awaya, goo blog, after the Genroku record";
const NNT: &str = "ht-atelier.com 2023; K. Awaya, goo blog";
const RYUTOPIA: &str = "ryutopia.or.jp";
const YOYOGI: &str = "Agency for Cultural Affairs, bunka.nii 187633";
const ISHIKAWA: &str = "Agency for Cultural Affairs, bunka.nii 279890";
const HONGANJI: &str = "Agency for Cultural Affairs, kunishitei 102/1820";
const KYOMA: &str = "three ken of 6.5 shaku, as in Kyoto; fits the 52.42 m2 of the whole";

/// All presets.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "national",
        ja: "国立能楽堂",
        en: "National Noh Theatre, Tokyo",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Bark,
        rear_roof: false,
        measured_at: MeasuredAt::Centre,
        notes: "gable roof of cypress bark; floor of hinoki from Bishu",
        values: &[
            ("width", 5.4, Measured, NNT),
            ("depth", 5.4, Measured, NNT),
            ("bridge_length", 13.5, Measured, NNT),
            ("bridge_angle", 26.0, Measured, NNT),
        ],
    },
    Preset {
        name: "edo",
        ja: "江戸城表舞台",
        en: "Omote stage of Edo castle",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Bark,
        rear_roof: false,
        measured_at: MeasuredAt::Inside,
        notes: "the stage of the highest rank, which the National Noh Theatre copies smaller",
        values: &[
            ("width", 5.909, Measured, AWAYA),
            ("depth", 5.909, Measured, AWAYA),
            ("bridge_bays", 11.0, Measured, AWAYA),
            ("bridge_length", 13.5, Assumed, "the longest that is published; the record gives bays only"),
            ("bridge_angle", 26.0, Assumed, "as in the National Noh Theatre"),
        ],
    },
    Preset {
        name: "ryutopia",
        ja: "りゅーとぴあ能楽堂",
        en: "Ryutopia, Niigata",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Bark,
        rear_roof: false,
        measured_at: MeasuredAt::Centre,
        notes: "metsuke pillar and mirror board can be taken away",
        values: &[
            ("width", 5.98, Measured, RYUTOPIA),
            ("depth", 5.98, Measured, RYUTOPIA),
            ("bridge_length", 10.4, Measured, RYUTOPIA),
            ("bridge_width", 2.7, Measured, RYUTOPIA),
            ("bridge_angle", 26.0, Assumed, "as in the National Noh Theatre"),
        ],
    },
    Preset {
        name: "yoyogi",
        ja: "代々木能舞台",
        en: "Yoyogi Noh stage, Tokyo",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Copper,
        rear_roof: false,
        measured_at: MeasuredAt::Centre,
        notes: "registered cultural property; gable to the front, copper, bridge at a right angle; blocks and bracket arms on \
                chamfered pillars",
        values: &[
            ("width", 5.5, Measured, YOYOGI),
            ("depth", 5.4, Measured, YOYOGI),
            ("bridge_length", 9.5, Measured, YOYOGI),
            ("bridge_width", 1.9, Measured, YOYOGI),
            ("bridge_angle", 0.0, Measured, YOYOGI),
            ("roof_pitch", 33.0, Assumed, "copper roofs are flatter than bark"),
            ("bark_thickness", 0.1, Assumed, "boards and sheets at the edge of a copper roof"),
        ],
    },
    Preset {
        name: "ishikawa",
        ja: "石川県立能楽堂",
        en: "Ishikawa Noh Theatre, Kanazawa",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Bark,
        rear_roof: false,
        measured_at: MeasuredAt::Centre,
        notes: "gable roof of bark; frog-leg struts on the head ties; bridge obliquely to the rear left",
        values: &[
            ("width", 5.7, Measured, ISHIKAWA),
            ("depth", 5.7, Measured, ISHIKAWA),
            ("bridge_angle", 26.0, Assumed, "oblique; by how much is not published"),
            ("bridge_length", 11.0, Assumed, "not published"),
        ],
    },
    Preset {
        name: "honganji",
        ja: "西本願寺北能舞台",
        en: "North stage of Nishi-Honganji, Kyoto, 1581",
        roof: RoofForm::Irimoya,
        cover: RoofCover::Bark,
        rear_roof: true,
        measured_at: MeasuredAt::Centre,
        notes: "national treasure, the oldest that stands; front hipped gable, rear gable; the rear seat has a roof of its own",
        values: &[
            ("width", 5.91, Assumed, KYOMA),
            ("depth", 5.91, Assumed, KYOMA),
            ("bridge_bays", 3.0, Measured, HONGANJI),
            ("bridge_length", 5.91, Assumed, "three bays of a ken of 6.5 shaku"),
            ("bridge_width", 1.97, Assumed, "one bay of a ken of 6.5 shaku"),
            ("bridge_angle", 45.0, Assumed, "steep, as its descriptions say; not published"),
        ],
    },
    Preset {
        name: "textbook",
        ja: "標準能舞台",
        en: "The textbook's stage (JAANUS)",
        roof: RoofForm::Kirizuma,
        cover: RoofCover::Bark,
        rear_roof: false,
        measured_at: MeasuredAt::Centre,
        notes: "5.7 m square; the bridge's length is not fixed",
        values: &[
            ("width", 5.7, Measured, "JAANUS"),
            ("depth", 5.7, Measured, "JAANUS"),
            ("bridge_length", 10.0, Assumed, "not fixed; between three and seven ken"),
        ],
    },
];

impl Preset {
    /// By its name.
    pub fn find(name: &str) -> Result<&'static Self, StageError> {
        PRESETS.iter().find(|p| p.name == name).ok_or_else(|| StageError::Preset {
            name: name.into(),
            hint: yugen_scene::suggest(name, PRESETS.iter().map(|p| p.name)),
        })
    }

    /// The table with this stage's values.
    pub fn dimensions(&self) -> Dimensions {
        let mut all = Dimensions::default();
        for &(key, value, basis, source) in self.values {
            all.put(key, Entry { value, basis, source });
        }
        all
    }
}
