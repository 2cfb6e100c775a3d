//! The pieces of a part that hang together, of which leaves and ornaments have thousands.

use crate::bvh::Triangle;
use crate::part::{Part, Source};
use crate::simplify::{area, by_edges, largest};
use glam::Vec3;
use meshopt::SimplifyVertex;

/// The shares of its triangles that a piece is reduced to. Below the last one, or if it is small
/// anyway, it may become a single triangle.
const SHARES: [f32; 4] = [0.7, 0.5, 0.3, 0.15];

/// How often another share is tried for the largest piece.
const REFINEMENTS: usize = 2;

pub(crate) struct Pieces {
    /// The piece of each of the part's vertices.
    of: Vec<usize>,
    /// The vertices of each piece.
    vertices: Vec<Vec<u32>>,
    /// Whether pieces touch the border. These stay, since neighbours know nothing of their going.
    is_fixed: Vec<bool>,
}

impl Pieces {
    pub(crate) fn new(source: &Source, part: &Part, locks: &[SimplifyVertex]) -> Self {
        // Pieces hang together at positions, not at vertices, which a seam has twice.
        let mut parents = part.firsts(source);
        fn root(parents: &mut [usize], mut i: usize) -> usize {
            while parents[i] != i {
                parents[i] = parents[parents[i]];
                i = parents[i];
            }
            i
        }
        for &[a, b, c] in &part.triangles {
            for other in [b, c] {
                let (a, b) = (root(&mut parents, a as usize), root(&mut parents, other as usize));
                parents[a.max(b)] = a.min(b);
            }
        }
        let mut pieces = Self { of: Vec::new(), vertices: Vec::new(), is_fixed: Vec::new() };
        for (i, lock) in locks.iter().enumerate() {
            let root = root(&mut parents, i);
            if root == i {
                pieces.of.push(pieces.vertices.len());
                pieces.vertices.push(Vec::new());
                pieces.is_fixed.push(false);
            } else {
                // Roots come first.
                pieces.of.push(pieces.of[root]);
            }
            let piece = pieces.of[i];
            pieces.vertices[piece].push(i as u32);
            pieces.is_fixed[piece] |= lock.contains(SimplifyVertex::Lock);
        }
        pieces
    }

    /// Collapses edges until about `target` triangles are left, in all pieces up to the same
    /// deviation. Quadrics do not compare well between a trunk and its twigs, and do not know how
    /// far away the nearest other piece is from one that vanishes.
    pub(crate) fn coarsened(
        &self,
        source: &Source,
        part: &Part,
        target: usize,
        locks: &[SimplifyVertex],
    ) -> Vec<[u32; 3]> {
        // Pieces at the border cannot vanish, and are most often patches of one smooth surface.
        if self.vertices.len() == 1 || self.is_fixed.iter().all(|&is_fixed| is_fixed) {
            let mut ends = locks.to_vec();
            lock_ends(source, part, &mut ends);
            return by_edges(source, part, 3 * target, ends);
        }
        let mut own = vec![Vec::new(); self.vertices.len()];
        part.triangles.iter().for_each(|&t| own[self.of[t[0] as usize]].push(t));
        let own = own.into_iter().enumerate().filter(|(_, own)| !own.is_empty());
        let mut ladders: Vec<Ladder> =
            own.map(|(piece, own)| self.ladder(source, part, piece, own, locks)).collect();
        for _ in 0..REFINEMENTS {
            let allowed = allowed(&ladders, target);
            let total: usize = ladders.iter().map(|ladder| ladder.rung(allowed).len()).sum();
            // The largest piece has the largest steps. It takes what the others leave.
            let own = |ladder: &Ladder| ladder.rung(allowed).len();
            let Some(largest) = ladders.iter_mut().max_by_key(|ladder| own(ladder)) else { break };
            if total + target / 16 < target {
                let own = own(largest) + target - total;
                largest.collapse(source, own);
            }
        }
        let allowed = allowed(&ladders, target);
        ladders.iter().flat_map(|ladder| ladder.rung(allowed)).copied().collect()
    }

