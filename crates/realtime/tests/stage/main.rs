//! The stage on the software GPU, with the default limits of WebGPU and not one more.

mod denoise;
mod device;
mod display;
mod frames;
mod poses;
mod preview;
mod rays;
