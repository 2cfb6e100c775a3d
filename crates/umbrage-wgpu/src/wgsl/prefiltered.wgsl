// A filter that was applied ahead of lookup: one bilinear sample of numbers whose means tell the lit share.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let at = (receiver.texel + shadow_maps[map].origin) * shadow_settings.texture_scale;
    let first = {FIRST_LAYER};
    var numbers: array<vec4f, {TEXTURES}>;
    for (var i = 0u; i < {TEXTURES}u; i++) {
        numbers[i] = textureSampleLevel(shadow_depths, shadow_sampler, at, first + i, 0.0);
    }
    // How much the receiver's own plane varies over the filter, as far as the numbers cannot tell it from occluders.
    let plane = {PLANE_DEVIATION} * length(receiver.slope);
    let expected = min(receiver.depth, 1.0) - receiver.slack - plane;
    let depth = shadow_linear_depth(shadow_maps[map].beam_scale, receiver.texel, expected);
    return clamp(shadow_reconstruct(numbers, depth), 0.0, 1.0);
}
