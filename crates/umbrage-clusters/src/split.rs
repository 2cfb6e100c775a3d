//! Triangles into clusters.

use crate::part::{Part, Source};
use crate::{Ball, Cluster};
use glam::Vec3;
use meshopt::VertexDataAdapter;
use rayon::prelude::*;

/// A cluster that is in no group yet.
pub(crate) struct Draft {
    pub(crate) vertices: Vec<u32>,
    pub(crate) triangles: Vec<[u8; 3]>,
    pub(crate) bounds: Ball,
    pub(crate) error_bounds: Ball,
    pub(crate) error: f32,
    pub(crate) level: u32,
}

impl Draft {
    /// The corners as the mesh's vertices.
    pub(crate) fn corners(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.vertices[usize::from(i)]))
    }
}

/// Meshoptimizer splits clusters that are wide for their size, unless they get smaller than this.
const MIN_TRIANGLES: usize = 40;

/// How much wider than usual a cluster may be.
const SPLIT_FACTOR: f32 = 2.0;

/// The triangles of a piece of the mesh that one thread splits.
const PIECE: usize = 1 << 17;

pub(crate) fn adapter(positions: &[Vec3]) -> VertexDataAdapter<'_> {
    VertexDataAdapter::new(bytemuck::cast_slice(positions), size_of::<Vec3>(), 0)
        .expect("positions have room for three coordinates each")
}

/// The mesh's own triangles as clusters.
pub(crate) fn split_mesh(source: &Source) -> Vec<Draft> {
    if source.triangles.len() <= 2 * PIECE {
        let part = Part::exact(source, &source.triangles);
        return split(&part, &part.triangles);
    }
    // Pieces along a curve that fills space have short borders.
    let part = source.mesh.positions;
    let low = part.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
    let high = part.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
    let scale = 1023.0 / (high - low).max_element().max(f32::MIN_POSITIVE);
    let mut order: Vec<(u32, u32)> = source
        .triangles
        .par_iter()
        .enumerate()
        .map(|(t, corners)| {
            let [a, b, c] = corners.map(|i| part[i as usize]);
            let cell = ((a - low) + (b - low) + (c - low)) * (scale / 3.0);
            (morton(cell), t as u32)
        })
        .collect();
    order.par_sort_unstable();
    let pieces: Vec<Vec<Draft>> = order
        .par_chunks(PIECE)
        .map(|piece| {
            let corners: Vec<_> =
                piece.iter().map(|&(_, t)| source.triangles[t as usize]).collect();
            let part = Part::exact(source, &corners);
            split(&part, &part.triangles)
        })
        .collect();
    pieces.into_iter().flatten().collect()
}

/// The bits of three numbers of ten bits, in turn.
fn morton(cell: Vec3) -> u32 {
    let spread = |x: f32| {
        let x = (x as u32).min(1023);
        let x = (x | (x << 16)) & 0x0300_00ff;
        let x = (x | (x << 8)) & 0x0300_f00f;
        let x = (x | (x << 4)) & 0x030c_30c3;
        (x | (x << 2)) & 0x0924_9249
    };
    spread(cell.x) | (spread(cell.y) << 1) | (spread(cell.z) << 2)
}

/// `triangles`, which have the vertices of `part`, as clusters.
pub(crate) fn split(part: &Part, triangles: &[[u32; 3]]) -> Vec<Draft> {
    if triangles.is_empty() {
        return Vec::new();
    }
    let meshlets = meshopt::build_meshlets_flex(
        triangles.as_flattened(),
        &adapter(&part.positions),
        Cluster::MAX_VERTICES,
        MIN_TRIANGLES,
        Cluster::MAX_TRIANGLES,
        0.0,
        SPLIT_FACTOR,
    );
    let draft = |meshlet: meshopt::clusterize::Meshlet| {
        let bounds =
            Ball::around_points(meshlet.vertices.iter().map(|&i| part.positions[i as usize]));
        Draft {
            vertices: meshlet.vertices.iter().map(|&i| part.vertices[i as usize]).collect(),
            triangles: meshlet.triangles.as_chunks::<3>().0.to_vec(),
            bounds,
            error_bounds: bounds,
            error: 0.0,
            level: 0,
        }
    };
    meshlets.iter().map(draft).collect()
}
