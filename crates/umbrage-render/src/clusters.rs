//! Scenes as clusters of triangles, from which maps and pictures take what they can tell.

use crate::pipelines::{PipelineParts, Pipelines};
use crate::renderer::shader_text;
use crate::scene::{Drawable, InPages, Placed, SceneBuffers, anchor};
use crate::view::{Tile, ViewUniform};
use crate::{Error, Gpu};
use glam::{DMat4, DVec3};
use std::collections::HashMap;
use umbrage::{Camera, Plane};
use umbrage_clusters::{Ball, ClusterMesh};
use umbrage_scene::Scene;
use umbrage_wgpu::{
    AttributeLayout, ClusterCasters, ClusterCounts, ClusterGeometry, ClusterInstance,
    ClusterOccluders, ClusterSelection, ClusterSource, ClusterVertices, ClusterView, Shadows,
};
use wgpu::{
    BindGroupLayout, CompareFunction, PipelineLayout, PipelineLayoutDescriptor, RenderPipeline,
    ShaderModule, ShaderModuleDescriptor, ShaderSource, TextureFormat,
};

/// A scene's clusters on a device.
pub(crate) struct SceneClusters {
    pub(crate) geometry: ClusterGeometry,
    /// The material of each batch of a picture; those without holes come first.
    pub(crate) materials: Vec<usize>,
    /// The number of batches without holes.
    pub(crate) opaque: u32,
    /// The material of each batch of casters with holes, which follow the one without.
    pub(crate) masked: Vec<usize>,
}

impl SceneClusters {
    /// Uploads the clusters of a scene, whose vertices are uploaded; `None` if the device has no
    /// room for them.
    pub(crate) fn new(
        gpu: &Gpu,
        scene: &Scene,
        buffers: &SceneBuffers,
        clusters: &[ClusterMesh],
    ) -> Result<Option<Self>, Error> {
        let fits = |(mesh, clusters): (&umbrage_scene::Mesh, &ClusterMesh)| {
            clusters.check(mesh.positions.len()).is_ok()
        };
        if clusters.len() != scene.meshes.len() || !scene.meshes.iter().zip(clusters).all(fits) {
            return Err(Error::Invalid {
                field: "clusters",
                problem: "must be those of the scene's meshes, and are not".into(),
            });
        }
        let placed = buffers.placed();
        let moved: Vec<Option<ClusterMesh>> = clusters
            .iter()
            .zip(&placed.mesh_boxes)
            .map(|(clusters, &bounds)| {
                let anchor = anchor(bounds);
                (anchor != DVec3::ZERO).then(|| relative_to(clusters, anchor))
            })
            .collect();
        let sources: Vec<_> = clusters
            .iter()
            .zip(&moved)
            .zip(&buffers.meshes)
            .map(|((clusters, moved), range)| ClusterSource {
                clusters: moved.as_ref().unwrap_or(clusters),
                first_vertex: range.first_vertex as u32,
            })
            .collect();
        let has_mask = |&material: &usize| buffers.materials[material].mask.is_some();
        let all = 0..buffers.materials.len();
        let (masked, opaque): (Vec<usize>, Vec<usize>) = all.partition(has_mask);
        let opaque_count = opaque.len() as u32;
        let materials: Vec<usize> = opaque.into_iter().chain(masked.iter().copied()).collect();
        let instances = instances(buffers, &placed, &materials, &masked);
        let stride = buffers.attribute_layout.array_stride as u32 / 4;
        let layout = AttributeLayout { stride, uv: Some(1), alpha: (stride > 3).then_some(4) };
        let vertices = ClusterVertices {
            positions: &buffers.positions,
            attributes: Some((&buffers.attributes, layout)),
        };
        let support = gpu.support();
        match ClusterGeometry::new(gpu.device(), &support, &sources, &instances, &vertices) {
            Ok(geometry) => Ok(Some(Self { geometry, materials, opaque: opaque_count, masked })),
            Err(umbrage_wgpu::Error::Unsupported { .. }) => Ok(None),
            Err(e) => Err(e.into()),
        }
    }

    /// Moves instances to where they are now.
    pub(crate) fn place(
        &mut self,
        gpu: &Gpu,
        buffers: &SceneBuffers,
        placed: &Placed,
    ) -> Result<(), Error> {
        let instances = instances(buffers, placed, &self.materials, &self.masked);
        Ok(self.geometry.place(gpu.queue(), &instances)?)
    }
}

impl SceneClusters {
    /// Clusters of the same meshes, with these instances alone.
    pub(crate) fn with_moving(
        &self,
        gpu: &Gpu,
        buffers: &SceneBuffers,
        placed: &Placed,
        members: &[usize],
    ) -> Result<Self, Error> {
        let instances = self.moving(buffers, placed, members);
        let geometry = self.geometry.with_instances(gpu.device(), gpu.queue(), &instances)?;
        let Self { materials, masked, opaque, .. } = self;
        let (materials, masked) = (materials.clone(), masked.clone());
        Ok(Self { geometry, materials, opaque: *opaque, masked })
    }

