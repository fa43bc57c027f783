// Layers of ink over paper, light to dark, by Kubelka and Munk in eight bands: twin of pigment.rs.

const LAYERS: u32 = 7u;

struct Layer {
    // a, b and S of the first four bands and of the last.
    a: array<vec4<f32>, 2>,
    b: array<vec4<f32>, 2>,
    s: array<vec4<f32>, 2>,
}

struct Composite {
    layers: array<Layer, 7>,
    // Reflectance of the paper.
    paper: array<vec4<f32>, 2>,
    // From bands to red, green and blue.
    red: array<vec4<f32>, 2>,
    green: array<vec4<f32>, 2>,
    blue: array<vec4<f32>, 2>,
    // How much fibres, blotches and the grain show.
    relief: vec4<f32>,
}

@group(0) @binding(0) var loads: texture_2d_array<f32>;
@group(0) @binding(1) var paper: texture_2d<f32>;
@group(0) @binding(2) var<uniform> composite: Composite;

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn over(a: vec4<f32>, b: vec4<f32>, s: vec4<f32>, load: f32, below: vec4<f32>) -> vec4<f32> {
    let x = min(b * s * load, vec4<f32>(20.0));
    let up = exp(x);
    let down = 1.0 / up;
    let sinh_x = 0.5 * (up - down);
    let cosh_x = 0.5 * (up + down);
    let c = a * sinh_x + b * cosh_x;
    let r = sinh_x / c;
    let t = b / c;
    return r + t * t * below / (1.0 - r * below);
}

@fragment
fn show(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<u32>(position.xy);
    let sheet = textureLoad(paper, at, 0);
    // Raised fibres are lighter, hollows and blotches darker.
    let tone = 1.0 + composite.relief.x * (sheet.y - 0.3) + composite.relief.y * (sheet.z - 0.5)
        + composite.relief.z * (sheet.x - 0.5);
    var r0 = min(composite.paper[0] * tone, vec4<f32>(0.97));
    var r1 = min(composite.paper[1] * tone, vec4<f32>(0.97));
    for (var i = 0u; i < LAYERS; i++) {
        let load = textureLoad(loads, at, i, 0).x;
        if (load > 0.0) {
            let l = composite.layers[i];
            r0 = over(l.a[0], l.b[0], l.s[0], load, r0);
            r1 = over(l.a[1], l.b[1], l.s[1], load, r1);
        }
    }
    return vec4<f32>(
        dot(composite.red[0], r0) + dot(composite.red[1], r1),
        dot(composite.green[0], r0) + dot(composite.green[1], r1),
        dot(composite.blue[0], r0) + dot(composite.blue[1], r1),
        1.0,
    );
}
