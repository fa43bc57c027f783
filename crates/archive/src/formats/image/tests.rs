use super::*;
use std::path::PathBuf;
use yugen_optics::random::Pcg32;

fn noise(width: usize, height: usize, channels: &[&str]) -> Image {
    let mut rng = Pcg32::new(7, 1);
    let mut image = Image::new(width, height, channels);
    // Smooth enough to exercise run lengths and the predictor, with a highlight.
    for (i, v) in image.data.iter_mut().enumerate() {
        *v = if i % 7 < 4 { 0.25 } else { rng.next_f32() };
    }
    image.data[5] = 1000.0;
    image
}

fn round_trip(name: &str, image: &Image, write: &WriteOptions, read: &ReadOptions) -> Image {
    read_bytes(&write_bytes(name.as_ref(), image, write).unwrap(), name.as_ref(), read).unwrap()
}

fn worst(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.width, a.height, &a.channels), (b.width, b.height, &b.channels));
    a.data.iter().zip(&b.data).map(|(a, b)| (a - b).abs() / b.abs().max(1e-3)).fold(0.0, f32::max)
}

#[test]
fn exr_keeps_every_bit_of_every_channel() {
    let names = [
        "R",
        "G",
        "B",
        "A",
        "albedo.R",
        "albedo.G",
        "albedo.B",
        "depth.Z",
        "a_channel_with_a_name_of_more_than_31_letters",
    ];
    let mut image = noise(37, 35, &names);
    image.data[100] = -3.5e-30;
    let options =
        WriteOptions { metadata: vec![("renderer".into(), "päth".into())], ..WriteOptions::default() };
    let back = round_trip("a.exr", &image, &options, &ReadOptions::default()).select(&names).unwrap();
    assert_eq!(back, image);
    // Twice the same bytes, and the attribute is there.
    let bytes = write_bytes("a.exr".as_ref(), &image, &options).unwrap();
    assert_eq!(bytes, write_bytes("a.exr".as_ref(), &image, &options).unwrap());
    assert!(bytes.windows(13).any(|w| w == "renderer\0stri".as_bytes()));

    let half = round_trip("a.exr", &image, &WriteOptions { half: true, ..options }, &ReadOptions::default());
    let half = half.select(&names).unwrap();
    // 11 bits of mantissa: half of 2^-10 relative, and small numbers become subnormal.
    assert!(worst(&half, &image) <= 0.5f32.powi(11), "{}", worst(&half, &image));
}

#[test]
fn layers_come_in_a_readable_order() {
    let image = noise(
        3,
        2,
        &["normal.Z", "A", "albedo.B", "albedo.G", "B", "G", "R", "albedo.R", "normal.X", "normal.Y"],
    );
    let back = round_trip("a.exr", &image, &WriteOptions::default(), &ReadOptions::default());
    let wanted = ["R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B", "normal.X", "normal.Y", "normal.Z"];
    assert_eq!(back.channels, wanted);
    assert_eq!(back, image.select(&wanted).unwrap());
}

