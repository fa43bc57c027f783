//! `yugen render --by realtime`: the reference's picture on a GPU, or a sentence.

use crate::render::{SCENE, render, set_up};
use crate::{bad, report, scratch};
use std::path::Path;
use yugen_archive::formats::image;
use yugen_optics::Image;

/// Its report; `None` after saying why there is no GPU, which with `REQUIRE_GPU=1` is a failure.
fn realtime(scene: &Path, output: &Path, more: &[&str]) -> Option<serde_json::Value> {
    let run = render(scene, output, &[&["--by", "realtime", "--json"], more].concat());
    if !run.success
        && run.err.contains("no GPU was found")
        && !std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1")
    {
        println!("skipped: {}", run.err);
        return None;
    }
    // A driver may grumble about displays.
    assert!(run.success, "{}", run.err);
    Some(serde_json::from_str(&run.out).expect("a report"))
}

fn read(path: &Path) -> Image {
    image::read(path, &Default::default()).expect("a picture")
}

/// Root mean square of the difference over that of the reference, and the ratio of the means.
fn differ(reference: &Image, image: &Image) -> (f64, f64) {
    let rgb = |i: &Image| i.select(&["R", "G", "B"]).expect("a picture").data;
    let (a, b) = (rgb(reference), rgb(image));
    assert_eq!(a.len(), b.len());
    let (mut difference, mut square, mut mean, mut other) = (0.0, 0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(&b).map(|(a, b)| (f64::from(*a), f64::from(*b))) {
        difference += (a - b).powi(2);
        square += a * a;
        mean += a;
        other += b;
    }
    ((difference / square).sqrt(), other / mean)
}

#[test]
fn both_renderers_make_one_picture() {
    let (folder, scene) = set_up("realtime");
    let lights = "[[light]]\ntype = \"point\"\nat = [-1, 2, 1]\nintensity = 3\n";
    std::fs::write(&scene, format!("{SCENE}{lights}")).unwrap();
    let (reference, output) = (folder.join("reference.exr"), folder.join("realtime.exr"));
    for (integrator, most) in [("direct", 0.02), ("path", 0.08)] {
        let more = ["--integrator", integrator, "--aov", "normal,depth,id"];
        let frames = [&more[..], &["--spp", "128"]].concat();
        let Some(done) = realtime(&scene, &output, &frames) else { return };
        assert_eq!(done["samples_per_pixel"], 128);
        report(render(&scene, &reference, &[&more[..], &["--spp", "512", "--json"]].concat()));
        let (a, b) = (read(&reference), read(&output));
        assert_eq!(a.channels, b.channels);
        // Numbers of shapes are those at the centres of pixels.
        let ids = |i: &Image| i.select(&["id.Y"]).expect("ids").data;
        let other = ids(&a).iter().zip(ids(&b)).filter(|(a, b)| **a != *b).count();
        assert!(other <= 3, "{other} of 6144 pixels show another shape");
        let (error, ratio) = differ(&a, &b);
        // Measured .0084 and .0384, ratios .9988 and .9987: what is left is noise, by all light that of the glossy ball's
        // reflection on the desk.
        assert!(error < most && (ratio - 1.0).abs() < 5e-3, "{integrator}: {error} {ratio}");
    }
}

#[test]
fn what_the_real_time_renderer_has_not_is_named() {
    let (folder, scene) = set_up("realtime_not");
    let output = folder.join("a.exr");
    let run = |more: &[&str]| bad(render(&scene, &output, &[&["--by", "realtime"], more].concat()));
    let said = run(&["--denoise", "--clamp", "3", "--aov", "albedo", "--integrator", "depth"]);
    let named = "has no --clamp, --denoise, --integrator depth, --aov albedo: leave that out";
    assert!(said.contains(named), "{said}");
    let said = run(&["--camera", "nobody"]);
    assert!(said.contains("there is no camera called 'nobody'"), "{said}");
    assert!(!output.exists());
}

#[test]
fn what_cannot_be_seen_is_a_sentence() {
    let folder = scratch("realtime_bad");
    let scene = folder.join("bad.toml");
    let more = "[[shape]]\ntype = \"instance\"\ngroup = \"none\"\n";
    std::fs::write(&scene, format!("{SCENE}{more}")).unwrap();
    let said = bad(render(&scene, &folder.join("a.exr"), &["--by", "realtime"]));
    assert!(said.contains("none"), "{said}");
}
