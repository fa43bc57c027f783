//! `yugen render` as a person would run it: killed, resumed, misused.

use crate::{Run, bad, killed_midway, refused, report, scratch};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

pub const SCENE: &str = r##"
[camera]
from = [0, 1.2, 3]
to = [0, 0.4, 0]
fov = 35

[film]
size = [96, 64]

[material.desk]
model = "lambert"
reflectance = 0.8

[material.red]
model = "rough_plastic"
diffuse_reflectance = "#b3201a"
alpha = 0.1

[[shape]]
type = "rectangle"
size = [4, 4]
facing = [0, 1, 0]
material = "desk"

[[shape]]
type = "sphere"
radius = 0.4
at = [0, 0.4, 0]
material = "red"

[[shape]]
type = "rectangle"
at = [1, 2.5, 1]
facing = [-1, -2.1, -1]
emission = { blackbody = 3000, scale = 12 }
"##;

/// A folder with the scene in it, and the scene.
pub fn set_up(name: &str) -> (PathBuf, PathBuf) {
    let folder = scratch(&format!("render_{name}"));
    let scene = folder.join("ball.toml");
    std::fs::write(&scene, SCENE).unwrap();
    (folder, scene)
}

pub fn arguments<'a>(scene: &'a Path, output: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    [&[scene.to_str().unwrap(), "-o", output.to_str().unwrap()], more].concat()
}

pub fn render(scene: &Path, output: &Path, more: &[&str]) -> Run {
    crate::yugen(&["render"], &arguments(scene, output, more))
}

#[test]
fn killed_and_resumed_it_is_the_same_to_the_bit_for_any_number_of_threads() {
    let (folder, scene) = set_up("kill");
    let (whole, resumed) = (folder.join("whole.exr"), folder.join("resumed.exr"));
    let budget = ["--spp", "1024", "--aov", "all", "--json"];
    report(render(&scene, &whole, &[&budget[..], &["--threads", "1"]].concat()));

    let checkpoint = folder.join("resumed.exr.checkpoint");
    let often = [&budget[..], &["--threads", "2", "--checkpoint", "0.05"]].concat();
    killed_midway(&["render"], &arguments(&scene, &resumed, &often), &checkpoint, 0);
    assert!(!resumed.exists(), "nothing may be half-written, and it was killed before its end");

    report(render(&scene, &resumed, &[&budget[..], &["--resume", "--checkpoint", "0"]].concat()));
    assert!(!checkpoint.exists(), "the checkpoint has served");
    let same = std::fs::read(&whole).unwrap() == std::fs::read(&resumed).unwrap();
    assert!(same, "the resumed picture differs");
}

#[test]
fn a_checkpoint_of_another_render_is_refused() {
    let (folder, scene) = set_up("other");
    let output = folder.join("a.exr");
    std::fs::write(folder.join("a.exr.checkpoint"), b"something else").unwrap();
    refused(render(&scene, &output, &["--resume", "--spp", "1"]), &["a.exr.checkpoint", "checkpoint"]);
    assert!(!output.exists());
}

/// The scene file stays as it is; a vertex of the mesh it names is moved.
#[test]
fn a_checkpoint_is_refused_once_a_mesh_has_changed() {
    let (folder, _) = set_up("moved");
    let (scene, output) = (folder.join("tent.toml"), folder.join("a.exr"));
    let tent = "[[shape]]\ntype = \"file\"\nfile = \"tent.obj\"\nmaterial = \"red\"\n";
    std::fs::write(&scene, format!("{SCENE}\n{tent}")).unwrap();
    let write = |top: &str| {
        let obj = format!("v -0.5 0 -1\nv 0.5 0 -1\nv 0 {top} -1\nf 1 2 3\n");
        std::fs::write(folder.join("tent.obj"), obj).unwrap();
    };
    write("1.5");
    let checkpoint = folder.join("a.exr.checkpoint");
    let often = ["--spp", "16384", "--checkpoint", "0.05", "--json"];
    killed_midway(&["render"], &arguments(&scene, &output, &often), &checkpoint, 0);

    write("1.5001");
    let again = ["--spp", "16384", "--resume", "--json"];
    refused(render(&scene, &output, &again), &["a.exr.checkpoint", "the mesh of 'tent' has changed"]);
    assert!(checkpoint.exists() && !output.exists());
    // Put back, it is the same scene again: the refusal was about the vertex.
    write("1.5");
    let mut child = Command::new(env!("CARGO_BIN_EXE_yugen"))
        .arg("render")
        .args(arguments(&scene, &output, &again))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(500));
    let running = child.try_wait().unwrap().is_none();
    child.kill().unwrap();
    let text = String::from_utf8_lossy(&child.wait_with_output().unwrap().stderr).into_owned();
    assert!(running && text.is_empty(), "{text}");
}

