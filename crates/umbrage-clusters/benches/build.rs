//! Time to make clusters of a displaced sphere.
//!
//! `UMBRAGE_TRIANGLES=10000000 cargo bench -p umbrage-clusters` makes a larger one, once, and also
//! prints its memory.
#![allow(missing_docs, reason = "criterion's macros make undocumented items")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use std::hint::black_box;
use std::time::Instant;
use umbrage_clusters::{Cluster, ClusterMesh, MeshInput, Node, build};

struct Sphere {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// A sphere with bumps, with `count` triangles about.
fn sphere(count: usize) -> Sphere {
    let rows = ((count as f64 / 4.0).sqrt() as u32).max(3);
    let columns = 2 * rows;
    let mut positions = Vec::new();
    for row in 0..=rows {
        for column in 0..columns {
            let (a, b) = (
                f64::from(row) / f64::from(rows) * std::f64::consts::PI,
                f64::from(column) / f64::from(columns) * std::f64::consts::TAU,
            );
            let [x, y, z] = [a.sin() * b.cos(), a.cos(), a.sin() * b.sin()];
            let bumps = |f: f64| (f * x).sin() * (f * y).sin() * (f * z).sin();
            let radius = 1.0 + 0.1 * bumps(7.0) + 0.01 * bumps(51.0) + 0.002 * bumps(311.0);
            positions.push((glam::DVec3::new(x, y, z) * radius).as_vec3());
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let next = (column + 1) % columns;
            let [a, b] = [row * columns + column, row * columns + next];
            let [c, d] = [a + columns, b + columns];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    let normals = positions.iter().map(|p| p.normalize()).collect();
    Sphere { positions, normals, triangles }
}

impl Sphere {
    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.positions,
            normals: &self.normals,
            triangles: &self.triangles,
            ..MeshInput::default()
        }
    }
}

fn bytes(mesh: &ClusterMesh) -> usize {
    mesh.clusters.len() * size_of::<Cluster>()
        + mesh.nodes.len() * size_of::<Node>()
        + mesh.vertices.len() * 4
        + mesh.triangles.len() * 3
}

fn once(triangles: usize) {
    let sphere = sphere(triangles);
    let start = Instant::now();
    let mesh = build(&sphere.input()).expect("a sound mesh");
    let seconds = start.elapsed().as_secs_f64();
    let own = sphere.positions.len() * 24 + sphere.triangles.len() * 12;
    let coarsest: u32 = mesh
        .nodes
        .iter()
        .filter(|node| node.is_leaf == 1 && node.error.is_infinite())
        .flat_map(|node| &mesh.clusters[node.first as usize..(node.first + node.count) as usize])
        .map(|cluster| cluster.triangle_count)
        .sum();
    let peak = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = peak.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("VmHWM: unknown");
    println!(
        "{} triangles: {seconds:.1} s, {} clusters, {} nodes, {coarsest} triangles at last; \
         {:.0} MB for a mesh of {:.0} MB; {peak}",
        sphere.triangles.len(),
        mesh.clusters.len(),
        mesh.nodes.len(),
        bytes(&mesh) as f64 / 1e6,
        own as f64 / 1e6,
    );
    for level in 0.. {
        let all = mesh.clusters.iter().filter(|cluster| cluster.level == level);
        let triangles: u32 = all.clone().map(|cluster| cluster.triangle_count).sum();
        if triangles == 0 {
            break;
        }
        let worst = all.clone().map(|cluster| cluster.error).fold(0.0, f32::max);
        println!("  level {level}: {triangles} triangles, {} clusters, {worst} m", all.count());
    }
}

fn bench(c: &mut Criterion) {
    if let Ok(triangles) = std::env::var("UMBRAGE_TRIANGLES") {
        once(triangles.parse().expect("a number of triangles"));
        return;
    }
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for triangles in [1_000, 100_000] {
        let sphere = sphere(triangles);
        group.throughput(Throughput::Elements(sphere.triangles.len() as u64));
        group.bench_function(format!("{triangles}"), |b| {
            b.iter(|| build(black_box(&sphere.input())).expect("a sound mesh"));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
