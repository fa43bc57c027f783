//! x

pub mod accel;
pub mod geometry;
