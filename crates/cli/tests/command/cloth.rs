//! `yugen capture weave` and `simulate` from outside, as a person or a script meets them.

use crate::yugen;
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{self, NonFinite, ReadOptions};
use yugen_archive::formats::{btf, stack, wif};
use yugen_capture::Stack;
use yugen_optics::{ColourSpace, Image};

const SPACE: ColourSpace = ColourSpace::LinearRec2020;

fn good(args: &[&str]) -> serde_json::Value {
    crate::report(yugen(&["capture"], &[args, &["--json"]].concat()))
}

fn bad(args: &[&str]) -> String {
    crate::bad(yugen(&["capture"], args))
}

fn scratch(name: &str) -> PathBuf {
    crate::scratch(&format!("cloth/{name}"))
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_string()
}

fn raw(path: &Path) -> Image {
    let options = ReadOptions { non_finite: NonFinite::Keep, ..ReadOptions::raw() };
    image::read(path, &options).unwrap()
}

/// A whole stack folder in memory.
fn load(folder: &Path) -> Stack {
    let folder = stack::Folder::open(folder).unwrap();
    let band = folder.bands(folder.height).unwrap().next().unwrap().unwrap();
    Stack::from_band(&folder, band)
}

#[test]
fn a_weave_is_drawn_and_woven() {
    let out = scratch("weave");
    let report = good(&["weave", "kinran", "--size", "96x64", "-o", &text(&out)]);
    assert_eq!(report["size"], serde_json::json!([96, 64]));
    assert_eq!((report["ends"].as_u64(), report["picks"].as_u64()), (Some(120), Some(135)));
    let shares: f64 = report["share"].as_array().unwrap().iter().map(|s| s["share"].as_f64().unwrap()).sum();
    assert!((0.97..=1.0 + 1e-9).contains(&shares), "{shares}");
    for name in ["lit", "diffuse", "specular", "normal", "tangent", "sigma", "height", "threads"] {
        let picture = raw(&out.join(format!("{name}.png")));
        assert_eq!((picture.width, picture.height), (96, 64), "{name}");
        let (low, high) = picture.data.iter().fold((1.0f32, 0.0f32), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(high - low > 0.3, "{name} shows nothing: {low} to {high}");
    }
    for name in ["draft", "chart"] {
        let svg = std::fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("<image") && svg.ends_with("</svg>\n"));
        assert!(raw(&out.join(format!("{name}.png"))).width > 300);
    }
    // The map of normals says what the maps of numbers say.
    let (cloth, about) = btf::load(&out.join("cloth.btf"), SPACE).unwrap();
    assert!((about.texel_mm.unwrap() - 1.0 / 16.0).abs() < 1e-6);
    let normals = raw(&out.join("normal.png"));
    for (texel, shown) in cloth.texels.iter().zip(normals.data.chunks_exact(3)) {
        for (n, v) in texel.normal.to_array().iter().zip(shown) {
            assert!((0.5 * n + 0.5 - v).abs() < 0.5 / 255.0 + 1e-4);
        }
    }
    // The draft that was written weaves the same cloth.
    let written = std::fs::read(out.join("draft.wif")).unwrap();
    let draft = wif::read(&written, Path::new("draft.wif"), SPACE).unwrap();
    assert_eq!((draft.warp.len(), draft.weft.len(), draft.title.as_str()), (120, 135, "kinran"));
    let again = scratch("again");
    let report = good(&["weave", &text(&out.join("draft.wif")), "--size", "48x48", "-o", &text(&again)]);
    assert_eq!(report["ends"].as_u64(), Some(120));
    assert!(std::fs::read(again.join("draft.wif")).unwrap() == written, "another draft was written");
}

