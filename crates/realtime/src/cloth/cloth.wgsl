// Small steps of a cloth: `crates/motion/src/cloth/rows.rs` says what is done in which order, `layout.rs` where its lists lie.
// Constants in capitals are written above this by `layout.rs`.

struct Substep {
    index: u32,
    // Of the step that is over behind it.
    part: f32,
}

struct Distance {
    far: f32,
    away: vec3<f32>,
}

// Sections X (and in w inverse masses), U, V, LOST, AREA (and in w how wide the cloth is), SWING (way since the turn, the way before, drag
// at the turn, drag now) of places; AT and MOVED of nodes; FROM and GOAL of attachments.
@group(0) @binding(0) var<storage, read_write> state: array<vec4<f32>>;
// Springs, hinges, weights, bodies.
@group(0) @binding(1) var<storage, read> rows: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> tables: array<u32>;
// What a step is given.
@group(0) @binding(3) var<storage, read> given: array<vec4<f32>>;
// Distances of bodies.
@group(0) @binding(4) var<storage, read> fields: array<f32>;
// Of places, a bit for each body that it may reach in this step.
@group(0) @binding(5) var<storage, read_write> near: array<vec2<u32>>;
// Of vertices: positions, then normals.
@group(0) @binding(6) var<storage, read_write> shown: array<vec4<f32>>;
@group(0) @binding(7) var<uniform> substep: Substep;

fn number(word: u32) -> f32 {
    return bitcast<f32>(word);
}

fn matrix(at: u32) -> mat3x3<f32> {
    return mat3x3<f32>(given[at].xyz, given[at + 1u].xyz, given[at + 2u].xyz);
}

// Points of the world as a body sees them, and the other way round; `at`: where the body is.
fn local(at: u32, p: vec3<f32>) -> vec3<f32> {
    return (p - given[at + 3u].xyz) * matrix(at);
}

fn world(at: u32, q: vec3<f32>) -> vec3<f32> {
    return matrix(at) * q + given[at + 3u].xyz;
}

// A step begins: what holds it, areas, bodies that are near.

fn area(p: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var k = tables[TRIANGLES + p]; k < tables[TRIANGLES + p + 1u]; k += 3u) {
        let a = state[X + tables[k]].xyz;
        sum += cross(state[X + tables[k + 1u]].xyz - a, state[X + tables[k + 2u]].xyz - a) / 6.0;
    }
    return sum;
}

// The drag across of a place that has gone so far since it turned.
fn drag_of(swing: vec4<f32>, width: f32) -> f32 {
    let way = abs(swing.x);
    // From turn to turn it is twice the amplitude.
    let kc = 3.14159265 * max(way, swing.y) / width;
    var swinging = SWINGING * pow(LONGEST_SWING, 2.0 / 3.0) / kc;
    if kc < LONGEST_SWING {
        swinging = SWINGING * pow(max(kc, SHORTEST_SWING), -1.0 / 3.0);
    }
    let over = way / (OVER_WAY * swing.y + OVER_WIDTH * width);
    let now = max(swinging, DRAG_ACROSS);
    return select(now, swing.z + (now - swing.z) * over, over < 1.0);
}

// It goes on `by`.
fn swing(before: vec4<f32>, by: f32, width: f32) -> vec4<f32> {
    var now = before;
    if by * now.x < 0.0 {
        let way = abs(now.x);
        let left = select(way, now.y - FORGETS * way, now.y < NEVER);
        now = vec4<f32>(0.0, max(left, way), drag_of(now, width), 0.0);
    }
    now.x += by;
    now.w = drag_of(now, width);
    return now;
}

