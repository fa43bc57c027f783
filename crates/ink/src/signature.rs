//! What is written and pressed on a painting when it is done: an inscription (ti) and the artist's seal (yin).
//!
//! Characters are the outlines of a font that the user gives; columns run down and follow one another to the left. The seal
//! stands under the last column, where custom has it, and is carved in white (the characters are cut away and the ground
//! prints) or in red (they are left standing within a frame).

use crate::InkError;
use crate::canvas::Layer;
use crate::isoline;
use crate::path::{polygon, rectangle};
use glam::{Vec2, Vec3, vec2};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};
use std::sync::Arc;
use tiny_skia::{FillRule, Mask, Path, PathBuilder, Transform};
use yugen_motion::noise::noise;
use yugen_optics::Image;
use yugen_optics::colour::linear_to_srgb;

/// A font's file.
#[derive(Clone)]
pub struct Font {
    /// Its name, for errors.
    pub name: String,
    /// What is in it.
    pub bytes: Arc<Vec<u8>>,
    /// Which of a collection.
    pub index: u32,
}

impl std::fmt::Debug for Font {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Font").field("name", &self.name).field("index", &self.index).finish_non_exhaustive()
    }
}

/// Where it stands in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Corner {
    /// Where the eye begins to read.
    #[default]
    UpperRight,
    /// Where it ends above.
    UpperLeft,
    /// Where it begins below.
    LowerRight,
    /// Where it ends.
    LowerLeft,
}

impl Corner {
    /// All with their names.
    pub const ALL: [(Self, &'static str); 4] = [
        (Self::UpperRight, "upper-right"),
        (Self::UpperLeft, "upper-left"),
        (Self::LowerRight, "lower-right"),
        (Self::LowerLeft, "lower-left"),
    ];
}

/// How a seal is cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carving {
    /// Characters are cut away.
    #[default]
    White,
    /// Characters stand, within a frame.
    Red,
}

