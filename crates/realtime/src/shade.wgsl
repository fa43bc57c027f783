// Light along a camera ray: what the visibility buffer saw, shaded, and up to BOUNCES surfaces behind it. The reference
// renderer's path tracer with fewer choices left to chance: the first surface looks at every light while they are few.
//
// Every function that is large is called from one place, for drivers put it in place of its call. A software GPU goes
// through both sides of every branch, so what the last surface of a path does not need is not in the loop for it: a ray
// and what shines at its end belong to the surface that it leaves.

fn power_heuristic(a: f32, b: f32) -> f32 {
    let r = b / max(a, 1e-30);
    return 1.0 / (1.0 + r * r);
}

// Of each tile of 8 by 8 pixels a bit a light: nothing is between that and what the tile sees.
@group(1) @binding(2) var free_lights: texture_2d<u32>;

// Surfaces behind the first look at slabs as at other lights.
const SLABS_BEHIND: bool = HAS_SLABS && BOUNCES > 1u;

// Surfaces whose reflection is looked at; light also passes straight through the last.
const SURFACES: u32 = select(BOUNCES, BOUNCES + 1u, SEES_THROUGH);

@compute @workgroup_size(8, 8)
fn shade_pixels(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= view.window.z || id.y >= view.window.w) {
        return;
    }
    let pixel = pixel_number(id.xy);
    var free = 0u;
    if (FREE_LIGHTS) {
        free = textureLoad(free_lights, id.xy / 8u, 0).x;
    }
    let camera = pixel_ray(id.xy);
    var dir = camera.dir;
    let hit = camera_hit(id.xy, camera);
    // The ray's footprint and how it grows.
    let footprint = pixel_footprint();
    var width = footprint.x;
    var spread = footprint.y;

    var radiance = vec3<f32>(0.0);
    var throughput = vec3<f32>(1.0);
    var alpha = 0.0;
    // Where the path is, and whether it goes on from there.
    var s: Surface;
    var point: ShadingPoint;
    var alive = hit.draw != NONE;
    if (alive) {
        s = surface_at(hit.draw, hit.triangle, vec2<f32>(hit.b1, hit.b2));
        width += spread * hit.t;
        point = shading_point(s, footprint_on(s, dir, width));
        // Where light passes surfaces, what they are made of says it.
        alpha = select(1.0, 0.0, SEES_THROUGH);
        if (HAS_SURFACE_LIGHTS && s.emitter != NONE) {
            let value = emitted(s.emitter, s.frame_n, -dir);
            if (value != NONE) {
                radiance = value_at(point, vec2<f32>(0.0), value).xyz;
            }
        }
    } else if (!HIDE_EMITTERS) {
        radiance = background();
        for (var i = 0u; i < environment_count(); i += 1u) {
            radiance += environment_radiance(environment_of(i).y, dir);
        }
    }
    if (HAS_FLAMES && !HIDE_EMITTERS) {
        let flames = flames_along(camera.origin, dir, hit.t, sample2(pixel, 0xffffu, view.index).x);
        radiance = radiance * flames.w + flames.xyz;
        throughput *= flames.w;
    }
    // How far back the last direction was drawn, how likely it was, and whether it is the camera's or a mirror's.
    var since = hit.t;
    var drawn_pdf = 0.0;
    var drawn_delta = true;
    // The side that it was drawn towards.
    var facing = vec3<f32>(0.0);
    var absorption = vec3<f32>(0.0);
    // What white paper in place of the first surface would reflect if nothing stood in the way of any light.
    var white = vec3<f32>(0.0);
    // Whether some surface has scattered the path: what mirrors show is as bright as it is.
    var scattered = false;
    // Surfaces passed straight through count as little as those before the camera.
    var null_steps = 0u;
    for (var depth = 0u; alive && depth < SURFACES;) {
        let wo = -dir;
        shade(s.material, point, wo);
        let own_facing = shading_facing(s.frame_n, wo);
        let last = SEES_THROUGH && depth == BOUNCES;
        // A light that is not seen, behind what lets all light pass, does not stand in the way either.
        let hidden = SEES_THROUGH && HAS_SURFACE_LIGHTS && alpha == 0.0 && is_hidden(s.emitter);
        if (alpha == 0.0 && through < 1.0 && !hidden) {
            alpha = 1.0;
        }
        // Five sets of its own and one for each light.
        let first_set = 32u * (depth + (BOUNCES + 1u) * null_steps);

        // A direction to go on into.
        let u_lobe = vec4<f32>(sample2(pixel, first_set, view.index), sample2(pixel, first_set + 1u, view.index));
        var next = ShadingSample(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), false, false, false);
        if (!last || through > 0.0) {
            next = shading_sample(u_lobe, wo);
        }
        if (hidden) {
            next = ShadingSample(dir, 1.0, vec3<f32>(1.0), true, true, false);
        }
        alive = next.pdf > 0.0 && !(last && !next.is_null) && null_steps < MOST_SHEETS;

        // Rays one after the other: to lights, and into the direction drawn. Where lights are many a ray is for several,
        // from which one is drawn by what it would add if nothing stood in its way (Talbot, Cline and Egbert 2005,
        // "Importance Resampling for Global Illumination").
        // The first surface looks at slabs apart from what else shines, and at all of them: a ray for each fire, or for
        // several, towards the slab from which most comes, by chance. What they give is known but for what is in between.
        let slabs = select(0u, emitter_count() - plain_count(), depth == 0u && HAS_SLABS);
        let count = select(emitter_count() - slabs, 1u, HEAD_LIGHT);
        var candidates = select(min(count, CANDIDATES), min(count, select(1u, 0u, HEAD_LIGHT)), depth > 0u);
        let dark = last || hidden || !shading_smooth();
        if (dark) {
            candidates = 0u;
        }
        // Then what a ray finds by chance counts nothing, and none is sent for that alone.
        let by_lights = LIGHTS_SUFFICE && candidates == count && shading_diffuse();
        let finds = RAYS_FIND_LIGHT && (!by_lights || HAS_BACKGROUND);
        alive = alive && (next.is_null || depth + 1u < BOUNCES || finds);
        let rays = select(SHADOW_RAYS, candidates, candidates <= FEW_LIGHTS);
        let here = s;
        // All slabs of a fire are looked at, so that only what stands in between is left to chance: a ray for fires n,
        // n + SHADOW_RAYS and so on.
        for (var ray = 0u; HAS_SLABS && !dark && ray < min(slabs / SLABS, SHADOW_RAYS); ray += 1u) {
            var u_draw = sample2(pixel, first_set + 4u, view.index + rays + ray).x;
            var sum = 0.0;
            var all = vec3<f32>(0.0);
            var drawn = NONE;
            var i = SLABS * ray;
            while (i < slabs) {
                let slab = count + i;
                i += 1u;
                if (i % SLABS == 0u) {
                    i += SLABS * (SHADOW_RAYS - 1u);
                }
                let light = slab_sample(emitter_at(slab), here.position);
                white += light.radiance / PI;
                let adds = throughput * light.radiance * shading_of_light(light.wi, true, light_gaussian).xyz;
                let size = adds.x + adds.y + adds.z;
                if (!(size > 0.0 && size < 3e38)) {
                    continue;
                }
                sum += size;
                all += adds;
                // The number is stretched back to [0, 1) after each decision.
                let share = size / sum;
                if (u_draw < share) {
                    u_draw /= share;
                    drawn = slab;
                } else {
                    u_draw = (u_draw - share) / (1.0 - share);
                }
            }
            if (drawn != NONE) {
                let u = sample2(pixel, first_set + 5u + CANDIDATES + ray, view.index);
                let to = to_slab_point(drawn, here.position, u);
                let origin = offset_origin(here.position, here.error, here.geometric_normal, to.xyz);
                let passed = passed_over(here.draw, dot(here.geometric_normal, to.xyz) < 0.0);
                radiance += all * traverse(origin, to.xyz, 0.0, to.w, true, true, passed).t;
            }
        }
        for (var ray = 0u; ray < rays + u32(alive); ray += 1u) {
            var of_light = ray < rays;
            var wi = next.wi;
            // What the ray has to carry, and how far it goes.
            var carried = vec3<f32>(0.0);
            var reach = 1e30;
            var value = NONE;
            var at = point;
            var f = vec4<f32>(0.0);
            // What all candidates of the ray would add, and the drawn one.
            var sum = 0.0;
            var drawn = 0.0;
            var u_draw = sample2(pixel, first_set + 4u, view.index + ray).x;
            var drawn_emitter = NONE;
            var i = ray;
            loop {
                if (i >= select(ray + 1u, candidates, of_light)) {
                    // Without a ray to send for these, those of the next are looked at.
                    if (!of_light || drawn > 0.0 || ray + 1u >= rays + u32(alive)) {
                        break;
                    }
                    ray += 1u;
                    of_light = ray < rays;
                    i = ray;
                }
                let own = i;
                i += select(1u, max(rays, 1u), of_light);
                var light = no_light();
                var chance = 1.0;
                var emitter = own;
                if (of_light) {
                    let u = sample2(pixel, first_set + 5u + own, view.index);
                    if (candidates < count) {
                        let part = sample2(pixel, first_set + 2u, view.index).x;
                        let at = (f32(own) + part) / f32(candidates);
                        var choice: Choice;
                        if (SLABS_BEHIND && depth > 0u) {
                            choice = emitter_choose_near(here.position, own_facing, at);
                        } else {
                            choice = emitter_choose(count, at);
                        }
                        emitter = choice.entry;
                        chance = choice.probability * f32(candidates);
                    }
                    if (HEAD_LIGHT) {
                        // Nothing is between the eye and what it sees.
                        light_value = NONE;
                        light = LightSample(wo, 0.0, vec3<f32>(PI), 1.0, true);
                    } else {
                        light = light_sample(emitter, here.position, own_facing, u);
                    }
                }
                if (of_light && (light.pdf <= 0.0 || chance <= 0.0) || !of_light && !next.combine) {
                    continue;
                }
                if (HAS_SLABS && of_light && depth == 0u) {
                    white += light.radiance / (PI * light.pdf * chance);
                }
                let gaussian = SLABS_BEHIND && of_light && is_slab(emitter);
                f = shading_of_light(select(wi, light.wi, of_light), gaussian, light_gaussian);
                if (of_light) {
                    let pdf = light.pdf * chance;
                    let weight = select(power_heuristic(pdf, f.w), 1.0, light.is_delta || by_lights);
                    let adds = throughput * f.xyz * light.radiance * (weight / pdf);
                    let size = adds.x + adds.y + adds.z;
                    if (!(size > 0.0 && size < 3e38)) {
                        continue;
                    }
                    let is_free =
                        FREE_LIGHTS && depth == 0u && null_steps == 0u && emitter < 32u && ((free >> emitter) & 1u) != 0u;
                    if (is_free && light_value == NONE) {
                        radiance += adds;
                        continue;
                    }
                    sum += size;
                    // The number is stretched back to [0, 1) after each decision.
                    let share = size / sum;
                    if (u_draw < share) {
                        u_draw /= share;
                        drawn = size;
                        carried = adds;
                        wi = light.wi;
                        // A ray that ends before it begins meets nothing.
                        reach = select(light.distance * (1.0 - 1e-3), -1.0, is_free);
                        value = light_value;
                        at = light_at;
                        drawn_emitter = emitter;
                    } else {
                        u_draw = (u_draw - share) / (1.0 - share);
                    }
                }
            }
            if (of_light) {
                if (drawn <= 0.0) {
                    continue;
                }
                carried *= sum / drawn;
                if (SLABS_BEHIND && is_slab(drawn_emitter)) {
                    let u = sample2(pixel, first_set + 5u, view.index);
                    let to = to_slab_point(drawn_emitter, here.position, u);
                    wi = to.xyz;
                    reach = to.w;
                }
            } else {
                if (next.combine) {
                    next.pdf = f.w;
                    next.weight = select(vec3<f32>(0.0), f.xyz / max(f.w, 1e-30), f.w > 0.0);
                }
                throughput *= next.weight;
                if (has_body && !hidden && dot(here.geometric_normal, wo) * dot(here.geometric_normal, wi) < 0.0) {
                    absorption = select(vec3<f32>(0.0), body, dot(here.geometric_normal, wi) < 0.0);
                }
                if (next.is_null) {
                    null_steps += 1u;
                } else {
                    facing = own_facing;
                    since = 0.0;
                    drawn_pdf = select(next.pdf, 0.0, by_lights);
                    drawn_delta = next.is_delta;
                    scattered = scattered || !next.is_delta;
                    depth += 1u;
                    if (!next.is_delta) {
                        // A rough bounce spreads the footprint like a lobe of that density.
                        spread = max(spread, min(sqrt(1.0 / (4.0 * max(next.pdf, 0.05))), 0.5));
                    }
                }
                // Russian roulette: long paths that carry little end, and those that go on count for them.
                let most = max(throughput.x, max(throughput.y, throughput.z));
                var survive = select(0.0, 1.0, next.pdf > 0.0 && most > 0.0);
                if (depth >= ROULETTE) {
                    survive *= min(most, 0.95);
                }
                alive = sample2(pixel, first_set + 3u, view.index).x < survive;
                if (!alive) {
                    break;
                }
                throughput /= survive;
                dir = wi;
            }

            let past_fuel = SLABS_BEHIND && of_light && is_slab(drawn_emitter);
            let origin = offset_origin(here.position, here.error, here.geometric_normal, wi);
            let passed = passed_over(here.draw, dot(here.geometric_normal, wi) < 0.0);
            let h = traverse(origin, wi, 0.0, reach, of_light, past_fuel, passed);
            if (HAS_FLAMES && !of_light && drawn_delta && !(HIDE_EMITTERS && alpha == 0.0)) {
                let reach = select(h.t, 1e30, h.draw == NONE);
                let u = sample2(pixel, first_set + 3u, view.index).y;
                let flames = flames_along(here.position, dir, reach, u);
                radiance += throughput * flames.xyz;
                throughput *= flames.w;
            }
            // What shines there: where its value is and where that is looked up.
            if (of_light) {
                carried *= h.t;
            } else if (h.draw == NONE) {
                alive = false;
                carried = vec3<f32>(0.0);
                if (!(HIDE_EMITTERS && alpha == 0.0)) {
                    carried = background();
                    for (var i = 0u; i < environment_count(); i += 1u) {
                        let e = environment_of(i);
                        let r = environment_radiance_pdf(e.y, dir, facing);
                        var weight = 1.0;
                        if (!drawn_delta) {
                            weight = power_heuristic(drawn_pdf, r.w * light_chance(e.x, depth));
                        }
                        carried += weight * r.xyz;
                    }
                    carried *= throughput;
                }
            } else {
                since += h.t;
                width += spread * h.t;
                if (any(absorption != vec3<f32>(0.0))) {
                    throughput *= exp(-h.t * absorption);
                }
                carried = vec3<f32>(0.0);
                s = surface_at(h.draw, h.triangle, vec2<f32>(h.b1, h.b2));
                point = shading_point(s, footprint_on(s, dir, width));
                at = point;
                if (HAS_SURFACE_LIGHTS && s.emitter != NONE && !(alpha == 0.0 && is_hidden(s.emitter))) {
                    value = emitted(s.emitter, s.frame_n, -dir);
                    if (value != NONE) {
                        carried = throughput;
                        if (!drawn_delta) {
                            let p = area_pdf(s.emitter, s.position - since * dir, since, dot(s.geometric_normal, dir));
                            carried *= power_heuristic(drawn_pdf, p * light_chance(s.emitter, depth));
                        }
                    }
                }
            }
            if (value != NONE) {
                carried *= value_at(at, vec2<f32>(0.0), value).xyz;
            }
            // What comes by way of other surfaces and is brighter than that is a speck until there are many frames: it is dimmed to
            // so much, by less with each frame, so that pictures tend to what they would be without.
            if (HAS_SLABS && scattered && depth >= select(2u, 1u, of_light) && any(white > vec3<f32>(0.0))) {
                let most = sqrt(f32(view.index + 1u)) * max(white.x, max(white.y, white.z));
                carried *= min(1.0, most / max(max(carried.x, max(carried.y, carried.z)), 1e-30));
            }
            radiance += carried;
        }
    }
    film_add(id.xy, vec4<f32>(radiance, alpha));
}

// How many light samples of the surface before are expected to have looked at this emitter.
fn light_chance(emitter: u32, depth: u32) -> f32 {
    // The first surface looks at slabs by themselves.
    let count = select(plain_count(), emitter_count(), depth > 1u);
    let looks = select(min(count, CANDIDATES), min(count, 1u), depth > 1u);
    if (looks >= count) {
        return 1.0;
    }
    // May be above one: it is how many samples are expected to look there.
    return emitter_probability(emitter) / emitters_share(count) * f32(looks);
}
