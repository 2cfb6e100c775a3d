// Comparison by the texture unit. It compares four texels with one depth, which must be the least that any of them
// may have: where the receiver is steep, contacts come out a texel's slope later than when each has its own.

// How far the receiver's depth may be below that at the corner of four texels, at the middle of any of them.
fn shadow_hardware_limit(receiver: ShadowReceiver, corner: vec2f, reach: f32) -> f32 {
    let rise = dot(receiver.slope, corner - receiver.texel);
    let fall = reach * (abs(receiver.slope.x) + abs(receiver.slope.y));
    return shadow_limit(min(receiver.depth, receiver.depth + rise - fall), receiver.slack);
}
