use crate::Error;
use crate::samples::SAMPLE_FORMAT;
use std::sync::{Arc, Mutex, PoisonError};
use umbrage_wgpu::Support;
use wgpu::{
    Adapter, AdapterInfo, Backends, Buffer, BufferDescriptor, BufferUsages, Device,
    DeviceDescriptor, DeviceType, ExperimentalFeatures, Features, Instance, InstanceDescriptor,
    MemoryHints, PollType, Queue, TextureUsages, Trace,
};

/// A device without a window.
pub struct Gpu {
    device: Device,
    queue: Queue,
    info: AdapterInfo,
    support: Support,
    trouble: Arc<Mutex<Trouble>>,
}

/// What went wrong on the device since it was last asked.
#[derive(Default)]
struct Trouble {
    lost: Option<String>,
    refused: Option<String>,
}

/// What can be had for faster or fuller work, but is not needed.
const WANTED: Features = Support::WANTED_FEATURES
    .union(Features::TIMESTAMP_QUERY)
    .union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

/// An adapter, and what it can do.
#[derive(Clone, Debug)]
pub struct AdapterReport {
    /// Name, kind, driver and backend.
    pub info: AdapterInfo,
    /// What shadows get from it, or what it lacks.
    pub support: Result<Support, Error>,
    /// Whether it tells how long its passes take.
    pub has_timestamps: bool,
}

impl AdapterReport {
    /// Whether it is a program that does a GPU's work.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }
}

fn is_software(info: &AdapterInfo) -> bool {
    info.device_type == DeviceType::Cpu
}

/// All adapters, the best first: real GPUs before software.
fn adapters() -> Vec<Adapter> {
    let backends = Backends::from_env().unwrap_or(Backends::all());
    // OpenGL is the last resort, and looking for it alone makes some drivers print.
    let primary = adapters_of(backends & Backends::PRIMARY);
    if primary.is_empty() { adapters_of(backends & Backends::SECONDARY) } else { primary }
}

fn adapters_of(backends: Backends) -> Vec<Adapter> {
    if backends.is_empty() {
        return Vec::new();
    }
    let descriptor = InstanceDescriptor::new_without_display_handle_from_env();
    let instance = Instance::new(InstanceDescriptor { backends, ..descriptor });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|a| match a.get_info().device_type {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Other => 3,
        DeviceType::Cpu => 4,
    });
    adapters
}

/// What every adapter can do, the best first. Opens each for a moment.
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
    adapters().into_iter().map(report).collect()
}

fn open(adapter: &Adapter) -> Result<(Device, Queue), Error> {
    let request = adapter.request_device(&DeviceDescriptor {
        label: Some("umbrage"),
        required_features: adapter.features() & WANTED,
        required_limits: adapter.limits(),
        experimental_features: ExperimentalFeatures::disabled(),
        memory_hints: MemoryHints::Performance,
        trace: Trace::Off,
    });
    pollster::block_on(request)
        .map_err(|e| Error::NoDevice { adapter: adapter.get_info().name, problem: e.to_string() })
}

/// That it can draw what samples are read back from, which WebGPU guarantees but OpenGL does not have.
fn check_renderer(adapter: &Adapter) -> Result<(), Error> {
    let features = adapter.get_texture_format_features(SAMPLE_FORMAT);
    if features.allowed_usages.contains(TextureUsages::RENDER_ATTACHMENT) {
        return Ok(());
    }
    Err(Error::NoDevice {
        adapter: adapter.get_info().name,
        problem: "it cannot draw floats of 32 bits, which pictures are measured by".into(),
    })
}

impl Gpu {
    /// The best adapter that can do what is needed. The environment's `WGPU_ADAPTER_NAME` picks one by a part of its name,
    /// `WGPU_BACKEND` by its kind (`vulkan`, `metal`, `dx12`, `gl`).
    ///
    /// # Errors
    /// If there is none.
    pub fn open() -> Result<Self, Error> {
        let wanted = std::env::var("WGPU_ADAPTER_NAME").ok().map(|n| n.to_lowercase());
        let is_wanted = |a: &Adapter| {
            wanted.as_ref().is_none_or(|w| a.get_info().name.to_lowercase().contains(w))
        };
        let mut problem = match &wanted {
            Some(name) => format!("none is called `{name}`"),
            None => "install a driver for Vulkan, Metal or Direct3D 12".to_owned(),
        };
        for adapter in adapters().iter().filter(|a| is_wanted(a)) {
            match Self::of(adapter) {
                Ok(gpu) => return Ok(gpu),
                Err(e) => problem = e.to_string(),
            }
        }
        Err(Error::NoAdapter(problem))
    }

    fn of(adapter: &Adapter) -> Result<Self, Error> {
        let (device, queue) = open(adapter)?;
        let support = Support::new(adapter, &device)?;
        check_renderer(adapter)?;
        let trouble = Arc::new(Mutex::new(Trouble::default()));
        let told = Arc::clone(&trouble);
        device.set_device_lost_callback(move |_, message| {
            lock(&told).lost.get_or_insert(message);
        });
        let told = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error| {
            lock(&told).refused.get_or_insert(error.to_string());
        }));
        Ok(Self { device, queue, info: adapter.get_info(), support, trouble })
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Its queue.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// What shadows get from it.
    pub fn support(&self) -> Support {
        self.support
    }

    /// Name, kind, driver and backend.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// Whether it is a program that does a GPU's work.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }

    /// Waits until all that was submitted is done.
    ///
    /// # Errors
    /// What went wrong on the device since it was last asked: its loss, or something that it refused.
    pub fn wait(&self) -> Result<(), Error> {
        // What goes wrong in waiting is told to the callbacks as well, and in more words.
        let polled = self.device.poll(PollType::wait_indefinitely());
        self.check()?;
        polled.map(drop).map_err(|e| Error::Lost(e.to_string()))
    }

    /// A buffer that holds this, a multiple of four bytes. Written through the queue, for mapping panics on a device
    /// that was lost.
    pub(crate) fn buffer(&self, label: &str, contents: &[u8], usage: BufferUsages) -> Buffer {
        let buffer = self.device.create_buffer(&BufferDescriptor {
            label: Some(label),
            // Buffers of no size cannot be bound.
            size: contents.len().max(16) as u64,
            usage: usage | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// What is in a buffer that can be mapped, once all that was submitted is done.
    pub(crate) fn read<T: bytemuck::Pod>(&self, buffer: &Buffer) -> Result<Vec<T>, Error> {
        // The callback tells nothing that waiting does not.
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.wait()?;
        let bytes = buffer.get_mapped_range(..).map_err(|e| Error::Lost(e.to_string()))?;
        let values = bytemuck::pod_collect_to_vec(&bytes);
        drop(bytes);
        buffer.unmap();
        Ok(values)
    }

    /// Tells what went wrong on the device since it was last asked.
    ///
    /// # Errors
    /// That.
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
    // Whoever panicked did so after writing: there is nothing half done.
    trouble.lock().unwrap_or_else(PoisonError::into_inner)
}
