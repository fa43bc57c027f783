use super::*;
use crate::formats::image::{NonFinite, WriteOptions, write_bytes};
use std::fs;
use std::sync::atomic::{AtomicU32, Ordering};
use yugen_optics::Image;

/// An empty folder that is gone with the test.
struct Temporary(PathBuf);

impl Temporary {
    fn new() -> Self {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        let name = format!("yugen-stack-{}-{}", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.0.join(name), bytes).unwrap();
    }

    fn fails(&self, words: &[&str]) {
        let error = Folder::open(&self.0)
            .and_then(|f| f.bands(3)?.try_for_each(|b| b.map(drop)))
            .expect_err("this must not be read")
            .to_string();
        assert!(words.iter().all(|w| error.contains(w)), "{error}");
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const SIZE: [usize; 2] = [7, 37];

/// Values that 8 bits of sRGB hold: code (x + 3 y + 11 channel + light) modulo 200.
fn code(x: usize, y: usize, c: usize, light: usize) -> u8 {
    ((x + 3 * y + 11 * c + 29 * light) % 200 + 1) as u8
}

fn linear(light: usize) -> Image {
    let mut image = Image::rgb(SIZE[0], SIZE[1]);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            for c in 0..3 {
                image.pixel_mut(x, y)[c] = srgb_to_linear(f32::from(code(x, y, c, light)) / 255.0);
            }
        }
    }
    image
}

fn tiff(light: usize, rows_per_strip: u32, wide: bool) -> Vec<u8> {
    use ::tiff::encoder::{Compression, TiffEncoder, colortype};
    let mut out = std::io::Cursor::new(Vec::new());
    let (w, h) = (SIZE[0] as u32, SIZE[1] as u32);
    let codes =
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).flat_map(move |x| (0..3).map(move |c| code(x, y, c, light))));
    let mut encoder = TiffEncoder::new(&mut out).unwrap().with_compression(Compression::Lzw);
    if wide {
        let data: Vec<u16> = codes.map(|c| u16::from(c) * 257).collect();
        let mut image = encoder.new_image::<colortype::RGB16>(w, h).unwrap();
        image.rows_per_strip(rows_per_strip).unwrap();
        image.write_data(&data).unwrap();
    } else {
        let data: Vec<u8> = codes.collect();
        let mut image = encoder.new_image::<colortype::RGB8>(w, h).unwrap();
        image.rows_per_strip(rows_per_strip).unwrap();
        image.write_data(&data).unwrap();
    }
    out.into_inner()
}

/// A picture in every way of reading: rows, blocks, strips, and whole (Radiance).
fn mixed() -> Temporary {
    let folder = Temporary::new();
    let srgb = WriteOptions::from(ColourSpace::LinearSrgb);
    let half = WriteOptions { half: true, ..srgb.clone() };
    let wide = WriteOptions { bits: 16, ..srgb.clone() };
    folder.put("0.png", write_bytes("0.png".as_ref(), &linear(0), &srgb).unwrap());
    folder.put("1.png", write_bytes("1.png".as_ref(), &linear(1), &wide).unwrap());
    folder.put("2.exr", write_bytes("2.exr".as_ref(), &linear(2), &srgb).unwrap());
    folder.put("3.exr", write_bytes("3.exr".as_ref(), &linear(3), &half).unwrap());
    folder.put("4 strips.tif", tiff(4, 5, true));
    folder.put("5.tif", tiff(5, SIZE[1] as u32, false));
    folder.put("6.hdr", write_bytes("6.hdr".as_ref(), &linear(6), &srgb).unwrap());
    let names = ["0.png", "1.png", "2.exr", "3.exr", "4 strips.tif", "5.tif", "6.hdr"];
    let entries: Vec<lp::Entry> =
        names.iter().map(|n| lp::Entry { file: n.to_string(), light: Vec3::new(0.1, 0.2, 2.0) }).collect();
    write(&folder.0, &entries, &Options::default()).unwrap();
    folder
}

