//! `yugen simulate`.

use super::{good, refused, report, scratch, yugen_in};
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A level sheet of 0.6 m above a ball, with (u, v) from 0 to 1; the ball is a sphere of the scene.
pub(crate) fn scene(folder: &Path) {
    let n = 16;
    let mut text = String::from("o sheet\n");
    let at = |i: usize| i as f32 / n as f32;
    for j in 0..=n {
        for i in 0..=n {
            writeln!(text, "v {} 0.25 {}", 0.6 * (at(i) - 0.5), 0.6 * (at(j) - 0.5)).unwrap();
        }
    }
    for j in 0..=n {
        for i in 0..=n {
            writeln!(text, "vt {} {}", at(i), at(j)).unwrap();
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i + 1;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            writeln!(text, "f {a}/{a} {d}/{d} {b}/{b}\nf {b}/{b} {d}/{d} {c}/{c}").unwrap();
        }
    }
    std::fs::write(folder.join("sheet.obj"), text).unwrap();
    let scene = "[[shape]]\nname = \"cloth\"\ntype = \"file\"\nfile = \"sheet.obj\"\n\n[[shape]]\nname = \"ball\"\ntype = \"sphere\"\n\
                 radius = 0.2\n\n[[shape]]\nname = \"block\"\ntype = \"box\"\nsize = [0.1, 0.1, 0.1]\nat = [2, 0, 0]\n";
    std::fs::write(folder.join("a.toml"), scene).unwrap();
}

#[test]
fn a_sheet_falls_on_a_ball_and_is_written() {
    let folder = scratch("simulate");
    scene(&folder);
    let line = "simulate a.toml --cloth cloth --ground -0.2 --frames 30 --json -o a.pc2";
    let said = report(yugen_in(&folder, line));
    assert_eq!(
        (&said["vertices"], &said["bodies"], &said["crossings"]),
        (&289.into(), &2.into(), &0.into()),
        "{said}"
    );
    assert!((said["pattern"][0].as_f64().unwrap() - 0.6).abs() < 1e-3, "{said}");
    let bytes = std::fs::read(folder.join("a.pc2")).unwrap();
    assert_eq!(bytes.len(), 32 + 30 * 289 * 12);
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let y = |frame: usize, v: usize| number(32 + (frame * 289 + v) * 12 + 4);
    // It lies on the crown of the ball, and its corner hangs.
    assert_eq!(y(0, 144), 0.25);
    assert!((y(29, 144) - 0.2).abs() < 0.01 && y(29, 0) < 0.15, "{} {}", y(29, 144), y(29, 0));
    // The same on one thread, bit by bit; and as meshes, which are read again.
    good(yugen_in(&folder, "simulate a.toml --cloth cloth --ground -0.2 --frames 30 --threads 1 -o b.pc2"));
    assert!(std::fs::read(folder.join("b.pc2")).unwrap() == bytes);
    good(yugen_in(
        &folder,
        "simulate sheet.obj --pin -0.3,0.25,-0.3,0.01 --fabric hemp --frames 3 -o c_%02d.obj",
    ));
    assert!(good(yugen_in(&folder, "info c_02.obj")).contains("289"));
    // A rectangle is divided, and one that is no cloth is said to be in nobody's way.
    let scene = "[[shape]]\nname = \"sheet\"\ntype = \"rectangle\"\nsize = [0.4, 0.2]\nfacing = [0, 1, 0]\n\n\
                 [[shape]]\nname = \"floor\"\ntype = \"rectangle\"\nfacing = [0, 1, 0]\nat = [0, -1, 0]\n";
    std::fs::write(folder.join("r.toml"), scene).unwrap();
    // It may be pinned as a mesh may; and a checkpoint that none was wanted of is not this one's to remove.
    std::fs::write(folder.join("p.pc2.checkpoint"), "of another").unwrap();
    let pinned =
        "simulate r.toml --cloth sheet --pin -0.2,0,-0.1,0.01 --frames 2 --checkpoint 0 --json -o p.pc2";
    let run = yugen_in(&folder, pinned);
    assert!(run.success && run.out.contains("\"attached\":4"), "{} {}", run.out, run.err);
    assert_eq!(std::fs::read_to_string(folder.join("p.pc2.checkpoint")).unwrap(), "of another");
    let run = yugen_in(&folder, "simulate r.toml --cloth sheet --frames 2 --resume -o p.pc2");
    assert!(!run.success && run.err.contains("no checkpoint of a simulation"), "{}", run.err);
    let run = yugen_in(&folder, "simulate r.toml --cloth sheet --frames 2 --json -o r.pc2");
    assert!(run.success && run.err.contains("cloth passes through 'floor'"), "{}", run.err);
    assert!(run.out.contains(&format!("\"vertices\":{}", 65 * 33)), "{}", run.out);
}

