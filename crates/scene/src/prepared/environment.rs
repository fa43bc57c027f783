//! Light from infinity by a latitude-longitude picture, and where to look for it.
//!
//! A material finds evenly lit parts of the sky by itself. Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, "MIS
//! Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling": light samples are best spent on what
//! is brighter than that. What is left is weighed by the cosine at the surface that asks, for a set of orientations: a
//! table each over blocks of the picture, and one common table of the cells within a block.

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::sync::Arc;
use yugen_optics::Image;
use yugen_optics::distribution::ONE_MINUS_EPSILON;

/// Blocks across and down, at most.
pub(super) const BLOCKS: [usize; 2] = [32, 16];

/// A block is looked at in so many parts each way to see what is bright in it.
const PARTS: usize = 4;

/// Orientations: the corners of so many squares each way over an octahedron's map. An even number, so that the axes
/// are among them.
pub(super) const SQUARES: usize = 12;

/// Sine of half the angle between neighbouring orientations.
const OFF: f32 = 0.1;

/// Share of the light of a direction that is looked for however evenly lit the sky is.
const ALWAYS: f32 = 0.05;

/// An environment picture without pixels or colours.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the environment picture is {width}x{height} with {channels} channels; it needs at least 2x2 and R, G, B"
)]
pub struct BadEnvironment {
    /// Width.
    pub width: usize,
    /// Height.
    pub height: usize,
    /// Channels.
    pub channels: usize,
}

/// A latitude-longitude picture at infinity.
pub struct Environment {
    /// Scaled red, green and blue, and the probability in its block of the cell that begins here. Rows are one texel
    /// longer than the picture: the first again.
    pub(super) texels: Vec<Vec4>,
    /// Cells lie between texel centres: W × (H − 1) of them.
    pub(super) across: usize,
    pub(super) down: usize,
    pub(super) to_world: Mat3,
    pub(super) to_local: Mat3,
    pub(super) cells: Cells,
    /// One for each orientation, then one for surfaces that take light from all around.
    pub(super) views: Vec<View>,
}

/// What light samples are for, for one orientation of the surface that asks. They choose a block by its row, then a
/// cell in it in proportion to the light from there.
#[repr(align(64))]
pub(super) struct View {
    pub(super) rows: [Edge; BLOCKS[1]],
    /// Within their row.
    pub(super) columns: [[Edge; BLOCKS[0]]; BLOCKS[1]],
    /// Irradiance, roughly, that light samples have to find.
    pub(super) irradiance: f32,
}

/// Blocks of cells, and in each the probabilities of its cells.
pub(super) struct Cells {
    /// Cells of a block, across and down. Those beyond the picture's edge have no probability.
    pub(super) size: [usize; 2],
    /// Blocks.
    pub(super) count: [usize; 2],
    /// Block after block: its rows, then row after row its cells.
    pub(super) edges: Vec<Edge>,
}

/// Where in [0, 1) the part of an entry begins that is chosen by one of several, in units of 1/[`WHOLE`]. Half as much
/// to fetch as a float, and the probabilities read back are those that are drawn by, exactly.
pub(super) type Edge = u16;

/// Edges of entries that are never chosen.
const WHOLE: Edge = Edge::MAX;

impl Cells {
    /// Of `across` × `down` cells; without any light yet.
    fn new(across: usize, down: usize) -> Self {
        let size = [across.div_ceil(BLOCKS[0]), down.div_ceil(BLOCKS[1])];
        let count = [across.div_ceil(size[0]), down.div_ceil(size[1])];
        Self { size, count, edges: vec![WHOLE; count[0] * count[1] * size[1] * (1 + size[0])] }
    }

    /// Takes the `light` of the cells, rows of `across`; returns that of the blocks.
    fn fill(&mut self, light: &[f32], across: usize) -> Vec<f32> {
        let [w, h] = self.size;
        let mut of_block = Vec::with_capacity(self.count[0] * self.count[1]);
        for (block, edges) in self.edges.chunks_exact_mut(h * (1 + w)).enumerate() {
            let (x0, y0) = (block % self.count[0] * w, block / self.count[0] * h);
            let (rows, columns) = edges.split_at_mut(h);
            let cells = light.chunks_exact(across).skip(y0).map(|row| &row[x0..(x0 + w).min(across)]);
            let sums: Vec<f32> = cells
                .zip(columns.chunks_exact_mut(w))
                .map(|(cells, columns)| divide(cells, columns))
                .collect();
            of_block.push(divide(&sums, rows));
        }
        of_block
    }

