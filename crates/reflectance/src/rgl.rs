//! Dupuy and Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering": the RGL
//! measurements.

use crate::axis::{azimuth, clamped, polar_angle};
use crate::metals::Metal;
use crate::microfacet::{Distribution, Masking, Microfacets};
use crate::model::{Data, Laws, Model, ModelError, Preset, Sample, Spec, params};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use yugen_optics::ColourSpace;
use yugen_optics::distribution::ONE_MINUS_EPSILON;
use yugen_optics::frame::spherical;

params! {
    /// A measured BRDF, isotropic or not, in the parameterisation that follows its own microfacets.
    pub struct Rgl {
        scale: f32 = Spec::num(1.0, 0.0, 1.0, "", "factor on the measurement"),
    }
}

/// Values on a regular grid over the unit square, borders included, `width` fastest.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Grid {
    /// Nodes along the first coordinate (√ of the polar angle).
    pub width: usize,
    /// Nodes along the second (azimuth).
    pub height: usize,
    /// One grid, or one for each eye direction (azimuth slowest, then polar angle).
    pub values: Vec<f32>,
}

/// A measurement as the files hold it, with colours as RGB. Lengths agree where [`Measurement::check`] says so.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Measurement {
    /// Azimuths of the eye, rising, radians; one or two for an isotropic material, else from −π on: a whole turn,
    /// a half, or a quarter, the rest being symmetric.
    pub phi: Vec<f32>,
    /// Polar angles of the eye, rising, radians.
    pub theta: Vec<f32>,
    /// Density of microfacet normals.
    pub ndf: Grid,
    /// Projected area of the microfacets towards a direction.
    pub sigma: Grid,
    /// Density of normals seen from each eye direction.
    pub vndf: Grid,
    /// Luminance over the square that the visible normals are drawn from; square.
    pub luminance: Grid,
    /// f cos θ times 4σ/D on the same square, for each eye direction a grid of red, green, blue. (Without 4σ/D
    /// where `jacobian` is false.)
    pub rgb: Vec<f32>,
    /// See `rgb`.
    pub jacobian: bool,
}

/// The azimuths of the eye of [`Measurement::of`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// One: the material is the same however it is turned.
    None,
    /// So many (at least three) over a quarter turn: the material is its own mirror image along and across the
    /// tangent.
    Quarter(usize),
    /// So many (at least three) over the whole turn.
    Whole(usize),
}

const HEADER: usize = 10;

impl Measurement {
    /// What is wrong with it, if anything is.
    pub fn check(&self) -> Result<(), String> {
        let slices = self.phi.len() * self.theta.len();
        let rising = |v: &[f32]| v.iter().all(|x| x.is_finite()) && v.windows(2).all(|w| w[0] < w[1]);
        if slices == 0 || !rising(&self.phi) || !rising(&self.theta) {
            return Err("has eye directions that do not rise".into());
        }
        for (name, grid, count) in [
            ("ndf", &self.ndf, 1),
            ("sigma", &self.sigma, 1),
            ("vndf", &self.vndf, slices),
            ("luminance", &self.luminance, slices),
        ] {
            if grid.width < 2 || grid.height < 2 || grid.values.len() != grid.width * grid.height * count {
                return Err(format!(
                    "has {} values of {name}; {count} grids of {} x {} (at least 2 x 2) need {}",
                    grid.values.len(),
                    grid.width,
                    grid.height,
                    grid.width * grid.height * count
                ));
            }
            if !grid.values.iter().all(|v| v.is_finite()) {
                return Err(format!("has {name} that is not finite"));
            }
        }
        if self.rgb.len() != 3 * self.luminance.values.len() {
            return Err(format!(
                "has {} colour values; expected {}",
                self.rgb.len(),
                3 * self.luminance.values.len()
            ));
        }
        if !self.rgb.iter().all(|v| v.is_finite()) {
            return Err("has colours that are not finite".into());
        }
        Ok(())
    }

    /// How many sectors of azimuth are symmetric: 1, 2 or 4; 1 also for isotropic materials.
    fn reduction(&self) -> usize {
        match self.phi.as_slice() {
            [first, .., last] if self.phi.len() > 2 => (TAU / (last - first)).round() as usize,
            _ => 1,
        }
    }

