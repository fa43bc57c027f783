//! Cloth that moves on the GPU: [`SmallSteps`], the default solver, as compute passes.
//!
//! It is the same solver, not another one with the same equations: it solves the same springs in the same order, for one pass over springs
//! (Gauss and Seidel's) depends on the order, and so do the folds of a cloth. What the solver does at once on several threads, strips and the
//! borders between them, are workgroups here; springs without a common place, which it takes four at a time, are the 256 invocations of
//! one, and barriers lie between them. Everything else has an invocation for each place: forces of hinges, which are linear and gathered
//! by each place for itself; bodies; the sum; and each line along a thread is one. So a substep is six dispatches, two more every fourth time
//! and two where threads are solved all at once, and a sheet of 16 641 vertices
//! occupies 20 workgroups while springs are solved and 261 else. To colour springs over all of the cloth would keep more of a large
//! GPU at work, but each of a dozen colours would be a dispatch of its own, and the CPU, whose caches hold strips, would be slower by it.
//! Coarse levels, a few hundred nodes, are one workgroup.
//!
//! What differs is rounding: sums of a hinge's forces and of nodes' centres are taken in other orders, and compilers may fuse products and
//! sums. For as long as a motion does not amplify such differences both are equal, to 1e-4 m over two seconds in `tests/cloth.rs`; where
//! a cloth buckles they part as two runs of either that begin a rounding apart.
//!
//! Where cloth touches cloth ([`contact`]) pairs are solved all at once, not one after the other, so that folds fall otherwise.

mod contact;
pub(crate) mod drape;
mod layout;
mod numbered;

use crate::StageError;
use crate::device::{checked, map};
use crate::pipelines::{layout as pipeline_layout, module, of_entry};
use crate::scene::storage;
use contact::Contact;
use glam::{Vec3, Vec4};
use layout::{Layout, WIDE};
use numbered::Numbered;
use wgpu::{BufferUsages, Device, Queue};
use yugen_motion::cloth::rows::{Course, Now, Rows};
use yugen_motion::cloth::{SmallSteps, Solid, Stance, Step};

/// A cloth on the GPU. Allocates and compiles nothing after it was made; a step sends targets and stances, and brings nothing back.
pub struct ClothPass {
    device: Device,
    queue: Queue,
    pipelines: Pipelines,
    bound: Numbered,
    state: wgpu::Buffer,
    given: wgpu::Buffer,
    shown: wgpu::Buffer,
    bodies: Vec<Solid>,
    stances: Vec<Stance>,
    vertex: Vec<u32>,
    inverse: Vec<f32>,
    widths: Vec<f32>,
    attached: usize,
    substeps: u32,
    seconds: f32,
    targets: usize,
    placed: usize,
    goals: usize,
    /// Workgroups: for places, for places or attachments, for strips, for borders, for nodes.
    groups: [u32; 5],
    /// Workgroups for lines along the weft, and along the warp.
    lines: [u32; 2],
    springs_at_once: u32,
    /// What the next step is given.
    next: Vec<Vec4>,
    contact: Option<Contact>,
    /// First of the places' shifts in the state.
    shifts: usize,
}

struct Pipelines {
    start: wgpu::ComputePipeline,
    calm_strips: wgpu::ComputePipeline,
    calm_borders: wgpu::ComputePipeline,
    predict: wgpu::ComputePipeline,
    strips: wgpu::ComputePipeline,
    borders: wgpu::ComputePipeline,
    wefts: wgpu::ComputePipeline,
    warps: wgpu::ComputePipeline,
    centres: wgpu::ComputePipeline,
    lattices: wgpu::ComputePipeline,
    tighten_strips: wgpu::ComputePipeline,
    tighten_borders: wgpu::ComputePipeline,
    carry: wgpu::ComputePipeline,
    halt: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
    show: wgpu::ComputePipeline,
}

/// Where a cloth is, by vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClothState {
    /// m.
    pub positions: Vec<Vec3>,
    /// m/s.
    pub velocities: Vec<Vec3>,
}

/// Invocations of a workgroup where each place has one.
const GROUP: u32 = 64;
/// Lines of a workgroup: few, for each takes long and there are hundreds.
const LINES: u32 = 32;
/// Nodes of a workgroup that finds their centres.
const NODES: u32 = 8;

impl ClothPass {
    /// Goes on from where `solver` is.
    ///
    /// # Errors
    /// A cloth that is too large for the device.
    pub fn new(device: &Device, queue: &Queue, solver: &SmallSteps) -> Result<Self, StageError> {
        let rows = solver.rows();
        let mut pass = checked(device, || Self::make(device, queue, rows))?;
        pass.write(solver.now());
        Ok(pass)
    }

