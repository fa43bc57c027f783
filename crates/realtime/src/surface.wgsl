// The local geometry where a ray meets a triangle: twin of the reference renderer's, with the same rules.
//
// The geometric normal lies on the side that the winding says in the world; where there are shading normals, it stays
// with them under a mirroring matrix. FLIPPED turns both.

struct Surface {
    // In the world.
    position: vec3<f32>,
    // `position` and the next ray's arithmetic are off by less than this, along the geometric normal.
    error: f32,
    // Unit.
    geometric_normal: vec3<f32>,
    // 1, or -1 where the mesh's tangents say that the bitangent is -frame_t.
    handedness: f32,
    // Tangent along dp_du or the mesh's, bitangent, interpolated normal: orthonormal, right-handed.
    frame_s: vec3<f32>,
    frame_t: vec3<f32>,
    frame_n: vec3<f32>,
    dp_du: vec3<f32>,
    dp_dv: vec3<f32>,
    uv: vec2<f32>,
    // Weights of the second and third corner.
    barycentric: vec2<f32>,
    triangle: u32,
    draw: u32,
    material: u32,
    emitter: u32,
}

// Room for rounding in units of the largest coordinate involved, as in the reference: 24 times the unit roundoff.
const POSITION_ERROR: f32 = 1.430511474609375e-6;

// `position` moved off its surface by `error`, to the side that `direction` leaves on.
fn offset_origin(position: vec3<f32>, error: f32, normal: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    return position + normal * select(error, -error, dot(direction, normal) < 0.0);
}

// `a` of unit length, or zero.
fn normalize_or_zero(a: vec3<f32>) -> vec3<f32> {
    let length2 = dot(a, a);
    return select(vec3<f32>(0.0), a * inverseSqrt(length2), length2 > 1e-37);
}

// The unit normal of a triangle with edges from its first corner; of slivers, whose product cancels, from the corner
// between the two shorter edges.
fn triangle_normal(e1: vec3<f32>, e2: vec3<f32>) -> vec3<f32> {
    let e3 = e2 - e1;
    let l = vec3<f32>(dot(e1, e1), dot(e2, e2), dot(e3, e3));
    // Brought near one first: the square of a small triangle's area is no number.
    let scale = inverseSqrt(max(l.x, max(l.y, l.z)));
    var a = e1 * scale;
    var b = e2 * scale;
    if (l.x >= l.y && l.x >= l.z) {
        a = b;
        b = e3 * scale;
    } else if (l.y >= l.z) {
        b = e3 * scale;
    }
    let n = cross(a, b);
    return select(normalize_or_zero(n * 1e16), normalize(n), dot(n, n) > 1e-30);
}

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
fn any_tangent(n: vec3<f32>) -> vec3<f32> {
    let s = select(1.0, -1.0, n.z < 0.0);
    let a = -1.0 / (s + n.z);
    return vec3<f32>(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
}

// The part of `tangent` perpendicular to the unit vector `n`, of unit length.
fn tangent_beside(n: vec3<f32>, tangent: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(tangent.x), max(abs(tangent.y), abs(tangent.z)));
    if (!(largest > 0.0 && largest < 3e38)) {
        return any_tangent(n);
    }
    let t = tangent / largest;
    let s = t - n * dot(n, t);
    let l = length(s);
    if (l > 1e-6 * length(t)) {
        return s / l;
    }
    return any_tangent(n);
}

// `m` for normals: its cofactors, with the sign of the determinant.
fn normal_to_world(m: array<vec4<f32>, 3>, n: vec3<f32>, mirrored: bool) -> vec3<f32> {
    let v = vec3<f32>(
        dot(cross(m[1].xyz, m[2].xyz), n),
        dot(cross(m[2].xyz, m[0].xyz), n),
        dot(cross(m[0].xyz, m[1].xyz), n),
    );
    return normalize_or_zero(select(v, -v, mirrored));
}

