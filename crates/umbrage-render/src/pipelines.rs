//! The pipelines that draw pictures.

use crate::Gpu;
use umbrage_wgpu::DEPTH_FORMAT;
use wgpu::{
    ColorTargetState, CompareFunction, DepthStencilState, FragmentState,
    PipelineCompilationOptions, PipelineLayout, PrimitiveState, RenderPipeline,
    RenderPipelineDescriptor, ShaderModule, TextureFormat, VertexBufferLayout, VertexState,
};

/// The pipelines that draw a picture.
#[derive(Clone)]
pub(crate) struct Pipelines {
    /// For meshes without holes. Its fragment stage does not discard, so the device tests depth
    /// first and shades no fragment that is hidden by what is already drawn.
    pub(crate) opaque: RenderPipeline,
    /// For meshes with holes.
    pub(crate) masked: RenderPipeline,
    pub(crate) sky: RenderPipeline,
}

/// What pipelines of pictures have in common.
pub(crate) struct PipelineParts<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) module: &'a ShaderModule,
    pub(crate) layout: &'a PipelineLayout,
    /// The vertex stage of meshes, and its buffers.
    pub(crate) vertex: &'static str,
    pub(crate) buffers: &'a [Option<VertexBufferLayout<'a>>],
}

impl PipelineParts<'_> {
    /// The pipelines with the fragment shaders `opaque_NAME`, `masked_NAME` and `sky_NAME`.
    /// Fragments of meshes without holes are shaded where their depth compares so. Depth is
    /// reversed.
    pub(crate) fn pipelines(
        &self,
        name: &str,
        formats: &[TextureFormat],
        compare: CompareFunction,
    ) -> Pipelines {
        let targets: Vec<_> = formats.iter().map(|&f| Some(ColorTargetState::from(f))).collect();
        let pipeline = |vertex, what: &str, buffers, compare| {
            let fragment = format!("{what}_{name}");
            self.pipeline(vertex, Some((&fragment, &targets)), buffers, compare)
        };
        Pipelines {
            opaque: pipeline(self.vertex, "opaque", self.buffers, compare),
            masked: pipeline(self.vertex, "masked", self.buffers, CompareFunction::Greater),
            sky: pipeline("sky_vertex", "sky", &[], CompareFunction::GreaterEqual),
        }
    }

    /// A pipeline that draws depths alone, by this vertex stage.
    pub(crate) fn depths(&self, vertex: &str) -> RenderPipeline {
        self.pipeline(vertex, None, &[], CompareFunction::Greater)
    }

    fn pipeline(
        &self,
        vertex: &str,
        fragment: Option<(&str, &[Option<ColorTargetState>])>,
        buffers: &[Option<VertexBufferLayout<'_>>],
        compare: CompareFunction,
    ) -> RenderPipeline {
        let Self { gpu, module, layout, .. } = self;
        gpu.device().create_render_pipeline(&RenderPipelineDescriptor {
            label: Some(fragment.map_or(vertex, |(name, _)| name)),
            layout: Some(layout),
            vertex: VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: PipelineCompilationOptions::default(),
                buffers,
            },
            // Both sides of every surface are visible.
            primitive: PrimitiveState::default(),
            depth_stencil: Some(DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: fragment.map(|(name, targets)| FragmentState {
                module,
                entry_point: Some(name),
                compilation_options: PipelineCompilationOptions::default(),
                targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
