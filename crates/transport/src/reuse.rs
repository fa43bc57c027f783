//! Neighbouring pixels share the ends of their paths.
//!
//! Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing by Re-Using Paths". What a path finds behind its first
//! bounce, at y, is light for the first surfaces x of the neighbours too. A pixel so gets the bounced light of as
//! many paths as the group has, for a shadow ray each. Every x might have found y itself, with a density of its own;
//! the balance heuristic over all of them (Veach 1997) keeps the sum unbiased, edges and all.
//!
//! Only matt surfaces share: where x or y gleams, what one sees is nothing to the other, and the rays are wasted. Nor do
//! models share that take longer than a ray to ask.

use crate::geometry::offset_origin;
use crate::integrator::{DenoiseFeatures, Follow, IncidentLight, PathState, Radiance, Vertex, World};
use crate::lights::BACKGROUND;
use crate::sampler::Sampler;
use glam::Vec3;
use yugen_scene::prepared::{Scratch, scratch};

/// Pixels of a group, across and down.
pub const GROUP: [u32; 2] = [4, 2];
/// And together.
const SIZE: usize = (GROUP[0] * GROUP[1]) as usize;

/// Directions that a neighbour would hardly ever have drawn are not shared.
const RARE: f32 = 0.01;

/// Memory for one thread's group.
pub struct GroupScratch {
    first: [Scratch; SIZE],
    second: [Scratch; SIZE],
    later: Scratch,
    for_shadows: Scratch,
}

impl GroupScratch {
    /// Fresh.
    pub fn new() -> Box<Self> {
        Box::new(Self {
            first: [scratch(); SIZE],
            second: [scratch(); SIZE],
            later: scratch(),
            for_shadows: scratch(),
        })
    }

    /// For a path that goes alone.
    pub(crate) fn of_one(&mut self) -> [&mut Scratch; 2] {
        [&mut self.later, &mut self.for_shadows]
    }
}

/// The end of a path: what comes to y, and how x got there.
struct End<'a> {
    /// At y.
    vertex: Vertex<'a>,
    /// Up to two: from a light, and from further on.
    incident: [Option<IncidentLight>; 2],
    /// With which x drew the direction to y.
    pdf: f32,
    /// One over the chance that roulette gave the path at x.
    boost: f32,
}

/// x_k as seen from the y of another path.
#[derive(Clone, Copy, Default)]
struct Link {
    /// Unit, from y to x_k.
    wo: Vec3,
    /// f |cos| at x_k towards y, times the solid angle there of an area at y.
    f: Vec3,
    /// Density per area with which x_k finds y; 0: it never does, or does not see it.
    density: f32,
}

impl World {
    /// Whether neighbouring pixels could share anything.
    pub fn can_share(&self, follow: &Follow) -> bool {
        // Nothing is shared through surfaces that let light pass: the way between two points has no one length. Nor is
        // it clear what a path brings that many share, and so what of it to clamp.
        follow.max_depth() > 2
            && follow.settings.clamp.is_none()
            // Nor from which light what many share has come.
            && follow.groups.is_none()
            && !self.see_through()
            && !self.lights.has_volumes()
            && self.materials.any_shares()
    }

    /// Radiance along the `rays` of a group of pixels, one ray and sampler each. Returns how much of it, summed over
    /// pixels and colours, came by shared ends of paths.
    pub fn radiance_of_group(
        &self,
        follow: &Follow,
        paths: &mut [(crate::accel::Ray, Sampler)],
        scratch: &mut GroupScratch,
        out: &mut [Radiance],
    ) -> f64 {
        let n = paths.len().min(SIZE);
        let GroupScratch { first, second, later, for_shadows } = scratch;
        let mut states: [Option<PathState>; SIZE] = [None; SIZE];
        let mut xs: [Option<Vertex>; SIZE] = [const { None }; SIZE];
        for (i, scratch) in first.iter_mut().enumerate().take(n) {
            let mut path = PathState::new(follow, paths[i].0);
            xs[i] = self.next_vertex(follow, &mut path, scratch, &mut out[i]);
            states[i] = Some(path);
        }
        let mut ends: [Option<End>; SIZE] = [const { None }; SIZE];
        // Those that share.
        let sharing: [Option<&Vertex>; SIZE] =
            std::array::from_fn(|i| xs[i].as_ref().filter(|x| self.materials.shares(x.surface.material)));
        for (i, scratch) in second.iter_mut().enumerate().take(n) {
            let (Some(x), Some(path), sampler, out) = (&xs[i], &mut states[i], &mut paths[i].1, &mut out[i])
            else {
                continue;
            };
            let Some((s, boost)) = self.bounce(follow, path, x, sampler, for_shadows, out) else { continue };
            if sharing[i].is_none() || s.delta || s.null || s.pdf < RARE {
                self.radiance(follow, path, sampler, [&mut *later, &mut *for_shadows], out);
                continue;
            }
            let Some(vertex) = self.next_vertex(follow, path, scratch, out) else { continue };
            if !self.materials.shares(vertex.surface.material) {
                self.radiance_from(follow, path, &vertex, sampler, [&mut *later, &mut *for_shadows], out);
                continue;
            }
            let incident =
                self.incident(follow, path, &vertex, sampler, [&mut *later, &mut *for_shadows], out);
            ends[i] = Some(End { vertex, incident, pdf: s.pdf, boost });
        }
        let mut shared = Vec3::ZERO;
        for (j, end) in ends.iter().enumerate() {
            if let Some(end) = end {
                shared += self.share(&sharing, j, end, for_shadows, out);
            }
        }
        f64::from(shared.element_sum())
    }