#[test]
fn bands_hold_what_the_pictures_do_whatever_their_format() {
    let folder = mixed();
    let stack = Folder::open(&folder.0).unwrap();
    assert_eq!([stack.width, stack.height, stack.channels], [SIZE[0], SIZE[1], 3]);
    assert_eq!(stack.colour_space, ColourSpace::LinearSrgb);
    assert!(stack.directions().iter().all(|d| d.is_normalized()));
    let mut bands = stack.bands(usize::MAX).unwrap();
    let whole = bands.next().unwrap().unwrap();
    assert!(bands.next().is_none());
    assert_eq!(bands.counts(), Counts { texels: 7 * 37, ..Counts::default() });
    // Half floats have 11 bits; RGBE has 8 for the brightest channel, which is up to 100 times a dark one here.
    let tolerances = [1e-6, 1e-5, 0.0, 5e-4, 1e-5, 1e-6, 0.0];
    for (light, tolerance) in tolerances.into_iter().enumerate() {
        let image = linear(light);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let got = whole.values[(y * SIZE[0] + x) * 7 + light];
                let want = image.pixel(x, y);
                let most = want.iter().fold(0.0f32, |a, &b| a.max(b));
                let bound = if light == 6 { most / 128.0 } else { tolerance * most };
                assert!(
                    got.iter().zip(want).all(|(a, b)| (a - b).abs() <= bound),
                    "{light} {x} {y}: {got:?} {want:?}"
                );
            }
        }
    }
    for rows in [1, 5, 16, 36] {
        let all: Vec<[f32; 3]> = stack.bands(rows).unwrap().flat_map(|b| b.unwrap().values).collect();
        assert!(all == whole.values, "bands of {rows} rows");
    }
    let mut bands = stack.bands(10).unwrap();
    bands.skip_rows(30).unwrap();
    let last = bands.next().unwrap().unwrap();
    assert_eq!((last.first_row, last.height), (30, 7));
    assert!(last.values[..] == whole.values[30 * 7 * 7..]);
    assert_eq!(stack.rows_within(0), 1);
    assert_eq!(stack.rows_within(u64::MAX), 37);
    assert_eq!(stack.rows_within((16 + 5) * 7 * 7 * 12), 5);
}

#[test]
fn pictures_set_aside_on_the_disk_read_as_those_in_memory() {
    let folder = mixed();
    for name in ["6.hdr", "2.exr"] {
        let path = folder.0.join(name);
        let read = |allowance: u64| {
            let mut left = allowance;
            let mut rows = keep(&path, &mut left);
            let mut out = vec![[0.0; 3]; SIZE[0]];
            let all: Vec<_> = (0..SIZE[1])
                .flat_map(|_| {
                    rows.next_row(&mut out).unwrap();
                    out.clone()
                })
                .collect();
            assert!(rows.next_row(&mut out).is_err(), "no row after the last");
            (all, allowance - left)
        };
        let ((memory, used), (disk, none)) = (read(1 << 20), read(0));
        assert!(memory == disk && none == 0);
        assert_eq!(used, if name == "6.hdr" { 7 * 37 * 12 } else { 0 }, "{name}");
    }
}

/// What is told of a JPEG's rows is what reading it whole tells, wherever its bytes wait.
#[test]
fn jpegs_wait_as_their_bytes() {
    let folder = Temporary::new();
    let srgb = WriteOptions::from(ColourSpace::LinearSrgb);
    let grey = linear(1).select(&["G"]).unwrap();
    let grey = yugen_optics::Image { channels: vec!["Y".into()], ..grey };
    for (name, image, channels) in [("a.jpg", linear(0), 3), ("b.jpg", grey, 1)] {
        folder.put(name, write_bytes(name.as_ref(), &image, &srgb).unwrap());
        let path = folder.0.join(name);
        let whole = image::read(&path, &ReadOptions::raw()).unwrap();
        for (mut left, used) in [(1 << 20, 7 * 37 * channels), (0, 0)] {
            let before = left;
            let mut rows = keep(&path, &mut left);
            assert!(rows.kept() && rows.channels == channels && before - left == used as u64, "{name}");
            let mut line = [[0.0; 3]; 7];
            for y in 0..37 {
                rows.next_row(&mut line).unwrap();
                for (x, rgb) in line.iter().enumerate() {
                    let want: [f32; 3] = std::array::from_fn(|c| whole.pixel(x, y)[c % channels]);
                    assert_eq!(*rgb, want, "{name} {x} {y}");
                }
            }
        }
    }
    // A quarter of the memory is for pictures that are decoded whole.
    folder.put(LIGHTS, "1\na.jpg 0 0 1\n");
    let stack = Folder::open(&folder.0).unwrap();
    assert_eq!(stack.rows_within((16 + 12) * 7 * 12), 9);
}

