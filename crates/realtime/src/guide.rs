//! What a denoiser is told: of the frames of a picture, in two halves, radiance and what is seen.

use crate::StageError;
use crate::film::{Film, FilmPass, shading_wgsl};
use crate::frame::Options;
use crate::pipelines::compute;
use crate::scene::SceneBuffers;
use crate::shade::BOUNCES;
use wgpu::{Device, Queue};
use yugen_optics::denoise::{ALBEDO, DEPTH, Halves, NORMAL, SURFACE};
use yugen_scene::prepared::Rows;

/// Planes of the film of [`guide_pass`] behind the first: see `guide.wgsl`.
pub(crate) const FURTHER_PLANES: u32 = 3;

/// The pass that adds what is seen. `primary`: the layout of group 1; `bounces`: surfaces that may reflect light on its way
/// to the camera.
pub(crate) fn guide_pass(
    device: &Device,
    rows: &Rows,
    scene: &SceneBuffers,
    primary: &wgpu::BindGroupLayout,
    film: &wgpu::BindGroupLayout,
    options: &Options,
    bounces: u32,
) -> FilmPass {
    // Not overrides: naga refuses some shaders that it has to rewrite for those.
    let constants = format!(
        "const BOUNCES: u32 = {}u;\nconst HIDE_EMITTERS: bool = {};\nconst FILM_HALVES: bool = false;",
        bounces.min(BOUNCES),
        options.hide_emitters
    );
    let pieces = [constants.as_str(), &shading_wgsl(rows), include_str!("guide.wgsl")];
    let pipeline = compute(device, "add_guides", &pieces, &[scene.layout(), primary, film]);
    FilmPass::new(device, "guides", pipeline, film, options.size, FURTHER_PLANES)
}

/// How many frames a picture has, and what their samples weigh in each half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frames {
    pub count: u32,
    pub halves: [f64; 2],
    /// Frames before which there was a mean to deviate from: all but the first, where no filter is negative.
    deviations: u32,
}

impl Frames {
    /// With another frame, of samples of this weight, for one half.
    pub fn with(mut self, weight: f32, half: usize) -> Self {
        self.deviations += u32::from(self.per_weight() > 0.0);
        self.count = self.count.saturating_add(1);
        self.halves[half] += f64::from(weight);
        self
    }

    /// What the samples of all frames weigh together. Of a filter that is negative somewhere it may be zero or less.
    pub fn weight(&self) -> f64 {
        self.halves[0] + self.halves[1]
    }

    /// One over that, which makes a mean of a sum; 0 where there is none.
    pub fn per_weight(&self) -> f64 {
        if self.weight() > 0.0 { 1.0 / self.weight() } else { 0.0 }
    }

    /// What the square of another frame's deviation from that mean counts; 0 where there is none. The mean of n frames of weights
    /// ±1 that sum up to W has the variance of a frame times n / W², and the deviation of another frame from it that of a frame times
    /// 1 + n / W²: this is n / (n + 1) where all weights are 1.
    pub fn deviation_weight(&self) -> f64 {
        let per = self.per_weight();
        if per > 0.0 { 1.0 / (1.0 + f64::from(self.count) * per * per) } else { 0.0 }
    }

    /// Variance of the mean of all frames, as if they were independent, of the sum of their squared deviations from the mean
    /// before each (`film.wgsl`). Where a filter is negative weights are +1 and −1, and this is right in the mean only.
    pub fn variance(&self, squares: f32) -> f32 {
        let weight = self.weight();
        // Some signs of a sum leave no frame a mean before it: then nothing is known.
        if self.deviations == 0 || weight <= 0.0 {
            return 0.0;
        }
        let of_a_frame = f64::from(squares) / f64::from(self.deviations);
        (of_a_frame * f64::from(self.count) / (weight * weight)) as f32
    }
}

