//! The boxes that [`Tracer::boxes`] gives a planner hold all that is drawn, and little empty space.

mod common;

use common::{at, ground, scene, sheet, soup, sphere};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use umbrage::Aabb;
use umbrage_scene::{Mesh, Scene, builtin};
use umbrage_trace::Tracer;

const LIMITS: [usize; 6] = [0, 1, 2, 7, 256, 100_000];

/// The boxes of all triangles of all instances that have an area, in world space.
fn triangles(scene: &Scene) -> Vec<Aabb> {
    let of_instance = |(mesh, to_world): (usize, DAffine3)| {
        let mesh = &scene.meshes[mesh];
        mesh.triangles.iter().filter_map(move |corners| {
            let corners = corners.map(|i| mesh.positions[i as usize].as_dvec3());
            let area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let in_world = corners.map(|c| to_world.transform_point3(c));
            (area != DVec3::ZERO).then(|| Aabb::around(in_world))
        })
    };
    scene.instances.iter().flat_map(|i| of_instance((i.mesh, i.world_from_mesh))).collect()
}

/// Half the surface area of all boxes, square metres.
fn surface(boxes: &[Aabb]) -> f64 {
    boxes.iter().map(|b| b.size()).map(|s| s.x * s.y + s.y * s.z + s.z * s.x).sum()
}

fn holds(outer: Aabb, inner: Aabb, slack: f64) -> bool {
    inner.min.cmpge(outer.min - slack).all() && inner.max.cmple(outer.max + slack).all()
}

/// Checks the boxes for every limit, and returns how many there are for each.
fn check(name: &str, scene: &Scene) -> Vec<usize> {
    let tracer = Tracer::new(scene).unwrap();
    let triangles = triangles(scene);
    let all = scene.bounds();
    // Some roundings of world coordinates in double precision.
    let slack = 1e-14 * all.min.abs().max(all.max.abs()).max_element();
    let count = |limit: usize| {
        let mut boxes = tracer.boxes(limit);
        boxes.sort_by(|a, b| a.min.x.total_cmp(&b.min.x));
        assert!((1..=limit.max(1)).contains(&boxes.len()), "{name}: {} for {limit}", boxes.len());
        for b in &boxes {
            assert!(!b.is_empty() && holds(tracer.bounds(), *b, 0.0), "{name}: {b:?}");
        }
        for t in &triangles {
            let begun = boxes.partition_point(|b| b.min.x <= t.min.x + slack);
            let found = boxes[..begun].iter().rev().any(|b| holds(*b, *t, slack));
            assert!(found, "{name}, {limit}: {t:?} is in no box");
        }
        if limit >= triangles.len() {
            // The only empty space is that in the triangles' own boxes.
            let [found, expected] = [surface(&boxes), surface(&triangles)];
            assert_eq!(boxes.len(), triangles.len(), "{name}, {limit}");
            assert!((found - expected).abs() <= 1e-9 * expected, "{name}: {found}, {expected}");
        }
        boxes.len()
    };
    LIMITS.map(count).to_vec()
}

#[test]
fn all_that_is_drawn_is_in_some_box() {
    // One of every kind of scene, with few enough triangles to test each.
    for (name, size) in [
        ("town", 1),
        ("airfield", 1),
        ("statues", 1),
        ("grove", 1),
        ("fence", 1),
        ("lantern", 1),
        ("pole", 1),
        ("slit", 30),
        ("sphere", 24),
    ] {
        let scene = builtin(name, Some(size)).unwrap();
        let counts = check(name, &scene);
        // At least a third of the allowed boxes is used, if there are as many triangles.
        let triangles = triangles(&scene).len();
        for (count, limit) in counts.into_iter().zip(LIMITS) {
            assert!(3 * count >= limit.min(triangles), "{name}: {count} of {limit}");
        }
    }
}

