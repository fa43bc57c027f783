//! What the window can be asked for; action.rs has the table of keys and words that ask for it.

use crate::ink::{StrokeChange, Subject, TableChange};
use crate::language::Language;
use crate::mask::MaskChange;
use glam::Vec3;
use yugen_optics::tonemap::Curve;
use yugen_realtime::Lighting;

/// What is to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Round what is looked at, degrees to the right and up.
    Orbit([f32; 2]),
    /// On the spot, degrees to the right and up.
    Look([f32; 2]),
    /// Sideways, widths of the picture to the right and up.
    Pan([f32; 2]),
    /// The distance times this.
    Dolly(f32),
    /// Forward, to the right and up, radii of the scene.
    Walk([f32; 3]),
    /// Everything into the picture.
    Frame,
    /// Through a camera of the scene, by its name; the next where absent.
    Camera(Option<String>),
    /// Stops.
    Exposure(f32),
    /// More stops.
    Brighter(f32),
    /// A curve; the next where absent.
    Curve(Option<Curve>),
    /// Pixels of the picture; the next setting where absent.
    Resolution(Option<Resolution>),
    /// Surfaces that reflect light on its way; as the scene says where `All`.
    Bounces(Bounces),
    /// How surfaces are lit; the other way where absent.
    Lighting(Option<Lighting>),
    /// A light (by name or number) on, off or dimmed.
    Light(String, LightChange),
    /// A parameter of a material (by number or by the name of a shape that wears it).
    Material(String, String, Vec<String>),
    /// The model of a material (by number or by the name of a shape that wears it), by its name.
    Model(String, String),
    /// Shows the sliders of a material; of none where absent.
    Select(Option<String>),
    /// Selects the material of what lies at this place of the picture, 0 to 1 across and down.
    Pick([f32; 2]),
    /// Materials and lights as they were read.
    Restore,
    /// The animation goes on or stands; the other where absent.
    Play(Option<bool>),
    /// An animation, by its name; the next where absent.
    Clip(Option<String>),
    /// Seconds into the animation.
    Seconds(f32),
    /// By so many seconds on.
    Step(f32),
    /// Simulated cloth in air that moves at so many m/s.
    Wind(Vec3),
    /// What simulated cloth is made of.
    Fabric(String),
    /// The reference on or off; the other where absent.
    Reference(Option<bool>),
    /// How both are seen; the next where absent.
    Compare(Option<Compare>),
    /// Where the line stands, 0 to 1.
    Split(f32),
    /// The line by so much to the right.
    Slide(f32),
    /// The picture painted in ink or not; the other where absent.
    Ink(Option<bool>),
    /// A way of painting, by its name or file; the next where absent.
    Preset(Option<String>),
    /// A control of the painting, or a paper, pigment or manner of wrinkles by its name.
    Set(String, String),
    /// Something of the stroke that is looked at.
    Stroke(StrokeChange),
    /// Something of how an object or a material of this name is painted.
    Steer(Subject, String, TableChange),
    /// Something of the masks that are painted by hand.
    Mask(MaskChange),
    /// The painting beside that of the slides' method or alone; the other where absent.
    Literal(Option<bool>),
    /// The picture to a file: .png as it is seen, .exr as light; of a painting .svg and .toml as well.
    Save(String),
    /// The whole window to a file.
    Window(String),
    /// Another scene.
    Open(String),
    /// The scene anew from its file.
    Reload,
    /// Panel of settings.
    Panel(Option<bool>),
    /// Frame times.
    Graph(Option<bool>),
    /// This table.
    Help(Option<bool>),
    /// A language; the other where absent.
    Language(Option<Language>),
    /// The whole screen.
    FullScreen,
    /// In scripts: until the picture has so many frames and, where the reference is on, that so many samples.
    Wait([u32; 2]),
    /// In scripts: for so many seconds, whatever goes on.
    Pause(f32),
    /// Prints what is seen, as a line of JSON.
    Report,
    /// Ends.
    Quit,
}

/// How many pixels are computed for those that are seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Resolution {
    /// All where nothing moves, as many as there is time for where something does.
    #[default]
    Auto,
    /// All.
    Full,
    /// Half across and down.
    Half,
    /// A quarter.
    Quarter,
}

impl Resolution {
    /// Every one with its name.
    pub const ALL: [(Self, &'static str); 4] =
        [(Self::Auto, "auto"), (Self::Full, "full"), (Self::Half, "half"), (Self::Quarter, "quarter")];
}

/// How far light is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bounces {
    /// As the scene says.
    #[default]
    All,
    /// So many surfaces at most; one is direct light.
    Most(u32),
    /// Direct light or all, whichever it is not.
    Next,
}

/// What becomes of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightChange {
    /// On or off; the other where absent.
    Switch(Option<bool>),
    /// Brighter by so many stops than the scene says.
    Stops(f32),
}

/// How picture and reference are seen together, or a painting and that of the slides' method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compare {
    /// Real-time left of a line, reference right of it.
    #[default]
    Split,
    /// In turns.
    Flicker,
    /// Real-time alone.
    RealTime,
    /// Reference alone.
    Reference,
}

impl Compare {
    /// Every one with its name.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::Split, "split"),
        (Self::Flicker, "flicker"),
        (Self::RealTime, "realtime"),
        (Self::Reference, "reference"),
    ];
}
