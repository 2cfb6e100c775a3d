use super::data::{self, Lists};
use super::view::stretch;
use super::{occluders, tree};
use crate::{Error, Support, wgsl};
use glam::{DAffine3, DVec3};
use std::mem::size_of_val;
use umbrage_clusters::{Ball, ClusterMesh};
use wgpu::util::DeviceExt;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, ComputePipeline, ComputePipelineDescriptor, Device,
    PipelineCompilationOptions, PipelineLayoutDescriptor, Queue, ShaderModuleDescriptor,
    ShaderSource, ShaderStages, StorageTextureAccess, TextureFormat, TextureSampleType,
    TextureViewDescriptor, TextureViewDimension,
};

/// Meshes as clusters, and instances of them, on a device. Vertices stay in your own buffers.
#[derive(Debug)]
pub struct ClusterGeometry {
    pub(crate) nodes: Buffer,
    pub(crate) clusters: Buffer,
    pub(crate) vertices: Buffer,
    pub(crate) triangles: Buffer,
    pub(crate) instances: Buffer,
    pub(crate) positions: Buffer,
    pub(crate) attributes: Buffer,
    pub(crate) layout: AttributeLayout,
    /// World position that all instances are relative to, metres.
    pub(crate) origin: DVec3,
    /// The first node of the tree over instances.
    pub(crate) root: u32,
    /// The number of rounds from that node to the last cluster.
    pub(crate) rounds: u32,
    /// The number of instances that have triangles.
    instance_count: usize,
    /// For each mesh its first node and the ball around it; `None` without triangles.
    roots: Vec<Option<(u32, Ball)>>,
    /// The nodes of all meshes, which come before those over instances.
    mesh_nodes: u32,
    mesh_rounds: u32,
    /// The greatest number of triangles that a view can choose.
    pub(crate) most_triangles: u64,
    pub(crate) seen_batches: u32,
    pub(crate) caster_batches: u32,
    pub(crate) pipelines: Pipelines,
    /// With which clusters are chosen where nothing hides any.
    pub(crate) nothing_hides: BindGroup,
    /// How often instances were placed.
    pub(crate) placements: u64,
}

/// A mesh of a [`ClusterGeometry`].
#[derive(Clone, Copy, Debug)]
pub struct ClusterSource<'a> {
    /// The clusters.
    pub clusters: &'a ClusterMesh,
    /// The place of the mesh's first vertex in the vertex buffers.
    pub first_vertex: u32,
}

/// An instance of a mesh of a [`ClusterGeometry`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterInstance {
    /// Index of the mesh.
    pub mesh: usize,
    /// Transform from mesh space to world space, metres.
    pub world_from_mesh: DAffine3,
    /// Whether the instance casts shadows, and the batch among which it is then drawn.
    pub caster_batch: Option<u32>,
    /// Whether pictures show the instance, and the batch among which it is then drawn.
    pub seen_batch: Option<u32>,
}

/// The vertices of all meshes, in buffers with the usage `STORAGE`.
#[derive(Clone, Copy, Debug)]
pub struct ClusterVertices<'a> {
    /// Positions in mesh space: three floats each, without padding.
    pub positions: &'a Buffer,
    /// What else vertices have.
    pub attributes: Option<(&'a Buffer, AttributeLayout)>,
}

/// How the attributes of a vertex are laid out, in words of four bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttributeLayout {
    /// The number of words of a vertex.
    pub stride: u32,
    /// The first of two words with texture coordinates (floats), which masked casters need.
    pub uv: Option<u32>,
    /// The word with the vertex's alpha (a float).
    pub alpha: Option<u32>,
}

/// The pipelines that choose clusters.
#[derive(Clone, Debug)]
pub(crate) struct Pipelines {
    pub(crate) descend: ComputePipeline,
    /// `None` if the device has no pages.
    pub(crate) descend_pages: Option<ComputePipeline>,
    pub(crate) draws: ComputePipeline,
    pub(crate) indices: ComputePipeline,
    pub(crate) occluders: ComputePipeline,
    pub(crate) farther: ComputePipeline,
    pub(crate) descent_layout: BindGroupLayout,
    pub(crate) round_layout: BindGroupLayout,
    pub(crate) draws_layout: BindGroupLayout,
    pub(crate) indices_layout: BindGroupLayout,
    /// Of the pass that writes indices for pages.
    pub(crate) triangles_layout: BindGroupLayout,
    pub(crate) vertex_layout: BindGroupLayout,
    pub(crate) hidden_layout: BindGroupLayout,
    pub(crate) shown_layout: BindGroupLayout,
    pub(crate) occluders_layout: BindGroupLayout,
    pub(crate) farther_layout: BindGroupLayout,
}