    /// As numbers for [`Model::bake`].
    pub fn to_data(&self) -> Vec<f32> {
        let grids = [&self.ndf, &self.sigma, &self.vndf, &self.luminance];
        let mut data = vec![self.phi.len() as f32, self.theta.len() as f32];
        data.extend(grids.iter().flat_map(|g| [g.width as f32, g.height as f32]));
        // The height of the luminance is its width: its place says whether the values carry 4σ/D.
        data[HEADER - 1] = f32::from(self.jacobian);
        data.extend(self.phi.iter().chain(&self.theta));
        grids.iter().for_each(|g| data.extend(&g.values));
        data.extend(&self.rgb);
        data
    }

    /// The way back from [`Self::to_data`].
    fn from_data(data: &[f32]) -> Result<Self, String> {
        let short = || "needs the numbers of an RGL .bsdf file".to_string();
        let (header, mut rest) = data.split_at_checked(HEADER).ok_or_else(short)?;
        if !header.iter().all(|x| (0.0..=65536.0).contains(x)) {
            return Err(short());
        }
        let size = |i: usize| header[i] as usize;
        let slices = size(0) * size(1);
        let mut take = |n: usize| -> Result<Vec<f32>, String> {
            let (head, tail) = rest.split_at_checked(n).ok_or_else(short)?;
            rest = tail;
            Ok(head.to_vec())
        };
        let (phi, theta) = (take(size(0))?, take(size(1))?);
        let mut grid = |i: usize, height: usize, count: usize| -> Result<Grid, String> {
            Ok(Grid {
                width: size(i),
                height,
                values: take(size(i).saturating_mul(height).saturating_mul(count))?,
            })
        };
        let (ndf, sigma) = (grid(2, size(3), 1)?, grid(4, size(5), 1)?);
        let (vndf, luminance) = (grid(6, size(7), slices)?, grid(8, size(8), slices)?);
        let rgb = rest.to_vec();
        let m = Self { phi, theta, ndf, sigma, vndf, luminance, rgb, jacobian: header[HEADER - 1] != 0.0 };
        m.check()?;
        Ok(m)
    }

    /// A virtual gonioreflectometer: measures `f(wo, wi)` (1/sr, without the cosine) with the warps of a GGX
    /// surface of roughness `ax`, `ay`, at `n_theta` polar angles of the eye and the azimuths of `sweep`. The warps
    /// have `fine`², the colours `coarse`² nodes.
    pub fn of(
        f: impl Fn(Vec3, Vec3) -> Vec3,
        (ax, ay): (f32, f32),
        sweep: Sweep,
        n_theta: usize,
        fine: usize,
        coarse: usize,
    ) -> Self {
        let facets = Microfacets::new(Distribution::Ggx, Masking::Separable, ax, ay);
        let sigma = |w: Vec3| {
            if w.z > 1e-6 { w.z / facets.g1(w) } else { 0.5 * Vec2::new(ax * w.x, ay * w.y).length() }
        };
        let theta: Vec<f32> =
            (0..n_theta).map(|i| (i as f32 / (n_theta - 1) as f32) * (FRAC_PI_2 - 0.02)).collect();
        let spread = |n: usize, turn: f32| (0..n).map(|i| -PI + turn * i as f32 / (n - 1) as f32).collect();
        let phi: Vec<f32> = match sweep {
            Sweep::None => vec![0.0],
            Sweep::Quarter(n) => spread(n, FRAC_PI_2),
            Sweep::Whole(n) => spread(n, TAU),
        };
        let over = |n: usize, value: &dyn Fn(Vec2) -> f32| Grid {
            width: n,
            height: n,
            values: (0..n * n)
                .map(|i| value(Vec2::new((i % n) as f32, (i / n) as f32) / (n - 1) as f32))
                .collect(),
        };
        let mut m = Self {
            ndf: over(fine, &|u| facets.d(direction(u, 0.0))),
            sigma: over(fine, &|u| sigma(direction(u, 0.0))),
            vndf: Grid { width: fine, height: fine, values: Vec::new() },
            luminance: Grid { width: coarse, height: coarse, values: Vec::new() },
            jacobian: true,
            ..Self::default()
        };
        for &phi_o in &phi {
            let turn = if sweep == Sweep::None { phi_o } else { 0.0 };
            for &theta_o in &theta {
                let wo = spherical(theta_o, phi_o);
                m.vndf.values.extend(
                    over(fine, &|u| {
                        let h = direction(u, turn);
                        facets.d(h) * wo.dot(h).max(0.0) * square_to_sphere(u.x)
                    })
                    .values,
                );
            }
        }
        (m.phi, m.theta) = (phi, theta);
        // The normals that belong to the coarse nodes follow from the warp, so that is built first.
        let mut warps = m.clone();
        warps.luminance.values = vec![1.0; m.phi.len() * m.theta.len() * coarse * coarse];
        warps.rgb = vec![0.0; 3 * warps.luminance.values.len()];
        let table = warps.to_table();
        let view = View::new(&table);
        for &phi_o in &m.phi {
            for &theta_o in &m.theta {
                let wo = spherical(theta_o, phi_o);
                let at = view.slices(phi_o, theta_o);
                let values: Vec<Vec3> = (0..coarse * coarse)
                    .map(|i| {
                        let s = Vec2::new((i % coarse) as f32, (i / coarse) as f32) / (coarse - 1) as f32;
                        let (u, _) = view.vndf.sample(&table, &at, s.min(Vec2::splat(ONE_MINUS_EPSILON)));
                        let h = direction(u, if view.isotropic { phi_o } else { 0.0 });
                        let wi = 2.0 * wo.dot(h) * h - wo;
                        let scale = 4.0 * view.sigma.plain(&table, square(theta_o, phi_o))
                            / view.ndf.plain(&table, u);
                        if wi.z > 0.0 && wo.dot(h) > 0.0 { f(wo, wi) * (wi.z * scale) } else { Vec3::ZERO }
                    })
                    .collect();
                m.luminance.values.extend(values.iter().map(|v| v.element_sum() / 3.0));
                (0..3).for_each(|c| m.rgb.extend(values.iter().map(|v| v[c])));
            }
        }
        m
    }

