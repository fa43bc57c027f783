//! Wavefront OBJ and MTL.

use crate::{Case, Right, check};
use std::path::Path;
use yugen_archive::formats::image::{WriteOptions, write_bytes};
use yugen_optics::Image;

const CORNERS: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
const MAPPED: &str = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

/// Sees from the front, without perspective, so much across of what a file holds.
fn scene(width: &str, rest: &str) -> Vec<u8> {
    format!(
        "[scene]\nworking_space = \"srgb\"\n[camera]\nfrom = [0, 0, 5]\nto = [0, 0, 0]\nwidth = {width}\n[film]\n\
         size = [32, 32]\nfilter = \"box\"\n[render]\nsamples = 16\nintegrator = \"direct\"\n{rest}"
    )
    .into_bytes()
}

/// The file shines: its area in a quarter of which a square of two by two fills.
fn glowing(file: &str) -> Vec<u8> {
    scene(
        "4",
        &format!("[[shape]]\ntype = \"file\"\nfile = \"{file}\"\nemission = 1.0\nemits_both_sides = true\n"),
    )
}

/// A case whose OBJ file has to read as a square.
fn syntax(
    name: &'static str,
    obj: impl Into<Vec<u8>>,
    before: &'static str,
    says: &'static [&'static str],
) -> Case {
    let files = vec![
        ("scene.toml", glowing("a.obj")),
        ("a.obj", obj.into()),
        ("red.mtl", b"newmtl red\nKd 1 0 0\n".to_vec()),
        ("two words.mtl", b"newmtl red\nKd 1 0 0\n".to_vec()),
    ];
    Case { name, files, render: "scene.toml", before, right: Right::Mean([0.25; 3], 1e-5), says }
}

/// A square with a material under a sky of one.
fn finish(
    name: &'static str,
    mtl: impl Into<Vec<u8>>,
    before: &'static str,
    right: Right,
    says: &'static [&'static str],
) -> Case {
    let rest = "[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"file\"\nfile = \"a.obj\"\n";
    let files = vec![
        ("scene.toml", scene("2", rest)),
        ("a.obj", format!("mtllib a.mtl\n{CORNERS}{MAPPED}").into_bytes()),
        ("a.mtl", mtl.into()),
        ("split.png", split()),
        ("half split 01.png", split()),
        ("white.png", picture(|_, _| [1.0; 3])),
        ("bluish.png", picture(|_, _| [0.5, 0.5, 1.0])),
    ];
    Case { name, files, render: "scene.toml", before, right, says }
}

fn picture(colour: fn(usize, usize) -> [f32; 3]) -> Vec<u8> {
    let mut image = Image::rgb(64, 64);
    for y in 0..64 {
        for x in 0..64 {
            image.pixel_mut(x, y).copy_from_slice(&colour(x, y));
        }
    }
    write_bytes(Path::new("a.png"), &image, &WriteOptions { raw: true, ..WriteOptions::default() }).unwrap()
}

/// White in its left quarter, else black.
fn split() -> Vec<u8> {
    picture(|x, _| [if x < 16 { 1.0 } else { 0.0 }; 3])
}

/// The means of the eighths of a picture from left to right, as digits from 0 (black) to 9 (white).
fn eighths(image: &Image) -> String {
    let one = |i: usize| {
        let (first, last) = (i * image.width / 8, (i + 1) * image.width / 8);
        let sum: f32 = (0..image.height)
            .flat_map(|y| (first..last).map(move |x| (x, y)))
            .map(|(x, y)| image.pixel(x, y)[0])
            .sum();
        let mean = sum / (image.height * (last - first)) as f32;
        char::from_digit((9.0 * mean).round() as u32, 10).unwrap_or('?')
    };
    (0..8).map(one).collect()
}

fn looks(image: &Image, right: &str) -> Result<String, String> {
    let found = eighths(image);
    if found == right { Ok(found) } else { Err(format!("the eighths are {found}, right is {right}")) }
}

