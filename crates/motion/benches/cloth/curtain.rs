//! A square metre of cloth that falls from the horizontal and hangs, from an edge or two corners.

use crate::Result;
use crate::processor::processor;
use glam::{Vec2, Vec3};
use std::time::Instant;
use yugen_motion::cloth::{Along, Cloth, Fabric, PRESETS, Settings, Sheet, SmallSteps, Step};

const FRAMES: u32 = 300;

/// Prints the table; `words` are cells, substeps, threads and the fabric.
pub fn print(words: &[String]) -> Result<()> {
    let wrong = |word: &String, expected: &str| {
        format!(
            "'{word}': expected {expected}, as in [CELLS] [SUBSTEPS] [THREADS] [FABRIC], write FOLDER or tables FOLDER"
        )
    };
    let number = |i: usize, default: u32| match words.get(i) {
        Some(word) => word.parse().map_err(|_| wrong(word, "a number")),
        None => Ok(default),
    };
    let (cells, substeps, threads) = (number(0, 128)?, number(1, 20)?, number(2, 2)? as usize);
    let fabric = match words.get(3) {
        Some(name) => Fabric::preset(name).ok_or_else(|| wrong(name, "a fabric"))?,
        None => &PRESETS[0],
    };
    if let Some(more) = words.get(4) {
        return Err(wrong(more, "nothing more").into());
    }
    println!("{}, {threads} threads\n", fabric.name);
    println!(
        "| hangs from | coarse levels | lines | vertices | substeps | ms a frame | of processors | stretch p99.9 | worst |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let rows = [
        ("an edge", true, true),
        ("an edge", true, false),
        ("an edge", false, false),
        ("two corners", true, true),
        ("two corners", true, false),
    ];
    for (held, coarse, lines) in rows {
        let corner = Vec3::new(-0.5, 2.0, 0.0);
        let sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::ONE, [cells, cells]);
        let attached: Vec<u32> = if held == "an edge" { (0..=cells).collect() } else { vec![0, cells] };
        let targets: Vec<Vec3> = attached.iter().map(|v| sheet.positions[*v as usize]).collect();
        let cloth = Cloth::new(sheet, &fabric.fabric).expect("a rectangle is a cloth");
        let settings = Settings { substeps, coarse, lines, threads, ..Settings::default() };
        let mut solver = SmallSteps::new(cloth, &attached, settings).expect("its corners are its own");
        let (mut wall, mut cpu, mut worst) = (0.0, 0.0, [0.0f32; 2]);
        for frame in 0..FRAMES {
            let (start, before) = (Instant::now(), processor());
            solver.step(&Step { targets: &targets, ..Step::default() });
            (wall, cpu) = (wall + start.elapsed().as_secs_f64(), cpu + processor() - before);
            if frame % 10 == 9 {
                let s = solver.cloth().stretch(solver.positions(), |a| a != Along::Bias);
                worst = [worst[0].max(s.p999), worst[1].max(s.worst)];
            }
        }
        let per = |seconds: f64| seconds / f64::from(FRAMES) * 1e3;
        println!(
            "| {held} | {} | {} | {} | {} | {:.2} | {:.2} | {:.2} % | {:.1} % |",
            if coarse { "yes" } else { "no" },
            if lines { "yes" } else { "no" },
            solver.positions().len(),
            solver.substeps(),
            per(wall),
            per(cpu),
            worst[0] * 100.0,
            worst[1] * 100.0
        );
    }
    Ok(())
}
