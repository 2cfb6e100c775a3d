use crate::Error;
use crate::samples::SAMPLE_FORMAT;
use std::sync::{Arc, Mutex, PoisonError};
use umbrage_wgpu::Support;
use wgpu::{
    Adapter, AdapterInfo, Backend, Backends, Buffer, BufferDescriptor, BufferUsages, Device,
    DeviceDescriptor, DeviceType, DownlevelFlags, ExperimentalFeatures, Features, Instance,
    InstanceDescriptor, MemoryHints, PollType, Queue, TextureUsages, Trace,
};

/// A GPU device, with or without a window. Clones share it.
#[derive(Clone)]
pub struct Gpu {
    device: Device,
    queue: Queue,
    info: AdapterInfo,
    support: Support,
    /// Whether textures can be read in another format than that in which they are written.
    pub(crate) has_view_formats: bool,
    trouble: Arc<Mutex<Trouble>>,
}

/// Errors of the device since the last check.
#[derive(Default)]
struct Trouble {
    lost: Option<String>,
    refused: Option<String>,
}

/// Features that make work faster or more complete, and are not required.
const WANTED: Features = Support::WANTED_FEATURES
    .union(Features::TIMESTAMP_QUERY)
    .union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// An adapter, with what it supports.
#[derive(Clone, Debug)]
pub struct AdapterReport {
    /// Name, type, driver and backend of the adapter.
    pub info: AdapterInfo,
    /// How the adapter supports shadows, or what it lacks for them.
    pub support: Result<Support, Error>,
    /// Whether the adapter can measure the time of its passes.
    pub has_timestamps: bool,
}

impl AdapterReport {
    /// Whether the adapter is a software implementation that runs on the CPU.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }
}

fn is_software(info: &AdapterInfo) -> bool {
    info.device_type == DeviceType::Cpu
}

/// The place of an adapter among all, the best first: hardware before software, and OpenGL last.
fn rank(info: &AdapterInfo) -> (bool, u32) {
    let kind = match info.device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    };
    (info.backend == Backend::Gl, kind)
}

fn adapters() -> Vec<Adapter> {
    let backends = Backends::from_env().unwrap_or(Backends::all());
    // OpenGL is only tried if there is nothing else, because some drivers print messages when it is
    // looked for.
    let primary = adapters_of(backends & Backends::PRIMARY);
    if primary.is_empty() { adapters_of(backends & Backends::SECONDARY) } else { primary }
}

fn adapters_of(backends: Backends) -> Vec<Adapter> {
    if backends.is_empty() {
        return Vec::new();
    }
    let descriptor = InstanceDescriptor::new_without_display_handle_from_env();
    let instance = Instance::new(InstanceDescriptor { backends, ..descriptor });
    pollster::block_on(instance.enumerate_adapters(backends))
}

/// Reports on all adapters, the best first. Each adapter is opened for a moment.
pub fn devices() -> Vec<AdapterReport> {
    let report = |adapter: Adapter| {
        let opened = open(&adapter);
        AdapterReport {
            info: adapter.get_info(),
            support: opened.and_then(|(device, _)| {
                let support = Support::new(&adapter, &device)?;
                check_renderer(&adapter).map(|()| support)
            }),
            has_timestamps: adapter.features().contains(Features::TIMESTAMP_QUERY),
        }
    };
    let mut adapters = adapters();
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters.into_iter().map(report).collect()
}

fn open(adapter: &Adapter) -> Result<(Device, Queue), Error> {
    pollster::block_on(adapter.request_device(&Gpu::wanted(adapter)))
        .map_err(|e| Error::NoDevice { adapter: adapter.get_info().name, problem: e.to_string() })
}

/// Checks that the adapter can render to the format that samples are read back from. WebGPU
/// guarantees this format, but OpenGL may lack it.
fn check_renderer(adapter: &Adapter) -> Result<(), Error> {
    let features = adapter.get_texture_format_features(SAMPLE_FORMAT);
    if features.allowed_usages.contains(TextureUsages::RENDER_ATTACHMENT) {
        return Ok(());
    }
    Err(Error::NoDevice {
        adapter: adapter.get_info().name,
        problem: "it cannot render to textures of 32-bit floats, from which samples are read back"
            .into(),
    })
}

impl Gpu {
    /// Opens the best adapter that is suitable. The environment variable `WGPU_ADAPTER_NAME`
    /// selects an adapter by a part of its name, and `WGPU_BACKEND` by its backend (`vulkan`,
    /// `metal`, `dx12`, `gl`).
    ///
    /// # Errors
    /// There is no suitable adapter.
    pub fn open() -> Result<Self, Error> {
        let mut problem = String::new();
        for adapter in Self::choices(&adapters())? {
            match open(&adapter).and_then(|(d, q)| Self::from_device(&adapter, d, q)) {
                Ok(gpu) => return Ok(gpu),
                Err(e) => problem = e.to_string(),
            }
        }
        Err(Error::NoAdapter(problem))
    }

