//! What shadows cost: for each scene and each technique the times of planning, drawing the maps and
//! looking them up, beside the same in plain wgpu and beside the same frame without shadows. All
//! frames take turns within one run.
//!
//! ```sh
//! cargo bench -p umbrage-render
//! cargo bench -p umbrage-render -- --help
//! ```
//!
//! The binary also runs by itself: `frames --bench --folder SCENES`.
//!
//! Alpha masks are ignored, so that the depth passes in plain wgpu draw the same triangles.

#![allow(missing_docs, reason = "a benchmark")]

mod bare;
mod cases;
mod lookup;
mod table;

use bare::BareDepth;
use cases::Case;
use clap::Parser;
use lookup::bare_renderer;
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;
use table::{Jobs, Table};
use umbrage::visibility::Filter;
use umbrage::{Bounds, Camera, Plan, Planner, Size, Technique};
use umbrage_render::{FrameTarget, Gpu, Renderer, SceneBuffers, Shading, StageTimes, Timer};
use umbrage_testing::third_party_scenes;
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, ShadowOptions};

type Failure = Box<dyn std::error::Error>;

/// Number of first frames of each job that do not count.
const WARM_UP: usize = 1;

/// The techniques of the table, unless others are asked for.
const TECHNIQUES: [&str; 11] = [
    "uniform",
    "uniform:pcf2",
    "uniform:pcf3",
    "uniform:pcf5",
    "uniform:pcss",
    "uniform+z4",
    "adaptive",
    "adaptive:pcf2",
    "adaptive:pcf3",
    "adaptive+z2(fitted):pcf2",
    "adaptive+z4:pcf3",
];

/// Measures what shadows cost, as ratios between frames that take turns.
#[derive(Parser)]
struct Args {
    /// Built-in scenes, as `town:40`, or files in the folder; or views by parts of their names.
    /// Several with commas between them.
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// The views of this JSON file, as for `umbrage sweep`, in place of scenes' default views.
    #[arg(long, value_name = "FILE")]
    views: Option<PathBuf>,
    /// The folder of third-party scenes.
    #[arg(long, default_value = third_party_scenes!())]
    folder: PathBuf,
    /// A technique; the option can be repeated.
    #[arg(long, value_name = "TECHNIQUE")]
    shadows: Vec<String>,
    /// The budget of techniques that tell no number of texels is this number squared.
    #[arg(long, default_value_t = 2048, value_parser = clap::value_parser!(u64).range(1..=65536))]
    texels: u64,
    /// Width and height of the picture, pixels.
    #[arg(long, value_name = "WxH", default_value = "960x540", value_parser = size)]
    size: [u32; 2],
    /// Number of frames that count, of each technique.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Cargo tells benches so. Without it this program is one that only starts.
    #[arg(long)]
    bench: bool,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.ok_or_else(|| "must be written as in 960x540".to_owned())
}

impl Args {
    fn techniques(&self) -> Result<Vec<(String, Technique)>, Failure> {
        let asked = self.shadows.iter().map(String::as_str);
        let ours = TECHNIQUES.iter().copied().filter(|_| self.shadows.is_empty());
        asked
            .chain(ours)
            .map(|text| {
                let mut technique: Technique = text.parse()?;
                if !text.contains('@') {
                    technique.size = Size::Budget(self.texels.pow(2));
                }
                Ok((text.to_owned(), technique))
            })
            .collect()
    }
}

/// A scene on the GPU, with its view, its light and the boxes of its receivers.
struct Set<'a> {
    gpu: &'a Gpu,
    case: &'a Case,
    buffers: SceneBuffers,
    camera: Camera,
    all: umbrage::Aabb,
    boxes: umbrage::BoxTree,
    target: FrameTarget,
    /// `None` if the GPU has no timestamps. Times are then taken from the wall clock.
    timer: RefCell<Option<Timer>>,
}

/// The times of one frame, milliseconds. Those of stages that a job does not have are 0.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    plan: f64,
    depth: f64,
    filter: f64,
    shade: f64,
}

