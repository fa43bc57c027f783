//! From a scene to its painting.

use crate::InkError;
use crate::canvas::{Canvas, LAYERS, Layer, Materials};
use crate::contour::Foothold;
use crate::contour::{Surface, to_world};
use crate::control::Controls;
use crate::dot;
use crate::footprint::{Footprint, VARIANTS};
use crate::literal::{self, Padi};
use crate::paper::{PAPERS, Paper};
use crate::pigment::{PIGMENTS, Pigment};
use crate::projection::Projection;
use crate::resolve::Resolve;
use crate::scatter::Surfaces;
use crate::select::select;
use crate::stamp::{self, Stamp};
use crate::stroke::{Hand, Stroke};
use crate::svg::{Drawing, svg};
use crate::tone::Tones;
use crate::topology::{Creases, Topology};
use crate::tracking::{Change, Tracker};
use crate::visibility::{Cleaning, DepthMap, SampledLine, sample};
use crate::wash;
use crate::wrinkle::{self, MANNERS, Manner};
use glam::{DVec3, Vec2};
use std::collections::{HashMap, HashSet};
use std::hash::{Hash, Hasher};
use wgpu::{Device, Queue};
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::{Options, Stage};
use yugen_scene::prepared::{DrawRow, MeshRow, Rows};
use yugen_scene::{Aov, Camera, Film, Filter, Scene};

/// How a scene is painted.
#[derive(Clone, Debug)]
pub struct Style {
    /// What is steered.
    pub controls: Controls,
    /// On what.
    pub paper: &'static Paper,
    /// The pigment of each layer, in the order of [`Layer::ALL`].
    pub pigments: [&'static Pigment; LAYERS],
    /// How wrinkles are drawn.
    pub manner: &'static Manner,
    /// What is a crease.
    pub creases: Creases,
    /// Same seed, same painting.
    pub seed: u32,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            controls: Controls::default(),
            paper: &PAPERS[0],
            pigments: [&PIGMENTS[0]; LAYERS],
            manner: &MANNERS[0],
            creases: Creases::default(),
            seed: 0,
        }
    }
}

/// A scene on a device, ready to be painted.
pub struct Painter {
    device: Device,
    queue: Queue,
    rows: Rows,
    /// By mesh, and whether its normals are used.
    topologies: HashMap<(u32, bool), Known>,
    /// What is where.
    stage: Stage,
    /// How light it is there, in fewer pixels.
    light: Stage,
    /// How both are made.
    options: [Options; 2],
    canvas: Canvas,
    style: Style,
    size: [u32; 2],
    space: ColourSpace,
    tracker: Tracker,
}

/// A topology, and the triangles that it is of.
struct Known {
    vertices: u32,
    triangles: u64,
    topology: Topology,
}

/// Pixels of the picture across one in which light is looked at: a tenth of a wash's print.
const COARSE: u32 = 4;
/// Samples of light to a pixel: prints of the wash are means of hundreds of pixels, so that noise does not show.
const FRAMES: u32 = 8;

/// A draw that is too small for lines, and its dot where it is seen.
type Small = (u32, Option<Stamp>);

/// A painting.
#[derive(Clone, Debug)]
pub struct Painting {
    /// The strokes of contours, in the order in which they are painted.
    pub strokes: Vec<Stroke>,
    /// The strokes of wrinkles.
    pub wrinkles: Vec<Stroke>,
    /// Stamps of each layer, in the order of [`Layer::ALL`].
    pub stamps: [usize; LAYERS],
    /// What became of the strokes of the frame before.
    pub change: Change,
}

/// Relative depth by which something must be nearer to cover a stroke that goes.
const COVERS: f32 = 0.01;

