// A twin of directivity.rs.

// Nodes along a side of the net of directions.
const NET: u32 = 9u;

// Intensity by direction over its mean, of the values that begin at `at` in `numbers`.
fn directivity(at: u32, direction: vec3<f32>) -> f32 {
    let s = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    var p = s.xz;
    if (s.y < 0.0) {
        p = (1.0 - abs(s.zx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), s.xz >= vec2<f32>(0.0));
    }
    let q = clamp((0.5 + 0.5 * p) * f32(NET - 1u), vec2<f32>(0.0), vec2<f32>(f32(NET - 1u)));
    let first = min(vec2<u32>(q), vec2<u32>(NET - 2u));
    let t = q - vec2<f32>(first);
    let o = at + first.y * NET + first.x;
    let low = mix(numbers[o], numbers[o + 1u], t.x);
    return mix(low, mix(numbers[o + NET], numbers[o + NET + 1u], t.x), t.y);
}
