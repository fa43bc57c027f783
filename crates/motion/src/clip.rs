//! Movements by keys, interpolated as glTF 2.0 has it (appendix C).

use crate::{Placement, Pose, Skeleton, Transform};
use glam::{Quat, Vec3};

/// What of a joint a curve moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Three numbers a key.
    Translation,
    /// Four numbers a key: x, y, z, w of a quaternion.
    Rotation,
    /// Three numbers a key.
    Scale,
    /// One number a key for each morph target of the mesh at the joint.
    Weights,
}

impl Property {
    /// Numbers of a value; of weights, of one of them.
    pub fn width(self) -> usize {
        match self {
            Self::Translation | Self::Scale => 3,
            Self::Rotation => 4,
            Self::Weights => 1,
        }
    }
}

/// What is between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier key.
    Step,
    /// A straight line; of rotations, the shorter great circle at even speed (slerp).
    Linear,
    /// A Hermite spline: each value stands between its incoming and its outgoing tangent, per second.
    Cubic,
}

/// A property of a joint over time.
#[derive(Clone, Debug)]
pub struct Curve {
    property: Property,
    interpolation: Interpolation,
    times: Vec<f32>,
    values: Vec<f32>,
    /// Numbers of a value.
    width: usize,
}

/// Why keys are no curve.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CurveError {
    /// Times and values that do not belong together.
    #[error("an animation has {times} times but {values} values of {property:?}")]
    Count {
        /// Keys.
        times: usize,
        /// Values.
        values: usize,
        /// Of what.
        property: Property,
    },
    /// Keys out of order, or at no time.
    #[error("the times of an animation must be finite and rise")]
    Times,
}

impl Curve {
    /// A curve through `values`, one key at each of `times` (seconds, rising); at least one.
    pub fn new(
        property: Property,
        interpolation: Interpolation,
        times: Vec<f32>,
        values: Vec<f32>,
    ) -> Result<Self, CurveError> {
        let each = if interpolation == Interpolation::Cubic { 3 * times.len() } else { times.len() };
        let width = values.len().checked_div(each).unwrap_or(0);
        let fits = width > 0 && width * each == values.len();
        if !fits || (property != Property::Weights && width != property.width()) {
            let values = values.len() / property.width();
            return Err(CurveError::Count { times: times.len(), values, property });
        }
        if !times.iter().all(|t| t.is_finite()) || times.windows(2).any(|t| t[0] >= t[1]) {
            return Err(CurveError::Times);
        }
        Ok(Self { property, interpolation, times, values, width })
    }

    /// What it moves.
    pub fn property(&self) -> Property {
        self.property
    }

    /// What is between its keys.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Seconds of its keys.
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// The numbers of its keys, key after key, tangents of cubic ones included.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Seconds of the first and of the last key.
    pub fn span(&self) -> [f32; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// The value at `seconds`; before the first key and after the last it is that of the key.
    pub fn at(&self, seconds: f32) -> Vec<f32> {
        let Self { times, values, width, .. } = self;
        let width = *width;
        let cubic = self.interpolation == Interpolation::Cubic;
        let (per_key, first) = if cubic { (3 * width, width) } else { (width, 0) };
        let part = |key: usize, offset: usize| &values[key * per_key + offset..][..width];
        let last = times.len() - 1;
        let key = times.partition_point(|t| *t <= seconds).saturating_sub(1);
        if key == last || seconds <= times[0] || self.interpolation == Interpolation::Step {
            return part(key, first).to_vec();
        }
        let span = times[key + 1] - times[key];
        let t = (seconds - times[key]) / span;
        let (a, b) = (part(key, first), part(key + 1, first));
        match self.interpolation {
            Interpolation::Linear if self.property == Property::Rotation => {
                let q = |v: &[f32]| Quat::from_slice(v).normalize();
                q(a).slerp(q(b), t).to_array().to_vec()
            }
            Interpolation::Cubic => {
                let (leave, arrive) = (part(key, 2 * width), part(key + 1, 0));
                let (t2, t3) = (t * t, t * t * t);
                let hermite = |i: usize| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                        + span * (t3 - 2.0 * t2 + t) * leave[i]
                        + (3.0 * t2 - 2.0 * t3) * b[i]
                        + span * (t3 - t2) * arrive[i]
                };
                (0..width).map(hermite).collect()
            }
            _ => a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect(),
        }
    }
}

/// A movement of a skeleton.
#[derive(Clone, Debug, Default)]
pub struct Clip {
    /// What it is called; may be empty.
    pub name: String,
    /// Joints and how they move.
    pub channels: Vec<(usize, Curve)>,
}

impl Clip {
    /// Seconds of its first and of its last key; zeros where it moves nothing.
    pub fn span(&self) -> [f32; 2] {
        let spans = self.channels.iter().map(|(_, curve)| curve.span());
        spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([0.0; 2])
    }

