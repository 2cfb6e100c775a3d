//! The time of plans in a scene of 200 meshes, while the camera walks and turns.

#[path = "../examples/harness/mod.rs"]
mod harness;

use bevy::prelude::*;
use harness::{Harness, Setup, ViewPoint, looking, median, umbrage};

const MESHES: usize = 200;
const FRAMES: usize = 300;

fn main() -> Result<(), String> {
    println!("median and largest time of {FRAMES} plans, {MESHES} meshes, ms");
    for text in ["adaptive", "adaptive+z4", "uniform+z4", "uniform(stable)+z4(practical=0.65)"] {
        let times = times(text)?;
        let largest = times.iter().copied().fold(0.0, f64::max);
        println!("{text:34} {:.3} {largest:.3}", median(&times).unwrap_or_default());
    }
    Ok(())
}

fn times(text: &str) -> Result<Vec<f64>, String> {
    let view = ViewPoint {
        eye: Vec3::new(0.0, 1.8, 0.0),
        target: Vec3::new(0.0, 1.8, -1.0),
        fov_y_rad: 0.9,
        near: 0.1,
        far: 150.0,
    };
    let mut setup = Setup::new(view, Vec3::new(-0.55, -0.7, -0.35))?;
    setup.size = [64, 36];
    setup.map_size = 64;
    setup.umbrage = umbrage(text)?.0;
    let mut harness = Harness::new(&setup)?;
    harness.add_mesh(Plane3d::default().mesh().size(200.0, 200.0).build(), default(), None);
    // Boxes at places without a pattern, by the golden ratio and the root of two.
    for i in 1..MESHES {
        let share = |step: f32| (i as f32 * step).fract() - 0.5;
        let place = Vec3::new(160.0 * share(0.618_034), 1.0, 160.0 * share(0.414_214));
        let size = 1.0 + 2.0 * (share(0.732_051) + 0.5);
        let place = Transform::from_translation(place).with_scale(Vec3::splat(size));
        harness.add_mesh(Cuboid::default().mesh().build(), place, None);
    }
    harness.settle()?;
    let frames = (0..FRAMES).map(|i| {
        let (walk, turn) = (0.05 * i as f32, 0.02 * i as f32);
        let eye = Vec3::new(walk, 1.8, 0.0);
        harness.set_camera(looking(eye, eye + Quat::from_rotation_y(turn) * Vec3::NEG_Z));
        harness.frame();
        harness.planning_ms().ok_or("nothing was planned".into())
    });
    frames.collect()
}