    /// Edges of the rows of a block, and of the cells in one of them.
    fn edges(&self, block: usize, row: usize) -> (&[Edge], &[Edge]) {
        let [w, h] = self.size;
        let edges = &self.edges[block * h * (1 + w)..][..h * (1 + w)];
        (&edges[..h], &edges[h + row * w..][..w])
    }

    /// A place in a block, in cells of the picture, and the probability of the cell it is in.
    fn sample(&self, [x, y]: [usize; 2], u: Vec2) -> (Vec2, f32) {
        let block = y * self.count[0] + x;
        let (row, v) = choose(self.edges(block, 0).0, u.y);
        let (rows, columns) = self.edges(block, row);
        let (column, w) = choose(columns, u.x);
        let at = Vec2::new((x * self.size[0] + column) as f32 + w, (y * self.size[1] + row) as f32 + v);
        (at, width(rows, row) * width(columns, column))
    }

    /// The block that a cell is in.
    fn block(&self, [x, y]: [usize; 2]) -> [usize; 2] {
        [x / self.size[0], y / self.size[1]]
    }

    /// Probability of a cell within its block.
    fn probability(&self, cell: [usize; 2]) -> f32 {
        let [x, y] = self.block(cell);
        let (row, column) = (cell[1] % self.size[1], cell[0] % self.size[0]);
        let (rows, columns) = self.edges(y * self.count[0] + x, row);
        width(rows, row) * width(columns, column)
    }
}

impl View {
    /// From the weights of the blocks, rows of `across`, which are irradiances.
    fn new(weights: &[f32], across: usize) -> Self {
        let mut columns = [[WHOLE; BLOCKS[0]]; BLOCKS[1]];
        let sums: Vec<f32> =
            weights.chunks_exact(across).zip(&mut columns).map(|(row, edges)| divide(row, edges)).collect();
        let mut rows = [WHOLE; BLOCKS[1]];
        let irradiance = divide(&sums, &mut rows);
        Self { rows, columns, irradiance }
    }

    /// A block, `u` stretched back to the unit square within it, and the probability.
    fn sample(&self, u: Vec2) -> ([usize; 2], Vec2, f32) {
        let (row, v) = choose(&self.rows, u.y);
        let (column, w) = choose(&self.columns[row], u.x);
        ([column, row], Vec2::new(w, v), self.probability([column, row]))
    }

    /// Of a block.
    fn probability(&self, [x, y]: [usize; 2]) -> f32 {
        width(&self.rows, y) * width(&self.columns[y], x)
    }
}

/// Gives each of `weights` its part of the whole, none with weight less than the least there is, and sets the edges
/// beyond to [`WHOLE`]; returns the sum. Without any weight the first has all.
fn divide(weights: &[f32], edges: &mut [Edge]) -> f32 {
    let sum: f64 = weights.iter().map(|w| f64::from(*w)).sum();
    let spare = f64::from(WHOLE) - weights.len() as f64;
    let least = |w: &f32| if *w > 0.0 { (f64::from(*w) / sum * spare) as u32 + 1 } else { 0 };
    // Rounding leaves a few over: to the largest, which notices least.
    let left = u32::from(WHOLE) - weights.iter().map(least).sum::<u32>();
    let largest = (0..weights.len()).rev().max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
    let mut edge = 0;
    for (i, to) in edges.iter_mut().enumerate() {
        *to = edge as Edge;
        edge += weights.get(i).map_or(0, least) + if i == largest { left } else { 0 };
    }
    sum as f32
}

/// The entry that `u` falls into, and `u` stretched back to [0, 1).
fn choose(edges: &[Edge], u: f32) -> (usize, f32) {
    let u = u * f32::from(WHOLE);
    // The last that begins at or below u: one of zero width never is.
    let i = edges.partition_point(|edge| *edge <= u as Edge).max(1) - 1;
    let v = (u - f32::from(edges[i])) / (width(edges, i) * f32::from(WHOLE));
    (i, v.clamp(0.0, ONE_MINUS_EPSILON))
}

/// Probability of entry `i`.
fn width(edges: &[Edge], i: usize) -> f32 {
    let end = edges.get(i + 1).copied().unwrap_or(WHOLE);
    f32::from(end - edges[i]) / f32::from(WHOLE)
}

/// Corner of a square of the octahedron's map that the vector `n`, of any length, is nearest to.
fn orientation(n: Vec3) -> usize {
    let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
    let p = if n.z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y, p.x).abs()) * Vec2::ONE.copysign(p) };
    let at = |x: f32| (((0.5 * x + 0.5) * SQUARES as f32 + 0.5) as usize).min(SQUARES);
    at(p.y) * (SQUARES + 1) + at(p.x)
}

