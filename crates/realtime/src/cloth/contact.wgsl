// Cloth that touches itself: `crates/motion/src/cloth/contact` says what pairs are and how they are pushed apart and stopped. `contact.rs` says
// in which order these run. Constants in capitals are written above this by `layout.rs` and `contact.rs`.

struct Nearest {
    // Weights of the nearest points, which sum up to one and minus one.
    weights: vec4<f32>,
    // From the second point to the first.
    between: vec3<f32>,
}

// As in `cloth.wgsl`. WENT: where springs would have places go. SHIFT: in w inverse masses as other cloth feels them.
@group(0) @binding(0) var<storage, read_write> state: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> tables: array<u32>;
// Of each node of the tree, the box of all that its triangles pass in this substep, as far as pairs are found: low and high.
@group(0) @binding(2) var<storage, read_write> boxes: array<vec4<f32>>;
// Leaves whose boxes meet.
@group(0) @binding(3) var<storage, read_write> near: array<vec2<u32>>;
// Three rows for each pair: its places; its weights, or nought where it does not touch; the direction from its second side to the first as the substep
// begins, and how many places the first has.
@group(0) @binding(4) var<storage, read_write> pairs: array<vec4<u32>>;
// How many of these two there are, and the most that there have been.
@group(0) @binding(5) var<storage, read_write> counts: array<atomic<u32>, 4>;
// Of each place, how far pairs push it along each axis at the most, and then against each: whole numbers, for their greatest does not depend on
// the order in which pairs come.
@group(0) @binding(6) var<storage, read_write> pushes: array<atomic<i32>>;

// Whole numbers in a metre; a push is less than a quarter of one.
const UNITS: f32 = 8e9;
const FAR: f32 = 1e18;

fn at(p: u32) -> vec3<f32> {
    return state[X + p].xyz;
}

fn by(p: u32) -> vec3<f32> {
    return state[U + p].xyz;
}

// The tree.

fn join(node: u32) {
    let l = 2u * (2u * node + 1u);
    boxes[2u * node] = min(boxes[l], boxes[l + 2u]);
    boxes[2u * node + 1u] = max(boxes[l + 1u], boxes[l + 3u]);
}

// Boxes of 64 leaves, and of nodes above them that have no others below.
@compute @workgroup_size(64)
fn fit(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
    @builtin(num_workgroups) groups: vec3<u32>
) {
    let leaf = id.x;
    if leaf == 0u {
        atomicMax(&counts[2], atomicLoad(&counts[0]));
        atomicMax(&counts[3], atomicLoad(&counts[1]));
        atomicStore(&counts[0], 0u);
        atomicStore(&counts[1], 0u);
    }
    for (var p = leaf; p < N; p += 64u * groups.x) {
        state[WENT + p] = state[U + p];
    }
    if leaf < LEAF_COUNT {
        var low = vec3<f32>(FAR);
        var high = vec3<f32>(-FAR);
        let end = 3u * tables[LEAVES + 6u * leaf + 1u];
        for (var k = 3u * tables[LEAVES + 6u * leaf]; k < end; k++) {
            let p = tables[LEAF_TRIANGLES + k];
            let begun = at(p);
            let to = begun + by(p);
            low = min(low, min(begun, to));
            high = max(high, max(begun, to));
        }
        let node = LEAF_COUNT - 1u + leaf;
        boxes[2u * node] = vec4<f32>(low - WITHIN_REACH, 0.0);
        boxes[2u * node + 1u] = vec4<f32>(high + WITHIN_REACH, 0.0);
    }
    var count = LEAF_COUNT;
    for (var below = 32u; below > 0u; below /= 2u) {
        storageBarrier();
        count /= 2u;
        let k = below * group.x + lane;
        if lane < below && k < count {
            join(count - 1u + k);
        }
    }
}

