//! Everything that touches a file: formats, one file each, and the scene they are read into.
//!
//! Colours are converted to the scene's working space here, at the border, and nowhere else.

// Tests look at files as they like.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod disk;
mod error;
pub mod formats;
mod ledger;

pub use disk::{
    atomic_write, atomic_write_with, begin_own, check_writable, list_folder, make_folder, open, read_bounded,
    read_filled, read_own, update,
};
pub use error::{Error, Place, Position};
pub use ledger::{check_new, check_outputs, protect_inputs, will_read};
