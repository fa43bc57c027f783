// Twin of halfway.rs.

// The half vector, and in w its cosine with either direction.
fn half_vector(wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    let sum = wo + wi;
    let l = max(length(sum), 1e-12);
    return vec4<f32>(sum / l, 0.5 * l);
}

fn reflect_about(wo: vec3<f32>, h: vec3<f32>) -> vec3<f32> {
    return 2.0 * dot(wo, h) * h - wo;
}

fn pdf_reflected(pdf_h: f32, h_dot_wo: f32) -> f32 {
    return pdf_h / (4.0 * h_dot_wo);
}

fn squared_slope(h: vec3<f32>, sx: f32, sy: f32) -> f32 {
    let z = max(h.z, 1e-12);
    let x = h.x / (sx * z);
    let y = h.y / (sy * z);
    return x * x + y * y;
}

fn sample_gaussian_slopes(u: vec2<f32>, sx: f32, sy: f32) -> vec3<f32> {
    let r = sqrt(-log(1.0 - u.x));
    let a = TAU * u.y;
    return normalize(vec3<f32>(r * sx * cos(a), r * sy * sin(a), 1.0));
}

fn pdf_gaussian_slopes(h: vec3<f32>, sx: f32, sy: f32) -> f32 {
    let e = exp(-squared_slope(h, sx, sy));
    if (e > 0.0) {
        return FRAC_1_PI * e / (sx * sy * h.z * h.z * h.z);
    }
    return 0.0;
}

fn sample_cosine_power(u: vec2<f32>, n: f32) -> vec3<f32> {
    let z = pow(1.0 - u.x, 1.0 / (n + 1.0));
    let r = sqrt(max(1.0 - z * z, 0.0));
    let a = TAU * u.y;
    return vec3<f32>(r * cos(a), r * sin(a), z);
}

fn pdf_cosine_power(c: f32, n: f32) -> f32 {
    if (c <= 0.0) {
        return 0.0;
    }
    return (n + 1.0) / TAU * pow(c, n);
}

fn max_element(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn lobe_share(specular: vec3<f32>, diffuse: vec3<f32>) -> f32 {
    let s = max_element(specular);
    let d = max_element(diffuse);
    if (s + d > 0.0) {
        return s / (s + d);
    }
    return 0.0;
}

fn v_grooves(wo: vec3<f32>, wi: vec3<f32>, h: vec4<f32>) -> f32 {
    let open = 0.25 / max(wo.z * wi.z, 1e-37);
    let masked = 0.5 * h.z / (h.w * max(wo.z, wi.z));
    return min(open, masked);
}

fn seen_wall(wo: vec3<f32>, h: vec3<f32>, u: f32) -> vec3<f32> {
    let other = vec3<f32>(-h.xy, h.z);
    let a = max(dot(wo, h), 0.0);
    let b = max(dot(wo, other), 0.0);
    return select(other, h, u * (a + b) < a);
}

fn pdf_seen_wall(wo: vec3<f32>, h: vec3<f32>, pdf_h: f32) -> f32 {
    let a = max(dot(wo, h), 0.0);
    let b = max(wo.z * h.z - wo.x * h.x - wo.y * h.y, 0.0);
    if (a > 0.0) {
        return 2.0 * pdf_h * a / (a + b);
    }
    return 0.0;
}

fn sample_gaussian_reflection(wo: vec3<f32>, u: vec3<f32>, sx: f32, sy: f32) -> vec3<f32> {
    return reflect_about(wo, seen_wall(wo, sample_gaussian_slopes(u.xy, sx, sy), u.z));
}

fn pdf_gaussian_reflection(wo: vec3<f32>, wi: vec3<f32>, sx: f32, sy: f32) -> f32 {
    let h = half_vector(wo, wi);
    return pdf_reflected(pdf_seen_wall(wo, h.xyz, pdf_gaussian_slopes(h.xyz, sx, sy)), h.w);
}
