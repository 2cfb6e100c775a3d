// Where a depth lies in the slab that a map's receivers lie in: 0 at its near side, 1 at its far side.
//
// Under parallel light `slab` has the growth of its near side per texel in s and t, its near side at texel 0, and one over its thickness. Under a lamp it is about
// distances: `beam_scale` has, of the points of a beam, the fourth coordinate where depth is 0 (as a function of the texel) and its growth to where depth is 1;
// `slab` their distance times that coordinate, and where the slab begins, both over its thickness.
fn shadow_slab_depth(beam_scale: vec4f, slab: vec4f, texel: vec2f, depth: f32) -> f32 {
    let of_texel = dot(slab.xy, texel) + slab.z;
    if (beam_scale.z == 0.0) {
        return (depth - of_texel) * slab.w;
    }
    let w = dot(beam_scale.xy, texel) + beam_scale.w + beam_scale.z * depth;
    // What is beyond infinity is behind everything.
    return select(1.0, of_texel / w - slab.w, w > 0.0);
}
