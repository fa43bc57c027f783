//! `yugen view`: driven by scripts on a display without a screen, on whatever GPU there is.

use crate::{bad, refused, run, scratch, yugen_in};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use yugen_archive::formats::image;
use yugen_optics::Image;

const SCENE: &str = r##"
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
diffuse_reflectance = [0.7, 0.05, 0.05]
alpha = 0.3

[[shape]]
name = "desk"
type = "rectangle"
size = [4, 4]
facing = [0, 1, 0]
material = "desk"

[[shape]]
name = "ball"
type = "sphere"
radius = 0.4
at = [0, 0.4, 0]
material = "red"

[[light]]
name = "lamp"
type = "point"
at = [-1, 2, 1]
intensity = 3

[[light]]
name = "sky"
type = "constant"
radiance = 0.3
"##;

/// A display without a screen.
struct Xvfb {
    child: Child,
    name: String,
}

impl Xvfb {
    /// `None` after saying that there is no Xvfb, which with `REQUIRE_GPU=1` is a failure.
    fn start() -> Option<Self> {
        let started = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut child = match started {
            Ok(child) => child,
            Err(e) => {
                let required = std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1");
                assert!(
                    !required,
                    "REQUIRE_GPU=1, but Xvfb does not start: {e} (Debian: apt-get install xvfb)"
                );
                println!("skipped: no Xvfb ({e})");
                return None;
            }
        };
        // It writes the number of the display that it found free.
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("a pipe"))
            .read_line(&mut line)
            .expect("Xvfb says its display");
        let number = line.trim();
        assert!(number.parse::<u32>().is_ok(), "'{line}' is no display");
        Some(Self { name: format!(":{number}"), child })
    }

    fn view(&self, folder: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_yugen"));
        command.arg("view").args(arguments).current_dir(folder).env("DISPLAY", &self.name);
        command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env("LC_ALL", "C");
        command
    }
}

impl Drop for Xvfb {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read(path: &Path) -> Image {
    image::read(path, &Default::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Mean of a part of the picture, given in parts of its width and height.
fn mean(image: &Image, [x0, x1]: [f32; 2], [y0, y1]: [f32; 2]) -> [f32; 3] {
    let at = |part: f32, all: usize| (part * all as f32) as usize;
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for y in at(y0, image.height)..at(y1, image.height) {
        for x in at(x0, image.width)..at(x1, image.width) {
            for (s, v) in sum.iter_mut().zip(image.pixel(x, y)) {
                *s += v;
            }
            count += 1.0;
        }
    }
    assert!(count > 0.0);
    sum.map(|s| s / count)
}

fn all(image: &Image) -> f32 {
    mean(image, [0.0, 1.0], [0.0, 1.0]).iter().sum::<f32>() / 3.0
}

/// Root mean square of the difference.
fn apart(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.width, a.height, a.data.len()), (b.width, b.height, b.data.len()));
    let sum: f32 = a.data.iter().zip(&b.data).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / a.data.len() as f32).sqrt()
}

