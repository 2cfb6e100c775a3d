//! Pictures of the shadow maps themselves.

use crate::frame_target::{FRAME_FORMAT, FrameTarget};
use crate::renderer::{Renderer, color_attachment, uniform_buffer};
use crate::samples::SAMPLE_FORMAT;
use crate::{Error, Gpu};
use bytemuck::{Pod, Zeroable};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, CommandEncoder,
    Extent3d, FragmentState, MultisampleState, PipelineCompilationOptions,
    PipelineLayoutDescriptor, PrimitiveState, RenderPassDescriptor, RenderPipeline,
    RenderPipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages,
    TextureView, TextureViewDescriptor, TextureViewDimension, VertexState,
};

/// The struct `Map` of `wgsl/map.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct MapUniform {
    origin: [u32; 2],
    size: [u32; 2],
    picture: [u32; 2],
}

/// Number of blocks in s and in t, as in `wgsl/map.wgsl`, in each of which the range of depths is
/// found.
const BLOCKS: u32 = 32;

/// What draws shadow maps as pictures.
pub(crate) struct MapPicture {
    uniform: Buffer,
    map_layout: BindGroupLayout,
    blocks: TextureView,
    blocks_group: BindGroup,
    find: RenderPipeline,
    show: RenderPipeline,
}

impl MapPicture {
    fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("map picture"),
            source: ShaderSource::Wgsl(include_str!("wgsl/map.wgsl").into()),
        });
        let texture = BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: false },
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform = BindingType::Buffer {
            ty: BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = |types: &[(BindingType, ShaderStages)]| {
            let entries: Vec<_> = (0..)
                .zip(types)
                .map(|(binding, &(ty, visibility))| BindGroupLayoutEntry {
                    binding,
                    visibility,
                    ty,
                    count: None,
                })
                .collect();
            let label = Some("map picture");
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries })
        };
        let map_layout =
            layout(&[(uniform, ShaderStages::FRAGMENT), (texture, ShaderStages::FRAGMENT)]);
        let blocks_layout = layout(&[(texture, ShaderStages::VERTEX)]);
        let pipeline = |name: &str, layouts: &[Option<&BindGroupLayout>], format: TextureFormat| {
            let [vertex, fragment] = ["vertex", "fragment"].map(|stage| format!("{name}_{stage}"));
            let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
                label: Some("map picture"),
                bind_group_layouts: layouts,
                immediate_size: 0,
            });
            device.create_render_pipeline(&RenderPipelineDescriptor {
                label: Some("map picture"),
                layout: Some(&layout),
                vertex: VertexState {
                    module: &module,
                    entry_point: Some(&vertex),
                    compilation_options: PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: PrimitiveState::default(),
                depth_stencil: None,
                multisample: MultisampleState::default(),
                fragment: Some(FragmentState {
                    module: &module,
                    entry_point: Some(&fragment),
                    compilation_options: PipelineCompilationOptions::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let blocks = device.create_texture(&TextureDescriptor {
            label: Some("map picture"),
            size: Extent3d { width: BLOCKS, height: BLOCKS, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: SAMPLE_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let blocks = blocks.create_view(&TextureViewDescriptor::default());
        let blocks_group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("map picture"),
            layout: &blocks_layout,
            entries: &[BindGroupEntry {
                binding: 0,
                resource: BindingResource::TextureView(&blocks),
            }],
        });
        Self {
            uniform: uniform_buffer::<MapUniform>(device, "map picture"),
            find: pipeline("block", &[Some(&map_layout)], SAMPLE_FORMAT),
            show: pipeline("map", &[Some(&map_layout), Some(&blocks_layout)], FRAME_FORMAT),
            map_layout,
            blocks,
            blocks_group,
        }
    }

    fn encode(&self, encoder: &mut CommandEncoder, map_group: &BindGroup, target: &TextureView) {
        let mut pass = |view, pipeline, groups: &[&BindGroup]| {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("map picture"),
                color_attachments: &[color_attachment(view)],
                ..RenderPassDescriptor::default()
            });
            pass.set_pipeline(pipeline);
            for (index, &group) in (0..).zip(groups) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.draw(0..3, 0..1);
        };
        pass(&self.blocks, &self.find, &[map_group]);
        pass(target, &self.show, &[map_group, &self.blocks_group]);
    }
}

impl Renderer<'_> {
    /// Draws a shadow map as a grey picture into a target of any size, without waiting for the
    /// device. `map` is its index in the plan whose maps were drawn last. The picture spans the map
    /// from (s, t) = (0, 0) in the upper left corner to (1, 1) in the lower right one. The nearest
    /// caster to the light is almost white, the farthest dark grey, with greys in proportion to
    /// depth between them; where nothing casts, the picture is dark blue. With a prefilter the
    /// picture still shows the depths that the statistics are made from.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such map, or if it is empty. The device refused something.
    pub fn show_map(&mut self, map: usize, target: &FrameTarget) -> Result<(), Error> {
        let Some(place) = self.shadows.place(map) else {
            return Err(Error::Invalid {
                field: "map",
                problem: format!("must be the index of a map with texels, is {map}"),
            });
        };
        let gpu = self.gpu;
        let picture = self.map_picture.get_or_insert_with(|| MapPicture::new(gpu));
        let uniform = MapUniform { origin: place.origin, size: place.size, picture: target.size() };
        gpu.queue().write_buffer(&picture.uniform, 0, bytemuck::bytes_of(&uniform));
        // The texture may be another one than for the last picture.
        let layer = self.shadows.depth_texture().create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            base_array_layer: place.layer,
            array_layer_count: Some(1),
            ..TextureViewDescriptor::default()
        });
        let map_group = gpu.device().create_bind_group(&BindGroupDescriptor {
            label: Some("map picture"),
            layout: &picture.map_layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: picture.uniform.as_entire_binding() },
                BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&layer) },
            ],
        });
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        picture.encode(&mut encoder, &map_group, &target.color_view);
        target.encode_copy(&mut encoder);
        gpu.queue().submit([encoder.finish()]);
        gpu.check()
    }
}