#[test]
fn json_says_what_was_done() {
    let (folder, scene) = set_up("json");
    let output = folder.join("a.png");
    let told = report(render(&scene, &output, &["--spp", "4", "--size", "40x30", "--json"]));
    assert_eq!(told["width"], 40);
    assert_eq!(told["samples"], 4 * 40 * 30);
    assert!(std::fs::read(&output).unwrap().starts_with(b"\x89PNG"));
    assert_eq!(told["clamped_light"], 0.0);
    let told =
        report(render(&scene, &output, &["--spp", "4", "--size", "40x30", "--json", "--clamp", "1e-4"]));
    assert!(told["clamped_light"].as_f64().unwrap() > 0.01, "{told}");
}

#[test]
fn mistakes_are_told_before_anything_is_rendered() {
    let (folder, scene) = set_up("mistakes");
    let cases: [(&[&str], &str, &str); 16] = [
        (&["--at", "1.5"], "a.exr", "nothing in it moves"),
        (&[], "missing/a.png", "there is no folder"),
        (&[], ".", "cannot tell a picture format"),
        (&[], "a.txt", ".jpeg, .mp4, .apng"),
        (&["-D", "spp=4"], "a.exr", "has no parameters, so 'spp'"),
        (&["--size", "65536x65536"], "a.exr", "give a smaller size"),
        (&[], "a.bmp", "exr"),
        (&["--aov", "normal"], "a.png", "--aov needs an .exr"),
        (&["--camera", "left"], "a.exr", "no camera called 'left'"),
        (&["--size", "12"], "a.exr", "640x480"),
        (&["--spp", "1", "--time", "3s"], "a.exr", "cannot be used with"),
        (&["--checkpoint", "-1"], "a.exr", "expected a number of seconds"),
        (&["--exposure", "nan"], "a.png", "expected stops"),
        (&["--clamp", "0"], "a.png", "expected a number above zero"),
        (&["--denoise", "--integrator", "depth"], "a.exr", "--denoise is for light"),
        (&["--denoise", "--spp", "1"], "a.exr", "--spp has to be 2 or more"),
    ];
    for (arguments, output, expected) in cases {
        let text = bad(render(&scene, &folder.join(output), arguments));
        assert!(text.contains(expected), "{arguments:?}: {text}");
        assert!(output == "." || !folder.join(output).exists());
    }
    let output = folder.join("a.exr");
    std::fs::write(&scene, SCENE.replace("reflectance = 0.8", "reflectanse = 0.8")).unwrap();
    refused(render(&scene, &output, &[]), &["ball.toml:12:1", "reflectance"]);
    std::fs::write(&scene, SCENE.replace("[camera]", "[render]\nsamples = 1\n[camera]")).unwrap();
    refused(render(&scene, &output, &["--denoise"]), &["--spp has to be 2 or more"]);
    std::fs::write(&scene, SCENE.replace("fov = 35", "fov = nan")).unwrap();
    refused(
        render(&scene, &output, &[]),
        &["ball.toml:5:7: 'fov' is nan, which is not finite; expected a number"],
    );
    refused(
        render(&folder.join("none.toml"), &output, &[]),
        &["none.toml: there is nothing of this name; check its name\n"],
    );
    refused(render(&folder.join("bal.toml"), &output, &[]), &["did you mean 'ball.toml'?"]);
    refused(render(&folder, &output, &[]), &["this is a folder"]);
}

