//! The mesh of the stone: a closed grid of quads on the sides of a box, with one vertex wherever
//! quads meet, so that it has no seams.

use super::chisel::relief;
use super::clay::{Clay, Ray, Side};
use super::form::HALF_HEIGHT;
use crate::types::Mesh;
use glam::{Vec2, Vec3};

/// The grid on a box of `n` × `n` quads as seen from above, and 2 `n` from bottom to top.
#[derive(Clone, Copy)]
struct Grid {
    n: u32,
}

impl Grid {
    /// Vertices of the top or the bottom with its border.
    fn lid(self) -> u32 {
        (self.n + 1) * (self.n + 1)
    }

    /// Vertices of a row around the box.
    fn around(self) -> u32 {
        4 * self.n
    }

    fn vertices(self) -> u32 {
        2 * self.lid() + (2 * self.n - 1) * self.around()
    }

    /// Index of the vertex in column `k` (counter-clockwise from the left edge of the front) and
    /// row `j` of the upright sides. The first row is the border of the bottom, the last one that
    /// of the top.
    fn upright(self, k: u32, j: u32) -> u32 {
        let n = self.n;
        let k = k % self.around();
        let (side, i) = (k / n, k % n);
        let on_lid = |i: u32, j: u32| j * (n + 1) + i;
        if j == 0 {
            match side {
                0 => on_lid(i, n),
                1 => on_lid(n, n - i),
                2 => on_lid(n - i, 0),
                _ => on_lid(0, i),
            }
        } else if j == 2 * n {
            let top = self.vertices() - self.lid();
            top + match side {
                0 => on_lid(i, 0),
                1 => on_lid(n, i),
                2 => on_lid(n - i, n),
                _ => on_lid(0, n - i),
            }
        } else {
            self.lid() + (j - 1) * self.around() + k
        }
    }
}

/// The stone, whose sides are `n` quads wide: 20 `n`² triangles.
pub(super) fn stone(n: u32, material: usize) -> Mesh {
    let grid = Grid { n };
    let mut mesh = Mesh { material, ..Mesh::default() };
    mesh.positions = positions(grid);
    mesh.triangles = triangles(grid);
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for &t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        // As long as the triangle is large, so that large ones count more.
        let normal = (b - a).cross(c - a);
        for i in t {
            mesh.normals[i as usize] += normal;
        }
    }
    for normal in &mut mesh.normals {
        // The areas of the smallest triangles are too small for the square of a float.
        *normal = (*normal * 1e6).normalize_or(Vec3::Y);
    }
    mesh
}

fn positions(grid: Grid) -> Vec<Vec3> {
    let n = grid.n;
    let clay = Clay::model();
    let finest = HALF_HEIGHT / n as f32;
    let vertex = |side: Side, at: Vec2| {
        let (length, roughness) = clay.sample(side, at);
        let ray = Ray::through(side, at);
        let raised = relief(ray.at(length), roughness, finest);
        ray.at(length + raised)
    };
    let share = |i: u32, n: u32| i as f32 / n as f32;
    let mut positions = Vec::with_capacity(grid.vertices() as usize);
    let lid = |positions: &mut Vec<Vec3>, side| {
        for j in 0..=n {
            let row = (0..=n).map(|i| vertex(side, Vec2::new(share(i, n), share(j, n))));
            positions.extend(row);
        }
    };
    lid(&mut positions, Side::Bottom);
    for j in 1..2 * n {
        for side in 0..4 {
            let row = (0..n).map(|i| Vec2::new(share(i, n), share(j, 2 * n)));
            positions.extend(row.map(|at| vertex(Side::Upright(side), at)));
        }
    }
    lid(&mut positions, Side::Top);
    positions
}

fn triangles(grid: Grid) -> Vec<[u32; 3]> {
    let n = grid.n;
    let mut triangles = Vec::with_capacity(20 * n as usize * n as usize);
    let mut quad = |[a, b, c, d]: [u32; 4]| triangles.extend([[a, b, c], [a, c, d]]);
    for begin in [0, grid.vertices() - grid.lid()] {
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let a = begin + j * (n + 1) + i;
            quad([a, a + 1, a + n + 2, a + n + 1]);
        }
    }
    for (k, j) in (0..2 * n).flat_map(|j| (0..grid.around()).map(move |k| (k, j))) {
        let at = |k, j| grid.upright(k, j);
        quad([at(k, j), at(k + 1, j), at(k + 1, j + 1), at(k, j + 1)]);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Every edge belongs to two triangles, which run along it in opposite directions.
    #[test]
    fn closed_at_any_size() {
        for n in [1, 2, 3, 8] {
            let grid = Grid { n };
            let triangles = triangles(grid);
            assert_eq!(triangles.len() as u32, 20 * n * n);
            assert_eq!(grid.vertices(), 10 * n * n + 2);
            let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
            for [a, b, c] in triangles {
                for edge in [(a, b), (b, c), (c, a)] {
                    *edges.entry(edge).or_default() += 1;
                }
            }
            assert_eq!(edges.len() as u32, 60 * n * n);
            for (&(a, b), &count) in &edges {
                assert!(count == 1 && edges.contains_key(&(b, a)), "{a} {b}");
            }
        }
    }
}
