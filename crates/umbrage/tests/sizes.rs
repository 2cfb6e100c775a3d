//! Distribution of texels: budgets by error, sizes by error, and the limits of devices.

mod common;

use common::{
    Config, STABLE, Spread, WARPS, camera, config, detail, direction, partition, planner, possible,
    reach, technique,
};
use glam::DVec3;
use proptest::prelude::*;
use umbrage::visibility::Filter;
use umbrage::{
    Atlas, Bounds, Camera, Error, Faces, Light, Limits, LookAt, Objective, Partition, Plan,
    Planner, PointLight, ShadowMap, Size, Splits, Technique, Warp,
};

/// Warps under which the largest errors are known exactly.
const EXACT: [Warp; 4] =
    [Warp::Uniform, Warp::Lispsm, Warp::Adaptive(Objective::Storage), Warp::Log];

fn suns() -> impl Strategy<Value = (Config, Vec<Light>)> {
    let sunny =
        config().prop_filter("parallel light", |c| matches!(c.light, Light::Directional { .. }));
    (sunny, proptest::collection::vec(direction(), 0..3)).prop_map(|(config, more)| {
        let more = more.into_iter().map(|direction| Light::Directional { direction });
        let lights = std::iter::once(config.light).chain(more).collect();
        (config, lights)
    })
}

fn plan(config: &Config, lights: &[Light], technique: &Technique) -> Plan {
    plan_within(Limits { max_side: 1 << 16, ..Limits::default() }, config, lights, technique)
}

fn plan_within(limits: Limits, config: &Config, lights: &[Light], technique: &Technique) -> Plan {
    Planner::with_limits(limits)
        .plan(&config.camera, lights, &config.bounds, technique)
        .unwrap()
        .clone()
}

fn maps(plan: &Plan) -> impl Iterator<Item = &ShadowMap> {
    plan.maps.iter().filter(|m| !m.is_empty())
}

