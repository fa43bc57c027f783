// Between the loads of a layer, in pixels, and the water and ink that flow, in cells.

struct Dry {
    // Pixels across and down, and of a cell.
    size: vec2<u32>,
    side: u32,
    unused: u32,
    cells: vec2<u32>,
    // Part of the ink of a wholly wet place that flows; 0: none does.
    mobile: f32,
    // Water of a wholly wet place.
    water: f32,
    // How much more ink hollows of the paper take than its heights.
    granulation: f32,
    unused_too: vec3<f32>,
}

@group(0) @binding(0) var<uniform> dry: Dry;
@group(0) @binding(1) var loads: texture_2d<f32>;
@group(0) @binding(2) var paper: texture_2d<f32>;
@group(0) @binding(3) var<storage, read_write> cells: array<vec4<f32>>;

// The mobile ink of the pixels of a cell and their water.
@compute @workgroup_size(8, 8)
fn wet(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= dry.cells.x || id.y >= dry.cells.y) {
        return;
    }
    var water = 0.0;
    var ink = 0.0;
    for (var y = 0u; y < dry.side; y++) {
        for (var x = 0u; x < dry.side; x++) {
            let at = id.xy * dry.side + vec2<u32>(x, y);
            // Beyond the sheet nothing is read, and nothing is there.
            if (at.x < dry.size.x && at.y < dry.size.y) {
                let load = textureLoad(loads, at, 0).xy;
                water += load.y;
                ink += load.x * load.y;
            }
        }
    }
    let area = f32(dry.side * dry.side);
    cells[id.y * dry.cells.x + id.x] = vec4<f32>(dry.water * water / area, dry.mobile * ink / area, 0.0, 0.0);
}

@vertex
fn everywhere(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn ink_of(cell: vec2<i32>) -> f32 {
    let c = clamp(cell, vec2<i32>(0), vec2<i32>(dry.cells) - 1);
    let v = cells[u32(c.y) * dry.cells.x + u32(c.x)];
    return v.y + v.w;
}

// What did not flow, and what has flowed.
@fragment
fn dried(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let load = textureLoad(loads, vec2<u32>(position.xy), 0);
    if (dry.mobile <= 0.0) {
        return load;
    }
    let place = position.xy / f32(dry.side) - 0.5;
    let base = vec2<i32>(floor(place));
    let t = place - floor(place);
    let upper = mix(ink_of(base), ink_of(base + vec2<i32>(1, 0)), t.x);
    let lower = mix(ink_of(base + vec2<i32>(0, 1)), ink_of(base + vec2<i32>(1, 1)), t.x);
    let flowed = mix(upper, lower, t.y);
    let height = textureLoad(paper, vec2<u32>(position.xy), 0).x;
    let grain = 1.0 + dry.granulation * (0.5 - height);
    return vec4<f32>(load.x * (1.0 - dry.mobile * load.y) + flowed * grain, load.y, 0.0, 1.0);
}
