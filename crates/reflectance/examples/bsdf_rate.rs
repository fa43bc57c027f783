//! Nanoseconds that a call of each model takes on one core, with default parameters.
//!
//! `cargo run --release -p yugen-reflectance --example bsdf_rate`. One line a model: name, then value, density, both at
//! once, and a draw. `benches/bsdf_rate.py` sets Mitsuba's beside them.

use glam::Vec3;
use std::hint::black_box;
use std::time::Instant;
use yugen_optics::{ColourSpace, random::Pcg32, warp};
use yugen_reflectance::{Bsdf, Data, Kind};

/// Pairs of directions; they stay in the first cache.
const PAIRS: usize = 1000;

/// The quickest of thirty runs over all pairs, in nanoseconds a pair: the machine may have other work.
fn nanoseconds(pairs: &[(Vec3, Vec3)], mut call: impl FnMut(Vec3, Vec3) -> f32) -> f64 {
    let run = || {
        let start = Instant::now();
        black_box(pairs.iter().map(|&(a, b)| call(black_box(a), b)).sum::<f32>());
        start.elapsed().as_nanos() as f64 / pairs.len() as f64
    };
    std::iter::repeat_with(run).take(30).fold(f64::INFINITY, f64::min)
}

fn main() {
    let mut rng = Pcg32::new(1, 2);
    let mut direction = || warp::cosine_hemisphere(rng.next_vec3().truncate());
    let above: Vec<(Vec3, Vec3)> = (0..PAIRS).map(|_| (direction(), direction())).collect();
    let uniforms: Vec<(Vec3, Vec3)> = above.iter().map(|&(wo, _)| (wo, rng.next_vec3())).collect();
    println!("{:<28} {:>8} {:>8} {:>10} {:>8}", "ns a call", "eval", "pdf", "eval_pdf", "sample");
    for &kind in Kind::ALL {
        let (slots, data) = match (kind.data(), kind.presets().first()) {
            (Data::Required(_), Some(preset)) => {
                kind.preset(preset.name, ColourSpace::LinearSrgb).expect("a preset of the list")
            }
            (Data::Required(what), None) => {
                println!("{:<28} needs {what}", kind.name());
                continue;
            }
            _ => (kind.defaults(), Vec::new()),
        };
        let table = kind.bake(&slots, &data).expect("its own data");
        let bsdf = Bsdf::new(kind, &slots, &table);
        println!(
            "{:<28} {:8.1} {:8.1} {:10.1} {:8.1}",
            kind.name(),
            nanoseconds(&above, |wo, wi| bsdf.eval(wo, wi).x),
            nanoseconds(&above, |wo, wi| bsdf.pdf(wo, wi)),
            nanoseconds(&above, |wo, wi| {
                let (f, pdf) = bsdf.eval_pdf(wo, wi);
                f.x + pdf
            }),
            nanoseconds(&uniforms, |wo, u| bsdf.sample(wo, u).map_or(0.0, |s| s.weight.x)),
        );
    }
}
