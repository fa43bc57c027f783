//! The lists of a cloth as words that `cloth.wgsl` reads, and the constants that say where they lie.

use std::fmt::Write;
use std::ops::Range;
use yugen_motion::cloth::rows::{
    CALM_EVERY, ContactRows, HingeRow, LEVEL_SWEEPS, LevelRows, LineRow, NUMBERS, Rows, SpringRow, TaskRows,
    Weights,
};
use yugen_motion::cloth::{Field, Solid};

/// Invocations that work on a strip or border. A strip has about 800 places and so about 2500 springs in ten or a dozen batches: one
/// for each.
pub const WIDE: u32 = 256;

/// Words of a strip or border: its places, and batches of springs that are solved, of hinges, and of springs that are dampers.
const TASK: usize = 8;

/// What shaders read and where.
pub struct Layout {
    /// Constants, before `cloth.wgsl`.
    pub constants: String,
    /// Elements of the state.
    pub state: usize,
    pub rows: Vec<[u32; 4]>,
    pub tables: Vec<u32>,
    pub fields: Vec<f32>,
    /// First of the targets among what a step is given, which bodies' ways come before.
    pub targets: usize,
    /// First of the bodies' places.
    pub placed: usize,
    /// How much a step is given.
    pub given: usize,
    /// First of the attachments' goals in the state.
    pub goals: usize,
    /// Nodes of the finest level.
    pub nodes: u32,
    /// Springs in strips over the rounds that the longest of them takes.
    pub springs_at_once: u32,
    /// First of the places' shifts in the state, where cloth touches cloth.
    pub shifts: usize,
}

/// What grows.
#[derive(Default)]
struct Lists {
    rows: Vec<[u32; 4]>,
    tables: Vec<u32>,
    constants: String,
    /// Springs and hinges, and where batches of them begin.
    springs: Vec<[u32; 4]>,
    spring_batches: Vec<u32>,
    hinges: Vec<[u32; 4]>,
    hinge_batches: Vec<u32>,
    /// Of each place or node, the first batch of springs, and of hinges, behind all in which it is.
    next: [Vec<u32>; 2],
}

