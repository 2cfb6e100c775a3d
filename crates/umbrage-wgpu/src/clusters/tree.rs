//! The tree over instances, by which those that a view does not see are passed over in groups.

use super::data::{INSTANCES, NODES_OF_INSTANCES, Node};
use glam::Vec3;
use umbrage_clusters::Ball;

/// The most children of a node.
const WIDTH: usize = umbrage_clusters::Node::WIDTH;

/// The order of the instances in the tree, and its nodes with the root first. `balls` are around
/// the instances. The first node in the list will be node `first` of all.
pub(crate) fn tree(balls: &[Ball], first: u32) -> (Vec<u32>, Vec<Node>) {
    let mut order: Vec<u32> = (0..balls.len() as u32).collect();
    let mut nodes = vec![Node::default()];
    // Each node comes with its place in the list and its instances.
    let mut open = vec![(0, 0..balls.len())];
    while let Some((place, range)) = open.pop() {
        let ball = around(order[range.clone()].iter().map(|&i| balls[i as usize]));
        let is_leaf = range.len() <= WIDTH;
        let children = nodes.len();
        nodes[place] = Node {
            ball,
            error: f32::INFINITY,
            first: if is_leaf { range.start as u32 } else { first + children as u32 },
            count: range.len() as u32,
            kind: if is_leaf { INSTANCES } else { NODES_OF_INSTANCES },
        };
        if is_leaf {
            continue;
        }
        // Halves of halves of halves.
        let mut parts = vec![range];
        while parts.len() < WIDTH {
            let split = |part: std::ops::Range<usize>| {
                if part.len() < 2 {
                    return vec![part];
                }
                let middle = part.start + part.len() / 2;
                let own = &mut order[part.clone()];
                let center = |i: &u32| balls[*i as usize].center;
                let [mut min, mut max] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
                for i in own.iter() {
                    min = min.min(center(i));
                    max = max.max(center(i));
                }
                let axis = (max - min).max_position();
                let along = |a: &u32, b: &u32| center(a)[axis].total_cmp(&center(b)[axis]);
                own.select_nth_unstable_by(middle - part.start, along);
                vec![part.start..middle, middle..part.end]
            };
            parts = parts.into_iter().flat_map(split).collect();
        }
        nodes[place].count = parts.len() as u32;
        nodes.resize(children + parts.len(), Node::default());
        open.extend((children..).zip(parts));
    }
    (order, nodes)
}

/// The number of rounds in which a view goes down from a root to the last leaves.
pub(crate) fn depth(nodes: &[Node], first: u32, inner: u32) -> u32 {
    let mut depths = vec![1u32; nodes.len()];
    // Children follow their parents.
    let mut deepest = 1;
    for i in 0..nodes.len() {
        let Node { first: child, count, kind, .. } = nodes[i];
        if kind == inner {
            for k in child..child + count {
                depths[(k - first) as usize] = depths[i] + 1;
                deepest = deepest.max(depths[i] + 1);
            }
        }
    }
    deepest
}

/// A ball around balls.
fn around(balls: impl Iterator<Item = Ball> + Clone) -> Ball {
    let [mut min, mut max] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    for ball in balls.clone() {
        min = min.min(ball.center - ball.radius);
        max = max.max(ball.center + ball.radius);
    }
    if min.cmpgt(max).any() {
        return Ball::default();
    }
    let center = 0.5 * (min + max);
    let radius = balls.fold(0.0f32, |r, b| r.max(b.center.distance(center) + b.radius));
    Ball { center, radius: radius * (1.0 + 1e-5) + f32::EPSILON * center.abs().max_element() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instance_is_in_one_leaf_and_inside_all_nodes_above() {
        let mut seed = 1u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        for count in [0, 1, 7, 8, 9, 15, 64, 65, 1000, 5000] {
            let balls: Vec<Ball> = (0..count)
                .map(|_| Ball {
                    center: 100.0 * Vec3::new(random(), 0.1 * random(), random()),
                    radius: random(),
                })
                .collect();
            let (order, nodes) = tree(&balls, 100);
            let mut found = vec![0; count];
            let mut open = vec![(0, Vec::new())];
            while let Some((i, mut above)) = open.pop() {
                let node: Node = nodes[i];
                above.push(node.ball);
                assert!(node.count as usize <= WIDTH);
                for child in node.first..node.first + node.count {
                    if node.kind == NODES_OF_INSTANCES {
                        open.push((child as usize - 100, above.clone()));
                        continue;
                    }
                    let own = order[child as usize] as usize;
                    found[own] += 1;
                    let Ball { center, radius } = balls[own];
                    let inside = |b: &Ball| b.center.distance(center) + radius <= b.radius;
                    assert!(above.iter().all(inside), "{count}");
                }
            }
            assert!(found.iter().all(|&n| n == 1), "{count}");
            let rounds = depth(&nodes, 100, NODES_OF_INSTANCES);
            assert!(8usize.pow(rounds) >= count.max(1) && rounds <= 6, "{count}: {rounds}");
        }
    }
}
