//! What a capture reads and writes.

use crate::{FILE, assault, assault_with, mutate};
use std::path::Path;
use yugen_archive::formats::image::ReadOptions;
use yugen_archive::formats::relightable::{Basis, Colouring, Relightable};
use yugen_archive::formats::relit_contents::Contents;
use yugen_archive::formats::{btf, lp, ptm, relight, rti, stack, wif};
use yugen_optics::ColourSpace;
use yugen_reflectance::btf::{Btf, Texel};

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
    let seed =
        b"x,y,theta_i,phi_i,theta_o,phi_o,f_red,f_green,f_blue\n0,0,0,0,0,0,1,2,3\n1,0,30,0,0,0,2,1,0\n"
            .to_vec();
    assault("goniometer_csv of texels", &[seed], |b| {
        match goniometer_csv::read_texels(b, Path::new(FILE), ColourSpace::LinearRec2020) {
            Ok(t) => {
                let (n, size) = (t.values.len(), t.width * t.height);
                n > 0 && t.directions.len() == n && t.starts.len() == size + 1 && t.starts[size] == n
            }
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
            assert_eq!(back.ok().as_ref(), Some(&options));
            // Only what has changed is changed.
            let new = stack::Options { near: !options.near, field_width: 3.0, ..options.clone() };
            let text = String::from_utf8_lossy(b);
            let amended = options.amended(&text, Path::new(FILE), &new).unwrap();
            assert_eq!(
                stack::Options::parse(amended.as_bytes(), Path::new(FILE)).ok(),
                Some(new),
                "{amended}"
            );
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
fn whole(read: Result<Contents, yugen_archive::Error>) -> bool {
    match read {
        Ok(r) => {
            let [width, height] = r.size();
            assert_eq!(r.coefficients().len(), width * height * r.stride());
            assert!(r.coefficients().iter().all(|v| v.is_finite()));
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
        .map(|c| {
            let mut out = Vec::new();
            ptm::write(&mut (&relightable(Basis::Ptm, c)).into(), Path::new(FILE), &mut out).unwrap();
            out
        })
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
    let mut luminance = b"PTM_1.2\nPTM_FORMAT_LUM\n5 3\n1 1 1 1 1 1\n0 0 0 0 0 0\n".to_vec();
    luminance.extend(0..120);
    seeds.push(luminance);
    assault("ptm", &seeds, |b| whole(ptm::read(b, Path::new(FILE), 1 << 12)));
}

#[test]
fn rti_pictures() {
    let r = relightable(Basis::Hsh { order: 2 }, Colouring::Rgb);
    let mut one = Vec::new();
    rti::write(&mut (&r).into(), Path::new(FILE), &mut one).unwrap();
    let mut floats = b"#HSH1.2\n3\n1 2 3\n4 2 4\n".to_vec();
    floats.extend((0..8 + 24).flat_map(|i| (i as f32).to_le_bytes()));
    assault("rti", &[one, floats], |b| whole(rti::read(b, Path::new(FILE), 1 << 12).map(Contents::Terms)));
}

#[test]
fn relightlab_infos() {
    let terms = br#"{"width": 4, "height": 2, "format": "jpg", "type": "ptm", "colorspace": "lrgb", "lights": [0, 0, 1],
"nplanes": 9, "quality": 95, "materials": [{"scale": [1,1,1,1,1,1,1,1.5,1], "bias": [0,0,0,0,0,0.25,0,0,0]}]}"#;
    let gaussian =
        br#"{"width": 4, "height": 2, "type": "rbf", "colorspace": "mrgb", "nplanes": 1, "lights": [0, 0, 1],
"sigma": 0.5, "basis": [1,2,3,4,5,6], "materials": [{"scale": [1], "bias": [0], "range": [9]}]}"#;
    let grid = br#"{"width": 4, "height": 2, "type": "bilinear", "colorspace": "mycc", "yccplanes": [1,1,1], "resolution": 2,
"materials": [{"scale": [1,1,1], "bias": [0,0,0], "range": [9,9,9]}]}"#;
    assault("relight", &[terms.to_vec(), gaussian.to_vec(), grid.to_vec()], |b| {
        match relight::read_info(b, Path::new(FILE), 1 << 12) {
            Ok(_) => true,
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
}

#[test]
fn what_stands_beside_tiles() {
    let seeds = [
        r#"<Image TileSize="32" Overlap="3" Format="png" xmlns="x"><Size Width="70" Height="37"/></Image>"#,
        r#"<IMAGE_PROPERTIES WIDTH="70" HEIGHT="37" NUMTILES="6" NUMIMAGES="1" VERSION="1.8" TILESIZE="32"/>"#,
        r#"{"tilesize": 32, "overlap": 1, "width": 70, "height": 37, "stride": 1, "offsets": [0, 3, 5, 7, 9, 11, 13]}"#,
        r#"{"width": 70, "height": 37, "tiles": [{"width": 32, "height": 32, "scaleFactors": [1, 2, 4]}]}"#,
    ];
    assault("tiles", &seeds.map(|s| s.as_bytes().to_vec()), |b| {
        match relight::tiles::read_index(b, Path::new(FILE), [70, 37], 13) {
            // Tiles of 16 pixels are the smallest.
            Ok(tiles) => {
                assert!(tiles <= 15);
                true
            }
            Err(e) => {
                assert!(e.to_string().contains(FILE), "{e}");
                false
            }
        }
    });
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
