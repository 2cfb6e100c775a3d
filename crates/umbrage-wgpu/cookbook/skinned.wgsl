
@group(1) @binding(0) var<uniform> render_from_joint: array<mat4x4f, 2>;

@vertex
fn skinned(@location(0) position: vec3f, @location(1) joint: u32) -> ShadowCaster {
    return shadow_caster((render_from_joint[joint] * vec4f(position, 1.0)).xyz);
}
