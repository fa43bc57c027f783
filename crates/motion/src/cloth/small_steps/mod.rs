//! The default solver: many small steps, each with one pass.
//!
//! Macklin, Storey, Lu, Terdiman, Chentanez, Jeschke and Müller 2019, "Small Steps in Physics Simulation": springs as
//! compliant constraints (XPBD), solved once in each of many substeps. Five things are added:
//!
//! * Coarse levels ([`crate::cloth::lattice`]) carry what one pass does not: the weight of a whole cloth to where it hangs.
//! * Springs along threads can be solved all at once, to and fro along each ([`crate::cloth::lines`], [`Settings::lines`]).
//! * Where cloth touches cloth, springs that are longer than they may be have more passes ([`SmallSteps::tighten`]).
//! * Bending is no constraint but a force: it is soft enough to be stable, and a force is right at rest, where a constraint that is solved
//!   once would be softer the finer the mesh. A fine mesh of stiff cloth takes more substeps for it.
//! * Contact of cloth with cloth is offset geometric contact ([`crate::cloth::contact`]).
//!
//! Vertices and springs are laid out so that threads and lanes have work ([`crate::cloth::order`]).

mod state;

use crate::cloth::air::{self, Air, Swing};
use crate::cloth::body::{Placed, Solid, Stance};
use crate::cloth::contact::{BLOCKS, Contacts, ROUNDS, Shared};
use crate::cloth::lattice::{BLOCK, Lattices};
use crate::cloth::lines::{self, Bundle, Kept};
use crate::cloth::order::Order;
use crate::cloth::settings::Settings;
use crate::cloth::sweep::{Hinges, Link, Springs};
use crate::cloth::team::{Parts, Team};
use crate::cloth::{Cloth, ClothError, Hinge, Step, crossings, known};
use glam::{Vec3, Vec4};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// Substeps between two goes of dampers and air, which act for all of them at once: they are implicit, and so stable.
pub(super) const CALM: u32 = 4;
/// Substeps for which pairs that touch are told from those within reach once: they slide by a fraction of the distance they keep.
const TOUCHES: u32 = 2;
/// Square of the highest frequency of bending times that of a substep, at the most. Explicit forces alone are stable below 4;
/// together with springs that are solved by a single pass a hanging sheet trembled at 3, and not at 2.
const STABLE: f32 = 1.6;
/// How much farther than it flies a vertex may get in a step, m: a metre a second at sixty steps, six times over.
pub(super) const REACH: f32 = 0.1;
/// Substeps beyond which bending is softened rather than more of them done.
const MOST: u32 = 64;
/// How much what lies on a body gives way to cloth that presses on it, unless [`SmallSteps::load`] says otherwise: as if it were twenty times as
/// heavy, so that the cloth above stays above. Of a sheet that crumples on the ground nine edges pass through others where it is five times as heavy.
const LOADED: f32 = 0.05;
/// Distance from a body over which that ends, in distances that cloth keeps from itself. With a switch in its place vertices that are pressed
/// on a body were light and heavy in turn, and trembled by half a millimetre from one substep to the next.
const LOADS: f32 = 0.2;
/// Part of the way back that an attached vertex is drawn along a direction in which it slides: so little that it yields to the
/// pull of threads, and enough that a belt does not creep around in a dance.
pub(super) const SLID: f32 = 0.02;
/// A body farther than this, m, is left out until vertex and bodies together may have moved the distance measured to it: what cloth and
/// limbs go in a hundredth of a second, several times over.
const AWAY: f32 = 0.02;

