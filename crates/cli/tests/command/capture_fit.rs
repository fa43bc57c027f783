//! `yugen capture fit` from outside.

use crate::{Run, scratch};
use std::fmt::Write;
use std::path::Path;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_archive::formats::{btf, lp, stack};
use yugen_capture::simulate::fibonacci_dome;
use yugen_optics::frame::spherical;
use yugen_optics::{ColourSpace, Frame, Image, Vec2, Vec3};
use yugen_reflectance::btf::{Btf, Texel};
use yugen_reflectance::{Choice, Model};

const SIZE: [usize; 2] = [24, 40];
const LIGHTS: usize = 60;

fn yugen(args: &[&str]) -> Run {
    crate::yugen(&["capture"], args)
}

/// Two threads side by side, normals turning across them.
fn cloth() -> Btf {
    let texels = (0..SIZE[0] * SIZE[1]).map(|i| {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        let gold = x / 6 % 2 == 0;
        let tilt = (x % 6) as f32 / 10.0 - 0.25;
        let normal = Vec3::new(tilt, 0.01 * (y % 7) as f32, 1.0).normalize();
        let frame = Frame::from_normal_tangent(normal, Vec3::new(0.1, 1.0, 0.0));
        let (diffuse, specular, sigma) = if gold {
            (Vec3::ZERO, Vec3::new(0.7, 0.55, 0.25), Vec2::new(0.3, 0.12))
        } else {
            (Vec3::new(0.35, 0.05, 0.03), Vec3::splat(0.1), Vec2::new(0.4, 0.2))
        };
        Texel { diffuse, specular, normal: frame.n, tangent: frame.s, sigma, confidence: 1.0 }
    });
    Btf { width: SIZE[0], height: SIZE[1], colour_space: ColourSpace::LinearSrgb, texels: texels.collect() }
}

/// π f cos θ.
fn reflectance_factor(t: &Texel, light: Vec3, eye: Vec3) -> Vec3 {
    let frame = t.frame();
    let (wo, wi) = (frame.to_local(eye), frame.to_local(light));
    t.noh(Choice(0.0)).eval(&[], wo, wi) * (std::f32::consts::PI * wi.z.max(0.0))
}

fn photograph(folder: &Path, cloth: &Btf, lights: usize) {
    std::fs::create_dir_all(folder).unwrap();
    let mut entries = Vec::new();
    for (i, light) in fibonacci_dome(lights, 75f32.to_radians()).into_iter().enumerate() {
        let mut picture = Image::rgb(SIZE[0], SIZE[1]);
        for (pixel, t) in picture.data.chunks_exact_mut(3).zip(&cloth.texels) {
            let v = reflectance_factor(t, light, Vec3::Z);
            pixel.copy_from_slice(&v.to_array());
        }
        let file = format!("{i:03}.exr");
        image::write(&folder.join(&file), &picture, &WriteOptions::from(cloth.colour_space)).unwrap();
        entries.push(lp::Entry { file, light });
    }
    stack::write(folder, &entries, &stack::Options::default()).unwrap();
}

