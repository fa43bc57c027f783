//! A virtual goniometer: what a machine that lights a flat cloth from every side would photograph, from a cloth
//! whose truth is known.
//!
//! Light reflects once; with heights, threads shade each other. What bounces between threads is the business of
//! the path tracer.

use crate::rows::for_rows;
use crate::{Eye, Lights, Stack};
use glam::{Vec2, Vec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::f32::consts::PI;
use yugen_optics::frame::spherical;
use yugen_optics::random::{Pcg32, hash_combine};
use yugen_reflectance::btf::Btf;
use yugen_reflectance::{Choice, Model, ModelError};

/// `n` directions spread evenly over the cap about +z within `max_polar` radians: a Fibonacci lattice, after
/// Swinbank and Purser 2006.
pub fn fibonacci_dome(n: usize, max_polar: f32) -> Vec<Vec3> {
    // The golden angle, 2π(1 − 1/φ).
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let depth = 1.0 - f64::from(max_polar).cos();
    (0..n)
        .map(|i| {
            let z = 1.0 - (i as f64 + 0.5) / n as f64 * depth;
            spherical(z.acos() as f32, (i as f64 * turn).rem_euclid(std::f64::consts::TAU) as f32)
        })
        .collect()
}

/// What lies before the camera.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    btf: &'a Btf,
    relief: Option<Relief<'a>>,
    form: Choice,
    /// Baked tables by the bits of σ, for forms that need one.
    tables: HashMap<[u32; 2], Vec<f32>>,
}

impl<'a> Subject<'a> {
    /// A cloth that reflects as `form` of [`yugen_reflectance::noh::Noh`] makes of its maps. With `heights`, one a
    /// texel in widths of a texel, threads cast shadows and hide what lies behind them.
    ///
    /// # Errors
    /// Where the form cannot be made for the σ of a texel.
    ///
    /// # Panics
    /// If there are fewer texels or heights than width times height.
    pub fn new(btf: &'a Btf, heights: Option<&'a [f32]>, form: Choice) -> Result<Self, ModelError> {
        assert_eq!(btf.texels.len(), btf.width * btf.height, "one texel each");
        let relief = heights.map(|heights| Relief::new(heights, btf.width, btf.height));
        let mut tables = HashMap::new();
        for texel in &btf.texels {
            let key = texel.sigma.to_array().map(f32::to_bits);
            if let Entry::Vacant(place) = tables.entry(key) {
                let table = texel.noh(form).bake(&[])?;
                if table.is_empty() {
                    break;
                }
                place.insert(table);
            }
        }
        Ok(Self { btf, relief, form, tables })
    }

    /// The picture under one light, seen by `eye` (or in a direction from far away) and laid back flat, texel by texel
    /// from the top left: the reflectance factor π f cos θ times the irradiance relative to the centre, as a
    /// [`Stack`] has it. NaN where the camera cannot see the texel.
    pub fn picture(&self, lights: &Lights, light: usize, eye: impl Into<Eye>) -> Vec<Vec3> {
        let Btf { width, height, .. } = *self.btf;
        // Knows where the lights of a picture of this size stand.
        let geometry = self.stack(lights.clone(), eye.into(), Vec::new());
        let mut picture = vec![Vec3::ZERO; width * height];
        for_rows(&mut picture, width, |y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                let (toward, irradiance) = geometry.light(light, x, y);
                *value = self.radiance(x, y, toward, geometry.eye(light, x, y)) * irradiance;
            }
        });
        picture
    }

    /// π f cos θ of a texel.
    fn radiance(&self, x: usize, y: usize, light: Vec3, view: Vec3) -> Vec3 {
        let texel = &self.btf.texels[y * self.btf.width + x];
        let frame = texel.frame();
        let (wo, wi) = (frame.to_local(view), frame.to_local(light));
        let open = |toward: Vec3| self.relief.as_ref().is_none_or(|relief| relief.open(x, y, toward));
        if wo.z <= 0.0 || view.z <= 0.0 || !open(view) {
            return Vec3::NAN;
        }
        if wi.z <= 0.0 || light.z <= 0.0 || !open(light) {
            return Vec3::ZERO;
        }
        let table = self.tables.get(&texel.sigma.to_array().map(f32::to_bits)).map_or(&[][..], Vec::as_slice);
        texel.noh(self.form).eval(table, wo, wi) * (PI * wi.z)
    }

    fn stack(&self, lights: Lights, eye: Eye, values: Vec<[f32; 3]>) -> Stack {
        let Btf { width, height, .. } = *self.btf;
        let eyes = vec![eye; lights.len()];
        Stack { width, height, first_row: 0, rows: height, lights, eyes, values }
    }

    /// All pictures as the camera takes and linearises them.
    pub fn photograph(&self, lights: &Lights, eye: impl Into<Eye>, camera: &Camera) -> Stack {
        let (n, eye) = (lights.len(), eye.into());
        let mut values = vec![[0.0; 3]; self.btf.texels.len() * n];
        for light in 0..n {
            let seen = camera.look(&self.picture(lights, light, eye), self.btf.width);
            let developed = camera.develop(&camera.bracket(&seen, light));
            for (samples, value) in values.chunks_exact_mut(n).zip(developed) {
                samples[light] = value.to_array();
            }
        }
        self.stack(lights.clone(), eye, values)
    }
}