    /// The numbers that `eval` reads: [`Self::to_data`] with the densities normalised and followed by their
    /// cumulative sums.
    fn to_table(&self) -> Vec<f32> {
        let mut table = self.to_data();
        table.truncate(HEADER + self.phi.len() + self.theta.len());
        table.extend(self.ndf.values.iter().chain(&self.sigma.values));
        for grid in [&self.vndf, &self.luminance] {
            push_warp(grid, &mut table);
        }
        table.extend(&self.rgb);
        table.push(self.reduction() as f32);
        table
    }
}

/// All densities of a grid, then all sums along rows, then all sums over rows.
fn push_warp(grid: &Grid, table: &mut Vec<f32>) {
    let (w, h) = (grid.width, grid.height);
    let (mut along, mut over) = (Vec::new(), Vec::new());
    for slice in grid.values.chunks_exact(w * h) {
        let mut values: Vec<f64> = slice.iter().map(|v| f64::from(v.max(0.0))).collect();
        let rows = |values: &[f64]| -> Vec<Vec<f64>> {
            let sum_row = |row: &[f64]| {
                row.windows(2).fold(vec![0.0], |mut sums, w| {
                    sums.push(sums[sums.len() - 1] + 0.5 * (w[0] + w[1]));
                    sums
                })
            };
            values.chunks_exact(w).map(sum_row).collect()
        };
        let total =
            |rows: &[Vec<f64>]| rows.windows(2).map(|r| 0.5 * (r[0][w - 1] + r[1][w - 1])).sum::<f64>();
        let mut sums = rows(&values);
        if total(&sums) <= 0.0 {
            // Nothing was seen from here: any normal will do.
            values.fill(1.0);
            sums = rows(&values);
        }
        let norm = 1.0 / total(&sums);
        let cells = ((w - 1) * (h - 1)) as f64;
        table.extend(values.iter().map(|v| (v * norm * cells) as f32));
        along.extend(sums.iter().flatten().map(|v| (v * norm) as f32));
        let mut sum = 0.0;
        over.push(0.0);
        for r in sums.windows(2) {
            sum += 0.5 * (r[0][w - 1] + r[1][w - 1]) * norm;
            over.push(sum as f32);
        }
    }
    table.extend(along);
    table.extend(over);
}

/// The direction of a point of the square.
fn direction(u: Vec2, turn: f32) -> Vec3 {
    spherical(u.x * u.x * FRAC_PI_2, (2.0 * u.y - 1.0) * PI + turn)
}

/// The point of the square of a direction.
fn square(theta: f32, phi: f32) -> Vec2 {
    Vec2::new((theta / FRAC_PI_2).sqrt(), (phi + PI) / TAU)
}

