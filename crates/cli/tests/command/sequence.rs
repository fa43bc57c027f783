//! `yugen render --frames` and `yugen film`: scenes that move.

use crate::{bad, good, refused, report, scratch, yugen_in};
use std::path::Path;
use yugen_archive::formats::image;
use yugen_optics::Image;

/// Writes `a.gltf`, in which a triangle slides 4 to the right within a second, or jumps, seen by a camera.
pub fn sliding(folder: &Path) {
    let numbers: [f32; 17] =
        [0.0, 1.0, -2.0, 0.0, 0.0, 2.0, 0.0, 0.0, -0.5, -0.5, 0.0, 0.5, -0.5, 0.0, 0.0, 0.5, 0.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("a.bin"), bytes).unwrap();
    let animation = |name: &str, how: &str| {
        format!(
            r#"{{ "name": "{name}", "samplers": [{{ "input": 0, "output": 1, "interpolation": "{how}" }}],
            "channels": [{{ "sampler": 0, "target": {{ "node": 0, "path": "translation" }} }}] }}"#
        )
    };
    let (slide, jump) = (animation("slide", "LINEAR"), animation("jump", "STEP"));
    std::fs::write(
        folder.join("a.gltf"),
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "animations": [{slide}, {jump}],
        "nodes": [{{ "mesh": 0, "name": "n" }}, {{ "camera": 0, "translation": [0, 0, 5] }}],
        "cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.8, "aspectRatio": 2, "znear": 0.1 }} }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 2 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" }},
            {{ "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" }},
            {{ "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3" }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 8 }}, {{ "buffer": 0, "byteOffset": 8, "byteLength": 24 }},
            {{ "buffer": 0, "byteOffset": 32, "byteLength": 36 }}],
        "buffers": [{{ "uri": "a.bin", "byteLength": 68 }}] }}"#
        ),
    )
    .unwrap();
}

fn read(path: &Path) -> Image {
    image::read(path, &Default::default()).expect("a picture")
}

/// Where the middle of what is in front of the sky is, across, in parts of the picture.
fn middle(image: &Image) -> f64 {
    let depth = image.select(&["depth.Z"]).expect("depth").data;
    let hit = || (0..depth.len()).filter(|&i| depth[i] > 0.0).map(|i| (i % image.width) as f64 + 0.5);
    hit().sum::<f64>() / hit().count().max(1) as f64 / image.width as f64
}

const SMALL: &str = "--size 40x20 --spp 2";

#[test]
fn frames_are_the_pictures_of_their_moments() {
    let folder = scratch("sequence/frames");
    sliding(&folder);
    let line = format!("render a.gltf -o f_%03d.exr --fps 4 --aov depth {SMALL} --json");
    let done = report(yugen_in(&folder, &line));
    // All of the animation, its last key included.
    assert_eq!((&done["frames"], &done["rendered"]), (&serde_json::json!([0, 4]), &serde_json::json!(5)));
    let frames: Vec<Image> = (0..5).map(|i| read(&folder.join(format!("f_00{i}.exr")))).collect();
    let middles: Vec<f64> = frames.iter().map(middle).collect();
    // It slides by 1 a frame, and the picture is 10 tan(0.4) = 4.228 high where it is and twice as wide.
    assert!((middles[2] - 0.5).abs() < 0.02 && (middles[3] - middles[2] - 0.118).abs() < 0.02, "{middles:?}");
    good(yugen_in(&folder, &format!("render a.gltf -o one.exr --at 0.75 --aov depth {SMALL}")));
    assert_eq!(read(&folder.join("one.exr")).data, frames[3].data, "a frame is what --at gives");

    // A jump stays until the next key; and a cycle begins again.
    good(yugen_in(
        &folder,
        &format!(
            "render a.gltf -o j%d.exr --animation jump --frames 3-5 --fps 4 --cycle --aov depth {SMALL}"
        ),
    ));
    let jumps: Vec<f64> = (3..6).map(|i| middle(&read(&folder.join(format!("j{i}.exr"))))).collect();
    assert!(jumps.iter().all(|m| (m - middles[0]).abs() < 1e-9), "{jumps:?} {middles:?}");

    // Pictures that are there are left, and one that is not is made.
    std::fs::remove_file(folder.join("f_001.exr")).unwrap();
    std::fs::write(folder.join("f_002.exr"), "mine").unwrap();
    let done = report(yugen_in(&folder, &format!("{line} --resume")));
    assert_eq!((&done["rendered"], &done["found"]), (&serde_json::json!(1), &serde_json::json!(4)));
    assert_eq!(read(&folder.join("f_001.exr")).data, frames[1].data);
    assert_eq!(std::fs::read(folder.join("f_002.exr")).unwrap(), b"mine");
}

