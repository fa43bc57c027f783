//! The picture while it is being made: tiles of weighted sums, developed into an image.
//!
//! Every tile owns the sums of all its samples, the border its filter reaches into included, so that no two
//! threads ever write to the same place and the picture is the same for any number of them: a pixel is
//! the sum over the tiles that reach it, in tile order.

use crate::guide::Guide;
use glam::Vec3;
use yugen_optics::Image;
use yugen_optics::denoise::{Halves, PixelFilter, VALUES};
use yugen_scene::{Film, Filter};

/// A filter as a table over [0, radius], fine enough that the step is below 1/1000 of the peak.
#[derive(Clone, Debug)]
pub struct FilterTable {
    values: Vec<f32>,
    scale: f32,
    radius: f32,
    is_box: bool,
}

impl FilterTable {
    const RESOLUTION: usize = 1024;

    /// Tabulates `filter`.
    pub fn new(filter: Filter) -> Self {
        let radius = filter.radius();
        let n = Self::RESOLUTION;
        let values = (0..=n).map(|i| filter.value(radius * (i as f32 + 0.5) / n as f32)).collect();
        Self { values, scale: n as f32 / radius, radius, is_box: filter == Filter::Box }
    }

    fn at(&self, x: f32) -> f32 {
        self.values[((x.abs() * self.scale) as usize).min(Self::RESOLUTION)]
    }

    /// Pixels beyond its own that a sample can reach.
    pub fn border(&self) -> u32 {
        (self.radius - 0.5).ceil().max(0.0) as u32
    }
}

/// Pixels across and down of a tile of a picture of so many pixels. A tile gets samples as one under an error target,
/// so it should not be much larger than what is equally noisy; but its border takes memory, and what a picture shows
/// grows with it.
fn tile_size(pixels: u64) -> u32 {
    if pixels <= 1 << 20 { 4 } else { 8 }
}

/// One tile's sums.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Top left pixel of the tile itself.
    pub origin: [u32; 2],
    /// Its width and height in pixels.
    pub size: [u32; 2],
    /// Samples per pixel taken so far.
    pub samples: u32,
    /// Samples per pixel that it shall have at the end of this round.
    pub goal: u32,
    /// Light that came by ends of paths that neighbouring pixels have shared: the sum over samples and colours.
    pub shared: f64,
    /// Light that was clamped away: the sum over samples and colours.
    pub clamped: f64,
    /// Samples thrown away because they were not finite or negative beyond rounding.
    pub rejected: u64,
    /// (size + 2·border)² pixels of `channels` sums, then the sum of weights.
    pub sums: Vec<f64>,
    /// Per pixel of the tile itself: mean and sum of squared deviations of luminance-like RGB (Welford), and
    /// the number of samples that went in.
    pub moments: Vec<[f32; 7]>,
    /// Per pixel of the tile itself, where the picture is to be denoised.
    pub guides: Vec<Guide>,
    /// The tile before its last visit, where that was a shorter one than usual for want of more samples to take: from
    /// here on it is as if it had not been, should more be asked for.
    pub before: Option<Box<Tile>>,
}

impl Tile {
    /// The tile from which more samples go on, which differs from this one where the last visit was a short one.
    pub fn to_go_on(&self) -> &Self {
        self.before.as_deref().unwrap_or(self)
    }

    /// Keeps the tile as it is now, before a shorter visit.
    pub(crate) fn keep(&mut self) {
        let blank = self.samples == 0;
        self.before = Some(Box::new(Self {
            sums: if blank { Vec::new() } else { self.sums.clone() },
            moments: if blank { Vec::new() } else { self.moments.clone() },
            guides: if blank { Vec::new() } else { self.guides.clone() },
            before: None,
            ..*self
        }));
    }
}

/// The samples of one visit to a tile, in single precision: few enough that nothing is lost.
#[derive(Debug)]
pub struct Visit {
    /// Row after row, in a row channel after channel: the pixels that a sample reaches lie side by side.
    sums: Vec<f32>,
    width: usize,
    height: usize,
    /// Pixels of a row, with room for the filter's vector to hang over.
    pitch: usize,
    /// Channels and the sum of weights.
    channels: usize,
    /// Of every pixel of the tile itself.
    pixels: Vec<PixelSums>,
}

/// What the samples of one visit to one pixel add up to.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    count: f32,
    /// The first sample, from which the others are counted: no cancellation where they are alike.
    first: Vec3,
    sum: Vec3,
    squares: Vec3,
}