impl Painter {
    /// For pictures of `camera`'s size of `scene` in any of its poses. `threads` prepare it.
    pub fn new(
        device: &Device,
        queue: &Queue,
        scene: &Scene,
        camera: &Camera,
        style: Style,
        threads: usize,
    ) -> Result<Self, InkError> {
        let size = Projection::new(camera)?.size();
        let rows = Rows::new(scene)?;
        let options = Options {
            size,
            // One sample in the middle of each pixel: lines are compared with what is there.
            filter: Filter::Box,
            aovs: vec![Aov::Depth, Aov::Id, Aov::ShadingNormal],
            trace_camera: false,
            threads,
            bounces: None,
            hide_emitters: false,
            lighting: Default::default(),
            seed: style.seed,
        };
        let stage = Stage::new(device, queue, &rows, &options)?;
        let Film { width, height, crop, .. } = small_camera(camera).film;
        let [_, _, width, height] = crop.unwrap_or([0, 0, width, height]);
        // Direct light: what is thrown to and fro a wash does not show.
        let lit = Options { size: [width, height], aovs: vec![Aov::Id], bounces: Some(1), ..options.clone() };
        let light = Stage::new(device, queue, &rows, &lit)?;
        let hand = hand(&style, size, [1.0, 1.0]);
        let materials = Materials {
            paper: style.paper,
            pigments: style.pigments,
            full: hand.radius(1.0),
            bleed: style.controls.bleed,
            roughness: style.controls.roughness,
            unit: hand.unit,
            seed: style.seed,
        };
        let canvas = Canvas::new(device, queue, size, &materials, &Resolve::default())?;
        let mut painter = Self {
            device: device.clone(),
            queue: queue.clone(),
            rows,
            topologies: HashMap::new(),
            stage,
            light,
            options: [options, lit],
            canvas,
            style,
            size,
            space: scene.working_space,
            tracker: Tracker::default(),
        };
        painter.find_topologies();
        Ok(painter)
    }

    /// The canvas, which holds what was painted last.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// Takes over another pose of the scene. Creases, borders and what is welded stay those of the first.
    pub fn pose(&mut self, scene: &Scene) -> Result<(), InkError> {
        self.rows.pose(scene)?;
        for (stage, options) in [&mut self.stage, &mut self.light].into_iter().zip(&self.options) {
            if !stage.pose(&self.rows)? {
                *stage = Stage::new(&self.device, &self.queue, &self.rows, options)?;
            }
        }
        self.find_topologies();
        Ok(())
    }

    /// Those of meshes that are not known yet, or were others.
    fn find_topologies(&mut self) {
        let _span = tracing::info_span!("find_edges").entered();
        for draw in &self.rows.draws {
            let MeshRow { first_vertex, vertices, first_triangle, triangles } =
                self.rows.meshes[draw.mesh as usize];
            let range = |first: u32, count: u32| first as usize..(first + count) as usize;
            let of_mesh = &self.rows.triangles[range(first_triangle, triangles)];
            let use_normals = draw.flags & DrawRow::HAS_NORMALS != 0;
            let hash = joined(of_mesh, first_vertex);
            let known = self.topologies.get(&(draw.mesh, use_normals));
            if known.is_some_and(|k| k.vertices == vertices && k.triangles == hash) {
                continue;
            }
            let of_vertices = &self.rows.vertices[range(first_vertex, vertices)];
            let topology =
                Topology::new(of_vertices, of_mesh, first_vertex, &self.style.creases, use_normals);
            self.topologies.insert((draw.mesh, use_normals), Known { vertices, triangles: hash, topology });
        }
    }

    /// Lets go of the strokes of the frames before: the next one is painted as a picture by itself.
    pub fn forget(&mut self) {
        self.tracker.forget();
    }

    /// Follows strokes through a frame that is not painted, and says what became of them.
    pub fn follow(&mut self, camera: &Camera) -> Result<(Vec<Stroke>, Change), InkError> {
        let projection = Projection::new(camera)?;
        let (_, map) = self.see(camera, &projection)?;
        let (strokes, _) = self.strokes(&projection, &map);
        Ok((strokes, self.tracker.change()))
    }

    /// What is where.
    fn see(&mut self, camera: &Camera, projection: &Projection) -> Result<(Image, DepthMap), InkError> {
        let _span = tracing::info_span!("see").entered();
        // One sample in the middle of each pixel, whatever was seen before.
        self.stage.place(&self.rows.draws)?;
        self.stage.frame(camera)?;
        let seen = self.stage.image()?;
        let map = DepthMap::new(&seen, projection)
            .ok_or_else(|| InkError::Refused("the picture lacks depth".into()))?;
        Ok((seen, map))
    }

