//! Files that Yugen writes, relit by a reader that shares nothing with it: `reader/relight.py`.

use std::path::{Path, PathBuf};
use std::process::Command;
use yugen_archive::formats::relightable::{self, Basis, Colouring, Relightable};
use yugen_capture::rti::{evaluate, light};
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
fn sample(basis: Basis, colouring: Colouring) -> Relightable {
    let (width, height) = (40, 24);
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
    for (name, basis, colouring) in [
        ("a.ptm", Basis::Ptm, Colouring::Rgb),
        ("b.ptm", Basis::Ptm, Colouring::Lrgb),
        ("a.rti", Basis::Hsh { order: 2 }, Colouring::Rgb),
        ("b.rti", Basis::Hsh { order: 3 }, Colouring::Rgb),
        ("c.rti", Basis::Hsh { order: 4 }, Colouring::Rgb),
        ("ptm", Basis::Ptm, Colouring::Rgb),
        ("lrgb", Basis::Ptm, Colouring::Lrgb),
        ("hsh", Basis::Hsh { order: 3 }, Colouring::Rgb),
    ] {
        let path = folder.join(name);
        let r = sample(basis, colouring);
        relightable::write(&path, &r).unwrap();
        if path.is_dir() && !jpegs {
            println!("skipped: no Pillow to read the JPEGs of {name}");
            continue;
        }
        let want = light::values(&r, toward);
        let got = relit(&python, &path, toward, &folder.join("out.f32"));
        assert_eq!(got.len(), want.len() * 3);
        let worst = got.iter().zip(want.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // Coefficients have a range of 0.9 and bytes half a step of 1/255 of it (a whole one where the colour is a byte
        // too); JPEG loses up to ten steps.
        let step = 0.9 / 255.0 * evaluate(basis, toward).iter().map(|b| b.abs() as f32).sum::<f32>();
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
