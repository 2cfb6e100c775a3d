//! The data of clusters that shaders read. Each struct has the layout of the struct in `wgsl/` that
//! its comment names.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3, Vec4};
use umbrage_clusters::{Ball, ClusterMesh};

/// `ShadowClusterNode`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) ball: Ball,
    pub(crate) error: f32,
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) kind: u32,
}

/// The kinds of nodes, as in `wgsl/cluster_types.wesl`.
pub(crate) const NODES: u32 = 0;
pub(crate) const CLUSTERS: u32 = 1;
pub(crate) const NODES_OF_INSTANCES: u32 = 2;
pub(crate) const INSTANCES: u32 = 3;

/// `ShadowCluster`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Cluster {
    pub(crate) ball: Ball,
    pub(crate) error_ball: Ball,
    pub(crate) error: f32,
    pub(crate) level: u32,
    pub(crate) first_vertex: u32,
    pub(crate) first_triangle: u32,
    pub(crate) triangle_count: u32,
    pub(crate) vertex_count: u32,
    pub(crate) padding: [u32; 2],
}

/// `ShadowClusterInstance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Instance {
    pub(crate) rows: [Vec4; 3],
    pub(crate) low: Vec3,
    pub(crate) stretch: f32,
    pub(crate) root: u32,
    pub(crate) roles: u32,
    pub(crate) caster_batch: u32,
    pub(crate) seen_batch: u32,
}

/// Bits of `Instance::roles`.
pub(crate) const CASTS: u32 = 1;
pub(crate) const SEEN: u32 = 2;

/// `ShadowClusterOrigin`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Origin {
    pub(crate) high: Vec3,
    pub(crate) padding: u32,
    pub(crate) low: Vec3,
    pub(crate) more_padding: u32,
}

/// `ShadowClusterView`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct View {
    pub(crate) s: Vec4,
    pub(crate) t: Vec4,
    pub(crate) w: Vec4,
    pub(crate) densest: f32,
    pub(crate) nearest: f32,
    pub(crate) slope: f32,
    pub(crate) share: f32,
    pub(crate) first_plane: u32,
    pub(crate) plane_count: u32,
    pub(crate) first_draw: u32,
    pub(crate) roles: u32,
    pub(crate) is_picture: u32,
    pub(crate) page_map: u32,
    pub(crate) page_side: u32,
    pub(crate) page_table: u32,
    pub(crate) page_first: [i32; 2],
    pub(crate) page_reach: f32,
    pub(crate) page_still: u32,
}

/// `ShadowClusterDescent`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Descent {
    pub(crate) origin: Origin,
    pub(crate) queue: u32,
    pub(crate) choices: u32,
    pub(crate) padding: [u32; 2],
}

/// `ShadowClusterItem`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Item {
    pub(crate) view: u32,
    pub(crate) instance: u32,
    pub(crate) node: u32,
}

/// `ShadowClusterChoice`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Choice {
    pub(crate) instance: u32,
    pub(crate) cluster: u32,
    pub(crate) draw: u32,
    pub(crate) first: u32,
    pub(crate) block: u32,
    pub(crate) page: u32,
    pub(crate) padding: [u32; 2],
    pub(crate) rows: [[f32; 4]; 3],
}

/// `ShadowClusterDrawing`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Drawing {
    pub(crate) draws: u32,
    pub(crate) spans: u32,
    pub(crate) choices: u32,
    pub(crate) triangles: u32,
    pub(crate) in_pages: u32,
}

/// `ShadowClusterIndexing`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Indexing {
    pub(crate) choices: u32,
    pub(crate) triangles: u32,
    pub(crate) blocks: u32,
    pub(crate) draws: u32,
}

/// `ShadowClusterSpan`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Span {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// `ShadowClusterOccluders`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Occluders {
    pub(crate) distance: Vec4,
    pub(crate) size: Vec2,
    pub(crate) levels: u32,
    pub(crate) padding: u32,
}

/// `ShadowClusterPicture`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Picture {
    pub(crate) size: [u32; 2],
    pub(crate) base: f32,
    pub(crate) per_nearness: f32,
    pub(crate) is_orthographic: u32,
    pub(crate) step: f32,
}

/// The places in the buffer of counts, as in `wgsl/cluster_types.wesl`.
pub(crate) const CHOSEN: usize = 32;
pub(crate) const TRIANGLES: usize = 33;
pub(crate) const BLOCKS: usize = 34;
pub(crate) const SHOWN: usize = 35;
pub(crate) const DRAWS: usize = 40;

/// A point in two parts, which together hold it in double precision almost.
pub(crate) fn split(point: DVec3) -> [Vec3; 2] {
    let high = point.as_vec3();
    [high, (point - high.as_dvec3()).as_vec3()]
}

impl Origin {
    pub(crate) fn new(point: DVec3) -> Self {
        let [high, low] = split(point);
        Self { high, low, ..Self::default() }
    }
}

/// The lists of all meshes, one mesh after the other, with places that count from the first mesh.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pub(crate) nodes: Vec<Node>,
    pub(crate) clusters: Vec<Cluster>,
    pub(crate) vertices: Vec<u32>,
    /// Three bytes each.
    pub(crate) triangles: Vec<[u8; 3]>,
}

impl Lists {
    /// Adds a mesh whose first vertex is this one of the vertex buffers. Returns its first node.
    pub(crate) fn add(&mut self, mesh: &ClusterMesh, first_vertex: u32) -> u32 {
        let Self { nodes, clusters, vertices, triangles } = self;
        let [root, own_clusters] = [nodes.len(), clusters.len()].map(|n| n as u32);
        let [own_vertices, own_triangles] = [vertices.len(), triangles.len()].map(|n| n as u32);
        nodes.extend(mesh.nodes.iter().map(|node| Node {
            ball: node.bounds,
            error: node.error,
            first: node.first + if node.is_leaf == 1 { own_clusters } else { root },
            count: node.count,
            kind: if node.is_leaf == 1 { CLUSTERS } else { NODES },
        }));
        clusters.extend(mesh.clusters.iter().map(|cluster| Cluster {
            ball: cluster.bounds,
            error_ball: cluster.error_bounds,
            error: cluster.error,
            level: cluster.level,
            first_vertex: own_vertices + cluster.first_vertex,
            first_triangle: own_triangles + cluster.first_triangle,
            triangle_count: cluster.triangle_count,
            vertex_count: cluster.vertex_count,
            padding: [0; 2],
        }));
        vertices.extend(mesh.vertices.iter().map(|v| first_vertex + v));
        triangles.extend_from_slice(&mesh.triangles);
        root
    }
}
