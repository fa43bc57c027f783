// The medium of a flame at one instant and the cells that renderers read; the twin of flame.rs, which says more.
// Stands behind noise.wgsl.

// Rows of `Flame::rows`: seven of the head, two for each of three noises, two for each level, then the light of soot.
@group(0) @binding(0) var<storage, read> flame: array<vec4<f32>>;
// Emission red, green, blue (radiance per metre) and absorption (1/m) of cell after cell, x fastest.
@group(0) @binding(1) var<storage, read_write> cells: array<vec4<f32>>;

const NOISES = 7u;
const LEVELS = 13u;
const COOL = 1330.0;
const HOT = 1860.0;
const COOLING = 130.0;

struct Medium {
    temperature: f32,
    soot: f32,
    smoke: f32,
}

// Value and slope of one of the noises that rise, `q` beside the axis, for what left the fuel `age` ago.
fn risen(layer: u32, q: vec2<f32>, age: f32) -> Noise {
    let place = flame[NOISES + 2u * layer];
    let rate = flame[NOISES + 2u * layer + 1u].x;
    return noise(place.xyz + vec3<f32>(q.x * place.w, -age * rate, q.y * place.w));
}

fn fire_medium(world: vec3<f32>) -> Medium {
    let nothing = Medium(0.0, 0.0, 0.0);
    let offset = world - flame[2].xyz;
    let p = vec3<f32>(dot(flame[3].xyz, offset), dot(flame[4].xyz, offset), dot(flame[5].xyz, offset));
    let at = (p.y - flame[2].w) * flame[3].w;
    if !(at >= 0.0 && at < flame[5].w - 1.0) {
        return nothing;
    }
    let level = LEVELS + 2u * u32(at);
    let t = fract(at);
    let a = mix(flame[level], flame[level + 2u], t);
    let b = mix(flame[level + 1u], flame[level + 3u], t);
    let narrow = a.z;
    let cut = b.x;
    let age = b.y;
    let height = b.z;
    var q = p.xz - a.xy;
    let out = dot(q, q) * narrow * narrow;
    var rich = 1.0 - out * out - a.w;
    var smoke = b.w * smoothstep(0.0, 1.0, 1.4 - 0.55 * out);
    let shares = vec3<f32>(flame[NOISES + 1u].y, flame[NOISES + 3u].y, flame[NOISES + 5u].y);
    if smoke <= 0.0 && rich + 0.9 * cut * (shares.x + shares.y + shares.z) <= 0.0 {
        return nothing;
    }
    q *= 0.6 + 0.4 * narrow * flame[4].w;
    // One place for the noise, so that drivers put it in once.
    var aside = vec2<f32>(0.0);
    var left = vec2<f32>(shares.y + shares.z, shares.z);
    var second = 0.0;
    for (var layer = 0u; layer < 3u; layer++) {
        let n = risen(layer, q + select(1.0, 1.6, layer == 2u) * aside, age);
        rich += cut * shares[layer] * n.value;
        if layer == 0u {
            smoke *= max(0.6 + 0.8 * n.value, 0.0);
            aside = vec2<f32>(n.gradient.z, -n.gradient.x) * (flame[1].w * (0.4 + height));
        } else if layer == 1u {
            second = n.value;
        }
        if layer < 2u && rich + 0.9 * cut * left[layer] <= 0.0 {
            return Medium(0.0, 0.0, smoke);
        }
    }
    if rich <= 0.0 {
        return Medium(0.0, 0.0, smoke);
    }
    let fold = 1.0 - 0.9 * exp(-36.0 * second * second) * smoothstep(0.02, 0.25, height);
    let temperature = COOL + (HOT - COOL) * smoothstep(0.0, 1.1, rich) - COOLING * height;
    return Medium(temperature, flame[0].w * smoothstep(0.0, 0.3, rich) * fold, smoke);
}

// Emission over absorption of soot.
fn soot_light(kelvin: f32) -> vec3<f32> {
    let table = LEVELS + 2u * u32(flame[5].w);
    let head = flame[table];
    if kelvin < head.x {
        return vec3<f32>(0.0);
    }
    let entries = arrayLength(&flame) - table - 1u;
    let k = min(kelvin, head.y);
    let at = (k - head.x) * head.z;
    let i = min(u32(at), entries - 2u);
    let light = mix(flame[table + 1u + i].xyz, flame[table + 2u + i].xyz, at - f32(i));
    return light * exp(-head.w / k);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = vec3<u32>(flame[6].xyz);
    if id.x >= size.x * size.y * size.z {
        return;
    }
    let cell = vec3<u32>(id.x % size.x, id.x / size.x % size.y, id.x / (size.x * size.y));
    var value = vec4<f32>(0.0);
    if all(cell > vec3<u32>(0u)) && all(cell + 1u < size) {
        let edge = (flame[1].xyz - flame[0].xyz) / vec3<f32>(size);
        let medium = fire_medium(flame[0].xyz + (vec3<f32>(cell) + 0.5) * edge);
        value = vec4<f32>(medium.soot * soot_light(medium.temperature), medium.soot + medium.smoke);
    }
    cells[id.x] = value;
}