    /// Moves such instances to where they are now.
    pub(crate) fn place_moving(
        &mut self,
        gpu: &Gpu,
        buffers: &SceneBuffers,
        placed: &Placed,
        members: &[usize],
    ) -> Result<(), Error> {
        let instances = self.moving(buffers, placed, members);
        Ok(self.geometry.place(gpu.queue(), &instances)?)
    }

    fn moving(
        &self,
        buffers: &SceneBuffers,
        placed: &Placed,
        members: &[usize],
    ) -> Vec<ClusterInstance> {
        let members = members.iter().map(|&k| &placed.instances[k]);
        members.map(|d| instance(buffers, d, &self.materials, &self.masked)).collect()
    }
}

/// Instances where they are now, in batches of these materials: see [`SceneClusters`]. Those that
/// do not cast into pages as clusters that stand still do not cast.
fn instances(
    buffers: &SceneBuffers,
    placed: &Placed,
    materials: &[usize],
    masked: &[usize],
) -> Vec<ClusterInstance> {
    let instance = |(k, drawable): (usize, &Drawable)| {
        let instance = instance(buffers, drawable, materials, masked);
        match placed.in_pages(k) {
            InPages::AsClusters => instance,
            _ => ClusterInstance { caster_batch: None, ..instance },
        }
    };
    placed.instances.iter().enumerate().map(instance).collect()
}

fn instance(
    buffers: &SceneBuffers,
    drawable: &Drawable,
    materials: &[usize],
    masked: &[usize],
) -> ClusterInstance {
    let place = |list: &[usize], material| list.iter().position(|&m| m == material);
    let material = buffers.meshes[drawable.mesh].material;
    let of_casters = place(masked, material).map_or(0, |i| 1 + i as u32);
    let of_picture = place(materials, material).unwrap_or(0) as u32;
    ClusterInstance {
        mesh: drawable.mesh,
        world_from_mesh: drawable.world_from_mesh,
        caster_batch: drawable.role.casts.then_some(of_casters),
        seen_batch: drawable.role.is_seen.then_some(of_picture),
    }
}

/// A mesh's clusters in a space whose origin is `anchor`.
fn relative_to(clusters: &ClusterMesh, anchor: DVec3) -> ClusterMesh {
    let moved = |ball: &mut Ball| {
        let far = ball.center.abs().max_element() + ball.radius;
        ball.center = (ball.center.as_dvec3() - anchor).as_vec3();
        // What rounding at the old place may have cut off.
        ball.radius += 2.0 * f32::EPSILON * far;
    };
    let mut clusters = clusters.clone();
    for node in &mut clusters.nodes {
        moved(&mut node.bounds);
    }
    for cluster in &mut clusters.clusters {
        moved(&mut cluster.bounds);
        moved(&mut cluster.error_bounds);
    }
    clusters
}

/// How a renderer draws a scene's clusters.
pub(crate) struct ClusterDrawing {
    pub(crate) casters: ClusterCasters,
    /// What is drawn of a picture.
    pub(crate) picture: ClusterSelection,
    /// What hides parts of frames that follow one another.
    pub(crate) occluders: ClusterOccluders,
    pub(crate) hiding: Hiding,
    shader: ShaderModule,
    layout: PipelineLayout,
    /// Pipelines by the names of their fragment shaders, made at first use.
    pictures: HashMap<&'static str, Pipelines>,
    /// Draws the depths of what has no holes ahead of the picture, so that nothing is shaded that
    /// something else hides.
    pub(crate) depths: RenderPipeline,
    /// Whether the maps were drawn whole, as far as is known.
    pub(crate) is_complete: bool,
}

/// The error that is allowed in a frame to look at, pixels.
pub(crate) const FRAME_SHARE_PX: f32 = 0.5;

/// The error that is allowed in samples to measure, pixels. With that of frames, pixels at the edges
/// of surfaces show what lies behind, and half again as many shadows count as wrong, none of which is
/// the maps' fault. At a sixteenth of a pixel no difference to all triangles can be measured.
pub(crate) const SAMPLE_SHARE_PX: f32 = 1.0 / 16.0;

