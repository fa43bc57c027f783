// A mesh of the scene where a cloth is, and the boxes around it. Needs the structs of geometry.wgsl, and constants that `drape.rs` writes.

struct Level {
    // Of the list of nodes.
    first: u32,
    count: u32,
}

@group(0) @binding(0) var<storage, read_write> vertices: array<Vertex>;
@group(0) @binding(1) var<storage, read> triangles: array<u32>;
@group(0) @binding(2) var<storage, read> draws: array<Draw>;
@group(0) @binding(3) var<storage, read_write> hierarchy: array<vec4<u32>>;
// Positions of the cloth's vertices, then normals.
@group(0) @binding(4) var<storage, read> cloth: array<vec4<f32>>;
// Of each vertex of the mesh that of the cloth, or none; then nodes of the mesh's tree, the deepest first.
@group(0) @binding(5) var<storage, read> tables: array<u32>;
// How many nodes of the top level are above the mesh; of each, children before parents, the node and what its four boxes are.
@group(0) @binding(6) var<storage, read> above: array<u32>;
// Of the mesh's nodes, then of those above it, two corners.
@group(0) @binding(7) var<storage, read_write> bounds: array<vec4<f32>>;
@group(0) @binding(8) var<uniform> level: Level;

struct Box {
    lo: vec3<f32>,
    hi: vec3<f32>,
}

@compute @workgroup_size(64)
fn follow(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= VERTICES {
        return;
    }
    let vertex = tables[id.x];
    if vertex != NONE {
        vertices[FIRST_VERTEX + id.x].position = cloth[vertex].xyz;
        if NORMALS {
            vertices[FIRST_VERTEX + id.x].normal = cloth[CLOTH + vertex].xyz;
        }
    }
}

fn power(exponent: i32) -> f32 {
    return bitcast<f32>(u32(exponent + 127) << 23u);
}

// As node_rows of hierarchy/tree.rs: every plane strictly outside what it bounds. Returns what the node bounds.
fn write_node(node: u32, boxes: array<Box, 4>) -> Box {
    var mine = boxes;
    let children = hierarchy[4u * node + 1u];
    var whole = Box(vec3<f32>(1e30), vec3<f32>(-1e30));
    for (var slot = 0u; slot < 4u; slot++) {
        if children[slot] != NONE {
            whole.lo = min(whole.lo, mine[slot].lo);
            whole.hi = max(whole.hi, mine[slot].hi);
        }
    }
    var corner = vec3<f32>(0.0);
    var exponents = 0u;
    var low = vec3<u32>(0u);
    var high = vec3<u32>(0u);
    for (var axis = 0u; axis < 3u; axis++) {
        let least = whole.lo[axis];
        let most = whole.hi[axis];
        // Some units in the last place of the largest coordinate.
        let gap = max(max(abs(least), abs(most)), 1e-25) * exp2(-21.0);
        let start = least - gap;
        var exponent = max(i32(ceil(log2((most + gap - start) / 254.0))), -126);
        // The logarithm is a hair off at the most; what is no number never fits.
        for (var more = 0u; more < 4u; more++) {
            let step = power(exponent);
            var fits = true;
            low[axis] = 0u;
            high[axis] = 0u;
            for (var slot = 0u; slot < 4u; slot++) {
                if children[slot] == NONE {
                    continue;
                }
                var q = u32(clamp(floor((mine[slot].lo[axis] - start) / step), 0.0, 255.0));
                while q > 0u && start + f32(q) * step >= mine[slot].lo[axis] {
                    q--;
                }
                low[axis] |= q << (8u * slot);
                q = u32(clamp(ceil((mine[slot].hi[axis] - start) / step), 0.0, 255.0));
                while q < 255u && start + f32(q) * step <= mine[slot].hi[axis] {
                    q++;
                }
                fits = fits && start + f32(q) * step > mine[slot].hi[axis];
                high[axis] |= q << (8u * slot);
            }
            if fits {
                break;
            }
            exponent++;
        }
        corner[axis] = start;
        exponents |= u32(exponent + 127) << (8u * axis);
    }
    hierarchy[4u * node] = vec4<u32>(bitcast<vec3<u32>>(corner), exponents);
    hierarchy[4u * node + 2u] = vec4<u32>(low, high.x);
    hierarchy[4u * node + 3u] = vec4<u32>(high.yz, 0u, 0u);
    return whole;
}

