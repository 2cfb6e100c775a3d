// Draws the texture of pages as a picture: for each place a square with its page's depths, what is
// near the light bright, tinted by the page's level. The greys of each page are spread over the
// depths in it. Places without a page are dark blue, and pages that nobody wants are dim.

struct Pool {
    // Width and height of the texture, texels, and of the picture, pixels.
    texture: vec2u,
    picture: vec2u,
    // Texels across a place.
    side: u32,
    // Maps of a level, and of a grid.
    slabs: u32,
    maps: u32,
    // The finest level.
    first_level: i32,
    // sRGB: the colours of levels, by the level modulo their number.
    colors: array<vec4f, 7>,
}

// `umbrage_wgpu::PagePool` tells what the words mean.
struct Place {
    map: u32,
    others: array<u32, 4>,
    wanted: u32,
    is_stale: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> pool: Pool;
// A depth texture, which GLSL could not fetch from as such.
@group(0) @binding(1) var depths: texture_2d<f32>;
@group(0) @binding(2) var<storage, read> places: array<Place>;
@group(0) @binding(3) var<storage, read> table: array<u32>;

const NOW: u32 = 2u;
const BIRTHS: u32 = 3u;
const NO_PAGE: u32 = 0xffffffffu;
// The depths of so many texels across a page are looked at to find their range.
const SAMPLES: u32 = 16u;
const FARTHEST: f32 = 1.0;
// sRGB
const EMPTY: vec3f = vec3f(0.07, 0.1, 0.2);
const FARTHEST_GREY: f32 = 0.25;
const NEW_FRAMES: f32 = 30.0;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat, either) place: u32,
    // The least and the greatest depth in the page.
    @location(1) @interpolate(flat, either) range: vec2f,
}

@vertex
fn pool_vertex(
    @builtin(vertex_index) index: u32,
    @builtin(instance_index) place: u32,
) -> Corner {
    let corner = vec2u(index & 1u, index >> 1u);
    let across = pool.texture.x / pool.side;
    let first = pool.side * vec2u(place % across, place / across);
    let at = vec2f(first + pool.side * corner) / vec2f(pool.texture);
    var range = vec2f(FARTHEST, 0.0);
    for (var y = 0u; y < SAMPLES; y++) {
        for (var x = 0u; x < SAMPLES; x++) {
            let texel = first + (2u * vec2u(x, y) + 1u) * pool.side / (2u * SAMPLES);
            let depth = textureLoad(depths, texel, 0).x;
            if (depth < FARTHEST) {
                range = vec2f(min(range.x, depth), max(range.y, depth));
            }
        }
    }
    return Corner(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0), place, range);
}

@fragment
fn pool_fragment(in: Corner) -> @location(0) vec4f {
    let map = places[in.place].map;
    if (map == NO_PAGE) {
        return shown(EMPTY);
    }
    let texel = vec2u(in.clip.xy * vec2f(pool.texture) / vec2f(pool.picture));
    let depth = textureLoad(depths, min(texel, pool.texture - 1u), 0).x;
    let near = clamp((in.range.y - depth) / max(in.range.y - in.range.x, 1e-7), 0.0, 1.0);
    let grey = select(mix(FARTHEST_GREY, 1.0, near), 0.5 * FARTHEST_GREY, depth >= FARTHEST);
    let newness = 1.0 - f32(table[NOW] - table[table[BIRTHS] + in.place]) / NEW_FRAMES;
    let number = pool.first_level + i32((map % pool.maps) / pool.slabs);
    let level = pool.colors[(number % 7 + 7) % 7].rgb;
    let color = grey * mix(level, vec3f(1.0), 0.7 * clamp(newness, 0.0, 1.0));
    let is_wanted = places[in.place].wanted == table[NOW];
    // Lines between places.
    let within = texel % pool.side;
    let is_line = any(within == vec2u(0u));
    return shown(select(color, vec3f(0.0), is_line) * select(0.35, 1.0, is_wanted));
}

// The value to write for a colour, which the format of the target encodes as sRGB.
fn shown(srgb: vec3f) -> vec4f {
    let curved = pow((srgb + 0.055) / 1.055, vec3f(2.4));
    return vec4f(select(curved, srgb / 12.92, srgb <= vec3f(0.04045)), 1.0);
}
