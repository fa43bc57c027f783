//! glTF. Quads that face +z before a camera that looks along −z at a square two units wide, so that what is seen is
//! known in closed form; a dielectric of `specularFactor` 0 is Lambert's.

use crate::{Case, Right, check};
use serde_json::{Value, json};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::Image;

/// Four corners, half a side from the centre, with (u, v) from 0 to `uv` and v down, and a material.
struct Quad {
    half: f32,
    z: f32,
    uv: f32,
    normals: bool,
    /// Name, and the numbers of each of the four corners: lower left, lower right, upper right, upper left.
    more: Vec<(&'static str, Vec<f32>)>,
    material: Value,
}

fn quad(half: f32, z: f32, material: Value) -> Quad {
    Quad { half, z, uv: 1.0, normals: true, more: Vec::new(), material }
}

/// A glTF of such meshes, each with its material, and its buffer. Without nodes each mesh stands where it is;
/// `change` does what is particular.
fn gltf(quads: Vec<Quad>, change: impl Fn(&mut Value)) -> [(&'static str, Vec<u8>); 2] {
    let (mut bytes, mut views, mut accessors) = (Vec::<u8>::new(), Vec::new(), Vec::new());
    let (mut meshes, mut materials) = (Vec::new(), Vec::new());
    for q in quads {
        let mut add = |data: Vec<u8>, component: u32, count: usize, kind: &str| {
            views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len() }));
            bytes.extend(data);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            let view = views.len() - 1;
            accessors.push(
                json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }),
            );
            view
        };
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let (h, z) = (q.half, q.z);
        let mut attributes = serde_json::Map::new();
        let positions = floats(&[-h, -h, z, h, -h, z, h, h, z, -h, h, z]);
        attributes.insert("POSITION".into(), json!(add(positions, 5126, 4, "VEC3")));
        if q.normals {
            let up = floats(&[0.0, 0.0, 1.0].repeat(4));
            attributes.insert("NORMAL".into(), json!(add(up, 5126, 4, "VEC3")));
        }
        let t = q.uv;
        let uvs = floats(&[0.0, t, t, t, t, 0.0, 0.0, 0.0]);
        attributes.insert("TEXCOORD_0".into(), json!(add(uvs, 5126, 4, "VEC2")));
        for (name, values) in &q.more {
            let kind = format!("VEC{}", values.len() / 4);
            attributes.insert((*name).into(), json!(add(floats(values), 5126, 4, &kind)));
        }
        let indices: Vec<u8> = [0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = add(indices, 5123, 6, "SCALAR");
        let material = materials.len();
        meshes.push(
            json!({ "primitives": [{ "attributes": attributes, "indices": indices, "material": material }] }),
        );
        materials.push(q.material);
    }
    let count = meshes.len();
    let mut document = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": (0..count).collect::<Vec<_>>() }],
        "nodes": (0..count).map(|i| json!({ "mesh": i })).collect::<Vec<_>>(),
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "uri": "a.bin", "byteLength": bytes.len() }],
    });
    change(&mut document);
    [("a.gltf", document.to_string().into()), ("a.bin", bytes)]
}

