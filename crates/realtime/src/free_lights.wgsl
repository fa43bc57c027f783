// Which lights without extent nothing stands in the way of, for all places that a tile of 8 by 8 pixels sees at once: a word a tile,
// a bit a light. Where it is set no ray is needed; where it is not, something may be in between.
//
// All ways from the places to the light lie in the boxes from the one around the places to the light, each of which is so far along as
// the others. A box of the hierarchy that none of those touches is met by none of the ways.

@group(2) @binding(0) var free_lights: texture_storage_2d<r32uint, write>;

// Several draws are seen.
const SEVERAL: u32 = 0xfffffffeu;

// What is around the places of some pixels.
struct Around {
    low: vec3<f32>,
    high: vec3<f32>,
    low_normal: vec3<f32>,
    high_normal: vec3<f32>,
    error: f32,
    draw: u32,
}

fn around_none() -> Around {
    return Around(vec3<f32>(3e38), vec3<f32>(-3e38), vec3<f32>(2.0), vec3<f32>(-2.0), 0.0, NONE);
}

fn around_both(a: Around, b: Around) -> Around {
    let draw = select(select(SEVERAL, a.draw, a.draw == b.draw || b.draw == NONE), b.draw, a.draw == NONE);
    return Around(
        min(a.low, b.low), max(a.high, b.high), min(a.low_normal, b.low_normal), max(a.high_normal, b.high_normal),
        max(a.error, b.error), draw,
    );
}

// Boxes from one to another: the first one's corners, and one over the ways of these to the other's.
struct Shaft {
    low: vec3<f32>,
    high: vec3<f32>,
    low_inverse: vec3<f32>,
    high_inverse: vec3<f32>,
}

// No component is zero: what would be infinite is large instead, and never times zero.
fn inverse_of(way: vec3<f32>) -> vec3<f32> {
    let least = vec3<f32>(1e-20);
    return 1.0 / select(way, select(-least, least, way >= vec3<f32>(0.0)), abs(way) < least);
}

fn shaft(low: vec3<f32>, high: vec3<f32>, end_low: vec3<f32>, end_high: vec3<f32>) -> Shaft {
    return Shaft(low, high, inverse_of(end_low - low), inverse_of(end_high - high));
}

// Around a box, in the coordinates of an instance, whose rows begin at `row`: half its size, and its middle.
struct Middle {
    middle: vec3<f32>,
    half: vec3<f32>,
}

fn box_in_instance(row: u32, low: vec3<f32>, high: vec3<f32>) -> Middle {
    let x = bitcast<vec4<f32>>(hierarchy[row]);
    let y = bitcast<vec4<f32>>(hierarchy[row + 1u]);
    let z = bitcast<vec4<f32>>(hierarchy[row + 2u]);
    let m = 0.5 * (low + high) - vec3<f32>(x.w, y.w, z.w);
    let h = 0.5 * (high - low);
    return Middle(
        vec3<f32>(dot(x.xyz, m), dot(y.xyz, m), dot(z.xyz, m)),
        vec3<f32>(dot(abs(x.xyz), h), dot(abs(y.xyz), h), dot(abs(z.xyz), h)),
    );
}

// When boxes of the shaft overlap four others along one axis: not before x, not after y. 0 is the first, 1 the last.
struct Overlap {
    first: vec4<f32>,
    last: vec4<f32>,
}

fn overlap(o: Overlap, low: vec4<f32>, high: vec4<f32>, s: vec4<f32>) -> Overlap {
    // The lower corner is below `high` until then or from then on, and the upper one above `low`.
    let a = (high - s.x) * s.z;
    let b = (low - s.y) * s.w;
    var r = o;
    if (s.z > 0.0) {
        r.last = min(r.last, a);
    } else {
        r.first = max(r.first, a);
    }
    if (s.w > 0.0) {
        r.first = max(r.first, b);
    } else {
        r.last = min(r.last, b);
    }
    return r;
}

// Bits of the children of the node at `row` that the shaft touches, but for `passed`.
fn children_touched(row: u32, s: Shaft, passed: u32) -> u32 {
    let head = hierarchy[row];
    let children = hierarchy[row + 1u];
    let low = hierarchy[row + 2u];
    let high = hierarchy[row + 3u];
    let step = bitcast<vec3<f32>>(((vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u)) << vec3<u32>(23u));
    let corner = bitcast<vec3<f32>>(head.xyz);
    var o = Overlap(vec4<f32>(0.0), vec4<f32>(1.0));
    o = overlap(o, corner.x + step.x * bytes_of(low.x), corner.x + step.x * bytes_of(low.w),
        vec4<f32>(s.low.x, s.high.x, s.low_inverse.x, s.high_inverse.x));
    o = overlap(o, corner.y + step.y * bytes_of(low.y), corner.y + step.y * bytes_of(high.x),
        vec4<f32>(s.low.y, s.high.y, s.low_inverse.y, s.high_inverse.y));
    o = overlap(o, corner.z + step.z * bytes_of(low.z), corner.z + step.z * bytes_of(high.y),
        vec4<f32>(s.low.z, s.high.z, s.low_inverse.z, s.high_inverse.z));
    let there = (children != vec4<u32>(NONE)) & (children != vec4<u32>(passed));
    let bits = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), (o.first <= o.last + 1e-5) & there);
    return bits.x | bits.y | bits.z | bits.w;
}

