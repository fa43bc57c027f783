//! What moves: figures of a motion file with shapes at their joints, and meshes that a cache moves.

use super::document::{Item, Keys};
use super::{Reader, placed};
use crate::formats::motion::{self, Motion};
use crate::formats::pc2::PointCache;
use crate::formats::read_file;
use crate::{Error, Place};
use glam::{Mat4, Vec3};
use std::path::Path;
use std::sync::Arc;
use yugen_scene::{Attachment, Figure, Part, Shape};

/// Of a cache that says nothing else, as `yugen simulate` writes them.
const FRAMES_A_SECOND: f32 = 60.0;
/// The most frames a second that anybody films.
const MOST_FRAMES: f32 = 1e5;

/// The points of a shape over time.
pub(super) struct Cache {
    shape: usize,
    points: PointCache,
    fps: f64,
    /// Coordinates of its points to those of the shape.
    to_shape: Mat4,
    place: Place,
}

impl<'a> Reader<'a> {
    /// One `[[figure]]`: a skeleton and how it moves.
    pub(super) fn figure(&mut self, mut keys: Keys<'a>) -> Result<(), Error> {
        let name = keys.need("name", "what shapes call it")?.text()?.to_string();
        keys.what = format!("figure '{name}'");
        let item = keys.need("motion", "a file of motion with a skeleton, such as .bvh or .glb")?;
        let path = self.folders.find(item.text()?, item.place())?;
        let mut options = motion::Options { guess: true, ..motion::Options::default() };
        if let Some(item) = keys.get("unit") {
            let name = item.text()?;
            let known = || motion::UNITS.iter().map(|(n, _)| *n);
            options.unit =
                Some(motion::unit(name).ok_or_else(|| item.unknown("unit of length", name, known()))?);
        }
        if let Some(item) = keys.get("up") {
            options.axes = motion::up(item.one_of("axis", &[("y", 'y'), ("z", 'z')])?);
        }
        let moved = match motion::read(&read_file(&path)?, &path, &options)?.motion {
            Motion::Skeletal(moved) => moved,
            Motion::Captured(_) => {
                return Err(item.invalid(
                    "it has markers or rigid bodies and no skeleton; `yugen motion solve` makes one of them",
                ));
            }
        };
        let to_world = placed(&mut keys)?;
        if self.figures.iter().any(|(other, _)| *other == name) {
            return Err(keys.invalid(format!("there is another figure '{name}'")));
        }
        let figure = Figure {
            to_world,
            skeleton: moved.skeleton,
            clips: vec![moved.clip],
            skins: Vec::new(),
            attachments: Vec::new(),
            deformed: Vec::new(),
        };
        self.figures.push((name, figure));
        keys.finish()
    }

    /// The keys `figure`, `joint` and `cache` of a shape; `shapes` are those it has brought, numbered from `first` on, and
    /// `figures` how many there were before.
    pub(super) fn movement(
        &mut self,
        keys: &mut Keys<'a>,
        shapes: &[Shape],
        first: usize,
        figures: usize,
    ) -> Result<(), Error> {
        let (figure, joint, cache) = (keys.get("figure"), keys.get("joint"), keys.get("cache"));
        if let (Some(item), true) =
            (figure.as_ref().or(joint.as_ref()).or(cache.as_ref()), self.scene.figures.len() > figures)
        {
            return Err(item.invalid("its file has an animation of its own"));
        }
        match (figure, joint, &cache) {
            (None, None, _) => {}
            (Some(figure), Some(joint), None) => self.attach(&figure, &joint, shapes, first)?,
            (Some(item), None, _) => return Err(item.invalid("give also 'joint', which carries the shape")),
            (None, Some(item), _) => return Err(item.invalid("give also 'figure', which has the joint")),
            (_, _, Some(item)) => {
                return Err(item.invalid("a shape follows a joint or a cache, not both"));
            }
        }
        let Some(item) = cache else { return Ok(()) };
        let [shape] = shapes else {
            return Err(item.invalid(format!("a cache moves one mesh, and this file has {}", shapes.len())));
        };
        let (file, mut fps, mut world) = (item.try_text(), FRAMES_A_SECOND, true);
        let file = match file {
            Some(_) => item,
            None => {
                let mut keys = item.keys("the cache")?;
                let file = keys.need("file", "a point cache (.pc2)")?;
                fps = keys.or("fps", fps, |i| i.number_in(1e-3, MOST_FRAMES))?;
                world = keys.or("space", true, |i| i.one_of("space", &[("world", true), ("own", false)]))?;
                keys.finish()?;
                file
            }
        };
        let path = self.folders.find(file.text()?, file.place())?;
        let points = PointCache::read(&read_file(&path)?, &path)?;
        let to_shape = if world { shape.to_world.inverse() } else { Mat4::IDENTITY };
        self.caches.push(Cache { shape: first, points, fps: fps.into(), to_shape, place: file.place() });
        Ok(())
    }

    fn attach(
        &mut self,
        figure: &Item<'a>,
        joint: &Item<'a>,
        shapes: &[Shape],
        first: usize,
    ) -> Result<(), Error> {
        let name = figure.text()?;
        let Some(at) = self.figures.iter().position(|(known, _)| known == name) else {
            return Err(figure.unknown("figure", name, self.figures.iter().map(|(n, _)| n.as_str())));
        };
        let owner = &mut self.figures[at].1;
        let name = joint.text()?;
        let Some(joint_index) = owner.skeleton.joints().iter().position(|j| j.name == name) else {
            return Err(joint.unknown(
                "joint",
                name,
                owner.skeleton.joints().iter().map(|j| j.name.as_str()),
            ));
        };
        for (shape, of) in (first..).zip(shapes) {
            let part = Part::Shape { shape, to_joint: of.to_world, flips: false };
            owner.attachments.push(Attachment { joint: joint_index, part });
        }
        Ok(())
    }

    /// Figures and caches take their places in the scene, whose shapes are complete.
    pub(super) fn move_in(&mut self, file: &Path) -> Result<(), Error> {
        let figures = std::mem::take(&mut self.figures);
        let posed = !figures.is_empty();
        self.scene.figures.extend(figures.into_iter().map(|(_, figure)| Arc::new(figure)));
        for Cache { shape, points, fps, to_shape, place } in std::mem::take(&mut self.caches) {
            // In frames, of which there are `fps` a second.
            let (start, each) = (f64::from(points.start) / fps, f64::from(points.rate));
            let samples: Arc<[Vec<Vec3>]> = points.samples.into();
            let added = self.scene.add_cache(shape, samples, fps / each, start, to_shape);
            added.map_err(|e| Error::invalid(place, e.to_string()))?;
        }
        // Those of other files are in their places already.
        let Some([first, _]) = self.scene.clip_span(None).filter(|_| posed) else { return Ok(()) };
        self.scene.pose(None, first).map_err(|e| Error::invalid(Place::file(file), e.to_string()))
    }
}
