//! Truth and reference where rounding could decide: lamps in the planes of triangles, and
//! coordinates far from the origin.

mod common;

use common::{Random, camera, false_shadows, ground, nobody, plan, scene, sheet, sphere};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use umbrage::{Light, PointLight, Size, SpotLight, Technique, Warp};
use umbrage_scene::{Mesh, Scene, SceneCamera, builtin};
use umbrage_trace::{Reference, Tracer, View};

const IMAGE: [u32; 2] = [96, 72];

/// The walls and the top of a block that stands on the ground.
fn block(corner: Vec3, size: Vec3) -> Vec<Mesh> {
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let walls = [(corner, x), (corner + z, x), (corner, z), (corner + x, z)];
    let walls = walls.map(|(from, along)| sheet(from, along, y));
    walls.into_iter().chain([sheet(corner + y, x, z)]).collect()
}

/// A ground with two blocks of whole metres.
fn yard() -> Vec<Mesh> {
    let blocks = [
        block(Vec3::new(1.0, 0.0, -2.0), Vec3::new(1.0, 2.0, 1.0)),
        block(Vec3::new(-3.0, 0.0, 1.0), Vec3::new(2.0, 1.0, 1.0)),
    ];
    std::iter::once(ground(8.0)).chain(blocks.into_iter().flatten()).collect()
}

/// The meshes with all corners moved, which rounds them.
fn moved(meshes: Vec<Mesh>, world_from_mesh: DAffine3) -> Scene {
    let moved = |p: &Vec3| world_from_mesh.transform_point3(p.as_dvec3()).as_vec3();
    let bake = |mesh: Mesh| Mesh { positions: mesh.positions.iter().map(moved).collect(), ..mesh };
    let places: Vec<_> = (0..meshes.len()).map(|i| (i, DAffine3::IDENTITY)).collect();
    scene(meshes.into_iter().map(bake).collect(), &places)
}

/// True visibility of the pixels that count, and that of an executed plan; `None` elsewhere.
fn pictures(view: &View<'_>) -> [Vec<Option<f32>>; 2] {
    let tracer = view.tracer();
    let size = Size::Budget(200 * 200);
    let technique = Technique { warp: Warp::Uniform, size, ..Technique::default() };
    let plan = plan(tracer.scene(), view.camera(), *view.light(), &technique);
    let reference = Reference::render(tracer, &plan, &nobody).unwrap();
    let band = view.band(0..IMAGE[1], &nobody);
    let truth = band.map(|s| s.is_facing.then(|| view.truth(s)), &nobody);
    [truth, band.map(|s| s.is_facing.then(|| reference.visibility(0, s)), &nobody)]
}

/// The share of pixels that count in both pictures and differ.
fn differing(a: &[Option<f32>], b: &[Option<f32>]) -> f64 {
    let both: Vec<_> = a.iter().zip(b).filter_map(|(&a, &b)| Some((a?, b?))).collect();
    assert!(both.len() > 200, "only {} pixels count", both.len());
    both.iter().filter(|(a, b)| (a - b).abs() > 0.5).count() as f64 / both.len() as f64
}