    /// The strokes of contours, creases and borders from the back to the front, as those of the frame before go on; and what
    /// is too small for them.
    fn strokes(&mut self, projection: &Projection, map: &DepthMap) -> (Vec<Stroke>, Vec<Small>) {
        let _span = tracing::info_span!("find_strokes").entered();
        let (lines, dots) = self.lines(projection, map);
        let hand = hand(&self.style, self.size, depths(map));
        let pieces = hand.all_pieces(&lines);
        let is_free = |pixel: Vec2, depth: f32| map.at(pixel).0 > depth * (1.0 - COVERS);
        let mut strokes = self.tracker.strokes(pieces, &hand, &is_free);
        // A painter lets near things overlap far ones.
        let depth = |s: &Stroke| s.points.iter().map(|p| p.depth).sum::<f32>() / s.points.len().max(1) as f32;
        strokes.sort_by(|a, b| depth(b).total_cmp(&depth(a)).then(a.id.cmp(&b.id)));
        (strokes, dots)
    }

    /// Paints what `camera` sees of the scene; after another frame, with the strokes that it had ([`crate::tracking`]).
    pub fn paint(&mut self, camera: &Camera) -> Result<Painting, InkError> {
        let projection = Projection::new(camera)?;
        let (seen, map) = self.see(camera, &projection)?;
        let tones = {
            let _span = tracing::info_span!("see_light").entered();
            let small = small_camera(camera);
            self.light.place(&self.rows.draws)?;
            for _ in 0..FRAMES {
                self.light.frame(&small)?;
            }
            let lit = self.light.image()?;
            let light = self.style.controls.light;
            Tones::new(&seen, &lit, &map, &projection, self.space, light)
                .ok_or_else(|| InkError::Refused("the picture lacks normals or light".into()))?
        };
        let (strokes, dots) = self.strokes(&projection, &map);
        let hand = hand(&self.style, self.size, depths(&map));
        let mut layers: [Vec<Stamp>; LAYERS] = Default::default();
        let (controls, unit, seed) = (&self.style.controls, hand.unit, self.style.seed);
        let small: HashSet<u32> = dots.iter().map(|(draw, _)| *draw).collect();
        let near = |depth| hand.nearness(depth);
        let surfaces = Surfaces {
            rows: &self.rows,
            without: &small,
            projection: &projection,
            map: &map,
            tones: &tones,
            controls,
            unit,
            near: &near,
            seed,
        };
        layers[Layer::Wash as usize] = wash::stamps(&surfaces);
        let wrinkles = wrinkle::strokes(self.style.manner, &surfaces);
        for stroke in &wrinkles {
            stamp::along(stroke, hand.radius(1.0), &mut layers[Layer::Wrinkle as usize]);
        }
        for stroke in &strokes {
            stamp::along(stroke, hand.radius(1.0), &mut layers[Layer::Contour as usize]);
        }
        layers[Layer::Dot as usize] = dots.into_iter().filter_map(|(_, stamp)| stamp).collect();
        let _span = tracing::info_span!("paint", stamps = layers[Layer::Contour as usize].len()).entered();
        self.canvas.outline(&map.shape);
        self.canvas.paint(&layers);
        let stamps = layers.map(|l| l.len());
        Ok(Painting { strokes, wrinkles, stamps, change: self.tracker.change() })
    }

