//! Rigid bodies from labelled markers: those of a segment keep their distances, and where they are as a whole is found by
//! least squares (Horn 1987, "Closed-form solution of absolute orientation using unit quaternions").

use crate::{RigidPose, Track, Tracks};
use glam::{DMat3, DQuat, DVec3, Vec3};

/// A body and the markers that are on it.
pub type Cluster<'a> = (&'a str, &'a [&'a str]);

/// Markers of the set that Vicon's systems and the CMU and HDM05 collections use, by bodies of
/// [`PERFORMER`](super::PERFORMER). `LHIP` and `RHIP` are no markers but where the hips are from those of the waist.
pub const VICON: [Cluster; 15] = [
    ("pelvis", &["LFWT", "RFWT", "LBWT", "RBWT"]),
    ("chest", &["C7", "T10", "CLAV", "STRN", "RBAC"]),
    ("head", &["LFHD", "RFHD", "LBHD", "RBHD"]),
    ("left_upper_arm", &["LSHO", "LUPA", "LELB"]),
    ("left_forearm", &["LELB", "LFRM", "LWRA", "LWRB"]),
    ("left_hand", &["LWRA", "LWRB", "LFIN"]),
    ("right_upper_arm", &["RSHO", "RUPA", "RELB"]),
    ("right_forearm", &["RELB", "RFRM", "RWRA", "RWRB"]),
    ("right_hand", &["RWRA", "RWRB", "RFIN"]),
    ("left_thigh", &["LHIP", "LTHI", "LKNE"]),
    ("left_shank", &["LKNE", "LSHN", "LANK"]),
    ("left_foot", &["LANK", "LHEE", "LTOE", "LMT5"]),
    ("right_thigh", &["RHIP", "RTHI", "RKNE"]),
    ("right_shank", &["RKNE", "RSHN", "RANK"]),
    ("right_foot", &["RANK", "RHEE", "RTOE", "RMT5"]),
];

/// Rounds in which the shape of a cluster becomes the mean of its frames.
const ROUNDS: usize = 4;

/// The bodies of clusters of which three markers or more are in the take; a body is where three of them are seen. Its
/// origin is the mean of its markers, its axes are those of the world in the frame in which it is first seen whole.
pub fn bodies(markers: &Tracks<Vec3>, clusters: &[Cluster]) -> Tracks<RigidPose> {
    let hips = hips(markers);
    let find = |name: &str| {
        let plain =
            |t: &&Track<Vec3>| t.name.rsplit(':').next().unwrap_or(&t.name).eq_ignore_ascii_case(name);
        markers.tracks.iter().find(plain).or_else(|| hips.iter().find(plain))
    };
    let mut tracks = Vec::new();
    for (name, members) in clusters {
        let members: Vec<&Track<Vec3>> = members.iter().filter_map(|m| find(m)).collect();
        if let Some(track) = body(name, &members, markers.frames) {
            tracks.push(track);
        }
    }
    Tracks { rate: markers.rate, start: markers.start, frames: markers.frames, tracks }
}

