// Twin of microcylinder.rs.

const MICROCYLINDER_HEAD: u32 = 13u;
const MICROCYLINDER_BLOCK: u32 = 12u;
const MICROCYLINDER_SLOPE: u32 = 7u;
const MICROCYLINDER_PHYSICAL: u32 = 2u;
const MICROCYLINDER_EVEN: f32 = 0.04;
const MICROCYLINDER_TINY: f32 = 1e-30;
const MICROCYLINDER_STRETCH_GAMMA: f32 = 4.5;
const MICROCYLINDER_STRETCH: f32 = 0.5;
const MICROCYLINDER_GAUSS_X: vec4<f32> = vec4<f32>(0.183434642, 0.525532410, 0.796666477, 0.960289856);
const MICROCYLINDER_GAUSS_W: vec4<f32> = vec4<f32>(0.181341892, 0.156853323, 0.111190517, 0.050614268);

struct MicrocylinderThread {
    gamma_s: f32,
    eta2_1: f32,
    surface_k: f32,
    surface_n: f32,
    volume_k: f32,
    volume_n: f32,
    k_d: f32,
    tan_s: f32,
    tan_v: f32,
    f0: f32,
    a: f32,
    colour: vec3<f32>,
}

// Where the pieces of a thread lie in the table, and how many there are.
struct MicrocylinderPieces {
    straight: u32,
    straights: u32,
    sloped: u32,
    slopes: u32,
    mixed: u32,
    mixes: u32,
}

struct MicrocylinderPair {
    wo: vec3<f32>,
    wi: vec3<f32>,
    inverse_o: f32,
    inverse_i: f32,
    psi_o: f32,
    psi_i: f32,
    u_k: f32,
    u_psi: f32,
}

struct MicrocylinderSums {
    surface: f32,
    volume: f32,
    p: f32,
}

fn microcylinder_pieces(t: u32, j: u32) -> MicrocylinderPieces {
    let s1 = u32(table_at(t));
    let s2 = u32(table_at(t + 1u));
    let c1 = u32(table_at(t + 2u));
    let c2 = u32(table_at(t + 3u));
    let m1 = u32(table_at(t + 4u));
    let m2 = u32(table_at(t + 5u));
    let straight = t + MICROCYLINDER_HEAD;
    let sloped = straight + MICROCYLINDER_BLOCK * (s1 + s2);
    let mixed = sloped + MICROCYLINDER_SLOPE * (c1 + c2);
    if (j == 0u) {
        return MicrocylinderPieces(straight, s1, sloped, c1, mixed, m1);
    }
    return MicrocylinderPieces(
        straight + MICROCYLINDER_BLOCK * s1, s2,
        sloped + MICROCYLINDER_SLOPE * c1, c2,
        mixed + MICROCYLINDER_BLOCK * m1, m2,
    );
}

fn microcylinder_four(i: u32) -> vec4<f32> {
    return vec4<f32>(table_at(i), table_at(i + 1u), table_at(i + 2u), table_at(i + 3u));
}

fn microcylinder_sum(v: vec4<f32>) -> f32 {
    return (v.x + v.y) + (v.z + v.w);
}

fn microcylinder_in_thread(j: u32, w: vec3<f32>) -> vec3<f32> {
    if (j == 0u) {
        return w;
    }
    return w.yxz;
}

fn microcylinder_width(gamma: f32) -> f32 {
    let g = min(gamma, 1.05);
    return 1.1 * g * (1.0 + 0.5 * g * g);
}

fn microcylinder_thread(m: Microcylinder, t: u32, j: u32) -> MicrocylinderThread {
    var eta = m.eta_1;
    var colour = m.colour_1;
    var k_d = m.k_d_1;
    var gamma_s = m.gamma_s_1;
    var gamma_v = m.gamma_v_1;
    var a = m.a_1;
    if (j == 1u) {
        eta = m.eta_2;
        colour = m.colour_2;
        k_d = m.k_d_2;
        gamma_s = m.gamma_s_2;
        gamma_v = m.gamma_v_2;
        a = m.a_2;
    }
    gamma_s *= PI / 180.0;
    gamma_v *= PI / 180.0;
    if (m.colour == 1u) {
        let fibre = t + 7u + 3u * j;
        let volume = (1.0 - k_d) * table_at(fibre + 1u) + k_d * table_at(fibre + 2u);
        colour *= max(1.0 - table_at(fibre), 0.0) / volume;
    }
    let f0 = (eta - 1.0) / (eta + 1.0);
    let root_tau = sqrt(TAU);
    return MicrocylinderThread(
        gamma_s,
        eta * eta - 1.0,
        0.5 / (gamma_s * gamma_s),
        1.0 / (root_tau * gamma_s),
        0.5 / (gamma_v * gamma_v),
        (1.0 - k_d) / (root_tau * gamma_v),
        k_d,
        microcylinder_width(gamma_s),
        microcylinder_width(gamma_v),
        f0 * f0,
        a,
        colour,
    );
}

