//! A device to stand on, for programs that bring none.

use crate::StageError;
use wgpu::{Adapter, Device, Instance, Limits, Queue, Surface};

/// A device and what it is.
pub struct Opened {
    /// For surfaces.
    pub adapter: Adapter,
    /// For buffers and pipelines.
    pub device: Device,
    /// For commands.
    pub queue: Queue,
    /// Name and driver, to print beside every number measured on it.
    pub name: String,
    /// A processor that stands in for a GPU.
    pub software: bool,
}

/// The fastest device that can show on `surface`, with timestamps where it has them, and as large buffers and textures as
/// it takes: of everything else no more than the defaults of WebGPU.
pub async fn open(instance: &Instance, surface: Option<&Surface<'_>>) -> Result<Opened, StageError> {
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface: surface,
        ..Default::default()
    };
    let adapter = instance.request_adapter(&options).await.map_err(|e| {
        tracing::debug!("no adapter: {e}");
        StageError::NoAdapter
    })?;
    let info = adapter.get_info();
    let name = [&info.name, &info.driver, &info.driver_info].map(String::as_str).join(" ").trim().to_string();
    let has = adapter.limits();
    let required_limits = Limits {
        max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
        max_buffer_size: has.max_buffer_size,
        max_texture_dimension_2d: has.max_texture_dimension_2d,
        ..Limits::default()
    };
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("yugen"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits,
        ..Default::default()
    };
    let (device, queue) = adapter
        .request_device(&descriptor)
        .await
        .map_err(|e| StageError::NoDevice { adapter: name.clone(), reason: e.to_string() })?;
    tracing::info!(name, "device");
    let software = info.device_type == wgpu::DeviceType::Cpu;
    Ok(Opened { adapter, device, queue, name, software })
}
