// Nothing casts here: a triangle over all of the viewport at the farthest depth.
@vertex
fn shadow_clear_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 1.0, 1.0);
}
