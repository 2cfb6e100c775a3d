//! Meshes as clusters of triangles in levels of detail, after Karis, *A Deep Dive into Nanite
//! Virtualized Geometry*, SIGGRAPH 2021.
//!
//! Every cluster knows how far it lies from the mesh, measured both ways and in metres: see
//! [`Cluster::error`]. [`build`] makes clusters; [`write()`] and [`read`] keep them in files, whose
//! format `FORMAT.md` describes.

mod ball;
mod check;
mod file;
mod input;
mod types;

#[cfg(feature = "build")]
mod builder;
#[cfg(feature = "build")]
mod bvh;
#[cfg(feature = "build")]
mod deviation;
#[cfg(feature = "build")]
mod levels;
#[cfg(feature = "build")]
mod part;
#[cfg(feature = "build")]
mod pieces;
#[cfg(feature = "build")]
mod simplify;
#[cfg(feature = "build")]
mod split;
#[cfg(feature = "build")]
mod tree;

#[cfg(feature = "build")]
pub use builder::{build, build_all, build_finest};
pub use check::Flaw;
pub use file::{FORMAT_VERSION, FileError, read, write};
pub use input::{Error, MeshInput, fingerprint};
pub use types::{Ball, Cluster, ClusterMesh, Node};
