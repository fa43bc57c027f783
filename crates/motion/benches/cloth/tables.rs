//! How several programs move the same scenes, by one scorer, and how ours grows.

use crate::cases::{self, Case, EVERY, FRAMES};
use crate::processor::processor;
use crate::{Result, drape};
use glam::Vec3;
use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use yugen_motion::cloth::{Along, Cloth, Field, Settings, SmallSteps, Solid, Stance, Step};

/// Frames by which ours is seen to grow.
const SHORT: u32 = 30;

/// What a program has made of a scene.
struct Moved {
    /// Where vertices are, of every so many frames.
    samples: Vec<Vec<Vec3>>,
    /// Milliseconds of a frame in the mean: wall and all processors.
    milliseconds: [f64; 2],
}

fn settings(substeps: u32, contact: bool) -> Settings {
    Settings { substeps, contact, lines: true, threads: 2, ..Settings::default() }
}

/// Ours, on this body, and the substeps it took.
fn ours(case: &Case, body: Option<Solid>, settings: Settings, frames: u32) -> Result<(Moved, u32)> {
    let cloth = Cloth::new(case.sheet.clone(), &cases::fabric())?;
    let mut solver = SmallSteps::new(cloth, &case.held, settings)?;
    solver = solver.with_bodies(body.map(|b| (b, Stance::default())).into_iter().collect())?;
    solver.place(&case.start, &vec![Vec3::ZERO; case.start.len()]);
    let targets: Vec<Vec3> = case.held.iter().map(|v| case.start[*v as usize]).collect();
    let (mut samples, mut wall, mut cpu) = (Vec::new(), 0.0, 0.0);
    for frame in 1..=frames {
        let (start, before) = (Instant::now(), processor());
        solver.step(&Step { targets: &targets, ..Step::default() });
        (wall, cpu) = (wall + start.elapsed().as_secs_f64(), cpu + processor() - before);
        if frame % EVERY == 0 {
            samples.push(solver.positions().to_vec());
        }
    }
    let milliseconds = [wall, cpu].map(|s| 1e3 * s / f64::from(frames));
    Ok((Moved { samples, milliseconds }, solver.substeps()))
}

fn ball(case: &Case) -> Option<Solid> {
    case.ball.map(|(middle, radius)| Solid::Capsule { ends: [middle; 2], radii: [radius; 2] })
}

/// Of another program, as benches/cloth_newton.py and cloth_blender.py write it; none where it did not run.
fn theirs(folder: &Path, case: &Case, tool: &str) -> Result<Option<Moved>> {
    let file = |kind: &str| folder.join(format!("{}-{tool}.{kind}", case.file));
    let (times, frames) = (file("seconds"), file("frames"));
    if !times.exists() {
        return Ok(None);
    }
    let [mut wall, mut cpu] = [0.0, 0.0];
    let text = std::fs::read_to_string(&times)?;
    let lines = text.lines().count();
    for line in text.lines() {
        let numbers: Vec<f64> =
            line.split_whitespace().map(str::parse).collect::<std::result::Result<_, _>>()?;
        let [w, c] = numbers[..] else {
            return Err(format!("{}: '{line}': expected wall and processor time", times.display()).into());
        };
        (wall, cpu) = (wall + w, cpu + c);
    }
    let bytes = std::fs::read(&frames)?;
    let n = case.start.len();
    let samples = (FRAMES / EVERY) as usize;
    if lines != FRAMES as usize || bytes.len() != 12 * n * samples {
        let found = bytes.len() / (12 * n);
        return Err(format!(
            "{}: {lines} frames and {found} samples, expected {FRAMES} and {samples}",
            frames.display()
        )
        .into());
    }
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let place = |b: &[u8]| Vec3::new(number(&b[..4]), number(&b[4..8]), number(&b[8..]));
    let samples =
        bytes.chunks_exact(12 * n).map(|sample| sample.chunks_exact(12).map(place).collect()).collect();
    Ok(Some(Moved { samples, milliseconds: [wall, cpu].map(|s| 1e3 * s / f64::from(FRAMES)) }))
}

/// What is measured of each sample.
struct Score {
    /// |strain| of threads, and by how much they are longer, but for one of 1000.
    stretch: f32,
    longer: f32,
    crossings: usize,
}

fn scores(cloth: &Cloth, moved: &Moved) -> Vec<Score> {
    let score = |x: &Vec<Vec3>| Score {
        stretch: cloth.stretch(x, |a| a != Along::Bias).p999,
        longer: cloth.elongation(x, |s| s.along != Along::Bias),
        crossings: cloth.crossings(x).len(),
    };
    moved.samples.iter().map(score).collect()
}

/// The worst of all samples.
fn worst(scores: &[Score]) -> Score {
    let most = |of: fn(&Score) -> f32| scores.iter().map(of).fold(0.0, f32::max);
    Score {
        stretch: most(|s| s.stretch),
        longer: most(|s| s.longer),
        crossings: scores.iter().map(|s| s.crossings).max().unwrap_or(0),
    }
}

