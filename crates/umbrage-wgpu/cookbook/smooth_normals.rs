/// Functions for shaders that have interpolated normals. In a fragment shader prefer
/// `shadow_visibility(light, position, shadow_normal(position))`: derivatives of the position give
/// the triangle's own normal, exactly and without a vertex attribute. Where there are none
/// (deferred shading with smooth normals in the G-buffer, compute shaders), say how far the normals
/// may lean off the triangles' own. Contacts get lighter by as much as a plane that leans so far
/// may rise over the filter's reach.
pub const SMOOTH_LOOKUP: &str = "
fn light_on_smooth_surface(light: u32, position: vec3f, normal: vec3f) -> f32 {
    // The tangent of 17 degrees: a circle of 10 or more edges.
    return shadow_visibility_smooth(light, position, normal, 0.3);
}
";
