//! A player who dances twelve seconds, or longer in rounds, in a karaori or in other garments, one after the other: how the cloth keeps, and how long it takes.
//!
//! `cargo bench -p yugen-motion --bench robe -- [EDGE] [SECONDS] [THREADS] [SUBSTEPS] [GARMENT]...`: triangles of EDGE metres. Wall and
//! processor milliseconds a frame, the latter in a last table also to those of the first garment; and over all frames after dressing, of every tenth: edges that pass through triangles at the most; the
//! least distance of a vertex from the body; how much longer than they are threads become, 99.9 of 100 by less, without those
//! under the belt; then the root mean square of speeds in the end, with 12.75 seconds two after the body came to rest, and below it those
//! that half and nine of ten vertices do not reach.

mod processor;
#[path = "../tests/worn/mod.rs"]
mod worn;

use glam::Vec3;
use processor::processor;
use std::ops::ControlFlow;
use std::time::Instant;
use worn::{longer, nearest};
use yugen_motion::dance::{self, dance};
use yugen_motion::garment::{Body, Costume, Fitting, outfit};
use yugen_motion::{RigidPose, SkeletalMotion};

/// Its last two seconds are the stance; then it begins anew.
const DANCE: &str = "kamae seconds=.5\nhakobi steps=2 seconds=.8\nsashikomi steps=1\nturn degrees=90 seconds=.9\nsleeve seconds=2.7\nkamae seconds=3";

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let number = |i: usize, default: f32| match words.get(i) {
        Some(word) => word.parse().map_err(|_| {
            format!("'{word}': expected a number, as in [EDGE] [SECONDS] [THREADS] [SUBSTEPS] [GARMENT]...")
        }),
        None => Ok(default),
    };
    let (edge, seconds, threads) = (number(0, 0.02)?, number(1, 12.0)?, number(2, 2.0)? as usize);
    let texts = words
        .get(4..)
        .filter(|w| !w.is_empty())
        .map_or(vec!["kosode"], |w| w.iter().map(String::as_str).collect());
    let body = Body::player();
    let rounds = |count: usize| {
        let units = dance::parse(&vec![DANCE; count].join("\n")).expect("a dance");
        dance(&units, 60.0).expect("a dance")
    };
    let mut motion = rounds(1);
    let count = (f64::from(seconds) * motion.rate / motion.frames as f64).ceil();
    if count > 1.0 {
        motion = rounds(count as usize);
    }
    let fitting = Fitting { edge, threads, substeps: number(3, 64.0)? as u32, ..Fitting::default() };
    let rows = texts
        .into_iter()
        .map(|text| measure(text, &body, &motion, &fitting, seconds))
        .collect::<Result<Vec<Row>>>()?;
    println!(
        "\n| worn | vertices | crossings dressed | in the dance | longer p99.9 | processor ms a frame | to the first |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for row in &rows {
        println!(
            "| {} | {} | {} | {} | {:.1} % | {:.1} | {:.2} |",
            row.worn,
            row.vertices,
            row.dressed,
            row.danced,
            row.longer * 100.0,
            row.ms,
            row.ms / rows[0].ms
        );
    }
    Ok(())
}

/// What is found of an outfit.
struct Row {
    worn: String,
    vertices: usize,
    dressed: usize,
    danced: usize,
    longer: f32,
    ms: f64,
}

fn measure(text: &str, body: &Body, motion: &SkeletalMotion, fitting: &Fitting, seconds: f32) -> Result<Row> {
    let garments = outfit(text, 1.0)?;
    let (start, before) = (Instant::now(), processor());
    let approach = |t: f32| motion.approach(t).expect("joints of a dance");
    let mut costume = Costume::dress(&garments, body, fitting, approach, |_| ControlFlow::Continue(()))?;
    let worn = costume.garments().iter().map(|g| g.0.as_str()).collect::<Vec<_>>().join(", ");
    let dressed = costume.solver().cloth().crossings(costume.solver().positions()).len();
    println!(
        "\n{} vertices of {worn}, {} threads, {} substeps; dressed in {:.1} s, {:.1} of processors, with {} crossings",
        costume.solver().positions().len(),
        fitting.threads,
        costume.solver().substeps(),
        start.elapsed().as_secs_f64(),
        processor() - before,
        dressed
    );
    println!("\n| s | ms a frame | of processors | crossings | nearest, mm | longer p99.9 | rms, m/s |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let frames = motion.frames.min((seconds * 60.0) as usize);
    let (mut crossed, mut least, mut worst) = (0, f32::INFINITY, 0.0f32);
    let (mut wall, mut cpu) = (0.0, 0.0);
    let (mut before_it, mut moved) = (approach(1.0), 0);
    for frame in 0..frames {
        let poses = motion.poses(frame).expect("a pose");
        let (start, before) = (Instant::now(), processor());
        costume.step(&poses, Vec3::ZERO);
        (wall, cpu) = (wall + start.elapsed().as_secs_f64(), cpu + processor() - before);
        let far = |(a, b): (&RigidPose, &RigidPose)| a.position.distance(b.position);
        // By more than a millimetre a second.
        if poses.iter().zip(&before_it).map(far).fold(0.0, f32::max) > 1e-3 / 60.0 {
            moved = frame + 1;
        }
        before_it = poses;
        if frame % 10 == 9 {
            let x = costume.solver().positions();
            assert!(x.iter().all(|p| p.is_finite()), "frame {frame}");
            crossed = crossed.max(costume.solver().cloth().crossings(x).len());
            least = least.min(nearest(&costume, body));
            worst = worst.max(longer(&costume));
        }
        if frame % 60 == 59 || frame + 1 == frames {
            let v: f32 = costume.solver().velocities().map(|v| v.length_squared()).sum();
            let rms = (v / costume.solver().positions().len() as f32).sqrt();
            let done = (frame + 1) as f64 / 1e3;
            println!(
                "| {:.0} | {:.1} | {:.1} | {crossed} | {:.2} | {:.1} % | {rms:.4} |",
                (frame + 1) as f32 / 60.0,
                wall / done,
                cpu / done,
                least * 1e3,
                worst * 100.0
            );
        }
    }
    let mut speeds: Vec<f32> = costume.solver().velocities().map(Vec3::length).collect();
    speeds.sort_unstable_by(f32::total_cmp);
    let [half, most] = [5, 9].map(|tenths| speeds[(speeds.len() - 1) * tenths / 10] * 1e3);
    let rest = (frames - moved) as f32 / 60.0;
    println!(
        "\nspeeds in the end, {rest:.2} s after the body came to rest: half below {half:.2} mm/s, nine of ten below {most:.2} mm/s"
    );
    let ms = cpu * 1e3 / frames.max(1) as f64;
    let vertices = costume.solver().positions().len();
    Ok(Row { worn, vertices, dressed, danced: crossed, longer: worst, ms })
}
