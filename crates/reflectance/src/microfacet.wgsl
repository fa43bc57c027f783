// Twin of microfacet.rs: the terms of microfacet theory. `Microfacets` as there; `distribution` is 0 for Beckmann,
// 1 for GGX, `masking` is 0 for separable, 1 for height-correlated.

const MIN_ALPHA: f32 = 1e-4;

struct Microfacets {
    distribution: u32,
    masking: u32,
    ax: f32,
    ay: f32,
}

fn alpha_of_roughness(roughness: f32) -> f32 {
    return max(roughness * roughness, 1e-3);
}

// f of facets that reflect or let through all light, the density of their sampler, and wo.h for Fresnel.
struct FacetLobe {
    f: f32,
    pdf: f32,
    cos_oh: f32,
}

fn microfacets(distribution: u32, masking: u32, ax: f32, ay: f32) -> Microfacets {
    return Microfacets(distribution, masking, max(ax, MIN_ALPHA), max(ay, MIN_ALPHA));
}

// Trowbridge and Reitz 1975; Walter et al. 2007.
fn d_ggx(h: vec3<f32>, ax: f32, ay: f32) -> f32 {
    let x = h.x / ax;
    let y = h.y / ay;
    let s = x * x + y * y + h.z * h.z;
    return FRAC_1_PI / (ax * ay * s * s);
}

// Beckmann and Spizzichino 1963.
fn d_beckmann(h: vec3<f32>, ax: f32, ay: f32) -> f32 {
    let x = h.x / ax;
    let y = h.y / ay;
    let z2 = h.z * h.z;
    if (z2 < 1e-12) {
        return 0.0;
    }
    return FRAC_1_PI * exp(-(x * x + y * y) / z2) / (ax * ay * z2 * z2);
}

fn stretched_length(w: vec3<f32>, ax: f32, ay: f32) -> f32 {
    let x = ax * w.x;
    let y = ay * w.y;
    return sqrt(w.z * w.z + x * x + y * y);
}

// Smith 1967; Heitz 2014.
fn lambda_ggx(w: vec3<f32>, ax: f32, ay: f32) -> f32 {
    return 0.5 * (stretched_length(w, ax, ay) / abs(w.z) - 1.0);
}

fn lambda_beckmann(w: vec3<f32>, ax: f32, ay: f32) -> f32 {
    let x = ax * w.x;
    let y = ay * w.y;
    let s2 = x * x + y * y;
    if (w.z * w.z >= 12.25 * s2) {
        return 0.0;
    }
    let a2 = w.z * w.z / s2;
    let a = sqrt(a2);
    return max(exp(-a2) * (0.28209479 / a - 0.5 * erfc_factor(a)), 0.0);
}

fn v_smith_ggx_correlated(wo: vec3<f32>, wi: vec3<f32>, ax: f32, ay: f32) -> f32 {
    return 0.5 / (abs(wi.z) * stretched_length(wo, ax, ay) + abs(wo.z) * stretched_length(wi, ax, ay));
}

fn v_smith_ggx_separable(wo: vec3<f32>, wi: vec3<f32>, ax: f32, ay: f32) -> f32 {
    return 1.0 / ((abs(wo.z) + stretched_length(wo, ax, ay)) * (abs(wi.z) + stretched_length(wi, ax, ay)));
}

fn microfacet_d(m: Microfacets, h: vec3<f32>) -> f32 {
    if (m.distribution == 0u) {
        return d_beckmann(h, m.ax, m.ay);
    }
    return d_ggx(h, m.ax, m.ay);
}

fn microfacet_lambda(m: Microfacets, w: vec3<f32>) -> f32 {
    if (m.distribution == 0u) {
        return lambda_beckmann(w, m.ax, m.ay);
    }
    return lambda_ggx(w, m.ax, m.ay);
}