// Nodes above those.
@compute @workgroup_size(256)
fn lift(@builtin(local_invocation_index) lane: u32) {
    for (var count = LEAF_COUNT / 128u; count > 0u; count /= 2u) {
        for (var k = lane; k < count; k += 256u) {
            join(count - 1u + k);
        }
        storageBarrier();
    }
}

// Each leaf with those behind it, in each of SUBTREES parts of the tree.
@compute @workgroup_size(64)
fn meet(@builtin(global_invocation_id) id: vec3<u32>) {
    let leaf = id.x / SUBTREES;
    if leaf >= LEAF_COUNT {
        return;
    }
    let own = LEAF_COUNT - 1u + leaf;
    let low = boxes[2u * own].xyz;
    let high = boxes[2u * own + 1u].xyz;
    let depth = firstLeadingBit(LEAF_COUNT);
    // A path from the root leaves a node behind at each depth.
    var stack: array<u32, 32>;
    stack[0] = SUBTREES - 1u + id.x % SUBTREES;
    var size = 1u;
    while size > 0u {
        size--;
        let node = stack[size];
        // The last leaf below it.
        let last = ((node + 2u) << (depth - firstLeadingBit(node + 1u))) - 2u;
        if last < own || any(low > boxes[2u * node + 1u].xyz) || any(boxes[2u * node].xyz > high) {
            continue;
        }
        if node + 1u >= LEAF_COUNT {
            let k = atomicAdd(&counts[0], 1u);
            if k < NEAR_ROOM {
                near[k] = vec2<u32>(leaf, node + 1u - LEAF_COUNT);
            }
        } else {
            stack[size] = 2u * node + 2u;
            stack[size + 1u] = 2u * node + 1u;
            size += 2u;
        }
    }
}

// Pairs.

// Weights of the point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn barycentric(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let ab = b - a;
    let ac = c - a;
    let d1 = dot(ab, p - a);
    let d2 = dot(ac, p - a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return vec3<f32>(1.0, 0.0, 0.0);
    }
    let d3 = dot(ab, p - b);
    let d4 = dot(ac, p - b);
    if d3 >= 0.0 && d4 <= d3 {
        return vec3<f32>(0.0, 1.0, 0.0);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return vec3<f32>(1.0 - t, t, 0.0);
    }
    let d5 = dot(ab, p - c);
    let d6 = dot(ac, p - c);
    if d6 >= 0.0 && d5 <= d6 {
        return vec3<f32>(0.0, 0.0, 1.0);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return vec3<f32>(1.0 - t, 0.0, t);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return vec3<f32>(0.0, 1.0 - t, t);
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return vec3<f32>(1.0, 0.0, 0.0);
    }
    return vec3<f32>(va, vb, vc) / sum;
}

// Parts of the way along two edges where they are nearest to each other (Ericson, 5.1.9).
fn nearest_of_edges(p0: vec3<f32>, p1: vec3<f32>, q0: vec3<f32>, q1: vec3<f32>) -> vec2<f32> {
    let d1 = p1 - p0;
    let d2 = q1 - q0;
    let r = p0 - q0;
    let a = dot(d1, d1);
    let e = dot(d2, d2);
    let f = dot(d2, r);
    if a <= 1e-20 || e <= 1e-20 {
        return vec2<f32>(0.0, select(0.0, clamp(f / e, 0.0, 1.0), e > 1e-20));
    }
    let b = dot(d1, d2);
    let c = dot(d1, r);
    let denominator = a * e - b * b;
    // Parallel edges: anywhere.
    var s = 0.5;
    if denominator > 1e-6 * a * e {
        s = clamp((b * f - c * e) / denominator, 0.0, 1.0);
    }
    let t = (b * s + f) / e;
    if t < 0.0 {
        return vec2<f32>(clamp(-c / a, 0.0, 1.0), 0.0);
    }
    if t > 1.0 {
        return vec2<f32>(clamp((b - c) / a, 0.0, 1.0), 1.0);
    }
    return vec2<f32>(s, t);
}

