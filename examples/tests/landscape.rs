//! The landscape is made, read and painted with its tables, small.

use std::path::PathBuf;
use std::process::Command;
use yugen_archive::formats::{Options, load_scene};
use yugen_ink::painter::Painter;
use yugen_ink::preset;
use yugen_realtime::Gpu;

#[test]
fn the_landscape_is_made_and_painted() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("landscape");
    let file = folder.join("landscape.toml");
    let made = Command::new(env!("CARGO_BIN_EXE_landscape")).arg(&file).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let mut scene = load_scene(&file, &Options::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.shapes.len() > 500 && scene.cameras.len() == 2, "{} shapes", scene.shapes.len());
    let Some(gpu) = Gpu::for_tests() else { return };
    let tables = format!("base = \"landscape\"\n{}", include_str!("../ink_landscape.toml"));
    let style =
        preset::read(&tables, "tabled.toml", &preset::no_pictures).unwrap_or_else(|e| panic!("{e}")).style;
    scene.settle_framing([120, 90]);
    let view = scene.look_through(Some("wide"), Some([120, 90]), None).unwrap();
    let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &view, style, 2).unwrap();
    assert_eq!(painter.unmet_names(), Vec::<String>::new(), "every table is of something in it");
    let painting = painter.paint(&view).unwrap();
    // Washes, wrinkles, rubbing, contours and dots: a landscape has all of them.
    assert!(painting.stamps.iter().all(|n| *n > 50), "{:?}", painting.stamps);
    let picture = painter.image(false).unwrap();
    let row = |y: usize| {
        let all = &picture.data[3 * y * picture.width..3 * (y + 1) * picture.width];
        all.iter().sum::<f32>() / all.len() as f32
    };
    // The sky is paper, rocks and pines are not.
    let dark = (45..80).map(row).fold(f32::INFINITY, f32::min);
    assert!(row(1) > 0.6 && dark < 0.8 * row(1), "{} {dark}", row(1));
    std::fs::remove_dir_all(folder).unwrap();
}
