// What materials let pass, for rays on their way.

fn shading_point(s: Surface, footprint: f32) -> ShadingPoint {
    return ShadingPoint(
        Frame(s.frame_s, s.frame_t, s.frame_n), s.handedness, s.geometric_normal, s.dp_du, s.dp_dv, s.uv, footprint,
        draws[s.draw].attributes, s.triangle, s.barycentric,
    );
}

// The part of light that passes a surface, for rays on their way to a light.
fn passes(draw: u32, triangle: u32, b: vec2<f32>, dir: vec3<f32>) -> f32 {
    if (!SEES_THROUGH) {
        return 0.0;
    }
    return shade_through(draws[draw].material, shading_point(surface_at(draw, triangle, b), 0.0), -dir);
}
