//! `yugen capture hdr` on brackets of a camera that is known.

use crate::{Run, good, refused, report, scratch, yugen, yugen_in};
use std::path::{Path, PathBuf};
use yugen_archive::formats::image::{NonFinite, ReadOptions, WriteOptions, read, write};
use yugen_archive::formats::stack::Folder;
use yugen_optics::colour::srgb_to_linear;
use yugen_optics::random::Pcg32;
use yugen_optics::{ColourSpace, Image};

/// In a folder.
fn hdr(folder: &Path, line: &str) -> Run {
    yugen_in(folder, &format!("capture hdr {line}"))
}

const SIZE: [usize; 2] = [96, 72];
const SECONDS: [f32; 3] = [0.01, 0.08, 0.64];

/// Radiance from 0.1 to 100 across, coloured, with a white corner that reads 10 and vignetting.
fn scene(x: usize, y: usize, c: usize, light: usize) -> f32 {
    let at = (x as f32 / SIZE[0] as f32 - 0.5).powi(2) + (y as f32 / SIZE[1] as f32 - 0.5).powi(2);
    let fade = (1.0 - 0.4 * at) * [1.0, 0.5][light];
    if x < 12 && y < 12 {
        return 10.0 * [1.0, 0.8, 0.6][c] * fade;
    }
    let ripple = 1.0 + 0.3 * (0.5 * x as f32).sin() * (0.4 * y as f32 + c as f32).sin();
    0.1 * 1000f32.powf(x as f32 / SIZE[0] as f32) * ripple * [1.0, 0.8, 0.6][c] * fade
}

/// What a camera of 20 000 electrons says, its levels a power of the light.
fn expose(
    picture: impl Fn(usize, usize, usize) -> f32,
    seconds: f32,
    power: f32,
    moved: usize,
    seed: u64,
) -> Image {
    let mut image = Image::rgb(SIZE[0], SIZE[1]);
    let mut rng = Pcg32::new(seed, 1);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            for c in 0..3 {
                let electrons =
                    rng.poisson(f64::from(picture(x.saturating_sub(moved), y, c) * seconds) * 2e4) as f32;
                let light = ((electrons + 4.0 * rng.normal()) / 2e4).clamp(0.0, 1.0);
                // The file's encoding is undone here, so that the level itself is what the curve says.
                image.pixel_mut(x, y)[c] = srgb_to_linear(light.powf(power));
            }
        }
    }
    image
}

fn put(path: &Path, image: &Image, bits: u8) {
    write(path, image, &WriteOptions { bits, ..WriteOptions::from(ColourSpace::LinearSrgb) }).unwrap();
}

fn hdr_image(path: &Path) -> Image {
    read(path, &ReadOptions { non_finite: NonFinite::Keep, ..ReadOptions::raw() }).unwrap()
}

