// Twin of rough_dielectric.rs.

fn rough_dielectric_facets(m: RoughDielectric) -> Microfacets {
    return microfacets(m.distribution, m.masking, m.alpha_x, m.alpha_y);
}

fn rough_dielectric_eta(m: RoughDielectric, wo: vec3<f32>) -> f32 {
    return apart_from_one(select(m.ext_ior / m.int_ior, m.int_ior / m.ext_ior, wo.z > 0.0));
}

fn rough_dielectric_eval_pdf(m: RoughDielectric, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (wo.z == 0.0 || wi.z == 0.0) {
        return vec4<f32>(0.0);
    }
    let eta = rough_dielectric_eta(m, wo);
    let facets = rough_dielectric_facets(m);
    let o = to_upper(wo, wo.z);
    let i = to_upper(wi, wo.z);
    if (i.z > 0.0) {
        let r = microfacet_reflect(facets, o, i);
        let fresnel = f_dielectric(r.cos_oh, eta);
        return vec4<f32>(r.f * fresnel * m.specular_reflectance, r.pdf * fresnel);
    }
    let r = microfacet_refract(facets, o, i, eta);
    let through = 1.0 - f_dielectric(r.cos_oh, eta);
    return vec4<f32>(r.f * through * m.specular_transmittance, r.pdf * through);
}

fn rough_dielectric_sample(m: RoughDielectric, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z == 0.0) {
        return bsdf_no_sample();
    }
    let eta = rough_dielectric_eta(m, wo);
    let o = to_upper(wo, wo.z);
    let h = microfacet_sample_visible_normal(rough_dielectric_facets(m), o, u.xy);
    let reflects = u.z < f_dielectric(dot(o, h), eta);
    var i = reflect_about(o, h);
    if (!reflects) {
        i = refract_at(o, h, eta);
    }
    if (i.z == 0.0 || (i.z > 0.0) != reflects) {
        return bsdf_no_sample();
    }
    let wi = to_upper(i, wo.z);
    let f = rough_dielectric_eval_pdf(m, t, wo, wi);
    return bsdf_sample_across(wi, f.xyz, f.w, select(eta, 1.0, reflects));
}

fn rough_dielectric_albedo(m: RoughDielectric, t: u32) -> vec3<f32> {
    return m.specular_transmittance;
}
