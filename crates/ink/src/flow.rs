//! Water and ink in paper: a lattice Boltzmann scheme that loses neither.
//!
//! After Chu and Tai 2005, "MoXi: Real-time Ink Dispersion in Absorbent Paper": nine populations of water on a square lattice,
//! partly thrown back at every link by what blocks it, with dry paper pinning the front of the water until there is enough
//! behind it. Three things make it conserve what it moves: what blocks a link is the same from both sides; populations below
//! zero are cut off and the rest scaled to the exact density; and ink travels *with* the populations, each carrying the
//! concentration of where it comes from, streamed or thrown back alike. Evaporation takes water and leaves ink, faster at the
//! front, so that water flows there and takes ink along (dark edges); ink that lies still is fixed.
//!
//! This is the scheme on the processor, which tests measure; `flow.wgsl` is its twin, step for step.

/// Steps to x and y of each population; its opposite has the number after or before it.
const E: [[i32; 2]; 9] = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]];
/// Weights of the populations at rest: four ninths, one ninth and one thirty-sixth.
const W: [f32; 9] =
    [4.0 / 9.0, 1.0 / 9.0, 1.0 / 9.0, 1.0 / 9.0, 1.0 / 9.0, 1.0 / 36.0, 1.0 / 36.0, 1.0 / 36.0, 1.0 / 36.0];
/// Which population goes the other way.
const OPPOSITE: [usize; 9] = [0, 2, 1, 4, 3, 6, 5, 8, 7];

/// What water in paper is like.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlowRow {
    /// Cells across and down.
    pub size: [u32; 2],
    /// Part of the way to equilibrium in a step.
    pub relaxation: f32,
    /// Density below which water creeps and does not flow.
    pub thin: f32,
    /// Density beside a dry cell from which on it becomes wet, straight; √2 more across a corner.
    pub pinning: f32,
    /// Part of the water that evaporates in a step.
    pub evaporation: f32,
    /// The same at the front, besides.
    pub evaporation_at_front: f32,
    /// Part of the ink that is fixed in a step where water has gone.
    pub fixing: f32,
}

impl FlowRow {
    /// For a sheet of so many cells.
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            // Slow enough to be viscous, as ink is.
            relaxation: 0.6,
            thin: 0.5,
            pinning: 0.12,
            evaporation: 0.004,
            evaporation_at_front: 0.03,
            fixing: 0.06,
        }
    }
}

/// A cell: water, flowing ink, what blocks it (1 and more: pinned), fixed ink.
pub type Cell = [f32; 4];

/// A wet sheet.
#[derive(Clone, Debug)]
pub struct Flow {
    row: FlowRow,
    /// Nine of each cell, after collision.
    populations: Vec<[f32; 9]>,
    cells: Vec<Cell>,
    /// How easily water passes, 0 to 1.
    open: Vec<f32>,
    /// Water that has evaporated.
    pub evaporated: f64,
}

impl Flow {
    /// `water` and `ink` of each cell, and how `open` the paper is there, 0 to 1.
    pub fn new(row: FlowRow, water: &[f32], ink: &[f32], open: &[f32]) -> Self {
        let populations = water.iter().map(|rho| W.map(|w| w * rho)).collect();
        let cells = water.iter().zip(ink).map(|(w, i)| [*w, *i, 0.0, 0.0]).collect();
        let mut this = Self { row, populations, cells, open: open.to_vec(), evaporated: 0.0 };
        let blocked: Vec<f32> = (0..this.cells.len()).map(|i| this.blocking(i)).collect();
        this.cells.iter_mut().zip(blocked).for_each(|(c, b)| c[2] = b);
        this
    }

    /// The cells.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Sums of water, flowing and fixed ink.
    pub fn sums(&self) -> [f64; 3] {
        let sum = |k: usize| self.cells.iter().map(|c| f64::from(c[k])).sum();
        [sum(0), sum(1), sum(3)]
    }

    /// The cell `e` away; none beyond the sheet, whose rim throws everything back.
    fn neighbour(&self, i: usize, e: [i32; 2]) -> Option<usize> {
        let [w, h] = self.row.size.map(|n| n as i32);
        let (x, y) = (i as i32 % w + e[0], i as i32 / w + e[1]);
        ((0..w).contains(&x) && (0..h).contains(&y)).then(|| (y * w + x) as usize)
    }

