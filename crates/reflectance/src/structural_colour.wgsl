// Twin of structural_colour.rs: the table is one row of 64 cosines, or 64 rows over the thickness.

fn structural_colour_facets(m: StructuralColour) -> Microfacets {
    return microfacets(1u, 1u, m.alpha_x, m.alpha_y);
}

fn structural_colour_row(t: u32, r: u32, i: u32, x: f32) -> vec3<f32> {
    let at = t + 3u * (r * 64u + i);
    let low = vec3<f32>(table_at(at), table_at(at + 1u), table_at(at + 2u));
    let high = vec3<f32>(table_at(at + 3u), table_at(at + 4u), table_at(at + 5u));
    return mix(low, high, x);
}

fn structural_colour_fresnel(m: StructuralColour, t: u32, cosine: f32) -> vec3<f32> {
    let x = clamp(cosine, 0.0, 1.0) * 63.0;
    let i = min(u32(x), 62u);
    if (m.thickness_range <= 0.0) {
        return structural_colour_row(t, 0u, i, x - f32(i));
    }
    let y = clamp((m.thickness - 1.0 + m.thickness_range) / (2.0 * m.thickness_range) * 63.0, 0.0, 63.0);
    let j = min(u32(y), 62u);
    return mix(
        structural_colour_row(t, j, i, x - f32(i)),
        structural_colour_row(t, j + 1u, i, x - f32(i)),
        y - f32(j),
    );
}

fn structural_colour_eval(m: StructuralColour, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let r = microfacet_reflect(structural_colour_facets(m), wo, wi);
    return r.f * structural_colour_fresnel(m, t, 0.5 * length(wo + wi));
}

fn structural_colour_pdf(m: StructuralColour, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return microfacet_reflect(structural_colour_facets(m), wo, wi).pdf;
}

fn structural_colour_sample(m: StructuralColour, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let facets = structural_colour_facets(m);
    let wi = microfacet_sample_reflection(facets, wo, u.xy);
    let r = microfacet_reflect(facets, wo, wi);
    if (r.pdf <= 0.0) {
        return bsdf_no_sample();
    }
    let weight = r.f * wi.z / r.pdf * structural_colour_fresnel(m, t, 0.5 * length(wo + wi));
    return BsdfSample(wi, r.pdf, weight, 1.0, 0u);
}

fn structural_colour_albedo(m: StructuralColour, t: u32) -> vec3<f32> {
    return structural_colour_fresnel(m, t, 1.0);
}
