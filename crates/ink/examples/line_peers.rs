//! Our strokes beside the lines of other programs: the tables under 'Beside other programs' of docs/ink.md.
//!
//! `line_peers FOLDER write` writes the meshes and views in the formats that benches/ink_peers.py has in its head, and prints a
//! line for each: the case and the programs that are to draw it. `line_peers FOLDER score [CASE…]` reads what those have left
//! there, draws the same by ours, and prints the tables; of these cases alone where some are named. `benches/ink.py` does both.

#[path = "../tests/analytic/surfaces.rs"]
mod surfaces;
#[path = "../tests/analytic/truth.rs"]
mod truth;

use glam::{DVec2, Mat4, Vec3};
use std::path::Path;
use surfaces::{Cells, camera, scene, torus};
use truth::{SIZE, Shape, Truth, dented_mesh, pixels_along, points, score, shapes};
use yugen_ink::control::Controls;
use yugen_ink::painter::{Painter, Style};
use yugen_realtime::Gpu;
use yugen_scene::{Camera, Mesh, Projection};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Those compared with: in the names of files and in the tables.
const TOOLS: [[&str; 2]; 2] = [["lineart", "Line Art"], ["freestyle", "Freestyle"]];
/// Frames after the first of a film by which strokes are followed.
const FOLLOWED: usize = 40;
/// Degrees between them, by which the literature is measured.
const DEGREES: f32 = 0.5;
/// Frames after the first, which warms up, that time is the mean of.
const TIMED: usize = 8;
/// How often ours draws them: the system counts processor time in hundredths of a second.
const REPEATS: usize = 8;
/// Shortest stroke that is counted as one that comes or goes, pixels.
const SHORTEST: f64 = 12.0;
/// Pixels within which a stroke lies over another, and the part of it that must.
const OVER: (f64, f64) = (15.0, 0.8);

/// What is measured of a case, which is the table it stands in.
enum Measure {
    /// How its strokes agree with what should be seen.
    Contours(Truth),
    /// How many of its strokes are new in a frame.
    New,
    /// What a frame costs.
    Time,
}

/// A mesh and the views of it.
struct Case {
    /// In the names of files: one word.
    file: String,
    /// In the tables.
    name: String,
    mesh: Mesh,
    views: Vec<Camera>,
    measure: Measure,
}

/// A camera that goes round the origin, in so many frames.
fn round(view: &Camera, axis: Vec3, frames: usize) -> Vec<Camera> {
    let turned = |i: usize| {
        let angle = (DEGREES * i as f32).to_radians();
        Camera { to_world: Mat4::from_axis_angle(axis, angle) * view.to_world, ..view.clone() }
    };
    (0..frames).map(turned).collect()
}

fn cases() -> Vec<Case> {
    let near = camera(4.5, SIZE);
    let still = |Shape { name, mesh, truth }: Shape| Case {
        file: format!("still-{}-{}", name.replace(' ', "-"), mesh.triangles.len()),
        name: name.into(),
        views: vec![near.clone()],
        measure: Measure::Contours(truth),
        mesh,
    };
    let mut cases: Vec<Case> = shapes(&near).into_iter().map(still).collect();
    let far = camera(6.0, SIZE);
    for (file, name, mesh, axis) in [
        ("new-torus", "torus across its axis, 36 864 triangles", torus(96), Vec3::X),
        ("new-dented-ball", "dented ball, 25 600 triangles", dented_mesh(80), Vec3::Z),
    ] {
        let views = round(&far, axis, FOLLOWED + 1);
        cases.push(Case { file: file.into(), name: name.into(), mesh, views, measure: Measure::New });
    }
    // Both of 250 000 triangles.
    for (file, name, mesh) in
        [("time-torus", "torus", torus(250)), ("time-dented-ball", "dented ball", dented_mesh(250))]
    {
        let views = round(&near, Vec3::Z, TIMED + 1);
        cases.push(Case { file: file.into(), name: name.into(), mesh, views, measure: Measure::Time });
    }
    cases
}

