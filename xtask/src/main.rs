//! `cargo xtask demo | test | bench | install | setup`: each does its own set-up.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

const HELP: &str = "\
cargo xtask <what>

  demo    build the renderer and make the contact sheet: out/demo/
  test    everything a change must pass: format, lints, WebAssembly, tests (software GPU)
  bench   build Yugen for this processor and measure it: whole pictures, or what is named, beside other programs
            bench [render] [--peer]   samples a second; with --peer, time to equal error beside Mitsuba 3
            bench denoise             error of denoised pictures, beside Open Image Denoise
            bench realtime            error of real-time pictures, beside the reference's
            bench stage [PART]        milliseconds of the real-time passes, by pixels, triangles, lights and samples, and of cloth
            bench stage --peer        error and time of a frame, beside Filament (PyPI: filly)
            bench bsdf [--peer]       nanoseconds to evaluate and sample each reflectance model
            bench rays [MESH.obj …]   rays a second, beside Mitsuba 3 (Embree)
            bench fit [SIDE [LIGHTS]] texels a second of the BTF fit, beside SciPy and NumPy
            bench rti [SIDE [LIGHTS]] texels a second of relightable images, beside NumPy
            bench cloth [--peer]      time, stretch and crossings of cloth; with --peer, beside Blender and Newton (1.6 GB)
            bench ink                 lines, beside Blender's Line Art and Freestyle (370 MB to fetch, 1 GB)
            bench ink_vectors         an SVG of strokes, as vpype reads it (270 MB installed)
            bench calibrate [CASE …]  how exactly lamps are found in path-traced mirror balls (drawn first: half an hour)
            bench all [--peer]        one after the other, but for calibrate and those of ink; --peer of render and bsdf
  install build the program for this processor and put it where cargo puts programs
  setup   install the system packages that tests and demo need
";

/// System packages and a file of each. The software Vulkan driver runs the GPU twins; the window is tested on a display
/// without a screen, and its libraries are looked for when it starts; Python reads relightable files for a test that can do
/// without.
const DEBIAN_PACKAGES: &[(&str, &str)] = &[
    ("libvulkan1", "/usr/lib/x86_64-linux-gnu/libvulkan.so.1"),
    ("mesa-vulkan-drivers", "/usr/share/vulkan/icd.d"),
    ("xvfb", "/usr/bin/Xvfb"),
    ("libx11-xcb1", "/usr/lib/x86_64-linux-gnu/libX11-xcb.so.1"),
    ("libxcursor1", "/usr/lib/x86_64-linux-gnu/libXcursor.so.1"),
    ("libxi6", "/usr/lib/x86_64-linux-gnu/libXi.so.6"),
    ("libxkbcommon-x11-0", "/usr/lib/x86_64-linux-gnu/libxkbcommon-x11.so.0"),
    ("libxrandr2", "/usr/lib/x86_64-linux-gnu/libXrandr.so.2"),
    ("python3-numpy", "/usr/lib/python3/dist-packages/numpy"),
    ("python3-pil", "/usr/lib/python3/dist-packages/PIL"),
];

type Outcome = Result<(), String>;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let verb = args.next().unwrap_or_default();
    let rest: Vec<String> = args.collect();
    let outcome = match verb.as_str() {
        "demo" => demo(&rest),
        "test" => test(&rest),
        "bench" => bench(&rest),
        "install" => cargo(&["install", "--path", "crates/cli", "--profile", "dist"]),
        "setup" => setup(),
        "" | "help" | "--help" | "-h" => {
            print!("{HELP}");
            Ok(())
        }
        other => Err(format!("there is no '{other}'\n\n{HELP}")),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("xtask: {problem}");
            ExitCode::FAILURE
        }
    }
}

/// Compilers for WebAssembly of Debian and a file of each, where rustup's is not to be had.
const WASM_PACKAGES: &[(&str, &str)] =
    &[("rustc-web", "/usr/bin/rustc"), ("rust-web-src", WASM_LIBRARY), ("cargo-web", "/usr/bin/cargo")];

