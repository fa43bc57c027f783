//! Damaged and lying files: whatever the bytes are, a reader answers without a panic and with little memory.

#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use yugen_archive::formats::image::rows::Rows;
use yugen_archive::formats::image::{ReadOptions, WriteOptions, read_bytes, write_bytes};
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_archive::formats::{
    Moment, Options, btf, gltf, lp, merl, mitsuba, obj, ply, ptm, relight, rti, serialized, stack, toml, wif,
};
use yugen_optics::random::Pcg32;
use yugen_optics::{ColourSpace, Image};
use yugen_reflectance::btf::{Btf, Texel};

/// Counts what each thread holds, so that tests beside each other do not mix.
struct Counting;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    // At the end of a thread there is nothing left to count in.
    let _ = HELD.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(held.get())));
    });
}

// SAFETY: every call goes to the system's allocator unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        unsafe { System.dealloc(p, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The most that `f` holds at a time, in bytes.
fn peak(f: impl FnOnce()) -> isize {
    let before = HELD.get();
    PEAK.set(before);
    f();
    PEAK.get() - before
}

/// One to four of the accidents that befall files.
fn mutate(seed: &[u8], other: &[u8], rng: &mut Pcg32) -> Vec<u8> {
    const LIES: [&[u8]; 10] = [
        b"0",
        b"-1",
        b"1099511627776",
        b"4294967295",
        b"99999999999999999999",
        b"1e308",
        b"nan",
        b"\xff\xff\xff\xff",
        b"\x00\x00\x00\x00\x00\x01\x00\x00",
        b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    ];
    let mut out = seed.to_vec();
    let mut below = |n: usize| ((u64::from(rng.next_u32()) * n.max(1) as u64) >> 32) as usize;
    for _ in 0..1 + below(4) {
        let at = below(out.len());
        let end = (at + below(24)).min(out.len());
        match below(7) {
            0 if !out.is_empty() => out[at] ^= 1 << below(8),
            1 if !out.is_empty() => out[at] = below(256) as u8,
            2 => out.truncate(at),
            3 => drop(out.drain(at..end)),
            4 => {
                let copy = out[at..end].to_vec();
                let to = below(out.len());
                out.splice(to..to, copy);
            }
            5 => {
                let from = below(other.len());
                let part = &other[from..(from + below(24)).min(other.len())];
                out.splice(at..at, part.iter().copied());
            }
            _ => {
                let lie = LIES[below(LIES.len())];
                let end = (at + lie.len()).min(out.len());
                out.splice(at..end, lie.iter().copied());
            }
        }
    }
    out
}

/// Mistakes that leave the XML well-formed and so get further: attributes of others, lies, lines lost and
/// doubled.
fn rewrite(seed: &[u8], rng: &mut Pcg32) -> Vec<u8> {
    const LIES: [&str; 12] = [
        "",
        "0",
        "-1",
        "1e39",
        "1e-45",
        "9223372036854775808",
        "nan",
        "$n",
        "$",
        "..",
        "/etc/passwd",
        "400:1, 300:2",
    ];
    let mut below = |n: usize| ((u64::from(rng.next_u32()) * n.max(1) as u64) >> 32) as usize;
    let mut lines: Vec<String> = String::from_utf8_lossy(seed).lines().map(String::from).collect();
    for _ in 0..1 + below(3) {
        let parts: Vec<String> = lines.join("\n").split('"').map(String::from).collect();
        let values: Vec<&String> = parts.iter().skip(1).step_by(2).collect();
        match below(4) {
            0 if lines.len() > 3 => drop(lines.remove(2 + below(lines.len() - 3))),
            1 => {
                let (from, to) = (below(lines.len()), below(lines.len()));
                let copy = lines[from].clone();
                lines.insert(to, copy);
            }
            _ if !values.is_empty() => {
                let new = match below(3) {
                    0 => LIES[below(LIES.len())].to_string(),
                    _ => values[below(values.len())].clone(),
                };
                let at = 2 * below(values.len()) + 1;
                let mut parts = parts.clone();
                parts[at] = new;
                lines = parts.join("\"").lines().map(String::from).collect();
            }
            _ => {}
        }
    }
    lines.join("\n").into_bytes()
}