@compute @workgroup_size(64)
fn start(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p < ATTACHED {
        // Held ones start from where they are, others from where they were to be.
        var origin = state[GOAL + p].xyz;
        if GRIP >= 1.0 {
            origin = state[X + tables[HELD + p]].xyz;
        }
        state[FROM + p] = vec4<f32>(origin, 0.0);
        let target_at = given[TARGETS + 2u * p];
        state[GOAL + p] = vec4<f32>(select(origin, target_at.xyz, target_at.w > 0.0), 0.0);
    }
    if p >= N {
        return;
    }
    let normal = area(p);
    let width = state[AREA + p].w;
    state[AREA + p] = vec4<f32>(normal, width);
    let size = length(normal);
    let by = dot(state[V + p].xyz - given[1].xyz, normal / max(size, 1e-30)) * SECONDS;
    state[SWING + p] = swing(state[SWING + p], by, width);
    var mask = vec2<u32>(0u);
    let x = state[X + p].xyz;
    let reach = length(state[V + p].xyz) * SECONDS + FLIGHT;
    for (var b = 0u; b < BODIES; b++) {
        let around = given[SWEPT + 2u * b];
        let to = x - around.xyz;
        let within = around.w + reach;
        if dot(to, to) < within * within {
            let far = distance_to(b, local(PLACED + 4u * b * (SUBSTEPS + 1u), x)).far;
            if far < (reach + given[SWEPT + 2u * b + 1u].x) * number(rows[SOLIDS + 3u * b].y) {
                mask |= vec2<u32>(select(0u, 1u << (b & 31u), b < 32u), select(0u, 1u << (b & 31u), b >= 32u));
            }
        }
    }
    near[p] = mask;
}

// Springs and hinges, one of a strip or border after the other where they have places in common.

fn solve(i: u32, x: u32, u: u32) {
    let row = rows[SPRINGS + 2u * i];
    let parts = bitcast<vec4<f32>>(rows[SPRINGS + 2u * i + 1u]);
    let a = row.x;
    let b = row.y;
    // A step is short: differences of what is large first.
    let d = (state[x + b].xyz - state[x + a].xyz) + (state[u + b].xyz - state[u + a].xyz);
    let far = length(d);
    let elastic = parts.y * (far - number(row.z));
    let excess = max(far - elastic - number(row.w), 0.0);
    let by = d * ((elastic + excess) / max(far, SHORT));
    state[u + a] += vec4<f32>(by * parts.x, 0.0);
    state[u + b] -= vec4<f32>(by - by * parts.x, 0.0);
}

// All springs of these batches.
fn sweep(first: u32, last: u32, lane: u32, x: u32, u: u32) {
    for (var batch = first; batch < last; batch++) {
        let end = tables[SPRING_BATCHES + batch + 1u];
        for (var i = tables[SPRING_BATCHES + batch] + lane; i < end; i += WIDE) {
            solve(i, x, u);
        }
        storageBarrier();
    }
}

// What hinges in this list of places pull at `p`: the second differences of its neighbours, N/kg.
fn bend(list: u32, p: u32) -> vec3<f32> {
    let x = state[X + p].xyz;
    var sum = vec3<f32>(0.0);
    for (var k = tables[list + p]; k < tables[list + p + 1u]; k += 2u) {
        sum += (state[X + tables[k]].xyz - x) * number(tables[k + 1u]);
    }
    return sum;
}

// An extra pass over springs that are longer than they may be.
fn tighten(task: u32, lane: u32) {
    for (var batch = tables[task + 6u]; batch < tables[task + 7u]; batch++) {
        let end = tables[SPRING_BATCHES + batch + 1u];
        for (var i = tables[SPRING_BATCHES + batch] + lane; i < end; i += WIDE) {
            let row = rows[SPRINGS + 2u * i];
            let a = row.x;
            let b = row.y;
            let d = (state[X + b].xyz - state[X + a].xyz) + (state[U + b].xyz - state[U + a].xyz);
            let far = length(d);
            if far > number(row.w) {
                let by = d * ((far - number(row.w)) / max(far, SHORT));
                let share = number(rows[SPRINGS + 2u * i + 1u].x);
                state[U + a] += vec4<f32>(by * share, 0.0);
                state[U + b] -= vec4<f32>(by - by * share, 0.0);
            }
        }
        storageBarrier();
    }
}

