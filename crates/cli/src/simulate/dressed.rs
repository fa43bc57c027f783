//! A garment cut from a text, on a figure that moves.

use super::options::GIRTH;
use super::output::Surface;
use super::subject::{Subject, Task};
use crate::render::interrupt::{self, Interrupt};
use crate::{argument, progress};
use anyhow::{Context, Result, bail};
use std::ops::ControlFlow;
use std::sync::Arc;
use yugen_motion::cloth::rows::Now;
use yugen_motion::cloth::{Fabric, SmallSteps, Spring, Step};
use yugen_motion::garment::{Body, Costume, Fitting, GarmentError, Overlap, Wearer};
use yugen_motion::{RigidPose, rigid};
use yugen_optics::{Mat4, Vec3};
use yugen_scene::{Figure, Scene, suggest};

/// A garment that a figure wears.
pub struct Dressed {
    figure: Arc<Figure>,
    clip: usize,
    fps: f64,
    wearer: Wearer,
    costume: Costume,
    surface: Surface,
    wind: Vec3,
}

/// The figure that plays an animation of this name, its first where none is given, and has the most joints; and which of its animations that is.
pub fn wearer(scene: &Scene, animation: Option<&str>) -> Option<(Arc<Figure>, usize)> {
    let playing = scene.figures.iter().filter_map(|f| Some((f.clone(), f.plays(animation)?)));
    playing.max_by_key(|(f, _)| f.skeleton.joints().len())
}

/// Where the joints of a figure are in the world.
fn world(figure: &Figure, joints: &[Mat4]) -> Vec<Mat4> {
    joints.iter().map(|m| figure.to_world * *m).collect()
}

impl Dressed {
    /// The figure of the scene that has the most joints, in its garment; from a memory where there is one.
    pub fn new(
        task: &Task,
        text: &str,
        scene: &Scene,
        fabric: &Fabric,
        memory: Option<&[f32]>,
        interrupt: &Interrupt,
    ) -> Result<Self> {
        let options = &task.options;
        let name = options.animation.as_deref();
        let Some((figure, clip)) = wearer(scene, name) else {
            let file = task.file.display();
            match &options.animation {
                Some(name) => {
                    let all = scene.clips();
                    let hint = suggest(name, all.iter().map(|(n, _)| n.as_str()));
                    bail!("there is no animation called '{name}' in {file}{hint}")
                }
                None => bail!("nobody in {file} could wear a garment: it has no skeleton that moves"),
            }
        };
        let still = figure.skeleton.to_skeleton(&figure.skeleton.rest())?;
        let still = world(&figure, &still);
        let rest = rigid(&still);
        // From 0 s on, where the scene that wears it begins, whenever the clip has its first key.
        let first = poses(&figure, clip, 0.0)?;
        let cannot = || {
            format!(
                "the figure of {} cannot wear a garment (--joint says which joint is what; yugen motion solve makes a skeleton of markers \
                 and rigid bodies)",
                task.file.display()
            )
        };
        let mut wearer = Wearer::new(&figure.skeleton, &rest, &first, &options.joint).with_context(cannot)?;
        wearer.fill(skin(&figure, &still, &rest));
        if last_frame(&figure, clip, options.fps) > 0 {
            wearer
                .begin_moving(&poses(&figure, clip, (1.0 / options.fps) as f32)?, (1.0 / options.fps) as f32);
        }
        if let Some(girth) = options.girth {
            wearer.body = wearer.body.thicker(girth);
        }
        let garments = argument::outfit(text, wearer.size)?;
        let defaults = Fitting::default();
        let fitting = Fitting {
            edge: 1e-3 * options.edge.unwrap_or(25.0),
            fabric: *fabric,
            seconds: (1.0 / options.fps) as f32,
            substeps: options.substeps.unwrap_or(defaults.substeps),
            threads: argument::threads(options.threads),
            floor: Some(options.ground.unwrap_or(wearer.sole())),
            ..defaults
        };
        let frames = last_frame(&figure, clip, options.fps) + 1;
        let span = task.frames.unwrap_or(frames).min(frames);
        let of = |frame: u32| {
            let mut poses = poses(&figure, clip, (f64::from(frame) / options.fps) as f32)?;
            wearer.own(&mut poses);
            Ok(poses)
        };
        if memory.is_none() {
            let arm_gap = fitting.arm_gap(&garments);
            tell_overlap(&wearer.body, options.girth.unwrap_or(1.0), &figure, span, arm_gap, of, interrupt)?;
        }
        let costume = match memory {
            Some(memory) => {
                Costume::recall(&garments, &wearer.body, &fitting, &wearer.approach(0.0), memory)?
                    .context("the checkpoint is of another garment; --restart throws it away")?
            }
            None => {
                let bar = progress::bar(1000, task.quiet);
                bar.set_message("putting it on");
                let dressed = Costume::dress(
                    &garments,
                    &wearer.body,
                    &fitting,
                    |t| wearer.approach(t),
                    |done| {
                        bar.set_position((1e3 * done) as u64);
                        if interrupt.came() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                    },
                );
                bar.finish_and_clear();
                if matches!(dressed, Err(GarmentError::Stopped)) {
                    stop();
                }
                let mut costume = dressed?;
                // Into the movement of the first frame.
                let steps = (f64::from(wearer.leads()) * options.fps).round() as u32;
                let wind = wearer.own_direction(options.wind.unwrap_or(Vec3::ZERO));
                for before in (0..steps).rev() {
                    if interrupt.came() {
                        stop();
                    }
                    costume.step(&wearer.lead((f64::from(before) / options.fps) as f32), wind);
                }
                let crossed = costume.solver().cloth().crossings(costume.solver().positions()).len();
                if crossed > 0 {
                    tracing::warn!(
                        "{crossed} edges of the garment pass through triangles where it is put on: it is tight there; smaller \
                         triangles (--edge) or a thinner body (--girth) may help"
                    );
                }
                costume
            }
        };
        let cut = costume.cut();
        let surface = Surface {
            objects: costume.garments().to_vec(),
            uvs: cut.uvs.clone(),
            triangles: cut.triangles.clone(),
            vertex: cut.vertex.iter().map(|v| Some(*v)).collect(),
            sheet: cut.sheet.triangles.clone(),
            scale: None,
        };
        let wind = wearer.own_direction(options.wind.unwrap_or(Vec3::ZERO));
        Ok(Self { figure, clip, fps: options.fps, wearer, costume, surface, wind })
    }

