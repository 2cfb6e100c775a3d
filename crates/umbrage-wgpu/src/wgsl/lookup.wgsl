// Umbrage: how much of a light reaches a point, by the depths of its shadow maps.
//
// Call `shadow_visibility`; all names begin with `shadow_` or `SHADOW_`. Conventions:
// - Render space is world space moved by the `render_origin` of the frame, metres: what your shaders hold.
// - Texels of a map count from its own corner: texel (i, j) spans [i, i+1] × [j, j+1].
// - Depth is 0 where a map's depths begin, nearest the light, and 1 where they end.
// - Maps, planes and lights are as in the plan; empty maps are left out.

// Half a unit in the last place of single precision below 1.
const SHADOW_HALF_ULP: f32 = 2.9802322e-8;
// What single precision makes of a depth between 0 and 1 on the way here and into the map, at most.
const SHADOW_ROUNDING: f32 = 4.7683716e-7;
// No map.
const SHADOW_NONE: u32 = 0xffffffffu;

struct ShadowSettings {
    // Beyond what the texels themselves ask for; 0 unless the user says otherwise.
    bias_texels: f32,
    bias_metres: f32,
    light_count: u32,
    // One over the texture's width and height.
    texture_scale: vec2f,
    // Width of a pixel of the viewer's picture, metres: this times a point (homogeneous).
    pixel_gradient: vec4f,
    // The viewer, in render space.
    eye: vec4f,
}

struct ShadowLight {
    first_map: u32,
    map_count: u32,
    padding: vec2u,
}

struct ShadowMap {
    // Rows of the matrix from render space to (s, t, depth), homogeneous; s and t in texels.
    s: vec4f,
    t: vec4f,
    depth: vec4f,
    w: vec4f,
    // Before this plane's negative side the map does not fade.
    fade_from: vec4f,
    // See `shadow_slab_depth`.
    beam_scale: vec4f,
    slab: vec4f,
    // Texels of the map, and of the texture at which it begins.
    size: vec2f,
    origin: vec2f,
    layer: u32,
    first_plane: u32,
    plane_count: u32,
    // Index in the plan.
    index: u32,
}

// A point as a map sees it.
struct ShadowPoint {
    texel: vec2f,
    depth: f32,
    // 0 where the map does not apply.
    w: f32,
    // Gradients, per metre.
    grad_s: vec3f,
    grad_t: vec3f,
    grad_depth: vec3f,
}

// A surface point as a map sees it: all that a shadow test needs.
struct ShadowReceiver {
    texel: vec2f,
    depth: f32,
    // Of the surface's plane: depth per texel.
    slope: vec2f,
    // How much nearer than the plane a texel's depth may be and not hide it.
    slack: f32,
    // Squares of the texels that the filter's width covers in s and in t, and the product of the two directions; 0 for filters that count in texels.
    metric: vec3f,
    // Growth of depth along the beam.
    depth_per_metre: f32,
    // Depth per texel of the plane across the beam: not zero where a warp tilts depth.
    level_slope: vec2f,
}

// Where a point is looked up.
struct ShadowPlace {
    // Index in `shadow_maps`, SHADOW_NONE if no map serves the point.
    map: u32,
    texel: vec2f,
}

// How much of a light (its index in the plan) reaches a surface, 0 to 1, by its shadow maps alone: whether the
// surface faces the light is for you to say. `position` is in render space, `normal` that of the triangle itself,
// of any length, to either side; `shadow_normal` makes one where there is none.
fn shadow_visibility(light: u32, position: vec3f, normal: vec3f) -> f32 {
    if (light >= shadow_settings.light_count) {
        return 1.0;
    }
    // First which maps, then what they say, so that neighbouring points of different slices are filtered together.
    let maps = shadow_lights[light];
    var left = 1.0;
    var map = SHADOW_NONE;
    var share = 0.0;
    // Where slices overlap.
    var next = SHADOW_NONE;
    var next_share = 0.0;
    for (var i = 0u; i < maps.map_count; i++) {
        let weight = min(shadow_weight(maps.first_map + i, position), left);
        if (weight > 0.0) {
            if (map == SHADOW_NONE) {
                map = maps.first_map + i;
                share = weight;
            } else {
                next = maps.first_map + i;
                next_share += weight;
            }
            left -= weight;
            if (left <= 0.0) {
                break;
            }
        }
    }
    if (map == SHADOW_NONE) {
        return 1.0;
    }
    var sum = 0.0;
    loop {
        sum += share * shadow_map_visibility(map, position, normal);
        if (next == SHADOW_NONE) {
            break;
        }
        map = next;
        share = next_share;
        next = SHADOW_NONE;
    }
    return sum / (1.0 - left);
}

// The normal of the triangle that is being drawn, turned to the viewer, of any length (in a right-handed space). Only in
// fragment shaders, in uniform control flow. Most exact where `position` is small: relative to the eye.
fn shadow_normal(position: vec3f) -> vec3f {
    return cross(dpdy(position), dpdx(position));
}

// The map that has the largest share in a point, and where in it the point lies.
fn shadow_place(light: u32, position: vec3f) -> ShadowPlace {
    var place = ShadowPlace(SHADOW_NONE, vec2f(0.0));
    if (light >= shadow_settings.light_count) {
        return place;
    }
    let maps = shadow_lights[light];
    var left = 1.0;
    var largest = 0.0;
    for (var i = 0u; i < maps.map_count; i++) {
        let map = maps.first_map + i;
        let share = min(shadow_weight(map, position), left);
        left -= share;
        if (share > largest) {
            largest = share;
            place.map = map;
        }
    }
    if (place.map != SHADOW_NONE) {
        place.texel = shadow_point(place.map, position).texel;
    }
    return place;
}

