//! Invalid input gives an error that names the field; unusual input gives a correct plan.

mod common;

use common::{STABLE, WARPS, map_count, planner, possible, technique};
use glam::{DMat4, DVec2, DVec3, DVec4};
use umbrage::visibility::{Filter, LightSize};
use umbrage::{
    Aabb, Bounds, BoxTree, Camera, ClipDepth, Cover, Error, Faces, Light, Limits, LookAt,
    Orthographic, Partition, Plan, Planner, PointLight, Seen, SeenTiles, Size, Splits, SpotLight,
    Technique, Warp,
};

const VIEW: LookAt = LookAt {
    eye: DVec3::new(1.0, 2.0, 3.0),
    target: DVec3::new(4.0, 1.0, -3.0),
    up: DVec3::Y,
    fov_y_rad: 1.0,
    near: 0.1,
    far: 100.0,
    image: [640, 480],
};
const SUN: Light = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.2) };
const SPOT: SpotLight = SpotLight {
    position: DVec3::new(0.0, 10.0, 0.0),
    direction: DVec3::new(0.4, -1.0, -0.5),
    half_angle_rad: 0.5,
    near: 0.1,
    range: 50.0,
};
const LAMP: PointLight = PointLight { position: DVec3::new(2.0, 4.0, 1.0), near: 0.1, range: 50.0 };

fn field<T: std::fmt::Debug>(result: Result<T, Error>) -> &'static str {
    match result {
        Err(Error::Invalid { field, problem }) => {
            assert!(problem.len() > 10, "a problem worth reading: {problem}");
            field
        }
        other => panic!("expected an error, got {other:?}"),
    }
}

#[test]
fn cameras_name_what_is_wrong() {
    let nan = f64::NAN;
    let cases: [(LookAt, &str); 17] = [
        (LookAt { eye: DVec3::splat(nan), ..VIEW }, "camera.eye"),
        (LookAt { eye: DVec3::splat(1e13), ..VIEW }, "camera.eye"),
        (LookAt { target: DVec3::INFINITY, ..VIEW }, "camera.target"),
        (LookAt { target: VIEW.eye, ..VIEW }, "camera.target"),
        (LookAt { up: DVec3::ZERO, ..VIEW }, "camera.up"),
        (LookAt { up: DVec3::NAN, ..VIEW }, "camera.up"),
        (LookAt { fov_y_rad: 0.0, ..VIEW }, "camera.fov_y_rad"),
        (LookAt { fov_y_rad: -1.0, ..VIEW }, "camera.fov_y_rad"),
        (LookAt { fov_y_rad: std::f64::consts::PI, ..VIEW }, "camera.fov_y_rad"),
        (LookAt { fov_y_rad: nan, ..VIEW }, "camera.fov_y_rad"),
        (LookAt { near: 0.0, ..VIEW }, "camera.near"),
        (LookAt { near: nan, ..VIEW }, "camera.near"),
        (LookAt { near: 100.0, ..VIEW }, "camera.far"),
        (LookAt { near: 200.0, ..VIEW }, "camera.far"),
        (LookAt { far: f64::INFINITY, ..VIEW }, "camera.far"),
        (LookAt { image: [0, 10], ..VIEW }, "camera.image"),
        (LookAt { image: [10, 70_000], ..VIEW }, "camera.image"),
    ];
    for (view, expected) in cases {
        assert_eq!(field(Camera::look_at(view)), expected, "{view:?}");
    }
}

#[test]
fn lights_and_bounds_name_what_is_wrong() {
    let camera = Camera::look_at(VIEW).unwrap();
    let plan = |light: Light, bounds: &Bounds| {
        // The first light is valid.
        field(planner().plan(&camera, &[SUN, light], bounds, &Technique::default()))
    };
    let none = Bounds::default();
    let tiles = SeenTiles::new(&camera);
    let seen = Seen { tiles: &tiles, moving: &[], clearance: 0.0 };
    for direction in [DVec3::ZERO, DVec3::NAN, DVec3::new(0.0, f64::INFINITY, 0.0)] {
        assert_eq!(plan(Light::Directional { direction }, &none), "light.direction");
    }
    for (spot, expected) in [
        (SpotLight { position: DVec3::NAN, ..SPOT }, "light.position"),
        (SpotLight { direction: DVec3::ZERO, ..SPOT }, "light.direction"),
        (SpotLight { half_angle_rad: 0.0, ..SPOT }, "light.half_angle_rad"),
        (SpotLight { half_angle_rad: 1.6, ..SPOT }, "light.half_angle_rad"),
        (SpotLight { near: 0.0, ..SPOT }, "light.near"),
        (SpotLight { range: 0.1, ..SPOT }, "light.range"),
        (SpotLight { range: f64::NAN, ..SPOT }, "light.range"),
    ] {
        assert_eq!(plan(Light::Spot(spot), &none), expected);
    }
    for (point, expected) in [
        (PointLight { position: DVec3::INFINITY, ..LAMP }, "light.position"),
        (PointLight { position: DVec3::splat(1e13), ..LAMP }, "light.position"),
        (PointLight { near: 0.0, ..LAMP }, "light.near"),
        (PointLight { near: f64::NAN, ..LAMP }, "light.near"),
        (PointLight { range: 0.1, ..LAMP }, "light.range"),
        (PointLight { range: f64::INFINITY, ..LAMP }, "light.range"),
    ] {
        assert_eq!(plan(Light::Point(point), &none), expected);
    }
    let upside_down = Aabb { min: DVec3::ONE, max: DVec3::ZERO };
    let nan = Aabb { min: DVec3::ZERO, max: DVec3::NAN };
    for (bounds, expected) in [
        (Bounds { receivers: Some(upside_down), ..none }, "bounds.receivers"),
        (Bounds { casters: Some(nan), ..none }, "bounds.casters"),
        (Bounds { seen: Some(Seen { moving: &[nan], ..seen }), ..none }, "bounds.seen.moving"),
        (Bounds { seen: Some(Seen { clearance: -1.0, ..seen }), ..none }, "bounds.seen.clearance"),
    ] {
        assert_eq!(plan(SUN, &bounds), expected);
    }
    for wrong in [nan, upside_down] {
        let error = BoxTree::new(&[Aabb::EMPTY, wrong]).unwrap_err();
        assert!(error.to_string().contains("boxes"), "{error}");
    }
}

