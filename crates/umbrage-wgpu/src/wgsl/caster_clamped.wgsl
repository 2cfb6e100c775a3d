
// Clip-space position of a caster's point, in render space. The device clamps depth.
fn shadow_caster_clip(render_position: vec3f) -> vec4f {
    return shadow_caster_map.clip_from_render * vec4f(render_position, 1.0);
}
