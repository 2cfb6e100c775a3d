//! Shader text, put together for a device, a filter and a bind group.

use crate::{Comparison, Layout, ShadowOptions, Support};
use std::ops::Range;
use umbrage::visibility::statistic::Statistic;
use umbrage::visibility::{Blur, Filter, Footprint, Pattern, Prefilter, Width};

/// What a device without storage buffers can be told of: sizes of the uniform arrays.
pub(crate) const MAX_LIGHTS: usize = 16;
pub(crate) const MAX_MAPS: usize = 64;
pub(crate) const MAX_PLANES: usize = 512;

/// The lookup module, its bindings in bind group `group`.
pub(crate) fn lookup(group: u32, options: &ShadowOptions, storage_buffers: bool) -> String {
    let ShadowOptions { filter, comparison, layout } = *options;
    // Only in layers do shaders need to be told which.
    let (depths, layer) = match layout {
        Layout::Atlas => ("texture_depth_2d", ""),
        Layout::Layers => ("texture_depth_2d_array", ", shadow_maps[map].layer"),
    };
    let is_prefiltered = matches!(filter, Filter::Prefiltered(_));
    let texture = if is_prefiltered { "texture_2d_array<f32>" } else { depths };
    let array = |n: usize| if storage_buffers { String::new() } else { format!(", {n}") };
    let sampler = match comparison {
        Comparison::Hardware if !is_prefiltered => "sampler_comparison",
        _ => "sampler",
    };
    let bindings = include_str!("wgsl/bindings.wgsl")
        .replace("{GROUP}", &group.to_string())
        .replace("{SPACE}", if storage_buffers { "storage, read" } else { "uniform" })
        .replace("{LIGHTS}", &array(MAX_LIGHTS))
        .replace("{MAPS}", &array(MAX_MAPS))
        .replace("{PLANES}", &array(MAX_PLANES))
        .replace("{SAMPLER}", sampler)
        .replace("{TEXTURE}", texture);
    let lookup = include_str!("wgsl/lookup.wgsl").replace("{METRIC}", &metric(&filter));
    let mut text = [&lookup, &bindings, include_str!("wgsl/width.wgsl"), ""].join("\n");
    if let Filter::Prefiltered(prefilter) = filter {
        return text + &prefiltered(&prefilter, layout);
    }
    if comparison == Comparison::Hardware {
        text += include_str!("wgsl/hardware.wgsl");
        text += "\n";
    }
    text + &filtered(filter, comparison).replace("{LAYER}", layer)
}

/// The function that tells how much of a map's texels around a receiver let light through.
fn filtered(filter: Filter, comparison: Comparison) -> String {
    let (hard, pcf) = match comparison {
        Comparison::PerTexel => (include_str!("wgsl/hard.wgsl"), include_str!("wgsl/pcf.wgsl")),
        Comparison::Hardware => {
            (include_str!("wgsl/hardware_hard.wgsl"), include_str!("wgsl/hardware_pcf.wgsl"))
        }
    };
    match filter {
        Filter::Spread { n, pattern, .. } => {
            spread(&filter, n, pattern) + include_str!("wgsl/spread.wgsl")
        }
        Filter::Pcss { n, source } => {
            spread(&filter, n, Pattern::Poisson)
                + &include_str!("wgsl/pcss.wgsl").replace("{SOURCE}", &number(source))
        }
        Filter::Pcf { n } => {
            let n = n.clamp(1, Filter::MAX_PCF).to_string();
            include_str!("wgsl/pcf_weight.wgsl").replace("{N}", &n) + pcf
        }
        Filter::Hard => hard.to_owned(),
        // Looked up by other functions.
        Filter::Prefiltered(_) => String::new(),
    }
}

/// Comparisons over a width, n² of them.
fn spread(filter: &Filter, n: u32, pattern: Pattern) -> String {
    let (n, places) = match pattern {
        Pattern::Grid => {
            (n.clamp(1, Filter::MAX_PCF), include_str!("wgsl/pattern_grid.wgsl").to_owned())
        }
        Pattern::Poisson => {
            let n = n.clamp(1, Filter::MAX_DISC);
            let places =
                Filter::disc_places(n * n).iter().map(|[x, y]| format!("vec2f({x:?}, {y:?})"));
            let places = places.collect::<Vec<_>>().join(", ");
            (n, include_str!("wgsl/pattern_disc.wgsl").replace("{PLACES}", &places))
        }
    };
    let offset = include_str!("wgsl/offset.wgsl")
        .replace("{N}", &n.to_string())
        .replace("{GUTTER}", &number(filter.reach_texels() as f32));
    [&offset, places.as_str(), ""].join("\n")
}

