// Twin of dielectric.rs.

fn dielectric_eval(m: Dielectric, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn dielectric_pdf(m: Dielectric, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return 0.0;
}

fn dielectric_sample(m: Dielectric, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let above = wo.z > 0.0;
    let eta = select(m.ext_ior / m.int_ior, m.int_ior / m.ext_ior, above);
    let f = f_dielectric(abs(wo.z), eta);
    if (u.z < f) {
        return BsdfSample(mirror(wo), f, m.specular_reflectance, 1.0, 1u);
    }
    let wi = refract_at(wo, vec3<f32>(0.0, 0.0, select(-1.0, 1.0, above)), eta);
    if (wi.z == 0.0) {
        return bsdf_no_sample();
    }
    return BsdfSample(wi, 1.0 - f, m.specular_transmittance / (eta * eta), eta, 1u);
}

fn dielectric_albedo(m: Dielectric, t: u32) -> vec3<f32> {
    return m.specular_transmittance;
}