/// A scene is read and rendered, but something in it is not as it was meant.
#[test]
fn warnings_name_file_and_cause() {
    let (folder, scene) = set_up("warnings");
    let output = folder.join("a.png");
    let quick = ["--spp", "1", "--size", "4x4", "--json"];
    let warned = |scene: &Path, words: &[&str]| {
        let run = render(scene, &output, &quick);
        assert!(run.success && words.iter().all(|w| run.err.contains(w)), "{}", run.err);
    };
    std::fs::write(&scene, SCENE.replace("emission", "# emission")).unwrap();
    warned(&scene, &["ball.toml: nothing in the scene shines", "black"]);

    // A triangle whose material has two textures, each with its own set of (u, v), of which it has one.
    let numbers: Vec<u8> =
        [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("t.bin"), numbers).unwrap();
    let picture = yugen_optics::Image::rgb(2, 2);
    let options = yugen_archive::formats::image::WriteOptions::default();
    yugen_archive::formats::image::write(&folder.join("t.png"), &picture, &options).unwrap();
    let gltf = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }, { "camera": 0, "translation": [0, 0, 3] }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }],
        "meshes": [{ "name": "tent", "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
        "materials": [{ "name": "brocade", "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 },
            "normalTexture": { "index": 0, "texCoord": 1 } }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2" }],
        "textures": [{ "source": 0 }], "images": [{ "uri": "t.png" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "uri": "t.bin", "byteLength": 36 }] }"#;
    let scene = folder.join("t.gltf");
    std::fs::write(&scene, gltf).unwrap();
    warned(&scene, &["t.gltf", "mesh 'tent' has no TEXCOORD_1, which a texture of its material asks for"]);
}

/// Cleaner by what is claimed, with the raw picture and the error that remains beside it; killed, resumed or with other
/// threads the same.
#[test]
fn denoised_it_is_cleaner_and_the_raw_picture_is_kept() {
    let (folder, scene) = set_up("denoise");
    let picture = |name: &str| {
        let options = yugen_archive::formats::image::ReadOptions::default();
        yugen_archive::formats::image::read(&folder.join(name), &options).unwrap()
    };
    let base = ["--json", "--checkpoint", "0", "--spp"];
    let rendered =
        |name: &str, more: &[&str]| report(render(&scene, &folder.join(name), &[&base[..], more].concat()));
    rendered("plain.exr", &["16"]);
    let told = rendered("clean.exr", &["16", "--denoise", "--threads", "1"]);
    rendered("again.exr", &["16", "--denoise", "--threads", "3"]);
    rendered("truth.exr", &["1024", "--seed", "5"]);
    let (plain, clean, truth) = (picture("plain.exr"), picture("clean.exr"), picture("truth.exr"));
    assert_eq!(clean.data, picture("again.exr").data);
    let colours = ["R", "G", "B"];
    let noisy = clean.select(&["noisy.R", "noisy.G", "noisy.B"]).unwrap();
    assert_eq!(noisy.data, plain.select(&colours).unwrap().data);
    let truth = truth.select(&colours).unwrap();
    // A tenth of the mean is as dark as counts.
    let dark = 0.1 * f64::from(truth.data.iter().sum::<f32>()) / truth.data.len() as f64;
    let error = |image: &yugen_optics::Image| {
        let squared = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2) / f64::from(b * b).max(dark * dark);
        image.data.iter().zip(&truth.data).map(squared).sum::<f64>() / truth.data.len() as f64
    };
    let (before, after) = (error(&noisy), error(&clean.select(&colours).unwrap()));
    assert!(before > 1.3 * after, "{before} {after}");
    assert!(told["denoise_seconds"].as_f64().unwrap() > 0.0);
    let claimed = told["denoised_relative_error"].as_f64().unwrap();
    assert!((0.2..5.0).contains(&(claimed / after.sqrt())), "{claimed} {after}");

    rendered("a.png", &["16", "--denoise"]);
    assert!(std::fs::read(folder.join("a.noisy.png")).unwrap().starts_with(b"\x89PNG"));
    // Nor is a file that the scene reads lost to the raw picture.
    let texture = folder.join("b.noisy.png");
    std::fs::copy(folder.join("a.noisy.png"), &texture).unwrap();
    let before = std::fs::read(&texture).unwrap();
    let textured = folder.join("textured.toml");
    let text = SCENE.replace("reflectance = 0.8", "reflectance = { image = \"b.noisy.png\" }");
    std::fs::write(&textured, text).unwrap();
    refused(
        render(&textured, &folder.join("b.png"), &["--spp", "2", "--denoise"]),
        &["b.noisy.png", "is read"],
    );
    assert_eq!(std::fs::read(&texture).unwrap(), before);
    // The first samples, then the rest.
    let resumed = |spp: &str, more: &[&str]| {
        let options = [&["--json", "--keep", "--denoise", "--spp", spp], more].concat();
        report(render(&scene, &folder.join("resumed.exr"), &options))
    };
    resumed("4", &[]);
    resumed("16", &["--resume"]);
    assert_eq!(picture("resumed.exr").data, clean.data);
    let checkpoint = folder.join("resumed.exr.checkpoint");
    std::fs::copy(&checkpoint, folder.join("plain.exr.checkpoint")).unwrap();
    refused(render(&scene, &folder.join("plain.exr"), &["--spp", "32", "--resume"]), &["denoising"]);
}

