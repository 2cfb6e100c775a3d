//! A frame in which nothing moves allocates nothing and draws nothing.

#![allow(unsafe_code, reason = "counting allocations needs a global allocator")]

use glam::DVec3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use umbrage::{Aabb, Bounds, Camera, Light, LookAt, Partition, Planner, Technique};
use umbrage_testing::needs;
use umbrage_wgpu::{Casters, Frame, ShadowOptions, Shadows, Support, Timestamps};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: forwards to the system's allocator; counting touches a thread-local without a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|n| n.set(n.get() + 1));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(ptr, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[needs(gpu)]
#[test]
fn a_still_frame_allocates_nothing() {
    let instance = wgpu::Instance::default();
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))
        .expect("a GPU, or a driver in software: run tools/setup");
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default())).unwrap();
    let support = Support::new(&adapter, &device).unwrap();
    let mut shadows = Shadows::new(&device, support, &ShadowOptions::default()).unwrap();
    let camera = Camera::look_at(LookAt {
        eye: DVec3::new(1.0, 3.0, 9.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 60.0,
        image: [640, 360],
    })
    .unwrap();
    let sun = Light::Directional { direction: DVec3::new(0.5, -1.0, 0.25) };
    let bounds = Bounds::of_scene(Aabb::new(DVec3::splat(-20.0), DVec3::splat(20.0)));
    let technique = Technique { partition: Partition::slices(4), ..Technique::default() };
    let mut planner = Planner::new();
    let moved = [Aabb::new(DVec3::splat(-900.0), DVec3::splat(-800.0))];
    let mut counts = Vec::new();
    for i in 0..4 {
        let plan = planner.plan(&camera, &[sun], &bounds, &technique).unwrap();
        let casters = if i % 2 == 0 { Casters::Unmoved } else { Casters::MovedIn(&moved) };
        let mut encoder = device.create_command_encoder(&Default::default());
        let before = ALLOCATIONS.with(Cell::get);
        let frame = Frame { plan, render_origin: DVec3::ZERO, casters };
        let prepared = shadows.prepare(&device, &queue, &frame).unwrap();
        let drawn = prepared.encode(&mut encoder, &Timestamps::default(), |_| {});
        counts.push((drawn, ALLOCATIONS.with(Cell::get) - before));
    }
    assert!(counts[0].0 == 4 && counts[0].1 > 0, "counting works: {counts:?}");
    assert_eq!(counts[2..], [(0, 0); 2]);
}
