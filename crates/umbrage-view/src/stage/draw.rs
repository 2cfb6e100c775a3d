//! Draws the frames that the window requests.

use super::errors::Visibility;
use super::mailbox::Mailbox;
use super::posed::Posed;
use super::request::{Costs, DrawnPicture, Frame, Picture, Request, Shining};
use super::truth::{SharedTruth, TruthJob};
use super::{News, Reporter};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;
use umbrage::paged::{Grid, PAGE_AREA};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Bounds, Camera, Light, Plan, Planner, SeenTiles};
use umbrage_lab::{
    Error, Fit, NamedTechnique, PreparedScene, Receivers, Scout, edge_on, fade, make_pages,
    milliseconds, plan_with, planner, shadow_options, unfit_for_gpu,
};
use umbrage_measure::PARTITIONS;
use umbrage_render::{FrameTarget, Gpu, Renderer, SceneBuffers, Shading, StageTimes, Timer};
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, ShadowOptions};

/// The number of techniques' renderers that each picture keeps, so that changing to and fro is
/// quick.
const RENDERERS: usize = 2;

/// For so many frames the time of a picture without lookups counts, before it is measured again.
const BARE_EVERY: u64 = 16;

/// Rows of a picture that are read back at a time, so that a new request has not long to wait.
const ROWS: u32 = 128;

/// Draws one scene.
pub(super) struct Artist<'a> {
    prepared: &'a PreparedScene<'a>,
    gpu: &'a Gpu,
    buffers: &'a SceneBuffers,
    reporter: &'a Reporter,
    frames: &'a AtomicU64,
    /// Number of frames that this artist has drawn.
    drawn: u64,
    easels: Vec<Easel<'a>>,
    bare: Bare<'a>,
    /// For pictures of maps.
    map_targets: Targets,
    /// The receivers for [`Fit::Box`]. Those for other fits are the same boxes around surfaces.
    in_box: Receivers,
    scout: Option<Scout<'a>>,
    posed: Option<Posed>,
    /// The last frame, and whether its truth and errors were asked for.
    last: Option<(Arc<Frame>, bool)>,
}

/// What draws one of a frame's pictures.
struct Easel<'a> {
    /// The one that was used last comes last.
    renderers: Vec<Brush<'a>>,
    planner: Planner,
    targets: Targets,
    timer: Option<Timer>,
    times: Option<StageTimes>,
    /// A grid of the plan that was drawn last, if that has pages.
    grid: Option<Grid>,
}

/// A renderer for techniques with these options.
struct Brush<'a> {
    options: ShadowOptions,
    renderer: Renderer<'a>,
    /// Boxes around the casters that changed since its maps were drawn; `None` if any may have.
    moved: Option<Vec<Aabb>>,
}

impl Brush<'_> {
    /// Notes that casters changed.
    fn moved(&mut self, boxes: &[Aabb]) {
        /// With more boxes than these, drawing whole maps costs no more than finding the parts.
        const MOST: usize = 256;
        if let Some(moved) = &mut self.moved {
            moved.extend_from_slice(boxes);
            if moved.len() > MOST {
                self.moved = None;
            }
        }
    }
}

/// What draws pictures without lookups.
struct Bare<'a> {
    renderer: Option<Renderer<'a>>,
    targets: Targets,
    timer: Option<Timer>,
    /// Number of the artist's frame at which it was measured, the picture's size, and the time,
    /// milliseconds.
    measured: Option<(u64, [u32; 2], f64)>,
}

impl Bare<'_> {
    /// The time of such a picture for a frame of this number, milliseconds, if it was measured in
    /// a view that is about the same.
    fn of(&self, frame: u64, camera: &Camera) -> Option<f64> {
        let is_near = |(at, size, _): &(u64, [u32; 2], f64)| {
            frame - at <= BARE_EVERY && *size == camera.image()
        };
        self.measured.filter(is_near).map(|(.., ms)| ms)
    }
}

/// Targets that nobody looks at any more are drawn into again.
#[derive(Default)]
struct Targets(Vec<Arc<FrameTarget>>);

