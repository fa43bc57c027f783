// Lobes that more than one model is made of; each belongs to the model named.

// Oren and Nayar, oren_nayar.rs.
const ON_GRAZING_SHARE: f32 = 0.5 - 2.0 / (3.0 * PI);
const ON_MEAN_SHARE: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

fn on_factors(sigma: f32) -> vec2<f32> {
    let s2 = sigma * sigma;
    return vec2<f32>(1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09));
}

fn on_fujii_albedo(c: f32, r: f32) -> f32 {
    let a = 1.0 / (1.0 + ON_GRAZING_SHARE * r);
    let s = sqrt(max(1.0 - c * c, 0.0));
    let tail = s * c * (1.0 + s + s * s) / (1.0 + s) - s;
    let g = s * (atan2(s, c) - s * c) + 2.0 / 3.0 * tail;
    return a * (1.0 + r * FRAC_1_PI * g);
}

fn f_energy_preserving(reflectance: vec3<f32>, sigma: f32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let ab = on_factors(sigma);
    let r = ab.y / ab.x;
    let scale = 1.0 / (1.0 + ON_GRAZING_SHARE * r);
    let s = wo.x * wi.x + wo.y * wi.y;
    var s_over_t = s;
    if (s > 0.0) {
        s_over_t = s / max(wo.z, wi.z);
    }
    let single = reflectance * (FRAC_1_PI * scale * (1.0 + r * s_over_t));
    let mean = scale * (1.0 + ON_MEAN_SHARE * r);
    let lost = max(1.0 - on_fujii_albedo(wo.z, r), 0.0) * max(1.0 - on_fujii_albedo(wi.z, r), 0.0);
    let shape = lost / max(1.0 - mean, 1e-6);
    let colour = reflectance * reflectance * mean / (vec3<f32>(1.0) - reflectance * (1.0 - mean));
    return single + colour * (FRAC_1_PI * shape);
}

// Ward, ward.rs.
fn f_ward1992(wo: vec3<f32>, wi: vec3<f32>, ax: f32, ay: f32) -> f32 {
    return exp(-squared_slope(wo + wi, ax, ay)) / (4.0 * PI * ax * ay * sqrt(max(wo.z * wi.z, 1e-18)));
}

fn f_duer(wo: vec3<f32>, wi: vec3<f32>, ax: f32, ay: f32) -> f32 {
    return exp(-squared_slope(wo + wi, ax, ay)) / (4.0 * PI * ax * ay * max(wo.z * wi.z, 1e-18));
}

fn f_gmd(wo: vec3<f32>, wi: vec3<f32>, ax: f32, ay: f32) -> f32 {
    let h = wo + wi;
    let z2 = max(h.z * h.z, 1e-18);
    return FRAC_1_PI / (ax * ay) * exp(-squared_slope(h, ax, ay)) * (dot(h, h) / z2) / z2;
}

// Blinn-Phong, blinn_phong.rs.
fn half_lobe_normaliser(n: f32) -> f32 {
    return (n + 2.0) * (n + 4.0) / (8.0 * PI * (exp2(-0.5 * n) + n));
}
