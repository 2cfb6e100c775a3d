//! No pops: along smooth motions of camera and sun, the size of the texel in the map's middle is continuous.
//!
//! Motions are sampled finely; where the size changes much from one sample to the next, the place of
//! the largest change is bisected down to rounding. A jump survives that, a steep slope does not.

mod common;

use common::{WARPS, options};
use glam::{DVec2, DVec3};
use umbrage::{Aabb, Bounds, Camera, Light, LookAt, Planner, Warp};

struct Frame {
    eye: DVec3,
    target: DVec3,
    sun: DVec3,
}

/// Where sun and viewer are at time τ in [0, 1].
type Motion = (&'static str, fn(f64) -> Frame);

const EYE: DVec3 = DVec3::new(0.0, 2.0, 10.0);
const TARGET: DVec3 = DVec3::new(-1.0, 1.0, 0.0);

const MOTIONS: [Motion; 5] = [
    ("dolly", |t| Frame {
        eye: EYE + DVec3::new(2.0, 0.0, -9.0) * t,
        target: TARGET + DVec3::new(2.0, 0.0, -9.0) * t,
        sun: DVec3::new(0.5, -0.7, 0.2),
    }),
    ("orbit", |t| {
        let (sin, cos) = (std::f64::consts::TAU * t).sin_cos();
        Frame {
            eye: TARGET + DVec3::new(12.0 * sin, 3.0, 12.0 * cos),
            target: TARGET,
            sun: DVec3::new(0.3, -0.6, 0.8),
        }
    }),
    // From behind the viewer over his head to before him, passing the view at 3°.
    ("sun", |t| {
        let (sin, cos) = (std::f64::consts::PI * t).sin_cos();
        Frame { eye: EYE, target: TARGET, sun: DVec3::new(0.06, -sin - 0.1, -cos) }
    }),
    ("look down", |t| {
        let (sin, cos) = (1.45 * t).sin_cos();
        let eye = DVec3::new(0.0, 8.0, 5.0);
        Frame { eye, target: eye + DVec3::new(0.1, -sin, -cos), sun: DVec3::new(0.4, -1.0, 0.1) }
    }),
    ("sun around", |t| {
        let (sin, cos) = (std::f64::consts::TAU * t).sin_cos();
        Frame { eye: EYE, target: TARGET, sun: DVec3::new(sin, -0.8, cos) }
    }),
];

fn bounds() -> [(&'static str, Bounds<'static>); 3] {
    let floor = Aabb::new(DVec3::new(-40.0, 0.0, -40.0), DVec3::new(40.0, 0.0, 40.0));
    let hall = Aabb::new(DVec3::new(-30.0, 0.0, -60.0), DVec3::new(25.0, 12.0, 30.0));
    [
        ("no bounds", Bounds::default()),
        ("hall", Bounds::of_scene(hall)),
        ("floor", Bounds::of_scene(floor)),
    ]
}

/// Logarithms of width and height of the texel in the middle of the map.
fn texel(planner: &mut Planner, motion: Motion, bounds: &Bounds, warp: Warp, t: f64) -> [f64; 2] {
    let frame = motion.1(t);
    let camera = Camera::look_at(LookAt {
        eye: frame.eye,
        target: frame.target,
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.2,
        far: 120.0,
        image: [1280, 720],
    })
    .unwrap();
    let light = Light::Directional { direction: frame.sun };
    let options = umbrage::Options { size: umbrage::Size::Exact([1024; 2]), ..options(warp) };
    let plan = planner.plan(&camera, &[light], bounds, &options).unwrap();
    let map = &plan.maps[0];
    let middle = map.beam(DVec2::splat(0.5)).expect("a map that sees something");
    let footprint = map.footprint(middle.origin).unwrap();
    [footprint.base().ln(), footprint.height().ln()]
}

#[test]
fn texels_change_size_without_jumps() {
    const STEPS: u32 = 400;
    let mut planner = Planner::new();
    for motion in MOTIONS {
        for (bounds_name, bounds) in bounds() {
            for (name, warp) in WARPS {
                let mut at = |t: f64| texel(&mut planner, motion, &bounds, warp, t);
                let change =
                    |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
                let mut before = at(0.0);
                for i in 1..=STEPS {
                    let mut hi = f64::from(i) / f64::from(STEPS);
                    let mut lo = hi - 1.0 / f64::from(STEPS);
                    let after = at(hi);
                    let (mut at_lo, mut at_hi) = (before, after);
                    // A per cent within 1e-9 of the motion is a jump.
                    while change(at_lo, at_hi) > 0.01 && hi - lo > 1e-9 {
                        let middle = lo.midpoint(hi);
                        let there = at(middle);
                        if change(at_lo, there) > change(there, at_hi) {
                            (hi, at_hi) = (middle, there);
                        } else {
                            (lo, at_lo) = (middle, there);
                        }
                    }
                    let jump = change(at_lo, at_hi);
                    assert!(
                        jump <= 0.01,
                        "{name}, {}, {bounds_name}: a texel jumps by {jump:.3} at {lo}",
                        motion.0
                    );
                    before = after;
                }
            }
        }
    }
}
