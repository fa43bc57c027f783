//! Mountings: what a painting hangs, rolls or folds in, as flat parts with a colour each.
//!
//! A plan is drawn once, in curves, and becomes pixels and vectors alike. Lengths of the hanging scroll follow the rule by
//! which mounters cut cloth (see [`MOUNTS`]); the others are proportioned by eye after museum pieces and are of no measured one.

use crate::InkError;
use crate::path::{self, polygon, rectangle};
use glam::{Vec2, Vec3, vec2};
use std::sync::OnceLock;
use tiny_skia::{FillRule, Mask, Path, Transform};
use yugen_optics::Image;
use yugen_optics::random::{hash_combine, unit_f32};

/// A way of mounting.
#[derive(Clone, Copy)]
pub struct Mount {
    /// For `--mount`.
    pub name: &'static str,
    /// What it is.
    pub doc: &'static str,
    /// The painting's corners are seen, where inscription and seal stand.
    pub corners: bool,
    plan: fn([f32; 2]) -> Plan,
}

/// All of them.
pub const MOUNTS: &[Mount] = &[
    Mount {
        name: "hanging",
        doc: "kakemono: silk around the painting, brocade strips above and below, wind bands, a roller with knobs",
        corners: true,
        plan: hanging,
    },
    Mount {
        name: "hand",
        doc: "makimono: a hand scroll, unrolled between its two rolls on a table",
        corners: true,
        plan: hand,
    },
    Mount {
        name: "fan",
        doc: "ogi: the leaf of a folding fan with its ribs; what lies beyond the leaf is cut off",
        corners: false,
        plan: fan,
    },
    Mount {
        name: "album",
        doc: "gajo: an album leaf, framed by silk on thick paper",
        corners: true,
        plan: album,
    },
];

impl Mount {
    /// The one called `name`.
    pub fn find(name: &str) -> Option<&'static Self> {
        MOUNTS.iter().find(|m| m.name == name)
    }

    /// Around a painting of so many pixels, by which all its lengths go, so that a film's frames are alike.
    ///
    /// # Errors
    /// [`InkError::TooLarge`] beyond 8191 pixels a side.
    pub fn around(&self, size: [u32; 2]) -> Result<Mounting, InkError> {
        let plan = (self.plan)(size.map(|n| n as f32));
        let (from, to) = (plan.frame.0.floor(), plan.frame.1.ceil());
        // Films want an even number of pixels.
        let even = |n: f32| (n as u32).next_multiple_of(2);
        let whole = [even(to.x - from.x), even(to.y - from.y)];
        if whole.iter().any(|n| *n > MOST) {
            let [w, h] = whole;
            return Err(InkError::TooLarge(format!(
                "a painting of {} x {} pixels mounted as '{}' has {w} x {h}, and at most {MOST} a side are drawn: choose a \
                 smaller size",
                size[0], size[1], self.name
            )));
        }
        let shift = Transform::from_translate(-from.x, -from.y);
        let moved = |p: Path| p.transform(shift);
        let parts = plan.parts.into_iter().filter_map(|p| Some(Part { path: p.path.transform(shift)?, ..p }));
        let mut parts: Vec<Part> = parts.collect();
        // What is behind it all reaches to the edges of whole pixels.
        let behind = rectangle(Vec2::ZERO, Vec2::from(whole.map(|n| n as f32)));
        if let (Some(first), Some(path)) = (parts.first_mut(), behind) {
            first.path = path;
        }
        Ok(Mounting {
            size: whole,
            at: (-from).to_array().map(|v| v as u32),
            painting: size,
            parts,
            leaf: plan.leaf.and_then(moved),
            unit: plan.unit,
            composed: OnceLock::new(),
        })
    }
}

/// Most pixels of a side: beyond, the rasteriser works in tiles.
const MOST: u32 = 8191;

/// Parts in pixels of the painting, whose upper left corner is zero.
struct Plan {
    /// Upper left and lower right corner of the whole picture.
    frame: (Vec2, Vec2),
    parts: Vec<Part>,
    leaf: Option<Path>,
    unit: f32,
}

