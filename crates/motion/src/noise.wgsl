// Ken Perlin 2002, "Improving Noise", and its curl; the twin of noise.rs, which says more.

// Four entries of Perlin's permutation in each word, the first lowest.
const PERMUTATION: array<u32, 64> = array<u32, 64>(
    0x5b89a097u, 0x0d830f5au, 0x35605fc9u, 0xe107e9c2u, 0x1e67248cu, 0x63088e45u, 0x0a15f025u, 0x9406be17u,
    0x4bea78f7u, 0x3ec51a00u, 0xcbdbfc5eu, 0x200b2375u, 0x5821b139u, 0x573895edu, 0x887d14aeu, 0xaf44a8abu,
    0x8647a54au, 0xa61b308bu, 0xe79e924du, 0x7ae56f53u, 0xe685d33cu, 0x295c69dcu, 0x28f52e37u, 0x368f66f4u,
    0xa13f1941u, 0x4950d801u, 0xbb844cd1u, 0xa91259d0u, 0x8287c4c8u, 0x569fbc74u, 0xc66d64a4u, 0x4003baadu,
    0xfae2d934u, 0xca057b7cu, 0x7e769326u, 0xd45552ffu, 0xe33bcecfu, 0x113a102fu, 0x2a1cbdb6u, 0xd5aab7dfu,
    0x0298f877u, 0x46a39a2cu, 0x9b6599ddu, 0x09ac2ba7u, 0xfd271681u, 0x6e6c6213u, 0xe8e0714fu, 0x6870b9b2u,
    0xe461f6dau, 0xc1f222fbu, 0x0c90d2eeu, 0xf1a2b3bfu, 0xeb913351u, 0x6bef0ef9u, 0x1fd6c031u, 0x9d6ac7b5u,
    0xb0cc54b8u, 0x2d327973u, 0xfe96047fu, 0x5dcdec8au, 0x1d4372deu, 0x8df34818u, 0x424ec380u, 0xb49c3dd7u,
);

struct Noise {
    value: f32,
    gradient: vec3<f32>,
}

fn permuted(i: i32) -> i32 {
    let k = u32(i) & 255u;
    return i32((PERMUTATION[k >> 2u] >> (8u * (k & 3u))) & 255u);
}

// The gradient at a corner of which this is the hash.
fn noise_gradient(hash: i32) -> vec3<f32> {
    let h = hash & 15;
    let u = select(1.0, -1.0, (h & 1) != 0);
    let v = select(1.0, -1.0, (h & 2) != 0);
    var g = select(vec3<f32>(0.0, u, 0.0), vec3<f32>(u, 0.0, 0.0), h < 8);
    if h < 4 {
        g.y += v;
    } else if h == 12 || h == 14 {
        g.x += v;
    } else {
        g.z += v;
    }
    return g;
}

fn noise(p: vec3<f32>) -> Noise {
    let cell = floor(p);
    let c = vec3<i32>(cell);
    let t = p - cell;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let slope = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    var value = 0.0;
    var gradient = vec3<f32>(0.0);
    for (var i = 0; i < 8; i++) {
        let corner = vec3<i32>(i & 1, (i >> 1u) & 1, i >> 2u);
        let offset = vec3<f32>(corner);
        let at = c + corner;
        let g = noise_gradient(permuted(permuted(permuted(at.x) + at.y) + at.z));
        let d = dot(g, t - offset);
        let side = 2.0 * offset - 1.0;
        let w = 1.0 - offset + side * fade;
        let dw = side * slope;
        value += w.x * w.y * w.z * d;
        gradient += w.x * w.y * w.z * g + d * vec3<f32>(dw.x * w.y * w.z, w.x * dw.y * w.z, w.x * w.y * dw.z);
    }
    return Noise(value, gradient);
}

fn curl_noise(p: vec3<f32>) -> vec3<f32> {
    var apart = array<vec3<f32>, 3>(
        vec3<f32>(0.0),
        vec3<f32>(31.4375, -47.8125, 12.75),
        vec3<f32>(-233.125, 155.6875, 77.375),
    );
    var g: array<vec3<f32>, 3>;
    for (var i = 0; i < 3; i++) {
        g[i] = noise(p + apart[i]).gradient;
    }
    return vec3<f32>(g[2].y - g[1].z, g[0].z - g[2].x, g[1].x - g[0].y);
}