impl Layout {
    pub fn new(rows: &Rows) -> Self {
        let n = rows.vertex.len();
        let mut lists = Lists::default();
        let nodes: Vec<usize> = rows.levels.iter().map(|l| l.parts.len() + l.anchors.len()).collect();
        let all_nodes: usize = nodes.iter().sum();
        lists.next = [0, 1].map(|_| vec![0; n.max(all_nodes)]);
        // The state.
        let (went, held) = (6 * n, rows.attached.len());
        let at = went + if rows.contact.is_some() { 2 * n } else { 0 };
        let from = at + 2 * all_nodes;
        let kept = from + 2 * held;
        let sections = [
            ("N", n),
            ("X", 0),
            ("U", n),
            ("V", 2 * n),
            ("LOST", 3 * n),
            ("AREA", 4 * n),
            ("SWING", 5 * n),
            ("WENT", went),
            ("SHIFT", went + n),
            ("AT", at),
            ("MOVED", at + all_nodes),
            ("FROM", from),
            ("GOAL", from + held),
            ("KEPT", kept),
        ];
        sections.into_iter().for_each(|(name, value)| lists.count(name, value));
        // What is solved in which order.
        let tasks: Vec<Vec<u32>> =
            rows.tasks.iter().map(|tasks| tasks.iter().flat_map(|t| lists.task(t)).collect()).collect();
        // Rounds of a batch as workgroups take it.
        let rounds = |batch: u32| {
            let start = |b: u32| lists.spring_batches.get(b as usize).copied();
            let [from, to] = [batch, batch + 1].map(|b| start(b).unwrap_or(lists.springs.len() as u32 / 2));
            (to - from).div_ceil(WIDE)
        };
        let strips = tasks[0].chunks_exact(TASK);
        let longest = strips.map(|t| (t[2]..t[3]).map(rounds).sum::<u32>()).max().unwrap_or(1);
        let solved = |t: &TaskRows| t.loose.as_ref().unwrap_or(&t.springs).len();
        let inside: usize = rows.tasks[0].iter().map(solved).sum();
        let springs_at_once = inside as u32 / longest.max(1);
        for (name, words) in ["STRIPS", "BORDERS"].into_iter().zip(&tasks) {
            lists.table(name, words);
        }
        for (name, tasks) in ["WITHIN", "ACROSS"].into_iter().zip(&rows.tasks) {
            lists.bends(name, tasks, n);
        }
        lists.lines(&rows.lines);
        lists.levels(&rows.levels, &nodes);
        lists.weights("REACH", &rows.reach);
        // What a place is.
        lists.table("VERTEX", &rows.vertex);
        let mut triangles = vec![Vec::new(); n];
        for t in &rows.triangles {
            t.iter().for_each(|p| triangles[*p as usize].extend(t));
        }
        lists.lists("TRIANGLES", &triangles);
        let mut holds = vec![Vec::new(); n];
        rows.attached.iter().zip(0u32..).for_each(|(a, i)| holds[*a as usize].push(i));
        lists.lists("HOLDS", &holds);
        lists.table("HELD", &rows.attached);
        let fields = lists.bodies(&rows.bodies);
        let numbers_of_contact = lists.contact(rows.contact.as_ref());
        // What is given.
        let bodies = rows.bodies.len();
        let targets = 2 + 2 * bodies;
        let placed = targets + 2 * held;
        for (name, value) in
            [("SWEPT", 2), ("TARGETS", targets), ("PLACED", placed), ("BODIES", bodies), ("ATTACHED", held)]
        {
            lists.count(name, value);
        }
        lists.finish();
        let levels = rows.levels.last();
        let nodes_of_finest = levels.map_or(0, |l| l.parts.len());
        let finest = nodes.len().checked_sub(1).map_or(0, |l| nodes[..l].iter().sum());
        let counts = [
            ("LEVELS", rows.levels.len()),
            ("NODES", nodes_of_finest),
            ("FINEST", finest),
            ("LEVEL_SWEEPS", LEVEL_SWEEPS as usize),
            ("SUBSTEPS", rows.substeps as usize),
            ("WIDE", WIDE as usize),
        ];
        counts.into_iter().for_each(|(name, value)| lists.count(name, value));
        let numbers = [
            ("H", rows.seconds / rows.substeps as f32),
            ("SECONDS", rows.seconds),
            ("CALM_SECONDS", rows.calm_seconds),
            ("GRIP", rows.grip),
            ("FRICTION", rows.friction),
            ("GAP", rows.gap),
            ("BAND", Field::BAND),
        ];
        for (name, value) in numbers.iter().chain(&numbers_of_contact).chain(NUMBERS) {
            let _ = writeln!(lists.constants, "const {name}: f32 = {value:e}f;");
        }
        Self {
            constants: lists.constants,
            state: kept + 2 * rows.lines.iter().flatten().map(Vec::len).sum::<usize>(),
            rows: lists.rows,
            tables: lists.tables,
            fields,
            targets,
            placed,
            given: placed + 4 * bodies * (rows.substeps as usize + 1),
            goals: from + held,
            nodes: nodes_of_finest as u32,
            springs_at_once,
            shifts: went + n,
        }
    }

    /// Whether dampers and air act in this substep.
    pub fn calms(substep: u32) -> bool {
        substep.is_multiple_of(CALM_EVERY)
    }
}

impl Lists {
    fn count(&mut self, name: &str, value: usize) {
        // Strings take all that is written.
        let _ = writeln!(self.constants, "const {name}: u32 = {value}u;");
    }

    fn table(&mut self, name: &str, words: &[u32]) {
        self.count(name, self.tables.len());
        self.tables.extend_from_slice(words);
    }

