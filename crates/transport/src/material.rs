//! Materials at a hit: the tree of a scene's material, resolved to a few lobes with their frames.

use crate::texture::{Lookup, Textures};
use glam::{Vec2, Vec3};
use std::sync::Arc;
use yugen_archive::scene::{Material, MaterialId, Scene, TextureId, Value};
use yugen_optics::Frame;
use yugen_reflectance::{Bsdf, Choice, Kind, MAX_SLOTS, ParamType};

/// Most lobes a material may resolve to; more is refused when the scene is prepared.
pub const MAX_LOBES: usize = 8;

/// Largest density, 1/sr, of a matt material into the mirror direction; a cosine lobe's is at most 1/π.
const MATT: f32 = 0.5;

struct Textured {
    slot: usize,
    kind: ParamType,
    value: Value,
    min: f32,
    max: f32,
}

enum Node {
    Model { kind: Kind, slots: Vec<f32>, textured: Vec<Textured>, table: Arc<[f32]> },
    TwoSided { front: MaterialId, back: MaterialId },
    Mask { opacity: Value, base: MaterialId },
    Blend { weight: Value, first: MaterialId, second: MaterialId },
    Sum(Vec<MaterialId>),
    NormalMap { texture: Value, scale: f32, base: MaterialId },
    BumpMap { texture: Value, scale: f32, base: MaterialId },
    Cloth { texture: TextureId, form: Choice },
    Null,
}

/// All materials of a scene.
pub struct Materials {
    nodes: Vec<Node>,
    see_through: Vec<bool>,
    matt: Vec<bool>,
}

/// What the surface is like where a ray met it.
pub struct Point<'a> {
    /// Shading frame.
    pub frame: Frame,
    /// 1, or −1 where a normal map's y runs against the frame's bitangent.
    pub handedness: f32,
    /// Geometric normal.
    pub normal: Vec3,
    /// ∂p/∂u and ∂p/∂v.
    pub dp: [Vec3; 2],
    /// For textures.
    pub lookup: Lookup<'a>,
}

/// How a branch of the material tree is seen.
#[derive(Clone, Copy)]
struct Seen {
    frame: Frame,
    wo: Vec3,
    /// From below and turned over: z of both directions is negated.
    flipped: bool,
    /// Frame differs from the surface's: directions that change sides between the two are dropped.
    perturbed: bool,
}

#[derive(Clone, Copy)]
struct Lobe<'a> {
    bsdf: Bsdf<'a>,
    seen: Seen,
    weight: f32,
    probability: f32,
}

/// Room for the textured parameters of the lobes at one hit.
pub type Scratch = [[f32; MAX_SLOTS]; MAX_LOBES];

/// Fresh room.
pub fn scratch() -> Scratch {
    [[0.0; MAX_SLOTS]; MAX_LOBES]
}

/// A material at one point, seen from one direction.
pub struct Shading<'a> {
    /// Nearly always the only one.
    first: Option<Lobe<'a>>,
    rest: Vec<Lobe<'a>>,
    /// Surface frame, for the side test of perturbed lobes.
    frame: Frame,
    /// Part of the light that goes straight through.
    pub through: f32,
    /// Probability of following it.
    through_probability: f32,
}

/// A drawn direction.
pub struct ShadingSample {
    /// World direction.
    pub wi: Vec3,
    /// f |cos| / pdf.
    pub weight: Vec3,
    /// Solid-angle density; for a Dirac peak the probability of it.
    pub pdf: f32,
    /// A Dirac peak.
    pub delta: bool,
    /// Straight through, as if nothing were there.
    pub null: bool,
    /// Relative index of refraction crossed.
    pub eta: f32,
}

/// A scene's materials could not be prepared.
#[derive(Clone, Debug, thiserror::Error)]
#[error("material {material}: {problem}")]
pub struct MaterialError {
    /// Index in the scene.
    pub material: MaterialId,
    /// What is wrong with it.
    pub problem: String,
}

