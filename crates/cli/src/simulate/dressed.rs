//! A garment cut from a text, on a figure that moves.

use super::Simulate;
use super::output::Surface;
use super::subject::Subject;
use crate::{argument, progress};
use anyhow::{Context, Result, bail};
use std::sync::Arc;
use yugen_motion::cloth::{Fabric, SmallSteps, Spring};
use yugen_motion::garment::{Costume, Fitting, Wearer};
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
    name: String,
}

/// Where the joints of a figure are in the world.
fn world(figure: &Figure, joints: &[Mat4]) -> Vec<Mat4> {
    joints.iter().map(|m| figure.to_world * *m).collect()
}

impl Dressed {
    /// The figure of the scene that has the most joints, in its garment; from a memory where there is one.
    pub fn new(
        verb: &Simulate,
        text: &str,
        scene: &Scene,
        fabric: &Fabric,
        memory: Option<&[f32]>,
    ) -> Result<Self> {
        let name = verb.animation.as_deref();
        let playing = scene.figures.iter().filter_map(|f| Some((f.clone(), f.plays(name)?)));
        let Some((figure, clip)) = playing.max_by_key(|(f, _)| f.skeleton.joints().len()) else {
            let file = verb.scene.display();
            match &verb.animation {
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
                verb.scene.display()
            )
        };
        let mut wearer = Wearer::new(&figure.skeleton, &rest, &first, &verb.joint).with_context(cannot)?;
        wearer.fill(skin(&figure, &still, &rest));
        if let Some(girth) = verb.girth {
            wearer.body.capsules.iter_mut().for_each(|c| c.radii = c.radii.map(|r| r * girth));
        }
        let garment = argument::garment(text, wearer.size)?;
        let defaults = Fitting::default();
        let fitting = Fitting {
            edge: 1e-3 * verb.edge.unwrap_or(25.0),
            fabric: *fabric,
            seconds: (1.0 / verb.fps) as f32,
            substeps: verb.substeps.unwrap_or(defaults.substeps),
            threads: argument::threads(verb.threads),
            floor: Some(verb.ground.unwrap_or(wearer.sole())),
            ..defaults
        };
        let costume = match memory {
            Some(memory) => Costume::recall(&garment, &wearer.body, &fitting, &wearer.approach(0.0), memory)?
                .context("the checkpoint is of another garment; --restart throws it away")?,
            None => {
                let bar = progress::bar(100, verb.json);
                bar.set_message("putting it on");
                let costume = Costume::dress(&garment, &wearer.body, &fitting, |t| {
                    bar.set_position((100.0 * t) as u64);
                    wearer.approach(t)
                });
                bar.finish_and_clear();
                costume?
            }
        };
        let crossed = costume.solver().cloth().crossings(costume.solver().positions()).len();
        if memory.is_none() && crossed > 0 {
            tracing::warn!(
                "{crossed} edges of the garment pass through triangles where it is put on: it is tight there; smaller triangles \
                 (--edge) or a thinner body (--girth) may help"
            );
        }
        let cut = costume.cut();
        let surface = Surface {
            objects: vec![(garment.name.clone(), cut.uvs.len())],
            uvs: cut.uvs.clone(),
            triangles: cut.triangles.clone(),
            vertex: cut.vertex.iter().map(|v| Some(*v)).collect(),
            sheet: cut.sheet.triangles.clone(),
            scale: None,
        };
        let wind = wearer.own_direction(verb.wind.unwrap_or(Vec3::ZERO));
        Ok(Self { figure, clip, fps: verb.fps, wearer, costume, surface, wind, name: garment.name })
    }
}

/// Joints of a figure at a moment of a clip, in the world.
fn poses(figure: &Figure, clip: usize, seconds: f32) -> Result<Vec<RigidPose>> {
    let joints = figure.skeleton.to_skeleton(&figure.clips[clip].pose(&figure.skeleton, seconds))?;
    Ok(rigid(&world(figure, &joints)))
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

    fn look_anew(&mut self) {
        self.costume.look_anew();
    }

    fn frames(&self) -> u32 {
        let [_, last] = self.figure.clips[self.clip].span();
        (f64::from(last) * self.fps + 1e-3).floor().clamp(0.0, 1e6) as u32 + 1
    }

    fn points(&self) -> Vec<Vec3> {
        self.costume.points().into_iter().map(|p| self.wearer.to_world(p)).collect()
    }

    fn step(&mut self, frame: u32) -> Result<()> {
        let mut poses = poses(&self.figure, self.clip, (f64::from(frame) / self.fps) as f32)?;
        self.wearer.own(&mut poses);
        self.costume.step(&poses, self.wind);
        Ok(())
    }

    fn counts(&self, spring: &Spring) -> bool {
        !spring.ends.iter().any(|v| self.costume.holds(*v))
    }

    fn report(&self) -> serde_json::Value {
        serde_json::json!({
            "garment": self.name, "held": self.costume.held(), "wearer": self.wearer.size,
            "bodies": self.wearer.body.capsules.len(),
        })
    }
}