/// A mounting around a painting.
#[derive(Clone, Debug)]
pub struct Mounting {
    /// Pixels of the whole picture, even numbers.
    pub size: [u32; 2],
    /// Where in it the painting's upper left corner lies.
    pub at: [u32; 2],
    /// Pixels of the painting.
    pub painting: [u32; 2],
    /// From the back to the front.
    pub parts: Vec<Part>,
    /// What is left of the painting, where that is not all of it.
    pub leaf: Option<Path>,
    /// Side of a figure of the brocade, pixels.
    pub unit: f32,
    /// Made when the first picture is framed, for all that follow.
    composed: OnceLock<Composed>,
}

/// A mounting in pixels, row after row.
#[derive(Clone, Debug)]
struct Composed {
    /// How much is left of the painting, 0 to 255, where that is not all of it.
    leaf: Option<Vec<u8>>,
    /// What is behind the painting.
    back: Vec<Vec3>,
    /// What is over it: colour times cover, and cover.
    front: Vec<(Vec3, f32)>,
}

/// A part of a mounting, in pixels of the whole picture.
#[derive(Clone, Debug)]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// Its form.
    pub path: Path,
    /// What it is made of.
    pub cloth: Cloth,
    /// It lies over the painting.
    pub over: bool,
}

/// What a part looks like.
#[derive(Clone, Copy, Debug)]
pub struct Cloth {
    /// Linear sRGB.
    pub colour: Vec3,
    /// How much of what lies under it it hides.
    pub cover: f32,
    /// Of the figure that is woven into it, linear sRGB: linked rings (shippo).
    pub figure: Option<Vec3>,
    /// It is round about its long axis, as a rod is.
    pub rod: bool,
    /// How much threads and fibres differ.
    pub grain: f32,
}

/// From numbers as of a colour of a web page.
fn colour(srgb: u32) -> Vec3 {
    let at = |shift: u32| yugen_optics::colour::srgb_to_linear((srgb >> shift & 0xff) as f32 / 255.0);
    Vec3::new(at(16), at(8), at(0))
}

fn plain(srgb: u32) -> Cloth {
    Cloth { colour: colour(srgb), cover: 1.0, figure: None, rod: false, grain: 0.04 }
}

fn brocade(srgb: u32, figure: u32) -> Cloth {
    Cloth { figure: Some(colour(figure)), grain: 0.05, ..plain(srgb) }
}

fn rod(srgb: u32) -> Cloth {
    Cloth { rod: true, grain: 0.015, ..plain(srgb) }
}

fn part(name: &'static str, path: Option<Path>, cloth: Cloth) -> Option<Part> {
    Some(Part { name, path: path?, cloth, over: false })
}

const WALL: u32 = 0xcfc8ba;
const TABLE: u32 = 0x4a3d33;