impl Materials {
    /// Prepares the materials of `scene`.
    pub fn new(scene: &Scene) -> Result<Self, MaterialError> {
        let nodes: Vec<Node> = scene
            .materials
            .iter()
            .enumerate()
            .map(|(id, m)| node(m).map_err(|problem| MaterialError { material: id, problem }))
            .collect::<Result<_, _>>()?;
        let mut materials = Self { nodes, see_through: Vec::new(), matt: Vec::new() };
        for id in 0..materials.nodes.len() {
            let lobes = materials.lobes(id, 0).map_err(|problem| MaterialError { material: id, problem })?;
            if lobes > MAX_LOBES {
                let problem = format!("combines {lobes} models; at most {MAX_LOBES} are possible");
                return Err(MaterialError { material: id, problem });
            }
        }
        materials.see_through = (0..materials.nodes.len()).map(|id| materials.is_see_through(id)).collect();
        materials.matt = (0..materials.nodes.len()).map(|id| materials.is_matt(id)).collect();
        Ok(materials)
    }

    fn lobes(&self, id: MaterialId, depth: usize) -> Result<usize, String> {
        if depth > 32 {
            return Err("contains itself or is nested more than 32 deep".into());
        }
        let node = self.nodes.get(id).ok_or_else(|| format!("there is no material {id}"))?;
        Ok(match node {
            Node::Model { .. } | Node::Cloth { .. } => 1,
            Node::TwoSided { front, back } => {
                self.lobes(*front, depth + 1)?.max(self.lobes(*back, depth + 1)?)
            }
            Node::Mask { base, .. } | Node::NormalMap { base, .. } | Node::BumpMap { base, .. } => {
                self.lobes(*base, depth + 1)?
            }
            Node::Blend { first, second, .. } => {
                self.lobes(*first, depth + 1)? + self.lobes(*second, depth + 1)?
            }
            Node::Sum(all) => all.iter().map(|m| self.lobes(*m, depth + 1)).sum::<Result<_, _>>()?,
            Node::Null => 0,
        })
    }

    fn is_see_through(&self, id: MaterialId) -> bool {
        match &self.nodes[id] {
            Node::Model { .. } | Node::Cloth { .. } => false,
            Node::TwoSided { front, back } => self.is_see_through(*front) || self.is_see_through(*back),
            Node::Mask { .. } | Node::Null => true,
            Node::NormalMap { base, .. } | Node::BumpMap { base, .. } => self.is_see_through(*base),
            Node::Blend { first, second, .. } => self.is_see_through(*first) || self.is_see_through(*second),
            Node::Sum(all) => all.iter().any(|m| self.is_see_through(*m)),
        }
    }

    fn is_matt(&self, id: MaterialId) -> bool {
        match &self.nodes[id] {
            Node::Model { kind, slots, table, .. } => {
                let bsdf = Bsdf::new(*kind, slots, table);
                // Head on and at 60 degrees, into the mirror direction.
                let seen_from = [Vec3::Z, Vec3::new(0.75f32.sqrt(), 0.0, 0.5)];
                let mirror = |w: Vec3| Vec3::new(-w.x, -w.y, w.z);
                !kind.laws().delta && seen_from.iter().all(|wo| bsdf.eval_pdf(*wo, mirror(*wo)).1 <= MATT)
            }
            Node::TwoSided { front, back } => self.is_matt(*front) && self.is_matt(*back),
            Node::Mask { .. } | Node::Null | Node::Cloth { .. } => false,
            Node::NormalMap { base, .. } | Node::BumpMap { base, .. } => self.is_matt(*base),
            Node::Blend { first, second, .. } => self.is_matt(*first) && self.is_matt(*second),
            Node::Sum(all) => all.iter().all(|m| self.is_matt(*m)),
        }
    }

    /// Whether the material draws no direction with much more density than a matt one, where its textures do not say
    /// otherwise.
    pub fn matt(&self, id: MaterialId) -> bool {
        self.matt[id]
    }

    /// Whether any material is matt.
    pub fn any_matt(&self) -> bool {
        self.matt.iter().any(|m| *m)
    }

    /// Whether light can go straight through this material somewhere.
    pub fn see_through(&self, id: MaterialId) -> bool {
        self.see_through[id]
    }

    /// Whether any material lets light straight through.
    pub fn any_see_through(&self) -> bool {
        self.see_through.iter().any(|s| *s)
    }

