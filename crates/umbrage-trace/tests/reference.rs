//! Plans executed by ray tracing, against closed forms and the truth.

mod common;

use common::{Random, at, camera, even_map, ground, nobody, scene, sheet, towards};
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use umbrage::visibility::{Filter, visibility};
use umbrage::{
    Bounds, Camera, CubeSide, Light, Plan, Planner, PointLight, Size, SpotLight, Technique,
};
use umbrage_scene::closed_form::pole_shadows;
use umbrage_scene::{Scene, builtin};
use umbrage_trace::{DepthMap, Error, Reference, Surface, Tracer, View};

/// Techniques: how texels are spread, and over what.
const SPREADS: [&str; 9] = [
    "unfocused",
    "uniform",
    "psm",
    "lispsm",
    "tsm",
    "adaptive",
    "adaptive(area)",
    "log",
    "lambda=2",
];

fn filters() -> [Filter; 5] {
    [0, 1, 2, 3, 8].map(|n| Filter::pcf(n).unwrap_or(Filter::Hard))
}

fn plan(camera: &Camera, light: &Light, tracer: &Tracer<'_>, spread: &str, texels: u64) -> Plan {
    sized(camera, light, tracer, spread, Size::Budget(texels))
}

fn sized(camera: &Camera, light: &Light, tracer: &Tracer<'_>, spread: &str, size: Size) -> Plan {
    let technique = Technique { size, ..spread.parse().unwrap() };
    let bounds = Bounds::of_scene(tracer.bounds());
    Planner::new().plan(camera, &[*light], &bounds, &technique).unwrap().clone()
}

fn lookup(plan: &Plan, depths: &DepthMap, filter: Filter, surface: &Surface) -> f32 {
    let receiver = plan.receiver(0, surface.position, surface.geometric_normal).unwrap();
    visibility(&plan.maps[0], filter, &receiver, |i, j| depths.texel(i, j))
}

/// The share of facing samples that are lit but should be dark, and the share of the opposite.
fn wrong(view: &View<'_>, plan: &Plan) -> [f64; 2] {
    let reference = Reference::render(view.tracer(), plan, &nobody).unwrap();
    let band = view.band(0..view.camera().image()[1], &nobody);
    let (mut counts, mut all) = ([0.0; 2], 0.0);
    for sample in band.samples().iter().flatten().filter(|s| s.is_facing) {
        let difference = reference.visibility(0, sample) - view.truth(sample);
        all += 1.0;
        counts[0] += f64::from(u8::from(difference > 0.5));
        counts[1] += f64::from(u8::from(difference < -0.5));
    }
    assert!(all > 1000.0, "only {all} samples face the light");
    counts.map(|n| n / all)
}

#[test]
fn depths_are_those_of_the_first_hit() {
    // Two sheets over ground. Light falls straight down, with depth 0 at y = 4 and depth 1 at y =
    // −4.
    let scene = scene(
        vec![
            ground(2.0),
            sheet(Vec3::new(0.0, 2.0, 0.0), Vec3::Z, Vec3::X),
            sheet(Vec3::new(0.0, 9.0, -1.0), Vec3::Z, Vec3::X),
        ],
        &[
            (0, DAffine3::IDENTITY),
            (1, DAffine3::IDENTITY),
            (2, DAffine3::IDENTITY),
            (0, at(0.0, -9.0, 0.0)),
        ],
    );
    let tracer = Tracer::new(&scene).unwrap();
    let map = even_map(DVec3::ZERO, -DVec3::Y, 3.0, 4.0, [60, 60]);
    let depths = DepthMap::render(&tracer, &map, 0, &nobody).unwrap();
    assert_eq!(depths.resolution(), [60, 60]);
    let at = |x: f64, z: f64| {
        let texel = map.project(DVec3::new(x, 0.0, z)).unwrap() * 60.0;
        depths.texel(texel.x as i32, texel.y as i32)
    };
    assert_eq!(at(-1.01, 0.55), 0.5, "ground");
    assert_eq!(at(0.55, 0.55), 0.25, "a sheet over it");
    assert_eq!(at(0.55, -0.55), 0.0, "a sheet beyond the near end is flattened onto it");
    assert_eq!(at(2.55, 0.55), 1.0, "nothing");
    // The ground lies below the far end of the depth range, so it is clamped to 1.
    let upper = even_map(DVec3::Y * 40.0, -DVec3::Y, 3.0, 4.0, [8, 8]);
    let depths = DepthMap::render(&tracer, &upper, 0, &nobody).unwrap();
    assert_eq!(depths.texel(4, 4), 1.0);
}