/// The rule of mounters (hyosoya.ocnk.net/page/15 gives it as the common one): both brocade strips together are one unit, the
/// upper twice the lower; the middle cloth is one unit below and two above; earth is what these two are together, heaven twice
/// that; pillars are a little narrower than the middle cloth below; wind bands are a twenty-fifth of the whole width. The unit,
/// 6 cm there, is a sixth of the painting's shorter side here.
fn hanging([w, h]: [f32; 2]) -> Plan {
    let u = w.min(h) / 6.0;
    let side = 0.9 * u;
    let (left, right) = (-side, w + side);
    let strips = [2.0 / 3.0 * u, u / 3.0];
    let middle = [-strips[0] - 2.0 * u, h + strips[1] + u];
    let (top, bottom) = (middle[0] - 6.0 * u, middle[1] + 3.0 * u);
    let wide = right - left;
    let band = wide / 25.0;
    let bands = [left + wide / 3.0 - band / 2.0, right - wide / 3.0 - band / 2.0];
    let rings = bands.map(|x| x + band / 2.0);
    let (gold, ground, silk, damask) = (0xb99a55, 0x27324a, 0x8d8672, 0xc9bda0);
    let (r, cord) = (0.27 * u, 0.035 * u);
    let peak = vec2(w / 2.0, top - 1.1 * u);
    let wall = (vec2(left - 1.1 * u, peak.y - 0.5 * u), vec2(right + 1.1 * u, bottom + 1.1 * u));
    let line = |a: Vec2, b: Vec2| {
        let across = (b - a).perp().normalize_or_zero() * cord;
        polygon([a - across, b - across, b + across, a + across])
    };
    let strip = brocade(ground, gold);
    let parts = [
        part("wall", rectangle(wall.0, wall.1), Cloth { grain: 0.02, ..plain(WALL) }),
        part("cord", line(vec2(rings[0], top), peak), plain(0x6d5a3a)),
        part("cord", line(vec2(rings[1], top), peak), plain(0x6d5a3a)),
        part("knob", rectangle(vec2(left - 0.5 * u, bottom - r), vec2(left, bottom + r)), rod(0x3a2418)),
        part("knob", rectangle(vec2(right, bottom - r), vec2(right + 0.5 * u, bottom + r)), rod(0x3a2418)),
        part("heaven and earth", rectangle(vec2(left, top), vec2(right, bottom)), plain(silk)),
        part("middle", rectangle(vec2(left, middle[0]), vec2(right, middle[1])), brocade(damask, 0xbfb191)),
        part("strip", rectangle(vec2(0.0, -strips[0]), vec2(w, 0.0)), strip),
        part("strip", rectangle(vec2(0.0, h), vec2(w, h + strips[1])), strip),
        part("wind band", rectangle(vec2(bands[0], top), vec2(bands[0] + band, middle[0])), strip),
        part("wind band", rectangle(vec2(bands[1], top), vec2(bands[1] + band, middle[0])), strip),
        part("rod", rectangle(vec2(left, top - 0.1 * u), vec2(right, top + 0.14 * u)), rod(0x7d7663)),
        part("roller", rectangle(vec2(left, bottom - 0.2 * u), vec2(right, bottom + 0.2 * u)), rod(silk)),
    ];
    Plan { frame: wall, parts: parts.into_iter().flatten().collect(), leaf: None, unit: u / 6.0 }
}

/// A border of an eighteenth of the height; silk before the painting, a strip of brocade and paper behind it, and a roll at
/// either end, of which the left one holds what has not been seen.
fn hand([w, h]: [f32; 2]) -> Plan {
    let border = h / 18.0;
    let (top, bottom) = (-border, h + border);
    let (before, after) = (0.35 * h, 0.22 * h);
    let (left, right) = (-after, w + before);
    let (thin, thick) = (0.05 * h, 0.085 * h);
    let table = (
        vec2(left - 2.0 * thick - 0.12 * h, top - 0.2 * h),
        vec2(right + 2.0 * thin + 0.12 * h, bottom + 0.2 * h),
    );
    let knob =
        |x: f32, r: f32| rectangle(vec2(x - 0.55 * r, top - 0.05 * h), vec2(x + 0.55 * r, bottom + 0.05 * h));
    let roll = |x: f32, r: f32| rectangle(vec2(x - r, top), vec2(x + r, bottom));
    let silk = 0x8f9a86;
    let parts = [
        part("table", rectangle(table.0, table.1), Cloth { grain: 0.05, ..plain(TABLE) }),
        part("silk", rectangle(vec2(left, top), vec2(right, bottom)), brocade(silk, 0x87927d)),
        part("paper", rectangle(vec2(left, 0.0), vec2(-0.04 * h, h)), plain(0xe6dcc6)),
        part("strip", rectangle(vec2(w, top), vec2(w + 0.04 * h, bottom)), brocade(0x27324a, 0xb99a55)),
        part("strip", rectangle(vec2(-0.04 * h, top), vec2(0.0, bottom)), brocade(0x27324a, 0xb99a55)),
        part("knob", knob(left - thick, thick), rod(0xd9cdb4)),
        part("roll", roll(left - thick, thick), rod(silk)),
        part("knob", knob(right + thin, thin), rod(0xd9cdb4)),
        part("roll", roll(right + thin, thin), rod(0x27324a)),
    ];
    Plan { frame: table, parts: parts.into_iter().flatten().collect(), leaf: None, unit: h / 36.0 }
}

