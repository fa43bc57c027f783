//! Wrinkling (cun), rubbing (ca) and colouring (ran): the brush's state at each pixel of a surface.
//!
//! With G a grey and ρ = 1 − G, h(N·V) a curve from the silhouette to the centre and s a stripe mask:
//! P = (k ρ h)^α, I = (m ρ)^β s, D = (q G h)^γ, and the angle is that of the gradient of h. Wrinkling takes the grey of the diffuse
//! map, colouring that of Phong's light and no stripes; rubbing is wrinkling with a brush that is nearly dry.

use super::{Padi, Technique};
use glam::{Vec2, Vec3};
use yugen_motion::noise::noise;
use yugen_optics::random::{hash_combine, unit_f32};
use yugen_optics::special::smoothstep;

/// What the first pass knows of a pixel on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The shape, counted from one.
    pub shape: u32,
    /// Cosine between normal and view.
    pub facing: f32,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Grey of the diffuse map, as displays have it.
    pub diffuse: f32,
    /// Grey of Phong's light, likewise.
    pub lit: f32,
}

/// Factors and exponents of a technique.
#[derive(Clone, Copy, Debug)]
pub struct Factors {
    /// Of pressure.
    pub k: f32,
    /// Of intensity.
    pub m: f32,
    /// Of dryness.
    pub q: f32,
    /// Exponents of pressure, intensity and dryness.
    pub exponents: [f32; 3],
}

/// Medium k and m, high q.
const WRINKLING: Factors = Factors { k: 0.9, m: 0.8, q: 1.2, exponents: [1.0, 1.0, 0.8] };
/// Low m and q: it fills what is left.
const COLOURING: Factors = Factors { k: 0.9, m: 0.4, q: 0.25, exponents: [1.0, 1.1, 0.8] };
/// Of rubbing, which the slides only name: dryness and intensity of a brush that is wiped, and the part of wrinkles' pixels.
const RUBBING: [f32; 3] = [0.85, 0.35, 0.6];
/// What looks at the eye gets this much of what the silhouette gets, and the cosine from which on it does.
const CENTRE: [f32; 2] = [0.35, 0.8];
/// Stripes along u and v: twelve times as many across as along.
const STRIPES: [f32; 2] = [84.0, 7.0];
/// Part of a surface that is stripes.
const STRIPED: f32 = 0.45;
/// Slope of h, per pixel, below which a surface looks at the eye and gives no angle.
const FLAT: f32 = 1e-4;
/// Phong's ambient, diffuse and specular factors and exponent (Phong 1975).
const PHONG: [f32; 4] = [0.25, 0.7, 0.3, 24.0];

/// From the silhouette (0) to the centre (1).
pub fn h(facing: f32) -> f32 {
    1.0 + (CENTRE[0] - 1.0) * smoothstep(0.0, CENTRE[1], facing)
}

/// Phong's light on a diffuse colour, with unit vectors away from the surface.
pub fn phong(colour: f32, normal: Vec3, eye: Vec3, light: Vec3) -> f32 {
    let [ambient, diffuse, specular, exponent] = PHONG;
    let mirrored = 2.0 * normal.dot(light) * normal - light;
    let shine = if normal.dot(light) > 0.0 { mirrored.dot(eye).max(0.0).powf(exponent) } else { 0.0 };
    colour * (ambient + diffuse * normal.dot(light).max(0.0)) + specular * shine
}

/// A light as displays show it.
pub fn grey(light: f32) -> f32 {
    light.clamp(0.0, 1.0).powf(1.0 / 2.2)
}

/// The stripe mask: 0 or 1, with an edge between.
fn stripes(uv: Vec2) -> f32 {
    let wave = noise(Vec3::new(uv.x * STRIPES[0], uv.y * STRIPES[1], 0.5)).0
        + 0.5 * noise(Vec3::new(2.0 * uv.x * STRIPES[0], 2.0 * uv.y * STRIPES[1], 7.5)).0;
    // The noise has a deviation of .3 about zero.
    let limit = 0.3 * (1.0 - 2.0 * STRIPED);
    smoothstep(limit - 0.06, limit + 0.06, wave)
}

impl Factors {
    /// The state where the grey is so, of a pixel with a stripe mask; every base is kept to 0 to 1, else powers are none.
    pub fn padi(&self, grey: f32, h: f32, stripe: f32, angle: f32) -> Padi {
        let [alpha, beta, gamma] = self.exponents;
        let power = |base: f32, exponent: f32| base.clamp(0.0, 1.0).powf(exponent);
        Padi {
            pressure: power(self.k * (1.0 - grey) * h, alpha),
            angle,
            dryness: power(self.q * grey * h, gamma),
            intensity: power(self.m * (1.0 - grey), beta) * stripe,
        }
    }
}

