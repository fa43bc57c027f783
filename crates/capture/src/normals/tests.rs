use super::*;
use crate::simulate::fibonacci_dome;
use crate::{Eye, Lights, Stack};
use std::f32::consts::PI;
use yugen_optics::Frame;
use yugen_optics::random::Pcg32;
use yugen_reflectance::Model;
use yugen_reflectance::oren_nayar::OrenNayar;

const SIZE: usize = 48;
const ALBEDO: [f32; 3] = [0.5, 0.3, 0.2];

/// Half a sphere that fills the picture: normals everywhere but at its rim.
fn normal(x: usize, y: usize) -> Option<Vec3> {
    let at = |v: usize| 2.0 * (v as f32 + 0.5) / SIZE as f32 - 1.0;
    let (u, v) = (at(x), -at(y));
    let z2 = 1.0 - u * u - v * v;
    // Down to 75°.
    (z2 > 0.067).then(|| Vec3::new(u, v, z2.sqrt()))
}

/// What spoils the photographs.
#[derive(Clone, Copy, Default)]
struct Spoilt {
    /// Every so manieth reading lies in shadow.
    shadows: Option<u32>,
    /// A highlight of this height, as wide as Beckmann's of roughness .15.
    shine: f32,
    coated: bool,
    /// As of the model `oren_nayar`.
    sigma: f32,
    noise: f32,
}

fn photograph(lights: &Lights, spoilt: Spoilt) -> Stack {
    let mut rng = Pcg32::new(3, 0);
    let mut stack = Stack {
        width: SIZE,
        height: SIZE,
        first_row: 0,
        rows: SIZE,
        lights: lights.clone(),
        eyes: vec![Eye::ABOVE; lights.len()],
        values: Vec::new(),
    };
    for i in 0..SIZE * SIZE {
        let (x, y) = (i % SIZE, i / SIZE);
        for l in 0..lights.len() {
            let (toward, irradiance) = stack.light(l, x, y);
            let random = [rng.next_f32(), rng.next_f32()];
            stack.values.push(match normal(x, y) {
                None => [f32::NAN; 3],
                Some(n) => {
                    let cos = n.dot(toward).max(0.0);
                    let dark = spoilt.shadows.is_some_and(|every| (random[0] * every as f32) < 1.0);
                    let coat = if spoilt.coated { 1.0 - (1.0 - cos).powi(5) } else { 1.0 };
                    let h = n.dot((toward + Vec3::Z).normalize());
                    let tan2 = 1.0 / (h * h) - 1.0;
                    let shine = spoilt.shine * (-tan2 / 0.0225).exp() * f32::from(u8::from(cos > 0.0));
                    let light = if dark { 0.02 } else { 1.0 };
                    let noise = 1.0 + spoilt.noise * (random[1] - 0.5);
                    let (eye, frame) = (stack.eye(l, x, y), Frame::from_normal(n));
                    let rough = OrenNayar {
                        reflectance: Vec3::from(ALBEDO),
                        sigma: spoilt.sigma,
                        ..OrenNayar::default()
                    };
                    let f = rough.eval(&[], frame.to_local(eye), frame.to_local(toward)) * PI;
                    let ground = if spoilt.sigma > 0.0 { f.to_array() } else { ALBEDO };
                    ground.map(|rho| irradiance * light * noise * (rho * cos * coat + shine))
                }
            });
        }
    }
    stack
}

/// Degrees by which normals are off: mean and worst, of all and of those above a confidence of a half.
struct Off {
    mean: f32,
    worst: f32,
    sure: usize,
    sure_worst: f32,
    albedo: f32,
}