impl ClusterDrawing {
    pub(crate) fn new(
        gpu: &Gpu,
        clusters: &SceneClusters,
        shadows: &Shadows,
        lookup: &str,
        layouts: [&BindGroupLayout; 3],
    ) -> Result<Self, Error> {
        let device = gpu.device();
        let geometry = &clusters.geometry;
        let text = shader_text(lookup)
            + "\n"
            + &geometry.vertex_wgsl(3)
            + include_str!("wgsl/clusters.wgsl");
        let shader = device.create_shader_module(ShaderModuleDescriptor {
            label: Some("forward clusters"),
            source: ShaderSource::Wgsl(text.into()),
        });
        let [view, looked_up, material] = layouts.map(Some);
        let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label: Some("forward clusters"),
            bind_group_layouts: &[view, looked_up, material, Some(geometry.vertex_layout())],
            immediate_size: 0,
        });
        let parts = PipelineParts {
            gpu,
            module: &shader,
            layout: &layout,
            vertex: "cluster_vertex",
            buffers: &[],
        };
        let depths = parts.depths("cluster_depth");
        Ok(Self {
            casters: ClusterCasters::new(device, shadows, geometry, ClusterCasters::SHARE)?,
            picture: ClusterSelection::new(device, &gpu.support(), geometry),
            occluders: ClusterOccluders::new(device),
            hiding: Hiding::default(),
            depths,
            shader,
            layout,
            pictures: HashMap::new(),
            is_complete: true,
        })
    }

    /// The pipelines with the fragment shaders `opaque_NAME`, `masked_NAME` and `sky_NAME`.
    pub(crate) fn pipelines(
        &mut self,
        gpu: &Gpu,
        name: &'static str,
        formats: &[TextureFormat],
    ) -> Pipelines {
        let Self { shader, layout, pictures, .. } = self;
        let parts =
            PipelineParts { gpu, module: shader, layout, vertex: "cluster_vertex", buffers: &[] };
        let made = || parts.pipelines(name, formats, CompareFunction::Equal);
        pictures.entry(name).or_insert_with(made).clone()
    }
}

/// Whether it pays to look for what is hidden, for which the last frame is drawn once more.
#[derive(Debug, Default)]
pub(crate) struct Hiding {
    pub(crate) is_sought: bool,
    /// Triangles of the last frame in which nothing was sought.
    all: u64,
    /// Triangles of the first frame in which it was found to pay.
    found: Option<u64>,
    /// Frames to come until it is tried again.
    wait: u32,
}

impl Hiding {
    /// Frames between trials where it does not pay.
    const PAUSE: u32 = 32;

    /// Takes in the newest counts.
    pub(crate) fn learn(&mut self, counts: ClusterCounts) {
        // Counts of a frame before the last change come late.
        if !counts.is_complete || counts.has_occluders != self.is_sought {
            return;
        }
        let triangles = counts.triangles;
        if !self.is_sought {
            self.all = triangles;
            self.is_sought = self.wait == 0;
            self.found = None;
            self.wait = self.wait.saturating_sub(1);
            return;
        }
        match self.found {
            // A fifth of the triangles is about what the pass for them costs.
            None if 5 * triangles > 4 * self.all => {
                *self = Self { wait: Self::PAUSE, ..Self::default() };
            }
            None => self.found = Some(triangles),
            // The view has opened, and all may be seen now.
            Some(found) if 2 * triangles > 3 * found => *self = Self::default(),
            Some(_) => {}
        }
    }
}

/// What a tile of a picture shows.
pub(crate) fn picture_view(
    camera: &Camera,
    tile: &Tile,
    view: &ViewUniform,
    planes: &[Plane],
    share_px: f32,
) -> Result<ClusterView, Error> {
    let m = view.clip_from_render.as_dmat4();
    let [width, height] = tile.size.map(f64::from);
    let w = m.row(3);
    let rows = [(m.row(0) + w) * (0.5 * width), (w - m.row(1)) * (0.5 * height), m.row(2), w];
    let samples_from_render = DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
    let nearest = if camera.is_orthographic() { 1.0 } else { camera.near() };
    let share = share_px * tile.grid as f32;
    let of_render =
        |plane: &Plane| Plane { offset: plane.offset + plane.normal.dot(camera.eye()), ..*plane };
    let planes: Vec<Plane> = planes.iter().map(of_render).collect();
    Ok(ClusterView::picture(samples_from_render, tile.size, nearest, &planes, share)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of a view with so many triangles, of which a share is hidden, with counts that come
    /// back a frame late. Returns in how many it was sought what is hidden.
    fn frames(hiding: &mut Hiding, count: u32, all: u64, hidden: f64) -> u32 {
        let (mut sought, mut late) = (0, None);
        for _ in 0..count {
            let has_occluders = hiding.is_sought;
            sought += u32::from(has_occluders);
            let seen = if has_occluders { 1.0 - hidden } else { 1.0 };
            let triangles = (all as f64 * seen) as u64;
            let (clusters, relief) = (triangles / 64, 1.0);
            let counts =
                ClusterCounts { triangles, clusters, is_complete: true, has_occluders, relief };
            late.replace(counts).into_iter().for_each(|counts| hiding.learn(counts));
        }
        sought
    }

    #[test]
    fn what_is_hidden_is_sought_where_it_pays() {
        let mut hiding = Hiding::default();
        assert!(frames(&mut hiding, 300, 1_000_000, 0.6) > 295);
        // The view opens, and nothing is hidden any more.
        let sought = frames(&mut hiding, 300, 1_000_000, 0.05);
        assert!((5..40).contains(&sought), "{sought}");
        assert!(frames(&mut hiding, 300, 1_000_000, 0.6) > 260);
    }
}
