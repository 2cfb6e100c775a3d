//! The passes of prefilters.

use crate::data::PrefilterMap;
use crate::passes::{Aim, part};
use crate::shadows::{DepthTexture, Record};
use crate::wgsl::{self, PrefilterPass};
use crate::{Error, Support};
use std::mem::size_of;
use std::num::NonZeroU64;
use std::ops::Range;
use umbrage::visibility::statistic::{Statistic, Storage};
use umbrage::visibility::{Filter, Prefilter};
use umbrage::{Place, Plan};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, ColorTargetState, CommandEncoder, Device, Extent3d,
    FragmentState, LoadOp, Operations, PipelineCompilationOptions, PipelineLayoutDescriptor,
    PrimitiveState, Queue, RenderPassColorAttachment, RenderPassDescriptor,
    RenderPassTimestampWrites, RenderPipeline, RenderPipelineDescriptor, ShaderModuleDescriptor,
    ShaderSource, ShaderStages, StoreOp, TextureDescriptor, TextureDimension, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
    VertexState,
};

/// Encodes the maps that were drawn as statistics, and blurs the statistics.
#[derive(Debug)]
pub(crate) struct Prefiltering {
    /// The number of texture layers that the statistics of a map take.
    textures: u32,
    /// The ranges of these layers; each range is drawn in a pass of its own.
    groups: Vec<Range<u32>>,
    format: TextureFormat,
    /// Mip level of the prefiltered map itself: 1 if it has half the resolution of the depth
    /// texture, otherwise 0.
    first_level: u32,
    /// The number of stored mip levels.
    levels: u32,
    /// Reach of the blur to each side, in texels of the stored level.
    radius: u32,
    encode: Vec<RenderPipeline>,
    rows: Vec<RenderPipeline>,
    columns: Vec<RenderPipeline>,
    halve: Vec<RenderPipeline>,
    encode_layout: BindGroupLayout,
    blur_layout: BindGroupLayout,
    stride: u32,
    uniforms: Buffer,
    bytes: Vec<u8>,
    statistics: Statistics,
    /// The statistics blurred along rows only.
    scratch: Option<Statistics>,
    bindings: Bindings,
}

/// Textures of statistics. The layers for one layer of maps follow one another.
#[derive(Debug)]
struct Statistics {
    all: TextureView,
    /// For each mip level, the view that passes read, and for each layer the view that they draw
    /// into.
    sources: Vec<TextureView>,
    layers: Vec<Vec<TextureView>>,
    bytes: u64,
}

/// The bind groups of the textures that passes read.
#[derive(Debug)]
struct Bindings {
    /// The depths; one bind group for each layer of maps.
    depths: Vec<BindGroup>,
    /// The statistics; one bind group for each mip level.
    statistics: Vec<BindGroup>,
    scratch: Option<BindGroup>,
}

/// The texture format in which a GPU stores a statistic.
fn format(statistic: &Statistic) -> TextureFormat {
    match (statistic.storage(), statistic.channels()) {
        (Storage::Float32, 1) => TextureFormat::R32Float,
        (Storage::Float32, 2) => TextureFormat::Rg32Float,
        (Storage::Float32, _) => TextureFormat::Rgba32Float,
        (Storage::Unorm16, _) => TextureFormat::Rgba16Unorm,
        (Storage::Snorm16, _) => TextureFormat::Rgba16Snorm,
        (Storage::Snorm8, _) => TextureFormat::Rgba8Snorm,
    }
}

/// Checks that the device can store and interpolate a statistic.
fn check(statistic: &Statistic, support: &Support) -> Result<(), Error> {
    let lacks = |what| {
        let why = "in which this filter stores its statistics: take another filter, such as pcf";
        Err(Error::Unsupported { what, why })
    };
    match statistic.storage() {
        Storage::Float32 if !support.float32 => lacks("filtering of 32-bit floats"),
        Storage::Unorm16 | Storage::Snorm16 if !support.norm16 => {
            lacks("normalised 16-bit textures")
        }
        Storage::Snorm8 if !support.snorm8 => lacks("drawing into signed 8-bit textures"),
        _ if !support.depth_fetch => lacks("fetching of depths"),
        _ => Ok(()),
    }
}

