//! Materials at a hit: the tree of a scene's material, resolved to a few lobes with their frames.

use super::texture::{Lookup, Textures};
use crate::{Material, MaterialId, Scene, TextureId, TurnedNormals, Value};
use glam::{Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::Frame;
use yugen_reflectance::{Bsdf, Choice, Kind, MAX_SLOTS, ParamType};

/// Most lobes a material may resolve to; more is refused when the scene is prepared.
pub const MAX_LOBES: usize = 8;

/// Most maps of normals or heights that a material may have in all.
pub const MAX_TURNED: usize = 8;

/// And over one another.
const MAX_TURNS: usize = 4;

/// Largest density, 1/sr, of a matt material into the mirror direction; a cosine lobe's is at most 1/π.
const MATT: f32 = 0.5;

/// A parameter that varies over the surface.
pub(super) struct Textured {
    pub(super) slot: usize,
    pub(super) kind: ParamType,
    pub(super) value: Value,
    pub(super) min: f32,
    pub(super) max: f32,
}

pub(super) enum Node {
    Model { kind: Kind, slots: Vec<f32>, textured: Vec<Textured>, table: Arc<[f32]> },
    TwoSided { front: MaterialId, back: MaterialId },
    Mask { opacity: Value, base: MaterialId },
    Blend { weight: Value, first: MaterialId, second: MaterialId },
    Sum(Vec<MaterialId>),
    NormalMap { texture: Value, scale: f32, turned: TurnedNormals, base: MaterialId },
    BumpMap { texture: Value, scale: f32, turned: TurnedNormals, base: MaterialId },
    Cloth { texture: TextureId, form: Choice },
    Body { absorption: Vec3, base: MaterialId },
    OneSided { base: MaterialId },
    Null,
}

/// All materials of a scene.
pub struct Materials {
    pub(super) nodes: Vec<Node>,
    see_through: Vec<bool>,
    matt: Vec<bool>,
    costly: Vec<bool>,
}

/// What the surface is like where a ray met it.
pub struct ShadingPoint<'a> {
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
struct Seen<'a> {
    /// Left-handed where the surface is seen from below and turned over.
    frame: Frame,
    wo: Vec3,
    turned_over: bool,
    /// From the surface's frame to this one.
    turns: &'a [Turn],
}

/// One frame turned into another by a map.
#[derive(Clone, Copy)]
pub struct Turn {
    /// Normal of the frame before.
    before: Vec3,
    /// Normal of the map, before it was mirrored.
    given: Vec3,
    /// Normal after it.
    after: Vec3,
    /// Whether the map's normal is mirrored for eyes that it looks away from.
    flips: bool,
    /// Squared roughness of the relief that shadows itself; 0: it does not.
    alpha2: f32,
    /// Whether the eye is on different sides of the two.
    crossed: bool,
}

impl Turn {
    /// Part of the light from `wi` that the turned frame gets: none where the two disagree about its side.
    fn shadow(&self, wi: Vec3) -> f32 {
        let cos = self.before.dot(wi);
        if cos * self.after.dot(wi) <= 0.0 {
            return 0.0;
        }
        if self.alpha2 == 0.0 {
            return 1.0;
        }
        let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        2.0 / (1.0 + (1.0 + self.alpha2 * tan2).sqrt())
    }

    /// Whether the map's normal has to be mirrored for `wo` to see it.
    fn mirrored_for(&self, wo: Vec3) -> bool {
        self.flips && self.before.dot(wo) * self.given.dot(wo) <= 0.0
    }
}

#[derive(Clone, Copy)]
struct Lobe<'a> {
    bsdf: Bsdf<'a>,
    seen: Seen<'a>,
    weight: f32,
    probability: f32,
}

/// Room for the textured parameters of the lobes at one hit, and for the turns of their frames.
#[derive(Clone, Copy)]
pub struct Scratch {
    slots: [[f32; MAX_SLOTS]; MAX_LOBES],
    turns: [[Turn; MAX_TURNS]; MAX_TURNED],
}

/// Fresh room.
pub fn scratch() -> Scratch {
    let none =
        Turn { before: Vec3::Z, given: Vec3::Z, after: Vec3::Z, flips: false, alpha2: 0.0, crossed: false };
    Scratch { slots: [[0.0; MAX_SLOTS]; MAX_LOBES], turns: [[none; MAX_TURNS]; MAX_TURNED] }
}

