//! Floors, pillars, ties and walls: the carpenter's part below the roof.

use crate::layout::{ARM, BEAM, BLOCK, Layout, TIE};
use crate::part::{Finish, Parts};
use crate::solid::{Axes, Grain, Solids, circle, rectangle};
use glam::{Vec2, Vec3};

/// Metres that a tile of the wood's texture covers: along, across. Two boards lie side by side in it.
pub const WOOD: Vec2 = Vec2::new(2.4, 0.72);
/// Between two boards.
const GAP: f32 = 0.0015;
/// How far floors reach beyond the middles of pillars.
const EDGE: f32 = 0.16;

/// A timber's own piece of the texture.
pub fn wood(piece: u32) -> Grain {
    Grain::piece(WOOD, piece)
}

/// A board's, so wide: one of the two in the texture, from its edge on.
pub fn board(piece: u32, width: f32) -> Grain {
    let offset = Vec2::new(wood(piece).offset.x, 0.5 * (piece % 2) as f32);
    Grain { tile: Vec2::new(WOOD.x, 2.0 * width), offset }
}

/// Floors, pillars and what is between them.
pub fn parts(out: &mut Parts) {
    floors(out);
    pillars(out);
    ties(out);
    walls(out);
    substructure(out);
}

fn floors(out: &mut Parts) {
    let l = out.layout;
    let thickness = l.get("board_thickness");
    let (x0, x1) = (-l.hw - EDGE, l.hw + EDGE);
    let (z0, z1) = (-l.hd, l.hd + EDGE);
    let count = (l.get("width") / l.get("board_width")).round().max(1.0) as u32;
    let mut s = Solids::new();
    let step = (x1 - x0) / count as f32;
    for i in 0..count {
        let (a, b) = (x0 + step * i as f32 + GAP, x0 + step * (i + 1) as f32 - GAP);
        let at = |x: f32, z: f32| Vec3::new(x, l.floor(z), z);
        let plan = [at(a, z0 + GAP), at(a, z1), at(b, z1), at(b, z0 + GAP)];
        s.plank(&plan, thickness, Vec3::Z, at(a, z0), board(i, step));
    }
    let keys = ["width", "depth", "floor_height", "floor_rake", "board_width", "board_thickness"];
    out.add(("honbutai", "本舞台", "hon-butai", "main stage"), Finish::Floor, &keys, s);

    let mut s = Solids::new();
    let count = (l.get("atoza_depth") / 0.34).round() as u32;
    let (z0, z1) = (l.rear - 0.1, -l.hd - GAP);
    let step = (z1 - z0) / count as f32;
    for i in 0..count {
        let (a, b) = (z0 + step * i as f32 + GAP, z0 + step * (i + 1) as f32 - GAP);
        let at = |x: f32, z: f32| Vec3::new(x, l.floor(-l.hd), z);
        let plan = [at(x0, a), at(x0, b), at(x1, b), at(x1, a)];
        s.plank(&plan, thickness, Vec3::X, at(x0, b), board(50 + i, step));
    }
    out.add(
        ("atoza", "後座", "atoza (yoko-ita)", "rear seat, its boards across"),
        Finish::Floor,
        &["atoza_depth", "width"],
        s,
    );

    let mut s = Solids::new();
    let width = l.get("jiutai_width");
    for i in 0..3 {
        let (a, b) = (x1 + GAP + width / 3.0 * i as f32, x1 + width / 3.0 * (i + 1) as f32 - GAP);
        let at = |x: f32, z: f32| Vec3::new(x, l.floor(z) - 0.02, z);
        let plan = [at(a, -l.hd), at(a, l.hd + EDGE), at(b, l.hd + EDGE), at(b, -l.hd)];
        s.plank(&plan, thickness, Vec3::Z, at(a, -l.hd), board(80 + i, width / 3.0));
    }
    out.add(
        ("jiutai-za", "地謡座", "jiutai-za", "chorus seat"),
        Finish::Floor,
        &["jiutai_width", "depth"],
        s,
    );

    let mut s = Solids::new();
    let x = x1 + width - 0.06;
    let base = |z: f32| Vec3::new(x, l.floor(z) - 0.02, z);
    rail(&mut s, &[base(l.hd + 0.08), base(-l.hd + 0.05)], l.get("rail_height"), 5, 100);
    out.add(
        ("jiutai-koran", "地謡座高欄", "jiutai-za kōran", "rail of the chorus seat"),
        Finish::Timber,
        &["rail_height"],
        s,
    );
}

