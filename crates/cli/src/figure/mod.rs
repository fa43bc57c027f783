//! A figure as a list of marks, written as SVG or drawn as PNG. Neither needs a font of the system: SVG leaves text
//! to its reader, PNG uses glyphs that come with the program.

pub mod chart;
pub mod colours;
pub mod curve;
pub mod scale;

use anyhow::{Context, Result};
use base64::Engine;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use std::fmt::Write;
use tiny_skia::{
    FillRule, FilterQuality, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke,
    StrokeDash, Transform,
};
use yugen_optics::Vec2;

/// sRGB, as on a display.
pub type Colour = [u8; 3];

/// What text is written in.
pub const INK: Colour = [45, 48, 54];
/// What axes are drawn in.
pub const RULE: Colour = [205, 208, 214];
/// Curves, told apart by people who see few colours too (Okabe and Ito 2008).
pub const CURVES: [Colour; 6] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [230, 159, 0], [86, 180, 233]];
/// Red, green and blue channels, of the same palette.
pub const CHANNELS: [Colour; 3] = [[213, 94, 0], [0, 158, 115], [0, 114, 178]];
/// How a line is broken: lengths drawn and left out, in turn; none for a line that goes through.
pub type Dash = &'static [f32];
/// For what is no curve.
const BROKEN: Dash = &[6.0, 4.0];
/// Around text that stands on curves.
const PAPER: Colour = [255, 255, 255];

/// Where text stands to its point.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    /// The part of a text's width that lies left of its point.
    fn shift(self) -> f32 {
        match self {
            Self::Start => 0.0,
            Self::Middle => 0.5,
            Self::End => 1.0,
        }
    }
}

enum Mark {
    Line { points: Vec<Vec2>, colour: Colour, width: f32, dash: Dash },
    Area { points: Vec<Vec2>, colour: Colour, opacity: f32 },
    Text { at: Vec2, text: String, anchor: Anchor, colour: Colour, upwards: bool },
    Picture { at: Vec2, size: Vec2, pixels: Pixmap },
}

/// Marks on white paper, the last on top; y points down.
pub struct Figure {
    size: Vec2,
    marks: Vec<Mark>,
}

/// Height of letters in units of the figure.
pub const LETTERS: f32 = 14.0;
/// From a line of text to the next.
pub const LINE: f32 = 20.0;
/// Width of a letter of the PNG; those of an SVG are as wide at most.
const LETTER: f32 = get_raster_width(FontWeight::Regular, RasterHeight::Size32) as f32 * LETTERS / 26.0;
/// Around a filled area, so that no paper shines through between neighbours.
const SEAM: f32 = 0.7;

impl Figure {
    pub fn new(width: f32, height: f32) -> Self {
        Self { size: Vec2::new(width, height), marks: Vec::new() }
    }

    /// In pixels, one to a unit.
    pub fn width(&self) -> u32 {
        self.size.x.ceil() as u32
    }

    pub fn line(&mut self, points: Vec<Vec2>, colour: Colour, width: f32) {
        self.broken(points, colour, width, &[]);
    }

    pub fn dashes(&mut self, points: Vec<Vec2>, colour: Colour, width: f32) {
        self.broken(points, colour, width, BROKEN);
    }

    pub fn broken(&mut self, points: Vec<Vec2>, colour: Colour, width: f32, dash: Dash) {
        self.marks.push(Mark::Line { points, colour, width, dash });
    }

    pub fn area(&mut self, points: Vec<Vec2>, colour: Colour, opacity: f32) {
        self.marks.push(Mark::Area { points, colour, opacity });
    }

    /// Text whose baseline stands at a point.
    pub fn text(&mut self, x: f32, y: f32, anchor: Anchor, text: impl Into<String>) {
        self.coloured_text(Vec2::new(x, y), anchor, text, INK);
    }

    pub fn coloured_text(&mut self, at: Vec2, anchor: Anchor, text: impl Into<String>, colour: Colour) {
        self.marks.push(Mark::Text { at, text: text.into(), anchor, colour, upwards: false });
    }

    /// Text that runs up the figure, as beside a vertical axis; its middle stands at the point.
    pub fn upwards(&mut self, x: f32, y: f32, text: impl Into<String>) {
        let (at, anchor) = (Vec2::new(x, y), Anchor::Middle);
        self.marks.push(Mark::Text { at, text: text.into(), anchor, colour: INK, upwards: true });
    }

    /// Lines of text from the top left corner, none of them cut at the right; returns where what follows may begin.
    pub fn heading(&mut self, lines: &[&str]) -> f32 {
        let mut y = 26.0;
        let width = self.size.x - 40.0;
        for line in lines.iter().flat_map(|line| wrapped(line, width)) {
            self.text(20.0, y, Anchor::Start, line);
            y += LINE;
        }
        y
    }

