//! Modules whose length depends on options, which Rust therefore writes.
//!
//! All of them could be loops, except for the outputs of a pass, because WGSL has no arrays of
//! outputs. naga adds a counter to every loop to bound it, however, and compilers then neither
//! unroll the loop nor keep the arrays that it indexes in registers. Straight-line code is several
//! times as fast.

use super::Module;
use crate::Layout;
use std::ops::Range;

/// The axis of one of the two passes of a separable blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    /// Along s.
    Rows,
    /// Along t.
    Columns,
}

/// A statement for each of a number of texture layers.
fn for_each_texture(textures: u32, statement: impl Fn(u32) -> String) -> String {
    (0..textures).map(statement).collect()
}

/// `shadow_sample`: one sample of each texture of the statistics.
pub(super) fn samples(textures: u32) -> Module {
    let values = for_each_texture(textures, |t| {
        format!(
            "        textureSampleLevel(shadow_statistics, shadow_sampler, at, first + {t}u, lod),\n"
        )
    });
    let text = format!(
        "\
import package::constants::SHADOW_TEXTURES;
import package::texture::atlas_statistics::{{shadow_statistics, shadow_sampler}};

// Written by `generated.rs`: one sample of all statistics of a map, which begin in layer `first`.
fn shadow_sample(at: vec2f, first: u32, lod: f32) -> array<vec4f, SHADOW_TEXTURES> {{
    return array<vec4f, SHADOW_TEXTURES>(
{values}    );
}}
"
    );
    Module { path: "samples", text: text.into() }
}

/// `shadow_add_statistics`: a sum of statistics and a multiple of others.
pub(super) fn sums(textures: u32) -> Module {
    let values =
        for_each_texture(textures, |t| format!("        sum[{t}] + weight * statistics[{t}],\n"));
    let text = format!(
        "\
import package::constants::SHADOW_TEXTURES;

// Written by `generated.rs`: `sum` and `weight` times the statistics.
fn shadow_add_statistics(
    sum: array<vec4f, SHADOW_TEXTURES>,
    weight: f32,
    statistics: array<vec4f, SHADOW_TEXTURES>,
) -> array<vec4f, SHADOW_TEXTURES> {{
    return array<vec4f, SHADOW_TEXTURES>(
{values}    );
}}
"
    );
    Module { path: "sums", text: text.into() }
}

/// `shadow_encode` and `shadow_reconstruct` of convolution shadow maps.
pub(super) fn csm(textures: u32) -> Module {
    let turns = |with_terms: &dyn Fn(u32) -> String| {
        for_each_texture(textures, |t| {
            let turn = if t == 0 { "" } else { "    pair = shadow_turned(next, step);\n" };
            let declare = if t == 0 { "var next" } else { "next" };
            format!("{turn}    {declare} = shadow_turned(pair, step);\n{}", with_terms(t))
        })
    };
    let encode = turns(&|t| format!("    let terms_{t} = vec4f(pair, next);\n"));
    let encoded = for_each_texture(textures, |t| format!("        terms_{t},\n"));
    let reconstruct = turns(&|t| {
        format!(
            "    sum += shadow_product(SHADOW_CSM_AMOUNTS[{t}], statistics[{t}], pair, next);\n"
        )
    });
    let text = format!(
        "\
import package::constants::{{SHADOW_CSM_AMOUNTS, SHADOW_CSM_GAIN, SHADOW_CSM_RATE, SHADOW_CSM_SHIFT}};
import package::constants::{{SHADOW_LEAK, SHADOW_TEXTURES}};
import package::turned::{{shadow_product, shadow_turned}};

// Convolution shadow maps (Annen et al. 2007): sines and cosines of depth, two pairs in each
// texture. The angle grows by the same step from one term of the series to the next, so two
// evaluations of sine and cosine suffice for all terms. SHADOW_CSM_AMOUNTS has the factors of two
// terms for each texture; the factors beyond the order of the series are 0.

// Written by `generated.rs`: the terms of a depth.
fn shadow_encode(depth: f32) -> array<vec4f, SHADOW_TEXTURES> {{
    let angle = SHADOW_CSM_RATE * depth;
    let step = vec2f(sin(2.0 * angle), cos(2.0 * angle));
    var pair = vec2f(sin(angle), cos(angle));
{encode}    return array<vec4f, SHADOW_TEXTURES>(
{encoded}    );
}}

// Written by `generated.rs`: the sum of the series at a depth.
fn shadow_reconstruct(statistics: array<vec4f, SHADOW_TEXTURES>, depth: f32) -> f32 {{
    let angle = SHADOW_CSM_RATE * (depth - SHADOW_CSM_SHIFT);
    let step = vec2f(sin(2.0 * angle), cos(2.0 * angle));
    var pair = vec2f(sin(angle), cos(angle));
    var sum = 0.5;
{reconstruct}    return (SHADOW_CSM_GAIN * sum - SHADOW_LEAK) / (1.0 - SHADOW_LEAK);
}}
"
    );
    Module { path: "statistic/csm", text: text.into() }
}

