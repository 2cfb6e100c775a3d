use umbrage_wgpu::Shadows;

/// The layout of bind group 0: a matrix from clip space to render space, the viewer's depths, and
/// the G-buffer's normals.
pub fn gbuffer_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("G-buffer"),
        entries: &[
            entry(0, uniform),
            entry(1, texture(wgpu::TextureSampleType::Depth)),
            entry(2, texture(wgpu::TextureSampleType::Float { filterable: false })),
        ],
    })
}

/// A pipeline that shades all pixels of the G-buffer in one triangle. Umbrage's lookup is group 1.
pub fn deferred_shading(
    device: &wgpu::Device,
    shadows: &Shadows,
    gbuffer: &wgpu::BindGroupLayout,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let text = shadows.lookup_wgsl(1) + include_str!("deferred.wgsl");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("deferred shading"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("deferred shading"),
        bind_group_layouts: &[Some(gbuffer), Some(shadows.lookup_layout())],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("deferred shading"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("full_screen"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("shade"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