impl Carving {
    /// Both with their names.
    pub const ALL: [(Self, &'static str); 2] = [(Self::White, "white"), (Self::Red, "red")];
}

/// Inscription and seal.
#[derive(Clone, Debug)]
pub struct Signature {
    /// Columns, as lines of text; none where it is empty.
    pub inscription: String,
    /// Side of a character of it, pixels of a picture of 1080 lines.
    pub size: f32,
    /// Characters of the seal; none where it is empty.
    pub seal: String,
    /// What is cut into the seal instead of characters.
    pub design: Option<Design>,
    /// Side of the seal, pixels of a picture of 1080 lines.
    pub seal_size: f32,
    /// How it is cut.
    pub carving: Carving,
    /// Where they stand.
    pub corner: Corner,
    /// What characters look like; there may be none where nothing is written.
    pub font: Option<Font>,
}

/// A seal's design from a picture: closed curves in its pixels, holes winding the other way.
#[derive(Clone, Debug)]
pub struct Design {
    name: String,
    form: Path,
}

/// Most pixels of a side of a design's picture that are traced; a larger one is averaged down.
const MOST_OF_DESIGN: usize = 1024;

impl Design {
    /// From a picture whose ink is black or coloured on white, or on nothing (channel A); `name` is its own, for vectors and errors.
    pub fn new(name: &str, picture: &Image) -> Result<Self, InkError> {
        let wrong = |what: &str| InkError::Preset(format!("{name}: {what}"));
        let rgb: Option<Vec<usize>> = ["R", "G", "B"].iter().map(|c| picture.channel(c)).collect();
        let rgb =
            rgb.or_else(|| Some(vec![picture.channel("Y")?])).ok_or_else(|| wrong("it has no colours"))?;
        let alpha = picture.channel("A");
        let step = picture.width.max(picture.height).div_ceil(MOST_OF_DESIGN).max(1);
        let size = [picture.width / step, picture.height / step];
        let ink = |x: usize, y: usize| {
            let pixel = picture.pixel(x, y);
            let light = rgb.iter().map(|c| pixel[*c]).sum::<f32>() / rgb.len() as f32;
            let dark = 1.0 - linear_to_srgb(light.clamp(0.0, 1.0));
            dark * alpha.map_or(1.0, |a| pixel[a].clamp(0.0, 1.0))
        };
        let mean = |i: usize| {
            let (x, y) = (i % size[0] * step, i / size[0] * step);
            let all = (y..y + step).flat_map(|y| (x..x + step).map(move |x| ink(x, y)));
            all.sum::<f32>() / (step * step) as f32
        };
        let mut cover: Vec<f32> = (0..size[0] * size[1]).map(mean).collect();
        let most = cover.iter().copied().fold(0.0, f32::max);
        // Vermilion is not black; what is half as dark as the darkest is ink.
        if most.is_nan() || most < 0.2 {
            return Err(wrong(
                "there is nothing dark in it that could be a seal: expected black on white or on nothing",
            ));
        }
        cover.iter_mut().for_each(|v| *v = if v.is_nan() { 0.0 } else { *v / most });
        let mut form = PathBuilder::new();
        for outline in isoline::outlines(&cover, size) {
            for (i, p) in outline.into_iter().enumerate() {
                if i == 0 { form.move_to(p.x, p.y) } else { form.line_to(p.x, p.y) }
            }
            form.close();
        }
        let form = form.finish().ok_or_else(|| wrong("what is dark in it has no area"))?;
        Ok(Self { name: name.into(), form })
    }

    /// Its longer side fills that of a square at a corner.
    fn mark(&self, at: Vec2, side: f32) -> Option<Mark> {
        let b = self.form.bounds();
        let scale = side / b.width().max(b.height()).max(1e-3);
        let middle = at + 0.5 * side - scale * vec2(b.left() + b.right(), b.top() + b.bottom()) / 2.0;
        let placed = Transform::from_row(scale, 0.0, 0.0, scale, middle.x, middle.y);
        let form = self.form.clone().transform(placed)?;
        Some(Mark { layer: Layer::Seal, text: self.name.clone(), form, cut: None })
    }
}

/// Side of a character where nobody says: a twenty-seventh of the picture's height, by eye.
pub const SIZE: f32 = 40.0;
/// Side of a seal where nobody says.
pub const SEAL_SIZE: f32 = 58.0;
/// Most characters of a seal: a square of four.
const MOST_OF_SEAL: usize = 16;
/// From the edge of the picture, pixels of a picture of 1080 lines.
const MARGIN: f32 = 54.0;
/// From one character to the next below, and from one column to the next, in sides of a character.
const STEP: [f32; 2] = [1.06, 1.3];
/// Load of ink of an inscription, and of paste of a seal.
const LOADS: [f32; 2] = [1.5, 1.1];

/// A thing that is written or pressed, in pixels of the picture.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Its layer of ink.
    pub layer: Layer,
    /// What it says.
    pub text: String,
    /// Its form.
    pub form: Path,
    /// What is cut out of it.
    pub cut: Option<Path>,
}

impl Signature {
    /// What it comes to in a picture of so many pixels, of which `unit` stand for one of 1080 lines.
    pub fn marks(&self, [width, height]: [u32; 2], unit: f32) -> Result<Vec<Mark>, InkError> {
        let font = self.font.as_ref().map(|own| {
            FontRef::from_index(&own.bytes, own.index)
                .map(|font| (font, &own.name))
                .map_err(|e| InkError::Preset(format!("{}: no font that can be read: {e}", own.name)))
        });
        let font = font.transpose()?;
        let glyph = |c: char| match &font {
            Some((font, name)) => outline(font, c, name),
            None => Err(InkError::Preset(format!("there is no font to write '{c}' with"))),
        };
        let (side, seal, margin) = (self.size * unit, self.seal_size * unit, MARGIN * unit);
        let room = height as f32 - 2.0 * margin;
        let rows = ((room / (STEP[0] * side)) as usize).max(1);
        let lines = self.inscription.lines().map(|l| l.trim().chars().collect::<Vec<char>>());
        let columns: Vec<Vec<char>> = lines
            .filter(|l| !l.is_empty())
            .flat_map(|l| l.chunks(rows).map(<[char]>::to_vec).collect::<Vec<_>>())
            .collect();
        let tall = |column: &[char]| column.len() as f32 * STEP[0] * side;
        let gap = 0.4 * side;
        let with_seal = self.design.is_some() || !self.seal.trim().is_empty();
        let under = columns.last().map_or(0.0, |c| tall(c) + gap);
        // The seal stands under the last column, or left of it where there is no room or it would lie over the one
        // beside.
        let step = STEP[1] * side;
        let fits = under + seal <= room && (columns.len() == 1 || seal <= 2.0 * step - side);
        let (own, under) = if !columns.is_empty() && fits { (false, under) } else { (true, 0.0) };
        let overhang = if with_seal && !own { (seal - step).max(0.0) } else { 0.0 };
        // From the right of the columns to the middle of the first.
        let first = 0.5 * if columns.len() == 1 { step + overhang } else { step };
        let of_columns = first + (columns.len() as f32 - 0.5) * step + 0.5 * overhang;
        let block = vec2(
            of_columns + if with_seal && own { seal } else { 0.0 },
            columns.iter().map(|c| tall(c)).fold(0.0, f32::max).max(if with_seal {
                under + seal
            } else {
                0.0
            }),
        );
        let whole = vec2(width as f32, height as f32);
        if block.x > whole.x - 2.0 * margin || block.y > room {
            return Err(InkError::Preset(format!(
                "inscription and seal need {:.0} x {:.0} pixels, and the picture has {width} x {height} with their margins: \
                 shorten them or make them smaller",
                block.x, block.y
            )));
        }
        let (right, top) = match self.corner {
            Corner::UpperRight => (whole.x - margin, margin),
            Corner::UpperLeft => (margin + block.x, margin),
            Corner::LowerRight => (whole.x - margin, whole.y - margin - block.y),
            Corner::LowerLeft => (margin + block.x, whole.y - margin - block.y),
        };
        let mut marks = Vec::new();
        let middle = |column: usize| right - first - column as f32 * step;
        for (i, column) in columns.iter().enumerate() {
            let mut form = PathBuilder::new();
            for (k, c) in column.iter().enumerate() {
                let Some(glyph) = glyph(*c)? else { continue };
                // The square of an em, which reaches .12 below the line in fonts of East Asia; characters of others stand alike.
                let line = top + (k as f32 * STEP[0] + 0.88) * side;
                let bounds = glyph.bounds();
                let x = middle(i) - side * (bounds.left() + bounds.right()) / 2.0;
                let placed = Transform::from_row(side, 0.0, 0.0, -side, x, line);
                if let Some(glyph) = glyph.transform(placed) {
                    form.push_path(&glyph);
                }
            }
            if let Some(form) = form.finish() {
                let text = column.iter().collect();
                marks.push(Mark { layer: Layer::Inscription, text, form, cut: None });
            }
        }
        if with_seal {
            let x = if own { right - of_columns - seal / 2.0 } else { middle(columns.len() - 1) };
            let at = vec2(x - seal / 2.0, top + under);
            marks.push(match self.design.as_ref().and_then(|design| design.mark(at, seal)) {
                Some(mark) => mark,
                None => self.seal(at, seal, &glyph)?,
            });
        }
        Ok(marks)
    }

