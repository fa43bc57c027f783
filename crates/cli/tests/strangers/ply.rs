//! PLY: what stands at faces instead of vertices, and colours.

use crate::{Case, Right, check};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::Image;

/// A square of two triangles, seen under a sky of one; what it reflects is a texture.
fn square(
    name: &'static str,
    reflectance: &str,
    properties: [&str; 2],
    values: [&str; 2],
    before: &'static str,
    right: Right,
) -> Case {
    let [of_vertices, of_faces] = properties;
    let [at_vertices, at_faces] = values;
    // A colour for each of two faces, one after the other.
    let (first, second) = at_faces.split_once('|').unwrap_or((at_faces, at_faces));
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{of_vertices}\
         element face 2\nproperty list uchar int vertex_indices\n{of_faces}end_header\n-1 -1 0 {at_vertices}\n\
         1 -1 0 {at_vertices}\n1 1 0 {at_vertices}\n-1 1 0 {at_vertices}\n3 0 1 2 {first}\n3 0 2 3 {second}\n"
    );
    let scene = format!(
        "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 5]\nto = [0, 0, 0]\nwidth = 2\n[film]\n\
         size = [32, 32]\nfilter = \"box\"\n[render]\nsamples = 16\nintegrator = \"direct\"\n[[light]]\n\
         type = \"constant\"\n[material.m]\nmodel = \"lambert\"\nreflectance = {reflectance}\n[[shape]]\ntype = \"file\"\n\
         file = \"a.ply\"\nmaterial = \"m\"\n"
    );
    let files = vec![("scene.toml", scene.into()), ("a.ply", ply.into()), ("split.png", split())];
    Case { name, files, render: "scene.toml", before, right, says: &[] }
}

/// White in its left quarter and in its upper half, else black.
fn split() -> Vec<u8> {
    let mut image = Image::rgb(64, 64);
    for y in 0..64 {
        for x in 0..64 {
            image.pixel_mut(x, y).fill(if x < 16 || y < 32 { 1.0 } else { 0.0 });
        }
    }
    write_bytes(Path::new("a.png"), &image, &WriteOptions { raw: true, ..WriteOptions::default() }).unwrap()
}

const RGB: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

#[test]
fn ply() {
    let floats = RGB.replace("uchar", "float");
    let cases = [
        square(
            "texture coordinates of faces",
            "{ image = \"split.png\" }",
            ["", "property list uchar float texcoord\n"],
            ["", "6 0 0 1 0 1 1|6 0 0 1 1 0 1"],
            "everywhere that of one corner",
            Right::Picture(|image| {
                let at = |x: usize, y: usize| image.pixel(x, y)[0].round();
                let found = [at(2, 2), at(29, 2), at(2, 29), at(29, 29)];
                let text = format!("{found:?}");
                if found == [1.0, 1.0, 1.0, 0.0] { Ok(text) } else { Err(text) }
            }),
        ),
        square(
            "colours of faces",
            "{ attribute = \"face_color\" }",
            ["", RGB],
            ["", "255 0 0|0 128 0"],
            "black",
            Right::Picture(|image| {
                // Below the diagonal the first, above it the second; 128 is 0.2159.
                let (below, above) = (image.pixel(29, 29), image.pixel(2, 2));
                let fine =
                    below[..3] == [1.0, 0.0, 0.0] && above[0] == 0.0 && (above[1] - 0.2159).abs() < 1e-3;
                let text = format!("{below:?} {above:?}");
                if fine { Ok(text) } else { Err(text) }
            }),
        ),
        square(
            "colours as bytes",
            "{ attribute = \"vertex_color\" }",
            [RGB, ""],
            ["255 128 0", ""],
            "the same",
            Right::Mean([1.0, 0.2159, 0.0], 1e-3),
        ),
        square(
            "colours as numbers",
            "{ attribute = \"vertex_color\" }",
            [&floats, ""],
            ["1 .5 0", ""],
            "the same",
            Right::Mean([1.0, 0.5, 0.0], 1e-3),
        ),
        square(
            "diffuse_red",
            "{ attribute = \"vertex_color\" }",
            [&RGB.replace("uchar ", "uchar diffuse_"), ""],
            ["255 128 0", ""],
            "black",
            Right::Mean([1.0, 0.2159, 0.0], 1e-3),
        ),
    ];
    check("ply", &cases);
}