#[test]
fn techniques_name_what_is_wrong() {
    let camera = Camera::look_at(VIEW).unwrap();
    let some = Technique::default();
    let four = Partition::slices(4);
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let at = |ends: &[f64]| {
        let mut all = [nan; Partition::MAX_SLICES - 1];
        all[..ends.len()].copy_from_slice(ends);
        Technique { partition: Partition { splits: Splits::At(all), ..four }, ..some }
    };
    let practical = |blend| Technique {
        partition: Partition { splits: Splits::Practical(blend), ..four },
        ..some
    };
    let overlap = |overlap| Technique { partition: Partition { overlap, ..four }, ..some };
    let slices = |slices| Technique { partition: Partition { slices, ..four }, ..some };
    let stable = |partition| Technique { partition, ..technique(STABLE) };
    let pcss = |light| Technique { filter: Filter::Pcss { n: 4, light }, ..some };
    let size = |size| Technique { size, ..some };
    let cases = [
        (size(Size::Budget(0)), "technique.size"),
        (size(Size::Budget((1 << 32) + 1)), "technique.size"),
        (size(Size::Exact([0, 5])), "technique.size"),
        (size(Size::Exact([5, 9000])), "technique.size"),
        (size(Size::MaxError(0.0)), "technique.size"),
        (size(Size::MaxError(-1.0)), "technique.size"),
        (size(Size::MaxError(nan)), "technique.size"),
        (size(Size::MaxError(inf)), "technique.size"),
        (Technique { warp: Warp::Lambda(0.0), ..some }, "technique.warp.lambda"),
        (Technique { warp: Warp::Lambda(nan), ..some }, "technique.warp.lambda"),
        (Technique { warp: Warp::Tsm { focus: Some(-1.0) }, ..some }, "technique.warp.focus"),
        (Technique { warp: Warp::Tsm { focus: Some(inf) }, ..some }, "technique.warp.focus"),
        (slices(0), "technique.partition.slices"),
        (slices(17), "technique.partition.slices"),
        (overlap(-0.1), "technique.partition.overlap"),
        (overlap(1.1), "technique.partition.overlap"),
        (overlap(nan), "technique.partition.overlap"),
        (practical(-0.1), "technique.partition.splits"),
        (practical(1.1), "technique.partition.splits"),
        (practical(nan), "technique.partition.splits"),
        (at(&[1.0, 2.0]), "technique.partition.splits"),
        (at(&[1.0, 2.0, 2.0]), "technique.partition.splits"),
        (at(&[3.0, 2.0, 4.0]), "technique.partition.splits"),
        (at(&[0.0, 2.0, 4.0]), "technique.partition.splits"),
        (at(&[-1.0, 2.0, 4.0]), "technique.partition.splits"),
        (at(&[1.0, 2.0, inf]), "technique.partition.splits"),
        (stable(Partition { faces: Faces::Sides, ..four }), "technique.partition.faces"),
        (stable(Partition { splits: Splits::Fitted, ..four }), "technique.partition.splits"),
        (Technique { size: Size::Exact([1, 64]), ..stable(four) }, "technique.size"),
        (Technique { warp: Warp::Lispsm, ..stable(four) }, "technique.cover"),
        (Technique { cover: Cover::Scene, ..some }, "technique.cover"),
        (Technique { filter: Filter::Pcf { n: 0 }, ..some }, "filter.n"),
        (pcss(LightSize::Degrees(91.0)), "filter.light"),
    ];
    for (technique, expected) in cases {
        let result = Planner::new().plan(&camera, &[SUN], &Bounds::default(), &technique).cloned();
        assert_eq!(field(result), expected, "{technique:?}");
        // No light, no excuse.
        let result = Planner::new().plan(&camera, &[], &Bounds::default(), &technique).cloned();
        assert_eq!(field(result), expected, "{technique:?}");
    }
    // What is not used may be anything.
    Planner::new().plan(&camera, &[SUN], &Bounds::default(), &at(&[1.0, 2.0, 4.0])).unwrap();
}

