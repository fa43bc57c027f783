//! Exposure brackets to linear light: the camera's response, the merge with its uncertainty, whether the camera
//! moved, and the colours of a colour chart.
//!
//! A *level* is what a pixel says as a fraction of full scale; its *light* is the exposure that caused it, 1 at full
//! scale; radiance is light per second.

use crate::rows::for_rows;
use glam::{DMat3, DVec3, Mat3, Vec2};
use yugen_optics::colour::srgb_to_linear;

/// How levels follow light.
#[derive(Clone, Debug, PartialEq)]
pub enum Response {
    /// In proportion.
    Linear,
    /// The display curve of sRGB.
    Srgb,
    /// The level to this power.
    Power(f32),
    /// Light (red, green, blue) at evenly spaced levels, the first at 0 and the last at 1; rising.
    Table(Vec<[f32; 3]>),
}

impl Response {
    /// Checks a table: two entries or more, finite, never falling, above zero in the end.
    pub fn table(levels: Vec<[f32; 3]>) -> Result<Self, String> {
        if levels.len() < 2 {
            return Err(format!("a response needs two levels or more, found {}", levels.len()));
        }
        for c in 0..3 {
            if levels.iter().any(|l| !l[c].is_finite() || l[c] < 0.0) {
                return Err("a response has finite light, zero or more".into());
            }
            if let Some(i) = levels.windows(2).position(|l| l[1][c] < l[0][c]) {
                return Err(format!(
                    "the light of channel {c} falls after entry {}; it must rise with the level",
                    i + 1
                ));
            }
            if levels[levels.len() - 1][c] <= 0.0 {
                return Err(format!("the light of channel {c} is zero at every level"));
            }
        }
        Ok(Self::Table(levels))
    }

    /// Light for a level of channel `c`; levels may lie a little outside [0, 1].
    pub fn light(&self, c: usize, level: f32) -> f32 {
        match self {
            Self::Linear => level,
            Self::Srgb => srgb_to_linear(level.max(0.0)),
            Self::Power(exponent) => level.max(0.0).powf(*exponent),
            Self::Table(table) => {
                let (i, part) = place(level, table.len());
                table[i][c] + (table[i + 1][c] - table[i][c]) * part
            }
        }
    }

    /// How fast light grows with the level.
    pub fn slope(&self, c: usize, level: f32) -> f32 {
        const STEP: f32 = 1.0 / 512.0;
        match self {
            Self::Linear => 1.0,
            _ => {
                let (low, high) = ((level - STEP).max(0.0), (level + STEP).min(1.0));
                (self.light(c, high) - self.light(c, low)) / (high - low).max(STEP)
            }
        }
    }
}

/// The interval of a table of `n` even levels that holds `level`, and how far into it.
fn place(level: f32, n: usize) -> (usize, f32) {
    let at = level.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (at as usize).min(n - 2);
    (i, at - i as f32)
}

/// What a pixel was in one exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Red, green and blue.
    pub level: [f32; 3],
    /// Exposure time.
    pub seconds: f32,
}

/// Levels at which a response is recovered.
const NODES: usize = 256;
/// Weight of the smoothness against that of the data. Measured on three curves of known form, 1500 and 8000 pixels:
/// mean errors between 0.2 and 0.4 %; a third or three times as much adds up to half of that.
const SMOOTH: f64 = 200.0;
/// Levels nearer than this to the ends of the scale are left out: rounding and clipping choose which pixels get there.
const MARGIN: f64 = 5.0 / 255.0;