#[test]
fn films_hold_the_frames_and_are_joined_from_pictures() {
    let folder = scratch("sequence/films");
    sliding(&folder);
    let apng = |name: &str| {
        let file = std::io::BufReader::new(std::fs::File::open(folder.join(name)).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let frames = reader.info().animation_control().unwrap().num_frames;
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        let frames = (0..frames).map(|_| reader.next_frame(&mut buffer).map(|_| buffer.clone()).unwrap());
        frames.collect::<Vec<_>>()
    };
    good(yugen_in(&folder, &format!("render a.gltf -o film.apng --fps 4 {SMALL}")));
    let frames = apng("film.apng");
    assert_eq!(frames.len(), 5);
    assert!(frames[1] != frames[2]);
    // The same by pictures: what a display shows comes back as it was.
    good(yugen_in(&folder, &format!("render a.gltf -o p%02d.png --fps 4 {SMALL}")));
    let said = good(yugen_in(&folder, "film p%02d.png -o joined.apng --fps 4"));
    assert!(said.contains("joined.apng: 5 frames, 1.25 s"), "{said}");
    assert_eq!(apng("joined.apng"), frames);
    if cfg!(feature = "mp4") {
        good(yugen_in(&folder, "film p%02d.png -o joined.mp4 --fps 4"));
        let bytes = std::fs::read(folder.join("joined.mp4")).unwrap();
        assert_eq!(&bytes[4..8], b"ftyp");
    }
    std::fs::remove_file(folder.join("p03.png")).unwrap();
    refused(yugen_in(&folder, "film p%02d.png -o gap.apng"), &["p03.png is missing between frames 0 and 4"]);
    refused(yugen_in(&folder, "film q%02d.png -o gap.apng"), &["there is no picture called q%02d.png"]);
    refused(yugen_in(&folder, "film p.png -o gap.apng"), &["p.png has no place for a number"]);
    refused(yugen_in(&folder, "film p%02d.png -o gap.avi"), &["no name of a film", ".apng"]);
}

#[test]
fn what_is_no_sequence_is_refused_in_words() {
    let folder = scratch("sequence/refused");
    sliding(&folder);
    std::fs::write(folder.join("still.toml"), "[[shape]]\ntype = \"sphere\"\n").unwrap();
    for (line, said) in [
        ("a.gltf -o a.png --frames 0-3", "as in a_%04d.png"),
        ("a.gltf -o a.exr --fps 25", "--fps is for a sequence"),
        ("a.gltf -o a.exr --animation slide", "give one of them"),
        ("a.gltf -o a%d.exr --at 0.5", "--at is for one picture"),
        ("a.gltf -o a%d.exr --frames 3-1", "the first and the last frame, as in 0-47"),
        ("a.gltf -o a%d.exr --fps 0", "0.1 to 1000"),
        ("a.gltf -o a.apng --resume", "a film cannot be gone on with"),
        ("a.gltf -o a%d.exr --animation slyde", "did you mean 'slide'?"),
        ("still.toml -o a%d.exr", "nothing in it moves"),
        ("still.toml -o a.exr --at 1", "nothing in it moves"),
        ("a.gltf -o a.apng --exposure nan", "exposure"),
    ] {
        let err = bad(yugen_in(&folder, &format!("render {line}")));
        assert!(err.contains(said), "{line}: {err}");
    }
    if cfg!(feature = "mp4") {
        refused(
            yugen_in(&folder, "render a.gltf -o a.mp4 --size 33x20 --spp 1"),
            &["needs an even number of pixels", "--size", "make it 32x20"],
        );
    }
    let left: Vec<_> = folder.read_dir().unwrap().map(|f| f.unwrap().file_name()).collect();
    assert_eq!(left.len(), 3, "nothing is left behind: {left:?}");
}

#[test]
fn a_figure_moves_where_a_scene_has_placed_it() {
    let folder = scratch("sequence/placed");
    sliding(&folder);
    let scene = "[camera]\nfrom = [0, 3, 10]\nto = [0, 3, 0]\nfov = 40\n\
                 [[shape]]\ntype = \"file\"\nfile = \"a.gltf\"\nat = [0, 3, 0]\n\
                 [[light]]\ntype = \"constant\"\nradiance = 1\n";
    std::fs::write(folder.join("stage.toml"), scene).unwrap();
    let at = |t: &str| {
        good(yugen_in(&folder, &format!("render stage.toml -o s.exr --at {t} --aov depth {SMALL}")));
        middle(&read(&folder.join("s.exr")))
    };
    let [left, right] = ["0", "1"].map(at);
    // 4 of the 7.28 that the picture is wide there.
    assert!((right - left - 4.0 / 7.28).abs() < 0.02, "{left} {right}");
    assert!((0.5 * (left + right) - 0.5).abs() < 0.01);
}

/// A fire burns on from frame to frame, alike by both renderers, and on in a film of no given length.
#[test]
fn fires_burn_through_a_sequence() {
    let folder = scratch("sequence/fire");
    std::fs::write(
        folder.join("a.toml"),
        "[camera]\nfrom = [0, 1.2, 3]\nto = [0, 0.6, 0]\n[[shape]]\ntype = \"rectangle\"\nsize = [6, 6]\nfacing = [0, 1, 0]\n\
         [[light]]\ntype = \"fire\"\ncell = 0.05\n",
    )
    .unwrap();
    let line = "render a.toml --frames 1-2 --fps 4 --size 40x40 --spp 16 --exposure -9";
    good(yugen_in(&folder, &format!("{line} -o a%d.exr").replace(" --exposure -9", "")));
    let [first, second] =
        ["a1.exr", "a2.exr"].map(|name| read(&folder.join(name)).select(&["R", "G", "B"]).unwrap());
    let light =
        |image: &Image| image.data.iter().map(|v| f64::from(*v)).sum::<f64>() / image.data.len() as f64;
    let apart = |a: &Image, b: &Image| {
        let difference = a.data.iter().zip(&b.data).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
        difference / a.data.len() as f64 / light(a)
    };
    assert!(
        light(&first) > 50.0 && apart(&first, &second) > 0.05,
        "{} {}",
        light(&first),
        apart(&first, &second)
    );
    good(yugen_in(&folder, &format!("{line} -o film.apng")));
    assert!(folder.join("film.apng").is_file());
    let done = yugen_in(&folder, &format!("{line} --by realtime -o r%d.exr").replace(" --exposure -9", ""));
    if !done.success {
        assert!(
            done.err.contains("no GPU") && !std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1"),
            "{}",
            done.err
        );
        return;
    }
    for (name, reference) in [("r1.exr", &first), ("r2.exr", &second)] {
        let seen = read(&folder.join(name)).select(&["R", "G", "B"]).unwrap();
        let (off, more) = (apart(reference, &seen), light(&seen) / light(reference) - 1.0);
        println!("{name}: {off:.4} apart, light {more:+.4}");
        assert!(off < 0.2 && more.abs() < 0.04, "{name}: {off}, {more}");
    }
}
