// Emitters. Words as in rows/light.rs.

const EMITTER_WORDS: u32 = 27u;
const EMITTER_AREA: u32 = 0u;
const EMITTER_POINT: u32 = 1u;
const EMITTER_SPOT: u32 = 2u;
const EMITTER_DIRECTIONAL: u32 = 3u;
const EMITTER_ENVIRONMENT: u32 = 4u;
const EMITTER_PROJECTOR: u32 = 5u;
const EMITTER_SLAB: u32 = 6u;
// Not kinds: some sphere, some rectangle among them.
const EMITTER_ROUND: u32 = 31u;
const EMITTER_RECTANGLE: u32 = 30u;

// Whether emitters of this kind occur in the scene; what does not is left out when the shader is compiled.
fn has_emitter(kind: u32) -> bool {
    return ((EMITTERS >> kind) & 1u) != 0u;
}

// The unit normal on the side that the winding and the vertex normals say, of a triangle of a draw with these edges.
fn draw_normal(flags: u32, e1: vec3<f32>, e2: vec3<f32>) -> vec3<f32> {
    let n = normalize_or(cross(e1, e2), vec3<f32>(0.0, 0.0, 1.0));
    let turned = (flags & (HAS_NORMALS | MIRRORED)) == (HAS_NORMALS | MIRRORED);
    return select(n, -n, turned != ((flags & FLIPPED) != 0u));
}

fn emitter_count() -> u32 {
    return word_at(5u);
}

fn emitter_at(emitter: u32) -> u32 {
    return word_at(4u) + EMITTER_WORDS * emitter;
}

// Emitters before the slabs, which come last.
fn plain_count() -> u32 {
    return word_at(11u);
}

// By its power among the first `count`: which, and how likely that was.
fn emitter_choose(count: u32, u: f32) -> Choice {
    let share = emitters_share(count);
    var choice = choose(word_at(6u), emitter_count(), u * share);
    choice.entry = min(choice.entry, count - 1u);
    choice.probability /= share;
    return choice;
}

// The probability of the first `count` together.
fn emitters_share(count: u32) -> f32 {
    return select(numbers[word_at(6u) + count - 1u], 1.0, count == emitter_count());
}

fn emitter_probability(emitter: u32) -> f32 {
    return choice_probability(word_at(6u), emitter);
}

// A direction towards a light. Where `pdf` is 0 nothing comes from it.
struct LightSample {
    wi: vec3<f32>,
    // How far the way must be free.
    distance: f32,
    // Radiance; of a Dirac light irradiance on a surface that faces it.
    radiance: vec3<f32>,
    // Per solid angle; 1 for a Dirac light.
    pdf: f32,
    is_delta: bool,
}

fn no_light() -> LightSample {
    return LightSample(vec3<f32>(0.0, 0.0, 1.0), 0.0, vec3<f32>(0.0), 0.0, false);
}

// Where a program or a value is looked up that no surface has.
fn nowhere(uv: vec2<f32>) -> ShadingPoint {
    let z = vec3<f32>(0.0, 0.0, 1.0);
    let frame = Frame(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), z);
    return ShadingPoint(frame, 1.0, z, frame.s, frame.t, uv, 0.0, NONE, 0u, vec2<f32>(0.0));
}

// What an emitter's radiance is to be multiplied by is looked up by the caller, who does so for surfaces, too: `value`
// is where its four words are (NONE: nothing is), `at` where it is looked up.
var<private> light_value: u32;
var<private> light_at: ShadingPoint;
// A slab is a Gaussian light, whose reflection is known but for what stands in between: `slab_point` says where to look.
var<private> light_gaussian: GaussianLight;

