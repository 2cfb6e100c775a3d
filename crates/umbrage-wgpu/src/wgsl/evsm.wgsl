// Exponential variance shadow maps (Lauritzen and McCool 2008).
fn shadow_encode(depth: f32) -> array<vec4f, 1> {
    let positive = exp({EXPONENT} * depth);
    let negative = -exp(-{EXPONENT} * depth);
    return array<vec4f, 1>(vec4f(positive, positive * positive, negative, negative * negative));
}

fn shadow_evsm_bound(moments: vec2f, sign: f32, depth: f32) -> f32 {
    let warped = sign * exp(sign * {EXPONENT} * depth);
    let deviation = 1e-4 * {EXPONENT} * warped;
    return shadow_chebyshev(moments, deviation * deviation, warped);
}

fn shadow_reconstruct(numbers: array<vec4f, 1>, depth: f32) -> f32 {
    var bound = shadow_evsm_bound(numbers[0].xy, 1.0, depth);
    if ({COMPONENTS} == 4) {
        bound = min(bound, shadow_evsm_bound(numbers[0].zw, -1.0, depth));
    }
    return shadow_without_leak(bound, {LEAK});
}
