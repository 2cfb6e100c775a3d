//! Rays find exactly the triangles that are there, in agreement with a brute-force search.

mod common;

use common::{Random, all_hits, at, ground, scene, sheet, soup, sphere};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec2, Vec3};
use proptest::prelude::*;
use umbrage_scene::{Alpha, Instance, Sampling, Scene, Texture, TextureId};
use umbrage_trace::{Error, Ray, Tracer};

const EVERYWHERE: [f64; 2] = [0.0, f64::INFINITY];

/// Compares the hierarchy with a brute-force search for one ray. Returns `false` if rounding could
/// decide either way.
fn agrees(tracer: &Tracer<'_>, ray: Ray, tolerance: f64) -> Result<bool, TestCaseError> {
    let hits = all_hits(tracer.scene(), ray);
    let found = tracer.closest(ray, EVERYWHERE);
    let first_is_clear = match hits[..] {
        [] => true,
        [only] => only.2 > 1e-6,
        [first, second, ..] => first.2 > 1e-6 && second.0 - first.0 > tolerance * second.0,
    };
    if !first_is_clear {
        return Ok(false);
    }
    prop_assert_eq!(found.map(|h| h.primitive), hits.first().map(|h| h.1));
    prop_assert_eq!(tracer.occluded(ray, EVERYWHERE), !hits.is_empty());
    if let (Some(hit), Some(&(t, ..))) = (found, hits.first()) {
        prop_assert!((hit.t - t).abs() <= tolerance * t, "{} or {t}", hit.t);
        let along = ray.origin + ray.direction * hit.t;
        let error = tracer.position(&hit).distance(along);
        prop_assert!(error <= tolerance * (along.length() + t * ray.direction.length()));
        // Any-hit queries over ranges that begin and end around the first hit.
        prop_assert!(!tracer.occluded(ray, [0.0, t * (1.0 - tolerance)]));
        prop_assert!(tracer.occluded(ray, [0.0, t * (1.0 + tolerance)]));
    }
    Ok(true)
}

/// A triangle soup in one of several styles, at a scale from millimetres to thousands of
/// kilometres.
fn random_soup(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let scale = 10f64.powf(random.between(-3.0, 6.0));
    let size = scale * 10f64.powf(random.between(-2.0, 0.0));
    let far_off = if random.unit() < 0.3 { 100.0 } else { 0.0 };
    let offset = random.vector(scale * far_off);
    let style = (random.unit() * 3.0) as u32;
    (0..count)
        .map(|_| {
            let center = offset + random.vector(scale);
            [0; 3].map(|_| {
                let mut corner = center + random.vector(size);
                match style {
                    0 => {}
                    // All triangles lie in axis-aligned planes, so that boxes have no thickness.
                    1 => corner.y = (corner.y / scale).round() * scale,
                    // All corners lie on a coarse lattice, so that triangles share corners, edges
                    // and planes.
                    _ => corner = (corner / size).round() * size,
                }
                corner.as_vec3()
            })
        })
        .collect()
}

fn random_transform(random: &mut Random) -> DAffine3 {
    let rotation = DMat3::from_quat(DQuat::from_axis_angle(
        random.direction(),
        random.between(0.0, std::f64::consts::TAU),
    ));
    let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
    let scale = DVec3::new(
        sign * random.between(0.2, 3.0),
        random.between(0.2, 3.0),
        random.between(0.2, 3.0),
    );
    DAffine3::from_mat3_translation(rotation * DMat3::from_diagonal(scale), random.vector(10.0))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn trees_and_brute_force_agree_on_soups(seed: u64, count in 1usize..200) {
        let mut random = Random(seed);
        let triangles = random_soup(&mut random, count);
        let scene = scene(vec![soup(&triangles)], &[(0, DAffine3::IDENTITY)]);
        let tracer = Tracer::new(&scene).unwrap();
        let bounds = tracer.bounds();
        let mut clear = 0;
        for i in 0..60 {
            // Rays aim at a random point of the bounds, from outside, from inside, or along an
            // axis.
            let target = bounds.min + bounds.size() * (random.vector(0.5) + 0.5);
            let origin = bounds.center() + random.direction() * bounds.size().length() * random.between(0.0, 3.0);
            let ray = match i % 3 {
                0 => Ray { origin, direction: target - origin },
                1 => Ray { origin, direction: (target - origin).normalize() * 1e-3 },
                _ => {
                    let axis = DVec3::AXES[i % 9 / 3];
                    Ray { origin: target - axis * bounds.size().length(), direction: axis * 7.0 }
                }
            };
            if ray.direction.length() > 0.0 {
                clear += usize::from(agrees(&tracer, ray, 1e-9)?);
            }
        }
        prop_assert!(clear > 20, "only {clear} rays had a clear answer");
    }

    #[test]
    fn trees_and_brute_force_agree_on_instances(seed: u64) {
        let mut random = Random(seed);
        let meshes: Vec<_> = (0..3).map(|_| {
            let corner = |r: &mut Random| r.vector(1.0).as_vec3();
            let triangles: Vec<_> = (0..20).map(|_| [0; 3].map(|_| corner(&mut random))).collect();
            soup(&triangles)
        }).collect();
        let places: Vec<_> = (0..12).map(|i| (i % 3, random_transform(&mut random))).collect();
        let scene = scene(meshes, &places);
        let tracer = Tracer::new(&scene).unwrap();
        for _ in 0..60 {
            let origin = random.vector(25.0);
            agrees(&tracer, Ray { origin, direction: random.vector(10.0) - origin }, 1e-9)?;
        }
    }
}

