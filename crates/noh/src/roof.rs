//! Roofs: rafters, sheathing, bark, ridge and gables over the main stage, the bridge and the rear seat.

use crate::dimension::Dimensions;
use crate::layout::{ARM, BEAM, BLOCK, Layout, TIE};
use crate::part::{Finish, Parts};
use crate::preset::{RoofCover, RoofForm};
use crate::solid::{Grain, Grid, Solids, rectangle};
use crate::timber::{roof_beams, wood};
use glam::{Vec2, Vec3};

/// A rafter's width and depth.
const RAFTER: Vec2 = Vec2::new(0.06, 0.075);
/// Of the boards on the rafters.
const SHEATHING: f32 = 0.018;

/// Metres that a tile of the bark's texture covers, along the eaves and up the slope.
pub const BARK: Vec2 = Vec2::new(1.2, 1.2);

/// A slope of a roof: heights over the level distance from the ridge, a parabola that sags.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// From the ridge to the edge.
    pub reach: f32,
    /// y of the rafters' upper side at the ridge.
    pub ridge: f32,
    slope: f32,
    sag: f32,
    /// Of the cover at the edge.
    pub thickness: f32,
}

impl Profile {
    fn new(half: f32, eaves: f32, beam_top: f32, pitch: f32, curve: f32, thickness: f32) -> Self {
        let (reach, t) = (half + eaves, pitch.to_radians().tan());
        // From the ridge to the beam it falls by half · tan(pitch); its slope at the edge is curve · tan(pitch).
        let sag = (1.0 - curve) * t / (2.0 * reach - half);
        Self { reach, ridge: beam_top + RAFTER.y + half * t, slope: t + sag * half, sag, thickness }
    }

    /// Of the main roof.
    pub fn main(d: &Dimensions) -> Self {
        let beam_top = d.get("pillar_height") + TIE + BLOCK + ARM + BEAM;
        Self::new(
            0.5 * d.get("width"),
            d.get("eaves"),
            beam_top,
            d.get("roof_pitch"),
            d.get("roof_curve"),
            d.get("bark_thickness"),
        )
    }

    fn of_stage(l: &Layout) -> Self {
        Self::new(
            l.hw,
            l.get("eaves"),
            l.beam_top(),
            l.get("roof_pitch"),
            l.get("roof_curve"),
            l.get("bark_thickness"),
        )
    }

    /// Upper side of the rafters.
    pub fn y(&self, d: f32) -> f32 {
        self.ridge - self.slope * d + self.sag * d * d
    }

    /// Underside of the rafters at the edge.
    pub fn edge_underside(&self) -> f32 {
        self.y(self.reach) - RAFTER.y
    }

    /// Of the cover: thick at the edge, where its layers are built up, thinner on the field.
    fn cover(&self, d: f32) -> f32 {
        let t = ((self.reach - d) / (0.35 * self.reach)).clamp(0.0, 1.0);
        self.thickness * (1.0 - 0.5 * t * t * (3.0 - 2.0 * t))
    }
}

/// A roof in its place: level axes of the ridge and across it.
#[derive(Clone, Copy)]
struct Frame {
    /// Where the ridge line crosses s = 0; y = 0.
    at: Vec3,
    /// Along the ridge.
    along: Vec3,
    /// Across, right-handed with up and along: x, y, z.
    across: Vec3,
    /// Fall along the ridge.
    fall: f32,
    profile: Profile,
    /// Ends along the ridge.
    ends: [f32; 2],
    /// How far the eaves rise to their ends.
    lift: f32,
}

impl Frame {
    fn lifted(&self, d: f32, s: f32) -> f32 {
        let [a, b] = self.ends;
        let t = ((2.0 * s - a - b) / (b - a)).clamp(-1.0, 1.0);
        self.lift * t.powi(4) * (d / self.profile.reach).powi(2)
    }

    /// A point `over` the upper side of the rafters.
    fn point(&self, side: f32, d: f32, s: f32, over: f32) -> Vec3 {
        let y = self.profile.y(d) + self.lifted(d, s) + over - self.fall * s;
        self.at + self.across * (side * d) + self.along * s + Vec3::Y * y
    }

