// Twin of rgl.rs: ten numbers of sizes, the axes of the eye, the grids of ndf, sigma, vndf and luminance (the last two
// followed by their sums), red, green and blue, and the count of symmetric sectors.

// The measured eye directions around one, with their weights: two where the azimuth lies on an entry or there is but
// one, else four. Loops over them keep the shader small, which software compilers thank for.
struct RglSlices {
    at: vec4<u32>,
    weight: vec4<f32>,
    count: u32,
}

// A grid in the table: values, sums along rows, sums over rows.
struct RglWarp {
    width: u32,
    height: u32,
    values: u32,
    along: u32,
    over: u32,
}

struct RglView {
    n_phi: u32,
    n_theta: u32,
    phi: u32,
    theta: u32,
    ndf: RglWarp,
    sigma: RglWarp,
    vndf: RglWarp,
    luminance: RglWarp,
    rgb: u32,
    jacobian: bool,
    isotropic: bool,
    reduction: u32,
}

// A cell of a grid, and where in it.
struct RglCell {
    i: u32,
    j: u32,
    t: vec2<f32>,
}

// A point of the square, and the density there.
struct RglPoint {
    p: vec2<f32>,
    density: f32,
}

fn rgl_warp(width: u32, height: u32, slices: u32, values: u32) -> RglWarp {
    let all = width * height * slices;
    return RglWarp(width, height, values, values + all, values + 2u * all);
}

fn rgl_view(t: u32) -> RglView {
    let n_phi = u32(table_at(t));
    let n_theta = u32(table_at(t + 1u));
    let slices = n_phi * n_theta;
    let ndf = rgl_warp(u32(table_at(t + 2u)), u32(table_at(t + 3u)), 1u, t + 10u + n_phi + n_theta);
    let sigma = rgl_warp(u32(table_at(t + 4u)), u32(table_at(t + 5u)), 1u, ndf.along);
    let vndf = rgl_warp(u32(table_at(t + 6u)), u32(table_at(t + 7u)), slices, sigma.along);
    let n = u32(table_at(t + 8u));
    let luminance = rgl_warp(n, n, slices, vndf.over + vndf.height * slices);
    let rgb = luminance.over + n * slices;
    let reduction = u32(table_at(rgb + 3u * n * n * slices));
    let jacobian = table_at(t + 9u) != 0.0;
    return RglView(
        n_phi, n_theta, t + 10u, t + 10u + n_phi, ndf, sigma, vndf, luminance, rgb, jacobian, n_phi <= 2u, reduction,
    );
}

fn rgl_slices(v: RglView, phi: f32, theta: f32) -> RglSlices {
    let y = axis_clamped(v.phi, v.n_phi, phi);
    let x = axis_clamped(v.theta, v.n_theta, theta);
    return RglSlices(
        vec4<u32>(y.low, y.low, y.high, y.high) * v.n_theta + vec4<u32>(x.low, x.high, x.low, x.high),
        vec4<f32>(1.0 - y.t, 1.0 - y.t, y.t, y.t) * vec4<f32>(1.0 - x.t, x.t, 1.0 - x.t, x.t),
        select(4u, 2u, y.t == 0.0),
    );
}

fn rgl_mix(s: RglSlices, start: u32, stride: u32, i: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < s.count; k++) {
        sum += s.weight[k] * table_at(start + s.at[k] * stride + i);
    }
    return sum;
}

fn rgl_cell(w: RglWarp, p: vec2<f32>) -> RglCell {
    let q = clamp(p, vec2<f32>(0.0), vec2<f32>(1.0)) * vec2<f32>(f32(w.width - 1u), f32(w.height - 1u));
    let i = min(u32(q.x), w.width - 2u);
    let j = min(u32(q.y), w.height - 2u);
    return RglCell(i, j, q - vec2<f32>(f32(i), f32(j)));
}

// Values at the left and right border of a cell, at `y` between its rows.
fn rgl_edges(w: RglWarp, s: RglSlices, i: u32, j: u32, y: f32) -> vec2<f32> {
    let stride = w.width * w.height;
    let at = j * w.width + i;
    let low = vec2<f32>(rgl_mix(s, w.values, stride, at), rgl_mix(s, w.values, stride, at + 1u));
    let next = at + w.width;
    let high = vec2<f32>(rgl_mix(s, w.values, stride, next), rgl_mix(s, w.values, stride, next + 1u));
    return (1.0 - y) * low + y * high;
}

