// Chebyshev's one-sided bound on the share of depths that are at least `depth` (Donnelly and Lauritzen 2006, Eq. 5).
fn shadow_chebyshev(moments: vec2f, least_variance: f32, depth: f32) -> f32 {
    if (depth <= moments.x) {
        return 1.0;
    }
    let variance = max(moments.y - moments.x * moments.x, least_variance);
    let beyond = depth - moments.x;
    return variance / (variance + beyond * beyond);
}

// Takes what is below `leak` for shadow, and stretches the rest (Lauritzen 2008).
fn shadow_without_leak(visibility: f32, leak: f32) -> f32 {
    return clamp((visibility - leak) / (1.0 - leak), 0.0, 1.0);
}
