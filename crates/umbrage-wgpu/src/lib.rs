#![doc = include_str!("../README.md")]
//!
//! # What there is
//!
//! - [`Shadows`] holds the depth texture and all that lookup needs. Each frame,
//!   [prepare](Shadows::prepare) it for a plan, encode the passes that [`Prepared::encode`] asks
//!   for, and bind [`Shadows::lookup_bind_group`] where you shade.
//! - [`Shadows::lookup_wgsl`] is the text to put before your shader's. It declares
//!   `shadow_visibility(light, position, normal) -> f32`.
//! - [`MeshCasters`] draws plain meshes into the maps, alpha-masked ones too. Or draw casters with
//!   pipelines of your own: a [`MapPass`] gives the matrix, the viewport and the culling,
//!   [`Shadows::depth_stencil_state`] and [`Shadows::primitive_state`] give the states,
//!   [`Shadows::caster_wgsl`] gives the shader's part, and [`Shadows::caster_fragment`] the
//!   fragment stage that the device needs.
//! - [`ClusterCasters`] draws static models of any number of triangles into the maps, as finely as
//!   the maps' texels can tell; [`ClusterSelection`] and [`ClusterOccluders`] do so for your
//!   picture.
//! - [`SeenReadback`] reduces the viewer's depth buffer to what the camera sees, for the planner to
//!   fit the maps of a later frame to.
//! - The [`cookbook`] has recipes: casters and shading of your own, several cameras, and others.
//! - [`Support`] says what a device can do, and documents what takes the place of what it cannot
//!   do.
//!
//! # Spaces
//!
//! *Render space* is world space moved by [`Frame::render_origin`]: what your vertex buffers and
//! shaders hold in single precision. Renderers that work in world space leave the origin at zero;
//! those that work relative to the camera give the eye. All other conventions are those of
//! [`umbrage`](umbrage#conventions).
//!
//! # Bias
//!
//! There is none to tune. The map's matrix and the receiver's plane alone give the depth that this
//! plane has at each texel, and what a texel cannot tell (see [`umbrage::visibility`]). The lookup
//! needs the normal of the *triangle*: interpolated normals bend away from the triangle's plane,
//! and the surface then shadows itself. [`Bias`] adds a margin where the geometry that casts is
//! coarser than the geometry that receives.
//!
//! # What a frame costs
//!
//! A lookup is straight-line code for each filter, and costs least under maps without a warp, then
//! under warps of parallel light. A light with one map needs no search for it; slices without
//! overlaps are found by their distance along the view. Faces, overlaps and lamps test planes in
//! a loop. [`LookupBuffers`] has the kinds of buffers.
//!
//! A map whose matrix, size and casters are as they were is not drawn again. With
//! [`Casters::Unmoved`] and a camera that does not move, nothing is encoded at all. With
//! [`Casters::MovedIn`], only the texels that the moved casters can cast into are drawn again, with
//! all casters whose boxes meet the beams through them ([`MapPass::may_cast`]). Prefilters encode
//! and blur only these texels and those within reach of the blur. The maps are the same, bit by
//! bit, as if all of them had been drawn. For one walking character in a forest of 640 000
//! triangles that is 0.02 to 0.2 of the triangles, and 0.01 of the time or less on a device that
//! draws in software. A map whose matrix changes, as maps do that follow a moving camera, is drawn
//! as a whole.
//!
//! A light that nothing seen is in has empty maps, which have no texels, no pass and no upload.
//! Buffers grow and are kept; the texture is made anew only where a map outgrows its place in it.
//!
//! # Losing the device
//!
//! Nothing here waits for the device or panics on its loss; creating things on a lost device gives
//! things that do nothing. wgpu reports the loss ([`wgpu::Device::set_device_lost_callback`]); make
//! new [`Shadows`] on the new device.

mod casters;
mod clusters;
// The recipes are compiled and run by the tests in `tests/gpu/cookbook.rs`.
#[cfg(all(doc, not(doctest)))]
pub mod cookbook;
mod culling;
mod data;
mod error;
mod pages;
mod passes;
mod prefilter;
mod readback;
mod redraw;
mod seen;
mod shadows;
mod slots;
mod support;
mod wgsl;

pub use casters::{CasterInstance, Mask, MeshCasters, MeshKind};
pub use clusters::{
    AttributeLayout, ClusterCasters, ClusterCounts, ClusterGeometry, ClusterInstance,
    ClusterOccluders, ClusterSelection, ClusterSource, ClusterVertices, ClusterView,
};
pub use error::Error;
pub use pages::{
    PageCasters, PageClusters, PageCounts, PageFrame, PageMesh, PageMeshCounts, PageMeshDraw,
    PageMeshPart, PageMeshPass, PageMeshes, PageParts, PagePool, PageTimestamps, PreparedPages,
};
pub use passes::{MapPass, Prepared, Timestamps};
pub use redraw::Redraw;
pub use seen::{DepthProjection, SeenReadback};
pub use shadows::{
    Bias, Casters, Comparison, DEPTH_FORMAT, Frame, Layout, LookupBuffers, ShadowOptions, Shadows,
};
pub use support::Support;

// Their types are in this API: whoever names them by these paths has the versions that fit.
pub use {glam, umbrage, umbrage_clusters, wgpu};
