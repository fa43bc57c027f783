// Conventions of every model, the same as in lib.rs.
//
// Directions are unit vectors in the local frame: normal +z, tangent +x. `wo` points to the eye, `wi` to the
// light, both away from the surface. `x_eval` returns f in 1/sr without the cosine; pdfs are per solid angle;
// colours are linear.
//
// A twin is these functions; `m` holds the parameters, `t` is where its table starts (read it with `table_at(t + i)`):
//   fn x_eval(m: X, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32>
//   fn x_pdf(m: X, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32
//   fn x_sample(m: X, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample
// or, where f and density share work, instead of the first two both at once, the density in w:
//   fn x_eval_pdf(m: X, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32>
// and, where the twin in Rust has them, `x_slope_lobe(m, t, wo, wi) -> SlopeLobe` and `x_albedo(m, t) -> vec3<f32>`.
// `X` and `x_load` are made from the parameter table in x.rs. Same names, same order of operations as there.

const PI: f32 = 3.14159265358979;
const FRAC_1_PI: f32 = 0.318309886183791;
const TAU: f32 = 6.28318530717959;
const HALF_PI: f32 = 1.5707963267949;

// A drawn direction. `pdf` is 0 where the draw carries no light; `eta` is the relative index of refraction crossed, 1
// for reflection; `is_delta` is 1 for a Dirac peak.
struct BsdfSample {
    wi: vec3<f32>,
    pdf: f32,
    weight: vec3<f32>,
    eta: f32,
    is_delta: u32,
}

fn bsdf_no_sample() -> BsdfSample {
    return BsdfSample(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 1.0, 0u);
}

// The draw `wi` of a reflector with f and pdf of the whole model. Twin of Sample::of.
fn bsdf_sample_of(wo: vec3<f32>, wi: vec3<f32>, f: vec3<f32>, pdf: f32) -> BsdfSample {
    if (!(wo.z > 0.0 && wi.z > 0.0)) {
        return bsdf_no_sample();
    }
    return bsdf_sample_across(wi, f, pdf, 1.0);
}

// The draw `wi` on either side of the surface. Twin of Sample::across.
fn bsdf_sample_across(wi: vec3<f32>, f: vec3<f32>, pdf: f32, eta: f32) -> BsdfSample {
    if (!(pdf > 1.17549435e-38 && pdf < 3.0e38)) {
        return bsdf_no_sample();
    }
    return BsdfSample(wi, pdf, f * (abs(wi.z) / pdf), eta, 0u);
}

// Right-handed and orthonormal: tangent, bitangent, normal.
struct Frame {
    s: vec3<f32>,
    t: vec3<f32>,
    n: vec3<f32>,
}

// Duff et al. 2017.
fn frame_from_normal(n: vec3<f32>) -> Frame {
    let side = select(1.0, -1.0, n.z < 0.0);
    let a = -1.0 / (side + n.z);
    let b = n.x * n.y * a;
    return Frame(
        vec3<f32>(1.0 + side * n.x * n.x * a, side * b, -side * n.x),
        vec3<f32>(b, side + n.y * n.y * a, -n.y),
        n,
    );
}

fn frame_from_normal_tangent(n: vec3<f32>, tangent: vec3<f32>) -> Frame {
    let s = tangent - n * dot(n, tangent);
    let l = length(s);
    if (l > 1e-6 * length(tangent) && l < 3.0e38) {
        return Frame(s / l, cross(n, s / l), n);
    }
    return frame_from_normal(n);
}

fn to_local(f: Frame, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(v, f.s), dot(v, f.t), dot(v, f.n));
}

fn to_world(f: Frame, v: vec3<f32>) -> vec3<f32> {
    return f.s * v.x + f.t * v.y + f.n * v.z;
}

fn spherical(theta: f32, phi: f32) -> vec3<f32> {
    return vec3<f32>(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
}

fn mirror(w: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(-w.xy, w.z);
}

// Mirrored at the surface where `side` is below.
fn to_upper(w: vec3<f32>, side: f32) -> vec3<f32> {
    return vec3<f32>(w.xy, select(w.z, -w.z, side < 0.0));
}

fn concentric_disc(u: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2<f32>(0.0);
    }
    var r = p.x;
    var phi = 0.0;
    if (abs(p.x) > abs(p.y)) {
        phi = 0.25 * PI * (p.y / p.x);
    } else {
        r = p.y;
        phi = 0.5 * PI - 0.25 * PI * (p.x / p.y);
    }
    return r * vec2<f32>(cos(phi), sin(phi));
}

fn cosine_hemisphere(u: vec2<f32>) -> vec3<f32> {
    let d = concentric_disc(u);
    return vec3<f32>(d, sqrt(max(1.0 - dot(d, d), 0.0)));
}

fn cosine_hemisphere_pdf(w: vec3<f32>) -> f32 {
    return max(w.z, 0.0) * FRAC_1_PI;
}
