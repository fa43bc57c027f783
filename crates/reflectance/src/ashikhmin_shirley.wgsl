// Twin of ashikhmin_shirley.rs.

fn as_pdf_half(m: AshikhminShirley, h: vec3<f32>) -> f32 {
    let s2 = h.x * h.x + h.y * h.y;
    var exponent = 0.0;
    if (s2 > 0.0) {
        exponent = (m.n_u * h.x * h.x + m.n_v * h.y * h.y) / s2;
    }
    return sqrt((m.n_u + 1.0) * (m.n_v + 1.0)) / TAU * pow(min(h.z, 1.0), exponent);
}

fn as_share(m: AshikhminShirley) -> f32 {
    let s = max(max_element(m.specular), 0.1);
    let d = max_element((vec3<f32>(1.0) - m.specular) * m.diffuse);
    return s / (s + d);
}

fn as_let_in(c: f32) -> f32 {
    return 1.0 - schlick_weight(0.5 * c);
}

fn ashikhmin_shirley_eval(m: AshikhminShirley, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let h = half_vector(wo, wi);
    let c = h.w;
    let highlight = 0.25 * as_pdf_half(m, h.xyz) / (c * max(wo.z, wi.z));
    let ground = m.diffuse * (vec3<f32>(1.0) - m.specular) * (28.0 / (23.0 * PI) * as_let_in(wo.z) * as_let_in(wi.z));
    return f_schlick(m.specular, vec3<f32>(1.0), c) * highlight + ground;
}

fn ashikhmin_shirley_pdf(m: AshikhminShirley, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let h = half_vector(wo, wi);
    let share = as_share(m);
    return share * pdf_reflected(as_pdf_half(m, h.xyz), h.w) + (1.0 - share) * cosine_hemisphere_pdf(wi);
}

fn ashikhmin_shirley_sample(m: AshikhminShirley, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    var wi = cosine_hemisphere(u.xy);
    if (u.z < as_share(m)) {
        let a = TAU * u.y;
        let p = normalize(vec2<f32>(cos(a) * sqrt(m.n_v + 1.0), sin(a) * sqrt(m.n_u + 1.0)));
        let exponent = m.n_u * p.x * p.x + m.n_v * p.y * p.y;
        let z = pow(1.0 - u.x, 1.0 / (exponent + 1.0));
        let h = vec3<f32>(sqrt(max(1.0 - z * z, 0.0)) * p, z);
        if (dot(h, wo) <= 0.0) {
            return bsdf_no_sample();
        }
        wi = reflect_about(wo, h);
    }
    return bsdf_sample_of(wo, wi, ashikhmin_shirley_eval(m, t, wo, wi), ashikhmin_shirley_pdf(m, t, wo, wi));
}

fn ashikhmin_shirley_albedo(m: AshikhminShirley, t: u32) -> vec3<f32> {
    return m.specular + m.diffuse * (vec3<f32>(1.0) - m.specular);
}