#[test]
fn a_plane_through_a_lamp_hides_nothing() {
    // The lamp's place, the way to move it by 1 mm, and a sheet whose plane holds the lamp: a
    // ceiling with the lamp amid a triangle, at a corner and on an edge; a sheet through the bulb;
    // and the ground itself.
    let ceiling = || sheet(Vec3::new(-4.0, 2.5, -4.0), Vec3::X * 8.0, Vec3::Z * 8.0);
    let hung = || sheet(Vec3::new(0.25, 2.0, -0.5), Vec3::Y, Vec3::Z);
    let cases = [
        (DVec3::new(0.3, 2.5, 0.2), -DVec3::Y, ceiling()),
        (DVec3::new(-4.0, 2.5, -4.0), -DVec3::Y, ceiling()),
        (DVec3::new(1.0, 2.5, 1.0), -DVec3::Y, ceiling()),
        (DVec3::new(0.25, 2.5, 0.25), DVec3::new(0.0, 1.0, 0.0), hung()),
        (DVec3::new(0.5, 0.0, 0.5), DVec3::Y, hung()),
    ];
    let turns =
        [(DVec3::Y, 0.0), (DVec3::new(1.0, 0.7, -0.4), 0.8), (DVec3::new(0.3, 1.0, 2.0), 2.0)];
    for (i, (lamp, away, in_plane)) in cases.into_iter().enumerate() {
        for (axis, angle) in turns {
            let turn = DQuat::from_axis_angle(axis.normalize(), angle);
            // Turned, neither the corners nor the lamp are where they should be in the last digit.
            let offset = if angle == 0.0 { DVec3::ZERO } else { DVec3::new(31.7, 5.3, -18.9) };
            let place = DAffine3::from_rotation_translation(turn, offset);
            let scene = moved(yard().into_iter().chain([in_plane.clone()]).collect(), place);
            let tracer = Tracer::new(&scene).unwrap();
            let to = |p: DVec3| place.transform_point3(p);
            let camera =
                camera(to(DVec3::new(3.5, 1.8, 5.5)), to(DVec3::new(0.0, 0.5, 0.0)), IMAGE);
            for is_spot in [false, true] {
                let light = |position: DVec3| {
                    let position = position.as_vec3().as_dvec3();
                    let [near, range] = [1e-3, 40.0];
                    let direction = turn * DVec3::new(0.1, -1.0, 0.2);
                    let spot = SpotLight { position, direction, half_angle_rad: 1.2, near, range };
                    let point = PointLight { position, near, range };
                    if is_spot { Light::Spot(spot) } else { Light::Point(point) }
                };
                // Of a lamp at the height of the ground, a downward cone lights nothing.
                if is_spot && lamp.y == 0.0 {
                    continue;
                }
                let view = |position| View::new(&tracer, camera, light(position), 1).unwrap();
                let [truth, maps] = pictures(&view(to(lamp)));
                let [beside, beside_maps] = pictures(&view(to(lamp + away * 1e-3)));
                let dark = beside.iter().flatten().filter(|&&v| v < 0.5).count();
                assert!(dark > 20, "case {i}: {dark} pixels in shadow");
                let [moved, mapped] = [differing(&truth, &beside), differing(&truth, &maps)];
                // The ceiling counts only beside the lamp.
                let both = beside.iter().zip(&truth).map(|(b, t)| t.and(*b)).collect::<Vec<_>>();
                let mapped_beside = differing(&both, &beside_maps);
                assert!(moved < 0.01, "case {i}, turned by {angle}, spot {is_spot}: {moved}");
                assert!(
                    mapped < mapped_beside + 0.03,
                    "case {i}, turned by {angle}, spot {is_spot}: {mapped}, not {mapped_beside}"
                );
            }
        }
    }
}

#[test]
fn a_housing_casts_however_near_to_the_lamp() {
    // Closed bulbs around a lamp leave no light, from 4 µm wide to 400 km.
    let mut random = Random(77);
    for exponent in -3..=8 {
        let scale = 10f64.powi(exponent);
        let lamp = random.vector(3.0 * scale).as_vec3().as_dvec3();
        let bulb = sphere(lamp.as_vec3(), 4e-3 * scale as f32, 6);
        let mut floor = ground(8.0 * scale as f32);
        floor.positions.iter_mut().for_each(|p| p.y -= 4.0 * scale as f32);
        let scene = scene(vec![bulb, floor], &[(0, DAffine3::IDENTITY), (1, DAffine3::IDENTITY)]);
        let tracer = Tracer::new(&scene).unwrap();
        for _ in 0..300 {
            let at = random.in_square(7.9 * scale);
            let below = DVec3::new(at.x, -5.0 * scale, at.y);
            let surface = common::towards(&tracer, below, DVec3::Y);
            assert!(tracer.hidden_from_lamp(&surface, lamp), "{scale} m: {surface:?}");
        }
    }
}

