//! What the issue of speed is: ratios, of frames that take turns within one run.
//!
//! ```sh
//! cargo bench -p umbrage-render
//! ```
//!
//! Alpha masks are ignored, so that the pass without a library draws the same. Median wall-clock times, waiting for the GPU after each frame. Scenes beside the built-in ones come from the folder
//! `$UMBRAGE_SCENES`, as for the tests; those that are missing are named and left out.

#![allow(missing_docs, reason = "a benchmark")]

mod bare;

use bare::BareDepth;
use std::path::Path;
use std::time::Instant;
use umbrage::visibility::statistic::{Csm, Statistic};
use umbrage::visibility::{Blur, Filter, Prefilter, Width};
use umbrage::{Bounds, Camera, Light, Options, Partition, Plan, Planner, Size, Warp};
use umbrage_render::{FrameTarget, Gpu, Look, Renderer, SceneBuffers};
use umbrage_scene::Scene;
use umbrage_testing::third_party_scenes;
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, ShadowOptions};

type Failure = Box<dyn std::error::Error>;

/// Frames that take turns; the first two of each do not count.
const FRAMES: usize = 22;

/// A scene with its own view and light.
struct Set<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    buffers: SceneBuffers<'a>,
    camera: Camera,
    light: Light,
    boxes: Vec<umbrage::Aabb>,
}

impl<'a> Set<'a> {
    fn new(gpu: &'a Gpu, scene: &'a Scene, image: [u32; 2]) -> Result<Self, Failure> {
        let v = scene.default_view();
        let camera = Camera::look_at(v.look_at(image))?;
        let boxes = Tracer::new(scene)?.boxes(256);
        let light = scene.default_light().light;
        Ok(Self { gpu, scene, buffers: SceneBuffers::new(gpu, scene, true)?, camera, light, boxes })
    }

    fn plan(&self, warp: Warp, slices: u32, side: u64) -> Result<Plan, Failure> {
        let size = Size::Budget(side * side);
        self.plan_sized(warp, slices, size)
    }

    fn plan_sized(&self, warp: Warp, slices: u32, size: Size) -> Result<Plan, Failure> {
        let partition = Partition::slices(slices);
        let options = Options { warp, partition, size, ..Options::default() };
        let bounds =
            Bounds { receiver_parts: &self.boxes, ..Bounds::of_scene(self.scene.bounds()) };
        Ok(Planner::new().plan(&self.camera, &[self.light], &bounds, &options)?.clone())
    }

    fn renderer(&self, filter: Filter) -> Result<Renderer<'_, 'a>, Failure> {
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        Ok(Renderer::new(self.gpu, &self.buffers, &options)?)
    }

    /// Maps and picture.
    fn frame(
        &self,
        renderer: &mut Renderer<'_, '_>,
        plan: &Plan,
        target: &FrameTarget,
    ) -> Result<(), Failure> {
        renderer.draw_maps(plan, Casters::Moved, None)?;
        let look = Look { camera: &self.camera, light: &self.light, light_index: 0 };
        renderer.frame(&look, target, None)?;
        Ok(self.gpu.wait()?)
    }
}

