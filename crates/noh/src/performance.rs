//! A player who dances on the stage: parts at their joints, a robe that a simulation has moved.

use crate::sash::Sash;
use crate::view::SceneError;
use crate::{Finish, FireLight, Hour, Stage};
use glam::{Mat4, Vec2, Vec3};
use std::ops::ControlFlow;
use std::sync::Arc;
use yugen_motion::SkeletalMotion;
use yugen_motion::garment::{self, Body, Fitting, Form, Garment, GarmentError};
use yugen_scene::{
    Attachment, Camera, Figure, Film, FovAxis, Geometry, Material, Mesh, Part, Projection, Scene, Shape,
    look_along,
};

/// A garment that moves, in the coordinates of the dance.
#[derive(Clone, Debug)]
pub struct Costume {
    /// As it is sewn, with (u, v) in metres on the cloth.
    pub mesh: Mesh,
    /// Where all vertices are, sample by sample; the first at the beginning of the dance.
    pub samples: Arc<[Vec<Vec3>]>,
    /// Samples a second.
    pub rate: f64,
    /// What it is made of.
    pub finish: Finish,
}

impl Costume {
    /// Garments put on the player, the innermost first, and danced in, and the sash over a kariginu; of their frames every `keep`th is
    /// kept, all where that is 0, and the last. `tell` hears which part of the work is done, and may end it.
    ///
    /// # Errors
    /// A garment or a fabric that is none.
    pub fn simulate(
        garments: &[Garment],
        dance: &SkeletalMotion,
        fitting: &Fitting,
        keep: usize,
        mut tell: impl FnMut(f32) -> ControlFlow<()>,
    ) -> Result<Vec<Self>, GarmentError> {
        let keep = keep.max(1);
        let fitting = Fitting { seconds: (1.0 / dance.rate) as f32, ..*fitting };
        let body = Body::player();
        let approach = |t: f32| dance.approach(t).unwrap_or_default();
        let dressing = fitting.dressing_steps(garments.len()) as f32;
        let all = dressing + dance.frames as f32;
        let mut worn =
            garment::Costume::dress(garments, &body, &fitting, approach, |t| tell(t * dressing / all))?;
        let cut = worn.cut();
        let (points, normals) = (worn.points(), worn.normals());
        let mut from = 0;
        let mut costumes: Vec<(Mesh, std::ops::Range<usize>)> = Vec::new();
        for (name, count) in worn.garments() {
            let range = from..from + count;
            let own = |t: &&[u32; 3]| range.contains(&(t[0] as usize));
            let mesh = Mesh {
                name: name.clone(),
                positions: points[range.clone()].to_vec(),
                normals: normals[range.clone()].to_vec(),
                uvs: cut.uvs[range.clone()].to_vec(),
                triangles: cut.triangles.iter().filter(own).map(|t| t.map(|v| v - from as u32)).collect(),
                ..Mesh::default()
            };
            from = range.end;
            costumes.push((mesh, range));
        }
        let pose = |frame: usize| -> Result<_, GarmentError> {
            let poses = dance.poses(frame).map_err(|e| GarmentError::Body(e.to_string()))?;
            let pelvis = poses.get(body.pelvis).copied();
            let pelvis = pelvis.ok_or_else(|| GarmentError::Body("has no pelvis".into()))?;
            Ok((poses, pelvis))
        };
        // Over a kariginu; what else is worn outermost hangs loose or is drawn up over its belt.
        let mut sash = None;
        if let (Some(garment), Some((robe, range))) = (garments.last(), costumes.last())
            && garment.wear.form == Form::Fastened
        {
            let panels = &cut.panels[cut.panels.len() - 1 - garment.panels.len()..];
            let sleeve = |v: &u32| {
                let panel = panels.partition_point(|first| *first <= range.start + *v as usize) - 1;
                garment.panels[panel].name.contains("sleeve")
            };
            let below = robe.triangles.iter().filter(|t| !t.iter().any(sleeve)).copied().collect();
            let held = |v: u32| worn.holds(cut.vertex[range.start + v as usize]);
            let (_, pelvis) = pose(0)?;
            if let Some(mut tied) = Sash::new(&robe.positions, &robe.triangles, below, held, &pelvis) {
                let mesh = tied.mesh(&robe.positions, &pelvis);
                sash = Some((tied, range.clone(), mesh, Vec::with_capacity(dance.frames / keep + 1)));
            }
        }
        let mut samples: Vec<Vec<Vec<Vec3>>> =
            vec![Vec::with_capacity(dance.frames / keep + 1); costumes.len()];
        let mut kept = 0;
        for frame in 0..dance.frames {
            let (poses, pelvis) = pose(frame)?;
            if frame > 0 {
                worn.step(&poses, Vec3::ZERO);
            }
            // The last may come a frame early, rather than the robe stop before the player.
            if frame.is_multiple_of(keep) || frame + 1 == dance.frames {
                let points = worn.points();
                for ((_, range), samples) in costumes.iter().zip(&mut samples) {
                    samples.push(points[range.clone()].to_vec());
                }
                if let Some((sash, range, _, samples)) = &mut sash {
                    let seconds = (frame - kept) as f32 * fitting.seconds;
                    samples.push(sash.at(&points[range.clone()], &pelvis, seconds));
                }
                kept = frame;
            }
            if tell((dressing + (frame + 1) as f32) / all).is_break() {
                return Err(GarmentError::Stopped);
            }
        }
        let rate = dance.rate / keep as f64;
        let outermost = costumes.len().saturating_sub(1);
        let made = costumes.into_iter().zip(samples).enumerate().map(|(k, ((mesh, _), samples))| {
            let finish = if k == outermost { Finish::Cloth } else { Finish::Lining };
            Self { mesh, samples: samples.into(), rate, finish }
        });
        let sash = sash.map(|(_, _, mesh, samples)| {
            let finish = Finish::Band;
            Self { mesh, samples: samples.into(), rate, finish }
        });
        Ok(made.chain(sash).collect())
    }
}