impl ClusterGeometry {
    /// Uploads meshes and instances.
    ///
    /// # Errors
    /// - [`Error::Unsupported`] if the device lacks what clusters need (see [`Support::clusters`]),
    ///   or if a buffer would be larger than it can bind.
    /// - [`Error::Invalid`] if an instance names a mesh that there is not, or if its transform is
    ///   not finite.
    pub fn new(
        device: &Device,
        support: &Support,
        meshes: &[ClusterSource<'_>],
        instances: &[ClusterInstance],
        vertices: &ClusterVertices<'_>,
    ) -> Result<Self, Error> {
        if !support.clusters {
            return Err(Error::Unsupported {
                what: "storage buffers in vertex shaders, or ten of them in compute shaders",
                why: "by which clusters are chosen and drawn: take `MeshCasters`",
            });
        }
        let mut lists = Lists::default();
        let mut roots = Vec::with_capacity(meshes.len());
        let mut mesh_rounds = 1;
        let mut finest = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            let begin = lists.nodes.len();
            let root = lists.add(mesh.clusters, mesh.first_vertex);
            let ball = mesh.clusters.nodes.first().map(|node| (root, node.bounds));
            let own = &lists.nodes[begin..];
            mesh_rounds = mesh_rounds.max(tree::depth(own, root, data::NODES));
            let of_mesh = mesh.clusters.clusters.iter().filter(|c| c.level == 0);
            finest.push(of_mesh.map(|c| u64::from(c.triangle_count)).sum::<u64>());
            roots.push(ball);
        }
        // Shaders read the bytes of a triangle from two words.
        while !(lists.triangles.len() * 3).is_multiple_of(4) || lists.triangles.is_empty() {
            lists.triangles.push([0; 3]);
        }
        lists.triangles.extend([[0; 3]; 4]);
        let mesh_nodes = lists.nodes.len() as u32;
        let most_triangles = instances.iter().map(|i| finest.get(i.mesh).copied().unwrap_or(0));
        let most_triangles = most_triangles.sum();
        let placed = Placed::new(instances, &roots, mesh_nodes, None)?;
        lists.nodes.extend_from_slice(&placed.nodes);
        let limits = device.limits();
        let largest = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let sizes = [
            size_of_val(&*lists.nodes) as u64,
            size_of_val(&*lists.clusters) as u64,
            size_of_val(&*lists.vertices) as u64,
            size_of_val(&*lists.triangles) as u64,
            size_of_val(&*placed.data) as u64,
            vertices.positions.size(),
            vertices.attributes.map_or(0, |(buffer, _)| buffer.size()),
        ];
        if sizes.iter().any(|&size| size > largest) {
            return Err(Error::Unsupported {
                what: "room for these clusters in one storage buffer",
                why: "in which shaders read them: take `MeshCasters`, or smaller meshes",
            });
        }
        let (attributes, layout) = match vertices.attributes {
            Some((buffer, layout)) => (buffer.clone(), layout),
            None => (buffer(device, &[0u32; 4], BufferUsages::STORAGE), AttributeLayout::default()),
        };
        let batches = |batch: fn(&ClusterInstance) -> Option<u32>| {
            instances.iter().filter_map(batch).max().map_or(0, |last| last + 1)
        };
        let seen_batches = batches(|i| i.seen_batch);
        let caster_batches = batches(|i| i.caster_batch);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let pipelines = Pipelines::new(device, support);
        Ok(Self {
            nodes: buffer(device, &lists.nodes, usage),
            clusters: buffer(device, &lists.clusters, BufferUsages::STORAGE),
            vertices: buffer(device, &lists.vertices, BufferUsages::STORAGE),
            triangles: buffer(device, lists.triangles.as_flattened(), BufferUsages::STORAGE),
            instances: buffer(device, &placed.data, usage),
            positions: match vertices.positions.size() {
                0 => buffer(device, &[0.0f32; 3], BufferUsages::STORAGE),
                _ => vertices.positions.clone(),
            },
            attributes,
            layout,
            origin: placed.origin,
            root: mesh_nodes,
            rounds: placed.rounds + mesh_rounds,
            instance_count: placed.data.len(),
            roots,
            mesh_nodes,
            mesh_rounds,
            most_triangles,
            seen_batches,
            caster_batches,
            nothing_hides: nothing_hides(device, &pipelines),
            pipelines,
            placements: 0,
        })
    }

