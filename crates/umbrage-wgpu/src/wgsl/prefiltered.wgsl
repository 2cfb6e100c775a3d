// A filter that was applied ahead of lookup: samples of numbers whose means tell the lit share.

// Where it samples: at `samples.x` places along a footprint by `samples.y` across it.
struct ShadowFootprint {
    // Texels there are two to the power of this wide.
    level: i32,
    samples: vec2u,
    // From place to place, texels.
    step_along: vec2f,
    step_across: vec2f,
    // Variances in s and t, and covariance, texels².
    covariance: vec3f,
}

fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let first = {FIRST_LAYER};
    let origin = shadow_maps[map].origin;
    let footprint = shadow_footprint(receiver);
    // No nearer to the ends of what is drawn than half a texel of the level.
    let inset = 0.5 * f32(1u << u32(footprint.level)) - {GUTTER};
    let drawn = ceil((shadow_maps[map].size + 2.0 * {GUTTER}) / {ALIGN}) * {ALIGN} - {GUTTER};
    let low = vec2f(inset);
    let high = max(low, drawn - 1e-3 - (inset + {GUTTER}));
    let lod = f32(footprint.level - {FIRST_LEVEL});
//IF SEVERAL
    var numbers: array<vec4f, {TEXTURES}>;
    var weights = 0.0;
    let middle = 0.5 * vec2f(footprint.samples - 1u);
    let scale = 4.0 / vec2f(footprint.samples);
    for (var j = 0u; j < footprint.samples.y; j++) {
        for (var i = 0u; i < footprint.samples.x; i++) {
            let place = vec2f(vec2u(i, j)) - middle;
            let sigmas = place * scale;
            let weight = exp(-0.5 * dot(sigmas, sigmas));
            weights += weight;
            let offset = place.x * footprint.step_along + place.y * footprint.step_across;
            let at = (clamp(receiver.texel + offset, low, high) + origin) * shadow_settings.texture_scale;
            for (var t = 0u; t < {TEXTURES}u; t++) {
                numbers[t] += weight * textureSampleLevel(shadow_depths, shadow_sampler, at, first + t, lod);
            }
        }
    }
    for (var t = 0u; t < {TEXTURES}u; t++) {
        numbers[t] /= weights;
    }
//ELSE
    let at = (clamp(receiver.texel, low, high) + origin) * shadow_settings.texture_scale;
    let numbers = array<vec4f, {TEXTURES}>({SAMPLES});
//END
    // How much the receiver's own plane varies over the filter, over the slab's planes, as far as the numbers cannot tell it from occluders.
    let beam_scale = shadow_maps[map].beam_scale;
    let slab = shadow_maps[map].slab;
    let slope = receiver.slope - select(vec2f(0.0), slab.xy, beam_scale.z == 0.0);
    let variance = footprint.covariance.x * slope.x * slope.x + footprint.covariance.y * slope.y * slope.y
        + 2.0 * footprint.covariance.z * slope.x * slope.y;
    let plane = {PLANE_DEVIATIONS} * sqrt(max(variance, 0.0));
    let expected = min(receiver.depth, 1.0) - receiver.slack - plane;
    // What is stored lies between 0 and 1, and periods end there.
    let depth = clamp(shadow_slab_depth(beam_scale, slab, receiver.texel, expected), 0.0, 1.0);
    return clamp(shadow_reconstruct(numbers, depth), 0.0, 1.0);
}
