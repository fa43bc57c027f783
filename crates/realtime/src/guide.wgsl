// What a denoiser is told of a camera ray, added to sums of its own: which way the first surface faces, and what is seen, be
// it in that surface or through it. Twin of DenoiseFeatures of the reference renderer, but for what volumes keep.
//
// Planes of the film: albedo and distance, normal and whether a surface was met; both again of the first half of the frames.

@compute @workgroup_size(8, 8)
fn add_guides(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    // The numbers of shade_pixels: where it draws a reflection this draws the same.
    let pixel = pixel_number(id.xy);
    let camera = pixel_ray(id.xy);
    var dir = camera.dir;
    var hit = camera_hit(id.xy, camera);
    var albedo = vec3<f32>(1.0);
    var normal = vec3<f32>(0.0);
    var depth = 0.0;
    var met = 0.0;
    var throughput = vec3<f32>(1.0);
    var absorption = vec3<f32>(0.0);
    var travelled = 0.0;
    // Mirrors and panes so far, and surfaces passed straight through.
    var mirrors = 0u;
    var null_steps = 0u;
    loop {
        if (hit.draw == NONE) {
            albedo = throughput;
            met = 0.0;
            break;
        }
        travelled += hit.t;
        let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
        let wo = -dir;
        throughput *= exp(-hit.t * absorption);
        var onwards = dir;
        if (met == 0.0 && is_hidden(s.emitter)) {
            // A light that is not seen, behind what lets all light pass, does not stand in the way either.
            null_steps += 1u;
        } else {
            let point = shading_point(s, footprint_on(s, dir, footprint_at(travelled)));
            var shines = false;
            if (s.emitter != NONE) {
                let value = emitted(s.emitter, s.frame_n, wo);
                if (value != NONE) {
                    shines = any(value_at(point, vec2<f32>(0.0), value).xyz != vec3<f32>(0.0));
                }
            }
            shade(s.material, point, wo);
            if (through < 1.0) {
                albedo = throughput * select(shading_albedo(), vec3<f32>(1.0), shines);
                if (met == 0.0) {
                    normal = shading_normal_towards(wo);
                }
                depth = travelled;
                met = 1.0;
                if (shines || shading_smooth()) {
                    break;
                }
            }
            let first_set = 32u * (mirrors + (BOUNCES + 1u) * null_steps);
            let u = vec4<f32>(sample2(pixel, first_set, view.index), sample2(pixel, first_set + 1u, view.index));
            let next = shading_sample(u, wo);
            if (next.pdf <= 0.0) {
                break;
            }
            throughput *= next.weight;
            if (has_body && dot(s.geometric_normal, wo) * dot(s.geometric_normal, next.wi) < 0.0) {
                absorption = select(vec3<f32>(0.0), body, dot(s.geometric_normal, next.wi) < 0.0);
            }
            onwards = next.wi;
            null_steps += u32(next.is_null);
            mirrors += u32(!next.is_null);
        }
        if (mirrors >= BOUNCES || null_steps >= MOST_SHEETS) {
            break;
        }
        dir = onwards;
        hit = trace_closest(offset_origin(s.position, s.error, s.geometric_normal, dir), dir, 0.0, 1e30);
    }
    let of_surface = vec4<f32>(albedo, depth);
    let of_side = vec4<f32>(normal, met);
    let counts = all(abs(of_surface) < vec4<f32>(3e38)) && all(abs(of_side) < vec4<f32>(3e38));
    let pixels = view.window.z * view.window.w;
    let at = id.y * view.window.z + id.x;
    let first = counts && view.half_of_frames == 0u;
    film_sum(at, of_surface, counts);
    film_sum(pixels + 1u + at, of_side, counts);
    film_sum(2u * pixels + 1u + at, of_surface, first);
    film_sum(3u * pixels + 1u + at, of_side, first);
}
