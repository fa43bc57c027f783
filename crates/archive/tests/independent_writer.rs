//! Measured reflectance of a writer that shares nothing with Yugen, `writer/instruments.py`: BRDFs known in closed form, in
//! every format, and what the readers make of them judged by the same script.
#![allow(clippy::disallowed_methods)]

use glam::Vec3;
use std::path::{Path, PathBuf};
use std::process::Command;
use yugen_archive::formats::instrument::{self, Measurement, Reading};
use yugen_optics::ColourSpace;

/// A Python with NumPy, if there is one: YUGEN_PYTHON, python3, or that of the system.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("YUGEN_PYTHON").map(PathBuf::from);
    let found = named.into_iter().chain(["python3".into(), "/usr/bin/python3".into()]).find(|python| {
        Command::new(python).args(["-c", "import numpy"]).output().is_ok_and(|o| o.status.success())
    });
    if found.is_none() {
        assert!(std::env::var_os("CI").is_none(), "no Python with numpy; name one in YUGEN_PYTHON");
        println!("skipped: no Python with numpy; name one in YUGEN_PYTHON");
    }
    found
}

fn script(python: &Path, verb: &str, folder: &Path) -> String {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/writer/instruments.py");
    let run = Command::new(python).arg(script).arg(verb).arg(folder).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

/// What the script says of readings, by kind.
fn judged<'a>(
    python: &Path,
    folder: &Path,
    readings: impl Iterator<Item = (&'a str, Vec<Reading>)>,
) -> serde_json::Value {
    for (kind, readings) in readings {
        let numbers = readings.iter().flat_map(|r| [r.wi, r.wo, r.f].map(|v| v.to_array()).concat());
        let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        std::fs::write(folder.join(kind).with_extension("f32"), bytes).unwrap();
    }
    serde_json::from_str(&script(python, "check", folder)).unwrap()
}

/// Kind, format, and whether it is isotropic.
const KINDS: &[(&str, &str, bool)] = &[
    ("klems-full", "LBNL WINDOW XML", false),
    ("klems-half", "LBNL WINDOW XML", false),
    ("klems-quarter", "LBNL WINDOW XML", false),
    ("klems-back", "LBNL WINDOW XML", false),
    ("klems-own", "LBNL WINDOW XML", false),
    ("tree3", "LBNL WINDOW XML", true),
    ("tree4", "LBNL WINDOW XML", false),
    ("tree4-back", "LBNL WINDOW XML", false),
    ("zemax", "Zemax or ASAP BSDF", true),
    ("zemax-grain", "Zemax or ASAP BSDF", false),
    ("astm-degrees", "ASTM E1392 or E2387", false),
    ("astm-grey", "ASTM E1392 or E2387", false),
    ("astm-spectrum", "ASTM E1392 or E2387", false),
    ("alta-CARTESIAN", "ALTA", false),
    ("alta-SPHERICAL_TL_PL_TV_PV", "ALTA", false),
    ("alta-RUSIN_TH_PH_TD_PD", "ALTA", false),
    ("alta-RUSIN_TH_PH_TD", "ALTA", false),
    ("alta-RUSIN_TH_TD_PD", "ALTA", true),
    ("alta-RUSIN_TH_TD", "ALTA", true),
    ("alta-COS_TH_TD", "ALTA", true),
    ("alta-COS_TH", "ALTA", true),
    ("alta-ISOTROPIC_TV_TL_DPHI", "ALTA", true),
    ("alta-ISOTROPIC_TL_TV_PROJ_DPHI", "ALTA", true),
    ("alta-ISOTROPIC_TV_PROJ_DPHI", "ALTA", true),
    ("utia", "UTIA BRDF", false),
];
/// Light and eye stand equally high in these, and cannot be told apart.
const LEVEL: [&str; 2] = ["alta-RUSIN_TH_TD", "alta-COS_TH"];
/// Four times the worst, which is 3.3e-6 in a highlight of the grained one: angles are in single precision.
const MOST: f64 = 1.4e-5;

#[test]
fn what_another_writer_writes_is_read_as_it_means_it() {
    let Some(python) = python() else { return };
    let folder = std::env::temp_dir().join(format!("yugen-instruments-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    script(&python, "write", &folder);
    let load = |kind: &str| -> Measurement {
        instrument::load(&folder.join(kind).with_extension("dat"), ColourSpace::LinearSrgb).unwrap()
    };
    let all: Vec<Measurement> = KINDS.iter().map(|k| load(k.0)).collect();
    let readings = KINDS.iter().zip(&all).map(|(k, m)| (k.0, m.readings.clone()));
    let said = judged(&python, &folder, readings);
    let mut wrong = Vec::new();
    for ((kind, format, isotropic), m) in KINDS.iter().zip(&all) {
        let is = &said[kind];
        println!("{kind}: {is}");
        let number = |key: &str| is[key].as_f64().unwrap();
        let as_meant = m.format == *format
            && m.isotropic == *isotropic
            && is["readings"] == is["expected"]
            && number("worst") < MOST;
        // Had one been taken for the other, it would show.
        let told =
            (LEVEL.contains(kind) || number("swapped") > 0.05) && (*isotropic || number("mirrored") > 0.05);
        if !(as_meant && told) {
            wrong.push(format!("{kind}: {}, isotropic {}, {is}", m.format, m.isotropic));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // A reader that takes light for eye, or sees the sample from its other end, is found out.
    let swap = |r: &Reading| Reading { wi: r.wo, wo: r.wi, ..*r };
    let about = |w: Vec3| Vec3::new(-w.x, -w.y, w.z);
    let turn = |r: &Reading| Reading { wi: about(r.wi), wo: about(r.wo), ..*r };
    let some = ["klems-quarter", "zemax-grain", "astm-grey", "alta-CARTESIAN", "utia"];
    let chosen = KINDS.iter().zip(&all).filter(|(k, _)| some.contains(&k.0));
    let beside = folder.join("spoiled");
    std::fs::create_dir(&beside).unwrap();
    for spoil in [&swap as &dyn Fn(&Reading) -> Reading, &turn] {
        let spoiled = chosen.clone().map(|(k, m)| (k.0, m.readings.iter().map(spoil).collect()));
        let said = judged(&python, &beside, spoiled);
        for kind in some {
            assert!(said[kind]["worst"].as_f64().unwrap() > 0.05, "{kind}: {}", said[kind]);
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
