//! The reference renderer: an offline path tracer whose pictures others are checked against.
//!
//! [`render::Job`] takes a scene to a picture. Everything below it is a chapter of its own: [`accel`] and
//! [`geometry`] find what a ray meets, [`yugen_scene::prepared`] says what it is made of, [`lights`] where
//! light comes from, [`integrator`] follows it, [`sampler`] supplies the numbers and [`film`] gathers them; a [`checkpoint`] keeps
//! them for later.

pub mod accel;
pub mod camera;
pub mod checkpoint;
pub mod film;
pub mod geometry;
pub mod guide;
pub mod integrator;
pub mod lights;
pub mod render;
pub mod reuse;
pub mod sampler;
