//! Readings as the model wants them.

use crate::lanes::F;
use glam::Vec3;

/// One reading of a texel as the model wants it: x, y, k and the light's direction times its irradiance.
pub(super) type Ray = [f32; 6];

/// The constants of light from `light` seen from `eye` (unit, away from the surface). `None` below the horizon.
pub(super) fn ray(light: Vec3, eye: Vec3, irradiance: f32) -> Option<Ray> {
    // A degree above it: nothing that grazes so tells anything.
    if !(light.z > 0.0175 && eye.z > 0.0175 && irradiance > 0.0) {
        return None;
    }
    let h = light + eye;
    let z2 = h.z * h.z;
    let l = light * irradiance;
    Some([h.x / h.z, h.y / h.z, h.length_squared() / (z2 * z2), l.x, l.y, l.z])
}

/// The same for all texels, or different ones.
pub(super) trait Rays: Copy {
    fn at(&self, i: usize) -> [F; 6];
    fn of(&self, i: usize, lane: usize) -> Ray;
}

/// Lights far away.
#[derive(Clone, Copy)]
pub(super) struct Common<'a>(pub &'a [Ray]);

/// Lights nearby: every texel sees them elsewhere.
#[derive(Clone, Copy)]
pub(super) struct Own<'a>(pub &'a [[F; 6]]);

impl Rays for Common<'_> {
    #[inline(always)]
    fn at(&self, i: usize) -> [F; 6] {
        let [a, b, c, d, e, f] = self.0[i];
        [F::splat(a), F::splat(b), F::splat(c), F::splat(d), F::splat(e), F::splat(f)]
    }
    #[inline(always)]
    fn of(&self, i: usize, _: usize) -> Ray {
        self.0[i]
    }
}

impl Rays for Own<'_> {
    #[inline(always)]
    fn at(&self, i: usize) -> [F; 6] {
        self.0[i]
    }
    #[inline(always)]
    fn of(&self, i: usize, lane: usize) -> Ray {
        self.0[i].map(|v| v.0[lane])
    }
}