impl Prefiltering {
    pub(crate) fn new(
        device: &Device,
        support: &Support,
        prefilter: &Prefilter,
        depths: &DepthTexture,
    ) -> Result<Self, Error> {
        let statistic = &prefilter.statistic;
        check(statistic, support)?;
        let format = format(statistic);
        let textures = wgsl::textures(statistic);
        let cost = format.target_pixel_byte_cost().unwrap_or(16);
        let at_a_time = (support.max_attachment_bytes / cost).clamp(1, support.max_attachments);
        let groups: Vec<Range<u32>> = (0..textures)
            .step_by(at_a_time as usize)
            .map(|first| first..textures.min(first + at_a_time))
            .collect();
        let encode_layout = layout(device, PrefilterPass::Encode);
        let blur_layout = layout(device, PrefilterPass::Rows);
        let pipelines = |pass| -> Vec<RenderPipeline> {
            let layout = if pass == PrefilterPass::Encode { &encode_layout } else { &blur_layout };
            let one = |range: &Range<u32>| {
                pipeline(
                    device,
                    layout,
                    format,
                    &wgsl::prefilter(prefilter, pass, range.clone()),
                    range,
                )
            };
            groups.iter().map(one).collect()
        };
        let radius = prefilter.radius_texels();
        let is_blurred = radius > 0;
        let first_level = prefilter.first_level();
        let levels = prefilter.levels();
        let blur = |pass| if is_blurred { pipelines(pass) } else { Vec::new() };
        let stride = (size_of::<PrefilterMap>() as u32).next_multiple_of(support.uniform_alignment);
        let uniforms = uniforms(device, stride);
        let size = stored_size(depths, first_level);
        let statistics =
            |levels| Statistics::new(device, support, format, depths, size, textures, levels);
        let scratch = is_blurred.then(|| statistics(1));
        let statistics = statistics(levels);
        let bindings = Bindings::new(
            device,
            [&encode_layout, &blur_layout],
            &uniforms,
            depths,
            &statistics,
            scratch.as_ref(),
        );
        Ok(Self {
            textures,
            format,
            first_level,
            levels,
            radius,
            halve: if levels > 1 { pipelines(PrefilterPass::Halve) } else { Vec::new() },
            encode: pipelines(PrefilterPass::Encode),
            rows: blur(PrefilterPass::Rows),
            columns: blur(PrefilterPass::Columns),
            groups,
            encode_layout,
            blur_layout,
            stride,
            uniforms,
            bytes: Vec::new(),
            statistics,
            scratch,
            bindings,
        })
    }

    /// The prefiltered maps, which lookup samples.
    pub(crate) fn view(&self) -> &TextureView {
        &self.statistics.all
    }

    /// Memory of the prefiltered maps, bytes, without the scratch texture that only the blur needs.
    pub(crate) fn bytes(&self) -> u64 {
        self.statistics.bytes
    }

    /// Creates textures for the maps of a new depth texture.
    pub(crate) fn resize(&mut self, device: &Device, support: &Support, depths: &DepthTexture) {
        let size = stored_size(depths, self.first_level);
        let statistics = |levels| {
            Statistics::new(device, support, self.format, depths, size, self.textures, levels)
        };
        self.scratch = (self.radius > 0).then(|| statistics(1));
        self.statistics = statistics(self.levels);
        self.rebind(device, depths);
    }

    fn rebind(&mut self, device: &Device, depths: &DepthTexture) {
        let layouts = [&self.encode_layout, &self.blur_layout];
        self.bindings = Bindings::new(
            device,
            layouts,
            &self.uniforms,
            depths,
            &self.statistics,
            self.scratch.as_ref(),
        );
    }

