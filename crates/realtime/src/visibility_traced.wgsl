// The same by rays, for what no rasteriser can do: a thin lens.

@group(2) @binding(0) var seen: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(8, 8)
fn trace_visibility(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    let ray = pixel_ray(id.xy);
    let hit = trace_closest(ray.origin, ray.dir, 0.0, ray.t_max);
    var s = vec2<u32>(0u);
    if (hit.draw != NONE) {
        s = vec2<u32>(hit.draw + 1u, hit.triangle);
    }
    textureStore(seen, id.xy, vec4<u32>(s, 0u, 0u));
}
