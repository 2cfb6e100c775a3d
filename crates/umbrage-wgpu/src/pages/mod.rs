//! Plans with pages on the device: which pages are wanted, where they lie, and how they are drawn.

mod casters;
pub(crate) mod data;
pub(crate) mod meshes;
mod pipelines;
mod pool;

use crate::passes::part;
use crate::seen::check_depths;
use crate::shadows::{Casters, Shadows, check_casters};
use crate::{ClusterGeometry, DepthProjection, Error};
pub use casters::PageCasters;
use glam::DVec3;
use meshes::MeshesIn;
pub use meshes::{PageMesh, PageMeshCounts, PageMeshDraw, PageMeshPass, PageMeshes};
pub(crate) use pool::Pages;
use umbrage::Plan;
use wgpu::{
    BindGroup, Buffer, CommandEncoder, ComputePassTimestampWrites, Device, Queue, RenderPass,
    RenderPassTimestampWrites, TextureView,
};

/// The input of [`Shadows::prepare_pages`]: the pages to draw and look up in one frame.
#[derive(Clone, Copy, Debug)]
pub struct PageFrame<'a> {
    /// The plan, which must have [pages](umbrage::paged) and the filter of the
    /// [`ShadowOptions`](crate::ShadowOptions).
    pub plan: &'a Plan,
    /// World position of render space's origin, metres. All three coordinates must be finite.
    pub render_origin: DVec3,
    /// How the casters differ from those of the last prepared frame, but for those of
    /// [`PageParts`] that move.
    /// Pages in which casters moved are drawn again.
    pub casters: Casters<'a>,
    /// How the casters of [`PageParts`] that move differ from those of the last prepared frame. Pages in which they
    /// moved are drawn again too: without those that stand still, if these are kept
    /// [apart](crate::ShadowOptions::pages_apart).
    pub moving: Casters<'a>,
    /// The depths of all receivers that the plan's camera sees: a view of the depth aspect alone,
    /// whose texture has the usage `TEXTURE_BINDING`. The picture lies at the upper left. Pixels
    /// without a surface have the depth of the far plane: 0 if depth is reversed, otherwise 1.
    pub depth: &'a TextureView,
    /// How those depths follow from distances.
    pub projection: DepthProjection,
}

/// The timestamps that the passes of pages write when they begin and end.
#[derive(Clone, Debug, Default)]
pub struct PageTimestamps<'a> {
    /// Finding the pages that are wanted, and their places.
    pub request: Option<ComputePassTimestampWrites<'a>>,
    /// Choosing what is drawn into them.
    pub choice: Option<ComputePassTimestampWrites<'a>>,
    /// Drawing them.
    pub depth: Option<RenderPassTimestampWrites<'a>>,
}

/// What became of the pages of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PageCounts {
    /// Pages that were wanted, and those that stand in for them.
    pub wanted: u32,
    /// Pages of these that had no room, so that coarser ones were looked up.
    pub missing: u32,
    /// Pages of [lights to come](umbrage::paged::AgingLights) that were left for later frames.
    pub waiting: u32,
    /// Pages that were drawn, because they were new or because casters had moved.
    pub drawn: u32,
    /// Those of them in which only what is kept [apart](crate::ShadowOptions::pages_apart) from
    /// what stands still was drawn.
    pub apart: u32,
    /// The pages that there is room for.
    pub room: u32,
    /// The [bias](umbrage::paged::Paging::bias) of levels that the frame had.
    pub bias: f32,
    /// The greatest width of a texel that a receiver had, pixels, but for missing pages.
    pub bound: f32,
}

/// What lies in the texture of pages, for pictures of it. Places lie row by row, as many across as
/// the texture has room for, and each has gutters around its page.
#[derive(Clone, Copy, Debug)]
pub struct PagePool<'a> {
    /// Eight words for each place, of which the first is the index in the plan of the page's map, or
    /// `u32::MAX` if there is no page. Those at 5 and 6 are the frame in which the page was wanted
    /// last, and what of it is out of date, or 0.
    pub places: &'a Buffer,
    /// Words: the one at 2 is the number of the frame, and the one at 3 says where those of the
    /// frames begin in which each place's page was drawn.
    pub table: &'a Buffer,
    /// The number of places.
    pub count: u32,
    /// Texels across a place.
    pub side: u32,
}

