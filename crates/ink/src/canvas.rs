//! The canvas on the GPU: stamps to loads of ink, loads to a picture.
//!
//! Every layer goes through the same two targets: stamps add to one what they have in common and raise the other to their
//! coverage (`splat.wgsl`), in any order; then dryness is applied once and the load is kept (`resolve.wgsl`). The picture
//! puts the layers over one another (`composite.wgsl`).

use crate::InkError;
use crate::brush::Bristles;
use crate::drying::Drying;
use crate::footprint::{EXTENT, Footprint, TEXELS, TRAIL, TRAIL_WAVES, VARIANTS, bristle_trail};
use crate::paper::{Paper, Sheet};
use crate::passes::{Binding, bytes_texture, group, one_layer, pass, pipeline};
use crate::pigment::{BANDS, Pigment, band_to_rgb, over};
use crate::resolve::Resolve;
use crate::stamp::Stamp;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::sync::Arc;
use wgpu::util::{BufferInitDescriptor, DeviceExt, TextureDataOrder};
use wgpu::{
    BlendComponent, BlendFactor, BlendOperation, BlendState, Device, Extent3d, Queue, TextureFormat,
    TextureUsages, TextureViewDimension,
};
use yugen_optics::Image;
use yugen_realtime::device::{checked, map};

/// How many layers there are.
pub const LAYERS: usize = 7;
/// How many of them are painted by brush, the first ones; the others are laid on.
pub const BRUSHED: usize = 5;

/// Layers of ink, in the order in which they are painted, light to dark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// Colour wash (ran).
    Wash,
    /// Wrinkles (cun).
    Wrinkle,
    /// Rubbing (ca).
    Rub,
    /// Contours (gou).
    Contour,
    /// Dots (dian).
    Dot,
    /// An inscription (ti).
    Inscription,
    /// A seal (yin).
    Seal,
}

impl Layer {
    /// All, in order.
    pub const ALL: [Self; LAYERS] =
        [Self::Wash, Self::Wrinkle, Self::Rub, Self::Contour, Self::Dot, Self::Inscription, Self::Seal];

    /// Part of the ink of a wet place that flows: a wash is mostly water, a line of thick ink keeps its edge.
    pub(crate) fn mobile(self) -> f32 {
        match self {
            Self::Wash => 0.9,
            Self::Wrinkle => 0.25,
            // A brush that was wiped off has no water that runs.
            Self::Rub => 0.0,
            // Laid on dry.
            Self::Inscription | Self::Seal => 0.0,
            Self::Contour => 0.3,
            Self::Dot => 0.4,
        }
    }

    /// Of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wash => "ran",
            Self::Wrinkle => "cun",
            Self::Rub => "ca",
            Self::Contour => "gou",
            Self::Dot => "dian",
            Self::Inscription => "ti",
            Self::Seal => "yin",
        }
    }
}