/// Looks up what was filtered ahead.
fn prefiltered(prefilter: &Prefilter, layout: Layout) -> String {
    let textures = textures(&prefilter.statistic);
    let first = match layout {
        Layout::Atlas => "0u".to_owned(),
        Layout::Layers => format!("{textures}u * shadow_maps[map].layer"),
    };
    let filter = Filter::Prefiltered(*prefilter);
    let first_level = prefilter.first_level().to_string();
    let variance = Prefilter::DEVIATION * Prefilter::DEVIATION;
    let footprint = match prefilter.blur {
        Blur::Texels(_) => include_str!("wgsl/footprint_texels.wgsl")
            .replace("{VARIANCE}", &number(prefilter.variance_texels() as f32)),
        Blur::Width(_) => include_str!("wgsl/footprint_width.wgsl")
            .replace("{VARIANCE}", &number(variance as f32))
            .replace("{SAMPLE_VARIANCE}", &number(Footprint::SAMPLE_VARIANCE as f32))
            .replace("{LEAST_VARIANCE}", &number(Footprint::LEAST_VARIANCE as f32))
            .replace("{ANISOTROPY_SQUARED}", &number(Footprint::ANISOTROPY.powi(2) as f32))
            .replace("{KEPT_VARIANCE}", &number(Footprint::KEPT_VARIANCE as f32))
            .replace("{MAX_SAMPLES}", &number(Footprint::MAX_SAMPLES as f32))
            .replace(
                "{LAST_LEVEL}",
                &(prefilter.first_level() + prefilter.levels() - 1).to_string(),
            ),
    };
    let sample = |t: u32| {
        format!("textureSampleLevel(shadow_depths, shadow_sampler, at, first + {t}u, lod)")
    };
    let samples = (0..textures).map(sample).collect::<Vec<_>>().join(", ");
    let is_wide = matches!(prefilter.blur, Blur::Width(_));
    let lookup = choose(include_str!("wgsl/prefiltered.wgsl"), &[("SEVERAL", is_wide)])
        .replace("{FIRST_LAYER}", &first)
        .replace("{SAMPLES}", &samples)
        .replace("{TEXTURES}", &textures.to_string())
        .replace("{GUTTER}", &number(filter.reach_texels() as f32))
        .replace("{ALIGN}", &number(filter.align_texels() as f32))
        .replace("{PLANE_DEVIATIONS}", &number(prefilter.statistic.plane_deviations()));
    [statistic(&prefilter.statistic), footprint, lookup]
        .join("\n")
        .replace("{FIRST_LEVEL}", &first_level)
}

/// What a filter's width covers, as an expression of the point.
fn metric(filter: &Filter) -> String {
    let width = match filter {
        Filter::Spread { width, .. } => Some(*width),
        Filter::Prefiltered(Prefilter { blur: Blur::Width(width), .. }) => Some(*width),
        _ => None,
    };
    match width {
        _ if matches!(filter, Filter::Pcss { .. }) => {
            "shadow_metric(point.grad_s, point.grad_t)".to_owned()
        }
        Some(Width::Metres(metres)) => {
            format!("shadow_metric(point.grad_s, point.grad_t) * {:?}", metres * metres)
        }
        Some(Width::Pixels(pixels)) => {
            format!("shadow_pixel_metric(point, position, normal) * {:?}", pixels * pixels)
        }
        None => "vec3f(0.0)".to_owned(),
    }
}

/// Textures that a statistic's numbers take, at most four to each.
pub(crate) fn textures(statistic: &Statistic) -> u32 {
    statistic.channels().div_ceil(4) as u32
}

/// A number as WGSL has it: every digit, and a point.
fn number(value: f32) -> String {
    format!("{value:?}")
}

