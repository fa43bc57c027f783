// What the rows of a scene are read by, and the frames that everything else is said in. See rows/mod.rs.

fn word_at(i: u32) -> u32 {
    return words[i];
}

fn number_at(i: u32) -> f32 {
    return numbers[i];
}

fn float_at(i: u32) -> f32 {
    return bitcast<f32>(words[i]);
}

fn vec3_at(i: u32) -> vec3<f32> {
    return vec3<f32>(float_at(i), float_at(i + 1u), float_at(i + 2u));
}

fn luminance(c: vec3<f32>) -> f32 {
    return dot(vec3_at(0u), c);
}

// Parameters of the lobes of the point that is shaded: those of the rows, and what textures say.
var<private> scratch: array<f32, LOBES * SLOTS>;

fn param_at(i: u32) -> f32 {
    return scratch[i];
}

fn table_at(i: u32) -> f32 {
    return number_at(i);
}

fn normalize_or(v: vec3<f32>, other: vec3<f32>) -> vec3<f32> {
    let len = length(v);
    if (len > 0.0 && len < 3.0e38) {
        return v / len;
    }
    return other;
}

// Abramowitz and Stegun 1964, 4.4.46: off by 2e-8, where those of drivers are off by some 1e-4.
fn exact_acos(x: f32) -> f32 {
    let a = min(abs(x), 1.0);
    var p = -0.0012624911;
    p = p * a + 0.0066700901;
    p = p * a - 0.0170881256;
    p = p * a + 0.0308918810;
    p = p * a - 0.0501743046;
    p = p * a + 0.0889789874;
    p = p * a - 0.2145988016;
    p = p * a + 1.5707963050;
    let r = sqrt(1.0 - a) * p;
    return select(r, PI - r, x < 0.0);
}

// What the surface is like where it is shaded. Twin of prepared::ShadingPoint.
struct ShadingPoint {
    frame: Frame,
    // 1, or -1 where a normal map's y runs against the frame's bitangent.
    handedness: f32,
    // Geometric normal.
    normal: vec3<f32>,
    dp_du: vec3<f32>,
    dp_dv: vec3<f32>,
    uv: vec2<f32>,
    // Width of the ray's footprint in units of uv.
    footprint: f32,
    // Table of the draw's attributes, or NONE.
    attributes: u32,
    triangle: u32,
    // Weights of the second and third corner.
    barycentric: vec2<f32>,
}

// The entry of a list of `count` accumulated chances in the numbers that `u` falls into; u stretched back to [0, 1) in
// it; and its probability. Twin of optics::distribution::choose.
struct Choice {
    entry: u32,
    u: f32,
    probability: f32,
}

fn choose(at: u32, count: u32, u: f32) -> Choice {
    var low = 0u;
    var high = count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (number_at(at + middle) <= u) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = min(low, count - 1u);
    var below = 0.0;
    if (i > 0u) {
        below = number_at(at + i - 1u);
    }
    let p = number_at(at + i) - below;
    return Choice(i, clamp((u - below) / max(p, 1.17549435e-38), 0.0, 0.99999994), p);
}

fn choice_probability(at: u32, i: u32) -> f32 {
    var below = 0.0;
    if (i > 0u) {
        below = number_at(at + i - 1u);
    }
    return number_at(at + i) - below;
}
