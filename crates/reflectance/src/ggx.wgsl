// Twin of ggx.rs, with the table of energy.rs.

const GGX_PHIS: u32 = 13u;
const GGX_COSINES: u32 = 64u;
const GGX_MEAN: u32 = 832u;

fn ggx_lost(t: u32, w: vec3<f32>) -> f32 {
    var xp = 0.0;
    if (abs(w.x) > 0.0) {
        xp = abs(w.x) / (abs(w.x) + abs(w.y)) * f32(GGX_PHIS - 1u);
    }
    let p = min(u32(xp), GGX_PHIS - 2u);
    let xk = sqrt(clamp(w.z, 0.0, 1.0)) * f32(GGX_COSINES - 1u);
    let k = min(u32(xk), GGX_COSINES - 2u);
    let i = t + p * GGX_COSINES + k;
    let a = mix(table_at(i), table_at(i + 1u), xk - f32(k));
    let b = mix(table_at(i + GGX_COSINES), table_at(i + GGX_COSINES + 1u), xk - f32(k));
    return mix(a, b, xp - f32(p));
}

fn ggx_facets(m: Ggx) -> Microfacets {
    return microfacets(m.distribution, m.masking, m.alpha_x, m.alpha_y);
}

fn ggx_multiple_colour(m: Ggx, t: u32) -> vec3<f32> {
    let f = m.f0 + (1.0 - m.f0) / 21.0;
    let mean = table_at(t + GGX_MEAN);
    return f * f * (1.0 - mean) / (1.0 - f * mean);
}

fn ggx_p_multiple(m: Ggx, wo: vec3<f32>, lost: f32, colour: vec3<f32>) -> f32 {
    let single = dot(f_schlick(m.f0, vec3<f32>(1.0), wo.z), vec3<f32>(1.0)) * (1.0 - lost);
    let multiple = dot(colour, vec3<f32>(1.0)) * lost;
    return multiple / (single + multiple);
}

fn ggx_eval(m: Ggx, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let r = microfacet_reflect(ggx_facets(m), wo, wi);
    let single = r.f * f_schlick(m.f0, vec3<f32>(1.0), r.cos_oh);
    if (m.multiple_scattering == 0u) {
        return single;
    }
    let lost = ggx_lost(t, wo) * ggx_lost(t, wi);
    return single + lost * (0.999 * FRAC_1_PI) / max(table_at(t + GGX_MEAN), 1e-7) * ggx_multiple_colour(m, t);
}

fn ggx_pdf(m: Ggx, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let pdf = microfacet_reflect(ggx_facets(m), wo, wi).pdf;
    if (m.multiple_scattering == 0u) {
        return pdf;
    }
    let p = ggx_p_multiple(m, wo, ggx_lost(t, wo), ggx_multiple_colour(m, t));
    return (1.0 - p) * pdf + p * cosine_hemisphere_pdf(wi);
}

fn ggx_sample(m: Ggx, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    var p = 0.0;
    if (m.multiple_scattering == 1u) {
        p = ggx_p_multiple(m, wo, ggx_lost(t, wo), ggx_multiple_colour(m, t));
    }
    var wi = vec3<f32>(0.0);
    if (u.z < p) {
        wi = cosine_hemisphere(u.xy);
    } else {
        wi = microfacet_sample_reflection(ggx_facets(m), wo, u.xy);
    }
    return bsdf_sample_of(wo, wi, ggx_eval(m, t, wo, wi), ggx_pdf(m, t, wo, wi));
}

fn ggx_slope_lobe(m: Ggx, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    return slope_lobe_of(ggx_facets(m), vec3<f32>(0.0));
}

fn ggx_albedo(m: Ggx, t: u32) -> vec3<f32> {
    return m.f0;
}