// Of the first `first` of four points and the rest.
fn nearest(q: array<vec3<f32>, 4>, first: u32) -> Nearest {
    var c: vec4<f32>;
    if first == 1u {
        c = vec4<f32>(1.0, -barycentric(q[0], q[1], q[2], q[3]));
    } else {
        let st = nearest_of_edges(q[0], q[1], q[2], q[3]);
        c = vec4<f32>(1.0 - st.x, st.x, st.y - 1.0, -st.y);
    }
    return Nearest(c, (q[0] * c.x + q[1] * c.y) + (q[2] * c.z + q[3] * c.w));
}

// Whether a place of the first side is so near to one of the other in the flat cloth that they do not push each other.
fn ringed(v: vec4<u32>, first: u32) -> bool {
    for (var i = 0u; i < first; i++) {
        for (var k = tables[RING + v[i]]; k < tables[RING + v[i] + 1u]; k++) {
            let other = tables[k];
            for (var j = first; j < 4u; j++) {
                if other == v[j] {
                    return true;
                }
            }
        }
    }
    return false;
}

// Notes a pair that may come to touch in this substep.
fn consider(v: vec4<u32>, first: u32) {
    let q = array<vec3<f32>, 4>(at(v.x), at(v.y), at(v.z), at(v.w));
    let w = array<vec3<f32>, 4>(by(v.x), by(v.y), by(v.z), by(v.w));
    var to = array<vec3<f32>, 4>(q[0] + w[0], q[1] + w[1], q[2] + w[2], q[3] + w[3]);
    // Boxes of what each side passes.
    var low = min(q[0], to[0]);
    var high = max(q[0], to[0]);
    var low_of_other = min(q[3], to[3]);
    var high_of_other = max(q[3], to[3]);
    for (var k = 1u; k < 3u; k++) {
        if k < first {
            low = min(low, min(q[k], to[k]));
            high = max(high, max(q[k], to[k]));
        } else {
            low_of_other = min(low_of_other, min(q[k], to[k]));
            high_of_other = max(high_of_other, max(q[k], to[k]));
        }
    }
    let reach = 2.0 * WITHIN_REACH;
    if any(low - reach > high_of_other) || any(low_of_other - reach > high) {
        return;
    }
    // A plane that keeps them apart as the substep begins and in its end does so all the while.
    let begun = nearest(q, first);
    let d = length(begun.between);
    var normal = vec3<f32>(0.0);
    if d > 1e-9 {
        normal = begun.between / d;
    }
    let ends_along = vec4<f32>(dot(to[0], normal), dot(to[1], normal), dot(to[2], normal), dot(to[3], normal));
    if min(d, gap(ends_along, first)) >= reach {
        return;
    }
    let k = atomicAdd(&counts[1], 1u);
    if k >= PAIR_ROOM {
        return;
    }
    let ends = nearest(to, first);
    var weights = vec4<f32>(0.0);
    if dot(ends.between, ends.between) < TOUCH * RADIUS * TOUCH * RADIUS && !ringed(v, first) {
        weights = ends.weights;
    }
    pairs[3u * k] = v;
    pairs[3u * k + 1u] = bitcast<vec4<u32>>(weights);
    pairs[3u * k + 2u] = vec4<u32>(bitcast<vec3<u32>>(normal), first);
}

fn triangle(k: u32) -> vec3<u32> {
    let t = LEAF_TRIANGLES + 3u * k;
    return vec3<u32>(tables[t], tables[t + 1u], tables[t + 2u]);
}

fn edge(k: u32) -> vec2<u32> {
    return vec2<u32>(tables[LEAF_EDGES + 2u * k], tables[LEAF_EDGES + 2u * k + 1u]);
}

// Whether what lies between three places comes near a box in this substep.
fn comes_near(v: vec3<u32>, low: vec3<f32>, high: vec3<f32>) -> bool {
    let q = array<vec3<f32>, 3>(at(v.x), at(v.y), at(v.z));
    let to = array<vec3<f32>, 3>(q[0] + by(v.x), q[1] + by(v.y), q[2] + by(v.z));
    let least = min(min(q[0], min(q[1], q[2])), min(to[0], min(to[1], to[2])));
    let most = max(max(q[0], max(q[1], q[2])), max(to[0], max(to[1], to[2])));
    return all(least <= high) && all(low <= most);
}

