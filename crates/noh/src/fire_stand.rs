//! Kagaribi: iron baskets on three legs, with split pine in them.

use crate::layout::Layout;
use crate::part::{Finish, Parts};
use crate::solid::{Grain, Solids};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use yugen_optics::random::Pcg32;

/// Where flames stand in a basket (kagaribi).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FireStand {
    /// The middle of the fuel's surface, where flames stand.
    pub foot: Vec3,
    /// Of the basket at its rim, metres.
    pub diameter: f32,
}

/// Where the four stand: before both front corners, beyond the waki's side, beside the bridge's root.
pub fn fires(l: &Layout) -> [FireStand; 4] {
    let out = l.get("fire_distance");
    let right = l.hw + 0.16 + l.get("jiutai_width");
    // Clear of the bridge's eaves by two metres.
    let beside = l.bridge(l.bridge_start(0.0) + l.get("eaves") + 1.4, 0.5 * l.get("bridge_width") + 2.2, 0.0);
    let feet = [
        Vec3::new(-l.hw - out, 0.0, l.hd + out),
        Vec3::new(l.hw + out, 0.0, l.hd + out),
        Vec3::new(right + 2.2, 0.0, -0.2 * l.hd),
        beside,
    ];
    let y = l.ground + l.get("fire_rim") - 0.04;
    feet.map(|p| FireStand { foot: p.with_y(y), diameter: l.get("fire_basket") })
}

/// Stands with their fuel.
pub fn parts(out: &mut Parts) {
    let l = out.layout;
    let places = ["front left", "front right", "beyond the waki's side", "beside the bridge"];
    let in_japanese = ["正面左", "正面右", "脇正面奥", "橋掛り脇"];
    for (i, fire) in fires(l).into_iter().enumerate() {
        let n = i as u32 + 1;
        let mut s = Solids::new();
        stand(&mut s, l, &fire, n);
        let keys = ["fire_rim", "fire_basket", "fire_distance"];
        let names = (
            format!("kagaribi-{n}"),
            format!("篝火台{n}（{}）", in_japanese[i]),
            format!("kagaribi-dai {n}"),
            format!("fire basket {n}, {}", places[i]),
        );
        out.add((&names.0, &names.1, &names.2, &names.3), Finish::Iron, &keys, s);
        let mut s = Solids::new();
        logs(&mut s, &fire, n);
        let names = (format!("maki-{n}"), format!("薪{n}"), format!("maki {n}"), format!("split pine {n}"));
        out.add((&names.0, &names.1, &names.2, &names.3), Finish::Log, &["fire_basket"], s);
    }
}

fn stand(s: &mut Solids, l: &Layout, fire: &FireStand, n: u32) {
    let rim = 0.5 * fire.diameter;
    let (base, deep) = (0.62 * rim, 1.42 * rim);
    let top = fire.foot + Vec3::Y * 0.04;
    let iron = |i: u32| Grain::piece(Vec2::splat(0.4), 1000 + 60 * n + i);
    // Rings at the rim, half way and at the base.
    let radius = |t: f32| base + (rim - base) * t.powf(0.75);
    for (i, t) in [1.0, 0.52, 0.0].into_iter().enumerate() {
        let thick = if i == 0 { 0.0085 } else { 0.0065 };
        s.ring(top - Vec3::Y * (deep * (1.0 - t)), radius(t), thick, 48, iron(i as u32));
    }
    // Straps from the base to past the rim, flat bars bent outwards.
    let straps = 10;
    for k in 0..straps {
        let turn = TAU * (k as f32 + 0.5) / straps as f32;
        let out = Vec3::new(turn.cos(), 0.0, turn.sin());
        let path: Vec<Vec3> = (0..=14)
            .map(|i| i as f32 / 14.0 * 1.12 - 0.02)
            .map(|t| {
                top + Vec3::Y * (deep * (t - 1.0))
                    + out * (radius(t.max(0.0)) + 0.011 + 0.05 * (t - 1.0).max(0.0))
            })
            .collect();
        s.sweep(&path, out.cross(Vec3::Y), Vec2::new(0.024, 0.005), iron(4 + k));
    }
    // A grate at the base.
    for k in 0..4 {
        let turn = TAU * k as f32 / 8.0;
        let out = Vec3::new(turn.cos(), 0.0, turn.sin()) * base;
        let y = top - Vec3::Y * (deep + 0.004 + 0.009 * k as f32);
        s.tube(&[y - out, y + out], &[0.006; 2], 8, iron(20 + k));
    }
    // Three legs that cross below the basket and spread to the ground.
    let foot = l.ground + 0.06;
    let waist = foot + 0.62 * (top.y - deep - foot);
    for k in 0..3 {
        let turn = TAU * (k as f32 + 0.25) / 3.0 + 0.4 * n as f32;
        let (out, aside) = (Vec3::new(turn.cos(), 0.0, turn.sin()), Vec3::new(-turn.sin(), 0.0, turn.cos()));
        let at = |o: f32, a: f32, y: f32| (fire.foot + out * o + aside * a).with_y(y);
        let spread = 0.27 * (top.y - foot);
        let path = [
            at(-base - 0.002, 0.02, top.y - deep - 0.006),
            at(-0.35 * base, 0.02, 0.5 * (top.y - deep + waist)),
            at(0.1 * base, 0.02, waist),
            at(0.55 * spread, 0.02, 0.5 * (waist + foot)),
            at(spread, 0.02, foot + 0.012),
            at(spread + 0.05, 0.02, foot - 0.012),
        ];
        s.tube(&path, &[0.0095; 6], 10, iron(30 + k));
    }
    s.ring(Vec3::new(fire.foot.x, waist, fire.foot.z), 0.15 * fire.diameter, 0.006, 32, iron(36));
}

fn logs(s: &mut Solids, fire: &FireStand, n: u32) {
    let mut rng = Pcg32::new(u64::from(n), 93);
    let r = 0.5 * fire.diameter;
    for layer in 0..6 {
        for k in 0..3 {
            let turn = 1.25 * layer as f32 + 0.3 * (rng.next_f32() - 0.5);
            let way = Vec3::new(turn.cos(), 0.28 * (rng.next_f32() - 0.5), turn.sin()).normalize();
            let aside = way.cross(Vec3::Y).normalize() * (0.42 * r * (k as f32 - 1.0));
            let y = -1.02 * r + 0.185 * r * layer as f32 + 0.02 * rng.next_f32();
            let half = r * (0.5 + 0.07 * layer as f32) * (0.85 + 0.25 * rng.next_f32());
            let middle = fire.foot + aside + Vec3::Y * y;
            // A split log: a wedge, the bark on its round side.
            let size = 0.16 * r * (0.85 + 0.4 * rng.next_f32());
            let wedge: Vec<Vec2> = (0..=5)
                .map(|i| Vec2::from_angle(0.35 * i as f32 - 0.3) * size * 1.35)
                .chain([Vec2::new(-0.5 * size, -0.2 * size)])
                .collect();
            let (axes, length) = crate::solid::Axes::between(
                middle - way * half,
                middle + way * half,
                Vec3::new(rng.next_f32(), 1.0, 0.3),
            );
            s.prism(&wedge, axes, length, Grain::piece(Vec2::new(0.5, 0.5), 1300 + 30 * n + layer * 3 + k));
        }
    }
}