    /// Uploads the places and depth ranges of the stale maps for the passes.
    pub(crate) fn upload(
        &mut self,
        device: &Device,
        queue: &Queue,
        plan: &Plan,
        records: &[Record],
        depths: &DepthTexture,
    ) {
        let stride = self.stride as usize;
        self.bytes.clear();
        for (map, record) in plan.maps.iter().zip(records) {
            if let Some(place) = record.stale_place() {
                let uniform = PrefilterMap::new(map, &place, self.textures);
                self.bytes.extend_from_slice(bytemuck::bytes_of(&uniform));
                self.bytes.resize(self.bytes.len().next_multiple_of(stride), 0);
            }
        }
        if self.uniforms.size() < self.bytes.len() as u64 {
            self.uniforms = uniforms(device, self.bytes.len().next_power_of_two() as u32);
            self.rebind(device, depths);
        }
        queue.write_buffer(&self.uniforms, 0, &self.bytes);
    }

    /// Encodes and blurs what is stale of the maps of a layer. `timestamps` has the beginning only
    /// if this layer is the first, and the end only if it is the last.
    pub(crate) fn encode<'a>(
        &self,
        encoder: &mut CommandEncoder,
        layer: usize,
        stale: &(impl Iterator<Item = (&'a Record, Place)> + Clone),
        filter: &Filter,
        timestamps: Option<&RenderPassTimestampWrites<'_>>,
    ) {
        let statistics = &self.statistics.layers;
        let Bindings { depths, statistics: sources, scratch: blurred } = &self.bindings;
        // Each step has pipelines, the bind group that they read, the views that they draw into,
        // the mip level, and two numbers of texels in s and t. The inset is left out at each side,
        // because the blur would read beyond the drawn texels there; lookups do not reach so far.
        // The reach is how far beside stale texels a step draws. The scratch texture keeps rows
        // that are not stale, but their statistics are blurred in place: where the blur of rows
        // reads them, they are encoded anew, and blurred along columns once more.
        let radius = self.radius;
        let mut steps =
            vec![(&self.encode, &depths[layer], &statistics[0], 0, [0; 2], [2 * radius, 0])];
        if let (Some(scratch), Some(blurred)) = (&self.scratch, blurred) {
            let rows = &scratch.layers[0];
            steps.push((&self.rows, &sources[0], rows, 0, [radius, 0], [radius, 0]));
            steps.push((
                &self.columns,
                blurred,
                &statistics[0],
                0,
                [radius; 2],
                [2 * radius, radius],
            ));
        }
        for level in 1..self.levels {
            let from = &sources[level as usize - 1];
            steps.push((&self.halve, from, &statistics[level as usize], level, [0; 2], [0; 2]));
        }
        let passes = steps.len() * self.groups.len();
        let mut index = 0;
        for (pipelines, bindings, target, level, inset, reach) in steps {
            for (pipeline, range) in pipelines.iter().zip(&self.groups) {
                let first = layer * self.textures as usize;
                let attachments: Vec<_> =
                    range.clone().map(|i| attachment(&target[first + i as usize])).collect();
                let writes = part(timestamps, index == 0, index + 1 == passes);
                index += 1;
                let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                    label: Some("shadow prefilter"),
                    color_attachments: &attachments,
                    depth_stencil_attachment: None,
                    timestamp_writes: writes,
                    occlusion_query_set: None,
                    multiview_mask: None,
                });
                pass.set_pipeline(pipeline);
                for (record, place) in stale.clone() {
                    let aim = Aim::new(&place, filter, self.first_level + level, inset);
                    aim.set_viewport(&mut pass);
                    pass.set_bind_group(0, bindings, &[record.stale_index * self.stride]);
                    for part in record.stale.parts() {
                        if aim.set_scissor(&mut pass, part, reach) {
                            pass.draw(0..3, 0..1);
                        }
                    }
                }
            }
        }
    }
}

/// Width and height, in texels of the first stored mip level, of the prefiltered maps.
fn stored_size(depths: &DepthTexture, first_level: u32) -> [u32; 2] {
    depths.size().map(|n| (n >> first_level).max(1))
}

fn attachment(view: &TextureView) -> Option<RenderPassColorAttachment<'_>> {
    Some(RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        // The statistics of other maps must be kept.
        ops: Operations { load: LoadOp::Load, store: StoreOp::Store },
    })
}

