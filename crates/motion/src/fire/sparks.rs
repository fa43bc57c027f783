//! Sparks: specks of glowing charcoal that the gas takes along.

use super::Burning;
use crate::noise::curl_noise;
use glam::Vec3;
use yugen_optics::random::Pcg32;

/// Sparks in the air at a time for each kilowatt, and the most of them. Assumed: pine crackles, some hundreds are seen.
const COUNT: [f32; 2] = [2.4, 500.0];
/// How long one glows, s. Assumed: a millimetre of charcoal burns for seconds; most go out earlier.
const LIFE: [f32; 2] = [0.5, 2.2];
/// Radius, m. Assumed.
const RADIUS: [f32; 2] = [0.0004, 0.0014];
/// Temperature at the start and the end, K. Assumed: at the start as bright as the flame's edge, at the end a dull red.
const KELVIN: [f32; 2] = [1750.0, 1150.0];
/// Steps of the path, s: always from the start of a life, so that a spark's place depends on nothing but the time.
const STEP: f32 = 1.0 / 30.0;
/// Speed of eddies over that of the rising gas.
const TURBULENCE: f32 = 0.42;

/// A spark at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spark {
    /// Where it is, m.
    pub position: Vec3,
    /// Where it goes, m/s: with the time of exposure, its streak.
    pub velocity: Vec3,
    /// Of the speck, m.
    pub radius: f32,
    /// Of its surface, K.
    pub temperature: f32,
}

impl Burning {
    /// The sparks in the air at `seconds`; a spark keeps its place in the list for all its life, then another has it.
    pub fn sparks(&self, seconds: f64) -> Vec<Spark> {
        let seconds = self.moment(seconds).0;
        let count = (COUNT[0] * self.fire.power).clamp(1.0, COUNT[1]) as u32;
        (0..count).map(|i| self.spark(i, seconds)).collect()
    }

    fn spark(&self, index: u32, seconds: f64) -> Spark {
        let between = |range: [f32; 2], t: f32| range[0] + (range[1] - range[0]) * t;
        let mut own = Pcg32::new(u64::from(self.fire.seed), 0x7370_0000_0000 + u64::from(index));
        // Each place in the list has its own span; a life fills it.
        let life = between(LIFE, own.next_f32() * own.next_f32());
        let turn = seconds / f64::from(life) + f64::from(own.next_f32());
        let (which, age) = (turn.floor(), (turn - turn.floor()) as f32 * life);
        let mut random = Pcg32::new(which as i64 as u64, 0x7370_6172_0000 ^ u64::from(own.next_u32()));
        let shape = &self.shape;
        let d = self.fire.diameter;
        let angle = std::f32::consts::TAU * random.next_f32();
        let out = 0.42 * d * random.next_f32().sqrt();
        let mut p = Vec3::new(out * angle.cos(), 0.12 * d * random.next_f32(), out * angle.sin());
        // A crackle throws it.
        let thrown = (random.next_vec3() - Vec3::new(0.5, 0.0, 0.5)) * 1.8;
        let eddy = random.next_vec3() * 0.35 + shape.offset();
        let born = (seconds - f64::from(age)).rem_euclid(4096.0) as f32;
        let mut at = 0.0;
        let mut velocity = thrown;
        while at < age {
            let step = STEP.min(age - at);
            let rise = shape.speed(p.y) * (1.0 - 0.25 * (p.y / (3.0 * shape.length)).min(1.0));
            // Eddies rise with the gas at half its speed.
            let q = Vec3::new(p.x, p.y - 0.5 * rise * (born + at).rem_euclid(64.0), p.z) * (1.6 / d);
            let v = curl_noise((q + eddy).rem_euclid(Vec3::splat(256.0)));
            let swirl = v * (TURBULENCE * rise);
            let wind = shape.lean_speed(at);
            let drag = (-at / 0.12).exp();
            velocity = thrown * drag + (1.0 - drag) * (Vec3::Y * rise + swirl) + wind;
            p += velocity * step;
            at += step;
        }
        let aged = age / life;
        Spark {
            position: self.fire.foot + shape.frame * p,
            velocity: shape.frame * velocity,
            radius: between(RADIUS, random.next_f32().powi(2)) * (1.0 - 0.5 * aged),
            temperature: between(KELVIN, aged * aged),
        }
    }
}
