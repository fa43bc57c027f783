//! Nothing that is read is written over: a table of attempts, over all verbs that write.

use crate::{bad, good, report, run, scratch, yugen_in};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use yugen_archive::formats::image::{self, WriteOptions};
use yugen_optics::Image;

/// Every file below a folder with a checksum of its bytes.
fn checksums(folder: &Path) -> BTreeMap<PathBuf, u64> {
    let mut all = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let mut hasher = DefaultHasher::new();
                std::fs::read(&path).unwrap().hash(&mut hasher);
                all.insert(path, hasher.finish());
            }
        }
    }
    all
}

/// What it complained; it must fail, and before the work: within a minute, where the work would take hours.
#[track_caller]
fn refused_at_once(folder: &Path, line: &str) -> String {
    let mut child = Command::new(env!("CARGO_BIN_EXE_yugen"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("{line}: still at work");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let out = child.wait_with_output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(!out.status.success(), "{line}: was not refused");
    said
}

/// A folder with something of everything that verbs read.
fn inputs() -> PathBuf {
    let folder = scratch("overwrite");
    let at = |name: &str| folder.join(name);
    let mut picture = Image::rgb(8, 4);
    picture.data.fill(0.5);
    for name in ["env.exr", "env.hdr", "tex.png", "figure/draft.png"] {
        std::fs::create_dir_all(at(name).parent().unwrap()).unwrap();
        image::write(&at(name), &picture, &WriteOptions::default()).unwrap();
    }
    for line in [
        "capture weave karaori --size 16x12 -o woven",
        "capture simulate karaori --size 16x12 --lights 12 -o stack",
        "capture simulate karaori --size 16x12 --lights 9 --seed 7 -o other",
        "capture simulate karaori --size 16x12 --lights 3 --exposures 2 --vignetting 0.2 -o night",
        "capture hdr night --flat night/flat.exr -o flats",
        "brdf convert lambert -p reflectance=0.3 table.gonio --step 30",
        "brdf convert lambert -p reflectance=0.2 merl/a.binary",
        "brdf convert phong merl/b.binary",
        "brdf pca build merl -o basis.pca --components 2",
    ] {
        if line.contains("merl/") {
            std::fs::create_dir_all(at("merl")).unwrap();
        }
        let run = yugen_in(&folder, line);
        assert!(run.success, "{line}: {}", run.err);
    }
    let readings: String = (1..20).map(|i| format!("0 0 1 0 0.{i:02} 1 0.1 0.1 0.1\n")).collect();
    std::fs::write(at("readings.csv"), readings).unwrap();
    std::fs::write(at("one.csv"), "file,seconds\n0001_1.png,1\n0001_2.png,0.125\n").unwrap();
    std::fs::write(at("gold.f32"), vec![0; 4 * 675]).unwrap();
    std::fs::write(at("gold.names.txt"), "gold\n").unwrap();
    std::fs::write(
        at("scene.toml"),
        "[[light]]\ntype = \"environment\"\nimage = \"env.exr\"\n\
         [material.woven]\nbtf = \"woven/cloth.btf\"\n\
         [material.painted]\nmodel = \"lambert\"\nreflectance = { image = \"tex.png\" }\n\
         [[shape]]\ntype = \"rectangle\"\nmaterial = \"woven\"\n\
         [[shape]]\ntype = \"sphere\"\nmaterial = \"painted\"\n",
    )
    .unwrap();
    for name in ["maps/diffuse.exr", "cloth.exr"] {
        std::fs::create_dir_all(at(name).parent().unwrap()).unwrap();
        std::fs::copy(at("woven/cloth.btf"), at(name)).unwrap();
    }
    // Other names of the same files.
    for (file, link) in [
        ("env.exr", "linked.exr"),
        ("env.exr", "other_name.exr.checkpoint"),
        ("stack/0001.exr", "linked.ptm"),
        ("stack/0001.exr", "half_done.btf.checkpoint"),
        ("stack/0002.exr", "report/normal.png"),
        ("stack/0003.exr", "scores/error_ptm.png"),
        ("stack/0004.exr", "relief/height.exr"),
        ("readings.csv", "fitted/report.md"),
        ("gold.f32", "decoded/gold.binary"),
        ("table.gonio", "linked.svg"),
        ("basis.pca", "linked.binary"),
    ] {
        std::fs::create_dir_all(at(link).parent().unwrap()).unwrap();
        std::fs::hard_link(at(file), at(link)).unwrap();
    }
    #[cfg(unix)]
    for (file, link) in [("env.exr", "symbolic.exr"), ("../stack", "links/stack")] {
        std::fs::create_dir_all(at(link).parent().unwrap()).unwrap();
        std::os::unix::fs::symlink(file, at(link)).unwrap();
    }
    folder
}

#[test]
fn what_is_read_is_never_written_over() {
    let folder = inputs();
    const READ: &str = "this is read, and would be lost; name another output";
    const THERE: &str = "say --force to replace it";
    let attempts = [
        ("render scene.toml --spp 9999999 -o env.exr", READ),
        ("render scene.toml --spp 9999999 -o tex.png", READ),
        ("render scene.toml --spp 9999999 -o woven/../env.exr", READ),
        ("render scene.toml --spp 9999999 -o linked.exr", READ),
        #[cfg(unix)]
        ("render scene.toml --spp 9999999 -o symbolic.exr", READ),
        ("render scene.toml --spp 9999999 -o other_name.exr", "none of this version"),
        ("render scene.toml --spp 9999999 -o other_name.exr --restart", READ),
        ("brdf fit readings.csv -o fitted", READ),
        ("brdf fit readings.csv readings.csv -o twice", "two outputs have this name"),
        ("brdf plot table.gonio -o linked.svg", READ),
        ("brdf convert table.gonio table.gonio", READ),
        ("brdf convert tabulated --data table.gonio table.gonio", READ),
        ("brdf decode gold.f32 -o decoded", READ),
        ("brdf pca build merl -o merl/a.binary", READ),
        ("brdf pca reconstruct -b basis.pca --values readings.csv -o linked.binary", READ),
        (
            "capture hdr night/0001_1.png night/0001_2.png --list one.csv -o flats/0001.exr \
          --flat flats/0001.exr",
            READ,
        ),
        (
            "capture hdr night/0001_1.png night/0001_2.png --list one.csv -o a.exr --save-response one.csv",
            READ,
        ),
        ("capture hdr night --flat flats -o flats --force", READ),
        ("capture hdr night -o flats", THERE),
        ("capture hdr night -o merged --save-response night/exposures.csv", READ),
        ("capture hdr night -o other --lights other/lights.lp --force", READ),
        ("capture calibrate stack -o stack/0001.exr --force --ball 8,6,4", READ),
        ("capture calibrate stack -o new.lp --preview stack/0002.exr --ball 8,6,4", READ),
        ("capture calibrate stack -o new.png --preview new.png --ball 8,6,4", "two outputs have this name"),
        ("capture calibrate stack --ball 8,6,4", THERE),
        ("capture simulate karaori -o other", THERE),
        ("capture simulate stack/truth.exr -o stack --force", READ),
        ("capture simulate woven/cloth.btf --heights stack/height.exr -o stack --force", READ),
        ("capture simulate karaori --lp stack/lights.lp -o stack --force", READ),
        ("capture weave woven/draft.wif -o woven", READ),
        ("capture weave plain --figure figure/draft.png -o figure", READ),
        ("capture fit stack -o stack/0001.exr", READ),
        #[cfg(unix)]
        ("capture fit stack -o links/stack/0012.exr", READ),
        ("capture fit stack -o fresh.btf --truth stack/truth.exr --report report", READ),
        ("capture fit stack -o cloth.exr --truth cloth.exr", READ),
        ("capture fit stack -o half_done.btf", READ),
        ("capture normals stack -o relief", READ),
        ("capture export maps/diffuse.exr -o maps --format exr", READ),
        ("capture relight cloth.exr --light 0,0,1 -o cloth.exr", READ),
        ("capture relight cloth.exr --environment env.hdr --cells 1024 -o env.hdr", READ),
        ("capture relight stack --light 0,0,1 -o stack/0004.exr", READ),
        ("capture relight stack --hold-out 2 --method ptm --report scores", READ),
        ("capture rti stack -o linked.ptm", READ),
        ("capture rti stack -o stack", "the photographs are here"),
    ];
    let before = checksums(&folder);
    assert!(before.len() > 60);
    for (line, problem) in attempts {
        let said = refused_at_once(&folder, line);
        assert!(said.contains(problem), "{line}: {said}");
        let after = checksums(&folder);
        let changed: Vec<_> = before.iter().filter(|(f, sum)| after.get(*f) != Some(sum)).collect();
        assert!(changed.is_empty(), "{line}: changed {changed:?}");
        let new: Vec<_> = after.keys().filter(|f| !before.contains_key(*f)).collect();
        assert!(new.is_empty(), "{line}: wrote {new:?}");
        println!("| yugen {line} | {} | {} files unchanged |", said.trim(), after.len());
    }
}

#[test]
fn an_earlier_output_is_replaced_where_that_is_wanted() {
    let folder = scratch("overwrite_again");
    let simulate = "capture simulate karaori --size 8x8 --lights 2 --json -o stack";
    report(yugen_in(&folder, simulate));
    let said = bad(yugen_in(&folder, simulate));
    assert!(said.contains("stack/truth.exr: this is there already"), "{said}");
    report(yugen_in(&folder, &format!("{simulate} --force")));
    std::fs::write(folder.join("a.toml"), "[[light]]\ntype = \"constant\"\n[[shape]]\ntype = \"sphere\"\n")
        .unwrap();
    for _ in 0..2 {
        good(yugen_in(&folder, "render a.toml --spp 1 --size 8x8 -o a.exr"));
    }
}

/// What `calibrate` changes in the options of a stack are the words that have changed.
#[test]
fn options_keep_their_comments() {
    let folder = scratch("overwrite_options");
    let balls = "capture simulate karaori --size 8x8 --lights 2 -o stack";
    good(yugen_in(&folder, balls));
    let options = folder.join("stack/stack.toml");
    std::fs::write(&options, "# By hand.\nsaturated = 0.9 # as the manual says\nlights = 'x.lp'").unwrap();
    // A mirror ball: black, with a highlight that says where the lamp stands.
    let mut picture = Image::rgb(64, 64);
    for (name, spot) in [("0001.exr", [30, 28]), ("0002.exr", [36, 33])] {
        picture.data.fill(0.0);
        for y in 0..64 {
            for x in 0..64 {
                let off = ((x as f32 - 31.5).powi(2) + (y as f32 - 31.5).powi(2)).sqrt();
                let light = if [x, y] == spot {
                    50.0
                } else if off < 20.0 {
                    0.01
                } else {
                    0.4
                };
                picture.pixel_mut(x, y).fill(light);
            }
        }
        image::write(&folder.join("stack").join(name), &picture, &WriteOptions::default()).unwrap();
    }
    for name in ["truth.exr", "height.exr"] {
        std::fs::remove_file(folder.join("stack").join(name)).unwrap();
    }
    let line = "capture calibrate stack --ball 31.5,31.5,20 --dome 3 --tolerance 4 --force --json";
    let run =
        run(Command::new(env!("CARGO_BIN_EXE_yugen")).args(line.split_whitespace()).current_dir(&folder));
    assert!(run.success, "{}", run.err);
    let text = std::fs::read_to_string(&options).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines,
        ["# By hand.", "saturated = 0.9 # as the manual says", "lights = \"lights.lp\"", "near = true"]
    );
}