#[test]
fn a_folder_of_brackets_becomes_a_stack() {
    let folder = scratch("hdr/stack");
    let mut list = String::from("file,seconds,light\n");
    for light in 0..2 {
        for (i, t) in SECONDS.iter().enumerate() {
            let name = format!("lamp {light}_{i}.png");
            let seed = (10 * light + i) as u64;
            put(&folder.join(&name), &expose(|x, y, c| scene(x, y, c, light), *t, 1.0 / 2.0, 0, seed), 16);
            list += &format!("{name},{t},lamp {light}\n");
        }
    }
    std::fs::write(folder.join("exposures.csv"), list).unwrap();
    std::fs::write(folder.join("lights.lp"), "2\nC:\\lamp 1_0.png 0 0.6 0.8\nlamp 0.jpg 0,0 0,0 2,0\n")
        .unwrap();
    let out = folder.join("out");
    let told = report(hdr(
        &folder,
        ". -o out --json --response recover --save-response response.csv --full-well 20000 --read-noise 4",
    ));
    for row in told["lights"].as_array().unwrap() {
        let fit = row["chi_square_per_degree"].as_f64().unwrap();
        println!("chi-square per degree {fit}, moved {}", row["moved_pixels"]);
        // The response is known to half a percent, and the noise of bright pixels is no more.
        assert!((0.7..3.0).contains(&fit), "{row}");
        // Neighbouring exposures share a third of so small a picture.
        assert!(row["moved_pixels"].as_f64().unwrap() < 0.5, "{row}");
        assert_eq!(row["saturated"], 0);
    }
    // Levels go with the root of light.
    let text = std::fs::read_to_string(folder.join("response.csv")).unwrap();
    let half = text.lines().nth(129).unwrap().split(',').nth(2).unwrap().parse::<f32>().unwrap();
    println!("light of level 128/255: {half}");
    assert!((half / (128f32 / 255.0).powi(2) - 1.0).abs() < 0.02, "{half}");

    // Light 1 has the second line of the list and half the light; both pictures to scale.
    let merged = hdr_image(&out.join("lamp 0.exr"));
    assert_eq!(merged.channels, ["R", "G", "B", "sigma.R", "sigma.G", "sigma.B"]);
    let (mut scale, mut n) = (0.0, 0.0);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            scale += f64::from(merged.pixel(x, y)[1] / scene(x, y, 1, 0));
            n += 1.0;
        }
    }
    // A response is known but for a factor that its normalisation at full scale takes up.
    let scale = (scale / n) as f32;
    assert!((scale - 1.0).abs() < 0.03, "{scale}");
    let (mut worst, mut score) = (0f32, 0.0);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            for c in 0..3 {
                let (got, sigma) = (merged.pixel(x, y)[c] / scale, merged.pixel(x, y)[3 + c] / scale);
                let want = scene(x, y, c, 0);
                worst = worst.max((got / want - 1.0).abs());
                score += f64::from((got - want) / sigma).powi(2) / (3 * SIZE[0] * SIZE[1]) as f64;
            }
        }
    }
    println!("merged: worst {worst}, mean square of z {score}");
    assert!(worst < 0.15 && (0.7..3.0).contains(&score), "{worst} {score}");
    let stack = Folder::open(&out).unwrap();
    assert_eq!(stack.pictures.len(), 2);
    assert_eq!(stack.directions()[0].z, 1.0, "a position of the list keeps its place");
    assert!((stack.directions()[1].y - 0.6).abs() < 1e-6);

    // White, flat and chart: the flat's shape, then the corner reads 0.9 in every channel and light.
    let mut flat = Image::rgb(SIZE[0], SIZE[1]);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let at = (x as f32 / SIZE[0] as f32 - 0.5).powi(2) + (y as f32 / SIZE[1] as f32 - 0.5).powi(2);
            flat.pixel_mut(x, y).fill(7.0 * (1.0 - 0.4 * at));
        }
    }
    put(&folder.join("flat.exr"), &flat, 8);
    std::fs::write(
        folder.join("chart.csv"),
        "red,green,blue,known_red,known_green,known_blue\n1,0,0,0,1,0\n0,1,0,2,0,0\n0,0,1,0,0,1\n1,1,1,2,1,1\n",
    )
    .unwrap();
    let told = report(hdr(
        &folder,
        ". -o out --force --json --response response.csv --flat flat.exr --white 2,2,8,8 --white-reflectance 0.9 --chart chart.csv",
    ));
    assert!(told["colour_error"].as_f64().unwrap() < 1e-6);
    let stack = Folder::open(&out).unwrap();
    assert!(stack.options.level_white);
    let band = stack.bands(SIZE[1]).unwrap().next().unwrap().unwrap();
    for (x, y) in [(5, 5), (60, 20), (90, 70)] {
        for light in 0..2 {
            let got = band.values[(y * SIZE[0] + x) * 2 + light];
            let fade = |x: usize, y: usize| {
                let at =
                    (x as f32 / SIZE[0] as f32 - 0.5).powi(2) + (y as f32 / SIZE[1] as f32 - 0.5).powi(2);
                1.0 - 0.4 * at
            };
            let reflectance = |c: usize| {
                let white = 10.0 * [1.0, 0.8, 0.6][c] * [1.0, 0.5][light];
                0.9 * scene(x, y, c, light) / fade(x, y) / white
            };
            // The chart swaps red and green and doubles the new red; a level white gets a fifth less of light 1.
            let cosine = [1.0, 0.8][light];
            let want = [2.0 * reflectance(1), reflectance(0), reflectance(2)].map(|v| v * cosine);
            for c in 0..3 {
                assert!((got[c] / want[c] - 1.0).abs() < 0.08, "{x} {y} {light}: {got:?} {want:?}");
            }
        }
    }
}

