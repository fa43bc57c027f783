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

// Burley, principled.rs: what the thick and the thin material share. `eta` is apart from one.
struct DisneyBase {
    base_color: vec3<f32>,
    roughness: f32,
    metallic: f32,
    spec_trans: f32,
    eta: f32,
    spec_tint: f32,
    sheen: f32,
    sheen_tint: f32,
    flatness: f32,
}

fn stretched_facets(roughness: f32, anisotropic: f32) -> Microfacets {
    let alpha = roughness * roughness;
    let aspect = sqrt(1.0 - 0.9 * anisotropic);
    // GGX, separable.
    return microfacets(1u, 0u, max(alpha / aspect, 1e-3), max(alpha * aspect, 1e-3));
}

fn hue(c: vec3<f32>) -> vec3<f32> {
    let luminance = dot(c, vec3<f32>(0.212671, 0.715160, 0.072169));
    if (luminance > 0.0) {
        return c / luminance;
    }
    return vec3<f32>(1.0);
}

fn disney_fresnel(m: DisneyBase, c: f32, dielectric: f32) -> vec3<f32> {
    let w = schlick_weight(c);
    let r = (m.eta - 1.0) / (m.eta + 1.0);
    let tinted = r * r * hue(m.base_color);
    let plain = (1.0 - m.metallic) * (1.0 - m.spec_tint) * dielectric;
    return m.metallic * (m.base_color + (1.0 - m.base_color) * w)
        + (1.0 - m.metallic) * m.spec_tint * (tinted + (1.0 - tinted) * w)
        + plain;
}

fn disney_half(f: f32, rr: f32) -> f32 {
    return 1.0 + (0.5 * rr - 1.0) * f;
}

fn disney_diffuse(m: DisneyBase, wo: vec3<f32>, wi: vec3<f32>, c: f32) -> vec3<f32> {
    let fo = schlick_weight(wo.z);
    let fi = schlick_weight(wi.z);
    let rr = 2.0 * m.roughness * c * c;
    let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
    let plain = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi) + retro;
    let flat_lobe = 1.25 * (disney_half(fo, rr) * disney_half(fi, rr) * (1.0 / (wo.z + wi.z) - 0.5) + 0.5);
    let amount = (1.0 - m.metallic) * (1.0 - m.spec_trans) * FRAC_1_PI;
    let base = m.base_color * (amount * (plain + (flat_lobe - plain) * m.flatness));
    let tint = mix(vec3<f32>(1.0), hue(m.base_color), m.sheen_tint);
    return base + tint * (m.sheen * (1.0 - m.metallic) * schlick_weight(c));
}
