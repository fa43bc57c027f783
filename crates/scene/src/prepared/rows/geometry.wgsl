// Shapes in the rows of a scene. See geometry.rs.

// No index.
const NONE: u32 = 0xffffffffu;

struct Vertex {
    position: vec3<f32>,
    u: f32,
    normal: vec3<f32>,
    v: f32,
    tangent: vec4<f32>,
}

// A mesh in its place: the three rows of the affine matrix to the world, and what it is made of.
struct Draw {
    to_world: array<vec4<f32>, 3>,
    mesh: u32,
    first_triangle: u32,
    triangles: u32,
    flags: u32,
    material: u32,
    shape: u32,
    emitter: u32,
    attributes: u32,
}

// Flags of a draw.
const HAS_NORMALS: u32 = 1u;
const HAS_UVS: u32 = 2u;
const HAS_TANGENTS: u32 = 4u;
const MIRRORED: u32 = 8u;
const FLIPPED: u32 = 16u;
const SEE_THROUGH: u32 = 32u;
const FUEL: u32 = 64u;

fn corners_of(triangle: u32) -> vec3<u32> {
    return vec3<u32>(triangles[3u * triangle], triangles[3u * triangle + 1u], triangles[3u * triangle + 2u]);
}

fn point_to_world(m: array<vec4<f32>, 3>, p: vec3<f32>) -> vec3<f32> {
    let q = vec4<f32>(p, 1.0);
    return vec3<f32>(dot(m[0], q), dot(m[1], q), dot(m[2], q));
}

fn vector_to_world(m: array<vec4<f32>, 3>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(m[0].xyz, v), dot(m[1].xyz, v), dot(m[2].xyz, v));
}
