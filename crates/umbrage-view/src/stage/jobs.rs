//! Jobs that take long, beside the frames: measuring techniques, saving pictures and turntables.

use super::errors::{Visibility, errors};
use super::mailbox::Mailbox;
use super::request::{Frame, Request};
use super::truth::{SharedTruth, TruthJob, trace};
use super::{News, Reporter};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};
use umbrage::visibility::{Filter, LightSize};
use umbrage::{Camera, Light, Plan};
use umbrage_lab::{
    Bencher, NamedTechnique, PreparedScene, Rows, edge_on, make_pages, milliseconds, plan,
    plan_fading, shadow_options, unfit_for_gpu,
};
use umbrage_measure::Image;
use umbrage_render::{FrameTarget, Gpu, Renderer, Shading};
use umbrage_trace::View;
use umbrage_wgpu::Casters;

/// A job that takes long.
pub(crate) enum Job {
    /// Measures techniques in a view.
    Measure {
        techniques: Vec<NamedTechnique>,
        camera: Camera,
        light: Light,
        light_size: Option<LightSize>,
    },
    /// Saves a picture of a frame.
    Save { frame: Arc<Frame>, picture: usize, path: PathBuf },
    /// Saves a picture of each camera, with names that count them, in a folder.
    Turntable { technique: NamedTechnique, cameras: Vec<Camera>, light: Light, folder: PathBuf },
}

/// What a technique is worth in a view, or why that is not known.
#[derive(Clone, Debug)]
pub(crate) struct Measurement {
    pub(crate) shadows: String,
    pub(crate) result: Result<Worth, String>,
}

/// What a technique is worth in a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Worth {
    /// Share of wrong pixels, and mean error of visibility; `None` if no pixel counts.
    pub(crate) wrong_fraction: Option<f64>,
    pub(crate) mean_abs_error: Option<f64>,
    /// Time that planning takes, milliseconds.
    pub(crate) plan_ms: f64,
    /// Time that maps and lookups take: that of a frame less that of one without shadows.
    pub(crate) frame_ms: f64,
    /// Memory that lookups read, bytes.
    pub(crate) bytes: u64,
}

/// Does jobs until the scene is given up.
pub(super) fn do_jobs(
    prepared: &PreparedScene<'_>,
    jobs: &Receiver<Job>,
    requests: &Mailbox<Request>,
    reporter: &Reporter,
) {
    const LOOK: Duration = Duration::from_millis(100);
    let is_given_up = || requests.is_closed();
    loop {
        let job = match jobs.recv_timeout(LOOK) {
            Ok(job) => job,
            Err(RecvTimeoutError::Timeout) if !is_given_up() => continue,
            Err(_) => return,
        };
        let worker = Worker { prepared, reporter, is_given_up: &is_given_up };
        let done = catch_unwind(AssertUnwindSafe(|| match job {
            Job::Measure { techniques, camera, light, light_size } => {
                worker.measure(&techniques, camera, light, light_size)
            }
            Job::Save { frame, picture, path } => worker.save(&frame, picture, &path),
            Job::Turntable { technique, cameras, light, folder } => {
                worker.turntable(&technique, &cameras, &light, &folder)
            }
        }));
        let done = done.unwrap_or_else(|_| Err("the program failed".into()));
        reporter.tell(News::JobDone(done));
    }
}

/// Does a job.
struct Worker<'w, 'a> {
    prepared: &'a PreparedScene<'a>,
    reporter: &'w Reporter,
    is_given_up: &'w dyn Fn() -> bool,
}

impl Worker<'_, '_> {
    fn gpu(&self) -> Result<&Gpu, String> {
        Ok(self.prepared.render().on_gpu().ok_or("there is no GPU")?.0)
    }

    /// Measures one technique after the other, each of which appears when it is known.
    fn measure(
        &self,
        techniques: &[NamedTechnique],
        camera: Camera,
        light: Light,
        light_size: Option<LightSize>,
    ) -> Result<String, String> {
        let tracer = self.prepared.render().tracer();
        let picture = SharedTruth::new(0, &camera);
        let job = TruthJob { camera, light, light_size, posed: None, picture };
        let parts = techniques.len() as f32 + 1.0;
        let grew = || {
            let share = job.picture.lock().share;
            self.reporter.tell(News::Job("tracing the truth".into(), share / parts));
        };
        trace(tracer, &job, self.is_given_up, &grew)?;
        let view = View::new(tracer, camera, light, 1).map_err(|e| e.to_string())?;
        let none = "none".parse().map_err(|e: umbrage_lab::TechniqueError| e.to_string())?;
        let no_maps = Plan { origin: camera.eye(), filter: Filter::None, ..Plan::default() };
        let bare_ms = self.frame_ms(&none, &view, &no_maps)?;
        for (i, technique) in techniques.iter().enumerate() {
            if (self.is_given_up)() {
                return Err("the scene was closed".into());
            }
            let shadows = technique.to_string();
            self.reporter.tell(News::Job(format!("measuring {shadows}"), (i + 1) as f32 / parts));
            let result = self.worth(technique, &view, &job, bare_ms);
            self.reporter.tell(News::Measured(Measurement { shadows, result }));
        }
        Ok("measured".into())
    }