/// A frame whose pages can now be found and drawn with [`encode`](Self::encode).
#[derive(Debug)]
#[must_use = "pages are drawn only if their passes are encoded"]
pub struct PreparedPages<'a> {
    pub(crate) shadows: &'a mut Shadows,
    pub(crate) plan: &'a Plan,
    pub(crate) render_origin: DVec3,
}

/// What casts into pages.
#[derive(Default)]
pub struct PageParts<'a> {
    /// Clusters that stand still.
    pub clusters: Option<PageClusters<'a>>,
    /// Clusters that move, [other instances](ClusterGeometry::with_instances) than the first.
    pub moving_clusters: Option<PageClusters<'a>>,
    /// Whole meshes that stand still.
    pub still: Option<PageMeshPart<'a>>,
    /// Whole meshes that move or are deformed.
    pub moving: Option<PageMeshPart<'a>>,
}

/// The clusters that cast into pages.
pub struct PageClusters<'a> {
    /// What draws them.
    pub casters: &'a mut PageCasters,
    /// The clusters and their instances.
    pub geometry: &'a ClusterGeometry,
    /// The [mask](PageCasters::mask) of each batch of casters, `None` for those without holes, and
    /// for all beyond the end.
    pub masks: &'a [Option<&'a BindGroup>],
}

/// The whole meshes that cast into pages.
pub struct PageMeshPart<'a> {
    /// The meshes.
    pub meshes: &'a mut PageMeshes,
    /// Draws them, each once: sets pipelines and buffers, and calls [`PageMeshPass::draw`].
    pub draw: &'a dyn Fn(&mut PageMeshPass<'_, '_>),
}

impl PageMeshPart<'_> {
    /// Draws the meshes into a pass. Returns the number of draws.
    fn encode(&self, pass: &mut RenderPass<'_>) -> u32 {
        let mut pass = PageMeshPass { pass, meshes: &*self.meshes, drawn: 0 };
        (self.draw)(&mut pass);
        pass.drawn
    }
}

impl PageParts<'_> {
    /// Draws what stands still, or what moves, into a pass. Returns the number of draws.
    fn encode(&self, pass: &mut RenderPass<'_>, is_still: bool) -> u32 {
        let (clusters, meshes) = match is_still {
            true => (&self.clusters, &self.still),
            false => (&self.moving_clusters, &self.moving),
        };
        let of_clusters = clusters.as_ref().map_or(0, |c| c.casters.draw(pass, c.masks));
        of_clusters + meshes.as_ref().map_or(0, |meshes| meshes.encode(pass))
    }
}

