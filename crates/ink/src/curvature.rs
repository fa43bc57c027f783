//! Curvature at the nodes of a mesh: Rusinkiewicz 2004, "Estimating Curvatures and Their Derivatives on Triangle Meshes".
//!
//! In each triangle the second fundamental form is fitted to how normals change along its edges; a node has the mean of those of
//! its triangles, turned into its tangent plane and weighted by their areas.

use crate::topology::Topology;
use glam::DVec3;

/// The second fundamental form of a node, in the tangent frame of its normal ([`frame`]): II(x, y) = a x² + 2 b x y + c y². Above
/// zero along what is convex, seen from where normals look to; in reciprocals of lengths.
pub type Form = [f64; 3];

/// Two directions across a unit normal.
pub fn frame(n: DVec3) -> [DVec3; 2] {
    n.any_orthonormal_pair().into()
}

/// The curvature of a form along a tangent direction, which need not be unit.
pub fn along(form: &Form, n: DVec3, way: DVec3) -> f64 {
    let [s, t] = frame(n);
    let (x, y) = (way.dot(s), way.dot(t));
    (form[0] * x * x + 2.0 * form[1] * x * y + form[2] * y * y) / (x * x + y * y)
}

/// The forms of all nodes; `positions` and unit `normals` are of nodes.
pub fn forms(topology: &Topology, positions: &[DVec3], normals: &[DVec3]) -> Vec<Form> {
    let mut sums = vec![[0.0; 4]; positions.len()];
    for t in &topology.triangles {
        let [p, n] = [positions, normals].map(|of| t.map(|i| of[i as usize]));
        let face = (p[1] - p[0]).cross(p[2] - p[0]);
        let area = face.length();
        let Some(across) = face.try_normalize() else { continue };
        let [s, v] = frame(across);
        // Least squares of II (e·s, e·v) = (Δn·s, Δn·v) over the edges: normal equations of three unknowns.
        let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, [0.0; 3]);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (e, d) = (p[j] - p[i], n[j] - n[i]);
            let (x, y, dx, dy) = (e.dot(s), e.dot(v), d.dot(s), d.dot(v));
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
            right = [right[0] + x * dx, right[1] + y * dx + x * dy, right[2] + y * dy];
        }
        // | xx xy 0 | xy xx+yy xy | 0 xy yy |, by elimination of the outer two.
        let middle = xx + yy - xy * xy / xx - xy * xy / yy;
        let b = (right[1] - xy / xx * right[0] - xy / yy * right[2]) / middle;
        let (a, c) = ((right[0] - xy * b) / xx, (right[2] - xy * b) / yy);
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            continue;
        }
        for k in 0..3 {
            // The face's frame turned about the axis that takes its normal to that of the node.
            let turn =
                glam::DQuat::from_rotation_arc(n[k], if across.dot(n[k]) < 0.0 { -across } else { across });
            let [x, y] = frame(n[k]).map(|axis| {
                let axis = turn * axis;
                [axis.dot(s), axis.dot(v)]
            });
            let of = |p: [f64; 2], q: [f64; 2]| {
                a * p[0] * q[0] + b * (p[0] * q[1] + p[1] * q[0]) + c * p[1] * q[1]
            };
            let sum = &mut sums[t[k] as usize];
            let values = [of(x, x), of(x, y), of(y, y), 1.0];
            sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += area * v);
        }
    }
    sums.into_iter().map(|[a, b, c, weight]| [a, b, c].map(|v| v / weight)).collect()
}
