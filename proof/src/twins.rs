//! One model, two languages: the WGSL of a model against its Rust.
//!
//! [`validate`] and [`layout`] need no GPU; [`Trial::run`] runs one dispatch of as many models as wanted and compares
//! values.

use crate::gpu::{Gpu, GpuError};
use crate::laws::edge_directions;
use crate::{Parameters, parameter_sets};
use glam::Vec3;
use std::fmt;
use wgpu::naga;
use yugen_optics::distribution::ONE_MINUS_EPSILON;
use yugen_optics::frame::mirror;
use yugen_optics::random::Pcg32;
use yugen_optics::warp::{uniform_hemisphere, uniform_sphere};
use yugen_reflectance::{Bsdf, Kind, MAX_SLOTS, ParamType, Sample};

/// Cases of one model in a whole comparison.
pub const CASES: usize = 8192;
/// Floats a case takes in the input.
const STRIDE: usize = 13;
/// Floats that come of it.
const FOUND: usize = 16;
/// Share of cases that may choose another lobe or another cell of a table: an input on the edge between two.
pub const MAX_DISAGREEMENT: f32 = 1e-3;

/// The rim of the unit disc lifts to sqrt(1 - r²): one rounding of r moves the cosine by as much as this.
const HORIZON: f32 = 1e-3;

/// What a twin does wrong.
#[derive(Clone, Debug, thiserror::Error)]
pub enum TwinError {
    /// Rust offers nothing to compare with.
    #[error("{0}: {1}")]
    NoSubject(&'static str, String),
    /// The shader does not parse or validate.
    #[error("the WGSL of {0} is not valid: {1}")]
    Invalid(&'static str, String),
    /// The struct or its loader does not follow the parameter table.
    #[error("the WGSL struct of {0} does not follow its parameter table: {1}")]
    Layout(&'static str, String),
    /// The device refused it.
    #[error("{0}: {1}")]
    Gpu(&'static str, GpuError),
}

/// Where two values differ most.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Worst {
    /// (|a − b| − slack) / (max(|a|, |b|) + floor / rel): to be at most `rel`. Slack is what a rounding of the
    /// inputs changes on the CPU, four times; infinite where a value is not finite.
    pub error: f32,
    /// Inputs and both values, for people.
    pub at: String,
}

impl Worst {
    fn see(&mut self, error: f32, at: impl FnOnce() -> String) {
        let error = if error.is_nan() { f32::INFINITY } else { error };
        if error > self.error {
            *self = Self { error, at: at() };
        }
    }
}

/// Errors of one twin on one adapter: a row of the table in the manual.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinRow {
    /// Which model.
    pub kind: Kind,
    /// How many cases.
    pub cases: usize,
    /// Of f.
    pub eval: Worst,
    /// Of the density.
    pub pdf: Worst,
    /// Of the drawn direction, as a distance.
    pub direction: Worst,
    /// Of the density that comes with a draw, against `pdf` of that very direction.
    pub sample_pdf: Worst,
    /// Of the weight of a draw, against f cos / pdf of that very direction.
    pub weight: Worst,
    /// Of the relative index of refraction that a draw crosses.
    pub eta: Worst,
    /// Of the albedo.
    pub albedo: Worst,
    /// Cases per case that chose another lobe, or lie so near an edge that a few roundings explain the rest.
    pub disagreement: f32,
    /// The first of those, for people.
    pub disagreed: String,
    /// Tolerance of the model: relative, floor.
    pub tolerance: (f32, f32),
}

impl TwinRow {
    /// The largest error of all.
    pub fn worst(&self) -> &Worst {
        self.errors().into_iter().max_by(|a, b| a.error.total_cmp(&b.error)).expect("seven errors")
    }

    fn errors(&self) -> [&Worst; 7] {
        [&self.eval, &self.pdf, &self.direction, &self.sample_pdf, &self.weight, &self.eta, &self.albedo]
    }

    /// Whether the twin is one.
    pub fn passed(&self) -> bool {
        self.cases > 0 && self.worst().error <= self.tolerance.0 && self.disagreement <= MAX_DISAGREEMENT
    }

    /// Head of the table that [`fmt::Display`] writes the rows of.
    pub const HEAD: &'static str = "model                      eval     pdf      wi       wi pdf   weight   index    albedo   lobes    allowed";
}

impl fmt::Display for TwinRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<26}", self.kind.name())?;
        for w in self.errors() {
            write!(f, " {:<8.1e}", w.error)?;
        }
        write!(f, " {:<8.1e} {:.1e}", self.disagreement, self.tolerance.0)?;
        if self.passed() {
            return Ok(());
        }
        let lobes = self.disagreement > MAX_DISAGREEMENT;
        write!(f, "\n  FAIL {}", if lobes { &self.disagreed } else { &self.worst().at })
    }
}

