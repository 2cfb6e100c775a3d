//! The text of shaders: the modules that a device, a filter and a bind group need, one after
//! another.
//!
//! `wgsl/` is a WESL package (see `wesl.toml`). Its files are valid by themselves, and editors
//! follow their imports. Files in one folder are alternatives that declare the same names; imports
//! name one of them, and the functions in this module choose the one that a shader gets. Constants
//! and straight-line code that depend on options are written by Rust. The package has an example of
//! each module that is written so.
//!
//! All names are unique, so the texts of the modules without their imports are plain WGSL. WESL's
//! compiler would produce the same, and the tests compare both. Users of this library do not need
//! that compiler, which takes minutes to build.

mod generated;

use crate::{AttributeLayout, Comparison, Layout, LookupBuffers, ShadowOptions, Support};
use generated::Axis;
use std::borrow::Cow;
use std::fmt::Debug;
use std::ops::Range;
use umbrage::visibility::statistic::Statistic;
use umbrage::visibility::{Blur, Filter, Footprint, Pattern, Prefilter, Width};

/// The greatest numbers of elements in uniform buffers: the lengths of the arrays in
/// `buffers/uniform.wesl`.
pub(crate) const MAX_LIGHTS: usize = 16;
pub(crate) const MAX_MAPS: usize = 64;
pub(crate) const MAX_PLANES: usize = 512;

/// A module of the package.
#[derive(Clone, Debug)]
struct Module {
    /// The file of the module is `wgsl/PATH.wesl`.
    path: &'static str,
    text: Cow<'static, str>,
}

/// A module whose text is a file of the package.
macro_rules! module {
    ($path:literal) => {
        Module { path: $path, text: include_str!(concat!("wgsl/", $path, ".wesl")).into() }
    };
}

/// The modules of a shader, and the constants that they import.
#[derive(Clone, Debug)]
struct Shader {
    modules: Vec<Module>,
    constants: String,
}

impl Shader {
    /// A shader whose module `root` imports all other modules, directly or through others.
    fn new(root: Module) -> Self {
        Self { modules: vec![root], constants: String::new() }
    }

    fn add(&mut self, modules: impl IntoIterator<Item = Module>) {
        self.modules.extend(modules);
    }

    /// Declares a constant, with the value written as a WGSL literal. It has no type, so that
    /// arithmetic between constants is as exact as between literals.
    fn constant(&mut self, name: &str, value: impl Debug) {
        self.constants += &format!("const {name} = {value:?};\n");
    }

    /// All modules, the root first and the constants last.
    fn modules(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let modules = self.modules.iter().map(|module| (module.path, &*module.text));
        modules.chain([("constants", self.constants.as_str())])
    }

    /// The shader as plain WGSL.
    fn link(&self) -> String {
        let is_directive = |line: &&str| line.starts_with("enable ");
        let all_lines = self.modules().flat_map(|(_, text)| text.lines());
        let mut linked: String =
            all_lines.filter(is_directive).flat_map(|line| [line, "\n"]).collect();
        for (path, text) in self.modules() {
            linked += &format!("// {path}.wesl of umbrage-wgpu\n");
            // Every import is one line. Directives stand before all else.
            let is_kept = |line: &&str| !line.starts_with("import ") && !is_directive(line);
            for line in text.lines().filter(is_kept) {
                linked += line;
                linked.push('\n');
            }
        }
        linked
    }
}

/// The text of the lookup, with its bindings in bind group `group`.
pub(crate) fn lookup(group: u32, options: &ShadowOptions) -> String {
    lookup_shader(group, options).link()
}

/// A shader's text with `name` before all names that begin with `shadow`, `Shadow` or `SHADOW`:
/// `shadow_normal` becomes `sun_shadow_normal`, and `ShadowMap` becomes `SunShadowMap`.
pub(crate) fn named(text: &str, name: &str) -> String {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let capital = name.chars().take(1).map(|c| c.to_ascii_uppercase());
    let capitalised: String = capital.chain(name.chars().skip(1)).collect();
    let prefixes = [
        ("shadow_", format!("{name}_")),
        ("Shadow", capitalised),
        ("SHADOW_", format!("{}_", name.to_ascii_uppercase())),
    ];
    let mut renamed = String::with_capacity(text.len() * 11 / 10);
    let mut is_inside_word = false;
    for (i, c) in text.char_indices() {
        if !is_inside_word {
            let prefix = prefixes.iter().find(|(begin, _)| text[i..].starts_with(begin));
            renamed.extend(prefix.map(|(_, prefix)| prefix.as_str()));
        }
        renamed.push(c);
        is_inside_word = is_word(c);
    }
    renamed
}