/// Solid angle per area of the square.
fn square_to_sphere(u: f32) -> f32 {
    2.0 * PI * PI * u * (u * u * FRAC_PI_2).sin()
}

/// Up to four slices of a table over eye directions, with their weights.
type Slices = [(usize, f32); 4];

/// A grid in a baked table.
#[derive(Clone, Copy)]
struct Warp {
    width: usize,
    height: usize,
    values: usize,
    along: usize,
    over: usize,
}

impl Warp {
    fn mix(table: &[f32], at: &Slices, start: usize, stride: usize, i: usize) -> f32 {
        at.iter().filter(|(_, w)| *w > 0.0).map(|(s, w)| w * table[start + s * stride + i]).sum()
    }

    fn cell(&self, p: Vec2) -> (usize, usize, Vec2) {
        let p = p.clamp(Vec2::ZERO, Vec2::ONE) * Vec2::new((self.width - 1) as f32, (self.height - 1) as f32);
        let (i, j) = ((p.x as usize).min(self.width - 2), (p.y as usize).min(self.height - 2));
        (i, j, p - Vec2::new(i as f32, j as f32))
    }

    /// Values at the left and right border of a cell, at `y` between its rows.
    fn edges(&self, table: &[f32], at: &Slices, i: usize, j: usize, y: f32) -> (f32, f32) {
        let v = |i: usize, j: usize| {
            Self::mix(table, at, self.values, self.width * self.height, j * self.width + i)
        };
        ((1.0 - y) * v(i, j) + y * v(i, j + 1), (1.0 - y) * v(i + 1, j) + y * v(i + 1, j + 1))
    }

    /// Sum along row `j` up to node `i`.
    fn sum(&self, table: &[f32], at: &Slices, i: usize, j: usize) -> f32 {
        Self::mix(table, at, self.along, self.width * self.height, j * self.width + i)
    }

    /// Interpolated value; the density for a normalised grid.
    fn eval(&self, table: &[f32], at: &Slices, p: Vec2) -> f32 {
        let (i, j, t) = self.cell(p);
        let (left, right) = self.edges(table, at, i, j, t.y);
        left + t.x * (right - left)
    }

    /// Interpolated value of a grid without slices.
    fn plain(&self, table: &[f32], p: Vec2) -> f32 {
        self.eval(table, &[(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)], p)
    }

    /// The point that uniform `u` is warped to, and its density: rows first, then along the row.
    fn sample(&self, table: &[f32], at: &Slices, u: Vec2) -> (Vec2, f32) {
        let rows = |j: usize| Self::mix(table, at, self.over, self.height, j);
        let j = last_below(self.height, u.y, rows);
        let (r0, r1) = (self.sum(table, at, self.width - 1, j), self.sum(table, at, self.width - 1, j + 1));
        let y = solve(r0, r1, u.y - rows(j));
        let target = u.x * ((1.0 - y) * r0 + y * r1);
        let along = |i: usize| (1.0 - y) * self.sum(table, at, i, j) + y * self.sum(table, at, i, j + 1);
        let i = last_below(self.width, target, along);
        let (left, right) = self.edges(table, at, i, j, y);
        let cells = ((self.width - 1) * (self.height - 1)) as f32;
        let x = solve(left / cells, right / cells, target - along(i));
        let p =
            Vec2::new((i as f32 + x) / (self.width - 1) as f32, (j as f32 + y) / (self.height - 1) as f32);
        (p, left + x * (right - left))
    }

    /// The uniform point that is warped to `p`, and the density there.
    fn invert(&self, table: &[f32], at: &Slices, p: Vec2) -> (Vec2, f32) {
        let (i, j, t) = self.cell(p);
        let (left, right) = self.edges(table, at, i, j, t.y);
        let (r0, r1) = (self.sum(table, at, self.width - 1, j), self.sum(table, at, self.width - 1, j + 1));
        let along = (1.0 - t.y) * self.sum(table, at, i, j) + t.y * self.sum(table, at, i, j + 1);
        let cells = ((self.width - 1) * (self.height - 1)) as f32;
        let row = (1.0 - t.y) * r0 + t.y * r1;
        let x = along + t.x * (left + 0.5 * t.x * (right - left)) / cells;
        let y = Self::mix(table, at, self.over, self.height, j) + t.y * (r0 + 0.5 * t.y * (r1 - r0));
        (Vec2::new(if row > 0.0 { x / row } else { 0.5 }, y), left + t.x * (right - left))
    }
}

