//! Culling of casters against brute force: everything that a ray from a receiver to the light hits.

mod common;

use common::{
    Config, STABLE, WARPS, config, direction, map_count, partition, planner, possible, technique,
};
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use std::cell::Cell;
use umbrage::visibility::{Filter, LightSize, Pattern, Width};
use umbrage::{
    Aabb, Bounds, Camera, Light, LookAt, Objective, Partition, SpotLight, Technique, Warp,
};

/// The end of the ray from `p` to the light, as a multiple of the given vector; infinite for
/// parallel light.
fn way_to_light(light: &Light, p: DVec3) -> (DVec3, f64) {
    match light {
        Light::Directional { direction } => (-*direction, f64::INFINITY),
        Light::Spot(spot) => (spot.position - p, 1.0),
        Light::Point(point) => (point.position - p, 1.0),
    }
}

/// Whether the ray from `p` along `way` hits the box before `end` (slabs).
fn hits_box(aabb: Aabb, p: DVec3, way: DVec3, end: f64) -> bool {
    let (mut enter, mut leave) = (0.0f64, end);
    for axis in 0..3 {
        let [lo, hi] = [aabb.min[axis], aabb.max[axis]].map(|side| (side - p[axis]) / way[axis]);
        if way[axis] == 0.0 {
            if p[axis] < aabb.min[axis] || p[axis] > aabb.max[axis] {
                return false;
            }
        } else {
            enter = enter.max(lo.min(hi));
            leave = leave.min(lo.max(hi));
        }
    }
    enter < leave
}

/// Whether the ray from `p` along `way` hits the triangle before `end` (Möller and Trumbore 1997).
fn hits_triangle([a, b, c]: [DVec3; 3], p: DVec3, way: DVec3, end: f64) -> bool {
    let (ab, ac) = (b - a, c - a);
    let det = ab.dot(way.cross(ac));
    let to_p = p - a;
    let u = to_p.dot(way.cross(ac)) / det;
    let v = way.dot(to_p.cross(ab)) / det;
    let t = ac.dot(to_p.cross(ab)) / det;
    u > 0.0 && v > 0.0 && u + v < 1.0 && t > 0.0 && t < end
}

/// Objects in the scene: a position and three vectors of a certain length each.
fn things() -> impl Strategy<Value = Vec<([f64; 3], [DVec3; 3], f64, bool)>> {
    let place = [-1.0..2.0f64, -1.0..2.0, -1.0..2.0];
    let size = (-7.0..1.0f64).prop_map(f64::exp);
    let shape = [direction(), direction(), direction()];
    proptest::collection::vec((place, shape, size, any::<bool>()), 24)
}

/// Centre and size of a box around what is seen.
fn seen(config: &Config) -> (DVec3, f64) {
    let around = Aabb::around(config.corners());
    (config.camera.eye() + around.center(), around.size().length())
}

#[test]
fn whatever_is_hit_may_cast() {
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: 3_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let numbers = proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0, 0.0..=1.0], 8);
    let input = (config(), partition(), numbers, things(), 0..WARPS.len());
    let [hits, asked, culled] = [const { Cell::new(0u64) }; 3];
    let count = |cell: &Cell<u64>, n: u64| cell.set(cell.get() + n);
    runner
        .run(&input, |(config, partition, numbers, things, pick)| {
            let (name, spread) = WARPS[pick];
            let partition = possible(partition, spread);
            let technique = Technique { partition, ..technique(spread) };
            // Millions of boxes suffice.
            prop_assume!(
                map_count(&partition, &config.light) <= 100 && config.corners().len() >= 4
            );
            let mut planner = planner();
            let plan =
                planner.plan(&config.camera, &[config.light], &config.bounds, &technique).unwrap();
            let receivers = config.seen_points(&numbers);
            let (middle, size) = seen(&config);
            for (i, (place, shape, scale, is_triangle)) in things.into_iter().enumerate() {
                // Half of the objects stand between some receiver and the light, shifted sideways
                // by about their own size; the other half are anywhere.
                let scale = scale * size;
                let anywhere = middle + (DVec3::from(place) - 0.5) * size;
                let center = match receivers.get(i) {
                    Some(&p) => {
                        let (way, end) = way_to_light(&config.light, p);
                        let reach = if end.is_finite() { way.length() } else { 2.0 * size };
                        let k = (place[0] + 1.0) / 3.0;
                        p + way.normalize() * (reach * k) + shape[0] * (scale * place[1])
                    }
                    None => anywhere,
                };
                let corners = shape.map(|d| center + d * scale);
                let aabb = Aabb::around(corners);
                for map in plan.maps.iter().filter(|m| !m.is_empty()) {
                    count(&asked, 1);
                    count(&culled, u64::from(!map.may_cast(aabb)));
                }
                for &p in &receivers {
                    let (way, end) = way_to_light(&config.light, p);
                    let hit = if is_triangle {
                        hits_triangle(corners, p, way, end)
                    } else {
                        hits_box(aabb, p, way, end)
                    };
                    for (index, _) in plan.lookup(0, p).filter(|_| hit) {
                        count(&hits, 1);
                        prop_assert!(
                            plan.maps[index].may_cast(aabb),
                            "{name} {partition:?}: {aabb:?} hides the light from {p}"
                        );
                    }
                }
            }
            Ok(())
        })
        .unwrap();
    let (hits, asked, culled) = (hits.get(), asked.get(), culled.get());
    let share = culled as f64 / asked as f64;
    println!("{hits} hits; {share:.3} of {asked} pairs of a thing and a map are culled");
    assert!(hits > 10_000 && share > 0.5, "{hits} hits, {share} culled");
}