fn keep(path: &Path, left: &mut u64) -> Rows {
    Rows::open(path, &ReadOptions::raw(), left).unwrap()
}

#[test]
fn options_say_how_the_numbers_are_meant() {
    let folder = mixed();
    folder.put(
        "stack.toml",
        "axes = \"x -y z\"\nnear = true\nfield_width = 4\nresponse = \"linear\"\nwhite = [0.5, 1, 2]\nsaturated = 0.5\n\
         ambient = \"0.png\"\nintensities = [1, 2, [1, 2, 4], 1, 1, 1, 1]\ncolour_space = \"acescg\"\nlevel_white = true\n",
    );
    let mut mask = Image::new(SIZE[0], SIZE[1], &["Y"]);
    mask.data.fill(1.0);
    mask.data[..7].fill(0.0);
    folder.put("mask.png", write_bytes("m.png".as_ref(), &mask, &WriteOptions::default()).unwrap());
    let stack = Folder::open(&folder.0).unwrap();
    assert_eq!(stack.colour_space, ColourSpace::AcesCg);
    assert_eq!(stack.positions()[0], Vec3::new(0.025, -0.05, 0.5));
    let mut bands = stack.bands(40).unwrap();
    let band = bands.next().unwrap().unwrap();
    let counts = bands.counts();
    assert_eq!((counts.texels, counts.outside), (7 * 37, 7));
    assert!(band.values[..7 * 7].iter().all(|v| v[0].is_nan()), "outside the mask");
    let mut unusable = 0;
    // The lights of the list stand at (0.1, 0.2, 2).
    let cosine = 2.0 / 4.05f32.sqrt();
    for y in 1..SIZE[1] {
        for x in 0..SIZE[0] {
            let samples = &band.values[(y * SIZE[0] + x) * 7..][..7];
            let codes = |l| [0, 1, 2].map(|c| f32::from(code(x, y, c, l)) / 255.0);
            let dark = codes(0);
            let ambient = dark.iter().any(|&v| v >= 0.5);
            for l in [1, 2] {
                let light = if l == 1 { codes(1) } else { codes(2).map(srgb_to_linear) };
                let bad = ambient || l == 1 && light.iter().any(|&v| v >= 0.5);
                let scale = if l == 1 { [1.0, 2.0, 4.0] } else { [0.5, 2.0, 8.0] };
                assert_eq!(
                    samples[l][0].is_nan(),
                    bad || samples.iter().all(|s| s[0].is_nan()),
                    "{x} {y} {l}"
                );
                unusable += u32::from(bad);
                for c in 0..3 {
                    let want = cosine * (light[c] - dark[c]) / scale[c];
                    assert!(samples[l][c].is_nan() || (samples[l][c] - want).abs() < 1e-5, "{x} {y} {l} {c}");
                }
            }
        }
    }
    assert!(unusable > 100 && counts.unusable > u64::from(unusable) && counts.black > 0);

    let text = stack.options.text();
    assert_eq!(Options::parse(text.as_bytes(), "a".as_ref()).unwrap(), stack.options, "{text}");
    let odd = Options {
        lights: "a\\\"b\u{c}\u{7f}.lp".into(),
        response: Response::Power(2.2),
        ..Options::default()
    };
    assert_eq!(Options::parse(odd.text().as_bytes(), "a".as_ref()).unwrap(), odd);
    for distance in [Some(1.4), Some(f32::INFINITY)] {
        let near = Options { camera_distance: distance, ..Options::default() };
        assert_eq!(Options::parse(near.text().as_bytes(), "a".as_ref()).unwrap(), near, "{}", near.text());
    }
    let aside = Options { view: Vec3::new(0.6, 0.0, 0.8), ..Options::default() };
    let back = Options::parse(aside.text().as_bytes(), "a".as_ref()).unwrap();
    assert!(back.view.abs_diff_eq(aside.view, 1e-6), "{}", back.view);
    for (text, want) in [
        ("axis = 1", "s.toml:1:1: unknown key 'axis'; did you mean 'axes'?"),
        ("\naxes = \"x x z\"", "s.toml:2:8: the axes are 'x x z'; expected x, y and z in any order"),
        ("white = [1, 0, 1]", "s.toml:1:9: 'white' is [1.0, 0.0, 1.0]; expected numbers above zero"),
        ("response = \"sgrb\"", "s.toml:1:12: unknown response 'sgrb'; did you mean 'srgb'?"),
        ("near = 1", "s.toml:1:8: 'near' is 1; expected true or false"),
        ("near =", "s.toml:1:7: "),
        ("camera_distance = 0", "s.toml:1:19: 'camera_distance' is 0; expected a number from 0.2 to 1000000"),
        ("camera_distance = \"fra\"", "s.toml:1:19: unknown camera distance 'fra'; did you mean 'far'?"),
    ] {
        let got = Options::parse(text.as_bytes(), "s.toml".as_ref()).unwrap_err().to_string();
        assert!(got.starts_with(want), "{got}");
    }
}

