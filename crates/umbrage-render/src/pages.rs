//! Plans with pages: the picture's depths first, and then the pages that these want.

use crate::frame_target::FrameTarget;
use crate::renderer::{Drawn, Renderer, Shading, compute_writes, depth_projection, writes};
use crate::scene::SceneBuffers;
use crate::timer::{Stage, Timer};
use crate::{Error, Gpu};
use glam::DVec3;
use umbrage::{Camera, Light, Plan};
use umbrage_wgpu::{
    Casters, ClusterCasters, PageCasters, PageCounts, PageFrame, PageTimestamps, Shadows,
};

/// How a renderer draws pages.
pub(crate) struct PageDrawing {
    casters: PageCasters,
    /// The depths of the plan's camera.
    target: Option<FrameTarget>,
    /// Whether the pages were drawn whole, as far as is known.
    is_complete: bool,
}

/// How often pages are found anew, with more room each time, until all of them have some.
const MOST_TRIALS: u32 = 8;

/// How often a thread gives way to one that may be handing counts over.
const MOST_YIELDS: u32 = 1000;

impl PageDrawing {
    pub(crate) fn new(gpu: &Gpu, scene: &SceneBuffers, shadows: &Shadows) -> Result<Self, Error> {
        let share = scene.with_page_clusters(|_, has_all_detail| match has_all_detail {
            true => 0.0,
            false => ClusterCasters::SHARE,
        });
        Self::of_share(gpu, scene, shadows, share.unwrap_or(0.0))
    }

    /// Draws casters that may be off by a share of a texel.
    pub(crate) fn of_share(
        gpu: &Gpu,
        scene: &SceneBuffers,
        shadows: &Shadows,
        share: f32,
    ) -> Result<Self, Error> {
        let casters = scene.with_page_clusters(|clusters, _| {
            PageCasters::new(gpu.device(), shadows, &clusters.geometry, share)
        });
        let casters = casters.ok_or_else(|| Error::Invalid {
            field: "options.pages",
            problem: "needs a scene with clusters: see `SceneBuffers::make_pages`".into(),
        })??;
        Ok(Self { casters, target: None, is_complete: true })
    }
}

impl Renderer<'_> {
    /// Draws the depths that the plan's camera sees, and the pages that they want.
    pub(crate) fn draw_pages(
        &mut self,
        eye: DVec3,
        plan: &Plan,
        mut casters: Casters<'_>,
        mut timer: Option<&mut Timer>,
    ) -> Result<Vec<(usize, Drawn)>, Error> {
        if !self.edge_on.is_empty() {
            return Err(Error::Invalid {
                field: "plan",
                problem: "has pages, into which triangles cannot be drawn whose plane holds a \
                          lamp: take a technique without pages"
                    .into(),
            });
        }
        let (gpu, scene) = (self.gpu, self.scene);
        let (device, queue) = (gpu.device(), gpu.queue());
        let Some(camera) = plan.paging.as_ref().map(|paging| paging.camera) else {
            return Ok(Vec::new());
        };
        if self.pages.is_none() {
            return Err(Error::Invalid {
                field: "options.pages",
                problem: "must be true for a plan with pages, is false".into(),
            });
        }
        let mut trials = 0;
        loop {
            let target = self.draw_depths(&camera, timer.as_deref_mut())?;
            self.eye = Some(eye);
            let is_exact = self.is_exact;
            let Self { shadows, masks, pages, .. } = self;
            let Some(drawing) = pages else { return Ok(Vec::new()) };
            if drawing.casters.counts(device).is_some_and(|counts| !counts.is_complete) {
                drawing.is_complete = false;
            }
            if !std::mem::replace(&mut drawing.is_complete, true) {
                casters = Casters::Moved;
            }
            let projection = depth_projection(scene, &camera)?;
            let depth = &target.depth;
            let frame = PageFrame { plan, render_origin: eye, casters, depth, projection };
            let prepared = shadows.prepare_pages(device, queue, &frame)?;
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut begin = |stage| timer.as_ref().map(|t| t.begin(stage, &mut encoder));
            let [request, choice, depth] =
                [Stage::Pages, Stage::Pages, Stage::Depth].map(&mut begin);
            let timestamps = PageTimestamps {
                request: compute_writes(&request),
                choice: compute_writes(&choice),
                depth: writes(&depth),
            };
            let draws = scene.with_page_clusters(|clusters, _| {
                let mask_of = |batch: u32| {
                    let material = batch.checked_sub(1).map(|i| clusters.masked[i as usize]);
                    material.and_then(|m| masks[m].as_ref())
                };
                let geometry = &clusters.geometry;
                let own = &mut drawing.casters;
                prepared.encode(device, queue, &mut encoder, own, geometry, mask_of, timestamps)
            });
            let draws = draws.transpose()?.unwrap_or(0);
            if let Some(timer) = timer.as_deref_mut() {
                timer.end(&mut encoder, request.into_iter().chain(choice).chain(depth));
            }
            queue.submit([encoder.finish()]);
            drawing.target = Some(target);
            gpu.check()?;
            if is_exact {
                gpu.wait()?;
                // Another thread that waits for the device may be about to hand the counts over.
                for _ in 0..MOST_YIELDS {
                    shadows.page_counts(device);
                    if shadows.are_pages_counted() {
                        break;
                    }
                    std::thread::yield_now();
                }
            }
            let counts = drawing.casters.counts(device);
            let pages = shadows.page_counts(device);
            let is_whole = counts.is_none_or(|counts| counts.is_complete);
            drawing.is_complete &= is_whole;
            let has_room = pages.is_none_or(|counts| has_room(plan, &counts));
            trials += 1;
            if is_exact && !(is_whole && has_room) && trials < MOST_TRIALS {
                continue;
            }
            let triangles = counts.map_or(0, |counts| counts.triangles);
            return Ok(vec![(0, Drawn { draws, triangles })]);
        }
    }

    /// What became of the pages that were drawn last, as far as the device has told.
    pub fn page_counts(&mut self) -> Option<PageCounts> {
        self.shadows.page_counts(self.gpu.device())
    }

    /// Draws the depths that a camera sees.
    fn draw_depths(
        &mut self,
        camera: &Camera,
        timer: Option<&mut Timer>,
    ) -> Result<FrameTarget, Error> {
        let [width, height] = camera.image();
        let kept = self.pages.as_mut().and_then(|pages| pages.target.take());
        let is_as_large =
            |t: &FrameTarget| [t.color().width(), t.color().height()] == [width, height];
        let target = match kept.filter(is_as_large) {
            Some(target) => target,
            None => FrameTarget::new(self.gpu, [width, height])?,
        };
        self.eye = None;
        // The light does not matter for depths.
        let light = Light::Directional { direction: DVec3::NEG_Y };
        let shading = Shading { camera, light: &light, light_index: 0 };
        self.draw_frame("depth", Stage::Prepass, &shading, &target, timer)?;
        Ok(target)
    }
}

/// Whether all pages had room, or cannot have more.
fn has_room(plan: &Plan, counts: &PageCounts) -> bool {
    let Some(paging) = &plan.paging else { return true };
    let is_as_planned = counts.bias <= paging.bias as f32 && counts.missing == 0;
    is_as_planned || paging.budget.is_some()
}
