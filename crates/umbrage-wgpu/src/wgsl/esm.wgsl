// Exponential shadow maps (Annen et al. 2008).
fn shadow_encode(depth: f32) -> array<vec4f, 1> {
    return array<vec4f, 1>(vec4f(exp({EXPONENT} * (depth - 1.0)), 0.0, 0.0, 0.0));
}

fn shadow_reconstruct(numbers: array<vec4f, 1>, depth: f32) -> f32 {
    return numbers[0].x * exp({EXPONENT} * (1.0 - depth));
}