// A direction from `position` to an emitter; `facing`: the side that light has to come to, zero for both.
fn light_sample(emitter: u32, position: vec3<f32>, facing: vec3<f32>, u: vec2<f32>) -> LightSample {
    light_value = NONE;
    let e = emitter_at(emitter);
    let kind = word_at(e);
    if (has_emitter(EMITTER_AREA) && kind == EMITTER_AREA) {
        return area_sample(e, position, u);
    }
    if (has_emitter(EMITTER_DIRECTIONAL) && kind == EMITTER_DIRECTIONAL) {
        return LightSample(-vec3_at(e + 1u), 3.0e38, vec3_at(e + 4u), 1.0, true);
    }
    if (has_emitter(EMITTER_ENVIRONMENT) && kind == EMITTER_ENVIRONMENT) {
        let s = environment_sample(word_at(e + 1u), facing, u);
        return LightSample(s.wi, 3.0e38, environment_radiance_at(word_at(e + 1u), s.place), s.pdf, false);
    }
    if (has_emitter(EMITTER_SLAB) && kind == EMITTER_SLAB) {
        return slab_sample(e, position);
    }
    var origin = vec3_at(e + 1u);
    if (kind == EMITTER_PROJECTOR) {
        origin = vec3_at(e + 13u);
    }
    let to = origin - position;
    let d2 = dot(to, to);
    let distance = sqrt(d2);
    let wi = to / distance;
    var intensity = vec3_at(e + 4u);
    if (has_emitter(EMITTER_SPOT) && kind == EMITTER_SPOT) {
        let local = normalize(mat3x3<f32>(vec3_at(e + 7u), vec3_at(e + 10u), vec3_at(e + 13u)) * -wi);
        let angle = exact_acos(local.z);
        let beam = float_at(e + 16u);
        let cutoff = float_at(e + 17u);
        if (angle >= cutoff) {
            return no_light();
        }
        if (angle > beam) {
            intensity *= (cutoff - angle) / (cutoff - beam);
        }
        if (word_at(e + 18u) != NONE) {
            light_value = e + 18u;
            light_at = nowhere(0.5 + 0.5 * local.xy / (local.z * tan(cutoff)));
        }
    } else if (has_emitter(EMITTER_PROJECTOR) && kind == EMITTER_PROJECTOR) {
        let p = vec4<f32>(position, 1.0);
        var local: vec3<f32>;
        for (var i = 0u; i < 3u; i += 1u) {
            local[i] = dot(vec4<f32>(vec3_at(e + 1u + 4u * i), float_at(e + 4u + 4u * i)), p);
        }
        let half = vec2<f32>(float_at(e + 24u), float_at(e + 25u));
        let uv = 0.5 - 0.5 * local.xy / (local.z * half);
        if (local.z <= 0.0 || any(uv < vec2<f32>(0.0)) || any(uv > vec2<f32>(1.0))) {
            return no_light();
        }
        // Falls with 1/cos^3 so that a wall is lit evenly.
        let c = -dot(vec3_at(e + 16u), wi);
        intensity = vec3<f32>(PI * float_at(e + 23u) / (c * c * c));
        light_value = e + 19u;
        light_at = nowhere(uv);
    }
    return LightSample(wi, distance, intensity / d2, 1.0, true);
}

// The direction to the middle of a slab whose words begin at `e`; sets `light_gaussian`.
fn slab_sample(e: u32, position: vec3<f32>) -> LightSample {
    let to = slab_mean(e) - position;
    let d2 = dot(to, to);
    let distance = sqrt(d2);
    let wi = to / distance;
    let intensity = slab_intensity(e) * directivity(word_at(e + 17u), -wi);
    let own = vec3_at(e + 21u);
    let across = vec3_at(e + 24u);
    let covariance = mat3x3<f32>(own.x, across.x, across.y, across.x, own.y, across.z, across.y, across.z, own.z);
    light_gaussian = GaussianLight(intensity, to, covariance);
    return LightSample(wi, distance, intensity / (d2 + float_at(e + 16u)), 1.0, true);
}

// Where the middle of a slab is whose words begin at `e`.
fn slab_mean(e: u32) -> vec3<f32> {
    return vec3_at(e + 18u);
}

// A rough estimate of the irradiance by a slab at `position`, to choose among slabs by; `facing`: the normal of the side that is
// lit, zero for both. Above zero everywhere (.05 of the intensity, .02 of the cosine), so that nothing that shines is left out.
fn slab_estimate(e: u32, position: vec3<f32>, facing: vec3<f32>) -> f32 {
    let to = slab_mean(e) - position;
    let d2 = dot(to, to) + float_at(e + 16u);
    let wi = to * inverseSqrt(d2);
    // Its radius over its distance (float 16 is a quarter of its variance): so much of it may be above the horizon while its
    // middle is below.
    let sine = min(sqrt(8.0 * float_at(e + 16u) / d2), 1.0);
    let turned = max((dot(facing, wi) + sine) / (1.0 + sine), 0.0);
    let intensity = slab_intensity(e);
    let shines = (intensity.x + intensity.y + intensity.z) * (directivity(word_at(e + 17u), -wi) + 0.05);
    return shines * select(turned + 0.02, 1.0, all(facing == vec3<f32>(0.0))) / d2;
}

