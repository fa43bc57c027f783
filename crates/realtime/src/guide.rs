//! What a denoiser is told: of the frames of a picture, in two halves, radiance and what is seen.

use crate::StageError;
use crate::film::{FILM_WGSL, Film, FilmPass};
use crate::frame::Options;
use crate::hierarchy::HIERARCHY_WGSL;
use crate::pipelines::compute;
use crate::scene::{SceneBuffers, scene_wgsl};
use crate::shade::BOUNCES;
use crate::surface::{SEE_THROUGH_WGSL, SURFACE_WGSL};
use crate::view::VIEW_WGSL;
use wgpu::{Device, Queue};
use yugen_optics::denoise::{ALBEDO, DEPTH, Halves, NORMAL, SURFACE};
use yugen_scene::prepared::{Rows, wgsl};

/// Planes of the film of [`guide_pass`] behind the first: see `guide.wgsl`.
pub(crate) const MORE: u32 = 3;

/// The pass that adds what is seen. `primary`: the layout of group 1; `bounces`: surfaces that may reflect light on its way
/// to the camera.
pub fn guide_pass(
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
    let pieces = [
        constants.as_str(),
        &scene_wgsl(),
        &wgsl(rows),
        HIERARCHY_WGSL,
        SURFACE_WGSL,
        SEE_THROUGH_WGSL,
        VIEW_WGSL,
        FILM_WGSL,
        include_str!("samples.wgsl"),
        include_str!("guide.wgsl"),
    ];
    let pipeline = compute(device, "add_guides", &pieces, &[scene.layout(), primary, film]);
    FilmPass::new(device, "guides", pipeline, film, options.size, MORE)
}

/// How many frames a picture has, and what their samples weigh in each half and in all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frames {
    pub count: u32,
    pub halves: [f64; 2],
    pub weight: f64,
}

impl Frames {
    /// Variance of the mean of all frames, of the sums of squared deviations from it.
    pub fn variance(&self, squares: f32) -> f32 {
        let n = f64::from(self.count);
        if self.count < 2 || self.weight <= 0.0 {
            return 0.0;
        }
        // The mean square deviation over n, where all weigh one.
        (f64::from(squares) / (n - 1.0) * n / (self.weight * self.weight)) as f32
    }
}

/// Fetches what a denoiser takes from the films of the picture and of what is seen.
pub(crate) fn halves(
    device: &Device,
    queue: &Queue,
    picture: &Film,
    guides: &Film,
    frames: Frames,
) -> Result<Halves, StageError> {
    let [width, height] = picture.size().map(|v| v as usize);
    let mut out = Halves::new(width, height);
    let light = picture.read_planes(device, queue)?;
    let seen = guides.read_planes(device, queue)?;
    let ([all, squares, first], [surface, side, surface_first, side_first]) = (&light[..], &seen[..]) else {
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

    #[test]
    fn the_variance_of_a_mean_is_that_of_samples_over_their_number() {
        // 1, 2, 3, 6 are 14 from their mean of three, squared and added.
        let frames = Frames { count: 4, halves: [2.0; 2], weight: 4.0 };
        assert!((frames.variance(14.0) - 14.0 / 3.0 / 4.0).abs() < 1e-6);
        assert_eq!(Frames { count: 1, halves: [1.0, 0.0], weight: 1.0 }.variance(0.0), 0.0);
    }
}