/// A row under [`HEAD`].
fn row(case: &Case, cloth: &Cloth, program: &str, moved: &Moved) -> String {
    let scores = scores(cloth, moved);
    let (most, end) = (worst(&scores), scores.last());
    let last = moved.samples.last().map_or(&[][..], Vec::as_slice);
    let nearest = case.ball.map(|(middle, radius)| {
        let of = |p: &Vec3| p.distance(middle) - radius;
        1e3 * moved.samples.iter().flatten().map(of).fold(f32::INFINITY, f32::min)
    });
    let shape = match nearest {
        Some(_) => format!("{:.2} m", last.iter().map(|p| p.y).fold(f32::INFINITY, f32::min)),
        None => format!("{:.0} %", 100.0 * drape::coefficient(last, &cloth.sheet.triangles)),
    };
    let [wall, cpu] = moved.milliseconds;
    format!(
        "{program} | {wall:.0} | {cpu:.0} | {:.1} | {:.1} | {:.1} | {} | {} | {} | {shape} |",
        100.0 * most.stretch,
        100.0 * most.longer,
        100.0 * end.map_or(0.0, |s| s.longer),
        most.crossings,
        end.map_or(0, |s| s.crossings),
        nearest.map_or("".into(), |d| format!("{d:.1}"))
    )
}

const HEAD: &str = "| scene | vertices | program | ms a frame | of processors | stretch, % | longer, % | in the end | crossings | in the end | \
     nearest, mm | drape or lowest |";

fn head(text: &str) {
    println!("{text}\n|{}", " --- |".repeat(text.matches('|').count() - 1));
}

/// All tables. `tools` are pairs of a word in the names of files and a name.
pub fn print(folder: &Path, tools: &[&str]) -> Result<()> {
    if let [.., word] = tools
        && tools.len() % 2 == 1
    {
        return Err(format!("'{word}': expected a name behind it, as in tables FOLDER [TOOL NAME]...").into());
    }
    head(HEAD);
    for case in cases::all() {
        let cloth = Cloth::new(case.sheet.clone(), &cases::fabric())?;
        let mut first = format!("| {} | {}", case.name, case.start.len());
        let mut put = |program: &str, moved: &Moved| {
            println!("{first} | {}", row(&case, &cloth, program, moved));
            first = "| |".into();
        };
        for (substeps, contact) in [(20, true), (20, false), (64, true)] {
            eprintln!("{}: Yugen", case.file);
            let (moved, substeps) = ours(&case, ball(&case), settings(substeps, contact), FRAMES)?;
            let touches = if contact { "" } else { ", not touching itself" };
            put(&format!("Yugen, {substeps} substeps{touches}"), &moved);
        }
        for tool in tools.chunks_exact(2) {
            if let Some(moved) = theirs(folder, &case, tool[0])? {
                put(tool[1], &moved);
            }
        }
    }
    println!();
    growth()?;
    println!();
    bodies()
}

/// The large sheet in more and more cells.
fn growth() -> Result<()> {
    head(
        "| vertices | substeps | ms a frame | of processors | μs a vertex | stretch, % | longer, % | crossings |",
    );
    for cells in [32, 64, 128, 224, 316] {
        eprintln!("growth: {cells} cells");
        let case = cases::sheets("", "", 1, 1.0, cells);
        let cloth = Cloth::new(case.sheet.clone(), &cases::fabric())?;
        let (moved, substeps) = ours(&case, ball(&case), settings(20, true), SHORT)?;
        let most = worst(&scores(&cloth, &moved));
        let [wall, cpu] = moved.milliseconds;
        println!(
            "| {} | {substeps} | {wall:.1} | {cpu:.1} | {:.2} | {:.1} | {:.1} | {} |",
            case.start.len(),
            1e3 * cpu / case.start.len() as f64,
            100.0 * most.stretch,
            100.0 * most.longer,
            most.crossings
        );
    }
    Ok(())
}

/// The small sheet on a ball that is a mesh of more and more triangles.
fn bodies() -> Result<()> {
    head("| body | seconds to make | ms a frame | of processors | nearest, mm |");
    let case = cases::sheets("", "", 1, 1.0, 64);
    let Some((middle, radius)) = case.ball else { return Ok(()) };
    let put = |name: &str, seconds: f64, body: Option<Solid>| -> Result<()> {
        let (moved, _) = ours(&case, body, settings(20, true), SHORT)?;
        let nearest =
            moved.samples.iter().flatten().map(|p| p.distance(middle) - radius).fold(f32::INFINITY, f32::min);
        let [wall, cpu] = moved.milliseconds;
        println!("| {name} | {seconds:.2} | {wall:.1} | {cpu:.1} | {:.1} |", 1e3 * nearest);
        Ok(())
    };
    put("a ball", 0.0, ball(&case))?;
    for rings in [16, 50, 160, 500] {
        eprintln!("body of {rings} rings");
        let (positions, triangles) = globe(radius, rings);
        let start = Instant::now();
        let field = Field::new(&positions, &triangles, radius / 48.0)?;
        let seconds = start.elapsed().as_secs_f64();
        put(&format!("{} triangles", triangles.len()), seconds, Some(Solid::Field(Arc::new(field))))?;
    }
    Ok(())
}

/// A ball around the origin in twice as many sectors as rings.
fn globe(radius: f32, rings: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let sectors = 2 * rings;
    let at = |i: u32, j: u32| {
        let (theta, phi) = (PI * i as f32 / rings as f32, PI * j as f32 / rings as f32);
        radius * Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos())
    };
    // The poles once.
    let index = |i: u32, j: u32| match i {
        0 => 0,
        i if i == rings => 1,
        i => 2 + (i - 1) * sectors + j % sectors,
    };
    let mut positions = vec![at(0, 0), at(rings, 0)];
    positions.extend((1..rings).flat_map(|i| (0..sectors).map(move |j| (i, j))).map(|(i, j)| at(i, j)));
    let mut triangles = Vec::new();
    for i in 0..rings {
        for j in 0..sectors {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend((i + 1 < rings).then_some([a, b, c]));
            triangles.extend((i > 0).then_some([a, c, d]));
        }
    }
    (positions, triangles)
}
