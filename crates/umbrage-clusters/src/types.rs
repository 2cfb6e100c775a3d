use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A mesh as clusters of some hundred triangles in many levels of detail.
///
/// Which clusters are drawn follows from one rule, which every cluster can answer by itself, and
/// whose answers make a surface without gaps: a cluster is drawn where its own
/// [error](Cluster::error) is allowed and that of what replaces it, its
/// [group's](Node::error), is not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClusterMesh {
    /// The clusters. Those of one group lie next to each other.
    pub clusters: Vec<Cluster>,
    /// The tree over all groups. The first node is the root; without triangles there is none.
    pub nodes: Vec<Node>,
    /// The vertices of each cluster, one cluster after the other: indices of the mesh's vertices.
    pub vertices: Vec<u32>,
    /// The triangles of each cluster, one cluster after the other: their corners as indices into
    /// the cluster's own vertices.
    pub triangles: Vec<[u8; 3]>,
}

/// A ball in mesh space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ball {
    /// Metres.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
}

/// Some triangles of one level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Cluster {
    /// A ball around the cluster's triangles.
    pub bounds: Ball,
    /// The ball in which this cluster's error counts: that of the group which it simplifies. For
    /// clusters of the mesh's own triangles it is `bounds`.
    pub error_bounds: Ball,
    /// How far the triangles may lie from those of the mesh, and those of the mesh from these,
    /// metres; 0 for the mesh's own triangles.
    pub error: f32,
    /// How often these triangles were simplified; 0 for the mesh's own.
    pub level: u32,
    /// The place of the first vertex in [`ClusterMesh::vertices`].
    pub first_vertex: u32,
    /// The number of vertices, at most [`Cluster::MAX_VERTICES`].
    pub vertex_count: u32,
    /// The place of the first triangle in [`ClusterMesh::triangles`].
    pub first_triangle: u32,
    /// The number of triangles, at most [`Cluster::MAX_TRIANGLES`].
    pub triangle_count: u32,
}

impl Cluster {
    /// The most triangles of a cluster.
    pub const MAX_TRIANGLES: usize = 128;
    /// The most vertices of a cluster.
    pub const MAX_VERTICES: usize = 128;
}

/// A node of the tree over a mesh's groups. A group is some clusters that are replaced together by
/// coarser ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    /// A ball that contains the balls of all groups below. For a leaf it is the ball in which the
    /// error of its clusters' replacement counts.
    pub bounds: Ball,
    /// The largest error of what replaces a group below, metres; infinite where nothing does. Where
    /// this error is allowed, nothing below is drawn.
    pub error: f32,
    /// The place of the first child: in [`ClusterMesh::clusters`] if the node is a leaf, else in
    /// [`ClusterMesh::nodes`].
    pub first: u32,
    /// The number of children: at most [`Node::WIDTH`] nodes, or [`Node::MAX_CLUSTERS`] clusters.
    pub count: u32,
    /// 1 if the node is a leaf, which stands for one group, or else 0.
    pub is_leaf: u32,
}

impl Node {
    /// The most nodes below a node.
    pub const WIDTH: usize = 8;
    /// The most clusters of a group.
    pub const MAX_CLUSTERS: usize = 32;
}
