//! What eight texels are fitted from, and how.

use super::fitted::Options;
use super::prior::Prior;
use super::rays::Rays;
use super::scratch::Scratch;
use crate::lanes::LANES;
use crate::normals::stereo::Light;

/// How texels are to be fitted.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub options: &'a Options,
    pub prior: Option<&'a Prior>,
    /// Whether a prior will be learned from what comes out.
    pub learning: bool,
    /// Whether texels in doubt get a second chance.
    pub twice: bool,
    /// Whether texels are left alone whose ground is certain to be chosen; by how much it is better is then not known.
    pub settle: bool,
}

/// From where eight texels were read.
#[derive(Clone, Copy)]
pub(super) struct Geometry<'a, R> {
    pub rays: R,
    pub lights: &'a [Light],
    pub triplets: &'a [[usize; 3]],
}

/// What is done with the readings of eight texels.
pub(super) trait BlockWork {
    type Out;
    fn of<R: Rays>(&self, geometry: Geometry<R>, scratch: &mut Scratch) -> [Self::Out; LANES];
}
