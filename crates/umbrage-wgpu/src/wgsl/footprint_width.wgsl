// As wide as is wanted, whatever the warp: in a copy of the map whose samples are narrower than the footprint, at several places along and across it.

// How many places an axis of variance `rest` (beyond that of a sample) takes, and how far apart they are, in units of the level's texels.
fn shadow_spread(rest: f32) -> vec2f {
    if (rest <= 1e-6) {
        return vec2f(1.0, 0.0);
    }
    let n = clamp(ceil(1.5 * sqrt(rest)), 2.0, {MAX_SAMPLES});
    // Places that are cut off at two deviations have less variance than what they stand for; two have the same.
    let kept = select({KEPT_VARIANCE}, 1.0, n == 2.0);
    return vec2f(n, sqrt(rest / kept) * 4.0 / n);
}

fn shadow_footprint(receiver: ShadowReceiver) -> ShadowFootprint {
    let covariance = receiver.metric * {VARIANCE};
    let mean = 0.5 * (covariance.x + covariance.y);
    let half_difference = 0.5 * (covariance.x - covariance.y);
    let spread = length(vec2f(half_difference, covariance.z));
    let major = min(mean + spread, 1e12);
    let minor = max(mean - spread, major / {ANISOTROPY_SQUARED});
    let level = clamp(floor(0.5 * log2(minor / {LEAST_VARIANCE})), f32({FIRST_LEVEL}), f32({LAST_LEVEL}));
    // Squares of the level's texels.
    let texel = exp2(2.0 * level);
    let along = shadow_spread(major / texel - {SAMPLE_VARIANCE});
    let across = shadow_spread(minor / texel - {SAMPLE_VARIANCE});
    var axis = vec2f(covariance.z, spread - half_difference);
    if (half_difference > 0.0) {
        axis = vec2f(half_difference + spread, covariance.z);
    }
    let axis_length = length(axis);
    axis = select(vec2f(1.0, 0.0), axis / axis_length, axis_length > 0.0);
    let least = max({SAMPLE_VARIANCE} * texel, minor);
    let longer = max(major - least, 0.0);
    let wide = vec3f(vec2f(least) + longer * axis * axis, longer * axis.x * axis.y);
    axis *= exp2(level);
    let samples = vec2u(u32(along.x), u32(across.x));
    return ShadowFootprint(i32(level), samples, axis * along.y, vec2f(-axis.y, axis.x) * across.y, wide);
}