// arctan²(√v) for v in [0, 1].
fn microcylinder_atan2_of_sqrt(v: vec4<f32>) -> vec4<f32> {
    var p = vec4<f32>(0.010036948);
    p = p * v - 0.056258354;
    p = p * v + 0.14742184;
    p = p * v - 0.25193518;
    p = p * v + 0.3392638;
    p = p * v - 0.41584125;
    p = p * v + 0.5108187;
    p = p * v - 0.66665614;
    p = p * v + 0.99999994;
    return p * v;
}

fn microcylinder_fresnel(c: vec4<f32>, eta2_1: f32) -> vec4<f32> {
    let g = sqrt(vec4<f32>(eta2_1) + c * c);
    let sum = g + c;
    let difference = g - c;
    let ratio = difference / sum;
    let p = (c * sum - 1.0) / (c * difference + 1.0);
    return 0.5 * ratio * ratio * (1.0 + p * p);
}

fn microcylinder_correlated(u: vec4<f32>, a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    return a * b + u * (min(a, b) - a * b);
}

// Built-in sin and cos may be off by 2⁻¹¹; these are within 1e-7 for |a| ≤ π/2.
fn microcylinder_sin(a: vec4<f32>) -> vec4<f32> {
    let a2 = a * a;
    var p = vec4<f32>(2.6017497e-6);
    p = p * a2 - 0.00019807350;
    p = p * a2 + 0.0083330242;
    p = p * a2 - 0.16666657;
    p = p * a2 + 1.0;
    return p * a;
}

fn microcylinder_cos(a: vec4<f32>) -> vec4<f32> {
    let a2 = a * a;
    var p = vec4<f32>(-2.6050028e-7);
    p = p * a2 + 2.4760079e-5;
    p = p * a2 - 0.0013888358;
    p = p * a2 + 0.041666636;
    p = p * a2 - 0.5;
    return p * a2 + 1.0;
}

// The sums over four tangents.
fn microcylinder_block(
    physical: bool, sin_a: vec4<f32>, cos_a: vec4<f32>, weight: vec4<f32>, th: MicrocylinderThread, w: MicrocylinderPair,
) -> MicrocylinderSums {
    let tiny = vec4<f32>(MICROCYLINDER_TINY);
    let normal_i = cos_a * w.wi.z - sin_a * w.wi.x;
    let normal_o = cos_a * w.wo.z - sin_a * w.wo.x;
    let seen_i = max(normal_i, vec4<f32>(0.0));
    let seen_o = max(normal_o, vec4<f32>(0.0));
    let s = (cos_a * w.wi.x + sin_a * w.wi.z) + (cos_a * w.wo.x + sin_a * w.wo.z);
    let cos_i = sqrt(max(normal_i * normal_i + w.wi.y * w.wi.y, tiny));
    let cos_o = sqrt(max(normal_o * normal_o + w.wo.y * w.wo.y, tiny));
    let e = cos_i + cos_o;
    let d2 = s * s + e * e;
    let d = sqrt(d2);

    let over_both = 1.0 / (cos_i * cos_o);
    let cos_phi_d = (normal_i * normal_o + w.wi.y * w.wo.y) * over_both;
    let cos_half = sqrt(clamp(0.5 + 0.5 * cos_phi_d, vec4<f32>(0.0), vec4<f32>(1.0)));
    let phi_d2 = 16.0 * microcylinder_atan2_of_sqrt((1.0 - cos_half) / (1.0 + cos_half));
    let shade = microcylinder_correlated(exp(-phi_d2 * w.u_k), seen_i * cos_o * over_both, seen_o * cos_i * over_both);

    let tan_half = s / (d + e);
    let theta_h2 = 4.0 * microcylinder_atan2_of_sqrt(tan_half * tan_half);
    let fresnel = microcylinder_fresnel(0.5 * d * cos_half, th.eta2_1);
    let through = 1.0 - fresnel;
    let lobe_s = exp(-theta_h2 * th.surface_k) * th.surface_n;
    let lobe_v = exp(-theta_h2 * th.volume_k) * th.volume_n + th.k_d;

    var rest = weight * cos_o;
    var p = vec4<f32>(0.0);
    if (!physical) {
        p = weight * microcylinder_correlated(vec4<f32>(w.u_psi), seen_i * w.inverse_i, seen_o * w.inverse_o);
        rest = p;
    }
    let gain = rest * shade * cos_i * 4.0 / (d2 * e);
    return MicrocylinderSums(
        microcylinder_sum(gain * e * fresnel * cos_half * lobe_s),
        microcylinder_sum(gain * through * through * lobe_v),
        microcylinder_sum(p),
    );
}

