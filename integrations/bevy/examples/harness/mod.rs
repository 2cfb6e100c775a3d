//! A Bevy app without a window that draws one view of a scene under one sun, and reads back its
//! pictures.
//!
//! Everything is white, rough and double-sided, and nothing but the sun lights it. Without tone
//! mapping a picture with shadows, divided by one without, is the visibility of the sun.

// Programs and tests include this module, and each uses a part of it.
#![allow(dead_code)]

pub(crate) mod glb;
pub(crate) mod options;
mod setup;

pub(crate) use setup::*;

use bevy::app::{PluginsState, TerminalCtrlCHandlerPlugin};
use bevy::asset::RenderAssetUsages;
use bevy::camera::primitives::CascadesFrusta;
use bevy::camera::{Exposure, Hdr, RenderTarget};
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::image::Image;
use bevy::light::cascade::Cascades;
use bevy::light::{
    CascadeShadowConfig, DirectionalLightShadowMap, GlobalAmbientLight, NotShadowCaster,
    ShadowFilteringMethod, SimulationLightSystems,
};
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::pbr::DefaultOpaqueRendererMethod;
use bevy::prelude::*;
use bevy::render::error_handler::{RenderErrorHandler, RenderErrorPolicy};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{
    BufferDescriptor, BufferUsages, CachedPipelineState, CommandEncoderDescriptor, Extent3d,
    MapMode, PipelineCache, PollType, TexelCopyBufferInfo, TexelCopyBufferLayout, TextureFormat,
    TextureUsages,
};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice, RenderQueue};
use bevy::render::texture::GpuImage;
use bevy::render::{RenderApp, RenderPlugin};
use bevy::window::{ExitCondition, WindowPlugin};
use bevy::winit::WinitPlugin;
use bevy_umbrage::prelude::*;
use half::f16;
use std::sync::{Once, mpsc};
use std::time::Instant;

/// The brightness of a white surface that faces the sun.
const FULLY_LIT: f32 = 0.5;

/// A pixel counts if it is at least as bright without shadows as a white Lambertian surface would
/// be at this cosine between its normal and the direction to the sun. Bevy's diffuse term (Burley)
/// differs a little from Lambert's.
pub(crate) const LEAST_COSINE: f32 = 0.05;

/// The app.
pub(crate) struct Harness {
    app: App,
    size: [u32; 2],
    filter: ShadowFilteringMethod,
    uses_umbrage: bool,
    white: Handle<StandardMaterial>,
    target: Handle<Image>,
    camera: Entity,
    light: Entity,
}

/// How many frames are drawn at most until all pipelines are there.
const MOST_FRAMES_TO_SETTLE: u32 = 2000;

impl Harness {
    /// An app with a camera and a sun, but no meshes.
    ///
    /// # Errors
    /// If something in `setup` is out of its range, or is more than the device can hold.
    pub(crate) fn new(setup: &Setup) -> Result<Self, String> {
        Self::with_plugins(setup, |_| {})
    }

    /// The same app with more plugins, which `add` adds.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub(crate) fn with_plugins(setup: &Setup, add: impl FnOnce(&mut App)) -> Result<Self, String> {
        setup.check()?;
        let mut app = new_app(!matches!(setup.umbrage, Umbrage::Off), add)?;
        let [width, height] = setup.size;
        let limits = device(&app)?.limits();
        let longest = width.max(height).max(setup.map_size);
        if longest > limits.max_texture_dimension_2d {
            let most = limits.max_texture_dimension_2d;
            return Err(format!("the device has textures of up to {most} texels, not {longest}"));
        }
        app.insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(DirectionalLightShadowMap { size: setup.map_size as usize });
        if setup.deferred {
            app.insert_resource(DefaultOpaqueRendererMethod::deferred());
        }

