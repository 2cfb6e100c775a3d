// Percentage-closer filtering over a width that knows the warp.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    return shadow_spread_lit(map, receiver, shadow_square(receiver.metric));
}
