//! `yugen ink`.

use super::{good, refused, report, scratch, sequence, yugen_in};
use std::path::Path;

/// A ball on a table by a lamp.
const SCENE: &str = r#"
[camera]
from = [0, 1.6, 5]
to = [0, 0.6, 0]
fov = 30

[[light]]
type = "directional"
direction = [1, -2, -1]
irradiance = 3

[material."wet clay"]
model = "lambert"
reflectance = 0.4

[[shape]]
name = "ball"
type = "sphere"
radius = 0.8
at = [0, 0.8, 0]
material = "wet clay"

[[shape]]
name = "table"
type = "rectangle"
size = [4, 4]
facing = [0, 1, 0]
"#;

fn mean(file: &Path) -> f32 {
    let mut picture =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; picture.output_buffer_size().unwrap()];
    picture.next_frame(&mut pixels).unwrap();
    pixels.iter().map(|v| f32::from(*v)).sum::<f32>() / pixels.len() as f32
}

#[test]
fn a_scene_is_painted_the_same_each_time_and_leaves_as_vectors_and_layers() {
    let folder = scratch("ink");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    let line = "ink ball.toml --size 240x160 -o a.png -o a.svg -o a.exr --json";
    let made = report(yugen_in(&folder, line));
    assert!(made["strokes"].as_u64().unwrap() > 0 && made["stamps"][0].as_u64().unwrap() > 50, "{made}");
    good(yugen_in(&folder, "ink ball.toml --size 240x160 -o b.png -o b.svg"));
    let same =
        |a: &str, b: &str| std::fs::read(folder.join(a)).unwrap() == std::fs::read(folder.join(b)).unwrap();
    assert!(same("a.png", "b.png") && same("a.svg", "b.svg"));
    let svg = std::fs::read_to_string(folder.join("a.svg")).unwrap();
    assert!(svg.contains("data-object=\"ball\"") && svg.contains("data-pressure="), "{svg}");
    let info = good(yugen_in(&folder, "info a.exr"));
    assert!(info.contains("gou") && info.contains("ran"), "{info}");

    // Paper that is not wholly blank, and blank where nothing is painted with.
    let blank =
        "ink ball.toml --size 240x160 --set contour=0 --set wash=0 --set wrinkle=0 --set dot=0 -o blank.png";
    good(yugen_in(&folder, blank));
    let [painted, blank] = ["a.png", "blank.png"].map(|f| mean(&folder.join(f)));
    assert!(blank > 225.0 && painted < blank - 1.0, "{painted} {blank}");
}

/// A preset, one of the user's own and the baseline: three pictures that differ.
#[test]
fn presets_and_the_slides_paint_otherwise() {
    let folder = scratch("ink-presets");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    std::fs::write(folder.join("own.toml"), "size = 3\ndryness = 0.9\npaper = 'aged'\n").unwrap();
    let lines = [
        "--preset boneless -o a.png",
        "--preset own.toml -o b.png",
        "--literal -o c.png",
        "--preset dry --pigment oil --manner axe -o d.png",
    ];
    for line in lines {
        good(yugen_in(&folder, &format!("ink ball.toml --size 160x120 {line}")));
    }
    let pictures = ["a.png", "b.png", "c.png", "d.png"].map(|f| std::fs::read(folder.join(f)).unwrap());
    assert!((0..4).all(|i| (0..i).all(|j| pictures[i] != pictures[j])));
    assert!(mean(&folder.join("b.png")) < mean(&folder.join("a.png")) - 10.0, "aged paper is darker");
    let said = good(yugen_in(&folder, "ink --list"));
    assert!(["mogu", "xuan", "cinnabar", "pima", "flying white"].iter().all(|w| said.contains(w)), "{said}");
}