/// The response from pixels seen at several exposures: Debevec and Malik 1997, "Recovering High Dynamic Range Radiance
/// Maps from Photographs". The logarithm of light at each level is found by least squares together with the radiance
/// of every pixel, which is eliminated pixel by pixel, so that any number of them costs little. Levels between two
/// nodes count for both, so that 16 bits are as good as 8. Smooth is what bends little on logarithmic paper: the powers
/// that most cameras nearly follow are straight there. Light is 1 at full scale.
///
/// `None` where no pixel was seen unsaturated at two different times.
pub fn recover_response<'a>(pixels: impl Iterator<Item = &'a [Shot]> + Clone) -> Option<Response> {
    let _span = tracing::info_span!("recover_response").entered();
    let mut table = vec![[0.0f32; 3]; NODES];
    for c in 0..3 {
        let mut a = vec![0.0f64; NODES * NODES];
        let mut b = vec![0.0f64; NODES];
        let mut seen = false;
        let mut sum = [0.0f64; NODES];
        for shots in pixels.clone() {
            let (mut weights, mut times, mut count) = (0.0, 0.0, 0);
            sum.fill(0.0);
            for shot in shots {
                let level = shot.level[c];
                // The square of the authors' hat, as noise and rounding count more in a logarithm of the dark.
                let hat = f64::from(level.min(1.0 - level)) - MARGIN;
                if hat <= 0.0 {
                    continue;
                }
                let w = hat * hat;
                let (i, part) = place(level, NODES);
                let basis = [(i, 1.0 - f64::from(part)), (i + 1, f64::from(part))];
                let t = f64::from(shot.seconds).ln();
                for (m, u) in basis {
                    for (n, v) in basis {
                        a[m * NODES + n] += w * u * v;
                    }
                    b[m] += w * u * t;
                    sum[m] += w * u;
                }
                weights += w;
                times += w * t;
                count += 1;
            }
            if count == 0 {
                continue;
            }
            seen |= count > 1 && shots.iter().any(|s| (s.seconds / shots[0].seconds - 1.0).abs() > 0.01);
            let filled: Vec<usize> = (0..NODES).filter(|&m| sum[m] > 0.0).collect();
            for &m in &filled {
                for &n in &filled {
                    a[m * NODES + n] -= sum[m] * sum[n] / weights;
                }
                b[m] -= sum[m] * times / weights;
            }
        }
        if !seen {
            return None;
        }
        let scale = (0..NODES).map(|m| a[m * NODES + m]).sum::<f64>() / NODES as f64;
        for m in 1..NODES - 1 {
            // d²g/d(ln z)² = z² (g'' + g'/z), of which z² goes into the weight.
            let z = m as f64 / (NODES - 1) as f64;
            let weight = SMOOTH * scale * NODES as f64 * z * z;
            let slope = 0.5 / m as f64;
            let basis = [(m - 1, 1.0 - slope), (m, -2.0), (m + 1, 1.0 + slope)];
            for (i, u) in basis {
                for (j, v) in basis {
                    a[i * NODES + j] += weight * u * v;
                }
            }
        }
        // Only differences are known so far.
        a[(NODES / 2) * (NODES + 1)] += scale;
        let g = solve(a, b)?;
        let last = g[NODES - 1];
        let mut light: Vec<f64> = g.iter().map(|v| (v - last).exp()).collect();
        // No logarithm reaches zero: go on straight to the darkest level.
        light[0] = (2.0 * light[1] - light[2]).max(0.0);
        for i in 1..NODES {
            light[i] = light[i].max(light[i - 1]);
        }
        for (row, v) in table.iter_mut().zip(light) {
            row[c] = v as f32;
        }
    }
    Response::table(table).ok()
}

/// Solves a symmetric positive definite system by Cholesky; `None` if it is not.
fn solve(mut a: Vec<f64>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for j in 0..n {
        for i in j..n {
            let (upper, lower) = (j * n, i * n);
            let dot: f64 = (0..j).map(|k| a[upper + k] * a[lower + k]).sum();
            let v = a[lower + j] - dot;
            if i == j {
                if v.is_nan() || v <= 0.0 {
                    return None;
                }
                a[j * n + j] = v.sqrt();
            } else {
                a[lower + j] = v / a[upper + j];
            }
        }
    }
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| a[i * n + k] * b[k]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| a[k * n + i] * b[k]).sum();
        b[i] = (b[i] - dot) / a[i * n + i];
    }
    Some(b)
}

