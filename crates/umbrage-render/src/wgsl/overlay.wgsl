// Frames that show what the maps do or what was drawn, over the picture or in its place. The text
// of `forward.wgsl` must precede this one. Colours are mixed by their sRGB values, as the pictures
// of reports are.

struct Overlay {
    // ERROR, GRID, PARTITION, CLUSTERS or PAGES.
    kind: u32,
    // Logarithm of the upper end of the scale of errors, pixels per texel.
    log_max: f32,
    // Distance along the view beyond which no shadow counts, metres.
    far: f32,
    // sRGB: the scale of errors, the colour of the lines, or those of the maps or of the levels of
    // detail.
    colors: array<vec4f, 65>,
}

const ERROR: u32 = 0u;
const GRID: u32 = 1u;
const PARTITION: u32 = 2u;
const CLUSTERS: u32 = 3u;
const PAGES: u32 = 4u;
const PARTITION_COLORS: u32 = 7u;
const LEVEL_COLORS: u32 = 16u;
// Texels across a page, and how many frames long it is told that a page was drawn.
const PAGE_TEXELS: f32 = 64.0;
const NEW_FRAMES: f32 = 30.0;

@group(0) @binding(1) var<uniform> overlay: Overlay;

@fragment
fn opaque_overlay(in: Fragment) -> @location(0) vec4f {
    return overlaid(in, opaque_surface(in));
}

@fragment
fn masked_overlay(in: Fragment) -> @location(0) vec4f {
    return overlaid(in, masked_surface(in));
}

@fragment
fn sky_overlay(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return shown(dimmed(srgb_from_linear(compress(sky(at.xy)))));
}

fn overlaid(in: Fragment, s: Surface) -> vec4f {
    let at = in.clip;
    let picture = srgb_from_linear(compress(radiance(s)));
    if (overlay.kind == CLUSTERS) {
        return shown(tinted(cluster_color(in.cluster), picture));
    }
    let spread = texel_spread(at, s);
    let is_held = is_held(spread.place.map, s.position);
    if (overlay.kind == ERROR) {
        let counts = s.is_facing && dot(view.forward, s.position) <= overlay.far;
        if (!counts) {
            return shown(dimmed(picture));
        }
        return shown(select(hatch(at), scale_color(pixels_per_texel(spread)), is_held));
    }
    if (!is_held) {
        return shown(dimmed(picture));
    }
    if (overlay.kind == GRID) {
        return shown(mix(0.6 * picture, overlay.colors[0].rgb, grid_cover(spread, 5.0, 0.3)));
    }
    if (overlay.kind == PAGES) {
        let seen = shadow_page_seen(view.light_index, s.position);
        if (seen.x == 0) {
            return shown(dimmed(picture));
        }
        let count = i32(PARTITION_COLORS);
        let level = overlay.colors[(seen.y % count + count) % count].rgb;
        let newness = clamp(1.0 - f32(seen.z) / NEW_FRAMES, 0.0, 1.0);
        let color = tinted(mix(level, vec3f(1.0), 0.7 * newness), picture);
        return shown(mix(color, vec3f(0.0), 0.75 * grid_cover(spread, PAGE_TEXELS, 0.0)));
    }
    let map = shadow_maps[spread.place.map].index;
    return shown(tinted(overlay.colors[map % PARTITION_COLORS].rgb, picture));
}

// A tint with the lightness of the picture, so that the shading stays visible.
fn tinted(tint: vec3f, picture: vec3f) -> vec3f {
    return tint * (0.25 + 0.75 * luma(picture));
}

// The colour of a cluster's level, a little darker by the cluster's number. Fibonacci hashing
// (Knuth 1973) tells neighbours apart.
fn cluster_color(cluster: vec2u) -> vec3f {
    let level = min(cluster.y, LEVEL_COLORS - 1u);
    let hash = f32((cluster.x * 2654435769u) >> 24u) / 255.0;
    return overlay.colors[level].rgb * (1.0 - 0.25 * hash);
}

// Whether a map holds the point that it serves, as `shadow_map_visibility` decides it. Maps that
// were planned for another camera do not hold all that this one sees.
fn is_held(map: u32, position: vec3f) -> bool {
    if (map == SHADOW_NONE) {
        return false;
    }
    let point = shadow_point(map, position);
    let outside = abs(point.texel - clamp(point.texel, vec2f(0.0), shadow_maps[map].size));
    return point.w > 0.0
        && point.depth >= -1e-6
        && max(outside.x, outside.y) <= shadow_maps[map].rounding;
}

// The colour of an error on a logarithmic scale from 1/max to max.
fn scale_color(error: f32) -> vec3f {
    let position = clamp(log(max(error, 1e-30)) / overlay.log_max, -1.0, 1.0);
    let at = 32.0 + 32.0 * position;
    let low = u32(at);
    let high = min(low + 1u, 64u);
    return mix(overlay.colors[low].rgb, overlay.colors[high].rgb, fract(at));
}

fn hatch(at: vec4f) -> vec3f {
    let stripe = (u32(at.x) + u32(at.y)) / 3u;
    return vec3f(select(160.0, 90.0, stripe % 2u == 0u) / 255.0);
}

// How much of a pixel lines cover that lie a number of texels apart in s and in t. Where they would
// be too dense to see, they fade into a uniform tint.
fn grid_cover(spread: TexelSpread, period: f32, tint: f32) -> f32 {
    let width_px = 1.2;
    // Periods per pixel, along s and along t.
    let density = sqrt(spread.right * spread.right + spread.down * spread.down) / period;
    let phase = spread.place.texel / period;
    let from_line_px = abs(phase - round(phase)) / max(density, vec2f(1e-6));
    let line = clamp(0.5 * width_px + 0.5 - from_line_px, vec2f(0.0), vec2f(1.0));
    // Lines begin to fade at a density of 1/6, and have vanished at 1/3.
    let fade = clamp(6.0 * density - 1.0, vec2f(0.0), vec2f(1.0));
    let cover = mix(line, vec2f(tint), fade);
    return max(cover.x, cover.y);
}

// A darker grey, on which colours stand out.
fn dimmed(srgb: vec3f) -> vec3f {
    return vec3f(0.2 * luma(srgb) + 14.0 / 255.0);
}

// Rec. 709 luma of sRGB values.
fn luma(srgb: vec3f) -> f32 {
    return dot(vec3f(0.2126, 0.7152, 0.0722), srgb);
}

fn srgb_from_linear(linear: vec3f) -> vec3f {
    let v = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(v, vec3f(1.0 / 2.4)) - 0.055, 12.92 * v, v <= vec3f(0.0031308));
}

// The value to write for a colour, which the format of the target encodes as sRGB.
fn shown(srgb: vec3f) -> vec4f {
    let curved = pow((srgb + 0.055) / 1.055, vec3f(2.4));
    return vec4f(select(curved, srgb / 12.92, srgb <= vec3f(0.04045)), 1.0);
}
