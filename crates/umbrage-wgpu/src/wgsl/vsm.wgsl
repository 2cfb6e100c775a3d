// Variance shadow maps (Donnelly and Lauritzen 2006).
fn shadow_encode(depth: f32) -> array<vec4f, 1> {
    return array<vec4f, 1>(vec4f(depth, depth * depth, 0.0, 0.0));
}

fn shadow_reconstruct(numbers: array<vec4f, 1>, depth: f32) -> f32 {
    return shadow_without_leak(shadow_chebyshev(numbers[0].xy, 2.5e-7, depth), {LEAK});
}
