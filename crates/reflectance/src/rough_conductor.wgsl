// Twin of rough_conductor.rs.

fn rough_conductor_facets(m: RoughConductor) -> Microfacets {
    return microfacets(m.distribution, m.masking, m.alpha_x, m.alpha_y);
}

fn rough_conductor_eval(m: RoughConductor, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let r = microfacet_reflect(rough_conductor_facets(m), wo, wi);
    return r.f * f_conductor(r.cos_oh, m.eta, m.k) * m.specular_reflectance;
}

fn rough_conductor_pdf(m: RoughConductor, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return microfacet_reflect(rough_conductor_facets(m), wo, wi).pdf;
}

fn rough_conductor_sample(m: RoughConductor, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let facets = rough_conductor_facets(m);
    let wi = microfacet_sample_reflection(facets, wo, u.xy);
    let r = microfacet_reflect(facets, wo, wi);
    if (r.pdf <= 0.0) {
        return bsdf_no_sample();
    }
    let weight = r.f * wi.z / r.pdf * f_conductor(r.cos_oh, m.eta, m.k) * m.specular_reflectance;
    return BsdfSample(wi, r.pdf, weight, 1.0, 0u);
}

fn rough_conductor_slope_lobe(m: RoughConductor, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    return slope_lobe_of(rough_conductor_facets(m), vec3<f32>(0.0));
}

fn rough_conductor_albedo(m: RoughConductor, t: u32) -> vec3<f32> {
    return f_conductor(1.0, m.eta, m.k) * m.specular_reflectance;
}
