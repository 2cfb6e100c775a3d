//! Receivers given as many boxes: all receivers in them are served, and the space between them
//! costs no texels.

mod common;

use common::{Config, WARPS, boxes, config, partition, parts, planner, possible, reach, technique};
use glam::DVec3;
use proptest::prelude::*;
use umbrage::{Aabb, Bounds, BoxTree, Faces, Light, Partition, Plan, Splits, Technique, Warp};

/// Points of the parts that the camera sees in the light.
fn seen_points(config: &Config, parts: &[Aabb], numbers: &[[f64; 3]]) -> Vec<DVec3> {
    let full = parts.iter().filter(|p| !p.is_empty());
    let points = full.flat_map(|p| numbers.iter().map(|&n| p.min + p.size() * DVec3::from(n)));
    points.filter(|&p| config.sees(p)).collect()
}

fn tree(parts: &[Aabb]) -> BoxTree {
    BoxTree::new(parts).unwrap()
}

fn plan(config: &Config, bounds: &Bounds<'_>, technique: &Technique) -> Plan {
    planner().plan(&config.camera, &[config.light], bounds, technique).unwrap().clone()
}

fn under_a_sun() -> impl Strategy<Value = Config> {
    config().prop_filter("parallel light", |c| matches!(c.light, Light::Directional { .. }))
}

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(5000))]

    /// Every visible point of a part is served by maps whose errors there do not exceed the
    /// reported ones, and whose caster planes keep the point's casters.
    #[test]
    fn all_parts_are_served(
        config in config(),
        boxes in boxes(),
        partition in partition(),
        numbers in prop::collection::vec(prop::array::uniform3(0.0..=1.0f64), 4),
        pick in 0..WARPS.len(),
    ) {
        let (name, spread) = WARPS[pick];
        let partition = possible(partition, spread);
        let parts = parts(&config, &boxes);
        let bounds = Bounds { receiver_parts: Some(&tree(&parts)), ..config.bounds };
        let plan = plan(&config, &bounds, &Technique { partition, ..technique(spread) });
        for map in &plan.maps {
            let errors = [map.error.max_s, map.error.max_t, map.error.max];
            prop_assert!(map.shadow_from_local.is_finite() && map.local_from_shadow.is_finite());
            prop_assert!(errors.iter().all(|e| e.is_finite()) && map.storage_factor.is_finite());
        }
        // The rounding of world coordinates, as a share of the scene's size.
        let rounding = config.camera.eye().abs().max_element() * 1e-15;
        for p in seen_points(&config, &parts, &numbers) {
            let answers: Vec<(usize, f64)> = plan.lookup(0, p).collect();
            let shares: f64 = answers.iter().map(|(_, share)| share).sum();
            prop_assert!((shares - 1.0).abs() < 1e-9, "{name}: shares of {shares} at {p}");
            for (index, _) in answers {
                let map = &plan.maps[index];
                let Some(shadow) = map.project(p) else {
                    return Err(TestCaseError::fail(format!("{name}: {p} is behind the map")));
                };
                let error = map.perspective_error(&config.camera, p).unwrap();
                let pixel = config.camera.pixel_width(config.camera.depth(p));
                // Rounding in shadow coordinates: its size in metres relative to a texel's.
                let [slack_s, slack_t] = [(error.s, 0), (error.t, 1)].map(|(texel, axis)| {
                    1e-7 + rounding / (texel * pixel * f64::from(map.resolution[axis]))
                });
                prop_assert!((-slack_s..=1.0 + slack_s).contains(&shadow.x), "{name}: {shadow}");
                prop_assert!((-slack_t..=1.0 + slack_t).contains(&shadow.y), "{name}: {shadow}");
                prop_assert!((-1e-6..=1.0 + 1e-6).contains(&shadow.z), "{name}: {shadow}");
                let largest = [map.error.max_s, map.error.max_t, map.error.max];
                for (found, largest) in [error.s, error.t, error.worst].into_iter().zip(largest) {
                    prop_assert!(found <= largest * (1.0 + 1e-6), "{name}: {error:?} {:?}", map.error);
                }
                let reach = match config.light {
                    Light::Directional { .. } => 10.0 * reach(&config.camera),
                    Light::Spot(spot) => 0.9 * p.distance(spot.position),
                    Light::Point(point) => 0.9 * p.distance(point.position),
                };
                let caster = p + config.light.direction_to_light(p) * reach;
                prop_assert!(map.may_cast(Aabb::new(p, p)) && map.may_cast(Aabb::new(caster, caster)));
            }
        }
    }

    /// An even map of the parts needs no more texels than one of a box around them for the same
    /// error, because it is no larger and its receivers are no nearer to the viewer.
    #[test]
    fn parts_cost_no_more_than_a_box_around_them(
        config in under_a_sun(),
        boxes in boxes(),
    ) {
        let parts = parts(&config, &boxes);
        let all = parts.iter().filter(|p| !p.is_empty()).fold(Aabb::EMPTY, |all, p| all.union(*p));
        let all = config.bounds.receivers.map_or(all, |r| r.intersection(all));
        prop_assume!(!all.is_empty());
        let storage = |bounds: Bounds<'_>| plan(&config, &bounds, &technique(Warp::Uniform)).storage_factor();
        let one = storage(Bounds { receivers: Some(all), ..config.bounds });
        let many = storage(Bounds { receiver_parts: Some(&tree(&parts)), ..config.bounds });
        prop_assert!(many <= one * 1.01, "{many} > {one}");
    }

    /// A part that contains everything seen changes nothing. (Under lamps the largest errors are
    /// upper bounds, whose slack depends on where the search begins.)
    #[test]
    fn a_part_around_everything_changes_nothing(
        config in under_a_sun(),
        partition in partition(),
        pick in 0..WARPS.len(),
        larger in prop_oneof![Just(0.0), Just(10.0), Just(1e9)],
    ) {
        let (name, spread) = WARPS[pick];
        // Rounding determines where the search for fitted slices ends, and the range along a face
        // where the light direction is close to the view direction.
        prop_assume!(partition.splits != Splits::Fitted);
        let partition = Partition { faces: Faces::Whole, ..possible(partition, spread) };
        let technique = Technique { partition, ..technique(spread) };
        let far = reach(&config.camera);
        let around_view = Aabb::new(config.camera.eye() - 9.0 * far, config.camera.eye() + 9.0 * far);
        let all = config.bounds.receivers.unwrap_or(around_view);
        // Flat boxes are given a thickness that depends on the size of what is seen.
        let is_flat = all.size().min_element() == 0.0;
        let larger = if is_flat { f64::max(larger, 1.0) } else { larger };
        let part = [Aabb { min: all.min - larger, max: all.max + larger }];
        let expected = plan(&config, &config.bounds, &technique);
        let found = plan(&config, &Bounds { receiver_parts: Some(&tree(&part)), ..config.bounds }, &technique);
        let tolerance = match spread.warp {
            // The strength may lie anywhere near the minimum, which is flat.
            Warp::Adaptive(_) => 1e-5,
            // The perspective amplifies rounding where near and far distances hardly differ.
            Warp::Psm => 1e-3,
            // The map of a nearly flat body depends on rounding.
            _ if all.size().min_element() < 1e-3 * all.size().max_element() => 1e-6,
            _ => 1e-9,
        };
        // An orthographic view may begin at depth 0, but for rounding.
        let near =
            |a: f64, b: f64| (a - b).abs() <= tolerance * a.abs().max(b.abs()) + 1e-15 * far;
        for (a, b) in expected.maps.iter().zip(&found.maps) {
            prop_assert_eq!(a.part, b.part);
            prop_assert_eq!(a.is_empty(), b.is_empty());
            let figures = |m: &umbrage::ShadowMap| {
                let texels = m.resolution.map(f64::from);
                let unit = [m.error.max_s * texels[0], m.error.max_t * texels[1]];
                [m.split[0], m.split[1], unit[0], unit[1]]
            };
            for (x, y) in figures(a).into_iter().zip(figures(b)) {
                prop_assert!(near(x, y), "{name}: {:?} {:?}", figures(a), figures(b));
            }
        }
    }
}

