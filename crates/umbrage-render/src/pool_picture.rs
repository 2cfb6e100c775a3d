//! Pictures of the texture in which pages lie.

use crate::frame_target::{FRAME_FORMAT, FrameTarget};
use crate::overlay::PARTITION_COLORS;
use crate::renderer::{Renderer, color_attachment, uniform_buffer};
use crate::{Error, Gpu};
use bytemuck::{Pod, Zeroable};
use umbrage::paged::Grid;
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, FragmentState,
    MultisampleState, PipelineCompilationOptions, PipelineLayoutDescriptor, PrimitiveState,
    PrimitiveTopology, RenderPassDescriptor, RenderPipeline, RenderPipelineDescriptor,
    ShaderModuleDescriptor, ShaderSource, ShaderStages, TextureSampleType, TextureViewDescriptor,
    TextureViewDimension, VertexState,
};

/// The struct `Pool` of `wgsl/pool.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct PoolUniform {
    texture: [u32; 2],
    picture: [u32; 2],
    side: u32,
    slabs: u32,
    maps: u32,
    first_level: i32,
    colors: [[f32; 4]; PARTITION_COLORS],
}

/// What draws the texture of pages as a picture.
pub(crate) struct PoolPicture {
    uniform: Buffer,
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
}

impl PoolPicture {
    fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let of_buffer =
            |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let stored = of_buffer(BufferBindingType::Storage { read_only: true });
        let types = [
            of_buffer(BufferBindingType::Uniform),
            BindingType::Texture {
                sample_type: TextureSampleType::Float { filterable: false },
                view_dimension: TextureViewDimension::D2,
                multisampled: false,
            },
            stored,
            stored,
        ];
        let entries = (0..).zip(types).map(|(binding, ty)| BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::VERTEX_FRAGMENT,
            ty,
            count: None,
        });
        let label = Some("pool picture");
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label,
            entries: &entries.collect::<Vec<_>>(),
        });
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label,
            source: ShaderSource::Wgsl(include_str!("wgsl/pool.wgsl").into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some("pool_vertex"),
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: PrimitiveState {
                topology: PrimitiveTopology::TriangleStrip,
                ..PrimitiveState::default()
            },
            depth_stencil: None,
            multisample: MultisampleState::default(),
            fragment: Some(FragmentState {
                module: &module,
                entry_point: Some("pool_fragment"),
                compilation_options: PipelineCompilationOptions::default(),
                targets: &[Some(FRAME_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { uniform: uniform_buffer::<PoolUniform>(device, "pool picture"), layout, pipeline }
    }
}

impl Renderer<'_> {
    /// Width and height of the texture in which pages lie, texels; `None` before any were drawn.
    pub fn pool_size(&self) -> Option<[u32; 2]> {
        let texture = self.shadows.depth_texture();
        self.shadows.page_pool().map(|_| [texture.width(), texture.height()])
    }

    /// Draws the texture in which [pages](umbrage::paged) lie into a target of any size, without
    /// waiting for the device. `grid` is one of those of the plan that was drawn last, which must have
    /// a single light. A page is tinted by its level with one of `colors` (sRGB): level l with that
    /// whose number is l modulo their number. What is nearer to the light is lighter, in greys that
    /// are spread over the page's own depths. Pages are lighter in the 30 frames after they were drawn, and dim
    /// where the last frame did not want them. Free places are dark blue.
    ///
    /// # Errors
    /// [`Error::Invalid`] if no pages were drawn. The device refused something.
    pub fn show_pool(
        &mut self,
        grid: &Grid,
        colors: &[[u8; 3]; PARTITION_COLORS],
        target: &FrameTarget,
    ) -> Result<(), Error> {
        let (Some(pool), Some(texture)) = (self.shadows.page_pool(), self.pool_size()) else {
            return Err(Error::Invalid {
                field: "plan",
                problem: "must have pages, which were drawn".into(),
            });
        };
        let gpu = self.gpu;
        let picture = self.pool_picture.get_or_insert_with(|| PoolPicture::new(gpu));
        let uniform = PoolUniform {
            texture,
            picture: target.size(),
            side: pool.side,
            slabs: (grid.slabs as u32).max(1),
            maps: (grid.maps.len() as u32).max(1),
            first_level: grid.first_level,
            colors: colors.map(|[r, g, b]| [r, g, b, 255].map(|v| f32::from(v) / 255.0)),
        };
        gpu.queue().write_buffer(&picture.uniform, 0, bytemuck::bytes_of(&uniform));
        let layer = self.shadows.depth_texture().create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            array_layer_count: Some(1),
            ..TextureViewDescriptor::default()
        });
        let entry = |binding, resource| BindGroupEntry { binding, resource };
        let group = gpu.device().create_bind_group(&BindGroupDescriptor {
            label: Some("pool picture"),
            layout: &picture.layout,
            entries: &[
                entry(0, picture.uniform.as_entire_binding()),
                entry(1, BindingResource::TextureView(&layer)),
                entry(2, pool.places.as_entire_binding()),
                entry(3, pool.table.as_entire_binding()),
            ],
        });
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("pool picture"),
            color_attachments: &[color_attachment(&target.color_view)],
            ..RenderPassDescriptor::default()
        });
        pass.set_pipeline(&picture.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..4, 0..pool.count);
        drop(pass);
        target.encode_copy(&mut encoder);
        gpu.queue().submit([encoder.finish()]);
        gpu.check()
    }
}