/// The share of texel `k` along one axis that a box of `n` texels covers, as WGSL. The box begins
/// `fraction` into texel 0 and ends as far into texel `n`; `None` beyond.
fn covered(k: u32, n: u32, fraction: &str) -> Option<String> {
    match k {
        0 => Some(format!("(1.0 - {fraction})")),
        _ if k < n => Some("1.0".to_owned()),
        _ if k == n => Some(fraction.to_owned()),
        _ => None,
    }
}

/// The product of factors as WGSL, without the factors that are 1.
fn product(factors: [&str; 2]) -> String {
    let factors: Vec<_> = factors.into_iter().filter(|&f| f != "1.0").collect();
    if factors.is_empty() { "1.0".to_owned() } else { factors.join(" * ") }
}

/// `shadow_filtered` of percentage-closer filtering over `n` × `n` texels.
pub(super) fn pcf(n: u32, layout: Layout) -> Module {
    let layer = match layout {
        Layout::Atlas => "",
        Layout::Layers => ", shadow_maps[map].layer",
    };
    // Offsets of texels in a gather are limited to -8 to 7. They count from the corner in the
    // middle.
    let middle = n / 4 * 2;
    let mut fours = String::new();
    for y in (0..=n).step_by(2) {
        for x in (0..=n).step_by(2) {
            let [i, j] = [x, y].map(|k| k as i32 - middle as i32);
            fours += &format!(
                "    depths = textureGather(shadow_depths, shadow_sampler, at{layer}, vec2i({i}, {j}));\n"
            );
            let [across, along] = [(i, "slope.x"), (j, "slope.y")].map(|(k, slope)| match k {
                0 => String::new(),
                _ => format!(" + {:?} * {slope}", f64::from(k)),
            });
            fours += &format!(
                "    lit = shadow_lit(limits, depths, rises{});\n",
                match (across.is_empty(), along.is_empty()) {
                    (true, true) => String::new(),
                    _ => format!(
                        " + vec4f({})",
                        format!("{across}{along}").trim_start_matches(" + ")
                    ),
                }
            );
            // The texels of a gather: lower left, lower right, upper right, upper left, where up is
            // towards smaller t.
            let row = |k: u32, [left, right]: [&str; 2]| {
                let rows = covered(k, n, "fraction.y")?;
                let columns = [(x, left), (x + 1, right)].map(|(column, component)| {
                    let columns = covered(column, n, "fraction.x")?;
                    Some(product([&columns, &format!("lit.{component}")]))
                });
                let columns: Vec<_> = columns.into_iter().flatten().collect();
                let sum = match columns.len() {
                    1 => columns[0].clone(),
                    _ if rows == "1.0" => columns.join(" + "),
                    _ => format!("({})", columns.join(" + ")),
                };
                Some(product([&rows, &sum]))
            };
            let rows = [row(y, ["w", "z"]), row(y + 1, ["x", "y"])];
            let rows: Vec<_> = rows.into_iter().flatten().collect();
            fours += &format!("    sum += {};\n", rows.join(" + "));
        }
    }
    let text = format!(
        "\
import package::buffers::storage::{{shadow_maps, shadow_settings}};
import package::receiver::{{ShadowReceiver, shadow_limits, shadow_lit}};
import package::texture::atlas::{{shadow_depths, shadow_sampler}};

// Percentage-closer filtering (Reeves, Salesin and Cook 1987): the share of lit texels in a box of
// N × N texels. The box is exact, so (N + 1)² texels count; four texels are fetched at a time. Each
// texel is compared with the depth of the receiver's own plane at its centre.
//
// Written by `generated.rs`.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {{
    let place = receiver.texel{shift};
    // The corner at which four texels meet, in the middle of the box.
    let corner = floor(place);
    let fraction = place - corner;
    let at = corner * shadow_settings.texture_scale + shadow_maps[map].origin;
    let slope = receiver.slope;
    let rise = 0.5 * (slope.x + slope.y);
    let fall = 0.5 * (slope.x - slope.y);
    let rises = vec4f(-fall, rise, fall, -rise);
    let limits = shadow_limits(receiver, corner, {reach:?});
    var sum = 0.0;
    var depths: vec4f;
    var lit: vec4f;
{fours}    return min(sum * {share:?}, 1.0);
}}
",
        shift = match f64::from(middle + 1) - 0.5 * f64::from(n) {
            0.0 => String::new(),
            shift if shift < 0.0 => format!(" - {:?}", -shift),
            shift => format!(" + {shift:?}"),
        },
        reach = 0.5 * f64::from(n + 1),
        share = 1.0 / f64::from(n * n),
    );
    Module { path: "filter/pcf", text: text.into() }
}

