//! Mist that lies over the ground: what is far away and low sinks into it and is paper, peaks stand out.
//!
//! Air whose density falls with height as exp(−(y − ground) / H), +y being up: of what is seen of a point, exp(−τ) is left, with τ the
//! integral of the density from the eye to there, in closed form (as in Quilez 2010, "Better Fog"), less for what is near. Slow noise
//! around the point makes banks of it.

use glam::DVec3;
use yugen_motion::noise::noise;

/// How fast mist thins out upwards: part of the height of the scene over which its density falls to 1/e.
const THIN: f64 = 0.1;
/// Optical depth over the radius of the scene along the ground at mist one.
const DENSE: f64 = 24.0;
/// Distance, of the radius of the scene, at which it has half of its effect: what stands in front stays clear, as painters have it.
const BEGINS: f64 = 0.2;
/// Size of its banks, of the radius of the scene, across and upwards, and how much they differ.
const BANKS: [f64; 2] = [0.3, 0.07];
const UNEVEN: f64 = 0.85;

/// Over a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mist {
    /// Where it is densest, along +y.
    ground: f64,
    /// Over which it thins out.
    height: f64,
    radius: f64,
}

impl Mist {
    /// Over what lies between two corners.
    pub fn over([low, high]: [DVec3; 2]) -> Self {
        let size = (high - low).max(DVec3::splat(1e-9));
        Self { ground: low.y, height: THIN * size.y, radius: 0.5 * size.length() }
    }

    /// What is left of a point seen from an eye, 0 to 1; `mist`: 0 none, 1 thick.
    pub fn left(&self, eye: DVec3, point: DVec3, mist: f32) -> f32 {
        if mist <= 0.0 {
            return 1.0;
        }
        let far = eye.distance(point);
        // No denser below the ground, where rounding may put a point.
        let [a, b] = [eye, point].map(|p| ((p.y - self.ground) / self.height).max(0.0));
        let [wide, tall] = BANKS.map(|k| k * self.radius);
        let place = (point / DVec3::new(wide, tall, wide)).as_vec3();
        let bank = 1.0 + UNEVEN * f64::from(noise(place).0);
        let far = far / self.radius;
        let depth = f64::from(mist) * DENSE * far * far / (far + BEGINS) * mean(a, b) * bank;
        if depth.is_finite() { (-depth).exp() as f32 } else { 1.0 }
    }
}

/// The mean of exp(−y) from one height to another.
fn mean(a: f64, b: f64) -> f64 {
    if (b - a).abs() < 1e-4 { (-0.5 * (a + b)).exp() } else { ((-a).exp() - (-b).exp()) / (b - a) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn the_mean_along_a_ray_is_the_integral_in_small_steps() {
        for (a, b) in [(0.0, 0.0), (0.0, 3.0), (3.0, 0.0), (2.0, 2.00001), (2.0, 2.0002), (0.0, 20.0)] {
            let steps = (0..1000).map(|i| (-(a + (b - a) * (f64::from(i) + 0.5) / 1000.0)).exp());
            let sum = steps.sum::<f64>() / 1000.0;
            // The midpoint rule is off by 1.7e-6 in the last.
            assert!((mean(a, b) - sum).abs() < 7e-6, "{a} {b}");
        }
    }

    #[test]
    fn mist_swallows_feet_and_leaves_peaks() {
        let mist = Mist::over([dvec3(-50.0, 0.0, -100.0), dvec3(50.0, 60.0, 0.0)]);
        let eye = dvec3(0.0, 6.0, 10.0);
        let left = |x: f64, y: f64, z: f64| mist.left(eye, dvec3(x, y, z), 0.6);
        let foot = (0..9).map(|i| left(-40.0 + 10.0 * f64::from(i), 0.5, -90.0)).sum::<f32>() / 9.0;
        let peak = (0..9).map(|i| left(-40.0 + 10.0 * f64::from(i), 58.0, -90.0)).sum::<f32>() / 9.0;
        assert!(foot < 0.15 && peak > 3.0 * foot, "{foot} {peak}");
        assert!(left(0.0, 1.0, 8.0) > 0.7, "what is near");
        assert_eq!(mist.left(eye, dvec3(0.0, 0.0, -90.0), 0.0), 1.0);
        // No jump where a ray is level.
        let level = |dy: f64| mist.left(eye, dvec3(3.0, 6.0 + dy, -40.0), 0.5);
        assert!((level(1e-3) - level(-1e-3)).abs() < 1e-3 && (level(1e-3) - level(0.0)).abs() < 1e-3);
        for point in [DVec3::splat(f64::NAN), DVec3::splat(1e300), dvec3(0.0, -1e9, 0.0)] {
            assert!((0.0..=1.0).contains(&mist.left(eye, point, 1.0)), "{point}");
        }
        let flat = Mist::over([DVec3::ZERO, DVec3::ZERO]);
        assert!((0.0..=1.0).contains(&flat.left(eye, DVec3::ZERO, 1.0)));
    }
}
