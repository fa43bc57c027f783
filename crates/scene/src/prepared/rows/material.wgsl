// A material where it is shaded: the lobes that are left of its ends. Twin of prepared/material.rs; words as in
// rows/material.rs.

const STEP_ABOVE: u32 = 0u;
const STEP_BELOW: u32 = 1u;
const STEP_FIRST: u32 = 2u;
const STEP_SECOND: u32 = 3u;
const STEP_SUM: u32 = 4u;
const STEP_NORMAL_MAP: u32 = 5u;
const STEP_BUMP_MAP: u32 = 6u;
const STEP_BODY: u32 = 7u;
const STEP_FRONT: u32 = 8u;
const STEP_BACK: u32 = 9u;
const END_MODEL: u32 = 10u;
const END_CLOTH: u32 = 11u;

// Whether a step occurs in the scene; what does not is left out when the shader is compiled.
fn has_step(step: u32) -> bool {
    return ((STEPS >> step) & 1u) != 0u;
}

// The tangent turns with a normal that is mirrored.
const TANGENT_TURNS: u32 = 4u;

// One frame turned into another by a map. Twin of prepared::Turn.
struct Turn {
    before: vec3<f32>,
    after: vec3<f32>,
    // Squared roughness of the relief that shadows itself; 0: it does not.
    alpha2: f32,
}

struct Lobe {
    // Left-handed where the surface is seen from below and turned over.
    frame: Frame,
    wo: vec3<f32>,
    kind: u32,
    params: u32,
    table: u32,
    weight: f32,
    probability: f32,
    turns: u32,
}

var<private> lobes: array<Lobe, LOBES>;
var<private> lobe_turns: array<Turn, LOBES * TURNS>;
var<private> lobe_count: u32;
// Part of the light that goes straight through, and the probability of following it.
var<private> through: f32;
var<private> through_probability: f32;
// Absorption, per scene unit, of the body that this is the surface of; `has_body`: it is one.
var<private> body: vec3<f32>;
var<private> has_body: bool;

// How a branch of the material is seen.
struct Seen {
    frame: Frame,
    wo: vec3<f32>,
    turned_over: bool,
    turns: u32,
}

// Seen in the frame around the unit normal `given`, which is in the frame of now. `turned`: as the words of
// a map have it, and TANGENT_TURNS. Twin of Seen::turn.
fn turn_frame(seen: Seen, given: vec3<f32>, tangent: vec3<f32>, turned: u32, lobe: u32) -> Seen {
    let old = seen.frame;
    let mirrored = (turned & 1u) != 0u && seen.wo.z * dot(given, seen.wo) <= 0.0;
    var n = given;
    var t = tangent;
    if (mirrored) {
        n = vec3<f32>(-given.x, -given.y, given.z);
        if ((turned & TANGENT_TURNS) != 0u) {
            t = vec3<f32>(-tangent.x, -tangent.y, tangent.z);
        }
    }
    let local = frame_from_normal_tangent(n, t);
    let frame = Frame(to_world(old, local.s), to_world(old, local.t), to_world(old, local.n));
    var alpha2 = 0.0;
    if ((turned & 2u) != 0u) {
        let cos2 = n.z * n.z;
        alpha2 = 1.0;
        if (cos2 > 0.0) {
            alpha2 = min(0.125 * max(1.0 - cos2, 0.0) / cos2, 1.0);
        }
    }
    if (seen.turns < TURNS && lobe < LOBES) {
        lobe_turns[lobe * TURNS + seen.turns] = Turn(old.n, frame.n, alpha2);
    }
    return Seen(frame, to_local(local, seen.wo), seen.turned_over, seen.turns + 1u);
}

// Part of the light from `wi` that the maps over a lobe let through.
fn lobe_shadow(lobe: u32, wi: vec3<f32>) -> f32 {
    var shadow = 1.0;
    for (var i = 0u; i < min(lobes[lobe].turns, TURNS); i += 1u) {
        let turn = lobe_turns[lobe * TURNS + i];
        let c = dot(turn.before, wi);
        if (c * dot(turn.after, wi) <= 0.0) {
            return 0.0;
        }
        if (turn.alpha2 > 0.0) {
            let tan2 = max(1.0 - c * c, 0.0) / (c * c);
            shadow *= 2.0 / (1.0 + sqrt(1.0 + turn.alpha2 * tan2));
        }
    }
    return shadow;
}

// Blinn 1978: the normal `n` after raising the surface by a height field with this slope per unit of (u, v).
fn bumped(point: ShadingPoint, n: vec3<f32>, slope: vec2<f32>) -> vec3<f32> {
    let dp_du = point.dp_du + n * (slope.x - dot(n, point.dp_du));
    let dp_dv = point.dp_dv + n * (slope.y - dot(n, point.dp_dv));
    let turned = normalize_or(cross(dp_du, dp_dv), n);
    return select(turned, -turned, dot(turned, point.normal) < 0.0);
}