    /// The seal between two corners.
    fn seal(
        &self,
        at: Vec2,
        side: f32,
        glyph: &dyn Fn(char) -> Result<Option<Path>, InkError>,
    ) -> Result<Mark, InkError> {
        let text: Vec<char> = self.seal.chars().filter(|c| !c.is_whitespace()).collect();
        if text.len() > MOST_OF_SEAL {
            return Err(InkError::Preset(format!(
                "a seal of {} characters cannot be read: at most {MOST_OF_SEAL}",
                text.len()
            )));
        }
        let columns = ((text.len() as f32).sqrt() - 0.5).ceil().max(1.0) as usize;
        let rows = text.len().div_ceil(columns).max(1);
        // Stone is left about what is cut, more where a frame stands.
        let (border, frame) = match self.carving {
            Carving::White => (0.075 * side, 0.0),
            Carving::Red => (0.13 * side, 0.055 * side),
        };
        let cell = vec2((side - 2.0 * border) / columns as f32, (side - 2.0 * border) / rows as f32);
        let between = 0.08 * cell.min_element();
        let mut characters = PathBuilder::new();
        for (k, c) in text.iter().enumerate() {
            let Some(path) = glyph(*c)? else { continue };
            let bounds = path.bounds();
            let (column, row) = (k / rows, k % rows);
            let corner = at + border + vec2((columns - 1 - column) as f32, row as f32) * cell + between / 2.0;
            let room = cell - between;
            // Characters of a seal fill their places; one that is a line stays one.
            let mut scale = room / vec2(bounds.width().max(1e-3), bounds.height().max(1e-3));
            scale = scale.min(2.0 * Vec2::splat(scale.min_element()));
            let centre = corner + room / 2.0;
            let (x, y) = (
                centre.x - scale.x * (bounds.left() + bounds.right()) / 2.0,
                centre.y + scale.y * (bounds.top() + bounds.bottom()) / 2.0,
            );
            let turned = Transform::from_row(scale.x, 0.0, 0.0, -scale.y, x, y);
            if let Some(path) = path.transform(turned) {
                characters.push_path(&path);
            }
        }
        let characters = characters.finish();
        let stone = worn(at, side, 0.0).ok_or_else(|| InkError::Preset("the seal has no size".into()))?;
        let text = text.iter().collect();
        let (form, cut) = match self.carving {
            Carving::White => (stone, characters),
            Carving::Red => {
                // The frame, and what stands in it.
                let mut form = PathBuilder::new();
                let inner = worn(at + frame, side - 2.0 * frame, 7.0);
                form.push_path(&stone);
                // The other way round, so that it is a hole.
                inner.iter().for_each(|p| reversed(p, &mut form));
                characters.iter().for_each(|p| form.push_path(p));
                let form = form.finish().ok_or_else(|| InkError::Preset("the seal has no size".into()))?;
                (form, None)
            }
        };
        Ok(Mark { layer: Layer::Seal, text, form, cut })
    }
}

/// A square whose edges a knife and years have worn.
fn worn(at: Vec2, side: f32, seed: f32) -> Option<Path> {
    /// Points of an edge.
    const POINTS: usize = 28;
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from);
    let points = (0..4 * POINTS).map(|i| {
        let (edge, t) = (i / POINTS, (i % POINTS) as f32 / POINTS as f32);
        let p = corners[edge].lerp(corners[(edge + 1) % 4], t);
        let out = p - 0.5;
        // Corners are rounded, edges waver by a hundredth.
        let round = 0.035 * ((2.0 * out.abs().min_element()).powi(10));
        let waver = 0.012 * noise(Vec3::new(3.1 * p.x + seed, 3.1 * p.y, 0.7)).0
            + 0.003 * noise(Vec3::new(9.0 * p.x, 9.0 * p.y, seed)).0;
        at + side * (0.5 + out * (1.0 - 2.0 * round + waver))
    });
    polygon(points)
}

