//! Bevy's shaders for devices and features that cannot be tried here: composed as Bevy composes
//! them, with the changes and without, and validated.

mod common;

use bevy::pbr::MeshUniform;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::render_resource::GpuArrayBuffer;
use bevy::render::settings::WgpuLimits;
use bevy::shader::{ShaderCache, ShaderCacheSource, ShaderDefVal, ShaderImport};
use bevy_umbrage::prelude::*;
use common::loaded;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{Expression, ImageClass, Module, TypeInner};
use std::sync::Arc;

/// What Bevy tells its shaders about a device.
struct Device {
    name: &'static str,
    is_webgl: bool,
    /// Every shader has them: see `PipelineCache::new`.
    global: Vec<ShaderDefVal>,
    /// Those of all pipelines that light meshes.
    pipeline: Vec<ShaderDefVal>,
    /// Those of pipelines that draw meshes.
    mesh: Vec<ShaderDefVal>,
    capabilities: Capabilities,
}

fn flags(names: &[&'static str]) -> Vec<ShaderDefVal> {
    names.iter().map(|name| ShaderDefVal::from(*name)).collect()
}

fn number(name: &'static str, value: u32) -> ShaderDefVal {
    ShaderDefVal::UInt(name.into(), value)
}

fn storage_buffers(count: u32) -> [ShaderDefVal; 3] {
    [
        number("AVAILABLE_STORAGE_BUFFER_BINDINGS", count),
        ShaderDefVal::Bool("AVAILABLE_STORAGE_BUFFER_BINDINGS__GE_3".into(), count >= 3),
        ShaderDefVal::Bool("AVAILABLE_STORAGE_BUFFER_BINDINGS__GE_6".into(), count >= 6),
    ]
}

fn devices() -> [Device; 3] {
    let limits = WgpuLimits::downlevel_webgl2_defaults();
    let batch = GpuArrayBuffer::<MeshUniform>::batch_size(&limits);
    let batch = batch.expect("WebGL 2 has no storage buffers");
    let webgl = Device {
        name: "webgl2",
        is_webgl: true,
        global: [
            flags(&[
                "NO_ARRAY_TEXTURES_SUPPORT",
                "NO_CUBE_ARRAY_TEXTURES_SUPPORT",
                "SIXTEEN_BYTE_ALIGNMENT",
            ]),
            storage_buffers(limits.max_storage_buffers_per_shader_stage).to_vec(),
        ]
        .concat(),
        // Bevy built for WebGL 2 has other numbers in `mesh_view_types`; these replace them.
        pipeline: [
            flags(&["WEBGL2"]),
            vec![number("MAX_DIRECTIONAL_LIGHTS", 1), number("MAX_CASCADES_PER_LIGHT", 1)],
        ]
        .concat(),
        mesh: [
            flags(&["SKINS_USE_UNIFORM_BUFFERS", "METADATA_USE_UNIFORM_BUFFERS"]),
            vec![number("PER_OBJECT_BUFFER_BATCH_SIZE", batch)],
        ]
        .concat(),
        capabilities: Capabilities::empty(),
    };
    let webgpu = Device {
        name: "webgpu",
        is_webgl: false,
        global: storage_buffers(8).to_vec(),
        pipeline: Vec::new(),
        mesh: Vec::new(),
        capabilities: Capabilities::CUBE_ARRAY_TEXTURES,
    };
    let native = Device {
        name: "native",
        is_webgl: false,
        global: storage_buffers(8).to_vec(),
        pipeline: flags(&[
            "CLUSTERED_DECALS_ARE_USABLE",
            "IRRADIANCE_VOLUME",
            "IRRADIANCE_VOLUMES_ARE_USABLE",
            "MULTIPLE_LIGHTMAPS_IN_ARRAY",
            "MULTIPLE_LIGHT_PROBES_IN_ARRAY",
            "PCSS_SAMPLERS_AVAILABLE",
        ]),
        mesh: flags(&["BINDLESS"]),
        capabilities: Capabilities::all(),
    };
    [webgl, webgpu, native]
}

const FILTERS: [(&str, &str); 3] = [
    ("hardware", "SHADOW_FILTER_METHOD_HARDWARE_2X2"),
    ("gaussian", "SHADOW_FILTER_METHOD_GAUSSIAN"),
    ("temporal", "SHADOW_FILTER_METHOD_TEMPORAL"),
];

const FORWARD: &str = "bevy_pbr::render::pbr";
const DEFERRED: &str = "bevy_pbr::deferred::deferred_lighting";
const FOG: &str = "bevy_pbr::volumetric_fog::volumetric_fog";
const PREPASS: &str = "bevy_pbr::prepass::prepass";
const MATERIAL_PREPASS: &str = "bevy_pbr::render::pbr_prepass";

/// As `MeshPipeline::specialize` and the pipeline of `StandardMaterial` have them.
fn forward_defs(device: &Device, filter: &'static str, more: &[&'static str]) -> Vec<ShaderDefVal> {
    [
        flags(&[
            "MESH_PIPELINE",
            "VERTEX_OUTPUT_INSTANCE_INDEX",
            "VERTEX_POSITIONS",
            "VERTEX_NORMALS",
            "VERTEX_UVS",
            "VERTEX_UVS_A",
            "VERTEX_TANGENTS",
            "VIEW_PROJECTION_PERSPECTIVE",
            "TONEMAP_IN_SHADER",
            "TONEMAP_METHOD_REINHARD_LUMINANCE",
            "ENVIRONMENT_MAP",
            "DISTANCE_FOG",
            "STANDARD_MATERIAL_NORMAL_MAP",
            filter,
        ]),
        flags(more),
        tone_mapping(),
        vec![
            ShaderDefVal::Int("SCREEN_SPACE_SPECULAR_TRANSMISSION_BLUR_TAPS".into(), 8),
            number("MATERIAL_BIND_GROUP", 3),
        ],
        device.pipeline.clone(),
        device.mesh.clone(),
    ]
    .concat()
}

