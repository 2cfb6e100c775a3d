//! `umbrage bench` measures the time of each stage of a technique.

use crate::args::bench;
use crate::output::{aligned, print};
use crate::progress::Bar;
use crate::setup::{Chosen, announce, choose, open_scene, tell_chosen, tell_detail, tell_notices};
use anyhow::{Context, Result};
use serde::Serialize;
use std::time::Instant;
use umbrage::paged::AgingLights;
use umbrage::{Bounds, Camera, Plan, Planner};
use umbrage_lab::{
    Bencher, Costs, Detail, Executors, NamedTechnique, Progress, Receivers, RenderScene, casters,
    milliseconds, plan, plan_aging, planner, turned,
};
use umbrage_measure::{LightInfo, View};
use umbrage_scene::{Scene, SceneCamera};

/// Number of first frames that do not count, because pipelines are compiled and buffers grow.
const WARM_UP: u32 = 2;

#[derive(Serialize)]
struct BenchJson {
    scene: String,
    size: [u32; 2],
    view: View,
    light: LightInfo,
    frames: u32,
    still: bool,
    /// The speed of the camera, m/s; `null` if it stands still.
    walk: Option<f64>,
    /// The speed at which the light turns, degrees a second; `null` if it does not.
    turn: Option<f64>,
    /// The frames over which pages of a light that turns are renewed.
    renew: u32,
    results: Vec<ResultJson>,
}

#[derive(Serialize)]
struct ResultJson {
    shadows: String,
    backend: &'static str,
    device: Option<String>,
    /// Whether `depth` and `shade` are times from GPU timestamps.
    gpu_timestamps: bool,
    maps: usize,
    texels: u64,
    /// Texels drawn over texels in use, the mean over the frames after the first.
    drawn_share: f64,
    /// Size of the memory that lookup reads.
    bytes: u64,
    storage_factor: f64,
    /// Draws and triangles of each map, in a frame that draws all maps.
    map_draws: Vec<DrawnJson>,
    /// How far the light that is looked up is behind the light, degrees; `null` unless pages are
    /// renewed over several frames.
    age_deg: Option<Spread>,
    ms: TimesJson,
    /// What the shadows cost: `plan` + `depth` + `filter` + `shade` − `shade_none` of each frame,
    /// milliseconds.
    cost: Option<Spread>,
    /// Times of the very first frame.
    first_ms: FirstJson,
}

#[derive(Clone, Default, Serialize)]
struct DrawnJson {
    resolution: [u32; 2],
    draws: u32,
    triangles: u64,
}

#[derive(Serialize)]
struct TimesJson {
    plan: Option<Spread>,
    /// The viewer's depths ahead of pages; `null` without pages or timestamps.
    prepass: Option<Spread>,
    /// Finding the pages that are wanted, and what casts into those to draw; `null` likewise.
    pages: Option<Spread>,
    depth: Option<Spread>,
    filter: Option<Spread>,
    shade: Option<Spread>,
    /// `shade` of the same backend without shadows, in the same turns.
    shade_none: Option<Spread>,
    /// Until what was seen is back from the GPU; `null` without `--fit seen`.
    seen: Option<Spread>,
    /// The CPU's share that is not planning; `null` for the reference.
    cpu: Option<Spread>,
    frame: Option<Spread>,
}

#[derive(Serialize)]
struct FirstJson {
    depth: f64,
    frame: f64,
}

/// Spread of a value over frames.
#[derive(Clone, Copy, Serialize)]
struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    /// Computes the spread of these values; `None` if there are none.
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let (&min, &max) = (values.first()?, values.last()?);
        let middle = values.len() / 2;
        let median = if values.len() % 2 == 1 {
            values[middle]
        } else {
            values[middle - 1].midpoint(values[middle])
        };
        Some(Self { min, median, max })
    }
}

/// A technique that is measured, with everything that draws its frames.
struct Contender<'a> {
    technique: &'a NamedTechnique,
    bencher: Bencher<'a>,
    planner: Planner,
    aging: AgingLights,
    frames: Vec<Frame>,
}