    /// Other instances of the same meshes, which share the clusters on the device. Their batches are
    /// among those of this geometry's instances. So what moves can be
    /// [placed](Self::place) in every frame without what stands still.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn with_instances(
        &self,
        device: &Device,
        queue: &Queue,
        instances: &[ClusterInstance],
    ) -> Result<Self, Error> {
        let placed = Placed::new(instances, &self.roots, self.mesh_nodes, None)?;
        let node = size_of::<data::Node>() as u64;
        let of_meshes = u64::from(self.mesh_nodes) * node;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let nodes = device.create_buffer(&BufferDescriptor {
            label: Some("shadow clusters"),
            size: of_meshes + placed.nodes.len() as u64 * node,
            usage,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&self.nodes, 0, &nodes, 0, of_meshes);
        queue.submit([encoder.finish()]);
        queue.write_buffer(&nodes, of_meshes, bytemuck::cast_slice(&placed.nodes));
        Ok(Self {
            nodes,
            clusters: self.clusters.clone(),
            vertices: self.vertices.clone(),
            triangles: self.triangles.clone(),
            instances: buffer(device, &placed.data, usage),
            positions: self.positions.clone(),
            attributes: self.attributes.clone(),
            origin: placed.origin,
            rounds: placed.rounds + self.mesh_rounds,
            instance_count: placed.data.len(),
            roots: self.roots.clone(),
            pipelines: self.pipelines.clone(),
            nothing_hides: self.nothing_hides.clone(),
            placements: 0,
            ..*self
        })
    }

    /// Moves instances: the same ones as were given to [`new`](Self::new), in the same order and of
    /// the same meshes, with the same batches. The tree over them is made anew.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they are others, or if a transform is not finite.
    pub fn place(&mut self, queue: &Queue, instances: &[ClusterInstance]) -> Result<(), Error> {
        // With another origin, rounding would move what stands still.
        let placed = Placed::new(instances, &self.roots, self.mesh_nodes, Some(self.origin))?;
        if placed.data.len() != self.instance_count {
            return Err(Error::Invalid {
                field: "instances",
                problem: format!(
                    "must be the {} that were uploaded, are {}",
                    self.instance_count,
                    placed.data.len()
                ),
            });
        }
        let begin = u64::from(self.mesh_nodes) * size_of::<data::Node>() as u64;
        queue.write_buffer(&self.nodes, begin, bytemuck::cast_slice(&placed.nodes));
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&placed.data));
        self.rounds = placed.rounds + self.mesh_rounds;
        self.placements += 1;
        Ok(())
    }

    /// The layout of the bind group with which vertex stages read chosen clusters: see
    /// [`ClusterSelection::vertex_group`](super::ClusterSelection::vertex_group).
    pub fn vertex_layout(&self) -> &BindGroupLayout {
        &self.pipelines.vertex_layout
    }

    /// WGSL text for vertex stages that draw chosen clusters, with its bindings in bind group
    /// `group`. It declares
    ///
    /// ```wgsl
    /// fn shadow_cluster_vertex(index: u32) -> ShadowClusterVertex
    /// fn shadow_cluster_attribute(vertex: u32, word: u32) -> u32
    /// ```
    ///
    /// where `index` is the `vertex_index`. The struct has the `position` in render space, the
    /// index `vertex` in your vertex buffers, the `instance` in `shadow_cluster_instances`, whose
    /// members `x`, `y` and `z` are the rows of its matrix, and the cluster's number and level.
    pub fn vertex_wgsl(&self, group: u32) -> String {
        wgsl::cluster_vertex(group, self.layout)
    }

    /// Memory on the device, without that of your vertex buffers, bytes.
    pub fn bytes(&self) -> u64 {
        let buffers =
            [&self.nodes, &self.clusters, &self.vertices, &self.triangles, &self.instances];
        buffers.into_iter().map(Buffer::size).sum()
    }
}