    /// The boxes that text takes, but for text that runs upwards.
    fn texts(&self) -> Vec<(Vec2, Vec2)> {
        let text = |mark: &Mark| match mark {
            Mark::Text { at, text, anchor, upwards: false, .. } => {
                let (width, up) = (text_width(text), Vec2::new(0.0, 12.0));
                let left = *at - anchor.shift() * width * Vec2::X - up;
                Some((left, left + Vec2::new(width, 15.0)))
            }
            _ => None,
        };
        self.marks.iter().filter_map(text).collect()
    }

    /// Whether a box lies on the paper.
    fn holds(&self, low: Vec2, high: Vec2) -> bool {
        low.cmpge(Vec2::ZERO).all() && high.cmple(self.size).all()
    }

    /// A disc with a white rim.
    pub fn dot(&mut self, at: Vec2, radius: f32, colour: Colour) {
        for (r, colour) in [(radius + 1.5, PAPER), (radius, colour)] {
            let ring = (0..24).map(|i| at + r * Vec2::from_angle(i as f32 / 24.0 * std::f32::consts::TAU));
            self.area(ring.collect(), colour, 1.0);
        }
    }

    /// Rows of `width` pixels, stretched to `size`.
    pub fn picture(&mut self, at: Vec2, size: Vec2, width: u32, rgb: &[Colour]) -> Result<()> {
        let height = rgb.len() as u32 / width.max(1);
        let mut pixels = Pixmap::new(width, height).context("a picture without pixels")?;
        for (to, [r, g, b]) in pixels.data_mut().chunks_exact_mut(4).zip(rgb) {
            to.copy_from_slice(&[*r, *g, *b, 255]);
        }
        self.marks.push(Mark::Picture { at, size, pixels });
        Ok(())
    }

    /// A square picture of `width` pixels a side, cut to a disc that takes 86 % of it.
    pub fn disc(&mut self, at: Vec2, size: f32, width: u32, rgb: &[Colour]) -> Result<()> {
        let mut pixels = Pixmap::new(width, width).context("a picture without pixels")?;
        let radius = 0.43 * width as f32;
        for (i, (to, rgb)) in pixels.data_mut().chunks_exact_mut(4).zip(rgb).enumerate() {
            let p = Vec2::new((i as u32 % width) as f32, (i as u32 / width) as f32) + 0.5;
            let cover = (radius + 0.5 - p.distance(Vec2::splat(0.5 * width as f32))).clamp(0.0, 1.0);
            let part = |c: u8| (f32::from(c) * cover).round() as u8;
            to.copy_from_slice(&[part(rgb[0]), part(rgb[1]), part(rgb[2]), part(255)]);
        }
        self.marks.push(Mark::Picture { at, size: Vec2::splat(size), pixels });
        Ok(())
    }

    /// An arrow that ends at `to`.
    pub fn arrow(&mut self, from: Vec2, to: Vec2, colour: Colour) {
        let along = (to - from).normalize_or_zero();
        let (back, side) = (to - 10.0 * along, 4.0 * along.perp());
        self.dashes(vec![from, back], colour, 1.5);
        self.area(vec![to, back + side, back - side], colour, 1.0);
    }

    pub fn svg(&self) -> Result<String> {
        let Vec2 { x: w, y: h } = self.size;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"sans-serif\" font-size=\"{}\">\n<rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>\n",
            LETTERS - 1.0
        );
        for mark in &self.marks {
            match mark {
                Mark::Line { points, colour, width, dash } => {
                    let list_of = |dash: Dash| dash.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
                    let dash = match dash {
                        [] => String::new(),
                        some => format!(" stroke-dasharray=\"{}\"", list_of(some)),
                    };
                    writeln!(
                        out,
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                         stroke-linejoin=\"round\"{dash}/>",
                        list(points),
                        hex(*colour)
                    )?;
                }
                Mark::Area { points, colour, opacity } => {
                    let how = if *opacity < 1.0 {
                        format!("fill-opacity=\"{opacity}\"")
                    } else {
                        format!(
                            "stroke=\"{}\" stroke-width=\"{SEAM}\" stroke-linejoin=\"round\"",
                            hex(*colour)
                        )
                    };
                    writeln!(out, "<polygon points=\"{}\" fill=\"{}\" {how}/>", list(points), hex(*colour))?;
                }
                Mark::Text { at, text, anchor, colour, upwards } => {
                    let turn = match upwards {
                        true => format!(" transform=\"rotate(-90 {:.1} {:.1})\"", at.x, at.y),
                        false => String::new(),
                    };
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    writeln!(
                        out,
                        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"{}\"{turn}>{}</text>",
                        at.x,
                        at.y,
                        hex(*colour),
                        text.replace('&', "&amp;").replace('<', "&lt;")
                    )?;
                }
                Mark::Picture { at, size, pixels } => {
                    let png = base64::engine::general_purpose::STANDARD.encode(pixels.encode_png()?);
                    writeln!(
                        out,
                        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" href=\"data:image/png;base64,{png}\"/>",
                        at.x, at.y, size.x, size.y
                    )?;
                }
            }
        }
        out.push_str("</svg>\n");
        Ok(out)
    }

    /// As a PNG `width` pixels wide.
    pub fn png(&self, width: u32) -> Result<Vec<u8>> {
        let scale = width as f32 / self.size.x;
        let mut paper =
            Pixmap::new(width, (self.size.y * scale).round() as u32).context("a picture without pixels")?;
        paper.fill(tiny_skia::Color::WHITE);
        let zoom = Transform::from_scale(scale, scale);
        for mark in &self.marks {
            match mark {
                Mark::Line { points, colour, width, dash } => {
                    let stroke = Stroke {
                        width: *width,
                        line_join: LineJoin::Round,
                        line_cap: if dash.is_empty() { LineCap::Round } else { LineCap::Butt },
                        dash: StrokeDash::new(dash.to_vec(), 0.0),
                        ..Stroke::default()
                    };
                    if let Some(path) = path(points, false) {
                        paper.stroke_path(&path, &paint(*colour, 1.0), &stroke, zoom, None);
                    }
                }
                Mark::Area { points, colour, opacity } => {
                    let Some(path) = path(points, true) else { continue };
                    let paint = paint(*colour, *opacity);
                    paper.fill_path(&path, &paint, FillRule::Winding, zoom, None);
                    if *opacity >= 1.0 {
                        let stroke = Stroke { width: SEAM, line_join: LineJoin::Round, ..Stroke::default() };
                        paper.stroke_path(&path, &paint, &stroke, zoom, None);
                    }
                }
                Mark::Text { at, text, anchor, colour, upwards } => {
                    write(&mut paper, scale, *at, text, *anchor, *colour, *upwards);
                }
                Mark::Picture { at, size, pixels } => {
                    let (x, y) = (size.x / pixels.width() as f32, size.y / pixels.height() as f32);
                    let place = Transform::from_translate(at.x, at.y).pre_scale(x, y).post_concat(zoom);
                    let how = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
                    paper.draw_pixmap(0, 0, pixels.as_ref(), &how, place, None);
                }
            }
        }
        Ok(paper.encode_png()?)
    }
}