/// Half the angle to which it is opened: 120 degrees in all.
const OPEN: f32 = std::f32::consts::PI / 3.0;
/// Its inner radius, of the outer.
const INNER: f32 = 0.42;
/// Folds of the leaf: each rib has paper on both sides.
const RIBS: usize = 15;

/// The largest leaf that lies in the painting: a ring between two radii about the pivot, opened to 120 degrees.
fn fan([w, h]: [f32; 2]) -> Plan {
    let radius = (w / (2.0 * OPEN.sin())).min(h / (1.0 - INNER * OPEN.cos()));
    let inner = INNER * radius;
    let tall = radius - inner * OPEN.cos();
    let pivot = vec2(w / 2.0, (h - tall) / 2.0 + radius);
    let at = |r: f32, angle: f32| pivot + r * vec2(angle.sin(), -angle.cos());
    let angle = |i: f32| OPEN * (2.0 * i / (2 * RIBS) as f32 - 1.0);
    let ring = |from: f32, to: f32, a: f32, b: f32| {
        let arc = |r: f32, a: f32, b: f32| {
            let n = ((b - a).abs() * r / 2.0).ceil().clamp(2.0, 2000.0) as usize;
            (0..=n).map(move |i| at(r, a + (b - a) * i as f32 / n as f32))
        };
        polygon(arc(to, a, b).chain(arc(from, b, a)))
    };
    let margin = 0.09 * radius;
    let low = pivot.y + 0.13 * radius;
    let reach = radius * OPEN.sin();
    // The whole painting as well, of which most may be cut off.
    let first = vec2(w / 2.0 - reach, pivot.y - radius).min(Vec2::ZERO) - margin;
    let last = vec2((w / 2.0 + reach).max(w) + margin, low.max(h + margin));
    let table = (first, last);
    let stick = |a: f32, wide: f32, to: f32| {
        let [p, q] = [at(-0.05 * radius, a), at(to, a)];
        let across = (q - p).perp().normalize_or_zero() * wide;
        polygon([p - 0.6 * across, q - across, q + across, p + 0.6 * across])
    };
    let mut parts: Vec<Part> =
        part("table", rectangle(table.0, table.1), Cloth { grain: 0.05, ..plain(TABLE) })
            .into_iter()
            .collect();
    let guards = [0.0, 2.0 * RIBS as f32].map(angle);
    for i in 1..RIBS {
        parts.extend(part(
            "rib",
            stick(angle(2.0 * i as f32), 0.009 * radius, inner * 1.01),
            plain(0xa8865a),
        ));
    }
    for a in guards {
        parts.extend(part("guard", stick(a, 0.017 * radius, 0.985 * radius), plain(0x5b3a22)));
    }
    // Every other side of a fold is turned away from the light.
    for i in 0..RIBS {
        let side = ring(inner, radius, angle(2.0 * i as f32 + 1.0), angle(2.0 * i as f32 + 2.0));
        let shade = Cloth { colour: Vec3::ZERO, cover: 0.07, grain: 0.0, ..plain(0) };
        parts.extend(part("fold", side, shade).map(|p| Part { over: true, ..p }));
    }
    let edge = ring(0.988 * radius, radius, -OPEN, OPEN);
    let gold = Cloth { grain: 0.02, ..plain(0xb99a55) };
    parts.extend(part("edge", edge, gold).map(|p| Part { over: true, ..p }));
    parts.extend(
        part("pivot", path::disc(pivot, 0.022 * radius), plain(0xc8b070)).map(|p| Part { over: true, ..p }),
    );
    Plan { frame: table, parts, leaf: ring(inner, radius, -OPEN, OPEN), unit: radius / 40.0 }
}

