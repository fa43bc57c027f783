//! The stage on the software GPU, with the default limits of WebGPU and not one more.

mod cloth;
mod denoise;
mod device;
mod display;
mod frames;
mod free_lights;
mod poses;
mod preview;
mod rays;

use glam::Mat4;
use yugen_scene::{Camera, Film, Filter, Projection};

/// A pinhole camera of .8 radians across, of so many pixels.
pub fn camera(to_world: Mat4, [width, height]: [u32; 2]) -> Camera {
    Camera {
        name: "test".into(),
        to_world,
        projection: Projection::pinhole(0.8),
        near_far: [0.01, 100.0],
        film: Film { width, height, crop: None, filter: Filter::Box },
        samples_per_pixel: 1,
    }
}
