//! Everything that touches a file: formats, one file each, and the scene they are read into.
//!
//! Colours are converted to the scene's working space here, at the border, and nowhere else.

mod disk;
mod error;
pub mod formats;
pub mod scene;

pub use disk::{atomic_write, check_writable, list_folder, make_folder, read_bounded, spare};
pub use error::{Error, Place, Position, nearest};
pub use scene::Scene;
