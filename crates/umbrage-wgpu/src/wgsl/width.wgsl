// Squares of two gradients of texels, and their product.
fn shadow_metric(s: vec3f, t: vec3f) -> vec3f {
    return vec3f(dot(s, s), dot(t, t), dot(s, t));
}

// Squares of the texels to a pixel of the viewer's picture, on the surface's plane: a step across the view slides along the view until it meets the plane.
// More where it is seen at a slant, up to 16 times.
fn shadow_pixel_metric(point: ShadowPoint, position: vec3f, normal: vec3f) -> vec3f {
    let pixel_metres = max(dot(shadow_settings.pixel_gradient, vec4f(position, 1.0)), 0.0);
    let from_eye = position - shadow_settings.eye.xyz;
    let view = from_eye / max(length(from_eye), 1e-30);
    let unit_normal = normalize(normal);
    let slant = dot(unit_normal, view);
    let slope = unit_normal / select(min(slant, -0.0625), max(slant, 0.0625), slant >= 0.0);
    let s = point.grad_s - slope * dot(point.grad_s, view);
    let t = point.grad_t - slope * dot(point.grad_t, view);
    return shadow_metric((s - view * dot(s, view)) * pixel_metres, (t - view * dot(t, view)) * pixel_metres);
}