/// Fewer parts are served by larger boxes, down to the one around all.
#[test]
fn fewer_parts_leave_more_space() {
    let camera = umbrage::Camera::look_at(umbrage::LookAt {
        eye: DVec3::new(0.0, 2.0, 0.0),
        target: DVec3::new(0.0, 1.0, -10.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 100.0,
        image: [640, 360],
    })
    .unwrap();
    let light = Light::Directional { direction: DVec3::new(0.4, -1.0, 0.3) };
    let place = |i: u32| DVec3::new(f64::from(i * 7 % 20) - 10.0, 0.0, -2.0 - f64::from(i));
    let boxes: Vec<Aabb> =
        (0..60).map(|i| Aabb::new(place(i), place(i) + DVec3::new(0.5, 3.0, 0.5))).collect();
    let tree = tree(&boxes);
    let bounds =
        Bounds { receivers: Some(tree.bounds()), receiver_parts: Some(&tree), ..Bounds::default() };
    let mut planner = planner();
    let storage = |planner: &mut umbrage::Planner| {
        let technique = Technique::default();
        planner.plan(&camera, &[light], &bounds, &technique).unwrap().storage_factor()
    };
    let all = storage(&mut planner);
    let mut last = all;
    for parts in [8, 1] {
        planner.set_most_parts(parts).unwrap();
        let fewer = storage(&mut planner);
        assert!(fewer > last, "{parts} parts: {fewer}, more parts: {last}");
        last = fewer;
    }
    planner.set_most_parts(umbrage::Planner::MOST_PARTS).unwrap();
    assert_eq!(storage(&mut planner), all);
    for parts in [0, umbrage::Planner::MOST_PARTS + 1] {
        let error = planner.set_most_parts(parts).unwrap_err().to_string();
        assert!(error.starts_with("most_parts"), "{error}");
    }
}

/// A box in full view has its own twelve edges, and one that the picture's side cuts ends there.
#[test]
fn the_edges_seen_are_those_of_the_boxes_within_the_view() {
    let camera = umbrage::Camera::look_at(umbrage::LookAt {
        eye: DVec3::new(1e6, 2.0, 0.0),
        target: DVec3::new(1e6, 2.0, -10.0),
        up: DVec3::Y,
        fov_y_rad: std::f64::consts::FRAC_PI_2,
        near: 0.1,
        far: 100.0,
        image: [64, 64],
    })
    .unwrap();
    let light = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.2) };
    let edges = |min: [f64; 3], max: [f64; 3]| -> Vec<[DVec3; 2]> {
        let offset = DVec3::X * 1e6;
        let parts = [Aabb::new(DVec3::from(min) + offset, DVec3::from(max) + offset)];
        let tree = tree(&parts);
        let bounds = Bounds {
            receivers: Some(tree.bounds()),
            receiver_parts: Some(&tree),
            ..Bounds::default()
        };
        let mut planner = planner();
        planner.plan(&camera, &[light], &bounds, &Technique::default()).unwrap();
        planner.seen_edges().map(|ends| ends.map(|p| p - offset)).collect()
    };
    let whole = edges([-1.0, 1.0, -8.0], [1.0, 3.0, -6.0]);
    assert_eq!(whole.len(), 12);
    assert!(whole.iter().all(|[a, b]| (a.distance(*b) - 2.0).abs() < 1e-5), "{whole:?}");
    // The right side of the picture runs through (x, −x).
    let cut = edges([0.0, 1.0, -8.0], [20.0, 3.0, -6.0]);
    let farthest = cut.iter().flatten().map(|p| p.x).fold(0.0, f64::max);
    assert!((farthest - 8.0).abs() < 1e-5, "{farthest}");
    assert!(cut.iter().flatten().all(|p| p.x <= -p.z + 1e-5));
    assert!(edges([50.0, 1.0, -8.0], [60.0, 3.0, -6.0]).is_empty());
}
