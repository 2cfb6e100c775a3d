//! Plans with pages: the picture's depths first, and then the pages that these want.

use crate::frame_target::FrameTarget;
use crate::renderer::{Drawn, Renderer, Shading, compute_writes, depth_projection, writes};
use crate::scene::{MovingClusters, SceneBuffers};
use crate::timer::{Stage, Timer};
use crate::whole::{WholeCasters, draw_list};
use crate::{Error, Gpu};
use glam::DVec3;
use umbrage::{Camera, Light, Plan};
use umbrage_wgpu::{
    Casters, ClusterCasters, PageCasters, PageClusters, PageCounts, PageFrame, PageParts,
    PageTimestamps, Shadows,
};
use wgpu::Device;

/// How a renderer draws pages.
pub(crate) struct PageDrawing {
    casters: PageCasters,
    /// Draws clusters that move, and which these are.
    moving: Option<(Vec<usize>, PageCasters)>,
    whole: WholeCasters,
    /// The depths of the plan's camera.
    target: Option<FrameTarget>,
    /// Whether the pages were drawn whole, as far as is known.
    pub(crate) is_complete: bool,
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
        let whole = WholeCasters::new(gpu.device(), scene, shadows)?;
        // What other casters drew before is out of date.
        Ok(Self { casters, moving: None, whole, target: None, is_complete: false })
    }
}

impl PageDrawing {
    /// Draws these clusters that move from now on.
    fn follow(&mut self, device: &Device, shadows: &Shadows, moved: Option<&MovingClusters>) {
        let Some(MovingClusters { clusters, members }) = moved else {
            self.moving = None;
            return;
        };
        if self.moving.as_ref().is_none_or(|(known, _)| known != members) {
            let casters = self.casters.for_instances(device, shadows, &clusters.geometry);
            self.moving = Some((members.clone(), casters));
        }
    }
}

impl Renderer<'_> {
    /// Draws the depths that the plan's camera sees, and the pages that they want.
    pub(crate) fn draw_pages(
        &mut self,
        eye: DVec3,
        plan: &Plan,
        casters: Casters<'_>,
        mut timer: Option<&mut Timer>,
    ) -> Result<Vec<(usize, Drawn)>, Error> {
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
        // Levels of detail stay in the maps of other renderers, so all of the scene is drawn whole.
        let is_all = scene.has_clusters() && !self.edge_on.is_empty();
        if !scene.has_clusters() {
            scene.take_from_clusters(gpu, self.edge_on.iter().map(|e| e.instance))?;
        }
        let [mut still, mut moving] = [Vec::new(), Vec::new()];
        if let Some(drawing) = &mut self.pages {
            let boxes = [&mut still, &mut moving];
            drawing.whole.list(scene, plan, &self.edge_on, is_all, boxes);
        }
        if let Casters::MovedIn(boxes) = casters {
            still.extend_from_slice(boxes);
        }
        let mut casters = match casters {
            Casters::Moved => Casters::Moved,
            Casters::MovedIn(_) | Casters::Unmoved => Casters::MovedIn(&still),
        };
        let moving = Casters::MovedIn(&moving);
        let mut trials = 0;
        loop {
            let target = self.draw_depths(&camera, timer.as_deref_mut())?;
            self.eye = Some(eye);
            let is_exact = self.is_exact;
            let Self { shadows, masks, pages, .. } = self;
            let Some(drawing) = pages else { return Ok(Vec::new()) };
            let is_known = |drawing: &mut PageDrawing| {
                let moving = drawing.moving.as_mut().map(|(_, casters)| casters);
                let mut clusters = std::iter::once(&mut drawing.casters).chain(moving);
                clusters.all(|casters| casters.counts(device).is_none_or(|c| c.is_complete))
                    && drawing.whole.counts(gpu).1
            };
            drawing.is_complete &= is_known(drawing);
            if !std::mem::replace(&mut drawing.is_complete, true) {
                casters = Casters::Moved;
            }
            let projection = depth_projection(scene, &camera)?;
            let depth = &target.depth;
            let frame = PageFrame { plan, render_origin: eye, casters, moving, depth, projection };
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut begin = |stage| timer.as_ref().map(|t| t.begin(stage, &mut encoder));
            let [request, choice, depth] =
                [Stage::Pages, Stage::Pages, Stage::Depth].map(&mut begin);
            let timestamps = PageTimestamps {
                request: compute_writes(&request),
                choice: compute_writes(&choice),
                depth: writes(&depth),
            };
            let moved = scene.moving();
            drawing.follow(device, shadows, moved.as_ref());
            let prepared = shadows.prepare_pages(device, queue, &frame)?;
            let PageDrawing { casters: own, moving: own_moving, whole, .. } = &mut *drawing;
            let ([still, moves], meshes) = whole.lists();
            let masks = &*masks;
            let draws = scene.with_page_clusters(|clusters, _| {
                let masked = clusters.masked.iter().map(|&material| masks[material].as_ref());
                let batches: Vec<_> = std::iter::once(None).chain(masked).collect();
                draw_list(still, scene, meshes, masks, |still| {
                    draw_list(moves, scene, meshes, masks, |moving| {
                        let clusters = (!is_all).then_some(PageClusters {
                            casters: own,
                            geometry: &clusters.geometry,
                            masks: &batches,
                        });
                        let moving_clusters = own_moving.as_mut().zip(moved.as_ref());
                        let moving_clusters =
                            moving_clusters.map(|((_, casters), moved)| PageClusters {
                                casters,
                                geometry: &moved.clusters.geometry,
                                masks: &batches,
                            });
                        let parts = PageParts { clusters, moving_clusters, still, moving };
                        prepared.encode(device, queue, &mut encoder, parts, timestamps)
                    })
                })
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
            let pages = shadows.page_counts(device);
            let is_whole = is_known(drawing);
            drawing.is_complete &= is_whole;
            let has_room = pages.is_none_or(|counts| has_room(plan, &counts));
            trials += 1;
            if is_exact && !(is_whole && has_room) && trials < MOST_TRIALS {
                continue;
            }
            let of_clusters = |casters: &mut PageCasters| {
                casters.counts(device).map_or(0, |counts| counts.triangles)
            };
            let of_moving = drawing.moving.as_mut().map_or(0, |(_, moving)| of_clusters(moving));
            let of_still = of_clusters(&mut drawing.casters);
            let triangles = of_still + of_moving + drawing.whole.counts(gpu).0;
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
