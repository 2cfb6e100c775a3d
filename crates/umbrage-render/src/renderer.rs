use crate::clusters::{ClusterDrawing, FRAME_SHARE_PX, picture_view};
use crate::frame_target::{FRAME_FORMAT, FrameTarget};
use crate::instances::{Draw, DrawList, EdgeOn, Instances};
use crate::map_picture::MapPicture;
use crate::overlay::OverlayUniform;
use crate::pages::PageDrawing;
use crate::pipelines::{PipelineParts, Pipelines};
use crate::points::Points;
use crate::pool_picture::PoolPicture;
use crate::scene::SceneBuffers;
use crate::timer::{Stage, Timer};
use crate::view::{Tile, ViewUniform};
use crate::{Error, Gpu};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::mem::size_of;
use umbrage::{Camera, Light, Plan, SeenTiles};
use umbrage_wgpu::{
    Bias, CasterInstance, Casters, ClusterCasters, ClusterSelection, DepthProjection, Frame, Mask,
    MeshCasters, MeshKind, SeenReadback, ShadowOptions, Shadows, Support, Timestamps,
};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingType, Buffer, BufferBindingType, BufferDescriptor, BufferUsages,
    Color, CommandEncoder, CompareFunction, ComputePassTimestampWrites, IndexFormat, LoadOp,
    Operations, PipelineLayout, PipelineLayoutDescriptor, RenderPass, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPassTimestampWrites,
    RenderPipeline, ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages, StoreOp,
    TextureFormat, TextureView, VertexAttribute, VertexBufferLayout, VertexFormat, VertexStepMode,
};

use wgpu_profiler::GpuProfilerQuery;

/// Draws one scene with one kind of shadow maps.
pub struct Renderer<'g> {
    pub(crate) gpu: &'g Gpu,
    pub(crate) scene: &'g SceneBuffers,
    pub(crate) shadows: Shadows,
    pub(crate) points: Option<Points>,
    pub(crate) map_picture: Option<MapPicture>,
    pub(crate) pool_picture: Option<PoolPicture>,
    opaque: MeshCasters,
    masked: MeshCasters,
    /// One for each material; `None` for opaque materials.
    pub(crate) masks: Vec<Option<BindGroup>>,
    view_buffer: Buffer,
    pub(crate) overlay_buffer: Buffer,
    view_group: BindGroup,
    shader: ShaderModule,
    layout: PipelineLayout,
    /// Pipelines by the names of their fragment shaders, made at first use.
    pictures: HashMap<&'static str, Pipelines>,
    instances: Instances,
    /// Draws clusters, if the scene has any and their levels of detail are wanted.
    clusters: Option<ClusterDrawing>,
    /// Draws pages, if plans have some.
    pub(crate) pages: Option<PageDrawing>,
    /// Whether each choice of clusters is waited for.
    pub(crate) is_exact: bool,
    pub(crate) edge_on: Vec<EdgeOn>,
    /// Origin of the render space in which the maps are looked up, world space, metres; `None`
    /// before maps are drawn.
    pub(crate) eye: Option<DVec3>,
}

/// A camera and a light to shade a picture with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading<'a> {
    /// The camera, at the eye from which the maps are [seen](Renderer::draw_maps_seen_from).
    pub camera: &'a Camera,
    /// One of the plan's lights.
    pub light: &'a Light,
    /// The light's index in the plan.
    pub light_index: u32,
}

/// What was drawn into a map or a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Number of draw calls.
    pub draws: u32,
    /// Number of triangles, counted once for each instance.
    pub triangles: u64,
}

pub(crate) const POSITIONS: VertexBufferLayout<'static> = VertexBufferLayout {
    array_stride: size_of::<Vec3>() as u64,
    step_mode: VertexStepMode::Vertex,
    attributes: &[VertexAttribute {
        format: VertexFormat::Float32x3,
        offset: 0,
        shader_location: 0,
    }],
};

impl<'g> Renderer<'g> {
    /// Makes a renderer that looks up its shadow maps according to `options`.
    ///
    /// # Errors
    /// The device does not support the options.
    pub fn new(
        gpu: &'g Gpu,
        scene: &'g SceneBuffers,
        options: &ShadowOptions,
    ) -> Result<Self, Error> {
        Self::with_support(gpu, scene, options, gpu.support())
    }

