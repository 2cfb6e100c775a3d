//! Plans with pages executed by ray tracing, against closed forms.

mod common;

use common::{Random, at, camera, ground, nobody, scene, sheet};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeSet;
use umbrage::paged::Page;
use umbrage::{Bounds, Camera, Light, Plan, Planner, PointLight, SpotLight};
use umbrage_scene::{Mesh, Scene};
use umbrage_trace::{DepthMap, Reference, Sample, Tracer, View};

/// Half the width of the box that hangs over the floor.
const HALF: f64 = 0.5;

/// The middle of the box, from the middle of the floor.
const MIDDLE: DVec3 = DVec3::new(0.3, 1.1, -0.2);

/// A box over a floor.
fn box_over_floor(place: DVec3) -> Scene {
    let half = HALF as f32;
    let face =
        |u: Vec3, v: Vec3| sheet((u.cross(v) - u - v) * half, u * 2.0 * half, v * 2.0 * half);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let pairs = (0..3).map(|i| (axes[i], axes[(i + 1) % 3]));
    let faces = pairs.flat_map(|(u, v)| [face(u, v), face(v, u)]);
    let meshes: Vec<Mesh> = std::iter::once(ground(8.0)).chain(faces).collect();
    let middle = place + MIDDLE;
    let mut instances = vec![(0, at(place.x, place.y, place.z))];
    instances.extend((1..7).map(|i| (i, at(middle.x, middle.y, middle.z))));
    scene(meshes, &instances)
}

/// Whether the box lies between a point and the light, both relative to the middle of the floor.
fn is_dark(point: DVec3, to_light: DVec3) -> bool {
    let [a, b] = [-HALF, HALF].map(|side| (MIDDLE + side - point) / to_light);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter.max(0.0) < leave
}

fn look(place: DVec3, image: [u32; 2]) -> Camera {
    let look = camera(place + DVec3::new(-2.5, 2.4, 3.5), place + DVec3::Y * 0.4, image);
    look.with_depth_range(0.1, 40.0).unwrap()
}

fn lights(place: DVec3) -> [Light; 3] {
    let position = place + DVec3::new(1.2, 4.0, -1.0);
    [
        Light::Directional { direction: DVec3::new(0.6, -1.0, 0.45) },
        Light::Spot(SpotLight {
            position,
            direction: DVec3::new(-0.2, -1.0, 0.2),
            half_angle_rad: 0.9,
            near: 0.05,
            range: 30.0,
        }),
        Light::Point(PointLight { position, near: 0.05, range: 30.0 }),
    ]
}

fn planned(camera: &Camera, light: Light, technique: &str) -> Plan {
    let technique = technique.parse().unwrap();
    let mut planner = Planner::new();
    planner.plan(camera, &[light], &Bounds::default(), &technique).unwrap().clone()
}

/// The samples on the floor that face the light, where the closed form says the same `texels`
/// texels around, and whether they are dark.
fn clear<'a>(
    samples: &'a [Option<Sample>],
    view: &'a View<'a>,
    plan: &'a Plan,
    place: DVec3,
    texels: f64,
) -> impl Iterator<Item = (&'a Sample, bool)> {
    let bound = plan.paging.as_ref().unwrap().bound();
    samples.iter().flatten().filter_map(move |sample| {
        let at = sample.surface.position - place;
        let to_light = |at: DVec3| match view.light().position() {
            Some(lamp) => lamp - place - at,
            None => view.light().direction_to_light(at),
        };
        let dark = is_dark(at, to_light(at));
        // The light falls onto the floor at a slant, which makes texels longer.
        let slant = to_light(at).normalize().y;
        let margin = texels * bound * view.camera().pixel_width(sample.depth) / slant;
        let is_clear = (0..16).all(|k| {
            let way = DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8) * margin;
            let near = at + DVec3::new(way.x, 0.0, way.y);
            is_dark(near, to_light(near)) == dark
        });
        (sample.is_facing && at.y.abs() < 1e-6 && is_clear).then_some((sample, dark))
    })
}

#[test]
fn shadows_of_pages_are_those_of_the_closed_form() {
    for place in [DVec3::ZERO, DVec3::new(1e5, -40.0, -1e5)] {
        let scene = box_over_floor(place);
        let tracer = Tracer::new(&scene).unwrap();
        let camera = look(place, [160, 120]);
        for light in lights(place) {
            let view = View::new(&tracer, camera, light, 1).unwrap();
            let band = view.band(0..120, &nobody);
            let soft = match light {
                Light::Directional { .. } => "pcss(light=0.2deg)",
                _ => "pcss(light=0.01m)",
            };
            for (filter, texels) in [("hard", 1.0), ("pcf3", 3.0), (soft, 4.0)] {
                let plan = planned(&camera, light, &format!("paged:{filter}"));
                let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
                let mut counts = [0; 2];
                for (sample, dark) in clear(band.samples(), &view, &plan, place, texels) {
                    counts[usize::from(dark)] += 1;
                    let lit = reference.visibility(0, sample);
                    let expected = f32::from(u8::from(!dark));
                    assert_eq!(lit, expected, "{filter}, {light:?}: {:?}", sample.surface.position);
                }
                assert!(counts[0] > 4000 && counts[1] > 100, "{filter}, {light:?}: {counts:?}");
            }
        }
    }
}

