//! What changes with time, as plain data and pure functions: skeletons, the clips that move them, and meshes that follow
//! by skins and morph targets; cloth; noise, and fire.
//!
//! Seconds throughout; matrices act on columns, so that a joint's matrix times a point of the joint is a point of its
//! parent.

mod clip;
pub mod cloth;
mod deform;
pub mod fire;
pub mod noise;
mod skeleton;

pub use clip::{Clip, Curve, CurveError, Interpolation, Property};
pub use deform::{Influences, MorphTarget, Skin, SkinError, Vertices};
pub use skeleton::{Joint, Placement, Pose, Skeleton, SkeletonError, Transform};
