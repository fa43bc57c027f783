//! Pictures of surfaces that are known exactly, and of figures that move.

mod contours;
mod robe;
mod surfaces;
mod through_time;
mod torus;
mod truth;