/// `shadow_filtered` of percentage-closer filtering over `n` × `n` texels, which the texture unit
/// compares.
pub(super) fn hardware_pcf(n: u32) -> Module {
    let mut fours = String::new();
    for y in (0..=n).step_by(2) {
        for x in (0..=n).step_by(2) {
            let pair = |k: u32, fraction: &str| {
                let zero = || "0.0".to_owned();
                let [first, second] =
                    [k, k + 1].map(|k| covered(k, n, fraction).unwrap_or_else(zero));
                format!("{first}, {second}")
            };
            let [columns, rows] = [pair(x, "fraction.x"), pair(y, "fraction.y")];
            fours += &format!(
                "    sum += shadow_compared_four(map, receiver, first + vec2f({x}.0, {y}.0), vec2f({columns}), vec2f({rows}));\n"
            );
        }
    }
    let text = format!(
        "\
import package::hardware_four::shadow_compared_four;
import package::receiver::ShadowReceiver;

// Percentage-closer filtering over an exact box of N × N texels. The bilinear comparisons are
// placed so that their weights are those of the box.
//
// Written by `generated.rs`.
fn shadow_filtered(map: u32, receiver: ShadowReceiver) -> f32 {{
    let start = receiver.texel - {half:?};
    let first = floor(start);
    let fraction = start - first;
    var sum = 0.0;
{fours}    return min(sum * {share:?}, 1.0);
}}
",
        half = 0.5 * f64::from(n),
        share = 1.0 / f64::from(n * n),
    );
    Module { path: "filter/hardware_pcf", text: text.into() }
}

/// `shadow_lit_share`: the lit share of the comparisons at `places` of a square.
pub(super) fn comparisons(places: &[[f32; 2]]) -> Module {
    let compared: String = places
        .iter()
        .map(|[x, y]| {
            format!(
                "    lit += shadow_compared_at(map, receiver, square, vec2f({x:?}, {y:?})).lit;\n"
            )
        })
        .collect();
    let text = format!(
        "\
import package::receiver::ShadowReceiver;
import package::square::{{ShadowSquare, shadow_compared_at}};

// Written by `generated.rs`: the lit share of the comparisons in a square.
fn shadow_lit_share(map: u32, receiver: ShadowReceiver, square: ShadowSquare) -> f32 {{
    var lit = 0.0;
{compared}    return lit * {share:?};
}}
",
        share = 1.0 / places.len() as f64,
    );
    Module { path: "comparisons", text: text.into() }
}

/// `shadow_widest` and `shadow_blockers`: the two steps of the search for casters, one along a
/// spiral with places in these directions, the other at `places` of a disc.
pub(super) fn search(directions: &[[f32; 2]], places: &[[f32; 2]]) -> Module {
    let blocker = |scale: &str, [x, y]: &[f32; 2]| {
        format!("shadow_blocker(map, receiver, penumbrae, disc, {scale}vec2f({x:?}, {y:?}))")
    };
    let widest = directions.iter().map(|p| {
        let width = blocker("radius * ", p) + ".y";
        format!("    widest = max(widest, {width});\n    radius *= ratio;\n")
    });
    let summed = places.iter().map(|p| format!("    sum += {};\n", blocker("", p)));
    let text = format!(
        "\
import package::blockers::{{ShadowDisc, ShadowPenumbrae, shadow_blocker}};
import package::receiver::ShadowReceiver;

// Written by `generated.rs`: the widest penumbra among the texels along a logarithmic spiral, whose
// radius changes by `ratio` from place to place.
fn shadow_widest(
    map: u32,
    receiver: ShadowReceiver,
    penumbrae: ShadowPenumbrae,
    disc: ShadowDisc,
    ratio: f32,
) -> f32 {{
    var widest = 0.0;
    var radius = 0.5;
{}    return widest;
}}

// Written by `generated.rs`: the number of texels that hide some of the light, and the sum of the
// widths of their penumbrae.
fn shadow_blockers(
    map: u32,
    receiver: ShadowReceiver,
    penumbrae: ShadowPenumbrae,
    disc: ShadowDisc,
) -> vec2f {{
    var sum = vec2f(0.0);
{}    return sum;
}}
",
        widest.collect::<String>(),
        summed.collect::<String>()
    );
    Module { path: "search", text: text.into() }
}

