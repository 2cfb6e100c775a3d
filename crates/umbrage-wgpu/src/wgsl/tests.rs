use super::*;
use crate::data;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::collections::BTreeSet;
use std::fs;
use std::mem::{offset_of, size_of};
use std::path::Path;
use umbrage::visibility::LightSize;
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Vsm};
use wesl::syntax::TranslationUnit;
use wesl::{CompileOptions, ManglerKind, ModulePath, Resolver, VirtualResolver, Wesl};

fn validated(text: &str) -> (naga::Module, ModuleInfo) {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::CLIP_DISTANCES);
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

/// A user's shader: a fragment shader that calls every public function of the lookup.
const USER: &str = "
    @fragment
    fn user(@location(0) position: vec3f, @location(1) normal: vec3f) -> @location(0) vec4f {
        let place = shadow_place(1u, position);
        let given = shadow_visibility(0u, position, normal);
        return vec4f(given, shadow_visibility(1u, position, shadow_normal(position)), place.texel);
    }";

fn variants() -> impl Iterator<Item = ShadowOptions> {
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
    let soft = [1, 8].map(|n| Filter::Pcss { n, light: LightSize::Metres(0.5) });
    let filters =
        [Filter::None, Filter::Hard].into_iter().chain((1..=15).map(|n| Filter::Pcf { n }));
    let filters = filters.chain(prefiltered).chain(spread).chain(soft);
    let with = |filter| {
        let comparisons = [Comparison::PerTexel, Comparison::Hardware];
        comparisons.into_iter().flat_map(move |comparison| {
            [Layout::Atlas, Layout::Layers].into_iter().flat_map(move |layout| {
                let buffers = [LookupBuffers::Uniform, LookupBuffers::Storage];
                buffers.map(|buffers| ShadowOptions {
                    filter,
                    comparison,
                    layout,
                    buffers,
                    // The two ways differ in one function alone.
                    fades: filter == Filter::Hard || filter == Filter::None,
                    pages: false,
                    pages_apart: false,
                })
            })
        })
    };
    let all: Vec<_> = filters.flat_map(with).collect();
    let has_pages = |o: &&ShadowOptions| {
        let is_storage = o.buffers == LookupBuffers::Storage && o.layout == Layout::Atlas;
        is_storage && o.filter.prefilter().is_none()
    };
    let paged: Vec<_> = all.iter().filter(has_pages).collect();
    let paged: Vec<_> = paged.into_iter().map(|&o| ShadowOptions { pages: true, ..o }).collect();
    all.into_iter().chain(paged)
}

#[test]
fn every_lookup_module_is_valid_in_front_of_a_users_shader() {
    for options in variants() {
        for group in [0, 3] {
            validated(&(lookup(group, &options) + USER));
        }
    }
}

/// naga adds a counter to every loop to bound it, which keeps compilers from unrolling. The loops
/// left are outside of filters, where the maps of faces, overlaps and lamps are found and those of
/// an overlap are looked up one after the other, with one exception: the number of samples of a
/// blur over a width depends on the surface.
#[test]
fn no_filter_has_a_loop() {
    const WITH_LOOPS: [&str; 5] =
        ["served/maps", "served/pages", "pages", "choice", "footprint/width"];
    let mut filters = Vec::new();
    for word in umbrage::language::FILTERS {
        filters.push(word.example.to_owned());
        filters.extend(word.options.iter().map(|o| format!("{}({})", word.example, o.example)));
    }
    assert!(filters.len() > 20, "{filters:?}");
    for filter in filters {
        let technique = format!("uniform:{filter}").parse::<umbrage::Technique>();
        let filter = technique.unwrap_or_else(|e| panic!("{filter}: {e}")).filter;
        let mut shaders = Vec::new();
        for comparison in [Comparison::PerTexel, Comparison::Hardware] {
            let options = ShadowOptions { filter, comparison, ..ShadowOptions::default() };
            shaders.push(lookup_shader(0, &options));
        }
        if let Some(prefilter) = filter.prefilter() {
            let all = textures(&prefilter.statistic);
            shaders.extend(PASSES.map(|pass| prefilter_shader(prefilter, pass, 0..all)));
        }
        let modules = shaders.iter().flat_map(Shader::modules);
        for (path, text) in modules.filter(|(path, _)| !WITH_LOOPS.contains(path)) {
            let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
            let mut words = code.flat_map(|line| line.split(|c: char| !c.is_alphanumeric()));
            let is_loop = |word: &str| ["for", "loop", "while"].contains(&word);
            assert!(!words.any(is_loop), "{filter}: {path}");
        }
    }
}

