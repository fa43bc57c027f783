//! Milliseconds per pass, where the device has timestamps.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use wgpu::{Device, Queue};

/// Most passes of a frame that are timed.
const MOST: u32 = 32;

const FREE: u32 = 0;
const WAITING: u32 = 1;
const READY: u32 = 2;
const FAILED: u32 = 3;

/// How long a pass took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub pass: &'static str,
    /// Milliseconds on the device.
    pub milliseconds: f64,
}

/// The timestamps of a frame. Those of one frame are on their way to be read while others go untimed, so that nothing
/// waits.
pub struct Timestamps {
    queries: Option<Queries>,
    passes: RefCell<Vec<&'static str>>,
    last: Vec<PassTime>,
}

struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    copy: wgpu::Buffer,
    state: Arc<AtomicU32>,
    /// The passes that `copy` holds or will.
    passes: Vec<&'static str>,
    /// Nanoseconds of a tick.
    period: f32,
}

impl Timestamps {
    /// None are taken where the device has no `TIMESTAMP_QUERY`.
    pub fn new(device: &Device, queue: &Queue) -> Self {
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: 16 * u64::from(MOST),
                usage,
                mapped_at_creation: false,
            })
        };
        let queries = device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Queries {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            copy: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
            state: Arc::new(AtomicU32::new(FREE)),
            passes: Vec::with_capacity(MOST as usize),
            period: queue.get_timestamp_period(),
        });
        Self { queries, passes: RefCell::new(Vec::with_capacity(MOST as usize)), last: Vec::new() }
    }

    /// The last frame that was timed and read.
    pub fn last(&self) -> &[PassTime] {
        &self.last
    }

    /// Begins a frame; reads what has come in.
    pub(crate) fn begin(&mut self) {
        self.passes.borrow_mut().clear();
        let Some(queries) = &mut self.queries else { return };
        match queries.state.load(Ordering::Acquire) {
            READY => {
                if let Ok(view) = queries.copy.get_mapped_range(..) {
                    let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&view);
                    self.last.clear();
                    self.last.extend(queries.passes.iter().zip(ticks.chunks_exact(2)).map(|(pass, t)| {
                        PassTime {
                            pass,
                            milliseconds: t[1].saturating_sub(t[0]) as f64 * f64::from(queries.period) * 1e-6,
                        }
                    }));
                }
                queries.copy.unmap();
                queries.state.store(FREE, Ordering::Release);
            }
            FAILED => queries.state.store(FREE, Ordering::Release),
            _ => {}
        }
    }

    fn pair(&self, pass: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        let queries = self.queries.as_ref()?;
        let mut passes = self.passes.borrow_mut();
        let i = passes.len() as u32;
        if i == MOST {
            return None;
        }
        passes.push(pass);
        Some((&queries.set, 2 * i))
    }

    /// For the next compute pass.
    pub fn of_compute(&self, pass: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.pair(pass).map(|(query_set, i)| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(i),
            end_of_pass_write_index: Some(i + 1),
        })
    }

    /// For the next render pass.
    pub fn of_render(&self, pass: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.pair(pass).map(|(query_set, i)| wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(i),
            end_of_pass_write_index: Some(i + 1),
        })
    }

    /// Ends a frame's commands; `true`: ask for [`Timestamps::fetch`] once they are submitted.
    pub(crate) fn end(&mut self, encoder: &mut wgpu::CommandEncoder) -> bool {
        let passes = self.passes.borrow();
        let Some(queries) = &mut self.queries else { return false };
        if passes.is_empty() || queries.state.load(Ordering::Acquire) != FREE {
            return false;
        }
        let count = 2 * passes.len() as u32;
        encoder.resolve_query_set(&queries.set, 0..count, &queries.resolved, 0);
        encoder.copy_buffer_to_buffer(&queries.resolved, 0, &queries.copy, 0, 8 * u64::from(count));
        queries.passes.clear();
        queries.passes.extend_from_slice(&passes);
        true
    }

    /// Has what [`Timestamps::end`] copied brought here, some time.
    pub(crate) fn fetch(&self) {
        let Some(queries) = &self.queries else { return };
        queries.state.store(WAITING, Ordering::Release);
        let state = queries.state.clone();
        queries.copy.map_async(wgpu::MapMode::Read, .., move |r| {
            state.store(if r.is_ok() { READY } else { FAILED }, Ordering::Release);
        });
    }
}
