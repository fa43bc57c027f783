//! OpenEXR and other pictures.

use crate::{Case, Right, check};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::{ColourSpace, Image};

/// A picture of one colour with these channels.
fn exr(channels: &[(&str, f32)], size: [usize; 2]) -> Vec<u8> {
    let names: Vec<&str> = channels.iter().map(|c| c.0).collect();
    let mut image = Image::new(size[0], size[1], &names);
    for pixel in image.data.chunks_exact_mut(channels.len()) {
        channels.iter().zip(pixel).for_each(|(c, v)| *v = c.1);
    }
    write_bytes(Path::new("a.exr"), &image, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap()
}

/// A rectangle that fills the view and shines as a texture says.
fn shown(
    name: &'static str,
    texture: &str,
    file: &'static str,
    bytes: Vec<u8>,
    before: &'static str,
    right: Right,
) -> Case {
    let scene = format!(
        "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 5]\nto = [0, 0, 0]\nwidth = 2\n[film]\n\
         size = [16, 16]\nfilter = \"box\"\n[render]\nsamples = 4\n[[shape]]\ntype = \"rectangle\"\nsize = [2, 2]\n\
         emission = {{ image = \"{file}\"{texture} }}\n"
    );
    Case {
        name,
        files: vec![("scene.toml", scene.into()), (file, bytes)],
        render: "scene.toml",
        before,
        right,
        says: &[],
    }
}

/// An attribute put into the header of a picture of one block, whose place moves.
fn with_attribute(mut bytes: Vec<u8>, attribute: &[u8]) -> Vec<u8> {
    let is_table = |p: usize| bytes[p..p + 8] == (p as u64 + 8).to_le_bytes();
    let table = (8..bytes.len() - 8).find(|&p| is_table(p)).unwrap();
    let moved = (table + 8 + attribute.len()) as u64;
    bytes[table..table + 8].copy_from_slice(&moved.to_le_bytes());
    bytes.splice(8..8, attribute.iter().copied());
    bytes
}

#[test]
fn exr_and_others() {
    let layers = || {
        exr(
            &[
                ("ViewLayer.Combined.R", 0.5),
                ("ViewLayer.Combined.G", 0.25),
                ("ViewLayer.Combined.B", 0.125),
                ("ViewLayer.Combined.A", 1.0),
                ("ViewLayer.Depth.Z", 9.0),
                ("ViewLayer.DiffCol.R", 0.1),
                ("ViewLayer.DiffCol.G", 0.2),
                ("ViewLayer.DiffCol.B", 0.3),
            ],
            [4, 4],
        )
    };
    let combined = || Right::Mean([0.5, 0.25, 0.125], 1e-4);
    let refused = "refused";
    let mut compressed = layers();
    let name = b"compression\0compression\0\x01\0\0\0";
    let at = compressed.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    compressed[at] = 13;

    // A camera turned to the square −y of a cube, of which each side has a brightness.
    let mut cube = Image::rgb(2, 12);
    for (i, pixel) in cube.data.chunks_exact_mut(3).enumerate() {
        pixel.fill((i / 4) as f32);
    }
    let cube = write_bytes(Path::new("a.exr"), &cube, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap();
    let cube = with_attribute(cube, b"envmap\0envmap\0\x01\0\0\0\x01");
    let looks = |name, to: &str, right| {
        Case {
        name,
        files: vec![
            (
                "scene.toml",
                format!(
                    "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 0]\nto = [{to}]\nup = [0.1, 0.2, 0.3]\n\
                     fov = 10\n[film]\nsize = [8, 8]\n[[light]]\ntype = \"environment\"\nimage = \"cube.exr\"\n[[shape]]\n\
                     type = \"sphere\"\nat = [50, 50, 50]\n"
                )
                .into_bytes(),
            ),
            ("cube.exr", cube.clone()),
        ],
        render: "scene.toml --spp 4",
        before: "smeared",
        // Towards its rim a side of two by two takes from the next one.
        right: Right::Mean([right; 3], 0.1),
        says: &[],
    }
    };

    let tga = {
        let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0x20];
        bytes.extend([0, 128, 255]);
        bytes
    };
    let mut bmp = b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\x18\0".to_vec();
    bmp.extend([0; 24]);
    bmp.extend([0, 128, 255, 0]);
    let orange = || Right::Mean([1.0, 0.2159, 0.0], 1e-3);
    let cases = [
        // The sRGB colour (0.5, 0.25, 0.125) by the matrix of IEC 61966-2-1.
        shown(
            "X, Y, Z",
            "",
            "a.exr",
            exr(&[("X", 0.31817), ("Y", 0.29413), ("Z", 0.15826)], [4, 4]),
            refused,
            Right::Mean([0.5, 0.25, 0.125], 1e-3),
        ),
        shown("layers of Blender", "", "a.exr", layers(), refused, combined()),
        shown(
            "a layer by name",
            ", layer = \"ViewLayer.DiffCol\"",
            "a.exr",
            layers(),
            refused,
            Right::Mean([0.1, 0.2, 0.3], 1e-4),
        ),
        shown(
            "a channel by its full name",
            ", channel = \"ViewLayer.DiffCol.G\"",
            "a.exr",
            layers(),
            "1: the fourth channel",
            Right::Mean([0.2; 3], 1e-4),
        ),
        shown(
            "a channel of the layer that is meant",
            ", channel = \"G\"",
            "a.exr",
            layers(),
            refused,
            Right::Mean([0.25; 3], 1e-4),
        ),
        Case {
            says: &["unknown layer 'ViewLayer.Combine'; did you mean 'ViewLayer.Combined'?"],
            ..shown(
                "a layer off by a letter",
                ", layer = \"ViewLayer.Combine\"",
                "a.exr",
                layers(),
                refused,
                Right::Refused,
            )
        },
        Case {
            says: &["ZSTD compression is not supported; write it with ZIP"],
            ..shown("ZSTD", "", "a.exr", compressed, "'damaged'", Right::Refused)
        },
        looks("a cube to its right", "1, 0, 0", 0.0),
        looks("a cube below", "0, -1, 0", 3.0),
        looks("a cube behind", "0, 0, -1", 5.0),
        shown("TGA", ", filter = \"nearest\"", "a.tga", tga, refused, orange()),
        shown("BMP", ", filter = \"nearest\"", "a.bmp", bmp, refused, orange()),
        shown(
            "PPM",
            ", filter = \"nearest\"",
            "a.ppm",
            b"P3 1 1 255 255 128 0\n".to_vec(),
            refused,
            orange(),
        ),
    ];
    check("exr", &cases);
}
