use umbrage_clusters::{ClusterMesh, MeshInput, build_all};
use umbrage_wgpu::{
    Casters, ClusterCasters, ClusterGeometry, ClusterInstance, ClusterSource, ClusterVertices,
    Error, Frame, Shadows, Support, Timestamps,
};

/// A static model: its triangles, and where it stands.
pub struct Model {
    pub positions: Vec<glam::Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub world_from_mesh: Vec<glam::DAffine3>,
}

/// Models of any number of triangles, which are drawn into maps in levels of detail.
pub struct HugeModels {
    geometry: ClusterGeometry,
    casters: ClusterCasters,
    was_cut: bool,
}

impl HugeModels {
    /// Makes the clusters, which takes seconds for a million triangles: `umbrage_clusters::write`
    /// keeps them in a file. `positions` has those of all models, one after the other, with the
    /// usages `VERTEX` and `STORAGE`.
    pub fn new(
        device: &wgpu::Device,
        support: &Support,
        shadows: &mut Shadows,
        models: &[Model],
        positions: &wgpu::Buffer,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let inputs: Vec<MeshInput<'_>> = models
            .iter()
            .map(|model| MeshInput {
                positions: &model.positions,
                normals: &[],
                uvs: &[],
                triangles: &model.triangles,
                is_masked: false,
            })
            .collect();
        let clusters: Vec<ClusterMesh> = build_all(&inputs, &|_triangles_done| ())?;
        let mut first_vertex = 0;
        let (mut sources, mut instances) = (Vec::new(), Vec::new());
        for (mesh, (model, clusters)) in models.iter().zip(&clusters).enumerate() {
            sources.push(ClusterSource { clusters, first_vertex });
            first_vertex += model.positions.len() as u32;
            instances.extend(model.world_from_mesh.iter().map(|&world_from_mesh| {
                // Batches share a draw: one is enough where no model has holes.
                ClusterInstance { mesh, world_from_mesh, caster_batch: Some(0), seen_batch: None }
            }));
        }
        let vertices = ClusterVertices { positions, attributes: None };
        let geometry = ClusterGeometry::new(device, support, &sources, &instances, &vertices)?;
        let share = ClusterCasters::SHARE;
        shadows.set_bias(ClusterCasters::bias(share))?;
        let casters = ClusterCasters::new(device, shadows, &geometry, share)?;
        Ok(Self { geometry, casters, was_cut: false })
    }

    /// Chooses clusters for all maps that are out of date, and draws them.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        shadows: &mut Shadows,
        frame: &Frame<'_>,
    ) -> Result<(), Error> {
        // The device tells a frame or two later whether there was room for all that it chose. If
        // not, there is now, and the maps are drawn again.
        self.was_cut |= self.casters.counts(device).is_some_and(|counts| !counts.is_complete);
        let mut frame = *frame;
        if std::mem::take(&mut self.was_cut) {
            frame.casters = Casters::Moved;
        }
        let prepared = shadows.prepare(device, queue, &frame)?;
        self.casters.choose(device, queue, encoder, &self.geometry, &prepared, None)?;
        prepared.encode(encoder, &Timestamps::default(), |map| {
            self.casters.draw(map, |_batch| None);
        });
        Ok(())
    }
}