    fn make(device: &Device, queue: &Queue, rows: Rows) -> Result<Self, StageError> {
        let layout = Layout::new(&rows);
        let limits = device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(GROUP) * 16;
        let sizes = [
            ("places of a cloth", 16 * layout.state, limit),
            ("springs of a cloth", size_of_val(&layout.rows[..]), limit),
            ("lists of a cloth", size_of_val(&layout.tables[..]), limit),
            ("distances of bodies", size_of_val(&layout.fields[..]), limit),
            ("places of bodies", 16 * layout.given, limit),
            ("vertices of a cloth", 16 * rows.vertex.len().max(rows.attached.len()), most),
        ];
        for (what, bytes, limit) in sizes {
            if bytes as u64 > limit {
                return Err(StageError::TooLarge { what, bytes: bytes as u64, limit });
            }
        }
        let n = rows.vertex.len();
        let state = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("cloth"),
            size: 16 * layout.state as u64,
            usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let fixed = BufferUsages::empty();
        let springs = storage(device, "springs", &layout.rows, 16, fixed);
        let tables = storage(device, "lists of a cloth", &layout.tables, 4, fixed);
        let fields = storage(device, "distances of bodies", &layout.fields, 4, fixed);
        let next = vec![Vec4::ZERO; layout.given];
        let as_bytes: Vec<[f32; 4]> = vec![[0.0; 4]; layout.given];
        let given = storage(device, "a step of a cloth", &as_bytes, 16, BufferUsages::COPY_DST);
        let near = storage(device, "bodies near a cloth", &vec![[0u32; 2]; n], 8, fixed);
        let vertices = vec![[0.0f32; 4]; 2 * n];
        let shown = storage(device, "cloth by vertices", &vertices, 16, BufferUsages::COPY_SRC);
        let part = |s: u32| (s + 1) as f32 / rows.substeps as f32;
        let words: Vec<[u32; 2]> = (0..rows.substeps).map(|s| [s, part(s).to_bits()]).collect();
        let buffers = [
            (&state, false),
            (&springs, true),
            (&tables, true),
            (&given, true),
            (&fields, true),
            (&near, false),
            (&shown, false),
        ];
        let bound = Numbered::new(device, "cloth", &buffers, &words);
        let make = |contact| Contact::new(device, &layout, contact, n, limit, [&state, &tables]);
        let contact = rows.contact.as_ref().map(make);
        let places = (n as u32).div_ceil(GROUP);
        let [strips, borders] = [0, 1].map(|k: usize| rows.tasks[k].len() as u32);
        Ok(Self {
            pipelines: Pipelines::new(device, &layout.constants, &bound.layout),
            bound,
            state,
            given,
            shown,
            groups: [
                places,
                places.max((rows.attached.len() as u32).div_ceil(GROUP)),
                strips,
                borders,
                layout.nodes.div_ceil(NODES),
            ],
            lines: [0, 1].map(|along| (rows.lines[along].len() as u32).div_ceil(LINES)),
            bodies: rows.bodies,
            stances: Vec::new(),
            vertex: rows.vertex,
            inverse: rows.inverse,
            widths: rows.widths,
            attached: rows.attached.len(),
            substeps: rows.substeps,
            seconds: rows.seconds,
            targets: layout.targets,
            placed: layout.placed,
            goals: layout.goals,
            springs_at_once: layout.springs_at_once,
            next,
            contact,
            shifts: layout.shifts,
            device: device.clone(),
            queue: queue.clone(),
        })
    }

    /// Goes on from where `solver` is now; whether it has as many vertices, attachments and bodies as the one that this was made from.
    #[must_use]
    pub fn resume(&mut self, solver: &SmallSteps) -> bool {
        let now = solver.now();
        let found = [now.places[0].len(), now.targets.len(), now.stances.len()];
        let alike = found == [self.vertex.len(), self.attached, self.bodies.len()];
        if alike {
            self.write(now);
        }
        alike
    }

