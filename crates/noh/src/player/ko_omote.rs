//! The mask of a young woman, ko-omote. The face hardly moves when it is looked at, and seems to when it is tilted, because eyes,
//! mouth and cheeks are cut so that light from above darkens them (kumorasu, tilted down) or brightens them (terasu, tilted up).

use super::mask::{Hill, Mask, groove, hill, hills, painted};
use crate::part::Finish;
use crate::pattern::{Surface, Texel, fbm, noise, srgb};
use glam::{Vec2, Vec3};
use yugen_optics::special::smoothstep;

/// The mask.
pub const MASK: Mask = Mask {
    name: "ko-omote",
    names: ["小面", "ko-omote", "mask of a young woman"],
    finish: Finish::Omote,
    carved,
    half_width,
    depth: 60.0,
    horns: None,
};

// Below, x to the viewer's right and y up from the middle of the front are in millimetres.

/// On both sides.
const PAIRS: [Hill; 5] = [
    // Sockets and, in them, the balls under their lids.
    [27.0, 21.0, 21.0, 9.0, -5.0, 0.0],
    [27.0, 12.0, 15.0, 8.0, 5.0, 0.0],
    // Cheeks.
    [37.0, -20.0, 21.0, 25.0, 5.0, 0.0],
    // Wings of the nose, and what runs from them to the mouth's corners.
    [10.0, -21.0, 5.5, 5.0, 6.0, 0.0],
    [21.0, -44.0, 6.0, 9.0, -2.0, 0.0],
];
/// In the middle.
const MIDDLE: [Hill; 7] = [
    [0.0, 58.0, 46.0, 30.0, 5.0, 0.0],
    // Mouth, upper lip, lower lip, the hollow below it, chin.
    [0.0, -46.0, 25.0, 16.0, 6.0, 0.0],
    [-5.0, -41.5, 8.0, 3.2, 2.2, 0.0],
    [5.0, -41.5, 8.0, 3.2, 2.2, 0.0],
    [0.0, -52.5, 11.0, 3.6, 4.0, 0.0],
    [0.0, -61.0, 15.0, 4.5, -3.0, 0.0],
    [0.0, -79.0, 19.0, 14.0, 8.0, 0.0],
];

/// Where the slit of an eye is at a distance from the middle of the face, and how far open it is.
fn slit(x: f32) -> (f32, f32) {
    let along = (x - 27.0) / 13.5;
    // It hangs a little to the outside.
    (11.5 - 2.2 * along * along - 1.0 * along, 2.6 * (1.0 - along * along).max(0.0).sqrt())
}

/// Where the mouth is open, and how far.
fn gap(x: f32) -> (f32, f32) {
    let along = x / 18.0;
    (-47.5 + 1.8 * along * along, 2.0 * (1.0 - along * along).max(0.0).sqrt())
}

/// What is carved onto the oval.
fn carved(x: f32, y: f32) -> f32 {
    let mut h = hills(&MIDDLE, &PAIRS, x, y);
    // The nose rises from between the eyes to its tip.
    let width = 6.5 + 3.5 * smoothstep(20.0, -18.0, y);
    h += 18.0 * smoothstep(34.0, -17.0, y) * smoothstep(-29.0, -20.0, y) * (-(x / width).powi(2)).exp();
    h - 2.6 * groove(y, slit(x.abs())) - 4.5 * groove(y, gap(x))
}

/// Half the width of the oval, as part of the whole height from -1, the chin, to 1.
fn half_width(t: f32) -> f32 {
    if t > 0.0 {
        68.0 * (1.0 - t.powf(3.0)).max(0.0).powf(0.45)
    } else {
        68.0 * (1.0 - (-t).powf(2.3)).max(0.0).powf(0.52)
    }
}

