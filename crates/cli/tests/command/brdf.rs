//! `yugen brdf` from outside, as a person or a script meets it.

use crate::{Run, yugen_in};
use serde_json::json;
use std::path::{Path, PathBuf};

fn yugen(args: &[&str]) -> Run {
    crate::yugen(&["brdf"], args)
}

pub fn good(args: &[&str]) -> String {
    crate::good(yugen(args))
}

pub fn bad(args: &[&str]) -> String {
    crate::bad(yugen(args))
}

fn models() -> Vec<String> {
    let all: serde_json::Value = serde_json::from_str(&good(&["list", "--json"])).unwrap();
    all.as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap().to_string()).collect()
}

/// A path of this test run, in a folder that goes with the build.
pub fn scratch(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("brdf");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

#[test]
fn list_names_every_model_and_show_knows_each() {
    let names = models();
    assert!(names.len() > 20);
    let lines = good(&["list"]);
    assert_eq!(lines.lines().count(), names.len());
    for (line, name) in lines.lines().zip(&names) {
        assert!(line.split_whitespace().next() == Some(name), "{line}");
        let shown = good(&["show", name]);
        assert!(shown.starts_with(name.as_str()) && shown.contains("Promises"), "{shown}");
        let shown: serde_json::Value = serde_json::from_str(&good(&["show", name, "--json"])).unwrap();
        assert_eq!(shown["name"], name.as_str());
        assert!(shown["params"].as_array().unwrap().iter().all(|p| !p["doc"].as_str().unwrap().is_empty()));
    }
}

#[test]
fn eval_prints_three_numbers_a_pair() {
    let pair = ["--wi", "0,0,1", "--wo", "0.6,0,0.8"];
    let out = good(&[["eval", "lambert", "-p", "reflectance=0.2,0.4,0.6"].as_slice(), &pair].concat());
    let f: Vec<f32> = out.split_whitespace().map(|v| v.parse().unwrap()).collect();
    assert_eq!(f.len(), 3);
    for (f, rho) in f.iter().zip([0.2, 0.4, 0.6]) {
        assert!((f * std::f32::consts::PI - rho).abs() < 1e-6, "{out}");
    }

    let out = good(&[["eval", "lambert", "--json"].as_slice(), &pair].concat());
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(json["values"][0]["f"].as_array().unwrap().len(), 3);
    let pdf = json["values"][0]["pdf"].as_f64().unwrap();
    assert!((pdf - std::f64::consts::FRAC_1_PI).abs() < 1e-6, "{pdf}");

    let file = scratch("pairs.txt");
    let pairs = ["eval", "lambert", "--pairs", file.to_str().unwrap()];
    std::fs::write(&file, "# wi then wo\n0 0 1  0 0 1\n\n0.6,0,0.8, 0,0,2 # any length\n").unwrap();
    assert_eq!(good(&pairs).lines().count(), 2);
    std::fs::write(&file, "0 0 1 0 0 1\n0 0 1 0 0\n").unwrap();
    let said = bad(&pairs);
    assert!(said.contains("pairs.txt:2:1: has 5 numbers") && said.contains("(six)"), "{said}");
}

#[test]
fn mistakes_are_answered_with_what_would_do() {
    let pair = ["--wi", "0,0,1", "--wo", "0,0,1"];
    let eval = |args: &[&str]| bad(&[&["eval"], args, &pair].concat());
    assert!(bad(&["show", "lamberd"]).contains("did you mean 'lambert'?"));
    assert!(eval(&["blin_phong"]).contains("did you mean 'blinn_phong'?"));
    let range = eval(&["lambert", "-p", "reflectance=1.5"]);
    assert!(range.contains("reflectance is 1.5; expected 0 to 1"), "{range}");
    assert!(eval(&["lambert", "-p", "reflectanse=0.5"]).contains("reflectance"));
    assert!(eval(&["lambert", "-p", "reflectance"]).contains("expected name=value"));
    assert!(eval(&["lambert", "-p", "reflectance=NaN"]).contains("expected r,g,b or one number"));
    assert!(eval(&["microcylinder", "--preset", "linnen"]).contains("linen_plain"));
    assert!(eval(&["ggx", "--preset", "gold"]).contains("no preset 'gold' (it has none)"));
    assert!(eval(&["microcylinder", "--form", "papier"]).contains("paper"));
    assert!(eval(&["merl"]).contains("give --data FILE, or --preset with one of red_plastic"));
    assert!(eval(&["merl", "--data", "/nowhere/gold.binary"]).contains("/nowhere/gold.binary"));
    assert!(bad(&["eval", "lambert", "--wi", "0,0,0", "--wo", "0,0,1"]).contains("three numbers"));
}

#[test]
fn check_proves_a_model_and_says_so() {
    let Run { success, out, .. } = yugen(&["check", "--quick", "lambert"]);
    assert!(success && out.contains("1 passed, 0 failed, 0 skipped"), "{out}");
    let json: serde_json::Value =
        serde_json::from_str(&good(&["check", "--quick", "lambert", "--json"])).unwrap();
    assert_eq!(json[0]["model"], "lambert");
    assert_eq!(json[0]["passed"], true);
    assert!(json[0]["laws"].as_array().unwrap().len() > 5);
}

/// Draws the small sphere of a model's section.
fn draw_sphere(model: &str, file: &Path) {
    let all: serde_json::Value = serde_json::from_str(&good(&["show", model, "--json"])).unwrap();
    let mut args = vec!["plot", model, "--kind", "sphere", "--size", SPHERE, "-o", file.to_str().unwrap()];
    if all["data"] == "required" {
        args.extend(["--preset", all["presets"][0]["name"].as_str().unwrap()]);
    }
    good(&args);
}

const SPHERE: &str = "96";

/// The page of the models is what the models say of themselves; `BLESS=1` writes it anew, with its spheres.
#[test]
fn the_page_of_models_is_up_to_date() {
    let page = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/models.md");
    let told = good(&["list", "--markdown"]);
    for name in models() {
        assert!(told.contains(&format!("\n## {name}\n")), "{name} has no section");
    }
    let spheres = page.with_file_name("models");
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&page, &told).unwrap();
        std::fs::create_dir_all(&spheres).unwrap();
        models().iter().for_each(|m| draw_sphere(m, &spheres.join(format!("{m}.png"))));
    }
    let written = std::fs::read_to_string(&page).unwrap_or_default();
    let how = "run `BLESS=1 cargo test --release -p yugen-cli` to write it anew";
    if let Some((i, (a, b))) = told.lines().zip(written.lines()).enumerate().find(|(_, (a, b))| a != b) {
        panic!("docs/models.md:{}: '{b}' should be '{a}'; {how}", i + 1);
    }
    for name in models() {
        let file = spheres.join(format!("{name}.png"));
        assert!(file.exists(), "{} is missing; {how}", file.display());
        assert_eq!(png_size(&file), (96, 96));
    }
    assert!(told == written, "docs/models.md has too few or too many lines; {how}");
}

