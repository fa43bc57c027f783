//! What there is to fit in a model, found by probing it: no model is known by name here.

use super::{Reading, is_isotropic, r_sequence};
use glam::Vec3;
use std::collections::HashMap;
use std::f32::consts::TAU;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};
use yugen_optics::ColourSpace;
use yugen_optics::frame::spherical;
use yugen_reflectance::{Bsdf, Kind, Param, ParamType};

/// How a number in [0, 1] becomes a value within the range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ruler {
    Linear,
    /// Even in ln x: widths, indices.
    Log,
    /// Even in ln(1 + x): exponents that may be zero.
    LogFromZero,
}

impl Ruler {
    fn of(p: &Param) -> Self {
        match p.kind {
            ParamType::Number if p.min > 0.0 && p.max >= 8.0 * p.min => Self::Log,
            ParamType::Number if p.min == 0.0 && p.max >= 100.0 => Self::LogFromZero,
            _ => Self::Linear,
        }
    }

    fn value(self, min: f32, max: f32, u: f64) -> f32 {
        let (min, max) = (f64::from(min), f64::from(max));
        let value = match self {
            Self::Linear => min + (max - min) * u,
            Self::Log => min * (max / min).powf(u),
            Self::LogFromZero => (max.ln_1p() * u).exp_m1(),
        };
        (value as f32).clamp(min as f32, max as f32)
    }

    fn unit(self, min: f32, max: f32, value: f32) -> f64 {
        let (min, max, value) = (f64::from(min), f64::from(max), f64::from(value));
        let u = match self {
            Self::Linear => (value - min) / (max - min).max(f64::MIN_POSITIVE),
            Self::Log => (value / min).ln() / (max / min).ln(),
            Self::LogFromZero => value.ln_1p() / max.ln_1p(),
        };
        u.clamp(0.0, 1.0)
    }
}

/// A number in [0, 1] that a fit may move, and the slots it drives: several where they must be equal.
#[derive(Clone, Debug)]
pub struct Coordinate {
    pub lobe: usize,
    slots: Vec<usize>,
    min: f32,
    max: f32,
    ruler: Ruler,
    pub colour: bool,
}

impl Coordinate {
    fn value(&self, u: f64) -> f32 {
        self.ruler.value(self.min, self.max, u)
    }
}

type Memo = Arc<Mutex<HashMap<[u8; FEW], Arc<Vec<f32>>>>>;

/// Tables made from so few coordinates are interpolated between those at [`CELLS`] + 1 places along each: a table can
/// cost a thousand evaluations of its model. The last word on a fit has an exact one.
const FEW: usize = 3;
const CELLS: usize = 24;

#[derive(Clone, Debug)]
struct Term {
    kind: Kind,
    base: Vec<f32>,
    /// Coordinates, counted within the term, that the table is made from.
    bakes: Vec<usize>,
    /// The tables made so far. What it holds depends on the places only, not on who asked first.
    memo: Memo,
}

impl Term {
    /// The table for these slots, exactly.
    fn bake(&self, slots: &[f32]) -> Option<Arc<Vec<f32>>> {
        self.kind.bake(slots, &[]).ok().map(Arc::new)
    }

    /// The table at `u`, the coordinates of this term, between its neighbours on the grid.
    fn interpolated(&self, coordinates: &[Coordinate], u: &[f64]) -> Option<Arc<Vec<f32>>> {
        let mut table: Vec<f32> = Vec::new();
        for corner in 0..1usize << self.bakes.len() {
            let (mut key, mut share) = ([0; FEW], 1.0);
            let mut slots = self.base.clone();
            for (c, u) in coordinates.iter().zip(u) {
                c.slots.iter().for_each(|&s| slots[s] = c.value(*u));
            }
            for (k, &c) in self.bakes.iter().enumerate() {
                let x = u[c] * CELLS as f64;
                let cell = (x as usize).min(CELLS - 1);
                let up = corner >> k & 1;
                share *= if up == 1 { x - cell as f64 } else { 1.0 - (x - cell as f64) };
                key[k] = (cell + up) as u8;
                let value = coordinates[c].value((cell + up) as f64 / CELLS as f64);
                coordinates[c].slots.iter().for_each(|&s| slots[s] = value);
            }
            if share <= 0.0 {
                continue;
            }
            let known = self.memo.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
            let at_corner = match known {
                Some(table) => table,
                None => {
                    let made = self.bake(&slots)?;
                    self.memo.lock().unwrap_or_else(PoisonError::into_inner).insert(key, made.clone());
                    made
                }
            };
            table.resize(at_corner.len(), 0.0);
            table.iter_mut().zip(at_corner.iter()).for_each(|(t, v)| *t += share as f32 * v);
        }
        Some(Arc::new(table))
    }
}

