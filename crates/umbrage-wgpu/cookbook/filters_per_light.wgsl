
fn light_at(position: vec3f, normal: vec3f) -> vec2f {
    return vec2f(
        sun_shadow_visibility(0u, position, normal),
        lamp_shadow_visibility(0u, position, normal),
    );
}
