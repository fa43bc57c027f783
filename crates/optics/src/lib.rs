//! Light and numbers: what every other room of Yugen stands on.
//!
//! Nothing here knows a reflectance model, a scene or a file. Vectors are `glam`'s; colours are linear
//! RGB triples in a named [`colour::ColourSpace`].

pub mod adaptation;
pub mod colour;
pub mod compare;
pub mod denoise;
pub mod distribution;
mod fingerprint;
pub mod flip;
pub mod frame;
pub mod image;
pub mod lanes;
pub mod linear;
pub mod parallel;
pub mod quadrature;
pub mod random;
pub mod special;
pub mod spectrum;
pub mod statistics;
pub mod tonemap;
pub mod warp;

pub use colour::ColourSpace;
pub use fingerprint::Fingerprint;
pub use frame::Frame;
pub use glam::{Affine2, Affine3A, Mat3, Mat4, UVec2, Vec2, Vec3, Vec3A};
pub use image::Image;
