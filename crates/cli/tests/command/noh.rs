//! `yugen noh`.

use super::{good, refused, report, scratch, yugen, yugen_in};
use serde_json::Value;
use std::path::PathBuf;

/// The page is what the tables say; `BLESS=1` writes it anew.
#[test]
fn the_page_of_the_stage_is_up_to_date() {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/stage.md");
    let page = good(yugen(&["noh", "stage"], &["--markdown"]));
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&file, &page).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(written == page, "docs/stage.md is not what the tables say; BLESS=1 writes it anew");
}

#[test]
fn the_table_is_told_to_people_and_programs() {
    let said = good(yugen_in(".".as_ref(), "noh stage --preset yoyogi --list"));
    assert!(said.contains("代々木能舞台") && said.contains("bunka.nii 187633"), "{said}");
    let table = report(yugen_in(".".as_ref(), "noh stage --preset yoyogi --set side=5.7 --json"));
    let row =
        |key: &str| table["dimensions"].as_array().unwrap().iter().find(|r| r["key"] == key).unwrap().clone();
    assert_eq!(
        (&row("bridge_width")["value"], &row("bridge_width")["basis"]),
        (&1.9.into(), &"measured".into())
    );
    assert_eq!((&row("width")["value"], &row("width")["basis"]), (&5.7.into(), &"assumed".into()));
}

