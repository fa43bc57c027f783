//! `yugen motion`, and motion as scenes.

use super::*;

const BVH: &str = "HIERARCHY\nROOT hips\n{\nOFFSET 0 90 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
    JOINT left_arm\n{\nOFFSET 10 40 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 50 0 0\n}\n}\n\
    JOINT head\n{\nOFFSET 0 60 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 20 0\n}\n}\n}\n\
    MOTION\nFrames: 3\nFrame Time: 0.0416667\n0 90 0 0 0 0 0 0 0 0 0 0\n5 90 0 0 0 30 45 0 0 0 0 0\n10 90 0 0 0 60 90 0 0 0 0 0\n";

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("yugen-motion-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("dance.bvh"), BVH).unwrap();
    folder
}

#[test]
fn info_says_what_a_file_holds_and_what_was_guessed() {
    let at = folder("info");
    let told = report(yugen_in(&at, "motion info dance.bvh --json"));
    assert_eq!(told["format"], "Biovision BVH");
    assert_eq!((told["frames"].as_u64(), told["rate"].as_f64()), (Some(3), Some(24.0)));
    assert_eq!(told["unit"]["length"], "cm");
    assert_eq!(told["unit"]["basis"], "guessed from the size");
    assert_eq!(told["joints"].as_array().unwrap().len(), 5);
    let text = good(yugen_in(&at, "motion info dance.bvh"));
    assert!(text.contains("joints: 5") && text.contains("left_arm"), "{text}");
    // The general verb says the same.
    let general = report(yugen_in(&at, "info dance.bvh --json"));
    assert_eq!(general["joints"], told["joints"]);
    refused(yugen_in(&at, "motion info dance.bvx"), &["dance.bvx"]);
    refused(yugen_in(&at, "motion info dance.bvh --unit furlong"), &["expected m, cm, mm, in or ft"]);
    std::fs::remove_dir_all(&at).unwrap();
}

#[test]
fn convert_asks_for_what_is_not_said_and_loses_nothing() {
    let at = folder("convert");
    refused(
        yugen_in(&at, "motion convert dance.bvh -o dance.glb"),
        &["does not say its unit of length: give --unit", "as in cm"],
    );
    for file in ["dance.glb", "dance.csv", "dance.c3d", "again.bvh"] {
        let done = report(yugen_in(&at, &format!("motion convert dance.bvh --unit cm -o {file} --json")));
        assert_eq!(done["frames"], 3, "{file}");
        let told = report(yugen_in(&at, &format!("motion info {file} --json")));
        let bounds = |told: &Value| told["bounds_of_the_first_frame"]["high"][1].as_f64().unwrap();
        assert!((bounds(&told) - 1.7).abs() < 1e-5, "{file}: {told}");
    }
    // From bodies there is no way back to joints.
    refused(yugen_in(&at, "motion convert dance.csv -o x.bvh"), &["joints that carry one another"]);
    refused(yugen_in(&at, "motion convert dance.bvh --unit cm -o x.fbx"), &["unknown extension", "'fbx'"]);
    refused(
        yugen_in(&at, "motion convert dance.bvh --unit cm -o dance.bvh"),
        &["this is read, and would be lost"],
    );
    assert!(!at.join("x.bvh").exists() && !at.join("x.fbx").exists());
    std::fs::remove_dir_all(&at).unwrap();
}

#[test]
fn motion_is_seen_as_sticks() {
    let at = folder("sticks");
    let done = report(yugen_in(&at, "render dance.bvh -o a.png --size 80x60 --spp 1 --at 0.04 --json"));
    assert!(done.is_object() && at.join("a.png").exists());
    good(yugen_in(
        &at,
        "motion preview dance.bvh -o film.apng --size 64x48 --spp 1 --by reference --camera front --json",
    ));
    let film = std::fs::read(at.join("film.apng")).unwrap();
    let chunk = film.windows(4).position(|w| w == b"acTL").unwrap();
    assert_eq!(film[chunk + 4..chunk + 8], [0, 0, 0, 3], "three frames");
    refused(yugen_in(&at, "motion preview dance.bvh -o film.apng --size 64"), &["--size"]);
    std::fs::remove_dir_all(&at).unwrap();
}

const LIST: &str = "kamae seconds=2\nhakobi steps=4 degrees=90\nsashikomi\nhiraki\nturn degrees=120\nsleeve side=left\nkamae\n";

#[test]
fn a_dance_is_measured_and_solved_again() {
    let at = folder("dance");
    std::fs::write(at.join("list.txt"), LIST).unwrap();
    let listed = good(yugen_in(&at, "motion dance --list"));
    assert!(
        listed.contains("hiraki: goes back while the arms open") && listed.contains("steps=4"),
        "{listed}"
    );
    let made = report(yugen_in(&at, "motion dance list.txt -o truth.bvh --json"));
    assert_eq!(made["units"], 7);
    for file in ["bodies.csv", "bodies.c3d"] {
        let line = format!("motion dance list.txt -o {file} --noise 0.5,0.3 --gaps 10 --seed 4 --json");
        let measured = report(yugen_in(&at, &line));
        assert_eq!(measured["frames"], made["frames"]);
        let solved = report(yugen_in(&at, &format!("motion solve {file} -o solved.bvh --json")));
        let bodies = solved["bodies"].as_array().unwrap();
        assert_eq!(bodies.len(), 19);
        assert!(bodies.iter().any(|b| b["filled_frames"].as_u64() > Some(0)));
        let thigh = bodies.iter().find(|b| b["name"] == "left_shank").unwrap();
        let length = thigh["bone"].as_f64().unwrap();
        assert!((length - 0.42).abs() < 0.005, "{length}");
        let told = report(yugen_in(&at, "motion info solved.bvh --unit cm --json"));
        assert_eq!((&told["frames"], told["rate"].as_f64()), (&made["frames"], Some(120.0)));
    }
    std::fs::write(at.join("tree.txt"), "pelvis\nchest pelvis\n").unwrap();
    refused(
        yugen_in(&at, "motion solve bodies.csv -o x.bvh --tree tree.txt"),
        &["what carries the bodies", "left_hand"],
    );
    refused(yugen_in(&at, "motion solve dance.bvh -o x.bvh"), &["give --unit"]);
    std::fs::write(at.join("bad.txt"), "kamae\nhakoby\n").unwrap();
    refused(yugen_in(&at, "motion dance bad.txt -o x.bvh"), &["bad.txt:2:1: 'hakoby' is no unit of form"]);
    assert!(!at.join("x.bvh").exists());
    std::fs::remove_dir_all(&at).unwrap();
}
