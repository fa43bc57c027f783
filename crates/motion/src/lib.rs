//! What changes with time, as plain data and pure functions: what was captured of a performer, skeletons, the clips that
//! move them, the solve of one from the other, a dance, and meshes that follow by skins and morph targets; cloth, and
//! robes made of it; noise, and fire.
//!
//! Seconds throughout; matrices act on columns, so that a joint's matrix times a point of the joint is a point of its
//! parent.

mod clip;
pub mod cloth;
pub mod dance;
mod deform;
pub mod fire;
pub mod garment;
mod names;
pub mod noise;
mod skeletal;
mod skeleton;
pub mod solve;
mod take;

pub use clip::{Clip, Curve, CurveError, Interpolation, Property};
pub use deform::{Influences, MorphTarget, Skin, SkinError, Vertices};
pub use names::{BodySide, side_of};
pub use skeletal::{SkeletalMotion, continuous, rigid, sampled, seconds};
pub use skeleton::{Joint, Placement, Pose, Skeleton, SkeletonError, Transform};
pub use take::{RigidPose, Take, Track, Tracks, reaxis};