/// The same frame without shadows. No GPU draws the second one, so it is compared with techniques
/// that the reference renders beside a GPU.
const WITHOUT_SHADOWS: [&str; 2] = ["none", "log:none"];

/// The times of one frame, milliseconds.
struct Frame {
    /// How far the light that is looked up is behind, degrees; `None` if it never is.
    age_deg: Option<f64>,
    plan: f64,
    costs: Costs,
    frame: f64,
}

/// Measures the techniques, and prints a table or JSON.
pub(crate) fn run(args: &bench::Bench, quiet: bool) -> Result<()> {
    let bar = Bar::of_parts(quiet);
    let scene = open_scene(&args.scene, &bar)?;
    let Chosen { view: chosen_view, lights } =
        choose(&args.view, &[args.light.options()], Some(&scene), &bar)?;
    let camera = chosen_view.camera;
    let chosen_light = &lights[0];
    bar.stage("preparing the scene");
    let techniques = &args.techniques.shadows;
    let executors = Executors::open(args.techniques.execution.backend.into(), techniques)?;
    let detail = Detail::new(&scene, &executors, &args.techniques.execution.detail(), &bar)?;
    let render_scene = RenderScene::new(&scene, &executors, args.scene.changes.opaque, &detail)?;
    let tracer = render_scene.tracer();
    let view = umbrage_trace::View::new(tracer, camera, chosen_light.light, 1)?;
    let receivers = Receivers::new(&scene, tracer, args.techniques.fit.into());
    let seen = render_scene.seen(&receivers, &camera)?;
    let bounds = receivers.bounds(seen.as_ref());
    bar.aside(|| {
        tell_notices(&scene);
        tell_detail(&render_scene);
        tell_chosen(&chosen_view, &lights);
        announce(&executors);
    });
    let contender = |technique| {
        Contender::new(&render_scene, technique, &receivers, camera.image(), args.renew)
    };
    let mut contenders = techniques.iter().map(contender).collect::<Result<Vec<_>>>()?;
    let without_shadows = WITHOUT_SHADOWS.map(str::parse::<NamedTechnique>);
    for technique in &without_shadows {
        let none = contender(technique.as_ref().map_err(Clone::clone)?)?;
        let is_needed = contenders.iter().any(|c| c.is_gpu() == none.is_gpu());
        if is_needed && none_for(&contenders, none.is_gpu()).is_none() {
            contenders.push(none);
        }
    }
    take_turns(&mut contenders, args, &view, &chosen_view.view, &bounds, &bar)?;
    drop(bar);
    let results = contenders.iter().map(|contender| {
        let none = none_for(&contenders, contender.is_gpu()).context("frames without shadows")?;
        let device = executors.device().filter(|_| contender.is_gpu());
        contender.result(none, &scene, &view, &bounds, device)
    });
    let mut results = results.collect::<Result<Vec<_>>>()?;
    if args.json {
        results.truncate(techniques.len());
    }
    let bench = BenchJson {
        scene: scene.name.clone(),
        size: camera.image(),
        view: chosen_view.info(),
        light: chosen_light.info(),
        frames: args.frames,
        still: args.still,
        walk: args.walk,
        turn: args.turn,
        renew: args.renew,
        results,
    };
    if args.json {
        print(&format!("{}\n", serde_json::to_string_pretty(&bench)?))
    } else {
        print(&table(&bench))
    }
}

