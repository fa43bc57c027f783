// Twin of conductor.rs.

fn conductor_eval(m: Conductor, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn conductor_pdf(m: Conductor, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return 0.0;
}

fn conductor_sample(m: Conductor, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let weight = f_conductor(wo.z, m.eta, m.k) * m.specular_reflectance;
    return BsdfSample(mirror(wo), 1.0, weight, 1.0, 1u);
}

fn conductor_albedo(m: Conductor, t: u32) -> vec3<f32> {
    return f_conductor(1.0, m.eta, m.k) * m.specular_reflectance;
}
