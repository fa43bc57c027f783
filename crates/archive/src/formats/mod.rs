//! One file per format.

pub mod image;
pub mod merl;