/// Lambert's, with the extensions of `more` besides.
fn matt(base: [f32; 4], more: Value) -> Value {
    let mut m = json!({
        "pbrMetallicRoughness": { "baseColorFactor": base, "metallicFactor": 0, "roughnessFactor": 1 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    });
    for (key, value) in more.as_object().unwrap() {
        match (key.as_str(), value) {
            ("extensions", Value::Object(all)) => {
                all.iter().for_each(|(name, x)| m["extensions"][name] = x.clone());
            }
            ("baseColorTexture", info) => m["pbrMetallicRoughness"]["baseColorTexture"] = info.clone(),
            _ => m[key] = value.clone(),
        }
    }
    m
}

const BLACK: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const WHITE: [f32; 4] = [1.0; 4];

/// Shines red and fills the view, from behind.
fn red_wall() -> Quad {
    quad(4.0, -1.0, matt(BLACK, json!({ "emissiveFactor": [1, 0, 0] })))
}

/// Polished, with these extensions.
fn polished(extensions: Value) -> Value {
    json!({
        "pbrMetallicRoughness": { "baseColorFactor": BLACK, "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": extensions,
    })
}

fn case(
    name: &'static str,
    sky: bool,
    files: impl IntoIterator<Item = (&'static str, Vec<u8>)>,
    before: &'static str,
    right: Right,
) -> Case {
    let sky = if sky { "[[light]]\ntype = \"constant\"\n" } else { "" };
    let scene = format!(
        "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 5]\nto = [0, 0, 0]\nwidth = 2\n[film]\n\
         size = [32, 32]\nfilter = \"box\"\n[render]\nsamples = 64\n{sky}[[shape]]\ntype = \"file\"\nfile = \"a.gltf\"\n"
    );
    let mut all = vec![("scene.toml", scene.into_bytes())];
    all.extend(files);
    Case { name, files: all, render: "scene.toml", before, right, says: &[] }
}

/// A picture whose texels, row by row, have these display values and alphas in eight bits.
fn picture(width: usize, texels: &[[f32; 4]]) -> Vec<u8> {
    let mut image = Image::new(width, texels.len() / width, &["R", "G", "B", "A"]);
    image.data = texels.concat();
    write_bytes(Path::new("a.png"), &image, &WriteOptions { raw: true, ..WriteOptions::default() }).unwrap()
}

/// The texture `a.png`, looked up at the nearest texel.
fn textured(document: &mut Value) {
    document["images"] = json!([{ "uri": "a.png" }]);
    document["samplers"] = json!([{ "magFilter": 9728 }]);
    document["textures"] = json!([{ "source": 0, "sampler": 0 }]);
}

/// Solid in its left half, a hole in its right.
fn leaf() -> (&'static str, Vec<u8>) {
    ("a.png", picture(2, &[[1.0; 4], [1.0, 1.0, 1.0, 0.0]]))
}

/// As [`leaf`], in grey.
fn grey_leaf() -> (&'static str, Vec<u8>) {
    let mut image = Image::new(2, 1, &["Y", "A"]);
    image.data = vec![1.0, 1.0, 1.0, 0.0];
    let raw = WriteOptions { raw: true, ..WriteOptions::default() };
    ("a.png", write_bytes(Path::new("a.png"), &image, &raw).unwrap())
}

/// A black picture without alpha.
fn no_alpha() -> (&'static str, Vec<u8>) {
    let raw = WriteOptions { raw: true, ..WriteOptions::default() };
    ("a.png", write_bytes(Path::new("a.png"), &Image::rgb(2, 2), &raw).unwrap())
}

fn mean(r: f32, g: f32, b: f32, tolerance: f32) -> Right {
    Right::Mean([r, g, b], tolerance)
}

fn with<const N: usize>(
    files: [(&'static str, Vec<u8>); N],
    more: (&'static str, Vec<u8>),
) -> Vec<(&'static str, Vec<u8>)> {
    files.into_iter().chain([more]).collect()
}

#[test]
fn lights_and_places() {
    let lamp = || matt(BLACK, json!({ "emissiveFactor": [1, 1, 1] }));
    let apart = |d: &mut Value| {
        d["nodes"] =
            json!([{ "mesh": 0, "translation": [-0.5, 0, 0] }, { "mesh": 0, "translation": [0.5, 0, 0] }]);
        d["scenes"] = json!([{ "nodes": [0, 1] }]);
    };
    let instances = |d: &mut Value| {
        // Three places along x, at the end of the buffer.
        let at = d["buffers"][0]["byteLength"].as_u64().unwrap() - 36;
        d["bufferViews"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "buffer": 0, "byteOffset": at, "byteLength": 36 }));
        let view = d["bufferViews"].as_array().unwrap().len() - 1;
        let accessors = d["accessors"].as_array_mut().unwrap();
        accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": 3, "type": "VEC3" }));
        let attributes = json!({ "TRANSLATION": accessors.len() - 1 });
        d["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        d["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    };
    let three = |material: Value| {
        let mut files = gltf(vec![quad(0.125, 0.0, material)], |d| {
            let bytes = d["buffers"][0]["byteLength"].as_u64().unwrap() + 36;
            d["buffers"][0]["byteLength"] = json!(bytes);
            instances(d);
        });
        let places = [-0.5f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0];
        files[1].1.extend(places.iter().flat_map(|v| v.to_le_bytes()));
        files
    };
    // A red quad that the camera of the file looks at from near, beside what glows: it is lit as if nothing glowed.
    let default_light = |name, glowing: Value, file: (&'static str, Vec<u8>)| {
        let files = gltf(
            vec![quad(0.2, 0.0, glowing), quad(0.4, 0.0, matt([0.8, 0.2, 0.2, 1.0], json!({})))],
            |d| {
                textured(d);
                d["cameras"] = json!([{ "type": "orthographic",
                    "orthographic": { "xmag": 0.1, "ymag": 0.1, "znear": 0.1, "zfar": 9 } }]);
                d["nodes"] = json!([{ "mesh": 0, "translation": [-0.7, 0, 0] }, { "mesh": 1, "translation": [0.3, 0, 0] },
                    { "camera": 0, "translation": [0.3, 0, 2] }]);
                d["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
            },
        );
        Case {
            name,
            files: with(files, file),
            render: "a.gltf --size 16x16 --spp 64",
            before: "black",
            // Lambert under the default light, a sun of 2 along (−0.5, −0.8, 1) and a sky of 0.4: 0.863 of its colour.
            right: mean(0.690, 0.173, 0.173, 5e-3),
            says: &[],
        }
    };
    let mirrored = |name, normals: bool, second: Value| {
        let grey = || Quad { normals, ..quad(0.5, 0.0, matt([0.5, 0.5, 0.5, 1.0], json!({}))) };
        let files = gltf(vec![grey(), grey()], |d| {
            d["nodes"] = json!([{ "mesh": 0, "translation": [-0.5, 0, 0] }, second.clone()]);
            d["scenes"] = json!([{ "nodes": [0, 1] }]);
        });
        // Half of the view is sky.
        case(name, true, files, "black", mean(0.75, 0.75, 0.75, 2e-3))
    };
    let scaled = |mesh: usize| json!({ "mesh": mesh, "scale": [-1, 1, 1], "translation": [0.5, 0, 0] });
    let cases = [
        default_light(
            "an unlit label",
            json!({ "extensions": { "KHR_materials_unlit": {} } }),
            ("a.png", picture(1, &[[1.0; 4]])),
        ),
        default_light(
            "emission that is black",
            matt(BLACK, json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } })),
            ("a.png", picture(1, &[BLACK])),
        ),
        case(
            "two lamps of one mesh",
            false,
            gltf(vec![quad(0.25, 0.0, lamp())], apart),
            "refused",
            mean(0.125, 0.125, 0.125, 2e-3),
        ),
        case(
            "two unlit of one mesh",
            false,
            gltf(
                vec![quad(0.25, 0.0, matt(WHITE, json!({ "extensions": { "KHR_materials_unlit": {} } })))],
                apart,
            ),
            "refused",
            mean(0.125, 0.125, 0.125, 2e-3),
        ),
        case("three instances", true, three(matt(BLACK, json!({}))), "one", {
            let sky = 1.0 - 3.0 / 64.0;
            mean(sky, sky, sky, 2e-3)
        }),
        case(
            "three instances that glow",
            false,
            three(lamp()),
            "one",
            mean(3.0 / 64.0, 3.0 / 64.0, 3.0 / 64.0, 2e-3),
        ),
        mirrored("mirrored by scale", true, scaled(1)),
        mirrored("mirrored by scale, no normals", false, scaled(1)),
        mirrored("mirrored instance, no normals", false, scaled(0)),
        mirrored(
            "mirrored by matrix, no normals",
            false,
            json!({ "mesh": 1, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0, 0, 1] }),
        ),
    ];
    check("gltf", &cases);
}

#[test]
fn what_lets_light_through() {
    let glass = |more: Value, base: [f32; 4]| {
        let mut m = polished(json!({ "KHR_materials_transmission": { "transmissionFactor": 1 } }));
        m["pbrMetallicRoughness"]["baseColorFactor"] = json!(base);
        more.as_object().unwrap().iter().for_each(|(k, v)| m["extensions"][k] = v.clone());
        m
    };
    let paper = |factor: f32| {
        matt(
            [0.8, 0.8, 0.8, 1.0],
            json!({ "extensions": { "KHR_materials_diffuse_transmission":
            { "diffuseTransmissionFactor": factor, "diffuseTransmissionColorFactor": [0.5, 0.25, 0.125] } } }),
        )
    };
    // Front and back of a block a unit deep that reaches beyond the view.
    let block = |body: Value| {
        gltf(vec![red_wall(), quad(2.0, 0.5, body)], |d| {
            d["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1 }, { "mesh": 1, "rotation": [0, 1, 0, 0] }]);
            d["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
        })
    };
    let body = glass(
        json!({ "KHR_materials_volume":
            { "thicknessFactor": 1, "attenuationColor": [0.5, 0.5, 0.5], "attenuationDistance": 1 } }),
        WHITE,
    );
    // A sheet in front of the wall fills a quarter of the view.
    let sheet = |m: Value| gltf(vec![red_wall(), quad(0.5, 0.0, m)], |_| {});
    // Reflections within a slab add up: (1 − R)² a / (1 − R² a²) with R = 0.04 head on, a = exp(−σ d).
    let slab = 0.96f32 * 0.96 * 0.5 / (1.0 - 0.04 * 0.04 * 0.25);
    let cases = [
        case("glass", false, sheet(glass(json!({}), WHITE)), "opaque: 0.75", mean(0.99, 0.0, 0.0, 3e-3)),
        case(
            "coloured glass",
            false,
            sheet(glass(json!({}), [0.5, 1.0, 1.0, 1.0])),
            "opaque: 0.75",
            mean(0.75 + 0.96 * 0.5 / 4.0, 0.0, 0.0, 3e-3),
        ),
        case("a body absorbs", false, block(body), "opaque: 0", mean(slab, 0.0, 0.0, 1e-2)),
        case(
            "paper",
            true,
            gltf(vec![quad(1.0, 0.0, paper(1.0))], |_| {}),
            "white",
            mean(0.5, 0.25, 0.125, 2e-3),
        ),
        case(
            "half paper",
            true,
            gltf(vec![quad(1.0, 0.0, paper(0.5))], |_| {}),
            "white",
            mean(0.65, 0.525, 0.4625, 2e-3),
        ),
        case(
            "specular-glossiness",
            true,
            gltf(
                vec![quad(
                    1.0,
                    0.0,
                    json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness":
                    { "diffuseFactor": [0.8, 0.1, 0.1, 1], "specularFactor": [0, 0, 0], "glossinessFactor": 0 } } }),
                )],
                |_| {},
            ),
            "grey metal",
            // Schlick's term, reflected before it reaches the ground, is 2 ∫ (1 − c)⁵ c dc = 1/21 of all that comes.
            mean(0.8 * 20.0 / 21.0, 0.1 * 20.0 / 21.0, 0.1 * 20.0 / 21.0, 3e-3),
        ),
        case(
            "glossy specular-glossiness",
            true,
            gltf(
                vec![quad(
                    1.0,
                    0.0,
                    json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness":
                    { "diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [0.5, 0.25, 0], "glossinessFactor": 1 } } }),
                )],
                |_| {},
            ),
            "grey metal",
            // What is not reflected, by the brightest channel, lights the ground: 1/2 head on, 20/21 of that from all around.
            mean(0.5 + 5.0 / 21.0, 0.25 + 5.0 / 21.0, 5.0 / 21.0, 6e-3),
        ),
        case(
            "index of zero",
            true,
            gltf(
                vec![quad(
                    1.0,
                    0.0,
                    polished(json!({ "KHR_materials_ior": { "ior": 0 },
                    "KHR_materials_specular": { "specularColorFactor": [0.8, 0.4, 0.2] } })),
                )],
                |_| {},
            ),
            "0.04 of it",
            mean(0.8, 0.4, 0.2, 3e-3),
        ),
        // The strength is in the alpha of its texture, and that of a picture without one is 1.
        case(
            "specular texture without alpha",
            true,
            with(
                gltf(
                    vec![quad(
                        1.0,
                        0.0,
                        polished(json!({ "KHR_materials_ior": { "ior": 0 },
                        "KHR_materials_specular":
                        { "specularColorFactor": [0.8, 0.4, 0.2], "specularTexture": { "index": 0 } } })),
                    )],
                    textured,
                ),
                no_alpha(),
            ),
            "black: its red for its alpha",
            mean(0.8, 0.4, 0.2, 3e-3),
        ),
        case(
            "specular colour above one",
            true,
            gltf(
                vec![quad(
                    1.0,
                    0.0,
                    polished(json!({ "KHR_materials_specular": { "specularColorFactor": [10, 5, 1] } })),
                )],
                |_| {},
            ),
            "0.04 of each",
            mean(0.4, 0.2, 0.04, 3e-3),
        ),
    ];
    check("gltf", &cases);
}

#[test]
fn opacity_and_textures() {
    let shines = |mode: &str, more: Value| {
        let mut m = matt(BLACK, json!({ "emissiveFactor": [1, 1, 1], "alphaMode": mode }));
        more.as_object().unwrap().iter().for_each(|(k, v)| m[k] = v.clone());
        m
    };
    let with_picture = |mut m: Value, picture| {
        m["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
        with(gltf(vec![quad(1.0, 0.0, m)], textured), picture)
    };
    let with_leaf = |m: Value| with_picture(m, leaf());
    let unlit = json!({ "pbrMetallicRoughness": {}, "alphaMode": "MASK", "extensions": { "KHR_materials_unlit": {} } });
    let curtain = |mode: &str, alphas: [f32; 4]| {
        let colours = alphas.iter().flat_map(|a| [1.0, 1.0, 1.0, *a]).collect();
        let m = matt(BLACK, json!({ "alphaMode": mode }));
        gltf(vec![red_wall(), Quad { more: vec![("COLOR_0", colours)], ..quad(0.5, 0.0, m) }], |_| {})
    };
    let back = |more: Value| {
        gltf(vec![quad(0.5, 0.0, matt(WHITE, more)), red_wall()], |d| {
            d["nodes"][0]["rotation"] = json!([0, 1, 0, 0]);
        })
    };
    let white_or_black = |white: usize, width: usize, count: usize| {
        let texels: Vec<[f32; 4]> = (0..count).map(|i| if i == white { WHITE } else { BLACK }).collect();
        ("a.png", picture(width, &texels))
    };
    // A floor of 0.8 that a lamp next to it covers nearly wholly, seen from between them.
    let under_lamp = {
        let colours = [0.5f32, 0.5, 0.5].repeat(4);
        let m = matt(WHITE, json!({ "extensions": { "KHR_materials_unlit": {} } }));
        let files = gltf(
            vec![
                quad(2.0, 0.0, matt([0.8, 0.8, 0.8, 1.0], json!({}))),
                Quad { more: vec![("COLOR_0", colours)], ..quad(60.0, -1.0, m) },
            ],
            |d| d["nodes"][1]["rotation"] = json!([0, 1, 0, 0]),
        );
        let mut c =
            case("vertex colours that glow", false, files, "twice too dark", mean(0.4, 0.4, 0.4, 4e-3));
        let scene = String::from_utf8(c.files[0].1.clone()).unwrap().replace("[0, 0, 5]", "[0, 0, 0.5]");
        c.files[0].1 = scene.into();
        c
    };
    let cases = [
        case(
            "holes do not shine",
            false,
            with_leaf(shines("MASK", json!({}))),
            "1",
            mean(0.5, 0.5, 0.5, 2e-3),
        ),
        case(
            "holes in a grey picture",
            false,
            with_picture(shines("MASK", json!({})), grey_leaf()),
            "1: its grey for its alpha",
            mean(0.5, 0.5, 0.5, 2e-3),
        ),
        case(
            "nor does what is faint",
            false,
            with_leaf(shines("BLEND", json!({}))),
            "1",
            mean(0.5, 0.5, 0.5, 2e-3),
        ),
        case("holes in what is unlit", false, with_leaf(unlit), "1", mean(0.5, 0.5, 0.5, 2e-3)),
        // Alpha falls from 1 below to 0 above: half of a quarter of the view.
        case(
            "vertex alpha, mask",
            false,
            curtain("MASK", [1.0, 1.0, 0.0, 0.0]),
            "ignored: 0.75",
            mean(0.875, 0.0, 0.0, 4e-3),
        ),
        case(
            "vertex alpha, blend",
            false,
            curtain("BLEND", [0.25; 4]),
            "ignored: 0.75",
            mean(0.9375, 0.0, 0.0, 5e-3),
        ),
        under_lamp,
        case(
            "vertex colours times a texture",
            true,
            with(
                gltf(
                    vec![Quad {
                        more: vec![("COLOR_0", [0.5f32, 1.0, 0.25].repeat(4))],
                        ..quad(1.0, 0.0, matt(WHITE, json!({ "baseColorTexture": { "index": 0 } })))
                    }],
                    textured,
                ),
                // 188 of 255 is 0.5028.
                ("a.png", picture(1, &[[188.0 / 255.0, 188.0 / 255.0, 188.0 / 255.0, 1.0]])),
            ),
            "only the texture",
            mean(0.2514, 0.5028, 0.1257, 2e-3),
        ),
        // White in its upper left quarter: a quarter of the width, each half of the height.
        case(
            "clamped across, tiled down",
            true,
            with(
                gltf(
                    vec![Quad {
                        uv: 2.0,
                        ..quad(1.0, 0.0, matt(WHITE, json!({ "baseColorTexture": { "index": 0 } })))
                    }],
                    |d| {
                        textured(d);
                        d["samplers"][0]["wrapS"] = json!(33071);
                        d["samplers"][0]["wrapT"] = json!(10497);
                    },
                ),
                white_or_black(0, 2, 4),
            ),
            "both as across",
            mean(0.125, 0.125, 0.125, 2e-3),
        ),
        // The second set points into the white half everywhere, the first into both.
        case(
            "two sets of coordinates",
            false,
            with(
                gltf(
                    vec![Quad {
                        more: vec![("TEXCOORD_1", [0.75f32, 0.5].repeat(4))],
                        ..quad(
                            1.0,
                            0.0,
                            matt(
                                BLACK,
                                json!({ "baseColorTexture": { "index": 0 }, "emissiveFactor": [1, 1, 1],
                                "emissiveTexture": { "index": 0, "texCoord": 1 } }),
                            ),
                        )
                    }],
                    textured,
                ),
                white_or_black(1, 2, 2),
            ),
            "0.5: the first for both",
            mean(1.0, 1.0, 1.0, 2e-3),
        ),
        case("single-sided, from behind", false, back(json!({})), "black there", mean(1.0, 0.0, 0.0, 2e-3)),
        case(
            "two-sided, from behind",
            false,
            back(json!({ "doubleSided": true })),
            "the same",
            mean(0.75, 0.0, 0.0, 2e-3),
        ),
    ];
    check("gltf", &cases);
}

#[test]
fn marks_versions_and_packed_data() {
    let plain = || gltf(vec![quad(0.5, 0.0, matt(BLACK, json!({})))], |_| {});
    let framed = || mean(0.75, 0.75, 0.75, 2e-3);
    let mut marked = plain();
    marked[0].1.splice(0..0, *b"\xef\xbb\xbf");
    let mut old = plain();
    old[0].1 = br#"{ "asset": { "version": "1.0" }, "meshes": { "m": { "primitives": [] } }, "nodes": { "n": {} } }"#.to_vec();
    let with_extension = |name: &'static str, change: fn(&mut Value)| {
        gltf(vec![quad(0.5, 0.0, matt(BLACK, json!({})))], |d| {
            d["extensionsUsed"] = json!([name]);
            change(d);
        })
    };
    let says = |says, case: Case| Case { says, ..case };
    let quantized = {
        let mut files = gltf(vec![quad(0.5, 0.0, matt(BLACK, json!({})))], |d| {
            d["accessors"][0] = json!({ "bufferView": 0, "componentType": 5122, "normalized": true, "count": 4,
                "type": "VEC3" });
            d["bufferViews"][0]["byteStride"] = json!(8);
            d["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
            d["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            d["nodes"][0]["scale"] = json!([0.5, 0.5, 0.5]);
        });
        let corners = [[-32767i16, -32767], [32767, -32767], [32767, 32767], [-32767, 32767]];
        let shorts: Vec<u8> =
            corners.iter().flat_map(|[x, y]| [*x, *y, 0, 0]).flat_map(i16::to_le_bytes).collect();
        files[1].1[..32].copy_from_slice(&shorts);
        files
    };
    // Attributes of which each byte of each vertex is written out: mode 3 of the one group of each byte.
    let packed = {
        let mut packed = Vec::new();
        let mut files = gltf(vec![quad(0.5, 0.0, matt(BLACK, json!({})))], |d| {
            d["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": 48,
                "extensions": { "EXT_meshopt_compression": { "fallback": true } } }));
            let at = d["buffers"][0]["byteLength"].as_u64().unwrap();
            d["buffers"][0]["byteLength"] = json!(at + 1 + 12 * 17 + 32);
            d["bufferViews"][0] = json!({ "buffer": 1, "byteLength": 48, "extensions": {
                "EXT_meshopt_compression": { "buffer": 0, "byteOffset": at, "byteLength": 1 + 12 * 17 + 32,
                    "byteStride": 12, "count": 4, "mode": "ATTRIBUTES" } } });
            d["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
            d["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
        });
        packed.push(0xa0);
        let positions = files[1].1[..48].to_vec();
        for k in 0..12 {
            packed.push(3);
            let mut last = 0u8;
            for i in 0..16 {
                let value = positions.get(12 * i + k).copied().unwrap_or(last);
                let delta = value.wrapping_sub(last);
                packed.push(if delta & 0x80 == 0 { delta << 1 } else { !(delta << 1) });
                last = value;
            }
        }
        packed.resize(packed.len() + 32, 0);
        files[1].1[..48].fill(0);
        files[1].1.extend(packed);
        files
    };
    let mut damaged = packed.clone();
    let text = String::from_utf8(damaged[0].1.clone())
        .unwrap()
        .replace("\"count\":4,\"mode\"", "\"count\":400,\"mode\"");
    assert_ne!(text.as_bytes(), damaged[0].1);
    damaged[0].1 = text.into();
    let cases = [
        case("byte-order mark", true, marked, "refused: expected value", framed()),
        says(
            &["this is glTF 1.0", "convert it"],
            case("version 1", true, old, "invalid type: map", Right::Refused),
        ),
        case("short positions", true, quantized, "the same", framed()),
        says(
            &["EXT_unheard_of", "not known"],
            case("an unknown extension", true, with_extension("EXT_unheard_of", |_| {}), "silent", framed()),
        ),
        case("data about the file", true, with_extension("KHR_xmp_json_ld", |_| {}), "silent", framed()),
        says(
            &["KHR_texture_basisu", "gltf-transform"],
            case(
                "pictures in KTX 2",
                true,
                with_extension("KHR_texture_basisu", |d| {
                    d["images"] = json!([{ "uri": "a.ktx2", "mimeType": "image/ktx2" }]);
                    d["textures"] = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
                    d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
                }),
                "refused: names no picture",
                framed(),
            ),
        ),
        says(
            &["KHR_meshopt_compression", "gltf-transform"],
            case(
                "packed by meshopt's second form",
                true,
                with_extension("KHR_meshopt_compression", |d| {
                    let length = d["buffers"][0]["byteLength"].clone();
                    d["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": length,
                        "extensions": { "KHR_meshopt_compression": { "fallback": true } } }));
                    for view in d["bufferViews"].as_array_mut().unwrap() {
                        view["buffer"] = json!(1);
                    }
                }),
                "refused: buffer 1 has 0 bytes",
                Right::Refused,
            ),
        ),
        case("packed by meshopt", true, packed, "refused: buffer 1 has 0 bytes", framed()),
        says(
            &["packed by EXT_meshopt_compression", "ends before", "gltf-transform"],
            case(
                "packed by meshopt, damaged",
                true,
                damaged,
                "refused: buffer 1 has 0 bytes",
                Right::Refused,
            ),
        ),
        says(
            &["KHR_draco_mesh_compression", "gltf-transform"],
            case(
                "packed by Draco",
                true,
                with_extension("KHR_draco_mesh_compression", |d| {
                    for accessor in d["accessors"].as_array_mut().unwrap() {
                        accessor.as_object_mut().unwrap().remove("bufferView");
                    }
                    d["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_draco_mesh_compression":
                        { "bufferView": 0, "attributes": { "POSITION": 0 } } });
                }),
                "empty",
                Right::Refused,
            ),
        ),
    ];
    check("gltf", &cases);
}
