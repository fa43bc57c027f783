// Volumes that emit and absorb along a ray. Their light on surfaces comes from emitters; here they are only seen.

struct FlameRow {
    // The world to the box of the grid, 0 to 1.
    to_unit: array<vec4<f32>, 3>,
    // The box in the texture: a corner and the edges. In w: factors of emission and of absorption, per scene unit.
    corner: vec4<f32>,
    edges: vec4<f32>,
    // Of the grid.
    cells: vec4<f32>,
}

struct Flames {
    // Of the paper's lighting: the centre of its ambient map, and what its values count.
    map: vec4<f32>,
    rows: array<FlameRow, FLAMES>,
}

// Most steps through one volume.
const FLAME_STEPS: f32 = 256.0;

@group(3) @binding(0) var<uniform> flames: Flames;
@group(3) @binding(1) var flame_cells: texture_3d<f32>;
@group(3) @binding(2) var flame_sampler: sampler;

fn ambient_map() -> vec4<f32> {
    return flames.map;
}

// Where a ray enters and leaves a volume, and its direction there; y <= x: never.
fn flame_crossing(i: u32, origin: vec3<f32>, dir: vec3<f32>, reach: f32) -> vec2<f32> {
    let o = flame_point(i, vec4<f32>(origin, 1.0));
    let d = flame_point(i, vec4<f32>(dir, 0.0));
    // The outermost cells are empty: beyond their centres there is nothing.
    let border = 0.5 / flames.rows[i].cells.xyz;
    let inverse = 1.0 / select(d, vec3<f32>(1e-20), abs(d) < vec3<f32>(1e-20));
    let a = (border - o) * inverse;
    let b = (1.0 - border - o) * inverse;
    let low = min(a, b);
    let high = max(a, b);
    return vec2<f32>(max(max(low.x, low.y), max(low.z, 0.0)), min(min(high.x, high.y), min(high.z, reach)));
}

fn flame_point(i: u32, p: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(flames.rows[i].to_unit[0], p),
        dot(flames.rows[i].to_unit[1], p),
        dot(flames.rows[i].to_unit[2], p),
    );
}

// Light that comes to `origin` from volumes up to the distance `reach` (xyz), and what part of that behind comes through (w).
// `u`: where in each step they are looked at, 0 to 1.
fn flames_along(origin: vec3<f32>, dir: vec3<f32>, reach: f32, u: f32) -> vec4<f32> {
    var light = vec3<f32>(0.0);
    var through = 1.0;
    var last = -1.0;
    var last_index = 0u;
    for (var n = 0u; n < FLAMES && through > 1e-3; n += 1u) {
        // The next by where the ray enters.
        var span = vec2<f32>(1e30, 0.0);
        var next = FLAMES;
        for (var i = 0u; i < FLAMES; i += 1u) {
            let s = flame_crossing(i, origin, dir, reach);
            let later = s.x > last || (s.x == last && i > last_index);
            if (s.x < s.y && later && s.x < span.x) {
                span = s;
                next = i;
            }
        }
        if (next == FLAMES) {
            break;
        }
        last = span.x;
        last_index = next;
        let row = flames.rows[next];
        let d = flame_point(next, vec4<f32>(dir, 0.0));
        let o = flame_point(next, vec4<f32>(origin, 1.0));
        let crossed = length(d * row.cells.xyz) * (span.y - span.x);
        let steps = clamp(ceil(crossed), 1.0, FLAME_STEPS);
        let step = (span.y - span.x) / steps;
        for (var k = 0.0; k < steps; k += 1.0) {
            let p = o + d * (span.x + (k + u) * step);
            let cell = textureSampleLevel(flame_cells, flame_sampler, row.corner.xyz + p * row.edges.xyz, 0.0);
            let depth = cell.w * row.edges.w * step;
            let kept = exp(-depth);
            let share = select(1.0 - 0.5 * depth, (1.0 - kept) / max(depth, 1e-9), depth > 1e-3);
            light += cell.xyz * (row.corner.w * step * share * through);
            through *= kept;
        }
    }
    return vec4<f32>(light, through);
}
