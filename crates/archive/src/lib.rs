//! Everything that touches a file: formats, one file each, and the scene they are read into.
//!
//! Colours are converted to the scene's working space here, at the border, and nowhere else.

mod atomic;
mod error;
pub mod formats;
pub mod scene;

pub use atomic::atomic_write;
pub use error::{Error, Place, Position, nearest};
pub use scene::Scene;