/// A rail on a straight line: a sill, a middle bar, a round hand rail, and posts.
pub fn rail(s: &mut Solids, ends: &[Vec3; 2], height: f32, posts: usize, piece: u32) {
    let [from, to] = *ends;
    let up = |h: f32| Vec3::Y * h;
    // The ends of bars stand past the posts.
    let along = (to - from).normalize_or(Vec3::X);
    s.beam(from + up(0.045), to + up(0.045), Vec3::Y, Vec2::new(0.075, 0.07), 0.006, wood(piece));
    s.beam(
        from + up(0.55 * height),
        to + up(0.55 * height),
        Vec3::Y,
        Vec2::new(0.05, 0.045),
        0.004,
        wood(piece + 1),
    );
    let (a, b) = (from + up(height - 0.032) - along * 0.12, to + up(height - 0.032) + along * 0.12);
    s.tube(&[a, b], &[0.032, 0.032], 14, wood(piece + 2));
    for i in 0..posts {
        let p = from.lerp(to, (i as f32 + 0.5) / posts as f32);
        s.beam(
            p + up(0.02),
            p + up(height - 0.05),
            along,
            Vec2::splat(0.055),
            0.006,
            wood(piece + 3 + i as u32),
        );
    }
}

fn pillars(out: &mut Parts) {
    let l = out.layout;
    let keys = ["pillar", "pillar_chamfer", "pillar_height", "width", "depth"];
    let all = [
        ("shite-bashira", "シテ柱", "shite-bashira", "pillar of the shite", [-1.0, -1.0]),
        ("metsuke-bashira", "目付柱", "metsuke-bashira (sumi-bashira)", "eye-fixing pillar", [-1.0, 1.0]),
        ("waki-bashira", "ワキ柱", "waki-bashira (daijin-bashira)", "pillar of the waki", [1.0, 1.0]),
        ("fue-bashira", "笛柱", "fue-bashira", "pillar of the flute", [1.0, -1.0]),
    ];
    for (i, (id, ja, romaji, en, [x, z])) in all.into_iter().enumerate() {
        let mut s = Solids::new();
        pillar(&mut s, l, Vec3::new(x * l.hw, 0.0, z * l.hd), l.head() + TIE, 120 + i as u32);
        out.add((id, ja, romaji, en), Finish::Timber, &keys, s);
    }
    let rear = [
        ("koken-bashira", "後見柱", "kōken-bashira (kyōgen-bashira)", "pillar of the stage attendants", -1.0),
        ("atoza-bashira", "後座隅柱", "atoza-sumi-bashira", "corner pillar of the rear seat", 1.0),
    ];
    for (i, (id, ja, romaji, en, x)) in rear.into_iter().enumerate() {
        let mut s = Solids::new();
        pillar(&mut s, l, Vec3::new(x * l.hw, 0.0, l.rear), l.head() + TIE, 130 + i as u32);
        out.add((id, ja, romaji, en), Finish::Timber, &["pillar", "pillar_height", "atoza_depth"], s);
    }
}

fn pillar(s: &mut Solids, l: &Layout, foot: Vec3, top: f32, piece: u32) {
    let (from, to) = (foot.with_y(l.ground + 0.08), foot.with_y(top));
    s.beam(from, to, Vec3::Z, Vec2::splat(l.pillar), l.get("pillar_chamfer"), wood(piece));
}

