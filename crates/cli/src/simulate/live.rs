//! Cloth that is simulated in the window while it is looked at.

use super::AFRESH;
use super::dressed::wearer;
use super::subject::{Subject, Task};
use crate::render::interrupt::Interrupt;
use anyhow::{Context, Result};
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};
use yugen_motion::cloth::{MOST_WIND, PRESETS};
use yugen_noh::ROBE;
use yugen_optics::{Mat4, Vec3};
use yugen_reflectance::Kind;
use yugen_scene::{Geometry, MaterialId, Mesh, ModelBuilder, Part, Scene, Shape};
use yugen_view::live::{ClothSettings, Live};

/// Numbers of memories that are kept to go back to: 256 MiB.
const KEPT: usize = 1 << 26;

/// A simulation, and where its cloth is in the scene.
pub struct LiveCloth {
    task: Task,
    /// As it was read.
    scene: Scene,
    subject: Box<dyn Subject + Send>,
    settings: ClothSettings,
    frame: u32,
    /// Frames to which it can go back, first the beginning.
    memories: Vec<(u32, Vec<f32>)>,
    /// Caches of the scene, and which vertices each moves.
    caches: Vec<(usize, Range<usize>)>,
    clip: Option<String>,
}

impl LiveCloth {
    /// Begins it, and puts its cloth into the scene: in the place of what is cloth there, of a garment in that of one that has the same name and a
    /// cache, else as another shape.
    pub fn new(task: Task, scene: &mut Scene, interrupt: &Interrupt) -> Result<Self> {
        let subject = task.begin(scene.clone(), None, interrupt)?;
        let options = &task.options;
        // Of the figure that would wear a garment; all figures move by its name.
        let clip = wearer(scene, options.animation.as_deref()).map(|(f, clip)| f.clips[clip].name.clone());
        let settings =
            ClothSettings { fabric: options.fabric.clone(), wind: options.wind.unwrap_or(Vec3::ZERO) };
        let memories = vec![(0, subject.memory())];
        let read = scene.clone();
        let caches = put(&*subject, scene, options.fps)?;
        Ok(Self { task, scene: read, subject, settings, frame: 0, memories, caches, clip })
    }

    /// The same cloth of another fabric, from where it is.
    fn change(&mut self, settings: &ClothSettings) -> Result<()> {
        if settings.fabric != self.settings.fabric {
            self.task.options.fabric.clone_from(&settings.fabric);
            let memory = self.subject.memory();
            self.subject = self.task.begin(self.scene.clone(), Some(&memory), &Interrupt::never())?;
        }
        self.subject.blow(settings.wind);
        self.settings = settings.clone();
        // What followed from here came of other settings; what was before stays as it was.
        self.memories.retain(|(frame, _)| *frame <= self.frame);
        Ok(())
    }

    /// Goes back to the last frame before `frame` that is remembered.
    fn go_back(&mut self, frame: u32) -> Result<()> {
        let last = self.memories.iter().rev().find(|(kept, _)| *kept <= frame);
        let (kept, memory) = last.or(self.memories.first()).context("the beginning is remembered")?;
        anyhow::ensure!(self.subject.recall(memory), "the cloth is another one than at its beginning");
        self.frame = *kept;
        Ok(())
    }

    fn step(&mut self) -> Result<()> {
        // As `yugen simulate` does, so that both come to the same bits.
        if self.frame.is_multiple_of(AFRESH) {
            self.subject.search_anew();
            let memory = self.subject.memory();
            let room = (KEPT / memory.len().max(1)).max(2);
            if self.memories.last().is_some_and(|(frame, _)| *frame < self.frame) {
                if self.memories.len() >= room {
                    self.memories.remove(1);
                }
                self.memories.push((self.frame, memory));
            }
        }
        self.frame += 1;
        self.subject.step(self.frame)
    }

    fn go_to(&mut self, seconds: f32, settings: &ClothSettings, within: Duration) -> Result<f32> {
        if *settings != self.settings {
            self.change(settings)?;
        }
        let frame = (f64::from(seconds) * self.task.options.fps).round().clamp(0.0, 1e6) as u32;
        if frame < self.frame {
            self.go_back(frame)?;
        }
        let started = Instant::now();
        while self.frame < frame {
            self.step()?;
            if started.elapsed() >= within {
                break;
            }
        }
        Ok(match self.frame < frame {
            true => (f64::from(self.frame) / self.task.options.fps) as f32,
            false => seconds,
        })
    }
}

