//! A render is never lost: interrupted, continued, added to, and watched while it grows.

use crate::render::{SCENE, arguments, render, set_up};
use crate::{good, killed_midway, refused, report};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use yugen_archive::formats::image::{ReadOptions, read_bytes};

fn start(scene: &Path, output: &Path, more: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_yugen"))
        .arg("render")
        .args(arguments(scene, output, more))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

fn same(a: &Path, b: &Path) -> bool {
    std::fs::read(a).unwrap() == std::fs::read(b).unwrap()
}

#[test]
#[cfg(unix)]
fn interrupted_at_ten_moments_it_still_gives_the_same_bits() {
    let (folder, scene) = set_up("interrupt");
    let (whole, output) = (folder.join("whole.exr"), folder.join("my picture.exr"));
    let checkpoint = folder.join("my picture.exr.checkpoint");
    let budget = ["--spp", "4096", "--size", "48x32", "--aov", "albedo,variance"];
    good(render(&scene, &whole, &[&budget[..], &["--checkpoint", "0"]].concat()));

    let slowly = [&budget[..], &["--threads", "1", "--checkpoint", "0.02"]].concat();
    let written = || std::fs::metadata(&checkpoint).and_then(|m| m.modified()).ok();
    let mut last = None;
    let mut random = 0x2545_f491_4f6c_dd1du64;
    let (mut samples, mut interruptions) = (0, 0);
    for i in 0..60 {
        if interruptions == 10 {
            break;
        }
        let more: &[&str] = if last.is_none() { &[] } else { &["--resume"] };
        let child = start(&scene, &output, &[&slowly[..], more].concat());
        // xorshift64, Marsaglia 2003.
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        // Once it renders, which its first checkpoint of its own shows; before that an interruption just ends it.
        let begun = Instant::now();
        while written() == last && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(random % 60));
        signal(&child, if i % 3 == 2 { "-TERM" } else { "-INT" });
        let out = child.wait_with_output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        if out.status.success() {
            // A busy machine: the signal came after the end. Once more from the beginning.
            std::fs::remove_file(&output).unwrap();
            let _ = std::fs::remove_file(&checkpoint);
            (last, samples) = (None, 0);
            continue;
        }
        assert_eq!(out.status.code(), Some(130), "{i}: {said}");
        assert!(said.contains("this goes on from here") && said.contains("--resume"), "{said}");
        let picture = yugen_archive::formats::image::read(&output, &ReadOptions::default()).unwrap();
        let counts = picture.channel("samples.Y").unwrap();
        let now: f32 = picture.data.chunks_exact(picture.channels.len()).map(|p| p[counts]).sum();
        assert!(now as u32 >= samples, "{i}: {now} samples after {samples}");
        samples = now as u32;
        last = written();
        interruptions += 1;
    }
    assert_eq!(interruptions, 10);
    // As it was told to.
    good_but_for_the_note(render(&scene, &output, &[&budget[..], &["--resume"]].concat()), "going on from");
    assert!(same(&whole, &output), "the continued picture differs");
}

fn good_but_for_the_note(run: crate::Run, note: &str) {
    assert!(run.success && run.err.contains(note) && run.err.lines().count() == 1, "{}", run.err);
}

#[test]
#[cfg(unix)]
fn a_second_interruption_ends_at_once() {
    let (folder, scene) = set_up("twice");
    let output = folder.join("a.exr");
    let checkpoint = folder.join("a.exr.checkpoint");
    let child =
        start(&scene, &output, &["--spp", "65536", "--size", "300x300", "--checkpoint", "0.02", "--json"]);
    let begun = Instant::now();
    while !checkpoint.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    // The first makes it write; whether it has ended by then or not, it has ended after the second.
    signal(&child, "-INT");
    let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    let begun = Instant::now();
    let out = child.wait_with_output().unwrap();
    assert_eq!(out.status.code(), Some(130));
    assert!(begun.elapsed() < Duration::from_secs(20));
}

#[test]
fn a_finished_render_takes_more_samples() {
    let (folder, scene) = set_up("more");
    let (whole, output) = (folder.join("whole.exr"), folder.join("a.exr"));
    let checkpoint = folder.join("a.exr.checkpoint");
    good(render(&scene, &whole, &["--spp", "100"]));
    let told = report(render(&scene, &output, &["--spp", "40", "--keep", "--json"]));
    assert_eq!(told["checkpoint"], checkpoint.to_str().unwrap());
    assert_eq!(told["finished"], true);
    // Of the 40 the last 8 are taken again, in a visit of 16.
    let more = render(&scene, &output, &["--spp", "100", "--resume", "--keep"]);
    good_but_for_the_note(more, "32 samples a pixel");
    assert!(same(&whole, &output), "more samples give another picture than all at once");
    refused(
        render(&scene, &output, &["--spp", "20", "--resume"]),
        &["already has 96 samples", "the 20 asked for"],
    );

    // Without a checkpoint there is nothing to add to, and it is said.
    std::fs::remove_file(&checkpoint).unwrap();
    std::fs::remove_file(&output).unwrap();
    let anew = render(&scene, &output, &["--spp", "100", "--resume"]);
    good_but_for_the_note(anew, "starting from the beginning");
    assert!(same(&whole, &output));

    // What was shared out by noise goes on by noise.
    let quick = ["--size", "24x16", "--keep", "--json"];
    let first = report(render(&scene, &output, &[&quick[..], &["--error", "0.2"]].concat()));
    let second = report(render(&scene, &output, &[&quick[..], &["--error", "0.1", "--resume"]].concat()));
    assert!(second["samples"].as_u64() > first["samples"].as_u64());
    let third = report(render(&scene, &output, &[&quick[..], &["--time", "1.5s", "--resume"]].concat()));
    assert!(third["samples"].as_u64() > second["samples"].as_u64());
    let numbers = [&quick[..], &["--spp", "4096", "--resume"]].concat();
    refused(render(&scene, &output, &numbers), &["a.exr.checkpoint", "--time, --error"]);
}

