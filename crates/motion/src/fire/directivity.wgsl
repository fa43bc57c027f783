// A twin of directivity.rs.

// Nodes along a side of the net of directions.
const NET: u32 = 9u;

// The node before a direction along both sides, and how far it is from there to the next.
struct NetPlace {
    node: u32,
    t: vec2<f32>,
}

fn net_place(direction: vec3<f32>) -> NetPlace {
    let s = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    var p = s.xz;
    if (s.y < 0.0) {
        p = (1.0 - abs(s.zx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), s.xz >= vec2<f32>(0.0));
    }
    let q = clamp((0.5 + 0.5 * p) * f32(NET - 1u), vec2<f32>(0.0), vec2<f32>(f32(NET - 1u)));
    let first = min(vec2<u32>(q), vec2<u32>(NET - 2u));
    return NetPlace(first.y * NET + first.x, q - vec2<f32>(first));
}

// What each of the four nodes about a direction adds to `directivity`: that, the next along the first side, and both along
// the second.
fn directivity_parts(at: u32, place: NetPlace) -> vec4<f32> {
    let o = at + place.node;
    let values = vec4<f32>(numbers[o], numbers[o + 1u], numbers[o + NET], numbers[o + NET + 1u]);
    let x = vec2<f32>(1.0 - place.t.x, place.t.x);
    return values * vec4<f32>(x * (1.0 - place.t.y), x * place.t.y);
}

// Intensity by direction over its mean, of the values that begin at `at` in `numbers`.
fn directivity(at: u32, direction: vec3<f32>) -> f32 {
    return dot(directivity_parts(at, net_place(direction)), vec4<f32>(1.0));
}
