//! Everything that touches a file: formats, one file each, and the scene they are read into.
//!
//! Colours are converted to the scene's working space here, at the border, and nowhere else.

pub mod scene;

pub use scene::Scene;