/// How it is painted.
pub fn painting() -> Surface {
    let (white, blush, hair) = (srgb(0xe9dcc3), srgb(0xe0b79c), srgb(0x17120f));
    let (lips, teeth, pupil) = (srgb(0xa63a2c), srgb(0x1c1512), srgb(0x080606));
    let mix = |a: Vec3, b: Vec3, t: f32| a.lerp(b, t.clamp(0.0, 1.0));
    let within = |d: f32, soft: f32| 1.0 - smoothstep(-soft, soft, d);
    painted(|x, y, q| {
        let side = x.abs();
        let cloud = fbm(q * Vec2::new(6.0, 9.0), [6, 9], 4, 401);
        let brush = noise(q * Vec2::new(40.0, 160.0), [40, 160], 402);
        let mut colour = white * (1.0 + 0.035 * cloud + 0.012 * brush);
        colour = mix(colour, blush, 0.35 * hill([38.0, -22.0, 22.0, 20.0, 1.0, 0.0], side, y));
        let mut roughness = 0.42 + 0.05 * cloud;
        // Lips, and between them the teeth, which are black.
        let (middle, open) = gap(x);
        let bow = -38.2 - 1.6 * (-(x / 3.0).powi(2)).exp() - 0.016 * x * x;
        let under = -57.5 + 0.028 * x * x;
        let lip = within(y - bow, 0.5) * within(under - y, 0.5) * within(side - 19.0, 0.8);
        colour = mix(colour, lips * (1.0 + 0.1 * cloud), lip);
        colour = mix(colour, teeth, within((y - middle).abs() - open, 0.35) * smoothstep(0.0, 0.5, open));
        // Eyes: white, a black pupil, a line above.
        let (middle, open) = slit(side);
        if open > 0.0 {
            let eye = within((y - middle).abs() - open, 0.3);
            colour = mix(colour, srgb(0xcfc4ae), eye);
            colour = mix(colour, pupil, eye * within((side - 25.5).abs() - 4.2, 0.3));
            let line = within((y - middle - open).abs() - 0.9, 0.35);
            colour = mix(colour, hair, line * smoothstep(0.0, 0.5, open));
            colour = mix(colour, hair, 0.5 * within((y - middle + open).abs() - 0.3, 0.3));
        }
        // Nostrils.
        colour = mix(colour, teeth, 0.85 * within(((side - 5.5) / 2.6).hypot((y + 27.5) / 1.6) - 1.0, 0.25));
        // Eyebrows high on the forehead, smudged with the finger.
        let brow = hill([29.0, 52.0 - 0.02 * (side - 29.0).powi(2), 16.0, 7.0, 1.0, 0.0], side, y);
        colour = mix(colour, hair, 0.88 * smoothstep(0.25, 0.9, brow + 0.05 * cloud));
        // Hair: parted in the middle, along the rim to the cheeks, with loose strands before it.
        let line = 79.0
            - 0.0052 * side * side
            - 34.0 * smoothstep(44.0, 66.0, side)
            - 60.0 * smoothstep(58.0, 70.0, side);
        let over = y - line;
        let strand = noise(Vec2::new(220.0 * q.x, 30.0 * q.y), [220, 30], 403);
        let mut black = within(-over, 0.8);
        for (k, width) in [(3.2, 0.55), (6.4, 0.5), (9.8, 0.45)] {
            black = black.max(
                within((over + k + 0.05 * side).abs() - width, 0.3)
                    * smoothstep(14.0, 30.0, side)
                    * smoothstep(8.0, 30.0, y),
            );
        }
        black *= 1.0 - within(side - 0.5, 0.4);
        colour = mix(colour, hair * (1.0 + 0.4 * strand), black);
        roughness = roughness + (0.3 - roughness) * black.max(0.7 * lip);
        Texel {
            colour: colour.clamp(Vec3::ZERO, Vec3::ONE),
            roughness,
            metallic: 0.0,
            // Brushed ground, worn hair.
            height: 1.2e-5 * brush + 4e-5 * black * strand.abs(),
        }
    })
}