fn ties(out: &mut Parts) {
    let l = out.layout;
    let y = l.head() + 0.5 * TIE;
    let size = Vec2::new(0.14, TIE);
    let p = |x: f32, z: f32| Vec3::new(x * l.hw, y, z);
    let past = 0.34;
    let mut s = Solids::new();
    // Across: front, middle, rear; their noses stand out past the pillars.
    for (i, z) in [l.hd, -l.hd, l.rear].into_iter().enumerate() {
        s.beam(
            p(-1.0, z) - Vec3::X * past,
            p(1.0, z) + Vec3::X * past,
            Vec3::Y,
            size,
            0.012,
            wood(140 + i as u32),
        );
    }
    // From front to back, a little thinner, so that no faces fall together where they cross.
    for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
        let (a, b) = (p(x, l.rear), p(x, l.hd) + Vec3::Z * past);
        s.beam(a, b, Vec3::Y, size - Vec2::splat(0.012), 0.01, wood(145 + i as u32));
    }
    out.add(
        ("kashira-nuki", "頭貫", "kashira-nuki", "head ties"),
        Finish::Timber,
        &["pillar_height", "width", "depth"],
        s,
    );

    let mut s = Solids::new();
    let base = l.head() + TIE;
    for (i, [x, z]) in [[-1.0, l.hd], [1.0, l.hd], [-1.0, -l.hd], [1.0, -l.hd], [-1.0, l.rear], [1.0, l.rear]]
        .into_iter()
        .enumerate()
    {
        let at = Vec3::new(x * l.hw, base, z);
        // The block: a cube whose lower half is hollowed towards the pillar.
        let lower = rectangle(0.2, 0.2, 0.0);
        let half = 0.5 * BLOCK;
        let ring = |r: f32, y: f32| -> Vec<Vec3> {
            lower.iter().map(|p| at + Vec3::new(p.x * r, y, p.y * r)).collect()
        };
        let lines: [Vec<Vec3>; 4] = std::array::from_fn(|k| {
            // Downwards in plan order, so that the lines run counter-clockwise seen against them.
            let k = [0, 3, 2, 1][k];
            [(1.0, 0.0), (1.12, 0.2 * BLOCK), (1.4, half), (1.4, BLOCK)].map(|(r, y)| ring(r, y)[k]).to_vec()
        });
        s.bundle(&lines, wood(150 + i as u32));
        // Bracket arms along the eaves, their undersides rounded.
        arm(&mut s, at + Vec3::Y * BLOCK, Vec3::Z, 0.62, 160 + i as u32);
    }
    out.add(
        ("daito-hijiki", "大斗肘木", "daito-hijiki", "bearing blocks and bracket arms"),
        Finish::Timber,
        &["pillar"],
        s,
    );

    // Frog-leg struts between the head ties and the beams over them.
    let mut s = Solids::new();
    let n = 24;
    let height = BLOCK + ARM;
    for (i, (middle, right)) in [
        (Vec3::new(0.0, base, l.hd), Vec3::X),
        (Vec3::new(-l.hw, base, 0.0), Vec3::Z),
        (Vec3::new(l.hw, base, 0.0), Vec3::NEG_Z),
    ]
    .into_iter()
    .enumerate()
    {
        let out = right.cross(Vec3::Y);
        let line = |f: &dyn Fn(f32) -> f32| -> Vec<Vec3> {
            (0..=n)
                .map(|k| {
                    let t = 2.0 * k as f32 / n as f32 - 1.0;
                    middle + right * (0.46 * t) + Vec3::Y * f(t.abs()) + out * 0.045
                })
                .collect()
        };
        // Shoulders that fall in an S to feet which turn out.
        let upper = line(&|t| height * (1.0 - 0.9 * (t * t * (3.0 - 2.0 * t)).powf(1.7)) - 0.001);
        let lower =
            line(&|t| if t < 0.5 { height * 0.4 * (1.0 - (t / 0.5).powi(2)).sqrt() + 0.002 } else { 0.002 });
        s.board(&upper, &lower, -out * 0.09, wood(170 + i as u32));
    }
    out.add(("kaerumata", "蟇股", "kaerumata", "frog-leg struts"), Finish::Timber, &["pillar_height"], s);
}

