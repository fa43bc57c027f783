//! A camera as shaders take it: rays for compute, a matrix for the rasteriser.

use crate::StageError;
use crate::guide::Frames;
use crate::reconstruction::{FrameSample, Reconstruction};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat4, DVec4, Mat4};
use yugen_scene::{Camera, Projection};

/// The camera in WGSL: rays through pixels.
pub const VIEW_WGSL: &str = include_str!("view.wgsl");

/// `View` of view.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ViewRow {
    to_world: [[f32; 4]; 3],
    to_clip: [[f32; 4]; 4],
    window: [u32; 4],
    scale: [f32; 2],
    shift: [f32; 2],
    offset: [f32; 2],
    lens: [f32; 2],
    near: f32,
    far: f32,
    aperture_radius: f32,
    focus_distance: f32,
    orthographic: u32,
    index: u32,
    seed: u32,
    weight: f32,
    u: [f32; 2],
    per_pixel: u32,
    pub(crate) per_weight: f32,
    half: u32,
    pub(crate) deviation_weight: f32,
    unused: [u32; 2],
    filter_offsets: [f32; 260],
}

impl ViewRow {
    /// Of a frame that comes after others and belongs to this half of all.
    pub(crate) fn after(self, before: &Frames, half: usize) -> Self {
        let [per_weight, deviation_weight] =
            [before.per_weight(), before.deviation_weight()].map(|v| v as f32);
        Self { per_weight, deviation_weight, half: half as u32, ..self }
    }
}

/// A camera that can be looked through.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    row: ViewRow,
    to_camera: DAffine3,
}

impl View {
    /// Checks the camera.
    pub fn new(camera: &Camera) -> Result<Self, StageError> {
        let bad = |reason| StageError::Camera { name: camera.name.clone(), reason };
        let (width, height) = (camera.film.width, camera.film.height);
        if width == 0 || height == 0 {
            return Err(bad("its picture has no pixels"));
        }
        let window = camera.film.crop.unwrap_or([0, 0, width, height]);
        let inside = |from: u32, count: u32, all: u32| from.checked_add(count).is_some_and(|end| end <= all);
        if !inside(window[0], window[2], width) || !inside(window[1], window[3], height) {
            return Err(bad("its crop reaches beyond its picture"));
        }
        let to_camera = DAffine3::from_mat4(camera.to_world.as_dmat4()).inverse();
        if !camera.to_world.is_finite() || !to_camera.is_finite() {
            return Err(bad("its matrix cannot be inverted"));
        }
        let [near, far] = camera.near_far;
        if near.is_nan() || near < 0.0 || far.is_nan() || far <= near {
            return Err(bad("what it sees must begin at zero or beyond and end farther away"));
        }
        // Half a picture across and down, at distance one.
        let (half, centre, aperture_radius, focus_distance) = match camera.projection {
            Projection::Perspective { fov_x, aperture_radius, focus_distance, principal_point, .. } => {
                ((0.5 * fov_x).tan(), principal_point, aperture_radius, focus_distance)
            }
            Projection::Orthographic => (1.0, glam::Vec2::ZERO, 0.0, 1.0),
        };
        if !(half > 0.0 && half.is_finite() && centre.is_finite()) {
            return Err(bad("its field of view must be above 0 and below 180 degrees"));
        }
        let half_height = f64::from(half) * f64::from(height) / f64::from(width);
        let m = camera.to_world;
        let row = ViewRow {
            to_world: [m.row(0).into(), m.row(1).into(), m.row(2).into()],
            to_clip: [[0.0; 4]; 4],
            window,
            // +x is to the left, so the picture's x runs against it.
            scale: [-2.0 * half / width as f32, (-2.0 * half_height / f64::from(height)) as f32],
            shift: [(1.0 + 2.0 * centre.x) * half, ((1.0 + 2.0 * f64::from(centre.y)) * half_height) as f32],
            offset: [0.0; 2],
            lens: [0.5; 2],
            near,
            // Rays must not end at infinity.
            far: far.min(1e30),
            aperture_radius,
            focus_distance,
            orthographic: u32::from(camera.projection == Projection::Orthographic),
            index: 0,
            seed: 0,
            weight: 1.0,
            u: [0.5; 2],
            per_pixel: 0,
            per_weight: 0.0,
            half: 0,
            deviation_weight: 0.0,
            unused: [0; 2],
            filter_offsets: [0.0; 260],
        };
        Ok(Self { row, to_camera })
    }

