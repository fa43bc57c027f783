// Twin of oren_nayar.rs. Its energy-preserving form is in lobes.wgsl.

fn on_full(m: OrenNayar, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let sin_o = length(wo.xy);
    let sin_i = length(wi.xy);
    let theta_o = atan2(sin_o, wo.z);
    let theta_i = atan2(sin_i, wi.z);
    let alpha = max(theta_o, theta_i);
    let beta = min(theta_o, theta_i);
    let both = sin_o * sin_i;
    var cos_phi = 0.0;
    if (both > 1e-12) {
        cos_phi = clamp((wo.x * wi.x + wo.y * wi.y) / both, -1.0, 1.0);
    }
    let s2 = m.sigma * m.sigma;
    let rough = s2 / (s2 + 0.09);
    let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
    let b = 2.0 * beta * FRAC_1_PI;
    var c2 = sin(alpha);
    if (cos_phi < 0.0) {
        c2 -= b * b * b;
    }
    c2 *= 0.45 * rough;
    var c3 = 4.0 * alpha * beta * FRAC_1_PI * FRAC_1_PI;
    c3 = 0.125 * rough * c3 * c3;
    let direct = c1 + c2 * cos_phi * tan(beta) + c3 * (1.0 - abs(cos_phi)) * tan(0.5 * (alpha + beta));
    let bounce = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * b * b);
    return m.reflectance * FRAC_1_PI * (max(direct, 0.0) + m.reflectance * bounce);
}

fn on_qualitative(m: OrenNayar, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let ab = on_factors(m.sigma);
    let s = max(wo.x * wi.x + wo.y * wi.y, 0.0);
    return m.reflectance * (FRAC_1_PI * (ab.x + ab.y * s / max(wo.z, wi.z)));
}

fn oren_nayar_eval(m: OrenNayar, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    switch m.form {
        case 0u: { return f_energy_preserving(m.reflectance, m.sigma, wo, wi); }
        case 1u: { return on_full(m, wo, wi); }
        default: { return on_qualitative(m, wo, wi); }
    }
}

fn oren_nayar_pdf(m: OrenNayar, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0) {
        return 0.0;
    }
    return cosine_hemisphere_pdf(wi);
}

fn oren_nayar_sample(m: OrenNayar, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let wi = cosine_hemisphere(u.xy);
    return bsdf_sample_of(wo, wi, oren_nayar_eval(m, t, wo, wi), oren_nayar_pdf(m, t, wo, wi));
}

fn oren_nayar_albedo(m: OrenNayar, t: u32) -> vec3<f32> {
    return m.reflectance;
}
