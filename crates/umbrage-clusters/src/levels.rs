//! Level after level: neighbouring clusters form groups, each group becomes half as many triangles.

use crate::part::{Part, Source};
use crate::simplify::simplify;
use crate::split::{Draft, adapter, split, split_mesh};
use crate::tree::tree;
use crate::{Ball, Cluster, ClusterMesh, Node};
use rayon::prelude::*;

/// The clusters of a group that are aimed at. Meshoptimizer takes up to a third more.
const GROUP: usize = 16;

/// The share of triangles that must go at least, or else a group waits for other neighbours.
const MIN_GAIN: f32 = 0.15;

/// Below this many triangles, a mesh is as coarse as is useful.
const FEWEST: usize = 8;

/// The most triangles of a mesh whose coarsest levels are compared with the mesh itself, which
/// finds smaller errors than the sum over all levels.
const MAX_COMPARED: usize = 300_000;

/// Belongs to several groups, or to none.
const SEVERAL: u32 = u32::MAX;
const NONE: u32 = u32::MAX - 1;

/// Clusters that are replaced together.
pub(crate) struct Group {
    pub(crate) bounds: Ball,
    /// Infinite where nothing replaces them.
    pub(crate) error: f32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// The round in which it was formed. Groups of one round are about equally coarse.
    pub(crate) round: u32,
}

struct Builder<'a> {
    source: &'a Source<'a>,
    result: ClusterMesh,
    groups: Vec<Group>,
    round: u32,
}

/// What comes of a group.
enum Outcome {
    /// It is replaced.
    Coarser { bounds: Ball, error: f32, old: Vec<Draft>, new: Vec<Draft> },
    /// Too little would go.
    Stuck(Vec<Draft>),
}

/// All levels of a mesh.
pub(crate) fn levels(source: &Source) -> ClusterMesh {
    let mut builder =
        Builder { source, result: ClusterMesh::default(), groups: Vec::new(), round: 0 };
    let drafts = builder.halve_all(split_mesh(source));
    let drafts = builder.coarsen_whole(drafts);
    builder.end(drafts);
    builder.result.nodes = tree(&builder.groups);
    builder.result
}

/// The finest level of a mesh alone.
pub(crate) fn finest(source: &Source) -> ClusterMesh {
    let mut builder =
        Builder { source, result: ClusterMesh::default(), groups: Vec::new(), round: 0 };
    builder.end(split_mesh(source));
    builder.result.nodes = tree(&builder.groups);
    builder.result
}

