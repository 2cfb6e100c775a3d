//! A filter's kernel has the requested width, near and far, under any warp and in every slice.

mod common;

use common::{ground, nobody, plan, scene, sheet};
use glam::{DAffine3, DVec3, Vec3};
use umbrage::visibility::statistic::{Csm, Statistic};
use umbrage::visibility::{Blur, Filter, LightSize, Pattern, Prefilter, Width};
use umbrage::{Camera, Light, LookAt, Objective, Partition, Size, Technique, Warp};
use umbrage_trace::{Reference, Tracer, View};

/// Direction of light that falls slightly sideways onto the ground, past the straight edge of a
/// sheet 3 m above it.
const LIGHT: DVec3 = DVec3::new(0.2, -1.0, 0.0);
/// x at which the shadow of the edge lies.
const EDGE_X: f64 = 0.6;

fn camera() -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::new(3.0, 2.0, 20.0),
        target: DVec3::new(EDGE_X, 0.0, 0.0),
        up: DVec3::Y,
        fov_y_rad: 1.2,
        near: 0.5,
        far: 60.0,
        image: [1280, 720],
    })
    .unwrap()
}

/// The distance between the points of the ground with visibility 10% and 90%, at several distances
/// from the viewer: in metres across the light, and in pixels across the edge.
fn ramps(filter: Filter, warp: Warp, slices: u32) -> Vec<Ramp> {
    let over = sheet(Vec3::new(-50.0, 3.0, -60.0), Vec3::Z * 120.0, Vec3::X * 50.0);
    let scene =
        scene(vec![ground(60.0), over], &[(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)]);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = camera();
    let light = Light::Directional { direction: LIGHT };
    let technique = Technique {
        warp,
        partition: Partition { overlap: 0.2, ..Partition::slices(slices) },
        size: Size::Budget(1536 * 1536),
        filter,
        ..Technique::default()
    };
    let plan = plan(&scene, &camera, light, &technique);
    let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
    let view = View::new(&tracer, camera, light, 1).unwrap();
    let lit = |x: f64, z: f64| {
        let pixel = camera.pixel(DVec3::new(x, 0.0, z)).unwrap();
        f64::from(reference.visibility(0, &view.sample(pixel).unwrap()))
    };
    [14.0, 8.0, 0.0, -12.0, -25.0]
        .into_iter()
        .map(|z| {
            let passes = |level: f64| {
                let step = 0.004;
                let first = (-500..500).map(|i| EDGE_X + f64::from(i) * step);
                first.into_iter().find(|&x| lit(x, z) >= level).unwrap()
            };
            let [begin, end] = [0.1, 0.9].map(passes);
            let pixel = |x: f64, z: f64| camera.pixel(DVec3::new(x, 0.0, z)).unwrap();
            let edge = (pixel(EDGE_X, z + 0.01) - pixel(EDGE_X, z - 0.01)).normalize();
            Ramp {
                distance: 20.0 - z,
                // Measured across the light, the ground is foreshortened.
                metres: (end - begin) * LIGHT.normalize().y.abs(),
                pixels: edge.perp_dot(pixel(end, z) - pixel(begin, z)).abs(),
            }
        })
        .collect()
}

/// Width of the penumbra at one distance from the viewer.
#[derive(Debug)]
struct Ramp {
    /// Distance from the viewer along the edge, metres.
    distance: f64,
    metres: f64,
    pixels: f64,
}

const TECHNIQUES: [(Warp, u32); 4] = [
    (Warp::Uniform, 1),
    (Warp::Lispsm, 1),
    (Warp::Adaptive(Objective::Storage), 4),
    (Warp::Psm, 1),
];

/// A statistic that is linear in what it filters, so that the penumbra has the profile of the
/// kernel.
fn csm(width: Width) -> Filter {
    let statistic = Statistic::Csm(Csm::new(16, 0.0, true, false).unwrap());
    Filter::Prefiltered(Prefilter { statistic, blur: Blur::Width(width), half: false })
}

/// A Gaussian rises from 10% to 90% over this many standard deviations.
const RISE: f64 = 2.0 * 1.2816;

#[test]
fn comparisons_are_as_wide_as_told_everywhere() {
    // The mean over a box rises from 10% to 90% over 0.8 of the box's width.
    let filter = Filter::Spread { n: 15, width: Width::Metres(1.2), pattern: Pattern::Grid };
    for (warp, slices) in TECHNIQUES {
        for ramp in ramps(filter, warp, slices) {
            let ratio = ramp.metres / (0.8 * 1.2);
            assert!((ratio - 1.0).abs() < 0.2, "{warp:?}: {ramp:?}");
        }
    }
}

#[test]
fn numbers_are_as_wide_as_told_everywhere() {
    for (warp, slices) in TECHNIQUES {
        for ramp in ramps(csm(Width::Metres(1.6)), warp, slices) {
            let ratio = ramp.metres / (RISE * Prefilter::DEVIATION * 1.6);
            assert!((ratio - 1.0).abs() < 0.2, "{warp:?}: {ramp:?}");
        }
    }
}

#[test]
fn pixels_are_those_of_the_picture() {
    for (warp, slices) in TECHNIQUES {
        // Farther away the viewer sees the ground at an angle whose sine is below a sixteenth. A
        // width in pixels counts there as it does at a sixteenth.
        let ramps = ramps(csm(Width::Pixels(16.0)), warp, slices);
        for ramp in ramps.into_iter().filter(|r| r.distance < 40.0) {
            let ratio = ramp.pixels / (RISE * Prefilter::DEVIATION * 16.0);
            assert!((ratio - 1.0).abs() < 0.2, "{warp:?}: {ramp:?}");
        }
    }
}

/// Under a disc of light, the penumbra is as wide as the light's disc projected through the edge
/// that casts it. (Far from the viewer, the texels of a perspective shadow map are as wide as the
/// penumbra.)
#[test]
fn penumbrae_follow_the_distance_of_what_casts_them() {
    let source = 0.4f64;
    let angle = (2.0 * (0.5 * source).atan()).to_degrees();
    // The rise from 10% to 90% of a disc's area spans this share of the disc's diameter. The sheet
    // lies 3 m above the ground.
    let expected = 0.687 * source * 3.0 / LIGHT.normalize().y.abs();
    for (warp, slices) in &TECHNIQUES[..3] {
        let filter = Filter::Pcss { n: 8, light: LightSize::Degrees(angle as f32) };
        for ramp in ramps(filter, *warp, *slices) {
            let ratio = ramp.metres / expected;
            assert!((ratio - 1.0).abs() < 0.08, "{warp:?}: {ratio} {ramp:?}");
        }
    }
}