/// Median milliseconds of some jobs that take turns.
fn race(jobs: &mut [&mut dyn FnMut() -> Result<(), Failure>]) -> Result<Vec<f64>, Failure> {
    let mut times = vec![Vec::new(); jobs.len()];
    for frame in 0..FRAMES {
        for turn in 0..jobs.len() {
            let i = (turn + frame) % jobs.len();
            let start = Instant::now();
            jobs[i]()?;
            if frame >= 2 {
                times[i].push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    Ok(times
        .into_iter()
        .map(|mut t| {
            t.sort_by(f64::total_cmp);
            t[t.len() / 2]
        })
        .collect())
}

/// Techniques against each other.
fn techniques(set: &Set<'_>) -> Result<[f64; 2], Failure> {
    let plans = [(Warp::Uniform, 1), (Warp::Lispsm, 1), (Warp::Lispsm, 4)];
    let plans = plans.map(|(warp, slices)| set.plan(warp, slices, 1024));
    let [uniform, lispsm, slices] = plans;
    let (uniform, lispsm, slices) = (uniform?, lispsm?, slices?);
    let target = FrameTarget::new(set.gpu, set.camera.image())?;
    let pcf = Filter::pcf(3)?;
    let [mut a, mut b, mut c] = [set.renderer(pcf)?, set.renderer(pcf)?, set.renderer(pcf)?];
    let times = race(&mut [
        &mut || set.frame(&mut a, &uniform, &target),
        &mut || set.frame(&mut b, &lispsm, &target),
        &mut || set.frame(&mut c, &slices, &target),
    ])?;
    println!(
        "  frame: uniform {:.1} ms, lispsm {:.1} ms ({:.3} of it), lispsm+z4 {:.1} ms ({:.3} of lispsm)",
        times[0],
        times[1],
        times[1] / times[0],
        times[2],
        times[2] / times[1]
    );
    Ok([times[1] / times[0], times[2] / times[1]])
}

/// The depth pass against one without any library, and against nothing to do.
fn depth_pass(set: &Set<'_>) -> Result<[f64; 2], Failure> {
    let plan = set.plan(Warp::Lispsm, 1, 2048)?;
    let pcf = Filter::pcf(3)?;
    let mut moved = set.renderer(pcf)?;
    let mut still = set.renderer(pcf)?;
    let mut bare = BareDepth::new(set.gpu, set.scene, &plan);
    let start = Instant::now();
    still.draw_maps(&plan, Casters::Still, None)?;
    set.gpu.wait()?;
    let first = start.elapsed().as_secs_f64() * 1e3;
    let times = race(&mut [
        &mut || {
            moved.draw_maps(&plan, Casters::Moved, None)?;
            Ok(set.gpu.wait()?)
        },
        &mut || {
            bare.draw(set.gpu, &plan);
            Ok(set.gpu.wait()?)
        },
        &mut || {
            still.draw_maps(&plan, Casters::Still, None)?;
            Ok(set.gpu.wait()?)
        },
    ])?;
    println!(
        "  depth pass, 2048²: {:.1} ms, bare wgpu {:.1} ms (ratio {:.3}); still {:.3} ms, first {:.1} ms (ratio {:.4})",
        times[0],
        times[1],
        times[0] / times[1],
        times[2],
        first,
        times[2] / first
    );
    Ok([times[0] / times[1], times[2] / first])
}

/// Convolution shadow maps against bilinear comparisons, in the configuration of Annen et al. 2007, Table 1: a map of 1024², a picture of 1024×768.
fn filters(gpu: &Gpu, scene: &Scene) -> Result<(), Failure> {
    let set = Set::new(gpu, scene, [1024, 768])?;
    let plan = set.plan_sized(Warp::Uniform, 1, Size::Exact([1024; 2]))?;
    let target = FrameTarget::new(gpu, set.camera.image())?;
    let csm = |order, blur, half| -> Result<Filter, Failure> {
        let statistic = Statistic::Csm(Csm::new(order, 0.0, false, true)?);
        Ok(Filter::Prefiltered(Prefilter { statistic, blur, half }))
    };
    let pixel = Blur::Width(Width::Pixels(1.0));
    let contenders = [
        ("pcf2", Filter::pcf(2)?),
        ("csm4", csm(4, Blur::Texels(1), false)?),
        ("csm8", csm(8, Blur::Texels(1), false)?),
        ("csm16", csm(16, Blur::Texels(1), false)?),
        ("csm4(blur=7)", csm(4, Blur::Texels(7), false)?),
        ("csm4(blur=3,half)", csm(4, Blur::Texels(3), true)?),
        ("csm4(blur=1px)", csm(4, pixel, false)?),
    ];
    let mut renderers = Vec::new();
    for (_, filter) in contenders {
        renderers.push(set.renderer(filter)?);
    }
    let mut jobs: Vec<_> = renderers.iter_mut().map(|r| || set.frame(r, &plan, &target)).collect();
    let mut jobs: Vec<&mut dyn FnMut() -> Result<(), Failure>> =
        jobs.iter_mut().map(|job| job as _).collect();
    let times = race(&mut jobs)?;
    let triangles: usize =
        scene.instances.iter().map(|i| scene.meshes[i.mesh].triangles.len()).sum();
    println!("{}, {triangles} triangles, 1024² texels, 1024×768:", scene.name);
    for ((name, _), time) in contenders.iter().zip(&times) {
        println!("  {name}: {time:.1} ms, {:.3} of pcf2", time / times[0]);
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    // `cargo test --benches` runs this too, and only wants to know that it can.
    if !std::env::args().any(|a| a == "--bench") {
        return Ok(());
    }
    let gpu = Gpu::open()?;
    println!("{}", gpu.info().name);
    let folder = Path::new(third_party_scenes!());
    let mut scenes = Vec::new();
    for name in ["town", "airfield", "statues"] {
        scenes.push(umbrage_scene::builtin(name, None)?);
    }
    for name in [
        "vehicles/kenney_racing_level.glb",
        "city/kenney_city_40x40.glb",
        "terrain/jacksboro_dem_terrain.glb",
        "trees/forest_eztree.glb",
    ] {
        match umbrage_scene::load(&folder.join(name)) {
            Ok(scene) => scenes.push(scene),
            Err(e) => println!("left out: {e}"),
        }
    }
    filters(&gpu, &umbrage_scene::builtin("grove", Some(30))?)?;
    if let Some(forest) = scenes.iter().find(|s| s.name.starts_with("forest")) {
        filters(&gpu, forest)?;
    }
    let mut sums = [0.0; 4];
    for scene in &scenes {
        println!("{}", scene.name);
        let set = Set::new(&gpu, scene, [960, 540])?;
        let ratios = [techniques(&set)?, depth_pass(&set)?].concat();
        sums.iter_mut().zip(ratios).for_each(|(sum, ratio)| *sum += f64::ln(ratio));
    }
    let [lispsm, slices, bare, still] = sums.map(|s| (s / scenes.len() as f64).exp());
    println!(
        "geometric means: lispsm/uniform {lispsm:.3}, lispsm+z4/lispsm {slices:.3}, library/bare depth pass {bare:.3}, \
         still/first {still:.4}"
    );
    Ok(())
}