    /// Parameters of a slope: distances from the ridge, and places along it as the one who looks at the slope from
    /// outside has them from left to right.
    fn slope(
        &self,
        side: f32,
        from: f32,
        to: f32,
        ends: impl Fn(f32) -> [f32; 2],
        over: impl Fn(f32) -> f32,
    ) -> Grid {
        let (rows, columns) = (18, 26);
        (0..=rows)
            .map(|i| {
                let d = from + (to - from) * i as f32 / rows as f32;
                let [a, b] = ends(d);
                (0..=columns)
                    .map(|j| {
                        let t = j as f32 / columns as f32;
                        let s = if side > 0.0 { b + (a - b) * t } else { a + (b - a) * t };
                        self.point(side, d, s, over(d))
                    })
                    .collect()
            })
            .collect()
    }

    /// Cover or sheathing of both slopes, between distances from the ridge.
    fn cover(
        &self,
        s: &mut Solids,
        [from, to]: [f32; 2],
        ends: &dyn Fn(f32) -> [f32; 2],
        bottom: f32,
        top: &dyn Fn(f32) -> f32,
        grain: Grain,
    ) {
        for side in [-1.0, 1.0] {
            let outside = self.slope(side, from, to, ends, top);
            let inside = self.slope(side, from, to, ends, |_| bottom);
            s.shell(&outside, &inside, true, grain);
        }
    }

    /// A pair of rafters.
    fn rafters(&self, s: &mut Solids, at: f32, from: f32, size: Vec2, piece: u32) {
        for side in [-1.0, 1.0] {
            let path: Vec<Vec3> = (0..=12)
                .map(|i| from + (self.profile.reach - 0.03 - from) * i as f32 / 12.0)
                .map(|d| self.point(side, d, at, -0.5 * size.y))
                .collect();
            s.sweep(&path, self.along, size, wood(piece));
        }
    }

    /// The boards at a gable's end, one on each slope, and the pendant between them. `outward`: 1 at the end of the
    /// ridge, −1 at its beginning.
    fn gable_boards(&self, s: &mut Solids, at: f32, outward: f32, depth: f32, piece: u32) {
        for side in [-1.0f32, 1.0] {
            let n = 20;
            let line = |over: &dyn Fn(f32) -> f32| -> Vec<Vec3> {
                let mut line: Vec<Vec3> = (0..=n)
                    .map(|i| 0.004 + (self.profile.reach - 0.012) * i as f32 / n as f32)
                    .map(|d| self.point(side, d, at, over(d / self.profile.reach)))
                    .collect();
                // Left to right for who looks at the gable from outside.
                if side * outward < 0.0 {
                    line.reverse();
                }
                line
            };
            let upper = line(&|_| SHEATHING - 0.004);
            let lower = line(&|t| SHEATHING - depth * (1.0 - 0.35 * (t * (1.0 - t) * 4.0) + 0.25 * t * t));
            s.board(&upper, &lower, self.along * (-0.06 * outward), wood(piece));
        }
        // The pendant: a turnip with a neck.
        let n = 28;
        let (half, tall) = (0.72 * depth, 1.6 * depth);
        let y = self.profile.y(0.0) - 0.55 * depth - self.fall * at;
        let right = self.across * outward;
        let line = |f: &dyn Fn(f32) -> f32| -> Vec<Vec3> {
            (0..=n)
                .map(|i| 2.0 * i as f32 / n as f32 - 1.0)
                .map(|t| {
                    self.at
                        + self.along * (at + 0.012 * outward)
                        + right * (half * t)
                        + Vec3::Y * (y + f(t.abs()))
                })
                .collect()
        };
        let upper = line(&|t| -0.2 * tall * t.powi(2));
        let lower = line(&|t| {
            -tall * (1.0 - t.powf(2.6)).max(0.0).sqrt() * (1.0 - 0.28 * (t * 9.0).sin().abs())
                - 0.2 * tall * t * t
                - 0.02
        });
        s.board(&upper, &lower, self.along * (-0.05 * outward), wood(piece + 1));
    }

