//! A stack folder: pictures of one sample from one place, one a light, with the list of the lights.
//!
//! ```text
//! lights.lp      a count, then a line `file x y z` a picture (see `lp`)
//! *.exr, *.png…  the pictures; EXR and floating-point TIFF are linear, integers sRGB unless told otherwise
//! mask.png       optional: white = use
//! stack.toml     optional: what differs from the usual
//! ```
//! Every key of `stack.toml`, with its default:
//!
//! ```toml
//! lights = "lights.lp"
//! axes = "x y z"          # how the list names its three numbers; "x -y z" counts y downwards
//! near = false            # true: the list holds positions of lamps, origin at the centre of the picture
//! field_width = 1.0       # width of the picture on the sample, in the unit of the positions
//! response = "srgb"       # or "linear", or the exponent of a power: of integer pictures
//! white = 1.0             # what a white diffuser at the centre that faces the light reads; or [r, g, b]
//! level_white = false     # true: that white lay level with the sample instead, darker under low light
//! intensities = []        # brightness of each light relative to the others, numbers or [r, g, b]
//! saturated = 0.99        # integer samples from this fraction of full scale on are not used
//! ambient = ""            # a picture without any of the lights, taken off the others
//! mask = "mask.png"
//! colour_space = "srgb"   # of the pictures: srgb, rec2020, acescg or p3; an EXR says so itself
//! view = [0, 0, 1]        # toward the camera; pictures taken from aside show the sample as if from head on
//! camera_distance = "far" # or its distance from the sample in widths of the picture; unless said, by Exif
//! ```
//! Pictures are read in [bands](Folder::bands) of rows, so that memory does not grow with their height.

mod pictures;

pub use pictures::{no_picture, pictures};

use super::exif;
use super::image::rows::{Rows, Samples};
use super::image::{self, ReadOptions};
use super::lp::{self, Axes};
use super::toml::document::{Document, Item, Keys};
use crate::{Error, Place, atomic_write, read_bounded, update, will_read};
use glam::Vec3;
use std::ops::RangeInclusive;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::{ColourSpace, parallel};

/// The name of the options' file.
pub const OPTIONS: &str = "stack.toml";
/// The usual name of the list of lights.
pub const LIGHTS: &str = "lights.lp";
/// The usual name of the mask.
pub const MASK: &str = "mask.png";

/// The largest list or options' file that is read.
const MAX_TEXT: u64 = 16 << 20;
/// Of the memory for a band, what pictures that cannot be read row by row may hold, all together, as a part of what its
/// values hold.
const KEPT: u64 = 3;
/// How far cameras may stand from the sample, in widths of the picture: wider than 136° none sees straight, and from the
/// farthest on all texels are seen in the same direction.
pub const DISTANCES: RangeInclusive<f32> = 0.2..=1e6;
/// Rows that are decoded before they are sorted by texel.
const SLICE: usize = 16;

/// A camera's distance in widths of the picture, as `source` tells it, if there can be such a camera; else a warning, and
/// nothing.
pub fn distance_told(widths: f32, source: &str) -> Option<f32> {
    let believed = DISTANCES.contains(&widths);
    if !believed {
        tracing::warn!(
            "{source}: the camera would have stood {widths} widths of the picture away, and none from {} to {} does; it is \
             taken to be far away unless {OPTIONS} says its camera_distance",
            DISTANCES.start(),
            DISTANCES.end()
        );
    }
    believed.then_some(widths)
}

/// What the numbers of an integer picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Response {
    /// Proportional to light.
    Linear,
    /// The display curve of sRGB.
    #[default]
    Srgb,
    /// The fraction of full scale to this power.
    Power(f32),
}

impl Response {
    /// Light for a fraction of full scale.
    pub fn light(self, fraction: f32) -> f32 {
        match self {
            Self::Srgb => srgb_to_linear(fraction),
            Self::Linear => fraction,
            Self::Power(exponent) => fraction.powf(exponent),
        }
    }
}