    /// Where the list of each begins, and the lists behind them. Returns where the first stands.
    fn put(&mut self, lists: &[Vec<u32>]) -> u32 {
        let first = self.tables.len();
        let mut at = first + lists.len() + 1;
        self.tables.push(at as u32);
        for list in lists {
            at += list.len();
            self.tables.push(at as u32);
        }
        lists.iter().for_each(|list| self.tables.extend(list));
        first as u32
    }

    fn lists(&mut self, name: &str, lists: &[Vec<u32>]) {
        let first = self.put(lists);
        self.count(name, first as usize);
    }

    /// Springs between places, or nodes from `base` on.
    fn springs(&mut self, springs: &[SpringRow], base: u32) -> [u32; 2] {
        let ends = |s: &SpringRow| s.ends.map(|v| v + base);
        let batches = &mut self.spring_batches;
        let first = batches.len() as u32;
        for i in schedule(batches, self.springs.len() / 2, &mut self.next[0], springs.iter().map(ends)) {
            let s = &springs[i];
            let [a, b] = ends(s);
            // Far beyond all cloth, and a number.
            let longest = s.longest.min(1e18);
            self.springs.push([a, b, s.rest.to_bits(), longest.to_bits()]);
            self.springs.push([s.share, s.give, s.calm, 0.0].map(f32::to_bits));
        }
        [first, self.spring_batches.len() as u32]
    }

    /// Places and batches of a strip or border.
    fn task(&mut self, task: &TaskRows) -> [u32; TASK] {
        let all = self.springs(&task.springs, 0);
        let springs = task.loose.as_ref().map_or(all, |loose| self.springs(loose, 0));
        let first = self.hinge_batches.len() as u32;
        let stencils = task.hinges.iter().map(|h| h.at);
        let at = self.hinges.len() / 3;
        for i in schedule(&mut self.hinge_batches, at, &mut self.next[1], stencils) {
            let hinge = &task.hinges[i];
            let [a, b, d] = hinge.slopes;
            self.hinges.push(hinge.at);
            self.hinges.push([a, b, d, hinge.calm].map(f32::to_bits));
            self.hinges.push(hinge.push.map(f32::to_bits));
        }
        let hinges = [first, self.hinge_batches.len() as u32];
        let places = [task.places.start, task.places.end].map(|p| p as u32);
        [places[0], places[1], springs[0], springs[1], hinges[0], hinges[1], all[0], all[1]]
    }

