use super::super::relightable::DEFAULT_MAX_TEXELS;
use super::super::relightable::tests::{quanta, sample};
use super::*;

/// Waves of some texels' length: what JPEG is made for.
fn smooth(basis: Basis, colouring: Colouring, width: usize, height: usize) -> Relightable {
    let mut r = sample(basis, colouring, width, height);
    let stride = r.stride();
    for (i, v) in r.coefficients.iter_mut().enumerate() {
        let (texel, k) = (i / stride, (i % stride) as f32);
        let (x, y) = ((texel % width) as f32, (texel / width) as f32);
        *v = 0.5 + 0.4 * (0.2 * x + k).sin() * (0.3 * y).cos();
    }
    r
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("yugen-relight-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

fn terms(folder: &Path) -> Result<Relightable, Error> {
    read(folder, DEFAULT_MAX_TEXELS).map(|c| c.terms().unwrap())
}

#[test]
fn folders_come_back() {
    let folder = scratch("back");
    for (basis, colouring) in [
        (Basis::Ptm, Colouring::Rgb),
        (Basis::Ptm, Colouring::Lrgb),
        (Basis::Hsh { order: 3 }, Colouring::Rgb),
        (Basis::Hsh { order: 2 }, Colouring::Lrgb),
    ] {
        let r = smooth(basis, colouring, 40, 24);
        write(&folder, &mut (&r).into(), Layout::Image).unwrap();
        let back = terms(&folder).unwrap();
        // Half a level for the byte and what JPEG loses; measured 9.3, with planes that are unlike each other.
        assert!(quanta(&r, &back) < 36.0, "{basis:?} {colouring:?} {}", quanta(&r, &back));
    }
    std::fs::write(folder.join("plane_1.jpg"), b"no picture").unwrap();
    let error = |limit| read(&folder, limit).unwrap_err().to_string();
    assert!(error(1000).contains("plane_1.jpg"));
    std::fs::remove_file(folder.join("plane_1.jpg")).unwrap();
    assert!(error(1000).contains("neither the picture plane_1.jpg nor tiles"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(error(1000).contains(INFO));
}

#[test]
fn tiles_of_every_layout_come_back() {
    // Three levels, the last tiles cut off.
    let r = smooth(Basis::Ptm, Colouring::Lrgb, 530, 260);
    for layout in Layout::ALL {
        let folder = scratch(&format!("every_{}", layout.name()));
        write(&folder, &mut (&r).into(), layout).unwrap();
        let back = terms(&folder).unwrap();
        // As for pictures that are whole.
        assert!(quanta(&r, &back) < 36.0, "{layout:?}: {}", quanta(&r, &back));
        for file in files(&folder, r.stride(), layout) {
            assert!(file.exists(), "{}", file.display());
        }
        let count = std::fs::read_dir(&folder).unwrap().count();
        assert_eq!(count, files(&folder, r.stride(), layout).len());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

#[test]
fn every_level_has_the_tiles_that_viewers_count() {
    let folder = scratch("levels");
    let r = smooth(Basis::Ptm, Colouring::Lrgb, 530, 260);
    write(&folder, &mut (&r).into(), Layout::ITarZoom).unwrap();
    let index: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("planes.tzi")).unwrap()).unwrap();
    // 530 x 260, 265 x 130 and 132 x 65: six, two and one of three pictures.
    assert_eq!((&index["nlevels"], &index["stride"]), (&3.into(), &3.into()));
    assert_eq!(index["offsets"].as_array().unwrap().len(), 3 * 9 + 1);
    // Each picture is the one before at half the size, here of one grey.
    let flat = Relightable { coefficients: vec![0.25; 530 * 260 * 9], ..r };
    write(&folder, &mut (&flat).into(), Layout::DeepZoom).unwrap();
    for (level, size) in [(0, [132, 65]), (1, [256, 130]), (2, [256, 256])] {
        let path = folder.join(format!("plane_0_files/{level}/0_0.jpg"));
        let tile = super::super::image::read(&path, &super::super::image::ReadOptions::raw()).unwrap();
        assert_eq!([tile.width, tile.height], size);
        assert!(tile.data.iter().all(|v| (v - 64.0 / 255.0).abs() < 1.1 / 255.0));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The bytes of a lossless picture whose pixel (x, y) has the value of `at` in channel c.
fn png(width: u32, height: u32, at: impl Fn(u32, u32, u32) -> u8) -> Vec<u8> {
    let pixels =
        ::image::RgbImage::from_fn(width, height, |x, y| ::image::Rgb([0, 1, 2].map(|c| at(x, y, c))));
    let mut out = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut out, ::image::ImageFormat::Png).unwrap();
    out.into_inner()
}

fn put(path: PathBuf, bytes: &[u8]) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// No two neighbours alike, along no axis.
fn pattern(x: u32, y: u32, c: u32) -> u8 {
    (x * 7 + y * 13 + c * 71 + x * y % 11) as u8
}

/// An LRGB polynomial of degree one: two pictures.
fn first_degree(width: usize, height: usize) -> String {
    format!(
        r#"{{"width": {width}, "height": {height}, "format": "png", "type": "ptm", "colorspace": "lrgb", "nplanes": 6,
"materials": [{{"scale": [9,9,9,1,2,255], "bias": [5,5,5,0,0,0]}}]}}"#
    )
}

/// What [`first_degree`] makes of [`pattern`].
fn expected(width: usize, height: usize) -> Vec<f32> {
    let texels = (0..height as u32).flat_map(|y| (0..width as u32).map(move |x| (x, y)));
    texels
        .flat_map(|(x, y)| {
            let v = [0, 1, 2].map(|c| f32::from(pattern(x, y, c)) / 255.0);
            [v[0], v[1], v[2], v[0], v[1] * 2.0, v[2] * 255.0, 0.0, 0.0, 0.0]
        })
        .collect()
}

#[test]
fn tiles_that_others_cut_fit_together() {
    let (width, height) = (70usize, 37usize);
    let want = expected(width, height);
    let tile = |left: usize, top: usize, across: usize, down: usize| {
        png(across as u32, down as u32, |x, y, c| pattern(x + left as u32, y + top as u32, c))
    };
    let tiles = |side: usize, overlap: usize| {
        let places =
            (0..height.div_ceil(side)).flat_map(move |y| (0..width.div_ceil(side)).map(move |x| (x, y)));
        places.map(move |(x, y)| {
            let part = |i: usize, size: usize| {
                let from = (i * side).saturating_sub(overlap);
                (from, ((i + 1) * side + overlap).min(size) - from)
            };
            (x, y, part(x, width), part(y, height))
        })
    };
    let check = |name: &str, make: &dyn Fn(&Path, usize)| {
        let folder = scratch(name);
        put(folder.join(INFO), first_degree(width, height).as_bytes());
        (0..2).for_each(|picture| make(&folder, picture));
        let r = terms(&folder).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((r.basis, r.colouring), (Basis::Ptm, Colouring::Lrgb));
        let worst = r.coefficients.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-4 && r.coefficients.len() == want.len(), "{name}: {worst}");
        std::fs::remove_dir_all(folder).unwrap();
    };
    let plane = |folder: &Path, picture: usize, rest: &str| folder.join(format!("plane_{picture}{rest}"));
    check("whole", &|folder, i| put(plane(folder, i, ".png"), &tile(0, 0, width, height)));
    // Overlapping, with the level of one pixel at the bottom of the pyramid.
    check("dzi", &|folder, i| {
        let text = format!(
            r#"<Image TileSize="32" Overlap="3" Format="png" xmlns="http://schemas.microsoft.com/deepzoom/2008">
<Size Width="{width}" Height="{height}"/></Image>"#
        );
        put(plane(folder, i, ".dzi"), text.as_bytes());
        put(plane(folder, i, "_files/0/0_0.png"), &tile(0, 0, 1, 1));
        for (x, y, (left, across), (top, down)) in tiles(32, 3) {
            put(plane(folder, i, &format!("_files/7/{x}_{y}.png")), &tile(left, top, across, down));
        }
    });
    for (name, first, root) in [("zoomify", 9, ""), ("zoomify_of_relightlab", 0, "_zoomify")] {
        check(name, &|folder, i| {
            let text = format!(
                r#"<IMAGE_PROPERTIES WIDTH="{width}" HEIGHT="{height}" NUMTILES="24" NUMIMAGES="1" VERSION="1.8" TILESIZE="16"/>"#
            );
            put(plane(folder, i, &format!("{root}/ImageProperties.xml")), text.as_bytes());
            for (x, y, (left, across), (top, down)) in tiles(16, 0) {
                // 5 x 3 tiles; before them come 3 x 2, 2 x 1 and 1 where smaller levels are the first.
                assert!((first + y * 5 + x) / 256 == 0);
                let level = 3;
                let name = format!("{root}/TileGroup0/{level}-{x}-{y}.png");
                put(plane(folder, i, &name), &tile(left, top, across, down));
            }
        });
    }
    check("google", &|folder, i| {
        // Filled to a whole tile.
        let whole = png(256, 256, |x, y, c| {
            let inside = (x as usize) < width && (y as usize) < height;
            if inside { pattern(x, y, c) } else { 255 }
        });
        put(plane(folder, i, "/0/0/0.png"), &whole);
    });
    for (name, size) in [("iiif_2", "W,"), ("iiif_3", "W,H")] {
        check(name, &|folder, i| {
            let text = format!(
                r#"{{"width": {width}, "height": {height}, "tiles": [{{"width": 32, "scaleFactors": [1, 2, 4]}}]}}"#
            );
            put(plane(folder, i, "/info.json"), text.as_bytes());
            for (_, _, (left, across), (top, down)) in tiles(32, 0) {
                let size = size.replace('W', &across.to_string()).replace('H', &down.to_string());
                let name = format!("/{left},{top},{across},{down}/{size}/0/default.png");
                put(plane(folder, i, &name), &tile(left, top, across, down));
            }
        });
    }
    // Two pictures' tiles in turn, after two of a smaller size; what tiles share may not be said.
    // With tiles of 66 the first one is all of the width, clipped, and the last one tells.
    for (name, said, side, shared) in
        [("itarzoom", 2, 32, 2), ("itarzoom_by_script", 0, 32, 2), ("itarzoom_clipped", 0, 66, 6)]
    {
        check(name, &|folder, i| {
            if i == 1 {
                return;
            }
            let mut data = b"small!".to_vec();
            let mut offsets = vec![0, 3, 6];
            for (_, _, (left, across), (top, down)) in tiles(side, shared) {
                for _ in 0..2 {
                    data.extend(tile(left, top, across, down));
                    offsets.push(data.len());
                }
            }
            let text = format!(
                r#"{{"tilesize": {side}, "overlap": {said}, "format": "png", "width": {width}, "height": {height}, "nlevels": 2,
"mode": "interleaved", "stride": 2, "offsets": {offsets:?}}}"#
            );
            put(folder.join("planes.tzb"), &data);
            put(folder.join("planes.tzi"), text.as_bytes());
        });
    }
}

