// A scene lit by one light and the sky. Render space is relative to the eye. Umbrage's lookup
// module in bind group 1 must precede this text.

struct View {
    clip_from_render: mat4x4f,
    // The line of sight through the point (x, y) of the target has the direction of unit depth ray
    // + x ray_x + y ray_y. In orthographic views all directions are `ray`, and the line begins at x
    // ray_x + y ray_y from where the first one begins.
    ray: vec3f,
    // Number of samples along each side of a pixel.
    grid: f32,
    ray_x: vec3f,
    light_kind: u32,
    ray_y: vec3f,
    // Range of a spot or point light, metres.
    light_range: f32,
    // View direction, unit length.
    forward: vec3f,
    // Cosine of a spot light's half angle; -1 for other lights.
    light_cosine: f32,
    // Direction in which the light travels, unit length.
    light_direction: vec3f,
    light_index: u32,
    light_position: vec3f,
    is_orthographic: u32,
    sun: vec4f,
    sky_light: vec4f,
    ground_light: vec4f,
    zenith: vec4f,
    horizon: vec4f,
    nadir: vec4f,
    glow: vec4f,
}

const DIRECTIONAL: u32 = 0u;
const SPOT: u32 = 1u;
const POINT: u32 = 2u;

@group(0) @binding(0) var<uniform> view: View;

struct Material {
    base_color: vec4f,
    // Where alpha is below this value, meshes with holes have no surface.
    cutoff: f32,
}

@group(2) @binding(0) var<uniform> material: Material;
@group(2) @binding(1) var material_texture: texture_2d<f32>;
@group(2) @binding(2) var material_sampler: sampler;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) render_from_mesh_x: vec4f,
    @location(2) render_from_mesh_y: vec4f,
    @location(3) render_from_mesh_z: vec4f,
    // Texture coordinates and, as the fourth component, alpha. Scenes without alphas give 1.
    @location(4) uv_alpha: vec4f,
    // See `unpacked`.
    @location(5) normal: u32,
}

struct Fragment {
    // The pass that draws depths ahead must find the very same ones.
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Texture coordinates and alpha.
    @location(2) uv_alpha: vec3f,
    // The number of the cluster of triangles, and how often these were simplified.
    @location(3) @interpolate(flat) cluster: vec2u,
}

@vertex
fn mesh_vertex(vertex: Vertex) -> Fragment {
    let x = vertex.render_from_mesh_x;
    let y = vertex.render_from_mesh_y;
    let z = vertex.render_from_mesh_z;
    let point = vec4f(vertex.position, 1.0);
    let position = vec3f(dot(x, point), dot(y, point), dot(z, point));
    let normal = turned_normal(x.xyz, y.xyz, z.xyz, vertex.normal);
    let clip = view.clip_from_render * vec4f(position, 1.0);
    return Fragment(clip, position, normal, vertex.uv_alpha.xyw, vec2u(0u));
}

// A normal of mesh space in render space. Normals transform by the cofactor matrix, of whose rows
// the arguments are those of the matrix itself. Its sign does not matter, because normals are turned
// to the visible side.
fn turned_normal(x: vec3f, y: vec3f, z: vec3f, packed: u32) -> vec3f {
    let n = unpacked(packed);
    return normalize_or_zero(vec3f(
        dot(cross(y, z), n),
        dot(cross(z, x), n),
        dot(cross(x, y), n),
    ));
}

// A normal of which `packed` in `scene.rs` is the inverse.
fn unpacked(packed: u32) -> vec3f {
    if (packed == 0x80008000u) {
        return vec3f(0.0);
    }
    let at = unpack2x16snorm(packed);
    let z = 1.0 - abs(at.x) - abs(at.y);
    let fold = max(-z, 0.0);
    return vec3f(at - select(vec2f(fold), vec2f(-fold), at < vec2f(0.0)), z);
}

@vertex
fn sky_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    // Depth is reversed: 0 is infinitely far.
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

fn normalize_or_zero(v: vec3f) -> vec3f {
    // The vector is scaled first, because the squares of small numbers underflow.
    let largest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    if (largest <= 0.0) {
        return vec3f(0.0);
    }
    return normalize(v / largest);
}

// A visible surface.
struct Surface {
    position: vec3f,
    // Normal of the triangle, turned to the eye.
    normal: vec3f,
    shading_normal: vec3f,
    color: vec3f,
    is_facing: bool,
    // Visibility of the light by the shadow maps; 0 if the surface faces away from the light.
    visibility: f32,
}

fn triangle_normal(in: Fragment) -> vec3f {
    return normalize_or_zero(shadow_normal(in.position));
}

fn base_color(in: Fragment) -> vec4f {
    let texel = textureSampleLevel(material_texture, material_sampler, in.uv_alpha.xy, 0.0);
    return material.base_color * texel;
}

// About how far single precision may turn the normal that comes from positions in neighbouring
// pixels, radians.
fn normal_error(in: Fragment) -> f32 {
    let step = min(length(dpdx(in.position)), length(dpdy(in.position)));
    return exp2(-24.0) * length(in.position) / max(step, 1e-30);
}