fn off(stack: &Stack, surface: &Surface) -> Off {
    let found = find(stack, surface, &Options::default(), 2, &|_| {});
    let (mut sum, mut count) = (0.0, 0);
    let mut off = Off { mean: 0.0, worst: 0.0, sure: 0, sure_worst: 0.0, albedo: 0.0 };
    for (i, f) in found.iter().enumerate() {
        let Some(n) = normal(i % SIZE, i / SIZE) else {
            assert_eq!(*f, NOTHING);
            continue;
        };
        let angle = n.cross(f.normal).length().min(1.0).asin().to_degrees();
        let angle = if n.dot(f.normal) < 0.0 { 180.0 - angle } else { angle };
        (sum, count) = (sum + angle, count + 1);
        off.worst = off.worst.max(angle);
        if f.confidence > 0.5 {
            off.sure += 1;
            off.sure_worst = off.sure_worst.max(angle);
        }
        if angle < 1.0 {
            let far = (0..3).map(|c| (f.albedo[c] / ALBEDO[c] - 1.0).abs()).fold(0.0, f32::max);
            off.albedo = off.albedo.max(far);
        }
    }
    off.mean = sum / count as f32;
    println!(
        "mean {} worst {} sure {} of {count}, worst {} albedo {}",
        off.mean, off.worst, off.sure, off.sure_worst, off.albedo
    );
    off
}

fn surface_of(stack: &Stack) -> Surface {
    Surface::of(std::slice::from_ref(stack), None, &Options::default(), 2)
}

fn dome(lights: usize) -> Lights {
    Lights::Distant(fibonacci_dome(lights, 70f32.to_radians()))
}

#[test]
fn exact_readings_give_exact_normals() {
    for lights in [4, 8, 24] {
        let stack = photograph(&dome(lights), Spoilt::default());
        let surface = surface_of(&stack);
        assert_eq!((surface.ground, surface.slack), (Ground::Matte, SLACK[0]), "{lights}");
        let off = off(&stack, &surface);
        // Four lights leave a steep texel two.
        assert!(off.mean < if lights == 4 { 3.0 } else { 0.01 } && off.sure_worst < 0.01, "{lights}");
        assert!(off.albedo < 0.04 && off.sure > 600, "{lights}");
    }
}

/// A fifth of the readings in shadow, a highlight brighter than the ground, noise of 2 %; least squares, which knows
/// nothing of it all, is the sabotage.
#[test]
fn shadows_and_highlights_are_left_out() {
    let spoilt = Spoilt { shadows: Some(5), shine: 0.6, noise: 0.04, ..Spoilt::default() };
    let stack = photograph(&dome(24), spoilt);
    let surface = surface_of(&stack);
    assert_eq!(surface.ground, Ground::Matte);
    let robust = off(&stack, &surface);
    assert!(robust.mean < 1.0 && robust.sure_worst < 6.0 && robust.sure > 1000, "{}", robust.mean);
    let numb = Options { noise: 50.0, ..Options::default() };
    let found = find(&stack, &surface, &numb, 1, &|_| {});
    let angle =
        |(i, f): (usize, &Found)| Some(normal(i % SIZE, i / SIZE)?.angle_between(f.normal).to_degrees());
    let all: Vec<f32> = found.iter().enumerate().filter_map(angle).collect();
    let mean = all.iter().sum::<f32>() / all.len() as f32;
    assert!(mean > 4.0 * robust.mean, "{mean} {}", robust.mean);
}

/// The coat is told from the readings; taken for bare, as sabotage, it turns every normal.
#[test]
fn a_glazed_thing_is_known_as_such() {
    let stack = photograph(&dome(24), Spoilt { coated: true, shine: 0.6, noise: 0.02, ..Spoilt::default() });
    let surface = surface_of(&stack);
    assert_eq!(surface.ground, Ground::Coated);
    let right = off(&stack, &surface).mean;
    let wrong = off(&stack, &Surface { ground: Ground::Matte, ..surface }).mean;
    assert!(right < 0.6 && wrong > 3.0 * right, "{right} {wrong}");
}

