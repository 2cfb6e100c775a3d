//! Properties of every plan, over random cameras, lights and bounds.

mod common;

use common::{Spread, WARPS, config, map_count, partition, planner, possible, reach, technique};
use proptest::prelude::*;
use umbrage::{Aabb, Light, Objective, Technique, Warp};

fn numbers() -> impl Strategy<Value = Vec<[f64; 3]>> {
    proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0, 0.0..=1.0], 24)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Every receiver lands in its map; its casters share its texel, lie nearer the light and are
    /// not culled; and no point's error exceeds the reported maximum.
    #[test]
    fn receivers_casters_and_errors(
        config in config(),
        partition in partition(),
        numbers in numbers(),
        pick in 0..WARPS.len(),
    ) {
        let (name, spread) = WARPS[pick];
        let mut planner = planner();
        let partition = possible(partition, spread);
        let technique = Technique { partition, ..technique(spread) };
        let plan = planner.plan(&config.camera, &[config.light], &config.bounds, &technique).unwrap();
        let name = format!("{name} {partition:?}");
        let maps = map_count(&partition, &config.light);
        prop_assert_eq!((plan.maps.len(), plan.lights[0].maps.clone()), (maps, 0..maps));
        for map in &plan.maps {
            prop_assert!(map.shadow_from_local.is_finite() && map.local_from_shadow.is_finite(), "{name}");
        }
        let seen = config.seen_points(&numbers);
        prop_assert!(plan.texels() <= 1 << 20);
        // The rounding of world coordinates, as a share of the scene's size.
        let rounding = config.camera.eye().abs().max_element() * 1e-15;
        let answers = seen.into_iter().flat_map(|p| {
            let shares: f64 = plan.lookup(0, p).map(|(_, share)| share).sum();
            assert!((shares - 1.0).abs() < 1e-9, "{name}: shares of {shares} at {p}");
            plan.lookup(0, p).map(move |(index, _)| (p, index))
        });
        for (p, index) in answers {
            let map = &plan.maps[index];
            let [res_s, res_t] = map.resolution.map(f64::from);
            let Some(shadow) = map.project(p) else {
                return Err(TestCaseError::fail(format!("{name}: {p} is behind the map")));
            };
            let error = map.perspective_error(&config.camera, p).unwrap();
            let pixel = config.camera.pixel_width(config.camera.depth(p));
            // Rounding in texels: its size in metres over a texel's width.
            let slack_s = 1e-7 + rounding / (error.s * pixel * res_s);
            let slack_t = 1e-7 + rounding / (error.t * pixel * res_t);
            prop_assert!((-slack_s..=1.0 + slack_s).contains(&shadow.x), "{name}: s = {}", shadow.x);
            prop_assert!((-slack_t..=1.0 + slack_t).contains(&shadow.y), "{name}: t = {}", shadow.y);
            prop_assert!((-1e-6..=1.0 + 1e-6).contains(&shadow.z), "{name}: depth = {}", shadow.z);
            let in_slab = map.slab_depth(shadow.truncate(), shadow.z);
            prop_assert!((-1e-6..=1.0 + 1e-6).contains(&in_slab), "{name}: depth in the slab = {in_slab}");
            let bound = 1.0 + 1e-6;
            prop_assert!(error.s <= map.error.max_s * bound, "{name}: s {} > {}", error.s, map.error.max_s);
            prop_assert!(error.t <= map.error.max_t * bound, "{name}: t {} > {}", error.t, map.error.max_t);
            prop_assert!(error.worst <= map.error.max * bound, "{name}: {} > {}", error.worst, map.error.max);

            let reach = match config.light {
                Light::Directional { .. } => 10.0 * reach(&config.camera),
                Light::Spot(spot) => 0.9 * p.distance(spot.position),
                Light::Point(point) => 0.9 * p.distance(point.position),
            };
            let caster = p + config.light.direction_to_light(p) * reach;
            let Some(casts) = map.project(caster) else {
                return Err(TestCaseError::fail(format!("{name}: no caster at {caster}, {map:?}")));
            };
            // Under a spot light, texels are up to ten times narrower at the caster.
            let metres = 1e-14 * (config.camera.eye().length() + reach);
            let [texel_s, texel_t] = [error.s, error.t].map(|e| 1e-4 + metres / (e * pixel));
            prop_assert!(((casts - shadow).x * res_s).abs() < texel_s, "{name}: {casts} from {shadow}");
            prop_assert!(((casts - shadow).y * res_t).abs() < texel_t, "{name}: {casts} from {shadow}");
            prop_assert!(casts.z < shadow.z, "{name}: caster at depth {} over {}", casts.z, shadow.z);
            prop_assert!(map.may_cast(Aabb::new(caster, caster)), "{name}: a caster is culled");
            let Some(beam) = map.beam(shadow.truncate()) else {
                return Err(TestCaseError::fail(format!("{name}: no beam at {shadow}, {map:?}")));
            };
            let off = (p - beam.origin).reject_from_normalized(beam.direction).length();
            prop_assert!(off <= 1e-5 * pixel + 1e-6 * error.worst * pixel + 10.0 * rounding, "{name}: beam misses by {off}");
        }
    }

    /// `adaptive` never needs more texels than `uniform` for the same error.
    #[test]
    fn uniform_needs_at_least_adaptive(config in config()) {
        let mut planner = planner();
        let mut storage = |warp| {
            let plan = planner.plan(&config.camera, &[config.light], &config.bounds, &technique(warp)).unwrap();
            plan.storage_factor()
        };
        let uniform = storage(Warp::Uniform);
        let adaptive = storage(Warp::Adaptive(Objective::Storage));
        // Under spot lights each reported maximum is known to one per cent.
        prop_assert!(adaptive <= uniform * 1.021, "{adaptive} > {uniform}");
    }
}

