// Twin of rough_plastic.rs. Self-contained, because a shader may be made of this model alone.

const ROUGH_PLASTIC_COSINES: u32 = 64u;

fn rough_plastic_facets(m: RoughPlastic) -> Microfacets {
    return microfacets(m.distribution, 0u, m.alpha, m.alpha);
}

fn rough_plastic_transmittance(t: u32, cos_theta: f32) -> f32 {
    let x = cos_theta * f32(ROUGH_PLASTIC_COSINES - 1u);
    let i = min(u32(x), ROUGH_PLASTIC_COSINES - 2u);
    let a = table_at(t + i);
    return a + (table_at(t + i + 1u) - a) * (x - f32(i));
}

// The probability of the coat for a transmittance `to`.
fn rough_plastic_coat(m: RoughPlastic, to: f32) -> f32 {
    let s = (m.specular_reflectance.x + m.specular_reflectance.y + m.specular_reflectance.z) * (1.0 - to);
    let d = (m.diffuse_reflectance.x + m.diffuse_reflectance.y + m.diffuse_reflectance.z) * to;
    if (s + d > 0.0) {
        return s / (s + d);
    }
    return 1.0;
}

fn rough_plastic_eval(m: RoughPlastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let r = microfacet_reflect(rough_plastic_facets(m), wo, wi);
    let f = f_dielectric(r.cos_oh, m.int_ior / m.ext_ior);
    return m.specular_reflectance * (r.f * f) + rough_plastic_base(m, t, wo, wi);
}

fn rough_plastic_base(m: RoughPlastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let eta = m.int_ior / m.ext_ior;
    let through = rough_plastic_transmittance(t, wo.z) * rough_plastic_transmittance(t, wi.z);
    // Duntley 1942.
    let lost = table_at(t + ROUGH_PLASTIC_COSINES);
    var inter = vec3<f32>(1.0 - lost);
    if (m.nonlinear == 1u) {
        inter = 1.0 - m.diffuse_reflectance * lost;
    }
    return m.diffuse_reflectance / inter * (FRAC_1_PI / (eta * eta) * through);
}

fn rough_plastic_pdf(m: RoughPlastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let coat = rough_plastic_coat(m, rough_plastic_transmittance(t, wo.z));
    let r = microfacet_reflect(rough_plastic_facets(m), wo, wi);
    return coat * r.pdf + (1.0 - coat) * cosine_hemisphere_pdf(wi);
}

fn rough_plastic_sample(m: RoughPlastic, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    var wi = vec3<f32>(0.0);
    if (u.z < rough_plastic_coat(m, rough_plastic_transmittance(t, wo.z))) {
        wi = microfacet_sample_reflection(rough_plastic_facets(m), wo, u.xy);
    } else {
        wi = cosine_hemisphere(u.xy);
    }
    return bsdf_sample_of(wo, wi, rough_plastic_eval(m, t, wo, wi), rough_plastic_pdf(m, t, wo, wi));
}

fn rough_plastic_slope_lobe(m: RoughPlastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    return slope_lobe_of(rough_plastic_facets(m), rough_plastic_base(m, t, wo, wi));
}

fn rough_plastic_albedo(m: RoughPlastic, t: u32) -> vec3<f32> {
    return m.diffuse_reflectance;
}
