// Twin of merl.rs: 90 x 90 x 180 x RGB, then the sampling table.

const MERL_VALUES: u32 = 4374000u;

fn merl_sampler() -> HalfVectorTable {
    return HalfVectorTable(MERL_VALUES, 32u, 1u, 90u, 36u);
}

// Index and fraction between bin centres of n equal bins.
fn merl_cell(x: f32, n: u32) -> vec2<f32> {
    let c = clamp(x * f32(n) - 0.5, 0.0, f32(n - 1u));
    let i = min(floor(c), f32(n - 2u));
    return vec2<f32>(i, c - i);
}

fn merl_rgb(t: u32, h: u32, d: u32, p: u32, q: u32, z: f32) -> vec3<f32> {
    let i = t + 3u * ((h * 90u + d) * 180u + p);
    let j = t + 3u * ((h * 90u + d) * 180u + q);
    let low = vec3<f32>(table_at(i), table_at(i + 1u), table_at(i + 2u));
    let high = vec3<f32>(table_at(j), table_at(j + 1u), table_at(j + 2u));
    return mix(low, high, z);
}

fn merl_look_up(t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let angles = rusinkiewicz(wo, wi);
    let x = merl_cell(sqrt(angles.x / HALF_PI), 90u);
    let y = merl_cell(angles.y / HALF_PI, 90u);
    let turn = angles.z / PI;
    let z = (turn - floor(turn)) * 180.0 - 0.5;
    let low = floor(z);
    let p = u32(i32(low) + 180) % 180u;
    let q = (p + 1u) % 180u;
    let h = u32(x.x);
    let d = u32(y.x);
    return mix(
        mix(merl_rgb(t, h, d, p, q, z - low), merl_rgb(t, h, d + 1u, p, q, z - low), y.y),
        mix(merl_rgb(t, h + 1u, d, p, q, z - low), merl_rgb(t, h + 1u, d + 1u, p, q, z - low), y.y),
        x.y,
    );
}

fn merl_eval(m: Merl, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return m.scale * merl_look_up(t, wo, wi);
}

fn merl_pdf(m: Merl, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return half_vector_pdf(merl_sampler(), t, wo, wi);
}

fn merl_sample(m: Merl, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let wi = half_vector_sample(merl_sampler(), t, wo, u);
    if (wi.z <= 0.0) {
        return bsdf_no_sample();
    }
    return bsdf_sample_of(wo, wi, merl_eval(m, t, wo, wi), half_vector_pdf(merl_sampler(), t, wo, wi));
}
