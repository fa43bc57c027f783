// Sums to what a display shows: twin of yugen_optics::tonemap, same names, same order.

struct Display {
    // Columns of the matrices from the film's colours to those that the curve works on, exposure included, and on to the display's.
    to_primaries: array<vec4<f32>, 3>,
    to_display: array<vec4<f32>, 3>,
    luminance: vec3<f32>,
    // One over the sum of weights.
    scale: f32,
    // Where the picture begins on the target, in pixels, and its size.
    origin: vec2<u32>,
    size: vec2<u32>,
    curve: u32,
    // 1: values leave as light and the target encodes them.
    target_encodes: u32,
    unused: vec2<u32>,
}

const CLIP: u32 = 0u;
const REINHARD: u32 = 1u;
const ACES: u32 = 2u;
const AGX: u32 = 3u;

const REINHARD_WHITE: f32 = 16.0;
const AGX_LOW: f32 = -12.47393;
const AGX_HIGH: f32 = 4.026069;

fn agx_log(rgb: vec3<f32>) -> vec3<f32> {
    let inset = mat3x3<f32>(
        vec3<f32>(0.84247906, 0.04232824, 0.042375655),
        vec3<f32>(0.0784336, 0.87846864, 0.0784336),
        vec3<f32>(0.079223745, 0.07916613, 0.87914297),
    );
    let x = max(inset * rgb, vec3<f32>(1e-30));
    return clamp((log2(x) - AGX_LOW) / (AGX_HIGH - AGX_LOW), vec3<f32>(0.0), vec3<f32>(1.0));
}

fn agx_sigmoid(x: f32) -> f32 {
    let middle = 10.0 / 16.5;
    var side = -1.0;
    var run = middle;
    var power = 3.0;
    if (x >= middle) {
        side = 1.0;
        run = 1.0 - middle;
        power = 3.25;
    }
    let k = 2.0 * run / pow(pow(4.0 * run, power) - 1.0, 1.0 / power);
    let t = 2.0 * abs(x - middle) / k;
    return max(0.5 + side * k * t / pow(1.0 + pow(t, power), 1.0 / power), 0.0);
}

fn apply_curve(curve: u32, luminance: vec3<f32>, rgb: vec3<f32>) -> vec3<f32> {
    var mapped = rgb;
    switch curve {
        case REINHARD: {
            let y = dot(luminance, rgb);
            mapped = rgb * ((1.0 + y / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + y));
        }
        case ACES: {
            let x = min(rgb, vec3<f32>(1e6));
            mapped = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
        }
        case AGX: {
            let l = agx_log(rgb);
            mapped = pow(vec3<f32>(agx_sigmoid(l.x), agx_sigmoid(l.y), agx_sigmoid(l.z)), vec3<f32>(2.2));
        }
        default: {}
    }
    return clamp(mapped, vec3<f32>(0.0), vec3<f32>(1.0));
}

fn into_gamut(rgb: vec3<f32>, luminance: vec3<f32>) -> vec3<f32> {
    let least = min(rgb.x, min(rgb.y, rgb.z));
    if (least >= 0.0) {
        return rgb;
    }
    let y = dot(luminance, rgb);
    if (y <= 0.0) {
        return vec3<f32>(0.0);
    }
    return max(y + (rgb - y) * (y / (y - least)), vec3<f32>(0.0));
}

fn linear_to_srgb(v: vec3<f32>) -> vec3<f32> {
    return select(1.055 * pow(v, vec3<f32>(1.0 / 2.4)) - 0.055, 12.92 * v, v <= vec3<f32>(0.0031308));
}

// Scene light to display light in [0, 1]; what is no number becomes black.
fn display_light(d: Display, scene: vec3<f32>) -> vec3<f32> {
    // By its bits: compilers may take for granted that there is none.
    if (any((bitcast<vec3<u32>>(scene) & vec3<u32>(0x7fffffffu)) > vec3<u32>(0x7f800000u))) {
        return vec3<f32>(0.0);
    }
    let most = vec3<f32>(5.3e36);
    let s = clamp(scene, -most, most);
    let rgb = d.to_primaries[0].xyz * s.x + d.to_primaries[1].xyz * s.y + d.to_primaries[2].xyz * s.z;
    let l = apply_curve(d.curve, d.luminance, into_gamut(rgb, d.luminance));
    let shown = d.to_display[0].xyz * l.x + d.to_display[1].xyz * l.y + d.to_display[2].xyz * l.z;
    return clamp(shown, vec3<f32>(0.0), vec3<f32>(1.0));
}
