//! `yugen render` as a person would run it: killed, resumed, misused.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const SCENE: &str = r##"
[camera]
from = [0, 1.2, 3]
to = [0, 0.4, 0]
fov = 35

[film]
size = [96, 64]

[material.desk]
model = "lambert"
reflectance = 0.8

[material.red]
model = "rough_plastic"
diffuse_reflectance = "#b3201a"
alpha = 0.1

[[shape]]
type = "rectangle"
size = [4, 4]
facing = [0, 1, 0]
material = "desk"

[[shape]]
type = "sphere"
radius = 0.4
at = [0, 0.4, 0]
material = "red"

[[shape]]
type = "rectangle"
at = [1, 2.5, 1]
facing = [-1, -2.1, -1]
emission = { blackbody = 3000, scale = 12 }
"##;

/// A folder of its own for each test, gone afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("yugen-render-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        std::fs::write(path.join("ball.toml"), SCENE).expect("the scene");
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn yugen(scene: &Path, output: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_yugen"));
    command.arg("render").arg(scene).arg("-o").arg(output).args(more);
    command
}

fn run(mut command: Command) -> Output {
    command.output().expect("yugen runs")
}

fn refused(output: &Output) -> String {
    assert!(!output.status.success());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn killed_and_resumed_it_is_the_same_to_the_bit_for_any_number_of_threads() {
    let folder = Folder::new("kill");
    let scene = folder.file("ball.toml");
    let (whole, resumed) = (folder.file("whole.exr"), folder.file("resumed.exr"));
    let budget = ["--spp", "1024", "--aov", "all", "--json"];
    let done = run(yugen(&scene, &whole, &[&budget[..], &["--threads", "1"]].concat()));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));

    let checkpoint = folder.file("resumed.exr.checkpoint");
    let mut child =
        yugen(&scene, &resumed, &[&budget[..], &["--threads", "2", "--checkpoint", "0.05"]].concat())
            .spawn()
            .expect("yugen runs");
    let started = Instant::now();
    while !checkpoint.exists() && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    // SIGKILL on Unix: no chance to tidy up.
    child.kill().expect("a running child");
    child.wait().expect("its end");
    assert!(checkpoint.exists(), "no checkpoint was written");
    assert!(!resumed.exists(), "nothing may be half-written, and it was killed before its end");

    let done = run(yugen(&scene, &resumed, &[&budget[..], &["--resume"]].concat()));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(!checkpoint.exists(), "the checkpoint has served");
    let same = std::fs::read(&whole).expect("whole") == std::fs::read(&resumed).expect("resumed");
    assert!(same, "the resumed picture differs");
}

#[test]
fn a_checkpoint_of_another_render_is_refused() {
    let folder = Folder::new("other");
    let output = folder.file("a.exr");
    std::fs::write(folder.file("a.exr.checkpoint"), b"something else").expect("a file");
    let text = refused(&run(yugen(&folder.file("ball.toml"), &output, &["--resume", "--spp", "1"])));
    assert!(text.contains("a.exr.checkpoint") && text.contains("checkpoint"), "{text}");
    assert!(!output.exists());
}

/// The scene file stays as it is; a vertex of the mesh it names is moved.
#[test]
fn a_checkpoint_is_refused_once_a_mesh_has_changed() {
    let folder = Folder::new("moved");
    let (scene, output) = (folder.file("tent.toml"), folder.file("a.exr"));
    let tent = "[[shape]]\ntype = \"file\"\nfile = \"tent.obj\"\nmaterial = \"red\"\n";
    std::fs::write(&scene, format!("{SCENE}\n{tent}")).expect("the scene");
    let write = |top: &str| {
        let obj = format!("v -0.5 0 -1\nv 0.5 0 -1\nv 0 {top} -1\nf 1 2 3\n");
        std::fs::write(folder.file("tent.obj"), obj).expect("a mesh");
    };
    write("1.5");
    let checkpoint = folder.file("a.exr.checkpoint");
    let mut child = yugen(&scene, &output, &["--spp", "16384", "--checkpoint", "0.05", "--json"])
        .spawn()
        .expect("yugen runs");
    let started = Instant::now();
    while !checkpoint.exists() && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("a running child");
    child.wait().expect("its end");

    write("1.5001");
    let again = ["--spp", "16384", "--resume", "--json"];
    let text = refused(&run(yugen(&scene, &output, &again)));
    assert!(text.contains("a.exr.checkpoint") && text.contains("have changed"), "{text}");
    assert!(checkpoint.exists() && !output.exists());
    // Put back, it is the same scene again: the refusal was about the vertex.
    write("1.5");
    let mut child =
        yugen(&scene, &output, &again).stderr(std::process::Stdio::piped()).spawn().expect("yugen runs");
    std::thread::sleep(Duration::from_millis(500));
    let running = child.try_wait().expect("its state").is_none();
    child.kill().expect("a child");
    let text = String::from_utf8_lossy(&child.wait_with_output().expect("its end").stderr).into_owned();
    assert!(running && text.is_empty(), "{text}");
}

#[test]
fn json_says_what_was_done() {
    let folder = Folder::new("json");
    let output = folder.file("a.png");
    let done = run(yugen(&folder.file("ball.toml"), &output, &["--spp", "4", "--size", "40x30", "--json"]));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert_eq!(report["width"], 40);
    assert_eq!(report["samples"], 4 * 40 * 30);
    assert!(std::fs::read(&output).expect("a picture").starts_with(b"\x89PNG"));
}

#[test]
fn mistakes_are_told_before_anything_is_rendered() {
    let folder = Folder::new("mistakes");
    let scene = folder.file("ball.toml");
    let cases: [(&[&str], &str, &str); 10] = [
        (&["--at", "1.5"], "a.exr", "does not move"),
        (&[], "missing/a.png", "there is no folder"),
        (&[], ".", "cannot tell a picture format"),
        (&["-D", "spp=4"], "a.exr", "has no parameters, so 'spp'"),
        (&["--size", "65536x65536"], "a.exr", "give a smaller size"),
        (&[], "a.bmp", "exr"),
        (&["--aov", "normal"], "a.png", "--aov needs an .exr"),
        (&["--camera", "left"], "a.exr", "no camera called 'left'"),
        (&["--size", "12"], "a.exr", "640x480"),
        (&["--spp", "1", "--time", "3s"], "a.exr", "cannot be used with"),
    ];
    for (arguments, output, expected) in cases {
        let text = refused(&run(yugen(&scene, &folder.file(output), arguments)));
        assert!(text.contains(expected), "{arguments:?}: {text}");
        assert!(output == "." || !folder.file(output).exists());
    }
    std::fs::write(&scene, SCENE.replace("reflectance = 0.8", "reflectanse = 0.8")).expect("the scene");
    let text = refused(&run(yugen(&scene, &folder.file("a.exr"), &[])));
    assert!(text.contains("ball.toml:12:1") && text.contains("reflectance"), "{text}");
    let text = refused(&run(yugen(&folder.file("none.toml"), &folder.file("a.exr"), &[])));
    assert!(text.contains("none.toml: there is nothing of this name; check its name\n"), "{text}");
    let text = refused(&run(yugen(&folder.file("bal.toml"), &folder.file("a.exr"), &[])));
    assert!(text.contains("did you mean 'ball.toml'?"), "{text}");
    let text = refused(&run(yugen(&folder.0, &folder.file("a.exr"), &[])));
    assert!(text.contains("this is a folder"), "{text}");
}
