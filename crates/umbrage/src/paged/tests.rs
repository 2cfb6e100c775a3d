use super::*;
use crate::bounds::Bounds;
use crate::camera::{LookAt, Orthographic};
use crate::light::{PointLight, SpotLight};
use crate::planner::Planner;
use crate::visibility::Filter;
use proptest::prelude::*;

/// A view somewhere around a place.
fn camera(place: DVec3) -> impl Strategy<Value = Camera> {
    let unit = || -1.0..1.0f64;
    let vector = || (unit(), unit(), unit()).prop_map(|(x, y, z)| DVec3::new(x, y, z));
    let image = prop_oneof![Just([480, 270]), Just([1920, 1080]), Just([300, 500])];
    (vector(), vector(), 0.3..1.8f64, 0.05..0.5f64, any::<bool>(), image).prop_map(
        move |(eye, way, fov_y_rad, near, is_orthographic, image)| {
            let eye = place + eye * 20.0;
            let target = eye + way + DVec3::X * 0.01;
            let up = DVec3::Y;
            let camera = if is_orthographic {
                let height = 10.0 * fov_y_rad;
                Camera::orthographic(Orthographic {
                    eye,
                    target,
                    up,
                    height,
                    near,
                    far: 60.0,
                    image,
                })
            } else {
                Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far: 400.0, image })
            };
            camera.expect("a view")
        },
    )
}

fn light(place: DVec3) -> impl Strategy<Value = Light> {
    let unit = || -1.0..1.0f64;
    let vector = || (unit(), unit(), unit()).prop_map(|(x, y, z)| DVec3::new(x, y, z + 1e-3));
    prop_oneof![
        2 => vector().prop_map(|direction| Light::Directional { direction }),
        1 => (vector(), vector(), 0.2..1.57f64).prop_map(move |(p, direction, half_angle_rad)| {
            Light::Spot(SpotLight {
                position: place + p * 10.0,
                direction,
                half_angle_rad,
                near: 0.05,
                range: 500.0,
            })
        }),
        1 => vector().prop_map(move |p| {
            Light::Point(PointLight { position: place + p * 10.0, near: 0.05, range: 500.0 })
        }),
    ]
}

/// A world point that a camera sees, from three numbers in 0..1.
fn seen(camera: &Camera, [x, y, z]: [f64; 3]) -> DVec3 {
    let [width, height] = camera.image().map(f64::from);
    let depth = if camera.is_orthographic() {
        camera.near() + (camera.far() - camera.near()) * z
    } else {
        camera.near() * (camera.far() / camera.near()).powf(z)
    };
    camera.eye() + camera.ray(DVec2::new(x * width, y * height)).at(depth)
}

fn technique(error: f64) -> Technique {
    format!("paged(error={error}):pcf3").parse().expect("a technique")
}

fn plan(camera: &Camera, light: Light, error: f64) -> Option<Plan> {
    let mut planner = Planner::new();
    planner.plan(camera, &[light], &Bounds::default(), &technique(error)).ok().cloned()
}

fn places() -> impl Strategy<Value = DVec3> {
    prop_oneof![
        Just(DVec3::ZERO),
        Just(DVec3::new(1e5, 20.0, -1e5)),
        Just(DVec3::new(-3.0, 1e4, 7.0))
    ]
}

