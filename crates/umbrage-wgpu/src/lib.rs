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
//! There is none to tune. The lookup takes the map's own Jacobian at the receiver. From this follow
//! the depth that the receiver's plane has at each texel, and what a texel cannot tell (see
//! [`umbrage::visibility`]). The lookup needs the normal of the *triangle*: interpolated normals
//! bend away from the triangle's plane, and the surface then shadows itself. [`Bias`] adds a margin
//! where the geometry that casts is coarser than the geometry that receives.
//!
//! # What a frame costs
//!
//! A map whose matrix, size and casters are as they were is not drawn again. With
//! [`Casters::Unmoved`] and a camera that does not move, nothing is encoded at all. Empty maps have
//! no texels and no pass. Buffers grow and are kept; the texture is made anew only where a map
//! outgrows its place in it.
//!
//! # Losing the device
//!
//! Nothing here waits for the device or panics on its loss; creating things on a lost device gives
//! things that do nothing. wgpu reports the loss ([`wgpu::Device::set_device_lost_callback`]); make
//! new [`Shadows`] on the new device.

mod casters;
// The recipes are compiled and run by the tests in `tests/gpu/cookbook.rs`.
#[cfg(all(doc, not(doctest)))]
pub mod cookbook;
mod data;
mod error;
mod passes;
mod prefilter;
mod seen;
mod shadows;
mod slots;
mod support;
mod wgsl;

pub use casters::{CasterInstance, Mask, MeshCasters, MeshKind};
pub use error::Error;
pub use passes::{MapPass, Prepared, Timestamps};
pub use seen::{DepthProjection, SeenReadback};
pub use shadows::{Bias, Casters, Comparison, DEPTH_FORMAT, Frame, Layout, ShadowOptions, Shadows};
pub use support::Support;

// Their types are in this API: whoever names them by these paths has the versions that fit.
pub use {glam, umbrage, wgpu};