    /// Joints in a frame, in the wearer's own coordinates.
    fn poses(&self, frame: u32) -> Result<Vec<RigidPose>> {
        let mut poses = poses(&self.figure, self.clip, (f64::from(frame) / self.fps) as f32)?;
        self.wearer.own(&mut poses);
        Ok(poses)
    }
}

/// Ends the program before anything is written.
fn stop() -> ! {
    eprintln!(
        "interrupted while the garment was put on: nothing is written, and nothing can be gone on with"
    );
    std::process::exit(interrupt::STATUS)
}

/// Joints of a figure at a moment of a clip, in the world.
fn poses(figure: &Figure, clip: usize, seconds: f32) -> Result<Vec<RigidPose>> {
    let joints = figure.skeleton.to_skeleton(&figure.clips[clip].pose(&figure.skeleton, seconds))?;
    Ok(rigid(&world(figure, &joints)))
}

/// The last frame of a clip.
fn last_frame(figure: &Figure, clip: usize, fps: f64) -> u32 {
    let [_, last] = figure.clips[clip].span();
    (f64::from(last) * fps + 1e-3).floor().clamp(0.0, 1e6) as u32
}

/// So deep an arm lies in a trunk before it is said, m: less is what any two capsules do not tell exactly.
const DEEP: f32 = 0.01;

/// A girth that is told is a multiple of this.
const GIRTH_STEP: f32 = 0.05;

