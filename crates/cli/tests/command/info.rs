//! `yugen info` from outside.

use crate::{good, refused, report, scratch, yugen_in};
use serde_json::{Value, json};
use std::path::Path;
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_optics::{ColourSpace, Image};

fn info(folder: &Path, file: &str) -> Value {
    report(yugen_in(folder, &format!("info {file} --json")))
}

#[test]
fn scenes_tell_what_is_in_them() {
    let folder = scratch("info/scenes");
    let mut picture = Image::rgb(6, 3);
    picture.data.fill(0.25);
    image::write(&folder.join("t.png"), &picture, &WriteOptions::default()).unwrap();
    std::fs::write(
        folder.join("s.toml"),
        "[film]\nsize = [320, 200]\n[render]\nsamples = 32\nmax_depth = 7\n\
         [camera]\nname = \"front\"\nfrom = [0, 0, 4]\nto = [0, 0, 0]\nfov = 35\n\
         [material.a]\nmodel = \"lambert\"\nreflectance = { image = \"t.png\" }\n\
         [[light]]\ntype = \"point\"\nat = [0, 2, 0]\nintensity = 3\n\
         [[light]]\ntype = \"environment\"\nimage = \"t.png\"\n\
         [[shape]]\ntype = \"sphere\"\nradius = 0.5\nat = [1, 0, 0]\nmaterial = \"a\"\n\
         [[shape]]\ntype = \"rectangle\"\nsize = [2, 2]\nemission = 1\n",
    )
    .unwrap();
    let told = info(&folder, "s.toml");
    assert_eq!((&told["kind"], &told["format"]), (&json!("scene"), &json!("Yugen TOML")));
    assert_eq!(told["bounds"]["low"], json!([-1.0, -1.0, -0.5]));
    assert_eq!(told["bounds"]["size"], json!([2.5, 2.0, 1.0]));
    assert_eq!((&told["geometry"]["shapes"], &told["geometry"]["spheres"]), (&json!(2), &json!(1)));
    let camera = &told["cameras"][0];
    assert_eq!(
        (&camera["name"], &camera["size"], &camera["samples"]),
        (&json!("front"), &json!([320, 200]), &json!(32))
    );
    assert_eq!((&camera["field_of_view_degrees"], &camera["at"]), (&json!(35.0), &json!([0.0, 0.0, 4.0])));
    assert_eq!(
        (&told["lights"][0]["type"], &told["lights"][1]["type"]),
        (&json!("point"), &json!("environment"))
    );
    assert_eq!(told["shapes_that_shine"], 1);
    assert_eq!(told["materials"]["lambert"].as_u64().map(|n| n > 0), Some(true));
    assert_eq!(told["textures"][0]["size"], json!([6, 3]));
    assert_eq!(told["textures"][0]["bytes"], 6 * 3 * 3 * 4);
    assert_eq!((&told["integrator"]["kind"], &told["integrator"]["max_depth"]), (&json!("path"), &json!(7)));
    // People read the same.
    let text = good(yugen_in(&folder, "info s.toml"));
    for line in
        ["kind: scene\n", "cameras: 1\n  name front, size 320 200, samples 32", "shapes that shine: 1\n"]
    {
        assert!(text.contains(line), "{line}: {text}");
    }

    let times: Vec<u8> = [0.5f32, 2.0].iter().chain(&[0.0; 6]).flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("a.bin"), times).unwrap();
    std::fs::write(
        folder.join("a.gltf"),
        r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0, "name": "n" }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 2 } }] }],
        "animations": [{ "name": "swing", "samplers": [{ "input": 0, "output": 1 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 8 }, { "buffer": 0, "byteOffset": 8, "byteLength": 24 },
            { "buffer": 1, "byteLength": 36 }],
        "buffers": [{ "uri": "a.bin", "byteLength": 32 }, { "uri": "b.bin", "byteLength": 36 }] }"#,
    )
    .unwrap();
    let corners = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    std::fs::write(folder.join("b.bin"), corners.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
        .unwrap();
    let told = info(&folder, "a.gltf");
    assert_eq!(told["animations"], json!([{ "name": "swing", "from_seconds": 0.5, "to_seconds": 2.0 }]));
    assert_eq!(told["geometry"]["triangles"], 1);
}

