//! A device that reports every error of wgpu.

use bytemuck::{Pod, bytes_of};
use std::sync::{Arc, Mutex};
use umbrage_wgpu::{CasterInstance, Shadows, Support};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, Device, Queue, RenderPipeline};

pub(crate) struct Bench {
    pub(crate) device: Device,
    pub(crate) queue: Queue,
    pub(crate) support: Support,
    /// Whether the device is software, whose texture filters weigh in single precision. Texture
    /// units have weights of eight bits.
    pub(crate) is_software: bool,
    complaints: Arc<Mutex<Vec<String>>>,
}

impl Bench {
    pub(crate) fn open() -> Self {
        Self::with_limits(|_| {})
    }

    /// A device with lower limits than it could have.
    pub(crate) fn with_limits(lower: impl FnOnce(&mut wgpu::Limits)) -> Self {
        let instance = wgpu::Instance::default();
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))
            .expect("a GPU, or a driver in software: run tools/setup");
        let mut limits = adapter.limits();
        lower(&mut limits);
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: adapter.features() & Support::WANTED_FEATURES,
            required_limits: limits,
            ..Default::default()
        }))
        .unwrap();
        let support = Support::new(&adapter, &device).unwrap();
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let told = Arc::clone(&complaints);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            told.lock().unwrap().push(error.to_string());
        }));
        let is_software = adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        Self { device, queue, support, is_software, complaints }
    }

    /// Waits until all commands are done, and panics if wgpu reported an error.
    pub(crate) fn finish(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let complaints = self.complaints.lock().unwrap();
        assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    }

    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&Default::default())
    }

    pub(crate) fn buffer(&self, contents: &[u8], usage: BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    }

    /// Runs the entry point `main` of `wgsl` on a list of inputs, one invocation for each, in
    /// workgroups of 64. Binding 0 of group 1 is the input, and binding 1 is the output. Group 0 is
    /// that of the lookup.
    pub(crate) fn compute<I: Pod, O: Pod>(
        &self,
        shadows: &Shadows,
        wgsl: &str,
        inputs: &[I],
    ) -> Vec<O> {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl((shadows.lookup_wgsl(0) + wgsl).into()),
        });
        let entry = |binding, read_only| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let own = self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[entry(0, true), entry(1, false)],
        });
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(shadows.lookup_layout()), Some(&own)],
            immediate_size: 0,
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let input = self.buffer(bytemuck::cast_slice(inputs), BufferUsages::STORAGE);
        let size = (size_of::<O>() * inputs.len()) as u64;
        let buffer = |usage| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let output = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let readback = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &own,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
            ],
        });
        let mut encoder = self.encoder();
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, shadows.lookup_bind_group(), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.dispatch_workgroups((inputs.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, size);
        self.finish(encoder);
        self.read(&readback)
    }

    pub(crate) fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Vec<T> {
        buffer.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        bytemuck::pod_collect_to_vec(&buffer.get_mapped_range(..).unwrap())
    }

    /// The depths of a layer of the shadows' texture, row by row, and the width of the layer in
    /// texels.
    pub(crate) fn depths(&self, shadows: &Shadows, layer: u32) -> (Vec<f32>, usize) {
        let texture = shadows.depth_texture();
        let [width, height] = [texture.width(), texture.height()];
        let bytes_per_row = (4 * width).next_multiple_of(256);
        let readback = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(bytes_per_row * height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.encoder();
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                aspect: wgpu::TextureAspect::DepthOnly,
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_row),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.finish(encoder);
        let padded: Vec<f32> = self.read(&readback);
        let row = (bytes_per_row / 4) as usize;
        let rows = padded.chunks(row).flat_map(|r| r[..width as usize].iter().copied());
        (rows.collect(), width as usize)
    }

    /// A pipeline of the user's own that draws casters without vertex buffers. `wgsl` has an entry
    /// point `vertex`, and may have a fragment stage; the casters' text for group 0 stands before
    /// it. Without a fragment stage of its own, the pipeline uses the one that the device needs.
    pub(crate) fn own_casters(
        &self,
        shadows: &Shadows,
        wgsl: &str,
        fragment: Option<&str>,
    ) -> RenderPipeline {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl((shadows.caster_wgsl(0) + wgsl).into()),
        });
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(shadows.caster_layout())],
            immediate_size: 0,
        });
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: shadows.primitive_state(),
            depth_stencil: Some(shadows.depth_stencil_state()),
            multisample: Default::default(),
            fragment: match fragment {
                Some(entry_point) => Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(entry_point),
                    compilation_options: Default::default(),
                    targets: &[],
                }),
                None => shadows.caster_fragment(&module),
            },
            multiview_mask: None,
            cache: None,
        })
    }

    /// A vertex buffer with one instance.
    pub(crate) fn instance(&self, instance: CasterInstance) -> wgpu::Buffer {
        self.buffer(bytes_of(&instance), BufferUsages::VERTEX)
    }
}