#[test]
fn one_bracket_shows_saturation_motion_and_dark() {
    let folder = scratch("hdr/one");
    let names: Vec<PathBuf> = (0..3).map(|i| folder.join(format!("b{i}.png"))).collect();
    let glow = |x: usize, y: usize, c: usize| if x > 90 { 400.0 } else { scene(x, y, c, 0) + 0.05 / 0.64 };
    let mut list = String::from("file;seconds\n");
    for (i, name) in names.iter().enumerate() {
        put(name, &expose(glow, SECONDS[i], 1.0, if i == 2 { 3 } else { 0 }, i as u64), 16);
        list += &format!("b{i}.png;{}\n", SECONDS[i].to_string().replace('.', ","));
    }
    std::fs::write(folder.join("list.csv"), list).unwrap();
    let list = folder.join("list.csv");
    let hdr = |line: &str| hdr(&folder, line);
    let options = "-o out.exr --list list.csv --json --response linear";
    let told = report(hdr(&format!("b0.png b1.png b2.png {options}")));
    let row = &told["lights"][0];
    println!("{row}");
    let moved = row["moved_pixels"].as_f64().unwrap();
    assert!((moved - 3.0).abs() < 0.5, "{moved}");
    let saturated = row["saturated"].as_u64().unwrap();
    let image = hdr_image(&folder.join("out.exr"));
    assert_eq!(
        saturated,
        image.data.chunks_exact(6).filter(|p| p[0].is_nan() && p[3].is_nan()).count() as u64
    );
    // Columns 91 to 95, which no exposure holds.
    assert!((300..=400).contains(&saturated), "{saturated}");

    refused(hdr("b0.png -o out.exr"), &["b0.png", "no exposure time", "--list"]);
    refused(hdr("b0.png -o a.png"), &["a.png", ".exr"]);
    refused(hdr(". -o a.exr"), &["a.exr", "a folder becomes a folder"]);
    refused(hdr("list.csv -o out.exr"), &["list.csv", "a list, not a picture", "folder"]);
    refused(hdr("out.exr -o out.exr"), &["out.exr", "this is read", "another output"]);
    refused(hdr("b0.png b1.png -o out.exr --list list.csv"), &["b2.png' is not there"]);
    refused(hdr("b0.png -o out.exr --response gone.csv --list list.csv"), &["is not there"]);
    refused(
        hdr(&format!("b0.png b1.png b2.png {options} --save-response gone/r.csv")),
        &["no folder 'gone'"],
    );
    let lens = "--lens 80,48,36,1e9,0,0,0,0";
    refused(hdr(&format!("b0.png b1.png b2.png {options} {lens}")), &["--lens", "in pixels"]);
    for (option, expected) in [
        ("--full-well -1", "--full-well -1: expected electrons, above 0"),
        ("--read-noise nan", "--read-noise NaN"),
        ("--saturated 2", "between 0.1 and 1"),
        ("--white 1,2,3", "four numbers"),
        ("--white 1,2,3,x", "four whole numbers"),
        ("--white 0,0,9,9 --white-reflectance 0", "above 0"),
        ("--white 90,0,9,9", "does not lie in the pictures"),
    ] {
        refused(
            hdr(&format!("b0.png b1.png b2.png {options} {option}")),
            &[option.split(' ').next().unwrap(), expected],
        );
    }
    let mut grey = Image::new(8, 8, &["Y"]);
    grey.data.fill(0.2);
    put(&folder.join("grey.png"), &grey, 16);
    std::fs::write(&list, "file,seconds\ngrey.png,1\n").unwrap();
    let patches = "red,green,blue,known_red,known_green,known_blue\n1,0,0,1,0,0\n0,1,0,0,1,0\n0,0,1,0,0,1\n";
    std::fs::write(folder.join("chart.csv"), patches).unwrap();
    let charted = "--list list.csv --response linear --chart chart.csv";
    refused(hdr(&format!("grey.png -o out.exr {charted}")), &["--chart is for colours"]);
    std::fs::write(&list, "file,seconds\nb0.png,1\n").unwrap();
    refused(
        hdr("b0.png -o out.exr --list list.csv --response recover"),
        &["cannot be recovered", "different times"],
    );
    // One exposure is merged, and said to gain nothing.
    let output = hdr("b0.png -o out.exr --list list.csv --response linear");
    assert!(output.out.contains("one exposure only"));
    std::fs::write(&list, "file,seconds\nb0.png,1\nb1.png,2\n").unwrap();
    let two = || hdr("b0.png b1.png -o out.exr --list list.csv --response linear");
    put(&names[1], &Image::rgb(8, 8), 16);
    refused(two(), &["b1.png", "8 x 8", "96 x 72"]);
    put(&names[1], &Image::rgb(SIZE[0], SIZE[1]), 8);
    refused(two(), &["b1.png", "8 bits", "16 bits"]);
    std::fs::write(&names[1], b"broken").unwrap();
    refused(two(), &["b1.png"]);
    let mut white = Image::rgb(SIZE[0], SIZE[1]);
    white.data.fill(1.0);
    put(&names[1], &white, 16);
    put(&names[0], &white, 16);
    refused(two(), &["every pixel is saturated", "shorter"]);
}

