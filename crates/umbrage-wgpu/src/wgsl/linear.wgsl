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

// The same in the slab that a map's receivers lie in. `slab` has the growth of its near side per texel in s and t, its near side at texel 0, and one over
// its thickness.
fn shadow_slab_depth(beam_scale: vec4f, slab: vec4f, texel: vec2f, depth: f32) -> f32 {
    return (shadow_linear_depth(beam_scale, texel, depth) - slab.z - dot(slab.xy, texel)) * slab.w;
}

// How slab depth changes along a surface whose depth does by `slope`, per texel.
fn shadow_slab_slope(beam_scale: vec4f, slab: vec4f, texel: vec2f, depth: f32, slope: vec2f) -> vec2f {
    let begin = dot(beam_scale.xy, texel) + beam_scale.w;
    let end = begin + beam_scale.z;
    let here = begin + beam_scale.z * depth;
    var linear = slope;
    if (begin > 0.0 && end > 0.0) {
        // Of depth · end/here, with respect to depth and to the beam.
        linear = (slope * begin * end + beam_scale.xy * depth * beam_scale.z * (depth - 1.0)) / (here * here);
    }
    return (linear - slab.xy) * slab.w;
}
