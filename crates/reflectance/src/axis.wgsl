// Twin of axis.rs: directions as coordinates of a table.

fn polar_angle(w: vec3<f32>) -> f32 {
    return atan2(length(w.xy), w.z);
}

fn azimuth(w: vec3<f32>) -> f32 {
    if (w.x == 0.0 && w.y == 0.0) {
        return 0.0;
    }
    return atan2(w.y, w.x);
}

// The entries around a value, and how far between.
struct AxisCell {
    low: u32,
    high: u32,
    t: f32,
}

// The axis is the n numbers from `at` on.
fn axis_clamped(at: u32, n: u32, x: f32) -> AxisCell {
    if (n < 2u) {
        return AxisCell(0u, 0u, 0.0);
    }
    var low = 0u;
    var high = n - 1u;
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if (table_at(at + middle) <= x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let first = table_at(at + low);
    return AxisCell(low, high, clamp((x - first) / (table_at(at + high) - first), 0.0, 1.0));
}

fn axis_periodic(at: u32, n: u32, x: f32) -> AxisCell {
    if (n < 2u) {
        return AxisCell(0u, 0u, 0.0);
    }
    let first = table_at(at);
    let last = table_at(at + n - 1u);
    let y = first + (x - first) - TAU * floor((x - first) / TAU);
    if (y >= last) {
        return AxisCell(n - 1u, 0u, clamp((y - last) / (first + TAU - last), 0.0, 1.0));
    }
    return axis_clamped(at, n, y);
}
