// Textures: programs of operands before what is made of them. Twin of prepared/texture.rs; words as in rows/texture.rs.
//
// Drivers put every function in place of its call, so what is large is called from one place: `value_at` from the loop
// of `shade`, texels are read in one loop over the taps of a lookup.

const OP_CONSTANT: u32 = 1u;
const OP_IMAGE: u32 = 2u;
const OP_CLOTH: u32 = 3u;
const OP_CHECKERBOARD: u32 = 4u;
const OP_ATTRIBUTE: u32 = 5u;
const OP_SCALE: u32 = 6u;
const OP_PRODUCT: u32 = 7u;
const OP_STEP: u32 = 8u;
const OP_IMAGE_WORDS: u32 = 15u;

// Whether an operation occurs in the scene; what does not is left out when the shader is compiled.
fn has_operation(operation: u32) -> bool {
    return ((OPERATIONS >> operation) & 1u) != 0u;
}

fn wrap_index(i: i32, n: i32, wrap: u32) -> i32 {
    switch wrap {
        case 0u: { return i - n * i32(floor(f32(i) / f32(n))); }
        case 1u: {
            let m = i - 2 * n * i32(floor(f32(i) / f32(2 * n)));
            return select(2 * n - 1 - m, m, m < n);
        }
        default: { return clamp(i, 0, n - 1); }
    }
}

// A level of a pyramid: where its texels begin, its width and height.
struct Level {
    at: u32,
    size: vec2<i32>,
}

fn texture_level(levels: u32, i: u32) -> Level {
    let at = levels + 3u * i;
    return Level(word_at(at), vec2<i32>(i32(word_at(at + 1u)), i32(word_at(at + 2u))));
}

fn level_texel(level: Level, wrap: vec2<u32>, p: vec2<i32>) -> u32 {
    let x = wrap_index(p.x, level.size.x, wrap.x);
    let y = wrap_index(p.y, level.size.y, wrap.y);
    return u32(y * level.size.x + x);
}

// The finer of the two levels that a footprint lies between, and how far it is to the other.
fn footprint_level(levels: u32, count: u32, matrix: u32, footprint: f32) -> vec2<f32> {
    let x_axis = vec2<f32>(float_at(matrix), float_at(matrix + 1u));
    let y_axis = vec2<f32>(float_at(matrix + 2u), float_at(matrix + 3u));
    let size = texture_level(levels, 0u).size;
    let texels = footprint * max(length(x_axis), length(y_axis)) * f32(max(size.x, size.y));
    let level = min(log2(max(texels, 1.0)), f32(count - 1u));
    return vec2<f32>(floor(level), fract(level));
}

fn affine2(at: u32, p: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(
        float_at(at) * p.x + float_at(at + 2u) * p.y + float_at(at + 4u),
        float_at(at + 1u) * p.x + float_at(at + 3u) * p.y + float_at(at + 5u),
    );
}

// The attribute number `i` of the scene where the point is; its fourth component is 0 where the mesh has none.
fn attribute_of(point: ShadingPoint, i: u32) -> vec4<f32> {
    if (i == NONE || point.attributes == NONE) {
        return vec4<f32>(0.0);
    }
    let row = point.attributes + 4u * i;
    let begin = word_at(row);
    if (begin == NONE) {
        return vec4<f32>(0.0);
    }
    let width = word_at(row + 1u);
    let first = word_at(row + 3u);
    var index = vec3<u32>(point.triangle);
    if (word_at(row + 2u) == 0u) {
        index = corners_of(point.triangle);
    }
    let at = begin + (index - first) * width;
    let w = vec3<f32>(1.0 - point.barycentric.x - point.barycentric.y, point.barycentric);
    if (width == 1u) {
        return vec4<f32>(vec3<f32>(w.x * float_at(at.x) + w.y * float_at(at.y) + w.z * float_at(at.z)), 1.0);
    }
    return vec4<f32>(w.x * vec3_at(at.x) + w.y * vec3_at(at.y) + w.z * vec3_at(at.z), 1.0);
}

// The coordinates that a texture is looked up by: the surface's, moved by `offset`, or those that the attribute `held` has.
fn texture_uv(point: ShadingPoint, offset: vec2<f32>, held: u32) -> vec2<f32> {
    if (held != NONE) {
        let a = attribute_of(point, held);
        if (a.w > 0.0) {
            return a.xy;
        }
    }
    return point.uv + offset;
}

