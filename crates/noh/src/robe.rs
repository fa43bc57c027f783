//! A karaori on a lacquered rack (ikō), as museums show it: hung by a rail through its sleeves, its back to the viewer.
//!
//! It is cut as kosode are, out of rectangles as wide as the loom wove: two panels of the body that run from the hem over
//! the shoulder, two of the sleeves, two half widths at the front edges, a collar. (u, v) is metres on the cloth: v along
//! the warp, which hangs down, u along the weft, with an offset of its own for every panel. The cloth is bent, never
//! stretched: a fold takes from the width what it needs.

use crate::layout::Layout;
use crate::part::{Finish, Parts};
use crate::pattern::{fbm, noise};
use crate::solid::{Axes, Grain, Grid, Solids, rectangle};
use glam::{Affine2, Vec2, Vec3};
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;
use yugen_reflectance::btf::{Btf, Moments};
use yugen_reflectance::{Choice, Kind, ParamType};
use yugen_scene::{Material, Scene, Texture, Wrap, suggest};

/// What a robe is made of: the maps of a cloth and their size.
#[derive(Clone, Debug)]
pub struct Robe {
    maps: Arc<Btf>,
    width: f32,
    form: Choice,
}

/// Why there is no such robe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RobeError {
    /// No cloth is so fine or so coarse.
    #[error("a cloth whose maps are {0} mm wide makes no robe; give from 0.1 to 10000 mm")]
    Width(f32),
    /// Not a form of the model `noh` that maps can have.
    #[error("the maps of a cloth have no form '{name}'{hint}")]
    Form {
        /// As given.
        name: String,
        /// End of the sentence.
        hint: String,
    },
}

impl Robe {
    /// Of maps in the working space, so many metres wide, by a form of the model `noh`.
    pub fn new(maps: Arc<Btf>, width: f32, form: &str) -> Result<Self, RobeError> {
        if !(1e-4..=10.0).contains(&width) {
            return Err(RobeError::Width(width * 1e3));
        }
        let form = Self::forms().find(|(name, _)| *name == form).map(|(_, form)| form).ok_or_else(|| {
            RobeError::Form { name: form.into(), hint: suggest(form, Self::forms().map(|f| f.0)) }
        })?;
        Ok(Self { maps, width, form })
    }

    /// The forms of the model `noh` that maps can have; the table of `ashikhmin2000` is for constant widths.
    pub fn forms() -> impl Iterator<Item = (&'static str, Choice)> {
        let names = match Kind::Noh.param("form").map(|(_, p)| p.kind) {
            Ok(ParamType::Choice(names)) => names,
            _ => &[],
        };
        names.iter().enumerate().map(|(i, n)| (*n, Choice(i as f32))).filter(|f| f.0 != "ashikhmin2000")
    }

    /// What renderers keep of the maps, with their pyramid.
    pub(crate) fn bytes(&self) -> usize {
        self.maps.texels.len() * Moments::COUNT * size_of::<f32>() * 4 / 3
    }

    /// Pushes its material.
    pub(crate) fn material(&self, scene: &mut Scene) {
        // A texel is as high as it is wide.
        let height = self.width * self.maps.height as f32 / self.maps.width as f32;
        let to_uv = Affine2::from_scale(Vec2::new(self.width, height).recip());
        let maps = self.maps.clone();
        scene.textures.push(Texture::Cloth { maps, wrap: Wrap::Repeat, to_uv });
        scene.materials.push(Material::Cloth { texture: scene.textures.len() - 1, form: self.form });
    }
}

/// What a seam takes of a panel on each side.
pub const SEAM: f32 = 0.012;
/// Radius of the rail.
const RAIL: f32 = 0.021;
/// Of the shoulder: the rail and what lies between it and the outside of the cloth.
const SHOULDER: f32 = RAIL + 0.004;
/// Half the length of the rack's feet.
const FOOT: f32 = 0.25;
/// Of the outer cloth, of the lining, and of the air between.
const CLOTH: f32 = 0.0007;
const LINING: f32 = 0.0005;
const AIR: f32 = 0.0006;
/// Half the width of the neck; how far below the shoulder the collar ends; how far a front passes the middle.
const NECK: f32 = 0.085;
const COLLAR_END: f32 = 0.75;
const OVERLAP: f32 = 0.15;
/// Half of what opens for the hand.
const CUFF: f32 = 0.2;