/// A square of the other side on satin: its weft shows, and its fibres lie across.
#[test]
fn a_figure_is_woven_into_a_named_weave() {
    let out = scratch("damask");
    let figure = out.join("figure.png");
    let mut mask = Image::new(40, 40, &["Y"]);
    for (i, v) in mask.data.iter_mut().enumerate() {
        // White in the lower left quarter: rows count from the top.
        *v = if i % 40 < 20 && i / 40 >= 20 { 1.0 } else { 0.0 };
    }
    image::write(&figure, &mask, &image::WriteOptions { raw: true, ..Default::default() }).unwrap();
    let cloth = ["weave", "satin:5/2", "--figure", &text(&figure), "--size", "80x80", "--repeats", "1x1"];
    let report = good(&[&cloth[..], &["-o", &text(&out)]].concat());
    assert_eq!((report["ends"].as_u64(), report["picks"].as_u64()), (Some(40), Some(40)));
    let (cloth, _) = btf::load(&out.join("cloth.btf"), SPACE).unwrap();
    let across = |figure: bool| {
        let inside = |i: usize| (i % 80 < 40 && i / 80 >= 40) == figure;
        let texels: Vec<_> = (0..6400).filter(|i| inside(*i)).map(|i| cloth.texels[i]).collect();
        texels.iter().filter(|t| t.tangent.x.abs() > t.tangent.y.abs()).count() as f32 / texels.len() as f32
    };
    assert!(across(true) > 0.7 && across(false) < 0.3, "{} {}", across(true), across(false));
}

#[test]
fn whole_repeats_have_their_proportions() {
    let out = scratch("repeats");
    let report = good(&["weave", "kinran", "--size", "60x1", "--repeats", "1x2", "-o", &text(&out)]);
    // Two honeycomb cells up: 2 √3 times as high as wide.
    assert_eq!(report["size"], serde_json::json!([60, 208]));
}

#[test]
fn a_stack_is_what_its_truth_reflects() {
    let out = scratch("stack");
    let report = good(&["simulate", "karaori", "--size", "24x20", "--lights", "9", "-o", &text(&out)]);
    assert_eq!((report["pictures"].as_u64(), report["saturated"].as_f64()), (Some(9), Some(0.0)));
    let (truth, about) = btf::load(&out.join("truth.exr"), SPACE).unwrap();
    assert_eq!(about.form, "ward_gmd");
    let stack = load(&out);
    assert_eq!((stack.width, stack.height, stack.lights.len()), (24, 20, 9));
    let subject =
        yugen_capture::simulate::Subject::new(&truth, None, yugen_reflectance::Choice(0.0)).unwrap();
    for light in 0..9 {
        let want = subject.picture(&stack.lights, light, yugen_optics::Vec3::Z);
        for (i, want) in want.iter().enumerate() {
            // The list of lights is text: directions come back to seven digits.
            let got = yugen_optics::Vec3::from(stack.samples(i % 24, i / 24)[light]);
            assert!((got - *want).abs().max_element() < 1e-4 * want.max_element() + 1e-6, "{got} {want}");
        }
    }
    // The same from its own truth, and another cloth from another seed.
    let again = scratch("stack_again");
    good(&["simulate", &text(&out.join("truth.exr")), "--lights", "9", "-o", &text(&again)]);
    assert!(raw(&out.join("0004.exr")).data == raw(&again.join("0004.exr")).data);
    good(&[
        "simulate",
        "karaori",
        "--size",
        "24x20",
        "--lights",
        "9",
        "--seed",
        "5",
        "--force",
        "-o",
        &text(&again),
    ]);
    assert!(raw(&out.join("0004.exr")).data != raw(&again.join("0004.exr")).data);
}

#[test]
fn brackets_hold_the_numbers_of_a_sensor() {
    let out = scratch("bracket");
    let options = ["--lights", "2", "--exposures", "3", "--bits", "12", "--vignetting", "0.2", "--shadows"];
    let cloth = ["simulate", "kinran", "--size", "32x32", "-o", &text(&out)];
    let report = good(&[&cloth[..], &options].concat());
    assert_eq!(report["files"].as_u64(), Some(6));
    let list = std::fs::read_to_string(out.join("exposures.csv")).unwrap();
    let lines: Vec<&str> = list.lines().collect();
    assert_eq!(lines[..3], ["file,light,seconds", "0001_1.png,0001,0.5", "0001_2.png,0001,0.0625"]);
    // Twelve bits in sixteen; three stops are a factor of eight where neither is dark or full.
    let [long, short] = ["0001_1.png", "0001_2.png"].map(|n| raw(&out.join(n)));
    let steps = long.data.iter().map(|v| v * 4095.0);
    assert!(steps.clone().all(|s| (s - s.round()).abs() < 0.05));
    let pairs = long.data.iter().zip(&short.data).filter(|(l, s)| **l < 0.99 && **s > 0.02);
    let ratios: Vec<f32> = pairs.map(|(l, s)| l / s).collect();
    let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
    assert!(ratios.len() > 20 && (mean / 8.0 - 1.0).abs() < 0.05, "{mean} of {}", ratios.len());
    let white = raw(&out.join("flat.exr"));
    assert!(white.data[0] < 0.82 && (white.data[3 * (16 * 32 + 16)] - 1.0).abs() < 0.01);
    let options = stack::Options::read(&out).unwrap();
    assert_eq!((options.white, options.response), ([1.0; 3], stack::Response::Linear));
    assert_eq!(options.colour_space, Some(SPACE));
}