/// What a sensor adds to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Electrons at full scale.
    pub full_well: f32,
    /// Standard deviation of reading, in electrons.
    pub read: f32,
    /// Difference of two neighbouring levels; 0 for floating-point pictures.
    pub step: f32,
    /// Levels from this one on are saturated.
    pub saturated: f32,
}

impl Noise {
    /// Variance of the light of a sample without its photons.
    fn floor(&self, slope: f32) -> f32 {
        let read = self.read / self.full_well;
        let step = self.step * slope;
        // Rounding is uniform over a step.
        read * read + step * step / 12.0
    }
}

/// The radiance of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Radiance {
    /// Light per second; NaN where every exposure is saturated.
    pub value: [f32; 3],
    /// Its standard deviation.
    pub sigma: [f32; 3],
    /// Squared differences between the exposures and the value over their variance, summed over the channels…
    pub chi_square: f32,
    /// …which should come to this number.
    pub freedom: u8,
    /// Whether every exposure says zero in every channel.
    pub black: bool,
}

/// What all pixels together say about a bracket.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Tally {
    /// Pixels.
    pub pixels: u64,
    /// Pixels saturated in every exposure.
    pub saturated: u64,
    /// Pixels black in every exposure.
    pub black: u64,
    /// Sum over pixels.
    pub chi_square: f64,
    /// Sum over pixels.
    pub freedom: u64,
}

impl Tally {
    /// Counts pixels in.
    pub fn add(&mut self, pixels: &[Radiance]) {
        for p in pixels {
            self.pixels += 1;
            self.saturated += u64::from(p.value[0].is_nan());
            self.black += u64::from(p.black);
            self.chi_square += f64::from(p.chi_square);
            self.freedom += u64::from(p.freedom);
        }
    }
}

/// Exposures of one view under one light.
#[derive(Clone, Copy, Debug)]
pub struct Bracket<'a> {
    /// Exposure times.
    pub seconds: &'a [f32],
    /// Of the camera.
    pub response: &'a Response,
    /// Of the camera.
    pub noise: Noise,
}

/// Times the weights are computed anew; the third changes nothing that a float shows.
const ROUNDS: usize = 3;

