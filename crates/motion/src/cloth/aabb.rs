//! Boxes along the axes.

use glam::Vec3A;

/// A box around something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aabb {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Aabb {
    pub const NONE: Self = Self { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

    #[inline(always)]
    pub fn with(self, p: Vec3A) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    #[inline(always)]
    pub fn joined(self, o: Self) -> Self {
        Self { low: self.low.min(o.low), high: self.high.max(o.high) }
    }

    #[inline(always)]
    pub fn meets(&self, o: &Self, gap: f32) -> bool {
        ((self.low - Vec3A::splat(gap)).cmple(o.high) & (o.low - Vec3A::splat(gap)).cmple(self.high)).all()
    }

    /// Between the nearest points of both, nought where they meet.
    #[inline(always)]
    pub fn distance(&self, o: &Self) -> f32 {
        (self.low - o.high).max(o.low - self.high).max(Vec3A::ZERO).length()
    }

    #[inline(always)]
    pub fn grown(self, by: f32) -> Self {
        Self { low: self.low - Vec3A::splat(by), high: self.high + Vec3A::splat(by) }
    }

    #[inline(always)]
    pub fn has(&self, p: Vec3A) -> bool {
        (self.low.cmple(p) & p.cmple(self.high)).all()
    }
}
