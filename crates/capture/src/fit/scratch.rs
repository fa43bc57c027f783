//! What a thread works in.

use super::fitted::Options;
use crate::lanes::{F, LANES};

/// The readings of eight texels.
#[derive(Default)]
pub(super) struct Scratch {
    /// Mean of the channels, one a reading.
    pub value: Vec<F>,
    pub channels: [Vec<F>; 3],
    /// 1/σ of the value; 0 where there is none. As the noise was said, and as what works makes it.
    pub stated: Vec<F>,
    pub weight: Vec<F>,
    /// The same after the robust loss.
    pub counted: Vec<F>,
    pub own: Vec<[F; 6]>,
    /// Readings to be sorted.
    pub order: Vec<(f32, usize)>,
}

impl Scratch {
    /// Turns the readings of up to eight texels on their side.
    pub fn gather<'a>(
        &mut self,
        used: &[usize],
        values: impl Fn(usize) -> Option<&'a [[f32; 3]]>,
        options: &Options,
    ) {
        let n = used.len();
        for list in
            [&mut self.value, &mut self.stated, &mut self.counted].into_iter().chain(&mut self.channels)
        {
            list.clear();
            list.resize(n, F::ZERO);
        }
        for (lane, values) in (0..LANES).filter_map(|lane| Some((lane, values(lane)?))) {
            for (to, &from) in used.iter().enumerate() {
                let Some(rgb) = values.get(from) else { continue };
                let value = (rgb[0] + rgb[1] + rgb[2]) * (1.0 / 3.0);
                if !value.is_finite() {
                    continue;
                }
                for (channel, v) in self.channels.iter_mut().zip(*rgb) {
                    channel[to].0[lane] = v;
                }
                self.value[to].0[lane] = value;
                self.stated[to].0[lane] = 1.0 / (options.noise * value.max(0.0) + options.floor);
            }
        }
    }

    /// How many readings each texel has.
    pub fn usable(&self) -> [usize; LANES] {
        std::array::from_fn(|lane| self.stated.iter().filter(|w| w.0[lane] > 0.0).count())
    }
}
