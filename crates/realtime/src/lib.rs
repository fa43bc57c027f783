//! The real-time renderer. wgpu and WGSL, no engine.
//!
//! A frame ([`Stage::frame`]) starts from a visibility buffer: which triangle of which draw each pixel sees, and nothing
//! else. Everything after it is compute: the local geometry, what AOVs there are, and rays through two levels of boxes over
//! the very same rows ([`hierarchy`]). Each frame looks at another place in every pixel ([`reconstruction`]), and sums of
//! frames tend to the picture of the reference renderer as long as nothing moves.
//!
//! A [`Stage`] takes device and queue from outside, allocates and compiles nothing after it was made, and needs no more
//! than the default limits of WebGPU: shaders have at most eight storage buffers, seven of them those of the scene.
//!
//! Groups of every shader: 0 the scene (`scene.wgsl`), 1 the view and the visibility buffer (`view.wgsl`,
//! `primary.wgsl`), 2 what the pass writes (`film.wgsl`).

pub mod aov;
mod device;
mod error;
pub mod film;
mod frame;
pub mod hierarchy;
mod pipelines;
pub mod reconstruction;
pub mod scene;
pub mod shade;
pub mod surface;
pub mod timing;
pub mod view;
pub mod visibility;

pub use device::Gpu;
pub use error::StageError;
pub use frame::{Options, Stage};
