//! What a motion capture system measures: markers and rigid bodies over time, with gaps.

use glam::{Mat3, Quat, Vec3};

/// Where a rigid body is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPose {
    /// Of its origin.
    pub position: Vec3,
    /// From its coordinates to the world's; unit.
    pub rotation: Quat,
}

/// What one marker or body does.
#[derive(Clone, Debug, PartialEq)]
pub struct Track<T> {
    /// As the file has it, with the subject's prefix where there is one.
    pub name: String,
    /// One a frame; `None` where it was not seen.
    pub samples: Vec<Option<T>>,
    /// Mean distance of what each sample was reconstructed from, in the unit of positions: one a frame, or none at all.
    pub residuals: Vec<f32>,
}

/// Tracks of the same frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks<T> {
    /// Frames a second; above zero where there are frames.
    pub rate: f64,
    /// When the first frame is, s.
    pub start: f64,
    /// How many; every track has so many samples.
    pub frames: usize,
    /// All of them.
    pub tracks: Vec<Track<T>>,
}

impl<T> Default for Tracks<T> {
    fn default() -> Self {
        Self { rate: 0.0, start: 0.0, frames: 0, tracks: Vec::new() }
    }
}

/// A measured performance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Take {
    /// Points.
    pub markers: Tracks<Vec3>,
    /// Points with directions; they may have a rate of their own.
    pub bodies: Tracks<RigidPose>,
}

impl<T> Track<T> {
    /// Of no frame yet.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), samples: Vec::new(), residuals: Vec::new() }
    }

    /// Frames in which it was not seen.
    pub fn missing(&self) -> usize {
        self.samples.iter().filter(|s| s.is_none()).count()
    }

    /// Each gap: its first frame and how many it has.
    pub fn gaps(&self) -> Vec<[usize; 2]> {
        let mut gaps: Vec<[usize; 2]> = Vec::new();
        for (frame, _) in self.samples.iter().enumerate().filter(|(_, s)| s.is_none()) {
            match gaps.last_mut() {
                Some([first, count]) if *first + *count == frame => *count += 1,
                _ => gaps.push([frame, 1]),
            }
        }
        gaps
    }
}

impl<T> Tracks<T> {
    /// The track of this name.
    pub fn find(&self, name: &str) -> Option<&Track<T>> {
        self.tracks.iter().find(|t| t.name == name)
    }

    /// The same tracks of something else.
    pub fn map<U>(&self, change: impl Fn(&T) -> U) -> Tracks<U> {
        let track = |t: &Track<T>| Track {
            name: t.name.clone(),
            samples: t.samples.iter().map(|s| s.as_ref().map(&change)).collect(),
            residuals: t.residuals.clone(),
        };
        let Self { rate, start, frames, ref tracks } = *self;
        Tracks { rate, start, frames, tracks: tracks.iter().map(track).collect() }
    }

    /// Seconds from the first frame to the last.
    pub fn seconds(&self) -> f64 {
        if self.frames > 0 { (self.frames - 1) as f64 / self.rate } else { 0.0 }
    }
}

impl Take {
    /// Brings it to other axes and another unit: `axes` takes the axes of the file to those wanted, turning or mirroring
    /// but not stretching, and lengths are multiplied by `scale`.
    pub fn transform(&mut self, axes: Mat3, scale: f32) {
        let point = |p: Vec3| axes * p * scale;
        for marker in &mut self.markers.tracks {
            marker.samples.iter_mut().flatten().for_each(|p| *p = point(*p));
            marker.residuals.iter_mut().for_each(|r| *r *= scale);
        }
        for body in &mut self.bodies.tracks {
            for pose in body.samples.iter_mut().flatten() {
                *pose = RigidPose { position: point(pose.position), rotation: reaxis(pose.rotation, axes) };
            }
            body.residuals.iter_mut().for_each(|r| *r *= scale);
        }
    }

    /// All that is seen in a frame of the markers and in the frame of the bodies at the same time.
    pub fn points(&self, frame: usize) -> impl Iterator<Item = Vec3> {
        let markers = self.markers.tracks.iter().filter_map(move |t| *t.samples.get(frame)?);
        let ratio = if self.markers.frames > 0 { self.bodies.rate / self.markers.rate } else { 1.0 };
        let other = (frame as f64 * ratio).round() as usize;
        let bodies = self.bodies.tracks.iter().filter_map(move |t| *t.samples.get(other)?);
        markers.chain(bodies.map(|b| b.position))
    }

    /// Frames of the markers; of the bodies where there are no markers.
    pub fn frames(&self) -> usize {
        if self.markers.frames > 0 { self.markers.frames } else { self.bodies.frames }
    }
}

/// The rotation that does in the axes that `axes` leads to what `rotation` does in its own; `axes` turns or mirrors.
pub fn reaxis(rotation: Quat, axes: Mat3) -> Quat {
    // The axis of a rotation is a pseudovector.
    let v = axes * rotation.xyz() * axes.determinant();
    Quat::from_xyzw(v.x, v.y, v.z, rotation.w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_runs_of_what_is_missing() {
        let track =
            Track { samples: [1, 0, 0, 1, 0].map(|s| (s > 0).then_some(s)).to_vec(), ..Track::new("") };
        assert_eq!(track.gaps(), [[1, 2], [4, 1]]);
        assert_eq!(track.missing(), 3);
    }

    #[test]
    fn other_axes_keep_what_bodies_do_to_points() {
        // z up, and mirrored.
        let axes = [Mat3::from_cols(Vec3::X, -Vec3::Z, Vec3::Y), Mat3::from_cols(-Vec3::X, Vec3::Y, Vec3::Z)];
        for axes in axes {
            let pose = RigidPose {
                position: Vec3::new(1.0, 2.0, 3.0),
                rotation: Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.0, 2.0),
            };
            let on = Vec3::new(0.1, -0.2, 0.4);
            let before = pose.position + pose.rotation * on;
            let mut take = Take::default();
            take.bodies.tracks.push(Track { samples: vec![Some(pose)], ..Track::new("fan") });
            take.bodies.frames = 1;
            take.transform(axes, 0.5);
            let pose = take.bodies.tracks[0].samples[0].unwrap();
            let after = pose.position + pose.rotation * (axes * on * 0.5);
            assert!(after.distance(axes * before * 0.5) < 1e-6);
        }
    }
}
