// Twin of metallic_roughness.rs: the table is the albedo of sheen, 16 roughnesses of 32 cosines.

// Estevez and Kulla 2017.
fn d_charlie(cos_h: f32, alpha: f32) -> f32 {
    return (2.0 + 1.0 / alpha) * pow(max(1.0 - cos_h * cos_h, 0.0), 0.5 / alpha) / TAU;
}

fn lambda_charlie_at(x: f32, t: f32) -> f32 {
    let a = mix(21.5473, 25.3245, t);
    let b = mix(3.82987, 3.32435, t);
    let c = mix(0.19823, 0.16801, t);
    let d = mix(-1.97760, -1.27393, t);
    let e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * pow(max(x, 0.0), c)) + d * x + e;
}

fn lambda_charlie(c: f32, alpha: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    if (c < 0.5) {
        return exp(lambda_charlie_at(c, t));
    }
    return exp(2.0 * lambda_charlie_at(0.5, t) - lambda_charlie_at(1.0 - c, t));
}

fn f_sheen(wo: vec3<f32>, wi: vec3<f32>, alpha: f32) -> f32 {
    let h = normalize(wo + wi);
    let g = 1.0 / (1.0 + lambda_charlie(wo.z, alpha) + lambda_charlie(wi.z, alpha));
    return d_charlie(h.z, alpha) * g / (4.0 * wo.z * wi.z);
}

fn sheen_row(at: u32, x: f32) -> f32 {
    return mix(table_at(at), table_at(at + 1u), x);
}

fn sheen_albedo(t: u32, c: f32, roughness: f32) -> f32 {
    let x = sqrt(clamp(c, 0.0, 1.0)) * 31.0;
    let y = clamp(roughness, 0.0, 1.0) * 15.0;
    let i = min(u32(x), 30u);
    let j = min(u32(y), 14u);
    let at = t + 32u * j + i;
    return mix(sheen_row(at, x - f32(i)), sheen_row(at + 32u, x - f32(i)), y - f32(j));
}

fn sensitivity_gauss(phase: f32, value: f32, position: f32, variance: f32, shift: f32) -> f32 {
    return value * sqrt(TAU * variance) * cos(position * phase + shift) * exp(-variance * phase * phase);
}

fn sensitivity(opd: f32, shift: vec3<f32>) -> vec3<f32> {
    let phase = TAU * opd * 1e-9;
    let xyz = vec3<f32>(
        sensitivity_gauss(phase, 5.4856e-13, 1.6810e6, 4.3278e9, shift.x)
            + sensitivity_gauss(phase, 9.7470e-14, 2.2399e6, 4.5282e9, shift.x),
        sensitivity_gauss(phase, 4.4201e-13, 1.7953e6, 9.3046e9, shift.y),
        sensitivity_gauss(phase, 5.2481e-13, 2.2084e6, 6.6121e9, shift.z),
    ) / 1.0685e-7;
    // XYZ to linear sRGB, by columns.
    return mat3x3<f32>(
        vec3<f32>(3.2404542, -0.9692660, 0.0556434),
        vec3<f32>(-1.5371385, 1.8760108, -0.2040259),
        vec3<f32>(-0.4985314, 0.0415560, 1.0572252),
    ) * xyz;
}

fn f_iridescence(c: f32, film_ior: f32, thickness: f32, f0: vec3<f32>) -> vec3<f32> {
    let s = clamp(thickness / 0.03, 0.0, 1.0);
    let film = 1.0 + (film_ior - 1.0) * s * s * (3.0 - 2.0 * s);
    let cos2_film = 1.0 - (1.0 - c * c) / (film * film);
    if (cos2_film < 0.0) {
        return vec3<f32>(1.0);
    }
    let cos_film = sqrt(cos2_film);
    let outer = (film - 1.0) / (film + 1.0);
    let r12 = outer * outer + (1.0 - outer * outer) * schlick_weight(c);
    let t121 = 1.0 - r12;
    let opd = 2.0 * film * thickness * cos_film;
    let root = sqrt(clamp(f0, vec3<f32>(0.0), vec3<f32>(0.9999)));
    let base = (1.0 + root) / (1.0 - root);
    let inner = (base / film - 1.0) / (base / film + 1.0);
    let r23 = inner * inner + (1.0 - inner * inner) * schlick_weight(cos_film);
    let phase = PI + select(vec3<f32>(0.0), vec3<f32>(PI), base < vec3<f32>(film));
    let r123 = clamp(r12 * r23, vec3<f32>(1e-5), vec3<f32>(0.9999));
    let rs = t121 * t121 * r23 / (1.0 - r123);
    let first = (rs - t121) * sqrt(r123);
    let second = first * sqrt(r123);
    let sum = r12 + rs + first * 2.0 * sensitivity(opd, phase) + second * 2.0 * sensitivity(2.0 * opd, 2.0 * phase);
    return max(sum, vec3<f32>(0.0));
}