#[test]
fn nan_in_an_exr_masks_the_sample_and_is_counted() {
    let folder = Temporary::new();
    let mut image = linear(0);
    image.data[4] = f32::NAN;
    image.data[8] = f32::INFINITY;
    image.data[9..12].fill(0.0);
    let keep = WriteOptions { non_finite: NonFinite::Keep, ..WriteOptions::from(ColourSpace::LinearRec2020) };
    folder.put("a.exr", write_bytes("a.exr".as_ref(), &image, &keep).unwrap());
    folder.put("lights.lp", "1\nD:\\job\\a.exr 0 0 1\n");
    let stack = Folder::open(&folder.0).unwrap();
    assert_eq!(stack.colour_space, ColourSpace::LinearRec2020);
    let mut bands = stack.bands(100).unwrap();
    let band = bands.next().unwrap().unwrap();
    let nan: Vec<usize> = (0..band.values.len()).filter(|&i| band.values[i][0].is_nan()).collect();
    assert_eq!(nan, [1, 2, 3]);
    let counts = bands.counts();
    assert_eq!((counts.unusable, counts.black), (2, 3));
}

#[test]
fn bad_folders_get_a_sentence() {
    let folder = mixed();
    let list = fs::read_to_string(folder.0.join("lights.lp")).unwrap();
    folder.put("lights.lp", list.replace("2.exr", "7.exr"));
    folder.fails(&["lights.lp", "7.exr' is not there"]);
    folder.put("lights.lp", "0\n");
    folder.fails(&["lights.lp", "no light"]);
    fs::remove_file(folder.0.join("lights.lp")).unwrap();
    folder.fails(&["no list of lights", "yugen capture calibrate"]);

    folder.put("lights.lp", list);
    folder.put("stack.toml", "intensities = [1, 2]");
    folder.fails(&["stack.toml", "2 intensities for 7 lights"]);
    folder.put("stack.toml", "ambient = \"gone.png\"");
    folder.fails(&["gone.png"]);
    fs::remove_file(folder.0.join("stack.toml")).unwrap();

    let good = fs::read(folder.0.join("1.png")).unwrap();
    let srgb = WriteOptions::from(ColourSpace::LinearSrgb);
    let small = Image::rgb(SIZE[0], SIZE[1] - 1);
    folder.put("1.png", write_bytes("1.png".as_ref(), &small, &srgb).unwrap());
    folder.fails(&["1.png", "the picture is 7 x 36", "0.png' is 7 x 37"]);
    let grey = Image::new(SIZE[0], SIZE[1], &["Y"]);
    folder.put("1.png", write_bytes("1.png".as_ref(), &grey, &srgb).unwrap());
    folder.fails(&["1.png", "the picture is grey", "coloured"]);
    folder.put("1.png", &good[..good.len() / 2]);
    folder.fails(&["1.png"]);
    folder.put("1.png", b"not a picture");
    folder.fails(&["1.png", "signature"]);
    folder.put("6.hdr", b"not a picture");
    folder.put("1.png", fs::read(folder.0.join("0.png")).unwrap());
    folder.fails(&["6.hdr"]);
    folder.put("1.png", good);
    let wide = WriteOptions::from(ColourSpace::LinearRec2020);
    folder.put("3.exr", write_bytes("3.exr".as_ref(), &linear(0), &wide).unwrap());
    folder.put("lights.lp", "2\n2.exr 0 0 1\n3.exr 0 0 1\n");
    folder.fails(&["3.exr", "the colours are rec2020", "are srgb"]);
    let depth = Image::new(SIZE[0], SIZE[1], &["Z", "depth"]);
    folder.put("3.exr", write_bytes("3.exr".as_ref(), &depth, &wide).unwrap());
    folder.fails(&["3.exr", "expected R, G and B, or Y"]);
    folder.put("mask.png", write_bytes("m.png".as_ref(), &small, &srgb).unwrap());
    folder.fails(&["mask.png", "the picture is 7 x 36"]);
}

