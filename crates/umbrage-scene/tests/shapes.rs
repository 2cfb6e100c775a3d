//! Meshes of odd shapes load as they are: the fewest triangles, triangles without area, and
//! surfaces that branch, touch themselves or turn over.

mod common;

use common::{File, notices};
use glam::Vec3;
use serde_json::json;
use umbrage_scene::Scene;

/// A file of these triangles alone, with or without a smooth normal at each corner.
fn soup(corners: &[[f32; 3]], triangles: &[[u16; 3]], has_normals: bool) -> File {
    let mut file = File::triangle();
    let positions = file.floats("VEC3", &corners.concat());
    let normals = file.floats("VEC3", &[0.0, 0.6, 0.8].repeat(corners.len()));
    let indices = file.u16s("SCALAR", &triangles.concat());
    let mut attributes = json!({"POSITION": positions});
    if has_normals {
        attributes["NORMAL"] = json!(normals);
    }
    *file.primitive() = json!({"attributes": attributes, "indices": indices});
    file
}

fn assert_finite(scene: &Scene) {
    for mesh in &scene.meshes {
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5), "{mesh:?}");
        assert_eq!(mesh.normals.len(), mesh.positions.len());
    }
    let bounds = scene.bounds();
    assert!(bounds.min.is_finite() && bounds.max.is_finite());
    // What nothing in the scene gives is chosen, whatever the scene is.
    let view = scene.default_view();
    assert!(view.eye.is_finite() && view.near > 0.0, "{view:?}");
}

#[test]
fn one_triangle_is_a_scene() {
    for has_normals in [true, false] {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let scene = soup(&corners, &[[0, 1, 2]], has_normals).load().unwrap();
        assert_eq!((scene.drawn_triangles(), scene.meshes[0].positions.len()), (1, 3));
        let normal = if has_normals { Vec3::new(0.0, 0.6, 0.8) } else { Vec3::Z };
        assert_eq!(scene.meshes[0].normals, [normal; 3]);
        assert_finite(&scene);
    }
}

#[test]
fn triangles_without_area_do_no_harm() {
    // A point, a line, a needle and a proper triangle; the first uses a vertex three times.
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 1e-38, 0.0],
    ];
    let flat = [[0, 0, 0], [0, 4, 0], [0, 1, 2], [0, 1, 5], [0, 4, 1]];
    for has_normals in [true, false] {
        let all = [&flat[..], &[[0, 1, 3]]].concat();
        let scene = soup(&corners, &all, has_normals).load().unwrap();
        assert_finite(&scene);
        let mesh = &scene.meshes[0];
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).length()
        };
        let whole = mesh.triangles.iter().filter(|&t| area(t) > 0.5).count();
        assert_eq!(whole, 1, "the proper one");
        // Alone, they are a scene in which nothing can be seen, or none.
        match soup(&corners, &flat, has_normals).load() {
            Ok(scene) => assert_finite(&scene),
            Err(e) => assert!(e.to_string().contains("no triangles to draw"), "{e}"),
        }
    }
}

#[test]
fn surfaces_need_not_be_manifolds() {
    let corners = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.3],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ];
    let shapes: [&[[u16; 3]]; 4] = [
        // Three triangles at one edge.
        &[[0, 1, 2], [0, 1, 3], [0, 1, 4]],
        // The same triangle twice, and once from behind.
        &[[0, 1, 2], [0, 1, 2], [0, 2, 1]],
        // Two fans that share one vertex alone.
        &[[0, 1, 2], [0, 5, 6]],
        // Neighbours that face opposite sides.
        &[[0, 1, 2], [0, 1, 3]],
    ];
    for triangles in shapes {
        for has_normals in [true, false] {
            let scene = soup(&corners, triangles, has_normals).load().unwrap();
            assert_eq!(scene.drawn_triangles(), triangles.len() as u64, "{triangles:?}");
            assert_finite(&scene);
            assert!(notices(&scene).len() <= 1, "{:?}", notices(&scene));
        }
    }
}
