use glam::{DAffine3, DVec3};
use std::error::Error;
use std::ops::Range;
use umbrage::paged::AgingLights;
use umbrage::{Aabb, Bounds, Camera, Light, Planner, Technique};
use umbrage_wgpu::{
    Casters, DepthProjection, MeshCasters, MeshKind, PageFrame, PageMesh, PageMeshDraw,
    PageMeshPart, PageMeshPass, PageMeshes, PageParts, PageTimestamps, ShadowOptions, Shadows,
    Support,
};

/// A mesh in the index buffer, and where it stands.
#[derive(Clone)]
pub struct Model {
    pub indices: Range<u32>,
    pub world_from_mesh: DAffine3,
    /// World space.
    pub bounds: Aabb,
}

/// Paged maps of whole meshes, some of which move, under lights that may move too.
pub struct PagedShadows {
    technique: Technique,
    planner: Planner,
    aging: AgingLights,
    pub shadows: Shadows,
    pipeline: MeshCasters,
    still: PageMeshes,
    moving: PageMeshes,
    /// The boxes of what moves, in the last frame and in this one.
    boxes: Vec<Aabb>,
    was_cut: bool,
}

impl PagedShadows {
    /// `positions` is the layout of the vertex buffer, with the position at shader location 0. The
    /// pages of lights that move are renewed over 30 frames.
    pub fn new(
        device: &wgpu::Device,
        support: Support,
        technique: Technique,
        positions: wgpu::VertexBufferLayout<'_>,
        still: &[Model],
    ) -> Result<Self, umbrage_wgpu::Error> {
        let filter = technique.filter;
        let options =
            ShadowOptions { filter, pages: true, pages_apart: true, ..ShadowOptions::default() };
        let shadows = Shadows::new(device, support, &options)?;
        let kind = MeshKind::Opaque;
        let pipeline = MeshCasters::for_pages(device, &shadows, kind, &[Some(positions)])?;
        let mut paged = Self {
            technique,
            planner: Planner::with_limits(support.limits()),
            aging: AgingLights::new(30),
            pipeline,
            still: PageMeshes::new(device, &shadows)?,
            moving: PageMeshes::new(device, &shadows)?,
            shadows,
            boxes: Vec::new(),
            was_cut: false,
        };
        add(&mut paged.still, still);
        Ok(paged)
    }

    /// Finds the pages that the viewer's depths want, and draws those that are new or out of date.
    /// `moving` are this frame's models that move. Encode this behind the pass that draws `depths`.
    pub fn draw(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        (camera, lights, moving): (&Camera, &[Light], &[Model]),
        (depths, projection): (&wgpu::TextureView, DepthProjection),
        (vertices, indices): (&wgpu::Buffer, &wgpu::Buffer),
    ) -> Result<(), Box<dyn Error>> {
        self.aging.advance(lights)?;
        let bounds = Bounds::default();
        let plan = self.planner.plan_aging(camera, &self.aging, &bounds, &self.technique)?;
        // The boxes of the last frame are at the front.
        self.boxes.extend(moving.iter().map(|model| model.bounds));
        self.moving.clear();
        add(&mut self.moving, moving);
        let lists = [&mut self.still, &mut self.moving];
        self.was_cut |= lists.into_iter().any(|list| !list.counts(device).is_complete);
        let was_cut = std::mem::take(&mut self.was_cut);
        let frame = PageFrame {
            plan,
            render_origin: DVec3::ZERO,
            casters: if was_cut { Casters::Moved } else { Casters::Unmoved },
            moving: Casters::MovedIn(&self.boxes),
            depth: depths,
            projection,
        };
        let prepared = self.shadows.prepare_pages(device, queue, &frame)?;
        let pipeline = self.pipeline.pipeline();
        let draw = |pass: &mut PageMeshPass<'_, '_>| {
            pass.pass.set_pipeline(pipeline);
            pass.pass.set_vertex_buffer(0, vertices.slice(..));
            pass.pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            for number in 0..pass.draws() {
                pass.draw(number);
            }
        };
        let parts = PageParts {
            still: Some(PageMeshPart { meshes: &mut self.still, draw: &draw }),
            moving: Some(PageMeshPart { meshes: &mut self.moving, draw: &draw }),
            ..PageParts::default()
        };
        prepared.encode(device, queue, encoder, parts, PageTimestamps::default())?;
        self.boxes.clear();
        self.boxes.extend(moving.iter().map(|model| model.bounds));
        Ok(())
    }
}

fn add(meshes: &mut PageMeshes, models: &[Model]) {
    for Model { indices, world_from_mesh, bounds } in models {
        let draw = PageMeshDraw { indices: indices.clone(), base_vertex: 0, light: None };
        let (world_from_mesh, bounds) = (*world_from_mesh, *bounds);
        meshes.add(draw, [PageMesh { world_from_mesh, bounds }]);
    }
}
