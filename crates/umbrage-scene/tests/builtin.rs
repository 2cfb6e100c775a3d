//! The built-in scenes have sound geometry, sizes as promised, and shadows as their closed forms
//! say.

use glam::{DVec3, Vec3};
use std::collections::HashSet;
use umbrage::{Aabb, Light};
use umbrage_scene::{BuiltinInfo, Mesh, Scene, SceneError, builtin, builtins, closed_form};

fn small(info: &BuiltinInfo) -> u32 {
    info.default_size.div_ceil(8)
}

#[test]
fn every_scene_is_sound_at_small_and_default_size() {
    for info in builtins() {
        for size in [1, small(info), info.default_size] {
            let scene = builtin(info.name, Some(size)).unwrap();
            assert_sound(&scene, &format!("{} size {size}", info.name));
        }
    }
}

fn assert_sound(scene: &Scene, what: &str) {
    assert!(!scene.cameras.is_empty() && !scene.lights.is_empty(), "{what}: view and sun");
    assert!(scene.notices.is_empty(), "{what}");
    assert!(!scene.instances.is_empty(), "{what}");
    for i in &scene.instances {
        assert!(i.mesh < scene.meshes.len(), "{what}");
        assert!(i.world_from_mesh.is_finite(), "{what}");
        assert!(i.world_from_mesh.matrix3.determinant().abs() > 1e-12, "{what}");
    }
    for (k, m) in scene.meshes.iter().enumerate() {
        let what = format!("{what}, mesh {k} of {}", scene.materials[m.material].name);
        let n = m.positions.len();
        assert!(m.positions.iter().all(|p| p.is_finite()), "{what}");
        assert_eq!(m.normals.len(), n, "{what}");
        assert!(m.normals.iter().all(|p| (p.length() - 1.0).abs() < 1e-4), "{what}: normals");
        assert!(m.uvs.is_empty() || m.uvs.len() == n, "{what}");
        assert!(m.uvs.iter().all(|p| p.is_finite()), "{what}");
        assert!(!m.triangles.is_empty(), "{what}");
        let mut inside_out = 0;
        for t in &m.triangles {
            assert!(t.iter().all(|&i| (i as usize) < n), "{what}");
            let [a, b, c] = t.map(|i| m.positions[i as usize]);
            let face = (b - a).cross(c - a);
            assert!(face.length() > 0.0, "{what}: degenerate {a} {b} {c}");
            let shading: Vec3 = t.iter().map(|&i| m.normals[i as usize]).sum();
            inside_out += usize::from(face.dot(shading) <= 0.0);
        }
        assert!(inside_out * 500 <= m.triangles.len(), "{what}: {inside_out} faces inside out");
    }
    let bounds = scene.bounds();
    assert!(!bounds.is_empty(), "{what}");
    for c in &scene.cameras {
        assert!(0.0 < c.near && c.near < c.far && c.far.is_finite(), "{what}");
        assert!((c.target - c.eye).length() > 0.0, "{what}");
        let is_over = c.eye.cmpgt(bounds.min) & c.eye.cmplt(bounds.max);
        assert!(is_over.x && is_over.z, "{what}: the eye at {} in {bounds:?}", c.eye);
    }
}

#[test]
fn default_sizes_build_quickly_and_largest_reach_millions() {
    for info in builtins() {
        let scene = builtin(info.name, None).unwrap();
        assert!(scene.stored_triangles() <= 300_000, "{}: {}", info.name, scene.stored_triangles());
        assert!(scene.drawn_triangles() <= 1_000_000, "{}: {}", info.name, scene.drawn_triangles());
        // The largest colossus would take gigabytes, so its sizes are tried where they are small.
        let last = info.max_size.min(if info.name == "colossus" { 8 } else { u32::MAX });
        let [a, b] = [last / 4, last / 2]
            .map(|s| builtin(info.name, Some(s)).unwrap().drawn_triangles() as f64);
        // Extrapolates the growth from one size to the next.
        let doublings = f64::from(info.max_size / (last / 2)).log2();
        assert!(b * (b / a).powf(doublings) > 4e6, "{}: {a} and {b} triangles", info.name);
    }
}

