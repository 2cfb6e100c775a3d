//! Shapes, cuts and distances for the tests.
#![allow(dead_code, reason = "each test uses some of it")]

use glam::{Vec2, Vec3};
use std::collections::HashMap;
use umbrage_clusters::{Ball, Cluster, ClusterMesh, MeshInput};

#[derive(Clone, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) uvs: Vec<Vec2>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) is_masked: bool,
}

/// Random numbers from 0 to 1 (Steele and others, *Fast Splittable Pseudorandom Number Generators*,
/// 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }

    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

impl Shape {
    pub(crate) fn input(&self) -> MeshInput<'_> {
        MeshInput {
            positions: &self.positions,
            normals: &self.normals,
            uvs: &self.uvs,
            triangles: &self.triangles,
            is_masked: self.is_masked,
        }
    }

    pub(crate) fn scaled(mut self, scale: f32) -> Self {
        self.positions.iter_mut().for_each(|p| *p *= scale);
        self
    }

    /// A grid of `columns` × `rows` quadrilaterals, whose vertex at (s, t) from 0 to 1 is
    /// `at(s, t)`.
    fn grid(&mut self, columns: u32, rows: u32, at: impl Fn(f32, f32) -> Vec3) {
        let first = self.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let (s, t) = (column as f32 / columns as f32, row as f32 / rows as f32);
                self.positions.push(at(s, t));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                let b = a + columns + 1;
                self.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
    }

    /// Each triangle with vertices and a normal of its own.
    pub(crate) fn flat_shaded(&self) -> Self {
        let mut flat = Self { is_masked: self.is_masked, ..Self::default() };
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let first = flat.positions.len() as u32;
            flat.positions.extend([a, b, c]);
            flat.normals.extend([(b - a).cross(c - a).normalize_or_zero(); 3]);
            flat.triangles.push([first, first + 1, first + 2]);
        }
        flat
    }
}

fn bumps(p: Vec3, frequency: f32) -> f32 {
    let q = p * frequency;
    q.x.sin() * q.y.sin() * q.z.sin()
}

/// Closed: the poles are one vertex each, and no vertex is there twice.
pub(crate) fn sphere(rows: u32, bump: f32) -> Shape {
    use std::f32::consts::{PI, TAU};
    let columns = 2 * rows;
    let mut shape = Shape::default();
    let radius = |p: Vec3| p * (1.0 + bump * bumps(p, 7.0) + 0.2 * bump * bumps(p, 31.0));
    shape.positions.push(radius(Vec3::Y));
    for row in 1..rows {
        for column in 0..columns {
            let (a, b) = (row as f32 / rows as f32 * PI, column as f32 / columns as f32 * TAU);
            let p = Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin());
            shape.positions.push(radius(p));
        }
    }
    shape.positions.push(radius(-Vec3::Y));
    let last = shape.positions.len() as u32 - 1;
    let at = |row: u32, column: u32| match row {
        0 => 0,
        _ if row == rows => last,
        _ => 1 + (row - 1) * columns + column % columns,
    };
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
            shape.triangles.extend(
                [[a, b, d], [a, d, c]]
                    .iter()
                    .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
            );
        }
    }
    shape.normals = shape.positions.iter().map(|p| p.normalize()).collect();
    shape
}

pub(crate) fn terrain(size: u32, is_masked: bool) -> Shape {
    let mut shape = Shape { is_masked, ..Shape::default() };
    let height = |p: Vec3| 3.0 * bumps(p + Vec3::Y, 0.13) + 0.3 * bumps(p + Vec3::Y, 1.1);
    shape.grid(size, size, |s, t| {
        let p = Vec3::new(s * 50.0, 0.0, t * 50.0);
        p + Vec3::Y * height(p)
    });
    // The texture is stretched unevenly.
    let uv = |p: &Vec3| Vec2::new(p.x + 0.3 * (0.5 * p.z).sin(), p.z + 0.2 * (0.7 * p.x).sin());
    shape.uvs = shape.positions.iter().map(|p| uv(p) * 0.1).collect();
    shape
}

/// Thin curved wires beside each other.
pub(crate) fn wires() -> Shape {
    let mut shape = Shape::default();
    for wire in 0..12 {
        let z = wire as f32 * 0.2;
        shape.grid(6, 90, |s, t| {
            let (a, x) = (s * std::f32::consts::TAU, t * 8.0);
            let y = 0.5 * (x + z).sin();
            // Ends meet exactly.
            let a = if s == 1.0 { 0.0 } else { a };
            Vec3::new(x, y + 0.01 * a.sin(), z + 0.01 * a.cos())
        });
    }
    shape
}

/// Leaves, each two triangles, that share nothing.
pub(crate) fn cards(count: u32, is_masked: bool) -> Shape {
    let mut random = Random(7);
    let mut shape = Shape { is_masked, ..Shape::default() };
    for _ in 0..count {
        let at = random.point() * 4.0;
        let (u, v) = (random.point() - 0.5, random.point() - 0.5);
        shape.grid(1, 1, |s, t| at + (u * s + v * t) * 0.2);
        shape.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE]);
    }
    shape
}

