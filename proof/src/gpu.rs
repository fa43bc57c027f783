//! Which GPU tests run on, and what happens where there is none.

use std::sync::OnceLock;
use wgpu::{Adapter, Backends, Device, DeviceType, Instance, InstanceDescriptor, Queue};

/// An adapter and its device.
pub struct Gpu {
    /// For buffers and pipelines.
    pub device: Device,
    /// For commands.
    pub queue: Queue,
    /// Name and driver, to print beside every number measured here.
    pub name: String,
}

/// Why there is no GPU.
#[derive(Clone, Debug, thiserror::Error)]
pub enum GpuError {
    /// No Vulkan driver was found.
    #[error(
        "no GPU adapter was found; the software one will do (Debian: apt-get install mesa-vulkan-drivers)"
    )]
    NoAdapter,
    /// An adapter, but no device on it.
    #[error("{adapter} gave no device: {reason}")]
    NoDevice {
        /// The adapter.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
    /// A shader or a buffer that the device refused.
    #[error("{0}")]
    Refused(String),
}

impl Gpu {
    /// The one adapter of all tests: lavapipe where installed, so that tolerances mean the same everywhere,
    /// else the first other.
    pub fn new() -> Result<Self, GpuError> {
        let instance = Instance::new(InstanceDescriptor {
            backends: Backends::VULKAN,
            ..InstanceDescriptor::new_without_display_handle()
        });
        let mut adapters = pollster::block_on(instance.enumerate_adapters(Backends::VULKAN));
        adapters.sort_by_key(|a| u8::from(a.get_info().device_type != DeviceType::Cpu));
        let adapter: Adapter = adapters.into_iter().next().ok_or(GpuError::NoAdapter)?;
        let info = adapter.get_info();
        let name = format!("{} ({} {})", info.name, info.driver, info.driver_info);
        // The limits that every browser grants: what passes here runs there.
        let descriptor =
            wgpu::DeviceDescriptor { required_limits: wgpu::Limits::default(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::NoDevice { adapter: name.clone(), reason: e.to_string() })?;
        Ok(Self { device, queue, name })
    }

    /// The GPU for tests, made once. `None` after printing why; with `REQUIRE_GPU=1` a panic instead, so that
    /// a missing driver cannot look like a pass.
    pub fn for_tests() -> Option<&'static Self> {
        static GPU: OnceLock<Result<Gpu, GpuError>> = OnceLock::new();
        let gpu = GPU.get_or_init(|| {
            let gpu = Self::new();
            if let Ok(g) = &gpu {
                println!("GPU tests run on {}", g.name);
            }
            gpu
        });
        match gpu {
            Ok(gpu) => Some(gpu),
            Err(e) if std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1") => {
                panic!("REQUIRE_GPU=1, but {e}")
            }
            Err(e) => {
                println!("skipped: {e}");
                None
            }
        }
    }

    /// Runs the entry point `main` of a compute shader once over `groups` workgroups. Bindings 0, 1, … of
    /// group 0 are `inputs` (read-only storage); the binding after them is the output, filled with
    /// `output` before and returned after.
    pub fn compute(
        &self,
        wgsl: &str,
        inputs: &[&[f32]],
        output: &[f32],
        groups: u32,
    ) -> Result<Vec<f32>, GpuError> {
        use wgpu::{BufferUsages, util::DeviceExt};
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(wgsl.into()),
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffer = |data: &[f32], usage| {
            // A binding may not be empty.
            let bytes: &[u8] = if data.is_empty() { &[0; 4] } else { bytemuck::cast_slice(data) };
            self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents: bytes,
                usage,
            })
        };
        let mut buffers: Vec<_> = inputs.iter().map(|data| buffer(data, BufferUsages::STORAGE)).collect();
        buffers.push(buffer(output, BufferUsages::STORAGE | BufferUsages::COPY_SRC));
        let target = &buffers[inputs.len()];
        let entries: Vec<_> = buffers
            .iter()
            .enumerate()
            .map(|(i, b)| wgpu::BindGroupEntry { binding: i as u32, resource: b.as_entire_binding() })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let readback = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: target.size(),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        encoder.copy_buffer_to_buffer(target, 0, &readback, 0, target.size());
        self.queue.submit([encoder.finish()]);
        if let Some(e) = pollster::block_on(scope.pop()) {
            return Err(GpuError::Refused(e.to_string()));
        }
        let (sender, receiver) = std::sync::mpsc::channel();
        readback.map_async(wgpu::MapMode::Read, .., move |r| {
            // The receiver waits below for as long as the device lives.
            let _ = sender.send(r);
        });
        let refused = |e: String| GpuError::Refused(e);
        self.device
            .poll(wgpu::PollType::Wait { submission_index: None, timeout: None })
            .map_err(|e| refused(e.to_string()))?;
        receiver.recv().map_err(|e| refused(e.to_string()))?.map_err(|e| refused(e.to_string()))?;
        let view = readback.get_mapped_range(..).map_err(|e| refused(e.to_string()))?;
        Ok(bytemuck::cast_slice(&view).to_vec())
    }
}
