//! A picture while frames add to it: sums of weighted samples, four floats a pixel.
//!
//! Where each frame looks is drawn from the film's reconstruction filter, the same for every pixel
//! ([`crate::reconstruction`]), so the sum over the sum of weights tends to the filtered picture. At the edges of a crop
//! samples from beyond it count too; the reference renderer has none there.

use crate::StageError;
use crate::device::map;
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::over_pixels;
use crate::scene::{SceneBuffers, bind_layout, scene_wgsl, storage_type};
use crate::surface::{OPAQUE_WGSL, SEE_THROUGH_WGSL, SURFACE_WGSL};
use crate::timing::Timestamps;
use crate::view::VIEW_WGSL;
use crate::visibility::VISIBILITY_WGSL;
use wgpu::{BufferUsages, Device, Queue, ShaderStages};
use yugen_scene::prepared::{Rows, wgsl};

/// `film_sum`, `film_add` and `film_set` in WGSL, on group 2. Needs a constant `FILM_HALVES`.
pub const FILM_WGSL: &str = include_str!("film.wgsl");

/// Planes behind the sums of a picture whose frames are also known in halves: see `film.wgsl`.
pub(crate) const HALVES_PLANES: u32 = 2;

/// What a shader starts from that adds to a film what pixels see of surfaces of the materials and under the lights of `rows`.
/// Needs constants `HIDE_EMITTERS` and `FILM_HALVES`.
pub(crate) fn shading_wgsl(rows: &Rows) -> String {
    film_pass_wgsl(&wgsl(rows), SEE_THROUGH_WGSL)
}

/// The same without materials: of surfaces that let nothing pass.
pub(crate) fn opaque_wgsl() -> String {
    film_pass_wgsl("", OPAQUE_WGSL)
}

fn film_pass_wgsl(materials: &str, passes: &str) -> String {
    let samples = include_str!("samples.wgsl");
    let scene = scene_wgsl();
    [&scene, materials, HIERARCHY_WGSL, SURFACE_WGSL, passes, VIEW_WGSL, VISIBILITY_WGSL, FILM_WGSL, samples]
        .join("\n")
}

/// The sums of one picture.
pub struct Film {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    size: [u32; 2],
    /// Further planes of pixels, behind the sums and the count of samples that were no numbers.
    more: u32,
}

/// Bytes of the sums of a picture and of the count of samples that were no numbers.
pub fn film_bytes(size: [u32; 2]) -> u64 {
    16 * (u64::from(size[0]) * u64::from(size[1]) + 1)
}

/// The same with so many further planes of pixels.
pub(crate) fn film_bytes_with(size: [u32; 2], more: u32) -> u64 {
    film_bytes(size) + u64::from(more) * (film_bytes(size) - 16)
}

impl Film {
    /// Group 2.
    pub fn layout(device: &Device) -> wgpu::BindGroupLayout {
        bind_layout(device, "film", ShaderStages::COMPUTE, [storage_type(false)].into_iter())
    }

    /// For `size` pixels, of which there is at least one.
    pub fn new(device: &Device, layout: &wgpu::BindGroupLayout, size: [u32; 2]) -> Self {
        Self::with(device, layout, size, 0)
    }

    /// With so many further planes of pixels, which a shader must begin by itself.
    pub(crate) fn with(device: &Device, layout: &wgpu::BindGroupLayout, size: [u32; 2], more: u32) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("film"),
            size: film_bytes_with(size, more),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("film"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        Self { buffer, group, size, more }
    }

