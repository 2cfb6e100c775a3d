
// Tints what each map serves, and draws a grid of every eighth texel: a debug view of your picture.
fn map_tint(light: u32, position: vec3f) -> vec3f {
    let place = shadow_place(light, position);
    if (place.map == SHADOW_NONE) {
        return vec3f(0.5);
    }
    let hue = f32(shadow_maps[place.map].index) * 0.618;
    let tint = 0.6 + 0.4 * cos(6.2832 * (hue + vec3f(0.0, 0.33, 0.67)));
    let grid = fract(place.texel / 8.0) - 0.5;
    return tint * select(0.8, 1.0, grid.x * grid.y > 0.0);
}

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) st: vec2f,
}

// A rectangle in the lower left of the picture with all of the depth texture in it.
@vertex
fn map_corner(@builtin(vertex_index) index: u32) -> Corner {
    let st = vec2f(f32(index & 1u), f32(index >> 1u));
    return Corner(vec4f(st - 1.0, 0.0, 1.0), st);
}

@fragment
fn map_depths(in: Corner) -> @location(0) vec4f {
    // For filters that are applied ahead of lookup `shadow_depths` has their statistics.
    let size = vec2f(textureDimensions(shadow_depths));
    return vec4f(vec3f(textureLoad(shadow_depths, vec2i(in.st * size), 0)), 1.0);
}