// Resolves `material` at `point`, seen along the world direction `wo` (towards the eye), into the lobes above.
fn shade(material: u32, point: ShadingPoint, wo: vec3<f32>) {
    lobe_count = 0u;
    through = 0.0;
    through_probability = 0.0;
    body = vec3<f32>(0.0);
    has_body = false;
    let row = word_at(3u) + 2u * material;
    var next = word_at(row);
    let ends = word_at(row + 1u);
    for (var end = 0u; end < ends; end += 1u) {
        var pc = next + 1u;
        next += word_at(next) & 0x7fffffffu;
        var seen = Seen(point.frame, to_local(point.frame, wo), false, 0u);
        var weight = 1.0;
        var probability = 1.0;
        var of_body = false;
        var absorption = vec3<f32>(0.0);
        var left = false;
        var at_end = false;
        // Which lookup of a step that takes several.
        var i = 0u;
        var heights = vec4<f32>(0.0);
        let lobe = lobe_count;
        let own = min(lobe, LOBES - 1u) * SLOTS;
        var kind = 0u;
        var table = 0u;
        while (!left && !at_end) {
            let op = word_at(pc);
            // The value that this step looks up.
            var value = NONE;
            var offset = vec2<f32>(0.0);
            var patch_: Patch;
            var step = vec2<f32>(1.0);
            switch op {
                case STEP_FIRST, STEP_SECOND: { value = pc + 1u; }
                case STEP_NORMAL_MAP: { value = pc + 3u; }
                case STEP_BUMP_MAP: {
                    if (has_step(STEP_BUMP_MAP)) {
                        value = pc + 3u;
                        step = vec2<f32>(float_at(pc + 7u), float_at(pc + 8u));
                        patch_ = patch_of(point, value);
                        offset = patch_offset(patch_, i, step);
                    }
                }
                case END_MODEL: {
                    if (i < word_at(pc + 5u)) {
                        value = pc + 10u + 8u * i;
                    }
                }
                default: {}
            }
            var c = vec4<f32>(0.0);
            if (value != NONE) {
                c = value_at(point, offset, value);
            }
            // The normal of a map and its tangent.
            var given = vec3<f32>(0.0);
            var tangent = vec3<f32>(1.0, 0.0, 0.0);
            var turned = 0u;
            switch op {
                case STEP_ABOVE: {
                    left = seen.wo.z < 0.0;
                    pc += 1u;
                }
                case STEP_BELOW: {
                    left = seen.wo.z >= 0.0;
                    seen.wo.z = -seen.wo.z;
                    seen.frame.n = -seen.frame.n;
                    seen.turned_over = !seen.turned_over;
                    pc += 1u;
                }
                case STEP_FIRST, STEP_SECOND: {
                    if (has_step(STEP_FIRST)) {
                        let t = clamp(as_number(c), 0.0, 1.0);
                        let share = select(t, 1.0 - t, op == STEP_FIRST);
                        weight *= share;
                        probability *= share;
                        left = share <= 0.0;
                    }
                    pc += 5u;
                }
                case STEP_SUM: {
                    probability /= float_at(pc + 1u);
                    pc += 2u;
                }
                case STEP_NORMAL_MAP: {
                    if (has_step(STEP_NORMAL_MAP)) {
                        let scale = float_at(pc + 1u);
                        let n = c.xyz * 2.0 - 1.0;
                        let scaled = vec3<f32>(n.x * scale, n.y * scale * point.handedness, n.z);
                        given = normalize_or(scaled, vec3<f32>(0.0, 0.0, 1.0));
                        turned = word_at(pc + 2u);
                    }
                    pc += 7u;
                }
                case STEP_BUMP_MAP: {
                    heights[i] = as_number(c);
                    i += 1u;
                    if (has_step(STEP_BUMP_MAP) && i == 4u) {
                        i = 0u;
                        let slope = patch_slope(patch_, heights, step) * float_at(pc + 1u);
                        // Of the surface as it lies, whichever side it is seen from.
                        var old = seen.frame;
                        if (seen.turned_over) {
                            old.n = -old.n;
                        }
                        given = to_local(old, bumped(point, old.n, slope));
                        tangent = to_local(old, point.dp_du);
                        turned = word_at(pc + 2u);
                        pc += 9u;
                    }
                }
                case STEP_BODY: {
                    of_body = true;
                    absorption = vec3_at(pc + 1u);
                    pc += 4u;
                }
                case STEP_FRONT, STEP_BACK: {
                    // By the geometric normal: shading normals would open smooth outlines.
                    let front = dot(point.normal, to_world(seen.frame, seen.wo)) >= 0.0;
                    left = front != (op == STEP_FRONT);
                    pc += 1u;
                }
                case END_MODEL: {
                    if (i == 0u) {
                        kind = word_at(pc + 1u);
                        table = word_at(pc + 3u);
                        let slots = word_at(pc + 2u);
                        for (var j = 0u; j < word_at(pc + 4u); j += 1u) {
                            scratch[own + j] = number_at(slots + j);
                        }
                    }
                    if (value != NONE) {
                        let slot = own + word_at(value - 4u);
                        let least = float_at(value - 2u);
                        let most = float_at(value - 1u);
                        if (word_at(value - 3u) == 1u) {
                            scratch[slot] = clamp(c.x, least, most);
                            scratch[slot + 1u] = clamp(c.y, least, most);
                            scratch[slot + 2u] = clamp(c.z, least, most);
                        } else {
                            scratch[slot] = clamp(as_number(c), least, most);
                        }
                        i += 1u;
                    }
                    at_end = i == word_at(pc + 5u);
                }
                case END_CLOTH: {
                    at_end = true;
                    if (has_step(END_CLOTH)) {
                        let cloth = cloth_at(point, pc + 2u, float_at(pc + 1u), own);
                        // The frame of the maps is +x along u and +y up, against v; mirrored where the picture is.
                        let up = select(1.0, -1.0, dot(point.dp_dv, seen.frame.t) > 0.0);
                        given = cloth.normal * vec3<f32>(1.0, up, 1.0);
                        tangent = cloth.tangent * vec3<f32>(1.0, up, 1.0);
                        // What was fitted to photographs has the shadows of its threads in it already.
                        turned = 1u | TANGENT_TURNS;
                        kind = KIND_NOH;
                    }
                }
                default: {
                    at_end = true;
                }
            }
            if (HAS_TURNS && any(given != vec3<f32>(0.0))) {
                seen = turn_frame(seen, given, tangent, turned, lobe);
            }
        }
        if (left) {
            continue;
        }
        if (of_body) {
            has_body = true;
            body = absorption;
        }
        if (word_at(pc) > END_CLOTH) {
            through += weight;
            through_probability += probability;
            continue;
        }
        if (lobe >= LOBES) {
            continue;
        }
        lobes[min(lobe, LOBES - 1u)] = Lobe(seen.frame, seen.wo, kind, own, table, weight, probability, seen.turns);
        lobe_count += 1u;
    }
}

