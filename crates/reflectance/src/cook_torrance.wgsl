// Twin of cook_torrance.rs.

fn ct_channel(c: f32, f0: f32) -> f32 {
    let root = min(sqrt(max(f0, 0.0)), 1.0 - 1e-6);
    return f_dielectric(c, (1.0 + root) / (1.0 - root));
}

fn ct_share(m: CookTorrance) -> f32 {
    return lobe_share(m.s * max(m.f0, vec3<f32>(0.1)), (1.0 - m.s) * m.diffuse);
}

fn cook_torrance_eval(m: CookTorrance, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let h = half_vector(wo, wi);
    var scale = 4.0;
    if (m.form == 0u) {
        scale = 1.0;
    }
    let highlight = scale * d_beckmann(h.xyz, m.m, m.m) * v_grooves(wo, wi, h);
    let c = h.w;
    let f = vec3<f32>(ct_channel(c, m.f0.x), ct_channel(c, m.f0.y), ct_channel(c, m.f0.z));
    return f * (m.s * highlight) + m.diffuse * ((1.0 - m.s) * FRAC_1_PI);
}

fn cook_torrance_pdf(m: CookTorrance, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let share = ct_share(m);
    return share * pdf_gaussian_reflection(wo, wi, m.m, m.m) + (1.0 - share) * cosine_hemisphere_pdf(wi);
}

fn cook_torrance_sample(m: CookTorrance, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let share = ct_share(m);
    var wi = cosine_hemisphere(u.xy);
    if (u.z < share) {
        wi = sample_gaussian_reflection(wo, vec3<f32>(u.xy, u.z / share), m.m, m.m);
    }
    return bsdf_sample_of(wo, wi, cook_torrance_eval(m, t, wo, wi), cook_torrance_pdf(m, t, wo, wi));
}

fn cook_torrance_slope_lobe(m: CookTorrance, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    return gaussian_lobe(m.m, m.m, m.diffuse * ((1.0 - m.s) * FRAC_1_PI));
}

fn cook_torrance_albedo(m: CookTorrance, t: u32) -> vec3<f32> {
    return m.f0 * m.s + m.diffuse * (1.0 - m.s);
}