fn microcylinder_sums(
    physical: bool, pieces: MicrocylinderPieces, th: MicrocylinderThread, w: MicrocylinderPair,
) -> MicrocylinderSums {
    var surface = 0.0;
    var volume = 0.0;
    var p = 0.0;
    for (var k = 0u; k < pieces.straights; k++) {
        let i = pieces.straight + MICROCYLINDER_BLOCK * k;
        let b = microcylinder_block(
            physical, microcylinder_four(i), microcylinder_four(i + 4u), microcylinder_four(i + 8u), th, w,
        );
        surface += b.surface;
        volume += b.volume;
        p += b.p;
    }
    if (pieces.slopes == 0u) {
        return MicrocylinderSums(surface, volume, p);
    }

    // Kinks along the curve, and the lengths over which the kernel comes and goes at its ends.
    let lo = min(w.psi_o, w.psi_i);
    let hi = max(w.psi_o, w.psi_i);
    let begin = -0.5 * PI - lo;
    let end = 0.5 * PI - hi;
    let mirror = 0.5 * (begin + end);
    let yo = abs(w.wo.y);
    let yi = abs(w.wi.y);
    let across = w.wi.x * yo - w.wo.x * yi;
    var equal = begin;
    if (across != 0.0) {
        equal = min(max(atan((w.wi.z * yo - w.wo.z * yi) / across), begin), end);
    }
    let near_o = max(yo * w.inverse_o, 0.01);
    let near_i = max(yi * w.inverse_i, 0.01);
    let first = select(near_i, near_o, w.psi_o < w.psi_i);
    let last = select(near_o, near_i, w.psi_o < w.psi_i);
    let rise = min(first, hi - lo + last);
    let fall = min(last, hi - lo + first);
    var kinks = array<f32, 4>(begin, min(mirror, equal), max(mirror, equal), end);
    let stretch = min(MICROCYLINDER_STRETCH, MICROCYLINDER_STRETCH_GAMMA * th.gamma_s);

    for (var k = 0u; k < pieces.slopes; k++) {
        let i = pieces.sloped + MICROCYLINDER_SLOPE * k;
        let start = table_at(i);
        let stop = table_at(i + 1u);
        let density = table_at(i + 6u) / (stop - start);
        for (var part = 0u; part < 3u; part++) {
            var at = max(kinks[part], start);
            let next = min(kinks[part + 1u], stop);
            while (at < next) {
                let whole = next - at;
                let limit = min(3.0 * rise + 6.0 * (at - begin), (3.0 * fall + 6.0 * (end - at)) / 7.0);
                var reach = min(limit, whole / ceil(whole / stretch));
                if (limit >= whole && whole <= stretch) {
                    reach = whole;
                }
                let half = 0.5 * reach;
                for (var side = 0u; side < 2u; side++) {
                    let alpha = at + half + select(half, -half, side == 0u) * MICROCYLINDER_GAUSS_X;
                    let weight = MICROCYLINDER_GAUSS_W * (2.0 * half * density);
                    let b = microcylinder_block(
                        physical, microcylinder_sin(alpha), microcylinder_cos(alpha), weight, th, w,
                    );
                    surface += b.surface;
                    volume += b.volume;
                    p += b.p;
                }
                let after = at + reach;
                at = select(after, next, next - after < 1e-5);
            }
        }
    }
    return MicrocylinderSums(surface, volume, p);
}

