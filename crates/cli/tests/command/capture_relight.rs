//! `yugen capture rti` and `yugen capture relight` from outside.

use crate::yugen;
use serde_json::Value;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, ReadOptions, WriteOptions};
use yugen_archive::formats::{btf, lp, stack};
use yugen_optics::frame::spherical;
use yugen_optics::{ColourSpace, Image, Vec2, Vec3};
use yugen_reflectance::btf::{Btf, Texel};

const SIZE: [usize; 2] = [32, 20];

fn good(args: &[&str]) -> String {
    crate::good(yugen(&["capture"], args))
}

fn bad(args: &[&str]) -> String {
    crate::bad(yugen(&["capture"], args))
}

fn scratch(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("relight").join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Light number `i`: a spiral down to 60 degrees.
fn toward(i: usize) -> Vec3 {
    spherical((1.0 - 0.5 * (i as f32 + 0.5) / 20.0).acos(), 2.399_963_2 * i as f32)
}

/// A matt relief, brighter to the right, red above and blue below.
fn matt(x: usize, y: usize) -> (Vec3, Vec3) {
    let (u, v) = (x as f32 / SIZE[0] as f32, y as f32 / SIZE[1] as f32);
    (
        Vec3::new(0.2 * (9.0 * u).sin(), 0.2 * (7.0 * v).cos(), 1.0).normalize(),
        (0.2 + 0.6 * u) * Vec3::new(1.0 - v, 0.5, v),
    )
}

fn photograph(folder: &Path) {
    let mut entries = Vec::new();
    for i in 0..20 {
        let mut picture = Image::rgb(SIZE[0], SIZE[1]);
        for (p, pixel) in picture.data.chunks_exact_mut(3).enumerate() {
            let (normal, albedo) = matt(p % SIZE[0], p / SIZE[0]);
            pixel.copy_from_slice(&(albedo * normal.dot(toward(i)).max(0.0)).to_array());
        }
        let file = format!("{i:03}.exr");
        image::write(&folder.join(&file), &picture, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap();
        entries.push(lp::Entry { file, light: toward(i) });
    }
    stack::write(folder, &entries, &stack::Options::default()).unwrap();
}

/// Mean difference of display values.
fn apart(a: &Path, b: &Path) -> f32 {
    let [a, b] = [a, b].map(|p| image::read(p, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap());
    assert_eq!((a.width, a.height), (b.width, b.height));
    let show = |v: f32| yugen_optics::colour::linear_to_srgb(v.clamp(0.0, 1.0));
    let sum: f32 = a.data.iter().zip(&b.data).map(|(a, b)| (show(*a) - show(*b)).abs()).sum();
    sum / a.data.len() as f32
}

#[test]
fn a_stack_becomes_every_format_and_each_shows_it_again() {
    let folder = scratch("stack");
    photograph(&folder);
    let stack = folder.to_str().unwrap();
    let light = toward(7).to_array().map(|v| v.to_string()).join(",");
    for (name, options) in [
        ("a.ptm", &[][..]),
        ("b.ptm", &["--lrgb"]),
        ("linear.ptm", &["--linear"]),
        ("a.rti", &[]),
        ("c.rti", &["--basis", "hsh16"]),
        ("web", &["--basis", "ptm"]),
        ("web_lrgb", &["--lrgb"]),
        ("deepzoom", &["--layout", "deepzoom"]),
        ("tarzoom", &["--layout", "tarzoom", "--lrgb", "--basis", "ptm"]),
        ("itarzoom", &["--layout", "itarzoom"]),
        ("linear", &["--linear"]),
    ] {
        let path = scratch("out").join(name);
        let path = path.to_str().unwrap();
        // A few rows at a time.
        let report = good(&[&["rti", stack, "-o", path, "--json", "--memory", "0"], options].concat());
        let report: Value = serde_json::from_str(&report).unwrap();
        assert!(report["rms_error"].as_f64().unwrap() < 0.03, "{name}: {report}");
        let picture = scratch("out").join(format!("{name}.png"));
        let linear: &[&str] = if name == "linear.ptm" { &["--linear"] } else { &[] };
        good(&[&["relight", path, "--light", &light, "-o", picture.to_str().unwrap()], linear].concat());
        let apart = apart(&picture, &folder.join("007.exr"));
        // Measured 0.5 to 1.5 of a hundred, most for the linear one, whose quanta are coarse in the dark.
        assert!(apart < 0.03, "{name}: {apart}");
    }
    for method in ["ptm", "lrgb-ptm", "hsh9", "rbf", "rbf-gaussian"] {
        let picture = scratch("out").join(format!("{method}.exr"));
        good(&["relight", stack, "--light", &light, "-o", picture.to_str().unwrap(), "--method", method]);
        let apart = apart(&picture, &folder.join("007.exr"));
        assert!(apart < 0.02, "{method}: {apart}");
    }
}

#[test]
fn photographs_left_out_are_predicted_and_compared() {
    let folder = scratch("held");
    photograph(&folder);
    let stack = folder.to_str().unwrap();
    let mut normals = Image::new(SIZE[0], SIZE[1], &["X", "Y", "Z"]);
    for (p, pixel) in normals.data.chunks_exact_mut(3).enumerate() {
        pixel.copy_from_slice(&matt(p % SIZE[0], p / SIZE[0]).0.to_array());
    }
    let truth = scratch("held").join("normals.exr");
    image::write(&truth, &normals, &WriteOptions::default()).unwrap();
    let pictures = scratch("report");
    let options = ["--normals", truth.to_str().unwrap(), "--report", pictures.to_str().unwrap()];
    let report = good(&[&["relight", stack, "--hold-out", "003.exr,9", "--json"], &options[..]].concat());
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["left_out"], serde_json::json!(["003.exr", "008.exr"]));
    let scores = report["scores"].as_array().unwrap();
    assert_eq!(scores.len(), 8);
    for s in scores {
        let number = |key: &str| s[key].as_f64().unwrap();
        assert!(number("psnr") > 25.0 && number("ssim") > 0.9 && number("colour_angle") < 2.0, "{s}");
        assert!(number("normal_angle") < 12.0, "{s}");
    }
    // What is matt is said exactly by maps.
    assert!(
        scores[0]["method"] == "BTF" && scores[0]["normal_angle"].as_f64().unwrap() < 2.0,
        "{}",
        scores[0]
    );
    for name in ["003_truth.png", "003_btf.png", "008_rbf_thin_plate.png", "error_hsh_9.png"] {
        assert!(pictures.join(name).is_file(), "{name}");
    }
    // Maps know normals too; those of the fit itself are the same.
    let maps = scratch("held_maps").join("cloth.btf");
    let maps = maps.to_str().unwrap();
    good(&["fit", stack, "-o", maps]);
    let same = ["relight", stack, "--hold-out", "2", "--method", "btf", "--normals", maps, "--json"];
    let report: Value = serde_json::from_str(&good(&same)).unwrap();
    let off = report["scores"][0]["normal_angle"].as_f64().unwrap();
    assert!(off < 1.0, "{off}");
    let table = good(&["relight", stack, "--hold-out", "4", "--method", "ptm,rbf"]);
    assert!(
        table.contains("16 lights to learn from, 4 left out (002.exr, 007.exr, 012.exr, 017.exr)"),
        "{table}"
    );
}

#[test]
fn cloth_is_lit_by_lamps_and_panoramas() {
    let texel = Texel {
        diffuse: Vec3::new(0.4, 0.2, 0.1),
        specular: Vec3::ZERO,
        normal: Vec3::Z,
        tangent: Vec3::X,
        sigma: Vec2::splat(0.3),
        confidence: 1.0,
    };
    let maps = Btf { width: 4, height: 3, colour_space: ColourSpace::LinearSrgb, texels: vec![texel; 12] };
    let cloth = scratch("cloth").join("cloth.btf");
    btf::save(&cloth, &maps, &btf::About::default()).unwrap();
    let sky = scratch("cloth").join("sky.exr");
    let mut even = Image::rgb(32, 17);
    even.data.fill(2.0);
    image::write(&sky, &even, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap();
    let out = scratch("cloth").join("lit.exr");
    let [cloth, sky, lit] = [&cloth, &sky, &out].map(|p| p.to_str().unwrap());
    for (light, want) in [(["--light", "0,0.6,0.8"], 0.8), (["--environment", sky], 2.0)] {
        good(&["relight", cloth, light[0], light[1], "-o", lit]);
        let picture = image::read(&out, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap();
        let got = Vec3::from_slice(picture.pixel(2, 1));
        assert!((got / want - Vec3::new(0.4, 0.2, 0.1)).abs().max_element() < 2e-3, "{light:?} {got}");
    }
}

#[test]
fn mistakes_get_a_sentence() {
    let folder = scratch("mistakes");
    photograph(&folder);
    let stack = folder.to_str().unwrap();
    let ptm = folder.join("a.ptm");
    let ptm = ptm.to_str().unwrap();
    good(&["rti", stack, "-o", ptm]);
    let list = folder.join("no.lp");
    std::fs::write(&list, b"\x89PNG\0\xff").unwrap();
    let list = list.to_str().unwrap();
    for (args, want) in [
        (&["rti", stack, "-o", "a.ptm", "--basis", "hsh9"][..], "cannot hold HSH 9; expected HSH (.rti) or"),
        (&["rti", stack, "-o", "a.rti", "--lrgb"], "write a .ptm or a folder"),
        (&["rti", stack, "-o", "a.ptm", "--layout", "tarzoom"], "a .ptm has no tiles; name a folder"),
        (
            &["rti", stack, "-o", "a", "--layout", "zoomify"],
            "expected one of image, deepzoom, tarzoom, itarzoom",
        ),
        (&["rti", ptm, "-o", "a.rti"], "this is fitted already; expected a stack of photographs"),
        (&["relight", ptm, "--hold-out", "2"], "this is fitted already"),
        (&["relight", ptm, "--light", "0,0,1", "-o", "a.png", "--method", "ptm"], "--method is for stacks"),
        (&["relight", ptm, "--light", "0,0,-1", "-o", "a.png"], "z above zero"),
        (&["relight", ptm, "--light", "0,0,1", "-o", "a.xyz"], "expected a name ending in"),
        (&["relight", ptm, "-o", "a.png"], "--light x,y,z or --environment FILE"),
        (&["relight", ptm, "--light", "0,0,1", "--exposure", "nan", "-o", "a.png"], "expected stops"),
        (&["rti", stack, "-o", stack], "the photographs are here; name another folder"),
        (&["rti", "a.png", "-o", "a.ptm"], "a.png"),
        (&["relight", list, "--light", "0,0,1", "-o", "a.png"], "which is text; name the folder"),
        (&["relight", stack, "--hold-out", "20"], "expected 1 to 19 of the 20 photographs"),
        (&["relight", stack, "--hold-out", "21,"], "'21' is no photograph of the stack"),
        (&["relight", stack, "--light", "0,0,1", "-o", "a.png", "--method", "btf"], "yugen capture fit"),
        (
            &["relight", stack, "--light", "0,0,1", "-o", "a.png", "--method", "sh"],
            "expected one of btf, lrgb-ptm",
        ),
    ] {
        let error = bad(args);
        assert!(error.contains(want), "{args:?}: {error}");
    }
    std::fs::write(ptm, "PTM_1.2\nPTM_FORMAT_RGB\n9\n9\n1 1 1 1 1 1\n0 0 0 0 0 0\n").unwrap();
    let error = bad(&["relight", ptm, "--light", "0,0,1", "-o", "a.png"]);
    assert!(error.contains("the file ends early: 9 x 9 texels need 1458 bytes"), "{error}");
}

/// What this program does not write, and others do.
#[test]
fn pictures_of_others_are_relit() {
    let folder = scratch("others");
    let path = folder.join("luminance.ptm");
    // Y = (51 + 102 x)/255, Cb = 0, Cr = 25/255.
    let mut bytes = b"PTM_1.2\nPTM_FORMAT_LUM\n1 1\n1 1 1 1 1 1\n0 0 0 0 0 0\n".to_vec();
    bytes.extend([0, 0, 0, 102, 0, 51, 153, 128]);
    std::fs::write(&path, bytes).unwrap();
    let lit = folder.join("lit.exr");
    let linear = ["--linear", "--light", "0.6,0,0.8", "-o", lit.to_str().unwrap()];
    good(&[&["relight", path.to_str().unwrap()], &linear[..]].concat());
    let pixel = image::read(&lit, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap().data;
    let (y, cr) = ((51.0 + 102.0 * 0.6) / 255.0, 25.0 / 255.0);
    let want = [y + 1.402 * cr, y - 0.714_136 * cr, y];
    assert!(pixel.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-3), "{pixel:?} {want:?}");

    // Two lights, of which the nearer one counts: (51, 102, 153) and, the plane being one third of 3, (100, 0, 50).
    let web = folder.join("web");
    std::fs::create_dir_all(&web).unwrap();
    let plane = Image { data: vec![1.0 / 3.0; 3], ..Image::rgb(1, 1) };
    let raw = WriteOptions { raw: true, ..WriteOptions::from(ColourSpace::LinearSrgb) };
    image::write(&web.join("plane_0.png"), &plane, &raw).unwrap();
    let info = r#"{"width": 1, "height": 1, "format": "png", "type": "rbf", "colorspace": "mrgb", "nplanes": 1,
"lights": [0, 0, 1, 0.6, 0, 0.8], "sigma": 0.05, "basis": [0, 0, 0, 51, 102, 153, 0, 0, 0, 227, 127, 177],
"materials": [{"scale": [3], "bias": [0], "range": [100]}]}"#;
    std::fs::write(web.join("info.json"), info).unwrap();
    good(&[&["relight", web.to_str().unwrap()], &linear[..]].concat());
    let pixel = image::read(&lit, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap().data;
    let want = [0.2 + 1.0, 0.4, 0.6 + 0.5];
    assert!(pixel.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-3), "{pixel:?} {want:?}");
    let told = crate::good(yugen(&["info"], &[web.to_str().unwrap()]));
    assert!(told.contains("RBF, 2 lights") && told.contains("components"), "{told}");
    // What the colours are may be said, too.
    let with = |profile: &str| {
        let text = info.replace("\"sigma\"", &format!("\"colorprofile\": \"{profile}\", \"sigma\""));
        std::fs::write(web.join("info.json"), text).unwrap();
        yugen(&["capture", "relight"], &[&[web.to_str().unwrap()], &linear[1..]].concat())
    };
    crate::good(with("RGB"));
    let pixel = image::read(&lit, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap().data;
    assert!(pixel.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-3), "{pixel:?} {want:?}");
    let run = with("P3");
    assert!(run.success && run.err.contains("the colour profile 'P3': colours are taken for those of sRGB"));
}

fn data() -> Option<PathBuf> {
    match std::env::var_os("YUGEN_DATA") {
        Some(folder) => Some(PathBuf::from(folder).join("multilight")),
        None if std::env::var_os("CI").is_some() => {
            panic!("YUGEN_DATA is not set, and CI must not skip this")
        }
        None => {
            println!("skipped: YUGEN_DATA is not set");
            None
        }
    }
}

fn psnr(stack: &Path, options: &[&str]) -> Vec<(String, f64)> {
    let report = good(&[&["relight", stack.to_str().unwrap(), "--json"], options].concat());
    let report: Value = serde_json::from_str(&report).unwrap();
    let scores = report["scores"].as_array().unwrap();
    let row = |s: &Value| (s["method"].as_str().unwrap().to_string(), s["psnr"].as_f64().unwrap());
    let rows: Vec<_> = scores.iter().map(row).collect();
    rows.iter().for_each(|(method, psnr)| println!("{method}: {psnr:.1} dB"));
    rows
}

/// Eight photographs of a relief: too few for maps of a cloth, enough for all else.
#[test]
fn the_butterfly_is_predicted() {
    let Some(data) = data() else { return };
    let folder = scratch("butterfly");
    for entry in std::fs::read_dir(data.join("butterfly")).unwrap() {
        let entry = entry.unwrap();
        std::fs::write(folder.join(entry.file_name()), std::fs::read(entry.path()).unwrap()).unwrap();
    }
    std::fs::write(folder.join("stack.toml"), "ambient = \"image_ambient.png\"").unwrap();
    let scores = psnr(&folder, &["--hold-out", "2"]);
    assert_eq!(scores.len(), 7);
    for (method, psnr) in scores {
        // Measured 32.1 to 33.9.
        assert!(psnr > 31.0, "{method}: {psnr}");
    }
}

/// A metal sphere, whose lamps are found from where it mirrors them.
#[test]
fn the_sphere_is_predicted_better_by_maps_than_by_ptm_and_hsh() {
    let Some(data) = data() else { return };
    let (from, folder) = (data.join("toyps_sphere"), scratch("sphere"));
    let mut entries = Vec::new();
    for i in 0..50 {
        let file = format!("l_{i:03}.png");
        let picture = image::read(&from.join(&file), &ReadOptions::raw()).unwrap();
        let brightness = |p: usize| picture.data[3 * p..3 * p + 3].iter().sum::<f32>();
        let peak = (0..128 * 128).map(brightness).fold(0.0, f32::max);
        let (mut centre, mut weight) = (Vec2::ZERO, 0.0);
        for p in (0..128 * 128).filter(|p| brightness(*p) > 0.5 * peak) {
            centre += brightness(p) * Vec2::new((p % 128) as f32, (p / 128) as f32);
            weight += brightness(p);
        }
        // The mask is a disc of radius 52 about (63.5, 63.5).
        let n = (centre / weight - 63.5) / 52.0 * Vec2::new(1.0, -1.0);
        let n = n.extend((1.0 - n.length_squared()).sqrt());
        entries.push(lp::Entry { file: file.clone(), light: 2.0 * n.z * n - Vec3::Z });
        std::fs::write(folder.join(&file), std::fs::read(from.join(&file)).unwrap()).unwrap();
    }
    std::fs::write(folder.join("mask.png"), std::fs::read(from.join("mask.png")).unwrap()).unwrap();
    let options = stack::Options { response: stack::Response::Linear, ..stack::Options::default() };
    stack::write(&folder, &entries, &options).unwrap();

    // Its normals are known.
    let maps = folder.join("sphere.btf");
    crate::good(crate::yugen(
        &["capture", "fit"],
        &[folder.as_os_str(), "-o".as_ref(), maps.as_os_str(), "--json".as_ref()],
    ));
    let (maps, _) = btf::load(&maps, ColourSpace::LinearSrgb).unwrap();
    let off = |steepest: f32| {
        let least = steepest.to_radians().cos();
        let all = maps.texels.iter().enumerate().filter_map(|(p, texel)| {
            let at = (Vec2::new((p % 128) as f32, (p / 128) as f32) - 63.5) / 52.0 * Vec2::new(1.0, -1.0);
            let n = at.extend((1.0 - at.length_squared()).max(0.0).sqrt());
            (n.z > least).then(|| n.angle_between(texel.normal).to_degrees())
        });
        let all: Vec<f32> = all.collect();
        all.iter().sum::<f32>() / all.len() as f32
    };
    let [flat, level, steep, rim] = [30.0, 45.0, 60.0, 80.0].map(off);
    println!(
        "normals off by {flat:.2} degrees below 30, {level:.2} below 45, {steep:.2} below 60, {rim:.2} below 80"
    );
    // Measured .50, .80 and 1.61: eight bits hold what steep texels show in few steps.
    assert!(level < 0.8 && steep < 1.2 && rim < 2.5, "{level} {steep} {rim}");
    let scores = psnr(&folder, &["--hold-out", "8"]);
    let (btf, rest) = scores.split_first().unwrap();
    for (method, psnr) in rest.iter().filter(|s| !s.0.starts_with("RBF")) {
        assert!(btf.1 > *psnr, "BTF {:.2} dB, {method} {psnr:.2} dB", btf.1);
    }
}