/// A dance on a stage.
#[derive(Clone, Debug)]
pub struct Performance {
    /// With a player ([`Stage::with_player`]).
    pub stage: Stage,
    /// Of the skeleton [`yugen_motion::dance::player`].
    pub dance: SkeletalMotion,
    /// What the player wears, the innermost first, then a sash.
    pub costume: Vec<Costume>,
    /// Coordinates of the dance to those of the stage.
    place: Mat4,
}

/// Eyes of a player above the floor, m.
const EYES: f32 = 1.55;

/// Where a dance begins, behind the middle of the main floor, as part of its depth.
const BEGINS: f32 = -0.25;

impl Performance {
    /// On a stage with a player; the dance begins behind the middle of the main floor, to the front.
    ///
    /// # Errors
    /// A dance with joints at no place.
    pub fn new(stage: Stage, dance: SkeletalMotion, costume: Vec<Costume>) -> Result<Self, SceneError> {
        let start = dance.poses(0)?.first().map_or(Vec3::ZERO, |p| p.position.with_y(0.0));
        let z = BEGINS * stage.layout().get("depth");
        let place = Mat4::from_translation(Vec3::new(0.0, stage.layout().floor(z), z) - start);
        Ok(Self { stage, dance, costume, place })
    }

    /// As a scene, with the player in the first pose. Shapes of the stage and the player come as in [`Stage::scene`], then
    /// fires, then what is worn, the innermost first.
    ///
    /// # Errors
    /// Where the stage's scene cannot be, or the robe's samples are not of its mesh.
    pub fn scene(&self, hour: Hour, fire_light: FireLight) -> Result<Scene, SceneError> {
        let mut scene = self.stage.scene(hour, fire_light)?;
        let joints = self.dance.skeleton.joints();
        let first = self.stage.parts().len();
        let mut attachments = Vec::new();
        for (shape, piece) in (first..).zip(self.stage.player()) {
            let joint = joints.iter().position(|j| j.name == piece.joint);
            let joint = joint.ok_or_else(|| SceneError::NoJoint(piece.joint.clone()))?;
            let part = Part::Shape { shape, to_joint: Mat4::IDENTITY, flips: false };
            attachments.push(Attachment { joint, part });
        }
        for costume in &self.costume {
            let of = |finish: Finish| self.stage.material_of(finish).ok_or(SceneError::NoPlayer);
            let shape = scene.shapes.len();
            let material = match costume.finish {
                Finish::Cloth | Finish::Lining => {
                    scene
                        .materials
                        .push(Material::TwoSided { front: of(costume.finish)?, back: of(Finish::Lining)? });
                    scene.materials.len() - 1
                }
                other => of(other)?,
            };
            let name = if costume.finish == Finish::Cloth { ROBE } else { costume.mesh.name.as_str() };
            let mesh = Geometry::Mesh(Arc::new(costume.mesh.clone()));
            scene.shapes.push(Shape::new(name, mesh, self.place, material));
            scene.add_cache(shape, costume.samples.clone(), costume.rate, 0.0, Mat4::IDENTITY)?;
        }
        scene.figures.push(Arc::new(Figure {
            to_world: self.place,
            skeleton: self.dance.skeleton.clone(),
            clips: vec![self.dance.clip.clone()],
            skins: Vec::new(),
            attachments,
            deformed: Vec::new(),
        }));
        scene.pose(None, 0.0)?;
        let views = self.views()?;
        scene.cameras.extend(views);
        Ok(scene)
    }

