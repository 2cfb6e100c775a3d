// Comparisons with the nearest texels, spread over a width that knows the warp, or over a texel where that is wider.
const SHADOW_SPREAD: i32 = {N};

// The sides of a square, as they lie in the map: across and, of what is left, along.
struct ShadowSquare {
    across: vec2f,
    along: vec2f,
}

fn shadow_square(metric: vec3f) -> ShadowSquare {
    let across = sqrt(max(metric.x, 1.0));
    let shear = metric.z / across;
    return ShadowSquare(vec2f(across, shear), vec2f(0.0, sqrt(max(metric.y - shear * shear, 1.0))));
}

// The texel at a place of the pattern, of those that are drawn.
fn shadow_spread_texel(map: u32, texel: vec2f, square: ShadowSquare, k: i32) -> vec2f {
    let at = shadow_pattern(k);
    let high = shadow_maps[map].size + {GUTTER} - 1e-3;
    return floor(clamp(texel + at.x * square.across + at.y * square.along, vec2f(-{GUTTER}), high));
}

fn shadow_spread_depth(map: u32, texel: vec2f) -> f32 {
    return textureLoad(shadow_depths, vec2i(texel + shadow_maps[map].origin){LAYER}, 0);
}

// The lit share of a square.
fn shadow_spread_lit(map: u32, receiver: ShadowReceiver, square: ShadowSquare) -> f32 {
    var lit = 0.0;
    for (var k = 0; k < SHADOW_SPREAD * SHADOW_SPREAD; k++) {
        let texel = shadow_spread_texel(map, receiver.texel, square, k);
        let depth = shadow_spread_depth(map, texel);
        lit += select(0.0, 1.0, depth >= shadow_nearest_lit(receiver, texel + 0.5));
    }
    return lit / f32(SHADOW_SPREAD * SHADOW_SPREAD);
}
