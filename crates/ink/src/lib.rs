//! Ink painting.
pub mod canvas;
pub mod contour;
pub mod control;
mod error;
pub mod footprint;
pub mod painter;
pub mod paper;
pub mod pigment;
pub mod projection;
pub mod resolve;
pub mod select;
pub mod stamp;
pub mod stroke;
pub mod topology;
pub mod visibility;
pub use error::InkError;