#[test]
fn what_is_no_cloth_is_said_before_anything_is_written() {
    let folder = scratch("simulate-wrong");
    scene(&folder);
    let before = std::fs::read_dir(&folder).unwrap().count();
    for (line, words) in [
        ("simulate a.toml -o a.pc2", &["which shapes are cloth", "--cloth"][..]),
        ("simulate a.toml --cloth clth -o a.pc2", &["no mesh or rectangle of a.toml", "'clth'"]),
        ("simulate a.toml --cloth cloth -o a.fbx", &["written as .abc, .pc2 or"]),
        ("simulate a.toml --garment kosode -o a.abc", &["nobody in a.toml could wear a garment"]),
        ("simulate a.toml --garment kosode --cloth cloth -o a.abc", &["--garment", "--cloth"]),
        ("simulate a.toml --cloth cloth -o a.obj", &["needs a number in its name"]),
        ("simulate a.toml --cloth cloth --fabric sil -o a.pc2", &["silk"]),
        ("simulate a.toml --cloth cloth --set mass=1 -o a.pc2", &["no quantity 'mass'"]),
        (
            "simulate a.toml --cloth cloth --set areal_mass=0 -o a.pc2",
            &["areal_mass of a fabric is 0", "0.005"],
        ),
        (
            "simulate a.toml --cloth cloth --pin 9,9,9,0.1 -o a.pc2",
            &["no vertex of the cloth lies within a --pin"],
        ),
        ("simulate a.toml --cloth cloth --animation Walk -o a.pc2", &["no animation called 'Walk'"]),
        ("simulate a.toml --cloth cloth --frames 0 -o a.pc2", &["--frames"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), before);
}

/// A dance of another tool: a skeleton with other names, in centimetres, turned away and elsewhere.
fn dance(folder: &Path) {
    std::fs::write(folder.join("list.txt"), "turn degrees=100 seconds=.4\nhakobi steps=1 seconds=.5\n")
        .unwrap();
    good(yugen_in(folder, "motion dance list.txt -o own.bvh --rate 60"));
    let text = std::fs::read_to_string(folder.join("own.bvh")).unwrap();
    let names = [
        ("upper_arm", "Arm"),
        ("forearm", "ForeArm"),
        ("hand", "Hand"),
        ("thigh", "UpLeg"),
        ("shank", "Leg"),
        ("foot", "Foot"),
    ];
    let mut text = text.replace("JOINT head", "JOINT mixamorig:Head");
    for (side, other) in [("left_", "mixamorig:Left"), ("right_", "mixamorig:Right")] {
        for (name, theirs) in names {
            text = text.replace(&format!("JOINT {side}{name}\n"), &format!("JOINT {other}{theirs}\n"));
        }
    }
    std::fs::write(folder.join("dance.bvh"), text).unwrap();
}

#[test]
fn a_figure_of_another_make_dances_in_a_garment() {
    let folder = scratch("simulate-garment");
    dance(&folder);
    let garment = "simulate dance.bvh --garment kosode --edge 45 --substeps 24 --frames 33 --fabric karaori";
    let said = report(yugen_in(&folder, &format!("{garment} --json -o a.pc2")));
    let number = |name: &str| said[name].as_f64().unwrap();
    assert!((number("wearer") - 1.0).abs() < 0.1 && number("bodies") == 25.0, "{said}");
    assert!(number("held") > 20.0 && number("crossings") <= 8.0, "{said}");
    let bytes = std::fs::read(folder.join("a.pc2")).unwrap();
    let count = u32::from_le_bytes(bytes[16..20].try_into().unwrap()) as usize;
    let points: Vec<f32> =
        bytes[32..].chunks_exact(4).map(|w| f32::from_le_bytes(w.try_into().unwrap())).collect();
    assert_eq!(points.len(), 33 * count * 3);
    let bounds = |k: usize| {
        let last = points[32 * count * 3..].chunks_exact(3).map(|p| p[k]);
        [last.clone().fold(f32::INFINITY, f32::min), last.fold(f32::NEG_INFINITY, f32::max)]
    };
    // On the shoulders, above the floor, about the player.
    let [low, high] = bounds(1);
    assert!((0.0..0.3).contains(&low) && (1.3..1.65).contains(&high), "{low} {high}");
    assert!(bounds(0).iter().chain(&bounds(2)).all(|v| v.abs() < 1.2));
    // The mesh beside it is of those vertices, and the same comes as Alembic.
    assert!(good(yugen_in(&folder, "info a.obj")).contains(&count.to_string()));
    good(yugen_in(&folder, &format!("{garment} --threads 1 -o a.abc")));
    let abc = std::fs::read(folder.join("a.abc")).unwrap();
    assert!(abc.starts_with(b"Ogawa\xff"));
    let last = &bytes[bytes.len() - 12 * count..];
    assert!(abc.windows(last.len()).any(|w| w == last), "the last frame is another one");
    // A scene takes both.
    let scene = "[[shape]]\ntype = \"file\"\nfile = \"a.obj\"\ncache = { file = \"a.pc2\", fps = 60, space = \"world\" }\n";
    std::fs::write(folder.join("s.toml"), scene).unwrap();
    assert!(good(yugen_in(&folder, "info s.toml")).contains("cache"));
    // Two garments, the inner one first, are two objects of one cloth.
    std::fs::write(folder.join("two.txt"), "okuchi hemp   # below\nchoken length=1.1\n").unwrap();
    let both = "simulate dance.bvh --garment two.txt --edge 60 --substeps 12 --frames 2 --json -o two.pc2";
    let run = yugen_in(&folder, both);
    assert!(run.success && run.out.contains("\"garment\":\"okuchi choken\""), "{} {}", run.out, run.err);
    let text = std::fs::read_to_string(folder.join("two.obj")).unwrap();
    assert!(text.contains("\no okuchi\n") && text.contains("\no choken\n"));
    for (line, words) in [
        ("simulate dance.bvh --garment yukata -o b.abc", &["'yukata' is no cut"][..]),
        ("simulate dance.bvh --garment kosode --joint left_hand=hook -o b.abc", &["no joint called 'hook'"]),
        ("simulate dance.bvh --garment kosode --joint hook -o b.abc", &["PART=JOINT"]),
        ("simulate dance.bvh --garment kosode --animation x -o b.abc", &["no animation called 'x'"]),
        ("simulate own.bvh --garment kosode --girth 3 -o b.abc", &["deep from front to back"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
}

/// Stops a simulation with these options, goes on with it, and compares it with one that goes through for `more` frames after the stop.
#[cfg(unix)]
fn stops_and_goes_on(name: &str, options: &str, more: u32) {
    let folder = scratch(name);
    scene(&folder);
    let line = format!("simulate a.toml --cloth cloth --ground -0.2 --fabric hemp {options}");
    let checkpoint = folder.join("b.pc2.checkpoint");
    let words = format!("{line} --frames 100000 --checkpoint 0.01 -o b.pc2");
    let child = Command::new(env!("CARGO_BIN_EXE_yugen"))
        .current_dir(&folder)
        .args(words.split(' '))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !checkpoint.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let out = child.wait_with_output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert_eq!(out.status.code(), Some(130), "{said}");
    assert!(
        said.contains("goes on from frame") && said.contains("--resume") && !folder.join("b.pc2").exists(),
        "{said}"
    );
    let done = u32::from_le_bytes(std::fs::read(&checkpoint).unwrap()[20..24].try_into().unwrap());
    assert!(done % 30 == 1, "{done}");
    // Neither lost unasked nor taken for another.
    refused(yugen_in(&folder, &format!("{line} -o b.pc2")), &["has not ended", "--resume"]);
    refused(yugen_in(&folder, &format!("{line} --wind 1,0,0 --resume -o b.pc2")), &["of another simulation"]);
    let frames = done + more;
    good(yugen_in(&folder, &format!("{line} --frames {frames} --resume --threads 1 -o b.pc2")));
    assert!(!checkpoint.exists());
    good(yugen_in(&folder, &format!("{line} --frames {frames} --checkpoint 0 -o c.pc2")));
    assert!(std::fs::read(folder.join("b.pc2")).unwrap() == std::fs::read(folder.join("c.pc2")).unwrap());
}

#[test]
#[cfg(unix)]
fn a_simulation_that_was_stopped_goes_on_to_the_same_bits() {
    stops_and_goes_on("simulate-resume", "--substeps 20", 75);
}

#[test]
#[cfg(unix)]
fn so_does_one_on_the_gpu() {
    if yugen_realtime::Gpu::for_tests().is_some() {
        stops_and_goes_on("simulate-resume-gpu", "--gpu --substeps 8", 35);
    }
}

#[test]
fn a_sheet_falls_on_a_ball_on_the_gpu() {
    if yugen_realtime::Gpu::for_tests().is_none() {
        return;
    }
    let folder = scratch("simulate-gpu");
    scene(&folder);
    let said = report(yugen_in(
        &folder,
        "simulate a.toml --cloth cloth --ground -0.2 --frames 30 --gpu --substeps 8 --json -o a.pc2",
    ));
    assert_eq!((&said["bodies"], &said["crossings"]), (&2.into(), &0.into()), "{said}");
    let bytes = std::fs::read(folder.join("a.pc2")).unwrap();
    let y = |v: usize| f32::from_le_bytes(bytes[32 + (29 * 289 + v) * 12 + 4..][..4].try_into().unwrap());
    assert!((y(144) - 0.2).abs() < 0.01 && y(0) < 0.15, "{} {}", y(144), y(0));
}