/// Instances in the order of the tree over them.
struct Placed {
    data: Vec<data::Instance>,
    nodes: Vec<data::Node>,
    origin: DVec3,
    rounds: u32,
}

impl Placed {
    fn new(
        instances: &[ClusterInstance],
        roots: &[Option<(u32, Ball)>],
        first_node: u32,
        origin: Option<DVec3>,
    ) -> Result<Self, Error> {
        let invalid = |i: usize, problem: String| Error::Invalid {
            field: "instances",
            problem: format!("instance {i} {problem}"),
        };
        let mut placed = Vec::with_capacity(instances.len());
        let [mut min, mut max] = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for (i, instance) in instances.iter().enumerate() {
            let Some(root) = roots.get(instance.mesh) else {
                return Err(invalid(
                    i,
                    format!("is of mesh {}, which there is not", instance.mesh),
                ));
            };
            if !instance.world_from_mesh.is_finite() {
                return Err(invalid(i, "has a transform that is not finite".into()));
            }
            let Some((root, ball)) = *root else { continue };
            let center = instance.world_from_mesh.transform_point3(ball.center.as_dvec3());
            let stretch = stretch(instance.world_from_mesh.matrix3);
            min = min.min(center);
            max = max.max(center);
            placed.push((i, root, center, f64::from(ball.radius) * stretch, stretch));
        }
        let middle = if placed.is_empty() { DVec3::ZERO } else { 0.5 * (min + max) };
        let origin = origin.unwrap_or(middle);
        let balls: Vec<Ball> = placed
            .iter()
            .map(|&(_, _, center, radius, _)| {
                let local = (center - origin).as_vec3();
                // Rounding must not cut anything off.
                let slack = f64::from(local.abs().max_element()) * f64::from(f32::EPSILON);
                Ball { center: local, radius: ((radius + slack) * (1.0 + 1e-5)) as f32 }
            })
            .collect();
        let (order, nodes) = tree::tree(&balls, first_node);
        let mut data = Vec::with_capacity(placed.len());
        for &k in &order {
            let (i, root, _, _, stretch) = placed[k as usize];
            let instance = &instances[i];
            let m = instance.world_from_mesh.matrix3;
            let [high, low] = data::split(instance.world_from_mesh.translation - origin);
            let role = |is: bool, bit| if is { bit } else { 0 };
            data.push(data::Instance {
                rows: [0, 1, 2].map(|r| m.row(r).as_vec3().extend(high[r])),
                low,
                // A bound even after rounding.
                stretch: (stretch * (1.0 + 1e-6)) as f32,
                root,
                roles: role(instance.caster_batch.is_some(), data::CASTS)
                    | role(instance.seen_batch.is_some(), data::SEEN),
                caster_batch: instance.caster_batch.unwrap_or(0),
                seen_batch: instance.seen_batch.unwrap_or(0),
            });
        }
        if data.is_empty() {
            data.push(data::Instance::default());
        }
        let rounds = tree::depth(&nodes, first_node, data::NODES_OF_INSTANCES);
        Ok(Self { data, nodes, origin, rounds })
    }
}

/// A buffer with these contents, or with one element of zeros if there are none.
pub(crate) fn buffer<T: bytemuck::Pod>(
    device: &Device,
    contents: &[T],
    usage: BufferUsages,
) -> Buffer {
    let zero = [T::zeroed()];
    let contents = if contents.is_empty() { &zero[..] } else { contents };
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("shadow clusters"),
        contents: bytemuck::cast_slice(contents),
        usage,
    })
}

fn nothing_hides(device: &Device, pipelines: &Pipelines) -> BindGroup {
    let distances = occluders::pyramid(device, [1, 1], 1);
    let none = buffer(device, &[data::Occluders::default()], BufferUsages::UNIFORM);
    let view = distances.create_view(&TextureViewDescriptor::default());
    device.create_bind_group(&BindGroupDescriptor {
        label: Some("cluster occluders"),
        layout: &pipelines.hidden_layout,
        entries: &[
            BindGroupEntry { binding: 0, resource: none.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&view) },
        ],
    })
}