/// Width and height of a PNG, from its header.
pub fn png_size(file: &Path) -> (u32, u32) {
    let bytes = std::fs::read(file).unwrap();
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
    assert_eq!(bytes[12..16], *b"IHDR");
    let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (word(16), word(20))
}

/// The differences that `convert` found.
fn converted(args: &[&str]) -> (f64, f64) {
    let json: serde_json::Value =
        serde_json::from_str(&good(&[&["convert", "--json"], args].concat())).unwrap();
    (json["mean"].as_f64().unwrap(), json["largest"].as_f64().unwrap())
}

#[test]
fn convert_writes_tables_that_are_near_their_source() {
    let (merl, gonio) = (scratch("converted.binary"), scratch("converted.gonio"));
    let (merl, gonio) = (merl.to_str().unwrap(), gonio.to_str().unwrap());
    // Lambert is constant: only the rounding of colours between spaces is left.
    let (_, largest) = converted(&["lambert", merl]);
    assert!(largest < 1e-5, "{largest}");
    // Black is like black.
    assert_eq!(converted(&["lambert", "-p", "reflectance=0", gonio, "--step", "30"]), (0.0, 0.0));
    // From a measured file to the other format.
    let (mean, largest) = converted(&[merl, gonio, "--step", "15"]);
    assert!(mean < 1e-5 && largest < 1e-5, "{mean} {largest}");
    good(&["eval", gonio, "--wi", "0,0,1", "--wo", "0,0,1"]);

    // On GGX the warps of a .bsdf fit: measured 0.06 %. On a brushed Ward lobe 2.8 %, most of it in the tails that
    // Ward's Gaussian lacks and GGX has.
    let bsdf = scratch("converted.bsdf");
    let bsdf = bsdf.to_str().unwrap();
    for (model, most) in [("ggx", 0.0025), ("ward", 0.11)] {
        let (mean, _) = converted(&[model, bsdf, "--space", "srgb"]);
        assert!(mean > 0.0 && mean < most, "{model}: {mean}");
        good(&["eval", bsdf, "--wi", "0,0.6,0.8", "--wo", "0,0,1"]);
    }

    assert!(bad(&["convert", "lambert", "a.binari"]).contains("binary"));
    assert!(bad(&["convert", "lambert", "a.csv"]).contains("a .csv is only read"));
    assert!(bad(&["convert", merl, merl]).contains("would be lost"));
    assert!(bad(&["convert", "lambert", "gone/a.gonio"]).contains("there is no folder 'gone'"));
    assert!(bad(&["convert", "conductor", merl]).contains("single directions"));
    assert!(bad(&["convert", "microcylinder", merl]).contains("write a .gonio or a .bsdf"));
    assert!(bad(&["convert", "lambert", gonio, "--step", "0"]).contains("1 to 30 degrees"));
}