/// Accessors that a program must supply to the library. Tables are read where they lie; the row of the parameters is
/// copied first, so that the shader reads it once and not once for every model and function.
const HARNESS: &str = "
@group(0) @binding(0) var<storage, read> params: array<f32>;
@group(0) @binding(1) var<storage, read> tables: array<f32>;
@group(0) @binding(2) var<storage, read> cases: array<f32>;
@group(0) @binding(3) var<storage, read_write> results: array<f32>;
var<private> row: array<f32, MAX_SLOTS>;
fn param_at(i: u32) -> f32 { return row[i]; }
fn table_at(i: u32) -> f32 { return tables[i]; }
fn vec3_at(i: u32) -> vec3<f32> { return vec3<f32>(cases[i], cases[i + 1u], cases[i + 2u]); }
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x * 13u;
    // The second test only keeps the binding in the layout of models without a table.
    if (i >= arrayLength(&cases) || arrayLength(&tables) == 0u) { return; }
    let wo = vec3_at(i);
    let wi = vec3_at(i + 3u);
    let u = vec3_at(i + 6u);
    let p = bitcast<u32>(cases[i + 9u]);
    let t = bitcast<u32>(cases[i + 10u]);
    let kind = bitcast<u32>(cases[i + 11u]);
    let slots = bitcast<u32>(cases[i + 12u]);
    for (var k = 0u; k < slots; k++) { row[k] = params[p + k]; }
    let f = bsdf_eval_pdf(kind, 0u, t, wo, wi);
    let s = bsdf_sample(kind, 0u, t, wo, u);
    let a = bsdf_albedo(kind, 0u, t);
    let o = id.x * 16u;
    results[o] = f.x;
    results[o + 1u] = f.y;
    results[o + 2u] = f.z;
    results[o + 3u] = f.w;
    results[o + 4u] = s.wi.x;
    results[o + 5u] = s.wi.y;
    results[o + 6u] = s.wi.z;
    results[o + 7u] = s.pdf;
    results[o + 8u] = s.weight.x;
    results[o + 9u] = s.weight.y;
    results[o + 10u] = s.weight.z;
    results[o + 11u] = f32(s.is_delta);
    results[o + 12u] = s.eta;
    results[o + 13u] = a.x;
    results[o + 14u] = a.y;
    results[o + 15u] = a.z;
}
";

/// The library with accessors and an entry point, ready for naga or a device.
fn program(library: &str) -> String {
    format!("const MAX_SLOTS: u32 = {MAX_SLOTS}u;\n{HARNESS}{library}")
}

/// Parses and validates the shader library of a model (or a text that stands for it).
pub fn validate(kind: Kind, library: &str) -> Result<naga::Module, TwinError> {
    let source = program(library);
    let invalid = |e: String| TwinError::Invalid(kind.name(), e);
    let module = naga::front::wgsl::parse_str(&source).map_err(|e| invalid(e.emit_to_string(&source)))?;
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(&module)
        .map_err(|e| invalid(e.emit_to_string(&source)))?;
    Ok(module)
}

