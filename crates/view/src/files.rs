//! What the window asks of whoever may open files.

use crate::live::Live;
use crate::reference::Difference;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image};
use yugen_scene::Scene;

/// A picture to be written.
pub struct Picture {
    /// Light, linear.
    pub image: Image,
    /// The space of its colours.
    pub space: ColourSpace,
    /// Stops, for formats that hold what a display shows.
    pub exposure: f32,
    /// For the same.
    pub curve: Curve,
}

/// What is painted.
#[derive(Clone, Debug)]
pub struct InkReport {
    /// The preset, or its file.
    pub preset: String,
    /// Pixels of the painting.
    pub size: [u32; 2],
    /// Strokes of contours.
    pub strokes: usize,
    /// That it took.
    pub seconds: f64,
    /// The selected stroke and the object that it is of, where it is painted.
    pub stroke: Option<(u32, Option<String>)>,
    /// What a table is looked at of: an object or a material, and its name.
    pub subject: Option<(&'static str, String)>,
    /// The mask that is painted, and on what.
    pub mask: Option<(String, String)>,
    /// Sentences about tables that changed nothing.
    pub unmet: Vec<String>,
}

/// What is seen.
#[derive(Clone, Debug)]
pub struct Report {
    /// The scene's file.
    pub file: PathBuf,
    /// Name of the GPU and its driver.
    pub adapter: String,
    /// What the window's surface is.
    pub surface: String,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Frames in it.
    pub frames: u32,
    /// Milliseconds of a frame, from order to end.
    pub milliseconds: f64,
    /// Of each pass.
    pub passes: Vec<(String, f64)>,
    /// Samples of a pixel of the reference; zero where it is off.
    pub samples: f32,
    /// How far the two are apart.
    pub difference: Option<Difference>,
    /// The selected material: its number, model and who wears it.
    pub selected: Option<(usize, String, Vec<String>)>,
    /// The animation and the seconds into it, where it is not as the file has it.
    pub moment: Option<(String, f32)>,
    /// Seconds that the last change took to be prepared.
    pub prepared: f64,
    /// The painting, where the picture is one.
    pub ink: Option<InkReport>,
    /// The sentence at the foot of the window.
    pub message: String,
}

/// A scene that was read.
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Cloth of it that is simulated.
    pub live: Option<Box<dyn Live>>,
}

/// Reads scenes and writes pictures.
pub trait Files: Send + Sync {
    /// A scene, or a sentence that says why not.
    fn load(&self, path: &Path) -> Result<Loaded, String>;

    /// When a file was last written.
    fn changed(&self, path: &Path) -> Option<SystemTime>;

    /// The file that something of the scene from file `scene` is written to at `path`, if it can be; names as of [`Files::save`].
    fn output(&self, path: &Path, scene: &Path) -> Result<PathBuf, String>;

    /// Writes a picture of the scene from file `scene`. Where `path` is an extension only, as `.png`, the file gets a name of
    /// its own. Returns its name, or a sentence.
    fn save(&self, path: &Path, scene: &Path, picture: Picture) -> Result<PathBuf, String>;

    /// Writes a text (vectors, a preset); names as of [`Files::save`].
    fn save_text(&self, path: &Path, scene: &Path, text: &str) -> Result<PathBuf, String>;

    /// Reads a text of a page or so.
    fn read_text(&self, path: &Path) -> Result<String, String>;

    /// Reads a picture, as linear sRGB.
    fn read_picture(&self, path: &Path) -> Result<Image, String>;

    /// Prints what is seen.
    fn report(&self, report: &Report);
}