// t·w at an end of a sloped piece, or its greatest value where that end is unlit.
fn microcylinder_end(sin_a: f32, cos_a: f32, full: f32, w: vec3<f32>) -> f32 {
    let along = cos_a * w.x + sin_a * w.z;
    if (cos_a * w.z - sin_a * w.x > 0.0) {
        return along;
    }
    return select(full, -full, along < 0.0);
}

fn microcylinder_area(pieces: MicrocylinderPieces, w: vec3<f32>) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < pieces.straights; k++) {
        let i = pieces.straight + MICROCYLINDER_BLOCK * k;
        let seen = max(microcylinder_four(i + 4u) * w.z - microcylinder_four(i) * w.x, vec4<f32>(0.0));
        sum += dot(microcylinder_four(i + 8u), seen);
    }
    let full = sqrt(w.x * w.x + w.z * w.z);
    for (var k = 0u; k < pieces.slopes; k++) {
        let i = pieces.sloped + MICROCYLINDER_SLOPE * k;
        let upper = microcylinder_end(table_at(i + 3u), table_at(i + 5u), full, w);
        let lower = microcylinder_end(table_at(i + 2u), table_at(i + 4u), full, w);
        sum += table_at(i + 6u) * (upper - lower) / (table_at(i + 1u) - table_at(i));
    }
    return sum;
}

fn microcylinder_eval(m: Microcylinder, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    let physical = m.form == MICROCYLINDER_PHYSICAL;
    let sigma = m.sigma * (PI / 180.0);
    let u_k = 0.5 / (sigma * sigma);
    var f = vec3<f32>(0.0);
    var q = 0.0;
    var area_i = 0.0;
    var area_o = 0.0;
    for (var j = 0u; j < 2u; j++) {
        let th = microcylinder_thread(m, t, j);
        let o = microcylinder_in_thread(j, wo);
        let i = microcylinder_in_thread(j, wi);
        let psi_o = atan2(o.x, o.z);
        let psi_i = atan2(i.x, i.z);
        let psi_d = psi_i - psi_o;
        let w = MicrocylinderPair(
            o, i,
            1.0 / sqrt(max(o.x * o.x + o.z * o.z, MICROCYLINDER_TINY)),
            1.0 / sqrt(max(i.x * i.x + i.z * i.z, MICROCYLINDER_TINY)),
            psi_o, psi_i, u_k, exp(-psi_d * psi_d * u_k),
        );
        let pieces = microcylinder_pieces(t, j);
        let s = microcylinder_sums(physical, pieces, th, w);
        if (physical) {
            area_i += th.a * microcylinder_area(pieces, i);
            area_o += th.a * microcylinder_area(pieces, o);
        }
        q += th.a * s.p;
        f += th.a * (vec3<f32>(s.surface) + th.colour * s.volume);
    }
    if (physical) {
        return f * (table_at(t + 6u) / (max(area_i, wi.z) * max(area_o, wo.z)));
    }
    q += max(1.0 - m.a_1 - m.a_2, 0.0) * select(wi.z, wo.z, m.gap == 0u);
    if (q <= 0.0) {
        return vec3<f32>(0.0);
    }
    return f / (q * wi.z);
}

// Lobe weights of four tangents for the viewer, before normalisation, and the tangents' θ_o.
struct MicrocylinderSeen {
    sin_theta: vec4<f32>,
    cos_theta: vec4<f32>,
    surface: vec4<f32>,
    volume: vec4<f32>,
    even: vec4<f32>,
}

fn microcylinder_seen(physical: bool, i: u32, th: MicrocylinderThread, wo: vec3<f32>) -> MicrocylinderSeen {
    let sin_a = microcylinder_four(i);
    let cos_a = microcylinder_four(i + 4u);
    let normal = max(cos_a * wo.z - sin_a * wo.x, vec4<f32>(0.0));
    let sin_theta = cos_a * wo.x + sin_a * wo.z;
    let cos_theta = sqrt(max(normal * normal + wo.y * wo.y, vec4<f32>(MICROCYLINDER_TINY)));
    let area = th.a * microcylinder_four(i + 8u) * select(normal * normal / cos_theta, normal, physical);
    let grazing = max(1.0 - cos_theta, vec4<f32>(0.0));
    let grazing2 = grazing * grazing;
    let fresnel = vec4<f32>(th.f0) + (1.0 - th.f0) * grazing2 * grazing2 * grazing;
    let mean = (th.colour.x + th.colour.y + th.colour.z) / 3.0;
    let through = (1.0 - fresnel) * (1.0 - fresnel) * mean;
    let lobe = through * (1.0 - th.k_d) / max(cos_theta, vec4<f32>(0.1));
    return MicrocylinderSeen(sin_theta, cos_theta, area * 1.9 * fresnel, area * lobe, area * 0.9 * through * th.k_d);
}