/// `shadow_encode` and `shadow_reconstruct` of a statistic, with what they need. The files are twins of those of the same name in
/// `umbrage::visibility::statistic`.
fn statistic(statistic: &Statistic) -> String {
    let chebyshev = include_str!("wgsl/chebyshev.wgsl");
    let own = match statistic {
        Statistic::Vsm(s) => include_str!("wgsl/vsm.wgsl").replace("{LEAK}", &number(s.leak)),
        Statistic::Esm(s) => {
            include_str!("wgsl/esm.wgsl").replace("{EXPONENT}", &number(s.exponent))
        }
        Statistic::Evsm(s) => include_str!("wgsl/evsm.wgsl")
            .replace("{EXPONENT}", &number(s.exponent))
            .replace("{COMPONENTS}", &s.components.to_string())
            .replace("{LEAK}", &number(s.leak)),
        Statistic::Msm(s) => include_str!("wgsl/msm.wgsl").replace("{LEAK}", &number(s.leak)),
        Statistic::Csm(s) => {
            let mut amounts: Vec<f32> = s.terms().map(|[_, amount]| amount).collect();
            amounts.resize(amounts.len().next_multiple_of(2), 0.0);
            let pairs = amounts.chunks(2).map(|a| format!("vec2f({:?}, {:?})", a[0], a[1]));
            let rate = s.terms().next().map_or(0.0, |[rate, _]| rate);
            include_str!("wgsl/csm.wgsl")
                .replace("{RATE}", &number(rate))
                .replace("{AMOUNTS}", &pairs.collect::<Vec<_>>().join(", "))
                .replace("{SHIFT}", &number(s.shift() / s.shrink()))
                .replace("{GAIN}", &number(s.gain()))
                .replace("{LEAK}", &number(s.leak()))
        }
    };
    let textures = textures(statistic).to_string();
    [include_str!("wgsl/slab.wgsl"), chebyshev, &own.replace("{TEXTURES}", &textures), ""]
        .join("\n")
}

/// A pass of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrefilterPass {
    /// From depths to numbers.
    Encode,
    /// Along rows, then along columns.
    Rows,
    Columns,
    /// Into a copy of half the resolution.
    Halve,
}

/// The module of a pass that writes the textures in `range`, of those that the numbers take.
pub(crate) fn prefilter(prefilter: &Prefilter, pass: PrefilterPass, range: Range<u32>) -> String {
    let outputs = (0..range.len()).map(|i| format!("    @location({i}) t{i}: vec4f,"));
    let outputs = outputs.collect::<Vec<_>>().join("\n");
    let is_encode = pass == PrefilterPass::Encode;
    let values = range.map(|i| {
        if is_encode {
            format!("numbers[{i}]")
        } else {
            format!("shadow_blurred(texel, layer + {i}u)")
        }
    });
    let values = values.collect::<Vec<_>>().join(", ");
    let weights: Vec<f32> = prefilter.weights().collect();
    let taps = weights.iter().enumerate().skip(1).map(|(k, w)| {
        let tap = |sign| {
            let step = if pass == PrefilterPass::Rows { [k, 0] } else { [0, k] };
            let at = format!("at {sign} vec2i({}, {})", step[0], step[1]);
            format!("textureLoad(shadow_prefilter_source, {at}, layer, 0)")
        };
        format!("    sum += {w:?} * ({} + {});", tap("-"), tap("+"))
    });
    let text = choose(
        include_str!("wgsl/prefilter.wgsl"),
        &[("ENCODE", is_encode), ("HALVE", pass == PrefilterPass::Halve), ("HALF", prefilter.half)],
    )
    .replace("{TEXTURES}", &textures(&prefilter.statistic).to_string())
    .replace("{OUTPUTS}", &outputs)
    .replace("{VALUES}", &values)
    .replace("{WEIGHT_0}", &number(weights[0]))
    .replace("{TAPS}", &taps.collect::<Vec<_>>().join("\n"));
    if is_encode { statistic(&prefilter.statistic) + &text } else { text }
}

/// The casters' module, its binding in bind group `group`.
pub(crate) fn caster(group: u32, support: &Support) -> String {
    let clip = if support.depth_clip_control {
        include_str!("wgsl/caster_clamped.wgsl")
    } else {
        include_str!("wgsl/caster_emulated.wgsl")
    };
    include_str!("wgsl/caster.wgsl").replace("{GROUP}", &group.to_string()) + clip
}

