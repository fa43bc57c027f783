// The first surface that a pixel of the visibility buffer sees.

@group(1) @binding(1) var visibility: texture_2d<u32>;

// The nearest surface at a pixel of the window along its ray; of those behind each other that let everything pass, or that
// shine and are hidden, the first that does not.
fn primary_hit(pixel: vec2<u32>, ray: CameraRay) -> Hit {
    let seen = textureLoad(visibility, pixel, 0);
    if (seen.x == 0u) {
        return Hit(ray.t_max, 0.0, 0.0, NONE, NONE);
    }
    var hit = intersect_triangle(seen.x - 1u, seen.y, ray.origin, ray.dir);
    for (var i = 0; i < i32(MOST_SHEETS) && hit.draw != NONE; i++) {
        let hidden = HIDE_EMITTERS && draws[hit.draw].emitter != NONE;
        if (!hidden && (draws[hit.draw].flags & SEE_THROUGH) == 0u) {
            break;
        }
        if (!hidden && passes(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2), ray.dir) < 1.0) {
            break;
        }
        let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
        let next = offset_origin(s.position, s.error, s.geometric_normal, ray.dir);
        let travelled = max(dot(next - ray.origin, ray.dir), hit.t);
        hit = trace_closest(next, ray.dir, 0.0, ray.t_max - travelled);
        hit.t += travelled;
    }
    return hit;
}
