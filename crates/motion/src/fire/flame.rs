//! A flame at one instant: everything that does not depend on the place is worked out, and a medium answers for points.
//!
//! The gas rises along a bent axis, faster with height. What is at height y left the fuel τ(y) ago, so noise of (x, t − τ, z)
//! is carried up and drawn out by itself. How rich in fuel the gas is falls with the distance from the axis and, by burning,
//! with height; noise cuts tongues out of it, and pieces that are off. Where it is rich it is hot and full of soot.

use super::soot::Soot;
use super::{Burning, FireError, Grid};
use crate::noise::{curl_noise, noise};
use glam::{Mat3, UVec3, Vec2, Vec3, Vec4};
use std::sync::Arc;
use yugen_optics::random::Pcg32;
use yugen_optics::special::smoothstep;

/// The medium of a flame and the compute shader that makes cells of it: the twin of [`Flame::grid`]. To be put behind
/// [`NOISE_WGSL`](crate::noise::NOISE_WGSL). Binding 0 of group 0 is [`Flame::rows`], binding 1 gets the cells, four
/// numbers each as in [`Grid::data`]; the entry `main` works in groups of 64, one invocation a cell.
pub const FIRE_WGSL: &str = include_str!("fire.wgsl");

/// Steps along the axis in the tables of a flame.
const STEPS: usize = 64;
/// Knots of the axis' spline.
const KNOTS: usize = 10;

/// Shape over height, in flame lengths (Heskestad): width of the envelope over the bed's, how much fuel has burnt, and how
/// strongly noise cuts in. As much has burnt at .85 as there was on the axis, so that with the noise there is flame half of
/// the time at 1.1 to 1.15 lengths; at 1 is what Heskestad means. The rest is drawn by eye.
const SHAPE: [[f32; 4]; 10] = [
    [0.00, 0.78, 0.35, 1.20],
    [0.10, 0.92, 0.40, 1.70],
    [0.25, 0.96, 0.54, 2.10],
    [0.45, 0.92, 0.69, 2.30],
    [0.65, 0.84, 0.86, 2.40],
    [0.85, 0.75, 1.00, 2.40],
    [1.05, 0.66, 1.16, 2.20],
    [1.30, 0.58, 1.50, 2.00],
    [1.60, 0.54, 2.05, 1.80],
    [2.00, 0.50, 2.80, 1.80],
];
/// The box ends this many flame lengths up.
const TOP: f32 = 1.85;
/// And this many bed diameters beside the axis: noise reaches beyond the envelope, and puffs swell it.
const SIDE: f32 = 0.84;

/// Sizes of the three noises over the bed's diameter, how long one of their structures takes to pass over √(D/g), and
/// their share of the sum.
const LAYERS: [[f32; 3]; 3] = [[0.40, 1.5, 0.44], [0.20, 0.85, 0.56], [0.115, 0.50, 0.22]];
/// How far the first noise draws the others aside, in diameters, so that they curl.
const SWIRL: f32 = 0.11;
/// Temperature where there is hardly soot and where it is densest, K. Assumed: with these the light of the whole lies at
/// 1700 to 2000 K.
const COOL: f32 = 1330.0;
const HOT: f32 = 1860.0;
/// Cooling by radiation for each flame length, K.
const COOLING: f32 = 130.0;
/// Absorption of the smoke above, 1/m, where it is densest. Computed for pine: .015 g of soot a gram of wood, 8.7 m² a gram,
/// 100 kW of 15 kJ/g, in a plume of .15 m² at 4 m/s: 1.4, of which the flame's edge has seen half.
const SMOKE: f32 = 0.35;
/// Standard deviation of the light's flicker over its mean. Assumed: .1 to .2; nobody seems to have measured wood in baskets.
const CONTRAST: f32 = 0.15;
/// By how much fuel is added or taken so that the light is what the pulse says, at most.
const SPARE: f32 = 0.6;
/// Cells by which this is measured.
const MEASURED: UVec3 = UVec3::new(18, 44, 18);
/// And where flicker is reduced, which leaves less to error.
const MEASURED_WELL: UVec3 = UVec3::new(30, 72, 30);
/// How much the pulse makes the flame longer and wider, in logarithms: most of the light's flicker; fuel does the rest.
const LENGTHEN: f32 = 0.105;
const WIDEN: f32 = 0.03;
/// How far puffs swell and thin it on their way up.
const SWELL: f32 = 0.13;
/// Structures rise at this share of the velocity on the axis. Assumed: eddies go about half as fast as the jet between them.
const CARRIED: f32 = 0.45;