        let world = app.world_mut();
        let white = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
            base_color: Color::WHITE,
            perceptual_roughness: 1.0,
            metallic: 0.0,
            reflectance: 0.0,
            double_sided: true,
            cull_mode: None,
            ..default()
        });
        let mut target = Image::new_target_texture(width, height, TextureFormat::Rgba16Float, None);
        target.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = world.resource_mut::<Assets<Image>>().add(target);

        let ViewPoint { eye, target: middle, fov_y_rad, near, far } = setup.view;
        let exposure = Exposure { ev100: 0.0 };
        let illuminance = FULLY_LIT * std::f32::consts::PI / exposure.exposure();
        let camera = world
            .spawn((
                Camera3d::default(),
                RenderTarget::from(target.clone()),
                Projection::Perspective(PerspectiveProjection {
                    fov: fov_y_rad,
                    aspect_ratio: width as f32 / height as f32,
                    near,
                    far,
                    near_clip_plane: Vec4::new(0.0, 0.0, -1.0, -near),
                }),
                looking(eye, middle),
                Hdr,
                setup.msaa,
                Tonemapping::None,
                DebandDither::Disabled,
                exposure,
                setup.filter,
            ))
            .id();
        if setup.deferred {
            world.entity_mut(camera).insert((DepthPrepass, DeferredPrepass));
        }
        let light = world
            .spawn((
                DirectionalLight {
                    illuminance,
                    shadow_maps_enabled: true,
                    shadow_depth_bias: setup.depth_bias,
                    shadow_normal_bias: setup.normal_bias,
                    ..default()
                },
                looking(Vec3::ZERO, setup.sun.normalize_or_zero()),
                setup.cascades.clone(),
            ))
            .id();
        if let Umbrage::Planned(shadows) = &setup.umbrage {
            world.entity_mut(light).insert((**shadows).clone());
        }
        Ok(Self {
            app,
            size: setup.size,
            filter: setup.filter,
            uses_umbrage: !matches!(setup.umbrage, Umbrage::Off),
            white,
            target,
            camera,
            light,
        })
    }

    /// The app, to which anything may be added.
    pub(crate) fn app(&mut self) -> &mut App {
        &mut self.app
    }

    /// The material of everything.
    pub(crate) fn white(&self) -> Handle<StandardMaterial> {
        self.white.clone()
    }

    pub(crate) fn camera(&self) -> Entity {
        self.camera
    }

    pub(crate) fn light(&self) -> Entity {
        self.light
    }

    pub(crate) fn set_camera(&mut self, pose: Transform) {
        self.app.world_mut().entity_mut(self.camera).insert(pose);
    }

    /// Turns shadows on or off. Without shadows the cheapest filter is chosen too: a software
    /// rasteriser runs both sides of a branch, so the filter would still cost its time, and would
    /// hide its own price.
    pub(crate) fn set_shadows(&mut self, on: bool) {
        let filter = if on { self.filter } else { ShadowFilteringMethod::Hardware2x2 };
        let world = self.app.world_mut();
        world.entity_mut(self.camera).insert(filter);
        if let Some(mut light) = world.get_mut::<DirectionalLight>(self.light) {
            light.shadow_maps_enabled = on;
        }
    }

    /// Keeps the shadow maps of the last frame, whatever the camera does, until told otherwise. What
    /// changes in a picture with the maps of the frame before is flicker.
    pub(crate) fn hold_maps(&mut self, are_held: bool) {
        self.app.world_mut().resource_mut::<Held>().are_held = are_held;
    }

    /// Draws a frame, and waits until the device has finished it. Returns the time, ms.
    pub(crate) fn frame(&mut self) -> f64 {
        let start = Instant::now();
        self.app.update();
        let waited = device(&self.app).and_then(|device| {
            device.poll(PollType::wait_indefinitely()).map_err(|e| format!("waiting for it: {e}"))
        });
        if let Err(error) = waited {
            self.app.insert_resource(Failure(format!("the device failed: {error}")));
        }
        start.elapsed().as_secs_f64() * 1e3
    }

    /// Draws frames until Bevy has loaded all shaders and made all pipelines, and some more.
    ///
    /// # Errors
    /// If a pipeline cannot be made, if the device fails, or if Umbrage's lookup was refused.
    pub(crate) fn settle(&mut self) -> Result<(), String> {
        let mut ready_frames = 0;
        for _ in 0..MOST_FRAMES_TO_SETTLE {
            self.frame();
            self.check()?;
            ready_frames = if self.is_waiting()? { 0 } else { ready_frames + 1 };
            // Meshes and materials take up to two frames to ask for their pipelines.
            if ready_frames == 4 {
                return Ok(());
            }
        }
        Err(format!("Bevy's pipelines are not ready after {MOST_FRAMES_TO_SETTLE} frames"))
    }

    /// Returns whether shaders or pipelines are still missing.
    fn is_waiting(&self) -> Result<bool, String> {
        let cache = render_world(&self.app)?.resource::<PipelineCache>();
        if cache.waiting_pipelines().next().is_some() {
            return Ok(true);
        }
        for pipeline in cache.pipelines() {
            if let CachedPipelineState::Err(error) = &pipeline.state {
                return Err(format!("a pipeline cannot be made: {error}"));
            }
        }
        match self.status().map(|status| &status.lookup) {
            Some(Lookup::Waiting) => Ok(true),
            Some(Lookup::Refused { why }) => Err(format!("the lookup was refused: {why}")),
            Some(Lookup::Umbrage | Lookup::Bevy) | None => Ok(false),
        }
    }

    /// # Errors
    /// If anything has failed on the device so far, or if the last frame's plans have failed.
    pub(crate) fn check(&self) -> Result<(), String> {
        if let Some(Failure(why)) = self.app.world().get_resource::<Failure>() {
            return Err(why.clone());
        }
        match self.status().and_then(|status| status.problem.as_ref()) {
            Some(why) => Err(why.clone()),
            None => Ok(()),
        }
    }

    /// What the plugin does; `None` without the plugin.
    pub(crate) fn status(&self) -> Option<&UmbrageStatus> {
        self.app.world().get_resource::<UmbrageStatus>().filter(|_| self.uses_umbrage)
    }

    /// The time that the last frame's plans took, ms; `None` if nothing is planned.
    pub(crate) fn planning_ms(&self) -> Option<f64> {
        self.app.world().get::<UmbrageShadows>(self.light)?;
        self.status().map(|status| status.planning.as_secs_f64() * 1e3)
    }

    /// The distances at which cascades end, as last drawn.
    pub(crate) fn cascade_ends(&self) -> Vec<f32> {
        let config = self.app.world().get::<CascadeShadowConfig>(self.light);
        config.map(|c| c.bounds.clone()).unwrap_or_default()
    }

    /// The name of the device.
    pub(crate) fn adapter(&self) -> String {
        let adapter = render_world(&self.app).map(|w| w.resource::<RenderAdapterInfo>());
        adapter.map(|a| a.name.clone()).unwrap_or_default()
    }

    /// The picture of the last frame: linear red, green, blue and alpha, row by row from the upper
    /// left corner.
    ///
    /// # Errors
    /// If the device fails, or if no frame was drawn.
    pub(crate) fn read(&self) -> Result<Vec<[f32; 4]>, String> {
        self.check()?;
        let world = render_world(&self.app)?;
        let (device, queue) = (world.resource::<RenderDevice>(), world.resource::<RenderQueue>());
        let image = world.resource::<RenderAssets<GpuImage>>().get(&self.target);
        let image = image.ok_or("there is no picture before a frame is drawn")?;
        let [width, height] = self.size;
        const PIXEL: usize = 8;
        let row = RenderDevice::align_copy_bytes_per_row(width as usize * PIXEL);
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some("readback"),
            size: row as u64 * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            image.texture.as_image_copy(),
            TexelCopyBufferInfo {
                buffer: &buffer,
                layout: TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row as u32),
                    rows_per_image: None,
                },
            },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        queue.submit([encoder.finish()]);
        let slice = buffer.slice(..);
        let (sender, receiver) = mpsc::channel();
        slice.map_async(MapMode::Read, move |result| {
            // Nobody listens if the wait below has failed.
            let _ = sender.send(result);
        });
        let wrong = |e: &dyn std::fmt::Display| format!("reading the picture: {e}");
        device.poll(PollType::wait_indefinitely()).map_err(|e| wrong(&e))?;
        receiver.recv().map_err(|e| wrong(&e))?.map_err(|e| wrong(&e))?;
        let data = slice.get_mapped_range().map_err(|e| wrong(&e))?;
        let channel = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
        let rows = data.chunks_exact(row).map(|row| &row[..width as usize * PIXEL]);
        let pixels = rows.flat_map(|row| row.chunks_exact(PIXEL));
        Ok(pixels.map(|p| [0, 2, 4, 6].map(|i| channel(&p[i..]))).collect())
    }

    /// The red channel of [`read`](Self::read): the brightness, because everything is grey.
    ///
    /// # Errors
    /// As for [`read`](Self::read).
    pub(crate) fn brightness(&self) -> Result<Vec<f32>, String> {
        Ok(self.read()?.iter().map(|p| p[0]).collect())
    }

    /// Draws and times frames with and without shadows, and reads the last picture of either.
    /// Blocks of frames with and without alternate, so that a slow spell of the machine hits both.
    /// Before each block `warmup` frames are not timed.
    ///
    /// # Errors
    /// As for [`settle`](Self::settle).
    pub(crate) fn measure(&mut self, frames: usize, warmup: usize) -> Result<Measured, String> {
        let blocks = match frames {
            16.. => 4,
            4.. => 2,
            _ => 1,
        };
        let mut measured = Measured::default();
        for block in 0..blocks {
            let count = frames * (block + 1) / blocks - frames * block / blocks;
            for on in [true, false] {
                self.set_shadows(on);
                if block == 0 {
                    self.settle()?;
                }
                for _ in 0..warmup {
                    self.frame();
                }
                for _ in 0..count {
                    let ms = self.frame();
                    let times = if on { &mut measured.on_ms } else { &mut measured.off_ms };
                    times.push(ms);
                    measured.planning_ms.extend(self.planning_ms().filter(|_| on));
                }
                if block == blocks - 1 {
                    let picture = self.brightness()?;
                    *if on { &mut measured.shadowed } else { &mut measured.unshadowed } = picture;
                }
            }
        }
        self.set_shadows(true);
        Ok(measured)
    }

    /// Adds a mesh in white. Its place is that of the entity `parent`, if there is one.
    pub(crate) fn add_mesh(
        &mut self,
        mesh: Mesh,
        place: Transform,
        parent: Option<Entity>,
    ) -> Entity {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.add_instance(mesh, place, parent)
    }

    /// Adds one more instance of a mesh, as [`add_mesh`](Self::add_mesh) does.
    pub(crate) fn add_instance(
        &mut self,
        mesh: Handle<Mesh>,
        place: Transform,
        parent: Option<Entity>,
    ) -> Entity {
        let white = MeshMaterial3d(self.white());
        let mut entity = self.app.world_mut().spawn((Mesh3d(mesh), white, place));
        if let Some(parent) = parent {
            entity.insert(ChildOf(parent));
        }
        entity.id()
    }

    /// Adds the triangles of a scene that `umbrage-scene` has loaded or built. Alpha masks and
    /// colours are left out.
    ///
    /// # Errors
    /// If the scene has no triangles, or an instance that Bevy's transforms cannot place.
    pub(crate) fn add_scene(&mut self, scene: &umbrage_scene::Scene) -> Result<(), String> {
        if scene.drawn_triangles() == 0 {
            return Err("the scene has no triangles".into());
        }
        let mut meshes: Vec<Option<Handle<Mesh>>> = vec![None; scene.meshes.len()];
        for (i, instance) in scene.instances.iter().enumerate() {
            let role = scene.roles.of(i);
            if !role.is_seen {
                return Err(format!("instance {i} casts unseen, which Bevy does not do"));
            }
            let place = place(instance.world_from_mesh.to_cols_array())
                .ok_or_else(|| format!("instance {i} is sheared"))?;
            let mesh = match &meshes[instance.mesh] {
                Some(mesh) => mesh.clone(),
                None => {
                    let mut assets = self.app.world_mut().resource_mut::<Assets<Mesh>>();
                    let mesh = assets.add(mesh_of(&scene.meshes[instance.mesh]));
                    meshes[instance.mesh].insert(mesh).clone()
                }
            };
            let entity = self.add_instance(mesh, place, None);
            if !role.casts {
                self.app.world_mut().entity_mut(entity).insert(NotShadowCaster);
            }
        }
        Ok(())
    }
}