/// Heights that light has to pass.
#[derive(Clone, Copy, Debug)]
struct Relief<'a> {
    heights: &'a [f32],
    width: usize,
    height: usize,
    top: f32,
}

impl<'a> Relief<'a> {
    fn new(heights: &'a [f32], width: usize, height: usize) -> Self {
        assert_eq!(heights.len(), width * height, "one height a texel");
        let top = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        Self { heights, width, height, top }
    }

    /// Between texels linearly, `at` in texels from the centre of the first one; `None` outside.
    fn at(&self, at: Vec2) -> Option<f32> {
        let last = Vec2::new((self.width - 1) as f32, (self.height - 1) as f32);
        if at.cmplt(Vec2::ZERO).any() || at.cmpgt(last).any() {
            return None;
        }
        let (x0, y0) = (at.x as usize, at.y as usize);
        let (x1, y1) = ((x0 + 1).min(self.width - 1), (y0 + 1).min(self.height - 1));
        let h = |x: usize, y: usize| self.heights[y * self.width + x];
        let f = at.fract();
        let upper = h(x0, y0) + f.x * (h(x1, y0) - h(x0, y0));
        let lower = h(x0, y1) + f.x * (h(x1, y1) - h(x0, y1));
        Some(upper + f.y * (lower - upper))
    }

    /// Whether nothing stands between a texel and what lies `toward` (above the horizon).
    fn open(&self, x: usize, y: usize, toward: Vec3) -> bool {
        // Half a texel: no thread is thinner.
        const STEP: f32 = 0.5;
        // The heights between texels are linear, the surface is not: what lies this little higher hides nothing.
        const SLACK: f32 = 0.02;
        let along = Vec2::new(toward.x, -toward.y);
        let distance = along.length();
        if distance < 1e-6 {
            return true;
        }
        let (along, rise) = (along * (STEP / distance), toward.z / distance * STEP);
        let mut at = Vec2::new(x as f32, y as f32);
        let mut ray = self.heights[y * self.width + x] + SLACK;
        loop {
            at += along;
            ray += rise;
            if ray > self.top {
                return true;
            }
            match self.at(at) {
                Some(height) if height > ray => return false,
                Some(_) => {}
                None => return true,
            }
        }
    }
}

/// The camera of the machine: lens, exposures and sensor. The default is perfect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Camera {
    /// Blur of the lens: standard deviation in texels of a Gaussian spot.
    pub blur: f32,
    /// Share of the light that the corners lose; it grows with the square of the distance from the centre.
    pub vignetting: f32,
    /// What turns light to numbers; numbers without error where absent.
    pub sensor: Option<Sensor>,
}

/// Turns light to numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// The reflectance factor that just fills a pixel in an exposure of one second.
    pub white: f32,
    /// Exposure times of each picture's bracket, in seconds; at least one.
    pub seconds: Vec<f32>,
    /// Electrons that a pixel holds; photons come as they like (Poisson). Infinite: without noise.
    pub full_well: f32,
    /// Standard deviation of what reading adds, in electrons.
    pub read_noise: f32,
    /// Steps of the numbers: 2 to this power; `None` keeps them continuous.
    pub bits: Option<u32>,
    /// Another seed, another noise.
    pub seed: u32,
}