/// The source of Debian's standard library, which it has not built for WebAssembly.
const WASM_LIBRARY: &str = "/usr/lib/rustlib/src/rust/library/std/Cargo.toml";

/// The rooms that a browser runs.
const WASM_ROOMS: &[&str] = &["optics", "reflectance", "motion", "scene", "realtime", "ink"];

fn setup() -> Outcome {
    if install(DEBIAN_PACKAGES)? {
        return Ok(());
    }
    let (optional, needed): (Vec<_>, Vec<_>) =
        missing(DEBIAN_PACKAGES).into_iter().partition(|name| name.starts_with("python3"));
    if needed.is_empty() {
        eprintln!("xtask: without {} some tests will be skipped", optional.join(" "));
        return Ok(());
    }
    Err(format!("could not install what the tests need; try: apt-get install -y {}", needed.join(" ")))
}

fn missing<'a>(packages: &[(&'a str, &str)]) -> Vec<&'a str> {
    packages.iter().filter(|(_, file)| !Path::new(file).exists()).map(|(name, _)| *name).collect()
}

/// Installs what is missing where that is possible, else says what to type. Whether all is there, or may be for all that
/// is known here.
fn install(packages: &[(&str, &str)]) -> Result<bool, String> {
    let names = missing(packages);
    if names.is_empty() {
        return Ok(true);
    }
    let line = format!("apt-get install -y {}", names.join(" "));
    let root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.trim_ascii() == b"0");
    let apt =
        Command::new("apt-get").arg("--version").stdout(Stdio::null()).status().is_ok_and(|s| s.success());
    if !(root && apt) {
        eprintln!("xtask: some packages are missing; on Debian or Ubuntu type: sudo {line}");
        return Ok(true);
    }
    step(&line);
    let quiet = |args: &[&str]| {
        Command::new("apt-get")
            .args(args)
            .env("DEBIAN_FRONTEND", "noninteractive")
            .stdout(Stdio::null())
            .status()
    };
    let _ = quiet(&["update", "-qq"]);
    let mut args = vec!["install", "-y", "-qq", "--no-install-recommends"];
    args.extend(names);
    Ok(quiet(&args).is_ok_and(|s| s.success()))
}

/// Whether the rooms that a browser runs compile for it: by rustup's target, or by Debian's compiler, which builds the
/// standard library as well.
fn wasm() -> Outcome {
    const TARGET: &str = "wasm32-unknown-unknown";
    let mut args = vec!["check", "--target", TARGET, "--target-dir", "target/wasm"];
    let rooms: Vec<String> = WASM_ROOMS.iter().map(|room| format!("yugen-{room}")).collect();
    rooms.iter().for_each(|room| args.extend(["--package", room]));
    let says = |program: &str, args: &[&str]| {
        Command::new(program).args(args).current_dir(root()).output().ok().filter(|o| o.status.success())
    };
    let built = || {
        says("rustc", &["--print", "target-libdir", "--target", TARGET])
            .is_some_and(|o| Path::new(String::from_utf8_lossy(&o.stdout).trim()).exists())
    };
    if built() || says("rustup", &["target", "add", TARGET]).is_some() && built() {
        return cargo(&args);
    }
    let there = install(WASM_PACKAGES)? && missing(WASM_PACKAGES).is_empty();
    if !there {
        let problem = format!("no compiler for WebAssembly; try: rustup target add {TARGET}");
        if std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1") {
            return Err(problem);
        }
        eprintln!("xtask: skipped: {problem}");
        return Ok(());
    }
    args.extend(["-Z", "build-std=std,panic_abort"]);
    step(&format!("/usr/bin/cargo {}", args.join(" ")));
    run(Command::new("/usr/bin/cargo")
        .args(args)
        .current_dir(root())
        .env_remove("RUSTFLAGS")
        .envs([("RUSTC", "/usr/bin/rustc"), ("RUSTC_BOOTSTRAP", "1")]))
}