/// Folds of one layer: where they are at the shoulder's height and how far they drift in a metre; their width and
/// their height at the end, positive to the outside; between which heights below the shoulder they deepen. Metres. Chosen
/// to look like lined silk brocade of some two kilograms, which bends in few broad waves.
type Fold = [f32; 6];
const BACK: &[Fold] = &[
    [-0.305, 0.02, 0.040, 0.0230, 0.50, 1.40],
    [-0.215, -0.01, 0.046, -0.0203, 0.42, 1.40],
    [-0.118, 0.03, 0.050, 0.0284, 0.28, 1.40],
    [-0.035, -0.01, 0.038, -0.0175, 0.60, 1.40],
    [0.062, -0.02, 0.048, 0.0257, 0.36, 1.40],
    [0.150, 0.02, 0.044, -0.0230, 0.34, 1.40],
    [0.228, -0.03, 0.040, 0.0216, 0.30, 1.40],
    [0.300, 0.01, 0.034, -0.0121, 0.66, 1.40],
    // Of the sleeves.
    [-0.655, 0.05, 0.034, 0.0105, 0.06, 0.50],
    [-0.575, 0.10, 0.042, -0.0120, 0.08, 0.50],
    [-0.470, 0.06, 0.040, 0.0150, 0.05, 0.48],
    [-0.390, -0.04, 0.030, -0.0090, 0.10, 0.46],
    [0.395, 0.03, 0.032, -0.0105, 0.08, 0.46],
    [0.480, -0.08, 0.042, 0.0165, 0.05, 0.50],
    [0.570, -0.04, 0.038, -0.0105, 0.10, 0.48],
    [0.645, -0.10, 0.036, 0.0120, 0.06, 0.50],
];
const FRONT: &[Fold] = &[
    [-0.250, 0.03, 0.050, 0.0175, 0.45, 1.40],
    [-0.120, -0.02, 0.045, -0.0149, 0.50, 1.40],
    [0.020, 0.02, 0.055, 0.0162, 0.40, 1.40],
    [0.140, 0.01, 0.045, -0.0162, 0.35, 1.40],
    [0.260, -0.02, 0.050, 0.0175, 0.55, 1.40],
    [-0.560, 0.05, 0.045, 0.0120, 0.06, 0.50],
    [-0.450, -0.02, 0.040, -0.0105, 0.08, 0.50],
    [0.450, 0.02, 0.042, 0.0120, 0.06, 0.50],
    [0.580, -0.05, 0.045, -0.0105, 0.08, 0.50],
];

/// How the robe hangs. A place on it: `s` metres from the seam of the back towards +x, `t` metres below the shoulder,
/// positive on the back.
struct Hang {
    /// Middle of the rail.
    rail: Vec3,
    /// Of a panel, as it shows.
    width: f32,
    length: f32,
    sleeve: f32,
    collar: f32,
}

impl Hang {
    fn new(l: &Layout) -> Self {
        // In the middle of the floor two pillars would stand between it and the front fires.
        let z = -0.6 * l.hd;
        Self {
            rail: Vec3::new(0.0, l.floor(z) + l.get("rack_height") - RAIL, z),
            width: 0.5 * l.get("robe_half_span"),
            length: l.get("robe_length"),
            sleeve: l.get("robe_sleeve"),
            collar: l.get("robe_collar"),
        }
    }

    /// How nearly the layers of back and front meet: at the seams of the sides, below and at the ends of the sleeves.
    fn shut(&self, s: f32, t: f32) -> f32 {
        let (s, t) = (s.abs(), t.abs());
        let below = smoothstep(self.sleeve - 0.22, self.sleeve, t);
        if s < self.width {
            return below * smoothstep(self.width - 0.13, self.width, s);
        }
        let cuff =
            smoothstep(CUFF, CUFF + 0.08, t) * smoothstep(2.0 * self.width - 0.09, 2.0 * self.width, s);
        1.0 - (1.0 - below) * (1.0 - cuff)
    }