/// The struct of the model in `library` has the members of the parameter table, in order, with their types,
/// and its loader reads the slots one after the other.
pub fn layout(kind: Kind, library: &str) -> Result<(), TwinError> {
    let module = validate(kind, library)?;
    let wrong = |e: String| TwinError::Layout(kind.name(), e);
    let loader = format!("{}_load", kind.name());
    let (_, load) = module
        .functions
        .iter()
        .find(|(_, f)| f.name.as_deref() == Some(&loader))
        .ok_or_else(|| wrong(format!("there is no function {loader}")))?;
    let ty = load.result.as_ref().map(|r| &module.types[r.ty].inner);
    let Some(naga::TypeInner::Struct { members, .. }) = ty else {
        return Err(wrong(format!("{loader} returns no struct")));
    };
    let expected: Vec<(String, String)> =
        kind.params().iter().map(|p| (p.name.to_string(), wgsl_type(p.kind).to_string())).collect();
    let found: Vec<(String, String)> = members
        .iter()
        .map(|m| (m.name.clone().unwrap_or_default(), type_name(&module.types[m.ty].inner).to_string()))
        .collect();
    if expected != found {
        return Err(wrong(format!("expected {expected:?}, found {found:?}")));
    }
    // The loader calls `param_at(p + n)` for n = 0, 1, 2, …
    let read: Vec<Option<u32>> = load
        .body
        .iter()
        .filter_map(|s| match s {
            naga::Statement::Call { function, arguments, .. }
                if module.functions[*function].name.as_deref() == Some("param_at") =>
            {
                Some(offset(load, arguments[0]))
            }
            _ => None,
        })
        .collect();
    let slots: Vec<Option<u32>> = (0..kind.slots() as u32).map(Some).collect();
    if read != slots {
        return Err(wrong(format!("{loader} reads the slots {read:?}")));
    }
    Ok(())
}

fn wgsl_type(kind: ParamType) -> &'static str {
    match kind {
        ParamType::Number => "f32",
        ParamType::Rgb => "vec3<f32>",
        ParamType::Choice(_) => "u32",
    }
}

fn type_name(inner: &naga::TypeInner) -> &'static str {
    match inner {
        naga::TypeInner::Scalar(naga::Scalar::F32) => "f32",
        naga::TypeInner::Scalar(naga::Scalar::U32) => "u32",
        naga::TypeInner::Vector { size: naga::VectorSize::Tri, scalar: naga::Scalar::F32 } => "vec3<f32>",
        _ => "another type",
    }
}

/// n of the expression `p + n`, where p is the first argument.
fn offset(function: &naga::Function, at: naga::Handle<naga::Expression>) -> Option<u32> {
    use naga::{BinaryOperator, Expression, Literal};
    let Expression::Binary { op: BinaryOperator::Add, left, right } = function.expressions[at] else {
        return None;
    };
    match (&function.expressions[left], &function.expressions[right]) {
        (Expression::FunctionArgument(0), Expression::Literal(Literal::U32(n))) => Some(*n),
        _ => None,
    }
}

struct Case {
    set: usize,
    wo: Vec3,
    wi: Vec3,
    u: Vec3,
}

/// Corners and random sets, directions at the normal, oblique, grazing, below the horizon, alike and in the
/// lobe, uniforms at their ends.
fn cases(sets: &[Parameters], count: usize) -> Vec<Case> {
    let mut rng = Pcg32::new(3, 0x7477);
    let edges: Vec<Vec3> = edge_directions().into_iter().filter(|w| w.z.abs() > 1e-3).collect();
    let ends = [0.0, ONE_MINUS_EPSILON];
    (0..count)
        .map(|i| {
            let index = i % sets.len();
            let set = &sets[index];
            let transmits = set.bsdf().laws().transmits;
            let mut direction = |choice: u32| match choice {
                0 => edges[rng.next_u32() as usize % edges.len()],
                1 => Vec3::Z,
                2 if transmits => uniform_sphere(rng.next_vec3().truncate()),
                _ => uniform_hemisphere(rng.next_vec3().truncate()),
            };
            let round = (i / sets.len()) as u32;
            let wo = direction(if round.is_multiple_of(5) { 0 } else { 2 + u32::from(round % 7 == 1) });
            let other = direction(if round.is_multiple_of(3) { 0 } else { 2 });
            let mut u = rng.next_vec3();
            if round % 6 == 3 {
                u = Vec3::from_array(
                    u.to_array().map(|v| if v < 0.5 { ends[usize::from(v < 0.25)] } else { v }),
                );
            }
            let wi = match round % 4 {
                // Half of the directions lie in the lobe, where there is something to compare.
                0 | 1 => set.bsdf().sample(wo, rng.next_vec3()).map_or(other, |s| s.wi),
                2 if round % 16 == 2 => wo,
                2 if round % 16 == 6 => mirror(wo),
                _ => other,
            };
            Case { set: index, wo, wi, u }
        })
        .collect()
}

/// Steps by which an input is moved to see what its rounding does: a drawn direction is the difference of two
/// vectors and so carries the roundings of both.
const STEPS: f32 = 2.0;