fn opaque_surface(in: Fragment) -> Surface {
    return surface(in, triangle_normal(in), normal_error(in), base_color(in).rgb);
}

// A fragment stage that discards keeps the device from testing depth before it shades, so only
// meshes with holes have one.
fn masked_surface(in: Fragment) -> Surface {
    // Derivatives are taken first, before parts of a quad are discarded.
    let normal = triangle_normal(in);
    let normal_error = normal_error(in);
    let color = base_color(in);
    if (is_hole(in, color.a)) {
        discard;
    }
    return surface(in, normal, normal_error, color.rgb);
}

// Whether a mesh with holes, whose material has this alpha here, has no surface here.
fn is_hole(in: Fragment, alpha: f32) -> bool {
    return alpha * in.uv_alpha.z < material.cutoff;
}

fn surface(in: Fragment, normal: vec3f, normal_error: f32, color: vec3f) -> Surface {
    var shading_normal = normalize_or_zero(in.normal);
    if (all(shading_normal == vec3f(0.0))) {
        shading_normal = normal;
    }
    shading_normal = select(shading_normal, -shading_normal, dot(shading_normal, normal) < 0.0);
    let is_facing = faces_light(in.position, normal, normal_error);
    var visibility = 0.0;
    if (is_facing) {
        visibility = shadow_visibility(view.light_index, in.position, normal);
    }
    return Surface(in.position, normal, shading_normal, color, is_facing, visibility);
}

fn to_light(position: vec3f) -> vec3f {
    if (view.light_kind == DIRECTIONAL) {
        return -view.light_direction;
    }
    return normalize_or_zero(view.light_position - position);
}

// Whether the light reaches a surface if nothing lies between them. Whether a surface that is
// edge-on to the light faces it would change from pixel to pixel in single precision. Such a
// surface faces a lamp, whose light grazes it, and does not face a sun.
fn faces_light(position: vec3f, normal: vec3f, normal_error: f32) -> bool {
    let light = to_light(position);
    let cosine = dot(normal, light);
    if (view.light_kind == DIRECTIONAL) {
        return cosine > normal_error;
    }
    if (cosine <= -normal_error) {
        return false;
    }
    let is_in_cone = -dot(view.light_direction, light) >= view.light_cosine;
    return is_in_cone && distance_from_lamp(position) <= view.light_range;
}

// Distance from a spot or point light, as the light's range counts it.
fn distance_from_lamp(position: vec3f) -> f32 {
    let from_light = position - view.light_position;
    if (view.light_kind == SPOT) {
        return dot(view.light_direction, from_light);
    }
    return length(from_light);
}

// A spot or point light fades to nothing at the end of its range (Karis 2013, without the inverse
// square).
fn attenuation(position: vec3f) -> f32 {
    if (view.light_kind == DIRECTIONAL) {
        return 1.0;
    }
    let relative = distance_from_lamp(position) / view.light_range;
    let squared = relative * relative;
    let window = max(1.0 - squared * squared, 0.0);
    return window * window;
}

// Linear colour of a diffuse surface, lit by the light (as far as it is visible), the sky and the
// ground.
fn radiance(s: Surface) -> vec3f {
    let light = to_light(s.position);
    let incidence = max(dot(s.shading_normal, light), 0.0);
    let direct = view.sun.rgb * (incidence * s.visibility * attenuation(s.position));
    let side = dot(s.shading_normal, vec3f(light.x, 0.0, light.z));
    let up = 0.5 + 0.5 * s.shading_normal.y;
    let ambient = mix(view.ground_light.rgb, view.sky_light.rgb, up) * (1.0 + 0.3 * side);
    return s.color * (direct + ambient);
}

// The direction of the line of sight through a point of the target, of unit depth.
fn line_of_sight(at: vec2f) -> vec3f {
    if (view.is_orthographic != 0u) {
        return view.ray;
    }
    return view.ray + at.x * view.ray_x + at.y * view.ray_y;
}

fn sky(target_position: vec2f) -> vec3f {
    let direction = normalize(line_of_sight(target_position));
    let height = direction.y;
    var color: vec3f;
    if (height >= 0.0) {
        color = mix(view.horizon.rgb, view.zenith.rgb, 1.0 - pow(1.0 - height, 3.0));
    } else {
        color = mix(view.horizon.rgb, view.nadir.rgb, 1.0 - pow(max(1.0 + height, 0.0), 12.0));
    }
    if (view.light_kind == DIRECTIONAL) {
        color += view.glow.rgb * pow(max(-dot(view.light_direction, direction), 0.0), 6.0);
    }
    return color;
}

// The PBR Neutral tone mapper (Khronos Group 2024).
fn compress(linear: vec3f) -> vec3f {
    let start = 0.8 - 0.04;
    let positive = max(linear, vec3f(0.0));
    let low = min(positive.r, min(positive.g, positive.b));
    let offset = select(0.04, low - 6.25 * low * low, low < 0.08);
    let color = positive - offset;
    let peak = max(color.r, max(color.g, color.b));
    if (peak < start) {
        return color;
    }
    let room = 1.0 - start;
    let new_peak = 1.0 - room * room / (peak + room - start);
    let gray = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(color * (new_peak / peak), vec3f(new_peak), gray);
}