/// Draws all frames of all techniques, which take turns frame by frame.
fn take_turns(
    contenders: &mut [Contender<'_>],
    args: &bench::Bench,
    view: &umbrage_trace::View<'_>,
    seen_by: &SceneCamera,
    bounds: &Bounds<'_>,
    bar: &Bar,
) -> Result<()> {
    let size = view.camera().image();
    let frames = WARM_UP + args.frames;
    bar.one_part(u64::from(frames) * contenders.len() as u64);
    let tracer = view.tracer();
    for index in 0..frames {
        let seconds = f64::from(index) / 60.0;
        let camera = match args.walk {
            Some(speed) => walked(seen_by, size, speed * seconds)?,
            None => *view.camera(),
        };
        let light = match args.turn {
            Some(speed) => turned(view.light(), speed * seconds)
                .context("--turn: a point light has no direction to turn")?,
            None => *view.light(),
        };
        let view = &umbrage_trace::View::new(tracer, camera, light, 1)?;
        // The technique that comes first changes from frame to frame.
        let first = index as usize % contenders.len();
        contenders.rotate_left(first);
        for contender in contenders.iter_mut() {
            bar.stage(&contender.technique.to_string());
            let Contender { technique, bencher, planner, aging, frames } = contender;
            if !args.are_casters_unmoved() {
                // As where the camera moves.
                planner.forget();
            }
            let start = Instant::now();
            aging.advance(&[light])?;
            let plan = plan_aging(planner, technique, view.camera(), aging, bounds)?;
            let planned = milliseconds(start);
            let costs = bencher.frame(view, plan, args.are_casters_unmoved())?;
            let age = aging.age(0).filter(|_| aging.frames() > 0);
            let age_deg = age.map(|age| age.angle_rad.to_degrees());
            frames.push(Frame { age_deg, plan: planned, costs, frame: milliseconds(start) });
            bar.advance(1);
        }
        contenders.rotate_right(first);
    }
    Ok(())
}

/// A scene's camera that has gone forward by a distance, metres.
fn walked(camera: &SceneCamera, size: [u32; 2], distance: f64) -> Result<Camera> {
    let step = (camera.target - camera.eye).normalize_or_zero() * distance;
    let mut camera = camera.clone();
    camera.eye += step;
    camera.target += step;
    Ok(camera.camera(size)?)
}

/// The contender that draws the same frames without shadows, on a GPU or not.
fn none_for<'a, 'b>(contenders: &'b [Contender<'a>], is_gpu: bool) -> Option<&'b Contender<'a>> {
    contenders.iter().find(|c| c.is_gpu() == is_gpu && !c.technique.technique().filter.has_maps())
}

impl<'a> Contender<'a> {
    fn new(
        scene: &'a RenderScene<'_>,
        technique: &'a NamedTechnique,
        receivers: &Receivers,
        size: [u32; 2],
        renew: u32,
    ) -> Result<Self> {
        let bencher = Bencher::new(scene, technique.technique(), receivers, size)?;
        let is_paged = technique.technique().paged_error().is_some();
        let aging = AgingLights::new(if is_paged { renew } else { 0 });
        Ok(Self { technique, bencher, planner: planner(), aging, frames: Vec::new() })
    }

    fn is_gpu(&self) -> bool {
        self.bencher.executor().is_gpu()
    }

    /// The frames that count.
    fn counted(&self) -> impl Iterator<Item = &Frame> {
        self.frames.iter().skip(WARM_UP as usize)
    }

    /// The spread of a value over the frames that count; `None` if it is not measured.
    fn spread(&self, value: fn(&Frame) -> Option<f64>) -> Option<Spread> {
        Spread::of(self.counted().filter_map(value))
    }

