//! What dryness does: flying white (fei bai), where bristles that run dry jump over hollows of the paper.
//!
//! Whether a bristle touches is decided by its own trail along the stroke and by the height of the paper at the pixel, both
//! the same for all stamps that overlap there, and only after overlap has been evened out. Noise of each stamp, blended
//! over, has no white left after a dozen of overlaps ([`crate::literal`]).

use bytemuck::{Pod, Zeroable};

/// Constants of the shader `resolve.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Resolve {
    /// How much crept ink counts beside that of bristles, times wetness.
    pub k_diff: f32,
    /// How much dryness takes away.
    pub k_dry: f32,
    /// Part of the paper in what decides where bristles touch; the rest is theirs.
    pub paper_share: f32,
    /// Range of coverage over which the edge of a dry place is drawn.
    pub softness: f32,
}

impl Default for Resolve {
    fn default() -> Self {
        // Set so that about 30 % of a stroke is white at a dryness of .9 (tests/canvas.rs measures it on the GPU); were ξ the
        // sum of two even distributions, k_dry = 1.6 would leave a fifth.
        Self { k_diff: 0.45, k_dry: 1.6, paper_share: 0.4, softness: 0.08 }
    }
}

impl Resolve {
    /// Coverage after flying white: `coverage` by bristles and `crept` ink (0 to 1) at a dryness, where `xi` decides. Twin of
    /// `touch` in the shader.
    pub fn touch(&self, coverage: f32, crept: f32, dryness: f32, xi: f32) -> f32 {
        let reach = coverage + self.k_diff * (1.0 - dryness) * crept;
        let t = ((reach - self.k_dry * dryness * xi) / self.softness).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t) * reach.min(1.0)
    }

    /// What decides: a bristle's trail and the height of the paper, both 0 to 1.
    pub fn xi(&self, bristle: f32, height: f32) -> f32 {
        bristle + (1.0 - height - bristle) * self.paper_share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    /// Share of white inside a stroke whose ξ is even, by its dryness: none without, growing, about a fifth at .9.
    #[test]
    fn flying_white_grows_with_dryness() {
        let resolve = Resolve::default();
        let mut random = Pcg32::new(3, 1);
        let places: Vec<f32> =
            (0..20_000).map(|_| resolve.xi(random.next_f32(), random.next_f32())).collect();
        let white = |dryness: f32| {
            let blank = places.iter().filter(|xi| resolve.touch(1.0, 1.0, dryness, **xi) < 0.05).count();
            blank as f32 / places.len() as f32
        };
        let shares: Vec<f32> = (0..=10).map(|i| white(i as f32 / 10.0)).collect();
        assert!(shares.windows(2).all(|w| w[0] <= w[1]), "{shares:?}");
        assert_eq!(shares[0], 0.0);
        assert!((0.15..0.25).contains(&shares[9]), "{shares:?}");
    }
}
