//! The costs of a frame.

use crate::error::{About, Error, Field};
use crate::executor::{Executor, OnGpu, RenderScene, Work};
use crate::planning::milliseconds;
use crate::receivers::Receivers;
use crate::strip::Rows;
use std::time::Instant;
use umbrage::paged::PAGE_AREA;
use umbrage::{Plan, Technique};
use umbrage_render::{Drawn, FrameTarget, Shading, StageTimes, Timer};
use umbrage_trace::{Reference, Tracer, View};
use umbrage_wgpu::{Casters, SeenReadback};

/// The costs of a frame, with times in milliseconds.
#[derive(Clone, Debug)]
pub struct Costs {
    /// Memory that lookup reads, bytes.
    pub bytes: u64,
    /// Time to draw the viewer's depths ahead of pages; `None` without pages, or without timestamps.
    pub prepass: Option<f64>,
    /// Time to find the pages that are wanted, their places, and what casts into those to draw;
    /// `None` as for `prepass`.
    pub pages: Option<f64>,
    /// Time to draw the maps. Without timestamps it has all that comes ahead of the picture.
    pub depth: f64,
    /// Time to prefilter the maps; `None` without a prefilter, or if `depth` includes this time.
    pub filter: Option<f64>,
    /// Time to draw the picture.
    pub shade: f64,
    /// Time until what was [seen](crate::Fit::Seen) is back from the GPU, which renderers need not
    /// wait for; `None` if the maps are not fitted to that, or for the CPU reference.
    pub seen: Option<f64>,
    /// Time that the CPU takes to cull, to encode and to submit the frame's work, without planning
    /// and without waiting for the GPU; `None` for the CPU reference.
    pub cpu: Option<f64>,
    /// What was drawn into which map, by the map's index in the plan; `None` for the CPU reference.
    pub drawn: Option<Vec<(usize, Drawn)>>,
    /// The texels in use, and those of them that were drawn.
    pub texels: [u64; 2],
}

/// Draws frames of one technique and measures what they cost.
pub struct Bencher<'a> {
    executor: Executor<'a>,
    /// Target that the GPU draws into, and a timer if the GPU has timestamps.
    target: Option<(FrameTarget, Option<Timer>)>,
    /// What reduces the frames' depths, if a GPU's maps are fitted to what is seen.
    readback: Option<SeenReadback>,
}

impl<'a> Bencher<'a> {
    /// Makes a bencher that draws frames of this width and height, pixels.
    ///
    /// # Errors
    /// An error if the GPU fails, or if it does not support the technique or the size.
    pub fn new(
        scene: &'a RenderScene<'_>,
        technique: &Technique,
        receivers: &Receivers,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let executor = scene.executor(technique, false)?;
        let target = match &executor.work {
            Work::Gpu(on) => {
                Some((FrameTarget::new(on.gpu, size).about(Field::Size)?, Timer::new(on.gpu)))
            }
            Work::Reference { .. } => None,
        };
        let readback = match &executor.work {
            Work::Gpu(on) if receivers.are_seen() && on.gpu.support().compute => {
                let readback = SeenReadback::new(on.gpu.device(), &on.gpu.support());
                Some(readback.map_err(umbrage_render::Error::from)?)
            }
            _ => None,
        };
        Ok(Self { executor, target, readback })
    }

    /// Returns the executor that draws.
    pub fn executor(&self) -> &Executor<'_> {
        &self.executor
    }

    /// Returns whether the GPU measures how long its passes take.
    pub fn has_timestamps(&self) -> bool {
        matches!(self.target, Some((_, Some(_))))
    }

    /// Draws a frame, and waits until it is done. If `still` is true, casters are unmoved, so a GPU
    /// does not draw maps again that have not changed.
    ///
    /// # Errors
    /// An error if a GPU fails, or if the maps do not fit into memory.
    pub fn frame(&mut self, view: &View<'_>, plan: &Plan, still: bool) -> Result<Costs, Error> {
        match (&mut self.executor.work, &mut self.target) {
            (Work::Gpu(on), Some((target, timer))) => {
                let casters = if still { Casters::Unmoved } else { Casters::Moved };
                let costs = frame_on_gpu(on, target, timer.as_mut(), view, plan, casters)?;
                let Some(readback) = &mut self.readback else { return Ok(costs) };
                let start = Instant::now();
                on.renderer.seen(view.camera(), target, readback)?;
                Ok(Costs { seen: Some(milliseconds(start)), ..costs })
            }
            (Work::Reference { tracer, .. }, _) => frame_by_reference(tracer, view, plan),
            (Work::Gpu(_), None) => unreachable!("a GPU was given a target"),
        }
    }
}

