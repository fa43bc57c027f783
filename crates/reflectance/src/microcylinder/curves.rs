//! The tangent curves of a fabric and the table that is made of them.

use super::Microcylinder;
use crate::model::{Model, ModelError};

// The table: a head; the straight pieces of curve of thread 1, then of thread 2, each one tangent, in blocks of
// four (4 × sin α, 4 × cos α, 4 × weight; unused lanes have weight 0); the sloped pieces (their ends as α, α,
// sin, sin, cos, cos, then weight); and blocks with the tangents the sampler mixes.
const STRAIGHT: usize = 0; // blocks of straight pieces, per thread
const SLOPED: usize = 2; // sloped pieces, per thread
const MIXED: usize = 4; // blocks of the sampler, per thread
pub const BOUND: usize = 6; // c of the physical form
pub const FIBRE: usize = 7; // per thread: albedo of a lone fibre at θ = 0 for A = 1: surface, volume lobe, volume flat
pub const HEAD: usize = 13;
pub const BLOCK: usize = 12;
pub const SLOPE: usize = 7;

/// A curve made ready: straight pieces as single tangents, sloped pieces by their ends, both with weights.
#[derive(Default)]
pub struct Curve {
    /// (α, weight)
    straight: Vec<(f64, f64)>,
    /// (α at its start, at its end, weight)
    sloped: Vec<(f64, f64, f64)>,
}

impl Curve {
    /// The curve through `offsets` (degrees): control values once each with equal weight, or the curve itself
    /// with weight by length. Pieces of no length are jumps.
    pub fn new(offsets: &[f32], lengths: &[f32], points: bool) -> Self {
        let mut curve = Self::default();
        let mut add = |offset: f64, weight: f64| match curve.straight.iter_mut().find(|(o, _)| *o == offset) {
            Some((_, w)) => *w += weight,
            None => curve.straight.push((offset, weight)),
        };
        let offsets: Vec<f64> = offsets.iter().map(|&o| f64::from(o).to_radians()).collect();
        if points || lengths.is_empty() {
            offsets.iter().for_each(|&o| add(o, 1.0 / offsets.len() as f64));
            return curve;
        }
        let total: f64 = lengths.iter().map(|&l| f64::from(l)).sum();
        for (ends, &length) in offsets.windows(2).zip(lengths) {
            let weight = f64::from(length) / total;
            if ends[0] == ends[1] {
                add(ends[0], weight);
            } else if weight > 0.0 {
                curve.sloped.push((ends[0].min(ends[1]), ends[0].max(ends[1]), weight));
            }
        }
        curve
    }

    /// The tangents the sampler mixes: sloped pieces in steps of at most γ_s, the width of the narrowest lobe, so
    /// that the mixture leaves no gaps; ends included, because some directions see nothing but an end.
    fn mixed(&self, gamma_s: f64) -> Vec<(f64, f64)> {
        let mut all = self.straight.clone();
        for &(from, to, weight) in &self.sloped {
            let n = ((to - from) / gamma_s).ceil() as usize;
            for i in 0..=n {
                let share = if i == 0 || i == n { 0.5 } else { 1.0 };
                all.push((from + (to - from) * i as f64 / n as f64, weight * share / n as f64));
            }
        }
        all
    }
}

/// Tangents (α, weight) in blocks of four.
fn push_blocks(table: &mut Vec<f32>, tangents: &[(f64, f64)]) -> usize {
    for four in tangents.chunks(4) {
        let mut block = [0.0; BLOCK];
        for lane in 0..4 {
            // Unused lanes repeat a tangent with weight 0, so that none divides zero by zero.
            let (offset, weight) = four.get(lane).copied().unwrap_or((four[0].0, 0.0));
            block[lane] = offset.sin() as f32;
            block[4 + lane] = offset.cos() as f32;
            block[8 + lane] = weight as f32;
        }
        table.extend(block);
    }
    tangents.len().div_ceil(4)
}