// The finer of two levels to look at, how far it is to the other, and how many texels to mix.
struct Taps {
    uv: vec2<f32>,
    wrap: vec2<u32>,
    levels: u32,
    count: u32,
    level: vec2<f32>,
    taps: u32,
    nearest: bool,
}

// Texel number `i` of a lookup, as an index from where the texels of its level begin, and its weight.
struct Tap {
    level: u32,
    texel: u32,
    weight: f32,
}

fn tap_at(t: Taps, i: u32) -> Tap {
    let level = texture_level(t.levels, min(u32(t.level.x) + i / 4u, t.count - 1u));
    if (t.nearest) {
        return Tap(level.at, level_texel(level, t.wrap, vec2<i32>(floor(t.uv * vec2<f32>(level.size)))), 1.0);
    }
    let p = t.uv * vec2<f32>(level.size) - 0.5;
    let f = p - floor(p);
    let corner = vec2<u32>(i % 2u, (i / 2u) % 2u);
    let part = select(1.0 - f.x, f.x, corner.x == 1u) * select(1.0 - f.y, f.y, corner.y == 1u);
    let of_level = select(t.level.y, 1.0 - t.level.y, i < 4u);
    return Tap(level.at, level_texel(level, t.wrap, vec2<i32>(floor(p)) + vec2<i32>(corner)), part * of_level);
}

// How to look up an image or, where `of_cloth`, the moments of a cloth: `at` is where its matrix begins.
fn taps_of(point: ShadingPoint, offset: vec2<f32>, at: u32, of_cloth: bool) -> Taps {
    if (of_cloth) {
        let uv = affine2(at, point.uv + offset);
        let count = word_at(at + 8u);
        let l = footprint_level(word_at(at + 7u), count, at, point.footprint);
        return Taps(uv, vec2<u32>(word_at(at + 6u)), word_at(at + 7u), count, l, 8u, false);
    }
    let uv = affine2(at, texture_uv(point, offset, word_at(at + 6u)));
    let filtering = word_at(at + 7u);
    let levels = word_at(at + 12u);
    let count = word_at(at + 13u);
    var l = vec2<f32>(0.0);
    if (filtering == 2u) {
        l = footprint_level(levels, count, at, point.footprint);
    }
    var taps = select(4u, 8u, l.y > 0.0);
    taps = select(taps, 1u, filtering == 0u);
    return Taps(uv, vec2<u32>(word_at(at + 8u), word_at(at + 9u)), levels, count, l, taps, filtering == 0u);
}

fn texture_program(point: ShadingPoint, offset: vec2<f32>, program: u32) -> vec4<f32> {
    var stack: array<vec4<f32>, OPERANDS>;
    var n = 0u;
    var pc = program;
    loop {
        let op = word_at(pc);
        switch op {
            case OP_CONSTANT: {
                stack[n] = vec4<f32>(vec3_at(pc + 1u), f32(word_at(pc + 4u)));
                n += 1u;
                pc += 5u;
            }
            case OP_IMAGE, OP_CLOTH: {
                let of_cloth = has_operation(OP_CLOTH) && op == OP_CLOTH;
                let taps = taps_of(point, offset, pc + 1u, of_cloth);
                let width = select(1u, 3u, of_cloth);
                var c = vec4<f32>(0.0);
                for (var i = 0u; i < taps.taps; i += 1u) {
                    let tap = tap_at(taps, i);
                    c += tap.weight * texels[tap.level + width * tap.texel];
                }
                // The fourth component: a plain number in every channel.
                if (of_cloth) {
                    c.w = 0.0;
                    pc += 10u;
                } else {
                    let channel = word_at(pc + 11u);
                    if (channel > 0u) {
                        c = vec4<f32>(vec3<f32>(c[channel - 1u]), 1.0);
                    } else {
                        c.w = f32(word_at(pc + 12u));
                    }
                    pc += OP_IMAGE_WORDS;
                }
                stack[n] = c;
                n += 1u;
            }
            case OP_CHECKERBOARD: {
                n -= 1u;
                if (has_operation(OP_CHECKERBOARD)) {
                    let uv = affine2(pc + 1u, texture_uv(point, offset, word_at(pc + 7u)));
                    let half = (uv - floor(uv)) > vec2<f32>(0.5);
                    stack[n - 1u] = select(stack[n], stack[n - 1u], half.x == half.y);
                }
                pc += 8u;
            }
            case OP_ATTRIBUTE: {
                if (has_operation(OP_ATTRIBUTE)) {
                    stack[n] = vec4<f32>(attribute_of(point, word_at(pc + 1u)).xyz, 0.0);
                }
                n += 1u;
                pc += 2u;
            }
            case OP_SCALE: {
                let factor = vec3_at(pc + 1u);
                let grey = select(0.0, stack[n - 1u].w, factor.x == factor.y && factor.y == factor.z);
                stack[n - 1u] = vec4<f32>(stack[n - 1u].xyz * factor, grey);
                pc += 4u;
            }
            case OP_PRODUCT: {
                n -= 1u;
                stack[n - 1u] = stack[n - 1u] * stack[n];
                pc += 1u;
            }
            case OP_STEP: {
                let c = stack[n - 1u];
                let number = select(luminance(c.xyz), c.x, c.w > 0.0);
                stack[n - 1u] = vec4<f32>(vec3<f32>(select(0.0, 1.0, number >= float_at(pc + 1u))), 1.0);
                pc += 2u;
            }
            default: { break; }
        }
        if (op == 0u || op > OP_STEP) {
            break;
        }
    }
    return stack[0];
}

