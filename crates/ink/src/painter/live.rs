//! A painter at work while somebody changes style, size, or the scene's values.

use super::{FRAMES, Painter, Stage, Style, go_on, lit_scene, materials, place_controls, small_camera, unit};
use crate::InkError;
use crate::canvas::{BRUSHED, Canvas, Layer};
use crate::depth::DepthMap;
use crate::projection::Projection;
use crate::resolve::Resolve;
use crate::steering::Names;
use std::sync::Arc;
use yugen_optics::Image;
use yugen_scene::prepared::Rows;
use yugen_scene::{Aov, Camera, Scene};

/// Most of what was seen that is kept: a picture, and a smaller one beside it.
const SIGHTS: usize = 2;

/// What a camera sees: all that a painting needs of the real-time renderer.
pub(super) struct Sight {
    pub camera: Camera,
    /// Depth, shapes, normals.
    pub seen: Image,
    /// How light it is, in fewer pixels.
    pub lit: Image,
    /// What is in front.
    pub map: DepthMap,
}

impl Painter {
    /// Takes over another style, but for its creases, its seed and its signature. `true`: fires are to burn otherwise, which they do
    /// once a pose is taken over.
    #[must_use]
    pub fn restyle(&mut self, style: Style) -> bool {
        let flicker = self.style.controls.flicker;
        let signature = self.style.signature.clone();
        let style = Style { creases: self.style.creases, seed: self.style.seed, signature, ..style };
        self.place_controls = place_controls(&style, &self.rows, &self.names);
        // What was seen without texture coordinates does not say where masks lie.
        let lacks = |s: &Sight| s.seen.channel(Aov::Uv.channels()[0]).is_none();
        if self.place_controls.has_surfaces() {
            self.sights.retain(|s| !lacks(s));
        }
        self.edits = Arc::new(style.steering.strokes.clone());
        self.unmet = self.edits.keys().copied().collect();
        self.style = style;
        self.style.controls.flicker != flicker
    }

    /// Takes over other values of materials and lights, and another pose, of the same scene.
    pub fn refill(&mut self, scene: &Scene) -> Result<(), InkError> {
        let rows = Rows::new(lit_scene(scene, &self.style)?.as_ref())?;
        let names = Names::of(scene);
        let place_controls = place_controls(&self.style, &rows, &names);
        self.sights.clear();
        for (stage, options) in [&mut self.stage, &mut self.light].into_iter().zip(&self.options) {
            if !stage.refill(&rows)? {
                *stage = Stage::new(&self.device, &self.queue, &rows, options)?;
            }
        }
        (self.rows, self.names, self.place_controls) = (rows, names, place_controls);
        self.find_topologies();
        Ok(())
    }

    /// A canvas for pictures of this size in this style.
    pub(super) fn fit(&mut self, size: [u32; 2]) -> Result<(), InkError> {
        let materials = materials(&self.style, size);
        let fits = |canvas: &Canvas| canvas.size() == size && *canvas.materials() == materials;
        if !fits(&self.canvas) {
            let canvas = match self.spare.take().filter(|c| fits(c)) {
                Some(canvas) => canvas,
                None => Canvas::new(&self.device, &self.queue, size, &materials, &Resolve::default())?,
            };
            self.spare = Some(std::mem::replace(&mut self.canvas, canvas));
            self.stamps = Default::default();
            self.size = size;
            self.mark()?;
        }
        Ok(())
    }

    /// Finds where inscription and seal are on the canvas, and lays them on.
    pub(super) fn mark(&mut self) -> Result<(), InkError> {
        let signature = self.style.signature.as_ref();
        self.marks = signature.map_or(Ok(Vec::new()), |s| s.marks(self.size, unit(self.size)))?;
        self.lay(true);
        Ok(())
    }

    /// Lays inscription and seal on, or takes them away.
    pub(super) fn lay(&self, on: bool) {
        let mut layers: Vec<Layer> = self.marks.iter().map(|m| m.layer).collect();
        layers.dedup();
        debug_assert!(layers.iter().all(|l| *l as usize >= BRUSHED));
        for layer in layers {
            let mut loads = vec![0.0; self.size[0] as usize * self.size[1] as usize];
            for mark in self.marks.iter().filter(|m| on && m.layer == layer) {
                mark.print(self.size, unit(self.size), &mut loads);
            }
            self.canvas.lay(layer, &loads);
        }
    }

    /// What the camera sees, as it was seen before where nothing has moved since.
    pub(super) fn sight(
        &mut self,
        camera: &Camera,
        projection: &Projection,
        wanted: &dyn Fn() -> bool,
    ) -> Result<Sight, InkError> {
        if let Some(known) = self.sights.iter().position(|s| s.camera == *camera) {
            return Ok(self.sights.remove(known));
        }
        let (seen, map) = self.see(camera, projection)?;
        let _span = tracing::info_span!("see_light").entered();
        let small = small_camera(camera);
        let [_, _, width, height] = small.film.crop.unwrap_or([0, 0, small.film.width, small.film.height]);
        self.light.resize([width, height])?;
        self.options[1].size = [width, height];
        self.light.place(&self.rows.draws)?;
        for _ in 0..FRAMES {
            go_on(wanted)?;
            self.light.frame(&small)?;
        }
        Ok(Sight { camera: camera.clone(), seen, lit: self.light.image()?, map })
    }

    pub(super) fn keep(&mut self, sight: Sight) {
        self.sights.truncate(SIGHTS - 1);
        self.sights.insert(0, sight);
    }
}
