//! A device for those who bring none.

use crate::StageError;
use wgpu::{Backends, Device, Features, Instance, InstanceDescriptor, Limits, PowerPreference, Queue};

/// A device, its queue and what it is.
pub struct Gpu {
    /// For a [`crate::Stage`].
    pub device: Device,
    /// For a [`crate::Stage`].
    pub queue: Queue,
    /// Name of the adapter and its driver.
    pub name: String,
}

impl Gpu {
    /// The fastest adapter there is, also a software one. Its device has the default limits of WebGPU, but buffers and
    /// textures as large as it takes, and timestamps where there are any.
    pub fn open() -> Result<Self, StageError> {
        let instance = Instance::new(InstanceDescriptor {
            backends: Backends::VULKAN,
            ..InstanceDescriptor::new_without_display_handle()
        });
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: PowerPreference::HighPerformance,
            ..Default::default()
        }))
        .map_err(|_| StageError::NoAdapter)?;
        let info = adapter.get_info();
        let name = format!("{} ({} {})", info.name, info.driver, info.driver_info);
        let has = adapter.limits();
        let required_limits = Limits {
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            max_buffer_size: has.max_buffer_size,
            max_texture_dimension_2d: has.max_texture_dimension_2d,
            ..Limits::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits,
            required_features: adapter.features() & Features::TIMESTAMP_QUERY,
            ..Default::default()
        }))
        .map_err(|e| StageError::NoDevice { adapter: name.clone(), reason: e.to_string() })?;
        Ok(Self { device, queue, name })
    }
}