/// The last index whose sum is at most `target`, leaving one after it.
fn last_below(n: usize, target: f32, sum: impl Fn(usize) -> f32) -> usize {
    let (mut low, mut high) = (0, n - 1);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if sum(middle) <= target { low = middle } else { high = middle }
    }
    low
}

/// Where the integral of a line from `a` (at 0) to `b` (at 1) reaches `area`.
fn solve(a: f32, b: f32, area: f32) -> f32 {
    // Citardauq's form has no cancellation for b near a.
    let root = (a * a + 2.0 * area.max(0.0) * (b - a)).max(0.0).sqrt();
    let sum = a + root;
    if sum > 0.0 { (2.0 * area / sum).clamp(0.0, 1.0) } else { 0.5 }
}

/// Where things are in a baked table.
struct View<'a> {
    phi: &'a [f32],
    theta: &'a [f32],
    ndf: Warp,
    sigma: Warp,
    vndf: Warp,
    luminance: Warp,
    rgb: usize,
    jacobian: bool,
    isotropic: bool,
    reduction: usize,
}

impl<'a> View<'a> {
    fn new(table: &'a [f32]) -> Self {
        let size = |i: usize| table[i] as usize;
        let (n_phi, n_theta) = (size(0), size(1));
        let slices = n_phi * n_theta;
        let mut at = HEADER + n_phi + n_theta;
        let mut warp = |i: usize, height: usize, count: usize, sums: bool| {
            let (width, values) = (size(i), at);
            let all = width * height * count;
            at += if sums { 2 * all + height * count } else { all };
            Warp { width, height, values, along: values + all, over: values + 2 * all }
        };
        Self {
            phi: &table[HEADER..HEADER + n_phi],
            theta: &table[HEADER + n_phi..HEADER + n_phi + n_theta],
            ndf: warp(2, size(3), 1, false),
            sigma: warp(4, size(5), 1, false),
            vndf: warp(6, size(7), slices, true),
            luminance: warp(8, size(8), slices, true),
            rgb: at,
            jacobian: table[HEADER - 1] != 0.0,
            isotropic: n_phi <= 2,
            reduction: table[table.len() - 1] as usize,
        }
    }

    /// The measured eye directions around one.
    fn slices(&self, phi: f32, theta: f32) -> Slices {
        let ((p, q, y), (t, s, x)) = (clamped(self.phi, phi), clamped(self.theta, theta));
        let n = self.theta.len();
        [
            (p * n + t, (1.0 - y) * (1.0 - x)),
            (p * n + s, (1.0 - y) * x),
            (q * n + t, y * (1.0 - x)),
            (q * n + s, y * x),
        ]
    }

    /// Signs that turn the eye into the measured sector, which starts at −π.
    fn signs(&self, wo: Vec3) -> Vec3 {
        let flip = |v: f32| if v.is_sign_negative() { 1.0 } else { -1.0 };
        match self.reduction {
            2 => Vec3::new(flip(wo.y), flip(wo.y), 1.0),
            4 => Vec3::new(flip(wo.x), flip(wo.y), 1.0),
            _ => Vec3::ONE,
        }
    }

    /// The azimuth of an eye in the measured sector, whatever the signs of its zeros.
    fn azimuth(&self, wo: Vec3) -> f32 {
        if self.reduction == 1 {
            azimuth(wo)
        } else if wo.x == 0.0 && wo.y == 0.0 {
            -PI
        } else {
            -wo.y.abs().atan2(wo.x)
        }
    }

    /// f cos θ_i from the points of both squares.
    fn value(&self, table: &[f32], at: &Slices, s: Vec2, u_h: Vec2, u_o: Vec2) -> Vec3 {
        let n = self.luminance.width;
        let channel = |c: usize| {
            // Three grids for each slice: the slices of one channel lie three apart.
            let grid = Warp { values: self.rgb + c * n * n, ..self.luminance };
            let (i, j, t) = grid.cell(s);
            let v = |i: usize, j: usize| Warp::mix(table, at, grid.values, 3 * n * n, j * n + i);
            let (low, high) = (
                v(i, j) + t.x * (v(i + 1, j) - v(i, j)),
                v(i, j + 1) + t.x * (v(i + 1, j + 1) - v(i, j + 1)),
            );
            low + t.y * (high - low)
        };
        let rgb = Vec3::new(channel(0), channel(1), channel(2)).max(Vec3::ZERO);
        if !self.jacobian {
            return rgb;
        }
        let sigma = self.sigma.plain(table, u_o);
        if sigma > 0.0 { rgb * (self.ndf.plain(table, u_h) / (4.0 * sigma)) } else { Vec3::ZERO }
    }