#[test]
fn what_is_wrong_is_said_before_anything_is_written() {
    let folder = scratch("noh-wrong");
    for (line, words) in [
        ("noh stage", &["--output"][..]),
        (
            "noh stage --preset nationel -o a.toml",
            &["no stage called 'nationel'", "did you mean 'national'?"],
        ),
        ("noh stage --set sid=5 -o a.toml", &["no dimension 'sid'"]),
        ("noh stage --set side=50 -o a.toml", &["width = 50 is out of range", "5 to 6.2 m"]),
        ("noh stage --set side -o a.toml", &["KEY=VALUE"]),
        ("noh stage --set curtain_height=3.1 -o a.toml", &["does not hang under beams"]),
        ("noh stage -o a.obj", &["a.obj: a stage is written as .toml or .glb"]),
        ("noh stage -o none/a.toml", &["none/a.toml"]),
        ("noh stage --hour noon -o a.toml", &["night, dusk"]),
        ("noh stage --robe none.btf -o a.toml", &["none.btf"]),
        ("noh stage --robe none.btf:wide -o a.toml", &["--robe none.btf:wide", "FILE[:MM]", "cloth.btf:30"]),
        ("noh stage --robe none.btf -o a.glb", &["glTF has no maps of a cloth", ".toml"]),
        ("noh stage --form ggx -o a.toml", &["--robe"]),
        (
            "noh stage --set robe_half_span=0.84 -o a.toml",
            &["needs cloth 0.444 m wide", "robe_loom is 0.38 m"],
        ),
        (
            "noh stage --set robe_sleeve=0.75 --set robe_length=1.2 -o a.toml",
            &["a sleeve of robe_sleeve = 0.75 m"],
        ),
        ("noh stage --set rack_height=1.4 -o a.toml", &["lies on the floor"]),
        ("noh stage --set rack_width=1.3 -o a.toml", &["does not fit between posts"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

/// The cloth of a robe is written with the scene, of the size that was given, and read again.
#[test]
fn a_robe_hangs_on_the_stage() {
    let folder = scratch("noh-robe");
    good(yugen_in(&folder, "capture weave kinran --size 32x32 -o kinran"));
    let made =
        report(yugen_in(&folder, "noh stage --robe kinran/cloth.btf:8 --form blinn_phong --json -o a.toml"));
    let parts = made["parts"].as_array().unwrap();
    let of = |id: &str| parts.iter().find(|p| p["id"] == id).unwrap_or_else(|| panic!("no {id}"));
    assert_eq!(
        (&of("sode-hidari")["material"], &of("sode-hidari")["ja"]),
        (&"cloth".into(), &"唐織袖（左）".into())
    );
    assert_eq!((&of("iko")["material"], &of("uraji")["material"]), (&"lacquer".into(), &"lining".into()));
    for name in ["robe", "robe_near", "thread"] {
        assert!(made["cameras"].as_array().unwrap().contains(&name.into()), "{name}");
    }
    // What stands there, and that the maps repeat `scale` times in a metre.
    let written = |file: &str, words: &str, scale: f32| {
        let text = std::fs::read_to_string(folder.join(file)).unwrap();
        let (_, after) = text.split_once(words).unwrap_or_else(|| panic!("{file}: no {words}"));
        let line = after.lines().find_map(|l| l.strip_prefix("scale = [")).unwrap();
        let read: Vec<f32> = line.trim_end_matches(']').split(", ").map(|v| v.parse().unwrap()).collect();
        assert!(read.len() == 2 && read.iter().all(|v| (v / scale - 1.0).abs() < 1e-5), "{file}: {line}");
    };
    written("a.toml", "btf = \"a/cloth.btf\"\nform = \"blinn_phong\"\n", 125.0);
    // Without a number, the width that the file has: 2 mm.
    good(yugen_in(&folder, "noh stage --robe kinran/cloth.btf -o b.toml"));
    written("b.toml", "btf = \"b/cloth.btf\"\nform = \"ward_gmd\"\n", 500.0);
    good(yugen_in(&folder, "info a.toml"));
    refused(
        yugen_in(&folder, "noh stage --robe kinran/cloth.btf --form blin -o c.toml"),
        &["no form 'blin'", "blinn_phong"],
    );
    refused(
        yugen_in(&folder, "noh stage --robe kinran/cloth.btf:0 -o c.toml"),
        &["0 mm wide", "0.1 to 10000 mm"],
    );
    assert!(!folder.join("c.toml").exists());
}

/// Both files are read by our own reader, with every part by its name; a picture of one is not black.
#[test]
fn a_stage_is_built_read_and_rendered() {
    let folder = scratch("noh-stage");
    let made = report(yugen_in(&folder, "noh stage --preset honganji --hour dusk --json -o a.toml"));
    let parts: Vec<&str> =
        made["parts"].as_array().unwrap().iter().map(|p| p["id"].as_str().unwrap()).collect();
    for name in ["shite-bashira", "metsuke-bashira", "waki-bashira", "fue-bashira", "koken-bashira"] {
        assert!(parts.contains(&name), "{parts:?}");
    }
    assert_eq!(made["fires"].as_array().unwrap().len(), 4);
    good(yugen_in(&folder, "noh stage --preset honganji --fires points -o a.glb"));
    let bytes = std::fs::read(folder.join("a.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let root: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    for id in &parts {
        let node = root["nodes"].as_array().unwrap().iter().find(|n| n["name"] == *id).unwrap();
        let extras = &node["extras"];
        assert!(
            ["ja", "romaji", "en", "basis"].iter().all(|k| extras[k].as_str().is_some_and(|v| !v.is_empty()))
        );
    }
    for file in ["a.toml", "a.glb"] {
        let info = good(yugen_in(&folder, &format!("info {file}")));
        assert!(info.contains("waki-shomen"), "{info}");
        let render =
            format!("render {file} --camera shomen --size 48x27 --spp 2 --exposure -4 -o {file}.png");
        assert!(yugen_in(&folder, &render).success);
        let mut picture = png::Decoder::new(std::io::BufReader::new(
            std::fs::File::open(folder.join(format!("{file}.png"))).unwrap(),
        ))
        .read_info()
        .unwrap();
        let mut pixels = vec![0; picture.output_buffer_size().unwrap()];
        picture.next_frame(&mut pixels).unwrap();
        let mean = pixels.iter().map(|v| f32::from(*v)).sum::<f32>() / pixels.len() as f32;
        assert!(mean > 15.0 && mean < 240.0, "{file}: {mean}");
    }
}

/// A player dances on the stage in a robe that follows: the scene is read again, and its joints, its cache and its fires move.
#[test]
fn a_performance_is_made_and_played() {
    let folder = scratch("noh-performance");
    std::fs::write(folder.join("short.txt"), "kamae seconds=.2 # stands\nsashikomi steps=1 seconds=.3\n")
        .unwrap();
    let made = report(yugen_in(&folder, "noh performance --dance short.txt --edge 60 --json -o a.toml"));
    let player: Vec<&str> =
        made["player"].as_array().unwrap().iter().map(|p| p["id"].as_str().unwrap()).collect();
    assert!(["omote", "katsura", "ogi", "tabi-hidari"].iter().all(|id| player.contains(id)), "{player:?}");
    let text = std::fs::read_to_string(folder.join("a.toml")).unwrap();
    for words in
        ["joint = \"head\"", "cache = { file = \"a/robe.pc2\", fps = 30", "back = \"lining\"", "width = 3.8"]
    {
        assert!(text.contains(words), "{words}");
    }
    let info = report(yugen_in(&folder, "info a.toml --json"));
    let moves = info["animations"].as_array().map(Vec::len);
    assert!(moves == Some(1), "{info}");
    let picture = |at: f32, name: &str| {
        let line = format!(
            "render a.toml --camera front --at {at} --size 40x30 --spp 2 --exposure -4 -o {name}.png"
        );
        assert!(yugen_in(&folder, &line).success);
        std::fs::read(folder.join(format!("{name}.png"))).unwrap()
    };
    assert_ne!(picture(0.0, "first"), picture(0.5, "last"));
    let bare = report(yugen_in(
        &folder,
        "noh performance --dance short.txt --garment none --mask hannya --json -o b.toml",
    ));
    assert_eq!(bare["frames"], made["frames"]);
    assert!(bare["player"].as_array().unwrap().iter().any(|p| p["id"] == "tsuno"), "a demon has horns");
    for (line, words) in [
        ("noh performance -o b.glb", &["b.glb: a performance is written as .toml"][..]),
        ("noh performance --garment kosoda -o c.toml", &["kosoda", "kosode"]),
        ("noh performance --dance none.txt -o c.toml", &["none.txt"]),
        ("noh performance --dance a.toml -o c.toml", &["a.toml"]),
        ("noh performance --edge 1 -o c.toml", &["millimetres from 5 to 60"]),
        ("noh performance --fabric lead -o c.toml", &["karaori"]),
        ("noh performance --preset nationel -o c.toml", &["did you mean 'national'"]),
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert!(!folder.join("c.toml").exists());
}