/// What [`Harness::measure`] found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Measured {
    /// Times of whole frames with shadows.
    pub(crate) on_ms: Vec<f64>,
    /// Times of whole frames without.
    pub(crate) off_ms: Vec<f64>,
    /// Times of plans; empty if nothing was planned.
    pub(crate) planning_ms: Vec<f64>,
    /// Brightness with shadows.
    pub(crate) shadowed: Vec<f32>,
    /// Brightness without.
    pub(crate) unshadowed: Vec<f32>,
}

/// The median; `None` of nothing.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some((sorted[last / 2] + sorted[last.div_ceil(2)]) / 2.0)
}

/// Whether the sun lights a pixel well enough to tell its visibility, given the brightness without
/// shadows.
pub(crate) fn counts(unshadowed: f32) -> bool {
    unshadowed > LEAST_COSINE * FULLY_LIT
}

/// The visibility of the sun at each pixel, from 0 to 1; 0 where it cannot be told.
pub(crate) fn visibility(shadowed: &[f32], unshadowed: &[f32]) -> Vec<f32> {
    let pixels = shadowed.iter().zip(unshadowed);
    pixels.map(|(s, &u)| if counts(u) { (s / u).clamp(0.0, 1.0) } else { 0.0 }).collect()
}

/// The pose of a camera or a sun.
pub(crate) fn looking(eye: Vec3, target: Vec3) -> Transform {
    let direction = (target - eye).normalize_or_zero();
    let up = if direction.y.abs() > 0.9999 { Vec3::Z } else { Vec3::Y };
    Transform::from_translation(eye).looking_to(direction, up)
}