#[test]
fn chromaticities_convert_all_colours_and_nothing_else() {
    let mut image = Image::new(2, 1, &["R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "A"]);
    image
        .data
        .copy_from_slice(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 0.2, 0.3, 0.4, -1.0, 0.5]);
    let written = WriteOptions::from(ColourSpace::LinearRec2020);
    let back = round_trip("a.exr", &image, &written, &ReadOptions::to(ColourSpace::LinearSrgb));
    let back = back.select(&["R", "G", "B", "albedo.R", "albedo.G", "albedo.B", "normal.X", "A"]).unwrap();
    // ITU-R BT.2407, table 2: BT.2020 to BT.709.
    let expected = [1.6605, -0.1246, -0.0182, -0.5876, 1.1329, -0.1006, 0.5, 1.0];
    for (a, b) in back.pixel(0, 0).iter().zip(expected) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    assert!((back.pixel(1, 0)[0] - 1.0).abs() < 1e-5);
    assert_eq!(back.pixel(1, 0)[6..], [-1.0, 0.5]);
    // A source given by hand outranks the file.
    let same =
        ReadOptions { source: Some(ColourSpace::LinearSrgb), ..ReadOptions::to(ColourSpace::LinearSrgb) };
    assert_eq!(round_trip("a.exr", &image, &written, &same).pixel(0, 0)[..3], [1.0, 0.0, 0.0]);
}

#[test]
fn hdr_comes_back_within_its_eight_bits() {
    let to_srgb = ReadOptions::to(ColourSpace::LinearSrgb);
    for width in [1, 7, 8, 300] {
        let image = noise(width, 9, &["R", "G", "B"]);
        let back = round_trip("a.hdr", &image, &WriteOptions::from(ColourSpace::LinearSrgb), &to_srgb);
        for (a, b) in back.data.chunks(3).zip(image.data.chunks(3)) {
            let largest = b.iter().copied().fold(0.0, f32::max);
            for (a, b) in a.iter().zip(b) {
                // Half a step of a mantissa that is at least 128, and rounding up to 255 at its end.
                assert!((a - b).abs() <= largest / 255.0, "{a} {b}");
            }
        }
    }
    for edge in [0.0, 1e-40, 1e-30, 254.9 / 256.0, 255.4 / 256.0, 255.6 / 256.0, 0.9999999, 1.0, 1.5e38] {
        let mut image = Image::rgb(1, 1);
        image.data.fill(edge);
        let back = round_trip("a.hdr", &image, &WriteOptions::from(ColourSpace::LinearSrgb), &to_srgb);
        assert!((back.data[0] - edge).abs() <= edge / 255.0 + 1e-30, "{edge} {}", back.data[0]);
    }
}

#[test]
fn hdr_orientations_exposure_and_old_runs() {
    let file = |header: &str, size: &str, pixels: &[u8]| {
        let mut f = format!("#?RADIANCE\n# a comment\n{header}\n\n{size}\n").into_bytes();
        f.extend(pixels);
        read_bytes(&f, "x.hdr".as_ref(), &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap()
    };
    let rgbe = "FORMAT=32-bit_rle_rgbe";
    let two = [128, 64, 32, 129, 64, 64, 64, 129];
    let first = [1.0, 0.5, 0.25];
    for (size, at) in [
        ("-Y 1 +X 2", (0, 0)),
        ("-Y 1 -X 2", (1, 0)),
        ("+Y 2 +X 1", (0, 1)),
        ("-Y 2 -X 1", (0, 0)),
        ("+X 2 -Y 1", (0, 0)),
        ("-X 2 +Y 1", (1, 0)),
        ("+X 1 +Y 2", (0, 1)),
    ] {
        assert_eq!(file(rgbe, size, &two).pixel(at.0, at.1), first, "{size}");
    }
    let exposed = file(&format!("EXPOSURE=2\n{rgbe}\nEXPOSURE= 2.0"), "-Y 1 +X 2", &two);
    assert_eq!(exposed.pixel(0, 0), [0.25, 0.125, 0.0625]);
    // One pixel, then two repeats of it, and 256 · 1 more.
    let runs = [128, 64, 32, 129, 1, 1, 1, 2, 1, 1, 1, 1];
    let image = file(rgbe, "-Y 1 +X 259", &runs);
    assert!(image.data.chunks(3).all(|p| p == first));
    // White in XYZ is white.
    let white = file("FORMAT=32-bit_rle_xyze", "-Y 1 +X 1", &[128, 128, 128, 129]);
    assert!(white.data.iter().all(|v| (v - 1.0).abs() < 1e-5), "{white:?}");
}

#[test]
fn integers_are_display_values_unless_raw() {
    let srgb = ColourSpace::LinearSrgb;
    let image = Image { width: 2, height: 1, channels: vec!["Y".into()], data: vec![0.2141, 1.7] };
    let eight = round_trip("a.png", &image, &WriteOptions::from(srgb), &ReadOptions::raw());
    // IEC 61966-2-1: linear 0.2141 is just above display value 0.5, here 128 / 255.
    assert_eq!(eight.data, [128.0 / 255.0, 1.0]);
    let deep = WriteOptions { bits: 16, ..WriteOptions::from(srgb) };
    let back = round_trip("a.png", &image, &deep, &ReadOptions::to(srgb));
    assert!((back.data[0] - 0.2141).abs() < 2e-5, "{}", back.data[0]);

    // Alpha: premultiplied inside, straight and linear in the file.
    let mut image = Image::new(1, 1, &["R", "G", "B", "A"]);
    image.data.copy_from_slice(&[0.25, 0.125, 0.0, 0.25]);
    let raw = round_trip("a.png", &image, &deep, &ReadOptions::raw());
    assert_eq!(raw.data[0], 1.0);
    assert!((raw.data[1] - 0.735357).abs() < 2e-5 && (raw.data[3] - 0.25).abs() < 2e-5, "{raw:?}");
    let linear = round_trip("a.png", &image, &deep, &ReadOptions::to(srgb));
    assert!((linear.data[1] - 0.5).abs() < 2e-5 && (linear.data[3] - 0.25).abs() < 2e-5);

    let wide = round_trip("a.png", &image, &deep, &ReadOptions::default());
    assert!((wide.data[0] - (0.6274 + 0.5 * 0.3293)).abs() < 2e-4, "converted to Rec. 2020: {wide:?}");

    let grey = Image {
        width: 16,
        height: 16,
        channels: ["R", "G", "B"].map(String::from).to_vec(),
        data: vec![0.5; 768],
    };
    let jpeg = round_trip("a.jpg", &grey, &WriteOptions::from(srgb), &ReadOptions::to(srgb));
    assert!(jpeg.data.iter().all(|v| (v - 0.5).abs() < 0.01), "two steps of 1/255 in display values");
    let error = write_bytes("a.webp".as_ref(), &grey, &WriteOptions::default()).unwrap_err().to_string();
    assert!(error.contains("a.webp") && error.contains(".exr, .hdr"), "{error}");
    assert!(can_write("a.PNG".as_ref()).is_ok() && can_write("a".as_ref()).is_err());
}

#[test]
fn unusable_values_are_counted_replaced_and_never_written() {
    let image =
        Image { width: 3, height: 1, channels: vec!["R".into()], data: vec![f32::NAN, f32::INFINITY, 2.0] };
    let bytes = write_bytes("a.exr".as_ref(), &image, &WriteOptions::default()).unwrap();
    let strict = ReadOptions { non_finite: NonFinite::Refuse, ..ReadOptions::default() };
    assert_eq!(read_bytes(&bytes, "a.exr".as_ref(), &strict).unwrap().data, [0.0, 65504.0, 2.0]);
    // What others write: the float's bits put in by hand into an uncompressed block.
    let at = bytes.windows(4).rposition(|w| w == 2.0f32.to_le_bytes()).unwrap();
    let mut broken = bytes.clone();
    broken[at..at + 4].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
    assert_eq!(read_bytes(&broken, "a.exr".as_ref(), &ReadOptions::default()).unwrap().data[2], -65504.0);
    let error = read_bytes(&broken, "a.exr".as_ref(), &strict).unwrap_err().to_string();
    assert!(error.contains("1 of 3 values are not finite"), "{error}");
}

#[test]
fn lying_headers_cost_nothing() {
    let refuse = |bytes: &[u8], name: &str, words: &str| {
        let error = read_bytes(bytes, name.as_ref(), &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with(name) && error.contains(words), "{error}");
    };
    refuse(b"#?RADIANCE\n\n-Y 60000 +X 60000\n", "a.hdr", "more than the limit of 268435456");
    refuse(b"#?RADIANCE\n\n-Y 9000 +X 9000\n", "a.hdr", "ends within the picture");
    refuse(b"#?RADIANCE\n\n-Y 0 +X 4\n", "a.hdr", "empty");
    refuse(b"#?RADIANCE\nFORMAT=dots\n", "a.hdr", "32-bit_rle_rgbe");
    refuse(b"#?RADIANCE\n\nhello\n", "a.hdr", "'hello' is no size");
    refuse(b"no picture", "a.bin", "no picture of a known format");
    refuse(b"", "a.exr", "a.exr");

    // The same picture, its window enlarged in the header.
    let small =
        write_bytes("a.exr".as_ref(), &noise(8, 8, &["R", "G", "B"]), &WriteOptions::default()).unwrap();
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = small.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 8;
    for (size, words) in [(60000i32, "more than the limit"), (9000, "cut off or damaged")] {
        let mut lie = small.clone();
        lie[at..at + 4].copy_from_slice(&(size - 1).to_le_bytes());
        lie[at + 4..at + 8].copy_from_slice(&(size - 1).to_le_bytes());
        refuse(&lie, "a.exr", words);
    }
    let png =
        write_bytes("a.png".as_ref(), &noise(8, 8, &["R", "G", "B"]), &WriteOptions::default()).unwrap();
    let strict = ReadOptions { max_samples: 8 * 8 * 3 - 1, ..ReadOptions::default() };
    assert!(matches!(read_bytes(&png, "a.png".as_ref(), &strict), Err(Error::TooLarge { asked: 192, .. })));
}

#[test]
fn x_y_z_are_a_colour_and_layers_have_names() {
    let to = ReadOptions::to(ColourSpace::LinearSrgb);
    // The tristimulus values of the sRGB primaries, IEC 61966-2-1.
    let mut image = Image::new(3, 1, &["X", "Y", "Z"]);
    image.data.copy_from_slice(&[0.4124, 0.2126, 0.0193, 0.3576, 0.7152, 0.1192, 0.1805, 0.0722, 0.9505]);
    let back = round_trip("a.exr", &image, &WriteOptions::default(), &to).select(&["R", "G", "B"]).unwrap();
    for (i, v) in back.data.iter().enumerate() {
        assert!((v - f32::from(u8::from(i % 4 == 0))).abs() < 1e-3, "{back:?}");
    }
    let raw = round_trip("a.exr", &image, &WriteOptions::default(), &ReadOptions::raw());
    assert_eq!(raw.select(&["X", "Y", "Z"]).unwrap(), image);

    let names = ["ViewLayer.Depth.Z", "ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"];
    let image = noise(3, 2, &names);
    assert_eq!((default_layer(&image), layers(&image).len()), (Some("ViewLayer.Combined"), 2));
    let picked = layer(&image, "ViewLayer.Combined").unwrap();
    assert_eq!(picked.channels, ["R", "G", "B"]);
    assert_eq!(picked.data, image.select(&names[1..]).unwrap().data);
    assert!(layer(&image, "ViewLayer").is_none() && default_layer(&picked).is_none());
    let two = noise(1, 1, &["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"]);
    assert_eq!((default_layer(&two), colour_layers(&two)), (None, vec!["a", "b"]));
}

/// `exrenvmap` of OpenEXR 3 made a cube of side 8 from a latitude-longitude picture of three waves; the cube of ours
/// holds the same waves, written down texel by texel as its documentation has them.
#[test]
fn cubes_become_panoramas() {
    let side = 64;
    let wave = |d: Vec3| [0.5 + 0.5 * d.x, 0.5 + 0.5 * d.y, 0.5 + 0.5 * d.z];
    let mut cube = Image::rgb(side, 6 * side);
    let at = |i: usize| 2.0 * i as f32 / (side - 1) as f32 - 1.0;
    for face in 0..6 {
        for y in 0..side {
            for x in 0..side {
                // Columns run to the right, rows down, as someone sees them who stands inside.
                let (u, v) = (at(x), -at(y));
                let d = [
                    Vec3::new(1.0, v, u),
                    Vec3::new(-1.0, v, -u),
                    Vec3::new(u, 1.0, v),
                    Vec3::new(u, -1.0, -v),
                    Vec3::new(-u, v, 1.0),
                    Vec3::new(u, v, -1.0),
                ][face];
                cube.pixel_mut(x, face * side + y).copy_from_slice(&wave(d.normalize()));
            }
        }
    }
    let panorama = super::cube::panorama(&cube);
    assert_eq!((panorama.width, panorama.height), (256, 128));
    for y in 0..128 {
        for x in 0..256 {
            let lat = std::f32::consts::PI * (0.5 - (y as f32 + 0.5) / 128.0);
            let lon = std::f32::consts::TAU * (0.5 - (x as f32 + 0.5) / 256.0);
            let d = Vec3::new(lon.sin() * lat.cos(), lat.sin(), lon.cos() * lat.cos());
            for (a, b) in panorama.pixel(x, y).iter().zip(wave(d)) {
                assert!((a - b).abs() < 2e-3, "{d}: {a} {b}");
            }
        }
    }
}

#[test]
fn what_exr_files_hold_that_is_not_read_is_named() {
    let mut bytes =
        write_bytes("a.exr".as_ref(), &noise(4, 4, &["R", "G", "B"]), &WriteOptions::default()).unwrap();
    let name = b"compression\0compression\0\x01\0\0\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    for (code, what) in [(10, "HTJ2K256"), (11, "HTJ2K32"), (13, "ZSTD")] {
        bytes[at] = code;
        let error = read_bytes(&bytes, "a.exr".as_ref(), &ReadOptions::default()).unwrap_err().to_string();
        assert!(
            error.contains(&format!("{what} compression is not supported; write it with ZIP")),
            "{error}"
        );
    }
}

#[test]
fn bitmaps_targas_and_netpbm() {
    let srgb = ReadOptions::to(ColourSpace::LinearSrgb);
    let check = |bytes: &[u8], name: &str| {
        let image = read_bytes(bytes, name.as_ref(), &srgb).unwrap();
        let image = image.select(&["R", "G", "B"]).unwrap();
        assert_eq!((image.width, image.height), (2, 1), "{name}");
        let right = [1.0, 0.0, 0.0, 0.0, 0.0, 0.2158605];
        assert!(image.data.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-6), "{name}: {image:?}");
    };
    // A red pixel and a blue one of 128, as blue, green, red; rows of a bitmap fill up to four bytes.
    let mut bmp = b"BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x02\0\0\0\x01\0\0\0\x01\0\x18\0".to_vec();
    bmp.extend([0; 24]);
    bmp.extend([0, 0, 255, 128, 0, 0, 0, 0]);
    check(&bmp, "a.bmp");
    let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0x20];
    tga.extend([0, 0, 255, 128, 0, 0]);
    check(&tga, "a.tga");
    tga.extend([0; 8]);
    tga.extend(b"TRUEVISION-XFILE.\0");
    check(&tga, "no name");
    check(b"P3 2 1 255 255 0 0 0 0 128\n", "a.ppm");
    check(b"P6 2 1 255\n\xff\0\0\0\0\x80", "also without a name");
}

