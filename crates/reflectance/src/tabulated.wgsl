// Twin of tabulated.rs: four counts, four axes (theta_o, phi_o, theta_i, phi_d), RGB with phi_d fastest, then the
// sampling table.

struct TabulatedView {
    // Entries of the axes, and where each starts.
    n: vec4<u32>,
    axes: vec4<u32>,
    values: u32,
}

fn tabulated_view(t: u32) -> TabulatedView {
    let n = vec4<u32>(vec4<f32>(table_at(t), table_at(t + 1u), table_at(t + 2u), table_at(t + 3u)));
    let axes = t + 4u + vec4<u32>(0u, n.x, n.x + n.y, n.x + n.y + n.z);
    return TabulatedView(n, axes, axes.w + n.w);
}

fn tabulated_sampler(t: u32) -> HalfVectorTable {
    let v = tabulated_view(t);
    let start = v.values + 3u * v.n.x * v.n.y * v.n.z * v.n.w - t;
    return HalfVectorTable(start, 16u, select(1u, 16u, v.n.y > 1u), 32u, 24u);
}

fn tabulated_f(t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    let v = tabulated_view(t);
    let phi_o = azimuth(wo);
    let a = axis_clamped(v.axes.x, v.n.x, polar_angle(wo));
    let b = axis_periodic(v.axes.y, v.n.y, phi_o);
    let c = axis_clamped(v.axes.z, v.n.z, polar_angle(wi));
    let d = axis_periodic(v.axes.w, v.n.w, azimuth(wi) - phi_o);
    let low = vec4<u32>(a.low, b.low, c.low, d.low);
    let high = vec4<u32>(a.high, b.high, c.high, d.high);
    let x = vec4<f32>(a.t, b.t, c.t, d.t);
    // Linear in all four; in three without azimuths of the eye.
    let corners = select(8u, 16u, v.n.y > 1u);
    var sum = vec3<f32>(0.0);
    for (var corner = 0u; corner < corners; corner++) {
        let upper = (vec4<u32>(corner) & vec4<u32>(1u, 8u, 2u, 4u)) != vec4<u32>(0u);
        let at = select(low, high, upper);
        let w = select(1.0 - x, x, upper);
        let i = v.values + 3u * (((at.x * v.n.y + at.y) * v.n.z + at.z) * v.n.w + at.w);
        sum += w.x * w.y * w.z * w.w * vec3<f32>(table_at(i), table_at(i + 1u), table_at(i + 2u));
    }
    return sum;
}

fn tabulated_eval(m: Tabulated, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    return m.scale * tabulated_f(t, wo, wi);
}

fn tabulated_pdf(m: Tabulated, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    return half_vector_pdf(tabulated_sampler(t), t, wo, wi);
}

fn tabulated_sample(m: Tabulated, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let half_vectors = tabulated_sampler(t);
    let wi = half_vector_sample(half_vectors, t, wo, u);
    if (wi.z <= 0.0) {
        return bsdf_no_sample();
    }
    return bsdf_sample_of(wo, wi, tabulated_eval(m, t, wo, wi), half_vector_pdf(half_vectors, t, wo, wi));
}