/// A cloth that moves by small steps.
pub struct SmallSteps {
    cloth: Cloth,
    settings: Settings,
    order: Order,
    /// Of places: positions as a substep begins, by how much they move in it, velocities; w is nought.
    x: Vec<Vec4>,
    u: Vec<Vec4>,
    v: Vec<Vec4>,
    /// What adding to a place has lost to rounding, to be added with the next.
    lost: Vec<Vec4>,
    /// How far bodies have pushed each place out of them in this substep, which is no velocity.
    shifts: Vec<Vec4>,
    /// Normals times areas, m², as each step begins.
    area: Vec<Vec4>,
    /// Of places, how they swing, how wide the cloth is that they are in, m, and their drag coefficients across as each step begins.
    swings: Vec<Swing>,
    widths: Vec<f32>,
    across: Vec<f32>,
    /// Inverse masses, nought where attached.
    inverse: Vec<f32>,
    strips: Vec<Task>,
    borders: Vec<Task>,
    /// Springs along threads, of each direction.
    lines: [Vec<Bundle>; 2],
    /// Memory of each thread to solve a bundle.
    kept: Vec<Vec<Kept>>,
    lattices: Option<Lattices>,
    centres: Vec<Vec4>,
    /// Place of each attachment, where it comes from and goes to.
    attached: Vec<(u32, Vec4, Vec4)>,
    /// Attachments by strip.
    attached_of: Vec<Vec<u32>>,
    positions: Vec<Vec3>,
    softened: f32,
    bodies: Vec<Solid>,
    slopes: Vec<f32>,
    stances: Vec<Stance>,
    /// Of each body, where it is as a step begins and after each substep.
    placed: Vec<Placed>,
    /// Of places, which bodies are near.
    near: Vec<Near>,
    /// How far each place and bodies may still move before one of those that it may touch now must be tested, m.
    slack: Vec<f32>,
    contacts: Option<Contacts>,
    /// Of places, inverse masses as other cloth feels them: less for what lies on a body.
    give: Vec<f32>,
    /// Whether pairs must be found again.
    stale: AtomicBool,
    /// As [`SmallSteps::tighten`] says.
    passes: u32,
    /// As [`SmallSteps::load`] says.
    loaded: f32,
}

/// Which bodies a vertex is near to, a bit for each.
#[derive(Clone, Copy, Default)]
struct Near {
    /// Bodies it may reach in this step.
    all: u64,
    /// Those of `all` within [`AWAY`] when last measured.
    now: u64,
    /// How far vertex and bodies may still move before another of `all` must be tested, m.
    slack: f32,
    /// How far the vertex may still move before bodies beside `all` must be tested, m.
    left: f32,
}

/// What one thread works on alone.
struct Task {
    range: Range<usize>,
    springs: Springs,
    /// Those of them that are in no line, if any are.
    loose: Option<Springs>,
    hinges: Hinges,
}

