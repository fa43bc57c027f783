//! The Noh stage between its fires: whole frames of the real-time renderer, shadows and all, against the reference.

mod reference;

use glam::Vec3;
use reference::Difference;
use yugen_noh::{FireLight, Hour};
use yugen_optics::Image;
use yugen_optics::flip::mean_flip;
use yugen_optics::tonemap::ToneMap;
use yugen_realtime::{Gpu, Lighting, Options, Stage};
use yugen_scene::prepared::Rows;
use yugen_scene::{Camera, Filter, Scene};

const SIZE: [u32; 2] = [96, 54];
const SEATS: [&str; 3] = ["shomen", "waki-shomen", "naka-shomen"];
/// Surfaces that light meets at most: one for direct light.
const BOUNCES: [u32; 2] = [1, 4];
/// Of the real-time renderer, after which its picture is looked at.
const FRAMES: [u32; 4] = [1, 4, 16, 64];
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
    /// Worst seen: .049, .127, .967 and .056.
    fn is_near(&self) -> bool {
        self.all < 0.1 && self.surfaces < 0.25 && (self.ratio - 1.0).abs() < 0.06 && self.flip < 0.1
    }
}

fn realtime(gpu: &Gpu, rows: &Rows, camera: &Camera, bounces: u32) -> [Image; FRAMES.len()] {
    let options = Options { lighting: Lighting::Full, ..Options::new(SIZE, Some(bounces)) };
    let mut stage = Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("a stage");
    FRAMES.map(|frames| {
        while stage.frame(camera).expect("a frame") < frames {}
        stage.image().expect("a picture").select(&["R", "G", "B"]).expect("channels")
    })
}

fn off(scene: &Scene, found: &Image, wants: &[Image; 2]) -> Off {
    let display = ToneMap::new(scene.working_space, scene.display.exposure, scene.display.curve);
    let white = (-scene.display.exposure).exp2();
    let luminance = |p: &[f32]| scene.working_space.luminance(Vec3::from_slice(p));
    let [mut all, mut surfaces] = [Difference::default(); 2];
    let mut shown = [Image::rgb(found.width, found.height), Image::rgb(found.width, found.height)];
    let pixels = wants.each_ref().map(|w| w.data.chunks_exact(3));
    let [first, second] = pixels;
    for (i, ((a, b), c)) in found.data.chunks_exact(3).zip(first).zip(second).enumerate() {
        let dim = luminance(b).max(luminance(c)) < white;
        for k in 0..3 {
            all.add(a[k], [b[k], c[k]]);
            if dim {
                surfaces.add(a[k], [b[k], c[k]]);
            }
        }
        let mean: [f32; 3] = std::array::from_fn(|k| 0.5 * (b[k] + c[k]));
        for (picture, pixel) in shown.iter_mut().zip([a, &mean]) {
            picture.data[3 * i..3 * i + 3].copy_from_slice(&display.show(Vec3::from_slice(pixel)).to_array());
        }
    }
    assert!(all.error().is_finite() && surfaces.error().is_finite(), "a pixel is no number");
    let flip = mean_flip(&shown[0], &shown[1]).expect("pictures of one size");
    Off { all: all.error(), surfaces: surfaces.error(), ratio: surfaces.ratio(), flip }
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
            scene.integrator.max_depth = Some(bounces + 1);
            let wants = [0, 1].map(|seed| reference::picture(&scene, SAMPLES, seed));
            let off = |found: &Image| off(&scene, found, &wants);
            let pictures = realtime(&gpu, &rows, &camera, bounces);
            for (frames, found) in FRAMES.iter().zip(&pictures) {
                let is = off(found);
                println!(
                    "{seat:<12} {bounces} bounces, {frames:>2} frames: error {:.3}, of surfaces {:.3}, ratio {:.3}, FLIP {:.3}",
                    is.all, is.surfaces, is.ratio, is.flip
                );
            }
            let [.., mut found] = pictures;
            let (is, stripes) = (off(&found), found.width / 8);
            assert!(is.is_near(), "{is:?}");
            // A picture that is an eighth of its width beside where it should be.
            found.data.rotate_right(3 * stripes);
            assert!(!off(&found).is_near(), "{:?}", off(&found));
        }
    }
}
