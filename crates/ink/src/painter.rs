//! From a scene to its painting.

use crate::InkError;
use crate::brush::Bristles;
use crate::canvas::{BRUSHED, Canvas, LAYERS, Layer, Materials};
use crate::contour::{LineKind, MeshPoint, Surface, to_world};
use crate::control::Controls;
use crate::depth::DepthMap;
use crate::dot;
use crate::mist::Mist;
use crate::mount::Mounting;
use crate::paper::{PAPERS, Paper};
use crate::pigment::{PIGMENTS, Pigment};
use crate::place_controls::PlaceControls;
use crate::projection::Projection;
use crate::resolve::Resolve;
use crate::rub;
use crate::scatter::Surfaces;
use crate::select::{Detail, select};
use crate::signature::{Mark, Signature};
use crate::stamp::{self, Stamp};
use crate::steering::{Names, Steering, StrokeEdit};
use crate::stroke::{Hand, Stroke};
use crate::svg::{Drawing, svg};
use crate::texture_coordinates::TextureCoordinates;
use crate::tone::Tones;
use crate::topology::{Creases, Topology};
use crate::tracking::{Change, Tracker};
use crate::visibility::{Cleaning, Sample, SampledLine, sample};
use crate::wash;
use crate::wrinkle::{self, MANNERS, Manner};
use glam::{DVec3, Vec2};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::hash::{Hash, Hasher};
use std::sync::{Arc, OnceLock};
use wgpu::{Device, Queue};
use yugen_optics::{ColourSpace, Image};
use yugen_realtime::{Options, Stage};
use yugen_scene::prepared::{DrawRow, MeshRow, Rows};
use yugen_scene::{Aov, Camera, Film, Filter, Scene};

mod literally;
mod live;
mod masked;

use live::Sight;

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
    /// What is otherwise of single objects and strokes.
    pub steering: Steering,
    /// Inscription and seal.
    pub signature: Option<Arc<Signature>>,
    /// The bristles of the brush, where they are those of a picture.
    pub brush: Option<Arc<Bristles>>,
    /// Same seed, same painting.
    pub seed: u32,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            controls: Controls::default(),
            paper: &PAPERS[0],
            pigments: pigments(&PIGMENTS[0]),
            manner: &MANNERS[0],
            creases: Creases::default(),
            steering: Steering::default(),
            signature: None,
            brush: None,
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
    /// What is painted on, and one of another size or other materials that was before.
    canvas: Canvas,
    spare: Option<Canvas>,
    /// What was seen last in this pose, by different cameras.
    sights: Vec<Sight>,
    /// What is written and pressed on the canvas.
    marks: Vec<Mark>,
    /// The prints of the last painting.
    stamps: [Vec<Stamp>; BRUSHED],
    style: Style,
    names: Names,
    /// The controls of each place of each draw, and what of single strokes is otherwise.
    place_controls: Arc<PlaceControls>,
    edits: Arc<BTreeMap<u32, StrokeEdit>>,
    /// Of those strokes, the ones that no frame has had yet.
    unmet: BTreeSet<u32>,
    size: [u32; 2],
    space: ColourSpace,
    tracker: Tracker,
    mist: Mist,
}

/// A topology, and the triangles that it is of.
struct Known {
    vertices: u32,
    triangles: u64,
    topology: Topology,
    /// Where masks lie on it, once that is asked.
    coordinates: OnceLock<TextureCoordinates>,
}

/// Pixels of the picture across one in which light is looked at: a fifth of a small print of the wash.
const COARSE: u32 = 2;
/// Samples of light to a pixel: prints are means of dozens to hundreds of pixels, so that noise does not show.
const FRAMES: u32 = 4;

/// Seconds over which the light of fires is a mean where it does not flicker at all.
const CALM: f64 = 2.0;

/// A draw that is too small for lines, and its dot where it is seen.
type Small = (u32, Option<Stamp>);

