//! Where two rigid bodies are joined: the point that moves least in both (Ehrig et al. 2006, "A survey of formal methods
//! for determining the centre of rotation of ball joints", SCoRE).

use crate::RigidPose;
use glam::{DMat3, DVec3};
use yugen_optics::linear::solve_spd;

/// How much being near to the origins of both bodies weighs against being at rest in both, a frame. A joint lies within
/// some .3 m of what marks it, and rests within a millimetre: (.001 / .3)², and a tenth of it, so that what is measured
/// wins wherever the bodies turn by more than a degree. Where they turn about one axis only, it picks the nearest point.
const NEAR: f64 = 1e-6;

/// A joint between two bodies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Centre {
    /// In the coordinates of each.
    pub at: [DVec3; 2],
    /// How far the two of them are from each other, root mean square, m.
    pub apart: f64,
}

/// The joint of two bodies from poses of the same frames; `None` without any.
pub(super) fn centre(pairs: &[(RigidPose, RigidPose)]) -> Option<Centre> {
    let n = pairs.len() as f64;
    if pairs.is_empty() {
        return None;
    }
    // |A a + p − B b − q|² summed: normal equations of a and b.
    let mut a = [0.0; 36];
    let mut right = vec![0.0; 6];
    let mut cross = DMat3::ZERO;
    let parts = |p: &RigidPose| (DMat3::from_quat(p.rotation.as_dquat().normalize()), p.position.as_dvec3());
    for (one, two) in pairs {
        let ((ra, pa), (rb, pb)) = (parts(one), parts(two));
        cross += ra.transpose() * rb;
        let apart = pb - pa;
        for (i, v) in (ra.transpose() * apart).to_array().into_iter().enumerate() {
            right[i] += v;
        }
        for (i, v) in (rb.transpose() * apart).to_array().into_iter().enumerate() {
            right[3 + i] -= v;
        }
    }
    for i in 0..6 {
        a[7 * i] = n * (1.0 + NEAR);
    }
    for i in 0..3 {
        for j in 0..3 {
            let v = -cross.col(j)[i];
            a[6 * i + 3 + j] = v;
            a[6 * (3 + j) + i] = v;
        }
    }
    let x = solve_spd(a.to_vec(), right)?;
    let at = [DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5])];
    let off = |(one, two): &(RigidPose, RigidPose)| {
        let ((ra, pa), (rb, pb)) = (parts(one), parts(two));
        (ra * at[0] + pa).distance_squared(rb * at[1] + pb)
    };
    Some(Centre { at, apart: (pairs.iter().map(off).sum::<f64>() / n).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn pairs(turn: impl Fn(f32) -> Quat) -> Vec<(RigidPose, RigidPose)> {
        let (on_one, on_two) = (Vec3::new(0.0, -0.3, 0.05), Vec3::new(0.02, 0.2, 0.0));
        (0..200)
            .map(|f| {
                let t = f as f32 * 0.05;
                let one = RigidPose {
                    position: Vec3::new(t, t.sin(), 0.0),
                    rotation: Quat::from_rotation_y(t) * Quat::from_rotation_x(0.3 * t.cos()),
                };
                let rotation = one.rotation * turn(t);
                let joint = one.position + one.rotation * on_one;
                (one, RigidPose { position: joint - rotation * on_two, rotation })
            })
            .collect()
    }

    #[test]
    fn a_ball_joint_is_found_and_a_hinge_on_its_axis() {
        let ball =
            |t: f32| Quat::from_rotation_x(0.5 * t.sin()) * Quat::from_rotation_z(0.4 * (1.7 * t).cos());
        let found = centre(&pairs(ball)).unwrap();
        assert!(found.at[0].distance(DVec3::new(0.0, -0.3, 0.05)) < 1e-5, "{found:?}");
        assert!(found.at[1].distance(DVec3::new(0.02, 0.2, 0.0)) < 1e-5, "{found:?}");
        assert!(found.apart < 1e-5);
        // A knee turns about x: on that line, wherever.
        let found = centre(&pairs(|t| Quat::from_rotation_x(t.sin()))).unwrap();
        assert!((found.at[0] - DVec3::new(found.at[0].x, -0.3, 0.05)).length() < 1e-5, "{found:?}");
        assert!(found.apart < 1e-5 && found.at[0].x.abs() < 0.03, "{found:?}");
        // Bodies that do not turn against each other join near both.
        let found = centre(&pairs(|_| Quat::from_rotation_x(0.5))).unwrap();
        assert!(found.apart < 1e-4 && found.at[0].length() < 0.6, "{found:?}");
        assert!(centre(&[]).is_none());
    }
}
