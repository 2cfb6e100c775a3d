// Scenes as clusters of triangles. The texts of `forward.wgsl`, and of the clusters in bind group 3,
// must precede this one.

@vertex
fn cluster_vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let vertex = shadow_cluster_vertex(index);
    let instance = shadow_cluster_instances[vertex.instance];
    let packed = shadow_cluster_attribute(vertex.vertex, 0u);
    let normal = turned_normal(instance.x.xyz, instance.y.xyz, instance.z.xyz, packed);
    let clip = view.clip_from_render * vec4f(vertex.position, 1.0);
    let uv_alpha = shadow_cluster_texture(vertex);
    return Fragment(clip, vertex.position, normal, uv_alpha, vec2u(vertex.cluster, vertex.level));
}

@vertex
fn cluster_depth(@builtin(vertex_index) index: u32) -> @builtin(position) @invariant vec4f {
    return view.clip_from_render * vec4f(shadow_cluster_vertex(index).position, 1.0);
}
