//! What lies and grows around the stage: earth, white gravel, three pines.

use crate::part::{Finish, Parts};
use crate::solid::{Axes, Grain, Grid, Solids};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use yugen_optics::random::Pcg32;

/// Metres that a tile of the gravel's texture covers.
pub const GRAVEL: Vec2 = Vec2::splat(0.9);

/// Earth, gravel and pines.
pub fn parts(out: &mut Parts) {
    let l = out.layout;
    let mut s = Solids::new();
    let reach = 40.0;
    s.block(
        Vec3::new(-reach, l.ground - 0.5, -reach),
        Vec3::new(reach, l.ground, reach),
        0,
        Grain { tile: Vec2::splat(1.6), offset: Vec2::ZERO },
    );
    out.add(("niwa", "庭", "niwa", "ground"), Finish::Earth, &["floor_height"], s);
    gravel(out);
    for (number, key, at) in [(1, "pine_ichi", 0.18), (2, "pine_ni", 0.5), (3, "pine_san", 0.82)] {
        pine(out, number, key, at);
    }
}

fn gravel(out: &mut Parts) {
    let l = out.layout;
    let wide = l.get("gravel_width");
    let mut s = Solids::new();
    let right = l.hw + 0.16 + l.get("jiutai_width");
    let bed = |s: &mut Solids, from: Vec3, across: Vec3, down: Vec3, height: f32| {
        // A shallow bed with a rim that falls to the ground, seen from above.
        let (w, h) = (across.length(), down.length());
        let (columns, rows) = ((w / 0.35).ceil() as usize, (h / 0.35).ceil() as usize);
        let grid = |top: bool| -> Grid {
            (0..=rows)
                .map(|i| {
                    (0..=columns)
                        .map(|j| {
                            let (x, y) = (j as f32 / columns as f32, i as f32 / rows as f32);
                            let p = from + across * x + down * y;
                            let rim = i == 0 || j == 0 || i == rows || j == columns;
                            let wave =
                                0.008 * yugen_motion::noise::noise(Vec3::new(1.7 * p.x, 0.3, 1.7 * p.z)).0;
                            p.with_y(
                                l.ground
                                    + if !top {
                                        -0.02
                                    } else if rim {
                                        0.004
                                    } else {
                                        height + wave
                                    },
                            )
                        })
                        .collect()
                })
                .collect()
        };
        s.shell(&grid(true), &grid(false), true, Grain { tile: GRAVEL, offset: Vec2::ZERO });
    };
    let (x0, x1) = (-l.hw - 0.16 - wide, right + wide);
    let (z0, z1) = (l.rear - 0.3 - wide, l.hd + 0.16 + wide);
    bed(&mut s, Vec3::new(x0, 0.0, z0), Vec3::X * (x1 - x0), Vec3::Z * (z1 - z0), 0.05);
    out.add(
        ("shirasu", "白洲", "shirasu", "white gravel"),
        Finish::Gravel,
        &["gravel_width", "gravel_albedo"],
        s,
    );

    // Along the bridge, a little lower where it meets the other.
    let mut s = Solids::new();
    let half = 0.5 * l.get("bridge_width") + 0.12 + wide;
    let length = l.get("bridge_length") + 0.6;
    let from = l.bridge(length, -half, 0.0);
    let begin = 0.4;
    bed(&mut s, from, -l.along * (length - begin), l.across * (2.0 * half), 0.035);
    out.add(
        ("shirasu-hashi", "白洲（橋掛り）", "shirasu (hashigakari)", "white gravel along the bridge"),
        Finish::Gravel,
        &["gravel_width", "bridge_length"],
        s,
    );
}

