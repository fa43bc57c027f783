//! Shading normals that maps have turned away from the eye or the light. What is right is what Mitsuba 3.9.1 renders of
//! the same files (4096 samples a pixel; the standard error of each mean is below .00015).

use crate::{Case, Right, check};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::{Image, Vec3};

/// Sixteen texels a side of hashed numbers within 0 and 1, two for each.
fn noise(x: usize, y: usize) -> [f32; 2] {
    let mut rng = yugen_optics::random::Pcg32::new((y * 16 + x) as u64, 7);
    [rng.next_f32(), rng.next_f32()]
}

fn png(image: &Image) -> Vec<u8> {
    write_bytes(Path::new("a.png"), image, &WriteOptions { raw: true, ..WriteOptions::default() }).unwrap()
}

/// Steep normals: slopes up to 2.5.
fn normals() -> Vec<u8> {
    let mut image = Image::rgb(16, 16);
    for y in 0..16 {
        for x in 0..16 {
            let [a, b] = noise(x, y).map(|v| 5.0 * v - 2.5);
            let n = Vec3::new(a, b, 1.0).normalize() * 0.5 + 0.5;
            image.pixel_mut(x, y).copy_from_slice(&n.to_array());
        }
    }
    png(&image)
}

fn heights() -> Vec<u8> {
    let mut image = Image::new(16, 16, &["Y"]);
    for y in 0..16 {
        for x in 0..16 {
            image.pixel_mut(x, y)[0] = noise(x, y)[0];
        }
    }
    png(&image)
}

/// A floor under a dim sky and a grazing sun.
fn floor(name: &'static str, bsdf: &str, before: &'static str, right: Right) -> Case {
    let map = |kind: &str, file: &str| {
        format!(
            "<texture name=\"{kind}\" type=\"bitmap\"><boolean name=\"raw\" value=\"true\"/>\
             <string name=\"filename\" value=\"{file}\"/></texture>"
        )
    };
    let bsdf = bsdf
        .replace("NORMALS", &map("normalmap", "normals.png"))
        .replace("HEIGHTS", &map("height", "heights.png"))
        .replace("GREY", "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.8\"/></bsdf>")
        .replace("OFF", "<boolean name=\"flip_invalid_normals\" value=\"false\"/><boolean name=\"use_shadowing_function\" value=\"false\"/>");
    let scene = format!(
        "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"2\"/></integrator>\n\
         <sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/><transform name=\"to_world\">\
         <lookat origin=\"0,1,5\" target=\"0,0,0\" up=\"0,1,0\"/></transform><film type=\"hdrfilm\">\
         <integer name=\"width\" value=\"32\"/><integer name=\"height\" value=\"32\"/><rfilter type=\"box\"/></film>\
         <sampler type=\"independent\"><integer name=\"sample_count\" value=\"1024\"/></sampler></sensor>\n\
         <emitter type=\"constant\"><rgb name=\"radiance\" value=\"0.3\"/></emitter>\
         <emitter type=\"directional\"><vector name=\"direction\" value=\"1,-0.25,0.3\"/>\
         <rgb name=\"irradiance\" value=\"3\"/></emitter>\n<shape type=\"rectangle\"><transform name=\"to_world\">\
         <scale value=\"3\"/><rotate x=\"1\" angle=\"-90\"/></transform>{bsdf}</shape></scene>\n"
    );
    let files = vec![("scene.xml", scene.into()), ("normals.png", normals()), ("heights.png", heights())];
    Case { name, files, render: "scene.xml", before, right, says: &[] }
}

#[test]
fn normals_turned_away() {
    // Ours have 1024 samples a pixel.
    let grey = |v: f32| Right::Mean([v; 3], 0.0015);
    let cases = [
        floor("normal map", "<bsdf type=\"normalmap\">NORMALS GREY</bsdf>", "black holes", grey(0.2949)),
        floor("normal map as given", "<bsdf type=\"normalmap\">OFF NORMALS GREY</bsdf>", "", grey(0.2704)),
        floor(
            "normal map from behind",
            "<boolean name=\"flip_normals\" value=\"true\"/><bsdf type=\"twosided\"><bsdf type=\"normalmap\">NORMALS GREY</bsdf></bsdf>",
            "nearly black",
            grey(0.2974),
        ),
        floor(
            "bump map",
            "<bsdf type=\"bumpmap\">HEIGHTS GREY<float name=\"scale\" value=\"0.8\"/></bsdf>",
            "a third too bright in grazing light",
            grey(0.3026),
        ),
        floor(
            "bump map as given",
            "<bsdf type=\"bumpmap\">OFF HEIGHTS GREY<float name=\"scale\" value=\"0.8\"/></bsdf>",
            "",
            grey(0.2722),
        ),
        floor(
            "normal map on rough metal",
            "<bsdf type=\"twosided\"><bsdf type=\"normalmap\">NORMALS <bsdf type=\"roughconductor\">\
             <float name=\"alpha_u\" value=\"0.4\"/><float name=\"alpha_v\" value=\"0.15\"/></bsdf></bsdf></bsdf>",
            "black holes",
            grey(0.3396),
        ),
    ];
    check("normals", &cases);
}
