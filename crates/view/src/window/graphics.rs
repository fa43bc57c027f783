//! The window's surface, and the device that stage and controls share.

use crate::error::ViewError;
use crate::picture::{Shown, film_of};
use crate::state::State;
use crate::ui::{Asked, set_look};
use crate::window::Wake;
use egui::{FullOutput, TextureId, Ui, ViewportId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use wgpu::{CurrentSurfaceTexture, Device, Queue, TextureFormat};
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::Window;
use yugen_ink::signature::Font;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::tonemap::Curve;
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::display::DisplaySettings;
use yugen_realtime::film::Film;
use yugen_realtime::{Gpu, Stage, StageError, Target};
use yugen_scene::Camera;

/// A window with a device.
pub struct Graphics {
    pub window: Arc<Window>,
    pub adapter: String,
    pub surface_name: String,
    /// Primaries of the display.
    pub display: ColourSpace,
    pub stage: Option<Stage>,
    /// A file that the window goes into, after so many more times that it is painted: what was just opened is first laid out.
    pub wants_window: Option<(PathBuf, u32)>,
    gpu: Gpu,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    egui: egui_winit::State,
    renderer: Renderer,
    output: Option<FullOutput>,
    realtime: Option<Shown>,
    reference: Option<(Film, Shown)>,
    ink: Option<(Film, Shown)>,
    literal: Option<(Film, Shown)>,
    flight: Option<(Arc<AtomicBool>, Instant)>,
    refused: Arc<Mutex<Option<String>>>,
    repaint_at: Option<Instant>,
    size: [u32; 2],
}

/// Format and colour space of a surface. egui mixes encoded numbers as they are, eight bits each, so formats that take them come
/// first; of these one whose display has the primaries of P3, else what every display has. A display of P3 shows egui's own
/// colours, meant for sRGB, a little more vivid.
fn best(offered: &wgpu::SurfaceCapabilities) -> Option<(TextureFormat, wgpu::SurfaceColorSpace)> {
    use wgpu::{SurfaceColorSpace, SurfaceColorSpaces};
    let plain = |f: TextureFormat| matches!(f, TextureFormat::Bgra8Unorm | TextureFormat::Rgba8Unorm);
    let of = |space: SurfaceColorSpaces| {
        let mut formats = offered.format_capabilities.iter();
        formats.find(|f| plain(f.format) && f.color_spaces.contains(space)).map(|f| f.format)
    };
    let p3 = of(SurfaceColorSpaces::DISPLAY_P3).map(|f| (f, SurfaceColorSpace::DisplayP3));
    let srgb = || of(SurfaceColorSpaces::SRGB).map(|f| (f, SurfaceColorSpace::Srgb));
    let first = || offered.formats.first().map(|f| (*f, SurfaceColorSpace::Auto));
    p3.or_else(srgb).or_else(first)
}

impl Graphics {
    /// Opens a window of `size` pixels.
    pub fn new(
        event_loop: &ActiveEventLoop,
        proxy: &EventLoopProxy<Wake>,
        size: [u32; 2],
        font: Option<&Font>,
    ) -> Result<Self, ViewError> {
        // Those who hear the window want to know it before it is seen.
        let attributes = Window::default_attributes()
            .with_title("Yugen")
            .with_inner_size(PhysicalSize::new(size[0], size[1]))
            .with_visible(false);
        let no_window = |e: &dyn std::fmt::Display| ViewError::NoWindow(e.to_string());
        let window = Arc::new(event_loop.create_window(attributes).map_err(|e| no_window(&e))?);
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()))
        });
        // Without a driver there is nothing that could draw on any window.
        let surface = instance.create_surface(window.clone()).map_err(|e| {
            tracing::debug!("no surface: {e}");
            StageError::NoAdapter
        })?;
        let gpu = pollster::block_on(Gpu::on(&instance, Some(&surface)))?;
        let refused = Arc::new(Mutex::new(None));
        let note = refused.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e.to_string());
        }));
        let capabilities = surface.get_capabilities(&gpu.adapter);
        let (format, color_space) =
            best(&capabilities).ok_or_else(|| ViewError::NoSurface(gpu.name.clone()))?;
        let display = match color_space {
            wgpu::SurfaceColorSpace::DisplayP3 => ColourSpace::LinearP3,
            _ => ColourSpace::LinearSrgb,
        };
        let PhysicalSize { width, height } = window.inner_size();
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            width: width.max(1),
            height: height.max(1),
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 1,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
            color_space,
        };
        surface.configure(&gpu.device, &config);
        let context = egui::Context::default();
        set_look(&context, font);
        let most = gpu.device.limits().max_texture_dimension_2d as usize;
        let mut egui = egui_winit::State::new(
            context,
            ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            None,
            Some(most),
        );
        egui.init_accesskit(event_loop, &window, proxy.clone());
        window.set_visible(true);
        let options = RendererOptions { dithering: false, ..RendererOptions::default() };
        let renderer = Renderer::new(&gpu.device, format, options);
        let offered: Vec<String> = capabilities
            .format_capabilities
            .iter()
            .filter(|c| c.format == format)
            .map(|c| format!("{:?}", c.color_spaces))
            .collect();
        tracing::debug!("colour spaces of {format:?}: {}", offered.join(", "));
        Ok(Self {
            adapter: gpu.name.clone(),
            surface_name: format!("{}, {format:?}", display.name()),
            display,
            stage: None,
            wants_window: None,
            surface,
            config,
            egui,
            renderer,
            output: None,
            realtime: None,
            reference: None,
            ink: None,
            literal: None,
            flight: None,
            refused,
            repaint_at: None,
            size: [width, height],
            gpu,
            window,
        })
    }

    /// How pictures are shown.
    pub fn settings(&self, state: &State) -> DisplaySettings {
        DisplaySettings {
            space: state.scene.working_space,
            display: self.display,
            exposure: state.exposure,
            curve: state.curve,
            origin: [0, 0],
        }
    }

    pub fn device(&self) -> &Device {
        &self.gpu.device
    }

    pub fn queue(&self) -> &Queue {
        &self.gpu.queue
    }

    pub fn pixels_per_point(&self) -> f32 {
        self.egui.egui_ctx().pixels_per_point()
    }

    /// There is something to draw on: the window is not minimised.
    pub fn visible(&self) -> bool {
        self.size.iter().all(|s| *s > 0)
    }

    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        if self.visible() {
            let most = self.device().limits().max_texture_dimension_2d;
            (self.config.width, self.config.height) = (size[0].min(most), size[1].min(most));
            self.surface.configure(&self.gpu.device, &self.config);
        }
    }

    pub fn set_title(&self, file: &Path) {
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        self.window.set_title(&format!("{name} — Yugen"));
    }

    /// Whether it wants to be painted anew for that.
    pub fn on_event(&mut self, event: &WindowEvent) -> bool {
        self.egui.on_window_event(&self.window, event).repaint
    }

    pub fn on_access(&mut self, event: egui_winit::accesskit_winit::Event) {
        use egui_winit::accesskit_winit::WindowEvent as Access;
        match event.window_event {
            Access::InitialTreeRequested => self.egui.egui_ctx().enable_accesskit(),
            Access::ActionRequested(request) => self.egui.on_accesskit_action_request(request),
            Access::AccessibilityDeactivated => self.egui.egui_ctx().disable_accesskit(),
        }
    }

    /// What the device refused, which nobody else asked about.
    pub fn refused(&self) -> Option<String> {
        self.refused.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    pub fn set_stage(&mut self, stage: Stage) {
        if let Some(film) = stage.shown() {
            match &mut self.realtime {
                Some(shown) => shown.set_film(&self.gpu.device, &mut self.renderer, film),
                None => self.realtime = Some(Shown::new(&self.gpu.device, &mut self.renderer, film)),
            }
        }
        self.stage = Some(stage);
    }

    /// Adds a frame; returns how many the picture then has.
    pub fn frame(&mut self, camera: &Camera, settings: DisplaySettings) -> Result<u32, StageError> {
        let (Some(stage), Some(shown)) = (&mut self.stage, &mut self.realtime) else { return Ok(0) };
        stage.resize([camera.film.width, camera.film.height])?;
        if let Some(film) = stage.shown()
            && film.size() != shown.size()
        {
            shown.set_film(&self.gpu.device, &mut self.renderer, film);
        }
        let target = Target { pass: shown.pass(), view: shown.view(), settings };
        let frames = stage.frame_on(camera, Some(&target))?;
        let done = Arc::new(AtomicBool::new(false));
        self.flight = Some((done.clone(), Instant::now()));
        self.gpu.queue.on_submitted_work_done(move || done.store(true, Ordering::Release));
        Ok(frames)
    }

    /// Shows the picture as it stands.
    pub fn show(&mut self, settings: DisplaySettings) -> Result<(), StageError> {
        let (Some(stage), Some(shown)) = (&self.stage, &self.realtime) else { return Ok(()) };
        stage.show(&Target { pass: shown.pass(), view: shown.view(), settings })
    }

    /// A frame is being made.
    pub fn in_flight(&self) -> bool {
        self.flight.is_some()
    }

    /// How many milliseconds the frame took that has been made since this was last asked.
    pub fn landed(&mut self) -> Option<f64> {
        let (done, begun) = self.flight.as_ref()?;
        // A device that is lost says so when it is next given work.
        let lost = self.gpu.device.poll(wgpu::PollType::Poll).is_err();
        let took = (done.load(Ordering::Acquire) || lost).then(|| 1e3 * begun.elapsed().as_secs_f64())?;
        self.flight = None;
        Some(took)
    }

    pub fn passes(&self) -> Vec<(String, f64)> {
        let timings = self.stage.iter().flat_map(|s| s.timings());
        timings.map(|t| (t.pass.to_string(), t.milliseconds)).collect()
    }

    pub fn realtime(&self) -> Option<TextureId> {
        self.realtime.as_ref().map(|s| s.id)
    }

    pub fn reference(&self) -> Option<TextureId> {
        self.reference.as_ref().map(|(_, s)| s.id)
    }

    pub fn set_reference(&mut self, image: &Image) {
        let before = self.reference.take();
        self.reference = Some(self.film(image, before));
    }

    pub fn ink(&self) -> Option<TextureId> {
        self.ink.as_ref().map(|(_, s)| s.id)
    }

    pub fn literal(&self) -> Option<TextureId> {
        self.literal.as_ref().map(|(_, s)| s.id)
    }

    pub fn set_ink(&mut self, image: &Image) {
        let before = self.ink.take();
        self.ink = Some(self.painting(image, before));
    }

    pub fn set_literal(&mut self, image: &Image) {
        let before = self.literal.take();
        self.literal = Some(self.painting(image, before));
    }

    /// A painting, to be shown where another was before: its colours are those of the display.
    fn painting(&mut self, image: &Image, before: Option<(Film, Shown)>) -> (Film, Shown) {
        let (film, shown) = self.film(image, before);
        let settings = DisplaySettings {
            space: ColourSpace::LinearSrgb,
            display: self.display,
            exposure: 0.0,
            curve: Curve::Clip,
            origin: [0, 0],
        };
        shown.show(&self.gpu.device, &self.gpu.queue, &settings);
        (film, shown)
    }

    /// A picture, to be shown where another was before.
    fn film(&mut self, image: &Image, before: Option<(Film, Shown)>) -> (Film, Shown) {
        let film = film_of(&self.gpu.device, &self.gpu.queue, image);
        let shown = match before {
            Some((_, mut shown)) => {
                shown.set_film(&self.gpu.device, &mut self.renderer, &film);
                shown
            }
            None => Shown::new(&self.gpu.device, &mut self.renderer, &film),
        };
        (film, shown)
    }

    pub fn show_reference(&self, settings: DisplaySettings) {
        if let Some((_, shown)) = &self.reference {
            shown.show(&self.gpu.device, &self.gpu.queue, &settings);
        }
    }

    /// Lays the controls out.
    pub fn run_ui(&mut self, mut show: impl FnMut(&mut Ui) -> Asked) -> Asked {
        let input = self.egui.take_egui_input(&self.window);
        let mut asked = Asked::default();
        // It may be laid out twice; what was asked is asked once.
        let output = self.egui.egui_ctx().clone().run_ui(input, |ui| {
            let again = show(ui);
            if asked.commands.is_empty() {
                asked = again;
            } else {
                asked.picture = again.picture;
            }
        });
        let wait = output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |v| v.repaint_delay);
        self.repaint_at = Instant::now().checked_add(wait).filter(|_| wait < Duration::from_secs(3600));
        if let Some(before) = self.output.take() {
            // It was never painted, but its textures are wanted.
            self.textures(before.textures_delta);
        }
        self.output = Some(output);
        asked
    }

    pub fn repaint_at(&self) -> Option<Instant> {
        self.repaint_at
    }

    fn textures(&mut self, delta: egui::TexturesDelta) {
        for (id, images) in &delta.set {
            for image in images {
                self.renderer.update_texture(&self.gpu.device, &self.gpu.queue, *id, image);
            }
        }
        for id in &delta.free {
            self.renderer.free_texture(id);
        }
    }

    /// Paints the controls; the window as a picture, where it was wanted.
    pub fn paint(&mut self) -> Result<Option<(PathBuf, Image)>, ViewError> {
        let Some(mut output) = self.output.take() else { return Ok(None) };
        self.egui.handle_platform_output(&self.window, output.platform_output);
        let free = std::mem::take(&mut output.textures_delta.free);
        self.textures(output.textures_delta);
        let points = output.pixels_per_point;
        let jobs = self.egui.egui_ctx().tessellate(output.shapes, points);
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) | CurrentSurfaceTexture::Suboptimal(frame) => Some(frame),
            CurrentSurfaceTexture::Lost => {
                return Err(StageError::Lost("its surface is gone".into()).into());
            }
            CurrentSurfaceTexture::Outdated => {
                self.surface.configure(&self.gpu.device, &self.config);
                self.window.request_redraw();
                None
            }
            // Behind another window, or too busy: another time.
            _ => None,
        };
        let screen = ScreenDescriptor {
            size_in_pixels: [self.config.width, self.config.height],
            pixels_per_point: points,
        };
        let wanted = match &mut self.wants_window {
            Some((_, left @ 1..)) => {
                *left -= 1;
                self.window.request_redraw();
                None
            }
            wanted => wanted.take(),
        };
        let copy = wanted.map(|(file, _)| (file, self.own_target()));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut commands =
            self.renderer.update_buffers(&self.gpu.device, &self.gpu.queue, &mut encoder, &jobs, &screen);
        let own = copy.iter().map(|(_, texture)| texture.create_view(&Default::default()));
        let shown = frame.iter().map(|f| f.texture.create_view(&Default::default()));
        for view in shown.chain(own) {
            let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("controls"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            });
            self.renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        }
        commands.push(encoder.finish());
        self.gpu.queue.submit(commands);
        if let Some(frame) = frame {
            self.window.pre_present_notify();
            self.gpu.queue.present(frame);
        }
        free.iter().for_each(|id| self.renderer.free_texture(id));
        copy.map(|(file, texture)| Ok((file, self.read(&texture)?))).transpose()
    }

    fn own_target(&self) -> wgpu::Texture {
        self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("window"),
            size: wgpu::Extent3d {
                width: self.config.width,
                height: self.config.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.config.format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// Waits for the device; linear sRGB.
    fn read(&self, texture: &wgpu::Texture) -> Result<Image, StageError> {
        let (w, h) = (texture.width(), texture.height());
        let row = (4 * w).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("window"),
            size: u64::from(row) * u64::from(h),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        self.gpu.queue.submit([encoder.finish()]);
        let lost = |e: &dyn std::fmt::Display| StageError::Lost(e.to_string());
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.gpu.device.poll(wait).map_err(|e| lost(&e))?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| lost(&e))?;
        let swapped = matches!(self.config.format.remove_srgb_suffix(), TextureFormat::Bgra8Unorm);
        let to_srgb = self.display.matrix_to(ColourSpace::LinearSrgb);
        let mut image = Image::rgb(w as usize, h as usize);
        let rows = bytes.chunks_exact(row as usize);
        for (line, to) in rows.zip(image.data.chunks_exact_mut(3 * w as usize)) {
            for (from, to) in line.chunks_exact(4).zip(to.chunks_exact_mut(3)) {
                let rgb = if swapped { [from[2], from[1], from[0]] } else { [from[0], from[1], from[2]] };
                let light = rgb.map(|v| srgb_to_linear(f32::from(v) / 255.0));
                to.copy_from_slice(&(to_srgb * Vec3::from_array(light)).to_array());
            }
        }
        Ok(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::{SurfaceCapabilities, SurfaceColorSpace, SurfaceColorSpaces, SurfaceFormatCapabilities};

    #[test]
    fn a_display_of_p3_is_taken_where_it_takes_plain_numbers() {
        let of = |offered: &[(TextureFormat, SurfaceColorSpaces)]| {
            let of = |(format, color_spaces): &(_, _)| SurfaceFormatCapabilities {
                format: *format,
                color_spaces: *color_spaces,
            };
            best(&SurfaceCapabilities {
                formats: offered.iter().map(|(f, _)| *f).collect(),
                format_capabilities: offered.iter().map(of).collect(),
                ..Default::default()
            })
        };
        let [srgb, p3] = [SurfaceColorSpaces::SRGB, SurfaceColorSpaces::DISPLAY_P3];
        let encoding = (TextureFormat::Bgra8UnormSrgb, srgb | p3);
        let wide = (TextureFormat::Rgba16Float, SurfaceColorSpaces::EXTENDED_SRGB_LINEAR | p3);
        let plain = TextureFormat::Rgba8Unorm;
        assert_eq!(of(&[encoding, wide, (plain, srgb)]), Some((plain, SurfaceColorSpace::Srgb)));
        assert_eq!(of(&[encoding, wide, (plain, srgb | p3)]), Some((plain, SurfaceColorSpace::DisplayP3)));
        assert_eq!(of(&[encoding]), Some((encoding.0, SurfaceColorSpace::Auto)));
        assert_eq!(of(&[]), None);
    }
}
