//! Views and suns chosen for scenes that bring none.

use glam::{DAffine3, DVec3, Vec3};
use std::path::Path;
use umbrage::{Camera, Light};
use umbrage_scene::{Instance, Mesh, Scene, SceneCamera, builtin, load};
use umbrage_testing::{needs, third_party_scenes};

fn real(file: &str) -> Scene {
    load(&Path::new(third_party_scenes!()).join(file)).unwrap_or_else(|e| panic!("{e}"))
}

fn camera(view: &SceneCamera) -> Camera {
    view.camera([1280, 720]).unwrap()
}

fn sun_elevation_deg(scene: &Scene) -> f64 {
    let Light::Directional { direction } = scene.default_light().light else { panic!("not a sun") };
    (-direction.normalize().y).asin().to_degrees()
}

#[needs(scenes)]
#[test]
fn objects_are_seen_whole_from_outside() {
    for file in ["dragon/dragon_res4.glb", "vehicles/airplane_pyvista.glb", "characters/Fox.glb"] {
        assert_seen_whole(file, &real(file));
    }
}

/// A sphere without its ground, and a statue.
#[test]
fn built_in_objects_are_seen_whole_from_outside() {
    for name in ["sphere", "statues"] {
        let mut scene = bare(name);
        let largest = |i: &Instance| scene.meshes[i.mesh].triangles.len();
        let object = scene.instances.iter().copied().max_by_key(largest).unwrap();
        scene.instances = vec![object];
        assert_seen_whole(name, &scene);
    }
}

fn assert_seen_whole(file: &str, scene: &Scene) {
    let (view, bounds) = (scene.default_view(), scene.bounds());
    let camera = camera(&view);
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for i in &scene.instances {
        for p in &scene.meshes[i.mesh].positions {
            let p = i.world_from_mesh.transform_point3(p.as_dvec3());
            let depth = camera.depth(p);
            assert!(view.near < depth && depth < view.far, "{file}: {depth} {view:?}");
            let pixel = camera.pixel(p).unwrap();
            lo = [lo[0].min(pixel.x), lo[1].min(pixel.y)];
            hi = [hi[0].max(pixel.x), hi[1].max(pixel.y)];
        }
    }
    assert!(lo[0] > 0.0 && lo[1] > 0.0 && hi[0] < 1280.0 && hi[1] < 720.0, "{file}: {lo:?} {hi:?}");
    // And not as a speck.
    assert!(hi[0] - lo[0] > 800.0 || hi[1] - lo[1] > 450.0, "{file}: {lo:?} {hi:?}");
    assert!(view.eye.y > bounds.min.y, "{file}: from below");
    assert!((sun_elevation_deg(scene) - 45.0).abs() < 1e-6, "{file}");
}

#[needs(scenes)]
#[test]
fn rooms_are_seen_from_inside() {
    for file in ["lattice/barn_skylight.glb", "atrium/sponza_atrium_reduced.glb"] {
        assert_inside(file, &real(file));
    }
}

#[test]
fn a_built_in_room_is_seen_from_inside() {
    assert_inside("lantern", &bare("lantern"));
}

fn assert_inside(file: &str, scene: &Scene) {
    let (eye, b) = (scene.default_view().eye, scene.bounds());
    assert!(eye.cmpgt(b.min).all() && eye.cmplt(b.max).all(), "{file}: {eye} {b:?}");
}

#[needs(scenes)]
#[test]
fn worlds_are_stood_in_near_their_ground() {
    for file in [
        "vehicles/kenney_racing_level.glb",
        "dragon/dragons25_res3.glb",
        "trees/forest_eztree.glb",
        "city/delft_city.glb",
        "city/kenney_city_40x40.glb",
        "terrain/jacksboro_dem_terrain.glb",
    ] {
        assert_stood_in(file, &real(file));
    }
}