    /// What blocks a cell in the next step: what the paper does, and more than everything where it is dry and pinned.
    fn blocking(&self, i: usize) -> f32 {
        let own = 1.0 - self.open[i];
        if self.cells[i][0] > 1e-4 {
            return own;
        }
        let pushed = (1..9).any(|k| {
            let corner = if k > 4 { std::f32::consts::SQRT_2 } else { 1.0 };
            let limit = self.row.pinning * corner * (0.5 + own);
            self.neighbour(i, E[k]).is_some_and(|j| self.cells[j][0] > limit)
        });
        if pushed { own } else { 2.0 }
    }

    /// One step.
    pub fn step(&mut self) {
        let n = self.cells.len();
        let (mut populations, mut cells) = (vec![[0.0; 9]; n], vec![[0.0; 4]; n]);
        for i in 0..n {
            let own = self.cells[i];
            let concentration = |c: Cell| if c[0] > 0.0 { c[1] / c[0] } else { 0.0 };
            // What does not leave stays, ink in a cell without water among it.
            let mut ink =
                self.populations[i][0] * concentration(own) + if own[0] > 0.0 { 0.0 } else { own[1] };
            let mut f = [0.0f32; 9];
            f[0] = self.populations[i][0];
            let mut front = false;
            for k in 1..9 {
                let from = self.neighbour(i, [-E[k][0], -E[k][1]]);
                let block = from.map_or(1.0, |j| {
                    let (a, b) = (own[2], self.cells[j][2]);
                    front |= b > 1.0;
                    if a > 1.0 || b > 1.0 { 1.0 } else { 0.5 * (a + b) }
                });
                let back = self.populations[i][OPPOSITE[k]] * block;
                f[k] = back;
                ink += back * concentration(own);
                if let Some(j) = from.filter(|_| block < 1.0) {
                    let came = self.populations[j][k] * (1.0 - block);
                    f[k] += came;
                    ink += came * concentration(self.cells[j]);
                }
            }
            let full: f32 = f.iter().sum();
            let loss = self.row.evaporation + if front { self.row.evaporation_at_front } else { 0.0 };
            let rho = full * (1.0 - loss);
            self.evaporated += f64::from(full - rho);
            // Ink settles as water goes: wholly where none is left.
            let settling =
                if rho < 1e-4 { 1.0 } else { (self.row.fixing * (1.0 - rho).clamp(0.0, 1.0)).min(1.0) };
            let fixed = ink * settling;
            cells[i] = [rho, ink - fixed, 0.0, own[3] + fixed];
            f.iter_mut().for_each(|f| *f *= 1.0 - loss);
            populations[i] = collide(f, rho, &self.row);
        }
        // What blocks is decided by the water before this step, so that a step needs no look at the new cells around.
        let blocked: Vec<f32> = (0..n).map(|i| self.blocking(i)).collect();
        cells.iter_mut().zip(blocked).for_each(|(c, b)| c[2] = b);
        (self.populations, self.cells) = (populations, cells);
    }
}