/// As `DeferredLightingLayout::specialize` has them.
fn deferred_defs(device: &Device, filter: &'static str) -> Vec<ShaderDefVal> {
    let depth: &[_] = if device.is_webgl { &[] } else { &["DEPTH_PREPASS"] };
    [
        flags(&[
            "DEFERRED_LIGHTING_PIPELINE",
            "DEFERRED_PREPASS",
            "TONEMAP_IN_SHADER",
            "TONEMAP_METHOD_REINHARD_LUMINANCE",
            "ENVIRONMENT_MAP",
            "DISTANCE_FOG",
            "STANDARD_MATERIAL_CLEARCOAT",
            filter,
        ]),
        flags(depth),
        tone_mapping(),
        device.pipeline.clone(),
    ]
    .concat()
}

fn tone_mapping() -> Vec<ShaderDefVal> {
    vec![
        number("TONEMAPPING_LUT_TEXTURE_BINDING_INDEX", 18),
        number("TONEMAPPING_LUT_SAMPLER_BINDING_INDEX", 19),
    ]
}

/// As `PrepassPipeline::specialize` has them for shadow maps.
fn depth_defs(device: &Device, more: &[&'static str]) -> Vec<ShaderDefVal> {
    [
        flags(&[
            "PREPASS_PIPELINE",
            "VERTEX_OUTPUT_INSTANCE_INDEX",
            "VIEW_PROJECTION_NONSTANDARD",
            "DEPTH_PREPASS",
            "VERTEX_POSITIONS",
            "VERTEX_UVS",
            "VERTEX_UVS_A",
        ]),
        flags(more),
        vec![number("MATERIAL_BIND_GROUP", 3)],
        device.pipeline.clone(),
        device.mesh.clone(),
    ]
    .concat()
}

/// An app with those shaders too that Bevy loads only where there is a device.
fn app_with_all_shaders() -> App {
    let mut app = loaded();
    let server = app.world().resource::<AssetServer>().clone();
    let handles: [Handle<Shader>; 3] = [PREPASS, DEFERRED, FOG]
        .map(|path| server.load(format!("embedded://{}.wesl", path.replace("::", "/"))));
    let is_loaded = |handle: &Handle<Shader>| server.is_loaded(handle.id());
    for _ in 0..2000 {
        app.update();
        if handles.iter().all(is_loaded) {
            // The plugin is told in this frame or in the next one.
            app.update();
            // A shader without a handle is unloaded.
            handles.into_iter().for_each(std::mem::forget);
            return app;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("Bevy has no shaders in these places");
}

/// The app's shaders as they are now, for one device.
struct Composer<'a> {
    device: &'a Device,
    cache: ShaderCache<String, ()>,
    ids: HashMap<ShaderImport, AssetId<Shader>>,
}

impl<'a> Composer<'a> {
    fn new(app: &App, device: &'a Device) -> Self {
        let mut cache: ShaderCache<String, ()> =
            ShaderCache::new((), |_, source, _| match source {
                ShaderCacheSource::Wgsl(text) => Ok(text),
                ShaderCacheSource::SpirV(_) => panic!("Bevy's shaders are texts"),
            });
        let mut ids = HashMap::new();
        for (id, shader) in app.world().resource::<Assets<Shader>>().iter() {
            let mut shader = shader.clone();
            shader.shader_defs.splice(0..0, device.global.iter().cloned());
            ids.insert(shader.import_path.clone(), id);
            cache.set_shader(id, shader);
        }
        Self { device, cache, ids }
    }

    /// Composes a shader and validates it for the device.
    fn compose(&mut self, what: &str, path: &str, defs: &[ShaderDefVal]) -> Composed {
        let id = self.ids[&ShaderImport::Custom(path.to_owned())];
        let text = self.cache.get(0, id, defs);
        let text = text.unwrap_or_else(|error| panic!("{} {what}: {error}", self.device.name));
        Composed::new(format!("{} {what}", self.device.name), text, self.device)
    }
}

struct Composed {
    what: String,
    text: Arc<String>,
    module: Module,
    info: ModuleInfo,
}

impl Composed {
    fn new(what: String, text: Arc<String>, device: &Device) -> Self {
        // For a look at it, and for other translators than naga.
        let file = format!("{}/{}.wgsl", env!("CARGO_TARGET_TMPDIR"), what.replace(' ', "-"));
        std::fs::write(&file, text.as_str()).expect("cargo makes this folder");
        let module = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string_with_path(&text, &file)));
        let info = Validator::new(ValidationFlags::all(), device.capabilities)
            .validate(&module)
            .unwrap_or_else(|error| panic!("{}", error.emit_to_string_with_path(&text, &file)));
        println!("valid: {what}");
        Self { what, text, module, info }
    }

    /// The names of this crate's functions.
    fn umbrage_functions(&self) -> Vec<&str> {
        let functions = self.module.functions.iter();
        let names = functions.filter_map(|(_, function)| function.name.as_deref());
        names.filter(|name| name.contains("bevy_umbrage")).collect()
    }

    /// Whether it has this function of this crate. Bevy's composer writes the number of underscores
    /// before each word that has some.
    fn has(&self, module: &str, function: &str) -> bool {
        let name = ["bevy_umbrage", module, function].map(|word| match word.matches('_').count() {
            0 => word.to_owned(),
            count => format!("_{count}{word}"),
        });
        self.umbrage_functions().contains(&name.join("_").as_str())
    }

    /// The declarations. They come in any order.
    fn declarations(&self) -> Vec<&str> {
        let mut declarations: Vec<_> = self.text.split("\n\n").map(str::trim).collect();
        declarations.sort_unstable();
        declarations
    }

    /// How many expressions compare texels of depth textures, and how many read them otherwise.
    fn depth_reads(&self) -> [usize; 2] {
        let Module { types, functions, entry_points, .. } = &self.module;
        let functions = functions.iter().map(|(handle, function)| (function, &self.info[handle]));
        let entries = entry_points.iter().enumerate();
        let entries = entries.map(|(i, entry)| (&entry.function, self.info.get_entry_point(i)));
        let [mut compared, mut others] = [0, 0];
        for (function, info) in functions.chain(entries) {
            for (_, expression) in function.expressions.iter() {
                let (image, is_compared) = match *expression {
                    Expression::ImageLoad { image, .. } => (image, false),
                    Expression::ImageSample { image, depth_ref, .. } => {
                        (image, depth_ref.is_some())
                    }
                    _ => continue,
                };
                let image = info[image].ty.inner_with(types);
                if let TypeInner::Image { class: ImageClass::Depth { .. }, .. } = image {
                    *if is_compared { &mut compared } else { &mut others } += 1;
                }
            }
        }
        [compared, others]
    }

    /// In WebGL 2 a texture that is compared can be read in no other way.
    fn assert_depths_are_only_compared(&self) {
        let [compared, others] = self.depth_reads();
        assert!(compared > 0 && others == 0, "{}: {compared}, {others}", self.what);
    }
}

