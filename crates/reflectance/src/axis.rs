//! Directions as coordinates of a table: their angles, and where a value lies along an axis of rising entries.

use glam::Vec3;
use std::f32::consts::TAU;

/// The functions in WGSL, spliced in after `frame.wgsl`.
pub(crate) const AXIS_WGSL: &str = include_str!("axis.wgsl");

/// The angle from +z, radians; keeps its digits at the pole, where an arc cosine has none.
#[inline]
pub(crate) fn polar_angle(w: Vec3) -> f32 {
    w.truncate().length().atan2(w.z)
}

/// The angle around +z from +x, radians in [−π, π]; 0 where there is none.
#[inline]
pub(crate) fn azimuth(w: Vec3) -> f32 {
    if w.x == 0.0 && w.y == 0.0 { 0.0 } else { w.y.atan2(w.x) }
}

/// The entries around `x` and how far between; the ends are held.
#[inline]
pub(crate) fn clamped(axis: &[f32], x: f32) -> (usize, usize, f32) {
    if axis.len() < 2 {
        return (0, 0, 0.0);
    }
    let i = axis.partition_point(|&a| a <= x).clamp(1, axis.len() - 1) - 1;
    (i, i + 1, ((x - axis[i]) / (axis[i + 1] - axis[i])).clamp(0.0, 1.0))
}

/// The same for azimuths, where the last entry is followed by the first.
#[inline]
pub(crate) fn periodic(axis: &[f32], x: f32) -> (usize, usize, f32) {
    let last = axis.len() - 1;
    if last == 0 {
        return (0, 0, 0.0);
    }
    let x = axis[0] + (x - axis[0]).rem_euclid(TAU);
    if x >= axis[last] {
        return (last, 0, ((x - axis[last]) / (axis[0] + TAU - axis[last])).clamp(0.0, 1.0));
    }
    clamped(axis, x)
}