    /// Like [`new`](Self::new), but uses only what `support` says of the device, which may be less
    /// than the device supports.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn with_support(
        gpu: &'g Gpu,
        scene: &'g SceneBuffers,
        options: &ShadowOptions,
        support: Support,
    ) -> Result<Self, Error> {
        Self::with_lookup(gpu, scene, options, support, |wgsl| wgsl)
    }

    /// Like [`with_support`](Self::with_support), with another lookup: `change` makes its text from
    /// that of [`Shadows::lookup_wgsl`]. So lookups can be compared in one run, with all else the
    /// same.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn with_lookup(
        gpu: &'g Gpu,
        scene: &'g SceneBuffers,
        options: &ShadowOptions,
        support: Support,
        change: impl FnOnce(String) -> String,
    ) -> Result<Self, Error> {
        let device = gpu.device();
        let mut shadows = Shadows::new(device, support, options)?;
        if scene.clusters.is_some() && support.clusters {
            // Pages too are then drawn from levels of detail.
            shadows.set_bias(ClusterCasters::bias(ClusterCasters::SHARE))?;
        }
        let [positions, instances] = [Some(POSITIONS), Some(CasterInstance::LAYOUT)];
        let opaque = MeshCasters::new(
            device,
            &shadows,
            MeshKind::Opaque,
            &[positions.clone(), instances.clone()],
        );
        let all = scene.attribute_layout.clone();
        let uvs = VertexBufferLayout { attributes: &all.attributes[..1], ..all };
        let masked = MeshCasters::new(
            device,
            &shadows,
            MeshKind::Masked,
            &[positions, instances, Some(uvs)],
        );
        let masks = scene.materials.iter().map(|m| {
            let mask = m.mask.as_ref()?;
            masked.mask(
                device,
                gpu.queue(),
                &Mask {
                    texture: &mask.texture,
                    sampler: &mask.sampler,
                    factor: mask.factor,
                    cutoff: mask.cutoff,
                },
            )
        });
        let masks = masks.collect();
        let view_buffer = uniform_buffer::<ViewUniform>(device, "view");
        let overlay_buffer = uniform_buffer::<OverlayUniform>(device, "overlay");
        let (view_layout, view_group) = view_bindings(device, &view_buffer, &overlay_buffer);
        let lookup = change(shadows.lookup_wgsl(1));
        let shader = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("forward"),
            source: ShaderSource::Wgsl(shader_text(&lookup).into()),
        });
        let layouts = [&view_layout, shadows.lookup_layout(), &scene.material_layout];
        let of_clusters = scene.clusters.as_ref().filter(|_| support.clusters);
        let clusters = of_clusters
            .map(|clusters| ClusterDrawing::new(gpu, clusters, &shadows, &lookup, layouts))
            .transpose()?;
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("forward"),
            bind_group_layouts: &layouts.map(Some),
            immediate_size: 0,
        });
        let pages = options.pages.then(|| PageDrawing::new(gpu, scene, &shadows)).transpose()?;
        gpu.check()?;
        Ok(Self {
            gpu,
            scene,
            shadows,
            points: None,
            map_picture: None,
            pool_picture: None,
            opaque,
            masked,
            masks,
            view_buffer,
            overlay_buffer,
            view_group,
            shader,
            layout,
            pictures: HashMap::new(),
            instances: Instances::new(gpu),
            clusters,
            pages,
            is_exact: true,
            edge_on: Vec::new(),
            eye: None,
        })
    }

    /// The shadow maps, as `umbrage_wgpu` holds them.
    pub fn shadows(&self) -> &Shadows {
        &self.shadows
    }

    /// Draws all of the scene's triangles from now on, even if it was uploaded as clusters.
    ///
    /// # Errors
    /// The device refused something.
    pub fn draw_full_detail(&mut self) -> Result<(), Error> {
        self.clusters = None;
        self.shadows.set_bias(Bias::default())?;
        if self.pages.is_some() {
            self.pages = Some(PageDrawing::of_share(self.gpu, self.scene, &self.shadows, 0.0)?);
        }
        Ok(())
    }

    /// Whether clusters are chosen and drawn.
    pub fn draws_clusters(&self) -> bool {
        self.clusters.is_some()
    }

    /// Does not wait for choices of clusters from now on, as befits frames that follow one another:
    /// where one finds more than there is room for, something is missing until the next frame.
    pub fn run_ahead(&mut self) {
        self.is_exact = false;
    }

    /// Leaves these triangles out of the maps of their lights from now on. Those of one instance
    /// must ascend.
    pub fn leave_out(&mut self, edge_on: Vec<EdgeOn>) {
        self.edge_on = edge_on;
    }

    /// Draws those of the plan's maps that are out of date, without waiting for the device. Returns
    /// what was drawn into which map, by the map's index in the plan.
    ///
    /// # Errors
    /// The device cannot hold or draw the maps.
    pub fn draw_maps(
        &mut self,
        plan: &Plan,
        casters: Casters<'_>,
        timer: Option<&mut Timer>,
    ) -> Result<Vec<(usize, Drawn)>, Error> {
        self.draw_maps_seen_from(plan.origin, plan, casters, timer)
    }

    /// Like [`draw_maps`](Self::draw_maps), for frames and samples by a camera at `eye` (world
    /// space, metres), which need not be the one that the maps were planned for. Maps are not out
    /// of date because another camera sees them. Surfaces that they do not hold are lit, and
    /// filters whose width is in pixels count those of the plan's own camera.
    ///
    /// # Errors
    /// As for [`draw_maps`](Self::draw_maps), and if `eye` is not finite.
    pub fn draw_maps_seen_from(
        &mut self,
        eye: DVec3,
        plan: &Plan,
        casters: Casters<'_>,
        timer: Option<&mut Timer>,
    ) -> Result<Vec<(usize, Drawn)>, Error> {
        if plan.paging.is_some() {
            let drawn = self.draw_pages(eye, plan, casters, timer);
            if let (Err(_), Some(pages)) = (&drawn, &mut self.pages) {
                // What has moved since is not known any more.
                pages.is_complete = false;
            }
            return drawn;
        }
        if self.clusters.is_some() && self.edge_on.is_empty() {
            return self.draw_clusters(eye, plan, casters, timer);
        }
        let Self { gpu, scene, shadows, instances, opaque, masked, masks, edge_on, .. } = self;
        let is_prefiltered = shadows.options().filter.prefilter().is_some();
        let frame = Frame { plan, render_origin: eye, casters };
        let prepared = shadows.prepare(gpu.device(), gpu.queue(), &frame)?;
        self.eye = Some(eye);
        instances.begin(scene, eye);
        let lists: Vec<DrawList> = prepared
            .stale()
            .map(|redraw| {
                let light = plan.maps[redraw.index].part.light;
                let left_out = edge_on.iter().filter(|e| e.light == light).copied();
                instances.add_casters(scene, |aabb| redraw.may_cast(aabb), &left_out)
            })
            .collect();
        let mut drawn: Vec<(usize, Drawn)> = Vec::with_capacity(lists.len());
        if lists.is_empty() {
            return Ok(drawn);
        }
        instances.upload(gpu)?;
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        let mut begin = |stage| timer.as_ref().map(|t| t.begin(stage, &mut encoder));
        let depth = begin(Stage::Depth);
        let filter = if is_prefiltered { begin(Stage::Filter) } else { None };
        let timestamps = Timestamps { depth: writes(&depth), filter: writes(&filter) };
        let mut lists = lists.into_iter();
        prepared.encode(&mut encoder, &timestamps, |map| {
            let index = map.redraw.index;
            if drawn.last().is_none_or(|&(last, _)| last != index) {
                drawn.push((index, Drawn::default()));
            }
            let Some((list, (_, into_map))) = lists.next().zip(drawn.last_mut()) else { return };
            let mut drawer = Drawer::new(scene, instances, &mut *map.pass, into_map);
            for draw in instances.draws(list) {
                let is_masked = scene.is_masked(draw.mesh);
                let casters = if is_masked { &*masked } else { &*opaque };
                drawer.choose(is_masked, casters.pipeline());
                drawer.bind(1, draw.mesh, |material| masks[material].as_ref());
                drawer.draw(draw);
            }
        });
        if let Some(timer) = timer {
            timer.end(&mut encoder, depth.into_iter().chain(filter));
        }
        gpu.queue().submit([encoder.finish()]);
        gpu.check()?;
        Ok(drawn)
    }

    /// Draws the maps of a plan from the scene's clusters.
    fn draw_clusters(
        &mut self,
        eye: DVec3,
        plan: &Plan,
        mut casters: Casters<'_>,
        mut timer: Option<&mut Timer>,
    ) -> Result<Vec<(usize, Drawn)>, Error> {
        let Self { gpu, scene, shadows, masks, clusters, is_exact, .. } = self;
        let (Some(own), Some(drawing)) = (&scene.clusters, clusters) else {
            return Ok(Vec::new());
        };
        let is_prefiltered = shadows.options().filter.prefilter().is_some();
        let (device, queue) = (gpu.device(), gpu.queue());
        if drawing.casters.counts(device).is_some_and(|counts| !counts.is_complete) {
            drawing.is_complete = false;
        }
        loop {
            if !std::mem::replace(&mut drawing.is_complete, true) {
                casters = Casters::Moved;
            }
            let frame = Frame { plan, render_origin: eye, casters };
            let prepared = shadows.prepare(device, queue, &frame)?;
            self.eye = Some(eye);
            let mut drawn: Vec<(usize, Drawn)> = Vec::new();
            if prepared.stale().next().is_none() {
                return Ok(drawn);
            }
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut begin = |stage| timer.as_ref().map(|t| t.begin(stage, &mut encoder));
            let choice = begin(Stage::Depth);
            let depth = begin(Stage::Depth);
            let filter = if is_prefiltered { begin(Stage::Filter) } else { None };
            let timestamps = Timestamps { depth: writes(&depth), filter: writes(&filter) };
            let casters = &mut drawing.casters;
            let times = compute_writes(&choice);
            casters.choose(device, queue, &mut encoder, &own.geometry, &prepared, times)?;
            prepared.encode(&mut encoder, &timestamps, |map| {
                let index = map.redraw.index;
                if drawn.last().is_none_or(|&(last, _)| last != index) {
                    drawn.push((index, Drawn::default()));
                }
                let Some((_, into_map)) = drawn.last_mut() else { return };
                into_map.draws += casters.draw(map, |batch| {
                    let material = batch.checked_sub(1).map(|i| own.masked[i as usize]);
                    material.and_then(|m| masks[m].as_ref())
                });
            });
            if let Some(timer) = timer.as_deref_mut() {
                timer.end(&mut encoder, choice.into_iter().chain(depth).chain(filter));
            }
            queue.submit([encoder.finish()]);
            gpu.check()?;
            if *is_exact {
                gpu.wait()?;
            }
            let counts = drawing.casters.counts(device);
            if *is_exact && counts.is_some_and(|counts| !counts.is_complete) {
                drawing.is_complete = false;
                continue;
            }
            // All maps are chosen for at once.
            if let (Some(counts), Some((_, first))) = (counts, drawn.first_mut()) {
                first.triangles = counts.triangles;
            }
            return Ok(drawn);
        }
    }

    /// Draws a frame to display into a target of the size of the camera's picture, without waiting
    /// for the device. The maps must have been drawn.
    ///
    /// # Errors
    /// The device refused something.
    pub fn frame(
        &mut self,
        shading: &Shading<'_>,
        target: &FrameTarget,
        timer: Option<&mut Timer>,
    ) -> Result<Drawn, Error> {
        self.draw_frame("frame", Stage::Picture, shading, target, timer)
    }

    /// Draws a frame by the fragment shaders of this name.
    pub(crate) fn draw_frame(
        &mut self,
        name: &'static str,
        stage: Stage,
        shading: &Shading<'_>,
        target: &FrameTarget,
        mut timer: Option<&mut Timer>,
    ) -> Result<Drawn, Error> {
        let tile = Tile::whole(shading.camera);
        let pipelines = self.pipelines(name, &[FRAME_FORMAT]);
        let color = &[&target.color_view][..];
        let (depth, depth_store) = (&target.depth, StoreOp::Store);
        let (share_px, is_frame) = (FRAME_SHARE_PX, true);
        let pipelines = &pipelines;
        let parts = Target { color, depth, depth_store, share_px, is_frame, pipelines, stage };
        loop {
            let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
            let timer = timer.as_deref_mut();
            let mut drawn = self.encode_picture(&mut encoder, shading, &tile, &parts, timer)?;
            target.encode_copy(&mut encoder);
            self.gpu.queue().submit([encoder.finish()]);
            self.gpu.check()?;
            if self.is_whole(&mut drawn)? {
                return Ok(drawn);
            }
        }
    }

    /// Reduces the depths of the frame that was drawn last into a target, and waits for what it
    /// shows.
    ///
    /// # Errors
    /// The device refused something or was lost.
    pub fn seen(
        &self,
        camera: &Camera,
        target: &FrameTarget,
        readback: &mut SeenReadback,
    ) -> Result<Option<SeenTiles>, Error> {
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        let projection = depth_projection(self.scene, camera)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        readback.encode(device, queue, &mut encoder, &target.depth, projection, camera)?;
        queue.submit([encoder.finish()]);
        self.gpu.wait()?;
        Ok(readback.latest(device).cloned())
    }

    /// The pipelines with the fragment shaders `opaque_NAME`, `masked_NAME` and `sky_NAME`.
    pub(crate) fn pipelines(&mut self, name: &'static str, formats: &[TextureFormat]) -> Pipelines {
        let Self { gpu, scene, shader, layout, pictures, clusters, .. } = self;
        if let Some(clusters) = clusters {
            return clusters.pipelines(gpu, name, formats);
        }
        let attributes = scene.attribute_layout.clone();
        let buffers = [Some(POSITIONS), Some(CasterInstance::LAYOUT), Some(attributes)];
        let parts =
            PipelineParts { gpu, module: shader, layout, vertex: "mesh_vertex", buffers: &buffers };
        let made = || parts.pipelines(name, formats, CompareFunction::Greater);
        pictures.entry(name).or_insert_with(made).clone()
    }

    /// Draws the scene and the sky. Each picture needs a submission of its own, because pictures
    /// share buffers.
    pub(crate) fn encode_picture(
        &mut self,
        encoder: &mut CommandEncoder,
        shading: &Shading<'_>,
        tile: &Tile,
        target: &Target<'_>,
        timer: Option<&mut Timer>,
    ) -> Result<Drawn, Error> {
        let Self { gpu, scene, instances, clusters, .. } = self;
        let Shading { camera, light, light_index } = *shading;
        debug_assert!(
            self.eye.is_none_or(|eye| eye == camera.eye()),
            "maps were drawn for a camera at {:?}, not at {}",
            self.eye,
            camera.eye()
        );
        let view = ViewUniform::new(camera, light, light_index, tile, scene.farthest(camera));
        gpu.queue().write_buffer(&self.view_buffer, 0, bytemuck::bytes_of(&view));
        let planes = tile.planes(camera);
        let query = timer.as_ref().map(|t| t.begin(target.stage, encoder));
        let mut queries = vec![];
        let mut list = 0..0;
        if let (Some(own), Some(drawing)) = (&scene.clusters, clusters.as_mut()) {
            let choice = timer.as_ref().map(|t| t.begin(target.stage, encoder));
            let times = compute_writes(&choice);
            let view = picture_view(camera, tile, &view, &planes, target.share_px)?;
            let (device, queue) = (gpu.device(), gpu.queue());
            let ClusterDrawing { picture, occluders, hiding, depths, .. } = drawing;
            if target.is_frame {
                hiding.learn(picture.counts(device));
            }
            let (geometry, eye) = (&own.geometry, camera.eye());
            let mut draw_depths = |encoder: &mut CommandEncoder, picture: &_, group: &_| {
                let query = timer.as_ref().map(|t| t.begin(target.stage, encoder));
                let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                    label: Some("depths"),
                    color_attachments: &[],
                    depth_stencil_attachment: Some(depth_attachment(
                        target.depth,
                        LoadOp::Clear(0.0),
                        StoreOp::Store,
                    )),
                    timestamp_writes: writes(&query),
                    occlusion_query_set: None,
                    multiview_mask: None,
                });
                pass.set_pipeline(depths);
                pass.set_bind_group(0, &self.view_group, &[]);
                pass.set_bind_group(1, self.shadows.lookup_bind_group(), &[]);
                if let Some(any) = scene.materials.first() {
                    pass.set_bind_group(2, &any.bind_group, &[]);
                }
                pass.set_bind_group(3, group, &[]);
                ClusterSelection::draw_together(picture, &mut pass, 0);
                drop(pass);
                queries.extend(query);
            };
            let seeks = target.is_frame && hiding.is_sought;
            let again = picture.draw_again(queue, geometry, eye).filter(|_| seeks);
            let mut hides = None;
            if let Some(group) = again {
                draw_depths(encoder, picture, group);
                let projection = depth_projection(scene, camera)?;
                let depth = target.depth;
                occluders.encode(device, queue, encoder, geometry, depth, projection, &view)?;
                hides = Some(&*occluders);
            }
            let (views, together) = ([view], own.opaque);
            picture
                .encode(device, queue, encoder, geometry, &views, eye, together, hides, times)?;
            if let Some(group) = picture.vertex_group() {
                draw_depths(encoder, picture, group);
            }
            queries.extend(choice);
        } else {
            instances.begin(scene, camera.eye());
            list = instances.add_nearest_first(scene, camera.eye(), |aabb| {
                planes.iter().all(|p| p.may_touch(aabb))
            });
            instances.upload(gpu)?;
        }
        let attachments: Vec<_> = target.color.iter().map(|view| color_attachment(view)).collect();
        let load = if clusters.is_some() { LoadOp::Load } else { LoadOp::Clear(0.0) };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(depth_attachment(
                target.depth,
                load,
                target.depth_store,
            )),
            timestamp_writes: writes(&query),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.view_group, &[]);
        pass.set_bind_group(1, self.shadows.lookup_bind_group(), &[]);
        let mut drawn = Drawn::default();
        let Pipelines { opaque, masked, sky } = target.pipelines;
        if let (Some(own), Some(drawing)) = (&scene.clusters, clusters.as_mut()) {
            let picture = &drawing.picture;
            if let Some(group) = picture.vertex_group() {
                pass.set_bind_group(3, group, &[]);
            }
            for (batch, &material) in (0..).zip(&own.materials) {
                if batch == 0 || batch == own.opaque {
                    pass.set_pipeline(if batch < own.opaque { opaque } else { masked });
                }
                pass.set_bind_group(2, &scene.materials[material].bind_group, &[]);
                picture.draw(&mut pass, batch);
                drawn.draws += 1;
            }
        } else {
            let mut drawer = Drawer::new(scene, instances, &mut pass, &mut drawn);
            for draw in instances.draws(list) {
                let is_masked = scene.is_masked(draw.mesh);
                drawer.choose(is_masked, if is_masked { masked } else { opaque });
                drawer.bind(2, draw.mesh, |material| Some(&scene.materials[material].bind_group));
                drawer.draw(draw);
            }
        }
        pass.set_pipeline(sky);
        if let Some(any) = scene.materials.first() {
            pass.set_bind_group(2, &any.bind_group, &[]);
            pass.draw(0..3, 0..1);
        }
        drop(pass);
        if let Some(timer) = timer {
            timer.end(encoder, query.into_iter().chain(queries));
        }
        Ok(drawn)
    }

    /// Whether the picture that was submitted last shows all that it should. If it does not, there
    /// is more room now, and it must be drawn again.
    pub(crate) fn is_whole(&mut self, drawn: &mut Drawn) -> Result<bool, Error> {
        let Some(drawing) = &mut self.clusters else { return Ok(true) };
        if self.is_exact {
            self.gpu.wait()?;
        }
        let counts = drawing.picture.counts(self.gpu.device());
        drawn.triangles = counts.triangles;
        Ok(counts.is_complete || !drawing.picture.is_counted() || !self.is_exact)
    }
}