    /// A piece as ever fewer triangles.
    fn ladder(
        &self,
        source: &Source,
        part: &Part,
        piece: usize,
        own: Vec<[u32; 3]>,
        locks: &[SimplifyVertex],
    ) -> Ladder {
        let vertices = self.vertices[piece].clone();
        let place = |i: u32| vertices.partition_point(|&other| other < i) as u32;
        let at = |i: &u32| *i as usize;
        let alone = Part {
            vertices: vertices.iter().map(|i| part.vertices[at(i)]).collect(),
            positions: vertices.iter().map(|i| part.positions[at(i)]).collect(),
            snapped: vertices.iter().map(|i| part.snapped[at(i)]).collect(),
            triangles: own.iter().map(|t| t.map(place)).collect(),
        };
        let mut ends: Vec<SimplifyVertex> = vertices.iter().map(|i| locks[at(i)]).collect();
        lock_ends(source, &alone, &mut ends);
        let count = own.len();
        let mut ladder = Ladder { part: alone, locks: ends, vertices, rungs: vec![(0.0, own)] };
        for share in SHARES {
            ladder.collapse(source, (share * count as f32) as usize);
        }
        if !self.is_fixed[piece] {
            ladder.add(source, &Vec::from_iter(spanning(&ladder.part)));
        }
        ladder
    }

    /// Keeps `target` triangles about, in whole pieces, so that those that go are near to those
    /// that stay: the farthest piece from all that stay is the next to do so (Gonzalez, *Clustering
    /// to Minimize the Maximum Intercluster Distance*, 1985).
    pub(crate) fn thinned(
        &self,
        source: &Source,
        part: &Part,
        triangles: &[[u32; 3]],
        target: usize,
    ) -> Vec<[u32; 3]> {
        let points = part.points(source);
        let mut own = vec![Vec::new(); self.vertices.len()];
        triangles.iter().for_each(|&t| own[self.of[t[0] as usize]].push(t));
        let balls: Vec<(Vec3, f32)> = own
            .iter()
            .map(|own| ball(own.as_flattened().iter().map(|&i| &points[i as usize])))
            .collect();
        let areas = own.iter().map(|own| own.iter().map(|&t| area(part, t)).sum());
        let areas: Vec<f32> = areas.collect();
        // The squares of the distances of each piece's corners, and the largest of these.
        let mut distances: Vec<Vec<f32>> =
            own.iter().map(|own| vec![f32::INFINITY; 3 * own.len()]).collect();
        let mut farthest = vec![f32::INFINITY; own.len()];
        let mut open: Vec<usize> = (0..own.len()).filter(|&piece| !own[piece].is_empty()).collect();
        let mut kept = Vec::new();
        loop {
            let order = |&a: &usize, &b: &usize| {
                let key = |i: usize| (self.is_fixed[i], farthest[i], areas[i]);
                key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
            };
            let Some((place, &next)) = open.iter().enumerate().max_by(|a, b| order(a.1, b.1))
            else {
                return kept;
            };
            let is_full = kept.len() + own[next].len() > target && !kept.is_empty();
            if is_full && !self.is_fixed[next] {
                return kept;
            }
            open.swap_remove(place);
            kept.extend_from_slice(&own[next]);
            let kept: Vec<Triangle<5>> =
                own[next].iter().map(|t| Triangle::new(t.map(|i| &points[i as usize]))).collect();
            for &other in &open {
                let (a, b) = (balls[next], balls[other]);
                let apart = (a.0.distance(b.0) - a.1 - b.1).max(0.0);
                if apart * apart >= farthest[other] {
                    continue;
                }
                let corners = own[other].as_flattened().iter().map(|&i| &points[i as usize]);
                for (distance, point) in distances[other].iter_mut().zip(corners) {
                    let nearest = kept.iter().map(|t| t.distance2(point));
                    *distance = nearest.fold(*distance, f32::min);
                }
                farthest[other] = distances[other].iter().copied().fold(0.0, f32::max);
            }
        }
    }
}

/// A ball around points, in space alone, so that distances from ball to ball are none too large.
fn ball<'a>(points: impl Iterator<Item = &'a [f32; 5]> + Clone) -> (Vec3, f32) {
    let points = points.map(|&[x, y, z, ..]| Vec3::new(x, y, z));
    let low = points.clone().fold(Vec3::INFINITY, Vec3::min);
    let high = points.clone().fold(Vec3::NEG_INFINITY, Vec3::max);
    let center = 0.5 * (low + high);
    (center, points.map(|p| p.distance(center)).fold(0.0, f32::max))
}