impl Pipelines {
    fn new(device: &Device, support: &Support) -> Self {
        use BufferBindingType::Uniform;
        const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
        const WRITTEN: BufferBindingType = BufferBindingType::Storage { read_only: false };
        let layout = |visibility, types: &[BufferBindingType], is_dynamic| {
            let entries = (0..).zip(types).map(|(binding, &ty)| BindGroupLayoutEntry {
                binding,
                visibility,
                ty: BindingType::Buffer {
                    ty,
                    has_dynamic_offset: is_dynamic && binding == 0,
                    min_binding_size: None,
                },
                count: None,
            });
            device.create_bind_group_layout(&BindGroupLayoutDescriptor {
                label: Some("shadow clusters"),
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let compute = ShaderStages::COMPUTE;
        let descent_layout =
            layout(compute, &[Uniform, READ, READ, READ, READ, READ, WRITTEN, WRITTEN], false);
        let round_layout = layout(compute, &[Uniform, READ, WRITTEN, WRITTEN], true);
        let draws_layout =
            layout(compute, &[Uniform, WRITTEN, WRITTEN, WRITTEN, READ, WRITTEN], false);
        let indices_layout =
            layout(compute, &[Uniform, READ, READ, READ, READ, READ, WRITTEN, WRITTEN], false);
        let of_indices = [Uniform, WRITTEN, READ, READ, READ, READ, WRITTEN, WRITTEN];
        let of_triangles = [&of_indices[..], &[WRITTEN, READ, READ]].concat();
        let triangles_layout = layout(compute, &of_triangles, false);
        let shown_layout = layout(compute, &[READ], false);
        let vertex_layout =
            layout(ShaderStages::VERTEX, &[Uniform, READ, READ, READ, READ, READ], false);
        let of_types = |types: &[BindingType]| {
            let entries = (0..).zip(types).map(|(binding, &ty)| BindGroupLayoutEntry {
                binding,
                visibility: compute,
                ty,
                count: None,
            });
            device.create_bind_group_layout(&BindGroupLayoutDescriptor {
                label: Some("cluster occluders"),
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let uniform =
            BindingType::Buffer { ty: Uniform, has_dynamic_offset: false, min_binding_size: None };
        let texture = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        let distances = texture(TextureSampleType::Float { filterable: false });
        let written = BindingType::StorageTexture {
            access: StorageTextureAccess::WriteOnly,
            format: TextureFormat::R32Float,
            view_dimension: TextureViewDimension::D2,
        };
        let hidden_layout = of_types(&[uniform, distances]);
        let occluders_layout = of_types(&[texture(TextureSampleType::Depth), uniform, written]);
        let farther_layout = of_types(&[distances, written]);
        let pipeline = |text: String, layouts: &[Option<&BindGroupLayout>]| {
            let module = device.create_shader_module(ShaderModuleDescriptor {
                label: Some("shadow clusters"),
                source: ShaderSource::Wgsl(text.into()),
            });
            let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
                label: Some("shadow clusters"),
                bind_group_layouts: layouts,
                immediate_size: 0,
            });
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some("shadow clusters"),
                layout: Some(&layout),
                module: &module,
                entry_point: None,
                compilation_options: PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        let of_descent = [Some(&descent_layout), Some(&round_layout), Some(&hidden_layout)];
        let [first, second, third] = of_descent;
        let of_pages = [first, second, third, Some(&shown_layout)];
        let for_pages = || pipeline(wgsl::cluster_descent(true), &of_pages);
        Self {
            descend: pipeline(wgsl::cluster_descent(false), &of_descent),
            descend_pages: support.pages.then(for_pages),
            shown_layout: shown_layout.clone(),
            draws: pipeline(wgsl::cluster_draws(), &[Some(&draws_layout)]),
            indices: pipeline(wgsl::cluster_indices(), &[Some(&indices_layout)]),
            occluders: pipeline(wgsl::cluster_occluders(), &[Some(&occluders_layout)]),
            farther: pipeline(wgsl::cluster_farther(), &[Some(&farther_layout)]),
            descent_layout,
            round_layout,
            draws_layout,
            indices_layout,
            triangles_layout,
            vertex_layout,
            hidden_layout,
            occluders_layout,
            farther_layout,
        }
    }
}