/// Fetches what a denoiser takes from the film of what is seen, beside `light`, the planes of the picture's.
pub(crate) fn halves(
    device: &Device,
    queue: &Queue,
    light: &[Vec<[f32; 4]>],
    guides: &Film,
    frames: Frames,
) -> Result<Halves, StageError> {
    let [width, height] = guides.size().map(|v| v as usize);
    let mut out = Halves::new(width, height);
    let seen = guides.read_planes(device, queue)?;
    let ([all, squares, first], [surface, side, surface_first, side_first]) = (light, &seen[..]) else {
        return Ok(out);
    };
    for (count, weight) in out.count.iter_mut().zip(frames.halves) {
        count.fill(weight.max(0.0) as f32);
    }
    let per = frames.halves.map(|w| if w > 0.0 { 1.0 / w } else { 0.0 });
    let mut set = |value: usize, channel: usize, all: &[[f32; 4]], first: &[[f32; 4]]| {
        let [a, b] = &mut out.mean;
        let means = a[value].iter_mut().zip(&mut b[value]);
        for ((a, b), (all, first)) in means.zip(all.iter().zip(first)) {
            let (all, first) = (f64::from(all[channel]), f64::from(first[channel]));
            *a = (first * per[0]) as f32;
            *b = ((all - first) * per[1]) as f32;
        }
    };
    for c in 0..3 {
        set(c, c, all, first);
        set(ALBEDO.start + c, c, surface, surface_first);
        set(NORMAL.start + c, c, side, side_first);
    }
    set(DEPTH, 3, surface, surface_first);
    set(SURFACE, 3, side, side_first);
    for (c, plane) in out.variance.iter_mut().enumerate() {
        plane.iter_mut().zip(squares).for_each(|(v, squares)| *v = frames.variance(squares[c]));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruction::Reconstruction;
    use crate::view::View;
    use yugen_optics::random::Pcg32;
    use yugen_scene::Filter;

    #[test]
    fn the_variance_of_a_mean_is_that_of_samples_over_their_number() {
        // 1, 2, 3, 6 are 14 from their mean of three, squared and added.
        let frames = [0, 0, 1, 1].into_iter().fold(Frames::default(), |frames, half| frames.with(1.0, half));
        assert!((frames.variance(14.0) - 14.0 / 3.0 / 4.0).abs() < 1e-6);
        assert_eq!(Frames::default().with(1.0, 0).variance(0.0), 0.0);
    }

    /// Normal numbers as frames, with the weights of a filter that is negative somewhere.
    #[test]
    fn the_variance_of_a_mean_of_signed_weights_is_right_in_the_mean() {
        let mut random = Pcg32::new(3, 8);
        let camera = yugen_scene::Camera {
            name: "any".into(),
            to_world: glam::Mat4::IDENTITY,
            projection: yugen_scene::Projection::pinhole(1.0),
            near_far: [0.1, 1.0],
            film: yugen_scene::Film::default(),
            samples_per_pixel: 1,
        };
        let view = View::new(&camera).expect("a camera");
        let centre = Reconstruction::new(Filter::Box).sample(0, false);
        for filter in [Filter::Box, Filter::CatmullRom, Filter::Lanczos { lobes: 3.0 }] {
            let reconstruction = Reconstruction::new(filter);
            let weights: Vec<f32> = (0..24).map(|i| reconstruction.sample(i, false).weight).collect();
            let (mut told, mut off) = (0.0f64, 0.0f64);
            const PIXELS: u32 = 20_000;
            for _ in 0..PIXELS {
                let (mut frames, mut sum, mut squares) = (Frames::default(), 0.0f32, 0.0f32);
                for (i, weight) in weights.iter().enumerate() {
                    let row = view.row(frames.count, 0, &centre, None).after(&frames, 0);
                    let value = random.normal();
                    squares += row.deviation_weight * (value - sum * row.per_weight).powi(2);
                    sum += weight * value;
                    frames = frames.with(*weight, i / 8 % 2);
                }
                told += f64::from(frames.variance(squares));
                off += (f64::from(sum) / frames.weight()).powi(2);
            }
            println!("{filter:?}: told {:.4} of the square error", told / off);
            // Measured .994 to 1.017; 20 000 squares are known to a hundredth.
            assert!((told / off - 1.0).abs() < 0.05, "{filter:?}: {told} {off}");
        }
    }
}
