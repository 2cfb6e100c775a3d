//! Light that leaks through prefilters where the truth is in full shadow: behind a fence, as in
//! Annen et al. 2007, Fig. 9.

mod common;

use common::nobody;
use glam::DVec2;
use std::path::Path;
use umbrage::visibility::statistic::{Csm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, Prefilter, texel_coordinates};
use umbrage::{Bounds, BoxTree, Plan, Planner, Receiver, Technique, Warp};
use umbrage_scene::Scene;
use umbrage_testing::{needs, third_party_scenes};
use umbrage_trace::{DepthMap, Reference, Tracer, View};

const BLUR: Blur = Blur::Texels(7);

/// The visibility that the blur itself gives: its weights, over an exact comparison of each texel
/// with the receiver's plane.
fn exact(plan: &Plan, depths: &DepthMap, receiver: &Receiver) -> f64 {
    let map = &plan.maps[0];
    let kernel = Prefilter { statistic: Statistic::Vsm(Vsm::default()), blur: BLUR, half: false };
    let weights: Vec<f64> = kernel.weights().map(f64::from).collect();
    let weight = |k: i32| weights.get(k.unsigned_abs() as usize).copied().unwrap_or(0.0);
    let radius = kernel.radius_texels() as i32;
    let corner = texel_coordinates(map, receiver.st) - 0.5;
    let (first, fraction) = (corner.floor(), corner - corner.floor());
    // Bilinear interpolation between texels spreads each weight over two neighbours.
    let along = |k: i32, f: f64| (1.0 - f) * weight(k) + f * weight(k - 1);
    let size = DVec2::from(map.resolution.map(f64::from));
    let mut sum = 0.0;
    for y in -radius..=radius + 1 {
        for x in -radius..=radius + 1 {
            let at = first.as_ivec2() + glam::IVec2::new(x, y);
            let rise = receiver.slope.dot((at.as_dvec2() + 0.5) / size - receiver.st);
            let limit = receiver.depth.min(receiver.depth + rise).min(1.0) - receiver.half_texel;
            let is_lit = f64::from(depths.texel(at.x, at.y)) >= limit.max(1e-7);
            sum += along(x, fraction.x) * along(y, fraction.y) * f64::from(u8::from(is_lit));
        }
    }
    sum
}

/// For each statistic, the mean light beyond what the blur itself lets through, over all points
/// that the truth has in full shadow, and over those of them where the blur lets nothing through.
fn leaks(scene: &Scene, statistics: &[Statistic]) -> Vec<[f64; 2]> {
    let tracer = Tracer::new(scene).unwrap();
    let v = scene.default_view();
    let camera = v.camera([480, 270]).unwrap();
    let light = scene.default_light().light;
    let boxes = BoxTree::new(&tracer.boxes(256)).unwrap();
    let bounds = Bounds { receiver_parts: Some(&boxes), ..Bounds::of_scene(scene.bounds()) };
    let plan_for = |filter| {
        let technique = Technique { warp: Warp::Uniform, filter, ..Technique::default() };
        Planner::new().plan(&camera, &[light], &bounds, &technique).unwrap().clone()
    };
    let plan = &plan_for(Filter::Pcf { n: 9 });
    let view = View::new(&tracer, camera, light, 1).unwrap();
    let band = view.band(0..camera.image()[1], &nobody);
    let hard = Reference::render(&tracer, plan, &nobody).unwrap();
    let shadowed = band.map(
        |s| {
            let surface = &s.surface;
            let receiver = plan.receiver(0, surface.position, surface.geometric_normal)?;
            let is_dark = s.is_facing && view.truth(s) == 0.0;
            is_dark.then(|| exact(plan, &hard.depth_maps()[0], &receiver))
        },
        &nobody,
    );
    let of = |&statistic: &Statistic| {
        let filter = Filter::Prefiltered(Prefilter { statistic, blur: BLUR, half: false });
        let plan = plan_for(filter);
        let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
        let visibility = band.map(|s| Some(reference.visibility(0, s)), &nobody);
        let mut sums = [(0.0, 0u32); 2];
        for (exact, visibility) in shadowed.iter().zip(visibility) {
            let (Some(exact), Some(visibility)) = (exact, visibility) else { continue };
            let leak = (f64::from(visibility) - exact).max(0.0);
            for (sum, counts) in sums.iter_mut().zip([true, *exact == 0.0]) {
                if counts {
                    *sum = (sum.0 + leak, sum.1 + 1);
                }
            }
        }
        let means = sums.map(|(sum, n)| sum / f64::from(n));
        println!("{}, {statistic:?}: {means:.4?} of {:?} points", scene.name, sums.map(|s| s.1));
        means
    };
    statistics.iter().map(of).collect()
}

/// The statistic of `csmM`, or of `csmM(offset,leak=0.15)`.
fn csm(order: u32, is_offset: bool) -> Statistic {
    let csm = Csm::new(order, 0.0, is_offset, !is_offset).unwrap();
    Statistic::Csm(csm.with_leak(if is_offset { 0.15 } else { 0.1 }))
}

/// Under bars finer than the blur every point is half lit, and leaking light adds to that. The
/// series is not doubled here, because doubling would brighten these points.
#[test]
fn a_fence_leaks_a_tenth_of_what_variance_does() {
    let scene = umbrage_scene::builtin("fence", None).unwrap();
    let statistics = [Statistic::Vsm(Vsm::default()), csm(8, true), csm(16, true)];
    let leaks = leaks(&scene, &statistics).into_iter().map(|[all, _]| all).collect::<Vec<_>>();
    assert!(leaks[0] > 0.05, "nothing leaks: {leaks:?}");
    assert!(leaks[1] < 0.1 * leaks[0] && leaks[2] < 0.1 * leaks[0], "{leaks:?}");
}

/// In a lattice, surfaces lie behind surfaces, so there are points where all that the blur covers
/// is in shadow.
#[needs(scenes)]
#[test]
fn a_lattice_leaks_a_tenth_of_what_variance_does() {
    let folder = Path::new(third_party_scenes!());
    let load =
        |name: &str| umbrage_scene::load(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
    let statistics = [Statistic::Vsm(Vsm::default()), csm(8, false), csm(16, false)];
    let dark = leaks(&load("lattice/lattice_ball.glb"), &statistics);
    let dark: Vec<f64> = dark.into_iter().map(|[_, dark]| dark).collect();
    assert!(dark[0] > 0.01, "nothing leaks: {dark:?}");
    assert!(dark[1] < 0.1 * dark[0] && dark[2] < 0.1 * dark[0], "{dark:?}");

    // Behind rows of fences there are no such points.
    let statistics = [Statistic::Vsm(Vsm::default()), csm(8, true), csm(16, true)];
    let rows = leaks(&load("lattice/fence_rows.glb"), &statistics);
    let rows: Vec<f64> = rows.into_iter().map(|[all, _]| all).collect();
    assert!(rows[1] < 0.1 * rows[0] && rows[2] < 0.1 * rows[0], "{rows:?}");
}