impl PixelSums {
    #[inline]
    fn add(&mut self, rgb: Vec3) {
        if self.count == 0.0 {
            self.first = rgb;
        }
        let d = rgb - self.first;
        self.count += 1.0;
        self.sum += d;
        self.squares += d * d;
    }

    /// Merged with what earlier visits found. Chan, Golub and LeVeque 1979, "Updating Formulae and a Pairwise
    /// Algorithm for Computing Sample Variances".
    fn merge(&self, m: &mut [f32; 7]) {
        let (n, new) = (m[6], self.count);
        if new == 0.0 {
            return;
        }
        for c in 0..3 {
            let mean = self.first[c] + self.sum[c] / new;
            let squared = (self.squares[c] - self.sum[c] * self.sum[c] / new).max(0.0);
            let delta = mean - m[c];
            m[c] += delta * (new / (n + new));
            m[3 + c] += squared + delta * delta * (n * new / (n + new));
        }
        m[6] = n + new;
    }
}

impl Visit {
    /// A sample's `values` into the row of pixels from (x, y) on, eight pixels at a time, by the weights across.
    #[inline]
    fn splat_row(&mut self, x: usize, y: usize, across: &[f32; 8], weight: f32, values: &[f32]) {
        debug_assert!(x + 8 <= self.pitch && y < self.height);
        let row = y * self.channels * self.pitch + x;
        let weights = across.map(|w| w * weight);
        let mut splat = |c: usize, value: f32| {
            let at = row + c * self.pitch;
            if let Some(to) = self.sums[at..].first_chunk_mut::<8>() {
                for i in 0..8 {
                    to[i] += value * weights[i];
                }
            }
        };
        for (c, value) in values.iter().enumerate() {
            splat(c, *value);
        }
        splat(values.len(), 1.0);
    }
}

/// The layout all tiles share.
#[derive(Clone, Debug)]
pub struct FilmLayout {
    /// Size, crop and filter.
    pub film: Film,
    /// x, y, width, height of what is rendered.
    pub window: [u32; 4],
    /// Names of the accumulated channels: R, G, B, A and the AOVs.
    pub channels: Vec<String>,
    filter: FilterTable,
    /// Whether a denoiser's guides are kept.
    guided: bool,
}

impl FilmLayout {
    /// For `film`, accumulating `channels`.
    pub fn new(film: &Film, channels: Vec<String>) -> Self {
        let window = film.crop.unwrap_or([0, 0, film.width, film.height]);
        Self { film: film.clone(), window, channels, filter: FilterTable::new(film.filter), guided: false }
    }

    /// With guides for a denoiser.
    pub fn guided(self) -> Self {
        Self { guided: true, ..self }
    }

    /// What its filter does to pixels that are means of their own samples.
    pub fn pixel_filter(&self) -> PixelFilter {
        let filter = self.film.filter;
        PixelFilter::new(filter.radius(), |x| filter.value(x))
    }

    /// Tiles in rows, all empty.
    pub fn tiles(&self) -> Vec<Tile> {
        let [x0, y0, w, h] = self.window;
        let border = self.filter.border();
        let mut tiles = Vec::new();
        let side = tile_size(u64::from(w) * u64::from(h));
        for y in (0..h).step_by(side as usize) {
            for x in (0..w).step_by(side as usize) {
                let size = [side.min(w - x), side.min(h - y)];
                let padded = ((size[0] + 2 * border) * (size[1] + 2 * border)) as usize;
                tiles.push(Tile {
                    origin: [x0 + x, y0 + y],
                    size,
                    samples: 0,
                    goal: 0,
                    shared: 0.0,
                    clamped: 0.0,
                    rejected: 0,
                    sums: vec![0.0; padded * (self.channels.len() + 1)],
                    moments: vec![[0.0; 7]; (size[0] * size[1]) as usize],
                    before: None,
                    guides: if self.guided {
                        vec![Guide::default(); (size[0] * size[1]) as usize]
                    } else {
                        Vec::new()
                    },
                });
            }
        }
        tiles
    }

    /// Room for the samples of one visit to `tile`; [`FilmLayout::flush`] adds it to the tile's sums.
    pub fn visit(&self, tile: &Tile) -> Visit {
        let border = self.filter.border();
        let width = (tile.size[0] + 2 * border) as usize;
        let height = (tile.size[1] + 2 * border) as usize;
        let reach = (2.0 * self.filter.radius).ceil() as usize + 1;
        let pitch = width + reach.next_multiple_of(8);
        let channels = self.channels.len() + 1;
        Visit {
            sums: vec![0.0; pitch * height * channels],
            width,
            height,
            pitch,
            channels,
            pixels: vec![PixelSums::default(); tile.moments.len()],
        }
    }

