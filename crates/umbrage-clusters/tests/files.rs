//! Files are read as they were written, or not at all.

mod common;

use common::{Shape, cards, sphere, terrain};
use umbrage_clusters::{
    ClusterMesh, FORMAT_VERSION, FileError, Flaw, build, fingerprint, read, write,
};

struct Scene {
    shapes: Vec<Shape>,
    meshes: Vec<ClusterMesh>,
    print: [u8; 32],
    bytes: Vec<u8>,
}

impl Scene {
    fn new(shapes: Vec<Shape>) -> Self {
        let inputs: Vec<_> = shapes.iter().map(Shape::input).collect();
        let meshes: Vec<_> = inputs.iter().map(|mesh| build(mesh).unwrap()).collect();
        let print = fingerprint(&inputs);
        let mut bytes = Vec::new();
        write(&mut bytes, &meshes, &print).unwrap();
        Self { shapes, meshes, print, bytes }
    }

    fn small() -> Self {
        Self::new(vec![sphere(5, 0.1), Shape::default(), cards(3, true)])
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<ClusterMesh>, FileError> {
        let vertices: Vec<_> = self.shapes.iter().map(|shape| shape.positions.len()).collect();
        read(&mut &bytes[..], bytes.len() as u64, &self.print, &vertices)
    }
}

#[test]
fn what_was_written_is_read() {
    let scene = Scene::new(vec![sphere(20, 0.1), Shape::default(), terrain(30, true)]);
    assert_eq!(scene.read(&scene.bytes).unwrap(), scene.meshes);
    let none = Scene::new(Vec::new());
    assert_eq!(none.read(&none.bytes).unwrap(), none.meshes);
}

#[test]
fn every_changed_byte_is_noticed() {
    let scene = Scene::small();
    for i in 0..scene.bytes.len() {
        let mut bytes = scene.bytes.clone();
        bytes[i] ^= 1 << (i % 8);
        let error = scene.read(&bytes).expect_err("a damaged file");
        let is_fitting = match i {
            0..8 => matches!(error, FileError::Foreign),
            8..12 => matches!(error, FileError::Version { .. }),
            16..48 => matches!(error, FileError::OtherScene),
            _ => matches!(error, FileError::Damaged),
        };
        assert!(is_fitting, "byte {i}: {error}");
    }
}

#[test]
fn every_other_length_is_noticed() {
    let scene = Scene::small();
    for length in 0..scene.bytes.len() {
        let error = scene.read(&scene.bytes[..length]).expect_err("a file that was cut off");
        let is_fitting = match length {
            0..8 => matches!(error, FileError::Foreign),
            _ => matches!(error, FileError::Damaged),
        };
        assert!(is_fitting, "length {length}: {error}");
    }
    let longer = [&scene.bytes[..], &[0]].concat();
    assert!(matches!(scene.read(&longer), Err(FileError::Damaged)));
}

/// A wrong length from the caller neither takes memory nor passes.
#[test]
fn the_stated_length_is_not_believed() {
    let scene = Scene::small();
    let vertices: Vec<_> = scene.shapes.iter().map(|shape| shape.positions.len()).collect();
    for length in [0, 79, scene.bytes.len() as u64 + 1, u64::MAX] {
        let mut bytes = scene.bytes.clone();
        // Clusters for all the memory there could be.
        bytes[80..88].copy_from_slice(&(u64::MAX / 64).to_le_bytes());
        let result = read(&mut &bytes[..], length, &scene.print, &vertices);
        assert!(matches!(result, Err(FileError::Damaged)), "{length}");
    }
}

#[test]
fn the_checksum_alone_is_not_enough() {
    let scene = Scene::small();
    let unsound = |change: &dyn Fn(&mut ClusterMesh)| {
        let mut meshes = scene.meshes.clone();
        change(&mut meshes[0]);
        let mut bytes = Vec::new();
        write(&mut bytes, &meshes, &scene.print).unwrap();
        match scene.read(&bytes) {
            Err(FileError::Unsound { mesh: 0, flaw }) => flaw,
            other => panic!("{other:?}"),
        }
    };
    type Change = &'static dyn Fn(&mut ClusterMesh);
    let of_clusters: [Change; 9] = [
        &|m| m.vertices[0] = u32::MAX,
        &|m| m.triangles[0][1] = 255,
        &|m| m.clusters[0].vertex_count = 129,
        &|m| m.clusters[0].triangle_count = 0,
        &|m| m.clusters[0].first_vertex = u32::MAX,
        &|m| m.clusters[0].first_triangle = u32::MAX,
        &|m| m.clusters[0].error = f32::NAN,
        &|m| m.clusters[0].bounds.radius = -1.0,
        &|m| m.clusters[0].error_bounds.center.y = f32::INFINITY,
    ];
    for (i, change) in of_clusters.iter().enumerate() {
        assert!(matches!(unsound(change), Flaw::Cluster { cluster: 0, .. }), "{i}");
    }
    let of_nodes: [Change; 8] = [
        &|m| m.nodes[0].error = f32::NAN,
        &|m| m.nodes[0].bounds.radius = f32::NAN,
        &|m| m.nodes[0].is_leaf = 2,
        &|m| m.nodes[0].count = 9,
        &|m| m.nodes[0].first = 0,
        &|m| m.nodes[0].first = u32::MAX,
        &|m| m.nodes.clear(),
        &|m| {
            let last = *m.nodes.last().unwrap();
            m.nodes.push(last);
        },
    ];
    for (i, change) in of_nodes.iter().enumerate() {
        assert!(matches!(unsound(change), Flaw::Node { .. } | Flaw::Tree), "{i}");
    }
}

#[test]
fn the_fingerprint_sees_every_part_of_a_mesh() {
    let shape = terrain(4, false);
    let same = fingerprint(&[shape.input()]);
    assert_eq!(same, fingerprint(&[shape.clone().input()]));
    type Change = &'static dyn Fn(&mut Shape);
    let changes: [Change; 5] = [
        &|s| s.positions[3].y += 1.0,
        &|s| s.uvs[3].y += 1.0,
        &|s| s.normals = s.positions.clone(),
        &|s| s.triangles.swap(0, 1),
        &|s| s.is_masked = true,
    ];
    for change in changes {
        let mut other = shape.clone();
        change(&mut other);
        assert_ne!(fingerprint(&[other.input()]), same);
    }
    assert_ne!(fingerprint(&[shape.input(), Shape::default().input()]), same);
    assert_eq!(FORMAT_VERSION, 1);
}
