//! The reference renderer behind the window: a thread that refines one view.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use yugen_optics::Image;
use yugen_optics::flip::mean_flip;
use yugen_optics::tonemap::ToneMap;
use yugen_scene::{Camera, Integrator, IntegratorKind, Scene};
use yugen_transport::render::{Action, Budget, Job, Options};

/// Samples at which it is good enough.
const MOST_SAMPLES: u32 = 4096;

/// Between two looks at the picture, at least.
const PAUSE: Duration = Duration::from_millis(300);

/// What it has found so far.
#[derive(Clone)]
pub struct Finding {
    /// R, G and B, linear, in the scene's space.
    pub image: Arc<Image>,
    /// Samples of a pixel, in the mean.
    pub samples: f32,
    /// Counts findings.
    pub number: u64,
}

#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    finding: Mutex<Option<Result<Finding, String>>>,
}

/// A path tracer at work; it ends when this is dropped.
pub struct Reference {
    shared: Arc<Shared>,
}

impl Reference {
    /// Begins with what `camera` sees of `scene`, light followed over at most so many bounces. `wake` is called when there is
    /// something new.
    pub fn start(scene: &Scene, camera: &Camera, bounces: u32, wake: impl Fn() + Send + 'static) -> Self {
        let mut scene = scene.clone();
        scene.cameras = vec![camera.clone()];
        let integrator = Integrator {
            kind: IntegratorKind::Path,
            max_depth: bounces.checked_add(1),
            clamp: None,
            aovs: Vec::new(),
            ..scene.integrator.clone()
        };
        let shared = Arc::new(Shared::default());
        let own = shared.clone();
        std::thread::spawn(move || {
            if let Err(problem) = work(&scene, integrator, &own, &wake) {
                own.put(Err(problem));
                wake();
            }
        });
        Self { shared }
    }

    /// What it has found since this was last asked; why it cannot.
    pub fn take(&self) -> Option<Result<Finding, String>> {
        self.shared.finding.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Reference {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

impl Shared {
    fn put(&self, finding: Result<Finding, String>) {
        *self.finding.lock().unwrap_or_else(PoisonError::into_inner) = Some(finding);
    }

    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

fn work(scene: &Scene, integrator: Integrator, shared: &Shared, wake: &impl Fn()) -> Result<(), String> {
    // One sample of everything first: there is something to see soon.
    let mut samples = 1;
    let options = Options {
        budget: Some(Budget::Samples(samples)),
        integrator: Some(integrator),
        ..Options::default()
    };
    let mut job = Job::new(scene, &options).map_err(|e| e.to_string())?;
    let mut number = 0;
    let mut look = |job: &Job| -> Duration {
        let begun = Instant::now();
        let [w, h] = job.size();
        let samples = job.status().samples as f64 / (f64::from(w) * f64::from(h));
        let Some(image) = job.image().select(&["R", "G", "B"]) else { return Duration::ZERO };
        number += 1;
        shared.put(Ok(Finding { image: Arc::new(image), samples: samples as f32, number }));
        wake();
        begun.elapsed()
    };
    while !shared.stopped() && samples <= MOST_SAMPLES {
        let mut next = Instant::now() + PAUSE;
        job.run(|job, _| {
            if shared.stopped() {
                return Action::Stop;
            }
            // Looking shall take little of the time of the work.
            if Instant::now() >= next {
                next = Instant::now() + PAUSE.max(10 * look(job));
            }
            Action::Continue
        });
        if !shared.stopped() {
            look(&job);
        }
        samples *= 4;
        job.extend(Budget::Samples(samples));
    }
    Ok(())
}

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Root mean square of the difference over that of the reference.
    pub relative_rmse: f64,
    /// Mean FLIP of both as they are shown.
    pub flip: f64,
}

/// The difference of two pictures with channels R, G and B in one space; `None` where they differ in size.
pub fn difference(image: &Image, reference: &Image, display: &ToneMap) -> Option<Difference> {
    let [a, b] = [image.select(&["R", "G", "B"])?, reference.select(&["R", "G", "B"])?];
    if (a.width, a.height) != (b.width, b.height) {
        return None;
    }
    let (mut off, mut all) = (0.0, 0.0);
    for (a, b) in a.data.iter().zip(&b.data).map(|(a, b)| (f64::from(*a), f64::from(*b))) {
        off += (a - b).powi(2);
        all += b * b;
    }
    let relative_rmse = if all > 0.0 { (off / all).sqrt() } else { off.sqrt() };
    let shown = |mut image: Image| {
        for p in image.data.chunks_exact_mut(3) {
            p.copy_from_slice(&display.show(yugen_optics::Vec3::new(p[0], p[1], p[2])).to_array());
        }
        image
    };
    Some(Difference { relative_rmse, flip: mean_flip(&shown(a), &shown(b))? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Vec3};
    use yugen_optics::ColourSpace;
    use yugen_optics::tonemap::Curve;
    use yugen_scene::{Film, Geometry, Light, Material, Shape, Value};

    #[test]
    fn it_refines_a_furnace_and_stops_when_it_is_dropped() {
        // White under white light is as bright as what is all around.
        let mut scene = Scene {
            materials: vec![Material::lambert(Value::Number(1.0))],
            shapes: vec![Shape::new("ball", Geometry::Sphere, Mat4::IDENTITY, 0)],
            ..Scene::default()
        };
        scene.add_light("sky", Light::Constant { radiance: Vec3::splat(0.5) });
        let camera = scene.framing_camera(Film { width: 24, height: 16, ..Film::default() });
        let (wake, woken) = std::sync::mpsc::channel();
        let reference = Reference::start(&scene, &camera, u32::MAX, move || wake.send(()).unwrap_or(()));
        let mut last = None;
        while woken.recv_timeout(Duration::from_secs(60)).is_ok() {
            if let Some(finding) = reference.take() {
                last = Some(finding.expect("it can be rendered"));
            }
            if last.as_ref().is_some_and(|f: &Finding| f.samples >= 64.0) {
                break;
            }
        }
        let last = last.expect("it found something");
        assert!(last.samples >= 64.0 && last.number > 1);
        let mean = last.image.data.iter().sum::<f32>() / last.image.data.len() as f32;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        drop(reference);
        // The thread gives up its end of the channel.
        while woken.recv_timeout(Duration::from_secs(60)).is_ok() {}
        assert_eq!(woken.try_recv(), Err(std::sync::mpsc::TryRecvError::Disconnected));
    }

    #[test]
    fn differences_are_what_they_say() {
        let display = ToneMap::new(ColourSpace::LinearSrgb, 0.0, Curve::Clip);
        let mut a = Image::rgb(8, 8);
        a.data.fill(0.5);
        let mut b = a.clone();
        assert_eq!(difference(&a, &b, &display), Some(Difference { relative_rmse: 0.0, flip: 0.0 }));
        b.data.fill(0.55);
        let d = difference(&b, &a, &display).expect("they can be compared");
        assert!((d.relative_rmse - 0.1).abs() < 1e-6 && d.flip > 0.01, "{d:?}");
        assert_eq!(difference(&a, &Image::rgb(8, 9), &display), None);
    }
}