impl Targets {
    fn free(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<Arc<FrameTarget>, String> {
        self.0.retain(|target| target.size() == size || Arc::strong_count(target) > 1);
        let free = self.0.iter().find(|t| Arc::strong_count(t) == 1 && t.size() == size);
        if let Some(target) = free {
            return Ok(Arc::clone(target));
        }
        let target = Arc::new(FrameTarget::new(gpu, size).map_err(|e| e.to_string())?);
        self.0.push(Arc::clone(&target));
        Ok(target)
    }
}

impl<'a> Artist<'a> {
    /// `None` without a GPU.
    pub(super) fn new(
        prepared: &'a PreparedScene<'a>,
        reporter: &'a Reporter,
        frames: &'a AtomicU64,
    ) -> Option<Self> {
        let (gpu, buffers) = prepared.render().on_gpu()?;
        Some(Self {
            prepared,
            gpu,
            buffers,
            reporter,
            frames,
            drawn: 0,
            easels: Vec::new(),
            bare: Bare {
                renderer: None,
                targets: Targets::default(),
                timer: Timer::new(gpu),
                measured: None,
            },
            map_targets: Targets::default(),
            in_box: Receivers::in_box(prepared.render().tracer().scene()),
            scout: None,
            posed: None,
            last: None,
        })
    }

    /// Poses the scene.
    fn pose(&mut self, moment: Option<(usize, f64)>) -> Result<(), String> {
        if moment.is_none() && self.posed.is_none() {
            return Ok(());
        }
        let rest = self.tracer().scene();
        let posed = self.posed.get_or_insert_with(|| Posed::new(rest));
        let moved = posed.set(moment, self.gpu, self.buffers);
        for brush in self.easels.iter_mut().flat_map(|easel| &mut easel.renderers) {
            match &moved {
                Ok(moved) => brush.moved(moved),
                Err(_) => brush.moved = None,
            }
        }
        moved.map(drop)
    }

    /// The scene in the pose of an animation, if it is not at rest.
    fn in_motion(&self) -> Option<&Posed> {
        self.posed.as_ref().filter(|posed| !posed.is_at_rest())
    }

    fn tracer(&self) -> &'a Tracer<'a> {
        self.prepared.render().tracer()
    }

    /// Draws a frame and sends it to the window.
    pub(super) fn draw(&mut self, request: Request) {
        if let Err(problem) = self.pose(request.moment) {
            self.reporter.tell(News::Refused(problem));
        }
        let scene = self.in_motion().map_or(self.tracer().scene(), Posed::scene);
        let light = match request.light {
            Shining::Light(light) => light,
            // The window knows the lights of its scene, so there is one of this index.
            Shining::OfScene(index) => scene.lights[index].light,
        };
        let planned_for = request.planned_for.unwrap_or(request.camera);
        let number = self.frames.fetch_add(1, Ordering::Relaxed) + 1;
        self.drawn += 1;
        let (seen, problem) = match self.seen(request.fit, &planned_for) {
            Ok(seen) => (seen, None),
            Err(problem) => (None, Some(problem)),
        };
        let mut pictures = Vec::with_capacity(request.techniques.len());
        for (i, technique) in request.techniques.iter().enumerate() {
            let drawn = match &problem {
                Some(problem) => Err(problem.clone()),
                None => self.picture(i, technique, &request, &planned_for, &light, seen.as_ref()),
            };
            pictures.push(Picture { technique: technique.clone(), drawn });
        }
        // Maps of techniques that are no longer compared would only take memory.
        self.easels.truncate(pictures.len());
        let map = request.map.and_then(|map| self.map(map));
        let body = match (request.wants_body, self.easels.first()) {
            (true, Some(easel)) => easel.planner.seen_edges().collect(),
            _ => Vec::new(),
        };
        if let Err(e) = self.gpu.wait() {
            self.reporter.tell(News::Refused(e.to_string()));
        }
        if self.bare.of(self.drawn, &request.camera).is_none() {
            self.measure_bare(&request.camera, &light);
        }
        let bare_ms = self.bare.of(self.drawn, &request.camera);
        for (easel, picture) in self.easels.iter_mut().zip(&mut pictures) {
            easel.read_times(self.gpu);
            if let (Some(times), Ok(drawn)) = (&easel.times, &mut picture.drawn) {
                drawn.costs.add_times(times, bare_ms);
            }
        }
        let frame = Arc::new(Frame { request, number, light, pictures, map, body });
        self.last = Some((Arc::clone(&frame), false));
        self.reporter.tell(News::Frame(frame));
    }

