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

const KIND_NOH_SLOTS: u32 = 10u;

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

// Seen in the frame around the unit normal `given`, which is in the frame of now. `mirrors`: the tangent turns with a
// normal that is mirrored. Twin of Seen::turn.
fn turn_frame(seen: Seen, given: vec3<f32>, tangent: vec3<f32>, mirrors: bool, turned: u32, lobe: u32) -> Seen {
    let old = seen.frame;
    let mirrored = (turned & 1u) != 0u && seen.wo.z * dot(given, seen.wo) <= 0.0;
    var n = given;
    var t = tangent;
    if (mirrored) {
        n = vec3<f32>(-given.x, -given.y, given.z);
        if (mirrors) {
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
        next += word_at(next);
        var seen = Seen(point.frame, to_local(point.frame, wo), false, 0u);
        var weight = 1.0;
        var probability = 1.0;
        var of_body = false;
        var absorption = vec3<f32>(0.0);
        var left = false;
        let lobe = lobe_count;
        while (!left && word_at(pc) < END_MODEL) {
            switch word_at(pc) {
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
                    let t = clamp(value_number(point, pc + 1u), 0.0, 1.0);
                    let share = select(t, 1.0 - t, word_at(pc) == STEP_FIRST);
                    weight *= share;
                    probability *= share;
                    left = share <= 0.0;
                    pc += 5u;
                }
                case STEP_SUM: {
                    probability /= float_at(pc + 1u);
                    pc += 2u;
                }
                case STEP_NORMAL_MAP: {
                    let scale = float_at(pc + 1u);
                    let c = value_rgb(point, pc + 3u) * 2.0 - 1.0;
                    let n = normalize_or(vec3<f32>(c.x * scale, c.y * scale * point.handedness, c.z), vec3<f32>(0.0, 0.0, 1.0));
                    seen = turn_frame(seen, n, vec3<f32>(1.0, 0.0, 0.0), false, word_at(pc + 2u), lobe);
                    pc += 7u;
                }
                case STEP_BUMP_MAP: {
                    let step = vec2<f32>(float_at(pc + 7u), float_at(pc + 8u));
                    let slope = value_gradient(point, pc + 3u, step) * float_at(pc + 1u);
                    // Of the surface as it lies, whichever side it is seen from.
                    var old = seen.frame;
                    if (seen.turned_over) {
                        old.n = -old.n;
                    }
                    let n = to_local(old, bumped(point, old.n, slope));
                    seen = turn_frame(seen, n, to_local(old, point.dp_du), false, word_at(pc + 2u), lobe);
                    pc += 9u;
                }
                case STEP_BODY: {
                    of_body = true;
                    absorption = vec3_at(pc + 1u);
                    pc += 4u;
                }
                default: {
                    // By the geometric normal: shading normals would open smooth outlines.
                    let front = dot(point.normal, to_world(seen.frame, seen.wo)) >= 0.0;
                    left = front != (word_at(pc) == STEP_FRONT);
                    pc += 1u;
                }
            }
        }
        if (left) {
            continue;
        }
        if (of_body) {
            has_body = true;
            body = absorption;
        }
        let op = word_at(pc);
        if (op > END_CLOTH) {
            through += weight;
            through_probability += probability;
            continue;
        }
        if (lobe >= LOBES) {
            continue;
        }
        var kind = word_at(pc + 1u);
        var params = word_at(pc + 2u);
        var table = word_at(pc + 3u);
        let own = lobe * SLOTS;
        if (op == END_MODEL) {
            let textured = word_at(pc + 5u);
            if (textured > 0u) {
                for (var i = 0u; i < word_at(pc + 4u); i += 1u) {
                    scratch[own + i] = number_at(params + i);
                }
                params = SCRATCH + own;
                for (var i = 0u; i < textured; i += 1u) {
                    let at = pc + 6u + 8u * i;
                    let slot = own + word_at(at);
                    let least = float_at(at + 2u);
                    let most = float_at(at + 3u);
                    let c = value_moved(point, vec2<f32>(0.0), at + 4u);
                    if (word_at(at + 1u) == 1u) {
                        scratch[slot] = clamp(c.x, least, most);
                        scratch[slot + 1u] = clamp(c.y, least, most);
                        scratch[slot + 2u] = clamp(c.z, least, most);
                    } else {
                        scratch[slot] = clamp(as_number(c), least, most);
                    }
                }
            }
        } else {
            let t = cloth_texel(point, vec2<f32>(0.0), pc + 2u);
            // The frame of the maps is +x along u and +y up, against v; mirrored where the picture is.
            let up = select(1.0, -1.0, dot(point.dp_dv, seen.frame.t) > 0.0);
            let flip = vec3<f32>(1.0, up, 1.0);
            // What was fitted to photographs has the shadows of its threads in it already.
            seen = turn_frame(seen, t.normal * flip, t.tangent * flip, true, 1u, lobe);
            let form = float_at(pc + 1u);
            var rho_s = t.specular;
            if (form == 1.0) {
                rho_s /= 4.0 * PI * t.sigma.x * t.sigma.y;
            }
            let slots = array<f32, KIND_NOH_SLOTS>(
                t.diffuse.x, t.diffuse.y, t.diffuse.z, rho_s.x, rho_s.y, rho_s.z, t.sigma.x, t.sigma.y, 0.0, form,
            );
            for (var i = 0u; i < KIND_NOH_SLOTS; i += 1u) {
                scratch[own + i] = slots[i];
            }
            kind = KIND_NOH;
            params = SCRATCH + own;
            table = 0u;
        }
        lobes[lobe] = Lobe(seen.frame, seen.wo, kind, params, table, weight, probability, seen.turns);
        lobe_count += 1u;
    }
}

// f |cos| and the density of `shading_sample` for the world direction `wi`, without Dirac peaks.
fn shading_eval_pdf(wi: vec3<f32>) -> vec4<f32> {
    var f = vec3<f32>(0.0);
    var pdf = 0.0;
    for (var i = 0u; i < lobe_count; i += 1u) {
        let lobe = lobes[i];
        let w = to_local(lobe.frame, wi);
        let shadow = lobe_shadow(i, wi);
        if (shadow > 0.0) {
            f += bsdf_eval(lobe.kind, lobe.params, lobe.table, lobe.wo, w) * (lobe.weight * shadow * abs(w.z));
            pdf += bsdf_pdf(lobe.kind, lobe.params, lobe.table, lobe.wo, w) * lobe.probability;
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
    let lobe = lobes[i];
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