// One emitter for a surface at `position`: by their power whether one of the slabs, and a slab by its estimate there.
fn emitter_choose_near(position: vec3<f32>, facing: vec3<f32>, u: f32) -> Choice {
    let plain = plain_count();
    var share = 0.0;
    if (plain > 0u) {
        share = emitters_share(plain);
        if (u < share || plain == emitter_count()) {
            var choice = emitter_choose(plain, u / share);
            choice.probability *= share;
            return choice;
        }
    }
    var v = (u - share) / (1.0 - share);
    var chosen = Choice(plain, 0.0, 0.0);
    var sum = 0.0;
    for (var i = plain; i < emitter_count(); i += 1u) {
        let size = slab_estimate(emitter_at(i), position, facing);
        sum += size;
        let own = size / max(sum, 1e-30);
        // The number is stretched back to [0, 1) after each decision.
        if (v < own) {
            v /= own;
            chosen = Choice(i, 0.0, size);
        } else {
            v = (v - own) / (1.0 - own);
        }
    }
    chosen.probability *= (1.0 - share) / max(sum, 1e-30);
    return chosen;
}

// How much it shines in the mean over directions.
fn slab_intensity(e: u32) -> vec3<f32> {
    return vec3_at(e + 4u);
}

fn is_slab(emitter: u32) -> bool {
    return has_emitter(EMITTER_SLAB) && emitter >= plain_count();
}

// The direction from `position` to a point of a slab, and in w how far the way must be free, but for what burns: past that
// the light is known.
fn to_slab_point(slab: u32, position: vec3<f32>, u: vec2<f32>) -> vec4<f32> {
    let e = emitter_at(slab);
    // A direction of its net, near the one asked for and by how much it shines there.
    let near = net_place(position - slab_mean(e));
    let parts = directivity_parts(word_at(e + 17u), near);
    var v = u.y * dot(parts, vec4<f32>(1.0));
    var k = 0u;
    while (k < 3u && v >= parts[k]) {
        v -= parts[k];
        k += 1u;
    }
    v = clamp(v / max(parts[k], 1e-30), 0.0, 0.9999999);
    let node = near.node + (k & 1u) + NET * (k >> 1u);
    // One of its points, and a place in the box about that: coarse and fine bits of the same numbers.
    let count = word_at(e + 2u);
    let which = u.x * f32(count);
    let at = word_at(e + 1u) + 3u * (node * count + min(u32(which), count - 1u));
    let place = vec3<f32>(fract(which), v, fract(4096.0 * v)) - 0.5;
    let block = mat3x3<f32>(vec3_at(e + 7u), vec3_at(e + 10u), vec3_at(e + 13u));
    let to = vec3<f32>(numbers[at], numbers[at + 1u], numbers[at + 2u]) + block * place - position;
    let distance = length(to);
    let wi = to / distance;
    return vec4<f32>(wi, distance * (1.0 - 1e-3));
}

// One minus the cosine of the cone that a round sphere subtends; 0 where the emitter is none, or `position` within it.
fn sphere_cone(e: u32, position: vec3<f32>) -> f32 {
    if (!has_emitter(EMITTER_ROUND)) {
        return 0.0;
    }
    let r = float_at(e + 13u);
    let to = vec3_at(e + 10u) - position;
    let sin2 = r * r / dot(to, to);
    // Near the surface rounding has the last word, and evenly by area is as good.
    return select(0.0, sin2 / (1.0 + sqrt(max(1.0 - sin2, 0.0))), sin2 > 0.0 && sin2 < 0.999);
}

// A rectangle as it is seen from a place: coordinates along its sides and its normal, the angles that its projection on
// the unit sphere is sampled by, and its solid angle (0: there is none, or it is too small for them).
struct SeenRectangle {
    low: vec2<f32>,
    high: vec2<f32>,
    // Below zero.
    z: f32,
    x_axis: vec3<f32>,
    y_axis: vec3<f32>,
    z_axis: vec3<f32>,
    b0: f32,
    b1: f32,
    k: f32,
    solid_angle: f32,
}