impl Bracket<'_> {
    /// Radiance of each pixel from its levels in each exposure, after Granados et al. 2010, "Optimal HDR
    /// Reconstruction with Linear Digital Cameras": weights are inverse variances (photons, reading, rounding), taken
    /// at the *estimate*, not at the sample, for a sample that chose its own weight would pull the mean to its side.
    /// For the same reason the estimate decides which exposures are drowned in the floor, and the shorter exposures
    /// which are too near to saturation.
    ///
    /// `darks` holds the light of each exposure's dark frame, if there is one; it is taken as exact.
    ///
    /// # Panics
    /// If there are not as many pictures as times, or pictures of different sizes.
    pub fn merge(
        &self,
        width: usize,
        levels: &[Vec<[f32; 3]>],
        darks: &[Option<Vec<[f32; 3]>>],
    ) -> Vec<Radiance> {
        assert!(levels.len() == self.seconds.len() && darks.len() == levels.len(), "one picture a time");
        let mut pixels = vec![Radiance::default(); levels.first().map_or(0, Vec::len)];
        assert!(levels.iter().chain(darks.iter().flatten()).all(|p| p.len() == pixels.len()), "one size");
        let mut order: Vec<usize> = (0..levels.len()).collect();
        order.sort_by(|&a, &b| self.seconds[a].total_cmp(&self.seconds[b]));
        for_rows(&mut pixels, width, |y, row| {
            let mut samples = vec![Sample::default(); self.seconds.len()];
            for (x, pixel) in row.iter_mut().enumerate() {
                let at = y * width + x;
                pixel.black = levels.iter().all(|picture| picture[at] == [0.0; 3]);
                for c in 0..3 {
                    for (sample, &i) in samples.iter_mut().zip(&order) {
                        let dark = darks[i].as_ref().map_or(0.0, |d| d[at][c]);
                        *sample = self.sample(c, levels[i][at][c], dark, self.seconds[i]);
                    }
                    self.estimate(c, &mut samples, pixel);
                }
                // A colour with a hole is no colour.
                if pixel.value.iter().any(|v| v.is_nan()) {
                    *pixel = Radiance { value: [f32::NAN; 3], sigma: [f32::NAN; 3], ..Radiance::default() };
                }
            }
        });
        pixels
    }

    fn sample(&self, c: usize, level: f32, dark: f32, seconds: f32) -> Sample {
        Sample {
            light: self.response.light(c, level) - dark,
            seconds,
            floor: self.noise.floor(self.response.slope(c, level)),
            open: level < self.noise.saturated,
            dark,
        }
    }

    /// The samples come with rising times.
    fn estimate(&self, c: usize, samples: &mut [Sample], pixel: &mut Radiance) {
        let full = self.response.light(c, self.noise.saturated.min(1.0));
        let variance = |s: &Sample, light: f32| (light.max(0.0) + s.dark) / self.noise.full_well + s.floor;
        // An exposure that the shorter ones expect near saturation lost its brightest pixels there.
        let (mut sum, mut total) = (0.0, 0.0);
        for s in samples.iter_mut().filter(|s| s.open) {
            if sum > 0.0 {
                let expected = total / sum * s.seconds;
                let spread = variance(s, expected) + s.seconds * s.seconds / sum;
                s.open = expected + s.dark + 3.0 * spread.sqrt() < full;
            }
            if s.open {
                let w = s.seconds * s.seconds / variance(s, s.light).max(f32::MIN_POSITIVE);
                sum += w;
                total += w * (s.light / s.seconds);
            }
        }
        let open = || samples.iter().filter(|s| s.open);
        let time: f32 = open().map(|s| s.seconds).sum();
        if time <= 0.0 {
            pixel.value[c] = f32::NAN;
            return;
        }
        let longest = open().map(|s| s.seconds).fold(0.0, f32::max);
        let mut value = open().map(|s| s.light).sum::<f32>() / time;
        let mut weights = 0.0f32;
        let used = |s: &Sample, value: f32| -> Option<f32> {
            if !s.open {
                return None;
            }
            let expected = (value * s.seconds).max(0.0);
            let drowned = expected * expected < 4.0 * s.floor && s.seconds < longest;
            (!drowned).then(|| s.seconds * s.seconds / variance(s, expected).max(f32::MIN_POSITIVE))
        };
        for _ in 0..ROUNDS {
            let (mut sum, mut total) = (0.0, 0.0);
            for s in samples.iter() {
                if let Some(w) = used(s, value) {
                    sum += w;
                    total += w * (s.light / s.seconds);
                }
            }
            (value, weights) = (total / sum, sum);
        }
        pixel.value[c] = value;
        pixel.sigma[c] = 1.0 / weights.sqrt();
        let mut count = 0;
        for s in samples.iter() {
            if let Some(w) = used(s, value) {
                let off = s.light / s.seconds - value;
                pixel.chi_square += w * off * off;
                count += 1;
            }
        }
        pixel.freedom += u8::try_from(count).unwrap_or(u8::MAX / 3).saturating_sub(1);
    }
}

#[derive(Clone, Copy, Default)]
struct Sample {
    light: f32,
    seconds: f32,
    floor: f32,
    open: bool,
    dark: f32,
}

