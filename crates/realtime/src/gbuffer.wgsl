// Where the first surface of each pixel is: position and draw + 1, negative where it is seen from behind, or zeros; shading
// normal on the side of the eye.

@group(2) @binding(0) var positions: texture_storage_2d<rgba32float, write>;
@group(2) @binding(1) var normals: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn write_gbuffer(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    let ray = pixel_ray(id.xy);
    let hit = camera_hit(id.xy, ray);
    var position = vec4<f32>(0.0);
    var normal = vec4<f32>(0.0);
    if (hit.draw != NONE) {
        let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
        let side = select(1.0, -1.0, dot(s.frame_n, ray.dir) > 0.0);
        position = vec4<f32>(s.position, side * f32(hit.draw + 1u));
        normal = vec4<f32>(side * s.frame_n, 0.0);
    }
    textureStore(positions, id.xy, position);
    textureStore(normals, id.xy, normal);
}
