//! Whole scenes, third-party and built-in ones.

mod common;

use common::{Random, all_hits, nobody};
use glam::DVec3;
use std::path::Path;
use umbrage::{Bounds, Camera, Light, LookAt, Planner, Technique};
use umbrage_scene::Scene;
use umbrage_testing::{needs, third_party_scenes};
use umbrage_trace::{Ray, Reference, Sample, Tracer, View};

fn load(name: &str) -> Scene {
    let path = Path::new(third_party_scenes!()).join(name);
    umbrage_scene::load(&path).unwrap_or_else(|e| panic!("{e}"))
}

#[needs(scenes)]
#[test]
fn no_hit_is_lost_in_real_scenes() {
    for name in ["atrium/sponza_atrium_reduced.glb", "vehicles/muscle_car.glb", "house/house.glb"] {
        no_hit_is_lost(name, &load(name), 150);
    }
}

#[test]
fn no_hit_is_lost_in_built_in_scenes() {
    for name in ["lantern", "town", "fence"] {
        // Under an open sky, where two rays of three hit nothing.
        no_hit_is_lost(name, &umbrage_scene::builtin(name, Some(1)).unwrap(), 450);
    }
}

fn no_hit_is_lost(name: &str, scene: &Scene, rays: u32) {
    let tracer = Tracer::new(scene).unwrap().opaque(true);
    let bounds = tracer.bounds();
    let mut random = Random(1);
    let mut point = || bounds.min + bounds.size() * (random.vector(0.5) + 0.5);
    let mut clear = 0;
    for _ in 0..rays {
        let origin = point();
        let ray = Ray { origin, direction: point() - origin };
        let hits = all_hits(scene, ray);
        let found = tracer.closest(ray, [0.0, f64::INFINITY]);
        assert!(found.is_some() || hits.iter().all(|h| h.2 < 1e-6), "{name}: {ray:?}");
        let (Some(found), Some(&(t, _, margin))) = (found, hits.first()) else { continue };
        // Real scenes repeat triangles: compare where, not which.
        if margin > 1e-6 {
            clear += 1;
            assert!((found.t - t).abs() < 1e-9 * t.max(1.0), "{name}: {ray:?} {t} {found:?}");
        }
    }
    assert!(clear > 75, "{name}: only {clear} hits");
}

#[needs(scenes)]
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
    comes_out_right(&tracer, camera, light);
}

#[test]
fn a_built_in_world_comes_out_right() {
    let scene = umbrage_scene::builtin("airfield", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let camera = scene.default_view().camera([480, 270]).unwrap();
    comes_out_right(&tracer, camera, scene.default_light().light);
}

fn comes_out_right(tracer: &Tracer<'_>, camera: Camera, light: Light) {
    let view = View::new(tracer, camera, light, 1).unwrap();
    let band = view.band(0..270, &nobody);
    let counts = |s: &Sample| view.counts(s.is_facing, s.depth);
    let truth = band.map(|s| counts(s).then(|| view.truth(s)), &nobody);
    let bounds = Bounds::of_scene(tracer.bounds());
    let mut planner = Planner::new();
    for text in ["adaptive@2048", "adaptive:pcf2@2048"] {
        let technique: Technique = text.parse().unwrap();
        let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
        let reference = Reference::render(tracer, plan, &nobody).unwrap();
        let lit = band.map(|s| counts(s).then(|| reference.visibility(0, s)), &nobody);
        let pairs = truth.iter().zip(&lit).filter_map(|(a, b)| Some((a.as_ref()?, b.as_ref()?)));
        let (wrong, all) = pairs.fold((0, 0), |(wrong, all), (truth, lit)| {
            (wrong + usize::from((truth - lit).abs() > 0.5), all + 1)
        });
        let share = wrong as f64 / all as f64;
        assert!(all > 60_000 && share < 0.01, "{text}: {wrong} of {all} are wrong");
    }
}