    /// Adds a sample taken at `position` (pixel coordinates, pixel (x, y) covering [x, x+1)) inside pixel
    /// `pixel` of `tile`. `values` are the channels. A value that is not finite is counted and dropped: `false`.
    #[inline]
    pub fn add(
        &self,
        tile: &mut Tile,
        visit: &mut Visit,
        pixel: [u32; 2],
        position: [f32; 2],
        values: &[f32],
    ) -> bool {
        // A sum of finite numbers this side of overflow; one comparison instead of many.
        if !values.iter().fold(0.0, |sum, v| sum + v.abs()).is_finite() {
            tile.rejected += 1;
            return false;
        }
        let local = ((pixel[1] - tile.origin[1]) * tile.size[0] + (pixel[0] - tile.origin[0])) as usize;
        visit.pixels[local].add(Vec3::new(values[0], values[1], values[2]));
        let border = self.filter.border();
        // Pixel (0, 0) of the padded tile.
        let (left, top) = (tile.origin[0] as i32 - border as i32, tile.origin[1] as i32 - border as i32);
        if self.filter.is_box {
            let (x, y) = ((pixel[0] as i32 - left) as usize, (pixel[1] as i32 - top) as usize);
            let at = y * visit.channels * visit.pitch + x;
            for (c, value) in values.iter().chain(&[1.0]).enumerate() {
                visit.sums[at + c * visit.pitch] += value;
            }
            return true;
        }
        let [x, y] = [position[0] - left as f32, position[1] - top as f32];
        let r = self.filter.radius;
        // Pixel centres within the radius, inside the padded tile. Truncation is rounding down: both are positive
        // but for a rounding error.
        let first = |v: f32| (v - r + 0.5).max(0.0) as usize;
        let last = |v: f32, size: usize| ((v + r + 0.5).max(0.0) as usize).min(size);
        let (x0, x1) = (first(x), last(x, visit.width));
        let (y0, y1) = (first(y), last(y, visit.height));
        for from in (x0..x1).step_by(8) {
            let mut across = [0.0; 8];
            for (w, px) in across.iter_mut().zip(from..x1) {
                *w = self.filter.at(px as f32 + 0.5 - x);
            }
            for py in y0..y1 {
                let wy = self.filter.at(py as f32 + 0.5 - y);
                visit.splat_row(from, py, &across, wy, values);
            }
        }
        true
    }

    /// Adds what a sample of pixel `pixel` says to a half of its guide.
    #[inline]
    pub fn guide(&self, tile: &mut Tile, pixel: [u32; 2], half: usize, values: &[f32; VALUES]) {
        let local = (pixel[1] - tile.origin[1]) * tile.size[0] + (pixel[0] - tile.origin[0]);
        tile.guides[local as usize].add(half, values);
    }

    /// Adds what a visit gathered to the tile.
    pub fn flush(&self, tile: &mut Tile, visit: &Visit) {
        for (to, from) in tile.moments.iter_mut().zip(&visit.pixels) {
            from.merge(to);
        }
        let n = self.channels.len() + 1;
        for (i, to) in tile.sums.chunks_exact_mut(n).enumerate() {
            let from = i / visit.width * n * visit.pitch + i % visit.width;
            for (c, to) in to.iter_mut().enumerate() {
                *to += f64::from(visit.sums[from + c * visit.pitch]);
            }
        }
    }

