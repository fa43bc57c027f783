// A film onto a texture or a window.

@group(0) @binding(0) var<uniform> display: Display;
@group(0) @binding(1) var<storage, read> film: array<vec4<f32>>;

// One triangle over everything.
@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    return vec4<f32>(4.0 * corner - 1.0, 0.0, 1.0);
}

@fragment
fn show(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<u32>(position.xy) - display.origin;
    // What lies before the origin has wrapped round and is large.
    if (any(at >= display.size)) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let sum = film[at.y * display.size.x + at.x];
    // The depth is zero, which compilers cannot know: a branch on uniforms alone is compiled anew in each frame by
    // lavapipe of Mesa 22.
    var d = display;
    d.curve += u32(position.z);
    let light = display_light(d, sum.rgb * display.scale);
    return vec4<f32>(select(linear_to_srgb(light), light, display.target_encodes != 0u), 1.0);
}