/// A bracket arm under a beam: half its length to each side of the block.
fn arm(s: &mut Solids, at: Vec3, along: Vec3, half: f32, piece: u32) {
    let n = 10;
    let side = along.cross(Vec3::Y);
    let line = |y: &dyn Fn(f32) -> f32| -> Vec<Vec3> {
        (0..=n)
            .map(|k| {
                let t = 2.0 * k as f32 / n as f32 - 1.0;
                at + along * (half * t) + Vec3::Y * y(t.abs()) + side * 0.06
            })
            .collect()
    };
    let upper = line(&|_| ARM);
    let lower = line(&|t| 0.55 * ARM * ((t - 0.6).max(0.0) / 0.4).powi(2));
    s.board(&upper, &lower, -side * 0.12, wood(piece));
}

/// The eaves beams and the beams over the head ties that carry the gables.
pub fn roof_beams(out: &mut Parts, front: f32, back: f32) {
    let l = out.layout;
    let mut s = Solids::new();
    let y = l.beam_top() - 0.5 * BEAM;
    for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
        let at = |z: f32| Vec3::new(x * l.hw, y, z);
        s.beam(at(back), at(front), Vec3::Y, Vec2::new(0.17, BEAM), 0.012, wood(180 + i as u32));
    }
    out.add(("keta", "桁", "keta", "eaves beams"), Finish::Timber, &["width", "depth"], s);
}

