// From the sums of stamps to the load of ink on the paper, with dryness applied once.

@group(0) @binding(0) var sums: texture_2d<f32>;
@group(0) @binding(1) var greatest: texture_2d<f32>;
@group(0) @binding(2) var paper: texture_2d<f32>;
@group(0) @binding(3) var<uniform> resolve: Resolve;

struct Resolve {
    // How much crept ink counts beside that of bristles.
    k_diff: f32,
    // How much dryness takes away.
    k_dry: f32,
    // Part of the paper in what decides where bristles touch; the rest is theirs.
    paper_share: f32,
    // Range over which the edge of a dry place is drawn.
    softness: f32,
}

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// Coverage after flying white: see `touch` of resolve.rs.
fn touch(coverage: f32, crept: f32, dryness: f32, xi: f32) -> f32 {
    let reach = coverage + resolve.k_diff * (1.0 - dryness) * crept;
    return smoothstep(0.0, resolve.softness, reach - resolve.k_dry * dryness * xi) * min(reach, 1.0);
}

@fragment
fn load(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let at = vec2<u32>(position.xy);
    let s = textureLoad(sums, at, 0);
    if (s.x < 1e-5) {
        return vec4<f32>(0.0);
    }
    let ink = s.y / s.x;
    let dryness = s.z / s.x;
    let bristle = s.w / s.x;
    let coverage = textureLoad(greatest, at, 0).xy;
    let height = textureLoad(paper, at, 0).x;
    let xi = mix(bristle, 1.0 - height, resolve.paper_share);
    let touched = touch(coverage.x, coverage.y, dryness, xi);
    return vec4<f32>(touched * ink, touched * (1.0 - dryness), 0.0, 1.0);
}