impl Builder<'_> {
    /// Halves the triangles again and again until one group has all that is left, or no group gets
    /// on.
    fn halve_all(&mut self, mut drafts: Vec<Draft>) -> Vec<Draft> {
        // The group at each position.
        let mut owners = vec![NONE; self.source.places.len()];
        while drafts.len() > GROUP {
            let triangles = count(&drafts);
            let groups = self.partition(drafts);
            self.find_owners(&groups, &mut owners);
            let source = self.source;
            let is_border = |v: u32| owners[source.places[v as usize] as usize] == SEVERAL;
            let outcomes: Vec<_> = groups
                .into_par_iter()
                .map(|group| {
                    let target = count(&group) / 2;
                    coarser(source, group, target, MIN_GAIN, is_border, None)
                })
                .collect();
            drafts = Vec::new();
            for outcome in outcomes {
                match outcome {
                    Outcome::Coarser { bounds, error, old, new } => {
                        self.keep(bounds, error, old);
                        drafts.extend(new);
                    }
                    Outcome::Stuck(old) => drafts.extend(old),
                }
            }
            self.round += 1;
            // Rounds in which next to nothing happens could be very many.
            if count(&drafts) as f32 > 0.98 * triangles as f32 {
                break;
            }
        }
        drafts
    }

    /// Coarsens all that is left as one group, which has no neighbours to keep a border for.
    fn coarsen_whole(&mut self, mut drafts: Vec<Draft>) -> Vec<Draft> {
        if drafts.len() > Node::MAX_CLUSTERS {
            return drafts;
        }
        let is_compared = self.source.triangles.len() <= MAX_COMPARED;
        let whole = is_compared.then(|| Part::new(self.source, &self.source.triangles));
        while count(&drafts) > FEWEST {
            // Small steps: few triangles cost little, and nearly all distances see some of them.
            let target = (2 * count(&drafts) / 3).max(FEWEST / 2);
            match coarser(self.source, drafts, target, MIN_GAIN, |_| false, whole.as_ref()) {
                Outcome::Coarser { bounds, error, old, new } => {
                    self.keep(bounds, error, old);
                    drafts = new;
                }
                Outcome::Stuck(old) => return old,
            }
            self.round += 1;
        }
        drafts
    }

    /// Clusters that nothing replaces.
    fn end(&mut self, drafts: Vec<Draft>) {
        for group in self.partition(drafts) {
            let bounds = Ball::around(group.iter().map(|draft| draft.error_bounds));
            self.keep(bounds, f32::INFINITY, group);
        }
    }

    fn keep(&mut self, bounds: Ball, error: f32, drafts: Vec<Draft>) {
        let first = self.result.clusters.len() as u32;
        let count = drafts.len() as u32;
        self.groups.push(Group { bounds, error, first, count, round: self.round });
        for draft in drafts {
            self.result.clusters.push(Cluster {
                bounds: draft.bounds,
                error_bounds: draft.error_bounds,
                error: draft.error,
                level: draft.level,
                first_vertex: self.result.vertices.len() as u32,
                vertex_count: draft.vertices.len() as u32,
                first_triangle: self.result.triangles.len() as u32,
                triangle_count: draft.triangles.len() as u32,
            });
            self.result.vertices.extend(draft.vertices);
            self.result.triangles.extend(draft.triangles);
        }
    }

    /// Groups of clusters that share many vertices.
    fn partition(&self, drafts: Vec<Draft>) -> Vec<Vec<Draft>> {
        if drafts.len() <= GROUP {
            return if drafts.is_empty() { Vec::new() } else { vec![drafts] };
        }
        let mut places = Vec::new();
        let mut counts = Vec::with_capacity(drafts.len());
        for draft in &drafts {
            let first = places.len();
            places.extend(draft.vertices.iter().map(|&v| self.source.places[v as usize]));
            places[first..].sort_unstable();
            let mut last = first;
            for i in first + 1..places.len() {
                if places[i] != places[last] {
                    last += 1;
                    places[last] = places[i];
                }
            }
            places.truncate(last + 1);
            counts.push((places.len() - first) as u32);
        }
        let mut groups_of = vec![0; drafts.len()];
        let count = meshopt::partition_clusters_with_positions(
            &mut groups_of,
            &places,
            &counts,
            &adapter(self.source.mesh.positions),
            GROUP,
        );
        let mut groups: Vec<Vec<Draft>> = (0..count).map(|_| Vec::new()).collect();
        for (draft, group) in drafts.into_iter().zip(groups_of) {
            // A group that is full goes on as another one, whose border is kept like any other.
            let group = group as usize;
            if groups[group].len() == Node::MAX_CLUSTERS {
                let full = std::mem::take(&mut groups[group]);
                groups.push(full);
            }
            groups[group].push(draft);
        }
        groups.retain(|group| !group.is_empty());
        groups
    }

    fn find_owners(&self, groups: &[Vec<Draft>], owners: &mut [u32]) {
        owners.fill(NONE);
        for (i, group) in groups.iter().enumerate() {
            for &vertex in group.iter().flat_map(|draft| &draft.vertices) {
                let owner = &mut owners[self.source.places[vertex as usize] as usize];
                if *owner == NONE {
                    *owner = i as u32;
                } else if *owner != i as u32 {
                    *owner = SEVERAL;
                }
            }
        }
    }
}

fn count(drafts: &[Draft]) -> usize {
    drafts.iter().map(|draft| draft.triangles.len()).sum()
}

/// Replaces a group by `target` triangles about. `whole` is the mesh, if the group is all that is
/// left of it.
fn coarser(
    source: &Source,
    old: Vec<Draft>,
    target: usize,
    min_gain: f32,
    is_border: impl Fn(u32) -> bool,
    whole: Option<&Part>,
) -> Outcome {
    let corners: Vec<_> = old.iter().flat_map(Draft::corners).collect();
    let part = Part::new(source, &corners);
    let most = ((1.0 - min_gain) * corners.len() as f32) as usize;
    let deviation = |triangles: &[[u32; 3]]| match whole {
        Some(whole) => whole.deviation(source, &part.triangles_in(whole, triangles)),
        None => part.deviation(source, triangles),
    };
    let simplified = simplify(source, &part, target, most, is_border, deviation);
    let Some((triangles, deviation)) = simplified else { return Outcome::Stuck(old) };
    let below = old.iter().map(|draft| draft.error).fold(0.0, f32::max);
    let error = match whole {
        // Measured from the mesh. Errors must grow all the same, or else cuts would have gaps.
        Some(_) => deviation.max(below.next_up()),
        // By the triangle inequality, nothing lies farther from the mesh than the finer clusters
        // do from it and the coarser ones from these.
        None => (below + deviation).next_up(),
    };
    let bounds = Ball::around(old.iter().map(|draft| draft.error_bounds));
    let level = old.iter().map(|draft| draft.level).max().unwrap_or(0) + 1;
    let mut new = split(&part, &triangles);
    for draft in &mut new {
        draft.error_bounds = bounds;
        draft.error = error;
        draft.level = level;
    }
    Outcome::Coarser { bounds, error, old, new }
}