    /// Folds and waves, to the outside.
    fn fold(&self, s: f32, t: f32) -> f32 {
        let (folds, seed) = if t >= 0.0 { (BACK, 31) } else { (FRONT, 57) };
        let t = t.abs();
        let folds: f32 = folds
            .iter()
            .map(|[at, drift, width, height, from, to]| {
                let d = (s - at - drift * t) / width;
                // The table is for a robe of 1.4 m and sleeves of .53 m.
                let scale = if *to > 1.0 { self.length / 1.4 } else { self.sleeve / 0.53 };
                height * (-0.5 * d * d).exp() * smoothstep(from * scale, to * scale, t).sqrt()
            })
            .sum();
        // Long waves along the warp, and what handling leaves.
        let waves = 0.0035 * noise(Vec2::new(s / 0.19, t / 0.6) + 40.0, [4096; 2], seed)
            + 0.0022 * fbm(Vec2::new(s / 0.075, t / 0.26) + 40.0, [4096; 2], 2, seed + 1);
        (folds + waves) * smoothstep(0.04, 0.16, t)
    }

    /// How far in front of the rail's middle the outside is.
    fn out(&self, s: f32, t: f32) -> f32 {
        let quarter = FRAC_PI_2 * SHOULDER;
        let base = SHOULDER * (t.abs().min(quarter) / SHOULDER).sin();
        let shut = self.shut(s, t);
        // Where both layers meet they hang in the same wave, and keep from one another.
        let common = 0.006 * noise(Vec2::new(3.0 * s, t.abs() / 0.5) + 20.0, [4096; 2], 83);
        let side = if t < 0.0 { -1.0 } else { 1.0 };
        side * ((1.0 - shut) * (base + self.fold(s, t)) + shut * 0.003) + shut * common
    }

    /// How far a seam draws the cloth in.
    fn seam(&self, s: f32, t: f32) -> f32 {
        let along = |at: f32| (-((s.abs() - at) / 0.0045).powi(2)).exp();
        let pull = 1.0 + 0.5 * noise(Vec2::new(t / 0.03, 3.0 * s) + 60.0, [8192; 2], 91);
        0.0013 * pull * smoothstep(0.01, 0.06, t.abs()) * (along(0.0) + along(self.width))
    }

    /// The places of a row: as wide as the cloth is, less what folds take.
    fn row(&self, t: f32, columns: &[f32]) -> Vec<Vec3> {
        let quarter = FRAC_PI_2 * SHOULDER;
        let down = t.abs();
        let y = if down < quarter { SHOULDER * (down / SHOULDER).cos() } else { quarter - down };
        let slope = |s: f32| (self.out(s + 2e-4, t) - self.out(s - 2e-4, t)) / 4e-4;
        let (mut at, mut x) = (0.0f32, 0.0f32);
        let side = if t < 0.0 { -1.0 } else { 1.0 };
        columns
            .iter()
            .map(|s| {
                let steps = ((s - at).abs() / 0.005).ceil() as usize;
                let step = (s - at) / steps.max(1) as f32;
                for i in 0..steps {
                    let slope = slope(at + (i as f32 + 0.5) * step);
                    x += step * (1.0 - slope * slope).max(0.1).sqrt();
                }
                at = *s;
                self.rail + Vec3::new(x, y, self.out(*s, t) - side * self.seam(*s, t))
            })
            .collect()
    }

    /// Where the collar is sewn to a front, metres from the middle: negative beyond it.
    fn edge(&self, down: f32) -> f32 {
        NECK - (NECK + OVERLAP) * (down / COLLAR_END).min(1.0)
    }