/// What is left of it.
struct Room<'a> {
    slots: &'a mut [[f32; MAX_SLOTS]],
    turns: &'a mut [[Turn; MAX_TURNS]],
}

impl<'a> Room<'a> {
    /// A row of `slots`; `Materials::new` made sure that there is one for every lobe.
    fn slots(&mut self, like: &[f32]) -> Option<&'a mut [f32]> {
        let (row, rest) = std::mem::take(&mut self.slots).split_first_mut()?;
        self.slots = rest;
        let row = row.get_mut(..like.len())?;
        row.copy_from_slice(like);
        Some(row)
    }

    /// `turns` and one more; `Materials::new` made sure that there is room.
    fn turns(&mut self, turns: &[Turn], last: Turn) -> Option<&'a [Turn]> {
        let (row, rest) = std::mem::take(&mut self.turns).split_first_mut()?;
        self.turns = rest;
        let row = row.get_mut(..=turns.len())?;
        row[..turns.len()].copy_from_slice(turns);
        row[turns.len()] = last;
        Some(row)
    }
}

/// A material at one point, seen from one direction.
pub struct Shading<'a> {
    /// Nearly always the only one.
    first: Option<Lobe<'a>>,
    rest: Vec<Lobe<'a>>,
    /// Part of the light that goes straight through.
    pub through: f32,
    /// Probability of following it.
    through_probability: f32,
    /// Absorption, per scene unit, of the body that this is the surface of.
    pub body: Option<Vec3>,
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
        let mut materials = Self { nodes, see_through: Vec::new(), matt: Vec::new(), costly: Vec::new() };
        for id in 0..materials.nodes.len() {
            let lobes = materials.lobes(id, 0).map_err(|problem| MaterialError { material: id, problem })?;
            if lobes > MAX_LOBES {
                let problem = format!("combines {lobes} models; at most {MAX_LOBES} are possible");
                return Err(MaterialError { material: id, problem });
            }
            let [maps, deep] = materials.maps(id);
            if maps > MAX_TURNED || deep > MAX_TURNS {
                let problem = format!(
                    "has {maps} maps of normals or heights, {deep} of them over one another; at most {MAX_TURNED} \
                     and {MAX_TURNS} are possible"
                );
                return Err(MaterialError { material: id, problem });
            }
        }
        materials.see_through = (0..materials.nodes.len()).map(|id| materials.is_see_through(id)).collect();
        materials.matt = (0..materials.nodes.len()).map(|id| materials.is_matt(id)).collect();
        materials.costly = (0..materials.nodes.len()).map(|id| materials.is_costly(id)).collect();
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
            Node::Mask { base, .. }
            | Node::NormalMap { base, .. }
            | Node::BumpMap { base, .. }
            | Node::Body { base, .. }
            | Node::OneSided { base } => self.lobes(*base, depth + 1)?,
            Node::Blend { first, second, .. } => {
                self.lobes(*first, depth + 1)? + self.lobes(*second, depth + 1)?
            }
            Node::Sum(all) => all.iter().map(|m| self.lobes(*m, depth + 1)).sum::<Result<_, _>>()?,
            Node::Null => 0,
        })
    }

    /// Lobes that may be met at one point.
    pub(super) fn most_lobes(&self, id: MaterialId) -> usize {
        self.lobes(id, 0).unwrap_or(MAX_LOBES)
    }

    /// Maps that may be met at one hit, and most over one another. The tree must have been found to be one.
    fn maps(&self, id: MaterialId) -> [usize; 2] {
        let both = |a: MaterialId, b: MaterialId| (self.maps(a), self.maps(b));
        match &self.nodes[id] {
            Node::Model { .. } | Node::Null => [0, 0],
            Node::Cloth { .. } => [1, 1],
            Node::TwoSided { front, back } => {
                let (a, b) = both(*front, *back);
                [a[0].max(b[0]), a[1].max(b[1])]
            }
            Node::Mask { base, .. } | Node::Body { base, .. } | Node::OneSided { base } => self.maps(*base),
            Node::NormalMap { base, .. } | Node::BumpMap { base, .. } => self.maps(*base).map(|n| n + 1),
            Node::Blend { first, second, .. } => {
                let (a, b) = both(*first, *second);
                [a[0] + b[0], a[1].max(b[1])]
            }
            Node::Sum(all) => {
                let add = |a: [usize; 2], b: [usize; 2]| [a[0] + b[0], a[1].max(b[1])];
                all.iter().map(|m| self.maps(*m)).fold([0, 0], add)
            }
        }
    }

    fn is_see_through(&self, id: MaterialId) -> bool {
        match &self.nodes[id] {
            Node::Model { .. } | Node::Cloth { .. } => false,
            Node::TwoSided { front, back } => self.is_see_through(*front) || self.is_see_through(*back),
            Node::Mask { .. } | Node::OneSided { .. } | Node::Null => true,
            Node::NormalMap { base, .. } | Node::BumpMap { base, .. } | Node::Body { base, .. } => {
                self.is_see_through(*base)
            }
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
            Node::Mask { .. }
            | Node::OneSided { .. }
            | Node::Null
            | Node::Cloth { .. }
            | Node::Body { .. } => false,
            Node::NormalMap { base, .. } | Node::BumpMap { base, .. } => self.is_matt(*base),
            Node::Blend { first, second, .. } => self.is_matt(*first) && self.is_matt(*second),
            Node::Sum(all) => all.iter().all(|m| self.is_matt(*m)),
        }
    }

    fn is_costly(&self, id: MaterialId) -> bool {
        match &self.nodes[id] {
            Node::Model { kind, .. } => kind.costly(),
            Node::Null | Node::Cloth { .. } => false,
            Node::TwoSided { front, back } => self.is_costly(*front) || self.is_costly(*back),
            Node::Blend { first, second, .. } => self.is_costly(*first) || self.is_costly(*second),
            Node::Sum(all) => all.iter().any(|m| self.is_costly(*m)),
            Node::Mask { base, .. }
            | Node::OneSided { base }
            | Node::Body { base, .. }
            | Node::NormalMap { base, .. }
            | Node::BumpMap { base, .. } => self.is_costly(*base),
        }
    }

    /// Whether the material draws no direction with much more density than a matt one, where its textures do not say
    /// otherwise.
    pub fn matt(&self, id: MaterialId) -> bool {
        self.matt[id]
    }

    /// Whether pixels that see this material may share the ends of their paths: it is matt, and an end is looked at
    /// from eight pixels and more, which pays only where that costs no more than the ray to it.
    pub fn shares(&self, id: MaterialId) -> bool {
        self.matt[id] && !self.costly[id]
    }

    /// Whether pixels may share anything.
    pub fn any_shares(&self) -> bool {
        (0..self.nodes.len()).any(|id| self.shares(id))
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
        point: &ShadingPoint,
        wo: Vec3,
        scratch: &'a mut Scratch,
    ) -> Shading<'a> {
        let mut shading =
            Shading { first: None, rest: Vec::new(), through: 0.0, through_probability: 0.0, body: None };
        let seen = Seen { frame: point.frame, wo: point.frame.to_local(wo), turned_over: false, turns: &[] };
        let mut room = Room { slots: &mut scratch.slots, turns: &mut scratch.turns };
        self.resolve(textures, id, point, seen, [1.0; 2], &mut room, &mut shading);
        shading
    }

    /// `share`: weight and probability of this branch of the tree.
    fn resolve<'a>(
        &'a self,
        textures: &Textures,
        id: MaterialId,
        point: &ShadingPoint,
        seen: Seen<'a>,
        share @ [weight, probability]: [f32; 2],
        room: &mut Room<'a>,
        out: &mut Shading<'a>,
    ) {
        match &self.nodes[id] {
            Node::Model { kind, slots, textured, table } => {
                let slots: &'a [f32] = if textured.is_empty() {
                    slots
                } else {
                    let Some(own) = room.slots(slots) else { return };
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
                    let frame = Frame { n: -seen.frame.n, ..seen.frame };
                    let seen = Seen { frame, wo, turned_over: !seen.turned_over, ..seen };
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
            Node::NormalMap { texture, scale, turned, base } => {
                let c = textures.rgb(texture, &point.lookup) * 2.0 - 1.0;
                let n = Vec3::new(c.x * scale, c.y * scale * point.handedness, c.z).normalize_or(Vec3::Z);
                // Around the old tangent, as Mitsuba does.
                let Some(seen) = seen.turn(n, |_| Vec3::X, *turned, room) else { return };
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            Node::BumpMap { texture, scale, turned, base } => {
                let slope = textures.gradient(texture, &point.lookup) * *scale;
                // Of the surface as it lies, whichever side it is seen from. The same relief rises from the other side.
                let old = seen.frame;
                let old = Frame { n: if seen.turned_over { -old.n } else { old.n }, ..old };
                let n = old.to_local(bumped(point, old.n, slope));
                let tangent = old.to_local(point.dp[0]);
                let Some(seen) = seen.turn(n, |_| tangent, *turned, room) else { return };
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            Node::Cloth { texture, form } => {
                let t = textures.cloth(*texture, &point.lookup);
                // The frame of the maps is +x along u and +y up, against v; mirrored where the picture is.
                let up = -point.dp[1].dot(seen.frame.t);
                let turn = |v: Vec3| Vec3::new(v.x, if up < 0.0 { -v.y } else { v.y }, v.z);
                // What was fitted to photographs has the shadows of its threads in it already.
                let turned = TurnedNormals { use_shadowing_function: false, ..TurnedNormals::default() };
                let tangent = turn(t.tangent);
                let tangent =
                    |mirrored| if mirrored { Vec3::new(-tangent.x, -tangent.y, tangent.z) } else { tangent };
                let Some(seen) = seen.turn(turn(t.normal), tangent, turned, room) else { return };
                let noh = t.noh(*form);
                let slots: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&noh));
                let Some(own) = room.slots(slots) else { return };
                let lobe = Lobe { bsdf: Bsdf::new(Kind::Noh, own, &[]), seen, weight, probability };
                if out.first.is_none() {
                    out.first = Some(lobe);
                } else {
                    out.rest.push(lobe);
                }
            }
            Node::Body { absorption, base } => {
                out.body = Some(*absorption);
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            // By the geometric normal: shading normals would open smooth outlines.
            Node::OneSided { base } if point.normal.dot(seen.frame.to_world(seen.wo)) >= 0.0 => {
                self.resolve(textures, *base, point, seen, share, room, out);
            }
            Node::OneSided { .. } | Node::Null => {
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

/// Blinn 1978, "Simulation of Wrinkled Surfaces": the normal `n` after raising the surface by a height field with this
/// slope per unit of (u, v).
fn bumped(point: &ShadingPoint, n: Vec3, slope: Vec2) -> Vec3 {
    let dp_du = point.dp[0] + n * (slope.x - n.dot(point.dp[0]));
    let dp_dv = point.dp[1] + n * (slope.y - n.dot(point.dp[1]));
    let turned = dp_du.cross(dp_dv).normalize_or(n);
    if turned.dot(point.normal) < 0.0 { -turned } else { turned }
}

impl<'a> Seen<'a> {
    /// Seen in the frame around the unit normal `given`, which is in the frame of now, and the part perpendicular to it
    /// of a tangent: that for a normal that has been mirrored, or for one that has not.
    fn turn(
        self,
        given: Vec3,
        tangent: impl Fn(bool) -> Vec3,
        turned: TurnedNormals,
        room: &mut Room<'a>,
    ) -> Option<Self> {
        let old = self.frame;
        let mirrored = turned.flip_invalid_normals && self.wo.z * given.dot(self.wo) <= 0.0;
        let n = if mirrored { Vec3::new(-given.x, -given.y, given.z) } else { given };
        let local = Frame::from_normal_tangent(n, tangent(mirrored));
        let frame = Frame { s: old.to_world(local.s), t: old.to_world(local.t), n: old.to_world(local.n) };
        let wo = local.to_local(self.wo);
        let mut alpha2 = 0.0;
        if turned.use_shadowing_function {
            // Conty Estevez et al.: the relief as GGX, an eighth of the squared tangent, at most 1.
            let cos2 = n.z * n.z;
            alpha2 = if cos2 > 0.0 { (0.125 * (1.0 - cos2).max(0.0) / cos2).min(1.0) } else { 1.0 };
        }
        let turn = Turn {
            before: old.n,
            given: if mirrored { old.to_world(given) } else { frame.n },
            after: frame.n,
            flips: turned.flip_invalid_normals,
            alpha2,
            crossed: self.wo.z * wo.z <= 0.0,
        };
        Some(Seen { frame, wo, turns: room.turns(self.turns, turn)?, ..self })
    }
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
        Material::NormalMap { texture, scale, turned, base } => {
            let texture = Value::Texture(*texture);
            Node::NormalMap { texture, scale: *scale, turned: *turned, base: *base }
        }
        Material::BumpMap { texture, scale, turned, base } => {
            let texture = Value::Texture(*texture);
            Node::BumpMap { texture, scale: *scale, turned: *turned, base: *base }
        }
        Material::Cloth { texture, form } => Node::Cloth { texture: *texture, form: *form },
        Material::Body { absorption, base } => Node::Body { absorption: *absorption, base: *base },
        Material::OneSided { base } => Node::OneSided { base: *base },
        Material::Null => Node::Null,
    })
}

impl Lobe<'_> {
    /// Part of the light from `wi` that the maps over this lobe let through.
    #[inline]
    fn shadow(&self, wi: Vec3) -> f32 {
        self.seen.turns.iter().map(|t| t.shadow(wi)).product()
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
        self.iter().all(|l| {
            let laws = l.bsdf.kind.laws();
            laws.delta || !laws.transmits && !l.seen.turns.iter().any(|t| t.crossed)
        })
    }

    /// Whether maps of normals turn the surface alike for two eyes, and both see the same side of what is turned.
    pub fn turned_alike(&self, eye: Vec3, wo: Vec3) -> bool {
        let alike = |t: &Turn| {
            let side = |w: Vec3| (t.mirrored_for(w), t.after.dot(w) > 0.0);
            side(eye) == side(wo)
        };
        self.iter().flat_map(|l| l.seen.turns).all(alike)
    }

    /// f |cos θ_i| and the density of `sample`, without Dirac peaks.
    #[inline]
    pub fn eval_pdf(&self, wi: Vec3) -> (Vec3, f32) {
        let (mut f, mut pdf) = (Vec3::ZERO, 0.0);
        for lobe in self.iter() {
            let local = lobe.seen.frame.to_local(wi);
            let mut weight = lobe.weight;
            if !lobe.seen.turns.is_empty() {
                let shadow = lobe.shadow(wi);
                if shadow == 0.0 {
                    continue;
                }
                weight *= shadow;
            }
            let (lobe_f, lobe_pdf) = lobe.bsdf.eval_pdf(lobe.seen.wo, local);
            f += lobe_f * (weight * local.z.abs());
            pdf += lobe_pdf * lobe.probability;
        }
        (f, pdf)
    }

    /// f |cos θ_i| as seen from `wo` instead, on the same side of the surface and [`turned_alike`](Self::turned_alike).
    #[inline]
    pub fn eval_from(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let mut f = Vec3::ZERO;
        for lobe in self.iter() {
            let [wo, local] = [wo, wi].map(|w| lobe.seen.frame.to_local(w));
            let mut weight = lobe.weight;
            if !lobe.seen.turns.is_empty() {
                weight *= lobe.shadow(wi);
            }
            f += lobe.bsdf.eval(wo, local) * (weight * local.z.abs());
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
            let wi = lobe.seen.frame.to_world(s.wi);
            let mut weight = s.weight * (lobe.weight / lobe.probability);
            if !lobe.seen.turns.is_empty() {
                let shadow = lobe.shadow(wi);
                if shadow == 0.0 {
                    return None;
                }
                weight *= shadow;
            }
            if s.delta || (self.rest.is_empty() && self.through == 0.0) {
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

    /// Mean normal of its lobes, on the side that `side` points to; `side` itself where there are none.
    pub fn normal_towards(&self, side: Vec3) -> Vec3 {
        let mean: Vec3 = self.iter().map(|l| l.seen.frame.n * l.weight).sum();
        let mean = mean.normalize_or(side);
        if mean.dot(side) < 0.0 { -mean } else { mean }
    }

    /// Albedo for AOVs.
    pub fn albedo(&self) -> Vec3 {
        self.iter().map(|l| l.bsdf.albedo() * l.weight).sum()
    }
}
