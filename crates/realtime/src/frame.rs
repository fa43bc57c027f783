//! The stage: a scene on a device, and the passes that make a frame of it.

use crate::StageError;
use crate::aov::AovPass;
use crate::film::{Film, film_bytes};
use crate::reconstruction::Reconstruction;
use crate::scene::SceneBuffers;
use crate::shade::ShadePass;
use crate::timing::{PassTime, Timestamps};
use crate::view::{View, ViewRow};
use crate::visibility::{Visibility, primary_group, primary_layout};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Device, Queue};
use yugen_optics::Image;
use yugen_scene::prepared::{DrawRow, Rows};
use yugen_scene::{Aov, Camera, Filter};

/// What a stage is made for.
#[derive(Clone, Debug)]
pub struct Options {
    /// Pixels of the window across and down.
    pub size: [u32; 2],
    /// How samples become pixels.
    pub filter: Filter,
    /// Pictures beside the picture; those that this renderer has.
    pub aovs: Vec<Aov>,
    /// Trace what the camera sees even where it could be rastered: no vertex is then rounded to the raster.
    pub trace_camera: bool,
    /// Threads that build the hierarchy.
    pub threads: usize,
    /// Surfaces that reflect light on its way to the camera; `None`: no picture, only those beside it.
    pub bounces: Option<u32>,
    /// The camera does not see lights.
    pub hide_emitters: bool,
    /// Same seed, same picture.
    pub seed: u32,
}

/// A scene on a device, ready to be seen.
pub struct Stage {
    device: Device,
    queue: Queue,
    scene: SceneBuffers,
    view: wgpu::Buffer,
    visibility: Visibility,
    primary_layout: wgpu::BindGroupLayout,
    primary: wgpu::BindGroup,
    film_layout: wgpu::BindGroupLayout,
    shade: Option<ShadePass>,
    aovs: Vec<AovPass>,
    timestamps: Timestamps,
    reconstruction: Reconstruction,
    trace_camera: bool,
    seed: u32,
    size: [u32; 2],
    /// What the sums are of: the view, the frames and the sum of their weights.
    seen: Option<View>,
    index: u32,
    weight: f64,
    lost: Arc<Mutex<Option<String>>>,
}