/// What the file of options says; see the [module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the list of lights.
    pub lights: String,
    /// How the list names its numbers.
    pub axes: Axes,
    /// Whether the list holds positions.
    pub near: bool,
    /// Width of the picture on the sample, in the unit of the positions.
    pub field_width: f32,
    /// Of integer pictures.
    pub response: Response,
    /// What a white diffuser at the centre that faces the light reads.
    pub white: [f32; 3],
    /// Whether that white lay level with the sample instead of facing each light.
    pub level_white: bool,
    /// Brightness of each light relative to the others; none: all alike.
    pub intensities: Vec<[f32; 3]>,
    /// Fraction of full scale.
    pub saturated: f32,
    /// Name of a picture without light.
    pub ambient: Option<String>,
    /// Name of the mask; `None`: `mask.png` if it is there.
    pub mask: Option<String>,
    /// Of the pictures; `None`: what they say themselves, else linear sRGB.
    pub colour_space: Option<ColourSpace>,
    /// Unit, from the centre of the picture toward the camera. Pictures taken from aside are straightened: a texel is at
    /// the same place in all.
    pub view: Vec3,
    /// How far the camera stands from the centre of the picture, in widths of the picture on the sample: focal length over
    /// width of the sensor, for one that looks straight on. Infinite: all texels see it in the same direction. `None`: as
    /// the Exif data of the first picture tell, else as if it were infinite.
    pub camera_distance: Option<f32>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            lights: LIGHTS.into(),
            axes: Axes::default(),
            near: false,
            field_width: 1.0,
            response: Response::Srgb,
            white: [1.0; 3],
            level_white: false,
            intensities: Vec::new(),
            saturated: 0.99,
            ambient: None,
            mask: None,
            colour_space: None,
            view: Vec3::Z,
            camera_distance: None,
        }
    }
}

