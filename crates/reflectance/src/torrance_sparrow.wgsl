// Twin of torrance_sparrow.rs.

fn ts_gaussian_normaliser(n: f32) -> f32 {
    let x = (n * 0.5 * PI) * (n * 0.5 * PI);
    let tail = exp(-x);
    var gamma = 1.0 - tail;
    var power = 1.0;
    var factor = 1.0;
    var sum = gamma;
    for (var i = 1u; i < 12u; i++) {
        let k = f32(i);
        // X to the k overflows only where exp(-X) is zero.
        if (tail > 0.0) {
            power *= x;
            gamma = k * gamma - power * tail;
        } else {
            gamma = k * gamma;
        }
        factor *= -4.0 / (n * n * (2.0 * k) * (2.0 * k + 1.0));
        sum += factor * gamma;
    }
    return PI / (n * n) * sum;
}

fn ts_d(m: TorranceSparrow, h: vec3<f32>) -> f32 {
    let c2 = h.z * h.z;
    let s2 = h.x * h.x + h.y * h.y;
    switch m.distribution {
        case 0u: { return pow(min(h.z, 1.0), m.n1); }
        case 1u: {
            let x = m.n2 * atan2(sqrt(s2), h.z);
            return exp(-x * x);
        }
        case 2u: {
            let a = m.n3 * m.n3;
            let d = a / (a * c2 + s2);
            return d * d;
        }
        default: {
            let e = exp(-s2 / max(c2 * m.n4 * m.n4, 1e-24));
            if (e > 0.0) {
                return e / (m.n4 * m.n4 * c2 * c2);
            }
            return 0.0;
        }
    }
}

fn ts_normaliser(m: TorranceSparrow) -> f32 {
    switch m.distribution {
        case 0u: { return TAU / (m.n1 + 2.0); }
        case 1u: { return ts_gaussian_normaliser(m.n2); }
        case 2u: { return PI * m.n3 * m.n3; }
        default: { return PI; }
    }
}

fn ts_reach(m: TorranceSparrow) -> f32 {
    let x = m.n2 * 0.5 * PI;
    return 1.0 - exp(-x * x);
}

fn ts_sample_normal(m: TorranceSparrow, u: vec2<f32>) -> vec3<f32> {
    let phi = TAU * u.y;
    switch m.distribution {
        case 0u: { return sample_cosine_power(u, m.n1 + 1.0); }
        case 1u: {
            let alpha = sqrt(-log(1.0 - u.x * ts_reach(m))) / m.n2;
            return vec3<f32>(sin(alpha) * cos(phi), sin(alpha) * sin(phi), max(cos(alpha), 0.0));
        }
        case 2u: {
            let slope = m.n3 * sqrt(u.x / (1.0 - u.x));
            return normalize(vec3<f32>(slope * cos(phi), slope * sin(phi), 1.0));
        }
        default: { return sample_gaussian_slopes(u, m.n4, m.n4); }
    }
}

fn ts_pdf_normal(m: TorranceSparrow, h: vec3<f32>) -> f32 {
    switch m.distribution {
        case 0u: { return pdf_cosine_power(min(h.z, 1.0), m.n1 + 1.0); }
        case 1u: {
            let s = length(h.xy);
            let alpha = atan2(s, h.z);
            let n2 = m.n2 * m.n2;
            var over_sin = 1.0;
            if (s > 1e-4) {
                over_sin = alpha / s;
            }
            return n2 / PI * over_sin * exp(-n2 * alpha * alpha) / ts_reach(m);
        }
        case 2u: { return d_ggx(h, m.n3, m.n3) * h.z; }
        default: { return pdf_gaussian_slopes(h, m.n4, m.n4); }
    }
}

fn ts_f(m: TorranceSparrow, c: f32) -> vec3<f32> {
    switch m.fresnel {
        case 0u: { return vec3<f32>(f_dielectric(c, m.eta)); }
        case 1u: { return f_schlick(m.f0, vec3<f32>(1.0), c); }
        case 2u: { return m.f0; }
        default: { return vec3<f32>(1.0); }
    }
}

fn torrance_sparrow_eval(m: TorranceSparrow, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let h = half_vector(wo, wi);
    var v = 0.0;
    if (m.masking == 0u) {
        v = v_grooves(wo, wi, h);
    } else {
        v = 0.25 / max(wo.z * wi.z, 1e-18);
    }
    var scale = 4.0;
    if (m.form == 0u) {
        scale = 1.0 / ts_normaliser(m);
    }
    return m.specular * ts_f(m, h.w) * (scale * ts_d(m, h.xyz) * v);
}

fn torrance_sparrow_pdf(m: TorranceSparrow, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let h = half_vector(wo, wi);
    return pdf_reflected(pdf_seen_wall(wo, h.xyz, ts_pdf_normal(m, h.xyz)), h.w);
}

fn torrance_sparrow_sample(m: TorranceSparrow, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let h = seen_wall(wo, ts_sample_normal(m, u.xy), u.z);
    let wi = reflect_about(wo, h);
    return bsdf_sample_of(wo, wi, torrance_sparrow_eval(m, t, wo, wi), torrance_sparrow_pdf(m, t, wo, wi));
}

fn torrance_sparrow_albedo(m: TorranceSparrow, t: u32) -> vec3<f32> {
    return min(m.specular * ts_f(m, 1.0), vec3<f32>(1.0));
}