pub(crate) fn uniform_buffer<T>(device: &wgpu::Device, label: &str) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// How depths follow from distances, as `ViewUniform` has it.
pub(crate) fn depth_projection(
    scene: &SceneBuffers,
    camera: &Camera,
) -> Result<DepthProjection, Error> {
    Ok(if camera.is_orthographic() {
        DepthProjection::orthographic(camera.near(), scene.farthest(camera), true)?
    } else {
        DepthProjection::of_range(camera.near(), f64::INFINITY, true)?
    })
}

/// The bind group of camera, light and overlay, with its layout.
fn view_bindings(
    device: &wgpu::Device,
    view: &Buffer,
    overlay: &Buffer,
) -> (wgpu::BindGroupLayout, BindGroup) {
    let entry = |binding, visibility| BindGroupLayoutEntry {
        binding,
        visibility,
        ty: BindingType::Buffer {
            ty: BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("view"),
        entries: &[entry(0, ShaderStages::VERTEX_FRAGMENT), entry(1, ShaderStages::FRAGMENT)],
    });
    let group = device.create_bind_group(&BindGroupDescriptor {
        label: Some("view"),
        layout: &layout,
        entries: &[
            BindGroupEntry { binding: 0, resource: view.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: overlay.as_entire_binding() },
        ],
    });
    (layout, group)
}