    /// What a step finds in the state: everything else there is computed before it is read.
    fn write(&mut self, now: Now) {
        let n = self.vertex.len();
        let [x, v, lost] = &now.places;
        let widths = self.widths.iter().map(|width| Vec4::W * *width).collect();
        let swings = now.swings.iter().map(|[way, last, held]| Vec4::new(*way, *last, *held, 0.0)).collect();
        let with = |points: &[Vec3]| points.iter().map(|p| p.extend(0.0)).collect::<Vec<Vec4>>();
        let places = x.iter().zip(&self.inverse).map(|(x, w)| x.extend(*w)).collect();
        let mut sections = vec![
            (0, places),
            (2 * n, with(v)),
            (3 * n, with(lost)),
            (4 * n, widths),
            (5 * n, swings),
            (self.goals, with(&now.targets)),
        ];
        if self.contact.is_some() {
            sections.push((self.shifts, self.inverse.iter().map(|w| Vec4::W * *w).collect()));
        }
        for (first, points) in sections {
            self.queue.write_buffer(&self.state, 16 * first as u64, bytemuck::cast_slice(&points));
        }
        self.stances = now.stances;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipelines.show);
        self.bound.bind(&mut pass, 0);
        pass.dispatch_workgroups(self.groups[0], 1, 1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// One step, given to the device, which may still be at work on it when this returns.
    pub fn step(&mut self, step: &Step<'_>) {
        self.give(step);
        self.queue.write_buffer(&self.given, 0, bytemuck::cast_slice(&self.next));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let p = &self.pipelines;
        let [places, all, strips, borders, nodes] = self.groups;
        let mut recorded = encoder.begin_compute_pass(&Default::default());
        let pass = &mut recorded;
        let run =
            |pass: &mut wgpu::ComputePass, pipeline: &wgpu::ComputePipeline, groups: u32, substep: u32| {
                if groups > 0 {
                    pass.set_pipeline(pipeline);
                    self.bound.bind(pass, substep);
                    pass.dispatch_workgroups(groups, 1, 1);
                }
            };
        run(pass, &p.start, all, 0);
        for s in 0..self.substeps {
            if Layout::calms(s) {
                run(pass, &p.calm_strips, strips, s);
                run(pass, &p.calm_borders, borders, s);
            }
            run(pass, &p.predict, places, s);
            run(pass, &p.strips, strips, s);
            run(pass, &p.borders, borders, s);
            run(pass, &p.wefts, self.lines[0], s);
            run(pass, &p.warps, self.lines[1], s);
            run(pass, &p.centres, nodes, s);
            run(pass, &p.lattices, nodes.min(1), s);
            if let Some(contact) = &self.contact {
                run(pass, &p.carry, places, s);
                for _ in 0..contact.tightened {
                    run(pass, &p.tighten_strips, strips, s);
                    run(pass, &p.tighten_borders, borders, s);
                }
                run(pass, &p.halt, places, s);
                contact.push(pass);
                run(pass, &p.halt, places, s);
                contact.stop(pass);
            }
            run(pass, &p.finish, places, s);
        }
        run(pass, &p.show, places, 0);
        drop(recorded);
        self.queue.submit([encoder.finish()]);
    }

    /// What shaders read of a step.
    fn give(&mut self, step: &Step<'_>) {
        let n = self.substeps;
        self.next[0] = (step.gravity * (self.seconds / n as f32)).extend(0.0);
        self.next[1] = step.wind.extend(0.0);
        for (b, (solid, stance)) in self.bodies.iter().zip(&mut self.stances).enumerate() {
            let to = step.stances.get(b).copied().unwrap_or(*stance);
            let course = Course::new(solid, stance, &to, n);
            *stance = to;
            // As good as infinite, and squares of it are numbers.
            let far = 1e18f32;
            self.next[2 + 2 * b] = course.middle.extend(course.radius.min(far));
            self.next[3 + 2 * b] = Vec4::new(course.moved.unwrap_or(far), 0.0, 0.0, 0.0);
            let first = self.placed + 4 * b * (n as usize + 1);
            for (to, (turn, origin)) in self.next[first..].chunks_exact_mut(4).zip(&course.placed) {
                let columns = [turn.x_axis, turn.y_axis, turn.z_axis, *origin];
                to.iter_mut().zip(columns).for_each(|(to, column)| *to = column.extend(0.0));
            }
        }
        for i in 0..self.attached {
            let at = self.targets + 2 * i;
            self.next[at] = step.targets.get(i).map_or(Vec4::ZERO, |t| t.extend(1.0));
            self.next[at + 1] = step.slides.get(i).map_or(Vec4::ZERO, |d| d.extend(0.0));
        }
    }

    /// Where vertices are after the last step: as many `vec4<f32>` as there are vertices, x, y and z in m, then as many unit normals, of
    /// the cloth's face.
    pub fn vertices(&self) -> &wgpu::Buffer {
        &self.shown
    }

    /// How many springs are solved at once, while strips are solved: at the most what a workgroup takes in each strip, and less where its
    /// batches are small. What a large GPU is kept at work with.
    pub fn springs_at_once(&self) -> u32 {
        self.springs_at_once
    }

    /// Waits, and fetches where the cloth is.
    ///
    /// # Errors
    /// A device that is gone.
    pub fn read(&self) -> Result<ClothState, StageError> {
        let n = self.vertex.len();
        let mut found = ClothState { positions: vec![Vec3::ZERO; n], velocities: vec![Vec3::ZERO; n] };
        let all = self.fetch([(&self.state, 0, n), (&self.state, 2 * n, n)])?;
        for (p, vertex) in self.vertex.iter().enumerate() {
            let vertex = *vertex as usize;
            found.positions[vertex] = all[0][p].truncate();
            found.velocities[vertex] = all[1][p].truncate();
        }
        Ok(found)
    }

    /// Waits, and fetches all that a solver needs to go on from there ([`SmallSteps::go_on`]).
    ///
    /// # Errors
    /// A device that is gone.
    pub fn now(&self) -> Result<Now, StageError> {
        let n = self.vertex.len();
        let [x, v, lost, swings, goals] = self.fetch([0, 2 * n, 3 * n, 5 * n, self.goals].map(|first| {
            let count = if first == self.goals { self.attached } else { n };
            (&self.state, first, count)
        }))?;
        let points = |all: Vec<Vec4>| all.into_iter().map(Vec4::truncate).collect::<Vec<Vec3>>();
        Ok(Now {
            places: [points(x), points(v), points(lost)],
            swings: points(swings).iter().map(Vec3::to_array).collect(),
            targets: points(goals),
            stances: self.stances.clone(),
        })
    }

    /// Waits, and fetches of how many pairs nothing was seen so far, because cloth is so crumpled that there is no room for them: they may pass
    /// through each other.
    ///
    /// # Errors
    /// A device that is gone.
    pub fn missed(&self) -> Result<u32, StageError> {
        let Some(contact) = &self.contact else { return Ok(0) };
        let [counts] = self.fetch([(&contact.counts, 0, 1)])?;
        Ok(contact.missed(&counts[0].to_array().map(f32::to_bits)))
    }

    /// Waits, and fetches what [`ClothPass::vertices`] holds: positions and normals.
    ///
    /// # Errors
    /// A device that is gone.
    pub fn read_vertices(&self) -> Result<[Vec<Vec3>; 2], StageError> {
        let n = self.vertex.len();
        let all = self.fetch([(&self.shown, 0, n), (&self.shown, n, n)])?;
        Ok(all.map(|part| part.into_iter().map(Vec4::truncate).collect()))
    }

    /// Parts of buffers: where each begins and how many rows it has.
    fn fetch<const PARTS: usize>(
        &self,
        parts: [(&wgpu::Buffer, usize, usize); PARTS],
    ) -> Result<[Vec<Vec4>; PARTS], StageError> {
        let all: usize = parts.iter().map(|p| p.2).sum();
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("cloth, read"),
            size: 16 * all as u64,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut to = 0;
        for (buffer, first, count) in parts.iter().filter(|p| p.2 > 0) {
            let bytes = 16 * *count as u64;
            encoder.copy_buffer_to_buffer(buffer, 16 * *first as u64, &copy, to, bytes);
            to += bytes;
        }
        self.queue.submit([encoder.finish()]);
        let rows: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&map(&self.device, &copy)?);
        let mut rows = rows.into_iter().map(Vec4::from_array);
        Ok(parts.map(|(.., count)| rows.by_ref().take(count).collect()))
    }
}

impl Pipelines {
    fn new(device: &Device, constants: &str, binds: &wgpu::BindGroupLayout) -> Self {
        let module = module(device, "cloth", &[constants, include_str!("cloth.wgsl")]);
        let layout = pipeline_layout(device, "cloth", &[binds]);
        let make = |entry: &str| of_entry(device, &module, &layout, entry);
        Self {
            start: make("start"),
            calm_strips: make("calm_strips"),
            calm_borders: make("calm_borders"),
            predict: make("predict"),
            strips: make("strips"),
            borders: make("borders"),
            wefts: make("wefts"),
            warps: make("warps"),
            centres: make("centres"),
            lattices: make("lattices"),
            tighten_strips: make("tighten_strips"),
            tighten_borders: make("tighten_borders"),
            carry: make("carry"),
            halt: make("halt"),
            finish: make("finish"),
            show: make("show"),
        }
    }
}

const _: () = assert!(WIDE <= 256, "the most that WebGPU promises");
