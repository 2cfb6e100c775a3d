//! Who renders shadow maps: a GPU, or the reference on the CPU.

use crate::args::{Backend, ExecutionArgs};
use crate::output::note;
use crate::pixels::{Rows, Strip, milliseconds};
use crate::spec::Spec;
use anyhow::{Context, Result, anyhow, bail};
use rayon::prelude::*;
use std::time::Instant;
use umbrage::visibility::Filter;
use umbrage::{Plan, Warp};
use umbrage_render::{Drawn, FrameTarget, Gpu, Renderer, SceneBuffers, Shading, Timer};
use umbrage_scene::Scene;
use umbrage_trace::{Progress, Reference, Sample, Tracer, View};
use umbrage_wgpu::{Casters, ShadowOptions};

/// What there is to render with.
pub(crate) struct Execution {
    gpu: Option<Gpu>,
    /// What to say of it to whoever left the choice to us.
    choice: Option<String>,
}

impl Execution {
    /// Opens what the arguments ask for.
    pub(crate) fn open(args: &ExecutionArgs, techniques: &[Spec]) -> Result<Self> {
        let log = techniques.iter().find(|t| !runs_on_gpu(t));
        match args.backend {
            Backend::Reference => Ok(Self { gpu: None, choice: None }),
            Backend::Gpu => {
                if let Some(spec) = log {
                    return Err(anyhow!(
                        "--backend: no GPU rasterises the rows of `{}`; take reference or auto",
                        spec
                    ));
                }
                let gpu = Gpu::open().map_err(|e| anyhow!("--backend: {e}; take reference"))?;
                Ok(Self { gpu: Some(gpu), choice: None })
            }
            Backend::Auto if log.is_some() && techniques.len() == 1 => Ok(Self {
                gpu: None,
                choice: Some("reference, on the CPU (no GPU rasterises `log`)".to_owned()),
            }),
            Backend::Auto => Ok(match Gpu::open() {
                Ok(gpu) => {
                    let software = if gpu.is_software() { ", in software" } else { "" };
                    let log = log.map_or(String::new(), |t| {
                        format!("; reference for `{}`, which no GPU rasterises", t)
                    });
                    let choice = format!("gpu, {}{software}{log}", gpu.info().name);
                    Self { gpu: Some(gpu), choice: Some(choice) }
                }
                Err(e) => Self { gpu: None, choice: Some(format!("reference, on the CPU ({e})")) },
            }),
        }
    }

    /// Says what was chosen, if the choice was ours.
    pub(crate) fn announce(&self) {
        if let Some(choice) = &self.choice {
            note(&format!("backend: {choice}"));
        }
    }

    /// The GPU, if there is one.
    pub(crate) fn gpu(&self) -> Option<&Gpu> {
        self.gpu.as_ref()
    }

    /// Name of what renders what can be rendered so.
    pub(crate) fn name(&self) -> &'static str {
        if self.gpu.is_some() { GPU } else { REFERENCE }
    }

    /// The GPU's own name.
    pub(crate) fn device(&self) -> Option<String> {
        self.gpu.as_ref().map(|gpu| gpu.info().name.clone())
    }
}

const GPU: &str = "gpu";
const REFERENCE: &str = "reference";

fn runs_on_gpu(spec: &Spec) -> bool {
    spec.technique().warp != Warp::Log
}

/// A scene where it can be rendered.
pub(crate) struct Sets<'a> {
    pub(crate) tracer: Tracer<'a>,
    gpu: Option<(&'a Gpu, SceneBuffers<'a>)>,
}

impl<'a> Sets<'a> {
    /// `opaque`: alpha-masked materials cast and show as solid.
    pub(crate) fn new(scene: &'a Scene, execution: &'a Execution, opaque: bool) -> Result<Self> {
        let tracer = Tracer::new(scene)?.opaque(opaque);
        let buffers = |gpu| SceneBuffers::new(gpu, scene, opaque).context("--backend gpu");
        let gpu = execution.gpu().map(|gpu| buffers(gpu).map(|b| (gpu, b))).transpose()?;
        Ok(Self { tracer, gpu })
    }

    /// Rows that rendering a plan's maps will report.
    pub(crate) fn rows(&self, plan: &Plan, spec: &Spec) -> u64 {
        self.gpu_for(spec).map_or_else(|| Reference::rows(plan), |_| 0)
    }