#[test]
fn a_scene_has_the_same_shadows_far_from_the_origin() {
    let sun = Light::Directional { direction: DVec3::new(-0.5, -1.0, -0.35) };
    let eye = DVec3::new(-7.0, 6.0, -1.0);
    let truth = |scene: &Scene, offset: DVec3| {
        let tracer = Tracer::new(scene).unwrap();
        let camera = camera(eye + offset, DVec3::new(0.0, 0.5, 0.0) + offset, IMAGE);
        let view = View::new(&tracer, camera, sun, 1).unwrap();
        let band = view.band(0..IMAGE[1], &nobody);
        band.map(|s| s.is_facing.then(|| view.truth(s)), &nobody)
    };
    let home = truth(&moved(yard(), DAffine3::IDENTITY), DVec3::ZERO);
    let dark = home.iter().flatten().filter(|&&v| v == 0.0).count();
    assert!(dark > 80, "{dark} pixels in shadow");
    for offset in [
        DVec3::new(2_600_000.0, 0.0, -1_300_000.0),
        DVec3::new(-2_600_000.0, 2_600_000.0, 2_600_000.0),
        DVec3::new(13_487_528.0, 3.0, -3_741_642.0),
        DVec3::new(13_487_528.0, -13_000_000.0, 9_741_642.0),
    ] {
        let in_corners = moved(yard(), DAffine3::from_translation(offset));
        let places: Vec<_> =
            (0..yard().len()).map(|i| (i, DAffine3::from_translation(offset))).collect();
        for (scene, kind) in [(in_corners, "corners"), (scene(yard(), &places), "transforms")] {
            let off = truth(&scene, offset).iter().zip(&home).filter(|(a, b)| a != b).count();
            // Two thousandths of a percent of the pixels.
            assert!(off <= home.len() / 5000, "{off} pixels differ at {offset} in {kind}");
        }
    }
}

#[test]
fn scenes_of_many_parts_have_the_same_shadows_far_from_the_origin() {
    for name in ["contacts", "fence", "statues"] {
        let home = builtin(name, None).unwrap();
        let view_at_home = home.default_view();
        let light = home.default_light().light;
        let truth = |offset: DVec3| {
            let mut scene = home.clone();
            scene.instances.iter_mut().for_each(|i| i.world_from_mesh.translation += offset);
            let tracer = Tracer::new(&scene).unwrap();
            let [eye, target] = [view_at_home.eye, view_at_home.target].map(|p| p + offset);
            let camera = SceneCamera { eye, target, ..view_at_home.clone() }.camera(IMAGE).unwrap();
            let view = View::new(&tracer, camera, light, 1).unwrap();
            let band = view.band(0..IMAGE[1], &nobody);
            band.map(|s| s.is_facing.then(|| view.truth(s)), &nobody)
        };
        let near = truth(DVec3::ZERO);
        assert!(near.iter().flatten().any(|&v| v == 0.0), "{name}");
        for offset in [DVec3::new(2.6e6, 0.0, -1.3e6), DVec3::new(1.3e7, -1.3e7, 2e6)] {
            let off = truth(offset).iter().zip(&near).filter(|(a, b)| a != b).count();
            assert!(off <= near.len() / 5000, "{off} pixels of {name} differ at {offset}");
        }
    }
}

#[test]
fn rounded_corners_do_not_speckle_a_plane() {
    // Two triangles whose corners were rounded to whole metres.
    let mut random = Random(9);
    for _ in 0..8 {
        let tilt = DQuat::from_axis_angle(random.direction(), random.between(0.2, 1.2));
        let offset = random.direction() * 1.3e7;
        let place = DAffine3::from_rotation_translation(tilt, offset);
        let scene = moved(vec![ground(500.0)], place);
        let normal = tilt * DVec3::Y;
        for elevation_deg in [80.0f64, 30.0, 10.0] {
            let (sin, cos) = elevation_deg.to_radians().sin_cos();
            let direction = -(normal * sin + normal.any_orthonormal_vector() * cos);
            let light = Light::Directional { direction };
            let (wrong, all) = false_shadows(&scene, offset + normal * 300.0, offset, light);
            assert!(all > 5000 && wrong == 0, "{wrong} of {all} at {elevation_deg}°");
        }
    }
}
