//! Proof, not eyes: what a reflectance model or a picture must satisfy, measured.
//!
//! * [`report`] holds every law of a model against it: finite values, sampler against density (chi-square),
//!   weight = f cos / pdf, density, coverage, reciprocity, energy, rotation, and the published albedos where there
//!   are some. One row per law, for people.
//! * [`furnace`] and [`albedo`] are the deterministic directional albedo.
//! * [`image`] compares pictures: z-test per pixel with mean and variance references, relative MSE.
//! * `gpu` and `twins` (feature `gpu`) hold the WGSL twin of each model against its Rust.
//!
//! A harness takes any [`Subject`], so that every one of them can be shown a deliberately wrong model and
//! must find it out.

mod chi_square;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod image;
mod integrate;
mod laws;
mod parameters;
mod references;
mod report;
mod subject;
#[cfg(feature = "gpu")]
pub mod twins;

pub use chi_square::{ChiSquare, ChiSquareResult, chi_square};
pub use integrate::{Domain, Partition, Rule};
pub use laws::{
    Albedo, Finding, albedo, coverage, delta, energy, finite, furnace, reciprocity, rotation, sampling,
};
pub use parameters::{Parameters, example_data, parameter_sets};
pub use references::{Reference, references};
pub use report::{Effort, Family, Report, Row, check, report, report_with, reports};
pub use subject::Subject;