/// The folder of real data, or `None` after saying so; its absence fails in CI.
fn data(file: &str) -> Option<PathBuf> {
    match std::env::var_os("YUGEN_DATA") {
        Some(folder) => Some(PathBuf::from(folder).join(file)),
        None => {
            assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must be set in CI");
            println!("skipped: YUGEN_DATA is not set");
            None
        }
    }
}

#[test]
fn files_of_others_read_as_mitsuba_reads_them() {
    // Mitsuba 3.9.1, Bitmap converted to linear Float32: channels, means, pixel (17, 23).
    type Case = (&'static str, &'static [&'static str], &'static [f64], &'static [f32]);
    let cases: [Case; 6] = [
        (
            "hdr/pmndrs_night.exr",
            &["R", "G", "B"],
            &[0.07322809909783246, 0.06454613091500505, 0.05548633931675795],
            &[0.041015625, 0.046417236328125, 0.0517578125],
        ),
        (
            "hdr/spiaggia_di_mondello_1k.hdr",
            &["R", "G", "B"],
            &[0.6595416552154347, 0.6791315437294543, 0.720519513473846],
            &[0.048828125, 0.123046875, 0.30078125],
        ),
        (
            "mitsuba/common/textures/museum.exr",
            &["R", "G", "B"],
            &[0.3969617462748829, 0.3162113090775165, 0.2783603388152187],
            &[0.239501953125, 0.14208984375, 0.0791015625],
        ),
        (
            "mitsuba/common/textures/wood.jpg",
            &["R", "G", "B"],
            &[0.31588515438731113, 0.2717730110004319, 0.24663406042151095],
            &[0.30054375529289246, 0.25818273425102234, 0.21952612698078156],
        ),
        (
            "mitsuba/common/textures/leaf_mask.png",
            &["Y", "A"],
            &[0.44393536847796655, 0.9999668435252858],
            &[0.0, 1.0],
        ),
        (
            "mesh/spot/spot_texture.png",
            &["R", "G", "B"],
            &[0.9305537965492822, 0.776928596942569, 0.7105637920483583],
            &[1.0, 0.8549923896789551, 0.7912980318069458],
        ),
    ];
    for (file, channels, means, pixel) in cases {
        let Some(path) = data(file) else { return };
        let image = read(&path, &ReadOptions::to(ColourSpace::LinearSrgb)).unwrap();
        assert_eq!(image.channels, channels, "{file}");
        // JPEG decoders may differ by a step of 1/255 here and there; all others are exact.
        let step = if file.ends_with("jpg") { 0.01 } else { 1e-6 };
        for (c, mean) in means.iter().enumerate() {
            let sum: f64 = image.data.iter().skip(c).step_by(channels.len()).map(|&v| f64::from(v)).sum();
            let ours = sum / (image.width * image.height) as f64;
            assert!((ours - mean).abs() <= mean * f64::from(step), "{file} {c}: {ours} {mean}");
        }
        for (a, b) in image.pixel(17, 23).iter().zip(pixel) {
            assert!((a - b).abs() <= step, "{file}: {a} {b}");
        }
    }
}
