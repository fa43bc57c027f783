// Twin of importance.rs: importance sampling from a table over the half vector.

const COSINE_SHARE: f32 = 0.1;

struct HalfVectorTable {
    start: u32,
    n_theta: u32,
    n_phi: u32,
    n_u: u32,
    n_v: u32,
}

// Grid directions around the eye and their shares: two without azimuths, else four.
struct HalfVectorNodes {
    at: vec4<u32>,
    share: vec4<f32>,
    count: u32,
}

const HALF_VECTOR_POLE: f32 = 1e-4;
// The root of it, and (1 + pole^2)^(1/4) less that.
const HALF_VECTOR_OFFSET: f32 = 0.01;
const HALF_VECTOR_SCALE: f32 = 0.99;

fn half_vector_u(theta: f32) -> f32 {
    let t = theta / HALF_PI;
    return (sqrt(sqrt(t * t + HALF_VECTOR_POLE * HALF_VECTOR_POLE)) - HALF_VECTOR_OFFSET) / HALF_VECTOR_SCALE;
}

fn half_vector_theta(u: f32) -> f32 {
    let d = u * HALF_VECTOR_SCALE;
    let y = d + HALF_VECTOR_OFFSET;
    return HALF_PI * sqrt(max(d * (y + HALF_VECTOR_OFFSET) * (y * y + HALF_VECTOR_POLE), 0.0));
}

fn half_vector_solid_angle(u: f32, theta: f32) -> f32 {
    let y = u * HALF_VECTOR_SCALE + HALF_VECTOR_OFFSET;
    var sinc = 1.0;
    if (theta > 1e-4) {
        sinc = sin(theta) / theta;
    }
    return 2.0 * HALF_PI * HALF_PI * y * y * y * HALF_VECTOR_SCALE * sinc;
}

fn half_vector_tent(s: f32) -> f32 {
    if (s < 0.5) {
        return sqrt(2.0 * s) - 0.5;
    }
    return 1.5 - sqrt(2.0 - 2.0 * s);
}

fn half_vector_nodes(h: HalfVectorTable, wo: vec3<f32>) -> HalfVectorNodes {
    var x = polar_angle(wo) / HALF_PI * f32(h.n_theta - 1u);
    let i = min(u32(x), h.n_theta - 2u);
    x = min(x - f32(i), 1.0);
    var j = 0u;
    var k = 0u;
    var y = 0.0;
    if (h.n_phi > 1u) {
        let phi = azimuth(wo) / TAU;
        y = (phi - floor(phi)) * f32(h.n_phi);
        j = min(u32(y), h.n_phi - 1u);
        y = y - f32(j);
        k = (j + 1u) % h.n_phi;
    }
    let stride = h.n_u + 1u + h.n_u * (h.n_v + 1u);
    let at = vec4<u32>(j * h.n_theta + i, j * h.n_theta + i + 1u, k * h.n_theta + i, k * h.n_theta + i + 1u);
    return HalfVectorNodes(
        vec4<u32>(h.start) + at * stride,
        vec4<f32>((1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y),
        select(2u, 4u, h.n_phi > 1u),
    );
}

fn half_vector_pdf(h: HalfVectorTable, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return 0.0;
    }
    let sum = wo + wi;
    let cosine = 0.5 * length(sum);
    let theta = polar_angle(sum);
    let u = half_vector_u(theta);
    let v = (azimuth(sum) - azimuth(wo)) / TAU;
    var x = clamp(u * f32(h.n_u) - 0.5, 0.0, f32(h.n_u - 1u));
    let a = min(u32(x), h.n_u - 2u);
    x = x - f32(a);
    let around = (v - floor(v)) * f32(h.n_v) - 0.5;
    let y = around - floor(around);
    let b = u32(i32(floor(around)) + i32(h.n_v)) % h.n_v;
    let c = (b + 1u) % h.n_v;
    let nodes = half_vector_nodes(h, wo);
    var p = 0.0;
    for (var n = 0u; n < nodes.count; n++) {
        if (nodes.share[n] > 0.0) {
            let node = t + nodes.at[n];
            for (var k = 0u; k < 2u; k++) {
                let row = node + h.n_u + 1u + (a + k) * (h.n_v + 1u);
                let along = (1.0 - y) * (table_at(row + b + 1u) - table_at(row + b))
                    + y * (table_at(row + c + 1u) - table_at(row + c));
                let share = nodes.share[n] * select(1.0 - x, x, k == 1u);
                p += share * (table_at(node + a + k + 1u) - table_at(node + a + k)) * along;
            }
        }
    }
    let per_h = f32(h.n_u * h.n_v) / (TAU * half_vector_solid_angle(u, theta));
    return COSINE_SHARE * cosine_hemisphere_pdf(wi) + (1.0 - COSINE_SHARE) * p * per_h / (4.0 * cosine);
}

// The cell of the cumulative distribution of n cells at `at` that u falls into, and where in it.
fn half_vector_find(at: u32, n: u32, u: f32) -> vec2<f32> {
    var low = 0u;
    var high = n + 1u;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (table_at(at + middle) <= u) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = clamp(low, 1u, n) - 1u;
    let first = table_at(at + i);
    let width = table_at(at + i + 1u) - first;
    if (width > 0.0) {
        return vec2<f32>(f32(i), clamp((u - first) / width, 0.0, 0.99999994));
    }
    return vec2<f32>(f32(i), 0.5);
}

// Zero where the draw lies below the surface.
fn half_vector_sample(h: HalfVectorTable, t: u32, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    if (u.z < COSINE_SHARE) {
        return cosine_hemisphere(u.xy);
    }
    var choice = (u.z - COSINE_SHARE) / (1.0 - COSINE_SHARE);
    let nodes = half_vector_nodes(h, wo);
    var node = nodes.at[0];
    for (var n = 0u; n < nodes.count; n++) {
        if (nodes.share[n] > 0.0) {
            node = nodes.at[n];
        }
        choice -= nodes.share[n];
        if (choice < 0.0) {
            break;
        }
    }
    let first = half_vector_find(t + node, h.n_u, u.x);
    let a = u32(first.x);
    let second = half_vector_find(t + node + h.n_u + 1u + a * (h.n_v + 1u), h.n_v, u.y);
    let folded = abs((first.x + half_vector_tent(first.y)) / f32(h.n_u));
    let theta = half_vector_theta(select(folded, 2.0 - folded, folded > 1.0));
    let phi = azimuth(wo) + TAU * (second.x + half_vector_tent(second.y)) / f32(h.n_v);
    let m = spherical(theta, phi);
    let cosine = dot(wo, m);
    let wi = 2.0 * cosine * m - wo;
    if (cosine <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return normalize(wi);
}

// Rusinkiewicz 1998: theta_h, theta_d, phi_d.
fn rusinkiewicz(wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let h = wo + wi;
    let d = wi - wo;
    let sin_h = length(h.xy);
    let theta_h = atan2(sin_h, h.z);
    let theta_d = atan2(length(d), length(h));
    var t = vec2<f32>(1.0, 0.0);
    if (sin_h > 0.0) {
        t = h.xy / sin_h;
    }
    let x = cos(theta_h) * dot(d.xy, t) - sin(theta_h) * d.z;
    let y = t.x * d.y - t.y * d.x;
    var phi_d = 0.0;
    if (x != 0.0 || y != 0.0) {
        phi_d = atan2(y, x);
    }
    return vec3<f32>(theta_h, min(theta_d, HALF_PI), phi_d);
}