    /// The GPU, if there is one that can render a technique.
    fn gpu_for(&self, spec: &Spec) -> Option<&(&'a Gpu, SceneBuffers<'a>)> {
        self.gpu.as_ref().filter(|_| runs_on_gpu(spec))
    }

    /// Who renders a technique.
    pub(crate) fn executor(&self, spec: &Spec) -> Result<Executor<'_>> {
        let filter = spec.technique().filter;
        match self.gpu_for(spec) {
            Some((gpu, buffers)) => {
                let options = ShadowOptions { filter, ..ShadowOptions::default() };
                let renderer = Renderer::new(gpu, buffers, &options).context("--backend gpu")?;
                let is_prefiltered = matches!(filter, Filter::Prefiltered(_));
                let timer = is_prefiltered.then(|| Timer::new(gpu)).flatten();
                Ok(Executor::Gpu(Box::new(OnGpu { renderer, gpu, timer, plan: None })))
            }
            None => Ok(Executor::Reference { tracer: &self.tracer, maps: None }),
        }
    }
}

/// Renders a technique's maps and looks them up.
pub(crate) enum Executor<'a> {
    Gpu(Box<OnGpu<'a>>),
    Reference { tracer: &'a Tracer<'a>, maps: Option<(&'a Plan, Reference<'a>)> },
}

/// A GPU at work.
pub(crate) struct OnGpu<'a> {
    renderer: Renderer<'a, 'a>,
    gpu: &'a Gpu,
    /// Tells how long filtering takes, where there is anything to tell.
    timer: Option<Timer>,
    /// Whose maps are drawn.
    plan: Option<&'a Plan>,
}

impl OnGpu<'_> {
    /// What rows of a picture look like; where texels lie only if that is wanted.
    fn strip(&mut self, rows: &Rows<'_>, wants_texels: bool) -> Result<Strip> {
        let (camera, grid) = (rows.view.camera(), rows.view.grid());
        let shading = Shading { camera, light: rows.view.light(), light_index: 0 };
        let samples = self.renderer.samples(&shading, rows.range.clone(), grid, wants_texels)?;
        Ok(Strip::of_gpu(&samples, rows.view))
    }
}

impl<'a> Executor<'a> {
    /// `gpu` or `reference`.
    pub(crate) fn name(&self) -> &'static str {
        if self.is_gpu() { GPU } else { REFERENCE }
    }

    /// Whether it is a GPU.
    pub(crate) fn is_gpu(&self) -> bool {
        matches!(self, Self::Gpu(_))
    }

    /// Renders the maps of a plan, in place of those of the one before. Gives the milliseconds that filtering took of that, where they are told apart.
    pub(crate) fn render(&mut self, new: &'a Plan, progress: Progress<'_>) -> Result<Option<f64>> {
        match self {
            Self::Gpu(on) => {
                let OnGpu { renderer, gpu, timer, plan } = &mut **on;
                renderer
                    .draw_maps(new, Casters::Unmoved, timer.as_ref())
                    .context("--backend gpu")?;
                gpu.wait()?;
                *plan = Some(new);
                Ok(timer.as_ref().map(|t| t.read(gpu)).transpose()?.map(|[_, filter, _]| filter))
            }
            Self::Reference { tracer, maps } => {
                *maps = Some((new, Reference::render(tracer, new, progress)?));
                Ok(None)
            }
        }
    }

    /// Memory of what lookup reads of the maps that are rendered.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Gpu(on) => on.renderer.shadows().lookup_bytes(),
            Self::Reference { maps, .. } => maps.as_ref().map_or(0, |(_, r)| r.bytes()),
        }
    }

    /// What rows of a picture look like. The maps must be rendered.
    pub(crate) fn strip(&mut self, rows: &Rows<'_>) -> Result<Strip> {
        match self {
            Self::Gpu(on) => on.strip(rows, true),
            Self::Reference { maps, .. } => {
                let (plan, reference) = maps.as_ref().context("maps are rendered first")?;
                Ok(rows.by_reference(plan, reference))
            }
        }
    }

    /// What rows of a picture look like without any maps.
    pub(crate) fn shape(&mut self, rows: &Rows<'_>) -> Result<Strip> {
        match self {
            // Maps that there are not let all light through.
            Self::Gpu(on) => on.strip(rows, false),
            Self::Reference { .. } => Ok(rows.in_full_light()),
        }
    }

    /// How much light the maps let through to points of surfaces that face it.
    pub(crate) fn visibility(&mut self, samples: &[&Sample]) -> Result<Vec<f32>> {
        match self {
            Self::Gpu(on) => {
                let plan = on.plan.context("maps are rendered first")?;
                let points: Vec<_> = samples
                    .iter()
                    .map(|s| [s.surface.position, s.surface.geometric_normal])
                    .collect();
                Ok(on.renderer.visibility(plan, 0, &points)?)
            }
            Self::Reference { maps, .. } => {
                let (_, reference) = maps.as_ref().context("maps are rendered first")?;
                Ok(samples.par_iter().map(|s| reference.visibility(0, s)).collect())
            }
        }
    }
}

