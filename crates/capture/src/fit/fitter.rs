//! Texels of a band, eight after eight.

use super::block::{FullFit, GroundOnly};
use super::choice;
use super::fitted::Options;
use super::outcome::Outcome;
use super::prior::Prior;
use super::rays::{Common, Own, Ray, ray};
use super::scratch::Scratch;
use super::task::{BlockWork, Geometry, Task};
use crate::lanes::{F, LANES};
use crate::normals::stereo::{self, Light};
use crate::readings::{Reading, Readings};
use glam::Vec3;

/// What the texels of a band have in common.
pub(super) struct Fitter<'a, R> {
    readings: &'a R,
    common: Option<Shared>,
    /// Where all texels have the same lamps and cameras in the same order.
    triplets: Option<Vec<[usize; 3]>>,
}

/// Where all texels are lit and seen from the same directions.
struct Shared {
    /// Indices of the readings that are used.
    used: Vec<usize>,
    rays: Vec<Ray>,
    lights: Vec<Light>,
}

impl<'a, R: Readings> Fitter<'a, R> {
    pub fn new(readings: &'a R) -> Self {
        let middle = readings.texels() / 2;
        let all = if readings.texels() == 0 { 0 } else { readings.values(middle).len() };
        if readings.in_common() {
            let ray = |i: usize| Some((i, ray_of(readings, middle, i)?));
            let (used, rays): (_, Vec<Ray>) = (0..all).filter_map(ray).unzip();
            let lights: Vec<Light> = rays.iter().map(|r| Light::of_ray(r.map(F::splat))).collect();
            let triplets = Some(triplets_of(&lights));
            return Self { readings, common: Some(Shared { used, rays, lights }), triplets };
        }
        let triplets = readings.in_order().then(|| {
            let toward = |i: usize| {
                ray_of(readings, middle, i).map_or(Vec3::ZERO, |r| Vec3::new(r[3], r[4], r[5]).normalize())
            };
            stereo::triplets(&(0..all).map(toward).collect::<Vec<_>>())
        });
        Self { readings, common: None, triplets }
    }

    /// Fits texels, and those that are in doubt again with more starts.
    pub fn fit(&self, task: &Task, texels: &[usize], scratch: &mut Scratch) -> Vec<Outcome> {
        let masked = |texel: usize| !self.readings.values(texel).iter().flatten().any(|v| v.is_finite());
        let mut outcomes: Vec<Option<Outcome>> =
            texels.iter().map(|t| masked(*t).then_some(Outcome::NONE)).collect();
        let mut rest: Vec<usize> = (0..texels.len()).filter(|i| outcomes[*i].is_none()).collect();
        // Texels of each step are put together anew, so that eight of them go in step.
        let most_odds = task.prior.map_or(0.0, Prior::most_odds);
        if task.settle && task.options.surface.is_some() && choice::may_settle(most_odds) {
            let chosen: Vec<usize> = rest.iter().map(|i| texels[*i]).collect();
            self.blocks(&chosen, task.options, scratch, GroundOnly { task }, |i, settled| {
                outcomes[rest[i]] = settled
            });
            rest.retain(|i| outcomes[*i].is_none());
        }
        for twice in [false, true] {
            if twice && !task.twice {
                break;
            }
            let task = Task { twice, ..*task };
            let chosen: Vec<usize> = rest.iter().map(|i| texels[*i]).collect();
            self.blocks(&chosen, task.options, scratch, FullFit { task: &task }, |i, outcome| {
                outcomes[rest[i]] = Some(outcome);
            });
            rest.retain(|i| outcomes[*i].as_ref().is_some_and(|o| o.doubtful));
        }
        outcomes.into_iter().flatten().collect()
    }

    /// Does something with the readings of eight texels after the other; `put` hears what comes out, and of which.
    fn blocks<W: BlockWork>(
        &self,
        texels: &[usize],
        options: &Options,
        scratch: &mut Scratch,
        work: W,
        mut put: impl FnMut(usize, W::Out),
    ) {
        for (block, texels) in texels.chunks(LANES).enumerate() {
            let values = |lane: usize| texels.get(lane).map(|t| self.readings.values(*t));
            let found = if let (Some(Shared { used, rays, lights }), Some(triplets)) =
                (&self.common, &self.triplets)
            {
                scratch.gather(used, values, options);
                work.of(Geometry { rays: Common(rays), lights, triplets }, scratch)
            } else {
                let most = texels.iter().map(|t| self.readings.values(*t).len()).max().unwrap_or(0);
                scratch.gather(&(0..most).collect::<Vec<_>>(), values, options);
                let mut own = std::mem::take(&mut scratch.own);
                own.clear();
                own.resize(most, BESIDE.map(F::splat));
                for (lane, &t) in texels.iter().enumerate() {
                    for (i, own) in own.iter_mut().enumerate().take(self.readings.values(t).len()) {
                        match ray_of(self.readings, t, i) {
                            Some(ray) => own.iter_mut().zip(ray).for_each(|(to, v)| to.0[lane] = v),
                            None => scratch.stated[i].0[lane] = 0.0,
                        }
                    }
                }
                let lights: Vec<Light> = own.iter().map(|ray| Light::of_ray(*ray)).collect();
                let theirs;
                let triplets = match &self.triplets {
                    Some(triplets) => triplets,
                    None => {
                        theirs = triplets_of(&lights);
                        &theirs
                    }
                };
                let found = work.of(Geometry { rays: Own(&own), lights: &lights, triplets }, scratch);
                scratch.own = own;
                found
            };
            for (i, found) in found.into_iter().take(texels.len()).enumerate() {
                put(block * LANES + i, found);
            }
        }
    }
}

fn ray_of(readings: &impl Readings, texel: usize, i: usize) -> Option<Ray> {
    let Reading { light, eye, irradiance } = readings.reading(texel, i);
    ray(light, eye, irradiance)
}

fn triplets_of(lights: &[Light]) -> Vec<[usize; 3]> {
    stereo::triplets(&lights.iter().map(Light::toward).collect::<Vec<_>>())
}

/// Stands where there is no reading.
const BESIDE: Ray = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
