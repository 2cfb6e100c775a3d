//! A small forward renderer for Umbrage's scenes, with textures, one light, a sky and tone mapping.
//! Its shadows come from [`umbrage_wgpu`], of which it uses only the public API.
//!
//! - [`Gpu`] is a device, opened here or by a window; [`devices`] reports on all adapters.
//! - [`SceneBuffers`] hold the meshes and materials of a scene on the device.
//! - [`Renderer`] draws the maps of a plan, and then [frames](Renderer::frame) to display, with
//!   or without [overlays](Overlay), or [samples](Renderer::samples) to measure.
//! - [`FrameTarget`] is what frames, and [pictures of the maps](Renderer::show_map), are drawn
//!   into.
//! - [`Timer`] measures what the stages of frames take.

mod clusters;
mod error;
mod frame_target;
mod gpu;
mod instances;
mod map_picture;
mod overlay;
mod pages;
mod pipelines;
mod points;
mod pool_picture;
mod renderer;
mod samples;
mod scene;
mod timer;
mod view;
mod whole;

pub use error::Error;
pub use frame_target::{FRAME_FORMAT, FrameTarget};
pub use gpu::{AdapterReport, Gpu, devices};
pub use instances::EdgeOn;
pub use overlay::{LEVEL_COLORS, Overlay, PARTITION_COLORS, SCALE_COLORS};
pub use renderer::{Drawn, Renderer, Shading};
pub use samples::{Sample, SeenCluster};
pub use scene::SceneBuffers;
pub use timer::{Stage, StageTimes, Timer};

/// The README's examples are tests. They are here, because this crate stays in the repository: the
/// crates that they are about are also published, where there is no such file.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
