//! `yugen simulate`.

use super::{good, refused, report, scratch, yugen_in};
use std::fmt::Write;
use std::path::Path;

/// A level sheet of 0.6 m above a ball, with (u, v) from 0 to 1; the ball is a sphere of the scene.
fn scene(folder: &Path) {
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
        ("simulate a.toml --cloth cloth -o a.abc", &["written as .pc2 or"]),
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