/// Format of sums: they are of a few dozen stamps, so that 11 bits are enough, and core WebGPU blends it.
const SUMS: TextureFormat = TextureFormat::Rgba16Float;
/// Format of loads.
pub(crate) const LOADS: TextureFormat = TextureFormat::Rgba16Float;
const PICTURE: TextureFormat = TextureFormat::Rgba32Float;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SplatRow {
    size: [f32; 2],
    extent: f32,
    trail: f32,
    lanes: f32,
    miss: f32,
    across: [f32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct LayerRow {
    numbers: [[f32; BANDS]; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct CompositeRow {
    layers: [LayerRow; LAYERS],
    paper: [f32; BANDS],
    rgb: [[f32; BANDS]; 3],
    relief: [f32; 4],
}

/// Half widths of the full brush after which a trail of bristles repeats: longer than a stroke that anybody follows by eye.
const TRAIL_LENGTH: f32 = 90.0;

/// Breadth of a bristle's trail, pixels of a picture of 1080 lines: less could not be told from noise.
const BRISTLE: f32 = 2.4;

/// Pixels of a picture of 1080 lines by which prints of a wash miss the outline of what they are on: a steady hand.
const MISS: f32 = 2.5;

/// A sheet of paper on a device, and what is painted on it.
pub struct Canvas {
    device: Device,
    queue: Queue,
    size: [u32; 2],
    materials: Materials,
    splat: wgpu::RenderPipeline,
    splat_group: wgpu::BindGroup,
    resolve: wgpu::RenderPipeline,
    resolve_group: wgpu::BindGroup,
    composite: wgpu::RenderPipeline,
    composite_group: wgpu::BindGroup,
    sums: wgpu::TextureView,
    greatest: wgpu::TextureView,
    /// What stamps leave.
    loads: wgpu::Texture,
    /// What is left of it when water has gone.
    dried: wgpu::Texture,
    drying: Drying,
    picture: wgpu::Texture,
    shapes: wgpu::Texture,
}

/// What a canvas is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Materials {
    /// The paper.
    pub paper: &'static Paper,
    /// The pigment of each layer, in the order of [`Layer::ALL`].
    pub pigments: [&'static Pigment; LAYERS],
    /// Half the width of the full brush, pixels.
    pub full: f32,
    /// How far ink flows with its water, 0 to 1.
    pub bleed: f32,
    /// Raggedness of the brush, 0 to 1.
    pub roughness: f32,
    /// Its bristles, where they are those of a picture.
    pub bristles: Option<Arc<Bristles>>,
    /// Pixels that stand for one in a picture of 1080 lines.
    pub unit: f32,
    /// Same seed, same sheet and same brush.
    pub seed: u32,
}

impl Canvas {
    /// Makes the sheet and the brush and compiles everything.
    pub fn new(
        device: &Device,
        queue: &Queue,
        size: [u32; 2],
        materials: &Materials,
        resolve: &Resolve,
    ) -> Result<Self, InkError> {
        let limit = device.limits().max_texture_dimension_2d;
        if size.iter().any(|n| *n == 0 || *n > limit) {
            let [w, h] = size;
            return Err(InkError::Refused(format!("a sheet of {w} x {h} pixels: 1 to {limit} a side")));
        }
        Ok(checked(device, || Ok(Self::make(device, queue, size, materials, resolve)))?)
    }

    fn make(device: &Device, queue: &Queue, size: [u32; 2], m: &Materials, resolve: &Resolve) -> Self {
        let target = |label, format, layers| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: Extent3d { width: size[0], height: size[1], depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT
                    | TextureUsages::TEXTURE_BINDING
                    | TextureUsages::COPY_DST
                    | TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let sums = view(&target("sums", SUMS, 1));
        let greatest = view(&target("greatest", SUMS, 1));
        let loads = target("loads", LOADS, Layer::ALL.len() as u32);
        let dried = target("dried", LOADS, Layer::ALL.len() as u32);
        let picture = target("picture", PICTURE, 1);
        let shapes = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shapes"),
            size: Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::R32Uint,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });

        let masks = mask_texture(device, queue, m);
        let trail = m.bristles.as_ref().map_or_else(|| bristle_trail(m.seed), |b| b.trail.clone());
        let trail: Vec<u8> = trail.iter().map(|v| (v * 255.0) as u8).collect();
        let trail =
            bytes_texture(device, queue, "trail", TextureFormat::R8Unorm, TRAIL.map(|n| n as u32), &trail);
        let sheet = m.paper.sheet(size, m.unit, m.seed);
        let (drying, sheet) = (Drying::parts(&sheet, m), sheet_texture(device, queue, &sheet));
        let sampler = |mode| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                address_mode_u: mode,
                address_mode_v: mode,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            })
        };
        let (clamped, repeated) =
            (sampler(wgpu::AddressMode::ClampToEdge), sampler(wgpu::AddressMode::Repeat));

        let uniform = |label, bytes: &[u8]| {
            device.create_buffer_init(&BufferInitDescriptor {
                label: Some(label),
                contents: bytes,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        };
        // Of noise each stroke takes another part; a picture's breadth is that of the brush.
        let (trail_length, lanes, across) = match &m.bristles {
            Some(bristles) => (bristles.length, 0.5, [0.0, 0.5]),
            None => (TRAIL_LENGTH, m.full / (BRISTLE * m.unit.max(0.5) * TRAIL_WAVES), [7.0, 0.0]),
        };
        let splat_row = SplatRow {
            size: size.map(|n| n as f32),
            extent: EXTENT,
            trail: trail_length,
            lanes,
            miss: MISS * m.unit,
            across,
        };
        let splat_row = uniform("splat", bytemuck::bytes_of(&splat_row));
        let resolve_row = uniform("resolve", bytemuck::bytes_of(resolve));
        let composite_row = uniform("composite", bytemuck::bytes_of(&composite_row(m)));

        let array = TextureViewDimension::D2Array;
        let flat = TextureViewDimension::D2;
        let (splat_layout, splat_group) = group(
            device,
            "splat",
            &[
                (Binding::Uniform, splat_row.as_entire_binding()),
                (Binding::Texture(array, true), wgpu::BindingResource::TextureView(&masks)),
                (Binding::Texture(flat, true), wgpu::BindingResource::TextureView(&trail)),
                (Binding::Sampler, wgpu::BindingResource::Sampler(&clamped)),
                (Binding::Sampler, wgpu::BindingResource::Sampler(&repeated)),
                (Binding::Numbers, wgpu::BindingResource::TextureView(&view(&shapes))),
            ],
        );
        let (resolve_layout, resolve_group) = group(
            device,
            "resolve",
            &[
                (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(&sums)),
                (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(&greatest)),
                (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(&sheet)),
                (Binding::Uniform, resolve_row.as_entire_binding()),
            ],
        );
        let drying = Drying::new(device, size, drying, &loads, &sheet, m);
        let all_loads =
            dried.create_view(&wgpu::TextureViewDescriptor { dimension: Some(array), ..Default::default() });
        let (composite_layout, composite_group) = group(
            device,
            "composite",
            &[
                (Binding::Texture(array, false), wgpu::BindingResource::TextureView(&all_loads)),
                (Binding::Texture(flat, false), wgpu::BindingResource::TextureView(&sheet)),
                (Binding::Uniform, composite_row.as_entire_binding()),
            ],
        );
        let add = BlendComponent {
            src_factor: BlendFactor::One,
            dst_factor: BlendFactor::One,
            operation: BlendOperation::Add,
        };
        let max = BlendComponent { operation: BlendOperation::Max, ..add };
        let target = |format, blend: Option<BlendComponent>| {
            Some(wgpu::ColorTargetState {
                format,
                blend: blend.map(|b| BlendState { color: b, alpha: b }),
                write_mask: wgpu::ColorWrites::ALL,
            })
        };
        let splat = pipeline(
            device,
            include_str!("splat.wgsl"),
            ["corner", "print"],
            &splat_layout,
            Some(&wgpu::VertexBufferLayout {
                array_stride: size_of::<Stamp>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &STAMP_ATTRIBUTES,
            }),
            &[target(SUMS, Some(add)), target(SUMS, Some(max))],
        );
        let resolve = pipeline(
            device,
            include_str!("resolve.wgsl"),
            ["everywhere", "load"],
            &resolve_layout,
            None,
            &[target(LOADS, None)],
        );
        let composite = pipeline(
            device,
            include_str!("composite.wgsl"),
            ["everywhere", "show"],
            &composite_layout,
            None,
            &[target(PICTURE, None)],
        );
        Self {
            device: device.clone(),
            queue: queue.clone(),
            size,
            materials: m.clone(),
            splat,
            splat_group,
            resolve,
            resolve_group,
            composite,
            composite_group,
            sums,
            greatest,
            loads,
            dried,
            drying,
            picture,
            shapes,
        }
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What it is made of.
    pub fn materials(&self) -> &Materials {
        &self.materials
    }

    /// Says which shape is seen at each pixel, row after row, for the stamps that end at outlines.
    pub fn outline(&self, shapes: &[u32]) {
        let [width, height] = self.size;
        if shapes.len() != width as usize * height as usize {
            return;
        }
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * width), rows_per_image: None };
        let size = Extent3d { width, height, depth_or_array_layers: 1 };
        self.queue.write_texture(self.shapes.as_image_copy(), bytemuck::cast_slice(shapes), layout, size);
    }

    /// Lays ink or paste on a layer that is not painted by brush, in place of what was there: a load for each pixel.
    pub fn lay(&self, layer: Layer, loads: &[f32]) {
        let [width, height] = self.size;
        if loads.len() != width as usize * height as usize {
            return;
        }
        let texels: Vec<[half::f16; 4]> =
            loads.iter().map(|v| [*v, 0.0, 0.0, 0.0].map(half::f16::from_f32)).collect();
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(8 * width), rows_per_image: None };
        let size = Extent3d { width, height, depth_or_array_layers: 1 };
        let mut to = self.dried.as_image_copy();
        to.origin.z = layer as u32;
        self.queue.write_texture(to, bytemuck::cast_slice(&texels), layout, size);
    }

    /// Paints: the stamps of each layer, in place of what was there.
    pub fn paint(&self, layers: &[Vec<Stamp>; BRUSHED]) {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        for (layer, stamps) in (0..).zip(layers) {
            let [view, dried] = [&self.loads, &self.dried].map(|t| one_layer(t, layer));
            if stamps.is_empty() {
                pass(&mut encoder, "no stamps", &[&dried]);
                continue;
            }
            let buffer = self.device.create_buffer_init(&BufferInitDescriptor {
                label: Some("stamps"),
                contents: bytemuck::cast_slice(stamps),
                usage: wgpu::BufferUsages::VERTEX,
            });
            {
                let mut pass = pass(&mut encoder, "splat", &[&self.sums, &self.greatest]);
                pass.set_pipeline(&self.splat);
                pass.set_bind_group(0, &self.splat_group, &[]);
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.draw(0..6, 0..stamps.len() as u32);
            }
            {
                let mut pass = pass(&mut encoder, "resolve", &[&view]);
                pass.set_pipeline(&self.resolve);
                pass.set_bind_group(0, &self.resolve_group, &[]);
                pass.draw(0..3, 0..1);
            }
            self.drying.record(&mut encoder, layer as usize, &dried);
        }
        self.queue.submit([encoder.finish()]);
    }

    /// The picture: R, G, B, linear sRGB, a white surface being one.
    pub fn picture(&self) -> Result<Image, InkError> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let view = self.picture.create_view(&Default::default());
            let mut pass = pass(&mut encoder, "composite", &[&view]);
            pass.set_pipeline(&self.composite);
            pass.set_bind_group(0, &self.composite_group, &[]);
            pass.draw(0..3, 0..1);
        }
        self.queue.submit([encoder.finish()]);
        let texels: Vec<[f32; 4]> =
            self.read(&self.picture, 0, 16, bytemuck::pod_collect_to_vec::<u8, [f32; 4]>)?;
        let mut image = Image::rgb(self.size[0] as usize, self.size[1] as usize);
        for (pixel, texel) in image.data.chunks_exact_mut(3).zip(texels) {
            pixel.copy_from_slice(&texel[..3]);
        }
        Ok(image)
    }

    /// The load of ink of a layer, row after row, and how wet it was put down.
    pub fn load(&self, layer: Layer) -> Result<Vec<[f32; 2]>, InkError> {
        let halves =
            self.read(&self.dried, layer as u32, 8, bytemuck::pod_collect_to_vec::<u8, [half::f16; 4]>)?;
        Ok(halves.into_iter().map(|t| [t[0].to_f32(), t[1].to_f32()]).collect())
    }

    /// A layer by itself, to be put over others: the colour of its pigment, linear sRGB, and straight alpha, by which it covers
    /// the paper as its load of ink does in green light. Channels R, G, B, A.
    pub fn layer(&self, layer: Layer) -> Result<Image, InkError> {
        /// The band in whose middle the eye is most sensitive.
        const GREEN: usize = 3;
        let pigment = self.materials.pigments[layer as usize];
        let [a, b, s] = pigment.numbers();
        // What a layer without end reflects.
        let deep: [f32; BANDS] = std::array::from_fn(|i| a[i] - b[i]);
        let colour: Vec3 = band_to_rgb().iter().zip(deep).map(|(w, r)| *w * r).sum();
        let below = self.materials.paper.reflectance[GREEN];
        let mut image = Image::new(self.size[0] as usize, self.size[1] as usize, &["R", "G", "B", "A"]);
        for (pixel, [load, _]) in image.data.chunks_exact_mut(4).zip(self.load(layer)?) {
            let shown = over(a[GREEN], b[GREEN], s[GREEN], load, below);
            let alpha = ((below - shown) / (below - deep[GREEN])).clamp(0.0, 1.0);
            pixel.copy_from_slice(&[colour.x, colour.y, colour.z, alpha]);
        }
        Ok(image)
    }

    /// Colour of a load of ink of a layer on the paper, linear sRGB.
    pub fn shade(&self, layer: Layer, load: f32) -> Vec3 {
        let [a, b, s] = self.materials.pigments[layer as usize].numbers();
        let paper = self.materials.paper.reflectance;
        let bands = (0..BANDS).map(|i| over(a[i], b[i], s[i], load, paper[i]));
        band_to_rgb().iter().zip(bands).map(|(w, r)| *w * r).sum()
    }

    /// Waits for the device and fetches a layer of a texture whose texels have so many bytes.
    fn read<T: Copy>(
        &self,
        texture: &wgpu::Texture,
        layer: u32,
        bytes: u32,
        texels: impl Fn(&[u8]) -> Vec<T>,
    ) -> Result<Vec<T>, InkError> {
        let [width, height] = self.size;
        // Rows of a copy begin at multiples of 256 bytes.
        let row = (width * bytes).next_multiple_of(256);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("to read"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut from = texture.as_image_copy();
        from.origin.z = layer;
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            from,
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        let bytes_of_rows = map(&self.device, &buffer)?;
        let mut out = Vec::with_capacity(width as usize * height as usize);
        for line in bytes_of_rows.chunks_exact(row as usize) {
            out.extend(texels(&line[..(width * bytes) as usize]));
        }
        Ok(out)
    }
}

