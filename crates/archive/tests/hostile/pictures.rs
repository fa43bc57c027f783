//! Pictures.

use crate::{FILE, assault_with, mutate};
use std::path::Path;
use yugen_archive::formats::image::rows::Rows;
use yugen_archive::formats::image::{ReadOptions, WriteOptions, about_bytes, read_bytes, write_bytes};
use yugen_optics::Image;

fn picture(channels: &[&str]) -> Image {
    let mut image = Image::new(13, 9, channels);
    for (i, v) in image.data.iter_mut().enumerate() {
        *v = if i % 5 < 3 { 0.25 } else { (i % 11) as f32 / 10.0 };
    }
    image
}

/// Pictures may have 2^16 samples here, a quarter of a mebibyte. The libraries that decode them hold the
/// picture up to three times, and tables of their own.
fn assault_pictures(name: &str, seeds: &[Vec<u8>]) {
    let options = ReadOptions { max_samples: 1 << 16, ..ReadOptions::default() };
    assault_with(name, seeds, 3_000, mutate, |b| match read_bytes(b, Path::new(FILE), &options) {
        Ok(image) => {
            assert_eq!(image.data.len(), image.width * image.height * image.channels.len());
            assert!(image.data.iter().all(|v| v.is_finite()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

/// What is told of a picture.
#[test]
fn facts_of_pictures() {
    let told = WriteOptions { metadata: vec![("who".into(), "x".into())], ..WriteOptions::default() };
    let seeds = [
        written("a.exr", &["R", "G", "B"], &told),
        exr_seed(exr::prelude::Compression::ZIP16, true),
        written("a.png", &["R", "G", "B", "A"], &WriteOptions::default()),
        written("a.hdr", &["R", "G", "B"], &WriteOptions::default()),
    ];
    assault_with("image facts", &seeds, 3_000, mutate, |b| match about_bytes(b, Path::new(FILE), 1 << 16) {
        Ok(about) => {
            let pixels = (about.width * about.height) as u64;
            assert!(about.channels.iter().all(|c| c.negative + c.not_finite <= pixels));
            assert!(about.channels.iter().flat_map(|c| c.range).all(|[low, high]| low <= high));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

fn written(name: &str, channels: &[&str], options: &WriteOptions) -> Vec<u8> {
    write_bytes(Path::new(name), &picture(channels), options).unwrap()
}

/// What others write: parts, tiles and every compression.
fn exr_seed(compression: exr::prelude::Compression, tiles: bool) -> Vec<u8> {
    use exr::prelude::*;
    let blocks = if tiles { Blocks::Tiles(Vec2(8, 8)) } else { Blocks::ScanLines };
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = |name: &str| {
        let colour = |p: Vec2<usize>| (p.x() as f32 / 10.0, f16::from_f32(p.y() as f32), 0.5f32);
        Layer::new((13, 9), LayerAttributes::named(name), encoding, SpecificChannels::rgb(colour))
    };
    let window = IntegerBounds::from_dimensions((13, 9));
    let image =
        Image::empty(ImageAttributes::new(window)).with_layer(layer("beauty")).with_layer(layer("albedo"));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn exr_pictures() {
    use exr::prelude::Compression;
    let half = WriteOptions { half: true, ..WriteOptions::default() };
    let seeds = [
        written("a.exr", &["R", "G", "B", "depth.Z"], &WriteOptions::default()),
        written("a.exr", &["Y"], &half),
        exr_seed(Compression::Uncompressed, false),
        exr_seed(Compression::RLE, true),
        exr_seed(Compression::ZIP1, false),
        exr_seed(Compression::PIZ, true),
        exr_seed(Compression::PXR24, false),
        exr_seed(Compression::B44, false),
    ];
    assault_pictures("image exr", &seeds);
}

#[test]
fn hdr_pictures() {
    let mut old =
        b"#?RADIANCE\nEXPOSURE=2\nPRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n\n+X 3 -Y 5\n".to_vec();
    old.extend([128, 64, 32, 129, 1, 1, 1, 4].repeat(3));
    assault_pictures("image hdr", &[written("a.hdr", &["R", "G", "B"], &WriteOptions::default()), old]);
}

#[test]
fn png_pictures() {
    let deep = WriteOptions { bits: 16, ..WriteOptions::default() };
    let seeds = [
        written("a.png", &["R", "G", "B"], &WriteOptions::default()),
        written("a.png", &["Y", "A"], &WriteOptions::default()),
        written("a.png", &["R", "G", "B", "A"], &deep),
    ];
    assault_pictures("image png", &seeds);
}

#[test]
fn jpeg_pictures() {
    let seeds = [["R", "G", "B"].as_slice(), &["Y"]].map(|c| written("a.jpg", c, &WriteOptions::default()));
    assault_pictures("image jpeg", &seeds);
}

#[test]
fn webp_pictures() {
    let mut bytes = Vec::new();
    let pixels: Vec<u8> = (0..13 * 9 * 4u32).map(|i| (i * i % 251) as u8).collect();
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
    encoder.encode(&pixels, 13, 9, image::ExtendedColorType::Rgba8).unwrap();
    assault_pictures("image webp", &[bytes]);
}

#[test]
fn bitmaps_targas_and_netpbm() {
    let mut bmp = b"BM\x8a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x05\0\0\0\x05\0\0\0\x01\0\x18\0".to_vec();
    bmp.extend([0; 24]);
    bmp.extend((0..80).collect::<Vec<u8>>());
    assault_pictures("image bmp", &[bmp]);
    let plain = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 5, 0, 24, 0x20];
    let runs = [0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0, 5, 0, 24, 0];
    let mark = [&[0; 8][..], b"TRUEVISION-XFILE.\0"].concat();
    let tga = [&plain[..], &(0..75).collect::<Vec<u8>>(), &mark].concat();
    assault_pictures("image tga", &[tga, [&runs[..], &[0x98, 1, 2, 3], &mark].concat()]);
    assault_pictures(
        "image pnm",
        &[
            b"P3\n# c\n2 2 255\n1 2 3 4 5 6 7 8 9 10 11 12\n".to_vec(),
            b"P5 2 2 65535\n\0\x01\0\x02\0\x03\0\x04".to_vec(),
            b"P4 9 2\n\xaa\x80\x55\0".to_vec(),
            b"P7\nWIDTH 1\nHEIGHT 1\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n\x01\x02\x03\x04"
                .to_vec(),
        ],
    );
}

/// A cube, as others write it.
#[test]
fn exr_cubes() {
    use exr::prelude::*;
    let colour = |p: Vec2<usize>| (p.x() as f32, f16::from_f32(p.y() as f32), 0.5f32);
    let attributes = LayerAttributes {
        environment_map: Some(exr::meta::attribute::EnvironmentMap::Cube),
        ..LayerAttributes::default()
    };
    let encoding = Encoding::default();
    let layer = Layer::new((3, 18), attributes, encoding, SpecificChannels::rgb(colour));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    let options = ReadOptions { max_samples: 1 << 16, ..ReadOptions::raw() };
    let panorama = read_bytes(bytes.get_ref(), Path::new(FILE), &options).unwrap();
    assert_eq!((panorama.width, panorama.height), (12, 6));
    assault_pictures("image cube", &[bytes.into_inner()]);
}

fn tiff_seed(compression: tiff::encoder::Compression, rows_per_strip: u32) -> Vec<u8> {
    use tiff::encoder::{TiffEncoder, colortype::RGB16};
    let mut bytes = std::io::Cursor::new(Vec::new());
    let data: Vec<u16> = (0..13 * 9 * 3u32).map(|i| (i * i % 65521) as u16).collect();
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    let mut image = encoder.new_image::<RGB16>(13, 9).unwrap();
    image.rows_per_strip(rows_per_strip).unwrap();
    image.write_data(&data).unwrap();
    bytes.into_inner()
}

fn tiff_seeds() -> [Vec<u8>; 3] {
    use tiff::encoder::Compression;
    [
        tiff_seed(Compression::Uncompressed, 9),
        tiff_seed(Compression::Lzw, 2),
        tiff_seed(Compression::Packbits, 4),
    ]
}

#[test]
fn tiff_pictures() {
    assault_pictures("image tiff", &tiff_seeds());
}

/// The way through a file on the disk that pictures of a stack take.
#[test]
fn pictures_row_by_row() {
    use exr::prelude::Compression;
    let options = ReadOptions { max_samples: 1 << 16, ..ReadOptions::raw() };
    let mut seeds = vec![
        written("a.png", &["R", "G", "B"], &WriteOptions { bits: 16, ..WriteOptions::default() }),
        written(
            "a.exr",
            &["R", "G", "B", "sigma.R"],
            &WriteOptions { half: true, ..WriteOptions::default() },
        ),
        exr_seed(Compression::PIZ, true),
        written("a.hdr", &["R", "G", "B"], &WriteOptions::default()),
    ];
    seeds.extend(tiff_seeds());
    let file = tempfile::NamedTempFile::new().unwrap();
    assault_with("rows", &seeds, 1_500, mutate, |b| {
        std::fs::write(file.path(), b).unwrap();
        let read = || {
            let mut rows = Rows::open(file.path(), &options, &mut (1 << 20))?;
            let mut line = vec![[0.0; 3]; rows.width];
            (0..rows.height).try_for_each(|_| rows.next_row(&mut line))
        };
        match read() {
            Ok(()) => true,
            Err(e) => {
                assert!(e.to_string().contains(file.path().to_str().unwrap()), "{e}");
                false
            }
        }
    });
}