/// The transform with these columns of 3; `None` if it has a shear, or is not finite.
fn place(columns: [f64; 12]) -> Option<Transform> {
    let column = |i: usize| Vec3::from_array([0, 1, 2].map(|j| columns[3 * i + j] as f32));
    let affine = bevy::math::Affine3A::from_cols(
        column(0).into(),
        column(1).into(),
        column(2).into(),
        column(3).into(),
    );
    let (scale, rotation, translation) = affine.to_scale_rotation_translation();
    let place = Transform { translation, rotation, scale };
    let error = (0..3).map(|i| {
        let axis = place.to_matrix().col(i).truncate();
        (axis - column(i)).length() / column(i).length()
    });
    (affine.is_finite() && error.fold(0.0, f32::max) < 1e-5).then_some(place)
}

/// The triangles of a mesh of `umbrage-scene`.
pub(crate) fn mesh_of(mesh: &umbrage_scene::Mesh) -> Mesh {
    let vectors = |v: &[bevy_umbrage::umbrage::glam::Vec3]| -> Vec<[f32; 3]> {
        v.iter().map(bevy_umbrage::umbrage::glam::Vec3::to_array).collect()
    };
    triangles(
        vectors(&mesh.positions),
        Some(vectors(&mesh.normals)),
        mesh.triangles.iter().flatten().copied().collect(),
    )
}