    /// How far a front half lies to the outside of where it would without the other: the wearer's left, at −x, covers
    /// the right.
    fn lap(&self, s: f32, left: bool) -> f32 {
        let beyond = smoothstep(-0.06, 0.02, if left { s } else { -s });
        if left { 0.006 * beyond } else { -0.009 * beyond }
    }
}

/// A piece of cloth: places on the outside, and where they are on the cloth.
struct Sheet {
    places: Grid,
    cloth: Vec<Vec<Vec2>>,
}

impl Sheet {
    /// The surface so far below the outside.
    fn below(&self, depth: f32) -> Grid {
        let (rows, columns) = (self.places.len(), self.places[0].len());
        let at = |i: usize, j: usize| self.places[i][j];
        (0..rows)
            .map(|i| {
                (0..columns)
                    .map(|j| {
                        let down = at((i + 1).min(rows - 1), j) - at(i.saturating_sub(1), j);
                        let right = at(i, (j + 1).min(columns - 1)) - at(i, j.saturating_sub(1));
                        at(i, j) - down.cross(right).normalize_or(Vec3::Z) * depth
                    })
                    .collect()
            })
            .collect()
    }

    /// Adds it as a layer between two depths.
    fn layer(&self, s: &mut Solids, from: f32, to: f32, grain: Grain) {
        let outside = self.below(from);
        s.sheet(&outside, &self.below(to), &|i, j| grain.at(self.cloth[i][j]), true, grain);
    }
}

/// From one number to another by about a step.
fn even(from: f32, to: f32, step: f32) -> Vec<f32> {
    let n = ((to - from).abs() / step).ceil().max(1.0) as usize;
    (0..=n).map(|i| from + (to - from) * i as f32 / n as f32).collect()
}

/// Across a panel, as parts of its width: finer where its seams draw it in.
fn across() -> Vec<f32> {
    let ends = [0.0, 0.008, 0.017, 0.03];
    let mut all: Vec<f32> = ends.into_iter().chain(even(0.05, 0.95, 0.032)).collect();
    all.extend(ends.into_iter().rev().map(|e| 1.0 - e));
    all
}

/// Down a panel: finer over the shoulder.
fn down(from: f32, to: f32) -> Vec<f32> {
    let shoulder = 0.045;
    let mut all = even(from, shoulder, 0.005);
    all.extend(even(shoulder, to, 0.02).into_iter().skip(1));
    all
}

impl Hang {
    /// A panel between two edges, which may move with the height; rows in this order. `lap`: of a front.
    fn panel(&self, rows: &[f32], edges: impl Fn(f32) -> [f32; 2], lap: Option<bool>) -> Sheet {
        let mut sheet = Sheet { places: Vec::new(), cloth: Vec::new() };
        let across = across();
        for t in rows {
            let [a, b] = edges(*t);
            let columns: Vec<f32> = across.iter().map(|f| a + (b - a) * f).collect();
            let mut places = self.row(*t, &columns);
            if let Some(left) = lap {
                for (p, s) in places.iter_mut().zip(&columns) {
                    p.z -= self.lap(*s, left) * smoothstep(0.05, 0.25, t.abs());
                }
            }
            sheet.places.push(places);
            sheet.cloth.push(columns.iter().map(|s| Vec2::new(*s, *t)).collect());
        }
        sheet
    }

    /// Half of the back, `side` being −1 or 1; `inset` from all edges but the hem, which a lining passes by as much.
    fn back(&self, side: f32, inset: f32) -> Sheet {
        let (a, b) = (inset, self.width - inset);
        let edges = if side < 0.0 { [-b, -a] } else { [a, b] };
        self.panel(&down(inset, self.length + 2.0 * inset), |_| edges, None)
    }

    /// Half of the front.
    fn front(&self, side: f32, inset: f32) -> Sheet {
        let rows: Vec<f32> = down(inset, self.length + 2.0 * inset).into_iter().map(|t| -t).collect();
        let edges = |t: f32| {
            let (a, b) = (self.edge(-t).max(0.0) + inset, self.width - inset);
            // Right and left are as one sees it from the other side.
            if side < 0.0 { [-a, -b] } else { [b, a] }
        };
        self.panel(&rows, edges, Some(side < 0.0))
    }