fn reports(out: &str) -> Vec<Value> {
    out.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

#[test]
fn a_script_turns_changes_compares_and_saves() {
    let Some(display) = Xvfb::start() else { return };
    let folder = scratch("view");
    std::fs::write(folder.join("ball.toml"), SCENE).expect("it can be written");
    let script = "panel off; resolution full; curve aces
        wait 16; save still.exr; save still.png
        pick 0.5 0.5; report
        material ball diffuse_reflectance 0.05 0.05 0.7; wait 16; save blue.exr
        model ball lambert; wait 16; save matte.exr
        light lamp off; wait 16; save dark.exr
        light lamp on; restore; orbit 40 15; wait 16; save turned.exr
        reference; wait 32 64; report; save both.exr; save both.png
        panel on; window en.png   # with the controls
        language en; graph; help; wait 4; window help.png; quit";
    std::fs::write(folder.join("all.txt"), script).expect("it can be written");
    let done = run(&mut display.view(&folder, &["ball.toml", "--script", "all.txt", "--size", "320x240"]));
    assert!(done.success, "{}", done.err);
    let picture = |name: &str| read(&folder.join(name));
    let [still, blue, matte, dark, turned] =
        ["still.exr", "blue.exr", "matte.exr", "dark.exr", "turned.exr"].map(picture);
    // Under the panel there is but the line at the foot.
    assert_eq!(still.width, 320);
    assert!((200..240).contains(&still.height), "{}", still.height);

    // The same as by `yugen render`, from the same place.
    let size = format!("{}x{}", still.width, still.height);
    let output = folder.join("render.exr");
    let render = ["ball.toml", "-o", "render.exr", "--by", "realtime", "--spp", "16", "--size", &size];
    let rendered =
        run(Command::new(env!("CARGO_BIN_EXE_yugen")).arg("render").args(render).current_dir(&folder));
    assert!(rendered.success, "{}", rendered.err);
    let rendered = read(&output);
    let (off, of, ratio) = (apart(&still, &rendered), all(&rendered), all(&still) / all(&rendered));
    println!("beside yugen render: {off} of {of}, ratio {ratio}");
    // Measured 0: the same bits. On a fast GPU a frame may be added before it is saved, which is noise.
    assert!(off < 0.1 * of, "{off} {of}");
    assert!((all(&still) / all(&rendered) - 1.0).abs() < 0.01, "{} {}", all(&still), all(&rendered));

    // The ball is in the middle: red, then blue; without the lamp the desk is darker; from elsewhere it is another picture.
    let middle = |i: &Image| mean(i, [0.45, 0.55], [0.45, 0.55]);
    let ([r, _, b], [r2, _, b2]) = (middle(&still), middle(&blue));
    assert!(r > 3.0 * b && b2 > 3.0 * r2, "{r} {b} {r2} {b2}");
    // Without its coat the ball is as blue, and shows no lamp.
    let [r3, _, b3] = middle(&matte);
    assert!(b3 > 3.0 * r3, "{r3} {b3}");
    // Red is what the coat reflects of the lamp: on the ball, which ends before the desk's edge.
    let highlight = |i: &Image| {
        let within = |v: usize, all: usize, from: f32, to: f32| (from..to).contains(&(v as f32 / all as f32));
        (0..i.width * i.height)
            .map(|p| (p % i.width, p / i.width))
            .filter(|(x, y)| within(*x, i.width, 0.35, 0.65) && within(*y, i.height, 0.3, 0.65))
            .map(|(x, y)| i.pixel(x, y)[0])
            .fold(0.0, f32::max)
    };
    let (coated, bare) = (highlight(&blue), highlight(&matte));
    println!("reddest of the ball: {coated} under its coat, {bare} without");
    assert!(bare < 0.5 * coated, "{coated} {bare}");
    let desk = |i: &Image| mean(i, [0.4, 0.6], [0.85, 1.0])[1];
    assert!(desk(&dark) < 0.8 * desk(&blue), "{} {}", desk(&dark), desk(&blue));
    assert!(apart(&still, &turned) > 0.05, "{}", apart(&still, &turned));

    let said = reports(&done.out);
    assert_eq!(said.len(), 2, "{}", done.out);
    assert_eq!(said[0]["selected"]["model"], "rough_plastic");
    assert_eq!(said[0]["selected"]["worn_by"][0], "ball");
    assert!(said[1]["selected"]["material"].as_u64().is_some());
    assert!(said[1]["frames"].as_u64() >= Some(32) && said[1]["reference_samples"].as_f64() >= Some(64.0));
    let number = |name: &str| said[1][name].as_f64().unwrap_or(f64::NAN);
    let (rmse, flip) = (number("relative_rmse"), number("flip"));
    // Measured .0196 and .0184: the noise of 32 frames and 64 samples.
    println!("relative RMSE {rmse}, FLIP {flip}");
    assert!(rmse > 0.0 && rmse < 0.08, "{rmse}");
    assert!(flip > 0.0 && flip < 0.075, "{flip}");

    // Both in one file; their means agree.
    let both = picture("both.exr");
    let layer = |names: &[&str]| both.select(names).expect("it has the layer");
    let (a, b) = (layer(&["R", "G", "B"]), layer(&["reference.R", "reference.G", "reference.B"]));
    assert!((all(&a) / all(&b) - 1.0).abs() < 0.02, "{} {}", all(&a), all(&b));
    // As it is seen: left real-time, right the reference.
    let shown = picture("both.png");
    assert_eq!((shown.width, shown.height), (both.width, both.height));

    // The whole window: the panel is dark and not empty, and the overlay covers the picture.
    let [plain, help] = ["en.png", "help.png"].map(picture);
    assert_eq!((plain.width, plain.height), (320, 240));
    let panel = mean(&plain, [0.6, 1.0], [0.1, 0.9]);
    assert!(panel[1] > 0.005 && panel[1] < 0.2, "{panel:?}");
    assert!(apart(&plain, &help) > 0.02, "{}", apart(&plain, &help));
}

#[test]
fn a_file_that_breaks_while_it_is_seen_is_a_sentence_and_the_picture_stays() {
    let Some(display) = Xvfb::start() else { return };
    let folder = scratch("view_reload");
    let scene = folder.join("ball.toml");
    std::fs::write(&scene, SCENE).expect("it can be written");
    let script = "panel off; wait 8; report; wait 300; report; save old.exr; wait 400; report; quit";
    let mut child = display
        .view(&folder, &["ball.toml", "--do", script, "--size", "120x90"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
    let mut next = || -> Value {
        let line = lines.next().expect("it goes on").expect("text");
        serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"))
    };
    assert_eq!(next()["message"], "");
    std::fs::write(&scene, SCENE.replace("[material.red]", "[material.rde]")).expect("it can be written");
    let said = next()["message"].as_str().unwrap_or_default().to_string();
    assert!(said.contains("ball.toml") && said.contains("red"), "{said}");
    let last = next();
    assert!(last["frames"].as_u64() >= Some(400), "the picture was thrown away: {last}");
    let status = child.wait().expect("it ends");
    let mut said = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut said).expect("text");
    assert!(status.success(), "{said}");
    assert!(all(&read(&folder.join("old.exr"))) > 0.05);
}

#[test]
fn what_cannot_be_shown_is_a_sentence() {
    let folder = scratch("view_bad");
    std::fs::write(folder.join("ball.toml"), SCENE).expect("it can be written");
    refused(yugen_in(&folder, "view none.toml"), &["none.toml"]);
    refused(yugen_in(&folder, "view ball.toml --script none.txt"), &["none.txt"]);
    let script = |text: &str| {
        bad(run(Command::new(env!("CARGO_BIN_EXE_yugen"))
            .args(["view", "ball.toml", "--do", text])
            .current_dir(&folder)))
    };
    assert!(
        script("orbti 3")
            .contains("--do: line 1: 'orbti 3': there is no action 'orbti'; did you mean 'orbit'?")
    );
    assert!(script("wait; dolly x").contains("expected `dolly FACTOR`"));
    // No display.
    let mut command = Command::new(env!("CARGO_BIN_EXE_yugen"));
    command.args(["view", "ball.toml"]).current_dir(&folder);
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    if cfg!(target_os = "linux") {
        refused(run(&mut command), &["no display was found", "xvfb"]);
    }
    // Steps that cannot be done, with a display but without drivers of a GPU, and a file that cannot be written.
    let Some(display) = Xvfb::start() else { return };
    let view = |text: &str| display.view(&folder, &["ball.toml", "--size", "120x90", "--do", text]);
    let said = run(&mut view("light moon off; quit"));
    assert!(
        !said.success
            && said.err.contains("step 1 of the script, 'light moon off'")
            && said.err.contains("no light 'moon'"),
        "{}",
        said.err
    );
    let said = run(&mut view("save none/x.png; quit"));
    assert!(!said.success && said.err.contains("none"), "{}", said.err);
    let said = run(&mut view("save ball.toml; quit"));
    assert!(!said.success && said.err.contains("ball.toml"), "{}", said.err);
    let said = run(view("quit").env("VK_ICD_FILENAMES", "/nowhere").env("VK_DRIVER_FILES", "/nowhere"));
    assert!(!said.success && said.err.contains("no GPU was found"), "{}", said.err);
}

/// What the window paints is to the bit what `yugen ink` paints from there, and so is what its preset makes of it.
#[test]
fn a_scene_is_painted_in_ink_and_one_of_its_strokes_is_hidden() {
    let Some(display) = Xvfb::start() else { return };
    let folder = scratch("view_ink");
    std::fs::write(folder.join("ball.toml"), SCENE).expect("it can be written");
    let view = |script: &str| {
        let done = run(&mut display.view(&folder, &["ball.toml", "--do", script, "--size", "320x240"]));
        assert!(done.success, "{}", done.err);
        reports(&done.out)
    };
    let said = view(
        "panel off; resolution full; wait 4; save light.png; ink; wait; report; save a.png; save a.exr; save a.svg
         set size 2; preset dry; set paper silk; set size 2; wait; save dry.png; save dry.toml
         light lamp off; wait; save dark.png; orbit 30 0; wait; save turned.png; ink off; wait 4; save again.png
         ink; panel on; wait; window en.png; quit",
    );
    let ink = &said[0]["ink"];
    assert!(ink["preset"] == "sumi" && ink["strokes"].as_u64() > Some(0) && ink["stroke"].is_null(), "{ink}");
    let (w, h) = (ink["width"].as_u64().expect("pixels"), ink["height"].as_u64().expect("pixels"));
    let paint = |line: &str| {
        let done = yugen_in(&folder, &format!("ink ball.toml --size {w}x{h} {line}"));
        assert!(done.success, "{}", done.err);
    };
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let text = |name: &str| String::from_utf8(bytes(name)).expect("text");
    let picture = |name: &str| read(&folder.join(name));
    paint("-o b.png -o b.exr -o b.svg");
    assert_eq!(picture("a.png").data, picture("b.png").data);
    let (a, b) = (picture("a.exr"), picture("b.exr"));
    assert!(a.channels.iter().any(|c| c == "gou.A") && a.channels == b.channels && a.data == b.data);
    assert_eq!(text("a.svg"), text("b.svg"));
    paint("--preset dry.toml -o b.png");
    assert_eq!(picture("dry.png").data, picture("b.png").data);
    let all = ["a.png", "dry.png", "dark.png", "turned.png", "light.png"].map(picture);
    for i in 0..all.len() {
        assert!((0..i).all(|j| apart(&all[i], &all[j]) > 0.01), "{i}");
    }
    assert!(apart(&picture("again.png"), &picture("turned.png")) > 0.05, "it is still painted");
    let panel = picture("en.png");
    assert_eq!((panel.width, panel.height), (320, 240));

    // A point of the ball's outline, and what is there when it is clicked.
    let of_ball = text("a.svg").split("id=\"gou\"").nth(1).expect("contours").to_string();
    let of_ball = of_ball.split("data-object=\"ball\"").nth(1).expect("the ball's").to_string();
    let id = &of_ball.split("data-id=\"").nth(1).expect("a stroke")[..8];
    let centre = of_ball.split("stroke=\"none\" d=\"M").nth(1).expect("a centreline");
    let places: Vec<&str> =
        centre.split('"').next().unwrap_or_default().trim_end_matches('Z').split('L').collect();
    let (x, y) = places[places.len() / 2].split_once(' ').expect("a point");
    let part = |v: &str, all: u64| v.parse::<f64>().expect("a number") / all as f64;
    let (x, y) = (part(x, w), part(y, h));
    let said = view(&format!(
        "panel off; ink; pick {x} {y}; report; window line.png; stroke ink 0.1; wait; save pale.svg
         stroke hide; wait; save c.svg; save c.toml; save c.png; pick 0.02 0.02; report; preset c.toml; wait; quit"
    ));
    assert!(said[0]["ink"]["stroke"] == id && said[0]["ink"]["object"] == "ball", "{}", said[0]);
    assert!(said[1]["ink"]["stroke"].is_null(), "{}", said[1]);
    let stroke = |svg: &str| svg.lines().find(|l| l.contains(&format!("data-id=\"{id}\""))).map(String::from);
    let (plain, pale) = (stroke(&text("a.svg")), stroke(&text("pale.svg")));
    assert!(pale.is_some() && pale != plain && stroke(&text("c.svg")).is_none());
    paint("--preset c.toml -o d.svg -o d.png");
    assert_eq!(text("c.svg"), text("d.svg"));
    assert_eq!(picture("c.png").data, picture("d.png").data);

    // A surface that is clicked on offers its object and its material, which are steered by name; what nobody has is told.
    let wrong = "[object.bal]\nink = 1\n[stroke.00000001]\nhide = true";
    std::fs::write(folder.join("wrong.toml"), wrong).expect("it can be written");
    let said = view(
        "panel off; ink; pick 0.5 0.5; report; steer material red wash 0; steer object ball contour 0.5; wait; report
         save e.svg; save e.png; save e.toml; stroke 00000002; stroke pin; save f.toml; preset wrong.toml; wait; report; quit",
    );
    assert_eq!(
        (&said[0]["ink"]["steered"], &said[1]["ink"]["steered"]),
        (&"object ball".into(), &"object ball".into())
    );
    assert!(said[1]["ink"]["unmet"].as_array().is_some_and(Vec::is_empty), "{}", said[1]);
    let unmet = said[2]["ink"]["unmet"].to_string();
    let told = ["did you mean 'ball'?", "[stroke.00000001]", "[stroke.00000002]"];
    assert!(told.iter().all(|words| unmet.contains(words)), "{unmet}");
    assert!(text("e.toml").contains("[material.\"red\"]\nwash = 0") && text("f.toml").contains("pin = true"));
    paint("--preset e.toml -o g.svg -o g.png");
    assert_eq!((text("e.svg"), picture("e.png").data), (text("g.svg"), picture("g.png").data));

    // Masks that are painted, on the picture and on a surface: the preset and the pictures beside it say the same to `yugen ink`.
    let said = view(
        "panel off; ink; mask blank; brush 300; draw 0.2 0.5 0.4 0.6; brush erase; brush 60; draw 0.3 0.5
         brush add; brush strength 0.5; mask worn object ball; mask ink 0.2; mask wash 2
         brush 200; draw 0.5 0.2 0.5 0.8; wait; report; save m.png; save m.toml
         brush undo; wait; save n.png; brush undo; brush undo; wait; save undone.png; quit",
    );
    assert_eq!(said[0]["ink"]["mask"], serde_json::json!({"name": "worn", "on": "object.ball"}));
    assert!(text("m.toml").contains("[mask.\"blank\"]\nimage = \"m-blank.png\"\non = \"picture\"\nink = 0"));
    paint("--preset m.toml -o o.png");
    assert_eq!(picture("m.png").data, picture("o.png").data);
    assert_eq!(picture("undone.png").data, picture("a.png").data);
    let all = ["m.png", "n.png", "a.png"].map(picture);
    assert!(apart(&all[0], &all[1]) > 0.002 && apart(&all[1], &all[2]) > 0.01);
    // Of the ball's mask a band in front is white, as strong as the brush, and nothing of it behind.
    let worn = picture("m-worn.png");
    assert_eq!((worn.width, worn.height), (1024, 1024));
    let white = worn.data.iter().filter(|v| **v > 0.2).count() as f32 / worn.data.len() as f32;
    let most = worn.data.iter().copied().fold(0.0, f32::max);
    assert!((0.02..0.4).contains(&white) && (0.2..0.23).contains(&most), "{white} {most}");

    // Beside the slides' method, left and right of a line.
    view(
        "panel off; ink; literal; wait; save both.png; compare reference; save slides.png; save both.exr
         literal off; wait; save ours.png; quit",
    );
    paint("--literal -o l.png");
    let [both, slides, ours] = ["both.png", "slides.png", "ours.png"].map(picture);
    assert_eq!((&slides.data, &ours.data), (&picture("l.png").data, &picture("a.png").data));
    let column =
        |image: &Image, x: usize| (0..image.height).map(|y| image.pixel(x, y).to_vec()).collect::<Vec<_>>();
    let (left, right) = (both.width / 2 - 2, both.width / 2 + 2);
    assert_eq!((column(&both, left), column(&both, right)), (column(&ours, left), column(&slides, right)));
    assert!(column(&ours, right) != column(&slides, right));
    assert!(picture("both.exr").channels.iter().any(|c| c == "literal.G"));

    // What cannot be is a sentence.
    for (script, words) in [
        ("preset sumie", "did you mean 'sumi'?"),
        ("set dryness 2", "out of range"),
        ("ink; stroke hide", "click on a contour"),
        ("stroke hide", "`ink` first"),
        ("steer object ball bleed 1", "of the whole sheet"),
        ("preset none.toml", "none.toml"),
        ("ink; save ball.toml", "ball.toml"),
        ("ink; draw 0.5 0.5", "no mask is painted"),
        ("ink; mask a; mask bleed 0", "of the whole sheet"),
        ("ink; mask a object bal; draw 0.5 0.5", "did you mean 'ball'?"),
        ("draw 0.5 0.5", "`ink` first"),
    ] {
        let said = run(&mut display.view(&folder, &["ball.toml", "--do", script, "--size", "120x90"]));
        assert!(!said.success && said.err.contains(words), "{script}: {}", said.err);
    }
    assert_eq!(text("ball.toml"), SCENE);
}

#[test]
fn an_animation_is_stepped_and_played() {
    let Some(display) = Xvfb::start() else { return };
    let folder = scratch("view_time");
    crate::sequence::sliding(&folder);
    let script = "panel off; resolution full; wait 8; save still.exr
        seconds .75; wait 8; save later.exr; window strip.png
        clip jump; step .5; wait 8; save jump.exr
        clip slide; seconds 0; wait 8; save first.exr
        play; pause 1.2; window playing.png; play off; wait 8; report; save played.exr; quit";
    std::fs::write(folder.join("all.txt"), script).expect("it can be written");
    let run =
        |script: &str| run(&mut display.view(&folder, &["a.gltf", "--script", script, "--size", "320x200"]));
    let done = run("all.txt");
    assert!(done.success, "{}", done.err);
    let picture = |name: &str| read(&folder.join(name));
    let [still, later, jump, first] = ["still.exr", "later.exr", "jump.exr", "first.exr"].map(picture);
    // As the file has it, the triangle is in the middle; the sky is bright about it.
    assert!(apart(&still, &later) > 0.02 && apart(&first, &later) > 0.02);
    assert_eq!(jump.data, first.data, "a jump stays where the slide begins");
    // It has gone on by the clock, and the picture with it.
    let report = &reports(&done.out)[0];
    let seconds = report["seconds"].as_f64().expect("seconds");
    println!("after 1.2 s: {seconds} of {}", report["animation"]);
    assert!(report["animation"] == "slide" && seconds > 0.0 && seconds < 1.0, "{report}");
    // The same as by `yugen render`, at the same time from the same place.
    let size = format!("{}x{}", later.width, later.height);
    for (seen, seconds) in [(later, 0.75), (picture("played.exr"), seconds)] {
        let line = format!("render a.gltf -o render.exr --by realtime --at {seconds} --spp 8 --size {size}");
        let rendered = yugen_in(&folder, &line);
        assert!(rendered.success, "{}", rendered.err);
        let (off, of) = (apart(&seen, &read(&folder.join("render.exr"))), all(&seen));
        println!("beside yugen render at {seconds} s: {off} of {of}");
        assert!(off < 0.1 * of, "{off} {of}");
    }
}

#[test]
fn cloth_is_simulated_while_it_is_looked_at() {
    let Some(display) = Xvfb::start() else { return };
    let folder = scratch("view_cloth");
    crate::simulate::scene(&folder);
    let rest = "\n[camera]\nfrom = [0.3, 0.8, 1.6]\nto = [0, 0, 0]\nfov = 40\n\n[[light]]\ntype = \"point\"\nat = [-1, 2, 1]\nintensity = 5\n\n\
                [[light]]\ntype = \"constant\"\nradiance = 0.3\n";
    let scene = std::fs::read_to_string(folder.join("a.toml")).expect("a scene") + rest;
    std::fs::write(folder.join("a.toml"), &scene).expect("it can be written");
    let cached = scene.replace(
        "file = \"sheet.obj\"",
        "file = \"sheet.obj\"\ncache = { file = \"a.pc2\", fps = 60, space = \"world\" }",
    );
    std::fs::write(folder.join("cached.toml"), cached).expect("it can be written");
    let cloth = ["--cloth", "cloth", "--ground", "-0.2", "--fabric", "silk"];
    let simulated = yugen_in(&folder, &format!("simulate a.toml {} --frames 61 -o a.pc2", cloth.join(" ")));
    assert!(simulated.success, "{}", simulated.err);
    let view = |scene: &str, more: &[&str], script: &str| {
        let script = format!("panel off; resolution full; {script}; report; quit");
        let arguments = [&[scene, "--size", "200x150", "--do", &script], more].concat();
        let done = run(&mut display.view(&folder, &arguments));
        assert!(done.success, "{}", done.err);
        reports(&done.out).remove(0)
    };
    let moments = "seconds 0; wait 8; save NAME-0.exr; seconds 1; wait 8; save NAME-60.exr; seconds .5; wait 8; save NAME-30.exr";
    view("cached.toml", &[], &moments.replace("NAME", "cached"));
    let changes = "; wind 3 0 0; seconds 1; wait 8; save wind.exr; wind 0 0 0; seconds .5; wait 8; save back.exr; fabric hemp; seconds 1; wait 8; save hemp.exr; \
                   seconds 0; play; pause .5; play off; wait 8";
    let played = view("a.toml", &cloth, &(moments.replace("NAME", "live") + changes));
    let picture = |name: &str| read(&folder.join(name));
    let [calm, wind, hemp] = ["live-60.exr", "wind.exr", "hemp.exr"].map(picture);
    let changed = apart(&calm, &wind).min(apart(&calm, &hemp)).min(apart(&calm, &picture("live-30.exr")));
    for frame in [0, 30, 60] {
        // What `yugen simulate` writes, also where time has gone back: measured equal to the bit, where pictures have as many frames; beside .0156
        // from half a second to a whole one, .063 with hemp and .119 in the wind.
        let [live, cached] = ["live", "cached"].map(|name| picture(&format!("{name}-{frame}.exr")));
        let off = apart(&live, &cached);
        println!("frame {frame}: {off}, where wind, fabric or time make {changed}");
        assert!(off < 0.1 * changed, "frame {frame}: {off}");
    }
    let seconds = played["seconds"].as_f64().expect("seconds");
    assert!(
        seconds > 0.0 && (seconds * 60.0 - (seconds * 60.0).round()).abs() < 1e-3,
        "whole frames: {played}"
    );
    for (arguments, words) in [
        (&["a.toml", "--do", "wind 1 0 0"][..], "no cloth is simulated here"),
        (&["a.toml", "--wind", "1,0,0"], "not which shapes are cloth"),
        (&["a.toml", "--animation", "Walk"], "not which shapes are cloth"),
        (&["a.toml", "--cloth", "clth"], "'clth'"),
        (&["a.toml", "--cloth", "cloth", "--do", "fabric sil"], "did you mean 'silk'?"),
        (&["a.toml", "--cloth", "cloth", "--do", "wind 900 0 0"], "at most 100 m/s"),
    ] {
        let said = run(&mut display.view(&folder, arguments));
        assert!(!said.success && said.err.contains(words), "{arguments:?}: {}", said.err);
    }
}
