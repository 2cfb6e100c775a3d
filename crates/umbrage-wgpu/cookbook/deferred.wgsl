
// With the camera's projection in it, reversed or not; render space is what the frame's
// `render_origin` says.
@group(0) @binding(0) var<uniform> render_from_clip: mat4x4f;
@group(0) @binding(1) var depths: texture_depth_2d;
// The triangles' own normals. For interpolated ones see the recipe on smooth normals.
@group(0) @binding(2) var normals: texture_2d<f32>;

@vertex
fn full_screen(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0, 0.0, 1.0);
}

fn render_position(pixel: vec2i) -> vec3f {
    let uv = (vec2f(pixel) + 0.5) / vec2f(textureDimensions(depths));
    let clip = vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, textureLoad(depths, pixel, 0), 1.0);
    let point = render_from_clip * clip;
    return point.xyz / point.w;
}

@fragment
fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    // Whatever your renderer clears depths to.
    if (textureLoad(depths, pixel, 0) == 1.0) {
        return vec4f(0.0, 0.0, 1.0, 1.0);
    }
    let normal = textureLoad(normals, pixel, 0).xyz;
    let light = shadow_visibility(0u, render_position(pixel), normal);
    return vec4f(light, light, 0.0, 1.0);
}