    /// x, y, width and height of the part of the picture that is shown.
    pub fn window(&self) -> [u32; 4] {
        self.row.window
    }

    /// No pinhole: pixels must be traced, not rastered.
    pub fn has_lens(&self) -> bool {
        self.row.aperture_radius > 0.0
    }

    /// World to the raster, columns, of pixels that are looked at in their centres.
    pub(crate) fn to_clip_of_centres(&self) -> [[f32; 4]; 4] {
        let centre = FrameSample {
            offset: glam::Vec2::ZERO,
            lens: glam::Vec2::splat(0.5),
            weight: 1.0,
            u: glam::Vec2::splat(0.5),
        };
        self.to_clip(&centre).to_cols_array_2d()
    }

    /// Where it looks from, the width of a pixel at distance one, and whether that is the width of all: its rays are
    /// parallel.
    pub(crate) fn footprint(&self) -> (glam::Vec3, f32, bool) {
        let r = &self.row;
        let eye = glam::Vec3::from(r.to_world.map(|row| row[3]));
        let parallel = r.orthographic != 0;
        let across = glam::Vec3::from(r.to_world.map(|row| row[0])).length();
        (eye, r.scale[0].abs() * if parallel { across } else { 1.0 }, parallel)
    }

    /// Frame `index` of the picture, which looks where `sample` says; with `per_pixel` every pixel elsewhere, by the
    /// filter that they are of.
    pub fn row(
        &self,
        index: u32,
        seed: u32,
        sample: &FrameSample,
        per_pixel: Option<&Reconstruction>,
    ) -> ViewRow {
        let mut row = self.row;
        row.offset = sample.offset.into();
        row.lens = sample.lens.into();
        (row.index, row.seed, row.weight) = (index, seed, sample.weight);
        if let Some(reconstruction) = per_pixel {
            (row.per_pixel, row.u) = (1, sample.u.into());
            for (offset, own) in row.filter_offsets.iter_mut().zip(reconstruction.offsets()) {
                *offset = *own;
            }
        }
        row.to_clip = self.to_clip(sample).to_cols_array_2d();
        row
    }

    /// World to the raster: depth 1 at the near plane, 0 at the far one, which leaves floats their digits.
    fn to_clip(&self, sample: &FrameSample) -> Mat4 {
        let r = &self.row;
        // From (x, y) at distance one to −1 .. 1 across the window.
        let along = |axis: usize| {
            let size = f64::from(r.window[2 + axis]);
            let first = f64::from(r.window[axis]) + f64::from(sample.offset[axis]);
            let scale = 1.0 / f64::from(r.scale[axis]);
            let sign = if axis == 0 { 1.0 } else { -1.0 };
            let slope = sign * 2.0 * scale / size;
            let at_zero = sign * (2.0 * (-f64::from(r.shift[axis]) * scale - first) / size - 1.0);
            (slope, at_zero)
        };
        let ((sx, tx), (sy, ty)) = (along(0), along(1));
        let far = f64::from(r.far);
        let clip = if r.orthographic != 0 {
            let depth = 1.0 / (far - f64::from(r.near));
            DMat4::from_cols(
                DVec4::new(sx, 0.0, 0.0, 0.0),
                DVec4::new(0.0, sy, 0.0, 0.0),
                DVec4::new(0.0, 0.0, -depth, 0.0),
                DVec4::new(tx, ty, far * depth, 1.0),
            )
        } else {
            // A raster must begin in front of the eye.
            let near = f64::from(r.near).max(1e-7 * far.min(1e3));
            let depth = near / (far - near);
            DMat4::from_cols(
                DVec4::new(sx, 0.0, 0.0, 0.0),
                DVec4::new(0.0, sy, 0.0, 0.0),
                DVec4::new(tx, ty, -depth, 1.0),
                DVec4::new(0.0, 0.0, far * depth, 0.0),
            )
        };
        (clip * DMat4::from(self.to_camera)).as_mat4()
    }
}