fn metallic_roughness_facets(m: MetallicRoughness) -> Microfacets {
    let alpha = alpha_of_roughness(m.roughness);
    let along = alpha + (1.0 - alpha) * m.anisotropy * m.anisotropy;
    return microfacets(1u, m.masking, along, alpha);
}

fn metallic_roughness_coat_facets(m: MetallicRoughness) -> Microfacets {
    let alpha = alpha_of_roughness(m.clearcoat_roughness);
    return microfacets(1u, 0u, alpha, alpha);
}

fn metallic_roughness_coat_fresnel(m: MetallicRoughness, c: f32) -> f32 {
    return m.clearcoat * (0.04 + 0.96 * schlick_weight(c));
}

fn metallic_roughness_turn(m: MetallicRoughness, w: vec3<f32>, sense: f32) -> vec3<f32> {
    if (m.anisotropy == 0.0 || m.anisotropy_rotation == 0.0) {
        return w;
    }
    let s = sin(sense * m.anisotropy_rotation);
    let c = cos(m.anisotropy_rotation);
    return vec3<f32>(c * w.x + s * w.y, c * w.y - s * w.x, w.z);
}

// Reflectances of the dielectric and of the metal.
struct MetallicRoughnessFresnel {
    dielectric: vec3<f32>,
    metal: vec3<f32>,
}

fn metallic_roughness_f0(m: MetallicRoughness) -> MetallicRoughnessFresnel {
    let r = (m.ior - 1.0) / (m.ior + 1.0);
    return MetallicRoughnessFresnel(min(r * r * m.specular_color, vec3<f32>(1.0)) * m.specular, m.base_color);
}

fn metallic_roughness_fresnel_bare(m: MetallicRoughness, c: f32) -> MetallicRoughnessFresnel {
    let f0 = metallic_roughness_f0(m);
    let w = schlick_weight(c);
    return MetallicRoughnessFresnel(
        f0.dielectric + (m.specular - f0.dielectric) * w,
        f0.metal + (1.0 - f0.metal) * w,
    );
}

fn metallic_roughness_film(m: MetallicRoughness, c: f32, bare: vec3<f32>, f0: vec3<f32>) -> vec3<f32> {
    let f = f_iridescence(c, m.iridescence_ior, m.iridescence_thickness, f0);
    return mix(bare, min(f, vec3<f32>(1.0)), m.iridescence);
}

fn metallic_roughness_fresnel(m: MetallicRoughness, c: f32) -> MetallicRoughnessFresnel {
    let bare = metallic_roughness_fresnel_bare(m, c);
    if (m.iridescence == 0.0 || m.iridescence_thickness == 0.0) {
        return bare;
    }
    let f0 = metallic_roughness_f0(m);
    return MetallicRoughnessFresnel(
        metallic_roughness_film(m, c, bare.dielectric, f0.dielectric),
        metallic_roughness_film(m, c, bare.metal, f0.metal),
    );
}

// The probabilities of the lobes: coat, specular; the cosine lobe has the rest.
fn metallic_roughness_lobes(m: MetallicRoughness, t: u32, wo: vec3<f32>) -> vec2<f32> {
    let coat = metallic_roughness_coat_fresnel(m, wo.z);
    let bare = metallic_roughness_fresnel_bare(m, wo.z);
    let specular = max_element(mix(bare.dielectric, bare.metal, m.metallic));
    let diffuse = (1.0 - m.metallic) * (1.0 - max_element(bare.dielectric)) * max_element(m.base_color);
    var sheen = max_element(m.sheen_color);
    if (sheen > 0.0) {
        sheen *= sheen_albedo(t, wo.z, m.sheen_roughness);
    }
    let total = specular + diffuse + sheen;
    if (total > 0.0) {
        return vec2<f32>(coat, (1.0 - coat) * specular / total);
    }
    return vec2<f32>(coat, 1.0 - coat);
}

fn metallic_roughness_diffuse(m: MetallicRoughness, wo: vec3<f32>, wi: vec3<f32>, dielectric: vec3<f32>) -> vec3<f32> {
    let taken = max_element(max(metallic_roughness_fresnel(m, min(wo.z, wi.z)).dielectric, dielectric));
    return m.base_color * ((1.0 - taken) * FRAC_1_PI);
}

