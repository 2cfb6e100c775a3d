//! The least that a lookup can do: a product with a matrix, the fetches of the filter, and
//! comparisons with a constant bias.

use crate::{Failure, Set};
use glam::DVec4;
use std::fmt::Write;
use umbrage::Plan;
use umbrage::visibility::Filter;
use umbrage_render::Renderer;
use umbrage_wgpu::{Casters, ShadowOptions};

/// What the comparisons subtract from every depth.
const BIAS: f64 = 2e-3;

/// Makes a renderer that looks the only map of a plan up in this way, and draws the map. `None` for
/// filters whose fetches depend on the point, and for plans with several maps.
pub(crate) fn bare_renderer<'a>(
    set: &'a Set<'_>,
    plan: &Plan,
) -> Result<Option<Renderer<'a>>, Failure> {
    let (Some(filter), 1) = (filter_text(plan.filter), plan.maps.len()) else { return Ok(None) };
    // The same plan gets the same place in every new texture.
    let mut drawn = set.renderer(plan.filter)?;
    drawn.draw_maps(plan, Casters::Moved, None)?;
    let shadows = drawn.shadows();
    let Some(place) = shadows.place(0) else { return Ok(None) };
    let texture = shadows.depth_texture().size();
    let map = &plan.maps[0];
    let m = map.shadow_from_local;
    let texels = |row: usize| {
        let [size, origin] = [place.size, place.origin].map(|n| f64::from(n[row]));
        m.row(row) * size + m.row(3) * origin
    };
    let vector = |v: DVec4| {
        let [x, y, z, w] = v.as_vec4().to_array();
        format!("vec4f({x:?}, {y:?}, {z:?}, {w:?})")
    };
    let constants = format!(
        "
        const SHADOW_BARE_S = {};
        const SHADOW_BARE_T = {};
        const SHADOW_BARE_DEPTH = {};
        const SHADOW_BARE_W = {};
        const SHADOW_BARE_SCALE = 1.0 / vec2f({}.0, {}.0);
        ",
        vector(texels(0)),
        vector(texels(1)),
        vector(m.row(2) - m.row(3) * BIAS),
        vector(m.row(3)),
        texture.width,
        texture.height
    );
    let bare = format!(
        "{constants}
        fn shadow_visibility(light: u32, position: vec3f, normal: vec3f) -> f32 {{
            let point = vec4f(position, 1.0);
            let w = dot(SHADOW_BARE_W, point);
            let texel = vec2f(dot(SHADOW_BARE_S, point), dot(SHADOW_BARE_T, point)) / w;
            let depth = dot(SHADOW_BARE_DEPTH, point) / w;
            {filter}
        }}"
    );
    // The library's own lookup stays in the text, with another name and without a caller.
    let change =
        |lookup: String| lookup.replace("shadow_visibility(", "shadow_unused_visibility(") + &bare;
    let options = ShadowOptions { filter: plan.filter, ..ShadowOptions::default() };
    let support = set.gpu.support();
    let mut renderer = Renderer::with_lookup(set.gpu, &set.buffers, &options, support, change)?;
    renderer.draw_maps(plan, Casters::Moved, None)?;
    Ok(Some(renderer))
}

/// The part of the lookup that fetches and compares.
fn filter_text(filter: Filter) -> Option<String> {
    match filter {
        Filter::Hard => Some(
            "return select(0.0, 1.0, textureLoad(shadow_depths, vec2i(texel), 0) >= depth);"
                .to_owned(),
        ),
        Filter::Pcf { n } => Some(pcf_text(n)),
        Filter::None | Filter::Spread { .. } | Filter::Pcss { .. } | Filter::Prefiltered(_) => None,
    }
}

/// A box of n × n texels, of which the first and the last are covered in part, by gathers of four
/// texels each.
fn pcf_text(n: u32) -> String {
    let weight = |i: u32, axis: char| match i {
        0 => format!("1.0 - share.{axis}"),
        i if i < n => "1.0".to_owned(),
        i if i == n => format!("share.{axis}"),
        _ => "0.0".to_owned(),
    };
    let mut text = format!(
        "let corner = texel - {:?};
        let first = floor(corner);
        let share = corner - first;
        var sum = 0.0;\n",
        f64::from(n) / 2.0
    );
    let gathers = || (0..n + 1).step_by(2);
    for (x, y) in gathers().flat_map(|y| gathers().map(move |x| (x, y))) {
        let (x_weights, y_weights) =
            ([weight(x, 'x'), weight(x + 1, 'x')], [weight(y, 'y'), weight(y + 1, 'y')]);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "sum += dot(
                select(vec4f(0.0), vec4f(1.0), textureGather(
                    shadow_depths,
                    shadow_sampler,
                    (first + vec2f({x}.0, {y}.0) + 1.0) * SHADOW_BARE_SCALE,
                ) >= vec4f(depth)),
                vec2f({}, {}).xyyx * vec2f({}, {}).yyxx,
            );",
            x_weights[0], x_weights[1], y_weights[0], y_weights[1],
        );
    }
    text + &format!("return sum / {}.0;", n * n)
}