/// Reads mutations of the seeds. A seed itself must be good, or its mutations would test nothing.
fn assault(name: &str, seeds: &[Vec<u8>], read: impl Fn(&[u8]) -> bool) {
    assault_with(name, seeds, 20_000, mutate, read);
}

type Mutation = fn(&[u8], &[u8], &mut Pcg32) -> Vec<u8>;

fn assault_with(
    name: &str,
    seeds: &[Vec<u8>],
    rounds: usize,
    mutate: Mutation,
    read: impl Fn(&[u8]) -> bool,
) {
    let mut rng = Pcg32::new(20, 1);
    let (mut good, mut worst) = (0, 0);
    for seed in seeds {
        assert!(read(seed), "{name}: the seed itself is refused");
    }
    if let Some(corpus) = std::env::var_os("YUGEN_SEEDS") {
        // For the fuzzers (see fuzz/README.md): a folder for each target, named as the target is.
        let (target, kind) = name.split_once(' ').unwrap_or((name, "seed"));
        let folder = Path::new(&corpus).join(target);
        std::fs::create_dir_all(&folder).unwrap();
        for (i, seed) in seeds.iter().enumerate() {
            std::fs::write(folder.join(format!("{kind}{i}")), seed).unwrap();
        }
    }
    for i in 0..rounds {
        let (seed, other) = (&seeds[i % seeds.len()], &seeds[(i / 7) % seeds.len()]);
        let bytes = mutate(seed, other, &mut rng);
        worst = worst.max(peak(|| good += usize::from(read(&bytes))));
    }
    println!("{name}: {good} of {rounds} were still readable, at most {worst} bytes were held");
    assert!(good > 0 && good < rounds, "{name}: {good} of {rounds} readable is no test");
    assert!(worst < 4 << 20, "{name}: {worst} bytes for a file of a few kilobytes");
}

const FILE: &str = "nowhere/at/all";