/// A painting.
#[derive(Clone, Debug)]
pub struct Painting {
    /// The strokes of contours, in the order in which they are painted.
    pub strokes: Vec<Stroke>,
    /// The strokes of wrinkles.
    pub wrinkles: Vec<Stroke>,
    /// Stamps of each layer that is painted by brush, in the order of [`Layer::ALL`].
    pub stamps: [usize; BRUSHED],
    /// What became of the strokes of the frame before.
    pub change: Change,
}

/// What mist leaves of a line where it is lost: with less than a twelfth of its ink it would only be a smear.
const SUNK: f32 = 0.08;

/// Relative depth by which something must be nearer to cover a stroke that goes.
const COVERS: f32 = 0.01;

impl Painting {
    /// The contour stroke at a place in the picture, pixels: of those within `reach` of it the nearest, of several that cover it
    /// the one painted last.
    pub fn stroke_at(&self, pixel: Vec2, reach: f32) -> Option<&Stroke> {
        let near = self.strokes.iter().map(|s| (s.distance(pixel).max(0.0), s)).filter(|(d, _)| *d <= reach);
        near.reduce(|best, next| if next.0 <= best.0 { next } else { best }).map(|(_, stroke)| stroke)
    }
}

impl Painter {
    /// For pictures of `scene` in any of its poses, at first of `camera`'s size. `threads` prepare it.
    pub fn new(
        device: &Device,
        queue: &Queue,
        scene: &Scene,
        camera: &Camera,
        style: Style,
        threads: usize,
    ) -> Result<Self, InkError> {
        let size = Projection::new(camera)?.size();
        let rows = Rows::new(lit_scene(scene, &style)?.as_ref())?;
        let names = Names::of(scene);
        let place_controls = place_controls(&style, &rows, &names);
        let options = Options {
            // One sample in the middle of each pixel: lines are compared with what is there.
            filter: Filter::Box,
            aovs: masked::aovs(&place_controls),
            seed: style.seed,
            threads,
            ..Options::new(size, None)
        };
        let stage = Stage::new(device, queue, &rows, &options)?;
        let Film { width, height, crop, .. } = small_camera(camera).film;
        let [_, _, width, height] = crop.unwrap_or([0, 0, width, height]);
        // Direct light: what is thrown to and fro a wash does not show.
        let lit = Options { size: [width, height], aovs: vec![Aov::Id], bounces: Some(1), ..options.clone() };
        let light = Stage::new(device, queue, &rows, &lit)?;
        let edits = Arc::new(style.steering.strokes.clone());
        let canvas = Canvas::new(device, queue, size, &materials(&style, size), &Resolve::default())?;
        let mut painter = Self {
            device: device.clone(),
            queue: queue.clone(),
            rows,
            topologies: HashMap::new(),
            stage,
            light,
            options: [options, lit],
            canvas,
            spare: None,
            sights: Vec::new(),
            marks: Vec::new(),
            stamps: Default::default(),
            style,
            names,
            place_controls,
            unmet: edits.keys().copied().collect(),
            edits,
            size,
            space: scene.working_space,
            tracker: Tracker::default(),
            mist: mist(scene),
        };
        painter.find_topologies();
        painter.mark()?;
        Ok(painter)
    }

    /// The canvas, which holds what was painted last.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// Takes over another pose of the scene. Creases, borders and what is welded stay those of the first.
    pub fn pose(&mut self, scene: &Scene) -> Result<(), InkError> {
        let scene = lit_scene(scene, &self.style)?;
        self.take_over(&scene)
    }

    /// The same to [`Painter::follow`] strokes alone: of its light nothing is seen, and so no mean of its fires is made.
    pub fn pose_to_follow(&mut self, scene: &Scene) -> Result<(), InkError> {
        self.take_over(scene)
    }

