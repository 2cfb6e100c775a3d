//! Whether a mesh of clusters can be drawn without harm.

use crate::{Ball, Cluster, ClusterMesh, Node};

/// What is wrong with a [`ClusterMesh`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Flaw {
    /// A cluster breaks a limit or names what is not there.
    #[error("cluster {cluster}: {what}")]
    Cluster {
        /// The place of the cluster.
        cluster: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// A node breaks a limit or names what is not there.
    #[error("node {node}: {what}")]
    Node {
        /// The place of the node.
        node: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// Nodes or clusters that the root does not lead to, or leads to twice.
    #[error("the tree does not lead to each node and each cluster once")]
    Tree,
}

impl ClusterMesh {
    /// Whether all indices lead somewhere, all counts keep to their limits, and the nodes form one
    /// tree over all clusters, for a mesh of `vertices` vertices.
    ///
    /// # Errors
    ///
    /// The first flaw found.
    pub fn check(&self, vertices: usize) -> Result<(), Flaw> {
        for (i, cluster) in self.clusters.iter().enumerate() {
            let flaw = |what| Err(Flaw::Cluster { cluster: i, what });
            if !is_ball(&cluster.bounds) || !is_ball(&cluster.error_bounds) {
                return flaw("bounds are not finite");
            }
            if !(cluster.error >= 0.0 && cluster.error.is_finite()) {
                return flaw("the error is not finite");
            }
            let count = cluster.vertex_count as usize;
            let own = range(&self.vertices, cluster.first_vertex, cluster.vertex_count);
            let Some(own) = own.filter(|_| (1..=Cluster::MAX_VERTICES).contains(&count)) else {
                return flaw("vertices are out of range");
            };
            if own.iter().any(|&v| v as usize >= vertices) {
                return flaw("the mesh has no such vertex");
            }
            let triangles = cluster.triangle_count as usize;
            let own = range(&self.triangles, cluster.first_triangle, cluster.triangle_count);
            let Some(own) = own.filter(|_| (1..=Cluster::MAX_TRIANGLES).contains(&triangles))
            else {
                return flaw("triangles are out of range");
            };
            if own.as_flattened().iter().any(|&i| usize::from(i) >= count) {
                return flaw("it has no such vertex");
            }
        }
        self.check_tree()
    }

    fn check_tree(&self) -> Result<(), Flaw> {
        // Whatever comes after its parent, once, hangs on the root without a cycle.
        let mut next_node = usize::from(!self.nodes.is_empty());
        let mut is_met = vec![false; self.clusters.len()];
        for (i, node) in self.nodes.iter().enumerate() {
            let flaw = |what| Err(Flaw::Node { node: i, what });
            if !is_ball(&node.bounds) {
                return flaw("bounds are not finite");
            }
            if node.error.is_nan() || node.error < 0.0 {
                return flaw("the error is no number");
            }
            let (first, count) = (node.first as usize, node.count as usize);
            match node.is_leaf {
                1 => {
                    let own = first.checked_add(count).and_then(|end| is_met.get_mut(first..end));
                    let Some(own) = own.filter(|_| (1..=Node::MAX_CLUSTERS).contains(&count))
                    else {
                        return flaw("clusters are out of range");
                    };
                    if own.contains(&true) {
                        return Err(Flaw::Tree);
                    }
                    own.fill(true);
                }
                0 => {
                    let own = range(&self.nodes, node.first, node.count);
                    let Some(own) = own.filter(|_| (1..=Node::WIDTH).contains(&count)) else {
                        return flaw("children are out of range");
                    };
                    // Breadth first, each node's children follow those of the node before.
                    if first != next_node || first <= i {
                        return Err(Flaw::Tree);
                    }
                    next_node += count;
                    if own.iter().any(|child| child.error > node.error) {
                        return flaw("a child has the larger error");
                    }
                }
                _ => return flaw("it is neither a leaf nor not"),
            }
        }
        if next_node != self.nodes.len() || is_met.contains(&false) {
            return Err(Flaw::Tree);
        }
        Ok(())
    }
}

fn is_ball(ball: &Ball) -> bool {
    ball.center.is_finite() && ball.radius.is_finite() && ball.radius >= 0.0
}

fn range<T>(all: &[T], first: u32, count: u32) -> Option<&[T]> {
    let first = first as usize;
    all.get(first..first.checked_add(count as usize)?)
}
