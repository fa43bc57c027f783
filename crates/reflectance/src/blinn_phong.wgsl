// Twin of blinn_phong.rs.

fn blinn_phong_eval(m: BlinnPhong, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let lobe = pow(min(half_vector(wo, wi).z, 1.0), m.exponent);
    if (m.form == 0u) {
        return m.specular * (half_lobe_normaliser(m.exponent) * lobe);
    }
    return m.specular * (lobe / max(wi.z, 1e-6));
}

fn blinn_phong_pdf(m: BlinnPhong, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let h = half_vector(wo, wi);
    return pdf_reflected(pdf_cosine_power(min(h.z, 1.0), m.exponent), h.w);
}

fn blinn_phong_sample(m: BlinnPhong, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let h = sample_cosine_power(u.xy, m.exponent);
    if (dot(h, wo) <= 0.0) {
        return bsdf_no_sample();
    }
    let wi = reflect_about(wo, h);
    return bsdf_sample_of(wo, wi, blinn_phong_eval(m, t, wo, wi), blinn_phong_pdf(m, t, wo, wi));
}

fn blinn_phong_albedo(m: BlinnPhong, t: u32) -> vec3<f32> {
    return m.specular;
}
