//! Rays in real scenes, from the folder that `UMBRAGE_SCENES` names.

mod common;

use common::{Random, all_hits, nobody};
use glam::DVec3;
use std::path::PathBuf;
use umbrage::{Bounds, Camera, Light, LookAt, Planner, Technique};
use umbrage_scene::Scene;
use umbrage_trace::{Ray, Reference, Sample, Tracer, View};

fn load(name: &str) -> Scene {
    let folder = std::env::var_os("UMBRAGE_SCENES").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes"),
        PathBuf::from,
    );
    let path = folder.join(name);
    umbrage_scene::load(&path).unwrap_or_else(|e| {
        panic!("{}: {e} (set UMBRAGE_SCENES to the folder of real scenes)", path.display())
    })
}

#[test]
fn no_hit_is_lost_in_real_scenes() {
    for name in ["atrium/sponza_atrium_reduced.glb", "vehicles/muscle_car.glb", "house/house.glb"] {
        let scene = load(name);
        let tracer = Tracer::new(&scene).unwrap().opaque(true);
        let bounds = tracer.bounds();
        let mut random = Random(1);
        let mut point = || bounds.min + bounds.size() * (random.vector(0.5) + 0.5);
        let mut clear = 0;
        for _ in 0..150 {
            let origin = point();
            let ray = Ray { origin, direction: point() - origin };
            let hits = all_hits(&scene, ray);
            let found = tracer.closest(ray, [0.0, f64::INFINITY]);
            assert!(found.is_some() || hits.iter().all(|h| h.2 < 1e-6), "{name}: {ray:?}");
            let (Some(found), Some(&(t, _, margin))) = (found, hits.first()) else { continue };
            // Real scenes repeat triangles, so only the distance can be compared, not which
            // triangle is hit.
            if margin > 1e-6 {
                clear += 1;
                assert!((found.t - t).abs() < 1e-9 * t.max(1.0), "{name}: {ray:?} {t} {found:?}");
            }
        }
        assert!(clear > 75, "{name}: only {clear} hits");
    }
}

#[test]
fn a_real_level_comes_out_right() {
    // 2048² texels on a view of cars and stands, with alpha masks ignored. Engines of 2026 with
    // four cascades of 1024² and their own biases have 3.9% of the pixels wrong here.
    let scene = load("vehicles/kenney_racing_level.glb");
    let tracer = Tracer::new(&scene).unwrap().opaque(true);
    let camera = Camera::look_at(LookAt {
        eye: DVec3::new(0.0, 6.0, 30.0),
        target: DVec3::new(-15.0, 0.0, 0.0),
        up: DVec3::Y,
        fov_y_rad: 60f64.to_radians(),
        near: 0.25,
        far: 125.0,
        image: [480, 270],
    })
    .unwrap();
    let light = Light::Directional { direction: DVec3::new(-0.57923, -0.707, -0.40558) };
    let view = View::new(&tracer, camera, light, 1).unwrap();
    let band = view.band(0..270, &nobody);
    let counts = |s: &Sample| view.counts(s.is_facing, s.depth);
    let truth = band.map(|s| counts(s).then(|| view.truth(s)), &nobody);
    let bounds = Bounds::of_scene(tracer.bounds());
    let mut planner = Planner::new();
    for text in ["adaptive@2048", "adaptive:pcf2@2048"] {
        let technique: Technique = text.parse().unwrap();
        let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
        let reference = Reference::render(&tracer, plan, &nobody).unwrap();
        let lit = band.map(|s| counts(s).then(|| reference.visibility(0, s)), &nobody);
        let pairs = truth.iter().zip(&lit).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
        let (wrong, all) = pairs.fold((0, 0), |(wrong, all), (truth, lit)| {
            (wrong + usize::from((truth - lit).abs() > 0.5), all + 1)
        });
        let share = wrong as f64 / all as f64;
        assert!(all > 60_000 && share < 0.01, "{text}: {wrong} of {all} are wrong");
    }
}
