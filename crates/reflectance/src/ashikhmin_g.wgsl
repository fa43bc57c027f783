// Twin of ashikhmin_g.rs.

const AG_POLAR: i32 = 40;
const AG_AZIMUTH: i32 = 32;

fn ag_p(t: u32, h: vec3<f32>, sx: f32, sy: f32) -> f32 {
    return table_at(t) * exp(-squared_slope(h, sx, sy));
}

fn ag_mean_cosine(t: u32) -> f32 {
    return table_at(t + 1u);
}

fn ag_cubic(t: f32) -> vec4<f32> {
    let t2 = t * t;
    let t3 = t2 * t;
    return 0.5 * vec4<f32>(-t + 2.0 * t2 - t3, 2.0 - 5.0 * t2 + 3.0 * t3, t + 4.0 * t2 - 3.0 * t3, t3 - t2);
}

fn ag_row(t: u32, i: i32, j: i32, w: vec4<f32>) -> f32 {
    let at = t + 3u + u32(i * (AG_AZIMUTH + 1));
    let last = select(j + 2, AG_AZIMUTH - 1, j + 2 > AG_AZIMUTH);
    return w.x * table_at(at + u32(abs(j - 1))) + w.y * table_at(at + u32(j))
        + w.z * table_at(at + u32(j + 1)) + w.w * table_at(at + u32(last));
}

fn ag_g(t: u32, k: vec3<f32>) -> f32 {
    let x = sqrt(clamp(k.z, 0.0, 1.0)) * f32(AG_POLAR);
    var y = 0.0;
    // atan2(0, 0) may be anything here.
    if (abs(k.x) + abs(k.y) > 0.0) {
        y = atan2(table_at(t + 2u) * abs(k.y), abs(k.x)) * (f32(AG_AZIMUTH) / (0.5 * PI));
    }
    let i = min(i32(x), AG_POLAR - 1);
    let j = clamp(i32(y), 0, AG_AZIMUTH - 1);
    let w = ag_cubic(x - f32(i));
    let wy = ag_cubic(y - f32(j));
    let a = ag_row(t, abs(i - 1), j, wy);
    let b = ag_row(t, i, j, wy);
    let c = ag_row(t, i + 1, j, wy);
    var d = a - 3.0 * b + 3.0 * c;
    if (i + 2 <= AG_POLAR) {
        d = ag_row(t, i + 2, j, wy);
    }
    return w.x * a + w.y * b + w.z * c + w.w * d;
}

// `correlation` 0 for independent shadowing.
fn f_ashikhmin2000(t: u32, wo: vec3<f32>, wi: vec3<f32>, sx: f32, sy: f32, correlation: f32) -> f32 {
    let h = half_vector(wo, wi);
    let go = ag_g(t, wo);
    let gi = ag_g(t, wi);
    var shadowing = ag_mean_cosine(t) / (go * gi);
    if (correlation > 0.0) {
        let s = abs(wo.x * wi.y - wo.y * wi.x);
        let c = dot(wo.xy, wi.xy);
        var phi = 0.0;
        if (s > 0.0 || c != 0.0) {
            phi = atan2(s, c);
        }
        let x = phi / correlation;
        let together = exp(-0.5 * x * x);
        let least = min(1.0 / (max(wi.z, 1e-6) * go), 1.0 / (max(wo.z, 1e-6) * gi));
        shadowing += together * (least - shadowing);
    }
    return 0.25 * ag_p(t, h.xyz, sx, sy) * shadowing;
}