/// Paper of a seventh of the shorter side around it, a line of gold, and silk of half as much.
fn album([w, h]: [f32; 2]) -> Plan {
    let u = w.min(h) / 7.0;
    let around = |by: f32| rectangle(vec2(-by, -by), vec2(w + by, h + by));
    let frame = (Vec2::splat(-1.95 * u), vec2(w, h) + 1.95 * u);
    let parts = [
        part("table", rectangle(frame.0, frame.1), Cloth { grain: 0.05, ..plain(TABLE) }),
        part("silk", around(1.5 * u), brocade(0x7d8a86, 0x747f7b)),
        part("paper", around(u), Cloth { grain: 0.025, ..plain(0xe9e1cf) }),
        part("line", around(0.09 * u), plain(0xb99a55)),
        part("paper", around(0.05 * u), Cloth { grain: 0.025, ..plain(0xe9e1cf) }),
    ];
    Plan { frame, parts: parts.into_iter().flatten().collect(), leaf: None, unit: u / 5.0 }
}

impl Cloth {
    /// At a pixel of the whole picture; `bounds`: of its part.
    fn at(&self, pixel: Vec2, bounds: tiny_skia::Rect, unit: f32) -> Vec3 {
        let mut colour = self.colour;
        if let Some(figure) = self.figure {
            colour = colour.lerp(figure, rings(pixel / unit.max(2.0)));
        }
        if self.rod {
            let flat = bounds.width() > bounds.height();
            let across = match flat {
                true => (pixel.y - bounds.top()) / bounds.height(),
                false => (pixel.x - bounds.left()) / bounds.width(),
            };
            colour *= round(across);
        }
        let [x, y] = pixel.to_array().map(|v| v as u32);
        // A thread of the warp, one of the weft, and where they cross.
        let hashes = [hash_combine(x, 1), hash_combine(y, 2), hash_combine(x, hash_combine(y, 3))];
        let thread = hashes.map(unit_f32).iter().sum::<f32>() / 1.5 - 1.0;
        (colour * (1.0 + self.grain * thread)).max(Vec3::ZERO)
    }
}

/// How light a rod is, of its colour, from one side (0) to the other: light comes from above and before.
pub(crate) fn round(across: f32) -> f32 {
    let y = (2.0 * across - 1.0).clamp(-1.0, 1.0);
    0.28 + 0.9 * (0.75 * (1.0 - y * y).sqrt() - 0.35 * y).max(0.0)
}

/// Half the breadth of a ring of [`rings`], of its radius.
pub(crate) const RING: f32 = 0.09;

/// Linked rings of radius one on a square grid of √2, so that four meet in the middle of each cell: 1 on the rings, 0 beside
/// them.
fn rings(p: Vec2) -> f32 {
    let side = std::f32::consts::SQRT_2;
    let nearest = |p: Vec2| {
        let q = p - side * (p / side).round();
        // The four rings about it.
        let around = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        around.into_iter().map(|o| ((q - side * Vec2::from(o)).length() - 1.0).abs()).fold(f32::MAX, f32::min)
    };
    (1.5 - nearest(p) / RING).clamp(0.0, 1.0)
}