// Part of the light along -wo that goes straight through: what `shade` says of it, but for maps of normals on the way to
// an end, which no step before it is looked at through.
fn shade_through(material: u32, point: ShadingPoint, wo: vec3<f32>) -> f32 {
    var sum = 0.0;
    let row = word_at(3u) + 2u * material;
    var next = word_at(row);
    let ends = word_at(row + 1u);
    for (var end = 0u; end < ends; end += 1u) {
        var pc = next + 1u;
        let open = word_at(next) >= 0x80000000u;
        next += word_at(next) & 0x7fffffffu;
        var weight = 1.0;
        var side = dot(point.frame.n, wo);
        while (open && weight > 0.0 && word_at(pc) < END_MODEL) {
            switch word_at(pc) {
                case STEP_ABOVE: {
                    weight = select(weight, 0.0, side < 0.0);
                    pc += 1u;
                }
                case STEP_BELOW: {
                    weight = select(weight, 0.0, side >= 0.0);
                    side = -side;
                    pc += 1u;
                }
                case STEP_FIRST, STEP_SECOND: {
                    let t = clamp(as_number(value_at(point, vec2<f32>(0.0), pc + 1u)), 0.0, 1.0);
                    weight *= select(t, 1.0 - t, word_at(pc) == STEP_FIRST);
                    pc += 5u;
                }
                case STEP_SUM: { pc += 2u; }
                case STEP_NORMAL_MAP: { pc += 7u; }
                case STEP_BUMP_MAP: { pc += 9u; }
                case STEP_BODY: { pc += 4u; }
                default: {
                    let front = dot(point.normal, wo) >= 0.0;
                    weight = select(0.0, weight, front == (word_at(pc) == STEP_FRONT));
                    pc += 1u;
                }
            }
        }
        sum += select(0.0, weight, open);
    }
    return sum;
}

// The side that light has to come to for some lobe to reflect it to `wo`; zero: it may come from all around.
fn shading_facing(normal: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    var facing = select(normal, -normal, dot(normal, wo) < 0.0);
    for (var i = 0u; i < lobe_count; i += 1u) {
        let lobe = lobes[min(i, LOBES - 1u)];
        let crossed = HAS_TURNS && dot(lobe.frame.n, wo) * dot(normal, wo) <= 0.0;
        if (!bsdf_is_delta(lobe.kind) && (bsdf_transmits(lobe.kind) || crossed)) {
            facing = vec3<f32>(0.0);
        }
    }
    return facing;
}