fn metallic_roughness_under_sheen(
    m: MetallicRoughness,
    t: u32,
    wo: vec3<f32>,
    wi: vec3<f32>,
    f: vec3<f32>,
) -> vec3<f32> {
    let sheen = max_element(m.sheen_color);
    if (sheen <= 0.0) {
        return f;
    }
    let albedo = max(sheen_albedo(t, wo.z, m.sheen_roughness), sheen_albedo(t, wi.z, m.sheen_roughness));
    let alpha = max(m.sheen_roughness, 0.07) * max(m.sheen_roughness, 0.07);
    return f * max(1.0 - sheen * albedo, 0.0) + m.sheen_color * f_sheen(wo, wi, alpha);
}

fn metallic_roughness_eval_pdf(m: MetallicRoughness, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> vec4<f32> {
    if (wo.z <= 0.0 || wi.z <= 0.0) {
        return vec4<f32>(0.0);
    }
    let r = microfacet_reflect(
        metallic_roughness_facets(m),
        metallic_roughness_turn(m, wo, 1.0),
        metallic_roughness_turn(m, wi, 1.0),
    );
    let fresnel = metallic_roughness_fresnel(m, r.cos_oh);
    let grazing = min(wo.z, wi.z);
    let diffuse = metallic_roughness_diffuse(m, wo, wi, fresnel.dielectric);
    var f = mix(fresnel.dielectric * r.f + diffuse, fresnel.metal * r.f, m.metallic);
    f = metallic_roughness_under_sheen(m, t, wo, wi, f);
    let lobes = metallic_roughness_lobes(m, t, wo);
    var pdf = lobes.y * r.pdf + (1.0 - lobes.y - lobes.x) * cosine_hemisphere_pdf(wi);
    if (m.clearcoat > 0.0) {
        let coat = microfacet_reflect(metallic_roughness_coat_facets(m), wo, wi);
        f = f * (1.0 - metallic_roughness_coat_fresnel(m, grazing))
            + metallic_roughness_coat_fresnel(m, coat.cos_oh) * coat.f;
        pdf += lobes.x * coat.pdf;
    }
    return vec4<f32>(f, pdf);
}

fn metallic_roughness_sample(m: MetallicRoughness, t: u32, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    if (wo.z <= 0.0) {
        return bsdf_no_sample();
    }
    let lobes = metallic_roughness_lobes(m, t, wo);
    var wi = cosine_hemisphere(u.xy);
    if (u.z < lobes.x) {
        wi = microfacet_sample_reflection(metallic_roughness_coat_facets(m), wo, u.xy);
    } else if (u.z < lobes.x + lobes.y) {
        let o = metallic_roughness_turn(m, wo, 1.0);
        let i = microfacet_sample_reflection(metallic_roughness_facets(m), o, u.xy);
        wi = metallic_roughness_turn(m, i, -1.0);
    }
    let f = metallic_roughness_eval_pdf(m, t, wo, wi);
    return bsdf_sample_of(wo, wi, f.xyz, f.w);
}

fn metallic_roughness_slope_lobe(m: MetallicRoughness, t: u32, wo: vec3<f32>, wi: vec3<f32>) -> SlopeLobe {
    if (m.clearcoat > 0.0) {
        var bare = m;
        bare.clearcoat = 0.0;
        let rest = metallic_roughness_eval_pdf(bare, t, wo, wi).xyz;
        let under = rest * (1.0 - metallic_roughness_coat_fresnel(m, min(wo.z, wi.z)));
        return slope_lobe_of(metallic_roughness_coat_facets(m), under);
    }
    let dielectric = metallic_roughness_fresnel(m, half_vector(wo, wi).w).dielectric;
    let diffuse = metallic_roughness_diffuse(m, wo, wi, dielectric) * (1.0 - m.metallic);
    let rest = metallic_roughness_under_sheen(m, t, wo, wi, diffuse);
    let facets = metallic_roughness_facets(m);
    let a = facets.ax * facets.ax;
    let b = facets.ay * facets.ay;
    let s = sin(m.anisotropy_rotation);
    let c = cos(m.anisotropy_rotation);
    return SlopeLobe(vec3<f32>(c * c * a + s * s * b, c * s * (a - b), s * s * a + c * c * b), LONG_TAILS, rest);
}

fn metallic_roughness_albedo(m: MetallicRoughness, t: u32) -> vec3<f32> {
    return m.base_color;
}