    /// f cos θ_i and the density with which `wi` is drawn.
    fn eval_pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let signs = self.signs(wo);
        let (wo, wi) = (wo * signs, wi * signs);
        let (theta_o, phi_o) = (polar_angle(wo), self.azimuth(wo));
        let h = wo + wi;
        let (theta_h, phi_h) = (polar_angle(h), azimuth(h));
        let mut u_h = square(theta_h, if self.isotropic { phi_h - phi_o } else { phi_h });
        u_h.y -= u_h.y.floor();
        let at = self.slices(phi_o, theta_o);
        let (s, vndf) = self.vndf.invert(table, &at, u_h);
        let density = vndf * self.luminance.eval(table, &at, s);
        // |wo + wi| = 2 cos θ_d, and the change from h to wi is 4 cos θ_d.
        let jacobian = square_to_sphere(u_h.x).max(1e-6) * 2.0 * h.length();
        let value = self.value(table, &at, s, u_h, square(theta_o, phi_o));
        (value, if jacobian > 0.0 { density / jacobian } else { 0.0 })
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec2) -> Vec3 {
        let signs = self.signs(wo);
        let wo = wo * signs;
        let (theta_o, phi_o) = (polar_angle(wo), self.azimuth(wo));
        let at = self.slices(phi_o, theta_o);
        let (s, _) = self.luminance.sample(table, &at, u);
        let (u_h, _) = self.vndf.sample(table, &at, s);
        let h = direction(u_h, if self.isotropic { phi_o } else { 0.0 });
        (2.0 * wo.dot(h) * h - wo) * signs
    }
}