/// Straight pieces, sloped pieces and the sampler's tangents of a thread.
pub type Pieces<'a> = (&'a [[f32; BLOCK]], &'a [[f32; SLOPE]], &'a [[f32; BLOCK]]);

/// Those of thread `j` in the table.
#[inline(always)]
pub fn pieces(table: &[f32], j: usize) -> Pieces<'_> {
    fn two<'a, const N: usize>(slots: &'a [f32], counts: &[f32], j: usize) -> (&'a [[f32; N]], usize) {
        let (n1, n2) = (counts[0] as usize, counts[1] as usize);
        let all = slots[..N * (n1 + n2)].as_chunks::<N>().0;
        (if j == 0 { &all[..n1] } else { &all[n1..] }, N * (n1 + n2))
    }
    let slots = &table[HEAD..];
    let (straight, used) = two(slots, &table[STRAIGHT..], j);
    let slots = &slots[used..];
    let (sloped, used) = two(slots, &table[SLOPED..], j);
    (straight, sloped, two(&slots[used..], &table[MIXED..], j).0)
}

/// Offsets in degrees and lengths.
pub type Offsets<'a> = (&'a [f32], &'a [f32]);

/// Table data of the two threads: count, offsets in degrees, count − 1 lengths; then the same for thread 2.
pub fn curves(data: &[f32]) -> Result<[Offsets<'_>; 2], ModelError> {
    let bad = |problem: String| ModelError::BadTable { model: Microcylinder::NAME, problem };
    let mut rest = data;
    let mut curve = |j: usize| {
        let (&count, tail) = rest.split_first().ok_or_else(|| {
            bad(format!("has no tangent curve for thread {}; give count, offsets, lengths for both", j + 1))
        })?;
        if !(count.fract() == 0.0 && (1.0..=256.0).contains(&count)) {
            return Err(bad(format!("wants 1 to 256 tangent offsets for thread {}, got {count}", j + 1)));
        }
        let n = count as usize;
        if tail.len() < 2 * n - 1 {
            return Err(bad(format!(
                "needs {n} offsets and {} lengths for thread {}, but only {} numbers follow",
                n - 1,
                j + 1,
                tail.len()
            )));
        }
        let (offsets, tail) = tail.split_at(n);
        let (lengths, tail) = tail.split_at(n - 1);
        if let Some(x) = offsets.iter().find(|x| !(-90.0..=90.0).contains(*x)) {
            return Err(bad(format!(
                "wants tangent offsets within ±90 degrees, got {x} for thread {}",
                j + 1
            )));
        }
        let total: f32 = lengths.iter().sum();
        if lengths.iter().any(|&x| x < 0.0) || !total.is_finite() || (n > 1 && total <= 0.0) {
            return Err(bad(format!(
                "wants lengths ≥ 0 with a finite, positive sum for thread {}, got {lengths:?}",
                j + 1
            )));
        }
        rest = tail;
        Ok((offsets, lengths))
    };
    let both = [curve(0)?, curve(1)?];
    if rest.is_empty() {
        Ok(both)
    } else {
        Err(bad(format!("has {} numbers left over after both curves", rest.len())))
    }
}

/// The table of two threads but for what the head says of the whole; γ_s in degrees.
pub fn tabulate(curves: &[Curve; 2], gamma_s: [f32; 2]) -> Vec<f32> {
    let mut table = vec![0.0; HEAD];
    for (j, curve) in curves.iter().enumerate() {
        table[STRAIGHT + j] = push_blocks(&mut table, &curve.straight) as f32;
    }
    for (j, curve) in curves.iter().enumerate() {
        table[SLOPED + j] = curve.sloped.len() as f32;
        for &(from, to, weight) in &curve.sloped {
            table.extend([from, to, from.sin(), to.sin(), from.cos(), to.cos(), weight].map(|x| x as f32));
        }
    }
    for (j, curve) in curves.iter().enumerate() {
        let gamma_s = f64::from(gamma_s[j]).to_radians();
        table[MIXED + j] = push_blocks(&mut table, &curve.mixed(gamma_s)) as f32;
    }
    table
}