/// The walls of a box, each a fine grid.
pub(crate) fn walls() -> Shape {
    let mut shape = Shape::default();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            shape.grid(24, 24, |s, t| {
                let mut p = Vec3::splat(side);
                p[(axis + 1) % 3] = if side > 0.0 { s } else { t };
                p[(axis + 2) % 3] = if side > 0.0 { t } else { s };
                p * Vec3::new(8.0, 3.0, 5.0)
            });
        }
    }
    shape
}

/// Closed balls that share nothing, each larger than a group of clusters.
pub(crate) fn balls(count: u32) -> Shape {
    let mut random = Random(5);
    let ball = sphere(32, 0.02);
    let mut shape = Shape::default();
    for _ in 0..count {
        let (at, radius) = (random.point() * 4.0, 0.1 + 0.2 * random.next());
        let first = shape.positions.len() as u32;
        shape.positions.extend(ball.positions.iter().map(|&p| at + p * radius));
        shape.triangles.extend(ball.triangles.iter().map(|t| t.map(|i| first + i)));
    }
    shape
}

/// Thin bent tubes of three sides, as twigs are, around two thick ones.
pub(crate) fn twigs(count: u32) -> Shape {
    use std::f32::consts::TAU;
    let mut random = Random(9);
    let mut shape = Shape::default();
    for twig in 0..count {
        let (sides, radius) = if twig < 2 { (24, 0.3) } else { (3, 0.01) };
        let (at, along) = (random.point() * 4.0, random.point() - 0.5);
        let bend = 0.2 * (random.point() - 0.5);
        let (u, v) = along.normalize_or(Vec3::Z).any_orthonormal_pair();
        shape.grid(sides, 4, |s, t| {
            // Ends meet exactly.
            let (sin, cos) = if s == 1.0 { (0.0, 1.0) } else { (s * TAU).sin_cos() };
            at + along * t + bend * (t * t) + radius * (u * cos + v * sin)
        });
    }
    shape
}

pub(crate) fn noise(count: u32) -> Shape {
    let mut random = Random(11);
    let mut shape = Shape::default();
    for i in 0..count {
        let at = random.point() * 5.0;
        shape.positions.extend((0..3).map(|_| at + random.point()));
        // Some share a vertex with others.
        let other = (random.next() * (3 * i) as f32) as u32;
        shape.triangles.push([3 * i, 3 * i + 1, if i % 4 == 3 { other } else { 3 * i + 2 }]);
    }
    shape
}

pub(crate) fn all() -> Vec<(&'static str, Shape)> {
    vec![
        ("sphere", sphere(60, 0.1)),
        ("flat-shaded sphere", sphere(30, 0.1).flat_shaded()),
        ("terrain", terrain(80, false)),
        ("masked terrain", terrain(60, true)),
        ("wires", wires()),
        ("cards", cards(3000, false)),
        ("masked cards", cards(3000, true)),
        ("walls", walls()),
        ("balls", balls(8)),
        ("twigs", twigs(300)),
        ("noise", noise(3000)),
        ("huge terrain", terrain(40, false).scaled(2e5)),
        ("tiny sphere", sphere(30, 0.1).scaled(1e-6)),
    ]
}

/// The clusters drawn where `allowed` says which errors are fine, found by the rule alone.
pub(crate) fn cut(mesh: &ClusterMesh, allowed: impl Fn(&Ball, f32) -> bool) -> Vec<&Cluster> {
    let mut drawn = Vec::new();
    for node in mesh.nodes.iter().filter(|node| node.is_leaf == 1) {
        if allowed(&node.bounds, node.error) {
            continue;
        }
        let own = &mesh.clusters[node.first as usize..(node.first + node.count) as usize];
        drawn.extend(
            own.iter().filter(|cluster| {
                cluster.level == 0 || allowed(&cluster.error_bounds, cluster.error)
            }),
        );
    }
    drawn
}

/// The corners of a cluster's triangles as the mesh's vertices.
pub(crate) fn corners(mesh: &ClusterMesh, cluster: &Cluster) -> Vec<[u32; 3]> {
    let vertices = &mesh.vertices[cluster.first_vertex as usize..];
    let first = cluster.first_triangle as usize;
    let own = &mesh.triangles[first..first + cluster.triangle_count as usize];
    own.iter().map(|t| t.map(|i| vertices[usize::from(i)])).collect()
}

/// How many triangles have each edge, by position.
pub(crate) fn edges(shape: &Shape, triangles: &[[u32; 3]]) -> HashMap<[[u32; 3]; 2], u32> {
    let mut edges = HashMap::new();
    for t in triangles {
        // Adding 0 makes the two zeros equal.
        let p = t.map(|i| shape.positions[i as usize].to_array().map(|x| (x + 0.0).to_bits()));
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            *edges.entry([p[a].min(p[b]), p[a].max(p[b])]).or_insert(0) += 1;
        }
    }
    edges
}
