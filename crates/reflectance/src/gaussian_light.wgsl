// Twin of gaussian_light.rs.

const NO_LOBE: u32 = 0u;
const GAUSSIAN: u32 = 1u;
const LONG_TAILS: u32 = 2u;

struct SlopeLobe {
    alpha2: vec3<f32>,
    // NO_LOBE, GAUSSIAN or LONG_TAILS.
    shape: u32,
    rest: vec3<f32>,
}

fn no_slope_lobe() -> SlopeLobe {
    return SlopeLobe(vec3<f32>(1.0, 0.0, 1.0), NO_LOBE, vec3<f32>(0.0));
}

fn gaussian_lobe(alpha_x: f32, alpha_y: f32, rest: vec3<f32>) -> SlopeLobe {
    return SlopeLobe(vec3<f32>(alpha_x * alpha_x, 0.0, alpha_y * alpha_y), GAUSSIAN, rest);
}

fn slope_lobe_of(facets: Microfacets, rest: vec3<f32>) -> SlopeLobe {
    let a = vec3<f32>(facets.ax * facets.ax, 0.0, facets.ay * facets.ay);
    return SlopeLobe(a, select(GAUSSIAN, LONG_TAILS, facets.distribution == 1u), rest);
}

// In the frame of the surface, as in gaussian_light.rs.
struct GaussianLight {
    intensity: vec3<f32>,
    mean: vec3<f32>,
    covariance: mat3x3<f32>,
}

// The mean of max(0, x) of a Gaussian, and the probability of x > 0.
fn above_zero(mean: f32, deviation: f32) -> vec2<f32> {
    if (deviation <= 1e-6 * abs(mean)) {
        return vec2<f32>(max(mean, 0.0), select(0.0, 1.0, mean > 0.0));
    }
    let x = mean / deviation;
    let gauss = exp(-0.5 * x * x);
    let probability = 0.5 * one_plus_erf(x * 0.70710678, gauss);
    return vec2<f32>(max(mean * probability + deviation * (0.3989423 * gauss), 0.0), probability);
}

// Of directions, about w and across it.
fn gaussian_spread(light: GaussianLight, w: vec3<f32>, per_d2: f32, v: vec3<f32>) -> vec3<f32> {
    let c = light.covariance * (v - w * dot(w, v));
    return (c - w * dot(w, c)) * per_d2;
}

// Where f of a model is to be looked up for a light, and factors: of it, and of the rest of it, which is broad. For a unit
// of irradiance on what faces the light's middle.
struct GaussianReflection {
    wi: vec3<f32>,
    factor: f32,
    rest: vec3<f32>,
    rest_factor: f32,
}

fn gaussian_reflection(kind: u32, p: u32, t: u32, wo: vec3<f32>, light: GaussianLight) -> GaussianReflection {
    let none = GaussianReflection(vec3<f32>(0.0, 0.0, 1.0), 0.0, vec3<f32>(0.0), 0.0);
    let d2 = dot(light.mean, light.mean);
    if (!(wo.z > 0.0 && d2 > 0.0)) {
        return none;
    }
    let per_d2 = 1.0 / d2;
    let w = light.mean * sqrt(per_d2);
    let up = gaussian_spread(light, w, per_d2, vec3<f32>(0.0, 0.0, 1.0));
    let above = above_zero(w.z, sqrt(max(up.z, 0.0)));
    if (above.y <= 1e-5) {
        return none;
    }
    let seen = normalize(vec3<f32>(w.xy, above.x / above.y));
    let lobe = bsdf_slope_lobe(kind, p, t, wo, seen);
    if (lobe.shape == NO_LOBE) {
        // Where the light is, or what of it is above the horizon.
        return GaussianReflection(seen, above.x, vec3<f32>(0.0), 0.0);
    }
    let k = 1.0 / max(wo.z + max(w.z, 0.0), 1e-4);
    let slope = (wo + w).xy * k;
    let jx = vec3<f32>(k, 0.0, -slope.x * k);
    let jy = vec3<f32>(0.0, k, -slope.y * k);
    let cx = gaussian_spread(light, w, per_d2, jx);
    let cy = gaussian_spread(light, w, per_d2, jy);
    var v = lobe.alpha2 * 0.5;
    if (lobe.shape == LONG_TAILS) {
        let q = (v.z * slope.x * slope.x - 2.0 * v.y * slope.x * slope.y + v.x * slope.y * slope.y)
            / (v.x * v.z - v.y * v.y);
        v *= 0.5 * (1.0 + 0.5 * q);
    }
    let added = vec3<f32>(dot(jx, cx), dot(jx, cy), dot(jy, cy));
    let sum = v + added;
    let per_det = 1.0 / (sum.x * sum.z - sum.y * sum.y);
    let y = vec2<f32>(sum.z * slope.x - sum.y * slope.y, sum.x * slope.y - sum.y * slope.x) * per_det;
    let at = normalize(w - cx * y.x - cy * y.y);
    let far = y.x * y.x * added.x + 2.0 * y.x * y.y * added.y + y.y * y.y * added.z;
    let weight = sqrt(max((v.x * v.z - v.y * v.y) * per_det, 0.0)) * exp(-0.5 * far);
    let taken = (sum.z * cx.z * cx.z - 2.0 * sum.y * cx.z * cy.z + sum.x * cy.z * cy.z) * per_det;
    let narrow = above_zero(at.z, sqrt(max(up.z - taken, 0.0)));
    var wi = seen;
    var factor = 0.0;
    if (narrow.y > 1e-5) {
        wi = normalize(vec3<f32>(at.xy, narrow.x / narrow.y));
        factor = narrow.x * weight;
    }
    return GaussianReflection(wi, factor, lobe.rest, above.x);
}

// f cos over the light, of f where the reflection asks for it.
fn gaussian_reflected(r: GaussianReflection, f: vec3<f32>) -> vec3<f32> {
    return max(f - r.rest, vec3<f32>(0.0)) * r.factor + r.rest * r.rest_factor;
}

// Radiance towards `wo`: the integral of f L cos over the directions of the light, nothing in between.
fn reflect_gaussian(kind: u32, p: u32, t: u32, wo: vec3<f32>, light: GaussianLight) -> vec3<f32> {
    let r = gaussian_reflection(kind, p, t, wo, light);
    let f = gaussian_reflected(r, bsdf_eval(kind, p, t, wo, r.wi));
    return f * light.intensity / max(dot(light.mean, light.mean), 1e-30);
}
