//! Meshes that are hardly meshes.

mod common;

use common::{Random, Shape, cards, sphere, terrain};
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use umbrage_clusters::{ClusterMesh, Error, build, build_all};

fn built(shape: &Shape) -> ClusterMesh {
    let mesh = build(&shape.input()).unwrap();
    mesh.check(shape.positions.len()).unwrap();
    mesh
}

#[test]
fn nothing_becomes_nothing() {
    assert_eq!(built(&Shape::default()), ClusterMesh::default());
    let points = Shape { positions: vec![Vec3::ONE; 5], ..Shape::default() };
    assert_eq!(built(&points), ClusterMesh::default());
    // All triangles are degenerate.
    let dots = Shape { triangles: vec![[0, 1, 2], [2, 2, 3]], ..points };
    assert_eq!(built(&dots), ClusterMesh::default());
}

#[test]
fn one_triangle_is_one_cluster() {
    let shape = Shape {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Shape::default()
    };
    let mesh = built(&shape);
    assert_eq!((mesh.clusters.len(), mesh.nodes.len()), (1, 1));
    assert_eq!(mesh.nodes[0].error, f32::INFINITY);
}

#[test]
fn unsound_meshes_are_refused_by_name() {
    let sound = terrain(4, false);
    let refused = |change: &dyn Fn(&mut Shape)| {
        let mut shape = sound.clone();
        change(&mut shape);
        build(&shape.input()).expect_err("an unsound mesh")
    };
    assert_eq!(
        refused(&|s| s.triangles[3][1] = 25),
        Error::Index { triangle: 3, index: 25, vertices: 25 }
    );
    for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30] {
        let error = refused(&|s| s.positions[7].z = x);
        assert!(matches!(error, Error::Position { vertex: 7, .. }), "{error}");
    }
    assert_eq!(
        refused(&|s| s.normals = vec![Vec3::Y; 24]),
        Error::Normals { normals: 24, vertices: 25 }
    );
    assert_eq!(refused(&|s| s.uvs.truncate(2)), Error::Uvs { uvs: 2, vertices: 25 });

    let mut broken = sound.clone();
    broken.uvs.truncate(2);
    let error = build_all(&[sound.input(), broken.input()], &|_| {}).unwrap_err();
    assert_eq!(
        error,
        Error::Mesh { mesh: 1, error: Box::new(Error::Uvs { uvs: 2, vertices: 25 }) }
    );
}

#[test]
fn many_meshes_keep_their_order_and_tell_their_progress() {
    let shapes = [sphere(4, 0.1), terrain(30, true), Shape::default(), cards(50, false)];
    let inputs: Vec<_> = shapes.iter().map(Shape::input).collect();
    let done = AtomicU64::new(0);
    let meshes = build_all(&inputs, &|triangles| {
        done.fetch_add(triangles, Ordering::Relaxed);
    })
    .unwrap();
    assert_eq!(meshes, shapes.iter().map(built).collect::<Vec<_>>());
    let triangles: usize = shapes.iter().map(|shape| shape.triangles.len()).sum();
    assert_eq!(done.into_inner(), triangles as u64);
}

#[test]
fn odd_attributes_do_no_harm() {
    for is_masked in [false, true] {
        for uv in [f32::NAN, f32::INFINITY, 1e38, -1e38, 0.0] {
            let mut shape = terrain(40, is_masked);
            shape.uvs.iter_mut().step_by(3).for_each(|at| *at = Vec2::splat(uv));
            shape.normals = vec![Vec3::splat(uv); shape.positions.len()];
            built(&shape);
            shape.uvs.fill(Vec2::splat(uv));
            built(&shape);
        }
    }
}

#[test]
fn repeated_triangles_stay() {
    let mut shape = terrain(8, false);
    shape.triangles.extend_from_within(..);
    let mesh = built(&shape);
    let finest = mesh.clusters.iter().filter(|cluster| cluster.level == 0);
    let count: u32 = finest.map(|cluster| cluster.triangle_count).sum();
    assert_eq!(count as usize, shape.triangles.len());
}

/// Hundreds of triangles around one edge.
#[test]
fn a_book_of_triangles() {
    let mut random = Random(5);
    let mut shape = Shape { positions: vec![Vec3::ZERO, Vec3::Z], ..Shape::default() };
    for page in 0..900 {
        shape.positions.push(random.point() - 0.5);
        shape.triangles.push([0, 1, page + 2]);
    }
    built(&shape);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_triangles_at_any_scale_are_built(
        seed: u64,
        vertices in 1usize..600,
        triangles in 0usize..2000,
        exponent in -30i32..8,
        is_masked: bool,
        grid in prop::option::of(1.0f32..6.0),
    ) {
        let mut random = Random(seed);
        let scale = 10f32.powi(exponent);
        let mut shape = Shape { is_masked, ..Shape::default() };
        for _ in 0..vertices {
            // On a coarse grid, many vertices fall together, and many triangles into a line.
            let p = random.point() - 0.5;
            shape.positions.push(scale * grid.map_or(p, |steps| (p * steps).round()));
            shape.uvs.push(Vec2::new(random.next(), random.next()));
        }
        for _ in 0..triangles {
            let corner = |random: &mut Random| ((random.next() * vertices as f32) as u32)
                .min(vertices as u32 - 1);
            shape.triangles.push([(); 3].map(|()| corner(&mut random)));
        }
        let mesh = build(&shape.input()).unwrap();
        prop_assert_eq!(mesh.check(vertices), Ok(()));
    }
}
