//! A device for those who bring none, what it says against what it is asked for, and its buffers in memory.

use crate::StageError;
use wgpu::{
    Adapter, Backends, Device, Features, Instance, InstanceDescriptor, Limits, PowerPreference, Queue,
    Surface,
};

/// A device, its queue and what it is.
pub struct Gpu {
    /// For surfaces.
    pub adapter: Adapter,
    /// For a [`crate::Stage`].
    pub device: Device,
    /// For a [`crate::Stage`].
    pub queue: Queue,
    /// Name of the adapter and its driver.
    pub name: String,
    /// A processor that stands in for a GPU.
    pub software: bool,
}

impl Gpu {
    /// [`Gpu::on`] any adapter, without a surface; waits for it.
    pub fn open() -> Result<Self, StageError> {
        let instance = Instance::new(InstanceDescriptor {
            backends: Backends::VULKAN,
            ..InstanceDescriptor::new_without_display_handle()
        });
        pollster::block_on(Self::on(&instance, None))
    }

    /// [`Gpu::open`] for tests: `None` after saying why there is none, and with `REQUIRE_GPU=1` a panic instead.
    pub fn for_tests() -> Option<Self> {
        match Self::open() {
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

    /// The fastest adapter that can show on `surface`, also a software one. Its device has the default limits of WebGPU,
    /// but buffers and textures as large as it takes, and timestamps where there are any.
    pub async fn on(instance: &Instance, surface: Option<&Surface<'_>>) -> Result<Self, StageError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter = instance.request_adapter(&options).await.map_err(|e| {
            tracing::debug!("no adapter: {e}");
            StageError::NoAdapter
        })?;
        let info = adapter.get_info();
        let name = format!("{} ({} {})", info.name, info.driver, info.driver_info);
        let has = adapter.limits();
        let required_limits = Limits {
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            max_buffer_size: has.max_buffer_size,
            max_texture_dimension_2d: has.max_texture_dimension_2d,
            ..Limits::default()
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("yugen"),
            required_limits,
            required_features: adapter.features() & Features::TIMESTAMP_QUERY,
            ..Default::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|e| StageError::NoDevice { adapter: name.clone(), reason: e.to_string() })?;
        let software = info.device_type == wgpu::DeviceType::Cpu;
        Ok(Self { adapter, device, queue, name, software })
    }
}

/// Waits for the device and fetches a buffer that can be mapped.
pub fn map(device: &Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>, StageError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |r| {
        // Whoever waits below may have given up.
        let _ = sender.send(r);
    });
    let lost = |e: String| StageError::Lost(e);
    device
        .poll(wgpu::PollType::Wait { submission_index: None, timeout: None })
        .map_err(|e| lost(e.to_string()))?;
    receiver.recv().map_err(|e| lost(e.to_string()))?.map_err(|e| lost(e.to_string()))?;
    let view = buffer.get_mapped_range(..).map_err(|e| lost(e.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    buffer.unmap();
    Ok(bytes)
}

/// `make`, and [`StageError::Refused`] where the device says something against it: memory that it has not, or what is not valid.
pub fn checked<T>(device: &Device, make: impl FnOnce() -> Result<T, StageError>) -> Result<T, StageError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    // Where errors come at once, as on every native device, they are here now.
    for refused in [now_or_never(validation.pop()), now_or_never(memory.pop())] {
        if let Some(Some(e)) = refused {
            return Err(StageError::Refused(e.to_string()));
        }
    }
    made
}

/// What the future already has.
fn now_or_never<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    match std::pin::pin!(future).poll(&mut context) {
        std::task::Poll::Ready(value) => Some(value),
        std::task::Poll::Pending => None,
    }
}
