//! What a frame of cloth costs on the adapter, and on the processor.

use crate::Result;
use glam::{Vec2, Vec3};
use std::time::Instant;
use yugen_motion::cloth::{Cloth, PRESETS, Settings, Sheet, SmallSteps, Step};
use yugen_realtime::{ClothPass, Gpu};

/// Frames that are timed, a second of them.
const FRAMES: u32 = 60;

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
        let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3 / f64::from(FRAMES);
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
