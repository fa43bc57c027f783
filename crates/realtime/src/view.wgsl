// The camera of a frame. It looks along +z of its frame with +x to the left; pixels count from the top left corner of the
// whole picture, of which `window` is shown.

struct View {
    // The three rows of the camera's matrix.
    to_world: array<vec4<f32>, 3>,
    // World to the raster, this frame's offset included.
    to_clip: mat4x4<f32>,
    // x, y, width, height in pixels.
    window: vec4<u32>,
    // (x, y) of a ray at distance one, or of its origin where rays are parallel: pixel * scale + shift.
    scale: vec2<f32>,
    shift: vec2<f32>,
    // Where in a pixel this frame looks, relative to its centre.
    offset: vec2<f32>,
    // This frame's point on the lens.
    lens: vec2<f32>,
    near: f32,
    far: f32,
    // 0: a pinhole.
    aperture_radius: f32,
    focus_distance: f32,
    // 1: parallel rays.
    orthographic: u32,
    // Frames since the picture last changed, and the seed of this one.
    index: u32,
    seed: u32,
    // What this frame's samples count in the sums.
    weight: f32,
    // What `offset` is made from.
    u: vec2<f32>,
    // 1: every pixel looks at a place of its own and through its own point of the lens.
    per_pixel: u32,
    // One over what the samples before this frame weigh together; 0: there are none.
    per_weight: f32,
    // Of the two halves of all frames, that of this one: 0 or 1.
    half_of_frames: u32,
    // What the square of this frame's deviation from the mean before it counts; 0: there is none.
    deviation_weight: f32,
    unused_a: u32,
    unused_b: u32,
    // Offsets below which equal shares of the filter lie, FILTER_STEPS of them.
    filter_offsets: array<vec4<f32>, 65>,
}

const FILTER_STEPS: f32 = 256.0;

// Most surfaces that a ray passes straight through, one behind the other: as many as the reference's shadow rays do.
const MOST_SHEETS: u32 = 64u;

// Where a uniform alone decides, shaders select and do not branch: lavapipe of Mesa 22 puts the values of such uniforms in
// place and compiles anew in each frame, .15 s and 4 MB of memory that it keeps.
@group(1) @binding(0) var<uniform> view: View;

struct CameraRay {
    origin: vec3<f32>,
    t_max: f32,
    // Unit.
    dir: vec3<f32>,
}

// The unit square to the unit disc. Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square".
fn lens_disc(u: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0) {
        return vec2<f32>(0.0);
    }
    var r = p.x;
    var phi = 0.7853981633974483 * (p.y / p.x);
    if (abs(p.x) <= abs(p.y)) {
        r = p.y;
        phi = 1.5707963267948966 - 0.7853981633974483 * (p.x / p.y);
    }
    return r * vec2<f32>(cos(phi), sin(phi));
}

// Hash of Jarzynski and Olano 2020, "Hash Functions for GPU Rendering": PCG.
fn pcg(v: u32) -> u32 {
    let state = v * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// The offset below which the share `u` of the filter lies.
fn filter_offset(u: f32) -> f32 {
    let at = u * FILTER_STEPS;
    let i = u32(at);
    let next = i + 1u;
    return mix(view.filter_offsets[i / 4u][i % 4u], view.filter_offsets[next / 4u][next % 4u], at - f32(i));
}

// The ray through a place in the whole picture, from lens point `u`.
fn camera_ray(pixel: vec2<f32>, u: vec2<f32>) -> CameraRay {
    let at = vec3<f32>(pixel * view.scale + view.shift, 1.0);
    let through = vec3<f32>(lens_disc(u) * view.aperture_radius, 0.0);
    let parallel = view.orthographic != 0u;
    let origin = select(through, vec3<f32>(at.xy, 0.0), parallel);
    let of_lens = select(at, at * view.focus_distance - through, view.aperture_radius > 0.0);
    let direction = select(of_lens, vec3<f32>(0.0, 0.0, 1.0), parallel);
    let near = view.near / direction.z;
    let far = view.far / direction.z;
    let world = vector_to_world(view.to_world, direction);
    let size = length(world);
    return CameraRay(point_to_world(view.to_world, origin + direction * near), (far - near) * size, world / size);
}

// This frame's ray through a pixel of the window. Shifted by a number of the pixel the frames' places stay as even as they
// are (Cranley and Patterson 1976, "Randomization of Number Theoretic Methods for Multiple Integration").
fn pixel_ray(pixel: vec2<u32>) -> CameraRay {
    let a = pcg(pixel.x ^ pcg(pixel.y ^ pcg(view.seed ^ 0x68e31da4u)));
    let b = pcg(a);
    let shift = vec4<f32>(vec4<u32>(a, b, pcg(b), pcg(a ^ b)) >> vec4<u32>(8u)) * 5.9604645e-8;
    let own_u = min(fract(view.u + shift.xy), vec2<f32>(0.99999994));
    let own_offset = vec2<f32>(filter_offset(own_u.x), filter_offset(own_u.y));
    let own = view.per_pixel != 0u;
    let offset = select(view.offset, own_offset, own);
    let lens = select(view.lens, fract(view.lens + shift.zw), own);
    return camera_ray(vec2<f32>(view.window.xy + pixel) + 0.5 + offset, lens);
}

// Width of a camera ray's footprint at the camera and how it grows. The frames of a picture share its footprint, as the
// samples of a pixel do in the reference.
fn pixel_footprint() -> vec2<f32> {
    let across = length(vector_to_world(view.to_world, vec3<f32>(view.scale.x, 0.0, 0.0)));
    let sharpen = 1.0 / clamp(sqrt(f32(view.index + 1u)), 1.0, 8.0);
    return sharpen * select(vec2<f32>(0.0, abs(view.scale.x)), vec2<f32>(across, 0.0), view.orthographic != 0u);
}

// Its width at the distance `t` of the camera.
fn footprint_at(t: f32) -> f32 {
    let footprint = pixel_footprint();
    return footprint.x + footprint.y * t;
}
