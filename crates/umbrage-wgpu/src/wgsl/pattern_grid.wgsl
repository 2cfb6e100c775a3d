// Places on an even grid in a square of side 1.
fn shadow_pattern(k: i32) -> vec2f {
    return (vec2f(vec2i(k % SHADOW_SPREAD, k / SHADOW_SPREAD)) + 0.5) / f32(SHADOW_SPREAD) - 0.5;
}