impl Options {
    /// The options of a folder, or the usual ones where it has no file of them.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(OPTIONS);
        if !path.exists() {
            return Ok(Self::default());
        }
        Self::parse(&read_bounded(&path, MAX_TEXT)?, &path)
    }

    /// From the text of a file.
    pub fn parse(bytes: &[u8], file: &Path) -> Result<Self, Error> {
        let text = std::str::from_utf8(bytes).map_err(|e| {
            Error::invalid(Place::byte(file, e.valid_up_to() as u64), "this is no UTF-8 text; expected TOML")
        })?;
        let doc = Document { file, text };
        let table = doc.parse()?;
        let mut keys = Keys::root(&doc, table.get_ref());
        keys.what = "stack".into();
        let usual = Self::default();
        let text = |item: &Item| item.text().map(String::from);
        let some = |item: &Item| item.text().map(|t| Some(t.to_string()).filter(|t| !t.is_empty()));
        let spaces = ColourSpace::ALL.map(|s| (s.name(), Some(s)));
        let options = Self {
            lights: keys.or("lights", usual.lights, text)?,
            axes: keys.or("axes", usual.axes, |i| i.text()?.parse().map_err(|e: String| i.invalid(e)))?,
            near: keys.or("near", usual.near, Item::boolean)?,
            field_width: keys.or("field_width", usual.field_width, |i| i.number_in(1e-6, 1e9))?,
            response: keys.or("response", usual.response, |i| match i.try_number() {
                Some(_) => i.number_in(0.1, 10.0).map(Response::Power),
                None => {
                    let known = [("linear", Response::Linear), ("srgb", Response::Srgb)];
                    i.one_of("response", &known)
                }
            })?,
            white: keys.or("white", usual.white, brightness)?,
            level_white: keys.or("level_white", usual.level_white, Item::boolean)?,
            intensities: keys
                .or("intensities", usual.intensities, |i| i.array()?.iter().map(brightness).collect())?,
            saturated: keys.or("saturated", usual.saturated, |i| i.number_in(0.01, 2.0))?,
            ambient: keys.or("ambient", usual.ambient, some)?,
            mask: keys.or("mask", usual.mask, some)?,
            colour_space: keys
                .or("colour_space", usual.colour_space, |i| i.one_of("colour space", &spaces))?,
            view: keys.or("view", usual.view, |i| match i.direction()? {
                view if view.z > 0.02 => Ok(view),
                _ => Err(i.invalid(
                    "the camera stands below the sample; expected 'view' with a third number above zero",
                )),
            })?,
            camera_distance: keys.or("camera_distance", usual.camera_distance, |i| match i.try_number() {
                Some(_) => i.number_in(*DISTANCES.start(), *DISTANCES.end()).map(Some),
                None => i.one_of("camera distance", &[("far", Some(f32::INFINITY))]),
            })?,
        };
        keys.finish()?;
        Ok(options)
    }

    /// The text of a file that says what differs from the usual.
    pub fn text(&self) -> String {
        let mut text = String::from("# A stack of photographs; every key is optional.\n");
        for ((key, value), (_, usual)) in self.entries().into_iter().zip(Self::default().entries()) {
            if value != usual {
                text.push_str(&format!("{key} = {value}\n"));
            }
        }
        text
    }

    /// Every key with its value as TOML; nothing where there is no value to write.
    fn entries(&self) -> [(&'static str, String); 14] {
        let quoted = |t: &str| {
            let one = |c: char| match c {
                '"' | '\\' => format!("\\{c}"),
                c if c.is_control() => format!("\\u{:04X}", c as u32),
                c => c.to_string(),
            };
            format!("\"{}\"", t.chars().map(one).collect::<String>())
        };
        let rgb = |c: &[f32; 3]| match c[0] == c[1] && c[1] == c[2] {
            true => format!("{:?}", c[0]),
            false => format!("{c:?}"),
        };
        let response = match self.response {
            Response::Linear => quoted("linear"),
            Response::Srgb => quoted("srgb"),
            Response::Power(p) => format!("{p:?}"),
        };
        let all: Vec<String> = self.intensities.iter().map(rgb).collect();
        [
            ("lights", quoted(&self.lights)),
            ("axes", quoted(&self.axes.to_string())),
            ("near", self.near.to_string()),
            ("field_width", format!("{:?}", self.field_width)),
            ("response", response),
            ("white", rgb(&self.white)),
            ("level_white", self.level_white.to_string()),
            ("intensities", format!("[{}]", all.join(", "))),
            ("saturated", format!("{:?}", self.saturated)),
            ("ambient", quoted(self.ambient.as_deref().unwrap_or_default())),
            ("mask", quoted(self.mask.as_deref().unwrap_or_default())),
            ("colour_space", self.colour_space.map(|s| quoted(s.name())).unwrap_or_default()),
            ("view", format!("{:?}", self.view.to_array())),
            (
                "camera_distance",
                match self.camera_distance {
                    None => String::new(),
                    Some(far) if far.is_infinite() => quoted("far"),
                    Some(near) => format!("{near:?}"),
                },
            ),
        ]
    }

    /// The text of a file of these options in which only what `new` says otherwise is changed: comments stay.
    ///
    /// # Errors
    /// Where the text is no TOML.
    pub fn amended(&self, text: &str, file: &Path, new: &Self) -> Result<String, Error> {
        let doc = Document { file, text };
        let table = doc.parse()?;
        let mut changes = Vec::new();
        let mut added = String::new();
        for ((key, old), (_, new)) in self.entries().into_iter().zip(new.entries()) {
            match table.get_ref().iter().find(|(k, _)| k.get_ref() == key) {
                _ if old == new || new.is_empty() => {}
                Some((_, value)) => changes.push((value.span(), new)),
                None => added.push_str(&format!("{key} = {new}\n")),
            }
        }
        changes.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
        let mut text = text.to_string();
        changes.into_iter().for_each(|(span, new)| text.replace_range(span, &new));
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        Ok(text + &added)
    }
}

