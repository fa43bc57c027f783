//! What is measured of a costume that is worn.

use yugen_motion::cloth::{Along, Spring};
use yugen_motion::garment::{Body, Costume};

/// The least distance of the cloth's vertices from the body, m.
pub fn nearest(costume: &Costume, body: &Body) -> f32 {
    let mut least = f32::INFINITY;
    for c in &body.capsules {
        let pose = &costume.stands()[c.joint];
        least = costume.solver().positions().iter().map(|p| c.distance(pose, *p).0).fold(least, f32::min);
    }
    least
}

/// By how much longer threads are, in parts, but for 1 of 1000 and those that the belt holds.
pub fn longer(costume: &Costume) -> f32 {
    let free = |s: &Spring| s.along != Along::Bias && !s.ends.iter().any(|v| costume.holds(*v));
    costume.solver().cloth().elongation(costume.solver().positions(), free)
}
