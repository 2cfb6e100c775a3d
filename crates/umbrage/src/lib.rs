#![doc = include_str!("../README.md")]
//!
//! # What there is
//!
//! - A [`Technique`] says which maps there are, how their texels are spread and how they are looked
//!   up. It is also a text, which parses and prints; [`language`] lists the words.
//! - A [`Planner`] computes a [`Plan`] for a [`Camera`], its [`Light`]s, the [`Bounds`] of what
//!   casts and receives shadows, and a technique.
//! - Each [`ShadowMap`] of a plan has its matrix, its resolution, the depth range that it serves,
//!   planes to cull its casters with, and the error that it has ([`MapError`]). [`aliasing`] tells
//!   the error at any point.
//! - An [`Atlas`] gives every map a place in one texture.
//! - [`paged`] has maps of which only the pages exist that the camera sees.
//! - [`visibility`] has the shadow test and its filters, on the CPU.
//! - [`theory`] has the closed forms of the papers behind it all.
//!
//! # Conventions
//!
//! All of them, stated once:
//!
//! - World space is right-handed, +y up, in metres. Angles are radians. A light's direction is the
//!   way its light *travels*.
//! - A transform is named `dst_from_src`. Matrices multiply column vectors.
//! - *Local space* is world space moved by a plan's [`origin`](Plan::origin), so that single
//!   precision suffices far from the world's origin.
//! - *Light space* has +y towards the light, z perpendicular to it in the plane of view direction
//!   and light, on the viewer's forward side, and x = z × y to his right (left-handed, as in Wimmer
//!   et al. 2004, §3.4). For a spot light this is the space after the light's own perspective.
//! - *Shadow space* is (s, t, depth): s across and t along the warp's axis, both in [0, 1]; depth
//!   in [0, 1] with 0 nearest the light. Texel (i, j) of a map of `res` texels has its centre at
//!   ((i + ½)/res.x, (j + ½)/res.y).
//! - Symbols are those of the papers: n, f for the near and far distance, φ for half a field of
//!   view, θ for the angle between view and light direction, λ for the distance from the warp's
//!   centre of projection to its near plane, μ for the warp's depth range.

pub mod aliasing;
mod atlas;
mod bounds;
mod box_tree;
mod camera;
mod casters;
mod error;
mod focus;
mod light;
mod math;
mod matrices;
pub mod paged;
mod partition;
mod plan;
mod planner;
mod resolution;
mod seen;
mod slab;
mod stable;
mod technique;
pub mod theory;
pub mod visibility;
mod warp;
mod worst;

pub use atlas::{Atlas, AtlasTooLarge, Place, ScaleOffset};
pub use bounds::{Aabb, Bounds, Plane};
pub use box_tree::BoxTree;
pub use camera::{Camera, ClipDepth, LookAt, Orthographic, ViewRay};
pub use error::Error;
pub use light::{Light, PointLight, SpotLight};
pub use plan::{
    Beam, CubeSide, Face, Fade, MapError, Part, Plan, PlannedLight, Receiver, Rows, ShadowMap, Slab,
};
pub use planner::Planner;
pub use seen::{Seen, SeenTile, SeenTiles};
pub use technique::language;
pub use technique::{Cover, Faces, Limits, Objective, Partition, Size, Splits, Technique, Warp};

// Its types are in this API: whoever names them by this path has the version that fits.
pub use glam;
