//! What a frame of cloth costs on the adapter, and on the processor.

use crate::Result;
use glam::{Vec2, Vec3};
use std::time::{Duration, Instant};
use yugen_motion::cloth::{Along, Cloth, PRESETS, Settings, Sheet, SmallSteps, Solid, Stance, Step};
use yugen_realtime::{ClothPass, Gpu};

/// Frames that are timed, a second of them.
const FRAMES: u32 = 60;
/// How long frames with contact are timed at the most.
const LONGEST: Duration = Duration::from_secs(240);

/// A square metre of silk that falls from the horizontal and swings from two corners, without contact of cloth with cloth, in the 20
/// substeps of the default, or as many as its bending asks for.
pub fn print(gpu: &Gpu, sides: &[u32]) -> Result<()> {
    println!("\ncells   vertices  substeps  springs at once  1 thread ms  2 threads ms  compute ms  apart m");
    for &cells in sides {
        let sheet = Sheet::rectangle(Vec3::ZERO, Vec3::X, Vec3::Z, Vec2::ONE, [cells; 2]);
        let held = [0, cells];
        let targets = held.map(|v| sheet.positions[v as usize]);
        let cloth = Cloth::new(sheet, &PRESETS[0].fabric)?;
        let make =
            |threads| SmallSteps::new(cloth.clone(), &held, Settings { threads, ..Settings::default() });
        let step = Step { targets: &targets, ..Step::default() };
        let mut first = make(1)?;
        let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &first)?;
        // The first frame warms up, and says how far both are apart.
        first.step(&step);
        pass.step(&step);
        let apart = |(a, b): (&Vec3, &Vec3)| a.distance(*b);
        let found = pass.read()?.positions;
        let apart = found.iter().zip(first.positions()).map(apart).fold(0.0, f32::max);
        let start = Instant::now();
        (0..FRAMES).for_each(|_| pass.step(&step));
        pass.read()?;
        let compute = start.elapsed();
        let of_processor = |mut solver: SmallSteps| {
            let start = Instant::now();
            (0..FRAMES).for_each(|_| solver.step(&step));
            start.elapsed()
        };
        let [one, two] = [of_processor(first), of_processor(make(2)?)];
        let ms = |time| ms(time, FRAMES);
        println!(
            "{cells:<6} {:>9} {:>9} {:>16} {:>12.2} {:>13.2} {:>11.2}  {apart:.1e}",
            found.len(),
            make(1)?.substeps(),
            pass.springs_at_once(),
            ms(one),
            ms(two),
            ms(compute),
        );
    }
    Ok(())
}

fn ms(time: Duration, frames: u32) -> f64 {
    time.as_secs_f64() * 1e3 / f64::from(frames)
}

/// Silk that falls on a ball and touches itself: for each of these cells along a side and sheets, one square metre or several of .6 m a side, 6 mm
/// apart. Worst of all frames: how much threads are too long, how many edges go through triangles, for how many pairs there was no room.
pub fn contact(gpu: &Gpu, heaps: &[[u32; 2]]) -> Result<()> {
    println!(
        "\nsheets  vertices  substeps  frames  1 thread ms  2 threads ms  compute ms  longer %, processor and compute  crossings of both  no room"
    );
    for &[cells, sheets] in heaps {
        let (size, radius) = if sheets == 1 { (1.0, 0.25) } else { (0.6, 0.15) };
        let mut heap = Sheet::default();
        for k in 0..sheets {
            let corner = Vec3::new(-0.5 * size, 0.01 + radius + 0.006 * k as f32, -0.5 * size);
            let mut sheet = Sheet::rectangle(corner, Vec3::Z, Vec3::X, Vec2::splat(size), [cells; 2]);
            sheet.flat.iter_mut().flatten().for_each(|p| p.x += 2.0 * k as f32);
            heap.join(sheet);
        }
        let cloth = Cloth::new(heap, &PRESETS[0].fabric)?;
        let make = |threads| {
            let settings = Settings { contact: true, lines: true, threads, ..Settings::default() };
            let ball = Solid::Capsule { ends: [Vec3::ZERO; 2], radii: [radius; 2] };
            SmallSteps::new(cloth.clone(), &[], settings)?.with_bodies(vec![(ball, Stance::default())])
        };
        let mut solvers = [make(1)?, make(2)?];
        let mut pass = ClothPass::new(&gpu.device, &gpu.queue, &solvers[0])?;
        let (mut times, mut computed, mut frames) = ([Duration::ZERO; 2], Duration::ZERO, 0);
        let (mut longer, mut crossed) = ([0.0f32; 2], [0; 2]);
        while frames < FRAMES && (frames == 0 || computed < LONGEST) {
            for (solver, time) in solvers.iter_mut().zip(&mut times) {
                let start = Instant::now();
                solver.step(&Step::default());
                *time += start.elapsed();
            }
            let start = Instant::now();
            pass.step(&Step::default());
            let found = pass.read()?.positions;
            computed += start.elapsed();
            for (k, x) in [solvers[0].positions(), &found].into_iter().enumerate() {
                longer[k] = longer[k].max(cloth.elongation(x, |s| s.along != Along::Bias));
                crossed[k] = crossed[k].max(cloth.crossings(x).len());
            }
            frames += 1;
        }
        println!(
            "{sheets:<6} {:>9} {:>9} {frames:>7} {:>12.2} {:>13.2} {:>11.2} {:>21.2} and {:.2} {:>17} and {} {:>8}",
            cloth.masses.len(),
            solvers[0].substeps(),
            ms(times[0], frames),
            ms(times[1], frames),
            ms(computed, frames),
            100.0 * longer[0],
            100.0 * longer[1],
            crossed[0],
            crossed[1],
            pass.missed()?,
        );
    }
    Ok(())
}
