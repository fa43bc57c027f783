// Sums of weighted samples, four floats a pixel: colour and what covers the pixel. In the last row: how many samples were
// no numbers, or fewer, for pixels count at once.

@group(2) @binding(0) var<storage, read_write> film: array<vec4<f32>>;

fn film_add(pixel: vec2<u32>, value: vec4<f32>) {
    let at = pixel.y * view.window.z + pixel.x;
    // The first frame begins anew; what is no number is left out.
    var sum = select(film[at], vec4<f32>(0.0), view.index == 0u);
    if (all(abs(value) < vec4<f32>(3e38))) {
        sum += view.weight * value;
    } else {
        film[view.window.z * view.window.w].x += 1.0;
    }
    film[at] = sum;
}

// Of what has no mean: the first frame's, which looks at the pixel's centre.
fn film_set(pixel: vec2<u32>, value: vec4<f32>) {
    let at = pixel.y * view.window.z + pixel.x;
    film[at] = select(film[at], value, view.index == 0u);
}