    /// The box on the ridge, and the plates at its ends.
    fn ridge(&self, s: &mut Solids, size: Vec2, over: f32) {
        let grain = Grain::piece(Vec2::new(1.0, 1.0), 700);
        let [a, b] = self.ends;
        let at = |t: f32, y: f32| {
            self.at + self.along * t + Vec3::Y * (self.profile.ridge + over + y - self.fall * t)
        };
        s.beam(at(a - 0.03, 0.5 * size.y), at(b + 0.03, 0.5 * size.y), Vec3::Y, size, 0.02, grain);
        let cap = Vec2::new(size.x + 0.16, 0.06);
        s.beam(at(a - 0.1, size.y + 0.03), at(b + 0.1, size.y + 0.03), Vec3::Y, cap, 0.012, grain);
        s.beam(
            at(a - 0.06, size.y + 0.1),
            at(b + 0.06, size.y + 0.1),
            Vec3::Y,
            Vec2::new(0.22, 0.1),
            0.03,
            grain,
        );
        for (t, outward) in [(a - 0.03, -1.0), (b + 0.03, 1.0f32)] {
            let plate = rectangle(size.x * 1.25, size.y * 1.5, 0.28 * size.y);
            let z = self.along * outward;
            let axes = crate::solid::Axes { at: at(t, 0.42 * size.y), x: Vec3::Y.cross(z), y: Vec3::Y, z };
            s.prism(&plate, axes, 0.05, grain);
        }
    }
}

/// Roofs and everything that carries them.
pub fn parts(out: &mut Parts) {
    main(out);
    bridge(out);
    if out.layout.preset.rear_roof {
        rear(out);
    }
}

fn cover_names(l: &Layout) -> (Finish, &'static str, &'static str, &'static str) {
    match l.preset.cover {
        RoofCover::Bark => (Finish::Bark, "檜皮葺", "hiwada-buki", "cypress bark"),
        RoofCover::Copper => (Finish::Copper, "銅板葺", "dōban-buki", "copper"),
    }
}

