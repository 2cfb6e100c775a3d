//! The truth of area lights against closed forms, and its stated noise.

mod common;

use common::{Random, below, camera, ground, scene, sheet};
use glam::{DAffine3, DVec3, Vec3};
use umbrage::visibility::LightSize;
use umbrage::{Light, PointLight};
use umbrage_trace::{AreaLight, AreaVisibility, Error, Sample, Tracer, View};

/// The share of a disc of radius 1 on the far side of a line at this signed distance from its
/// middle.
fn beyond(distance: f64) -> f64 {
    let d = distance.clamp(-1.0, 1.0);
    (d.acos() - d * (1.0 - d * d).sqrt()) / std::f64::consts::PI
}

/// Looks at points of the ground from `first` to `last` along x, and hands each its x and what
/// reaches it of the light.
fn profile(
    view: &View<'_>,
    size: LightSize,
    [first, last]: [f64; 2],
    mut look: impl FnMut(f64, AreaVisibility),
) {
    let area = AreaLight::new(view, size).unwrap();
    let mut random = Random(1);
    for i in 0..400 {
        let x = first + (last - first) * f64::from(i) / 399.0;
        let at = DVec3::new(x, 0.5, random.between(-0.5, 0.5));
        let surface = below(view.tracer(), at);
        assert_eq!(surface.position.y, 0.0);
        look(x, area.visibility(&Sample { surface, depth: 1.0, is_facing: true }));
    }
}

/// Checks the errors of a profile: their mean, their size against the stated one, and the largest.
fn check(errors: &[f64], stated: &[f64]) {
    let rms =
        |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let [found, told] = [rms(errors), rms(stated)];
    assert!(errors.len() > 200 && mean.abs() < 6e-4, "mean of {}: {mean}", errors.len());
    assert!(found < 1.0 / 255.0 && (0.6..1.4).contains(&(found / told)), "{found}, told {told}");
    let worst = errors.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    assert!(worst < 5.0 / 255.0, "{worst}");
    assert!(stated.iter().all(|&s| s <= AreaLight::STANDARD_ERROR));
}

#[test]
fn the_penumbra_of_an_edge_is_that_of_a_disc() {
    // A sheet 2 m above the ground covers x < 0, under a sun at the zenith.
    let half_plane = sheet(Vec3::new(-9.0, 2.0, -9.0), Vec3::X * 9.0, Vec3::Z * 18.0);
    let places = [(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)];
    let scene = scene(vec![ground(10.0), half_plane], &places);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = camera(DVec3::Y, DVec3::ZERO, [4, 4]);
    let sun = Light::Directional { direction: -DVec3::Y };
    let view = View::new(&tracer, camera, sun, 1).unwrap();
    for degrees in [0.53f64, 10.0] {
        let width = 2.0 * (0.5 * degrees).to_radians().tan();
        let (mut errors, mut stated) = (Vec::new(), Vec::new());
        profile(
            &view,
            LightSize::Degrees(degrees as f32),
            [-1.5 * width, 1.5 * width],
            |x, found| {
                let expected = beyond(-x / width);
                if x.abs() < width {
                    errors.push(f64::from(found.visibility) - expected);
                    stated.push(f64::from(found.standard_error));
                } else {
                    assert_eq!(f64::from(found.visibility), expected, "at {x}");
                    assert!(found.rays < 50, "{found:?}");
                }
            },
        );
        check(&errors, &stated);
    }
}

#[test]
fn the_penumbra_of_an_edge_under_a_lamp_is_that_of_its_cone() {
    // A lamp of 0.6 m across at 3 m height, and a sheet at 1 m that covers x < 0. The lamp's cone
    // from a ground point cuts a plane across the cone's axis in a disc.
    let half_plane = sheet(Vec3::new(-9.0, 1.0, -9.0), Vec3::X * 9.0, Vec3::Z * 18.0);
    let places = [(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)];
    let scene = scene(vec![ground(10.0), half_plane], &places);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = camera(DVec3::Y, DVec3::ZERO, [4, 4]);
    let lamp = DVec3::new(0.0, 3.0, 0.0);
    let light = Light::Point(PointLight { position: lamp, near: 1e-3, range: 100.0 });
    let view = View::new(&tracer, camera, light, 1).unwrap();
    let (mut errors, mut stated) = (Vec::new(), Vec::new());
    // The edge runs along z, so only points with z = 0 have it across the plane of the cone's axis.
    let area = AreaLight::new(&view, LightSize::Metres(0.6)).unwrap();
    for i in 0..400 {
        let x = -0.3 + 0.6 * f64::from(i) / 399.0;
        let surface = below(&tracer, DVec3::new(x, 0.5, 0.0));
        let found = area.visibility(&Sample { surface, depth: 1.0, is_facing: true });
        let distance = lamp.distance(surface.position);
        let half_angle = (0.3 / distance).asin();
        // The angle between the axis and the plane through the point and the edge.
        let axis = (-x).atan2(3.0);
        let edge = (-x).atan2(1.0);
        let expected = beyond((edge - axis).tan() / half_angle.tan());
        if expected > 0.0 && expected < 1.0 {
            errors.push(f64::from(found.visibility) - expected);
            stated.push(f64::from(found.standard_error));
        } else {
            assert_eq!(f64::from(found.visibility), expected, "at {x}");
        }
    }
    check(&errors, &stated);
}