/// What a frame cost, milliseconds.
pub(crate) struct Costs {
    /// Memory of what lookup reads.
    pub(crate) bytes: u64,
    pub(crate) depth: f64,
    /// Where it is told apart from `depth`, and there is any.
    pub(crate) filter: Option<f64>,
    pub(crate) shade: f64,
    /// Into which map what was drawn, where that is told.
    pub(crate) drawn: Option<Vec<(usize, Drawn)>>,
}

/// Draws frame after frame for a stop-watch.
pub(crate) struct Bencher<'a> {
    executor: Executor<'a>,
    /// What a GPU draws into, and its watch if it has one.
    target: Option<(FrameTarget, Option<Timer>)>,
}

impl Sets<'_> {
    /// Who draws frames of so many pixels.
    pub(crate) fn bencher(&self, spec: &Spec, size: [u32; 2]) -> Result<Bencher<'_>> {
        let executor = self.executor(spec)?;
        let target = match &executor {
            Executor::Gpu(on) => {
                Some((FrameTarget::new(on.gpu, size).context("--size")?, Timer::new(on.gpu)))
            }
            Executor::Reference { .. } => None,
        };
        Ok(Bencher { executor, target })
    }
}

impl Bencher<'_> {
    /// Who draws.
    pub(crate) fn executor(&self) -> &Executor<'_> {
        &self.executor
    }

    /// Whether the GPU tells how long its passes take.
    pub(crate) fn has_timestamps(&self) -> bool {
        matches!(self.target, Some((_, Some(_))))
    }

    /// Draws a frame, and waits until it is done. `still`: maps that are as they were are not drawn again.
    pub(crate) fn frame(&mut self, view: &View<'_>, plan: &Plan, still: bool) -> Result<Costs> {
        let start = Instant::now();
        match (&mut self.executor, &self.target) {
            (Executor::Gpu(on), Some((target, timer))) => {
                let OnGpu { renderer, gpu, .. } = &mut **on;
                let casters = if still { Casters::Unmoved } else { Casters::Moved };
                let shading =
                    Shading { camera: view.camera(), light: view.light(), light_index: 0 };
                let drawn = renderer.draw_maps(plan, casters, timer.as_ref())?;
                let [depth, filter, shade] = match timer {
                    Some(timer) => {
                        renderer.frame(&shading, target, Some(timer))?;
                        timer.read(gpu)?
                    }
                    None => {
                        gpu.wait()?;
                        let depth = milliseconds(start);
                        let shaded = Instant::now();
                        renderer.frame(&shading, target, None)?;
                        gpu.wait()?;
                        [depth, 0.0, milliseconds(shaded)]
                    }
                };
                let is_still = drawn.is_empty();
                let [depth, filter] = if is_still { [0.0; 2] } else { [depth, filter] };
                let is_prefiltered =
                    matches!(renderer.shadows().options().filter, Filter::Prefiltered(_));
                let filter = Some(filter).filter(|_| is_prefiltered && timer.is_some());
                let bytes = renderer.shadows().lookup_bytes();
                Ok(Costs { bytes, depth, filter, shade, drawn: Some(drawn) })
            }
            (Executor::Reference { tracer, .. }, _) => {
                let reference = Reference::render(tracer, plan, &|_| {})?;
                let depth = milliseconds(start);
                let shading = Instant::now();
                for range in view.bands() {
                    Rows::new(view, range, &|_| {}).by_reference(plan, &reference);
                }
                let bytes = reference.bytes();
                Ok(Costs { bytes, depth, filter: None, shade: milliseconds(shading), drawn: None })
            }
            (Executor::Gpu(_), None) => bail!("a GPU draws into a target"),
        }
    }
}
