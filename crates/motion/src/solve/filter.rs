//! Smoothing without delay: a Butterworth low-pass of second order, run forwards and backwards (so of fourth order and
//! without phase; Winter 2009, "Biomechanics and Motor Control of Human Movement", 3.4), as the kernel that this comes to.
//! A kernel can be applied to rotations: to the rotation vectors that lead from each frame to its neighbours.

use crate::RigidPose;
use glam::{DQuat, DVec3};

/// Weights of a frame and of those up to so many on both of its sides.
#[derive(Clone, Debug)]
pub struct LowPass(Vec<f64>);

impl LowPass {
    /// Passes what is slower than `cutoff` (Hz), at so many frames a second. Where the rate is too low to tell, all.
    pub fn new(cutoff: f64, rate: f64) -> Self {
        // Beyond this the bilinear transform has no meaning.
        if !(cutoff > 0.0 && cutoff < 0.45 * rate) {
            return Self(vec![1.0]);
        }
        // Two passes lower the frequency at which half the power is left; Winter's correction takes that back.
        let corrected = (std::f64::consts::PI * cutoff / rate).tan() / (2f64.sqrt() - 1.0).powf(0.25);
        let (k, root) = (corrected, std::f64::consts::SQRT_2 * corrected);
        let norm = 1.0 + root + k * k;
        let b = [k * k / norm, 2.0 * k * k / norm, k * k / norm];
        let a = [2.0 * (k * k - 1.0) / norm, (1.0 - root + k * k) / norm];
        // Both passes over an impulse: its response is its own correlation. It decays within a few periods.
        let reach = (3.0 * rate / cutoff).ceil() as usize;
        let mut response: Vec<f64> = Vec::with_capacity(reach);
        for n in 0..reach {
            let input = b.get(n).copied().unwrap_or(0.0);
            let past = |lag: usize| n.checked_sub(lag).map_or(0.0, |i| response[i]);
            response.push(input - a[0] * past(1) - a[1] * past(2));
        }
        let mut kernel: Vec<f64> =
            (0..reach).map(|lag| response[lag..].iter().zip(&response).map(|(x, y)| x * y).sum()).collect();
        let used = kernel.iter().rposition(|w| w.abs() > 1e-6 * kernel[0]).map_or(1, |i| i + 1);
        kernel.truncate(used);
        let sum = kernel[0] + 2.0 * kernel[1..].iter().sum::<f64>();
        Self(kernel.iter().map(|w| w / sum).collect())
    }

    /// The mean of `value` around a frame of so many, weights beyond the ends given to what is mirrored there: at an end
    /// it goes on as it came, turned by half (value − 2 · end).
    fn around(&self, frame: usize, frames: usize, value: impl Fn(usize) -> DVec3) -> DVec3 {
        let last = frames - 1;
        let at = |offset: isize| {
            let i = frame as isize + offset;
            if i < 0 {
                2.0 * value(0) - value((-i).min(last as isize) as usize)
            } else if i > last as isize {
                2.0 * value(last) - value((2 * last as isize - i).max(0) as usize)
            } else {
                value(i as usize)
            }
        };
        let sides = self.0.iter().enumerate().skip(1);
        self.0[0] * at(0) + sides.map(|(k, w)| *w * (at(k as isize) + at(-(k as isize)))).sum::<DVec3>()
    }

    /// Smooths poses.
    pub fn poses(&self, poses: &[RigidPose]) -> Vec<RigidPose> {
        if self.0.len() == 1 {
            return poses.to_vec();
        }
        let all: Vec<(DVec3, DQuat)> =
            poses.iter().map(|p| (p.position.as_dvec3(), p.rotation.as_dquat())).collect();
        (0..all.len())
            .map(|frame| {
                let position = self.around(frame, all.len(), |i| all[i].0);
                let own = all[frame].1;
                // From this frame's rotation: neighbours are near, so that no way round is the wrong one.
                let turn = self.around(frame, all.len(), |i| rotation_vector(own.inverse() * all[i].1));
                let rotation = own * DQuat::from_scaled_axis(turn);
                RigidPose { position: position.as_vec3(), rotation: rotation.normalize().as_quat() }
            })
            .collect()
    }
}

/// The axis of a rotation times its angle, at most half a turn.
pub(super) fn rotation_vector(q: DQuat) -> DVec3 {
    let q = if q.w < 0.0 { -q } else { q };
    let v = q.xyz();
    let sine = v.length();
    // Near nothing the angle is twice the sine of its half.
    if sine < 1e-9 { 2.0 * v } else { v * (2.0 * sine.atan2(q.w) / sine) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn waves(frequency: f64, rate: f64, frames: usize) -> Vec<RigidPose> {
        let wave = |f: usize| (std::f64::consts::TAU * frequency * f as f64 / rate).sin() as f32;
        let pose = |f: usize| RigidPose {
            position: Vec3::new(wave(f), 2.0, 0.0),
            // A turn that goes on and on, and a wave on it.
            rotation: Quat::from_rotation_y(0.02 * f as f32) * Quat::from_rotation_x(0.3 * wave(f)),
        };
        (0..frames).map(pose).collect()
    }

    /// How large the wave is in the middle, to what it was.
    fn gains(frequency: f64) -> [f32; 2] {
        let (rate, frames) = (120.0, 600);
        let before = waves(frequency, rate, frames);
        let after = LowPass::new(6.0, rate).poses(&before);
        let largest = |poses: &[RigidPose]| {
            let middle = poses.iter().enumerate().skip(200).take(200);
            middle.fold([0.0f32; 2], |[p, r], (f, pose)| {
                let wave = Quat::from_rotation_y(-0.02 * f as f32) * pose.rotation;
                [p.max(pose.position.x.abs()), r.max(wave.to_scaled_axis().x.abs())]
            })
        };
        let (b, a) = (largest(&before), largest(&after));
        [a[0] / b[0], a[1] / b[1]]
    }

    #[test]
    fn waves_pass_as_a_butterworth_filter_lets_them() {
        for frequency in [1.0, 3.0, 6.0, 12.0] {
            // |H|² of second order is what two passes leave; prewarped, and with the corrected cutoff.
            let warp = |f: f64| (std::f64::consts::PI * f / 120.0).tan();
            let ratio = warp(frequency) / warp(6.0) * (2f64.sqrt() - 1.0).powf(0.25);
            let want = 1.0 / (1.0 + ratio.powi(4));
            for got in gains(frequency) {
                assert!((f64::from(got) - want).abs() < 0.02, "{frequency} Hz: {got}, expected {want}");
            }
        }
    }

    #[test]
    fn what_is_even_stays_to_its_ends() {
        let line: Vec<RigidPose> = (0..100)
            .map(|f| RigidPose {
                position: Vec3::X * f as f32 * 0.1,
                rotation: Quat::from_rotation_z(f as f32 * 0.05),
            })
            .collect();
        for (a, b) in line.iter().zip(LowPass::new(6.0, 100.0).poses(&line)) {
            assert!(a.position.distance(b.position) < 1e-5 && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-6);
        }
        assert_eq!(LowPass::new(60.0, 100.0).poses(&line), line, "a rate that cannot tell");
        assert!(LowPass::new(6.0, 100.0).poses(&[]).is_empty());
    }
}
