//! Mitsuba's XML. The right values are Mitsuba 3.9.1's (`scalar_rgb`, at least 256 samples a pixel) unless a row says
//! otherwise; its means are known to about .001.

use crate::{Case, Right, check};
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::{ColourSpace, Image};

const PATH: &str = r#"<integrator type="path"/>"#;
const SKY: &str = r#"<emitter type="constant"/>"#;
const WALL: &str =
    r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform></shape>"#;
const LAMPS: &str = r#"<emitter type="point"><point name="position" value="1,2,3"/><rgb name="intensity" value="10"/>
  </emitter><shape type="rectangle"><transform name="to_world"><scale value=".3"/><translate x="1" y="1" z="2"/>
  <lookat origin="1,1,2" target="0,0,0" up="0,1,0"/></transform><emitter type="area"><rgb name="radiance" value="5"/>
  </emitter></shape>"#;

fn xml(integrator: &str, of_sensor: &str, world: &str) -> Vec<u8> {
    format!(
        r#"<scene version="3.0.0">{integrator}<sensor type="perspective"><float name="fov" value="40"/>{of_sensor}
<transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform><film type="hdrfilm">
<integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film>
<sampler type="independent"><integer name="sample_count" value="256"/></sampler></sensor>{world}</scene>"#
    )
    .into_bytes()
}

fn scene(name: &'static str, file: Vec<u8>, before: &'static str, right: Right) -> Case {
    Case { name, files: vec![("a.xml", file)], render: "a.xml", before, right, says: &[] }
}

fn grey(mean: f32) -> Right {
    Right::Mean([mean; 3], 0.004)
}

/// Red, green, blue and yellow, from the upper left on.
fn quarters() -> Vec<u8> {
    let mut image = Image::rgb(4, 4);
    for y in 0..4 {
        for x in 0..4 {
            let c = [[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]][y / 2][x / 2];
            image.data[(y * 4 + x) * 3..][..3].copy_from_slice(&c);
        }
    }
    write_bytes(std::path::Path::new("a.png"), &image, &WriteOptions::from(ColourSpace::LinearSrgb)).unwrap()
}

/// The means of the four quarters of a picture, from the upper left on.
fn of_quarters(image: &Image) -> [[f32; 3]; 4] {
    let rgb = image.select(&["R", "G", "B"]).unwrap();
    let mut sums = [[0.0; 3]; 4];
    for y in 0..rgb.height {
        for x in 0..rgb.width {
            let quarter = 2 * usize::from(2 * y >= rgb.height) + usize::from(2 * x >= rgb.width);
            for (sum, v) in sums[quarter].iter_mut().zip(rgb.pixel(x, y)) {
                *sum += v / (rgb.width * rgb.height / 4) as f32;
            }
        }
    }
    sums
}

/// The picture lies on the wall as Mitsuba 3.9.1 throws it: seen from behind the lamp, its upper left is at the lower
/// right.
fn thrown(image: &Image) -> Result<String, String> {
    let [a, b, c, d] = of_quarters(image);
    let reads = |q: [f32; 3], lit: [bool; 3]| q.iter().zip(lit).all(|(v, lit)| (*v > 0.05) == lit);
    let thrown = reads(a, [true, true, false])
        && reads(b, [false, false, true])
        && reads(c, [false, true, false])
        && reads(d, [true, false, false]);
    if thrown { Ok("as there".into()) } else { Err(format!("the quarters are {a:?} {b:?} {c:?} {d:?}")) }
}

/// A sphere before a sky of one is darker than it, and so is the quarter of the picture that it has moved to.
fn moved(image: &Image) -> Result<String, String> {
    let [a, b, c, d] = of_quarters(image).map(|q| q[0]);
    let text = format!("{:.3} left, {:.3} right, {:.3} above, {:.3} below", a + c, b + d, a + b, c + d);
    // Mitsuba 3.9.1, the same sums.
    let right = [1.549, 1.957, 1.863, 1.643];
    let close = [a + c, b + d, a + b, c + d].iter().zip(right).all(|(v, r)| (v - r).abs() < 0.02);
    if close { Ok(text) } else { Err(text) }
}

fn direct(emitter: u32, bsdf: u32) -> Vec<u8> {
    let integrator = format!(
        r#"<integrator type="direct"><integer name="emitter_samples" value="{emitter}"/>
<integer name="bsdf_samples" value="{bsdf}"/></integrator>"#
    );
    xml(&integrator, "", &format!("{WALL}{LAMPS}{SKY}"))
}