// How far off, in the world, rays are that come to and leave a place through the coordinates of a mesh.
fn placing_error(m: array<vec4<f32>, 3>, draw: u32, position: vec3<f32>, local: vec3<f32>) -> f32 {
    let row = instance_row(draw);
    let x = bitcast<vec4<f32>>(hierarchy[row]);
    let y = bitcast<vec4<f32>>(hierarchy[row + 1u]);
    let z = bitcast<vec4<f32>>(hierarchy[row + 2u]);
    let o = abs(position - vec3<f32>(x.w, y.w, z.w));
    let inside = max(vec3<f32>(dot(abs(x.xyz), o), dot(abs(y.xyz), o), dot(abs(z.xyz), o)), local);
    let outside = vec3<f32>(dot(abs(m[0].xyz), inside), dot(abs(m[1].xyz), inside), dot(abs(m[2].xyz), inside));
    return max(outside.x, max(outside.y, outside.z)) * POSITION_ERROR;
}

fn surface_at(draw: u32, triangle: u32, barycentric: vec2<f32>) -> Surface {
    let d = draws[draw];
    let m = d.to_world;
    let mirrored = (d.flags & MIRRORED) != 0u;
    let indices = corners_of(triangle);
    let a = vertices[indices.x];
    let b = vertices[indices.y];
    let c = vertices[indices.z];
    let b1 = barycentric.x;
    let b2 = barycentric.y;
    let b0 = 1.0 - b1 - b2;

    let p0 = point_to_world(m, a.position);
    let p1 = point_to_world(m, b.position);
    let p2 = point_to_world(m, c.position);
    let position = p0 * b0 + p1 * b1 + p2 * b2;
    let largest = max(abs(p0), max(abs(p1), abs(p2)));
    let local = max(abs(a.position), max(abs(b.position), abs(c.position)));
    let error = max(largest.x, max(largest.y, largest.z)) * POSITION_ERROR + placing_error(m, draw, position, local);
    let dp1 = p1 - p0;
    let dp2 = p2 - p0;
    var normal = triangle_normal(dp1, dp2);

    var uv = barycentric;
    var dp_du = dp1;
    var dp_dv = dp2;
    if ((d.flags & HAS_UVS) != 0u) {
        let t0 = vec2<f32>(a.u, a.v);
        let t1 = vec2<f32>(b.u, b.v);
        let t2 = vec2<f32>(c.u, c.v);
        uv = t0 * b0 + t1 * b1 + t2 * b2;
        let d1 = t1 - t0;
        let d2 = t2 - t0;
        let det = d1.x * d2.y - d1.y * d2.x;
        if (det != 0.0) {
            let du = (dp1 * d2.y - dp2 * d1.y) / det;
            let dv = (dp2 * d1.x - dp1 * d2.x) / det;
            let size = max(abs(du), abs(dv));
            if (max(size.x, max(size.y, size.z)) < 3e38) {
                dp_du = du;
                dp_dv = dv;
            }
        }
    }

    var shading = normal;
    if ((d.flags & HAS_NORMALS) != 0u) {
        normal = select(normal, -normal, mirrored);
        let n = normal_to_world(m, a.normal, mirrored) * b0 + normal_to_world(m, b.normal, mirrored) * b1
            + normal_to_world(m, c.normal, mirrored) * b2;
        shading = normalize_or_zero(n);
        if (dot(shading, shading) == 0.0) {
            shading = normal;
        }
    }
    var tangent = dp_du;
    var handedness = 1.0;
    if ((d.flags & HAS_TANGENTS) != 0u) {
        let t = vector_to_world(m, a.tangent.xyz * b0 + b.tangent.xyz * b1 + c.tangent.xyz * b2);
        let size = max(abs(t.x), max(abs(t.y), abs(t.z)));
        if (size > 0.0 && size < 3e38) {
            tangent = t;
            handedness = a.tangent.w;
        }
    }
    let frame_s = tangent_beside(shading, tangent);
    if ((d.flags & FLIPPED) != 0u) {
        normal = -normal;
        shading = -shading;
    }
    return Surface(
        position, error, normal, handedness, frame_s, cross(shading, frame_s), shading, dp_du, dp_dv, uv, barycentric,
        triangle, draw, d.material, d.emitter,
    );
}

fn footprint_on(s: Surface, dir: vec3<f32>, width: f32) -> f32 {
    // Width on the surface, stretched where it is seen at a slant, in units of uv.
    let slant = max(abs(dot(s.geometric_normal, dir)), 0.1);
    return width / (slant * max(min(length(s.dp_du), length(s.dp_dv)), 1e-12));
}
