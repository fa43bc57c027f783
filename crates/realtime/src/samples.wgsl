// Numbers of a pixel, evenly spread over its frames.

// A nested uniform scramble of bit-reversed `x`. Laine and Karras 2011; constants of Vegdahl 2021.
fn laine_karras(v: u32, seed: u32) -> u32 {
    var x = v;
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// The first two dimensions of Sobol', scrambled and shuffled for the set `draw_set`: over the frames of a pixel each set is
// stratified in two dimensions. Burley 2020, "Practical Hash-based Owen Scrambling".
fn sample2(pixel: u32, draw_set: u32, index: u32) -> vec2<f32> {
    let seed = pcg(pixel ^ pcg(draw_set));
    let i = reverseBits(laine_karras(reverseBits(index), seed));
    var y = 0u;
    var v = 0x80000000u;
    for (var bits = i; bits != 0u; bits >>= 1u) {
        y ^= select(0u, v, (bits & 1u) != 0u);
        v ^= v >> 1u;
    }
    let a = laine_karras(i, pcg(seed + 1u));
    let b = laine_karras(reverseBits(y), pcg(seed + 2u));
    // The 24 bits that a float keeps.
    return vec2<f32>(vec2<u32>(reverseBits(a), reverseBits(b)) >> vec2<u32>(8u)) * 5.9604645e-8;
}