#[test]
fn what_the_folder_says_is_used_and_passed_on() {
    let folder = scratch("hdr/told");
    let at = |name: &str| folder.join(name).to_str().unwrap().to_string();
    // Near lamps, in perfect pictures and as brackets with noise.
    let (truth, night, stack) = (at("truth"), at("night"), at("stack"));
    let cloth = ["karaori", "--size", "24x16", "--lights", "5", "--near", "1.5"];
    let simulate = |out: &str, more: &[&str]| {
        good(yugen(&["capture", "simulate"], &[&cloth[..], &["-o", out, "--json"], more].concat()));
    };
    simulate(&truth, &[]);
    simulate(&night, &["--exposures", "3", "--full-well", "1000000"]);
    let mut mask = Image::new(24, 16, &["Y"]);
    mask.data[30..].fill(1.0);
    put(&Path::new(&night).join("mask.png"), &mask, 8);
    good(yugen(&["capture", "hdr"], &[&night, "-o", &stack, "--json"]));
    let (want, got) = (Folder::open(truth.as_ref()).unwrap(), Folder::open(stack.as_ref()).unwrap());
    assert!(got.options.near && want.options.near);
    assert_eq!(got.mask.as_deref().unwrap().iter().position(|m| *m), Some(30));
    assert_eq!(got.colour_space, want.colour_space);
    for (a, b) in want.positions().iter().zip(got.positions()) {
        assert!(a.distance(b) < 1e-4, "{a} {b}");
    }
    let values = |stack: &Folder| stack.bands(stack.height).unwrap().next().unwrap().unwrap().values;
    let mut worst = 0f32;
    for (a, b) in values(&want).as_flattened().iter().zip(values(&got).as_flattened()).skip(3 * 5 * 30) {
        worst = worst.max((a - b).abs() / (a + 0.02));
    }
    println!("worst {worst}");
    // Measured .017: noise of a million electrons and 16 bits.
    assert!(worst < 0.07, "{worst}");

    // Flats for each light take the fall-off away, and the list then holds directions.
    let flats = scratch("hdr/told/flats");
    let mut white = Image::rgb(24, 16);
    white.data.fill(1.0);
    (1..=5).for_each(|i| put(&flats.join(format!("{i:04}.exr")), &white, 16));
    good(yugen(
        &["capture", "hdr"],
        &[&night, "-o", &stack, "--flat", flats.to_str().unwrap(), "--force", "--json"],
    ));
    assert!(!Folder::open(stack.as_ref()).unwrap().options.near);

    // Names, axes, intensities and levels of another camera's folder; the former stack's options are replaced.
    let other = scratch("hdr/told/other");
    for (light, level) in [("a", 0.5f32), ("b", 0.25)] {
        let mut picture = Image::rgb(8, 8);
        picture.data.fill(srgb_to_linear(level));
        put(&other.join(format!("{light}.png")), &picture, 16);
    }
    std::fs::write(other.join("exposures.csv"), "file,seconds,light\na.png,1,a\nb.png,1,b\n").unwrap();
    std::fs::write(other.join("lamps.lp"), "2\nb 0 0.6 0.8\na 0 0 1\n").unwrap();
    let told =
        "lights = \"lamps.lp\"\naxes = \"x -y z\"\nresponse = 2.0\nintensities = [2, 4]\nwhite = 0.5\n";
    std::fs::write(other.join("stack.toml"), told).unwrap();
    let other = other.to_str().unwrap();
    let run = yugen(&["capture", "hdr"], &[other, "-o", &stack, "--force", "--json"]);
    assert!(run.success && run.err.contains("mask.png: this mask was here before and stays"), "{}", run.err);
    std::fs::remove_file(Path::new(&stack).join("mask.png")).unwrap();
    let merged = Folder::open(stack.as_ref()).unwrap();
    assert_eq!((merged.options.near, &merged.options.intensities[..]), (false, &[[4.0; 3], [2.0; 3]][..]));
    assert_eq!((merged.options.white, merged.options.response), ([0.5; 3], Default::default()));
    assert!((merged.directions()[1].y + 0.6).abs() < 1e-6);
    // Squares of the levels over the lights' intensities and the white.
    for (got, want) in values(&merged).iter().zip([0.25 / 4.0 / 0.5, 0.0625 / 2.0 / 0.5]) {
        assert!((got[0] / want - 1.0).abs() < 1e-3, "{got:?} {want}");
    }
    let hdr = |more: &[&str]| yugen(&["capture", "hdr"], &[&[other, "-o"], more].concat());
    refused(hdr(&[other]), &["the exposures are here", "another folder"]);
    let list = Path::new(other).join("stack.toml");
    std::fs::write(&list, "lights = \"lamps.lp\"\nintensities = [2]").unwrap();
    refused(hdr(&[&stack]), &["stack.toml", "1 intensities for the 2 lights", "lamps.lp"]);
    std::fs::write(&list, "ambient = \"night.png\"").unwrap();
    refused(hdr(&[&stack]), &["stack.toml", "night.png", "--dark"]);
}

