use crate::pages::check_pages;
use crate::pages::meshes::draw_layout as mesh_draw_layout;
use crate::{ClusterGeometry, Error, Shadows, data, wgsl};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Vec4};
use std::mem::size_of;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType, BufferDescriptor,
    BufferUsages, Device, FragmentState, PipelineCompilationOptions, PipelineLayoutDescriptor,
    Queue, RenderPipeline, RenderPipelineDescriptor, Sampler, SamplerBindingType,
    ShaderModuleDescriptor, ShaderSource, ShaderStages, TextureSampleType, TextureView,
    TextureViewDimension, VertexAttribute, VertexBufferLayout, VertexFormat, VertexState,
    VertexStepMode,
};

/// Draws instanced meshes, opaque or alpha-masked, into shadow maps. Each position is multiplied by
/// its instance's matrix. The maps are the same on every device. For other meshes, such as skinned
/// ones, write a vertex stage of your own (see [`Shadows::caster_wgsl`]).
#[derive(Clone, Debug)]
pub struct MeshCasters {
    pipeline: RenderPipeline,
    mask_layout: Option<BindGroupLayout>,
}

/// Whether meshes have holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshKind {
    /// Meshes without holes.
    Opaque,
    /// Meshes with holes: nothing casts where the material's alpha is below a cutoff (see
    /// [`Mask`]).
    Masked,
}

/// One instance of a mesh, as stored in the vertex buffer.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CasterInstance {
    /// The three rows of the matrix from mesh space to render space.
    pub render_from_mesh: [Vec4; 3],
}

/// The alpha of a masked material, which is `factor` times the alpha of the texture and of the
/// vertices.
#[derive(Clone, Copy, Debug)]
pub struct Mask<'a> {
    /// The texture whose alpha is used. It is sampled at mip level 0.
    pub texture: &'a TextureView,
    /// A filtering sampler.
    pub sampler: &'a Sampler,
    /// The factor by which the texture's alpha is multiplied.
    pub factor: f32,
    /// Points whose alpha is below this value are holes.
    pub cutoff: f32,
}

impl CasterInstance {
    /// Layout of a vertex buffer of instances, at shader locations 1, 2 and 3.
    pub const LAYOUT: VertexBufferLayout<'static> = VertexBufferLayout {
        array_stride: size_of::<Self>() as u64,
        step_mode: VertexStepMode::Instance,
        attributes: &[row(0), row(1), row(2)],
    };

    /// An instance with the matrix `world_from_mesh` from mesh space to world space.
    /// `render_origin` must be that of the [`Frame`](crate::Frame).
    pub fn new(world_from_mesh: &DAffine3, render_origin: DVec3) -> Self {
        let m = world_from_mesh.matrix3;
        let t = world_from_mesh.translation - render_origin;
        let row = |i: usize| m.row(i).extend(t[i]).as_vec4();
        Self { render_from_mesh: [row(0), row(1), row(2)] }
    }
}

const fn row(i: u32) -> VertexAttribute {
    VertexAttribute {
        format: VertexFormat::Float32x4,
        offset: 16 * i as u64,
        shader_location: 1 + i,
    }
}

