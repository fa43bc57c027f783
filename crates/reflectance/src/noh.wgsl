// Twin of noh.rs. Forms: 0 ward_gmd, 1 paper, 2 ward_duer, 3 ashikhmin2000, 4 beckmann, 5 ggx, 6 blinn_phong.

fn noh_microfacets(m: Noh) -> Microfacets {
    // Beckmann is 0, GGX 1; masking 1 is height-correlated.
    return microfacets(select(1u, 0u, m.form == 4u), 1u, m.sigma_x, m.sigma_y);
}

fn noh_exponent(m: Noh) -> f32 {
    return 2.0 / (m.sigma_x * m.sigma_y);
}

fn noh_f(m: Noh, c: f32) -> vec3<f32> {
    return m.rho_s + (vec3<f32>(1.0) - m.rho_s) * (m.grazing * schlick_weight(c));
}

fn noh_highlight(m: Noh, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let h = half_vector(wo, wi);
    switch m.form {
        case 0u: { return m.rho_s * f_gmd(wo, wi, m.sigma_x, m.sigma_y); }
        case 1u: { return m.rho_s * (exp(-squared_slope(h.xyz, m.sigma_x, m.sigma_y)) / max(wo.z * wi.z, 1e-18)); }
        case 2u: { return m.rho_s * f_duer(wo, wi, m.sigma_x, m.sigma_y); }
        case 3u: { return noh_f(m, h.w) * f_ashikhmin2000(t, wo, wi, m.sigma_x, m.sigma_y, 0.0); }
        case 4u, 5u: { return noh_f(m, h.w) * microfacet_reflect(noh_microfacets(m), wo, wi).f; }
        default: {
            let n = noh_exponent(m);
            return m.rho_s * (half_lobe_normaliser(n) * pow(min(h.z, 1.0), n));
        }
    }
}

fn noh_highlight_pdf(m: Noh, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    switch m.form {
        case 4u, 5u: { return microfacet_reflect(noh_microfacets(m), wo, wi).pdf; }
        case 6u: {
            let h = half_vector(wo, wi);
            return pdf_reflected(pdf_cosine_power(min(h.z, 1.0), noh_exponent(m)), h.w);
        }
        default: { return pdf_gaussian_reflection(wo, wi, m.sigma_x, m.sigma_y); }
    }
}

fn noh_share(m: Noh) -> f32 {
    return lobe_share(max(m.rho_s, vec3<f32>(0.1 * m.grazing)), m.rho_d);
}

fn noh_eval(m: Noh, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return m.rho_d * FRAC_1_PI + noh_highlight(m, t, wo, wi);
}

fn noh_pdf(m: Noh, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let share = noh_share(m);
    return share * noh_highlight_pdf(m, wo, wi) + (1.0 - share) * cosine_hemisphere_pdf(wi);
}

fn noh_sample(m: Noh, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let share = noh_share(m);
    var wi = cosine_hemisphere(u.xy);
    if (u.z < share) {
        switch m.form {
            case 4u, 5u: { wi = microfacet_sample_reflection(noh_microfacets(m), wo, u.xy); }
            case 6u: {
                let h = sample_cosine_power(u.xy, noh_exponent(m));
                if (dot(h, wo) <= 0.0) {
                    return bsdf_no_sample();
                }
                wi = reflect_about(wo, h);
            }
            default: { wi = sample_gaussian_reflection(wo, vec3<f32>(u.xy, u.z / share), m.sigma_x, m.sigma_y); }
        }
    }
    return bsdf_sample_of(wo, wi, noh_eval(m, t, wo, wi), noh_pdf(m, t, wo, wi));
}

fn noh_slope_lobe(m: Noh, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    let rest = m.rho_d * FRAC_1_PI;
    switch m.form {
        case 5u: { return slope_lobe_of(noh_microfacets(m), rest); }
        case 6u: {
            let alpha = sqrt(2.0 / noh_exponent(m));
            return gaussian_lobe(alpha, alpha, rest);
        }
        default: { return gaussian_lobe(m.sigma_x, m.sigma_y, rest); }
    }
}

fn noh_albedo(m: Noh, t: u32) -> vec3<f32> {
    return min(m.rho_d + m.rho_s, vec3<f32>(1.0));
}
