// A filter that was applied ahead of lookup: samples of numbers whose means tell the lit share.

// Where it samples: at 2 side + 1 places, `step` apart.
struct ShadowFootprint {
    lod: f32,
    step: vec2f,
    side: i32,
    // Variances in s and t, and covariance, texels².
    covariance: vec3f,
}

fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let first = {FIRST_LAYER};
    let origin = shadow_maps[map].origin;
    let footprint = shadow_footprint(receiver);
    // No nearer to the ends of what is drawn than half a texel of the level.
    let inset = 0.5 * exp2(ceil(footprint.lod)) - {GUTTER};
    let drawn = ceil((shadow_maps[map].size + 2.0 * {GUTTER}) / {ALIGN}) * {ALIGN} - {GUTTER};
    let low = vec2f(inset);
    let high = max(low, drawn - 1e-3 - (inset + {GUTTER}));
    var numbers: array<vec4f, {TEXTURES}>;
    var weights = 0.0;
    for (var k = -footprint.side; k <= footprint.side; k++) {
        let relative = f32(k) / f32(max(footprint.side, 1));
        let weight = exp(-2.0 * relative * relative);
        weights += weight;
        let texel = clamp(receiver.texel + f32(k) * footprint.step, low, high);
        let at = (texel + origin) * shadow_settings.texture_scale;
        for (var i = 0u; i < {TEXTURES}u; i++) {
            let here = textureSampleLevel(shadow_depths, shadow_sampler, at, first + i, footprint.lod);
            numbers[i] += weight * here;
        }
    }
    for (var i = 0u; i < {TEXTURES}u; i++) {
        numbers[i] /= weights;
    }
    // How much the receiver's own plane varies over the filter, as far as the numbers cannot tell it from occluders.
    let beam_scale = shadow_maps[map].beam_scale;
    let slab = shadow_maps[map].slab;
    let expected = min(receiver.depth, 1.0) - receiver.slack;
    let slope = shadow_slab_slope(beam_scale, slab, receiver.texel, expected, receiver.slope);
    let variance = footprint.covariance.x * slope.x * slope.x + footprint.covariance.y * slope.y * slope.y
        + 2.0 * footprint.covariance.z * slope.x * slope.y;
    let plane = {PLANE_DEVIATIONS} * sqrt(max(variance, 0.0));
    let depth = shadow_slab_depth(beam_scale, slab, receiver.texel, expected) - plane;
    return clamp(shadow_reconstruct(numbers, depth), 0.0, 1.0);
}