impl SmallSteps {
    /// A cloth at rest. `attached` vertices go where each step's targets are.
    ///
    /// # Errors
    /// What [`Cloth::check`] says, or an attachment to a vertex that is not there.
    pub fn new(cloth: Cloth, attached: &[u32], settings: Settings) -> Result<Self, ClothError> {
        cloth.check()?;
        known("attachment", cloth.masses.len(), attached.iter().map(|v| [*v]))?;
        let seconds = if settings.seconds > 0.0 { settings.seconds.min(1.0) } else { 1.0 / 60.0 };
        let threads = settings.threads.clamp(1, 256);
        let n = cloth.masses.len();
        let edges: Vec<[u32; 2]> =
            cloth.springs.iter().map(|s| s.ends).chain(hinge_edges(&cloth.hinges)).collect();
        let order = Order::new(n, &edges);
        let of = |p: &u32| *p as usize;
        let mut inverse: Vec<f32> = order.vertex.iter().map(|v| 1.0 / cloth.masses[of(v)]).collect();
        let fixed = settings.grip >= 1.0 || settings.grip.is_nan();
        if fixed {
            attached.iter().for_each(|v| inverse[order.place[of(v)] as usize] = 0.0);
        }
        let x: Vec<Vec4> = order.vertex.iter().map(|v| cloth.sheet.positions[of(v)].extend(0.0)).collect();
        let mut hinges: Vec<Hinge> = cloth
            .hinges
            .iter()
            .map(|b| Hinge { vertices: b.vertices.map(|v| order.place[v as usize]), ..*b })
            .collect();
        let bounds = bounds(&hinges, &inverse);
        let needed = (seconds * typical(&bounds) / STABLE.sqrt()).ceil() as u32;
        let substeps = settings.substeps.clamp(1, 10_000).max(needed.min(MOST));
        let grip = if fixed { 1.0 } else { settings.grip.max(0.0) };
        let settings = Settings { substeps, threads, seconds, grip, ..settings };
        let h = seconds / substeps as f32;
        let calm = settings.calm_seconds();
        let links: Vec<Link> = cloth.springs.iter().map(|s| Link::new(s, &order.place, &inverse)).collect();
        let softened = soften(&mut hinges, &bounds, h);
        let (lines, within) = match settings.lines {
            true => lines::bundles(&cloth, &order.place, &links, &inverse, h),
            false => Default::default(),
        };
        let longest = lines.iter().flatten().map(Bundle::len).max().unwrap_or(0);
        let mut tasks = [&order.strips, &order.borders].map(|ranges| {
            let task = |r: &Range<usize>| Task {
                range: r.clone(),
                springs: Springs::default(),
                loose: None,
                hinges: Hinges::default(),
            };
            ranges.iter().map(task).collect::<Vec<_>>()
        });
        let springs_of = order.share(links.iter().map(|l| l.ends));
        let hinges_of = order.share(hinges.iter().map(|b| b.vertices));
        for ((tasks, springs_of), hinges_of) in tasks.iter_mut().zip(springs_of).zip(hinges_of) {
            for ((task, s), b) in tasks.iter_mut().zip(springs_of).zip(hinges_of) {
                if longest > 0 {
                    let mine: Vec<Link> = s.iter().filter(|i| !within[**i]).map(|i| links[*i]).collect();
                    task.loose = Some(Springs::new(&mine, &task.range, h, calm));
                }
                let mine: Vec<Link> = s.into_iter().map(|i| links[i]).collect();
                task.springs = Springs::new(&mine, &task.range, h, calm);
                let mine: Vec<Hinge> = b.into_iter().map(|i| hinges[i]).collect();
                task.hinges = Hinges::new(&mine, &inverse, &task.range, calm);
            }
        }
        let lattices = if settings.coarse { Lattices::new(&cloth, &order, &inverse) } else { None };
        let at =
            |v: &u32| (order.place[of(v)], x[order.place[of(v)] as usize], x[order.place[of(v)] as usize]);
        let attached: Vec<_> = attached.iter().map(at).collect();
        let strip_of = |p: usize| order.strips.partition_point(|s| s.end <= p);
        let mut attached_of = vec![Vec::new(); order.strips.len()];
        for (i, (place, ..)) in attached.iter().enumerate() {
            attached_of[strip_of(*place as usize)].push(i as u32);
        }
        let [strips, borders] = tasks;
        let widths = air::widths(&cloth);
        let contacts = if settings.contact {
            let attached = attached.iter().filter(|_| fixed).map(|a| a.0).collect();
            Contacts::new(&cloth, &order, attached, h)
        } else {
            None
        };
        Ok(Self {
            positions: cloth.sheet.positions.clone(),
            u: vec![Vec4::ZERO; n],
            lost: vec![Vec4::ZERO; n],
            shifts: vec![Vec4::ZERO; n],
            v: vec![Vec4::ZERO; n],
            area: vec![Vec4::ZERO; n],
            swings: vec![Swing::default(); n],
            widths: order.vertex.iter().map(|v| widths[of(v)]).collect(),
            across: vec![0.0; n],
            cloth,
            settings,
            x,
            order,
            give: inverse.clone(),
            inverse,
            strips,
            borders,
            lines,
            kept: vec![vec![Kept::default(); longest]; threads],
            centres: vec![Vec4::ZERO; lattices.as_ref().map_or(0, Lattices::nodes)],
            lattices,
            attached,
            attached_of,
            softened,
            bodies: Vec::new(),
            slopes: Vec::new(),
            stances: Vec::new(),
            placed: Vec::new(),
            near: vec![Near::default(); n],
            slack: vec![0.0; n],
            contacts,
            stale: AtomicBool::new(true),
            passes: 1,
            loaded: LOADED,
        })
    }

    /// Bodies that the cloth does not go through, each where it is now.
    ///
    /// # Errors
    /// A body that is none, or more than 64.
    pub fn with_bodies(mut self, bodies: Vec<(Solid, Stance)>) -> Result<Self, ClothError> {
        if bodies.len() > u64::BITS as usize {
            return Err(ClothError::Bodies { have: bodies.len(), most: u64::BITS as usize });
        }
        bodies.iter().try_for_each(|b| b.0.check())?;
        (self.bodies, self.stances) = bodies.into_iter().unzip();
        self.slopes = self.bodies.iter().map(Solid::slope).collect();
        self.placed = vec![Placed::default(); self.bodies.len() * (self.settings.substeps as usize + 1)];
        Ok(self)
    }

