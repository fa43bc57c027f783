//! Light below zero: in pictures it is taken for none and said, where it is typed it is refused.

use crate::{Case, Right, check};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::{ColourSpace, Image};

/// A picture of ones, three of whose pixels are far below zero.
fn dented() -> Vec<u8> {
    let mut image = Image::rgb(32, 16);
    image.data.fill(1.0);
    for x in [3, 9, 20] {
        image.pixel_mut(x, 4)[1] = -500.0;
    }
    write_bytes(Path::new("a.exr"), &image, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap()
}

/// A square that faces the camera, in the light of the words given.
fn square(
    name: &'static str,
    light: &str,
    reflectance: &str,
    right: Right,
    says: &'static [&'static str],
) -> Case {
    let scene = format!(
        "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 5]\nto = [0, 0, 0]\nwidth = 1\n[film]\n\
         size = [16, 16]\nfilter = \"box\"\n[render]\nsamples = 256\nintegrator = \"direct\"\n{light}\n\
         [material.m]\nmodel = \"lambert\"\nreflectance = {reflectance}\n[[shape]]\ntype = \"rectangle\"\n\
         material = \"m\"\n"
    );
    let files = vec![("scene.toml", scene.into()), ("dented.exr", dented())];
    Case { name, files, render: "scene.toml", before: "dark specks, in silence", right, says }
}

#[test]
fn negative_light() {
    let sky = "[[light]]\ntype = \"constant\"";
    let refused = |name, light: &str, says| square(name, light, "0.5", Right::Refused, says);
    let cases = [
        square(
            "environment",
            "[[light]]\ntype = \"environment\"\nimage = \"dented.exr\"",
            "0.5",
            // A few texels of 512 are missing in green.
            Right::Mean([0.5, 0.495, 0.5], 0.01),
            &["dented.exr: 3 of 512 pixels have colours below zero, the least -500"],
        ),
        square(
            "texture",
            sky,
            "{ image = \"dented.exr\", filter = \"nearest\" }",
            Right::Mean([1.0, 1.0, 1.0], 0.02),
            &["dented.exr: 3 of 512 pixels"],
        ),
        refused(
            "constant",
            "[[light]]\ntype = \"constant\"\nradiance = [1, -0.5, 1]",
            &["scene.toml:15", "light cannot be negative, found -0.5"],
        ),
        refused(
            "point",
            "[[light]]\ntype = \"point\"\nat = [0, 0, 3]\nintensity = -2",
            &["scene.toml:16", "light cannot be negative, found -2"],
        ),
        Case {
            name: "envmap of a Mitsuba scene",
            files: vec![
                (
                    "scene.xml",
                    "<scene version=\"3.0.0\">\n<emitter type=\"envmap\">\n\
                     <string name=\"filename\" value=\"dented.exr\"/><float name=\"scale\" value=\"-1\"/></emitter>\n\
                     <sensor type=\"perspective\"/><shape type=\"sphere\"/></scene>"
                        .into(),
                ),
                ("dented.exr", dented()),
            ],
            render: "scene.xml --size 8x8",
            before: "rendered",
            right: Right::Refused,
            says: &["scene.xml:", "scale"],
        },
    ];
    check("negative", &cases);
}