    /// The results of this technique, over the frames that count. `none` has the frames without
    /// shadows.
    fn result(
        &self,
        none: &Contender<'_>,
        scene: &Scene,
        view: &umbrage_trace::View<'_>,
        bounds: &Bounds<'_>,
        device: Option<String>,
    ) -> Result<ResultJson> {
        let Self { technique, bencher, frames, .. } = self;
        let plan = &plan(technique, view.camera(), view.light(), bounds)?;
        let first = frames.first().context("frames")?;
        let cost = |(frame, none): (&Frame, &Frame)| {
            let Frame { plan, costs, .. } = frame;
            let lookup = costs.shade - none.costs.shade;
            let found = costs.pages.unwrap_or(0.0);
            plan + found + costs.depth + costs.filter.unwrap_or(0.0) + lookup
        };
        Ok(ResultJson {
            shadows: technique.to_string(),
            backend: bencher.executor().name(),
            device,
            gpu_timestamps: bencher.has_timestamps(),
            maps: plan.maps.len(),
            texels: first.costs.texels[0],
            drawn_share: {
                let share = |f: &Frame| f.costs.texels[1] as f64 / f.costs.texels[0].max(1) as f64;
                frames[1..].iter().map(share).sum::<f64>() / (frames.len() - 1).max(1) as f64
            },
            bytes: first.costs.bytes,
            storage_factor: plan.storage_factor(),
            map_draws: map_draws(plan, &first.costs, scene),
            age_deg: self.spread(|f| f.age_deg),
            ms: TimesJson {
                plan: self.spread(|f| Some(f.plan)),
                prepass: self.spread(|f| f.costs.prepass),
                pages: self.spread(|f| f.costs.pages),
                depth: self.spread(|f| Some(f.costs.depth)),
                filter: self.spread(|f| f.costs.filter),
                shade: self.spread(|f| Some(f.costs.shade)),
                shade_none: none.spread(|f| Some(f.costs.shade)),
                seen: self.spread(|f| f.costs.seen),
                cpu: self.spread(|f| f.costs.cpu),
                frame: self.spread(|f| Some(f.frame)),
            },
            // Frames of the same turn are compared, as both see what else the machine does then.
            cost: Spread::of(self.counted().zip(none.counted()).map(cost)),
            first_ms: FirstJson { depth: first.costs.depth, frame: first.frame },
        })
    }
}

/// What a frame draws into each map: the GPU renderer's own counts, or without them the number of
/// triangles that may cast into the map.
fn map_draws(plan: &Plan, first: &Costs, scene: &Scene) -> Vec<DrawnJson> {
    let maps = plan.maps.iter();
    let mut map_draws: Vec<DrawnJson> =
        maps.map(|m| DrawnJson { resolution: m.resolution, ..DrawnJson::default() }).collect();
    match &first.drawn {
        Some(drawn) => {
            for (map, drawn) in drawn {
                map_draws[*map].draws = drawn.draws;
                map_draws[*map].triangles = drawn.triangles;
            }
        }
        None => {
            for (drawn, casters) in map_draws.iter_mut().zip(casters(plan, scene)) {
                drawn.triangles = casters.drawn;
            }
        }
    }
    map_draws
}

fn table(bench: &BenchJson) -> String {
    let heads = [
        "median ms of",
        "plan",
        "prepass",
        "pages",
        "depth",
        "filter",
        "shade",
        "cost",
        "seen",
        "cpu",
        "frame",
        "first frame",
        "maps",
        "draws",
        "triangles",
        "texels",
        "MiB",
    ];
    let mut rows: Vec<Vec<String>> = vec![heads.map(str::to_owned).to_vec()];
    rows.extend(bench.results.iter().map(|r| {
        let ms = |s: Option<Spread>, digits: usize| {
            s.map_or("-".to_owned(), |s| format!("{:.digits$}", s.median))
        };
        let draws: u32 = r.map_draws.iter().map(|m| m.draws).sum();
        let triangles: u64 = r.map_draws.iter().map(|m| m.triangles).sum();
        vec![
            r.shadows.clone(),
            ms(r.ms.plan, 3),
            ms(r.ms.prepass, 2),
            ms(r.ms.pages, 2),
            ms(r.ms.depth, 2),
            ms(r.ms.filter, 2),
            ms(r.ms.shade, 2),
            ms(r.cost, 2),
            ms(r.ms.seen, 2),
            ms(r.ms.cpu, 2),
            ms(r.ms.frame, 2),
            format!("{:.2}", r.first_ms.frame),
            r.maps.to_string(),
            draws.to_string(),
            triangles.to_string(),
            r.texels.to_string(),
            format!("{:.1}", r.bytes as f64 / f64::from(1 << 20)),
        ]
    }));
    aligned(&rows)
}