    /// The cloth.
    pub fn cloth(&self) -> &Cloth {
        &self.cloth
    }

    /// Where its vertices are, m.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// How fast they are, m/s.
    pub fn velocities(&self) -> impl Iterator<Item = Vec3> {
        self.order.place.iter().map(|p| self.v[*p as usize].truncate())
    }

    /// Substeps of a step.
    pub fn substeps(&self) -> u32 {
        self.settings.substeps
    }

    /// Part of the hinges, by number, that had to be softened for the substep to be stable: nought unless triangles are
    /// small for the cloth's bending length. More substeps need less of it.
    pub fn softened(&self) -> f32 {
        self.softened
    }

    /// How many more passes springs have in each substep, where cloth touches cloth, that are longer than they may be: 1, unless this says
    /// otherwise. With more, springs overpower contact where layers are pressed on each other: a robe is tied through itself.
    pub fn tighten(&mut self, passes: u32) {
        self.passes = passes;
    }

    /// Which part of its way what lies on a body gives way to cloth that presses on it: a twentieth, unless this says otherwise. With more, what
    /// falls or is drawn on it passes through it sooner. With less, it trembles at rest: springs and bodies take it for as heavy as it is, and
    /// what does not have one mass for all takes up energy.
    pub fn load(&mut self, part: f32) {
        self.loaded = part;
    }

    /// Takes from all velocities but this part.
    pub fn slow(&mut self, keep: f32) {
        self.v.iter_mut().for_each(|v| *v *= keep);
    }

