// The lighting of Wakita et al., "Digital Archiving of Takigi Noh Based on Reflectance Analysis", 5, to the letter: the baseline that
// the picture of shade.wgsl is measured against. A fire is a point that falls off with the square of the distance and casts no
// shadow (eq. 1 and 2, with the colour of the object, which the text has and eq. 2 leaves out); a highlight is its power (eq. 3 and 4 on
// costumes, eq. 5 elsewhere) times one value of the ambient map, which shows the flames as they are now, in the mirror direction
// (eq. 6). `ambient_map` says where its centre is and what part of its radiance a flame counts in it.

// Eq. 3 grows without bound at grazing angles; cosines below this are taken for it.
const LEAST_COSINE: f32 = 1e-3;
// Exponent of the highlight where no costume is; the paper has a number for each object and gives none.
const EXPONENT: f32 = 32.0;

// Power of the highlight of a lobe between an eye and a light, both in its frame.
fn paper_highlight(lobe: Lobe, wi: vec3<f32>) -> vec3<f32> {
    let h = normalize_or(wi + lobe.wo, vec3<f32>(0.0, 0.0, 1.0));
    if (h.z <= 0.0) {
        return vec3<f32>(0.0);
    }
    if (lobe.kind == KIND_NOH) {
        let rho_s = vec3<f32>(scratch[lobe.params + 3u], scratch[lobe.params + 4u], scratch[lobe.params + 5u]);
        let slope = h.xy / (h.z * vec2<f32>(scratch[lobe.params + 6u], scratch[lobe.params + 7u]));
        return rho_s * exp(-dot(slope, slope)) / (max(wi.z, LEAST_COSINE) * max(lobe.wo.z, LEAST_COSINE));
    }
    return vec3<f32>(pow(h.z, EXPONENT));
}

// Colour of the object: what it reflects head on of light that comes at 45 degrees, beside the mirror direction.
fn paper_colour(lobe: Lobe) -> vec3<f32> {
    if (lobe.kind == KIND_NOH) {
        return vec3<f32>(scratch[lobe.params], scratch[lobe.params + 1u], scratch[lobe.params + 2u]);
    }
    let wi = vec3<f32>(0.5, 0.5, 0.70710678);
    let f = bsdf_eval_pdf(lobe.kind, lobe.params, lobe.table, vec3<f32>(0.0, 0.0, 1.0), wi);
    return clamp(f.xyz * PI, vec3<f32>(0.0), vec3<f32>(1.0));
}

@compute @workgroup_size(8, 8)
fn shade_pixels(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    let pixel = pixel_number(id.xy);
    let camera = pixel_ray(id.xy);
    let dir = camera.dir;
    var reach = camera.t_max;
    var radiance = vec3<f32>(0.0);
    var alpha = 0.0;
    let hit = primary_hit(id.xy, camera);
    if (hit.draw != NONE) {
        reach = hit.t;
        alpha = 1.0;
        let s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
        let point = shading_point(s, footprint_on(s, dir, footprint_at(hit.t)));
        let wo = -dir;
        if (HAS_SURFACE_LIGHTS && s.emitter != NONE) {
            let value = emitted(s.emitter, s.frame_n, wo);
            if (value != NONE) {
                radiance = value_at(point, vec2<f32>(0.0), value).xyz;
            }
        }
        shade(s.material, point, wo);
        for (var i = 0u; i < lobe_count; i += 1u) {
            let lobe = lobes[min(i, LOBES - 1u)];
            if (bsdf_is_delta(lobe.kind) || bsdf_transmits(lobe.kind)) {
                continue;
            }
            let colour = paper_colour(lobe);
            let mirror = reflect(dir, lobe.frame.n);
            let ambient = paper_ambient(mirror, sample2(pixel, 1u, view.index).x);
            var power = vec3<f32>(0.0);
            // Slabs of a fire follow one another, and are one point.
            var next = 0u;
            while (next < emitter_count()) {
                var to = vec3<f32>(0.0);
                var fire = vec3<f32>(0.0);
                if (is_slab(next)) {
                    var total = 0.0;
                    for (var k = 0u; k < SLABS; k += 1u) {
                        let e = emitter_at(next + k);
                        let own = slab_intensity(e);
                        fire += own;
                        total += own.x + own.y + own.z;
                        to += slab_mean(e) * (own.x + own.y + own.z);
                    }
                    next += SLABS;
                    to = to / max(total, 1e-30) - s.position;
                    fire /= dot(to, to);
                } else {
                    let light = light_sample(next, s.position, vec3<f32>(0.0), vec2<f32>(0.5));
                    next += 1u;
                    if (light.pdf <= 0.0) {
                        continue;
                    }
                    to = light.wi;
                    fire = light.radiance / light.pdf;
                    if (light_value != NONE) {
                        fire *= value_at(light_at, vec2<f32>(0.0), light_value).xyz;
                    }
                }
                let wi = to_local(lobe.frame, normalize(to));
                radiance += lobe.weight * colour * fire * (max(wi.z, 0.0) / PI);
                power += paper_highlight(lobe, wi);
            }
            radiance += lobe.weight * power * ambient * ambient_map().w;
        }
    } else if (!HIDE_EMITTERS) {
        radiance = background();
        for (var i = 0u; i < environment_count(); i += 1u) {
            radiance += environment_radiance(environment_of(i).y, dir);
        }
    }
    if (HAS_FLAMES && !HIDE_EMITTERS) {
        let flames = flames_along(camera.origin, dir, reach, sample2(pixel, 0u, view.index).x);
        radiance = radiance * flames.w + flames.xyz;
    }
    film_add(id.xy, vec4<f32>(radiance, alpha));
}

// The ambient map: sky and flames as they are seen from its centre.
fn paper_ambient(dir: vec3<f32>, u: f32) -> vec3<f32> {
    var radiance = background();
    for (var i = 0u; i < environment_count(); i += 1u) {
        radiance += environment_radiance(environment_of(i).y, dir);
    }
    if (HAS_FLAMES) {
        let flames = flames_along(ambient_map().xyz, dir, 1e30, u);
        radiance = radiance * flames.w + flames.xyz;
    }
    return radiance;
}