/// A sum of models with its free coordinates.
#[derive(Clone, Debug)]
pub struct Space {
    terms: Vec<Term>,
    pub coordinates: Vec<Coordinate>,
    /// Coordinates of which one evaluation gives all derivatives: one, or the three channels of a colour that keep
    /// to themselves.
    pub groups: Vec<Range<usize>>,
    /// Whether a colour of it stands for a ground.
    pub has_ground: bool,
    /// Whether its lobes have a grain although they should not.
    pub has_grain: bool,
}

/// The model at one place, with what may be used again nearby.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Times cos θ_i, one a reading.
    pub values: Vec<Vec3>,
    pub tables: Vec<Arc<Vec<f32>>>,
    /// What the tables were made from.
    pub keys: Vec<Vec<f64>>,
}

/// Every combination of the named forms of a model, as slots; where there are more than 64, those that differ from
/// the defaults in one.
pub fn forms(kind: Kind, space: ColourSpace) -> Vec<Vec<f32>> {
    let mut all = vec![kind.defaults()];
    let mut at = 0;
    for p in kind.params() {
        if let ParamType::Choice(names) = p.kind {
            // The colour space is no form.
            let own = names.iter().position(|n| *n == space.name());
            let options: Vec<f32> = match own {
                Some(i) => vec![i as f32],
                None => (0..names.len()).map(|i| i as f32).collect(),
            };
            let vary = |slots: &Vec<f32>, v: f32| {
                let mut slots = slots.clone();
                slots[at] = v;
                slots
            };
            all = if all.len() * options.len() <= 64 {
                all.iter().flat_map(|slots| options.iter().map(|&v| vary(slots, v))).collect()
            } else {
                let first = all[0].clone();
                let more = options.iter().filter(|v| **v != first[at]).map(|&v| vary(&first, v));
                all.iter().cloned().chain(more).collect()
            };
        }
        at += p.width();
    }
    all
}

/// Pairs of directions a model is probed with; none so low that masking hides what is asked.
fn probes() -> Vec<Reading> {
    (0..48)
        .map(|i| {
            let [a, b, c, d] = r_sequence::<4>(i).map(|x| x as f32);
            let wo = spherical(1.1 * a, TAU * b);
            // Half of them near the mirror direction.
            let wi = if i % 2 == 0 {
                let near = spherical(0.5 * c * c, TAU * d);
                Vec3::new(near.x - wo.x, near.y - wo.y, wo.z.max(0.3)).normalize()
            } else {
                spherical(1.1 * c, TAU * d)
            };
            Reading { wo, wi, f: Vec3::ZERO, weight: 1.0 }
        })
        .collect()
}

/// Places inside the box, for probing.
const PLACES: usize = 3;

struct Prober {
    kind: Kind,
    form: Vec<f32>,
    pairs: Vec<Reading>,
}

impl Prober {
    fn params(&self) -> impl Iterator<Item = (usize, &'static Param)> {
        let mut at = 0;
        self.kind.params().iter().map(move |p| {
            at += p.width();
            (at - p.width(), p)
        })
    }

    /// The form with numbers and colours from well inside their ranges.
    fn inside(&self, place: usize) -> Vec<f32> {
        let mut slots = self.form.clone();
        for (at, p) in self.params().filter(|(_, p)| !matches!(p.kind, ParamType::Choice(_))) {
            for (k, slot) in slots[at..at + p.width()].iter_mut().enumerate() {
                let [_, x] = r_sequence::<2>(37 * place + at + k);
                *slot = Ruler::of(p).value(p.min, p.max, 0.2 + 0.6 * x);
            }
        }
        slots
    }

    fn with<T>(&self, slots: &[f32], look: impl Fn(&Bsdf) -> T) -> Option<T> {
        let table = self.kind.bake(slots, &[]).ok()?;
        Some(look(&Bsdf::new(self.kind, slots, &table)))
    }

    fn values(&self, slots: &[f32], table: &[f32]) -> Vec<Vec3> {
        let bsdf = Bsdf::new(self.kind, slots, table);
        self.pairs.iter().map(|r| bsdf.eval(r.wo, r.wi)).collect()
    }

