// Water and ink in paper: twin of flow.rs, step for step.

struct Flow {
    size: vec2<u32>,
    relaxation: f32,
    thin: f32,
    pinning: f32,
    evaporation: f32,
    evaporation_at_front: f32,
    fixing: f32,
}

@group(0) @binding(0) var<uniform> flow: Flow;
// How easily water passes.
@group(0) @binding(1) var<storage, read> open: array<f32>;
// Nine populations of each cell, all of one kind behind each other.
@group(0) @binding(2) var<storage, read> populations: array<f32>;
// Water, flowing ink, what blocks, fixed ink.
@group(0) @binding(3) var<storage, read> cells: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> next_populations: array<f32>;
@group(0) @binding(5) var<storage, read_write> next_cells: array<vec4<f32>>;

const E = array<vec2<i32>, 9>(
    vec2<i32>(0, 0), vec2<i32>(1, 0), vec2<i32>(-1, 0), vec2<i32>(0, 1), vec2<i32>(0, -1),
    vec2<i32>(1, 1), vec2<i32>(-1, -1), vec2<i32>(1, -1), vec2<i32>(-1, 1),
);
const W = array<f32, 9>(
    0.4444444444444444, 0.1111111111111111, 0.1111111111111111, 0.1111111111111111, 0.1111111111111111,
    0.02777777777777778, 0.02777777777777778, 0.02777777777777778, 0.02777777777777778,
);
const OPPOSITE = array<u32, 9>(0u, 2u, 1u, 4u, 3u, 6u, 5u, 8u, 7u);
const NONE: u32 = 0xffffffffu;

fn neighbour(at: vec2<i32>, e: vec2<i32>) -> u32 {
    let p = at + e;
    if (p.x < 0 || p.y < 0 || p.x >= i32(flow.size.x) || p.y >= i32(flow.size.y)) {
        return NONE;
    }
    return u32(p.y) * flow.size.x + u32(p.x);
}

fn concentration(c: vec4<f32>) -> f32 {
    return select(0.0, c.y / c.x, c.x > 0.0);
}

fn blocking(at: vec2<i32>, i: u32) -> f32 {
    let own = 1.0 - open[i];
    if (cells[i].x > 1e-4) {
        return own;
    }
    var pushed = false;
    for (var k = 1u; k < 9u; k++) {
        var e = E;
        let limit = flow.pinning * select(1.0, 1.4142135, k > 4u) * (0.5 + own);
        let j = neighbour(at, e[k]);
        if (j != NONE) {
            pushed = pushed || cells[j].x > limit;
        }
    }
    return select(2.0, own, pushed);
}

// Before the first step: populations at rest, and what blocks.
@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= flow.size.x || id.y >= flow.size.y) {
        return;
    }
    let i = id.y * flow.size.x + id.x;
    let count = flow.size.x * flow.size.y;
    var c = cells[i];
    c.z = blocking(vec2<i32>(id.xy), i);
    c.w = 0.0;
    next_cells[i] = c;
    var w = W;
    for (var k = 0u; k < 9u; k++) {
        next_populations[k * count + i] = w[k] * c.x;
    }
}

@compute @workgroup_size(8, 8)
fn step(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= flow.size.x || id.y >= flow.size.y) {
        return;
    }
    let at = vec2<i32>(id.xy);
    let i = id.y * flow.size.x + id.x;
    let count = flow.size.x * flow.size.y;
    let own = cells[i];
    let here = concentration(own);
    var e = E;
    var w = W;
    var opposite = OPPOSITE;
    var f: array<f32, 9>;
    f[0] = populations[i];
    var ink = f[0] * here + select(own.y, 0.0, own.x > 0.0);
    var front = false;
    var full = f[0];
    for (var k = 1u; k < 9u; k++) {
        let j = neighbour(at, -e[k]);
        var block = 1.0;
        var there = vec4<f32>(0.0);
        if (j != NONE) {
            there = cells[j];
            front = front || there.z > 1.0;
            block = select(0.5 * (own.z + there.z), 1.0, own.z > 1.0 || there.z > 1.0);
        }
        let back = populations[opposite[k] * count + i] * block;
        f[k] = back;
        ink += back * here;
        if (j != NONE && block < 1.0) {
            let came = populations[k * count + j] * (1.0 - block);
            f[k] += came;
            ink += came * concentration(there);
        }
        full += f[k];
    }
    let loss = flow.evaporation + select(0.0, flow.evaporation_at_front, front);
    let rho = full * (1.0 - loss);
    let settling = select(min(flow.fixing * clamp(1.0 - rho, 0.0, 1.0), 1.0), 1.0, rho < 1e-4);
    let settled = ink * settling;
    next_cells[i] = vec4<f32>(rho, ink - settled, blocking(at, i), own.w + settled);

    var u = vec2<f32>(0.0);
    for (var k = 0u; k < 9u; k++) {
        f[k] *= 1.0 - loss;
        u += vec2<f32>(e[k]) * f[k];
    }
    u = select(vec2<f32>(0.0), u / rho, rho > 0.0);
    let t = clamp(rho / flow.thin, 0.0, 1.0);
    let psi = t * t * (3.0 - 2.0 * t);
    var sum = 0.0;
    for (var k = 0u; k < 9u; k++) {
        let eu = dot(vec2<f32>(e[k]), u);
        let eq = w[k] * (rho + psi * (3.0 * eu + 4.5 * eu * eu - 1.5 * dot(u, u)));
        f[k] = max(f[k] + flow.relaxation * (eq - f[k]), 0.0);
        sum += f[k];
    }
    let scale = select(0.0, rho / sum, sum > 0.0 && rho > 0.0);
    for (var k = 0u; k < 9u; k++) {
        next_populations[k * count + i] = f[k] * scale;
    }
}