    /// One step. Nothing is allocated but what threads need.
    pub fn step(&mut self, step: &Step<'_>) {
        if let Some(contacts) = &mut self.contacts {
            let (place, sheet) = (&self.order.place, &self.cloth.sheet);
            contacts.look(|| {
                let found = crossings::crossings(&self.positions, &sheet.triangles).into_iter();
                let places = |(e, t): ([u32; 2], u32)| {
                    let [a, b, c] = sheet.triangles[t as usize];
                    [e[0], e[1], a, b, c].map(|v| place[v as usize])
                };
                found.map(places).collect()
            });
        }
        self.areas();
        let air = Air { wind: step.wind.extend(0.0) };
        self.swing(air);
        for (i, (place, from, to)) in self.attached.iter_mut().enumerate() {
            *from = if self.settings.grip < 1.0 { *to } else { self.x[*place as usize] };
            *to = step.targets.get(i).map_or(*from, |t| t.extend(0.0));
        }
        let n = self.settings.substeps;
        // Bounds of what bodies sweep over.
        let mut sweeps = [(Vec3::ZERO, 0.0f32, None); u64::BITS as usize];
        for (b, (body, stance)) in self.bodies.iter().zip(&mut self.stances).enumerate() {
            let to = step.stances.get(b).copied().unwrap_or(*stance);
            for s in 0..=n {
                self.placed[b * (n as usize + 1) + s as usize] =
                    Placed::between(stance, &to, s as f32 / n as f32);
            }
            sweeps[b] = body.swept(stance, &to);
            *stance = to;
        }
        let (bodies, placed) = (&self.bodies, &self.placed);
        let sweeps = &sweeps[..bodies.len()];
        let slopes = &self.slopes;
        let [friction, gap] = [self.cloth.friction[0], 0.5 * self.cloth.thickness];
        let seconds = self.settings.seconds;
        let every = u64::MAX.checked_shr(u64::BITS - bodies.len() as u32).unwrap_or(0);
        let near = Parts::new(&mut self.near);
        let slack = Parts::new(&mut self.slack);
        // As far as any body goes in a substep; where that is not easily told, it is tested in each.
        let pace = sweeps.iter().map(|s| s.2.unwrap_or(f32::INFINITY)).fold(0.0, f32::max) / n as f32;
        let give = Parts::new(&mut self.give);
        let contacts = self.contacts.as_mut().map(Contacts::shared);
        let touching = contacts.is_some();
        let contacts = contacts.as_ref();
        let loaded = self.loaded;
        let loads = contacts.map_or(0.0, |c| LOADS * c.radius());
        let stale = &self.stale;
        let grip = self.settings.grip;
        let calm_seconds = self.settings.calm_seconds();
        let h = self.settings.seconds / n as f32;
        let (x, u, v) = (Parts::new(&mut self.x), Parts::new(&mut self.u), Parts::new(&mut self.v));
        let lost = Parts::new(&mut self.lost);
        let shifts = Parts::new(&mut self.shifts);
        let lattices = self.lattices.as_mut().map(std::slice::from_mut).map(Parts::new);
        let coarse = Parts::new(&mut []);
        let lattices = lattices.unwrap_or(coarse);
        let (area, across, inverse) = (&self.area, &self.across, &self.inverse);
        let gravity = step.gravity.extend(0.0) * h;
        let (attached, attached_of, slides) = (&self.attached, &self.attached_of, step.slides);
        let (strips, borders) = (&self.strips, &self.borders);
        let (lines, kept) = (&self.lines, Parts::new(&mut self.kept));
        let has_lattices = lattices.len() > 0;
        let nodes = self.centres.len();
        let centres = Parts::new(&mut self.centres);
        // SAFETY of all parts below: a task takes its own range of each slice, ranges of one phase do not overlap, and a
        // phase ends before the next begins. The lattices read all places in a phase of their own.
        #[allow(unsafe_code)]
        let near_bodies = |k: usize| unsafe {
            let range = &strips[k].range;
            let of = x.read(range).iter().zip(v.read(range));
            for ((near, slack), (x, v)) in near.part(range).iter_mut().zip(slack.part(range)).zip(of) {
                // As far as it flies, and as far as a pull may take it.
                let reach = v.length() * seconds + REACH;
                (*near, *slack) = (Near { left: reach, ..Near::default() }, 0.0);
                for (b, (middle, radius, moved)) in sweeps.iter().enumerate() {
                    let p = x.truncate();
                    let around = p.distance_squared(*middle) < (radius + reach) * (radius + reach);
                    let met = around
                        && moved.is_none_or(|moved| {
                            let first = &placed[b * (n as usize + 1)];
                            bodies[b].distance(first.local(p)).0 < (reach + moved) * slopes[b]
                        });
                    near.all |= u64::from(met) << b;
                }
            }
        };
        #[allow(unsafe_code)]
        let carry = |k: usize| unsafe {
            let range = &strips[k].range;
            if has_lattices {
                let lattice = &lattices.read(&(0..1))[0];
                if lattice.idle {
                    return;
                }
                for (u, place) in u.part(range).iter_mut().zip(range.clone()) {
                    *u += lattice.moves(place);
                }
            }
        };
        #[allow(unsafe_code)]
        let stop = |k: usize, s: u32| unsafe {
            let range = &strips[k].range;
            let (x, u) = (x.part(range), u.part(range));
            let (give, slack) = (give.part(range), slack.part(range));
            let of = near.part(range).iter_mut().zip(&inverse[range.clone()]);
            for ((((x, u), (near, w)), (give, slack)), shifted) in
                x.iter_mut().zip(u.iter_mut()).zip(of).zip(give.iter_mut().zip(slack)).zip(shifts.part(range))
            {
                *give = *w;
                let far = u.length();
                let way = far + pace;
                (*slack, near.slack, near.left) = (*slack - way, near.slack - way, near.left - far);
                if near.left < 0.0 {
                    (near.all, near.left, near.slack, *slack) = (every, f32::INFINITY, 0.0, 0.0);
                }
                if *w == 0.0 || *slack > 0.0 {
                    continue;
                }
                // What is no number is tested.
                if near.slack > 0.0 {
                    *slack = near.slack;
                } else {
                    (near.now, near.slack, *slack) = (near.all, f32::INFINITY, f32::INFINITY);
                }
                let begun = *x;
                let mut left = near.now;
                while left != 0 {
                    let b = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let first = b * (n as usize + 1) + s as usize;
                    let stances = [&placed[first], &placed[first + 1]];
                    let stopped = bodies[b].stop(stances, x.truncate(), u.truncate(), gap, friction, h);
                    match stopped {
                        Ok([to, shift]) => {
                            // Others were measured from where it would have gone.
                            near.slack -= (to.extend(0.0) - *u + shift.extend(0.0)).length();
                            *u = to.extend(0.0);
                            *x += shift.extend(0.0);
                            *give = loaded * *w;
                            *slack = 0.0;
                        }
                        Err(far) => {
                            let far = far / slopes[b];
                            if far > AWAY {
                                near.now &= !(1 << b);
                                near.slack = near.slack.min(far);
                            }
                            *slack = slack.min(far - loads);
                            if far < loads {
                                *give = give.min((loaded + (1.0 - loaded) * far / loads) * *w);
                            }
                        }
                    }
                }
                // Where bodies push against each other what one shifts it by and another takes back is no motion.
                let shift = *x - begun;
                let square = shift.length_squared();
                if square > 0.0 {
                    let back = shift * (-u.dot(shift) / square).clamp(0.0, 1.0);
                    *u += back;
                    *x -= back;
                }
                // To contact it is motion like any other.
                if touching {
                    *shifted = *x - begun;
                    *x = begun;
                    *u += *shifted;
                }
            }
        };
        #[allow(unsafe_code)]
        let halt = |k: usize, s: u32| unsafe {
            let range = &strips[k].range;
            // Bodies have the last word, but for what keeps cloth from passing through itself.
            stop(k, s);
            let (x, u) = (x.part(range), u.part(range));
            let (near, slack) = (near.part(range), slack.part(range));
            let moved = |i: usize, by: f32| {
                near[i].slack -= by;
                slack[i] -= by;
            };
            if contacts.is_some_and(|c| c.hold(range, x, u, inverse, moved)) {
                stale.store(true, Ordering::Relaxed);
            }
        };
        #[allow(unsafe_code)]
        let finish = |k: usize, s: u32| unsafe {
            let range = &strips[k].range;
            if !touching {
                halt(k, s);
            }
            let (x, u, v, lost) = (x.part(range), u.part(range), v.part(range), lost.part(range));
            for ((((x, u), v), lost), shift) in x.iter_mut().zip(u).zip(v).zip(lost).zip(shifts.part(range)) {
                // As much of the push out of bodies as it has got is no velocity.
                let square = shift.length_squared();
                *v = *u * (1.0 / h);
                if square > 0.0 {
                    *v -= *shift * ((u.dot(*shift) / square).clamp(0.0, 1.0) / h);
                    *shift = Vec4::ZERO;
                }
                // Kahan's sum: steps are short.
                let by = *u + *lost;
                let to = *x + by;
                *lost = by - (to - *x);
                *x = to;
            }
        };
        #[allow(unsafe_code)]
        let begin = |k: usize, s: u32| unsafe {
            let task = &strips[k];
            let (x, u, v) = (x.read(&task.range), u.part(&task.range), v.part(&task.range));
            task.hinges.push(x, v, h);
            for ((u, v), w) in u.iter_mut().zip(v).zip(&inverse[task.range.clone()]) {
                if *w > 0.0 {
                    *v += gravity;
                    *u = *v * h;
                }
            }
            for a in &attached_of[k] {
                let (place, from, to) = attached[*a as usize];
                let i = place as usize - task.range.start;
                u[i] = if grip < 1.0 {
                    // As a spring with as much damping as lets it come to rest at once, or nearly.
                    let with = (to - from) * (1.0 / n as f32);
                    let goal = from + with * (s + 1) as f32;
                    let v = u[i] + (with - u[i]) * grip;
                    let back = goal - x[i] - v;
                    let along = slides.get(*a as usize).map_or(Vec4::ZERO, |d| d.extend(0.0));
                    v + (back - along * (back.dot(along) * (1.0 - SLID))) * (0.25 * grip)
                } else {
                    from + (to - from) * ((s + 1) as f32 / n as f32) - x[i]
                };
            }
            task.loose.as_ref().unwrap_or(&task.springs).solve(x, u);
        };
        #[allow(unsafe_code)]
        let join = |k: usize| unsafe {
            let task = &borders[k];
            let (x, u) = (x.read(&task.range), u.part(&task.range));
            task.hinges.push(x, u, h * h);
            task.loose.as_ref().unwrap_or(&task.springs).solve(x, u);
        };
        #[allow(unsafe_code)]
        let tighten = |task: &Task| unsafe {
            task.springs.tighten(x.read(&task.range), u.part(&task.range));
        };
        #[allow(unsafe_code)]
        let drag = |k: usize| unsafe {
            let range = &strips[k].range;
            let of = area[range.clone()].iter().zip(&across[range.clone()]).zip(&inverse[range.clone()]);
            for (v, ((area, across), w)) in v.part(range).iter_mut().zip(of) {
                *v += air.pull(*v, *area, *across, *w * calm_seconds);
            }
        };
        #[allow(unsafe_code)]
        let calm = |task: &Task| unsafe {
            let (x, v) = (x.read(&task.range), v.part(&task.range));
            task.springs.calm(x, v);
            task.hinges.calm(v);
        };
        let passes = self.passes;
        Team::run(self.settings.threads, |team| {
            for s in 0..n {
                let calms = s % CALM == 0;
                team.each(strips.len(), |k| {
                    match s {
                        0 => near_bodies(k),
                        _ => {
                            if !touching {
                                carry(k);
                            }
                            finish(k, s - 1);
                        }
                    }
                    if calms {
                        drag(k);
                        calm(&strips[k]);
                    } else if !touching {
                        begin(k, s);
                    }
                });
                if calms {
                    team.each(borders.len(), |k| calm(&borders[k]));
                }
                // All threads are told the same: what it depends on was written phases ago.
                #[allow(unsafe_code)]
                let turned = |c: &&Shared<'_>| unsafe { c.turned() };
                if let Some(contacts) = contacts.filter(turned) {
                    #[allow(unsafe_code)]
                    team.each(contacts.fits(), |k| unsafe {
                        contacts.face(k, x.read(&(0..x.len())), v.read(&(0..v.len())), h)
                    });
                    #[allow(unsafe_code)]
                    team.each(BLOCKS, |k| unsafe {
                        if contacts.watch(k) {
                            stale.store(true, Ordering::Relaxed);
                        }
                    });
                }
                // All threads see the same: it was written in the phase before, and is taken back behind the next.
                let again = touching && stale.load(Ordering::Relaxed);
                if let Some(contacts) = contacts.filter(|_| again) {
                    #[allow(unsafe_code)]
                    team.each(strips.len(), |k| unsafe {
                        contacts.search(&strips[k].range, x.read(&strips[k].range))
                    });
                    #[allow(unsafe_code)]
                    team.each(contacts.fits(), |k| unsafe { contacts.fit(k) });
                    #[allow(unsafe_code)]
                    team.each(1, |_| unsafe {
                        contacts.begin();
                        stale.store(false, Ordering::Relaxed);
                    });
                    #[allow(unsafe_code)]
                    team.each(BLOCKS, |k| unsafe { contacts.pair(k) });
                    #[allow(unsafe_code)]
                    team.each(strips.len(), |k| unsafe { contacts.settle(&strips[k].range) });
                }
                if calms || touching {
                    team.each(strips.len(), |k| begin(k, s));
                }
                team.each(borders.len(), join);
                for bundles in lines {
                    #[allow(unsafe_code)]
                    team.each(bundles.len(), |k| unsafe { bundles[k].solve(&x, &u, kept.one(team.number)) });
                }
                if has_lattices {
                    #[allow(unsafe_code)]
                    team.each(nodes.div_ceil(BLOCK), |k| unsafe {
                        let block = k * BLOCK..nodes.min((k + 1) * BLOCK);
                        let (x, u) = (x.read(&(0..x.len())), u.read(&(0..u.len())));
                        lattices.read(&(0..1))[0].centres(k, x, u, centres.part(&block));
                    });
                    #[allow(unsafe_code)]
                    team.each(1, |_| unsafe {
                        let (x, u) = (x.read(&(0..x.len())), u.read(&(0..u.len())));
                        lattices.part(&(0..1))[0].solve(centres.read(&(0..nodes)), x, u);
                    });
                }
                if let Some(contacts) = contacts {
                    if has_lattices {
                        team.each(strips.len(), carry);
                    }
                    // More passes over springs that are longer than they may be, with contact only: the first cut the stretch of a robe as
                    // much as twice the substeps, for 5 % of a frame.
                    for _ in 0..passes {
                        team.each(strips.len(), |k| tighten(&strips[k]));
                        team.each(borders.len(), |k| tighten(&borders[k]));
                    }
                    let all = s % TOUCHES == 0;
                    if again || all {
                        #[allow(unsafe_code)]
                        team.each(BLOCKS, |k| unsafe {
                            contacts.touch(k, x.read(&(0..x.len())), u.read(&(0..u.len())), all);
                        });
                    }
                    #[allow(unsafe_code)]
                    team.each(1, |_| unsafe {
                        contacts.part(
                            x.read(&(0..x.len())),
                            u.part(&(0..u.len())),
                            give.read(&(0..give.len())),
                            h,
                        );
                    });
                    team.each(strips.len(), |k| halt(k, s));
                    for round in 0..ROUNDS {
                        #[allow(unsafe_code)]
                        team.each(BLOCKS, |k| unsafe {
                            contacts.suspect(k, round, x.read(&(0..x.len())), u.read(&(0..u.len())));
                        });
                        if !contacts.suspects(round) {
                            break;
                        }
                        #[allow(unsafe_code)]
                        team.each(1, |_| unsafe {
                            let (near, slack) = (near.part(&(0..near.len())), slack.part(&(0..slack.len())));
                            let moved = |place: usize, by: f32| {
                                near[place].slack -= by;
                                slack[place] -= by;
                            };
                            contacts.guard(u.part(&(0..u.len())), give.read(&(0..give.len())), moved);
                        });
                    }
                }
            }
            team.each(strips.len(), |k| {
                if !touching {
                    carry(k);
                }
                finish(k, n - 1);
            });
        });
        self.take_positions();
    }