    /// Group 2.
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The sums.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Puts a picture that was made elsewhere in their place, row after row; what is more than they hold is left out.
    pub fn write(&self, queue: &Queue, sums: &[[f32; 4]]) {
        let most = sums.len().min(self.size[0] as usize * self.size[1] as usize);
        queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&sums[..most]));
    }

    /// Forgets how many samples were no numbers: before a picture's first frame.
    pub(crate) fn begin(&self, queue: &Queue) {
        queue.write_buffer(&self.buffer, film_bytes(self.size) - 16, &[0; 16]);
    }

    /// Waits for the device and fetches the sums, row after row; warns where samples were no numbers, which are left out.
    pub fn read(&self, device: &Device, queue: &Queue) -> Result<Vec<[f32; 4]>, StageError> {
        let (sums, left_out) = self.read_and_count(device, queue)?;
        warn_of(left_out);
        Ok(sums)
    }

    /// [`Film::read`], and all further planes, each row after row.
    pub(crate) fn read_planes(
        &self,
        device: &Device,
        queue: &Queue,
    ) -> Result<Vec<Vec<[f32; 4]>>, StageError> {
        let bytes = read_buffer(device, queue, &self.buffer, film_bytes_with(self.size, self.more))?;
        let pixels = self.size[0] as usize * self.size[1] as usize;
        let (sums, behind) = bytes.split_at(16 * pixels);
        let (count, more) = behind.split_at(16);
        warn_of(left_out(count));
        let planes = std::iter::once(sums).chain(more.chunks_exact(16 * pixels));
        Ok(planes.map(bytemuck::pod_collect_to_vec).collect())
    }

    /// [`Film::read`], and at least how many samples were no numbers and are left out.
    pub fn read_and_count(&self, device: &Device, queue: &Queue) -> Result<(Vec<[f32; 4]>, u32), StageError> {
        let bytes = read_buffer(device, queue, &self.buffer, film_bytes(self.size))?;
        let (sums, count) = bytes.split_at(bytes.len() - 16);
        Ok((bytemuck::pod_collect_to_vec(sums), left_out(count)))
    }
}

/// Samples that were no numbers, of what is behind the sums.
fn left_out(count: &[u8]) -> u32 {
    bytemuck::pod_read_unaligned::<[f32; 4]>(count)[0] as u32
}

fn warn_of(left_out: u32) {
    if left_out > 0 {
        tracing::warn!(left_out, "samples that are no numbers are left out of the picture: at least so many");
    }
}

/// A compute pass over all pixels that adds to a picture of its own.
pub struct FilmPass {
    label: &'static str,
    pipeline: wgpu::ComputePipeline,
    film: Film,
}

impl FilmPass {
    /// `layout`: of the film; `size`: its pixels; `more`: its further planes. The pipeline's groups are the scene, view and ids, and the film.
    pub fn new(
        device: &Device,
        label: &'static str,
        pipeline: wgpu::ComputePipeline,
        layout: &wgpu::BindGroupLayout,
        size: [u32; 2],
        more: u32,
    ) -> Self {
        Self { label, pipeline, film: Film::with(device, layout, size, more) }
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, device: &Device, layout: &wgpu::BindGroupLayout, size: [u32; 2]) {
        self.film = Film::with(device, layout, size, self.film.more);
    }

    /// Its sums.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Adds this frame. `primary`: group 1; `more`: group 3, where the pipeline has one.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: &Timestamps,
        scene: &SceneBuffers,
        primary: &wgpu::BindGroup,
        more: Option<&wgpu::BindGroup>,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.label),
            timestamp_writes: timestamps.of_compute(self.label),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.group(), &[]);
        pass.set_bind_group(1, primary, &[]);
        pass.set_bind_group(2, self.film.group(), &[]);
        if more.is_some() {
            pass.set_bind_group(3, more, &[]);
        }
        over_pixels(&mut pass, self.film.size);
    }
}

/// Waits for the device and fetches the first `size` bytes of a buffer.
pub(crate) fn read_buffer(
    device: &Device,
    queue: &Queue,
    buffer: &wgpu::Buffer,
    size: u64,
) -> Result<Vec<u8>, StageError> {
    let copy = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("to read"),
        size,
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, size);
    queue.submit([encoder.finish()]);
    map(device, &copy)
}