proptest! {
    /// Every point that a camera sees in a light has a page, whose texels are no wider than asked
    /// for, and not finer than half of that without need.
    #[test]
    fn texels_are_nowhere_wider_than_asked(
        (camera, light) in places().prop_flat_map(|p| (camera(p), light(p))),
        points in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 60),
        error in 0.25..8.0f64,
        bias in prop_oneof![Just(0.0), 0.0..5.0f64],
    ) {
        let Some(mut plan) = plan(&camera, light, error) else { return Ok(()) };
        plan.set_page_bias(bias);
        let bound = plan.paging.as_ref().unwrap().bound();
        prop_assert!((bound - error * bias.exp2()).abs() <= 1e-12 * bound);
        for point in points {
            let point = seen(&camera, point);
            let place = plan.page_place(0, point);
            // Wide spot lights have the whole cube.
            let is_near = match light {
                Light::Directional { .. } => true,
                _ => (point - light.position().unwrap()).abs().max_element() < 280.0,
            };
            let has_place = is_near && match light {
                Light::Spot(spot) if !spot.is_wide() => {
                    let axis = spot.direction.normalize();
                    let v = point - spot.position;
                    let half = axis.dot(v) / v.length();
                    half > spot.half_angle_rad.cos() + 1e-9
                }
                _ => true,
            };
            prop_assert!(place.is_some() || !has_place, "{point} has no page");
            let Some(place) = place else { continue };
            let to_light = light.direction_to_light(point);
            let receiver = plan.receiver(place.map, point, to_light).unwrap();
            let texel = 2.0 * receiver.half_texel / receiver.depth_per_metre;
            let pixel = camera.pixel_width(camera.depth(point));
            prop_assert!(texel <= bound * pixel * (1.0 + 1e-6), "{texel} > {bound} · {pixel}");
            let level = &plan.paging.as_ref().unwrap().levels[place.map];
            if matches!(light, Light::Directional { .. }) {
                let is_last = place.map + 2 >= plan.maps.len();
                prop_assert!(2.0 * texel > bound * pixel * (1.0 - 1e-6) || is_last);
                prop_assert!(receiver.depth >= 1.0 / 9.0 - 1e-9 && receiver.depth <= 1.0 + 1e-9);
            }
            prop_assert_eq!(level.level, place.page.level);
        }
    }

    /// A page's own map has the same matrix whoever looks, and puts points where the window does.
    #[test]
    fn pages_stand_still(
        (first, second, light) in places().prop_flat_map(|p| (camera(p), camera(p), light(p))),
        points in prop::collection::vec(prop::array::uniform3(0.0..1.0f64), 30),
    ) {
        let plans = [first, second].map(|camera| plan(&camera, light, 1.0));
        let [Some(plan), Some(other)] = plans else { return Ok(()) };
        for point in points {
            let point = seen(&first, point);
            let Some(place) = plan.page_place(0, point) else { continue };
            let map = plan.page_map(&place.page).unwrap();
            let from_other = other.page_map(&place.page).unwrap();
            prop_assert_eq!(map.shadow_from_local, from_other.shadow_from_local);
            prop_assert_eq!(map.local_from_shadow, from_other.local_from_shadow);
            prop_assert_eq!((map.origin, &map.caster_planes), (from_other.origin, &from_other.caster_planes));
            let at = map.project(point).unwrap();
            let off = (at.truncate() * 64.0 - place.texel).abs().max_element();
            prop_assert!(off < 1e-3, "{off} texels off");
            let receiver = plan.page_receiver(&place, point, DVec3::Y).unwrap();
            prop_assert!((receiver.depth - at.z).abs() < 1e-7, "{} {}", receiver.depth, at.z);
            // The slope is that of the page's own map.
            let normal = (DVec3::Y + light.direction_to_light(point)).normalize();
            let receiver = plan.page_receiver(&place, point, normal).unwrap();
            let plane = normal.extend(-normal.dot(point - map.origin));
            let in_page = map.local_from_shadow.transpose() * plane;
            let slope = DVec2::new(in_page.x, in_page.y) / -in_page.z;
            let size = slope.abs().max_element().max(1e-6);
            prop_assert!((slope - receiver.slope).abs().max_element() < 1e-3 * size);
            // Both matrices belong together, and the page's casters are where it looks.
            let back = map.local_from_shadow * at.extend(1.0);
            let back = back.truncate() / back.w + map.origin;
            prop_assert!(back.distance(point) < 1e-6 * (1.0 + map.origin.distance(point)));
            let around = crate::bounds::Aabb::new(point - 1e-3, point + 1e-3);
            prop_assert!(map.may_cast(around));
            let window = &plan.maps[place.map];
            prop_assert!(window.may_cast(around));
        }
    }
}

