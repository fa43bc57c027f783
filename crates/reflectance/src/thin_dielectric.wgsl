// Twin of thin_dielectric.rs.

fn thin_dielectric_eval(m: ThinDielectric, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn thin_dielectric_pdf(m: ThinDielectric, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return 0.0;
}

fn thin_dielectric_sample(m: ThinDielectric, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let once = f_dielectric(abs(wo.z), m.int_ior / m.ext_ior);
    let r = 2.0 * once / (1.0 + once);
    if (u.z < r) {
        return BsdfSample(mirror(wo), r, m.specular_reflectance, 1.0, 1u);
    }
    return BsdfSample(-wo, 1.0 - r, m.specular_transmittance, 1.0, 1u);
}

fn thin_dielectric_albedo(m: ThinDielectric, t: u32) -> vec3<f32> {
    return m.specular_transmittance;
}
