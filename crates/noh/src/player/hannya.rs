//! The mask of a demon, hannya: a woman whom jealousy has turned. From the front it rages; tilted down, where the light from above
//! reaches neither eyes nor mouth, it grieves.

use super::mask::{Hill, Mask, groove, hill, hills, painted};
use crate::part::Finish;
use crate::pattern::{Surface, Texel, fbm, noise, srgb};
use crate::sculpt::{mesh, rods};
use glam::{Vec2, Vec3};
use yugen_optics::special::smoothstep;
use yugen_scene::Mesh;

/// The mask.
pub const MASK: Mask = Mask {
    name: "hannya",
    names: ["般若", "hannya", "mask of a demon"],
    finish: Finish::Hannya,
    carved,
    half_width,
    depth: 62.0,
    horns: Some(horns),
};

// Below, x to the viewer's right and y up from the middle of the front are in millimetres.

/// On both sides.
const PAIRS: [Hill; 8] = [
    // Brows that run down to the nose, sockets, and the balls that stand out of them.
    [27.0, 40.0, 23.0, 7.0, 10.0, -0.42],
    [30.0, 19.0, 20.0, 11.0, -9.0, -0.15],
    [29.0, 16.0, 13.0, 9.5, 12.0, 0.0],
    // Cheekbones, what runs from the nose round the mouth, and the hollow behind it.
    [46.0, -6.0, 18.0, 13.0, 10.0, 0.3],
    [30.0, -34.0, 9.0, 15.0, 7.0, 0.5],
    [52.0, -42.0, 13.0, 20.0, -5.0, 0.0],
    // Wings of the nose, drawn up; the roots of the horns.
    [13.0, -17.0, 7.0, 6.5, 9.0, -0.3],
    [34.0, 74.0, 12.0, 12.0, 6.0, 0.0],
];
/// In the middle.
const MIDDLE: [Hill; 6] = [
    // Folds between the brows.
    [0.0, 44.0, 4.0, 12.0, -3.0, 0.0],
    [0.0, 66.0, 40.0, 20.0, 4.0, 0.0],
    // Lips around the open mouth, and a chin that stands out.
    [0.0, -36.0, 30.0, 6.0, 5.0, 0.0],
    [0.0, -66.0, 27.0, 6.0, 7.0, 0.0],
    [0.0, -85.0, 18.0, 12.0, 13.0, 0.0],
    [0.0, -75.0, 15.0, 4.0, -3.0, 0.0],
];

/// Where an eye is at a distance from the middle of the face, and how far open it is.
fn slit(x: f32) -> (f32, f32) {
    let along = (x - 28.0) / 14.0;
    // It rises to the outside.
    (15.0 + 2.6 * along, 5.6 * (1.0 - along * along).max(0.0).sqrt())
}

/// Where the mouth is open, and how far: its corners are drawn up and back.
fn gap(x: f32) -> (f32, f32) {
    let along = x / 41.0;
    (-51.0 + 17.0 * along * along, 10.0 * (1.0 - along.powi(4)).max(0.0).sqrt())
}

/// What is carved onto the oval.
fn carved(x: f32, y: f32) -> f32 {
    let mut h = hills(&MIDDLE, &PAIRS, x, y);
    let width = 7.5 + 4.5 * smoothstep(20.0, -16.0, y);
    h += 20.0 * smoothstep(38.0, -15.0, y) * smoothstep(-27.0, -18.0, y) * (-(x / width).powi(2)).exp();
    h -= 9.0 * groove(y, gap(x));
    // Two rows of teeth stand in the mouth, the upper with its fangs.
    for (row, tall) in teeth(x) {
        h += 6.0 * smoothstep(1.0, 0.2, ((y - row) / tall).abs());
    }
    // The rims of the eyes.
    let (at, open) = slit(x.abs());
    let rim = (((x.abs() - 28.0) / 15.0).hypot((y - at) / 7.0) - 1.0) / 0.16;
    if open > 0.0 { h + 1.6 * (-rim * rim).exp() } else { h }
}

/// Middle and half height of the upper and the lower row of teeth.
fn teeth(x: f32) -> [(f32, f32); 2] {
    let ((at, open), side) = (gap(x), x.abs());
    let tooth = 0.8 + 0.2 * (side * 0.85).cos().abs();
    let fang = 1.0 + 0.75 * (-((side - 19.0) / 3.2).powi(2)).exp();
    let there = smoothstep(0.1, 1.5, open) * smoothstep(36.0, 33.0, side);
    let half = 3.1 * tooth * there;
    [(at + open - half * fang, (half * fang).max(1e-3)), (at - open + half * fang, (half * fang).max(1e-3))]
}

/// Half the width of the oval, as part of the whole height from -1, the chin, to 1.
fn half_width(t: f32) -> f32 {
    if t > 0.0 {
        76.0 * (1.0 - t.powf(3.4)).max(0.0).powf(0.42)
    } else {
        76.0 * (1.0 - (-t).powf(2.0)).max(0.0).powf(0.58)
    }
}