/// Readings of a model as lines of text, a few of them below the horizon.
fn readings(name: &str, model: &[&str]) -> PathBuf {
    let pairs = scratch(&format!("{name}_pairs.csv"));
    let mut text = String::from("wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n");
    for i in 0..200 {
        let x = |k: f64| (0.5 + k * f64::from(i)).fract();
        let w = |a: f64, b: f64| {
            let (theta, phi) = (1.3 * x(a), std::f64::consts::TAU * x(b));
            format!("{},{},{}", theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        };
        text += &format!("{},{}\n", w(0.856_674_9, 0.733_891_8), w(0.628_706_7, 0.538_597_7));
    }
    std::fs::write(&pairs, &text).unwrap();
    let file = scratch(&format!("{name}.csv"));
    let arguments = [&["eval"], model, &["--pairs", pairs.to_str().unwrap(), "--space", "srgb"]].concat();
    let values = good(&arguments);
    let lines: Vec<String> =
        text.lines().skip(1).zip(values.lines()).map(|(pair, f)| format!("{pair} {f}\n")).collect();
    std::fs::write(&file, lines.concat() + "0 0 -1 0 0 1 1 1 1\n").unwrap();
    file
}

#[test]
fn fit_finds_a_brushed_material_again_and_writes_a_scene_that_renders() {
    let file = readings(
        "brushed",
        &["ward", "-p", "alpha_x=0.1", "-p", "alpha_y=0.35", "-p", "diffuse=0.2,0.1,0.05"],
    );
    let out = scratch("fit_report");
    let arguments =
        ["fit", file.to_str().unwrap(), "-m", "ward", "-m", "lambert", "--space", "srgb", "--json"];
    let more = ["-o", out.to_str().unwrap(), "--spheres", "1", "--starts", "4"];
    let report: serde_json::Value = serde_json::from_str(&good(&[&arguments[..], &more].concat())).unwrap();
    assert_eq!((&report["readings"], &report["isotropic"]), (&200.into(), &false.into()));
    let best = &report["fits"][0];
    let p = &best["lobes"][0]["parameters"];
    assert_eq!((best["model"].as_str(), p["form"].as_str()), (Some("ward"), Some("gmd")));
    for (name, want) in [("alpha_x", 0.1), ("alpha_y", 0.35)] {
        assert!((p[name].as_f64().unwrap() / want - 1.0).abs() < 2e-3, "{p}");
    }
    // Values are printed with all their digits: nothing but the search is between them and the fit.
    assert!(best["cube_root"].as_f64().unwrap() < 0.02 && report["fits"][1]["model"] == "lambert");
    assert!(std::fs::read(out.join("spheres.png")).unwrap().starts_with(b"\x89PNG"));
    let scene = std::fs::read_to_string(out.join("ward.toml")).unwrap()
        + "[[shape]]\ntype = \"sphere\"\nmaterial = \"brushed\"\n";
    let path = out.join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    let scene = yugen_archive::formats::load_scene(&path, &Default::default()).unwrap();
    assert_eq!(scene.shapes.len(), 1);
}

#[test]
fn fit_says_what_is_wrong_with_its_data() {
    let file = scratch("directions.csv");
    std::fs::write(&file, "0 0 1 0 0 1\n".repeat(9)).unwrap();
    let path = file.to_str().unwrap();
    assert!(bad(&["fit", path]).contains("directions only; expected wi, wo, r, g, b"));
    std::fs::write(&file, "0 0 1 0 0 1 1 1 1\n").unwrap();
    assert!(
        bad(&["fit", path])
            .contains("1 of 1 readings lie within 80 degrees of the normal; expected at least 8")
    );
    assert!(bad(&["fit", path, "-m", "glas"]).contains("no reflectance model"));
    assert!(bad(&["fit", path, "-m", "conductor"]).contains("single directions only"));
    assert!(bad(&["fit", "a.jpeg"]).contains("or .csv of single readings"));
    assert!(bad(&["fit", path, "--max-angle", "3"]).contains("expected 10 to 90"));
}

/// A Lambertian surface of albedo one half in every format of instruments, and what else is made of them.
#[test]
fn instruments_are_read_by_every_verb() {
    use std::fmt::Write;
    let folder = scratch("instruments");
    std::fs::create_dir_all(&folder).unwrap();
    let f = 0.5 / std::f64::consts::PI;
    let write = |name: &str, text: String| std::fs::write(folder.join(name), text).unwrap();
    write(
        "a.xml",
        format!(
            "<?xml version=\"1.0\"?><WindowElement><Optical><Layer><DataDefinition><IncidentDataStructure>TensorTree3\
             </IncidentDataStructure></DataDefinition><WavelengthData><Wavelength>Visible</Wavelength><WavelengthDataBlock>\
             <WavelengthDataDirection>Reflection Back</WavelengthDataDirection><AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\
             <ScatteringData>{{{f}}}</ScatteringData></WavelengthDataBlock><WavelengthDataBlock><WavelengthDataDirection>\
             Transmission Back</WavelengthDataDirection></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>"
        ),
    );
    let row = format!("{f} {f} {f}\n");
    write(
        "a.bsdf",
        format!(
            "Symmetry PlaneSymmetrical\nScatterType BRDF\nSampleRotation 1\n0\nAngleOfIncidence 2\n0 40\nScatterAzimuth 3\n0 90 180\n\
             ScatterRadial 3\n0 20 60\n\nMonochrome\nDataBegin\nTIS .5\n{0}TIS .5\n{0}DataEnd\n",
            row.repeat(3)
        ),
    );
    let (mut astm, mut alta) = (
        String::from("VARS theta_i,phi_i,theta_s,phi_s,400nm,550nm,700nm\n"),
        String::from("#DIM 4 1\n#PARAM_IN SPHERICAL_TL_PL_TV_PV\n#PARAM_OUT INV_STERADIAN\n"),
    );
    for (i, s, p) in (0..4).flat_map(|i| (0..4).flat_map(move |s| (0..7).map(move |p| (i, s, p)))) {
        let [i, s, p] = [0.4 * f64::from(i), 0.4 * f64::from(s), std::f64::consts::PI * f64::from(p) / 6.0];
        writeln!(astm, "{i},0,{s},{p},{f},{f},{f}").unwrap();
        writeln!(alta, "{i} 0 {s} {p} {f}").unwrap();
    }
    write("a.astm", astm);
    write("a.brdf", alta);
    std::fs::write(folder.join("a.bin"), f.to_le_bytes().repeat(3 * 288 * 288)).unwrap();
    for (file, format) in [
        ("a.xml", "LBNL WINDOW XML"),
        ("a.bsdf", "Zemax or ASAP BSDF"),
        ("a.astm", "ASTM E1392 or E2387"),
        ("a.brdf", "ALTA"),
        ("a.bin", "UTIA BRDF"),
    ] {
        let path = folder.join(file);
        let path = path.to_str().unwrap();
        let run = yugen_in(&folder, &format!("info {file} --json"));
        assert!(run.success, "{}", run.err);
        let told: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        assert_eq!((&told["format"], &told["isotropic"]), (&json!(format), &json!(true)), "{told}");
        if file == "a.xml" {
            assert_eq!(told["not_read"], json!(["Transmission Back, Visible"]));
        }
        let run = yugen_in(&folder, &format!("brdf fit {file} -m lambert --space srgb --json"));
        assert!(run.success, "{}", run.err);
        let told: serde_json::Value = serde_json::from_str(&run.out).unwrap();
        let albedo = told["fits"][0]["lobes"][0]["parameters"]["reflectance"][1].as_f64().unwrap();
        assert!((albedo - 0.5).abs() < 1e-4, "{file}: {albedo}");
        let run = yugen_in(&folder, &format!("brdf convert {file} {file}.gonio --step 30 --space srgb"));
        assert!(run.success, "{}", run.err);
        let text = std::fs::read_to_string(format!("{path}.gonio")).unwrap();
        let values = text.split_once("values").unwrap().1;
        let mut values =
            values.lines().skip(1).flat_map(str::split_whitespace).map(|v| v.parse::<f64>().unwrap());
        assert!(values.all(|v| (v - f).abs() < 1e-5), "{file}: {text}");
    }
    // A file of that name that is RGL's is so still.
    let run = yugen_in(&folder, "brdf convert lambert a.bsdf --step 30");
    assert!(run.success, "{}", run.err);
    assert!(yugen_in(&folder, "info a.bsdf").out.contains("format: RGL"));
    // What no reader of instruments knows is no instrument's.
    write("b.brdf", "OPTIS - brdf surface file v3.0\n".into());
    let run = yugen_in(&folder, "brdf fit b.brdf");
    assert!(!run.success && run.err.contains("this is no measurement of a known format"), "{}", run.err);
    let run = yugen_in(&folder, "brdf convert lambert b.xml");
    assert!(!run.success && run.err.contains("b.xml: a .xml is only read; write a"), "{}", run.err);
}