fn microfacet_reflect(m: Microfacets, wo: vec3<f32>, wi: vec3<f32>) -> FacetLobe {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return FacetLobe(0.0, 0.0, 0.0);
    }
    let h = normalize(wo + wi);
    let d = microfacet_d(m, h);
    let cos_oh = clamp(dot(wo, h), 0.0, 1.0);
    if (m.distribution == 0u) {
        let lo = lambda_beckmann(wo, m.ax, m.ay);
        let li = lambda_beckmann(wi, m.ax, m.ay);
        var g = 1.0 / ((1.0 + lo) * (1.0 + li));
        if (m.masking == 1u) {
            g = 1.0 / (1.0 + lo + li);
        }
        let d4 = 0.25 * d / wo.z;
        return FacetLobe(d4 * g / wi.z, d4 / (1.0 + lo), cos_oh);
    }
    let lo = stretched_length(wo, m.ax, m.ay);
    let li = stretched_length(wi, m.ax, m.ay);
    var v = 1.0 / ((wo.z + lo) * (wi.z + li));
    if (m.masking == 1u) {
        v = 0.5 / (wi.z * lo + wo.z * li);
    }
    return FacetLobe(d * v, 0.5 * d / (wo.z + lo), cos_oh);
}

fn microfacet_g1(m: Microfacets, w: vec3<f32>) -> f32 {
    return 1.0 / (1.0 + microfacet_lambda(m, w));
}

// Walter et al. 2007, equation 21: from `wo` above to `wi` below.
fn microfacet_refract(m: Microfacets, wo: vec3<f32>, wi: vec3<f32>, eta: f32) -> FacetLobe {
    let sum = wo + eta * wi;
    let h = sum / max(length(sum), 1e-30) * select(1.0, -1.0, sum.z < 0.0);
    let oh = dot(wo, h);
    let ih = dot(wi, h);
    if (wo.z <= 0.0 || wi.z >= 0.0 || oh <= 0.0 || ih >= 0.0) {
        return FacetLobe(0.0, 0.0, 0.0);
    }
    let denominator = oh + eta * ih;
    let seen = microfacet_d(m, h) * microfacet_g1(m, wo) * oh * -ih / (wo.z * denominator * denominator);
    return FacetLobe(seen * microfacet_g1(m, wi) / -wi.z, seen * eta * eta, oh);
}

fn microfacet_sample_reflection(m: Microfacets, wo: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    let h = microfacet_sample_visible_normal(m, wo, u);
    return 2.0 * dot(wo, h) * h - wo;
}

fn microfacet_sample_visible_normal(m: Microfacets, wo: vec3<f32>, u: vec2<f32>) -> vec3<f32> {
    if (m.distribution == 0u) {
        return sample_visible_beckmann(wo, m.ax, m.ay, u);
    }
    return sample_visible_ggx(wo, m.ax, m.ay, u);
}

// Dupuy and Benyoub 2023.
fn sample_visible_ggx(wo: vec3<f32>, ax: f32, ay: f32, u: vec2<f32>) -> vec3<f32> {
    let v = normalize(vec3<f32>(ax * wo.x, ay * wo.y, wo.z));
    let z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let c = vec3<f32>(r * cos(TAU * u.x) + v.x, r * sin(TAU * u.x) + v.y, z + v.z);
    return normalize(vec3<f32>(ax * c.x, ay * c.y, max(c.z, 1e-9)));
}

// Heitz and d'Eon 2014.
fn sample_visible_beckmann(wo: vec3<f32>, ax: f32, ay: f32, u: vec2<f32>) -> vec3<f32> {
    let v = normalize(vec3<f32>(ax * wo.x, ay * wo.y, wo.z));
    let cos_theta = v.z;
    let sin_theta = length(v.xy);
    var phi = vec2<f32>(1.0, 0.0);
    if (sin_theta > 0.0) {
        phi = v.xy / sin_theta;
    }
    var cot = 4.0;
    if (cos_theta < 4.0 * sin_theta) {
        cot = cos_theta / sin_theta;
    }
    // 1/sqrt(pi)
    let sin_part = 0.5641896 * sin_theta;
    let gauss_cot = exp(-cot * cot);
    let u_x = max(u.x, 1e-6);
    let x_max = one_plus_erf(cot, gauss_cot);
    let wanted = u_x * (cos_theta * x_max + sin_part * gauss_cot);
    let blend = cos_theta * cos_theta;
    let x = x_max * u_x * (blend + (1.0 - blend) * erfc_factor(sqrt(-log(u_x))));
    var s = erf_inv(clamp(x - 1.0, -1.0 + 1e-6, 1.0 - 1e-6));
    for (var i = 0u; i < 2u; i++) {
        let gauss = exp(-s * s);
        let facing = max(cos_theta - s * sin_theta, 1e-6);
        let cdf = cos_theta * one_plus_erf(s, gauss) + sin_part * gauss;
        let newton = (cdf - wanted) / (2.0 * 0.5641896 * gauss * facing);
        let curvature = -2.0 * s - sin_theta / facing;
        s = clamp(s - newton / clamp(1.0 - 0.5 * newton * curvature, 0.5, 2.0), -4.0, cot);
    }
    let t = erf_inv(clamp(2.0 * u.y - 1.0, -1.0 + 1e-6, 1.0 - 1e-6));
    return normalize(vec3<f32>(-ax * (phi.x * s - phi.y * t), -ay * (phi.y * s + phi.x * t), 1.0));
}

