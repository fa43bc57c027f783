//! The stage: a scene on a device, and the passes that make a frame of it.

use crate::StageError;
use crate::aov::aov_pass;
use crate::cloth::ClothPass;
use crate::cloth::drape::Drape;
use crate::device::{checked, map};
use crate::display::{DisplayPass, DisplaySettings};
use crate::film::{Film, FilmPass, HALVES_PLANES, film_bytes_with};
use crate::flames::Flames;
use crate::free_lights::FreeLights;
use crate::guide::{self, Frames, guide_pass};
use crate::preview::{Preview, PreviewPass};
use crate::reconstruction::Reconstruction;
use crate::scene::SceneBuffers;
use crate::shade::{needs_head_light, shade_pass};
use crate::timing::{PassTime, Timestamps};
use crate::view::{View, ViewRow};
use crate::visibility::{Visibility, primary_group, primary_layout};
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Device, Queue};
use yugen_optics::denoise::{Halves, PixelFilter, denoise, half};
use yugen_optics::{Fingerprint, Image};
use yugen_scene::prepared::{DrawRow, Rows, VertexRow, wgsl_where};
use yugen_scene::{Aov, Camera, Filter};

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lighting {
    /// As the reference renderer has it: every light with its shadow, and what surfaces throw at each other.
    #[default]
    Full,
    /// By the equations of Wakita et al., "Digital Archiving of Takigi Noh Based on Reflectance Analysis", 5: fires are points without
    /// shadows, a highlight is one value of the ambient map. See `paper.wgsl`.
    Paper,
}

/// What a stage is made for.
#[derive(Clone, Debug)]
pub struct Options {
    /// Pixels of the window across and down.
    pub size: [u32; 2],
    /// How samples become pixels.
    pub filter: Filter,
    /// Pictures beside the picture; those that this renderer has.
    pub aovs: Vec<Aov>,
    /// Keep what a denoiser needs: [`Stage::denoised`].
    pub denoise: bool,
    /// Frames that a picture will have, where known. Frames go to the two halves in turn, in blocks of up to 8; fewer frames
    /// make the blocks smaller (`yugen_optics::denoise::half`). `None`: blocks of 8, so at least 16 frames are needed.
    pub planned: Option<u32>,
    /// Trace what the camera sees even where it could be rastered: no vertex is then rounded to the raster, and from the
    /// second frame on every pixel looks at a place of its own, so that what is left of edges is noise and not steps.
    pub trace_camera: bool,
    /// Threads that build the hierarchy.
    pub threads: usize,
    /// Surfaces that reflect light on its way to the camera; `None`: no picture, only those beside it.
    pub bounces: Option<u32>,
    /// The camera does not see lights.
    pub hide_emitters: bool,
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Same seed, same picture.
    pub seed: u32,
}

impl Options {
    /// For so many pixels and so many surfaces that reflect light (see [`Options::bounces`]): with a box filter, nothing beside the
    /// picture, raster, one thread, lights seen, all light, seed 0.
    pub fn new(size: [u32; 2], bounces: Option<u32>) -> Self {
        Self {
            size,
            filter: Filter::Box,
            aovs: Vec::new(),
            denoise: false,
            planned: None,
            trace_camera: false,
            threads: 1,
            bounces,
            hide_emitters: false,
            lighting: Lighting::default(),
            seed: 0,
        }
    }

    /// Whether the film of the picture keeps squares and halves.
    pub(crate) fn keeps_halves(&self) -> bool {
        self.bounces.is_some() && (self.denoise || self.aovs.contains(&Aov::Variance))
    }