/// A mirror that fills the view, under the sky.
fn mirror(emitter: u32, bsdf: u32) -> Vec<u8> {
    let integrator = format!(
        r#"<integrator type="direct"><integer name="emitter_samples" value="{emitter}"/>
<integer name="bsdf_samples" value="{bsdf}"/></integrator>"#
    );
    let plate = WALL.replace("</transform>", r#"</transform><bsdf type="conductor"/>"#);
    xml(&integrator, "", &format!("{plate}{SKY}"))
}

fn mirrored(shape: &str) -> Vec<u8> {
    let mirror = r#"<transform name="to_world"><scale x="-1" y="1" z="1"/></transform>"#;
    xml(PATH, "", &format!(r#"{SKY}<shape type="{shape}">{mirror}</shape>"#))
}

fn sphere(bsdf: &str) -> Vec<u8> {
    xml(PATH, "", &format!(r#"{SKY}<shape type="sphere">{bsdf}</shape>"#))
}

#[test]
fn mitsuba() {
    let spot = format!(
        r#"{WALL}<emitter type="spot"><transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/>
</transform><float name="cutoff_angle" value="25"/><rgb name="intensity" value="30"/>
<texture type="bitmap" name="texture"><string name="filename" value="q.png"/></texture></emitter>"#
    );
    let offset = r#"<float name="principal_point_offset_x" value="0.2"/>
<float name="principal_point_offset_y" value="-0.1"/>"#;
    let clear = |more: &str| {
        sphere(&format!(r#"<bsdf type="principled"><float name="roughness" value=".3"/>{more}</bsdf>"#))
    };
    let turned = |normal: &str| {
        xml(
            PATH,
            "",
            &format!(r#"{SKY}<shape type="rectangle"><bsdf type="normalmap">{normal}</bsdf></shape>"#),
        )
    };
    let constant =
        r#"<texture type="rawconstant" name="normalmap"><vector name="value" value=".5,.7,.8"/></texture>"#;
    let rotated = r#"<shape type="rectangle"><transform name="to_world"><rotate y="2" angle="30"/></transform></shape>"#;
    let blend = r#"<bsdf type="blendbsdf"><float name="weight" value=".5"/><bsdf type="conductor"/>
<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></bsdf>"#;
    let cases = [
        Case {
            files: vec![("a.xml", xml(PATH, "", &spot)), ("q.png", quarters())],
            ..scene("texture of a spot light", Vec::new(), "turned by 180 degrees", Right::Picture(thrown))
        },
        scene(
            "principal point",
            xml(PATH, offset, &format!(r#"{SKY}<shape type="sphere"/>"#)),
            "moved the other way",
            Right::Picture(moved),
        ),
        scene("mirrored sphere", mirrored("sphere"), ".877", grey(0.7529)),
        scene("mirrored cylinder", mirrored("cylinder"), ".918", grey(0.8666)),
        scene("direct, materials only", direct(0, 1), ".596", grey(0.5141)),
        scene("direct, lights only", direct(1, 0), ".596", grey(0.5981)),
        scene("direct, both", direct(1, 1), ".596", grey(0.5960)),
        // No light sample finds what a mirror shows.
        scene("a mirror, lights only", mirror(1, 0), "1", grey(0.0)),
        scene("a mirror, both", mirror(1, 1), "1", grey(1.0)),
        scene(
            "principled, specular 0",
            clear(r#"<float name="spec_trans" value="1"/><float name="specular" value="0"/>"#),
            ".874",
            grey(0.8740),
        ),
        scene(
            "principled beyond one",
            clear(r#"<float name="sheen" value="2"/><float name="clearcoat" value="1.5"/>"#),
            ".907",
            grey(0.9065),
        ),
        scene(
            "principledthin",
            sphere(
                r#"<bsdf type="principledthin"><float name="spec_trans" value=".4"/><float name="diff_trans" value="1"/>
<float name="sheen" value=".5"/></bsdf>"#,
            ),
            "refused",
            grey(0.8283),
        ),
        scene(
            "a constant as normal map",
            turned(&format!(r#"{constant}<bsdf type="diffuse"/>"#)),
            "refused",
            grey(0.8263),
        ),
        scene(
            "children in any order, names in any case",
            turned(&format!(r#"<bsdf type="Diffuse"/>{constant}"#)),
            "refused",
            grey(0.8263),
        ),
        // There it is .44: the Dirac peak of one is weighed as if it were the other.
        scene("a blend with a mirror", sphere(blend), ".877", grey(0.8765)),
        // There the axis is not made of length one, and the shape is sheared: .801.
        scene("rotation about a long axis", xml(PATH, "", &format!("{SKY}{rotated}")), ".867", grey(0.8666)),
        Case {
            files: vec![
                ("scenes/a.xml", xml(PATH, "", &format!(r#"{SKY}<include filename="../parts/b.xml"/>"#))),
                ("parts/b.xml", br#"<scene version="3.0.0"><shape type="sphere"/></scene>"#.to_vec()),
            ],
            render: "scenes/a.xml",
            ..scene("an include from a parent folder", Vec::new(), "refused", grey(0.8765))
        },
        Case {
            says: &["no attribute 'vertex_color'"],
            ..scene(
                "an attribute that the mesh lacks",
                xml(
                    PATH,
                    "",
                    &format!(
                        r#"{SKY}<shape type="cube"><bsdf type="diffuse"><texture type="mesh_attribute" name="reflectance">
<string name="name" value="vertex_color"/></texture></bsdf></shape>"#
                    ),
                ),
                "black",
                Right::Refused,
            )
        },
    ];
    check("mitsuba", &cases);
}

/// As version 0.6 wrote it, a material on a plate under a sky of one, seen from the front.
fn old(bsdf: &str) -> Vec<u8> {
    format!(
        r#"<scene version="0.6.0"><integrator type="path"><integer name="maxDepth" value="2"/></integrator>
<sensor type="orthographic"><transform name="toWorld"><lookAt origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="ldrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><float name="gamma" value="-1"/>
<rfilter type="box"/></film><sampler type="ldsampler"><integer name="sampleCount" value="256"/></sampler></sensor>
<emitter type="constant"/><shape type="rectangle"><transform name="toWorld"><scale value="2"/></transform>{bsdf}</shape>
</scene>"#
    )
    .into_bytes()
}

/// Models that Mitsuba had and has no more. Under a sky of one a plate shows its albedo head on, which quadrature over
/// the formulas of the manual of 0.6 gives.
#[test]
fn mitsuba_0_6() {
    let reflectances =
        r#"<rgb name="diffuseReflectance" value=".3"/><rgb name="specularReflectance" value=".3"/>"#;
    let row = |name, bsdf: String, right, says| Case { says, ..scene(name, old(&bsdf), "refused", right) };
    let cases = [
        // .3 + .3 (n + 2)/2π ∫ cosⁿ θ cos θ dω = .3 + .3 for the normalised lobe seen head on.
        row(
            "phong",
            format!(r#"<bsdf type="phong">{reflectances}<float name="exponent" value="40"/></bsdf>"#),
            Right::Mean([0.6; 3], 0.002),
            &["maxDepth to max_depth", "phong to", "ldrfilm to hdrfilm", "toWorld to to_world"],
        ),
        row(
            "phong that would make light",
            r#"<bsdf type="phong"><rgb name="diffuseReflectance" value="0.9"/>
<rgb name="specularReflectance" value="0.9"/></bsdf>"#
                .into(),
            Right::Mean([0.99; 3], 0.003),
            &["phong to"],
        ),
        row(
            "ward",
            format!(
                r#"<bsdf type="ward"><string name="variant" value="balanced"/>{reflectances}
<float name="alphaU" value="0.1"/><float name="alphaV" value="0.3"/></bsdf>"#
            ),
            Right::Mean([0.585; 3], 0.004),
            &["alphaU to alpha_u"],
        ),
        row(
            "roughdiffuse",
            r#"<bsdf type="roughdiffuse"><float name="alpha" value="0.3"/></bsdf>"#.into(),
            Right::Mean([0.4809; 3], 0.004),
            &["roughdiffuse to oren_nayar"],
        ),
        row(
            "roughdiffuse by its older name",
            r#"<bsdf type="roughdiffuse"><rgb name="diffuseReflectance" value=".25"/></bsdf>"#.into(),
            Right::Mean([0.2448; 3], 0.004),
            &["roughdiffuse to oren_nayar"],
        ),
        // The value is Mitsuba 3.9.1's for Cu.
        Case {
            before: "a mirror",
            ..row(
                "copper where nothing is said",
                r#"<bsdf type="conductor"/>"#.into(),
                Right::Mean([0.952, 0.620, 0.511], 0.003),
                &["conductor without a material to copper"],
            )
        },
        Case {
            files: vec![(
                "a.xml",
                String::from_utf8_lossy(&old(r#"<bsdf type="diffuse"/>"#))
                    .replace("</integrator>", r#"<boolean name="strictNormals" value="true"/></integrator>"#)
                    .into_bytes(),
            )],
            ..row(
                "strict normals",
                String::new(),
                Right::Mean([0.5; 3], 0.003),
                &["strictNormals to nothing"],
            )
        },
    ];
    check("mitsuba 0.6", &cases);
}