fn lookup_shader(group: u32, options: &ShadowOptions) -> Shader {
    let ShadowOptions { filter, comparison, layout, buffers, fades, pages, .. } = *options;
    let root = if filter.has_maps() { module!("lookup") } else { module!("lookup_none") };
    let mut shader = Shader::new(root);
    shader.constant("SHADOW_GROUP", group);
    shader.add([
        module!("maps"),
        match buffers {
            LookupBuffers::Uniform => module!("buffers/uniform"),
            LookupBuffers::Storage => module!("buffers/storage"),
        },
        module!("receiver"),
    ]);
    if !filter.has_maps() {
        return shader;
    }
    if pages {
        add_pages(&mut shader, &filter);
        shader.add([module!("served/pages"), module!("page_corner"), module!("page_place")]);
    } else {
        shader.add([module!("served/maps")]);
    }
    shader.add([module!("choice"), module!("with_filter")]);
    shader.add([if fades { module!("fade/far") } else { module!("fade/none") }]);
    add_width(&mut shader, &filter);
    add_reach(&mut shader, &filter);
    let depths = match layout {
        Layout::Atlas => module!("texture/atlas"),
        Layout::Layers => module!("texture/layers"),
    };
    let compared = match layout {
        Layout::Atlas => module!("texture/atlas_compared"),
        Layout::Layers => module!("texture/layers_compared"),
    };
    match (filter, comparison) {
        (Filter::None, _) => {}
        (Filter::Hard, Comparison::PerTexel) => shader.add([depths, module!("filter/hard")]),
        (Filter::Hard, Comparison::Hardware) => {
            shader.add([compared, module!("hardware"), module!("filter/hardware_hard")]);
        }
        (Filter::Pcf { n }, comparison) => {
            let n = n.clamp(1, Filter::MAX_PCF);
            shader.add(match comparison {
                Comparison::PerTexel => vec![depths, generated::pcf(n, layout)],
                Comparison::Hardware => vec![
                    compared,
                    module!("hardware"),
                    module!("hardware_four"),
                    generated::hardware_pcf(n),
                ],
            });
        }
        (Filter::Spread { n, pattern, .. }, _) => {
            shader.add([depths, module!("filter/spread")]);
            add_square(&mut shader, options, &places(pattern, n));
        }
        (Filter::Pcss { n, light }, _) => {
            let places = places(Pattern::Poisson, n);
            shader.constant("SHADOW_LIGHT_DIAMETER", light.diameter());
            shader.constant("SHADOW_NEAR_ENOUGH", Filter::NEAR_ENOUGH);
            shader.constant("SHADOW_PLACE_SHARE", 1.0 / places.len() as f32);
            let directions: Vec<_> = Filter::spiral_directions(places.len() as u32).collect();
            shader.add([
                depths,
                module!("filter/pcss"),
                module!("blockers"),
                generated::search(&directions, &places),
            ]);
            add_square(&mut shader, options, &places);
        }
        (Filter::Prefiltered(prefilter), _) => {
            shader.add([
                match layout {
                    Layout::Atlas => module!("texture/atlas_statistics"),
                    Layout::Layers => module!("texture/layers_statistics"),
                },
                module!("filter/prefiltered"),
            ]);
            add_prefiltered(&mut shader, &prefilter);
        }
    }
    shader
}

/// Adds the module that computes how many texels a filter's width covers.
fn add_width(shader: &mut Shader, filter: &Filter) {
    let width = match filter {
        Filter::None | Filter::Hard | Filter::Pcf { .. } => None,
        Filter::Spread { width, .. } => Some(*width),
        // The filter multiplies the metric of one metre by its own widths in metres.
        Filter::Pcss { .. } => Some(Width::Metres(1.0)),
        Filter::Prefiltered(prefilter) => match prefilter.blur {
            Blur::Texels(_) => None,
            Blur::Width(width) => Some(width),
        },
    };
    if let Some(Width::Metres(width) | Width::Pixels(width)) = width {
        shader.constant("SHADOW_WIDTH_SQUARED", width * width);
        shader.add([module!("metric")]);
    }
    shader.add([match width {
        None => module!("width/texels"),
        Some(Width::Metres(_)) => module!("width/metres"),
        Some(Width::Pixels(_)) => module!("width/pixels"),
    }]);
}