/// Objects and strokes of which something is otherwise, for a picture and for a film.
#[test]
fn single_objects_and_strokes_are_steered() {
    let folder = scratch("ink-steering");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    let paint = |preset: &str, line: &str| {
        std::fs::write(folder.join("own.toml"), preset).unwrap();
        good(yugen_in(&folder, &format!("ink ball.toml --size 240x160 --preset own.toml {line}")))
    };
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let ids = |name: &str, object: &str| -> Vec<String> {
        let contours = read(name).split("id=\"gou\"").nth(1).unwrap().to_string();
        let of = contours.split(&format!("data-object=\"{object}\"")).nth(1).unwrap_or_default();
        let of = of.split("</g>\n</g>").next().unwrap_or_default();
        of.split("data-id=\"").skip(1).map(|rest| rest[..8].to_string()).collect()
    };
    paint("", "-o a.svg -o a.png");
    let (ball, table) = (ids("a.svg", "ball"), ids("a.svg", "table"));
    assert!(!ball.is_empty() && !table.is_empty(), "{ball:?} {table:?}");
    // The other object's strokes stay to the letter.
    paint("[object.ball]\nsize = 3\nink = 1.4", "-o b.svg -o b.png");
    let stroke = |name: &str, id: &str| {
        read(name).lines().find(|l| l.contains(&format!("data-id=\"{id}\""))).unwrap_or_default().to_string()
    };
    assert_eq!(ids("b.svg", "ball"), ball);
    assert!(table.iter().all(|id| stroke("b.svg", id) == stroke("a.svg", id)));
    assert!(ball.iter().all(|id| stroke("b.svg", id) != stroke("a.svg", id)));
    assert_ne!(std::fs::read(folder.join("a.png")).unwrap(), std::fs::read(folder.join("b.png")).unwrap());
    // One stroke is gone, one is paler, through a film too.
    let own = format!("[stroke.{}]\nhide = true\n[stroke.{}]\nink = 0.1", ball[0], table[0]);
    paint(&own, "-o c.svg");
    assert!(!read("c.svg").contains(&ball[0]) && stroke("c.svg", &table[0]) != stroke("a.svg", &table[0]));
    paint(&own, "--turn 1 --frames 0-2 -o f_%d.svg");
    assert!((0..3).all(|i| !read(&format!("f_{i}.svg")).contains(&format!("data-id=\"{}\"", ball[0]))));
    // What nobody has met is said at the end of a picture and of a film.
    std::fs::write(folder.join("own.toml"), "[stroke.00000001]\nhide = true").unwrap();
    for output in ["u.png", "u_%d.png --turn 180"] {
        let line = format!("ink ball.toml --size 96x64 --preset own.toml -o {output}");
        let told = yugen_in(&folder, &line);
        assert!(told.success && told.err.contains("[stroke.00000001] changes nothing"), "{}", told.err);
    }
    refused(
        yugen_in(&folder, "ink ball.toml --preset own.toml --literal -o d.png"),
        &["single objects, materials and strokes"],
    );
    std::fs::write(folder.join("own.toml"), "[object.bal]\nink = 1\n[material.wood]\nink = 1").unwrap();
    let told = yugen_in(&folder, "ink ball.toml --size 96x64 --preset own.toml -o d.png");
    for words in ["[object.bal] changes nothing", "did you mean 'ball'?", "[material.wood] changes nothing"] {
        assert!(told.success && told.err.contains(words), "{}", told.err);
    }
    // By material; what is said of the object counts more.
    paint("[material.\"wet*\"]\nsize = 3\nink = 1.4", "-o m.svg");
    assert_eq!(read("m.svg"), read("b.svg"));
    paint("[object.ball]\nsize = 3\nink = 1.4\n[material.\"wet clay\"]\nsize = 0.5\nink = 0.1", "-o m.svg");
    assert_eq!(read("m.svg"), read("b.svg"));
    // Rubbing and suggestive contours are ink.
    paint("rub = 2.0\nsuggestive = 1.0", "-o e.png");
    assert!(mean(&folder.join("e.png")) < mean(&folder.join("a.png")));
}

