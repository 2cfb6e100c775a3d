// Percentage-closer filtering over a width that knows the warp: N × N comparisons with the nearest texels, spread evenly over a square across the
// light or in the picture, or over a texel where that is wider.
const SHADOW_SPREAD: i32 = {N};

fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let origin = shadow_maps[map].origin;
    let low = vec2f(-{GUTTER});
    let high = shadow_maps[map].size + {GUTTER} - 1e-3;
    // The sides of the square, as they lie in the map.
    let metric = receiver.metric;
    let across = sqrt(max(metric.x, 1.0));
    let shear = metric.z / across;
    let along = sqrt(max(metric.y - shear * shear, 1.0));
    var lit = 0.0;
    for (var y = 0; y < SHADOW_SPREAD; y++) {
        for (var x = 0; x < SHADOW_SPREAD; x++) {
            let at = (vec2f(vec2i(x, y)) + 0.5) / f32(SHADOW_SPREAD) - 0.5;
            let offset = vec2f(across * at.x, shear * at.x + along * at.y);
            let texel = floor(clamp(receiver.texel + offset, low, high));
            let depth = textureLoad(shadow_depths, vec2i(texel + origin){LAYER}, 0);
            lit += select(0.0, 1.0, depth >= shadow_nearest_lit(receiver, texel + 0.5));
        }
    }
    return lit / f32(SHADOW_SPREAD * SHADOW_SPREAD);
}
