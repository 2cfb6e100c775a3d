use super::pipelines::triangles_pipeline;
use super::{Pages, check_pages};
use crate::clusters::{ForPages, check_share};
use crate::{
    ClusterCounts, ClusterGeometry, ClusterSelection, ClusterView, Error, Mask, MeshCasters,
    MeshKind, Shadows, wgsl,
};
use glam::DVec3;
use wgpu::{
    BindGroup, CommandEncoder, ComputePassTimestampWrites, ComputePipeline, Device, Queue,
    RenderPass,
};

/// Draws clusters into pages: in each page, for each of its places, as many triangles as its texels
/// can tell from the whole mesh. As [`ClusterCasters`](crate::ClusterCasters) does for maps, and
/// with the same [bias](crate::ClusterCasters::bias).
#[derive(Debug)]
pub struct PageCasters {
    /// Without and with masks, for triangles inside their pages and for others.
    inside: [MeshCasters; 2],
    across: [MeshCasters; 2],
    selection: ClusterSelection,
    /// Finds the triangles of chosen clusters that pages show.
    triangles: ComputePipeline,
    share: f32,
    caster_batches: u32,
}

impl PageCasters {
    /// Makes the pipelines that draw a geometry's clusters into pages. `share` is the part of a
    /// texel by which casters may be off, at least 0; with 0 all casters have all of their detail.
    ///
    /// # Errors
    /// As for [`ClusterCasters::new`](crate::ClusterCasters::new), and [`Error::Invalid`] if the
    /// shadows have no pages.
    pub fn new(
        device: &Device,
        shadows: &Shadows,
        geometry: &ClusterGeometry,
        share: f32,
    ) -> Result<Self, Error> {
        check_share(shadows, share)?;
        let pages = check_pages(shadows)?;
        let (support, filter) = (shadows.support(), &shadows.options().filter);
        let casters = |are_inside| {
            [MeshKind::Opaque, MeshKind::Masked].map(|kind| {
                let is_masked = kind == MeshKind::Masked;
                let text =
                    wgsl::page_caster(support, filter, geometry.layout, is_masked, are_inside);
                let layout = Pages::draw_layout(pages);
                MeshCasters::of_pages(device, shadows, kind, text, are_inside, layout, geometry)
            })
        };
        Ok(Self {
            inside: casters(true),
            across: casters(false),
            selection: ClusterSelection::new(device, support, geometry),
            triangles: triangles_pipeline(device, filter, geometry),
            share,
            caster_batches: geometry.caster_batches,
        })
    }

    /// The same for [other instances](ClusterGeometry::with_instances) of the geometry's meshes, with
    /// the same pipelines.
    pub fn for_instances(
        &self,
        device: &Device,
        shadows: &Shadows,
        geometry: &ClusterGeometry,
    ) -> Self {
        Self {
            inside: self.inside.clone(),
            across: self.across.clone(),
            selection: ClusterSelection::new(device, shadows.support(), geometry),
            triangles: self.triangles.clone(),
            share: self.share,
            caster_batches: geometry.caster_batches,
        }
    }

    /// The part of a texel by which casters may be off.
    pub fn share(&self) -> f32 {
        self.share
    }

    #[expect(clippy::too_many_arguments, reason = "device, queue and encoder are one in spirit")]
    pub(super) fn choose(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        geometry: &ClusterGeometry,
        views: &[ClusterView],
        render_origin: DVec3,
        shown: &BindGroup,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) -> Result<(), Error> {
        let to = (device, queue, encoder);
        let pages = ForPages { shown, triangles: &self.triangles };
        self.selection.encode_pages(to, geometry, views, render_origin, &pages, timestamps)
    }

    /// Draws what was chosen, into a pass whose pages are bound. Returns the number of draws.
    pub(super) fn draw(&self, pass: &mut RenderPass<'_>, masks: &[Option<&BindGroup>]) -> u32 {
        let mask_of = |batch: u32| masks.get(batch as usize).copied().flatten();
        let count = self.caster_batches;
        let inside = self.selection.draw_batches(pass, self.inside.each_ref(), 0..count, mask_of);
        let of_batch = |draw| mask_of(draw - count);
        let across = count..2 * count;
        inside + self.selection.draw_batches(pass, self.across.each_ref(), across, of_batch)
    }

    /// The bind group of a mask.
    pub fn mask(&self, device: &Device, queue: &Queue, mask: &Mask<'_>) -> Option<BindGroup> {
        self.inside[1].mask(device, queue, mask)
    }

    /// What was chosen last, as far as the device has told; `None` while the last choice is under
    /// way. Where it was [not complete](ClusterCounts::is_complete), casters are missing from pages:
    /// draw them again with [`Casters::Moved`](crate::Casters::Moved).
    pub fn counts(&mut self, device: &Device) -> Option<ClusterCounts> {
        let counts = self.selection.counts(device);
        self.selection.is_counted().then_some(counts)
    }
}
