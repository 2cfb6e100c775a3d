//! Orthographic views against perspective views from very far away.

mod common;

use common::{Config, STABLE, WARPS, config, detail, planner, point_in_view, reach, technique};
use glam::DVec3;
use proptest::prelude::*;
use umbrage::{Bounds, Camera, Faces, Light, LookAt, Partition, Plan, Splits, Technique, Warp};

fn orthographic() -> impl Strategy<Value = Config> {
    config().prop_filter("an orthographic view", |c| c.camera.is_orthographic())
}

/// A perspective view from so far behind that a pixel has the same width at both ends of its range,
/// to this share.
const SHARE: f64 = 1e-3;

fn from_afar(camera: &Camera) -> Camera {
    let (near, far, image) = (camera.near(), camera.far(), camera.image());
    let height = camera.pixel_width(near) * f64::from(image[1]);
    let distance = reach(camera).max(far - near) / SHARE;
    let eye = camera.eye() - camera.forward() * distance;
    Camera::look_at(LookAt {
        eye,
        target: eye + camera.forward() * distance,
        up: camera.up(),
        fov_y_rad: 2.0 * (height / 2.0 / distance).atan(),
        near: distance + near,
        far: distance + far,
        image,
    })
    .expect("a valid camera")
}

fn plan(camera: &Camera, config: &Config, technique: &Technique) -> Plan {
    planner().plan(camera, &[config.light], &config.bounds, technique).unwrap().clone()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 800, max_global_rejects: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Both views' maps have the same errors. (`psm` undoes the perspective by a map that is
    /// sheared even where none is left, and in orthographic views it is `uniform`.)
    #[test]
    fn errors_are_those_of_a_distant_view(
        config in orthographic(),
        slices in 1..=4u32,
        practical in proptest::option::of(0.0..=1.0f64),
        pick in 0..WARPS.len(),
        numbers in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0, 0.0..=1.0], 4),
    ) {
        let (name, spread) = WARPS[pick];
        prop_assume!(spread.warp != Warp::Psm);
        // `adaptive` of a perspective view may warp even where the perspective does not matter.
        prop_assume!(!matches!(spread.warp, Warp::Adaptive(_)));
        let is_sun = matches!(config.light, Light::Directional { .. });
        // Flat boxes are given a thickness that grows with the distance.
        let least = 0.05 * reach(&config.camera);
        prop_assume!(config.bounds.receivers.is_none_or(|r| r.size().min_element() > least));
        // Coordinates are as large as the distance, and lose as many digits.
        let distant = from_afar(&config.camera);
        prop_assume!(distant.eye().length() < 1e9 * detail(&config.camera));
        let splits = practical.map_or(Splits::SelfSimilar, Splits::Practical);
        let partition = Partition { splits, ..Partition::slices(slices) };
        let technique = Technique { partition, ..technique(spread) };
        let [here, afar] = [&config.camera, &distant].map(|c| plan(c, &config, &technique));
        for (a, b) in here.maps.iter().zip(&afar.maps).filter(|_| is_sun) {
            let figures = |map: &umbrage::ShadowMap| {
                let [s, t] = map.resolution.map(f64::from);
                [map.error.max_s * s, map.error.max_t * t, map.error.max * s.min(t)]
            };
            for (x, y) in figures(a).into_iter().zip(figures(b)) {
                prop_assert!((x / y - 1.0).abs() < 0.01 || x == y, "{name}: {x} {y} {:?} {:?}", a.error, b.error);
            }
        }
        // Under lamps largest errors are upper bounds, which the errors at points are not.
        for p in config.seen_points(&numbers) {
            let [a, b] = [(&here, &config.camera), (&afar, &distant)].map(|(plan, camera)| {
                let map = plan.lookup(0, p).next().map(|(index, _)| &plan.maps[index]);
                map.map(|map| (map.part, map.perspective_error(camera, p).unwrap().worst))
            });
            let (Some((part_a, a)), Some((part_b, b))) = (a, b) else { continue };
            prop_assert!(part_a != part_b || (a / b - 1.0).abs() < 0.05, "{name}: {a} {b} at {p}");
        }
    }

    /// Under parallel light no map is warped but by a λ that was asked for. All are `uniform`.
    #[test]
    fn nothing_is_warped_under_parallel_light(
        config in orthographic().prop_filter("parallel light", |c| {
            matches!(c.light, Light::Directional { .. })
        }),
    ) {
        let uniform = plan(&config.camera, &config, &technique(Warp::Uniform));
        for (name, spread) in WARPS {
            if spread == STABLE || spread == common::SCENE {
                continue;
            }
            let plan = plan(&config.camera, &config, &technique(spread));
            let storage = [plan.storage_factor(), uniform.storage_factor()];
            if !matches!(spread.warp, Warp::Lambda(_)) {
                prop_assert_eq!(plan.maps[0].lambda, None, "{}", name);
                prop_assert_eq!(storage[0], storage[1], "{}", name);
            }
        }
    }

    /// A partition by faces has one map for the whole view, and empty ones.
    #[test]
    fn faces_need_no_maps_of_their_own(
        config in orthographic(),
        with_near: bool,
        numbers in proptest::collection::vec([0.0..=1.0f64, 0.0..=1.0, 0.0..=1.0], 4),
    ) {
        let whole = plan(&config.camera, &config, &technique(Warp::Lispsm));
        let faces = if with_near { Faces::SidesAndNear } else { Faces::Sides };
        let partition = Partition { faces, ..Partition::default() };
        let by_face = plan(&config.camera, &config, &Technique { partition, ..technique(Warp::Lispsm) });
        let per_projector = if with_near { 5 } else { 4 };
        prop_assert_eq!(by_face.maps.len(), per_projector * whole.maps.len());
        for (one, faces) in whole.maps.iter().zip(by_face.maps.chunks(per_projector)) {
            prop_assert_eq!(one.error, faces[0].error);
            prop_assert_eq!(one.resolution, faces[0].resolution);
            prop_assert!(faces[1..].iter().all(umbrage::ShadowMap::is_empty));
        }
        for p in config.seen_points(&numbers) {
            prop_assert_eq!(by_face.lookup(0, p).count(), 1);
        }
    }
}

