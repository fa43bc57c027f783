//! How values become lengths or brightness.

use clap::ValueEnum;

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scale {
    /// In proportion.
    Linear,
    /// Cube root: the highlight and the body beside each other.
    Cbrt,
    /// Logarithm, four decades below the largest.
    Log,
}

const DECADES: f32 = 4.0;

impl Scale {
    /// `v` of at most `max` in [0, 1].
    pub fn unit(self, v: f32, max: f32) -> f32 {
        let v = (v / max).clamp(0.0, 1.0);
        match self {
            Self::Linear => v,
            Self::Cbrt => v.cbrt(),
            Self::Log => (v.log10() / DECADES + 1.0).max(0.0),
        }
    }

    /// Three to five round values up to `max`, rising.
    pub fn ticks(self, max: f32) -> Vec<f32> {
        match self {
            Self::Linear => {
                let step = round_step(max);
                (1..).map(|i| i as f32 * step).take_while(|v| *v <= max * 1.0001).collect()
            }
            Self::Cbrt => [0.01, 0.1, 0.4, 1.0].map(|v| round_down(v * max)).to_vec(),
            Self::Log => {
                let top = max.log10().floor();
                (0..4).rev().map(|i| 10f32.powf(top - i as f32)).collect()
            }
        }
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear scale",
            Self::Cbrt => "cube root scale",
            Self::Log => "log scale over 4 decades",
        }
    }
}

/// 1, 2 or 5 times a power of ten: the steps that lead to `max` in three to five.
fn round_step(max: f32) -> f32 {
    let decade = 10f32.powf((max / 2.5).log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|s| s * decade);
    steps.into_iter().find(|s| max / s >= 2.5).unwrap_or(decade)
}

/// To one digit.
fn round_down(v: f32) -> f32 {
    let decade = 10f32.powf(v.log10().floor());
    (v / decade).floor() * decade
}

/// A number with three digits at most.
pub fn digits(v: f32) -> String {
    let v = format!("{v:.2e}").parse::<f32>().unwrap_or(v);
    if v != 0.0 && !(1e-3..1e5).contains(&v.abs()) { format!("{v:e}") } else { format!("{v}") }
}
