// aov_material.wgsl where no material is asked.

fn albedo_of(s: Surface, ray: CameraRay, t: f32) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn shading_normal_of(s: Surface, ray: CameraRay, t: f32) -> vec3<f32> {
    return s.frame_n;
}