// Sum along row `j` up to node `i`.
fn rgl_sum(w: RglWarp, s: RglSlices, i: u32, j: u32) -> f32 {
    return rgl_mix(s, w.along, w.width * w.height, j * w.width + i);
}

fn rgl_density(w: RglWarp, s: RglSlices, p: vec2<f32>) -> f32 {
    let c = rgl_cell(w, p);
    let edges = rgl_edges(w, s, c.i, c.j, c.t.y);
    return edges.x + c.t.x * (edges.y - edges.x);
}

// Of a grid without slices.
fn rgl_plain(w: RglWarp, p: vec2<f32>) -> f32 {
    let c = rgl_cell(w, p);
    let at = w.values + c.j * w.width + c.i;
    let next = at + w.width;
    let low = vec2<f32>(table_at(at), table_at(at + 1u));
    let edges = (1.0 - c.t.y) * low + c.t.y * vec2<f32>(table_at(next), table_at(next + 1u));
    return edges.x + c.t.x * (edges.y - edges.x);
}

// Where the integral of a line from `a` (at 0) to `b` (at 1) reaches `area`.
fn rgl_solve(a: f32, b: f32, area: f32) -> f32 {
    let sum = a + sqrt(max(a * a + 2.0 * max(area, 0.0) * (b - a), 0.0));
    if (sum > 0.0) {
        return clamp(2.0 * area / sum, 0.0, 1.0);
    }
    return 0.5;
}

fn rgl_cells(w: RglWarp) -> f32 {
    return f32((w.width - 1u) * (w.height - 1u));
}

// The sum over rows before row `j`, of whatever row; and along the mix `y` of rows `j`, `j` + 1 before node `i`.
fn rgl_over(w: RglWarp, s: RglSlices, j: u32) -> f32 {
    return rgl_mix(s, w.over, w.height, j);
}

fn rgl_along(w: RglWarp, s: RglSlices, i: u32, j: u32, y: f32) -> f32 {
    return (1.0 - y) * rgl_sum(w, s, i, j) + y * rgl_sum(w, s, i, j + 1u);
}

fn rgl_warp_sample(w: RglWarp, s: RglSlices, u: vec2<f32>) -> RglPoint {
    var j = 0u;
    var high = w.height - 1u;
    while (high - j > 1u) {
        let middle = (j + high) / 2u;
        if (rgl_over(w, s, middle) <= u.y) {
            j = middle;
        } else {
            high = middle;
        }
    }
    let r0 = rgl_sum(w, s, w.width - 1u, j);
    let r1 = rgl_sum(w, s, w.width - 1u, j + 1u);
    let y = rgl_solve(r0, r1, u.y - rgl_over(w, s, j));
    let wanted = u.x * ((1.0 - y) * r0 + y * r1);
    var i = 0u;
    high = w.width - 1u;
    while (high - i > 1u) {
        let middle = (i + high) / 2u;
        if (rgl_along(w, s, middle, j, y) <= wanted) {
            i = middle;
        } else {
            high = middle;
        }
    }
    let edges = rgl_edges(w, s, i, j, y);
    let cells = rgl_cells(w);
    let x = rgl_solve(edges.x / cells, edges.y / cells, wanted - rgl_along(w, s, i, j, y));
    return RglPoint(
        vec2<f32>((f32(i) + x) / f32(w.width - 1u), (f32(j) + y) / f32(w.height - 1u)),
        edges.x + x * (edges.y - edges.x),
    );
}

fn rgl_warp_invert(w: RglWarp, s: RglSlices, p: vec2<f32>) -> RglPoint {
    let c = rgl_cell(w, p);
    let edges = rgl_edges(w, s, c.i, c.j, c.t.y);
    let r0 = rgl_sum(w, s, w.width - 1u, c.j);
    let r1 = rgl_sum(w, s, w.width - 1u, c.j + 1u);
    let row = (1.0 - c.t.y) * r0 + c.t.y * r1;
    let slope = edges.y - edges.x;
    let x = rgl_along(w, s, c.i, c.j, c.t.y) + c.t.x * (edges.x + 0.5 * c.t.x * slope) / rgl_cells(w);
    let y = rgl_over(w, s, c.j) + c.t.y * (r0 + 0.5 * c.t.y * (r1 - r0));
    return RglPoint(vec2<f32>(select(0.5, x / row, row > 0.0), y), edges.x + c.t.x * slope);
}