    /// Draws one of a frame's pictures.
    fn picture(
        &mut self,
        index: usize,
        technique: &NamedTechnique,
        request: &Request,
        planned_for: &Camera,
        light: &Light,
        seen: Option<&SeenTiles>,
    ) -> Result<DrawnPicture, String> {
        if let Some(reason) = unfit_for_gpu(technique.technique()) {
            return Err(format!("{reason}; `umbrage render` traces them"));
        }
        let (gpu, buffers, tracer) = (self.gpu, self.buffers, self.tracer());
        let posed = self.posed.as_ref().filter(|posed| !posed.is_at_rest());
        let receivers = match posed {
            Some(posed) => posed.receivers(request.fit),
            None if request.fit == Fit::Box => &self.in_box,
            None => self.prepared.receivers(),
        };
        let bounds = receivers.bounds(seen);
        while self.easels.len() <= index {
            self.easels.push(Easel::new(gpu));
        }
        let easel = &mut self.easels[index];
        let start = Instant::now();
        let plan = easel.plan(technique, planned_for, light, &bounds).map_err(|e| e.to_string())?;
        let plan_ms = milliseconds(start);
        easel.grid = plan.paging.as_ref().and_then(|paging| paging.grids.first().cloned());
        let target = easel.targets.free(gpu, request.camera.image())?;
        make_pages(gpu, buffers, tracer.scene(), technique.technique())
            .map_err(|e| e.to_string())?;
        let mut options = shadow_options(technique.technique(), plan.fade.is_some());
        options.pages_apart = options.pages && !tracer.scene().animations.clips().is_empty();
        let (brush, mut timer) = easel.brush(gpu, buffers, options)?;
        let Brush { renderer, moved, .. } = brush;
        let text = |e: umbrage_render::Error| e.to_string();
        // The rays know the scene at rest.
        renderer.leave_out(if posed.is_some() { Vec::new() } else { edge_on(&plan, tracer) });
        let casters = match moved.as_deref() {
            // Of pages a renderer knows itself what poses moved.
            _ if plan.paging.is_some() => Casters::Unmoved,
            None => Casters::Moved,
            Some([]) => Casters::Unmoved,
            Some(moved) => Casters::MovedIn(moved),
        };
        let eye = request.camera.eye();
        let maps = renderer
            .draw_maps_seen_from(eye, &plan, casters, timer.as_deref_mut())
            .map_err(text)?;
        *moved = Some(Vec::new());
        let shading = Shading { camera: &request.camera, light, light_index: 0 };
        let picture = match request.overlay {
            None => renderer.frame(&shading, &target, timer),
            Some(overlay) => renderer.frame_with(&overlay.colors(), &shading, &target, timer),
        };
        let picture = picture.map_err(text)?;
        let costs = Costs {
            plan_ms,
            texels: match renderer.page_counts() {
                Some(pages) => u64::from(pages.wanted) * PAGE_AREA,
                None => plan.texels(),
            },
            bytes: renderer.shadows().lookup_bytes(),
            map_draws: maps.iter().map(|(_, drawn)| drawn.draws).sum(),
            map_triangles: maps.iter().map(|(_, drawn)| drawn.triangles).sum(),
            picture_draws: picture.draws,
            picture_triangles: picture.triangles,
            ..Costs::default()
        };
        Ok(DrawnPicture { target, plan: Arc::new(plan), costs })
    }

    /// What the camera sees, if maps are fitted to that.
    fn seen(&mut self, fit: Fit, camera: &Camera) -> Result<Option<SeenTiles>, String> {
        if fit != Fit::Seen {
            return Ok(None);
        }
        let text = |e: Error| e.to_string();
        if self.scout.is_none() {
            self.scout = Some(Scout::new(self.gpu, self.buffers).map_err(text)?);
        }
        match &mut self.scout {
            Some(scout) => scout.seen(camera).map_err(text),
            None => Ok(None),
        }
    }

    /// Draws a map of the first picture as a picture of its own.
    fn map(&mut self, map: usize) -> Option<Arc<FrameTarget>> {
        let gpu = self.gpu;
        let easel = self.easels.first_mut()?;
        let renderer = &mut easel.renderers.last_mut()?.renderer;
        let pool = easel.grid.as_ref().zip(renderer.pool_size());
        let [width, height] = match pool {
            Some((_, size)) => size,
            None => renderer.shadows().place(map)?.size,
        };
        let most = width.max(height).div_ceil(MAP_SIDE);
        let target =
            self.map_targets.free(gpu, [width.div_ceil(most), height.div_ceil(most)]).ok()?;
        match pool {
            Some((grid, _)) => renderer.show_pool(grid, &PARTITIONS, &target).ok()?,
            None => renderer.show_map(map, &target).ok()?,
        }
        Some(target)
    }

