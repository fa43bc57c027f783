// Textures: programs of operands before what is made of them. Twin of prepared/texture.rs; words as in rows/texture.rs.

const OP_CONSTANT: u32 = 1u;
const OP_IMAGE: u32 = 2u;
const OP_CLOTH: u32 = 3u;
const OP_CHECKERBOARD: u32 = 4u;
const OP_ATTRIBUTE: u32 = 5u;
const OP_SCALE: u32 = 6u;
const OP_PRODUCT: u32 = 7u;
const OP_STEP: u32 = 8u;
const OP_IMAGE_WORDS: u32 = 15u;

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

fn level_texel(level: Level, wrap: vec2<u32>, p: vec2<i32>) -> vec4<f32> {
    let x = wrap_index(p.x, level.size.x, wrap.x);
    let y = wrap_index(p.y, level.size.y, wrap.y);
    return texel_at(level.at + u32(y * level.size.x + x));
}

fn level_bilinear(level: Level, wrap: vec2<u32>, uv: vec2<f32>) -> vec4<f32> {
    let p = uv * vec2<f32>(level.size) - 0.5;
    let corner = floor(p);
    let t = p - corner;
    let c = vec2<i32>(corner);
    let top = mix(level_texel(level, wrap, c), level_texel(level, wrap, c + vec2<i32>(1, 0)), t.x);
    let bottom = mix(level_texel(level, wrap, c + vec2<i32>(0, 1)), level_texel(level, wrap, c + vec2<i32>(1, 1)), t.x);
    return mix(top, bottom, t.y);
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
        index = triangle_at(point.triangle);
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

fn image_lookup(point: ShadingPoint, offset: vec2<f32>, at: u32) -> vec4<f32> {
    let uv = affine2(at, texture_uv(point, offset, word_at(at + 6u)));
    let filtering = word_at(at + 7u);
    let wrap = vec2<u32>(word_at(at + 8u), word_at(at + 9u));
    let channel = word_at(at + 10u);
    let levels = word_at(at + 12u);
    let count = word_at(at + 13u);
    let finest = texture_level(levels, 0u);
    var c: vec4<f32>;
    if (filtering == 0u) {
        c = level_texel(finest, wrap, vec2<i32>(floor(uv * vec2<f32>(finest.size))));
    } else {
        var l = vec2<f32>(0.0);
        if (filtering == 2u) {
            l = footprint_level(levels, count, at, point.footprint);
        }
        c = level_bilinear(texture_level(levels, u32(l.x)), wrap, uv);
        if (l.y > 0.0 && u32(l.x) + 1u < count) {
            c = mix(c, level_bilinear(texture_level(levels, u32(l.x) + 1u), wrap, uv), l.y);
        }
    }
    if (channel > 0u) {
        return vec4<f32>(vec3<f32>(c[channel - 1u]), 1.0);
    }
    // The fourth component: a plain number in every channel.
    return vec4<f32>(c.xyz, f32(word_at(at + 11u)));
}

fn texture_program(point: ShadingPoint, offset: vec2<f32>, program: u32) -> vec4<f32> {
    var stack: array<vec4<f32>, 8>;
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
            case OP_IMAGE: {
                stack[n] = image_lookup(point, offset, pc + 1u);
                n += 1u;
                pc += OP_IMAGE_WORDS;
            }
            case OP_CLOTH: {
                stack[n] = vec4<f32>(cloth_texel(point, offset, pc + 1u).diffuse, 0.0);
                n += 1u;
                pc += 10u;
            }
            case OP_CHECKERBOARD: {
                let uv = affine2(pc + 1u, texture_uv(point, offset, word_at(pc + 7u)));
                let half = (uv - floor(uv)) > vec2<f32>(0.5);
                n -= 1u;
                stack[n - 1u] = select(stack[n], stack[n - 1u], half.x == half.y);
                pc += 8u;
            }
            case OP_ATTRIBUTE: {
                stack[n] = vec4<f32>(attribute_of(point, word_at(pc + 1u)).xyz, 0.0);
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
fn value_moved(point: ShadingPoint, offset: vec2<f32>, at: u32) -> vec4<f32> {
    let tag = word_at(at);
    if (tag == 2u) {
        return texture_program(point, offset, word_at(at + 1u));
    }
    return vec4<f32>(vec3_at(at + 1u), select(0.0, 1.0, tag == 0u));
}

fn value_rgb(point: ShadingPoint, at: u32) -> vec3<f32> {
    return value_moved(point, vec2<f32>(0.0), at).xyz;
}

fn as_number(c: vec4<f32>) -> f32 {
    return select(luminance(c.xyz), c.x, c.w > 0.0);
}

fn value_number(point: ShadingPoint, at: u32) -> f32 {
    return as_number(value_moved(point, vec2<f32>(0.0), at));
}

// d/du and d/dv of a value as a number: of the bilinear patch between texels, or by central differences over `step`.
fn value_gradient(point: ShadingPoint, at: u32, step: vec2<f32>) -> vec2<f32> {
    if (word_at(at) != 2u) {
        return vec2<f32>(0.0);
    }
    let program = word_at(at + 1u);
    let image = program + 1u;
    let plain = word_at(program) == OP_IMAGE && word_at(program + OP_IMAGE_WORDS) == 0u && word_at(image + 6u) == NONE;
    if (plain && word_at(image + 7u) == 1u) {
        let wrap = vec2<u32>(word_at(image + 8u), word_at(image + 9u));
        let channel = word_at(image + 10u);
        let level = texture_level(word_at(image + 12u), 0u);
        let size = vec2<f32>(level.size);
        let p = affine2(image, point.uv) * size - 0.5;
        let corner = vec2<i32>(floor(p));
        let t = p - floor(p);
        var height: array<f32, 4>;
        for (var i = 0; i < 4; i += 1) {
            let c = level_texel(level, wrap, corner + vec2<i32>(i % 2, i / 2));
            if (channel > 0u) {
                height[i] = c[channel - 1u];
            } else {
                height[i] = select(luminance(c.xyz), c.x, word_at(image + 11u) == 1u);
            }
        }
        let slope = vec2<f32>(
            (height[1] - height[0]) * (1.0 - t.y) + (height[3] - height[2]) * t.y,
            (height[2] - height[0]) * (1.0 - t.x) + (height[3] - height[1]) * t.x,
        ) * size;
        return vec2<f32>(
            float_at(image) * slope.x + float_at(image + 1u) * slope.y,
            float_at(image + 2u) * slope.x + float_at(image + 3u) * slope.y,
        );
    }
    var sum = vec2<f32>(0.0);
    for (var i = 0u; i < 4u; i += 1u) {
        let sign = select(1.0, -1.0, i % 2u == 1u);
        let axis = select(vec2<f32>(0.0, 1.0), vec2<f32>(1.0, 0.0), i < 2u);
        sum += axis * (sign * as_number(value_moved(point, sign * axis * step, at)));
    }
    return sum / (2.0 * step);
}

// What a cloth's maps say. Twin of reflectance::btf::Texel.
struct ClothTexel {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
    normal: vec3<f32>,
    tangent: vec3<f32>,
    sigma: vec2<f32>,
}

// `at`: matrix, wrap, levels, count. Averaged over the footprint in moments, which is what may be averaged.
fn cloth_texel(point: ShadingPoint, offset: vec2<f32>, at: u32) -> ClothTexel {
    let wrap = vec2<u32>(word_at(at + 6u));
    let levels = word_at(at + 7u);
    let count = word_at(at + 8u);
    var a = vec4<f32>(0.0);
    var b = vec4<f32>(0.0);
    var c = vec4<f32>(0.0);
    if (count > 0u) {
        let uv = affine2(at, point.uv + offset);
        let l = footprint_level(levels, count, at, point.footprint);
        for (var i = 0u; i < 8u; i += 1u) {
            let which = min(u32(l.x) + i / 4u, count - 1u);
            let of_level = select(l.y, 1.0 - l.y, i < 4u);
            let level = texture_level(levels, which);
            let p = uv * vec2<f32>(level.size) - 0.5;
            let corner = vec2<u32>(i % 2u, (i / 2u) % 2u);
            let t = p - floor(p);
            let part = select(1.0 - t.x, t.x, corner.x == 1u) * select(1.0 - t.y, t.y, corner.y == 1u) * of_level;
            if (part > 0.0) {
                let q = vec2<i32>(floor(p)) + vec2<i32>(corner);
                let x = wrap_index(q.x, level.size.x, wrap.x);
                let y = wrap_index(q.y, level.size.y, wrap.y);
                let texel = level.at + 3u * u32(y * level.size.x + x);
                a += part * texel_at(texel);
                b += part * texel_at(texel + 1u);
                c += part * texel_at(texel + 2u);
            }
        }
    }
    return moments_texel(a, b, c);
}

// Twin of reflectance::btf::Moments::texel.
fn moments_texel(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> ClothTexel {
    let w = 1.0 / max(b.z, 1e-9);
    let mean = vec2<f32>(b.w, c.x) * w;
    let xx = c.y * w - mean.x * mean.x;
    let xy = c.z * w - mean.x * mean.y;
    let yy = c.w * w - mean.y * mean.y;
    let n = normalize(vec3<f32>(mean, 1.0));
    let det = max(xx * yy - xy * xy, 1e-9);
    let nz2 = n.z * n.z;
    let scale = 0.5 / (det * nz2 * nz2);
    // Twin of Texel::of_slope_form.
    let frame = frame_from_normal(n);
    let p = vec3<f32>(yy, -xy, xx) * (scale * nz2);
    let e = frame.s.xy - n.xy * (frame.s.z / n.z);
    let f = frame.t.xy - n.xy * (frame.t.z / n.z);
    let pe = vec2<f32>(p.x * e.x + p.y * e.y, p.y * e.x + p.z * e.y);
    let pf = vec2<f32>(p.x * f.x + p.y * f.y, p.y * f.x + p.z * f.y);
    let ee = dot(e, pe);
    let ef = dot(e, pf);
    let ff = dot(f, pf);
    let mid = 0.5 * (ee + ff);
    let d = 0.5 * (ee - ff);
    let half = sqrt(d * d + ef * ef);
    let angle = 0.5 * atan2(ef, d) + 0.5 * PI;
    let tangent = frame.s * cos(angle) + frame.t * sin(angle);
    let large = mid + half;
    let sigma = vec2<f32>(sqrt(large / max(ee * ff - ef * ef, 1e-12)), inverseSqrt(large));
    let widths = clamp(sigma, vec2<f32>(0.02), vec2<f32>(1.0));
    return ClothTexel(a.xyz, vec3<f32>(a.w, b.x, b.y), n, tangent, widths);
}
