// A cloth where it is shaded: its maps averaged over the footprint, in moments, which is what may be averaged.

// `at`: matrix, wrap, levels, count. Writes the slots of the model `noh` into `scratch` from `own` on; returns the
// texel's normal and tangent.
fn cloth_at(point: ShadingPoint, at: u32, form: f32, own: u32) -> ClothAt {
    var a = vec4<f32>(0.0);
    var b = vec4<f32>(0.0);
    var c = vec4<f32>(0.0);
    if (word_at(at + 8u) > 0u) {
        let taps = taps_of(point, vec2<f32>(0.0), at, true);
        for (var i = 0u; i < 8u; i += 1u) {
            let tap = tap_at(taps, i);
            let texel = tap.level + 3u * tap.texel;
            a += tap.weight * texels[texel];
            b += tap.weight * texels[texel + 1u];
            c += tap.weight * texels[texel + 2u];
        }
    }
    let texel = texel_of(moments(a, b, c));
    let m = texel_noh(texel, u32(form));
    let slots = array<f32, 10>(
        m.rho_d.x, m.rho_d.y, m.rho_d.z, m.rho_s.x, m.rho_s.y, m.rho_s.z, m.sigma_x, m.sigma_y, m.grazing, form,
    );
    for (var i = 0u; i < 10u; i += 1u) {
        scratch[own + i] = slots[i];
    }
    return ClothAt(texel.normal, texel.tangent);
}
