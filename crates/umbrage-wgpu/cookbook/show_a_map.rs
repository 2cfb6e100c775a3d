use umbrage_wgpu::Shadows;

/// A pipeline that draws the maps' depths into the lower left quarter of a picture: four vertices,
/// no vertex buffer, with Umbrage's lookup as group 0. The same text has `map_tint`, which tells in
/// your own shader which map serves a point and where its texels lie.
pub fn map_overlay(
    device: &wgpu::Device,
    shadows: &Shadows,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let text = shadows.lookup_wgsl(0) + include_str!("show_a_map.wgsl");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("map overlay"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("map overlay"),
        bind_group_layouts: &[Some(shadows.lookup_layout())],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("map overlay"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("map_corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("map_depths"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