/// What a page holds follows from its address alone, wherever the camera is.
#[test]
fn pages_are_the_same_to_the_bit_for_every_camera() {
    let mut random = Random(5);
    for place in [DVec3::ZERO, DVec3::new(1e5, 30.0, 1e5)] {
        let scene = box_over_floor(place);
        let tracer = Tracer::new(&scene).unwrap();
        for light in lights(place) {
            let mut known: Vec<(Page, DepthMap)> = Vec::new();
            let mut again = 0;
            let mut eye = DVec3::new(-2.5, 2.4, 3.5);
            for _ in 0..6 {
                eye += random.vector(0.3);
                let target = place + random.vector(0.3);
                let camera = common::camera(place + eye, target, [64, 48]);
                let camera = camera.with_depth_range(0.1, 40.0).unwrap();
                let plan = planned(&camera, light, "paged:pcf3");
                let view = View::new(&tracer, camera, light, 1).unwrap();
                let band = view.band(0..48, &nobody);
                let seen: Vec<DVec3> =
                    band.samples().iter().flatten().map(|s| s.surface.position).collect();
                for page in plan.wanted_pages(0, &seen) {
                    let map = plan.page_map(&page).unwrap();
                    let gutter = plan.filter.reach_texels();
                    let depths = DepthMap::render(&tracer, &map, gutter, &nobody).unwrap();
                    match known.iter().find(|(other, _)| *other == page) {
                        Some((_, other)) => {
                            assert_eq!(depths, *other, "{page:?}");
                            again += 1;
                        }
                        None => known.push((page, depths)),
                    }
                }
            }
            assert!(again > 10, "{again} of {} pages were seen again", known.len());
        }
    }
}

#[test]
fn a_full_pool_loses_no_shadow() {
    let place = DVec3::ZERO;
    let scene = box_over_floor(place);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = look(place, [640, 480]);
    for light in lights(place) {
        let view = View::new(&tracer, camera, light, 1).unwrap();
        let band = view.band(0..480, &nobody);
        let seen: Vec<DVec3> =
            band.samples().iter().flatten().map(|s| s.surface.position).collect();
        let mut plan = planned(&camera, light, "paged(error=0.25)@512");
        plan.fit_pages(&seen);
        let paging = plan.paging.as_ref().unwrap();
        assert!(paging.bias > 0.0 && paging.bound() > 0.25, "{light:?}");
        let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
        let mut counts = [0; 2];
        for (sample, dark) in clear(band.samples(), &view, &plan, place, 1.0) {
            counts[usize::from(dark)] += 1;
            let lit = reference.visibility(0, sample);
            assert_eq!(lit, f32::from(u8::from(!dark)), "{light:?}: {:?}", sample.surface.position);
        }
        assert!(counts.iter().all(|&n| n > 3000), "{light:?}: {counts:?}");
        let pages = reference.pages();
        assert!((1..=64).contains(&pages), "{light:?}: {pages}");
    }
}

#[test]
fn only_what_is_looked_up_is_traced() {
    let place = DVec3::ZERO;
    let scene = box_over_floor(place);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = look(place, [160, 120]);
    let light = lights(place)[0];
    let view = View::new(&tracer, camera, light, 1).unwrap();
    let band = view.band(0..120, &nobody);
    let samples: Vec<&Sample> = band.samples().iter().flatten().collect();
    let plan = planned(&camera, light, "paged:pcf3");
    assert_eq!(Reference::rows(&plan), 0);
    let reference = Reference::render(&tracer, &plan, &|_| panic!("no rows to report")).unwrap();
    assert_eq!((reference.pages(), reference.bytes()), (0, 0));
    assert!(reference.depth_maps().is_empty());
    let facing = samples.iter().filter(|s| s.is_facing).map(|s| s.surface.position);
    let facing: Vec<DVec3> = facing.collect();
    // Without those that stand in for missing ones, of which there are none here.
    let places = facing.iter().filter_map(|&position| plan.page_place(0, position));
    let wanted: BTreeSet<Page> = places.map(|place| place.page).collect();
    let all = |reference: &Reference<'_>| -> Vec<f32> {
        samples.par_iter().map(|s| reference.visibility(0, s)).collect()
    };
    let lit = all(&reference);
    assert_eq!(reference.pages(), wanted.len());
    assert_eq!(reference.bytes(), wanted.len() as u64 * 68 * 68 * 4);
    // The windows have far more texels.
    assert!(plan.texels() > 50 * 64 * 64 * wanted.len() as u64);
    // Once more, and by one thread.
    assert_eq!(all(&reference), lit);
    assert_eq!(reference.pages(), wanted.len());
    let alone = Reference::render(&tracer, &plan, &nobody).unwrap();
    assert!(samples.iter().zip(&lit).all(|(s, lit)| alone.visibility(0, s) == *lit));
    for sample in samples {
        let position = sample.surface.position;
        let found = reference.texel(0, position).unwrap();
        let window = &plan.maps[found.map];
        let expected = window.project(position).unwrap().truncate();
        let off = found.texel - expected * f64::from(window.resolution[0]);
        assert!(off.abs().max_element() < 1e-3, "{off}");
    }
    // Beyond the far plane nothing is served, and all is lit.
    assert_eq!(reference.texel(0, place + DVec3::X * 1e4), None);
}