#[test]
fn views_get_a_stack_each_and_near_lamps_their_places() {
    let out = scratch("views");
    let seen = ["--view", "0,0", "--view", "50,90", "--near", "1.5", "--lights", "3", "--shadows"];
    let cloth = ["simulate", "karaori", "--size", "32x32", "-o", &text(&out)];
    let report = good(&[&cloth[..], &seen].concat());
    assert_eq!((report["views"].as_u64(), report["files"].as_u64()), (Some(2), Some(6)));
    // From the side some texels hide behind others.
    assert!(report["hidden"].as_u64().unwrap() > 0);
    let list = std::fs::read_to_string(out.join("views.csv")).unwrap();
    assert!(list.lines().nth(2).unwrap().starts_with("view_02,50.000,90.000,"));
    let stack = load(&out.join("view_02"));
    let yugen_capture::Lights::Near(places) = &stack.lights else { panic!("near lamps became distant") };
    assert!(places.iter().all(|p| (p.length() - 1.5).abs() < 1e-5));
    assert!(stack.values.iter().any(|v| v[0].is_nan()));
}

#[test]
fn pairs_of_directions_are_photographed_eye_by_eye() {
    let out = scratch("pairs");
    let list = out.join("pairs.txt");
    std::fs::write(&list, "wi wo\n0 0 1  0 0 1\n1 0 1  0 1 1\n0.5 0 1  0 0 2\n").unwrap();
    let cloth = ["simulate", "kinran", "--size", "8x8", "--pairs", &text(&list), "-o", &text(&out)];
    let report = good(&cloth);
    assert_eq!((report["views"].as_u64(), report["pictures"].as_u64()), (Some(2), Some(3)));
    let overhead = load(&out.join("view_01"));
    let tilted = yugen_optics::Vec3::new(0.5, 0.0, 1.0).normalize();
    let yugen_capture::Lights::Distant(toward) = &overhead.lights else {
        panic!("distant light became near")
    };
    assert!(toward.len() == 2 && (toward[1] - tilted).length() < 1e-6);
    assert_eq!(load(&out.join("view_02")).lights.len(), 1);
    std::fs::write(&list, "0 0 1  0 0 1\n1 0 -1  0 1 1\n").unwrap();
    assert!(bad(&cloth).contains("the light of pair 2 is not above the sample"));
}

/// Where a texel sees the light and little else, a path tracer sees what the model says; in a shadow it sees what
/// bounces.
#[test]
fn the_renderer_agrees_and_adds_what_bounces() {
    let (direct, traced) = (scratch("direct"), scratch("traced"));
    let cloth = ["simulate", "karaori", "--size", "40x40", "--lights", "2", "-o"];
    good(&[&cloth[..], &[&text(&direct), "--shadows"]].concat());
    good(&[&cloth[..], &[&text(&traced), "--trace", "32"]].concat());
    for light in ["0001.exr", "0002.exr"] {
        let (a, b) = (raw(&direct.join(light)), raw(&traced.join(light)));
        let lit: Vec<f32> =
            a.data.iter().zip(&b.data).filter(|(a, _)| **a > 0.0).map(|(a, b)| b / a).collect();
        let mut sorted = lit.clone();
        sorted.sort_by(f32::total_cmp);
        let part = |p: usize| sorted[p * (sorted.len() - 1) / 100];
        // Nothing is lost, a quarter gains next to nothing, threads light each other by some percent.
        assert!((part(20) - 1.0).abs() < 1e-3 && (1.0..1.1).contains(&part(50)), "{} {}", part(20), part(50));
        let dark: Vec<f32> =
            a.data.iter().zip(&b.data).filter(|(a, _)| **a == 0.0).map(|(_, b)| *b).collect();
        assert!(dark.iter().filter(|b| **b > 0.0).count() * 2 > dark.len(), "{} dark", dark.len());
    }
}