fn main(out: &mut Parts) {
    let l = out.layout;
    let profile = Profile::of_stage(l);
    let eaves = l.get("eaves");
    let irimoya = l.preset.roof == RoofForm::Irimoya;
    let rear = if l.preset.rear_roof { -l.hd - 0.8 } else { l.rear - 0.85 };
    // Of the skirt before the gable of a hipped one: from the edge in.
    let (edge, gable_in) = (l.hd + eaves, eaves + 0.25);
    let front = if irimoya { edge } else { l.hd + 0.95 };
    let gable = edge - gable_in;
    let overhang = gable + 0.55;
    let frame = Frame {
        at: Vec3::ZERO,
        along: Vec3::Z,
        across: Vec3::X,
        fall: 0.0,
        profile,
        ends: [rear, front],
        lift: 0.13,
    };
    let upper = if irimoya { overhang } else { front };
    roof_beams(out, if irimoya { l.hd + 0.4 } else { front - 0.12 }, rear + 0.12);
    let keys = ["roof_pitch", "roof_curve", "eaves", "width", "depth"];

    // Rafters every so often, from the ridge to the edge; under a skirt only behind its hip.
    let mut s = Solids::new();
    let spacing = l.get("rafter_spacing");
    let first = rear + 0.16;
    let span = if irimoya { edge } else { front } - 0.16 - first;
    let count = (span / spacing).round() as u32;
    let hip = |z: f32| (profile.reach - (edge - z)).max(0.0);
    for i in 0..=count {
        let z = first + span * i as f32 / count as f32;
        let from = if irimoya && z > gable - 0.05 { hip(z) + 0.06 } else { 0.02 };
        if from < profile.reach - 0.3 {
            frame.rafters(&mut s, z, from, RAFTER, 400 + i);
        }
    }
    // Those of the skirt run to the front.
    let front_frame = Frame {
        at: Vec3::new(0.0, 0.0, edge - profile.reach),
        along: Vec3::NEG_X,
        across: Vec3::Z,
        ends: [-profile.reach, profile.reach],
        ..frame
    };
    if irimoya {
        let count = (2.0 * profile.reach / spacing).round() as u32;
        for i in 0..=count {
            let x = -profile.reach + 2.0 * profile.reach * i as f32 / count as f32;
            let from = (profile.reach - gable_in).max(x.abs()) + 0.06;
            if from < profile.reach - 0.3 {
                let path: Vec<Vec3> = (0..=6)
                    .map(|k| from + (profile.reach - 0.03 - from) * k as f32 / 6.0)
                    .map(|d| front_frame.point(1.0, d, -x, -0.5 * RAFTER.y))
                    .collect();
                s.sweep(&path, front_frame.along, RAFTER, wood(480 + i));
            }
        }
        for x in [-1.0f32, 1.0] {
            let path: Vec<Vec3> = (0..=8)
                .map(|k| profile.reach - gable_in + (gable_in - 0.02) * k as f32 / 8.0)
                .map(|d| frame.point(x, d, edge - profile.reach + d, -0.06))
                .collect();
            let side = (path[8] - path[0]).cross(Vec3::Y).normalize_or(Vec3::X);
            s.sweep(&path, side, Vec2::new(0.1, 0.12), wood(520));
        }
    }
    out.add(
        ("taruki", "垂木", "taruki", "rafters"),
        Finish::Timber,
        &["rafter_spacing", "roof_pitch", "eaves"],
        s,
    );

    let (finish, ja, romaji, en) = cover_names(l);
    let covers: [(Names, Finish, f32, bool); 2] = [
        (("noji-ita", "野地板", "noji-ita", "sheathing boards"), Finish::Timber, 0.0, false),
        (("yane", ja, romaji, en), finish, SHEATHING, true),
    ];
    for (names, finish, bottom, is_cover) in covers {
        let mut s = Solids::new();
        let top = |d: f32| if is_cover { SHEATHING + profile.cover(d) } else { SHEATHING - 0.001 };
        let grain = if is_cover { Grain::piece(BARK, 540) } else { wood(541) };
        let bottom = bottom + 0.001;
        // The boards end before the cover does.
        let back = if is_cover { 0.0 } else { 0.03 };
        let reach = profile.reach - back;
        if irimoya {
            let step = profile.reach - gable_in;
            frame.cover(&mut s, [0.01, step - 0.002], &|_| [rear + back, upper - back], bottom, &top, grain);
            let hip = |d: f32| [rear + back, edge - profile.reach + d - 0.012];
            frame.cover(&mut s, [step, reach], &hip, bottom, &top, grain);
            let slope = |over: &dyn Fn(f32) -> f32| {
                front_frame.slope(1.0, step, reach, |d| [-d + 0.012, d - 0.012], over)
            };
            s.shell(&slope(&top), &slope(&|_| bottom), true, grain);
        } else {
            frame.cover(&mut s, [0.01, reach], &|_| [rear + back, front - back], bottom, &top, grain);
        }
        out.add(names, finish, &keys, s);
    }

    let mut s = Solids::new();
    let ridge = Frame { ends: [rear, upper], ..frame };
    ridge.ridge(&mut s, Vec2::new(0.44, 0.34), SHEATHING + profile.cover(0.0) - 0.12);
    if irimoya {
        // Ridges down the hips.
        for x in [-1.0f32, 1.0] {
            let path: Vec<Vec3> = (0..=10)
                .map(|k| profile.reach - gable_in + (gable_in - 0.05) * k as f32 / 10.0)
                .map(|d| frame.point(x, d, edge - profile.reach + d, SHEATHING + profile.cover(d) + 0.02))
                .collect();
            let side = (path[10] - path[0]).cross(Vec3::Y).normalize_or(Vec3::X);
            s.sweep(&path, side, Vec2::new(0.2, 0.12), Grain::piece(Vec2::ONE, 701));
        }
    }
    out.add(("munagawara", "箱棟", "hako-mune", "ridge box"), Finish::Copper, &["roof_pitch", "width"], s);

    let mut s = Solids::new();
    let gable_frame = if irimoya {
        Frame { profile: Profile { reach: profile.reach - gable_in + 0.02, ..profile }, ..ridge }
    } else {
        ridge
    };
    gable_frame.gable_boards(&mut s, upper - 0.03, 1.0, 0.34, 550);
    out.add(("hafu", "破風", "hafu, gegyo", "gable boards and pendant, front"), Finish::Timber, &keys, s);
    let mut s = Solids::new();
    Frame { profile, ..gable_frame }.gable_boards(&mut s, rear + 0.03, -1.0, 0.34, 554);
    out.add(
        ("hafu-rear", "破風（裏）", "hafu, gegyo (ura)", "gable boards and pendant, rear"),
        Finish::Timber,
        &keys,
        s,
    );

    // Ridge beam, purlins, and the frames of the gables.
    let mut s = Solids::new();
    let under = |d: f32| profile.y(d) - RAFTER.y;
    let stop = upper - 0.14;
    let bar = |s: &mut Solids, x: f32, y: f32, size: Vec2, piece: u32| {
        s.beam(Vec3::new(x, y, rear + 0.14), Vec3::new(x, y, stop), Vec3::Y, size, 0.012, wood(piece));
    };
    bar(&mut s, 0.0, under(0.1) - 0.13, Vec2::new(0.16, 0.22), 560);
    let purlin = 0.5 * l.hw;
    for (i, x) in [-purlin, purlin].into_iter().enumerate() {
        bar(&mut s, x, under(purlin) - 0.1, Vec2::new(0.13, 0.15), 561 + i as u32);
    }
    out.add(("munagi", "棟木・母屋", "munagi, moya", "ridge beam and purlins"), Finish::Timber, &keys, s);

    let mut s = Solids::new();
    let beam_top = l.beam_top();
    let bays: &[f32] = if l.preset.rear_roof { &[1.0, -1.0] } else { &[1.0, -1.0, 0.0] };
    for (i, bay) in bays.iter().enumerate() {
        let z = if *bay == 0.0 { l.rear } else { bay * l.hd };
        let at = |x: f32, y: f32| Vec3::new(x, y, z);
        // The rainbow beam: cambered.
        let n = 16;
        let path: Vec<Vec3> = (0..=n)
            .map(|k| 2.0 * k as f32 / n as f32 - 1.0)
            .map(|t| at(t * (l.hw + 0.3), beam_top - 0.5 * BEAM - 0.006 + 0.07 * (1.0 - t * t)))
            .collect();
        s.sweep(&path, Vec3::NEG_Z, Vec2::new(0.15, BEAM + 0.02), wood(570 + i as u32));
        let base = beam_top + 0.06;
        let struts =
            [(0.0, under(0.1) - 0.24), (-purlin, under(purlin) - 0.17), (purlin, under(purlin) - 0.17)];
        for (k, (x, top)) in struts.into_iter().enumerate() {
            if top > base + 0.1 {
                s.beam(
                    at(x, base - 0.03),
                    at(x, top),
                    Vec3::Z,
                    Vec2::splat(0.13),
                    0.012,
                    wood(580 + 4 * i as u32 + k as u32),
                );
            }
        }
        // A tie half way up.
        let y = 0.5 * (base + under(0.0)) + 0.1;
        let half = ((0.82 * purlin) / 0.1).floor() * 0.1;
        if under(half) > y + 0.16 {
            s.beam(at(-half, y), at(half, y), Vec3::Y, Vec2::new(0.1, 0.15), 0.01, wood(590 + i as u32));
        }
    }
    out.add(("koryo", "虹梁・束", "kōryō, tsuka", "cambered beams and struts"), Finish::Timber, &keys, s);

    // Boards that close the gables, behind their struts.
    let mut s = Solids::new();
    let mut wall = |z: f32, bottom: f32, outward: f32, half: f32, piece: u32| {
        let n = 24;
        let line = |y: &dyn Fn(f32) -> f32| -> Vec<Vec3> {
            (0..=n)
                .map(|k| outward * half * (2.0 * k as f32 / n as f32 - 1.0))
                .map(|x| Vec3::new(x, y(x.abs()), z))
                .collect()
        };
        let top = |x: f32| (profile.y(x) - 0.004).max(bottom + 0.02);
        s.board(
            &line(&top),
            &line(&|_| bottom),
            Vec3::Z * (-0.018 * outward),
            Grain { tile: Vec2::new(0.72, 2.4), ..wood(piece) },
        );
    };
    let half = l.hw - 0.05;
    if irimoya {
        let half = profile.reach - gable_in - 0.08;
        wall(gable + 0.02, profile.y(half) - 0.12, 1.0, half, 600);
    } else {
        wall(l.hd - 0.085, beam_top - 0.03, 1.0, half, 600);
    }
    wall(if l.preset.rear_roof { -l.hd + 0.085 } else { l.rear + 0.085 }, beam_top - 0.03, -1.0, half, 602);
    out.add(("tsuma-ita", "妻板", "tsuma-ita", "boards of the gables"), Finish::Timber, &keys, s);
}