@compute @workgroup_size(WIDE)
fn tighten_strips(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    tighten(STRIPS + 8u * group.x, lane);
}

@compute @workgroup_size(WIDE)
fn tighten_borders(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    tighten(BORDERS + 8u * group.x, lane);
}

@compute @workgroup_size(WIDE)
fn strips(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let task = STRIPS + 8u * group.x;
    sweep(tables[task + 2u], tables[task + 3u], lane, X, U);
}

@compute @workgroup_size(WIDE)
fn borders(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let task = BORDERS + 8u * group.x;
    for (var p = tables[task] + lane; p < tables[task + 1u]; p += WIDE) {
        state[U + p] -= vec4<f32>(bend(ACROSS, p) * (H * H), 0.0);
    }
    storageBarrier();
    sweep(tables[task + 2u], tables[task + 3u], lane, X, U);
}

// Springs that follow each other along a thread, all at once: the equations of their forces are tridiagonal (Thomas' algorithm).

fn solve_line(first: u32, last: u32) {
    var normal = vec3<f32>(0.0);
    var over = 0.0;
    var right = 0.0;
    for (var k = first; k + 1u < last; k++) {
        let a = rows[LINES + 2u * k];
        let b = rows[LINES + 2u * k + 2u];
        let d = (state[X + b.x].xyz - state[X + a.x].xyz) + (state[U + b.x].xyz - state[U + a.x].xyz);
        let far = length(d);
        let along = d * (1.0 / max(far, SHORT));
        let w = number(a.y);
        let mass = w + number(b.y);
        var compliance = number(rows[LINES + 2u * k + 1u].x);
        var rest = number(a.z);
        let longest = number(a.w);
        // Where stiffness alone is not enough a link is rigid at its longest.
        if compliance * far + mass * rest > longest * (mass + compliance) {
            rest = longest;
            compliance = 0.0;
        }
        let coupling = w * dot(normal, along);
        let diagonal = mass + compliance;
        let share = coupling * over;
        right = (rest - far) + share * right;
        over = 1.0 / max(diagonal - coupling * share, max(diagonal * LEAST, 1.2e-38));
        normal = along;
        state[KEPT + 2u * k] = vec4<f32>(normal, over);
        state[KEPT + 2u * k + 1u] = vec4<f32>(right, coupling, 0.0, 0.0);
    }
    var force = 0.0;
    var coupling = 0.0;
    var pull = vec3<f32>(0.0);
    for (var k = last - 1u; k > first; k--) {
        let direction = state[KEPT + 2u * k - 2u];
        let rest = state[KEPT + 2u * k - 1u];
        force = direction.w * (rest.x + coupling * force);
        coupling = rest.y;
        let before = direction.xyz * force;
        let row = rows[LINES + 2u * k];
        state[U + row.x] += vec4<f32>(number(row.y) * (before - pull), 0.0);
        pull = before;
    }
    let row = rows[LINES + 2u * first];
    state[U + row.x] -= vec4<f32>(number(row.y) * pull, 0.0);
}

@compute @workgroup_size(32)
fn wefts(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < WEFT_LINES {
        solve_line(tables[WEFT + id.x], tables[WEFT + id.x + 1u]);
    }
}

@compute @workgroup_size(32)
fn warps(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < WARP_LINES {
        solve_line(tables[WARP + id.x], tables[WARP + id.x + 1u]);
    }
}

// Dampers.

fn calm_spring(i: u32) {
    let row = rows[SPRINGS + 2u * i];
    let parts = bitcast<vec4<f32>>(rows[SPRINGS + 2u * i + 1u]);
    let d = state[X + row.y].xyz - state[X + row.x].xyz;
    let rate = dot(d, state[V + row.y].xyz - state[V + row.x].xyz);
    let by = d * (parts.z * rate / max(dot(d, d), SHORT * SHORT));
    state[V + row.x] += vec4<f32>(by * parts.x, 0.0);
    state[V + row.y] -= vec4<f32>(by - by * parts.x, 0.0);
}