#[test]
fn every_other_module_is_valid() {
    for (depth_clip_control, clip_distances) in [(true, true), (false, true), (true, false)] {
        let support = Support { depth_clip_control, clip_distances, ..Support::FULL };
        for is_masked in [true, false] {
            validated(&mesh(&support, is_masked));
            for filter in page_filters() {
                validated(&page_mesh(&support, &filter, is_masked));
            }
        }
        validated(&caster(3, &support));
        for layout in attribute_layouts() {
            for is_masked in [true, false] {
                validated(&cluster_caster(&support, layout, is_masked));
                for filter in page_filters() {
                    for are_inside in [false, true] {
                        validated(&page_caster(&support, &filter, layout, is_masked, are_inside));
                    }
                }
            }
            validated(&cluster_vertex(3, layout));
        }
    }
    for filter in page_filters() {
        for is_multisampled in [false, true] {
            validated(&page_request(&filter, is_multisampled));
        }
        validated(&page_clear(&filter, &Support::FULL));
        validated(&page_copy(&filter, &Support::FULL));
        validated(&page_triangles(&filter));
    }
    for text in [
        page_allocate(),
        page_meshes(),
        cluster_descent(true),
        cluster_descent(false),
        cluster_draws(),
        cluster_indices(),
        cluster_occluders(),
        cluster_farther(),
    ] {
        validated(&text);
    }
    validated(include_str!("clear.wesl"));
    for is_multisampled in [false, true] {
        validated(&seen(is_multisampled));
    }
}

#[test]
fn nothing_pollutes_a_users_names() {
    for options in variants() {
        let (module, _) = validated(&lookup(1, &options));
        let functions = module.functions.iter().filter_map(|(_, f)| f.name.as_deref());
        let globals = module.global_variables.iter().filter_map(|(_, g)| g.name.as_deref());
        let constants = module.constants.iter().filter_map(|(_, c)| c.name.as_deref());
        let types = module.types.iter().filter_map(|(_, t)| t.name.as_deref());
        for name in functions.chain(globals).chain(constants).chain(types) {
            assert!(name.to_lowercase().starts_with("shadow"), "{name}");
        }
    }
}

