//! Contact of cloth with cloth as compute passes.
//!
//! What pairs are, how they are pushed apart and how those are stopped that would pass through each other is that of the processor's solver
//! (`crates/motion/src/cloth/contact`). How they are found is simpler: in every substep all of them, when it is known how far springs would
//! have places go, so that nothing is remembered and nobody need be told how far it may move. Boxes of leaves hold all that their triangles pass, and boxes
//! above them those; each leaf goes down the tree; leaves whose boxes meet are compared by a workgroup each.
//!
//! And all pairs are solved at once, where the processor takes one after the other (Gauss and Seidel's): each place goes as far as the pair that
//! pushes it farthest along each axis, and as far against it, several times in a substep. Which is greatest does not depend on the order in
//! which pairs come, and so neither does the result, on any device of the same arithmetic.

use super::layout::Layout;
use crate::pipelines::{layout as pipeline_layout, module, of_entry};
use crate::scene::{bind_layout, storage, storage_type};
use wgpu::{BufferUsages, Device, ShaderStages};
use yugen_motion::cloth::rows::ContactRows;

/// How often pairs are pushed apart in a substep, and how often those that would pass are stopped.
const PUSHES: u32 = 4;
const STOPS: u32 = 6;
/// Beyond what it passes by its springs, how far a place may be moved, in radii.
const MARGIN: f32 = 0.25;
/// Leaves near each leaf, and pairs of each place: room for so many in the mean. What has none is not seen.
const NEAR: usize = 64;
const PAIRS: usize = 64;
/// Workgroups that go through lists whose length only the device knows, at the most; and places and leaves for each of them.
const GROUPS: u32 = 1024;
const PLACES: u32 = 16;
const LEAVES: u32 = 4;
/// Parts of the tree in which each leaf is sought by an invocation of its own.
const SUBTREES: u32 = 8;

/// The passes, and what they work on.
pub(super) struct Contact {
    group: wgpu::BindGroup,
    fit: wgpu::ComputePipeline,
    lift: wgpu::ComputePipeline,
    meet: wgpu::ComputePipeline,
    pair: wgpu::ComputePipeline,
    part: wgpu::ComputePipeline,
    guard: wgpu::ComputePipeline,
    give_way: wgpu::ComputePipeline,
    /// How many leaves and pairs there were in the last substep, and the most that there have been before it.
    pub counts: wgpu::Buffer,
    /// Workgroups for leaves, for parts of the tree and leaves, for places, for leaves that are near, for pairs.
    groups: [u32; 5],
    /// How often springs that are too long are solved once more.
    pub tightened: u32,
    /// The most leaves and pairs that there is room for.
    room: [usize; 2],
}

impl Contact {
    /// For `places` places whose state and tables are in these buffers.
    pub fn new(
        device: &Device,
        layout: &Layout,
        contact: &ContactRows,
        places: usize,
        limit: u64,
        [state, tables]: [&wgpu::Buffer; 2],
    ) -> Self {
        let leaves = contact.leaves.len();
        let room = [NEAR * leaves, (PAIRS * places).min(limit as usize / 48)];
        let parts = SUBTREES.min(leaves as u32);
        let margin = MARGIN * contact.radius;
        // Of both sides.
        let reach = 0.5 * contact.radius * yugen_motion::cloth::rows::TOUCHING + margin;
        let constants = format!(
            "{}const NEAR_ROOM: u32 = {}u;\nconst PAIR_ROOM: u32 = {}u;\nconst SUBTREES: u32 = {parts}u;\nconst MARGIN: f32 = {margin:e}f;\nconst WITHIN_REACH: f32 = {reach:e}f;\n",
            layout.constants, room[0], room[1]
        );
        let fixed = BufferUsages::empty();
        let zeros = |words: usize| vec![0u32; words];
        let boxes = storage(device, "boxes of a cloth", &zeros(8 * (2 * leaves - 1)), 16, fixed);
        let near = storage(device, "leaves that are near", &zeros(2 * room[0]), 8, fixed);
        let pairs = storage(device, "pairs of a cloth", &zeros(12 * room[1]), 16, fixed);
        let counts = storage(device, "how many pairs", &zeros(4), 4, BufferUsages::COPY_SRC);
        let pushes = storage(device, "pushes of pairs", &zeros(6 * places), 4, fixed);
        let buffers = [
            (state, false),
            (tables, true),
            (&boxes, false),
            (&near, false),
            (&pairs, false),
            (&counts, false),
            (&pushes, false),
        ];
        let label = "contact of a cloth";
        let types = buffers.iter().map(|(_, read_only)| storage_type(*read_only));
        let bind_layout = bind_layout(device, label, ShaderStages::COMPUTE, types);
        let entries: Vec<_> = (0..)
            .zip(&buffers)
            .map(|(binding, (buffer, _))| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout: &bind_layout,
            entries: &entries,
        });
        let module = module(device, label, &[&constants, include_str!("contact.wgsl")]);
        let pipeline_layout = pipeline_layout(device, label, &[&bind_layout]);
        let make = |entry: &str| of_entry(device, &module, &pipeline_layout, entry);
        Self {
            fit: make("fit"),
            lift: make("lift"),
            meet: make("meet"),
            pair: make("pair"),
            part: make("part"),
            guard: make("guard"),
            give_way: make("give_way"),
            group,
            counts,
            groups: [
                (leaves as u32).div_ceil(64),
                (leaves as u32 * parts).div_ceil(64),
                (places as u32).div_ceil(64),
                (leaves as u32).div_ceil(LEAVES).min(GROUPS),
                (places as u32).div_ceil(PLACES).min(GROUPS),
            ],
            tightened: contact.tightened,
            room,
        }
    }

    fn run(&self, pass: &mut wgpu::ComputePass, pipeline: &wgpu::ComputePipeline, groups: u32) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(groups, 1, 1);
    }

    /// How many of the leaves and pairs that these counts tell of had no room.
    pub fn missed(&self, counts: &[u32]) -> u32 {
        let [near, pairs] = [0, 1].map(|k: usize| counts[k].max(counts[k + 2]));
        near.saturating_sub(self.room[0] as u32).saturating_add(pairs.saturating_sub(self.room[1] as u32))
    }

    /// Finds pairs, and pushes them apart.
    pub fn push(&self, pass: &mut wgpu::ComputePass) {
        let [leaves, parts, places, near, pairs] = self.groups;
        self.run(pass, &self.fit, leaves);
        self.run(pass, &self.lift, 1);
        self.run(pass, &self.meet, parts);
        self.run(pass, &self.pair, near);
        for _ in 0..PUSHES {
            self.run(pass, &self.part, pairs);
            self.run(pass, &self.give_way, places);
        }
    }

    /// Stops pairs that would pass through each other.
    pub fn stop(&self, pass: &mut wgpu::ComputePass) {
        for _ in 0..STOPS {
            self.run(pass, &self.guard, self.groups[4]);
            self.run(pass, &self.give_way, self.groups[2]);
        }
    }
}