type Names<'a> = crate::part::Names<'a>;

/// Of the bridge: a gable along it, lower and thinner.
fn bridge(out: &mut Parts) {
    let l = out.layout;
    let length = l.get("bridge_length");
    let half = 0.5 * l.get("bridge_width");
    let height = l.get("bridge_pillar_height");
    let beam = Vec2::new(0.13, 0.16);
    let fall = l.get("bridge_rake").to_radians().tan();
    let top = l.root.y + height + beam.y;
    let profile = Profile::new(half, 0.6, top, 27.0, l.get("roof_curve"), 0.6 * l.get("bark_thickness"));
    let frame = Frame {
        at: l.root.with_y(0.0),
        along: l.along,
        across: l.across,
        fall,
        profile,
        ends: [0.12, length + 0.75],
        lift: 0.05,
    };
    let mut s = Solids::new();
    let [a, b] = frame.ends;
    let count = ((b - a - 0.2) / l.get("rafter_spacing")).round() as u32;
    for i in 0..=count {
        frame.rafters(
            &mut s,
            a + 0.1 + (b - a - 0.2) * i as f32 / count as f32,
            0.02,
            Vec2::new(0.05, 0.06),
            620 + i,
        );
    }
    out.add(
        ("hashi-taruki", "橋掛り垂木", "hashigakari taruki", "rafters of the bridge"),
        Finish::Timber,
        &["bridge_length", "rafter_spacing"],
        s,
    );
    let (finish, ja, romaji, en) = cover_names(l);
    let names = [
        (
            "hashi-noji-ita",
            "橋掛り野地板".to_string(),
            "hashigakari noji-ita".to_string(),
            "sheathing of the bridge".to_string(),
        ),
        ("hashi-yane", format!("橋掛り{ja}"), format!("hashigakari {romaji}"), format!("{en} on the bridge")),
    ];
    for (i, (id, ja, romaji, en)) in names.iter().enumerate() {
        let mut s = Solids::new();
        let cover = i == 1;
        let top = |d: f32| if cover { SHEATHING + profile.cover(d) } else { SHEATHING - 0.001 };
        let back = if cover { 0.0 } else { 0.03 };
        let ends = |_: f32| [a + back, b - back];
        let grain = if cover { Grain::piece(BARK, 670) } else { wood(671) };
        let bottom = if cover { SHEATHING + 0.001 } else { 0.001 };
        frame.cover(&mut s, [0.01, profile.reach - back], &ends, bottom, &top, grain);
        out.add(
            (id, ja, romaji, en),
            if cover { finish } else { Finish::Timber },
            &["bridge_length", "bridge_width"],
            s,
        );
    }
    let mut s = Solids::new();
    frame.ridge(&mut s, Vec2::new(0.26, 0.18), SHEATHING + profile.cover(0.0) - 0.08);
    out.add(
        ("hashi-mune", "橋掛り棟", "hashigakari mune", "ridge of the bridge"),
        Finish::Copper,
        &["bridge_length"],
        s,
    );
    let mut s = Solids::new();
    frame.gable_boards(&mut s, b - 0.03, 1.0, 0.2, 674);
    out.add(
        ("hashi-hafu", "橋掛り破風", "hashigakari hafu", "gable boards of the bridge"),
        Finish::Timber,
        &["bridge_length"],
        s,
    );

    // Beams on the pillars, ties and struts at every pair.
    let mut s = Solids::new();
    let y = height + 0.5 * beam.y;
    for (i, side) in [-1.0, 1.0].into_iter().enumerate() {
        let start = l.bridge_start(side * half).max(0.0) + 0.02;
        s.beam(
            l.bridge(start, side * half, y),
            l.bridge(length + 0.6, side * half, y),
            Vec3::Y,
            beam,
            0.01,
            wood(680 + i as u32),
        );
    }
    let ridge = profile.ridge - l.root.y - RAFTER.y - 0.1;
    s.beam(
        l.bridge(0.2, 0.0, ridge - 0.02),
        l.bridge(length + 0.6, 0.0, ridge - 0.02),
        Vec3::Y,
        Vec2::new(0.11, 0.13),
        0.01,
        wood(682),
    );
    let bays = l.get("bridge_bays") as u32;
    for i in 1..=bays {
        let t = length * i as f32 / bays as f32;
        let past = half + 0.16;
        s.beam(
            l.bridge(t, -past, y + 0.02),
            l.bridge(t, past, y + 0.02),
            Vec3::Y,
            beam * 0.94,
            0.008,
            wood(684 + i),
        );
        s.beam(
            l.bridge(t, 0.0, y + 0.08),
            l.bridge(t, 0.0, ridge - 0.05),
            l.along,
            Vec2::splat(0.1),
            0.008,
            wood(690 + i),
        );
    }
    out.add(
        ("hashi-keta", "橋掛り桁・梁", "hashigakari keta, hari", "beams of the bridge"),
        Finish::Timber,
        &["bridge_width", "bridge_pillar_height"],
        s,
    );
}

