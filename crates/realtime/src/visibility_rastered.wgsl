// Which triangle of which draw each pixel sees: (draw + 1, triangle), or zeros.

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) seen: vec2<u32>,
}

@vertex
fn corner(@builtin(vertex_index) index: u32, @builtin(instance_index) draw: u32) -> Corner {
    let p = point_to_world(draws[draw].to_world, vertices[triangles[index]].position);
    return Corner(view.to_clip * vec4<f32>(p, 1.0), vec2<u32>(draw + 1u, index / 3u));
}

@fragment
fn seen(corner: Corner) -> @location(0) vec2<u32> {
    return corner.seen;
}