/// How far the second picture is moved against the first, in pixels (+x right, +y down): Lucas and Kanade 1981, from
/// coarse to fine. NaN marks pixels that are not to be used. Finds shifts up to about a sixteenth of the picture;
/// `None` where there is too little to hold on to. The brightness of one may be any rising function of that of the other,
/// as where the camera's response is not the one that was said.
pub fn shift(first: &[f32], second: &[f32], width: usize, height: usize) -> Option<Vec2> {
    // Something brighter on one side looks like something that moved, and the other way round. So a shift is believed that
    // shows however brightness is matched: not at all, as the pictures lie, and as they lie on each other.
    let plain = track(first, second.to_vec(), width, height, Vec2::ZERO);
    let as_they_lie = matched(first, second, width, height, Vec2::ZERO);
    let once = track(first, as_they_lie, width, height, Vec2::ZERO);
    // Where brightness differs too much to hold on to one of them, the other says it.
    let least = [plain, once].into_iter().flatten().min_by(|a, b| a.length().total_cmp(&b.length()))?;
    if least.length() < MOVED {
        return Some(least);
    }
    let mut moved = once.unwrap_or_default();
    // Each round leaves some half of what was wrong.
    for _ in 0..ROUNDS_OF_SHIFT {
        let before = moved;
        moved = track(first, matched(first, second, width, height, moved), width, height, moved)?;
        if moved.distance(before) < 0.02 {
            break;
        }
    }
    Some(moved)
}

/// Exposures that are shifted by more pixels than this have moved; less is the error of finding it.
pub const MOVED: f32 = 0.5;
/// Times that brightness and shift are found anew at most.
const ROUNDS_OF_SHIFT: usize = 16;

/// The shift between pictures of one brightness, near to where it is thought to be.
fn track(first: &[f32], second: Vec<f32>, width: usize, height: usize, near: Vec2) -> Option<Vec2> {
    // Down to some 16 pixels.
    let mut pyramid = vec![(first.to_vec(), second, width, height)];
    while let Some((a, b, w, h)) = pyramid.last().filter(|l| l.2.min(l.3) >= 32) {
        let smaller = (halve(a, *w, *h), halve(b, *w, *h), w / 2, h / 2);
        pyramid.push(smaller);
    }
    let mut moved = near / (1 << pyramid.len()) as f32;
    for (a, b, w, h) in pyramid.iter().rev() {
        moved *= 2.0;
        for _ in 0..8 {
            let step = lucas_kanade(a, b, *w, *h, moved)?;
            moved += step;
            if step.length() < 1e-3 {
                break;
            }
        }
        if moved.abs().max_element() > 0.25 * (*w).max(*h) as f32 {
            return None;
        }
    }
    Some(moved)
}

/// Knots of the function that takes the brightness of one picture to that of another.
const KNOTS: usize = 64;

/// The second picture with the histogram of the first, taken where both have a value if it is moved so far.
fn matched(first: &[f32], second: &[f32], width: usize, height: usize, moved: Vec2) -> Vec<f32> {
    let there = |i: usize| {
        let (x, y) = ((i % width) as f32 + moved.x, (i / width) as f32 + moved.y);
        (first[i], sample(second, width, height, x, y))
    };
    let both = (0..first.len()).map(there).filter(|(a, b)| a.is_finite() && b.is_finite());
    let (mut to, mut from): (Vec<f32>, Vec<f32>) = both.unzip();
    if from.len() < 4 * KNOTS {
        return second.to_vec();
    }
    to.sort_unstable_by(f32::total_cmp);
    from.sort_unstable_by(f32::total_cmp);
    let at = |k: usize| k * (from.len() - 1) / KNOTS;
    let all: Vec<[f32; 2]> = (0..=KNOTS).map(|k| [from[at(k)], to[at(k)]]).collect();
    // Pictures of whole numbers have many pixels of one value: it goes to the middle of what they have in the first.
    let knots: Vec<[f32; 2]> = all
        .chunk_by(|a, b| a[0] == b[0])
        .map(|same| [same[0][0], same.iter().map(|k| k[1]).sum::<f32>() / same.len() as f32])
        .collect();
    let value = |v: f32| {
        let next = knots.partition_point(|k| k[0] <= v);
        match (next.checked_sub(1).map(|i| knots[i]), knots.get(next)) {
            (Some(low), Some(high)) => low[1] + (high[1] - low[1]) * (v - low[0]) / (high[0] - low[0]),
            (Some(end), None) => end[1],
            (None, _) => knots[0][1],
        }
    };
    second.iter().map(|v| if v.is_finite() { value(*v) } else { f32::NAN }).collect()
}

