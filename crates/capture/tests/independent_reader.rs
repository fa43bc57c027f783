//! Files that Yugen writes, relit by a reader that shares nothing with it, `reader/relight.py`; and files of a writer that
//! shares nothing with it, `reader/write.py`, relit by both.

use std::path::{Path, PathBuf};
use std::process::Command;
use yugen_archive::formats::relight::Layout;
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_archive::formats::relit_contents::Contents;
use yugen_archive::formats::relit_files;
use yugen_capture::rti::{evaluate, light, mixed};
use yugen_optics::Vec3;

/// A Python with these modules, if there is one: YUGEN_PYTHON, python3, or that of the system.
fn python(modules: &str) -> Option<PathBuf> {
    let named = std::env::var_os("YUGEN_PYTHON").map(PathBuf::from);
    named.into_iter().chain(["python3".into(), "/usr/bin/python3".into()]).find(|python| {
        let runs = Command::new(python).args(["-c", &format!("import {modules}")]).output();
        runs.is_ok_and(|o| o.status.success())
    })
}

/// Slow waves, as JPEG likes them, which no reversal of rows, columns, colours or terms leaves the same.
fn sample(basis: Basis, colouring: Colouring, [width, height]: [usize; 2]) -> Relightable {
    let mut r = Relightable { width, height, basis, colouring, coefficients: Vec::new() };
    let stride = r.stride();
    for i in 0..width * height {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        r.coefficients.extend((0..stride).map(|k| {
            let wave = (0.11 * x + 0.07 * y + 1.3 * k as f32).sin();
            if colouring == Colouring::Lrgb && k < 3 { 0.5 + 0.4 * wave } else { 0.3 * wave + 0.1 + 0.01 * y }
        }));
    }
    r
}

fn relit(python: &Path, path: &Path, toward: Vec3, to: &Path) -> Vec<f32> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader/relight.py");
    let numbers = toward.to_array().map(|v| v.to_string());
    let run = Command::new(python).arg(script).arg(path).args(numbers).arg(to).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    std::fs::read(to).unwrap().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn another_reader_relights_what_is_written() {
    let with_jpegs = python("numpy, PIL");
    let jpegs = with_jpegs.is_some();
    let Some(python) = with_jpegs.or_else(|| python("numpy")) else {
        println!("skipped: no Python with numpy; name one in YUGEN_PYTHON");
        return;
    };
    let folder = std::env::temp_dir().join(format!("yugen-reader-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let toward = Vec3::new(0.48, -0.36, 0.8);
    let mut seen = 0;
    let (image, small, tiled) = (Layout::Image, [40, 24], [540, 300]);
    for (name, basis, colouring, layout, size) in [
        ("a.ptm", Basis::Ptm, Colouring::Rgb, image, small),
        ("b.ptm", Basis::Ptm, Colouring::Lrgb, image, small),
        ("a.rti", Basis::Hsh { order: 2 }, Colouring::Rgb, image, small),
        ("b.rti", Basis::Hsh { order: 3 }, Colouring::Rgb, image, small),
        ("c.rti", Basis::Hsh { order: 4 }, Colouring::Rgb, image, small),
        ("ptm", Basis::Ptm, Colouring::Rgb, image, small),
        ("lrgb", Basis::Ptm, Colouring::Lrgb, image, small),
        ("hsh", Basis::Hsh { order: 3 }, Colouring::Rgb, image, small),
        ("deepzoom", Basis::Ptm, Colouring::Lrgb, Layout::DeepZoom, tiled),
        ("tarzoom", Basis::Hsh { order: 2 }, Colouring::Rgb, Layout::TarZoom, tiled),
        ("itarzoom", Basis::Ptm, Colouring::Rgb, Layout::ITarZoom, tiled),
    ] {
        let path = folder.join(name);
        let r = sample(basis, colouring, size);
        relit_files::write(&path, &mut (&r).into(), layout).unwrap();
        if path.is_dir() && !jpegs {
            println!("skipped: no Pillow to read the JPEGs of {name}");
            continue;
        }
        let want = light::values(&r, toward);
        let got = relit(&python, &path, toward, &folder.join("out.f32"));
        assert_eq!(got.len(), want.len() * 3);
        let worst = got.iter().zip(want.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // Coefficients have a range of 0.9 and bytes half a step of 1/255 of it (a whole one where the colour is a byte
        // too); JPEG loses up to ten steps. Larger pictures are brighter at the bottom, by .01 a row.
        let range = 0.6 + 0.3 * size[1] as f32 / 24.0;
        let step = range / 255.0 * evaluate(basis, toward).iter().map(|b| b.abs() as f32).sum::<f32>();
        let steps = match (path.is_dir(), colouring) {
            (true, _) => 10.0,
            (false, Colouring::Rgb) => 0.52,
            (false, Colouring::Lrgb) => 1.0,
        };
        println!("{name}: {worst} of {}", steps * step);
        assert!(worst < steps * step, "{name}: {worst}, {step}");
        seen += 1;
    }
    assert!(seen >= 5);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_another_writer_writes_is_relit_as_by_another_reader() {
    let Some(python) = python("numpy, PIL") else {
        println!("skipped: no Python with numpy and Pillow; name one in YUGEN_PYTHON");
        return;
    };
    let folder = std::env::temp_dir().join(format!("yugen-writer-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader/write.py");
    for kind in ["rbf", "bilinear", "rbf-ycc", "bilinear-ycc", "ycc", "tiles", "luminance"] {
        let path = folder.join(if kind == "luminance" { "a.ptm" } else { kind });
        let run = Command::new(&python).arg(&script).arg(kind).arg(&path).output().unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let contents = relit_files::read(&path, 1 << 20).unwrap();
        for toward in [Vec3::new(0.48, -0.36, 0.8), Vec3::new(-0.1, 0.2, 0.97), Vec3::new(-0.7, -0.5, 0.51)] {
            let toward = toward.normalize();
            let shown = match &contents {
                Contents::Terms(r) => light::values(r, toward),
                Contents::Mixed(m) => mixed::values(m, toward),
            };
            let other = relit(&python, &path, toward, &folder.join("out.f32"));
            assert_eq!(other.len(), shown.len() * 3);
            let differences = shown.as_flattened().iter().zip(&other).map(|(a, b)| (a - b).abs());
            let worst = differences.fold(0.0, f32::max);
            let spread = other.iter().fold([f32::MAX, f32::MIN], |s, v| [s[0].min(*v), s[1].max(*v)]);
            println!("{kind}: {worst} of values from {} to {}", spread[0], spread[1]);
            // Two decoders of JPEG may differ by a level or two in a plane, of which up to eighteen make up a value.
            assert!(worst < 0.03 && spread[1] - spread[0] > 0.3, "{kind}: {worst} {spread:?}");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