    /// Of each place, how forces of hinges depend on where others are relative to it: they are linear, so that each place may gather its own.
    fn bends(&mut self, name: &str, tasks: &[TaskRows], n: usize) {
        let mut of: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n];
        for hinge in tasks.iter().flat_map(|t| &t.hinges) {
            let HingeRow { at, slopes: [a, b, d], push, .. } = *hinge;
            let slopes = [a, b, -(a + b + d), d].map(f64::from);
            for (i, push) in at.into_iter().zip(push) {
                let row = &mut of[i as usize];
                for (j, slope) in at.into_iter().zip(slopes).filter(|(j, _)| *j != i) {
                    let by = slope * f64::from(push);
                    match row.iter_mut().find(|(k, _)| *k == j) {
                        Some((_, sum)) => *sum += by,
                        None => row.push((j, by)),
                    }
                }
            }
        }
        let words = |row: &Vec<(u32, f64)>| -> Vec<u32> {
            row.iter().filter(|(_, by)| *by != 0.0).flat_map(|(j, by)| [*j, (*by as f32).to_bits()]).collect()
        };
        let words: Vec<Vec<u32>> = of.iter().map(words).collect();
        self.lists(name, &words);
    }

    /// Lines of both directions.
    fn lines(&mut self, lines: &[Vec<Vec<LineRow>>; 2]) {
        let first = self.rows.len();
        let mut count = 0u32;
        for (name, lines) in ["WEFT", "WARP"].into_iter().zip(lines) {
            let mut starts = vec![count];
            for line in lines {
                for row in line {
                    // Far beyond all cloth, and sums of it with the largest compliance are numbers.
                    let longest = row.longest.min(1e7);
                    self.rows.push([row.place, row.inverse.to_bits(), row.rest.to_bits(), longest.to_bits()]);
                    self.rows.push([row.compliance.to_bits(), 0, 0, 0]);
                }
                count += line.len() as u32;
                starts.push(count);
            }
            self.count(&format!("{name}_LINES"), lines.len());
            self.table(name, &starts);
        }
        self.count("LINES", first);
    }

    /// Levels from the coarsest on, with so many nodes and anchors each.
    fn levels(&mut self, levels: &[LevelRows], nodes: &[usize]) {
        let mut table = Vec::new();
        let mut base = 0;
        for (level, count) in levels.iter().zip(nodes) {
            let parts: Vec<Vec<u32>> = level.parts.iter().map(|p| words(p)).collect();
            let anchors: Vec<Vec<u32>> = level.anchors.iter().map(|p| words(p)).collect();
            let (parts, anchors) = (self.put(&parts), self.put(&anchors));
            let coarser = self.rows.len() as u32;
            self.rows.extend(level.coarser.iter().flat_map(pair));
            let [first, last] = self.springs(&level.threads, base);
            let counts = [base, level.parts.len() as u32, level.anchors.len() as u32];
            table.extend(counts.into_iter().chain([parts, anchors, coarser, first, last]));
            base += *count as u32;
        }
        let parts = table.len().checked_sub(5).map_or(0, |at| table[at]);
        self.count("PARTS", parts as usize);
        self.table("LEVEL", &table);
    }

    fn weights(&mut self, name: &str, all: &[Weights]) {
        self.count(name, self.rows.len());
        self.rows.extend(all.iter().flat_map(pair));
    }

    /// Bodies; returns the distances of all fields.
    fn bodies(&mut self, bodies: &[Solid]) -> Vec<f32> {
        const KINDS: [&str; 3] = ["GROUND", "CAPSULE", "FIELD"];
        KINDS.into_iter().enumerate().for_each(|(kind, name)| self.count(name, kind));
        self.count("SOLIDS", self.rows.len());
        let mut fields = Vec::new();
        for solid in bodies {
            let (kind, first, second) = match solid {
                Solid::Ground => (0, [0; 4], [0; 4]),
                Solid::Capsule { ends: [a, b], radii } => {
                    let end = |p: glam::Vec3, r: f32| p.extend(r).to_array().map(f32::to_bits);
                    (1, end(*a, radii[0]), end(*b, radii[1]))
                }
                Solid::Field(field) => {
                    let (low, cell, size, _) = field.grid();
                    let [x, y, z] = size.map(|n| n as u32);
                    (2, low.extend(cell).to_array().map(f32::to_bits), [x, y, z, 0])
                }
            };
            let stride = solid.stride().min(1e18);
            self.rows.push([kind, solid.slope().to_bits(), stride.to_bits(), fields.len() as u32]);
            self.rows.extend([first, second]);
            if let Solid::Field(field) = solid {
                fields.extend_from_slice(field.grid().3);
            }
        }
        fields
    }

    /// The tree of triangles and what is in its leaves; returns the numbers of contact.
    fn contact(&mut self, contact: Option<&ContactRows>) -> [(&'static str, f32); 4] {
        let _ = writeln!(self.constants, "const CONTACT: bool = {};", contact.is_some());
        let leaves = contact.map_or(0, |c| c.leaves.len());
        self.count("LEAF_COUNT", leaves);
        if let Some(contact) = contact {
            let ends = |leaf: &[Range<u32>; 3]| leaf.each_ref().map(|r| [r.start, r.end]);
            let leaves: Vec<u32> = contact.leaves.iter().flat_map(ends).flatten().collect();
            self.table("LEAVES", &leaves);
            self.table("LEAF_TRIANGLES", contact.triangles.as_flattened());
            self.table("LEAF_VERTICES", &contact.vertices);
            self.table("LEAF_EDGES", contact.edges.as_flattened());
            self.lists("RING", &contact.ring);
        }
        let number = |of: fn(&ContactRows) -> f32| contact.map_or(0.0, of);
        [
            ("RADIUS", number(|c| c.radius)),
            ("FRICTION_BETWEEN", number(|c| c.friction)),
            ("LOADED", number(|c| c.loaded)),
            // By which is divided.
            ("LOADS", number(|c| c.loads).max(1e-9)),
        ]
    }

    /// Springs and hinges, when all are there.
    fn finish(&mut self) {
        self.spring_batches.push((self.springs.len() / 2) as u32);
        self.hinge_batches.push((self.hinges.len() / 3) as u32);
        for (name, batches) in [
            ("SPRING_BATCHES", std::mem::take(&mut self.spring_batches)),
            ("HINGE_BATCHES", std::mem::take(&mut self.hinge_batches)),
        ] {
            self.table(name, &batches);
        }
        for (name, all) in
            [("SPRINGS", std::mem::take(&mut self.springs)), ("HINGES", std::mem::take(&mut self.hinges))]
        {
            self.count(name, self.rows.len());
            self.rows.extend(all);
        }
    }
}

