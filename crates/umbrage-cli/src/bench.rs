//! `umbrage bench`: what each stage of a technique costs.

use crate::args::bench;
use crate::comparison::{light_info, view_info};
use crate::execute::{Bencher, Costs, Execution, Sets};
use crate::output::{aligned, print};
use crate::pixels::{casters, milliseconds};
use crate::progress::Progress;
use crate::setup::{Receivers, lamp, onlooker, open_scene, tell_notices};
use crate::spec::{Spec, planner};
use anyhow::{Context, Result};
use serde::Serialize;
use std::time::Instant;
use umbrage::Planner;
use umbrage_measure::{LightInfo, View};

/// Frames that do not count: pipelines are compiled and buffers grow.
const WARM_UP: u32 = 2;

#[derive(Serialize)]
struct BenchJson {
    scene: String,
    size: [u32; 2],
    view: View,
    light: LightInfo,
    frames: u32,
    still: bool,
    results: Vec<ResultJson>,
}

#[derive(Serialize)]
struct ResultJson {
    shadows: String,
    backend: &'static str,
    device: Option<String>,
    /// Whether `depth` and `shade` are the GPU's own times.
    gpu_timestamps: bool,
    maps: usize,
    texels: u64,
    /// Of what lookup reads.
    bytes: u64,
    storage_factor: f64,
    /// What a frame draws into each map, if all are drawn.
    map_draws: Vec<DrawnJson>,
    ms: TimesJson,
    /// Of the very first frame.
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
    depth: Option<Spread>,
    filter: Option<Spread>,
    shade: Option<Spread>,
    frame: Option<Spread>,
}

#[derive(Serialize)]
struct FirstJson {
    depth: f64,
    frame: f64,
}

/// Milliseconds over frames.
#[derive(Clone, Copy, Serialize)]
struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    /// `None` without values.
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

/// A technique at work.
struct Contender<'a> {
    spec: &'a Spec,
    bencher: Bencher<'a>,
    planner: Planner,
    frames: Vec<Frame>,
}

/// What one frame cost, milliseconds.
struct Frame {
    plan: f64,
    costs: Costs,
    frame: f64,
}

/// Measures, and prints a table or JSON.
pub(crate) fn run(args: &bench::Bench, quiet: bool) -> Result<()> {
    let scene = open_scene(&args.scene.name)?;
    let onlooker = onlooker(&args.view, Some(&scene))?;
    let camera = onlooker.camera;
    let lamp = lamp(&args.light, Some(&scene))?;
    let execution = Execution::open(&args.techniques.execution, &args.techniques.shadows)?;
    let sets = Sets::new(&scene, &execution, args.scene.opaque)?;
    let view = umbrage_trace::View::new(&sets.tracer, camera, lamp.light, 1)?;
    let receivers = Receivers::new(&scene, &sets.tracer, args.techniques.fit);
    let bounds = receivers.bounds();
    tell_notices(&scene);
    execution.announce();
    let frames = WARM_UP + args.frames;
    let progress = Progress::new(u64::from(frames) * args.techniques.shadows.len() as u64, quiet);
    let mut contenders = Vec::new();
    for spec in &args.techniques.shadows {
        let bencher = sets.bencher(spec, camera.image())?;
        contenders.push(Contender { spec, bencher, planner: planner(), frames: Vec::new() });
    }
    for index in 0..frames {
        // Whoever comes first in a frame does not always do so.
        let first = index as usize % contenders.len();
        contenders.rotate_left(first);
        for contender in &mut contenders {
            let spec = contender.spec;
            progress.stage(spec.to_string());
            let start = Instant::now();
            let plan = contender
                .planner
                .plan(&camera, &[lamp.light], &bounds, spec.technique())
                .map_err(|e| spec.error(&e))?;
            let planned = milliseconds(start);
            let costs = contender.bencher.frame(&view, plan, args.still)?;
            contender.frames.push(Frame { plan: planned, costs, frame: milliseconds(start) });
            progress.advance(1);
        }
        contenders.rotate_right(first);
    }
    drop(progress);

    let mut results = Vec::new();
    for contender in &mut contenders {
        let spec = contender.spec;
        let plan = contender
            .planner
            .plan(&camera, &[lamp.light], &bounds, spec.technique())
            .map_err(|e| spec.error(&e))?;
        let first = contender.frames.first().context("frames")?;
        let counted = &contender.frames[WARM_UP as usize..];
        let spread = |value: fn(&Frame) -> f64| Spread::of(counted.iter().map(value));
        let mut map_draws: Vec<DrawnJson> = plan
            .maps
            .iter()
            .map(|m| DrawnJson { resolution: m.resolution, ..DrawnJson::default() })
            .collect();
        match &first.costs.drawn {
            Some(drawn) => {
                for (map, drawn) in drawn {
                    map_draws[*map].draws = drawn.draws;
                    map_draws[*map].triangles = drawn.triangles;
                }
            }
            None => {
                for (drawn, casters) in map_draws.iter_mut().zip(casters(plan, &scene)) {
                    drawn.triangles = casters.drawn;
                }
            }
        }
        results.push(ResultJson {
            shadows: spec.to_string(),
            backend: contender.bencher.executor().name(),
            device: execution.device().filter(|_| contender.bencher.executor().is_gpu()),
            gpu_timestamps: contender.bencher.has_timestamps(),
            maps: plan.maps.len(),
            texels: plan.texels(),
            bytes: first.costs.bytes,
            storage_factor: plan.storage_factor(),
            map_draws,
            ms: TimesJson {
                plan: spread(|f| f.plan),
                depth: spread(|f| f.costs.depth),
                filter: counted
                    .iter()
                    .map(|f| f.costs.filter)
                    .collect::<Option<Vec<_>>>()
                    .and_then(|values| Spread::of(values.into_iter())),
                shade: spread(|f| f.costs.shade),
                frame: spread(|f| f.frame),
            },
            first_ms: FirstJson { depth: first.costs.depth, frame: first.frame },
        });
    }
    let bench = BenchJson {
        scene: scene.name.clone(),
        size: camera.image(),
        view: view_info(&onlooker),
        light: light_info(&lamp),
        frames: args.frames,
        still: args.still,
        results,
    };
    if args.json {
        print(&format!("{}\n", serde_json::to_string_pretty(&bench)?))
    } else {
        print(&table(&bench))
    }
}

fn table(bench: &BenchJson) -> String {
    let heads = [
        "median ms of",
        "plan",
        "depth",
        "filter",
        "shade",
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
            ms(r.ms.depth, 2),
            ms(r.ms.filter, 2),
            ms(r.ms.shade, 2),
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