    fn take_over(&mut self, scene: &Scene) -> Result<(), InkError> {
        self.sights.clear();
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
            let known = Known { vertices, triangles: hash, topology, coordinates: OnceLock::new() };
            self.topologies.insert((draw.mesh, use_normals), known);
        }
    }

    /// A sentence for each stroke that something is otherwise of and that no frame has had so far.
    pub fn unmet_strokes(&self) -> Vec<String> {
        let sentence =
            |id| format!("[stroke.{id:08x}] changes nothing: no contour was drawn that has this data-id");
        self.unmet.iter().map(sentence).collect()
    }

    /// Lets go of the strokes of the frames before: the next one is painted as a picture by itself.
    pub fn forget(&mut self) {
        self.tracker.forget();
    }

    /// Follows strokes through a frame that is not painted, and says what became of them.
    pub fn follow(&mut self, camera: &Camera) -> Result<(Vec<Stroke>, Change), InkError> {
        let projection = Projection::new(camera)?;
        let map = match self.depth(&projection) {
            Some(map) => map,
            None => self.see(camera, &projection)?.1,
        };
        let hand = self.hand(depths(&map));
        let (strokes, _) = self.strokes(&projection, &map, &hand);
        Ok((strokes, self.tracker.change()))
    }

    /// What is in front, where everything is opaque.
    fn depth(&self, projection: &Projection) -> Option<DepthMap> {
        let _span = tracing::info_span!("fill_depth").entered();
        let winding = |draw: &DrawRow| {
            let topology = self.topology(draw).filter(|t| t.solid);
            topology.map(|t| t.winding)
        };
        DepthMap::of(&self.rows, projection, &winding, self.options[0].threads)
    }

    /// What is where, as the real-time renderer sees it; what is in front of it.
    fn see(&mut self, camera: &Camera, projection: &Projection) -> Result<(Image, DepthMap), InkError> {
        let _span = tracing::info_span!("see").entered();
        let aovs = masked::aovs(&self.place_controls);
        if aovs != self.options[0].aovs {
            self.options[0].aovs = aovs;
            self.stage = Stage::new(&self.device, &self.queue, &self.rows, &self.options[0])?;
        }
        self.stage.resize(projection.size())?;
        self.options[0].size = projection.size();
        // One sample in the middle of each pixel, whatever was seen before.
        self.stage.place(&self.rows.draws)?;
        self.stage.frame(camera)?;
        let seen = self.stage.image()?;
        // The same lines whether they are painted or only followed.
        let map = self.depth(projection).or_else(|| DepthMap::new(&seen, projection));
        Ok((seen, map.ok_or_else(|| InkError::Refused("the picture lacks depth".into()))?))
    }

    /// The strokes of contours, creases and borders from the back to the front, as those of the frame before go on; and what
    /// is too small for them.
    fn strokes(&mut self, projection: &Projection, map: &DepthMap, hand: &Hand) -> (Vec<Stroke>, Vec<Small>) {
        let _span = tracing::info_span!("find_strokes").entered();
        let (lines, dots) = self.lines(projection, map, hand);
        let pieces = hand.all_pieces(&lines);
        let is_free = |pixel: Vec2, depth: f32| map.at(pixel).0 > depth * (1.0 - COVERS);
        let mut strokes = self.tracker.strokes(pieces, hand, &is_free);
        strokes.iter().for_each(|s| {
            self.unmet.remove(&s.id);
        });
        strokes.retain(|s| !self.edits.get(&s.id).is_some_and(|edit| edit.hide));
        // A painter lets near things overlap far ones.
        let depth = |s: &Stroke| s.points.iter().map(|p| p.depth).sum::<f32>() / s.points.len().max(1) as f32;
        strokes.sort_by(|a, b| depth(b).total_cmp(&depth(a)).then(a.id.cmp(&b.id)));
        (strokes, dots)
    }

    /// Paints what `camera` sees of the scene; after another frame, with the strokes that it had ([`crate::tracking`]).
    pub fn paint(&mut self, camera: &Camera) -> Result<Painting, InkError> {
        self.paint_while(camera, &|| true)
    }

    /// The same, given up with [`InkError::Stopped`] where `wanted` says between two steps that nobody wants it any more.
    pub fn paint_while(&mut self, camera: &Camera, wanted: &dyn Fn() -> bool) -> Result<Painting, InkError> {
        let projection = Projection::new(camera)?;
        self.fit(projection.size())?;
        let sight = self.sight(camera, &projection, wanted)?;
        let painting = self.paint_seen(&sight, &projection, wanted);
        self.keep(sight);
        painting
    }

    fn paint_seen(
        &mut self,
        Sight { seen, lit, map, .. }: &Sight,
        projection: &Projection,
        wanted: &dyn Fn() -> bool,
    ) -> Result<Painting, InkError> {
        let tones = Tones::new(seen, lit, map, projection, self.space, self.style.controls.light)
            .ok_or_else(|| InkError::Refused("the picture lacks normals or light".into()))?;
        let hand = self.hand(depths(map));
        let (strokes, dots) = self.strokes(projection, map, &hand);
        go_on(wanted)?;
        let mut layers: [Vec<Stamp>; BRUSHED] = Default::default();
        let (unit, seed) = (hand.unit, self.style.seed);
        let small: HashSet<u32> = dots.iter().map(|(draw, _)| *draw).collect();
        let near = |depth| hand.nearness(depth);
        let (mist, eye) = (self.mist, projection.eye());
        let mist = |point: DVec3, thick: f32| mist.left(eye, point, thick);
        let surfaces = Surfaces {
            rows: &self.rows,
            without: &small,
            projection,
            map,
            tones: &tones,
            place_controls: &self.place_controls,
            unit,
            near: &near,
            mist: &mist,
            seed,
        };
        layers[Layer::Wash as usize] = wash::stamps(&surfaces);
        go_on(wanted)?;
        let wrinkles = wrinkle::strokes(self.style.manner, &surfaces);
        for stroke in &wrinkles {
            stamp::along(stroke, hand.radius(1.0), &mut layers[Layer::Wrinkle as usize]);
        }
        layers[Layer::Rub as usize] = rub::stamps(&surfaces);
        for stroke in &strokes {
            stamp::along(stroke, hand.radius(1.0), &mut layers[Layer::Contour as usize]);
        }
        layers[Layer::Dot as usize] = dots.into_iter().filter_map(|(_, stamp)| stamp).collect();
        go_on(wanted)?;
        let _span = tracing::info_span!("paint", stamps = layers[Layer::Contour as usize].len()).entered();
        self.canvas.outline(&map.shape);
        self.canvas.paint(&layers);
        let stamps = std::array::from_fn(|i| layers[i].len());
        self.stamps = layers;
        Ok(Painting { strokes, wrinkles, stamps, change: self.tracker.change() })
    }

    fn hand(&self, depths: [f32; 2]) -> Hand {
        let (place_controls, edits) = (self.place_controls.clone(), self.edits.clone());
        Hand { place_controls, edits, depths, ..plain_hand(&self.style, self.size) }
    }

    /// Paints the last painting anew up to a part of its prints, 0 to 1, in the order in which they are put down; wet ink dries as it
    /// does in the whole.
    pub fn repaint(&self, part: f64) {
        self.lay(part >= 1.0);
        let all: usize = self.stamps.iter().map(Vec::len).sum();
        let mut left = (part.clamp(0.0, 1.0) * all as f64).ceil() as usize;
        let layers: [Vec<Stamp>; BRUSHED] = std::array::from_fn(|i| {
            let count = self.stamps[i].len().min(left);
            left -= count;
            self.stamps[i][..count].to_vec()
        });
        self.canvas.paint(&layers);
    }

    fn topology(&self, draw: &DrawRow) -> Option<&Topology> {
        let use_normals = draw.flags & DrawRow::HAS_NORMALS != 0;
        self.topologies.get(&(draw.mesh, use_normals)).map(|known| &known.topology)
    }

    /// Calls for each placed mesh that has a surface: it, its topology, index and row of its draw.
    fn each_surface(&self, mut f: impl FnMut(&Surface, &Topology, u32, &DrawRow)) {
        for (i, draw) in (0u32..).zip(&self.rows.draws) {
            let Some(topology) = self.topology(draw) else { continue };
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
    fn lines(
        &mut self,
        projection: &Projection,
        map: &DepthMap,
        hand: &Hand,
    ) -> (Vec<SampledLine>, Vec<Small>) {
        let unit = hand.unit;
        let (mut lines, mut dots) = (Vec::new(), Vec::new());
        let (mist, eye) = (self.mist, projection.eye());
        self.each_surface(|surface, _, i, draw| {
            let controls = |pixel: Vec2| self.controls_of_small(i, pixel / hand.size);
            let hand = hand.of(i);
            if let Some(dot) = dot::dot(&surface.positions, projection, map, &hand, &controls, i, draw.shape)
            {
                let misty = self.place_controls.most(i).mist > 0.0;
                let left = |d: &Stamp| match surface.positions.first() {
                    Some(p) if misty => mist.left(eye, *p, controls(d.pixel.into()).mist),
                    _ => 1.0,
                };
                dots.push((i, dot.map(|d| Stamp { ink: d.ink * left(&d), ..d })));
                return;
            }
            let to_eye = |p| projection.to_eye(p);
            let suggestive = match self.place_controls.most(i).suggestive > 0.0 {
                true => surface.suggestive_contours(&to_eye, i),
                false => Vec::new(),
            };
            for line in surface.lines(projection, i).into_iter().chain(suggestive) {
                lines.extend(sample(&line, draw.shape, projection, map));
            }
        });
        for line in &mut lines {
            let on_surface = self.place_controls.is_on_surface(line.draw);
            for sample in &mut line.samples {
                if on_surface {
                    sample.uv = self.uv(line.draw, &sample.mesh_point);
                }
                let c = hand.at(line.draw, sample);
                // Where there is to be no ink of it there is no stroke.
                let of_kind = if line.kind == LineKind::Suggestive { c.suggestive } else { 1.0 };
                sample.visible &= c.ink * c.contour * of_kind > 0.0;
            }
        }
        for line in &mut lines {
            if self.place_controls.most(line.draw).mist > 0.0 {
                for sample in &mut line.samples {
                    let thick = hand.at(line.draw, sample).mist;
                    let point = sample.mesh_point.position(|v| self.place(line.draw, v));
                    let left = point.map_or(1.0, |p| mist.left(eye, p, thick));
                    sample.strength *= left;
                    sample.visible &= left > SUNK;
                }
            }
        }
        let known = {
            let mut tracker = std::mem::take(&mut self.tracker);
            let project = |draw: u32, mesh_point: &MeshPoint| {
                let at = projection.project(mesh_point.position(|v| self.place(draw, v))?)?;
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
            shortest: cleaning.shortest * unit.max(0.7),
        };
        lines.iter_mut().for_each(|l| l.clean(&cleaning));
        lines.retain(|l| l.samples.iter().any(|s| s.visible));
        let detail = |draw: u32, sample: &Sample| hand.at(draw, sample).detail;
        if !known {
            pin(&mut lines, hand, &detail);
        }
        select(&mut lines, &detail, unit, known);
        (lines, dots)
    }

    /// The strokes of a painting as SVG. `name`: of a shape by its number, counted from one.
    pub fn svg(
        &self,
        painting: &Painting,
        name: &dyn Fn(u32) -> String,
        mounting: Option<&Mounting>,
        frame: Option<u32>,
    ) -> String {
        let drawing = Drawing {
            size: self.size,
            paper: self.style.paper.rgb(),
            shade: &|load| self.canvas.shade(Layer::Contour, load),
            name,
            marks: &self.marks,
            of_marks: &|layer| self.canvas.shade(layer, 1.0),
            mounting,
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
        let used = |l: &Layer| (*l as usize) < BRUSHED || self.marks.iter().any(|m| m.layer == *l);
        let parts = Layer::ALL.into_iter().filter(used).map(|l| Ok((l, self.canvas.layer(l)?)));
        let parts: Vec<(Layer, Image)> = parts.collect::<Result<_, InkError>>()?;
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

/// The scene by whose light washes are painted: films are to be free of what fires do faster than `flicker` lets through.
fn lit_scene<'a>(scene: &'a Scene, style: &Style) -> Result<Cow<'a, Scene>, InkError> {
    let window = CALM * f64::from(1.0 - style.controls.flicker);
    let still = window <= 0.0 || scene.fires.is_empty();
    Ok(if still { Cow::Borrowed(scene) } else { Cow::Owned(scene.with_mean_flames(window)?) })
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

/// One for all that is painted and written with ink; seals are cinnabar.
pub(crate) fn pigments(ink: &'static Pigment) -> [&'static Pigment; LAYERS] {
    let mut pigments = [ink; LAYERS];
    pigments[Layer::Seal as usize] = Pigment::find("cinnabar").unwrap_or(ink);
    pigments
}

/// [`InkError::Stopped`] where it is not wanted any more.
fn go_on(wanted: &dyn Fn() -> bool) -> Result<(), InkError> {
    if wanted() { Ok(()) } else { Err(InkError::Stopped) }
}

/// Marks the samples of pinned strokes in the first frame, where no stroke has a name yet: those that pieces of the chosen lines
/// would have; of what is not chosen those that pieces of all lines would have.
fn pin(lines: &mut [SampledLine], hand: &Hand, detail: Detail) {
    let mut wanted: BTreeSet<u32> = hand.edits.iter().filter(|(_, e)| e.pin).map(|(id, _)| *id).collect();
    if wanted.is_empty() {
        return;
    }
    let place = |draw: u32, at: Vec2| (draw, at.to_array().map(f32::to_bits));
    let mut of_pinned = HashMap::new();
    let mut chosen = lines.to_vec();
    select(&mut chosen, detail, hand.unit, false);
    for lines in [&chosen[..], &*lines] {
        for piece in hand.all_pieces(lines) {
            let id = hand.own(&piece);
            if wanted.remove(&id) {
                of_pinned.extend(piece.samples.iter().map(|s| (place(piece.draw, s.line), id)));
            }
        }
    }
    for line in lines {
        let draw = line.draw;
        line.samples.iter_mut().for_each(|s| s.pinned = of_pinned.get(&place(draw, s.line)).copied());
    }
}

/// The controls of each draw, place by place.
fn place_controls(style: &Style, rows: &Rows, names: &Names) -> Arc<PlaceControls> {
    Arc::new(PlaceControls::new(&style.controls, &style.steering, &rows.draws, names))
}

/// What a style has the canvas made of.
fn materials(style: &Style, size: [u32; 2]) -> Materials {
    let hand = plain_hand(style, size);
    Materials {
        paper: style.paper,
        pigments: style.pigments,
        full: hand.radius(1.0),
        bleed: style.controls.bleed,
        roughness: style.controls.roughness,
        bristles: style.brush.clone(),
        unit: hand.unit,
        seed: style.seed,
    }
}

/// Over a scene as it stands.
fn mist(scene: &Scene) -> Mist {
    Mist::over(scene.bounds().unwrap_or_default().map(|p| p.as_dvec3()))
}

/// The hand where nothing is known of the scene.
fn plain_hand(style: &Style, size: [u32; 2]) -> Hand {
    Hand {
        controls: style.controls,
        place_controls: Arc::new(PlaceControls::plain(style.controls)),
        size: Vec2::from(size.map(|n| n as f32)),
        edits: Arc::default(),
        unit: unit(size),
        depths: [1.0, 1.0],
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
    let [near, far] = [all.len() / 50, all.len() - 1 - all.len() / 50];
    [near, far].map(|rank| *all.select_nth_unstable_by(rank, f32::total_cmp).1)
}