impl Live for LiveCloth {
    fn clip(&self) -> Option<String> {
        self.clip.clone()
    }

    fn rate(&self) -> f64 {
        self.task.options.fps
    }

    fn settings(&self) -> ClothSettings {
        self.settings.clone()
    }

    fn fabrics(&self) -> Vec<&'static str> {
        PRESETS.iter().map(|p| p.name).collect()
    }

    fn most_wind(&self) -> f32 {
        MOST_WIND
    }

    fn play(
        &mut self,
        scene: &mut Scene,
        seconds: f32,
        settings: &ClothSettings,
        within: Duration,
    ) -> Result<f32, String> {
        let reached = self.go_to(seconds, settings, within).map_err(|e| format!("{e:#}"))?;
        let points = self.subject.points();
        for (cache, range) in &self.caches {
            scene.set_sample(*cache, points[range.clone()].to_vec()).map_err(|e| e.to_string())?;
        }
        Ok(reached)
    }
}

/// Puts cloth into a scene as meshes with caches of one sample; which cache moves which of its vertices.
fn put(subject: &dyn Subject, scene: &mut Scene, fps: f64) -> Result<Vec<(usize, Range<usize>)>> {
    let surface = subject.surface();
    let points = subject.points();
    let normals = surface.normals(&points);
    let known = subject.shapes();
    let outermost = surface.objects.len().saturating_sub(1);
    let mut first = 0;
    let mut made = Vec::new();
    for (k, (name, count)) in surface.objects.iter().enumerate() {
        let range = first..first + count;
        first = range.end;
        let own = |t: &&[u32; 3]| range.contains(&(t[0] as usize));
        let worn = |s: &str| s == name || (k == outermost && s == ROBE);
        let cached = || scene.caches.iter().map(|c| c.shape()).find(|s| worn(&scene.shapes[*s].name));
        let shape = known.get(k).copied().or_else(cached);
        // A mesh without normals has facets, as with a cache.
        let facets = shape.is_some_and(
            |s| matches!(&scene.shapes[s].geometry, Geometry::Mesh(mesh) if mesh.normals.is_empty()),
        );
        let mesh = Mesh {
            name: name.clone(),
            positions: points[range.clone()].to_vec(),
            normals: if facets { Vec::new() } else { normals[range.clone()].to_vec() },
            uvs: surface.uvs.get(range.clone()).map_or(Vec::new(), <[_]>::to_vec),
            triangles: surface
                .triangles
                .iter()
                .filter(own)
                .map(|t| t.map(|v| v - range.start as u32))
                .collect(),
            ..Mesh::default()
        };
        let geometry = Geometry::Mesh(Arc::new(mesh));
        let shape = match shape {
            Some(shape) => {
                let old = &mut scene.shapes[shape];
                (old.geometry, old.to_world) = (geometry, Mat4::IDENTITY);
                shape
            }
            None => {
                let material = charmeuse(scene)?;
                scene.shapes.push(Shape::new(name, geometry, Mat4::IDENTITY, material));
                scene.shapes.len() - 1
            }
        };
        made.push((shape, range));
    }
    let moved = |shape: usize| made.iter().any(|(own, _)| *own == shape);
    scene.caches.retain(|c| !moved(c.shape()));
    // What holds it is known to the simulation.
    for figure in &mut scene.figures {
        let figure = Arc::make_mut(figure);
        figure.attachments.retain(|a| !matches!(a.part, Part::Shape { shape, .. } if moved(shape)));
        figure.deformed.retain(|d| !moved(d.shape));
    }
    let mut caches = Vec::new();
    for (shape, range) in made {
        caches.push((scene.caches.len(), range.clone()));
        scene.add_cache(shape, Arc::new([points[range].to_vec()]), fps, 0.0, Mat4::IDENTITY)?;
    }
    Ok(caches)
}