fn halve(picture: &[f32], width: usize, height: usize) -> Vec<f32> {
    let (w, h) = (width / 2, height / 2);
    let at = |x: usize, y: usize| picture[y * width + x];
    (0..w * h)
        .map(|i| {
            let (x, y) = (2 * (i % w), 2 * (i / w));
            0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
        })
        .collect()
}

/// Between pixels linearly; NaN outside and next to one.
fn sample(picture: &[f32], width: usize, height: usize, x: f32, y: f32) -> f32 {
    let (i, j) = (x.floor(), y.floor());
    if i < 0.0 || j < 0.0 || i as usize + 1 >= width || j as usize + 1 >= height {
        return f32::NAN;
    }
    let (u, v) = (x - i, y - j);
    let at = j as usize * width + i as usize;
    let top = picture[at] * (1.0 - u) + picture[at + 1] * u;
    let bottom = picture[at + width] * (1.0 - u) + picture[at + width + 1] * u;
    top * (1.0 - v) + bottom * v
}

fn lucas_kanade(a: &[f32], b: &[f32], width: usize, height: usize, moved: Vec2) -> Option<Vec2> {
    let (mut xx, mut xy, mut yy, mut bx, mut by) = (0.0f64, 0.0, 0.0, 0.0, 0.0);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width - 1 {
            let at = y * width + x;
            let gx = 0.5 * (a[at + 1] - a[at - 1]);
            let gy = 0.5 * (a[at + width] - a[at - width]);
            let off = a[at] - sample(b, width, height, x as f32 + moved.x, y as f32 + moved.y);
            if !(gx + gy + off).is_finite() {
                continue;
            }
            // Relative to what is there, so that a few highlights do not decide alone.
            let w = 1.0 / f64::from(a[at].abs() + 1e-3).powi(2);
            let (gx, gy, off) = (f64::from(gx), f64::from(gy), f64::from(off));
            xx += w * gx * gx;
            xy += w * gx * gy;
            yy += w * gy * gy;
            bx += w * gx * off;
            by += w * gy * off;
        }
    }
    let determinant = xx * yy - xy * xy;
    if determinant.is_nan() || determinant <= 1e-6 * (xx + yy).powi(2) {
        return None;
    }
    let step =
        Vec2::new(((yy * bx - xy * by) / determinant) as f32, ((xx * by - xy * bx) / determinant) as f32);
    Some(step.clamp(Vec2::splat(-1.0), Vec2::splat(1.0)))
}

/// The matrix that takes measured to known colours with the least squared error, and that error: root mean square over
/// that of the known colours. `None` where the measured colours do not span three dimensions.
pub fn colour_matrix(measured: &[[f32; 3]], known: &[[f32; 3]]) -> Option<(Mat3, f32)> {
    let (mut normal, mut mixed) = (DMat3::ZERO, DMat3::ZERO);
    let double = |v: &[f32; 3]| DVec3::from_array(v.map(f64::from));
    for (m, k) in measured.iter().zip(known) {
        let (m, k) = (double(m), double(k));
        normal += DMat3::from_cols(m * m.x, m * m.y, m * m.z);
        mixed += DMat3::from_cols(k * m.x, k * m.y, k * m.z);
    }
    let size = normal.x_axis.x + normal.y_axis.y + normal.z_axis.z;
    if normal.determinant().is_nan() || normal.determinant() <= 1e-9 * (size / 3.0).powi(3) {
        return None;
    }
    let matrix = mixed * normal.inverse();
    let (mut off, mut all) = (0.0, 0.0);
    for (m, k) in measured.iter().zip(known) {
        off += (matrix * double(m) - double(k)).length_squared();
        all += double(k).length_squared();
    }
    Some((matrix.as_mat3(), (off / all).sqrt() as f32))
}

#[cfg(test)]
mod tests;