// A value of four words as a colour; the fourth component is 1 where it is a plain number.
fn value_at(point: ShadingPoint, offset: vec2<f32>, at: u32) -> vec4<f32> {
    let tag = word_at(at);
    if (HAS_PROGRAMS && tag == 2u) {
        return texture_program(point, offset, word_at(at + 1u));
    }
    return vec4<f32>(vec3_at(at + 1u), select(0.0, 1.0, tag == 0u));
}

fn as_number(c: vec4<f32>) -> f32 {
    return select(luminance(c.xyz), c.x, c.w > 0.0);
}

// Where a value is looked up four times for its slope: at the corners of the bilinear patch between texels of a plain
// image, or else on both sides of the point.
struct Patch {
    is_patch: bool,
    // Within the patch.
    t: vec2<f32>,
    corner: vec2<f32>,
    size: vec2<f32>,
    inverse: mat2x2<f32>,
    matrix: mat2x2<f32>,
}

fn patch_of(point: ShadingPoint, at: u32) -> Patch {
    let zero = mat2x2<f32>(1.0, 0.0, 0.0, 1.0);
    let none = Patch(false, vec2<f32>(0.0), vec2<f32>(0.0), vec2<f32>(1.0), zero, zero);
    if (word_at(at) != 2u) {
        return none;
    }
    let program = word_at(at + 1u);
    let image = program + 1u;
    if (word_at(program) != OP_IMAGE || word_at(program + OP_IMAGE_WORDS) != 0u || word_at(image + 6u) != NONE
        || word_at(image + 7u) != 1u) {
        return none;
    }
    let size = vec2<f32>(texture_level(word_at(image + 12u), 0u).size);
    let m = mat2x2<f32>(float_at(image), float_at(image + 1u), float_at(image + 2u), float_at(image + 3u));
    let det = m[0].x * m[1].y - m[1].x * m[0].y;
    let inverse = mat2x2<f32>(m[1].y, -m[0].y, -m[1].x, m[0].x) * (1.0 / det);
    let p = affine2(image, point.uv) * size - 0.5;
    return Patch(det != 0.0, p - floor(p), floor(p), size, inverse, m);
}

// Offset of lookup `i` of four.
fn patch_offset(patch_: Patch, i: u32, step: vec2<f32>) -> vec2<f32> {
    if (patch_.is_patch) {
        let d = vec2<f32>(f32(i % 2u), f32(i / 2u)) - patch_.t;
        return patch_.inverse * (d / patch_.size);
    }
    let sign = select(1.0, -1.0, i % 2u == 1u);
    return select(vec2<f32>(0.0, sign), vec2<f32>(sign, 0.0), i < 2u) * step;
}

// d/du and d/dv from what the four lookups found.
fn patch_slope(patch_: Patch, h: vec4<f32>, step: vec2<f32>) -> vec2<f32> {
    if (patch_.is_patch) {
        let slope = vec2<f32>(mix(h.y - h.x, h.w - h.z, patch_.t.y), mix(h.z - h.x, h.w - h.y, patch_.t.x)) * patch_.size;
        return vec2<f32>(dot(patch_.matrix[0], slope), dot(patch_.matrix[1], slope));
    }
    return vec2<f32>(h.x - h.y, h.z - h.w) / (2.0 * step);
}

struct ClothAt {
    normal: vec3<f32>,
    tangent: vec3<f32>,
}