/// Declares the distance from a receiver to the centre of the farthest texel that the filter reads,
/// in texels plus widths. Lookups with smooth normals allow for the lean of the normal over this
/// distance.
fn add_reach(shader: &mut Shader, filter: &Filter) {
    const HALF_DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;
    let [texels, widths] = match filter {
        Filter::None => [0.0; 2],
        Filter::Hard => [HALF_DIAGONAL, 0.0],
        Filter::Pcf { n } => [HALF_DIAGONAL * ((*n).clamp(1, Filter::MAX_PCF) + 1) as f32, 0.0],
        Filter::Spread { .. } => [HALF_DIAGONAL, HALF_DIAGONAL],
        // The widths of these filters depend on what they find in the map, so a fixed distance
        // stands for them.
        Filter::Pcss { .. } | Filter::Prefiltered(_) => [4.0, 0.0],
    };
    shader.constant("SHADOW_REACH", texels);
    shader.constant("SHADOW_REACH_IN_WIDTHS", widths);
}

/// The n² places of a pattern, in a square of side 1 around 0.
fn places(pattern: Pattern, n: u32) -> Vec<[f32; 2]> {
    match pattern {
        Pattern::Grid => {
            let n = n.clamp(1, Filter::MAX_PCF);
            let place = |k: u32| [k % n, k / n].map(|i| (i as f32 + 0.5) / n as f32 - 0.5);
            (0..n * n).map(place).collect()
        }
        Pattern::Poisson => {
            let n = n.clamp(1, Filter::MAX_DISC);
            Filter::disc_places(n * n).to_vec()
        }
    }
}

/// Adds the comparisons at these places of a square or a disc.
fn add_square(shader: &mut Shader, options: &ShadowOptions, places: &[[f32; 2]]) {
    if options.pages {
        shader.add([module!("ends/page")]);
    } else {
        shader.constant("SHADOW_GUTTER", options.filter.reach_texels() as f32);
        shader.add([module!("ends/map")]);
    }
    shader.add([module!("square"), generated::comparisons(places)]);
}

/// Adds the module that finds pages, with the gutter around them that the filter reads.
fn add_pages(shader: &mut Shader, filter: &Filter) {
    shader.constant("SHADOW_GUTTER", filter.reach_texels() as f32);
    shader.add([module!("pages"), module!("page_types")]);
}

/// The bind group in which the request for pages has the lookup's bindings.
pub(crate) const PAGE_LOOKUP_GROUP: u32 = 1;

/// The text of the pass that lists the pages which the viewer's depths want.
pub(crate) fn page_request(filter: &Filter, is_multisampled: bool) -> String {
    page_request_shader(filter, is_multisampled).link()
}

fn page_request_shader(filter: &Filter, is_multisampled: bool) -> Shader {
    let mut shader = Shader::new(module!("page_request"));
    shader.constant("SHADOW_GROUP", PAGE_LOOKUP_GROUP);
    add_pages(&mut shader, filter);
    shader.add([
        module!("maps"),
        module!("buffers/storage"),
        module!("choice"),
        depths(is_multisampled),
    ]);
    shader
}

/// The text of the passes that give pages their places.
pub(crate) fn page_allocate() -> String {
    page_allocate_shader().link()
}

fn page_allocate_shader() -> Shader {
    let mut shader = Shader::new(module!("page_allocate"));
    shader.add([module!("page_types")]);
    shader
}

/// The text of the pass that clears pages.
pub(crate) fn page_clear(filter: &Filter, support: &Support) -> String {
    page_clear_shader(filter, support).link()
}

fn page_clear_shader(filter: &Filter, support: &Support) -> Shader {
    let mut shader = Shader::new(module!("page_clear"));
    add_page_casters(&mut shader, filter, support);
    shader
}

/// The text of the pass that finds the triangles of clusters that pages show.
pub(crate) fn page_triangles(filter: &Filter) -> String {
    page_triangles_shader(filter).link()
}