impl Default for Sensor {
    /// A good camera of today, exposed so that no highlight of a narrow gold strip is lost.
    fn default() -> Self {
        Self {
            white: 64.0,
            seconds: vec![1.0],
            full_well: 50_000.0,
            read_noise: 3.0,
            bits: Some(16),
            seed: 0,
        }
    }
}

impl Camera {
    /// The light that arrives at the sensor: vignetted and blurred. Texels without a value (NaN) keep out of their
    /// neighbours.
    pub fn look(&self, picture: &[Vec3], width: usize) -> Vec<Vec3> {
        let height = picture.len() / width.max(1);
        let half = 0.5 * Vec2::new(width as f32, height as f32);
        let mut seen: Vec<Vec3> = picture.to_vec();
        if self.vignetting > 0.0 {
            for_rows(&mut seen, width, |y, row| {
                for (x, value) in row.iter_mut().enumerate() {
                    let off = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - half;
                    *value *= 1.0 - self.vignetting * off.length_squared() / half.length_squared();
                }
            });
        }
        if self.blur > 0.0 {
            // Three standard deviations hold all but 0.3 %; the weights are normalised by what they meet.
            let reach = (3.0 * self.blur).ceil() as usize;
            let kernel: Vec<f32> =
                (0..=reach).map(|i| (-0.5 * (i as f32 / self.blur).powi(2)).exp()).collect();
            let across = seen.clone();
            for_rows(&mut seen, width, |y, row| {
                let line = &across[y * width..][..width];
                blur_line(&kernel, row, |x| line[x]);
            });
            let mut columns = vec![Vec3::ZERO; seen.len()];
            for_rows(&mut columns, height, |x, column| {
                blur_line(&kernel, column, |y| seen[y * width + x]);
            });
            for_rows(&mut seen, width, |y, row| {
                for (x, value) in row.iter_mut().enumerate() {
                    *value = columns[x * height + y];
                }
            });
        }
        seen
    }

    /// The numbers of every exposure of a picture, as parts of the largest number there is; `number` tells the
    /// noise of one picture from that of another. Without a sensor the light itself.
    pub fn bracket(&self, seen: &[Vec3], number: usize) -> Vec<Vec<Vec3>> {
        let Some(sensor) = &self.sensor else { return vec![seen.to_vec()] };
        let seconds = sensor.seconds.iter().enumerate();
        seconds.map(|(i, s)| sensor.expose(seen, *s, (number * sensor.seconds.len() + i) as u32)).collect()
    }

    /// Reflectance factors from a bracket: all light caught over all time it was caught in, which for photon noise
    /// is the most likely value. NaN where every exposure is saturated.
    pub fn develop(&self, bracket: &[Vec<Vec3>]) -> Vec<Vec3> {
        let Some(sensor) = &self.sensor else { return bracket[0].clone() };
        let channel = |texel: usize, c: usize| {
            let usable = bracket.iter().zip(&sensor.seconds).filter(|(e, _)| e[texel][c] < 1.0);
            let (light, time) = usable.fold((0.0, 0.0), |(l, t), (e, s)| (l + e[texel][c], t + s));
            // 0/0, and so NaN, where there is none.
            light / time * sensor.white
        };
        (0..bracket[0].len()).map(|i| Vec3::new(channel(i, 0), channel(i, 1), channel(i, 2))).collect()
    }
}

/// One line through a symmetric kernel, given from its middle outwards.
fn blur_line(kernel: &[f32], out: &mut [Vec3], line: impl Fn(usize) -> Vec3) {
    let n = out.len();
    for (x, value) in out.iter_mut().enumerate() {
        let first = x.saturating_sub(kernel.len() - 1);
        let last = (x + kernel.len()).min(n);
        let (sum, weight) = (first..last)
            .map(|i| (line(i), kernel[i.abs_diff(x)]))
            .filter(|(v, _)| !v.is_nan())
            .fold((Vec3::ZERO, 0.0), |(s, w), (v, k)| (s + v * k, w + k));
        // What has no value of its own gets none.
        *value = if line(x).is_nan() { Vec3::NAN } else { sum / weight };
    }
}

