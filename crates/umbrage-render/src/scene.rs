use crate::clusters::SceneClusters;
use crate::{Error, Gpu};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::collections::{BTreeMap, HashMap};
use std::sync::{OnceLock, PoisonError, RwLock, RwLockReadGuard};
use umbrage::{Aabb, Camera};
use umbrage_clusters::ClusterMesh;
use umbrage_scene::{Alpha, Instance, Material, Mesh, Moved, Role, Sampling, Scene, Texture, Wrap};
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{
    AddressMode, BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout,
    BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingResource, BindingType, Buffer,
    BufferBindingType, BufferUsages, Extent3d, FilterMode, Sampler, SamplerBindingType,
    SamplerDescriptor, ShaderStages, TextureDescriptor, TextureDimension, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
    VertexAttribute, VertexBufferLayout, VertexFormat, VertexStepMode,
};

/// The meshes and materials of a scene on a GPU, in the pose that was [set](Self::pose) last, or
/// that the scene had when it was uploaded.
pub struct SceneBuffers {
    pub(crate) positions: Buffer,
    pub(crate) attributes: Buffer,
    /// Layout of `attributes`, of which the first is all that masked casters need.
    pub(crate) attribute_layout: VertexBufferLayout<'static>,
    pub(crate) indices: Buffer,
    /// One for each mesh.
    pub(crate) meshes: Vec<MeshRange>,
    pub(crate) materials: Vec<GpuMaterial>,
    pub(crate) material_layout: BindGroupLayout,
    /// The scene as clusters, if it was uploaded with them.
    pub(crate) clusters: Option<SceneClusters>,
    /// The scene as clusters with all detail, from which pages are drawn if there are no others.
    finest: OnceLock<RwLock<SceneClusters>>,
    /// The same of what moves.
    moving: RwLock<Option<MovingClusters>>,
    /// Renderers share the buffers, so that a new pose reaches all of them.
    placed: RwLock<Placed>,
}

/// Where the instances of a scene are.
pub(crate) struct Placed {
    /// The instances that have triangles, those of one mesh next to each other.
    pub(crate) instances: Vec<Drawable>,
    /// How often instances changed.
    pub(crate) version: u64,
    /// How each instance casts into pages. What was taken from clusters never goes back.
    in_pages: Vec<InPages>,
    /// The instances that a pose has moved or deformed.
    poses: BTreeMap<usize, Pose>,
    /// For each of the scene's instances, its index in `instances`, if it has triangles.
    drawable_of: Vec<Option<u32>>,
    /// A box around each mesh, in its own space, metres.
    pub(crate) mesh_boxes: Vec<Aabb>,
    /// A box around all instances that are seen, world space, metres.
    bounds: Aabb,
}

/// Clusters of instances that move.
pub(crate) struct MovingClusters {
    pub(crate) clusters: SceneClusters,
    /// The instances, in order.
    pub(crate) members: Vec<usize>,
}

/// How an instance casts into pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum InPages {
    /// As clusters.
    AsClusters,
    /// As a whole mesh that stands still.
    Whole,
    /// As clusters that move.
    Moving,
    /// As a whole mesh that moves and changes its shape.
    Deformed,
}

/// What poses did to an instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    /// The box around it before the first of them, world space, metres.
    pub(crate) rest: Aabb,
    /// The version of the scene's instances since the last of them.
    pub(crate) version: u64,
}

/// An instance of a mesh.
pub(crate) struct Drawable {
    /// Index in [`Scene::instances`].
    pub(crate) instance: usize,
    /// Index of the mesh.
    pub(crate) mesh: usize,
    /// Transform of the positions as they are uploaded, which are relative to the mesh's
    /// [anchor].
    pub(crate) world_from_mesh: DAffine3,
    /// World space, metres.
    pub(crate) bounds: Aabb,
    pub(crate) role: Role,
}

/// The range of a mesh in the buffers.
#[derive(Clone, Debug)]
pub(crate) struct MeshRange {
    pub(crate) indices: std::ops::Range<u32>,
    pub(crate) first_vertex: i32,
    pub(crate) vertices: usize,
    pub(crate) material: usize,
}