    fn worth(
        &self,
        technique: &NamedTechnique,
        view: &View<'_>,
        job: &TruthJob,
        bare_ms: f64,
    ) -> Result<Worth, String> {
        let text = |e: umbrage_lab::Error| e.to_string();
        let bounds = self.prepared.receivers().bounds(None);
        let start = Instant::now();
        let plan = plan(technique, view.camera(), view.light(), &bounds).map_err(text)?;
        let plan_ms = milliseconds(start);
        let frame_ms = (self.frame_ms(technique, view, &plan)? - bare_ms).max(0.0);
        let mut executor =
            self.prepared.render().executor(technique.technique(), false).map_err(text)?;
        executor.render(&plan, &|_| {}).map_err(text)?;
        let mut values = Vec::new();
        for range in view.bands() {
            let strip = executor.strip(&Rows::new(view, range, &|_| {})).map_err(text)?;
            values.extend_from_slice(strip.visibility());
        }
        let visibility = Visibility { frame: 0, technique: 0, values };
        let tally = errors(&job.picture.lock(), &visibility, technique.is_soft());
        Ok(Worth {
            wrong_fraction: tally.and_then(|t| t.wrong_fraction()),
            mean_abs_error: tally.and_then(|t| t.mean_abs_error()),
            plan_ms,
            frame_ms,
            bytes: executor.bytes(),
        })
    }

    /// The time of a frame with all its maps, milliseconds: the least of several.
    fn frame_ms(
        &self,
        technique: &NamedTechnique,
        view: &View<'_>,
        plan: &Plan,
    ) -> Result<f64, String> {
        const FRAMES: u32 = 4;
        let (render, receivers) = (self.prepared.render(), self.prepared.receivers());
        let size = view.camera().image();
        let text = |e: umbrage_lab::Error| e.to_string();
        let mut bencher =
            Bencher::new(render, technique.technique(), receivers, size).map_err(text)?;
        let mut least = f64::INFINITY;
        for _ in 0..FRAMES {
            let costs = bencher.frame(view, plan, false).map_err(text)?;
            least = least.min(costs.depth + costs.filter.unwrap_or(0.0) + costs.shade);
        }
        Ok(least)
    }

    fn save(&self, frame: &Frame, picture: usize, path: &Path) -> Result<String, String> {
        let picture = frame.pictures.get(picture).ok_or("there is no such picture")?;
        let drawn = picture.drawn.as_ref().map_err(String::clone)?;
        write(self.gpu()?, &drawn.target, path)?;
        Ok(format!("saved {}", path.display()))
    }

    fn turntable(
        &self,
        technique: &NamedTechnique,
        cameras: &[Camera],
        light: &Light,
        folder: &Path,
    ) -> Result<String, String> {
        let text = |e: umbrage_render::Error| e.to_string();
        if let Some(reason) = unfit_for_gpu(technique.technique()) {
            return Err(reason.into());
        }
        let (gpu, buffers) = self.prepared.render().on_gpu().ok_or("there is no GPU")?;
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let options = shadow_options(technique.technique(), true);
        let tracer = self.prepared.render().tracer();
        make_pages(gpu, buffers, tracer.scene(), technique.technique()).map_err(text)?;
        let mut renderer = Renderer::new(gpu, buffers, &options).map_err(text)?;
        for (i, camera) in cameras.iter().enumerate() {
            if (self.is_given_up)() {
                return Err("the scene was closed".into());
            }
            self.reporter.tell(News::Job("turntable".into(), i as f32 / cameras.len() as f32));
            let target = FrameTarget::new(gpu, camera.image()).map_err(text)?;
            let bounds = self.prepared.receivers().bounds(None);
            let plan = plan_fading(technique, camera, light, &bounds).map_err(|e| e.to_string())?;
            renderer.leave_out(edge_on(&plan, tracer));
            renderer.draw_maps(&plan, Casters::Unmoved, None).map_err(text)?;
            let shading = Shading { camera, light, light_index: 0 };
            renderer.frame(&shading, &target, None).map_err(text)?;
            write(gpu, &target, &folder.join(format!("turntable_{i:03}.png")))?;
        }
        Ok(format!("saved {} pictures in {}", cameras.len(), folder.display()))
    }
}

fn write(gpu: &Gpu, target: &FrameTarget, path: &Path) -> Result<(), String> {
    let pixels = target.read(gpu).map_err(|e| e.to_string())?;
    let opaque = pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
    let size = target.size();
    let image = Image::new(size, opaque).map_err(|e| e.to_string())?;
    umbrage_measure::write_png(path, &image).map_err(|e| e.to_string())
}