/// Over the rear seat: one slope to the rear, of shingles.
fn rear(out: &mut Parts) {
    let l = out.layout;
    let (x, z0, z1) = (l.hw + 0.7, l.rear - 0.7, -l.hd - 0.1);
    let (low, high) = (l.head() + TIE + 0.12, l.head() + TIE + 0.12 + 0.33 * (z1 - z0));
    let n = 12;
    let grid = |over: f32| -> Grid {
        // Seen from the rear, +x lies to the left.
        (0..=n)
            .map(|i| {
                let t = i as f32 / n as f32;
                let (z, y) = (z1 + (z0 - z1) * t, high + (low - high) * t - 0.12 * t * (1.0 - t) + over);
                (0..=n).map(|j| Vec3::new(x - 2.0 * x * j as f32 / n as f32, y, z)).collect()
            })
            .collect()
    };
    let mut s = Solids::new();
    s.shell(&grid(0.09), &grid(0.0), true, Grain::piece(BARK, 720));
    out.add(
        ("atoza-yane", "後座柿葺", "atoza kokera-buki", "shingles over the rear seat"),
        Finish::Bark,
        &["atoza_depth"],
        s,
    );
    let mut s = Solids::new();
    let count = (2.0 * x / 0.45).round() as u32;
    for i in 0..=count {
        let at = -x + 0.06 + (2.0 * x - 0.12) * i as f32 / count as f32;
        let path: Vec<Vec3> = grid(-0.04).iter().map(|row| row[0].with_x(at)).collect();
        s.sweep(&path, Vec3::X, Vec2::new(0.06, 0.07), wood(730 + i));
    }
    out.add(
        ("atoza-taruki", "後座垂木", "atoza taruki", "rafters over the rear seat"),
        Finish::Timber,
        &["atoza_depth"],
        s,
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PRESETS;

    #[test]
    fn slopes_fall_as_the_pitch_says_and_grow_flatter_to_the_edge() {
        for preset in PRESETS {
            let d = preset.dimensions();
            let (p, half) = (Profile::main(&d), 0.5 * d.get("width"));
            let pitch = ((p.y(0.0) - p.y(half)) / half).atan().to_degrees();
            assert!((pitch - d.get("roof_pitch")).abs() < 1e-3, "{pitch}");
            let slope = |x: f32| (p.y(x - 0.01) - p.y(x + 0.01)) / 0.02;
            let edge = d.get("roof_curve") * d.get("roof_pitch").to_radians().tan();
            assert!(
                (slope(p.reach) - edge).abs() < 1e-3
                    && slope(0.1) > slope(1.0)
                    && slope(1.0) > slope(p.reach)
            );
        }
    }
}