    /// The picture: weighted means of the window, plus `variance.R/G/B` (of the mean of a pixel's own samples,
    /// before filtering) and `samples.Y` where `variance` is set.
    pub fn develop(&self, tiles: &[Tile], variance: bool) -> Image {
        let [wx, wy, w, h] = self.window;
        let mut names: Vec<&str> = self.channels.iter().map(String::as_str).collect();
        if variance {
            names.extend(["variance.R", "variance.G", "variance.B", "samples.Y"]);
        }
        let mut image = Image::new(w as usize, h as usize, &names);
        let n = self.channels.len() + 1;
        let border = self.filter.border() as i64;
        let mut sums = vec![0.0f64; (w * h) as usize * n];
        for tile in tiles {
            // Tiles need not have as many samples as their neighbours, and shall not weigh more for it.
            let share = 1.0 / f64::from(tile.samples.max(1));
            let stride = tile.size[0] as usize + 2 * border as usize;
            let rows = tile.size[1] as usize + 2 * border as usize;
            for py in 0..rows {
                let y = i64::from(tile.origin[1] - wy) + py as i64 - border;
                if y < 0 || y >= i64::from(h) {
                    continue;
                }
                for px in 0..stride {
                    let x = i64::from(tile.origin[0] - wx) + px as i64 - border;
                    if x < 0 || x >= i64::from(w) {
                        continue;
                    }
                    let from = (py * stride + px) * n;
                    let to = (y as usize * w as usize + x as usize) * n;
                    for c in 0..n {
                        sums[to + c] += share * tile.sums[from + c];
                    }
                }
            }
        }
        let width = names.len();
        for (pixel, sum) in image.data.chunks_exact_mut(width).zip(sums.chunks_exact(n)) {
            let weight = sum[n - 1];
            if weight.abs() > 1e-12 {
                for c in 0..n - 1 {
                    pixel[c] = (sum[c] / weight) as f32;
                }
            }
        }
        if variance {
            for tile in tiles {
                for y in 0..tile.size[1] {
                    for x in 0..tile.size[0] {
                        let m = tile.moments[(y * tile.size[0] + x) as usize];
                        let o = image
                            .offset((tile.origin[0] - wx + x) as usize, (tile.origin[1] - wy + y) as usize);
                        for c in 0..3 {
                            image.data[o + n - 1 + c] =
                                if m[6] > 1.0 { m[3 + c] / (m[6] - 1.0) / m[6] } else { 0.0 };
                        }
                        image.data[o + n + 2] = m[6];
                    }
                }
            }
        }
        image
    }

    /// The guides of all tiles as planes of the window.
    pub fn halves(&self, tiles: &[Tile]) -> Halves {
        let [wx, wy, w, h] = self.window;
        let mut out = Halves::new(w as usize, h as usize);
        for tile in tiles {
            for (i, (guide, m)) in tile.guides.iter().zip(&tile.moments).enumerate() {
                let (x, y) = (i as u32 % tile.size[0], i as u32 / tile.size[0]);
                guide.put(
                    &mut out,
                    (tile.origin[0] - wx + x) as usize,
                    (tile.origin[1] - wy + y) as usize,
                    m,
                );
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: [Filter; 6] = [
        Filter::Box,
        Filter::Tent { radius: 1.0 },
        Filter::Gaussian { stddev: 0.5 },
        Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        Filter::CatmullRom,
        Filter::Lanczos { lobes: 3.0 },
    ];

    #[test]
    fn a_constant_picture_stays_constant_under_every_filter() {
        for filter in FILTERS {
            let film = Film { width: 70, height: 40, crop: Some([3, 5, 45, 33]), filter };
            let layout = FilmLayout::new(&film, vec!["R".into(), "G".into(), "B".into()]);
            let mut tiles = layout.tiles();
            assert_eq!(tiles.len(), 12 * 9);
            for tile in &mut tiles {
                let mut visit = layout.visit(tile);
                for y in 0..tile.size[1] {
                    for x in 0..tile.size[0] {
                        for k in 0..16 {
                            let p = [tile.origin[0] + x, tile.origin[1] + y];
                            let at = [
                                p[0] as f32 + (k % 4) as f32 / 4.0 + 0.1,
                                p[1] as f32 + (k / 4) as f32 / 4.0 + 0.1,
                            ];
                            layout.add(tile, &mut visit, p, at, &[2.0, 3.0, 4.0]);
                        }
                    }
                }
                layout.flush(tile, &visit);
            }
            let image = layout.develop(&tiles, true);
            assert_eq!((image.width, image.height), (45, 33));
            for p in image.data.chunks_exact(7) {
                assert!((p[0] - 2.0).abs() < 1e-5 && (p[2] - 4.0).abs() < 1e-5, "{filter:?} {p:?}");
                assert!(p[3] < 1e-10 && p[6] == 16.0);
            }
        }
    }

    #[test]
    fn unusable_values_are_counted_and_never_written() {
        let layout = FilmLayout::new(
            &Film { width: 4, height: 4, ..Film::default() },
            vec!["R".into(), "G".into(), "B".into()],
        );
        let mut tiles = layout.tiles();
        let mut visit = layout.visit(&tiles[0]);
        layout.add(&mut tiles[0], &mut visit, [1, 1], [1.5, 1.5], &[1.0, f32::NAN, 1.0]);
        layout.add(&mut tiles[0], &mut visit, [1, 1], [1.5, 1.5], &[f32::INFINITY, 0.0, 1.0]);
        layout.add(&mut tiles[0], &mut visit, [1, 1], [1.5, 1.5], &[1.0, 1.0, 1.0]);
        layout.flush(&mut tiles[0], &visit);
        assert_eq!(tiles[0].rejected, 2);
        assert!(layout.develop(&tiles, true).data.iter().all(|v| v.is_finite()));
    }
}