/// A piece, and ever fewer triangles instead of it.
struct Ladder {
    part: Part,
    locks: Vec<SimplifyVertex>,
    /// The piece's vertices among those of the part that it is a piece of.
    vertices: Vec<u32>,
    /// The deviation in metres, and the triangles, the most first.
    rungs: Vec<(f32, Vec<[u32; 3]>)>,
}

impl Ladder {
    fn collapse(&mut self, source: &Source, target: usize) {
        if (1..self.part.triangles.len()).contains(&target) {
            self.add(source, &by_edges(source, &self.part, 3 * target, self.locks.clone()));
        }
    }

    fn add(&mut self, source: &Source, triangles: &[[u32; 3]]) {
        let place = self.rungs.partition_point(|rung| rung.1.len() > triangles.len());
        let is_known = self.rungs.get(place).is_some_and(|rung| rung.1.len() == triangles.len());
        if !triangles.is_empty() && !is_known {
            let deviation = self.part.deviation(source, triangles);
            let triangles = triangles.iter().map(|t| t.map(|i| self.vertices[i as usize]));
            self.rungs.insert(place, (deviation, triangles.collect()));
        }
    }

    /// The fewest triangles that deviate by no more than `allowed`.
    fn rung(&self, allowed: f32) -> &[[u32; 3]] {
        self.rungs.iter().rfind(|rung| rung.0 <= allowed).map_or(&[], |rung| &rung.1)
    }
}

/// The smallest deviation for which `target` triangles are enough, metres.
fn allowed(ladders: &[Ladder], target: usize) -> f32 {
    let mut errors: Vec<f32> = ladders.iter().flat_map(|l| &l.rungs).map(|rung| rung.0).collect();
    errors.sort_unstable_by(f32::total_cmp);
    let total =
        |allowed: f32| ladders.iter().map(|ladder| ladder.rung(allowed).len()).sum::<usize>();
    let place = errors.partition_point(|&allowed| total(allowed) > target);
    errors.get(place).copied().unwrap_or(f32::INFINITY)
}

/// Locks the ends of a piece. Quadrics are means over areas, to which thin pieces' ends are next to
/// nothing: branches would rather get shorter than thinner.
fn lock_ends(source: &Source, piece: &Part, locks: &mut [SimplifyVertex]) {
    let place = |i: u32| source.places[piece.vertices[i as usize] as usize];
    let ends = ends(piece).map(place);
    for i in (0..piece.vertices.len()).filter(|&i| ends.contains(&place(i as u32))) {
        locks[i] |= SimplifyVertex::Lock;
    }
}

/// Two vertices about as far apart as any.
fn ends(piece: &Part) -> [u32; 2] {
    let a = farthest(piece, |p| p.distance_squared(piece.positions[0]));
    let b = farthest(piece, |p| p.distance_squared(piece.positions[a as usize]));
    [a, b]
}

fn farthest(piece: &Part, distance: impl Fn(Vec3) -> f32) -> u32 {
    let distances = piece.positions.iter().map(|&p| distance(p));
    let farthest = distances.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    farthest.map_or(0, |(i, _)| i as u32)
}

/// A triangle that stands for a whole piece: its corners are as far apart as any.
fn spanning(piece: &Part) -> Option<[u32; 3]> {
    let at = |i: u32| piece.positions[i as usize];
    let [a, b] = ends(piece);
    let c = farthest(piece, |p| (p - at(a)).cross(at(b) - at(a)).length_squared());
    let normal = |[a, b, c]: [u32; 3]| (at(b) - at(a)).cross(at(c) - at(a));
    if normal([a, b, c]).length_squared() <= 0.0 {
        return largest(piece);
    }
    // It faces the side that most of the piece does.
    let facing: Vec3 = piece.triangles.iter().map(|&t| normal(t)).sum();
    Some(if normal([a, b, c]).dot(facing) < 0.0 { [a, c, b] } else { [a, b, c] })
}