/// Masks: half of a picture in 8 and in 16 bits, and what is wrong with one.
#[test]
fn masks_are_painted_and_what_is_wrong_with_one_is_said() {
    let folder = scratch("ink-masks");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    draw(&folder.join("half.png"), [64, 32], |x, _| f32::from(u8::from(x >= 32.0)));
    draw(&folder.join("wide.png"), [5000, 1], |_, _| 1.0);
    let mut deep = png::Encoder::new(std::fs::File::create(folder.join("deep.png")).unwrap(), 64, 32);
    deep.set_color(png::ColorType::Grayscale);
    deep.set_depth(png::BitDepth::Sixteen);
    let bytes: Vec<u8> = (0..64 * 32).flat_map(|i| if i % 64 < 32 { [0; 2] } else { [255; 2] }).collect();
    deep.write_header().unwrap().write_image_data(&bytes).unwrap();
    std::fs::write(folder.join("text.png"), "no picture").unwrap();
    std::fs::write(folder.join("none.bmp"), b"BM").unwrap();
    let run = |image: &str, rest: &str, output: &str| {
        std::fs::write(folder.join("own.toml"), format!("[mask.half]\nimage = \"{image}\"\n{rest}")).unwrap();
        yugen_in(&folder, &format!("ink ball.toml --size 240x160 --preset own.toml -o {output}"))
    };
    good(run("half.png", "ink = 0", "a.png"));
    good(run("deep.png", "ink = 0", "b.png"));
    good(run("half.png", "", "c.png"));
    good(run("half.png", "on = 'object.ball'\nink = 0", "d.png"));
    good(run("half.png", "on = 'material.wet clay'\nink = 0", "f_%d.png --turn 180"));
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(read("a.png") == read("b.png"), "16 bits say the same");
    assert!(mean(&folder.join("a.png")) > mean(&folder.join("c.png")) + 0.5, "half of it is blank");
    assert!(read("a.png") != read("d.png") && read("c.png") != read("d.png"));
    let told = run("half.png", "on = 'object.bal'\nink = 0", "e.png");
    assert!(told.success && told.err.contains("[mask.half] changes nothing"), "{}", told.err);
    for (image, rest, words) in [
        ("none.png", "", &["own.toml: [mask.half]", "none.png"][..]),
        ("wide.png", "", &["wide.png: 5000 x 1 pixels are no mask: expected 1 to 4096"]),
        ("text.png", "", &["text.png"]),
        ("none.bmp", "", &["none.bmp"]),
        ("half.png", "on = 'ball'", &["a mask cannot lie on 'ball'"]),
        ("half.png", "bleed = 1", &["'bleed' is of the whole sheet"]),
    ] {
        refused(run(image, rest, "x.png"), words);
    }
    refused(run("half.png", "ink = 0", "x.png --literal"), &["nor of masks"]);
    assert!(!folder.join("x.png").exists());
}

/// Writes a grey picture.
fn draw(file: &Path, [w, h]: [u32; 2], grey: impl Fn(f32, f32) -> f32) {
    let mut encoder = png::Encoder::new(std::fs::File::create(file).unwrap(), w, h);
    encoder.set_color(png::ColorType::Grayscale);
    let at = |i: u32| (grey((i % w) as f32, (i / w) as f32).clamp(0.0, 1.0) * 255.0) as u8;
    let pixels: Vec<u8> = (0..w * h).map(at).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
}

