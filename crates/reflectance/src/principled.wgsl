// Twin of principled.rs.

fn d_gtr1(h: vec3<f32>, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
    return (a2 - 1.0) / (PI * log(a2) * t);
}

fn sample_gtr1(alpha: f32, u: vec2<f32>) -> vec3<f32> {
    let a2 = alpha * alpha;
    let r2 = clamp((pow(a2, 1.0 - u.y) - a2) / (1.0 - a2), 0.0, 1.0);
    let r = sqrt(r2);
    return vec3<f32>(r * cos(TAU * u.x), r * sin(TAU * u.x), sqrt(1.0 - r2));
}

fn g1_coat(c: f32) -> f32 {
    return 2.0 / (1.0 + sqrt(1.0 + 0.0625 * (1.0 - c * c) / (c * c)));
}

fn principled_facets(m: Principled) -> Microfacets {
    return stretched_facets(m.roughness, m.anisotropic);
}

fn principled_eta(m: Principled, above: bool) -> f32 {
    let eta = apart_from_one(m.eta);
    return select(1.0 / eta, eta, above);
}

fn principled_coat_alpha(m: Principled) -> f32 {
    return 0.1 + (0.001 - 0.1) * m.clearcoat_gloss;
}

fn principled_clear(m: Principled) -> f32 {
    return (1.0 - m.metallic) * m.spec_trans;
}

// The probabilities of the lobes: specular, coat, diffuse.
fn principled_lobes(m: Principled, above: bool) -> vec3<f32> {
    if (!above) {
        return vec3<f32>(1.0, 0.0, 0.0);
    }
    let lobes = vec3<f32>(1.0, 0.25 * m.clearcoat, (1.0 - m.metallic) * (1.0 - m.spec_trans));
    return lobes / (lobes.x + lobes.y + lobes.z);
}

fn principled_p_reflect(m: Principled, above: bool, f: f32) -> f32 {
    return select(f, 1.0 - principled_clear(m) * (1.0 - f), above);
}

fn principled_base(m: Principled) -> DisneyBase {
    return DisneyBase(
        m.base_color, m.roughness, m.metallic, m.spec_trans, apart_from_one(m.eta), m.spec_tint, m.sheen, m.sheen_tint,
        m.flatness,
    );
}

fn principled_eval_pdf(m: Principled, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    let above = wo.z > 0.0;
    let clear = principled_clear(m);
    if (wo.z == 0.0 || wi.z == 0.0 || clear == 0.0 && !(above && wi.z > 0.0)) {
        return vec4<f32>(0.0);
    }
    let eta = principled_eta(m, above);
    let lobes = principled_lobes(m, above);
    let facets = principled_facets(m);
    let o = to_upper(wo, wo.z);
    let i = to_upper(wi, wo.z);
    if (i.z > 0.0) {
        let r = microfacet_reflect(facets, o, i);
        let dielectric = f_dielectric(r.cos_oh, eta);
        let specular_pdf = lobes.x * principled_p_reflect(m, above, dielectric) * r.pdf;
        if (!above) {
            return vec4<f32>(vec3<f32>(r.f * clear * dielectric), specular_pdf);
        }
        let base = principled_base(m);
        let f = r.f * disney_fresnel(base, r.cos_oh, dielectric) + disney_diffuse(base, wo, wi, r.cos_oh);
        let pdf = specular_pdf + lobes.z * cosine_hemisphere_pdf(wi);
        if (m.clearcoat == 0.0) {
            return vec4<f32>(f, pdf);
        }
        let h = normalize(wo + wi);
        let d = d_gtr1(h, principled_coat_alpha(m));
        let coat = 0.25 * m.clearcoat * (0.04 + 0.96 * schlick_weight(r.cos_oh)) * d * g1_coat(wo.z) * g1_coat(wi.z);
        return vec4<f32>(f + coat, pdf + lobes.y * d * h.z / max(4.0 * r.cos_oh, 1e-9));
    }
    let r = microfacet_refract(facets, o, i, eta);
    let dielectric = f_dielectric(r.cos_oh, eta);
    return vec4<f32>(
        sqrt(m.base_color) * (clear * (1.0 - dielectric) * r.f),
        lobes.x * (1.0 - principled_p_reflect(m, above, dielectric)) * r.pdf,
    );
}

fn principled_sample(m: Principled, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let above = wo.z > 0.0;
    if (wo.z == 0.0 || !above && principled_clear(m) == 0.0) {
        return bsdf_no_sample();
    }
    let lobes = principled_lobes(m, above);
    let eta = principled_eta(m, above);
    let o = to_upper(wo, wo.z);
    var crossed = 1.0;
    var i = cosine_hemisphere(u.xy);
    if (u.z < lobes.x) {
        let h = microfacet_sample_visible_normal(principled_facets(m), o, u.xy);
        if (u.z < lobes.x * principled_p_reflect(m, above, f_dielectric(dot(o, h), eta))) {
            i = reflect_about(o, h);
        } else {
            crossed = eta;
            i = refract_at(o, h, eta);
        }
    } else if (u.z < lobes.x + lobes.y) {
        i = reflect_about(o, sample_gtr1(principled_coat_alpha(m), u.xy));
    }
    if (i.z == 0.0 || (i.z > 0.0) != (crossed == 1.0)) {
        return bsdf_no_sample();
    }
    let wi = to_upper(i, wo.z);
    let f = principled_eval_pdf(m, t, wo, wi);
    return bsdf_sample_across(wi, f.xyz, f.w, crossed);
}

fn principled_albedo(m: Principled, t: u32) -> vec3<f32> {
    return m.base_color;
}
