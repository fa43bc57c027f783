//! What a lens does to straight lines: Brown 1966, "Decentering Distortion of Lenses", after Conrady 1919; in the
//! order and sign of OpenCV, whose calibrations are the usual ones.

use glam::Vec2;

/// Focal length and centre in pixels (the corner of the first pixel is the origin), and the coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Focal length.
    pub focal: f32,
    /// Principal point.
    pub centre: Vec2,
    /// k1, k2 and k3 of the radial part.
    pub radial: [f32; 3],
    /// p1 and p2 of the tangential part.
    pub tangential: [f32; 2],
}

impl Lens {
    /// Where the lens puts what a straight camera sees at `pixel`.
    pub fn distort(&self, pixel: Vec2) -> Vec2 {
        let p = (pixel - self.centre) / self.focal;
        self.centre + self.focal * (p * self.stretch(p) + self.shift(p))
    }

    /// What a straight camera sees of what the lens puts at `pixel`: the inverse, by repetition.
    pub fn undistort(&self, pixel: Vec2) -> Vec2 {
        let to = (pixel - self.centre) / self.focal;
        let mut p = to;
        // Each round gains a digit or more for any lens that a person would use.
        for _ in 0..30 {
            p = (to - self.shift(p)) / self.stretch(p);
        }
        self.centre + self.focal * p
    }

    /// Whether a picture of this size can be straightened: its corners come from one place each.
    pub fn fits(&self, width: usize, height: usize) -> bool {
        let (w, h) = (width as f32, height as f32);
        let corners = [Vec2::ZERO, Vec2::new(w, 0.0), Vec2::new(0.0, h), Vec2::new(w, h)];
        corners.iter().all(|c| self.distort(self.undistort(*c)).distance(*c) < 0.5)
    }

    fn stretch(&self, p: Vec2) -> f32 {
        let [k1, k2, k3] = self.radial;
        let r = p.length_squared();
        1.0 + r * (k1 + r * (k2 + r * k3))
    }

    fn shift(&self, p: Vec2) -> Vec2 {
        let [p1, p2] = self.tangential;
        let r = p.length_squared();
        Vec2::new(
            2.0 * p1 * p.x * p.y + p2 * (r + 2.0 * p.x * p.x),
            p1 * (r + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
        )
    }
}

/// The picture that a straight camera would have taken: `planes` interleaved values a pixel, between pixels linearly;
/// NaN where the lens saw nothing or next to a NaN.
pub fn straighten(data: &[f32], width: usize, height: usize, planes: usize, lens: &Lens) -> Vec<f32> {
    let mut out = vec![f32::NAN; data.len()];
    crate::rows::for_rows(&mut out, width * planes, |y, row| {
        for (x, value) in row.chunks_exact_mut(planes).enumerate() {
            let at = lens.distort(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) - 0.5;
            // Half a pixel of the border is as good as the border itself.
            let last = Vec2::new((width - 1) as f32, (height - 1) as f32);
            if at.cmplt(Vec2::splat(-0.5)).any() || at.cmpgt(last + 0.5).any() || at.is_nan() {
                continue;
            }
            let at = at.clamp(Vec2::ZERO, last);
            let (i, j) =
                ((at.x as usize).min(width.saturating_sub(2)), (at.y as usize).min(height.saturating_sub(2)));
            let part = at - Vec2::new(i as f32, j as f32);
            let (right, below) = ((i + 1).min(width - 1), (j + 1).min(height - 1));
            for (p, v) in value.iter_mut().enumerate() {
                let get = |x: usize, y: usize| data[(y * width + x) * planes + p];
                // A weight of zero must not let a NaN in.
                let mix = |a: f32, b: f32, t: f32| {
                    if t <= 0.0 {
                        a
                    } else if t >= 1.0 {
                        b
                    } else {
                        a + (b - a) * t
                    }
                };
                *v = mix(
                    mix(get(i, j), get(right, j), part.x),
                    mix(get(i, below), get(right, below), part.x),
                    part.y,
                );
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens {
        focal: 900.0,
        centre: Vec2::new(310.0, 250.0),
        radial: [-0.21, 0.08, -0.01],
        tangential: [0.002, -0.003],
    };

    /// cv2.projectPoints of OpenCV's own formula, evaluated by hand in double precision.
    #[test]
    fn points_go_where_opencv_puts_them_and_come_back() {
        for pixel in
            [Vec2::new(0.0, 0.0), Vec2::new(640.0, 480.0), Vec2::new(310.0, 250.0), Vec2::new(20.0, 400.0)]
        {
            let (x, y) = (f64::from(pixel.x - 310.0) / 900.0, f64::from(pixel.y - 250.0) / 900.0);
            let r2 = x * x + y * y;
            let k = 1.0 + -0.21 * r2 + 0.08 * r2 * r2 + -0.01 * r2 * r2 * r2;
            let u = x * k + 2.0 * 0.002 * x * y + -0.003 * (r2 + 2.0 * x * x);
            let v = y * k + 0.002 * (r2 + 2.0 * y * y) + 2.0 * -0.003 * x * y;
            let want = Vec2::new((310.0 + 900.0 * u) as f32, (250.0 + 900.0 * v) as f32);
            let got = LENS.distort(pixel);
            assert!(got.distance(want) < 1e-3, "{got} {want}");
            assert!(LENS.undistort(got).distance(pixel) < 1e-2, "{pixel}");
        }
        assert!(LENS.fits(640, 480) && Lens { radial: [0.0; 3], tangential: [0.0; 2], ..LENS }.fits(9999, 9));
        // One with the focal length in millimetres, and a slip of the pen.
        assert!(!Lens { focal: 35.0, ..LENS }.fits(640, 480));
        assert!(!Lens { radial: [1e30, 0.0, 0.0], ..LENS }.fits(640, 480));
    }

    #[test]
    fn a_straightened_picture_is_what_a_straight_camera_sees() {
        let (w, h) = (320, 240);
        let lens = Lens { focal: 450.0, centre: Vec2::new(155.0, 125.0), ..LENS };
        let scene = |p: Vec2| 1.0 + (0.05 * p.x).sin() * (0.04 * p.y).cos();
        let middle = |i: usize| Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
        let mut seen: Vec<f32> = (0..w * h).flat_map(|i| [scene(lens.undistort(middle(i))), 2.0]).collect();
        seen[2 * (120 * w + 160)] = f32::NAN;
        let straight = straighten(&seen, w, h, 2, &lens);
        let (mut worst, mut nan) = (0f32, 0);
        for i in 0..w * h {
            let v = straight[2 * i];
            nan += usize::from(v.is_nan());
            worst = worst.max(if v.is_nan() { 0.0 } else { (v - scene(middle(i))).abs() });
        }
        // A quarter of the second derivative of the ripples, and a spot of some four pixels.
        assert!(worst < 2e-3 && (1..=9).contains(&nan), "{worst} {nan}");
    }
}
