//! How far maps are from the truth.

use glam::Vec3;
use yugen_reflectance::btf::Texel;

/// What [`errors`] are of, in its order.
pub const NAMES: [&str; 6] = ["rho_d", "rho_s", "n", "t", "sigma_x", "sigma_y"];

/// The heading over [`row`]s.
pub const HEADING: &str = "     rho_d      rho_s         n         t    sigma_x    sigma_y";

/// [`errors`] or quantiles of them to read.
pub fn row(e: &[f32; 6]) -> String {
    let percent = |v: f32| format!("{:8.2} %", 100.0 * v);
    let degrees = |v: f32| format!("{v:8.3}°");
    [percent(e[0]), percent(e[1]), degrees(e[2]), degrees(e[3]), percent(e[4]), percent(e[5])].join(" ")
}

/// Errors of a texel: of the albedos (sums of channels) and widths relative, of the directions in degrees. The tangent of
/// the truth is taken along its longer width, as a fit gives it; an albedo below a tenth of both together counts as that,
/// for a metal has no ground to be relative to.
pub fn errors(got: &Texel, want: &Texel) -> [f32; 6] {
    let least = 0.1 * (want.diffuse + want.specular).element_sum().max(0.01);
    let relative = |a: f32, b: f32| (a - b).abs() / b.max(least);
    let width = |a: f32, b: f32| (a / b - 1.0).abs();
    let along = if want.sigma.x >= want.sigma.y { want.tangent } else { want.normal.cross(want.tangent) };
    // The cosine is blind below a fortieth of a degree in f32; the sine is not.
    let angle = |a: Vec3, b: Vec3| a.cross(b).length().min(1.0).asin().to_degrees();
    let normal = angle(got.normal, want.normal);
    [
        relative(got.diffuse.element_sum(), want.diffuse.element_sum()),
        relative(got.specular.element_sum(), want.specular.element_sum()),
        if got.normal.dot(want.normal) < 0.0 { 180.0 - normal } else { normal },
        angle(got.tangent, along),
        width(got.sigma.max_element(), want.sigma.max_element()),
        width(got.sigma.min_element(), want.sigma.min_element()),
    ]
}

/// Whether errors are those of a texel that was not found: the normal off by 3°, the tangent by 10° or a width by a
/// quarter.
pub fn failed(e: &[f32; 6]) -> bool {
    e[2] > 3.0 || e[3] > 10.0 || e[4] > 0.25 || e[5] > 0.25
}

/// The value below which a part `q` of `all` lies, `None` without any. Sorts them.
pub fn quantile(all: &mut [f32], q: f32) -> Option<f32> {
    all.sort_unstable_by(f32::total_cmp);
    all.get((all.len().max(1) - 1).min(((all.len().max(1) - 1) as f32 * q).round() as usize)).copied()
}