fn write(folder: &Path, case: &Case) -> Result<()> {
    let file = |kind: &str| folder.join(format!("{}.{kind}", case.file));
    let positions = case.mesh.positions.iter().flat_map(|p| p.to_array());
    std::fs::write(file("positions"), positions.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())?;
    let corners = case.mesh.triangles.iter().flatten();
    std::fs::write(file("triangles"), corners.flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?;
    let mut views = String::new();
    for view in &case.views {
        let Projection::Perspective { fov_x, .. } = view.projection else {
            return Err("the views of other programs are in perspective".into());
        };
        let matrix = view.to_world.to_cols_array().map(|v| v.to_string()).join(" ");
        views += &format!("{matrix} {fov_x} {} {}\n", view.film.width, view.film.height);
    }
    Ok(std::fs::write(file("views"), views)?)
}

/// What a program has drawn: the lines of each frame, and the processor's milliseconds of a frame in the mean.
struct Drawn {
    frames: Vec<Vec<Vec<DVec2>>>,
    milliseconds: f64,
}

/// The mean but of the first, which warms up.
fn mean_of_warm(of_frames: &[f64]) -> f64 {
    let warm = &of_frames[of_frames.len().min(2) - 1..];
    warm.iter().sum::<f64>() / warm.len() as f64
}

/// Of another program, as benches/ink_peers.py writes it.
fn theirs(folder: &Path, case: &Case, tool: &str) -> Result<Drawn> {
    let read = |kind: &str| {
        let file = folder.join(format!("{}-{tool}.{kind}", case.file));
        let text = std::fs::read_to_string(&file)
            .map_err(|e| format!("{}: {e}; benches/ink_peers.py writes it", file.display()))?;
        Ok::<_, String>((file, text))
    };
    // The numbers of each line.
    let numbers = |kind: &str| -> Result<Vec<Vec<f64>>> {
        let (file, text) = read(kind)?;
        let line = |(i, line): (usize, &str)| {
            let words: std::result::Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
            words.map_err(|e| format!("{}:{}: {e}; expected numbers", file.display(), i + 1))
        };
        Ok(text.lines().enumerate().map(line).collect::<std::result::Result<_, _>>()?)
    };
    let mut frames = vec![Vec::new(); case.views.len()];
    for (i, line) in numbers("lines")?.iter().enumerate() {
        let at = || format!("{}-{tool}.lines:{}", case.file, i + 1);
        let [frame, closed, places @ ..] = &line[..] else {
            return Err(format!("{}: expected a frame, closed and places", at()).into());
        };
        let frames = frames.get_mut(*frame as usize).ok_or_else(|| format!("{}: no such frame", at()))?;
        let mut points: Vec<DVec2> = places.chunks_exact(2).map(|p| DVec2::new(p[0], p[1])).collect();
        if *closed != 0.0 {
            points.extend(points.first().copied());
        }
        frames.push(points);
    }
    let processor: Vec<f64> =
        numbers("seconds")?.iter().filter_map(|line| line.get(1)).map(|s| 1e3 * s).collect();
    if processor.len() != case.views.len() {
        let (found, expected) = (processor.len(), case.views.len());
        return Err(format!("{}-{tool}.seconds: {found} frames, expected {expected}", case.file).into());
    }
    Ok(Drawn { frames, milliseconds: mean_of_warm(&processor) })
}

/// Seconds of all processors that this program has used.
fn processor() -> Result<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    // After the name in parentheses, which may hold anything: user and system time are words 14 and 15 of all.
    let words = stat.rsplit_once(')').map(|(_, after)| after.split_whitespace().skip(11).take(2));
    let ticks = words.ok_or("/proc/self/stat has no times")?.map(str::parse::<f64>);
    Ok(ticks.sum::<std::result::Result<f64, _>>()? / 100.0)
}

/// All lines, with a steady hand: what is left out on purpose is no error.
fn ours(gpu: &Gpu, case: &Case) -> Result<Drawn> {
    let controls = Controls { detail: 1.0, roughness: 0.0, ..Controls::default() };
    let style = Style { controls, ..Style::default() };
    let scene = scene(case.mesh.clone());
    let mut painter = Painter::new(&gpu.device, &gpu.queue, &scene, &case.views[0], style, 2)?;
    let mut frames = Vec::new();
    for view in &case.views {
        let strokes = painter.follow(view)?.0;
        frames.push(strokes.iter().filter(|s| !s.fading).map(points).collect());
    }
    let mut milliseconds = 0.0;
    if matches!(case.measure, Measure::Time) {
        let before = processor()?;
        for view in std::iter::repeat_n(&case.views[1..], REPEATS).flatten() {
            painter.follow(view)?;
        }
        milliseconds = 1e3 * (processor()? - before) / (REPEATS * (case.views.len() - 1)) as f64;
    }
    Ok(Drawn { frames, milliseconds })
}