#[test]
fn largest_sizes_draw_hundreds_of_millions() {
    for name in ["town", "airfield", "statues", "grove"] {
        let info = builtins().iter().find(|b| b.name == name).unwrap();
        let scene = builtin(name, Some(info.max_size)).unwrap();
        let drawn = scene.drawn_triangles();
        assert!(drawn > 350_000_000, "{name}: {drawn}");
        assert!(scene.stored_triangles() < 1_000_000, "{name}: {}", scene.stored_triangles());
        assert!(scene.instances.len() < 1_000_000, "{name}: {}", scene.instances.len());
        let bounds = scene.bounds();
        assert!((bounds.max - bounds.min).max_element() < 1e5, "{name}: {bounds:?}");
        assert_sound(&scene, name);
    }
}

/// Sizes that were the largest once are what they were, so that measurements stay comparable.
#[test]
fn scenes_of_a_size_stay_as_they_are() {
    for (name, size, drawn, instances) in [
        ("town", 3000, 99_257_654, 79_010),
        ("airfield", 4000, 35_435_300, 16_015),
        ("statues", 40, 42_376_002, 3201),
        ("grove", 4000, 43_360_626, 8495),
    ] {
        let scene = builtin(name, Some(size)).unwrap();
        assert_eq!((scene.drawn_triangles(), scene.instances.len()), (drawn, instances), "{name}");
    }
}

#[test]
fn the_colossus_is_one_closed_mesh_that_nowhere_repeats_itself() {
    for (size, quads) in [(1, 71), (2, 100)] {
        let scene = builtin("colossus", Some(size)).unwrap();
        let is_stone = |m: &&Mesh| scene.materials[m.material].name == "marble";
        let stones: Vec<&Mesh> = scene.meshes.iter().filter(is_stone).collect();
        assert_eq!(stones.len(), 1);
        let stone = stones[0];
        let triangles = 20 * quads * quads;
        assert_eq!((stone.triangles.len(), stone.positions.len()), (triangles, triangles / 2 + 2));
        // Each edge belongs to two triangles, which run along it in opposite directions.
        let edges = stone.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let unique: HashSet<(u32, u32)> = edges.collect();
        assert_eq!(unique.len(), 3 * triangles);
        assert!(unique.iter().all(|&(a, b)| unique.contains(&(b, a))));
        // No two triangles have the same shape.
        let shapes: HashSet<[u32; 3]> = stone
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| stone.positions[i as usize]);
                [a.distance(b), b.distance(c), c.distance(a)].map(f32::to_bits)
            })
            .collect();
        assert_eq!(shapes.len(), triangles);
        // It contains what its triangles surround, and not the other way round.
        let volume: f64 = stone
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| stone.positions[i as usize].as_dvec3());
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((90.0..200.0).contains(&volume), "{volume} m³");
    }
}

#[test]
fn bounds_are_those_of_all_corners() {
    for info in builtins() {
        let scene = builtin(info.name, Some(small(info))).unwrap();
        let corners = scene.instances.iter().flat_map(|i| {
            let mesh = &scene.meshes[i.mesh];
            let corners = mesh.triangles.iter().flatten();
            corners
                .map(|&k| i.world_from_mesh.transform_point3(mesh.positions[k as usize].as_dvec3()))
        });
        let (bounds, expected) = (scene.bounds(), Aabb::around(corners));
        let off = (bounds.min - expected.min).abs().max((bounds.max - expected.max).abs());
        assert!(off.max_element() < 1e-9, "{}: {bounds:?}, not {expected:?}", info.name);
    }
}

