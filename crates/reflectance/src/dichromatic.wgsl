// Twin of dichromatic.rs. interface_form: 0 blinn_phong, 1 torrance_sparrow, 2 ward, 3 ggx.

fn dichromatic_exponent(m: Dichromatic) -> f32 {
    return 2.0 / (m.roughness * m.roughness);
}

fn dichromatic_microfacets(m: Dichromatic) -> Microfacets {
    // GGX, height-correlated.
    return microfacets(1u, 1u, m.roughness, m.roughness);
}

fn dichromatic_body(m: Dichromatic, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (m.body_form == 0u) {
        return m.body_colour * FRAC_1_PI;
    }
    return f_energy_preserving(m.body_colour, m.sigma, wo, wi);
}

fn dichromatic_interface(m: Dichromatic, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    let h = half_vector(wo, wi);
    let n = dichromatic_exponent(m);
    switch m.interface_form {
        case 0u: { return half_lobe_normaliser(n) * pow(min(h.z, 1.0), n); }
        case 1u: { return d_beckmann(h.xyz, m.roughness, m.roughness) * v_grooves(wo, wi, h) * f_dielectric(h.w, m.eta); }
        case 2u: { return f_gmd(wo, wi, m.roughness, m.roughness); }
        default: { return microfacet_reflect(dichromatic_microfacets(m), wo, wi).f * f_dielectric(h.w, m.eta); }
    }
}

fn dichromatic_share(m: Dichromatic) -> f32 {
    let fresnel = select(1.0, 0.25, m.interface_form == 1u || m.interface_form == 3u);
    return lobe_share(m.interface_colour * fresnel, m.body_colour);
}

fn dichromatic_eval(m: Dichromatic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return dichromatic_body(m, wo, wi) + m.interface_colour * dichromatic_interface(m, wo, wi);
}

fn dichromatic_pdf(m: Dichromatic, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let share = dichromatic_share(m);
    var pdf = 0.0;
    switch m.interface_form {
        case 0u: {
            let h = half_vector(wo, wi);
            pdf = pdf_reflected(pdf_cosine_power(min(h.z, 1.0), dichromatic_exponent(m)), h.w);
        }
        case 3u: { pdf = microfacet_reflect(dichromatic_microfacets(m), wo, wi).pdf; }
        default: { pdf = pdf_gaussian_reflection(wo, wi, m.roughness, m.roughness); }
    }
    return share * pdf + (1.0 - share) * cosine_hemisphere_pdf(wi);
}

fn dichromatic_sample(m: Dichromatic, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let share = dichromatic_share(m);
    var wi = cosine_hemisphere(u.xy);
    if (u.z < share) {
        switch m.interface_form {
            case 0u: {
                let h = sample_cosine_power(u.xy, dichromatic_exponent(m));
                if (dot(h, wo) <= 0.0) {
                    return bsdf_no_sample();
                }
                wi = reflect_about(wo, h);
            }
            case 3u: { wi = microfacet_sample_reflection(dichromatic_microfacets(m), wo, u.xy); }
            default: { wi = sample_gaussian_reflection(wo, vec3<f32>(u.xy, u.z / share), m.roughness, m.roughness); }
        }
    }
    return bsdf_sample_of(wo, wi, dichromatic_eval(m, t, wo, wi), dichromatic_pdf(m, t, wo, wi));
}

fn dichromatic_albedo(m: Dichromatic, t: u32) -> vec3<f32> {
    let fresnel = select(1.0, f_dielectric(1.0, m.eta), m.interface_form == 1u || m.interface_form == 3u);
    return min(m.body_colour + m.interface_colour * fresnel, vec3<f32>(1.0));
}