#[test]
fn built_in_worlds_are_stood_in_near_their_ground() {
    for name in ["town", "airfield", "statues"] {
        assert_stood_in(name, &bare(name));
    }
}

fn assert_stood_in(file: &str, scene: &Scene) {
    let (view, b) = (scene.default_view(), scene.bounds());
    let inside = view.eye.cmpgt(b.min) & view.eye.cmplt(b.max);
    assert!(inside.x && inside.z, "{file}: {view:?} {b:?}");
    assert!(view.eye.y < b.min.y + 1.3 * b.size().y, "{file}: {view:?}");
    assert!(view.far / view.near <= 1000.0 + 1e-6, "{file}: {view:?}");
    camera(&view);
}

#[needs(scenes)]
#[test]
fn gentle_land_gets_a_low_sun_and_a_scene_its_own_light() {
    assert!(sun_elevation_deg(&real("terrain/jacksboro_dem_terrain.glb")) < 26.0);
    let barn = real("lattice/barn_skylight.glb");
    assert_eq!(barn.default_light(), barn.lights[0]);
}

/// Hills of 4 m in a square of 200 m.
#[test]
fn hills_get_a_low_sun() {
    let mut scene = bare("pole");
    let height = |x: f32, z: f32| 4.0 * (x / 30.0).sin() * (z / 40.0).cos();
    let side = 0..=100u16;
    let points = side
        .clone()
        .flat_map(|i| side.clone().map(move |k| [i, k].map(|c| 2.0 * f32::from(c) - 100.0)));
    let quads = (0..100u32).flat_map(|i| (0..100).map(move |k| 101 * i + k));
    scene.meshes = vec![Mesh {
        positions: points.map(|[x, z]| Vec3::new(x, height(x, z), z)).collect(),
        normals: vec![Vec3::Y; 101 * 101],
        triangles: quads.flat_map(|a| [[a, a + 1, a + 101], [a + 1, a + 102, a + 101]]).collect(),
        ..Mesh::default()
    }];
    scene.instances = vec![Instance { mesh: 0, world_from_mesh: DAffine3::IDENTITY }];
    assert!(sun_elevation_deg(&scene) < 26.0, "{}", sun_elevation_deg(&scene));
}

/// A built-in scene without its camera and light.
fn bare(name: &str) -> Scene {
    let mut scene = builtin(name, None).unwrap();
    scene.cameras.clear();
    scene.lights.clear();
    scene
}

/// A built-in world without its camera and sun, moved.
fn moved(world_from_scene: DAffine3) -> Scene {
    let mut scene = builtin("statues", Some(3)).unwrap();
    scene.cameras.clear();
    scene.lights.clear();
    for i in &mut scene.instances {
        i.world_from_mesh = world_from_scene * i.world_from_mesh;
    }
    scene
}

#[test]
fn views_scale_and_move_with_their_scene() {
    let reference = moved(DAffine3::IDENTITY).default_view();
    for (scale, offset) in [(1e-3, 0.0), (1.0, 1e5), (1e4, -3e6)] {
        let to = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            glam::DQuat::IDENTITY,
            DVec3::splat(offset),
        );
        let view = moved(to).default_view();
        let expected = to.transform_point3(reference.eye);
        assert!((view.eye - expected).length() < 0.2 * scale, "{scale}, {offset}: {view:?}");
        assert!((view.far / scale - reference.far).abs() < 0.2, "{scale}, {offset}: {view:?}");
    }
}

#[test]
fn scenes_of_nothing_or_of_a_point_get_a_valid_view_and_sun() {
    let mut empty = Scene::default();
    let mut point = moved(DAffine3::IDENTITY);
    for mesh in &mut point.meshes {
        mesh.positions.fill(glam::Vec3::ONE);
    }
    point.instances.truncate(1);
    let flat = {
        let mut scene = builtin("slit", None).unwrap();
        scene.instances.truncate(1);
        scene.cameras.clear();
        scene.lights.clear();
        scene
    };
    empty.name = "empty".into();
    for scene in [empty, point, flat] {
        camera(&scene.default_view());
        let light = scene.default_light().light;
        assert!(light.direction_to_light(DVec3::ZERO).y > 0.0, "{}: {light:?}", scene.name);
    }
}