fn microcylinder_range(sin_theta: vec4<f32>, cos_theta: vec4<f32>, tan_gamma: f32) -> array<vec4<f32>, 2> {
    let width = cos_theta * cos_theta * (tan_gamma * tan_gamma) + MICROCYLINDER_TINY;
    let up = max(1.0 + sin_theta, vec4<f32>(0.0));
    let down = max(1.0 - sin_theta, vec4<f32>(0.0));
    return array<vec4<f32>, 2>(-down / sqrt(width + down * down), up / sqrt(width + up * up));
}

fn microcylinder_scale(physical: bool, wo: vec3<f32>) -> f32 {
    if (physical) {
        return 1.0;
    }
    return 1.0 / sqrt(max(wo.x * wo.x + wo.z * wo.z, MICROCYLINDER_TINY));
}

fn microcylinder_pdf(m: Microcylinder, t: u32, wo_cloth: vec3<f32>, wi_cloth: vec3<f32>) -> f32 {
    if (wo_cloth.z <= 0.0 || wi_cloth.z <= 0.0) {
        return 0.0;
    }
    let physical = m.form == MICROCYLINDER_PHYSICAL;
    var total = 0.0;
    var density = 0.0;
    for (var j = 0u; j < 2u; j++) {
        let th = microcylinder_thread(m, t, j);
        let wo = microcylinder_in_thread(j, wo_cloth);
        let wi = microcylinder_in_thread(j, wi_cloth);
        let pieces = microcylinder_pieces(t, j);
        let scale_j = microcylinder_scale(physical, wo);
        for (var k = 0u; k < pieces.mixes; k++) {
            let i = pieces.mixed + MICROCYLINDER_BLOCK * k;
            let seen = microcylinder_seen(physical, i, th, wo);
            total += scale_j * microcylinder_sum(seen.surface + seen.volume + seen.even);
            let sin_a = microcylinder_four(i);
            let cos_a = microcylinder_four(i + 4u);
            let normal_i = cos_a * wi.z - sin_a * wi.x;
            let s = (cos_a * wi.x + sin_a * wi.z) + seen.sin_theta;
            let cos_i = sqrt(max(normal_i * normal_i + wi.y * wi.y, vec4<f32>(MICROCYLINDER_TINY)));
            let e = cos_i + seen.cos_theta;
            let s2 = s * s;
            let e2 = e * e;
            let scale = 0.25 * e * (s2 + e2) / cos_i;
            var sum = seen.even * 0.5;
            for (var lobe = 0u; lobe < 2u; lobe++) {
                let tan_gamma = select(th.tan_v, th.tan_s, lobe == 0u);
                let weight = select(seen.volume, seen.surface, lobe == 0u);
                var range = microcylinder_range(seen.sin_theta, seen.cos_theta, tan_gamma);
                let r2 = e2 * (tan_gamma * tan_gamma) + s2;
                sum += weight * scale * (2.0 * tan_gamma * tan_gamma) / (r2 * sqrt(r2) * (range[1] - range[0]));
            }
            density += scale_j * microcylinder_sum(0.5 * max(normal_i, vec4<f32>(0.0)) / cos_i * sum);
        }
    }
    if (total <= 0.0) {
        return 0.0;
    }
    return (1.0 - MICROCYLINDER_EVEN) * density / total + MICROCYLINDER_EVEN / TAU;
}

