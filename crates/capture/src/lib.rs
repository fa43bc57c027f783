//! From photographs under many lights to a reflectance model of the cloth.
//!
//! Frame of a sample that lies flat before the camera: +x right, +y up in the picture, +z to the camera,
//! right-handed. Pure: slices in, values out; `archive` reads and writes the files.

pub mod blur;
pub mod brdf_fit;
pub mod calibrate;
pub mod fit;
pub mod hdr;
mod lanes;
pub mod lens;
pub mod lighting;
pub mod normals;
pub mod pca;
mod readings;
mod rows;
pub mod rti;
pub mod simulate;
mod stack;
pub mod weave;

pub use stack::{Eye, Lights, Stack};
