// Numbers in place of depths, and their blur, map by map.

struct ShadowPrefilterMap {
    beam_scale: vec4f,
    slab: vec4f,
    // Where the map begins in the texture.
    origin: vec2f,
    // First layer of the numbers.
    first_layer: u32,
}

@group(0) @binding(0) var<uniform> shadow_prefilter_map: ShadowPrefilterMap;
//IF ENCODE
@group(0) @binding(1) var shadow_prefilter_depths: texture_depth_2d;
//ELSE
@group(0) @binding(1) var shadow_prefilter_source: texture_2d_array<f32>;
//END

struct ShadowPrefiltered {
{OUTPUTS}
}

@vertex
fn shadow_prefilter_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

//IF ENCODE
// The numbers of a texel of the map.
fn shadow_encoded(at: vec2i) -> array<vec4f, {TEXTURES}> {
    let depth = textureLoad(shadow_prefilter_depths, at, 0);
    let texel = vec2f(at) + 0.5 - shadow_prefilter_map.origin;
    let in_slab = shadow_slab_depth(shadow_prefilter_map.beam_scale, shadow_prefilter_map.slab, texel, depth);
    return shadow_encode(clamp(in_slab, 0.0, 1.0));
}

@fragment
fn shadow_prefilter_fragment(@builtin(position) at: vec4f) -> ShadowPrefiltered {
//IF HALF
    let corner = 2 * vec2i(at.xy);
    var numbers = array<vec4f, {TEXTURES}>();
    for (var k = 0; k < 4; k++) {
        let encoded = shadow_encoded(corner + vec2i(k % 2, k / 2));
        for (var i = 0; i < {TEXTURES}; i++) {
            numbers[i] += 0.25 * encoded[i];
        }
    }
//ELSE
    let numbers = shadow_encoded(vec2i(at.xy));
//END
    return ShadowPrefiltered({VALUES});
}
//ELSE
//IF HALVE
// Four texels of the level above.
fn shadow_blurred(at: vec2i, layer: u32) -> vec4f {
    let first = 2 * at;
    let upper = textureLoad(shadow_prefilter_source, first, layer, 0)
        + textureLoad(shadow_prefilter_source, first + vec2i(1, 0), layer, 0);
    let lower = textureLoad(shadow_prefilter_source, first + vec2i(0, 1), layer, 0)
        + textureLoad(shadow_prefilter_source, first + vec2i(1, 1), layer, 0);
    return 0.25 * (upper + lower);
}
//ELSE
fn shadow_blurred(at: vec2i, layer: u32) -> vec4f {
    var sum = {WEIGHT_0} * textureLoad(shadow_prefilter_source, at, layer, 0);
{TAPS}
    return sum;
}
//END

@fragment
fn shadow_prefilter_fragment(@builtin(position) at: vec4f) -> ShadowPrefiltered {
    let texel = vec2i(at.xy);
    let layer = shadow_prefilter_map.first_layer;
    return ShadowPrefiltered({VALUES});
}
//END