#[test]
fn instances_equal_their_flattened_mesh() {
    // Powers of two, quarter turns and small integers, so that flattening rounds nothing.
    let mut mesh = sphere(Vec3::ZERO, 1.0, 12);
    mesh.positions.iter_mut().for_each(|p| *p = (*p * 65536.0).round() / 65536.0);
    let turn = DMat3::from_cols(DVec3::Z, DVec3::Y, -DVec3::X);
    let place = |i: i32, j: i32| {
        let scale = DMat3::from_diagonal(DVec3::new(0.5, if i % 2 == 0 { 1.0 } else { -2.0 }, 0.5));
        DAffine3::from_mat3_translation(
            turn * scale,
            DVec3::new(f64::from(2 * i), 0.0, f64::from(3 * j)),
        )
    };
    let places: Vec<_> = (0..16).map(|i| (0, place(i % 4, i / 4))).collect();
    let instanced = scene(vec![mesh.clone()], &places);
    let mut flat = umbrage_scene::Mesh::default();
    for (_, world_from_mesh) in &places {
        let first = flat.positions.len() as u32;
        let moved = |p: &Vec3| world_from_mesh.transform_point3(p.as_dvec3()).as_vec3();
        flat.positions.extend(mesh.positions.iter().map(moved));
        flat.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    let flattened = scene(vec![flat], &[(0, DAffine3::IDENTITY)]);
    let (instanced, flattened) =
        (Tracer::new(&instanced).unwrap(), Tracer::new(&flattened).unwrap());
    let mut random = Random(7);
    let mut hits = 0;
    for _ in 0..20_000 {
        let origin = DVec3::new(3.0, 8.0, 4.0) + random.vector(6.0);
        let direction = DVec3::new(3.0, 0.0, 4.0) + random.vector(7.0) - origin;
        let ray = Ray { origin, direction };
        let [a, b] = [&instanced, &flattened].map(|t| t.closest(ray, EVERYWHERE));
        assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
        let (Some(a), Some(b)) = (a, b) else { continue };
        hits += 1;
        let (pa, pb) = (instanced.position(&a), flattened.position(&b));
        assert!(pa.distance(pb) < 1e-12, "{pa} {pb}");
        let (na, nb) = (instanced.surface(&a, direction), flattened.surface(&b, direction));
        let tolerance = 1e-12;
        let same_triangle = a.primitive.instance * mesh.triangles.len() as u32
            + a.primitive.triangle
            == b.primitive.triangle;
        assert!(!same_triangle || na.geometric_normal.distance(nb.geometric_normal) < tolerance);
    }
    assert!(hits > 2000, "only {hits} hits");
}

#[test]
fn a_mesh_drawn_often_is_stored_once() {
    // 5 million triangles are drawn. Copies of them would take gigabytes and minutes.
    let place = |i| at(f64::from(i % 20) * 3.0, 0.0, f64::from(i / 20) * 3.0);
    let places: Vec<_> = (0..400).map(|i| (0, place(i))).collect();
    let scene = scene(vec![sphere(Vec3::ZERO, 1.0, 56)], &places);
    assert!(scene.drawn_triangles() > 4_900_000);
    let tracer = Tracer::new(&scene).unwrap();
    let surface = common::below(&tracer, DVec3::new(57.1, 10.0, 57.1));
    assert_eq!(surface.primitive.instance, 399);
}

#[test]
fn closed_meshes_are_watertight() {
    // Every ray from inside must hit, also rays aimed exactly at corners and along edges.
    for (radius, center) in [(1.0, Vec3::ZERO), (3e4, Vec3::new(1e5, 0.0, 7.0)), (1e-3, Vec3::X)] {
        let mesh = sphere(center, radius, 40);
        let scene = scene(vec![mesh.clone()], &[(0, DAffine3::IDENTITY)]);
        let tracer = Tracer::new(&scene).unwrap();
        let mut random = Random(3);
        let escapes = |origin: DVec3, target: DVec3| {
            let ray = Ray { origin, direction: target - origin };
            tracer.closest(ray, EVERYWHERE).is_none() || !tracer.occluded(ray, EVERYWHERE)
        };
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
            let inside = center.as_dvec3() + random.vector(0.4 * f64::from(radius));
            for origin in [center.as_dvec3(), inside] {
                let weight = random.unit();
                for target in [a, b, c, a.midpoint(b), b.lerp(c, weight), (a + b + c) / 3.0] {
                    assert!(!escapes(origin, target), "{origin} to {target}, radius {radius}");
                }
            }
        }
    }
}