#[test]
fn obj() {
    let square = |more: &str| format!("{CORNERS}{more}");
    let utf16: Vec<u8> =
        format!("\u{feff}{}", square("f 1 2 3 4\n")).encode_utf16().flat_map(u16::to_le_bytes).collect();
    let refused = "refused";
    let mut cases = vec![
        syntax("byte-order mark", format!("\u{feff}{}", square("f 1 2 3 4")), refused, &[]),
        syntax("UTF-16", utf16, refused, &[]),
        syntax(
            "comments behind values",
            square("f 1 2 3 4 # all four").replace(" 0\n", " 0 # one\n"),
            refused,
            &[],
        ),
        syntax("continued line with blanks", square("f 1 2 \\ \n 3 4\n"), refused, &[]),
        syntax("carriage returns", square("f 1 2 3 4\n").replace('\n', "\r"), refused, &[]),
        syntax(
            "carriage returns and line feeds",
            square("f 1 2 \\\n3 4\n").replace('\n', "\r\n"),
            "0.25",
            &[],
        ),
        syntax("1//", square("f 1// 2// 3// 4//\n"), refused, &[]),
        syntax("1/", square("f 1/ 2/ 3/ 4/\n"), refused, &[]),
        syntax("1/1/", square("vt 0 0\nf 1/1/ 2/1/ 3/1/ 4/1/\n"), refused, &[]),
        syntax("uneven corners", square("vt 0 0\nf 1/1 2/1 3 4\n"), "0.25", &[]),
        syntax("form feed", square("\x0cf 1 2 3 4\n"), refused, &[]),
        syntax("faces before vertices", format!("f 1 2 3 4\n{CORNERS}"), refused, &[]),
        syntax(
            "-1.#IND",
            square("vt 0 0 0\nvt -1.#IND00 -1.#IND00 -1.#IND00\nf 1/1 2/2 3/1 4/1\n"),
            refused,
            &["texture coordinates that are no numbers count as missing: 3"],
        ),
        syntax(
            "nan in a normal",
            square("vn nan nan nan\nf 1//1 2//1 3//1 4//1\n"),
            refused,
            &["no numbers"],
        ),
        syntax("zero index", square("vn 0 0 1\nf 1/0/1 2/0/1 3/0/1 4/0/1\n"), refused, &["count as missing"]),
        syntax(
            "two corners",
            square("f 1 2\nf 2 3\nf 1 2 3 4\n"),
            refused,
            &["faces of fewer than three corners are skipped: 2"],
        ),
        syntax(
            "unknown words",
            square("vw 0 1 .5\nvw 0 1 .5\nf 1 2 3 4\n"),
            refused,
            &["a.obj:5:1: unknown OBJ statement 'vw' is skipped (2 times)"],
        ),
        syntax("curves", square("vp 0 1\nf 1 2 3 4\n"), "silent", &["'vp' is skipped: free-form curves"]),
        syntax("upper case", square("f 1 2 3 4\n").to_uppercase(), refused, &[]),
        syntax("faces of version 2", square("fo 1 2 3 4\n"), refused, &[]),
        syntax(
            "several libraries",
            format!("mtllib red.mtl two words.mtl\n{}", square("f 1 2 3 4")),
            refused,
            &[],
        ),
        syntax(
            "library in quotes",
            format!("mtllib \"two words.mtl\"\n{}", square("f 1 2 3 4")),
            refused,
            &[],
        ),
        syntax("library with blanks", format!("mtllib two words.mtl\n{}", square("f 1 2 3 4")), "0.25", &[]),
        syntax(
            "missing library",
            format!("mtllib gone.mtl\n{}", square("usemtl red\nf 1 2 3 4")),
            refused,
            &["there is no file 'gone.mtl'", "its materials are grey"],
        ),
        syntax(
            "library off by a letter",
            format!("mtllib rad.mtl\n{}", square("usemtl red\nf 1 2 3 4")),
            refused,
            &["there is no file 'rad.mtl'; did you mean 'red.mtl'?"],
        ),
        syntax(
            "missing material",
            format!("mtllib red.mtl\n{}", square("usemtl rad\nf 1 2 3 4")),
            "0.25",
            &["no library defines the material 'rad', it is grey; did you mean 'red'?"],
        ),
    ];
    let hollow = "v -1 -1 0\nv 0 0 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3 4\n";
    cases.push(Case {
        right: Right::Mean([1.0 / 16.0; 3], 2e-3),
        ..syntax("hollow corner", hollow, "twice the area", &[])
    });

    let twice = |first: &str, second: &str| {
        let entry = |at: &str| match at {
            "left" => "[[shape]]\ntype = \"file\"\nfile = \"a.obj\"\nmaterial = \"blue\"\nat = [-1, 0, 0]\n",
            _ => "[[shape]]\ntype = \"file\"\nfile = \"a.obj\"\nat = [1, 0, 0]\n",
        };
        let blue =
            "[material.blue]\nmodel = \"lambert\"\nreflectance = [0, 0, 1]\n[[light]]\ntype = \"constant\"\n";
        vec![
            ("scene.toml", scene("4", &format!("{blue}{}{}", entry(first), entry(second)))),
            ("a.obj", format!("mtllib a.mtl\n{CORNERS}usemtl m\nf 1 2 3 4\n").into_bytes()),
            ("a.mtl", b"newmtl m\nKd 1 0 0\n".to_vec()),
        ]
    };
    // Sky above and below; red and blue a quarter each.
    let right = || Right::Mean([0.75, 0.5, 0.75], 1e-3);
    for (name, order) in
        [("the same file twice", ["left", "right"]), ("in the other order", ["right", "left"])]
    {
        let files = twice(order[0], order[1]);
        cases.push(Case {
            name,
            files,
            render: "scene.toml",
            before: "the first decides",
            right: right(),
            says: &[],
        });
    }
    check("obj", &cases);
}