    /// Measures the time of a picture without lookups.
    fn measure_bare(&mut self, camera: &Camera, light: &Light) {
        let (gpu, buffers) = (self.gpu, self.buffers);
        let bare = &mut self.bare;
        let Some(timer) = &mut bare.timer else { return };
        if bare.renderer.is_none() {
            let options = ShadowOptions { filter: Filter::None, ..ShadowOptions::default() };
            bare.renderer = Renderer::new(gpu, buffers, &options).ok();
        }
        let Some(renderer) = &mut bare.renderer else { return };
        let Ok(target) = bare.targets.free(gpu, camera.image()) else { return };
        let plan = Plan { origin: camera.eye(), filter: Filter::None, ..Plan::default() };
        let shading = Shading { camera, light, light_index: 0 };
        let drawn = renderer
            .draw_maps(&plan, Casters::Unmoved, None)
            .and_then(|_| renderer.frame(&shading, &target, Some(timer)));
        if drawn.is_ok() {
            let times = timer.read(gpu).ok();
            bare.measured = times.map(|times| (self.drawn, camera.image(), times.picture_ms));
        }
    }

    /// Begins what takes longer than a frame, as long as nothing new is requested.
    pub(super) fn rest(&mut self, truths: &Mailbox<TruthJob>, is_moving: &dyn Fn() -> bool) {
        let Some((frame, is_done)) = &mut self.last else { return };
        if std::mem::replace(is_done, true) {
            return;
        }
        let frame = Arc::clone(frame);
        let Request { camera, wants_truth, planned_for, light_size, .. } = frame.request;
        if !wants_truth || planned_for.is_some() {
            return;
        }
        let picture = SharedTruth::new(frame.number, &camera);
        self.reporter.tell(News::Truth(picture.clone()));
        let posed = self.posed.as_ref().and_then(|posed| posed.shared(self.tracer().scene()));
        truths.put(TruthJob { camera, light: frame.light, light_size, posed, picture });
        let shading = Shading { camera: &camera, light: &frame.light, light_index: 0 };
        let height = camera.image()[1];
        for (technique, _) in frame.pictures.iter().enumerate().filter(|(_, p)| p.drawn.is_ok()) {
            let Some(brush) = self.easels[technique].renderers.last_mut() else { continue };
            for first in (0..height).step_by(ROWS as usize) {
                if is_moving() {
                    return;
                }
                let rows = first..height.min(first + ROWS);
                match brush.renderer.samples(&shading, rows, 1, false) {
                    Ok(samples) => {
                        let values = samples.iter().map(|s| s.visibility).collect();
                        let rows = Visibility { frame: frame.number, technique, values };
                        self.reporter.tell(News::Visibility(rows));
                    }
                    Err(e) => return self.reporter.tell(News::Refused(e.to_string())),
                }
            }
        }
    }
}

/// The longest side of the picture of a map, pixels.
const MAP_SIDE: u32 = 1024;

impl<'a> Easel<'a> {
    fn new(gpu: &Gpu) -> Self {
        Self {
            renderers: Vec::new(),
            planner: planner(),
            targets: Targets::default(),
            timer: Timer::new(gpu),
            times: None,
            grid: None,
        }
    }

    fn plan(
        &mut self,
        technique: &NamedTechnique,
        camera: &Camera,
        light: &Light,
        bounds: &Bounds<'_>,
    ) -> Result<Plan, Error> {
        fade(&mut self.planner, camera, bounds)?;
        plan_with(&mut self.planner, technique, camera, light, bounds).cloned()
    }

    /// The renderer with these options, and the timer of its frames.
    fn brush(
        &mut self,
        gpu: &'a Gpu,
        buffers: &'a SceneBuffers,
        options: ShadowOptions,
    ) -> Result<(&mut Brush<'a>, Option<&mut Timer>), String> {
        let brush = match self.renderers.iter().position(|brush| brush.options == options) {
            Some(known) => self.renderers.remove(known),
            None => {
                let renderer = Renderer::new(gpu, buffers, &options).map_err(|e| e.to_string())?;
                Brush { options, renderer, moved: None }
            }
        };
        if self.renderers.len() >= RENDERERS {
            self.renderers.remove(0);
        }
        self.renderers.push(brush);
        let last = self.renderers.len() - 1;
        Ok((&mut self.renderers[last], self.timer.as_mut()))
    }

    fn read_times(&mut self, gpu: &Gpu) {
        // What went wrong is found when the whole frame is checked.
        let times = self.timer.as_mut().and_then(|timer| timer.try_read(gpu).ok().flatten());
        self.times = times.or(self.times);
    }
}

impl Costs {
    fn add_times(&mut self, times: &StageTimes, bare_ms: Option<f64>) {
        self.prepass_ms = Some(times.prepass_ms);
        self.pages_ms = Some(times.pages_ms);
        self.depth_ms = Some(times.depth_ms);
        self.filter_ms = Some(times.filter_ms);
        self.picture_ms = Some(times.picture_ms);
        self.lookup_ms = bare_ms.map(|bare| (times.picture_ms - bare).max(0.0));
    }
}