impl MeshRange {
    /// Number of triangles.
    pub(crate) fn triangles(&self) -> u32 {
        self.indices.len() as u32 / 3
    }
}

/// A material, for meshes with or for meshes without texture coordinates.
pub(crate) struct GpuMaterial {
    pub(crate) bind_group: BindGroup,
    pub(crate) mask: Option<GpuMask>,
}

/// The alpha mask of a material.
pub(crate) struct GpuMask {
    pub(crate) texture: TextureView,
    pub(crate) sampler: Sampler,
    pub(crate) factor: f32,
    pub(crate) cutoff: f32,
}

/// The attributes of a vertex without its position, which has a buffer of its own because opaque
/// casters need nothing else: normal and texture coordinates.
const PLAIN: VertexBufferLayout<'static> = VertexBufferLayout {
    array_stride: 3 * size_of::<u32>() as u64,
    step_mode: VertexStepMode::Vertex,
    attributes: &[uv(VertexFormat::Float32x2), NORMAL],
};

/// The attributes of a vertex in scenes where masked vertices have an alpha of their own. It is the
/// fourth word after the normal; the third is padding.
const WITH_ALPHA: VertexBufferLayout<'static> = VertexBufferLayout {
    array_stride: 5 * size_of::<u32>() as u64,
    attributes: &[uv(VertexFormat::Float32x4), NORMAL],
    ..PLAIN
};

const NORMAL: VertexAttribute =
    VertexAttribute { format: VertexFormat::Uint32, offset: 0, shader_location: 5 };

