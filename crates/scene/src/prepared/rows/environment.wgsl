// Light from infinity by a latitude-longitude picture. Twin of prepared/environment.rs; words as in
// rows/environment.rs. `e` is where they begin.

const BLOCKS_ACROSS: u32 = 32u;
const BLOCKS_DOWN: u32 = 16u;
const SQUARES: u32 = 12u;
const WHOLE: u32 = 65535u;
// Words of a view: its irradiance, then its edges.
const VIEW_WORDS: u32 = 1u + (BLOCKS_DOWN * (1u + BLOCKS_ACROSS)) / 2u;

fn environment_matrix(at: u32, v: vec3<f32>) -> vec3<f32> {
    return vec3_at(at) * v.x + vec3_at(at + 3u) * v.y + vec3_at(at + 6u) * v.z;
}

// Edge number `i` of the list that begins at half word `base`.
fn edge_at(base: u32, i: u32) -> u32 {
    let half = base + i;
    return (word_at(half / 2u) >> (16u * (half % 2u))) & 0xffffu;
}

fn edge_width(base: u32, count: u32, i: u32) -> f32 {
    var end = WHOLE;
    if (i + 1u < count) {
        end = edge_at(base, i + 1u);
    }
    return f32(end - edge_at(base, i)) / f32(WHOLE);
}

// The entry that `u` falls into, and u stretched back to [0, 1).
fn edge_choose(base: u32, count: u32, u: f32) -> Choice {
    let x = u * f32(WHOLE);
    let whole = u32(x);
    var low = 0u;
    var high = count;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (edge_at(base, middle) <= whole) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    let i = max(low, 1u) - 1u;
    let p = edge_width(base, count, i);
    return Choice(i, clamp((x - f32(edge_at(base, i))) / (p * f32(WHOLE)), 0.0, 0.99999994), p);
}

// Half word where the edges of the view begin that a surface facing `facing` has; zero: to all sides.
fn environment_view(e: u32, facing: vec3<f32>) -> u32 {
    var i = (SQUARES + 1u) * (SQUARES + 1u);
    if (any(facing != vec3<f32>(0.0))) {
        let n = environment_matrix(e, facing);
        var p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
        if (n.z < 0.0) {
            let sign = select(vec2<f32>(-1.0), vec2<f32>(1.0), p >= vec2<f32>(0.0));
            p = (1.0 - abs(p.yx)) * sign;
        }
        let c = min(vec2<u32>((0.5 * p + 0.5) * f32(SQUARES) + 0.5), vec2<u32>(SQUARES));
        i = c.y * (SQUARES + 1u) + c.x;
    }
    return 2u * (word_at(e + 26u) + i * VIEW_WORDS + 1u);
}

struct EnvironmentCell {
    // Where it is.
    cell: vec2<u32>,
    // Place in cells of the picture.
    place: vec2<f32>,
}

fn environment_texel(e: u32, cell: vec2<u32>) -> vec4<f32> {
    return texels[word_at(e + 24u) + cell.y * (word_at(e + 18u) + 1u) + cell.x];
}

fn environment_radiance_at(e: u32, place: vec2<f32>) -> vec3<f32> {
    let size = vec2<u32>(word_at(e + 18u), word_at(e + 19u));
    let cell = min(vec2<u32>(place), size - 1u);
    let t = place - vec2<f32>(cell);
    let above = mix(environment_texel(e, cell), environment_texel(e, cell + vec2<u32>(1u, 0u)), t.x);
    let below = mix(environment_texel(e, cell + vec2<u32>(0u, 1u)), environment_texel(e, cell + vec2<u32>(1u, 1u)), t.x);
    return mix(above, below, t.y).xyz;
}

// Probability to density per solid angle, of one cell.
fn environment_per_solid_angle(e: u32, sin_theta: f32) -> f32 {
    return f32(word_at(e + 18u) * word_at(e + 19u)) / (2.0 * PI * PI * sin_theta);
}

// Where a direction of the environment's frame lies, in cells.
fn environment_place(e: u32, local: vec3<f32>) -> vec2<f32> {
    let size = vec2<f32>(f32(word_at(e + 18u)), f32(word_at(e + 19u)));
    let x = atan2(local.x, -local.z) / TAU - 0.5 / size.x;
    return vec2<f32>(fract(x), exact_acos(local.y) * FRAC_1_PI) * size;
}

// Radiance along the world direction.
fn environment_radiance(e: u32, direction: vec3<f32>) -> vec3<f32> {
    return environment_radiance_at(e, environment_place(e, normalize(environment_matrix(e, direction))));
}

// Radiance along the world direction, and the density of `environment_sample` there for a surface that faces `facing`.
fn environment_radiance_pdf(e: u32, direction: vec3<f32>, facing: vec3<f32>) -> vec4<f32> {
    let local = normalize(environment_matrix(e, direction));
    let place = environment_place(e, local);
    let cell = min(vec2<u32>(place), vec2<u32>(word_at(e + 18u), word_at(e + 19u)) - 1u);
    let sin_theta = sqrt(max(1.0 - local.y * local.y, 0.0));
    var pdf = 0.0;
    if (sin_theta > 0.0) {
        let view = environment_view(e, facing);
        let block = cell / vec2<u32>(word_at(e + 20u), word_at(e + 21u));
        let p = edge_width(view, BLOCKS_DOWN, block.y)
            * edge_width(view + BLOCKS_DOWN + block.y * BLOCKS_ACROSS, BLOCKS_ACROSS, block.x);
        pdf = p * environment_texel(e, cell).w * environment_per_solid_angle(e, sin_theta);
    }
    return vec4<f32>(environment_radiance_at(e, place), pdf);
}

struct EnvironmentSample {
    wi: vec3<f32>,
    pdf: f32,
    place: vec2<f32>,
}

fn environment_sample(e: u32, facing: vec3<f32>, u: vec2<f32>) -> EnvironmentSample {
    let size = vec2<u32>(word_at(e + 18u), word_at(e + 19u));
    let block_size = vec2<u32>(word_at(e + 20u), word_at(e + 21u));
    let blocks_across = word_at(e + 22u);
    let view = environment_view(e, facing);
    let row = edge_choose(view, BLOCKS_DOWN, u.y);
    let column = edge_choose(view + BLOCKS_DOWN + row.entry * BLOCKS_ACROSS, BLOCKS_ACROSS, u.x);
    let block = row.entry * blocks_across + column.entry;
    let edges = 2u * word_at(e + 25u) + block * block_size.y * (1u + block_size.x);
    let cell_row = edge_choose(edges, block_size.y, row.u);
    let cell_column = edge_choose(edges + block_size.y + cell_row.entry * block_size.x, block_size.x, column.u);
    let place = vec2<f32>(
        f32(column.entry * block_size.x + cell_column.entry) + cell_column.u,
        f32(row.entry * block_size.y + cell_row.entry) + cell_row.u,
    );
    let p = row.probability * column.probability * cell_row.probability * cell_column.probability;
    let theta = place.y * (PI / f32(size.y));
    let phi = (place.x + 0.5) * (TAU / f32(size.x));
    let sin_theta = sin(theta);
    if (sin_theta <= 0.0 || p <= 0.0) {
        return EnvironmentSample(vec3<f32>(0.0), 0.0, place);
    }
    let local = vec3<f32>(sin(phi) * sin_theta, cos(theta), -cos(phi) * sin_theta);
    let wi = normalize(environment_matrix(e + 9u, local));
    return EnvironmentSample(wi, p * environment_per_solid_angle(e, sin_theta), place);
}