#[test]
fn a_real_capture_is_read_with_its_conventions() {
    let Some(data) = std::env::var_os("YUGEN_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
        println!("skipped: YUGEN_DATA is not set");
        return;
    };
    let path = PathBuf::from(data).join("multilight/butterfly");
    let stack = Folder::open_with(&path, |options| {
        options.ambient = Some("image_ambient.png".into());
        options.response = Response::Linear;
        options.axes = "x -y z".parse().unwrap();
    })
    .unwrap();
    assert_eq!([stack.width, stack.height, stack.channels, stack.pictures.len()], [640, 480, 1, 8]);
    let mut bands = stack.bands(100).unwrap();
    let all: Vec<[f32; 3]> = bands.by_ref().flat_map(|b| b.unwrap().values).collect();
    // Codes of pixel (320, 200) as Mitsuba 3.9.1 reads them, lights 0 and 5 and ambient.
    let at = (200 * 640 + 320) * 8;
    let by_hand = |light: f32, ambient: f32| (light - ambient) / 255.0;
    let want = [23.0, 25.0, 16.0];
    assert!((all[at][0] - by_hand(want[0], want[2])).abs() < 1e-6, "{}", all[at][0] * 255.0);
    assert!((all[at + 5][1] - by_hand(want[1], want[2])).abs() < 1e-6, "{}", all[at + 5][1] * 255.0);
    assert_eq!(stack.directions()[1].y.signum(), 1.0, "the list says -0.1407");
}

/// A hundred pictures of 4096 x 4096 with 16 bits, 10 GB of them: their first rows, as no row differs from another. To
/// be run alone, as the peak is the process's.
#[test]
#[ignore = "writes 100 MB and takes a while; cargo test --release -p yugen-archive -- --ignored stays_within"]
fn a_large_stack_stays_within_four_gibibytes() {
    let folder = Temporary::new();
    let size = 4096u32;
    let mut rng = yugen_optics::random::Pcg32::new(1, 1);
    let noise: Vec<u8> = (0..size * size * 3 / 2).flat_map(|_| rng.next_u32().to_le_bytes()).collect();
    let file = fs::File::create(folder.0.join("a.png")).unwrap();
    let mut encoder = ::png::Encoder::new(std::io::BufWriter::new(file), size, size);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Sixteen);
    encoder.set_compression(::png::Compression::Fast);
    encoder.write_header().unwrap().write_image_data(&noise).unwrap();
    drop(noise);
    folder.put("lights.lp", format!("100\n{}", "a.png 0 0 1\n".repeat(100)));
    let stack = Folder::open(&folder.0).unwrap();
    let rows = stack.rows_within(1 << 30);
    let started = std::time::Instant::now();
    let mut bands = stack.bands(rows).unwrap();
    for _ in 0..2 {
        assert_eq!(bands.next().unwrap().unwrap().height, rows);
    }
    let seconds = started.elapsed().as_secs_f64();
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let peak = status.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    let kilobytes: u64 = peak.split_whitespace().nth(1).unwrap().parse().unwrap();
    println!(
        "{rows} rows a band, {:.1} rows a second, peak {} MB",
        2.0 * rows as f64 / seconds,
        kilobytes / 1000
    );
    assert!(kilobytes < 4 << 20, "{kilobytes} kB");
}

