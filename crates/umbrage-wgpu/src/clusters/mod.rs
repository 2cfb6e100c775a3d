//! Clusters of triangles in levels of detail: what they are on a device, how they are chosen for
//! views, and how they are drawn into maps.

mod casters;
pub(crate) mod data;
mod geometry;
mod occluders;
mod selection;
mod tree;
mod view;

pub use casters::ClusterCasters;
pub(crate) use casters::check_share;
pub(crate) use geometry::buffer;
pub use geometry::{
    AttributeLayout, ClusterGeometry, ClusterInstance, ClusterSource, ClusterVertices,
};
pub use occluders::ClusterOccluders;
pub(crate) use selection::ForPages;
pub use selection::{ClusterCounts, ClusterSelection};
pub use view::ClusterView;
pub(crate) use view::PagesOfView;