// A frame to display. The format of the target encodes it as sRGB.
@fragment
fn opaque_frame(in: Fragment) -> @location(0) vec4f {
    return frame(opaque_surface(in));
}

@fragment
fn masked_frame(in: Fragment) -> @location(0) vec4f {
    return frame(masked_surface(in));
}

fn frame(s: Surface) -> vec4f {
    return vec4f(compress(radiance(s)), 1.0);
}

@fragment
fn sky_frame(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(compress(sky(at.xy)), 1.0);
}

// Radiance and visibility, normal and depth. Visibility is -1 where the surface faces away from the
// light. Normal and depth are 0 in the sky.
struct Picture {
    @location(0) radiance_visibility: vec4f,
    @location(1) normal_depth: vec4f,
}

@fragment
fn opaque_picture(in: Fragment) -> Picture {
    return picture(opaque_surface(in));
}

@fragment
fn masked_picture(in: Fragment) -> Picture {
    return picture(masked_surface(in));
}

fn picture(s: Surface) -> Picture {
    let visibility = select(-1.0, s.visibility, s.is_facing);
    let depth = dot(view.forward, s.position);
    return Picture(vec4f(radiance(s), visibility), vec4f(s.shading_normal, depth));
}

@fragment
fn sky_picture(@builtin(position) at: vec4f) -> Picture {
    return Picture(vec4f(sky(at.xy), 1.0), vec4f(0.0));
}

// Where texels lie: texel coordinates, index of the map in the plan (-1: none), and pixels per
// texel (0: none).
@fragment
fn opaque_texels(in: Fragment) -> @location(0) vec4f {
    return texels(in.clip, opaque_surface(in));
}

@fragment
fn masked_texels(in: Fragment) -> @location(0) vec4f {
    return texels(in.clip, masked_surface(in));
}

fn texels(at: vec4f, s: Surface) -> vec4f {
    let spread = texel_spread(at, s);
    let place = spread.place;
    if (place.map == SHADOW_NONE) {
        return vec4f(0.0, 0.0, -1.0, 0.0);
    }
    return vec4f(place.texel, f32(shadow_maps[place.map].index), pixels_per_texel(spread));
}

// The place of a surface point in the maps, and the change of its texel coordinates from pixel to
// pixel to the right and downwards.
struct TexelSpread {
    place: ShadowPlace,
    right: vec2f,
    down: vec2f,
}

fn texel_spread(at: vec4f, s: Surface) -> TexelSpread {
    let place = shadow_place(view.light_index, s.position);
    if (place.map == SHADOW_NONE) {
        return TexelSpread(place, vec2f(0.0), vec2f(0.0));
    }
    let point = shadow_point(place.map, s.position);
    // How the surface point moves on its plane from pixel to pixel.
    let ray = line_of_sight(at.xy);
    let across = dot(s.normal, ray);
    let scale = select(dot(view.forward, s.position), 1.0, view.is_orthographic != 0u);
    let step_x = scale * view.grid * (view.ray_x - ray * (dot(s.normal, view.ray_x) / across));
    let step_y = scale * view.grid * (view.ray_y - ray * (dot(s.normal, view.ray_y) / across));
    return TexelSpread(
        place,
        vec2f(dot(point.grad_s, step_x), dot(point.grad_t, step_x)),
        vec2f(dot(point.grad_s, step_y), dot(point.grad_t, step_y)),
    );
}

// The larger singular value of the inverse of texels per pixel.
fn pixels_per_texel(spread: TexelSpread) -> f32 {
    let xx = dot(spread.right, spread.right);
    let yy = dot(spread.down, spread.down);
    let xy = dot(spread.right, spread.down);
    let half_difference = 0.5 * (xx - yy);
    let largest = sqrt(0.5 * (xx + yy) + sqrt(half_difference * half_difference + xy * xy));
    let determinant = abs(spread.right.x * spread.down.y - spread.right.y * spread.down.x);
    return largest / max(determinant, 1e-30);
}

@fragment
fn sky_texels(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(0.0, 0.0, -1.0, 0.0);
}

// Depths alone.
@fragment
fn opaque_depth(in: Fragment) -> @location(0) vec4f {
    return vec4f(0.0);
}

@fragment
fn masked_depth(in: Fragment) -> @location(0) vec4f {
    if (is_hole(in, base_color(in).a)) {
        discard;
    }
    return vec4f(0.0);
}

@fragment
fn sky_depth(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(0.0);
}

// The number of the cluster that is seen, and its level of detail (-1: the sky).
@fragment
fn opaque_clusters(in: Fragment) -> @location(0) vec4f {
    return seen_cluster(in);
}

@fragment
fn masked_clusters(in: Fragment) -> @location(0) vec4f {
    if (is_hole(in, base_color(in).a)) {
        discard;
    }
    return seen_cluster(in);
}

fn seen_cluster(in: Fragment) -> vec4f {
    return vec4f(vec2f(in.cluster), 0.0, 0.0);
}

@fragment
fn sky_clusters(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(0.0, -1.0, 0.0, 0.0);
}