/// The offsets and the size of a struct as naga lays it out.
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
    let (module, _) = validated(&(lookup(0, &ShadowOptions::default()) + USER));
    let m = &module;
    check_layout!(
        m,
        "ShadowSettings",
        data::Settings,
        [texture_scale, light_count, pages_across, pixel_gradient, eye, fade]
    );
    check_layout!(m, "ShadowLight", data::Light, [first_map, map_count, choice, axis, ends]);
    check_layout!(
        m,
        "ShadowMap",
        data::Map,
        [
            s,
            t,
            depth,
            w,
            along_s,
            along_t,
            along_depth,
            footprint_x,
            footprint_y,
            footprint_s,
            rounding,
            kind,
            layer,
            size,
            origin,
            fade_from,
            beam_scale,
            slab,
            first_plane,
            plane_count,
            index,
            margin
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
    let (module, _) = validated(&seen(false));
    check_layout!(
        &module,
        "ShadowSeenPicture",
        crate::seen::Picture,
        [size, background, limit, toward, padding]
    );
    check_layout!(
        &module,
        "ShadowSeenTile",
        crate::seen::Tile,
        [pixels, slope, depths, base, jump, is_seen, padding]
    );
}

#[test]
fn structs_of_clusters_are_laid_out_alike() {
    use crate::clusters::data as ours;
    let spans = |text: &str, structs: &[(&str, &[usize], usize)]| {
        let (module, _) = validated(text);
        for &(name, offsets, size) in structs {
            let (members, span) = layout(&module, name);
            let theirs: Vec<usize> = members.into_iter().map(|(_, offset)| offset).collect();
            assert_eq!(theirs, offsets, "{name}");
            assert_eq!(span, size, "{name}");
        }
    };
    macro_rules! offsets {
        ($type:ty, [$($field:ident),*]) => {
            (&[$(offset_of!($type, $field)),*][..], size_of::<$type>())
        };
    }
    let of = |name, (offsets, size): (&'static [usize], usize)| (name, offsets, size);
    spans(
        &cluster_descent(true),
        &[
            ("ShadowClusterNode", &[0, 12, 16, 20, 24, 28], size_of::<ours::Node>()),
            ("ShadowCluster", &[0, 12, 16, 28, 32, 36, 40, 44, 48, 52], size_of::<ours::Cluster>()),
            of(
                "ShadowClusterView",
                offsets!(
                    ours::View,
                    [
                        s,
                        t,
                        w,
                        densest,
                        nearest,
                        slope,
                        share,
                        first_plane,
                        plane_count,
                        first_draw,
                        roles,
                        is_picture,
                        page_map,
                        page_side,
                        page_table,
                        page_first,
                        page_reach,
                        page_still
                    ]
                ),
            ),
            of("ShadowClusterDescent", offsets!(ours::Descent, [origin, queue, choices])),
            of("ShadowClusterOccluders", offsets!(ours::Occluders, [distance, size, levels])),
            of("ShadowClusterItem", offsets!(ours::Item, [view, instance, node])),
            of(
                "ShadowClusterChoice",
                offsets!(ours::Choice, [instance, cluster, draw, first, block, page, rows]),
            ),
            of("ShadowClusterOrigin", offsets!(ours::Origin, [high, low])),
            (
                "ShadowClusterInstance",
                &[0, 16, 32, 48, 60, 64, 68, 72, 76],
                size_of::<ours::Instance>(),
            ),
        ],
    );
    spans(
        &cluster_draws(),
        &[
            of(
                "ShadowClusterDrawing",
                offsets!(ours::Drawing, [draws, spans, choices, triangles, in_pages]),
            ),
            of("ShadowClusterSpan", offsets!(ours::Span, [first, count])),
        ],
    );
    spans(
        &cluster_occluders(),
        &[of(
            "ShadowClusterPicture",
            offsets!(ours::Picture, [size, base, per_nearness, is_orthographic, step]),
        )],
    );
    spans(
        &cluster_indices(),
        &[of(
            "ShadowClusterIndexing",
            offsets!(ours::Indexing, [choices, triangles, blocks, draws]),
        )],
    );
}

#[test]
fn structs_of_pages_are_laid_out_alike() {
    use crate::pages::data as ours;
    let (module, _) = validated(&page_allocate());
    check_layout!(
        &module,
        "ShadowPageLevel",
        ours::Level,
        [first, side, table, level, levels, slabs, slab, coarser, coarser_by, to_coarser]
    );
    check_layout!(
        &module,
        "ShadowPlacedPage",
        ours::PlacedPage,
        [map, slab, index, slot, wanted, stale]
    );
    check_layout!(&module, "ShadowFreshPage", ours::FreshPage, [place, map, page, slot, is_still]);
    check_layout!(
        &module,
        "ShadowPageFrame",
        ours::Frame,
        [
            frame,
            places,
            room,
            boxes,
            still_boxes,
            error,
            least_bias,
            all_stale,
            groups,
            maps,
            stamp,
            births,
            first_coming,
            frames_left
        ]
    );
    let (module, _) = validated(&page_meshes());
    check_layout!(
        &module,
        "ShadowPageMeshing",
        ours::Meshing,
        [meshes, draws, maps, room, reach, is_still, stride]
    );
    check_layout!(&module, "ShadowPageMesh", ours::PageMesh, [render_from_mesh, low, draw, high]);
    check_layout!(
        &module,
        "ShadowPageMeshDraw",
        ours::MeshDraw,
        [first_index, index_count, base_vertex, first_map, end_map]
    );
    let (module, _) = validated(&page_request(&Filter::Hard, false));
    check_layout!(
        &module,
        "ShadowPageView",
        ours::View,
        [
            start,
            base,
            start_x,
            per_nearness,
            start_y,
            is_orthographic,
            way,
            background,
            way_x,
            frame,
            way_y,
            room,
            size
        ]
    );
    let (module, _) = validated(&page_clear(&Filter::Hard, &Support::FULL));
    check_layout!(&module, "ShadowPagePool", ours::Pool, [size, across]);
}

#[test]
fn uniform_arrays_fit_where_least_is_guaranteed() {
    let least = wgpu::Limits::downlevel_webgl2_defaults().max_uniform_buffer_binding_size;
    assert!((size_of::<data::Light>() * MAX_LIGHTS) as u64 <= least);
    assert!((size_of::<data::Map>() * MAX_MAPS) as u64 <= least);
    assert!((size_of::<[f32; 4]>() * MAX_PLANES) as u64 <= least);
}

#[test]
fn arrays_of_uniform_buffers_are_as_long_as_is_checked() {
    let options = ShadowOptions::default();
    let (module, _) = validated(&lookup(0, &options));
    let length = |name: &str| {
        let found = module.global_variables.iter().find(|(_, g)| g.name.as_deref() == Some(name));
        let naga::TypeInner::Array { size, .. } = module.types[found.unwrap().1.ty].inner else {
            panic!("{name} is no array")
        };
        let naga::ArraySize::Constant(length) = size else { panic!("{name} has no length") };
        length.get() as usize
    };
    let lengths = ["shadow_lights", "shadow_maps", "shadow_planes"].map(length);
    assert_eq!(lengths, [MAX_LIGHTS, MAX_MAPS, MAX_PLANES]);
}

/// The first of all shaders that have the same modules.
fn unlike(shaders: impl Iterator<Item = Shader>) -> Vec<Shader> {
    let mut known = BTreeSet::new();
    let is_new =
        |shader: &Shader| known.insert(shader.modules().map(|(path, _)| path).collect::<Vec<_>>());
    shaders.filter(is_new).collect()
}

/// A lookup of every kind, in bind group 2.
fn lookups() -> Vec<Shader> {
    unlike(variants().map(|options| lookup_shader(2, &options)))
}

/// Filters of pages with gutters and without.
fn page_filters() -> [Filter; 2] {
    [Filter::Hard, Filter::Pcf { n: 3 }]
}

/// A layout of each kind.
fn attribute_layouts() -> [AttributeLayout; 3] {
    let layout = |uv, alpha| AttributeLayout { stride: 5, uv, alpha };
    [layout(None, None), layout(Some(1), None), layout(Some(1), Some(4))]
}

/// A shader of every kind.
fn shaders() -> Vec<Shader> {
    let mut shaders = lookups();
    for statistic in statistics() {
        for half in [false, true] {
            let filter = Prefilter { statistic, blur: Blur::Texels(5), half };
            for pass in PASSES {
                shaders.push(prefilter_shader(&filter, pass, 0..textures(&statistic)));
            }
        }
    }
    for depth_clip_control in [true, false] {
        let support = Support { depth_clip_control, ..Support::FULL };
        shaders.push(caster_shader(0, &support));
        shaders.extend([true, false].map(|is_masked| mesh_shader(&support, is_masked)));
    }
    shaders.extend([false, true].map(seen_shader));
    for layout in attribute_layouts() {
        let caster = |is_masked| cluster_caster_shader(&Support::FULL, layout, is_masked);
        shaders.extend([true, false].map(caster));
        // WESL does not know how to clip.
        let support = Support { clip_distances: false, ..Support::FULL };
        let filter = Filter::Pcf { n: 3 };
        let in_pages = |(is_masked, are_inside)| {
            page_caster_shader(&support, &filter, layout, is_masked, are_inside)
        };
        shaders.extend([(true, true), (true, false), (false, true), (false, false)].map(in_pages));
        shaders.push(cluster_picture_shader(2, layout));
    }
    for is_multisampled in [false, true] {
        shaders.push(page_request_shader(&Filter::Hard, is_multisampled));
    }
    shaders.push(page_allocate_shader());
    shaders.push(page_clear_shader(&Filter::Hard, &Support::FULL));
    shaders.push(page_copy_shader(&Filter::Hard, &Support::FULL));
    shaders.push(page_meshes_shader());
    // WESL does not know how to clip.
    let support = Support { clip_distances: false, ..Support::FULL };
    shaders.extend([true, false].map(|m| page_mesh_shader(&support, &Filter::Hard, m)));
    shaders.push(page_triangles_shader(&Filter::Hard));
    shaders.extend([true, false].map(cluster_descent_shader));
    shaders.extend([cluster_draws_shader(), cluster_indices_shader()]);
    shaders.extend([cluster_occluders_shader(), cluster_farther_shader()]);
    unlike(shaders.into_iter())
}

/// The paths of all modules of the package.
fn package() -> Vec<String> {
    fn visit(folder: &Path, prefix: &str, paths: &mut Vec<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap().path();
            let name = entry.file_stem().unwrap().to_str().unwrap();
            if entry.is_dir() {
                visit(&entry, &format!("{prefix}{name}/"), paths);
            } else if entry.extension().is_some_and(|e| e == "wesl") {
                paths.push(format!("{prefix}{name}"));
            }
        }
    }
    let mut paths = Vec::new();
    visit(&folder(), "", &mut paths);
    paths
}

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/wgsl")
}

