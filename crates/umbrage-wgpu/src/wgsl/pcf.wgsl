// Percentage-closer filtering (Reeves, Salesin and Cook 1987): the share of lit texels in a box of N × N texels. The
// box is exact, so (N + 1)² texels count, four of which are fetched at a time; each is compared with the depth of
// the receiver's own plane there.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {
    let start = receiver.texel - 0.5 * f32(SHADOW_PCF);
    let first = floor(start);
    let fraction = start - first;
    let origin = shadow_maps[map].origin;
    var sum = 0.0;
    for (var y = 0; y <= SHADOW_PCF; y += 2) {
        let rows = vec2f(shadow_pcf_weight(y, fraction.y), shadow_pcf_weight(y + 1, fraction.y));
        for (var x = 0; x <= SHADOW_PCF; x += 2) {
            let columns = vec2f(shadow_pcf_weight(x, fraction.x), shadow_pcf_weight(x + 1, fraction.x));
            // The corner where four texels meet.
            let corner = first + vec2f(vec2i(x, y)) + 1.0;
            let at = (corner + origin) * shadow_settings.texture_scale;
            let depths = textureGather(shadow_depths, shadow_sampler, at{LAYER});
            // Lower left, lower right, upper right, upper left, where up is towards smaller t.
            let limits = vec4f(
                shadow_nearest_lit(receiver, corner + vec2f(-0.5, 0.5)),
                shadow_nearest_lit(receiver, corner + vec2f(0.5, 0.5)),
                shadow_nearest_lit(receiver, corner + vec2f(0.5, -0.5)),
                shadow_nearest_lit(receiver, corner + vec2f(-0.5, -0.5)),
            );
            let weights = columns.xyyx * rows.yyxx;
            sum += dot(weights, select(vec4f(0.0), vec4f(1.0), depths >= limits));
        }
    }
    return sum / f32(SHADOW_PCF * SHADOW_PCF);
}