/// Texture coordinates, with alpha if the format has four components.
const fn uv(format: VertexFormat) -> VertexAttribute {
    VertexAttribute { format, offset: size_of::<u32>() as u64, shader_location: 4 }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct MaterialUniform {
    base_color: Vec4,
    cutoff: f32,
    padding: [f32; 3],
}

impl SceneBuffers {
    /// Uploads a scene. If `opaque` is true, alpha masks are ignored.
    ///
    /// # Errors
    /// The scene or a texture is too large for the device.
    pub fn new(gpu: &Gpu, scene: &Scene, opaque: bool) -> Result<Self, Error> {
        Self::with_clusters(gpu, scene, opaque, None)
    }

    /// Uploads a scene and, if there are any, the clusters of its meshes, from which renderers then
    /// choose what to draw. Such a scene stays in its pose. Where the device lacks what clusters
    /// need, or room for them, they are left out: see [`has_clusters`](Self::has_clusters).
    ///
    /// # Errors
    /// As for [`new`](Self::new), or if the clusters are not those of the scene's meshes.
    pub fn with_clusters(
        gpu: &Gpu,
        scene: &Scene,
        opaque: bool,
        clusters: Option<&[ClusterMesh]>,
    ) -> Result<Self, Error> {
        let device = gpu.device();
        let limits = device.limits();
        let largest = limits.max_buffer_size.min(u64::from(u32::MAX));
        let vertices: usize = scene.meshes.iter().map(|m| m.positions.len()).sum();
        let indices: usize = scene.meshes.iter().map(|m| 3 * m.triangles.len()).sum();
        let has_alpha = scene.meshes.iter().any(|m| !m.alphas.is_empty());
        let attribute_layout = if has_alpha { WITH_ALPHA } else { PLAIN };
        let floats = attribute_layout.array_stride as usize / size_of::<u32>();
        let bytes = (vertices as u64 * attribute_layout.array_stride).max(4 * indices as u64);
        if bytes > largest {
            return Err(Error::TooLarge {
                what: "the scene".into(),
                problem: format!("{bytes} bytes, but a buffer holds at most {largest}"),
            });
        }
        for (i, texture) in scene.textures.iter().enumerate() {
            let max = limits.max_texture_dimension_2d;
            if texture.size.iter().any(|&n| n > max) {
                return Err(Error::TooLarge {
                    what: format!("texture {i} of {}x{} pixels", texture.size[0], texture.size[1]),
                    problem: format!("at most {max} pixels in width and height"),
                });
            }
        }
        let placed = Placed::new(scene);
        let meshes_with_boxes = scene.meshes.iter().zip(&placed.mesh_boxes);
        let all_positions: Vec<Vec3> =
            meshes_with_boxes.flat_map(|(mesh, &bounds)| uploaded(mesh, bounds)).collect();
        let mut attributes = Vec::with_capacity(vertices * floats);
        for mesh in &scene.meshes {
            push_attributes(mesh, has_alpha, &mut attributes);
        }
        let all_indices: Vec<[u32; 3]> =
            scene.meshes.iter().flat_map(|m| m.triangles.iter().copied()).collect();
        let material_layout = material_layout(gpu);
        let mut materials = Materials::new(gpu, scene, &material_layout, opaque);
        let (mut first_vertex, mut first_index) = (0, 0);
        let meshes = scene.meshes.iter().map(|mesh| {
            let end = first_index + 3 * mesh.triangles.len() as u32;
            let range = MeshRange {
                indices: first_index..end,
                first_vertex,
                vertices: mesh.positions.len(),
                material: materials.index(mesh.material, !mesh.uvs.is_empty()),
            };
            first_vertex += mesh.positions.len() as i32;
            first_index = end;
            range
        });
        let meshes: Vec<MeshRange> = meshes.collect();
        // Pages may be asked for later.
        let can_cluster = gpu.support().clusters;
        let is_clustered = clusters.is_some() && can_cluster;
        let vertex_usage = match can_cluster {
            true => BufferUsages::VERTEX | BufferUsages::STORAGE,
            false => BufferUsages::VERTEX,
        };
        let mut buffers = Self {
            positions: gpu.buffer("positions", bytemuck::cast_slice(&all_positions), vertex_usage),
            attributes: gpu.buffer("attributes", bytemuck::cast_slice(&attributes), vertex_usage),
            attribute_layout,
            indices: gpu.buffer("indices", bytemuck::cast_slice(&all_indices), BufferUsages::INDEX),
            meshes,
            materials: materials.list,
            material_layout,
            placed: RwLock::new(placed),
            clusters: None,
            finest: OnceLock::new(),
            moving: RwLock::default(),
        };
        if let Some(clusters) = clusters.filter(|_| is_clustered) {
            buffers.clusters = SceneClusters::new(gpu, scene, &buffers, clusters)?;
        }
        gpu.check()?;
        Ok(buffers)
    }

    /// Takes what pages are drawn from, unless the scene has it: the clusters of its meshes with all
    /// detail. Without them, a [`Renderer`](crate::Renderer) refuses plans with pages.
    ///
    /// # Errors
    /// The clusters are not those of the scene's meshes, or the device has no room for them.
    pub fn make_pages(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        finest: impl FnOnce() -> Result<Vec<ClusterMesh>, umbrage_clusters::Error>,
    ) -> Result<(), Error> {
        if self.clusters.is_some() || self.finest.get().is_some() {
            return Ok(());
        }
        let finest = finest().map_err(|e| Error::Invalid {
            field: "scene",
            problem: format!("has no clusters to draw pages from: {e}"),
        })?;
        let clusters = SceneClusters::new(gpu, scene, self, &finest)?;
        let clusters = clusters.ok_or_else(|| Error::TooLarge {
            what: "the scene".into(),
            problem: "clusters of its triangles, from which pages are drawn, need more memory"
                .into(),
        })?;
        // Whoever came first has the same.
        let _ = self.finest.set(RwLock::new(clusters));
        self.place_moving(gpu, &self.placed())?;
        gpu.check()
    }

    /// Does something with the clusters that pages are drawn from, and tells whether they have all
    /// detail; `None` if there are none.
    pub(crate) fn with_page_clusters<T>(
        &self,
        act: impl FnOnce(&SceneClusters, bool) -> T,
    ) -> Option<T> {
        if let Some(clusters) = &self.clusters {
            return Some(act(clusters, false));
        }
        let finest = self.finest.get()?.read().unwrap_or_else(PoisonError::into_inner);
        Some(act(&finest, true))
    }

    /// Moves instances and deforms meshes as `moved` tells of the scene that was uploaded, which
    /// has been [posed](Scene::pose) since. What is drawn from now on shows the new pose. Returns
    /// boxes around the casters that changed, before and after, world space, metres: pass them to
    /// the next [`Renderer::draw_maps`](crate::Renderer::draw_maps) of each renderer, as
    /// [`Casters::MovedIn`](umbrage_wgpu::Casters::MovedIn). What every pose moved must be passed
    /// on, and the boxes of several poses between two draws count together. Renderers of plans with
    /// pages find all that by themselves, and need no boxes.
    ///
    /// # Errors
    /// The scene is not the one that was uploaded, it was uploaded with clusters and something
    /// moved, or the device refused something.
    pub fn pose(&self, gpu: &Gpu, scene: &Scene, moved: &Moved) -> Result<Vec<Aabb>, Error> {
        if self.clusters.is_some() && !(moved.instances.is_empty() && moved.meshes.is_empty()) {
            return Err(Error::Invalid {
                field: "clusters",
                problem: "must be none for scenes that move, but the scene has some".into(),
            });
        }
        let mut placed = self.placed.write().unwrap_or_else(PoisonError::into_inner);
        let is_same = scene.meshes.len() == self.meshes.len()
            && scene.instances.len() == placed.drawable_of.len()
            && moved.instances.iter().all(|&i| i < scene.instances.len());
        let of_mesh = |&i: &usize| {
            let (mesh, range) = (scene.meshes.get(i)?, self.meshes.get(i)?);
            (mesh.positions.len() == range.vertices).then_some((i, mesh, range))
        };
        let deformed: Option<Vec<_>> = moved.meshes.iter().map(of_mesh).collect();
        let Some(deformed) = deformed.filter(|_| is_same) else { return Err(Error::OtherScene) };
        let stride = self.attribute_layout.array_stride;
        let mut attributes = Vec::new();
        for (i, mesh, range) in deformed {
            let first = range.first_vertex as u64;
            placed.mesh_boxes[i] = mesh.bounds();
            let positions: Vec<Vec3> = uploaded(mesh, placed.mesh_boxes[i]).collect();
            let contents = bytemuck::cast_slice(&positions);
            gpu.queue().write_buffer(&self.positions, first * size_of::<Vec3>() as u64, contents);
            attributes.clear();
            push_attributes(mesh, stride == WITH_ALPHA.array_stride, &mut attributes);
            let contents = bytemuck::cast_slice(&attributes);
            gpu.queue().write_buffer(&self.attributes, first * stride, contents);
        }
        let known = placed.in_pages.clone();
        let casters = placed.move_instances(scene, moved);
        if placed.in_pages != known {
            self.place_finest(gpu, &placed)?;
        }
        self.place_moving(gpu, &placed)?;
        gpu.check()?;
        Ok(casters)
    }

    /// Has instances cast into pages as whole meshes from now on.
    pub(crate) fn take_from_clusters(
        &self,
        gpu: &Gpu,
        instances: impl Iterator<Item = usize>,
    ) -> Result<(), Error> {
        let mut placed = self.placed.write().unwrap_or_else(PoisonError::into_inner);
        let mut is_new = false;
        for instance in instances {
            let drawable = placed.drawable_of.get(instance).copied().flatten();
            let Some(in_pages) = drawable.map(|k| &mut placed.in_pages[k as usize]) else {
                continue;
            };
            if *in_pages == InPages::AsClusters {
                *in_pages = InPages::Whole;
                is_new = true;
            }
        }
        if !is_new {
            return Ok(());
        }
        placed.version += 1;
        self.place_finest(gpu, &placed)
    }

    /// Tells the clusters of pages which instances they have.
    fn place_finest(&self, gpu: &Gpu, placed: &Placed) -> Result<(), Error> {
        let Some(finest) = self.finest.get() else { return Ok(()) };
        finest.write().unwrap_or_else(PoisonError::into_inner).place(gpu, self, placed)
    }

    /// Tells the clusters that move where they are.
    fn place_moving(&self, gpu: &Gpu, placed: &Placed) -> Result<(), Error> {
        let Some(finest) = self.finest.get() else { return Ok(()) };
        let moves = |k: &usize| placed.in_pages[*k] == InPages::Moving;
        let members: Vec<usize> = placed.poses.keys().copied().filter(moves).collect();
        let mut moving = self.moving.write().unwrap_or_else(PoisonError::into_inner);
        if members.is_empty() {
            *moving = None;
            return Ok(());
        }
        let finest = finest.read().unwrap_or_else(PoisonError::into_inner);
        match &mut *moving {
            Some(moving) if moving.members == members => {
                moving.clusters.place_moving(gpu, self, placed, &members)
            }
            others => {
                let clusters = finest.with_moving(gpu, self, placed, &members)?;
                *others = Some(MovingClusters { clusters, members });
                Ok(())
            }
        }
    }

    /// The clusters that move, if there are any.
    pub(crate) fn moving(&self) -> RwLockReadGuard<'_, Option<MovingClusters>> {
        self.moving.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where the instances are.
    pub(crate) fn placed(&self) -> RwLockReadGuard<'_, Placed> {
        // A thread that panicked left every instance whole.
        self.placed.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// A distance along the view beyond which nothing lies, past the near plane, metres.
    pub(crate) fn farthest(&self, camera: &Camera) -> f64 {
        let bounds = self.placed().bounds;
        let corners = (!bounds.is_empty()).then(|| bounds.corners());
        let depths = corners.into_iter().flatten().map(|corner| camera.depth(corner));
        let farthest = depths.fold(camera.far(), f64::max);
        farthest + 0.01 * (farthest - camera.near())
    }

    /// Whether a mesh has holes where its material's alpha is low.
    pub(crate) fn is_masked(&self, mesh: usize) -> bool {
        self.materials[self.meshes[mesh].material].mask.is_some()
    }

    /// Whether the scene was uploaded as clusters.
    pub fn has_clusters(&self) -> bool {
        self.clusters.is_some()
    }

    /// Memory of vertices, indices and clusters, bytes.
    pub fn bytes(&self) -> u64 {
        let clusters = self.with_page_clusters(|c, _| c.geometry.bytes()).unwrap_or(0);
        self.positions.size() + self.attributes.size() + self.indices.size() + clusters
    }
}

impl Placed {
    fn new(scene: &Scene) -> Self {
        let mesh_boxes: Vec<Aabb> = scene.meshes.iter().map(Mesh::bounds).collect();
        let drawable = |i: usize| Drawable::new(scene, i, &mesh_boxes);
        let mut instances: Vec<Drawable> = (0..scene.instances.len()).map(drawable).collect();
        instances.retain(|i| !i.bounds.is_empty());
        instances.sort_by_key(|i| i.mesh);
        let mut drawable_of = vec![None; scene.instances.len()];
        for (k, drawable) in (0..).zip(&instances) {
            drawable_of[drawable.instance] = Some(k);
        }
        let mut placed = Self {
            version: 0,
            in_pages: vec![InPages::AsClusters; instances.len()],
            poses: BTreeMap::new(),
            drawable_of,
            mesh_boxes,
            bounds: Aabb::EMPTY,
            instances,
        };
        placed.find_bounds();
        placed
    }

    /// Moves these instances to where the scene has them. Returns boxes around those that cast,
    /// before and after.
    fn move_instances(&mut self, scene: &Scene, moved: &Moved) -> Vec<Aabb> {
        let mut casters = Vec::new();
        let version = self.version + 1;
        for &i in &moved.instances {
            let Some(k) = self.drawable_of[i] else { continue };
            let new = Drawable::new(scene, i, &self.mesh_boxes);
            let is_deformed = moved.meshes.contains(&new.mesh);
            let old = std::mem::replace(&mut self.instances[k as usize], new);
            let in_pages = &mut self.in_pages[k as usize];
            *in_pages = match *in_pages {
                InPages::Deformed => InPages::Deformed,
                _ if is_deformed => InPages::Deformed,
                _ => InPages::Moving,
            };
            let first = Pose { rest: old.bounds, version };
            self.poses.entry(k as usize).or_insert(first).version = version;
            let new = &self.instances[k as usize];
            let casting = [&old, new].into_iter().filter(|drawable| drawable.role.casts);
            casters.extend(casting.map(|drawable| drawable.bounds));
        }
        if !moved.instances.is_empty() {
            self.version += 1;
            self.find_bounds();
        }
        casters
    }

    /// How an instance casts into pages.
    pub(crate) fn in_pages(&self, drawable: usize) -> InPages {
        self.in_pages[drawable]
    }

    /// The instances that poses have moved or deformed, by their indices.
    pub(crate) fn poses(&self) -> impl Iterator<Item = (usize, Pose)> + '_ {
        self.poses.iter().map(|(&k, &pose)| (k, pose))
    }

    fn find_bounds(&mut self) {
        let seen = self.instances.iter().filter(|i| i.role.is_seen);
        self.bounds = seen.fold(Aabb::EMPTY, |all, i| all.union(i.bounds));
    }
}