    fn is_isotropic(&self, change: impl Fn(&mut [f32])) -> bool {
        (0..PLACES).all(|place| {
            let mut slots = self.inside(place);
            change(&mut slots);
            self.with(&slots, is_isotropic) == Some(true)
        })
    }
}

impl Space {
    /// The free coordinates of a model in one of its [`forms`]. With `isotropic`, a grain is taken from those that
    /// can do without: two widths become one, and what turns a round lobe into an oval one keeps its default.
    pub fn of(kind: Kind, form: &[f32], isotropic: bool) -> Option<Self> {
        let prober = Prober { kind, form: form.to_vec(), pairs: probes() };
        let numbers: Vec<(usize, &Param)> =
            prober.params().filter(|(_, p)| p.kind == ParamType::Number).collect();
        let default = |slots: &mut [f32], at: usize, p: &Param| slots[at] = p.default[0];
        let mut pinned = vec![false; form.len()];
        let (mut tied, mut has_grain) = (None, false);

        // What lets light through is no reflection.
        let transmits = |slots: &[f32]| prober.with(slots, |b| b.laws().transmits) == Some(true);
        for &(at, p) in &numbers {
            let mut slots = prober.inside(0);
            if transmits(&slots) {
                default(&mut slots, at, p);
                pinned[at] = !transmits(&slots);
            }
        }
        if isotropic && !prober.is_isotropic(|_| {}) {
            let pairs =
                numbers.iter().enumerate().flat_map(|(i, a)| numbers[i + 1..].iter().map(move |b| (a, b)));
            let alike = |a: &Param, b: &Param| a.min == b.min && a.max == b.max && a.unit == b.unit;
            tied = pairs
                .filter(|(a, b)| alike(a.1, b.1))
                .find(|(a, b)| prober.is_isotropic(|s| s[b.0] = s[a.0]))
                .map(|(a, b)| (a.0, b.0));
            if tied.is_none() {
                has_grain = true;
                // A strength, off by default; a roughness of one would make round lobes too.
                let mut off = numbers.iter().filter(|(_, p)| p.default[0] == p.min);
                let round = off.find(|(at, p)| prober.is_isotropic(|s| default(s, *at, p)));
                if let Some((at, _)) = round {
                    pinned[*at] = true;
                    has_grain = false;
                }
            }
        }
        let settle = |slots: &mut [f32]| {
            numbers.iter().filter(|(at, _)| pinned[*at]).for_each(|(at, p)| default(slots, *at, p));
            if let Some((a, b)) = tied {
                slots[b] = slots[a];
            }
        };

        // What does nothing in this form, or what another does too, is left out; what the table is made from is noted.
        let mut bakes = Vec::new();
        let (mut coordinates, mut groups, mut has_ground) = (Vec::new(), Vec::new(), false);
        let places: Vec<(Vec<f32>, Vec<f32>, Vec<Vec3>)> = (0..PLACES)
            .map(|place| {
                let mut slots = prober.inside(place);
                settle(&mut slots);
                let table = kind.bake(&slots, &[]).ok()?;
                let values = prober.values(&slots, &table);
                Some((slots, table, values))
            })
            .collect::<Option<_>>()?;
        let mut slopes_before: Vec<Vec<Vec<f64>>> = Vec::new();
        for (at, p) in prober.params() {
            if matches!(p.kind, ParamType::Choice(_)) || pinned[at] || tied.is_some_and(|(_, b)| b == at) {
                continue;
            }
            let ruler = Ruler::of(p);
            let driven = |k: usize| match tied {
                Some((a, b)) if a == at => vec![a, b],
                _ => vec![at + k],
            };
            let moved = |slots: &[f32], channels: Range<usize>, by: f64| {
                let mut slots = slots.to_vec();
                for k in channels {
                    let u = ruler.unit(p.min, p.max, slots[at + k]);
                    driven(k).into_iter().for_each(|s| slots[s] = ruler.value(p.min, p.max, u + by));
                }
                slots
            };
            let all = 0..p.width();
            let (slots, table, _) = &places[0];
            let other = kind.bake(&moved(slots, all.clone(), 0.1), &[]).ok()?;
            let in_table = other != *table;
            let at_slots = |slots: &[f32], old: &[f32]| {
                if in_table {
                    kind.bake(slots, &[]).ok().map(|t| prober.values(slots, &t))
                } else {
                    Some(prober.values(slots, old))
                }
            };
            let inert = places.iter().all(|(slots, table, values)| {
                at_slots(&moved(slots, all.clone(), 0.15), table).is_none_or(|v| v == *values)
            });
            if inert {
                continue;
            }
            if p.kind == ParamType::Number {
                // Central differences, whose direction is right to second order.
                let slopes: Vec<Vec<f64>> = places[..2]
                    .iter()
                    .map(|(slots, table, _)| {
                        let up = at_slots(&moved(slots, 0..1, 5e-3), table)?;
                        let down = at_slots(&moved(slots, 0..1, -5e-3), table)?;
                        let d = up.iter().zip(&down).flat_map(|(a, b)| (*a - *b).to_array());
                        Some(d.map(f64::from).collect())
                    })
                    .collect::<Option<_>>()?;
                if slopes_before.iter().any(|b| b.iter().zip(&slopes).all(|(a, b)| parallel(a, b))) {
                    continue;
                }
                slopes_before.push(slopes);
            }
            let first = coordinates.len();
            if in_table {
                bakes.extend(first..first + p.width());
            }
            let colour = p.kind == ParamType::Rgb;
            coordinates.extend(all.clone().map(|k| Coordinate {
                lobe: 0,
                slots: driven(k),
                min: p.min,
                max: p.max,
                ruler,
                colour,
            }));
            let apart = colour
                && all.clone().all(|k| {
                    let (slots, table, values) = &places[0];
                    let changed = at_slots(&moved(slots, k..k + 1, 0.1), table);
                    changed.is_some_and(|v| {
                        v.iter().zip(values).all(|(a, b)| (0..3).all(|c| c == k || a[c] == b[c]))
                    })
                });
            if apart {
                groups.push(first..first + 3);
                has_ground |= places.iter().all(|(slots, table, values)| {
                    let up = at_slots(&moved(slots, all.clone(), 0.1), table).unwrap_or_default();
                    let d: Vec<f32> = up.iter().zip(values).map(|(a, b)| (a.y - b.y).abs()).collect();
                    let largest = d.iter().fold(0.0f32, |a, b| a.max(*b));
                    !d.is_empty() && d.iter().all(|d| *d > 0.02 * largest)
                });
            } else {
                groups.extend((0..p.width()).map(|k| first + k..first + k + 1));
            }
        }
        let mut base = kind.defaults();
        for (at, p) in prober.params() {
            if matches!(p.kind, ParamType::Choice(_)) {
                base[at] = form[at];
            }
        }
        let terms = vec![Term { kind, base, bakes, memo: Memo::default() }];
        Some(Self { terms, coordinates, groups, has_ground, has_grain })
    }