impl Stage {
    /// Compiles every shader and makes room for everything; [`Stage::frame`] then does neither. Takes the device's
    /// callback for being lost.
    pub fn new(device: &Device, queue: &Queue, rows: &Rows, options: &Options) -> Result<Self, StageError> {
        check_size(device, options.size)?;
        let lost = Arc::new(Mutex::new(None));
        let note = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            *note.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{reason:?}: {message}"));
        });
        checked(device, || {
            let scene = SceneBuffers::new(device, rows, options.threads)?;
            let view = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view"),
                size: size_of::<ViewRow>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let visibility = Visibility::new(device, &scene, &view, options.size);
            let primary_layout = primary_layout(device);
            let primary = primary_group(device, &primary_layout, &view, visibility.ids());
            let film_layout = Film::layout(device);
            let shade = options.bounces.map(|bounces| {
                ShadePass::new(device, rows, &scene, &primary_layout, &film_layout, options, bounces)
            });
            let aovs = options
                .aovs
                .iter()
                .filter_map(|aov| {
                    AovPass::new(device, *aov, &scene, &primary_layout, &film_layout, options.size)
                })
                .collect();
            Ok(Self {
                device: device.clone(),
                queue: queue.clone(),
                scene,
                view,
                visibility,
                primary_layout,
                primary,
                film_layout,
                shade,
                aovs,
                timestamps: Timestamps::new(device, queue),
                reconstruction: Reconstruction::new(options.filter),
                trace_camera: options.trace_camera,
                seed: options.seed,
                size: options.size,
                seen: None,
                index: 0,
                weight: 0.0,
                lost,
            })
        })
    }

    /// Adds a frame to the picture that `camera` sees; begins a new picture where the camera or the scene has changed.
    /// Returns how many frames the picture then has.
    pub fn frame(&mut self, camera: &Camera) -> Result<u32, StageError> {
        self.check_alive()?;
        let view = View::new(camera)?;
        let [_, _, w, h] = view.window();
        if [w, h] != self.size {
            return Err(StageError::OtherSize { found: [w, h], stage: self.size });
        }
        if self.seen.as_ref() != Some(&view) {
            (self.index, self.weight) = (0, 0.0);
        }
        let sample = self.reconstruction.sample(self.index);
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view.row(self.index, self.seed, &sample)));

        self.timestamps.begin();
        let mut encoder = self.device.create_command_encoder(&Default::default());
        if self.trace_camera || view.has_lens() {
            self.visibility.trace(&mut encoder, &self.timestamps, &self.scene);
        } else {
            self.visibility.raster(&mut encoder, &self.timestamps);
        }
        if let Some(shade) = &self.shade {
            shade.record(&mut encoder, &self.timestamps, &self.scene, &self.primary, self.size);
        }
        for aov in &self.aovs {
            aov.record(&mut encoder, &self.timestamps, &self.scene, &self.primary, self.size);
        }
        let timed = self.timestamps.end(&mut encoder);
        self.queue.submit([encoder.finish()]);
        if timed {
            self.timestamps.fetch();
        }

        self.seen = Some(view);
        self.index = self.index.saturating_add(1);
        self.weight += f64::from(sample.weight);
        Ok(self.index)
    }

    /// Moves the draws, of which there must be as many as before.
    pub fn place(&mut self, draws: &[DrawRow]) -> Result<(), StageError> {
        self.seen = None;
        self.scene.place(&self.queue, draws)
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), StageError> {
        check_size(&self.device, size)?;
        self.check_alive()?;
        if size == self.size {
            return Ok(());
        }
        let device = self.device.clone();
        checked(&device, || {
            self.visibility.resize(&device, size);
            self.primary = primary_group(&device, &self.primary_layout, &self.view, self.visibility.ids());
            if let Some(shade) = &mut self.shade {
                shade.resize(&device, &self.film_layout, size);
            }
            for aov in &mut self.aovs {
                aov.resize(&device, &self.film_layout, size);
            }
            (self.size, self.seen) = (size, None);
            Ok(())
        })
    }

    /// Milliseconds of the passes of a recent frame; none where the device has no timestamps.
    pub fn timings(&self) -> &[PassTime] {
        self.timestamps.last()
    }

    /// The scene on the device.
    pub fn scene(&self) -> &SceneBuffers {
        &self.scene
    }

    /// Waits until the device has done what it was given.
    pub fn wait(&self) -> Result<(), StageError> {
        self.device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: None })
            .map_err(|e| StageError::Lost(e.to_string()))?;
        self.check_alive()
    }

    /// Waits for the device and fetches the picture (R, G, B, A) and those beside it, channels named as by the reference
    /// renderer.
    pub fn image(&self) -> Result<Image, StageError> {
        self.check_alive()?;
        let picture = self.shade.iter().map(|s| (&["R", "G", "B", "A"][..], s.film(), false));
        let beside = self.aovs.iter().map(|a| (a.aov().channels(), a.film(), a.aov() == Aov::Id));
        let films: Vec<_> = picture.chain(beside).collect();
        let names: Vec<&str> = films.iter().flat_map(|(names, ..)| names.iter().copied()).collect();
        let mut image = Image::new(self.size[0] as usize, self.size[1] as usize, &names);
        let mut first = 0;
        for (channels, film, numbers) in films {
            // Numbers of shapes have no mean.
            let scale = if numbers || self.weight == 0.0 { 1.0 } else { 1.0 / self.weight };
            let sums = film.read(&self.device, &self.queue)?;
            for (pixel, sum) in image.data.chunks_exact_mut(names.len()).zip(sums) {
                for (to, from) in pixel[first..first + channels.len()].iter_mut().zip(sum) {
                    *to = (f64::from(from) * scale) as f32;
                }
            }
            first += channels.len();
        }
        Ok(image)
    }

    fn check_alive(&self) -> Result<(), StageError> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(reason) => Err(StageError::Lost(reason.clone())),
            None => Ok(()),
        }
    }
}

/// Neither nothing nor more than the device takes.
fn check_size(device: &Device, size: [u32; 2]) -> Result<(), StageError> {
    let limits = device.limits();
    let [width, height] = size;
    let limit = limits.max_texture_dimension_2d;
    if width == 0 || height == 0 || width > limit || height > limit {
        return Err(StageError::Size { width, height, limit });
    }
    let (bytes, limit) =
        (film_bytes(size), limits.max_storage_buffer_binding_size.min(limits.max_buffer_size));
    if bytes > limit {
        return Err(StageError::TooLarge { what: "pixels", bytes, limit });
    }
    Ok(())
}

/// `make`, and what the device says against it.
fn checked<T>(device: &Device, make: impl FnOnce() -> Result<T, StageError>) -> Result<T, StageError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    // Where errors come at once, as on every native device, they are here now.
    for refused in [now_or_never(validation.pop()), now_or_never(memory.pop())] {
        if let Some(Some(e)) = refused {
            return Err(StageError::Refused(e.to_string()));
        }
    }
    made
}

/// What the future already has.
fn now_or_never<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    match std::pin::pin!(future).poll(&mut context) {
        std::task::Poll::Ready(value) => Some(value),
        std::task::Poll::Pending => None,
    }
}