/// Towards the equilibrium of Chu and Tai, none below zero and all together `rho` exactly.
fn collide(f: [f32; 9], rho: f32, row: &FlowRow) -> [f32; 9] {
    if rho <= 0.0 {
        return [0.0; 9];
    }
    let (mut ux, mut uy) = (0.0, 0.0);
    for k in 1..9 {
        ux += E[k][0] as f32 * f[k];
        uy += E[k][1] as f32 * f[k];
    }
    (ux, uy) = (ux / rho, uy / rho);
    let t = (rho / row.thin).clamp(0.0, 1.0);
    let psi = t * t * (3.0 - 2.0 * t);
    let mut out = [0.0; 9];
    let mut sum = 0.0;
    for k in 0..9 {
        let eu = E[k][0] as f32 * ux + E[k][1] as f32 * uy;
        let eq = W[k] * (rho + psi * (3.0 * eu + 4.5 * eu * eu - 1.5 * (ux * ux + uy * uy)));
        out[k] = (f[k] + row.relaxation * (eq - f[k])).max(0.0);
        sum += out[k];
    }
    let scale = if sum > 0.0 { rho / sum } else { 0.0 };
    out.map(|f| f * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    const N: u32 = 128;

    /// A wet disc of ink on paper that is open here and there.
    fn drop(row: FlowRow) -> Flow {
        let mut random = Pcg32::new(5, 5);
        let cells = (N * N) as usize;
        let open: Vec<f32> = (0..cells).map(|_| 0.3 + 0.6 * random.next_f32()).collect();
        let inside = |i: usize| {
            let (x, y) = ((i as u32 % N) as f32 - 63.5, (i as u32 / N) as f32 - 63.5);
            x * x + y * y < 16.0 * 16.0
        };
        let water: Vec<f32> = (0..cells).map(|i| if inside(i) { 1.0 } else { 0.0 }).collect();
        let ink: Vec<f32> = water.iter().map(|w| 0.7 * w).collect();
        Flow::new(row, &water, &ink, &open)
    }

    fn wet(flow: &Flow) -> usize {
        flow.cells().iter().filter(|c| c[0] > 1e-4).count()
    }

    /// Water that is there and that has evaporated, ink that flows and that is fixed: none is lost in 600 steps, and none is
    /// below nothing.
    #[test]
    fn water_and_ink_are_conserved() {
        let mut flow = drop(FlowRow::new([N; 2]));
        let [water, ink, _] = flow.sums();
        let first = wet(&flow);
        for _ in 0..600 {
            flow.step();
        }
        let [left, flowing, fixed] = flow.sums();
        let drift = [(left + flow.evaporated) / water - 1.0, (flowing + fixed) / ink - 1.0];
        println!("drift of water {:.1e}, of ink {:.1e}; wet {first} to {}", drift[0], drift[1], wet(&flow));
        assert!(drift.iter().all(|d| d.abs() < 1e-5), "{drift:?}");
        assert!(flow.cells().iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
        assert!(flow.populations.iter().flatten().all(|f| *f >= 0.0));
        assert!(fixed > 0.9 * ink, "it dries: {fixed} of {ink}");
    }

    /// Without the scaling to the exact density ink would be lost, and the test above would see it: here densities are off by
    /// one part in a thousand from the populations they stand for.
    #[test]
    fn densities_that_are_off_lose_ink() {
        let mut flow = drop(FlowRow::new([N; 2]));
        let [_, ink, _] = flow.sums();
        for _ in 0..50 {
            flow.cells.iter_mut().step_by(3).for_each(|c| c[0] *= 1.001);
            flow.step();
        }
        let [_, flowing, fixed] = flow.sums();
        assert!(((flowing + fixed) / ink - 1.0).abs() > 1e-4);
    }

    /// Pinning holds the front; without evaporation a drop spreads, and less the harder it is held.
    #[test]
    fn pinning_holds_the_front() {
        let spread = |pinning: f32| {
            let row = FlowRow {
                pinning,
                evaporation: 0.0,
                evaporation_at_front: 0.0,
                fixing: 0.0,
                ..FlowRow::new([N; 2])
            };
            let mut flow = drop(row);
            (0..300).for_each(|_| flow.step());
            wet(&flow)
        };
        let [free, held, hard] = [0.0, 0.1, 0.3].map(spread);
        println!("wet cells without pinning {free}, at .1 {held}, at .3 {hard}");
        assert!(free > held && held > hard && hard >= 793, "{free} {held} {hard}");
    }

    /// Water that leaves at the front takes ink there: the rim of a dried drop is darker than its middle.
    #[test]
    fn edges_dry_darker() {
        // On paper that holds its front hard.
        let mut flow =
            drop(FlowRow { pinning: 0.6, evaporation_at_front: 0.08, fixing: 0.02, ..FlowRow::new([N; 2]) });
        (0..600).for_each(|_| flow.step());
        let ring = |from: f32, to: f32| {
            let (mut sum, mut most) = (0.0, 0.0f32);
            let mut count = 0.0;
            for (i, c) in flow.cells().iter().enumerate() {
                let (x, y) = ((i as u32 % N) as f32 - 63.5, (i as u32 / N) as f32 - 63.5);
                let r = (x * x + y * y).sqrt();
                if (from..to).contains(&r) {
                    (sum, count, most) = (sum + c[1] + c[3], count + 1.0, most.max(c[1] + c[3]));
                }
            }
            sum / count
        };
        let middle = ring(0.0, 8.0);
        let rim = (10..40).map(|r| ring(r as f32, r as f32 + 2.0)).fold(0.0, f32::max);
        println!("middle {middle}, darkest ring {rim}");
        assert!(rim > 1.05 * middle, "{middle} {rim}");
    }
}
