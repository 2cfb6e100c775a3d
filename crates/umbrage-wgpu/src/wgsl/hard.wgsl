// The nearest texel.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let texel = min(floor(receiver.texel), shadow_maps[map].size - 1.0);
    let limit = shadow_nearest_lit(receiver, texel + 0.5);
    let place = vec2i(texel + shadow_maps[map].origin);
    let depth = textureLoad(shadow_depths, place{LAYER}, 0);
    return select(0.0, 1.0, depth >= limit);
}