    /// This and the terms of `other`, added up.
    pub fn plus(mut self, other: &Self) -> Self {
        let (lobes, first) = (self.terms.len(), self.coordinates.len());
        self.terms.extend(other.terms.iter().cloned());
        self.coordinates
            .extend(other.coordinates.iter().cloned().map(|c| Coordinate { lobe: c.lobe + lobes, ..c }));
        self.groups.extend(other.groups.iter().map(|g| g.start + first..g.end + first));
        self.has_ground |= other.has_ground;
        self
    }

    /// The first term alone.
    pub fn first(&self) -> Self {
        let own = self.coordinates.iter().filter(|c| c.lobe == 0).count();
        Self {
            terms: self.terms[..1].to_vec(),
            coordinates: self.coordinates[..own].to_vec(),
            groups: self.groups.iter().filter(|g| g.end <= own).cloned().collect(),
            ..*self
        }
    }

    /// Kind and slots of each term at `u`.
    pub fn terms(&self, u: &[f64]) -> Vec<(Kind, Vec<f32>)> {
        let mut terms: Vec<_> = self.terms.iter().map(|t| (t.kind, t.base.clone())).collect();
        for (c, u) in self.coordinates.iter().zip(u) {
            c.slots.iter().for_each(|&s| terms[c.lobe].1[s] = c.value(*u));
        }
        terms
    }

    /// Where the parameters of a term are `slots`; the coordinates of the other terms stay as they are.
    pub fn put(&self, u: &mut [f64], lobe: usize, slots: &[f32]) {
        for (c, u) in self.coordinates.iter().zip(u) {
            if c.lobe == lobe {
                *u = c.ruler.unit(c.min, c.max, slots[c.slots[0]]);
            }
        }
    }

    /// The slots of a term where no one has moved it.
    pub fn base(&self, lobe: usize) -> &[f32] {
        &self.terms[lobe].base
    }

