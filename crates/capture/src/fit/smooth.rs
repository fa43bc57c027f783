//! Tangents are lines, and neighbours on a thread share them.

use glam::{Vec2, Vec3};
use yugen_optics::Frame;
use yugen_reflectance::btf::{Btf, Texel};

/// How far neighbours reach.
const REACH: isize = 3;

/// Below this confidence a texel does better by its neighbours than by itself.
const UNSURE: f32 = 0.1;

/// Turns tangents of little confidence toward those of the neighbours that look alike. A line has no front: what is
/// averaged is the vector of the doubled angle in the picture, weighted by confidence and by how much the highlight
/// depends on the direction. A texel that is not quite unsure of itself keeps its own. So should all that were fitted
/// with a [`Prior`](super::Prior), which knows the direction of their thread better than the neighbours do.
pub fn smooth_tangents(btf: &mut Btf) {
    let doubled = |t: &Texel| {
        let d = t.tangent.truncate().normalize_or(Vec2::X);
        Vec2::new(d.x * d.x - d.y * d.y, 2.0 * d.x * d.y)
    };
    // How much longer than wide: nothing where round, one from four times on.
    let weight = |t: &Texel| t.confidence * ((t.sigma.x / t.sigma.y).ln().abs() / 4f32.ln()).min(1.0);
    let (width, height) = (btf.width as isize, btf.height as isize);
    let lines: Vec<(Vec2, f32)> = btf.texels.iter().map(|t| (doubled(t), weight(t))).collect();
    let old = btf.texels.clone();
    for (i, texel) in btf.texels.iter_mut().enumerate() {
        if texel.confidence > UNSURE || texel.confidence <= 0.0 {
            continue;
        }
        let (x, y) = (i as isize % width, i as isize / width);
        // A texel half sure of itself weighs as much as a dozen sure neighbours.
        let (line, own) = lines[i];
        let mut sum = line * (own * 12.0 / (1.0 - texel.confidence));
        for ny in (y - REACH).max(0)..(y + REACH + 1).min(height) {
            for nx in (x - REACH).max(0)..(x + REACH + 1).min(width) {
                let j = (ny * width + nx) as usize;
                if j != i {
                    // Nothing of a thread that lies across: from 60° on.
                    let along = ((lines[j].0.dot(line) + 0.5) / 1.5).max(0.0);
                    sum += lines[j].0 * (along * lines[j].1 * likeness(texel, &old[j]));
                }
            }
        }
        if sum.length_squared() > 1e-12 {
            // Half the angle: between +x and the vector.
            let half = (sum.normalize() + Vec2::X).try_normalize().unwrap_or(Vec2::Y);
            let n = texel.normal;
            // The tangent above this direction of the picture.
            let along = Vec3::new(half.x, half.y, -(n.x * half.x + n.y * half.y) / n.z.max(1e-3));
            texel.tangent = Frame::from_normal_tangent(n, along).s;
        }
    }
}

/// One for texels of the same colours, less the more they differ.
fn likeness(a: &Texel, b: &Texel) -> f32 {
    let apart = |a: Vec3, b: Vec3| (a - b).length_squared() / (a + b + Vec3::splat(0.02)).length_squared();
    (-8.0 * (apart(a.diffuse, b.diffuse) + apart(a.specular, b.specular))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::ColourSpace;
    use yugen_optics::frame::spherical;

    /// Warp beside weft, every third texel unsure and wrong.
    #[test]
    fn unsure_tangents_follow_their_own_thread() {
        let texel = |x: usize, y: usize| {
            let weft = (x / 8).is_multiple_of(2);
            // Just to both sides of ±180°, where a mean of angles would lie across.
            let wobble = if y.is_multiple_of(2) { 0.05 } else { -0.05 };
            let azimuth =
                if weft { wobble + if y % 4 < 2 { 0.0 } else { std::f32::consts::PI } } else { 1.5 };
            let unsure = (x + 2 * y).is_multiple_of(3);
            let frame = Frame::from_normal_tangent(
                spherical(0.2, 1.0),
                spherical(1.5, if unsure { azimuth + 0.8 } else { azimuth }),
            );
            Texel {
                diffuse: if weft { Vec3::ZERO } else { Vec3::new(0.4, 0.05, 0.03) },
                specular: Vec3::splat(if weft { 0.8 } else { 0.1 }),
                normal: frame.n,
                tangent: frame.s,
                sigma: Vec2::new(0.4, 0.1),
                confidence: if unsure { 0.02 } else { 0.97 },
            }
        };
        let texels = (0..32 * 32).map(|i| texel(i % 32, i / 32)).collect();
        let mut btf = Btf { width: 32, height: 32, colour_space: ColourSpace::LinearSrgb, texels };
        let before = btf.clone();
        smooth_tangents(&mut btf);
        for (i, (t, old)) in btf.texels.iter().zip(&before.texels).enumerate() {
            assert!(t.tangent.is_normalized() && t.tangent.dot(t.normal).abs() < 1e-5);
            if old.confidence > 0.5 {
                assert_eq!(t, old);
            } else {
                let weft = (i % 32 / 8).is_multiple_of(2);
                let thread = spherical(std::f32::consts::FRAC_PI_2, if weft { 0.0 } else { 1.5 });
                let along = Frame::from_normal_tangent(t.normal, thread).s;
                assert!(t.tangent.dot(along).abs() > 0.99, "{} {along}", t.tangent);
            }
        }
    }
}
