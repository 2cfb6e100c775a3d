// Convolution shadow maps (Annen et al. 2007): sines and cosines of depth, two pairs to a texture. From one term to the next the angle grows by
// as much, so that two sines and cosines are enough for all.
const SHADOW_CSM_RATE: f32 = {RATE};

fn shadow_turned(pair: vec2f, by: vec2f) -> vec2f {
    // (sin, cos) of the sum of two angles.
    return vec2f(pair.x * by.y + pair.y * by.x, pair.y * by.y - pair.x * by.x);
}

fn shadow_encode(depth: f32) -> array<vec4f, {TEXTURES}> {
    let angle = SHADOW_CSM_RATE * depth;
    let step = vec2f(sin(2.0 * angle), cos(2.0 * angle));
    var pair = vec2f(sin(angle), cos(angle));
    var numbers: array<vec4f, {TEXTURES}>;
    for (var i = 0; i < {TEXTURES}; i++) {
        let next = shadow_turned(pair, step);
        numbers[i] = vec4f(pair, next);
        pair = shadow_turned(next, step);
    }
    return numbers;
}

fn shadow_reconstruct(numbers: array<vec4f, {TEXTURES}>, depth: f32) -> f32 {
    // Two amounts to a texture; those beyond the order are 0.
    var amounts = array<vec2f, {TEXTURES}>({AMOUNTS});
    var filtered = numbers;
    let angle = SHADOW_CSM_RATE * (depth - {SHIFT});
    let step = vec2f(sin(2.0 * angle), cos(2.0 * angle));
    var pair = vec2f(sin(angle), cos(angle));
    var sum = 0.5;
    for (var i = 0; i < {TEXTURES}; i++) {
        let next = shadow_turned(pair, step);
        let n = filtered[i];
        sum += amounts[i].x * (n.x * pair.y - n.y * pair.x) + amounts[i].y * (n.z * next.y - n.w * next.x);
        pair = shadow_turned(next, step);
    }
    return ({GAIN} * sum - {LEAK}) / (1.0 - {LEAK});
}