fn body(name: &str, members: &[&Track<Vec3>], frames: usize) -> Option<Track<RigidPose>> {
    let at = |frame: usize| members.iter().map(move |m| m.samples[frame].map(Vec3::as_dvec3));
    let whole = (0..frames).find(|f| members.len() >= 3 && at(*f).all(|p| p.is_some()))?;
    let centred = |mut shape: Vec<DVec3>| {
        let mean = shape.iter().sum::<DVec3>() / shape.len() as f64;
        shape.iter_mut().for_each(|p| *p -= mean);
        shape
    };
    let mut shape = centred(at(whole).flatten().collect());
    let place = |shape: &[DVec3], frame: usize| {
        let seen: Vec<(DVec3, DVec3)> =
            shape.iter().zip(at(frame)).filter_map(|(s, p)| Some((*s, p?))).collect();
        absolute_orientation(&seen)
    };
    for _ in 0..ROUNDS {
        let mut sums = vec![(DVec3::ZERO, 0.0); shape.len()];
        for frame in 0..frames {
            let Some((position, rotation)) = place(&shape, frame) else { continue };
            for (sum, p) in sums.iter_mut().zip(at(frame)) {
                if let Some(p) = p {
                    sum.0 += rotation.inverse() * (p - position);
                    sum.1 += 1.0;
                }
            }
        }
        shape = centred(sums.iter().map(|(sum, n)| *sum / f64::max(*n, 1.0)).collect());
    }
    let mut track = Track::new(name);
    for frame in 0..frames {
        let found = place(&shape, frame);
        track.samples.push(found.map(|(position, rotation)| RigidPose {
            position: position.as_vec3(),
            rotation: rotation.as_quat(),
        }));
        let off = found.map_or(0.0, |(position, rotation)| {
            let each = shape.iter().zip(at(frame));
            let all: Vec<f64> =
                each.filter_map(|(s, p)| Some((position + rotation * *s).distance_squared(p?))).collect();
            (all.iter().sum::<f64>() / all.len().max(1) as f64).sqrt()
        });
        track.residuals.push(off as f32);
    }
    Some(track)
}

/// Where the hips are, from markers on the front and the back of the waist: of the distance between those in front 14 %
/// inwards, 19 % behind and 30 % below (Bell et al. 1990, "A comparison of the accuracy of several hip center location
/// prediction methods").
fn hips(markers: &Tracks<Vec3>) -> Vec<Track<Vec3>> {
    let find = |name: &str| markers.tracks.iter().find(|t| t.name.rsplit(':').next() == Some(name));
    let all = [find("LFWT"), find("RFWT"), find("LBWT"), find("RBWT")];
    let [Some(lf), Some(rf), Some(lb), Some(rb)] = all else { return Vec::new() };
    let hip = |left: bool, frame: usize| {
        let [lf, rf, lb, rb] = [lf, rf, lb, rb].map(|t| t.samples[frame]);
        let (lf, rf) = (lf?, rf?);
        let back = (lb? + rb?) / 2.0;
        let (apart, inwards) = (lf.distance(rf), if left { rf - lf } else { lf - rf }.normalize_or_zero());
        let across = (lf - rf).normalize_or_zero();
        let behind = (back - (lf + rf) / 2.0).reject_from(across).normalize_or_zero();
        // Left, then behind: their cross product is below for who stands on the feet.
        let below = behind.cross(across);
        let front = if left { lf } else { rf };
        Some(front + apart * (0.14 * inwards + 0.19 * behind + 0.30 * below))
    };
    [("LHIP", true), ("RHIP", false)]
        .map(|(name, left)| Track {
            samples: (0..markers.frames).map(|f| hip(left, f)).collect(),
            ..Track::new(name)
        })
        .to_vec()
}

/// Position and rotation that take the first of each pair nearest to the second; `None` of fewer than three, and of those
/// in a line.
pub(super) fn absolute_orientation(pairs: &[(DVec3, DVec3)]) -> Option<(DVec3, DQuat)> {
    if pairs.len() < 3 {
        return None;
    }
    let n = pairs.len() as f64;
    let [from, to] =
        [pairs.iter().map(|p| p.0).sum::<DVec3>() / n, pairs.iter().map(|p| p.1).sum::<DVec3>() / n];
    let mut m = DMat3::ZERO;
    for (a, b) in pairs {
        let (a, b) = (*a - from, *b - to);
        m += DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    }
    // m.col(j)[i] is the sum of a_i b_j.
    let s = |i: usize, j: usize| m.col(j)[i];
    let k = [
        [s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0)],
        [0.0, s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2)],
        [0.0, 0.0, -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1)],
        [0.0, 0.0, 0.0, -s(0, 0) - s(1, 1) + s(2, 2)],
    ];
    let k: [[f64; 4]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|j| if i <= j { k[i][j] } else { k[j][i] }));
    let (values, vectors) = eigen(k);
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
    // Points in a line may turn about it: then two rotations are equally good.
    let [first, second] = [values[order[0]], values[order[1]]];
    if first - second <= 1e-6 * first.abs() || !first.is_finite() {
        return None;
    }
    let [w, x, y, z] = std::array::from_fn(|i| vectors[i][order[0]]);
    let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
    Some((to - rotation * from, rotation))
}