/// Steps within which the edge of a table's cell may move a case to its neighbour: errors of the built-in
/// functions of WGSL on angles.
const EDGE_STEPS: f32 = 64.0;

/// The neighbours of `v`, `steps` roundings of a unit length away, on the sphere.
fn nudged(v: Vec3, steps: f32) -> [Vec3; 4] {
    let e = steps * f32::EPSILON;
    let [a, b] =
        if v.z.abs() < 0.9 { [v.cross(Vec3::Z), v.cross(v.cross(Vec3::Z))] } else { [Vec3::X, Vec3::Y] }
            .map(Vec3::normalize);
    [v + a * e, v - a * e, v + b * e, v - b * e]
}

/// Four times the largest change of `g` over neighbours of its inputs: what no arithmetic in f32 can avoid.
fn slack<const N: usize>(here: [f32; N], neighbours: impl Iterator<Item = [f32; N]>) -> f32 {
    4.0 * neighbours
        .flat_map(|there| (0..N).map(move |k| (there[k] - here[k]).abs()).collect::<Vec<_>>())
        .filter(|d| d.is_finite())
        .fold(0.0, f32::max)
}

fn error<const N: usize>(
    cpu: [f32; N],
    gpu: [f32; N],
    slack: impl FnOnce() -> f32,
    (rel, floor): (f32, f32),
) -> f32 {
    if cpu.iter().chain(&gpu).any(|v| !v.is_finite()) {
        return f32::INFINITY;
    }
    let difference = cpu.iter().zip(&gpu).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    if difference == 0.0 {
        return 0.0;
    }
    let scale = cpu.iter().chain(&gpu).map(|v| v.abs()).fold(0.0, f32::max);
    (difference - slack()).max(0.0) / (scale + floor / rel)
}

/// The error of a case; `None` where it lies at an edge, so that a few roundings explain the difference.
fn judge<const N: usize>(
    cpu: [f32; N],
    gpu: [f32; N],
    slack: impl Fn(f32) -> f32,
    tolerance: (f32, f32),
) -> Option<f32> {
    let strict = error(cpu, gpu, || slack(STEPS), tolerance);
    let edge = strict > tolerance.0 && error(cpu, gpu, || slack(EDGE_STEPS), tolerance) <= tolerance.0;
    (!edge).then_some(strict)
}

/// Models with the parameters and inputs on which their twins are tried.
pub struct Trial {
    subjects: Vec<Subject>,
    /// Rows of all sets, all their tables, all cases: what the shader reads.
    params: Vec<f32>,
    tables: Vec<f32>,
    input: Vec<f32>,
}

struct Subject {
    kind: Kind,
    sets: Vec<Parameters>,
    cases: Vec<Case>,
}

impl Trial {
    /// `count` cases (a multiple of 64) for each of `kinds`; `data` is what [`Kind::bake`] takes.
    pub fn new(kinds: &[Kind], data: impl Fn(Kind) -> Vec<f32>, count: usize) -> Result<Self, TwinError> {
        // What the smallest device of WebGPU binds is a third more.
        const MAX_TABLES: usize = 24 << 20;
        let (mut params, mut tables, mut input) = (Vec::new(), Vec::new(), Vec::new());
        let mut subjects = Vec::new();
        for &kind in kinds {
            let sets =
                parameter_sets(kind, &data(kind), 24).map_err(|e| TwinError::NoSubject(kind.name(), e))?;
            // Equal tables are stored once; sets beyond what the device binds are left out, the first excepted.
            let mut places: Vec<(u32, u32)> = Vec::new();
            let mut kept: Vec<Parameters> = Vec::new();
            for set in sets {
                let known = kept.iter().position(|k| k.table == set.table).map(|i| places[i].1);
                if known.is_none() && !kept.is_empty() && tables.len() + set.table.len() > MAX_TABLES {
                    continue;
                }
                places.push((params.len() as u32, known.unwrap_or(tables.len() as u32)));
                params.extend(&set.slots);
                if known.is_none() {
                    tables.extend(&set.table);
                }
                kept.push(set);
            }
            let cases = cases(&kept, count);
            for c in &cases {
                let (p, t) = places[c.set];
                input.extend([c.wo, c.wi, c.u].into_iter().flat_map(|v| v.to_array()));
                input.extend([p, t, kind as u32, kind.slots() as u32].map(f32::from_bits));
            }
            subjects.push(Subject { kind, sets: kept, cases });
        }
        Ok(Self { subjects, params, tables, input })
    }

