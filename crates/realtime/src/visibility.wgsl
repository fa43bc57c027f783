// What the visibility buffer says of a pixel: which triangle of which draw it sees.

@group(1) @binding(1) var visibility: texture_2d<u32>;

// The nearest surface at a pixel of the window along its ray.
fn visible_hit(pixel: vec2<u32>, ray: CameraRay) -> Hit {
    let seen = textureLoad(visibility, pixel, 0);
    if (seen.x == 0u) {
        return Hit(ray.t_max, 0.0, 0.0, NONE, NONE);
    }
    return intersect_triangle(seen.x - 1u, seen.y, ray.origin, ray.dir);
}

// Whether the camera does not see what shines with this emitter, and it does not stand in the way either.
fn is_hidden(emitter: u32) -> bool {
    return HIDE_EMITTERS && emitter != NONE;
}

// The nearest behind `hit`, which is on the ray. Its t is the whole way.
fn hit_behind(hit: Hit, ray: CameraRay) -> Hit {
    let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
    let next = offset_origin(s.position, s.error, s.geometric_normal, ray.dir);
    let travelled = max(dot(next - ray.origin, ray.dir), hit.t);
    var behind = trace_closest(next, ray.dir, 0.0, ray.t_max - travelled);
    behind.t += travelled;
    return behind;
}

// The nearest that is not hidden.
fn camera_hit(pixel: vec2<u32>, ray: CameraRay) -> Hit {
    var hit = visible_hit(pixel, ray);
    if (HIDE_EMITTERS) {
        for (var i = 0u; i < MOST_SHEETS && hit.draw != NONE && is_hidden(draws[hit.draw].emitter); i += 1u) {
            hit = hit_behind(hit, ray);
        }
    }
    return hit;
}
