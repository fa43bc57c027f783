//! The bridge: floor, pillars, rails, and the curtain at its end.

use crate::part::{Finish, Parts};
use crate::solid::{Grain, Grid, Solids};
use crate::timber::{board, post, rail, wood};
use glam::{Vec2, Vec3};

/// All of it but the roof.
pub fn parts(out: &mut Parts) {
    let l = out.layout;
    let (length, width) = (l.get("bridge_length"), l.get("bridge_width"));
    let half = 0.5 * width;
    let edge = half + 0.12;
    let thickness = l.get("board_thickness");
    let bays = l.get("bridge_bays") as u32;

    // Boards along the bridge, cut at the stage's side.
    let mut s = Solids::new();
    let count = (2.0 * edge / 0.34).round().max(1.0) as u32;
    let step = 2.0 * edge / count as f32;
    let beyond = 0.17 / l.along.x.abs();
    for i in 0..count {
        let (a, b) = (-edge + step * i as f32 + 0.0015, -edge + step * (i + 1) as f32 - 0.0015);
        let begin = |front: f32| l.bridge_start(front) + beyond;
        let plan = [
            l.bridge(begin(a), a, 0.0),
            l.bridge(length + 0.25, a, 0.0),
            l.bridge(length + 0.25, b, 0.0),
            l.bridge(begin(b), b, 0.0),
        ];
        s.plank(&plan, thickness, l.along, l.bridge(begin(a), b, 0.0), board(800 + i, step));
    }
    let keys = ["bridge_length", "bridge_width", "bridge_angle", "bridge_rake", "board_thickness"];
    out.add(("hashigakari", "橋掛り", "hashigakari", "bridge"), Finish::Floor, &keys, s);

    // Sleepers and short posts below, with a plank that hides them.
    let mut s = Solids::new();
    for (i, side) in [-1.0f32, 1.0].into_iter().enumerate() {
        let start = l.bridge_start(side * edge).max(l.bridge_start(side * half)) + beyond;
        let (a, b) = (
            l.bridge(start, side * (edge - 0.05), -0.17),
            l.bridge(length + 0.2, side * (edge - 0.05), -0.17),
        );
        s.beam(a, b, Vec3::Y, Vec2::new(0.1, 0.2), 0.008, wood(820 + i as u32));
        for k in 0..2 * bays {
            let t = start + (length - start) * (k as f32 + 0.5) / (2 * bays) as f32;
            let top = l.bridge(t, side * (half - 0.1), -0.2);
            s.beam(top.with_y(l.ground - 0.05), top, l.along, Vec2::splat(0.12), 0.01, wood(824 + k));
        }
    }
    out.add(
        ("hashi-ashi", "橋掛り床組", "hashigakari yukagumi", "what carries the bridge"),
        Finish::Timber,
        &["bridge_length", "floor_height"],
        s,
    );

    let keys = ["bridge_pillar", "bridge_pillar_height", "bridge_bays", "bridge_length", "bridge_width"];
    let mut number = 0;
    for i in 1..=bays {
        for (side, ja, en) in [(1.0, "前", "front"), (-1.0, "後", "rear")] {
            number += 1;
            let mut s = Solids::new();
            let t = length * i as f32 / bays as f32;
            let top = l.bridge(t, side * half, l.get("bridge_pillar_height"));
            let size = Vec2::splat(l.get("bridge_pillar"));
            s.beam(top.with_y(l.ground - 0.05), top, l.along, size, 0.014, wood(840 + number));
            let id = format!("hashigakari-bashira-{i}-{en}");
            let romaji = format!("hashigakari-bashira {i} ({})", if side > 0.0 { "mae" } else { "ushiro" });
            let names = (
                id.as_str(),
                format!("橋掛り柱{i}（{ja}）"),
                romaji,
                format!("pillar {i} of the bridge, {en}"),
            );
            out.add((names.0, &names.1, &names.2, &names.3), Finish::Timber, &keys, s);
        }
    }

    for (side, id, ja, romaji, en) in [
        (1.0, "hashi-koran-front", "高欄（前）", "kōran (mae)", "rail of the bridge, front"),
        (-1.0, "hashi-koran-rear", "高欄（後）", "kōran (ushiro)", "rail of the bridge, rear"),
    ] {
        let mut s = Solids::new();
        // From the stage's pillar to the first of the bridge's, and so on: a rail for every bay.
        for i in 0..bays {
            let start = if i == 0 {
                l.bridge_start(side * half) + 0.14 / l.along.x.abs()
            } else {
                length * i as f32 / bays as f32
            };
            let end = length * (i + 1) as f32 / bays as f32;
            let clear = 0.5 * l.get("bridge_pillar") + 0.125;
            let ends = [l.bridge(start + clear, side * half, 0.0), l.bridge(end - clear, side * half, 0.0)];
            if end - start > 0.8 {
                let posts = ((end - start) / 0.95).round().max(1.0) as usize;
                rail(
                    &mut s,
                    &ends,
                    l.get("rail_height"),
                    posts,
                    860 + 12 * i + if side > 0.0 { 0 } else { 300 },
                );
            }
        }
        out.add((id, ja, romaji, en), Finish::Timber, &["rail_height", "bridge_length"], s);
    }
    curtain(out);
}

