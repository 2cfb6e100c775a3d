//! Measures what many lights cost in a frame: 64 spot lights and 8 point lights of the built-in
//! scene `lamps`, in one plan.
//!
//! ```sh
//! cargo bench -p umbrage-render --bench lights
//! ```
//!
//! Times are medians of the CPU's time, with the GPU idle at the beginning. `plan` is planning;
//! `maps` is everything else ahead of the GPU's work: places, culling, uploads, encoding and
//! submission.

#![allow(missing_docs, reason = "a benchmark")]

use glam::{DQuat, DVec3};
use std::time::Instant;
use umbrage::{Bounds, BoxTree, Light, Planner, Size, SpotLight, Technique};
use umbrage_render::{Drawn, Gpu, Renderer, SceneBuffers};
use umbrage_scene::SceneCamera;
use umbrage_trace::Tracer;
use umbrage_wgpu::{Casters, LookupBuffers, ShadowOptions};

type Failure = Box<dyn std::error::Error>;

/// Number of frames of each motion. The first two do not count.
const FRAMES: u32 = 22;

/// What moves from frame to frame.
#[derive(Clone, Copy)]
enum Motion {
    Nothing,
    Camera,
    /// This many spot lights swing.
    Lights(usize),
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Result<(), Failure> {
    // `cargo test --benches` also runs this program, to check that it starts.
    if !std::env::args().any(|a| a == "--bench") {
        return Ok(());
    }
    let gpu = Gpu::open()?;
    println!("{}", gpu.info().name);
    let scene = umbrage_scene::builtin("lamps", None)?;
    let buffers = SceneBuffers::new(&gpu, &scene, false)?;
    let boxes = BoxTree::new(&Tracer::new(&scene)?.boxes(256))?;
    let bounds = Bounds { receiver_parts: Some(&boxes), ..Bounds::of_scene(scene.bounds()) };
    let look = &scene.cameras[0];
    println!("{} instances, {} lights", scene.instances.len(), scene.lights.len());
    let motions = [
        ("nothing moves", Motion::Nothing),
        ("four lights move", Motion::Lights(4)),
        ("the camera moves", Motion::Camera),
    ];
    for (size, text) in [(Size::Budget(2048 * 2048), "2048²"), (Size::MaxError(4.0), "error 4")] {
        for name in ["uniform:pcf3", "adaptive:pcf3"] {
            let technique = Technique { size, ..name.parse()? };
            println!("{technique}, {text}:");
            for (what, motion) in motions {
                print!("  {what}: ");
                let lights: Vec<Light> = scene.lights.iter().map(|l| l.light).collect();
                run(&gpu, &buffers, &bounds, &technique, look, lights, motion)?;
            }
        }
    }
    Ok(())
}

fn run(
    gpu: &Gpu,
    buffers: &SceneBuffers,
    bounds: &Bounds<'_>,
    technique: &Technique,
    look: &SceneCamera,
    mut lights: Vec<Light>,
    motion: Motion,
) -> Result<(), Failure> {
    let options = ShadowOptions {
        filter: technique.filter,
        buffers: LookupBuffers::for_technique(technique, lights.len()),
        ..ShadowOptions::default()
    };
    let mut renderer = Renderer::new(gpu, buffers, &options)?;
    let mut planner = Planner::with_limits(gpu.support().limits());
    let [mut planning, mut drawing] = [Vec::new(), Vec::new()];
    let mut drawn: Vec<Vec<(usize, Drawn)>> = Vec::new();
    let mut maps = [0; 2];
    for frame in 0..FRAMES {
        let mut look = look.clone();
        let swing = (f64::from(frame) * 0.2).sin();
        match motion {
            Motion::Nothing => {}
            Motion::Camera => {
                let step = DVec3::new(0.2 * swing, 0.0, -0.1 * f64::from(frame));
                look.eye += step;
                look.target += step;
            }
            Motion::Lights(count) => {
                let spots = lights.iter_mut().filter(|l| matches!(l, Light::Spot(_)));
                for light in spots.take(count) {
                    let Light::Spot(spot) = *light else { continue };
                    let direction = DQuat::from_rotation_x(0.02 * swing) * spot.direction;
                    *light = Light::Spot(SpotLight { direction, ..spot });
                }
            }
        }
        let camera = look.camera([1920, 1080])?;
        let start = Instant::now();
        let plan = planner.plan(&camera, &lights, bounds, technique)?;
        let planned = start.elapsed();
        gpu.wait()?;
        let start = Instant::now();
        let parts = renderer.draw_maps(plan, Casters::Unmoved, None)?;
        let encoded = start.elapsed();
        gpu.wait()?;
        if frame >= 2 {
            planning.push(planned.as_secs_f64() * 1e3);
            drawing.push(encoded.as_secs_f64() * 1e3);
            drawn.push(parts);
        }
        maps = [plan.maps.iter().filter(|m| !m.is_empty()).count(), plan.maps.len()];
    }
    let mean = |value: fn(&(usize, Drawn)) -> f64| {
        drawn.iter().flatten().map(value).fold(0.0, |a, b| a + b) / drawn.len() as f64
    };
    println!(
        "plan {:.3} ms, maps {:.3} ms; {} of {} maps used, drawn {:.1} with {:.0} draws of {:.0} \
         triangles, {:.1} MiB",
        median(planning),
        median(drawing),
        maps[0],
        maps[1],
        mean(|_| 1.0),
        mean(|(_, d)| f64::from(d.draws)),
        mean(|(_, d)| d.triangles as f64),
        renderer.shadows().texture_bytes() as f64 / f64::from(1 << 20),
    );
    Ok(())
}
