// How much of each texel a box of N texels covers, along one axis; it begins `fraction` into texel 0.
const SHADOW_PCF: i32 = {N};

fn shadow_pcf_weight(k: i32, fraction: f32) -> f32 {
    if (k == 0) {
        return 1.0 - fraction;
    }
    return select(select(0.0, fraction, k == SHADOW_PCF), 1.0, k < SHADOW_PCF);
}