    /// Near views of the player where the dance begins, and parallel ones from front, side and back, as a frozen moment is
    /// looked at.
    fn views(&self) -> Result<Vec<Camera>, SceneError> {
        let pelvis = self.dance.poses(0)?.first().map_or(Vec3::ZERO, |p| p.position);
        let at = self.place.transform_point3(pelvis.with_y(0.0));
        let up = |y: f32| at + Vec3::Y * y;
        let ahead = self.place.transform_vector3(Vec3::Z).normalize_or(Vec3::Z);
        let left = self.place.transform_vector3(Vec3::X).normalize_or(Vec3::X);
        let film = Film { width: 1280, height: 720, ..Film::default() };
        let camera = |name: &str, from: Vec3, to: Vec3, projection: Projection, scale: f32| Camera {
            name: name.into(),
            to_world: look_along(from, to - from, Vec3::Y) * Mat4::from_scale(Vec3::new(scale, scale, 1.0)),
            projection,
            near_far: [0.02, 500.0],
            film: film.clone(),
            samples_per_pixel: 64,
        };
        let near = |name: &str, from: Vec3, to: Vec3, fov: f32| {
            let projection = Projection::Perspective {
                fov_x: fov.to_radians(),
                fov_axis: FovAxis::X,
                aperture_radius: 0.0,
                focus_distance: from.distance(to),
                principal_point: Vec2::ZERO,
            };
            camera(name, from, to, projection, 1.0)
        };
        let mut all = vec![
            near("player", up(1.25) + ahead * 5.2 - left * 1.5, up(0.86), 44.0),
            near("mask", up(EYES) + ahead * 1.6 - left * 0.25, up(EYES + 0.03), 22.0),
            near("sleeve", up(1.25) + ahead * 2.0 + left * 1.2, up(1.05) + left * 0.2, 34.0),
        ];
        // From behind within the stage, for the mirror board closes it.
        for (name, way) in [("front", 6.0 * ahead), ("side", 6.0 * left), ("back", -2.5 * ahead)] {
            all.push(camera(name, up(0.95) + way, up(0.95), Projection::Orthographic, 1.9));
        }
        Ok(all)
    }
}

/// What the shape of the robe is called: of what is worn outermost.
pub const ROBE: &str = "robe";