    /// Runs `library`, which holds the twins (or texts that stand for them), in one shader; a row for each model.
    pub fn run(&self, gpu: &Gpu, library: &str) -> Result<Vec<TwinRow>, TwinError> {
        let name = self.subjects.first().map_or("no model", |s| s.kind.name());
        let cases = self.input.len() / STRIDE;
        let nan = vec![f32::NAN; FOUND * cases];
        let groups = cases.div_ceil(64) as u32;
        let output = gpu
            .compute(&program(library), &[&self.params, &self.tables, &self.input], &nan, groups)
            .map_err(|e| TwinError::Gpu(name, e))?;
        let mut rest = output.as_slice();
        let rows = self.subjects.iter().map(|s| {
            let (own, after) = rest.split_at(FOUND * s.cases.len());
            rest = after;
            row(s, own)
        });
        Ok(rows.collect())
    }
}

/// Runs `library`, which stands for the twin of `kind`, against Rust. `data` is what [`Kind::bake`] takes.
pub fn compare(gpu: &Gpu, kind: Kind, library: &str, data: &[f32]) -> Result<TwinRow, TwinError> {
    validate(kind, library)?;
    let trial = Trial::new(&[kind], |_| data.to_vec(), CASES)?;
    Ok(trial.run(gpu, library)?.remove(0))
}