#[test]
fn grid_lines_are_watertight() {
    // Rays run along the axes through the lattice points of a flat, finely divided sheet.
    let n = 32;
    let corner = |i: u32, j: u32| Vec3::new(i as f32 * 0.1, 0.0, j as f32 * 0.1);
    let mut mesh = umbrage_scene::Mesh::default();
    for j in 0..=n {
        mesh.positions.extend((0..=n).map(|i| corner(i, j)));
    }
    for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
        let a = j * (n + 1) + i;
        mesh.triangles.extend([[a, a + n + 1, a + n + 2], [a, a + n + 2, a + 1]]);
    }
    let scene = scene(vec![mesh.clone()], &[(0, at(1e5, 0.0, -1e5))]);
    let tracer = Tracer::new(&scene).unwrap();
    for p in &mesh.positions {
        let inner = p.x > 0.0 && p.z > 0.0 && p.x < 3.2 && p.z < 3.2;
        let above = p.as_dvec3() + DVec3::new(1e5, 1.0, -1e5);
        for direction in [-DVec3::Y, DVec3::new(0.0, -1.0, 0.2), DVec3::new(0.1, -1.0, 0.1)] {
            let origin = above - direction - DVec3::Y;
            let ray = Ray { origin, direction };
            assert!(!inner || tracer.occluded(ray, EVERYWHERE), "{origin}");
        }
    }
}

#[test]
fn masks_cut_holes() {
    // The left half is opaque and the right half transparent, both to the eye and to light.
    let mut scene = scene(vec![sheet(Vec3::ZERO, Vec3::X, Vec3::Z)], &[(0, at(5.0, 1.0, 0.0))]);
    scene.textures.push(Texture {
        size: [2, 1],
        rgba: vec![[255, 0, 0, 255], [0, 255, 0, 0]],
        ..Texture::default()
    });
    scene.materials[0].alpha = Alpha::Mask { cutoff: 0.5 };
    scene.materials[0].base_color_texture = Some(TextureId(0));
    let ray = |x: f64| Ray { origin: DVec3::new(x, 3.0, 0.4), direction: -DVec3::Y };
    let is_there = |tracer: &Tracer<'_>, x: f64| {
        let [hit, occluded] =
            [tracer.closest(ray(x), EVERYWHERE).is_some(), tracer.occluded(ray(x), EVERYWHERE)];
        assert_eq!(hit, occluded);
        hit
    };
    let tracer = Tracer::new(&scene).unwrap();
    assert!(is_there(&tracer, 5.3) && !is_there(&tracer, 5.7));
    let color = common::below(&tracer, DVec3::new(5.2, 3.0, 0.4)).base_color;
    assert!(color.x > 0.7 && color.y < 0.1, "{color}");
    let tracer = tracer.opaque(true);
    assert!(is_there(&tracer, 5.3) && is_there(&tracer, 5.7));

    // Surfaces behind a hole are seen through the hole.
    let mut below = ground(10.0);
    below.material = 1;
    scene.materials.push(common::plain());
    scene.meshes.push(below);
    scene.instances.push(Instance { mesh: 1, world_from_mesh: DAffine3::IDENTITY });
    let tracer = Tracer::new(&scene).unwrap();
    assert_eq!(common::below(&tracer, DVec3::new(5.7, 3.0, 0.4)).primitive.instance, 1);
    assert_eq!(common::below(&tracer, DVec3::new(5.3, 3.0, 0.4)).primitive.instance, 0);
    // Without texture coordinates, the factor alone decides.
    scene.meshes[0].uvs = Vec::new();
    scene.materials[0].base_color.w = 0.4;
    let tracer = Tracer::new(&scene).unwrap();
    assert_eq!(common::below(&tracer, DVec3::new(5.3, 3.0, 0.4)).primitive.instance, 1);
    assert_eq!(common::below(&tracer, DVec3::new(5.3, 3.0, 0.4)).uv, Vec2::new(0.52, 0.765));
}