/// A number for all channels or one for each, above zero.
fn brightness(item: &Item) -> Result<[f32; 3], Error> {
    let rgb = match item.try_number() {
        Some(v) => [v as f32; 3],
        None => item.numbers()?,
    };
    if rgb.iter().any(|&v| v < 1e-9) {
        return Err(item.invalid(format!("'{}' is {rgb:?}; expected numbers above zero", item.key)));
    }
    Ok(rgb)
}

/// A picture of a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The file.
    pub path: PathBuf,
    /// What the list of lights says, in the frame of the picture.
    pub light: Vec3,
}

/// An opened stack folder.
#[derive(Clone, Debug)]
pub struct Folder {
    /// Where it lies.
    pub path: PathBuf,
    /// The options in force.
    pub options: Options,
    /// The pictures, in the order of the list.
    pub pictures: Vec<Picture>,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// 1 (grey) or 3; bands have three in any case.
    pub channels: usize,
    /// The space of the colours.
    pub colour_space: ColourSpace,
    /// Where the sample is, row by row, if there is a mask.
    pub mask: Option<Vec<bool>>,
    /// How far the camera stands from the centre, in widths of the picture; infinite where nothing tells.
    pub camera_distance: f32,
    /// Whether pictures are decoded as a whole when they are opened, as JPEGs are.
    kept: bool,
}

/// A third of a stop is a factor of 1.26; shutters keep their time to some percent.
const EXPOSED: f32 = 1.1;

/// Refuses photographs that were exposed in different ways, as by a camera that chose for itself. Only of a JPEG Exif is read
/// without the picture.
fn same_exposure(pictures: &[Picture]) -> Result<(), Error> {
    let jpeg = |p: &&Picture| {
        p.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("jpg") || e.eq_ignore_ascii_case("jpeg"))
    };
    // What the first that tells it says, quantity by quantity.
    let mut known = exif::Settings::default();
    let mut first: Option<&Picture> = None;
    for picture in pictures.iter().filter(jpeg) {
        let settings = exif::read(&picture.path)?;
        let factor = settings.brighter_than(&known);
        known.seconds = known.seconds.or(settings.seconds);
        known.iso = known.iso.or(settings.iso);
        known.f_number = known.f_number.or(settings.f_number);
        if known == exif::Settings::default() {
            continue;
        }
        let one = first.get_or_insert(picture);
        if factor.max(1.0 / factor) > EXPOSED {
            let problem = format!(
                "by its Exif data this was exposed {factor:.2} times as much as '{}'; all photographs of a stack need one \
                 exposure: take them with time, aperture and sensitivity set by hand, or say in {OPTIONS} how bright each is \
                 (intensities)",
                one.path.display()
            );
            return Err(Error::invalid(Place::file(&picture.path), problem));
        }
    }
    Ok(())
}