impl Drawable {
    fn new(scene: &Scene, instance: usize, mesh_boxes: &[Aabb]) -> Self {
        let Instance { mesh, world_from_mesh } = scene.instances[instance];
        let corners = mesh_boxes[mesh].corners().map(|p| world_from_mesh.transform_point3(p));
        let bounds = if mesh_boxes[mesh].is_empty() { Aabb::EMPTY } else { Aabb::around(corners) };
        let role = scene.roles.of(instance);
        let world_from_mesh =
            world_from_mesh * DAffine3::from_translation(anchor(mesh_boxes[mesh]));
        Self { instance, mesh, world_from_mesh, bounds, role }
    }
}

/// The point of a mesh's space that its uploaded positions are relative to, metres. It is the
/// space's origin, but for meshes that lie far from it: those of a city in map coordinates, say.
/// Single precision holds their positions, but not where the viewer is among these, and the sum of
/// the two would be off by a good part of a metre.
pub(crate) fn anchor(bounds: Aabb) -> DVec3 {
    /// Largest distance from the origin, in sizes of the mesh, at which rounding does not matter.
    const FAR: f64 = 100.0;
    let distance = bounds.min.abs().max(bounds.max.abs()).max_element();
    let size = (bounds.max - bounds.min).max_element();
    match bounds.is_empty() || distance <= FAR * size {
        true => DVec3::ZERO,
        false => bounds.center(),
    }
}