fn curtain(out: &mut Parts) {
    let l = out.layout;
    let length = l.get("bridge_length");
    let half = 0.5 * l.get("bridge_width") - 0.5 * l.get("bridge_pillar") - 0.02;
    let height = l.get("curtain_height");
    // Hanging cloth in soft folds.
    let (rows, columns) = (24, 80);
    let at = |i: usize, j: usize, behind: f32| {
        let (t, x) = (i as f32 / rows as f32, 2.0 * j as f32 / columns as f32 - 1.0);
        let deep = 0.012 + 0.03 * t;
        let fold = deep
            * ((7.0 * std::f32::consts::PI * x + 0.6 * (3.0 * t).sin()).sin()
                + 0.35 * (19.0 * x + 2.0 * t).cos());
        l.bridge(length + fold + behind, half * x, height * (1.0 - t) + 0.012)
    };
    // Who stands on the bridge and looks at it has the bridge's front to the left.
    let grid = |behind: f32| -> Grid {
        (0..=rows).map(|i| (0..=columns).map(|j| at(i, columns - j, behind)).collect()).collect()
    };
    let mut s = Solids::new();
    let grain = Grain { tile: Vec2::new(2.0 * half * 1.02, height), offset: Vec2::ZERO };
    s.shell(&grid(0.0), &grid(0.004), true, grain);
    out.add(
        ("agemaku", "揚幕", "agemaku", "lift curtain"),
        Finish::Curtain,
        &["curtain_height", "bridge_width"],
        s,
    );

    let mut s = Solids::new();
    let y = height + 0.05;
    s.tube(
        &[l.bridge(length, -half, y - 0.02), l.bridge(length, half, y - 0.02)],
        &[0.02, 0.02],
        12,
        Grain::piece(Vec2::ONE, 900),
    );
    // The two poles that raise it, tied to its lower corners.
    for (i, side) in [-0.96f32, 0.96].into_iter().enumerate() {
        post(
            &mut s,
            l.bridge(length + 0.09, side * half, 0.03),
            l.bridge(length + 1.9, side * half, 1.0),
            0.014,
            Grain::piece(Vec2::ONE, 901 + i as u32),
        );
    }
    out.add(
        ("take-zao", "竹竿", "take-zao", "bamboo poles of the curtain"),
        Finish::Bamboo,
        &["curtain_height"],
        s,
    );

    // The wall of the mirror room behind, left and right of the curtain and over it.
    let mut s = Solids::new();
    let (t, deep) = (length + 0.16, 0.08);
    let outer = 0.5 * l.get("bridge_width") + 0.5;
    let inner = half + 0.02;
    let (top, over) = (l.get("bridge_pillar_height") + 0.1, height + 0.06);
    let mut panel = |a: f32, b: f32, low: f32, high: f32, i: u32| {
        let p = |front: f32, up: f32| l.bridge(t, front, up);
        s.board(
            &[p(b, high), p(a, high)],
            &[p(b, low), p(a, low)],
            l.along * deep,
            Grain::piece(Vec2::ONE, 910 + i),
        );
    };
    panel(-outer, -inner - 0.001, -0.3, top, 0);
    panel(inner + 0.001, outer, -0.3, top, 1);
    panel(-inner, inner, over, top, 2);
    out.add(
        ("kagami-no-ma", "鏡の間の壁", "kagami-no-ma no kabe", "wall of the mirror room"),
        Finish::Plaster,
        &["bridge_width"],
        s,
    );
    let mut s = Solids::new();
    let r = |side: f32, up: f32| l.bridge(length + 0.13, side * (half + 0.045), up);
    s.beam(r(1.0, over), r(-1.0, over), Vec3::Y, Vec2::new(0.12, 0.1), 0.008, wood(914));
    out.add(
        ("maku-guchi", "幕口", "maku-guchi", "lintel of the curtain"),
        Finish::Timber,
        &["curtain_height"],
        s,
    );
}
