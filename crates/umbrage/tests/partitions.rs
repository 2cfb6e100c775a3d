//! Partitions against Lloyd et al. 2006, §5, and against brute force.

mod common;

use glam::DVec3;
use umbrage::{
    Bounds, Camera, Faces, Light, LookAt, Options, Partition, Plan, Planner, Size, Warp,
};

/// W&P's reference view: n = 1, f = 1000, φ = 30°, square.
fn reference_view() -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::new(3.0, 1.0, 2.0),
        target: DVec3::new(3.0, 1.0, 1.0),
        up: DVec3::Y,
        fov_y_rad: 60f64.to_radians(),
        near: 1.0,
        far: 1000.0,
        image: [512, 512],
    })
    .unwrap()
}

const OVERHEAD: Light = Light::Directional { direction: DVec3::NEG_Y };
const BEHIND: Light = Light::Directional { direction: DVec3::NEG_Z };

fn planned(camera: &Camera, light: Light, warp: Warp, partition: Partition) -> Plan {
    let options =
        Options { warp, partition, size: Size::Budget(1 << 22), max_side: 1 << 16, align: 1 };
    Planner::new().plan(camera, &[light], &Bounds::default(), &options).unwrap().clone()
}

fn storage(light: Light, warp: Warp, slices: u32, faces: Faces) -> f64 {
    let partition = Partition { faces, ..Partition::slices(slices) };
    planned(&reference_view(), light, warp, partition).storage_factor()
}

/// The reference figures, for k = 1, 2, 4, 8, 16 slices.
#[test]
fn storage_factors_of_the_paper() {
    let columns: [(&str, Light, Warp, Faces, [f64; 5]); 4] = [
        (
            "ZP overhead",
            OVERHEAD,
            Warp::Uniform,
            Faces::Whole,
            [865159.0, 1677.3, 90.06, 22.53, 11.52],
        ),
        ("ZP+W overhead", OVERHEAD, Warp::Lispsm, Faces::Whole, [865.16, 53.04, 16.02, 9.50, 7.48]),
        ("ZP behind", BEHIND, Warp::Uniform, Faces::Whole, [1e6, 2000.0, 126.49, 44.99, 37.94]),
        (
            "FP+ZP+W behind",
            BEHIND,
            Warp::Lispsm,
            Faces::SidesAndNear,
            [1999.0, 123.49, 37.99, 22.94, 18.28],
        ),
    ];
    for (name, light, warp, faces, expected) in columns {
        for (k, expected) in [1, 2, 4, 8, 16].into_iter().zip(expected) {
            let s = storage(light, warp, k, faces);
            println!("{name} k={k}: {s:.2} {expected} {:.4}", s / expected);
        }
    }
    for k in [1, 4] {
        println!("FP overhead {k}: {}", storage(OVERHEAD, Warp::Lispsm, k, Faces::SidesAndNear));
        println!("FP- behind {k}: {}", storage(BEHIND, Warp::Lispsm, k, Faces::Sides));
        println!(
            "FP adaptive behind {k}: {}",
            storage(BEHIND, Warp::Adaptive(Default::default()), k, Faces::SidesAndNear)
        );
    }
}
