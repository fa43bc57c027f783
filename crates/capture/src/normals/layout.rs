//! How the texels of a band are lit and seen, for all that goes through them eight after eight.

use super::stereo::{self, Light};
use crate::readings::{Reading, Readings};
use glam::Vec3;

/// What the texels of a band have in common: `T` is a reading's light and eye in the form that is computed with.
pub(crate) struct Layout<T> {
    /// Where all are lit and seen from the same directions: indices of the readings that are used, and those themselves.
    pub common: Option<(Vec<usize>, Vec<T>)>,
    /// Where all have the same lamps and cameras in the same order: from which readings normals may start.
    pub triplets: Option<Vec<[usize; 3]>>,
}

impl<T> Layout<T> {
    /// `of` says what a reading is, `None` if it tells nothing; `light` gives its light.
    pub fn new(
        readings: &impl Readings,
        of: impl Fn(Reading) -> Option<T>,
        light: impl Fn(&T) -> Light,
    ) -> Self {
        let middle = readings.texels() / 2;
        let all = if readings.texels() == 0 { 0 } else { readings.values(middle).len() };
        let used = |i: usize| of(readings.reading(middle, i));
        let toward = |t: &T| light(t).toward();
        if readings.in_common() {
            let (used, all): (Vec<usize>, Vec<T>) = (0..all).filter_map(|i| Some((i, used(i)?))).unzip();
            let triplets = stereo::triplets(&all.iter().map(toward).collect::<Vec<_>>());
            return Self { common: Some((used, all)), triplets: Some(triplets) };
        }
        let triplets = readings.in_order().then(|| {
            let toward = |i: usize| used(i).map_or(Vec3::ZERO, |t| toward(&t));
            stereo::triplets(&(0..all).map(toward).collect::<Vec<_>>())
        });
        Self { common: None, triplets }
    }
}