#[test]
fn limits_name_what_is_wrong() {
    let camera = Camera::look_at(VIEW).unwrap();
    let plan = |limits, technique: &Technique| {
        let mut planner = Planner::with_limits(limits);
        field(planner.plan(&camera, &[SUN], &Bounds::default(), technique).cloned())
    };
    let limits = |max_side, align| Limits { max_side, align };
    let any = Technique::default();
    for (max_side, align, expected) in [
        (0, 1, "limits.max_side"),
        (65537, 1, "limits.max_side"),
        (8192, 0, "limits.align"),
        (8192, 8193, "limits.align"),
    ] {
        assert_eq!(plan(limits(max_side, align), &any), expected);
    }
    let exact = Technique { size: Size::Exact([6, 8]), ..any };
    assert_eq!(plan(limits(8192, 4), &exact), "technique.size");
    assert_eq!(plan(limits(1, 1), &technique(STABLE)), "technique.size");
}

/// A sun's size is an angle and a lamp's size a length; a mismatch is an error.
#[test]
fn lights_sizes_are_of_the_lights_kind() {
    let camera = Camera::look_at(VIEW).unwrap();
    let lamp = Light::Point(PointLight { position: DVec3::ZERO, near: 0.1, range: 50.0 });
    for (light, size, is_right) in [
        (SUN, LightSize::Degrees(0.5), true),
        (SUN, LightSize::Metres(0.5), false),
        (lamp, LightSize::Degrees(0.5), false),
        (lamp, LightSize::Metres(0.5), true),
    ] {
        let filter = Filter::Pcss { n: 4, light: size };
        let technique = Technique { filter, ..Technique::default() };
        let result = planner().plan(&camera, &[light], &Bounds::default(), &technique).cloned();
        match result {
            Ok(plan) => assert!(is_right && plan.filter == filter),
            error => {
                assert!(!is_right);
                assert_eq!(field(error), "technique.filter.light");
            }
        }
    }
}

#[test]
fn no_lights_need_no_maps() {
    let camera = Camera::look_at(VIEW).unwrap();
    let mut planner = planner();
    planner.plan(&camera, &[SUN], &Bounds::default(), &Technique::default()).unwrap();
    for size in [Size::Budget(1), Size::Exact([8, 8]), Size::MaxError(1e-9)] {
        let technique = Technique { size, ..Technique::default() };
        let plan = planner.plan(&camera, &[], &Bounds::default(), &technique).unwrap();
        assert!(plan.maps.is_empty() && plan.lights.is_empty());
        assert_eq!((plan.texels(), plan.storage_factor()), (0, 0.0));
        assert_eq!(plan.lookup(0, VIEW.target).count(), 0);
    }
}

