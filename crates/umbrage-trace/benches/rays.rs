//! Measures rays per second, on one thread and on all threads, in a built-in scene and in a real
//! one.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;
use std::path::PathBuf;
use umbrage::{Camera, Light, LookAt};
use umbrage_scene::Scene;
use umbrage_trace::{Tracer, View};

const IMAGE: [u32; 2] = [320, 180];

/// A scene with a view of it.
struct Case {
    name: &'static str,
    scene: Scene,
    eye: DVec3,
    target: DVec3,
    travel: DVec3,
}

fn cases() -> Vec<Case> {
    let folder = std::env::var_os("UMBRAGE_SCENES").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes"),
        PathBuf::from,
    );
    let dragons = folder.join("dragon/dragons25_res3.glb");
    let load = |path: &PathBuf| {
        umbrage_scene::load(path).unwrap_or_else(|e| {
            panic!("{}: {e} (set UMBRAGE_SCENES to the folder of real scenes)", path.display())
        })
    };
    vec![
        Case {
            name: "sphere",
            scene: umbrage_scene::builtin("sphere", Some(128)).expect("a built-in scene"),
            eye: DVec3::new(-2.5, 3.4, 7.5),
            target: DVec3::new(0.8, 1.0, 0.0),
            travel: DVec3::new(1.0, -1.25, 0.4),
        },
        Case {
            name: "dragons25_res3",
            scene: load(&dragons),
            eye: DVec3::new(2.0, 1.2, 7.5),
            target: DVec3::new(-1.0, 0.3, 0.0),
            travel: DVec3::new(-0.57923, -0.707, -0.40558),
        },
    ]
}

fn rays(criterion: &mut Criterion) {
    for Case { name, scene, eye, target, travel } in cases() {
        let camera = Camera::look_at(LookAt {
            eye,
            target,
            up: DVec3::Y,
            fov_y_rad: 60f64.to_radians(),
            near: 0.05,
            far: 100.0,
            image: IMAGE,
        })
        .expect("a valid camera");
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        group.throughput(Throughput::Elements(scene.stored_triangles()));
        group.bench_function("build", |b| b.iter(|| Tracer::new(black_box(&scene)).is_ok()));
        let tracer = Tracer::new(&scene).expect("a sound scene");
        let light = Light::Directional { direction: travel };
        let view = View::new(&tracer, camera, light, 1).expect("one ray a pixel");
        for (threads, label) in [(1, "1 thread"), (rayon::current_num_threads(), "all threads")] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("a pool of threads");
            let band = pool.install(|| view.band(0..IMAGE[1], &|_| {}));
            group.throughput(Throughput::Elements(band.samples().len() as u64));
            group.bench_function(format!("closest, {label}"), |b| {
                b.iter(|| pool.install(|| view.band(0..IMAGE[1], &|_| {})).samples().len());
            });
            let facing = band.samples().iter().flatten().filter(|s| s.is_facing).count();
            group.throughput(Throughput::Elements(facing as u64));
            group.bench_function(format!("any, {label}"), |b| {
                b.iter(|| pool.install(|| band.map(|s| view.truth(s), &|_| {})).len());
            });
        }
    }
}

criterion_group!(benches, rays);
criterion_main!(benches);
