// Percentage-closer filtering over an exact box of N × N texels, by bilinear comparisons placed so that their weights
// are the box's.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let start = receiver.texel - 0.5 * f32(SHADOW_PCF);
    let first = floor(start);
    let fraction = start - first;
    let origin = shadow_maps[map].origin;
    var sum = 0.0;
    for (var y = 0; y <= SHADOW_PCF; y += 2) {
        let row = shadow_pcf_weight(y + 1, fraction.y);
        let rows = row + shadow_pcf_weight(y, fraction.y);
        for (var x = 0; x <= SHADOW_PCF; x += 2) {
            let column = shadow_pcf_weight(x + 1, fraction.x);
            let columns = column + shadow_pcf_weight(x, fraction.x);
            let weight = rows * columns;
            if (weight > 0.0) {
                let low = first + vec2f(vec2i(x, y));
                let center = low + 0.5 + vec2f(column / columns, row / rows);
                let at = (center + origin) * shadow_settings.texture_scale;
                let limit = shadow_hardware_limit(receiver, low + 1.0, 0.5);
                sum += weight * textureSampleCompareLevel(shadow_depths, shadow_sampler, at{LAYER}, limit);
            }
        }
    }
    return sum / f32(SHADOW_PCF * SHADOW_PCF);
}
