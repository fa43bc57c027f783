//! Local shading frames and angles on the sphere.

use glam::Vec3;

/// An orthonormal, right-handed basis: tangent `s`, bitangent `t`, normal `n`, with `s × t = n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Tangent: local +x. The direction of the thread, the brushing or ∂p/∂u.
    pub s: Vec3,
    /// Bitangent: local +y.
    pub t: Vec3,
    /// Normal: local +z.
    pub n: Vec3,
}

impl Frame {
    /// Any frame around a unit normal. Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The frame whose normal is `n` (unit) and whose tangent is the part of `tangent` perpendicular to it
    /// (Gram-Schmidt); any frame around `n` where the two are parallel.
    #[inline]
    pub fn from_normal_tangent(n: Vec3, tangent: Vec3) -> Self {
        let s = tangent - n * n.dot(tangent);
        let length = s.length();
        if length > 1e-6 * tangent.length() && length.is_finite() && length > 0.0 {
            let s = s / length;
            Self { s, t: n.cross(s), n }
        } else {
            Self::from_normal(n)
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

/// The unit vector at polar angle `theta` from +z and azimuth `phi` from +x, both in radians.
#[inline]
pub fn spherical(theta: f32, phi: f32) -> Vec3 {
    let (sin_theta, cos_theta) = theta.sin_cos();
    let (sin_phi, cos_phi) = phi.sin_cos();
    Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}

/// Mirror of `w` about +z: the direction a mirror sends it.
#[inline]
pub fn mirror(w: Vec3) -> Vec3 {
    Vec3::new(-w.x, -w.y, w.z)
}

/// `w` where `side` is above the surface, else mirrored at it: as seen by whoever stands on the side of `side` (a
/// cosine). Reflection and refraction from below are those from above.
#[inline]
pub fn to_upper(w: Vec3, side: f32) -> Vec3 {
    Vec3::new(w.x, w.y, w.z * 1f32.copysign(side))
}

/// `|tan θ|²`-safe square root: `sqrt(max(x, 0))`.
#[inline]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for n in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.3, -0.5, -0.9).normalize()] {
            for f in [
                Frame::from_normal(n),
                Frame::from_normal_tangent(n, Vec3::new(0.2, 0.9, 0.1)),
                Frame::from_normal_tangent(n, n),
            ] {
                assert!((f.s.cross(f.t) - f.n).length() < 1e-6);
                assert!(f.s.dot(f.n).abs() < 1e-6 && (f.s.length() - 1.0).abs() < 1e-6);
                let v = Vec3::new(0.1, 0.7, -0.4);
                assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
            }
        }
    }
}
