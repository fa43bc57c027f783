//! Textures that pictures are shown by.

use egui::TextureId;
use egui_wgpu::Renderer;
use wgpu::{Device, Queue, TextureFormat, TextureView};
use yugen_optics::Image;
use yugen_realtime::display::{DisplayPass, DisplaySettings};
use yugen_realtime::film::Film;

/// egui takes the numbers of sRGB as they are.
const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// A texture of the size of a film, and the pass that fills it.
pub struct Shown {
    pass: DisplayPass,
    view: TextureView,
    size: [u32; 2],
    /// For egui.
    pub id: TextureId,
}

impl Shown {
    /// Of this film.
    pub fn new(device: &Device, renderer: &mut Renderer, film: &Film) -> Self {
        let view = texture(device, film.size());
        let id = renderer.register_native_texture(device, &view, wgpu::FilterMode::Linear);
        Self { pass: DisplayPass::new(device, FORMAT, film), view, size: film.size(), id }
    }

    /// Of another film from now on.
    pub fn set_film(&mut self, device: &Device, renderer: &mut Renderer, film: &Film) {
        self.pass.set_film(device, film);
        if self.size != film.size() {
            self.view = texture(device, film.size());
            self.size = film.size();
            renderer.update_egui_texture_from_wgpu_texture(
                device,
                &self.view,
                wgpu::FilterMode::Linear,
                self.id,
            );
        }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The pass, for a stage.
    pub fn pass(&self) -> &DisplayPass {
        &self.pass
    }

    /// The texture, for a stage.
    pub fn view(&self) -> &TextureView {
        &self.view
    }

    /// Shows a film that no stage fills.
    pub fn show(&self, device: &Device, queue: &Queue, settings: &DisplaySettings) {
        let mut encoder = device.create_command_encoder(&Default::default());
        self.pass.record(queue, &mut encoder, None, &self.view, settings, 1.0);
        queue.submit([encoder.finish()]);
    }
}

fn texture(device: &Device, [width, height]: [u32; 2]) -> TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shown"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// A picture with channels R, G and B as a film.
pub fn film_of(device: &Device, queue: &Queue, image: &Image) -> Film {
    let film = Film::new(device, &Film::layout(device), [image.width as u32, image.height as u32]);
    let n = image.channels.len();
    let rows: Vec<[f32; 4]> = image.data.chunks_exact(n).map(|p| [p[0], p[1], p[2], 1.0]).collect();
    film.write(queue, &rows);
    film
}
