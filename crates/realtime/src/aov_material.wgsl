// What the material of a surface says that a camera ray meets at the distance `t`, its maps looked up as the picture does it.

fn albedo_of(s: Surface, ray: CameraRay, t: f32) -> vec3<f32> {
    shade(s.material, shading_point(s, footprint_on(s, ray.dir, footprint_at(t))), -ray.dir);
    return shading_albedo();
}

fn shading_normal_of(s: Surface, ray: CameraRay, t: f32) -> vec3<f32> {
    shade(s.material, shading_point(s, footprint_on(s, ray.dir, footprint_at(t))), -ray.dir);
    return shading_normal_towards(s.frame_n);
}
