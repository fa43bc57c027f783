//! Where the main lines of a stage run. The origin is the middle of the main floor's surface; +y is up, +z towards the
//! front seats, −x to the left of who sits there. Metres.

use crate::dimension::{Dimensions, MeasuredAt};
use crate::preset::Preset;
use glam::Vec3;

/// Height of the head ties between the pillars.
pub const TIE: f32 = 0.2;
/// Heights of the bearing block, the bracket arm and the eaves beam above the head ties.
pub const BLOCK: f32 = 0.16;
/// See [`BLOCK`].
pub const ARM: f32 = 0.14;
/// See [`BLOCK`].
pub const BEAM: f32 = 0.22;

/// The main lines.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Which stage.
    pub preset: &'static Preset,
    /// Its numbers.
    pub d: Dimensions,
    /// Half the distance of the pillars' middles, across.
    pub hw: f32,
    /// And from front to back.
    pub hd: f32,
    /// Side of a pillar.
    pub pillar: f32,
    /// z of the mirror board's front.
    pub rear: f32,
    /// y of the ground.
    pub ground: f32,
    /// Fall of the floor over a metre to the front.
    fall: f32,
    /// Where the bridge begins, on the middle of its floor.
    pub root: Vec3,
    /// Along the bridge, level.
    pub along: Vec3,
    /// Across the bridge, to its front.
    pub across: Vec3,
    /// Fall of the bridge over a metre.
    bridge_fall: f32,
}

impl Layout {
    /// From a preset's numbers, or changed ones.
    pub fn new(preset: &'static Preset, d: Dimensions) -> Self {
        let pillar = d.get("pillar");
        let off = match preset.measured_at {
            MeasuredAt::Inside => 0.5 * pillar,
            MeasuredAt::Centre => 0.0,
            MeasuredAt::Outside => -0.5 * pillar,
        };
        let (hw, hd) = (0.5 * d.get("width") + off, 0.5 * d.get("depth") + off);
        let fall = d.get("floor_rake").to_radians().tan();
        let rear = -hd - d.get("atoza_depth");
        let (sin, cos) = d.get("bridge_angle").to_radians().sin_cos();
        let along = Vec3::new(-cos, 0.0, -sin);
        Self {
            hw,
            hd,
            pillar,
            rear,
            ground: -d.get("floor_height"),
            fall,
            root: Vec3::new(-hw, hd * fall, 0.5 * (rear - hd)),
            along,
            across: Vec3::Y.cross(along),
            bridge_fall: d.get("bridge_rake").to_radians().tan(),
            preset,
            d,
        }
    }

    /// Shorthand.
    pub fn get(&self, key: &str) -> f32 {
        self.d.get(key)
    }

    /// Height of the floor; the rear seat is level.
    pub fn floor(&self, z: f32) -> f32 {
        -z.max(-self.hd) * self.fall
    }

    /// y of the underside of the head ties. All heads are level, as far above the floor's middle as `pillar_height` says.
    pub fn head(&self) -> f32 {
        self.get("pillar_height")
    }

    /// y of the top of the eaves beams, on which the rafters lie.
    pub fn beam_top(&self) -> f32 {
        self.head() + TIE + BLOCK + ARM + BEAM
    }

    /// A place on the bridge: metres from the stage, metres to the front of its middle, metres above its floor.
    pub fn bridge(&self, along: f32, front: f32, up: f32) -> Vec3 {
        self.root + self.along * along + self.across * front + Vec3::Y * (up - along * self.bridge_fall)
    }

    /// How far along the bridge its line `front` metres before the middle leaves the stage's side.
    pub fn bridge_start(&self, front: f32) -> f32 {
        // x of root + along t + across front is −hw.
        -self.across.x * front / self.along.x
    }
}