// How far a map answers for a point: 0 outside what it serves, 1 inside, falling where it fades into the next
// slice's map.
fn shadow_weight(map: u32, position: vec3f) -> f32 {
    let first = shadow_maps[map].first_plane;
    let count = shadow_maps[map].plane_count;
    let point = vec4f(position, 1.0);
    for (var i = 0u; i < count; i++) {
        if (dot(shadow_planes[first + i], point) < 0.0) {
            return 0.0;
        }
    }
    let gone = -dot(shadow_maps[map].fade_from, point);
    if (gone <= 0.0) {
        return 1.0;
    }
    let to_end = dot(shadow_planes[first], point);
    return to_end / (to_end + gone);
}

// The map's projection of a point, and its Jacobian there.
fn shadow_point(map: u32, position: vec3f) -> ShadowPoint {
    let s = shadow_maps[map].s;
    let t = shadow_maps[map].t;
    let depth = shadow_maps[map].depth;
    let w = shadow_maps[map].w;
    let point = vec4f(position, 1.0);
    let h = vec4f(dot(s, point), dot(t, point), dot(depth, point), dot(w, point));
    let scale = select(0.0, 1.0 / h.w, h.w > 0.0);
    let at = h.xyz * scale;
    return ShadowPoint(
        at.xy,
        at.z,
        max(h.w, 0.0),
        (s.xyz - w.xyz * at.x) * scale,
        (t.xyz - w.xyz * at.y) * scale,
        (depth.xyz - w.xyz * at.z) * scale,
    );
}

// The bias follows from the map's Jacobian (see the documentation of `umbrage::visibility`): the surface's plane
// gives the depth to expect at every texel, and half the longest way across a texel's footprint, laid along the
// beam, is what the map cannot tell.
fn shadow_receiver(point: ShadowPoint, normal: vec3f) -> ShadowReceiver {
    // Along the beam, as long as there are texels in a square metre across it.
    let beam = cross(point.grad_s, point.grad_t);
    let density = length(beam);
    let depth_per_metre = abs(dot(point.grad_depth, beam)) / density;
    let ss = dot(point.grad_s, point.grad_s);
    let tt = dot(point.grad_t, point.grad_t);
    let st = dot(point.grad_s, point.grad_t);
    let half_difference = 0.5 * (ss - tt);
    let longest = sqrt(0.5 * (ss + tt) + sqrt(half_difference * half_difference + st * st)) / density;
    let slack = depth_per_metre * ((0.5 + shadow_settings.bias_texels) * longest + shadow_settings.bias_metres);
    // The plane's covector in shadow space is the world's times the cofactors of the Jacobian. Edge-on to the light
    // the slope has no end: 8 in a texel is as good as infinite where all of depth is 1.
    let across = vec2f(
        dot(normal, cross(point.grad_t, point.grad_depth)),
        dot(normal, cross(point.grad_depth, point.grad_s)),
    );
    let along = dot(normal, beam);
    let tiny = 1e-30;
    let slope = clamp(-across / select(along, tiny, abs(along) < tiny), vec2f(-8.0), vec2f(8.0));
    let level_slope = -vec2f(
        dot(beam, cross(point.grad_t, point.grad_depth)),
        dot(beam, cross(point.grad_depth, point.grad_s)),
    ) / dot(beam, beam);
    return ShadowReceiver(
        point.texel,
        point.depth,
        slope,
        slack + SHADOW_ROUNDING,
        vec3f(0.0),
        depth_per_metre,
        level_slope,
    );
}

// The depth from which on a texel does not hide the receiver.
fn shadow_nearest_lit(receiver: ShadowReceiver, texel_center: vec2f) -> f32 {
    let rise = dot(receiver.slope, texel_center - receiver.texel);
    return shadow_limit(min(receiver.depth, receiver.depth + rise), receiver.slack);
}

// The same from the depth that is expected there.
fn shadow_limit(expected_depth: f32, slack: f32) -> f32 {
    // Depths end at 1: what is stored as 1 may lie anywhere behind. What is stored as 0 is a caster that was clamped,
    // however much is allowed for; unless the surface itself would be.
    let expected = min(expected_depth, 1.0);
    let limit = expected - slack;
    return select(limit, max(limit, SHADOW_HALF_ULP), expected > 2.0 * SHADOW_HALF_ULP);
}

// What one map says of a surface. Receivers outside the map, or before its depths, are lit.
fn shadow_map_visibility(map: u32, position: vec3f, normal: vec3f) -> f32 {
    let point = shadow_point(map, position);
    let size = shadow_maps[map].size;
    // What is served lies in the map up to rounding, at the border of its part as well.
    let rounding = 1e-4 * size;
    let is_inside = all(point.texel >= -rounding) && all(point.texel <= size + rounding);
    if (point.w <= 0.0 || !is_inside || point.depth < -SHADOW_ROUNDING) {
        return 1.0;
    }
    var receiver = shadow_receiver(point, normal);
    receiver.texel = clamp(receiver.texel, vec2f(0.0), size);
    receiver.metric = {METRIC};
    return shadow_filtered(map, receiver);
}
