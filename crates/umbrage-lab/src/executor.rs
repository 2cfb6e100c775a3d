//! Executors, which render shadow maps and look them up: a GPU, or the reference on the CPU.

use crate::detail::{Detail, inputs};
use crate::error::{About, Error, Field};
use crate::executors::{Executors, GPU, REFERENCE, unfit_for_gpu};
use crate::receivers::Receivers;
use crate::strip::{Rows, Strip};
use glam::DVec3;
use rayon::prelude::*;
use umbrage::paged::Paging;
use umbrage::{Camera, Light, Plan, SeenTiles, Technique};
use umbrage_clusters::build_finest;
use umbrage_render::{
    EdgeOn, FrameTarget, Gpu, Renderer, SceneBuffers, SeenCluster, Shading, Timer,
};
use umbrage_scene::Scene;
use umbrage_trace::{Progress, Reference, Sample, Tracer, View};
use umbrage_wgpu::{Casters, LookupBuffers, SeenReadback, ShadowOptions};

/// A scene that is ready to be rendered, by rays on the CPU and, if there is one, on a GPU.
pub struct RenderScene<'a> {
    tracer: Tracer<'a>,
    gpu: Option<(&'a Gpu, SceneBuffers)>,
    lost_detail: bool,
}

impl<'a> RenderScene<'a> {
    /// Prepares the scene. If `opaque` is true, alpha masks are ignored, so that masked materials
    /// show and cast as solid. `detail` is what a GPU draws of it.
    ///
    /// # Errors
    /// An error if the scene refers to something that it does not contain, or if a GPU cannot hold
    /// it.
    pub fn new(
        scene: &'a Scene,
        executors: &'a Executors,
        opaque: bool,
        detail: &Detail,
    ) -> Result<Self, Error> {
        let tracer = Tracer::new(scene)?.opaque(opaque);
        let clusters = detail.clusters();
        let buffers = |gpu| SceneBuffers::with_clusters(gpu, scene, opaque, clusters).on_gpu();
        let gpu = executors.gpu().map(|gpu| buffers(gpu).map(|b| (gpu, b))).transpose()?;
        let lost_detail =
            clusters.is_some() && gpu.as_ref().is_some_and(|(_, scene)| !scene.has_clusters());
        Ok(Self { tracer, gpu, lost_detail })
    }

    /// Returns the scene in the form that rays are traced in.
    pub fn tracer(&self) -> &Tracer<'a> {
        &self.tracer
    }

    /// Returns what users should know of how the scene is drawn.
    pub fn notice(&self) -> Option<&'static str> {
        self.lost_detail.then_some(
            "The GPU has no room for the scene's levels of detail: all triangles are drawn.",
        )
    }

    /// Returns the GPU and the scene's buffers on it, if there is a GPU.
    pub fn on_gpu(&self) -> Option<(&'a Gpu, &SceneBuffers)> {
        self.gpu.as_ref().map(|(gpu, buffers)| (*gpu, buffers))
    }

    /// Returns what a camera sees, if the maps are fitted to that. A GPU draws the picture and
    /// reduces its depths; without one, rays find them.
    ///
    /// # Errors
    /// An error if a GPU fails.
    pub fn seen(&self, receivers: &Receivers, camera: &Camera) -> Result<Option<SeenTiles>, Error> {
        match &self.gpu {
            Some((gpu, buffers)) if receivers.are_seen() && gpu.support().compute => {
                Scout::new(gpu, buffers)?.seen(camera)
            }
            _ => receivers.seen(&self.tracer, camera),
        }
    }

    /// Returns the number of rows that rendering a technique's plan will report.
    pub fn rows(&self, plan: &Plan, technique: &Technique) -> u64 {
        self.gpu_for(technique).map_or_else(|| Reference::rows(plan), |_| 0)
    }

    /// Returns the GPU and its buffers, if there is a GPU that can render the technique.
    fn gpu_for(&self, technique: &Technique) -> Option<&(&'a Gpu, SceneBuffers)> {
        self.gpu.as_ref().filter(|_| unfit_for_gpu(technique).is_none())
    }

    /// Returns the executor that renders the technique. If `fades` is true, its plans' shadows may
    /// [fade out](umbrage::Plan::fade).
    ///
    /// # Errors
    /// An error if the GPU does not support the technique.
    pub fn executor(&self, technique: &Technique, fades: bool) -> Result<Executor<'_>, Error> {
        let work = match self.gpu_for(technique) {
            Some((gpu, buffers)) => {
                let options = shadow_options(technique, fades);
                make_pages(gpu, buffers, self.tracer.scene(), technique).on_gpu()?;
                let renderer = Renderer::new(gpu, buffers, &options).on_gpu()?;
                let is_prefiltered = technique.filter.prefilter().is_some();
                let timer = is_prefiltered.then(|| Timer::new(gpu)).flatten();
                let tracer = &self.tracer;
                Work::Gpu(Box::new(OnGpu { renderer, gpu, tracer, timer, has_maps: false }))
            }
            None => Work::Reference { tracer: &self.tracer, maps: None },
        };
        Ok(Executor { work })
    }
}