/// What Rust says to `output`, [`FOUND`] numbers a case.
fn row(subject: &Subject, output: &[f32]) -> TwinRow {
    let Subject { kind, sets, cases } = subject;
    let kind = *kind;
    let tolerance = kind.twin_tolerance();
    let mut row = TwinRow {
        kind,
        cases: cases.len(),
        eval: Worst::default(),
        pdf: Worst::default(),
        direction: Worst::default(),
        sample_pdf: Worst::default(),
        weight: Worst::default(),
        eta: Worst::default(),
        albedo: Worst::default(),
        disagreement: 0.0,
        disagreed: String::new(),
        tolerance,
    };
    let mut disagreements = Vec::new();
    for (c, out) in cases.iter().zip(output.chunks_exact(FOUND)) {
        let set = &sets[c.set];
        let bsdf = set.bsdf();
        let gpu_sample = Sample {
            wi: Vec3::from_slice(&out[4..7]),
            pdf: out[7],
            weight: Vec3::from_slice(&out[8..11]),
            delta: out[11] != 0.0,
            eta: out[12],
        };
        let place = || format!("{} wo = {}, wi = {}, u = {}", set.label, c.wo, c.wi, c.u);
        // All parameters a rounding larger, or smaller.
        let scaled = [1.0 + f32::EPSILON, 1.0 - f32::EPSILON].map(|e| {
            let mut slots = set.slots.clone();
            let mut at = 0;
            for p in kind.params() {
                if !matches!(p.kind, ParamType::Choice(_)) {
                    slots[at..at + p.width()].iter_mut().for_each(|s| *s *= e);
                }
                at += p.width();
            }
            slots
        });
        let nearby = |steps: f32| {
            nudged(c.wo, steps)
                .into_iter()
                .map(|wo| (bsdf, wo, c.wi))
                .chain(nudged(c.wi, steps).into_iter().map(|wi| (bsdf, c.wo, wi)))
                .chain(scaled.iter().map(|slots| (Bsdf::new(kind, slots, &set.table), c.wo, c.wi)))
        };

        let (f, g) = (bsdf.eval(c.wo, c.wi).to_array(), [out[0], out[1], out[2]]);
        let slop = |steps| slack(f, nearby(steps).map(|(b, wo, wi)| b.eval(wo, wi).to_array()));
        let note = || format!("eval, {}: Rust {f:?}, WGSL {g:?}", place());
        match judge(f, g, slop, tolerance) {
            Some(e) => row.eval.see(e, note),
            None => disagreements.push(note()),
        }

        let (f, g) = ([bsdf.pdf(c.wo, c.wi)], [out[3]]);
        let slop = |steps| slack(f, nearby(steps).map(|(b, wo, wi)| [b.pdf(wo, wi)]));
        let note = || format!("pdf, {}: Rust {f:?}, WGSL {g:?}", place());
        match judge(f, g, slop, tolerance) {
            Some(e) => row.pdf.see(e, note),
            None => disagreements.push(note()),
        }

        let (f, g) = (bsdf.albedo().to_array(), [out[13], out[14], out[15]]);
        let slop = |steps| slack(f, nearby(steps).map(|(b, ..)| b.albedo().to_array()));
        let note = || format!("albedo, {}: Rust {f:?}, WGSL {g:?}", place());
        match judge(f, g, slop, tolerance) {
            Some(e) => row.albedo.see(e, note),
            None => disagreements.push(note()),
        }

        let cpu_sample = bsdf.sample(c.wo, c.u);
        if !(out[4..13].iter().all(|v| v.is_finite())) {
            row.direction.see(f32::INFINITY, || format!("sample, {}: WGSL {gpu_sample:?}", place()));
            continue;
        }
        let differ = || format!("sample, {}: Rust {cpu_sample:?}, WGSL {gpu_sample:?}", place());
        let s = match cpu_sample {
            None if gpu_sample.pdf == 0.0 => continue,
            Some(s) if gpu_sample.pdf > 0.0 && s.delta == gpu_sample.delta => s,
            // One of them rounded over the horizon.
            Some(s) if gpu_sample.pdf == 0.0 && s.wi.z.abs() < HORIZON => continue,
            None if gpu_sample.wi.z.abs() < HORIZON => continue,
            _ => {
                disagreements.push(differ());
                continue;
            }
        };
        // The same direction up to rounding, or up to what one step of the inputs does to it; else another lobe.
        let steps = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|a| [a, -a]);
        let neighbours = steps
            .map(|a| {
                bsdf.sample(c.wo, (c.u + a * f32::EPSILON).clamp(Vec3::ZERO, Vec3::splat(ONE_MINUS_EPSILON)))
            })
            .chain(nudged(c.wo, STEPS).into_iter().map(|wo| bsdf.sample(wo, c.u)))
            .flatten()
            .map(|n| n.wi.to_array());
        let own = s.wi.to_array();
        let distance = error(own, gpu_sample.wi.to_array(), || slack(own, neighbours), tolerance);
        if distance > 0.05 {
            disagreements.push(differ());
            continue;
        }
        row.direction.see(distance, differ);
        let index = error([s.eta], [gpu_sample.eta], || 0.0, tolerance);
        row.eta.see(index, differ);

        // Density and weight against those of the direction that WGSL drew, so that a rounded direction in a
        // narrow lobe is not counted three times.
        let wi = gpu_sample.wi;
        let at = |wo: Vec3, wi: Vec3| {
            if s.delta {
                return (s.weight, s.pdf);
            }
            let (f, pdf) = bsdf.eval_pdf(wo, wi);
            (if pdf > 0.0 { f * (wi.z.abs() / pdf) } else { Vec3::ZERO }, pdf)
        };
        let (weight, pdf) = at(c.wo, wi);
        if pdf == 0.0 && wi.z.abs() < HORIZON {
            continue;
        }
        let near = |steps: f32| {
            let others = nudged(c.wo, steps).into_iter().map(|wo| (wo, wi));
            nudged(wi, steps).into_iter().map(|wi| (c.wo, wi)).chain(others).map(|(wo, wi)| at(wo, wi))
        };
        let note = || format!("sample, {}: Rust {weight} / {pdf}, WGSL {gpu_sample:?}", place());
        // What Rust's own draw is off from its density counts as a rounding too.
        let (own_weight, own_pdf) = at(c.wo, s.wi);
        let own = (4.0 * (s.pdf - own_pdf).abs(), 4.0 * (s.weight - own_weight).abs().max_element());
        let slop = |steps| slack([pdf], near(steps).map(|(_, pdf)| [pdf])).max(own.0);
        match judge([pdf], [gpu_sample.pdf], slop, tolerance) {
            Some(e) => row.sample_pdf.see(e, note),
            None => disagreements.push(note()),
        }
        let slop = |steps| slack(weight.to_array(), near(steps).map(|(w, _)| w.to_array())).max(own.1);
        match judge(weight.to_array(), gpu_sample.weight.to_array(), slop, tolerance) {
            Some(e) => row.weight.see(e, note),
            None => disagreements.push(note()),
        }
    }
    row.disagreement = disagreements.len() as f32 / cases.len() as f32;
    row.disagreed = disagreements.into_iter().next().unwrap_or_default();
    row
}