#[test]
fn instances_may_be_turned_sheared_and_mirrored() {
    let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let mirrored = DAffine3::from_scale(DVec3::new(-3.0, 0.01, 40.0));
    let sheared = DAffine3::from_mat3_translation(
        DMat3::from_cols(DVec3::X, DVec3::new(0.9, 1.0, 0.3), DVec3::new(0.0, -0.4, 2.0)),
        DVec3::new(1e5, -20.0, 3e4),
    );
    let ball = || sphere(Vec3::new(3.0, 1.0, -2.0), 1.5, 12);
    let places = [turned, mirrored, sheared, at(0.0, 3.0, 0.0) * turned * mirrored];
    check("balls", &scene(vec![ball(), ground(5.0)], &places.map(|p| (0, p))));
    // One instance of two triangles: a limit of 2 opens it down to its triangles.
    let one = scene(vec![ground(5.0)], &[(0, turned)]);
    assert_eq!(check("a turned ground", &one)[..4], [1, 1, 2, 2]);
}

#[test]
fn triangles_without_area_get_no_box() {
    let line = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
    let far_off = [Vec3::splat(9.0); 3];
    let real = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let some = scene(vec![soup(&[line, real, far_off])], &[(0, DAffine3::IDENTITY)]);
    let boxes = Tracer::new(&some).unwrap().boxes(256);
    assert_eq!(boxes, [Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0))]);
    // A mesh that has only such triangles is not drawn, alone or among others.
    let lines = || soup(&[line, far_off]);
    let none = scene(vec![lines()], &[(0, DAffine3::IDENTITY), (0, at(5.0, 0.0, 0.0))]);
    assert_eq!(Tracer::new(&none).unwrap().boxes(256), []);
    let among =
        scene(vec![lines(), soup(&[real])], &[(0, at(5.0, 0.0, 0.0)), (1, DAffine3::IDENTITY)]);
    assert_eq!(Tracer::new(&among).unwrap().boxes(256), boxes);
}

#[test]
fn nothing_drawn_needs_no_box() {
    let empty = Scene::default();
    let tracer = Tracer::new(&empty).unwrap();
    for limit in LIMITS {
        assert_eq!(tracer.boxes(limit), []);
    }
}

/// The same hall as one mesh and as instances of one wall. The more boxes there are, the less empty
/// space they hold.
#[test]
fn more_boxes_hold_less_air() {
    let wall = |x: f32| sheet(Vec3::new(x, 0.0, -20.0), Vec3::Y * 5.0, Vec3::Z * 40.0);
    let walls = (0..40).map(|i| wall(2.0 * i as f32));
    let corners =
        |w: Mesh| w.triangles.into_iter().map(move |t| t.map(|i| w.positions[i as usize]));
    let joined = soup(&walls.flat_map(corners).collect::<Vec<_>>());
    let one_mesh = scene(vec![joined], &[(0, DAffine3::IDENTITY)]);
    let places: Vec<_> = (0..40).map(|i| (0, at(2.0 * f64::from(i), 0.0, 0.0))).collect();
    let instances = scene(vec![wall(0.0)], &places);
    for hall in [one_mesh, instances] {
        let tracer = Tracer::new(&hall).unwrap();
        let volume = |limit| -> f64 {
            tracer.boxes(limit).iter().map(|b| b.size()).map(|s| s.x * s.y * s.z).sum()
        };
        let volumes = [1, 2, 5, 10, 20, 80].map(volume);
        assert!((volumes[0] / (78.0 * 5.0 * 40.0) - 1.0).abs() < 1e-3, "{volumes:?}");
        // Each further box removes the empty space between two walls, 2 m of the 78 m. With one box
        // for each triangle, no empty space is left.
        for (boxes, volume) in [2, 5, 10, 20, 40].into_iter().zip(&volumes[1..]) {
            let most = f64::from(40 - boxes) * 2.0 * 5.0 * 40.0;
            assert!(*volume <= most + 1.0, "{boxes}: {volumes:?}");
        }
    }
}
