// Twin of phong.rs.

fn phong_eval(m: Phong, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let c = dot(vec3<f32>(-wo.xy, wo.z), wi);
    if (c <= 0.0) {
        return vec3<f32>(0.0);
    }
    let lobe = pow(min(c, 1.0), m.exponent);
    if (m.form == 0u) {
        return m.specular * ((m.exponent + 2.0) / TAU * lobe);
    }
    return m.specular * (lobe / max(wi.z, 1e-6));
}

fn phong_pdf(m: Phong, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    return pdf_cosine_power(min(dot(vec3<f32>(-wo.xy, wo.z), wi), 1.0), m.exponent);
}

fn phong_sample(m: Phong, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let n = vec3<f32>(-wo.xy, wo.z);
    let p = sample_cosine_power(u.xy, m.exponent);
    // Frame::from_normal of optics: Duff et al. 2017.
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    let wi = vec3<f32>(1.0 + s * n.x * n.x * a, s * b, -s * n.x) * p.x + vec3<f32>(b, s + n.y * n.y * a, -n.y) * p.y + n * p.z;
    return bsdf_sample_of(wo, wi, phong_eval(m, t, wo, wi), phong_pdf(m, t, wo, wi));
}

fn phong_albedo(m: Phong, t: u32) -> vec3<f32> {
    return m.specular;
}