/// What a garment is made of that the scene has no cloth for: both sides of charmeuse.
fn charmeuse(scene: &mut Scene) -> Result<MaterialId> {
    let charmeuse =
        ModelBuilder::preset(Kind::Microcylinder, "polyester_satin_charmeuse", scene.working_space)?
            .build()?;
    scene.materials.push(charmeuse);
    Ok(scene.materials.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::super::options::ClothOptions;
    use super::*;
    use clap::{Args, Command, FromArgMatches};
    use std::path::PathBuf;
    use yugen_realtime::Gpu;
    use yugen_scene::{Material, Value};

    /// A rectangle that hangs by a corner, and how it is simulated.
    fn flag(more: &[&str]) -> (Scene, Task) {
        let to_world = Mat4::from_translation(Vec3::Y);
        let shape = Shape::new("flag", Geometry::Rectangle, to_world, 0);
        let scene = Scene {
            shapes: vec![shape],
            materials: vec![Material::lambert(Value::Number(0.5))],
            ..Scene::default()
        };
        let words = ["", "--cloth", "flag", "--pin", "-1,2,0,.05", "--fabric", "silk", "--threads", "1"];
        let words = words.iter().chain(more);
        let parsed = ClothOptions::augment_args(Command::new("")).get_matches_from(words);
        let options = ClothOptions::from_arg_matches(&parsed).expect("options");
        (scene, Task { options, file: PathBuf::from("flag.toml"), frames: None, quiet: true })
    }

    #[test]
    fn frames_are_those_of_simulate_also_after_going_back() {
        let (mut scene, task) = flag(&[]);
        let never = Interrupt::never();
        let mut subject = task.begin(scene.clone(), None, &never).expect("cloth");
        let mut live = LiveCloth::new(task, &mut scene, &never).expect("cloth");
        assert!(live.clip().is_none() && scene.caches.len() == 1 && scene.clips().len() == 1);
        let mut frames = vec![subject.points()];
        for frame in 0..45 {
            if frame % AFRESH == 0 {
                subject.search_anew();
            }
            subject.step(frame + 1).expect("a step");
            frames.push(subject.points());
        }
        let own = live.settings();
        let windy = ClothSettings { wind: Vec3::new(0.0, 0.0, 3.0), ..own.clone() };
        let mut at = |frame: u32, settings: &ClothSettings, within: Duration| {
            let seconds = frame as f32 / 60.0;
            let reached = live.play(&mut scene, seconds, settings, within).expect("it moves");
            (reached, scene.caches[0].samples()[0].clone())
        };
        for frame in [0, 40, 31, 5, 45] {
            let (reached, points) = at(frame, &own, Duration::MAX);
            assert!(reached == frame as f32 / 60.0 && points == frames[frame as usize], "frame {frame}");
        }
        // Another wind begins where it is, and nothing of it is left when time goes back before it.
        at(20, &own, Duration::MAX);
        assert!(at(44, &windy, Duration::MAX).1 != frames[44]);
        at(0, &windy, Duration::MAX);
        assert!(at(44, &own, Duration::MAX).1 == frames[44]);
        let hemp = ClothSettings { fabric: "hemp".into(), ..own.clone() };
        assert!(at(44, &hemp, Duration::MAX).1 == frames[44], "it is where it was");
        assert!(at(45, &hemp, Duration::MAX).1 != frames[45]);
        // Without time one frame is computed, and it says so.
        at(0, &own, Duration::MAX);
        let (reached, points) = at(10, &own, Duration::ZERO);
        assert!(reached == 1.0 / 60.0 && points == frames[1]);
    }

    #[test]
    fn it_goes_back_on_the_gpu_to_the_same_frames() {
        if Gpu::for_tests().is_none() {
            return;
        }
        let (mut scene, task) = flag(&["--gpu", "--substeps", "4"]);
        let (_, processor) = flag(&["--substeps", "4"]);
        let never = Interrupt::never();
        let mut other = LiveCloth::new(processor, &mut scene.clone(), &never).expect("cloth");
        let mut live = LiveCloth::new(task, &mut scene, &never).expect("cloth");
        let settings = live.settings();
        let mut frames = Vec::new();
        for frame in [4, 8, 4, 0, 8] {
            let seconds = frame as f32 / 60.0;
            live.play(&mut scene, seconds, &settings, Duration::MAX).expect("it moves");
            frames.push(scene.caches[0].samples()[0].clone());
        }
        assert!(frames[0] == frames[2] && frames[1] == frames[4]);
        other.go_to(8.0 / 60.0, &settings, Duration::MAX).expect("it moves");
        let its = other.subject.points();
        let apart = frames[1].iter().zip(&its).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        println!("{apart:.2e} m from the processor");
        let fallen = frames[1].iter().zip(&frames[3]).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(apart > 0.0 && apart < 1e-3 && fallen > 0.05, "{apart} {fallen}");
    }
}
