// Twin of plastic.rs.

// Duntley 1942.
fn plastic_base(diffuse: vec3<f32>, lost: f32, nonlinear: u32, eta: f32) -> vec3<f32> {
    var inter = vec3<f32>(1.0 - lost);
    if (nonlinear == 1u) {
        inter = 1.0 - diffuse * lost;
    }
    return diffuse / inter * (FRAC_1_PI / (eta * eta));
}

fn plastic_coat(f: f32, specular: vec3<f32>, diffuse: vec3<f32>) -> f32 {
    let s = (specular.x + specular.y + specular.z) * f;
    let d = (diffuse.x + diffuse.y + diffuse.z) * (1.0 - f);
    if (s + d > 0.0) {
        return s / (s + d);
    }
    return 1.0;
}

fn plastic_eval(m: Plastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let eta = m.int_ior / m.ext_ior;
    let base = plastic_base(m.diffuse_reflectance, table_at(t), m.nonlinear, eta);
    return base * ((1.0 - f_dielectric(wo.z, eta)) * (1.0 - f_dielectric(wi.z, eta)));
}

fn plastic_pdf(m: Plastic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let fo = f_dielectric(wo.z, m.int_ior / m.ext_ior);
    return (1.0 - plastic_coat(fo, m.specular_reflectance, m.diffuse_reflectance)) * cosine_hemisphere_pdf(wi);
}

fn plastic_sample(m: Plastic, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let fo = f_dielectric(wo.z, m.int_ior / m.ext_ior);
    let coat = plastic_coat(fo, m.specular_reflectance, m.diffuse_reflectance);
    if (u.z < coat) {
        return BsdfSample(mirror(wo), coat, m.specular_reflectance * (fo / coat), 1.0, 1u);
    }
    let wi = cosine_hemisphere(u.xy);
    return bsdf_sample_of(wo, wi, plastic_eval(m, t, wo, wi), plastic_pdf(m, t, wo, wi));
}

fn plastic_albedo(m: Plastic, t: u32) -> vec3<f32> {
    return m.diffuse_reflectance;
}