    /// Those of `adapters` that may be taken, the best first: hardware before software, and OpenGL
    /// last, whose drivers lack most. If the environment variable `WGPU_ADAPTER_NAME` is set, its
    /// value must be a part of their names.
    ///
    /// # Errors
    /// There is none.
    pub fn choices(adapters: &[Adapter]) -> Result<Vec<Adapter>, Error> {
        let wanted = std::env::var("WGPU_ADAPTER_NAME").ok();
        let lower = wanted.as_ref().map(|name| name.to_lowercase());
        let is_wanted = |a: &&Adapter| {
            lower.as_ref().is_none_or(|w| a.get_info().name.to_lowercase().contains(w))
        };
        let mut choices: Vec<Adapter> = adapters.iter().filter(is_wanted).cloned().collect();
        choices.sort_by_key(|a| rank(&a.get_info()));
        match wanted {
            _ if !choices.is_empty() => Ok(choices),
            Some(name) => Err(Error::NoAdapter(format!("none is called `{name}`"))),
            None => {
                Err(Error::NoAdapter("install a driver for Vulkan, Metal or Direct3D 12".into()))
            }
        }
    }

    /// The device to request of an adapter: all of its limits, and those of its features that make
    /// work faster or more complete.
    pub fn wanted(adapter: &Adapter) -> DeviceDescriptor<'static> {
        DeviceDescriptor {
            label: Some("umbrage"),
            required_features: adapter.features() & WANTED,
            required_limits: adapter.limits(),
            experimental_features: ExperimentalFeatures::disabled(),
            memory_hints: MemoryHints::Performance,
            trace: Trace::Off,
        }
    }

    /// Takes a device that something else has opened on this adapter, a window for example. It
    /// should be the one that [`wanted`](Self::wanted) describes; with fewer features, work is
    /// slower or less complete. From now on, its errors are reported here: this replaces the
    /// device's handlers of errors and of its loss.
    ///
    /// # Errors
    /// The device is not suitable.
    pub fn from_device(adapter: &Adapter, device: Device, queue: Queue) -> Result<Self, Error> {
        let support = Support::new(adapter, &device)?;
        check_renderer(adapter)?;
        let flags = adapter.get_downlevel_capabilities().flags;
        let trouble = Arc::new(Mutex::new(Trouble::default()));
        let told = Arc::clone(&trouble);
        device.set_device_lost_callback(move |_, message| {
            lock(&told).lost.get_or_insert(message);
        });
        let told = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error| {
            let error = error.to_string();
            // The surface of a window cannot be resized while another thread submits work. This is
            // no error of that work, and whoever owns the window tries again with its next frame.
            if !error.contains("Surface::configure") {
                lock(&told).refused.get_or_insert(error);
            }
        }));
        Ok(Self {
            device,
            queue,
            info: adapter.get_info(),
            support,
            has_view_formats: flags.contains(DownlevelFlags::VIEW_FORMATS),
            trouble,
        })
    }

    /// The wgpu device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The queue of the device.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// How the device supports shadows.
    pub fn support(&self) -> Support {
        self.support
    }

    /// Name, type, driver and backend of the adapter.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// Whether the adapter is a software implementation that runs on the CPU.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// The device was lost, or refused something, since the last check.
    pub fn wait(&self) -> Result<(), Error> {
        // The callbacks also receive the errors of this wait, with better messages.
        let polled = self.device.poll(PollType::wait_indefinitely());
        self.check()?;
        polled.map(drop).map_err(|e| Error::Lost(e.to_string()))
    }

    /// Makes a buffer with these contents, whose length is a multiple of four bytes. The queue
    /// writes them, because mapping a buffer panics if the device was lost.
    pub(crate) fn buffer(&self, label: &str, contents: &[u8], usage: BufferUsages) -> Buffer {
        let buffer = self.device.create_buffer(&BufferDescriptor {
            label: Some(label),
            // Buffers of size 0 cannot be bound.
            size: contents.len().max(16) as u64,
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// The contents of a mappable buffer, after all submitted work is done.
    pub(crate) fn read<T: bytemuck::Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, Error> {
        // The callback reports no error that the wait does not report.
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| Error::Lost(e.to_string()))?;
        let values = bytemuck::pod_collect_to_vec(&bytes);
        drop(bytes);
        buffer.unmap();
        Ok(values)
    }

    /// The device's message if it was lost, which is final.
    pub fn lost(&self) -> Option<String> {
        lock(&self.trouble).lost.clone()
    }

    /// Checks whether an error occurred on the device since the last check.
    ///
    /// # Errors
    /// The device was lost, or refused something.
    pub fn check(&self) -> Result<(), Error> {
        let mut trouble = lock(&self.trouble);
        if let Some(message) = &trouble.lost {
            return Err(Error::Lost(message.clone()));
        }
        match trouble.refused.take() {
            Some(message) => {
                Err(Error::Refused(message.split_whitespace().collect::<Vec<_>>().join(" ")))
            }
            None => Ok(()),
        }
    }
}

fn lock(trouble: &Mutex<Trouble>) -> std::sync::MutexGuard<'_, Trouble> {
    // A thread that panicked did so after writing, so the data is complete.
    trouble.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardware_comes_first_and_opengl_last() {
        let ranked = [
            (DeviceType::DiscreteGpu, Backend::Vulkan),
            (DeviceType::IntegratedGpu, Backend::Metal),
            (DeviceType::VirtualGpu, Backend::Vulkan),
            (DeviceType::Cpu, Backend::Vulkan),
            (DeviceType::DiscreteGpu, Backend::Gl),
            (DeviceType::Cpu, Backend::Gl),
        ];
        assert!(ranked.map(|(kind, backend)| rank(&AdapterInfo::new(kind, backend))).is_sorted());
    }
}
