// Twin of ward.rs. The lobes themselves are in lobes.wgsl.

fn ward_eval(m: Ward, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    var lobe = 0.0;
    switch m.form {
        case 0u: { lobe = f_gmd(wo, wi, m.alpha_x, m.alpha_y); }
        case 1u: { lobe = f_duer(wo, wi, m.alpha_x, m.alpha_y); }
        default: { lobe = f_ward1992(wo, wi, m.alpha_x, m.alpha_y); }
    }
    return m.diffuse * FRAC_1_PI + m.specular * lobe;
}

fn ward_pdf(m: Ward, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let share = lobe_share(m.specular, m.diffuse);
    return share * pdf_gaussian_reflection(wo, wi, m.alpha_x, m.alpha_y) + (1.0 - share) * cosine_hemisphere_pdf(wi);
}

fn ward_sample(m: Ward, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let share = lobe_share(m.specular, m.diffuse);
    var wi = cosine_hemisphere(u.xy);
    if (u.z < share) {
        wi = sample_gaussian_reflection(wo, vec3<f32>(u.xy, u.z / share), m.alpha_x, m.alpha_y);
    }
    return bsdf_sample_of(wo, wi, ward_eval(m, t, wo, wi), ward_pdf(m, t, wo, wi));
}

fn ward_slope_lobe(m: Ward, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    return gaussian_lobe(m.alpha_x, m.alpha_y, m.diffuse * FRAC_1_PI);
}

fn ward_albedo(m: Ward, t: u32) -> vec3<f32> {
    return min(m.diffuse + m.specular, vec3<f32>(1.0));
}