fn enable(app: &mut App, enabled: bool) {
    app.world_mut().resource_mut::<UmbrageEnabled>().0 = enabled;
    app.update();
}

#[test]
fn lookups_are_valid_for_each_device_and_filter() {
    let mut app = app_with_all_shaders();
    let transmission = [
        "STANDARD_MATERIAL_DIFFUSE_TRANSMISSION",
        "STANDARD_MATERIAL_DIFFUSE_OR_SPECULAR_TRANSMISSION",
    ];
    let masked = ["MAY_DISCARD", "VISIBILITY_RANGE_DITHER", "MULTISAMPLED"];
    for device in devices() {
        for changed in [false, true] {
            enable(&mut app, changed);
            let mut composer = Composer::new(&app, &device);
            for (name, filter) in FILTERS {
                let lit = if changed { "umbrage" } else { "bevy" };
                let forward = |more| forward_defs(&device, filter, more);
                for (kind, path, defs, notes) in [
                    ("forward", FORWARD, forward(&[]), "note_triangle"),
                    ("transmission", FORWARD, forward(&transmission), "note_triangle"),
                    ("masked", FORWARD, forward(&masked), "note_triangle"),
                    ("deferred", DEFERRED, deferred_defs(&device, filter), "note_pixels"),
                ] {
                    let what = format!("{kind} {name} {lit}");
                    let composed = composer.compose(&what, path, &defs);
                    if device.is_webgl {
                        composed.assert_depths_are_only_compared();
                    }
                    if !changed {
                        assert!(composed.umbrage_functions().is_empty(), "{what}");
                        continue;
                    }
                    if name == "hardware" && !device.is_webgl {
                        assert!(composed.depth_reads()[1] > 0, "{what} loads no texels");
                    }
                    let [flat, cube] = match name {
                        "hardware" => ["bilinear", "nearest_four"],
                        "gaussian" => ["gaussian", "gaussian"],
                        _ => ["spiral", "spiral"],
                    };
                    for (module, function) in [
                        ("surface", notes),
                        ("surface", "normal_or"),
                        ("receiver", "receiver_in_map"),
                        ("lights", "sample_directional_cascade"),
                        ("lights", "fetch_spot_shadow"),
                        ("lights", "fetch_point_shadow"),
                        ("flat_map", flat),
                        ("cube_map", cube),
                    ] {
                        let functions = composed.umbrage_functions();
                        assert!(
                            composed.has(module, function),
                            "{what} {module}::{function}: {functions:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn debug_views_are_valid_for_each_device() {
    let mut app = app_with_all_shaders();
    for (debug, function) in [
        (UmbrageDebug::Cascades, "cascades"),
        (UmbrageDebug::TexelDensity, "texel_density"),
        (UmbrageDebug::TexelGrid, "texel_grid"),
    ] {
        app.insert_resource(debug);
        app.update();
        for device in devices() {
            let filter = FILTERS[1].1;
            let mut composer = Composer::new(&app, &device);
            for (kind, path, defs) in [
                ("forward", FORWARD, forward_defs(&device, filter, &[])),
                ("deferred", DEFERRED, deferred_defs(&device, filter)),
            ] {
                let composed = composer.compose(&format!("{kind} {function}"), path, &defs);
                assert!(composed.has("debug", function), "{kind} {function}");
                if device.is_webgl {
                    composed.assert_depths_are_only_compared();
                }
            }
        }
    }
}

#[test]
fn depth_passes_change_only_where_they_clamp_depths() {
    let mut app = app_with_all_shaders();
    let emulation = ["UNCLIPPED_DEPTH_ORTHO_EMULATION", "PREPASS_FRAGMENT"];
    let masked = ["MAY_DISCARD"];
    let masked_emulation = [&emulation[..], &masked].concat();
    for device in devices() {
        let cases = [
            ("depth", PREPASS, depth_defs(&device, &[]), false),
            ("depth clamped", PREPASS, depth_defs(&device, &emulation), true),
            ("depth material", MATERIAL_PREPASS, depth_defs(&device, &masked), false),
            (
                "depth material clamped",
                MATERIAL_PREPASS,
                depth_defs(&device, &masked_emulation),
                true,
            ),
        ];
        let [bevy, umbrage] = [false, true].map(|changed| {
            enable(&mut app, changed);
            let mut composer = Composer::new(&app, &device);
            let name = if changed { "umbrage" } else { "bevy" };
            cases.each_ref().map(|(what, path, defs, _)| {
                composer.compose(&format!("{what} {name}"), path, defs)
            })
        });
        for (i, (what, path, _, is_clamped)) in cases.iter().enumerate() {
            let [bevy, umbrage] = [&bevy[i], &umbrage[i]];
            let is_changed = bevy.declarations() != umbrage.declarations();
            assert_eq!(is_changed, *is_clamped, "{} {what}", device.name);
            if *is_clamped {
                let count = |text: &str| umbrage.text.matches(text).count();
                assert_eq!(count("in.unclipped_depth * in.position.w"), 1, "{}", umbrage.what);
                let clamps = count("min(out.position.z, out.position.w)");
                assert_eq!(clamps, usize::from(*path == PREPASS), "{}", umbrage.what);
            }
        }
    }
}

#[test]
fn fog_is_as_bevy_has_it() {
    let mut app = app_with_all_shaders();
    for device in devices() {
        let defs = |more: &[&'static str]| {
            let numbers = device.pipeline.iter().filter(|d| matches!(d, ShaderDefVal::UInt(..)));
            let filter = FILTERS[0].1;
            [flags(&[filter]), flags(more), numbers.cloned().collect()].concat()
        };
        let [bevy, umbrage] = [false, true].map(|changed| {
            enable(&mut app, changed);
            let mut composer = Composer::new(&app, &device);
            let name = if changed { "umbrage" } else { "bevy" };
            [("fog", defs(&[])), ("fog density", defs(&["DENSITY_TEXTURE"]))]
                .map(|(what, defs)| composer.compose(&format!("{what} {name}"), FOG, &defs))
        });
        // It marches with lookups of its own, which have no receivers.
        for (bevy, umbrage) in bevy.iter().zip(&umbrage) {
            assert_eq!(bevy.declarations(), umbrage.declarations(), "{}", umbrage.what);
        }
    }
}