impl Model for Rgl {
    const NAME: &'static str = "rgl";
    const SOURCE: &'static str =
        "Dupuy and Jakob 2018, An Adaptive Parameterization for Efficient Material Acquisition and Rendering";
    const DOC: &'static str = "A measured material, isotropic or anisotropic: reads the .bsdf files of the RGL \
        database. The measurement lives on a square that its own visible microfacets are warped from, and is \
        drawn from there. Agrees with Mitsuba's `measured` on the same file.";
    const LAWS: Laws = Laws {
        reciprocal: false,
        conserves_energy: true,
        transmits: false,
        delta: false,
        isotropic: false,
        why: "Eye and light are interpolated differently: the eye between few measured directions, the light on a \
            fine grid.",
    };
    const WGSL: &'static str = include_str!("rgl.wgsl");
    // Worst 1e-4.
    const TWIN: (f32, f32) = (4e-4, 1e-6);
    const COSTLY: bool = true;
    const DATA: Data = Data::Required("the values of an RGL .bsdf file");
    const PRESETS: &'static [Preset] = &[
        Preset {
            name: "brushed_copper",
            doc: "no measurement: GGX copper of roughness 0.15 and 0.35, as if measured",
        },
        Preset { name: "copper", doc: "no measurement: GGX copper of roughness 0.25, as if measured" },
    ];

    fn preset(name: &str, space: ColourSpace) -> Option<(Self, Vec<f32>)> {
        let ((ax, ay), sweep) = match name {
            "brushed_copper" => ((0.15, 0.35), Sweep::Quarter(9)),
            "copper" => ((0.25, 0.25), Sweep::None),
            _ => return None,
        };
        let facets = Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, ax, ay);
        // A table over the angle, as evaluating the metal by wavelength for each direction takes too long.
        let tint: Vec<Vec3> = (0..=32).map(|i| Metal::Copper.rgb(space, f64::from(i) / 32.0)).collect();
        let f = |wo: Vec3, wi: Vec3| {
            let (f, _, cos) = facets.reflect(wo, wi);
            let x = cos * 32.0;
            let i = (x as usize).min(31);
            f * tint[i].lerp(tint[i + 1], x - i as f32).clamp(Vec3::ZERO, Vec3::ONE)
        };
        Some((Self::default(), Measurement::of(f, (ax, ay), sweep, 10, 64, 32).to_data()))
    }

    fn bake(&self, data: &[f32]) -> Result<Vec<f32>, ModelError> {
        match Measurement::from_data(data) {
            Ok(m) => Ok(m.to_table()),
            Err(problem) => Err(ModelError::BadTable { model: Self::NAME, problem }),
        }
    }

    fn eval(&self, table: &[f32], wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(table, wo, wi).0
    }

    fn pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(table, wo, wi).1
    }

    fn eval_pdf(&self, table: &[f32], wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        // The files hold f cos θ.
        let (value, pdf) = View::new(table).eval_pdf(table, wo, wi);
        (value * (self.scale / wi.z), pdf)
    }

    fn sample(&self, table: &[f32], wo: Vec3, u: Vec3) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let view = View::new(table);
        let wi = view.sample(table, wo, u.truncate());
        if wi.z <= 0.0 {
            return None;
        }
        let wi = wi.normalize();
        let (value, pdf) = view.eval_pdf(table, wo, wi);
        let weight = value * (self.scale / pdf);
        (pdf > 0.0 && weight.is_finite()).then_some(Sample { wi, weight, pdf, delta: false, eta: 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::furnace::assert_samples;
    use yugen_optics::random::Pcg32;

    #[test]
    fn the_virtual_measurement_gives_the_model_back() {
        for (ax, ay, sweep) in
            [(0.3, 0.3, Sweep::None), (0.25, 0.5, Sweep::Quarter(9)), (0.25, 0.5, Sweep::Whole(33))]
        {
            let facets = Microfacets::new(Distribution::Ggx, Masking::HeightCorrelated, ax, ay);
            let f = |wo: Vec3, wi: Vec3| facets.reflect(wo, wi).0 * Vec3::new(0.9, 0.5, 0.2) + 0.05;
            let table =
                Rgl::default().bake(&Measurement::of(f, (ax, ay), sweep, 16, 96, 32).to_data()).unwrap();
            let mut rng = Pcg32::new(11, 3);
            let (mut errors, mut n) = (Vec::new(), 0);
            while n < 3000 {
                let u = rng.next_vec3();
                let (wo, wi) = (spherical(1.2 * u.x, TAU * u.y), spherical(1.2 * u.z, TAU * rng.next_f32()));
                let (got, want) = (Rgl::default().eval(&table, wo, wi), f(wo, wi));
                errors.push(((got - want) / want).abs().max_element());
                n += 1;
            }
            errors.sort_by(f32::total_cmp);
            // Measured: median 2.6e-3, 99 % 6.2e-2, both with few polar angles and two roughnesses.
            assert!(
                errors[n / 2] < 0.011 && errors[n * 99 / 100] < 0.25,
                "{} {}",
                errors[n / 2],
                errors[n * 99 / 100]
            );
        }
    }

    #[test]
    fn warps_invert_and_integrate_to_one() {
        let (model, data) = Rgl::preset("brushed_copper", ColourSpace::LinearSrgb).unwrap();
        let table = model.bake(&data).unwrap();
        let view = View::new(&table);
        let at = view.slices(-2.0, 0.7);
        let mut rng = Pcg32::new(5, 5);
        for warp in [view.vndf, view.luminance] {
            let (mut sum, n) = (0.0, 200);
            for i in 0..n * n {
                let p = (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32;
                sum += f64::from(warp.eval(&table, &at, p)) / f64::from(n * n);
            }
            assert!((sum - 1.0).abs() < 2e-3, "{sum}");
            for _ in 0..500 {
                let u = rng.next_vec3().truncate();
                let (p, density) = warp.sample(&table, &at, u);
                let (back, again) = warp.invert(&table, &at, p);
                assert!((back - u).abs().max_element() < 2e-4, "{back} {u}");
                assert!((density - again).abs() <= 1e-3 * density, "{density} {again}");
            }
        }
        for wo in [spherical(0.3, 0.4), spherical(1.2, -1.0), spherical(0.8, 2.8)] {
            assert_samples(&model, &table, wo, 0.02);
        }
        let mut bad = data.clone();
        bad[HEADER + 1] = f32::NAN;
        assert!(
            model.bake(&bad).is_err()
                && model.bake(&data[..data.len() - 1]).is_err()
                && model.bake(&[]).is_err()
        );
    }
}
