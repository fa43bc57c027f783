//! A square metre of cloth that falls from the horizontal and hangs, from an edge or two corners.

use crate::processor;
use glam::{Vec2, Vec3};
use std::time::Instant;
use yugen_motion::cloth::{Along, Cloth, Fabric, PRESETS, Settings, Sheet, SmallSteps, Step};

const FRAMES: u32 = 300;

/// Prints the table; `words` are cells, substeps, threads and the fabric.
pub fn print(words: &[String]) {
    let number = |i: usize, default: u32| words.get(i).and_then(|w| w.parse().ok()).unwrap_or(default);
    let (cells, substeps, threads) = (number(0, 128), number(1, 20), number(2, 2) as usize);
    let fabric = words.get(3).and_then(|name| Fabric::preset(name)).unwrap_or(&PRESETS[0]);
    println!("{}, {threads} threads\n", fabric.name);
    println!(
        "| hangs from | coarse levels | vertices | substeps | ms a frame | of processors | stretch p99.9 | worst |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (held, coarse) in [("an edge", true), ("an edge", false), ("two corners", true)] {
        let corner = Vec3::new(-0.5, 2.0, 0.0);
        let sheet = Sheet::rectangle(corner, Vec3::X, Vec3::Z, Vec2::ONE, [cells, cells]);
        let attached: Vec<u32> = if held == "an edge" { (0..=cells).collect() } else { vec![0, cells] };
        let targets: Vec<Vec3> = attached.iter().map(|v| sheet.positions[*v as usize]).collect();
        let cloth = Cloth::new(sheet, &fabric.fabric).expect("a rectangle is a cloth");
        let settings = Settings { substeps, coarse, threads, ..Settings::default() };
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
            "| {held} | {} | {} | {} | {:.2} | {:.2} | {:.2} % | {:.1} % |",
            if coarse { "yes" } else { "no" },
            solver.positions().len(),
            solver.substeps(),
            per(wall),
            per(cpu),
            worst[0] * 100.0,
            worst[1] * 100.0
        );
    }
}