/// What is at a point of a fire.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Medium {
    /// Of the soot, K.
    pub temperature: f32,
    /// Absorption coefficient of glowing soot at 560 nm, 1/m.
    pub soot: f32,
    /// That of cold smoke, which hardly emits, 1/m.
    pub smoke: f32,
}

impl Medium {
    /// Absorption coefficient, 1/m.
    pub fn absorption(&self) -> f32 {
        self.soot + self.smoke
    }
}

/// What one height of a flame has.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    /// The axis, m beside the foot.
    axis: Vec2,
    /// One over the envelope's radius, 1/m.
    narrow: f32,
    /// Fuel that is burnt, in that on the axis at the bed.
    burnt: f32,
    /// Weight of the noise.
    cut: f32,
    /// How long ago it left the fuel, s.
    age: f32,
    /// Height in flame lengths.
    height: f32,
    /// Density of smoke, 0 to 1.
    smoke: f32,
}

/// A noise that rises.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// Structures a metre.
    fine: f32,
    /// Structures a second.
    rate: f32,
    /// Where in the noise: two numbers across, and how many structures have left the fuel, modulo 256.
    offset: Vec3,
    share: f32,
}

/// A fire at one instant.
#[derive(Clone, Debug)]
pub struct Flame {
    foot: Vec3,
    /// Columns: x, y (up) and z of the flame's own frame.
    frame: Mat3,
    lower: Vec3,
    upper: Vec3,
    /// Height of the lowest level and levels a metre.
    bottom: f32,
    levels_per_metre: f32,
    /// Radius of the envelope at the bed, m.
    drawn: f32,
    /// Of the box about the axis, from its middle, m.
    side: f32,
    levels: Vec<Level>,
    layers: [Layer; 3],
    /// How far the first noise draws the others aside, m.
    swirl: f32,
    /// Absorption of dense soot, 1/m.
    soot: f32,
    glow: Arc<Soot>,
}

/// The shape of a fire, without time.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub(super) frame: Mat3,
    /// Heskestad's length, m.
    pub(super) length: f32,
    diameter: f32,
    /// Of the wind in the flame's frame, across the axis, m/s.
    wind: Vec2,
    /// How much the wind shortens it.
    upright: f32,
    /// How much wider it is across the horizon, so that it is not thinned by leaning.
    broad: f32,
    /// How much the wind tears at it, 0 to 1.
    torn: f32,
    /// √(D/g): a puff takes three of these.
    beat: f32,
    /// Speed of structures where it no longer rises, m/s.
    fastest: f32,
    pub(super) bottom: f32,
    pub(super) top: f32,
    pub(super) lower: Vec3,
    pub(super) upper: Vec3,
    offsets: [Vec3; 4],
}

impl Shape {
    pub(super) fn new(fire: &super::Fire) -> Self {
        let up = fire.up.normalize();
        let frame = Mat3::from_quat(glam::Quat::from_rotation_arc(Vec3::Y, up));
        let (d, q) = (fire.diameter, fire.power);
        let length = length(d, q);
        let across = frame.transpose() * fire.wind;
        // Strong winds are slowed where flames draw air in, so that none lies flat on the ground.
        let wind = Vec2::new(across.x, across.z);
        let wind = wind / (1.0 + wind.length() / 10.0);
        // McCaffrey 1979: velocity on the axis, m/s, where the flame is intermittent.
        let fastest = CARRIED * 1.9 * q.powf(0.2);
        let upright = 1.0 / (1.0 + (wind.length() / (2.0 * fastest)).powi(2)).sqrt();
        let mut random = Pcg32::new(u64::from(fire.seed), 0x66_69_72_65);
        let offsets = std::array::from_fn(|_| random.next_vec3() * 256.0);
        let mut shape = Self {
            frame,
            length,
            diameter: d,
            wind,
            upright,
            broad: 1.0,
            torn: wind.length() / (wind.length() + 2.0),
            beat: (d / 9.81).sqrt(),
            fastest,
            bottom: -0.02 * d,
            top: TOP * length * upright,
            lower: Vec3::ZERO,
            upper: Vec3::ZERO,
            offsets,
        };
        let mut corners = [Vec3::MAX, Vec3::MIN];
        let tip = shape.lean(shape.age(length * upright)).length() / (length * upright);
        shape.broad = (1.0 + tip * tip).powf(0.25);
        let side = SIDE * d * shape.broad;
        for i in 0..=16 {
            let y = shape.bottom + (shape.top - shape.bottom) * i as f32 / 16.0;
            let lean = shape.lean(shape.age(y));
            for s in [Vec3::new(-side, 0.0, -side), Vec3::new(side, 0.0, side)] {
                let p = Vec3::new(lean.x, y, lean.y) + s;
                corners = [corners[0].min(p), corners[1].max(p)];
            }
        }
        let [lower, upper] = corners;
        let mut world = [Vec3::MAX, Vec3::MIN];
        for i in 0..8 {
            let pick = |k: usize| if i >> k & 1 == 0 { lower[k] } else { upper[k] };
            let p = fire.foot + frame * Vec3::new(pick(0), pick(1), pick(2));
            world = [world[0].min(p), world[1].max(p)];
        }
        [shape.lower, shape.upper] = world;
        shape
    }

