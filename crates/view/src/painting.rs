//! Paints in ink beside the window's own work: a thread that paints what was last asked for.

use crate::mailbox::Mailbox;
use glam::Vec2;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};
use wgpu::{Device, Queue};
use yugen_ink::InkError;
use yugen_ink::mask::Ground;
use yugen_ink::mask::map::MaskMap;
use yugen_ink::painter::{Painter, Painting, Style};
use yugen_optics::Image;
use yugen_scene::{Camera, Scene};

/// Seconds that a painting may take without a smaller one before it: a control can be dragged by what is seen.
const QUICK: f64 = 0.25;
/// After a small painting so long is waited for another order before the whole one is begun.
const REST: Duration = Duration::from_millis(150);
/// Pixels of the painting across one of the smallest that comes before it.
const COARSEST: u32 = 4;

/// What is to be painted.
pub struct Order {
    /// In its pose, with what was changed.
    pub scene: Arc<Scene>,
    /// Count scenes, and other values of the same.
    pub of: [u64; 2],
    /// Through which.
    pub camera: Camera,
    /// How.
    pub style: Style,
    /// By the slides' method as well.
    pub literal: bool,
    /// Where a mask is seen that is painted on a surface: on what, and its pixels across and down.
    pub mask: Option<(Ground, [usize; 2])>,
    /// What [`Painted`] will call it.
    pub number: u64,
}

/// What was painted.
pub struct Painted {
    /// Of which order.
    pub number: u64,
    /// The picture, or why there is none.
    pub outcome: Result<Picture, String>,
}

/// A painting.
#[derive(Clone)]
pub struct Picture {
    /// R, G and B, linear sRGB.
    pub image: Arc<Image>,
    /// Its strokes.
    pub painting: Arc<Painting>,
    /// What the slides' method makes of the same, where that was asked for and is there.
    pub literal: Option<Arc<Image>>,
    /// Where the mask of the order is seen, or why it is not.
    pub mask: Option<Result<Arc<MaskMap>, String>>,
    /// Sentences about tables of the style that changed nothing.
    pub unmet: Arc<[String]>,
    /// In fewer pixels than were asked for; the whole one follows.
    pub draft: bool,
    /// That it took.
    pub seconds: f64,
}

impl Picture {
    /// The identity of the contour stroke at a place of the picture, 0 to 1 across and down; within eight pixels of it where
    /// the picture has 1080 lines, as hands miss so much.
    pub fn stroke_at(&self, [x, y]: [f32; 2]) -> Option<u32> {
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        let reach = 8.0 * (size.y / 1080.0).max(0.5);
        self.painting.stroke_at(Vec2::new(x, y) * size, reach).map(|s| s.id)
    }

    /// The way of a stroke, in parts of the picture.
    pub fn way(&self, id: u32) -> Vec<[f32; 2]> {
        let size = Vec2::new(self.image.width as f32, self.image.height as f32);
        let Some(stroke) = self.painting.strokes.iter().find(|s| s.id == id) else {
            return Vec::new();
        };
        let closing = stroke.points.first().filter(|_| stroke.closed);
        stroke.points.iter().chain(closing).map(|p| (p.pixel / size).to_array()).collect()
    }
}

/// A painter and what it has painted last.
struct Bench {
    painter: Painter,
    of: [u64; 2],
    scene: Arc<Scene>,
    painting: Option<Arc<Painting>>,
    /// What the last whole painting shows.
    view: Option<([u64; 2], Arc<Scene>, Camera)>,
    mask: Option<MaskSeen>,
}

/// Where a mask on a surface is seen.
struct MaskSeen {
    view: ([u64; 2], Arc<Scene>, Camera),
    mask: (Ground, [usize; 2]),
    /// By the depths of a smaller painting.
    draft: bool,
    map: Result<Arc<MaskMap>, String>,
}

/// A thread with a painter.
pub struct InkPainter {
    mailbox: Mailbox<Order, Painted>,
    bench: Arc<Mutex<Option<Bench>>>,
}

