// Rays through the hierarchy that hierarchy.rs builds; the layout is said there.
//
// Triangles: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection". Zero counts as inside, and so does
// what rounding cannot tell from it: compilers may contract a - b to a fused operation on one side of an edge only.
// At equal distance the smaller (draw, triangle) is met, so the order of the tree does not show.

const STACK: u32 = 40u;
const IS_LEAF: u32 = 0x80000000u;
const MISS: u32 = 0xffffffffu;
// Go back to the last node with children yet to visit.
const UP: u32 = 0xfffffffeu;
// The root is no child.
const NOTHING: u32 = 0u;

// Where a ray meets a surface: distance in lengths of its direction, weights of the second and third corner.
// `draw` is NONE where it meets nothing.
struct Hit {
    t: f32,
    b1: f32,
    b2: f32,
    triangle: u32,
    draw: u32,
}

// A ray in the coordinates of the world or of a mesh.
struct LocalRay {
    origin: vec3<f32>,
    inverse: vec3<f32>,
    // The axis along which it is fastest becomes z; `shear` then brings it onto that axis.
    axis: u32,
    shear: vec3<f32>,
}

fn permuted(v: vec3<f32>, axis: u32) -> vec3<f32> {
    return select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn local_ray(origin: vec3<f32>, dir: vec3<f32>) -> LocalRay {
    let size = abs(dir);
    let largest = max(size.x, max(size.y, size.z));
    // No component is zero: what would be infinite is large instead, and never times zero.
    let least = vec3<f32>(largest * 1e-18);
    let d = select(dir, select(-least, least, dir >= vec3<f32>(0.0)), size < least);
    var axis = 2u;
    if (size.x >= size.y && size.x >= size.z) {
        axis = 0u;
    } else if (size.y >= size.z) {
        axis = 1u;
    }
    let p = permuted(dir, axis);
    return LocalRay(origin, 1.0 / d, axis, vec3<f32>(p.x / p.z, p.y / p.z, 1.0 / p.z));
}

// The ray in the coordinates of an instance, whose rows begin at `row`; t stays the same.
fn ray_in_instance(row: u32, origin: vec3<f32>, dir: vec3<f32>) -> LocalRay {
    let x = bitcast<vec4<f32>>(hierarchy[row]);
    let y = bitcast<vec4<f32>>(hierarchy[row + 1u]);
    let z = bitcast<vec4<f32>>(hierarchy[row + 2u]);
    let o = origin - vec3<f32>(x.w, y.w, z.w);
    return local_ray(
        vec3<f32>(dot(x.xyz, o), dot(y.xyz, o), dot(z.xyz, o)),
        vec3<f32>(dot(x.xyz, dir), dot(y.xyz, dir), dot(z.xyz, dir)),
    );
}

fn instance_row(draw: u32) -> u32 {
    return 4u * (max(arrayLength(&draws), 1u) + draw);
}

fn bytes_of(word: u32) -> vec4<f32> {
    return vec4<f32>((vec4<u32>(word) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u));
}

// For each child of the node at `row` MISS, or a key that grows with the distance at which the ray enters its box and
// whose last two bits are the child. `passed`: a child that is not there.
fn child_keys(row: u32, children: vec4<u32>, r: LocalRay, t_min: f32, t_max: f32, passed: u32) -> vec4<u32> {
    let head = hierarchy[row];
    let low = hierarchy[row + 2u];
    let high = hierarchy[row + 3u];
    let step = bitcast<vec3<f32>>(((vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u)) << vec3<u32>(23u));
    let s = step * r.inverse;
    let o = (bitcast<vec3<f32>>(head.xyz) - r.origin) * r.inverse;
    // Eight roundings of the largest number involved, so that no box is missed which the exact ray touches.
    let error = (abs(o) + 255.0 * abs(s)) * 4.8e-7;
    let lower = vec3<u32>(low.x, low.y, low.z);
    let upper = vec3<u32>(low.w, high.x, high.y);
    let forward = r.inverse >= vec3<f32>(0.0);
    let near = select(upper, lower, forward);
    let far = select(lower, upper, forward);
    let n = o - error;
    let f = o + error;
    let enter = max(
        max(bytes_of(near.x) * s.x + n.x, bytes_of(near.y) * s.y + n.y),
        max(bytes_of(near.z) * s.z + n.z, vec4<f32>(t_min)),
    );
    let leave = min(
        min(bytes_of(far.x) * s.x + f.x, bytes_of(far.y) * s.y + f.y),
        min(bytes_of(far.z) * s.z + f.z, vec4<f32>(t_max)),
    );
    let key = (bitcast<vec4<u32>>(enter) & vec4<u32>(0xfffffffcu)) | vec4<u32>(0u, 1u, 2u, 3u);
    let there = (children != vec4<u32>(NONE)) & (children != vec4<u32>(passed));
    return select(vec4<u32>(MISS), key, (enter <= leave) & there);
}

// Edge functions of the ray and a triangle, and the corners' distances along the ray, scaled.
struct Edges {
    inside: bool,
    weights: vec3<f32>,
    z: vec3<f32>,
}

fn edges(indices: vec3<u32>, r: LocalRay) -> Edges {
    let a = permuted(vertices[indices.x].position - r.origin, r.axis);
    let b = permuted(vertices[indices.y].position - r.origin, r.axis);
    let c = permuted(vertices[indices.z].position - r.origin, r.axis);
    let x = vec3<f32>(a.x, b.x, c.x) - r.shear.x * vec3<f32>(a.z, b.z, c.z);
    let y = vec3<f32>(a.y, b.y, c.y) - r.shear.y * vec3<f32>(a.z, b.z, c.z);
    let p = x.zxy * y.yzx;
    let q = y.zxy * x.yzx;
    let w = p - q;
    let weights = select(w, vec3<f32>(0.0), abs(w) <= 1.2e-7 * (abs(p) + abs(q)));
    let inside = all(weights >= vec3<f32>(0.0)) || all(weights <= vec3<f32>(0.0));
    return Edges(inside, weights, r.shear.z * vec3<f32>(a.z, b.z, c.z));
}

// What a ray that leaves a surface of `draw` passes over: that draw where nothing of it lies on the side that it leaves to.
fn passed_over(draw: u32, to_back: bool) -> u32 {
    let row = instance_row(draw);
    return select(NOTHING, IS_LEAF | row, ((hierarchy[row + 3u].w >> u32(to_back)) & 1u) != 0u);
}

// With `any_hit` the result's t is the share of light that passes, else the nearest hit; `past_fuel`: what burns is not there;
// `passed`: see `passed_over`.
fn traverse(
    origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32, any_hit: bool, past_fuel: bool, passed: u32,
) -> Hit {
    var best = Hit(t_max, 0.0, 0.0, NONE, NONE);
    var through = 1.0;
    let world = local_ray(origin, dir);
    var ray = world;
    var stack: array<u32, STACK>;
    var size = 0u;
    // Inside a mesh: its draw, its flags, and what the stack held before.
    var draw = NONE;
    var flags = 0u;
    var outside = 0u;
    var at = 0u;
    loop {
        // Down to the next leaf.
        loop {
            if (at == UP) {
                if (draw != NONE && size == outside) {
                    draw = NONE;
                    ray = world;
                }
                if (size == 0u) {
                    break;
                }
                let entry = stack[size - 1u];
                let count = (entry >> 6u) & 3u;
                if (count == 1u) {
                    size -= 1u;
                } else {
                    stack[size - 1u] = (entry & 0xffffff00u) | ((count - 1u) << 6u) | ((entry & 63u) >> 2u);
                }
                at = hierarchy[4u * (entry >> 8u) + 1u][entry & 3u];
            }
            if ((at & IS_LEAF) != 0u) {
                break;
            }
            let row = 4u * at;
            let children = hierarchy[row + 1u];
            let keys = child_keys(row, children, ray, t_min, best.t, passed);
            // Sorted, the nearest first.
            let a = vec2<u32>(min(keys.x, keys.y), min(keys.z, keys.w));
            let b = vec2<u32>(max(keys.x, keys.y), max(keys.z, keys.w));
            let nearest = min(a.x, a.y);
            let farthest = max(b.x, b.y);
            let inner = vec2<u32>(max(a.x, a.y), min(b.x, b.y));
            let second = min(inner.x, inner.y);
            let third = max(inner.x, inner.y);
            if (second != MISS) {
                // One entry for all others: the node, how many, and in which order.
                let count = 1u + u32(third != MISS) + u32(farthest != MISS);
                let order = (second & 3u) | ((third & 3u) << 2u) | ((farthest & 3u) << 4u);
                stack[size] = (at << 8u) | (count << 6u) | order;
                size += 1u;
            }
            let xy = select(children.x, children.y, (nearest & 1u) != 0u);
            let zw = select(children.z, children.w, (nearest & 1u) != 0u);
            at = select(UP, select(xy, zw, (nearest & 2u) != 0u), nearest != MISS);
        }
        if (at == UP) {
            break;
        }
        if (draw == NONE) {
            let row = at & 0x1fffffffu;
            let head = hierarchy[row + 3u];
            draw = head.y;
            flags = head.z;
            if (past_fuel && (flags & FUEL) != 0u) {
                draw = NONE;
                at = UP;
                continue;
            }
            outside = size;
            ray = ray_in_instance(row, origin, dir);
            at = head.x;
            continue;
        }
        let first = at & 0x1fffffffu;
        let last = first + ((at >> 29u) & 3u);
        for (var i = first; i <= last; i++) {
            let row = hierarchy[i];
            let e = edges(row.xyz, ray);
            let sum = e.weights.x + e.weights.y + e.weights.z;
            if (!e.inside || sum == 0.0) {
                continue;
            }
            let b = e.weights / sum;
            let t = dot(b, e.z);
            if (!(t > t_min && t <= best.t)) {
                continue;
            }
            if (any_hit) {
                if ((flags & SEE_THROUGH) != 0u) {
                    through *= passes(draw, row.w, b.yz, dir);
                } else {
                    through = 0.0;
                }
                // Nothing is left to look for.
                size = select(size, 0u, through <= 0.0);
                outside = select(outside, 0u, through <= 0.0);
            } else if (t < best.t || draw < best.draw || (draw == best.draw && row.w < best.triangle)) {
                best = Hit(t, b.y, b.z, row.w, draw);
            }
        }
        at = UP;
    }
    if (any_hit) {
        best.t = through;
    }
    return best;
}

// The nearest surface at t_min < t <= t_max; `dir` need not be of unit length.
fn trace_closest(origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32) -> Hit {
    return traverse(origin, dir, t_min, t_max, false, false, NOTHING);
}

// The share of light that passes between t_min and t_max, by `passes` where surfaces are see-through.
fn trace_any(origin: vec3<f32>, dir: vec3<f32>, t_min: f32, t_max: f32) -> f32 {
    return traverse(origin, dir, t_min, t_max, true, false, NOTHING).t;
}

// Where a ray meets the plane of a triangle that it is known to meet, give or take rounding.
fn intersect_triangle(draw: u32, triangle: u32, origin: vec3<f32>, dir: vec3<f32>) -> Hit {
    let e = edges(corners_of(triangle), ray_in_instance(instance_row(draw), origin, dir));
    let sum = e.weights.x + e.weights.y + e.weights.z;
    var b = max(e.weights * sign(sum), vec3<f32>(0.0));
    let total = b.x + b.y + b.z;
    b = select(vec3<f32>(1.0 / 3.0), b / total, total > 0.0);
    return Hit(dot(b, e.z), b.y, b.z, triangle, draw);
}
