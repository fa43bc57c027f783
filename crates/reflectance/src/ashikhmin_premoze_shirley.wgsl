// Twin of ashikhmin_premoze_shirley.rs. Its f is in ashikhmin_g.wgsl, shared with the Noh costume.

fn ashikhmin_premoze_shirley_eval(m: AshikhminPremozeShirley, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let correlation = select(0.0, m.correlation, m.form == 1u);
    return f_schlick(m.f0, vec3<f32>(1.0), half_vector(wo, wi).w)
        * f_ashikhmin2000(t, wo, wi, m.sigma_x, m.sigma_y, correlation);
}

fn ashikhmin_premoze_shirley_pdf(m: AshikhminPremozeShirley, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    return pdf_gaussian_reflection(wo, wi, m.sigma_x, m.sigma_y);
}

fn ashikhmin_premoze_shirley_sample(m: AshikhminPremozeShirley, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let wi = sample_gaussian_reflection(wo, u, m.sigma_x, m.sigma_y);
    return bsdf_sample_of(wo, wi, ashikhmin_premoze_shirley_eval(m, t, wo, wi), ashikhmin_premoze_shirley_pdf(m, t, wo, wi));
}

fn ashikhmin_premoze_shirley_slope_lobe(
    m: AshikhminPremozeShirley,
    t: u32,
    wo: vec3<f32>,
    wi: vec3<f32>,
) -> SlopeLobe {
    return gaussian_lobe(m.sigma_x, m.sigma_y, vec3<f32>(0.0));
}

fn ashikhmin_premoze_shirley_albedo(m: AshikhminPremozeShirley, t: u32) -> vec3<f32> {
    return m.f0;
}
