//! Shadow maps with *known* error for any wgpu renderer: depth passes over a [`Plan`](umbrage::Plan), and a WGSL module
//! that looks all its maps up in one pass of your own shaders.
//!
//! The library brings no renderer, no device and no global state. What there is:
//!
//! - [`Shadows`] has the depth texture and all that lookup needs. Each frame [`Shadows::prepare`] it for a plan, encode
//!   the passes that [`Prepared::encode`] asks for, and bind [`Shadows::lookup_bind_group`] where you shade.
//! - [`Shadows::lookup_wgsl`] is the text to put before your shader: it has
//!   `shadow_visibility(light, position, normal) -> f32`.
//! - [`MeshCasters`] draws plain meshes into the maps, alpha-masked ones too. Or draw with pipelines
//!   of your own: a [`MapPass`] gives matrix, viewport and culling, [`Shadows::depth_stencil_state`]
//!   and [`Shadows::primitive_state`] the states, [`Shadows::caster_wgsl`] the shader's part and
//!   [`Shadows::caster_fragment`] the fragment stage.
//! - [`Support`] says what a device can do, and documents what takes the place of what it cannot.
//!
//! # Spaces
//!
//! *Render space* is world space moved by [`Frame::render_origin`]: what your vertex buffers and shaders hold in single
//! precision. World-space renderers leave the origin at zero, camera-relative ones give the eye. All else is as in
//! [`umbrage`].
//!
//! # Bias
//!
//! There is none to tune. The lookup takes the map's own Jacobian at the receiver, from which follow the depth that its
//! plane has at each texel and what a texel cannot tell (see [`umbrage::visibility`]). It needs the normal of the
//! *triangle*: interpolated normals bend away from it, and self-shadowing with them. [`Bias`] adds to it where geometry
//! that casts is coarser than what receives.
//!
//! # A frame
//!
//! ```no_run
//! # use umbrage::*;
//! # use umbrage_wgpu::{Casters, Frame, Shadows, ShadowOptions, Support, Timestamps};
//! # struct Model { aabb: Aabb }
//! # impl Model { fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {} }
//! # fn frame(adapter: &wgpu::Adapter, device: &wgpu::Device, queue: &wgpu::Queue, camera: &Camera, sun: Light,
//! #     bounds: &Bounds<'_>, models: &[Model], caster_pipeline: &wgpu::RenderPipeline) -> Result<(), Box<dyn std::error::Error>> {
//! // Once:
//! let support = Support::new(adapter, device)?;
//! let mut shadows = Shadows::new(device, support, &ShadowOptions::default())?;
//! let mut planner = Planner::new();
//!
//! // Each frame:
//! let plan = planner.plan(camera, &[sun], bounds, &Options::default())?;
//! let frame = Frame { plan, render_origin: glam::DVec3::ZERO, casters: Casters::Still };
//! let prepared = shadows.prepare(device, queue, &frame)?;
//! let mut encoder = device.create_command_encoder(&Default::default());
//! prepared.encode(&mut encoder, &Timestamps::default(), |map| {
//!     map.pass.set_pipeline(caster_pipeline);
//!     for model in models.iter().filter(|m| map.map.may_cast(m.aabb)) {
//!         model.draw(map.pass);
//!     }
//! });
//! // Then shade, with `shadows.lookup_bind_group()` bound.
//! # Ok(()) }
//! ```
//!
//! # What a frame costs
//!
//! Maps whose matrix, size and casters are as they were are not drawn again: with [`Casters::Still`] and an unmoved
//! camera nothing is encoded at all. Empty maps have no texels and no pass. Buffers grow and are kept; the
//! texture is made anew only where a map outgrows its place.
//!
//! # Losing the device
//!
//! Nothing here waits for the device or panics on its loss; creating things on a lost device gives things that do
//! nothing. wgpu reports the loss ([`wgpu::Device::set_device_lost_callback`]); make a new [`Shadows`] on the new device.

mod casters;
mod data;
mod error;
mod passes;
mod prefilter;
mod shadows;
mod slots;
mod support;
mod wgsl;

pub use casters::{CasterInstance, Mask, MeshCasters, MeshKind};
pub use error::Error;
pub use passes::{MapPass, Prepared, Timestamps};
pub use shadows::{Bias, Casters, Comparison, DEPTH_FORMAT, Frame, Layout, ShadowOptions, Shadows};
pub use support::Support;