/// A texture of few pixels, sampled to the nearest, cuts the same shape as triangles do.
#[test]
fn nearest_pixels_are_exact_rectangles() {
    const N: u32 = 4;
    let is_solid = |x: u32, y: u32| (x * 5 + y * 3) % 7 > 3;
    let pixels = || (0..N * N).map(|i| (i % N, i / N));
    let mut cut = scene(vec![sheet(Vec3::ZERO, Vec3::X, Vec3::Z)], &[(0, at(5.0, 1.0, 0.0))]);
    cut.textures.push(Texture {
        size: [N, N],
        rgba: pixels().map(|(x, y)| [255, 255, 255, 255 * u8::from(is_solid(x, y))]).collect(),
        sampling: Sampling::Nearest,
        ..Texture::default()
    });
    cut.materials[0].alpha = Alpha::Mask { cutoff: 0.5 };
    cut.materials[0].base_color_texture = Some(TextureId(0));
    let side = 1.0 / N as f32;
    let square =
        |(x, y)| sheet(Vec3::new(x as f32, 0.0, y as f32) * side, Vec3::X * side, Vec3::Z * side);
    let squares: Vec<_> = pixels().filter(|&(x, y)| is_solid(x, y)).map(square).collect();
    let places: Vec<_> = (0..squares.len()).map(|i| (i, at(5.0, 1.0, 0.0))).collect();
    let solid = scene(squares, &places);
    let [cut, solid] = [&cut, &solid].map(|scene| Tracer::new(scene).unwrap());
    let mut random = Random(4);
    let mut hits = 0;
    for _ in 0..2000 {
        let [u, v] = [random.between(-0.2, 1.2), random.between(-0.2, 1.2)];
        let direction = DVec3::new(random.between(-1.0, 1.0), -1.0, random.between(-1.0, 1.0));
        let ray = Ray { origin: DVec3::new(5.0 + u, 1.0, v) - direction, direction };
        let found = [&cut, &solid].map(|t| t.closest(ray, EVERYWHERE).map(|hit| hit.t as f32));
        assert_eq!(found[0], found[1], "{u} {v}");
        assert_eq!(cut.occluded(ray, EVERYWHERE), found[1].is_some());
        hits += usize::from(found[1].is_some());
    }
    assert!((400..1200).contains(&hits), "{hits}");
}

/// The alpha of the vertices is interpolated, and multiplies that of factor and texture.
#[test]
fn vertices_cut_holes() {
    let mut scene = scene(vec![sheet(Vec3::ZERO, Vec3::X, Vec3::Z)], &[(0, at(0.0, 1.0, 0.0))]);
    let is_there = |scene: &Scene, x: f64, z: f64| {
        let ray = Ray { origin: DVec3::new(x, 3.0, z), direction: -DVec3::Y };
        Tracer::new(scene).unwrap().occluded(ray, EVERYWHERE)
    };
    // Alpha is x.
    scene.meshes[0].alphas = vec![0.0, 1.0, 1.0, 0.0];
    assert!(is_there(&scene, 0.1, 0.3), "opaque materials have no alpha");
    scene.materials[0].alpha = Alpha::Mask { cutoff: 0.5 };
    for z in [0.2, 0.9] {
        assert!(is_there(&scene, 0.51, z) && !is_there(&scene, 0.49, z));
    }
    scene.materials[0].base_color.w = 0.6;
    assert!(is_there(&scene, 0.84, 0.3) && !is_there(&scene, 0.83, 0.3));
    // An alpha that equals the cutoff everywhere leaves no hole.
    scene.materials[0].base_color.w = 1.0;
    scene.materials[0].alpha = Alpha::Mask { cutoff: 0.3 };
    scene.meshes[0].alphas = vec![0.3; 4];
    for i in 0..100 {
        assert!(is_there(&scene, 0.005 + 0.0099 * f64::from(i), 0.37), "{i}");
    }
    // A cutoff above 1 leaves nothing.
    scene.materials[0].alpha = Alpha::Mask { cutoff: 1.5 };
    scene.meshes[0].alphas = Vec::new();
    assert!(!is_there(&scene, 0.5, 0.3));
}

