use umbrage_wgpu::Shadows;

/// A vertex: its position, and the joint that moves it.
pub const VERTEX: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
    array_stride: 16,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32],
};

/// A pipeline that draws skinned casters. `joints` is the layout of bind group 1, which holds the
/// joints' matrices. Displaced or procedural casters differ in the shader's text alone.
pub fn skinned_casters(
    device: &wgpu::Device,
    shadows: &Shadows,
    joints: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let text = shadows.caster_wgsl(0) + include_str!("skinned.wgsl");
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("skinned casters"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("skinned casters"),
        // Umbrage's group 0 has the map's matrix and is bound by `Prepared::encode`.
        bind_group_layouts: &[Some(shadows.caster_layout()), Some(joints)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("skinned casters"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("skinned"),
            compilation_options: Default::default(),
            buffers: &[Some(VERTEX)],
        },
        // Devices that clamp depths need no fragment stage; the others get Umbrage's.
        fragment: shadows.caster_fragment(&module),
        primitive: shadows.primitive_state(),
        depth_stencil: Some(shadows.depth_stencil_state()),
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