/// The unit vector at a point of the map, [0, 1]².
fn of_map(p: Vec2) -> Vec3 {
    let p = p * 2.0 - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y, p.x).abs()) * Vec2::ONE.copysign(p) };
    p.extend(z).normalize()
}

impl Environment {
    /// Scaled; turned by `to_world`. `luminance`: weights of the colours.
    pub fn new(
        image: &Arc<Image>,
        scale: f32,
        to_world: Mat4,
        luminance: Vec3,
    ) -> Result<Self, BadEnvironment> {
        let (w, h, channels) = (image.width, image.height, image.channels.len());
        if w < 2 || h < 2 || channels < 3 {
            return Err(BadEnvironment { width: w, height: h, channels });
        }
        let to_world = Mat3::from_mat4(to_world);
        let (across, down) = (w, h - 1);
        let texels = (0..h)
            .flat_map(|y| (0..=w).map(move |x| (x, y)))
            .map(|(x, y)| (Vec3::from_slice(&image.pixel(x % w, y)[..3]) * scale).extend(0.0))
            .collect();
        // ∫ sin θ over a row of cells, exactly.
        let cos = |y: usize| (std::f64::consts::PI * y as f64 / down as f64).cos();
        let solid_angle = |y: usize| (cos(y) - cos(y + 1)) as f32 * TAU / across as f32;
        let solid_angles: Vec<f32> = (0..down).map(solid_angle).collect();
        let mut environment = Self {
            texels,
            across,
            down,
            to_world,
            to_local: to_world.inverse(),
            cells: Cells::new(across, down),
            views: Vec::new(),
        };
        let mut light = environment.light(luminance, &solid_angles);
        // Against cells that are dark in the mean but not everywhere.
        let sum: f64 = light.iter().map(|l| f64::from(*l)).sum();
        let floor = (0.01 * sum / (4.0 * std::f64::consts::PI)) as f32;
        for (row, solid_angle) in light.chunks_exact_mut(across).zip(&solid_angles) {
            row.iter_mut().for_each(|l| *l += floor * solid_angle);
        }
        let of_block = environment.cells.fill(&light, across);
        for y in 0..down {
            for x in 0..across {
                environment.texels[y * (across + 1) + x].w = environment.cells.probability([x, y]);
            }
        }
        environment.views =
            views(&environment.parts(&light, &solid_angles), of_block.len(), environment.cells.count[0]);
        Ok(environment)
    }

    /// Of each cell: luminance times solid angle.
    fn light(&self, luminance: Vec3, solid_angles: &[f32]) -> Vec<f32> {
        let cells = (0..self.down).flat_map(|y| (0..self.across).map(move |x| [x, y]));
        let of_cell = |[x, y]: [usize; 2]| {
            let mean = 0.25 * self.corners([x, y]).into_iter().sum::<Vec4>().truncate();
            luminance.dot(mean).max(0.0) * solid_angles[y]
        };
        cells.map(of_cell).collect()
    }

    /// Radiance at the corners of a cell: two above, two below.
    fn corners(&self, [x, y]: [usize; 2]) -> [Vec4; 4] {
        // One column more than the picture has, so that neighbours lie side by side everywhere.
        let row = self.across + 1;
        let at = y * row + x;
        let (above, below) = (&self.texels[at..at + 2], &self.texels[at + row..at + row + 2]);
        [above[0], above[1], below[0], below[1]]
    }

    /// Asks memory for the corners of a cell ahead of time: they are wanted when a shadow ray has come through.
    #[allow(unsafe_code)]
    #[cfg_attr(not(target_arch = "x86_64"), allow(unused_variables))]
    #[inline(always)]
    fn fetch(&self, [x, y]: [usize; 2]) {
        #[cfg(target_arch = "x86_64")]
        for y in [y, y + 1] {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let corner = self.texels.as_ptr().wrapping_add(y * (self.across + 1) + x);
            // SAFETY: a hint; whatever the address, it reads nothing that the program could see.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(corner.cast()) };
        }
    }

    /// How a surface that faces `facing` looks at it; zero: to all sides.
    fn view(&self, facing: Vec3) -> &View {
        let i = if facing == Vec3::ZERO { self.views.len() - 1 } else { orientation(self.to_local * facing) };
        &self.views[i]
    }

