//! Measures the ratios that the project's goals for speed are stated in, between frames that take
//! turns within one run.
//!
//! ```sh
//! cargo bench -p umbrage-render
//! ```
//!
//! Alpha masks are ignored, so that the depth pass without a library draws the same triangles.
//! Times are medians of wall-clock times, with a wait for the GPU after each frame. Further scenes
//! come from the folder `$UMBRAGE_SCENES`, as for the tests; scenes that are missing are named and
//! left out.

#![allow(missing_docs, reason = "a benchmark")]

mod bare;

use bare::BareDepth;
use std::path::Path;
use std::time::Instant;
use umbrage::visibility::Filter;
use umbrage::{Bounds, Camera, Light, Plan, Planner, Technique};
use umbrage_render::{FrameTarget, Gpu, Renderer, SceneBuffers, Shading};
use umbrage_scene::Scene;
use umbrage_testing::third_party_scenes;
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, ShadowOptions};

type Failure = Box<dyn std::error::Error>;

/// Number of frames of each job. The jobs take turns, and the first two frames of each do not
/// count.
const FRAMES: usize = 22;

/// A scene with its default view and light.
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

    fn plan(&self, technique: &Technique) -> Result<Plan, Failure> {
        let bounds =
            Bounds { receiver_parts: &self.boxes, ..Bounds::of_scene(self.scene.bounds()) };
        Ok(Planner::new().plan(&self.camera, &[self.light], &bounds, technique)?.clone())
    }

    fn renderer(&self, filter: Filter) -> Result<Renderer<'_, 'a>, Failure> {
        let options = ShadowOptions { filter, ..ShadowOptions::default() };
        Ok(Renderer::new(self.gpu, &self.buffers, &options)?)
    }

    /// Draws the maps and the picture.
    fn frame(
        &self,
        renderer: &mut Renderer<'_, '_>,
        plan: &Plan,
        target: &FrameTarget,
    ) -> Result<(), Failure> {
        renderer.draw_maps(plan, Casters::Moved, None)?;
        let shading = Shading { camera: &self.camera, light: &self.light, light_index: 0 };
        renderer.frame(&shading, target, None)?;
        Ok(self.gpu.wait()?)
    }
}

/// Median times of several jobs that take turns, milliseconds.
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

/// Compares techniques with each other. Returns the ratios lispsm / uniform and lispsm+z4 / lispsm.
fn techniques(set: &Set<'_>) -> Result<[f64; 2], Failure> {
    let plan = |text: &str| set.plan(&text.parse()?);
    let (uniform, lispsm) = (plan("uniform:pcf3@1024")?, plan("lispsm:pcf3@1024")?);
    let slices = plan("lispsm+z4:pcf3@1024")?;
    let target = FrameTarget::new(set.gpu, set.camera.image())?;
    let pcf = uniform.filter;
    let [mut a, mut b, mut c] = [set.renderer(pcf)?, set.renderer(pcf)?, set.renderer(pcf)?];
    let times = race(&mut [
        &mut || set.frame(&mut a, &uniform, &target),
        &mut || set.frame(&mut b, &lispsm, &target),
        &mut || set.frame(&mut c, &slices, &target),
    ])?;
    println!(
        "  frame: uniform {:.1} ms, lispsm {:.1} ms ({:.3} of uniform), lispsm+z4 {:.1} ms ({:.3} of lispsm)",
        times[0],
        times[1],
        times[1] / times[0],
        times[2],
        times[2] / times[1]
    );
    Ok([times[1] / times[0], times[2] / times[1]])
}

/// Compares the depth pass with one written without any library, and a pass over unchanged maps
/// with the first one. Returns both ratios.
fn depth_pass(set: &Set<'_>) -> Result<[f64; 2], Failure> {
    let plan = set.plan(&"lispsm:pcf3@2048".parse()?)?;
    let mut moved = set.renderer(plan.filter)?;
    let mut unmoved = set.renderer(plan.filter)?;
    let mut bare = BareDepth::new(set.gpu, set.scene, &plan);
    let start = Instant::now();
    unmoved.draw_maps(&plan, Casters::Unmoved, None)?;
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
            unmoved.draw_maps(&plan, Casters::Unmoved, None)?;
            Ok(set.gpu.wait()?)
        },
    ])?;
    println!(
        "  depth pass, 2048²: {:.1} ms, bare wgpu {:.1} ms (ratio {:.3}); unchanged {:.3} ms, first {:.1} ms (ratio {:.4})",
        times[0],
        times[1],
        times[0] / times[1],
        times[2],
        first,
        times[2] / first
    );
    Ok([times[0] / times[1], times[2] / first])
}

/// Compares convolution shadow maps with bilinear comparisons, in the configuration of Annen et al.
/// 2007, Table 1: a map of 1024², a picture of 1024×768.
fn filters(gpu: &Gpu, scene: &Scene) -> Result<(), Failure> {
    let set = Set::new(gpu, scene, [1024, 768])?;
    let target = FrameTarget::new(gpu, set.camera.image())?;
    let names =
        ["pcf2", "csm4", "csm8", "csm16", "csm4(blur=7)", "csm4(blur=3,half)", "csm4(blur=1px)"];
    let mut contenders = Vec::new();
    for name in names {
        let plan = set.plan(&format!("uniform:{name}@1024x1024").parse()?)?;
        contenders.push((set.renderer(plan.filter)?, plan));
    }
    let mut jobs: Vec<_> =
        contenders.iter_mut().map(|(r, plan)| || set.frame(r, plan, &target)).collect();
    let mut jobs: Vec<&mut dyn FnMut() -> Result<(), Failure>> =
        jobs.iter_mut().map(|job| job as _).collect();
    let times = race(&mut jobs)?;
    let triangles: usize =
        scene.instances.iter().map(|i| scene.meshes[i.mesh].triangles.len()).sum();
    println!("{}, {triangles} triangles, 1024² texels, 1024×768:", scene.name);
    for (name, time) in names.iter().zip(&times) {
        println!("  {name}: {time:.1} ms, {:.3} of pcf2", time / times[0]);
    }
    Ok(())
}

fn main() -> Result<(), Failure> {
    // `cargo test --benches` also runs this program, to check that it starts.
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
    let [lispsm, slices, bare, unchanged] = sums.map(|s| (s / scenes.len() as f64).exp());
    println!(
        "geometric means: lispsm/uniform {lispsm:.3}, lispsm+z4/lispsm {slices:.3}, library/bare depth pass {bare:.3}, \
         unchanged/first {unchanged:.4}"
    );
    Ok(())
}