impl Folder {
    /// Opens a stack by its folder or by its list of lights, with the options of its `stack.toml`.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::open_with(path, |_| {})
    }

    /// As [`Folder::open`], with a last word on the options.
    pub fn open_with(path: &Path, adjust: impl FnOnce(&mut Options)) -> Result<Self, Error> {
        Self::opened(path, None, adjust)
    }

    /// As [`Folder::open`], under the lights of a list that may lie anywhere, as beside the balls that they were found
    /// from. What a `stack.toml` beside that list says of it (axes, near lamps and their unit, and the camera's distance,
    /// unless the stack itself says one) counts here.
    pub fn open_lit_by(path: &Path, list: &Path) -> Result<Self, Error> {
        let beside = list.parent().unwrap_or(Path::new(""));
        let theirs = Options::read(beside)?;
        let there = beside.join(OPTIONS).exists();
        let said = there && list.file_name() == Path::new(&theirs.lights).file_name();
        if there && !said {
            tracing::warn!(
                "{} speaks of the list '{}', not of '{}': what it says of axes, near and field_width is not used",
                beside.join(OPTIONS).display(),
                theirs.lights,
                list.display()
            );
        }
        Self::opened(path, Some(list), |own| {
            own.lights = list.display().to_string();
            if said {
                if own.near && !theirs.near {
                    tracing::warn!(
                        "{}: its near = true is of its own list; {} says that '{}' holds directions, and they are taken as \
                         such",
                        path.display(),
                        beside.join(OPTIONS).display(),
                        list.display()
                    );
                }
                (own.axes, own.near, own.field_width) = (theirs.axes, theirs.near, theirs.field_width);
                own.camera_distance = own.camera_distance.or(theirs.camera_distance);
            }
        })
    }

    fn opened(path: &Path, lit_by: Option<&Path>, adjust: impl FnOnce(&mut Options)) -> Result<Self, Error> {
        let _span = tracing::info_span!("open_stack", file = %path.display()).entered();
        let list = path.is_file();
        let folder =
            if list { path.parent().unwrap_or(Path::new("")).to_path_buf() } else { path.to_path_buf() };
        if !path.exists() {
            return Err(Error::io(path, std::io::ErrorKind::NotFound.into()));
        }
        let mut options = Options::read(&folder)?;
        if list {
            options.lights = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        }
        adjust(&mut options);
        let lights = match lit_by {
            Some(list) => list.to_path_buf(),
            None => inside(&folder, &options.lights),
        };
        if !lights.exists() {
            let problem = format!(
                "there is no list of lights; make one with `yugen capture calibrate`, or name it in {OPTIONS} or on the \
                 command line (looked for {})",
                lights.display()
            );
            return Err(Error::invalid(Place::file(path), problem));
        }
        let entries = lp::read(&read_bounded(&lights, MAX_TEXT)?, &lights, options.axes)?;
        if entries.is_empty() {
            return Err(Error::invalid(Place::file(&lights), "the list has no light; expected at least one"));
        }
        if !options.intensities.is_empty() && options.intensities.len() != entries.len() {
            let problem = format!(
                "there are {} intensities for {} lights; expected one a light",
                options.intensities.len(),
                entries.len()
            );
            return Err(Error::invalid(Place::file(folder.join(OPTIONS)), problem));
        }
        let pictures = pictures::of_list(&folder, &lights, entries, &options)?;
        if options.intensities.is_empty() {
            same_exposure(&pictures)?;
        }
        let first = Rows::open(&pictures[0].path, &ReadOptions::raw(), &mut { u64::MAX })?;
        let (width, height, channels, kept) = (first.width, first.height, first.channels, first.kept());
        let colour_space = options
            .colour_space
            .or(first.chromaticities.and_then(space_of))
            .unwrap_or(ColourSpace::LinearSrgb);
        let camera_distance = match options.camera_distance {
            Some(said) => said,
            // Photographs from the side are straightened onto the plane: their width is no longer the sensor's.
            None if options.view != Vec3::Z => f32::INFINITY,
            // An EXR has no Exif data, and may be large.
            None if pictures[0].path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) => {
                f32::INFINITY
            }
            None => exif::read(&pictures[0].path)?
                .distance(width, height)
                .and_then(|d| distance_told(d, &format!("{}: Exif", pictures[0].path.display())))
                .unwrap_or(f32::INFINITY),
        };
        let mut stack = Self {
            path: folder,
            options,
            pictures,
            width,
            height,
            channels,
            colour_space,
            mask: None,
            camera_distance,
            kept,
        };
        stack.mask = stack.read_mask()?;
        let ambient = stack.options.ambient.as_ref().map(|name| inside(&stack.path, name));
        stack.pictures.iter().map(|p| &p.path).chain(&ambient).for_each(|p| will_read(p));
        Ok(stack)
    }

    fn read_mask(&self) -> Result<Option<Vec<bool>>, Error> {
        let path = inside(&self.path, self.options.mask.as_deref().unwrap_or(MASK));
        if self.options.mask.is_none() && !path.exists() {
            return Ok(None);
        }
        let mask = image::read(&path, &ReadOptions::raw())?;
        self.same_size(&path, mask.width, mask.height)?;
        Ok(Some(mask.data.chunks_exact(mask.channels.len()).map(|p| p[0] > 0.5).collect()))
    }

    fn same_size(&self, path: &Path, width: usize, height: usize) -> Result<(), Error> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        let problem = format!(
            "the picture is {width} x {height}, but '{}' is {} x {}; all pictures of a stack need one size",
            self.pictures[0].path.display(),
            self.width,
            self.height
        );
        Err(Error::invalid(Place::file(path), problem))
    }

    /// For distant lights: unit vectors toward them.
    pub fn directions(&self) -> Vec<Vec3> {
        self.pictures.iter().map(|p| p.light.normalize()).collect()
    }

    /// For near lights: where they stand, in widths of the picture from its centre.
    pub fn positions(&self) -> Vec<Vec3> {
        self.pictures.iter().map(|p| p.light / self.options.field_width).collect()
    }

    /// The most rows of a band that fits into this many bytes with all that is needed to read it, at least one.
    pub fn rows_within(&self, bytes: u64) -> usize {
        // The values, the slice that is being sorted, and pictures that are decoded whole.
        let row = self.row_bytes();
        let left = bytes.saturating_sub(row * SLICE as u64);
        let left = if self.kept { left / (KEPT + 1) * KEPT } else { left };
        (left / row.max(1)).clamp(1, self.height as u64) as usize
    }

    /// Bytes of the values of a row.
    fn row_bytes(&self) -> u64 {
        (self.width * self.pictures.len() * size_of::<[f32; 3]>()) as u64
    }

    /// Reads the stack from the top in bands of so many rows (the last may have fewer). Pictures that are decoded whole
    /// hold a third of what the values of a band hold, and what does not fit waits in temporary files.
    pub fn bands(&self, rows: usize) -> Result<Bands<'_>, Error> {
        let limit = ReadOptions::raw();
        let mut allowance = rows.min(self.height) as u64 * self.row_bytes() / KEPT;
        let mut open = |path: &Path| -> Result<Rows, Error> {
            let rows = Rows::open(path, &limit, &mut allowance)?;
            self.same_size(path, rows.width, rows.height)?;
            if rows.channels != self.channels {
                let kind = |n| if n == 1 { "grey" } else { "coloured" };
                let problem = format!(
                    "the picture is {}, but '{}' is {}; all pictures of a stack need the same channels",
                    kind(rows.channels),
                    self.pictures[0].path.display(),
                    kind(self.channels)
                );
                return Err(Error::invalid(Place::file(path), problem));
            }
            if let Some(space) = rows.chromaticities.and_then(space_of)
                && space != self.colour_space
                && self.options.colour_space.is_none()
            {
                let problem = format!(
                    "the colours are {}, but those of '{}' are {}; say 'colour_space' in {OPTIONS} to overrule",
                    space.name(),
                    self.pictures[0].path.display(),
                    self.colour_space.name()
                );
                return Err(Error::invalid(Place::file(path), problem));
            }
            Ok(rows)
        };
        let mut pictures = self.pictures.iter().map(|p| open(&p.path)).collect::<Result<Vec<_>, _>>()?;
        let ambient =
            self.options.ambient.as_ref().map(|name| open(&inside(&self.path, name))).transpose()?;
        let mut ambient: Vec<Rows> = ambient.into_iter().collect();
        let mut tables: Vec<(u32, Arc<Vec<[f32; 3]>>)> = Vec::new();
        for rows in pictures.iter_mut().chain(&mut ambient) {
            let Samples::Codes(max) = rows.samples else { continue };
            if !tables.iter().any(|(m, _)| *m == max) {
                tables.push((max, Arc::new(self.table(max))));
            }
            rows.set_table(tables.iter().find(|(m, _)| *m == max).map(|t| t.1.clone()).unwrap_or_default());
        }
        Ok(Bands { folder: self, pictures, ambient, rows: rows.max(1), next: 0, counts: Counts::default() })
    }

    /// Light for every code up to `max`, NaN where the sensor was saturated.
    fn table(&self, max: u32) -> Vec<[f32; 3]> {
        let light = |code| {
            let fraction = code as f32 / max as f32;
            [if fraction >= self.options.saturated {
                f32::NAN
            } else {
                self.options.response.light(fraction)
            }; 3]
        };
        (0..=max).map(light).collect()
    }
}