/// Pictures 1, 2 and 10 of three lights, and the list with these names for them.
fn listed(names: [&str; 3]) -> Temporary {
    let folder = Temporary::new();
    let srgb = WriteOptions::from(ColourSpace::LinearSrgb);
    for (light, name) in ["shot1.png", "shot2.png", "shot10.png"].into_iter().enumerate() {
        folder.put(name, write_bytes(name.as_ref(), &linear(light), &srgb).unwrap());
    }
    let line = |(i, name): (usize, &str)| format!("{name} 0 {i} 1\n");
    let lines: String = names.into_iter().enumerate().map(line).collect();
    folder.put(LIGHTS, format!("3\n{lines}"));
    folder
}

#[test]
fn names_of_other_computers_find_their_pictures() {
    for names in [
        ["SHOT1.PNG", "Shot2.png", "shot10.Png"],
        ["shot1.nef", "shot2.NEF", "SHOT10.tif"],
        ["C:\\a\\SHOT1.PNG", "x/shot2.png", "shot10"],
        // By their order, in which 2 comes before 10.
        ["", "", ""],
        ["ball_a.png", "ball_b.png", "ball_c.png"],
    ] {
        let folder = listed(names);
        let stack = Folder::open(&folder.0).unwrap();
        let found: Vec<_> =
            stack.pictures.iter().map(|p| p.path.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(found, ["shot1.png", "shot2.png", "shot10.png"], "{names:?}");
        assert_eq!(stack.pictures[2].light, Vec3::new(0.0, 2.0, 1.0));
    }
    listed(["shot1.png", "ball_b.png", "shot10.png"]).fails(&["'", "ball_b.png' is not there"]);
    listed(["shot1.png", "SHOT1.png", "shot10.png"]).fails(&["two lines of the list mean the picture"]);
    let folder = listed(["", "", ""]);
    fs::remove_file(folder.0.join("shot2.png")).unwrap();
    folder.fails(&["the list names no pictures, and has 3 lights for 2 pictures", "name them in the list"]);
    // Of another stack: the first that is missing, and how many are.
    let folder = listed(["shot1.png", "far2.png", "far3.png"]);
    folder.fails(&[
        "2 of the 3 pictures that it names are not there",
        "far2.png' first",
        "list of another stack",
    ]);
    let folder = listed(["far1.png", "far2.png", "far3.png"]);
    fs::remove_file(folder.0.join("shot2.png")).unwrap();
    folder.fails(&[
        "none of the 3 pictures that it names is there",
        "there are 2 others",
        "list of another stack",
    ]);
    // Two that differ in their extension: which one is meant?
    let folder = listed(["shot1.png", "shot2.jpg", "shot10.png"]);
    fs::copy(folder.0.join("shot2.png"), folder.0.join("shot2.tif")).unwrap();
    folder.fails(&[
        "shot2.jpg' is not there, and 'shot2.png' and 'shot2.tif' differ from it in case or extension only",
        "correct its line",
    ]);
}

/// A camera that chose its exposures; and one whose stack says how bright each is.
#[test]
fn photographs_of_a_stack_were_exposed_alike() {
    let temporary = Temporary::new();
    let folder = &temporary.0;
    let photograph = |name: &str, seconds: u32| {
        let file = folder.join(name);
        image::write(&file, &Image::rgb(6, 4), &WriteOptions::default()).unwrap();
        let jpeg = fs::read(&file).unwrap();
        let mut exif = crate::formats::exif::tests::segment();
        // 1/60 s, as the segment has it.
        let at = exif.windows(8).position(|w| w == [1, 0, 0, 0, 60, 0, 0, 0]).unwrap();
        exif[at + 4..at + 8].copy_from_slice(&seconds.to_le_bytes());
        fs::write(&file, [&jpeg[..2], &exif, &jpeg[2..]].concat()).unwrap();
        lp::Entry { file: name.into(), light: Vec3::Z }
    };
    let entries = [photograph("a.jpg", 60), photograph("b.jpg", 58), photograph("c.jpg", 30)];
    write(folder, &entries[..2], &Options::default()).unwrap();
    Folder::open(folder).unwrap();
    write(folder, &entries, &Options::default()).unwrap();
    temporary.fails(&[
        "c.jpg: by its Exif data this was exposed 2.00 times as much as",
        "a.jpg",
        "intensities",
    ]);
    write(folder, &entries, &Options { intensities: vec![[1.0; 3]; 3], ..Options::default() }).unwrap();
    Folder::open(folder).unwrap();
}

/// A folder of raw files is told from an empty one.
#[test]
fn why_there_is_no_picture() {
    let folder = Temporary::new();
    assert!(no_picture(&folder.0).to_string().ends_with("there is no picture in it"));
    folder.put("DSC_0001.NEF", b"II*\0");
    let said = no_picture(&folder.0).to_string();
    assert!(said.contains("raw files of a camera such as 'DSC_0001.NEF'; develop them"), "{said}");
}

/// As a camera writes it: what the options say comes first, then Exif; of a cropped picture that says nothing.
#[test]
fn exif_tells_how_near_the_camera_stood() {
    let temporary = Temporary::new();
    let folder = &temporary.0;
    let photograph = |width: usize, options: Options| {
        let file = folder.join("a.jpg");
        image::write(&file, &Image::rgb(width, 4), &WriteOptions::default()).unwrap();
        let jpeg = fs::read(&file).unwrap();
        let with = [&jpeg[..2], &crate::formats::exif::tests::segment(), &jpeg[2..]].concat();
        fs::write(&file, with).unwrap();
        write(folder, &[lp::Entry { file: "a.jpg".into(), light: Vec3::Z }], &options).unwrap();
        Folder::open(folder).unwrap().camera_distance
    };
    assert!((photograph(6, Options::default()) - 50.0 / 36.0).abs() < 1e-4);
    assert_eq!(photograph(5, Options::default()), f32::INFINITY);
    for said in [3.0, f32::INFINITY] {
        assert_eq!(photograph(6, Options { camera_distance: Some(said), ..Options::default() }), said);
    }
}

/// A list beside balls serves the pictures of another folder, with what is said of it there.
#[test]
fn lights_of_another_folder_serve() {
    let (object, balls) = (Temporary::new(), Temporary::new());
    let picture = write_bytes("a.exr".as_ref(), &Image::rgb(6, 4), &WriteOptions::default()).unwrap();
    ["a.exr", "b.exr"].iter().for_each(|name| object.put(name, &picture));
    object.put(OPTIONS, "response = \"linear\"\n");
    let entry = |file: &str, light| lp::Entry { file: file.into(), light };
    let lamps = [Vec3::new(0.0, 4.0, 4.0), Vec3::new(2.0, 0.0, 4.0)];
    let options = Options { near: true, field_width: 2.0, camera_distance: Some(1.5), ..Options::default() };
    write(&balls.0, &[entry("ball1.jpg", lamps[0]), entry("ball2.jpg", lamps[1])], &options).unwrap();
    let list = balls.0.join(LIGHTS);
    let stack = Folder::open_lit_by(&object.0, &list).unwrap();
    assert!(stack.options.near && stack.options.response == Response::Linear);
    assert_eq!((stack.positions(), stack.camera_distance), (lamps.map(|l| l * 0.5).to_vec(), 1.5));
    // What the stack says of its camera comes first; a list without options beside it is as the stack has it.
    object.put(OPTIONS, "camera_distance = \"far\"\n");
    assert_eq!(Folder::open_lit_by(&object.0, &list).unwrap().camera_distance, f32::INFINITY);
    fs::remove_file(balls.0.join(OPTIONS)).unwrap();
    assert!(!Folder::open_lit_by(&object.0, &list).unwrap().options.near);
    let missing = Folder::open_lit_by(&object.0, &balls.0.join("none.lp")).unwrap_err().to_string();
    assert!(missing.contains("there is no list of lights") && missing.contains("none.lp"), "{missing}");
}