impl Mounting {
    /// The painting in it: R, G and B over everything, channels of layers (NAME.R, G, B, A) padded with nothing, and where there
    /// are such the mounting as a layer `mount` of its own. `None` where the image is not of the painting's size.
    pub fn frame(&self, image: &Image) -> Option<Image> {
        let rgb: Option<Vec<usize>> = ["R", "G", "B"].iter().map(|c| image.channel(c)).collect();
        let (rgb, n) = (rgb?, image.channels.len());
        if [image.width, image.height] != self.painting.map(|n| n as usize) {
            return None;
        }
        let Composed { leaf, back, front } = self.composed.get_or_init(|| self.compose());
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let sheet = |at: usize| -> Option<(usize, f32)> {
            let [x, y] = [at % self.size[0] as usize, at / self.size[0] as usize];
            let (x, y) = (x.checked_sub(self.at[0] as usize)?, y.checked_sub(self.at[1] as usize)?);
            let inside = x < image.width && y < image.height;
            let left = leaf.as_ref().map_or(1.0, |leaf| f32::from(leaf[at]) / 255.0);
            inside.then_some((y * image.width + x, left)).filter(|_| left > 0.0)
        };
        let with_layers = n > 3;
        let mut channels = image.channels.clone();
        if with_layers {
            channels.extend(["R", "G", "B", "A"].map(|c| format!("mount.{c}")));
        }
        let mut data = Vec::with_capacity(pixels * channels.len());
        let mut row = vec![0.0f32; n];
        for at in 0..pixels {
            let (over, cover) = front[at];
            let below = sheet(at);
            let left = below.map_or(0.0, |(_, left)| left);
            row.fill(0.0);
            if let Some((from, left)) = below {
                row.copy_from_slice(&image.data[from * n..(from + 1) * n]);
                let alphas = image.channels.iter().zip(&mut row).filter(|(name, _)| name.ends_with(".A"));
                alphas.for_each(|(_, v)| *v *= left);
            }
            let own = Vec3::new(row[rgb[0]], row[rgb[1]], row[rgb[2]]);
            let shown = over + (1.0 - cover) * back[at].lerp(own, left);
            rgb.iter().zip(shown.to_array()).for_each(|(i, v)| row[*i] = v);
            data.extend_from_slice(&row);
            if with_layers {
                // Straight alpha: what covers the painting, and what is beside it.
                let alpha = cover + (1.0 - cover) * (1.0 - left);
                let mount = over + (1.0 - cover) * (1.0 - left) * back[at];
                let straight = if alpha > 0.0 { mount / alpha } else { Vec3::ZERO };
                data.extend_from_slice(&straight.extend(alpha).to_array());
            }
        }
        let [width, height] = self.size.map(|n| n as usize);
        Some(Image { width, height, channels, data })
    }

    /// Its parts in pixels, from the back to the front.
    fn compose(&self) -> Composed {
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let (mut back, mut front) = (vec![Vec3::ZERO; pixels], vec![(Vec3::ZERO, 0.0f32); pixels]);
        for part in &self.parts {
            let bounds = part.path.bounds();
            for (at, covered) in self.coverage(&part.path).into_iter().enumerate().filter(|(_, c)| *c > 0) {
                let a = f32::from(covered) / 255.0 * part.cloth.cover;
                let pixel = vec2(
                    (at % self.size[0] as usize) as f32 + 0.5,
                    (at / self.size[0] as usize) as f32 + 0.5,
                );
                let colour = part.cloth.at(pixel, bounds, self.unit);
                if part.over {
                    let (c, cover) = &mut front[at];
                    (*c, *cover) = (*c * (1.0 - a) + colour * a, *cover * (1.0 - a) + a);
                } else {
                    back[at] = back[at].lerp(colour, a);
                }
            }
        }
        Composed { leaf: self.leaf.as_ref().map(|leaf| self.coverage(leaf)), back, front }
    }

