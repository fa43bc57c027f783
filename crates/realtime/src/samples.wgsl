// Numbers of a pixel, evenly spread over its frames.

// What tells the numbers of a pixel of the window from those of others.
fn pixel_number(pixel: vec2<u32>) -> u32 {
    return pcg(pixel.x ^ pcg(pixel.y ^ pcg(view.seed)));
}

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
    // The second dimension's matrix is Pascal's triangle modulo 2: a bit is the sum of all whose places' bits are among those
    // of its own place.
    var y = i;
    y ^= (y >> 1u) & 0x55555555u;
    y ^= (y >> 2u) & 0x33333333u;
    y ^= (y >> 4u) & 0x0f0f0f0fu;
    y ^= (y >> 8u) & 0x00ff00ffu;
    y ^= y >> 16u;
    let a = laine_karras(i, pcg(seed + 1u));
    let b = laine_karras(y, pcg(seed + 2u));
    // The 24 bits that a float keeps.
    return vec2<f32>(vec2<u32>(reverseBits(a), reverseBits(b)) >> vec2<u32>(8u)) * 5.9604645e-8;
}