/// The least and the largest error in s and t, over all sides that are neither clamped nor too
/// short to be divided finely.
fn spread(plan: &Plan, max_side: u32, least: u32) -> (f64, f64) {
    let of_map = |m: &ShadowMap| {
        let [s, t] = m.resolution;
        [(s, m.error.max_s), (t, m.error.max_t)]
    };
    maps(plan)
        // If one side is clamped, the other one depends on it.
        .filter(|m| m.resolution.iter().all(|n| (least..max_side).contains(n)))
        .flat_map(of_map)
        .fold((f64::INFINITY, 0f64), |(lo, hi), (_, e)| (lo.min(e), hi.max(e)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    /// Without shadows there are no maps, whatever else a technique asks for, and everything else
    /// of the plan is as it would be with maps.
    #[test]
    fn no_shadows_need_no_texels(
        (config, lights) in suns(),
        partition in partition(),
        pick in 0..WARPS.len(),
        size in prop_oneof![Just(Size::Budget(1)), Just(Size::Exact([64, 32])), Just(Size::MaxError(1.0))],
    ) {
        let (_, spread) = WARPS[pick];
        let shadowed = Technique { partition: possible(partition, spread), ..technique(spread) };
        let with_maps = plan(&config, &lights, &shadowed);
        let without = plan(&config, &lights, &Technique { size, filter: Filter::None, ..shadowed });
        prop_assert_eq!((without.maps.len(), without.texels()), (0, 0));
        prop_assert_eq!(without.storage_factor().to_string(), "0");
        prop_assert_eq!(without.origin, with_maps.origin);
        prop_assert_eq!(without.lights.len(), lights.len());
        for (a, b) in without.lights.iter().zip(&with_maps.lights) {
            prop_assert_eq!((a.maps.clone(), a.theta_rad), (0..0, b.theta_rad));
        }
        prop_assert_eq!(without.lookup(0, config.camera.eye()).count(), 0);
        for lay_out in [Atlas::packed, Atlas::layered] {
            prop_assert!(lay_out(&without, 8192).unwrap().places.is_empty());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// All maps of all lights have the same largest error in s and in t, and the budget is used up
    /// to rounding if it is large.
    #[test]
    fn a_budget_makes_all_errors_alike(
        (config, lights) in suns(),
        partition in partition(),
        pick in 0..EXACT.len(),
        budget in 22..=28u32,
    ) {
        let budget = 1u64 << budget;
        let technique = Technique { size: Size::Budget(budget), partition, ..technique(EXACT[pick]) };
        let plan = plan(&config, &lights, &technique);
        let (lo, hi) = spread(&plan, 1 << 16, 100);
        // Rounding changes a side of a hundred texels by one, and with it the other side.
        prop_assert!(hi <= lo * 1.021 || hi == 0.0, "{lo} to {hi}");
        prop_assert!(plan.texels() <= budget);
        let all_long = maps(&plan).all(|m| m.resolution.iter().all(|n| (100..1 << 16).contains(n)));
        prop_assert!(!all_long || plan.texels() as f64 >= 0.98 * budget as f64, "{}", plan.texels());
    }

    /// Texels saved on clamped sides go to the other side and to other maps; all sides are aligned.
    #[test]
    fn devices_limits_are_kept(
        (config, lights) in suns(),
        partition in partition(),
        pick in 0..EXACT.len(),
        max_side in 256..2048u32,
        align in prop_oneof![Just(1u32), Just(4), Just(7)],
        budget in 18..=24u32,
    ) {
        let budget = 1u64 << budget;
        let size = Size::Budget(budget);
        let technique = Technique { size, partition, ..technique(EXACT[pick]) };
        let plan = plan_within(Limits { max_side, align }, &config, &lights, &technique);
        prop_assert!(plan.texels() <= budget);
        let longest = max_side / align * align;
        for map in maps(&plan) {
            prop_assert!(map.resolution.iter().all(|&n| n <= longest && n % align == 0 && n > 0));
        }
        let (lo, hi) = spread(&plan, longest, 100);
        let step = 1.021 + 0.02 * f64::from(align - 1);
        prop_assert!(hi <= lo * step || hi == 0.0, "{lo} to {hi}");
        let all = maps(&plan).count() as u64 * u64::from(longest).pow(2);
        // Rounding shortens short sides by a large share.
        let all_long = maps(&plan).all(|m| m.resolution.iter().all(|&n| n >= 20 * align));
        let wanted = 0.9 * budget.min(all) as f64;
        prop_assert!(!all_long || plan.texels() as f64 >= wanted, "{} of {wanted}", plan.texels());
    }

    /// A size by error keeps to the error, and a fifth fewer texels do not, however they are
    /// distributed.
    #[test]
    fn sizes_by_error_are_the_least(
        config in config(),
        partition in partition(),
        pick in 0..WARPS.len(),
        budget in 18..=22u32,
    ) {
        let spread = WARPS[pick].1;
        let partition = possible(partition, spread);
        let largest = |plan: &Plan| maps(plan).map(|m| m.error.max).fold(0.0, f64::max);
        let with = |size| {
            let technique = Technique { partition, size, ..technique(spread) };
            planner().plan(&config.camera, &[config.light], &config.bounds, &technique).cloned()
        };
        let Ok(by_budget) = with(Size::Budget(1 << budget)) else { return Ok(()) };
        let wanted = largest(&by_budget) * 1.0001;
        prop_assume!(wanted > 0.0);
        match with(Size::MaxError(wanted)) {
            Ok(by_error) => {
                prop_assert!(largest(&by_error) <= wanted * (1.0 + 1e-9));
                let is_fine = maps(&by_error).all(|m| m.resolution.iter().all(|&n| n >= 40));
                // Stable maps are sized for the largest error that any view can have.
                if is_fine && spread != STABLE {
                    let fewer = with(Size::Budget((by_error.texels() as f64 * 0.8) as u64)).unwrap();
                    prop_assert!(largest(&fewer) > wanted, "{} of {wanted}", largest(&fewer));
                }
            }
            Err(error) => {
                // A side was clamped.
                let is_cut = |m: &ShadowMap| m.resolution.iter().any(|&n| n > 20_000);
                prop_assert!(spread == STABLE || maps(&by_budget).any(is_cut), "{error}");
            }
        }
    }

    /// Plans depend on their input alone, to the last bit, and not on earlier plans or errors.
    #[test]
    fn planners_have_no_memory(
        (first, second) in (config(), config()),
        (one, other) in (partition(), partition()),
        (pick, other_pick) in (0..WARPS.len(), 0..WARPS.len()),
    ) {
        let technique = |partition, pick: usize| {
            let spread = WARPS[pick].1;
            Technique { partition: possible(partition, spread), ..common::technique(spread) }
        };
        let (a, b) = (technique(one, pick), technique(other, other_pick));
        let fresh = plan(&first, &[first.light], &a);
        let mut planner = planner();
        let lights = [second.light, first.light];
        planner.plan(&second.camera, &lights, &second.bounds, &b).unwrap();
        let too_small = Technique { size: Size::MaxError(1e-12), ..b };
        let _ = planner.plan(&second.camera, &lights, &second.bounds, &too_small);
        let broken = [second.light, Light::Directional { direction: DVec3::ZERO }];
        planner.plan(&second.camera, &broken, &second.bounds, &b).unwrap_err();
        let again = planner.plan(&first.camera, &[first.light], &first.bounds, &a).unwrap();
        // The comparison of texts distinguishes −0 from 0.
        prop_assert_eq!(format!("{again:?}"), format!("{fresh:?}"));
    }

    /// Where some lights alone have changed, a planner keeps the maps of the others. The plan is
    /// that of a new planner, to the last bit.
    #[test]
    fn kept_maps_are_those_of_a_new_plan(
        config in config(),
        lights in proptest::collection::vec((0..3u8, direction()), 2..5),
        others in proptest::collection::vec((0..5usize, 0..3u8, direction()), 1..6),
        (boxes, fails) in (proptest::bool::ANY, proptest::bool::ANY),
        partition in partition(),
        pick in 0..WARPS.len(),
        size in prop_oneof![Just(Size::Budget(1 << 22)), Just(Size::Exact([300, 200]))],
    ) {
        let spread = WARPS[pick].1;
        let technique =
            Technique { partition: possible(partition, spread), size, ..common::technique(spread) };
        let all = config.bounds.receivers.filter(|_| boxes);
        let tree = umbrage::BoxTree::new(all.as_slice()).unwrap();
        let bounds = Bounds { receiver_parts: all.map(|_| &tree), ..config.bounds };
        let light = |kind: u8, direction: DVec3| match kind {
            0 => Light::Directional { direction },
            1 => {
                let (near, range) = (detail(&config.camera), 2.0 * reach(&config.camera));
                let position = config.camera.eye() + direction * 0.3 * range;
                Light::Point(PointLight { position, near, range })
            }
            _ => config.light,
        };
        let mut lights: Vec<Light> = lights.into_iter().map(|(kind, d)| light(kind, d)).collect();
        let mut keeping = planner();
        // A plan for a sky without receivers, which fails at its last light.
        let sky = umbrage::SeenTiles::new(&config.camera);
        let sky = umbrage::Seen { tiles: &sky, moving: &[], clearance: 0.0 };
        let sky = Bounds { seen: Some(sky), ..bounds };
        let broken = Light::Directional { direction: DVec3::ZERO };
        for (index, kind, direction) in others {
            let light = light(kind, direction);
            let [kept, fresh] = [&mut keeping, &mut planner()].map(|planner| {
                format!("{:?}", planner.plan(&config.camera, &lights, &bounds, &technique))
            });
            prop_assert_eq!(kept, fresh);
            if fails {
                let failing = [&lights[..], &[broken]].concat();
                keeping.plan(&config.camera, &failing, &sky, &technique).unwrap_err();
            }
            // Some lights go, some come, some turn into others.
            if index < lights.len() {
                lights[index] = light;
            } else if lights.len() > 2 {
                lights.remove(0);
            } else {
                lights.push(light);
            }
        }
    }

    /// Maps of several lights equal those planned for each light alone, but for their resolution.
    #[test]
    fn lights_do_not_mix(
        camera in camera(),
        directions in proptest::collection::vec(direction(), 2..4),
        partition in partition(),
    ) {
        let lights: Vec<Light> =
            directions.into_iter().map(|direction| Light::Directional { direction }).collect();
        let size = Size::Exact([64, 32]);
        let technique = Technique { partition, size, ..technique(Warp::Lispsm) };
        let config = Config { camera, light: lights[0], bounds: Bounds::default() };
        let together = plan(&config, &lights, &technique);
        for (i, (&light, planned)) in lights.iter().zip(&together.lights).enumerate() {
            let mut alone = plan(&config, &[light], &technique);
            alone.maps.iter_mut().for_each(|m| m.part.light = i);
            prop_assert_eq!(&together.maps[planned.maps.clone()], &alone.maps[..]);
            prop_assert_eq!(planned.theta_rad, alone.lights[0].theta_rad);
        }
    }
}

fn view() -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::new(0.0, 2.0, 5.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 100.0,
        image: [640, 480],
    })
    .unwrap()
}

const SUN: Light = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.2) };