#[test]
fn the_gutter_continues_the_map() {
    let scene = builtin("pole", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let map = even_map(DVec3::new(0.1, 1.0, 0.2), DVec3::new(1.0, -1.0, 0.5), 2.0, 9.0, [16, 32]);
    // The gutter has the texels that surround the same map in the middle of a larger map.
    let mut larger = even_map(map.origin, DVec3::new(1.0, -1.0, 0.5), 4.0, 9.0, [32, 64]);
    larger.shadow_from_local.w_axis = map.shadow_from_local.w_axis;
    let larger = DepthMap::render(&tracer, &larger, 0, &nobody).unwrap();
    let depths = DepthMap::render(&tracer, &map, 5, &nobody).unwrap();
    for (i, j) in (-5..21).flat_map(|i| (-5..37).map(move |j| (i, j))) {
        let [a, b] = [depths.texel(i, j), larger.texel(i + 8, j + 16)];
        assert!((a - b).abs() < 1e-6, "({i}, {j}): {a}, not {b}");
    }
    assert_eq!(depths.texel(i32::MIN, 3), depths.texel(-5, 3));
    assert_eq!(depths.texel(2, i32::MAX), depths.texel(2, 36));
}

#[test]
fn empty_and_absurd_maps() {
    let scene = builtin("pole", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let mut map = even_map(DVec3::ZERO, -DVec3::Y, 3.0, 4.0, [0, 0]);
    let depths = DepthMap::render(&tracer, &map, 3, &nobody).unwrap();
    assert_eq!((depths.texel(0, 0), DepthMap::rows(&map, 3)), (1.0, 0));
    map.resolution = [u32::MAX; 2];
    let error = DepthMap::render(&tracer, &map, 0, &nobody).unwrap_err();
    assert_eq!(error, Error::Memory { resolution: [u32::MAX; 2] });
    // A camera that sees no receivers gets an empty plan, under which all is lit.
    let away = camera(DVec3::Y * 50.0, DVec3::Y * 51.0, [8, 8]);
    let light = Light::Directional { direction: -DVec3::Y };
    let plan = plan(&away, &light, &tracer, "uniform", 64);
    let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
    assert_eq!(reference.texel(0, DVec3::ZERO), None);
    // A scene without triangles gives depth 1 everywhere.
    let nothing = Scene::default();
    let tracer = Tracer::new(&nothing).unwrap();
    map.resolution = [4, 4];
    assert_eq!(DepthMap::render(&tracer, &map, 1, &nobody).unwrap().texel(0, 0), 1.0);
}

#[test]
fn planes_have_no_acne_at_any_angle() {
    // Tilted ground far from the origin, in light from 90° down to 1° above it, under every filter.
    let mut random = Random(77);
    for round in 0..12 {
        let tilt = DMat3::from_axis_angle(random.direction(), random.between(0.0, 3.0));
        let offset = if round % 2 == 0 { DVec3::ZERO } else { random.direction() * 1e5 };
        let place = DAffine3::from_mat3_translation(tilt, offset);
        let scene = scene(vec![ground(10.0)], &[(0, place)]);
        let tracer = Tracer::new(&scene).unwrap();
        for elevation_deg in [90.0, 45.0, 20.0, 5.0, 2.0, 1.0] {
            let (sin, cos) = f64::to_radians(elevation_deg).sin_cos();
            let travel = tilt * DVec3::new(cos * 0.6, -sin, cos * 0.8);
            let mut map = even_map(offset, travel, 4.0, 300.0, [40, 56]);
            if round % 3 == 0 {
                map.rows = umbrage::Rows::Logarithmic { ratio: 20.0 };
            }
            let depths = DepthMap::render(&tracer, &map, 8, &nobody).unwrap();
            let plan = Plan { maps: vec![map], ..Plan::default() };
            for _ in 0..300 {
                let at = random.in_square(3.0);
                let above = place.transform_point3(DVec3::new(at.x, 2.0, at.y));
                let surface = towards(&tracer, above, tilt * -DVec3::Y);
                for filter in filters() {
                    let lit = lookup(&plan, &depths, filter, &surface);
                    assert_eq!(lit, 1.0, "{filter} at {elevation_deg}°, {offset}");
                }
            }
        }
    }
}

#[test]
fn shadows_end_within_a_texel_of_where_they_should() {
    let scene = builtin("pole", None).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let travel = DVec3::new(1.0, -1.0, 0.5);
    let texel = 8.0 / 400.0;
    let map = even_map(DVec3::new(1.0, 0.5, 0.5), travel, 4.0, 12.0, [400, 400]);
    let depths = DepthMap::render(&tracer, &map, 8, &nobody).unwrap();
    let plan = Plan { maps: vec![map], ..Plan::default() };
    let mut random = Random(9);
    let mut counts = [0, 0];
    for _ in 0..30_000 {
        let at = random.in_square(1.5);
        let point = DVec3::new(at.x + 1.0, -1.0, at.y + 0.5);
        let surface = towards(&tracer, point, DVec3::Y);
        let expected = pole_shadows(surface.position, travel);
        // The largest width of a texel on the ground; light falls at 42°.
        let reach = |n: f64| 0.5 * n * texel * 2f64.sqrt() / 0.66;
        let is_clear = |margin: f64| {
            (0..16).all(|k| {
                let around = DVec2::from_angle(f64::from(k) * std::f64::consts::FRAC_PI_8) * margin;
                let near = surface.position + DVec3::new(around.x, 0.0, around.y);
                pole_shadows(near, travel) == expected
            })
        };
        for (filter, width) in [(Filter::Hard, 1.0), (Filter::Pcf { n: 2 }, 3.0)] {
            // At the pole's foot the slope of the ground allows some light to leak.
            let at_foot = surface.position.abs().max_element() < 0.1 + 2.0 * texel;
            if is_clear(reach(width)) && !at_foot {
                counts[usize::from(expected)] += 1;
                let lit = lookup(&plan, &depths, filter, &surface);
                assert_eq!(lit, f32::from(u8::from(!expected)), "{filter} at {}", surface.position);
            }
        }
    }
    assert!(counts.iter().all(|&n| n > 500), "{counts:?}");
}

#[test]
fn every_warp_approaches_the_truth() {
    let scene = builtin("sphere", Some(64)).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let look = camera(DVec3::new(-2.5, 3.4, 7.5), DVec3::new(0.8, 1.0, 0.0), [200, 150]);
    let camera = look.with_depth_range(0.5, 60.0).unwrap();
    let sun = Light::Directional { direction: DVec3::new(1.0, -1.25, 0.4) };
    let lamp = Light::Spot(SpotLight {
        position: DVec3::new(-3.0, 7.0, -1.0),
        direction: DVec3::new(3.2, -6.0, 1.1),
        half_angle_rad: 0.6,
        near: 0.1,
        range: 30.0,
    });
    for light in [sun, lamp] {
        let view = View::new(&tracer, camera, light, 1).unwrap();
        for spread in SPREADS {
            let at = |side: u64| {
                let plan = plan(&camera, &light, &tracer, spread, side * side);
                wrong(&view, &plan).iter().sum::<f64>()
            };
            let [coarse, fine] = [at(128), at(1024)];
            assert!(fine < 0.01, "{spread}: {fine} of the samples are wrong");
            assert!(
                fine < 0.4 * coarse,
                "{spread}: {coarse}, then {fine} with 64 times the texels"
            );
        }
    }
}

#[test]
fn all_sides_of_a_point_light_approach_the_truth() {
    let scene = builtin("lantern", Some(1)).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let light = scene.lights[0].light;
    let Light::Point(flame) = light else { panic!("{light:?}") };
    // The views lie at opposite corners, one looking up and one down past the lantern. Together
    // they see all surfaces that it lights.
    let views = [([-2.6, 0.3, 2.6], 3.5), ([2.6, 4.3, -2.6], 1.0)];
    let cameras = views.map(|(eye, height)| {
        let look = camera(DVec3::from(eye), DVec3::Y * height, [160, 120]);
        look.with_depth_range(0.2, 20.0).unwrap()
    });
    for spread in SPREADS {
        // For each side of the cube: the number of samples, of those wrong with few texels, and of
        // those wrong with many.
        let mut counts = [[0; 3]; 6];
        for camera in &cameras {
            let view = View::new(&tracer, *camera, light, 1).unwrap();
            let band = view.band(0..120, &nobody);
            let [coarse, fine] =
                [16, 256].map(|n| sized(camera, &light, &tracer, spread, Size::Exact([n, n])));
            let render = |plan| Reference::render(&tracer, plan, &nobody).unwrap();
            let references = [render(&coarse), render(&fine)];
            for sample in band.samples().iter().flatten().filter(|s| s.is_facing) {
                let from_light = sample.surface.position - flame.position;
                let along = |side: &CubeSide| side.direction().dot(from_light);
                let side = (0..6)
                    .max_by(|&a, &b| along(&CubeSide::ALL[a]).total_cmp(&along(&CubeSide::ALL[b])));
                let counts = &mut counts[side.unwrap()];
                counts[0] += 1;
                let truth = view.truth(sample);
                for (k, reference) in references.iter().enumerate() {
                    let difference = (reference.visibility(0, sample) - truth).abs();
                    counts[k + 1] += usize::from(difference > 0.5);
                }
            }
        }
        for (side, [all, coarse, fine]) in CubeSide::ALL.iter().zip(counts) {
            let what = format!("{spread} {side:?}: {coarse}, then {fine} of {all} are wrong");
            assert!(all > 3000 && coarse > all / 10, "{what}");
            assert!(fine < all / 10 && 5 * fine < 2 * coarse, "{what}");
        }
    }
}

#[test]
fn flat_ground_is_lit_under_every_plan() {
    // Nothing casts, so nothing may be dark, whatever the camera, light and warp.
    let mut random = Random(31);
    let scene = scene(vec![ground(50.0)], &[(0, at(0.0, 0.0, 0.0))]);
    let tracer = Tracer::new(&scene).unwrap();
    for round in 0..60 {
        let eye = DVec3::new(random.between(-20.0, 20.0), random.between(0.3, 9.0), 20.0);
        let target = DVec3::new(random.between(-20.0, 20.0), 0.0, random.between(-20.0, 20.0));
        let look = camera(eye, target, [24, 18]).with_depth_range(0.1, 80.0).unwrap();
        let elevation = random.between(1f64.to_radians(), 1.57);
        let azimuth = random.between(0.0, std::f64::consts::TAU);
        let (sin, cos) = elevation.sin_cos();
        let direction = DVec3::new(cos * azimuth.cos(), -sin, cos * azimuth.sin());
        let light = Light::Directional { direction };
        let view = View::new(&tracer, look, light, 1).unwrap();
        let band = view.band(0..18, &nobody);
        let spread = SPREADS[round % SPREADS.len()];
        let plan = plan(&look, &light, &tracer, spread, 64 * 64);
        for filter in filters() {
            // Each filter draws the gutter that it needs.
            let plan = Plan { filter, ..plan.clone() };
            let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
            for sample in band.samples().iter().flatten().filter(|s| s.depth < 79.9) {
                let lit = reference.visibility(0, sample);
                let place = reference.texel(0, sample.surface.position);
                assert!(place.is_some(), "{spread} holds {}", sample.surface.position);
                assert_eq!(lit, 1.0, "{spread} {filter}: {light:?} {sample:?}");
            }
        }
    }
}

#[test]
fn a_plane_is_lit_all_around_a_point_light() {
    // Nothing casts, so nothing may be dark, in particular not where sides of the cube meet.
    let mut random = Random(33);
    let mut sides = [0; 6];
    for round in 0..60 {
        let normal = random.direction();
        let turn = DQuat::from_rotation_arc(DVec3::Y, normal);
        let plane = (0, DAffine3::from_quat(turn));
        let scene = scene(vec![ground(50.0)], &[plane]);
        let tracer = Tracer::new(&scene).unwrap();
        let mut above = |half: f64, low: f64, high: f64| {
            let at = random.in_square(half);
            turn * DVec3::new(at.x, random.between(low, high), at.y)
        };
        let (position, eye, target) =
            (above(3.0, 0.1, 4.0), above(8.0, 0.5, 6.0), above(8.0, -1.0, 0.2));
        let look = camera(eye, target, [24, 18]).with_depth_range(0.1, 40.0).unwrap();
        let light = Light::Point(PointLight { position, near: 0.01, range: 60.0 });
        let view = View::new(&tracer, look, light, 1).unwrap();
        let band = view.band(0..18, &nobody);
        let spread = SPREADS[round % SPREADS.len()];
        let plan = sized(&look, &light, &tracer, spread, Size::Exact([24, 24]));
        for filter in filters() {
            // Each filter draws the gutter that it needs.
            let plan = Plan { filter, ..plan.clone() };
            let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
            let facing = band.samples().iter().flatten().filter(|s| s.is_facing && s.depth < 39.9);
            for sample in facing {
                assert_eq!(view.truth(sample), 1.0, "{light:?} {sample:?}");
                let place = reference.texel(0, sample.surface.position);
                let Some(place) = place else { panic!("{spread}: no map for {sample:?}") };
                let side = plan.maps[place.map].part.side;
                sides[CubeSide::ALL.iter().position(|s| Some(*s) == side).unwrap()] += 1;
                let lit = reference.visibility(0, sample);
                assert_eq!(lit, 1.0, "{spread} {filter}: {light:?} {sample:?}");
            }
        }
    }
    assert!(sides.iter().all(|&n| n > 500), "{sides:?}");
}

#[test]
fn a_scene_far_from_the_origin_loses_nothing() {
    let near = builtin("pole", None).unwrap();
    let offset = DVec3::new(1e5, 0.0, -2e5);
    let mut far = near.clone();
    for instance in &mut far.instances {
        instance.world_from_mesh.translation += offset;
    }
    let light = Light::Directional { direction: DVec3::new(1.0, -1.0, 0.5) };
    let wrong_at = |scene: &Scene, offset: DVec3| {
        let tracer = Tracer::new(scene).unwrap();
        let eye = DVec3::new(-3.0, 3.2, 8.5) + offset;
        let look = camera(eye, DVec3::new(1.3, 0.9, 0.0) + offset, [120, 90]);
        let camera = look.with_depth_range(0.5, 60.0).unwrap();
        let view = View::new(&tracer, camera, light, 1).unwrap();
        let plan = plan(&camera, &light, &tracer, "adaptive:pcf2", 256 * 256);
        wrong(&view, &plan)
    };
    let [a, b] = [wrong_at(&near, DVec3::ZERO), wrong_at(&far, offset)];
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() < 2e-4, "{a}, {b} far off");
    }
}

#[test]
fn maps_are_the_same_on_any_number_of_threads() {
    let scene = builtin("sphere", Some(32)).unwrap();
    let tracer = Tracer::new(&scene).unwrap();
    let map = even_map(DVec3::Y, DVec3::new(1.0, -1.0, 0.5), 3.0, 9.0, [70, 50]);
    let render = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let rows = std::sync::atomic::AtomicU64::new(0);
            let count = |n| {
                rows.fetch_add(n, std::sync::atomic::Ordering::Relaxed);
            };
            let depths = DepthMap::render(&tracer, &map, 2, &count).unwrap();
            assert_eq!(rows.into_inner(), DepthMap::rows(&map, 2));
            depths
        })
    };
    assert_eq!(render(1), render(3));
}