/// Extreme configurations: lights along the view, from behind and from the front, lamps at the eye
/// and at its corners, up along the view, narrow and huge ranges, all kinds of partitions, budgets
/// of one texel, flat and point-like worlds. Every plan is finite and within its budget, or the
/// error says why there is none.
#[test]
fn odd_input_gives_sound_plans() {
    let view = (VIEW.target - VIEW.eye).normalize();
    let lights = [
        Light::Directional { direction: view },
        Light::Directional { direction: -view },
        Light::Directional { direction: view + DVec3::X * 1e-13 },
        Light::Directional { direction: DVec3::NEG_Y * 1e-200 },
        Light::Directional { direction: DVec3::NEG_Y * 1e200 },
        Light::Spot(SPOT),
        Light::Spot(SpotLight { position: VIEW.eye, direction: view, ..SPOT }),
        Light::Spot(SpotLight { position: VIEW.target, direction: -view, ..SPOT }),
        Light::Spot(SpotLight { near: 1e-12, range: 1e12, half_angle_rad: 1.48, ..SPOT }),
        Light::Point(LAMP),
        Light::Point(PointLight { position: VIEW.eye, ..LAMP }),
        Light::Point(PointLight { position: VIEW.eye + view * VIEW.near, ..LAMP }),
        Light::Point(PointLight { near: 1e-12, range: 1e12, ..LAMP }),
    ];
    let views = [
        VIEW,
        LookAt { up: view, ..VIEW },
        LookAt { near: 99.99, ..VIEW },
        LookAt { near: 1e-6, far: 1e9, ..VIEW },
        LookAt { near: 1e-12, far: 1e12, ..VIEW },
        LookAt { eye: VIEW.eye + DVec3::X * 1e5, target: VIEW.target + DVec3::X * 1e5, ..VIEW },
        LookAt { fov_y_rad: 3.0, image: [1, 65536], ..VIEW },
    ];
    let floor = Aabb::new(DVec3::new(-1e3, 0.0, -1e3), DVec3::new(1e3, 0.0, 1e3));
    let point = Aabb::new(VIEW.eye + view * 5.0, VIEW.eye + view * 5.0);
    let behind = Aabb::new(VIEW.eye - view * 9.0, VIEW.eye - view * 8.0);
    let worlds = [
        Bounds::default(),
        Bounds::of_scene(floor),
        Bounds::of_scene(point),
        Bounds::of_scene(behind),
        Bounds::of_scene(Aabb::EMPTY),
        Bounds { casters: Some(floor), ..Bounds::default() },
    ];
    let at = |first: f64| Splits::At(std::array::from_fn(|i| first * (1.0 + 1e-9 * i as f64)));
    let partitions = [
        Partition::default(),
        Partition::slices(16),
        Partition { splits: Splits::Fitted, overlap: 1.0, ..Partition::slices(3) },
        Partition { faces: Faces::SidesAndNear, ..Partition::slices(2) },
        Partition { faces: Faces::Sides, splits: Splits::Practical(0.0), ..Partition::slices(3) },
        // Receivers in front of the near plane, and receivers beyond the far plane.
        Partition { splits: at(1e-12), overlap: 0.5, ..Partition::slices(4) },
        Partition { splits: at(9e11), faces: Faces::Sides, ..Partition::slices(4) },
    ];
    let sizes = [
        Size::Budget(1),
        Size::Budget(1 << 20),
        Size::Exact([3, 5]),
        Size::MaxError(3.0),
        Size::MaxError(1e6),
    ];
    let mut planner = planner();
    // For each warp all pairs of a partition and a size are tried in turn.
    let mut turn = 0;
    for look in views {
        let camera = Camera::look_at(look).unwrap();
        for light in lights {
            for bounds in worlds {
                for (name, spread) in WARPS {
                    turn += 1;
                    for step in 0..2 {
                        let partition = possible(partitions[(turn + step) % 7], spread);
                        let size = sizes[(turn + 2 * step) % 5];
                        let technique = Technique { size, partition, ..technique(spread) };
                        let what = format!("{name} {technique:?} {look:?} {light:?} {bounds:?}");
                        let maps = map_count(&partition, &light);
                        let least = if spread == STABLE { 4 } else { 1 };
                        let is_too_small = size == Size::Budget(1) && maps * least > 1;
                        match planner.plan(&camera, &[light], &bounds, &technique) {
                            Ok(plan) => {
                                assert_eq!(plan.maps.len(), maps, "{what}");
                                assert!(!is_too_small, "{what}");
                                check_sound(plan, size, &what);
                                let is_sun = matches!(light, Light::Directional { .. });
                                let is_empty = plan.maps.iter().all(umbrage::ShadowMap::is_empty);
                                assert!(
                                    !(is_empty && is_sun && bounds.receivers.is_none()),
                                    "{what}"
                                );
                            }
                            result => {
                                assert!(
                                    is_too_small || matches!(size, Size::MaxError(_)),
                                    "{what}: {result:?}"
                                );
                                assert_eq!(field(result), "technique.size");
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Where light falls almost exactly across a rolled camera, its image after the viewer's
/// perspective lies at infinity but for rounding, however small the rest is.
#[test]
fn a_light_almost_across_the_view_is_planned() {
    for tiny in (0..310).map(|digits| 10f64.powi(-digits)).chain([0.0]) {
        let rolled = LookAt { up: DVec3::new(-0.59, 0.29, -0.75), ..VIEW };
        let level = LookAt { target: VIEW.eye + DVec3::new(4.0, 0.0, -3.0), ..rolled };
        let camera = Camera::look_at(level).unwrap();
        let across = camera.forward().cross(DVec3::X).normalize();
        for direction in [
            DVec3::new(-tiny, -1.0, 0.5 * tiny),
            across + camera.forward() * tiny,
            across - camera.forward() * tiny,
        ] {
            let sun = Light::Directional { direction };
            let mut planner = planner();
            let plan = planner.plan(&camera, &[sun], &Bounds::default(), &technique(Warp::Psm));
            let plan = plan.unwrap();
            check_sound(plan, Size::Budget(1 << 20), &format!("{direction}"));
            let p = common::point_in_view(&camera, [0.3, 0.4, 0.5]);
            let shadow = plan.maps[0].project(p).unwrap();
            assert!(shadow.cmpge(DVec3::ZERO).all() && shadow.cmple(DVec3::ONE).all(), "{shadow}");
        }
    }
}

/// A wide spot light has six maps, those of a point light as far as they lie in its cone, also
/// where its cone is a half-space. What it does not light needs no texels.
#[test]
fn wide_spots_are_parts_of_point_lights() {
    let camera = Camera::look_at(VIEW).unwrap();
    let floor = Aabb::new(DVec3::new(-20.0, 0.0, -40.0), DVec3::new(30.0, 8.0, 20.0));
    let bounds = Bounds::of_scene(floor);
    let narrow = SpotLight { half_angle_rad: 75f64.to_radians(), ..SPOT };
    let plan_of = |light: Light, spread| {
        planner().plan(&camera, &[light], &bounds, &technique(spread)).unwrap().clone()
    };
    let SpotLight { position, near, range, .. } = SPOT;
    let bulb = Light::Point(PointLight { position, near, range });
    assert_eq!(plan_of(Light::Spot(narrow), Warp::Uniform.into()).maps.len(), 1);
    for half_deg in [75.01f64, 80.0, 89.9, 90.0] {
        for direction in [DVec3::NEG_Y, DVec3::Y, DVec3::X, DVec3::new(1.0, -0.1, 1.0)] {
            let spot = SpotLight { direction, half_angle_rad: half_deg.to_radians(), ..SPOT };
            for (name, spread) in WARPS {
                let light = Light::Spot(spot);
                let plan = plan_of(light, spread);
                let whole = plan_of(bulb, spread);
                assert_eq!(plan.maps.len(), 6, "{name}");
                let is_less = plan.storage_factor() <= whole.storage_factor() * 1.03;
                // Other warps follow rules that can need more for a part than for the whole.
                let is_fixed = spread.cover != Cover::Seen || spread.warp == Warp::Uniform;
                assert!(is_less || !is_fixed, "{name}, {half_deg}°, {direction}");
                for (map, of_bulb) in plan.maps.iter().zip(&whole.maps) {
                    assert_eq!(map.part, of_bulb.part);
                    let through = map.part.side.unwrap().direction();
                    // The corners of a cube's side are at 54.7° from its middle.
                    let off = direction.angle_between(through).to_degrees() - 54.8;
                    assert!(map.is_empty() || off < half_deg, "{name}: {:?} is not lit", map.part);
                }
                for (x, y) in [(100.0, 300.0), (320.0, 250.0), (600.0, 400.0), (30.0, 470.0)] {
                    let ray = camera.ray(DVec2::new(x, y));
                    let p = VIEW.eye + ray.at(VIEW.eye.y / -ray.direction.y);
                    if ray.direction.y < 0.0 && light.reaches(p) && camera.depth(p) < VIEW.far {
                        assert_eq!(plan.lookup(0, p).count(), 1, "{name}, {half_deg}°: {p}");
                    }
                }
            }
        }
    }
}

fn check_sound(plan: &Plan, size: Size, what: &str) {
    assert!(plan.lights.iter().all(|l| l.theta_rad.is_finite()), "{what}");
    assert!(plan.storage_factor().is_finite(), "{what}");
    for map in &plan.maps {
        assert!(map.shadow_from_local.is_finite(), "{what}");
        assert!(map.local_from_shadow.is_finite(), "{what}");
        assert!(map.shadow_from_local_f32().is_finite(), "{what}");
        assert!(map.lambda.is_none_or(|l| l > 0.0 && l.is_finite()), "{what}");
        assert!(map.split.iter().all(|d| d.is_finite()), "{what}");
        let planes = map.cell.iter().chain(&map.caster_planes).chain(&map.fade_from);
        for plane in planes {
            assert!(plane.normal.is_normalized() && plane.offset.is_finite(), "{what}: {plane:?}");
        }
        let e = map.error;
        assert!([e.max_s, e.max_t, e.max].iter().all(|e| e.is_finite()), "{what}: {e:?}");
        match size {
            Size::Budget(budget) => assert!(plan.texels() <= budget, "{what}"),
            Size::Exact(size) => assert!(map.is_empty() || map.resolution == size, "{what}"),
            Size::MaxError(pixels) => assert!(e.max <= pixels * (1.0 + 1e-9), "{what}"),
            Size::Needed => assert!(plan.paging.is_some(), "{what}"),
        }
        if map.is_empty() {
            assert!(!map.may_cast(Aabb::new(DVec3::splat(-1e12), DVec3::splat(1e12))), "{what}");
        }
    }
}

#[test]
fn a_camera_that_sees_nothing_gets_an_empty_plan() {
    let camera = Camera::look_at(VIEW).unwrap();
    let behind = Aabb::new(DVec3::new(-50.0, 0.0, 50.0), DVec3::new(-40.0, 10.0, 60.0));
    for (name, spread) in WARPS {
        let mut planner = planner();
        let plan =
            planner.plan(&camera, &[SUN], &Bounds::of_scene(behind), &technique(spread)).unwrap();
        assert!(plan.maps.iter().all(umbrage::ShadowMap::is_empty), "{name}");
        assert_eq!((plan.texels(), plan.storage_factor()), (0, 0.0));
        assert!(plan.maps[0].footprint(VIEW.target).is_none());
    }
}

/// A camera from matrices equals the camera from eye and target, in every convention of matrices.
#[test]
fn cameras_from_any_engines_matrices() {
    let expected = Camera::look_at(VIEW).unwrap();
    let pose = |left_handed: bool| {
        let (r, u, f) = (expected.right(), expected.up(), expected.forward());
        let back = if left_handed { f } else { -f };
        DMat4::from_cols(r.extend(0.0), u.extend(0.0), back.extend(0.0), VIEW.eye.extend(1.0))
    };
    let (n, f) = (VIEW.near, VIEW.far);
    let y = 1.0 / (VIEW.fov_y_rad / 2.0).tan();
    let x = y * 480.0 / 640.0;
    // Depth = a + b/distance.
    let projection = |sign: f64, a: f64, b: f64| {
        DMat4::from_cols(
            DVec4::new(x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, y, 0.0, 0.0),
            DVec4::new(0.0, 0.0, a * sign, sign),
            DVec4::new(0.0, 0.0, b, 0.0),
        )
    };
    let zero_to_one = (f / (f - n), -n * f / (f - n));
    let reversed = (-n / (f - n), n * f / (f - n));
    let open_gl = ((f + n) / (f - n), -2.0 * n * f / (f - n));
    let cases = [
        ("0 to 1", -1.0, zero_to_one, ClipDepth::ZeroToOne, None),
        ("0 to 1, left-handed", 1.0, zero_to_one, ClipDepth::ZeroToOne, None),
        ("reversed", -1.0, reversed, ClipDepth::ZeroToOne, None),
        ("OpenGL", -1.0, open_gl, ClipDepth::MinusOneToOne, None),
        ("infinite", -1.0, (1.0, -n), ClipDepth::ZeroToOne, Some(f)),
        ("infinite, reversed", -1.0, (0.0, n), ClipDepth::ZeroToOne, Some(f)),
        ("infinite, reversed, left-handed", 1.0, (0.0, n), ClipDepth::ZeroToOne, Some(f)),
    ];
    for (name, sign, (a, b), depth, distance) in cases {
        let camera = Camera::from_matrices(
            pose(sign > 0.0),
            projection(sign, a, b),
            depth,
            distance,
            VIEW.image,
        )
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        for p in [DVec3::new(2.0, 1.5, 0.0), DVec3::new(3.0, -1.0, -40.0)] {
            let (a, b) = (camera.pixel(p).unwrap(), expected.pixel(p).unwrap());
            assert!(a.distance(b) < 1e-8, "{name}: {a} {b}");
        }
        assert!((camera.near() / n - 1.0).abs() < 1e-9, "{name}: near {}", camera.near());
        assert!((camera.far() / f - 1.0).abs() < 1e-6, "{name}: far {}", camera.far());
    }
    let infinite = projection(-1.0, 0.0, n);
    let no_distance =
        Camera::from_matrices(pose(false), infinite, ClipDepth::ZeroToOne, None, VIEW.image);
    assert_eq!(field(no_distance), "camera.shadow_distance");
    let scaled = pose(false) * DMat4::from_scale(DVec3::splat(2.0));
    let bad = Camera::from_matrices(scaled, infinite, ClipDepth::ZeroToOne, Some(9.0), VIEW.image);
    assert_eq!(field(bad), "camera.world_from_view");
    let flat = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0));
    let bad = Camera::from_matrices(pose(false), flat, ClipDepth::ZeroToOne, Some(9.0), VIEW.image);
    assert_eq!(field(bad), "camera.clip_from_view");
    let mirrored = pose(true);
    let bad =
        Camera::from_matrices(mirrored, infinite, ClipDepth::ZeroToOne, Some(9.0), VIEW.image);
    assert_eq!(field(bad), "camera.world_from_view");
}

/// An orthographic camera from matrices equals that from eye and target, in every convention. The
/// pose tells handedness.
#[test]
fn orthographic_cameras_from_any_engines_matrices() {
    let LookAt { eye, target, up, far, image, .. } = VIEW;
    let (near, height) = (-3.0, 7.0);
    let view = Orthographic { eye, target, up, height, near, far, image };
    let expected = Camera::orthographic(view).unwrap();
    let pose = |back: DVec3| {
        let (r, u) = (expected.right(), expected.up());
        DMat4::from_cols(r.extend(0.0), u.extend(0.0), back.extend(0.0), eye.extend(1.0))
    };
    let y = 2.0 / height;
    let x = y * 480.0 / 640.0;
    let length = far - near;
    // Depth = a + b · distance, the picture's middle aside by (c, d), and everything times w.
    let projection = |sign: f64, [a, b]: [f64; 2], [c, d]: [f64; 2], w: f64| {
        DMat4::from_cols(
            DVec4::X * x * w,
            DVec4::Y * y * w,
            DVec4::Z * b * sign * w,
            DVec4::new(c * w, d * w, a * w, w),
        )
    };
    let zero_to_one = [-near / length, 1.0 / length];
    let reversed = [far / length, -1.0 / length];
    let open_gl = [-(far + near) / length, 2.0 / length];
    for (name, sign, ends, depth) in [
        ("0 to 1", -1.0, zero_to_one, ClipDepth::ZeroToOne),
        ("0 to 1, left-handed", 1.0, zero_to_one, ClipDepth::ZeroToOne),
        ("reversed", -1.0, reversed, ClipDepth::ZeroToOne),
        ("reversed, left-handed", 1.0, reversed, ClipDepth::ZeroToOne),
        ("OpenGL", -1.0, open_gl, ClipDepth::MinusOneToOne),
    ] {
        let pose = pose(expected.forward() * sign);
        for (aside, w) in [([0.0, 0.0], 1.0), ([0.3, -1.4], 2.5)] {
            let matrix = projection(sign, ends, aside, w);
            let camera = Camera::from_matrices(pose, matrix, depth, None, image)
                .unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(camera.is_orthographic());
            for p in [DVec3::new(2.0, 1.5, 0.0), eye - expected.forward(), eye] {
                // The middle's offset moves the picture by shares of half its size.
                let shift = DVec2::new(aside[0] * 320.0, -aside[1] * 240.0);
                let (a, b) = (camera.pixel(p).unwrap(), expected.pixel(p).unwrap() + shift);
                assert!(a.distance(b) < 1e-8, "{name}: {a} {b}");
            }
            let ends = [camera.near() - near, camera.far() - far];
            assert!(ends.iter().all(|e| e.abs() < 1e-9), "{name}: {ends:?}");
            assert!((camera.pixel_width(9.0) * 480.0 / height - 1.0).abs() < 1e-9);
            let shorter = Camera::from_matrices(pose, matrix, depth, Some(2.0), image).unwrap();
            assert_eq!(shorter.far(), 2.0);
            let none = Camera::from_matrices(pose, matrix, depth, Some(near - 1.0), image);
            assert_eq!(field(none), "camera.shadow_distance");
        }
    }
    let good = projection(-1.0, zero_to_one, [0.0; 2], 1.0);
    let pose = pose(-expected.forward());
    let mut sheared = good;
    sheared.z_axis.x = 0.1;
    let mut flipped = good;
    flipped.y_axis.y = -y;
    for bad in [
        sheared,
        flipped,
        good * 0.0,
        good * -1.0,
        DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::ZERO, DVec4::W),
    ] {
        let bad = Camera::from_matrices(pose, bad, ClipDepth::ZeroToOne, None, image);
        assert_eq!(field(bad), "camera.clip_from_view");
    }
}

#[test]
fn orthographic_cameras_name_what_is_wrong() {
    let LookAt { eye, target, up, near, far, image, .. } = VIEW;
    let good = Orthographic { eye, target, up, height: 5.0, near, far, image };
    for (view, name) in [
        (Orthographic { eye: DVec3::NAN, ..good }, "camera.eye"),
        (Orthographic { target: eye, ..good }, "camera.target"),
        (Orthographic { up: DVec3::ZERO, ..good }, "camera.up"),
        (Orthographic { height: 0.0, ..good }, "camera.height"),
        (Orthographic { height: -1.0, ..good }, "camera.height"),
        (Orthographic { height: f64::NAN, ..good }, "camera.height"),
        (Orthographic { height: f64::INFINITY, ..good }, "camera.height"),
        (Orthographic { near: f64::NEG_INFINITY, ..good }, "camera.near"),
        (Orthographic { near: f64::NAN, ..good }, "camera.near"),
        (Orthographic { far: near, ..good }, "camera.far"),
        (Orthographic { far: f64::INFINITY, ..good }, "camera.far"),
        (Orthographic { image: [0, 9], ..good }, "camera.image"),
    ] {
        assert_eq!(field(Camera::orthographic(view)), name);
    }
    for view in [
        Orthographic { near: 0.0, ..good },
        Orthographic { near: -50.0, far: -1.0, ..good },
        Orthographic { near: -1e12, far: 1e12, height: 1e12, ..good },
        Orthographic { height: 1e-9, image: [1, 65536], ..good },
    ] {
        let camera = Camera::orthographic(view).unwrap();
        for (name, spread) in WARPS {
            for light in [SUN, Light::Directional { direction: camera.forward() }] {
                let partition = possible(Partition::slices(3), spread);
                let technique = Technique { partition, ..technique(spread) };
                let mut planner = planner();
                let plan = planner.plan(&camera, &[light], &Bounds::default(), &technique);
                let plan = plan.unwrap_or_else(|e| panic!("{name} {view:?}: {e}"));
                for map in &plan.maps {
                    let is_finite = map.shadow_from_local.is_finite() && map.error.max.is_finite();
                    assert!(is_finite, "{name} {view:?}: {map:?}");
                }
            }
        }
    }
}

/// An off-centre projection (for one eye of a headset, say) shows what its matrix shows.
#[test]
fn off_centre_cameras() {
    let matrix = DMat4::from_cols(
        DVec4::new(1.2, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.1, 0.0, 0.0),
        DVec4::new(0.25, -0.1, -1.001, -1.0),
        DVec4::new(0.0, 0.0, -0.1001, 0.0),
    );
    let camera =
        Camera::from_matrices(DMat4::IDENTITY, matrix, ClipDepth::ZeroToOne, None, [200, 100])
            .unwrap();
    for p in [DVec3::new(0.3, 0.4, -2.0), DVec3::new(-1.0, -0.3, -5.0)] {
        let clip = matrix * p.extend(1.0);
        let ndc = clip.truncate() / clip.w;
        let expected = DVec2::new((ndc.x + 1.0) * 100.0, (1.0 - ndc.y) * 50.0);
        let pixel = camera.pixel(p).unwrap();
        assert!(pixel.distance(expected) < 1e-9, "{pixel} {expected}");
        let back = camera.ray(pixel).at(camera.depth(p));
        assert!(back.distance(p) < 1e-9);
    }
}

/// Positions of corners and centres in the image and in the map.
#[test]
fn landmarks() {
    let camera = Camera::look_at(VIEW).unwrap();
    let middle = camera.pixel(VIEW.target).unwrap();
    assert!(middle.distance(DVec2::new(320.0, 240.0)) < 1e-9);
    assert!(camera.pixel(VIEW.eye - camera.forward()).is_none());
    let right = camera.pixel(VIEW.target + camera.right()).unwrap();
    assert!(right.x > 321.0 && (right.y - 240.0).abs() < 1e-9);
    let above = camera.pixel(VIEW.target + camera.up()).unwrap();
    assert!(above.y < 239.0 && (above.x - 320.0).abs() < 1e-9);

    // With the sun overhead, the near end of the view lies at t = 0, the far end at t = 1, the
    // right side at large s, and higher points at smaller depths.
    let level = LookAt { eye: DVec3::ZERO, target: DVec3::NEG_Z, ..VIEW };
    let camera = Camera::look_at(level).unwrap();
    let light = Light::Directional { direction: DVec3::NEG_Y };
    for (name, spread) in WARPS {
        let mut planner = planner();
        let plan = planner.plan(&camera, &[light], &Bounds::default(), &technique(spread)).unwrap();
        let map = &plan.maps[0];
        let at = |x: f64, y: f64, z: f64| map.project(DVec3::new(x, y, z)).unwrap();
        // Maps that do not cover what is seen do not follow the view.
        if spread.cover == Cover::Seen {
            assert!(at(0.0, 0.0, -0.1).y.abs() < 1e-9, "{name}: near");
            assert!((at(0.0, 0.0, -100.0).y - 1.0).abs() < 1e-9, "{name}: far");
            assert!(at(0.0, 0.0, -3.0).y > at(0.0, 0.0, -2.0).y, "{name}");
            assert!(at(1.0, 0.0, -50.0).x > at(-1.0, 0.0, -50.0).x, "{name}");
            assert!((at(0.0, 0.0, -50.0).x - 0.5).abs() < 1e-9, "{name}: centre");
        }
        assert!(at(0.0, 1.0, -50.0).z < at(0.0, -1.0, -50.0).z, "{name}: depth");
        let beam = map.beam(at(0.3, 0.0, -20.0).truncate()).unwrap();
        assert!(
            beam.direction.distance(DVec3::NEG_Y) < 1e-9,
            "{name}: beams travel with the light"
        );
    }
}

/// Caster planes keep what stands between the view and the light, and cull what stands beside,
/// below or behind it.
#[test]
fn casters_are_culled() {
    let level = LookAt { eye: DVec3::ZERO, target: DVec3::NEG_Z, ..VIEW };
    let camera = Camera::look_at(level).unwrap();
    let cube = |center: DVec3| Aabb::new(center - 1.0, center + 1.0);
    let sun = Light::Directional { direction: DVec3::NEG_Y };
    let spot = Light::Spot(SpotLight {
        position: DVec3::new(0.0, 200.0, -50.0),
        direction: DVec3::NEG_Y,
        half_angle_rad: 0.2,
        near: 1.0,
        range: 400.0,
    });
    for light in [sun, spot] {
        for (name, spread) in WARPS {
            let mut planner = planner();
            let plan =
                planner.plan(&camera, &[light], &Bounds::default(), &technique(spread)).unwrap();
            let map = &plan.maps[0];
            for (center, casts) in [
                (DVec3::new(0.0, 0.0, -50.0), true),
                (DVec3::new(0.0, 150.0, -50.0), true),
                (DVec3::new(0.0, -150.0, -50.0), false),
                (DVec3::new(120.0, 20.0, -50.0), false),
                (DVec3::new(0.0, 20.0, -120.0), false),
                (DVec3::new(0.0, 20.0, 10.0), false),
            ] {
                assert_eq!(map.may_cast(cube(center)), casts, "{name}, {light:?}: {center}");
            }
        }
    }
}

/// The error of single precision near the eye is far below a texel, also 100 km from the world's
/// origin.
#[test]
fn single_precision_is_enough_far_from_the_origin() {
    let far_away = DVec3::new(1e5, 0.0, -1e5);
    let look = LookAt { eye: VIEW.eye + far_away, target: VIEW.target + far_away, ..VIEW };
    let camera = Camera::look_at(look).unwrap();
    for (name, spread) in WARPS {
        let mut planner = planner();
        let plan = planner.plan(&camera, &[SUN], &Bounds::default(), &technique(spread)).unwrap();
        let map = &plan.maps[0];
        for depth in [0.2, 1.0, 10.0, 90.0] {
            for pixel in
                [DVec2::new(10.0, 10.0), DVec2::new(320.0, 240.0), DVec2::new(600.0, 470.0)]
            {
                let local = camera.ray(pixel).at(depth);
                let exact = map.project(plan.origin + local).unwrap();
                let h = map.shadow_from_local_f32() * local.as_vec3().extend(1.0);
                let single = h.truncate() / h.w;
                let off = (single.as_dvec3() - exact).truncate().abs()
                    * DVec2::new(map.resolution[0].into(), map.resolution[1].into());
                assert!(off.max_element() < 0.02, "{name}: {off} texels off at depth {depth}");
            }
        }
    }
}
