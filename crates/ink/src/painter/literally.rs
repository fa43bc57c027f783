//! The method of the slides ([`crate::literal`]) over a scene: what its first pass reads, and both passes for each technique.

use super::{Painter, plain_hand};
use crate::InkError;
use crate::depth::DepthMap;
use crate::dot;
use crate::footprint::{Footprint, VARIANTS};
use crate::literal::{self, Padi};
use crate::projection::Projection;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use yugen_optics::Image;
use yugen_optics::frame::Frame;
use yugen_realtime::{Options, Stage};
use yugen_scene::prepared::{DrawRow, Lookup, Materials, ShadingPoint, Textures, scratch};
use yugen_scene::{Aov, Camera, Scene};

impl Painter {
    /// The brush's state at each pixel as the first pass of the slides has it ([`literal`]), for contours.
    pub fn see_literally(&mut self, camera: &Camera) -> Result<Vec<Padi>, InkError> {
        let projection = Projection::new(camera)?;
        let (_, map) = self.see(camera, &projection)?;
        let middle = self.rows.draws.iter().map(|d| DVec3::from_array(d.to_world.map(|r| f64::from(r[3]))));
        let middle = middle.sum::<DVec3>() / self.rows.draws.len().max(1) as f64;
        let v = projection.to_eye(middle);
        let theta = |at: DVec3, n: DVec3| projection.direction(at, n).as_vec2().to_angle();
        let mut segments = Vec::new();
        self.each_surface(|surface, topology, _, _| {
            segments.extend(literal::contour::silhouettes(surface, topology, v, theta));
        });
        // The greatest pressure on the side away from the light.
        let phi = std::f32::consts::FRAC_PI_2 - plain_hand(&self.style, self.size).shade.to_angle();
        Ok(literal::contour::padi(&segments, &projection, &map, phi))
    }

    /// What the slides of Xu, Yang and Wu make of `scene` in the pose that the painter has ([`literal`]): black ink over the paper's
    /// colour, R, G, B, linear sRGB. The controls `contour`, `wash`, `wrinkle`, `rub` and `dot` scale the ink of each technique.
    pub fn paint_literally(&mut self, scene: &Scene, camera: &Camera) -> Result<Image, InkError> {
        let projection = Projection::new(camera)?;
        let contours = self.see_literally(camera)?;
        let hand = plain_hand(&self.style, self.size);
        let mut dots = vec![Padi::default(); contours.len()];
        let mut small = HashSet::new();
        let (pixels, map) = self.see_surfaces(scene, camera, &projection)?;
        self.each_surface(|surface, _, i, draw| {
            let Some(dot) =
                dot::dot(&surface.positions, &projection, &map, &hand, &|_| hand.controls, i, draw.shape)
            else {
                return;
            };
            small.insert(draw.shape);
            let Some(dot) = dot else { return };
            let [x, y] = dot.pixel.map(|v| v as usize);
            dots[y * self.size[0] as usize + x] = Padi {
                pressure: (dot.radius / hand.radius(1.0)).min(1.0),
                angle: dot.angle,
                dryness: literal::constant::DRYNESS,
                intensity: literal::constant::INTENSITY,
            };
        });
        let pixels: Vec<_> = pixels.into_iter().map(|p| p.filter(|p| !small.contains(&p.shape))).collect();
        let (seed, c) = (self.style.seed, self.style.controls);
        let masks: Vec<Footprint> =
            (0..VARIANTS as u32).map(|i| Footprint::new(seed, i, c.roughness)).collect();
        let width = self.size[0] as usize;
        let surface = |technique, strength| literal::surface::padi(technique, &pixels, width, strength, seed);
        let scaled = |mut pixels: Vec<Padi>, by: f32| {
            pixels.iter_mut().for_each(|p| p.intensity = (p.intensity * by).min(1.0));
            pixels
        };
        use literal::Technique::*;
        let mut alpha = vec![0.0; contours.len()];
        for (technique, strength) in [
            (Colouring, c.wash),
            (Wrinkling, c.wrinkle),
            (Rubbing, c.rub),
            (Contouring, c.contour),
            (Dotting, c.dot),
        ] {
            if strength <= 0.0 {
                continue;
            }
            let (padi, size) = match technique {
                Colouring => (surface(technique, strength), literal::constant::COLOURING_SIZE),
                Wrinkling | Rubbing => (surface(technique, strength), literal::constant::WRINKLING_SIZE),
                Contouring => (scaled(contours.clone(), strength), 1.0),
                Dotting => (scaled(dots.clone(), strength), 1.0),
            };
            let radius = size * hand.radius(1.0);
            // As many prints as pixels, half of the width of the greatest: of each so much that they come to their ink together.
            let (weight, k_dry) = match technique {
                Contouring | Dotting => (1.0, literal::constant::K_DRY),
                _ => {
                    let prints = std::f32::consts::PI * (0.5 * radius).powi(2);
                    ((literal::constant::COVERAGE / prints).min(1.0), literal::constant::K_DRY_SURFACE)
                }
            };
            literal::particles(&mut alpha, &padi, self.size, &masks, [radius, weight, k_dry], seed);
        }
        let paper = self.style.paper.rgb();
        let mut image = Image::rgb(self.size[0] as usize, self.size[1] as usize);
        for (pixel, a) in image.data.chunks_exact_mut(3).zip(alpha) {
            pixel.copy_from_slice(&(paper * (1.0 - a)).to_array());
        }
        Ok(image)
    }

