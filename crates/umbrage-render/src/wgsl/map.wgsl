// Draws a shadow map as a grey picture: what is near the light is bright. The greys are spread over
// the depths that were drawn.

struct Map {
    // Where the map lies in the texture, texels.
    origin: vec2u,
    size: vec2u,
    // Width and height of the picture, pixels.
    picture: vec2u,
}

@group(0) @binding(0) var<uniform> map: Map;
// A depth texture, which GLSL could not fetch from as such.
@group(0) @binding(1) var depths: texture_2d<f32>;
// The least and the greatest depth drawn in each block.
@group(1) @binding(0) var blocks: texture_2d<f32>;

// Number of blocks in s and in t.
const BLOCKS: u32 = 32u;
// Depth of texels into which nothing casts, and beyond which nothing is drawn.
const FARTHEST: f32 = 1.0;
// sRGB
const NEAREST_GREY: f32 = 0.97;
const FARTHEST_GREY: f32 = 0.2;
const EMPTY: vec3f = vec3f(0.07, 0.1, 0.2);

struct Corner {
    @builtin(position) clip: vec4f,
    // The least and the greatest depth of all.
    @location(0) @interpolate(flat, either) range: vec2f,
}

// A triangle over the whole target.
fn corner_position(index: u32) -> vec4f {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4f(corner * 2.0 - 1.0, 0.0, 1.0);
}

@vertex
fn block_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return corner_position(index);
}

@fragment
fn block_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(drawn_range(vec2u(at.xy), vec2u(BLOCKS)), 0.0, 0.0);
}

@vertex
fn map_vertex(@builtin(vertex_index) index: u32) -> Corner {
    var range = vec2f(FARTHEST, 0.0);
    for (var y = 0u; y < BLOCKS; y++) {
        for (var x = 0u; x < BLOCKS; x++) {
            let block = textureLoad(blocks, vec2u(x, y), 0).xy;
            range = vec2f(min(range.x, block.x), max(range.y, block.y));
        }
    }
    return Corner(corner_position(index), range);
}

@fragment
fn map_fragment(corner: Corner) -> @location(0) vec4f {
    // Thin casters stay visible where a pixel has several texels, because the nearest counts.
    let nearest = drawn_range(vec2u(corner.clip.xy), map.picture).x;
    let span = max(corner.range.y - corner.range.x, 1e-9);
    let grey = mix(NEAREST_GREY, FARTHEST_GREY, (nearest - corner.range.x) / span);
    let srgb = select(EMPTY, vec3f(grey), nearest < FARTHEST);
    // The format of the target encodes it as sRGB. No value is so dark that its curve is a line.
    return vec4f(pow((srgb + 0.055) / 1.055, vec3f(2.4)), 1.0);
}

// The least and the greatest depth drawn in one of the cells that the map is divided into.
fn drawn_range(cell: vec2u, cells: vec2u) -> vec2f {
    let first = cell * map.size / cells;
    let end = max((cell + 1u) * map.size / cells, first + 1u);
    var range = vec2f(FARTHEST, 0.0);
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            let depth = textureLoad(depths, map.origin + vec2u(x, y), 0).x;
            if (depth < FARTHEST) {
                range = vec2f(min(range.x, depth), max(range.y, depth));
            }
        }
    }
    return range;
}