fn camera(far: f64) -> Camera {
    Camera::look_at(LookAt {
        eye: DVec3::new(0.0, 2.0, 0.0),
        target: DVec3::new(0.0, 0.0, -20.0),
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.5,
        far,
        image: [640, 360],
    })
    .unwrap()
}

/// Maps that keep their casters' depths tell them apart; other maps clamp those before the
/// receivers.
#[test]
fn casters_keep_their_depths_if_asked() {
    let camera = camera(100.0);
    let bounds = Bounds {
        receivers: Some(Aabb::new(DVec3::new(-50.0, 0.0, -60.0), DVec3::new(50.0, 1.0, 10.0))),
        casters: Some(Aabb::new(DVec3::new(-80.0, 0.0, -90.0), DVec3::new(80.0, 40.0, 40.0))),
        ..Bounds::default()
    };
    let spot = |height: f64| {
        Light::Spot(SpotLight {
            position: DVec3::new(3.0, height, -10.0),
            direction: DVec3::new(0.0, -1.0, -0.1),
            half_angle_rad: 0.6,
            near: 0.1,
            range: 200.0,
        })
    };
    // The second lamp hangs amid the casters, and those next to it are clamped.
    let sun = Light::Directional { direction: DVec3::new(0.5, -1.0, 0.2) };
    for spread in [Warp::Uniform.into(), Warp::Lispsm.into(), Warp::Psm.into(), STABLE] {
        for (index, light) in [sun, spot(60.0), spot(30.0)].into_iter().enumerate() {
            let is_sun = matches!(light, Light::Directional { .. });
            let size = if is_sun { LightSize::Degrees(0.5) } else { LightSize::Metres(0.2) };
            let mut planner = planner();
            let mut nearest = |filter| {
                let partition = Partition::slices(2);
                let technique = Technique { filter, partition, ..technique(spread) };
                let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap().clone();
                let again = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
                assert!(plan == *again, "{spread:?} {index}: a frame depends on the one before");
                let mut nearest = f64::INFINITY;
                for map in plan.maps.iter().filter(|m| !m.is_empty()) {
                    for i in 0..9000 {
                        let part = |i: u32, n: u32| f64::from(i % n) / f64::from(n - 1);
                        let at = DVec3::new(part(i, 30), part(i / 30, 10), part(i / 300, 30));
                        let p = DVec3::new(-80.0, 0.0, -90.0) + at * DVec3::new(160.0, 40.0, 130.0);
                        let local = p - map.origin;
                        let may_cast = map.caster_planes.iter().all(|c| c.distance(local) > 0.0);
                        let is_near = map.apex.is_some_and(|apex| apex.distance(local) < 8.0);
                        if may_cast
                            && !is_near
                            && let Some(shadow) = map.project(p)
                        {
                            nearest = nearest.min(shadow.z);
                        }
                    }
                }
                nearest
            };
            let [kept, flat] = [Filter::Pcss { n: 4, light: size }, Filter::Hard].map(&mut nearest);
            // The depths of a stable map under a lamp include everything that the lamp reaches.
            let flattens = spread != STABLE || index == 0;
            assert!(
                kept >= -1e-9 && (flat < -0.4 || !flattens),
                "{spread:?} {index}: {kept} {flat}"
            );
        }
    }
}

/// What casts only into the gutter that a plan's filter reads counts as a caster.
#[test]
fn casters_beside_a_map_count_as_far_as_filters_reach() {
    let camera = camera(60.0);
    let light = Light::Directional { direction: DVec3::new(0.2, -1.0, 0.1) };
    let floor = Aabb::new(DVec3::new(-10.0, 0.0, -40.0), DVec3::new(10.0, 0.1, 10.0));
    let bounds = Bounds { receivers: Some(floor), ..Bounds::default() };
    for warp in [Warp::Uniform, Warp::Lispsm, Warp::Adaptive(Objective::Storage)] {
        let mut planner = planner();
        let mut misses = |filter| {
            let technique = Technique { warp, filter, ..Technique::default() };
            let plan = planner.plan(&camera, &[light], &bounds, &technique).unwrap();
            let map = &plan.maps[0];
            let texel = DVec2::from(map.resolution.map(f64::from)).recip();
            let (mut served, mut missed) = (0, 0);
            for i in 0..40_000 {
                let at = [i % 200, i / 200].map(|k| f64::from(k) / 199.0);
                let point = floor.min + DVec3::new(at[0], 0.5, at[1]) * (floor.max - floor.min);
                let is_ahead = (0.5..60.0).contains(&camera.depth(point));
                let Some(pixel) = camera.pixel(point).filter(|_| is_ahead) else { continue };
                if pixel.min_element() < 0.0 || pixel.x > 640.0 || pixel.y > 360.0 {
                    continue;
                }
                let st = map.project(point).unwrap().truncate();
                served += 1;
                // A caster above a point ten texels to the side.
                for aside in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
                    let beam = map.beam(st + aside * 10.0 * texel).unwrap();
                    let high = beam.origin - beam.direction * 5.0;
                    missed += u32::from(!map.may_cast(Aabb::new(high - 1e-3, high + 1e-3)));
                }
            }
            assert!(served > 1000, "{warp:?}: {served}");
            missed
        };
        let wide = Filter::Spread { n: 3, width: Width::Metres(1.0), pattern: Pattern::Grid };
        let [told, untold] = [wide, Filter::Hard].map(&mut misses);
        assert!(told == 0 && untold > 0, "{warp:?}: {told} {untold}");
    }
}
