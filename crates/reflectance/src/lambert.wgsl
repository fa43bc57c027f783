// Twin of lambert.rs.

fn lambert_eval(m: Lambert, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return m.reflectance * FRAC_1_PI;
}

fn lambert_pdf(m: Lambert, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0) {
        return 0.0;
    }
    return cosine_hemisphere_pdf(wi);
}

fn lambert_sample(m: Lambert, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let wi = cosine_hemisphere(u.xy);
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return bsdf_no_sample();
    }
    return BsdfSample(wi, cosine_hemisphere_pdf(wi), m.reflectance, 1.0, 0u);
}

fn lambert_albedo(m: Lambert, t: u32) -> vec3<f32> {
    return m.reflectance;
}