/// A young pine: a bent trunk, whorls of branches, and tufts of needles on their upper sides.
fn pine(out: &mut Parts, number: u32, key: &'static str, place: f32) {
    let l = out.layout;
    let height = l.get(key);
    let front = 0.5 * l.get("bridge_width") + 0.12 + 0.55 * l.get("gravel_width");
    let start = l.bridge_start(front).max(0.0) + l.get("eaves") + 0.3;
    let foot = l.bridge(start + place * (l.get("bridge_length") - start), front, 0.0).with_y(l.ground + 0.03);
    let mut rng = Pcg32::new(u64::from(number), 71);
    let (mut wood, mut needles) = (Solids::new(), Solids::new());
    let grain = |i: u32| Grain::piece(Vec2::splat(0.35), 950 + 40 * number + i);
    // The trunk leans, and comes back.
    let lean = rng.next_f32() * TAU;
    let sway = Vec3::new(lean.cos(), 0.0, lean.sin());
    let trunk = |t: f32| {
        foot + Vec3::Y * (height * 0.94 * t - 0.05)
            + sway * (0.09 * height * ((3.4 * t).sin() - 0.25 * t))
            + sway.cross(Vec3::Y) * (0.05 * height * (5.0 * t).sin())
    };
    let path: Vec<Vec3> = (0..=18).map(|i| trunk(i as f32 / 18.0)).collect();
    let radii: Vec<f32> = (0..=18).map(|i| 0.034 * height * (1.06 - i as f32 / 18.0).powf(0.7)).collect();
    wood.tube(&path, &radii, 12, grain(0));
    // Branches in flat pads, shorter to the top, as gardeners clip them.
    let whorls = 7;
    for w in 0..whorls {
        let t = 0.24 + 0.72 * w as f32 / (whorls - 1) as f32;
        let arms = if w == whorls - 1 { 3 } else { 4 };
        let reach = height * 0.40 * (1.14 - t);
        for a in 0..arms {
            let turn = TAU * (a as f32 + 0.37 * w as f32 + 0.35 * rng.next_f32()) / arms as f32;
            let way = Vec3::new(turn.cos(), 0.0, turn.sin());
            let reach = reach * (0.75 + 0.5 * rng.next_f32());
            let root = trunk(t);
            let limb = |u: f32| {
                root + way * (reach * u)
                    + way.cross(Vec3::Y) * (0.12 * reach * (4.0 * u).sin())
                    + Vec3::Y * (reach * (0.28 * u - 0.24 * u * u))
            };
            let path: Vec<Vec3> = (0..=7).map(|i| limb(i as f32 / 7.0)).collect();
            let radii: Vec<f32> =
                (0..=7).map(|i| 0.011 * height * (1.1 - t) * (1.05 - 0.12 * i as f32)).collect();
            wood.tube(&path, &radii, 8, grain(1 + 5 * w + a));
            let tufts = 14 + (52.0 * reach / height) as usize;
            for k in 0..tufts {
                let u = 0.22 + 0.80 * (k as f32 + rng.next_f32()) / tufts as f32;
                let aside = (rng.next_f32() - 0.5) * 0.85 * reach * (1.0 - (2.0 * u - 1.2).powi(2)).max(0.25);
                let seat = limb(u.min(1.0)) + way.cross(Vec3::Y) * aside + Vec3::Y * (0.012 * height);
                tuft(
                    &mut needles,
                    seat,
                    (way * 0.45 + Vec3::Y + way.cross(Vec3::Y) * (aside / reach)).normalize(),
                    height,
                    &mut rng,
                );
            }
        }
    }
    tuft(&mut needles, trunk(1.0), Vec3::Y, height, &mut rng);
    // The tips of the needles are as high as the table says.
    let factor = height / (needles.top() - l.ground);
    wood.stretch(l.ground, factor);
    needles.stretch(l.ground, factor);
    let names = [
        ("ichi-no-matsu", "一の松", "ichi-no-matsu", "first pine"),
        ("ni-no-matsu", "二の松", "ni-no-matsu", "second pine"),
        ("san-no-matsu", "三の松", "san-no-matsu", "third pine"),
    ];
    let (id, ja, romaji, en) = names[number as usize - 1];
    out.add(
        (
            &format!("{id}-trunk"),
            &format!("{ja}（幹）"),
            &format!("{romaji} (miki)"),
            &format!("{en}, trunk and branches"),
        ),
        Finish::PineBark,
        &[key],
        wood,
    );
    out.add((id, ja, romaji, en), Finish::Needles, &[key], needles);
}

/// Needles that stand out from the tip of a twig.
fn tuft(s: &mut Solids, seat: Vec3, up: Vec3, height: f32, rng: &mut Pcg32) {
    let (axes, _) = Axes::between(seat, seat + up, Vec3::Z);
    for _ in 0..38 {
        // Even over a cap of 80 degrees.
        let (cos, turn) = (0.17 + 0.83 * rng.next_f32(), TAU * rng.next_f32());
        let sin = (1.0f32 - cos * cos).sqrt();
        let way = (axes.x * (sin * turn.cos()) + axes.y * (sin * turn.sin())) + axes.z * cos;
        let length = 0.078 * (0.7 + 0.5 * rng.next_f32()) * (0.6 + 0.3 * height);
        let foot = seat + way * 0.004;
        s.needle(foot, foot + way * length, 0.0027);
    }
}