/// The textures that a picture is drawn into, and the pipelines that draw it.
pub(crate) struct Target<'a> {
    pub(crate) color: &'a [&'a TextureView],
    pub(crate) depth: &'a TextureView,
    /// Whether depths are kept for later passes.
    pub(crate) depth_store: StoreOp,
    /// How far clusters may be off, pixels.
    pub(crate) share_px: f32,
    /// Whether the picture follows another one, which it resembles.
    pub(crate) is_frame: bool,
    pub(crate) pipelines: &'a Pipelines,
    /// The stage that the time counts as.
    pub(crate) stage: Stage,
}

/// Draws meshes into a pass. The vertex buffers are set once.
struct Drawer<'a, 'p, 'e> {
    scene: &'a SceneBuffers,
    pass: &'p mut RenderPass<'e>,
    drawn: &'p mut Drawn,
    /// Whether the pipeline for meshes with holes was set last.
    is_masked: Option<bool>,
    /// The material that was bound last.
    material: Option<usize>,
}

impl<'a, 'p, 'e> Drawer<'a, 'p, 'e> {
    fn new(
        scene: &'a SceneBuffers,
        instances: &Instances,
        pass: &'p mut RenderPass<'e>,
        drawn: &'p mut Drawn,
    ) -> Self {
        pass.set_vertex_buffer(0, scene.positions.slice(..));
        pass.set_vertex_buffer(1, instances.buffer.slice(..));
        pass.set_vertex_buffer(2, scene.attributes.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), IndexFormat::Uint32);
        Self { scene, pass, drawn, is_masked: None, material: None }
    }

    /// Sets the pipeline for meshes with or without holes if the other one was set last.
    fn choose(&mut self, is_masked: bool, pipeline: &RenderPipeline) {
        if self.is_masked != Some(is_masked) {
            self.pass.set_pipeline(pipeline);
            self.is_masked = Some(is_masked);
        }
    }

    /// Binds what `group_of` the mesh's material gives, if another material was bound last.
    fn bind<'b>(
        &mut self,
        group: u32,
        mesh: usize,
        group_of: impl FnOnce(usize) -> Option<&'b BindGroup>,
    ) {
        let material = self.scene.meshes[mesh].material;
        if self.material != Some(material) {
            if let Some(bind_group) = group_of(material) {
                self.pass.set_bind_group(group, bind_group, &[]);
            }
            self.material = Some(material);
        }
    }

    fn draw(&mut self, draw: &Draw) {
        let mesh = &self.scene.meshes[draw.mesh];
        let first = mesh.indices.start;
        let indices = first + 3 * draw.triangles.start..first + 3 * draw.triangles.end;
        self.pass.draw_indexed(indices, mesh.first_vertex, draw.instances.clone());
        self.drawn.draws += 1;
        self.drawn.triangles += draw.triangles.len() as u64 * draw.instances.len() as u64;
    }
}

/// The forward shader, after the lookup module that it calls.
pub(crate) fn shader_text(lookup: &str) -> String {
    [lookup, include_str!("wgsl/forward.wgsl"), include_str!("wgsl/overlay.wgsl")].join("\n")
}

pub(crate) fn compute_writes(
    query: &Option<GpuProfilerQuery>,
) -> Option<ComputePassTimestampWrites<'_>> {
    query.as_ref().and_then(GpuProfilerQuery::compute_pass_timestamp_writes)
}

pub(crate) fn writes(query: &Option<GpuProfilerQuery>) -> Option<RenderPassTimestampWrites<'_>> {
    query.as_ref().and_then(GpuProfilerQuery::render_pass_timestamp_writes)
}

fn depth_attachment(
    view: &TextureView,
    load: LoadOp<f32>,
    store: StoreOp,
) -> RenderPassDepthStencilAttachment<'_> {
    let depth_ops = Some(Operations { load, store });
    RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}

pub(crate) fn color_attachment(view: &TextureView) -> Option<RenderPassColorAttachment<'_>> {
    Some(RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
    })
}