/// Clay and sandstone, of the library's own model, whose light between the cavities' walls the fit does not know: taken for
/// Lambert's, as sabotage, normals lean too little.
#[test]
fn a_rough_thing_is_known_as_such() {
    for (lights, sigma) in [(50, 0.25), (50, 0.5), (12, 0.35)] {
        let spoilt = Spoilt { sigma, shadows: Some(8), noise: 0.02, ..Spoilt::default() };
        let stack = photograph(&dome(lights), spoilt);
        let surface = surface_of(&stack);
        let right = off(&stack, &surface).mean;
        let wrong = off(&stack, &Surface { ground: Ground::Matte, roughness: 0.0, ..surface }).mean;
        println!("{lights} {sigma}: {} {} {right:.2} {wrong:.2}", surface.ground.name(), surface.roughness);
        assert_eq!(surface.ground, Ground::Rough);
        assert!((surface.roughness / sigma - 1.0).abs() < 0.45, "{}", surface.roughness);
        assert!(right < 1.5 && wrong > 2.5 * right, "{right} {wrong}");
    }
}

#[test]
fn near_lamps_are_followed() {
    let near = fibonacci_dome(16, 60f32.to_radians()).into_iter().map(|l| l * 1.5).collect();
    let stack = photograph(&Lights::Near(near), Spoilt::default());
    let surface = surface_of(&stack);
    let right = off(&stack, &surface);
    assert!(right.mean < 0.05 && right.albedo < 0.02, "{}", right.mean);
    // Taken for far ones they turn the normals toward the border.
    let far = Stack { lights: dome(16), ..stack };
    assert!(off(&far, &surface).mean > 3.0);
}

/// Nothing depends on who goes in step with whom, and nothing on the number of threads.
#[test]
fn the_bits_are_the_same_however_it_is_cut() {
    let stack = photograph(&dome(15), Spoilt { shadows: Some(6), noise: 0.05, ..Spoilt::default() });
    let surface = surface_of(&stack);
    let options = Options::default();
    let whole = find(&stack, &surface, &options, 3, &|_| {});
    let row = SIZE * stack.lights.len();
    let mut rows = Vec::new();
    for (y, values) in stack.values.chunks(row).enumerate() {
        // One texel less, so that other texels stand side by side.
        let part = Stack { width: SIZE, height: 1, first_row: y, values: values.to_vec(), ..stack.clone() };
        rows.extend(find(&part, &surface, &options, 1, &|_| {}));
    }
    assert!(whole == rows);
}

#[test]
fn lights_in_a_plane_are_too_few() {
    let plane = |n: usize| (0..n).map(|i| Vec3::new(i as f32 - 2.0, 0.0, 3.0)).collect::<Vec<_>>();
    assert!(!lights_suffice(&plane(9)));
    assert!(!lights_suffice(&[]));
    let mut aside = plane(9);
    aside.push(Vec3::new(0.0, 1.0, 2.0));
    assert!(lights_suffice(&aside));
}

/// Masked, saturated and black texels.
#[test]
fn what_cannot_be_known_is_said_so() {
    let mut stack = photograph(&dome(9), Spoilt::default());
    let (n, middle) = (9, SIZE * SIZE / 2 + SIZE / 2);
    stack.values[middle * n..][..n].fill([f32::NAN; 3]);
    stack.values[(middle + 1) * n..][..7].fill([f32::NAN; 3]);
    stack.values[(middle + 2) * n..][..n].fill([0.0; 3]);
    let surface = Surface { ground: Ground::Matte, roughness: 0.0, slack: 0.01 };
    let found = find(&stack, &surface, &Options::default(), 1, &|_| {});
    assert_eq!(found[middle], NOTHING);
    assert_eq!(found[middle + 1], Found { readings: 2, ..NOTHING });
    let black = found[middle + 2];
    assert!(black.confidence < 0.1 && black.normal.is_finite() && black.albedo.is_finite(), "{black:?}");
    assert!(found[middle + 3].confidence > 0.5);
}