// f |cos| and the density of `shading_sample` for the world direction `wi`, without Dirac peaks.
fn shading_eval_pdf(wi: vec3<f32>) -> vec4<f32> {
    return shading_of_light(wi, false, GaussianLight());
}

// The same; `of_gaussian`: what comes of all of `light`, in the world, for each unit of irradiance that it would give what
// faces it.
fn shading_of_light(wi: vec3<f32>, of_gaussian: bool, light: GaussianLight) -> vec4<f32> {
    var f = vec3<f32>(0.0);
    var pdf = 0.0;
    for (var i = 0u; i < lobe_count; i += 1u) {
        let lobe = lobes[min(i, LOBES - 1u)];
        let w = to_local(lobe.frame, wi);
        let shadow = lobe_shadow(i, wi);
        if (shadow > 0.0) {
            var r = GaussianReflection(w, abs(w.z), vec3<f32>(0.0), 0.0);
            if (HAS_SLABS && of_gaussian && !bsdf_transmits(lobe.kind)) {
                let frame = mat3x3<f32>(lobe.frame.s, lobe.frame.t, lobe.frame.n);
                let covariance = transpose(frame) * light.covariance * frame;
                let local = GaussianLight(light.intensity, to_local(lobe.frame, light.mean), covariance);
                r = gaussian_reflection(lobe.kind, lobe.params, lobe.table, lobe.wo, local);
            }
            let e = bsdf_eval_pdf(lobe.kind, lobe.params, lobe.table, lobe.wo, r.wi);
            f += gaussian_reflected(r, e.xyz) * (lobe.weight * shadow);
            pdf += e.w * lobe.probability;
        }
    }
    return vec4<f32>(f, pdf);
}

// Whether light sampling can find anything: some lobe is not a mere Dirac peak.
fn shading_smooth() -> bool {
    for (var i = 0u; i < lobe_count; i += 1u) {
        if (!bsdf_is_delta(lobes[i].kind)) {
            return true;
        }
    }
    return false;
}

// Whether light sampling finds all there is at least as well as directions drawn from the material: every lobe is diffuse.
fn shading_diffuse() -> bool {
    for (var i = 0u; i < lobe_count; i += 1u) {
        if (!bsdf_is_diffuse(lobes[i].kind)) {
            return false;
        }
    }
    return lobe_count > 0u;
}

// A drawn direction in the world. Where `pdf` is 0 there is none. Twin of prepared::ShadingSample; its weight is not
// final where `combine`: several lobes or light going through, so that it is shading_eval_pdf(wi) that counts.
struct ShadingSample {
    wi: vec3<f32>,
    pdf: f32,
    weight: vec3<f32>,
    is_delta: bool,
    is_null: bool,
    combine: bool,
}

fn shading_sample(u: vec4<f32>, wo: vec3<f32>) -> ShadingSample {
    var choice = u.z;
    if (through_probability > 0.0) {
        if (choice < through_probability) {
            let weight = vec3<f32>(through / through_probability);
            return ShadingSample(-wo, through_probability, weight, true, true, false);
        }
        choice -= through_probability;
    }
    let none = ShadingSample(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), false, false, false);
    if (lobe_count == 0u) {
        return none;
    }
    var i = 0u;
    // The last takes what rounding left over.
    while (i + 1u < lobe_count && choice >= lobes[i].probability) {
        choice -= lobes[i].probability;
        i += 1u;
    }
    let lobe = lobes[min(i, LOBES - 1u)];
    let v = vec3<f32>(u.xy, clamp(choice / lobe.probability, 0.0, 0.99999994));
    let s = bsdf_sample(lobe.kind, lobe.params, lobe.table, lobe.wo, v);
    if (s.pdf <= 0.0) {
        return none;
    }
    let wi = to_world(lobe.frame, s.wi);
    let shadow = lobe_shadow(i, wi);
    if (shadow == 0.0) {
        return none;
    }
    let weight = s.weight * (shadow * lobe.weight / lobe.probability);
    let combine = s.is_delta == 0u && (lobe_count > 1u || through > 0.0);
    return ShadingSample(wi, s.pdf * lobe.probability, weight, s.is_delta != 0u, false, combine);
}

// Mean normal of the lobes, on the side that `side` points to; `side` itself where there are none.
fn shading_normal_towards(side: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < lobe_count; i += 1u) {
        sum += lobes[i].frame.n * lobes[i].weight;
    }
    let mean = normalize_or(sum, side);
    return select(mean, -mean, dot(mean, side) < 0.0);
}

// Twin of Shading::albedo.
fn shading_albedo() -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < lobe_count; i += 1u) {
        let lobe = lobes[min(i, LOBES - 1u)];
        sum += bsdf_albedo(lobe.kind, lobe.params, lobe.table) * lobe.weight;
    }
    return sum;
}
