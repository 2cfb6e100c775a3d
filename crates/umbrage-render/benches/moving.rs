//! Measures what casters that move cost in a frame: some of the things in the street of the built-in
//! scene `town` walk on by two centimetres a frame, and the camera stands still.
//!
//! ```sh
//! cargo bench -p umbrage-render --bench moving
//! ```
//!
//! Times are medians of the GPU's own, milliseconds; techniques take turns. `find` is the time to
//! find pages and what casts into them, and `draw` that of drawing casters.

#![allow(missing_docs, reason = "a benchmark")]

use glam::{DAffine3, DVec3};
use umbrage::{Bounds, Camera, Light, Plan, Planner, Technique};
use umbrage_clusters::{MeshInput, build_finest};
use umbrage_render::{Gpu, Renderer, SceneBuffers, StageTimes, Timer};
use umbrage_scene::{Alpha, Moved, Scene};
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, PageCounts, ShadowOptions};

type Failure = Box<dyn std::error::Error>;

/// Number of frames. The first three do not count.
const FRAMES: usize = 23;
const FIRST: usize = 3;

/// The techniques, and whether what moves is kept apart.
const CONTENDERS: [(&str, bool); 4] = [
    ("paged@2048", true),
    ("paged@2048", false),
    ("uniform(stable)+z4@2048", false),
    ("adaptive+z4@2048", false),
];

/// What was drawn of a technique's frames.
struct Drawn<'a> {
    renderer: Renderer<'a>,
    timer: Timer,
    times: Vec<StageTimes>,
    counts: Option<PageCounts>,
    triangles: u64,
}

/// A technique with everything that draws its frames. Poses are of a scene on the GPU, so each has
/// its own.
struct Contender {
    name: String,
    scene: Scene,
    buffers: SceneBuffers,
    plan: Plan,
    options: ShadowOptions,
}

fn main() -> Result<(), Failure> {
    // `cargo test --benches` also runs this program, to check that it starts.
    if !std::env::args().any(|a| a == "--bench") {
        return Ok(());
    }
    let gpu = Gpu::open()?;
    println!("{}", gpu.info().name);
    for (detail, count) in [(200, 1), (200, 20), (200, 100)] {
        run(&gpu, detail, count)?;
    }
    Ok(())
}

