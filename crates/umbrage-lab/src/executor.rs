//! Who renders shadow maps and looks them up: a GPU, or the reference on the CPU.

use crate::error::{About, Error};
use crate::executors::{Executors, GPU, REFERENCE, runs_on_gpu};
use crate::strip::{Rows, Strip};
use rayon::prelude::*;
use umbrage::{Plan, Technique};
use umbrage_render::{Gpu, Renderer, SceneBuffers, Shading, Timer};
use umbrage_scene::Scene;
use umbrage_trace::{Progress, Reference, Sample, Tracer};
use umbrage_wgpu::{Casters, ShadowOptions};

/// A scene where it can be rendered: in the memory of rays, and in a GPU's if there is one.
pub struct RenderScene<'a> {
    tracer: Tracer<'a>,
    gpu: Option<(&'a Gpu, SceneBuffers<'a>)>,
}

impl<'a> RenderScene<'a> {
    /// `opaque`: alpha-masked materials cast and show as solid.
    ///
    /// # Errors
    /// A scene that refers to what it does not have, or that a GPU does not hold.
    pub fn new(scene: &'a Scene, executors: &'a Executors, opaque: bool) -> Result<Self, Error> {
        let tracer = Tracer::new(scene)?.opaque(opaque);
        let buffers = |gpu| SceneBuffers::new(gpu, scene, opaque).on_gpu();
        let gpu = executors.gpu().map(|gpu| buffers(gpu).map(|b| (gpu, b))).transpose()?;
        Ok(Self { tracer, gpu })
    }

    /// The scene, ready for rays.
    pub fn tracer(&self) -> &Tracer<'a> {
        &self.tracer
    }

    /// Rows that rendering a technique's plan will report.
    pub fn rows(&self, plan: &Plan, technique: &Technique) -> u64 {
        self.gpu_for(technique).map_or_else(|| Reference::rows(plan), |_| 0)
    }

    /// The GPU, if there is one that can render a technique.
    fn gpu_for(&self, technique: &Technique) -> Option<&(&'a Gpu, SceneBuffers<'a>)> {
        self.gpu.as_ref().filter(|_| runs_on_gpu(technique))
    }

    /// Who renders a technique.
    ///
    /// # Errors
    /// What a GPU refuses.
    pub fn executor(&self, technique: &Technique) -> Result<Executor<'_>, Error> {
        let filter = technique.filter;
        let work = match self.gpu_for(technique) {
            Some((gpu, buffers)) => {
                let options = ShadowOptions { filter, ..ShadowOptions::default() };
                let renderer = Renderer::new(gpu, buffers, &options).on_gpu()?;
                let is_prefiltered = filter.prefilter().is_some();
                let timer = is_prefiltered.then(|| Timer::new(gpu)).flatten();
                Work::Gpu(Box::new(OnGpu { renderer, gpu, timer, plan: None }))
            }
            None => Work::Reference { tracer: &self.tracer, maps: None },
        };
        Ok(Executor { work })
    }
}

/// Renders a technique's maps and looks them up.
pub struct Executor<'a> {
    pub(crate) work: Work<'a>,
}

/// Who does it.
pub(crate) enum Work<'a> {
    Gpu(Box<OnGpu<'a>>),
    Reference { tracer: &'a Tracer<'a>, maps: Option<(&'a Plan, Reference<'a>)> },
}

/// A GPU at work.
pub(crate) struct OnGpu<'a> {
    pub(crate) renderer: Renderer<'a, 'a>,
    pub(crate) gpu: &'a Gpu,
    /// Tells how long filtering takes, where there is anything to tell.
    timer: Option<Timer>,
    /// Whose maps are drawn.
    plan: Option<&'a Plan>,
}

impl OnGpu<'_> {
    /// What rows of a picture show; where texels lie only if that is wanted.
    fn strip(&mut self, rows: &Rows<'_>, wants_texels: bool) -> Result<Strip, Error> {
        let view = rows.view();
        let shading = Shading { camera: view.camera(), light: view.light(), light_index: 0 };
        let samples = self.renderer.samples(&shading, rows.range(), view.grid(), wants_texels)?;
        Ok(Strip::of_gpu(&samples, view))
    }
}

impl<'a> Executor<'a> {
    /// `gpu` or `reference`.
    pub fn name(&self) -> &'static str {
        if self.is_gpu() { GPU } else { REFERENCE }
    }

    /// Whether it is a GPU.
    pub fn is_gpu(&self) -> bool {
        matches!(self.work, Work::Gpu(_))
    }

    /// Renders the maps of a plan, in place of those of the one before. Gives the milliseconds that
    /// filtering took of that, where they are told apart.
    ///
    /// # Errors
    /// What a GPU refuses, or maps that do not fit into memory.
    pub fn render(&mut self, new: &'a Plan, progress: Progress<'_>) -> Result<Option<f64>, Error> {
        match &mut self.work {
            Work::Gpu(on) => {
                let OnGpu { renderer, gpu, timer, plan } = &mut **on;
                renderer.draw_maps(new, Casters::Unmoved, timer.as_ref()).on_gpu()?;
                gpu.wait()?;
                *plan = Some(new);
                Ok(timer.as_ref().map(|t| t.read(gpu)).transpose()?.map(|[_, filter, _]| filter))
            }
            Work::Reference { tracer, maps } => {
                *maps = Some((new, Reference::render(tracer, new, progress)?));
                Ok(None)
            }
        }
    }

    /// Memory of what lookup reads of the maps that are rendered, bytes.
    pub fn bytes(&self) -> u64 {
        match &self.work {
            Work::Gpu(on) => on.renderer.shadows().lookup_bytes(),
            Work::Reference { maps, .. } => maps.as_ref().map_or(0, |(_, r)| r.bytes()),
        }
    }

    /// What rows of a picture show with the maps that are rendered.
    ///
    /// # Errors
    /// What a GPU refuses, or [`Error::NoMaps`].
    pub fn strip(&mut self, rows: &Rows<'_>) -> Result<Strip, Error> {
        match &mut self.work {
            Work::Gpu(on) => on.strip(rows, true),
            Work::Reference { maps, .. } => {
                let (plan, reference) = maps.as_ref().ok_or(Error::NoMaps)?;
                Ok(rows.by_reference(plan, reference))
            }
        }
    }

    /// What rows of a picture show without any maps.
    ///
    /// # Errors
    /// What a GPU refuses.
    pub fn shape(&mut self, rows: &Rows<'_>) -> Result<Strip, Error> {
        match &mut self.work {
            // Maps that there are not let all light through.
            Work::Gpu(on) => on.strip(rows, false),
            Work::Reference { .. } => Ok(rows.in_full_light()),
        }
    }

    /// How much light the maps that are rendered let through to points of surfaces that face it, 0
    /// to 1 each.
    ///
    /// # Errors
    /// What a GPU refuses, or [`Error::NoMaps`].
    pub fn visibility(&mut self, samples: &[&Sample]) -> Result<Vec<f32>, Error> {
        match &mut self.work {
            Work::Gpu(on) => {
                let plan = on.plan.ok_or(Error::NoMaps)?;
                let points: Vec<_> = samples
                    .iter()
                    .map(|s| [s.surface.position, s.surface.geometric_normal])
                    .collect();
                Ok(on.renderer.visibility(plan, 0, &points)?)
            }
            Work::Reference { maps, .. } => {
                let (_, reference) = maps.as_ref().ok_or(Error::NoMaps)?;
                Ok(samples.par_iter().map(|s| reference.visibility(0, s)).collect())
            }
        }
    }
}