/// Plain meshes, with the casters' module in bind group 0 and the mask in group 1.
pub(crate) fn mesh(support: &Support, is_masked: bool) -> String {
    let flags = [("MASK", is_masked), ("EMULATED", !support.depth_clip_control)];
    format!("{}\n{}", caster(0, support), choose(include_str!("wgsl/mesh.wgsl"), &flags))
}

/// Keeps of `//IF NAME` … `//ELSE` … `//END` what its flag says; blocks nest.
fn choose(text: &str, flags: &[(&str, bool)]) -> String {
    let mut stack: Vec<bool> = Vec::new();
    let mut chosen = String::new();
    for line in text.lines() {
        match line.trim().split_once(' ').unwrap_or((line.trim(), "")) {
            ("//IF", name) => {
                stack.push(flags.iter().any(|&(flag, is_set)| flag == name && is_set));
            }
            ("//ELSE", _) => {
                if let Some(is_kept) = stack.last_mut() {
                    *is_kept = !*is_kept;
                }
            }
            ("//END", _) => {
                stack.pop();
            }
            _ if stack.iter().all(|&is_kept| is_kept) => {
                chosen.push_str(line);
                chosen.push('\n');
            }
            _ => {}
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data;
    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
    use std::mem::{offset_of, size_of};
    use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Vsm};

    fn validated(text: &str) -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(text)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module);
        let info = info.unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        (module, info)
    }

    fn statistics() -> Vec<Statistic> {
        let csm = |m| Statistic::Csm(Csm::new(m, 0.5, true, false).unwrap());
        vec![
            Statistic::Vsm(Vsm::default()),
            Statistic::Esm(Esm::default()),
            Statistic::Evsm(Evsm::default()),
            Statistic::Evsm(Evsm { components: 2, ..Evsm::default() }),
            Statistic::Msm(Msm::default()),
            csm(1),
            csm(3),
            csm(16),
        ]
    }

    const PASSES: [PrefilterPass; 4] =
        [PrefilterPass::Encode, PrefilterPass::Rows, PrefilterPass::Columns, PrefilterPass::Halve];

    #[test]
    fn every_pass_of_a_prefilter_is_valid() {
        for statistic in statistics() {
            let blurs = [1, 3, 63].map(Blur::Texels);
            for blur in blurs.into_iter().chain([Blur::Width(Width::Metres(1.0))]) {
                for half in [false, true] {
                    let filter = Prefilter { statistic, blur, half };
                    let all = textures(&statistic);
                    for range in [0..all, 0..1, all - 1..all] {
                        for pass in PASSES {
                            validated(&prefilter(&filter, pass, range.clone()));
                        }
                    }
                }
            }
        }
    }

    /// A user's shader: everything that may be called is, from a fragment shader.
    const USER: &str = "
        @fragment
        fn user(@location(0) position: vec3f, @location(1) normal: vec3f) -> @location(0) vec4f {
            let place = shadow_place(1u, position);
            let given = shadow_visibility(0u, position, normal);
            return vec4f(given, shadow_visibility(1u, position, shadow_normal(position)), place.texel);
        }";

    fn variants() -> impl Iterator<Item = (ShadowOptions, bool)> {
        let prefiltered = statistics().into_iter().flat_map(|statistic| {
            let blurs =
                [Blur::Texels(7), Blur::Width(Width::Metres(0.5)), Blur::Width(Width::Pixels(3.0))];
            blurs.into_iter().flat_map(move |blur| {
                [false, true].map(|half| Filter::Prefiltered(Prefilter { statistic, blur, half }))
            })
        });
        let widths = [Width::Metres(0.5), Width::Pixels(3.0)];
        let spread = [Pattern::Grid, Pattern::Poisson]
            .into_iter()
            .flat_map(move |pattern| widths.map(|width| Filter::Spread { n: 5, width, pattern }));
        let soft = [1, 8].map(|n| Filter::Pcss { n, source: 0.5 });
        let filters = [Filter::Hard].into_iter().chain((1..=15).map(|n| Filter::Pcf { n }));
        let filters = filters.chain(prefiltered).chain(spread).chain(soft);
        let with = |filter| {
            let comparisons = [Comparison::PerTexel, Comparison::Hardware];
            comparisons.into_iter().flat_map(move |comparison| {
                [Layout::Atlas, Layout::Layers].map(|layout| ShadowOptions {
                    filter,
                    comparison,
                    layout,
                })
            })
        };
        filters.flat_map(with).flat_map(|options| [true, false].map(|storage| (options, storage)))
    }

    #[test]
    fn every_lookup_module_is_valid_in_front_of_a_users_shader() {
        for (options, storage) in variants() {
            for group in [0, 3] {
                validated(&(lookup(group, &options, storage) + USER));
            }
        }
    }

    #[test]
    fn every_caster_module_is_valid() {
        for depth_clip_control in [true, false] {
            let support = Support { depth_clip_control, ..Support::FULL };
            for is_masked in [true, false] {
                let (module, _) = validated(&mesh(&support, is_masked));
                let has_fragment = is_masked || !depth_clip_control;
                assert_eq!(module.entry_points.len(), 1 + usize::from(has_fragment));
            }
        }
        validated(include_str!("wgsl/clear.wgsl"));
    }

    #[test]
    fn nothing_pollutes_a_users_names() {
        for (options, storage) in variants() {
            let (module, _) = validated(&lookup(1, &options, storage));
            let functions = module.functions.iter().filter_map(|(_, f)| f.name.as_deref());
            let globals = module.global_variables.iter().filter_map(|(_, g)| g.name.as_deref());
            let constants = module.constants.iter().filter_map(|(_, c)| c.name.as_deref());
            let types = module.types.iter().filter_map(|(_, t)| t.name.as_deref());
            for name in functions.chain(globals).chain(constants).chain(types) {
                assert!(name.to_lowercase().starts_with("shadow"), "{name}");
            }
        }
    }

    /// Offsets and size of a struct as naga lays it out.
    fn layout(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name));
        let (_, ty) = found.unwrap_or_else(|| panic!("no struct {name}"));
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name}") };
        let members = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize));
        (members.collect(), *span as usize)
    }

    macro_rules! check_layout {
        ($module:expr, $name:literal, $type:ty, [$($field:ident),* $(,)?]) => {
            let (members, span) = layout($module, $name);
            let ours = vec![$((stringify!($field).to_owned(), offset_of!($type, $field))),*];
            assert_eq!(members, ours, $name);
            assert_eq!(span, size_of::<$type>(), $name);
        };
    }

    #[test]
    fn structs_are_laid_out_alike() {
        let (module, _) = validated(&(lookup(0, &ShadowOptions::default(), true) + USER));
        let m = &module;
        check_layout!(
            m,
            "ShadowSettings",
            data::Settings,
            [bias_texels, bias_metres, light_count, texture_scale, pixel_gradient, eye]
        );
        check_layout!(m, "ShadowLight", data::Light, [first_map, map_count, padding]);
        check_layout!(
            m,
            "ShadowMap",
            data::Map,
            [
                s,
                t,
                depth,
                w,
                fade_from,
                beam_scale,
                slab,
                size,
                origin,
                layer,
                first_plane,
                plane_count,
                index
            ]
        );
        let (module, _) = validated(&mesh(&Support::FULL, true));
        check_layout!(&module, "ShadowCasterMap", data::CasterMap, [clip_from_render]);
        let text = prefilter(
            &Prefilter { statistic: statistics()[0], blur: Blur::Texels(3), half: false },
            PrefilterPass::Rows,
            0..1,
        );
        let (own, _) = validated(&text);
        let (members, span) = layout(&own, "ShadowPrefilterMap");
        let ours = [
            offset_of!(data::PrefilterMap, beam_scale),
            offset_of!(data::PrefilterMap, slab),
            offset_of!(data::PrefilterMap, origin),
            offset_of!(data::PrefilterMap, first_layer),
        ];
        assert_eq!(members.iter().map(|m| m.1).collect::<Vec<_>>(), ours);
        assert_eq!(span, size_of::<data::PrefilterMap>());
        check_layout!(&module, "ShadowMask", data::Mask, [factor, cutoff]);
    }

    #[test]
    fn uniform_arrays_fit_where_least_is_guaranteed() {
        let least = wgpu::Limits::downlevel_webgl2_defaults().max_uniform_buffer_binding_size;
        assert!((size_of::<data::Light>() * MAX_LIGHTS) as u64 <= least);
        assert!((size_of::<data::Map>() * MAX_MAPS) as u64 <= least);
        assert!((size_of::<[f32; 4]>() * MAX_PLANES) as u64 <= least);
    }
}