/// The nearest depth against the depths of many points on the same triangles.
#[test]
fn the_nearest_depth_is_that_of_the_nearest_point_in_view() {
    let mut random = 1u64;
    let mut next = move || {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 40) as f64 / (1 << 24) as f64
    };
    let mut found = 0;
    for _ in 0..60 {
        let mut vector = |reach: f64| DVec3::from_array([0.0; 3].map(|_| (next() - 0.5) * reach));
        let look_at = umbrage::LookAt {
            eye: vector(4.0),
            target: vector(4.0),
            up: DVec3::Y,
            fov_y_rad: 0.9,
            near: 0.1,
            far: 100.0,
            image: [64, 36],
        };
        let camera = Camera::look_at(look_at).unwrap();
        let mut scene = bare("pole");
        scene.instances.truncate(1);
        let positions: Vec<Vec3> = (0..12)
            .flat_map(|_| {
                let middle = vector(12.0);
                [(); 3].map(|()| (middle + vector(3.0)).as_vec3())
            })
            .collect();
        let corner = |i: u32| positions[i as usize].as_dvec3();
        let triangles: Vec<[u32; 3]> = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut expected = f64::INFINITY;
        const STEPS: u32 = 60;
        for t in &triangles {
            let [a, b, c] = t.map(corner);
            for i in 0..=STEPS {
                for j in 0..=STEPS - i {
                    let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
                    let p = a + (b - a) * u + (c - a) * v;
                    let in_view = camera.pixel(p).is_some_and(|p| {
                        (0.0..=64.0).contains(&p.x) && (0.0..=36.0).contains(&p.y)
                    });
                    if in_view && camera.depth(p) > 0.0 {
                        expected = expected.min(camera.depth(p));
                    }
                }
            }
        }
        let to_world = DAffine3::from_translation(DVec3::ZERO);
        scene.instances[0] = Instance { mesh: 0, world_from_mesh: to_world };
        scene.meshes[0] = Mesh { positions, triangles, ..Mesh::default() };
        match scene.nearest_depth(&camera) {
            None => assert_eq!(expected, f64::INFINITY),
            Some(nearest) => {
                assert!(nearest <= expected, "{nearest} {expected}");
                // Points lie within a twentieth of a triangle's edge of any other.
                let is_close = nearest + 0.3 > expected || expected == f64::INFINITY;
                assert!(is_close, "{nearest} {expected}");
                found += 1;
            }
        }
    }
    assert!(found > 20, "{found}");
}

/// Of a million boxes each is far smaller than what a view is composed of, and all count together.
#[test]
fn crowds_of_small_instances_are_composed_like_the_ground_they_cover() {
    let mut scene = bare("pole");
    let cube = scene.instances.iter().min_by_key(|i| scene.meshes[i.mesh].triangles.len());
    let mesh = cube.unwrap().mesh;
    let size = scene.meshes[mesh].bounds().size();
    let side = 700;
    scene.instances = (0..side * side)
        .map(|i| {
            let at = DVec3::new(f64::from(i % side), 0.0, f64::from(i / side));
            let world_from_mesh = DAffine3::from_scale_rotation_translation(
                0.5 / size.max(DVec3::splat(1e-9)),
                glam::DQuat::IDENTITY,
                at,
            );
            Instance { mesh, world_from_mesh }
        })
        .collect();
    let (view, light) = scene.default_view_and_light();
    assert_eq!(light, scene.light_for_view(&view));
    let bounds = scene.bounds();
    assert!(view.eye.clamp(bounds.min, bounds.max).distance(view.eye) < 0.2 * f64::from(side));
    assert!(view.target.y < view.eye.y, "{view:?}");
}