    /// The brush's state at each pixel as the first pass of the slides has it ([`literal`]), for contours.
    pub fn see_literally(&mut self, camera: &Camera) -> Result<Vec<Padi>, InkError> {
        let projection = Projection::new(camera)?;
        let (_, map) = self.see(camera, &projection)?;
        let middle = self.rows.draws.iter().map(|d| DVec3::from_array(d.to_world.map(|r| f64::from(r[3]))));
        let middle = middle.sum::<DVec3>() / self.rows.draws.len().max(1) as f64;
        let v = projection.to_eye(middle);
        let theta = |at: DVec3, n: DVec3| projection.direction(at, n).as_vec2().to_angle();
        let mut segments = Vec::new();
        self.each_surface(|surface, topology, _, _| {
            segments.extend(literal::silhouettes(surface, topology, v, theta));
        });
        // The greatest pressure on the side away from the light.
        let phi = std::f32::consts::FRAC_PI_2 - hand(&self.style, self.size, [1.0, 1.0]).shade.to_angle();
        Ok(literal::padi(&segments, &projection, &map, phi))
    }

    /// What the slides of Xu, Yang and Wu make of the contours ([`literal`]): black ink over the paper's colour, R, G, B, linear
    /// sRGB.
    pub fn paint_literally(&mut self, camera: &Camera) -> Result<Image, InkError> {
        let padi = self.see_literally(camera)?;
        let hand = hand(&self.style, self.size, [1.0, 1.0]);
        let seed = self.style.seed;
        let masks: Vec<Footprint> =
            (0..VARIANTS as u32).map(|i| Footprint::new(seed, i, self.style.controls.roughness)).collect();
        let alpha = literal::particles(&padi, self.size, &masks, hand.radius(1.0), seed);
        let paper = self.style.paper.rgb();
        let mut image = Image::rgb(self.size[0] as usize, self.size[1] as usize);
        for (pixel, a) in image.data.chunks_exact_mut(3).zip(alpha) {
            pixel.copy_from_slice(&(paper * (1.0 - a)).to_array());
        }
        Ok(image)
    }

    /// Calls for each placed mesh that has a surface: it, its topology, index and row of its draw.
    fn each_surface(&self, mut f: impl FnMut(&Surface, &Topology, u32, &DrawRow)) {
        for (i, draw) in (0u32..).zip(&self.rows.draws) {
            let use_normals = draw.flags & DrawRow::HAS_NORMALS != 0;
            let Some(Known { topology, .. }) = self.topologies.get(&(draw.mesh, use_normals)) else {
                continue;
            };
            let MeshRow { first_vertex, vertices, .. } = self.rows.meshes[draw.mesh as usize];
            let vertices = &self.rows.vertices[first_vertex as usize..(first_vertex + vertices) as usize];
            let move_to_world = to_world(draw);
            let place =
                |v: u32| move_to_world(DVec3::from_array(vertices[v as usize].position.map(f64::from)));
            f(&Surface::new(topology, vertices, draw, &place), topology, i, draw);
        }
    }

    /// Where a vertex of a draw, counted from the first of its mesh, is in the world.
    fn place(&self, draw: u32, vertex: u32) -> Option<DVec3> {
        let draw = self.rows.draws.get(draw as usize)?;
        let MeshRow { first_vertex, vertices, .. } = *self.rows.meshes.get(draw.mesh as usize)?;
        let row = self.rows.vertices.get((first_vertex + vertex) as usize).filter(|_| vertex < vertices)?;
        Some(to_world(draw)(DVec3::from_array(row.position.map(f64::from))))
    }

    /// The lines that are drawn, and the draws that are too small for lines, with their dots where they are seen.
    fn lines(&mut self, projection: &Projection, map: &DepthMap) -> (Vec<SampledLine>, Vec<Small>) {
        let detail = self.style.controls.detail;
        let unit = unit(self.size);
        let hand = hand(&self.style, self.size, depths(map));
        let (mut lines, mut dots) = (Vec::new(), Vec::new());
        self.each_surface(|surface, _, i, draw| {
            if let Some(dot) = dot::dot(&surface.positions, projection, map, &hand, i, draw.shape) {
                dots.push((i, dot));
                return;
            }
            for line in surface.lines(projection, i) {
                lines.extend(sample(&line, draw.shape, projection, map));
            }
        });
        let known = {
            let mut tracker = std::mem::take(&mut self.tracker);
            let project = |draw: u32, foothold: &Foothold| {
                let at = projection.project(foothold.position(|v| self.place(draw, v))?)?;
                Some((at.pixel.as_vec2(), at.depth as f32))
            };
            tracker.recall(&mut lines, &project, unit);
            self.tracker = tracker;
            self.tracker.has_memory()
        };
        let cleaning = Cleaning::default();
        let cleaning = Cleaning {
            vote: cleaning.vote * unit.max(0.7),
            bridge: cleaning.bridge * unit.max(0.7),
            crumb: cleaning.crumb * unit.max(0.7),
        };
        lines.iter_mut().for_each(|l| l.clean(&cleaning));
        lines.retain(|l| l.samples.iter().any(|s| s.visible));
        select(&mut lines, detail, unit, known);
        (lines, dots)
    }