#[test]
fn mtl() {
    let white = "newmtl m\nKd 1 1 1\n";
    let map = |options: &str| format!("{white}map_Kd {options}\n");
    let mean = |rgb: [f32; 3]| Right::Mean(rgb, 5e-3);
    let quarter = || Right::Picture(|image| looks(image, "99000000"));
    let refused = "refused: no such file";
    let mut cases = vec![
        finish(
            "Kd times its picture",
            "newmtl m\nKd 0.25 0.5 1\nmap_Kd white.png\n",
            "1 1 1",
            mean([0.25, 0.5, 1.0]),
            &[],
        ),
        finish(
            "black Kd and a picture",
            "newmtl m\nKd 0 0 0\nmap_Kd white.png\n",
            "1 1 1",
            mean([1.0; 3]),
            &["Kd of material 'm' is black", "shown as it is"],
        ),
        finish("blanks in a name", map("half split 01.png"), refused, quarter(), &[]),
        finish("option and blanks", map("-clamp on half split 01.png"), refused, quarter(), &[]),
        finish("option behind the name", map("split.png -blendu on"), refused, quarter(), &[]),
        finish("other case", map("Split.PNG"), refused, quarter(), &[]),
        finish("folder of another disk", map("C:\\Users\\me\\split.png"), refused, quarter(), &[]),
        finish("-s", map("-s 2 2 1 split.png"), "ignored", Right::Picture(|i| looks(i, "90009000")), &[]),
        finish("-o", map("-o 0.25 0 0 split.png"), "ignored", Right::Picture(|i| looks(i, "00000099")), &[]),
        finish(
            "-clamp",
            map("-s 2 2 2 -clamp on split.png"),
            "ignored",
            Right::Picture(|i| looks(i, "90000000")),
            &[],
        ),
        finish("-mm", map("-mm 0.5 0.5 split.png"), "ignored", mean([0.625; 3]), &[]),
        finish("-imfchan", map("-imfchan b bluish.png"), "ignored", mean([1.0; 3]), &[]),
        finish("-t", map("-t 1 1 1 white.png"), "ignored", mean([1.0; 3]), &["the option -t", "turbulence"]),
        finish(
            "missing picture",
            map("spilt.png"),
            refused,
            mean([1.0; 3]),
            &[
                "there is no file 'spilt.png'; did you mean 'split.png'?",
                "'map_Kd' of material 'm' is skipped",
            ],
        ),
        finish(
            "no name",
            "newmtl m\nKd .3 .4 .5\nmap_Kd \n",
            "silent",
            mean([0.3, 0.4, 0.5]),
            &["names no picture"],
        ),
        finish("byte-order mark", format!("\u{feff}{white}"), "refused", mean([1.0; 3]), &[]),
        finish("xyz", "newmtl m\nKd xyz 0.4753 0.5 0.5445\n", "grey", mean([0.5; 3]), &[]),
        finish(
            "spectral",
            "newmtl m\nKd spectral a.rfl 1\n",
            "silent",
            mean([0.5; 3]),
            &["'Kd spectral a.rfl 1'", "not read"],
        ),
        finish("d", "newmtl m\nKd 0 0 0\nd 0.25\n", "0.75", mean([0.75; 3]), &[]),
        finish("d -halo", "newmtl m\nKd 0 0 0\nd -halo 0.25\n", "0: opaque", mean([0.75; 3]), &[]),
        finish("Tr", "newmtl m\nKd 0 0 0\nTr 0.25\n", "0.25", mean([0.25; 3]), &[]),
        finish("map_d by brightness", "newmtl m\nKd 0 0 0\nmap_d split.png\n", "0.75", mean([0.75; 3]), &[]),
        finish(
            "map_d times d",
            "newmtl m\nKd 0 0 0\nmap_d split.png\nd 0.5\n",
            "0.75",
            mean([0.875; 3]),
            &[],
        ),
        finish("matt illum", "newmtl m\nKd .8 .8 .8\nKs 1 1 1\nNs 50\nillum 1\n", "1.8", mean([0.8; 3]), &[]),
        finish(
            "sheet of glass",
            "newmtl m\nKd .8 .8 .8\nKs 1 1 1\nNi 1.5\nillum 4\n",
            "1.8",
            mean([1.0; 3]),
            &[],
        ),
        // Head on 0.04 come back and 0.96 go in, where radiance is larger by the square of the index.
        finish(
            "solid glass",
            "newmtl m\nKd .8 .8 .8\nKs 1 1 1\nNi 1.5\nTf 1 1 1\nillum 7\n",
            "1.8",
            mean([0.04 + 0.96 / 2.25; 3]),
            &[],
        ),
        finish(
            "glass without an index",
            "newmtl m\nKd .4 .4 .4\nillum 4\nTf 1 1 1\nNi 1.00\n",
            "0.4",
            mean([0.4; 3]),
            &[],
        ),
        finish(
            "Kd and Ks share",
            "newmtl m\nKd .8 .8 .8\nKs 1 .5 .5\nNs 50\n",
            "1.8 1.3 1.3",
            Right::Picture(|image| {
                let [r, g, _] = crate::mean(image);
                // The lobe takes all and returns its albedo head on, which is little below its Ks.
                let fine = (0.95..1.0001).contains(&r) && (0.45..0.5001).contains(&g);
                if fine { Ok(format!("{r:.3} {g:.3}")) } else { Err(format!("{r} {g}")) }
            }),
            &[],
        ),
        finish(
            "map_Ks",
            "newmtl m\nKd .8 .8 .8\nKs 1 1 1\nmap_Ks split.png\nNs 50\n",
            "ignored",
            Right::Picture(|image| {
                let eighths = eighths(image);
                // White in the lobe's quarter, the whole Kd in the others.
                if eighths == "99777777" { Ok(eighths) } else { Err(eighths) }
            }),
            &[],
        ),
        // A metal of this colour gives back what its facets do not hide: a little less than its colour.
        finish(
            "Pr and Pm",
            "newmtl m\nKd .8 .2 .2\nPr 0.2\nPm 1\n",
            "matt",
            Right::Mean([0.8, 0.2, 0.2], 2e-2),
            &[],
        ),
        finish(
            "displacement",
            format!("{white}disp split.png\n"),
            "silent",
            mean([1.0; 3]),
            &["'disp' is skipped: surfaces are not displaced"],
        ),
        finish(
            "unknown",
            format!("{white}Kx 1\n"),
            "silent",
            mean([1.0; 3]),
            &["unknown MTL statement 'Kx' is skipped"],
        ),
        finish("flat bump", format!("{white}bump white.png\n"), "silent", mean([1.0; 3]), &[]),
        finish("norm", format!("{white}norm bluish.png\n"), "silent", mean([1.0; 3]), &[]),
        finish(
            "bump that is norm",
            format!("{white}map_Bump -bm 1.0 bluish.png\n"),
            "silent",
            mean([1.0; 3]),
            &["has the colours of normals and is read as 'norm'"],
        ),
    ];

    // Pictures lie beside the library that names them.
    let mut beside = finish("picture beside its library", "", refused, quarter(), &[]);
    let files = &mut beside.files;
    files.retain(|(name, _)| *name != "a.mtl" && *name != "split.png");
    files[1].1 = format!("mtllib sub/a.mtl\n{CORNERS}{MAPPED}").into_bytes();
    files.extend([("sub/a.mtl", map("split.png").into_bytes()), ("sub/split.png", split())]);
    cases.push(beside);

    // A lamp above a floor; only Ke shines.
    let lamp = "mtllib a.mtl\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -.5 1 -.5\nv .5 1 -.5\nv .5 1 .5\nv -.5 1 .5\n\
                usemtl white\nf 1 4 3 2\nusemtl lamp\nf 5 6 7 8\n";
    let above = "[camera]\nfrom = [0, 5, 0]\nto = [0, 0, 0]\nup = [0, 0, 1]\nwidth = 1\n[film]\nsize = [16, 16]\n[[shape]]\n\
                 type = \"file\"\nfile = \"a.obj\"\n[render]\nsamples = 16\n";
    cases.push(Case {
        name: "Ke",
        files: vec![
            ("scene.toml", above.into()),
            ("a.obj", lamp.into()),
            ("a.mtl", b"newmtl white\nKd .8 .8 .8\nnewmtl lamp\nKd 0 0 0\nKe 10 10 10\n".to_vec()),
        ],
        render: "scene.toml",
        before: "black",
        // The lamp fills the view from behind: both sides look alike.
        right: Right::Mean([10.0; 3], 1e-2),
        says: &[],
    });

    // Inside a box whose walls give back 0.9 of what arrives, radiance is at most ten times what is put in.
    let cube = "mtllib a.mtl\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nusemtl m\n\
                f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n";
    let inside = "[camera]\nfrom = [0, 0, 0.9]\nto = [0, 0, 0]\nfov = 60\n[film]\nsize = [16, 16]\n[render]\nsamples = 64\n\
                  [[light]]\ntype = \"point\"\nat = [0, 0.5, 0]\n[[shape]]\ntype = \"file\"\nfile = \"a.obj\"\n";
    cases.push(Case {
        name: "a closed box",
        files: vec![
            ("scene.toml", inside.into()),
            ("a.obj", cube.into()),
            ("a.mtl", b"newmtl m\nKd .8 .8 .8\nKs .5 .5 .5\nNs 225\nillum 2\n".to_vec()),
        ],
        render: "scene.toml",
        before: "grows without end: 72",
        right: Right::Picture(|image| {
            let [r, ..] = crate::mean(image);
            // Power of 4π over an area of 24 with an albedo of at most 0.9: irradiance of at most 5.2, of which
            // 0.9 / π leave; and more than the light alone brings to the walls.
            if (0.2..1.5).contains(&r) { Ok(format!("{r:.2}")) } else { Err(format!("{r}")) }
        }),
        says: &[],
    });
    check("mtl", &cases);
}