fn page_triangles_shader(filter: &Filter) -> Shader {
    let mut shader = Shader::new(module!("page_triangles"));
    shader.constant("SHADOW_GUTTER", filter.reach_texels() as f32);
    shader.add([module!("cluster_corners"), module!("cluster_types"), module!("page_types")]);
    shader
}

/// The text of the shader that draws triangles of clusters into pages, which they are inside or not,
/// with the pages in bind group 0, the mask in bind group 1 and the clusters in bind group 2.
pub(crate) fn page_caster(
    support: &Support,
    filter: &Filter,
    layout: AttributeLayout,
    is_masked: bool,
    are_inside: bool,
) -> String {
    page_caster_shader(support, filter, layout, is_masked, are_inside).link()
}

fn page_caster_shader(
    support: &Support,
    filter: &Filter,
    layout: AttributeLayout,
    is_masked: bool,
    are_inside: bool,
) -> Shader {
    let root =
        if is_masked { module!("page_cluster_masked") } else { module!("page_cluster_opaque") };
    let mut shader = Shader::new(root);
    add_page_stages(&mut shader, support, filter, is_masked, are_inside);
    if is_masked {
        add_cluster_uv(&mut shader, layout);
    }
    add_cluster_vertex(&mut shader, CLUSTER_GROUP, layout);
    shader
}

/// The bind group that tells which instances of whole meshes are drawn into pages.
pub(crate) const PAGE_MESH_GROUP: u32 = 2;

/// The text of the shader that draws whole meshes into pages, with the pages in bind group 0 and the
/// mask in bind group 1.
pub(crate) fn page_mesh(support: &Support, filter: &Filter, is_masked: bool) -> String {
    page_mesh_shader(support, filter, is_masked).link()
}

fn page_mesh_shader(support: &Support, filter: &Filter, is_masked: bool) -> Shader {
    let root = if is_masked { module!("page_mesh_masked") } else { module!("page_mesh_opaque") };
    let mut shader = Shader::new(root);
    shader.constant("SHADOW_PAGE_MESH_GROUP", PAGE_MESH_GROUP);
    add_page_stages(&mut shader, support, filter, is_masked, false);
    shader.add([module!("mesh"), module!("page_mesh"), module!("page_mesh_types")]);
    shader
}

/// The text of the passes that list whole meshes in pages.
pub(crate) fn page_meshes() -> String {
    page_meshes_shader().link()
}

fn page_meshes_shader() -> Shader {
    let mut shader = Shader::new(module!("page_meshes"));
    shader.add([module!("maps"), module!("page_mesh_types"), module!("page_types")]);
    shader
}

/// The text of the pass that copies the depths of what stands still.
pub(crate) fn page_copy(filter: &Filter, support: &Support) -> String {
    page_copy_shader(filter, support).link()
}

fn page_copy_shader(filter: &Filter, support: &Support) -> Shader {
    let mut shader = Shader::new(module!("page_copy"));
    add_page_casters(&mut shader, filter, support);
    shader
}

/// Adds the fragment stages of casters in pages, and what their vertex stages share.
fn add_page_stages(
    shader: &mut Shader,
    support: &Support,
    filter: &Filter,
    is_masked: bool,
    are_inside: bool,
) {
    add_page_casters(shader, filter, support);
    shader.add([match (are_inside, support.clip_distances) {
        (true, _) => module!("page_sides/none"),
        (false, true) => generated::clipped_page_sides(),
        (false, false) => module!("page_sides/discarded"),
    }]);
    if is_masked {
        shader.add([module!("page_masked"), module!("holes")]);
    } else {
        shader.add([module!("page_opaque")]);
    }
}

fn add_page_casters(shader: &mut Shader, filter: &Filter, support: &Support) {
    shader.constant("SHADOW_GUTTER", filter.reach_texels() as f32);
    shader.constant("SHADOW_DEVICE_CLAMPS", support.depth_clip_control);
    let own = [module!("page_casters"), module!("page_place"), module!("page_types")];
    shader.add(own.into_iter().chain([module!("maps")]));
}

/// The module that reads the viewer's depths.
fn depths(is_multisampled: bool) -> Module {
    if is_multisampled { module!("depths/multisampled") } else { module!("depths/single") }
}

