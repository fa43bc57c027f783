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
    ] {
        refused(yugen_in(&folder, line), words);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
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