// Urena, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles".
fn seen_rectangle(e: u32, position: vec3<f32>) -> SeenRectangle {
    var r: SeenRectangle;
    if (!has_emitter(EMITTER_RECTANGLE) || word_at(e + 23u) == 0u) {
        return r;
    }
    let to = vec3_at(e + 14u) - position;
    let sides = vec2<f32>(length(vec3_at(e + 17u)), length(vec3_at(e + 20u)));
    r.x_axis = vec3_at(e + 17u) / sides.x;
    r.y_axis = vec3_at(e + 20u) / sides.y;
    r.z_axis = cross(r.x_axis, r.y_axis);
    r.z = dot(to, r.z_axis);
    if (r.z > 0.0) {
        r.z_axis = -r.z_axis;
        r.z = -r.z;
    }
    r.low = vec2<f32>(dot(to, r.x_axis), dot(to, r.y_axis));
    r.high = r.low + sides;
    // Of small or slanted ones the angles cancel, and evenly by area is as good.
    let middle = vec3<f32>(0.5 * (r.low + r.high), r.z);
    let d2 = dot(middle, middle);
    if (sides.x * sides.y * -r.z < 0.02 * d2 * sqrt(d2) || -r.z < 1e-4 * max(sides.x, sides.y)) {
        return r;
    }
    let n0 = normalize(vec3<f32>(0.0, r.z, -r.low.y));
    let n1 = normalize(vec3<f32>(-r.z, 0.0, r.high.x));
    let n2 = normalize(vec3<f32>(0.0, -r.z, r.high.y));
    let n3 = normalize(vec3<f32>(r.z, 0.0, -r.low.x));
    let g0 = exact_acos(-dot(n0, n1));
    let g1 = exact_acos(-dot(n1, n2));
    let g2 = exact_acos(-dot(n2, n3));
    let g3 = exact_acos(-dot(n3, n0));
    r.b0 = n0.z;
    r.b1 = n2.z;
    r.k = TAU - g2 - g3;
    r.solid_angle = g0 + g1 - r.k;
    return r;
}

// Towards the point of the rectangle that `u` stands for; not of unit length.
fn rectangle_sample(r: SeenRectangle, u: vec2<f32>) -> vec3<f32> {
    let a = u.x * r.solid_angle + r.k;
    let f = (cos(a) * r.b0 - r.b1) / sin(a);
    let c = clamp(select(-1.0, 1.0, f > 0.0) * inverseSqrt(f * f + r.b0 * r.b0), -1.0, 1.0);
    let x = clamp(-c * r.z * inverseSqrt(max(1.0 - c * c, 1e-12)), r.low.x, r.high.x);
    let d2 = x * x + r.z * r.z;
    let h0 = r.low.y * inverseSqrt(d2 + r.low.y * r.low.y);
    let h1 = r.high.y * inverseSqrt(d2 + r.high.y * r.high.y);
    let h = h0 + u.y * (h1 - h0);
    let y = clamp(h * sqrt(d2) * inverseSqrt(max(1.0 - h * h, 1e-12)), r.low.y, r.high.y);
    return r.x_axis * x + r.y_axis * y + r.z_axis * r.z;
}