    /// The material at `point`, seen along world direction `wo` (towards the eye).
    #[inline]
    pub fn shade<'a>(
        &'a self,
        textures: &Textures,
        id: MaterialId,
        point: &Point,
        wo: Vec3,
        scratch: &'a mut Scratch,
    ) -> Shading<'a> {
        let mut shading = Shading {
            first: None,
            rest: Vec::new(),
            frame: point.frame,
            through: 0.0,
            through_probability: 0.0,
        };
        let seen =
            Seen { frame: point.frame, wo: point.frame.to_local(wo), flipped: false, perturbed: false };
        let mut room: &'a mut [[f32; MAX_SLOTS]] = scratch;
        self.resolve(textures, id, point, seen, [1.0; 2], &mut room, &mut shading);
        shading
    }

    /// `share`: weight and probability of this branch of the tree.
    fn resolve<'a>(
        &'a self,
        textures: &Textures,
        id: MaterialId,
        point: &Point,
        seen: Seen,
        share @ [weight, probability]: [f32; 2],
        room: &mut &'a mut [[f32; MAX_SLOTS]],
        out: &mut Shading<'a>,
    ) {
        match &self.nodes[id] {
            Node::Model { kind, slots, textured, table } => {
                let slots: &'a [f32] = if textured.is_empty() {
                    slots
                } else {
                    // `Materials::new` made sure that there is room for every lobe.
                    let Some((own, rest)) = std::mem::take(room).split_first_mut() else { return };
                    *room = rest;
                    let own = &mut own[..slots.len()];
                    own.copy_from_slice(slots);
                    for t in textured {
                        t.look_up(textures, &point.lookup, own);
                    }
                    own
                };
                let lobe = Lobe { bsdf: Bsdf::new(*kind, slots, table), seen, weight, probability };
                if out.first.is_none() {
                    out.first = Some(lobe);
                } else {
                    out.rest.push(lobe);
                }
            }
            Node::TwoSided { front, back } => {
                if seen.wo.z >= 0.0 {
                    self.resolve(textures, *front, point, seen, share, room, out);
                } else {
                    let wo = Vec3::new(seen.wo.x, seen.wo.y, -seen.wo.z);
                    let seen = Seen { wo, flipped: !seen.flipped, ..seen };
                    self.resolve(textures, *back, point, seen, share, room, out);
                }
            }
            Node::Mask { opacity, base } => {
                let opacity = textures.number(opacity, &point.lookup).clamp(0.0, 1.0);
                out.through += (1.0 - opacity) * weight;
                out.through_probability += (1.0 - opacity) * probability;
                if opacity > 0.0 {
                    self.resolve(textures, *base, point, seen, share.map(|s| s * opacity), room, out);
                }
            }
            Node::Blend { weight: of_second, first, second } => {
                let t = textures.number(of_second, &point.lookup).clamp(0.0, 1.0);
                for (id, t) in [(first, 1.0 - t), (second, t)] {
                    if t > 0.0 {
                        self.resolve(textures, *id, point, seen, share.map(|s| s * t), room, out);
                    }
                }
            }
            Node::Sum(all) => {
                for id in all {
                    let share = [weight, probability / all.len() as f32];
                    self.resolve(textures, *id, point, seen, share, room, out);
                }
            }
            Node::NormalMap { texture, scale, base } => {
                let c = textures.rgb(texture, &point.lookup) * 2.0 - 1.0;
                let n = Vec3::new(c.x * scale, c.y * scale * point.handedness, c.z).normalize_or(Vec3::Z);
                // Around the old tangent, as Mitsuba does.
                let local = Frame::from_normal_tangent(n, Vec3::X);
                let old = seen.frame;
                let frame =
                    Frame { s: old.to_world(local.s), t: old.to_world(local.t), n: old.to_world(local.n) };
                let seen = Seen { frame, wo: local.to_local(seen.wo), perturbed: true, ..seen };
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            Node::BumpMap { texture, scale, base } => {
                let slope = textures.gradient(texture, &point.lookup) * *scale;
                let frame = bumped(point, seen.frame, slope);
                let seen =
                    Seen { frame, wo: frame.to_local(seen.frame.to_world(seen.wo)), perturbed: true, ..seen };
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            Node::Cloth { texture, form } => {
                let t = textures.cloth(*texture, &point.lookup);
                // The frame of the maps is +x along u and +y up, against v; mirrored where the picture is.
                let up = -point.dp[1].dot(seen.frame.t);
                let turn = |v: Vec3| Vec3::new(v.x, if up < 0.0 { -v.y } else { v.y }, v.z);
                let local = Frame::from_normal_tangent(turn(t.normal), turn(t.tangent));
                let old = seen.frame;
                let frame =
                    Frame { s: old.to_world(local.s), t: old.to_world(local.t), n: old.to_world(local.n) };
                let seen = Seen { frame, wo: local.to_local(seen.wo), perturbed: true, ..seen };
                let noh = t.noh(*form);
                let Some((own, rest)) = std::mem::take(room).split_first_mut() else { return };
                *room = rest;
                let slots: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&noh));
                let own = &mut own[..slots.len()];
                own.copy_from_slice(slots);
                let lobe = Lobe { bsdf: Bsdf::new(Kind::Noh, own, &[]), seen, weight, probability };
                if out.first.is_none() {
                    out.first = Some(lobe);
                } else {
                    out.rest.push(lobe);
                }
            }
            Node::Null => {
                out.through += weight;
                out.through_probability += probability;
            }
        }
    }
}

