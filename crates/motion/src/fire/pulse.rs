//! How strongly a fire burns at an instant: a resonant process, as a sum of cosines, so that any instant is known without
//! those before it.

use std::f64::consts::{PI, TAU};
use yugen_optics::random::Pcg32;

/// Frequency of puffing times the root of the diameter, Hz √m. Cetegen and Ahmed 1993 and Pagni 1990 have 1.5 for pool fires
/// of .01 to 60 m; others find 1.2 to 1.55. A tenth to either side is one fire's own spread.
const PUFFING: f64 = 1.42;
/// Bandwidth of the resonance (standard deviation) over its frequency. Assumed: visibly irregular, still a rhythm.
const BANDWIDTH: f64 = 0.08;
/// What part of the variance is the resonance's. Assumed.
const RESONANT: f64 = 0.55;
/// Below this part of the puffing frequency the spectrum is level: nobody has measured wood fires for hours.
const LEVEL: f64 = 0.07;
/// Fall of the spectrum above the resonance; candle flames have 2.9 (3 to 12 Hz).
const FALL: f64 = 2.2;
/// Nothing is faster, Hz; the last quarter below fades.
const FASTEST: f64 = 19.0;
/// What turns the normal process into one with more high peaks than deep troughs. Fires are that: skew .5 to 3.
const SKEW: f64 = 0.14;

#[derive(Clone, Debug)]
struct Line {
    frequency: f64,
    amplitude: f64,
    phase: f64,
}

/// The process of one fire: mean 0, standard deviation about 1.
#[derive(Clone, Debug)]
pub(super) struct Pulse {
    resonance: Vec<Line>,
    rest: Vec<Line>,
}

/// What rate a fire of this diameter (m) puffs at, Hz.
pub(super) fn puffing(diameter: f32) -> f64 {
    PUFFING / f64::from(diameter).sqrt()
}

impl Pulse {
    pub(super) fn new(seed: u32, diameter: f32) -> Self {
        let peak = puffing(diameter);
        let mut random = Pcg32::new(u64::from(seed), 0x70_75_6c_73);
        let mut lines = |edges: &[f64], density: &dyn Fn(f64) -> f64, share: f64| {
            let mut lines: Vec<Line> = edges
                .windows(2)
                .map(|e| {
                    // Anywhere within its band, so that the sum has no period.
                    let frequency = e[0] + (e[1] - e[0]) * f64::from(random.next_f32());
                    let phase = TAU * f64::from(random.next_f32());
                    Line { frequency, amplitude: (2.0 * density(frequency) * (e[1] - e[0])).sqrt(), phase }
                })
                .collect();
            let variance: f64 = lines.iter().map(|l| 0.5 * l.amplitude * l.amplitude).sum();
            let scale = (share / variance).sqrt();
            lines.iter_mut().for_each(|l| l.amplitude *= scale);
            lines
        };
        let narrow: Vec<f64> =
            (0..=32).map(|i| peak * (1.0 + BANDWIDTH * (f64::from(i) / 5.0 - 3.2))).collect();
        let bell = |f: f64| (-0.5 * ((f / peak - 1.0) / BANDWIDTH).powi(2)).exp();
        let resonance = lines(&narrow, &bell, RESONANT);
        let (slow, fast) = (0.02 * peak, FASTEST.max(2.5 * peak));
        // A twentieth of an octave each, where that is not wider than a minute's spectrum resolves well.
        let next = |f: &f64| Some(f + (0.05 * f).min(0.06 * peak));
        let wide: Vec<f64> = std::iter::successors(Some(slow), next).take_while(|f| *f < fast).collect();
        let density = |f: f64| {
            let x = f / peak;
            let fade = ((f / fast - 0.75) / 0.25).clamp(0.0, 1.0);
            let slope = if x < 1.0 { 1.0 / x.max(LEVEL) } else { x.powf(-FALL) };
            slope * (0.5 + 0.5 * (PI * fade).cos())
        };
        let rest = lines(&wide, &density, 1.0 - RESONANT);
        Self { resonance, rest }
    }

    /// The whole process.
    pub(super) fn at(&self, seconds: f64) -> f64 {
        let x = sum(&self.resonance, seconds) + sum(&self.rest, seconds);
        x + SKEW * (x * x - 1.0)
    }

    /// The resonance alone: puffs, with standard deviation 1.
    pub(super) fn puff(&self, seconds: f64) -> f64 {
        sum(&self.resonance, seconds) / RESONANT.sqrt()
    }
}

fn sum(lines: &[Line], seconds: f64) -> f64 {
    lines.iter().map(|l| l.amplitude * (TAU * (l.frequency * seconds).fract() + l.phase).cos()).sum()
}
