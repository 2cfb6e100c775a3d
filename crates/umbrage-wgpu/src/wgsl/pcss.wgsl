// Percentage-closer soft shadows (Fernando 2005), for a light of diameter {SOURCE}: a lamp's in metres, the sun's per metre of distance.

// How wide the penumbra is of what lies at this depth on the beam through a texel, metres across the receiver's beam.
fn shadow_penumbra(beam_scale: vec4f, receiver: ShadowReceiver, texel: vec2f, depth: f32) -> f32 {
    let here = dot(beam_scale.xy, receiver.texel) + beam_scale.w;
    let there = dot(beam_scale.xy, texel) + beam_scale.w;
    let level = receiver.depth + dot(receiver.level_slope, texel - receiver.texel);
    if (beam_scale.z == 0.0) {
        return {SOURCE} * max((level - depth) / (receiver.depth_per_metre * there / here), 0.0);
    }
    // Distances from a lamp go with one over the fourth coordinate.
    let at = there + beam_scale.z * depth;
    let at_level = there + beam_scale.z * level;
    return {SOURCE} * select(0.0, clamp(at / at_level - 1.0, 0.0, 1e6), at_level > 0.0);
}

fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let beam_scale = shadow_maps[map].beam_scale;
    // What hides some of the light lies between here and it, where the map's depths begin at the latest.
    let reach = shadow_penumbra(beam_scale, receiver, receiver.texel, 0.0);
    let search = shadow_square(receiver.metric * (reach * reach));
    var width = 0.0;
    var hidden = 0.0;
    for (var k = 0; k < SHADOW_SPREAD * SHADOW_SPREAD; k++) {
        let texel = shadow_spread_texel(map, receiver.texel, search, k);
        let depth = shadow_spread_depth(map, texel);
        if (depth < shadow_nearest_lit(receiver, texel + 0.5)) {
            width += shadow_penumbra(beam_scale, receiver, texel + 0.5, depth);
            hidden += 1.0;
        }
    }
    if (hidden == 0.0) {
        return 1.0;
    }
    width /= hidden;
    return shadow_spread_lit(map, receiver, shadow_square(receiver.metric * (width * width)));
}