const STAMP_ATTRIBUTES: [wgpu::VertexAttribute; 5] = wgpu::vertex_attr_array![
    0 => Float32x2, 1 => Float32x2, 2 => Float32x4, 3 => Uint32x2, 4 => Float32x3
];

fn composite_row(m: &Materials) -> CompositeRow {
    let to_rgb = band_to_rgb();
    let row = |axis: usize| std::array::from_fn(|band| to_rgb[band][axis]);
    CompositeRow {
        layers: m.pigments.map(|p| LayerRow { numbers: p.numbers() }),
        paper: m.paper.reflectance,
        rgb: [row(0), row(1), row(2)],
        relief: m.paper.relief,
    }
}

fn sheet_texture(device: &Device, queue: &Queue, sheet: &Sheet) -> wgpu::TextureView {
    let bytes: Vec<u8> = sheet.texels.iter().flatten().map(|v| (v * 255.0 + 0.5) as u8).collect();
    bytes_texture(device, queue, "paper", TextureFormat::Rgba8Unorm, sheet.size, &bytes)
}

/// All masks with their pyramids: thin brushes have few pixels of them.
fn mask_texture(device: &Device, queue: &Queue, m: &Materials) -> wgpu::TextureView {
    let levels = TEXELS.ilog2() + 1;
    let mut bytes: Vec<u8> = Vec::new();
    for variant in 0..VARIANTS as u32 {
        let mut mask = Footprint::new(m.seed, variant, m.roughness);
        if let Some(bristles) = &m.bristles {
            mask.scale_across(&|across| bristles.at(across));
        }
        let mut level: Vec<[f32; 2]> =
            mask.bristles.iter().copied().zip(mask.diffused).map(|(f, d)| [f, d]).collect();
        let mut n = TEXELS;
        loop {
            bytes.extend(level.iter().flatten().map(|v| (v * 255.0 + 0.5) as u8));
            if n == 1 {
                break;
            }
            level = (0..n / 2 * (n / 2))
                .map(|i| {
                    let (x, y) = (2 * (i % (n / 2)), 2 * (i / (n / 2)));
                    let four = [y * n + x, y * n + x + 1, (y + 1) * n + x, (y + 1) * n + x + 1];
                    [0, 1].map(|c| four.iter().map(|k| level[*k][c]).sum::<f32>() / 4.0)
                })
                .collect();
            n /= 2;
        }
    }
    let descriptor = wgpu::TextureDescriptor {
        label: Some("masks"),
        size: Extent3d {
            width: TEXELS as u32,
            height: TEXELS as u32,
            depth_or_array_layers: VARIANTS as u32,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rg8Unorm,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    device.create_texture_with_data(queue, &descriptor, TextureDataOrder::LayerMajor, &bytes).create_view(
        &wgpu::TextureViewDescriptor { dimension: Some(TextureViewDimension::D2Array), ..Default::default() },
    )
}