/// Eigenvalues and, as columns, eigenvectors of a symmetric matrix, by Jacobi's rotations.
fn eigen(mut a: [[f64; 4]; 4]) -> ([f64; 4], [[f64; 4]; 4]) {
    let mut v: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    // Each sweep squares what is off the diagonal.
    for _ in 0..12 {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q].abs() < 1e-300 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (one, two) = (a[p], a[q]);
                a[p] = std::array::from_fn(|k| c * one[k] - s * two[k]);
                a[q] = std::array::from_fn(|k| s * one[k] + c * two[k]);
                for row in &mut v {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    (std::array::from_fn(|i| a[i][i]), v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn points_are_taken_to_where_they_are() {
        let q = DQuat::from_scaled_axis(DVec3::new(1.0, -2.0, 0.5));
        let at = DVec3::new(3.0, 1.0, -2.0);
        let shape = [DVec3::X, DVec3::Y * 0.3, DVec3::new(-0.2, 0.1, 0.0), DVec3::Z * 0.5];
        for count in [3, 4] {
            let pairs: Vec<_> = shape[..count].iter().map(|p| (*p, at + q * *p)).collect();
            let (position, rotation) = absolute_orientation(&pairs).unwrap();
            assert!(position.distance(at) < 1e-12 && rotation.dot(q).abs() > 1.0 - 1e-12, "{count}");
        }
        let line: Vec<_> = (0..4).map(|i| (DVec3::X * f64::from(i), at + DVec3::Y * f64::from(i))).collect();
        assert!(absolute_orientation(&line).is_none());
        assert!(absolute_orientation(&line[..2]).is_none());
    }

    #[test]
    fn a_body_is_where_its_markers_are() {
        let shape = [Vec3::ZERO, Vec3::X * 0.1, Vec3::Y * 0.07, Vec3::new(0.05, 0.05, 0.03)];
        let pose = |f: usize| {
            let t = f as f32 * 0.1;
            (Vec3::new(t, 1.0, 0.0), Quat::from_rotation_y(t) * Quat::from_rotation_x(0.5 * t))
        };
        let track = |m: usize| Track {
            samples: (0..50)
                .map(|f| {
                    let (p, q) = pose(f);
                    // One is lost, then two.
                    let lost = m == 3 && f > 10 || m == 2 && f > 40;
                    (!lost).then(|| p + q * shape[m])
                })
                .collect(),
            ..Track::new(["a:W", "X", "Y", "Z"][m])
        };
        let markers = Tracks { rate: 50.0, start: 1.0, frames: 50, tracks: (0..4).map(track).collect() };
        let found = bodies(&markers, &[("box", &["W", "X", "Y", "Z"]), ("none", &["W", "X", "V"])]);
        assert_eq!((found.tracks.len(), found.start), (1, 1.0));
        let body = &found.tracks[0];
        assert_eq!(body.gaps(), [[41, 9]]);
        let first = body.samples[0].unwrap();
        for f in 0..41 {
            let (got, (p, q)) = (body.samples[f].unwrap(), pose(f));
            let mean = shape.iter().sum::<Vec3>() / 4.0;
            assert!(got.position.distance(p + q * mean) < 1e-5);
            assert!((got.rotation * first.rotation.inverse()).dot(q).abs() > 1.0 - 1e-5);
            assert!(body.residuals[f] < 1e-6);
        }
    }
}
