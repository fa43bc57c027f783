//! The window: a scene under its lights, turned by hand, at one key the reference beside it, at another painted in ink.
//!
//! | part | what is in it |
//! | --- | --- |
//! | [`action`] | everything that can be done, in one table |
//! | [`state`], [`eye`], [`edit`], [`live`], [`ink`], [`mask`] | what is shown and how, from where, what was changed, and by which brush; no window |
//! | [`ui`] | panels and overlays (egui); says what is to be done and does nothing |
//! | `maker`, [`reference`], `painting` | threads that prepare scenes, trace paths and paint |
//! | `window` | the loop of events: winit, a surface, the stage |
//!
//! It opens no files: whoever calls [`run`] does that for it ([`Files`]).

pub mod action;
pub mod command;
pub mod edit;
mod error;
pub mod eye;
mod files;
pub mod ink;
pub mod language;
pub mod live;
mod mailbox;
mod maker;
pub mod mask;
mod painting;
mod picture;
pub mod reference;
pub mod state;
pub mod ui;
mod window;

pub use error::ViewError;
pub use files::{Files, InkReport, Loaded, Picture, Report};
pub use window::{Options, run};
