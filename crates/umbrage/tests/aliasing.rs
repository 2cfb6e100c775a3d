//! Footprints and surface errors against finite differences over the maps' own beams.

mod common;

use common::{WARPS, config, detail, planner, technique};
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use umbrage::ShadowMap;

/// Where the beam through (s, row) meets the plane through `point`.
fn meet(map: &ShadowMap, s: f64, row: f64, point: DVec3, normal: DVec3) -> Option<DVec3> {
    let beam = map.beam(DVec2::new(s, map.rows.t_from_row(row)))?;
    let facing = beam.direction.dot(normal);
    (facing.abs() > 0.05)
        .then(|| beam.origin + beam.direction * ((point - beam.origin).dot(normal) / facing))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn analytic_jacobians_match_finite_differences(
        config in config(),
        numbers in proptest::collection::vec([0.01..0.99f64, 0.01..0.99, 0.01..0.99], 8),
        pick in 0..WARPS.len(),
        normal in common::direction(),
    ) {
        let (name, spread) = WARPS[pick];
        let camera = config.camera;
        // Differences of coordinates far from the origin lose all digits.
        prop_assume!(camera.eye().length() < 1e3 * detail(&camera).max(0.1));
        let mut planner = planner();
        let plan = planner.plan(&camera, &[config.light], &config.bounds, &technique(spread)).unwrap();
        for p in config.seen_points(&numbers) {
            let map = &plan.maps[plan.lookup(0, p).next().unwrap().0];
            let shadow = map.project(p).unwrap();
            let row = map.rows.row_from_t(shadow.y);
            let [res_s, res_t] = map.resolution.map(f64::from);
            let difference = |normal: DVec3, step: f64| {
                let at = |i: f64, j: f64| meet(map, shadow.x + i * step, row + j * step, p, normal);
                let d_s = (at(1.0, 0.0)? - at(-1.0, 0.0)?) / (2.0 * step * res_s);
                let d_t = (at(0.0, 1.0)? - at(0.0, -1.0)?) / (2.0 * step * res_t);
                Some((d_s, d_t))
            };
            // The disagreement of differences at two steps tells how accurate they are.
            let differences = |normal: DVec3| {
                let (coarse, fine) = (difference(normal, 1e-5)?, difference(normal, 1e-6)?);
                let trust = coarse.0.distance(fine.0) + coarse.1.distance(fine.1);
                let length = fine.0.length().max(fine.1.length());
                (trust < 0.01 * length).then_some((fine.0, fine.1, trust + 2e-3 * length))
            };
            let close = |a: f64, b: f64| (a - b).abs() <= 0.01 * a.abs().max(b.abs());

            let beam = map.beam(shadow.truncate()).unwrap().direction;
            let Some((d_s, d_t, bends)) = differences(beam) else { continue };
            let footprint = map.footprint(p).unwrap();
            prop_assert!(footprint.per_s.distance(d_s) <= bends, "{name}: {:?} {d_s}", footprint.per_s);
            prop_assert!(footprint.per_t.distance(d_t) <= bends, "{name}: {:?} {d_t}", footprint.per_t);
            prop_assert!(close(footprint.base(), d_s.length()));
            let angle_max = (0..720)
                .map(|i| (f64::from(i) * std::f64::consts::PI / 720.0).sin_cos())
                .map(|(sin, cos)| (d_s * cos + d_t * sin).length())
                .fold(0.0, f64::max);
            prop_assert!(close(footprint.longest(), angle_max), "{name}: {} {angle_max}", footprint.longest());

            let Some((d_s, d_t, _)) = differences(normal) else { continue };
            let error = map.surface_error(&camera, p, normal).unwrap();
            // A hundredth of a pixel, according to the error computed.
            let tiny = 1e-2 / error.worst;
            let [Some(here), Some(by_s), Some(by_t)] =
                [p, p + d_s * tiny, p + d_t * tiny].map(|q| camera.pixel(q))
            else {
                continue;
            };
            let (q_s, q_t) = ((by_s - here) / tiny, (by_t - here) / tiny);
            let angles = (0..720).map(|i| (f64::from(i) * std::f64::consts::PI / 720.0).sin_cos());
            let lengths = angles.map(|(sin, cos)| (q_s * cos + q_t * sin).length());
            let (min, max) = lengths.fold((f64::INFINITY, 0f64), |(lo, hi), v| (lo.min(v), hi.max(v)));
            prop_assert!((error.worst - max).abs() <= 0.01 * max, "{name}: worst {} {max}", error.worst);
            prop_assert!((error.best - min).abs() <= 0.01 * max, "{name}: best {} {min}", error.best);
        }
    }

    /// A receiver's plane is a plane in shadow space, so its depth at other points follows from the
    /// slope.
    #[test]
    fn receiver_planes_are_planes(
        config in config(),
        number in [0.01..0.99f64, 0.01..0.99, 0.01..0.99],
        pick in 0..WARPS.len(),
        normal in common::direction(),
    ) {
        let (name, spread) = WARPS[pick];
        prop_assume!(config.camera.eye().length() < 1e3 * detail(&config.camera).max(0.1));
        let mut planner = planner();
        let plan = planner.plan(&config.camera, &[config.light], &config.bounds, &technique(spread)).unwrap();
        for p in config.seen_points(&[number]) {
            let (index, _) = plan.lookup(0, p).next().unwrap();
            let map = &plan.maps[index];
            let receiver = plan.receiver(index, p, normal).unwrap();
            let Some(q) = meet(map, receiver.st.x + 3e-3, map.rows.row_from_t(receiver.st.y) - 2e-3, p, normal) else {
                continue;
            };
            let Some(there) = map.project(q) else { continue };
            let predicted = receiver.depth + receiver.slope.dot(there.truncate() - receiver.st);
            let size = 1.0 + there.z.abs() + (there.z - receiver.depth).abs();
            prop_assert!((there.z - predicted).abs() < 1e-6 * size, "{name}: {} {predicted}", there.z);
        }
    }
}

#[test]
fn surfaces_edge_on_to_the_light_have_infinite_error() {
    let camera = umbrage::Camera::look_at(umbrage::LookAt {
        eye: DVec3::new(0.0, 2.0, 0.0),
        target: DVec3::new(0.0, 0.0, -5.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 100.0,
        image: [640, 480],
    })
    .unwrap();
    let light = umbrage::Light::Directional { direction: DVec3::NEG_Y };
    let mut planner = planner();
    let plan = planner.plan(&camera, &[light], &Default::default(), &Default::default()).unwrap();
    let map = &plan.maps[0];
    let wall = map.surface_error(&camera, DVec3::new(0.0, 0.0, -5.0), DVec3::Z).unwrap();
    assert!(wall.worst > 1e9);
    let floor = map.surface_error(&camera, DVec3::new(0.0, 0.0, -5.0), DVec3::Y).unwrap();
    assert!(floor.worst.is_finite() && floor.best > 0.0 && floor.best <= floor.worst);
}