#[test]
fn pictures_tell_channels_colours_and_metadata() {
    let folder = scratch("info/pictures");
    let mut picture = Image::new(4, 2, &["R", "G", "B", "Z"]);
    picture.data = (0..32).map(|i| i as f32 * 0.01).collect();
    picture.data[0] = -0.5;
    picture.data[1] = f32::NAN;
    let options = WriteOptions {
        metadata: vec![("who".into(), "a test".into())],
        non_finite: image::NonFinite::Keep,
        ..WriteOptions::from(ColourSpace::LinearRec2020)
    };
    image::write(&folder.join("a.exr"), &picture, &options).unwrap();
    let told = info(&folder, "a.exr");
    assert_eq!(
        (&told["kind"], &told["format"], &told["size"]),
        (&json!("picture"), &json!("OpenEXR"), &json!([4, 2]))
    );
    assert_eq!(told["colour_space"], "rec2020");
    let channel =
        |name: &str| told["channels"].as_array().unwrap().iter().find(|c| c["name"] == name).unwrap().clone();
    assert_eq!((&channel("R")["negative"], &channel("R")["least"]), (&json!(1), &json!(-0.5)));
    assert_eq!((&channel("G")["not_finite"], &channel("Z")["most"]), (&json!(1), &json!(0.31)));
    let metadata = told["metadata"].as_array().unwrap();
    assert!(metadata.contains(&json!({ "name": "who", "value": "a test" })), "{metadata:?}");
    assert!(metadata.iter().any(|m| m["name"] == "samples" && m["value"] == "f32"), "{metadata:?}");

    let grey = Image { data: vec![0.5; 8], ..Image::new(4, 2, &["Y"]) };
    image::write(&folder.join("a.png"), &grey, &WriteOptions { bits: 16, ..WriteOptions::default() })
        .unwrap();
    let told = info(&folder, "a.png");
    assert_eq!((&told["format"], &told["bits"]), (&json!("PNG"), &json!(16)));
    assert!((told["channels"][0]["mean"].as_f64().unwrap() - 0.5).abs() < 1e-4);

    std::fs::write(folder.join("b.nef"), "II*\0\x08\0\0\0\0\0").unwrap();
    refused(yugen_in(&folder, "info b.nef"), &["b.nef: this is a camera's raw file"]);
    std::fs::write(folder.join("b.jpg"), "").unwrap();
    refused(yugen_in(&folder, "info b.jpg"), &["the file is empty"]);
    std::fs::write(folder.join("b.tmol"), "x").unwrap();
    refused(yugen_in(&folder, "info b.tmol"), &["no picture of a known format", "did you mean .toml?"]);
    refused(yugen_in(&folder, "info nothing.exr"), &["nothing of this name"]);
}

#[test]
fn stacks_tables_and_weaves_tell_theirs() {
    let folder = scratch("info/rest");
    for line in [
        "capture weave karaori --size 16x12 -o woven",
        "capture simulate karaori --size 16x12 --lights 12 -o stack",
        "capture simulate karaori --size 8x8 --lights 3 --view 0,0 --view 30,0 -o sides",
        "capture simulate karaori --size 8x8 --lights 3 --exposures 2 -o night",
        "capture rti stack -o a.ptm --basis ptm",
        "capture rti stack -o a.rti --basis hsh4",
        "capture rti stack -o web --lrgb --basis ptm",
        "brdf convert lambert a.gonio --step 30",
        "brdf convert lambert a.bsdf --step 30",
        "brdf convert lambert a.binary",
    ] {
        let run = yugen_in(&folder, line);
        assert!(run.success, "{line}: {}", run.err);
    }
    std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 2 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n").unwrap();
    std::fs::write(folder.join("r.csv"), "0 0 1 0 0 1 1 1 1\n").unwrap();
    std::fs::write(folder.join("gold.f32"), vec![0; 4 * 675]).unwrap();
    std::fs::write(folder.join("gold.names.txt"), "gold\n").unwrap();
    std::fs::remove_file(folder.join("night/lights.lp")).unwrap();
    for (file, name, value) in [
        ("woven/draft.wif", "kind", json!("weaving draft")),
        ("woven/cloth.btf", "kind", json!("maps of a cloth")),
        ("woven/cloth.btf", "size", json!([16, 12])),
        ("stack/truth.exr", "kind", json!("maps of a cloth")),
        ("stack/truth.exr", "format", json!("OpenEXR")),
        ("stack", "pictures", json!(12)),
        ("stack/lights.lp", "pictures", json!(12)),
        ("stack", "size", json!([16, 12])),
        ("stack", "colour_space", json!("rec2020")),
        ("sides", "kind", json!("stacks of the same cloth from several sides")),
        ("night", "kind", json!("photographs without a list of lights")),
        ("night", "list_of_exposures", json!(true)),
        ("night/exposures.csv", "kind", json!("list of exposures")),
        ("a.ptm", "basis", json!("PTM")),
        ("a.rti", "basis", json!("HSH 4")),
        ("web", "colouring", json!("lrgb")),
        ("a.gonio", "model", json!("tabulated")),
        ("a.gonio", "isotropic", json!(true)),
        ("a.bsdf", "format", json!("RGL")),
        ("a.binary", "bins", json!(90 * 90 * 180)),
        ("a.obj", "triangles", json!(1)),
        ("a.obj", "parts", json!([{ "material": "red", "triangles": 1 }])),
        ("r.csv", "with_values", json!(1)),
        ("gold.f32", "names", json!(["gold"])),
    ] {
        let told = info(&folder, file);
        assert_eq!(told[name], value, "{file}: {told}");
    }
    let lights = &info(&folder, "stack")["lights"];
    assert_eq!((&lights["count"], &lights["near"]), (&json!(12), &json!(false)));
    assert!(lights["polar_degrees"][1].as_f64().unwrap() <= 75.1, "{lights}");
}
