// As wide across the light as is wanted, whatever the warp: in the smallest copy of the map whose samples are as wide as the narrow side of the
// footprint, at several places along its long side.
fn shadow_footprint(receiver: ShadowReceiver) -> ShadowFootprint {
    let deviation = {DEVIATION} * {WIDTH};
    let covariance = receiver.metric * (deviation * deviation);
    let mean = 0.5 * (covariance.x + covariance.y);
    let difference = 0.5 * (covariance.x - covariance.y);
    let spread = length(vec2f(difference, covariance.z));
    let major = sqrt(mean + spread);
    let minor = sqrt(max(mean - spread, 0.0));
    let sample = clamp(max(minor, major / 7.0), 0.5, 0.5 * exp2({LAST_LEVEL}));
    let size = 2.0 * sample;
    // Between two levels it is variances that mix linearly, of which the larger is four times the smaller.
    let level = min(floor(log2(size)), {LAST_LEVEL});
    let ratio = size / exp2(level);
    let lod = min(level + clamp((ratio * ratio - 1.0) / 3.0, 0.0, 1.0), {LAST_LEVEL});
    let rest = sqrt(max(major * major - sample * sample, 0.0));
    let side = min(ceil(2.0 * rest / size), 7.0);
    var axis = vec2f(covariance.z, spread - difference);
    if (difference > 0.0) {
        axis = vec2f(difference + spread, covariance.z);
    }
    let axis_length = length(axis);
    let step = select(vec2f(0.0), axis / axis_length, axis_length > 0.0) * (2.0 * rest / max(side, 1.0));
    let least = sample * sample;
    let wide = vec3f(max(covariance.xy, vec2f(least)), covariance.z);
    return ShadowFootprint(lod, step, i32(side), wide);
}