fn walls(out: &mut Parts) {
    let l = out.layout;
    let (low, high) = (l.floor(-l.hd) + 0.002, l.head() - 0.002);
    // The mirror board in three panels, each with its third of the painting.
    let inner = l.hw - 0.5 * l.pillar - 0.003;
    let third = 2.0 * inner / 3.0;
    let names = [
        ("kagami-ita-left", "鏡板（左）", "kagami-ita (hidari)", "mirror board, left"),
        ("kagami-ita", "鏡板", "kagami-ita", "mirror board with the old pine"),
        ("kagami-ita-right", "鏡板（右）", "kagami-ita (migi)", "mirror board, right"),
    ];
    let finishes = [Finish::PineLeft, Finish::PineMiddle, Finish::PineRight];
    for (i, (names, finish)) in names.into_iter().zip(finishes).enumerate() {
        let x0 = -inner + third * i as f32;
        let mut s = Solids::new();
        let front = |x: f32, y: f32| Vec3::new(x, y, l.rear + 0.02);
        let (a, b) = (x0 + 0.0005, x0 + third - 0.0005);
        // v down from the top edge, u from the left: the whole picture once.
        let grain = Grain { tile: Vec2::new(b - a, high - low), offset: Vec2::ZERO };
        s.board(
            &[front(a, high), front(b, high)],
            &[front(a, low), front(b, low)],
            Vec3::NEG_Z * 0.04,
            grain,
        );
        out.add(names, finish, &["width", "pillar_height", "atoza_depth"], s);
    }
    let mut s = Solids::new();
    for (i, y) in [low + 0.06, high - 0.06].into_iter().enumerate() {
        let at = |x: f32| Vec3::new(x, y, l.rear + 0.035);
        s.beam(at(-inner), at(inner), Vec3::Y, Vec2::new(0.05, 0.11), 0.006, wood(190 + i as u32));
    }
    for (i, x) in [-inner + third, inner - third].into_iter().enumerate() {
        let at = |y: f32| Vec3::new(x, y, l.rear - 0.06);
        s.beam(at(low), at(high), Vec3::Z, Vec2::splat(0.07), 0.0, wood(192 + i as u32));
    }
    out.add(
        ("kagami-ita-waku", "鏡板框", "kagami-ita waku", "frame of the mirror board"),
        Finish::Timber,
        &["pillar_height"],
        s,
    );

    // The wall to the right with bamboo, and at its rear the low door.
    let (z0, z1) = (l.rear + 0.5 * l.pillar + 0.002, -l.hd - 0.5 * l.pillar - 0.002);
    let (door_width, door_height) = (0.78, 1.18);
    let face = |z: f32, y: f32| Vec3::new(l.hw - 0.02, y, z);
    let mut s = Solids::new();
    let whole = Vec2::new(z1 - z0, high - low);
    // From the stage, −z lies to the left of who looks at the wall along +x.
    let mut panel = |a: f32, b: f32, y0: f32, y1: f32| {
        let grain = Grain { tile: whole, offset: Vec2::new((a - z0) / whole.x, (high - y1) / whole.y) };
        s.board(&[face(a, y1), face(b, y1)], &[face(a, y0), face(b, y0)], Vec3::X * 0.035, grain);
    };
    let edge = z0 + door_width;
    panel(edge + 0.001, z1, low, high);
    panel(z0, edge - 0.001, low + door_height, high);
    out.add(
        ("waki-kagami-ita", "脇鏡板", "waki-kagami-ita", "side wall with bamboo"),
        Finish::BambooPainting,
        &["atoza_depth", "pillar_height"],
        s,
    );
    let mut s = Solids::new();
    let mut frame = |from: Vec3, to: Vec3, up: Vec3, i: u32| {
        s.beam(from, to, up, Vec2::new(0.06, 0.07), 0.004, wood(196 + i));
    };
    let off = Vec3::NEG_X * 0.01;
    frame(face(edge, low) + off, face(edge, low + door_height + 0.035) + off, Vec3::Z, 0);
    frame(
        face(z0, low + door_height) + off * 0.8,
        face(edge - 0.03, low + door_height) + off * 0.8,
        Vec3::Y,
        1,
    );
    out.add(
        ("kirido-waku", "切戸口枠", "kirido-guchi waku", "frame of the low door"),
        Finish::Timber,
        &["atoza_depth"],
        s,
    );
    let mut s = Solids::new();
    let (a, b) = (z0 + 0.004, edge - 0.034);
    s.board(
        &[face(a, low + door_height - 0.037), face(b, low + door_height - 0.037)],
        &[face(a, low), face(b, low)],
        Vec3::X * 0.03,
        Grain { tile: Vec2::new(WOOD.y, WOOD.x), ..wood(199) },
    );
    out.add(("kirido", "切戸", "kirido", "low sliding door"), Finish::Timber, &["atoza_depth"], s);
}