/// A brush from a photograph, made up: a slanting stroke with dry streaks on paper that is lit from one side.
#[test]
fn a_brush_is_made_of_a_photograph_of_a_stroke() {
    let folder = scratch("ink-brush");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    let paper = |x: f32| 0.9 - 0.25 * x / 480.0;
    draw(&folder.join("stroke.png"), [480, 320], |x, y| {
        let (u, v) = (0.8 * (x - 240.0) + 0.6 * (y - 160.0), 0.8 * (y - 160.0) - 0.6 * (x - 240.0));
        let streak = (v * 0.9).sin() > 0.2 && u > -20.0;
        if u.abs() < 150.0 && v.abs() < 22.0 && !streak { 0.2 } else { paper(x) }
    });
    let made = report(yugen_in(&folder, "brush stroke.png -o own.toml --preset dry --json"));
    let white: Vec<f64> = made["white"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!((made["length"].as_f64().unwrap() - 280.0).abs() < 25.0, "{made}");
    assert!(
        (made["half_width"].as_f64().unwrap() - 22.0).abs() < 2.5 && white[0] < 0.1 && white[2] > 0.2,
        "{made}"
    );
    let text = std::fs::read_to_string(folder.join("own.toml")).unwrap();
    assert!(text.contains("brush = \"own.png\"") && text.contains("size = 1.5"), "{text}");
    std::fs::write(folder.join("plain.toml"), text.replace("brush = \"own.png\"\n", "")).unwrap();
    for (preset, picture) in [("own", "a"), ("own", "b"), ("plain", "c")] {
        good(yugen_in(
            &folder,
            &format!("ink ball.toml --size 240x160 --preset {preset}.toml -o {picture}.png"),
        ));
    }
    let [a, b, c] = ["a.png", "b.png", "c.png"].map(|f| std::fs::read(folder.join(f)).unwrap());
    assert!(a == b && a != c);
    draw(&folder.join("blank.png"), [200, 100], |x, _| paper(x));
    draw(&folder.join("small.png"), [20, 30], |x, _| paper(x));
    std::fs::write(folder.join("none.toml"), "brush = 'none.png'").unwrap();
    std::fs::write(folder.join("small.toml"), "brush = 'small.png'").unwrap();
    for (line, words) in [
        ("brush blank.png -o x.toml", &["blank.png", "no stroke was found"][..]),
        ("brush none.png -o x.toml", &["none.png"]),
        ("brush stroke.png -o x.txt", &["x.txt", ".toml"]),
        ("brush stroke.png -o stroke.toml", &["stroke.png"]),
        ("brush stroke.png -o x.toml --preset dyr", &["did you mean 'dry'?"]),
        ("ink ball.toml --preset none.toml -o x.png", &["none.png"]),
        ("ink ball.toml -o x.txt", &["x.txt", ".jpeg, .svg, .mp4, .apng"]),
        ("ink ball.toml --preset small.toml -o x.png", &["small.png", "no picture of a straight stroke"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert!(!folder.join("x.toml").exists() && !folder.join("x.png").exists());
}

/// A seal after a picture, without a font: a ring with a hole.
#[test]
fn a_seal_is_pressed_after_a_picture() {
    let folder = scratch("ink-seal");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    draw(&folder.join("ring.png"), [100, 100], |x, y| {
        let r = (x - 50.0).hypot(y - 50.0);
        if (20.0..45.0).contains(&r) { 0.05 } else { 1.0 }
    });
    draw(&folder.join("white.png"), [50, 50], |_, _| 1.0);
    let line = "ink ball.toml --size 240x160 --seal-image ring.png --seal-size 200 --corner lower-left -o a.svg -o a.png";
    good(yugen_in(&folder, line));
    let svg = std::fs::read_to_string(folder.join("a.svg")).unwrap();
    let seal = svg.split("id=\"yin\"").nth(1).expect("a seal").split("</g>").next().unwrap().to_string();
    assert_eq!(seal.matches('Z').count(), 2, "a ring has two outlines: {seal}");
    good(yugen_in(&folder, "ink ball.toml --size 240x160 -o b.png"));
    let [a, b] = ["a.png", "b.png"].map(|f| std::fs::read(folder.join(f)).unwrap());
    assert_ne!(a, b);
    for (line, words) in [
        ("ink ball.toml --seal-image white.png -o x.png", &["white.png: there is nothing dark"][..]),
        ("ink ball.toml --seal-image none.png -o x.png", &["none.png"]),
        ("ink ball.toml --seal-image ring.png --seal A -o x.png", &["--seal"]),
        ("ink ball.toml --seal-size 40 -o x.png", &["--seal-size: there is no seal"]),
        ("ink ball.toml --seal-image ring.png --mount fan -o x.png", &["cuts off the corners"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
}

/// Inscription, seal and mounting, as pixels, layers and vectors.
#[test]
fn a_painting_is_signed_and_mounted() {
    let folder = scratch("ink-mount");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    std::fs::write(folder.join("hack.ttf"), epaint_default_fonts::HACK_REGULAR).unwrap();
    let paint =
        |line: &str| report(yugen_in(&folder, &format!("ink ball.toml --size 240x160 {line} --json")));
    paint("-o plain.exr -o plain.svg");
    let signed = "--seal AB --inscription abc --font hack.ttf --seal-size 150 --inscription-size 90";
    paint(&format!("{signed} -o signed.exr -o signed.svg"));
    let made = paint(&format!("{signed} --mount hanging -o m.exr -o m.svg -o m.png"));
    let size = [made["width"].as_u64().unwrap() as usize, made["height"].as_u64().unwrap() as usize];
    assert!(size[0] > 240 && size[1] > 480, "{made}");
    let read = |name: &str| {
        yugen_archive::formats::image::read(&folder.join(name), &Default::default())
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let [plain, signed_picture, mounted] = ["plain.exr", "signed.exr", "m.exr"].map(read);
    assert!(plain.channel("yin.A").is_none() && plain.channel("mount.A").is_none());
    let (yin, ti) = (signed_picture.channel("yin.A").unwrap(), signed_picture.channel("ti.A").unwrap());
    let (mut red, mut dark) = (0, 0);
    for y in 0..160 {
        for x in 0..240 {
            let (before, after) = (plain.pixel(x, y), signed_picture.pixel(x, y));
            let rgb = |p: &[f32], image: &yugen_optics::Image| {
                ["R", "G", "B"].map(|c| p[image.channel(c).unwrap()])
            };
            let ([r, g, _], was) = (rgb(after, &signed_picture), rgb(before, &plain));
            if after[yin] == 0.0 && after[ti] == 0.0 {
                assert_eq!(rgb(after, &signed_picture), was, "{x} {y}");
            }
            red += usize::from(after[yin] > 0.5 && r > 3.0 * g);
            dark += usize::from(after[ti] > 0.8 && r < 0.1);
        }
    }
    assert!(red > 100 && dark > 20, "{red} {dark}");
    assert_eq!([mounted.width, mounted.height], size);
    assert!(["mount.A", "yin.A", "ti.A", "gou.A"].iter().all(|c| mounted.channel(c).is_some()));
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let (signed_svg, svg) = (text("signed.svg"), text("m.svg"));
    assert!(signed_svg.contains("data-text=\"AB\"") && signed_svg.contains("<mask id=\"yin-0-cut\""));
    assert!(!text("plain.svg").contains("yin") && !signed_svg.contains("mount"));
    assert!(
        svg.contains("id=\"mount\"")
            && svg.contains("inkscape:label=\"wind band\"")
            && svg.contains("pattern")
    );
    assert_eq!(svg.matches("<g").count(), svg.matches("</g>").count());
    // A film has the mounting in each frame; a replay the seal in its last.
    good(yugen_in(
        &folder,
        &format!("ink ball.toml --size 120x80 --mount album {signed} --turn 1 --frames 0-1 -o f_%d.exr"),
    ));
    let [a, b] = ["f_0.exr", "f_1.exr"].map(read);
    assert!((a.width, a.height) == (b.width, b.height) && a.data != b.data);
    good(yugen_in(
        &folder,
        &format!("ink ball.toml --size 120x80 {signed} --replay --frames 0-1 -o p_%d.exr"),
    ));
    let [a, b] = ["p_0.exr", "p_1.exr"].map(read);
    let sealed = |i: &yugen_optics::Image| {
        i.data.iter().skip(i.channel("yin.A").unwrap()).step_by(i.channels.len()).sum::<f32>()
    };
    assert!(sealed(&a) == 0.0 && sealed(&b) > 10.0);
    for (line, words) in [
        ("--mount hangin -o x.png", "hanging"),
        ("--seal 山 --font hack.ttf -o x.png", "no character '山'"),
        ("--seal A --font none.ttf -o x.png", "none.ttf"),
        ("--font hack.ttf -o x.png", "nothing is written with it"),
        ("--seal A --font hack.ttf --mount fan -o x.png", "cuts off the corners"),
        ("--seal A --font hack.ttf --literal -o x.png", "--literal"),
        ("--seal A --seal-size 2 --font hack.ttf -o x.png", "4 to 540"),
    ] {
        refused(yugen_in(&folder, &format!("ink ball.toml --size 240x160 {line}")), &[words]);
        assert!(!folder.join("x.png").exists());
    }
}

/// Print by print: darker with each frame, and the last is the picture.
#[test]
fn a_painting_is_replayed() {
    let folder = scratch("ink-replay");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    good(yugen_in(&folder, "ink ball.toml --size 96x64 --replay --frames 0-3 -o r_%d.png -o r.apng"));
    good(yugen_in(&folder, "ink ball.toml --size 96x64 -o whole.png"));
    let means: Vec<f32> = (0..4).map(|i| mean(&folder.join(format!("r_{i}.png")))).collect();
    assert!(means.windows(2).all(|w| w[1] < w[0]), "{means:?}");
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert_eq!(read("r_3.png"), read("whole.png"));
    for (line, words) in [
        ("ink ball.toml --replay -o a.png", "--replay is a film"),
        ("ink ball.toml --replay -o a_%d.svg", "vectors are of the whole painting"),
        ("ink ball.toml --replay --animation walk -o a.mp4", "--at says at what time"),
    ] {
        refused(yugen_in(&folder, line), &[words]);
    }
    // Five seconds, whatever the rate, of the moment that is asked for.
    let done = report(yugen_in(&folder, "ink ball.toml --size 96x64 --replay --fps 1 -o s_%d.png --json"));
    assert_eq!(done["frames"], serde_json::json!([0, 4]));
    sequence::sliding(&folder);
    good(yugen_in(&folder, "ink a.gltf --size 96x64 --at 0.5 --replay --frames 0-1 -o m_%d.png"));
    good(yugen_in(&folder, "ink a.gltf --size 96x64 --at 0.5 -o moment.png"));
    assert_eq!(read("m_1.png"), read("moment.png"));
}

/// What moves becomes numbered files and a film in one go; a still scene is gone round.
#[test]
fn scenes_that_move_become_pictures_vectors_and_films() {
    let folder = scratch("ink-frames");
    sequence::sliding(&folder);
    let line = "ink a.gltf --size 96x64 --fps 4 -o f_%d.png -o f_%d.svg -o film.apng --json";
    let done = report(yugen_in(&folder, line));
    assert_eq!((&done["frames"], &done["rendered"]), (&serde_json::json!([0, 4]), &serde_json::json!(5)));
    let read = |name: String| std::fs::read(folder.join(name)).unwrap();
    let pictures: Vec<Vec<u8>> = (0..5).map(|i| read(format!("f_{i}.png"))).collect();
    assert!(pictures.windows(2).all(|w| w[0] != w[1]), "it moves");
    assert!((0..5).all(|i| {
        String::from_utf8(read(format!("f_{i}.svg"))).unwrap().contains(&format!("data-frame=\"{i}\""))
    }));
    let film = std::fs::File::open(folder.join("film.apng")).unwrap();
    let film = png::Decoder::new(std::io::BufReader::new(film)).read_info().unwrap();
    assert_eq!(film.info().animation_control().unwrap().num_frames, 5);
    // What is there is left, what is not is made as it was.
    std::fs::remove_file(folder.join("f_3.png")).unwrap();
    std::fs::write(folder.join("f_2.png"), "mine").unwrap();
    let done = report(yugen_in(&folder, "ink a.gltf --size 96x64 --fps 4 -o f_%d.png --resume --json"));
    assert_eq!((&done["rendered"], &done["found"]), (&serde_json::json!(1), &serde_json::json!(4)));
    assert_eq!((read("f_2.png".into()), read("f_3.png".into())), (b"mine".to_vec(), pictures[3].clone()));

    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    let done = report(yugen_in(&folder, "ink ball.toml --size 96x64 --turn 120 -o t_%d.png --json"));
    assert_eq!(done["frames"], serde_json::json!([0, 2]));
    good(yugen_in(&folder, "ink ball.toml --size 96x64 -o one.png"));
    assert_eq!(read("t_0.png".into()), read("one.png".into()));
    assert_ne!(read("t_0.png".into()), read("t_1.png".into()));

    // Strokes have their names from frame to frame, and go on as they were where frames are there already.
    let turn = "ink ball.toml --size 96x64 --turn 2 --frames 0-3 -o v_%d.svg -o v_%d.png";
    good(yugen_in(&folder, turn));
    let ids = |i: u32| -> Vec<String> {
        let svg = String::from_utf8(read(format!("v_{i}.svg"))).unwrap();
        let contours = svg.split("id=\"gou\"").nth(1).unwrap();
        contours.split("data-id=\"").skip(1).map(|rest| rest[..8].to_string()).collect()
    };
    let kept = |i: u32| ids(i).iter().filter(|id| ids(0).contains(id)).count();
    assert!(ids(0).len() >= 2 && (1..4).all(|i| kept(i) + 1 >= ids(0).len()), "{:?} {:?}", ids(0), ids(3));
    let last = [read("v_3.svg".into()), read("v_3.png".into())];
    ["v_3.svg", "v_3.png", "v_1.png"].iter().for_each(|f| std::fs::remove_file(folder.join(f)).unwrap());
    good(yugen_in(&folder, &format!("{turn} --resume")));
    assert_eq!([read("v_3.svg".into()), read("v_3.png".into())], last);

    // The same painter by the other verb.
    good(yugen_in(&folder, "render ball.toml --by ink --size 96x64 -o other.png"));
    assert_eq!(read("other.png".into()), read("one.png".into()));
    for (line, words) in [
        ("render ball.toml --by ink --spp 4 --denoise -o b.png", "a painting in ink has no --spp, --denoise"),
        (
            "render ball.toml --by ink --lighting paper -o b.png",
            "--lighting paper is of the real-time renderer",
        ),
        ("ink ball.toml -o b.png --resume", "--resume is for a sequence"),
        ("ink ball.toml -o b.png --turn 3", "--turn is for a sequence"),
        ("ink ball.toml -o b%d.png --turn 0", "expected degrees"),
        ("ink ball.toml -o b%d.png", "nothing in it moves"),
        ("ink a.gltf -o b%d.png -o c.png", "needs the number of the frame"),
        ("ink a.gltf -o b.apng -o c.apng", "one film at a time"),
    ] {
        refused(yugen_in(&folder, line), &[words]);
    }
}

/// The page is what the tables say; `BLESS=1` writes it anew.
#[test]
fn the_page_of_ink_is_up_to_date() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/ink.md");
    let page = good(yugen_in(".".as_ref(), "ink --markdown"));
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&file, &page).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(written == page, "docs/ink.md is not what the tables say; BLESS=1 writes it anew");
}

#[test]
fn what_is_wrong_is_said_before_anything_is_written() {
    let folder = scratch("ink-wrong");
    std::fs::write(folder.join("ball.toml"), SCENE).unwrap();
    for (line, words) in [
        ("ink ball.toml", &["--output"][..]),
        ("ink none.toml -o a.png", &["none.toml"]),
        ("ink ball.toml -o a.bmp", &["a.bmp"]),
        ("ink ball.toml -o none/a.svg", &["none/a.svg"]),
        ("ink ball.toml -o a.png --set dryeness=1", &["no control 'dryeness'", "did you mean 'dryness'?"]),
        ("ink ball.toml -o a.png --set ink=9", &["ink = 9 is out of range: 0 to 1.5"]),
        ("ink ball.toml -o a.png --set ink", &["CONTROL=VALUE"]),
        ("ink ball.toml -o a.png --size 0x9", &["width x height"]),
        ("ink ball.toml -o a.png --camera left", &["no camera called 'left'"]),
        ("ink ball.toml -o a.png --preset sumie", &["no preset 'sumie'", "did you mean 'sumi'?"]),
        ("ink ball.toml -o a.png --preset none.toml", &["none.toml"]),
        ("ink ball.toml -o a.png --preset ball.toml", &["ball.toml: "]),
        ("ink ball.toml -o a.png --paper rav", &["no paper 'rav'", "did you mean 'raw'?"]),
        ("ink ball.toml -o a.svg --literal", &["a.svg: the slides' method has no strokes"]),
        ("ink ball.toml -o a.png --at 1", &["nothing in it moves"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "the scene alone");
}