#[test]
fn leaves_need_more_rays_and_keep_the_stated_noise() {
    // A lattice of bars finer than the penumbra: half of the light arrives everywhere.
    let bar = |i: i32| sheet(Vec3::new(0.02 * i as f32, 4.0, -6.0), Vec3::X * 0.01, Vec3::Z * 12.0);
    let meshes: Vec<_> = std::iter::once(ground(10.0)).chain((-60..60).map(bar)).collect();
    let places: Vec<_> = (0..meshes.len()).map(|i| (i, DAffine3::IDENTITY)).collect();
    let scene = scene(meshes, &places);
    let tracer = Tracer::new(&scene).unwrap();
    let sun = Light::Directional { direction: -DVec3::Y };
    let view = View::new(&tracer, camera(DVec3::Y, DVec3::ZERO, [4, 4]), sun, 1).unwrap();
    let area = AreaLight::new(&view, LightSize::Degrees(5.0)).unwrap();
    let mut random = Random(3);
    let mut squares = 0.0;
    for _ in 0..40 {
        let at = random.in_square(0.05);
        let surface = below(&tracer, DVec3::new(at.x, 1.0, at.y));
        let sample = Sample { surface, depth: 1.0, is_facing: true };
        let found = area.visibility(&sample);
        assert!(f64::from(found.standard_error) <= AreaLight::STANDARD_ERROR, "{found:?}");
        assert_eq!(found, area.visibility(&sample), "the same rays again");
        let glance = area.glance(&sample);
        let off = (glance.visibility - 0.5).abs();
        assert!(glance.rays < 200 && off <= 4.0 * glance.standard_error, "{glance:?}");
        // Of a disc with a radius of 17 bars, bars hide half to a thousandth.
        squares += (f64::from(found.visibility) - 0.5).powi(2);
    }
    let rms = (squares / 40.0f64).sqrt();
    assert!(rms < 1.5 / 255.0, "{rms}");
}

#[test]
fn a_small_light_gives_the_point_lights_truth() {
    let slab = sheet(Vec3::new(-1.0, 1.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
    let places = [(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)];
    let scene = scene(vec![ground(5.0), slab], &places);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = camera(DVec3::new(0.0, 4.0, 6.0), DVec3::ZERO, [40, 30]);
    let position = DVec3::new(0.3, 3.0, 0.1);
    for (light, size) in [
        (Light::Directional { direction: DVec3::new(0.2, -1.0, 0.1) }, LightSize::Degrees(1e-6)),
        (Light::Point(PointLight { position, near: 1e-3, range: 50.0 }), LightSize::Metres(1e-7)),
    ] {
        let view = View::new(&tracer, camera, light, 1).unwrap();
        let area = AreaLight::new(&view, size).unwrap();
        let band = view.band(0..30, &common::nobody);
        let [hard, soft] = [
            band.map(|s| view.truth(s), &common::nobody),
            band.map(|s| area.visibility(s).visibility, &common::nobody),
        ];
        assert!(hard.contains(&0.0) && hard.contains(&1.0));
        assert_eq!(hard, soft);
        let wrong = match size {
            LightSize::Degrees(_) => LightSize::Metres(0.1),
            LightSize::Metres(_) => LightSize::Degrees(0.5),
        };
        for size in [wrong, LightSize::Metres(-1.0), LightSize::Degrees(f32::NAN)] {
            assert!(matches!(AreaLight::new(&view, size), Err(Error::LightSize { .. })));
        }
    }
}