fn test(rest: &[String]) -> Outcome {
    setup()?;
    cargo(&["fmt", "--all", "--check"])?;
    format_models()?;
    wasm()?;
    cargo(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--features",
        "yugen-proof/gpu",
        "--",
        "-D",
        "warnings",
    ])?;
    let mut args =
        vec!["test", "--release", "--workspace", "--no-fail-fast", "--features", "yugen-proof/gpu"];
    args.extend(rest.iter().map(String::as_str));
    counted(&args)
}

/// The models are declared by the `models!` list, where `cargo fmt` does not find them.
fn format_models() -> Outcome {
    let folder = root().join("crates/reflectance/src");
    let files = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = files.filter_map(Result::ok).map(|f| f.path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "rs"));
    files.sort();
    step("rustfmt --check crates/reflectance/src/*.rs");
    run(Command::new("rustfmt").args(["--check", "--edition", "2024"]).args(files).current_dir(root()))
}

/// Runs the tests, adds up what each program of them reports, and closes with one line.
fn counted(args: &[&str]) -> Outcome {
    step(&format!("cargo {}", args.join(" ")));
    let mut child = Command::new(env!("CARGO"))
        .args(args)
        .current_dir(root())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|e| format!("cannot start cargo: {e}"))?;
    let (mut passed, mut failed, mut ignored) = (0u64, 0u64, 0u64);
    if let Some(out) = child.stdout.take() {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            println!("{line}");
            if let Some(numbers) = line.strip_prefix("test result:") {
                for part in numbers.split(';') {
                    let words: Vec<&str> = part.split_whitespace().collect();
                    for pair in words.windows(2) {
                        let Ok(n) = pair[0].parse::<u64>() else { continue };
                        match pair[1] {
                            "passed" => passed += n,
                            "failed" => failed += n,
                            "ignored" => ignored += n,
                            _ => {}
                        }
                    }
                }
            }
        }
    }
    let status = child.wait().map_err(|e| format!("cargo was lost: {e}"))?;
    if passed == 0 {
        return Err("no test ran".into());
    }
    let outcome = if status.success() {
        Ok(())
    } else {
        Err("some tests failed, or could not be compiled".to_string())
    };
    println!("{passed} passed, {failed} failed, {ignored} skipped");
    outcome
}

fn demo(rest: &[String]) -> Outcome {
    // Of the rooms only those that draw: neither the program nor capture.
    cargo(&["build", "--release", "--package", "yugen-examples", "--bin", "contact_sheet"])?;
    let mut args =
        vec!["run", "--release", "--quiet", "--package", "yugen-examples", "--bin", "contact_sheet", "--"];
    args.extend(rest.iter().map(String::as_str));
    cargo(&args)
}

/// How `bench all` runs a benchmark.
#[derive(Clone, Copy, PartialEq)]
enum InAll {
    /// With `--peer`, if that is asked for.
    WithPeer,
    /// Without options.
    Plain,
    /// Not at all.
    No,
}

/// A benchmark.
struct Bench {
    /// What is measured.
    name: &'static str,
    /// In `benches`.
    script: &'static str,
    in_all: InAll,
    /// Whether the script runs `yugen`.
    runs_yugen: bool,
}

impl Bench {
    const fn new(name: &'static str, script: &'static str, in_all: InAll) -> Self {
        Self { name, script, in_all, runs_yugen: false }
    }

    const fn of_yugen(name: &'static str, script: &'static str, in_all: InAll) -> Self {
        Self { runs_yugen: true, ..Self::new(name, script, in_all) }
    }
}