/// Two horns, in metres about the middle of the rim.
fn horns() -> Mesh {
    let path = [
        (Vec3::new(0.033, 0.078, 0.040), 0.011),
        (Vec3::new(0.044, 0.106, 0.052), 0.0098),
        (Vec3::new(0.060, 0.130, 0.050), 0.0078),
        (Vec3::new(0.072, 0.152, 0.036), 0.0052),
        (Vec3::new(0.074, 0.170, 0.018), 0.0032),
    ];
    let distance = |p: Vec3| {
        let q = Vec3::new(p.x.abs(), p.y, p.z);
        // Rings, as horns grow.
        rods(q, &path, 0.006) + 0.0004 * (480.0 * (q.y + 0.4 * q.x)).sin()
    };
    let uv = |p: Vec3| Vec2::new(p.x + 0.3 * p.z, p.y) / 0.04;
    mesh("horns", [Vec3::new(-0.1, 0.05, -0.02), Vec3::new(0.1, 0.19, 0.08)], 0.0015, &distance, &uv)
}

/// How it is painted: pale above, flushed below, eyes and teeth gilt.
pub fn painting() -> Surface {
    let (pale, flushed, hair) = (srgb(0xe0c9a6), srgb(0xb5573c), srgb(0x17120f));
    let (lips, dark, gold) = (srgb(0x8f1d18), srgb(0x14090a), Vec3::new(0.93, 0.66, 0.28));
    let mix = |a: Vec3, b: Vec3, t: f32| a.lerp(b, t.clamp(0.0, 1.0));
    let within = |d: f32, soft: f32| 1.0 - smoothstep(-soft, soft, d);
    painted(|x, y, q| {
        let side = x.abs();
        let cloud = fbm(q * Vec2::new(6.0, 9.0), [6, 9], 4, 411);
        let brush = noise(q * Vec2::new(40.0, 160.0), [40, 160], 412);
        let mut colour = mix(pale, flushed, 0.85 * smoothstep(40.0, -60.0, y) + 0.12 * cloud);
        colour *= 1.0 + 0.02 * brush;
        // Hollows are darker.
        colour *= 1.0 - 0.35 * hill([30.0, 22.0, 22.0, 13.0, 1.0, -0.15], side, y);
        let (mut roughness, mut metallic) = (0.4 + 0.05 * cloud, 0.0f32);
        let (middle, open) = gap(x);
        let lip = within((y - middle).abs() - open - 3.4, 0.6) * smoothstep(0.0, 0.8, open);
        colour = mix(colour, lips, lip);
        let mouth = within((y - middle).abs() - open, 0.4) * smoothstep(0.0, 0.5, open);
        colour = mix(colour, dark, mouth);
        let tooth =
            teeth(x).iter().map(|(row, tall)| within((y - row).abs() - tall, 0.25)).fold(0.0, f32::max)
                * mouth;
        let gapped = smoothstep(0.0, 0.16, (side * 0.85).cos().abs());
        colour = mix(colour, gold * (0.35 + 0.65 * gapped), tooth);
        let (at, open) = slit(side);
        let eye = within((y - at).abs() - open, 0.35) * smoothstep(0.0, 0.5, open);
        let pupil = within((side - 27.0).hypot(y - at) - 3.6, 0.3);
        colour = mix(mix(colour, gold, eye), dark, eye * pupil);
        let line = within(((y - at).abs() - open - 0.7).abs() - 0.7, 0.3) * smoothstep(0.0, 0.8, open);
        colour = mix(colour, dark, 0.9 * line);
        let gilt = (eye * (1.0 - pupil)).max(tooth * gapped);
        metallic = metallic.max(gilt);
        roughness += (0.24 - roughness) * gilt;
        colour = mix(colour, dark, 0.85 * within(((side - 7.5) / 3.6).hypot((y + 23.0) / 2.4) - 1.0, 0.25));
        // Short brows, smudged, and loose strands over the forehead.
        let brow = hill([24.0, 58.0, 13.0, 5.0, 1.0, -0.3], side, y);
        colour = mix(colour, hair, 0.85 * smoothstep(0.3, 0.9, brow + 0.06 * cloud));
        let line = 84.0 - 0.0045 * side * side - 30.0 * smoothstep(56.0, 76.0, side);
        let over = y - line;
        let strand = noise(Vec2::new(220.0 * q.x, 30.0 * q.y), [220, 30], 413);
        let mut black = within(-over, 0.8);
        for (k, width, bend) in [(4.0, 0.6, 5.0), (8.5, 0.5, -4.0), (13.0, 0.5, 7.0), (18.0, 0.45, -6.0)] {
            let wave = over + k + 1.2 * (side / bend).sin();
            black = black.max(
                within(wave.abs() - width, 0.3) * smoothstep(8.0, 16.0, side) * smoothstep(40.0, 55.0, y),
            );
        }
        colour = mix(colour, hair * (1.0 + 0.4 * strand), black);
        metallic *= 1.0 - black;
        Texel {
            colour: colour.clamp(Vec3::ZERO, Vec3::ONE),
            roughness,
            metallic,
            height: 1.2e-5 * brush + 4e-5 * black * strand.abs(),
        }
    })
}
