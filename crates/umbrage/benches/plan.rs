//! Time to plan the maps of one light in one box of receivers, by warp and partition. The bench
//! `planning` of `umbrage-trace` has many boxes.
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;
use umbrage::{Aabb, Bounds, Camera, Light, LookAt, Planner, Technique};

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
    let mut group = c.benchmark_group("plan");
    for text in [
        "uniform",
        "psm",
        "lispsm",
        "tsm",
        "adaptive",
        "adaptive(area)",
        "uniform+z4",
        "lispsm+z4",
        "adaptive+z4",
        "adaptive+z4(fitted)",
        "adaptive+face",
        "uniform(stable)+z4",
    ] {
        let technique: Technique = text.parse().expect("a technique");
        let mut planner = Planner::new();
        group.bench_function(text, |b| {
            b.iter(|| {
                planner.forget();
                planner.plan(black_box(&camera), &[light], &bounds, &technique).unwrap().maps.len()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, plan);
criterion_main!(benches);