/// A level sheet, on which nothing bounces, before a camera that stands near: the renderer's rays come from where the fit takes
/// the camera to be.
#[test]
fn the_renderer_stands_where_the_camera_does() {
    let maps = scratch("sheet");
    good(&["simulate", "karaori", "--size", "32x20", "--lights", "1", "-o", &text(&maps)]);
    let (direct, traced, far) = (scratch("sheet_near"), scratch("sheet_traced"), scratch("sheet_far"));
    let truth = text(&maps.join("truth.exr"));
    let sheet = ["simulate", &truth, "--lights", "3", "--view", "20,40", "-o"];
    good(&[&sheet[..], &[&text(&direct), "--camera-distance", "1.3"]].concat());
    good(&[&sheet[..], &[&text(&traced), "--camera-distance", "1.3", "--trace", "64"]].concat());
    good(&[&sheet[..], &[&text(&far)]].concat());
    let off = |a: &Path, b: &Path| {
        let (a, b) = (raw(&a.join("0002.exr")), raw(&b.join("0002.exr")));
        let lit = a.data.iter().zip(&b.data).filter(|(a, _)| **a > 0.01);
        let mut all: Vec<f32> = lit.map(|(a, b)| (b / a - 1.0).abs()).collect();
        all.sort_by(f32::total_cmp);
        [all[all.len() / 2], all[all.len() * 9 / 10]]
    };
    let [right, wrong] = [off(&direct, &traced), off(&direct, &far)];
    println!("{right:?} {wrong:?}");
    // Measured 4e-5 and 2.5e-4 (across a texel the direction turns by 1.4 degrees, which highlights average), and 3 % and 28 %.
    assert!(right[0] < 2e-4 && right[1] < 1e-3, "{right:?}");
    assert!(wrong[0] > 0.01 && wrong[1] > 0.1, "{wrong:?}");
    let refused = bad(&[&sheet[..], &[&text(&far), "--camera-distance", "0.1"]].concat());
    assert!(refused.contains("from 0.2"), "{refused}");
}

#[test]
fn mistakes_are_named() {
    let out = scratch("mistakes");
    let path = text(&out);
    let refused = |args: &[&str], want: &str| {
        let err = bad(args);
        assert!(err.contains(want), "{err}\nwant {want}");
    };
    refused(&["weave", "kinrann", "-o", &path], "did you mean 'kinran'?");
    refused(&["weave", "velvet", "-o", &path], "the presets are karaori and kinran");
    refused(&["weave", "missing.wif", "-o", &path], "missing.wif");
    refused(&["weave", "satin:8/4", "-o", &path], "there is no satin over 8 with the move 4");
    refused(&["weave", "kinran", "--figure", "f.png", "-o", &path], "--figure needs a named weave");
    let lie = out.join("lie.wif");
    std::fs::write(&lie, "[WIF]\n[WEAVING]\nShafts=2\n[WARP]\nThreads=99999999\n[WEFT]\nThreads=2\n")
        .unwrap();
    refused(&["weave", &text(&lie), "-o", &path], "lie.wif:5:1: 'THREADS' of [WARP] is 99999999");
    refused(&["simulate", "karaori", "--bits", "13", "-o", &path], "expected 8, 12 or 16");
    refused(&["simulate", "karaori", "--view", "95,0", "-o", &path], "polar angle below 90");
    refused(&["simulate", "karaori", "--scale", "0.01", "-o", &path], "raise --scale");
    let list = out.join("l.lp");
    std::fs::write(&list, "2\na.png 0 0 1\n").unwrap();
    refused(&["simulate", "karaori", "--lp", &text(&list), "-o", &path], "l.lp");
    let maps = out.join("maps");
    good(&["simulate", "karaori", "--size", "8x8", "--lights", "1", "-o", &text(&maps)]);
    let truth = text(&maps.join("truth.exr"));
    refused(&["simulate", &truth, "--shadows", "-o", &path], "name them with --heights");
    refused(&["simulate", &truth, "--size", "9x9", "-o", &path], "--size says how to weave");
    refused(&["simulate", &truth, "-o", &text(&maps)], "truth.exr: this is read, and would be lost");
    let other = scratch("other");
    good(&["simulate", "karaori", "--size", "9x8", "--lights", "1", "-o", &text(&other)]);
    let heights = text(&other.join("height.exr"));
    refused(
        &["simulate", &truth, "--shadows", "--heights", &heights, "-o", &path],
        "is 9 x 8, but the maps are 8 x 8",
    );
}