    /// Where it takes `skeleton` at `seconds`; before it begins and after it ends it stands still.
    pub fn pose(&self, skeleton: &Skeleton, seconds: f32) -> Pose {
        let mut pose = skeleton.rest();
        for (joint, curve) in &self.channels {
            let value = curve.at(seconds);
            if curve.property == Property::Weights {
                pose.weights.insert(*joint, value);
                continue;
            }
            let Some(placement) = pose.placements.get_mut(*joint) else { continue };
            // What moves has no matrix; where there is one nonetheless, the movement is what was meant.
            let mut parts = match placement {
                Placement::Parts(parts) => *parts,
                Placement::Matrix(_) => Transform::IDENTITY,
            };
            match curve.property {
                Property::Translation => parts.translation = Vec3::from_slice(&value),
                Property::Scale => parts.scale = Vec3::from_slice(&value),
                Property::Rotation | Property::Weights => parts.rotation = Quat::from_slice(&value),
            }
            *placement = Placement::Parts(parts);
        }
        pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Joint;

    #[test]
    fn values_between_keys_are_those_of_the_specification() {
        let of = |times: &[f32], values: &[f32], property, interpolation, seconds| {
            Curve::new(property, interpolation, times.to_vec(), values.to_vec()).unwrap().at(seconds)
        };
        let line = |interpolation, seconds| {
            let values = [0.0, 10.0, 4.0, 20.0, 8.0, 0.0];
            of(&[1.0, 3.0, 4.0], &values, Property::Weights, interpolation, seconds)
        };
        for interpolation in [Interpolation::Linear, Interpolation::Step] {
            assert_eq!(line(interpolation, 0.0), [0.0, 10.0]);
            assert_eq!(line(interpolation, 3.0), [4.0, 20.0]);
            assert_eq!(line(interpolation, 9.0), [8.0, 0.0]);
        }
        assert_eq!(line(Interpolation::Linear, 1.5), [1.0, 12.5]);
        assert_eq!(line(Interpolation::Step, 2.9), [0.0, 10.0]);
        // The spline of x³ through 0 and 8, whose slopes are 0 and 12: it is a cubic, so that it is met exactly.
        let cube = |seconds| {
            let values = [9.0, 0.0, 0.0, 12.0, 8.0, 9.0];
            of(&[0.0, 2.0], &values, Property::Weights, Interpolation::Cubic, seconds)[0]
        };
        for t in [0.5f32, 1.0, 1.7] {
            assert!((cube(t) - t.powi(3)).abs() < 1e-5, "{t}: {}", cube(t));
        }
        assert_eq!(cube(7.0), 8.0);
        // A turn about z by 0 and 270 degrees is short the other way round.
        let half = 0.5f32.sqrt();
        let turn = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, -half];
        let got = of(&[0.0, 1.0], &turn, Property::Rotation, Interpolation::Linear, 0.5);
        let want = Quat::from_rotation_z(-std::f32::consts::FRAC_PI_4);
        assert!(Quat::from_slice(&got).dot(want).abs() > 1.0 - 1e-6, "{got:?}");
    }

    #[test]
    fn keys_that_make_no_sense_are_refused() {
        let new = |times: &[f32], values: usize, interpolation| {
            Curve::new(Property::Translation, interpolation, times.to_vec(), vec![0.0; values]).unwrap_err()
        };
        let count = |times, values| CurveError::Count { times, values, property: Property::Translation };
        assert_eq!(new(&[0.0, 1.0], 5, Interpolation::Linear), count(2, 1));
        assert_eq!(new(&[0.0, 1.0], 6, Interpolation::Cubic), count(2, 2));
        assert_eq!(new(&[], 0, Interpolation::Step), count(0, 0));
        for times in [[1.0, 1.0], [1.0, 0.0], [0.0, f32::NAN], [0.0, f32::INFINITY]] {
            assert_eq!(new(&times, 6, Interpolation::Linear), CurveError::Times);
        }
    }

    #[test]
    fn a_clip_moves_what_it_names_and_nothing_else() {
        let rest = Transform { translation: Vec3::Y, ..Transform::IDENTITY };
        let joint = |parent, rest| Joint { name: String::new(), parent, rest };
        let matrix = Placement::Matrix(glam::Mat4::from_translation(Vec3::Z));
        let skeleton =
            Skeleton::new(vec![joint(None, Placement::Parts(rest)), joint(Some(0), matrix)]).unwrap();
        let scale = |times: &[f32], values: &[f32]| {
            Curve::new(Property::Scale, Interpolation::Linear, times.to_vec(), values.to_vec()).unwrap()
        };
        let clip = Clip {
            name: "grow".into(),
            channels: vec![
                (0, scale(&[1.0, 2.0], &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0])),
                (1, scale(&[0.5], &[2.0, 2.0, 2.0])),
                // Of another skeleton.
                (7, scale(&[3.0], &[2.0, 2.0, 2.0])),
            ],
        };
        assert_eq!(clip.span(), [0.5, 3.0]);
        assert_eq!(Clip::default().span(), [0.0; 2]);
        let pose = clip.pose(&skeleton, 1.5);
        let grown = Transform { scale: Vec3::splat(2.0), ..rest };
        assert_eq!(pose.placements[0], Placement::Parts(grown));
        let child = Transform { scale: Vec3::splat(2.0), ..Transform::IDENTITY };
        assert_eq!(pose.placements[1], Placement::Parts(child));
    }
}