    /// How much of each pixel a path covers, 0 to 255.
    fn coverage(&self, path: &Path) -> Vec<u8> {
        let [w, h] = self.size;
        let Some(mut mask) = Mask::new(w, h) else { return Vec::new() };
        mask.fill_path(path, FillRule::Winding, true, Transform::identity());
        mask.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn painting([w, h]: [u32; 2]) -> Image {
        let names = ["R", "G", "B", "gou.R", "gou.G", "gou.B", "gou.A"];
        let mut image = Image::new(w as usize, h as usize, &names);
        image.data.iter_mut().enumerate().for_each(|(i, v)| *v = 0.1 + (i % 97) as f32 / 200.0);
        image
    }

    #[test]
    fn a_painting_stays_what_it_is_within_its_mounting() {
        for mount in MOUNTS {
            for size in [[120, 80], [81, 163], [1, 1], [300, 20]] {
                let mounting = mount.around(size).expect("it can be");
                let image = painting(size);
                let first = mounting.frame(&image).expect("it is of the size");
                let framed = mounting.frame(&image).expect("it is of the size");
                assert!(first.data == framed.data, "{}: a film's frames are alike", mount.name);
                let [w, h] = mounting.size.map(|n| n as usize);
                assert!(
                    (framed.width, framed.height) == (w, h) && w % 2 == 0 && h % 2 == 0,
                    "{}",
                    mount.name
                );
                assert!(framed.data.iter().all(|v| v.is_finite() && *v >= 0.0), "{}", mount.name);
                let channel = |name: &str| framed.channel(name).expect(name);
                let (alpha, ink) = (channel("mount.A"), channel("gou.A"));
                let (mut whole, mut inside) = (0, 0);
                for y in 0..h {
                    for x in 0..w {
                        let pixel = framed.pixel(x, y);
                        let own = (|| {
                            let (x, y) = (
                                x.checked_sub(mounting.at[0] as usize)?,
                                y.checked_sub(mounting.at[1] as usize)?,
                            );
                            (x < image.width && y < image.height).then(|| image.pixel(x, y))
                        })();
                        inside += usize::from(own.is_some());
                        // What is seen is the painting under the mounting, as its layer says.
                        for c in 0..3 {
                            let below = own.map_or(0.0, |p| p[c]);
                            let seen = below + (pixel[channel("mount.R") + c] - below) * pixel[alpha];
                            assert!((pixel[c] - seen).abs() < 1e-5, "{} {size:?} {x} {y}", mount.name);
                        }
                        match own {
                            Some(own) if pixel[alpha] == 0.0 => {
                                assert_eq!(pixel[..7], own[..7], "{} {x} {y}", mount.name);
                                whole += 1;
                            }
                            Some(own) => assert!(pixel[ink] <= own[6]),
                            None => {
                                assert!(pixel[alpha] == 1.0 && pixel[ink] == 0.0, "{} {x} {y}", mount.name);
                                assert!(pixel[0] > 1e-3, "nothing is behind {}: {x} {y}", mount.name);
                            }
                        }
                    }
                }
                assert_eq!(inside, image.width * image.height, "{}", mount.name);
                assert!(mount.name == "fan" || whole == inside, "{}: {whole} of {inside}", mount.name);
                assert!(mount.name != "fan" || whole < inside);
            }
        }
        let mounting = MOUNTS[0].around([10, 10]).expect("it can be");
        assert!(mounting.frame(&painting([10, 11])).is_none());
        let said = MOUNTS[0].around([6000, 6000]).expect_err("too large").to_string();
        assert!(said.contains("6000 x 6000") && said.contains("smaller size"), "{said}");
    }

    /// The lengths of the rule, read from the parts.
    #[test]
    fn a_hanging_scroll_is_cut_by_the_rule() {
        let mounting = MOUNTS[0].around([600, 900]).expect("it can be");
        let bounds = |name: &str| -> Vec<tiny_skia::Rect> {
            mounting.parts.iter().filter(|p| p.name == name).map(|p| p.path.bounds()).collect()
        };
        let (top, bottom) = (mounting.at[1] as f32, mounting.at[1] as f32 + 900.0);
        let (strips, middle, all) = (bounds("strip"), bounds("middle")[0], bounds("heaven and earth")[0]);
        let unit = strips[0].height() + strips[1].height();
        let near = |a: f32, b: f32| assert!((a - b).abs() < 0.01 * unit, "{a} {b}");
        near(strips[0].height(), 2.0 * strips[1].height());
        near(unit, 100.0);
        let below = middle.bottom() - strips[1].bottom();
        let above = strips[0].top() - middle.top();
        near(below, unit);
        near(above, 2.0 * below);
        let (earth, heaven) = (all.bottom() - middle.bottom(), middle.top() - all.top());
        near(earth, above + below);
        near(heaven, 2.0 * earth);
        near(bounds("wind band")[0].width(), all.width() / 25.0);
        near(strips[0].bottom(), top);
        near(strips[1].top(), bottom);
    }

    #[test]
    fn rings_are_linked() {
        let side = std::f32::consts::SQRT_2;
        assert_eq!((rings(vec2(1.0, 0.0)), rings(Vec2::ZERO)), (1.0, 0.0));
        // Where four of them meet, and the same in the next figure.
        assert_eq!(rings(vec2(side / 2.0, side / 2.0)), 1.0);
        for p in [vec2(0.3, 0.2), vec2(0.9, 0.4)] {
            assert!((rings(p) - rings(p + vec2(3.0 * side, -2.0 * side))).abs() < 1e-4);
        }
    }
}