    /// The half width at the edge of a front.
    fn half_width(&self, side: f32, inset: f32) -> Sheet {
        let top = COLLAR_END * NECK / (NECK + OVERLAP);
        let rows: Vec<f32> =
            even(top + 0.012 + inset, self.length + 2.0 * inset, 0.02).into_iter().map(|t| -t).collect();
        let edges = |t: f32| {
            let (a, b) = (self.edge(-t) + inset, -inset);
            if side < 0.0 { [-a, -b] } else { [b, a] }
        };
        self.panel(&rows, edges, Some(side < 0.0))
    }

    /// A sleeve, from its seam at the front over the shoulder to its seam at the back.
    fn sleeve(&self, side: f32, inset: f32) -> Sheet {
        let (a, b) = (self.width + inset, 2.0 * self.width - inset);
        let edges = if side < 0.0 { [-b, -a] } else { [a, b] };
        let half = down(0.0, self.sleeve - inset);
        let rows: Vec<f32> = half.iter().skip(1).rev().map(|t| -t).chain(half.iter().copied()).collect();
        self.panel(&rows, |_| edges, None)
    }

    /// The collar, from the right front's end around the neck to the left's.
    fn collar(&self) -> Sheet {
        // Half of it, from the middle of the neck: where it is sewn on, and the way to its free edge.
        let mut half: Vec<(Vec3, Vec3)> = Vec::new();
        let neck = |x: f32, down: f32, side: f32| {
            let turn = down / SHOULDER;
            self.rail + Vec3::new(x, (SHOULDER + 0.001) * turn.cos(), side * (SHOULDER + 0.001) * turn.sin())
        };
        for x in even(0.0, 0.055, 0.0055) {
            half.push((neck(x, 0.016, 1.0), Vec3::new(0.0, 1.0, -0.12)));
        }
        for f in even(0.05, 1.0, 0.05) {
            // Over the rail to the far side.
            let (x, down) = (0.055 + (NECK - 0.055) * smoothstep(0.0, 1.0, f), 0.016 - 0.05 * f);
            half.push((neck(x, down.abs(), down.signum()), Vec3::new(-0.8 * f, 1.0 - 0.6 * f, -0.12)));
        }
        let slope = Vec2::new(NECK + OVERLAP, COLLAR_END).normalize();
        let front = |side: f32| -> Vec<(Vec3, Vec3)> {
            even(0.045, COLLAR_END, 0.02)
                .into_iter()
                .map(|t| {
                    let s = side * self.edge(t);
                    let p = self.row(-t, &[s])[0];
                    let lap = self.lap(s, side < 0.0) * smoothstep(0.05, 0.25, t);
                    (p - Vec3::Z * (0.0045 + lap), Vec3::new(-slope.y, slope.x, 0.0))
                })
                .collect()
        };
        let mirror = |(p, way): &(Vec3, Vec3)| {
            let m = Vec3::new(-1.0, 1.0, 1.0);
            (*p * m, *way)
        };
        let right: Vec<(Vec3, Vec3, f32)> =
            half.iter().copied().chain(front(1.0)).map(|(p, w)| (p, w, 1.0)).collect();
        let left = half.iter().skip(1).map(mirror).chain(front(-1.0)).map(|(p, w)| (p, w, -1.0));
        let path: Vec<(Vec3, Vec3, f32)> = right.into_iter().rev().chain(left).collect();
        let mut sheet = Sheet { places: Vec::new(), cloth: Vec::new() };
        let mut run = 0.0;
        for (i, (p, way, side)) in path.iter().enumerate() {
            if i > 0 {
                run += p.distance(path[i - 1].0);
            }
            let way = Vec3::new(way.x * side, way.y, way.z).normalize();
            let columns = even(self.collar, 0.0, 0.011);
            sheet.places.push(columns.iter().map(|k| *p + way * *k).collect());
            sheet.cloth.push(columns.iter().map(|k| Vec2::new(self.collar - k, run)).collect());
        }
        sheet
    }
}