/// The part that is asked for is the film's own crop to the bit, and that part of the whole picture but for its noise.
#[test]
fn a_crop_is_a_part_of_the_picture() {
    let (folder, scene) = set_up("crop");
    let picture = |name: &str| {
        let options = yugen_archive::formats::image::ReadOptions::default();
        yugen_archive::formats::image::read(&folder.join(name), &options).unwrap()
    };
    let base = ["--spp", "64", "--json", "--checkpoint", "0"];
    let whole = folder.join("whole.exr");
    report(render(&scene, &whole, &base));
    let told =
        report(render(&scene, &folder.join("part.exr"), &[&base[..], &["--crop", "40,20,24,16"]].concat()));
    assert_eq!((told["width"].as_u64(), told["height"].as_u64()), (Some(24), Some(16)));
    let cropped = folder.join("cropped.toml");
    std::fs::write(&cropped, SCENE.replace("size = [96, 64]", "size = [96, 64]\ncrop = [40, 20, 24, 16]"))
        .unwrap();
    report(render(&cropped, &folder.join("film.exr"), &base));
    let (part, film, whole) = (picture("part.exr"), picture("film.exr"), picture("whole.exr"));
    assert_eq!(part.data, film.data);
    let mean = |image: &yugen_optics::Image, [x0, y0]: [usize; 2]| {
        let all = (0..16).flat_map(|y| (0..24).map(move |x| (x0 + x, y0 + y)));
        all.map(|(x, y)| f64::from(image.pixel(x, y)[1])).sum::<f64>() / (24.0 * 16.0)
    };
    let (a, b) = (mean(&part, [0, 0]), mean(&whole, [40, 20]));
    assert!((a / b - 1.0).abs() < 0.02, "{a} {b}");
    assert!((mean(&whole, [0, 0]) / b - 1.0).abs() > 0.1, "the test cannot tell one part from another");
    let output = folder.join("none.exr");
    for crop in ["90,0,10,10", "0,60,10,5", "0,0,97,1", "4294967295,0,2,1"] {
        refused(
            render(&scene, &output, &["--crop", crop]),
            &["is not a part of a picture of 96 x 64 pixels"],
        );
    }
    for crop in ["0,0,0,1", "1,2,3", "0.5,0,1,1", "a,0,1,1"] {
        refused(render(&scene, &output, &["--crop", crop]), &["left, top, width and height"]);
    }
}

/// Three lights, two of one name: their layers are the picture, and each is the picture under them alone.
#[test]
fn light_groups_add_up_and_are_what_each_light_gives() {
    let (folder, scene) = set_up("groups");
    let lamp = "[[shape]]\ntype = \"rectangle\"\nat = [1, 2.5, 1]";
    assert!(SCENE.contains(lamp));
    let named = SCENE.replace(lamp, &lamp.replace("rectangle\"", "rectangle\"\nname = \"lamp\""));
    let sky = "\n[[light]]\ntype = \"constant\"\nradiance = [0.1, 0.2, 0.4]\n";
    let fill = "\n[[light]]\ntype = \"point\"\nname = \"lamp\"\nat = [-1, 2, 1]\nintensity = [2, 0.5, 0.1]\n";
    let load = |text: &str, more: &[&str]| {
        std::fs::write(&scene, text).unwrap();
        let output = folder.join("a.exr");
        report(render(&scene, &output, &[&["--checkpoint", "0", "--json"], more].concat()));
        let options = yugen_archive::formats::image::ReadOptions::default();
        yugen_archive::formats::image::read(&output, &options).unwrap()
    };
    let all = load(&format!("{named}{sky}{fill}"), &["--spp", "64", "--aov", "lights,depth"]);
    let layers: Vec<&str> =
        all.channels.iter().map(String::as_str).filter(|c| c.starts_with("light.")).collect();
    let mut wanted =
        ["lamp", "environment"].map(|g| ["R", "G", "B"].map(|c| format!("light.{g}.{c}"))).concat();
    wanted.sort();
    let mut found = layers.clone();
    found.sort();
    assert_eq!(found, wanted);
    let channel = |name: &str| {
        let c = all.channel(name).unwrap();
        all.data.chunks_exact(all.channels.len()).map(|p| f64::from(p[c])).collect::<Vec<_>>()
    };
    for c in ["R", "G", "B"] {
        let [lamp, sky] = ["lamp", "environment"].map(|g| channel(&format!("light.{g}.{c}")));
        for ((whole, lamp), sky) in channel(c).iter().zip(&lamp).zip(&sky) {
            // Sums in single precision.
            assert!((whole - lamp - sky).abs() < 2e-6 * whole.max(0.1), "{whole} {lamp} {sky}");
        }
    }
    let mean = |v: Vec<f64>| v.iter().sum::<f64>() / v.len() as f64;
    let dark = named.replace("emission = {", "# emission = {");
    for (text, group) in [(format!("{named}{fill}"), "lamp"), (format!("{dark}{sky}"), "environment")] {
        let alone = load(&text, &["--spp", "64"]);
        for (c, name) in ["R", "G", "B"].iter().enumerate() {
            let part = mean(channel(&format!("light.{group}.{name}")));
            let n = alone.channels.len();
            let alone = mean(alone.data.chunks_exact(n).map(|p| f64::from(p[c])).collect());
            // Noise at 64 samples of 6144 pixels.
            assert!((part / alone - 1.0).abs() < 0.01, "{group} {name}: {part} {alone}");
        }
    }
}