/// Pixels, lines of sight and depths agree, before the eye and behind it.
#[test]
fn lines_of_sight_meet_their_pixels() {
    proptest!(|(camera in common::camera(), at in [0.0..1.0f64, 0.0..1.0, 0.0..1.0])| {
        prop_assume!(camera.eye().length() < 1e3 * detail(&camera));
        let p = point_in_view(&camera, at);
        let pixel = camera.pixel(p).expect("a point in view");
        let [width, height] = camera.image().map(f64::from);
        prop_assert!((pixel.x - at[0] * width).abs() < 1e-6 && (pixel.y - at[1] * height).abs() < 1e-6);
        let sight = camera.ray(pixel);
        let back = camera.eye() + sight.at(camera.depth(p));
        prop_assert!(back.distance(p) <= 1e-9 * reach(&camera));
        // A step of a pixel upwards is as wide as a pixel.
        let above = camera.ray(pixel - glam::DVec2::Y).at(camera.depth(p));
        let step = above.distance(sight.at(camera.depth(p)));
        prop_assert!((step / camera.pixel_width(camera.depth(p)) - 1.0).abs() < 1e-6);
    });
}

/// A box seen from above, whose errors are known: a texel's width over a pixel's.
#[test]
fn a_plan_view_of_a_floor() {
    let camera = Camera::orthographic(umbrage::Orthographic {
        eye: DVec3::new(0.0, 50.0, 0.0),
        target: DVec3::ZERO,
        up: DVec3::NEG_Z,
        height: 20.0,
        near: 0.0,
        far: 100.0,
        image: [800, 400],
    })
    .unwrap();
    let floor = umbrage::Aabb::new(DVec3::new(-40.0, 0.0, -40.0), DVec3::new(40.0, 0.0, 40.0));
    let light = Light::Directional { direction: DVec3::NEG_Y };
    let size = umbrage::Size::Exact([100, 50]);
    let technique = Technique { size, ..technique(Warp::Uniform) };
    let mut planner = planner();
    let plan = planner.plan(&camera, &[light], &Bounds::of_scene(floor), &technique).unwrap();
    // The picture shows 40 by 20 metres in pixels of 5 centimetres; a texel is 40 centimetres wide.
    let error = plan.maps[0].error;
    let mut sides = [error.max_s, error.max_t];
    sides.sort_by(f64::total_cmp);
    assert!((sides[0] - 8.0).abs() < 1e-3 && (sides[1] - 8.0).abs() < 1e-3, "{error:?}");
}