fn length(line: &[DVec2]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Strokes of the frames after the first, in the mean, and the part of them that are new: over which none of the frame before
/// lies that it lies over.
fn new_strokes(frames: &[Vec<Vec<DVec2>>]) -> [f64; 2] {
    let covered = |frame: &Vec<Vec<DVec2>>| -> Vec<(Vec<DVec2>, Cells)> {
        let long = frame.iter().filter(|line| length(line) >= SHORTEST);
        let pixels = long.map(|line| pixels_along(std::iter::once(line.clone())));
        pixels.map(|p| (p.clone(), Cells::new(p.into_iter()))).collect()
    };
    let lies_over = |line: &[DVec2], other: &Cells| {
        let over = line.iter().filter(|p| other.is_near(**p, OVER.0)).count();
        over as f64 > OVER.1 * line.len() as f64
    };
    let frames: Vec<_> = frames.iter().map(covered).collect();
    let (mut all, mut new) = (0usize, 0usize);
    for pair in frames.windows(2) {
        let goes_on = |(line, cells): &(Vec<DVec2>, Cells)| {
            pair[0].iter().any(|(before, there)| lies_over(line, there) && lies_over(before, cells))
        };
        all += pair[1].len();
        new += pair[1].iter().filter(|stroke| !goes_on(stroke)).count();
    }
    [all as f64 / (frames.len().max(2) - 1) as f64, new as f64 / all.max(1) as f64]
}

/// A table under its head, where there is one.
fn print_table(head: &str, rows: &[String]) {
    if !rows.is_empty() {
        let columns = head.matches('|').count() - 1;
        println!("{head}\n|{}\n{}\n", " --- |".repeat(columns), rows.join("\n"));
    }
}

fn print_scores(gpu: &Gpu, folder: &Path, cases: &[Case]) -> Result<()> {
    let (mut contours, mut new, mut time) = (Vec::new(), Vec::new(), Vec::new());
    for case in cases {
        let mut programs = vec![("Yugen", ours(gpu, case)?)];
        for [tool, name] in TOOLS {
            programs.push((name, theirs(folder, case, tool)?));
        }
        let ours = programs[0].1.milliseconds;
        for (i, (program, drawn)) in programs.iter().enumerate() {
            // What is the same for all stands beside the first.
            let name = if i == 0 { format!(" {} |", case.name) } else { " |".into() };
            match &case.measure {
                Measure::Contours(truth) => {
                    let lines = &drawn.frames[0];
                    let score = score(truth, &pixels_along(lines.iter().cloned())).row();
                    let triangles =
                        if i == 0 { format!(" {} |", case.mesh.triangles.len()) } else { " |".into() };
                    contours.push(format!("|{name}{triangles} {program} | {score} | {} |", lines.len()));
                }
                Measure::New => {
                    let [strokes, part] = new_strokes(&drawn.frames);
                    new.push(format!("|{name} {program} | {strokes:.1} | {:.1} |", 100.0 * part));
                }
                Measure::Time => {
                    let ms = drawn.milliseconds;
                    time.push(match i {
                        0 => format!("|{name} {program} | {ms:.1} | 1 |"),
                        _ => format!("|{name} {program} | {ms:.1} | {:.1} |", ms / ours),
                    });
                }
            }
        }
    }
    print_table(
        "| 4.5 away | triangles | program | recall | precision | F1 | hidden shown, % | strokes |",
        &contours,
    );
    print_table("| | program | strokes | new, % a frame |", &new);
    print_table("| | program | ms of processors | times as much as ours |", &time);
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut cases = cases();
    match &words[..] {
        [folder, "write"] => {
            for case in &cases {
                write(Path::new(folder), case)?;
                println!("{} {}", case.file, TOOLS.map(|[tool, _]| tool).join(" "));
            }
            Ok(())
        }
        [folder, "score", only @ ..] => {
            if let Some(unknown) = only.iter().find(|name| !cases.iter().any(|c| c.file == **name)) {
                let known: Vec<&str> = cases.iter().map(|c| c.file.as_str()).collect();
                return Err(format!("there is no case '{unknown}'; expected {}", known.join(", ")).into());
            }
            cases.retain(|c| only.is_empty() || only.contains(&c.file.as_str()));
            print_scores(&Gpu::open()?, Path::new(folder), &cases)
        }
        _ => Err("usage: line_peers FOLDER write | FOLDER score [CASE…]".into()),
    }
}