impl MeshCasters {
    /// Creates the pipeline for vertex buffers with these layouts. `buffers` must have the position
    /// (`Float32x3`) at shader location 0, the instance's rows at locations 1 to 3 (see
    /// [`CasterInstance::LAYOUT`]) and, for masked meshes, texture coordinates (`Float32x2`) at
    /// location 4. Where masked vertices have an alpha of their own, it is the fourth component of
    /// a `Float32x4` there; the third is not read.
    pub fn new(
        device: &Device,
        shadows: &Shadows,
        kind: MeshKind,
        buffers: &[Option<VertexBufferLayout<'_>>],
    ) -> Self {
        let text = wgsl::mesh(shadows.support(), kind == MeshKind::Masked);
        Self::of_text(device, shadows, kind, text, buffers, None)
    }

    /// Draws with the vertex stage of a text, whose own bind group, if it has one, follows those of
    /// the map and the mask.
    pub(crate) fn of_text(
        device: &Device,
        shadows: &Shadows,
        kind: MeshKind,
        text: String,
        buffers: &[Option<VertexBufferLayout<'_>>],
        own: Option<&BindGroupLayout>,
    ) -> Self {
        let fragment = match (kind, shadows.caster_needs_fragment()) {
            (MeshKind::Opaque, false) => None,
            (MeshKind::Opaque, true) => Some("shadow_caster_fragment"),
            (MeshKind::Masked, false) => Some("shadow_mesh_clamped_fragment"),
            (MeshKind::Masked, true) => Some("shadow_mesh_fragment"),
        };
        let stages = Stages { text, vertex: "shadow_mesh_vertex", fragment };
        Self::of_stages(device, shadows, kind, stages, buffers, shadows.caster_layout(), own)
    }

    /// Draws a geometry's clusters into pages, which the bind group of `page_layout` tells of. Their
    /// triangles lie inside the pages or not.
    pub(crate) fn of_pages(
        device: &Device,
        shadows: &Shadows,
        kind: MeshKind,
        text: String,
        are_inside: bool,
        page_layout: &BindGroupLayout,
        geometry: &ClusterGeometry,
    ) -> Self {
        let stages = Stages::in_pages(shadows, kind, text, are_inside);
        let own = Some(geometry.vertex_layout());
        Self::of_stages(device, shadows, kind, stages, &[], page_layout, own)
    }

    /// Creates the pipeline that draws [whole meshes into pages](crate::PageMeshes). `buffers` are
    /// those of [`new`](Self::new), but without the instances' rows.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the shadows have no pages.
    pub fn for_pages(
        device: &Device,
        shadows: &Shadows,
        kind: MeshKind,
        buffers: &[Option<VertexBufferLayout<'_>>],
    ) -> Result<Self, Error> {
        let pages = check_pages(shadows)?;
        let (support, filter) = (shadows.support(), &shadows.options().filter);
        let text = wgsl::page_mesh(support, filter, kind == MeshKind::Masked);
        let stages = Stages::in_pages(shadows, kind, text, false);
        let own = mesh_draw_layout(device);
        let layout = pages.draw_layout();
        Ok(Self::of_stages(device, shadows, kind, stages, buffers, layout, Some(&own)))
    }

    fn of_stages(
        device: &Device,
        shadows: &Shadows,
        kind: MeshKind,
        stages: Stages,
        buffers: &[Option<VertexBufferLayout<'_>>],
        target_layout: &BindGroupLayout,
        own: Option<&BindGroupLayout>,
    ) -> Self {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("shadow casters"),
            source: ShaderSource::Wgsl(stages.text.into()),
        });
        let mask_layout = (kind == MeshKind::Masked).then(|| mask_layout(device));
        let layouts = [Some(target_layout), mask_layout.as_ref(), own];
        let used = layouts.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("shadow casters"),
            bind_group_layouts: &layouts[..used],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&RenderPipelineDescriptor {
            label: Some("shadow casters"),
            layout: Some(&layout),
            vertex: VertexState {
                module: &module,
                entry_point: Some(stages.vertex),
                compilation_options: PipelineCompilationOptions::default(),
                buffers,
            },
            primitive: shadows.primitive_state(),
            depth_stencil: Some(shadows.depth_stencil_state()),
            multisample: wgpu::MultisampleState::default(),
            fragment: stages.fragment.map(|entry_point| FragmentState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: PipelineCompilationOptions::default(),
                targets: &[],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, mask_layout }
    }

    /// The pipeline. Set it in a [`MapPass`](crate::MapPass), set vertex buffers of the layouts
    /// given to [`new`](Self::new) and an index buffer if you use one, and draw. Masked meshes also
    /// need their [mask](Self::mask) in bind group 1.
    pub fn pipeline(&self) -> &RenderPipeline {
        &self.pipeline
    }

    /// The bind group of a mask; `None` if the pipeline is for opaque meshes.
    pub fn mask(&self, device: &Device, queue: &Queue, mask: &Mask<'_>) -> Option<BindGroup> {
        let layout = self.mask_layout.as_ref()?;
        // Interpolation rounds. The margin keeps alphas that equal the cutoff from being holes here
        // and there.
        let cutoff = mask.cutoff * (1.0 - 8.0 * f32::EPSILON);
        let contents = data::Mask { factor: mask.factor, cutoff };
        let uniform = device.create_buffer(&BufferDescriptor {
            label: Some("shadow mask"),
            size: size_of::<data::Mask>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&contents));
        let entry = |binding, resource| BindGroupEntry { binding, resource };
        Some(device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow mask"),
            layout,
            entries: &[
                entry(0, uniform.as_entire_binding()),
                entry(1, BindingResource::TextureView(mask.texture)),
                entry(2, BindingResource::Sampler(mask.sampler)),
            ],
        }))
    }
}

/// The stages that draw casters, by the names of their entry points in a text.
struct Stages {
    text: String,
    vertex: &'static str,
    fragment: Option<&'static str>,
}

impl Stages {
    /// The stages that draw casters into pages.
    fn in_pages(shadows: &Shadows, kind: MeshKind, text: String, are_inside: bool) -> Self {
        // What lies beside a page is clipped, or else discarded.
        let discards = !are_inside && !shadows.support().clip_distances;
        let fragment = match (kind, shadows.caster_needs_fragment()) {
            (MeshKind::Opaque, false) if !discards => None,
            (_, false) => Some("shadow_page_clamped_fragment"),
            (_, true) => Some("shadow_page_fragment"),
        };
        Self { text, vertex: "shadow_page_vertex", fragment }
    }
}

fn mask_layout(device: &Device) -> BindGroupLayout {
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow mask"),
        entries: &[
            entry(
                0,
                BindingType::Buffer {
                    ty: BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
            ),
            entry(
                1,
                BindingType::Texture {
                    sample_type: TextureSampleType::Float { filterable: true },
                    view_dimension: TextureViewDimension::D2,
                    multisampled: false,
                },
            ),
            entry(2, BindingType::Sampler(SamplerBindingType::Filtering)),
        ],
    })
}