/// Shares a list of stencils out among batches, which are solved one after the other, and what is in one at once: each comes into the
/// first batch behind those of all before it with which it has a place in common, so that the result is that of the list. Adds to `starts`
/// where each batch begins, counted from `at` on, and returns the list in its new order.
fn schedule<const N: usize>(
    starts: &mut Vec<u32>,
    at: usize,
    next: &mut [u32],
    all: impl Iterator<Item = [u32; N]>,
) -> Vec<usize> {
    let first = starts.len() as u32;
    let batches: Vec<u32> = all
        .map(|stencil| {
            let batch = stencil.iter().map(|v| next[*v as usize]).fold(first, u32::max);
            stencil.iter().for_each(|v| next[*v as usize] = batch + 1);
            batch - first
        })
        .collect();
    let mut order: Vec<usize> = (0..batches.len()).collect();
    order.sort_by_key(|i| batches[*i]);
    for (k, i) in order.iter().enumerate() {
        if starts.len() as u32 == first + batches[*i] {
            starts.push((at + k) as u32);
        }
    }
    order
}

/// Numbers and weights, one after the other.
fn words(parts: &[(u32, f32)]) -> Vec<u32> {
    parts.iter().flat_map(|(i, weight)| [*i, weight.to_bits()]).collect()
}

fn pair((nodes, weights): &Weights) -> [[u32; 4]; 2] {
    [*nodes, weights.map(f32::to_bits)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use yugen_optics::random::Pcg32;

    #[test]
    fn what_depends_on_each_other_keeps_its_order() {
        let mut rng = Pcg32::new(1, 1);
        let mut starts = vec![0, 3];
        let mut next = vec![0; 40];
        for at in [5, 205] {
            let mut place = || (rng.next_f32() * 40.0) as u32;
            let stencils: Vec<[u32; 3]> = (0..200).map(|_| [place(), place(), place()]).collect();
            let first = starts.len();
            let order = schedule(&mut starts, at, &mut next, stencils.iter().copied());
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..200));
            let batch = |k: usize| starts[first..].partition_point(|s| *s as usize <= at + k);
            let mut batches = vec![0; 200];
            order.iter().enumerate().for_each(|(k, i)| batches[*i] = batch(k));
            for i in 0..200 {
                for j in (0..i).filter(|j| stencils[*j].iter().any(|v| stencils[i].contains(v))) {
                    assert!(batches[j] < batches[i], "{j} before {i}");
                }
            }
            // Far fewer than stencils, and none of them empty.
            assert!(starts.len() - first < 100 && starts[first..].is_sorted_by(|a, b| a < b));
        }
    }
}