fn module_path(path: &str) -> ModulePath {
    format!("package::{}", path.replace('/', "::")).parse().unwrap()
}

/// All modules that WESL's compiler links to a root, whole and without renaming.
fn wesl_linked(resolver: impl Resolver, root: &str) -> TranslationUnit {
    let mut compiler = Wesl::new("").set_custom_resolver(resolver);
    let options = CompileOptions { strip: false, lazy: false, ..CompileOptions::default() };
    compiler.set_options(options).set_mangler(ManglerKind::None);
    compiler.compile(&module_path(root)).unwrap_or_else(|e| panic!("{root}: {e}")).syntax
}

#[test]
fn every_module_is_valid_by_itself() {
    let package = package();
    assert!(package.len() > 40, "{package:?}");
    for path in package {
        let linked = wesl_linked(wesl::FileResolver::new(folder()), &path);
        validated(&linked.to_string());
    }
}

#[test]
fn shaders_are_linked_as_by_wesl() {
    let package = package();
    let declarations = |unit: &TranslationUnit| {
        let mut all: Vec<_> = unit.global_declarations.iter().map(ToString::to_string).collect();
        all.sort();
        all
    };
    let mut used = BTreeSet::new();
    for shader in shaders() {
        let mut resolver = VirtualResolver::new();
        for (path, text) in shader.modules() {
            used.insert(path.to_owned());
            // The module stands for its alternatives too.
            let folder = path.split_once('/').map(|(folder, _)| format!("{folder}/"));
            let is_same = |other: &&String| match &folder {
                Some(folder) => other.starts_with(folder),
                None => *other == path,
            };
            for path in package.iter().filter(is_same) {
                resolver.add_module(module_path(path), text.into());
            }
        }
        let root = shader.modules().next().unwrap().0;
        let expected = wesl_linked(resolver, root);
        let linked: TranslationUnit = shader.link().parse().unwrap();
        assert_eq!(declarations(&linked), declarations(&expected), "{root}");
    }
    // The module `clear` is used by `passes.rs`, which includes its file directly.
    used.insert("clear".to_owned());
    assert_eq!(used, package.into_iter().collect());
}