/// Adds the lookup of a prefiltered map.
fn add_prefiltered(shader: &mut Shader, prefilter: &Prefilter) {
    let filter = Filter::Prefiltered(*prefilter);
    shader.constant("SHADOW_GUTTER", filter.reach_texels() as f32);
    shader.constant("SHADOW_ALIGN", filter.align_texels() as f32);
    shader.constant("SHADOW_PLANE_DEVIATIONS", prefilter.statistic.plane_deviations());
    shader.constant("SHADOW_FIRST_LEVEL", prefilter.first_level());
    shader.add([
        module!("footprints"),
        module!("slab"),
        generated::samples(textures(&prefilter.statistic)),
    ]);
    match prefilter.blur {
        Blur::Texels(_) => {
            shader.constant("SHADOW_VARIANCE", prefilter.variance_texels() as f32);
            shader.add([module!("footprint/texels")]);
        }
        Blur::Width(_) => {
            let variance = Prefilter::DEVIATION * Prefilter::DEVIATION;
            let last_level = prefilter.first_level() + prefilter.levels() - 1;
            shader.constant("SHADOW_VARIANCE", variance as f32);
            shader.constant("SHADOW_LAST_LEVEL", last_level);
            shader.constant("SHADOW_SAMPLE_VARIANCE", Footprint::SAMPLE_VARIANCE as f32);
            shader.constant("SHADOW_LEAST_VARIANCE", Footprint::LEAST_VARIANCE as f32);
            shader.constant("SHADOW_ANISOTROPY_SQUARED", Footprint::ANISOTROPY.powi(2) as f32);
            shader.constant("SHADOW_KEPT_VARIANCE", Footprint::KEPT_VARIANCE as f32);
            shader.constant("SHADOW_MAX_SAMPLES", Footprint::MAX_SAMPLES as f32);
            shader
                .add([module!("footprint/width"), generated::sums(textures(&prefilter.statistic))]);
        }
    }
    add_statistic(shader, &prefilter.statistic);
}

/// The number of texture layers that a statistic takes, with at most four channels in each.
pub(crate) fn textures(statistic: &Statistic) -> u32 {
    statistic.channels().div_ceil(4) as u32
}

/// Adds `shadow_encode` and `shadow_reconstruct` of a statistic, with the functions that they need.
/// These modules mirror the files of the same name in `umbrage::visibility::statistic`.
fn add_statistic(shader: &mut Shader, statistic: &Statistic) {
    shader.constant("SHADOW_TEXTURES", textures(statistic));
    match statistic {
        Statistic::Vsm(s) => {
            shader.constant("SHADOW_LEAK", s.leak);
            shader.add([module!("statistic/vsm"), module!("chebyshev")]);
        }
        Statistic::Esm(s) => {
            shader.constant("SHADOW_EXPONENT", s.exponent);
            shader.add([module!("statistic/esm")]);
        }
        Statistic::Evsm(s) => {
            shader.constant("SHADOW_EXPONENT", s.exponent);
            shader.constant("SHADOW_COMPONENTS", s.components);
            shader.constant("SHADOW_LEAK", s.leak);
            shader.add([module!("statistic/evsm"), module!("chebyshev")]);
        }
        Statistic::Msm(s) => {
            shader.constant("SHADOW_LEAK", s.leak);
            shader.add([module!("statistic/msm"), module!("chebyshev")]);
        }
        Statistic::Csm(s) => {
            let amounts: Vec<f32> = s.terms().map(|[_, amount]| amount).collect();
            let pair = |pair: &[f32]| [pair[0], pair.get(1).copied().unwrap_or(0.0)];
            let pairs: Vec<[f32; 2]> = amounts.chunks(2).map(pair).collect();
            let rate = s.terms().next().map_or(0.0, |[rate, _]| rate);
            shader.constant("SHADOW_CSM_RATE", rate);
            shader.constant("SHADOW_CSM_AMOUNTS", format_args!("{}", vectors(&pairs)));
            shader.constant("SHADOW_CSM_SHIFT", s.shift() / s.shrink());
            shader.constant("SHADOW_CSM_GAIN", s.gain());
            shader.constant("SHADOW_LEAK", s.leak());
            shader.add([generated::csm(textures(statistic)), module!("turned")]);
        }
    }
}

