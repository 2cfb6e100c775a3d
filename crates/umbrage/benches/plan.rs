//! Time to plan one map, by warp.
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;
use umbrage::{Aabb, Bounds, Camera, Light, LookAt, Objective, Options, Planner, Warp};

fn plan(c: &mut Criterion) {
    let camera = Camera::look_at(LookAt {
        eye: DVec3::new(0.0, 6.0, 30.0),
        target: DVec3::new(-15.0, 0.0, 0.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.25,
        far: 125.0,
        image: [960, 540],
    })
    .unwrap();
    let light = Light::Directional { direction: DVec3::new(-0.58, -0.71, -0.41) };
    let scene = Aabb::new(DVec3::new(-41.0, 0.0, -52.0), DVec3::new(41.0, 5.3, 52.0));
    let bounds = Bounds::of_scene(scene);
    let mut group = c.benchmark_group("plan one map");
    for (name, warp) in [
        ("uniform", Warp::Uniform),
        ("psm", Warp::Psm),
        ("lispsm", Warp::Lispsm),
        ("tsm", Warp::Tsm { focus: None }),
        ("adaptive", Warp::Adaptive(Objective::Storage)),
        ("adaptive(area)", Warp::Adaptive(Objective::Area)),
    ] {
        let options = Options { warp, ..Options::default() };
        let mut planner = Planner::new();
        group.bench_function(name, |b| {
            b.iter(|| {
                planner.plan(black_box(&camera), &[light], &bounds, &options).unwrap().maps.len()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, plan);
criterion_main!(benches);