/// A camera whose curve is not that of sRGB: its exposures differ then in how bright they say the same thing is, and in
/// nothing else.
#[test]
fn a_wrong_response_is_no_movement() {
    let folder = scratch("hdr/response");
    // Linear numbers of eight bits that are taken for sRGB leave too little in common to tell how far something moved.
    let cases =
        [("gamma22", 1.0 / 2.2, 0), ("gamma22", 1.0 / 2.2, 3), ("gamma18", 1.0 / 1.8, 3), ("linear", 1.0, 0)];
    for (curve, power, moved) in cases {
        let names: Vec<String> = (0..3).map(|i| format!("{curve}{moved}_{i}.png")).collect();
        let mut list = String::from("file,seconds\n");
        for (i, name) in names.iter().enumerate() {
            let by = if i == 2 { moved } else { 0 };
            put(&folder.join(name), &expose(|x, y, c| scene(x, y, c, 0), SECONDS[i], power, by, i as u64), 8);
            list += &format!("{name},{}\n", SECONDS[i]);
        }
        std::fs::write(folder.join("list.csv"), list).unwrap();
        let line = format!("{} -o out.exr --force --list list.csv --json", names.join(" "));
        let told = report(hdr(&folder, &line));
        let row = &told["lights"][0];
        let found = row["moved_pixels"].as_f64().unwrap();
        println!("{curve}: moved by {found} of {moved}, chi-square {}", row["chi_square_per_degree"]);
        assert!((found - moved as f64).abs() < 0.5, "{curve} {moved}: {row}");
    }
}