// 1 + erf(s), from exp(-s^2).
fn one_plus_erf(s: f32, gauss: f32) -> f32 {
    let tail = erfc_factor(abs(s)) * gauss;
    return select(2.0 - tail, tail, s < 0.0);
}

// erfc(x) exp(x^2) for x >= 0. Abramowitz and Stegun 1964, 7.1.26.
fn erfc_factor(x: f32) -> f32 {
    let t = 1.0 / (1.0 + 0.3275911 * x);
    return t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
}

// Giles 2010.
fn erf_inv(x: f32) -> f32 {
    let l = -log((1.0 - x) * (1.0 + x));
    var p = 0.0;
    if (l < 5.0) {
        let w = l - 2.5;
        p = 2.8102264e-8;
        p = p * w + 3.4327394e-7;
        p = p * w - 3.5233877e-6;
        p = p * w - 4.3915065e-6;
        p = p * w + 0.00021858087;
        p = p * w - 0.001253725;
        p = p * w - 0.0041776816;
        p = p * w + 0.24664073;
        p = p * w + 1.5014094;
    } else {
        let w = sqrt(l) - 3.0;
        p = -0.00020021426;
        p = p * w + 0.00010095056;
        p = p * w + 0.0013493432;
        p = p * w - 0.0036734284;
        p = p * w + 0.0057395077;
        p = p * w - 0.0076224613;
        p = p * w + 0.0094388705;
        p = p * w + 1.0016741;
        p = p * w + 2.8329768;
    }
    return p * x;
}

fn schlick_weight(x: f32) -> f32 {
    let m = clamp(1.0 - x, 0.0, 1.0);
    let m2 = m * m;
    return m2 * m2 * m;
}

// Schlick 1994.
fn f_schlick(f0: vec3<f32>, f90: vec3<f32>, c: f32) -> vec3<f32> {
    return f0 + (f90 - f0) * schlick_weight(c);
}

// Cook and Torrance 1982.
fn f_dielectric(cos_theta: f32, eta: f32) -> f32 {
    let c = clamp(cos_theta, 0.0, 1.0);
    let g2 = eta * eta - 1.0 + c * c;
    if (g2 <= 0.0) {
        return 1.0;
    }
    let g = sqrt(g2);
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return min(0.5 * a * a * (1.0 + b * b), 1.0);
}

// Zero under total internal reflection. (`refract` is a function of the language, with another meaning.)
fn refract_at(w: vec3<f32>, h: vec3<f32>, eta: f32) -> vec3<f32> {
    let c = dot(w, h);
    let t2 = 1.0 - (1.0 - c * c) / (eta * eta);
    if (t2 <= 0.0) {
        return vec3<f32>(0.0);
    }
    return normalize((c / eta - sqrt(t2)) * h - w / eta);
}

fn apart_from_one(eta: f32) -> f32 {
    return select(eta, 1.005, abs(eta - 1.0) < 5e-3);
}

fn f_conductor(cos_theta: f32, eta: vec3<f32>, k: vec3<f32>) -> vec3<f32> {
    let c = clamp(cos_theta, 0.0, 1.0);
    let c2 = c * c;
    let s2 = 1.0 - c2;
    let eta2 = eta * eta;
    let k2 = k * k;
    let t = eta2 - k2 - s2;
    let a2b2 = sqrt(t * t + 4.0 * eta2 * k2);
    let a = sqrt(max(0.5 * (a2b2 + t), vec3<f32>(0.0)));
    let t1 = a2b2 + c2;
    let t2 = 2.0 * c * a;
    let rs = (t1 - t2) / (t1 + t2);
    let t3 = c2 * a2b2 + s2 * s2 + 1e-20;
    let t4 = t2 * s2;
    let rp = rs * ((t3 - t4) / (t3 + t4));
    return 0.5 * (rs + rp);
}