/// Adds a polygon the other way round.
fn reversed(path: &Path, to: &mut PathBuilder) {
    for (i, p) in path.points().iter().rev().enumerate() {
        if i == 0 { to.move_to(p.x, p.y) } else { to.line_to(p.x, p.y) }
    }
    to.close();
}

/// The outline of a character where an em is one, y up; `None` of what has none, as a space.
fn outline(font: &FontRef, c: char, name: &str) -> Result<Option<Path>, InkError> {
    let missing = || {
        InkError::Preset(format!(
            "{name} has no character '{c}' (U+{:04X}): name a font that has it by --font",
            u32::from(c)
        ))
    };
    let id = font.charmap().map(c).filter(|id| id.to_u32() != 0).ok_or_else(missing)?;
    let glyph = font.outline_glyphs().get(id).ok_or_else(missing)?;
    let mut pen = Pen(PathBuilder::new());
    let settings = DrawSettings::unhinted(Size::new(1.0), LocationRef::default());
    glyph.draw(settings, &mut pen).map_err(|_| missing())?;
    Ok(pen.0.finish())
}

struct Pen(PathBuilder);

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.0.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.0.line_to(x, y);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        self.0.quad_to(cx, cy, x, y);
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        self.0.cubic_to(ax, ay, bx, by, x, y);
    }

    fn close(&mut self) {
        self.0.close();
    }
}

impl Mark {
    /// Its load of ink or paste at each pixel, row after row, added to `loads`. A seal's paste lies unevenly and misses specks
    /// of the paper; a brush has more ink in some places than in others.
    pub fn print(&self, [width, height]: [u32; 2], unit: f32, loads: &mut [f32]) {
        let cover = |path: &Path| {
            let mut mask = Mask::new(width, height)?;
            mask.fill_path(path, FillRule::Winding, true, Transform::identity());
            Some(mask.take())
        };
        let Some(form) = cover(&self.form) else { return };
        let cut = self.cut.as_ref().and_then(cover);
        let (load, fine, coarse, specks) = match self.layer {
            Layer::Seal => (LOADS[1], 2.2, 19.0, 0.34),
            _ => (LOADS[0], 3.0, 46.0, 0.62),
        };
        for (i, (to, covered)) in loads.iter_mut().zip(form).enumerate().filter(|(_, (_, c))| *c > 0) {
            let left =
                f32::from(covered) / 255.0 * (1.0 - cut.as_ref().map_or(0.0, |c| f32::from(c[i]) / 255.0));
            let (x, y) = ((i % width as usize) as f32 / unit, (i / width as usize) as f32 / unit);
            let slow = noise(Vec3::new(x / coarse, y / coarse, 0.3)).0;
            let quick = noise(Vec3::new(x / fine, y / fine, 5.3)).0;
            let missed = ((quick + 0.5 * slow - specks) * 6.0).clamp(0.0, 1.0);
            *to += load * left * (1.0 + 0.35 * slow) * (1.0 - missed);
        }
    }
}