// Whether there is no box of triangles between two boxes, `passed` left out.
fn is_free(low: vec3<f32>, high: vec3<f32>, end_low: vec3<f32>, end_high: vec3<f32>, passed: u32) -> bool {
    let world = shaft(low, high, end_low, end_high);
    var s = world;
    // Nodes, each with bits of the children yet to visit.
    var stack: array<u32, STACK>;
    var size = 0u;
    var inside = false;
    var outside = 0u;
    var bits = children_touched(0u, s, passed);
    var node = 0u;
    var free = true;
    loop {
        if (bits != 0u) {
            stack[size] = (node << 4u) | bits;
            size += 1u;
        }
        if (size == 0u) {
            break;
        }
        if (inside && size == outside) {
            inside = false;
            s = world;
        }
        let top = stack[size - 1u];
        let slot = firstTrailingBit(top);
        let left = top & (top - 1u);
        stack[size - 1u] = left;
        size -= u32((left & 15u) == 0u);
        node = hierarchy[4u * (top >> 4u) + 1u][slot];
        if ((node & IS_LEAF) != 0u) {
            if (inside) {
                free = false;
                break;
            }
            let row = node & 0x1fffffffu;
            node = hierarchy[row + 3u].x;
            inside = true;
            outside = size;
            let a = box_in_instance(row, low, high);
            let b = box_in_instance(row, end_low, end_high);
            s = shaft(a.middle - a.half, a.middle + a.half, b.middle - b.half, b.middle + b.half);
        }
        bits = children_touched(4u * node, s, passed);
    }
    return free;
}

// Whether light `emitter` is free for all that is seen.
fn is_light_free(emitter: u32, around: Around) -> bool {
    let e = emitter_at(emitter);
    let kind = word_at(e);
    // Ways that rounding may lead astray.
    let coordinates = max(abs(around.low), abs(around.high));
    let room = 2.0 * around.error + 8.0 * POSITION_ERROR * max(coordinates.x, max(coordinates.y, coordinates.z));
    let low = around.low - room;
    let high = around.high + room;
    // From the places to the light: between these two.
    var end_low: vec3<f32>;
    var end_high: vec3<f32>;
    if (kind == EMITTER_POINT || kind == EMITTER_SPOT || kind == EMITTER_PROJECTOR) {
        let at = vec3_at(e + select(1u, 13u, kind == EMITTER_PROJECTOR));
        end_low = at - room - 8.0 * POSITION_ERROR * abs(at);
        end_high = at + room + 8.0 * POSITION_ERROR * abs(at);
    } else if (kind == EMITTER_DIRECTIONAL) {
        // Past everything.
        let head = hierarchy[0];
        let exponents = (vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u);
        let size = 255.0 * bitcast<vec3<f32>>(exponents << vec3<u32>(23u));
        let away = abs(0.5 * (low + high) - bitcast<vec3<f32>>(head.xyz) - 0.5 * size) + size + (high - low);
        let way = vec3_at(e + 1u) * -(away.x + away.y + away.z);
        let more = room + 8.0 * POSITION_ERROR * abs(way);
        end_low = low + way - more;
        end_high = high + way + more;
    } else {
        return false;
    }
    // Cosines to normals are between these.
    let a = around.low_normal * (end_low - high);
    let b = around.low_normal * (end_high - low);
    let c = around.high_normal * (end_low - high);
    let d = around.high_normal * (end_high - low);
    let least = min(min(a, b), min(c, d));
    let most = max(max(a, b), max(c, d));
    var passed = NOTHING;
    if (around.draw != SEVERAL) {
        let row = instance_row(around.draw);
        let clear = hierarchy[row + 3u].w;
        let to_front = (clear & 1u) != 0u && least.x + least.y + least.z > 0.0;
        let to_back = (clear & 2u) != 0u && most.x + most.y + most.z < 0.0;
        passed = select(NOTHING, IS_LEAF | row, clear == 3u || to_front || to_back);
    }
    return is_free(low, high, end_low, end_high, passed);
}

// An invocation is a tile: as fast on a software GPU as one a pixel that brings places together, and shorter.
@compute @workgroup_size(8, 8)
fn find_free_lights(@builtin(global_invocation_id) tile: vec3<u32>) {
    var around = around_none();
    for (var i = 0u; i < 64u; i += 1u) {
        let pixel = 8u * tile.xy + vec2<u32>(i & 7u, i >> 3u);
        if (pixel.x < view.window.z && pixel.y < view.window.w) {
            let hit = camera_hit(pixel, pixel_ray(pixel));
            if (hit.draw != NONE) {
                let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
                let n = s.geometric_normal;
                around = around_both(around, Around(s.position, s.position, n, n, s.error, hit.draw));
            }
        }
    }
    var found = 0u;
    if (around.draw != NONE) {
        for (var light = 0u; light < min(plain_count(), 32u); light += 1u) {
            found |= select(0u, 1u << light, is_light_free(light, around));
        }
    }
    if (all(tile.xy < textureDimensions(free_lights))) {
        textureStore(free_lights, tile.xy, vec4<u32>(found, 0u, 0u, 0u));
    }
}
