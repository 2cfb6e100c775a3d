//! The tree over a mesh's groups.

use crate::levels::Group;
use crate::split::adapter;
use crate::{Ball, Node};
use glam::Vec3;

/// A node whose children are not in their final places.
struct Branch {
    bounds: Ball,
    error: f32,
    children: Children,
}

enum Children {
    Nodes(Vec<Branch>),
    Clusters { first: u32, count: u32 },
}

/// One tree over the groups of each round, since those are about equally coarse, then one over
/// the rounds.
pub(crate) fn tree(groups: &[Group]) -> Vec<Node> {
    let mut roots = Vec::new();
    for round in groups.chunk_by(|a, b| a.round == b.round) {
        let leaves = round.iter().map(|group| Branch {
            bounds: group.bounds,
            error: group.error,
            children: Children::Clusters { first: group.first, count: group.count },
        });
        let mut row: Vec<Branch> = leaves.collect();
        while row.len() > 1 {
            row = joined(in_space(row));
        }
        roots.extend(row);
    }
    // Neighbours here are neighbours in coarseness.
    while roots.len() > 1 {
        roots = joined(roots);
    }
    roots.pop().map_or(Vec::new(), flat)
}

/// In an order in which each next [`Node::WIDTH`] lie close together.
fn in_space(row: Vec<Branch>) -> Vec<Branch> {
    if row.len() <= Node::WIDTH {
        return row;
    }
    let centers: Vec<Vec3> = row.iter().map(|branch| branch.bounds.center).collect();
    let order = meshopt::spatial_cluster_points(&adapter(&centers), Node::WIDTH);
    let mut row: Vec<Option<Branch>> = row.into_iter().map(Some).collect();
    order.iter().filter_map(|&i| row[i as usize].take()).collect()
}

fn joined(row: Vec<Branch>) -> Vec<Branch> {
    let mut row = row.into_iter().peekable();
    let mut result = Vec::new();
    while row.peek().is_some() {
        let children: Vec<Branch> = row.by_ref().take(Node::WIDTH).collect();
        result.push(Branch {
            bounds: Ball::around(children.iter().map(|child| child.bounds)),
            error: children.iter().map(|child| child.error).fold(0.0, f32::max),
            children: Children::Nodes(children),
        });
    }
    result
}

/// Breadth first: parents come before their children, which lie next to each other.
fn flat(root: Branch) -> Vec<Node> {
    let mut row = vec![root];
    let mut nodes = Vec::new();
    while !row.is_empty() {
        let mut next = nodes.len() + row.len();
        let mut below = Vec::new();
        for branch in row {
            let (first, count, is_leaf) = match branch.children {
                Children::Clusters { first, count } => (first, count, 1),
                Children::Nodes(children) => {
                    let place = (next as u32, children.len() as u32, 0);
                    next += children.len();
                    below.extend(children);
                    place
                }
            };
            let (bounds, error) = (branch.bounds, branch.error);
            nodes.push(Node { bounds, error, first, count, is_leaf });
        }
        row = below;
    }
    nodes
}
