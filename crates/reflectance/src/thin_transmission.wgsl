// Twin of thin_transmission.rs.

fn thin_transmission_facets(m: ThinTransmission) -> Microfacets {
    let alpha = alpha_of_roughness(m.roughness);
    return microfacets(1u, m.masking, alpha, alpha);
}

fn thin_transmission_fresnel(m: ThinTransmission, c: f32) -> vec3<f32> {
    let r = (m.ior - 1.0) / (m.ior + 1.0);
    let f0 = min(r * r * m.specular_color, vec3<f32>(1.0)) * m.specular;
    return f0 + (m.specular - f0) * schlick_weight(c);
}

fn thin_transmission_passes(m: ThinTransmission, c: f32) -> f32 {
    return 1.0 - max_element(thin_transmission_fresnel(m, c));
}

// The probability of drawing the reflection, seen under this cosine.
fn thin_transmission_reflects(m: ThinTransmission, c: f32) -> f32 {
    let fresnel = max_element(thin_transmission_fresnel(m, c));
    let passes = (1.0 - fresnel) * max_element(m.transmittance);
    if (fresnel + passes > 0.0) {
        return fresnel / (fresnel + passes);
    }
    return 1.0;
}

fn thin_transmission_eval_pdf(m: ThinTransmission, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (wo.z == 0.0 || wi.z == 0.0) {
        return vec4<f32>(0.0);
    }
    let o = to_upper(wo, wo.z);
    let i = to_upper(wi, wi.z);
    let reflects = thin_transmission_reflects(m, o.z);
    let r = microfacet_reflect(thin_transmission_facets(m), o, i);
    if (wo.z * wi.z > 0.0) {
        return vec4<f32>(thin_transmission_fresnel(m, r.cos_oh) * r.f, reflects * r.pdf);
    }
    let diffuse = m.diffuse * FRAC_1_PI * thin_transmission_passes(m, min(o.z, i.z));
    let f = m.transmittance * ((1.0 - m.diffuse) * thin_transmission_passes(m, r.cos_oh) * r.f + diffuse);
    let pdf = (1.0 - m.diffuse) * r.pdf + m.diffuse * cosine_hemisphere_pdf(i);
    return vec4<f32>(f, (1.0 - reflects) * pdf);
}

fn thin_transmission_sample(m: ThinTransmission, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z == 0.0) {
        return bsdf_no_sample();
    }
    let o = to_upper(wo, wo.z);
    let reflects = thin_transmission_reflects(m, o.z);
    let passes = u.z >= reflects;
    var i = cosine_hemisphere(u.xy);
    if (!passes || u.z - reflects >= (1.0 - reflects) * m.diffuse) {
        i = microfacet_sample_reflection(thin_transmission_facets(m), o, u.xy);
    }
    if (i.z <= 0.0) {
        return bsdf_no_sample();
    }
    let wi = vec3<f32>(i.xy, select(i.z, -i.z, passes == (wo.z > 0.0)));
    let f = thin_transmission_eval_pdf(m, t, wo, wi);
    return bsdf_sample_across(wi, f.xyz, f.w, 1.0);
}

fn thin_transmission_albedo(m: ThinTransmission, t: u32) -> vec3<f32> {
    return m.transmittance;
}
