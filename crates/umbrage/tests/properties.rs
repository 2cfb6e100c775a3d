//! Properties of every plan, over random cameras, lights and bounds.

mod common;

use common::{
    ADAPTIVE_OVER_UNIFORM, Spread, WARPS, check_numbers, check_served, config, map_count,
    partition, planner, possible, technique,
};
use proptest::prelude::*;
use umbrage::{Light, Objective, Technique, Warp};

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
        prop_assert!(plan.texels() <= 1 << 20);
        let checked = check_numbers(plan)
            .and_then(|()| check_served(&config, plan, &config.seen_points(&numbers)));
        prop_assert!(checked.is_ok(), "{name}: {checked:?}");
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
        prop_assert!(adaptive <= uniform * ADAPTIVE_OVER_UNIFORM, "{adaptive} > {uniform}");
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