#[test]
fn empty_and_degenerate_scenes_have_no_hits() {
    let ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };
    let collinear = [Vec3::new(1.0, -1.1, 0.3), Vec3::new(1.0, 0.0, 0.3), Vec3::new(1.0, 1.1, 0.3)];
    let point = [Vec3::X; 3];
    for meshes in
        [vec![], vec![umbrage_scene::Mesh::default()], vec![soup(&[collinear, point, point])]]
    {
        let places: Vec<_> = (0..meshes.len()).map(|i| (i, DAffine3::IDENTITY)).collect();
        let scene = scene(meshes, &places);
        let tracer = Tracer::new(&scene).unwrap();
        assert_eq!(tracer.closest(ray, [f64::NEG_INFINITY, f64::INFINITY]), None);
        assert!(!tracer.occluded(ray, EVERYWHERE));
    }
}

#[test]
fn rays_that_are_none_hit_nothing() {
    let scene = scene(vec![ground(1.0)], &[(0, DAffine3::IDENTITY)]);
    let tracer = Tracer::new(&scene).unwrap();
    let up = DVec3::new(0.1, 1.0, 0.2);
    for (origin, direction, range) in [
        (up, DVec3::ZERO, EVERYWHERE),
        (up, DVec3::NAN, EVERYWHERE),
        (DVec3::INFINITY, -DVec3::Y, EVERYWHERE),
        (up, -DVec3::Y, [f64::NAN, 2.0]),
        (up, -DVec3::Y, [2.0, 0.5]),
        (up, -DVec3::Y, [0.0, 1.0]),
    ] {
        assert_eq!(tracer.closest(Ray { origin, direction }, range), None);
    }
    let ray = Ray { origin: up, direction: -DVec3::Y };
    assert_eq!(tracer.closest(ray, [1.0, 1.5]).map(|h| h.t), Some(1.0));
    // Directions may be extremely short or long.
    for scale in [1e-200, 1e200] {
        let ray = Ray { origin: up, direction: -DVec3::Y * scale };
        let hit = tracer.closest(ray, EVERYWHERE).unwrap();
        assert!((hit.t * scale - 1.0).abs() < 1e-12, "{hit:?}");
    }
    // A triangle is hit from either side, and also backwards along an unbounded line.
    let from_below = Ray { origin: -up, direction: DVec3::Y };
    assert!(tracer.occluded(from_below, EVERYWHERE));
    let above = Ray { origin: up, direction: DVec3::Y };
    assert!(tracer.occluded(above, [f64::NEG_INFINITY, f64::INFINITY]));
}

#[test]
fn broken_scenes_are_named() {
    let good = || scene(vec![ground(1.0)], &[(0, DAffine3::IDENTITY)]);
    type Breakage = fn(&mut Scene);
    let cases: [(&str, Breakage); 9] = [
        ("meshes[0].positions[2]", |s| s.meshes[0].positions[2].y = f32::NAN),
        ("meshes[0].triangles[1]", |s| s.meshes[0].triangles[1] = [0, 1, 4]),
        ("meshes[0].normals", |s| s.meshes[0].normals.truncate(2)),
        ("meshes[0].material", |s| s.meshes[0].material = 9),
        ("instances[0].mesh", |s| s.instances[0].mesh = 1),
        ("instances[0].world_from_mesh", |s| s.instances[0].world_from_mesh = DAffine3::ZERO),
        ("instances[0].world_from_mesh", |s| {
            s.instances[0].world_from_mesh = DAffine3::from_scale(DVec3::new(1e-200, 1.0, 1.0));
        }),
        ("instances[0]", |s| s.instances[0].world_from_mesh.translation.x = 1e13),
        ("materials[0].base_color_texture", |s| {
            s.materials[0].base_color_texture = Some(TextureId(0));
        }),
    ];
    for (expected, break_it) in cases {
        let mut scene = good();
        break_it(&mut scene);
        match Tracer::new(&scene).err() {
            Some(Error::Scene { place, .. }) => assert_eq!(place, expected),
            other => panic!("{expected}: {other:?}"),
        }
    }
}
