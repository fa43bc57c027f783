//! `yugen capture normals` from outside.

use crate::{Run, scratch, yugen};
use serde_json::Value;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_archive::formats::{lp, stack};
use yugen_capture::simulate::fibonacci_dome;
use yugen_optics::{ColourSpace, Image, Vec3};

const SIZE: [usize; 2] = [40, 32];

/// A bump of clay on a slope: its height in widths of a texel and its normal.
fn clay(x: usize, y: usize) -> (f32, Vec3) {
    let (u, v) = (x as f32 - 20.0, 16.0 - y as f32);
    let bump = 5.0 * (-(u * u + v * v) / 90.0).exp();
    let slope = [0.1 - bump * u / 45.0, -bump * v / 45.0];
    (0.1 * u + bump, Vec3::new(-slope[0], -slope[1], 1.0).normalize())
}

fn photograph(folder: &Path, lights: &[Vec3]) {
    std::fs::create_dir_all(folder).unwrap();
    let mut entries = Vec::new();
    for (i, light) in lights.iter().enumerate() {
        let mut picture = Image::rgb(SIZE[0], SIZE[1]);
        for (p, pixel) in picture.data.chunks_exact_mut(3).enumerate() {
            let (_, normal) = clay(p % SIZE[0], p / SIZE[0]);
            pixel.copy_from_slice(&(Vec3::new(0.6, 0.4, 0.3) * normal.dot(*light).max(0.0)).to_array());
        }
        let file = format!("{i:03}.exr");
        image::write(&folder.join(&file), &picture, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap();
        entries.push(lp::Entry { file, light: *light });
    }
    stack::write(folder, &entries, &stack::Options::default()).unwrap();
}

fn read(path: &Path) -> Image {
    image::read(path, &ReadOptions::raw()).unwrap()
}

#[test]
fn a_relief_is_found_in_one_go_and_in_bands() {
    let folder = scratch("normals_round");
    let path = |name: &str| folder.join(name).display().to_string();
    photograph(&folder.join("stack"), &fibonacci_dome(12, 60f32.to_radians()));
    let (stack, one, bands) = (path("stack"), path("one"), path("bands"));
    let json = crate::report(yugen(&["capture", "normals"], &[&stack, "-o", &one, "--json"]));
    assert_eq!(
        (&json["ground"], &json["masked"], &json["undecided"]),
        (&"matte".into(), &0.into(), &0.into())
    );
    assert!(json["expected_error"]["median"].as_f64().unwrap() < 1.0, "{json}");
    let at = |name: &str| folder.join("one").join(name);
    let normals = read(&at("normal.exr"));
    assert_eq!(normals.channels, ["X", "Y", "Z"]);
    let heights = read(&at("height.exr"));
    let (mut worst, mut sum, mut squares) = (0.0f32, 0.0, 0.0);
    for p in 0..SIZE[0] * SIZE[1] {
        let (height, normal) = clay(p % SIZE[0], p / SIZE[0]);
        worst = worst.max(Vec3::from_slice(&normals.data[3 * p..]).angle_between(normal).to_degrees());
        let off = heights.data[p] - height;
        (sum, squares) = (sum + off, squares + off * off);
    }
    assert!(worst < 0.2, "{worst}");
    let n = (SIZE[0] * SIZE[1]) as f32;
    let deviation = (squares / n - (sum / n).powi(2)).sqrt();
    assert!(deviation < 0.05, "{deviation}");
    // The PNG says the same, and the middle of the albedo is what it was.
    let shown = read(&at("normal.png"));
    let decode = |i: usize| Vec3::from_slice(&shown.data[3 * i..]) * 2.0 - 1.0;
    assert!((0..n as usize).all(|i| (decode(i) - Vec3::from_slice(&normals.data[3 * i..])).length() < 1e-3));
    let albedo = read(&at("albedo.exr"));
    assert!((Vec3::from_slice(albedo.pixel(20, 16)) - Vec3::new(0.6, 0.4, 0.3)).length() < 0.01);
    // Against the truth it is right, against a turned one it is not; neither bands nor threads change a bit.
    let truth = at("normal.exr").display().to_string();
    let args = [&stack, "-o", &bands, "--memory", "0", "--threads", "1", "--truth", &truth, "--json"];
    let json = crate::report(yugen(&["capture", "normals"], &args));
    assert!(json["errors"]["mean"].as_f64().unwrap() < 0.02, "{json}");
    for name in ["normal.exr", "height.exr", "error.exr", "albedo.exr"] {
        assert!(read(&at(name)) == read(&folder.join("bands").join(name)), "{name}");
    }
    // Without the height, and on top of what was there.
    let args = [&stack, "-o", &bands, "--no-height", "--ground", "coated"];
    let said = crate::good(yugen(&["capture", "normals"], &args));
    assert!(said.contains("was said to be coated") && !said.contains("heights"), "{said}");
}

/// The list of another stack under the names of this one; a photograph with half the exposure; and either told by `fit`.
#[test]
fn what_the_photographs_say_against_their_list_is_told() {
    let folder = scratch("normals_doubts");
    let path = |name: &str| folder.join(name).display().to_string();
    let lights = fibonacci_dome(12, 60f32.to_radians());
    photograph(&folder.join("stack"), &lights);
    let names = |i: usize| format!("{i:03}.exr");
    let own: [usize; 12] = std::array::from_fn(|i| i);
    let list = |order: [usize; 12], options: &stack::Options| {
        let entry = |(i, from): (usize, usize)| lp::Entry { file: names(i), light: lights[from] };
        let entries: Vec<lp::Entry> = order.into_iter().enumerate().map(entry).collect();
        stack::write(&folder.join("stack"), &entries, options).unwrap();
        let of = |verb: &str, output: &str| {
            let run = yugen(&["capture", verb], &[&path("stack"), "-o", &path(output), "--json"]);
            assert!(run.success, "{}", run.err);
            (run.err, serde_json::from_str::<Value>(&run.out).unwrap())
        };
        let (err, json) = of("normals", "out");
        if order == own {
            assert_eq!(of("fit", "out.btf").0, err);
        }
        (err, json)
    };
    let usual = stack::Options::default();
    let (err, json) = list(own, &usual);
    assert!(err.is_empty() && json["doubts"]["odd"] == serde_json::json!([]), "{err} {json}");
    assert!(json["doubts"]["list_by_chance"].as_f64().unwrap() < 0.02, "{json}");
    let (err, json) = list([7, 3, 10, 0, 5, 11, 2, 8, 1, 9, 4, 6], &usual);
    let words = ["do not follow the list of lights 'lights.lp'", "another stack, or in another order"];
    assert!(words.iter().all(|w| err.contains(w)), "{err}");
    assert!(json["doubts"]["list_by_chance"].as_f64().unwrap() > 0.05, "{json}");
    let intensities = (0..12).map(|i| [if i == 4 { 2.0 } else { 1.0 }; 3]).collect();
    let (err, json) = list(own, &stack::Options { intensities, ..stack::Options::default() });
    assert!(err.contains("004.exr: 0.50 times as bright as the other photographs say;"), "{err}");
    assert_eq!(json["doubts"]["odd"].as_array().unwrap().len(), 1, "{json}");
}

#[test]
fn bad_stacks_get_a_sentence() {
    let folder = scratch("normals_bad");
    let path = |name: &str| folder.join(name).display().to_string();
    photograph(&folder.join("two"), &fibonacci_dome(2, 1.0));
    photograph(
        &folder.join("plane"),
        &[-0.8f32, -0.3, 0.0, 0.4, 0.9].map(|x| Vec3::new(x, 0.0, 1.0).normalize()),
    );
    photograph(&folder.join("stack"), &fibonacci_dome(8, 1.0));
    let out = path("out");
    for (args, problem) in [
        (vec![path("two"), "-o".into(), out.clone()], "2 lights are too few"),
        (vec![path("plane"), "-o".into(), out.clone()], "in one plane"),
        (vec![path("none"), "-o".into(), out.clone()], "none"),
        (vec![path("stack"), "-o".into(), out.clone(), "--noise".into(), "2".into()], "between 0 and 1"),
        (
            vec![path("stack"), "-o".into(), out.clone(), "--truth".into(), path("stack/lights.lp")],
            "lights.lp",
        ),
    ] {
        let Run { success, err, .. } = yugen(&["capture", "normals"], &args);
        assert!(!success && err.contains(problem), "{problem}: {err}");
        assert!(!folder.join("out").exists(), "{problem}");
    }
}

/// What was measured of rendered things whose normals are known: mean error, that of 90 %, and the ground.
#[test]
fn things_whose_normals_are_known() {
    let Some(data) = std::env::var_os("YUGEN_DATA").map(PathBuf::from) else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA names no folder of data");
        eprintln!("skipped: YUGEN_DATA names no folder of data");
        return;
    };
    for (name, ground, mean, ninety) in [
        ("spot_matte_50", "matte", 1.2, 3.5),
        ("spot_matte_12", "matte", 1.3, 3.5),
        ("spot_glazed_24", "coated", 2.0, 4.0),
    ] {
        let stack = data.join("multilight").join(name);
        let out = scratch(&format!("normals_{name}"));
        let truth = stack.join("normals.png");
        let [stack, out, truth] = [&stack, &out, &truth].map(|p| p.display().to_string());
        let args = [&stack, "-o", &out, "--truth", &truth, "--json"];
        let Run { success, out, err } = yugen(&["capture", "normals"], &args);
        // Their lists count x to the left, as their normals do.
        assert!(success && err.contains("with one axis of the lights turned round"), "{err}");
        let json: Value = serde_json::from_str(&out).unwrap();
        let error = |key: &str| json["errors"][key].as_f64().unwrap();
        println!("{name}: {}", json["errors"]);
        assert_eq!(json["ground"], ground, "{name}");
        assert!(error("mean") < mean && error("ninety") < ninety, "{name}: {json}");
        // Sure of itself and wrong: one in a hundred at most.
        assert!(error("sure_and_wrong") <= 0.01 * error("sure"), "{name}: {json}");
        assert!(error("sure") > 0.6 * error("texels"), "{name}: {json}");
    }
}