    /// What the slides' first pass knows of each pixel.
    fn see_surfaces(
        &mut self,
        scene: &Scene,
        camera: &Camera,
        projection: &Projection,
    ) -> Result<(Vec<Option<literal::surface::Seen>>, DepthMap), InkError> {
        let aovs = vec![Aov::Depth, Aov::Id, Aov::ShadingNormal, Aov::Uv, Aov::Position];
        let options = Options { aovs, ..self.options[0].clone() };
        let mut stage = Stage::new(&self.device, &self.queue, &self.rows, &options)?;
        stage.frame(camera)?;
        let seen = stage.image()?;
        let lacks = || InkError::Refused("the picture lacks normals or coordinates".into());
        let map = DepthMap::new(&seen, projection).ok_or_else(lacks)?;
        let first = |aov: Aov| seen.channel(aov.channels()[0]).ok_or_else(lacks);
        let (normal, uv, position) = (first(Aov::ShadingNormal)?, first(Aov::Uv)?, first(Aov::Position)?);
        let materials = Materials::new(scene).map_err(|e| InkError::Refused(e.to_string()))?;
        let textures = Textures::new(scene);
        let draws: HashMap<u32, DrawRow> = self.rows.draws.iter().map(|d| (d.shape, *d)).collect();
        let boxes: HashMap<u32, [Vec3; 2]> = self.boxes();
        let weights = self.space.luminance_weights();
        let [right, down] = projection.axes().map(|axis| axis.as_vec3());
        let shade = plain_hand(&self.style, self.size).shade;
        let mut room = scratch();
        let mut pixels = Vec::with_capacity(map.shape.len());
        for (i, pixel) in seen.data.chunks_exact(seen.channels.len()).enumerate() {
            let shape = map.shape[i];
            let Some(draw) = draws.get(&shape) else {
                pixels.push(None);
                continue;
            };
            let at = DVec2::new((i % seen.width) as f64 + 0.5, (i / seen.width) as f64 + 0.5);
            let eye = projection.to_eye_at(at).as_vec3();
            let n = Vec3::from_slice(&pixel[normal..normal + 3]).normalize_or(eye);
            let n = if n.dot(eye) < 0.0 { -n } else { n };
            // Over the painter's left shoulder.
            let light = (eye - right * shade.x - down * shade.y).normalize_or(eye);
            let given = Vec2::from_slice(&pixel[uv..uv + 2]);
            let uv = match draw.flags & DrawRow::HAS_UVS {
                0 => around(Vec3::from_slice(&pixel[position..position + 3]), boxes.get(&shape)),
                _ => given,
            };
            let frame = Frame::from_normal(n);
            let point = ShadingPoint {
                frame,
                handedness: 1.0,
                normal: n,
                dp: [frame.s, frame.t],
                lookup: Lookup { uv: given, footprint: 0.0, place: None },
            };
            let albedo = materials.shade(&textures, draw.material as usize, &point, eye, &mut room).albedo();
            let colour = weights.dot(albedo).max(0.0);
            pixels.push(Some(literal::surface::Seen {
                shape,
                facing: n.dot(eye).clamp(0.0, 1.0),
                uv,
                diffuse: literal::surface::grey(colour),
                lit: literal::surface::grey(literal::surface::phong(colour, n, eye, light)),
            }));
        }
        Ok((pixels, map))
    }

    /// Lowest and highest corner of what each shape is in the world.
    fn boxes(&self) -> HashMap<u32, [Vec3; 2]> {
        let mut boxes: HashMap<u32, [Vec3; 2]> = HashMap::new();
        self.each_surface(|surface, _, _, draw| {
            let own = boxes.entry(draw.shape).or_insert([Vec3::INFINITY, Vec3::NEG_INFINITY]);
            for p in surface.positions.iter().map(|p| p.as_vec3()) {
                *own = [own[0].min(p), own[1].max(p)];
            }
        });
        boxes
    }
}

/// Texture coordinates of a shape that has none: around its middle, and up.
fn around(p: Vec3, bounds: Option<&[Vec3; 2]>) -> Vec2 {
    let [low, high] = bounds.copied().unwrap_or([Vec3::ZERO, Vec3::ONE]);
    let from = p - 0.5 * (low + high);
    Vec2::new(from.z.atan2(from.x) / std::f32::consts::TAU, from.y / (high - low).max_element().max(1e-20))
}
