// Prints of the brush, drawn in any order: what they have in common is summed, what covers is the greatest.

struct Splat {
    // Pixels across and down.
    size: vec2<f32>,
    // Half the width of a mask, in half widths of the brush.
    extent: f32,
    // Half widths of the full brush that the trail of bristles is long.
    trail: f32,
    // Part of the trail's breadth that a half width takes.
    lanes: f32,
    // Pixels by which prints miss the outline at which they end.
    miss: f32,
    // How far the lane of a stroke moves it across the trail, and where its middle is.
    across: vec2<f32>,
}

@group(0) @binding(0) var<uniform> splat: Splat;
@group(0) @binding(1) var masks: texture_2d_array<f32>;
@group(0) @binding(2) var trail: texture_2d<f32>;
@group(0) @binding(3) var smooth_edges: sampler;
@group(0) @binding(4) var around: sampler;
// The shape that is seen at each pixel.
@group(0) @binding(5) var shapes: texture_2d<u32>;

struct Stamp {
    @location(0) pixel: vec2<f32>,
    @location(1) radius_angle: vec2<f32>,
    // Dryness, ink, arc length, lane.
    @location(2) brush: vec4<f32>,
    // Mask, and the shape at whose outline it ends.
    @location(3) variant: vec2<u32>,
    // Weight, stretch, half width over that of the full brush.
    @location(4) print: vec3<f32>,
}

struct Print {
    @builtin(position) position: vec4<f32>,
    // Along and across, in half widths.
    @location(0) local: vec2<f32>,
    @location(1) @interpolate(flat) brush: vec4<f32>,
    @location(2) @interpolate(flat) variant: vec2<u32>,
    @location(3) @interpolate(flat) weight_ratio: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32, stamp: Stamp) -> Print {
    // Two triangles: 0 1 2, 2 1 3.
    var corners = array<u32, 6>(0u, 1u, 2u, 2u, 1u, 3u);
    let k = corners[index];
    let local = (vec2<f32>(f32(k & 1u), f32(k >> 1u)) * 2.0 - 1.0) * splat.extent;
    let way = vec2<f32>(cos(stamp.radius_angle.y), sin(stamp.radius_angle.y));
    let offset = local * vec2<f32>(stamp.print.y, 1.0) * stamp.radius_angle.x;
    let pixel = stamp.pixel + way * offset.x + vec2<f32>(-way.y, way.x) * offset.y;
    let clip = pixel / splat.size * vec2<f32>(2.0, -2.0) + vec2<f32>(-1.0, 1.0);
    return Print(vec4<f32>(clip, 0.0, 1.0), local, stamp.brush, stamp.variant, stamp.print.xz);
}

struct Sums {
    // Weight; ink, dryness and trail of bristles times weight.
    @location(0) sums: vec4<f32>,
    // Coverage by bristles and by ink that has crept.
    @location(1) greatest: vec4<f32>,
}

// Whether a pixel lies within the outline of a shape as a print sees it: each misses it a little and in its own way, so that
// many make an edge that is neither cut out nor scalloped.
fn held(at: vec2<f32>, shape: u32, lane: f32) -> f32 {
    let turn = lane * 6.2831853;
    let place = at + splat.miss * vec2<f32>(cos(turn), sin(turn));
    let seen = textureLoad(shapes, vec2<i32>(clamp(place, vec2<f32>(0.0), splat.size - 1.0)), 0).x;
    return select(0.0, 1.0, shape == 0u || seen == shape);
}

@fragment
fn print(p: Print) -> Sums {
    let mask = textureSample(masks, smooth_edges, p.local / splat.extent * 0.5 + 0.5, p.variant.x).xy
        * (p.weight_ratio.x * held(p.position.xy, p.variant.y, p.brush.w));
    // The place in the stroke, not in the stamp: neighbours that overlap agree on what a bristle does.
    let along = p.brush.z + p.local.x * p.weight_ratio.y;
    let place = vec2<f32>(along / splat.trail + p.brush.w, p.local.y * splat.lanes + p.brush.w * splat.across.x + splat.across.y);
    let bristle = textureSample(trail, around, place).x;
    // What has only crept counts little where bristles were.
    let weight = mask.x * mask.x + 0.01 * mask.y;
    return Sums(weight * vec4<f32>(1.0, p.brush.y, p.brush.x, bristle), vec4<f32>(mask, 0.0, 0.0));
}