/// A frame of a walk: how the viewer turns, and what it looks at.
fn frame() -> impl Strategy<Value = (f64, [[f64; 3]; 6])> {
    (-0.03..0.03, prop::array::uniform6(prop::array::uniform3(0.0..1.0)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    /// Over a walk of a thousand frames, whatever page is wanted again is what it was to the bit,
    /// though the plan's windows have moved on; and no two pages of a window share a place in its
    /// table, in which pages lie by their indices modulo the window's side.
    #[test]
    fn pages_of_a_walk_stay_what_they_were(
        (place, light) in places().prop_flat_map(|p| (Just(p), light(p))),
        frames in prop::collection::vec(frame(), 1000),
    ) {
        let technique = technique(0.7);
        let mut planner = Planner::new();
        let mut kept = std::collections::HashMap::new();
        let (mut eye, mut turn) = (place, 0.0f64);
        for (turned, points) in frames {
            turn += turned;
            let way = DVec3::new(turn.cos(), -0.2, turn.sin());
            // A stride at 1.4 m/s and 60 frames a second.
            eye += way.normalize() * (1.4 / 60.0);
            let camera = Camera::look_at(LookAt {
                eye,
                target: eye + way,
                up: DVec3::Y,
                fov_y_rad: 1.0,
                near: 0.2,
                far: 300.0,
                image: [480, 270],
            })
            .unwrap();
            let plan = planner.plan(&camera, &[light], &Bounds::default(), &technique).unwrap();
            let mut places_in_table = std::collections::HashMap::new();
            for point in points {
                let point = seen(&camera, point);
                let Some(place) = plan.page_place(0, point) else { continue };
                let map = plan.page_map(&place.page).unwrap();
                let side = i64::from(plan.paging.as_ref().unwrap().levels[place.map].side);
                let [i, j] = [place.page.i, place.page.j].map(|index| index.rem_euclid(side));
                let other = places_in_table.insert((place.map, i, j), place.page);
                prop_assert!(other.is_none_or(|other| other == place.page));
                let first: &mut ShadowMap = kept.entry(place.page).or_insert_with(|| map.clone());
                prop_assert_eq!(first.shadow_from_local, map.shadow_from_local);
                prop_assert_eq!(first.local_from_shadow, map.local_from_shadow);
                prop_assert_eq!(
                    (first.origin, &first.caster_planes),
                    (map.origin, &map.caster_planes)
                );
            }
        }
        let is_sun = matches!(light, Light::Directional { .. });
        prop_assert!(kept.len() > 10 || !is_sun, "{} pages", kept.len());
    }
}

/// An even floor seen from above, on which the number of pages follows from its size.
fn floor() -> (Camera, Vec<DVec3>) {
    let camera = Camera::look_at(LookAt {
        eye: DVec3::new(0.0, 10.0, 0.0),
        target: DVec3::ZERO,
        up: DVec3::Z,
        fov_y_rad: std::f64::consts::FRAC_PI_2,
        near: 0.1,
        far: 100.0,
        image: [640, 640],
    })
    .unwrap();
    let pixels = (0..640 * 640).map(|i| {
        let ray = camera.ray(DVec2::new(f64::from(i % 640) + 0.5, f64::from(i / 640) + 0.5));
        camera.eye() + ray.at(10.0)
    });
    (camera, pixels.collect())
}

#[test]
fn a_floor_seen_from_above_has_the_pages_that_it_takes() {
    let (camera, pixels) = floor();
    let sun = Light::Directional { direction: DVec3::NEG_Y };
    // A pixel is 1/32 m wide at the floor. Texels are as wide, or as the next smaller power of two.
    for (error, texel) in [(1.0f64, 1.0f64 / 32.0), (1.9, 1.0 / 32.0), (2.0, 1.0 / 16.0)] {
        let plan = plan(&camera, sun, error * (1.0 + 1e-9)).unwrap();
        let pages = plan.wanted_pages(0, &pixels);
        // The floor is 20 m wide, from −10 to 10, and pages begin at 0.
        let across = 2.0 * (10.0 / (64.0 * texel)).ceil();
        let level = texel.log2() as i32;
        let (pages, fallback): (Vec<Page>, Vec<Page>) =
            pages.iter().partition(|p| p.level == level);
        assert_eq!(pages.len() as f64, across * across, "{error}");
        // One page of 32 m or more in each quarter.
        assert!(fallback.len() == 4 && fallback.iter().all(|page: &Page| page.level == level + 4));
    }
    // At this size and field of view: 2 f c/32 + 2 pages, with f = 320 and c = √3.
    let plan = plan(&camera, sun, 1.0).unwrap();
    assert!(plan.paging.unwrap().levels.iter().all(|level| level.side == 64));
}

#[test]
fn a_full_pool_makes_all_texels_wider_by_as_much_as_it_must() {
    let (camera, pixels) = floor();
    let sun = Light::Directional { direction: DVec3::new(0.3, -1.0, 0.1) };
    let mut planner = Planner::new();
    let mut last = 0.0;
    for side in [2048, 1024, 724, 512] {
        let technique: Technique = format!("paged@{side}").parse().unwrap();
        let plan = planner.plan(&camera, &[sun], &Bounds::default(), &technique).unwrap();
        let mut plan = plan.clone();
        plan.fit_pages(&pixels);
        let paging = plan.paging.as_ref().unwrap();
        let (bias, budget) = (paging.bias, paging.budget.unwrap() as usize);
        assert_eq!(budget as u32, (side / 64) * (side / 64) + u32::from(side == 724) * 6);
        assert!(bias >= last);
        last = bias;
        let wanted = plan.wanted_pages(0, &pixels).len();
        assert!(wanted <= budget, "{wanted} pages, {budget} fit");
        if bias > 0.0 {
            plan.set_page_bias(bias - fit_step());
            assert!(plan.wanted_pages(0, &pixels).len() > budget);
        }
    }
    assert!(last > 0.0);
}

fn fit_step() -> f64 {
    1.0 / 64.0
}

#[test]
fn what_pages_cannot_do_is_refused() {
    let (camera, _) = floor();
    let sun = Light::Directional { direction: DVec3::NEG_Y };
    let paged = technique(1.0);
    let filter = "vsm".parse().unwrap();
    for (technique, field) in [
        (Technique { filter, ..paged }, "technique.filter"),
        (Technique { cover: Cover::Paged { error: 0.1 }, ..paged }, "technique.cover"),
        (Technique { cover: Cover::Paged { error: f64::NAN }, ..paged }, "technique.cover"),
        (Technique { size: Size::Budget(1000), ..paged }, "technique.size"),
        (Technique { size: Size::MaxError(1.0), ..paged }, "technique.size"),
        (Technique { size: Size::Needed, ..Technique::default() }, "technique.size"),
        (Technique { warp: crate::Warp::Lispsm, ..paged }, "technique.cover"),
        (Technique { partition: crate::Partition::slices(2), ..paged }, "technique.partition"),
    ] {
        let mut planner = Planner::new();
        let error = planner.plan(&camera, &[sun], &Bounds::default(), &technique);
        assert!(error.unwrap_err().to_string().contains(field), "{technique:?}");
    }
    // A view that is orthographic and long has no table of a size to be had.
    let long = Camera::orthographic(Orthographic {
        eye: DVec3::ZERO,
        target: DVec3::Z,
        up: DVec3::Y,
        height: 1.0,
        near: 0.0,
        far: 1e4,
        image: [1000, 1000],
    })
    .unwrap();
    let mut planner = Planner::new();
    let error = planner.plan(&long, &[sun], &Bounds::default(), &paged).unwrap_err();
    assert!(error.to_string().contains("technique.cover"), "{error}");
    // Without maps there are no pages.
    let none = Technique { filter: Filter::None, ..paged };
    let plan = planner.plan(&camera, &[sun], &Bounds::default(), &none).unwrap();
    assert!(plan.maps.is_empty() && plan.page_place(0, DVec3::ZERO).is_none());
}

#[test]
fn a_planner_goes_from_pages_to_maps_and_back() {
    let (camera, _) = floor();
    let sun = Light::Directional { direction: DVec3::NEG_Y };
    let mut planner = Planner::new();
    let mut plan = |text: &str| {
        let technique: Technique = text.parse().unwrap();
        let bounds = Bounds::default();
        let kept = planner.plan(&camera, &[sun], &bounds, &technique).unwrap();
        let mut fresh = Planner::new();
        assert!(kept == fresh.plan(&camera, &[sun], &bounds, &technique).unwrap(), "{text}");
        kept.paging.is_some()
    };
    assert_eq!(
        ["paged", "adaptive+z2", "paged", "adaptive+z2"].map(&mut plan),
        [true, false, true, false]
    );
}