    /// The strokes of a painting as SVG. `name`: of a shape by its number, counted from one.
    pub fn svg(&self, painting: &Painting, name: &dyn Fn(u32) -> String, frame: Option<u32>) -> String {
        let drawing = Drawing {
            size: self.size,
            paper: self.style.paper.rgb(),
            shade: &|load| self.canvas.shade(Layer::Contour, load),
            name,
            frame,
        };
        svg(&[(Layer::Wrinkle, &painting.wrinkles), (Layer::Contour, &painting.strokes)], &drawing)
    }

    /// The picture: R, G, B, linear sRGB; with `layers` each of them besides, as NAME.R, G, B and A.
    pub fn image(&self, layers: bool) -> Result<Image, InkError> {
        let picture = self.canvas.picture()?;
        if !layers {
            return Ok(picture);
        }
        let parts = Layer::ALL.map(|l| self.canvas.layer(l).map(|image| (l, image)));
        let parts: Vec<(Layer, Image)> = parts.into_iter().collect::<Result<_, _>>()?;
        let names = parts.iter().flat_map(|(l, _)| ["R", "G", "B", "A"].map(|c| format!("{}.{c}", l.name())));
        let channels: Vec<String> = picture.channels.iter().cloned().chain(names).collect();
        let mut data = Vec::with_capacity(picture.width * picture.height * channels.len());
        for (i, pixel) in picture.data.chunks_exact(3).enumerate() {
            data.extend_from_slice(pixel);
            parts.iter().for_each(|(_, part)| data.extend_from_slice(&part.data[4 * i..4 * i + 4]));
        }
        Ok(Image { channels, data, ..picture })
    }
}

/// A number of which corners triangles join, vertices being counted from the first.
fn joined(triangles: &[[u32; 3]], first: u32) -> u64 {
    let mut hasher = std::hash::DefaultHasher::new();
    triangles.iter().for_each(|t| t.map(|v| v.wrapping_sub(first)).hash(&mut hasher));
    hasher.finish()
}

/// The camera with a picture for light.
fn small_camera(camera: &Camera) -> Camera {
    let mut small = camera.clone();
    let Film { width, height, crop, .. } = small.film;
    if let Some([_, _, w, h]) = crop {
        // A part of the picture is small already.
        small.film.crop = crop.filter(|_| w > 0 && h > 0);
        return small;
    }
    small.resize(width.div_ceil(COARSE), height.div_ceil(COARSE));
    small
}

/// Pixels that stand for one in a picture of 1080 lines.
pub fn unit(size: [u32; 2]) -> f32 {
    size[1] as f32 / 1080.0
}

fn hand(style: &Style, size: [u32; 2], depths: [f32; 2]) -> Hand {
    Hand {
        controls: style.controls,
        unit: unit(size),
        depths,
        // Light from the upper left, as where a right-handed painter has his lamp.
        shade: Vec2::new(0.55, 0.835),
        seed: style.seed,
    }
}

/// Depth before which one part in fifty of what is seen lies, and behind which another does.
fn depths(map: &DepthMap) -> [f32; 2] {
    let mut all: Vec<f32> = map.depth.iter().copied().filter(|d| d.is_finite()).step_by(7).collect();
    if all.is_empty() {
        return [1.0, 1.0];
    }
    all.sort_by(f32::total_cmp);
    [all[all.len() / 50], all[all.len() - 1 - all.len() / 50]]
}
