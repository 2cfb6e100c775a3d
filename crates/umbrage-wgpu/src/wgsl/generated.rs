//! Modules whose length depends on options, which Rust therefore writes.
//!
//! The outputs of a pass must be written this way, because WGSL has no arrays of outputs. The blur
//! could be a loop over a constant array of weights, which gives the same bits. The loop takes some
//! 10% longer on lavapipe, however, and naga adds a counter to every loop to bound it. Samples are
//! straight-line code for the same reason.

use super::Module;
use std::ops::Range;

/// The axis of one of the two passes of a separable blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    /// Along s.
    Rows,
    /// Along t.
    Columns,
}

/// `shadow_sample`: one sample of each texture of the statistics.
pub(super) fn samples(textures: u32) -> Module {
    let mut text = "\
import package::constants::SHADOW_TEXTURES;
import package::texture::atlas_statistics::{shadow_statistics, shadow_sampler};

// Written by `generated.rs`: one sample of all statistics of a map, which begin in layer `first`.
fn shadow_sample(at: vec2f, first: u32, lod: f32) -> array<vec4f, SHADOW_TEXTURES> {
    return array<vec4f, SHADOW_TEXTURES>(
"
    .to_owned();
    for t in 0..textures {
        text += &format!(
            "        textureSampleLevel(shadow_statistics, shadow_sampler, at, first + {t}u, lod),\n"
        );
    }
    Module { path: "samples", text: (text + "    );\n}\n").into() }
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
