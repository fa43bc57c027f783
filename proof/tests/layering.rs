//! Arrows between rooms point down only, and the plan of the house on the wall is the house.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Each room and the rooms it may see. A room that is not here yet must be added, with thought.
const ROOMS: &[(&str, &[&str])] = &[
    ("optics", &[]),
    ("reflectance", &["optics"]),
    ("motion", &["optics"]),
    ("scene", &["optics", "reflectance", "motion"]),
    ("archive", &["optics", "reflectance", "motion", "scene"]),
    ("capture", &["optics", "reflectance", "motion", "scene", "archive"]),
    ("transport", &["optics", "reflectance", "motion", "scene"]),
    ("realtime", &["optics", "reflectance", "motion", "scene"]),
    ("noh", &["optics", "reflectance", "motion", "scene"]),
    ("ink", &["optics", "reflectance", "motion", "scene", "transport", "realtime"]),
    ("exhibit", &["optics", "reflectance", "motion", "scene", "transport", "realtime", "ink"]),
    ("view", &["optics", "reflectance", "motion", "scene", "transport", "realtime", "ink"]),
    ("proof", &["optics", "reflectance"]),
    (
        "cli",
        &[
            "optics",
            "reflectance",
            "motion",
            "scene",
            "archive",
            "capture",
            "noh",
            "transport",
            "realtime",
            "ink",
            "exhibit",
            "view",
            "proof",
        ],
    ),
    ("xtask", &[]),
    (
        "examples",
        &[
            "optics",
            "reflectance",
            "motion",
            "scene",
            "archive",
            "capture",
            "noh",
            "transport",
            "realtime",
            "ink",
            "proof",
        ],
    ),
];

/// Who may know the GPU; `proof` only behind its feature.
const GPU: &[&str] = &["realtime", "ink", "view", "proof"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("proof lies in the workspace").to_path_buf()
}

/// An arrow of the dependency graph.
#[derive(Clone, Debug)]
struct Arrow {
    from: String,
    to: String,
    dev: bool,
    optional: bool,
}

/// Folder of each package, and all arrows to other packages, ours and others'.
fn workspace() -> (BTreeMap<String, PathBuf>, Vec<Arrow>) {
    let out = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let meta: Value = serde_json::from_slice(&out.stdout).expect("cargo metadata is JSON");
    let room = |name: &Value| {
        let name = name.as_str().expect("a package has a name");
        name.strip_prefix("yugen-").unwrap_or(name).to_string()
    };
    let (mut folders, mut arrows) = (BTreeMap::new(), Vec::new());
    for package in meta["packages"].as_array().expect("a list of packages") {
        let from = room(&package["name"]);
        let manifest = PathBuf::from(package["manifest_path"].as_str().expect("a path"));
        folders.insert(from.clone(), manifest.parent().expect("a folder").to_path_buf());
        for d in package["dependencies"].as_array().expect("a list of dependencies") {
            arrows.push(Arrow {
                from: from.clone(),
                to: room(&d["name"]),
                dev: d["kind"] == "dev",
                optional: d["optional"] == true,
            });
        }
    }
    (folders, arrows)
}

/// What is wrong with the arrows.
fn faults(rooms: &BTreeMap<String, PathBuf>, arrows: &[Arrow]) -> Vec<String> {
    let allowed: BTreeMap<&str, &[&str]> = ROOMS.iter().copied().collect();
    let mut faults = Vec::new();
    for room in rooms.keys().filter(|r| !allowed.contains_key(r.as_str())) {
        faults.push(format!("the room {room} has no place in the house: say in layering.rs what it may see"));
    }
    for a in arrows {
        let down = allowed.get(a.from.as_str()).is_some_and(|may| may.contains(&a.to.as_str()));
        // Tests of any room may be proven; tests of proof may look at all, those of a renderer at files of scenes and the
        // Noh stage.
        let renderer = ["transport", "realtime", "ink"].contains(&a.from.as_str());
        let test = a.dev
            && (a.to == "proof"
                || a.from == "proof"
                || a.from == a.to
                || renderer && ["archive", "noh"].contains(&a.to.as_str()));
        if rooms.contains_key(&a.to) && !down && !test {
            faults.push(format!("{} may not see {}", a.from, a.to));
        }
        let gpu = ["wgpu", "naga", "wgpu-core", "wgpu-hal"].contains(&a.to.as_str());
        if gpu && !GPU.contains(&a.from.as_str()) {
            faults.push(format!("{} may not know {}", a.from, a.to));
        }
        if gpu && a.from == "proof" && !a.optional {
            faults.push(format!("proof knows {} only behind its feature gpu", a.to));
        }
    }
    faults
}

#[test]
fn arrows_point_down() {
    let (rooms, arrows) = workspace();
    for room in ["optics", "reflectance", "scene", "archive", "transport", "cli", "proof"] {
        assert!(rooms.contains_key(room), "the room {room} was not found");
    }
    assert!(arrows.iter().any(|a| a.from == "reflectance" && a.to == "optics"), "no arrows were found");
    assert_eq!(faults(&rooms, &arrows), Vec::<String>::new());
}

#[test]
fn an_arrow_upwards_is_caught() {
    let (rooms, arrows) = workspace();
    let caught = |from: &str, to: &str, dev, optional| {
        let mut arrows = arrows.clone();
        arrows.push(Arrow { from: from.into(), to: to.into(), dev, optional });
        !faults(&rooms, &arrows).is_empty()
    };
    assert!(caught("optics", "reflectance", false, false));
    assert!(caught("reflectance", "archive", true, false));
    assert!(caught("transport", "wgpu", false, true));
    assert!(caught("proof", "wgpu", false, false));
    assert!(caught("proof", "archive", false, false));
    assert!(caught("transport", "archive", false, false));
    assert!(!caught("transport", "archive", true, false));
    assert!(!caught("proof", "archive", true, false));
    assert!(!caught("reflectance", "proof", true, false));
    let mut more = rooms.clone();
    more.insert("utils".into(), PathBuf::new());
    assert!(!faults(&more, &arrows).is_empty());
}

/// Rooms whose folder the text does not name.
fn unnamed(text: &str, rooms: &BTreeMap<String, PathBuf>) -> Vec<String> {
    let named = |path: &Path| {
        // As a path from the root (`proof/`, `crates/optics/`) or, in a tree of folders, by its last part.
        let folder = path.file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
        text.split(|c: char| !(c.is_alphanumeric() || c == '/' || c == '_' || c == '-'))
            .any(|word| word.trim_end_matches('/').rsplit('/').next() == Some(&folder))
    };
    rooms.iter().filter(|(_, path)| !named(path)).map(|(room, _)| room.clone()).collect()
}

#[test]
fn the_plan_names_every_room() {
    let (rooms, _) = workspace();
    let missing = unnamed("crates/optics/ and `archive/`", &rooms);
    assert!(missing.contains(&"reflectance".to_string()) && !missing.contains(&"archive".to_string()));
    match std::fs::read_to_string(root().join("ARCHITECTURE.md")) {
        Ok(text) => assert_eq!(unnamed(&text, &rooms), Vec::<String>::new(), "missing in ARCHITECTURE.md"),
        Err(e) => println!("skipped: there is no ARCHITECTURE.md ({e})"),
    }
}