/// The reported maxima are reached to 2%, compared with the errors at the body's corners and along
/// its edges, which brute force finds from all triples and pairs of its planes.
#[test]
fn maxima_are_reached() {
    // Each core takes its share of the warps, over the same cases.
    std::thread::scope(|scope| {
        for spreads in WARPS.chunks(3) {
            scope.spawn(|| check_maxima(spreads));
        }
    });
}

fn check_maxima(spreads: &[(&str, Spread)]) {
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: 10_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let suns =
        config().prop_filter("parallel light", |c| matches!(c.light, Light::Directional { .. }));
    runner
        .run(&suns, |config| {
            let corners = config.corners();
            prop_assume!(corners.len() >= 4);
            let mut planner = planner();
            for &(name, spread) in spreads {
                let plan = planner
                    .plan(&config.camera, &[config.light], &config.bounds, &technique(spread))
                    .unwrap();
                let map = &plan.maps[0];
                prop_assert!(!map.is_empty());
                let forward = config.camera.forward();
                let width = |p: &glam::DVec3| config.camera.pixel_width(p.dot(forward));
                let mut reached = [0f64; 3];
                for (i, a) in corners.iter().enumerate() {
                    for b in &corners[..=i] {
                        for k in 0..=40 {
                            // The points are spread evenly in the image, so the share of b grows
                            // with 1/z in perspective views.
                            let k = f64::from(k) / 40.0;
                            let (to_a, to_b) = ((1.0 - k) * width(b), k * width(a));
                            let p = config.camera.eye() + a.lerp(*b, to_b / (to_a + to_b));
                            if let Some(e) = map.perspective_error(&config.camera, p) {
                                for (r, e) in reached.iter_mut().zip([e.s, e.t, e.worst]) {
                                    *r = r.max(e);
                                }
                            }
                        }
                    }
                }
                let reported = [map.error.max_s, map.error.max_t, map.error.max];
                for (reported, reached) in reported.into_iter().zip(reached) {
                    prop_assert!(reached >= 0.98 * reported, "{name}: {reached} of {reported}");
                }
            }
            Ok(())
        })
        .unwrap();
}