const BENCHES: &[Bench] = &[
    Bench::of_yugen("render", "bench.py", InAll::WithPeer),
    Bench::of_yugen("denoise", "denoise.py", InAll::Plain),
    Bench::of_yugen("realtime", "realtime.py", InAll::Plain),
    // No script: an example that needs nothing beside itself, so that it can be copied to where the GPU is.
    // `--peer`, beside Filament, is for it alone.
    Bench::new("stage", STAGE, InAll::Plain),
    Bench::new("bsdf", "bsdf_rate.py", InAll::WithPeer),
    Bench::new("rays", "ray_rate.py", InAll::Plain),
    Bench::new("fit", "fit_rate.py", InAll::Plain),
    Bench::new("rti", "rti_rate.py", InAll::Plain),
    // Its peers are Blender and Newton, 1.6 GB.
    Bench::new("cloth", "cloth.py", InAll::Plain),
    // It installs Blender.
    Bench::new("ink", "ink.py", InAll::No),
    // It measures no time.
    Bench::new("ink_vectors", "ink_vectors.py", InAll::No),
    // It measures errors, not time, and draws for long.
    Bench::new("calibrate", "calibrate.py", InAll::No),
];

/// The example that times the passes of the real-time renderer.
const STAGE: &str = "stage_rate";

fn bench(rest: &[String]) -> Outcome {
    let named = rest.first().filter(|word| !word.starts_with('-'));
    let (what, rest) = named.map_or(("render", rest), |word| (word.as_str(), &rest[1..]));
    let all = what == "all";
    let chosen: Vec<_> =
        BENCHES.iter().filter(|b| if all { b.in_all != InAll::No } else { b.name == what }).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = BENCHES.iter().map(|b| b.name).collect();
        return Err(format!("there is no benchmark '{what}'; expected all or one of {}", names.join(", ")));
    }
    if all && rest.iter().any(|word| word != "--peer") {
        return Err("bench all takes --peer and nothing else; name a benchmark to say more".into());
    }
    for bench in chosen {
        let rest = if all && bench.in_all == InAll::Plain { &[] } else { rest };
        let beside = bench.script == STAGE && rest.iter().any(|word| word == "--peer");
        let script = if beside { "stage_peer.py" } else { bench.script };
        let rest: Vec<&str> =
            rest.iter().map(String::as_str).filter(|word| !beside || *word != "--peer").collect();
        if beside || bench.runs_yugen {
            cargo(&["build", "--profile", "dist", "--package", "yugen-cli"])?;
        }
        if script == STAGE {
            cargo(&["build", "--profile", "dist", "--package", "yugen-realtime", "--example", STAGE])?;
            let program = root().join("target/dist/examples").join(STAGE);
            step(&format!("{} {}", program.display(), rest.join(" ")));
            run(Command::new(program).args(rest))?;
            continue;
        }
        let script = root().join("benches").join(script);
        step(&format!("python3 {} {}", script.display(), rest.join(" ")));
        // The scripts run examples by cargo: for this processor as well.
        run(Command::new("python3").arg(script).args(rest).envs([this_processor()]))?;
    }
    Ok(())
}

/// What makes cargo build with all instructions that this processor has.
fn this_processor() -> (&'static str, String) {
    let others = std::env::var("RUSTFLAGS").unwrap_or_default();
    ("RUSTFLAGS", format!("{others} -C target-cpu=native").trim().to_string())
}

fn cargo(args: &[&str]) -> Outcome {
    step(&format!("cargo {}", args.join(" ")));
    let own = args.contains(&"dist").then(this_processor);
    run(Command::new(env!("CARGO")).args(args).current_dir(root()).envs(own))
}

fn run(command: &mut Command) -> Outcome {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{} ended with {status}", command.get_program().to_string_lossy())),
        Err(e) => Err(format!("cannot start {}: {e}", command.get_program().to_string_lossy())),
    }
}

fn step(what: &str) {
    eprintln!("\x1b[1m── {what}\x1b[0m");
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}
