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
//! # Shaders
//!
//! Shaders are pieces of WGSL, joined as text; each piece is a file beside the Rust that knows its layout.
//!
//! | piece | group | what is in it |
//! | --- | --- | --- |
//! | `scene.wgsl` | 0 | the rows of [`yugen_scene::prepared`] and the hierarchy: seven storage buffers, read only |
//! | `hierarchy.wgsl` | | `trace_closest`, `trace_any`, `intersect_triangle`; needs a `passes` |
//! | `opaque.wgsl` | | a `passes` for shaders without materials |
//! | `surface.wgsl` | | `surface_at`: position, normals, frame, texture coordinates; `offset_origin` |
//! | `see_through.wgsl` | | a `passes` for shaders with materials; `shading_point` |
//! | `view.wgsl` | 1, binding 0 | the camera: `pixel_ray` |
//! | `visibility.wgsl` | 1, binding 1 | the visibility buffer: `visible_hit`, and `camera_hit` past lights that are hidden |
//! | `primary.wgsl` | | `primary_hit`: past what lets all light pass, too |
//! | `shade.wgsl` | 1, binding 2 | the words of the pass `free_lights.wgsl`: lights that nothing stands in the way of |
//! | `film.wgsl` | 2 | the sums that a pass adds to: `film_add`, `film_sum` |
//! | `flames.wgsl` | 3 | volumes along a ray: `flames_along` |
//! | `samples.wgsl` | | `pixel_number`, `sample2`: numbers of a pixel |
//! | `shade.wgsl`, `paper.wgsl` | | the picture, and how Wakita et al. light it |
//! | `aov.wgsl`, `aov_material.wgsl`, `aov_plain.wgsl` | | what is known of the first surface |
//! | `visibility_rastered.wgsl`, `visibility_traced.wgsl` | | what fills the visibility buffer |
//! | `guide.wgsl` | | what a denoiser is told |
//! | `gbuffer.wgsl`, `preview.wgsl` | | what is shown while the sum is young |
//! | `display.wgsl` | | exposure, gamut and curve |
//! | `cloth/cloth.wgsl` | 0, its own | a step of a cloth ([`ClothPass`]) |
//! | `cloth/drape.wgsl` | 0, its own | a mesh where a cloth is, and the boxes around it ([`Stage::drape`]) |
//!
//! # How to add a pass
//!
//! `x.rs` beside `x.wgsl`: a struct that is made once, with its pipeline and its film, and a `record` that dispatches it
//! (`aov.rs` is a short one); then a field of [`Stage`] and a line in [`Stage::frame`]. Group 3 is free for it; beside the
//! scene and a film there is no room for another storage buffer.
//!
//! # What is approximated so far
//!
//! Spheres, discs and cylinders are meshes (off by 3e-4 of the radius). The rasteriser rounds vertices to 1/256 of a
//! pixel, which decides single pixels at outlines; [`Options::trace_camera`] does not. Meshes that their matrix flattens
//! are seen, but rays do not meet them. A crop's outermost pixels are filtered with what lies beyond it. Volumes light
//! surfaces as a few Gaussian lights, softened within a hand's breadth; they do not dim the light of others, and are seen by the
//! eye and in mirrors only.

pub mod aov;
pub mod cloth;
pub mod device;
pub mod display;
mod error;
pub mod film;
mod flames;
mod frame;
mod free_lights;
mod guide;
pub mod hierarchy;
mod paper;
mod pipelines;
pub mod preview;
pub mod reconstruction;
pub mod scene;
pub mod shade;
pub mod surface;
pub mod timing;
pub mod view;
pub mod visibility;

pub use cloth::{ClothPass, ClothState};
pub use device::Gpu;
pub use error::StageError;
pub use frame::{Lighting, Options, Picked, Stage, Target};
pub use preview::Preview;