/// First pass over surfaces: `None` where nothing is. `strength` scales m.
pub fn padi(
    technique: Technique,
    pixels: &[Option<Seen>],
    width: usize,
    strength: f32,
    seed: u32,
) -> Vec<Padi> {
    let at = |i: usize, shape: u32| pixels.get(i)?.as_ref().filter(|s| s.shape == shape);
    let slope = |i: usize, shape: u32, value: &dyn Fn(&Seen) -> f32| {
        let along = |step: usize| match (i.checked_sub(step).and_then(|j| at(j, shape)), at(i + step, shape))
        {
            (Some(a), Some(b)) => value(b) - value(a),
            _ => 0.0,
        };
        // The first and the last column have a neighbour in another line.
        let edge = i.is_multiple_of(width) || (i + 1).is_multiple_of(width);
        0.5 * Vec2::new(if edge { 0.0 } else { along(1) }, along(width))
    };
    let mut out = vec![Padi::default(); pixels.len()];
    for (i, seen) in pixels.iter().enumerate() {
        let Some(seen) = seen else { continue };
        let curve = h(seen.facing);
        let gradient = slope(i, seen.shape, &|s| h(s.facing));
        // Where h is level: along the stripes.
        let angle = if gradient.length() > FLAT {
            gradient.to_angle()
        } else {
            slope(i, seen.shape, &|s| s.uv.y).to_angle()
        };
        let chance = unit_f32(hash_combine(hash_combine(seed, 0xca), i as u32));
        out[i] = match technique {
            Technique::Colouring => {
                Factors { m: COLOURING.m * strength, ..COLOURING }.padi(seen.lit, curve, 1.0, angle)
            }
            Technique::Wrinkling => {
                let factors = Factors { m: WRINKLING.m * strength, ..WRINKLING };
                factors.padi(seen.diffuse, curve, stripes(seen.uv), angle)
            }
            Technique::Rubbing if chance < RUBBING[2] => {
                let wrinkle = WRINKLING.padi(seen.diffuse, curve, stripes(seen.uv + 0.37), angle);
                let intensity = if wrinkle.intensity > 0.0 { RUBBING[1] * strength } else { 0.0 };
                Padi { dryness: RUBBING[0], intensity: intensity.min(1.0), ..wrinkle }
            }
            _ => Padi::default(),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The formulae at places where they can be done by hand.
    #[test]
    fn states_are_those_of_the_formulae() {
        let f = Factors { k: 0.5, m: 0.8, q: 1.0, exponents: [2.0, 1.0, 0.5] };
        let p = f.padi(0.36, 1.0, 1.0, 0.3);
        // (.5 · .64)², .8 · .64, √.36.
        let want = [0.1024, 0.512, 0.6];
        let have = [p.pressure, p.intensity, p.dryness];
        assert!(have.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-6), "{have:?}");
        assert_eq!((p.angle, f.padi(0.36, 1.0, 0.0, 0.3).intensity), (0.3, 0.0));
        // White paper takes no ink; bases beyond one are one.
        assert_eq!(f.padi(1.0, 1.0, 1.0, 0.0).intensity, 0.0);
        assert_eq!(Factors { q: 9.0, ..f }.padi(0.5, 1.0, 1.0, 0.0).dryness, 1.0);
        assert!(h(0.0) == 1.0 && (h(1.0) - CENTRE[0]).abs() < 1e-6);
    }

    #[test]
    fn stripes_are_as_much_of_a_surface_as_they_should_be_and_long() {
        let at = |i: usize| Vec2::new((i % 400) as f32 / 400.0, (i / 400) as f32 / 400.0);
        let mask: Vec<f32> = (0..160_000).map(|i| stripes(at(i))).collect();
        let share = mask.iter().sum::<f32>() / mask.len() as f32;
        // Measured .42.
        assert!((share - STRIPED).abs() < 0.08, "{share}");
        let changes = |step: usize| {
            (0..mask.len() - step).filter(|i| (mask[*i] > 0.5) != (mask[i + step] > 0.5)).count() as f32
        };
        assert!(changes(1) > 6.0 * changes(400), "across {} along {}", changes(1), changes(400));
    }

    #[test]
    fn angles_follow_the_gradient_of_h() {
        // Facing grows to the right: h falls, its gradient points to the left.
        let seen =
            |x: usize| Seen { shape: 1, facing: x as f32 / 10.0, uv: Vec2::ZERO, diffuse: 0.2, lit: 0.2 };
        let pixels: Vec<Option<Seen>> = (0..30).map(|i| Some(seen(i % 10))).collect();
        let out = padi(Technique::Colouring, &pixels, 10, 1.0, 0);
        assert!((out[14].angle.abs() - std::f32::consts::PI).abs() < 1e-5, "{:?}", out[14]);
        // The edge of the picture has no gradient across: that from the other edge would be the other way about.
        let mirrored: Vec<Option<Seen>> = (0..30).map(|i| Some(seen(9 - i % 10))).collect();
        let out = padi(Technique::Colouring, &mirrored, 10, 1.0, 0);
        assert_eq!([10, 14, 19].map(|i| out[i].angle), [0.0; 3]);
    }
}