/// A mesh's positions as they are uploaded. `bounds` is the box around the mesh.
fn uploaded(mesh: &Mesh, bounds: Aabb) -> impl Iterator<Item = Vec3> {
    let anchor = anchor(bounds);
    mesh.positions.iter().map(move |p| (p.as_dvec3() - anchor).as_vec3())
}

/// Adds the attributes of a mesh's vertices, as [`PLAIN`] or [`WITH_ALPHA`] lays them out.
fn push_attributes(mesh: &Mesh, has_alpha: bool, attributes: &mut Vec<u32>) {
    for i in 0..mesh.positions.len() {
        attributes.push(packed(mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO)));
        let uv = mesh.uvs.get(i).copied().unwrap_or(Vec2::ZERO);
        attributes.extend(uv.to_array().map(f32::to_bits));
        if has_alpha {
            let alpha = mesh.alphas.get(i).copied().unwrap_or(1.0);
            attributes.extend([0, alpha.to_bits()]);
        }
    }
}

/// Stands for a normal of length 0.
const NO_NORMAL: u32 = 0x8000_8000;

/// A normal as a point of an octahedron (Meyer et al. 2010), with 16 bits for each coordinate.
/// `unpacked` in `wgsl/forward.wgsl` is the inverse.
fn packed(normal: Vec3) -> u32 {
    let sum = normal.abs().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return NO_NORMAL;
    }
    let n = normal / sum;
    let folded = Vec2::new(1.0 - n.y.abs(), 1.0 - n.x.abs()) * n.truncate().signum();
    let at = if n.z < 0.0 { folded } else { n.truncate() };
    let [x, y] = at.to_array().map(|c| (c * 32_767.0).round() as i16 as u16);
    u32::from(x) | u32::from(y) << 16
}

