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
use crate::normals::layout::Layout;
use crate::normals::stereo::{self, Light};
use crate::readings::{Reading, Readings};

/// What the texels of a band have in common.
pub(super) struct Fitter<'a, R> {
    readings: &'a R,
    layout: Layout<Ray>,
    /// Of the readings that are used, where they are the same for all texels.
    lights: Vec<Light>,
}

impl<'a, R: Readings> Fitter<'a, R> {
    pub fn new(readings: &'a R) -> Self {
        let layout = Layout::new(readings, of_reading, light_of);
        let lights = layout.common.iter().flat_map(|(_, rays)| rays.iter().map(light_of)).collect();
        Self { readings, layout, lights }
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
            let Layout { common, triplets } = &self.layout;
            let found = if let (Some((used, rays)), Some(triplets)) = (common, triplets) {
                scratch.gather(used, values, options);
                work.of(Geometry { rays: Common(rays), lights: &self.lights, triplets }, scratch)
            } else {
                let most = texels.iter().map(|t| self.readings.values(*t).len()).max().unwrap_or(0);
                scratch.gather(&(0..most).collect::<Vec<_>>(), values, options);
                let mut own = std::mem::take(&mut scratch.own);
                own.clear();
                own.resize(most, BESIDE.map(F::splat));
                for (lane, &t) in texels.iter().enumerate() {
                    for (i, own) in own.iter_mut().enumerate().take(self.readings.values(t).len()) {
                        match of_reading(self.readings.reading(t, i)) {
                            Some(ray) => own.iter_mut().zip(ray).for_each(|(to, v)| to.0[lane] = v),
                            None => scratch.stated[i].0[lane] = 0.0,
                        }
                    }
                }
                let lights: Vec<Light> = own.iter().map(|ray| Light::of_ray(*ray)).collect();
                let theirs;
                let triplets = match triplets {
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

fn of_reading(Reading { light, eye, irradiance }: Reading) -> Option<Ray> {
    ray(light, eye, irradiance)
}

fn light_of(ray: &Ray) -> Light {
    Light::of_ray(ray.map(F::splat))
}

fn triplets_of(lights: &[Light]) -> Vec<[usize; 3]> {
    stereo::triplets(&lights.iter().map(Light::toward).collect::<Vec<_>>())
}

/// Stands where there is no reading.
const BESIDE: Ray = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
