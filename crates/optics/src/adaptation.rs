//! Adaptation of the eye to the luminance of a film's frames.

use crate::{ColourSpace, Image};
use glam::Vec3;

/// What the exposure of a film follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Adaptation {
    /// Nothing: it is the same in all frames.
    #[default]
    None,
    /// What the eye does: Krawczyk, Myszkowski and Seidel 2005, "Perceptual Effects in Real-Time Tone Mapping".
    Eye,
}

impl Adaptation {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::None, Self::Eye];

    /// The name in scene files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Eye => "eye",
        }
    }

    /// The one called `name`, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|a| a.name() == name)
    }
}

/// How long rods and cones take, s. Durand and Dorsey 2000, "Interactive Tone Mapping".
const RODS: f64 = 0.4;
const CONES: f64 = 0.1;
/// Luminance to which both are sensitive alike, cd/m².
const MESOPIC: f64 = 0.04;
/// Luminance that is added to every pixel before logarithms, cd/m², for those that are black.
const LEAST: f64 = 1e-4;

/// The adaptation luminance of an eye that watches one frame after another. It starts at the geometric mean luminance of the
/// first frame and follows that of each later one exponentially, with a time constant from .1 s (cones, by day) to .4 s (rods,
/// in the dark). The exposure of a frame shows the adaptation luminance at its key value, which grows with it, but less.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    space: ColourSpace,
    /// Of a frame, s.
    seconds: f64,
    /// Adaptation luminance, cd/m², and the stops of the first frame.
    adapted: Option<(f64, f64)>,
}

impl Eye {
    /// For pictures of `space`, their luminance in cd/m², so many a second.
    pub fn new(space: ColourSpace, rate: f64) -> Self {
        Self { space, seconds: 1.0 / rate, adapted: None }
    }

    /// By how many stops more than the first frame this one is brightened, which is the next.
    pub fn stops(&mut self, picture: &Image) -> f32 {
        let seen = mean_luminance(picture, self.space);
        let (adapted, first) = match self.adapted {
            None => (seen, brightening(seen)),
            Some((last, first)) => {
                // Rods and cones by the share that they have in seeing.
                let rods = MESOPIC / (MESOPIC + seen);
                let constant = rods * RODS + (1.0 - rods) * CONES;
                (last + (seen - last) * -(-self.seconds / constant).exp_m1(), first)
            }
        };
        self.adapted = Some((adapted, first));
        (brightening(adapted) - first) as f32
    }
}

/// Stops that show this adaptation luminance, cd/m², at the key value of Krawczyk and others: .03 of white by night, towards 1.03
/// in the brightest sun.
fn brightening(luminance: f64) -> f64 {
    let key = 1.03 - 2.0 / (2.0 + (luminance + 1.0).log10());
    (key / luminance).log2()
}

/// Geometric mean over pixels, cd/m²; those that are no numbers are left out.
fn mean_luminance(picture: &Image, space: ColourSpace) -> f64 {
    let at = |name: &str| picture.channels.iter().position(|c| c == name);
    // A picture without colours is grey.
    let [r, g, b] = ["R", "G", "B"].map(|name| at(name).unwrap_or(0));
    let (mut sum, mut count) = (0.0, 0u32);
    for pixel in picture.data.chunks_exact(picture.channels.len().max(1)) {
        let luminance = f64::from(space.luminance(Vec3::new(pixel[r], pixel[g], pixel[b])));
        if luminance.is_finite() {
            sum += (luminance.max(0.0) + LEAST).ln();
            count += 1;
        }
    }
    (sum / f64::from(count.max(1))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPACE: ColourSpace = ColourSpace::LinearSrgb;

    fn grey(luminance: f32) -> Image {
        let mut image = Image::rgb(4, 2);
        image.data.fill(luminance);
        image
    }

    #[test]
    fn a_light_that_stays_is_shown_as_it_was() {
        let mut eye = Eye::new(SPACE, 24.0);
        for _ in 0..50 {
            assert!(eye.stops(&grey(3.0)).abs() < 1e-6);
        }
    }

    /// After a step the adaptation luminance has done 1 − 1/e of the way when the time constant has passed.
    #[test]
    fn the_eye_takes_a_tenth_of_a_second_by_day_and_four_in_the_dark() {
        for (from, to, constant) in [(1e3, 4e3, 0.1), (4e3, 1e3, 0.1), (0.2, 1e-3, 0.3902)] {
            let rate = 1000.0;
            let mut eye = Eye::new(SPACE, rate);
            eye.stops(&grey(from));
            for _ in 0..(constant * rate) as u32 {
                eye.stops(&grey(to));
            }
            let (adapted, _) = eye.adapted.unwrap();
            let [from, to] = [from, to].map(|v| f64::from(v) + LEAST);
            let way = (adapted - from) / (to - from);
            assert!((way - (1.0 - (-1f64).exp())).abs() < 2e-3, "{from} to {to}: {way}");
        }
    }

    /// However many frames a second there are, the same second looks the same.
    #[test]
    fn the_rate_of_frames_does_not_matter() {
        let after_a_fifth = |rate: f64| {
            let mut eye = Eye::new(SPACE, rate);
            eye.stops(&grey(10.0));
            (0..(0.2 * rate).round() as u32).map(|_| eye.stops(&grey(80.0))).last().unwrap()
        };
        assert!((after_a_fifth(25.0) - after_a_fifth(250.0)).abs() < 1e-4);
        // Three stops more of light are shown brighter, and not by three stops.
        let taken = after_a_fifth(25.0);
        assert!((-3.0..-1.0).contains(&taken), "{taken}");
    }

    #[test]
    fn black_and_what_is_no_number_are_no_trouble() {
        let mut eye = Eye::new(SPACE, 24.0);
        let mut bad = grey(1.0);
        bad.data[0] = f32::NAN;
        bad.data[3] = f32::INFINITY;
        assert_eq!(eye.stops(&bad), 0.0);
        for picture in [grey(0.0), grey(f32::NAN), grey(-1.0), grey(1e30), Image::rgb(0, 0)] {
            assert!(eye.stops(&picture).is_finite());
        }
        for adaptation in Adaptation::ALL {
            assert_eq!(Adaptation::from_name(adaptation.name()), Some(adaptation));
        }
    }
}