impl Textured {
    fn look_up(&self, textures: &Textures, at: &Lookup, slots: &mut [f32]) {
        match self.kind {
            ParamType::Rgb => {
                let c = textures.rgb(&self.value, at).clamp(Vec3::splat(self.min), Vec3::splat(self.max));
                slots[self.slot..self.slot + 3].copy_from_slice(&c.to_array());
            }
            ParamType::Number => {
                slots[self.slot] = textures.number(&self.value, at).clamp(self.min, self.max)
            }
            ParamType::Choice(_) => {}
        }
    }
}

/// Blinn 1978, "Simulation of Wrinkled Surfaces": the frame after raising the surface by a height field with
/// this slope per unit of (u, v).
fn bumped(point: &Point, frame: Frame, slope: Vec2) -> Frame {
    let n = frame.n;
    let dp_du = point.dp[0] + n * (slope.x - n.dot(point.dp[0]));
    let dp_dv = point.dp[1] + n * (slope.y - n.dot(point.dp[1]));
    let mut turned = dp_du.cross(dp_dv).normalize_or(n);
    if turned.dot(point.normal) < 0.0 {
        turned = -turned;
    }
    Frame::from_normal_tangent(turned, point.dp[0])
}

fn node(material: &Material) -> Result<Node, String> {
    Ok(match material {
        Material::Model { kind, params, table } => {
            let expected = kind.params().len();
            if params.len() != expected {
                return Err(format!(
                    "model '{}' has {expected} parameters, {} were given",
                    kind.name(),
                    params.len()
                ));
            }
            let mut slots = Vec::new();
            let mut textured = Vec::new();
            for (p, value) in kind.params().iter().zip(params) {
                let slot = slots.len();
                match (p.kind, value) {
                    (ParamType::Rgb, Value::Number(x)) => slots.extend([*x; 3]),
                    (ParamType::Rgb, Value::Rgb(c)) => slots.extend(c.to_array()),
                    (_, Value::Number(x)) => slots.push(*x),
                    (ParamType::Number, Value::Rgb(c)) => slots.push((c.x + c.y + c.z) / 3.0),
                    (ParamType::Choice(_), _) => {
                        return Err(format!(
                            "parameter '{}' of '{}' is a choice and cannot vary",
                            p.name,
                            kind.name()
                        ));
                    }
                    (_, Value::Texture(_)) => {
                        slots.extend(p.default_slots());
                        textured.push(Textured {
                            slot,
                            kind: p.kind,
                            value: value.clone(),
                            min: p.min,
                            max: p.max,
                        });
                    }
                }
            }
            Node::Model { kind: *kind, slots, textured, table: table.clone() }
        }
        Material::TwoSided { front, back } => Node::TwoSided { front: *front, back: *back },
        Material::Mask { opacity, base } => Node::Mask { opacity: opacity.clone(), base: *base },
        Material::Blend { weight, first, second } => {
            Node::Blend { weight: weight.clone(), first: *first, second: *second }
        }
        Material::Sum(all) => Node::Sum(all.clone()),
        Material::NormalMap { texture, scale, base } => {
            Node::NormalMap { texture: Value::Texture(*texture), scale: *scale, base: *base }
        }
        Material::BumpMap { texture, scale, base } => {
            Node::BumpMap { texture: Value::Texture(*texture), scale: *scale, base: *base }
        }
        Material::Cloth { texture, form } => Node::Cloth { texture: *texture, form: *form },
        Material::Null => Node::Null,
    })
}