/// Where a name of a list or of the options leads: it may come from another computer, and stays inside the folder,
/// whatever folders stand before it.
pub fn inside(folder: &Path, name: &str) -> PathBuf {
    let relative = Path::new(name);
    let stays = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if stays && folder.join(relative).exists() {
        return folder.join(relative);
    }
    folder.join(name.rsplit(['/', '\\']).next().unwrap_or(name))
}

/// The known space with these primaries and white, told apart as far as three digits go.
fn space_of(chromaticities: [[f64; 2]; 4]) -> Option<ColourSpace> {
    ColourSpace::ALL.into_iter().find(|s| {
        s.chromaticities()
            .iter()
            .flatten()
            .zip(chromaticities.iter().flatten())
            .all(|(a, b)| (a - b).abs() < 1e-3)
    })
}

/// A band of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Its first row, counted from the top.
    pub first_row: usize,
    /// Its rows.
    pub height: usize,
    /// Radiance over that of a white diffuser that faces the light, texel after texel from the top left, within a
    /// texel light after light; NaN is not to be used.
    pub values: Vec<[f32; 3]>,
}

/// What is not used, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Texels read.
    pub texels: u64,
    /// Texels outside the mask.
    pub outside: u64,
    /// Texels inside the mask that are black or unusable in every picture.
    pub black: u64,
    /// Samples inside the mask that are saturated (integers), or NaN or infinite in the file (floats).
    pub unusable: u64,
}