/// No scene at all: a mesh in front of a camera that sees all of it, under a sun and a sky.
#[test]
fn a_mesh_is_rendered_as_it_is() {
    let folder = scratch("render_mesh");
    // A tower, along y or z.
    let tower = |up: fn([f32; 3]) -> [f32; 3]| {
        let corners = (0..8).map(|i| up([(i & 1) as f32, 6.0 * (i >> 1 & 1) as f32, (i >> 2) as f32]));
        corners.map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect::<String>()
            + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
    };
    std::fs::write(folder.join("y.obj"), tower(|p| p)).unwrap();
    // Turned about x, and to be turned back.
    std::fs::write(folder.join("z.obj"), tower(|[x, y, z]| [x, -z, y])).unwrap();
    let seen = |name: &str, more: &[&str]| {
        let output = folder.join("a.exr");
        let more = [&["--spp", "16", "--aov", "depth", "--checkpoint", "0", "--json"], more].concat();
        report(render(&folder.join(name), &output, &more));
        let options = yugen_archive::formats::image::ReadOptions::default();
        yugen_archive::formats::image::read(&output, &options).unwrap()
    };
    // How much of the width and the height is covered, and how bright that is.
    let extent = |image: &yugen_optics::Image| {
        let alpha = image.channel("A").unwrap();
        let covered = |x: usize, y: usize| image.pixel(x, y)[alpha] > 0.5;
        let columns = (0..image.width).filter(|&x| (0..image.height).any(|y| covered(x, y))).count();
        let rows = (0..image.height).filter(|&y| (0..image.width).any(|x| covered(x, y))).count();
        [columns as f32 / image.width as f32, rows as f32 / image.height as f32]
    };
    for size in ["120x90", "60x120", "200x50"] {
        let [_, rows] = extent(&seen("y.obj", &["--size", size]));
        assert!((0.86..0.94).contains(&rows), "{size}: {rows}");
    }
    let (y, z) = (seen("y.obj", &["--size", "60x60"]), seen("z.obj", &["--size", "60x60", "--up", "z"]));
    let difference: f32 = y.data.iter().zip(&z.data).map(|(a, b)| (a - b).abs()).sum();
    assert!(difference < 1e-3 * y.data.iter().sum::<f32>(), "{difference}");
    assert!(extent(&seen("z.obj", &["--size", "60x60"]))[0] > 0.8, "lying, it is wide");
    let brightest = y.data.chunks_exact(y.channels.len()).map(|p| p[1]).fold(0.0, f32::max);
    assert!((0.2..0.6).contains(&brightest), "grey under sun and sky: {brightest}");
    let output = folder.join("b.png");
    refused(render(&folder.join("y.obj"), &output, &["--at", "1"]), &["nothing in it moves"]);
    refused(render(&folder.join("x.obj"), &output, &[]), &["x.obj", "nothing of this name"]);
}
