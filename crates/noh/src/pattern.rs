//! What textures are made of: noise that tiles, and grids of texels baked into colour, roughness and normal maps.

use glam::{Mat3, Vec2, Vec3};
use std::sync::LazyLock;
use yugen_optics::Image;
use yugen_optics::random::{hash_combine, unit_f32};

/// A hash of a lattice point as a number in [0, 1).
pub fn lattice(x: i32, y: i32, seed: u32) -> f32 {
    unit_f32(hash_combine(hash_combine(x as u32, y as u32), seed))
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Unit vectors all around. A sine and a cosine at each corner took a quarter of the time in which a stage is painted.
static GRADIENTS: LazyLock<[Vec2; 1024]> =
    LazyLock::new(|| std::array::from_fn(|i| Vec2::from_angle(std::f32::consts::TAU * i as f32 / 1024.0)));

/// Gradient noise on a lattice that repeats after `period` cells; about ±0.7.
pub fn noise(p: Vec2, period: [i32; 2], seed: u32) -> f32 {
    let cell = p.floor();
    let t = p - cell;
    let corner = |i: i32, j: i32| {
        let x = (cell.x as i32 + i).rem_euclid(period[0]);
        let y = (cell.y as i32 + j).rem_euclid(period[1]);
        let gradient = GRADIENTS[(lattice(x, y, seed) * GRADIENTS.len() as f32) as usize];
        gradient.dot(t - Vec2::new(i as f32, j as f32))
    };
    let (u, v) = (fade(t.x), fade(t.y));
    let row = |j: i32| corner(0, j) + (corner(1, j) - corner(0, j)) * u;
    row(0) + (row(1) - row(0)) * v
}

/// Octaves of noise, each half as strong.
pub fn fbm(p: Vec2, period: [i32; 2], octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut scale, mut weight) = (0.0, 1.0, 1.0);
    for i in 0..octaves {
        let n = scale as i32;
        sum += weight * noise(p * scale, period.map(|p| p * n), seed + i);
        (scale, weight) = (2.0 * scale, 0.5 * weight);
    }
    sum
}

/// The nearest of jittered points, one a cell: its distance, its cell, and how much farther the second is.
pub fn nearest(p: Vec2, period: [i32; 2], jitter: f32, seed: u32) -> (f32, [i32; 2], f32) {
    let cell = p.floor();
    let (mut best, mut second, mut id) = (f32::MAX, f32::MAX, [0, 0]);
    for j in -2..=2 {
        for i in -2..=2 {
            let (x, y) = (cell.x as i32 + i, cell.y as i32 + j);
            let [wx, wy] = [x.rem_euclid(period[0]), y.rem_euclid(period[1])];
            let off = Vec2::new(lattice(wx, wy, seed), lattice(wx, wy, seed + 1)) - 0.5;
            let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) + jitter * off;
            let d = q.distance(p);
            if d < best {
                (second, best, id) = (best, d, [wx, wy]);
            } else if d < second {
                second = d;
            }
        }
    }
    (best, id, second - best)
}

/// An sRGB display colour as linear sRGB.
pub fn srgb(hex: u32) -> Vec3 {
    let [_, r, g, b] = hex.to_be_bytes().map(|v| yugen_optics::colour::srgb_to_linear(f32::from(v) / 255.0));
    Vec3::new(r, g, b)
}

/// A texel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Texel {
    /// Linear sRGB.
    pub colour: Vec3,
    /// Perceptual.
    pub roughness: f32,
    /// 0 or 1, or in between where rust covers iron.
    pub metallic: f32,
    /// Metres.
    pub height: f32,
}

/// Texels of a surface that tiles.
#[derive(Clone, Debug)]
pub struct Surface {
    pub width: usize,
    pub height: usize,
    /// Metres of the whole.
    pub size: Vec2,
    pub texels: Vec<Texel>,
}

impl Surface {
    /// Of so many texels over so many metres; the function gets the middle of each, in metres.
    pub fn bake(width: usize, height: usize, size: Vec2, f: impl Fn(Vec2) -> Texel) -> Self {
        let place = |i: usize| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let scale = size / Vec2::new(width as f32, height as f32);
        let texels = (0..width * height).map(|i| f(place(i) * scale)).collect();
        Self { width, height, size, texels }
    }

    /// With the mean of `k` by `k` texels for one; `k` divides both sides.
    pub fn reduced(&self, k: usize) -> Self {
        let (width, height) = (self.width / k, self.height / k);
        let mean = |i: usize| {
            let (x, y) = (i % width * k, i / width * k);
            let mut sum = Texel::default();
            let part = 1.0 / (k * k) as f32;
            for t in (0..k * k).map(|j| &self.texels[(y + j / k) * self.width + x + j % k]) {
                sum.colour += t.colour * part;
                sum.roughness += t.roughness * part;
                sum.metallic += t.metallic * part;
                sum.height += t.height * part;
            }
            sum
        };
        Self { width, height, size: self.size, texels: (0..width * height).map(mean).collect() }
    }

    /// Colours in a space, `to` being the way there from linear sRGB.
    pub fn albedo(&self, to: Mat3) -> Image {
        self.image(|t, _| (to * t.colour).clamp(Vec3::ZERO, Vec3::ONE))
    }

    /// Roughness in G and metal in B, as glTF has them; R is 1.
    pub fn roughness_metallic(&self) -> Image {
        self.image(|t, _| Vec3::new(1.0, t.roughness.clamp(0.0, 1.0), t.metallic.clamp(0.0, 1.0)))
    }

    /// Normals of the heights as colours, n = 2c − 1; x along growing u, y against growing v.
    pub fn normals(&self) -> Image {
        let (w, h) = (self.width, self.height);
        let step = self.size / Vec2::new(w as f32, h as f32);
        let at = |x: usize, y: usize| self.texels[(y % h) * w + x % w].height;
        self.image(|_, [x, y]| {
            let dx = (at(x + 1, y) - at(x + w - 1, y)) / (2.0 * step.x);
            let dy = (at(x, y + 1) - at(x, y + h - 1)) / (2.0 * step.y);
            0.5 * Vec3::new(-dx, dy, 1.0).normalize() + 0.5
        })
    }

    fn image(&self, f: impl Fn(&Texel, [usize; 2]) -> Vec3) -> Image {
        let mut image = Image::rgb(self.width, self.height);
        for (i, (pixel, texel)) in image.data.chunks_exact_mut(3).zip(&self.texels).enumerate() {
            pixel.copy_from_slice(&f(texel, [i % self.width, i / self.width]).to_array());
        }
        image
    }
}