/// Sizes that cannot be had give an error of the size, and sizes that just can be had are planned.
#[test]
fn sizes_that_cannot_be_had() {
    let lamp = Light::Point(PointLight { position: DVec3::ZERO, near: 0.1, range: 50.0 });
    let slices = |k| Partition::slices(k);
    let faces = Partition { faces: Faces::SidesAndNear, ..slices(3) };
    let cases: [(&[Light], Partition, Spread, Size, bool); 14] = [
        (&[SUN], slices(4), Warp::Uniform.into(), Size::Budget(3), false),
        (&[SUN], slices(4), Warp::Uniform.into(), Size::Budget(4), true),
        (&[SUN, SUN], slices(4), Warp::Uniform.into(), Size::Budget(7), false),
        (&[SUN, SUN], slices(4), Warp::Uniform.into(), Size::Budget(8), true),
        (&[SUN], faces, Warp::Lispsm.into(), Size::Budget(12), false),
        (&[SUN], faces, Warp::Lispsm.into(), Size::Budget(13), true),
        (&[lamp], slices(2), Warp::Lispsm.into(), Size::Budget(11), false),
        (&[lamp], slices(2), Warp::Lispsm.into(), Size::Budget(12), true),
        (&[SUN], slices(4), STABLE, Size::Budget(15), false),
        (&[SUN], slices(4), STABLE, Size::Budget(16), true),
        (&[SUN], slices(1), Warp::Uniform.into(), Size::MaxError(1e-9), false),
        (&[SUN], slices(16), Warp::Uniform.into(), Size::MaxError(1e-9), false),
        (&[lamp], slices(1), Warp::Lispsm.into(), Size::MaxError(1e-9), false),
        (&[SUN], slices(4), Warp::Lispsm.into(), Size::MaxError(1e9), true),
    ];
    let mut planner = planner();
    for (lights, partition, spread, size, can_be) in cases {
        let technique = Technique { partition, size, ..common::technique(spread) };
        let what = format!("{partition:?} {spread:?} {size:?}");
        match planner.plan(&view(), lights, &Bounds::default(), &technique) {
            Ok(plan) => {
                assert!(can_be, "{what}");
                let texels = plan.texels();
                assert!(
                    !matches!(size, Size::Budget(budget) if texels > budget),
                    "{what}: {texels}"
                );
            }
            Err(Error::Invalid { field, problem }) => {
                assert!(
                    !can_be && field == "technique.size" && !problem.is_empty(),
                    "{what}: {field}"
                );
            }
            Err(error) => panic!("{what}: {error}"),
        }
    }
}

/// Fitted slices change the number of texels that an error needs by little, because each map gets
/// an equal share.
#[test]
fn fitted_slices_share_evenly() {
    let partition = Partition { splits: Splits::Fitted, ..Partition::slices(4) };
    let technique = Technique { partition, ..Technique::default() };
    let mut planner = planner();
    let plan = planner.plan(&view(), &[SUN], &Bounds::default(), &technique).unwrap();
    for map in &plan.maps {
        let share = map.texels() as f64 / plan.texels() as f64;
        assert!((share - 0.25).abs() < 0.01, "{share}");
    }
}