impl<'a> Set<'a> {
    fn new(gpu: &'a Gpu, case: &'a Case, image: [u32; 2]) -> Result<Self, Failure> {
        Ok(Self {
            gpu,
            case,
            buffers: SceneBuffers::new(gpu, &case.scene, true)?,
            camera: case.camera(image)?,
            all: case.scene.bounds(),
            boxes: umbrage::BoxTree::new(&Tracer::new(&case.scene)?.boxes(256))?,
            target: FrameTarget::new(gpu, image)?,
            timer: RefCell::new(Timer::new(gpu)),
        })
    }

    fn plan(&self, planner: &mut Planner, technique: &Technique) -> Result<Plan, Failure> {
        Ok(self.planned(planner, technique)?.clone())
    }

    fn planned<'p>(
        &self,
        planner: &'p mut Planner,
        technique: &Technique,
    ) -> Result<&'p Plan, Failure> {
        let bounds = Bounds { receiver_parts: Some(&self.boxes), ..Bounds::of_scene(self.all) };
        // As where the camera moves.
        planner.forget();
        Ok(planner.plan(&self.camera, &[self.case.light], &bounds, technique)?)
    }

    fn renderer(&self, filter: Filter) -> Result<Renderer<'_>, Failure> {
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        Ok(Renderer::new(self.gpu, &self.buffers, &options)?)
    }

    /// The times that the GPU took for depth passes, filter passes and the picture since `start`.
    /// Without timestamps, all of it counts as the time of the picture.
    fn read(&self, start: Instant) -> Result<StageTimes, Failure> {
        match &mut *self.timer.borrow_mut() {
            Some(timer) => Ok(timer.read(self.gpu)?),
            None => {
                self.gpu.wait()?;
                Ok(StageTimes { picture_ms: milliseconds(start), ..StageTimes::default() })
            }
        }
    }

    /// Plans, draws the maps, and draws the picture.
    fn frame(
        &self,
        planner: &mut Planner,
        technique: &Technique,
        renderer: &mut Renderer<'_>,
    ) -> Result<Times, Failure> {
        let start = Instant::now();
        let plan = self.planned(planner, technique)?;
        let planned = milliseconds(start);
        let start = Instant::now();
        let drawn = renderer.draw_maps(plan, Casters::Moved, self.timer.borrow_mut().as_mut())?;
        let mut times = Times { plan: planned, ..Times::default() };
        if !drawn.is_empty() {
            let StageTimes { pages_ms, depth_ms, filter_ms, picture_ms: wall_ms, .. } =
                self.read(start)?;
            // Only without timestamps is there time of a picture.
            times.depth = pages_ms + depth_ms + wall_ms;
            times.filter = filter_ms;
        }
        times.shade = self.picture(renderer)?;
        Ok(times)
    }

    /// Draws the picture, and returns the time that it takes.
    fn picture(&self, renderer: &mut Renderer<'_>) -> Result<f64, Failure> {
        let shading = Shading { camera: &self.camera, light: &self.case.light, light_index: 0 };
        let start = Instant::now();
        renderer.frame(&shading, &self.target, self.timer.borrow_mut().as_mut())?;
        Ok(self.read(start)?.picture_ms)
    }

    /// Draws the maps without a library, and returns the time that it takes.
    fn bare_depth(&self, bare: &mut BareDepth<'_>, plan: &Plan) -> Result<f64, Failure> {
        let start = Instant::now();
        bare.draw(self.gpu, plan, self.timer.borrow_mut().as_mut());
        Ok(self.read(start)?.picture_ms)
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

type Job<'a> = Box<dyn FnMut() -> Result<Times, Failure> + 'a>;

/// The times of all frames of several jobs that take turns, by frame and job.
fn race(mut jobs: Vec<Job<'_>>, frames: usize) -> Result<Vec<Vec<Times>>, Failure> {
    let mut all = Vec::with_capacity(frames);
    for frame in 0..frames + WARM_UP {
        let mut times = vec![Times::default(); jobs.len()];
        for turn in 0..jobs.len() {
            let i = (turn + frame) % jobs.len();
            times[i] = jobs[i]()?;
        }
        if frame >= WARM_UP {
            all.push(times);
        }
    }
    Ok(all)
}

/// Appends a job, and returns its index.
fn add<'a>(jobs: &mut Vec<Job<'a>>, job: Job<'a>) -> usize {
    jobs.push(job);
    jobs.len() - 1
}

