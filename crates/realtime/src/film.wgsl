// Sums of weighted samples, four floats a pixel: colour and what covers the pixel. After the last pixel: how many samples
// were no numbers, or fewer, for pixels count at once. Where FILM_HALVES two more planes of pixels follow: the sums of
// squared deviations of colours from the mean before them, and those sums of the first half of the frames.

@group(2) @binding(0) var<storage, read_write> film: array<vec4<f32>>;

// Adds a weighted sample to a sum; the first frame begins anew.
fn film_sum(at: u32, value: vec4<f32>, counts: bool) {
    let before = select(film[at], vec4<f32>(0.0), view.index == 0u);
    film[at] = before + select(vec4<f32>(0.0), view.weight * value, counts);
}

fn film_add(pixel: vec2<u32>, value: vec4<f32>) {
    let pixels = view.window.z * view.window.w;
    let at = pixel.y * view.window.z + pixel.x;
    // What is no number is left out.
    let counts = all(abs(value) < vec4<f32>(3e38));
    if (!counts) {
        film[pixels].x += 1.0;
    }
    if (FILM_HALVES) {
        // Welford 1962, "Note on a Method for Calculating Corrected Sums of Squares and Products".
        let away = value - film[at] * view.per_weight;
        let squares = pixels + 1u + at;
        let squared = select(vec4<f32>(0.0), view.deviation_weight * away * away, counts);
        film[squares] = select(film[squares], vec4<f32>(0.0), view.index == 0u) + squared;
        film_sum(squares + pixels, value, counts && view.half_of_frames == 0u);
    }
    film_sum(at, value, counts);
}

// Of what has no mean: the first frame's, which looks at the pixel's centre.
fn film_set(pixel: vec2<u32>, value: vec4<f32>) {
    let at = pixel.y * view.window.z + pixel.x;
    film[at] = select(film[at], value, view.index == 0u);
}