fn calm_hinge(i: u32) {
    let at = rows[HINGES + 3u * i];
    let slopes = bitcast<vec4<f32>>(rows[HINGES + 3u * i + 1u]);
    let push = bitcast<vec4<f32>>(rows[HINGES + 3u * i + 2u]);
    let c = state[V + at.z];
    let seen = (state[V + at.x] - c) * slopes.x + (state[V + at.y] - c) * slopes.y + (state[V + at.w] - c) * slopes.z;
    let by = seen * slopes.w;
    // One after the other, for the last two may be the same.
    state[V + at.x] -= by * push.x;
    state[V + at.y] -= by * push.y;
    state[V + at.z] -= by * push.z;
    state[V + at.w] -= by * push.w;
}

fn calm(task: u32, lane: u32) {
    for (var batch = tables[task + 6u]; batch < tables[task + 7u]; batch++) {
        let end = tables[SPRING_BATCHES + batch + 1u];
        for (var i = tables[SPRING_BATCHES + batch] + lane; i < end; i += WIDE) {
            calm_spring(i);
        }
        storageBarrier();
    }
    for (var batch = tables[task + 4u]; batch < tables[task + 5u]; batch++) {
        let end = tables[HINGE_BATCHES + batch + 1u];
        for (var i = tables[HINGE_BATCHES + batch] + lane; i < end; i += WIDE) {
            calm_hinge(i);
        }
        storageBarrier();
    }
}

// By how much air changes a velocity; implicit in its own speed.
fn drag(u: vec3<f32>, coefficient: f32) -> vec3<f32> {
    let c = coefficient * length(u);
    return u * (c / (1.0 + c));
}

@compute @workgroup_size(WIDE)
fn calm_strips(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let task = STRIPS + 8u * group.x;
    for (var p = tables[task] + lane; p < tables[task + 1u]; p += WIDE) {
        let normal = state[AREA + p].xyz;
        let size = length(normal);
        if size > 0.0 {
            let n = normal / size;
            let v = state[V + p].xyz;
            let relative = given[1].xyz - v;
            let across = n * dot(relative, n);
            let c = 0.5 * AIR * size * (state[X + p].w * CALM_SECONDS);
            let by = drag(across, c * state[SWING + p].w) + drag(relative - across, c * DRAG_ALONG);
            state[V + p] = vec4<f32>(v + by, 0.0);
        }
    }
    storageBarrier();
    calm(task, lane);
}

@compute @workgroup_size(WIDE)
fn calm_borders(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    calm(BORDERS + 8u * group.x, lane);
}

// How far a place would go by what pushes it, or where it is held.
@compute @workgroup_size(64)
fn predict(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p >= N {
        return;
    }
    let x = state[X + p];
    var v = state[V + p].xyz - bend(WITHIN, p) * H;
    var u = state[U + p].xyz;
    if x.w > 0.0 {
        v += given[0].xyz;
        u = v * H;
    }
    for (var k = tables[HOLDS + p]; k < tables[HOLDS + p + 1u]; k++) {
        let a = tables[k];
        let origin = state[FROM + a].xyz;
        let way = state[GOAL + a].xyz - origin;
        if GRIP < 1.0 {
            // As a spring with as much damping as lets it come to rest at once, or nearly.
            let with_it = way * (1.0 / f32(SUBSTEPS));
            let goal = origin + with_it * f32(substep.index + 1u);
            let slowed = u + (with_it - u) * GRIP;
            let back = goal - x.xyz - slowed;
            let along = given[TARGETS + 2u * a + 1u].xyz;
            u = slowed + (back - along * (dot(back, along) * (1.0 - SLID))) * (0.25 * GRIP);
        } else {
            u = origin + way * substep.part - x.xyz;
        }
    }
    state[V + p] = vec4<f32>(v, 0.0);
    state[U + p] = vec4<f32>(u, 0.0);
}

// Lattices.

var<workgroup> sums: array<vec3<f32>, 64>;

