//! The Noh stage between its fires: whole frames of the real-time renderer, shadows and all, against the reference.

use glam::Vec3;
use yugen_noh::{FireLight, Hour};
use yugen_optics::Image;
use yugen_optics::flip::mean_flip;
use yugen_optics::tonemap::ToneMap;
use yugen_realtime::{Gpu, Lighting, Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{Camera, Filter, Scene};
use yugen_transport::render::{self, Action, Budget, Job};

const SIZE: [u32; 2] = [96, 54];
const SEATS: [&str; 3] = ["shomen", "waki-shomen", "naka-shomen"];
/// Surfaces that light meets at most: one for direct light.
const BOUNCES: [u32; 2] = [1, 4];
/// Of the real-time renderer.
const FRAMES: u32 = 64;
/// Of each of two references.
const SAMPLES: u32 = 96;

/// How far pictures are off.
#[derive(Clone, Copy, Debug)]
struct Off {
    /// Root mean square difference over root mean square, without the noise of the reference: of all pixels, and of those
    /// that are not brighter than white as displayed, which are not flames.
    all: f64,
    surfaces: f64,
    /// Of the sums, of those.
    ratio: f64,
    flip: f64,
}

impl Off {
    /// Worst seen: .049, .173, .946 and .067.
    fn is_near(&self) -> bool {
        self.all < 0.1 && self.surfaces < 0.3 && (self.ratio - 1.0).abs() < 0.1 && self.flip < 0.12
    }
}

fn reference(scene: &Scene, bounces: u32, seed: u32) -> Image {
    let mut scene = scene.clone();
    scene.integrator.max_depth = Some(bounces + 1);
    let options = render::Options { budget: Some(Budget::Samples(SAMPLES)), seed, ..Default::default() };
    let job = Job::new(&scene, &options).expect("the reference takes it");
    assert!(job.run(|_, _| Action::Continue));
    job.image().select(&["R", "G", "B"]).expect("a picture")
}

fn realtime(gpu: &Gpu, rows: &Rows, camera: &Camera, bounces: u32) -> Image {
    let options = Options { lighting: Lighting::Full, ..Options::new(SIZE, Some(bounces)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("a stage");
    for _ in 0..FRAMES {
        stage.frame(camera).expect("a frame");
    }
    stage.image().expect("a picture").select(&["R", "G", "B"]).expect("channels")
}

fn off(scene: &Scene, found: &Image, wants: &[Image; 2]) -> Off {
    let display = ToneMap::new(scene.working_space, scene.display.exposure, scene.display.curve);
    let white = (-scene.display.exposure).exp2();
    let luminance = |p: &[f32]| scene.working_space.luminance(Vec3::from_slice(p));
    let [mut squares, mut of] = [[0.0f64; 2]; 2];
    let [mut sum, mut want] = [0.0f64; 2];
    let mut shown = [Image::rgb(found.width, found.height), Image::rgb(found.width, found.height)];
    let pixels = wants.each_ref().map(|w| w.data.chunks_exact(3));
    let [first, second] = pixels;
    for (i, ((a, b), c)) in found.data.chunks_exact(3).zip(first).zip(second).enumerate() {
        let dim = luminance(b).max(luminance(c)) < white;
        for k in 0..3 {
            let [a, b, c] = [a[k], b[k], c[k]].map(f64::from);
            for (part, counts) in [true, dim].into_iter().enumerate() {
                let counts = f64::from(u8::from(counts));
                squares[part] += counts * (a - b) * (a - c);
                of[part] += counts * b * c;
            }
            if dim {
                sum += a;
                want += 0.5 * (b + c);
            }
        }
        let mean: [f32; 3] = std::array::from_fn(|k| 0.5 * (b[k] + c[k]));
        for (picture, pixel) in shown.iter_mut().zip([a, &mean]) {
            picture.data[3 * i..3 * i + 3].copy_from_slice(&display.show(Vec3::from_slice(pixel)).to_array());
        }
    }
    assert!(squares.iter().chain(&of).all(|v| v.is_finite()), "a pixel is no number");
    let [all, surfaces] = [0, 1].map(|part| (squares[part].max(0.0) / of[part]).sqrt());
    let flip = mean_flip(&shown[0], &shown[1]).expect("pictures of one size");
    Off { all, surfaces, ratio: sum / want, flip }
}

/// The table of docs/realtime.md.
#[test]
fn whole_frames_are_those_of_the_reference() {
    let Some(gpu) = Gpu::for_tests() else { return };
    let stage = yugen_noh::Stage::preset("national").expect("a stage");
    let mut scene = stage.scene(Hour::Night, FireLight::Flames).expect("a scene");
    scene.pose(None, 3.0).expect("a pose");
    let rows = Rows::new(&scene).expect("rows");
    let cameras = scene.cameras.clone();
    for seat in SEATS {
        let mut camera = cameras.iter().find(|c| c.name == seat).expect("a seat").clone();
        camera.resize(SIZE[0], SIZE[1]);
        camera.film.filter = Filter::Box;
        scene.cameras = vec![camera.clone()];
        for bounces in BOUNCES {
            let wants = [0, 1].map(|seed| reference(&scene, bounces, seed));
            let mut found = realtime(&gpu, &rows, &camera, bounces);
            let off = |found: &Image| off(&scene, found, &wants);
            let (is, stripes) = (off(&found), found.width / 8);
            println!(
                "{seat:<12} {bounces} bounces: error {:.3}, of surfaces {:.3}, ratio {:.3}, FLIP {:.3}",
                is.all, is.surfaces, is.ratio, is.flip
            );
            assert!(is.is_near(), "{is:?}");
            // A picture that is an eighth of its width beside where it should be.
            found.data.rotate_right(3 * stripes);
            assert!(!off(&found).is_near(), "{:?}", off(&found));
        }
    }
}
