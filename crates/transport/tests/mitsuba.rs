//! Mitsuba's own test scenes against Mitsuba's own references, by Mitsuba's own test: mean and variance images, a
//! z-test in every pixel, Šidák over the pixels, 99.75 % of them.

use std::path::{Path, PathBuf};
use yugen_archive::formats::{Options as LoadOptions, image, load_scene};
use yugen_optics::{ColourSpace, Image, Vec3};
use yugen_proof::image::{ZSettings, z_test};
use yugen_transport::render::{Action, Budget, Job, Options};

/// Samples a picture gets, shared by its pixels, as there.
const BUDGET: usize = 2_000_000;

fn data() -> Option<PathBuf> {
    match std::env::var_os("YUGEN_DATA") {
        Some(folder) => Some(folder.into()),
        None if std::env::var_os("CI").is_some() => {
            panic!("YUGEN_DATA is not set, and CI must not skip this")
        }
        None => {
            println!("skipped: YUGEN_DATA is not set");
            None
        }
    }
}

fn render(scene: &Path, spp: u32, seed: u32) -> Image {
    let scene = load_scene(scene, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { budget: Some(Budget::Samples(spp)), seed, ..Options::default() };
    let job = Job::new(&scene, &options).unwrap_or_else(|e| panic!("{e}"));
    assert!(job.run(|_, _| Action::Continue));
    assert_eq!(job.status().rejected, 0);
    xyz(&job.image().select(&["R", "G", "B"]).expect("colours"))
}

/// As there, pictures and variances are compared in XYZ.
fn xyz(image: &Image) -> Image {
    let matrix = ColourSpace::LinearSrgb.to_xyz().as_mat3();
    let mut out = Image::new(image.width, image.height, &["X", "Y", "Z"]);
    for (to, from) in out.data.chunks_exact_mut(3).zip(image.data.chunks_exact(3)) {
        to.copy_from_slice(&(matrix * Vec3::from_slice(from)).to_array());
    }
    out
}

fn reference(file: &Path) -> Image {
    let options = image::ReadOptions::to(ColourSpace::LinearSrgb);
    let image = image::read(file, &options).unwrap_or_else(|e| panic!("{e}"));
    xyz(&image.select(&["R", "G", "B"]).unwrap_or_else(|| panic!("{}: no R, G, B", file.display())))
}

#[test]
fn every_scene_with_a_reference_passes_the_z_test() {
    let Some(data) = data() else { return };
    let folder = data.join("mitsuba/tests/scenes");
    let mut tested = 0;
    let mut failed = Vec::new();
    for group in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let Ok(files) = std::fs::read_dir(group.expect("a folder").path()) else { continue };
        for file in files {
            let scene = file.expect("a file").path();
            if scene.extension().is_none_or(|e| e != "xml") {
                continue;
            }
            // test_arealight_path.xml → refs/test_arealight_ref_rgb.exr
            let stem = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let stem = stem.rsplit_once('_').map_or(stem.as_str(), |(head, _)| head).to_string();
            let mean = scene.with_file_name("refs").join(format!("{stem}_ref_rgb.exr"));
            if !mean.exists() {
                continue;
            }
            let variance = scene.with_file_name("refs").join(format!("{stem}_ref_rgb_var.exr"));
            let (mean, variance) = (reference(&mean), reference(&variance));
            let spp = BUDGET / (mean.width * mean.height);
            let picture = render(&scene, spp as u32, 0);
            let settings = ZSettings::mitsuba(spp as f64);
            let result =
                z_test(&picture, &mean, &variance, settings).unwrap_or_else(|e| panic!("{stem}: {e}"));
            println!("{stem}: {result}");
            tested += 1;
            // Sabotage: the same picture a tenth too bright must not pass.
            let mut bright = picture.clone();
            bright.data.iter_mut().for_each(|v| *v *= 1.1);
            let sabotage =
                z_test(&bright, &mean, &variance, settings).unwrap_or_else(|e| panic!("{stem}: {e}"));
            if !result.passed() || sabotage.passed() {
                failed.push(format!("{stem}: {result}; a tenth too bright: {sabotage}"));
            }
        }
    }
    assert!(tested >= 6, "found {tested} scenes with references only");
    assert!(failed.is_empty(), "{failed:#?}");
}
