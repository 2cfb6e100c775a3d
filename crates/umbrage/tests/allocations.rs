//! A steady frame allocates no memory.

#![allow(unsafe_code, reason = "counting allocations needs a global allocator")]

use glam::DVec3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use umbrage::{
    Aabb, Bounds, Camera, Faces, Light, LookAt, Partition, Planner, PointLight, Seen, SeenTiles,
    Splits, SpotLight, Technique,
};

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

#[test]
fn steady_frames_do_not_allocate() {
    let camera = |frame: u32| {
        let a = f64::from(frame) * 0.6;
        let eye = DVec3::new(a.sin() * 10.0, 2.0, a.cos() * 10.0);
        Camera::look_at(LookAt {
            eye,
            target: DVec3::new(0.0, 1.0 + a.sin(), 0.0),
            up: DVec3::Y,
            fov_y_rad: 1.0,
            near: 0.1,
            far: 200.0,
            image: [1280, 720],
        })
        .unwrap()
    };
    let bounds =
        Bounds::of_scene(Aabb::new(DVec3::new(-30.0, 0.0, -40.0), DVec3::new(35.0, 9.0, 28.0)));
    let lights = [
        Light::Directional { direction: DVec3::new(0.3, -1.0, 0.2) },
        Light::Spot(SpotLight {
            position: DVec3::new(0.0, 20.0, 0.0),
            direction: DVec3::NEG_Y,
            half_angle_rad: 0.6,
            near: 0.1,
            range: 50.0,
        }),
        Light::Point(PointLight { position: DVec3::new(3.0, 4.0, -2.0), near: 0.1, range: 30.0 }),
    ];
    let texts =
        ["unfocused", "uniform", "psm", "lispsm", "tsm", "adaptive", "adaptive(area)", "log"];
    let technique = |text: &str| text.parse::<Technique>().unwrap();
    let four = Partition::slices(4);
    let partitions = [
        Partition::default(),
        Partition { overlap: 0.2, ..four },
        Partition { splits: Splits::Fitted, ..four },
        Partition { faces: Faces::SidesAndNear, ..Partition::slices(2) },
    ];
    let mut cases: Vec<(&[Light], Technique)> = Vec::new();
    for text in texts {
        for partition in partitions {
            // Fitted slices of all sides of a point light take too long.
            let count = if partition.splits == Splits::Fitted { 2 } else { 3 };
            cases.push((&lights[..count], Technique { partition, ..technique(text) }));
        }
    }
    let lamps = &lights[1..];
    cases.extend([
        (&lights[..], technique("uniform(stable)+z4(overlap=0.2)")),
        (&lights[..], technique("adaptive+z4@20px")),
        (&lights[..1], technique("adaptive+z4:pcss")),
        (lamps, technique("adaptive+z4:pcss(light=0.2m)")),
    ]);
    for (lights, technique) in cases {
        let mut planner = Planner::new();
        let mut orbit = || {
            for frame in 0..11 {
                planner.plan(&camera(frame), lights, &bounds, &technique).unwrap();
            }
        };
        // Buffers are swapped with each other, so all have grown only after a few rounds.
        (0..3).for_each(|_| orbit());
        let before = ALLOCATIONS.with(Cell::get);
        assert!(before > 0, "the counter counts");
        orbit();
        let after = ALLOCATIONS.with(Cell::get);
        assert_eq!(after, before, "{technique:?}, {} lights", lights.len());
    }

    // The camera of each frame sees by the tiles of the frame before, which are set anew as well.
    let depths = |x: u32, y: u32| if x % 100 < 30 { 5.0 } else { 9.0 + f64::from(y) * 0.05 };
    let tiles = [0, 1].map(|frame| SeenTiles::of_depths(&camera(frame), depths).unwrap());
    let mut seen = SeenTiles::new(&camera(0));
    let mut planner = Planner::new();
    let mut steps = || {
        for i in 0..4 {
            seen.set(&camera(0), |index| tiles[0].tiles()[index]).unwrap();
            let bounds =
                Bounds { seen: Some(Seen { tiles: &seen, moving: &[], clearance: 0.0 }), ..bounds };
            let view = camera(i % 2);
            planner.plan(&view, &lights[..1], &bounds, &Technique::default()).unwrap();
        }
    };
    (0..3).for_each(|_| steps());
    let before = ALLOCATIONS.with(Cell::get);
    steps();
    assert_eq!(ALLOCATIONS.with(Cell::get), before, "seen tiles");
}
