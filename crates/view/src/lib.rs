//! The window: a scene under its lights, turned by hand, and at one key the reference beside it.
//!
//! | part | what is in it |
//! | --- | --- |
//! | [`action`] | everything that can be done, in one table |
//! | [`state`], [`eye`], [`edit`] | what is shown and how, from where, and what was changed; no window |
//! | [`ui`] | panels and overlays (egui); says what is to be done and does nothing |
//! | `maker`, [`reference`] | threads that prepare scenes and trace paths |
//! | `window` | the loop of events: winit, a surface, the stage |
//!
//! It opens no files: whoever calls [`run`] does that for it ([`Files`]).

pub mod action;
pub mod edit;
mod error;
pub mod eye;
mod files;
pub mod language;
mod maker;
mod picture;
pub mod reference;
pub mod state;
pub mod ui;
mod window;

pub use error::ViewError;
pub use files::{Files, Picture, Report};
pub use window::{Options, run};