    /// How far places have gone across since they turned, and what drag they have for it.
    fn swing(&mut self, air: Air) {
        let of = self.v.iter().zip(&self.area).zip(self.swings.iter_mut().zip(&self.widths));
        for (across, ((v, area), (swing, width))) in self.across.iter_mut().zip(of) {
            *across = air.across(*v, *area, swing, *width, self.settings.seconds);
        }
    }

    /// Normals times areas of vertices, each a third of its triangles'.
    fn areas(&mut self) {
        self.area.fill(Vec4::ZERO);
        for triangle in &self.cloth.sheet.triangles {
            let places = triangle.map(|v| self.order.place[v as usize] as usize);
            let [a, b, c] = places.map(|p| self.x[p].truncate());
            let area = ((b - a).cross(c - a) / 6.0).extend(0.0);
            places.iter().for_each(|p| self.area[*p] += area);
        }
    }
}

/// What a hinge joins, where no spring does.
fn hinge_edges(hinges: &[Hinge]) -> impl Iterator<Item = [u32; 2]> {
    hinges.iter().flat_map(|b| {
        let [a, b, c, d] = b.vertices;
        [[c, d], [a, c], [b, c], [a, d], [b, d]]
    })
}

/// Of every vertex, no less than the square of any frequency of bending in which it moves most (Gershgorin), 1/s².
fn bounds(hinges: &[Hinge], inverse: &[f32]) -> Vec<f32> {
    let mut bounds = vec![0.0f32; inverse.len()];
    for hinge in hinges {
        let all: f32 = hinge.slopes.iter().map(|k| k.abs()).sum();
        for (v, k) in hinge.vertices.iter().zip(hinge.slopes) {
            bounds[*v as usize] += inverse[*v as usize] * hinge.stiffness * k.abs() * all;
        }
    }
    bounds
}

/// A frequency that one vertex in a hundred exceeds, 1/s: a few slivers do not make all of a cloth slow.
fn typical(bounds: &[f32]) -> f32 {
    let mut sorted = bounds.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted[(sorted.len() - 1) * 99 / 100].sqrt()
}

/// Takes from hinges what would make them unstable in steps of `h`; returns the part of them that lost some.
fn soften(hinges: &mut [Hinge], bounds: &[f32], h: f32) -> f32 {
    let mut count = 0;
    for hinge in hinges.iter_mut() {
        let worst = hinge.vertices.iter().map(|v| bounds[*v as usize]).fold(0.0, f32::max) * h * h;
        // A hair above, for the number of substeps was made from the same bounds.
        if worst > STABLE * 1.001 {
            hinge.stiffness *= STABLE / worst;
            count += 1;
        }
    }
    count as f32 / hinges.len().max(1) as f32
}