fn rgl_direction(u: vec2<f32>, turn: f32) -> vec3<f32> {
    return spherical(u.x * u.x * HALF_PI, (2.0 * u.y - 1.0) * PI + turn);
}

fn rgl_square(theta: f32, phi: f32) -> vec2<f32> {
    return vec2<f32>(sqrt(theta / HALF_PI), (phi + PI) / TAU);
}

fn rgl_square_to_sphere(u: f32) -> f32 {
    return 2.0 * PI * PI * u * sin(u * u * HALF_PI);
}

// Signs that turn the eye into the measured sector, which starts at -pi.
fn rgl_signs(v: RglView, wo: vec3<f32>) -> vec3<f32> {
    let flip = select(vec2<f32>(-1.0), vec2<f32>(1.0), wo.xy < vec2<f32>(0.0));
    switch v.reduction {
        case 2u: { return vec3<f32>(flip.y, flip.y, 1.0); }
        case 4u: { return vec3<f32>(flip, 1.0); }
        default: { return vec3<f32>(1.0); }
    }
}

fn rgl_azimuth(v: RglView, wo: vec3<f32>) -> f32 {
    if (v.reduction == 1u) {
        return azimuth(wo);
    }
    if (wo.x == 0.0 && wo.y == 0.0) {
        return -PI;
    }
    return -atan2(abs(wo.y), wo.x);
}

// f cos of the light from the points of both squares.
fn rgl_value(v: RglView, s: RglSlices, p: vec2<f32>, u_h: vec2<f32>, u_o: vec2<f32>) -> vec3<f32> {
    let n = v.luminance.width;
    let c = rgl_cell(v.luminance, p);
    let at = c.j * n + c.i;
    var rgb = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let start = v.rgb + k * n * n;
        let stride = 3u * n * n;
        let low = mix(rgl_mix(s, start, stride, at), rgl_mix(s, start, stride, at + 1u), c.t.x);
        let high = mix(rgl_mix(s, start, stride, at + n), rgl_mix(s, start, stride, at + n + 1u), c.t.x);
        rgb[k] = max(mix(low, high, c.t.y), 0.0);
    }
    if (!v.jacobian) {
        return rgb;
    }
    let sigma = rgl_plain(v.sigma, u_o);
    if (sigma > 0.0) {
        return rgb * (rgl_plain(v.ndf, u_h) / (4.0 * sigma));
    }
    return vec3<f32>(0.0);
}

fn rgl_eval_pdf(m: Rgl, t: u32, eye: vec3<f32>, light: vec3<f32>) -> vec4<f32> {
    if (eye.z <= 0.0 || light.z <= 0.0) {
        return vec4<f32>(0.0);
    }
    let v = rgl_view(t);
    let signs = rgl_signs(v, eye);
    let wo = eye * signs;
    let h = wo + light * signs;
    let theta_o = polar_angle(wo);
    let phi_o = rgl_azimuth(v, wo);
    let around = rgl_square(polar_angle(h), azimuth(h) - select(0.0, phi_o, v.isotropic));
    let u_h = vec2<f32>(around.x, around.y - floor(around.y));
    let s = rgl_slices(v, phi_o, theta_o);
    let point = rgl_warp_invert(v.vndf, s, u_h);
    let density = point.density * rgl_density(v.luminance, s, point.p);
    let jacobian = max(rgl_square_to_sphere(u_h.x), 1e-6) * 2.0 * length(h);
    let value = rgl_value(v, s, point.p, u_h, rgl_square(theta_o, phi_o));
    return vec4<f32>(value * (m.scale / light.z), select(0.0, density / jacobian, jacobian > 0.0));
}

fn rgl_sample(m: Rgl, t: u32, eye: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (eye.z <= 0.0) {
        return bsdf_no_sample();
    }
    let v = rgl_view(t);
    let signs = rgl_signs(v, eye);
    let wo = eye * signs;
    let phi_o = rgl_azimuth(v, wo);
    let s = rgl_slices(v, phi_o, polar_angle(wo));
    let p = rgl_warp_sample(v.luminance, s, u.xy).p;
    let h = rgl_direction(rgl_warp_sample(v.vndf, s, p).p, select(0.0, phi_o, v.isotropic));
    let wi = normalize(reflect_about(wo, h) * signs);
    let f = rgl_eval_pdf(m, t, eye, wi);
    return bsdf_sample_of(eye, wi, f.xyz, f.w);
}
