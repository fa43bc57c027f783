// What is shown while the sum is young: with what was seen before the camera moved, and smoothed along surfaces.

struct Preview {
    // World to the raster of the picture before, without a frame's offset.
    before_to_clip: mat4x4<f32>,
    size: vec2<u32>,
    // Pixels of the picture before.
    before_size: vec2<u32>,
    // Frames of this picture, this one included.
    frames: u32,
    // 1: there is a picture before.
    has_before: u32,
    // Sum of the weights of the frames; of a filter that is negative somewhere it may be zero or less.
    weight: f32,
    // What the picture before still counts, from 1 to 0.
    fade: f32,
    eye: vec3<f32>,
    // Width of a pixel at distance one; of all pixels where rays are parallel.
    footprint: f32,
    // 1: smooth.
    smooth_: u32,
    orthographic: u32,
    // The picture before counts as no more than this.
    most_frames: f32,
}

// From so many frames on nothing is smoothed.
const SMOOTHED: f32 = 8.0;
// Worth fewer frames than this, a mean is noise, and what was shown the frame before stays.
const LEAST_FRAMES: f32 = 0.25;

@group(0) @binding(0) var<uniform> preview: Preview;
@group(0) @binding(1) var<storage, read> film: array<vec4<f32>>;
// Colour and how many frames it is worth: of the picture before where it is seen now, of the picture before where it was
// seen, and of what is shown now.
@group(0) @binding(2) var<storage, read_write> carried: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> before: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> now: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> shown: array<vec4<f32>>;
@group(0) @binding(6) var positions: texture_2d<f32>;
@group(0) @binding(7) var normals: texture_2d<f32>;
@group(0) @binding(8) var positions_before: texture_2d<f32>;

fn width_at(position: vec3<f32>) -> f32 {
    return preview.footprint * select(distance(position, preview.eye), 1.0, preview.orthographic != 0u);
}

// What the picture before knew of the place that this pixel sees.
fn reprojected(pixel: vec2<u32>) -> vec4<f32> {
    let here = textureLoad(positions, pixel, 0);
    if (here.w == 0.0) {
        return vec4<f32>(0.0);
    }
    let clip = preview.before_to_clip * vec4<f32>(here.xyz, 1.0);
    if (clip.w <= 0.0) {
        return vec4<f32>(0.0);
    }
    let at = (vec2<f32>(0.5, -0.5) * clip.xy / clip.w + 0.5) * vec2<f32>(preview.before_size) - 0.5;
    let corner = floor(at);
    let normal = textureLoad(normals, pixel, 0).xyz;
    // A coarser picture is known farther apart, and says less of each pixel.
    let coarse = max(f32(preview.size.x) / f32(preview.before_size.x), 1.0);
    let room = 1.5 * width_at(here.xyz);
    let reach = 8.0 * room * coarse;
    var sum = vec4<f32>(0.0);
    var weights = 0.0;
    for (var i = 0u; i < 4u; i += 1u) {
        let step = vec2<f32>(f32(i & 1u), f32(i >> 1u));
        let tap = corner + step;
        if (any(tap < vec2<f32>(0.0)) || any(tap >= vec2<f32>(preview.before_size))) {
            continue;
        }
        let there = textureLoad(positions_before, vec2<u32>(tap), 0);
        // The same thing from the same side, in the same plane, and not far away in it.
        let apart = there.xyz - here.xyz;
        if (there.w != here.w || abs(dot(apart, normal)) > room || dot(apart, apart) > reach * reach) {
            continue;
        }
        let part = 1.0 - abs(at - tap);
        let weight = part.x * part.y;
        sum += weight * before[u32(tap.y) * preview.before_size.x + u32(tap.x)];
        weights += weight;
    }
    if (weights < 1e-3) {
        return vec4<f32>(0.0);
    }
    sum /= weights;
    return vec4<f32>(sum.xyz, min(sum.w, preview.most_frames) / coarse);
}

@compute @workgroup_size(8, 8)
fn blend(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= preview.size)) {
        return;
    }
    let i = id.y * preview.size.x + id.x;
    // Zero, which compilers cannot know: of why no branch depends on uniforms alone see `view`.
    let zero = id.z;
    if (preview.frames == 1u + zero) {
        var found = vec4<f32>(0.0);
        if (preview.has_before != zero) {
            found = reprojected(id.xy);
        }
        carried[i] = found;
    }
    let old = carried[i];
    let count = old.w * preview.fade;
    // Samples that weigh +1 and -1 are worth as many frames of weight one as have a mean of the same variance.
    let factor = preview.weight / f32(preview.frames);
    let worth = preview.weight * factor;
    if (worth + count < LEAST_FRAMES) {
        return;
    }
    now[i] = vec4<f32>((film[i].xyz * factor + old.xyz * count) / (worth + count), worth + count);
}

// Dammertz et al. 2010, "Edge-Avoiding A-Trous Wavelet Transform for fast Global Illumination Filtering": one step of it,
// over 7 x 7 pixels.
@compute @workgroup_size(8, 8)
fn smooth_pixels(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= preview.size)) {
        return;
    }
    let i = id.y * preview.size.x + id.x;
    let own = now[i];
    let here = textureLoad(positions, id.xy, 0);
    let strength = 1.0 - own.w / SMOOTHED;
    var colour = own.xyz;
    if (strength > 0.0 && here.w != 0.0 && preview.smooth_ != id.z) {
        let normal = textureLoad(normals, id.xy, 0).xyz;
        let room = width_at(here.xyz);
        var sum = vec3<f32>(0.0);
        var weights = 0.0;
        for (var k = 0; k < 49; k += 1) {
            let step = vec2<i32>(k % 7, k / 7) - 3;
            let at = vec2<i32>(id.xy) + step;
            if (any(at < vec2<i32>(0)) || any(at >= vec2<i32>(preview.size))) {
                continue;
            }
            let there = textureLoad(positions, vec2<u32>(at), 0);
            if (there.w != here.w) {
                continue;
            }
            let facing = dot(textureLoad(normals, vec2<u32>(at), 0).xyz, normal);
            let off = dot(there.xyz - here.xyz, normal) / room;
            let weight = pow(max(facing, 0.0), 32.0) * exp(-off * off - f32(dot(step, step)) * 0.15);
            let tap = now[u32(at.y) * preview.size.x + u32(at.x)];
            sum += weight * tap.xyz;
            weights += weight;
        }
        if (weights > 0.0) {
            colour = mix(colour, sum / weights, strength);
        }
    }
    var alpha = shown[i].w;
    alpha = select(film[i].w / preview.weight, alpha, preview.weight == 0.0);
    shown[i] = vec4<f32>(colour, alpha);
}