    /// Irradiance, roughly, that light samples of a surface that faces `facing` have to find.
    pub fn irradiance(&self, facing: Vec3) -> f32 {
        self.view(facing).irradiance
    }

    /// Of one cell of the picture: probability to density per solid angle.
    fn per_solid_angle(&self, sin_theta: f32) -> f32 {
        (self.across * self.down) as f32 / (2.0 * PI * PI * sin_theta)
    }

    /// The cell at x in [0, W) from the first texel's centre and y in [0, H − 1].
    fn cell(&self, at: Vec2) -> [usize; 2] {
        [(at.x as usize).min(self.across - 1), (at.y as usize).min(self.down - 1)]
    }

    /// Radiance along `direction`, and the density of `sample` there for a surface that faces `facing`.
    pub fn radiance_pdf(&self, direction: Vec3, facing: Vec3) -> (Vec3, f32) {
        let local = (self.to_local * direction).normalize();
        let x = local.x.atan2(-local.z) * (1.0 / TAU) - 0.5 / self.across as f32;
        let y = local.y.clamp(-1.0, 1.0).acos() * FRAC_1_PI;
        let at = Vec2::new((x - x.floor()) * self.across as f32, y * self.down as f32);
        let cell = self.cell(at);
        let corners = self.corners(cell);
        let sin_theta = (1.0 - local.y * local.y).max(0.0).sqrt();
        let mut pdf = 0.0;
        if sin_theta > 0.0 {
            let block = self.view(facing).probability(self.cells.block(cell));
            pdf = block * corners[0].w * self.per_solid_angle(sin_theta);
        }
        (between(corners, at, cell), pdf)
    }

    /// Radiance at a place that `sample` has found.
    pub fn radiance_at(&self, at: Vec2) -> Vec3 {
        let cell = self.cell(at);
        between(self.corners(cell), at, cell)
    }