/// Says where arms lie in the trunk of a body that is `given` times as thick as its mesh, which cloth between them has no place in.
fn tell_overlap(
    body: &Body,
    given: f32,
    figure: &Figure,
    frames: u32,
    arm_gap: f32,
    poses: impl Fn(u32) -> Result<Vec<RigidPose>>,
    interrupt: &Interrupt,
) -> Result<()> {
    let asked = || {
        if interrupt.came() {
            stop()
        }
    };
    let mut deep: Vec<(u32, Overlap)> = Vec::new();
    let mut left = (0, 0.0f32);
    for frame in 0..frames {
        asked();
        let mut poses = poses(frame)?;
        deep.extend(body.overlap(&poses, 0.0).filter(|o| o.depth > DEEP).map(|found| (frame, found)));
        body.clear_arms(&mut poses, arm_gap);
        if let Some(found) = body.overlap(&poses, 0.0).filter(|o| o.depth > left.1) {
            left = (frame, found.depth);
        }
    }
    let count = deep.len();
    // Deepest first, where what is too thick shows at once.
    deep.sort_by(|a, b| b.1.depth.total_cmp(&a.1.depth));
    let Some((frame, found)) = deep.first().copied() else { return Ok(()) };
    // The thickest body of which no arm lies deep in the trunk.
    let mut cure = None;
    let steps = 0..=(GIRTH.end() / GIRTH_STEP).round() as u32;
    let girths = steps.rev().map(|k| k as f32 * GIRTH_STEP);
    for girth in girths.filter(|g| GIRTH.contains(g) && *g < given) {
        let thinner = body.thicker(girth / given);
        let mut fits = true;
        for (frame, _) in &deep {
            asked();
            fits &= thinner.overlap(&poses(*frame)?, 0.0).is_none_or(|o| o.depth <= DEEP);
            if !fits {
                break;
            }
        }
        if fits {
            cure = Some(girth);
            break;
        }
    }
    let name = |joint: usize| figure.skeleton.joints()[joint].name.as_str();
    let cure =
        cure.map_or(String::new(), |girth| format!("; --girth {girth:.2} makes a figure of which none does"));
    tracing::warn!(
        "'{}' lies up to {:.1} cm in the body at '{}', most in frame {frame}, and more than {:.0} cm in {count} of {frames} \
         frames: for the garment it is moved out{cure}",
        name(found.arm),
        found.depth * 100.0,
        name(found.within),
        DEEP * 100.0
    );
    if left.1 > DEEP {
        tracing::warn!(
            "an arm stays {:.1} cm in the body in frame {}: cloth between them passes through itself",
            left.1 * 100.0,
            left.0
        );
    }
    Ok(())
}

/// Vertices of what hangs on the joints of a figure that stands still, each at the joint that bends it most.
fn skin<'a>(
    figure: &'a Figure,
    still: &'a [Mat4],
    rest: &'a [RigidPose],
) -> impl Iterator<Item = (usize, Vec3)> + 'a {
    let skinned = figure
        .deformed
        .iter()
        .filter_map(|d| d.skin.as_ref().map(|(skin, by)| (d, &figure.skins[*skin], by)));
    skinned.flat_map(move |(deformed, skin, influences)| {
        let each = deformed.rest.positions.iter().zip(influences.strongest());
        each.filter_map(move |(p, k)| {
            let joint = *skin.joints.get(k)?;
            let bind = skin.inverse_bind.get(k).copied().unwrap_or(Mat4::IDENTITY);
            let at = still[joint].transform_point3(bind.transform_point3(*p));
            Some((joint, rest[joint].rotation.inverse() * (at - rest[joint].position)))
        })
    })
}

impl Subject for Dressed {
    fn surface(&self) -> &Surface {
        &self.surface
    }

    fn solver(&self) -> &SmallSteps {
        self.costume.solver()
    }

    fn memory(&self) -> Vec<f32> {
        self.costume.memory()
    }

    fn recall(&mut self, memory: &[f32]) -> bool {
        self.costume.restore(memory)
    }

    fn search_anew(&mut self) {
        self.costume.search_anew();
    }

    fn frames(&self) -> u32 {
        last_frame(&self.figure, self.clip, self.fps) + 1
    }

    fn blow(&mut self, wind: Vec3) {
        self.wind = self.wearer.own_direction(wind);
    }

    fn points(&self) -> Vec<Vec3> {
        self.costume.points().into_iter().map(|p| self.wearer.to_world(p)).collect()
    }

    fn step(&mut self, frame: u32) -> Result<()> {
        let poses = self.poses(frame)?;
        self.costume.step(&poses, self.wind);
        Ok(())
    }

    fn given(&mut self, frame: u32) -> Result<Step<'_>> {
        let poses = self.poses(frame)?;
        Ok(self.costume.given(&poses, self.wind))
    }

    fn go_on(&mut self, now: &Now) -> bool {
        self.costume.go_on(now)
    }

    fn counts(&self, spring: &Spring) -> bool {
        !spring.ends.iter().any(|v| self.costume.holds(*v))
    }

    fn report(&self) -> serde_json::Value {
        serde_json::json!({
            "garment": self.costume.garments().iter().map(|g| g.0.as_str()).collect::<Vec<_>>().join(" "), "held": self.costume.held(), "wearer": self.wearer.size,
            "bodies": self.wearer.body.capsules.len(),
        })
    }
}