// Draws wi; it may lie below the horizon. A share of the draws is even over the hemisphere.
fn microcylinder_direction(m: Microcylinder, t: u32, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    if (u.z < MICROCYLINDER_EVEN) {
        let r = sqrt(max(1.0 - u.x * u.x, 0.0));
        return vec3<f32>(r * cos(TAU * u.y), r * sin(TAU * u.y), u.x);
    }
    let physical = m.form == MICROCYLINDER_PHYSICAL;
    var total = 0.0;
    for (var j = 0u; j < 2u; j++) {
        let th = microcylinder_thread(m, t, j);
        let o = microcylinder_in_thread(j, wo);
        let pieces = microcylinder_pieces(t, j);
        for (var k = 0u; k < pieces.mixes; k++) {
            let seen = microcylinder_seen(physical, pieces.mixed + MICROCYLINDER_BLOCK * k, th, o);
            total += microcylinder_sum(microcylinder_scale(physical, o) * (seen.surface + seen.volume + seen.even));
        }
    }

    // A tangent and a lobe in proportion to their weights.
    var left = (u.z - MICROCYLINDER_EVEN) / (1.0 - MICROCYLINDER_EVEN) * total;
    var found = false;
    var thread = 0u;
    var tangent = vec2<f32>(0.0, 1.0);
    var sin_o = 0.0;
    var cos_o = 1.0;
    var chosen = 0u;
    var tan_gamma = 0.0;
    var done = false;
    for (var j = 0u; j < 2u && !done; j++) {
        let th = microcylinder_thread(m, t, j);
        let o = microcylinder_in_thread(j, wo);
        let pieces = microcylinder_pieces(t, j);
        let scale = microcylinder_scale(physical, o);
        for (var k = 0u; k < pieces.mixes && !done; k++) {
            let i = pieces.mixed + MICROCYLINDER_BLOCK * k;
            let seen = microcylinder_seen(physical, i, th, o);
            let sum = microcylinder_sum(scale * (seen.surface + seen.volume + seen.even));
            if (sum <= 0.0) {
                continue;
            }
            let within = left < sum;
            for (var lane = 0u; lane < 4u && !done; lane++) {
                for (var lobe = 0u; lobe < 3u && !done; lobe++) {
                    var w = scale * seen.surface[lane];
                    var width = th.tan_s;
                    if (lobe == 1u) {
                        w = scale * seen.volume[lane];
                        width = th.tan_v;
                    } else if (lobe == 2u) {
                        w = scale * seen.even[lane];
                        width = 0.0;
                    }
                    if (w <= 0.0) {
                        continue;
                    }
                    found = true;
                    thread = j;
                    tangent = vec2<f32>(table_at(i + lane), table_at(i + 4u + lane));
                    sin_o = seen.sin_theta[lane];
                    cos_o = seen.cos_theta[lane];
                    chosen = lobe;
                    tan_gamma = width;
                    done = within && left < w;
                    left -= select(0.0, w, within);
                }
            }
            done = done || within;
            left -= sum;
        }
    }
    if (!found) {
        return vec3<f32>(0.0);
    }

    var sin_i = 2.0 * u.x - 1.0;
    var cos_i = sqrt(max(1.0 - sin_i * sin_i, 0.0));
    if (chosen != 2u) {
        var range = microcylinder_range(vec4<f32>(sin_o), vec4<f32>(cos_o), tan_gamma);
        let x = range[0].x + u.x * (range[1].x - range[0].x);
        let c2 = max(1.0 - x * x, 0.0);
        let s2 = tan_gamma * tan_gamma * x * x;
        let cos_2h = (c2 - s2) / (c2 + s2);
        let sin_2h = 2.0 * tan_gamma * x * sqrt(c2) / (c2 + s2);
        sin_i = sin_2h * cos_o - cos_2h * sin_o;
        cos_i = max(cos_2h * cos_o + sin_2h * sin_o, 0.0);
    }
    let sin_phi = 2.0 * u.y - 1.0;
    let across = cos_i * sqrt(max(1.0 - sin_phi * sin_phi, 0.0));
    let local = vec3<f32>(
        tangent.y * sin_i - tangent.x * across,
        cos_i * sin_phi,
        tangent.x * sin_i + tangent.y * across,
    );
    return normalize(microcylinder_in_thread(thread, local));
}

fn microcylinder_sample(m: Microcylinder, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let wi = microcylinder_direction(m, t, wo, u);
    if (wi.z <= 0.0) {
        return bsdf_no_sample();
    }
    let pdf = microcylinder_pdf(m, t, wo, wi);
    if (!(pdf > 0.0)) {
        return bsdf_no_sample();
    }
    return BsdfSample(wi, pdf, microcylinder_eval(m, t, wo, wi) * (wi.z / pdf), 1.0, 0u);
}