fn run(gpu: &Gpu, detail: u32, count: usize) -> Result<(), Failure> {
    let scene = umbrage_scene::builtin("town", Some(detail))?;
    let camera = scene.default_view().camera([960, 540])?;
    let light = scene.lights.first().ok_or("a sun")?.light;
    let walkers = walkers(&scene, &camera, count);
    println!("town:{detail}, {} casters walk", walkers.len());
    let contenders = CONTENDERS.map(|(text, is_apart)| {
        let name = format!("{text}{}", if is_apart { ", apart" } else { "" });
        Contender::new(gpu, &scene, &camera, light, text, is_apart)
            .map(|made| Contender { name, ..made })
    });
    let mut contenders = contenders.into_iter().collect::<Result<Vec<_>, Failure>>()?;
    let mut drawn: Vec<Drawn<'_>> = Vec::new();
    let mut parts: Vec<(&str, &mut Scene, &SceneBuffers, &Plan)> = Vec::new();
    for Contender { name, scene, buffers, plan, options } in &mut contenders {
        let renderer = Renderer::new(gpu, buffers, options)?;
        let timer = Timer::new(gpu).ok_or("the GPU does not tell times")?;
        drawn.push(Drawn { renderer, timer, times: Vec::new(), counts: None, triangles: 0 });
        parts.push((name, scene, buffers, plan));
    }
    for frame in 0..FRAMES {
        for ((_, scene, buffers, plan), own) in parts.iter_mut().zip(&mut drawn) {
            for &instance in &walkers {
                let way = DVec3::new(0.0, 0.0, if instance % 2 == 0 { 0.02 } else { -0.02 });
                let placed = &mut scene.instances[instance].world_from_mesh;
                *placed = DAffine3::from_translation(way) * *placed;
            }
            let moved = Moved { instances: walkers.clone(), ..Moved::default() };
            let boxes = buffers.pose(gpu, scene, &moved)?;
            let Drawn { renderer, timer, times, counts, triangles } = own;
            let casters = match plan.paging {
                Some(_) => Casters::Unmoved,
                None => Casters::MovedIn(&boxes),
            };
            let drawn = renderer.draw_maps(plan, casters, Some(timer))?;
            *triangles = drawn.iter().map(|(_, drawn)| drawn.triangles).sum();
            let now = timer.read(gpu)?;
            *counts = renderer.page_counts();
            if frame >= FIRST {
                times.push(now);
            }
            renderer.run_ahead();
        }
    }
    for ((name, ..), Drawn { times, counts, triangles, .. }) in parts.iter().zip(&drawn) {
        let median = |of: fn(&StageTimes) -> f64| {
            let mut values: Vec<f64> = times.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let pages = counts.map_or(String::new(), |counts| {
            let PageCounts { wanted, drawn, apart, .. } = counts;
            format!(", {drawn} of {wanted} pages drawn, {apart} of them without what stands still")
        });
        let [find, draw] = [median(|t| t.pages_ms), median(|t| t.depth_ms)];
        println!(
            "  {name}: find {find:.2}, draw {draw:.2}, both {:.2}, {triangles} triangles{pages}",
            find + draw
        );
    }
    Ok(())
}

/// The instances that walk: those of a person's or a car's size that are nearest to the camera and
/// in view.
fn walkers(scene: &Scene, camera: &Camera, count: usize) -> Vec<usize> {
    let boxed = |i: usize| {
        let instance = &scene.instances[i];
        let corners = scene.meshes[instance.mesh].bounds().corners();
        let corners = corners.map(|p| instance.world_from_mesh.transform_point3(p));
        umbrage::Aabb::around(corners)
    };
    let mut near: Vec<(f64, usize)> = (0..scene.instances.len())
        .filter_map(|i| {
            let bounds = boxed(i);
            let size = bounds.size().max_element();
            let center = bounds.center();
            let to_center = (center - camera.eye()).normalize_or_zero();
            let is_seen = to_center.dot(camera.forward()) > 0.9;
            let is_walker = (0.3..8.0).contains(&size) && is_seen && scene.roles.of(i).casts;
            is_walker.then_some((center.distance(camera.eye()), i))
        })
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.into_iter().take(count).map(|(_, i)| i).collect()
}

impl Contender {
    fn new(
        gpu: &Gpu,
        scene: &Scene,
        camera: &Camera,
        light: Light,
        text: &str,
        pages_apart: bool,
    ) -> Result<Self, Failure> {
        let technique: Technique = text.parse()?;
        let pages = technique.paged_error().is_some();
        let filter = technique.filter;
        let options = ShadowOptions { filter, pages, pages_apart, ..ShadowOptions::default() };
        let buffers = SceneBuffers::new(gpu, scene, false)?;
        if pages {
            let inputs = scene.meshes.iter().map(|mesh| MeshInput {
                positions: &mesh.positions,
                normals: &mesh.normals,
                uvs: &mesh.uvs,
                triangles: &mesh.triangles,
                is_masked: matches!(scene.materials[mesh.material].alpha, Alpha::Mask { .. }),
            });
            let inputs: Vec<_> = inputs.collect();
            buffers.make_pages(gpu, scene, || build_finest(&inputs))?;
        }
        let boxes = Tracer::new(scene)?.boxes(256);
        let boxes = umbrage::BoxTree::new(&boxes)?;
        let bounds = Bounds { receiver_parts: Some(&boxes), ..Bounds::of_scene(scene.bounds()) };
        let mut planner = Planner::with_limits(gpu.support().limits());
        let plan = planner.plan(camera, &[light], &bounds, &technique)?.clone();
        Ok(Self { name: text.to_owned(), scene: scene.clone(), buffers, plan, options })
    }
}