/// Measures all techniques in one view.
fn measure(
    set: &Set<'_>,
    techniques: &[(String, Technique)],
    args: &Args,
) -> Result<Table, Failure> {
    let mut planner = Planner::new();
    let mut jobs: Vec<Job<'_>> = Vec::new();
    let none = Technique { filter: Filter::None, ..Technique::default() };
    let frame = |technique: Technique| -> Result<Job<'_>, Failure> {
        let (mut planner, mut renderer) = (Planner::new(), set.renderer(technique.filter)?);
        Ok(Box::new(move || set.frame(&mut planner, &technique, &mut renderer)))
    };
    let without_shadows = add(&mut jobs, frame(none)?);
    // A bare frame with each filter has one even map.
    let mut bare: Vec<(Filter, usize)> = Vec::new();
    let mut rows = Vec::new();
    for (_, technique) in techniques.iter().filter(|(_, t)| t.filter.has_maps()) {
        let plan = set.plan(&mut planner, technique)?;
        let mut depth = BareDepth::new(set.gpu, &set.case.scene, &plan);
        let bare_depth = add(
            &mut jobs,
            Box::new(move || {
                Ok(Times { depth: set.bare_depth(&mut depth, &plan)?, ..Times::default() })
            }),
        );
        if !bare.iter().any(|(filter, _)| *filter == technique.filter) {
            let even: Technique = "uniform".parse()?;
            let even = Technique { filter: technique.filter, size: technique.size, ..even };
            let plan = set.plan(&mut planner, &even)?;
            if let Some(mut renderer) = bare_renderer(set, &plan)? {
                let mut depth = BareDepth::new(set.gpu, &set.case.scene, &plan);
                let job = add(
                    &mut jobs,
                    Box::new(move || {
                        let depth = set.bare_depth(&mut depth, &plan)?;
                        Ok(Times { depth, shade: set.picture(&mut renderer)?, ..Times::default() })
                    }),
                );
                bare.push((technique.filter, job));
            }
        }
        rows.push((add(&mut jobs, frame(*technique)?), bare_depth, technique.filter));
    }
    let frames = race(jobs, args.frames as usize)?;
    let bare_of = |filter| bare.iter().find(|(f, _)| *f == filter).map(|(_, job)| *job);
    let row = |name: &str, frame, bare, bare_depth| Jobs {
        name: name.to_owned(),
        frame,
        bare,
        bare_depth,
    };
    let mut table = vec![row("none", without_shadows, None, None)];
    table.extend(bare.iter().map(|(filter, job)| row(&format!("bare {filter}"), *job, None, None)));
    let shadowed = techniques.iter().filter(|(_, t)| t.filter.has_maps());
    table.extend(shadowed.zip(rows).map(|((name, _), (frame, bare_depth, filter))| {
        row(name, frame, bare_of(filter), Some(bare_depth))
    }));
    Ok(Table::new(&frames, without_shadows, table))
}

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    // `cargo test --benches` also runs this program, to check that it starts.
    if !args.bench {
        return Ok(());
    }
    let techniques = args.techniques()?;
    let cases = cases::list(&args)?;
    let gpu = Gpu::open()?;
    let image = args.size;
    let has_timestamps = Timer::new(&gpu).is_some();
    println!(
        "{}, {}x{} pixels, medians of {} frames, ms {}",
        gpu.info().name,
        image[0],
        image[1],
        args.frames,
        if has_timestamps { "by timestamps" } else { "on the wall clock" }
    );
    let mut tables = Vec::new();
    for case in cases {
        let case = case.load()?;
        let table = measure(&Set::new(&gpu, &case, image)?, &techniques, &args)?;
        println!("\n{}, {} triangles\n{}", case.name, case.triangles(), table.text());
        tables.push(table);
    }
    if tables.len() > 1 {
        println!("\ngeometric means of the ratios\n{}", table::means(&tables));
    }
    Ok(())
}