/// A mesh of triangles. Normals that are missing are computed.
pub(crate) fn triangles(
    positions: Vec<[f32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    indices: Vec<u32>,
) -> Mesh {
    let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_indices(Indices::U32(indices));
    match normals {
        Some(normals) => mesh.with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals),
        None => mesh.with_computed_normals(),
    }
}

/// Bevy without a window, in which a frame is finished when `update` returns.
fn new_app(uses_umbrage: bool, add: impl FnOnce(&mut App)) -> Result<App, String> {
    let mut plugins = DefaultPlugins
        .build()
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
        .set(LogPlugin {
            level: bevy::log::Level::WARN,
            // Which device draws is reported by name. That it is a slow one is no news.
            filter: format!("{},bevy_render::renderer=error", bevy::log::DEFAULT_FILTER),
            ..default()
        })
        .disable::<WinitPlugin>()
        .disable::<PipelinedRenderingPlugin>()
        // It would only tell Bevy's own loop that the program is to end.
        .disable::<TerminalCtrlCHandlerPlugin>();
    // A process has one log, but may have many apps.
    static LOG: Once = Once::new();
    let mut is_first = false;
    LOG.call_once(|| is_first = true);
    if !is_first {
        plugins = plugins.disable::<LogPlugin>();
    }
    let mut app = App::new();
    app.add_plugins(plugins);
    if uses_umbrage {
        app.add_plugins(UmbragePlugin);
    }
    add(&mut app);
    app.insert_resource(RenderErrorHandler(|error, world, _| {
        world.insert_resource(Failure(format!("the device failed: {}", error.description)));
        RenderErrorPolicy::StopRendering
    }))
    .init_resource::<Held>()
    .add_systems(First, release_config)
    .add_systems(
        PostUpdate,
        hold_maps
            .after(SimulationLightSystems::UpdateLightFrusta)
            .before(SimulationLightSystems::CheckLightVisibility),
    );
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    Ok(app)
}

fn render_world(app: &App) -> Result<&World, String> {
    app.get_sub_app(RenderApp).map(SubApp::world).ok_or("Bevy has no renderer".into())
}

fn device(app: &App) -> Result<&RenderDevice, String> {
    render_world(app)?.get_resource().ok_or("there is no device".into())
}

/// What went wrong on the device.
#[derive(Resource)]
struct Failure(String);

/// The maps of the last frame that had its own.
#[derive(Resource, Default)]
struct Held {
    are_held: bool,
    maps: Option<(Cascades, CascadesFrusta, CascadeShadowConfig)>,
    /// The configuration to which the light returns after a frame with held maps. Others take what
    /// is there for the user's own.
    replaced: Option<CascadeShadowConfig>,
}

type HeldMaps =
    (&'static mut Cascades, &'static mut CascadesFrusta, &'static mut CascadeShadowConfig);

fn hold_maps(mut held: ResMut<Held>, light: Single<(&DirectionalLight, HeldMaps)>) {
    let (light, (mut cascades, mut frusta, mut config)) = light.into_inner();
    if !light.shadow_maps_enabled {
        return;
    }
    if !held.are_held {
        held.maps = Some((cascades.clone(), frusta.clone(), config.clone()));
    } else if let Some(maps) = held.maps.clone() {
        held.replaced = Some(config.clone());
        (*cascades, *frusta, *config) = maps;
    }
}

fn release_config(mut held: ResMut<Held>, config: Single<&mut CascadeShadowConfig>) {
    if let Some(replaced) = held.replaced.take() {
        *config.into_inner() = replaced;
    }
}