/// Why nothing can be saved.
pub const AT_WORK: &str = "there is no painting of this view yet: save it when there is";

impl InkPainter {
    /// On this device. `wake` is called when something was painted.
    pub fn new(device: &Device, queue: &Queue, wake: impl Fn() + Send + 'static) -> Self {
        let mailbox = Mailbox::default();
        let bench = Arc::new(Mutex::new(None));
        let (own, work): (Mailbox<Order, Painted>, _) = (mailbox.clone(), bench.clone());
        let gpu = (device.clone(), queue.clone());
        std::thread::spawn(move || {
            // How long the last whole painting took.
            let mut took = f64::INFINITY;
            while let Some(order) = own.next() {
                let put = |outcome: Result<Picture, String>| {
                    own.put(Painted { number: order.number, outcome });
                    wake();
                };
                let paint = || paint(&gpu, &work, &order, &own, &mut took, &put);
                // A fault must not leave the window waiting for ever.
                let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(paint));
                match done {
                    Ok(Ok(()) | Err(InkError::Stopped)) => {}
                    Ok(Err(problem)) => put(Err(problem.to_string())),
                    Err(_) => {
                        // What it has on its bench may be half done.
                        *lock(&work) = None;
                        put(Err("the scene could not be painted: this is a fault of the program".into()));
                    }
                }
            }
        });
        Self { mailbox, bench }
    }

    /// Asks for a painting instead of what was asked for before.
    pub fn ask(&self, order: Order) {
        self.mailbox.ask(order);
    }

    /// What was painted last.
    pub fn take(&self) -> Option<Painted> {
        self.mailbox.take()
    }

    /// The painting with a layer for each kind of stroke.
    pub fn layers(&self) -> Result<Image, String> {
        self.with(|bench, _| bench.painter.image(true).map_err(|e| e.to_string()))
    }

    /// Its strokes as SVG.
    pub fn svg(&self) -> Result<String, String> {
        self.with(|bench, painting| {
            let shapes = &bench.scene.shapes;
            let name = |shape: u32| shapes.get(shape as usize - 1).map_or(String::new(), |s| s.name.clone());
            Ok(bench.painter.svg(painting, &name, None, None))
        })
    }

    fn with<T>(&self, f: impl FnOnce(&Bench, &Painting) -> Result<T, String>) -> Result<T, String> {
        let bench = match self.bench.try_lock() {
            Ok(bench) => bench,
            Err(TryLockError::Poisoned(e)) => e.into_inner(),
            Err(TryLockError::WouldBlock) => return Err(AT_WORK.into()),
        };
        let ready = bench.as_ref().and_then(|b| Some((b, b.painting.clone()?)));
        let (bench, painting) = ready.ok_or(AT_WORK)?;
        f(bench, &painting)
    }
}

impl Drop for InkPainter {
    fn drop(&mut self) {
        self.mailbox.close();
    }
}