/// Every module that Rust writes has an example in the package.
#[test]
fn examples_are_what_is_generated() {
    let file = |path| fs::read_to_string(folder().join(path).with_extension("wesl")).unwrap();
    let examples = [
        generated::samples(1),
        generated::sums(1),
        generated::csm(1),
        generated::pcf(2, Layout::Atlas),
        generated::hardware_pcf(2),
        generated::comparisons(&[[0.25, 0.0], [-0.25, 0.0]]),
        generated::search(&[[1.0, 0.0], [-0.7, 0.7]], &[[0.25, 0.0], [-0.25, 0.0]]),
        generated::taps(Axis::Rows, &[0.5, 0.25]),
        generated::encoded_outputs(0..1),
        generated::blurred_outputs(0..1),
    ];
    for module in examples {
        assert_eq!(file(module.path), module.text, "{}", module.path);
    }
    let names = |text: &str| -> BTreeSet<String> {
        let names = text.lines().filter_map(|line| line.strip_prefix("const ")?.split_once(' '));
        names.map(|(name, _)| name.to_owned()).collect()
    };
    let generated = shaders().iter().flat_map(|shader| names(&shader.constants)).collect();
    assert_eq!(names(&file("constants")), generated);
}

#[test]
fn users_may_import_the_lookup_in_wesl() {
    let user = format!(
        "import package::lights::shadows::{{shadow_normal, shadow_place, shadow_visibility}};
        {USER}"
    );
    for lookup in lookups() {
        let mut modules = VirtualResolver::new();
        modules.add_module(module_path("lights/shadows"), lookup.link().into());
        modules.add_module(module_path("user"), user.as_str().into());
        let compiler = Wesl::new("").set_custom_resolver(modules);
        let compiled = compiler.compile(&module_path("user")).unwrap_or_else(|e| panic!("{e}"));
        validated(&compiled.to_string());
    }
}
