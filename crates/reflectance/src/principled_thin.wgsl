// Twin of principled_thin.rs.

fn principled_thin_facets(m: PrincipledThin) -> Microfacets {
    return stretched_facets(m.roughness, m.anisotropic);
}

fn principled_thin_facets_through(m: PrincipledThin) -> Microfacets {
    return stretched_facets((0.65 * m.eta - 0.35) * m.roughness, m.anisotropic);
}

// The lobes that it shares with the thick material.
fn principled_thin_base(m: PrincipledThin) -> DisneyBase {
    let sheen = m.sheen * (1.0 - m.spec_trans);
    return DisneyBase(
        m.base_color, m.roughness, 0.0, m.spec_trans, apart_from_one(m.eta), m.spec_tint, sheen, m.sheen_tint,
        m.flatness,
    );
}

// The probabilities of the lobes: reflects, passes, diffuse; what passes diffusely has the rest.
fn principled_thin_lobes(m: PrincipledThin) -> vec3<f32> {
    let clear = 0.5 * m.spec_trans;
    return vec3<f32>(clear, clear, (1.0 - m.spec_trans) * (1.0 - 0.5 * m.diff_trans));
}

fn principled_thin_behind(o: vec3<f32>, i: vec3<f32>) -> bool {
    return dot(o + i, vec3<f32>(i.xy, -i.z)) < 0.0;
}

fn principled_thin_eval_pdf(m: PrincipledThin, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (wo.z == 0.0 || wi.z == 0.0) {
        return vec4<f32>(0.0);
    }
    let lobes = principled_thin_lobes(m);
    let o = to_upper(wo, wo.z);
    let i = to_upper(wi, wi.z);
    let passed = 0.5 * m.diff_trans;
    if (wo.z * wi.z > 0.0) {
        let r = microfacet_reflect(principled_thin_facets(m), o, i);
        let base = principled_thin_base(m);
        let clear = m.spec_trans * r.f * disney_fresnel(base, r.cos_oh, f_dielectric(r.cos_oh, m.eta));
        let f = clear + (1.0 - passed) * disney_diffuse(base, o, i, r.cos_oh);
        return vec4<f32>(f, lobes.x * r.pdf + lobes.z * cosine_hemisphere_pdf(i));
    }
    var r = FacetLobe(0.0, 0.0, 0.0);
    if (principled_thin_behind(o, i)) {
        r = microfacet_reflect(principled_thin_facets_through(m), o, i);
    }
    let clear = m.spec_trans * (1.0 - f_dielectric(r.cos_oh, m.eta)) * r.f;
    let rest = (1.0 - m.spec_trans) * passed;
    return vec4<f32>(
        (clear + rest * FRAC_1_PI) * m.base_color,
        lobes.y * r.pdf + rest * cosine_hemisphere_pdf(i),
    );
}

fn principled_thin_sample(m: PrincipledThin, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z == 0.0) {
        return bsdf_no_sample();
    }
    let lobes = principled_thin_lobes(m);
    let o = to_upper(wo, wo.z);
    var i = cosine_hemisphere(u.xy);
    var above = u.z < lobes.x + lobes.y + lobes.z;
    if (u.z < lobes.x) {
        i = microfacet_sample_reflection(principled_thin_facets(m), o, u.xy);
    } else if (u.z < lobes.x + lobes.y) {
        i = microfacet_sample_reflection(principled_thin_facets_through(m), o, u.xy);
        above = false;
        if (!principled_thin_behind(o, i)) {
            return bsdf_no_sample();
        }
    }
    if (i.z <= 0.0) {
        return bsdf_no_sample();
    }
    let wi = vec3<f32>(i.xy, select(-i.z, i.z, above == (wo.z > 0.0)));
    let f = principled_thin_eval_pdf(m, t, wo, wi);
    return bsdf_sample_across(wi, f.xyz, f.w, 1.0);
}

fn principled_thin_albedo(m: PrincipledThin, t: u32) -> vec3<f32> {
    return m.base_color;
}