// A vertex of a leaf with triangles of another, or an edge with edges.
fn compare(own: u32, other: u32, item: u32, of_edges: bool) {
    let node = LEAF_COUNT - 1u + other;
    let low = boxes[2u * node].xyz - WITHIN_REACH;
    let high = boxes[2u * node + 1u].xyz + WITHIN_REACH;
    let first = tables[LEAVES + 6u * own + select(2u, 4u, of_edges)] + item;
    var v = vec2<u32>(0u);
    if of_edges {
        v = edge(first);
    } else {
        v = vec2<u32>(tables[LEAF_VERTICES + first]);
    }
    if !comes_near(v.xyy, low, high) {
        return;
    }
    let list = LEAVES + 6u * other + select(0u, 4u, of_edges);
    var k = tables[list];
    if of_edges && own == other {
        k = first + 1u;
    }
    for (; k < tables[list + 1u]; k++) {
        if of_edges {
            let f = edge(k);
            if all(v != f) && all(v != f.yx) {
                consider(vec4<u32>(v, f), 2u);
            }
        } else {
            let t = triangle(k);
            if all(t != v.xxx) {
                consider(vec4<u32>(v.x, t), 1u);
            }
        }
    }
}

fn length_of(list: u32) -> u32 {
    return tables[list + 1u] - tables[list];
}

// Each vertex of two leaves with triangles of the other, and each edge of one with those of the other.
@compute @workgroup_size(32)
fn pair(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
    @builtin(num_workgroups) groups: vec3<u32>
) {
    let count = min(atomicLoad(&counts[0]), NEAR_ROOM);
    for (var k = group.x; k < count; k += groups.x) {
        let a = near[k].x;
        let b = near[k].y;
        let one = length_of(LEAVES + 6u * a + 2u);
        let two = one + select(length_of(LEAVES + 6u * b + 2u), 0u, a == b);
        let items = two + length_of(LEAVES + 6u * a + 4u);
        for (var i = lane; i < items; i += 32u) {
            if i < one {
                compare(a, b, i, false);
            } else if i < two {
                compare(b, a, i - one, false);
            } else {
                compare(a, b, i - two, true);
            }
        }
    }
}

// What they do.

fn push(p: u32, way: vec3<f32>) {
    let whole = vec3<i32>(clamp(way, vec3<f32>(-0.25), vec3<f32>(0.25)) * UNITS);
    for (var k = 0u; k < 3u; k++) {
        if whole[k] > 0 {
            atomicMax(&pushes[6u * p + k], whole[k]);
        } else if whole[k] < 0 {
            atomicMax(&pushes[6u * p + 3u + k], -whole[k]);
        }
    }
}

// Pushes pairs apart that are nearer than the radius, with friction; those that were too near before, in time.
@compute @workgroup_size(64)
fn part(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let count = min(atomicLoad(&counts[1]), PAIR_ROOM);
    for (var k = id.x; k < count; k += 64u * groups.x) {
        let c = bitcast<vec4<f32>>(pairs[3u * k + 1u]);
        if all(c == vec4<f32>(0.0)) {
            continue;
        }
        let v = pairs[3u * k];
        let start = (at(v.x) * c.x + at(v.y) * c.y) + (at(v.z) * c.z + at(v.w) * c.w);
        let slide = (by(v.x) * c.x + by(v.y) * c.y) + (by(v.z) * c.z + by(v.w) * c.w);
        let apart = start + slide;
        let d = length(apart);
        if d >= RADIUS || d < 1e-10 {
            continue;
        }
        let w = vec4<f32>(state[SHIFT + v.x].w, state[SHIFT + v.y].w, state[SHIFT + v.z].w, state[SHIFT + v.w].w);
        let sum = dot(w * c, c);
        if sum <= 0.0 {
            continue;
        }
        let n = apart / d;
        let far = min(RADIUS - d, max(dot(start, n) + RECOVERY * H - d, 0.0));
        let aside = slide - n * dot(slide, n);
        let long = length(aside);
        let hold = select(0.0, min(FRICTION_BETWEEN * far / long, 1.0), long > 0.0);
        let way = (n * far - aside * hold) / sum;
        for (var i = 0u; i < 4u; i++) {
            push(v[i], way * (w[i] * c[i]));
        }
    }
}