fn paint(
    (device, queue): &(Device, Queue),
    bench: &Mutex<Option<Bench>>,
    order: &Order,
    mailbox: &Mailbox<Order, Painted>,
    took: &mut f64,
    put: &dyn Fn(Result<Picture, String>),
) -> Result<(), InkError> {
    let mut draft = None;
    {
        let mut bench = lock(bench);
        let known = bench.take().filter(|b| b.of[0] == order.of[0]);
        let ready = match known {
            Some(mut known) => {
                let burns_otherwise =
                    known.painter.restyle(order.style.clone()) && !order.scene.fires.is_empty();
                if known.of != order.of {
                    known.painter.refill(&order.scene)?;
                } else if burns_otherwise || !Arc::ptr_eq(&known.scene, &order.scene) {
                    known.painter.pose(&order.scene)?;
                }
                *bench = Some(Bench { of: order.of, scene: order.scene.clone(), painting: None, ..known });
                bench.as_mut()
            }
            None => {
                let threads = yugen_optics::parallel::threads();
                let (camera, style) = (&order.camera, order.style.clone());
                let painter = Painter::new(device, queue, &order.scene, camera, style, threads)?;
                *took = f64::INFINITY;
                Some(bench.insert(Bench {
                    painter,
                    of: order.of,
                    scene: order.scene.clone(),
                    painting: None,
                    view: None,
                    mask: None,
                }))
            }
        };
        let part = (2..COARSEST).find(|p| *took / f64::from(p * p) <= QUICK).unwrap_or(COARSEST);
        if let (true, Some(bench)) = (*took > QUICK, ready) {
            let mut small = order.camera.clone();
            small.resize(small.film.width.div_ceil(part), small.film.height.div_ceil(part));
            draft = Some(picture(bench, order, &small, true, &|| true)?);
        }
    }
    let drawn = draft.is_some();
    if let Some(draft) = draft {
        put(Ok(draft));
        if mailbox.outdated_within(REST) {
            return Ok(());
        }
    }
    // What has no smaller one before it is not given up: where orders follow one another without end, nothing would be seen.
    let wanted = || !drawn || !mailbox.outdated();
    let whole = {
        let mut bench = lock(bench);
        let Some(bench) = bench.as_mut() else { return Ok(()) };
        let whole = picture(bench, order, &order.camera, false, &wanted)?;
        bench.painting = Some(whole.painting.clone());
        // What was seen before is not looked at again for another style, and says little of how long another view takes.
        let view = view_of(order);
        let same = bench.view.as_ref().is_some_and(|known| is_same(known, &view));
        *took = if same { took.max(whole.seconds) } else { whole.seconds };
        bench.view = Some(view);
        whole
    };
    // The window may ask for layers as soon as it knows, so the painter is free by then.
    put(Ok(whole.clone()));
    if order.literal && !mailbox.outdated() {
        let literal = {
            let mut bench = lock(bench);
            let Some(bench) = bench.as_mut() else { return Ok(()) };
            bench.painter.paint_literally(&order.scene, &order.camera)?
        };
        put(Ok(Picture { literal: Some(Arc::new(literal)), ..whole }));
    }
    Ok(())
}

fn view_of(order: &Order) -> ([u64; 2], Arc<Scene>, Camera) {
    (order.of, order.scene.clone(), order.camera.clone())
}

fn is_same(a: &([u64; 2], Arc<Scene>, Camera), b: &([u64; 2], Arc<Scene>, Camera)) -> bool {
    a.0 == b.0 && Arc::ptr_eq(&a.1, &b.1) && a.2 == b.2
}

/// Where the mask of an order is seen; what is known of the whole painting is good for a draft as well.
fn mask_map(
    bench: &mut Bench,
    order: &Order,
    camera: &Camera,
    draft: bool,
) -> Option<Result<Arc<MaskMap>, String>> {
    let mask = order.mask.clone()?;
    let view = view_of(order);
    let known =
        bench.mask.as_ref().filter(|m| m.mask == mask && is_same(&m.view, &view) && (draft || !m.draft));
    if let Some(known) = known {
        return Some(known.map.clone());
    }
    let map = bench.painter.mask_map(camera, &mask.0, mask.1).map(Arc::new).map_err(|e| e.to_string());
    bench.mask = Some(MaskSeen { view, mask, draft, map: map.clone() });
    Some(map)
}

/// What `camera`, which is that of the order or has fewer pixels, sees.
fn picture(
    bench: &mut Bench,
    order: &Order,
    camera: &Camera,
    draft: bool,
    wanted: &dyn Fn() -> bool,
) -> Result<Picture, InkError> {
    let begun = Instant::now();
    bench.painting = None;
    // Each view by itself, as `yugen ink` paints one.
    bench.painter.forget();
    let painting = bench.painter.paint_while(camera, wanted)?;
    let image = Arc::new(bench.painter.image(false)?);
    let mask = mask_map(bench, order, camera, draft);
    let unmet = [bench.painter.unmet_names(), bench.painter.unmet_strokes()].concat().into();
    let seconds = begun.elapsed().as_secs_f64();
    Ok(Picture { image, painting: Arc::new(painting), literal: None, mask, unmet, draft, seconds })
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