/// What carries the floors, and the boards that hide it.
fn substructure(out: &mut Parts) {
    let l = out.layout;
    let thickness = l.get("board_thickness");
    let mut s = Solids::new();
    let low = l.ground + 0.1;
    let inset = 0.1;
    let right = l.hw + EDGE + l.get("jiutai_width") - inset;
    let corners = [
        Vec3::new(-l.hw - EDGE + inset, 0.0, l.rear),
        Vec3::new(-l.hw - EDGE + inset, 0.0, l.hd + EDGE - inset),
        Vec3::new(right, 0.0, l.hd + EDGE - inset),
        Vec3::new(right, 0.0, -l.hd),
    ];
    let mut piece = 200;
    for pair in corners.windows(2) {
        let along = pair[1] - pair[0];
        let (n, side) = ((along.length() / 0.24).round(), along.normalize_or(Vec3::X));
        for i in 0..n as u32 {
            let at = |t: f32, y: f32| {
                (pair[0] + along * t).with_y(y) + side * (if t > i as f32 / n { -0.001 } else { 0.001 })
            };
            let (t0, t1) = (i as f32 / n, (i + 1) as f32 / n);
            let top = |t: f32| l.floor((pair[0] + along * t).z) - thickness - 0.022;
            // Outside lies to the right of the way around, which is counter-clockwise seen from above.
            let out = side.cross(Vec3::Y);
            s.board(
                &[at(t0, top(t0)), at(t1, top(t1))],
                &[at(t0, low), at(t1, low)],
                -out * 0.02,
                Grain { tile: Vec2::new(WOOD.y, WOOD.x), ..wood(piece) },
            );
            piece += 1;
        }
    }
    out.add(
        ("koshi-ita", "腰板", "koshi-ita", "boards below the floor"),
        Finish::Timber,
        &["floor_height"],
        s,
    );

    let mut s = Solids::new();
    for (i, [x, z]) in [[-1.0, l.hd], [1.0, l.hd], [-1.0, -l.hd], [1.0, -l.hd], [-1.0, l.rear], [1.0, l.rear]]
        .into_iter()
        .enumerate()
    {
        // Round and a little swollen, as stones are that were chosen and hewn.
        let at = |y: f32| Vec3::new(x * l.hw, l.ground + y, z);
        s.tube(
            &[at(-0.1), at(0.05), at(0.1), at(0.105)],
            &[0.27, 0.27, 0.22, 0.16],
            20,
            Grain::piece(Vec2::ONE, 300 + i as u32),
        );
    }
    out.add(("soseki", "礎石", "soseki", "foundation stones"), Finish::Earth, &["floor_height"], s);

    // Steps at the middle of the front.
    let steps = l.get("steps");
    let (width, rise, run) = (l.get("steps_width"), l.get("floor_height") / (steps + 1.0), 0.25);
    let front = l.hd + EDGE + 0.01;
    let mut s = Solids::new();
    for i in 0..steps as u32 {
        let y = l.ground + rise * (i + 1) as f32;
        let z = front + run * (steps - 1.0 - i as f32);
        let (a, b) =
            (Vec3::new(-0.5 * width + 0.02, y - 0.045, z), Vec3::new(0.5 * width - 0.02, y, z + run + 0.03));
        s.block(a, b, 0, wood(310 + i));
    }
    for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
        let at = |up: f32, z: f32| Vec3::new(x * 0.5 * width, up, z);
        let reach = run * steps;
        let (low, high) = (l.ground, l.floor(front) - 0.1);
        let outer = 0.024 * x;
        let (u, v) = (Vec3::X * outer, Vec3::X * -outer);
        // A slanting cheek: a board of four corners.
        let side = [
            at(high, front),
            at(low + rise, front + reach + 0.05),
            at(low, front + reach + 0.05),
            at(low, front),
        ];
        let lines: Vec<Vec3> = side.iter().map(|p| *p + if x > 0.0 { u } else { v }).collect();
        // Seen from +x, −z lies to the right.
        s.board(&[lines[1], lines[0]], &[lines[2], lines[3]], Vec3::NEG_X * 0.048, wood(316 + i as u32));
    }
    out.add(
        ("kizahashi", "階", "kizahashi (shirasu-bashigo)", "steps"),
        Finish::Timber,
        &["steps", "steps_width", "floor_height"],
        s,
    );

    // Jars below the floor that let it sound.
    let mut s = Solids::new();
    for i in 0..10u32 {
        let (x, z) = ((i % 5) as f32 - 2.0, (i / 5) as f32 * 2.0 - 1.0);
        let at = |y: f32| Vec3::new(0.42 * l.hw * x, l.ground + 0.02 + y, 0.5 * l.hd * z);
        let heights = [0.0, 0.1, 0.25, 0.4, 0.5, 0.54];
        let radii = [0.14, 0.2, 0.27, 0.25, 0.17, 0.19];
        s.tube(&heights.map(at), &radii, 20, Grain::piece(Vec2::ONE, 320 + i));
    }
    out.add(("kame", "甕", "kame", "jars below the floor"), Finish::Earth, &["floor_height"], s);
}

/// A round post with a flat top, for other rooms of the stage.
pub fn post(s: &mut Solids, from: Vec3, to: Vec3, radius: f32, grain: Grain) {
    let (axes, length) = Axes::between(from, to, Vec3::Z);
    s.prism(&circle(radius, 16), axes, length, grain);
}