/// The rectangle about a mark, for vectors.
pub fn around(mark: &Mark) -> Option<Path> {
    let b = mark.form.bounds();
    rectangle(vec2(b.left(), b.top()), vec2(b.right(), b.bottom()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signature() -> Signature {
        Signature {
            inscription: "abc\ndi".into(),
            size: 40.0,
            seal: "OHME".into(),
            seal_size: 60.0,
            carving: Carving::White,
            corner: Corner::UpperRight,
            design: None,
            font: Some(Font {
                name: "Hack".into(),
                bytes: Arc::new(epaint_default_fonts::HACK_REGULAR.to_vec()),
                index: 0,
            }),
        }
    }

    #[test]
    fn columns_run_to_the_left_and_the_seal_stands_under_the_last() {
        let size = [1920, 1080];
        for (corner, name) in Corner::ALL {
            let marks = Signature { corner, ..signature() }.marks(size, 1.0).expect("it fits");
            let b: Vec<tiny_skia::Rect> = marks.iter().map(|m| m.form.bounds()).collect();
            assert_eq!(b.len(), 3, "{name}");
            assert!(b[1].right() < b[0].left(), "the second column is left of the first: {name}");
            let centre = |r: &tiny_skia::Rect| 0.5 * (r.left() + r.right());
            assert!((centre(&b[2]) - centre(&b[1])).abs() < 2.0 && b[2].top() > b[1].bottom(), "{name}");
            assert!((b[2].width() - 60.0).abs() < 3.0);
            for r in &b {
                assert!(
                    r.left() > 50.0 && r.right() < 1870.0 && r.top() > 50.0 && r.bottom() < 1030.0,
                    "{name}"
                );
                assert_eq!(name.contains("right"), r.left() > 960.0, "{name}");
                assert_eq!(name.contains("upper"), r.top() < 540.0, "{name}");
            }
        }
        // Half the picture, half of everything.
        let [large, small] =
            [(size, 1.0), ([960, 540], 0.5)].map(|(s, u)| signature().marks(s, u).expect("it fits"));
        for (a, b) in large.iter().zip(&small) {
            assert!((a.form.bounds().left() - 2.0 * b.form.bounds().left()).abs() < 0.1);
        }
        // A column that is too long goes on in the next.
        let long = Signature { inscription: "abcdefghij".repeat(4), ..signature() };
        assert_eq!(long.marks(size, 1.0).expect("it fits").len(), 3);
        // Whatever their sizes and numbers, all of them are in the picture, and the seal lies over no character.
        for (inscription, side, seal) in
            [("a", 4.0, 300.0), ("a", 40.0, 58.0), ("ab\ncd", 40.0, 58.0), ("ab\ncd", 20.0, 200.0)]
        {
            let own =
                Signature { inscription: inscription.into(), size: side, seal_size: seal, ..signature() };
            let marks = own.marks(size, 1.0).expect("it fits");
            let (last, columns) = marks.split_last().expect("a seal");
            let at = last.form.bounds();
            assert!(marks.iter().all(|m| {
                let b = m.form.bounds();
                b.left() >= 0.0
                    && b.top() >= 0.0
                    && b.right() <= size[0] as f32
                    && b.bottom() <= size[1] as f32
            }));
            assert!(
                columns.iter().all(|c| {
                    let b = c.form.bounds();
                    b.right() <= at.left()
                        || b.left() >= at.right()
                        || b.bottom() <= at.top()
                        || b.top() >= at.bottom()
                }),
                "{inscription} {side} {seal}"
            );
        }
        let alone = Signature { inscription: String::new(), ..signature() };
        assert_eq!(alone.marks(size, 1.0).expect("it fits").len(), 1);
    }

    /// What of the seal's square is printed: a white seal its ground, a red one its characters and its frame.
    #[test]
    fn seals_are_cut_in_white_or_in_red() {
        let print = |seal: &str, carving| {
            let own = Signature { inscription: String::new(), seal: seal.into(), carving, ..signature() };
            let size = [400, 300];
            let marks = Signature { seal_size: 120.0, ..own }.marks(size, 1.0).expect("it fits");
            let mut loads = vec![0.0; 400 * 300];
            marks[0].print(size, 1.0, &mut loads);
            let b = marks[0].form.bounds();
            (loads, b)
        };
        let inked = |carving, seal: &str| {
            let (loads, b) = print(seal, carving);
            assert!(loads.iter().all(|v| v.is_finite() && *v >= 0.0));
            let outside = |i: usize| {
                let (x, y) = ((i % 400) as f32, (i / 400) as f32);
                x < b.left() - 1.0 || x > b.right() + 1.0 || y < b.top() - 1.0 || y > b.bottom() + 1.0
            };
            assert!(loads.iter().enumerate().all(|(i, v)| *v == 0.0 || !outside(i)));
            let area = b.width() * b.height();
            loads.iter().filter(|v| **v > 0.3).count() as f32 / area
        };
        let [white, red] = [Carving::White, Carving::Red].map(|c| inked(c, "HM"));
        let [white_i, red_i] = [Carving::White, Carving::Red].map(|c| inked(c, "|"));
        println!("printed of the square: white {white} and {white_i}, red {red} and {red_i}");
        assert!((0.35..0.85).contains(&white) && (0.3..0.75).contains(&red), "{white} {red}");
        // Less is cut away of a white one, and less stands in a red one.
        assert!(white_i > white && red_i < red);
    }

    /// A ring, black on white or red on nothing, becomes a seal with a hole, without any font.
    #[test]
    fn a_seal_is_cut_after_a_picture() {
        let ring = |channels: &[&str], ink: &[f32], paper: &[f32]| {
            let mut image = Image::new(200, 160, channels);
            for (i, pixel) in image.data.chunks_exact_mut(channels.len()).enumerate() {
                let r = vec2((i % 200) as f32 - 100.0, (i / 200) as f32 - 80.0).length();
                pixel.copy_from_slice(if (30.0..60.0).contains(&r) { ink } else { paper });
            }
            Design::new("ring.png", &image)
        };
        let black = ring(&["R", "G", "B"], &[0.0; 3], &[1.0; 3]);
        let red = ring(&["R", "G", "B", "A"], &[0.6, 0.05, 0.03, 1.0], &[0.0; 4]);
        for design in [black, red] {
            let own = Signature {
                inscription: String::new(),
                seal: String::new(),
                design: Some(design.expect("a design")),
                font: None,
                ..signature()
            };
            let marks = own.marks([400, 300], 1.0).expect("it fits");
            let b = marks[0].form.bounds();
            assert!(marks.len() == 1 && (b.width() - 60.0).abs() < 1.0 && (b.height() - 60.0).abs() < 1.0);
            let mut loads = vec![0.0; 400 * 300];
            marks[0].print([400, 300], 1.0, &mut loads);
            let at = |x: f32, y: f32| loads[(b.top() + y) as usize * 400 + (b.left() + x) as usize];
            let mean = |r: f32| {
                (0..40)
                    .map(|i| Vec2::from_angle(i as f32 / 40.0 * std::f32::consts::TAU) * r + 30.0)
                    .map(|p| at(p.x, p.y))
                    .sum::<f32>()
                    / 40.0
            };
            assert!(mean(22.0) > 0.5 && mean(8.0) == 0.0, "{} {}", mean(22.0), mean(8.0));
        }
        let blank = ring(&["R", "G", "B"], &[0.9; 3], &[1.0; 3]).expect_err("there is nothing").to_string();
        assert!(blank.contains("ring.png: there is nothing dark"), "{blank}");
    }

    #[test]
    fn what_cannot_be_written_is_said() {
        let said = |s: Signature| s.marks([640, 360], 1.0 / 3.0).expect_err("it cannot be").to_string();
        let wrong = said(Signature { seal: "山".into(), ..signature() });
        assert!(wrong.contains("Hack has no character '山' (U+5C71)") && wrong.contains("--font"), "{wrong}");
        let wrong = said(Signature { seal: "ABCDEFGHIJKLMNOPQ".into(), ..signature() });
        assert!(wrong.contains("17 characters") && wrong.contains("at most 16"), "{wrong}");
        let wrong = said(Signature { inscription: "word\n".repeat(60), ..signature() });
        assert!(wrong.contains("640 x 360") && wrong.contains("shorten"), "{wrong}");
        let font = Font { name: "x.ttf".into(), bytes: Arc::new(vec![0; 64]), index: 0 };
        let wrong = said(Signature { font: Some(font), ..signature() });
        assert!(wrong.contains("x.ttf: no font"), "{wrong}");
    }
}
