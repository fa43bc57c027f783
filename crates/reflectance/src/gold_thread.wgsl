// Twin of gold_thread.rs.

struct GoldThreadAround {
    along: f32,
    across: f32,
    cos_theta: f32,
}

fn gold_thread_around(m: GoldThread, sense: f32, w: vec3<f32>) -> GoldThreadAround {
    let x = cos(m.winding * (PI / 180.0));
    let y = sense * sin(m.winding * (PI / 180.0));
    let across = x * w.y - y * w.x;
    return GoldThreadAround(x * w.x + y * w.y, across, sqrt(w.z * w.z + across * across));
}

fn gold_thread_reflectance(m: GoldThread, c: f32) -> vec3<f32> {
    let bare = f_conductor(c, m.eta, m.k);
    if (m.lacquer <= 0.0) {
        return bare;
    }
    let n = m.lacquer_ior;
    let top = f_dielectric(c, n);
    let cos_within = sqrt(1.0 - max(1.0 - c * c, 0.0) / (n * n));
    let base = f_conductor(cos_within, m.eta / n, m.k / n);
    let coated = top + (1.0 - top) * (1.0 - top) * base / max(1.0 - top * base, vec3<f32>(1e-6));
    return mix(bare, coated, m.lacquer);
}

fn gold_thread_facets(m: GoldThread) -> Microfacets {
    return microfacets(1u, 1u, m.alpha_along, m.alpha_across);
}

// f of one sense of winding for F = 1 and c = 1, and the cosine for F.
fn gold_thread_cylinder(m: GoldThread, sense: f32, wo: vec3<f32>, wi: vec3<f32>) -> vec2<f32> {
    let o = gold_thread_around(m, sense, wo);
    let i = gold_thread_around(m, sense, wi);
    let s = o.along + i.along;
    let e = o.cos_theta + i.cos_theta;
    let d2 = s * s + e * e;
    let phi_d = atan2(wi.z * o.across - wo.z * i.across, wi.z * wo.z + i.across * o.across);
    let cos_half = cos(0.5 * phi_d);
    let sigma = 20.0 * PI / 180.0;
    let u = exp(-0.5 * (phi_d / sigma) * (phi_d / sigma));
    let shade = 1.0 - u + u * min(o.cos_theta / wo.z, i.cos_theta / wi.z);
    let gamma = m.gamma * (PI / 180.0);
    let x = atan2(s, e) / gamma;
    let g = exp(-0.5 * x * x) / (sqrt(TAU) * gamma);
    return vec2<f32>(cos_half * g * 4.0 / d2 * shade, 0.5 * sqrt(d2) * cos_half);
}

// Width and bounds of the sampled lobe.
fn gold_thread_lobe(m: GoldThread, o: GoldThreadAround) -> vec3<f32> {
    let gamma = m.gamma * (PI / 180.0);
    let width = 1.1 * gamma * (1.0 + 0.5 * gamma * gamma);
    let c = o.cos_theta * width;
    let up = max(1.0 + o.along, 0.0);
    let down = max(1.0 - o.along, 0.0);
    return vec3<f32>(width, -down / sqrt(c * c + down * down), up / sqrt(c * c + up * up));
}

fn gold_thread_cylinder_pdf(m: GoldThread, sense: f32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let o = gold_thread_around(m, sense, wo);
    let i = gold_thread_around(m, sense, wi);
    let lobe = gold_thread_lobe(m, o);
    let s = o.along + i.along;
    let e = o.cos_theta + i.cos_theta;
    let r2 = e * e * lobe.x * lobe.x + s * s;
    let p_theta = 0.5 * lobe.x * lobe.x * e * (s * s + e * e) / (r2 * sqrt(r2) * (lobe.z - lobe.y));
    return 0.5 * wi.z / i.cos_theta * p_theta / i.cos_theta;
}

fn gold_thread_direction(m: GoldThread, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let sense = select(-1.0, 1.0, u.z < 0.5);
    let o = gold_thread_around(m, sense, wo);
    let lobe = gold_thread_lobe(m, o);
    let x = lobe.y + u.x * (lobe.z - lobe.y);
    let c2 = max(1.0 - x * x, 0.0);
    let s2 = lobe.x * lobe.x * x * x;
    let cos_2h = (c2 - s2) / (c2 + s2);
    let sin_2h = 2.0 * lobe.x * x * sqrt(c2) / (c2 + s2);
    let along = sin_2h * o.cos_theta - cos_2h * o.along;
    let cos_theta = max(cos_2h * o.cos_theta + sin_2h * o.along, 0.0);
    let sin_phi = 2.0 * u.y - 1.0;
    let across = cos_theta * sin_phi;
    let wx = cos(m.winding * (PI / 180.0));
    let wy = sense * sin(m.winding * (PI / 180.0));
    return normalize(vec3<f32>(
        wx * along - wy * across,
        wy * along + wx * across,
        cos_theta * sqrt(max(1.0 - sin_phi * sin_phi, 0.0)),
    ));
}

fn gold_thread_eval(m: GoldThread, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    if (m.form == 0u) {
        let r = microfacet_reflect(gold_thread_facets(m), wo, wi);
        return r.f * gold_thread_reflectance(m, r.cos_oh);
    }
    let a = gold_thread_cylinder(m, 1.0, wo, wi);
    let b = gold_thread_cylinder(m, -1.0, wo, wi);
    return table_at(t) * 0.5 * (a.x * gold_thread_reflectance(m, a.y) + b.x * gold_thread_reflectance(m, b.y));
}

fn gold_thread_pdf(m: GoldThread, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    if (m.form == 0u) {
        return microfacet_reflect(gold_thread_facets(m), wo, wi).pdf;
    }
    return 0.5 * (gold_thread_cylinder_pdf(m, 1.0, wo, wi) + gold_thread_cylinder_pdf(m, -1.0, wo, wi));
}

fn gold_thread_sample(m: GoldThread, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    var wi = vec3<f32>(0.0);
    if (m.form == 0u) {
        wi = microfacet_sample_reflection(gold_thread_facets(m), wo, u.xy);
    } else {
        wi = gold_thread_direction(m, wo, u);
    }
    let pdf = gold_thread_pdf(m, t, wo, wi);
    if (wi.z <= 0.0 || !(pdf > 0.0)) {
        return bsdf_no_sample();
    }
    return BsdfSample(wi, pdf, gold_thread_eval(m, t, wo, wi) * (wi.z / pdf), 1.0, 0u);
}

fn gold_thread_slope_lobe(m: GoldThread, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    if (m.form == 0u) {
        return slope_lobe_of(gold_thread_facets(m), vec3<f32>(0.0));
    }
    return no_slope_lobe();
}

fn gold_thread_albedo(m: GoldThread, t: u32) -> vec3<f32> {
    return gold_thread_reflectance(m, 1.0);
}
