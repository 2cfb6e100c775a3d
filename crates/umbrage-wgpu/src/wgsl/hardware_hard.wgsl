// The nearest texel.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let center = min(floor(receiver.texel), shadow_maps[map].size - 1.0) + 0.5;
    let at = (center + shadow_maps[map].origin) * shadow_settings.texture_scale;
    let limit = shadow_hardware_limit(receiver, center, 0.0);
    return textureSampleCompareLevel(shadow_depths, shadow_sampler, at{LAYER}, limit);
}