#[test]
fn an_unfinished_render_is_not_thrown_away_unasked() {
    let (folder, scene) = set_up("unasked");
    let (output, checkpoint) = (folder.join("a.exr"), folder.join("a.exr.checkpoint"));
    let long = ["--spp", "65536", "--checkpoint", "0.05", "--json"];
    killed_midway(&["render"], &arguments(&scene, &output, &long), &checkpoint, 0);
    let before = std::fs::read(&checkpoint).unwrap();
    refused(
        render(&scene, &output, &["--spp", "1"]),
        &["a.exr.checkpoint", "of 65536", "--resume", "--restart"],
    );
    assert!(!output.exists());
    // One that writes none does not care.
    good(render(&scene, &output, &["--spp", "1", "--checkpoint", "0"]));
    assert!(std::fs::read(&checkpoint).unwrap() == before);
    // As one of a picture that is done, it goes with it.
    good(render(&scene, &output, &["--spp", "16", "--size", "8x8", "--restart", "--keep", "--json"]));
    assert!(std::fs::read(&checkpoint).unwrap() != before);
    let again = render(&scene, &output, &["--spp", "16", "--size", "8x8"]);
    good_but_for_the_note(again, "(16 samples a pixel) goes with it");
    assert!(!checkpoint.exists());
}

#[test]
fn the_reason_of_a_refusal_names_what_differs() {
    let (folder, scene) = set_up("reason");
    let output = folder.join("a.exr");
    let base = ["--spp", "16", "--size", "24x16", "--keep", "--json"];
    report(render(&scene, &output, &base));
    let again = |more: &[&str]| {
        let all = [&["--spp", "32", "--keep", "--json", "--resume"], more].concat();
        render(&scene, &output, &all)
    };
    let same_size = ["--size", "24x16"];
    let cases: [(&[&str], &str); 7] = [
        (&["--size", "24x18"], "the size was 24x16 in it, and is 24x18 now"),
        (&["--seed", "1"], "the seed was 0 in it, and is 1 now"),
        (&["--aov", "depth"], "the list of layers was empty in it, and is depth now"),
        (&["--integrator", "direct"], "the integrator was path in it, and is direct now"),
        (&["--max-depth", "3"], "the longest path was unlimited in it, and is 3 now"),
        (&["--clamp", "5"], "the clamp was none in it, and is 5 now"),
        (&["--size", "25x16"], "the size was 24x16"),
    ];
    for (more, reason) in cases {
        let more = if more[0] == "--size" { more.to_vec() } else { [&same_size[..], more].concat() };
        refused(again(&more), &["a.exr.checkpoint", reason]);
    }
    for (from, to, reason) in [
        ("reflectance = 0.8", "reflectance = 0.7", "the material of 'rectangle' has changed"),
        ("at = [0, 0.4, 0]", "at = [0, 0.5, 0]", "shape 'sphere' has changed"),
        ("scale = 12", "scale = 13", "shape 'rectangle' has changed"),
        ("fov = 35", "fov = 36", "the camera 'camera' has changed"),
        (
            "[camera]",
            "[[light]]\ntype = \"constant\"\nradiance = 1\n[camera]",
            "light 1 ('environment'), which is in this render",
        ),
    ] {
        assert!(SCENE.contains(from));
        std::fs::write(&scene, SCENE.replace(from, to)).unwrap();
        refused(again(&same_size), &["a.exr.checkpoint", reason]);
    }
    // A comment changes nothing.
    std::fs::write(&scene, format!("# A ball.\n{SCENE}")).unwrap();
    assert_eq!(report(again(&same_size))["samples"], 32 * 24 * 16);
}

/// Sums take 190 bytes of every pixel in memory.
#[test]
fn checkpoints_are_packed() {
    let (folder, scene) = set_up("packed");
    let output = folder.join("a.exr");
    report(render(&scene, &output, &["--spp", "64", "--keep", "--json"]));
    let length = std::fs::metadata(folder.join("a.exr.checkpoint")).unwrap().len();
    let each = length as f64 / (96.0 * 64.0);
    assert!(each < 110.0, "{each} bytes a pixel");
}

#[test]
fn a_picture_can_be_watched_while_it_grows() {
    let (folder, scene) = set_up("watch");
    let output = folder.join("a.png");
    let mut child = start(&scene, &output, &["--spp", "1000000", "--watch=0.1", "--json"]);
    let mut seen: Vec<Vec<u8>> = Vec::new();
    let begun = Instant::now();
    while seen.len() < 3 && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(20));
        let Ok(bytes) = std::fs::read(&output) else { continue };
        if seen.last() != Some(&bytes) {
            seen.push(bytes);
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(seen.len(), 3, "it has not grown");
    for bytes in seen {
        let picture = read_bytes(&bytes, &output, &ReadOptions::default()).unwrap();
        assert_eq!((picture.width, picture.height), (96, 64));
    }
}
