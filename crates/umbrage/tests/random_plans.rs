//! Random plans: every kind of view, light, bounds and technique, and the odd cases among them.
//!
//! A few are planned with each run of the tests, a million with
//!
//! ```text
//! cargo test --release -p umbrage --test random_plans -- --ignored --nocapture
//! ```
//!
//! which prints how often each fault was found, with the first case of each. `PROPTEST_RNG_SEED`
//! chooses other cases.

mod common;

use common::{
    Config, Fault, STABLE, WARPS, boxes, check_numbers, check_served, map_count, odd_config,
    partition, parts, possible,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use std::collections::BTreeMap;
use umbrage::visibility::{Filter, LightSize};
use umbrage::{
    Aabb, Bounds, BoxTree, Error, Limits, Objective, Plan, Planner, Size, Splits, Technique, Warp,
};

/// Everything that a plan is made for.
#[derive(Clone, Debug)]
struct Case {
    config: Config,
    parts: Option<Vec<Aabb>>,
    technique: Technique,
    limits: Limits,
    /// Shares, 0 to 1, that pick points among the receivers.
    numbers: Vec<[f64; 3]>,
}

fn size() -> impl Strategy<Value = Size> {
    prop_oneof![
        6 => Just(Size::Budget(1 << 20)),
        1 => (400u64..1 << 32).prop_map(Size::Budget),
        1 => [1u32..5000, 1u32..5000].prop_map(Size::Exact),
        1 => (-3.0..6.0f64).prop_map(|digits| Size::MaxError(10f64.powf(digits))),
    ]
}

/// A technique with one of the filters that plans depend on: through their reach, their alignment
/// or the depths that they keep.
fn technique(light_is_sun: bool) -> impl Strategy<Value = Technique> {
    let light = match light_is_sun {
        true => LightSize::Degrees(0.5),
        false => LightSize::Metres(0.1),
    };
    let filter = prop_oneof![
        4 => Just(Filter::Hard),
        1 => Just(Filter::Pcf { n: 5 }),
        1 => Just(Filter::Pcss { n: 4, light }),
    ];
    (0..WARPS.len(), partition(), filter, size()).prop_map(|(pick, partition, filter, size)| {
        let (_, spread) = WARPS[pick];
        let partition = possible(partition, spread);
        let size = match size {
            // A stable map moves by whole texels, of which it needs two.
            Size::Exact(sides) if spread == STABLE => Size::Exact(sides.map(|n| n.max(2))),
            size => size,
        };
        Technique { warp: spread.warp, cover: spread.cover, partition, filter, size }
    })
}

fn limits() -> impl Strategy<Value = Limits> {
    prop_oneof![
        6 => Just(Limits { max_side: 1 << 16, align: 1 }),
        1 => (2u32..9000).prop_map(|max_side| Limits { max_side, align: 1 }),
        1 => (0u32..5).prop_map(|bits| Limits { max_side: 8192, align: 1 << bits }),
    ]
}

fn case() -> impl Strategy<Value = Case> {
    let unit = || prop::array::uniform3(0.0..=1.0f64);
    odd_config().prop_flat_map(move |config| {
        let is_sun = matches!(config.light, umbrage::Light::Directional { .. });
        let of_boxes = config.clone();
        let boxes = prop_oneof![
            4 => Just(None),
            1 => boxes().prop_map(move |boxes| Some(parts(&of_boxes, &boxes))),
        ];
        let numbers = prop::collection::vec(unit(), 6);
        (Just(config), boxes, technique(is_sun), limits(), numbers).prop_map(
            |(config, parts, technique, limits, numbers)| Case {
                config,
                parts,
                technique,
                limits,
                numbers,
            },
        )
    })
}

/// What comes of a case that is planned without a fault.
enum Outcome {
    Sound,
    /// The size asked for is too small for the maps, or larger than the limits allow.
    TooSmall,
    /// The plan's numbers would not be finite, which an error tells.
    NotFinite,
}

impl Case {
    /// Points which the camera sees in the light and which are among the receivers.
    fn seen_points(&self) -> Vec<glam::DVec3> {
        let mut points = self.config.seen_points(&self.numbers);
        if let Some(parts) = &self.parts {
            let within = |p: &Aabb| {
                let (min, size) = (p.min, p.size());
                self.numbers.iter().map(move |&n| min + size * glam::DVec3::from(n))
            };
            points.clear();
            points.extend(parts.iter().filter(|p| !p.is_empty()).take(8).flat_map(within));
            points.retain(|&p| self.config.sees(p));
        }
        points
    }

    /// Plans the case and checks the plan.
    fn check(&self, planner: &mut Planner) -> Result<Outcome, Fault> {
        let Self { config, technique, .. } = self;
        let Config { camera, light, .. } = config;
        let tree = self.parts.as_ref().map(|parts| BoxTree::new(parts).expect("valid boxes"));
        let bounds = Bounds { receiver_parts: tree.as_ref(), ..config.bounds };
        let mut planned =
            |technique: &Technique| planner.plan(camera, &[*light], &bounds, technique).cloned();
        let plan = match planned(technique) {
            Ok(plan) => plan,
            Err(Error::Invalid { field: "technique.size", .. }) => return Ok(Outcome::TooSmall),
            Err(Error::NotFinite { .. }) => return Ok(Outcome::NotFinite),
            Err(error) => return Err(Fault { kind: "error", what: error.to_string() }),
        };
        let maps = map_count(&technique.partition, light);
        if plan.maps.len() != maps {
            let what = format!("{} for {maps}", plan.maps.len());
            return Err(Fault { kind: "number of maps", what });
        }
        check_numbers(&plan)?;
        check_served(config, &plan, &self.seen_points())?;
        // Fitted slices of different warps end at different distances.
        if technique.warp == Warp::Adaptive(Objective::Storage)
            && technique.partition.splits != Splits::Fitted
        {
            let uniform = Technique { warp: Warp::Uniform, ..*technique };
            if let Ok(uniform) = planned(&uniform) {
                let [adaptive, uniform] = [&plan, &uniform].map(Plan::storage_factor);
                if adaptive > uniform * common::ADAPTIVE_OVER_UNIFORM {
                    let what = format!("{adaptive} > {uniform}, by {}", adaptive / uniform);
                    return Err(Fault { kind: "adaptive needs more than uniform", what });
                }
            }
        }
        Ok(Outcome::Sound)
    }
}

/// Plans so many cases, and reports how often each fault was found.
fn plan_at_random(cases: usize) {
    let mut runner = TestRunner::new(ProptestConfig::default());
    let strategy = case();
    let mut planners: BTreeMap<[u32; 2], Planner> = BTreeMap::new();
    let mut faults: BTreeMap<&str, (usize, String)> = BTreeMap::new();
    let [mut sound, mut too_small, mut not_finite] = [0; 3];
    for _ in 0..cases {
        let case = strategy.new_tree(&mut runner).expect("a case").current();
        let Limits { max_side, align } = case.limits;
        let planner =
            planners.entry([max_side, align]).or_insert_with(|| Planner::with_limits(case.limits));
        match case.check(planner) {
            Ok(Outcome::Sound) => sound += 1,
            Ok(Outcome::TooSmall) => too_small += 1,
            Ok(Outcome::NotFinite) => not_finite += 1,
            Err(Fault { kind, what }) => {
                let first = || (0, format!("{what}\n    {case:?}"));
                faults.entry(kind).or_insert_with(first).0 += 1;
            }
        }
    }
    println!(
        "{cases} cases: {sound} sound plans, {too_small} refused for their size, {not_finite} \
         because numbers would not be finite"
    );
    for (kind, (count, first)) in &faults {
        println!("{count} × {kind}, first {first}");
    }
    // Such an error is right for hardly any case.
    assert!(not_finite <= cases / 10_000, "{not_finite} errors");
    assert!(faults.is_empty(), "{:?}", faults.keys());
}

#[test]
fn random_plans_are_sound() {
    plan_at_random(2000);
}

#[test]
#[ignore = "takes a quarter of an hour in release mode"]
fn a_million_random_plans_are_sound() {
    plan_at_random(1_000_000);
}