    /// Planes of the largest film behind its first.
    fn more_planes(&self) -> u32 {
        match (self.keeps_halves(), self.denoise) {
            (true, true) => HALVES_PLANES.max(guide::FURTHER_PLANES),
            (true, false) => HALVES_PLANES,
            _ => 0,
        }
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picked {
    /// Index of the draw.
    pub draw: u32,
    /// Its triangle, counted from the first of all meshes.
    pub triangle: u32,
    /// The shape or the instance, counted from one.
    pub shape: u32,
}

/// Where a frame is shown.
pub struct Target<'a> {
    /// Made for the format of `view` and a film of the stage.
    pub pass: &'a DisplayPass,
    /// A texture or a window.
    pub view: &'a wgpu::TextureView,
    /// How.
    pub settings: DisplaySettings,
}

/// A scene on a device, ready to be seen.
pub struct Stage {
    device: Device,
    queue: Queue,
    scene: SceneBuffers,
    /// The WGSL of the scene's materials and lights, but for the parameters it takes for zero, as a hash: rows that need
    /// another cannot be had by new values alone.
    shader: u64,
    flames: Option<Flames>,
    /// Meshes that follow cloths.
    drapes: Vec<Drape>,
    view: wgpu::Buffer,
    visibility: Visibility,
    primary_layout: wgpu::BindGroupLayout,
    primary: wgpu::BindGroup,
    free_lights: FreeLights,
    film_layout: wgpu::BindGroupLayout,
    shade: Option<FilmPass>,
    aovs: Vec<(Aov, FilmPass)>,
    /// What a denoiser is told.
    guides: Option<FilmPass>,
    /// Whether variances are among the pictures beside the picture.
    variance: bool,
    planned: Option<u32>,
    /// Planes of the largest film behind its first.
    more_planes: u32,
    preview: Option<PreviewPass>,
    picked: wgpu::Buffer,
    timestamps: Timestamps,
    reconstruction: Reconstruction,
    trace_camera: bool,
    signed_filter: bool,
    head_light: bool,
    hide_emitters: bool,
    seed: u32,
    /// See [`Stage::set_moving`].
    moving: bool,
    /// Pictures begun while something moved.
    pictures: u32,
    size: [u32; 2],
    /// What the sums are of: the view, and the frames.
    seen: Option<View>,
    frames: Frames,
    lost: Arc<Mutex<Option<String>>>,
}

impl Stage {
    /// Compiles every shader and makes room for everything; [`Stage::frame`] then does neither. Takes the device's
    /// callback for being lost.
    pub fn new(device: &Device, queue: &Queue, rows: &Rows, options: &Options) -> Result<Self, StageError> {
        check_size(device, options.size, options.more_planes())?;
        let lost = Arc::new(Mutex::new(None));
        let note = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            *note.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{reason:?}: {message}"));
        });
        checked(device, || {
            let scene = SceneBuffers::new(device, rows, options.threads)?;
            let flames = Flames::new(device, queue, rows, options.lighting)?;
            let view = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view"),
                size: size_of::<ViewRow>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let visibility = Visibility::new(device, &scene, &view, options.size);
            let primary_layout = primary_layout(device);
            let primary = primary_group(device, &primary_layout, &view, visibility.ids());
            let seen = [view.as_entire_binding(), wgpu::BindingResource::TextureView(visibility.ids())];
            let free_lights = FreeLights::new(device, rows, &scene, &primary_layout, seen, options);
            let film_layout = Film::layout(device);
            let shade = options.bounces.map(|bounces| {
                shade_pass(
                    device,
                    rows,
                    &scene,
                    free_lights.layout(),
                    &film_layout,
                    flames.as_ref(),
                    options,
                    bounces,
                )
            });
            let guides = options.bounces.filter(|_| options.denoise).map(|bounces| {
                guide_pass(device, rows, &scene, &primary_layout, &film_layout, options, bounces)
            });
            let aovs = options
                .aovs
                .iter()
                .filter_map(|aov| {
                    let pass = aov_pass(device, *aov, rows, &scene, &primary_layout, &film_layout, options);
                    Some((*aov, pass?))
                })
                .collect();
            Ok(Self {
                device: device.clone(),
                queue: queue.clone(),
                scene,
                shader: Fingerprint::of(wgsl_where(rows, &[]).as_bytes()),
                flames,
                drapes: Vec::new(),
                view,
                visibility,
                primary_layout,
                primary,
                free_lights,
                film_layout,
                shade,
                aovs,
                guides,
                variance: options.keeps_halves() && options.aovs.contains(&Aov::Variance),
                planned: options.planned,
                more_planes: options.more_planes(),
                preview: None,
                picked: device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("picked"),
                    size: 8,
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                }),
                timestamps: Timestamps::new(device, queue),
                signed_filter: Reconstruction::new(options.filter).is_signed(),
                reconstruction: Reconstruction::new(options.filter),
                trace_camera: options.trace_camera,
                hide_emitters: options.hide_emitters,
                head_light: options.bounces.is_some_and(|b| b > 0) && needs_head_light(rows),
                seed: options.seed,
                moving: false,
                pictures: 0,
                size: options.size,
                seen: None,
                frames: Frames::default(),
                lost,
            })
        })
    }

    /// Whether the scene has no light and is lit from the eye instead. The reference renderer makes it black.
    pub fn has_head_light(&self) -> bool {
        self.head_light
    }

    /// Adds a frame to the picture that `camera` sees; begins a new picture where the camera or the scene has changed.
    /// Returns how many frames the picture then has.
    pub fn frame(&mut self, camera: &Camera) -> Result<u32, StageError> {
        self.frame_on(camera, None)
    }

    /// [`Stage::frame`], and shows the picture on `target`.
    pub fn frame_on(&mut self, camera: &Camera, target: Option<&Target>) -> Result<u32, StageError> {
        self.check_alive()?;
        let view = View::new(camera)?;
        let [_, _, w, h] = view.window();
        if [w, h] != self.size {
            return Err(StageError::OtherSize { found: [w, h], stage: self.size });
        }
        if self.seen.as_ref() != Some(&view) {
            self.frames = Frames::default();
            for film in self.shade.iter().chain(self.aovs.iter().map(|(_, pass)| pass)).map(FilmPass::film) {
                film.begin(&self.queue);
            }
            self.pictures = self.pictures.wrapping_add(u32::from(self.moving));
        }
        let before = self.frames;
        let sample = self.reconstruction.sample(before.count, view.has_lens());
        let which = half(before.count, self.planned);
        let frames = before.with(sample.weight, which);
        let traced = self.trace_camera || view.has_lens();
        // A raster has one place for all pixels; and where the filter is negative the sum of weights is that of all.
        let own = traced && before.count > 0 && !self.signed_filter;
        let per_pixel = own.then_some(&self.reconstruction);
        let seed = self.seed.wrapping_add(self.picture_seed());
        let row = view.row(before.count, seed, &sample, per_pixel).after(&before, which);
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&row));

        self.timestamps.begin();
        let mut encoder = self.device.create_command_encoder(&Default::default());
        if traced {
            self.visibility.trace(&mut encoder, &self.timestamps, &self.scene);
        } else {
            self.visibility.raster(&mut encoder, &self.timestamps);
        }
        if let Some(shade) = &self.shade {
            let flames = self.flames.as_ref().map(Flames::group);
            self.free_lights.record(&mut encoder, &self.timestamps, &self.scene, &self.primary);
            shade.record(&mut encoder, &self.timestamps, &self.scene, self.free_lights.group(), flames);
        }
        for pass in self.guides.iter().chain(self.aovs.iter().map(|(_, pass)| pass)) {
            pass.record(&mut encoder, &self.timestamps, &self.scene, &self.primary, None);
        }
        if let Some(preview) = &mut self.preview {
            let (scene, primary) = (&self.scene, &self.primary);
            preview.record(
                &self.queue,
                &mut encoder,
                &self.timestamps,
                scene,
                primary,
                &view,
                frames.count,
                frames.weight(),
            );
        }
        if let Some(Target { pass, view, settings }) = target {
            let weight = self.shown_weight(frames.weight());
            pass.record(&self.queue, &mut encoder, Some(&self.timestamps), view, settings, weight);
        }
        let timed = self.timestamps.end(&mut encoder);
        self.queue.submit([encoder.finish()]);
        if timed {
            self.timestamps.fetch();
        }

        self.seen = Some(view);
        self.frames = frames;
        Ok(frames.count)
    }

    /// Moves the draws, which must be of the same meshes as before. The picture then begins anew.
    pub fn place(&mut self, draws: &[DrawRow]) -> Result<(), StageError> {
        self.check_alive()?;
        self.begin_pose();
        let placed = self.scene.place(&self.queue, draws);
        self.hang();
        placed
    }

    /// Deforms a mesh: all of its vertices. The picture then begins anew.
    pub fn deform(&mut self, mesh: u32, vertices: &[VertexRow]) -> Result<(), StageError> {
        self.check_alive()?;
        self.begin_pose();
        let deformed = self.scene.deform(&self.queue, mesh, vertices);
        self.hang();
        deformed
    }

    /// From now on a mesh is where a cloth of the same device is, at each [`Stage::follow`], whatever poses say of it. `of`: of each vertex
    /// of the mesh that of the cloth, or [`NONE`](yugen_scene::prepared::NONE) for what stays where it is. The mesh's own coordinates are
    /// the cloth's.
    ///
    /// # Errors
    /// A mesh that shines or has tangents of its own, and vertices that are not there.
    pub fn drape(&mut self, mesh: u32, cloth: &ClothPass, of: &[u32]) -> Result<(), StageError> {
        self.check_alive()?;
        let drape = checked(&self.device, || Drape::new(&self.device, &self.scene, mesh, cloth, of))?;
        self.drapes.retain(|d| d.mesh() != mesh);
        self.drapes.push(drape);
        self.scene.drape(mesh);
        Ok(())
    }

    /// Takes over where draped cloths are after their last steps, none of which passes through the processor. The picture then begins anew.
    pub fn follow(&mut self) -> Result<(), StageError> {
        self.check_alive()?;
        self.begin_pose();
        self.hang();
        Ok(())
    }

    /// Puts draped meshes where their cloths are, and boxes around them.
    fn hang(&self) {
        if self.drapes.is_empty() {
            return;
        }
        self.scene.rewrite_top(&self.queue);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.drapes.iter().for_each(|d| d.record(&self.queue, &mut encoder, &self.scene));
        self.queue.submit([encoder.finish()]);
    }

    /// Takes over another pose of the scene: `rows` that [`Rows::pose`] has made of those of the stage, or new ones of the
    /// posed scene. The picture then begins anew. `false`: something else than a pose has changed, and the stage is as it
    /// was; make it anew. After an error it is in no pose until one is taken over.
    pub fn pose(&mut self, rows: &Rows) -> Result<bool, StageError> {
        self.check_alive()?;
        let posed = self.take_over(rows, false);
        if !matches!(posed, Ok(false)) {
            self.begin_pose();
        }
        posed
    }

    fn begin_pose(&mut self) {
        self.seen = None;
        if let Some(preview) = &mut self.preview {
            preview.pose();
        }
    }

    /// Takes over other values of materials and lights as well, textures included: `rows` of the same scene otherwise. A
    /// preview forgets what was seen, which it keeps over poses.
    /// `false`: they need another shader or more room, and the stage is as it was; make it anew.
    pub fn refill(&mut self, rows: &Rows) -> Result<bool, StageError> {
        self.check_alive()?;
        if self.shader != Fingerprint::of(wgsl_where(rows, &[]).as_bytes()) {
            return Ok(false);
        }
        let refilled = self.take_over(rows, true);
        if !matches!(refilled, Ok(false)) {
            self.seen = None;
            // Light that was switched off would fade slowly.
            if let Some(preview) = &mut self.preview {
                preview.forget();
            }
        }
        refilled
    }

    fn take_over(&mut self, rows: &Rows, textures: bool) -> Result<bool, StageError> {
        if self.flames.as_ref().map_or(!rows.volumes.is_empty(), |flames| !flames.fits(rows)) {
            return Ok(false);
        }
        let taken = self.scene.update(&self.queue, rows, textures)?;
        if let (true, Some(flames)) = (taken, &self.flames) {
            flames.send(&self.queue, rows);
        }
        if taken {
            self.hang();
        }
        Ok(taken)
    }

    /// Makes room for another number of pixels.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), StageError> {
        check_size(&self.device, size, self.more_planes)?;
        self.check_alive()?;
        if size == self.size {
            return Ok(());
        }
        let device = self.device.clone();
        checked(&device, || {
            self.visibility.resize(&device, size);
            self.primary = primary_group(&device, &self.primary_layout, &self.view, self.visibility.ids());
            let ids = wgpu::BindingResource::TextureView(self.visibility.ids());
            self.free_lights.resize(&device, [self.view.as_entire_binding(), ids], size);
            if let Some(shade) = &mut self.shade {
                shade.resize(&device, &self.film_layout, size);
            }
            for pass in self.guides.iter_mut().chain(self.aovs.iter_mut().map(|(_, pass)| pass)) {
                pass.resize(&device, &self.film_layout, size);
            }
            if let (Some(preview), Some(shade)) = (&mut self.preview, &self.shade) {
                preview.resize(&device, shade.film());
            }
            (self.size, self.seen) = (size, None);
            Ok(())
        })
    }

    /// What [`Stage::shown`] is from the next frame on. Allocates and compiles when something is first turned on; without
    /// a picture nothing is.
    pub fn set_preview(&mut self, settings: Preview) -> Result<(), StageError> {
        self.check_alive()?;
        let Some(shade) = &self.shade else { return Ok(()) };
        if !settings.is_on() {
            self.preview = None;
        } else if let Some(preview) = &mut self.preview {
            preview.settings = settings;
        } else {
            let (device, scene, primary) = (&self.device, &self.scene, &self.primary_layout);
            self.preview = checked(device, || {
                let hide = self.hide_emitters;
                Ok(Some(PreviewPass::new(device, settings, scene, primary, shade.film(), hide)))
            })?;
            // It has seen none of the frames so far.
            self.seen = None;
        }
        Ok(())
    }

    /// Says that pictures follow one another quickly, each perhaps of one frame only. With a preview each then has random
    /// numbers of its own, for what is carried from one to the next must not be the same noise each time; without, and once
    /// nothing moves any more, pictures are of the stage's seed alone, whatever was before. A picture that was begun while
    /// something moved begins anew when nothing does; the preview goes on from it.
    pub fn set_moving(&mut self, moving: bool) {
        if self.picture_seed() != 0 && !moving {
            self.seen = None;
        }
        self.moving = moving;
        if !moving {
            self.pictures = 0;
        }
    }

    /// Whether something was last said to move.
    pub fn is_moving(&self) -> bool {
        self.moving
    }

    /// What the seed of the picture is more than that of the stage.
    fn picture_seed(&self) -> u32 {
        if self.preview.is_some() { self.pictures.wrapping_mul(0x9e37_79b9) } else { 0 }
    }

    /// The film to show: the preview's where one is on, which is a mean, else the picture's, which is a sum.
    /// [`DisplayPass::set_film`] must be told when it changes: after [`Stage::set_preview`] and [`Stage::resize`].
    pub fn shown(&self) -> Option<&Film> {
        self.preview.as_ref().map(PreviewPass::shown).or_else(|| self.film(None))
    }

    /// What the samples of [`Stage::shown`] weigh together where those of the picture weigh `weight`.
    fn shown_weight(&self, weight: f64) -> f64 {
        if self.preview.is_some() { 1.0 } else { weight }
    }

    /// Waits for the device and fetches what is shown: R, G, B, A.
    pub fn shown_image(&self) -> Result<Image, StageError> {
        self.check_alive()?;
        let mut image = Image::new(self.size[0] as usize, self.size[1] as usize, &["R", "G", "B", "A"]);
        if let Some(film) = self.shown() {
            let weight = self.shown_weight(self.frames.weight());
            let scale = if weight == 0.0 { 1.0 } else { 1.0 / weight };
            let sums = film.read(&self.device, &self.queue)?;
            for (pixel, sum) in image.data.chunks_exact_mut(4).zip(sums) {
                pixel.copy_from_slice(&sum.map(|v| (f64::from(v) * scale) as f32));
            }
        }
        Ok(image)
    }

    /// Shows the picture as it stands on `target`: for another exposure or curve.
    pub fn show(&self, target: &Target) -> Result<(), StageError> {
        self.check_alive()?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let Target { pass, view, settings } = target;
        let weight = self.shown_weight(self.frames.weight());
        pass.record(&self.queue, &mut encoder, None, view, settings, weight);
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// The sums of the picture (`None`) or of an AOV, where the stage was made with it.
    pub fn film(&self, aov: Option<Aov>) -> Option<&Film> {
        match aov {
            None => self.shade.as_ref().map(FilmPass::film),
            Some(aov) => self.aovs.iter().find(|(a, _)| *a == aov).map(|(_, pass)| pass.film()),
        }
    }

    /// Waits for the device and says what the last frame shows at a pixel of the window; `None`: nothing, or no pixel.
    pub fn pick(&self, pixel: [u32; 2]) -> Result<Option<Picked>, StageError> {
        self.check_alive()?;
        if self.seen.is_none() || pixel[0] >= self.size[0] || pixel[1] >= self.size[1] {
            return Ok(None);
        }
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.visibility.copy_pixel(&mut encoder, pixel, &self.picked);
        self.queue.submit([encoder.finish()]);
        let bytes = map(&self.device, &self.picked)?;
        let ids: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        let [seen, triangle] = [ids[0], ids[1]];
        let draw = seen.checked_sub(1).and_then(|draw| Some((draw, self.scene.draws().get(draw as usize)?)));
        Ok(draw.map(|(draw, row)| Picked { draw, triangle, shape: row.shape }))
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
    /// renderer and in its order.
    pub fn image(&self) -> Result<Image, StageError> {
        self.check_alive()?;
        self.image_of(&self.light()?)
    }

    /// The planes of the picture's film; none where there is no picture.
    fn light(&self) -> Result<Vec<Vec<[f32; 4]>>, StageError> {
        let film = self.film(None).map(|film| film.read_planes(&self.device, &self.queue));
        film.unwrap_or_else(|| Ok(Vec::new()))
    }

    /// [`Stage::image`] of these planes.
    fn image_of(&self, light: &[Vec<[f32; 4]>]) -> Result<Image, StageError> {
        let picture = light.first().map(|_| &["R", "G", "B", "A"][..]);
        let beside = |id: bool| self.aovs.iter().filter(move |(aov, _)| (*aov == Aov::Id) == id);
        let variance: &[&str] =
            if self.variance { &["variance.R", "variance.G", "variance.B", "samples.Y"] } else { &[] };
        let layers = |id: bool| beside(id).flat_map(|(aov, _)| aov.channels());
        let names = picture.into_iter().flatten().chain(layers(false)).chain(variance).chain(layers(true));
        let names: Vec<&str> = names.copied().collect();
        let mut image = Image::new(self.size[0] as usize, self.size[1] as usize, &names);
        let mut first = 0;
        let mut put = |rows: &[[f32; 4]], channels: usize, of: &dyn Fn(f32) -> f32| {
            for (pixel, row) in image.data.chunks_exact_mut(names.len()).zip(rows) {
                for (to, from) in pixel[first..first + channels].iter_mut().zip(row) {
                    *to = of(*from);
                }
            }
            first += channels;
        };
        let weight = self.frames.weight();
        let scale = if weight == 0.0 { 1.0 } else { 1.0 / weight };
        let mean = |v: f32| (f64::from(v) * scale) as f32;
        if let Some(sums) = light.first() {
            put(sums, 4, &mean);
        }
        for (aov, pass) in beside(false) {
            put(&pass.film().read(&self.device, &self.queue)?, aov.channels().len(), &mean);
        }
        if let (true, [sums, squares, ..]) = (self.variance, light) {
            put(squares, 3, &|squares| self.frames.variance(squares));
            put(&vec![[self.frames.count as f32; 4]; sums.len()], 1, &|count| count);
        }
        // Numbers of shapes have no mean.
        for (_, pass) in beside(true) {
            put(&pass.film().read(&self.device, &self.queue)?, 1, &|id| id);
        }
        Ok(image)
    }

    /// Waits for the device and fetches what a denoiser takes; `None` where the stage was made without
    /// ([`Options::denoise`]).
    pub fn halves(&self) -> Result<Option<Halves>, StageError> {
        self.check_alive()?;
        if self.guides.is_none() {
            return Ok(None);
        }
        self.halves_of(&self.light()?)
    }

    /// [`Stage::halves`] of these planes of the picture's film.
    fn halves_of(&self, light: &[Vec<[f32; 4]>]) -> Result<Option<Halves>, StageError> {
        let guides = self.guides.as_ref().map(FilmPass::film);
        guides.map(|film| guide::halves(&self.device, &self.queue, light, film, self.frames)).transpose()
    }

    /// [`Stage::image`], denoised as the reference renderer does it: R, G and B are, and kept as they were in `noisy.R`,
    /// `noisy.G` and `noisy.B`; `error.R`, `error.G` and `error.B` are estimates of the standard error that remains. The same
    /// bits for any number of `threads`.
    pub fn denoised(&self, threads: usize) -> Result<Image, StageError> {
        self.check_alive()?;
        let light = self.light()?;
        let image = self.image_of(&light)?;
        let Some(halves) = self.halves_of(&light)? else { return Ok(image) };
        let n = image.channels.len();
        let picture = std::array::from_fn(|c| image.data.iter().skip(c).step_by(n).copied().collect());
        // A pixel is the mean of its own samples, which the filter has placed.
        let clean = denoise(&halves, &picture, &PixelFilter::new(0.5, |_| 1.0), threads);
        Ok(clean.in_place_of(&image))
    }

    fn check_alive(&self) -> Result<(), StageError> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(reason) => Err(StageError::Lost(reason.clone())),
            None => Ok(()),
        }
    }
}

/// Neither nothing nor more than the device takes, with so many planes of a film behind its first.
fn check_size(device: &Device, size: [u32; 2], more: u32) -> Result<(), StageError> {
    let limits = device.limits();
    let [width, height] = size;
    let limit = limits.max_texture_dimension_2d;
    if width == 0 || height == 0 || width > limit || height > limit {
        return Err(StageError::Size { width, height, limit });
    }
    let (bytes, limit) =
        (film_bytes_with(size, more), limits.max_storage_buffer_binding_size.min(limits.max_buffer_size));
    if bytes > limit {
        return Err(StageError::TooLarge { what: "pixels", bytes, limit });
    }
    Ok(())
}