/// `shadow_blurred`: the sum of texels times `weights`. The first weight is that of the middle
/// texel.
pub(super) fn taps(axis: Axis, weights: &[f32]) -> Module {
    let mut text = format!(
        "\
import package::blur_source::shadow_source;

// Written by `generated.rs`: a texel of the map, blurred along one axis.
fn shadow_blurred(at: vec2i, layer: u32) -> vec4f {{
    var sum = {:?} * shadow_source(at, layer);
",
        weights[0]
    );
    for (k, weight) in weights.iter().enumerate().skip(1) {
        let step = match axis {
            Axis::Rows => format!("vec2i({k}, 0)"),
            Axis::Columns => format!("vec2i(0, {k})"),
        };
        let [before, after] =
            ['-', '+'].map(|sign| format!("shadow_source(at {sign} {step}, layer)"));
        text += &format!("    sum += {weight:?} * ({before} + {after});\n");
    }
    Module { path: "blurred/taps", text: (text + "    return sum;\n}\n").into() }
}

/// `shadow_outputs` of the pass that encodes: the given `textures` of those that a texel's
/// statistics take.
pub(super) fn encoded_outputs(textures: Range<u32>) -> Module {
    let values = textures.clone().map(|t| format!("statistics[{t}]"));
    let text = outputs(
        "import package::constants::SHADOW_TEXTURES;",
        textures.len(),
        "statistics: array<vec4f, SHADOW_TEXTURES>",
        values,
    );
    Module { path: "encoded_outputs", text: text.into() }
}

/// `shadow_outputs` of a pass that blurs: the given `textures` of those that the statistics take.
pub(super) fn blurred_outputs(textures: Range<u32>) -> Module {
    let values = textures.clone().map(|t| format!("shadow_blurred(at, layer + {t}u)"));
    let text = outputs(
        "import package::blurred::taps::shadow_blurred;",
        textures.len(),
        "at: vec2i, layer: u32",
        values,
    );
    Module { path: "blurred_outputs", text: text.into() }
}

/// A struct with a member for each texture, because WGSL has no arrays of outputs.
fn outputs(
    import: &str,
    count: usize,
    parameters: &str,
    values: impl Iterator<Item = String>,
) -> String {
    let members: String =
        (0..count).map(|i| format!("    @location({i}) t{i}: vec4f,\n")).collect();
    let values: String = values.map(|value| format!("        {value},\n")).collect();
    format!(
        "\
{import}

// Written by `generated.rs`: the textures of a map that a pass draws into.
struct ShadowPrefiltered {{
{members}}}

fn shadow_outputs({parameters}) -> ShadowPrefiltered {{
    return ShadowPrefiltered(
{values}    );
}}
"
    )
}

/// `page_sides` for devices that clip at the sides of a page. WESL does not know such outputs, so
/// the package has the module for other devices alone.
pub(super) fn clipped_page_sides() -> Module {
    let discards = include_str!("page_sides/discarded.wesl");
    let clip = "    @builtin(position) clip: vec4f,\n";
    let sides = "    @builtin(clip_distances) sides: array<f32, 4>,\n";
    let (declared, _) = discards.split_once("// Whether a fragment").unwrap_or((discards, ""));
    let declared = declared
        .replace(clip, &format!("{clip}{sides}"))
        .replace("(vertex.clip, ", "(vertex.clip, shadow_page_inside(vertex.texel), ");
    let text = format!(
        "\
enable clip_distances;
{declared}\
// How far inside the four sides of the page a vertex is.
fn shadow_page_inside(texel: vec3f) -> array<f32, 4> {{
    let low = texel.xy + SHADOW_GUTTER * texel.z;
    let high = (SHADOW_PAGE_TEXELS + SHADOW_GUTTER) * texel.z - texel.xy;
    return array<f32, 4>(low.x, low.y, high.x, high.y);
}}

// No fragment belongs to another page.
fn shadow_page_is_beside(texel: vec3f) -> bool {{
    return false;
}}
"
    );
    Module { path: "page_sides/clipped", text: text.into() }
}