// The boxes of one level of the mesh's nodes.
@compute @workgroup_size(64)
fn fit(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= level.count {
        return;
    }
    let node = tables[VERTICES + level.first + id.x];
    let children = hierarchy[4u * node + 1u];
    var boxes: array<Box, 4>;
    for (var slot = 0u; slot < 4u; slot++) {
        let child = children[slot];
        if child == NONE {
            continue;
        }
        if (child & LEAF) == 0u {
            let at = 2u * (child - FIRST_NODE);
            boxes[slot] = Box(bounds[at].xyz, bounds[at + 1u].xyz);
            continue;
        }
        let first = child & 0x1fffffffu;
        var around = Box(vec3<f32>(1e30), vec3<f32>(-1e30));
        for (var row = first; row <= first + ((child >> 29u) & 3u); row++) {
            let corners = hierarchy[row];
            for (var k = 0u; k < 3u; k++) {
                let p = vertices[corners[k]].position;
                around.lo = min(around.lo, p);
                around.hi = max(around.hi, p);
            }
        }
        boxes[slot] = around;
    }
    let whole = write_node(node, boxes);
    bounds[2u * (node - FIRST_NODE)] = vec4<f32>(whole.lo, 0.0);
    bounds[2u * (node - FIRST_NODE) + 1u] = vec4<f32>(whole.hi, 0.0);
}

// The box of slot `slot` as a node has it.
fn box_of(node: u32, slot: u32) -> Box {
    let head = hierarchy[4u * node];
    let third = hierarchy[4u * node + 2u];
    let fourth = hierarchy[4u * node + 3u];
    let shift = vec3<u32>(8u * slot);
    let low = (third.xyz >> shift) & vec3<u32>(255u);
    let high = (vec3<u32>(third.w, fourth.x, fourth.y) >> shift) & vec3<u32>(255u);
    let exponents = vec3<i32>((vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u)) - 127;
    let step = vec3<f32>(power(exponents.x), power(exponents.y), power(exponents.z));
    let corner = bitcast<vec3<f32>>(head.xyz);
    return Box(corner + vec3<f32>(low) * step, corner + vec3<f32>(high) * step);
}

// The boxes of the top level that the mesh lies in; a few nodes, one after the other.
@compute @workgroup_size(1)
fn lift() {
    // The root is the last of the list.
    let mesh = Box(bounds[2u * (ROOT - FIRST_NODE)].xyz, bounds[2u * (ROOT - FIRST_NODE) + 1u].xyz);
    for (var i = 0u; i < above[0]; i++) {
        let node = above[5u * i + 1u];
        var boxes: array<Box, 4>;
        for (var slot = 0u; slot < 4u; slot++) {
            let what = above[5u * i + 2u + slot];
            if what == NONE {
                boxes[slot] = box_of(node, slot);
            } else if (what & LEAF) == 0u {
                let at = 2u * (NODES + what);
                boxes[slot] = Box(bounds[at].xyz, bounds[at + 1u].xyz);
            } else {
                let m = draws[what & 0x7fffffffu].to_world;
                let centre = point_to_world(m, 0.5 * (mesh.lo + mesh.hi));
                let half = 0.5 * (mesh.hi - mesh.lo);
                var reach = vec3<f32>(dot(abs(m[0].xyz), half), dot(abs(m[1].xyz), half), dot(abs(m[2].xyz), half));
                // Room for the rounding of rays on their way into the mesh, and for that of this.
                reach += 2e-6 * (abs(centre) + reach);
                boxes[slot] = Box(centre - reach, centre + reach);
            }
        }
        let whole = write_node(node, boxes);
        bounds[2u * (NODES + i)] = vec4<f32>(whole.lo, 0.0);
        bounds[2u * (NODES + i) + 1u] = vec4<f32>(whole.hi, 0.0);
    }
}