// Spheres by the cone that they subtend, rectangles by solid angle, all else evenly by area.
fn area_sample(e: u32, position: vec3<f32>, u: vec2<f32>) -> LightSample {
    let draw = word_at(e + 1u);
    let count = word_at(e + 8u);
    if (draw == NONE || count == 0u) {
        return no_light();
    }
    let cone = sphere_cone(e, position);
    if (cone > 0.0) {
        if ((draws[draw].flags & FLIPPED) != 0u && word_at(e + 2u) == 0u) {
            return no_light();
        }
        let to = vec3_at(e + 10u) - position;
        let d = length(to);
        let below = u.x * cone;
        let sin2 = below * (2.0 - below);
        let phi = TAU * u.y;
        let sine = sqrt(max(sin2, 0.0));
        let wi = to_world(frame_from_normal(to / d), vec3<f32>(sine * cos(phi), sine * sin(phi), 1.0 - below));
        let r = float_at(e + 13u);
        let distance = d * (1.0 - below) - sqrt(max(r * r - d * d * sin2, 0.0));
        light_value = e + 3u;
        light_at = nowhere(vec2<f32>(0.0));
        return LightSample(wi, distance, vec3<f32>(1.0), 1.0 / (TAU * cone), false);
    }
    let rectangle = seen_rectangle(e, position);
    if (rectangle.solid_angle > 0.0) {
        let to = rectangle_sample(rectangle, u);
        let distance = length(to);
        // The side of the corners' order, which is that of the normal.
        let front = dot(cross(vec3_at(e + 17u), vec3_at(e + 20u)), to) < 0.0;
        if (!front && word_at(e + 2u) == 0u) {
            return no_light();
        }
        light_value = e + 3u;
        light_at = nowhere(vec2<f32>(0.0));
        return LightSample(to / distance, distance, vec3<f32>(1.0), 1.0 / rectangle.solid_angle, false);
    }
    let which = choose(word_at(e + 7u), count, u.x);
    let m = draws[draw].to_world;
    let flags = draws[draw].flags;
    let triangle = draws[draw].first_triangle + which.entry;
    let corners = corners_of(triangle);
    let root = sqrt(which.u);
    let w = vec2<f32>(root * (1.0 - u.y), root * u.y);
    let pa = point_to_world(m, vertices[corners.x].position);
    let e1 = point_to_world(m, vertices[corners.y].position) - pa;
    let e2 = point_to_world(m, vertices[corners.z].position) - pa;
    let to = pa + e1 * w.x + e2 * w.y - position;
    let d2 = dot(to, to);
    let distance = sqrt(d2);
    let wi = to / distance;
    let facing = -dot(wi, draw_normal(flags, e1, e2));
    if (!(d2 > 0.0) || facing == 0.0 || (facing < 0.0 && word_at(e + 2u) == 0u)) {
        return no_light();
    }
    var at = nowhere(w);
    if ((flags & HAS_UVS) != 0u) {
        let uva = vec2<f32>(vertices[corners.x].u, vertices[corners.x].v);
        let uvb = vec2<f32>(vertices[corners.y].u, vertices[corners.y].v);
        let uvc = vec2<f32>(vertices[corners.z].u, vertices[corners.z].v);
        at.uv = uva + w.x * (uvb - uva) + w.y * (uvc - uva);
    }
    at.attributes = draws[draw].attributes;
    at.triangle = triangle;
    at.barycentric = w;
    let pdf = d2 / (abs(facing) * float_at(e + 9u));
    light_value = e + 3u;
    light_at = at;
    return LightSample(wi, distance, vec3<f32>(1.0), pdf, false);
}

// Density per solid angle with which area_sample for `position` finds a point of emitter `emitter` at this distance,
// whose geometric normal has this cosine to the way.
fn area_pdf(emitter: u32, position: vec3<f32>, distance: f32, c: f32) -> f32 {
    let cone = sphere_cone(emitter_at(emitter), position);
    if (cone > 0.0) {
        return 1.0 / (TAU * cone);
    }
    let rectangle = seen_rectangle(emitter_at(emitter), position);
    if (rectangle.solid_angle > 0.0) {
        return 1.0 / rectangle.solid_angle;
    }
    return distance * distance / max(abs(c) * float_at(emitter_at(emitter) + 9u), 1e-30);
}

// Where the value of the radiance is that a surface of emitter `emitter` with this shading normal sends towards `wo`;
// NONE where it sends nothing there.
fn emitted(emitter: u32, normal: vec3<f32>, wo: vec3<f32>) -> u32 {
    let e = emitter_at(emitter);
    return select(e + 3u, NONE, word_at(e + 2u) == 0u && dot(normal, wo) <= 0.0);
}

fn environment_count() -> u32 {
    return word_at(word_at(7u));
}

// The emitter of environment `i`, and where its words begin.
fn environment_of(i: u32) -> vec2<u32> {
    let emitter = word_at(word_at(7u) + 1u + i);
    return vec2<u32>(emitter, word_at(emitter_at(emitter) + 1u));
}

// The same radiance from everywhere.
fn background() -> vec3<f32> {
    return vec3_at(8u);
}
