
// Clip-space position of a caster's point, in render space. The device would clip depth, so depth goes another way:
// hand `shadow_caster_depth` on to the fragment shader, and write `shadow_fragment_depth` of it there.
fn shadow_caster_clip(render_position: vec3f) -> vec4f {
    let clip = shadow_caster_map.clip_from_render * vec4f(render_position, 1.0);
    return vec4f(clip.xy, 0.5 * clip.w, clip.w);
}

// Depth and w, to be interpolated with perspective.
fn shadow_caster_depth(render_position: vec3f) -> vec2f {
    let clip = shadow_caster_map.clip_from_render * vec4f(render_position, 1.0);
    return clip.zw;
}

// What to write as `@builtin(frag_depth)`.
fn shadow_fragment_depth(depth: vec2f) -> f32 {
    return clamp(depth.x / depth.y, 0.0, 1.0);
}
