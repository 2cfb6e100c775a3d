// The example's own shader. Umbrage's text stands before it (see `renderer.rs`).

struct View {
    clip_from_world: mat4x4f,
    to_sun: vec3f,
}

@group(0) @binding(0) var<uniform> view: View;

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
}

// `x`, `y` and `z` are the rows of the instance's matrix.
@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) x: vec4f,
    @location(2) y: vec4f,
    @location(3) z: vec4f,
) -> Fragment {
    let point = vec4f(position, 1.0);
    let world = vec3f(dot(x, point), dot(y, point), dot(z, point));
    return Fragment(view.clip_from_world * vec4f(world, 1.0), world);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4f {
    // Shadows need the triangle's own normal; derivatives of the position give it without a vertex
    // attribute.
    let normal = normalize(shadow_normal(in.position));
    let incidence = max(dot(normal, view.to_sun), 0.0);
    // Light 0 of the plan is the sun. Surfaces that face away from the sun are dark whatever the
    // shadow map says.
    let sun = incidence * shadow_visibility(0u, in.position, normal);
    return vec4f(vec3f(0.9, 0.85, 0.75) * sun + vec3f(0.10, 0.13, 0.18), 1.0);
}