impl PreparedPages<'_> {
    /// Encodes the passes that find the pages which the frame wants, give them places, find what
    /// casts into those that are new or out of date, and draw these. Nothing comes back from the
    /// device for it.
    ///
    /// Encode this behind the pass that draws the viewer's depths and ahead of those that look
    /// shadows up, and submit it before you prepare the next frame. Returns the number of draws.
    ///
    /// # Errors
    /// As for [`ClusterSelection::encode`](crate::ClusterSelection::encode), and [`Error::Invalid`]
    /// if a whole mesh has a transform or a box that is not finite.
    pub fn encode(
        self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        mut parts: PageParts<'_>,
        timestamps: PageTimestamps<'_>,
    ) -> Result<u32, Error> {
        let Self { shadows, plan, render_origin } = self;
        let reach_texels = shadows.options.filter.reach_texels();
        let Shadows { pages, texture, buffers, lookup_bind_group, .. } = shadows;
        let Some(pages) = pages else { return Ok(0) };
        if plan.maps.is_empty() {
            return Ok(0);
        }
        for part in parts.still.iter().chain(&parts.moving) {
            part.meshes.check()?;
        }
        let PageTimestamps { request, choice, depth } = timestamps;
        pages.encode_request(encoder, lookup_bind_group, request);
        let are_apart = pages.are_apart();
        let PageParts { clusters, moving_clusters, still, moving } = &mut parts;
        let choices =
            [clusters.is_some(), moving_clusters.is_some(), still.is_some(), moving.is_some()];
        let choices = choices.into_iter().filter(|&is_there| is_there).count();
        let mut chosen = 0;
        let mut next_times = || {
            chosen += 1;
            let all = choice.as_ref()?;
            let begin = all.beginning_of_pass_write_index.filter(|_| chosen == 1);
            let end = all.end_of_pass_write_index.filter(|_| chosen == choices);
            (begin.is_some() || end.is_some()).then_some(ComputePassTimestampWrites {
                query_set: all.query_set,
                beginning_of_pass_write_index: begin,
                end_of_pass_write_index: end,
            })
        };
        // Without a texture of their own, all that stands still is drawn where something moves.
        for (part, is_still) in [(clusters, true), (moving_clusters, !are_apart)] {
            let Some(PageClusters { casters, geometry, .. }) = part else { continue };
            let still = if is_still { data::STILL } else { 0 };
            let views = pages.views(plan, render_origin, reach_texels, casters.share(), still);
            let Some(shown) = pages.shown_group(device, geometry) else { return Ok(0) };
            let times = next_times();
            casters.choose(
                device,
                queue,
                encoder,
                geometry,
                &views,
                render_origin,
                shown,
                times,
            )?;
        }
        for (part, is_still) in [(still, true), (moving, !are_apart)] {
            let (Some(part), Some(buffers)) = (part, pages.mesh_buffers(buffers.maps())) else {
                continue;
            };
            let pages = MeshesIn { plan, render_origin, reach_texels, is_still, pages: buffers };
            part.meshes.encode(device, queue, encoder, &pages, next_times());
        }
        let mut draws = 0;
        let writes = |is_first, is_last| part(depth.as_ref(), is_first, is_last);
        {
            let mut pass = pages.begin_draw(encoder, texture, writes(true, !are_apart));
            draws += parts.encode(&mut pass, true);
            if !are_apart {
                draws += parts.encode(&mut pass, false);
            }
        }
        if are_apart {
            let mut pass = pages.begin_apart(encoder, texture, writes(false, true));
            draws += parts.encode(&mut pass, false);
        }
        pages.finish_draw(texture);
        Ok(draws)
    }
}

/// Checks that shadows have pages.
pub(crate) fn check_pages(shadows: &Shadows) -> Result<&Pages, Error> {
    shadows.pages.as_ref().ok_or_else(|| Error::Invalid {
        field: "options.pages",
        problem: "must be true for shadows whose pages are drawn, is false".into(),
    })
}

impl Shadows {
    /// Uploads what shaders need for a frame with pages. If the result is dropped without being
    /// encoded, no page is found or drawn, and lookups find those of the frame before.
    ///
    /// # Errors
    /// As for [`prepare`](Self::prepare), and [`Error::Invalid`] if the plan has no pages, if the
    /// [options](crate::ShadowOptions::pages) have none, or if the depths cannot be read.
    pub fn prepare_pages<'a>(
        &'a mut self,
        device: &Device,
        queue: &Queue,
        frame: &PageFrame<'a>,
    ) -> Result<PreparedPages<'a>, Error> {
        let PageFrame { plan, render_origin, casters, moving, depth, projection } = *frame;
        self.check(plan, render_origin, casters)?;
        check_casters(moving, "frame.moving")?;
        let Some(paging) = &plan.paging else {
            return Err(Error::Invalid {
                field: "frame.plan",
                problem: "has no pages: hand it to `Shadows::prepare`".into(),
            });
        };
        if !self.options.pages {
            return Err(Error::Invalid {
                field: "options.pages",
                problem: "must be true for a plan with pages, is false".into(),
            });
        }
        projection.check(&paging.camera)?;
        check_depths(depth, paging.camera.image())?;
        if !plan.maps.is_empty() {
            self.upload_pages(device, queue, frame, paging);
        }
        Ok(PreparedPages { shadows: self, plan, render_origin })
    }

    /// What became of the pages of the newest frame that the device has told of; `None` before the
    /// first. This does not wait for the device.
    pub fn page_counts(&mut self, device: &Device) -> Option<PageCounts> {
        self.pages.as_mut()?.counts(device)
    }

    /// What lies in the [texture](Self::depth_texture) of pages; `None` before the first frame.
    pub fn page_pool(&self) -> Option<PagePool<'_>> {
        self.pages.as_ref()?.pool(&self.options.filter)
    }

    /// Whether [`page_counts`](Self::page_counts) are those of the last frame that was encoded.
    pub fn are_pages_counted(&self) -> bool {
        self.pages.as_ref().is_none_or(Pages::is_counted)
    }
}
