//! Fewer triangles for a part of a mesh, without a change along its border.

use crate::part::{Part, Source};
use crate::split::adapter;
use glam::Vec3;
use meshopt::{SimplifyOptions, SimplifyVertex};
use std::collections::BTreeMap;

/// What a turned normal counts for, as a share of the part's extent: enough to keep shading
/// plausible, too little to spoil silhouettes for it.
const NORMAL_WEIGHT: f32 = 0.25;

/// What a shift of an opaque texture counts for, metres per metre.
const OPAQUE_UV_WEIGHT: f32 = 0.25;

/// A deviation, as a share of a part's extent, that suggests that edges were collapsed only where
/// slivers did not prevent it.
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

    let edges = by_edges(source, part, 3 * target, locks.clone());
    if edges.len() <= target + target / 8 {
        let edges = measured(edges);
        if f64::from(edges.1) <= SUSPICIOUS * part.extent().1 || source.mesh.is_masked {
            return Some(edges);
        }
        let other = measured(sloppy(part, 3 * target, &locks));
        return Some(if other.1 < edges.1 { other } else { edges });
    }
    let other = if source.mesh.is_masked {
        pruned(source, part, &edges, target, &locks)
    } else {
        sloppy(part, 3 * target, &locks)
    };
    let is_better = !other.is_empty() && other.len() < edges.len();
    let best = if is_better { other } else { edges };
    (best.len() <= most).then(|| measured(best))
}

/// Edges are collapsed in the order of their quadric errors. These only serve as an order: what a
/// simplification is off by is measured afterwards.
fn by_edges(
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
    let mut firsts = BTreeMap::new();
    for (i, &vertex) in part.vertices.iter().enumerate() {
        let place = source.places[vertex as usize];
        // Most vertices are alone at their position, which is then their own.
        let first = *firsts.entry(place).or_insert(i);
        if first != i && source.uv(vertex) != source.uv(part.vertices[first]) {
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

/// Leaves out whole pieces of `triangles`, the smallest first, until `target` is reached. Pieces
/// that touch the border stay, since their neighbours know nothing of their going.
fn pruned(
    source: &Source,
    part: &Part,
    triangles: &[[u32; 3]],
    target: usize,
    locks: &[SimplifyVertex],
) -> Vec<[u32; 3]> {
    // Pieces hang together at positions, not at vertices, which a seam has twice.
    let mut firsts = BTreeMap::new();
    let mut parents: Vec<usize> = Vec::with_capacity(part.vertices.len());
    for (i, &vertex) in part.vertices.iter().enumerate() {
        parents.push(*firsts.entry(source.places[vertex as usize]).or_insert(i));
    }
    fn root(parents: &mut [usize], mut i: usize) -> usize {
        while parents[i] != i {
            parents[i] = parents[parents[i]];
            i = parents[i];
        }
        i
    }
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (a, b) = (root(&mut parents, a as usize), root(&mut parents, other as usize));
            parents[a.max(b)] = a.min(b);
        }
    }
    let mut pieces: BTreeMap<usize, (f32, Vec<[u32; 3]>, bool)> = BTreeMap::new();
    for &triangle in triangles {
        let piece = pieces.entry(root(&mut parents, triangle[0] as usize)).or_default();
        piece.0 += area(part, triangle);
        piece.2 |= triangle.iter().any(|&i| locks[i as usize].contains(SimplifyVertex::Lock));
        piece.1.push(triangle);
    }
    // Among pieces of about the same area those that go are scattered.
    let mut pieces: Vec<_> = pieces.into_iter().collect();
    pieces.sort_by_key(|(first, (area, _, is_fixed))| {
        let class = if *area > 0.0 { area.log2().floor() as i32 } else { i32::MIN };
        (*is_fixed, class, (*first as u32).wrapping_mul(0x9e37_79b9))
    });
    let mut left = triangles.len();
    pieces.retain(|(_, (_, triangles, is_fixed))| {
        let goes = !is_fixed && left > target && left > triangles.len();
        if goes {
            left -= triangles.len();
        }
        !goes
    });
    pieces.into_iter().flat_map(|(_, (_, triangles, _))| triangles).collect()
}

fn area(part: &Part, triangle: [u32; 3]) -> f32 {
    let [a, b, c]: [Vec3; 3] = triangle.map(|i| part.positions[i as usize]);
    (b - a).cross(c - a).length()
}

fn largest(part: &Part) -> Option<[u32; 3]> {
    let triangles = part.triangles.iter().copied();
    triangles.max_by(|&a, &b| area(part, a).total_cmp(&area(part, b)))
}