/// A constant array of vectors, as WGSL text.
fn vectors(vectors: &[[f32; 2]]) -> String {
    let elements: Vec<_> = vectors.iter().map(|[x, y]| format!("vec2f({x:?}, {y:?})")).collect();
    format!("array<vec2f, {}>({})", vectors.len(), elements.join(", "))
}

/// A pass of a prefilter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrefilterPass {
    /// Turns depths into statistics.
    Encode,
    /// Blurs along rows.
    Rows,
    /// Blurs along columns.
    Columns,
    /// Draws a mip level from the one with twice its resolution.
    Halve,
}

/// The text of a pass that writes the textures in `range` among those that a statistic takes.
pub(crate) fn prefilter(prefilter: &Prefilter, pass: PrefilterPass, range: Range<u32>) -> String {
    prefilter_shader(prefilter, pass, range).link()
}

fn prefilter_shader(prefilter: &Prefilter, pass: PrefilterPass, range: Range<u32>) -> Shader {
    let taps = |axis| generated::taps(axis, &prefilter.weights().collect::<Vec<_>>());
    let blurred = match pass {
        PrefilterPass::Encode => {
            let mut shader = Shader::new(module!("encode"));
            shader.add([
                module!("prefilter"),
                module!("texel_statistics"),
                module!("slab"),
                generated::encoded_outputs(range),
            ]);
            if prefilter.half {
                let sums = generated::sums(textures(&prefilter.statistic));
                shader.add([module!("encoded/half"), sums]);
            } else {
                shader.add([module!("encoded/full")]);
            }
            add_statistic(&mut shader, &prefilter.statistic);
            return shader;
        }
        PrefilterPass::Rows => taps(Axis::Rows),
        PrefilterPass::Columns => taps(Axis::Columns),
        PrefilterPass::Halve => module!("blurred/halve"),
    };
    let mut shader = Shader::new(module!("blur"));
    shader.add([
        module!("prefilter"),
        module!("blur_source"),
        blurred,
        generated::blurred_outputs(range),
    ]);
    shader
}

/// The text for shaders that draw casters, with its binding in bind group `group`.
pub(crate) fn caster(group: u32, support: &Support) -> String {
    caster_shader(group, support).link()
}

fn caster_shader(group: u32, support: &Support) -> Shader {
    let mut shader = Shader::new(module!("caster"));
    add_caster_constants(&mut shader, group, support);
    shader
}

/// The text of the shader of [`MeshCasters`](crate::MeshCasters), with the map in bind group 0 and
/// the mask in bind group 1.
pub(crate) fn mesh(support: &Support, is_masked: bool) -> String {
    mesh_shader(support, is_masked).link()
}

fn mesh_shader(support: &Support, is_masked: bool) -> Shader {
    let root = if is_masked { module!("mesh_masked") } else { module!("mesh_opaque") };
    let mut shader = Shader::new(root);
    shader.add([module!("caster"), module!("mesh")]);
    if is_masked {
        shader.add([module!("mask"), module!("holes")]);
    }
    add_caster_constants(&mut shader, 0, support);
    shader
}

/// The bind group in which shaders that draw clusters into maps have their bindings.
const CLUSTER_GROUP: u32 = 2;

/// The text of the shader of [`ClusterCasters`](crate::ClusterCasters), with the map in bind group
/// 0, the mask in bind group 1 and the clusters in bind group 2.
pub(crate) fn cluster_caster(
    support: &Support,
    layout: AttributeLayout,
    is_masked: bool,
) -> String {
    cluster_caster_shader(support, layout, is_masked).link()
}

fn cluster_caster_shader(support: &Support, layout: AttributeLayout, is_masked: bool) -> Shader {
    let root = if is_masked { module!("cluster_masked") } else { module!("cluster_opaque") };
    let mut shader = Shader::new(root);
    shader.add([module!("caster")]);
    if is_masked {
        shader.add([module!("mask"), module!("holes")]);
        add_cluster_uv(&mut shader, layout);
    }
    add_cluster_vertex(&mut shader, CLUSTER_GROUP, layout);
    add_caster_constants(&mut shader, 0, support);
    shader
}