    /// A direction for a surface that faces `facing`, its density, and the place where its radiance lies.
    pub fn sample(&self, facing: Vec3, u: Vec2) -> Option<(Vec3, f32, Vec2)> {
        let (block, u, p_block) = self.view(facing).sample(u);
        let (at, p) = self.cells.sample(block, u);
        let (sin_theta, cos_theta) = (at.y * (PI / self.down as f32)).sin_cos();
        if sin_theta <= 0.0 || p_block * p <= 0.0 {
            return None;
        }
        let (sin_phi, cos_phi) = ((at.x + 0.5) * (TAU / self.across as f32)).sin_cos();
        let local = Vec3::new(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
        let pdf = p_block * p * self.per_solid_angle(sin_theta);
        self.fetch(self.cell(at));
        Some(((self.to_world * local).normalize(), pdf, at))
    }

    /// The parts of all blocks.
    fn parts(&self, light: &[f32], solid_angles: &[f32]) -> Vec<Part> {
        let size = self.cells.size;
        let parts = size.map(|n| n.min(PARTS));
        let columns = self.cells.count[0] * parts[0];
        let mut sums = vec![(0.0f32, 0.0f32, Vec3::ZERO); columns * self.cells.count[1] * parts[1]];
        let part_of =
            |i: usize, axis: usize| i / size[axis] * parts[axis] + i % size[axis] * parts[axis] / size[axis];
        for (y, &solid_angle) in solid_angles.iter().enumerate() {
            let (sin_theta, cos_theta) = ((y as f32 + 0.5) * (PI / self.down as f32)).sin_cos();
            for x in 0..self.across {
                let (sin_phi, cos_phi) = ((x as f32 + 1.0) * (TAU / self.across as f32)).sin_cos();
                let direction = Vec3::new(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
                let sum = &mut sums[part_of(y, 1) * columns + part_of(x, 0)];
                sum.0 += solid_angle;
                sum.1 += light[y * self.across + x];
                sum.2 += direction * solid_angle;
            }
        }
        let part = |(i, &(solid_angle, light, direction)): (usize, &(f32, f32, Vec3))| Part {
            block: i / columns / parts[1] * self.cells.count[0] + i % columns / parts[0],
            direction: direction.normalize_or_zero(),
            solid_angle,
            light,
        };
        sums.iter().enumerate().map(part).filter(|p| p.solid_angle > 0.0).collect()
    }
}

/// Radiance at a place in a `cell` with these corners.
fn between(corners: [Vec4; 4], at: Vec2, cell: [usize; 2]) -> Vec3 {
    let t = at - Vec2::new(cell[0] as f32, cell[1] as f32);
    let (above, below) = (corners[0].lerp(corners[1], t.x), corners[2].lerp(corners[3], t.x));
    above.lerp(below, t.y).truncate()
}

/// A part of a block: where it is, its size, and the light from it.
struct Part {
    block: usize,
    direction: Vec3,
    solid_angle: f32,
    /// Luminance times solid angle.
    light: f32,
}

/// With one sample of a material that draws directions with density q, and one of the light with p, the balance
/// heuristic has no noise where p + q goes as f cos L; for a matt surface under irradiance E that is
/// p ∝ cos (L − E / 2π).
fn views(parts: &[Part], blocks: usize, across: usize) -> Vec<View> {
    let view = |cosines: &dyn Fn(Vec3) -> f32| {
        let cosines: Vec<f32> = parts.iter().map(|p| cosines(p.direction)).collect();
        let sum = |f: fn(&Part) -> f32| -> f32 { parts.iter().zip(&cosines).map(|(p, c)| c * f(p)).sum() };
        let even = 0.5 * sum(|p| p.light) / sum(|p| p.solid_angle);
        let mut blocks = vec![0.0; blocks];
        for (part, cos) in parts.iter().zip(&cosines) {
            let bright = (part.light - even * part.solid_angle).max(0.0);
            blocks[part.block] += cos * (bright + ALWAYS * part.light);
        }
        View::new(&blocks, across)
    };
    let mut views: Vec<View> = (0..(SQUARES + 1) * (SQUARES + 1))
        .map(|i| {
            let corner = Vec2::new((i % (SQUARES + 1)) as f32, (i / (SQUARES + 1)) as f32);
            let normal = of_map(corner / SQUARES as f32);
            // The surface's own normal may be so far off; its horizon is then lower.
            view(&|w| (normal.dot(w) + OFF).max(0.0))
        })
        .collect();
    // The cosine's mean over all directions.
    views.push(view(&|_| 0.25));
    views
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::warp::uniform_sphere;

    #[test]
    fn an_environment_is_sampled_where_it_shines_and_its_density_integrates_to_one() {
        let mut image = Image::rgb(16, 9);
        for (i, v) in image.data.iter_mut().enumerate() {
            *v = ((i * 31) % 7) as f32 * 0.1;
        }
        image.pixel_mut(5, 3).copy_from_slice(&[50.0, 40.0, 30.0]);
        let turn = Mat4::from_rotation_x(0.7) * Mat4::from_rotation_y(-1.9);
        let env =
            Environment::new(&Arc::new(image), 2.0, turn, Vec3::new(0.2, 0.7, 0.1)).expect("a good picture");
        let facing = [Vec3::ZERO, Vec3::Y, Vec3::new(0.3, -0.8, 0.5).normalize()];
        let frame = yugen_optics::Frame::from_normal(Vec3::new(0.3, 0.8, -0.5).normalize());
        for facing in facing {
            // Towards the horizon there may be light that only materials find.
            let high = |w: Vec3| f64::from(u8::from(facing == Vec3::ZERO || facing.dot(w) > 0.5));
            let n = 1000;
            let (mut integral, mut power) = (0.0f64, 0.0f64);
            for i in 0..n {
                for j in 0..n {
                    let w = frame.to_world(uniform_sphere((Vec2::new(i as f32, j as f32) + 0.5) / n as f32));
                    let (radiance, pdf) = env.radiance_pdf(w, facing);
                    integral += f64::from(pdf);
                    power += f64::from(radiance.y) * high(w);
                }
            }
            let solid = 4.0 * std::f64::consts::PI / f64::from(n * n);
            assert!((integral * solid - 1.0).abs() < 0.01, "{}", integral * solid);
            let mut sum = 0.0f64;
            let samples = 1_000_000;
            let mut disagree = 0;
            let mut rng = yugen_optics::random::Pcg32::new(3, 4);
            for _ in 0..samples {
                let u = Vec2::new(rng.next_f32(), rng.next_f32());
                let (w, pdf, _) = env.sample(facing, u).expect("a direction");
                // A direction on the border of two cells may be read back in the other one.
                let (radiance, again) = env.radiance_pdf(w, facing);
                disagree += u32::from((again / pdf - 1.0).abs() > 1e-3);
                sum += f64::from(radiance.y / pdf) * high(w);
            }
            let estimate = sum / f64::from(samples);
            assert!(disagree < 1000, "{disagree} of {samples}");
            assert!((estimate / (power * solid) - 1.0).abs() < 0.01, "{estimate} {}", power * solid);
        }
    }
}