fn gap(along: vec4<f32>, first: u32) -> f32 {
    if first == 1u {
        return along.x - max(along.y, max(along.z, along.w));
    }
    return min(along.x, along.y) - max(along.z, along.w);
}

// Stops pairs that would pass through each other.
@compute @workgroup_size(64)
fn guard(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let count = min(atomicLoad(&counts[1]), PAIR_ROOM);
    let floor_of_pairs = FLOOR * RADIUS;
    let tolerance = TOLERANCE * RADIUS;
    for (var k = id.x; k < count; k += 64u * groups.x) {
        let v = pairs[3u * k];
        let last = pairs[3u * k + 2u];
        let first = last.w;
        let plane = bitcast<vec3<f32>>(last.xyz);
        let q = array<vec3<f32>, 4>(at(v.x), at(v.y), at(v.z), at(v.w));
        let w = array<vec3<f32>, 4>(by(v.x), by(v.y), by(v.z), by(v.w));
        var along = vec4<f32>(dot(w[0], plane), dot(w[1], plane), dot(w[2], plane), dot(w[3], plane));
        let begun = vec4<f32>(dot(q[0], plane), dot(q[1], plane), dot(q[2], plane), dot(q[3], plane));
        let d = gap(begun, first);
        // They come nearer along the direction in which they are nearest.
        let part = select(1.0 - PART, PART, d > floor_of_pairs);
        let most = part * (d - floor_of_pairs);
        let nearer = -gap(along, first);
        if all(plane == vec3<f32>(0.0)) || nearer <= most + tolerance {
            continue;
        }
        let give = vec4<f32>(state[SHIFT + v.x].w, state[SHIFT + v.y].w, state[SHIFT + v.z].w, state[SHIFT + v.w].w);
        var low = along.x;
        var high = along.w;
        var one = give.x;
        var two = give.w;
        for (var i = 1u; i < 3u; i++) {
            if i < first {
                low = min(low, along[i]);
                one = max(one, give[i]);
            } else {
                high = max(high, along[i]);
                two = max(two, give[i]);
            }
        }
        if one + two <= 0.0 {
            continue;
        }
        let over = high - low - most;
        low += over * one / (one + two);
        high -= over * two / (one + two);
        for (var i = 0u; i < 4u; i++) {
            let back = select(min(high - along[i], 0.0), max(low - along[i], 0.0), i < first);
            if give[i] > 0.0 {
                push(v[i], plane * back);
            }
        }
    }
}

// Places give way to what pushes them, but not so far that they could meet what they are not paired with.
@compute @workgroup_size(64)
fn give_way(@builtin(global_invocation_id) id: vec3<u32>) {
    let p = id.x;
    if p >= N {
        return;
    }
    var way = vec3<f32>(0.0);
    for (var k = 0u; k < 3u; k++) {
        let along = atomicExchange(&pushes[6u * p + k], 0);
        let against = atomicExchange(&pushes[6u * p + 3u + k], 0);
        way[k] = f32(along - against) / UNITS;
    }
    if state[X + p].w > 0.0 {
        let went = state[WENT + p].xyz;
        let low = min(went, vec3<f32>(0.0)) - MARGIN;
        let high = max(went, vec3<f32>(0.0)) + MARGIN;
        state[U + p] = vec4<f32>(clamp(by(p) + way, low, high), 0.0);
    }
}