/// The options of a technique's lookups. If `fades` is true, its plans' shadows may
/// [fade out](umbrage::Plan::fade).
pub fn shadow_options(technique: &Technique, fades: bool) -> ShadowOptions {
    ShadowOptions {
        filter: technique.filter,
        buffers: LookupBuffers::for_technique(technique, 1),
        fades,
        pages: technique.paged_error().is_some(),
        ..ShadowOptions::default()
    }
}

/// Makes what a technique's pages are drawn from, unless it has none or the scene has that already.
///
/// # Errors
/// An error if the device has no room for it.
pub fn make_pages(
    gpu: &Gpu,
    buffers: &SceneBuffers,
    scene: &Scene,
    technique: &Technique,
) -> Result<(), umbrage_render::Error> {
    if technique.paged_error().is_none() {
        return Ok(());
    }
    let finest = || build_finest(&inputs(scene));
    buffers.make_pages(gpu, scene, finest)
}

/// Finds on a GPU what cameras see, for maps that are fitted to that.
pub struct Scout<'a> {
    gpu: &'a Gpu,
    renderer: Renderer<'a>,
    target: Option<FrameTarget>,
    readback: SeenReadback,
}

impl<'a> Scout<'a> {
    /// Makes a scout for a scene.
    ///
    /// # Errors
    /// An error if the GPU has no compute shaders.
    pub fn new(gpu: &'a Gpu, buffers: &'a SceneBuffers) -> Result<Self, Error> {
        let readback =
            SeenReadback::new(gpu.device(), &gpu.support()).map_err(umbrage_render::Error::from)?;
        let renderer = Renderer::new(gpu, buffers, &ShadowOptions::default())?;
        Ok(Self { gpu, renderer, target: None, readback })
    }

    /// Draws the picture of a camera, reduces its depths and waits for them.
    ///
    /// # Errors
    /// An error if the GPU fails, or if it cannot hold the picture.
    pub fn seen(&mut self, camera: &Camera) -> Result<Option<SeenTiles>, Error> {
        let Self { gpu, renderer, target, readback } = self;
        let [width, height] = camera.image();
        target.take_if(|t| [t.color().width(), t.color().height()] != [width, height]);
        let target = match target {
            Some(target) => target,
            None => target.insert(FrameTarget::new(gpu, [width, height]).about(Field::Size)?),
        };
        // The light does not matter for depths.
        let light = Light::Directional { direction: DVec3::NEG_Y };
        let shading = Shading { camera, light: &light, light_index: 0 };
        renderer.frame(&shading, target, None)?;
        Ok(renderer.seen(camera, target, readback)?)
    }
}

/// Renders a technique's shadow maps and looks them up.
pub struct Executor<'a> {
    pub(crate) work: Work<'a>,
}

/// The GPU or the CPU reference that does the work, with the maps that are rendered.
pub(crate) enum Work<'a> {
    Gpu(Box<OnGpu<'a>>),
    Reference { tracer: &'a Tracer<'a>, maps: Option<(&'a Plan, Reference<'a>)> },
}

/// A GPU that renders a technique.
pub(crate) struct OnGpu<'a> {
    pub(crate) renderer: Renderer<'a>,
    pub(crate) gpu: &'a Gpu,
    /// Finds the triangles that the maps of a lamp leave out.
    tracer: &'a Tracer<'a>,
    /// Measures the time of the prefilter; `None` without a prefilter or without timestamps.
    timer: Option<Timer>,
    /// Whether maps are drawn.
    has_maps: bool,
}

impl OnGpu<'_> {
    /// Returns rows of a picture. Texels are only computed if `wants_texels` is true.
    fn strip(&mut self, rows: &Rows<'_>, wants_texels: bool) -> Result<Strip, Error> {
        let view = rows.view();
        let (rows, grid) = (rows.range(), view.grid());
        let samples = self.renderer.samples(&shading(view), rows, grid, wants_texels)?;
        Ok(Strip::of_gpu(&samples, view))
    }
}

/// What a GPU shades the picture of a view with.
fn shading<'a>(view: &'a View<'_>) -> Shading<'a> {
    Shading { camera: view.camera(), light: view.light(), light_index: 0 }
}

/// Returns the triangles that a plan's lamps lie in, which must be
/// [left out](Renderer::leave_out) of their maps.
pub fn edge_on(plan: &Plan, tracer: &Tracer<'_>) -> Vec<EdgeOn> {
    let lamps = plan.lights.iter().enumerate().filter_map(|(light, planned)| {
        let mut maps = plan.maps[planned.maps.clone()].iter();
        maps.find_map(|m| Some((light, m.apex? + m.origin)))
    });
    let triangles = lamps.flat_map(|(light, lamp)| {
        let found = tracer.edge_on_at(lamp).into_iter();
        found.map(move |p| EdgeOn { light, instance: p.instance as usize, triangle: p.triangle })
    });
    triangles.collect()
}