#[test]
fn lamps_have_as_many_lights_as_promised() {
    let scene = builtin("lamps", None).unwrap();
    let count = |is: fn(&Light) -> bool| scene.lights.iter().filter(|l| is(&l.light)).count();
    assert_eq!(count(|l| matches!(l, Light::Spot(_))), 64);
    assert_eq!(count(|l| matches!(l, Light::Point(_))), 8);
    let names: HashSet<&str> = scene.lights.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names.len(), scene.lights.len());
    // Every light reaches the floor.
    for light in &scene.lights {
        let reach = match light.light {
            Light::Spot(spot) => spot.position.y + spot.range * spot.direction.normalize().y,
            Light::Point(point) => point.position.y - point.range,
            Light::Directional { .. } => panic!("no sun at night"),
        };
        assert!(reach < 0.0, "{light:?}");
    }
}

#[test]
fn same_again() {
    for info in builtins() {
        let [a, b] =
            [0, 1].map(|_| format!("{:?}", builtin(info.name, Some(small(info))).unwrap()));
        assert_eq!(a, b, "{}", info.name);
    }
}

#[test]
fn unknown_names_and_sizes_are_refused_helpfully() {
    let e = builtin("shpere", None).unwrap_err();
    assert!(matches!(e, SceneError::UnknownBuiltin { nearest: "sphere", .. }), "{e}");
    assert_eq!(e.to_string(), r#"no built-in scene is called "shpere"; did you mean "sphere"?"#);
    for info in builtins() {
        for size in [0, info.max_size + 1, u32::MAX] {
            let e = builtin(info.name, Some(size)).unwrap_err();
            assert!(matches!(e, SceneError::BuiltinSize { .. }), "{e}");
        }
    }
}

/// Whether anything lies between a ground point and the light, tested with every triangle.
fn blocked(scene: &Scene, from: DVec3, to_light: DVec3) -> bool {
    let origin = from + to_light * 1e-6;
    scene.instances.iter().any(|i| {
        let mesh = &scene.meshes[i.mesh];
        mesh.triangles.iter().any(|t| {
            let [a, b, c] = t
                .map(|k| i.world_from_mesh.transform_point3(mesh.positions[k as usize].as_dvec3()));
            // The test of Möller and Trumbore 1997.
            let (e1, e2) = (b - a, c - a);
            let p = to_light.cross(e2);
            let det = e1.dot(p);
            let s = origin - a;
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, to_light.dot(q) / det, e2.dot(q) / det);
            det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0
        })
    })
}

#[test]
fn closed_forms_agree_with_their_geometry() {
    type Form = fn(DVec3, DVec3) -> bool;
    let forms: [(&str, u32, Form); 3] = [
        ("pole", 2, closed_form::pole_shadows),
        ("slit", 2, closed_form::slit_shadows),
        ("sphere", 48, closed_form::sphere_shadows),
    ];
    for (name, size, shadows) in forms {
        let scene = builtin(name, Some(size)).unwrap();
        for direction in [DVec3::new(0.7, -1.0, 0.3), DVec3::new(-0.9, -0.8, 0.0), DVec3::NEG_Y] {
            let mut dark = 0;
            for k in 0..4000 {
                // A spiral around the origin: dense at the feet of objects, and as wide as their
                // shadows are long.
                let (r, a) = (7.0 * (f64::from(k) + 0.5) / 4000.0, f64::from(k) * 2.399_963);
                let p = DVec3::new(r * a.cos(), 0.0, r * a.sin());
                let step = 4e-3;
                let around = [DVec3::ZERO, DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z];
                let mut near_by = around.map(|d| shadows(p + d * step, direction)).into_iter();
                let expected = near_by.next().unwrap();
                if near_by.any(|n| n != expected) {
                    continue; // On the outline either answer is right.
                }
                dark += usize::from(expected);
                assert_eq!(blocked(&scene, p, -direction), expected, "{name}, {direction}: {p}");
            }
            assert!(dark > 20, "{name}, {direction}: only {dark} points in shadow were tried");
        }
    }
}