/// Bands of a stack, from the top; stops after the first error.
pub struct Bands<'a> {
    folder: &'a Folder,
    pictures: Vec<Rows>,
    ambient: Vec<Rows>,
    rows: usize,
    next: usize,
    counts: Counts,
}

impl Bands<'_> {
    /// What was left out so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Passes over so many rows.
    pub fn skip_rows(&mut self, rows: usize) -> Result<(), Error> {
        let mut line = vec![[0.0; 3]; self.folder.width];
        for _ in 0..rows.min(self.folder.height - self.next) {
            for picture in self.pictures.iter_mut().chain(&mut self.ambient) {
                picture.next_row(&mut line)?;
            }
            self.next += 1;
        }
        Ok(())
    }

    /// The next rows into `values`, which has room for them.
    fn slice(&mut self, values: &mut [[f32; 3]]) -> Result<(), Error> {
        let (width, lights) = (self.folder.width, self.pictures.len());
        let height = values.len() / (width * lights);
        let threads = parallel::threads();
        let mut planes = vec![[0.0f32; 3]; lights * height * width];
        let each = lights.div_ceil(threads);
        std::thread::scope(|scope| {
            let workers: Vec<_> = self
                .pictures
                .chunks_mut(each)
                .zip(planes.chunks_mut(each * height * width))
                .map(|(pictures, planes)| {
                    scope.spawn(move || {
                        pictures.iter_mut().zip(planes.chunks_mut(height * width)).try_for_each(
                            |(picture, plane)| {
                                plane.chunks_mut(width).try_for_each(|row| picture.next_row(row))
                            },
                        )
                    })
                })
                .collect();
            let join = |w: std::thread::ScopedJoinHandle<'_, _>| {
                w.join().unwrap_or_else(|p| std::panic::resume_unwind(p))
            };
            workers.into_iter().try_for_each(join)
        })?;
        let mut ambient = vec![[0.0f32; 3]; height * width];
        for picture in &mut self.ambient {
            ambient.chunks_mut(width).try_for_each(|row| picture.next_row(row))?;
        }
        let folder = self.folder;
        let white = Vec3::from_array(folder.options.white);
        let scales: Vec<Vec3> = (0..lights)
            .map(|l| {
                let intensity = folder.options.intensities.get(l).map_or(Vec3::ONE, |&i| Vec3::from_array(i));
                // A level white receives less of a low light, by the cosine.
                let cosine =
                    if folder.options.level_white { folder.pictures[l].light.normalize().z } else { 1.0 };
                cosine / (white * intensity)
            })
            .collect();
        let first = self.next * width;
        let each = (height * width).div_ceil(threads);
        let counts: Vec<Counts> = std::thread::scope(|scope| {
            let workers: Vec<_> = values
                .chunks_mut(each * lights)
                .enumerate()
                .map(|(t, values)| {
                    let (planes, ambient, scales) = (&planes, &ambient, &scales);
                    scope.spawn(move || {
                        let mut counts = Counts::default();
                        for (i, samples) in values.chunks_exact_mut(lights).enumerate() {
                            let at = t * each + i;
                            counts.texels += 1;
                            if folder.mask.as_ref().is_some_and(|m| !m[first + at]) {
                                counts.outside += 1;
                                samples.fill([f32::NAN; 3]);
                                continue;
                            }
                            let dark = Vec3::from_array(ambient[at]);
                            let mut light = false;
                            for (l, sample) in samples.iter_mut().enumerate() {
                                let v =
                                    (Vec3::from_array(planes[l * height * width + at]) - dark) * scales[l];
                                // One channel out of range spoils the colour.
                                let usable = v.is_finite();
                                counts.unusable += u64::from(!usable);
                                light |= usable && v.max_element() > 0.0;
                                *sample = if usable { v.to_array() } else { [f32::NAN; 3] };
                            }
                            if !light {
                                counts.black += 1;
                                samples.fill([f32::NAN; 3]);
                            }
                        }
                        counts
                    })
                })
                .collect();
            workers.into_iter().map(|w| w.join().unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
        });
        for c in counts {
            self.counts.texels += c.texels;
            self.counts.outside += c.outside;
            self.counts.black += c.black;
            self.counts.unusable += c.unusable;
        }
        self.next += height;
        Ok(())
    }
}

