//! How fast a BTF is fitted: `fit_rate [SIDE [LIGHTS [THREADS [DUMP]]]]`, by default 512 × 512 texels under 64 lights on
//! one thread. With DUMP, writes `DUMP.f32`: per light its direction, then per texel the readings (mean of the channels)
//! and the truth, for `benches/fit_rate.py`, which fits the same with SciPy and NumPy.

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};
use std::time::Instant;
use yugen_capture::simulate::fibonacci_dome;
use yugen_capture::{Eye, Lights, Stack, fit};
use yugen_optics::Frame;
use yugen_optics::frame::spherical;
use yugen_optics::random::Pcg32;
use yugen_reflectance::btf::Texel;
use yugen_reflectance::{Choice, Model};

fn texel(rng: &mut Pcg32) -> Texel {
    let (u, v, w) = (rng.next_vec3(), rng.next_vec3(), rng.next_vec3());
    let normal = spherical(15f32.to_radians() * u.x.sqrt(), TAU * u.y);
    let frame = Frame::from_normal_tangent(normal, spherical(PI / 2.0, PI * u.z));
    let sigma_x = 0.15 + 0.35 * v.x;
    let sigma = Vec2::new(sigma_x, sigma_x / (1.7 + 2.3 * v.y));
    Texel {
        diffuse: Vec3::new(1.0, 0.5, 0.3) * (0.05 + 0.35 * w.x),
        specular: Vec3::new(1.0, 0.9, 0.7) * ((0.3 + 1.2 * v.z) * 4.0 * sigma.x * sigma.y),
        normal: frame.n,
        tangent: frame.s,
        sigma,
        confidence: 1.0,
    }
}

fn main() -> std::io::Result<()> {
    let argument = |i: usize, default: usize| {
        std::env::args()
            .nth(i)
            .map_or(default, |a| a.parse().unwrap_or_else(|_| panic!("'{a}' is not a whole number")))
    };
    let (side, lights, threads) = (argument(1, 512), argument(2, 64), argument(3, 1));
    let directions = fibonacci_dome(lights, 75f32.to_radians());
    let mut rng = Pcg32::new(1, 1);
    let (mut values, mut truth) = (Vec::with_capacity(side * side * lights), Vec::new());
    for _ in 0..side * side {
        let t = texel(&mut rng);
        let (frame, noh) = (t.frame(), t.noh(Choice(0.0)));
        let wo = frame.to_local(Vec3::Z);
        for l in &directions {
            let wi = frame.to_local(*l);
            let u = rng.next_vec3();
            // Two sums of uniforms are noise enough for a measure of speed: deviations .01 and .001.
            let noise = Vec2::new(u.x + u.y - 1.0, u.y + u.z - 1.0) * 6f32.sqrt();
            let clean = noh.eval(&[], wo, wi) * (PI * wi.z.max(0.0));
            values.push((clean * (1.0 + 0.01 * noise.x) + 0.001 * noise.y).to_array());
        }
        truth.push(t);
    }
    if let Some(dump) = std::env::args().nth(4) {
        let mut out: Vec<f32> = vec![directions.len() as f32, truth.len() as f32];
        out.extend(directions.iter().flat_map(|d| d.to_array()));
        for (t, samples) in truth.iter().zip(values.chunks_exact(lights)) {
            out.extend(samples.iter().map(|c| (c[0] + c[1] + c[2]) / 3.0));
            out.extend([t.diffuse.element_sum() / 3.0, t.specular.element_sum() / 3.0]);
            out.extend(t.normal.to_array().iter().chain(&t.tangent.to_array()).chain(&t.sigma.to_array()));
        }
        std::fs::write(format!("{dump}.f32"), out.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?;
    }
    let stack = Stack {
        width: side,
        height: side,
        first_row: 0,
        rows: side,
        eyes: vec![Eye::ABOVE; directions.len()],
        lights: Lights::Distant(directions),
        values,
    };
    let start = Instant::now();
    let fitted = fit::fit(&stack, &fit::Options::default(), None, threads, &|_| {});
    let seconds = start.elapsed().as_secs_f64();
    let texels = fitted.len() as f64;
    let passes: f64 = fitted.iter().map(|f| f64::from(f.passes)).sum::<f64>() / texels;
    let mut error: Vec<f32> =
        fitted.iter().zip(&truth).map(|(f, t)| (f.texel.sigma.x / t.sigma.x - 1.0).abs()).collect();
    error.sort_unstable_by(f32::total_cmp);
    // Three floats a reading in, a texel out; between them a block of eight stays in the cache.
    let bytes = lights * 12 + std::mem::size_of::<Texel>();
    println!(
        "{side} x {side} texels, {lights} lights, {threads} threads: {seconds:.2} s, {:.0} texels/s, {:.2} us a texel and thread, \
         {passes:.1} passes (in step), {bytes} bytes moved a texel, median error of sigma_x {:.2} %",
        texels / seconds,
        1e6 * seconds * threads as f64 / texels,
        100.0 * error[error.len() / 2]
    );
    Ok(())
}