    /// How long ago what is at height `y` left the fuel: McCaffrey's 6.8 √y m/s up to the fastest, ∫ dy / u in closed form.
    fn age(&self, y: f32) -> f32 {
        // Where it starts, so that nothing stands still.
        let start = 0.03 * self.diameter / 0.45;
        let y = (y - self.bottom).max(0.0);
        let pace = CARRIED * 6.8;
        let end = (self.fastest / pace).powi(2);
        let rising = 2.0 / pace * ((y + start).min(end.max(start)).sqrt() - start.sqrt());
        rising + (y + start - end.max(start)).max(0.0) / self.fastest
    }

    /// Speed at which the gas takes things along at height `y`, m/s: as fast as structures rise.
    pub(super) fn speed(&self, y: f32) -> f32 {
        let start = 0.03 * self.diameter / 0.45;
        (CARRIED * 6.8 * (y.max(0.0) + start).sqrt()).min(self.fastest)
    }

    /// Velocity that the wind has given to what left the fuel `age` ago, in the flame's frame.
    pub(super) fn lean_speed(&self, age: f32) -> Vec3 {
        let v = self.wind * (1.0 - (-age / (0.7 * self.beat)).exp());
        Vec3::new(v.x, 0.0, v.y)
    }

    /// A place in the noise of its own.
    pub(super) fn offset(&self) -> Vec3 {
        self.offsets[3]
    }

    /// How far the wind has taken what left the fuel `age` ago: it takes the gas along only by and by.
    fn lean(&self, age: f32) -> Vec2 {
        let slow = 0.7 * self.beat;
        self.wind * (age + slow * ((-age / slow).exp() - 1.0))
    }
}

/// Length of the flame over a bed of this diameter (m) and power (kW), m. Heskestad 1983; where the bed is wide for the power
/// it falls apart into flames of about a third of its width.
pub(super) fn length(diameter: f32, power: f32) -> f32 {
    (0.235 * power.powf(0.4) - 1.02 * diameter).max(0.33 * diameter)
}