fn frame_on_gpu(
    on: &mut OnGpu<'_>,
    target: &FrameTarget,
    mut timer: Option<&mut Timer>,
    view: &View<'_>,
    plan: &Plan,
    casters: Casters,
) -> Result<Costs, Error> {
    let OnGpu { renderer, gpu, .. } = on;
    let start = Instant::now();
    let shading = Shading { camera: view.camera(), light: view.light(), light_index: 0 };
    let drawn = renderer.draw_maps(plan, casters, timer.as_deref_mut())?;
    let for_maps = milliseconds(start);
    let (times, for_picture) = match &mut timer {
        Some(timer) => {
            let start = Instant::now();
            renderer.frame(&shading, target, Some(timer))?;
            let for_picture = milliseconds(start);
            (timer.read(gpu)?, for_picture)
        }
        None => {
            gpu.wait()?;
            let depth_ms = milliseconds(start);
            let shaded = Instant::now();
            renderer.frame(&shading, target, None)?;
            let for_picture = milliseconds(shaded);
            gpu.wait()?;
            let picture_ms = milliseconds(shaded);
            (StageTimes { depth_ms, picture_ms, ..StageTimes::default() }, for_picture)
        }
    };
    let cpu = Some(for_maps + for_picture);
    let StageTimes { prepass_ms, pages_ms, depth_ms, filter_ms, picture_ms: shade } = times;
    let depth = if drawn.is_empty() { 0.0 } else { depth_ms };
    let is_prefiltered = renderer.shadows().options().filter.prefilter().is_some();
    let filter = Some(filter_ms).filter(|_| is_prefiltered && timer.is_some());
    let bytes = renderer.shadows().lookup_bytes();
    let of_map = |&(map, _): &(usize, Drawn)| plan.maps[map].texels();
    let texels = match renderer.page_counts() {
        Some(pages) => [pages.wanted, pages.drawn].map(|n| u64::from(n) * PAGE_AREA),
        None => [plan.texels(), drawn.iter().map(of_map).sum()],
    };
    let of_pages = |ms| Some(ms).filter(|_| plan.paging.is_some() && timer.is_some());
    let [prepass, pages] = [prepass_ms, pages_ms].map(of_pages);
    // The first frame found out how much room there must be.
    renderer.run_ahead();
    let (seen, drawn) = (None, Some(drawn));
    Ok(Costs { bytes, prepass, pages, depth, filter, shade, seen, cpu, drawn, texels })
}

fn frame_by_reference(tracer: &Tracer<'_>, view: &View<'_>, plan: &Plan) -> Result<Costs, Error> {
    let start = Instant::now();
    let reference = Reference::render(tracer, plan, &|_| {})?;
    let depth = milliseconds(start);
    let shaded = Instant::now();
    for range in view.bands() {
        Rows::new(view, range, &|_| {}).by_reference(plan, &reference);
    }
    let bytes = reference.bytes();
    let shade = milliseconds(shaded);
    let texels = match plan.paging {
        Some(_) => [reference.pages() as u64 * PAGE_AREA; 2],
        None => [plan.texels(); 2],
    };
    Ok(Costs {
        bytes,
        prepass: None,
        pages: None,
        depth,
        filter: None,
        shade,
        seen: None,
        cpu: None,
        drawn: None,
        texels,
    })
}