#[test]
fn white_tiles_may_be_left_out_where_a_blank_one_is() {
    let folder = scratch("blank");
    put(folder.join(INFO), first_degree(300, 20).as_bytes());
    for i in 0..2 {
        put(folder.join(format!("plane_{i}/0/0/0.png")), &png(256, 10, pattern));
        put(folder.join(format!("plane_{i}/1/0/0.png")), &png(256, 20, pattern));
    }
    assert!(terms(&folder).unwrap_err().to_string().contains("plane_0/1/0/1.png"));
    (0..2).for_each(|i| put(folder.join(format!("plane_{i}/blank.png")), &png(256, 256, |_, _, _| 255)));
    let r = terms(&folder).unwrap();
    let want = expected(300, 20);
    for (i, texel) in r.coefficients.chunks(9).enumerate() {
        let want = if i % 300 < 256 {
            &want[i * 9..][..9]
        } else {
            &[1.0, 1.0, 1.0, 1.0, 2.0, 255.0, 0.0, 0.0, 0.0]
        };
        assert!(near(texel, want), "{i}: {texel:?} {want:?}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn bad_indices_of_tiles_get_a_sentence() {
    let dzi = r#"<Image TileSize="32" Overlap="3" Format="png"><Size Width="70" Height="37"/></Image>"#;
    let tzi =
        r#"{"tilesize": 32, "width": 70, "height": 37, "stride": 1, "offsets": [0, 3, 5, 7, 9, 11, 13]}"#;
    let zoomify = r#"<P WIDTH="70" HEIGHT="37" TILESIZE="32"/>"#;
    let iiif = r#"{"width": 70, "height": 37, "tiles": [{"width": 32}]}"#;
    let read = |text: &str| tiles::read_index(text.as_bytes(), Path::new("a"), [70, 37], 13);
    for (text, from, to, want) in [
        (dzi, "32", "0", "a: tiles of 0 pixels; expected 16 to 65535"),
        (dzi, "32", "x", "a: expected TileSize=\"…\", a whole number; found 'x'"),
        (dzi, "\"3\"", "\"16\"", "a: tiles share 16 pixels of 32; expected less than half"),
        (dzi, "\"3\"", "\"9223372036854775808\"", "a: tiles share 9223372036854775808 pixels of 32"),
        (dzi, "70", "71", "a: the tiles make 71 x 37 pixels; expected 70 x 37, as info.json says"),
        (dzi, "png", "tif", "a: tiles of the format 'tif' are not read"),
        (dzi, "</Image>", "", "a:1:"),
        (tzi, "32", "8", "a: tiles of 8 pixels"),
        (tzi, "37", "38", "a: the tiles make 70 x 38 pixels"),
        (tzi, "1,", "0,", "a: the tiles are those of 0 pictures"),
        (tzi, "1,", "4,", "a: there are 6 tiles of 4 pictures; expected 24"),
        (tzi, "1,", "18446744073709551615,", "a: there are 6 tiles of 18446744073709551615 pictures"),
        (tzi, ", 13", "", "a: there are 5 tiles of 1 pictures; expected 6 and as many"),
        (tzi, "13", "14", "a: a tile lies between the bytes 11 and 14 of 13"),
        (tzi, "3, 5", "6, 5", "a: a tile lies between the bytes 6 and 5"),
        (tzi, "[0,", "[-1,", "a:1:71: no index of tiles: found -1, expected a whole number, 0 or more"),
        (zoomify, "\"32\"", "\"1e9\"", "a: expected TILESIZE=\"…\", a whole number; found '1e9'"),
        (iiif, "[{\"width\": 32}]", "[]", "a: the picture has no tiles"),
        (iiif, "32", "99999999", "a: tiles of 99999999 pixels"),
    ] {
        assert!(read(text).unwrap() == 6 && text.contains(from), "{from}");
        let got = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(got.contains(want), "{from} -> {to}: {got}");
    }
    // Tiles that are not as large as they should be, and none at all.
    let folder = scratch("bad");
    put(folder.join(INFO), first_degree(70, 37).as_bytes());
    for i in 0..2 {
        put(folder.join(format!("plane_{i}.dzi")), dzi.as_bytes());
    }
    let error = || super::read(&folder, 1 << 20).unwrap_err().to_string();
    assert!(error().contains("plane_0_files: there are no levels of tiles"), "{}", error());
    for i in 0..2 {
        put(folder.join(format!("plane_{i}_files/3/0_0.png")), &png(32, 32, pattern));
    }
    assert!(error().contains("0_0.png: expected 35 x 35 pixels of 3 channels; found 32 x 32"), "{}", error());
    std::fs::remove_dir_all(folder).unwrap();
}

fn mixed(folder: &Path) -> Mixed {
    match read(folder, 1 << 20).unwrap() {
        Contents::Mixed(m) => m,
        Contents::Terms(_) => panic!("terms"),
    }
}

fn near(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4)
}

#[test]
fn components_have_the_colours_of_the_file() {
    let folder = scratch("components");
    // One texel with the bytes 51, 102 and 153.
    put(folder.join("plane_0.png"), &png(1, 1, |_, _, c| 51 * (c as u8 + 1)));
    let lights = r#""lights": [0, 0, 1, 0.6, 0, 0.8], "sigma": 0.5"#;
    let basis = [
        // What all planes share, then two planes: red, green and blue under each of two lights.
        [51, 102, 153, 0, 255, 0],
        [127, 227, 27, 127, 127, 177],
        [0, 127, 254, 137, 127, 127],
    ];
    let text = |space: &str, basis: &str| {
        format!(
            r#"{{"width": 1, "height": 1, "format": "png", "type": "rbf", {lights}, {space}, {basis}
"materials": [{{"scale": [2, 1], "bias": [0.1, 0.2], "range": [100, 10]}}]}}"#
        )
    };
    let own = format!(r#""basis": {:?},"#, basis.as_flattened());
    put(folder.join(INFO), text(r#""colorspace": "mrgb", "nplanes": 2"#, &own).as_bytes());
    let m = mixed(&folder);
    let want = [
        [0.2, 0.4, 0.6],
        [0.0, 1.0, -1.0],
        [-12.7, 0.0, 12.7],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 0.5],
        [1.0, 0.0, 0.0],
    ];
    let Functions::Sampled { between, colours } = &m.functions else { panic!("{:?}", m.functions) };
    let lights = vec![Vec3::Z, Vec3::new(0.6, 0.0, 0.8)];
    assert_eq!(between, &Between::Gaussian { lights, sigma: 0.5 });
    assert!(near(colours.as_flattened(), want.as_flattened()), "{colours:?}");
    assert!(near(&m.coefficients, &[0.2, 0.2]), "{:?}", m.coefficients);
    assert_eq!((m.functions.coefficients(), m.functions.name()), (2, "RBF, 2 lights".into()));
    // Older folders keep the codes in a file of their own.
    put(folder.join(INFO), text(r#""colorspace": "mrgb", "nplanes": 2"#, "").as_bytes());
    assert!(read(&folder, 10).unwrap_err().to_string().contains(MATERIALS));
    put(folder.join(MATERIALS), &basis.as_flattened().iter().map(|v| *v as u8).collect::<Vec<_>>());
    assert_eq!(mixed(&folder), m);
    put(folder.join(MATERIALS), &[0; 17]);
    assert!(read(&folder, 10).unwrap_err().to_string().contains("expected 18 bytes, found 17"));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn luminance_and_chrominance_alternate_until_chrominance_ends() {
    let folder = scratch("mycc");
    put(folder.join("plane_0.png"), &png(1, 1, |_, _, c| 51 * (c as u8 + 1)));
    put(folder.join("plane_1.png"), &png(1, 1, |_, _, _| 255));
    // Two planes of Y, one each of Co and Cg, on a grid of two by two lights that are all alike.
    let planes = [[255, 51, 102], [137, 0, 0], [0, 147, 0], [0, 0, 147], [227, 1, 1]];
    let basis: Vec<i32> = planes.iter().flat_map(|p| p.repeat(4)).collect();
    let text = format!(
        r#"{{"width": 1, "height": 1, "format": "png", "type": "bilinear", "resolution": 2, "colorspace": "mycc",
"yccplanes": [2, 1, 1], "basis": {basis:?},
"materials": [{{"scale": [1, 1, 1, 1], "bias": [0, 0, 0, 0], "range": [10, 10, 10, 100]}}]}}"#
    );
    put(folder.join(INFO), text.as_bytes());
    let m = mixed(&folder);
    // YCoCg: a grey step of Y; Co is red minus blue; Cg is green against both.
    let want =
        [[1.0 - 0.2 + 0.1, 1.2, 1.0 - 0.2 - 0.1], [1.0; 3], [1.0, 0.0, -1.0], [-1.0, 1.0, -1.0], [1.0; 3]];
    let Functions::Sampled { between, colours } = &m.functions else { panic!("{:?}", m.functions) };
    assert_eq!(between, &Between::Octahedron { side: 2 });
    assert!(near(colours.as_flattened(), want.repeat(4).as_flattened()), "{colours:?}");
    assert!(near(&m.coefficients, &[0.2, 0.4, 0.6, 1.0]), "{:?}", m.coefficients);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn chrominance_of_the_first_picture_is_fixed() {
    let folder = scratch("ycc");
    for i in 0..6 {
        put(folder.join(format!("plane_{i}.png")), &png(1, 1, |_, _, c| 51 * (c as u8) + i));
    }
    let text = format!(
        r#"{{"width": 1, "height": 1, "format": "png", "type": "ptm", "colorspace": "ycc", "nplanes": 18,
"materials": [{{"scale": {:?}, "bias": {:?}}}]}}"#,
        [255.0; 18].map(|v: f32| v),
        [0.0; 18].map(|v: f32| v),
    );
    put(folder.join(INFO), text.as_bytes());
    let m = mixed(&folder);
    assert_eq!(m.functions, Functions::Luminance(Basis::Ptm));
    // The luminance of each term, then Cb and Cr of the first.
    assert!(near(&m.coefficients, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 50.5, 101.5]), "{:?}", m.coefficients);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn bad_infos_get_a_sentence() {
    let lrgb = r#"{"width": 4, "height": 2, "type": "ptm", "colorspace": "lrgb", "nplanes": 9,
"materials": [{"scale": [1,1,1,1,1,1,1,1,1], "bias": [0,0,0,0,0,0,0,0,0]}]}"#;
    let rbf = r#"{"width": 4, "height": 2, "type": "rbf", "colorspace": "mrgb", "nplanes": 1, "lights": [0, 0, 1],
"sigma": 0.5, "basis": [1,2,3,4,5,6], "materials": [{"scale": [1], "bias": [0], "range": [9]}]}"#;
    let bln = r#"{"width": 4, "height": 2, "type": "bilinear", "colorspace": "mycc", "yccplanes": [1,1,1], "resolution": 2,