/// An offset on the cloth for each panel, metres.
fn cut(piece: u32) -> Grain {
    let unit = |i: u32| unit_f32(hash_combine(700 + piece, i));
    Grain { tile: Vec2::ONE, offset: Vec2::new(unit(1), unit(2)) }
}

/// The robe and its rack.
pub fn parts(out: &mut Parts) {
    let hang = Hang::new(out.layout);
    let sides = [(-1.0, "hidari", "左", "left"), (1.0, "migi", "右", "right")];
    type Make = fn(&Hang, f32, f32) -> Sheet;
    let body = &["robe_length", "robe_half_span", "robe_loom"][..];
    let sleeve = &["robe_sleeve", "robe_half_span", "robe_loom"][..];
    let panels: [(&str, &str, &str, &[&'static str], Make); 4] = [
        ("ushiro-migoro", "後身頃", "panel of the back", body, Hang::back),
        ("mae-migoro", "前身頃", "panel of the front", body, Hang::front),
        ("okumi", "衽", "half width at the front edge", body, Hang::half_width),
        ("sode", "袖", "sleeve", sleeve, Hang::sleeve),
    ];
    let mut lining = Solids::new();
    for (i, (id, ja, en, keys, make)) in panels.into_iter().enumerate() {
        for (k, (side, romaji, kanji, english)) in sides.into_iter().enumerate() {
            let grain = cut(10 * i as u32 + k as u32);
            let mut s = Solids::new();
            make(&hang, side, 0.0).layer(&mut s, 0.0, CLOTH, grain);
            let names = (
                format!("{id}-{romaji}"),
                format!("唐織{ja}（{kanji}）"),
                format!("karaori, {id} {romaji}"),
                format!("robe, {english} {en}"),
            );
            out.add((&names.0, &names.1, &names.2, &names.3), Finish::Cloth, keys, s);
            // It shows as a line at hem and cuffs, and nowhere touches what lies on it.
            make(&hang, side, 0.0015).layer(&mut lining, CLOTH + AIR, CLOTH + AIR + LINING, grain);
        }
    }
    let mut s = Solids::new();
    hang.collar().layer(&mut s, -0.0015, 0.0015, cut(90));
    out.add(
        ("eri", "唐織襟", "karaori, eri", "robe, collar"),
        Finish::Cloth,
        &["robe_collar", "robe_length"],
        s,
    );
    out.add(
        ("uraji", "唐織裏地", "karaori, uraji", "robe, lining"),
        Finish::Lining,
        &["robe_length", "robe_half_span", "robe_sleeve"],
        lining,
    );
    rack(out, &hang);
}

fn rack(out: &mut Parts, hang: &Hang) {
    let l = out.layout;
    let half = 0.5 * l.get("rack_width");
    let (post, y, z) = (0.042, hang.rail.y, hang.rail.z);
    let middle = half + 0.5 * post;
    // Its feet are level; the floor falls to the front.
    let floor = l.floor(z + FOOT);
    let lacquer = |i: u32| Grain::piece(Vec2::splat(0.3), 2000 + i);
    let gilt = |i: u32| Grain::piece(Vec2::splat(0.04), 2040 + i);
    let keys = &["rack_height", "rack_width"][..];
    let (mut s, mut g) = (Solids::new(), Solids::new());

    // The rail; its ends turn up.
    let beyond = middle + 0.17;
    let rise = |x: f32| 0.035 * ((x.abs() - middle).max(0.0) / 0.17).powi(2);
    let at = |x: f32| Vec3::new(x, y + rise(x), z);
    let path: Vec<Vec3> =
        even(-beyond, -middle, 0.02).into_iter().chain(even(middle, beyond, 0.02)).map(at).collect();
    s.tube(&path, &vec![RAIL; path.len()], 32, lacquer(0));
    for (i, side) in [-1.0f32, 1.0].into_iter().enumerate() {
        let i = i as u32;
        let x = side * middle;
        // Caps of the rail, and rings beside the posts.
        let cap: Vec<Vec3> =
            even(beyond - 0.045, beyond + 0.004, 0.01).into_iter().map(|x| at(side * x)).collect();
        g.tube(&cap, &vec![RAIL + 0.0015; cap.len()], 32, gilt(i));
        for (k, off) in [-0.5 * post - 0.017, 0.5 * post + 0.003].into_iter().enumerate() {
            let ring = [at(x + off), at(x + off + 0.007), at(x + off + 0.014)];
            g.tube(&ring, &[RAIL + 0.0013; 3], 32, gilt(4 + 2 * i + k as u32));
        }
        // A post, which the rail passes through, its foot, and their fittings.
        let foot = 0.055;
        let (low, high) = (Vec3::new(x, floor + foot - 0.01, z), Vec3::new(x, y + RAIL + 0.03, z));
        s.beam(low, high, Vec3::Z, Vec2::new(0.05, post), 0.005, lacquer(2 + i));
        for (k, (from, to)) in
            [(y + RAIL + 0.008, y + RAIL + 0.032), (floor + foot - 0.002, floor + foot + 0.05)]
                .into_iter()
                .enumerate()
        {
            let (a, b) = (Vec3::new(x, from, z), Vec3::new(x, to, z));
            g.beam(a, b, Vec3::Z, Vec2::new(0.053, post + 0.003), 0.0055, gilt(10 + 2 * i + k as u32));
        }
        // A foot: a low arch's outline drawn out across.
        let outline = [
            Vec2::new(-FOOT, 0.0),
            Vec2::new(FOOT, 0.0),
            Vec2::new(FOOT - 0.005, 0.018),
            Vec2::new(0.12, 0.042),
            Vec2::new(0.045, foot),
            Vec2::new(-0.045, foot),
            Vec2::new(-0.12, 0.042),
            Vec2::new(0.005 - FOOT, 0.018),
        ];
        let wide = 0.058;
        let axes = Axes { at: Vec3::new(x - 0.5 * wide, floor, z), x: -Vec3::Z, y: Vec3::Y, z: Vec3::X };
        s.prism(&outline, axes, wide, lacquer(6 + i));
        for (k, way) in [-1.0f32, 1.0].into_iter().enumerate() {
            let tip = Vec3::new(x, floor + 0.011, z + way * (FOOT - 0.015));
            let axes =
                Axes { at: tip - Vec3::X * (0.5 * wide + 0.0015), x: -Vec3::Z, y: Vec3::Y, z: Vec3::X };
            g.prism(&rectangle(0.036, 0.026, 0.006), axes, wide + 0.003, gilt(20 + 2 * i + k as u32));
        }
    }
    // A low rail from foot to foot.
    let low = floor + 0.15;
    s.beam(
        Vec3::new(-middle, low, z),
        Vec3::new(middle, low, z),
        Vec3::Y,
        Vec2::new(0.022, 0.045),
        0.003,
        lacquer(8),
    );
    out.add(("iko", "衣桁", "ikō", "rack for robes"), Finish::Lacquer, keys, s);
    out.add(
        ("iko-kazari-kanagu", "衣桁飾金具", "ikō no kazari-kanagu", "gilt fittings of the rack"),
        Finish::Gilt,
        keys,
        g,
    );
}

/// Near views of it: name, eye, what is looked at, degrees.
pub fn views(l: &Layout) -> [(&'static str, Vec3, Vec3, f32); 3] {
    let hang = Hang::new(l);
    let place = |s: f32, t: f32| hang.row(t, &[s])[0];
    let middle = hang.rail - Vec3::Y * (0.47 * hang.rail.y);
    let (near, thread) = (place(-0.12, 0.45), place(-0.10, 0.35));
    [
        ("robe", middle + Vec3::new(0.0, 0.12, 4.2), middle, 44.0),
        ("robe_near", near + Vec3::new(-0.25, 0.05, 0.95), near, 26.0),
        ("thread", thread + Vec3::new(-0.05, 0.01, 0.19), thread, 11.5),
    ]
}
