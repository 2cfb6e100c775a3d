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
    let lod = clamp(log2(max(minor, major / 7.0) * 2.0), 0.0, {LAST_LEVEL});
    let sample = 0.5 * exp2(lod);
    let rest = sqrt(max(major * major - sample * sample, 0.0));
    let side = min(ceil(2.0 * rest / exp2(lod)), 7.0);
    var axis = vec2f(covariance.z, spread - difference);
    if (difference > 0.0) {
        axis = vec2f(difference + spread, covariance.z);
    }
    let size = length(axis);
    let step = select(vec2f(0.0), axis / size, size > 0.0) * (2.0 * rest / max(side, 1.0));
    let least = sample * sample;
    let wide = vec3f(max(covariance.xy, vec2f(least)), covariance.z);
    return ShadowFootprint(lod, step, i32(side), wide);
}