/// How wide text is, at most.
pub fn text_width(text: &str) -> f32 {
    LETTER * text.chars().count() as f32
}

/// Text in lines no wider than `width`, broken at blanks; a word that is too long is broken where it must be.
pub fn wrapped(text: &str, width: f32) -> Vec<String> {
    let most = ((width / LETTER) as usize).max(1);
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let mut word: Vec<char> = word.chars().collect();
        loop {
            let line = lines.last_mut().expect("there is always a line");
            let used = line.chars().count();
            let blank = usize::from(used > 0);
            if used + blank + word.len() <= most {
                if blank == 1 {
                    line.push(' ');
                }
                line.extend(&word);
                break;
            }
            if used == 0 {
                line.extend(word.drain(..most));
            }
            lines.push(String::new());
        }
    }
    lines
}

fn write(
    paper: &mut Pixmap,
    scale: f32,
    at: Vec2,
    text: &str,
    anchor: Anchor,
    colour: Colour,
    upwards: bool,
) {
    let glyph = |c| get_raster(c, FontWeight::Regular, RasterHeight::Size32);
    let glyphs: Vec<_> = text.chars().filter_map(|c| glyph(c).or_else(|| glyph('?'))).collect();
    let width: usize = glyphs.iter().map(|g| g.width()).sum();
    let Some(mut line) = Pixmap::new(width as u32, RasterHeight::Size32.val() as u32) else { return };
    let mut left = 0;
    for glyph in &glyphs {
        for (y, row) in glyph.rows().enumerate() {
            for (x, &cover) in row.iter().enumerate() {
                let at = 4 * (y * width + left + x);
                let part = |c: u8| (u16::from(c) * u16::from(cover) / 255) as u8;
                line.data_mut()[at..at + 4].copy_from_slice(&[
                    part(colour[0]),
                    part(colour[1]),
                    part(colour[2]),
                    cover,
                ]);
            }
        }
        left += glyph.width();
    }
    // A line of glyphs is 32 high, its baseline at 25.
    let zoom = LETTERS / 26.0;
    let place = Transform::from_translate(-anchor.shift() * width as f32, -25.0)
        .post_scale(scale * zoom, scale * zoom)
        .post_rotate(if upwards { -90.0 } else { 0.0 })
        .post_translate(at.x * scale, at.y * scale);
    let how = PixmapPaint { quality: FilterQuality::Bicubic, ..PixmapPaint::default() };
    paper.draw_pixmap(0, 0, line.as_ref(), &how, place, None);
}

fn paint(colour: Colour, opacity: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(colour[0], colour[1], colour[2], (255.0 * opacity).round() as u8);
    paint
}

fn path(points: &[Vec2], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let (first, rest) = points.split_first()?;
    builder.move_to(first.x, first.y);
    rest.iter().for_each(|p| builder.line_to(p.x, p.y));
    if closed {
        builder.close();
    }
    builder.finish()
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn list(points: &[Vec2]) -> String {
    points.iter().map(|p| format!("{:.2},{:.2}", p.x, p.y)).collect::<Vec<_>>().join(" ")
}