impl<'a> Executor<'a> {
    /// Returns `gpu` or `reference`.
    pub fn name(&self) -> &'static str {
        if self.is_gpu() { GPU } else { REFERENCE }
    }

    /// Returns whether the executor is a GPU.
    pub fn is_gpu(&self) -> bool {
        matches!(self.work, Work::Gpu(_))
    }

    /// Renders the maps of a plan, which replace those of the plan before. Returns how much of the
    /// time filtering took, milliseconds, if that can be measured separately.
    ///
    /// # Errors
    /// An error if a GPU fails, or if the maps do not fit into memory.
    pub fn render(&mut self, new: &'a Plan, progress: Progress<'_>) -> Result<Option<f64>, Error> {
        match &mut self.work {
            Work::Gpu(on) => {
                let OnGpu { renderer, gpu, tracer, timer, has_maps } = &mut **on;
                renderer.leave_out(edge_on(new, tracer));
                renderer.draw_maps(new, Casters::Unmoved, timer.as_mut()).on_gpu()?;
                gpu.wait()?;
                *has_maps = true;
                Ok(timer.as_mut().map(|t| t.read(gpu)).transpose()?.map(|times| times.filter_ms))
            }
            Work::Reference { tracer, maps } => {
                *maps = Some((new, Reference::render(tracer, new, progress)?));
                Ok(None)
            }
        }
    }

    /// Returns the memory that lookup reads of the rendered maps, bytes.
    pub fn bytes(&self) -> u64 {
        match &self.work {
            Work::Gpu(on) => on.renderer.shadows().lookup_bytes(),
            Work::Reference { maps, .. } => maps.as_ref().map_or(0, |(_, r)| r.bytes()),
        }
    }

    /// Returns the number of pages that the pictures since [`render`](Self::render) have looked up
    /// or, on a GPU, of those in use, with the ones that stand in for others; `None` if the plan has
    /// no pages.
    pub fn pages(&mut self) -> Option<usize> {
        match &mut self.work {
            Work::Gpu(on) => on.renderer.page_counts().map(|counts| counts.wanted as usize),
            Work::Reference { maps, .. } => {
                let (plan, reference) = maps.as_ref()?;
                plan.paging.as_ref().map(|_| reference.pages())
            }
        }
    }

    /// Returns the greatest width of a texel that a receiver has, pixels; `None` if the plan has no
    /// pages, or before its maps are rendered.
    pub fn bound_px(&mut self) -> Option<f64> {
        match &mut self.work {
            Work::Gpu(on) => on.renderer.page_counts().map(|counts| counts.bound.into()),
            Work::Reference { maps, .. } => maps.as_ref()?.0.paging.as_ref().map(Paging::bound),
        }
    }

    /// Returns rows of a picture with the shadows of the rendered maps.
    ///
    /// # Errors
    /// An error if a GPU fails, or [`Error::NoMaps`] if the CPU reference has rendered no maps.
    pub fn strip(&mut self, rows: &Rows<'_>) -> Result<Strip, Error> {
        match &mut self.work {
            Work::Gpu(on) => on.strip(rows, true),
            Work::Reference { maps, .. } => {
                let (plan, reference) = maps.as_ref().ok_or(Error::NoMaps)?;
                Ok(rows.by_reference(plan, reference))
            }
        }
    }

    /// Returns rows of a picture without shadow maps. A GPU executor must not have rendered maps
    /// before.
    ///
    /// # Errors
    /// An error if a GPU fails.
    pub fn shape(&mut self, rows: &Rows<'_>) -> Result<Strip, Error> {
        match &mut self.work {
            // A renderer that has drawn no maps lets all light through.
            Work::Gpu(on) => on.strip(rows, false),
            Work::Reference { .. } => Ok(rows.in_full_light()),
        }
    }

    /// Returns the cluster of triangles in the middle of each pixel of some rows, as frames to look
    /// at are drawn; `None` in the sky, and everywhere by the reference, which has no clusters.
    ///
    /// # Errors
    /// An error if a GPU fails.
    pub fn clusters(&mut self, rows: &Rows<'_>) -> Result<Vec<Option<SeenCluster>>, Error> {
        let view = rows.view();
        match &mut self.work {
            Work::Gpu(on) => Ok(on.renderer.seen_clusters(&shading(view), rows.range())?),
            Work::Reference { .. } => {
                Ok(vec![None; rows.range().len() * view.camera().image()[0] as usize])
            }
        }
    }

    /// Returns how much light the rendered maps let through to each sample, 0 to 1. The samples
    /// must be on surfaces that face the light.
    ///
    /// # Errors
    /// An error if a GPU fails, or [`Error::NoMaps`] if no maps were rendered.
    pub fn visibility(&mut self, samples: &[&Sample]) -> Result<Vec<f32>, Error> {
        match &mut self.work {
            Work::Gpu(on) => {
                if !on.has_maps {
                    return Err(Error::NoMaps);
                }
                let points: Vec<_> = samples
                    .iter()
                    .map(|s| [s.surface.position, s.surface.geometric_normal])
                    .collect();
                Ok(on.renderer.visibility(0, &points)?)
            }
            Work::Reference { maps, .. } => {
                let (_, reference) = maps.as_ref().ok_or(Error::NoMaps)?;
                Ok(samples.par_iter().map(|s| reference.visibility(0, s)).collect())
            }
        }
    }
}
