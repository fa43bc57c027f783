//! `yugen` from outside, as a person or a script meets it.
#![allow(clippy::disallowed_methods)]

mod brdf;
mod brdf_pca;
mod brdf_plot;
mod calibrate;
mod capture_fit;
mod capture_relight;
mod cloth;
mod formats;
mod hdr;
mod info;
mod ink;
mod lecture;
mod messages;
mod motion;
mod noh;
mod normals;
mod overwrite;
mod render;
mod render_interrupt;
mod render_realtime;
mod sequence;
mod simulate;
#[cfg(feature = "view")]
mod view;

use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How a call ended.
struct Run {
    success: bool,
    out: String,
    err: String,
}

fn yugen(verbs: &[&str], args: &[impl AsRef<OsStr>]) -> Run {
    run(Command::new(env!("CARGO_BIN_EXE_yugen")).args(verbs).args(args))
}

/// The words of a line, typed in a folder.
fn yugen_in(folder: &Path, line: &str) -> Run {
    run(Command::new(env!("CARGO_BIN_EXE_yugen")).args(line.split_whitespace()).current_dir(folder))
}

fn run(command: &mut Command) -> Run {
    // Without a folder for it the driver of the display complains, which is not what the program says.
    let out = command.env("XDG_RUNTIME_DIR", std::env::temp_dir()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Run { success: out.status.success(), out: text(out.stdout), err: text(out.stderr) }
}

/// What it printed; it must succeed and complain of nothing.
#[track_caller]
fn good(run: Run) -> String {
    assert!(run.success && run.err.is_empty(), "{}", run.err);
    run.out
}

/// Its report, if it was asked for one.
#[track_caller]
fn report(run: Run) -> Value {
    serde_json::from_str(&good(run)).unwrap_or(Value::Null)
}

/// What it complained; it must fail and print nothing.
#[track_caller]
fn bad(run: Run) -> String {
    assert!(!run.success && run.out.is_empty(), "{}", run.out);
    run.err
}

/// It must fail and say all these words.
#[track_caller]
fn refused(run: Run, words: &[&str]) {
    let said = bad(run);
    assert!(words.iter().all(|w| said.contains(w)), "{said}");
}

/// Starts it, and kills it once its checkpoint is longer than so many bytes.
#[track_caller]
fn killed_midway(verbs: &[&str], args: &[impl AsRef<OsStr>], checkpoint: &Path, bytes: u64) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_yugen"))
        .args(verbs)
        .args(args)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let length = || std::fs::metadata(checkpoint).map_or(0, |m| m.len());
    let started = Instant::now();
    while length() <= bytes && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    // SIGKILL on Unix: no chance to tidy up.
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(length() > bytes, "no checkpoint was written");
}

/// An empty folder of this run of the tests, beside what was built.
fn scratch(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn help_teaches() {
    for (line, taught) in [
        ("", "yugen capture fit STACK -o cloth.btf"),
        ("", "Keeps how a performance looks"),
        ("render", "yugen render scene.toml -o picture.exr"),
        #[cfg(feature = "view")]
        ("view", "light 2 off; reference; wait 64; save shot.png; quit"),
        ("info", "cameras, lights, materials, textures"),
        ("brdf", "ranks the models"),
        ("brdf fit", "Levenberg-Marquardt"),
        ("brdf plot", "Rusinkiewicz slices"),
        ("capture", "Finds where the lights stood"),
        ("capture hdr", "columns file, seconds, light"),
        ("capture calibrate", "with --ball x,y,radius"),
        ("capture simulate", "Without any option about the sensor"),
        ("capture weave", "cloth.btf with all maps"),
        ("capture fit", "Threads repeat"),
        ("capture normals", "as OpenGL has them"),
        ("capture export", "EXR keeps every number"),
        ("capture relight", "whose centre lies where the camera is"),
        ("capture rti", "hemispherical harmonics"),
        ("noh stage", "--set side=5.7"),
        ("simulate", "(u, v) of the cloth are its pattern"),
    ] {
        let help = good(yugen_in(".".as_ref(), &format!("{line} --help")));
        // Lines are broken to the width of the terminal.
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains(taught), "{line}: {help}");
    }
}

#[test]
#[cfg(unix)]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_yugen"))
        .args(["brdf", "list"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8(out.stderr).unwrap(), "");
}
