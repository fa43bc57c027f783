// Twin of btf.rs. Frame of the picture: +x right, +y up, +z to the camera.

struct Texel {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
    normal: vec3<f32>,
    tangent: vec3<f32>,
    sigma: vec2<f32>,
    confidence: f32,
}

// The weight; the weight times mean slopes and mean products (xx, xy, yy).
struct Moments {
    diffuse: vec3<f32>,
    specular: vec3<f32>,
    weight: f32,
    slope: vec2<f32>,
    products: vec3<f32>,
}

// The twelve numbers of `Moments::values`, wherever they come from.
fn moments(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) -> Moments {
    return Moments(a.xyz, vec3<f32>(a.w, b.xy), b.z, vec2<f32>(b.w, c.x), c.yzw);
}

fn texel_frame(x: Texel) -> Frame {
    return frame_from_normal_tangent(x.normal, x.tangent);
}

// In form 1 the height of the peak.
fn texel_noh(x: Texel, form: u32) -> Noh {
    let height = select(1.0, 4.0 * PI * x.sigma.x * x.sigma.y, form == 1u);
    return Noh(x.diffuse, x.specular / height, x.sigma.x, x.sigma.y, 0.0, form);
}

fn slope_form(x: Texel) -> vec3<f32> {
    let t = x.tangent;
    let u = cross(x.normal, t);
    let a = 1.0 / (x.sigma.x * x.normal.z * x.sigma.x * x.normal.z);
    let b = 1.0 / (x.sigma.y * x.normal.z * x.sigma.y * x.normal.z);
    return a * vec3<f32>(t.x * t.x, t.x * t.y, t.y * t.y) + b * vec3<f32>(u.x * u.x, u.x * u.y, u.y * u.y);
}

// The tangent and the widths of a slope form, in a texel of which no more is known.
fn texel_of_slope_form(n: vec3<f32>, p: vec3<f32>) -> Texel {
    let frame = frame_from_normal(n);
    let form = mat2x2<f32>(p.xy, p.yz) * (n.z * n.z);
    let e = frame.s.xy - n.xy * (frame.s.z / n.z);
    let f = frame.t.xy - n.xy * (frame.t.z / n.z);
    let ee = dot(e, form * e);
    let ef = dot(e, form * f);
    let ff = dot(f, form * f);
    let half_difference = 0.5 * (ee - ff);
    let large = 0.5 * (ee + ff) + length(vec2<f32>(half_difference, ef));
    var angle = HALF_PI;
    if (half_difference != 0.0 || ef != 0.0) {
        angle += 0.5 * atan2(ef, half_difference);
    }
    let det = max(ee * ff - ef * ef, 1e-12);
    let sigma = vec2<f32>(sqrt(large / det), 1.0 / sqrt(large));
    return Texel(vec3<f32>(0.0), vec3<f32>(0.0), n, frame.s * cos(angle) + frame.t * sin(angle), sigma, 1.0);
}

fn moments_of(x: Texel) -> Moments {
    let w = dot(x.specular, vec3<f32>(1.0)) + 1e-3 * dot(x.diffuse, vec3<f32>(1.0)) + 1e-6;
    let mean = x.normal.xy / max(x.normal.z, 1e-3);
    let nz2 = x.normal.z * x.normal.z;
    let p = slope_form(x) * nz2 * nz2;
    let scale = 0.5 / max(p.x * p.z - p.y * p.y, 1e-12);
    let second = vec3<f32>(p.z * scale + mean.x * mean.x, mean.x * mean.y - p.y * scale, p.x * scale + mean.y * mean.y);
    return Moments(x.diffuse, x.specular, w, w * mean, w * second);
}

fn texel_of(m: Moments) -> Texel {
    let w = 1.0 / max(m.weight, 1e-9);
    let mean = m.slope * w;
    let v = m.products * w - vec3<f32>(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
    let normal = normalize(vec3<f32>(mean, 1.0));
    let det = max(v.x * v.z - v.y * v.y, 1e-9);
    let nz2 = normal.z * normal.z;
    let scale = 0.5 / (det * nz2 * nz2);
    var x = texel_of_slope_form(normal, vec3<f32>(v.z * scale, -v.y * scale, v.x * scale));
    x.diffuse = m.diffuse;
    x.specular = m.specular;
    x.sigma = clamp(x.sigma, vec2<f32>(0.02), vec2<f32>(1.0));
    return x;
}