    /// What comes to `vertex`, the y of a path: from a light and from further on. What cannot be shared is added to
    /// `out`.
    fn incident(
        &self,
        follow: &Follow,
        path: &mut PathState,
        vertex: &Vertex,
        sampler: &mut Sampler,
        [later, for_shadows]: [&mut Scratch; 2],
        out: &mut Radiance,
    ) -> [Option<IncidentLight>; 2] {
        sampler.at_vertex(path.depth);
        let (u_light, u_bsdf) = (sampler.next_4d(), sampler.next_4d());
        let straight = self.light(follow, path, vertex, u_light, for_shadows);
        let Some(s) = vertex.shading.sample(u_bsdf, vertex.wo) else { return [straight, None] };
        let carried = path.throughput * s.weight;
        let Some(boost) = self.scatter(follow, path, vertex, &s, u_bsdf[3]) else { return [straight, None] };
        if s.delta || s.null {
            self.radiance(follow, path, sampler, [&mut *later, &mut *for_shadows], out);
            return [straight, None];
        }
        // From here on the path is followed for whoever looks at y.
        path.before = carried;
        path.throughput = Vec3::splat(boost);
        let mut found = Radiance { alpha: 1.0, features: DenoiseFeatures::of_none(), ..Radiance::default() };
        self.radiance(follow, path, sampler, [&mut *later, &mut *for_shadows], &mut found);
        let (f, _) = vertex.shading.eval_pdf(s.wi);
        [straight, Some(IncidentLight { wi: s.wi, from: BACKGROUND, radiance: found.rgb / s.pdf, f })]
    }

    /// Gives the end of path `j` to all of the group; returns what that was.
    fn share(
        &self,
        xs: &[Option<&Vertex>; SIZE],
        j: usize,
        end: &End,
        for_shadows: &mut Scratch,
        out: &mut [Radiance],
    ) -> Vec3 {
        if end.incident.iter().flatten().all(|a| a.radiance == Vec3::ZERO) {
            return Vec3::ZERO;
        }
        let y = &end.vertex.surface;
        // The two sides of y are two different ends.
        let side = |wo: Vec3| [y.geometric_normal, y.frame.n].map(|n| n.dot(wo) > 0.0);
        let mut links = [Link::default(); SIZE];
        for (k, x) in xs.iter().enumerate() {
            let Some(x) = x else { continue };
            let to = x.surface.position - y.position;
            let distance2 = to.length_squared();
            let wo = if k == j { end.vertex.wo } else { to / distance2.sqrt() };
            let cos = y.geometric_normal.dot(wo);
            if side(wo) != side(end.vertex.wo) || distance2 <= 0.0 {
                continue;
            }
            // So are two ways in which a map turns it.
            if !end.vertex.shading.turned_alike(end.vertex.wo, wo) {
                continue;
            }
            let (f, pdf) = x.shading.eval_pdf(-wo);
            let pdf = if k == j { end.pdf } else { pdf };
            if pdf < RARE {
                continue;
            }
            if k != j {
                let from =
                    offset_origin(x.surface.position, x.surface.error, x.surface.geometric_normal, -wo);
                let way = y.position - from;
                let distance = way.length();
                if self.visibility(from, way / distance, distance, 0, for_shadows) <= 0.0 {
                    continue;
                }
            }
            let solid_angle = cos.abs() / distance2;
            links[k] = Link { wo, f: f * solid_angle, density: pdf * solid_angle };
        }
        let density: f32 = links.iter().map(|l| l.density).sum();
        let mut given = Vec3::ZERO;
        for incident in end.incident.iter().flatten() {
            for (k, link) in links.iter().enumerate().filter(|(_, l)| l.density > 0.0) {
                let f = if k == j { incident.f } else { end.vertex.shading.eval_from(link.wo, incident.wi) };
                let light = link.f * f * incident.radiance * (end.boost / density);
                out[k].rgb += light;
                given += light;
            }
        }
        given
    }
}