#[test]
fn a_cloth_is_found_in_one_go_and_in_bands() {
    let folder = scratch("fit/round");
    let path = |name: &str| folder.join(name).display().to_string();
    let cloth = cloth();
    photograph(&folder.join("stack"), &cloth, LIGHTS);
    btf::save(&folder.join("truth.btf"), &cloth, &btf::About::default()).unwrap();
    let (stack, truth, report) = (path("stack"), path("truth.btf"), path("report"));
    let fit = |output: &str, more: &[&str]| {
        let args = [&["fit", &stack, "-o", output], more].concat();
        let Run { success, out, err } = yugen(&args);
        assert!(success && err.is_empty(), "{args:?}: {err}");
        out
    };
    let whole = path("whole.btf");
    let out = fit(&whole, &["--truth", &truth, "--report", &report, "--json", "--texel-mm", "0.1"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["errors"]["failed"], 0);
    assert_eq!(json["masked"], 0);
    // Pictures of 32-bit floats without noise.
    for (name, most) in
        [("rho_d", 0.01), ("rho_s", 0.01), ("n", 0.1), ("t", 0.5), ("sigma_x", 0.01), ("sigma_y", 0.01)]
    {
        let worst = json["errors"]["ninety"][name].as_f64().unwrap();
        assert!(worst < most, "{name}: {worst}");
    }
    let steps = json["calibration"].as_array().unwrap();
    let texels = |step: &serde_json::Value| step["texels"].as_u64().unwrap();
    assert_eq!(steps.iter().map(texels).sum::<u64>(), json["normals"]["texels"].as_u64().unwrap());
    assert!(steps.iter().all(|s| s["wrong"] == 0.0), "{steps:?}");
    // What the page names lies beside it, and nothing else does.
    let page = std::fs::read_to_string(folder.join("report/index.html")).unwrap();
    let mut named: Vec<&str> = page
        .split("src=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .chain(["index.html"])
        .collect();
    named.sort_unstable();
    let mut there: Vec<String> = std::fs::read_dir(folder.join("report"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    there.sort_unstable();
    assert_eq!(named, there);
    for name in ["calibration.svg", "error_sigma_y.png"] {
        assert!(there.iter().any(|n| n == name), "{name}");
    }
    let (maps, about) = btf::load(Path::new(&whole), ColourSpace::LinearSrgb).unwrap();
    assert_eq!((about.lights, about.texel_mm), (LIGHTS, Some(0.1)));
    assert_eq!((maps.width, maps.height), (SIZE[0], SIZE[1]));

    let Run { success, out, err } = yugen(&["export", &whole, "-o", &path("maps"), "--gltf", "--json"]);
    let lost: serde_json::Value = serde_json::from_str(&out).unwrap();
    let off = lost["gltf"]["relative_rms_error"].as_f64().unwrap();
    assert!(success && err.is_empty() && off > 0.01 && off < 0.4, "{lost} {err}");
    for name in ["sigma.png", "tangent.png", "cloth.gltf", "cloth.bin", "anisotropy.png"] {
        assert!(folder.join("maps").join(name).exists(), "{name}");
    }

    // Normals alone are a truth as well, as the picture that `export` made of them.
    let normals = path("maps/normal.png");
    let out = fit(&path("again.btf"), &["--truth", &normals, "--report", &path("by_normals"), "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["normals"]["texels"].as_u64(), Some((SIZE[0] * SIZE[1]) as u64));
    assert!(json["errors"].is_null() && json["normals"]["ninety"].as_f64().unwrap() < 0.01, "{json}");
    let black = path("maps/black.png");
    image::write(Path::new(&black), &Image::rgb(SIZE[0], SIZE[1]), &WriteOptions::default()).unwrap();
    let Run { success, err, .. } = yugen(&["fit", &stack, "-o", &path("again.btf"), "--truth", &black]);
    assert!(!success && err.contains("there is no normal in it"), "{err}");
    assert!(
        folder.join("by_normals/error_n.png").exists() && !folder.join("by_normals/error_t.png").exists()
    );

    // Neither threads nor bands change a bit, and nothing is left behind.
    let banded = path("banded.btf");
    fit(&banded, &["--threads", "1", "--memory", "0", "--json"]);
    assert!(!folder.join("banded.btf.checkpoint").exists());
    assert!(btf::load(Path::new(&banded), ColourSpace::LinearSrgb).unwrap().0 == maps);
}

/// A goniometer that looks at each texel from elsewhere.
#[test]
fn a_table_of_readings_is_fitted() {
    let folder = scratch("capture_fit_table");
    let path = |name: &str| folder.join(name).display().to_string();
    let cloth = cloth();
    btf::save(&folder.join("truth.btf"), &cloth, &btf::About::default()).unwrap();
    let mut table = String::from("x,y,theta_i,phi_i,theta_o,phi_o,factor_red,factor_green,factor_blue\n");
    let degrees = |v: Vec3| [v.z.acos().to_degrees(), v.y.atan2(v.x).to_degrees()];
    for (i, light) in fibonacci_dome(30, 75f32.to_radians()).into_iter().enumerate() {
        for (t, texel) in cloth.texels.iter().enumerate() {
            for tilt in [0.05f32, 0.6] {
                let eye = spherical(tilt, (t % 17) as f32 + i as f32);
                let factor = reflectance_factor(texel, light, eye) / light.z;
                let ([ti, pi], [to, po]) = (degrees(light), degrees(eye));
                let [r, g, b] = factor.to_array();
                let (x, y) = (t % SIZE[0], t / SIZE[0]);
                writeln!(table, "{x},{y},{ti},{pi},{to},{po},{r},{g},{b}").unwrap();
            }
        }
    }
    std::fs::write(path("readings.csv"), &table).unwrap();
    let (input, output, truth) = (path("readings.csv"), path("cloth.btf"), path("truth.btf"));
    let args = ["fit", &input, "-o", &output, "--truth", &truth, "--json"];
    let json = crate::report(yugen(&args));
    assert_eq!((json["lights"].as_u64(), json["masked"].as_u64()), (Some(60), Some(0)), "{json}");
    assert_eq!(json["errors"]["failed"], 0);
    for (name, most) in [("rho_d", 0.01), ("rho_s", 0.01), ("n", 0.1), ("t", 0.5), ("sigma_y", 0.01)] {
        let worst = json["errors"]["ninety"][name].as_f64().unwrap();
        assert!(worst < most, "{name}: {worst}");
    }
    let few: String = table.lines().take(1500).map(|l| format!("{l}\n")).collect();
    std::fs::write(&input, few).unwrap();
    let Run { success, err, .. } = yugen(&args);
    assert!(!success && err.contains("readings a texel are too few"), "{err}");
    std::fs::write(&input, table.replacen("0,0,", "0,half,", 1)).unwrap();
    let Run { success, err, .. } = yugen(&args);
    assert!(!success && err.contains("readings.csv:2:1: y is 'half'; expected a whole number"), "{err}");
    let Run { success, err, .. } = yugen(&["fit", &input, &input, "-o", &output]);
    assert!(!success && err.contains("put the lines of several into one file"), "{err}");
}

/// Highlights that no lamp showed head on show from aside.
#[test]
fn three_sides_tell_more_than_one() {
    let folder = scratch("capture_fit_sides");
    let path = |name: &str| folder.join(name).display().to_string();
    let photographs = "simulate kinran --size 40x40 --lights 20 --full-well 50000 --white 6";
    let views = "--view 0,0 --view 35,0 --view 35,90 --json -o";
    let all = path("sides");
    let mut args: Vec<&str> = photographs.split(' ').chain(views.split(' ')).collect();
    args.push(&all);
    crate::good(yugen(&args));
    let fit = |stacks: &[&str]| {
        let (output, truth) = (path("cloth.btf"), path("sides/truth.exr"));
        let json =
            crate::report(yugen(&[&["fit", "-o", &output, "--truth", &truth, "--json"], stacks].concat()));
        let errors = ["rho_d", "rho_s", "n", "t", "sigma_x", "sigma_y"];
        (json["lights"].as_u64().unwrap(), errors.map(|e| json["errors"]["ninety"][e].as_f64().unwrap()))
    };
    let [first, second, third] = ["view_01", "view_02", "view_03"].map(|v| path("sides") + "/" + v);
    let (_, head_on) = fit(&[&first]);
    let (lights, together) = fit(&[&all]);
    assert_eq!(lights, 60);
    // Half of each error, measured on a cloth of 64 x 64.
    assert!(together.iter().zip(head_on).all(|(t, h)| *t < 0.8 * h), "{together:?} {head_on:?}");
    assert_eq!(fit(&[&first, &second, &third]).1, together);
    let (_, aside) = fit(&[&second]);
    // A camera that were taken to stand head on would find every normal 17° off.
    assert!(aside[2] < 2.0, "{aside:?}");
}

/// A camera as near as one with a normal lens sees half vectors turn by ten degrees across the picture.
#[test]
fn a_near_camera_is_told_by_the_stack() {
    let folder = scratch("capture_fit_near");
    let path = |name: &str| folder.join(name).display().to_string();
    let stack = path("stack");
    let simulate = "simulate kinran --size 40x40 --lights 50 --camera-distance 1.4 --json -o";
    let args: Vec<&str> = simulate.split(' ').chain([stack.as_str()]).collect();
    crate::good(yugen(&args));
    let options = folder.join("stack/stack.toml");
    let said = std::fs::read_to_string(&options).unwrap();
    let fit = || {
        let (output, truth) = (path("cloth.btf"), path("stack/truth.exr"));
        crate::report(yugen(&["fit", &stack, "-o", &output, "--truth", &truth, "--json"]))
    };
    let near = fit();
    std::fs::write(&options, said.replace("= 1.4", "= \"far\"")).unwrap();
    let far = fit();
    assert_eq!(
        (near["camera_distance"].as_f64().map(|d| d as f32), &far["camera_distance"]),
        (Some(1.4), &serde_json::Value::Null)
    );
    let off = |json: &serde_json::Value| json["normals"]["ninety"].as_f64().unwrap();
    println!("normals, 90th percentile: {} degrees, {} as if far", off(&near), off(&far));
    assert!(off(&near) < 0.5 && off(&far) > 4.0, "{} {}", off(&near), off(&far));
}

/// The lights of a list that lies beside the balls.
#[test]
fn lights_of_another_folder_serve() {
    let folder = scratch("capture_lights");
    let path = |name: &str| folder.join(name).display().to_string();
    photograph(&folder.join("stack"), &cloth(), 20);
    std::fs::create_dir(folder.join("balls")).unwrap();
    std::fs::rename(folder.join("stack/lights.lp"), folder.join("balls/lights.lp")).unwrap();
    btf::save(&folder.join("truth.btf"), &cloth(), &btf::About::default()).unwrap();
    let (stack, lights, truth) = (path("stack"), path("balls/lights.lp"), path("truth.btf"));
    let (maps, relief, ptm) = (path("cloth.btf"), path("relief"), path("cloth.ptm"));
    let fit = ["fit", &stack, "-o", &maps, "--truth", &truth, "--json"];
    let Run { success, err, .. } = yugen(&fit);
    assert!(!success && err.contains("there is no list of lights"), "{err}");
    let json = crate::report(yugen(&[&fit[..], &["--lights", &lights]].concat()));
    assert_eq!((json["errors"]["failed"].as_u64(), json["lights"].as_u64()), (Some(0), Some(20)), "{json}");
    for verb in [["normals", &stack, "-o", &relief], ["rti", &stack, "-o", &ptm]] {
        // Silk is nothing for `normals`, which may say so.
        let Run { success, out, err } = yugen(&[&verb[..], &["--lights", &lights, "--json"]].concat());
        assert!(success, "{err}");
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(json["lights"], 20, "{json}");
    }
    let Run { success, err, .. } = yugen(&["fit", &stack, &stack, "-o", &maps, "--lights", &lights]);
    assert!(!success && err.contains("--lights is for a stack from one side"), "{err}");
}

#[test]
fn killed_and_resumed_it_is_the_same_to_the_bit() {
    let folder = scratch("capture_fit_kill");
    let path = |name: &str| folder.join(name).display().to_string();
    let stack = path("stack");
    crate::good(yugen(&["simulate", "kinran", "--size", "48x600", "--lights", "20", "--json", "-o", &stack]));
    let (whole, resumed) = (path("whole.btf"), path("resumed.btf"));
    crate::good(yugen(&["fit", &stack, "-o", &whole, "--json"]));

    // Row by row, so that there is something to go on from early.
    let checkpoint = folder.join("resumed.btf.checkpoint");
    let args = ["fit", &stack, "-o", &resumed, "--json", "--memory", "0", "--threads", "1"];
    // The list of 20 pictures is no longer than a hundred rows.
    crate::killed_midway(&["capture"], &args, &checkpoint, 48 * 72 * 100);
    assert!(!Path::new(&resumed).exists(), "it was killed before its end");
    crate::good(yugen(&["fit", &stack, "-o", &resumed, "--json", "--resume"]));
    assert!(!checkpoint.exists(), "the checkpoint has served");
    assert!(std::fs::read(&whole).unwrap() == std::fs::read(&resumed).unwrap(), "the resumed maps differ");
}

/// A limit on the size of files stands for the disk: what was fitted until then is kept.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_what_is_done() {
    let folder = scratch("capture_fit_full");
    let path = |name: &str| folder.join(name).display().to_string();
    let stack = path("stack");
    crate::good(yugen(&["simulate", "kinran", "--size", "48x200", "--lights", "20", "--json", "-o", &stack]));
    let (whole, resumed) = (path("whole.btf"), path("resumed.btf"));
    crate::good(yugen(&["fit", &stack, "-o", &whole, "--json"]));
    let args = ["capture", "fit", &stack, "-o", &resumed, "--json", "--memory", "0"];
    let limited = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 400; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_yugen")])
        .args(args)
        .output()
        .unwrap();
    let said = String::from_utf8(limited.stderr).unwrap();
    assert!(!limited.status.success() && !Path::new(&resumed).exists(), "{said}");
    let words = ["resumed.btf.checkpoint: files may not become so large", "rows are kept there", "--resume"];
    assert!(words.iter().all(|w| said.contains(w)) && said.lines().count() == 1, "{said}");
    crate::good(yugen(&["fit", &stack, "-o", &resumed, "--json", "--resume"]));
    assert!(std::fs::read(&whole).unwrap() == std::fs::read(&resumed).unwrap(), "the resumed maps differ");
    // From a fit that failed before its first row nobody can go on.
    std::fs::write(folder.join("stack").join("0003.exr"), b"").unwrap();
    let failed = yugen(&["fit", &stack, "-o", &path("failed.btf")]);
    assert!(!failed.success && failed.err.contains("the file is empty"), "{}", failed.err);
    assert!(!folder.join("failed.btf.checkpoint").exists());
}

#[test]
fn bad_stacks_get_a_sentence() {
    let folder = scratch("fit/bad");
    let path = |name: &str| folder.join(name).display().to_string();
    photograph(&folder.join("few"), &cloth(), 3);
    let Run { success, err, .. } = yugen(&["fit", &path("few"), "-o", &path("a.btf")]);
    assert!(!success && err.contains("3 lights are too few"), "{err}");
    let Run { success, err, .. } = yugen(&["fit", &path("none"), "-o", &path("a.btf")]);
    assert!(!success && err.contains("none"), "{err}");
    let mut small = cloth();
    small.texels.truncate(24);
    small.height = 1;
    btf::save(&folder.join("small.btf"), &small, &btf::About::default()).unwrap();
    photograph(&folder.join("stack"), &cloth(), 9);
    let Run { success, err, .. } =
        yugen(&["fit", &path("stack"), "-o", &path("a.btf"), "--truth", &path("small.btf")]);
    assert!(!success && err.contains("24 x 1") && err.contains("24 x 40"), "{err}");
    // What the result cannot be is told before the work.
    let taken = path("taken.btf");
    std::fs::create_dir(folder.join("taken.btf")).unwrap();
    for (output, more, problem) in [
        (path("a.png"), ["--texel-mm", "1"], ".btf or, the same, .exr"),
        (path("missing/a.btf"), ["--texel-mm", "1"], "there is no folder"),
        (taken, ["--texel-mm", "1"], "this is a folder"),
        (path("small.btf"), ["--truth", &path("small.btf")], "would be lost"),
        (path("a.btf"), ["--texel-mm", "inf"], "above zero"),
        (path("a.btf"), ["--report", &path("small.btf")], "small.btf"),
    ] {
        let Run { success, err, .. } = yugen(&[&["fit", &path("stack"), "-o", &output], &more[..]].concat());
        assert!(!success && err.contains(problem), "{problem}: {err}");
    }
    std::fs::write(folder.join("a.btf.checkpoint"), b"yugen capture fit 1\nof something else").unwrap();
    let Run { success, err, .. } = yugen(&["fit", &path("stack"), "-o", &path("a.btf"), "--resume"]);
    assert!(!success && err.contains("leave out --resume"), "{err}");
    assert!(!folder.join("a.btf").exists());
}

/// Rendered things with known normals: `fit` finds those of `normals`, and says that there is hardly a highlight.
#[test]
fn a_matte_thing_is_fitted_as_such() {
    let Some(data) = std::env::var_os("YUGEN_DATA").map(std::path::PathBuf::from) else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA names no folder of data");
        eprintln!("skipped: YUGEN_DATA names no folder of data");
        return;
    };
    let folder = scratch("fit_matte");
    // Of the glazed one, whose coat is mirrors to these lamps, a few texels show one.
    for (name, most, few, shiny) in [
        ("spot_matte_50", 1.2, false, 0),
        ("spot_matte_12", 1.3, true, 0),
        ("spot_glazed_24", 2.0, false, 60),
    ] {
        let stack = data.join("multilight").join(name);
        let output = folder.join("spot.btf");
        let args = ["fit", &stack.display().to_string(), "-o", &output.display().to_string(), "--json"];
        let json = crate::report(yugen(&args));
        assert_eq!(json["few_lights"], few, "{json}");
        let kinds =
            ["ground", "ground_and_highlight", "highlight"].map(|k| json["kinds"][k].as_u64().unwrap());
        println!("{name}: grounds, with a highlight, highlights {kinds:?}");
        assert!(kinds[0] > 6600 && kinds[1] + kinds[2] <= shiny, "{name}: {kinds:?}");
        let maps = btf::load(&output, ColourSpace::LinearSrgb).unwrap().0;
        let truth = image::read(&stack.join("normals.png"), &image::ReadOptions::raw()).unwrap();
        let (mut sum, mut count, mut sure, mut wrong) = (0.0, 0.0, 0, 0);
        for (t, n) in maps.texels.iter().zip(truth.data.chunks_exact(3)) {
            let n = Vec3::from_slice(n) * 2.0 - 1.0;
            if t.confidence > 0.0 && (n.length() - 1.0).abs() < 0.2 {
                let off = t.normal.angle_between(n).to_degrees();
                (sum, count) = (sum + off, count + 1.0);
                sure += u32::from(t.confidence > 0.5);
                wrong += u32::from(t.confidence > 0.5 && off > 5.0);
            }
        }
        println!("{name}: mean {:.2} of {count} texels, {wrong} of {sure} sure ones off by 5°", sum / count);
        assert!(sum / count < most && count > 6600.0, "{name}: {}", sum / count);
        assert!(100 * wrong < sure && sure > 4000, "{name}: {wrong} of {sure}");
        assert!(maps.texels.iter().all(|t| t.specular.max_element() <= 2.0));
    }
}
