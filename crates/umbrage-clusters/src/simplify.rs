//! Fewer triangles for a part of a mesh, without a change along its border.

use crate::part::{Part, Source};
use crate::pieces::Pieces;
use crate::split::adapter;
use glam::Vec3;
use meshopt::{SimplifyOptions, SimplifyVertex};

/// What a turned normal counts for, as a share of the part's extent: enough to keep shading
/// plausible, too little to spoil silhouettes for it.
const NORMAL_WEIGHT: f32 = 0.25;

/// What a shift of an opaque texture counts for, metres per metre.
const OPAQUE_UV_WEIGHT: f32 = 0.25;

/// A deviation, as a share of a part's extent, that suggests that another way is better.
const SUSPICIOUS: f64 = 0.1;

/// Simplification of `part` to `target` triangles, or as near to that as possible, and what it is
/// off by in metres, as `deviation` finds; nothing if more than `most` triangles remain. Vertices
/// stay where `is_fixed`. The triangles have the part's vertices; there is at least one.
pub(crate) fn simplify(
    source: &Source,
    part: &Part,
    target: usize,
    most: usize,
    is_fixed: impl Fn(u32) -> bool,
    deviation: impl Fn(&[[u32; 3]]) -> f32,
) -> Option<(Vec<[u32; 3]>, f32)> {
    let locks: Vec<SimplifyVertex> = part
        .vertices
        .iter()
        .map(|&v| if is_fixed(v) { SimplifyVertex::Lock } else { SimplifyVertex::None })
        .collect();
    let target = target.min(part.triangles.len());
    let measured = |mut triangles: Vec<[u32; 3]>| {
        if triangles.is_empty() {
            triangles.extend(largest(part));
        }
        let deviation = deviation(&triangles);
        (triangles, deviation)
    };

    let pieces = Pieces::new(source, part, &locks);
    let edges = pieces.coarsened(source, part, target, &locks);
    let is_small = edges.len() <= target + target / 8;
    let edges = measured(edges);
    if is_small && f64::from(edges.1) <= SUSPICIOUS * part.extent().1 {
        return Some(edges);
    }
    // Small pieces cannot get much simpler each. Some of them go, or are joined.
    let mut candidates = vec![pieces.thinned(source, part, &edges.0, target)];
    if !source.mesh.is_masked {
        candidates.push(sloppy(part, 3 * target, &locks));
    }
    let candidates = candidates.into_iter().map(measured).chain([edges]);
    let small = candidates.filter(|(triangles, _)| triangles.len() <= most);
    small.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Edges are collapsed in the order of their quadric errors. These only serve as an order: what a
/// simplification is off by is measured afterwards.
pub(crate) fn by_edges(
    source: &Source,
    part: &Part,
    target: usize,
    mut locks: Vec<SimplifyVertex>,
) -> Vec<[u32; 3]> {
    // Meshoptimizer scales positions to unit extent, but attributes by their weights alone.
    let extent = (2.0 * part.extent().1) as f32;
    let is_masked = source.mesh.is_masked;
    let has_uvs = source.metres_per_uv > 0.0 && extent > 0.0;
    let has_normals = !source.mesh.normals.is_empty() && !is_masked;
    let mut weights = Vec::new();
    let mut options = SimplifyOptions::ErrorAbsolute | SimplifyOptions::Permissive;
    if has_uvs {
        let share = if is_masked { 1.0 } else { OPAQUE_UV_WEIGHT };
        weights.extend([(share * source.metres_per_uv / extent).min(1e6); 2]);
        protect_seams(source, part, &mut locks);
    }
    if has_normals {
        weights.extend([NORMAL_WEIGHT; 3]);
    }
    if !is_masked {
        options |= SimplifyOptions::ErrorClamped;
    }
    let mut attributes = Vec::with_capacity(part.vertices.len() * weights.len());
    let first = if has_uvs { source.uv(part.vertices[0]) } else { glam::Vec2::ZERO };
    for &vertex in &part.vertices {
        if has_uvs {
            attributes.extend((source.uv(vertex) - first).to_array());
        }
        if has_normals {
            attributes.extend(source.normal(vertex).to_array());
        }
    }
    let indices = meshopt::simplify_with_attributes_and_locks(
        part.triangles.as_flattened(),
        &adapter(&part.snapped),
        &attributes,
        &weights,
        size_of::<f32>() * weights.len(),
        &locks,
        target,
        f32::MAX,
        options,
        None,
    );
    indices.as_chunks::<3>().0.to_vec()
}

/// Where vertices at one position have different texture coordinates, a seam runs. It may be
/// simplified along itself alone.
fn protect_seams(source: &Source, part: &Part, locks: &mut [SimplifyVertex]) {
    for (i, first) in part.firsts(source).into_iter().enumerate() {
        if first != i && source.uv(part.vertices[i]) != source.uv(part.vertices[first]) {
            locks[i] |= SimplifyVertex::Protect;
            locks[first] |= SimplifyVertex::Protect;
        }
    }
}

/// Vertices in a cell of a grid become one. It goes on where edges cannot be collapsed, in many
/// small pieces, and joins these.
fn sloppy(part: &Part, target: usize, locks: &[SimplifyVertex]) -> Vec<[u32; 3]> {
    let indices = meshopt::simplify_sloppy_with_locks(
        part.triangles.as_flattened(),
        &adapter(&part.snapped),
        locks,
        target,
        f32::MAX,
        None,
    );
    indices.as_chunks::<3>().0.to_vec()
}

pub(crate) fn area(part: &Part, triangle: [u32; 3]) -> f32 {
    let [a, b, c]: [Vec3; 3] = triangle.map(|i| part.positions[i as usize]);
    (b - a).cross(c - a).length()
}

pub(crate) fn largest(part: &Part) -> Option<[u32; 3]> {
    let triangles = part.triangles.iter().copied();
    triangles.max_by(|&a, &b| area(part, a).total_cmp(&area(part, b)))
}