/// Collects the materials in the order in which meshes use them.
struct Materials<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    layout: &'a BindGroupLayout,
    opaque: bool,
    textures: Vec<TextureView>,
    white: TextureView,
    list: Vec<GpuMaterial>,
    known: HashMap<(usize, bool), usize>,
}

impl<'a> Materials<'a> {
    fn new(gpu: &'a Gpu, scene: &'a Scene, layout: &'a BindGroupLayout, opaque: bool) -> Self {
        let textures = scene.textures.iter().map(|t| upload(gpu, t)).collect();
        let white = upload(gpu, &Texture::default());
        Self {
            gpu,
            scene,
            layout,
            opaque,
            textures,
            white,
            list: Vec::new(),
            known: HashMap::new(),
        }
    }

    fn index(&mut self, material: usize, has_uvs: bool) -> usize {
        if let Some(&index) = self.known.get(&(material, has_uvs)) {
            return index;
        }
        let made = self.make(&self.scene.materials[material], has_uvs);
        self.list.push(made);
        self.known.insert((material, has_uvs), self.list.len() - 1);
        self.list.len() - 1
    }

    fn make(&self, material: &Material, has_uvs: bool) -> GpuMaterial {
        let device = self.gpu.device();
        let texture = material.base_color_texture.filter(|_| has_uvs);
        let view = texture.map_or(&self.white, |id| &self.textures[id.0]);
        let wrap = texture.map_or([Wrap::default(); 2], |id| self.scene.textures[id.0].wrap);
        let [address_mode_u, address_mode_v] = wrap.map(|w| match w {
            Wrap::Repeat => AddressMode::Repeat,
            Wrap::Mirror => AddressMode::MirrorRepeat,
            Wrap::Clamp => AddressMode::ClampToEdge,
        });
        let sampling = texture.map(|id| self.scene.textures[id.0].sampling).unwrap_or_default();
        let filter = match sampling {
            Sampling::Linear => FilterMode::Linear,
            Sampling::Nearest => FilterMode::Nearest,
        };
        let sampler = device.create_sampler(&SamplerDescriptor {
            label: Some("material"),
            address_mode_u,
            address_mode_v,
            mag_filter: filter,
            min_filter: filter,
            ..SamplerDescriptor::default()
        });
        let cutoff = match material.alpha {
            Alpha::Mask { cutoff } if !self.opaque => Some(cutoff),
            _ => None,
        };
        let uniform = MaterialUniform {
            base_color: material.base_color,
            // The margin is that of `MeshCasters`, for the same reason.
            cutoff: cutoff.map_or(f32::MIN, |cutoff| cutoff * (1.0 - 8.0 * f32::EPSILON)),
            padding: [0.0; 3],
        };
        let contents = bytemuck::bytes_of(&uniform);
        let uniform = self.gpu.buffer("material", contents, BufferUsages::UNIFORM);
        let entry = |binding, resource| BindGroupEntry { binding, resource };
        let bind_group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("material"),
            layout: self.layout,
            entries: &[
                entry(0, uniform.as_entire_binding()),
                entry(1, BindingResource::TextureView(view)),
                entry(2, BindingResource::Sampler(&sampler)),
            ],
        });
        let factor = material.base_color.w;
        let mask = cutoff.map(|cutoff| GpuMask { texture: view.clone(), sampler, factor, cutoff });
        GpuMaterial { bind_group, mask }
    }
}

/// Uploads a texture. A texture without pixels becomes opaque white.
fn upload(gpu: &Gpu, texture: &Texture) -> TextureView {
    let is_whole = texture.rgba.len() as u64
        == u64::from(texture.size[0]) * u64::from(texture.size[1])
        && !texture.rgba.is_empty();
    let white = [[255; 4]];
    let (size, rgba) =
        if is_whole { (texture.size, texture.rgba.as_slice()) } else { ([1, 1], &white[..]) };
    let descriptor = TextureDescriptor {
        label: Some("base color"),
        size: Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let data = bytemuck::cast_slice(rgba);
    let order = TextureDataOrder::LayerMajor;
    let texture = gpu.device().create_texture_with_data(gpu.queue(), &descriptor, order, data);
    texture.create_view(&TextureViewDescriptor::default())
}

fn material_layout(gpu: &Gpu) -> BindGroupLayout {
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let uniform = BindingType::Buffer {
        ty: BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: true },
        view_dimension: TextureViewDimension::D2,
        multisampled: false,
    };
    gpu.device().create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("material"),
        entries: &[
            entry(0, uniform),
            entry(1, texture),
            entry(2, BindingType::Sampler(SamplerBindingType::Filtering)),
        ],
    })
}