/// Linear between the rows of [`SHAPE`].
fn profile(height: f32) -> [f32; 3] {
    let i = SHAPE.partition_point(|r| r[0] <= height).clamp(1, SHAPE.len() - 1);
    let (a, b) = (SHAPE[i - 1], SHAPE[i]);
    let t = ((height - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    [1, 2, 3].map(|k| a[k] + t * (b[k] - a[k]))
}

/// A uniform cubic B-spline through `knots` control points at `t` from 0 to 1; the ends are held.
fn spline(knots: &[Vec2], t: f32) -> Vec2 {
    let last = knots.len() - 1;
    let at = t.clamp(0.0, 1.0) * last as f32;
    let i = (at as usize).min(last - 1);
    let t = at - i as f32;
    let k = |j: isize| knots[(i as isize + j).clamp(0, last as isize) as usize];
    let s = 1.0 - t;
    (k(-1) * (s * s * s)
        + k(0) * (3.0 * t * t * t - 6.0 * t * t + 4.0)
        + k(1) * (3.0 * s * s * s - 6.0 * s * s + 4.0)
        + k(2) * (t * t * t))
        / 6.0
}

impl Flame {
    /// At `seconds` of the flame's own time.
    pub(super) fn new(burning: &Burning, seconds: f64, strength: f64) -> Self {
        let (shape, fire) = (&burning.shape, &burning.fire);
        let d = fire.diameter;
        let strong = (strength * burning.pulse.at(seconds)) as f32;
        let length = shape.length * (LENGTHEN * strong).exp();
        let wide = 0.5 * d * shape.broad * (WIDEN * strong).exp();
        let (bottom, top) = (shape.bottom, shape.top);
        let height = |i: usize, n: usize| bottom + (top - bottom) * i as f32 / (n - 1) as f32;
        // The axis sways in a flow without sources, the more the longer the gas is under way.
        let sway = |seconds: f64, age: f32| {
            let born = (seconds - f64::from(age)) * f64::from(0.33 / shape.beat);
            let slow = seconds * f64::from(0.1 / shape.beat);
            let p = shape.offsets[3]
                + Vec3::new(born.rem_euclid(256.0) as f32, 0.0, slow.rem_euclid(256.0) as f32);
            let v = curl_noise(p);
            let grown = age / (age + 2.0 * shape.beat);
            Vec2::new(v.x, v.z).clamp_length_max(2.0) * (0.15 * d * grown * (1.0 + 2.0 * shape.torn))
        };
        let knots: Vec<Vec2> = (0..KNOTS)
            .map(|i| {
                let age = shape.age(height(i, KNOTS));
                shape.lean(age) + sway(seconds, age)
            })
            .collect();
        let levels = (0..STEPS)
            .map(|i| {
                let y = height(i, STEPS);
                let h = y.max(0.0) / (length * shape.upright);
                let [width, burnt, cut] = profile(h);
                let age = shape.age(y);
                let puff = (strength * burning.pulse.puff(seconds - f64::from(age))) as f32;
                let swell = 1.0 + SWELL * puff * smoothstep(0.0, 0.3, h);
                // Nothing burns below the bed's floor, and nothing goes beyond the box.
                let start = smoothstep(bottom, 0.06 * d, y);
                let end = 1.0 - smoothstep(0.9, 1.0, i as f32 / (STEPS - 1) as f32);
                Level {
                    axis: spline(&knots, i as f32 / (STEPS - 1) as f32),
                    narrow: 1.0 / (wide * width * swell),
                    burnt: burnt - 0.5 * (swell - 1.0) + 2.0 * (1.0 - start.min(end)),
                    cut: cut * (1.0 + 0.12 * shape.torn),
                    age,
                    height: h,
                    smoke: SMOKE * smoothstep(0.55, 1.25, h) * end,
                }
            })
            .collect();
        let layers = std::array::from_fn(|k| {
            let [size, pass, share] = LAYERS[k];
            let rate = 1.0 / (pass * shape.beat);
            let mut offset = shape.offsets[k];
            offset.y = (f64::from(offset.y) + seconds * f64::from(rate)).rem_euclid(256.0) as f32;
            // Slowly across, so that nothing comes back when the noise has run through its period.
            offset.x = (f64::from(offset.x) + seconds * 0.0437).rem_euclid(256.0) as f32;
            Layer { fine: 1.0 / (size * d), rate, offset, share }
        });
        let mut flame = Self {
            foot: fire.foot,
            frame: shape.frame,
            lower: shape.lower,
            upper: shape.upper,
            bottom,
            levels_per_metre: (STEPS - 1) as f32 / (top - bottom),
            drawn: wide * SHAPE[0][1],
            side: SIDE * d * shape.broad,
            levels,
            layers,
            swirl: SWIRL * d * (1.0 + shape.torn),
            soot: burning.soot,
            glow: burning.glow.clone(),
        };
        if burning.emission > 0.0 {
            let target = burning.emission * f64::from(1.0 + CONTRAST * strong).max(0.2);
            flame.feed(target, if strength < 1.0 { MEASURED_WELL } else { MEASURED });
        }
        flame
    }

    /// The box outside of which there is nothing, lower and upper corner; the same at every instant of a fire.
    pub fn bounds(&self) -> [Vec3; 2] {
        [self.lower, self.upper]
    }

    /// What is at a point.
    pub fn medium(&self, p: Vec3) -> Medium {
        let (smoke, gas) = self.gas(self.frame.transpose() * (p - self.foot), 0.0);
        let Some(gas) = gas.filter(|gas| gas.rich > 0.0) else {
            return Medium { temperature: 0.0, soot: 0.0, smoke };
        };
        Medium { temperature: gas.temperature(), soot: self.soot * gas.density(), smoke }
    }

    /// Density of smoke at a point of the flame's own frame, and the gas there where it could be rich if all had `spare` more fuel.
    fn gas(&self, p: Vec3, spare: f32) -> (f32, Option<Gas>) {
        let at = (p.y - self.bottom) * self.levels_per_metre;
        if !(at >= 0.0 && at < (STEPS - 1) as f32) {
            return (0.0, None);
        }
        let (a, b) = (&self.levels[at as usize], &self.levels[at as usize + 1]);
        let t = at.fract();
        let mix = |a: f32, b: f32| a + t * (b - a);
        let q = Vec2::new(p.x, p.z) - a.axis.lerp(b.axis, t);
        let narrow = mix(a.narrow, b.narrow);
        let out = q.length_squared() * narrow * narrow;
        let cut = mix(a.cut, b.cut);
        let rich = 1.0 - out * out - mix(a.burnt, b.burnt);
        let smoke = mix(a.smoke, b.smoke) * smoothstep(0.0, 1.0, 1.4 - 0.55 * out);
        // Noise stays within ±.9.
        let [l0, l1, l2] = &self.layers;
        let may_burn = rich + spare + 0.9 * cut * (l0.share + l1.share + l2.share) > 0.0;
        if smoke <= 0.0 && !may_burn {
            return (0.0, None);
        }
        let age = mix(a.age, b.age);
        // What rises draws together with the envelope.
        let q = q * (0.6 + 0.4 * narrow * self.drawn);
        let (n0, slope) = l0.at(q, age);
        let smoke = smoke * (0.6 + 0.8 * n0).max(0.0);
        let rich = rich + cut * l0.share * n0;
        if rich + spare + 0.9 * cut * (l1.share + l2.share) <= 0.0 {
            return (smoke, None);
        }
        let height = mix(a.height, b.height);
        let aside = Vec2::new(slope.z, -slope.x) * (self.swirl * (0.4 + height));
        let n1 = l1.at(q + aside, age).0;
        let rich = rich + cut * l1.share * n1;
        if rich + spare + 0.9 * cut * l2.share <= 0.0 {
            return (smoke, None);
        }
        let rich = rich + cut * l2.share * l2.at(q + 1.6 * aside, age).0;
        // Thin between the folds, where the second noise is about nought.
        let fold = 1.0 - 0.9 * (-36.0 * n1 * n1).exp() * smoothstep(0.02, 0.25, height);
        (smoke, Some(Gas { rich, height, fold }))
    }

    /// Gives the flame as much more or less fuel that its emission is `target` (cd, for soot of 1/m): heat comes at
    /// the rate at which wood gives gas off, however the flame spreads it.
    fn feed(&mut self, target: f64, measured: UVec3) {
        let cells = self.burning(measured, SPARE);
        let of = |spare: f32| self.emission(&cells, measured, spare).max(1e-30).ln();
        let target = target.ln();
        let (mut low, mut high) = ((-SPARE, of(-SPARE)), (SPARE, of(SPARE)));
        for _ in 0..9 {
            let middle = 0.5 * (low.0 + high.0);
            let at = (middle, of(middle));
            *(if at.1 < target { &mut low } else { &mut high }) = at;
        }
        // Straight between the two, so that it is as smooth in time as the flame.
        let t = ((target - low.1) / (high.1 - low.1).max(1e-9)).clamp(0.0, 1.0) as f32;
        let spare = low.0 + t * (high.0 - low.0);
        self.levels.iter_mut().for_each(|l| l.burnt -= spare);
    }

    /// Gas that may burn with `spare` more fuel, at the centres of `measured` cells of a box that is sheared along the axis,
    /// which leaves volumes as they are.
    fn burning(&self, measured: UVec3, spare: f32) -> Vec<Gas> {
        let [nx, ny, nz] = measured.to_array();
        let mut found = Vec::new();
        let middle = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        for j in 0..ny {
            let at = middle(j, ny) * (STEPS - 1) as f32;
            let (a, b) = (&self.levels[at as usize], &self.levels[at as usize + 1]);
            let axis = a.axis.lerp(b.axis, at.fract());
            for k in 0..nz {
                for i in 0..nx {
                    let q =
                        axis + Vec2::new(2.0 * middle(i, nx) - 1.0, 2.0 * middle(k, nz) - 1.0) * self.side;
                    let p = Vec3::new(q.x, self.bottom + at / self.levels_per_metre, q.y);
                    found.extend(self.gas(p, spare).1);
                }
            }
        }
        found
    }

    /// Luminance of the emission of all `cells` of so many with `spare` more fuel, for soot of 1/m.
    fn emission(&self, cells: &[Gas], measured: UVec3, spare: f32) -> f64 {
        let weights = self.glow.space.luminance_weights();
        let sum: f64 = cells
            .iter()
            .map(|gas| Gas { rich: gas.rich + spare, ..*gas })
            .filter(|gas| gas.rich > 0.0)
            .map(|gas| f64::from(weights.dot(self.glow.light(gas.temperature())) * gas.density()))
            .sum();
        let height = (STEPS - 1) as f32 / self.levels_per_metre;
        let volume = f64::from(4.0 * self.side * self.side * height);
        sum * volume / f64::from(measured.x * measured.y * measured.z)
    }

    /// That of the flame as it is.
    pub(super) fn measured(&self) -> f64 {
        self.emission(&self.burning(MEASURED, 0.0), MEASURED, 0.0)
    }

    /// How many cells of about `edge` m there are along each axis of the bounds; no fewer than a grid may have, and longer
    /// edges where there were too many.
    pub fn cells(&self, edge: f32) -> UVec3 {
        let size = self.upper - self.lower;
        let least = (1.05 * size.element_product() / Grid::MOST as f32).cbrt();
        let few = Vec3::splat(Grid::FEWEST as f32);
        // What is not a number counts as nought.
        (size / edge.max(least)).ceil().max(few).as_uvec3()
    }

    /// Emission (radiance per metre; its luminance in cd/m³) and absorption (1/m) of a point, as in [`Grid::data`].
    pub fn cell(&self, p: Vec3) -> Vec4 {
        let medium = self.medium(p);
        (medium.soot * self.glow.light(medium.temperature)).extend(medium.absorption())
    }

    /// Emission at the centres of `cells` cells along x, y, z over the bounds.
    ///
    /// # Errors
    /// Too few cells along an axis, or too many in all.
    pub fn grid(&self, cells: UVec3) -> Result<Grid, FireError> {
        Grid::check(cells)?;
        let mut grid = Grid {
            size: cells,
            lower: self.lower,
            upper: self.upper,
            space: self.glow.space,
            data: Vec::with_capacity((cells.x * cells.y * cells.z) as usize),
            solid: Vec::new(),
        };
        for z in 0..cells.z {
            for y in 0..cells.y {
                for x in 0..cells.x {
                    let cell = UVec3::new(x, y, z);
                    let edge = cell.cmpeq(UVec3::ZERO).any() || (cell + 1).cmpeq(cells).any();
                    let value = if edge { Vec4::ZERO } else { self.cell(grid.centre(cell)) };
                    grid.data.push(value.to_array());
                }
            }
        }
        Ok(grid)
    }

    /// What the shader reads to make `cells` cells along x, y, z: rows of four numbers.
    pub fn rows(&self, cells: UVec3) -> Vec<[f32; 4]> {
        let row = |v: Vec3, w: f32| v.extend(w).to_array();
        let mut rows = vec![
            row(self.lower, self.soot),
            row(self.upper, self.swirl),
            row(self.foot, self.bottom),
            row(self.frame.x_axis, self.levels_per_metre),
            row(self.frame.y_axis, self.drawn),
            row(self.frame.z_axis, STEPS as f32),
            row(cells.as_vec3(), 0.0),
        ];
        for l in &self.layers {
            rows.push(row(l.offset, l.fine));
            rows.push([l.rate, l.share, 0.0, 0.0]);
        }
        for l in &self.levels {
            rows.push([l.axis.x, l.axis.y, l.narrow, l.burnt]);
            rows.push([l.cut, l.age, l.height, l.smoke]);
        }
        rows.extend(self.glow.rows());
        rows
    }
}

/// Gas that may burn.
#[derive(Clone, Copy, Debug)]
struct Gas {
    /// How much fuel there is for the air: flame where it is positive.
    rich: f32,
    /// In flame lengths.
    height: f32,
    /// Less than 1 between the folds of the flame.
    fold: f32,
}

impl Gas {
    /// Of soot, 0 to 1.
    fn density(&self) -> f32 {
        smoothstep(0.0, 0.3, self.rich) * self.fold
    }

    /// Of soot, K.
    fn temperature(&self) -> f32 {
        COOL + (HOT - COOL) * smoothstep(0.0, 1.1, self.rich) - COOLING * self.height
    }
}

impl Layer {
    /// Value and slope by place, at `q` beside the axis, for what left the fuel `age` ago.
    fn at(&self, q: Vec2, age: f32) -> (f32, Vec3) {
        noise(self.offset + Vec3::new(q.x * self.fine, -age * self.rate, q.y * self.fine))
    }
}
