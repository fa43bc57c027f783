//! One file per format.

pub mod image;