impl Lobe<'_> {
    /// World to the frame the model is evaluated in; `None` where a turned frame and the surface disagree
    /// about the side.
    fn local(&self, surface: &Frame, wi: Vec3) -> Option<Vec3> {
        let mut local = self.seen.frame.to_local(wi);
        if self.seen.perturbed && local.z * surface.n.dot(wi) <= 0.0 {
            return None;
        }
        if self.seen.flipped {
            local.z = -local.z;
        }
        Some(local)
    }

    fn world(&self, surface: &Frame, mut wi: Vec3) -> Option<Vec3> {
        if self.seen.flipped {
            wi.z = -wi.z;
        }
        let world = self.seen.frame.to_world(wi);
        (!self.seen.perturbed || wi.z * surface.n.dot(world) > 0.0).then_some(world)
    }
}

impl Shading<'_> {
    fn iter(&self) -> impl Iterator<Item = &Lobe<'_>> {
        self.first.iter().chain(&self.rest)
    }

    /// Whether light sampling can find anything: some lobe is not a mere Dirac peak.
    pub fn smooth(&self) -> bool {
        self.iter().any(|l| !l.bsdf.kind.laws().delta)
    }

    /// Whether all that light sampling can find comes from the side of the eye.
    pub fn one_sided(&self) -> bool {
        self.iter().map(|l| l.bsdf.kind.laws()).all(|laws| laws.delta || !laws.transmits)
    }

    /// f |cos θ_i| and the density of `sample`, without Dirac peaks.
    #[inline]
    pub fn eval_pdf(&self, wi: Vec3) -> (Vec3, f32) {
        let (mut f, mut pdf) = (Vec3::ZERO, 0.0);
        for lobe in self.iter() {
            if let Some(local) = lobe.local(&self.frame, wi) {
                let (lobe_f, lobe_pdf) = lobe.bsdf.eval_pdf(lobe.seen.wo, local);
                f += lobe_f * (lobe.weight * local.z.abs());
                pdf += lobe_pdf * lobe.probability;
            }
        }
        (f, pdf)
    }

    /// f |cos θ_i| as seen from `wo` instead, on the same side of the surface.
    #[inline]
    pub fn eval_from(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let mut f = Vec3::ZERO;
        for lobe in self.iter() {
            if let (Some(wo), Some(wi)) = (lobe.local(&self.frame, wo), lobe.local(&self.frame, wi)) {
                f += lobe.bsdf.eval(wo, wi) * (lobe.weight * wi.z.abs());
            }
        }
        f
    }

    /// Draws a direction from four uniforms.
    #[inline]
    pub fn sample(&self, u: [f32; 4], wo: Vec3) -> Option<ShadingSample> {
        let mut choice = u[2];
        if self.through_probability > 0.0 {
            if choice < self.through_probability {
                let weight = Vec3::splat(self.through / self.through_probability);
                let pdf = self.through_probability;
                return Some(ShadingSample { wi: -wo, weight, pdf, delta: true, null: true, eta: 1.0 });
            }
            choice -= self.through_probability;
        }
        for (i, lobe) in self.iter().enumerate() {
            // The last takes what rounding left over.
            if choice >= lobe.probability && i < self.rest.len() {
                choice -= lobe.probability;
                continue;
            }
            let u = Vec3::new(u[0], u[1], (choice / lobe.probability).clamp(0.0, 1.0 - f32::EPSILON / 2.0));
            let s = lobe.bsdf.sample(lobe.seen.wo, u)?;
            let wi = lobe.world(&self.frame, s.wi)?;
            if s.delta || (self.rest.is_empty() && self.through == 0.0) {
                let weight = s.weight * (lobe.weight / lobe.probability);
                return Some(ShadingSample {
                    wi,
                    weight,
                    pdf: s.pdf * lobe.probability,
                    delta: s.delta,
                    null: false,
                    eta: s.eta,
                });
            }
            let (f, pdf) = self.eval_pdf(wi);
            if pdf <= 0.0 {
                return None;
            }
            return Some(ShadingSample { wi, weight: f / pdf, pdf, delta: false, null: false, eta: s.eta });
        }
        None
    }

    /// Albedo for AOVs.
    pub fn albedo(&self) -> Vec3 {
        self.iter().map(|l| l.bsdf.albedo() * l.weight).sum()
    }
}
