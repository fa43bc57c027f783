// The first surface that a pixel of the visibility buffer sees.

// The nearest surface at a pixel of the window along its ray; of those behind each other that let everything pass, or that
// shine and are hidden, the first that does not.
fn primary_hit(pixel: vec2<u32>, ray: CameraRay) -> Hit {
    var hit = visible_hit(pixel, ray);
    for (var i = 0u; i < MOST_SHEETS && hit.draw != NONE; i += 1u) {
        let hidden = is_hidden(draws[hit.draw].emitter);
        if (!hidden && (draws[hit.draw].flags & SEE_THROUGH) == 0u) {
            break;
        }
        if (!hidden && passes(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2), ray.dir) < 1.0) {
            break;
        }
        hit = hit_behind(hit, ray);
    }
    return hit;
}
