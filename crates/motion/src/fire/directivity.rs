//! How much a part of a flame shines to each side.

use glam::DVec3;

/// Nodes along a side of the net of directions: 22.5° apart.
pub(super) const NET: usize = 9;
pub(super) const NODES: usize = NET * NET;
/// Intensity by direction over its mean: values at the nodes of an octahedron unfolded to a square, +y in its middle and −y
/// at its corners, linear between them. A flame shines where it is broad, and hardly down through its logs: dips that
/// spherical harmonics of the third degree miss by a twentieth beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct Directivity([f32; NODES]);

/// [`Directivity::towards`] of the values that begin at a word of `numbers`, for the GPU.
pub const DIRECTIVITY_WGSL: &str = include_str!("directivity.wgsl");

impl Default for Directivity {
    fn default() -> Self {
        Self([1.0; NODES])
    }
}

impl Directivity {
    pub(super) fn new(values: [f32; NODES]) -> Self {
        Self(values)
    }

    /// Towards a unit direction, away from the flame.
    pub fn towards(&self, direction: DVec3) -> f64 {
        let s = direction / direction.abs().element_sum();
        let [mut u, mut v] = [s.x, s.z];
        if s.y < 0.0 {
            [u, v] = [(1.0 - s.z.abs()) * s.x.signum(), (1.0 - s.x.abs()) * s.z.signum()];
        }
        let split = |a: f64| {
            let last = (NET - 1) as f64;
            let at = ((0.5 + 0.5 * a) * last).clamp(0.0, last);
            let first = (at as usize).min(NET - 2);
            (first, at - first as f64)
        };
        let ((i, s), (j, t)) = (split(u), split(v));
        let value = |i: usize, j: usize| f64::from(self.0[j * NET + i]);
        let row = |j: usize| value(i, j) + s * (value(i + 1, j) - value(i, j));
        row(j) + t * (row(j + 1) - row(j))
    }

    /// Values at the nodes, along u first: so a shader reads them.
    pub fn values(&self) -> &[f32] {
        &self.0
    }

    /// Unit directions of the nodes, in the order of the values, and their weights in the mean over the sphere, which nodes of
    /// one direction share.
    pub fn nodes() -> impl Iterator<Item = (DVec3, f64)> {
        let alike = |node: usize| (0..NODES).filter(|&n| first_alike(n) == first_alike(node)).count() as f64;
        let all: f64 = (0..NODES).map(|node| weigh(node) / alike(node)).sum();
        (0..NODES).map(move |node| (looks(node), weigh(node) / (alike(node) * all)))
    }
}

/// The point of the octahedron |x| + |y| + |z| = 1 at (u, v) of the square from −1 to 1.
fn unfolded(u: f64, v: f64) -> DVec3 {
    let y = 1.0 - u.abs() - v.abs();
    let side = |a: f64, b: f64| if y < 0.0 { (1.0 - b.abs()) * a.signum() } else { a };
    DVec3::new(side(u, v), y, side(v, u))
}

/// Where a node looks.
fn looks(node: usize) -> DVec3 {
    let at = |k: usize| 2.0 * k as f64 / (NET - 1) as f64 - 1.0;
    unfolded(at(node % NET), at(node / NET)).normalize()
}

/// The first of the nodes that look where this one does: on the rim every direction is met twice, at the corners four times.
pub(super) fn first_alike(node: usize) -> usize {
    let (last, [i, j]) = (NET - 1, [node % NET, node / NET]);
    let on = |k: usize| k == 0 || k == last;
    match (on(i), on(j)) {
        (true, true) => 0,
        (true, false) => j.min(last - j) * NET + i,
        (false, true) => j * NET + i.min(last - i),
        (false, false) => node,
    }
}

/// The weight of a node's direction, up to a factor: by how far the points of the octahedron are, of which four triangles meet
/// in a corner and six elsewhere. The mean of x⁴ over the sphere is .1972 with them, of .2.
fn weigh(node: usize) -> f64 {
    let d = looks(node);
    let triangles = if d.abs().max_element() > 1.0 - 1e-9 { 4.0 } else { 6.0 };
    // Unit length over the distance of the plane point, cubed.
    d.abs().element_sum().powi(3) * triangles
}

/// Directions of the net, each once, and their weights in the mean over the sphere.
pub(super) fn directions() -> impl Iterator<Item = (DVec3, f64)> {
    let nodes = || (0..NODES).filter(|&node| first_alike(node) == node);
    let all: f64 = nodes().map(weigh).sum();
    nodes().map(move |node| (looks(node), weigh(node) / all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_of_the_net_cover_the_sphere_and_are_looked_up_where_they_are() {
        // Means of what is even, linear and quadratic.
        let mean = |f: &dyn Fn(DVec3) -> f64| directions().map(|(d, weight)| weight * f(d)).sum::<f64>();
        assert!((mean(&|_| 1.0) - 1.0).abs() < 1e-12);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            assert!(mean(&|d| d.dot(axis)).abs() < 1e-12);
            assert!((mean(&|d| d.dot(axis).powi(2)) - 1.0 / 3.0).abs() < 1e-12);
            assert!((mean(&|d| d.dot(axis).powi(4)) - 0.2).abs() < 4e-3);
        }
        // The same where nodes that look alike share.
        let shared = |axis: DVec3| Directivity::nodes().map(|(d, w)| w * d.dot(axis).powi(4)).sum::<f64>();
        assert!((shared(DVec3::X) - mean(&|d| d.x.powi(4))).abs() < 1e-12);
        assert!((Directivity::nodes().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-12);
        let own = Directivity::new(std::array::from_fn(|n| {
            let d = looks(n);
            (1.0 + 0.5 * d.x + 0.25 * d.y - d.z * d.y) as f32
        }));
        for node in 0..NODES {
            assert!((own.towards(looks(node)) - f64::from(own.0[node])).abs() < 1e-6);
            assert!((looks(node) - looks(first_alike(node))).length() < 1e-12 && first_alike(node) <= node);
        }
        assert_eq!(directions().count(), 66);
    }
}