    /// Whether a table has to be made anew at almost every step.
    pub fn is_costly(&self) -> bool {
        self.terms.iter().any(|t| t.bakes.len() > FEW)
    }

    /// Evaluates all readings at `u`; false where the model cannot be made or is not finite. Tables are made again
    /// only where what they depend on has changed, and interpolated unless they must be `exact`.
    pub fn values(&self, u: &[f64], readings: &[Reading], exact: bool, point: &mut Point) -> bool {
        let slots = self.terms(u);
        point.keys.resize(slots.len(), vec![f64::NAN]);
        point.tables.resize(slots.len(), Arc::default());
        let mut first = 0;
        for (i, ((_, slots), term)) in slots.iter().zip(&self.terms).enumerate() {
            let n = self.coordinates.iter().filter(|c| c.lobe == i).count();
            let (own, u) = (&self.coordinates[first..first + n], &u[first..first + n]);
            first += n;
            let mut key: Vec<f64> = term.bakes.iter().map(|&c| u[c]).collect();
            key.push(f64::from(u8::from(exact)));
            if point.keys[i] != key {
                let smooth = !exact && (1..=FEW).contains(&term.bakes.len());
                let table = if smooth { term.interpolated(own, u) } else { term.bake(slots) };
                let Some(table) = table else {
                    point.keys[i] = vec![f64::NAN];
                    return false;
                };
                point.tables[i] = table;
                point.keys[i] = key;
            }
        }
        let lobes: Vec<Bsdf> = slots
            .iter()
            .zip(&point.tables)
            .map(|((kind, slots), table)| Bsdf::new(*kind, slots, table))
            .collect();
        point.values.clear();
        point
            .values
            .extend(readings.iter().map(|r| lobes.iter().map(|b| b.eval(r.wo, r.wi)).sum::<Vec3>() * r.wi.z));
        point.values.iter().all(|v| v.is_finite())
    }
}

/// Whether two columns point the same or the opposite way. Two indices of refraction that act by their ratio only
/// reach 1.5e-5 by their finite steps; the nearest that are not the same, 1e-4.
fn parallel(a: &[f64], b: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(a, b).powi(2) > (1.0 - 5e-5) * dot(a, a) * dot(b, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str, isotropic: bool) -> Space {
        let kind = Kind::from_name(name).unwrap();
        Space::of(kind, &kind.defaults(), isotropic).unwrap()
    }

    #[test]
    fn a_grain_is_offered_only_to_what_has_one() {
        for (name, round, oval) in [("ward", 7, 8), ("ashikhmin_shirley", 7, 8), ("ggx", 4, 5), ("noh", 7, 8)]
        {
            assert_eq!(
                (of(name, true).coordinates.len(), of(name, false).coordinates.len()),
                (round, oval),
                "{name}"
            );
        }
        // The azimuth of a grain means nothing without one.
        let (round, oval) = (of("metallic_roughness", true), of("metallic_roughness", false));
        assert_eq!(oval.coordinates.len() - round.coordinates.len(), 2);
        let roughness = Kind::MetallicRoughness.param("roughness").unwrap().0;
        assert!(round.coordinates.iter().any(|c| c.slots == [roughness]));
    }

    #[test]
    fn what_does_nothing_or_the_same_as_another_is_left_out() {
        // Colour, exponent; the form radiance or normalised is a choice.
        assert_eq!(of("blinn_phong", true).coordinates.len(), 4);
        // Two indices of refraction act by their ratio.
        let plastic = of("rough_plastic", true);
        assert_eq!(plastic.coordinates.len(), 1 + 3 + 3 + 1);
        assert!(plastic.has_ground && of("lambert", true).has_ground && !of("ggx", true).has_ground);
        // Light that goes through is not fitted to reflection.
        let principled = of("principled", true);
        let kind = Kind::Principled;
        let (at, _) = kind.param("spec_trans").unwrap();
        assert!(principled.coordinates.iter().all(|c| !c.slots.contains(&at)));
    }

    #[test]
    fn rulers_lead_there_and_back() {
        for (ruler, min, max) in
            [(Ruler::Linear, 0.0, 3.0), (Ruler::Log, 0.01, 1.0), (Ruler::LogFromZero, 0.0, 2000.0)]
        {
            for k in 0..=10 {
                let u = f64::from(k) / 10.0;
                let v = ruler.value(min, max, u);
                assert!((min..=max).contains(&v) && (ruler.unit(min, max, v) - u).abs() < 1e-6);
            }
        }
    }
}