/// The text for vertex stages that draw clusters, with its bindings in bind group `group`.
pub(crate) fn cluster_vertex(group: u32, layout: AttributeLayout) -> String {
    cluster_picture_shader(group, layout).link()
}

fn cluster_picture_shader(group: u32, layout: AttributeLayout) -> Shader {
    let mut shader = Shader::new(module!("cluster_picture"));
    add_cluster_vertex(&mut shader, group, layout);
    add_cluster_uv(&mut shader, layout);
    shader
}

fn cluster_vertex_shader(group: u32, layout: AttributeLayout) -> Shader {
    let mut shader = Shader::new(module!("cluster_vertex"));
    shader.add([module!("cluster_instance"), module!("cluster_types")]);
    shader.constant("SHADOW_CLUSTER_BINDINGS", group);
    shader.constant("SHADOW_CLUSTER_STRIDE", layout.stride);
    shader
}

/// Adds the module that gives vertices their texture coordinates and alpha.
fn add_cluster_uv(shader: &mut Shader, layout: AttributeLayout) {
    let uv = layout.uv.map(|uv| (uv, layout.alpha));
    if let Some((uv, alpha)) = uv {
        shader.constant("SHADOW_CLUSTER_UV", uv);
        if let Some(alpha) = alpha {
            shader.constant("SHADOW_CLUSTER_ALPHA", alpha);
        }
    }
    shader.add([match uv {
        None => module!("cluster_uv/none"),
        Some((_, None)) => module!("cluster_uv/plain"),
        Some((_, Some(_))) => module!("cluster_uv/alpha"),
    }]);
}

/// The text of the pass that chooses clusters, for maps whose pages are drawn or for other views.
pub(crate) fn cluster_descent(for_pages: bool) -> String {
    cluster_descent_shader(for_pages).link()
}

fn cluster_descent_shader(for_pages: bool) -> Shader {
    let mut shader = Shader::new(module!("cluster_descent"));
    shader.add([module!("cluster_instance"), module!("cluster_types"), module!("cluster_views")]);
    if for_pages {
        shader.add([module!("cluster_pages/drawn"), module!("page_types")]);
    } else {
        shader.add([module!("cluster_pages/none")]);
    }
    shader
}

/// The text of the pass that makes the first level of a pyramid of distances.
pub(crate) fn cluster_occluders() -> String {
    cluster_occluders_shader().link()
}

fn cluster_occluders_shader() -> Shader {
    let mut shader = Shader::new(module!("cluster_occluders"));
    shader.add([module!("depths/single")]);
    shader
}

/// The text of the pass that makes each of its further levels.
pub(crate) fn cluster_farther() -> String {
    cluster_farther_shader().link()
}

fn cluster_farther_shader() -> Shader {
    Shader::new(module!("cluster_farther"))
}

/// The text of the pass that gives draws of clusters their ranges of the index buffer.
pub(crate) fn cluster_draws() -> String {
    cluster_draws_shader().link()
}

fn cluster_draws_shader() -> Shader {
    let mut shader = Shader::new(module!("cluster_draws"));
    shader.add([module!("cluster_types")]);
    shader
}

/// The text of the pass that writes the index buffer of chosen clusters.
pub(crate) fn cluster_indices() -> String {
    cluster_indices_shader().link()
}

fn cluster_indices_shader() -> Shader {
    let mut shader = Shader::new(module!("cluster_indices"));
    shader.add([module!("cluster_corners"), module!("cluster_types")]);
    shader
}

fn add_cluster_vertex(shader: &mut Shader, group: u32, layout: AttributeLayout) {
    let Shader { modules, constants } = cluster_vertex_shader(group, layout);
    shader.add(modules);
    shader.constants += &constants;
}

/// The text of the pass that reduces the viewer's depths to tiles.
pub(crate) fn seen(is_multisampled: bool) -> String {
    seen_shader(is_multisampled).link()
}

fn seen_shader(is_multisampled: bool) -> Shader {
    let mut shader = Shader::new(module!("seen"));
    shader.add([depths(is_multisampled)]);
    shader
}

fn add_caster_constants(shader: &mut Shader, group: u32, support: &Support) {
    shader.constant("SHADOW_CASTER_GROUP", group);
    shader.constant("SHADOW_DEVICE_CLAMPS", support.depth_clip_control);
}

#[cfg(test)]
mod tests;
