//! The film of the demonstration: ten seconds of a player in gold brocade who dances by the light of fires.

use anyhow::{Context, Result};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use yugen_archive::formats::film::{self, Timing};
use yugen_archive::formats::image::WriteOptions;
use yugen_capture::weave::{Cloth, Fabric, Irregularity};
use yugen_motion::dance;
use yugen_motion::garment::{self, Fitting};
use yugen_noh::player::MASKS;
use yugen_noh::{Costume, FireLight, Hour, Performance, Robe, Stage};
use yugen_optics::ColourSpace;
use yugen_scene::Display;
use yugen_transport::render::{Action, Budget, Job, Options};

/// Its name.
pub const NAME: &str = "noh.apng";
/// Pixels.
pub const SIZE: [u32; 2] = [256, 144];
/// Frames a second, and all of them.
const RATE: f64 = 8.0;
const FRAMES: u32 = 80;
/// The dance, of that length, and its frames a second.
const DANCE: &str = "kamae seconds=.6\nhakobi steps=1 length=.24 seconds=.9\nsashikomi steps=1 seconds=.9\n\
                     hiraki steps=1 seconds=1\nsleeve side=left seconds=3.2\nkamae seconds=.6";
const MOTION: f64 = 60.0;
/// Edges of the robe's triangles, m.
const EDGE: f32 = 0.035;
/// Surfaces that reflect light on its way, and the most that a sample may add, cd/m²: few samples leave specks otherwise.
const BOUNCES: u32 = 2;
const CLAMP: f32 = 40.0;

/// Makes it in about so many seconds, or with so many samples a pixel.
pub fn film(out: &Path, seconds: f64, samples: Option<u32>) -> Result<()> {
    let clock = Instant::now();
    let units = dance::parse(DANCE)?;
    let moved = dance::dance(&units, MOTION).map_err(anyhow::Error::msg)?;
    let threads = yugen_optics::parallel::threads();
    let fitting = Fitting { edge: EDGE, threads, ..Fitting::default() };
    let costume = Costume::simulate(&garment::outfit("kosode", 1.0)?, &moved, &fitting, 2, |_| {
        ControlFlow::Continue(())
    })?;
    let stage = Stage::preset("national")?.with_player(&MASKS[0], kinran()?);
    let performance = Performance::new(stage, moved, costume)?;
    let mut scene = performance.scene(Hour::Night, FireLight::Flames)?;
    scene.cameras.retain(|c| c.name == "player");
    let camera = scene.cameras.first_mut().context("it is looked at")?;
    [camera.film.width, camera.film.height] = SIZE;
    scene.integrator.max_depth = Some(BOUNCES + 1);
    scene.integrator.clamp = Some(CLAMP);
    let made = clock.elapsed().as_secs_f64();
    println!("       {:<36} {made:5.1} s", "the robe, sewn and danced in");

    let frame = |scene: &yugen_scene::Scene, samples: u32| -> Result<Job> {
        let options = Options { budget: Some(Budget::Samples(samples)), denoise: true, ..Options::default() };
        let job = Job::new(scene, &options)?;
        job.run(|_, _| Action::Continue);
        Ok(job)
    };
    // By what the first frame takes with few.
    const TRIED: u32 = 4;
    let clock = Instant::now();
    let samples = match samples {
        Some(samples) => samples,
        None => {
            frame(&scene, TRIED)?;
            let each = seconds / f64::from(FRAMES);
            (f64::from(TRIED) * each / clock.elapsed().as_secs_f64()).clamp(4.0, 64.0) as u32
        }
    };
    let Display { exposure, curve, .. } = scene.display;
    let write = WriteOptions { curve, exposure, ..WriteOptions::from(scene.working_space) };
    film::write(&out.join(NAME), Timing { frames: FRAMES, rate: RATE }, &write, |film| {
        for k in 0..FRAMES {
            scene.pose(None, (f64::from(k) / RATE) as f32)?;
            let picture = frame(&scene, samples)?.denoised();
            film.add(&picture.select(&["R", "G", "B"]).context("a picture has colours")?)?;
        }
        anyhow::Ok(())
    })?;
    println!("       {NAME:<36} {:5.1} s, {samples} samples a pixel", clock.elapsed().as_secs_f64());
    Ok(())
}

/// Gold brocade, its figures three times as large as they are woven, so that they are seen.
fn kinran() -> Result<Robe> {
    let fabric = Fabric::preset("kinran", ColourSpace::default()).context("kinran is a preset")?;
    let (size, extent) = fabric.repeats([3, 2], 512);
    let maps = Cloth::weave(&fabric, size, extent, Irregularity::default(), 0).btf;
    let form = Robe::forms().next().context("the model has forms")?.0;
    Ok(Robe::new(Arc::new(maps), 0.09, form)?)
}
