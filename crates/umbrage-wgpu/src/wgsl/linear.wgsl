// Depth as a share of the way along the beam through a point in texel coordinates. `beam_scale` has, of the points of the beam, the
// fourth coordinate where depth is 0 (as a function of the texel) and its growth to where depth is 1.
fn shadow_linear_depth(beam_scale: vec4f, texel: vec2f, depth: f32) -> f32 {
    let begin = dot(beam_scale.xy, texel) + beam_scale.w;
    let end = begin + beam_scale.z;
    if (begin > 0.0 && end > 0.0) {
        return depth * end / (begin + beam_scale.z * depth);
    }
    return depth;
}
