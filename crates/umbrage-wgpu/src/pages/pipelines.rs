//! The pipelines that find pages and draw into them, and what makes bind groups for them.

use crate::shadows::depth_state;
use crate::{ClusterGeometry, Support, wgsl};
use umbrage::visibility::Filter;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, CompareFunction, ComputePipeline,
    ComputePipelineDescriptor, Device, FragmentState, MultisampleState, PipelineCompilationOptions,
    PipelineLayout, PipelineLayoutDescriptor, PrimitiveState, RenderPipeline,
    RenderPipelineDescriptor, ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureSampleType, TextureViewDimension, VertexState,
};

#[derive(Debug)]
pub(super) struct Pipelines {
    /// For depths with one sample, and for several.
    pub(super) requests: [ComputePipeline; 2],
    pub(super) request_layouts: [BindGroupLayout; 2],
    pub(super) begin: ComputePipeline,
    pub(super) allocate: ComputePipeline,
    pub(super) allocate_layout: BindGroupLayout,
    pub(super) clear: RenderPipeline,
    pub(super) copy: RenderPipeline,
    /// Of the texture of what stands still.
    pub(super) still_layout: BindGroupLayout,
    pub(super) draw_layout: BindGroupLayout,
}

pub(super) fn group(device: &Device, layout: &BindGroupLayout, buffers: &[&Buffer]) -> BindGroup {
    let entries = (0..).zip(buffers);
    let entries = entries
        .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() });
    device.create_bind_group(&BindGroupDescriptor {
        label: Some("shadow pages"),
        layout,
        entries: &entries.collect::<Vec<_>>(),
    })
}

pub(super) fn module(device: &Device, text: String) -> ShaderModule {
    device.create_shader_module(ShaderModuleDescriptor {
        label: Some("shadow pages"),
        source: ShaderSource::Wgsl(text.into()),
    })
}

fn pipeline_layout(device: &Device, layouts: &[Option<&BindGroupLayout>]) -> PipelineLayout {
    device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some("shadow pages"),
        bind_group_layouts: layouts,
        immediate_size: 0,
    })
}

pub(super) fn compute(
    device: &Device,
    module: &ShaderModule,
    layouts: &[Option<&BindGroupLayout>],
    entry_point: &str,
) -> ComputePipeline {
    // All shaders write what they read from the memory of their workgroups.
    let compilation_options = PipelineCompilationOptions {
        zero_initialize_workgroup_memory: false,
        ..PipelineCompilationOptions::default()
    };
    device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some("shadow pages"),
        layout: Some(&pipeline_layout(device, layouts)),
        module,
        entry_point: Some(entry_point),
        compilation_options,
        cache: None,
    })
}

/// A layout of buffers.
pub(super) fn buffers_layout(
    device: &Device,
    visibility: ShaderStages,
    types: &[BufferBindingType],
) -> BindGroupLayout {
    let types: Vec<_> = types.iter().map(|&ty| of_buffer(ty)).collect();
    bindings_layout(device, visibility, &types)
}

fn of_buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn bindings_layout(
    device: &Device,
    visibility: ShaderStages,
    types: &[BindingType],
) -> BindGroupLayout {
    let entries = (0..).zip(types);
    let entries =
        entries.map(|(binding, &ty)| BindGroupLayoutEntry { binding, visibility, ty, count: None });
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow pages"),
        entries: &entries.collect::<Vec<_>>(),
    })
}

/// The pipeline that finds the triangles of clusters that pages show.
pub(crate) fn triangles_pipeline(
    device: &Device,
    filter: &Filter,
    geometry: &ClusterGeometry,
) -> ComputePipeline {
    let layouts = [Some(&geometry.pipelines.triangles_layout)];
    let module = module(device, wgsl::page_triangles(filter));
    compute(device, &module, &layouts, "shadow_page_triangles")
}

impl Pipelines {
    pub(super) fn new(
        device: &Device,
        support: &Support,
        filter: &Filter,
        lookup_layout: &BindGroupLayout,
    ) -> Self {
        const UNIFORM: BufferBindingType = BufferBindingType::Uniform;
        const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
        const WRITTEN: BufferBindingType = BufferBindingType::Storage { read_only: false };
        let request_layouts = [false, true].map(|multisampled| {
            let depths = BindingType::Texture {
                sample_type: TextureSampleType::Depth,
                view_dimension: TextureViewDimension::D2,
                multisampled,
            };
            let others = [UNIFORM, WRITTEN, WRITTEN, WRITTEN].map(of_buffer);
            let types = [&[depths][..], &others].concat();
            bindings_layout(device, ShaderStages::COMPUTE, &types)
        });
        let of_allocation = [
            UNIFORM, WRITTEN, READ, WRITTEN, WRITTEN, WRITTEN, WRITTEN, WRITTEN, WRITTEN, READ,
            WRITTEN, WRITTEN, READ,
        ];
        let allocate_layout = buffers_layout(device, ShaderStages::COMPUTE, &of_allocation);
        let draw_layout = buffers_layout(device, ShaderStages::VERTEX, &[UNIFORM, READ, READ]);
        let still = BindingType::Texture {
            sample_type: TextureSampleType::Depth,
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        let still_layout = bindings_layout(device, ShaderStages::FRAGMENT, &[still]);
        let module = |text: String| module(device, text);
        let compute = |module: &_, layouts: &[Option<&BindGroupLayout>], entry_point| {
            compute(device, module, layouts, entry_point)
        };
        let requests = [false, true].map(|is_multisampled| {
            let module = module(wgsl::page_request(filter, is_multisampled));
            let own = &request_layouts[usize::from(is_multisampled)];
            compute(&module, &[Some(own), Some(lookup_layout)], "shadow_page_request")
        });
        let allocation = module(wgsl::page_allocate());
        let squares = |text: String, name: &str, layouts: &[Option<&BindGroupLayout>]| {
            let module = module(text);
            let fragment = format!("shadow_page_{name}_fragment");
            device.create_render_pipeline(&RenderPipelineDescriptor {
                label: Some("shadow pages"),
                layout: Some(&pipeline_layout(device, layouts)),
                vertex: VertexState {
                    module: &module,
                    entry_point: Some(&format!("shadow_page_{name}_vertex")),
                    compilation_options: PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: PrimitiveState::default(),
                depth_stencil: Some(depth_state(CompareFunction::Always)),
                multisample: MultisampleState::default(),
                // Without a fragment stage, squares have one depth.
                fragment: (layouts.len() > 1).then_some(FragmentState {
                    module: &module,
                    entry_point: Some(&fragment),
                    compilation_options: PipelineCompilationOptions::default(),
                    targets: &[],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let own = Some(&draw_layout);
        Self {
            begin: compute(&allocation, &[Some(&allocate_layout)], "shadow_page_begin"),
            allocate: compute(&allocation, &[Some(&allocate_layout)], "shadow_page_allocate"),
            clear: squares(wgsl::page_clear(filter, support), "clear", &[own]),
            copy: squares(wgsl::page_copy(filter, support), "copy", &[own, Some(&still_layout)]),
            still_layout,
            requests,
            request_layouts,
            allocate_layout,
            draw_layout,
        }
    }
}