impl Statistics {
    fn new(
        device: &Device,
        support: &Support,
        format: TextureFormat,
        depths: &DepthTexture,
        [width, height]: [u32; 2],
        textures: u32,
        levels: u32,
    ) -> Self {
        // Very small textures have fewer mip levels than the prefilter asks for. Nothing is ever
        // drawn into the levels that they lack.
        let levels = levels.min(width.max(height).max(1).ilog2() + 1);
        let layers = support.array_layers(textures * depths.layers.len() as u32);
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("shadow statistics"),
            size: Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: levels,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = |layer: Option<u32>, level: Option<u32>| {
            texture.create_view(&TextureViewDescriptor {
                dimension: Some(match layer {
                    Some(_) => TextureViewDimension::D2,
                    None => TextureViewDimension::D2Array,
                }),
                base_array_layer: layer.unwrap_or(0),
                array_layer_count: layer.map(|_| 1),
                base_mip_level: level.unwrap_or(0),
                mip_level_count: level.map(|_| 1),
                ..TextureViewDescriptor::default()
            })
        };
        let texel = u64::from(format.block_copy_size(None).unwrap_or(0) * layers);
        let bytes = |level: u32| u64::from(width >> level) * u64::from(height >> level) * texel;
        let of_level = |level| (0..layers).map(|i| view(Some(i), Some(level))).collect();
        Self {
            all: view(None, None),
            sources: (0..levels).map(|level| view(None, Some(level))).collect(),
            layers: (0..levels).map(of_level).collect(),
            bytes: (0..levels).map(bytes).sum(),
        }
    }
}

impl Bindings {
    fn new(
        device: &Device,
        [encode, blur]: [&BindGroupLayout; 2],
        uniforms: &Buffer,
        depths: &DepthTexture,
        statistics: &Statistics,
        scratch: Option<&Statistics>,
    ) -> Self {
        let bind = |layout, view| {
            device.create_bind_group(&BindGroupDescriptor {
                label: Some("shadow prefilter"),
                layout,
                entries: &[
                    BindGroupEntry {
                        binding: 0,
                        resource: BindingResource::Buffer(wgpu::BufferBinding {
                            buffer: uniforms,
                            offset: 0,
                            size: NonZeroU64::new(size_of::<PrefilterMap>() as u64),
                        }),
                    },
                    BindGroupEntry { binding: 1, resource: BindingResource::TextureView(view) },
                ],
            })
        };
        Self {
            depths: depths.layers.iter().map(|view| bind(encode, view)).collect(),
            statistics: statistics.sources.iter().map(|view| bind(blur, view)).collect(),
            scratch: scratch.map(|s| bind(blur, &s.all)),
        }
    }
}

fn uniforms(device: &Device, size: u32) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("shadow prefilter"),
        size: u64::from(size),
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn layout(device: &Device, pass: PrefilterPass) -> BindGroupLayout {
    let (sample_type, view_dimension) = match pass {
        PrefilterPass::Encode => (TextureSampleType::Depth, TextureViewDimension::D2),
        PrefilterPass::Rows | PrefilterPass::Columns | PrefilterPass::Halve => {
            (TextureSampleType::Float { filterable: false }, TextureViewDimension::D2Array)
        }
    };
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow prefilter"),
        entries: &[
            entry(
                0,
                BindingType::Buffer {
                    ty: BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: NonZeroU64::new(size_of::<PrefilterMap>() as u64),
                },
            ),
            entry(1, BindingType::Texture { sample_type, view_dimension, multisampled: false }),
        ],
    })
}

fn pipeline(
    device: &Device,
    layout: &BindGroupLayout,
    format: TextureFormat,
    text: &str,
    range: &Range<u32>,
) -> RenderPipeline {
    let module = device.create_shader_module(ShaderModuleDescriptor {
        label: Some("shadow prefilter"),
        source: ShaderSource::Wgsl(text.into()),
    });
    let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("shadow prefilter"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let targets = vec![Some(ColorTargetState::from(format)); range.len()];
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("shadow prefilter"),
        layout: Some(&layout),
        vertex: VertexState {
            module: &module,
            entry_point: None,
            compilation_options: PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: PipelineCompilationOptions::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