#[test]
fn obj() {
    let seed = b"# seed\nmtllib a.mtl\no thing\nv 0 0 0\nv 1.5 0 0 1 0 0\nv 1 1e-1 0\nv 0 1 -.5\nvt 0 0\nvt 1 0.5\n\
        vn 0 0 1\nusemtl a\ns off\nf 1/1/1 2/2/1 3/1/1 4/2/1\nusemtl b\nf -4//-1 -3//1 \\\n -2//1\nf 1/1 2/2 3/1\n";
    assault("obj", &[seed.to_vec()], |b| match obj::read(b, Path::new(FILE)) {
        Ok(o) => {
            let parts = o.split();
            let corners = |(_, m): &(Option<String>, yugen_archive::scene::Mesh)| {
                m.triangles.iter().flatten().map(|&i| m.positions[i as usize].x).sum::<f32>()
            };
            parts.iter().map(corners).sum::<f32>().is_finite() || !parts.is_empty()
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn mtl() {
    let seed = b"newmtl a\nKd 1 0 0.5\nNs 20\nmap_Kd -bm 1 wood.png\n# x\nnewmtl b\nd 0.5\n".to_vec();
    assault("mtl", &[seed], |b| {
        let materials = obj::read_mtl(b, Path::new(FILE)).unwrap_or_default();
        materials.iter().any(|m| m.colour("Kd").is_some() && m.file("map_Kd").is_some())
    });
}

fn ply_seed(encoding: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment seed\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float nx\n\
         property float ny\nproperty float nz\nproperty float u\nproperty float v\nproperty double heat_x\n\
         property list uchar short odd\nelement face 1\nproperty list uchar int vertex_indices\nelement other 1\n\
         property list int float y\nend_header\n"
    )
    .into_bytes();
    if encoding == "ascii" {
        out.extend(b"0 0 0 255 0 0 0 0 1 0 0 1.5 1 7\n1 0 0 255 0 0 0 0 1 0 0 1.5 0\n");
        out.extend(b"0 1 0 9 9 9 0 0 1 1 1 2 0\n3 0 1 2\n1 5\n");
        return out;
    }
    let mut put = |mut b: Vec<u8>| {
        if encoding.contains("big") {
            b.reverse();
        }
        out.extend(b);
    };
    for [x, y] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0f32]] {
        [x, y, 0.0].iter().for_each(|v| put(v.to_le_bytes().into()));
        [1, 2, 3u8].iter().for_each(|&v| put(vec![v]));
        [0.0, 0.0, 1.0, x, y].iter().for_each(|v| put(v.to_le_bytes().into()));
        put(1.5f64.to_le_bytes().into());
        put(vec![1]);
        put(7i16.to_le_bytes().into());
    }
    put(vec![3]);
    [0, 1, 2i32].iter().for_each(|v| put(v.to_le_bytes().into()));
    put(1i32.to_le_bytes().into());
    put(5f32.to_le_bytes().into());
    out
}

#[test]
fn ply() {
    let seeds = ["ascii", "binary_little_endian", "binary_big_endian"].map(ply_seed);
    assault("ply", &seeds, |b| match ply::read(b, Path::new(FILE)) {
        Ok(m) => {
            let n = m.positions.len();
            assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < n));
            assert!(m.attributes.iter().all(|(_, w, v)| v.len() == w * n));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

/// One triangle. At level 0 the stream is stored as it is, so that mutations reach what it says.
fn serialized_seed(version: u16, level: u32) -> Vec<u8> {
    let mut body = 0x1003u32.to_le_bytes().to_vec();
    if version == 4 {
        body.extend(b"tri\0");
    }
    body.extend(3u64.to_le_bytes());
    body.extend(1u64.to_le_bytes());
    let positions = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32];
    let normals = [0.0, 0.0, 1.0].repeat(3);
    let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    for v in positions.iter().chain(&normals).chain(&uvs) {
        body.extend(v.to_le_bytes());
    }
    for i in [0, 1, 2u32] {
        body.extend(i.to_le_bytes());
    }
    let mut out = 0x041cu16.to_le_bytes().to_vec();
    out.extend(version.to_le_bytes());
    let mut zip = flate2::write::ZlibEncoder::new(out, flate2::Compression::new(level));
    std::io::Write::write_all(&mut zip, &body).unwrap();
    let mut out = zip.finish().unwrap();
    if version == 4 {
        out.extend(0u64.to_le_bytes())
    } else {
        out.extend(0u32.to_le_bytes())
    }
    out.extend(1u32.to_le_bytes());
    out
}

#[test]
fn serialized_meshes() {
    let seeds = [(3, 0), (4, 0), (4, 9)].map(|(version, level)| serialized_seed(version, level));
    assault("serialized", &seeds, |b| match serialized::read(b, 0, Path::new(FILE)) {
        Ok(s) => {
            assert!(s.mesh.triangles.iter().flatten().all(|&i| (i as usize) < s.mesh.positions.len()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            // The table of offsets is another way in.
            let _ = serialized::read(b, 1, Path::new(FILE));
            false
        }
    });
}

#[test]
fn mitsuba_scenes() {
    let seed = br#"<?xml version="1.0"?><!-- seed -->
<scene version="3.0.0"><default name="n" value="4"/><default name="kind" value="path"/>
<integrator type="moment"><integrator type="$kind"><integer name="max_depth" value="$n"/></integrator></integrator>
<sensor type="thinlens"><float name="aperture_radius" value="0.1"/><string name="fov_axis" value="smaller"/>
<float name="fov" value="40"/><transform name="to_world"><rotate y="1" angle="20"/>
<lookat origin="1,2,3" target="0 0 0" up="0,1,0"/><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/></transform>
<film type="hdrfilm"><integer name="width" value="64"/><rfilter type="mitchell"><float name="B" value="0.2"/></rfilter>
</film></sensor>
<texture type="checkerboard" id="t"><rgb name="color0" value="0.1 0.2 0.3"/>
<transform name="to_uv"><scale value="3"/></transform></texture>
<bsdf type="twosided" id="m"><bsdf type="diffuse"><ref name="reflectance" id="t"/></bsdf></bsdf><alias id="m" as="m2"/>
<bsdf type="roughconductor"><string name="material" value="Au"/><ref name="alpha" id="t"/></bsdf>
<bsdf type="mask" id="k"><float name="opacity" value="0.5"/>
<bsdf type="dielectric"><string name="int_ior" value="water"/></bsdf></bsdf>
<shape type="sphere"><point name="center" x="1" y="2" z="3"/><ref id="m2"/>
<emitter type="area"><spectrum name="radiance" value="400:1, 700:2"/></emitter></shape>
<shape type="shapegroup" id="g"><shape type="cube"><ref id="k"/></shape>
<shape type="cylinder"><float name="radius" value="2"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="3"/></transform></shape>
<emitter type="spot"><rgb name="intensity" value="3"/></emitter><emitter type="constant"/></scene>"#;
    let options = Options { defines: vec![("n".into(), "7".into())], ..Options::default() };
    let read = |b: &[u8]| match mitsuba::read(b, Path::new(FILE), &options) {
        Ok(scene) => scene.cameras.len() == 1,
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    };
    assault("mitsuba bytes", &[seed.to_vec()], read);
    assault_with("mitsuba words", &[seed.to_vec()], 20_000, |seed, _, rng| rewrite(seed, rng), read);
}

#[test]
fn claims_of_a_trillion_elements_cost_nothing() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let text = format!(
            "ply\nformat {encoding} 1.0\nelement vertex 1099511627776\nproperty float x\nproperty float y\n\
             property float z\nelement face 1099511627776\nproperty list uchar int vertex_indices\nend_header\n0 0 0"
        );
        let bytes = peak(|| assert!(ply::read(text.as_bytes(), Path::new(FILE)).is_err()));
        assert!(bytes < 1 << 16, "{bytes} bytes for {encoding}");
    }
    let mut lie = serialized_seed(4, 0);
    let at = lie.windows(8).position(|w| w == 3u64.to_le_bytes()).unwrap();
    lie[at..at + 8].copy_from_slice(&(1u64 << 40).to_le_bytes());
    let bytes = peak(|| assert!(serialized::read(&lie, 0, Path::new(FILE)).is_err()));
    assert!(bytes < 1 << 18, "{bytes} bytes for a serialized mesh");
}

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

#[test]
fn lists_of_lights() {
    let seeds = [
        &b"3\nimg 1.png 0,5773 0,5773 0,5773\r\n\"a b.png\" 10 -2e1 30\nC:\\c.jpg, 0.1, -.2, 0.3\n"[..],
        b"\xef\xbb\xbf 1 \n\xe6\x97\xa5.png\t0 0 1",
    ];
    assault("lp", &seeds.map(<[u8]>::to_vec), |b| {
        match lp::read(b, Path::new(FILE), "x -y z".parse().unwrap()) {
            Ok(entries) => {
                assert!(entries.iter().all(|e| e.light.is_finite() && e.light.z > 0.0));
                let text = lp::write(&entries, Path::new(FILE));
                text.is_ok_and(|t| {
                    lp::read(t.as_bytes(), Path::new(FILE), lp::Axes::default()).is_ok_and(|e| e == entries)
                })
            }
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
}

#[test]
fn tables_of_a_capture() {
    use yugen_archive::formats::{colour_chart, exposures, goniometer_csv, response};
    let said = |e: yugen_archive::Error| {
        assert!(e.to_string().contains(FILE), "{e}");
        false
    };
    let seed = b"# log\nlight;file;seconds\nleft;a 1.jpg;1/50\n;\"b;c.jpg\";0,25\n".to_vec();
    assault("exposures", &[seed], |b| match exposures::read(b, Path::new(FILE)) {
        Ok(all) => all.iter().all(|e| e.seconds.is_finite() && e.seconds > 0.0 && !e.file.is_empty()),
        Err(e) => said(e),
    });
    let seed =
        b"theta_i,phi_i,theta_o,phi_o,f\n0,0,0,0,1\n30,0,0,0,2\n-30,0,0,0,3\n0,0,50,0,4\n30,0,50,0,5\n"
            .to_vec();
    assault("goniometer_csv", &[seed], |b| {
        match goniometer_csv::read(b, Path::new(FILE), ColourSpace::LinearSrgb) {
            Ok(g) => g.check().is_ok(),
            Err(e) => said(e),
        }
    });
    let seed = response::write(&[[0.0; 3], [0.25, 0.5, 0.125], [1.0; 3]]).into_bytes();
    assault("response", &[seed], |b| match response::read(b, Path::new(FILE)) {
        Ok(light) => light.len() > 1 && light.iter().flatten().all(|v| v.is_finite()),
        Err(e) => said(e),
    });
    let seed =
        b"red,green,blue,known_red,known_green,known_blue\n1,2,3,4,5,6\n0,0,0,1,1,1\n1,0,0,1,0,0\n".to_vec();
    assault("colour_chart", &[seed], |b| match colour_chart::read(b, Path::new(FILE)) {
        Ok(patches) => patches.len() > 2,
        Err(e) => said(e),
    });
}

#[test]
fn options_of_a_stack() {
    let seed = b"lights = \"a.lp\"\naxes = \"x -y z\"\nnear = true\nfield_width = 4\nresponse = 2.2\nwhite = [0.5, 1, 2]\n\
        saturated = 0.5\nambient = \"0.png\"\nintensities = [1, [1, 2, 4]]\ncolour_space = \"acescg\"\nmask = \"m.png\"\n";
    assault("stack", &[seed.to_vec()], |b| match stack::Options::parse(b, Path::new(FILE)) {
        Ok(options) => {
            let back = stack::Options::parse(options.text().as_bytes(), Path::new(FILE));
            assert_eq!(back.ok(), Some(options));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn toml_scenes() {
    let seed = br##"[scene]
working_space = "srgb"
[camera]
from = [0, 1, 3]
to = [0, 0.5, 0]
fov = 35
[film]
size = [64, 48]
filter = "tent"
[render]
samples = 16
aovs = ["albedo"]
[texture.t]
checker = [0, "#ff8000"]
scale = [2, 3]
[material.a]
model = "ward"
alpha = 0.2
diffuse = "t"
[material.b]
blend = ["a", "a"]
weight = 0.5
opacity = 0.5
[[shape]]
type = "ball"
segments = 6
material = "b"
rotate = [1, 2, 3]
[[shape]]
type = "sphere"
emission = { blackbody = 1900, scale = 2 }
[[light]]
type = "spot"
at = [0, 2, 0]
towards = [0, 0, 1]
"##;
    // A mesh made here may have four million triangles, which is the scene's wish and not its size: the limit
    // is that of the reader without it.
    assault("toml", &[seed.to_vec()], |b| {
        if std::str::from_utf8(b)
            .is_ok_and(|t| t.lines().any(|l| l.contains("segments") && l.trim() != "segments = 6"))
        {
            return false;
        }
        match toml::read(b, Path::new(FILE), &Options::default()) {
            Ok(scene) => scene.cameras.len() == 1,
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
}

fn gltf_seed() -> (Vec<u8>, Vec<u8>) {
    let json = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"outerConeAngle":0.5}}]}},
"cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],
"scenes":[{"nodes":[0,2,3]}],
"nodes":[{"mesh":0,"children":[1],"scale":[1,2,3]},{"mesh":0,"rotation":[0,0,0,1]},{"camera":0},
{"mesh":1,"skin":0,"weights":[0.5],"extensions":{"KHR_lights_punctual":{"light":0}}}],
"skins":[{"joints":[0,1]}],
"animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},
{"sampler":1,"target":{"node":0,"path":"rotation"}}],"samplers":[{"input":1,"output":0},
{"input":1,"output":3,"interpolation":"STEP"}]}],
"materials":[{"pbrMetallicRoughness":{"roughnessFactor":0.3},"doubleSided":true,"alphaMode":"BLEND",
"extensions":{"KHR_materials_sheen":{"sheenRoughnessFactor":0.4}}}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]},
{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"mode":5,"targets":[{"POSITION":0}]}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"},
{"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},
{"bufferView":2,"byteOffset":12,"componentType":5121,"normalized":true,"count":3,"type":"VEC4",
"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":2}}}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3},
{"buffer":0,"byteOffset":40,"byteLength":24}],"buffers":[{"byteLength":64URI}]}"#;
    let mut data: Vec<u8> =
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32].iter().flat_map(|v| v.to_le_bytes()).collect();
    data.extend([0, 1, 2, 0]);
    data.extend([0, 1, 0, 0].repeat(3));
    data.extend([255, 0, 0, 0].repeat(3));
    let text = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAECAAABAAAAAQAAAAEAAP8AAAD/AAAA/wAAAA==";
    let uri = format!(r#","uri":"data:application/octet-stream;base64,{text}""#);
    let apart = json.replace("URI", &uri).into_bytes();
    let mut json = json.replace("URI", "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    (apart, glb)
}

#[test]
fn gltf_scenes() {
    let (apart, glb) = gltf_seed();
    // An accessor without data may ask for 2^24 zeros, and a mesh of them has positions, normals and indices.
    let moment = Some(Moment { seconds: 0.5, animation: None });
    let options = Options { moment, ..Options::default() };
    assault("gltf", &[apart, glb], |b| match gltf::read(b, Path::new(FILE), &options) {
        Ok(scene) => {
            for shape in scene.shapes.iter().chain(scene.groups.iter().flatten()) {
                if let yugen_archive::scene::Geometry::Mesh(m) = &shape.geometry {
                    assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < m.positions.len()));
                    assert!(m.positions.iter().all(|p| p.is_finite()));
                }
            }
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

fn relightable(basis: Basis, colouring: Colouring) -> Relightable {
    let mut r = Relightable { width: 5, height: 3, basis, colouring, coefficients: Vec::new() };
    r.coefficients = (0..15 * r.stride()).map(|i| (i * 7 % 23) as f32 / 23.0).collect();
    r
}

/// Pictures may have 2^12 texels here.
fn whole(read: Result<Relightable, yugen_archive::Error>) -> bool {
    match read {
        Ok(r) => {
            assert_eq!(r.coefficients.len(), r.width * r.height * r.stride());
            assert!(r.coefficients.iter().all(|v| v.is_finite()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    }
}

#[test]
fn ptm_pictures() {
    let mut seeds = [Colouring::Rgb, Colouring::Lrgb]
        .map(|c| ptm::write(&relightable(Basis::Ptm, c), Path::new(FILE)).unwrap())
        .to_vec();
    let mut jpegs = "PTM_1.2\nPTM_FORMAT_JPEG_LRGB\n5 3\n1 1 1 1 1 1\n0 0 0 0 0 0\n90\n".to_string();
    let mut grey = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut grey);
    encoder.encode(&[50; 15], 5, 3, image::ExtendedColorType::L8).unwrap();
    let list =
        |f: &dyn Fn(usize) -> i64| (0..9).map(|k| f(k).to_string()).collect::<Vec<_>>().join(" ") + "\n";
    jpegs += &list(&|k| i64::from(k == 4));
    jpegs += &list(&|_| 0).repeat(2);
    jpegs += &list(&|k| 8 - k as i64);
    jpegs += &list(&|k| if k < 8 { k as i64 + 1 } else { -1 });
    jpegs += &list(&|_| grey.len() as i64);
    jpegs += &list(&|k| if k == 8 { 10 } else { 0 });
    let mut jpegs = jpegs.into_bytes();
    (0..9).for_each(|_| jpegs.extend(&grey));
    jpegs.extend([0, 0, 0, 3, 9, 255, 0, 0, 0, 1]);
    seeds.push(jpegs);
    assault("ptm", &seeds, |b| whole(ptm::read(b, Path::new(FILE), 1 << 12)));
}

#[test]
fn rti_pictures() {
    let one = rti::write(&relightable(Basis::Hsh { order: 2 }, Colouring::Rgb), Path::new(FILE)).unwrap();
    let mut floats = b"#HSH1.2\n3\n1 2 3\n4 2 4\n".to_vec();
    floats.extend((0..8 + 24).flat_map(|i| (i as f32).to_le_bytes()));
    assault("rti", &[one, floats], |b| whole(rti::read(b, Path::new(FILE), 1 << 12)));
}

#[test]
fn relightlab_infos() {
    let seed = br#"{"width": 4, "height": 2, "format": "jpg", "type": "ptm", "colorspace": "lrgb", "lights": [0, 0, 1],
"nplanes": 9, "quality": 95, "materials": [{"scale": [1,1,1,1,1,1,1,1.5,1], "bias": [0,0,0,0,0,0.25,0,0,0]}]}"#;
    assault("relight", &[seed.to_vec()], |b| match relight::read_info(b, Path::new(FILE), 1 << 12) {
        Ok(_) => true,
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn merl_headers() {
    // The smallest whole file has 35 MB, so this is only about what a header may say.
    let mut rng = Pcg32::new(3, 1);
    let seed: Vec<u8> = [90, 90, 180i32].iter().flat_map(|v| v.to_le_bytes()).chain([0; 64]).collect();
    let worst = (0..3000).map(|_| {
        let bytes = mutate(&seed, &seed, &mut rng);
        peak(|| {
            let error = merl::read(&bytes, Path::new(FILE), ColourSpace::LinearSrgb).unwrap_err();
            assert!(error.to_string().contains(FILE), "{error}");
        })
    });
    assert!(worst.max().unwrap() < 1 << 16);
}

#[test]
fn maps_of_a_cloth() {
    let texels = vec![Texel { confidence: 1.0, ..btf::NOTHING }; 20];
    let maps = Btf { width: 5, height: 4, colour_space: ColourSpace::LinearSrgb, texels };
    let seed = btf::write(&maps, &btf::About { texel_mm: Some(0.1), ..btf::About::default() }).unwrap();
    let options = ReadOptions { max_samples: 1 << 16, ..ReadOptions::to(ColourSpace::LinearSrgb) };
    assault_with("btf", &[seed], 3_000, mutate, |b| match btf::read(b, Path::new(FILE), &options) {
        Ok((maps, _)) => {
            assert_eq!(maps.texels.len(), maps.width * maps.height);
            assert!(maps.texels.iter().all(|t| t.normal.is_normalized() && t.tangent.is_normalized()));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn weaving_drafts() {
    let seed = b"junk\n[WIF]\nVersion=1.1\n[TEXT]\nTitle=seed\n[WEAVING]\nRising Shed=true\nTreadles=4\nShafts=4\n\
        [WARP]\nThreads=6\nColor=1\nSpacing=0.2\nUnits=centimeters\n[WEFT]\nThreads=4\nColor=2\nSpacing=0.1\n\
        Units=inches\n[THREADING]\n1=1\n2=2\n3=3\n4=4\n5=1,2\n6\n[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n[TREADLING]\n\
        1=1\n2=2,3\n3=0\n4=\n[COLOR PALETTE]\nRange=0,999\nEntries=2\n[COLOR TABLE]\n1=999,999,999\n2=500,0,10\n\
        [WARP COLORS]\n2=2\n[WEFT THICKNESS]\n1=0.05\n";
    let plan = String::from_utf8_lossy(seed).replace("[TREADLING]", "[LIFTPLAN]").into_bytes();
    assault("wif", &[seed.to_vec(), plan], |b| {
        match wif::read(b, Path::new(FILE), ColourSpace::LinearSrgb) {
            Ok(draft) => {
                let cells = draft.warp.len() * draft.weft.len();
                assert!(cells > 1 << 16 || draft.drawdown().len() == cells);
                assert!(
                    draft.warp.iter().chain(&draft.weft).all(|t| t.colour.is_finite() && t.spacing >= 0.0)
                );
                true
            }
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
}
