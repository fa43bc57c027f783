// What is known of the first surface, added to a picture of its own: one dispatch for each.

const NORMAL: u32 = 0u;
const SHADING_NORMAL: u32 = 1u;
const DEPTH: u32 = 2u;
const POSITION: u32 = 3u;
const UV: u32 = 4u;
const ID: u32 = 5u;
const ALBEDO: u32 = 6u;

@compute @workgroup_size(8, 8)
fn add_aov(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    let ray = pixel_ray(id.xy);
    let hit = primary_hit(id.xy, ray);
    if (hit.draw == NONE) {
        film_add(id.xy, vec4<f32>(0.0));
        return;
    }
    if (AOV == ID) {
        film_set(id.xy, vec4<f32>(f32(draws[hit.draw].shape), 0.0, 0.0, 1.0));
        return;
    }
    let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
    var value = vec3<f32>(0.0);
    switch AOV {
        case NORMAL: { value = s.geometric_normal; }
        case SHADING_NORMAL: { value = shading_normal_of(s, ray, hit.t); }
        case DEPTH: { value = vec3<f32>(hit.t, 0.0, 0.0); }
        case POSITION: { value = s.position; }
        case UV: { value = vec3<f32>(s.uv, 0.0); }
        case ALBEDO: { value = albedo_of(s, ray, hit.t); }
        default: {}
    }
    film_add(id.xy, vec4<f32>(value, 1.0));
}
