//! What the microcylinder cloth costs: nanoseconds a call on one core, and the variance of its sampler in a
//! white furnace against cosine-weighted sampling, per fabric and form.

use glam::Vec3;
use std::hint::black_box;
use std::time::Instant;
use yugen_optics::{ColourSpace, frame::spherical, random::Pcg32, warp};
use yugen_reflectance::{Bsdf, Kind};

/// The quickest of fifteen runs over all pairs, in nanoseconds a pair: the machine may have other work.
fn nanoseconds(pairs: &[(Vec3, Vec3)], mut call: impl FnMut(Vec3, Vec3) -> f32) -> f64 {
    let mut runs: Vec<f64> = (0..15)
        .map(|_| {
            let start = Instant::now();
            let sum: f32 = pairs.iter().map(|&(a, b)| call(a, b)).sum();
            black_box(sum);
            start.elapsed().as_nanos() as f64 / pairs.len() as f64
        })
        .collect();
    runs.sort_by(f64::total_cmp);
    runs[0]
}

/// Variance of one sample's green weight, by the model's sampler and by the cosine.
fn variances(bsdf: &Bsdf, wo: Vec3) -> (f64, f64) {
    let mut rng = Pcg32::new(5, 6);
    let n = 100_000;
    let mut moments = [[0f64; 2]; 2];
    for _ in 0..n {
        let u = rng.next_vec3();
        let own = bsdf.sample(wo, u).map_or(0.0, |s| s.weight.y);
        let wi = warp::cosine_hemisphere(u.truncate());
        let cosine = bsdf.eval(wo, wi).y * std::f32::consts::PI;
        for (m, x) in moments.iter_mut().zip([own, cosine]) {
            m[0] += f64::from(x) / f64::from(n);
            m[1] += f64::from(x * x) / f64::from(n);
        }
    }
    let [own, cosine] = moments.map(|[m, m2]| m2 - m * m);
    (own, cosine)
}

fn main() {
    let kind = Kind::Microcylinder;
    let mut rng = Pcg32::new(1, 2);
    let pairs: Vec<(Vec3, Vec3)> = (0..4000)
        .map(|_| {
            let (u, v) = (rng.next_vec3(), rng.next_vec3());
            (warp::cosine_hemisphere(u.truncate()), warp::cosine_hemisphere(v.truncate()))
        })
        .collect();
    println!(
        "fabric                          form     bake ms  eval ns  pdf ns  sample ns  variance ratio, cosine/own: head on, 30° and 60° along, 60° across"
    );
    for preset in kind.presets() {
        for (i, form) in ["paper", "points", "physical"].iter().enumerate() {
            let (mut slots, data) =
                kind.preset(preset.name, ColourSpace::LinearSrgb).expect("a preset of the list");
            slots[0] = i as f32;
            let start = Instant::now();
            let table = kind.bake(&slots, &data).expect("its own data");
            let bake = start.elapsed().as_secs_f64() * 1e3;
            let bsdf = Bsdf::new(kind, &slots, &table);
            let eval = nanoseconds(&pairs, |wo, wi| bsdf.eval(wo, wi).x);
            let pdf = nanoseconds(&pairs, |wo, wi| bsdf.pdf(wo, wi));
            let sample = nanoseconds(&pairs, |wo, wi| bsdf.sample(wo, wi.abs()).map_or(0.0, |s| s.pdf));
            let ratios =
                [(0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (60.0, 90.0)].map(|(theta, phi): (f32, f32)| {
                    let (own, cosine) = variances(&bsdf, spherical(theta.to_radians(), phi.to_radians()));
                    format!("{:6.1}", cosine / own)
                });
            println!(
                "{:<31} {form:<8} {bake:7.1} {eval:8.0} {pdf:7.0} {sample:10.0}  {}",
                preset.name,
                ratios.join(" ")
            );
        }
    }
}