impl Sensor {
    /// The numbers of one exposure, in [0, 1]; 1 is saturated. NaN stays NaN.
    fn expose(&self, seen: &[Vec3], seconds: f32, number: u32) -> Vec<Vec3> {
        let mut out = seen.to_vec();
        let shot = hash_combine(self.seed, number);
        for_rows(&mut out, 1 << 10, |chunk, values| {
            for (i, value) in values.iter_mut().enumerate() {
                let texel = (chunk << 10 | i) as u32;
                let high = u64::from(hash_combine(shot, texel)) << 32;
                let mut random = Pcg32::new(high | u64::from(texel), u64::from(shot));
                *value = value.to_array().map(|v| self.read(v * seconds / self.white, &mut random)).into();
            }
        });
        out
    }

    /// The number for a pixel filled to the part `filled` of what it holds.
    fn read(&self, filled: f32, random: &mut Pcg32) -> f32 {
        if filled.is_nan() {
            return f32::NAN;
        }
        let mut level = filled;
        if self.full_well.is_finite() {
            // A pixel that overflows many times over is full whatever the noise.
            let mean = f64::from(filled.min(4.0) * self.full_well);
            let electrons = random.poisson(mean) as f32 + self.read_noise * random.normal();
            level = electrons / self.full_well;
        }
        let level = level.clamp(0.0, 1.0);
        self.bits.map_or(level, |bits| {
            let steps = ((1u64 << bits.clamp(1, 32)) - 1) as f32;
            (level * steps).round() / steps
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;
    use yugen_optics::ColourSpace;
    use yugen_optics::statistics::Moments;
    use yugen_reflectance::btf::Texel;

    fn texel(normal: Vec3, angle: f32) -> Texel {
        let normal = normal.normalize();
        let tangent = Vec3::new(angle.cos(), angle.sin(), 0.0);
        Texel {
            diffuse: Vec3::new(0.4, 0.05, 0.03),
            specular: Vec3::new(0.3, 0.25, 0.1),
            normal,
            tangent: (tangent - normal * normal.dot(tangent)).normalize(),
            sigma: Vec2::new(0.2, 0.4),
            confidence: 1.0,
        }
    }

    fn cloth(width: usize, height: usize, texel: impl Fn(usize, usize) -> Texel) -> Btf {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Btf { width, height, colour_space: ColourSpace::LinearSrgb, texels }
    }

    fn flat(width: usize, height: usize) -> Btf {
        cloth(width, height, |_, _| texel(Vec3::Z, 0.0))
    }

    #[test]
    fn the_dome_is_even_and_within_its_angle() {
        let dome = fibonacci_dome(200, 75f32.to_radians());
        assert_eq!(dome.len(), 200);
        let lowest = 75f32.to_radians().cos();
        assert!(dome.iter().all(|d| (d.length() - 1.0).abs() < 1e-6 && d.z > lowest));
        // The mean of a cap is (1 + cos θ)/2 high and central.
        let mean = dome.iter().sum::<Vec3>() / 200.0;
        assert!((mean - Vec3::new(0.0, 0.0, 0.5 + 0.5 * lowest)).length() < 5e-3, "{mean}");
        // Nearest neighbours: none nearer than half of what an even packing of the cap would have.
        let nearest = |i: usize| {
            let others = (0..200).filter(|j| *j != i);
            others.map(|j| dome[i].angle_between(dome[j])).fold(f32::MAX, f32::min)
        };
        let even = (TAU * (1.0 - lowest) / 200.0).sqrt();
        assert!((0..200).all(|i| nearest(i) > 0.5 * even && nearest(i) < 1.5 * even));
    }

    #[test]
    fn a_texel_shows_its_model_in_its_own_frame() {
        let btf = cloth(2, 2, |x, y| texel(Vec3::new(0.2 * x as f32, -0.1 * y as f32, 1.0), 0.7 * x as f32));
        let lights = Lights::Distant(fibonacci_dome(30, 1.2));
        let view = Vec3::new(0.1, 0.3, 0.8).normalize();
        for (name, form) in [("ward_gmd", 0), ("ashikhmin2000", 3), ("ggx", 5)] {
            let form = Choice(form as f32);
            let subject = Subject::new(&btf, None, form).unwrap();
            let table = btf.texels[0].noh(form).bake(&[]).unwrap();
            for light in 0..30 {
                let picture = subject.picture(&lights, light, view);
                for (texel, value) in btf.texels.iter().zip(&picture) {
                    let (t, n) = (texel.tangent, texel.normal);
                    let b = n.cross(t);
                    let local = |w: Vec3| Vec3::new(w.dot(t), w.dot(b), w.dot(n));
                    let Lights::Distant(toward) = &lights else { unreachable!() };
                    let wi = local(toward[light]);
                    let want = texel.noh(form).eval(&table, local(view), wi) * (PI * wi.z.max(0.0));
                    assert!((*value - want).abs().max_element() < 1e-5 * want.max_element() + 1e-6, "{name}");
                }
            }
        }
    }

    #[test]
    fn a_wall_shades_what_lies_behind_it() {
        // A wall 4 texels high at x = 10, the light at 45° from the right: shadow from x = 7 to 9, x = 6 just escapes.
        let btf = flat(20, 5);
        let heights: Vec<f32> = (0..100).map(|i| if i % 20 == 10 { 4.0 } else { 0.0 }).collect();
        let lights = Lights::Distant(vec![Vec3::new(1.0, 0.0, 1.0).normalize(), Vec3::Z]);
        let subject = Subject::new(&btf, Some(&heights), Choice(0.0)).unwrap();
        let picture = subject.picture(&lights, 0, Vec3::Z);
        for y in 0..5 {
            for x in 0..20 {
                let dark = picture[y * 20 + x] == Vec3::ZERO;
                assert_eq!(dark, (7..=9).contains(&x), "{x} {y}");
            }
        }
        let straight = subject.picture(&lights, 1, Vec3::Z);
        assert!(straight.iter().all(|v| v.min_element() > 0.0));
        // What the light cannot reach, an eye in its place cannot see.
        let Lights::Distant(toward) = &lights else { unreachable!() };
        let hidden = subject.picture(&lights, 1, toward[0]);
        assert!(hidden.iter().zip(&picture).all(|(h, p)| h.is_nan() == (*p == Vec3::ZERO)));
    }

    #[test]
    fn near_lights_fade_with_the_square_of_the_distance() {
        let btf = cloth(101, 3, |_, _| Texel { specular: Vec3::ZERO, ..texel(Vec3::Z, 0.0) });
        let lights = Lights::Near(vec![Vec3::new(0.0, 0.0, 0.5)]);
        let subject = Subject::new(&btf, None, Choice(0.0)).unwrap();
        let picture = subject.picture(&lights, 0, Vec3::Z);
        // A lamp over the centre: cos θ from the slant, cos² θ from the distance.
        let ratio = picture[101].x / picture[101 + 50].x;
        let x = 50.0f32 / 101.0;
        let want = (0.25 / (0.25 + x * x)).powf(1.5);
        assert!((ratio / want - 1.0).abs() < 1e-5, "{ratio} {want}");
        assert!((picture[101 + 50].x - 0.4).abs() < 1e-6, "albedo under a light overhead");
    }

    /// Mean and variance of electrons: μ, and μ plus the variances of reading and of rounding.
    #[test]
    fn noise_has_the_moments_of_its_model() {
        let sensor =
            Sensor { white: 2.0, full_well: 1000.0, read_noise: 5.0, bits: Some(12), ..Sensor::default() };
        let camera = Camera { sensor: Some(sensor.clone()), ..Camera::default() };
        for level in [0.1f32, 0.5, 1.5] {
            let seen = vec![Vec3::splat(level); 20_000];
            let mut moments = Moments::default();
            for value in &camera.bracket(&seen, 3)[0] {
                value.to_array().iter().for_each(|v| moments.push(f64::from(*v)));
            }
            let n = moments.count();
            let electrons = f64::from(level / sensor.white * sensor.full_well);
            let step = 1.0 / 4095.0;
            let variance = (electrons + 25.0) / 1e6 + step * step / 12.0;
            let mean_slack = 4.0 * (variance / n).sqrt();
            assert!((moments.mean() - electrons / 1e3).abs() < mean_slack, "{level}: {}", moments.mean());
            // The relative standard error of a variance is √(2/n).
            let ratio = moments.variance() / variance;
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{level}: {ratio}");
        }
    }

    #[test]
    fn a_bracket_reaches_farther_than_an_exposure() {
        let seen: Vec<Vec3> = [0.01f32, 0.9, 7.0, 30.0].map(Vec3::splat).to_vec();
        let sensor = Sensor { white: 1.0, seconds: vec![1.0, 0.125, 0.05], ..Sensor::default() };
        let camera = Camera { sensor: Some(sensor), ..Camera::default() };
        let bracket = camera.bracket(&seen, 0);
        assert_eq!(bracket[0][2], Vec3::ONE, "saturated");
        let developed = camera.develop(&bracket);
        for (got, want) in developed.iter().zip(&seen).take(3) {
            // Four standard deviations of 50 000 electrons at white and 3 of reading.
            let slack = 4.0 * (want.x / 5e4 * 20.0 + 1e-8).sqrt();
            assert!((*got - *want).abs().max_element() < slack, "{got} {want}");
        }
        assert!(developed[3].is_nan(), "saturated in all");
        // Without noise and steps nothing is lost.
        let clean = Sensor { full_well: f32::INFINITY, bits: None, white: 100.0, ..Sensor::default() };
        let camera = Camera { sensor: Some(clean), ..Camera::default() };
        let developed = camera.develop(&camera.bracket(&seen, 0));
        assert!(developed.iter().zip(&seen).all(|(a, b)| (*a - *b).length() < 1e-5 * b.length()));
    }

    #[test]
    fn the_lens_keeps_light_and_darkens_corners() {
        let mut picture = vec![Vec3::ZERO; 41 * 31];
        picture[15 * 41 + 20] = Vec3::ONE;
        let camera = Camera { blur: 1.5, ..Camera::default() };
        let seen = camera.look(&picture, 41);
        let total: Vec3 = seen.iter().sum();
        assert!((total - Vec3::ONE).length() < 1e-5);
        let spread: f32 = seen.iter().enumerate().map(|(i, v)| v.x * ((i % 41) as f32 - 20.0).powi(2)).sum();
        // Sampling and cutting at 3σ change σ² = 2.25 by 3 %.
        assert!((spread / 2.25 - 1.0).abs() < 0.05, "{spread}");
        picture[0] = Vec3::NAN;
        assert!(camera.look(&picture, 41).iter().filter(|v| v.is_nan()).count() == 1);
        let camera = Camera { vignetting: 0.4, ..Camera::default() };
        let seen = camera.look(&vec![Vec3::ONE; 41 * 31], 41);
        assert!((seen[15 * 41 + 20].x - 1.0).abs() < 1e-3 && (seen[0].x - 0.6).abs() < 0.03);
    }

    #[test]
    fn same_seed_same_stack() {
        let btf =
            cloth(40, 30, |x, y| texel(Vec3::new(0.01 * x as f32, 0.01 * y as f32, 1.0), 0.1 * x as f32));
        let lights = Lights::Distant(fibonacci_dome(5, 1.0));
        let camera =
            |seed| Camera { blur: 0.8, vignetting: 0.1, sensor: Some(Sensor { seed, ..Sensor::default() }) };
        let subject = Subject::new(&btf, None, Choice(0.0)).unwrap();
        let take = |seed| subject.photograph(&lights, Vec3::Z, &camera(seed));
        let first = take(1);
        assert_eq!(first.values.len(), 40 * 30 * 5);
        assert!(first == take(1) && first != take(2));
        // Row by row on one thread gives the same as all rows on all cores.
        let mut slow = vec![Vec3::ZERO; 40 * 30];
        for (i, value) in slow.iter_mut().enumerate() {
            let Lights::Distant(toward) = &lights else { unreachable!() };
            *value = subject.radiance(i % 40, i / 40, toward[2], Vec3::Z);
        }
        assert_eq!(slow, subject.picture(&lights, 2, Vec3::Z));
    }
}