"materials": [{"scale": [1,1,1], "bias": [0,0,0], "range": [9,9,9]}]}"#;
    let parse = |text: &str| read_info(text.as_bytes(), Path::new("info.json"), 1000);
    for (good, from, to, want) in [
        (lrgb, "4,", "0,", "info.json: the picture is empty (0 x 2)"),
        (lrgb, "4,", "4000000000,", "the number of texels (4000000000 x 2)"),
        (
            lrgb,
            "4,",
            "-4,",
            "info.json:1:12: no RelightLab info: found -4, expected a whole number, 0 or more",
        ),
        (lrgb, "\"width\": 4, ", "", "missing field 'width'"),
        (lrgb, "ptm", "ptn", "unknown basis 'ptn'; did you mean 'ptm'?"),
        (lrgb, "ptm", "sh", "the basis 'sh' is not read: programs disagree about which of its terms"),
        (lrgb, "ptm", "rbf", "the basis 'rbf' with the colour space 'lrgb'; expected mrgb or mycc"),
        (lrgb, "ptm", "hsh", "expected HSH of 4, 9 or 16 terms; 9 planes are 6"),
        (lrgb, "lrgb", "mycc", "the basis 'ptm' with the colour space 'mycc'; expected rgb, lrgb or ycc"),
        (lrgb, "lrgb", "rgbl", "unknown colour space 'rgbl'; did you mean 'rgb'?"),
        (lrgb, "nplanes\": 9", "nplanes\": 8", "PTM with the colour space 'lrgb' has 9 planes; found 8"),
        (lrgb, "nplanes\": 9", "nplanes\": 0", "there are 0 planes; expected 1 to 192"),
        (lrgb, "nplanes\": 9", "nplanes\": 1e3", "found 1000.0, expected a whole number"),
        (lrgb, "\"nplanes\": 9,", "", "expected 'nplanes', the number of planes"),
        (lrgb, "[0,0,", "[0,", "expected 9 finite numbers as 'bias', found 8"),
        (lrgb, "[1,1,", "[1e300,1,", "expected 9 finite numbers as 'scale'"),
        (lrgb, "[{", "[], \"x\": [{", "expected one material, found 0"),
        (rbf, "[0, 0, 1]", "[0, 0]", "expected 'lights', three numbers each of 1 to 16384; found 2"),
        (rbf, "[0, 0, 1]", "[0, 0, 1e300]", "expected finite numbers as 'lights'"),
        (rbf, "0.5", "0", "'sigma' is 0; expected .001 to 1000"),
        (
            rbf,
            ",6]",
            "]",
            "expected 6 finite numbers as 'basis', three a light for all planes and for each; found 5",
        ),
        (rbf, "[9]", "[0]", "expected numbers above zero as 'range'"),
        (rbf, ", \"range\": [9]", "", "expected 'range', 1 numbers"),
        (rbf, "mrgb", "mycc", "expected 'yccplanes', three numbers of planes"),
        (bln, "\"resolution\": 2", "\"resolution\": 1", "'resolution' is 1; expected 2 to 128"),
        (
            bln,
            "\"resolution\": 2",
            "\"resolution\": 4294967296",
            "'resolution' is 4294967296; expected 2 to 128",
        ),
        (bln, "[1,1,1]", "[0,2,1]", "'yccplanes' is [0, 2, 1]; expected as many planes of Co as of Cg"),
        (bln, "[1,1,1]", "[18446744073709551615,1,1]", "planes; expected 1 to 192"),
    ] {
        assert!(parse(good).is_ok() && good.contains(from), "{from}");
        let got = parse(&good.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(got.contains(want), "{from} -> {to}: {got}");
    } // Many planes are read of few texels.
    let many = |width: u32| {
        let numbers = [1; 192];
        format!(
            r#"{{"width": {width}, "height": 2, "type": "bilinear", "colorspace": "mrgb", "nplanes": 192, "resolution": 2,
"materials": [{{"scale": {numbers:?}, "bias": {numbers:?}, "range": {numbers:?}}}]}}"#
        )
    };
    assert!(parse(&many(125)).is_ok());
    let got = parse(&many(126)).unwrap_err().to_string();
    assert!(got.contains("the number of coefficients (126 x 2 texels of 192) is 48384, more than"), "{got}");
}
