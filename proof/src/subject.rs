//! What a harness looks at.

use glam::Vec3;
use yugen_reflectance::{Bsdf, Laws, Sample};

/// A reflectance model with its parameters fixed. [`Bsdf`] is one; a sabotage test makes its own.
pub trait Subject: Sync {
    /// What it promises.
    fn laws(&self) -> Laws;
    /// f(wo, wi) in 1/sr, without the cosine.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3;
    /// Density per solid angle with which `sample` draws `wi`.
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;
    /// Draws `wi` from three uniforms in [0, 1).
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample>;
    /// Both at once.
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        (self.eval(wo, wi), self.pdf(wo, wi))
    }
}

impl Subject for Bsdf<'_> {
    fn laws(&self) -> Laws {
        Bsdf::laws(self)
    }
    fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        Bsdf::eval(self, wo, wi)
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        Bsdf::pdf(self, wo, wi)
    }
    fn sample(&self, wo: Vec3, u: Vec3) -> Option<Sample> {
        Bsdf::sample(self, wo, u)
    }
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        Bsdf::eval_pdf(self, wo, wi)
    }
}
