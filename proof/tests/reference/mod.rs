//! Pictures of the reference renderer, and how far others are from them.

use yugen_optics::Image;
use yugen_scene::Scene;
use yugen_transport::render::{Action, Budget, Job, Options};

/// What the reference makes of a scene with so many samples.
pub fn picture(scene: &Scene, samples: u32, seed: u32) -> Image {
    let options = Options { budget: Some(Budget::Samples(samples)), seed, ..Default::default() };
    let job = Job::new(scene, &options).expect("the reference takes it");
    assert!(job.run(|_, _| Action::Continue));
    job.image().select(&["R", "G", "B"]).expect("a picture")
}

/// How far values are from the expectation of two independent references: a square is the product of the differences to each,
/// in which their noise has no mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    squares: f64,
    of: f64,
    found: f64,
    want: f64,
}

impl Difference {
    /// Adds a value and what both references have.
    pub fn add(&mut self, found: f32, wants: [f32; 2]) {
        let [a, b, c] = [found, wants[0], wants[1]].map(f64::from);
        self.squares += (a - b) * (a - c);
        self.of += b * c;
        self.found += a;
        self.want += 0.5 * (b + c);
    }

    /// Root mean square difference over the root mean square.
    pub fn error(&self) -> f64 {
        // The products may sum to less than zero where there is hardly a difference; NaN stays NaN.
        if self.squares <= 0.0 { 0.0 } else { (self.squares / self.of).sqrt() }
    }

    /// Of the sums.
    pub fn ratio(&self) -> f64 {
        self.found / self.want
    }
}