// Centres of the finest level's nodes, by eight each.
@compute @workgroup_size(64)
fn centres(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let k = 8u * group.x + lane / 8u;
    var origin = vec3<f32>(0.0);
    var sum = vec3<f32>(0.0);
    if k < NODES {
        let first = tables[PARTS + k];
        let last = tables[PARTS + k + 1u];
        if first < last {
            // From one of them, so that little is lost to rounding.
            origin = state[X + tables[first]].xyz + state[U + tables[first]].xyz;
        }
        for (var i = first + 2u * (lane % 8u); i < last; i += 16u) {
            let p = tables[i];
            sum += (state[X + p].xyz + state[U + p].xyz - origin) * number(tables[i + 1u]);
        }
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane % 8u == 0u && k < NODES {
        for (var i = 1u; i < 8u; i++) {
            sum += sums[lane + i];
        }
        state[AT + FINEST + k] = vec4<f32>(origin + sum, 0.0);
    }
}

// A centre of nodes from `base` on, or of places.
fn centre(list: u32, k: u32, base: u32, of_places: bool) -> vec3<f32> {
    var origin = vec3<f32>(0.0);
    var sum = vec3<f32>(0.0);
    let first = tables[list + k];
    for (var i = first; i < tables[list + k + 1u]; i += 2u) {
        var at = state[base + tables[i]].xyz;
        if of_places {
            at += state[U + tables[i]].xyz;
        }
        if i == first {
            origin = at;
        }
        sum += (at - origin) * number(tables[i + 1u]);
    }
    return origin + sum;
}

// What nodes move by, weighted.
fn blend(row: u32, base: u32) -> vec3<f32> {
    let nodes = rows[row];
    let weights = bitcast<vec4<f32>>(rows[row + 1u]);
    let first = state[base + nodes.x].xyz * weights.x + state[base + nodes.y].xyz * weights.y;
    return first + (state[base + nodes.z].xyz * weights.z + state[base + nodes.w].xyz * weights.w);
}

@compute @workgroup_size(WIDE)
fn lattices(@builtin(local_invocation_index) lane: u32) {
    // Of each level: first node, nodes, anchors, lists of parts and of what anchors are, weights in the coarser level, batches.
    for (var l = max(LEVELS, 1u) - 1u; l > 0u; l--) {
        let level = LEVEL + 8u * (l - 1u);
        for (var k = lane; k < tables[level + 1u]; k += WIDE) {
            let at = centre(tables[level + 3u], k, AT + tables[level + 8u], false);
            state[AT + tables[level] + k] = vec4<f32>(at, 0.0);
        }
        storageBarrier();
    }
    for (var l = 0u; l < LEVELS; l++) {
        let level = LEVEL + 8u * l;
        let base = tables[level];
        let nodes = tables[level + 1u];
        for (var k = lane; k < nodes + tables[level + 2u]; k += WIDE) {
            var moved = vec3<f32>(0.0);
            if k >= nodes {
                state[AT + base + k] = vec4<f32>(centre(tables[level + 4u], k - nodes, X, true), 0.0);
            } else if l > 0u {
                moved = blend(tables[level + 5u] + 2u * k, MOVED + tables[level - 8u]);
            }
            state[MOVED + base + k] = vec4<f32>(moved, 0.0);
        }
        storageBarrier();
        for (var k = 0u; k < LEVEL_SWEEPS; k++) {
            sweep(tables[level + 6u], tables[level + 7u], lane, AT, MOVED);
        }
    }
}

// Bodies.

fn trilinear(first: u32, low: vec3<f32>, cell: f32, size: vec3<u32>, p: vec3<f32>) -> Distance {
    let q = (p - low) / cell;
    let end = vec3<f32>(size - vec3<u32>(1u));
    let beside = (q - clamp(q, vec3<f32>(0.0), end)) * cell;
    let out = length(beside);
    if out > 0.0 {
        return Distance(out + BAND * cell, beside / out);
    }
    let corner = min(floor(q), end - 1.0);
    let t = q - corner;
    let c = vec3<u32>(corner);
    let dy = size.x;
    let dz = size.x * size.y;
    let i = first + c.z * dz + c.y * dy + c.x;
    let near_x = vec4<f32>(fields[i], fields[i + dy], fields[i + dz], fields[i + dz + dy]);
    let far_x = vec4<f32>(fields[i + 1u], fields[i + dy + 1u], fields[i + dz + 1u], fields[i + dz + dy + 1u]);
    let x_slopes = far_x - near_x;
    let y = near_x + x_slopes * t.x;
    let z = y.xz + (y.yw - y.xz) * t.y;
    let x_slope = x_slopes.xz + (x_slopes.yw - x_slopes.xz) * t.y;
    let y_slope = y.yw - y.xz;
    let slope = vec3<f32>(
        x_slope.x + (x_slope.y - x_slope.x) * t.z,
        y_slope.x + (y_slope.y - y_slope.x) * t.z,
        z.y - z.x
    );
    let long = length(slope);
    var away = vec3<f32>(0.0, 1.0, 0.0);
    if long > 0.0 {
        away = slope / long;
    }
    return Distance(z.x + (z.y - z.x) * t.z, away);
}

fn distance_to(b: u32, p: vec3<f32>) -> Distance {
    let kind = rows[SOLIDS + 3u * b].x;
    if kind == GROUND {
        return Distance(p.y, vec3<f32>(0.0, 1.0, 0.0));
    }
    let first = bitcast<vec4<f32>>(rows[SOLIDS + 3u * b + 1u]);
    if kind == FIELD {
        return trilinear(rows[SOLIDS + 3u * b].w, first.xyz, first.w, rows[SOLIDS + 3u * b + 2u].xyz, p);
    }
    let second = bitcast<vec4<f32>>(rows[SOLIDS + 3u * b + 2u]);
    let along = second.xyz - first.xyz;
    let t = clamp(dot(p - first.xyz, along) / max(dot(along, along), 1e-20), 0.0, 1.0);
    let to = p - (first.xyz + along * t);
    let far = length(to);
    var away = vec3<f32>(0.0, 1.0, 0.0);
    if far > 1e-9 {
        away = to / far;
    } else if dot(along, along) > 0.0 {
        let aside = select(vec3<f32>(0.0, along.z, -along.y), vec3<f32>(-along.z, 0.0, along.x), abs(along.x) > abs(along.y));
        away = normalize(aside);
    }
    return Distance(far - (first.w + (second.w - first.w) * t), away);
}

// Keeps what would go from `x` by `u` from going through a body: where it goes, and by how much it is shifted besides. How far it stays from
// it, less than nought where they meet, m.
fn stop(b: u32, x: ptr<function, vec3<f32>>, u: ptr<function, vec3<f32>>) -> f32 {
    let before = PLACED + 4u * (b * (SUBSTEPS + 1u) + substep.index);
    let after = before + 4u;
    let begin = local(before, *x);
    var at = local(after, *x + *u);
    var met = distance_to(b, at);
    var d = met.far - GAP;
    if d > 0.0 {
        let way = at - begin;
        let long = length(way);
        let stride = number(rows[SOLIDS + 3u * b].z);
        // Where the end is that far away nothing on the way is nearer.
        if long <= stride || d > long * number(rows[SOLIDS + 3u * b].y) {
            return d;
        }
        let count = min(ceil(long / stride), 256.0);
        let each = way / count;
        var hit = false;
        for (var k = 1u; k < u32(count); k++) {
            at = begin + each * f32(k);
            met = distance_to(b, at);
            if met.far < GAP {
                hit = true;
                break;
            }
        }
        if !hit {
            return d;
        }
        d = met.far - GAP;
    }
    // What was inside as the substep began comes out in time.
    let inside = min(distance_to(b, begin).far - GAP, 0.0);
    let push = max(inside - d, 0.0);
    let to = world(after, at + met.away * push);
    let normal = matrix(after) * met.away;
    var go = to - *x;
    // The point of the body that is touched has moved too.
    let relative = go - (to - world(before, at + met.away * push));
    let slide = relative - normal * dot(relative, normal);
    let far = length(slide);
    if far > 0.0 {
        go -= slide * min(FRICTION * push / far, 1.0);
    }
    *u = go;
    *x += normal * min(-inside, RECOVERY * H);
    return -1.0;
}

// How a place moves by bodies, and in w the part by which it gives way to what presses on it.
fn halted(p: u32, x: ptr<function, vec3<f32>>, u: ptr<function, vec3<f32>>) -> f32 {
    var give = 1.0;
    let begun = *x;
    for (var word = 0u; word < 2u; word++) {
        var left = near[p][word];
        while left != 0u {
            let b = 32u * word + firstTrailingBit(left);
            left &= left - 1u;
            let far = max(stop(b, x, u), 0.0) / number(rows[SOLIDS + 3u * b].y);
            give = min(give, LOADED + (1.0 - LOADED) * far / LOADS);
        }
    }
    // Where bodies push against each other what one shifts it by and another takes back is no motion.
    let shift = *x - begun;
    let square = dot(shift, shift);
    if square > 0.0 {
        let back = shift * clamp(-dot(*u, shift) / square, 0.0, 1.0);
        *u += back;
        *x -= back;
    }
    return give;
}

// Where cloth touches cloth: what lattices move places by, before springs are tightened.
@compute @workgroup_size(64)
fn carry(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p < N {
        if LEVELS > 0u {
            state[U + p] += vec4<f32>(blend(REACH + 2u * p, MOVED + FINEST), 0.0);
        }
        state[SHIFT + p] = vec4<f32>(0.0);
    }
}

// And bodies: before pairs are pushed, which would else be measured from places that are in a body, and before they are stopped.
@compute @workgroup_size(64)
fn halt(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p >= N {
        return;
    }
    let begun = state[X + p];
    if begun.w > 0.0 {
        var x = begun.xyz;
        var u = state[U + p].xyz;
        let give = begun.w * halted(p, &x, &u);
        // To contact it is motion like any other.
        let shift = x - begun.xyz;
        state[U + p] = vec4<f32>(u + shift, 0.0);
        state[SHIFT + p] = vec4<f32>(state[SHIFT + p].xyz + shift, give);
    }
}

@compute @workgroup_size(64)
fn finish(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p >= N {
        return;
    }
    let w = state[X + p].w;
    var x = state[X + p].xyz;
    var u = state[U + p].xyz;
    var v = u;
    if CONTACT {
        // As much of the push out of bodies as it has got is no velocity.
        let shift = state[SHIFT + p].xyz;
        let square = dot(shift, shift);
        if square > 0.0 {
            v -= shift * clamp(dot(u, shift) / square, 0.0, 1.0);
        }
    } else {
        if LEVELS > 0u {
            u += blend(REACH + 2u * p, MOVED + FINEST);
        }
        if w > 0.0 {
            halted(p, &x, &u);
        }
        v = u;
    }
    state[V + p] = vec4<f32>(v * (1.0 / H), 0.0);
    // Kahan's sum, for steps are short. Compilers that take it for exact arithmetic leave nothing of it; so the sum's bits go through an
    // operation of which they do not know that it changes nothing.
    let by = u + state[LOST + p].xyz;
    let nothing = vec3<u32>(bitcast<u32>(given[1].w));
    let to = bitcast<vec3<f32>>(bitcast<vec3<u32>>(x + by) ^ nothing);
    state[LOST + p] = vec4<f32>(by - (to - x), 0.0);
    state[X + p] = vec4<f32>(to, w);
    state[U + p] = vec4<f32>(u, 0.0);
}

@compute @workgroup_size(64)
fn show(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p >= N {
        return;
    }
    let vertex = tables[VERTEX + p];
    let normal = area(p);
    let long = length(normal);
    shown[vertex] = vec4<f32>(state[X + p].xyz, 1.0);
    shown[N + vertex] = vec4<f32>(select(vec3<f32>(0.0), normal / long, long > 0.0), 0.0);
}