impl Iterator for Bands<'_> {
    type Item = Result<Band, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let height = self.rows.min(self.folder.height - self.next);
        if height == 0 {
            return None;
        }
        let first_row = self.next;
        let row = self.folder.width * self.pictures.len();
        let mut values = vec![[0.0; 3]; height * row];
        for slice in values.chunks_mut(SLICE * row) {
            if let Err(e) = self.slice(slice) {
                self.next = self.folder.height;
                return Some(Err(e));
            }
        }
        Some(Ok(Band { first_row, height, values }))
    }
}

/// Makes `folder` a stack of the pictures that already lie in it: writes the options and the list of lights.
pub fn write(folder: &Path, entries: &[lp::Entry], options: &Options) -> Result<(), Error> {
    let path = folder.join(&options.lights);
    let list = lp::write(entries, &path)?;
    write_options(folder, options)?;
    atomic_write(&path, list.as_bytes())
}

/// Writes the options of a stack. Usual ones need no file, but replace that of a former stack.
pub fn write_options(folder: &Path, options: &Options) -> Result<(), Error> {
    let path = folder.join(OPTIONS);
    if *options != Options::default() || path.exists() {
        atomic_write(&path, options.text().as_bytes())?;
    }
    Ok(())
}

/// As [`write`], for a stack that has options: of their file only what has changed is written anew.
pub fn amend(folder: &Path, entries: &[lp::Entry], options: &Options) -> Result<(), Error> {
    let lights = folder.join(&options.lights);
    let list = lp::write(entries, &lights)?;
    let path = folder.join(OPTIONS);
    if path.exists() {
        let bytes = read_bounded(&path, MAX_TEXT)?;
        let old = Options::parse(&bytes, &path)?;
        let text = String::from_utf8_lossy(&bytes);
        let new = old.amended(&text, &path, options)?;
        if new != text {
            update(&path, new.as_bytes())?;
        }
    } else {
        write_options(folder, options)?;
    }
    atomic_write(&lights, list.as_bytes())
}

#[cfg(test)]
mod tests;
